"""Verification of a trajectory: all judgements in one verdict, each finding with its remedy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from trajcli.checks.continuity import AccelerationSteps, acceleration_steps, check_continuity
from trajcli.checks.target import check_targets, check_waypoints
from trajcli.curves.extrema import IntervalPeaks
from trajcli.errors import at_least
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Limits, ToolLimits
from trajcli.limits.joints import JointSurvey, moves_over, numbered, peaks_by_move
from trajcli.limits.kinds import (
    KIND_OF,
    LimitedMove,
    LimitSurvey,
    check_flown,
    families,
    family,
    limited_part,
)
from trajcli.limits.tolerances import LIMIT_RELATIVE, TOOL_RELATIVE
from trajcli.trajectory import Promise, Span, Trajectory

if TYPE_CHECKING:
    from trajcli.checks.tool import SampledTool
    from trajcli.curves.approach import ApproachUse
    from trajcli.limits.effort import MoveEfforts
    from trajcli.limits.tool_bound import ToolPeak

_NO_TOOL_LIMITS = ToolLimits()
_NO_SURVEYS: Mapping[str, LimitSurvey] = {}
_PART = 0.25  # of that room: a third of it is a third power's
_NO_HELP = "slowing down does not help"
_SLOW = "say `when_over_limit: slow`"


@frozen
class Verdict:
    """Outcome of the checks.

    Attributes:
        findings: What is wrong, by move and time.
        steps: Legal steps in acceleration, in order of time.
        peaks: For each span the extremes of position, velocity, acceleration and jerk, times on the curve.
        unchecked: (joint, quantity) that some move leaves unlimited in at least one direction, where the arm
            moves if moves differ in limits; an effort only where the tool carries something.
        unchecked_of_tool: Limits of the tool that are stated and cannot be judged in some move: of an arm
            without geometry.
        sampled: What of moves along a path is judged on rows alone, which is no proof of what lies between
            them, and in which moves.
        surveys: For each span what it uses of further limits, by their family.
    """

    findings: tuple[Finding, ...]
    steps: AccelerationSteps
    peaks: IntervalPeaks
    unchecked: tuple[tuple[str, str], ...]
    unchecked_of_tool: tuple[str, ...] = ()
    sampled: tuple[tuple[str, tuple[int, ...]], ...] = ()
    surveys: tuple[Mapping[str, LimitSurvey], ...] = ()

    def __repr__(self) -> str:
        worst = [f"{found.kind} of {found.joint or 'the tool'}" for found in self.findings[:2]]
        more = ["..."] if len(self.findings) > len(worst) else []
        return f"Verdict({self.text}{': ' * bool(worst)}{', '.join(worst + more)})"

    @cached_property
    def tool_peaks(self) -> tuple[Mapping[str, ToolPeak] | None, ...]:
        """For each span the largest speeds and accelerations of the tool by the keys of their limits.

        Times count from the start of the move; None on a path, and where no limit asks for them.
        """
        surveys: list[Any] = [of_span.get("tool") for of_span in self.surveys]
        return tuple(None if each is None or each.on_path else each.peaks for each in surveys)

    @cached_property
    def by_position(self) -> tuple[tuple[ApproachUse, ...], ...]:
        """For each span where joints use most of their limits of velocity by position.

        One for each joint that has such, times on the curve.
        """
        surveys: list[Any] = [of_span.get("velocity_by_position") for of_span in self.surveys]
        return tuple(() if each is None else each.uses for each in surveys)

    @cached_property
    def efforts(self) -> tuple[MoveEfforts | None, ...]:
        """For each span the largest efforts, times on the curve; None where no limit asks for them."""
        surveys: list[Any] = [of_span.get("effort") for of_span in self.surveys]
        return tuple(surveys)

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.findings

    @property
    def text(self) -> str:
        """The verdict in words: `verified`, or the number of findings."""
        count = len(self.findings)
        return f"{count} finding{'s' * (count != 1)}" if count else "verified"


def verify(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise] | None = None,
) -> Verdict:
    """Return the verdict on a trajectory: its joint limits for all t, its continuity, the points it passes.

    Args:
        trajectory: What to judge.
        limits_by_move: The limits in force, one for each span.
        promises: What each span says of itself; with them the tool and the via points are judged, too.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    moves = _LimitedMoves(trajectory, limits_by_move, promises)
    tools = list(_tools(moves, promises or ()))
    peaks, surveys = peaks_by_move(trajectory), tuple(_further_surveys(moves))
    findings = _over_limits(moves, peaks, surveys)
    findings += check_continuity(trajectory, limits_by_move, peaks)
    if promises is not None:
        findings += _check_via_points(trajectory, promises)
        findings += check_targets(trajectory, promises)
        findings += _check_tools(tools)
        if any(promise.parts for promise in promises):
            findings += check_flown(trajectory, promises)
    return Verdict(
        findings=_in_order(trajectory, findings, promises),
        steps=acceleration_steps(trajectory, limits_by_move, peaks),
        peaks=peaks,
        unchecked=_unchecked(trajectory, limits_by_move, peaks),
        sampled=_sampled(tools),
        unchecked_of_tool=_unchecked_of_tool(moves, peaks),
        surveys=surveys,
    )


def over_limits(
    trajectory: Trajectory, limits_by_move: Sequence[Limits], promises: Sequence[Promise]
) -> tuple[Finding, ...]:
    """Return where limits are broken for any t, of `verify` that part alone.

    Args:
        trajectory: What to judge.
        limits_by_move: The limits in force, one for each span.
        promises: What each span says of itself.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    moves = _LimitedMoves(trajectory, limits_by_move, promises)
    found = _over_limits(moves, peaks_by_move(trajectory), tuple(_further_surveys(moves)))
    return _in_order(trajectory, found, promises)


def _over_limits(
    moves: _LimitedMoves, peaks: IntervalPeaks, surveys: Sequence[Mapping[str, LimitSurvey]]
) -> list[Finding]:
    """Return where moves break limits of joints, and further ones where these are the same all along."""
    whole = [not promise.parts for promise in moves.promises]
    judged = _counting_extremes(moves.trajectory, moves.limits, moves.promises, peaks)
    findings = check_limits(moves.trajectory, moves.limits, judged, whole)
    for k, (of_span, one) in enumerate(zip(surveys, whole, strict=True)):
        for survey in of_span.values() if one else ():
            findings += limit_findings(moves[k], survey)
    return findings


def check_limits(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    peaks: IntervalPeaks | None = None,
    whole: Sequence[bool] | None = None,
) -> list[Finding]:
    """Return where a joint breaks a limit of its position or a derivative of it.

    For each move, joint and quantity it is the worst excess, if any. A move of no length is judged by its
    position and velocity: it has no time to accelerate in.

    Args:
        trajectory: What to judge.
        limits_by_move: One for each span.
        peaks: `peaks_by_move(trajectory)`, where that is known already.
        whole: Whether each span has the same limits from its start to its end; others are left out.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    peaks_of_moves = peaks_by_move(trajectory) if peaks is None else peaks
    findings: list[Finding] = []
    for k in moves_over(peaks_of_moves, limits_by_move):
        if whole is None or whole[k]:
            span, limits = trajectory.spans[k], limits_by_move[k]
            survey = JointSurvey(peaks_of_moves[k], limits, span.duration > 0)
            findings += limit_findings(LimitedMove(trajectory, span, limits), survey)
    return findings


def limit_findings(move: LimitedMove, survey: LimitSurvey) -> Iterator[Finding]:
    """Yield the findings about limits that a move does not keep."""
    for finding in survey.over(move.trajectory, move.trajectory.curve.start):
        yield replace(finding, move=move.span.index)


class _LimitedMoves(Sequence[LimitedMove]):
    """The moves of a trajectory with their limits, made when asked for: most are asked for nothing.

    Attributes:
        trajectory: The whole.
        limits: In force, one for each span.
        promises: What each span says of itself.
    """

    def __init__(
        self, trajectory: Trajectory, limits_by_move: Sequence[Limits], promises: Sequence[Promise] | None
    ) -> None:
        self.trajectory, self.limits = trajectory, limits_by_move
        self.promises = promises or [Promise()] * len(trajectory.spans)
        for each, what in ((limits_by_move, "limits"), (self.promises, "promises")):
            if len(each) != len(trajectory.spans):
                raise ValueError(f"{len(each)} {what} for {len(trajectory.spans)} moves")

    def __len__(self) -> int:
        return len(self.limits)

    @overload
    def __getitem__(self, index: int) -> LimitedMove: ...

    @overload
    def __getitem__(self, index: slice) -> list[LimitedMove]: ...

    def __getitem__(self, index: int | slice) -> LimitedMove | list[LimitedMove]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        promise = self.promises[index]
        span, limits = self.trajectory.spans[index], self.limits[index]
        return LimitedMove(self.trajectory, span, limits, promise.robot, promise.tool)


def _further_surveys(moves: _LimitedMoves) -> Iterator[Mapping[str, LimitSurvey]]:
    """Yield what each move uses of limits besides those of derivatives of joints, by their family."""
    which, different = numbered(moves.limits)
    further = [dict(families(limits, further=True)) for limits in different]
    for k, number in enumerate(which.tolist()):
        if not further[number]:
            yield _NO_SURVEYS
            continue
        move = moves[k]
        surveys = {name: each.survey(move) for name, each in further[number].items()}
        yield {name: survey for name, survey in surveys.items() if survey is not None}


def _counting_extremes(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    promises: Sequence[Promise],
    peaks: IntervalPeaks,
) -> IntervalPeaks:
    """Return the extremes that count against the limits: all of them where no move brakes."""
    if all(promise.braking is None for promise in promises):
        return peaks
    from trajcli.checks.braking import judged_peaks

    return judged_peaks(trajectory, limits_by_move, promises, peaks)


def _in_order(
    trajectory: Trajectory, findings: list[Finding], promises: Sequence[Promise] | None
) -> tuple[Finding, ...]:
    """Return the findings by move and time, each with its remedy."""
    if not findings:
        return ()
    number = {span.index: k for k, span in enumerate(trajectory.spans)}
    of_span: dict[int, list[Finding]] = {}
    for finding in findings:
        of_span.setdefault(number.get(finding.move or 0, 0), []).append(finding)
    return tuple(
        finding
        for k in sorted(of_span)
        for finding in _with_remedies(
            sorted(of_span[k], key=lambda finding: finding.time or 0.0),
            trajectory,
            trajectory.spans[k],
            promises[k] if promises else Promise(),
        )
    )


def _with_remedies(
    findings: list[Finding], trajectory: Trajectory, span: Span, promise: Promise
) -> Iterator[Finding]:
    """Yield the findings of one move with what would fix them: one duration, long enough for all of them."""
    factor = longest_factor(findings)
    alone = all(finding.factor is not None for finding in findings)
    smoother = next((f.hint for f in findings if f.kind == "acceleration_jump"), None)
    for finding in findings:
        remedied = finding
        if finding.kind == "jerk" and smoother is not None:  # what joins the acceleration limits the jerk
            remedied = replace(finding, hint=promise.remedies.get("acceleration_jump", smoother))
        yield _with_remedy(remedied, trajectory, span, promise, factor, alone=alone)


def longest_factor(findings: Sequence[Finding]) -> float | None:
    """Return how many times longer a move must last for all of its findings that this helps; None for none.

    The limits' own room for rounding is used, so that a factor is not shown above what is enough.
    """
    slacks = {"exact": LIMIT_RELATIVE, "bounded": TOOL_RELATIVE, "sampled": TOOL_RELATIVE}
    return max(
        (f.factor * (1 - slacks[f.method] * _PART) for f in findings if f.factor is not None), default=None
    )


def _check_via_points(trajectory: Trajectory, promises: Sequence[Promise]) -> Sequence[Finding]:
    if all(promise.via_points is None for promise in promises):
        return ()
    return check_waypoints(trajectory, [promise.via_points for promise in promises])


def _tools(moves: Sequence[LimitedMove], promises: Sequence[Promise]) -> Iterator[SampledTool]:
    """Yield the tool of each move along a path, or of each part of it that is."""
    for k, promise in enumerate(promises):
        if promise.tool is None and not promise.parts:
            continue
        parts = [move := moves[k]]
        if promise.parts:
            flown = (limited_part(move.trajectory, move.span, part) for part in promise.parts)
            parts = [part for part in flown if part.span.duration > 0]
        for part in parts:
            if part.robot is not None and part.motion is not None:
                from trajcli.checks.tool import SampledTool

                yield SampledTool(part.trajectory, part.span, part.robot, part.motion)


def _check_tools(tools: Sequence[SampledTool]) -> Iterator[Finding]:
    """Yield where the tool leaves its path, and where the arm changes its branch."""
    for tool in tools:
        from trajcli.checks.tool import check_tool

        yield from check_tool(tool)


def _sampled(tools: Sequence[SampledTool]) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Return what is judged on rows alone, with the moves; what is so in the same moves together."""
    moves: dict[str, list[int]] = {}
    for tool in tools:
        for what in tool.sampled:
            moves.setdefault(what, []).append(tool.span.index)
    together: dict[tuple[int, ...], list[str]] = {}
    for what, indices in moves.items():
        together.setdefault(tuple(dict.fromkeys(indices)), []).append(what)
    return tuple((" and ".join(words), indices) for indices, words in together.items())


def _unchecked_of_tool(moves: _LimitedMoves, peaks: IntervalPeaks) -> tuple[str, ...]:
    """Return the limits of the tool that are stated and cannot be judged in some move where the arm moves."""
    names: set[str] = set()
    which, different = numbered(moves.limits)
    stated = [limits.tcp != _NO_TOOL_LIMITS for limits in different]
    for k, number in enumerate(which.tolist()) if any(stated) else ():
        if stated[number] and peaks[k][1].magnitude.any():
            from trajcli.limits.tool import unjudged

            names |= unjudged(moves.limits[k], moves.promises[k].robot)
    return tuple(name for name in vars(_NO_TOOL_LIMITS) if name in names)


def _unchecked(
    trajectory: Trajectory, limits_by_move: Sequence[Limits], peaks: IntervalPeaks
) -> tuple[tuple[str, str], ...]:
    lasting = [
        (k, limits)
        for k, (limits, span) in enumerate(zip(limits_by_move, trajectory.spans, strict=True))
        if span.duration > 0
    ]
    loaded = [limits for k, limits in lasting if trajectory.spans[k].payload is not None]
    moving: Sequence[Limits] = limits_by_move
    if len(numbered(limits_by_move)[1]) > 1:  # a stop between two moves has the limits of the job
        moving = [limits for k, limits in lasting if peaks[k][1].magnitude.any()]
    of_quantities = dict.fromkeys(QUANTITIES, moving) | {"effort": loaded}
    unlimited = [
        np.any(
            [np.isinf(getattr(limits, name)).any(axis=1) for limits in numbered(some)[1]]
            or np.zeros((1, len(trajectory.joint_names))),
            axis=0,
        )
        for name, some in of_quantities.items()
    ]
    return tuple(
        (name, quantity)
        for joint, name in enumerate(trajectory.joint_names)
        for quantity, of_joints in zip(of_quantities, unlimited, strict=True)
        if of_joints[joint]
    )


def _with_remedy(
    finding: Finding,
    trajectory: Trajectory,
    span: Span,
    promise: Promise,
    factor: float | None,
    *,
    alone: bool,
) -> Finding:
    """Return the finding with what would fix it, where that is known."""
    hint = promise.remedies.get(finding.kind, finding.hint)
    if hint is None and finding.kind in KIND_OF:
        hint = _by_slowing(finding, trajectory, span, promise, factor, alone=alone)
    return finding if hint == finding.hint else replace(finding, hint=hint)


def _by_slowing(
    finding: Finding,
    trajectory: Trajectory,
    span: Span,
    promise: Promise,
    factor: float | None,
    *,
    alone: bool,
) -> str:
    """Return how much longer the move must last to keep its limits, or why that is no help."""
    if finding.factor is None or factor is None or promise.over_limit == "slow":
        return f"{_NO_HELP}: change the target, the start or the limit"
    if promise.ends is None or all(state.at_rest for state in promise.ends):
        longer = f"{at_least(factor)} times longer ({at_least(span.duration * factor)} s)"
        return f"it must last {longer}" + (f", or {_SLOW}" if promise.over_limit and alone else "")
    over = _over_at_ends(finding, trajectory, promise)
    if finding.joint is None:
        return f"{_NO_HELP}: the tool is too fast where the move starts or ends" if over else _SLOW
    if over:
        return f"{_NO_HELP}: the move starts or ends over its limit"
    return f"{_SLOW}: it finds the shortest duration between these moving states"


def _over_at_ends(finding: Finding, trajectory: Trajectory, promise: Promise) -> bool:
    """Return whether the limit is broken where the move declares to begin or to end."""
    joint = -1 if finding.joint is None else trajectory.joint_names.index(finding.joint)
    use = finding.kind, joint, finding.limit or 0.0
    return family(KIND_OF[finding.kind].family).over_at_ends(promise.robot, promise.ends or (), use)
