"""What a textbook would print about each move: polynomials, phases, peaks, in the job's units.

How a pose of a job is reached: joints, branch, why that branch, and whether the arm is singular there.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from trajcli.columns import joint_factors
from trajcli.job.report import PeakReport
from trajcli.output.polynomials import PolynomialInterval, polynomial_intervals
from trajcli.output.report import passing_in_units, report_of
from trajcli.output.tool import path_in_units
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.planning.resolve_poses import ResolvedPose, asked_names
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.inverse import free_directions, ranks
from trajcli.queries.pose import plain
from trajcli.units import Dimension, Quantity, Units, to_user, unit_name


def reached_in_units(reached: ResolvedPose, arm: ArmInUnits) -> dict[str, Any]:
    """Return {joints, branch, method, chosen, singular, rank, free_direction?} in the arm's units.

    `chosen` says whether the names of a configuration or nearness decided, near to which joints, between how
    many candidates, and how many answers there are within the limits. The arm is singular where the tcp can
    move in fewer directions, among those that the pose fixes, than it can nearby: `rank` has both numbers.
    `free_direction` is a unit vector of joint values: the arm can move along it while the tcp keeps the pose.
    """
    found, joints = reached.found, reached.joints
    asked = asked_names(reached.pose.configuration)
    here, nearby = ranks(arm.robot, joints[None], reached.goal)
    told = {
        "joints": plain(joints / arm.joint_factors),
        "branch": {key: name for key, name in asdict(found.names[reached.branch]).items() if name},
        "method": found.method.name,
        "chosen": {
            "by": "configuration" if asked else "nearest",
            "configuration": asked,
            "near": plain(reached.near / arm.joint_factors),
            "candidates": int(np.count_nonzero(reached.usable)),
            "within_limits": int(np.count_nonzero(found.within_limits)),
        },
        "singular": bool(here[0] < nearby),
        "rank": {"here": int(here[0]), "nearby": nearby},
    }
    if found.free[reached.branch].any():
        told["free_direction"] = plain(next(free_directions(arm, joints, reached.goal)))
    return told


def polynomial_intervals_of(move: PlannedMove, units: Units) -> list[list[PolynomialInterval]]:
    """Return the polynomials of each joint of a move, in order of time.

    Equal neighbours are joined, but not those of a spline: the slides have one between any two points.
    """
    join = not move.planned.one_piece_per_interval
    factors = joint_factors(move.robot.joint_types, units)
    curve = move.planned.curve
    return [
        polynomial_intervals(curve.breaks, curve.coefficients[:, :, joint] / factors[joint], join=join)
        for joint in range(curve.dimension)
    ]


def explanation(plan: Plan) -> dict[str, Any]:
    """Return what `trajcli explain --json` prints: report, polynomials and phases, in the job's units."""
    units = plan.loaded.units
    report = report_of(plan, reference=True)
    return {
        "version": 1,
        "job": report.job,
        "robot": report.robot,
        "verdict": report.verdict,
        "units": {"angle": units.angle, "length": units.length, "time": "s"},
        "joints": list(plan.trajectory.joint_names),
        "duration": report.duration,
        "moves": [
            {
                **_move(plan, index),
                "peaks": [peak_in_units(peak, plan) for peak in entry.peaks],
                "binding": entry.binding and entry.binding.model_dump(),
                "tool": entry.tool and entry.tool.model_dump(),
                "reference": entry.reference and entry.reference.model_dump(),
            }
            for index, entry in enumerate(report.moves)
        ],
        "events": [event.model_dump() for event in report.events],
    }


def _move(plan: Plan, index: int) -> dict[str, Any]:
    move, span = plan.moves[index], plan.trajectory.spans[index]
    names = move.robot.joint_names
    arrivals = move.planned.arrivals
    polynomials = {
        name: [
            {"start": s.start, "end": s.end, "local": s.local.tolist(), "absolute": s.absolute.tolist()}
            for s in rows
        ]
        for name, rows in zip(names, polynomial_intervals_of(move, plan.loaded.units), strict=True)
    }
    return {
        "index": index,
        "joints": list(names),
        "planner": span.planner,
        "start": span.start,
        "end": span.end,
        "duration": move.duration,
        "stretch": move.stretch,
        "continuity": span.continuity,
        "from_pose": _reached(plan, None) if index == 0 else None,
        "to_pose": _reached(plan, index),
        "breaks": move.planned.curve.breaks.tolist(),
        "polynomials": polynomials,
        "closed_form": closed_form(move, plan.loaded.units),
        "phases": [
            {**asdict(phase), "joint": None if phase.joint is None else names[phase.joint]}
            for phase in move.planned.phases
        ],
        "arrivals": None if arrivals is None else dict(zip(names, arrivals, strict=True)),
        **passing_in_units(move, span, plan.verdict, plan.loaded.units),
        "path": None if move.planned.tool is None else path_in_units(move, plan.loaded.units),
    }


def _reached(plan: Plan, index: int | None) -> dict[str, Any] | None:
    """Return how the pose was reached that a move goes to, or the job starts at; None where there is none."""
    reached = plan.reached[index]
    return (
        None
        if reached is None
        else reached_in_units(reached, ArmInUnits(plan.loaded.robot, plan.loaded.units))
    )


def closed_form(move: PlannedMove, units: Units) -> dict[str, str] | None:
    """Return the formula of each joint where the curve is the fit of one, else None."""
    if move.planned.formula is None:
        return None
    factors = joint_factors(move.robot.joint_types, units)
    start = move.start.position / factors
    change = (move.planned.end.position - move.start.position) / factors
    law = move.planned.formula.replace("{T}", f"{move.duration:.10g}")
    return {
        name: f"{q:.10g}" + (f" {'-' if dq < 0 else '+'} {abs(dq):.10g} ({law})" if dq else "")
        for name, q, dq in zip(move.robot.joint_names, start, change, strict=True)
    }


def peak_in_units(peak: PeakReport, plan: Plan) -> dict[str, Any]:
    """Return the extremes of one quantity with its unit, in the job's units."""
    joint = plan.trajectory.joint_names.index(peak.joint)
    dimension: Dimension = "length" if plan.trajectory.joint_types[joint] == "prismatic" else "angle"
    order = ("position", "velocity", "acceleration", "jerk").index(peak.quantity)
    quantity, units = Quantity(dimension, order), plan.loaded.units
    said = {key: to_user(getattr(peak, key), quantity, units) for key in ("low", "high")}
    limit = [None if bound is None else to_user(bound, quantity, units) for bound in peak.limit]
    return {**peak.model_dump(), **said, "limit": limit, "unit": unit_name(quantity, units)}
