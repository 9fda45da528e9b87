"""Each example plans to its golden file, as far as processors round alike, and a value has one text."""

from __future__ import annotations

import builtins
import io
import sys
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from golden.regenerate import EXAMPLES, GOLDEN, difference_of, golden_file, rows_of
from planned_examples import planned_example
from tiers import few

from trajcli.curves import piecewise
from trajcli.job.read import load_job
from trajcli.output.report import report_of
from trajcli.planning.plan import plan_job

PATHS = sorted(EXAMPLES.glob("*.yaml"))
IDS = [path.stem for path in PATHS]
LONG = ("flying_cell", "pallet", "signals", "two_tools")
"""Planned over seconds."""
EACH = [pytest.param(path, id=path.stem, marks=[pytest.mark.full] * (path.stem in LONG)) for path in PATHS]
SEARCHED = ("waypoints",)
"""Searched for by linear algebra, which another NumPy rounds in another way: another motion as fast may be found."""
NUMPY = "2.4."
"""With which golden files are made."""


@cache
def rows_of_example(name: str) -> bytes:
    return rows_of(planned_example(name))


def test_there_is_one_golden_file_for_each_example() -> None:
    assert len(PATHS) >= 12
    assert {golden_file(path) for path in PATHS} == set(GOLDEN.glob("*.csv"))


@pytest.mark.full
@pytest.mark.parametrize("example", EACH)
def test_rows_are_the_golden_ones(example: Path, tmp_path: Path) -> None:
    now = tmp_path / "now.csv"
    now.write_bytes(rows_of(planned_example(example.stem)))
    golden = golden_file(example)
    if example.stem in SEARCHED and not np.__version__.startswith(NUMPY):
        ours, theirs = (np.loadtxt(file, delimiter=",", skiprows=1) for file in (now, golden))
        assert ours[-1, 0] == pytest.approx(theirs[-1, 0], rel=1e-3)
        return
    difference = difference_of(now, golden)
    assert difference.equal, difference.first
    assert now.read_bytes().partition(b"\n")[0] == golden.read_bytes().partition(b"\n")[0]


@pytest.mark.full
@pytest.mark.parametrize("example", EACH)
def test_every_example_verifies_and_reports(example: Path) -> None:
    assert report_of(planned_example(example.stem)).verdict == "verified"


def _by_horner(
    breaks: np.ndarray, table: np.ndarray, t: np.ndarray, piece: np.ndarray, out: np.ndarray
) -> None:
    out[:] = piecewise.horner(table[:, piece, :], (t - breaks[piece])[:, None])


def _lowest_power_first(
    breaks: np.ndarray, table: np.ndarray, t: np.ndarray, piece: np.ndarray, out: np.ndarray
) -> None:
    local = (t - breaks[piece])[:, None]
    out[:] = 0.0
    for power, row in enumerate(table[::-1, piece, :]):
        out += row * local**power


def _highest_power_first(
    breaks: np.ndarray, table: np.ndarray, t: np.ndarray, piece: np.ndarray, out: np.ndarray
) -> None:
    local = (t - breaks[piece])[:, None]
    out[:] = 0.0
    for power, row in reversed(list(enumerate(table[::-1, piece, :]))):
        out += row * local**power


@pytest.mark.parametrize("example", few(EACH, 10))
@pytest.mark.parametrize("order", [_by_horner, _lowest_power_first, _highest_power_first])
def test_the_order_of_evaluation_does_not_show(
    example: Path, order: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """But where a value is a half unit of the last decimal to the last bits, which one in 10^4 may be by chance."""
    calls = []

    def evaluate(*arguments: np.ndarray) -> None:
        calls.append(arguments[2].size)
        order(*arguments)

    plan = planned_example(example.stem)  # searched for motions have last bits of their own
    rows = rows_of_example(example.stem)
    monkeypatch.setattr(piecewise, "_evaluate_block", evaluate)
    other = rows_of(plan)
    if other != rows:
        a, b = (np.loadtxt(io.BytesIO(text), delimiter=",", skiprows=1) for text in (rows, other))
        units = np.rint(np.abs(a - b) * 1e9)
        assert units.max() <= 1
        assert units.sum() <= 1 + 1e-4 * units.size
    assert sum(calls) >= rows.count(b"\n") - 1


@pytest.mark.parametrize("example", few(PATHS, 3), ids=few(IDS, 3))
def test_no_float_is_added_by_the_function_that_another_python_rounds_otherwise(
    example: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From Python 3.12 on `sum` compensates the roundings of floats: `math.fsum` gives the same in all."""
    added = []

    def watched(values: Iterable[Any], /, start: Any = 0) -> Any:
        total = add(values, start)
        caller = sys._getframe(1)
        if type(total) is float and caller.f_globals["__name__"].startswith("trajcli"):
            added.append((caller.f_globals["__name__"], caller.f_lineno))
        return total

    add = builtins.sum
    monkeypatch.setattr(builtins, "sum", watched)
    plan_job(load_job(example))
    assert added == []
