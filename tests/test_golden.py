"""Each example plans to its golden file, byte by byte, in whatever order the polynomials are evaluated."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from golden.regenerate import EXAMPLES, GOLDEN, golden_file, rows_of
from planned_examples import planned_example

from trajcli.comparison.difference import compare
from trajcli.curves import piecewise
from trajcli.output.report import report_of
from trajcli.streams.table import read_csv

PATHS = sorted(EXAMPLES.glob("*.yaml"))
IDS = [path.stem for path in PATHS]


def test_there_is_one_golden_file_for_each_example() -> None:
    assert len(PATHS) >= 12
    assert {golden_file(path) for path in PATHS} == set(GOLDEN.glob("*.csv"))


@pytest.mark.parametrize("example", PATHS, ids=IDS)
def test_rows_are_the_golden_ones(example: Path, tmp_path: Path) -> None:
    now = tmp_path / "now.csv"
    now.write_bytes(rows_of(planned_example(example.stem)))
    difference = compare(read_csv(str(now)), read_csv(str(golden_file(example))), {}, {})
    assert difference.equal, difference.first
    assert now.read_bytes() == golden_file(example).read_bytes()


@pytest.mark.parametrize("example", PATHS, ids=IDS)
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


@pytest.mark.parametrize("example", PATHS, ids=IDS)
@pytest.mark.parametrize("order", [_by_horner, _lowest_power_first, _highest_power_first])
def test_the_order_of_evaluation_does_not_show(
    example: Path, order: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def evaluate(*arguments: np.ndarray) -> None:
        calls.append(arguments[2].size)
        order(*arguments)

    plan = planned_example(example.stem)  # searched for motions have last bits of their own
    monkeypatch.setattr(piecewise, "_evaluate_block", evaluate)
    assert rows_of(plan) == golden_file(example).read_bytes()
    assert sum(calls) >= golden_file(example).read_bytes().count(b"\n") - 1
