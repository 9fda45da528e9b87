"""Moves that fly by corners: each part within its limits, and within its zone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from trajcli.findings import Finding
from trajcli.limits.parts import limited_part, part_findings
from trajcli.trajectory import Promise, Trajectory


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
