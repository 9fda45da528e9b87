"""Comparison of moves with peers in reports: ruckig from state to state, toppra along a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.job.reports.comparisons import (
    LimitUseReport,
    PathReferenceReport,
    PeerViolation,
    ReferenceReport,
)
from trajcli.kinematics.robot import QUANTITIES, JointType, Robot
from trajcli.planners.planner import PlannedMove
from trajcli.planning.lower_bound import NoBound, fastest_duration
from trajcli.planning.path_reference import (
    LimitBreach,
    LimitUse,
    PathReference,
    limit_use,
    path_reference,
    reference_along,
)
from trajcli.trajectory import Span

_RATES = ("", "/s", "/s^2", "/s^3")
_BELOW = 1e-9  # relative to a bound: what is below it by less is rounding


def joint_units(joint_types: tuple[JointType, ...], order: int = 0) -> list[str]:
    """Return the SI unit of each joint's position, or of its time derivative of an order."""
    return [("m" if kind == "prismatic" else "rad") + _RATES[order] for kind in joint_types]


def reference_of(move: PlannedMove) -> ReferenceReport:
    """Return how a move compares with the shortest duration under its limits."""
    reason = move.planned.no_lower_bound
    if reason is not None:
        return ReferenceReport(duration=None, ratio=None, joint=move.robot.joint_names[0], reason=reason)
    begins = move.planned.begins or move.start
    bound = fastest_duration(begins, move.planned.end, move.robot.limits)
    name = None if bound.joint is None else move.robot.joint_names[bound.joint]
    if isinstance(bound, NoBound):
        return ReferenceReport(duration=None, ratio=None, joint=name, reason=bound.reason)
    ratio = move.duration / bound.duration if bound.duration > 0 else None
    violations = violation_reports(bound.breaches, move.robot)
    return ReferenceReport(duration=bound.duration, ratio=ratio, joint=name, violations=violations)


def violation_reports(breaches: Sequence[LimitBreach], robot: Robot) -> list[PeerViolation]:
    """Return the reports of limits that a peer breaks."""
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
    try:
        other = _along_path(move)
    except PlanningError as error:
        own = use_report(limit_use(move.planned.curve, move.robot.limits), move.robot)
        return PathReferenceReport(duration=None, ratio=None, use=None, own_use=own, reason=str(error))
    if other is None:
        return None
    return PathReferenceReport(
        duration=other.duration,
        ratio=move.duration / other.duration if other.duration > 0 else None,
        use=use_report(other.use, move.robot),
        own_use=use_report(limit_use(move.planned.curve, move.robot.limits), move.robot),
        violations=violation_reports(other.breaches, move.robot),
        deviation=other.deviation,
        deviation_unit=common_unit(move.robot),
    )


def _along_path(move: PlannedMove) -> PathReference | None:
    if move.planned.phase_plane is not None:
        return path_reference(move)
    if (move.planned.via_points is None and move.planned.tool is None) or move.duration == 0:
        return None
    from trajcli.planning.geometric_path import path_of_curve

    curve = move.planned.curve
    path = path_of_curve(curve)
    if path is None:
        return None
    velocities = curve.evaluate(curve.start, 1), curve.evaluate(curve.end, 1, side="left")
    return reference_along(path, move.robot.limits, velocities)


def common_unit(robot: Robot) -> str:
    """Return the SI unit of all joints, or nothing where they differ."""
    units = set(joint_units(robot.joint_types))
    return units.pop() if len(units) == 1 else ""


def use_report(use: LimitUse | None, robot: Robot) -> LimitUseReport | None:
    """Return the report of the limit of which a motion uses most; None where there is none."""
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
