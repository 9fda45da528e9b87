"""Limits of the tool for all t, by forward kinematics of the joints' curve: in joint space as on a path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.findings import Finding, NamedJoints, at_time, tool_excess_amounts
from trajcli.frozen import frozen
from trajcli.kinematics.jacobian import jacobian, tcp_twist
from trajcli.kinematics.robot import Limits, Robot
from trajcli.limits.kinds import TOOL_KINDS, LimitedMove, LimitFamily, LimitKind, LimitSurvey
from trajcli.limits.tolerances import TOOL_RELATIVE, allowed_jump
from trajcli.limits.tool_bound import ToolPeak, tool_bounds
from trajcli.trajectory import State, Trajectory

SMOOTH = "a planner or a law whose acceleration does not step"
_SURVEYED = WeakKeyDictionary[PiecewisePolynomial, tuple[object, Mapping[str, ToolPeak]]]()
"""Of the move of each curve that was asked for last: the only move of a plan is judged twice."""
_LEVER = 1e-12  # m, or of an axis: what rounding makes of a joint that does not move the tool
_SMOOTH_HINT = f"use {SMOOTH}, or leave the limit of the tool's {{words}} out"


@frozen
class ToolStep:
    """A step in the acceleration of the tool, or in its angular acceleration.

    Attributes:
        kind: The limit of the acceleration that steps.
        size: SI.
        time: s, from the start of the move.
    """

    kind: LimitKind
    size: float
    time: float


@frozen
class ToolSurvey(LimitSurvey):
    """The largest speeds, accelerations and jerks of the tool in a move.

    Attributes:
        limits: In force.
        peaks: By the key of their limits, times from the start of the move; none where none is asked for.
        steps: The largest steps of accelerations, where their derivatives are limited.
        begins: When the move begins, s from the start of the trajectory.
        moves: Whether it has a duration.
        on_path: Whether the tool goes along a path.
    """

    limits: Limits
    peaks: Mapping[str, ToolPeak]
    steps: tuple[ToolStep, ...] = ()
    begins: float = 0.0
    moves: bool = True
    on_path: bool = False

    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield the limits of the tool that the move does not keep."""
        del joints, origin  # times are from the start of the trajectory
        for kind in (kind for kind in TOOL_KINDS if kind.key in self.peaks):
            limit, peak = float(getattr(self.limits.tcp, kind.key)), self.peaks[kind.key]
            steps = [step for step in self.steps if (step.kind.order or 0) + 1 == kind.order]
            stepping = [step for step in steps if step.kind.dimension == kind.dimension]
            if np.isinf(limit):
                continue
            if stepping:
                yield from (_stepping(step, kind, self.begins) for step in stepping)
            elif not peak.upper_bound <= limit * (1 + TOOL_RELATIVE):
                yield tool_excess(
                    kind, peak.upper_bound, limit, self.begins + peak.time, still=not self.moves
                )

    def excess(self) -> float:
        """Return by how much of a limit the tool is above it."""
        if self.steps:
            return np.inf
        shares = (peak.upper_bound / float(getattr(self.limits.tcp, key)) for key, peak in self.peaks.items())
        return max(shares, default=0.0) - 1


def _stepping(step: ToolStep, kind: LimitKind, begins: float) -> Finding:
    """Return that an acceleration steps although its derivative is limited."""
    time = begins + step.time
    return Finding(
        kind=f"{step.kind.name}_jump",
        value=step.size,
        limit=0.0,
        time=time,
        message=f"the {step.kind.words} of the tool steps by {{value}} {at_time(time)}",
        amounts=tool_excess_amounts(step.size, 0.0, 2, step.kind.dimension),
        hint=_SMOOTH_HINT.format(words=kind.words),
    )


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
        value=value,
        limit=limit,
        time=time,
        factor=factor if np.isfinite(factor) and not still else None,
        message=f"the {kind.words} of the tool reaches {{value}} {at_time(time)}, its limit is {{limit}}",
        amounts=tool_excess_amounts(value, limit, order, kind.dimension),
        method="bounded",
    )


def limits_tool(robot: Robot) -> bool:
    """Return whether an arm has limits of its tool, and the geometry that it takes to judge them."""
    return robot.convention is not None and any(kind.stated(robot.limits) for kind in TOOL_KINDS)


def unjudged(limits: Limits, robot: Robot | None) -> set[str]:
    """Return the keys of limits of the tool that are stated, and cannot be judged of an arm.

    Args:
        limits: In force.
        robot: The arm; None where nobody says.
    """
    blind = robot is None or robot.convention is None
    return {kind.key for kind in TOOL_KINDS if blind and kind.stated(limits)}


class ToolFamily(LimitFamily):
    """Speeds, accelerations and jerk of the tool."""

    def survey(self, move: LimitedMove) -> ToolSurvey | None:
        """Return the largest speeds and accelerations of the tool; None where nothing can be judged of it."""
        robot, span, on_path = move.robot, move.span, move.motion is not None
        if robot is None or not (on_path or limits_tool(robot)):
            return None
        if not limits_tool(robot):
            return ToolSurvey(robot.limits, {}, (), span.start, span.duration > 0, on_path)
        steps = tuple(_steps(move, robot)) if _order(robot.limits) > 2 else ()
        return ToolSurvey(robot.limits, peaks_in(move, robot), steps, span.start, span.duration > 0, on_path)

    def over_at_ends(self, robot: Robot | None, ends: Sequence[State], use: tuple[str, int, float]) -> bool:
        """Return whether the tool is too fast where a move begins or ends."""
        del use
        if robot is None or not limits_tool(robot):
            return False
        limits = robot.limits.tcp
        twists = [tcp_twist(robot, state.position, state.velocity) for state in ends]
        speed, angular_speed = (max(float(np.linalg.norm(t[k : k + 3])) for t in twists) for k in (0, 3))
        slack = 1 + TOOL_RELATIVE
        return speed > limits.speed * slack or angular_speed > limits.angular_speed * slack


FAMILY = ToolFamily()


def peaks_in(move: LimitedMove, robot: Robot) -> Mapping[str, ToolPeak]:
    """Return `tool_peaks` of a move; times count from its start."""
    key, curve = (robot, move.numbers, move.span.start), move.trajectory.curve
    last = _SURVEYED.get(curve)
    if last is None or last[0] != key:
        breaks, coefficients = move.pieces
        last = _SURVEYED[curve] = key, tool_peaks(robot, breaks - move.span.start, coefficients)
    return last[1]


def tool_peaks(robot: Robot, breaks: Array, coefficients: Array) -> Mapping[str, ToolPeak]:
    """Return the largest magnitudes of what limits of the tool bound, by the keys of these limits.

    Args:
        robot: The arm, with the limits in force.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
    """
    order = _order(robot.limits)
    with np.errstate(over="ignore", invalid="ignore"):
        bounds = tool_bounds(robot, breaks, coefficients, order)
    kinds = (kind for kind in TOOL_KINDS if kind.order is not None and kind.order <= order)
    return {kind.key: bounds[2 * (kind.order or 1) - 2 + (kind.dimension == "angle")] for kind in kinds}


def _order(limits: Limits) -> int:
    """Return the order of the last derivative of the tool that is limited, at least that of accelerations."""
    return max([2, *(kind.order or 0 for kind in TOOL_KINDS if kind.stated(limits))])


def _steps(move: LimitedMove, robot: Robot) -> Iterator[ToolStep]:
    """Yield the largest steps of the accelerations of the tool whose derivatives are limited.

    A step where a move begins or ends is its own if the acceleration on its side is not zero.
    """
    (first, last), trajectory, (breaks, coefficients) = move.numbers, move.trajectory, move.pieces
    if first == last:
        return
    before, after = _both_sides(trajectory, first, last)
    peak, slopes = (
        np.abs([before, after]).max(axis=(0, 1)),
        PiecewisePolynomial(breaks, coefficients).piece_ends(3),
    )
    allowed = allowed_jump(peak, breaks, np.broadcast_to(np.abs(slopes).max(axis=(0, 1)), before.shape))
    change = np.where(np.abs(after - before) <= allowed, 0.0, after - before)
    change[0][np.abs(after[0]) <= allowed[0] / 2] = 0.0
    change[-1][np.abs(before[-1]) <= allowed[-1] / 2] = 0.0
    q = np.concatenate([coefficients[-1], trajectory.before(np.array([move.span.end]))])
    sizes = np.linalg.norm((jacobian(robot, q) @ change[..., None]).reshape(-1, 2, 3), axis=-1)
    limited = {kind.dimension for kind in TOOL_KINDS if kind.order == 3 and kind.stated(robot.limits)}
    for kind in (kind for kind in TOOL_KINDS if kind.order == 2 and kind.dimension in limited):
        size = sizes[:, int(kind.dimension == "angle")]
        if size.max() > _LEVER * np.abs(change).max():
            worst = int(size.argmax())
            yield ToolStep(kind, float(size[worst]), float(breaks[worst]) - move.span.start)


def _both_sides(trajectory: Trajectory, first: int, last: int) -> tuple[Array, Array]:
    """Return the accelerations before and after each break of pieces from `first` to `last`, (w + 1, n)."""
    curve = trajectory.curve
    near = slice(max(first - 1, 0), last + 1)
    starts, ends = PiecewisePolynomial(
        curve.breaks[near.start : near.stop + 1], curve.coefficients[:, near]
    ).piece_ends(2)
    before = ends if first else np.concatenate([trajectory.start.acceleration[None], ends])
    after = np.concatenate([starts[min(first, 1) :], trajectory.end.acceleration[None]])
    return before[: last - first + 1], after[: last - first + 1]
