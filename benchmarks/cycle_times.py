"""`python -m benchmarks.cycle_times`: how long programs with zones last by different rules, as a table."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from benchmarks import flying_programs as programs
from benchmarks.corner_rules import justblend, pilz

_HEAD = ("program", "zone", "stopping", "Pilz's rule, slowed", "justblend", "trajcli", "bound")
_PROGRAMS: tuple[tuple[str, Callable[[float], Any], tuple[float, ...], float], ...] = (
    ("pick and place of a UR5e, joint moves", programs.pick, (10.0, 20.0, 50.0), 1e-3),
    ("corner of two joint moves, planar arm", programs.planar_joints, (0.02, 0.05), 1.0),
    ("corner of two lines, planar arm", programs.planar_lines, (0.02, 0.05), 1.0),
    ("pallet of a UR5e, lines and joint moves", programs.pallet, (20.0, 50.0), 1e-3),
)


@dataclass(frozen=True)
class CycleTimes:
    """Durations of one program without its holds, s; None where a rule has no answer.

    Attributes:
        stopping: With a stop at each corner.
        pilz: By Pilz's rule, slowed evenly until limits are kept.
        justblend: By justblend.
        ours: As planned and verified.
        bound: Below which no motion through the zones is; None for none.
        method: Of the bound: proven, second_order; None for none.
    """

    stopping: float
    pilz: float | None
    justblend: float | None
    ours: float
    bound: float | None
    method: str | None


def cycle_times(job: dict[str, Any], metres: float) -> CycleTimes:
    """Return the durations of a job with a zone whose unit is so many metres."""
    from trajcli.job.read import job_from_text
    from trajcli.output.report import report_of
    from trajcli.planning.plan import plan_job

    stopping = plan_job(job_from_text(json.dumps(programs.without_zones(job))))
    flying = plan_job(job_from_text(json.dumps(job)))
    if not flying.verdict.passed:
        raise RuntimeError(f"not verified: {flying.verdict.findings}")
    holds = sum(move["duration"] for move in job["moves"] if move["planner"] == "hold")
    chains = list(_chains(stopping.moves, job["moves"]))
    zone = job["zone"] * metres
    joints = all(move["planner"] in ("jerk_limited", "hold") for move in job["moves"])
    zones = report_of(flying).flyby
    if zones is None:
        raise RuntimeError("no corner is flown by")
    return CycleTimes(
        stopping.trajectory.duration - holds,
        _sum(pilz(chain, [zone] * (len(chain) - 1)) for chain in chains),
        _sum(justblend(chain, [zone] * (len(chain) - 1)) for chain in chains) if joints else None,
        flying.trajectory.duration - holds,
        None if zones.bound is None else zones.bound.duration - holds,
        None if zones.bound is None else zones.bound.method,
    )


def _chains(moves: Sequence[Any], entries: Sequence[dict[str, Any]]) -> Iterator[list[Any]]:
    """Yield the moves between two stops."""
    chain: list[Any] = []
    for move, entry in zip(moves, entries, strict=True):
        if entry["planner"] == "hold":
            yield chain
            chain = []
        else:
            chain.append(move)
    yield chain


def _sum(durations: Iterator[float | None]) -> float | None:
    """Return the sum, None where one has no duration."""
    total = 0.0
    for duration in durations:
        if duration is None or duration != duration:
            return None
        total += duration
    return total


def _row(name: str, zone: str, times: CycleTimes) -> str:
    cells = [
        f"{times.stopping:.4f}",
        "" if times.pilz is None else f"{times.pilz:.4f}",
        "" if times.justblend is None else f"{times.justblend:.4f}",
        f"**{times.ours:.4f}**",
        "" if times.bound is None else f"{times.bound:.4f} {times.method}",
    ]
    return f"| {' | '.join([name, zone, *cells])} |"


def _random_row(count: int) -> str:
    """Return the row of medians of random programs, in parts of their durations with stops."""
    found = []
    for seed in range(1, count + 1):
        found.append(cycle_times(programs.random_joint_moves(seed), 1e-3))
        print(f"{seed}: {found[-1]}", file=sys.stderr, flush=True)
    columns = [
        [getattr(each, name) / each.stopping for each in found if getattr(each, name) is not None]
        for name in ("stopping", "pilz", "justblend", "ours", "bound")
    ]
    cells = [
        f"{median(shares):.3f} ({min(shares):.3f} to {max(shares):.3f}, n = {len(shares)})"
        for shares in columns[1:]
    ]
    cells[2] = f"**{cells[2]}**"
    methods = ", ".join(sorted({each.method for each in found if each.method is not None}))
    name = f"{count} random programs of three joint moves, UR5e, parts of stopping: median (range)"
    return f"| {' | '.join([name, '10 to 80 mm', '1', *cells])} {methods} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--random", type=int, default=100, metavar="N", help="how many random programs")
    options = parser.parse_args()
    print(f"| {' | '.join(_HEAD)} |")
    print("|---|---|" + "---:|" * (len(_HEAD) - 2))
    for name, program, zones, metres in _PROGRAMS:
        for zone in zones:
            times = cycle_times(program(zone), metres)
            print(_row(name, f"{zone * metres * 1e3:g} mm", times), flush=True)
    if options.random:
        print(_random_row(options.random))


if __name__ == "__main__":
    main()
