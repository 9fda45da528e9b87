"""Pictures of plans and files: which panels they have, and what stands in each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from trajcli.columns import EFFORT
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.limits.kinds import SPEED_KINDS
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.plots.choice import (
    JOINT_QUANTITIES,
    PATH,
    PHASE,
    QUANTITY_NAMES,
    TOOL,
    choose_joints,
    choose_quantities,
)
from trajcli.plots.display_units import DisplayUnits, require_joints, units_of_files
from trajcli.plots.panel import NO_POINTS, Panel, PanelBlock, PathViews, Picture, Trace
from trajcli.plots.planned_motion import PlannedMotion, difference_block, names_of_plans, rows_of_plan
from trajcli.plots.sampling import thinned
from trajcli.queries.arm import frame_of_rows
from trajcli.streams.table import Table

if TYPE_CHECKING:
    from trajcli.judge.judgement import Judgement
    from trajcli.plots.recorded_motion import DrawnTable

MOST_PLANES = 12
"""Phase planes that a picture shows; more would make it too high to look at."""

_FEW_JOINTS = 2  # up to here a row is a quantity, beyond it a joint
_BESIDE = 3  # panels in a row where one quantity of many joints is drawn
_PLANE_POINTS = 800
_TIME = "t [s]"


def picture_of(
    plan: Plan | None,
    tables: Sequence[Table] = (),
    quantities: Sequence[str] | None = None,
    joints: Sequence[str] = (),
    judgements: Sequence[Judgement | None] = (),
    second: Plan | None = None,
) -> Picture:
    """Return the picture of a plan and of files, which are drawn over it or alone.

    Args:
        plan: May fail its verification: the findings are marked.
        tables: Files; without a plan at least one.
        quantities: Of `QUANTITY_NAMES`; None for those that suit.
        joints: Names of the joints to show; all without any.
        judgements: Of the files over a job, whose errors are marked; None of a file that was not judged.
        second: Another plan, drawn over the first as a file is, with the difference of their positions.

    Raises:
        InputError: When a quantity asked for does not apply, a joint is unknown, or a file does not fit.
    """
    if plan is None and not tables:
        raise InputError("there is nothing to plot", hint="give a plan or a file")
    motion = None if plan is None else PlannedMotion(plan)
    if motion is not None and second is not None:
        tables = [rows_of_plan(second, motion.offset), *tables]
        judgements = [None, *judgements] if judgements else ()
    plans = [each for each in (plan, second) if each is not None]
    of_plans = int(second is not None)
    records = _records(motion, tables, judgements, of_plans) if tables else []
    display = records[0].display if motion is None else motion.display
    chosen = choose_joints(joints, display.joint_names)
    drawn = choose_quantities(quantities, _sensible(motion, records), _impossible(motion, records))
    for record in records:
        if not record.shows() & set(drawn):
            hint = f"it has columns for {', '.join(sorted(record.shows())) or 'none'}"
            raise InputError(f"{record.table.file} has no columns for {', '.join(drawn)}", hint=hint)
    maker = _Maker(motion, records, display)
    blocks = maker.joint_blocks([name for name in drawn if name in JOINT_QUANTITIES], chosen)
    if motion is not None and second is not None:
        blocks.append(difference_block(motion, second, chosen))
    if TOOL in drawn:
        blocks.append(maker.tool_block())
    if PHASE in drawn and motion is not None:
        blocks.append(_phase_block(motion))
    return Picture(
        _title(plans, records[of_plans:]),
        (*names_of_plans(plans), *_names([record.table.file for record in records[of_plans:]])),
        tuple(blocks),
        maker.views() if PATH in drawn else None,
        None if motion is None else motion.borders,
    )


def _records(
    motion: PlannedMotion | None,
    tables: Sequence[Table],
    judgements: Sequence[Judgement | None],
    of_plans: int,
) -> list[DrawnTable]:
    """Return the files in the units of the job, or in their own; so many of the first are plans, in world."""
    from trajcli.plots.recorded_motion import DrawnTable, columns_of_table

    columns = [columns_of_table(table) for table in tables]
    if motion is not None:
        for table, of_table in zip(tables, columns, strict=True):
            require_joints(table.file, of_table, motion.display)
        robot, display = motion.plan.loaded.robot, motion.display
        judged = judgements or [None] * len(tables)
        frames = [None] * of_plans + [frame_of_rows(motion.plan.loaded)] * (len(tables) - of_plans)
        return [
            DrawnTable(t, c, display, robot, j, motion.plan.trajectory, frame)
            for t, c, j, frame in zip(tables, columns, judged, frames, strict=True)
        ]
    named = [(t.file, column) for t, c in zip(tables, columns, strict=True) for column in c]
    display = units_of_files(named)
    return [DrawnTable(t, c, display) for t, c in zip(tables, columns, strict=True)]


def _sensible(motion: PlannedMotion | None, records: Sequence[DrawnTable]) -> list[str]:
    """Return what is drawn unless other quantities are asked for."""
    if motion is None:
        shown = frozenset[str]().union(*(record.shows() for record in records))
        return [name for name in QUANTITY_NAMES if name in shown]
    names = ["q", "qd", "qdd"]
    limited = any(np.isfinite(move.robot.limits.jerk).any() for move in motion.moves)
    if limited or all(move.continuity > 1 for move in motion.moves):
        names.append("qddd")  # elsewhere the acceleration steps, and says all
    if motion.has_effort_limits or motion.carries or any(EFFORT in record.shows() for record in records):
        names.append(EFFORT)
    along_path = motion.plan.flyby is not None or any(move.planned.tool is not None for move in motion.moves)
    if along_path or any(kind.stated(move.robot.limits) for move in motion.moves for kind in SPEED_KINDS):
        names.append(TOOL)
    return [*names, *([PATH] if along_path else []), PHASE]


def _impossible(motion: PlannedMotion | None, records: Sequence[DrawnTable]) -> dict[str, str]:
    """Return why a quantity cannot be drawn, by its name."""
    if motion is not None:
        why, robot = {}, motion.plan.loaded.robot
        if not motion.has_tool:
            lacking = f"the robot '{robot.name}' has no geometry (theta, d, a, alpha)"
            why = dict.fromkeys((EFFORT, TOOL, PATH), lacking)
        elif robot.without_inertia:
            joints = ", ".join(robot.without_inertia)
            why = {EFFORT: f"the robot '{robot.name}' has no mass and inertia of the links behind {joints}"}
        if all(move.planned.phase_plane is None for move in motion.moves):
            why[PHASE] = "no move of the job has a time-optimal law"
        return why
    shown = frozenset[str]().union(*(record.shows() for record in records))
    needs = {name: f"no file has columns {name}1, {name}2, ..." for name in JOINT_QUANTITIES}
    needs |= {TOOL: "no file has columns vx vy vz wx wy wz", PATH: "no file has columns x y z"}
    needs[PHASE] = "a file does not say what limits a law: give the job"
    return {name: text for name, text in needs.items() if name not in shown}


def _title(plans: Sequence[Plan], records: Sequence[DrawnTable]) -> str:
    if not plans:
        more = len(records) - 1
        return records[0].table.file + (f" and {more} more file{'s' * (more > 1)}" if more else "")
    title = "; ".join(map(_verdict, plans, names_of_plans(plans)))
    for name, record in zip(_names([record.table.file for record in records]), records, strict=True):
        if record.judgement is not None and not record.judgement.passed:
            errors = len(record.judgement.errors)
            title += f"; {name}: EXCEEDED, {errors} finding{'s' * (errors != 1)}"
    return title


def _verdict(plan: Plan, name: str) -> str:
    verdict = "verified"
    if not plan.verdict.passed:
        from trajcli.planning.causes import causes_of

        count = len(causes_of(plan))
        verdict = f"NOT VERIFIED, {count} finding{'s' * (count != 1)}"
    return f"{name}: {verdict}, {plan.trajectory.duration:.6g} s"


def _names(files: Sequence[str]) -> list[str]:
    """Return how a legend calls files: without their folders where that tells them apart."""
    short = [Path(file).name for file in files]
    return short if len(set(short)) == len(set(files)) else list(files)


class _Maker:
    """Panels of a plan and of files, whose traces are numbered in this order."""

    def __init__(
        self, motion: PlannedMotion | None, records: Sequence[DrawnTable], display: DisplayUnits
    ) -> None:
        self._motion = motion
        self._records = list(enumerate(records, start=0 if motion is None else 1))
        self._display = display

    def joint_blocks(self, kinds: Sequence[str], joints: Sequence[int]) -> list[PanelBlock]:
        """Return one block: a row for each joint, or of few joints a row for each quantity."""
        if not kinds:
            return []
        if len(joints) <= _FEW_JOINTS:
            panels = [
                self._joint_panel(kind, joint, QUANTITY_NAMES[kind]) for kind in kinds for joint in joints
            ]
            return [PanelBlock(tuple(panels), len(joints))]
        panels = [self._joint_panel(kind, joint, "") for joint in joints for kind in kinds]
        if len(kinds) == 1:
            return [PanelBlock(tuple(panels), _BESIDE, (QUANTITY_NAMES[kinds[0]],) * _BESIDE)]
        return [PanelBlock(tuple(panels), len(kinds), tuple(QUANTITY_NAMES[kind] for kind in kinds))]

    def _joint_panel(self, kind: str, joint: int, called: str) -> Panel:
        name, motion = self._display.joint_names[joint], self._motion
        title = f"{name}: {called}" if called else name
        traces = [] if motion is None else [Trace(0, *motion.joint_trace(joint, kind))]
        for source, record in self._records:
            values = record.joint(kind, joint)
            if values is not None:
                traces.append(Trace(source, *thinned(record.times, values)))
        label = self._display.joint_label(kind, joint)
        if motion is None:
            return Panel(title, _TIME, label, tuple(traces))
        limits, marked = motion.joint_limits(joint, kind), kind == "q"
        return Panel(
            title,
            _TIME,
            label,
            tuple(traces),
            limits,
            waypoints=motion.waypoints(joint) if marked else NO_POINTS,
            virtual_points=motion.virtual_points(joint) if marked else NO_POINTS,
            findings=self._joint_findings(joint, kind),
            unlimited=bool(np.isnan([line[:, 1] for line in limits]).all()),
        )

    def _joint_findings(self, joint: int, kind: str) -> Array:
        """Return what checks found in the plan and in the files, shape (k, 2)."""
        own = [] if self._motion is None else [self._motion.joint_findings(joint, kind)]
        files = (record.joint_findings(kind, joint) for _, record in self._records)
        return np.concatenate([*own, *files])

    def tool_block(self) -> PanelBlock:
        """Return the speed and the angular speed of the tool."""
        display, motion = self._display, self._motion
        traces: tuple[list[Trace], list[Trace]] = ([], [])
        if motion is not None:
            tool = motion.tool()
            scales = display.factor("length"), display.factor("angle")
            for k, of_kind in enumerate(traces):
                of_kind.append(Trace(0, *thinned(tool.times, tool.speeds[:, k] / scales[k])))
        for source, record in self._records:
            speeds = record.tool_speeds()
            for of_kind, values in zip(traces, speeds or (), strict=False):
                of_kind.append(Trace(source, *thinned(record.times, values)))
        labels = display.label("speed", "length", 1), display.label("angular speed", "angle", 1)
        titles = "speed of the tool", "angular speed of the tool"
        panels = []
        for k in range(2):
            limit = None if motion is None else motion.tool_limit(bool(k))
            panels.append(
                Panel(
                    titles[k],
                    _TIME,
                    labels[k],
                    tuple(traces[k]),
                    () if limit is None else (limit,),
                    findings=np.concatenate(
                        [
                            NO_POINTS if motion is None else motion.tool_findings(bool(k)),
                            *(record.tool_findings(bool(k)) for _, record in self._records),
                        ]
                    ),
                    unlimited=limit is not None and bool(np.isnan(limit[:, 1]).all()),
                )
            )
        return PanelBlock(tuple(panels), 2)

    def views(self) -> PathViews:
        scale, motion = self._display.factor("length"), self._motion
        traces: list[tuple[int, Array]] = []
        if motion is not None:
            traces.append((0, motion.tool().positions / scale))
        for source, record in self._records:
            positions = record.tool_positions()
            if positions is not None:
                traces.append((source, positions))
        unit, lines = self._display.units.length, tuple(traces)
        if motion is None:
            return PathViews(unit, lines, np.empty((0, 3)))
        return PathViews(
            unit, lines, motion.tool_waypoints(), motion.zones(), motion.programmed(), motion.named()
        )


def _phase_block(motion: PlannedMotion) -> PanelBlock:
    """Return the phase planes of the moves that have one, the first of many."""
    moves = [move for move in motion.moves if move.planned.phase_plane is not None]
    panels = tuple(_phase_panel(move, motion.display) for move in moves[:MOST_PLANES])
    return PanelBlock(panels, min(len(panels), _BESIDE), over_time=False, flat=False)


def _phase_panel(move: PlannedMove, display: DisplayUnits) -> Panel:
    plane = move.planned.phase_plane
    if plane is None:
        raise ValueError(f"move {move.index} has no phase plane")
    scale, law = display.factor(plane.dimension), plane.law
    times = np.sort(np.concatenate([np.linspace(law.start, law.end, _PLANE_POINTS), law.breaks]))
    states = law.evaluate_orders(times, (0, 1))[:, :, 0] / scale
    start, end = plane.breaks[[0, -1]]
    s = np.concatenate([np.linspace(start, end, _PLANE_POINTS), plane.breaks, plane.breaks])
    side_of = np.append(np.zeros(_PLANE_POINTS + plane.breaks.size), np.ones(plane.breaks.size))
    top = np.where(side_of > 0, plane.largest_speed(s, "right"), plane.largest_speed(s, "left"))
    s, top = np.append(s, plane.stops), np.append(top, np.zeros(plane.stops.size))
    side_of = np.append(side_of, np.full(plane.stops.size, 0.5))
    ordered = np.lexsort((side_of, s))
    limit = np.stack([s, np.where(np.isfinite(top), top, np.nan)], axis=1)[ordered] / scale
    title = f"move {move.index} {move.planner.tag}: phase plane"
    labels = display.label("s", plane.dimension), display.label("sd", plane.dimension, 1)
    return Panel(title, *labels, (Trace(0, states[:, 0], states[:, 1]),), (limit,))
