"""Payload capacity on the command line: `trajcli payload`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from trajcli.cli.numbers import numbers
from trajcli.cli.outcome import print_json, print_lines
from trajcli.cli.progress import progress
from trajcli.errors import Amount
from trajcli.job.read import LoadedJob, load_job
from trajcli.planning.payload_capacity import PayloadCapacity, payload_capacity
from trajcli.units import Quantity, effort_unit, to_user

if TYPE_CHECKING:
    from trajcli.cli.job_commands import PayloadCommand


def run_payload(options: PayloadCommand) -> int:
    """Print the largest mass with which a job verifies, and what binds; return the exit code.

    Raises:
        InputError: When there is no such move, or no effort is limited.
        TrajcliError: Of the job.
    """
    loaded = load_job(options.job, options.override)
    planned = None
    if loaded.job.output.consumer is not None:
        from trajcli.output.delivery.delivered import plan_of

        planned = lambda job, carried: plan_of(job, None, carried)  # noqa: E731
    with progress():
        capacity = payload_capacity(loaded, options.at, planned)
    if options.as_json:
        names = ("mass", "joint", "move", "time", "effort", "limit", "cause")
        com = None if capacity.com is None else capacity.com.tolist()
        found = {name: getattr(capacity, name) for name in names}
        print_json({**found, "com": com, "moves": _carrying(loaded, capacity)})
    else:
        print_lines(_lines(loaded, capacity))
    return 0


def _carrying(loaded: LoadedJob, capacity: PayloadCapacity) -> list[int]:
    return [k for k in capacity.moves if not loaded.job.moves[k].handles]


def _lines(loaded: LoadedJob, capacity: PayloadCapacity) -> Iterator[str]:
    where = "at the centres of mass that the job says"
    if capacity.com is not None:
        com = [to_user(x, Quantity("length"), loaded.units) for x in capacity.com.tolist()]
        where = f"at [{', '.join(numbers([x]) for x in com)}] {loaded.units.length} of the tcp"
    carried = _carrying(loaded, capacity)
    moves = f"move{'s' * (len(carried) > 1)} {', '.join(map(str, carried))}"
    if capacity.mass is None:
        yield f"any mass {where} will do in {moves}" if carried else "any mass will do: no move carries it"
        return
    mass = Amount(capacity.mass, rounded="down", digits=6)  # one that verifies
    yield f"largest mass {where} in {moves}: {mass} kg"
    if capacity.joint is None or capacity.effort is None:
        yield f"  with more, {capacity.cause}"
        return
    unit = effort_unit(loaded.robot.joint_types[loaded.robot.joint_names.index(capacity.joint)])
    when = "" if capacity.time is None else f", t = {capacity.time:.6g} s"
    limit = "" if capacity.limit is None else f", its limit is {capacity.limit:.9g} {unit}"
    needed = f"{capacity.joint} needs {capacity.effort:.6g} {unit}"
    yield f"  with more, {needed} in move {capacity.move}{when}{limit}"
