"""Laws of parts of motions that fly by: along lines and bent paths, between states."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planners.test_chains_within_limits import BOUNDS, POINTS, WAYS, arm, line
from planners.test_motion_of_parts import ruckig_of

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.quartic_law import ReversingLawError
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.errors import PlanningError
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.course import JointCourse
from trajcli.planners.flying_by import flown_parts as parts_module
from trajcli.planners.flying_by.chain_parts import PathPart
from trajcli.planners.flying_by.flown_parts import (
    CourseLaws,
    FlownPart,
    NoLawError,
    along_path,
)


def states(*rows: tuple[float, float]) -> np.ndarray:
    return np.array(rows)


@pytest.mark.parametrize("tempo", [1.0, 0.5])
@pytest.mark.parametrize("given", [True, False])
def test_along_a_line_the_law_is_as_fast_as_ruckig_within_its_bounds(tempo: float, *, given: bool) -> None:
    """Bounds of s are those of the joint that goes farthest; those that are given count in their place."""
    course, stretch, ends = (
        line(POINTS[0], WAYS[0], arm(), 2.0),
        (0.25, 1.75),
        states((0.5, 1.0), (0.25, -0.5)),
    )
    sizes = (1.0, 2.0, 9.0)
    if not given:
        sizes = tuple(bound / (WAYS[0, 0] / 2) * tempo**k for k, bound in enumerate(BOUNDS.values(), 1))
    bounds = np.array([[sign * size for size in sizes for sign in (-1, 1)]])
    part = PathPart(bounds[0], 1.5) if given else None
    found = CourseLaws().along(course, 4, stretch, ends, tempo, part)
    want = ruckig_of(np.array([[0.25, *ends[0]]]), np.array([[1.75, *ends[1]]]), bounds)
    assert found.curve.duration == pytest.approx(want.duration, rel=1e-9)
    assert found.law is not None
    for time in np.linspace(0.0, want.duration, 20):
        s = want.at_time(time)[0][0]
        np.testing.assert_allclose(
            found.curve.evaluate(min(time, found.curve.end)), POINTS[0] + s / 2 * WAYS[0], atol=1e-8
        )
        assert found.law.evaluate(min(time, found.law.end))[0] == pytest.approx(s, abs=1e-8)
    assert found.tool is None


@pytest.mark.parametrize(
    ("stretch", "ends"),
    [
        ((0.5, 0.6), states((1.5, 0.0), (0.0, 0.0))),  # it cannot stop in time
        ((0.4, 0.5), states((0.0, 0.0), (1.5, 0.0))),  # nor be so fast in time: it takes a run-up
    ],
)
def test_a_law_that_would_have_to_go_back_is_none(stretch: tuple[float, float], ends: np.ndarray) -> None:
    course = line(POINTS[0], WAYS[0], arm(), 2.0)
    with pytest.raises(NoLawError, match="between two zones: it would have to go back") as refused:
        CourseLaws().along(course, 4, stretch, ends, 1.0)
    assert (refused.value.failing, refused.value.far) == ({4: None}, False)


def bent(**bounds: Any) -> JointCourse:
    """Return an arc in joint space by a cubic: q' and q'' change along it."""
    rows = np.array([[0.02, -0.05], [-0.3, 0.1], [0.9, 0.5], [0.3, 1.2]])[:, None, :]
    return JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), rows), arm(**bounds))


def test_along_a_bent_path_at_a_slower_pace_the_law_of_faster_states_takes_longer() -> None:
    course, tempo = bent(), 0.5
    whole = along_path(course, (0.2, 0.8), states((0.4, 0.5), (0.6, -0.5)), 1.0)
    slower = along_path(course, (0.2, 0.8), states((0.2, 0.125), (0.3, -0.125)), tempo)
    assert slower.curve.duration == pytest.approx(2 * whole.curve.duration, rel=1e-9)
    assert slower.law is not None
    np.testing.assert_allclose(
        slower.law.evaluate(np.array([0.0, slower.law.end]))[:, 0], [0.2, 0.8], atol=1e-9
    )
    for time, s, (speed, change) in ((0.0, 0.2, (0.2, 0.125)), (slower.curve.end, 0.8, (0.3, -0.125))):
        first, second = course.curve.evaluate(s, 1), course.curve.evaluate(s, 2)
        np.testing.assert_allclose(slower.curve.evaluate(time), course.curve.evaluate(s), atol=1e-9)
        np.testing.assert_allclose(slower.curve.evaluate(time, 1), speed * first, rtol=3e-4)
        np.testing.assert_allclose(
            slower.curve.evaluate(time, 2), change * first + speed**2 * second, rtol=2e-3, atol=1e-3
        )


class AskedError(Exception):
    """A law was asked for."""


@pytest.mark.parametrize(
    ("jerk", "third"),
    [
        (60.0, True),
        (np.inf, False),
        ([[-60, 60], [-np.inf, np.inf]], True),
        ([[-np.inf, np.inf], [-60, 60]], False),
    ],
)
def test_a_law_is_of_third_order_where_joints_that_move_have_limits_of_jerk(
    jerk: Any, monkeypatch: pytest.MonkeyPatch, *, third: bool
) -> None:
    """The second joint stands still."""
    rows = np.array([[-0.3, 0.0], [0.9, 0.0], [0.3, 1.2]])[:, None, :]
    course = JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), rows), arm(jerk=jerk))

    def asked(kind: str) -> Any:
        def law(path: Any, *given: Any, **fields: Any) -> None:
            raise AskedError(kind, path, given, fields)

        return law

    monkeypatch.setattr(parts_module, "jerk_limited_time_optimal", asked("third"))
    monkeypatch.setattr(parts_module, "time_optimal", asked("second"))
    with pytest.raises(AskedError) as found:
        along_path(course, (0.25, 0.75), states((0.2, 0.1), (0.3, -0.1)), 0.5)
    kind, path, given, fields = found.value.args
    assert kind == ("third" if third else "second")
    assert (path.start, path.end) == (0.25, 0.75)
    np.testing.assert_array_equal(given[0], course.robot.limits.velocity)
    np.testing.assert_array_equal(given[1], course.robot.limits.acceleration)
    if third:
        assert (fields["start"], fields["end"]) == ((0.4, 0.4), (0.6, -0.4))
    else:
        assert (fields["start_velocity"], fields["end_velocity"]) == (0.4, 0.6)


@pytest.mark.parametrize(
    ("first", "speed", "slower"), [(0.0, 0.2, 0.0), (0.0, 0.0, 1e-4), (0.25, 0.2, 1e-4), (0.25, 0.0, 1e-4)]
)
def test_a_chain_starts_as_it_is_told_and_other_states_may_be_slower(
    first: float, speed: float, slower: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    def law(*given: Any, **fields: Any) -> None:
        raise AskedError(fields["slower"])

    monkeypatch.setattr(parts_module, "jerk_limited_time_optimal", law)
    with pytest.raises(AskedError) as found:
        along_path(bent(), (first, 0.75), states((speed, 0.1), (0.3, -0.1)), 1.0)
    assert found.value.args == (slower,)


@pytest.mark.parametrize(
    ("lasts", "simple"), [(1.0, None), (1.0, 1.2), (1.0, 0.9), (None, 1.2), (None, None)]
)
def test_of_a_simple_law_and_one_along_the_path_the_faster_one_is_taken(
    lasts: float | None, simple: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    def part(duration: float) -> FlownPart:
        return FlownPart(PiecewisePolynomial(np.array([0.0, duration]), np.zeros((1, 1, 2))))

    def law(*given: Any) -> FlownPart:
        if lasts is None:
            raise ReversingLawError("it turns back")
        return part(lasts)

    monkeypatch.setattr(parts_module, "along_path", law)
    monkeypatch.setattr(
        parts_module, "_within_tightest", lambda *given: (None if simple is None else part(simple), False)
    )
    found = parts_module._law_between(bent(), 2, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    durations = [each for each in (lasts, simple) if each is not None]
    if durations:
        assert isinstance(found, FlownPart)
        assert found.curve.duration == min(durations)
    else:
        assert isinstance(found, NoLawError)
        assert (found.failing, found.far) == ({2: None}, False)


@pytest.mark.parametrize(
    ("over", "first", "speed", "mended"),
    [
        (5e-5, 0.25, 0.2, True),
        (5e-5, 0.0, 0.0, True),
        (5e-5, 0.0, 0.2, False),  # a chain starts as it is told
        (3e-4, 0.25, 0.2, False),  # zones would be flown through from far slower states
        (-1e-3, 0.25, 0.2, False),
    ],
)
def test_a_law_that_is_over_a_limit_by_little_takes_as_much_longer(
    over: float, first: float, speed: float, monkeypatch: pytest.MonkeyPatch, *, mended: bool
) -> None:
    """Else the whole chain would be searched once more."""
    course, ends = bent(), states((speed, 0.0), (0.3, -0.1))
    law = along_path(course, (first, 0.75), ends, 1.0)
    assert law.law is not None

    def used(curve: PiecewisePolynomial) -> float:
        """Return by what factor a motion is to be slower, as samples tell."""
        times = np.linspace(0.0, curve.end, 4001)[:-1]
        return max(
            float(np.abs(curve.evaluate(times, order)).max() / bound) ** (1 / order)
            for order, bound in enumerate(BOUNDS.values(), 1)
        )

    quicker = (1 + over) / used(law.curve)
    curve, along = (scale_time(each, 1 / quicker) for each in (law.curve, law.law))
    monkeypatch.setattr(parts_module, "along_path", lambda *given: FlownPart(curve, None, along))
    monkeypatch.setattr(parts_module, "_within_tightest", lambda *given: (None, False))
    found = parts_module._law_between(course, 2, (first, 0.75), ends, 1.0)
    assert isinstance(found, FlownPart)
    assert found.law is not None
    assert found.law.end == found.curve.end
    if not mended:
        assert found.curve is curve
    else:
        assert used(found.curve) <= 1
        assert found.curve.end == pytest.approx(curve.end * (1 + over), rel=3e-6)


@pytest.mark.parametrize(
    ("error", "s", "far"),
    [
        (UnreachableSpeedError("end", 0.1, 2.04, 2.0), 0.1, False),
        (UnreachableSpeedError("end", 0.1, 2.08, 2.0), 0.1, True),
        (UnsettledSpeedError(0.2, 1.5), 0.2, False),
        (UnsettledSpeedError(0.2, 1.7), 0.2, True),
    ],
)
def test_a_speed_is_far_from_its_limit_by_its_share(
    error: PlanningError, s: float, monkeypatch: pytest.MonkeyPatch, *, far: bool
) -> None:
    def law(*given: Any) -> None:
        raise error

    monkeypatch.setattr(parts_module, "along_path", law)
    found = parts_module._law_between(bent(), 2, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    assert isinstance(found, NoLawError)
    assert (found.failing, found.far) == ({2: s}, far)


class FollowedCourse(JointCourse):
    """A course whose tool has a reference."""

    def reference(self, law: Any) -> Any:
        return "reference", law


@pytest.mark.parametrize("course", [bent(), line(POINTS[0], WAYS[0], arm())])
def test_the_tool_of_a_part_is_that_of_its_law(course: JointCourse) -> None:
    followed = FollowedCourse(course.curve, course.robot)
    part = CourseLaws().along(followed, 0, (0.0, 1.0), np.zeros((2, 2)), 0.5)
    assert part.tool == ("reference", part.law)


def test_what_limits_the_tool_counts_in_laws_along_a_path(monkeypatch: pytest.MonkeyPatch) -> None:
    def asked(kind: str) -> Any:
        def law(*given: Any, **fields: Any) -> None:
            raise AskedError(kind, len(fields["further"]), len(fields.get("further_jerk", ())))

        return law

    monkeypatch.setattr(parts_module, "jerk_limited_time_optimal", asked("third"))
    monkeypatch.setattr(parts_module, "time_optimal", asked("second"))
    for limits, jerk, want in (
        ({}, 60.0, ("third", 0, 0)),
        ({}, [[-60, 60], [-np.inf, np.inf]], ("third", 0, 0)),
        ({"speed": 1.0}, 60.0, ("third", 1, 0)),
        ({"speed": 1.0}, np.inf, ("second", 1, 0)),
        ({"jerk": 9.0}, np.inf, ("third", 1, 1)),
    ):
        robot = arm(jerk=jerk)
        robot = replace(robot, limits=replace(robot.limits, tcp=ToolLimits(**limits)))
        with pytest.raises(AskedError) as found:
            along_path(replace(bent(), robot=robot), (0.0, 0.75), states((0.0, 0.0), (0.3, -0.1)), 1.0)
        assert found.value.args == want
