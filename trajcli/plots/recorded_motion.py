"""Motion recorded in a file: values of joints and tool by the names of columns, and its errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import EFFORT, Column, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.judge.judgement import Judgement
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import JOINT_KINDS, SPEED_KINDS
from trajcli.plots.choice import JOINT_QUANTITIES
from trajcli.plots.display_units import DisplayUnits
from trajcli.plots.panel import NO_POINTS
from trajcli.streams.joint_columns import converted, refuse_zero
from trajcli.streams.table import Table
from trajcli.trajectory import Trajectory

_SPEEDS = (("vx", "vy", "vz"), ("wx", "wy", "wz"))
_POSITION = ("x", "y", "z")
_LIMITED: Mapping[str | None, str | None] = {kind.name: kind.picture for kind in JOINT_KINDS}
"""Which values of a joint a kind of finding, or the quantity that a finding names, is about."""
_AT_ENDS = ("start", "end")


def columns_of_table(table: Table) -> tuple[Column, ...]:
    """Return what the columns of a file are.

    Raises:
        InputError: When none is the time, or joints are counted from zero.
    """
    refuse_zero(table.names, table.file)
    columns = tuple(map(parse_column, table.names))
    if not any(column.kind == "t" and column.joint is None for column in columns):
        hint = f"it has {', '.join(table.names[:12])}{converted(table.names, table.file)}"
        raise InputError(f"{table.file} has no column t, over which it could be plotted", hint=hint)
    return columns


@frozen
class DrawnTable:
    """A file, in the units of a picture.

    Attributes:
        table: Its numbers.
        columns: What they are.
        display: Units and joints of the picture.
        robot: Whose tool it is where the file does not say where that is; None without a job.
        judgement: What is wrong with its motion; None where it was not judged.
        trajectory: Of the job, whose spans know which tool is on the flange.
        frame: T_world_frame (4, 4) of the frame in which the file says where the tool is; None for world.
    """

    table: Table
    columns: tuple[Column, ...]
    display: DisplayUnits
    robot: Robot | None = None
    judgement: Judgement | None = None
    trajectory: Trajectory | None = None
    frame: Array | None = None

    def _of_tools(self, values: Callable[[Robot, NDArray[np.intp]], Array]) -> Array:
        """Return values of all rows, each of the arm with the tool that it has then."""
        assert self.robot is not None  # noqa: S101
        since = self.times - self.times[0]
        if self.trajectory is None:
            return values(self.robot, np.arange(since.size))
        return self.trajectory.of_tools(self.robot, since, values)

    @property
    def times(self) -> Array:
        """Of the rows, shape (N,), s."""
        return np.asarray(self._of("t")[0])

    def joint(self, kind: str, joint: int) -> Array | None:
        """Return the values (N,) of a joint in the unit of its axis; None where the file has none."""
        for index, column in enumerate(self.columns):
            if column.kind == kind and column.joint == joint:
                shown = 1.0 if kind == EFFORT else self.display.joint_factor(joint)
                return np.asarray(self.table.columns[:, index] * (column.factor / shown))
        return None

    def tool_speeds(self) -> tuple[Array, Array] | None:
        """Return speed and angular speed of the tool, each (N,), in the units of the picture."""
        if self._has(_SPEEDS[0] + _SPEEDS[1]):
            linear, angular = (np.linalg.norm(self._of(*names), axis=0) for names in _SPEEDS)
        else:
            motion = self._joints("q", "qd")
            if self.robot is None or motion is None:
                return None
            from trajcli.kinematics.jacobian import tcp_twist

            q, qd = motion
            twist = self._of_tools(lambda arm, k: tcp_twist(arm, q[k], qd[k]))
            linear, angular = (np.linalg.norm(twist[:, part], axis=1) for part in (slice(3), slice(3, 6)))
        return linear / self.display.factor("length"), angular / self.display.factor("angle")

    def tool_positions(self) -> Array | None:
        """Return the positions (N, 3) of the tool in world, in the unit of the picture."""
        if self._has(_POSITION):
            positions = self._of(*_POSITION).T
            if self.frame is not None:
                positions = positions @ self.frame[:3, :3].T + self.frame[:3, 3]
        else:
            motion = self._joints("q")
            if self.robot is None or motion is None:
                return None
            from trajcli.kinematics.forward import forward

            q = motion[0]
            positions = self._of_tools(lambda arm, k: forward(arm, q[k])[:, :3, 3])
        return np.asarray(positions / self.display.factor("length"))

    def joint_findings(self, kind: str, joint: int) -> Array:
        """Return when errors are, and the value where one is of this joint and kind, shape (k, 2)."""
        rows = []
        for time, finding in self._errors():
            about = _LIMITED.get(finding.kind) or _LIMITED.get(finding.quantity)
            own = finding.joint == self.display.joint_names[joint] and about == kind
            rows.append((time, self._marked(finding, time, kind, joint) if own else np.nan))
        return np.array(rows or NO_POINTS)

    def tool_findings(self, angular: bool) -> Array:
        """Return the same for the speed of the tool, or its angular speed."""
        scale = self.display.factor("angle" if angular else "length")
        rows = []
        for time, finding in self._errors():
            own = finding.kind == SPEED_KINDS[angular].name and finding.value is not None
            rows.append((time, float(finding.value or 0.0) / scale if own else np.nan))
        return np.array(rows or NO_POINTS)

    def shows(self) -> frozenset[str]:
        """Return the quantities of a picture that this file has something to say about."""
        kinds = {column.kind for column in self.columns if column.joint is not None}
        found = {kind for kind in JOINT_QUANTITIES if kind in kinds}
        if self.tool_speeds() is not None:
            found.add("tool")
        if self.tool_positions() is not None:
            found.add("path")
        return frozenset(found)

    def _errors(self) -> Iterator[tuple[float, Finding]]:
        """Yield the errors that have a time, s."""
        for finding in () if self.judgement is None else self.judgement.errors:
            if finding.time is not None:
                yield finding.time, finding

    def _marked(self, finding: Finding, time: float, kind: str, joint: int) -> float:
        """Return where a marker stands: at the offending value; of a jump or a wrong column on its line."""
        if finding.kind in _LIMITED or finding.kind in _AT_ENDS:
            scale = 1.0 if kind == EFFORT else self.display.joint_factor(joint)
            return np.nan if finding.value is None else finding.value / scale
        values = self.joint(kind, joint)
        return np.nan if values is None else float(np.interp(time, self.times, values))

    def _has(self, kinds: tuple[str, ...]) -> bool:
        return set(kinds) <= {column.kind for column in self.columns if column.joint is None}

    def _of(self, *kinds: str) -> Array:
        """Return columns that are not about joints, SI, shape (kinds, N)."""
        index = {column.kind: k for k, column in enumerate(self.columns)}
        rows = [self.table.columns[:, index[kind]] * self.columns[index[kind]].factor for kind in kinds]
        return np.array(rows)

    def _joints(self, *kinds: str) -> tuple[Array, ...] | None:
        """Return values of all joints of the robot, SI, each (N, n); None where some are missing."""
        count = len(self.display.joint_names)
        if self.robot is None or self.robot.convention is None:
            return None
        found = []
        for kind in kinds:
            columns = [self.joint(kind, joint) for joint in range(count)]
            present = [values for values in columns if values is not None]
            if len(present) < count:
                return None
            scales = [self.display.joint_factor(joint) for joint in range(count)]
            found.append(np.stack(present, axis=1) * scales)
        return tuple(found)
