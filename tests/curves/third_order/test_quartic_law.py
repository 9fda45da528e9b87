"""Laws of quartic pieces: what they pass and when, by polynomials of numpy; which of them lead forward."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.third_order.quartic_law import QuarticLaw, ReversingLawError

S = np.array([0.0, 0.3, 0.7, 1.0, 1.2])
SPEED = np.array([0.2, 0.9, 0.6, 0.5, 0.0])
ACCELERATION = np.array([0.5, 0.3, -0.9, 0.2, -0.3])


def law_of(acceleration=ACCELERATION, speed=SPEED) -> QuarticLaw:
    return QuarticLaw(S, speed, np.array(acceleration))


def state(law: QuarticLaw, piece: int, share: float) -> list[float]:
    """Return s and its first three derivatives by numpy's own polynomials."""
    rows, t = law.coefficients[:, piece], share * law.lengths[piece]
    return [float(np.polyval(np.polyder(rows, k) if k else rows, t)) for k in range(4)]


def test_each_piece_leads_from_node_to_node_in_its_duration():
    law = law_of()
    for piece in range(4):
        for end, share in ((0, 0.0), (1, 1.0)):
            wanted = [S[piece + end], SPEED[piece + end], ACCELERATION[piece + end]]
            assert state(law, piece, share)[:3] == pytest.approx(wanted, abs=1e-12)
    assert law.duration == pytest.approx(law.lengths.sum())
    assert law.forward.all()
    for share in (0.0, 0.3, 1.0):
        wanted = np.array([state(law, piece, share) for piece in range(4)]).T
        np.testing.assert_allclose(law.states(share), wanted, atol=1e-12)
    for given, found in zip((S, SPEED, ACCELERATION), law.states(1.0), strict=False):
        assert found.tolist() == given[1:].tolist()


def test_a_cut_law_is_the_same_law():
    law, parts = law_of(), np.array([1, 3, 2, 1])
    cut = law.cut(parts)
    np.testing.assert_allclose(cut.lengths, np.repeat(law.lengths / parts, parts), rtol=1e-12)
    wanted = [state(law, piece, k / count)[:3] for piece, count in enumerate(parts) for k in range(count)]
    wanted.append([S[-1], SPEED[-1], ACCELERATION[-1]])
    np.testing.assert_allclose(np.array([cut.s, cut.speed, cut.acceleration]).T, wanted, atol=1e-12)


def test_a_slowed_law_has_the_same_states_later():
    law = law_of()
    slow = law.slowed(3.0)
    assert slow.lengths == pytest.approx(3.0 * law.lengths, rel=1e-12)
    for share in (0.2, 0.9):
        for k, (fast, late) in enumerate(zip(law.states(share), slow.states(share), strict=True)):
            np.testing.assert_allclose(late * 3.0**k, fast, atol=1e-12)


def test_a_changed_law_has_the_speed_and_the_acceleration_of_the_chain_rule():
    """With dtau / dt = 1 + 0.1 tau: ds / dt = sd (1 + 0.1 tau), and its derivative by t is that by tau times it."""
    law = law_of()
    tau = np.append(0.0, np.cumsum(law.lengths))
    rate = 1.0 + 0.1 * tau
    changed = law.changed(rate**2, 2.0 * rate * 0.1)
    np.testing.assert_allclose(changed.speed, SPEED * rate, rtol=1e-12)
    np.testing.assert_allclose(changed.acceleration, (ACCELERATION * rate + SPEED * 0.1) * rate, rtol=1e-12)


@pytest.mark.parametrize(
    ("acceleration", "piece", "exists"),
    [
        ([0.5, 0.3, -2.6, 0.2, -0.3], 2, True),  # a control point of its speed is below zero
        ([0.5, 0.3, -0.9, 0.2, 8.0], 3, False),  # no quartic gets there
        ([0.5, -3.0, -0.9, 0.2, -0.3], None, True),  # it slows down and speeds up, and never stands
    ],
)
def test_where_a_law_goes_back_is_known_and_named(acceleration, piece, exists):
    law = law_of(acceleration)
    forward = [k != piece for k in range(4)]
    assert law.forward.tolist() == forward
    if exists:
        t = np.linspace(0.0, 1.0, 101)
        lowest = [min(state(law, k, share)[1] for share in t) for k in range(4)]
        assert all(speed >= -1e-12 for speed, leads in zip(lowest, forward, strict=True) if leads)
    if piece is None:
        return
    with pytest.raises(ReversingLawError, match=rf"s = {S[piece]:.9g}$"):
        law.changed(np.ones(5), np.zeros(5))
    if not exists:
        with pytest.raises(ReversingLawError, match=rf"s = {S[piece]:.9g}$"):
            _ = law.lengths


def test_what_rounding_takes_off_a_speed_of_zero_is_not_backward():
    """The speed vanishes at a node with its acceleration, which differs from zero by rounding."""
    for tiny, forward in ((1e-13, True), (1e-4, False)):
        law = QuarticLaw(np.array([0.0, 1.0, 2e6]), np.array([0.0, 1.0, 1e6]), np.array([-tiny, 0.5, 0.0]))
        assert law.forward[0] == forward


@pytest.mark.parametrize("node", [1, 2, 3])
@pytest.mark.parametrize("size", [-9.0, 9.0])
def test_a_calmed_law_leads_forward_with_the_speeds_and_the_ends_that_it_had(node, size):
    acceleration = ACCELERATION.copy()
    acceleration[node] = size
    law = law_of(acceleration)
    assert not law.forward.all()
    calm = law.calmed()
    assert calm.forward.all()
    assert (calm.s.tolist(), calm.speed.tolist()) == (S.tolist(), SPEED.tolist())
    others = np.arange(5) != node
    mean, h = 0.5 * (SPEED[1:] + SPEED[:-1]), np.diff(S)
    before, behind = (1.4 * SPEED[node] * (mean / h)[node + k] for k in (-1, 0))
    assert calm.acceleration[node] == pytest.approx(before if size > 0 else -behind)
    wanted = np.clip(ACCELERATION, -9.0, 9.0)[others]
    beside = np.abs(np.arange(5) - node)[others] > 1
    assert calm.acceleration[others][beside].tolist() == wanted[beside].tolist()


@pytest.mark.parametrize("size", [-9.0, 9.0])
def test_nodes_beside_which_the_law_leads_forward_keep_their_accelerations(size):
    """That of the fourth is more than a calm one would be, and would be lowered if it had to."""
    given = [0.5, size, -0.9, -1.0, -0.3]
    assert law_of([0.5, 0.3, -0.9, -1.0, -0.3]).forward.all()
    calm = law_of(given).calmed()
    assert calm.acceleration[[0, 3, 4]].tolist() == [0.5, -1.0, -0.3]


def test_a_law_that_leads_forward_is_calm():
    law = law_of([0.5, -3.0, -0.9, 0.2, -0.3])
    assert law.calmed() is law


@pytest.mark.parametrize(
    ("acceleration", "piece"), [([-9.0, 0.3, -0.9, 0.2, -0.3], 0), ([0.5, 0.3, -0.9, 0.2, 8.0], 3)]
)
def test_accelerations_at_the_ends_are_not_calmed(acceleration, piece):
    with pytest.raises(ReversingLawError, match=rf"s = {S[piece]:.9g}$"):
        law_of(acceleration).calmed()


def test_nodes_that_are_one_are_named():
    s = np.array([0.0, 0.3, 0.3, 1.0, 1.2])
    with pytest.raises(ReversingLawError, match=r"stands at s = 0\.3$"):
        QuarticLaw(s, SPEED, ACCELERATION).calmed()
