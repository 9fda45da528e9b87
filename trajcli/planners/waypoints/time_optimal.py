"""Time-optimal motion through waypoints: a path in joint space, and the fastest law along it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.curves.operations import scale_time, times_at
from trajcli.curves.third_order.parameterization import JerkLimitedMotion
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion
from trajcli.curves.time_optimal.phase_plane import PhasePlane, switching_structure
from trajcli.errors import Amount, PlanningError, Problem, of_joint
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import (
    FieldType,
    Flaw,
    FlawError,
    ReadingContext,
    number_schema,
    refuse_flaws,
    shown,
)
from trajcli.language.per_joint import JointDistance
from trajcli.language.poses import read_numbers
from trajcli.language.recorded import Recorded
from trajcli.limits.kinds import path_constraints
from trajcli.planners.boundary_states import missing_limit, same_state, standstill
from trajcli.planners.effort_limits import effort_constraints, effort_shares, lacks_acceleration
from trajcli.planners.planner import LITTLE, Phase, Planned
from trajcli.planners.waypoints.fastest_law import (
    BENT_RULES,
    events_of_law,
    require_continuous_curvature,
    solve_second_order,
    solve_within_jerk,
)
from trajcli.planners.waypoints.joint_path import JointPath, polyline_through, spline_through
from trajcli.planners.waypoints.spline_rules import Rule
from trajcli.planners.waypoints.through_points import REMEDIES, PointTable, ThroughPoints
from trajcli.trajectory import State, ViaPoints, resting
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.curves.piecewise import Array
    from trajcli.planners.course import Course

_NAMED = ("chord", "centripetal", "uniform")


@comparable
class PathParameter(FieldType):
    """The name of a rule for the path parameter, or its value at each point."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> str | tuple[float, ...]:  # noqa: ANN401
        """Return the name, or the values."""
        if isinstance(value, str) and value in _NAMED:
            return value
        if not isinstance(value, list | tuple):
            raise FlawError(f"expected {', '.join(_NAMED)}, or a list of numbers from 0, got {shown(value)}")
        values = read_numbers(value, len(value), Quantity("ratio"), context)
        if values.size < 2 or values[0] != 0 or (np.diff(values) <= 0).any():
            raise FlawError("the values of the parameter must begin with 0 and increase")
        return tuple(values.tolist())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a name or a list."""
        return {
            "anyOf": [
                {"enum": list(_NAMED)},
                {"type": "array", "items": number_schema(Quantity("ratio")), "minItems": 2},
            ]
        }


class TimeOptimal(ThroughPoints):
    """Through points as fast as velocity, acceleration and jerk limits allow, on a path that they fix.

    Source: Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability
    Analysis, IEEE Trans. Robotics 34 (2018); Debrouwere et al., Time-optimal path following for robots with
    convex-concave constraints using sequential convex programming, IEEE Trans. Robotics 29 (2013).
    """

    continuity: ClassVar[Literal[1, 2]] = 1
    finds_times: ClassVar[bool] = True

    planner: Literal["time_optimal"] = "time_optimal"
    path: Annotated[
        Literal["spline", "polyline"],
        Field(description="A smooth curve through the points, or straight segments with rounded corners."),
    ] = "spline"
    rule: Annotated[
        Rule | None, Field(description="Of the spline: as for `spline`; not_a_knot if left out.")
    ] = None
    parameter: (
        Annotated[
            Literal["chord", "centripetal", "uniform"] | tuple[float, ...],
            PathParameter(
                "Of the spline: its parameter grows with the distance of the points (chord, which is the "
                "default), its root (centripetal), by one for each (uniform), or has the given values."
            ),
        ]
        | None
    ) = None
    corner: (
        Annotated[
            tuple[float, ...],
            JointDistance(
                "Of the polyline: how far a joint may pass from a corner (angle unit, or length unit for "
                "prismatic joints); 0 or left out: stop there."
            ),
        ]
        | None
    ) = None

    jerk: Annotated[
        Literal["keep", "ignore"],
        Field(
            description="keep: within the limits of jerk, where joints have them, and without steps in "
            "acceleration; ignore: as fast as velocity and acceleration limits allow."
        ),
    ] = "keep"

    @property
    def joins(self) -> Literal[1, 2]:
        """2 where it keeps limits of jerk; where no joint has one, its acceleration steps all the same."""
        return 2 if self.jerk == "keep" else 1

    @model_validator(mode="after")
    def _path_fits(self) -> TimeOptimal:
        refuse_flaws([*self._flaws_of_path(), *self._flaws_of_points()])
        return self

    def _flaws_of_path(self) -> Iterator[Flaw]:
        foreign = ("corner",) if self.path == "spline" else ("rule", "parameter")
        for name in foreign:
            if getattr(self, name) is not None:
                yield (name,), f"a {self.path} has no {name}", "leave it out, or choose the other `path`"
        if self.rule in ("imposed", "continuous_acceleration"):
            text = f"rule {self.rule} imposes derivatives in time, and the times are to be found"
            yield ("rule",), text, "use not_a_knot, natural, shape_preserving, computed or quintic"
        if self.corner is not None and any(self.corner) and not all(self.corner):
            text = "a corner is rounded for all joints or for none, but only some have 0"
            yield ("corner",), text, "give each joint a number above 0"
        count = 1 + len(self.listed)
        if not isinstance(self.parameter, tuple) or isinstance(self.through, Recorded):
            return
        if len(self.parameter) != count:
            text = f"expected {count} values, one for each point from the start on, got {len(self.parameter)}"
            yield ("parameter",), text, None

    def _flaws_of_points(self) -> Iterator[Flaw]:
        for path, point, last in self._numbered():
            if point.time is not None:
                yield (*path, "time"), "time_optimal finds the times", "leave it out, or use spline"
            if point.blend is not None:
                yield (*path, "blend"), "time_optimal has no blends", "use `path: polyline` and `corner`"
            for name in ("velocity", "acceleration"):
                if any(getattr(point, name) or ()) and not (last and name == "velocity"):
                    text = f"time_optimal does not impose the {name} here"
                    yield (*path, name), text, "only the target may have a `velocity`"

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        last = self.listed[-1] if self.listed else None
        reasons = {
            "its `duration` is given": self.duration is not None,
            "it ends in motion": last is not None and any(last.velocity or ()),
            f"the curvature of its path jumps (rule {self.rule})": self.rule in BENT_RULES,
        }
        return next((reason for reason, holds in reasons.items() if holds), None)

    def course(self, start: Array, robot: Robot, planned: Planned) -> Course:
        """Return the path through the points, from joint values (n,)."""
        from trajcli.planners.course import JointCourse, PassedPoints

        del planned
        points = self._untimed().waypoints(resting(start), robot)
        path = self._path(points, robot, smooth=True)
        passed = PassedPoints(path.s[1:-1], points.positions[1:-1], path.missed[1:-1])
        return JointCourse(path.curve, robot, passed)

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the fastest motion along the path.

        Raises:
            MissingLimitError: When a moving joint has no limit of acceleration.
            PlanningError: When the velocities at the ends do not fit the path, or the duration is too short.
        """
        return self._along_path(start, robot, of_tool=False)

    def within_tool_limits(self, start: State, robot: Robot) -> Planned:
        """Return the fastest motion along the path within the limits of the tool.

        Raises:
            PlanningError: When there is none.
        """
        return self._along_path(start, robot, of_tool=True)

    def _along_path(self, start: State, robot: Robot, *, of_tool: bool) -> Planned:
        if not self._keeps_jerk(robot, of_tool=of_tool):  # its acceleration steps anyway
            start = State(start.position, start.velocity, np.zeros_like(start.acceleration))
        points = self._untimed().waypoints(start, robot)
        moving = np.ptp(points.positions, axis=0) > 0
        if not moving.any():
            return self._in_one_point(start, points, robot)
        bounds = robot.limits.acceleration
        lacking = np.flatnonzero(moving & lacks_acceleration(robot))
        if lacking.size:
            raise missing_limit(
                self.tag, "acceleration", lacking.tolist(), robot, "to find the fastest motion"
            )
        path, motion = self._solved(points, robot, moving, of_tool=of_tool)
        jerk = robot.limits.jerk if isinstance(motion, JerkLimitedMotion) else None
        duration = motion.trajectory.duration
        factor = 1.0 if self.duration is None else self.duration / duration
        _check_duration(self.duration, duration, points)
        passed = times_at(motion.law, path.s)
        efforts = effort_shares(motion.trajectory, robot)
        binding = switching_structure(motion.trajectory, robot.limits.velocity, bounds, jerk, efforts)
        return Planned(
            scale_time(motion.trajectory, factor) if factor != 1 else motion.trajectory,
            points.target,
            phases=tuple(
                Phase(f"{b.quantity} {'+' if b.sign > 0 else '-'}", b.start * factor, b.end * factor, b.joint)
                for b in binding
            ),
            via_points=ViaPoints(passed * factor, points.positions, path.missed),
            events=(*points.events, *path.events, *events_of_law(motion, robot, factor)),
            binding_phases=factor <= 1 + LITTLE,
            remedies=REMEDIES,
            phase_plane=self._phase_plane(path, motion, robot).scaled(factor),
            continuity=1 if jerk is None else 2,
        )

    def _keeps_jerk(self, robot: Robot, moving: NDArray[np.bool_] | None = None, *, of_tool: bool) -> bool:
        """Return whether limits of jerk are kept: of joints, all or those that move (n,), or of the tool."""
        limits = robot.limits
        joints = limits.jerk if moving is None else limits.jerk[moving]
        tool = (limits.tcp.jerk, limits.tcp.angular_jerk) if of_tool else ()
        return self.jerk == "keep" and bool(np.isfinite([*joints.flat, *tool]).any())

    def _solved(
        self, points: PointTable, robot: Robot, moving: NDArray[np.bool_], *, of_tool: bool
    ) -> tuple[JointPath, TimeOptimalMotion]:
        if not self._keeps_jerk(robot, moving, of_tool=of_tool):
            path = self._path(points, robot, smooth=False)
            return path, solve_second_order(path, robot, of_tool=of_tool)
        if self.path == "spline":
            require_continuous_curvature(self.rule)
        path = self._path(points, robot, smooth=True)
        bends = self.path == "spline" and self.rule != "quintic"
        return solve_within_jerk(path, points.rates[1, 0], robot, bends=bends, of_tool=of_tool)

    def _phase_plane(self, path: JointPath, motion: TimeOptimalMotion, robot: Robot) -> PhasePlane:
        """Return the law with its limits; the length of chords has a unit where all joints share one."""
        limits, kinds = robot.limits, set(robot.joint_types)
        by_chord = self.path == "polyline" or (self.parameter or "chord") == "chord"
        alike = by_chord and len(kinds) == 1
        dimension: Literal["length", "angle", "ratio"] = (
            "ratio" if not alike else "length" if "prismatic" in kinds else "angle"
        )
        joints = JointConstraint(path.curve, limits.velocity, limits.acceleration)
        curve = path.curve
        constraints = (joints, *path_constraints(curve, robot), *effort_constraints(curve, robot))
        return PhasePlane(motion.law, constraints, path.curve.breaks, motion.stops, dimension)

    def _in_one_point(self, start: State, points: PointTable, robot: Robot) -> Planned:
        """Return the move all of whose points are one."""
        arrived = same_state(start, points.target) and not self.duration
        if arrived or not points.rates.any():
            return standstill(points.target, self.duration or 0.0, REMEDIES)
        order, end = (int(k) for k in np.argwhere(points.rates[:, [0, -1]].any(axis=2))[0])
        values = points.rates[order, [0, -1][end]]
        joint = int(np.flatnonzero(values)[0])
        message = (
            f"{self.tag} {('starts', 'ends')[end]} with {{joint}} at {{value}}, but all its points are one: "
            "no path leads out of a point and back to it"
        )
        hint = "give it a point between in `through`, or use jerk_limited"
        value, name = float(values[joint]), robot.joint_names[joint]
        amounts = {"value": Amount(value, order + 1, joint)}
        raise PlanningError(of_joint(name, message, hint, amounts, value=value))

    def _untimed(self) -> Self:
        """Return the move without the times of a recording: it is to be passed faster."""
        if not isinstance(self.through, Recorded):
            return self
        return self.model_copy(update={"through": replace(self.through, times=None)})

    def _path(self, points: PointTable, robot: Robot, *, smooth: bool) -> JointPath:
        if self.path == "polyline":
            return polyline_through(points, np.array(self.corner or (0.0,)), robot, smooth=smooth)
        return spline_through(self.rule or "not_a_knot", self.parameter or "chord", points, robot)


def _check_duration(wanted: float | None, fastest: float, points: PointTable) -> None:
    if wanted is None or wanted == fastest:
        return
    if points.rates[0, [0, -1]].any():
        message = "time_optimal cannot last a given time when it starts or ends in motion"
        raise PlanningError(message, hint="leave `duration` and `align` out, or use spline")
    if wanted < fastest:
        message = "time_optimal needs {fastest}, it shall last {wanted}"
        amounts = {"fastest": Amount(fastest, rounded="up"), "wanted": Amount(wanted)}
        raise PlanningError(Problem(message, "leave `duration` out for the fastest", amounts=amounts))
