"""Time-optimal motion through waypoints: a path in joint space, and the fastest law along it.

Source: Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis,
IEEE Trans. Robotics 34 (2018).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.curves.operations import scale_time, times_at
from trajcli.curves.parabolic_blends.blends import blended
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.hermite import parabola_velocities
from trajcli.curves.splines.shape_preserving import ShapeError
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, UnsettledSpeedError, time_optimal
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.curves.time_optimal.phase_plane import PhasePlane
from trajcli.curves.time_optimal.switching import switching_structure
from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import (
    FieldType,
    Flaw,
    FlawError,
    ReadingContext,
    number_schema,
    refuse,
    shown,
)
from trajcli.language.per_joint import JointDistance
from trajcli.language.poses import read_numbers
from trajcli.language.recorded import Recorded
from trajcli.planners.approach_limits import approach_constraints
from trajcli.planners.boundary_states import missing_limit, same_state, standstill
from trajcli.planners.effort_limits import (
    effort_constraints,
    lacks_acceleration,
    solved_within_efforts,
)
from trajcli.planners.planner import Event, Phase, Planned, stretched
from trajcli.planners.waypoints.spline_rules import Rule, curve_through
from trajcli.planners.waypoints.through_points import REMEDIES, PointTable, ThroughPoints
from trajcli.trajectory import State, ViaPoints
from trajcli.units import Quantity

Parameter = Literal["chord", "centripetal", "uniform"] | tuple[float, ...]

_NAMED = ("chord", "centripetal", "uniform")
_MOST_STOPS = 10  # that an event lists
_STRETCHED = 1e-9  # relative: a smaller stretch is rounding
_OFF = 1e-9  # relative: a velocity this little off the path is on it
_ROOM = 0.999  # of a segment that two blends may share: each keeps a straight piece between


@frozen
class JointPath:
    """A path through points.

    Attributes:
        curve: q(s).
        s: Path parameter at each point, shape (m,).
        missed: By how much each joint passes beside each point, shape (m, n).
        speeds: sd at the start and at the end.
        events: What was conceded.
    """

    curve: PiecewisePolynomial
    s: Array
    missed: Array
    speeds: tuple[float, float]
    events: tuple[Event, ...] = ()


def spline_through(rule: Rule, parameter: Parameter, points: PointTable, robot: Robot) -> JointPath:
    """Return the spline of a rule; where the arm moves at an end, the path has that direction there.

    A quintic that ends at rest leaves its end towards the next point.

    Raises:
        PlanningError: When the parameter has another number of values than points, or shape_preserving does
            not allow the direction.
    """
    s = _parameter_values(parameter, points)
    q, ends = points.positions, points.rates[0, [0, -1]]
    slopes, speeds = np.zeros_like(ends), [0.0, 0.0]
    for k, (velocity, piece) in enumerate(zip(ends, (0, -1), strict=True)):
        speed = float(np.linalg.norm(velocity))
        chord = np.diff(q, axis=0)[piece] / np.diff(s)[piece]
        if speed:
            slopes[k] = velocity / speed * np.linalg.norm(chord)
            speeds[k] = speed / float(np.linalg.norm(chord))
        elif rule == "quintic":  # without slope and curvature it would take infinite sd to leave the end
            slopes[k] = chord
    rates = np.zeros_like(points.rates)
    rates[0, [0, -1]] = slopes
    known = replace(points, rates=rates)
    try:
        curve = curve_through(rule, _bent_where_all_turn(known, s) if rule == "quintic" else known, s)
    except ShapeError as error:
        name = robot.joint_names[error.component]
        message = f"the velocity of {name} at the {error.end} point does not let the path be monotone there"
        raise PlanningError(Problem(message, "use rule not_a_knot", joint=name)) from None
    return JointPath(curve, s, np.zeros_like(q), (speeds[0], speeds[1]))


def _bent_where_all_turn(points: PointTable, s: Array) -> PointTable:
    """Return the points with the accelerations of parabolas where all joints turn back at once.

    There the computed velocities and accelerations of a quintic vanish, and it would take infinite sd to
    leave the point as fast as the joints can.
    """
    ends = points.rates[0, [0, -1]]
    computed: Array = parabola_velocities(s, points.positions, *ends)
    turning = np.logical_not(computed.any(axis=1))
    turning[[0, -1]] = False
    if not turning.any():
        return points
    slopes = np.diff(points.positions, axis=0) / np.diff(s)[:, None]
    rates, given = points.rates.copy(), points.given.copy()
    rates[1, 1:-1][turning[1:-1]] = (2 * np.diff(slopes, axis=0) / (s[2:] - s[:-2])[:, None])[turning[1:-1]]
    given[1] = given[1] | turning
    return replace(points, rates=rates, given=given)


def _parameter_values(parameter: Parameter, points: PointTable) -> Array:
    if isinstance(parameter, tuple):
        if len(parameter) != points.count:
            message = f"{len(parameter)} values of the parameter for {points.count} points"
            raise PlanningError(message, hint="give one for each point, or use chord")
        return np.array(parameter)
    chords = np.linalg.norm(np.diff(points.positions, axis=0), axis=1)
    steps = {"chord": chords, "centripetal": np.sqrt(chords), "uniform": np.ones_like(chords)}[parameter]
    return np.concatenate([[0.0], np.cumsum(steps)])


def polyline_through(points: PointTable, corner: Array, robot: Robot) -> JointPath:
    """Return straight segments, corners rounded by parabolas that stay within `corner` of them.

    Args:
        points: What to pass.
        corner: How far each joint may pass from a corner, rad or m, shape (n,): all above zero, or all zero
            for sharp corners.
        robot: For the names of joints.

    Raises:
        PlanningError: When the arm moves at an end in another direction than the segment there.
    """
    q, s = points.positions, _parameter_values("chord", points)
    slopes = np.diff(q, axis=0) / np.diff(s)[:, None]
    speeds = tuple(
        _along(slope, velocity, robot)
        for slope, velocity in zip(slopes[[0, -1]], points.rates[0, [0, -1]], strict=True)
    )
    turn = np.abs(np.diff(slopes, axis=0))
    if not corner.any() or not turn.any():
        curve = PiecewisePolynomial(s, np.stack([slopes, q[:-1]]))
        return JointPath(curve, s, np.zeros_like(q), (speeds[0], speeds[1]))
    wanted = np.zeros(points.count)
    sharpest = (turn / corner).max(axis=1)
    wanted[1:-1] = 8 / np.where(sharpest > 0, sharpest, np.inf)
    room = np.diff(s)
    limit = np.full(points.count, np.inf)
    limit[1:-1] = _ROOM * np.minimum(room[:-1], room[1:])
    used = np.minimum(wanted, limit)
    motion = blended(s, q, used, ends="inside", start_velocity=slopes[0], end_velocity=slopes[-1])
    return JointPath(motion.curve, s, motion.missed, (speeds[0], speeds[1]), _shrunk(wanted, used))


def _along(slope: Array, velocity: Array, robot: Robot) -> float:
    """Return sd with which the path of a slope has the velocity."""
    speed = float(velocity @ slope) / float(slope @ slope)
    off = np.abs(velocity - speed * slope)
    if off.max() > _OFF * np.abs(velocity).max() or speed < 0:
        joint = int(off.argmax())
        name = robot.joint_names[joint]
        message = "a polyline is straight at its ends, but {velocity} of {joint} leaves it"
        hint = "use `path: spline`, or let the move before end at rest"
        amounts: Amounts = {"joint": name, "velocity": Amount(float(velocity[joint]), 1, joint)}
        raise PlanningError(Problem(message, hint, joint=name, amounts=amounts))
    return speed


def _shrunk(wanted: Array, used: Array) -> tuple[Event, ...]:
    less = np.flatnonzero(used[1:-1] < wanted[1:-1])
    if not less.size:
        return ()
    share = used[1:-1][less] / wanted[1:-1][less]
    worst = int(less[share.argmin()])
    more = f"; {less.size - 1} more likewise" if less.size > 1 else ""
    part = f"{100 * share.min():.4g} % of the deviation asked for"
    text = f"the corner at point {worst + 1} is rounded by {part}: its segments are too short for more{more}"
    return (Event("shrunk", text),)


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
    """Through points as fast as velocity and acceleration limits allow, on a path that they fix.

    Source: Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability
    Analysis, IEEE Trans. Robotics 34 (2018).
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

    @model_validator(mode="after")
    def _path_fits(self) -> TimeOptimal:
        flaws = [*self._flaws_of_path(), *self._flaws_of_points()]
        if flaws:
            raise refuse(flaws)
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
        for k, point in enumerate(self.listed):
            last = k == len(self.listed) - 1
            path = ("to",) if self.to is not None and last else ("through", k)
            if point.time is not None:
                yield (*path, "time"), "time_optimal finds the times", "leave it out, or use spline"
            if point.blend is not None:
                yield (*path, "blend"), "time_optimal has no blends", "use `path: polyline` and `corner`"
            for name in ("velocity", "acceleration"):
                if any(getattr(point, name) or ()) and not (last and name == "velocity"):
                    text = f"time_optimal does not impose the {name} here"
                    yield (*path, name), text, "only the target may have a `velocity`"

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the fastest motion along the path.

        Raises:
            MissingLimitError: When a moving joint has no limit of acceleration.
            PlanningError: When the velocities at the ends do not fit the path, or the duration is too short.
        """
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
        path = self._path(points, robot)
        motion = _solved(path, robot)
        duration = motion.trajectory.duration
        factor = 1.0 if self.duration is None else self.duration / duration
        _check_duration(self.duration, duration, points)
        passed = times_at(motion.law, path.s)
        binding = switching_structure(motion.trajectory, robot.limits.velocity, bounds)
        return Planned(
            scale_time(motion.trajectory, factor) if factor != 1 else motion.trajectory,
            points.target,
            phases=tuple(
                Phase(f"{b.quantity} {'+' if b.sign > 0 else '-'}", b.start * factor, b.end * factor, b.joint)
                for b in binding
            ),
            via_points=ViaPoints(passed * factor, points.positions, path.missed),
            events=(*points.events, *path.events, *_events(motion)),
            binding_phases=True,
            remedies=REMEDIES,
            phase_plane=self._phase_plane(path, motion, robot).scaled(factor),
        )

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
        constraints = (joints, *approach_constraints(curve, robot), *effort_constraints(curve, robot))
        return PhasePlane(motion.law, constraints, path.curve.breaks, motion.stops, dimension)

    def _in_one_point(self, start: State, points: PointTable, robot: Robot) -> Planned:
        """Return the move all of whose points are one.

        Raises:
            PlanningError: When the arm moves there, unless it has arrived already: no path leads back.
        """
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
        amounts: Amounts = {"joint": name, "value": Amount(value, order + 1, joint)}
        raise PlanningError(Problem(message, hint, joint=name, value=value, amounts=amounts))

    def _untimed(self) -> Self:
        """Return the move without the times of a recording: it is to be passed faster."""
        if not isinstance(self.through, Recorded):
            return self
        return self.model_copy(update={"through": replace(self.through, times=None)})

    def _path(self, points: PointTable, robot: Robot) -> JointPath:
        if self.path == "polyline":
            return polyline_through(points, np.array(self.corner or (0.0,)), robot)
        return spline_through(self.rule or "not_a_knot", self.parameter or "chord", points, robot)


def _solved(path: JointPath, robot: Robot) -> TimeOptimalMotion:
    limits = robot.limits
    further = approach_constraints(path.curve, robot)

    def solve(efforts: tuple[PathConstraint, ...]) -> TimeOptimalMotion:
        return time_optimal(
            path.curve,
            limits.velocity,
            limits.acceleration,
            start_velocity=path.speeds[0],
            end_velocity=path.speeds[1],
            further=(*further, *efforts),
        )

    try:
        return solved_within_efforts(path.curve, robot, solve)
    except UnreachableSpeedError as error:
        share = error.allowed / error.speed
        message = f"time_optimal cannot have so high a velocity at its ends: at most {share:.6g} of it"
        raise PlanningError(message, hint="lower it, or let the move before end at rest") from None
    except UnsettledSpeedError as error:
        message = f"with these velocities at its ends time_optimal passes a limit by {error.over:.9g} times"
        raise PlanningError(message, hint="lower them a little") from None


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


def _events(motion: TimeOptimalMotion) -> Iterator[Event]:
    if motion.refinements:
        yield Event(
            "refined",
            f"the grid was refined {'once' if motion.refinements == 1 else f'{motion.refinements} times'}, "
            f"to {motion.grid.size} grid points of the path",
        )
    if motion.stretch > 1 + _STRETCHED:
        yield stretched(motion.stretch)
    if motion.stops.size:
        times = ", ".join(f"{time:.6g}" for time in motion.stop_times[:_MOST_STOPS].tolist())
        more = ", ..." if motion.stops.size > _MOST_STOPS else ""
        count = motion.stops.size
        text = f"stops at {count} corner{'s' * (count != 1)}, at t = {times}{more} s of the move"
        yield Event("stops", f"{text}: give `corner` to round them")
