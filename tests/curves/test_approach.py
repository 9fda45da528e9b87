"""Speeds of approach against dense samples, and against motions whose use of the limit is known."""

from __future__ import annotations

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from trajcli.curves.approach import ROOM, ApproachLimits, approach_uses, durations_at_limit, uses_of_pieces
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial, taylor_shift

BREAKS = np.array([0.0, 1.0, 2.2, 3.0])


def wild(seed: int) -> tuple[PiecewisePolynomial, ApproachLimits]:
    """Return a curve of quintics through random states, and limits that it uses in part."""
    rng = np.random.default_rng(seed)
    states = rng.normal(size=(3, 4, 2))
    curve = hermite_pieces(BREAKS, states)
    q = curve.evaluate(np.linspace(0, 3, 3001))
    low, high = q.min(axis=0) - rng.uniform(0.05, 0.5, 2), q.max(axis=0) + rng.uniform(0.05, 0.5, 2)
    return curve, ApproachLimits(np.stack([low, high], axis=1), rng.uniform(2, 20, 2), np.full(2, 0.2))


def sampled_use(curve: PiecewisePolynomial, limits: ApproachLimits, count: int = 60_001) -> np.ndarray:
    """Return the largest v / (sqrt(2 d x) - o) of each component, by its definition at many times."""
    t = np.linspace(curve.start, curve.end, count)
    q, v = curve.evaluate(t), curve.evaluate(t, 1)
    ahead = np.where(v > 0, limits.position[:, 1] - q, q - limits.position[:, 0])
    bound = np.sqrt(2 * limits.deceleration * ahead) - limits.offset
    return np.where(np.abs(v) > 0, np.abs(v) / np.maximum(bound, ROOM), 0.0).max(axis=0)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_use_is_the_largest_of_all_times(seed: int) -> None:
    curve, limits = wild(seed)
    for use, sampled in zip(
        approach_uses(curve.breaks, curve.coefficients, limits), sampled_use(curve, limits), strict=True
    ):
        if sampled > 1e6:
            assert use.used > 1e6
            continue
        rounding = (
            1e-11 + 1e-12 * sampled
        )  # distances count for as much larger as it may have made them smaller
        assert sampled * (1 - rounding) <= use.used <= sampled * (1 + 1e-3)
        assert use.used == pytest.approx(use.velocity / use.limit, rel=1e-6)
        assert curve.evaluate(use.time, 1)[use.component] == pytest.approx(use.velocity, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_motion_that_is_stretched_by_its_use_uses_all_of_the_limit(seed: int) -> None:
    curve, limits = wild(seed)
    for use in approach_uses(curve.breaks, curve.coefficients, limits):
        if 1e-3 < use.used < 1e4:
            longer = scale_time(curve, use.used)
            other = approach_uses(longer.breaks, longer.coefficients, limits)[use.component]
            assert other.used == pytest.approx(1.0, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_uses_of_pieces_are_those_of_each_piece_alone(seed: int) -> None:
    curve, limits = wild(seed)
    uses, _ = uses_of_pieces(curve.coefficients, curve.lengths, limits, 0.0)
    for k in range(curve.pieces):
        alone = PiecewisePolynomial(curve.breaks[k : k + 2], curve.coefficients[:, k : k + 1])
        for use in approach_uses(alone.breaks, alone.coefficients, limits):
            of_piece = max(uses[k, use.component], uses[k, use.component + 2])
            assert min(of_piece, 1e8) == pytest.approx(min(use.used, 1e8), rel=1e-9)


@pytest.mark.parametrize("factor", [1 - 1e-4, 1.0, 1 + 1e-4])
def test_who_brakes_into_a_bound_is_over_its_limit_by_no_rounding_there(factor: float) -> None:
    """x = d f^2 (T - t)^2 / 2 has v / sqrt(2 d x) = f: near to its end x is rounded to nothing sooner than v."""
    rng = np.random.default_rng(3)
    for sign in (1.0, -1.0) * 40:
        d, duration, bound = rng.uniform((0.5, 0.1, 0.5), (20.0, 2.0, 4.0))
        q = -sign * 0.5 * d * factor**2 * np.array([1.0, -2 * duration, duration**2])
        q[-1] += sign * bound
        limits = ApproachLimits(
            np.array([[-99.0, bound] if sign > 0 else [-bound, 99.0]]), np.array([d]), np.zeros(1)
        )
        (use,) = approach_uses(np.array([0.0, duration]), q[:, None, None], limits)
        assert use.used == pytest.approx(factor, rel=1e-7)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_braking_with_the_deceleration_of_the_limit_uses_all_of_it_everywhere(sign: float) -> None:
    """With o = 0 the motion x = d (T - t)^2 / 2 has v = sqrt(2 d x): a hundredth of a per cent more is over."""
    d, duration = 3.0, 0.8
    for factor, over in ((1.0, False), (1.0001, True)):
        x = 0.5 * d * factor**2 * np.array([1.0, -2 * duration, duration**2])
        q = -sign * x
        q[-1] += sign * 2.0
        limits = ApproachLimits(np.array([[-2.0, 2.0]]), np.array([d]), np.zeros(1))
        (use,) = approach_uses(np.array([0.0, duration]), q[:, None, None], limits)
        assert use.used == pytest.approx(factor, rel=1e-9)
        assert bool(use.used > 1 + 1e-9) is over
        assert np.sign(use.velocity) == np.sign(use.limit) == sign


def test_near_to_a_bound_only_the_motion_towards_it_counts() -> None:
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([0.4]))  # zone: 0.04
    away = hermite_pieces(np.array([0.0, 2.0]), np.array([[[0.99], [0.5]], [[0.0], [0.0]], [[0.0], [0.0]]]))
    (use,) = approach_uses(away.breaks, away.coefficients, limits)
    assert 0 < use.used < 1
    towards = hermite_pieces(
        np.array([0.0, 2.0]), np.array([[[0.5], [0.97]], [[0.0], [0.0]], [[0.0], [0.0]]])
    )
    (use,) = approach_uses(towards.breaks, towards.coefficients, limits)
    assert use.used > 1e6
    assert (use.limit, use.distance <= 0.04 + 1e-12, use.velocity > 0) == (0.0, True, True)


def test_rest_uses_nothing_wherever_it_is() -> None:
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([0.4]))
    (use,) = approach_uses(np.array([0.0, 1.0]), np.array([[[0.999]]]), limits)
    assert use.used == 0.0


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_lines_and_parabolas_have_uses_too(degree: int) -> None:
    """At constant speed the use is largest where the bound is nearest; further powers are zero."""
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([0.1]))
    line = np.zeros((degree + 1, 1, 1))
    line[-2:, 0, 0] = 0.5, 0.2
    (use,) = approach_uses(np.array([0.0, 1.0]), line, limits)
    assert use.used == pytest.approx(0.5 / (np.sqrt(2 * 2.0 * 0.3) - 0.1), rel=1e-9)
    uses, _ = uses_of_pieces(line, np.ones(1), limits, 0.0)
    assert uses.max() == pytest.approx(use.used)


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_behind_a_bound_nothing_may_move_on(offset: float) -> None:
    """A motion that turns back a little behind its bound passes it at speed, also where no offset is given."""
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([8.0]), np.array([offset]))
    parabola = np.array([-0.5, 1.0, 0.501])[:, None, None]  # up to 1.001 at t = 1
    (use,) = approach_uses(np.array([0.0, 2.0]), parabola, limits)
    assert use.used > 1e4
    assert use.limit < 1e-6
    assert use.distance < offset**2 / 16 + 1e-9
    inside = parabola.copy()
    inside[-1] = 0.4
    (use,) = approach_uses(np.array([0.0, 2.0]), inside, limits)
    assert use.used < 1


@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize("piece", [0, 1, 2])
@pytest.mark.parametrize("middle", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_a_short_approach_is_seen_wherever_in_a_piece_it_is(middle: float, piece: int, upper: bool) -> None:
    """One piece approaches for a tenth of its length and moves away at both ends of it; the others rest."""
    sign, length = 1.0 if upper else -1.0, 2.0
    bump = -np.polymul(
        [1.0, -(middle - 0.05)], [1.0, -(middle + 0.05)]
    )  # of the velocity, over 0 <= t / T <= 1
    rows = np.zeros((4, 3, 1))
    rows[:, piece, 0] = sign * np.polyint(bump) * length / length ** np.arange(3, -1, -1)
    gone = sign * length * np.polyval(np.polyint(bump), 1.0)
    rows[-1, piece + 1 :, 0] = gone
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([0.01]), np.zeros(1))
    curve = PiecewisePolynomial(length * np.arange(4.0), rows)
    (use,) = approach_uses(curve.breaks, curve.coefficients, limits)
    t = np.linspace(0.0, length, 20_001)
    speed = sign * np.polyval(np.polyder(rows[:, piece, 0]), t)
    ahead = 1.0 - sign * np.polyval(rows[:, piece, 0], t)
    share = speed / np.sqrt(2 * 0.01 * ahead)
    away = np.maximum(-speed, 0.0) / np.sqrt(2 * 0.01 * (2.0 - ahead))
    assert share.max() > 1e-2
    assert use.used == pytest.approx(max(share.max(), away.max()), rel=1e-6)
    both, _ = uses_of_pieces(curve.coefficients, curve.lengths, limits, 0.0)
    assert both[piece, 0 if upper else 1] == pytest.approx(share.max(), rel=1e-6)
    assert both[piece, 1 if upper else 0] == pytest.approx(away.max(), rel=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_piece_is_looked_at_to_its_end(side: float) -> None:
    """From rest at an even acceleration the speed is largest where the piece ends, and its use is."""
    rate, length, d, o = 2.0, 1.5, 3.0, 0.2
    limits = ApproachLimits(np.array([[-4.0, 4.0]]), np.array([d]), np.array([o]))
    coefficients = np.array([side * rate / 2, 0.0, 0.0]).reshape(3, 1, 1)
    (use,) = approach_uses(np.array([0.0, length]), coefficients, limits)
    allowed = np.sqrt(2 * d * (4.0 - rate * length**2 / 2)) - o
    assert (use.time, use.velocity) == (length, pytest.approx(side * rate * length))
    assert use.used == pytest.approx(rate * length / allowed, rel=1e-9)


def test_each_end_of_a_range_has_its_own_distance() -> None:
    limits = ApproachLimits(np.array([[-0.5, 1.0]]), np.array([2.0]), np.array([0.1]))
    down, up = limits.bounds(np.array([[-0.1]]))
    assert down[0, 0] == pytest.approx(-(np.sqrt(2 * 2.0 * 0.4) - 0.1))
    assert up[0, 0] == pytest.approx(np.sqrt(2 * 2.0 * 1.1) - 0.1)


@pytest.mark.parametrize("share", [1.0, 0.5, 0.98])
def test_how_long_components_are_at_their_limits(share: float) -> None:
    """Two that brake with the deceleration of their limits, to either side, and one that uses a share of it.

    With o = 0, x = d (T - t)^2 / 2 has v = sqrt(2 d x); a way k^2 times as far in the same time uses k times the limit.
    """
    d, breaks = 3.0, np.array([0.0, 0.5, 2.0])
    full = 0.5 * d * np.array([1.0, -4.0, 4.0])
    columns = np.stack([-full, full, -full * share**2], axis=1)
    columns[-1] += 2.0, -2.0, 2.0
    later = taylor_shift(columns, np.full(3, 0.5))
    coefficients = np.stack([columns, later], axis=1)
    limits = ApproachLimits(np.tile([-2.0, 2.0], (3, 1)), np.full(3, d), np.zeros(3))
    found = durations_at_limit(coefficients, np.diff(breaks), limits, 0.01)
    np.testing.assert_allclose(found, [2.0, 2.0, 2.0 if share > 0.99 else 0.0], atol=1e-6)
    found = durations_at_limit(coefficients, np.diff(breaks), limits, 0.03)
    np.testing.assert_allclose(found, [2.0, 2.0, 2.0 if share > 0.97 else 0.0], atol=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_component_is_at_its_limit_where_it_goes_at_that_speed(sign: float) -> None:
    """A joint at 0.5 rad/s towards 1 rad: sqrt(2 d x) - o falls to that where x = (0.5 + o)^2 / (2 d)."""
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([0.1]))
    line = sign * np.array([0.5, 0.2])[:, None, None]
    found = durations_at_limit(line, np.array([1.5]), limits, 1e-9)
    nearest = (0.5 + 0.1) ** 2 / 4.0
    np.testing.assert_allclose(found, [1.5 - (0.8 - nearest) / 0.5], rtol=1e-6)
    away = durations_at_limit(-line, np.array([0.1]), limits, 1e-9)
    assert away == [0.0]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("turns", [True, False])
def test_who_is_too_near_to_a_bound_may_only_leave_it(turns: bool, side: float) -> None:
    """Half a metre before a bound that may be approached with none but 0 from a metre on: it comes 0.1 nearer.

    It begins there, so that it passes no distance from which on it is too near.
    """
    limits = ApproachLimits(np.array([[-2.0, 2.0]]), np.array([0.5]), np.array([1.0]))
    speed = 0.4 * np.array([-1.0, 1.0]) if turns else np.array([0.0, 0.1])
    rows = side * np.append(speed, 1.5)[:, None, None]  # 0.4 t (1 - t), or 0.1 t
    (use,) = approach_uses(np.array([0.0, 1.0]), rows, limits)
    assert use.used > 1e6
    assert (use.velocity * side, use.limit) == (pytest.approx(0.4 if turns else 0.1), 0.0)
    used, _ = uses_of_pieces(rows, np.ones(1), limits, 1.0)
    assert (used[0] > 1e6).tolist() == [side > 0, side < 0]
    seconds = durations_at_limit(rows, np.ones(1), limits, 1e-3)
    assert seconds == pytest.approx([0.5 if turns else 1.0], abs=1e-9)
    rows[:2] *= -1.0
    (leaves,) = approach_uses(np.array([0.0, 1.0]), rows, limits)
    assert (leaves.used > 1e6) == turns  # and comes back in its second half


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("room", [1e-4, 1e-5, 1e-6])
def test_the_use_of_a_limit_that_is_next_to_nothing_is_as_exact(room: float, side: float) -> None:
    """One who turns back at o^2 / (2 d) + e before a bound uses about o / d sqrt(a / e) of its limit."""
    d, o, a = 1.0, 1.0, 2.0

    def used(left: float) -> float:
        """Return the share at so many seconds before it turns back, by its definition."""
        within = 2 * d * (room + a * left**2)  # what 2 d x is more than o^2
        return float(2 * a * left * (np.sqrt(o**2 + within) + o) / within)

    at = np.sqrt(room / a)
    most = minimize_scalar(lambda share: -used(share * at), bounds=(0.1, 10.0), method="bounded")
    limits = ApproachLimits(np.array([[-3.0, 3.0]]), np.array([d]), np.array([o]))
    distance = np.array([a, -2 * a, a + o**2 / (2 * d) + room])  # a (1 - t)^2 and what is left
    rows = -side * distance
    rows[-1] += side * 3.0
    (use,) = approach_uses(np.array([0.0, 1.2]), rows[:, None, None], limits)
    assert use.used == pytest.approx(-most.fun, rel=1e-6)
    assert use.time == pytest.approx(1.0 - most.x * at, abs=1e-4 * at)
    assert use.velocity / use.limit == pytest.approx(use.used, rel=1e-6)
    for at_least in (0.0, 0.5 * use.used):
        pieces, when = uses_of_pieces(rows[:, None, None], np.array([1.2]), limits, at_least)
        assert pieces.max() == pytest.approx(-most.fun, rel=1e-6)
        assert when[0, int(pieces.argmax())] == pytest.approx(use.time)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_behind_a_bound_the_distance_to_it_is_negative(side: float) -> None:
    limits = ApproachLimits(np.array([[-1.0, 1.0]]), np.array([2.0]), np.array([0.1]))
    (use,) = approach_uses(np.array([0.0, 1.0]), side * np.array([0.1, 1.1])[:, None, None], limits)
    assert (use.limit, use.velocity) == (0.0, side * 0.1)
    assert -0.2 - 1e-9 <= use.distance <= -0.1 + 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_all_the_times_at_a_limit_count(sign: float) -> None:
    """So far from its bound that the limit stays 1: it is passed for 0.6 s twice, and for 0.3 s twice."""
    speed = -10.0 * np.poly([0.1, 0.4, 0.6, 0.9])
    speed[-1] += 1.0
    way = np.polyint(speed)
    first = way / 2.0 ** np.arange(way.size - 1, -1, -1) * 2.0  # the same in twice the time
    rows = sign * np.stack([first, way], axis=1)[:, :, None]
    limits = ApproachLimits(np.array([[-1e6, 1e6]]), np.array([0.5e-6]), np.zeros(1))
    found = durations_at_limit(rows, np.array([2.0, 1.0]), limits, 1e-9)
    np.testing.assert_allclose(found, [1.8], atol=1e-4)


def test_components_without_a_limit_have_none_at_any_place() -> None:
    limits = ApproachLimits(np.array([[-np.inf, np.inf], [-1.0, 1.0]]), np.array([np.inf, 2.0]), np.zeros(2))
    with np.errstate(all="raise"):
        down, up = limits.bounds(np.array([[3.0, 0.5], [-np.inf, 0.5]]))
    assert (down[:, 0] == -np.inf).all()
    assert (up[:, 0] == np.inf).all()
    assert down[:, 1] == pytest.approx(-np.sqrt(6.0))
    assert up[:, 1] == pytest.approx(np.sqrt(2.0))


@pytest.mark.parametrize("pieces", [1, 2])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_use_that_is_hardly_larger_within_a_piece_than_at_its_ends_is_found(
    side: float, pieces: int
) -> None:
    """Around its largest use a piece so short that nothing in it can be a hundredth more: 4e-6 more it is."""
    d, o, a, room = 1.0, 1.0, 2.0, 1e-2

    def used(left: np.ndarray) -> np.ndarray:
        """Return the share at so many seconds before it turns back, by its definition."""
        speed, distance = 2 * a * left, o**2 / (2 * d) + room + a * left**2
        return np.asarray(speed / (np.sqrt(2 * d * distance) - o))

    grid = np.sqrt(room / a) * np.linspace(0.5, 2.0, 200_001)
    at, most = grid[used(grid).argmax()], used(grid).max()
    begin, end = 1.003 * at, 0.997 * at
    rows = -side * np.array([a, -2 * a * begin, a * begin**2 + o**2 / (2 * d) + room])
    rows[-1] += side * 3.0
    early = rows.copy()
    early[-1] -= side * 1.0  # the same a metre before: it uses less
    limits = ApproachLimits(np.array([[-3.0, 3.0]]), np.array([d]), np.array([o]))
    coefficients = np.stack([early, rows][-pieces:], axis=1)[:, :, None]
    (use,) = approach_uses((begin - end) * np.arange(pieces + 1), coefficients, limits)
    assert max(used(np.array([begin, end]))) < most * (1 - 3e-6)
    assert use.used == pytest.approx(most, rel=1e-8)
    assert use.time == pytest.approx((pieces - 1) * (begin - end) + begin - at, abs=1e-3 * at)
