"""What edited motions have to keep: limits of moves and of the tool, jumps that are new, how far curves are apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.requirements import kept_limits, new_jumps, worst_deviation
from trajcli.errors import InputError
from trajcli.job.read import LoadedJob
from trajcli.planning.plan import Plan, plan_job

JOB = """\
version: 1
robot: {robot}
{limits}
start: {{joints: 0}}
moves:
  - {{planner: quintic, to: {{joints: 0.1}}, duration: 1}}
  - {{planner: quintic, to: {{joints: 0.2}}, duration: 1{of_move}}}
"""
TOOL = "limits: {tcp: {speed: 9}}"


def read(path: Path, text: str) -> EditedMotion:
    path.write_text(text)
    return read_motion(str(path), ReadingOptions(units="rad"))


@pytest.mark.parametrize(
    ("robot", "limits", "of_move", "judged"),
    [
        ("ur5e", "", "", False),
        ("ur5e", TOOL, "", True),
        ("ur5e", "", f", {TOOL}", True),
        ("{joints: 2}", TOOL, "", False),
    ],
)
def test_the_tool_is_judged_where_a_limit_of_it_is_in_force_in_any_move(
    tmp_path: Path, robot: str, limits: str, of_move: str, judged: bool
) -> None:
    (tmp_path / "job.yaml").write_text(JOB.format(robot=robot, limits=limits, of_move=of_move))
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    assert (kept.requirements.tool is not None) == judged
    assert kept.plan is not None


def test_each_move_has_the_limits_that_are_in_force_in_it(tmp_path: Path) -> None:
    text = JOB.format(
        robot="{joints: 2}", limits="limits: {velocity: 3}", of_move=", limits: {velocity: [1, 2]}"
    )
    (tmp_path / "job.yaml").write_text(text)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    highest = {move: arm.limits.velocity[:, 1].tolist() for move, arm in kept.requirements.by_move.items()}
    assert highest == {0: [3, 3], 1: [1, 2]}
    assert kept.robot.limits.velocity[:, 1].tolist() == [3, 3]
    with pytest.raises(InputError, match="exclude each other"):
        kept_limits(str(tmp_path / "job.yaml"), "ur5e")


def test_moves_of_rows_are_those_at_their_times_unless_the_file_says_them(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB.format(robot="{joints: 1}", limits="", of_move=""))
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    silent = kept.with_moves(read(tmp_path / "silent.csv", "t,q1\n0,0\n0.5,0.05\n1.5,0.15\n2,0.2\n"))
    assert silent.rows.move is not None
    assert silent.rows.move.tolist() == [0, 0, 1, 1]
    said = kept.with_moves(read(tmp_path / "said.csv", "t,q1,move\n0,0,1\n0.5,0.05,1\n2,0.2,0\n"))
    assert said.rows.move is not None
    assert said.rows.move.tolist() == [1, 1, 0]


def test_moves_of_rows_for_a_consumer_are_at_the_times_of_its_plan(tmp_path: Path) -> None:
    """It needs 1.5 s for each move; a file of another duration says nothing."""
    of_move = ", limits: {velocity: 1}"
    (tmp_path / "job.yaml").write_text(JOB.format(robot="{joints: 1}", limits="", of_move=of_move))
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    asked = []

    def delivered(loaded: LoadedJob, profile: str | None, form: str) -> Plan:
        asked.append((profile, form))
        longer = [move.model_copy(update={"duration": 1.5}) for move in loaded.job.moves]
        return plan_job(replace(loaded, job=loaded.job.model_copy(update={"moves": longer})))

    rows = read(tmp_path / "rows.csv", "t,q1\n0,0\n1.2,0.08\n1.8,0.12\n3,0.2\n")
    named = kept.with_moves(rows, delivered).rows.move
    assert named is not None
    assert named.tolist() == [0, 0, 1, 1]
    assert asked == [("ros-jtc", "csv")]
    assert kept.with_moves(rows).rows.move is None
    other = read(tmp_path / "other.csv", "t,q1\n0,0\n1.2,0.08\n1.8,0.12\n3.1,0.2\n")
    assert kept.with_moves(other, delivered).rows.move is None


def parabolas(path: Path, *signs: float) -> EditedMotion:
    """Write joints that move by t^2, with a sign before each of their velocities that may be wrong."""
    names = [f"{name}{k + 1}" for name in ("q", "qd") for k in range(len(signs))]
    rows = [
        [t, *[t**2] * len(signs), *(sign * 2 * t for sign in signs)] for t in np.linspace(0, 1, 201).tolist()
    ]
    return read(
        path, ",".join(["t", *names]) + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows)
    )


def test_only_what_is_wrong_with_another_joint_is_new(tmp_path: Path) -> None:
    before, after = parabolas(tmp_path / "a.csv", -1, 1), parabolas(tmp_path / "b.csv", -1, -1)
    assert new_jumps(before, before) == []
    assert new_jumps(after, before) == []
    joints = {problem.joint for problem in new_jumps(before, after)}
    assert joints == {"j2"}
    assert all(str(tmp_path / "a.csv") in problem.text() for problem in new_jumps(before, after))


def test_what_is_rounded_is_judged_as_it_is_written(tmp_path: Path) -> None:
    """Velocities of one decimal are right as far as it says; those of the other sign are wrong."""
    motion = parabolas(tmp_path / "a.csv", 1)
    rounded = tuple(replace(c, decimals=1) if c.quantity == "qd" else c for c in motion.columns)
    assert new_jumps(motion, motion) == []
    assert new_jumps(motion, replace(motion, columns=rounded)) == [], (
        "as far as their decimals say they are right"
    )
    wrong = replace(motion, rows=replace(motion.rows, qd=-motion.rows.qd))
    assert {problem.joint for problem in new_jumps(motion, wrong)} == {"j1"}


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("begin", [0.0, -0.75, 0.4])
def test_curves_are_apart_by_what_dense_times_show(tmp_path: Path, begin: float, swapped: bool) -> None:
    """Straight lines between rows: the largest distance is at a row of one of them, and of either sign."""
    generator = np.random.default_rng(6)
    motions = []
    for name, times in (("a", np.arange(5.0)), ("b", begin + np.array([0, 0.7, 1.9, 3.2, 3.3]))):
        q = generator.normal(size=(5, 2)) * [0.1, -1] + [0, 2.0 * (name == "b")]
        rows = (f"{t!r},{x!r},{y!r}" for t, (x, y) in zip(times.tolist(), q.tolist(), strict=True))
        motions.append(read(tmp_path / f"{name}.csv", "t,q1,q2\n" + "\n".join(rows) + "\n"))
    first, second = motions[::-1] if swapped else motions
    low, high = (edge(each.rows.t[at] for each in motions) for edge, at in ((max, 0), (min, -1)))
    breaks = np.concatenate([each.rows.t for each in motions])
    times = np.unique(
        np.concatenate([np.linspace(low, high, 2001), breaks[(breaks >= low) & (breaks <= high)]])
    )
    apart = np.abs(first.curve().evaluate(times) - second.curve().evaluate(times)).max(axis=0)
    joint, largest = worst_deviation(first, second)
    assert (joint, largest) == (1, pytest.approx(apart.max(), rel=1e-12))


def test_curves_that_agree_at_all_rows_differ_between_them(tmp_path: Path) -> None:
    """q = t^2 (1 - t)^2 has its rows at zero, without velocity; the line there is 1/16 away in the middle."""
    flat = read(tmp_path / "flat.csv", "t,q1,qd1,qdd1\n0,0,0,0\n1,0,0,0\n")
    bent = read(tmp_path / "bent.csv", "t,q1,qd1,qdd1\n0,0,0,2\n1,0,0,2\n")
    joint, largest = worst_deviation(flat, bent)
    assert (joint, largest) == (0, pytest.approx(1 / 16))
