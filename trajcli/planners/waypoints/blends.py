"""Linear segments with parabolic blends, and their times and durations where only the limits say so."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.curves.parabolic_blends.blends import Blended, blended, blended_by_acceleration
from trajcli.curves.parabolic_blends.corners import Ends
from trajcli.curves.parabolic_blends.durations import BlendAccelerationError
from trajcli.curves.parabolic_blends.fastest import fastest_blends
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.time_allocation import fastest_durations
from trajcli.errors import Amount, Amounts, PlanningError, of_joint
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import (
    FieldType,
    Flaw,
    Number,
    ReadingContext,
    refuse_flaws,
)
from trajcli.language.per_joint import read_each
from trajcli.language.recorded import Recorded
from trajcli.language.targets import JointAccelerationMagnitudes, Target
from trajcli.planners.boundary_states import missing_limit, standstill, start_in_motion
from trajcli.planners.planner import Event, Phase, Planned
from trajcli.planners.waypoints.through_points import OPEN_END_REMEDIES, REMEDIES, PointTable, ThroughPoints
from trajcli.trajectory import State, ViaPoints
from trajcli.units import Quantity

_SHARES = (0.15, 0.25, 0.35, 0.44)  # of the shorter segment: with more, two blends that pass exactly overlap


def blend_times(
    points: PointTable, blends: Array | None, robot: Robot, acceleration: Array, ends: Ends, *, exactly: bool
) -> tuple[Array, Array]:
    """Return times (m,), the first zero, and blends (m,), s, of the fastest motion that keeps the limits.

    Args:
        points: m of them, not all the same.
        blends: Durations (m,) where they are given, s.
        robot: Its limit of velocity counts.
        acceleration: Bounds, shape (n, 2).
        ends: Where the first and the last blend lie.
        exactly: Whether the points are passed exactly.

    Raises:
        MissingLimitError: When a joint that moves has no limit of acceleration.
        PlanningError: When no times keep the limits.
    """
    moving = np.ptp(points.positions, axis=0) > 0
    lacking = np.flatnonzero(moving & ~np.isfinite(acceleration).all(axis=1))
    if lacking.size:
        also = ("give every waypoint a `time`", "give the move an `acceleration`")
        why = "to find when it passes its points"
        raise missing_limit("blends", "acceleration", lacking.tolist(), robot, why, *also)
    velocity = robot.limits.velocity
    segments, fastest = fastest_blends(points.positions, velocity, acceleration, ends=ends)
    if blends is None and not exactly:
        return np.concatenate([[0.0], np.cumsum(segments)]), fastest
    shares = _SHARES if blends is None else (None,)
    bounds = np.stack([velocity, acceleration, np.tile([-np.inf, np.inf], (len(velocity), 1))])
    best: tuple[Array, Array] | None = None
    for share in shares:
        family = _Family(points.positions, blends, share, ends, exactly)
        durations = fastest_durations(family.curve, segments, bounds)
        if durations is not None and (best is None or durations.sum() < best[0][-1]):
            best = np.concatenate([[0.0], np.cumsum(durations)]), family.blends(durations)
    if best is None:
        hint = "give every waypoint a `time`, or longer blends"
        raise PlanningError("no times let the blends keep all limits", hint=hint)
    return best


@frozen
class _Family:
    """The curves that differ in the durations of their segments alone.

    Attributes:
        positions: Shape (m, n).
        given: Durations of the blends, shape (m,), s; None where they are a share of the segments.
        share: Of the shorter segment beside a point.
        ends: Where the first and the last blend lie.
        exactly: Whether the points are passed exactly.
    """

    positions: Array
    given: Array | None
    share: float | None
    ends: Ends
    exactly: bool

    def blends(self, segments: Array) -> Array:
        """Return the durations (m,) of the blends."""
        if self.given is not None:
            return self.given
        padded = np.pad(segments, 1, mode="edge")
        return np.asarray((self.share or 1.0) * np.minimum(padded[:-1], padded[1:]))

    def curve(self, segments: Array) -> PiecewisePolynomial:
        times = np.concatenate([[0.0], np.cumsum(segments)])
        blends = self.blends(segments)
        return blended(times, self.positions, blends, ends=self.ends, exactly=self.exactly).curve


_BLEND = Number(Quantity("time"), "Duration of a blend, s.", above=0.0)


@comparable
class BlendDurations(FieldType):
    """One duration for all blends, or one for each point."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> float | tuple[float, ...]:  # noqa: ANN401
        """Return seconds."""
        if not isinstance(value, list | tuple):
            return _BLEND.read(value, context)
        return tuple(read_each(enumerate(value), lambda _, item: _BLEND.read(item, context)).values())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number or a list."""
        one = _BLEND.json_schema()
        return {"anyOf": [one, {"type": "array", "items": one, "minItems": 2}]}


class Blends(ThroughPoints):
    """Linear segments with parabolic blends: the points between the ends are passed at a stated distance.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.2; Craig,
    Introduction to Robotics (2005), section 7.3.
    """

    continuity: ClassVar[Literal[1, 2]] = 1

    planner: Literal["blends"] = "blends"
    blend_durations: (
        Annotated[
            float | tuple[float, ...],
            BlendDurations("Duration of the blends, s: one for all, or one for each point, ends included."),
        ]
        | None
    ) = None
    acceleration: JointAccelerationMagnitudes | None = None
    end_blends: Annotated[
        Literal["centred", "inside"],
        Field(
            description="centred: the first and the last blend are centred on their times, as Siciliano has "
            "it, so the motion lasts half a blend longer at either end; inside: they lie within the end "
            "segments, as Craig has it."
        ),
    ] = "centred"
    exactly: Annotated[
        bool, Field(strict=True, description="Pass through the points, by way of pseudo-points beside them.")
    ] = False

    @property
    def target(self) -> Target | None:
        """The last point; None where blends are centred: the move may end after it passed there."""
        return None if self.end_blends == "centred" else super().target

    @model_validator(mode="after")
    def _blends_fit(self) -> Blends:
        refuse_flaws([*self._flaws_of_blends(), *self._flaws_of_points()])
        return self

    def _flaws_of_blends(self) -> Iterator[Flaw]:
        own = [k for k, point in enumerate(self.listed) if point.blend is not None]
        if self.acceleration is not None and (self.blend_durations is not None or own):
            text = "acceleration and durations of blends exclude each other"
            yield ("acceleration",), text, "leave one of them out"
        count = 1 + len(self.listed)
        if isinstance(self.blend_durations, tuple):
            if own:
                yield (
                    ("blend_durations",),
                    "the list already has the blends of all points",
                    "leave `blend` out",
                )
            if not isinstance(self.through, Recorded) and len(self.blend_durations) != count:
                text = (
                    f"expected {count} durations, start and target included, got {len(self.blend_durations)}"
                )
                yield ("blend_durations",), text, None
        if own and self.blend_durations is None and self.timed:
            text = "give the blends of the other points too"
            yield (
                (),
                text,
                "a number under `blend_durations` is for all points without a `blend` of their own",
            )
        if self.timed is False and own:
            yield (), "blends of points need points with times", "give every waypoint a `time`"

    def _flaws_of_points(self) -> Iterator[Flaw]:
        for path, point, last in self._numbered():
            if any(point.acceleration or ()) or (any(point.velocity or ()) and not last):
                name = "velocity" if any(point.velocity or ()) and not last else "acceleration"
                yield (*path, name), f"blends compute the {name} at the points", "leave it out, or use spline"
            elif any(point.velocity or ()) and not self.timed:
                text = "blends end at rest where their times are found from the limits"
                yield (*path, "velocity"), text, "leave it out, or give every waypoint a `time`"

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the segments and blends.

        Raises:
            MissingLimitError: When a time or a blend follows neither from the fields nor from the limits.
            PlanningError: When the arm moves at the start, or an acceleration is too small for the times.
        """
        points = self.waypoints(start, robot)
        if not start.at_rest and (points.times is None or start.acceleration.any()):
            raise start_in_motion(self.tag, start, robot)
        if points.times is None and not np.ptp(points.positions, axis=0).any():
            return standstill(points.target, self.duration or 0.0, REMEDIES)
        times, durations = self._times_and_blends(points, robot)
        try:
            motion = self._motion(points, times, durations, robot)
        except BlendAccelerationError as error:
            raise _too_slow(error, points, robot) from None
        first, last = _ends(motion, points)
        return Planned(
            motion.curve,
            last,
            phases=_phases(motion),
            via_points=ViaPoints(times + motion.shift, points.positions, motion.missed),
            origin=motion.shift,
            begins=first if start.velocity.any() else None,
            events=(*points.events, *_shrunk(motion, robot)),
            remedies=OPEN_END_REMEDIES if start.velocity.any() else REMEDIES,
        )

    def _times_and_blends(self, points: PointTable, robot: Robot) -> tuple[Array, Array | None]:
        """Return when the points are passed, and the durations of the blends; None for accelerations."""
        if points.times is not None:
            return points.times, self._durations(points)
        bounds = robot.limits.acceleration
        if self.acceleration is not None:
            own = np.array(self.acceleration)[:, None] * [-1.0, 1.0]
            bounds = np.clip(bounds, own[:, :1], own[:, 1:])
        times, durations = blend_times(
            points, self._durations(points), robot, bounds, self.end_blends, exactly=self.exactly
        )
        if self.duration:
            factor = self.duration / self._motion(points, times, durations, robot).curve.duration
            return times * factor, durations * factor
        return times, durations

    def _durations(self, points: PointTable) -> Array | None:
        if self.blend_durations is None:
            return None
        if isinstance(self.blend_durations, tuple) and len(self.blend_durations) != points.count:
            message = f"{len(self.blend_durations)} durations of blends for {points.count} points"
            raise PlanningError(message, hint="give one for each point, none twice, or one number for all")
        durations = np.broadcast_to(np.array(self.blend_durations), (points.count,))
        return np.where(points.blends > 0, points.blends, durations)

    def _motion(self, points: PointTable, times: Array, durations: Array | None, robot: Robot) -> Blended:
        options = {
            "ends": self.end_blends,
            "exactly": self.exactly,
            "start_velocity": points.rates[0, 0],
            "end_velocity": points.rates[0, -1],
        }
        if durations is not None:
            return blended(times, points.positions, durations, **options)
        return blended_by_acceleration(times, points.positions, self._magnitudes(points, robot), **options)

    def _magnitudes(self, points: PointTable, robot: Robot) -> Array:
        if self.acceleration is not None:
            return np.array(self.acceleration)
        magnitudes = np.abs(robot.limits.acceleration).min(axis=1)
        moving = np.ptp(points.positions, axis=0) > 0
        lacking = np.flatnonzero(moving & ~np.isfinite(magnitudes))
        if lacking.size:
            also = "give the move `blend_durations` or an `acceleration`"
            raise missing_limit(self.tag, "acceleration", lacking.tolist(), robot, "for its blends", also)
        return np.where(np.isfinite(magnitudes), magnitudes, 1.0)


def _ends(motion: Blended, points: PointTable) -> tuple[State, State]:
    """Return the states in which the curve begins and ends: beyond a point that a centred blend passes."""
    zero = np.zeros(motion.curve.dimension)
    first, last = motion.curve.piece_ends(0)
    states = [
        State(np.where(motion.shift * velocity != 0, end, position), velocity, zero)
        for end, position, velocity in zip(
            (first[0], last[-1]), points.positions[[0, -1]], points.rates[0, [0, -1]], strict=True
        )
    ]
    return states[0], states[1]


def _phases(motion: Blended) -> tuple[Phase, ...]:
    """Return blends and straight segments in order of time, by joint where each has its own."""
    alike = all((table == table[:, :1]).all() for table in (motion.blends, motion.times))
    phases: list[Phase] = []
    for joint in range(1 if alike else motion.times.shape[1]):
        owner = None if alike else joint
        starts = np.maximum(motion.times[:, joint] - motion.blends[:, joint] / 2, 0.0)
        ends = np.minimum(motion.times[:, joint] + motion.blends[:, joint] / 2, motion.curve.end)
        last = 0.0
        for point, start, end in zip(motion.points.tolist(), starts.tolist(), ends.tolist(), strict=True):
            if start > last:
                phases.append(Phase("straight", last, start, owner))
            if end > start:
                phases.append(Phase(f"blend {point}", start, end, owner, point))
            last = max(last, end)
    return tuple(phases)


def _shrunk(motion: Blended, robot: Robot) -> tuple[Event, ...]:
    if not motion.shrunk:
        return ()
    worst = min(motion.shrunk, key=lambda one: one.used / one.asked)
    whose = "" if worst.joint is None else " of {joint}"
    more = f"; {len(motion.shrunk) - 1} more likewise" if len(motion.shrunk) > 1 else ""
    text = (
        f"the blend{whose} at point {worst.point} was shortened from {{asked}} to {{used}}, "
        f"for which the segments beside it have room{more}"
    )
    name = "" if worst.joint is None else robot.joint_names[worst.joint]
    amounts: Amounts = {"joint": name, "asked": Amount(worst.asked), "used": Amount(worst.used)}
    return (Event("shrunk", text, amounts=amounts),)


def _too_slow(error: BlendAccelerationError, points: PointTable, robot: Robot) -> PlanningError:
    name, last = robot.joint_names[error.joint], error.point == points.count - 1
    where = "last" if last else "first"
    message = (
        f"the acceleration of {{joint}}, {{given}}, is too small for the blend inside the {where} segment: "
        "it takes {least}"
    )
    given = Amount(error.acceleration, 2, error.joint)
    least = Amount(error.least, 2, error.joint, rounded="up")
    hint = "raise the acceleration, allow more time, or say `end_blends: centred`"
    return PlanningError(of_joint(name, message, hint, {"given": given, "least": least}))
