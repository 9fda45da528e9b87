"""Parts of moves that fly by corners: each within its limits, and within its zone, for all t."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding, at_time
from trajcli.kinematics.zone import ZONE_RELATIVE, ZoneAround
from trajcli.limits.kinds import LimitedMove, families
from trajcli.trajectory import MoveInterval, Promise, Span, Trajectory


def check_flown(trajectory: Trajectory, promises: Sequence[Promise]) -> Iterator[Finding]:
    """Yield what is wrong with the parts of moves that fly by corners.

    Args:
        trajectory: What to judge.
        promises: What each span says of itself.
    """
    for span, promise in zip(trajectory.spans, promises, strict=True):
        for part in promise.parts:
            move = limited_part(trajectory, span, part)
            if move.span.duration > 0:
                yield from part_findings(move, part.around)


def limited_part(trajectory: Trajectory, span: Span, part: MoveInterval) -> LimitedMove:
    """Return a part of a move with its limits."""
    within = replace(span, start=span.start + part.start, end=min(span.start + part.end, span.end))
    return LimitedMove(trajectory, within, part.robot.limits, part.robot, part.tool)


def part_findings(move: LimitedMove, around: ZoneAround | None) -> Iterator[Finding]:
    """Yield the limits that a part of a move does not keep, and where it leaves its zone.

    Args:
        move: The part.
        around: Its zone; None on a path.
    """
    for _, family in families(move.limits):
        survey = family.survey(move)
        if survey is not None:
            for finding in survey.over(move.trajectory, move.trajectory.curve.start):
                yield replace(finding, move=move.span.index)
    if around is None:
        return
    share, when = around.largest_share(PiecewisePolynomial(*move.pieces))
    if share <= 1 + ZONE_RELATIVE:
        return
    how = f"{share:.9g} times as far from its corner as it may be"
    yield Finding(
        move=move.span.index,
        kind="zone",
        value=share,
        limit=1.0,
        time=when,
        method="bounded",
        hint="this is a bug: report it",
        message=f"the motion leaves its zone: it is {how} {at_time(when)}",
    )
