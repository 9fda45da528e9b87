"""Cost of jobs of many moves: linear in their number."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from counted_calls import calls_of

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.read import job_from_text, load_job
from trajcli.knots import knots_of
from trajcli.planning.plan import plan_job


def _calls(moves: int) -> int:
    """Return how many functions, those of C counted, a job of so many moves calls."""
    lines = [f"  - {{planner: quintic, to: {{joints: [{k % 7}, {k % 5}]}}}}" for k in range(moves)]
    head = "version: 1\nrobot: {joints: 2}\nlimits: {velocity: 2, acceleration: 15, jerk: 100}\n"
    loaded = job_from_text(head + "start: {joints: [9, 9]}\nmoves:\n" + "\n".join(lines))
    return calls_of(lambda: plan_job(loaded))


@pytest.mark.full
def test_calls_grow_as_the_number_of_moves() -> None:
    _calls(5)  # what is made once
    few, more, many = (_calls(moves) for moves in (35, 105, 315))
    assert many - more < 1.02 * 3 * (more - few)


def test_one_time_on_a_curve_of_many_pieces_costs_no_look_at_all_of_them() -> None:
    pieces = 200_000
    rng = np.random.default_rng(5)
    curve = PiecewisePolynomial(np.arange(pieces + 1.0), rng.normal(size=(6, pieces, 2)))
    tracemalloc.start()
    try:
        value = curve.evaluate(np.array([0.25, 0.75]) + pieces // 3, 1)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    expected = np.array(
        [np.polyval(np.polyder(column), [0.25, 0.75]) for column in curve.coefficients[:, pieces // 3].T]
    )
    np.testing.assert_allclose(value, expected.T, rtol=1e-12)
    assert peak < curve.coefficients.nbytes / 100


def _peak(moves: int) -> int:
    """Return the largest number of bytes in use while a job of so many moves, of two motions, is planned."""
    to = ("[1, 0.5]", "[0, 0]")
    lines = "".join(f"      - {{planner: quintic, to: {{joints: {joints}}}}}\n" for joints in to)
    head = "version: 1\nrobot: {joints: 2}\nlimits: {velocity: 2, acceleration: 15, jerk: 100}\n"
    loaded = job_from_text(
        f"{head}start: {{joints: [0, 0]}}\nmoves:\n  - repeat: {moves // 2}\n    moves:\n{lines}"
    )
    tracemalloc.start()
    try:
        plan = plan_job(loaded)
        knots_of(plan.trajectory)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.full
def test_a_million_moves_are_planned_within_two_gibibytes(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (
        "knots._BLOCK",
        "checks.continuity._BLOCK",
        "checks.target._BLOCK",
        "curves.extrema._PARTS",
        "curves.piecewise._ROWS",
    ):
        monkeypatch.setattr(f"trajcli.{name}", 256)  # so that a few thousand moves are many
    _peak(256)  # what is made once
    each = (_peak(1536) - _peak(768)) / 768
    assert 100 < each < 1700  # bytes; the job as it is read, and what is imported, are below 400 more


def _peak_of_points(folder: Path, points: int) -> int:
    """Return the most memory in use while a spline through recorded points is planned, bytes."""
    rng = np.random.default_rng(points)
    rows = np.column_stack([0.1 * np.arange(points), rng.uniform(-1, 1, (points, 6))])
    start = ", ".join(f"{position:.6f}" for position in rows[0, 1:])
    (folder / "points.csv").write_text(
        "t,q1,q2,q3,q4,q5,q6\n" + "\n".join(",".join(f"{x:.6f}" for x in row) for row in rows) + "\n"
    )
    (folder / "job.yaml").write_text(
        "version: 1\nrobot: {joints: 6}\nlimits: {velocity: 1e6, acceleration: 1e9}\noutput: {rate: 1}\n"
        f"start: {{joints: [{start}]}}\nmoves:\n"
        "  - {planner: spline, rule: clamped, through: {csv: points.csv}}\n"
    )
    loaded = load_job(str(folder / "job.yaml"))
    tracemalloc.start()
    try:
        assert plan_job(loaded).verdict.passed
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_points_take_little_more_memory_than_their_curve(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a million points that is what decides; blocks are made small, so that a few thousand are many."""
    for name in (
        "checks.continuity._BLOCK",
        "checks.target._BLOCK",
        "curves.extrema._PARTS",
        "curves.piecewise._ROWS",
        "curves.splines.cubic._ROWS",
        "curves.splines.cubic._VALUES",
    ):
        monkeypatch.setattr(f"trajcli.{name}", 256)
    each = (_peak_of_points(tmp_path, 2000) - _peak_of_points(tmp_path, 1000)) / 1000
    of_curve = 8 * (4 * 6 + 1)  # bytes: four coefficients of each of six joints, and a break
    assert of_curve < each < 2.6 * of_curve  # zeros that nobody writes to are counted too, and are most of it
