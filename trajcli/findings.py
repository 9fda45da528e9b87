"""Findings: what is wrong with a motion, planned or recorded, and where; and the collector of the worst."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import field, replace
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trajcli.errors import Amount, Amounts, Place, Problem, said
from trajcli.frozen import comparable

FindingMethod = Literal["exact", "bounded", "sampled", "differences"]
FindingSeverity = Literal["error", "warning"]
Certainty = Literal["exceeded", "within rounding"]

_RATES = ("", "/s", "/s^2", "/s^3")
_LONG_AGO = 1e6  # s: where clocks count from a year, not from a start
_UNORDERED = ("jump", "time", "derivative", "start", "end")
"""Kinds whose value is no part of their limit."""


@comparable
class Finding:
    """Something that is wrong with a motion, at its worst place.

    Attributes:
        kind: The quantity that breaks its limit, or that jumps; or what is not as it should be: `waypoint`,
            `target`, `tool_path`, `branch` and others of a plan; `time`, `derivative`, `start`, `end`,
            `joints`, `deviation`, `singularity`, `quantisation` and others of recorded rows.
        joint: Its name; None where it is about the tool, about time stamps, or about all joints.
        value: SI, signed as on the curve; for a jump the value after minus the value before; for a waypoint
            or target the distance from it. None where there is none, as of a stamp that is not finite.
        limit: The bound that it breaks, SI, signed as the value; for a jump of a plan the size that rounding
            explains; for a waypoint or target the distance that was promised. None likewise.
        time: Seconds from the start of a trajectory; of rows, as they have it.
        move: Index of the move; None where it is about the whole trajectory, or the rows name no moves.
        row: Number of the row at that time, or before it, from 1; None where it is about no row.
        rule: limit, continuity, time, derivative, state, path, or the id of a rule of a consumer.
        severity: A warning does not change a verdict.
        method: "exact": from the roots of derivatives; "bounded": at most that for all t, proven between rows
            within 1e-6; "sampled": on rows, without a proof of what is between them; "differences": of rows,
            as a controller takes them.
        factor: How many times longer the motion must last for the limit to hold; None where that is no help.
        count: Of the intervals or rows at which the same is wrong.
        quantity: Of a jump or a derivative of rows: position, velocity or acceleration.
        certainty: "within rounding" where the rounding of a file's numbers explains it.
        rounding: By how much the value may be off by the rounding of a file, SI.
        message: What is wrong, one sentence for people.
        amounts: Numbers and names that the message holds as `{name}`.
        hint: What would fix it.
        unit: Of value and limit, where the message has no amounts any more.
    """

    kind: str
    joint: str | None = None
    value: float | None = None
    limit: float | None = None
    time: float | None = None
    move: int | None = None
    row: int | None = None
    rule: str = "limit"
    severity: FindingSeverity = "error"
    method: FindingMethod = "exact"
    factor: float | None = None
    count: int = 1
    quantity: str | None = None
    certainty: Certainty = "exceeded"
    rounding: float = 0.0
    message: str = ""
    amounts: Amounts = field(default_factory=dict)
    hint: str | None = None
    unit: str | None = None

    @property
    def si_unit(self) -> str | None:
        """Unit of value and limit, such as "rad/s"; None where they are no quantities."""
        amount = self.amounts.get("value")
        if not isinstance(amount, Amount):
            return self.unit
        if amount.unit is not None:
            return amount.unit
        return ("m" if amount.dimension == "length" else "rad") + _RATES[amount.order]

    @property
    def excess(self) -> float:
        """Value over limit, by magnitude; infinite where there is no such ratio. Orders findings.

        Of a position, whose lower limit may be above zero: 1 and what it is beyond its limit, over that.
        """
        if not self.limit or self.value is None or self.kind in _UNORDERED:
            return math.inf
        share = self.value / self.limit
        return 1.0 + abs(share - 1.0) if self.kind == "position" else abs(share)

    def text(self, say: Callable[[Amount], str] = str) -> str:
        """Return the message with its amounts said by `say`."""
        return said(self.message, self.amounts, say)

    def said_by(self, say: Callable[[Amount], str]) -> Finding:
        """Return the same finding with its message as `say` writes the amounts."""
        return replace(self, message=self.text(say), amounts={}, unit=self.si_unit)

    def problem(self, text: str, place: Place | None = None) -> Problem:
        """Return the problem that an error carries about this finding, at its place in a file."""
        return Problem(
            text,
            self.hint,
            place,
            self.move,
            self.joint,
            self.time,
            self.value,
            self.limit,
            kind=self.kind,
            row=self.row,
            severity="note" if self.certainty == "within rounding" else self.severity,
        )


class NamedJoints(Protocol):
    """Whatever names joints and their types, such as a robot or a trajectory."""

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names, n of them."""

    @property
    def joint_types(self) -> tuple[Any, ...]:
        """`revolute` or `prismatic`, n of them."""


def joint_amounts(joints: NamedJoints, joint: int, order: int, **values: float) -> Amounts:
    """Return a joint's name, and values of its position or of a derivative of it, as amounts of a message."""
    dimension: Literal["length", "angle"] = "length" if joints.joint_types[joint] == "prismatic" else "angle"
    amounts = {name: Amount(value, order, joint, dimension) for name, value in values.items()}
    return {"joint": joints.joint_names[joint], **amounts}


def excess_amounts(joints: NamedJoints, joint: int, order: int, value: float, limit: float) -> Amounts:
    """Return a joint's name, a value beyond its limit, and the limit, rounded so that both pass."""
    amounts = dict(joint_amounts(joints, joint, order, value=value, limit=limit))
    for name, raised in (("value", value > limit), ("limit", value < limit)):
        amount = amounts[name]
        if isinstance(amount, Amount):
            amounts[name] = replace(amount, rounded="up" if raised else "down")
    return amounts


def tool_excess_amounts(
    value: float, limit: float, order: int, dimension: Literal["length", "angle"]
) -> Amounts:
    """Return a value of the tool beyond its limit, and the limit, rounded so that both pass."""
    return {
        "value": Amount(value, order, None, dimension, "up"),
        "limit": Amount(limit, order, None, dimension, "down"),
    }


def at_time(time: float) -> str:
    """Return the words that say when, in s from the start of the trajectory."""
    return f"at t = {time_text(time)} s"


def time_text(time: float) -> str:
    """Return a time, s, with nine digits; of one that is counted from long ago all, to the microsecond."""
    return f"{time:.9g}" if abs(time) < _LONG_AGO else f"{round(float(time), 6):.16g}"


Make = Callable[[int], Finding]


class _Key(NamedTuple):
    kind: str
    quantity: str | None
    joint: int
    move: int


_Group = tuple[FindingSeverity, Certainty]


class _Offence(NamedTuple):
    size: float
    alike: int
    move: int
    made: Callable[[], Finding]


class Collector:
    """The worst finding of each kind, joint and move, and how many there are like it."""

    def __init__(self, same: float = 1e-12, *, by_move: bool = True) -> None:
        """Begin with none.

        Args:
            same: Relative: of offences that differ by less the first one is kept.
            by_move: Whether each move has a worst finding. If not, the worst of all moves is made when it is
                asked for, and what it is made from is kept: for motions that are seen in few parts.
        """
        self._same, self._by_move = same, by_move
        self._worst: dict[_Key, dict[_Group, _Offence]] = {}

    def add(
        self,
        kind: str,
        moves: NDArray[np.int64] | int,
        joints: NDArray[np.intp],
        excess: NDArray[np.float64],
        make: Make,
        *,
        quantity: str | None = None,
        severity: FindingSeverity = "error",
        certainty: Certainty = "exceeded",
        chosen: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add offences of one kind, m of them, in order of time.

        Args:
            kind: Of all of them.
            moves: Index of the move of each, shape (m,), or of all of them; -1 for none.
            joints: Index of the joint of each, -1 for the tool, for stamps, or for all joints, shape (m,).
            excess: How bad each is, shape (m,).
            make: Returns the finding of one of them.
            quantity: Of a jump or a derivative.
            severity: Of all of them.
            certainty: Likewise.
            chosen: Which of them count, shape (m,); all unless given.
        """
        index = np.arange(joints.size) if chosen is None else np.flatnonzero(chosen)
        of_moves = np.broadcast_to(moves, joints.shape)
        keyed = np.stack([joints, of_moves if self._by_move else np.full_like(joints, -1)], axis=1)[index]
        for joint, key_move in sorted(set(map(tuple, keyed.tolist()))):
            own = index[(keyed == (joint, key_move)).all(axis=1)]
            move = of_moves[own[int(excess[own].argmax())]]
            own = own[of_moves[own] == move]
            groups = self._worst.setdefault(_Key(kind, quantity, joint, key_move), {})
            first, before = self._first_worst(own, excess[own]), groups.get((severity, certainty))
            here = before if before is not None and before.move == move else None
            count = own.size + (here.alike if here else 0)
            if before is None or float(excess[first]) > self._to_pass(before, here):
                made = self._maker(make, first)
                groups[severity, certainty] = _Offence(float(excess[first]), count, int(move), made)
            elif here is not None:
                groups[severity, certainty] = here._replace(alike=count)

    def _to_pass(self, before: _Offence, here: _Offence | None) -> float:
        """Return above what an offence is worse than one before: of equals in a move the first is kept."""
        return before.size + (self._same * abs(before.size) if here else 0.0)

    def _maker(self, make: Make, first: int) -> Callable[[], Finding]:
        """Return what makes the finding of an offence; of many moves it is made now: its rows may go then."""
        if not self._by_move:
            return lambda: make(first)
        finding = make(first)
        return lambda: finding

    def _first_worst(self, own: NDArray[np.intp], excess: NDArray[np.float64]) -> int:
        """Return the first of some offences whose excess is the largest up to rounding."""
        largest = float(excess.max())
        enough = largest - self._same * abs(largest) if math.isfinite(largest) else largest
        return int(own[int((excess >= enough).argmax())])

    def findings(self) -> Iterator[Finding]:
        """Yield the worst of those that are most certain; of all moves together also the less certain."""
        for groups in self._worst.values():
            certain = min(groups, key=lambda group: (group[0] != "error", group[1] != "exceeded"))
            for group in [certain] if self._by_move else groups:
                found = groups[group]
                yield replace(
                    found.made(),
                    severity=group[0],
                    certainty=group[1],
                    count=found.alike,
                    move=None if found.move < 0 else found.move,
                )
