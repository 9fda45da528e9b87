"""Judgement of a recorded motion, against the reading of its numbers and the planning of its pieces."""

from __future__ import annotations

import atexit
import sys
import tempfile
from pathlib import Path

from benchmarks.contest import Command, Function, Runs, compete
from benchmarks.figures import MEGABYTE, Figure

ROWS, LONG_ROWS, JOINTS, PIECES = 10**5, 10**6, 6, 1000
MOST_MEMORY = 300.0  # MB, of the whole process
_FOLDER = Path(tempfile.gettempdir()) / "trajcli-benchmark-checking"


def _motion_file(rows: int, orders: int) -> Path:
    """Return a file of smooth motions of six joints, with so many quantities of each; written once."""
    import numpy as np

    path = _FOLDER / f"motion-{rows}-{orders}.csv"
    if not path.exists():
        _FOLDER.mkdir(exist_ok=True)
        t = np.arange(rows) / 1000
        angles = np.outer(t, 0.3 * np.arange(1, JOINTS + 1))
        rates = 0.3 * np.arange(1, JOINTS + 1)
        states = [0.8 * np.sin(angles), 0.8 * rates * np.cos(angles), -0.8 * rates**2 * np.sin(angles)]
        names = [f"{kind}{joint + 1}" for kind in ("q", "qd", "qdd")[:orders] for joint in range(JOINTS)]
        table = np.column_stack([t, *states[:orders]])
        np.savetxt(path, table, "%.9f", ",", header=",".join(["t", *names]), comments="")
    return path


def _checked(rows: int, orders: int):
    from trajcli.judge.file import CheckOptions, check_file

    path = str(_motion_file(rows, orders))
    options = CheckOptions(robot="ur5e")
    return lambda: check_file(path, options).judgement, lambda judgement: [float(judgement.rows)]


def _loaded(rows: int, orders: int):
    import numpy as np

    path = _motion_file(rows, orders)
    return lambda: np.loadtxt(path, delimiter=",", skiprows=1), lambda table: [float(len(table))]


def positions():
    """Prepare the check of positions alone."""
    return _checked(ROWS, 1)


def positions_loadtxt():
    """Prepare the reading of the same numbers."""
    return _loaded(ROWS, 1)


def states():
    """Prepare the check of positions, velocities and accelerations."""
    return _checked(ROWS, 3)


def states_loadtxt():
    """Prepare the reading of the same numbers."""
    return _loaded(ROWS, 3)


def long_positions():
    """Prepare the check of a million rows."""
    return _checked(LONG_ROWS, 1)


def long_positions_loadtxt():
    """Prepare the reading of the same numbers."""
    return _loaded(LONG_ROWS, 1)


def long_states():
    """Prepare the check of a million rows of positions, velocities and accelerations."""
    return _checked(LONG_ROWS, 3)


def long_states_loadtxt():
    """Prepare the reading of the same numbers."""
    return _loaded(LONG_ROWS, 3)


def _points():
    import numpy as np

    return np.random.default_rng(0).uniform(-0.05, 0.05, (PIECES + 1, JOINTS)).cumsum(axis=0)


def pieces():
    """Prepare the judgement of 1000 quintic pieces."""
    import numpy as np

    from trajcli.curves.splines.cubic import natural
    from trajcli.judge.arrays import judge_arrays, requirements_of

    t = 0.2 * np.arange(PIECES + 1)
    q, qd, qdd = natural(t, _points()).evaluate_orders(np.asarray(t), (0, 1, 2)).transpose(1, 0, 2)
    required = requirements_of("ur5e", {"acceleration": 9.0}, None, q)
    return lambda: judge_arrays(t, q, qd, qdd, *required), lambda judgement: [float(judgement.rows)]


def _job_of_pieces() -> str:
    """Return the path of a job whose only move has 1000 pieces."""
    points = _points().tolist()
    through = "\n".join(f"  - {{joints: {q}, time: {0.2 * (k + 1)!r}}}" for k, q in enumerate(points[1:]))
    file = tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False)  # noqa: SIM115
    atexit.register(Path(file.name).unlink, missing_ok=True)
    head = f"version: 1\nrobot: ur5e\nlimits: {{acceleration: 9}}\nstart: {{joints: {points[0]}}}\n"
    with file:
        file.write(f"{head}moves:\n- planner: spline\n  rule: natural\n  through:\n{through}\n")
    return file.name


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: time against np.loadtxt, peak memory, and pieces against the plan that has them."""
    del peers
    prefix, rows = ("long_", LONG_ROWS) if long else ("", ROWS)
    found = []
    for name in ("positions", "states"):
        parts = (prefix + name, f"{prefix}{name}_loadtxt")
        runs = compete({part: Function(sys.executable, "benchmarks.checking", part) for part in parts})
        title = f"check 10^{len(str(rows)) - 1} x 6 {name}"
        found.append(Figure(title, "np.loadtxt", runs[parts[0]].seconds, runs[parts[1]].seconds, 3.0))
    command = [sys.executable, "-m", "trajcli", "check", str(_motion_file(rows, 3)), "--robot", "ur5e"]
    peak = compete({"check": Command(command)}, repeats=1)["check"].peaks
    nothing = [0.0] * len(peak)
    found.append(Figure("memory of that", "-", peak, nothing, MOST_MEMORY * MEGABYTE, kind="memory"))
    plan = Command([sys.executable, "-m", "trajcli", "plan", _job_of_pieces(), "--no-output"])
    judged = Function(sys.executable, "benchmarks.checking", "pieces")
    ours, theirs = _both(judged, plan)
    found.append(Figure(f"judge {PIECES} pieces", "trajcli plan", ours.seconds, theirs.seconds, 0.1))
    return found


def _both(first: Function, second: Command) -> tuple[Runs, Runs]:
    runs = compete({"ours": first, "theirs": second})
    return runs["ours"], runs["theirs"]
