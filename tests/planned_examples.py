"""Plans that several tests ask for, each made once in a process: what tests ask of them does not change them."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.planning.plan import Carried, Plan, plan_job

EXAMPLES = Path(__file__).parents[1] / "examples"
_PLANS: dict[tuple[str, ...], Plan] = {}


@cache
def planned_example(name: str) -> Plan:
    """Return the plan of `examples/NAME.yaml`."""
    return planned_once(load_job(EXAMPLES / f"{name}.yaml"))


@cache
def flown_cell() -> Plan:
    """Return the plan of `examples/flying_cell.yaml` without what its gripper does: three moves, two zones."""
    job = yaml.safe_load((EXAMPLES / "flying_cell.yaml").read_text(encoding="utf-8"))
    return _planned_text(yaml.safe_dump({**job, "moves": job["moves"][::4]}))


@cache
def _planned_text(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned_with_output(text: str, output: str) -> Plan:
    """Return the plan of a job with what it says of its rows: rate and columns, on which no motion depends."""
    return replace(_planned_text(text), loaded=job_from_text(f"{text}output: {output}\n"))


def planned_once(
    loaded: LoadedJob, carried: Carried | None = None, *, advise: bool = True, **adapted: Any
) -> Plan:
    """Return the plan of a job; of the same text, read from the same place with the same options, always the same.

    Of jobs that say other rows alone the motion is the same, too.
    """
    if carried is not None or adapted:
        return plan_job(loaded, carried, advise=advise, **adapted)
    output = loaded.job.output
    rows = {"columns": None, "times": None, "rows": None} | ({} if output.align else {"rate": None})
    motion = loaded.job.model_copy(update={"output": output.model_copy(update=rows)})
    read = (loaded.name, loaded.document.file, *loaded.document.lines)
    key = (*read, repr(motion), repr(loaded.robot), repr(loaded.events), str(advise))
    if key not in _PLANS:
        _PLANS[key] = plan_job(loaded, advise=advise)
    found = _PLANS[key]
    return found if repr(found.loaded.job) == repr(loaded.job) else replace(found, loaded=loaded)


def share_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the commands of a test share plans, where it is about what they make of a plan."""
    for module in ("trajcli.cli.plan", "trajcli.output.delivery.delivered", "trajcli.planning.plan"):
        monkeypatch.setattr(f"{module}.plan_job", planned_once)
