"""What a start outside its limits excuses, and nothing more: each mutant of a braking move is found."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from trajcli.checks.braking import braking_intervals
from trajcli.checks.verify import verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits, unlimited
from trajcli.trajectory import Promise, Span, State, Trajectory

_FREE = np.tile([-np.inf, np.inf], (2, 1))


def _limits(velocity=1.0, acceleration=2.0, jerk=4.0):
    both = [np.array([[-b, b]] * 2) for b in (velocity, acceleration, jerk)]
    return Limits(_FREE, *both)


def _motion(velocity, acceleration, phases):
    """Return a trajectory of two joints: the first by its (duration, jerk), the second at rest."""
    rows, p, v, a = [], 0.0, velocity, acceleration
    for t, j in phases:
        rows.append([j / 6, a / 2, v, p])
        p, v, a = p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
    coefficients = np.zeros((4, len(rows), 2))
    coefficients[:, :, 0] = np.array(rows).T
    breaks = np.cumsum([0.0, *(t for t, _ in phases)])
    curve = PiecewisePolynomial(breaks, coefficients)
    start = State(np.zeros(2), np.array([velocity, 0.0]), np.array([acceleration, 0.0]))
    end = State(np.array([p, 0.0]), np.array([v, 0.0]), np.array([a, 0.0]))
    span = Span(0, "jerk_limited", 0.0, float(breaks[-1]), 2)
    return Trajectory(curve, ("a", "b"), ("revolute", "revolute"), (span,), start, end)


def _findings(trajectory, limits, braking="each"):
    promise = Promise(ends=(trajectory.start, trajectory.end), braking=braking)
    return [(f.joint, f.kind) for f in verify(trajectory, [limits], [promise]).findings]


# from 3 rad/s: down with jerk -4 to -2 rad/s^2 (0.5 s, to 2.5), held for 1/2 s (to 1.5), up with jerk 4 (to 1)
_BRAKES = [(0.5, -4.0), (0.5, 0.0), (0.5, 4.0)]


def test_fastest_braking_passes():
    brakes = [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)]  # inside after 1.25 s, at 0.5 rad/s in the end
    assert _findings(_motion(3.0, 0.0, brakes), _limits()) == []


def test_without_the_promise_it_is_over_its_limit():
    brakes = [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)]
    assert _findings(_motion(3.0, 0.0, brakes), _limits(), braking=None) == [("a", "velocity")]


@pytest.mark.parametrize(
    ("brakes", "kind"),
    [
        ([(0.01, 0.0), (0.5, -4.0), (0.75, 0.0), (0.5, 4.0)], "velocity"),  # begins late
        (_BRAKES, "velocity"),  # eases off too early: inside at 1.5 s instead of 1.25 s
        ([(0.5, -3.9), (0.85, 0.0), (0.5, 3.9)], "velocity"),  # not with all its jerk
        ([(0.1, 4.0), (0.6, -4.0), (1.0, 0.0), (0.5, 4.0)], "velocity"),  # faster first
        ([(0.5, -4.4), (0.6, 0.0), (0.5, 4.4)], "jerk"),  # too much jerk
        (
            [(0.6, -4.0), (0.4, 0.0), (0.5, 4.0)],
            "acceleration",
        ),  # too much acceleration, which the start keeps
        ([(0.5, -4.0), (0.75, 0.0), (0.5, 4.0), (0.5, 4.0), (0.5, -4.0)], "velocity"),  # outside once more
    ],
)
def test_mutants_are_found(brakes, kind):
    assert ("a", kind) in _findings(_motion(3.0, 0.0, brakes), _limits())


def test_acceleration_outside_is_excused_until_it_is_inside():
    assert _findings(_motion(0.0, 3.0, [(0.75, -4.0)]), _limits(velocity=9.0)) == []
    slow = _motion(0.0, 3.0, [(0.8, -3.75)])
    assert _findings(slow, _limits(velocity=9.0)) == [("a", "acceleration")]
    rising = _motion(0.0, 3.0, [(0.01, 4.0), (0.76, -4.0)])
    assert _findings(rising, _limits(velocity=9.0)) == [("a", "acceleration")]


def test_start_within_its_limits_excuses_nothing():
    leaves = _motion(0.9, 0.0, [(0.5, 4.0), (1.0, -4.0), (0.5, 4.0)])
    assert ("a", "velocity") in _findings(leaves, _limits())


def test_another_joint_is_not_excused():
    moving = _motion(3.0, 0.0, [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)])
    both = moving.curve.coefficients.copy()
    both[:, :, 1] = 0.0
    both[2, :, 1] = 1.1  # the second joint is over its limit, too, and does not brake
    both[3, :, 1] = 1.1 * moving.curve.breaks[:-1]
    curve = PiecewisePolynomial(moving.curve.breaks, both)
    start = State(moving.start.position, np.array([3.0, 1.1]), np.zeros(2))
    end = State(
        np.array([moving.end.position[0], 1.1 * curve.end]),
        np.array([moving.end.velocity[0], 1.1]),
        np.zeros(2),
    )
    trajectory = Trajectory(curve, moving.joint_names, moving.joint_types, moving.spans, start, end)
    assert _findings(trajectory, _limits()) == [("b", "velocity")]


def test_on_a_line_all_brake_as_the_tightest_joint_can():
    """The second joint has a tenth of the way and a twentieth of the jerk: together they brake half as hard."""
    slower = [(0.5 * 2, -2.0), (0.5, 0.0), (1.0, 2.0)]  # -2 rad/s^2 after 1 s, at 2; inside after 1.5 s
    motion = _motion(3.0, 0.0, slower)
    both = motion.curve.coefficients.copy()
    both[:, :, 1] = both[:, :, 0] / 10
    curve = PiecewisePolynomial(motion.curve.breaks, both)
    states = [
        State(
            *(
                np.array([getattr(s, k)[0], getattr(s, k)[0] / 10])
                for k in ("position", "velocity", "acceleration")
            )
        )
        for s in (motion.start, motion.end)
    ]
    trajectory = Trajectory(curve, motion.joint_names, motion.joint_types, motion.spans, *states)
    limits = _limits()
    limits = Limits(_FREE, limits.velocity, limits.acceleration, np.array([[-4.0, 4.0], [-0.2, 0.2]]))
    assert _findings(trajectory, limits, "line") == []
    assert _findings(trajectory, limits, "each") == [("a", "velocity")]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_that_is_faster_first_is_found_though_it_is_inside_in_time(side):
    """With twice the jerk it has 0.1 s to gain speed in, on either side of zero."""
    phases = [(0.1, 4.0 * side), (0.4, -8.0 * side), (0.55, 0.0), (0.35, 8.0 * side)]
    assert ("a", "velocity") in _findings(_motion(3.0 * side, 0.0, phases), _limits())
    brakes = [(0.5, -4.0 * side), (0.75, 0.0), (0.5, 4.0 * side)]
    assert _findings(_motion(3.0 * side, 0.0, brakes), _limits()) == []


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_smaller_of_two_jerks_says_how_long_braking_lasts(side):
    limits = _limits()
    jerk = np.array([[-8.0, 4.0] if side > 0 else [-4.0, 8.0]] * 2)
    unequal = Limits(_FREE, limits.velocity, limits.acceleration, jerk)
    brakes = [(0.5, -4.0 * side), (0.75, 0.0), (0.5, 4.0 * side)]
    assert _findings(_motion(3.0 * side, 0.0, brakes), unequal) == []


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_acceleration_alone_is_a_direction_to_brake_along(side):
    falls = _motion(0.0, 3.0 * side, [(0.75, -4.0 * side)])
    assert _findings(falls, _limits(velocity=9.0), "line") == []


def _later(phases, joint, side, after):
    """Return one joint of two that cruises for a second, then follows phases, then others: two moves or three."""
    turned = slice(None, None, -1 if joint else 1)
    whole = _motion(3.0 * side, 0.0, [(t, side * j) for t, j in [(1.0, 0.0), *phases, *after]])
    breaks, coefficients = whole.curve.breaks, whole.curve.coefficients[:, :, turned]
    borders = [0.0, 1.0, float(breaks[1 + len(phases)]), float(breaks[-1])]
    if not after:
        borders = borders[:3]
    spans = tuple(Span(k, "jerk_limited", a, b, 2) for k, (a, b) in enumerate(pairwise(borders)))
    ends = [
        State(*(getattr(state, name)[turned] for name in ("position", "velocity", "acceleration")))
        for state in (whole.start, whole.end)
    ]
    return Trajectory(PiecewisePolynomial(breaks, coefficients), ("a", "b"), ("revolute",) * 2, spans, *ends)


@pytest.mark.parametrize("how", ["each", "line"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_any_joint_brakes_in_any_move(joint, side, how):
    """At speed under wide limits, then braking under narrow ones, then at speed once more: only the second is excused."""
    brakes, faster = [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)], [(0.5, 4.0), (0.75, 0.0), (0.5, -4.0)]
    wide, narrow = _limits(velocity=3.0), _limits()
    late = [(0.01, 0.0), *brakes]
    for phases, found in ((brakes, set()), (late, {(1, "velocity")})):
        for after in ([], faster):
            trajectory = _later(phases, joint, side, after)
            count = len(trajectory.spans)
            promises = [Promise(braking=how if k == 1 else None) for k in range(count)]
            findings = verify(trajectory, [wide, narrow, wide][:count], promises).findings
            assert {(each.move, each.kind) for each in findings} == found
            assert {each.joint for each in findings} <= {"ab"[joint]}
            unexcused = verify(trajectory, [wide, narrow, wide][:count], [Promise()] * count).findings
            assert {each.move for each in unexcused} == {1}


@pytest.mark.parametrize("how", ["each", "line"])
@pytest.mark.parametrize("late", [0.0, 0.01])
def test_a_move_brakes_from_what_the_one_before_has_sped_up_to(late, how):
    """From 0.5 to 3 rad/s in 1.75 s under wide limits, and back as fast: inside after 1.25 s, or later than could be."""
    faster, brakes = [(0.5, 4.0), (0.75, 0.0), (0.5, -4.0)], [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)]
    both = _motion(0.5, 0.0, [*faster, *([(late, 0.0)] if late else []), *brakes])
    end = both.curve.duration
    spans = Span(0, "jerk_limited", 0.0, 1.75, 2), Span(1, "jerk_limited", 1.75, end, 2)
    whole = Trajectory(both.curve, ("a", "b"), ("revolute",) * 2, spans, both.start, both.end)
    promises = [Promise(), Promise(braking=how)]
    found = verify(whole, [_limits(velocity=3.0), _limits()], promises).findings
    assert [(each.move, each.kind) for each in found] == ([(1, "velocity")] if late else [])


@pytest.mark.parametrize("how", ["each", "line"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_where_an_acceleration_leads_is_excused_in_either_direction(side, how):
    """From 0.9 rad/s with 2 rad/s^2 the joint cannot but reach 1.4; a tenth of a second more of it is too much."""
    leads = [(1.0, -4.0 * side), (0.5, 4.0 * side)]
    assert _findings(_motion(0.9 * side, 2.0 * side, leads), _limits(), how) == []
    assert _findings(_motion(0.9 * side, 2.0 * side, leads), _limits(), None) == [("a", "velocity")]
    later = [(0.02, 0.0), *leads]
    assert _findings(_motion(0.9 * side, 2.0 * side, later), _limits(), how) == [("a", "velocity")]


@pytest.mark.parametrize("how", ["each", "line"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_acceleration_that_leads_outside_by_little_is_excused(side, how):
    """From 0.9 rad/s with 1 rad/s^2 it reaches 0.9 + 1 / (2 * 4) = 1.025; with twice the jerk it would stay inside."""
    leads = _motion(0.9 * side, side, [(0.5, -4.0 * side), (0.25, 4.0 * side)])
    assert _findings(leads, _limits(), how) == []
    assert _findings(leads, _limits(), None) == [("a", "velocity")]


def test_two_joints_that_brake_are_each_excused():
    """One forward, one backward, from other speeds."""
    first, second = (
        _motion(v, 0.0, [(0.5, j), (hold, 0.0), (0.5, -j), *rest])
        for v, j, hold, rest in ((3.0, -4.0, 0.75, [(0.5, 0.0)]), (-4.0, 4.0, 1.25, []))
    )
    breaks = np.union1d(np.round(first.curve.breaks, 12), np.round(second.curve.breaks, 12))
    curves = [each.curve for each in (first, second)]
    rows = np.stack(
        [[curve.evaluate(breaks[:-1], k)[:, 0] / (1, 1, 2, 6)[k] for k in (3, 2, 1, 0)] for curve in curves],
        axis=-1,
    )
    curve = PiecewisePolynomial(breaks, rows)
    ends = [State(*(curve.evaluate(np.array([t]), k)[0] for k in range(3))) for t in (0.0, breaks[-1])]
    span = Span(0, "jerk_limited", 0.0, float(breaks[-1]), 2)
    trajectory = Trajectory(curve, ("a", "b"), ("revolute",) * 2, (span,), *ends)
    assert _findings(trajectory, _limits()) == []
    assert sorted(_findings(trajectory, _limits(), None)) == [("a", "velocity"), ("b", "velocity")]


def test_a_joint_that_rests_and_no_limit_of_jerk_make_no_warning():
    """The suite takes warnings for errors: nothing times an unlimited jerk would be no number."""
    limits = replace(unlimited(3), velocity=np.ones((3, 2)) * [-1, 1], acceleration=np.ones((3, 2)) * [-2, 2])
    found = braking_intervals(np.array([1.5, 0.75, 0.0]), np.zeros(3), limits, on_line=True)
    assert [(each.joint, each.order) for each in found] == [(0, 1)]
    assert found[0].duration == pytest.approx(0.25)  # (1.5 - 1) / 2


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("acceleration", [0.0, 1.0])
def test_along_a_line_each_joint_is_excused_up_to_where_the_start_leads_it(acceleration, side):
    """At 0.5 and -0.25 rad/s, and faster by a^2 / (2 j) where the start has an acceleration; no more than that."""
    joints = side * np.array([1.0, -0.5])
    found = braking_intervals(0.5 * joints, acceleration * joints, _limits(velocity=0.2), on_line=True)
    assert [(each.joint, each.order) for each in found] == [(0, 1), (1, 1)]
    for each, share in zip(found, joints, strict=True):
        reached = sorted([0.5 * share, (0.5 + acceleration**2 / (2 * 4.0)) * share])
        assert [each.lowest, each.highest] == pytest.approx(reached, rel=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("how", ["each", "line"])
@pytest.mark.parametrize("late", [0.0, 0.01])
@pytest.mark.parametrize("count", [1, 2])
def test_what_takes_no_time_before_a_move_that_brakes_is_excused_as_its_start_is(count, late, how, side):
    """A signal, or another tool: there are the velocity and the acceleration of the start, and no others."""
    brakes = [(0.5, -4.0 * side), (0.75, 0.0), (0.5, 4.0 * side)]
    whole = _motion(3.0 * side, 0.0, [*([(late, 0.0)] if late else []), *brakes])
    before = tuple(Span(k, "signal", 0.0, 0.0, 2) for k in range(count))
    whole = replace(whole, spans=(*before, Span(count, "jerk_limited", 0.0, whole.curve.duration, 2)))
    limits, still = [_limits()] * (count + 1), [Promise()] * count
    found = verify(whole, limits, [*still, Promise(braking=how)]).findings
    assert [(each.move, each.kind) for each in found] == ([(count, "velocity")] if late else [])
    unexcused = verify(whole, limits, [*still, Promise()]).findings
    assert {each.move for each in unexcused} == {*range(count + 1)}
    elsewhere = replace(_limits(), position=np.array([[-9.0, 9.0], [-1.0, 2.0]]))
    shifted = whole.curve.coefficients.copy()
    shifted[-1, :, 1] += 3.0
    moved = replace(whole, curve=PiecewisePolynomial(whole.curve.breaks, shifted))
    found = verify(moved, [elsewhere, *limits[1:]], [*still, Promise(braking=how)]).findings
    assert [(each.move, each.joint, each.kind) for each in found][:1] == [(0, "b", "position")]


def test_what_moves_before_a_move_that_brakes_is_excused_nothing():
    """From 0.5 to 3 rad/s within limits of 2 rad/s, and back within 1 rad/s."""
    faster, brakes = [(0.5, 4.0), (0.75, 0.0), (0.5, -4.0)], [(0.5, -4.0), (0.75, 0.0), (0.5, 4.0)]
    both = _motion(0.5, 0.0, [*faster, *brakes])
    times = [(0.0, 1.75), (1.75, 1.75), (1.75, both.curve.duration)]
    spans = tuple(Span(k, "jerk_limited", start, end, 2) for k, (start, end) in enumerate(times))
    promises = [Promise(), Promise(), Promise(braking="each")]
    found = verify(replace(both, spans=spans), [_limits(velocity=2.0), *[_limits()] * 2], promises).findings
    assert [(each.move, each.kind) for each in found] == [(0, "velocity")]
