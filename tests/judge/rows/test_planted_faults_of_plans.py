"""Rows of the verified motion with a fault planted at random: never known as such, in any format."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import random_jobs
import yaml
from mcap_ros2.writer import Writer
from numpy.typing import NDArray
from tiers import few

from trajcli.errors import InputError, TrajcliError
from trajcli.judge.file import CheckOptions, check_file
from trajcli.output.delivery.joined import write_plan
from trajcli.planners import PLANNERS
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.mcap.definitions import JOINT_STATE, definition_of
from trajcli.streams.recorded_motion import open_motion

TAGS = [tag for tag in sorted(PLANNERS) if tag not in random_jobs.ALONG_PATHS]
POINT = ("positions", "velocities", "accelerations")
Rows = NDArray[np.float64]
Fault = Callable[[Rows, int, np.random.Generator], Rows]


def known(plan: Plan, file: Path) -> bool | None:
    """Return whether rows are those of a plan; what is no motion at all is none of it."""
    try:
        return check_file(str(file), CheckOptions(), plan).judgement.planned_rows
    except InputError:
        return False


def random_plan(seed: int) -> Plan | None:
    """Return the plan of a random job that moves for a while; None where there is none."""
    rng = np.random.default_rng(seed)
    fields = random_jobs.random_job(
        rng, TAGS[seed % len(TAGS)], int(rng.integers(2, 5)), rest=bool(rng.random() < 0.7), unlimited=0.05
    )
    fields |= {"output": {"rate": int(rng.choice([200, 125, 100, 60, 30]))}, "when_over_limit": "slow"}
    if TAGS[seed % len(TAGS)] in ("blends", "cubic", "spline", "trapezoid"):  # their accelerations may step
        fields["limits"] = {"jerk": None}
    try:
        with np.errstate(all="ignore"):
            plan = plan_job(random_jobs.loaded(fields))
    except TrajcliError:
        return None
    moves = 0.2 < plan.trajectory.duration < 6.0 and plan.loaded.job.moves[0].tag != "hold"
    return plan if plan.verdict.passed and moves else None


def missing(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints
    return np.delete(rows, rng.integers(0, len(rows)), axis=0)


def doubled(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints
    row = int(rng.integers(0, len(rows)))
    return np.insert(rows, row, rows[row], axis=0)


def moved(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints
    rows[rng.integers(1, len(rows)), 0] += 1e-6 * rng.choice([-1, 1])
    return rows


def swapped(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    """Exchange two joints, in all their columns."""
    a, b = rng.choice(joints, 2, replace=False)
    order = np.arange(rows.shape[1])
    for k in range(1, rows.shape[1], joints):
        order[k + a], order[k + b] = k + b, k + a
    return rows[:, order]


def off(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints
    rows[rng.integers(0, len(rows)), rng.integers(1, rows.shape[1])] += 1e-5 * rng.choice([-1, 1])
    return rows


def backward(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints, rng
    rows[:, 1:] = rows[::-1, 1:]
    return rows


def shorter(rows: Rows, joints: int, rng: np.random.Generator) -> Rows:
    del joints, rng
    return rows[: len(rows) // 2]


FAULTS: tuple[Fault, ...] = (missing, doubled, moved, swapped, off, backward, shorter)


def take_csv(file: Path) -> tuple[list[str], Rows]:
    head, *lines = file.read_text(encoding="utf-8").splitlines()
    return head.split(","), np.array([[float(text) for text in line.split(",")] for line in lines])


def put_csv(names: Sequence[str], rows: Rows, file: Path) -> None:
    text = (",".join(f"{value:.9f}" for value in row) for row in rows)
    file.write_text("\n".join([",".join(names), *text]) + "\n", encoding="utf-8")


def take_lines(file: Path) -> tuple[list[str], Rows]:
    lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return list(lines[0]), np.array(
        [[line["t"], *(v for k in lines[0] if k != "t" for v in line[k])] for line in lines]
    )


def put_lines(names: Sequence[str], rows: Rows, file: Path) -> None:
    n = (rows.shape[1] - 1) // (len(names) - 1)
    lines = (
        {"t": row[0], **{name: row[1 + k * n : 1 + (k + 1) * n] for k, name in enumerate(names[1:])}}
        for row in rows.tolist()
    )
    file.write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")


def take_message(file: Path) -> tuple[list[str], Rows]:
    message = yaml.load(file.read_text(encoding="utf-8"), yaml.CSafeLoader)
    rows = [
        [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"]]
        + [value for name in POINT for value in point[name]]
        for point in message["points"]
    ]
    return message["joint_names"], np.array(rows)


def put_message(names: Sequence[str], rows: Rows, file: Path) -> None:
    n = len(names)
    points = [
        {
            **{name: row[1 + k * n : 1 + (k + 1) * n] for k, name in enumerate(POINT)},
            "time_from_start": stamp(row),
        }
        for row in rows.tolist()
    ]
    file.write_text(json.dumps({"joint_names": list(names), "points": points}), encoding="utf-8")


def take_log(file: Path) -> tuple[list[str], Rows]:
    motion = open_motion(file).whole()
    assert motion.joints is not None
    assert motion.qd is not None
    return list(motion.joints), np.hstack([motion.t[:, None], motion.q, motion.qd])


def put_log(names: Sequence[str], rows: Rows, file: Path) -> None:
    """Write positions and velocities as the library of MCAP does."""
    n = len(names)
    with file.open("wb") as stream:
        writer = Writer(stream)
        schema = writer.register_msgdef(JOINT_STATE, definition_of(JOINT_STATE))
        for row in rows.tolist():
            state = {"name": list(names), "position": row[1 : 1 + n], "velocity": row[1 + n :], "effort": []}
            message = {"header": {"stamp": stamp(row), "frame_id": ""}, **state}
            time = round(row[0] * 1e9)
            writer.write_message("/joint_states", schema, message, log_time=time, publish_time=time)
        writer.finish()


def take_array(file: Path) -> tuple[list[str], Rows]:
    found = np.load(file)
    names = list(found.dtype.names if file.suffix == ".npy" else found)
    return names, np.hstack([np.reshape(found[name], (len(found["t"]), -1)) for name in names])


def put_array(names: Sequence[str], rows: Rows, file: Path) -> None:
    n = (rows.shape[1] - 1) // (len(names) - 1)
    parts = {name: rows[:, 1 + k * n : 1 + (k + 1) * n] for k, name in enumerate(names[1:])}
    if file.suffix == ".npz":
        np.savez(file, t=rows[:, 0], **parts)
        return
    table = np.empty(len(rows), [("t", "f8"), *((name, "f8", (n,)) for name in parts)])
    for name, values in {"t": rows[:, 0], **parts}.items():
        table[name] = values
    np.save(file, table)


def stamp(row: Sequence[float]) -> dict[str, int]:
    return dict(zip(("sec", "nanosec"), divmod(round(row[0] * 1e9), 10**9), strict=True))


FORMATS = {
    "csv": (take_csv, put_csv),
    "jsonl": (take_lines, put_lines),
    "yaml": (take_message, put_message),
    "mcap": (take_log, put_log),
    "npy": (take_array, put_array),
    "npz": (take_array, put_array),
}


def faults_are_found(seeds: Sequence[int], ending: str, folder: Path) -> int:
    """Plant every fault into the rows of random jobs; return how many jobs there were."""
    jobs, file = 0, folder / f"rows.{ending}"
    take, put = FORMATS[ending]
    before: tuple[Plan, int] | None = None
    for seed in seeds:
        plan = random_plan(seed)
        if plan is None:
            continue
        write_plan(plan, str(file))
        names, rows = take(file)
        joints = len(plan.loaded.robot.joints)
        if len(rows) < 6:
            continue
        put(names, rows, file)
        assert known(plan, file) is True, (seed, ending)
        for fault in FAULTS:
            faulty = fault(rows.copy(), joints, np.random.default_rng(seed))
            if not np.array_equal(faulty, rows):  # joints that move alike may be swapped
                put(names, faulty, file)
                assert known(plan, file) is False, (seed, ending, fault.__name__)
        put(names, rows, file)
        if before is not None and before[1] == joints:
            assert known(before[0], file) is False, (seed, ending)
        jobs, before = jobs + 1, (plan, joints)
    return jobs


@pytest.mark.parametrize("ending", FORMATS)
def test_rows_with_a_fault_are_never_those_of_the_motion(ending: str, tmp_path: Path) -> None:
    first = list(FORMATS).index(ending)
    assert faults_are_found(few(range(first, 20, 2), 2), ending, tmp_path) >= 1


@pytest.mark.soak
@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("block", range(20))
def test_rows_with_a_fault_at_length(block: int, ending: str, tmp_path: Path) -> None:
    assert faults_are_found(range(1000 + 100 * block, 1100 + 100 * block), ending, tmp_path) >= 20
