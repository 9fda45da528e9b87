"""Limits of the tool for all t, by forward kinematics of the joints' curve: in joint space as on a path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts
from trajcli.findings import Finding, NamedJoints, at_time
from trajcli.frozen import frozen
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.robot import Limits, Robot
from trajcli.limits.kinds import (
    KIND_OF,
    TOOL_KINDS,
    LimitedMove,
    LimitFamily,
    LimitKind,
    LimitSurvey,
)
from trajcli.limits.tolerances import JUMP_RELATIVE, TOOL_RELATIVE
from trajcli.limits.tool_bound import ToolPeak, tool_bounds
from trajcli.trajectory import State

BOUNDED = tuple(kind for kind in TOOL_KINDS if not kind.on_paths_only)
"""What `tool_bounds` bounds, in its order."""
_JERK_HINT = "use shape jerk_limited or quintic, or leave the limit of the tool's jerk out"


@frozen
class ToolSurvey(LimitSurvey):
    """The largest speeds and accelerations of the tool in a move.

    Attributes:
        limits: In force.
        peaks: By the key of their limits, times from the start of the move; none where none is asked for.
        begins: When the move begins, s from the start of the trajectory.
        moves: Whether it has a duration.
        motion: The reference motion along a path; None in joint space. Speeds and accelerations may differ
            from those of its law, which was planned within the limits, by as much as its tolerance says.
    """

    limits: Limits
    peaks: Mapping[str, ToolPeak]
    begins: float = 0.0
    moves: bool = True
    motion: ToolMotion | None = None

    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield the limits of the tool that the move does not keep."""
        del joints, origin  # times are from the start of the trajectory
        for kind in (kind for kind in BOUNDED if kind.key in self.peaks):
            limit, peak = float(getattr(self.limits.tcp, kind.key)), self.peaks[kind.key]
            if not np.isinf(limit) and not peak.most <= limit * (
                1 + TOOL_RELATIVE + 2 * self._promised(kind)
            ):
                yield tool_excess(kind, peak.most, limit, self.begins + peak.time, still=not self.moves)
        if self.motion is not None and not self.motion.pure_rotation and np.isfinite(self.limits.tcp.jerk):
            yield from self._law_over()

    def excess(self) -> float:
        """Return by how much of a limit the tool is above it."""
        shares = (peak.most / float(getattr(self.limits.tcp, key)) for key, peak in self.peaks.items())
        return max(shares, default=0.0) - 1

    def _promised(self, kind: LimitKind) -> float:
        """Return by what part of its peak a quantity may differ from that of the law."""
        if self.motion is None:
            return 0.0
        tolerance = self.motion.tolerance
        return tolerance.angle if kind.dimension == "angle" else tolerance.position

    def _law_over(self) -> Iterator[Finding]:
        """Yield where the law's jerk breaks its limit, or its acceleration steps although jerk is limited."""
        assert self.motion is not None  # noqa: S101
        limit, law = self.limits.tcp.jerk, self.motion.law
        before, after = law.piece_ends(2)[1][:, 0], law.piece_ends(2)[0][:, 0]
        steps = np.abs(np.append(after, 0.0) - np.append(0.0, before))
        accelerations, jerks = peaks(law, (2, 3))
        if steps.max() > JUMP_RELATIVE * float(accelerations.magnitude[0]):
            time, size = self.begins + float(law.breaks[int(steps.argmax())]), float(steps.max())
            yield Finding(
                kind="tool_acceleration_jump",
                joint=None,
                value=size,
                limit=0.0,
                time=time,
                message=f"the acceleration of the tool along its path steps by {{value}} {at_time(time)}",
                amounts=_amounts(size, 0.0, 2, "length"),
                hint=_JERK_HINT,
            )
            return
        value = float(jerks.magnitude[0])
        if value > limit * (1 + TOOL_RELATIVE):
            time = float(jerks.high_time[0] if jerks.high[0] >= value else jerks.low_time[0])
            yield replace(tool_excess(KIND_OF["tool_jerk"], value, limit, self.begins + time), method="exact")


def tool_excess(kind: LimitKind, value: float, limit: float, time: float, *, still: bool = False) -> Finding:
    """Return where the tool is over a limit.

    Args:
        kind: Of the limit.
        value: SI; a bound for all t.
        limit: SI.
        time: s.
        still: Whether the motion has no duration that could be longer.
    """
    order = kind.order or 1
    factor = (value / limit) ** (1 / order)
    return Finding(
        kind=kind.name,
        joint=None,
        value=value,
        limit=limit,
        time=time,
        factor=factor if np.isfinite(factor) and not still else None,
        message=f"the {kind.words} of the tool reaches {{value}} {at_time(time)}, its limit is {{limit}}",
        amounts=_amounts(value, limit, order, kind.dimension),
        method="bounded",
    )


def _amounts(value: float, limit: float, order: int, dimension: Literal["length", "angle"]) -> Amounts:
    return {
        "value": Amount(value, order, None, dimension, "up"),
        "limit": Amount(limit, order, None, dimension, "down"),
    }


def limits_tool(robot: Robot) -> bool:
    """Return whether an arm has limits of its tool, and the geometry that it takes to judge them."""
    return robot.convention is not None and any(kind.stated(robot.limits) for kind in BOUNDED)


def unjudged(limits: Limits, robot: Robot | None, motion: ToolMotion | None) -> set[str]:
    """Return the keys of limits of the tool that are stated, and cannot be judged in a move.

    Args:
        limits: In force.
        robot: The arm; None where nobody says.
        motion: The reference motion of the tool along a path; None in joint space.
    """
    blind = robot is None or robot.convention is None
    on_path = motion is not None and not motion.pure_rotation
    return {
        kind.key
        for kind in TOOL_KINDS
        if kind.stated(limits) and (blind or (kind.on_paths_only and not on_path))
    }


class ToolFamily(LimitFamily):
    """Speeds, accelerations and jerk of the tool."""

    def survey(self, move: LimitedMove) -> ToolSurvey | None:
        """Return the largest speeds and accelerations of the tool; None where nothing can be judged of it."""
        robot, motion, span = move.robot, move.motion, move.span
        if robot is None or (motion is None and not limits_tool(robot)):
            return None
        known = peaks_in(move, robot) if limits_tool(robot) else {}
        return ToolSurvey(robot.limits, known, span.start, span.duration > 0, motion)

    def over_at_ends(self, robot: Robot | None, ends: Sequence[State], use: tuple[str, int, float]) -> bool:
        """Return whether the tool is too fast where a move begins or ends."""
        del use
        if robot is None or not limits_tool(robot):
            return False
        from trajcli.kinematics.jacobian import tcp_twist

        limits = robot.limits.tcp
        twists = [tcp_twist(robot, state.position, state.velocity) for state in ends]
        speed, angular_speed = (max(float(np.linalg.norm(t[k : k + 3])) for t in twists) for k in (0, 3))
        room = 1 + TOOL_RELATIVE
        return speed > limits.speed * room or angular_speed > limits.angular_speed * room


FAMILY = ToolFamily()


def peaks_in(move: LimitedMove, robot: Robot) -> Mapping[str, ToolPeak]:
    """Return `tool_peaks` of a move; times count from its start."""
    breaks, coefficients = move.pieces
    return tool_peaks(robot, breaks - move.span.start, coefficients)


def tool_peaks(robot: Robot, breaks: Array, coefficients: Array) -> Mapping[str, ToolPeak]:
    """Return the largest magnitudes of what limits of the tool bound, by the keys of these limits.

    Args:
        robot: The arm, with the limits in force.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        bounds = tool_bounds(robot, breaks, coefficients)
    return {kind.key: bound for kind, bound in zip(BOUNDED, bounds, strict=True)}
