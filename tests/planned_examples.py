"""Plans of the examples, each made once in a process: what tests ask of them does not change them."""

from functools import cache
from pathlib import Path

from trajcli.job.read import load_job
from trajcli.planning.plan import Plan, plan_job

EXAMPLES = Path(__file__).parents[1] / "examples"


@cache
def planned_example(name: str) -> Plan:
    """Return the plan of `examples/NAME.yaml`."""
    return plan_job(load_job(EXAMPLES / f"{name}.yaml"))
