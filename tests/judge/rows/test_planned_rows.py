"""Rows of the verified motion: known as such in every format, at any rate; with a fault planted, never."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
import random_jobs
from numpy.typing import NDArray
from tiers import few

from trajcli.errors import TrajcliError
from trajcli.job.read import load_job
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.output.write import write_plan
from trajcli.planners import PLANNERS
from trajcli.planning.plan import Plan, plan_job

EXAMPLES = Path(__file__).parents[3] / "examples"
TAGS = [tag for tag in sorted(PLANNERS) if tag not in random_jobs.ALONG_PATHS]
Rows = NDArray[np.float64]


def planned(path: Path, *sets: str) -> Plan:
    with np.errstate(all="ignore"):
        return plan_job(load_job(str(path), sets))


def judged(plan: Plan, file: Path) -> Judgement:
    return check_file(str(file), CheckOptions(), plan).judgement


def random_plan(seed: int) -> Plan | None:
    """Return the plan of a random job that moves for a while; None where there is none."""
    rng = np.random.default_rng(seed)
    fields = random_jobs.random_job(
        rng, TAGS[seed % len(TAGS)], int(rng.integers(2, 5)), rest=bool(rng.random() < 0.7), unlimited=0.05
    )
    fields |= {"output": {"rate": int(rng.choice([500, 250, 125, 100, 30]))}, "when_over_limit": "slow"}
    if TAGS[seed % len(TAGS)] in ("blends", "cubic", "spline", "trapezoid"):  # their accelerations may step
        fields["limits"] = {"jerk": None}
    try:
        with np.errstate(all="ignore"):
            plan = plan_job(random_jobs.loaded(fields))
    except TrajcliError:
        return None
    moves = 0.2 < plan.trajectory.duration < 6.0 and plan.loaded.job.moves[0].tag != "hold"
    return plan if plan.verdict.passed and moves else None


@pytest.mark.parametrize("name", ["cubic", "recorded", "screw", "sync", "ur5e_pose_columns", "waypoints"])
def test_examples_are_known_by_their_rows(name: str, tmp_path: Path) -> None:
    plan, file = planned(EXAMPLES / f"{name}.yaml"), tmp_path / "rows.csv"
    write_plan(plan, str(file))
    found = judged(plan, file)
    assert (found.planned_rows, found.passed) == (True, True)


@pytest.mark.soak
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
@pytest.mark.parametrize("ending", ["csv", "jsonl", "mcap", "yaml"])
def test_every_example_is_known_in_every_format(path: Path, ending: str, tmp_path: Path) -> None:
    plan, file = planned(path), tmp_path / f"rows.{ending}"
    write_plan(plan, str(file))
    found = judged(plan, file)
    assert (found.planned_rows, found.passed) == (True, True)


@pytest.mark.parametrize("ending", ["jsonl", "mcap", "yaml"])
@pytest.mark.parametrize("name", ["scara_pick", "ur5e_pick"])
def test_every_format_is_known(name: str, ending: str, tmp_path: Path) -> None:
    plan, file = planned(EXAMPLES / f"{name}.yaml"), tmp_path / f"rows.{ending}"
    write_plan(plan, str(file))
    assert judged(plan, file).planned_rows is True


@pytest.mark.parametrize(
    "sets",
    [
        ["output.rate=333.3"],
        ["output.rate=7", "output.start_time=12.345"],
        ["output.rate=0.05"],
        ["output.rate=1000", "output.align=true"],
        ["output.rate=50", "output.columns=[t, q, qddd]"],
    ],
    ids=lambda sets: sets[0],
)
def test_any_rate_and_start_are_known(sets: list[str], tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    write_plan(planned(EXAMPLES / "ur5e_pick.yaml", *sets), str(file))
    other = [text for text in sets if "align" in text]  # the file's rate is nobody's but its own
    found = judged(planned(EXAMPLES / "ur5e_pick.yaml", "output.rate=100", *other[:0]), file)
    assert found.planned_rows is (not other)


def test_listed_times_are_known(tmp_path: Path) -> None:
    file, times = tmp_path / "rows.csv", "output={times: [0.1, 0.25, 0.7, 1.1]}"
    plan = planned(EXAMPLES / "ur5e_pick.yaml", times)
    write_plan(plan, str(file))
    assert judged(plan, file).planned_rows is True
    without = planned(EXAMPLES / "ur5e_pick.yaml")
    assert judged(without, file).planned_rows is False


@pytest.mark.parametrize("ending", ["csv", "jsonl", "mcap", "yaml"])
def test_a_plan_of_no_duration_is_read_again(ending: str, tmp_path: Path) -> None:
    fields = {"version": 1, "robot": {"joints": 2}, "limits": {"velocity": 1, "acceleration": 2, "jerk": 20}}
    fields |= {
        "start": {"joints": [0.1, 0.2]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.1, 0.2]}}],
    }
    plan, file = plan_job(random_jobs.loaded(fields)), tmp_path / f"rows.{ending}"
    write_plan(plan, str(file))
    found = judged(plan, file)
    assert (found.rows, found.planned_rows, found.verdict) == (1, True, "satisfied")


def missing(rows: Rows, rng: np.random.Generator) -> Rows:
    return np.delete(rows, rng.integers(0, len(rows)), axis=0)


def doubled(rows: Rows, rng: np.random.Generator) -> Rows:
    row = int(rng.integers(0, len(rows)))
    return np.insert(rows, row, rows[row], axis=0)


def later(rows: Rows, rng: np.random.Generator) -> Rows:
    rows[rng.integers(1, len(rows)), 0] += 1e-6
    return rows


def swapped(rows: Rows, rng: np.random.Generator) -> Rows:
    del rng
    joints = (rows.shape[1] - 1) // 3
    order = [0] + [1 + joints * k + (j + 1) % joints for k in range(3) for j in range(joints)]
    return rows[:, order]


def off(rows: Rows, rng: np.random.Generator) -> Rows:
    rows[rng.integers(0, len(rows)), rng.integers(1, rows.shape[1])] += 1e-5 * rng.choice([-1, 1])
    return rows


def backward(rows: Rows, rng: np.random.Generator) -> Rows:
    del rng
    rows[:, 1:] = rows[::-1, 1:]
    return rows


def shorter(rows: Rows, rng: np.random.Generator) -> Rows:
    del rng
    return rows[: len(rows) // 2]


FAULTS: tuple[Callable[[Rows, np.random.Generator], Rows], ...] = (
    missing,
    doubled,
    later,
    swapped,
    off,
    backward,
    shorter,
)


def faults_are_found(seeds: Sequence[int], folder: Path) -> int:
    """Plant every fault into the rows of random jobs; return how many jobs there were."""
    jobs, file = 0, folder / "rows.csv"
    before: tuple[Plan, Rows] | None = None
    for seed in seeds:
        plan = random_plan(seed)
        if plan is None:
            continue
        write_plan(plan, str(file))
        head, *lines = file.read_text().splitlines()
        rows = np.array([[float(text) for text in line.split(",")] for line in lines])
        if len(rows) < 6:
            continue
        found = judged(plan, file)
        assert (found.planned_rows, found.passed) == (True, True), (seed, found.notes)
        for name, faulty in planted(rows, seed):
            if np.array_equal(faulty, rows):  # joints that move alike may be swapped
                continue
            text = (",".join(f"{value:.9f}" for value in row) for row in faulty)
            file.write_text("\n".join([head, *text]) + "\n")
            assert judged(plan, file).planned_rows is False, (seed, name)
        if before is not None and before[1].shape[1] == rows.shape[1]:
            assert judged(before[0], file).planned_rows is False
        jobs, before = jobs + 1, (plan, rows)
    return jobs


def planted(rows: Rows, seed: int) -> Iterator[tuple[str, Rows]]:
    for fault in FAULTS:
        yield fault.__name__, fault(rows.copy(), np.random.default_rng(seed))


def test_rows_with_a_fault_are_never_those_of_the_motion(tmp_path: Path) -> None:
    assert faults_are_found(few(range(14), 6), tmp_path) >= 2


@pytest.mark.soak
@pytest.mark.parametrize("block", range(20))
def test_rows_with_a_fault_at_length(block: int, tmp_path: Path) -> None:
    assert faults_are_found(range(1000 + 100 * block, 1100 + 100 * block), tmp_path) >= 35
