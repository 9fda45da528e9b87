"""What was measured, what it should be, and the table of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, Literal

MEGABYTE = 1e6  # bytes

_HEAD = ("benchmark", "against", "ours", "peer", "ratio", "goal", "spread", "")


@dataclass(frozen=True)
class Figure:
    """One measured comparison.

    Attributes:
        benchmark: What we did.
        peer: What did the same, or what we start from.
        ours: Each run, s or bytes.
        theirs: Each run of the peer, s or bytes; empty when it was skipped.
        goal: The largest quotient; for memory the largest difference, bytes.
        aim: A quotient in reach, below the goal.
        kind: "time" is judged by the quotient of the medians, "memory" by their difference, "seconds" alone.
        skipped: Why there is nothing to compare with.
    """

    benchmark: str
    peer: str
    ours: Sequence[float]
    theirs: Sequence[float]
    goal: float
    aim: float | None = None
    kind: Literal["time", "memory", "seconds"] = "time"
    skipped: str | None = None

    @property
    def value(self) -> float | None:
        """The quotient, or for memory the difference in bytes; None when the peer was skipped."""
        if self.skipped is not None:
            return None
        ours = median(self.ours)
        if self.kind == "seconds":
            return ours
        theirs = median(self.theirs)
        return ours / theirs if self.kind == "time" else ours - theirs

    @property
    def verdict(self) -> str:
        """In a word whether the goal is met."""
        if self.value is None:
            return f"skipped: {self.skipped}"
        text = "met" if self.value <= self.goal else "missed"
        if self.aim is None or text == "missed":
            return text
        return f"{text}, and the aim of {self.aim:.2f}" + ("" if self.value <= self.aim else " missed")

    def row(self) -> tuple[str, ...]:
        """Return the cells of the table."""
        ours, theirs = self._amount(self.ours), self._amount(self.theirs)
        return (self.benchmark, self.peer, ours, theirs, *self._judged(), self._spread(), self.verdict)

    def as_json(self) -> dict[str, Any]:
        """Return everything for a program: s or bytes, each run, and the smallest and largest quotient."""
        quotients = self._quotients()
        return {
            "benchmark": self.benchmark,
            "peer": self.peer,
            "kind": self.kind,
            "ours": median(self.ours) if self.ours else None,
            "theirs": median(self.theirs) if self.theirs else None,
            "value": self.value,
            "goal": self.goal,
            "aim": self.aim,
            "met": None if self.value is None else self.value <= self.goal,
            "skipped": self.skipped,
            "quotients": [min(quotients), max(quotients)] if quotients else None,
            "runs": {"ours": list(self.ours), "theirs": list(self.theirs)},
        }

    def _quotients(self) -> list[float]:
        """Return those of runs in one turn, as many as both have; a run of no tick of the clock has none."""
        return [ours / theirs for ours, theirs in zip(self.ours, self.theirs, strict=False) if theirs]

    def _spread(self) -> str:
        """Return the smallest and largest quotient of runs in one turn, or of our runs to their median."""
        own = [ours / median(self.ours) for ours in self.ours] if self.ours else []
        quotients = self._quotients() if self.kind == "time" else own
        return f"{min(quotients):.2f} to {max(quotients):.2f}" if quotients else "-"

    def _amount(self, runs: Sequence[float]) -> str:
        if not runs:
            return "-"
        amount = median(runs)
        return f"{amount / MEGABYTE:.1f} MB" if self.kind == "memory" else _seconds(amount)

    def _judged(self) -> tuple[str, str]:
        if self.kind == "memory":
            value = "-" if self.value is None else f"{self.value / MEGABYTE:+.1f} MB"
            return value, f"{self.goal / MEGABYTE:+.0f} MB"
        if self.kind == "seconds":
            return _seconds(self.value), _seconds(self.goal)
        digits = 2 if self.goal >= 0.1 else 3  # a goal of 0.015 shows all of them
        value = "-" if self.value is None else f"{self.value:.{digits}f}"
        return value, f"{self.goal:.{digits}f}"


def _seconds(amount: float | None) -> str:
    """Return a time in a unit that suits it."""
    if amount is None:
        return "-"
    for unit, size, digits in (("s", 1.0, 2), ("ms", 1e-3, 0 if amount >= 0.01 else 1)):
        if amount >= 10 * size or (unit == "s" and amount >= 1.0) or (unit == "ms" and amount >= size):
            return f"{amount / size:.{digits}f} {unit}"
    return f"{amount * 1e6:.1f} us"


def table(figures: Sequence[Figure]) -> str:
    """Return the figures as lines of text, one each, below a line of titles."""
    rows = [_HEAD, *(figure.row() for figure in figures)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if 2 <= place <= 6 else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
