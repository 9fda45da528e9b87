"""Limits of velocity by position for all t, from the roots of polynomials.

A joint that is x before the end of its range may move towards it with at most max(0, sqrt(2 d x) - o). That
limit does not change when the move takes longer, so that the share of it that is used is the smallest stretch
that keeps it. Where a joint moves towards an end to which it is nearer than o^2 / (2 d), no stretch does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.checks.tolerances import exceeds
from trajcli.curves.approach import ApproachUse, approach_uses
from trajcli.findings import Finding, at_time, excess_amounts, joint_amounts
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Span, State, Trajectory

HOPELESS = 1e4
"""A stretch that is larger is none: the limit there is next to nothing."""


def velocity_by_position_uses(trajectory: Trajectory, span: Span, limits: Limits) -> tuple[ApproachUse, ...]:
    """Return for each joint with such a limit where a move uses most of it, times on the curve.

    A move of no length uses nothing.
    """
    if not limits.has_velocity_by_position:
        return ()
    curve = trajectory.curve
    middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
    first, last = np.searchsorted(middles, [span.start, span.end])
    if span.duration == 0 or first == last:
        return ()
    with np.errstate(over="ignore", invalid="ignore"):
        breaks, coefficients = curve.breaks[first : last + 1], curve.coefficients[:, first:last]
        return tuple(approach_uses(breaks, coefficients, limits.approach))


def check_velocity_by_position(
    trajectory: Trajectory, uses: Sequence[Sequence[ApproachUse]]
) -> list[Finding]:
    """Return where a joint moves faster towards the end of its range than its distance from there allows.

    Args:
        trajectory: What to judge.
        uses: From `velocity_by_position_uses`, for each span.

    Raises:
        ValueError: When there are more or fewer uses than spans.
    """
    return [
        _finding(trajectory, span, use)
        for span, of_span in zip(trajectory.spans, uses, strict=True)
        for use in of_span
        if exceeds(abs(use.velocity), abs(use.limit))
    ]


def _finding(trajectory: Trajectory, span: Span, use: ApproachUse) -> Finding:
    when, joint = use.time - trajectory.curve.start, use.component
    distance = joint_amounts(trajectory, joint, 0, distance=abs(use.distance))
    where = "beyond" if use.distance < 0 else "before"
    rule = "where its limit is {limit}" if use.limit else "where it may not move towards it ({limit})"
    return Finding(
        move=span.index,
        joint=trajectory.joint_names[joint],
        kind="velocity_by_position",
        value=use.velocity,
        limit=use.limit,
        time=when,
        factor=use.used if use.used < HOPELESS else None,
        message=f"the velocity of {{joint}} reaches {{value}} {at_time(when)}, {{distance}} {where} the end "
        f"of its range, {rule}",
        amounts={**distance, **excess_amounts(trajectory, joint, 1, use.velocity, use.limit)},
    )


def ends_over_velocity_by_position(limits: Limits, ends: Sequence[State]) -> int | None:
    """Return the index of a joint that is over its limit in one of the states; None where none is."""
    if limits.has_velocity_by_position:
        for state in ends:
            low, high = limits.approach.bounds(state.position)
            over = np.flatnonzero(exceeds(state.velocity, high) | exceeds(-state.velocity, -low))
            if over.size:
                return int(over[0])
    return None
