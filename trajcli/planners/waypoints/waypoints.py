"""Jerk-limited motion through waypoints, with free geometry between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, MissingLimitError, PlanningError, Problem
from trajcli.frozen import comparable
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.language.numbers import (
    NO_TRUTH,
    FieldType,
    Flaw,
    FlawError,
    Number,
    ReadingContext,
    number_schema,
    refuse_flaws,
    shown,
)
from trajcli.language.per_joint import read_each
from trajcli.language.recorded import Recorded
from trajcli.language.waypoints import Waypoint
from trajcli.planners.boundary_states import missing_limit, standstill
from trajcli.planners.law_events import jerk_events
from trajcli.planners.planner import Certificate, Event, Planned
from trajcli.planners.waypoints.given_points import (
    GivenPoints,
    given_points,
    require_possible,
    without_repeats,
)
from trajcli.planners.waypoints.through_points import PointSequence, left_out
from trajcli.trajectory import State, ViaPoints
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.planners.course import Course
    from trajcli.planners.fastest_through_points.problem import WaypointProblem

_AT_REST = 1e-9  # of its peaks: a motion that starts with less stands
_TIME = Number(Quantity("time"), "Shortest duration of a segment, s.", at_least=0.0)


@comparable
class SegmentTimes(FieldType):
    """A list of durations, one for each segment."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return seconds."""
        if not isinstance(value, list | tuple) or not value:
            raise FlawError(f"expected a list of times, one for each segment, got {shown(value)}")
        return tuple(read_each(enumerate(value), lambda _, item: _TIME.read(item, context)).values())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of the list."""
        return {"type": "array", "items": number_schema(Quantity("time"), minimum=0.0), "minItems": 1}


class FastestThroughPoints(PointSequence):
    """As fast as velocity, acceleration and jerk limits allow through points, however it goes between them.

    Source: Berscheid and Kroeger, Jerk-limited Real-time Trajectory Generation with Arbitrary Target States
    (RSS 2021); Nocedal and Wright, Numerical Optimization, 2nd edition (2006), chapter 18.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    follows_jerk: ClassVar[bool] = True
    finds_times: ClassVar[bool] = True

    planner: Literal["waypoints"] = "waypoints"
    starts: Annotated[
        Literal[1, 2, 3, 4, 5, 6, 7, 8],
        NO_TRUTH,
        Field(description="How many starting points of the search are tried, of a fixed order."),
    ] = 4
    minimum_durations: (
        Annotated[
            tuple[float, ...],
            SegmentTimes("Each segment lasts at least this long, s, the first from the start."),
        ]
        | None
    ) = None
    straight: Annotated[
        bool,
        Field(
            strict=True,
            description="Whether it keeps to the polyline: through collinear points without a stop, with a "
            "stop where it turns.",
        ),
    ] = False

    _begun: Array | None = PrivateAttr(default=None)

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        last = self.listed[-1] if self.listed else None
        between = self.listed if self.to is None else self.listed[:-1]
        reasons = {
            "its `minimum_durations` are given": self.minimum_durations is not None,
            "it keeps to the polyline (`straight`), as `time_optimal` with `path: polyline` does, which can "
            "be flown by": self.straight,
            "it ends in motion": last is not None and _has_rates(last, of_zero=False),
            "a point between gives its velocity or acceleration": any(
                _has_rates(point, of_zero=True) for point in between if point is not last
            ),
        }
        return next((reason for reason, holds in reasons.items() if holds), None)

    def course(self, start: Array, robot: Robot, planned: Planned) -> Course:
        """Return the path of its motion from rest to rest.

        Raises:
            PlanningError: When it starts in motion.
        """
        from trajcli.planners.course import JointCourse, PassedPoints
        from trajcli.planners.waypoints.joint_path import path_of_motion

        del start
        passed, first = planned.via_points, planned.curve.evaluate_orders(np.zeros(1), (1, 2))[0]
        peaks = [np.abs(planned.curve.piece_ends(order)).max() for order in (1, 2)]
        if passed is None or (np.abs(first).max(axis=1) > _AT_REST * np.array(peaks)).any():
            message = "a `waypoints` move that starts in motion has no path to follow at another pace"
            raise PlanningError(message)
        curve, s = path_of_motion(planned.curve, passed.times)
        between = PassedPoints(s[1:-1], passed.points[1:-1], passed.missed[1:-1])
        return JointCourse(curve, robot, between)

    @model_validator(mode="after")
    def _points_fit(self) -> FastestThroughPoints:
        refuse_flaws([*self._flaws_of_times(), *self._flaws_of_points()])
        return self

    def _flaws_of_times(self) -> Iterator[Flaw]:
        times, count = self.minimum_durations, len(self.listed)
        if times is None or isinstance(self.through, Recorded) or len(times) == count:
            return
        text = f"expected {count} times, one for each segment from the start on, got {len(times)}"
        yield ("minimum_durations",), text, None

    def _flaws_of_points(self) -> Iterator[Flaw]:
        for path, point, _ in self._numbered():
            if point.time is not None:
                yield (*path, "time"), "waypoints finds the times", "leave it out, or use spline"
            if point.blend is not None:
                yield (*path, "blend"), "waypoints has no blends: it goes through the points", "leave it out"

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the fastest motion through the points that is found.

        Raises:
            MissingLimitError: When a moving joint lacks a limit on velocity, acceleration or jerk.
            PlanningError: When what is given at a point cannot be, or no motion keeps the position limits.
        """
        points = without_repeats(self._points(start), robot)
        least = float(points.least.sum())
        if not points.moving.any():
            return replace(standstill(points.target, least), events=points.events)
        _require_limits(points, robot)
        require_possible(points, robot)
        return self._through(points, robot)

    def searched_from(self, planned: Planned) -> Self:
        """Return the planner that searches from the states of a motion at the points, and from no others."""
        copy, passed = self.model_copy(), planned.via_points
        if passed is not None and not planned.parts:  # what flies by a corner passes not all of its points
            rates = (planned.curve.evaluate(passed.times, order) for order in (1, 2))
            copy._begun = np.stack([*rates], axis=2)  # noqa: SLF001
        return copy

    def _through(self, points: GivenPoints, robot: Robot) -> Planned:
        """Return the motion of the joints that move; the others stand still."""
        from trajcli.planners.fastest_through_points.assembly import fastest_motion, straight_only
        from trajcli.planners.fastest_through_points.segment_motion import off_chords

        joints = np.flatnonzero(points.moving)
        problem = _problem(points, robot, joints)
        names = [robot.joint_names[joint] for joint in joints.tolist()]
        states = None if self._begun is None else self._begun[:, joints]
        try:
            if self.straight:
                fastest = straight_only(problem, names, self.starts)
            else:
                fastest = fastest_motion(problem, names, self.starts, states)
        except PlanningError as error:
            raise PlanningError(*(_of_robot(each, joints) for each in error.problems)) from None
        motion = fastest.motion.among(joints, points.positions[0])
        off, times = off_chords(motion, points.positions, robot.limits.velocity)
        joint = None if fastest.joint is None else int(joints[fastest.joint])
        certificate = Certificate(
            fastest.lower,
            joint,
            fastest.found,
            fastest.agreeing,
            fastest.stopping,
            off,
            times,
            self.straight,
        )
        return Planned(
            motion.curve,
            points.target,
            phases=motion.phases,
            via_points=ViaPoints(motion.times, points.positions, np.zeros_like(points.positions)),
            events=(*points.events, *jerk_events(names, robot.limits.jerk[joints])),
            certificate=certificate,
        )

    def _points(self, start: State) -> GivenPoints:
        listed = list(self.listed)
        paths: list[tuple[str | int, ...]] = [("through", k) for k in range(len(listed))]
        if self.to is not None:
            paths[-1] = ("to",)
        recorded = np.empty((0, start.position.size))
        events: tuple[Event, ...] = ()
        if isinstance(self.through, Recorded):
            free = replace(self.through, times=None)
            target = None if self.to is None else self.to.as_state().position
            kept = free.after(start.position, target)
            recorded, events = kept.positions, left_out(free, start.position, kept)
        least = self.minimum_durations
        wanted = len(recorded) + len(listed)
        if least is not None and len(least) != wanted:
            message = f"{len(least)} minimum durations, but the recorded points make {wanted} segments"
            raise PlanningError(message, hint="give one for each segment, the first from the start")
        points = given_points(start, recorded, list(zip(paths, listed, strict=True)), least)
        return replace(points, events=events)


def _of_robot(problem: Problem, joints: NDArray[np.intp]) -> Problem:
    """Return the problem with amounts of joints of the robot, which were numbered among those that move."""
    amounts = {
        name: replace(each, joint=int(joints[each.joint]))
        if isinstance(each, Amount) and each.joint is not None
        else each
        for name, each in problem.amounts.items()
    }
    return replace(problem, amounts=amounts)


def _has_rates(point: Waypoint, *, of_zero: bool) -> bool:
    """Return whether a point gives a velocity or an acceleration, `of_zero` or another one."""
    given = [values for values in (point.velocity, point.acceleration) if values is not None]
    return any(of_zero or any(values) for values in given)


def _problem(points: GivenPoints, robot: Robot, joints: NDArray[np.intp]) -> WaypointProblem:
    """Return the problem of some joints; of a jerk that differs by direction it keeps the smaller one."""
    from trajcli.planners.fastest_through_points.problem import WaypointProblem

    limits = robot.limits
    jerk = np.sort(np.abs(limits.jerk[joints]), axis=1)
    return WaypointProblem(
        points.positions[:, joints],
        limits.velocity[joints],
        limits.acceleration[joints],
        jerk[:, 0],
        points.states[:, joints],
        points.fixed[:, joints],
        points.least,
        limits.position[joints],
        jerk[:, 1] / jerk[:, 0],
    )


def _require_limits(points: GivenPoints, robot: Robot) -> None:
    """Refuse moving joints without the limits that their motion follows from."""
    problems: list[Problem] = []
    for order in (1, 2, 3):
        bounded = np.isfinite(robot.limits.of_order(order)).all(axis=1)
        lacking = np.flatnonzero(points.moving & ~bounded).tolist()
        if lacking:
            why = "to find the fastest motion"
            problems += missing_limit("waypoints", QUANTITIES[order], lacking, robot, why).problems
    if problems:
        raise MissingLimitError(*problems)
