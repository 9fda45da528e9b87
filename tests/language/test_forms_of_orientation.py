"""Orientations and axes of jobs in every form, against scipy."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.planning.plan import plan_job

UNITS = {"deg": ("deg", "mm", 180 / np.pi, 1e3), "rad": ("rad", "m", 1.0, 1.0)}
MOVES = "moves: [{planner: quintic, to: {joints: [0.1, -1, 1, 0, 1, 0]}, duration: 3}]\n"
SEQUENCES = [a + b + c for a in "XYZ" for b in "XYZ" for c in "XYZ" if a != b != c]
TURN = Rotation.from_rotvec([0.4, -1.1, 0.7])
XYZ = (0.001, -2.5, 3.0)


def forms(turn: Rotation, angle: float) -> dict[str, object]:
    """Return an orientation in every form, angles times a factor."""
    x, y, z, w = turn.as_quat().tolist()
    axis, size = turn.as_rotvec() / turn.magnitude(), turn.magnitude()
    return {
        "rpy": (turn.as_euler("xyz") * angle).tolist(),
        "quat_wxyz": [w, x, y, z],
        "quat_xyzw": [x, y, z, w],
        "rotvec": (turn.as_rotvec() * angle).tolist(),
        "matrix": turn.as_matrix().tolist(),
        "axis_angle": {"axis": (-7 * axis).tolist(), "angle": -float(size) * angle},
    } | {
        f"euler {name} {frame}": {
            "sequence": name,
            "angles": (turn.as_euler(name if frame == "current" else name.lower()) * angle).tolist(),
            **({} if frame == "current" else {"frame": frame}),
        }
        for name in SEQUENCES
        for frame in ("current", "fixed")
    }


CASES = [
    (unit, form)
    for number, form in enumerate(forms(TURN, 1))
    for unit in UNITS
    if "euler" not in form
    or list(UNITS)[number // 2 % 2] == unit  # each sequence in one, in one frame of each two
]


@pytest.mark.filterwarnings("ignore:Gimbal lock")
@pytest.mark.parametrize(("unit", "form"), CASES)
def test_every_form_is_the_rotation_of_scipy(unit: str, form: str) -> None:
    """A tool, a base and a point are read alike; the point is that again in the resolved job."""
    angle, length, per_rad, per_m = UNITS[unit]
    value = {"xyz": [x * per_m for x in XYZ], form.split(maxsplit=1)[0]: forms(TURN, per_rad)[form]}
    expected = np.eye(4)
    expected[:3, :3], expected[:3, 3] = TURN.as_matrix(), XYZ
    plain = dict.fromkeys(("tool", "base"), value) | {"points": {"p": value}, "start": {"joints": 0}}
    head = f"version: 1\nrobot: ur5e\nunits: {{angle: {angle}, length: {length}}}\n"
    text = head + "".join(f"{key}: {json.dumps(item)}\n" for key, item in plain.items())
    job = job_from_text(text + MOVES)
    resolved = dump_job(job)
    again = job_from_text(resolved.replace("angle: deg, length: mm", "angle: rad, length: m"))
    for each in (job, again, *([job_from_text(resolved)] if unit == "deg" else [])):
        for read in (each.robot.tool, each.robot.base, each.job.points["p"].full_pose()):
            np.testing.assert_allclose(read, expected, rtol=1e-15, atol=3e-15)
    assert np.array_equal(job.job.points["p"].full_pose(), again.job.points["p"].full_pose())


def job_with(points: str, head: str = "", moves: str = MOVES) -> LoadedJob:
    start = "start: {joints: [0, -1.5, 1.5, 0, 1.5, 0]}\n"
    return job_from_text(f"version: 1\nrobot: ur5e\n{start}{head}points:\n{points}{moves}", "job.yaml")


def test_a_turn_about_the_name_of_an_axis_and_its_vector_are_one() -> None:
    for index, name in enumerate("xyz"):
        vector = [3.0 * (k == index) for k in range(3)]
        text = f"  a: {{axis_angle: {{axis: {name}, angle: 0.3}}}}\n"
        text += f"  b: {{axis_angle: {{axis: {vector}, angle: 0.3}}}}\n  c: {{direction: {name}}}\n"
        points = job_with(text).job.points
        expected = Rotation.from_rotvec(0.3 * np.eye(3)[index]).as_matrix()
        for point in ("a", "b"):
            np.testing.assert_allclose(points[point].full_pose()[:3, :3], expected, atol=1e-15)
        assert points["c"].direction == tuple(np.eye(3)[index])


@pytest.mark.parametrize(
    "vector", ["[0, 0, 0]", "[1e-200, 0, 0]", "[0, -1e-170, 1e-170]", "[3e-160, 4e-160, 0]"]
)
def test_axes_whose_length_vanishes_in_squares_are_refused_where_they_stand(vector: str) -> None:
    """Of a rail they were NaN in the base of the robot."""
    texts = [
        f"version: 1\nrobot: {{rail: {{axis: {vector}}}, arm: ur5e}}\nstart: {{joints: 0}}\n{MOVES}",
        f"version: 1\nrobot: ur5e\ntool: {{axis_angle: {{axis: {vector}, angle: 1}}}}\nstart: {{joints: 0}}\n{MOVES}",
        f"version: 1\nrobot: ur5e\nstart: {{joints: 0}}\npoints: {{p: {{direction: {vector}}}}}\n{MOVES}",
    ]
    for text in texts:
        with pytest.raises(InputError, match=r"an axis of length .* has no direction") as caught:
            job_from_text(text)
        place = caught.value.problems[0].place
        assert place is not None
        assert place.source[place.column - 1 :].startswith(vector)


@pytest.mark.parametrize("decimals", [5, 8, 12])
def test_a_rounded_matrix_stands_for_the_nearest_rotation(decimals: int) -> None:
    rounded = np.round(TURN.as_matrix(), decimals)
    nearest = polar(rounded)[0]
    whole = np.vstack([np.column_stack([rounded, [1, 2, 3]]), [0, 0, 0, 1]])
    for matrix in (rounded, whole):
        text = f"version: 1\nrobot: ur5e\ntool: {{matrix: {matrix.tolist()}}}\nstart: {{joints: 0}}\n"
        point = f"points: {{p: {{matrix: {matrix.tolist()}}}}}\n"
        job = job_from_text(text + point + MOVES)
        for read in (job.robot.tool, job.job.points["p"].full_pose()):
            np.testing.assert_allclose(read[:3, :3], nearest, rtol=0, atol=1e-15)
            np.testing.assert_allclose(read[:3, 3], (len(matrix) - 3) * np.array([1, 2, 3]))


FAR = [  # units, a pose, whether it has a plain angle of more than two turns
    ("rad", "rpy: [0, 0, -12.6]", True),
    ("rad", "rpy: [12.6, 0, 0]", True),
    ("rad", "rpy: [0, 12.5, -12.5]", False),
    ("rad", "rotvec: [0, 90, 0]", True),
    ("rad", "euler: {sequence: ZYZ, angles: [0, 0, 90]}", True),
    ("rad", "quat_wxyz: [1, 0, 0, 0], configuration: {elbow: up}", False),
    ("deg", "rpy: [800, 0, 0]", False),
]


@pytest.mark.parametrize(("unit", "form", "far"), FAR)
def test_angles_that_look_like_degrees_are_seen(unit: str, form: str, far: bool) -> None:
    units = f"units: {{angle: {unit}}}\n"
    assert job_with(f"  p: {{xyz: [20, 30, 40], {form}}}\n", units).has_far_angle == far


def test_a_pose_has_one_orientation_wherever_it_stands() -> None:
    for two in (
        "rpy: [0, 0, 0], rotvec: [0, 0, 0]",
        "matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], quat_xyzw: [0, 0, 0, 1]",
    ):
        for line in (f"tool: {{{two}}}", f"base: {{{two}}}", f"frames: {{f: {{{two}}}}}"):
            with pytest.raises(InputError, match="exclude each other"):
                job_with("  p: {joints: 0}\n", f"{line}\n")


OFF = "matrix: [[1, 0, 4e-5], [0, 1, 0], [0, 0, 1]]"
NOTED = [
    ("", f"  p: {{xyz: [0.4, 0, 0.3], {OFF}}}\n"),
    ("frames: {f: {xyz: [0, 0, 0.01]}}\n", f"  p: {{in: f, xyz: [0.4, 0, 0.3], {OFF}}}\n"),
    ("frames: {f: {rpy: [0, 0, 0.1]}}\n", f"  p: {{in: f, xyz: [0.4, 0, 0.3], {OFF}}}\n"),
    ("", f"  b: {{xyz: [0.4, 0, 0.3], {OFF}}}\n  p: {{from: b, offset: {{xyz: [0, 0, 0.01]}}}}\n"),
    ("", f"  b: {{xyz: [0.4, 0, 0.3], {OFF}}}\n  p: {{from: b, offset: {{rpy: [0, 0, 0.01]}}}}\n"),
    ("", f"  b: {{xyz: [0.4, 0, 0.3], {OFF}}}\n  p: {{from: b, offset: {{rpy: [0, 0, 0.1]}}, frame: world}}\n"),
]  # fmt: skip


@pytest.mark.parametrize(("head", "points"), NOTED)
def test_a_matrix_that_is_off_a_rotation_is_noted_wherever_its_pose_is_given(head: str, points: str) -> None:
    move = "moves: [{planner: quintic, to: p, duration: 9}]\n"
    plan = plan_job(job_with(points, head, move))
    events = [event.message for event in (*plan.events, *plan.remarks)]
    name = "b" if "  b:" in points else "p"
    assert f"the matrix points.{name}.matrix is off a rotation by 4e-05: the nearest one is taken" in events
    exact = plan_job(job_with(points.replace("4e-5", "0"), head, move))
    assert "off a rotation" not in str([*exact.events, *exact.remarks])
    ends = [each.trajectory.curve.evaluate(each.trajectory.duration, side="left") for each in (plan, exact)]
    assert 1e-6 < np.abs(ends[0] - ends[1]).max() < 2e-4


@pytest.mark.parametrize(
    ("pose", "wrong"),
    [
        ("{xyz: [a, 1, b], rpy: [c, 0, d]}", "a b c d"),
        ("{xyz: [0, 1, b], axis_angle: {axis: [1, q, 0], angle: r}}", "b q r"),
        ("{matrix: [[1, a, 0], [0, b, 0], [0]]}", "a b [0]"),
        ("{matrix: [[1, 0, 0, a], [0, 1, 0, 0], [0, 0, b, 0], [0, 0, 0, 1mm]]}", "a b 1mm"),
    ],
)
def test_every_flaw_of_a_pose_is_said_at_once_where_it_stands(pose: str, wrong: str) -> None:
    for key in ("tool", "base", "point"):
        text = f"  p: {pose}\n" if key == "point" else f"{key}: {pose}\n"
        with pytest.raises(InputError) as refused:
            job_with(*((text, "") if key == "point" else ("  p: {joints: 0}\n", text)))
        places = [problem.place for problem in refused.value.problems]
        assert all(place is not None and place.source.strip() == text.strip() for place in places)
        said = [place.source[place.column - 1 :][: place.length] for place in places if place is not None]
        assert said == wrong.split()
