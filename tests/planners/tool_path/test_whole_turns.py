"""Angles beyond half a turn with `orientation: euler`: how far the tool turns, by differences of its rotation."""

from __future__ import annotations

import numpy as np
import pytest
from tool_jobs import FINE, LEFT, planned

DEG = {"angle": "deg", "length": "mm"}
ROBOT = "ur5e"
XYZ = [400, 100, 300]
LIMITS = {"velocity": 300, "acceleration": 5000, "jerk": None, "position": [[-720, 720]] * 6}


def turned(*moves, start, sequence="ZYZ", **rest):
    """Return for each move how far each of its steps of rotation leads about world axes, deg, summed up."""
    made = planned(ROBOT, start, *moves, units=DEG, limits=LIMITS, **rest)
    from trajcli.kinematics.forward import forward

    assert not [f for f in made.verdict.findings if f.kind == "target"]
    sums = []
    for span in made.trajectory.spans:
        t = np.linspace(span.start, span.end, 4001)
        r = forward(made.moves[0].robot, made.trajectory.curve.evaluate(t))[:, :3, :3]
        step = r[1:] @ np.swapaxes(r[:-1], 1, 2)  # small: its antisymmetric part is the rotation vector
        vector = np.stack(
            [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]],
            axis=1,
        )
        sums.append(np.degrees(vector.sum(axis=0) / 2))
    return sums


def pose(*angles, xyz=XYZ, sequence="XYZ", frame="fixed", **rest):
    return {"xyz": xyz, "euler": {"sequence": sequence, "frame": frame, "angles": list(angles)}, **rest}


def line(*angles, xyz=XYZ, **rest):
    move = {"planner": "line", "to": pose(*angles, xyz=xyz), "orientation": "euler"}
    return {**move, "law": {"shape": "quintic", "duration": 4}, **FINE, **rest}


START = pose(180, 0, 0, configuration=LEFT)


@pytest.mark.full
@pytest.mark.parametrize("angle", [270, -270, 360, 200, 90, -170, 180])
@pytest.mark.parametrize("xyz", [XYZ, [400, 200, 300]], ids=["in_place", "line"])
def test_the_tool_turns_as_far_as_the_angles_say(angle, xyz):
    """About the fixed z last: the turn about world z is the change of the third angle."""
    (sum_,) = turned(line(180, 0, angle, xyz=xyz), start=START)
    np.testing.assert_allclose(sum_, [0, 0, angle], atol=0.01)


@pytest.mark.full
@pytest.mark.parametrize("angle", [270, -300])
def test_on_an_arc_and_on_a_path(angle):
    end = [400, 300, 300]
    arc = {"planner": "arc", "via": {"xyz": [500, 200, 300]}, "to": pose(180, 0, angle, xyz=end)}
    path = {"planner": "path", "segments": [{"line": pose(180, 0, angle / 2, xyz=[450, 150, 300])}]}
    path["segments"].append({"line": pose(180, 0, angle, xyz=end)})
    path |= {"corner": "round", "radius": 20}
    for move in (arc, path):
        law = {"orientation": "euler", "law": {"shape": "quintic", "duration": 6}, **FINE}
        (sum_,) = turned({**move, **law}, start=START)
        np.testing.assert_allclose(sum_, [0, 0, angle], atol=0.02)


@pytest.mark.full
def test_whole_turns_are_counted_from_the_target_before():
    sums = turned(line(180, 0, 270), {"planner": "hold", "duration": 1}, line(180, 0, 300), start=START)
    np.testing.assert_allclose([s[2] for s in sums], [270, 0, 30], atol=0.02)
    sums = turned(line(180, 0, 270), line(180, 0, 0), line(180, 0, -200), start=START)
    np.testing.assert_allclose([s[2] for s in sums], [270, -270, -200], atol=0.02)


def test_typed_start_beyond_half_a_turn():
    (sum_,) = turned(line(180, 0, 0), start=pose(180, 0, 270, configuration=LEFT))
    assert sum_[2] == pytest.approx(-270, abs=0.02)


def test_start_that_is_not_typed_is_read_within_half_a_turn():
    start = {
        "xyz": XYZ,
        "quat_wxyz": [0, np.cos(0.2), np.sin(0.2), 0],
        "configuration": LEFT,
    }  # rpy 180, 0, 22.9
    (sum_,) = turned(line(180, 0, 270), start=start)
    assert sum_[2] == pytest.approx(270 - np.degrees(0.4), abs=0.02)


@pytest.mark.full
@pytest.mark.parametrize(("angle", "expected"), [(270, 90), (-270, -90)])
def test_half_a_turn_at_the_start_is_on_the_side_of_the_target(angle, expected):
    """Rounding must not choose between 180 and -180 deg: the third angle begins at the nearer one."""
    start = {"xyz": XYZ, "quat_wxyz": [0, 0, 1, 0], "configuration": LEFT}  # rpy 180, 0, 180
    (sum_,) = turned(line(180, 0, angle), start=start)
    assert sum_[2] == pytest.approx(expected, abs=0.02)


def test_within_half_a_turn_the_nearest_angles_are_taken_as_before():
    (sum_,) = turned(line(180, 0, -170), start=pose(180, 0, 170, configuration=LEFT))
    assert sum_[2] == pytest.approx(20, abs=0.02)


def test_another_sequence_of_the_start_says_nothing():
    start = pose(0, 180, 0, sequence="ZYZ", frame="current", configuration=LEFT)
    (sum_,) = turned(line(180, 0, 270), start=start)
    assert sum_[2] == pytest.approx(90, abs=0.02)  # from rpy 180, 0, 180
