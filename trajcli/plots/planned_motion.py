"""Motion of a plan, and of a second one: traces of joints, efforts and tool, limits, points, findings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trajcli.columns import EFFORT, JOINT_ORDERS
from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import KINDS, SPEED_KINDS, limited_part, narrowings
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.plots.display_units import DisplayUnits
from trajcli.plots.panel import NO_POINTS, MoveBorders, Panel, PanelBlock, Trace
from trajcli.plots.sampling import STEPS, component_points, local_times, thinned, without_repeats
from trajcli.streams.table import Table
from trajcli.trajectory import ViaPoints

if TYPE_CHECKING:
    from trajcli.limits.tool_bound import SpeedRun

_JUMPS = {"position_jump": "q", "velocity_jump": "qd", "acceleration_jump": "qdd"}
_SHOWN_IN = {kind.name: kind.picture for kind in KINDS} | _JUMPS
"""The quantity of a joint, or of the tool, that a kind of finding is about."""
_TOOL = ("x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz")
_BESIDE = 3  # panels of differences in a row


@frozen
class ToolSamples:
    """The tool along a plan.

    Attributes:
        times: Of the rows, s as written, shape (N,), both sides of each break.
        positions: In world, shape (N, 3), m.
        speeds: Speed and angular speed, shape (N, 2), m/s and rad/s.
    """

    times: Array
    positions: Array
    speeds: Array


@frozen
class EffortSamples:
    """Efforts along a plan.

    Attributes:
        times: On the curve of the trajectory, shape (N,), s; a step stands there as two rows of one time.
        values: Shape (N, n), N m or N.
    """

    times: Array
    values: Array


class PlannedMotion:
    """A plan as a picture shows it; times are those of its rows, s.

    Attributes:
        plan: The plan.
        display: Joints and units of the job.
        offset: When the trajectory starts.
    """

    def __init__(self, plan: Plan) -> None:
        robot = plan.loaded.robot
        self.plan = plan
        self.display = DisplayUnits(robot.joint_names, robot.joint_types, plan.loaded.units)
        self.offset = plan.loaded.job.output.start_time
        self._tool: ToolSamples | None = None
        self._efforts: EffortSamples | None = None

    @property
    def borders(self) -> MoveBorders:
        """The borders of its moves; what takes no time, such as attach and detach, is none."""
        every = self.plan.trajectory.spans
        spans = [span for span in every if not span.handles]
        times = np.array([spans[0].start, *(span.end for span in spans)]) + self.offset
        marks = tuple((span.start + self.offset, span.index, span.title) for span in every if span.handles)
        return MoveBorders(times, tuple(s.index for s in spans), tuple(s.title for s in spans), marks)

    def _edges(self) -> Array:
        """Return the borders of all entries of the job (m + 1,), s."""
        spans = self.plan.trajectory.spans
        return np.array([spans[0].start, *(span.end for span in spans)]) + self.offset

    @property
    def has_tool(self) -> bool:
        """Whether the arm has the geometry that says where its tool is."""
        return self.plan.loaded.robot.convention is not None

    @property
    def moves(self) -> tuple[PlannedMove, ...]:
        """Its moves."""
        return self.plan.moves

    @property
    def has_effort_limits(self) -> bool:
        """Whether an effort is limited in some move."""
        return any(move.robot.limits.has_effort for move in self.moves)

    @property
    def carries(self) -> bool:
        """Whether the tool carries a load in some move."""
        loads = (move.robot.payload for move in self.moves)
        return any(load is not None and load.mass > 0 for load in loads)

    def joint_trace(self, joint: int, quantity: str) -> tuple[Array, Array]:
        """Return times (N,) and values (N,) of a quantity of a joint, steps and extremes included."""
        if quantity == EFFORT:
            if self._efforts is None:
                self._efforts = effort_samples(self.plan)
            efforts = self._efforts
            points = without_repeats(efforts.times + self.offset, efforts.values[:, joint])
            return thinned(*points)
        times, values = component_points(self.plan.trajectory.curve, JOINT_ORDERS[quantity], joint)
        return thinned(times + self.offset, values / self.display.joint_factor(joint))

    def joint_limits(self, joint: int, quantity: str) -> tuple[Array, Array]:
        """Return the lines (m, 2) of the lower and the upper limit in force; NaN where there is none."""
        if quantity == EFFORT:
            efforts = np.array([move.robot.limits.effort[joint] for move in self.moves])
            return self._steps(efforts[:, 0]), self._steps(efforts[:, 1])
        order = JOINT_ORDERS[quantity]
        if any(narrowings(move.robot.limits, joint, order) for move in self.moves):
            return self._narrowed_limits(joint, order)
        bounds = np.array([move.robot.limits.of_order(order)[joint] for move in self.moves])
        low, high = (self._steps(side / self.display.joint_factor(joint)) for side in bounds.T)
        return low, high

    def _narrowed_limits(self, joint: int, order: int) -> tuple[Array, Array]:
        """Return the lines (m, 2) of a joint's limits, narrowed by where it is on the trajectory."""
        curve, scale = self.plan.trajectory.curve, self.display.joint_factor(joint)
        piece, local = local_times(curve)
        times = np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1])
        positions = curve.evaluate(times)
        spans = np.array([span.end for span in self.plan.trajectory.spans[:-1]]) + curve.start
        owner = np.searchsorted(spans, 0.5 * (curve.breaks[piece] + curve.breaks[piece + 1]))
        low, high = np.empty(times.size), np.empty(times.size)
        for k, move in enumerate(self.moves):
            rows, limits = owner == k, move.robot.limits
            low[rows], high[rows] = limits.of_order(order)[joint]
            for each in narrowings(limits, joint, order):
                below, above = each(positions[rows])
                low[rows], high[rows] = np.maximum(below, low[rows]), np.minimum(above, high[rows])
        lines = [
            np.stack(thinned(times + self.offset, np.where(np.isfinite(side), side, np.nan) / scale), axis=1)
            for side in (low, high)
        ]
        return lines[0], lines[1]

    def tool_limit(self, angular: bool) -> Array:
        """Return the line (m, 2) of the limit of the tool's speed."""
        scale = self.display.factor("angle" if angular else "length")
        limits = [getattr(move.robot.limits.tcp, SPEED_KINDS[angular].key) for move in self.moves]
        line = self._steps(np.array(limits) / scale)
        for index in range(len(self.moves) - 1, -1, -1):
            runs = self._speed_runs(index)
            rows = [(time + self.offset, run.limits[angular] / scale) for run in runs for time in run.times]
            if rows:
                own = np.where(np.isinf(rows), np.nan, rows)
                line = np.concatenate([line[: 2 * index], own, line[2 * index + 2 :]])
        return line

    def _speed_runs(self, index: int) -> Sequence[SpeedRun]:
        """Return the intervals of a move in which limits of the tool's speed step along its path."""
        move, span = self.moves[index], self.plan.trajectory.spans[index]
        motions = [(span, move.planned.tool)] + [
            (limited_part(self.plan.trajectory, span, part).span, part.tool) for part in move.planned.parts
        ]
        runs: list[SpeedRun] = []
        for within, motion in motions:
            if motion is not None and motion.path is not None and motion.path.speeds is not None:
                from trajcli.checks.tool import SampledTool

                found = SampledTool(self.plan.trajectory, within, move.robot, motion).speed_runs
                runs += [
                    replace(run, times=(run.times[0] + within.start, run.times[1] + within.start))
                    for run in found
                ]
        return runs

    def waypoints(self, joint: int) -> Array:
        """Return when a joint passes the points that it is to pass, and where they are, shape (k, 2)."""
        return self._marks([_passed(move) for move in self.moves], joint)

    def virtual_points(self, joint: int) -> Array:
        """Return the same of points that a planner added by itself."""
        return self._marks([move.planned.virtual_points for move in self.moves], joint)

    def joint_findings(self, joint: int, quantity: str) -> Array:
        """Return when checks fail, and the value where it is one of this joint and quantity, shape (k, 2)."""
        name = self.display.joint_names[joint]
        scale, order = (
            (1.0, 0) if quantity == EFFORT else (self.display.joint_factor(joint), JOINT_ORDERS[quantity])
        )
        rows = []
        for finding, time, reached in self._findings():
            own = finding.joint == name and _SHOWN_IN.get(finding.kind) == quantity
            value = reached / scale if own and not finding.kind.endswith("_jump") else np.nan
            if own and quantity != EFFORT and np.isnan(value):
                value = float(self.plan.trajectory.curve.evaluate(time, order)[joint]) / scale
            rows.append((time + self.offset, value))
        return np.array(rows or NO_POINTS)

    def tool_findings(self, angular: bool) -> Array:
        """Return the same for the speed of the tool."""
        scale = self.display.factor("angle" if angular else "length")
        rows = [
            (time + self.offset, value / scale if finding.kind == SPEED_KINDS[angular].name else np.nan)
            for finding, time, value in self._findings()
        ]
        return np.array(rows or NO_POINTS)

    def _findings(self) -> Iterator[tuple[Finding, float, float]]:
        """Yield the findings of the verdict with their times, s, and their values, SI."""
        for finding in self.plan.verdict.findings:
            if finding.time is not None and finding.value is not None:
                yield finding, finding.time, finding.value

    def tool(self) -> ToolSamples:
        """Return where the tool is and how fast, at both sides of breaks and where a check saw a peak."""
        if self._tool is None:
            self._tool = self._sampled_tool()
        return self._tool

    def tool_waypoints(self) -> Array:
        """Return where the tool is (k, 3), in the unit of lengths, at waypoints and ends of moves."""
        from trajcli.kinematics.forward import forward

        curve, first = self.plan.trajectory.curve, self.moves[0].robot
        points = [(move.robot, passed.points) for move in self.moves if (passed := _passed(move))]
        points = [(first, curve.evaluate([0.0])), *points]
        positions = [forward(robot, joints)[:, :3, 3] for robot, joints in points]
        return np.asarray(np.concatenate(positions) / self.display.factor("length"))

    def zones(self) -> Array:
        """Return corners of zones and the radii that are used (k, 4), in the unit of lengths."""
        zones = () if self.plan.flyby is None else self.plan.flyby.zones
        balls = [ball for zone in zones if (ball := zone.ball(self.moves[zone.move].robot)) is not None]
        return np.array(balls).reshape(-1, 4) / self.display.factor("length")

    def programmed(self) -> tuple[Array, ...]:
        """Return the programmed path of the tool within each zone, (m, 3), in the unit of lengths."""
        flyby, scale = self.plan.flyby, self.display.factor("length")
        zones = flyby.zones if flyby else ()
        return tuple(zone.tool_path(self.moves[zone.move].robot) / scale for zone in zones)

    def named(self) -> tuple[tuple[str, Array], ...]:
        """Return the names of points at which moves start and end, and where the tool is there (3,)."""
        from trajcli.kinematics.forward import forward

        curve, scale = self.plan.trajectory.curve, self.display.factor("length")
        named: dict[tuple[str, ...], tuple[str, Array]] = {}
        for move, span in zip(self.moves, self.plan.trajectory.spans, strict=True):
            for name, time in ((span.origin, span.start), (span.goal, span.end)):
                if name:
                    q = curve.evaluate(min(time, curve.end), side="left")
                    at = forward(move.robot, q)[:3, 3] / scale
                    named.setdefault((name, *(f"{value:.4g}" for value in at)), (name, at))
        return tuple(named.values())

    def _sampled_tool(self) -> ToolSamples:
        from trajcli.kinematics.forward import forward
        from trajcli.kinematics.jacobian import tcp_twist

        trajectory, robot = self.plan.trajectory, self.plan.loaded.robot
        curve = trajectory.curve
        piece, local = local_times(curve)
        peaks = self._tool_peaks()
        owner = np.clip(np.searchsorted(curve.breaks, peaks, "right") - 1, 0, curve.pieces - 1)
        piece, local = np.append(piece, owner), np.append(local, peaks - curve.breaks[owner])
        ordered = np.lexsort((local, piece))
        piece, local = piece[ordered], local[ordered]
        q, qd = (
            horner(derivative_coefficients(curve.coefficients, order)[:, piece], local[:, None])
            for order in (0, 1)
        )
        middles = 0.5 * (curve.breaks[piece] + curve.breaks[piece + 1])
        twist = trajectory.of_tools(robot, middles, lambda arm, k: tcp_twist(arm, q[k], qd[k]))
        positions = trajectory.of_tools(robot, middles, lambda arm, k: forward(arm, q[k])[:, :3, 3])
        speeds = [np.linalg.norm(twist[:, part], axis=1) for part in (slice(3), slice(3, 6))]
        times = np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1])
        return ToolSamples(times + self.offset, positions, np.stack(speeds, axis=1))

    def _tool_peaks(self) -> Array:
        """Return when the checks saw the tool fastest, move by move, shape (k,)."""
        spans, seen = self.plan.trajectory.spans, self.plan.verdict.tool_peaks
        return np.array(
            [
                span.start + peaks[kind.key].time
                for span, peaks in zip(spans, seen, strict=False)
                if peaks is not None
                for kind in SPEED_KINDS
            ]
        )

    def _steps(self, values: Array) -> Array:
        """Return the line (m, 2) that has one value (moves,) from border to border; NaN for infinite ones."""
        borders = self._edges()
        x = np.stack([borders[:-1], borders[1:]], axis=1).reshape(-1)
        finite = np.where(np.isfinite(values), values, np.nan)
        return np.stack([x, np.repeat(finite, 2)], axis=1)

    def _marks(self, points: Sequence[ViaPoints | None], joint: int) -> Array:
        scale, starts = self.display.joint_factor(joint), self._edges()
        rows = [
            np.stack([start + each.times, each.points[:, joint] / scale], axis=1)
            for start, each in zip(starts, points, strict=False)
            if each is not None
        ]
        return np.concatenate([NO_POINTS, *rows])


def _passed(move: PlannedMove) -> ViaPoints | None:
    """Return the points that a move is to pass; of one without points between only its end."""
    points, end = move.planned.via_points, move.planned.end.position
    if points is not None:
        return points
    return ViaPoints(np.array([move.duration]), end[None], np.zeros((1, end.size)))


def names_of_plans(plans: Sequence[Plan]) -> list[str]:
    """Return how a picture calls plans: by their jobs, with the folders where these have one name."""
    names = [plan.loaded.name for plan in plans]
    return names if len(set(names)) == len(names) else [plan.loaded.document.file for plan in plans]


def rows_of_plan(plan: Plan, start: float) -> Table:
    """Return a plan as a table of rows, SI, with both sides of each of its breaks.

    Args:
        plan: The second one.
        start: When it starts in the picture, s.
    """
    curve = plan.trajectory.curve
    piece, local = local_times(curve)
    times = np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1])
    after = np.append(False, np.diff(times) == 0)
    states = [_sided(curve, times, order, after) for order in JOINT_ORDERS.values()]
    names = ["t", *(f"{kind}{k + 1}" for kind in JOINT_ORDERS for k in range(curve.dimension))]
    columns = [times[:, None] + (start - curve.start), *states]
    if plan.loaded.robot.convention is not None:
        names += _TOOL
        columns.append(_tool(plan, times, after, states[0], states[1]))
    everything = np.concatenate(columns, axis=1)
    decimals = np.full(everything.shape[1], 17, dtype=np.int64)
    return Table(tuple(names), everything, decimals, plan.loaded.name)


def _sided(curve: PiecewisePolynomial, times: Array, order: int, after: Array) -> Array:
    """Return a derivative (N, n): of two rows of one time the first is before it."""
    sides = [curve.evaluate(times, order, side=side) for side in ("left", "right")]
    return np.where(after[:, None], sides[1], sides[0])


def _tool(plan: Plan, times: Array, after: Array, q: Array, qd: Array) -> Array:
    """Return position and twist of the tool that is on the flange then, (N, 9)."""
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.jacobian import tcp_twist

    trajectory, robot = plan.trajectory, plan.loaded.robot
    beside = times + np.where(after, 0.0, -1e-9)
    positions = trajectory.of_tools(robot, beside, lambda arm, k: forward(arm, q[k])[:, :3, 3])
    twists = trajectory.of_tools(robot, beside, lambda arm, k: tcp_twist(arm, q[k], qd[k]))
    return np.concatenate([positions, twists], axis=1)


def difference_block(motion: PlannedMotion, second: Plan, joints: Sequence[int]) -> PanelBlock:
    """Return the panels of the difference of positions, second minus first, from their starts on.

    Whichever ends first stands where it ends.

    Raises:
        InputError: When they have not as many joints.
    """
    curves = motion.plan.trajectory.curve, second.trajectory.curve
    counts = [curve.dimension for curve in curves]
    if counts[0] != counts[1]:
        names = names_of_plans((motion.plan, second))
        text = f"the jobs have not as many joints: {names[0]} has {counts[0]}, {names[1]} has {counts[1]}"
        raise InputError(text, hint="plot each alone")
    times = []
    for curve in curves:
        piece, local = local_times(curve)
        times.append(np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1]) - curve.start)
    since = np.unique(np.concatenate(times))
    there, here = (c.evaluate(c.start + np.minimum(since, c.duration)) for c in (curves[1], curves[0]))
    display = motion.display
    panels = []
    for joint in joints:
        ahead = (there[:, joint] - here[:, joint]) / display.joint_factor(joint)
        label = "\u0394" + display.joint_label("q", joint)
        trace = Trace(1, *thinned(since + motion.offset, ahead))
        title = f"{display.joint_names[joint]}: difference"
        panels.append(Panel(title, "t [s]", label, (trace,)))
    return PanelBlock(tuple(panels), min(len(panels), _BESIDE))


def effort_samples(plan: Plan) -> EffortSamples:
    """Return the efforts of all moves with what each of them carries, and where the checks saw peaks.

    They step where the acceleration does, where a payload is attached or detached, and where a joint with
    Coulomb friction turns back: at rest friction has the sign of the motion beside.

    Raises:
        InputError: When the robot has no geometry, or a link no inertia.
    """
    curve, parts = plan.trajectory.curve, []
    middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
    for index, (move, span) in enumerate(zip(plan.moves, plan.trajectory.spans, strict=True)):
        first, last = np.searchsorted(middles, [span.start, span.end])
        long = np.flatnonzero(curve.lengths[first:last] > 0) + first
        if long.size:
            pieces = curve.breaks[long], curve.lengths[long], curve.coefficients[:, long]
            longest = curve.duration / STEPS
            parts.append(_efforts(move.robot, pieces, longest, np.array(list(_peaks(plan, index)))))
    nothing = np.empty(0), np.empty((0, curve.dimension))
    times, values = zip(nothing, *parts, strict=True)
    return EffortSamples(np.concatenate(times), np.concatenate(values))


def _peaks(plan: Plan, index: int) -> Iterator[float]:
    """Yield when the checks saw the largest efforts of a move, on the curve."""
    efforts = plan.verdict.efforts[index] if index < len(plan.verdict.efforts) else None
    if efforts is not None:
        yield from (peak.time for peak in (*efforts.highest, *efforts.lowest))


def _efforts(
    robot: Robot, pieces: tuple[Array, Array, Array], longest: float, peaks: Array
) -> tuple[Array, Array]:
    """Return times (N,) and efforts (N, n) of a move, by starts, lengths and coefficients of its pieces."""
    from trajcli.dynamics.effort_bound import cut_where_joints_turn
    from trajcli.dynamics.newton_euler import InverseDynamics, direction

    dynamics = InverseDynamics(robot)
    starts, lengths, coefficients = cut_where_joints_turn(dynamics, *pieces)
    curve = PiecewisePolynomial(np.append(starts, starts[-1] + lengths[-1]), coefficients)
    piece, local = local_times(curve, max(math.ceil(curve.duration / longest), 1))
    owner = np.clip(np.searchsorted(starts, peaks, "right") - 1, 0, curve.pieces - 1)
    inside = np.clip(peaks - starts[owner], 0.0, curve.lengths[owner])
    piece, local = np.append(piece, owner), np.append(local, inside)
    ordered = np.lexsort((local, piece))
    piece, local = piece[ordered], local[ordered]
    speeds = derivative_coefficients(coefficients, 1)
    q, qd, qdd = (
        horner(derivative_coefficients(coefficients, order)[:, piece], local[:, None]) for order in range(3)
    )
    viscous = np.array([joint.friction.viscous for joint in robot.joints])
    coulomb = np.array([joint.friction.coulomb for joint in robot.joints])
    signs = direction(horner(speeds, curve.lengths[:, None] / 2))
    finite = np.isfinite(np.concatenate([q, qd, qdd], axis=1)).all(axis=1)
    values = np.full(q.shape, np.nan)
    values[finite] = dynamics.rigid_effort(q[finite], qd[finite], qdd[finite])
    values += viscous * qd + coulomb * signs[piece]
    return np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1]), values
