"""Judgement of rows by one rule of a consumer: the worst finding of each joint and move."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trajcli.consumers.profile import ConsumerRule
from trajcli.curves.piecewise import Array
from trajcli.findings import Collector, Finding, FindingSeverity, at_time
from trajcli.frozen import frozen
from trajcli.kinematics.robot import JointType, Limits, Robot
from trajcli.streams.recorded_motion import RecordedMotion
from trajcli.units import effort_unit, joint_units

_SAME = 1e-9  # relative: of rows that break a rule alike the first is named


@frozen
class Surroundings:
    """What is known beside the rows.

    Attributes:
        joints: Names of the robot's joints, in its order; None where there is no robot.
        start: Positions in which the arm stands when the motion begins, shape (n,); None where unknown.
        limits: Of the robot; None where unknown.
        types: Of its joints; None where all of them turn.
    """

    joints: tuple[str, ...] | None = None
    start: Array | None = None
    limits: Limits | None = None
    types: tuple[JointType, ...] | None = None


def surroundings_of(robot: Robot, start: Array | None) -> Surroundings:
    """Return what is known of a robot, and of where it stands when the motion begins, (n,)."""
    return Surroundings(robot.joint_names, start, robot.limits, robot.joint_types)


class RuleCheck(ABC):
    """Judgement of the rows of a motion by one rule, block by block.

    Attributes:
        parameters: Names of the parameters of such a rule, and their defaults; None where one must be given.
        rule: The rule.
        around: What is known beside the rows.
        unjudged: Why it cannot be judged; None where it is.
    """

    parameters: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, rule: ConsumerRule, around: Surroundings) -> None:
        self.rule, self.around = rule, around
        self.unjudged: str | None = None
        self._found = Collector(_SAME)

    def take(self, rows: RecordedMotion) -> None:
        """Judge the next rows, at least one."""
        self._take(rows)

    def finish(self) -> None:
        """Judge what needs the end of the motion."""
        self._finish()

    @abstractmethod
    def _take(self, rows: RecordedMotion) -> None:
        """Judge the next rows."""

    def _finish(self) -> None:  # noqa: B027
        """Do nothing: few rules need the end."""

    def findings(self) -> Iterator[Finding]:
        """Yield what was found, by joint and move."""
        return self._found.findings()

    def forget(self) -> None:
        """Drop what was found."""
        self._found = Collector(_SAME)

    def number(self, name: str) -> float:
        """Return a parameter that is a number."""
        return float(self._parameter(name))

    def vector(self, name: str, count: int) -> Array:
        """Return a parameter with one number for each joint; one number stands for all."""
        values = np.asarray(self._parameter(name), dtype=np.float64)
        return np.broadcast_to(values, (count,)) if values.ndim == 0 else values

    def word(self, name: str) -> str:
        """Return a parameter that is a word."""
        return str(self._parameter(name))

    def fits(self, name: str, count: int) -> bool:
        """Return whether a parameter has a number for each joint; say so where it has not."""
        values = np.asarray(self._parameter(name))
        if values.ndim == 0 or values.size == count:
            return True
        self.unjudged = f"it is about {values.size} joints, and there are {count}"
        return False

    def joint_name(self, rows: RecordedMotion, joint: int | None) -> str | None:
        """Return the name of a joint, that of the file, of the robot, or q1, q2, ..."""
        if joint is None:
            return None
        names = rows.joints or self.around.joints
        return names[joint] if names and len(names) == rows.q.shape[1] else f"q{joint + 1}"

    def unit(self, joint: int, order: int = 0) -> str:
        """Return the SI unit of the position of a joint, or of its derivative of an order."""
        return joint_units([self._type(joint)], order)[0]

    def effort_unit(self, joint: int) -> str:
        """Return the unit of what drives a joint."""
        return effort_unit(self._type(joint))

    def _type(self, joint: int) -> JointType:
        types = self.around.types or ()
        return types[joint] if joint < len(types) else "revolute"

    def note(
        self,
        rows: RecordedMotion,
        joint: int | None,
        index: int,
        excess: float,
        fields: Mapping[str, Any],
        count: int = 1,
    ) -> None:
        """Add one offence: the worst of its joint and move is kept, the others are counted.

        Args:
            rows: The block.
            joint: Index; None where it is about all.
            index: Of the row in the block.
            excess: How bad it is, to be compared with others of this rule.
            fields: Of the finding.
            count: Of the rows that it stands for.
        """
        joints = np.full(count, -1 if joint is None else joint)
        self._add(rows, np.full(count, index), joints, np.full(count, excess), lambda _row, _joint: fields)

    def note_rows(
        self,
        rows: RecordedMotion,
        over: NDArray[np.bool_],
        excess: Array,
        fields: Callable[[int, int], Mapping[str, Any]],
    ) -> None:
        """Add the offences of a block: of each joint and move the worst row counts, and how many there are.

        Args:
            rows: The block.
            over: Where the rule is broken, shape (N, n).
            excess: How badly, shape (N, n).
            fields: Of the finding, from the index of a row and of a joint.
        """
        index, joints = np.nonzero(over)
        self._add(rows, index, joints, excess[over], fields)

    def note_row(
        self,
        rows: RecordedMotion,
        index: int,
        over: NDArray[np.bool_],
        excess: Array,
        fields: Callable[[int, int], Mapping[str, Any]],
    ) -> None:
        """Add the offences of one row of a block, `over` and `excess` (n,); as `note_rows` does for many."""
        joints = np.flatnonzero(over)
        self._add(rows, np.full(joints.size, index), joints, excess[joints], fields)

    def note_times(
        self,
        rows: RecordedMotion,
        over: NDArray[np.bool_],
        excess: Array,
        fields: Callable[[int], Mapping[str, Any]],
    ) -> None:
        """Add offences that are about rows and no joint; as `note_rows` does for joints."""
        index = np.flatnonzero(over)
        self._add(rows, index, np.full(index.size, -1), excess[over], lambda row, _: fields(row))

    def _add(
        self,
        rows: RecordedMotion,
        index: NDArray[np.intp],
        joints: NDArray[np.intp],
        excess: Array,
        fields: Callable[[int, int], Mapping[str, Any]],
    ) -> None:
        """Add offences at some rows of a block, of joints by their index, -1 for all of them."""

        def make(k: int) -> Finding:
            row, joint = int(index[k]), int(joints[k])
            name = None if joint < 0 else self.joint_name(rows, joint)
            time, number = float(rows.t[row]), rows.first_row + row
            return Finding(joint=name, time=time, row=number, rule=self.rule.id, **fields(row, joint))

        severity: FindingSeverity = "error" if self.rule.severity == "necessary" else "warning"
        moves = -1 if rows.move is None else rows.move[index]
        self._found.add("", moves, joints, excess, make, severity=severity)

    def _parameter(self, name: str) -> Any:  # noqa: ANN401
        given = self.rule.parameters.get(name)
        return self.parameters[name] if given is None else given


class OfFirstRow(RuleCheck):
    """A rule that the first rows decide."""

    _seen = False

    def _take(self, rows: RecordedMotion) -> None:
        if not self._seen:
            self._seen = True
            self._judge(rows)

    @abstractmethod
    def _judge(self, rows: RecordedMotion) -> None:
        """Judge the first block."""


def when(rows: RecordedMotion, index: int) -> str:
    """Return the words that say where in a file a row stands."""
    return f"{at_time(float(rows.t[index]))} (row {rows.first_row + index})"
