"""What long campaigns did: counts that are summed over all processes, and largest figures, at the end of a run."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import Any

import pytest

Tally = Callable[[Mapping[str, float]], None]
_NAME = "campaign"


@pytest.fixture
def tally(record_property: Callable[[str, object], None]) -> Tally:
    """Return what takes note of figures by name: whole numbers are added up, of others the largest counts."""
    return lambda figures: record_property(_NAME, dict(figures))


def summed(reports: list[Any]) -> dict[str, dict[str, float]]:
    """Return the figures by test, those of its parameters together."""
    found: dict[str, dict[str, float]] = defaultdict(dict)
    for report in reports:
        figures = found[report.nodeid.partition("[")[0]] if report.user_properties else {}
        for name, noted in report.user_properties:
            for key, value in noted.items() if name == _NAME else ():
                before = figures.get(key, type(value)(0))
                figures[key] = before + value if isinstance(value, int) else max(before, value)
    return found


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say what the campaigns did."""
    reports = terminalreporter.getreports("passed") + terminalreporter.getreports("failed")
    found = summed([report for report in reports if report.when == "call"])
    for test, figures in sorted(found.items()):
        terminalreporter.write_line(f"{test}: " + ", ".join(f"{key} {figures[key]:.10g}" for key in figures))
