"""Breaches of a consumer's rules: the worst of each joint and move, counted over all rows."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.consumers.profile import ConsumerRule
from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion

_SAME = 1e-9  # relative: of rows that break a rule alike the first is named


@comparable
class RuleBreach:
    """The worst of what a motion does against one rule, of one joint in one move.

    Attributes:
        rule: Its id.
        severity: "error" for a necessary rule, "warning" for a recommended one.
        kind: What is judged, by the words of `trajcli check`.
        joint: Name; None where it is about all.
        move: Index of the move; None where the file names none.
        value: What it reaches, SI.
        limit: What is allowed, SI.
        time: When, s as the file has it.
        row: Number of the row, from 1.
        factor: How many times longer the motion must last to keep it; None where that is no help.
        method: "exact" for a comparison, "differences" for differences of rows at the consumer's period.
        count: How many rows break it.
        message: One sentence, in SI.
        hint: What would help.
    """

    rule: str
    severity: Literal["error", "warning"]
    kind: str
    joint: str | None
    move: int | None
    value: float
    limit: float
    time: float
    row: int
    factor: float | None
    method: Literal["exact", "differences"]
    count: int
    message: str
    hint: str | None = None


@frozen
class Surroundings:
    """What is known beside the rows.

    Attributes:
        joints: Names of the robot's joints, in its order; None where there is no robot.
        start: Positions in which the arm stands when the motion begins, shape (n,); None where unknown.
        limits: Of the robot; None where unknown.
    """

    joints: tuple[str, ...] | None = None
    start: Array | None = None
    limits: Limits | None = None


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
        self._worst: dict[tuple[int | None, int | None], tuple[float, RuleBreach]] = {}

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

    def breaches(self) -> Iterator[RuleBreach]:
        """Yield what was found, by joint and move."""
        yield from (breach for _, breach in self._worst.values())

    def forget(self) -> None:
        """Drop what was found."""
        self._worst.clear()

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

    def note(self, rows: RecordedMotion, joint: int | None, index: int, excess: float, **of: Any) -> None:  # noqa: ANN401
        """Remember one breach: the worst of its joint and move is kept, the others are counted.

        Args:
            rows: The block.
            joint: Index; None where it is about all.
            index: Of the row in the block.
            excess: How bad it is, to be compared with others of this rule.
            of: Fields of `RuleBreach`.
        """
        move = None if rows.move is None else int(rows.move[index])
        severity: Literal["error", "warning"] = "error" if self.rule.severity == "necessary" else "warning"
        fields = {"factor": None, "method": "exact", "count": 1, **of}
        breach = RuleBreach(
            rule=self.rule.id,
            severity=severity,
            joint=self.joint_name(rows, joint),
            move=move,
            time=float(rows.t[index]),
            row=rows.first_row + index,
            **fields,
        )
        before = self._worst.get((joint, move))
        if before is None:
            self._worst[joint, move] = (excess, breach)
            return
        worst = (excess, breach) if excess > before[0] + _SAME * abs(before[0]) else before
        self._worst[joint, move] = (worst[0], replace(worst[1], count=before[1].count + breach.count))

    def note_rows(
        self,
        rows: RecordedMotion,
        over: NDArray[np.bool_],
        excess: Array,
        fields: Callable[[int, int], Mapping[str, Any]],
    ) -> None:
        """Remember the breaches of a block: of each joint and move the worst row, and how many there are.

        Args:
            rows: The block.
            over: Where the rule is broken, shape (N, n).
            excess: How badly, shape (N, n).
            fields: Of `RuleBreach`, from the index of a row and of a joint.
        """
        for joint in np.flatnonzero(over.any(axis=0)).tolist():
            at = np.flatnonzero(over[:, joint])
            for members in _by_move(rows, at):
                index = _first_worst(members, excess[members, joint])
                self.note(
                    rows,
                    joint,
                    index,
                    float(excess[index, joint]),
                    count=int(members.size),
                    **fields(index, joint),
                )

    def note_times(
        self,
        rows: RecordedMotion,
        over: NDArray[np.bool_],
        excess: Array,
        fields: Callable[[int], Mapping[str, Any]],
    ) -> None:
        """Remember breaches that are about rows and no joint; as `note_rows` does for joints."""
        for members in _by_move(rows, np.flatnonzero(over)):
            index = _first_worst(members, excess[members])
            self.note(rows, None, index, float(excess[index]), count=int(members.size), **fields(index))

    def _parameter(self, name: str) -> Any:  # noqa: ANN401
        given = self.rule.parameters.get(name)
        return self.parameters[name] if given is None else given


def _by_move(rows: RecordedMotion, indices: NDArray[np.intp]) -> Sequence[NDArray[np.intp]]:
    """Return indices of rows in groups of one move each."""
    if rows.move is None or not indices.size:
        return [indices] if indices.size else []
    moves = rows.move[indices]
    return [indices[moves == move] for move in np.unique(moves)]


def _first_worst(members: NDArray[np.intp], excess: Array) -> int:
    """Return the first of the rows whose excess is the largest up to rounding."""
    most = float(excess.max())
    return int(members[int((excess >= most - _SAME * abs(most)).argmax())])


def when(rows: RecordedMotion, index: int) -> str:
    """Return the words that say where in a file a row stands."""
    return f"at t = {float(rows.t[index]):.9g} s (row {rows.first_row + index})"
