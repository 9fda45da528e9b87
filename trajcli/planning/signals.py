"""Signals of a job: when each of its moves sets them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, InputError, Problem
from trajcli.job.read import LoadedJob
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.forward import forward
from trajcli.limits.tolerances import JUMP_ABSOLUTE
from trajcli.trajectory import Signal, SignalChange, Trajectory

if TYPE_CHECKING:
    from trajcli.language.signals import SignalAt
    from trajcli.planners.planner import PlannedMove
    from trajcli.planning.flown_job import FlyBy

_ROUNDING = 1e-9  # of a path's length: by which one that is written may be off
_NEAR = 65  # times at which a distance is looked at
_CLOSER = 7  # times that its smallest value is enclosed anew, each time 32 times closer


def signals_of(
    loaded: LoadedJob, moves: Sequence[PlannedMove], trajectory: Trajectory, flyby: FlyBy | None
) -> tuple[Signal, ...]:
    """Return the signals of a job.

    Args:
        loaded: The job.
        moves: As they are flown.
        trajectory: All of them.
        flyby: The zones that are flown; None where there are none.

    Raises:
        InputError: When one is set outside of the job, or along a path that there is not, with its line.
    """
    changes: dict[str, list[SignalChange]] = {}
    for index, planner in enumerate(loaded.job.moves):
        span = trajectory.spans[index]
        name = getattr(planner, "signal", None)
        if name is not None:
            value: float = getattr(planner, "value")  # noqa: B009
            changes.setdefault(name, []).append(SignalChange(span.start, value, index))
        for number, each in enumerate(planner.at or ()):
            with _errors_at(loaded, index, number):
                time = _within(each, _time(each, moves, index, trajectory, flyby), trajectory.duration)
            changes.setdefault(each.signal, []).append(SignalChange(time, each.value, index))
    return tuple(
        Signal(name, tuple(sorted(some, key=lambda change: change.time))) for name, some in changes.items()
    )


@contextmanager
def _errors_at(loaded: LoadedJob, index: int, number: int) -> Iterator[None]:
    """Give errors about a signal of a move its line, and the move they are about."""
    try:
        yield
    except InputError as error:
        path = ("moves", index, "at", number)
        alone = loaded.document.node(path) is None
        problems = (problem.within(loaded.called(index)) for problem in error.said_by(loaded.say).problems)
        place = loaded.document.place(path[:-1] if alone else path)
        raise InputError(*problems).located(place=place) from None


def _within(signal: SignalAt, arrival: float, duration: float) -> float:
    """Return when a signal is set that is named for an arrival, s."""
    time = arrival - signal.before
    if not -JUMP_ABSOLUTE <= time <= duration + JUMP_ABSOLUTE:
        raise InputError(
            f"signal '{signal.signal}' would be set at {time:.6g} s, outside of the job",
            hint=f"the job lasts from 0 to {duration:.6g} s: change `before`",
        )
    return min(max(time, 0.0), duration)


def _time(
    signal: SignalAt, moves: Sequence[PlannedMove], index: int, trajectory: Trajectory, flyby: FlyBy | None
) -> float:
    """Return when a move has come to where it sets a signal, s from the start of the trajectory."""
    zones = () if flyby is None else flyby.zones
    if signal.along is not None:
        return _time_along(signal.along, moves[index], trajectory, zones=trajectory.zones)
    zone = next((zone for zone in zones if zone.move == index), None)
    if zone is None:
        return trajectory.spans[index].end
    return {"enter": zone.entered, "nearest": zone.passed, "leave": zone.left}[signal.when]


def _time_along(
    along: float, move: PlannedMove, trajectory: Trajectory, zones: Sequence[tuple[float, float]]
) -> float:
    """Return when the tool has gone so far along the path of a move, or is nearest to there in a zone."""
    begun, tool = trajectory.spans[move.index].start, move.planned.tool
    for part in move.planned.parts:
        if part.tool is not None:
            tool, begun = part.tool, trajectory.spans[move.index].start + part.start
    if tool is None or tool.path is None or tool.pure_rotation:
        reason = "its tool turns where it is" if tool is not None and tool.pure_rotation else "it has none"
        raise InputError(f"no signal can be set along its path: {reason}", hint="say `when: nearest`")
    s, near = along if along >= 0 else tool.path.length + along, _ROUNDING * tool.path.length
    if not -near <= s <= tool.path.length + near:
        message = "a signal is set {asked} along its path, which is {length} long"
        hint = "write a length within it; one below zero counts from its end"
        amounts: Amounts = {
            "asked": Amount(abs(along), dimension="length"),
            "length": Amount(tool.path.length, dimension="length"),
        }
        raise InputError(Problem(message, hint, amounts=amounts))
    first, last = _range(tool)
    if first - near <= s <= last + near:
        return begun + float(times_at(tool.law, np.array([s]))[0]) - tool.law.start
    end = begun if s < first else begun + tool.law.duration
    zone = min(zones, key=lambda times: min(abs(times[0] - end), abs(times[1] - end)))
    return _nearest(move, trajectory, zone, tool.path.poses.evaluate(np.array([s]))[0][0, :3, 3])


def _range(tool: ToolMotion) -> tuple[float, float]:
    """Return the first and the last s of a motion along a path."""
    ends = tool.law.evaluate(np.array([tool.law.start, tool.law.end]))[:, 0]
    return float(ends[0]), float(ends[1])


def _nearest(
    move: PlannedMove, trajectory: Trajectory, within: tuple[float, float], position: Array
) -> float:
    """Return when the tool is nearest to a position (3,) between two times."""
    low, high = within
    for _ in range(_CLOSER):
        times = np.linspace(low, high, _NEAR)
        reached = forward(move.robot, trajectory.curve.evaluate(times))[:, :3, 3]
        index = int(np.linalg.norm(reached - position, axis=1).argmin())
        low, high = times[max(index - 1, 0)], times[min(index + 1, _NEAR - 1)]
    return 0.5 * float(low + high)
