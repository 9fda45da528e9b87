"""Second plan of a picture: its motion as rows from the start of the first, and by how much it is ahead."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.columns import JOINT_ORDERS
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.planning.plan import Plan
from trajcli.plots.panel import Panel, PanelBlock, Trace
from trajcli.plots.planned_motion import PlannedMotion
from trajcli.plots.sampling import local_times, thinned
from trajcli.streams.table import Table

_TOOL = ("x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz")
_BESIDE = 3  # panels in a row


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
        names = motion.plan.loaded.name, second.loaded.name
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
