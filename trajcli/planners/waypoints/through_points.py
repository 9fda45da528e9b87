"""Moves through a sequence of points: the points as numbers, and the times at which they are passed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, PlanningError, Problem, TrajcliError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import FieldPath, Flaw, refuse, refuse_flaws
from trajcli.language.recorded import SAME_POSITION, Recorded
from trajcli.language.targets import Duration, Target
from trajcli.language.waypoints import NamedWaypoint, Through, Waypoint
from trajcli.planners.planner import Event, Planner, Resolve
from trajcli.trajectory import State, ViaPoints

_SAME_TIME = 1e-9  # relative: a duration and the time of the last point that agree


@frozen
class PointTable:
    """The points of a move as numbers, its start first and its target last.

    Attributes:
        positions: Shape (m, n), rad or m.
        times: Shape (m,), s from the start of the move, the first zero; None where they are to be found.
        rates: Velocities and accelerations, shape (2, m, n); zero where none is given.
        given: Which points give a velocity, and which an acceleration, shape (2, m).
        blends: Shape (m,), s; zero where none is given.
        events: What was left out.
    """

    positions: Array
    times: Array | None
    rates: Array
    given: NDArray[np.bool_]
    blends: Array
    events: tuple[Event, ...] = ()

    @property
    def target(self) -> State:
        """The state of the last point."""
        return State(self.positions[-1], self.rates[0, -1], self.rates[1, -1])

    @property
    def count(self) -> int:
        """How many points there are."""
        return len(self.positions)


REMEDIES = {
    "acceleration_jump": (
        "use spline with rule continuous_acceleration or quintic, or say limits: {jerk: null} in the job"
    )
}
OPEN_END_REMEDIES = {
    **REMEDIES,
    "position_jump": "a blend centred on a point passed in motion begins before it: use `end_blends: inside`",
    "velocity_jump": (
        "this rule leaves the velocities at its ends open: use clamped or continuous_acceleration"
    ),
}


class PointSequence(Planner):
    """A planner that goes from point to point to its target.

    Attributes:
        finds_times: Whether it always finds itself when it passes them, whatever a recording says.
    """

    finds_times: ClassVar[bool] = False

    to: Annotated[
        NamedWaypoint | None,
        Field(description="The state in which the move ends; without it, the last point of `through`."),
    ] = None
    through: Annotated[
        Through, Field(description="The points between start and target, or a file of recorded points.")
    ] = ()

    @property
    def listed(self) -> tuple[Waypoint, ...]:
        """The points after the start that the job lists one by one, the target last."""
        points = () if isinstance(self.through, Recorded) else self.through
        return points if self.to is None else (*points, self.to)

    def _numbered(self) -> Iterator[tuple[FieldPath, Waypoint, bool]]:
        """Yield where each of these points stands in the move, the point, and whether it is the last."""
        for k, point in enumerate(self.listed):
            last = k == len(self.listed) - 1
            yield ("to",) if last and self.to is not None else ("through", k), point, last

    @property
    def target(self) -> Target | None:
        """The last of the points; None where they are recorded."""
        return self.listed[-1] if self.listed else None

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if self.to is None and not isinstance(self.through, Recorded) and not self.through:
            raise refuse([((), f"{self.tag} needs points: `through`, `to` or both", None)])
        return self

    def with_joint_targets(self, resolve: Resolve, near: Array) -> Self:
        """Return the planner with joints in the place of poses, each near to the point before it.

        Raises:
            TrajcliError: What `resolve` raises, with the name of the point.
        """
        if not any(point.gives_pose for point in self.listed):
            return self
        recorded = isinstance(self.through, Recorded)
        near = self.through.positions[-1] if isinstance(self.through, Recorded) else near
        points = []
        for path, point, _ in self._numbered():
            try:
                resolved = resolve(point, near)
            except TrajcliError as error:
                raise _of_point(error, "target" if path == ("to",) else f"waypoint {path[-1]}") from None
            near = resolved.as_state().position
            points.append(_placed(point, resolved))
        if self.to is None:
            return self.model_copy(update={"through": tuple(points)})
        through = self.through if recorded else tuple(points[:-1])
        return self.model_copy(update={"through": through, "to": points[-1]})


class ThroughPoints(PointSequence):
    """A planner that passes points at times that are given, or over a given duration."""

    smoother: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "spline with rule continuous_acceleration": {"planner": "spline", "rule": "continuous_acceleration"},
        "quintic": {"planner": "spline", "rule": "quintic"},
    }

    duration: Duration | None = None

    @property
    def timed(self) -> bool:
        """Whether the points say when they are passed."""
        if isinstance(self.through, Recorded):
            return self.through.times is not None
        return any(point.time is not None for point in self.through) or (
            self.to is not None and self.to.time is not None
        )

    @model_validator(mode="after")
    def _times_fit(self) -> Self:
        if self.finds_times:
            return self
        flaws = [*self._lone_time()]
        if self.timed:
            flaws += [*self._lacking_times(), *self._disordered_times()]
        refuse_flaws(flaws)
        return self

    def _lone_time(self) -> Iterator[Flaw]:
        if isinstance(self.through, Recorded) and not self.timed and self.to is not None and self.to.time:
            text = "the target has a time, but the recorded points have none: all or none"
            yield ("to", "time"), text, "leave it out, or give the points their times"

    def _lacking_times(self) -> list[Flaw]:
        flaws: list[Flaw] = []
        if not isinstance(self.through, Recorded):
            flaws += [
                (("through", k), "this waypoint has no `time`, others have: all or none", None)
                for k, point in enumerate(self.through)
                if point.time is None
            ]
        if self.to is not None and self.to.time is None and self.duration is None:
            flaws.append((("to",), "the target has no time, other points have", "give the move a `duration`"))
        last = self._last_time()
        if self.duration and last and abs(last - self.duration) > _SAME_TIME * last:
            text = f"the last point is reached after {last:.12g} s, which is not the duration"
            flaws.append((("duration",), text, "leave one of them out"))
        return flaws

    def _last_time(self) -> float | None:
        if self.to is not None:
            return self.to.time
        if isinstance(self.through, Recorded):
            return None
        return self.through[-1].time

    def _disordered_times(self) -> list[Flaw]:
        if isinstance(self.through, Recorded):
            return []
        ends = [] if self.to is None else [self.to.time or self.duration]
        times = [(k, t) for k, t in enumerate([*(p.time for p in self.through), *ends]) if t is not None]
        return [
            (
                ("through", k, "time") if k < len(self.through) else ("to",),
                f"times must increase, but {time:.12g} s comes after {before:.12g} s",
                None,
            )
            for (_, before), (k, time) in pairwise(times)
            if time <= before
        ]

    def with_duration(self, duration: float) -> Self:
        """Return the planner whose points are passed in the same proportion, the last after `duration` s."""
        last = self._last_time() or self.duration
        scaled: dict[str, object] = {"duration": duration}
        if self.timed and last:  # without: a recording is the end, and follows `duration`
            factor = duration / last
            scaled["through"] = _at_times(self.through, factor)
            scaled["to"] = self.to and _at(self.to, factor)
        return self.model_copy(update=scaled)

    def lasting(self, duration: float) -> Iterator[tuple[str, Self]]:
        """Yield the move over another duration: where points have times, these are scaled."""
        yield f"`duration: {duration:.12g}`", self.with_duration(duration)

    def waypoints(self, start: State, robot: Robot) -> PointTable:
        """Return the points as numbers; repeated ones are left out where nothing says when they are passed.

        Args:
            start: Where the move begins.
            robot: For the names of its joints in messages.
        """
        recorded = self.through
        if not isinstance(recorded, Recorded):
            points = self._stacked(start, None)
            return points if points.times is not None else _without_repeats(points)
        here = start.position
        self._refuse_another_start(recorded, here, robot)
        kept = recorded.after(here, None if self.to is None else self.to.as_state().position)
        points = self._stacked(start, kept)
        return replace(points, events=left_out(recorded, here, kept))

    def _refuse_another_start(self, recorded: Recorded, here: Array, robot: Robot) -> None:
        """Refuse a recording that leaves no time to go to its first point."""
        if recorded.times is None or recorded.times[0] > 0 or recorded.begins_at(here):
            return
        apart = np.abs(recorded.positions[0] - here)
        if not apart.any():
            text = f"the recording has one row, where the arm stands, at t = {recorded.times[0]:.12g} s"
            raise PlanningError(text, hint="leave out its column t, or the move")
        joint = int(apart.argmax())
        numbers = {"there": recorded.positions[0, joint], "here": here[joint], "distance": apart[joint]}
        amounts: Amounts = {key: Amount(float(value), 0, joint) for key, value in numbers.items()}
        message = (
            f"the recording begins at t = {recorded.times[0]:.12g} s, but not where the arm then stands: "
            "it has {joint} at {there}, the arm at {here}, {distance} apart"
        )
        hint = (
            "go to its first point in a move before, give a larger `merge` or a later `t`, or begin there "
            "(`start: {csv: ...}` with the same file)"
        )
        raise PlanningError(Problem(message, hint, amounts={"joint": robot.joint_names[joint], **amounts}))

    def _stacked(self, start: State, recorded: Recorded | None) -> PointTable:
        listed, positions = self.listed, self._positions(start.position, recorded)
        before = len(positions) - len(listed)
        rates, given = np.zeros((2, *positions.shape)), np.zeros((2, len(positions)), dtype=bool)
        rates[:, 0], given[:, 0] = (start.velocity, start.acceleration), True
        blends = np.zeros(len(positions))
        for k, point in enumerate(listed, before):
            for order, values in enumerate((point.velocity, point.acceleration)):
                if values is not None:
                    rates[order, k], given[order, k] = values, True
            blends[k] = point.blend or 0.0
        return PointTable(positions, self._times(recorded), rates, given, blends)

    def _positions(self, here: Array, kept: Recorded | None) -> Array:
        """Return all points, shape (m, n); where they are a whole recording, the array of that itself."""
        rows = [here, *(point.as_state().position for point in self.listed)]
        if kept is None or not isinstance(self.through, Recorded):
            return np.array(rows)
        whole = self.through.positions
        if not self.listed and len(kept.positions) == len(whole) - 1 and bool((whole[0] == here).all()):
            return whole
        return np.concatenate([rows[:1], kept.positions, *([rows[1:]] if rows[1:] else ())])

    def _times(self, recorded: Recorded | None) -> Array | None:
        if not self.timed:
            return None
        listed = [point.time or self.duration or 0.0 for point in self.listed]
        before = np.empty(0) if recorded is None or recorded.times is None else recorded.times
        if before.size and before[-1] > 0 and self.to is None and self.duration:
            before = before * (self.duration / before[-1])
        times = np.concatenate([[0.0], before, listed])
        late = np.flatnonzero(np.diff(times) <= 0)
        if late.size:
            message = (
                f"the target is reached after {times[-1]:.12g} s, "
                f"the last recorded point after {times[-2]:.12g} s"
            )
            raise PlanningError(message, hint="give the target a later `time`")
        times.flags.writeable = False  # curves and promises take them without a copy
        return times


def _placed(point: Waypoint, resolved: Target) -> Waypoint:
    if not point.gives_pose:
        return point
    return Waypoint(**resolved.model_dump(by_alias=True), time=point.time, blend=point.blend)


def via_points(points: PointTable, times: Array) -> ViaPoints:
    """Return the promise to be in every point at its time (m,)."""
    exact = np.zeros(points.positions.shape)  # takes no memory, as long as nobody writes to it
    exact.flags.writeable = False
    return ViaPoints(times, points.positions, exact)


def _at_times(points: tuple[Waypoint, ...] | Recorded, factor: float) -> tuple[Waypoint, ...] | Recorded:
    if isinstance(points, Recorded):
        return points if points.times is None else replace(points, times=points.times * factor)
    return tuple(_at(point, factor) for point in points)


def _of_point(error: TrajcliError, name: str) -> TrajcliError:
    return type(error)(*(problem.within(name) for problem in error.problems))


def _at(point: Waypoint, factor: float) -> Waypoint:
    return point if point.time is None else point.model_copy(update={"time": point.time * factor})


def left_out(recorded: Recorded, here: Array, kept: Recorded) -> tuple[Event, ...]:
    """Return the event that not all recorded points after `here` (n,) are kept, or none."""
    count = len(recorded.positions) - int(recorded.begins_at(here)) - len(kept.positions)
    text = (
        f"left out {count} of {len(recorded.positions)} points of {recorded.file}: too near to the one before"
    )
    return (Event("merged", text),) if count else ()


def _without_repeats(points: PointTable) -> PointTable:
    """Return the points without those that stand where the one before stands, the start and target apart."""
    same = (np.abs(np.diff(points.positions, axis=0)) <= SAME_POSITION).all(axis=1)
    if not same.any() or points.count == 2:
        return points
    keep = np.append(True, ~same)
    if not keep[-1]:  # the target stays, because it may say how fast
        keep[-1], keep[np.flatnonzero(keep[:-1])[-1]] = True, False
        keep[0] = True
    count = points.count - int(keep.sum())
    text = f"left out {count} waypoint{'s' * (count != 1)} that repeat{'s' * (count == 1)} the one before"
    return replace(
        points,
        positions=points.positions[keep],
        rates=points.rates[:, keep],
        given=points.given[:, keep],
        blends=points.blends[keep],
        events=(*points.events, Event("merged", text)),
    )
