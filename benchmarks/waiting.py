"""What people wait for: answers of whole processes that plan a job many times, or a job of many moves."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.contest import ROOT, Command, Function, compete
from benchmarks.figures import MEGABYTE, Figure

PICK, POINTS = f"{ROOT}/examples/pick_carry_place.yaml", f"{ROOT}/examples/waypoints.yaml"
QUINTIC = f"{ROOT}/benchmarks/quintic.yaml"
MOVES, WAYPOINTS = 10_000, 1_000_000
_HEAD = (
    "version: 1\nrobot: {joints: 6}\nlimits: {velocity: 3, acceleration: 10, jerk: 60}\noutput: {rate: 10}\n"
)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against the plan of the same job, and in seconds."""
    with TemporaryDirectory() as folder:
        return [*_answers(), *_report(), *_many(Path(folder)), *(_waypoints(Path(folder)) if long else ())]


def _answers() -> list[Figure]:
    found = []
    for words, against, goal in (
        (["payload", PICK], ["plan", "-q", PICK], 4.0),
        (["explain", "--sensitivity", POINTS], ["explain", POINTS], 3.0),
        (["robots"], ["plan", "-q", QUINTIC], 1.0),
    ):
        runs = compete({"ours": _trajcli(*words), "against": _trajcli(*against)})
        name, peer = (" ".join(Path(word).name for word in each) for each in (words, against))
        found.append(Figure(name, peer, runs["ours"].seconds, runs["against"].seconds, goal))
    return found


def plan():
    """Prepare the plan of a time-optimal move."""
    from trajcli.job.read import load_job
    from trajcli.planning.plan import plan_job

    job = load_job(f"{ROOT}/examples/time_optimal.yaml")
    return lambda: plan_job(job), _shown


def report():
    """Prepare the report of that plan, as JSON."""
    from trajcli.job.read import load_job
    from trajcli.output.report import report_of
    from trajcli.planning.plan import plan_job

    made = plan_job(load_job(f"{ROOT}/examples/time_optimal.yaml"))
    return lambda: report_of(made).model_dump_json(), _shown


def _shown(_result):
    return []


def _report() -> list[Figure]:
    module = "benchmarks.waiting"
    runs = compete({name: Function(sys.executable, module, name) for name in ("report", "plan")})
    own, peer = "report of a time-optimal move as JSON", "its plan"
    return [Figure(own, peer, runs["report"].seconds, runs["plan"].seconds, 0.2)]


def _many(folder: Path) -> list[Figure]:
    jobs = {count: _job(folder / f"moves_{count}.yaml", "quintic", count) for count in (MOVES // 10, MOVES)}
    runs = compete({str(count): _trajcli("plan", "-q", job) for count, job in jobs.items()})
    ours, few = runs[str(MOVES)], runs[str(MOVES // 10)]
    name = f"plan of {MOVES} quintic moves"
    kinds = ("jerk_limited", "quintic")
    jerky, smooth = compete(
        {k: _trajcli("plan", "-q", _job(folder / f"{k}.yaml", k, 200)) for k in kinds}
    ).values()
    return [
        Figure(name, "seconds", ours.seconds, [], 5.0, kind="seconds"),
        Figure(name, f"{MOVES // 10} moves", ours.seconds, few.seconds, 10.0),
        Figure("plan of 200 jerk-limited moves", "quintic", jerky.seconds, smooth.seconds, 2.0),
    ]


def _waypoints(folder: Path) -> list[Figure]:
    """Return the peak memory of a plan through very many points."""
    rows = (
        ",".join(f"{position:.6f}" for position in (0.1 * k, *at)) for k, at in enumerate(_points(WAYPOINTS))
    )
    (folder / "points.csv").write_text("t,q1,q2,q3,q4,q5,q6\n" + "\n".join(rows) + "\n")
    start = ", ".join(map(str, _points(1)[0]))
    head = "version: 1\nrobot: {joints: 6}\nlimits: {velocity: 1e6, acceleration: 1e9}\noutput: {rate: 1}\n"
    figures = []
    for rule in ("continuous_acceleration", "clamped"):
        job = folder / f"{rule}.yaml"
        move = f"  - {{planner: spline, rule: {rule}, through: {{csv: points.csv}}}}\n"
        job.write_text(f"{head}start: {{joints: [{start}]}}\nmoves:\n{move}")
        peaks = compete({"ours": _trajcli("plan", "-q", str(job))}, repeats=1)["ours"].peaks
        name = f"peak memory, spline {rule} through {WAYPOINTS} points"
        figures.append(Figure(name, "nothing", peaks, [0.0], 400 * MEGABYTE, kind="memory"))
    return figures


def _job(file: Path, planner: str, count: int) -> str:
    duration = ", duration: 3" if planner == "quintic" else ""
    moves = [f"  - {{planner: {planner}, to: {{joints: {at}}}{duration}}}\n" for at in _points(count)]
    file.write_text(f"{_HEAD}start: {{joints: [0, 0, 0, 0, 0, 0]}}\nmoves:\n{''.join(moves)}")
    return str(file)


def _points(count: int) -> list[list[float]]:
    import random

    draw = random.Random(1)
    return [[round(draw.uniform(-1.0, 1.0), 3) for _ in range(6)] for _ in range(count)]


def _trajcli(*words: str) -> Command:
    return Command([sys.executable, "-m", "trajcli", *words])
