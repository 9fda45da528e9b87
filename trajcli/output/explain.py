"""Explanation of a plan: its report in the units of the job, with polynomials, poses and paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.columns import joint_factors
from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import NO_ANGLE
from trajcli.job.explanation import (
    ArcSegmentReport,
    ChoiceReport,
    CornerReport,
    ExplainedMove,
    ExplainedOutside,
    ExplainedWaypoint,
    Explanation,
    LineSegmentReport,
    PathReport,
    PhaseReport,
    PoseReport,
    RotationSegmentReport,
    ScrewSegmentReport,
    SegmentReport,
    UnitsReport,
    WeaveReport,
)
from trajcli.job.report import MoveReport, WaypointReport
from trajcli.job.report_parts import in_units
from trajcli.kinematics.robot import Robot
from trajcli.output.polynomials import blends_of, knots_of, polynomial_intervals, polynomials_of
from trajcli.output.report import report_of
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.planning.planned_move import law_of_path, path_of_tool
from trajcli.units import Quantity, Units, factor, joint_units

if TYPE_CHECKING:
    from trajcli.geometry.paths.chain import Corner
    from trajcli.geometry.paths.pose import Screw
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.planning.resolve_poses import ResolvedPose


def explanation(
    plan: Plan,
    *,
    move: int | None = None,
    derivatives: bool = False,
    sensitivity: bool = False,
    reference: bool = False,
) -> Explanation:
    """Return what `trajcli explain` has to say, in the units of the job.

    Args:
        plan: The plan.
        move: Index of the one move that is explained, with what is said of the job as a whole; None for all.
        derivatives: Whether polynomials come with those of velocity and acceleration.
        sensitivity: Whether moves are planned with higher limits, to say what these would save.
        reference: Whether all moves along a path are compared with toppra, not only time-optimal ones.
    """
    units = plan.loaded.units
    wanted = range(len(plan.moves)) if move is None else [move]
    report = report_of(plan, reference=True, peers=reference)
    if sensitivity:
        from trajcli.output.report_parts import with_savings

        report = with_savings(report, plan, wanted)
    report = in_units(report, units)
    moves = tuple(_move(plan, index, report.moves[index], derivatives=derivatives) for index in wanted)
    said = {
        name: [part for part in getattr(report, name) if part.move is None or part.move in wanted]
        for name in ("findings", "events", "remarks", "steps")
    }
    return Explanation(
        **{**report.__dict__, **said, "moves": moves},
        units=UnitsReport(angle=units.angle, length=units.length),
        joints=list(plan.trajectory.joint_names),
    )


def _move(plan: Plan, index: int, report: MoveReport, *, derivatives: bool) -> ExplainedMove:
    move, units = plan.moves[index], plan.loaded.units
    names, planned = move.robot.joint_names, move.planned
    arrivals, tool = planned.arrivals, path_of_tool(move)
    own = {
        "joints": list(names),
        "from_pose": _pose(plan, None) if index == 0 else None,
        "to_pose": _pose(plan, index),
        "breaks": planned.curve.breaks.tolist(),
        "polynomials": dict(zip(names, polynomials_of(move, units, derivatives=derivatives), strict=True)),
        **_closed_form(move, units, derivatives=derivatives),
        "knots": knots_of(move, units),
        "blends": blends_of(move, units),
        "phases": [
            PhaseReport(
                name=p.name, start=p.start, end=p.end, joint=None if p.joint is None else names[p.joint]
            )
            for p in planned.phases
        ],
        "binding_phases": planned.binding_phases,
        "arrivals": None if arrivals is None else dict(zip(names, arrivals, strict=True)),
        "origin": planned.origin,
        "waypoints": _waypoints(move, report.waypoints, units),
        "outside": report.outside
        and tuple(
            ExplainedOutside(**{**one.__dict__, "time": one.time - report.start}) for one in report.outside
        ),
        "path": None if tool is None else _path(move, tool, units, derivatives=derivatives),
    }
    return ExplainedMove(**{**report.__dict__, **own})


def _waypoints(
    move: PlannedMove, reports: Sequence[WaypointReport] | None, units: Units
) -> tuple[ExplainedWaypoint, ...] | None:
    """Return the points that a move passes, times from its start."""
    points = move.planned.via_points
    if points is None or reports is None:
        return None
    joints = (points.points / joint_factors(move.robot.joint_types, units)).tolist()
    return tuple(
        ExplainedWaypoint(time=time, joints=values, missed=report.missed, units=report.units)
        for time, values, report in zip(points.times.tolist(), joints, reports, strict=True)
    )


def _closed_form(move: PlannedMove, units: Units, *, derivatives: bool) -> dict[str, Any]:
    """Return the formula of each joint, and those of its derivatives, where the curve is the fit of one."""
    if move.planned.formulas is None:
        return {"closed_form": None}
    law, *rates = (text.replace("{T}", f"{move.duration:.10g}") for text in move.planned.formulas)
    factors = joint_factors(move.robot.joint_types, units)
    start = move.start.position / factors
    change = (move.planned.end.position - move.start.position) / factors
    joints = list(zip(move.robot.joint_names, start.tolist(), change.tolist(), strict=True))
    forms = {
        name: f"{q:.10g}" + (f" {'-' if dq < 0 else '+'} {abs(dq):.10g} ({law})" if dq else "")
        for name, q, dq in joints
    }
    if not derivatives:
        return {"closed_form": forms}
    of_rates = {name: [f"{dq:.10g} {rate}" if dq else "0" for rate in rates] for name, _, dq in joints}
    return {"closed_form": forms, "closed_form_derivatives": of_rates}


def _pose(plan: Plan, index: int | None) -> PoseReport | None:
    """Return how the pose was reached that a move goes to, or the job starts at; None where there is none."""
    pose = plan.poses.get(index)
    robot = plan.loaded.robot if index is None else plan.moves[index].robot
    return None if pose is None else in_units(_resolved(pose, plan, robot), plan.loaded.units)


def _without_pins(robot: Robot, joints: Array, pins: Mapping[int, float]) -> tuple[Robot, Array]:
    """Return the arm of the joints that are not pinned, and their values (1, k)."""
    if not pins:
        return robot, joints[None]
    from trajcli.kinematics.inverse.pinned_joints import without_pinned

    return without_pinned(robot, pins), np.delete(joints, list(pins))[None]


def _resolved(pose: ResolvedPose, plan: Plan, robot: Robot) -> PoseReport:
    """Return how a pose of the tool of an arm was reached, in SI."""
    from trajcli.kinematics.inverse.target import ranks

    solutions, joints = pose.solutions, pose.joints
    configuration, units = pose.target.configuration, joint_units(robot.joint_types)
    asked = {} if configuration is None else configuration.asked
    pins = {} if pose.target.pinned is None else pose.target.pinned.by_index
    here, nearby = ranks(*_without_pins(robot, joints, pins), pose.ik_target)
    free = None
    if solutions.free[pose.branch].any():
        from trajcli.queries.arm import ArmInUnits
        from trajcli.queries.inverse import free_directions

        arm = ArmInUnits(robot, plan.loaded.units)
        free = _plain(next(free_directions(arm, joints, pose.ik_target, pins)))
    return PoseReport(
        joints=_plain(joints),
        units=units,
        branch={key: name for key, name in asdict(solutions.names[pose.branch]).items() if name},
        method=solutions.method.name,
        chosen=ChoiceReport(
            by="configuration" if asked else "nearest",
            configuration=asked,
            near=_plain(pose.near),
            units=units,
            candidates=int(np.count_nonzero(pose.usable)),
            within_limits=int(np.count_nonzero(solutions.within_limits)),
        ),
        singular=bool(here[0] < nearby),
        rank={"here": int(here[0]), "nearby": nearby},
        free_direction=free,
    )


def _path(move: PlannedMove, tool: ToolMotion, units: Units, *, derivatives: bool) -> PathReport:
    segments, corners = _drawing(tool)
    law = law_of_path(move, tool)
    unit = "rad" if tool.pure_rotation else "m"
    report = PathReport(
        length=tool.length, unit=unit, segments=segments, corners=corners, weave=_weave(tool), law=[]
    )
    path = in_units(report, units)
    scale = factor(Quantity("angle" if tool.pure_rotation else "length"), units)
    coefficients = law.coefficients[:, :, 0] / scale
    pieces = polynomial_intervals(law.breaks, coefficients, path.unit, derivatives=derivatives)
    return path.model_copy(update={"law": pieces})


def _drawing(tool: ToolMotion) -> tuple[list[SegmentReport], list[CornerReport]]:
    from trajcli.geometry.paths.chain import Chain
    from trajcli.geometry.paths.pose import PoseCurve, Screw

    if tool.path is None:
        return [], []
    poses = tool.path.poses
    if isinstance(poses, Screw):
        return [_screw(poses)], []
    curve = poses.position if isinstance(poses, PoseCurve) else None
    curve = getattr(curve, "seam", curve)  # of a weave
    if not isinstance(curve, Chain):
        return ([] if curve is None else [_segment(curve)]), []
    return [_segment(segment) for segment in curve.segments], [
        _corner(corner, "overlap" if tool.overlaps else corner.kind) for corner in curve.corners
    ]


def _weave(tool: ToolMotion) -> WeaveReport | None:
    if tool.path is None or tool.path.seam is None:
        return None
    weave: Any = getattr(tool.path.poses, "position", None)
    edges = np.diff([0.0, *weave.stops.tolist(), weave.length])
    return WeaveReport(
        shape=weave.shape,
        amplitude=weave.amplitude,
        lengths=_plain(edges / np.array(weave.cycles)),
        cycles=list(weave.cycles),
    )


def _corner(corner: Corner, kind: str) -> CornerReport:
    return CornerReport(
        kind=kind,
        place=corner.s,
        point=_plain(corner.point),
        turn=corner.turn,
        radius=corner.used,
        deviation=corner.deviation,
    )


def _screw(screw: Screw) -> ScrewSegmentReport:
    rotation, origin = screw.start[:3, :3], screw.start[:3, 3]
    moved, turned = rotation @ screw.twist[:3], rotation @ screw.twist[3:]
    angle = float(np.linalg.norm(turned))
    if angle <= NO_ANGLE:
        distance = float(np.linalg.norm(moved))
        return ScrewSegmentReport(axis=_plain(moved / distance), angle=0.0, advance=distance)
    axis = turned / angle
    point = _plain(origin + np.cross(axis, moved) / angle)
    return ScrewSegmentReport(axis=_plain(axis), point=point, angle=angle, advance=float(axis @ moved))


def _segment(curve: Any) -> SegmentReport:  # noqa: ANN401
    from trajcli.geometry.paths.arc import Arc
    from trajcli.geometry.paths.position import Pivot

    if isinstance(curve, Pivot):
        return RotationSegmentReport(place=_plain(curve.start), angle=curve.length)
    if isinstance(curve, Arc):
        return ArcSegmentReport(
            kind="helix" if curve.pitch else "arc",
            start=_plain(curve.start),
            end=_plain(curve.end),
            center=_plain(curve.center),
            axis=_plain(curve.axis),
            radius=curve.radius,
            angle=curve.angle,
            pitch=curve.pitch,
            length=curve.length,
        )
    ends = curve.evaluate(np.array([0.0, curve.length]))[0]
    return LineSegmentReport(start=_plain(ends[0]), end=_plain(ends[1]), length=curve.length)


def _plain(vector: Array) -> list[float]:
    return [float(value) + 0.0 for value in vector]
