"""Rows at knots: joined again by scipy they are the planned curve; in each format alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import random_jobs
from scipy.interpolate import BPoly

import trajcli
from trajcli.errors import TrajcliError
from trajcli.grids import KnotGrid
from trajcli.job.read import load_job
from trajcli.knots import knots_of
from trajcli.output.delivery.joined import write_plan
from trajcli.output.write import grid_of, write_rows
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.recorded_motion import MotionFile, open_motion

EXAMPLES = Path(__file__).parents[2] / "examples"
SMOOTH = ("cycloidal", "jerk_limited", "quintic", "septic", "waypoints")


def planned(name: str, *sets: str) -> Plan:
    with np.errstate(all="ignore"):
        return plan_job(load_job(str(EXAMPLES / f"{name}.yaml"), sets))


def missed(plan: Plan, motion: MotionFile) -> float:
    """Return by how much scipy's quintics through the rows miss the planned curve, rad or m."""
    rows = motion.whole()
    t = rows.t - rows.t[0]
    curve = BPoly.from_derivatives(t, np.stack([rows.q, rows.qd, rows.qdd], axis=1))
    times = np.linspace(0.0, min(plan.trajectory.duration, t[-1]), 4001)
    return float(np.abs(curve(times) - plan.trajectory.curve.evaluate(times)).max())


@pytest.mark.full
@pytest.mark.parametrize("ending", ["csv", "jsonl", "mcap", "yaml"])
def test_rows_at_knots_are_the_curve_in_every_format(ending: str, tmp_path: Path) -> None:
    plan, file = (
        planned("ur5e_pick", "output.rows=knots", "output.units={angle: rad}"),
        tmp_path / f"k.{ending}",
    )
    write_plan(plan, str(file), "full" if ending == "csv" else "fixed")
    motion = open_motion(str(file))
    assert motion.rows == knots_of(plan.trajectory).nanoseconds.size
    assert missed(plan, motion) < 1e-9


@pytest.mark.full
@pytest.mark.parametrize("ending", ["csv", "jsonl", "mcap", "yaml"])
def test_rows_of_a_rate_and_at_knots_hold_both(ending: str, tmp_path: Path) -> None:
    plan, file = planned("ur5e_pick", "output={rows: both, rate: 125}"), tmp_path / f"b.{ending}"
    write_plan(plan, str(file))
    stamps = open_motion(str(file)).whole().t
    uniform = np.append(np.arange(0.0, plan.trajectory.duration, 1 / 125), plan.trajectory.duration)
    for wanted in (uniform, knots_of(plan.trajectory).times):
        near = np.abs(stamps[:, None] - wanted).min(axis=0)
        assert near.max() <= 1.001e-6
    assert np.diff(stamps).min() > 0.999e-6
    assert missed(plan, open_motion(str(file))) < (1e-9 if ending != "csv" else 1e-8)


def test_a_message_takes_the_rows_of_a_rate(tmp_path: Path) -> None:
    plan, file = planned("ur5e_pick", "output={rows: rate, rate: 50}"), tmp_path / "rate.yaml"
    write_plan(plan, str(file))
    rows = open_motion(str(file)).whole()
    assert len(rows.t) == grid_of(plan).count
    np.testing.assert_allclose(
        rows.q, plan.trajectory.curve.evaluate(np.minimum(rows.t, plan.trajectory.duration))
    )


def knots_are_the_curve(seeds: range, folder: Path) -> int:
    jobs = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        fields = random_jobs.random_job(rng, SMOOTH[seed % len(SMOOTH)], 3, rest=True, unlimited=0.0)
        fields |= {"when_over_limit": "slow", "output": {"rows": "knots"}}
        try:
            with np.errstate(all="ignore"):
                plan = plan_job(random_jobs.loaded(fields))
        except TrajcliError:
            continue
        if not plan.verdict.passed or plan.trajectory.duration > 1e3:
            continue
        grid, file = grid_of(plan), folder / "knots.csv"
        assert isinstance(grid, KnotGrid)
        write_rows(plan, grid, str(file), "full")
        degree = plan.trajectory.curve.coefficients.shape[0] - 1
        assert missed(plan, open_motion(str(file))) < (1e-9 if degree <= 5 else 1.01e-6), seed
        jobs += 1
    return jobs


@pytest.mark.full
def test_knots_of_random_motions_are_their_curves(tmp_path: Path) -> None:
    assert knots_are_the_curve(range(10), tmp_path) >= 5


@pytest.mark.soak
def test_knots_of_random_motions_at_length(tmp_path: Path) -> None:
    assert knots_are_the_curve(range(1000, 1400), tmp_path) >= 150


@pytest.mark.full
def test_batch_and_python_take_rows(tmp_path: Path) -> None:
    job = str(EXAMPLES / "ur5e_pick.yaml")
    (done,) = trajcli.batch([job], tmp_path, rows="knots", processes=1)
    assert done.output is not None
    count = knots_of(planned("ur5e_pick").trajectory).nanoseconds.size
    assert open_motion(done.output).rows == count
    assert trajcli.batch([job], tmp_path, rows="knots", processes=1)[0].outcome == "unchanged"
    assert trajcli.batch([job], tmp_path, processes=1)[0].outcome == "written"
    trajcli.plan(job, rows="knots").save(tmp_path / "python.csv")
    assert open_motion(tmp_path / "python.csv").rows == count
