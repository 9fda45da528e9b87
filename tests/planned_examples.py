"""Plans that several tests ask for, each made once in a process: what tests ask of them does not change them."""

from functools import cache
from pathlib import Path

import pytest

from trajcli.job.read import LoadedJob, load_job
from trajcli.planning.plan import Carried, Plan, plan_job

EXAMPLES = Path(__file__).parents[1] / "examples"
_PLANS: dict[tuple[str, ...], Plan] = {}


@cache
def planned_example(name: str) -> Plan:
    """Return the plan of `examples/NAME.yaml`."""
    return planned_once(load_job(EXAMPLES / f"{name}.yaml"))


def planned_once(loaded: LoadedJob, carried: Carried | None = None, *, advise: bool = True) -> Plan:
    """Return the plan of a job; of the same text, read from the same place with the same options, always the same."""
    if carried is not None:
        return plan_job(loaded, carried, advise=advise)
    read = (loaded.name, loaded.document.file, *loaded.document.lines)
    key = (*read, repr(loaded.job), repr(loaded.robot), repr(loaded.events), str(advise))
    if key not in _PLANS:
        _PLANS[key] = plan_job(loaded, advise=advise)
    return _PLANS[key]


def share_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the commands of a test share plans, where it is about what they make of a plan."""
    for module in ("trajcli.cli.plan", "trajcli.output.delivery.delivered", "trajcli.planning.plan"):
        monkeypatch.setattr(f"{module}.plan_job", planned_once)
