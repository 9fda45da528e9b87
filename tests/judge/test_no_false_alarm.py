"""Random motions that keep their limits give no false alarm: as rows, and as our own CSV and MCAP files."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import random_jobs
from recorded_rows import part
from tally import Tally
from tiers import QUICK

from trajcli.errors import TrajcliError
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.output.delivery.joined import write_plan
from trajcli.planners import PLANNERS
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

TAGS = [tag for tag in sorted(PLANNERS) if tag not in ("arc", "line", "path", "screw")]
ONCE = json.loads((Path(__file__).parent / "recordings/false_alarms.json").read_text())
LONGEST = 4.0  # s: of a longer motion there are only more rows alike


@cache
def verified_plan(seed: int) -> Plan | None:
    """Return the plan of a random job, at a random rate; None where it has none, or breaks a limit."""
    return plan_of(random_fields(seed))


def random_fields(seed: int) -> random_jobs.Fields:
    rng = np.random.default_rng(seed)
    fields = random_jobs.random_job(rng, TAGS[seed % len(TAGS)], int(rng.integers(1, 7)))
    fields["output"] = {"rate": int(rng.choice([1000, 500, 250, 125, 100]))}
    return fields


def plan_of(fields: random_jobs.Fields) -> Plan | None:
    try:
        with np.errstate(all="ignore"):
            plan = plan_job(random_jobs.loaded(fields))
    except TrajcliError:
        return None
    return plan if plan.verdict.passed and 0.02 < plan.trajectory.duration < LONGEST else None


def rows_of(plan: Plan, orders: int, decimals: int | None) -> RecordedMotion:
    """Return the rows of a plan, with as many derivatives and decimals as asked for."""
    rows = plan.trajectory.sample(plan.loaded.job.output.rate)
    states = [rows.q, rows.qd, rows.qdd][:orders]
    n, late = rows.q.shape[1], 0.0
    off, stamps = np.zeros(n), rows.t
    if decimals is not None:
        states = [np.round(values, decimals) for values in states]
        off, late, stamps = np.full(n, 0.5 * 10.0**-decimals), 0.5e-9, np.round(rows.t, 9)
    resolution = Resolution(late, off, off, off)
    return RecordedMotion(
        stamps, *states, *[None] * (3 - orders), None, None, np.zeros(len(stamps), int), None, resolution, "-"
    )


def check_rows(seed: int) -> bool:
    """Return whether there was a motion to check."""
    plan = verified_plan(seed)
    return plan is not None and check_plan(plan, seed)


def check_plan(plan: Plan, seed: int) -> bool:
    """Judge the rows of a plan, rounded as the seed says."""
    rng = np.random.default_rng([seed, 1])
    orders, decimals = int(rng.integers(1, 4)), [None, 9, 6][int(rng.integers(0, 3))]
    motion = rows_of(plan, orders, decimals)
    size = int(rng.choice([300, 1000, 10**6]))
    blocks = [part(motion, slice(low, low + size)) for low in range(0, len(motion.t), size)]
    required = Requirements(plan.loaded.robot, {move.index: move.robot for move in plan.moves})
    judgement = judge_motion(lambda: blocks, required)
    alarms = [f for f in judgement.findings if (f.severity, f.certainty) == ("error", "exceeded")]
    assert alarms == [], (seed, orders, decimals, [alarm.text() for alarm in alarms])
    return True


DRAWN, WRITTEN = (3, 25, 46, 70), (509, 520, 531, 553)  # of which there is a motion: most draws have none


def test_rows_give_no_false_alarm() -> None:
    seeds = DRAWN if QUICK else range(80)
    assert sum(check_rows(seed) for seed in seeds) >= len(seeds) / 16


@pytest.mark.parametrize("seed", [21674, 23368])
def test_motions_that_once_were_false_alarms(seed: int) -> None:
    """A law that changes within the first interval; an acceleration that leaves and returns between two rows."""
    plan = plan_of(ONCE[str(seed)])
    assert plan is not None
    assert check_plan(plan, seed)


@pytest.mark.soak
@pytest.mark.parametrize("block", range(100))
def test_rows_give_no_false_alarm_at_length(block: int, tally: Tally) -> None:
    checked = sum(check_rows(1000 + 400 * block + seed) for seed in range(400))
    tally({"motions drawn": 400, "motions checked": checked})
    assert checked > 30


@pytest.mark.parametrize("ending", ["csv", "mcap", "jsonl", "yaml"])
def test_our_own_files_give_no_false_alarm(ending: str, tmp_path: Path) -> None:
    seeds, checked = WRITTEN if QUICK else range(500, 560), 0
    for seed in seeds:
        plan = verified_plan(seed)
        if plan is None or plan.trajectory.duration > 2.0:
            continue
        job, path = tmp_path / "job.yaml", tmp_path / f"rows{seed}.{ending}"
        job.write_text("\n".join(plan.loaded.document.lines))
        try:
            write_plan(plan, str(path))
        except TrajcliError:  # such as a goal that ends in motion
            continue
        judgement = check_file(str(path), CheckOptions(job=str(job))).judgement
        alarms = [f for f in judgement.findings if (f.severity, f.certainty) == ("error", "exceeded")]
        assert alarms == [], (seed, [alarm.text() for alarm in alarms])
        checked += 1
    assert checked >= len(seeds) / 15
