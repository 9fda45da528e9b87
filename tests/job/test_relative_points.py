"""Poses relative to points, and the base of the arm, against products of matrices."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.language.targets import Target
from trajcli.planning.plan import plan_job

HEAD = "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nstart: {joints: [0, -90, 90, 0, 90, 0]}\n"
MOVES = "moves: [{planner: quintic, to: {joints: [10, -90, 90, 0, 90, 0]}, duration: 3}]\n"


def homogeneous(rotation: Rotation, *xyz: float) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation.as_matrix(), xyz
    return result


def points_of(text: str) -> dict[str, Target]:
    return job_from_text(f"{HEAD}points:\n{text}{MOVES}").job.points


PICK = homogeneous(Rotation.from_euler("xyz", [170, 20, 30], degrees=True), 0.4, 0.1, 0.05)
PICK_TEXT = "  pick: {xyz: [400, 100, 50], rpy: [170, 20, 30], configuration: {elbow: up}}\n"
OFFSET = homogeneous(Rotation.from_rotvec([10, 20, -40], degrees=True), 0.01, 0.02, -0.1)
OFFSET_TEXT = "{xyz: [10, 20, -100], rotvec: [10, 20, -40]}"


def test_an_offset_in_the_frame_of_the_tool_is_a_product() -> None:
    point = points_of(f"{PICK_TEXT}  p: {{from: pick, offset: {OFFSET_TEXT}}}\n")["p"]
    np.testing.assert_allclose(point.full_pose(), PICK @ OFFSET, atol=1e-14)
    assert point.configuration is not None
    assert point.configuration.elbow == "up"


def test_the_smallest_turn_of_an_offset_counts() -> None:
    point = points_of(f"{PICK_TEXT}  p: {{from: pick, offset: {{rotvec: [0, 0, 0.001]}}}}\n")["p"]
    turned = np.linalg.inv(PICK) @ point.full_pose()
    assert np.degrees(Rotation.from_matrix(turned[:3, :3]).as_rotvec()) == pytest.approx(
        [0, 0, 0.001], abs=1e-12
    )


@pytest.mark.parametrize("target", ["{joints_by: 3}", "{from: here}", "{joints: 3}"])
def test_a_job_waits_for_the_plan_where_a_target_is_relative_to_where_the_arm_stands(target: str) -> None:
    moves = MOVES.replace("{joints: [10, -90, 90, 0, 90, 0]}", target)
    assert job_from_text(HEAD + moves).waits == ("by" in target or "here" in target)


def test_an_offset_in_world_moves_and_turns_about_the_axes_of_world() -> None:
    point = points_of(f"{PICK_TEXT}  p: {{from: pick, offset: {OFFSET_TEXT}, frame: world}}\n")["p"]
    np.testing.assert_allclose(point.full_pose()[:3, 3], PICK[:3, 3] + OFFSET[:3, 3], atol=1e-15)
    np.testing.assert_allclose(point.full_pose()[:3, :3], OFFSET[:3, :3] @ PICK[:3, :3], atol=1e-14)


def test_chains_in_any_order_are_products() -> None:
    text = (
        f"  last: {{from: alias, offset: {OFFSET_TEXT}}}\n  alias: middle\n"
        f"  middle: {{from: pick, offset: {OFFSET_TEXT}, configuration: {{wrist: flip}}}}\n{PICK_TEXT}"
    )
    point = points_of(text)["last"]
    np.testing.assert_allclose(point.full_pose(), PICK @ OFFSET @ OFFSET, atol=1e-14)
    assert point.configuration is not None
    assert point.configuration.wrist == "flip"


def test_each_of_a_chain_of_points_starts_from_the_one_before_it() -> None:
    """The first is given by its joints, so that all offsets wait for the pose there; the last is read first."""
    joints, steps = [10.0, -80, 95, -20, 85, 5], ("[30, 0, 0]", "[0, 50, 0]", "[0, 0, -70]")
    text = "".join(
        f"  p{k}: {{from: p{k - 1}, offset: {{xyz: {step}}}}}\n"
        for k, step in reversed([*enumerate(steps, 1)])
    )
    moves = "moves: [{planner: quintic, to: p3, duration: 3}]\n"
    plan = plan_job(job_from_text(f"{HEAD}points:\n{text}  p0: {{joints: {joints}}}\n{moves}"))
    robot = plan.loaded.robot
    offset = homogeneous(Rotation.identity(), 0.03, 0.05, -0.07)
    np.testing.assert_allclose(
        forward(robot, plan.moves[0].planned.end.position),
        forward(robot, np.deg2rad(joints)) @ offset,
        atol=1e-9,
    )


def test_a_displacement_keeps_the_form_of_the_orientation() -> None:
    text = "  a: {xyz: [400, 0, 300], euler: {sequence: ZYZ, angles: [10, 100, 370]}}\n"
    point = points_of(f"{text}  b: {{from: a, offset: {{xyz: [0, 0, 1]}}}}\n")["b"]
    assert point.euler is not None
    np.testing.assert_allclose(np.rad2deg(point.euler.angles), [10, 100, 370])


def test_a_part_of_an_orientation_stays_one() -> None:
    text = "  a: {xyz: [400, 0, 300], direction: [0, 0, -1]}\n"
    point = points_of(f"{text}  b: {{from: a, offset: {{xyz: [0, 0, 100]}}, frame: world}}\n")["b"]
    assert point.xyz == pytest.approx((0.4, 0, 0.4), abs=1e-16)
    assert point.direction == (0, 0, -1)


def test_relative_states_stand_wherever_a_state_may() -> None:
    text = HEAD.replace("start: {joints: [0, -90, 90, 0, 90, 0]}", "start: {from: pick}") + (
        f"points:\n{PICK_TEXT}"
        "moves:\n"
        "  - {planner: quintic, to: {from: pick, offset: {xyz: [0, 0, -50]}}, duration: 3}\n"
        "  - {planner: line, to: {from: pick}, law: {shape: quintic, duration: 3}}\n"
        "  - {planner: path, segments: [{line: {from: pick, offset: {xyz: [0, 0, -30]}}}], "
        "law: {shape: quintic, duration: 3}}\n"
        "  - {planner: spline, through: [{from: pick, time: 3}], "
        "to: {from: pick, offset: {xyz: [0, 0, -30]}, time: 6}}\n"
    )
    plan = plan_job(job_from_text(text))
    assert not plan.verdict.findings
    ends = [forward(plan.loaded.robot, move.planned.end.position) for move in plan.moves]
    for end, depth in zip(ends, (-0.05, 0, -0.03, -0.03), strict=True):
        expected = PICK @ homogeneous(Rotation.identity(), 0, 0, depth)
        np.testing.assert_allclose(end, expected, atol=2e-6)
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    assert np.array_equal(again.trajectory.curve.coefficients, plan.trajectory.curve.coefficients)


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("  a: {from: b}\n  b: {from: a}\n", "6:13", "the point 'b' is relative to itself (b -> a -> b)"),
        ("  a: {from: a}\n", "6:13", "the point 'a' is relative to itself (a -> a)"),
        ("  a: {from: bb}\n", "6:13", "there is no point 'bb'"),
        ("  a: {from: 3}\n", "6:13", "expected the name of a point, got 3"),
        ("  a: {velocity: 0}\n  b: {from: a}\n", "7:13", "the point 'a' is given without a pose"),
        ("  a: {rpy: [0, 0, 0]}\n  b: {from: a}\n", "7:13", "the point 'a' has no position"),
        ("  a: {xyz: [1, 2, 3]}\n  b: {from: a}\n", "7:13", "the point 'a' has no whole orientation"),
        ("  a: {xyz: [1, 2, 3]}\n  b: {from: a, frame: floor}\n", "7:23", "there is no frame 'floor'"),
        ("  a: {xyz: [1, 2, 3]}\n  b: {from: a, offset: {z: 3}}\n", "7:25", "unknown key 'z'"),
        ("  a: {xyz: [1, 2, 3]}\n  b: {from: a, ofset: {z: 3}}\n", "7:16", "unknown key 'ofset'"),
        (
            "  a: {xyz: [1, 2, 3]}\n  b: {from: a, xyz: [0, 0, 1]}\n",
            "7:16",
            "from and xyz exclude each other",
        ),
        ("  a: {xyz: [1, 2]}\n  b: {from: a, frame: world}\n", "6:12", "expected 3 numbers, got 2 values"),
    ],
)
def test_wrong_points_are_said_where_they_stand(text: str, place: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        points_of(text)
    problems = [(str(p.place), p.text()) for p in caught.value.problems]
    assert any(where.endswith(f":{place}") and message in what for where, what in problems), problems


@pytest.mark.parametrize(
    ("beside", "advice", "followed"),
    [
        ("xyz: [0, 0, 1]", "offset: {xyz: ...}", ["from: a, offset: {xyz: [0, 0, 1]}"]),
        ("rotvec: [0, 0, 1]", "offset: {rotvec: ...}", ["from: a, offset: {rotvec: [0, 0, 1]}"]),
        ("in: world", "along whose axes: `frame`", ["from: a, frame: world"]),
        ("joints: 0", "leave one of them out", ["from: a", "joints: 0"]),
        ("yaw: 3", "leave one of them out", ["from: a", "yaw: 3"]),
        ("direction: x", "leave one of them out", ["from: a", "direction: x"]),
    ],
)
def test_advice_about_what_cannot_stand_beside_from_works(
    beside: str, advice: str, followed: list[str]
) -> None:
    point = "  a: {xyz: [1, 2, 3], rpy: [0, 0, 0]}\n"
    with pytest.raises(InputError) as caught:
        points_of(f"{point}  b: {{from: a, {beside}}}\n")
    (problem,) = caught.value.problems
    assert problem.message == f"from and {beside.partition(':')[0]} exclude each other"
    assert (problem.hint or "").endswith(advice)
    for state in followed:
        assert "b" in points_of(f"{point}  b: {{{state}}}\n")


@pytest.mark.parametrize(
    "flawed",
    [
        "  a: {xyz: [1, 2]}\n",
        "  a: {from: z}\n",
        "  a: z\n",
        "  a: 3\n",
        "  a: {in: z, xyz: [1, 2, 3]}\n",
        "  a: {from: here, ofset: {}}\n",
        "  j: {joints: 0}\n  a: {from: j, frame: z}\n",
        "  p: {xyz: [1, 2, 3]}\n  a: {from: p}\n",
        "  a: {joint: 3}\n",
        "  a: {xzy: [1, 2, 3], rpy: [0, 0, 0]}\n",
        "  a: {xyz: [1, 2, 3], rpyy: [0, 0, 0]}\n",
        "  a: {xyz: [1, 2, 3], rpy: [0, 0, 0], joints: {elbow_joint: x}}\n",
        "  a: {xyz: [1, 2, 3], rpy: [0, 0, 0], configuration: {elbow: upp}}\n",
        "  p: {xyz: [1, 2, 3], rpy: [0, 0, 0]}\n  a: {from: p, joints: {elbow_joint: x}}\n",
    ],
)
def test_a_flaw_of_a_point_is_not_said_again_by_those_relative_to_it(flawed: str) -> None:
    with pytest.raises(InputError) as caught:
        points_of(f"{flawed}  b: {{from: a}}\n  c: {{from: b}}\n")
    assert len(caught.value.problems) == 1


def test_names_that_lead_into_a_circle_are_told_with_the_circle() -> None:
    with pytest.raises(InputError) as caught:
        points_of("  a: {from: b}\n  b: c\n  c: d\n  d: c\n")
    assert [(str(problem.place)[6:], problem.message) for problem in caught.value.problems] == [
        (":6:13", "the point 'c' is named by itself (b -> c -> d -> c)"),
        (":7:6", "the point 'c' is named by itself (c -> d -> c)"),
        (":8:6", "the point 'd' is named by itself (d -> c -> d)"),
        (":9:6", "the point 'c' is named by itself (c -> d -> c)"),
    ]


@pytest.mark.parametrize(
    ("points", "hint"),
    [
        ("points: {pick: {joints: 0}, place: {joints: 0}}\n", "did you mean 'place'?"),
        ("points: {a1: {joints: 0}, b2: {joints: 0}}\n", "points: a1, b2"),
        ("", "the job has no `points`"),
    ],
)
def test_a_name_of_no_point_is_told_with_those_that_there_are(points: str, hint: str) -> None:
    with pytest.raises(InputError) as caught:
        job_from_text(f"{HEAD}{points}{MOVES.replace('{joints: [10, -90, 90, 0, 90, 0]}', 'plaice')}")
    (problem,) = caught.value.problems
    assert (problem.message, problem.hint) == ("there is no point 'plaice'", hint)


def test_a_value_that_is_no_state_is_told_with_what_is_one() -> None:
    with pytest.raises(InputError) as caught:
        points_of("  a: 3\n")
    assert caught.value.problems[0].hint == "write {joints: ...}, or the name of a point"
    points_of("  a: {joints: 3}\n  b: a\n")


@pytest.mark.parametrize(
    ("point", "relative", "message", "hint"),
    [
        ("{joints: 0}", "ofset: {}", "unknown key 'ofset'", "did you mean 'offset'?"),
        (
            "{joints: 0}",
            "qq: 3",
            "unknown key 'qq'",
            "valid names: from, offset, frame, configuration, velocity, acceleration, joints",
        ),
        (
            "{velocity: 0}",
            "offset: {}",
            "the point 'a' is given without a pose",
            "give it as a pose, or by its joints",
        ),
        (
            "{xyz: [1, 2, 3]}",
            "offset: {xyz: [0, 0, 1]}",
            "the frame of the tool is not known there",
            "give 'a' an orientation, or say `frame: world`",
        ),
        (
            "{xyz: [1, 2, 3]}",
            "frame: world, offset: {rpy: [0, 0, 9]}",
            "the offset cannot turn it",
            "give 'a' an orientation",
        ),
    ],
)
def test_what_a_relative_point_lacks_is_told_with_what_helps(
    point: str, relative: str, message: str, hint: str
) -> None:
    with pytest.raises(InputError) as caught:
        points_of(f"  a: {point}\n  b: {{from: a, {relative}}}\n")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.hint == hint


def test_advice_about_a_point_without_an_orientation_works() -> None:
    step = "offset: {xyz: [0, 0, 1]}"
    above = points_of(f"  a: {{xyz: [1, 2, 3]}}\n  b: {{from: a, {step}, frame: world}}\n")["b"]
    assert above.xyz == pytest.approx((0.001, 0.002, 0.004))
    whole = points_of(f"  a: {{xyz: [1, 2, 3], rpy: [180, 0, 0]}}\n  b: {{from: a, {step}}}\n")["b"]
    assert whole.xyz == pytest.approx((0.001, 0.002, 0.002))


@pytest.mark.parametrize("count", [100, 101])
def test_a_chain_of_a_hundred_points_is_read_and_one_more_is_refused(count: int) -> None:
    step = "offset: {xyz: [0, 0, 1]}"
    links = "".join(f"  p{k}: {{from: p{k + 1}, {step}}}\n" for k in range(count))
    text = f"{links}  p{count}: {{xyz: [1, 2, 3], rpy: [0, 0, 0]}}\n"
    if count == 100:
        np.testing.assert_allclose(
            points_of(text)["p0"].full_pose()[:3, 3], [0.001, 0.002, 0.103], atol=1e-13
        )
        return
    with pytest.raises(InputError, match="more than 100 points") as caught:
        points_of(text)
    assert [str(problem.place)[6:] for problem in caught.value.problems] == [":6:14"]


@pytest.mark.full
def test_a_long_chain_is_refused_and_does_not_overflow() -> None:
    links = "".join(f"  p{k}: {{from: p{k + 1}}}\n" for k in range(1500))
    with pytest.raises(InputError, match="more than 100 points stand one relative to the next"):
        points_of(f"{links}  p1500: {{xyz: [1, 2, 3], rpy: [0, 0, 0]}}\n")
    forth = "".join(f"  p{k + 1}: {{from: p{k}, offset: {{xyz: [0, 0, 1]}}}}\n" for k in range(300))
    last = points_of(f"  p0: {{xyz: [0, 0, 0], rpy: [0, 0, 0]}}\n{forth}")["p300"]
    np.testing.assert_allclose(last.full_pose()[:3, 3], [0, 0, 0.3], atol=1e-13)


@pytest.mark.parametrize("form", ["quat_xyzw", "rotvec"])
def test_the_forms_of_ros_and_of_a_ur_pendant(form: str) -> None:
    turn = Rotation.from_rotvec([100, -50, 20], degrees=True)
    values: list[Any] = turn.as_quat().tolist() if form == "quat_xyzw" else [100, -50, 20]
    pose = f"{{xyz: [1, 2, 3], {form}: {values}}}"
    job = job_from_text(f"{HEAD}tool: {pose}\nbase: {pose}\npoints:\n  p: {pose}\n{MOVES}")
    expected = homogeneous(turn, 0.001, 0.002, 0.003)
    for read in (job.robot.tool, job.robot.base, job.job.points["p"].full_pose()):
        np.testing.assert_allclose(read, expected, atol=1e-14)


def test_a_quaternion_of_no_length_says_the_identity_in_its_own_order() -> None:
    with pytest.raises(InputError) as caught:
        points_of("  p: {quat_xyzw: [0, 0, 0, 0]}\n")
    assert caught.value.problems[0].hint == "no rotation is (0, 0, 0, 1)"


def test_a_hanging_arm() -> None:
    standing = job_from_text(HEAD + MOVES)
    hanging = job_from_text(f"{HEAD}base: {{xyz: [100, 0, 2500], rpy: [180, 0, 30]}}\n{MOVES}")
    base = homogeneous(Rotation.from_euler("xyz", [180, 0, 30], degrees=True), 0.1, 0, 2.5)
    joints = np.array([0.3, -1.2, 1.4, 0.2, 1.5, -0.4])
    inside = np.linalg.inv(standing.robot.base) @ forward(standing.robot, joints)
    np.testing.assert_allclose(forward(hanging.robot, joints), base @ inside, atol=1e-14)
    again = job_from_text(dump_job(hanging))
    assert np.array_equal(again.robot.base, hanging.robot.base)
    assert np.array_equal(again.robot.tool, hanging.robot.tool)


def test_poses_of_a_hanging_arm_are_in_world() -> None:
    text = (
        "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nbase: {xyz: [0, 0, 1500], rpy: [180, 0, 0]}\n"
        "start: {joints: [0, -90, 90, 0, 90, 0]}\n"
        "moves: [{planner: quintic, to: {xyz: [400, 200, 1000], rpy: [180, 0, 0]}, duration: 5}]\n"
    )
    plan = plan_job(job_from_text(text))
    end = forward(plan.loaded.robot, plan.moves[0].planned.end.position)
    expected = homogeneous(Rotation.from_euler("x", 180, degrees=True), 0.4, 0.2, 1.0)
    np.testing.assert_allclose(end, expected, atol=1e-9)
