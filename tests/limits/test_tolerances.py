"""What is a breach and what is rounding."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.limits.tolerances import allowed_at_end, allowed_jump, exceeds, waypoint_tolerance
from trajcli.trajectory import Span, State, Trajectory


@pytest.mark.parametrize("bound", [1e-3, 1.0, 2e4])
def test_a_bound_gives_way_by_a_billionth(bound: float) -> None:
    assert exceeds(bound * (1 + 2e-9) + 1e-12, bound)
    assert not exceeds(bound * (1 + 0.5e-9), bound)
    assert not exceeds(bound, bound)
    assert not exceeds(-2 * bound, bound)


@pytest.mark.parametrize("bound", [-2.0, -1e-3, 0.0])
def test_a_bound_below_zero_gives_way_upwards_too(bound: float) -> None:
    assert not exceeds(bound, bound)
    assert not exceeds(bound + 0.5e-12, bound)
    assert not exceeds(bound + 0.5e-9 * abs(bound), bound)
    assert exceeds(bound + 2e-9 * abs(bound) + 2e-12, bound)


def test_nothing_exceeds_infinity_and_a_number_that_is_none_exceeds_everything() -> None:
    assert not exceeds(1e300, np.inf)
    assert exceeds(np.nan, 1.0)
    assert exceeds([1.0, 3.0], [2.0, 2.0]).tolist() == [False, True]


def test_a_late_break_explains_a_difference_and_a_slow_joint_does_not() -> None:
    allowed = allowed_jump(np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([[1e15, 0.0], [1e15, 0.0]]))
    assert allowed[0] == pytest.approx([1e-9, 1e-12], rel=1e-2)
    assert allowed[1] == pytest.approx([0.444, 1e-12], rel=1e-2)


def of_pieces(breaks: list[float], pieces: list[list[list[float]]]) -> Trajectory:
    """Return a trajectory of two joints from polynomials by piece and joint, highest power first."""
    curve = PiecewisePolynomial(np.array(breaks), np.array(pieces).transpose(2, 0, 1))
    rest = State(*np.zeros((3, 2)))
    return Trajectory(
        curve=curve,
        spans=(Span(0, "any", 0.0, breaks[-1], 2),),
        start=rest,
        end=rest,
        joint_names=("a", "b"),
        joint_types=("revolute",) * 2,
    )


def test_the_end_of_a_piece_may_be_off_by_what_it_is_summed_of_and_by_its_break() -> None:
    """At 2.5 s a joint is where terms of 1e9 cancel, at 2e9 rad/s; the other one is its mirror image, near to zero.

    Eight units of the sum of the terms are 1.9e-6, two units of the break times the velocity 1.8e-6; beside
    them a billionth of five, or of one where the target is less, still tells.
    """
    still = [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    steep = [[4e9, -2e9, -5.0], [-4e9, 2e9, 0.2]]
    made = of_pieces([0.0, 2.0, 2.5], [still, steep])
    allowed = allowed_at_end(made, np.array([2.5, 2.0]), np.array([[-5.0, 0.2], [1.0, 1.0]]))
    steps = 8 * 2.0**-22 + 2 * 2.0**-51 * 2e9  # one unit of 2e9 is 2^-22, of 2.5 2^-51
    assert allowed[0] == pytest.approx([steps + 5e-9 + 1e-12, steps + 1e-9 + 1e-12], rel=1e-9)
    assert allowed[1] == pytest.approx([1e-9 + 1e-12 + 8 * 2.0**-52] * 2, rel=1e-9)


def test_a_fast_joint_may_miss_a_point_by_what_its_time_is_rounded_by() -> None:
    made = of_pieces([0.0, 4.0], [[[1e6, 0.0], [-1e6, 0.0]]])
    allowed = waypoint_tolerance(made, np.array([3.0]), np.array([5.0, 5.0]))
    assert allowed[0] == pytest.approx([1e-12 + 5e-12 + 2 * 2.0**-51 * 1e6] * 2, rel=1e-9)
