"""The closed forms give the same answers as two other methods, no more and no fewer: sampled polynomials, and EAIK.

Turns are left out and limits ignored. An answer counts for itself from 1e-6 rad or m on. Poses of which two answers
are less than 1e-4 apart are left out, two in a thousand at most: rounding decides there whether both exist.
"""

from __future__ import annotations

import importlib.util
import io
import os
import subprocess
import sys
import zlib
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from shutil import which

import numpy as np
import polynomial_answers as polynomials
import pytest
from inverse_arms import FAMILIES, WRIST, arm, gap, random_joints

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target

CLOSES = 1e-7  # m and rad: what an answer of the other methods may miss its target by
SAME = 1e-6  # rad or m: nearer answers are one
MERGING = 1e-4  # rad or m
POSITIONED = ("positioning", "planar 2R", "planar RP")  # families that a position is enough for
METHODS = {
    "planar 3R": polynomials.by_last_turn,
    "planar RPR": polynomials.by_last_turn,
    "SCARA": polynomials.by_last_turn,
    "elbow and pitch": polynomials.by_last_turn,
    "elbow, pitch and roll": polynomials.by_parallel_axes,
    "three parallel axes (UR)": polynomials.by_parallel_axes,
    "spherical wrist": polynomials.by_wrist,
}
BY_POSITION = [name for name in FAMILIES if FAMILIES[name][2] in POSITIONED]
TURNING = [name for name in FAMILIES if all(row[0] == "R" for row in FAMILIES[name][0])]
CASES = [*((name, "pose") for name in FAMILIES), *((name, "position") for name in BY_POSITION)]
PEER = """
import io, sys
import numpy as np
from eaik.IK_HP import HPRobot
data = np.load(io.BytesIO(sys.stdin.buffer.read()))
found = HPRobot(data["directions"], data["steps"]).IK_batched(data["poses"], 1)
answers = [np.reshape(each.Q, (-1, len(data["directions"]))) for each in found]
result = io.BytesIO()
np.savez(result, rows=np.repeat(np.arange(len(found)), [len(each) for each in answers]), q=np.concatenate(answers))
sys.stdout.buffer.write(result.getvalue())
"""


def random_poses(name, count):
    """Return an arm and poses, the last tenth those of an arm with longer links: some are out of reach."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    robot = arm(name, rng)
    links = [replace(joint, a=1.5 * joint.a) for joint in robot.joints[:3]]
    longer = replace(robot, joints=(*links, *robot.joints[3:]))
    own = forward(robot, random_joints(robot, rng, count))
    return robot, np.concatenate([own, forward(longer, random_joints(robot, rng, count // 10))])


def by_polynomials(robot, name, axes, home, goals):
    family = FAMILIES[name][2]
    if family in POSITIONED:
        return polynomials.position(axes, home[:3, 3], (goals @ home)[:, :3, 3])
    method = polynomials.by_shoulder if name == "spherical shoulder" else METHODS[family]
    return method(axes, goals)


def by_eaik(python, axes, home, goals):
    directions = np.array([axis.h for axis in axes])
    signs = np.ones(len(axes))
    for i, j in combinations(
        range(len(axes)), 2
    ):  # EAIK wants axes that are parallel to point in the same direction
        if directions[i] @ directions[j] < 1e-12 - 1.0:
            directions[j], signs[j] = -directions[j], -signs[j]
    points = np.array([np.zeros(3), *(axis.o for axis in axes), home[:3, 3]])
    poses = goals.copy()
    poses[:, :3, 3] = (goals @ home)[:, :3, 3]
    question = io.BytesIO()
    np.savez(question, directions=directions, steps=np.diff(points, axis=0), poses=poses)
    command = [python, "-c", PEER]
    answer = subprocess.run(command, input=question.getvalue(), stdout=subprocess.PIPE, check=True).stdout
    found = np.load(io.BytesIO(answer))
    return found["rows"], found["q"] * signs


def checked(robot, axes, home, goals, rows, q, kind):
    """Return candidates that meet their goals as joints (N, most, n) and which of these are answers (N, most)."""
    reached, wanted = polynomials.displacement(axes, q) @ home, (goals @ home)[rows]
    miss = np.abs(reached - wanted)[:, :3, 3 if kind == "position" else slice(None)]
    good = miss.max(axis=tuple(range(1, miss.ndim)), initial=0.0) < CLOSES
    order = np.flatnonzero(good)[np.argsort(rows[good], kind="stable")]
    rows, q = rows[order], q[order]
    at = np.arange(len(rows)) - np.searchsorted(rows, rows)
    joints = np.zeros((len(goals), at.max(initial=0) + 1, q.shape[1]))
    valid = np.zeros(joints.shape[:2], dtype=bool)
    joints[rows, at], valid[rows, at] = q, True
    for i, j in combinations(range(valid.shape[1]), 2):
        valid[:, j] &= ~(valid[:, i] & (gap(robot, joints[:, i], joints[:, j]) < SAME))
    return joints, valid


def nearest_pair(robot, joints, valid):
    """Return the distance (N,) of the two answers that are closest."""
    result = np.full(len(joints), np.inf)
    for i, j in combinations(range(valid.shape[1]), 2):
        both = valid[:, i] & valid[:, j]
        result = np.where(both, np.minimum(result, gap(robot, joints[:, i], joints[:, j])), result)
    return result


def both(robot, name, kind, poses, method):
    """Return joints (N, branches, n) and which of them are answers (N, branches), ours and another method's."""
    ours = solve(robot, poses if kind == "pose" else partial_target(poses[:, :3, 3]))
    axes, home = polynomials.arm_axes(robot)
    goals = np.linalg.inv(robot.base) @ poses @ np.linalg.inv(home)
    theirs = checked(robot, axes, home, goals, *method(robot, name, axes, home, goals), kind)
    return (ours.joints, ours.valid), theirs


def check(name, kind, count, method):
    robot, poses = random_poses(name, count)
    (ours, ours_valid), (theirs, theirs_valid) = both(robot, name, kind, poses, method)
    pair = nearest_pair(robot, ours, ours_valid)
    assert pair.min() > SAME
    clear = np.minimum(pair, nearest_pair(robot, theirs, theirs_valid)) > MERGING
    assert np.count_nonzero(~clear) <= 2 + len(poses) // 500
    found, expected = ours_valid.sum(axis=1), theirs_valid.sum(axis=1)
    different = np.flatnonzero(clear & (found != expected))
    assert not len(different), [(poses[i].tolist(), found[i], expected[i]) for i in different[:3]]
    gaps = np.where(ours_valid[:, None], gap(robot, theirs[:, :, None], ours[:, None]), np.inf)
    assert np.where(theirs_valid & clear[:, None], gaps.min(axis=2), 0.0).max() < SAME
    assert (expected[:count] > 0).all()


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_sampled_polynomials_have_as_many_answers(name, kind):
    check(name, kind, 150, by_polynomials)


@pytest.mark.soak
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_sampled_polynomials_have_as_many_answers_at_ten_thousand_poses(name, kind):
    check(name, kind, 10_000, by_polynomials)


@pytest.mark.soak
@pytest.mark.parametrize("name", TURNING)
def test_eaik_has_as_many_answers_at_ten_thousand_poses(name):
    python = python_with_eaik()
    check(name, "pose", 10_000, lambda _robot, _name, *arguments: by_eaik(python, *arguments))


def python_with_eaik():
    """Return an interpreter that has EAIK: this one, the one TRAJCLI_PEERS names, or that of `make bench`."""
    if importlib.util.find_spec("eaik"):
        return sys.executable
    usual = Path(__file__).parents[3] / ".venv-peers" / "bin" / "python"
    for python in (os.environ.get("TRAJCLI_PEERS"), str(usual)):
        if (
            python
            and which(python)
            and not subprocess.run([python, "-c", "import eaik"], check=False).returncode
        ):
            return python
    pytest.skip(
        "EAIK is in no environment: `make bench` installs it, or TRAJCLI_PEERS names a python that has it"
    )


UR_SLANTED = ["R 0 .16 0 1", "R 0 0 -.42 0", "R 0 0 -.39 0", "R 0 .13 0 .8", "R 0 .1 0 -.8", "R 0 .1 0 0"]
SLANTED = ["R 0 .4 .1 -1", "R 0 .05 .4 0", "R 0 .02 .05 1", "R 0 .4 0 -.8", "R 0 0 0 .8", "R 0 .1 .02 0"]
STANFORD = FAMILIES["wrist over Stanford"][0]
CLOSE = {  # rows, family, kind, joints, index of the one that brings a position or a direction to the axis of another
    "folded 2R": (["R 0 0 .3 0", "R 0 0 .3 0"], "planar 2R", "position", [0.3, np.pi], 1),
    "folded elbow": (
        ["R 0 .5 0 1", "R 0 0 .3 0", "R 0 0 .3 0"],
        "positioning",
        "position",
        [0.3, 0.5, np.pi],
        2,
    ),
    "short slide": (FAMILIES["planar RPR"][0], "planar RPR", "pose", [0.3, 0.0, 0.4], 1),
    "short slide below a wrist": (STANFORD, "spherical wrist", "pose", [0.3, 0.4, -0.2, 0.3, 0.4, 0.5], 2),
    "slanted wrist in line": (SLANTED, "spherical wrist", "pose", [0.3, 0.4, 0.1, 0.3, 0.0, 0.5], 4),
    "slanted UR in line": (UR_SLANTED, "three parallel axes (UR)", "pose", [0.3, 0.4, 0.9, 0.3, 0.0, 0.5], 4),
    "point above the shoulder": (
        ["R 0 .3 0 1", "R 0 .2 0 -.7", "R 0 .1 .4 0"],
        "positioning",
        "position",
        [0.3, 4.076477399, 0.759480056],
        1,
    ),
}


@pytest.mark.parametrize("close", [1e-4, 3e-5, 1e-5])
@pytest.mark.parametrize("name", CLOSE)
def test_what_is_close_to_an_axis_still_tells_its_angle(monkeypatch, name, close):
    rows, family, kind, joints, moved = CLOSE[name]
    monkeypatch.setitem(FAMILIES, name, (rows, 0, family))
    robot, joints = arm(name), np.array(joints)
    joints[moved] += close
    poses = forward(robot, joints)[None]
    (ours, ours_valid), (_, theirs_valid) = both(robot, name, kind, poses, by_polynomials)
    assert ours_valid.sum() == theirs_valid.sum()
    assert gap(robot, ours[0][ours_valid[0]], joints).min() < SAME


@pytest.mark.parametrize("close", [1e-4, 1e-5])
@pytest.mark.parametrize("name", ["two axes that meet", "elbow", "elbow on a slanted axis"])
def test_a_tcp_that_is_close_to_the_last_axis_tells_the_angle_about_it(monkeypatch, name, close):
    rows = FAMILIES[name][0]
    kind, theta, d, _, alpha = rows[2].split()
    close_row = f"{kind} {theta} {d} {close} {alpha}"
    monkeypatch.setitem(FAMILIES, "close", ([*rows[:2], close_row], 4, "positioning"))
    robot, joints = arm("close"), np.array([0.3, 0.7, 1.1])
    poses = forward(robot, joints)[None]
    (ours, ours_valid), (_, theirs_valid) = both(robot, "close", "position", poses, by_polynomials)
    assert ours_valid.sum() == theirs_valid.sum()
    assert gap(robot, ours[0][ours_valid[0]], joints).min() < SAME


@pytest.mark.parametrize(
    ("name", "count"), [("planar RP", 1), ("RRP Stanford", 1), ("RRP with a slanted slide", 2)]
)
def test_a_double_root_of_a_slide_is_one_answer(name, count):
    """Where the tcp is at the foot, on the slide's line, of the axis before it two lengths have met.

    The shoulder of a Stanford arm has another point to slide from; two axes that meet have two turns for each length.
    """
    robot = arm(name)
    axes, home = polynomials.arm_axes(robot)
    joints = np.array([0.3, 0.7, 0.0])[-len(axes) :]
    before, tip = axes[-2], home @ [0.0, 0.0, 0.0, 1.0]
    joints[-1] = -(tip[:3] - before.o) @ axes[-1].h
    found = solve(robot, partial_target(forward(robot, joints)[:3, 3]))
    answers = found.joints[found.valid]
    assert gap(robot, answers, joints).min() < 1e-6
    assert (np.abs(answers[:, -1] - joints[-1]) < 1e-6).sum() == count


def test_an_aim_that_is_too_near_for_a_slide_is_missed_by_what_lies_between():
    """No length of the slide brings the tcp nearer to the axis than its line is: the foot is the nearest point."""
    robot = arm("planar RP")
    axes, home = polynomials.arm_axes(robot)
    joints = np.array([0.7, -(home[:3, 3] - axes[0].o) @ axes[1].h])
    away = forward(robot, joints)[:3, 3] - axes[0].o
    away -= (away @ axes[0].h) * axes[0].h
    found = solve(robot, partial_target(forward(robot, joints)[:3, 3] - 0.6 * away))
    assert not found.valid.any()
    assert found.shortfall[0] == pytest.approx(0.6 * np.linalg.norm(away), rel=1e-9)


@pytest.mark.parametrize(("theta", "alpha"), [(0.7, 1.0), (-0.2, 0.6)])
def test_an_axis_of_roll_may_stand_anywhere(monkeypatch, theta, alpha):
    """Not only ahead of the arm, or at right angles to the three parallel axes."""
    rows = list(FAMILIES["elbow, pitch and roll"][0])
    rows[3] = f"R {theta} .02 .03 {alpha}"
    monkeypatch.setitem(FAMILIES, "askew", (rows, 4, "elbow, pitch and roll"))
    check("askew", "pose", 20, by_polynomials)


LIKE_OTHERS = {  # what keeps them from being of a family is one axis
    "4R whose last axis is turned": ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 .5", "R .4 .02 .1 0"],
    "5R whose fourth axis is turned": [
        *FAMILIES["elbow, pitch and roll"][0][:2],
        "R 0 0 .25 .4",
        "R 1 .02 .03 1",
        WRIST[2],
    ],
    "4R and a slide": [*FAMILIES["elbow, pitch and roll"][0][:4], "P 0 .15 .04 .3"],
    "slide across a slanted plane": ["R 0 0 0 .7", "P 0 0 0 -.7", "R 0 0 .2 0"],
    "RP slanted": ["R .2 0 0 .7", "P 0 0 .1 0"],
    "two slides along one axis": ["P 0 .1 0 0", "R 0 0 .3 0", "R 0 0 .2 0", "R 0 0 .1 .5"],
    "UR whose wrist does not meet": [*FAMILIES["UR"][0][:4], "R 0 .1 .05 -1", "R 0 .1 0 0"],
    "wrist with a slide": [*FAMILIES["wrist over elbow"][0][:3], *WRIST[:2], "P 0 .1 0 0"],
}


@pytest.mark.parametrize("name", LIKE_OTHERS)
def test_arms_that_are_like_those_of_a_family_are_solved_where_they_stand(monkeypatch, name):
    monkeypatch.setitem(FAMILIES, name, (LIKE_OTHERS[name], 0, ""))
    robot = arm(name, np.random.default_rng(3))
    joints = random_joints(robot, np.random.default_rng(4), 1)
    poses = forward(robot, joints)
    found = solve(robot, poses, joints)
    assert np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1).max() < 1e-6
