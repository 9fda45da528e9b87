"""Judgement of a recorded motion: its findings and the verdict that they add up to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.limits.tolerances import JOINED_RELATIVE

VerdictText = Literal["satisfied", "within rounding", "exceeded"]

_KEYS = (
    *("rule", "severity", "kind", "quantity", "joint", "move", "value", "limit", "rounding", "certainty"),
    *("time", "row", "factor", "method", "count"),
)


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
        planned_with: The options of `trajcli plan` that make them, where the job alone plans another motion;
            such as "--for ros-jtc".
    """

    findings: tuple[Finding, ...]
    interpolation: str
    rows: int
    period: float | None = None
    source: str | None = None
    notes: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    planned_rows: bool | None = None
    planned_with: str | None = None

    @property
    def verdict(self) -> VerdictText:
        """The word for it: warnings do not change it."""
        errors = {finding.certainty for finding in self.findings if finding.severity == "error"}
        if not errors:
            return "satisfied"
        return "exceeded" if "exceeded" in errors else "within rounding"

    @property
    def errors(self) -> tuple[Finding, ...]:
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
        findings = [
            {**{name: getattr(found, name) for name in _KEYS}, "message": found.text(), "hint": found.hint}
            for found in self.findings
        ]
        plain = {"verdict": self.verdict, "findings": findings, "interpolation": self.interpolation}
        period = {} if self.period is None else {"period": self.period}
        planned: dict[str, Any] = {} if self.planned_rows is None else {"planned_rows": self.planned_rows}
        planned |= {} if self.planned_with is None else {"planned_with": self.planned_with}
        said = {"notes": list(self.notes), "events": list(self.events)}
        return {**plain, "rows": self.rows, **period, **planned, **said}


def worst_first(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings in order: errors, certain ones, those furthest beyond their limits."""

    def key(finding: Finding) -> tuple[bool, bool, float, float]:
        time = finding.time if finding.time is not None else -1.0
        return finding.severity != "error", finding.certainty != "exceeded", -finding.excess, time

    return tuple(sorted(findings, key=key))


_OF_LIMITS = ("limit", "path")
_RATES_OF_ROWS = ("continuity", "derivative", "time")


def as_planned(judgement: Judgement, slack: float = JOINED_RELATIVE) -> Judgement:
    """Return the judgement of rows that are those of a verified motion, whose curve is proven already.

    They hold no jumps and no false derivatives, whatever their rate, and what rounding explains is nothing.
    What the curve that joins them passes is a warning, and an event.

    Args:
        judgement: Of these rows.
        slack: Relative: what the joined curve may be above a limit.
    """
    findings = [
        replace(finding, severity="warning")
        for finding in judgement.findings
        if finding.severity == "warning"
        or (finding.rule not in _RATES_OF_ROWS and finding.certainty == "exceeded")
        if finding.excess > 1 + slack
    ]
    over = [f for f in findings if f.rule != "state" and f.limit is not None]
    events = judgement.events
    if over:
        worst = max(over, key=lambda finding: finding.excess)
        of_tool = worst.kind.startswith("tool_")
        what = worst.kind.removeprefix("tool_").replace("_", " ")
        what += " of the tool" if of_tool else "" if worst.joint is None else f" of {worst.joint}"
        passed = "tolerance of the path of the tool" if worst.kind == "deviation" else f"limit of the {what}"
        said = f"joined_over_limit: the rows, joined between them, pass the {passed}"
        factor = f"by a factor of {worst.excess:.6g}" if worst.limit else "which is 0 there"
        events = (*events, f"{said}, {factor}")
    return replace(judgement, findings=worst_first(findings), events=events, planned_rows=True)


def as_joined(judgement: Judgement) -> Judgement:
    """Return the judgement of rows of a verified motion that a named consumer joins, or a named method.

    The curve between them is not proven, but what is above a limit by rounding alone is nothing there, too.
    """
    findings = tuple(
        finding
        for finding in judgement.findings
        if finding.rule not in _OF_LIMITS
        or finding.limit is None
        or (finding.certainty == "exceeded" and finding.excess > 1 + JOINED_RELATIVE)
    )
    return replace(judgement, findings=findings, planned_rows=True)
