"""Comparison of moves with peers: ruckig from state to state, toppra along a path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.job.report_parts import (
    LimitUseReport,
    PathReferenceReport,
    PeerViolation,
    ReferenceReport,
)
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.peers.lower_bound import LowerBound, NoBound, duration_through, fastest_duration
from trajcli.peers.path_reference import (
    LimitBreach,
    LimitUse,
    PathReference,
    limit_use,
    path_reference,
    reference_along,
)
from trajcli.planners.planner import PlannedMove
from trajcli.trajectory import Span
from trajcli.units import joint_units

_MISSED = 1e-12  # rad or m: points that are passed at more are not gone through
_BELOW = 1e-6  # relative: at a stop a last bit counts by its root


def reference_of(move: PlannedMove) -> ReferenceReport:
    """Return how a move compares with the shortest duration under its limits."""
    reason = move.planned.no_lower_bound
    if reason is not None:
        return ReferenceReport(duration=None, ratio=None, joint=move.robot.joint_names[0], reason=reason)
    begins = move.planned.begins or move.start
    bound = fastest_duration(begins, move.planned.end, move.robot.limits)
    found = bound_report(bound, move.duration, move.robot)
    via = move.planned.via_points
    if via is None or np.abs(via.missed).max() > _MISSED:
        return found
    through = duration_through(via.points, begins, move.planned.end, move.robot.limits)
    if through.duration <= (found.duration or 0.0):
        return found
    longer = bound_report(through, move.duration, move.robot)
    return longer.model_copy(update={"through_points": True, "violations": found.violations})


def bound_report(bound: LowerBound | NoBound, duration: float, robot: Robot) -> ReferenceReport:
    """Return how a motion of a robot that lasts `duration` seconds compares with a bound of its duration."""
    name = None if bound.joint is None else robot.joint_names[bound.joint]
    if isinstance(bound, NoBound):
        return ReferenceReport(duration=None, ratio=None, joint=name, reason=bound.reason)
    return ReferenceReport(
        duration=bound.duration,
        ratio=duration / bound.duration if bound.duration > 0 else None,
        joint=name,
        violations=_violations(bound.breaches, robot),
    )


def _violations(breaches: Sequence[LimitBreach], robot: Robot) -> list[PeerViolation]:
    return [
        PeerViolation(
            joint=robot.joint_names[breach.joint],
            quantity=QUANTITIES[breach.order],
            value=breach.value,
            limit=breach.limit,
            unit=joint_units(robot.joint_types[breach.joint : breach.joint + 1], breach.order)[0],
            time=breach.time,
        )
        for breach in breaches
    ]


def path_reference_of(move: PlannedMove) -> PathReferenceReport | None:
    """Return how a move along a path compares with toppra's motion along it; None for other moves.

    The path of a time-optimal move is the polynomial that it was planned on; that of another move is found
    from its motion.
    """
    own = limit_use(move.planned.curve, move.robot.limits)
    return path_report(lambda: _along_path(move), move.duration, move.robot, own)


def path_report(
    along: Callable[[], PathReference | None], duration: float, robot: Robot, own: LimitUse | None = None
) -> PathReferenceReport | None:
    """Return how a motion compares with toppra's along its path; None where there is no path.

    Args:
        along: Plans toppra's motion; it may raise a `PlanningError`, which is reported.
        duration: Of the motion, s.
        robot: With the limits in force.
        own: What the motion uses of them, where that is known.
    """
    try:
        other = along()
    except PlanningError as error:
        return PathReferenceReport(
            duration=None, ratio=None, use=None, own_use=_use(own, robot), reason=str(error)
        )
    if other is None:
        return None
    return PathReferenceReport(
        duration=other.duration,
        ratio=duration / other.duration if other.duration > 0 else None,
        use=_use(other.use, robot),
        own_use=_use(own, robot),
        violations=_violations(other.breaches, robot),
        deviation=other.deviation,
        deviation_unit=_common_unit(robot),
    )


def _along_path(move: PlannedMove) -> PathReference | None:
    if move.planned.phase_plane is not None:
        return path_reference(move)
    if move.planned.via_points is None and move.planned.tool is None:
        return None
    from trajcli.peers.geometric_path import path_of_curve

    curve = move.planned.curve
    path = path_of_curve(curve)
    if path is None:
        return None
    velocities = curve.evaluate(curve.start, 1), curve.evaluate(curve.end, 1, side="left")
    return reference_along(path, move.robot.limits, velocities)


def _common_unit(robot: Robot) -> str:
    """Return the SI unit of all joints, or nothing where they differ."""
    units = set(joint_units(robot.joint_types))
    return units.pop() if len(units) == 1 else ""


def _use(use: LimitUse | None, robot: Robot) -> LimitUseReport | None:
    if use is None:
        return None
    name = robot.joint_names[use.joint]
    return LimitUseReport(quantity=use.quantity, joint=name, used=use.used, time=use.time)


def contradictions_of(spans: Sequence[Span], references: Sequence[ReferenceReport | None]) -> list[Finding]:
    """Return a finding for each move that keeps its limits and is faster than any motion can be that does.

    Either the judgement is wrong then, or the bound.

    Args:
        spans: Of the moves of a trajectory that verifies.
        references: Of each of them; None where it is not compared.
    """
    found = []
    for span, bound in zip(spans, references, strict=True):
        fastest = None if bound is None else bound.duration
        if bound is None or fastest is None or not is_faster(span.duration, fastest):
            continue
        finding = contradiction(span.duration, fastest, bound.joint, time=span.end)
        found.append(replace(finding, move=span.index, kind="reference", unit="s"))
    return found


def is_faster(duration: float, bound: float) -> bool:
    """Return whether a duration is below a bound by more than rounding."""
    return 0 < duration < bound * (1 - _BELOW)


def contradiction(duration: float, bound: float, joint: str | None, time: float) -> Finding:
    """Return the finding that a motion is faster than the bound of its duration; it ends at a time."""
    return Finding(
        kind="time",
        joint=joint,
        value=duration,
        limit=bound,
        time=time,
        rule="reference",
        factor=bound / duration,
        message=f"it keeps its limits and lasts {duration:.9g} s, and ruckig finds no motion of {joint} "
        f"between its ends within these limits that is faster than {bound:.9g} s",
        hint="one of the two is wrong: report it as a bug of trajcli, with the job or the file",
    )
