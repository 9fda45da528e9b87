"""Logs of examples, written once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.job.read import load_job
from trajcli.output.recording import LogOptions
from trajcli.output.write import grid_of, write_rows
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.mcap.read import LoggedMotion, log_blocks

ARRAYS = ("times", "position", "velocity", "acceleration", "effort")
EXAMPLES = Path(__file__).parents[3] / "examples"


def plan_of(name: str, *overrides: str) -> Plan:
    return plan_job(load_job(str(EXAMPLES / f"{name}.yaml"), overrides))


def read_mcap(path: Path, topic: str | None = None, field: str | None = None) -> LoggedMotion:
    """Return the motion of a topic, its blocks joined."""
    with path.open("rb") as stream:
        blocks = list(log_blocks(stream, str(path), topic, field))
    joined = [np.concatenate([getattr(block, name) for block in blocks]) for name in ARRAYS]
    return LoggedMotion(blocks[0].topic, blocks[0].joint_names, *joined)


def write_log(plan: Plan, path: Path, **options: str) -> Path:
    write_rows(plan, grid_of(plan), str(path), "fixed", log=LogOptions(**options))
    return path


ALL = "/joint_trajectory_point,/tool_twist"


@pytest.fixture(scope="session")
def pick() -> Plan:
    return plan_of("ur5e_pick")


@pytest.fixture(scope="session")
def pick_log(pick: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of an arm with base and tool, all topics in it, uncompressed."""
    return write_log(pick, tmp_path_factory.mktemp("log") / "pick.mcap", topics=ALL, compression="none")
