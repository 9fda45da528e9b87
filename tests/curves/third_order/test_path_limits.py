"""What a law uses of its limits at samples, against derivatives of q(s(t)), and the time that it loses."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import JointJerkConstraint, LawJerkConstraint
from trajcli.curves.third_order.path_limits import (
    SHARES,
    LawLimits,
    all_samples,
    by_share,
    sampled,
    time_lost,
)
from trajcli.curves.third_order.quartic_law import QuarticLaw, ReversingLawError
from trajcli.curves.time_optimal.constraints import JointConstraint

FREE = np.array([[-np.inf, np.inf]] * 2)
VELOCITY = np.array([[-3.0, 2.0], [-1.5, 4.0]])
ACCELERATION = np.array([[-9.0, 5.0], [-6.0, 7.0]])
JERK = np.array([[-30.0, 50.0], [-60.0, 20.0]])


def path_of(seed: int) -> PiecewisePolynomial:
    rng = np.random.default_rng(seed)
    return PiecewisePolynomial(np.array([0.0, 1.0]), rng.normal(size=(5, 1, 2)))


def law() -> QuarticLaw:
    """Return a law of three pieces that gets faster, slower, and rests at its end."""
    return QuarticLaw(
        np.array([0.0, 0.3, 0.7, 1.0]), np.array([0.2, 0.9, 0.6, 0.0]), np.array([0.5, 0.3, -0.9, -0.2])
    )


def derivatives(path: PiecewisePolynomial, share: float) -> list[np.ndarray]:
    """Return the first three derivatives of q(s(t)) by numpy's own polynomials, each (3, 2)."""
    one, result = law(), [np.empty((3, 2)) for _ in range(3)]
    for piece in range(3):
        inner = np.poly1d(one.coefficients[:, piece])
        for joint in range(2):
            whole = np.poly1d(path.coefficients[:, 0, joint])(inner)
            for order in range(3):
                result[order][piece, joint] = whole.deriv(order + 1)(share * one.lengths[piece])
    return result


def shares_of(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    return np.maximum(values / bounds[:, 1], values / bounds[:, 0]).max(axis=1)


@pytest.mark.parametrize("seed", few(range(4), 2))
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("which", ["velocity", "acceleration", "jerk", "all"])
def test_what_is_used_is_the_largest_share_of_any_limit(which: str, share: float, seed: int) -> None:
    path, everything = path_of(seed), which == "all"
    velocity = VELOCITY if everything or which == "velocity" else FREE
    acceleration = ACCELERATION if everything or which == "acceleration" else FREE
    jerk = JERK if everything or which == "jerk" else FREE
    limits = LawLimits((JointConstraint(path, velocity, acceleration),), (JointJerkConstraint(path, jerk),))
    used, rows = limits.used(sampled(law(), share))
    first, second, third = derivatives(path, share)
    # of velocities the caps are of sd^2, and so are the shares
    wanted = np.stack(
        [
            np.where(np.isfinite(velocity).all(), shares_of(first, VELOCITY) ** 2, 0.0),
            np.where(np.isfinite(acceleration).all(), shares_of(second, ACCELERATION), 0.0),
            np.where(np.isfinite(jerk).all(), shares_of(third, JERK), 0.0),
        ]
    )
    np.testing.assert_allclose(used, wanted.max(axis=0), rtol=1e-9, atol=1e-12)
    if np.isfinite(acceleration).all():
        np.testing.assert_allclose(rows.max(axis=0), shares_of(second, ACCELERATION), rtol=1e-9)


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_tighter_of_two_constraints_counts(order: list[int]) -> None:
    """Those of velocity and acceleration, and those of jerk; each piece has its own, whichever comes first."""
    path = path_of(1)
    both = [JointConstraint(path, VELOCITY * k, ACCELERATION * k) for k in (1.0, 0.5)]
    thirds = [JointJerkConstraint(path, JERK), LawJerkConstraint(1e-2)]
    limits = LawLimits(tuple(both[k] for k in order), tuple(thirds[k] for k in order))
    excess = limits.excess(law())
    for row, one, other in zip(
        excess[:2], both[0].excess(law().pieces), both[1].excess(law().pieces), strict=True
    ):
        np.testing.assert_allclose(row, other, rtol=1e-12)
        assert (one < other).all()
    np.testing.assert_allclose(excess[2], thirds[1].excess(law().pieces), rtol=1e-12)
    used, _ = limits.used(sampled(law(), 0.5))
    alone = [LawLimits((each,), (third,)).used(sampled(law(), 0.5))[0] for each in both for third in thirds]
    np.testing.assert_allclose(used, np.max(alone, axis=0), rtol=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_numbers_for_hermite_are_derivatives_of_a_cubic_through_its_ends(share: float) -> None:
    """b and its slopes at both ends of a piece are those of a cubic in time, whose value and two slopes are told."""
    one, cubic = law(), np.poly1d([0.7, -1.1, 0.4, 2.0])
    sample = sampled(one, share)
    for piece, h in enumerate(one.lengths):
        nodes = np.array([cubic(0.0), h * cubic.deriv()(0.0), cubic(h), h * cubic.deriv()(h)])
        at = share * h
        assert nodes @ sample.value[:, 0] == pytest.approx(cubic(at))
        assert nodes @ sample.slope[:, piece] == pytest.approx(cubic.deriv()(at))
        assert nodes @ sample.bend[:, piece] == pytest.approx(cubic.deriv(2)(at))


def test_a_law_at_its_limit_loses_nothing_and_one_that_is_over_loses_the_time_it_must_take_longer() -> None:
    """At one acceleration all the time; 1 % over the limit of velocity, acceleration or jerk costs so much of it."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0, 0.0]], [[0.0, 0.0]]]))
    bound = np.array([[-2.0, 2.0]] * 2)
    limits = LawLimits((JointConstraint(path, FREE, bound),), (JointJerkConstraint(path, FREE),))
    steady = QuarticLaw(np.array([0.0, 0.25, 1.0]), np.array([0.0, 1.0, 2.0]), np.full(3, 2.0))
    np.testing.assert_allclose(time_lost(steady, limits, np.ones((3, 2))), 0.0, atol=1e-9)
    slower = QuarticLaw(np.array([0.0, 0.25, 1.0]), np.array([0.0, 1.0, 2.0]) / 2, np.full(3, 0.5))
    np.testing.assert_allclose(
        time_lost(slower, limits, np.ones((3, 2))), 0.0, atol=1e-9
    )  # it changes nothing
    for order, cost in enumerate((1.0, 1 / 2, 1 / 3)):
        excess = np.full((3, 2), 0.2)
        excess[order, 1] = 1.01
        lost = time_lost(steady, limits, excess)
        np.testing.assert_allclose(lost, [0.0, cost * 0.01 * steady.lengths[1]], rtol=1e-6, atol=1e-9)


def test_two_nodes_at_one_place_lead_nowhere() -> None:
    twice = QuarticLaw(np.array([0.0, 0.5, 0.5, 1.0]), np.array([0.0, 1.0, 1.0, 0.0]), np.zeros(4))
    with pytest.raises(ReversingLawError, match=r"the law stands at s = .*0\.5"):
        twice.calmed()


def test_samples_at_many_shares_are_those_of_each() -> None:
    many, ends = all_samples(law(), SHARES)
    assert (many.side, ends.side) == ("right", "left")
    alone = [sampled(law(), share) for share in SHARES]
    assert [each.side for each in alone] == ["right"] * 4 + ["left"]
    for name in ("value", "slope", "bend"):
        together = by_share((getattr(many, name), getattr(ends, name)), 3)
        assert together.shape == (4, 5, 3)
        for k, each in enumerate(alone):
            np.testing.assert_array_equal(together[:, k], getattr(each, name))
    for k in range(4):
        for number, each in enumerate(alone):
            np.testing.assert_array_equal(by_share((many.state[k], ends.state[k]), 3)[number], each.state[k])
