"""Rows of the verified motion: known as such in every format, at any rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import random_jobs
from planned_examples import planned_once

from trajcli.editing.edited_motion import ReadingOptions, read_motion
from trajcli.editing.writing import write_motion
from trajcli.job.read import load_job
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job

EXAMPLES = Path(__file__).parents[3] / "examples"


def planned(path: Path, *sets: str) -> Plan:
    with np.errstate(all="ignore"):
        return planned_once(load_job(str(path), sets))


def judged(plan: Plan, file: Path) -> Judgement:
    return check_file(str(file), CheckOptions(), plan).judgement


@pytest.mark.parametrize("name", ["cubic", "recorded", "screw", "sync", "ur5e_pose_columns", "blends"])
def test_examples_are_known_by_their_rows(name: str, tmp_path: Path) -> None:
    plan, file = planned(EXAMPLES / f"{name}.yaml"), tmp_path / "rows.csv"
    write_plan(plan, str(file))
    found = judged(plan, file)
    assert (found.planned_rows, found.passed) == (True, True)


@pytest.mark.soak
@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
@pytest.mark.parametrize("ending", ["csv", "jsonl", "mcap", "yaml", "npy", "npz"])
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


@pytest.mark.parametrize("ending", ["jsonl", "mcap", "npz", "yaml"])
@pytest.mark.parametrize("over", [0.0, 2e-9])
def test_rows_of_nine_decimals_are_known_where_all_digits_are_written(
    ending: str, over: float, tmp_path: Path
) -> None:
    plan, file = planned(EXAMPLES / "gantry.yaml", "output.columns=[t, q, qd, qdd]"), tmp_path / "rows.csv"
    write_plan(plan, str(file))
    motion = read_motion(str(file), ReadingOptions(), joints=plan.loaded.robot.joint_names)
    assert motion.rows.qdd is not None
    motion.rows.qdd[7, 1] += over
    write_motion(motion, str(tmp_path / f"rows.{ending}"))
    assert judged(plan, tmp_path / f"rows.{ending}").planned_rows is (over == 0.0)
