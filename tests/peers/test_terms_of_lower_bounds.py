"""Each term of the bounds of durations: by hand, with limits that differ by joint and by direction, and moving ends."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_peer_lower_bound import limits, state
from tiers import few

from trajcli.kinematics.robot import Limits
from trajcli.peers import lower_bound
from trajcli.peers.lower_bound import LowerBound, NoBound, duration_through, fastest_duration
from trajcli.planners.ruckig import BoundaryProblem, fastest

FREE = [-np.inf, np.inf]


def ramps(distance: float, speed: float, up: float, down: float, first: float, last: float) -> float:
    """Return the time of the fastest motion over a distance without a limit of the jerk, all rates positive."""
    peak = min(speed, np.sqrt((2 * distance + first**2 / up + last**2 / down) / (1 / up + 1 / down)))
    ramp = (peak**2 - first**2) / (2 * up) + (peak**2 - last**2) / (2 * down)
    return float((peak - first) / up + (peak - last) / down + (distance - ramp) / peak)


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("mirrored", [1, -1])
@pytest.mark.parametrize(("first", "last"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.4), (0.6, 0.3), (-0.5, -0.3)])
def test_moving_ends_and_directions_count_between_turning_points(
    first: float, last: float, mirrored: int, joint: int
) -> None:
    """Up by 3, down by 2, up by 4; an end against the direction of its stretch counts as rest."""
    velocity, acceleration = np.array([[-1.0, 2.0], [-9.0, 9.0]]), np.array([[-3.0, 4.0], [-50.0, 50.0]])
    other = np.array([0.0, 0.1, 0.2, 0.3])
    q = mirrored * np.array([0.0, 3.0, 1.0, 5.0])
    if mirrored < 0:
        velocity[0], acceleration[0] = -velocity[0, ::-1], -acceleration[0, ::-1]
    order = [0, 1] if joint == 0 else [1, 0]
    points = np.stack([q, other], axis=1)[:, order]
    rates = mirrored * np.array([[first, 0.0], [last, 0.0]])[:, order]
    start, end = state(points[0], rates[0]), state(points[-1], rates[1])
    expected = (
        ramps(3.0, 2.0, 4.0, 3.0, max(first, 0.0), 0.0)
        + ramps(2.0, 1.0, 3.0, 4.0, 0.0, 0.0)
        + ramps(4.0, 2.0, 4.0, 3.0, 0.0, max(last, 0.0))
    )
    found = duration_through(points, start, end, limits(velocity[order], acceleration[order]))
    assert found == LowerBound(pytest.approx(expected, rel=1e-9), joint)  # type: ignore[arg-type]


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_slowest_joint_of_each_segment_counts_at_its_velocity_in_its_direction(order: list[int]) -> None:
    """Both move in each segment, one of them for long: 2 / 0.5, 3 / 1.5, 1 / 0.25 and 2 / 1."""
    points = np.array([[0.0, 0.0], [-2.0, 1.0], [-2.1, 4.0], [-2.0, 3.0], [0.0, 2.99]])
    velocity = np.array([[-0.5, 1.0], [-0.25, 1.5]])
    fast = [[-1e6, 1e6]] * 2
    found = duration_through(
        points[:, order], state(points[0, order]), state(points[-1, order]), limits(velocity[order], fast)
    )
    assert found == LowerBound(pytest.approx(4.0 + 2.0 + 4.0 + 2.0), None)  # type: ignore[arg-type]


def test_no_motion_of_one_joint_from_state_to_state_is_below_it() -> None:
    """Ruckig's own, with accelerations at both ends that may be at their limits, and limits that differ by direction."""
    tried = 0
    for seed in few(range(60), 16):
        rng = np.random.default_rng(seed)
        acceleration, velocity = (np.array([[-a, b]]) for a, b in rng.uniform(1, 4, (2, 2)))
        jerk, toward = float(rng.uniform(3, 30)), rng.choice([-1.0, 1.0])
        given = limits(velocity, acceleration, [[-jerk, jerk]])
        distance, shares = toward * rng.uniform(0.2, 4), rng.choice([-0.999, -0.5, 0.0, 0.5, 0.999], 2)
        rates = [float(share * np.abs(acceleration).min()) for share in shares]
        start = state([0.0], 0.3 * toward, rates[0])
        end = state([distance], 0.2 * toward, rates[1])
        alone = fastest_duration(start, end, given)
        if isinstance(alone, LowerBound):
            found = duration_through(np.array([[0.0], [distance]]), start, end, given)
            assert 0.0 < found.duration <= alone.duration * (1 + 1e-9), seed
            tried += 1
    assert tried >= 10


def test_limits_that_the_peers_own_motions_break_are_those_of_their_joint(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A peer that takes twice as much of each rate, and leaves the range at the end: of the second of three joints."""

    def careless(problem: BoundaryProblem) -> Any:
        doubled = problem.initial == (0.0, 0.0, 0.0) and problem.final[0] in (2.0, -2.0)
        return fastest(replace(problem, bounds=2 * problem.bounds) if doubled else problem)

    monkeypatch.setattr(lower_bound, "fastest", careless)
    for side in (1.0, -1.0):
        position = np.array([[-5.0, 5.0], [-1.5, 1.5], [-5.0, 5.0]])
        given = replace(limits([1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [8.0, 8.0, 8.0]), position=position)
        found = fastest_duration(state([0.1] + [0.0] * 2), state([1.0, 2.0 * side, -1.0]), given)
        assert isinstance(found, LowerBound)
        breaches = {breach.order: breach for breach in found.breaches}
        assert {breach.joint for breach in found.breaches} == {1}
        assert sorted(breaches) == [0, 1, 2, 3]
        assert (breaches[0].value, breaches[0].limit) == (pytest.approx(2.0 * side), 1.5 * side)
        for order, limit in ((1, 1.0), (2, 2.0), (3, 8.0)):
            assert abs(breaches[order].value) == pytest.approx(2 * limit)
            assert abs(breaches[order].limit) == limit
    monkeypatch.undo()
    (alone,) = fastest_duration(state([0.1] + [0.0] * 2), state([1.0, 2.0 * side, -1.0]), given).breaches
    assert (alone.order, alone.joint, alone.limit) == (0, 1, 1.5 * side)


@pytest.mark.parametrize("at", ["start", "end"])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("low", "high", "least"), [(-9.0, 9.0, 1e-9), (-0.5, 2.0, 0.5e-9), (-2.0, 0.5, 0.5e-9)]
)
def test_what_rounding_leaves_of_a_resting_joint_needs_no_time(
    low: float, high: float, least: float, side: float, at: str
) -> None:
    """Up to a billionth of 1 rad/s, or of its smaller velocity limit where that is less; beyond, it counts."""
    given = limits([[low, high]], [1.0])
    for size, counts in ((0.9 * least, False), (1.1 * least, True)):
        states = [state([0.0], side * size if at == name else 0.0) for name in ("start", "end")]
        found = fastest_duration(*states, given)
        assert isinstance(found, LowerBound)
        assert (found.joint == 0) == counts
        unbounded = fastest_duration(
            *states, limits([[-np.inf, np.inf] if low == -9 else [low, high]], [FREE])
        )
        assert isinstance(unbounded, NoBound) == counts


@pytest.mark.parametrize("off", [0.0, 5e-10, -5e-10])
def test_a_joint_that_comes_back_needs_the_time_to_turn_round(off: float) -> None:
    """From 0.5 rad/s to -0.5 rad/s at the same place, within 2 rad/s^2."""
    found = fastest_duration(state([1.0], 0.5), state([1.0 + off], -0.5), limits([1.0], [2.0]))
    assert found == LowerBound(pytest.approx(0.5, rel=1e-6), 0)  # type: ignore[arg-type]
    away = fastest_duration(state([1.0]), state([1.0 + 1e-6]), limits([1.0], [2.0]))
    assert away == LowerBound(pytest.approx(2 * np.sqrt(1e-6 / 2)), 0)  # type: ignore[arg-type]


def one_sided(order: int, side: int) -> Limits:
    """Return limits of one joint of which one bound is infinite."""
    rows = [np.array([[-1.0, 1.0]]), np.array([[-2.0, 2.0]])]
    rows[order - 1][0, side] = FREE[side]
    return limits(*rows)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("order", [1, 2])
def test_a_rate_without_a_limit_on_one_side_is_unlimited(order: int, side: int) -> None:
    found = fastest_duration(state([0.0]), state([1.0]), one_sided(order, side))
    assert found == NoBound(f"its {('velocity', 'acceleration')[order - 1]} is unlimited", 0)


@pytest.mark.parametrize("at", ["start", "end"])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("order", [1, 2])
def test_an_end_beyond_its_limit_by_rounding_is_laid_onto_it(order: int, side: float, at: str) -> None:
    given = limits([1.0], [2.0], [20.0])
    for excess, inside in ((4e-13, True), (1e-3, False)):
        rates = [0.0, 0.0]
        rates[order - 1] = side * order * (1 + excess)
        if order == 2:  # it slows down at the start, and speeds up at the end
            rates[0] = side * (-0.5 if at == "start" else 0.5)
        moving, still = state([0.0], *rates), state([0.0])
        place = 4.0 * side if order == 1 else -4.0 * side if at == "start" else 4.0 * side
        pair = (moving, replace(still, position=np.array([place])))
        if at == "end":
            pair = (replace(still, position=np.array([-place])), moving)
        found = fastest_duration(*pair, given)
        assert isinstance(found, LowerBound) == inside, found
        if isinstance(found, NoBound):
            name = ("velocity", "acceleration")[order - 1]
            assert found.reason == f"it {at}s outside its {name} limit"


@pytest.mark.parametrize("last", [0.4, 0.0, -0.6])
def test_a_motion_that_ends_the_other_way_counts_its_end_by_that_direction(last: float) -> None:
    """Up by 3 rad and down by 2."""
    given = limits([[-1.0, 2.0]], [[-3.0, 4.0]])
    found = duration_through(np.array([[0.0], [3.0], [1.0]]), state([0.0], 0.5), state([1.0], last), given)
    expected = ramps(3.0, 2.0, 4.0, 3.0, 0.5, 0.0) + ramps(2.0, 1.0, 3.0, 4.0, 0.0, max(-last, 0.0))
    assert found.duration == pytest.approx(expected, rel=1e-9)
