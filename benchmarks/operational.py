"""A line of the tool: the whole process, and the planning alone, which knows no rate."""

from __future__ import annotations

import sys

from benchmarks.contest import ROOT, Command, Function, compete
from benchmarks.figures import Figure
from benchmarks.forward_kinematics import ROWS as PUMA
from benchmarks.planning import NEEDED

SAMPLES = 10**5  # of 10 s at 10 kHz
_START = (-0.5, 0.6, -0.5, -0.2, -0.6, -0.4)
_WAY = (0.3, 0.4, 0.0)


def ours():
    """Prepare the planning of the line: joints, velocities and accelerations as one curve."""
    import numpy as np

    from trajcli.job.read import load_job
    from trajcli.trajectory import resting

    job = load_job(f"{ROOT}/benchmarks/line.yaml")
    planner, start = job.job.moves[0], resting(np.array(_START))
    return lambda: planner.plan(start, job.robot), lambda planned: planned.end.position


def eaik():
    """Prepare a loop that asks EAIK for all answers at every sample: positions only."""
    import numpy as np
    from eaik.IK_DH import DhRobot

    d, a, alpha = (np.array(column) for column in zip(*PUMA, strict=True))
    robot = DhRobot(alpha, a, d)
    start = robot.fwdKin(np.array(_START))
    part = np.linspace(0, 1, SAMPLES + 1)
    poses = np.tile(start, (part.size, 1, 1))
    poses[:, :3, 3] += np.multiply.outer(10 * part**3 - 15 * part**4 + 6 * part**5, _WAY)

    def run():
        last, rows = np.array(_START), np.empty((part.size, 6))
        for k, pose in enumerate(poses):
            answers = robot.IK(pose).Q
            last = answers[np.abs(answers - last).max(axis=1).argmin()]
            rows[k] = last
        return rows

    return run, lambda rows: rows[-1]


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against needed imports, the script of a toolbox's user, a loop over samples."""
    plan = [sys.executable, "-m", "trajcli", "plan", f"{ROOT}/benchmarks/line.yaml"]
    runs = compete(
        {
            "plan": Command(plan),
            "imports": Command([sys.executable, "-c", NEEDED]),
            "script": Command([peers, f"{ROOT}/benchmarks/line_script.py"], peer=True),
        }
    )
    seconds, script = runs["plan"].seconds, runs["script"]
    name, module = "line of 10 s at 1 kHz, whole process", "benchmarks.operational"
    found = [
        Figure(name, "import numpy, yaml, pydantic", seconds, runs["imports"].seconds, 2.5),
        Figure(name, "Robotics Toolbox ctraj + ik_LM", seconds, script.seconds, 0.11, skipped=script.skipped),
    ]
    runs = compete(
        {
            "ours": Function(sys.executable, module, "ours"),
            "loop": Function(peers, module, "eaik", peer=True),
        }
    )
    loop, name = runs["loop"], "planning of that line, 10 kHz"
    figure = Figure(
        name, "EAIK, sample by sample", runs["ours"].seconds, loop.seconds, 0.1, skipped=loop.skipped
    )
    return [*found, figure]
