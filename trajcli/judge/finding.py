"""Findings about a recorded motion, and the judgement that they add up to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amounts, said
from trajcli.frozen import comparable, frozen

JudgedKind = Literal[
    "position",
    "velocity",
    "acceleration",
    "jerk",
    "velocity_by_position",
    "tool_speed",
    "tool_acceleration",
    "tool_angular_speed",
    "tool_angular_acceleration",
    "effort",
    "jump",
    "time",
    "derivative",
    "start",
    "end",
    "deviation",
    "branch",
    "singularity",
    "quantisation",
]
FindingSeverity = Literal["error", "warning"]
Certainty = Literal["exceeded", "within rounding"]
VerdictText = Literal["satisfied", "within rounding", "exceeded"]
JudgedMethod = Literal["exact", "bounded", "sampled", "differences"]

_KEYS = ("rule", "severity", "kind", "quantity", "joint", "move", "value", "limit", "rounding", "certainty")
_WHERE = ("time", "row", "factor", "method", "count")


@comparable
class JudgedFinding:
    """Something that is wrong with a recorded motion, the worst of its joint, kind and move.

    Attributes:
        rule: limit, continuity, time, derivative, state, path, or the id of a profile's rule.
        severity: A warning does not change the verdict.
        kind: What breaks a limit, jumps, or is not as it should be.
        joint: Its name; None where it is about the tool or about time stamps.
        value: SI, signed.
        limit: The bound that it breaks, SI; None where there is none, as of a stamp that is not finite.
        time: Seconds of the file.
        row: Number of the row at that time, or before it, from 1; None where it is about no row.
        factor: How many times longer the motion must last for the limit to hold; None where that is no help.
        method: "exact": from the roots of derivatives; "bounded": at most that for all t; "sampled": on rows;
            "differences": of rows, as a controller takes them.
        count: Of the intervals or rows at which the same is wrong.
        move: Index of the move; None where the file names no moves.
        quantity: Of a jump or a derivative: position, velocity or acceleration.
        certainty: "within rounding" where the rounding of the file's numbers explains it.
        rounding: By how much the value may be off by the rounding of the file, SI.
        message: What is wrong, one sentence for people.
        amounts: Numbers and names that the message holds as `{name}`.
        hint: What would fix it.
    """

    rule: str
    severity: FindingSeverity
    kind: JudgedKind
    joint: str | None
    value: float | None
    limit: float | None
    time: float | None
    row: int | None
    factor: float | None = None
    method: JudgedMethod = "exact"
    count: int = 1
    move: int | None = None
    quantity: str | None = None
    certainty: Certainty = "exceeded"
    rounding: float = 0.0
    message: str = ""
    amounts: Amounts = field(default_factory=dict)
    hint: str | None = None

    def text(self, say: Any = str) -> str:  # noqa: ANN401
        """Return the message with its amounts said by `say`."""
        return said(self.message, self.amounts, say)

    @property
    def excess(self) -> float:
        """Value over limit, by magnitude; infinite where there is no such ratio. Orders findings."""
        if not self.limit or self.value is None or self.kind in ("jump", "time", "derivative"):
            return float("inf")
        return abs(self.value / self.limit)

    def as_json(self) -> dict[str, Any]:
        """Return the finding as `check --format json` prints it."""
        keys = {name: getattr(self, name) for name in (*_KEYS, *_WHERE)}
        return {**keys, "message": self.text(), "hint": self.hint}


@frozen
class Judgement:
    """What a check says of a recorded motion.

    Attributes:
        findings: Worst first.
        interpolation: How the rows were joined: hold, linear, cubic, quintic, jtc or jtc-upsampling.
        rows: How many were judged.
        period: Seconds between rows, where it is constant; None where it is not.
        source: Name of the file; None of arrays.
        notes: What a reader should know: stamps that were snapped, what could not be judged.
        events: What was taken for granted, which `--strict` does not accept.
        planned_rows: Whether they are rows of the verified motion of the job; None without a plan.
    """

    findings: tuple[JudgedFinding, ...]
    interpolation: str
    rows: int
    period: float | None = None
    source: str | None = None
    notes: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    planned_rows: bool | None = None

    @property
    def verdict(self) -> VerdictText:
        """The word for it: warnings do not change it."""
        errors = {finding.certainty for finding in self.findings if finding.severity == "error"}
        if not errors:
            return "satisfied"
        return "exceeded" if "exceeded" in errors else "within rounding"

    @property
    def errors(self) -> tuple[JudgedFinding, ...]:
        """What is certainly wrong: neither a warning, nor what rounding explains."""
        return tuple(
            found for found in self.findings if (found.severity, found.certainty) == ("error", "exceeded")
        )

    @property
    def passed(self) -> bool:
        """Whether nothing is certainly wrong."""
        return self.verdict != "exceeded"

    def __repr__(self) -> str:
        named = [
            f"{found.kind} of {found.joint}" if found.joint else found.kind for found in self.findings[:2]
        ]
        more = ["..."] if len(self.findings) > len(named) else []
        return f"Judgement({self.verdict}{': ' * bool(named)}{', '.join(named + more)})"

    def as_json(self) -> dict[str, Any]:
        """Return the judgement as `check --format json` prints it."""
        findings = [finding.as_json() for finding in self.findings]
        known = {"verdict": self.verdict, "findings": findings, "interpolation": self.interpolation}
        period = {} if self.period is None else {"period": self.period}
        planned = {} if self.planned_rows is None else {"planned_rows": self.planned_rows}
        said = {"notes": list(self.notes), "events": list(self.events)}
        return {**known, "rows": self.rows, **period, **planned, **said}


def worst_first(findings: Sequence[JudgedFinding]) -> tuple[JudgedFinding, ...]:
    """Return the findings in order: errors, certain ones, those furthest beyond their limits."""

    def key(finding: JudgedFinding) -> tuple[bool, bool, float, float]:
        time = finding.time if finding.time is not None else -1.0
        return finding.severity != "error", finding.certainty != "exceeded", -finding.excess, time

    return tuple(sorted(findings, key=key))


Make = Callable[[int], JudgedFinding]


class _Key(NamedTuple):
    kind: JudgedKind
    quantity: str | None
    joint: int
    move: int


class Worst:
    """Findings of a check in the making."""

    def __init__(self) -> None:
        """Begin with none."""
        self._best: dict[_Key, dict[tuple[FindingSeverity, Certainty], tuple[float, JudgedFinding]]] = {}
        self._counts: dict[_Key, dict[tuple[FindingSeverity, Certainty], int]] = {}

    def add(
        self,
        kind: JudgedKind,
        move: int,
        joints: NDArray[np.intp],
        excess: Array,
        make: Make,
        *,
        quantity: str | None = None,
        severity: FindingSeverity = "error",
        certainty: Certainty = "exceeded",
        chosen: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add offences of one kind and move.

        Args:
            kind: Of the finding.
            move: Index of the move, -1 for none.
            joints: Index of the joint of each offence, -1 for the tool or the stamps, shape (m,).
            excess: How bad each is, shape (m,).
            make: Returns the finding of one of them.
            quantity: Of a jump or a derivative.
            severity: Of all of them.
            certainty: Likewise.
            chosen: Which of them count, shape (m,); all unless given.
        """
        group = (severity, certainty)
        index = np.arange(joints.size) if chosen is None else np.flatnonzero(chosen)
        for joint in sorted(set(joints[index].tolist())):
            of_joint = index[joints[index] == joint]
            key = _Key(kind, quantity, joint, move)
            counts = self._counts.setdefault(key, {})
            counts[group] = counts.get(group, 0) + of_joint.size
            worst = int(of_joint[excess[of_joint].argmax()])
            size = float(excess[worst])
            best = self._best.setdefault(key, {})
            if group not in best or size > best[group][0] * (1 + 1e-12):
                best[group] = size, make(worst)

    def findings(self) -> list[JudgedFinding]:
        """Return for each joint, kind and move the worst of those that are most certain."""
        found = []
        for key, groups in self._best.items():
            group = min(groups, key=lambda group: (group[0] != "error", group[1] != "exceeded"))
            finding = replace(
                groups[group][1],
                severity=group[0],
                certainty=group[1],
                count=self._counts[key][group],
                move=None if key.move < 0 else key.move,
            )
            found.append(finding)
        return found
