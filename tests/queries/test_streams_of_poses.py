"""Rows of poses become rows of joints: units and order of columns, blocks, limits, slides, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from trajcli.errors import InputError, PlanningError
from trajcli.geometry.rotation import quaternion_from_matrix
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import all_turns
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.inverse_stream import EveryAnswer, joints_of
from trajcli.streams.table import TableBlocks
from trajcli.units import Units

A, B = 0.5, 0.3
DEG = np.pi / 180
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")


def planar(first: tuple[float, float], second: tuple[float, float], units: Units | None = None) -> ArmInUnits:
    free = unlimited(2)
    robot = Robot(
        "two",
        (Joint("j1", a=A), Joint("j2", a=B)),
        replace(free, position=np.array([first, second]) * DEG),
        "standard",
        np.eye(4),
        np.eye(4),
    )
    return ArmInUnits(robot, units or Units("deg", "mm"))


def blocks(names: Sequence[str], *rows: np.ndarray) -> TableBlocks:
    return TableBlocks(tuple(names), iter(rows), "poses.csv")


def points(*joints: tuple[float, float]) -> np.ndarray:
    q1, q2 = np.array(joints).T * DEG
    return np.column_stack(
        [A * np.cos(q1) + B * np.cos(q1 + q2), A * np.sin(q1) + B * np.sin(q1 + q2), 0 * q1]
    )


WIDE = planar((-400, 400), (-170, 170))
ROWS = [(10, 60), (20, 50), (30, 40), (40, 30)]


def test_a_row_has_its_time_and_each_column_its_own_unit_wherever_it_stands() -> None:
    p = points(*ROWS)
    table = np.column_stack([p[:, 2], [5, 6, 7, 8], p[:, 1] * 1e3, np.full(4, 9.0), p[:, 0]])
    names = ("z", "t", "y_mm", "weight", "x")
    for near, wanted in (((0, 100), ROWS), (None, None)):
        values = None if near is None else np.array(near) * DEG
        stream = joints_of(WIDE, blocks(names, table[:1], table[1:]), values, 1e-9)
        assert [column.name for column in stream.columns] == ["t", "q1_deg", "q2_deg"]
        found = np.vstack(list(stream.blocks))
        assert found[:, 0].tolist() == [5, 6, 7, 8]
        if wanted is not None:
            np.testing.assert_allclose(found[:, 1:], wanted, atol=1e-9)
        np.testing.assert_allclose(points(*found[:, 1:]), p, atol=1e-9)
    turned = joints_of(WIDE, blocks(names, table), np.array([370, 60]) * DEG, 1e-9)
    np.testing.assert_allclose(np.vstack(list(turned.blocks))[:, 1:], np.add(ROWS, (360, 0)), atol=1e-9)
    bare = joints_of(planar((-400, 400), (-170, 170), Units()), blocks("xyz", p), np.array([0.0, 1.0]), 1e-9)
    assert [column.name for column in bare.columns] == ["q1", "q2"]
    np.testing.assert_allclose(np.vstack(list(bare.blocks)), np.array(ROWS) * DEG, atol=1e-11)


def test_a_stretched_arm_is_passed() -> None:
    rows = [(10, 20), (10, 10), (10, 0), (10, 10), (10, 20)]
    found = np.vstack(list(joints_of(WIDE, blocks("xyz", points(*rows)), np.array([0.0, 0.5]), 1e-9).blocks))
    np.testing.assert_allclose(points(*found), points(*rows), atol=1e-9)
    np.testing.assert_allclose(found[2], [10, 0], atol=1e-3)


@pytest.mark.parametrize("split", [0, 2])
@pytest.mark.parametrize("names", [("x", "y", "z"), ("t", "x", "y", "z")])
def test_a_row_out_of_reach_is_told_by_its_number_and_time(names: tuple[str, ...], split: int) -> None:
    p = points(*ROWS)
    p[3, 0] = 2.0
    table = np.column_stack([[5, 6, 7, 8.25], p])[:, 4 - len(names) :]
    stream = joints_of(WIDE, blocks(names, *(np.split(table, [split]) if split else [table])), None, 1e-9)
    when = r"row 3 \(from 0, t = 8\.25 s\)" if "t" in names else r"row 3 \(from 0\):"
    with pytest.raises(PlanningError, match=when):
        list(stream.blocks)


def test_every_answer_of_every_row_has_its_number_its_branch_and_whether_it_is_inside() -> None:
    arm = planar((-400, 400), (-45, 170))
    p = points(*ROWS)
    p[1] = 2.0
    every = EveryAnswer(arm, blocks("xyz", p[:1], p[1:3], p[3:]), None, 1e-9)
    head, *lines = b"".join(every.lines(9)).decode().splitlines()
    assert head == "row,elbow,q1_deg,q2_deg,within_limits"
    cells = [line.split(",") for line in lines]
    assert [(row[0], row[1], row[4]) for row in cells] == [
        ("0", "up", "0"), ("0", "down", "1"), ("2", "up", "1"), ("2", "down", "1"), ("3", "up", "1"), ("3", "down", "1")
    ]  # fmt: skip
    for row in cells:
        q = float(row[2]), float(row[3])
        np.testing.assert_allclose(points(q)[0], p[int(row[0])], atol=1e-9)
        assert (q[1] < 0) == (row[1] == "up")
    assert every.missed == 1
    p[3] = 2.0
    later = EveryAnswer(arm, blocks("xyz", p[:1], p[2:]), None, 1e-9)
    assert len(b"".join(later.lines(9)).splitlines()) == 5
    assert later.missed == 2
    p[1:] = 2.0
    none = EveryAnswer(arm, blocks("xyz", p[:1], p[1:3], p[3:]), None, 1e-9)
    assert len(b"".join(none.lines(9)).splitlines()) == 3
    assert none.missed == 1
    outside = EveryAnswer(
        planar((-400, 400), (-10, 10)), blocks("xyz", points((10, 5), (10, 60))), None, 1e-9
    )
    assert len(b"".join(outside.lines(9)).splitlines()) == 5
    assert outside.missed == 1


def test_rows_that_are_wrong_are_told_by_their_number_in_the_file() -> None:
    arm = ArmInUnits(load_robot("ur5e"), Units("deg", "mm"))
    row = np.array([400.0, 100, 300, 0, 1, 0, 0])
    wrong = row * [1, 1, 1, 1, 0.999, 1, 1]
    names = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
    for stream in (joints_of, EveryAnswer):
        for bad in (wrong, row * [1, 1, 1, 1, 1.001, 1, 1]):
            made = stream(arm, blocks(names, np.tile(row, (3, 1)), np.vstack([row, bad, wrong])), None, 1e-6)
            with pytest.raises(InputError, match=r"poses\.csv, row 4 \(from 0\): the quaternion has length"):
                list(made.blocks if stream is joints_of else made.lines(9))


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("x", "y"), "no column z"),
        (("x", "y", "z_deg"), "no column z"),
        (("x", "y", "z", "qw", "qy"), "no column qx, qz"),
        (("x", "y", "z", "qw_mm", "qx", "qy", "qz"), "no column qw"),
        (("x", "y", "z", "x_mm"), "x and x_mm are columns of the same number"),
        ((), "no column x, y, z"),
    ],
)
def test_columns_that_do_not_make_a_pose_are_refused(names: tuple[str, ...], said: str) -> None:
    for stream in (joints_of, EveryAnswer):
        with pytest.raises(InputError, match=said):
            stream(WIDE, blocks(names), None, 1e-6)


def scaled(name: str, share: float) -> Robot:
    """Return an arm of the catalogue with a share of its ranges, none wider than 14."""
    robot = load_robot(name)
    own = np.clip(robot.limits.position, -7, 7)
    middle, half = own.mean(axis=1), np.ptp(own, axis=1) / 2
    bounds = np.column_stack([middle - share * half, middle + share * half])
    return replace(robot, limits=replace(robot.limits, position=bounds))


def walk(robot: Robot, seed: int, smooth: bool) -> Iterator[np.ndarray]:
    low, high = robot.limits.position.T
    rng = np.random.default_rng(seed)
    if smooth:
        s = np.linspace(0, 1, 60)[:, None]
        yield low + (high - low) * (0.5 + 0.49 * np.sin(9 * s + rng.uniform(0, 6, len(low))))
    yield rng.uniform(low, high, (40, len(low)))


@pytest.mark.parametrize(
    ("name", "share", "smooth"),
    [
        ("ur5e", 0.4, True),
        ("ur5e", 1.0, False),
        ("cobra600", 1.0, True),
        ("cobra600", 0.7, False),
        ("irb120", 0.6, True),
    ],
)
def test_each_row_takes_the_nearest_answer_inside_its_ranges(name: str, share: float, smooth: bool) -> None:
    """All answers in all turns inside the ranges are tried for each row: no other one is nearer."""
    robot = scaled(name, share)
    arm = ArmInUnits(robot, Units())
    poses = forward(robot, np.vstack(list(walk(robot, 5, smooth))))
    rows = np.hstack([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    near = robot.limits.position.mean(axis=1)
    found = np.vstack(list(joints_of(arm, blocks(POSE, rows[:37], rows[37:]), near, 1e-6).blocks))
    low, high = robot.limits.position.T
    assert (found >= low - 1e-8).all()
    assert (found <= high + 1e-8).all()
    np.testing.assert_allclose(forward(robot, found), poses, atol=1e-6)
    last = near
    for pose, answer in zip(poses, found, strict=True):
        solutions = solve(robot, pose, last, 1e-6)
        every = np.vstack([all_turns(robot, one) for one in solutions.joints[solutions.within_limits]])
        least = np.abs(every - last).max(axis=1).min()
        assert np.abs(answer - last).max() <= least + 1e-6
        last = answer


def test_a_slide_makes_no_turns_however_long_it_is() -> None:
    """A slide of 20 m that goes by more than 2 pi m in a step, and back."""
    own = load_robot("scara")
    bounds = np.where(np.array(own.joint_types)[:, None] == "prismatic", [[-10.0, 10.0]], [[-3.0, 3.0]])
    robot = replace(own, limits=replace(own.limits, position=bounds))
    slide = own.joint_types.index("prismatic")
    q = np.column_stack([np.linspace(0.2, 0.9, 40)] * len(own.joints))
    q[:, slide] = np.where(np.arange(40) % 9 > 4, 8.0, -1.0)
    poses = forward(robot, q)
    rows = np.hstack([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    found = np.vstack(list(joints_of(ArmInUnits(robot, Units()), blocks(POSE, rows), q[0], 1e-6).blocks))
    np.testing.assert_allclose(found[:, slide], q[:, slide], atol=1e-6)
    np.testing.assert_allclose(forward(robot, found), poses, atol=1e-6)


def test_a_joint_that_is_free_in_a_row_stays_near_to_the_row_before() -> None:
    """Joints 4 and 6 of a wrist that is straight share a turn: of all pairs the nearest to the row before."""
    robot = load_robot("puma560")
    q = np.tile([0.2, 0.4, -1.8, 0.0, 0.5, 0.3], (30, 1))
    q[:, 3] = np.linspace(0.1, 1.5, 30)
    q[18, 4] = 0.0
    poses = forward(robot, q)
    rows = np.hstack([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    mixed = ("qz", "qx", "x", "qw", "z", "qy", "y")
    table = rows[:, [POSE.index(name) for name in mixed]]
    found = np.vstack(list(joints_of(ArmInUnits(robot, Units()), blocks(mixed, table), q[0], 1e-6).blocks))
    np.testing.assert_allclose(np.delete(found, 18, axis=0), np.delete(q, 18, axis=0), atol=1e-5)
    np.testing.assert_allclose(forward(robot, found[18]), poses[18], atol=1e-6)
    assert np.abs(found[18] - q[17])[[3, 5]].max() < 0.06


@pytest.mark.full
def test_an_arm_without_a_closed_form_goes_on_inside_its_ranges() -> None:
    """Three turns in the plane: a step is the shortest, of Newton's method, where that stays inside and near."""
    free = unlimited(3)
    robot = Robot(
        "three",
        (Joint("a", a=0.4), Joint("b", a=0.3), Joint("c", a=0.2)),
        replace(free, position=np.array([[-3.0, 3.0], [-2.5, 2.5], [-0.5, 0.5]])),
        "standard",
        np.eye(4),
        np.eye(4),
    )
    arm = ArmInUnits(robot, Units())
    q = np.column_stack([np.linspace(-1, 1, 50), np.linspace(0.4, 2.0, 50), np.full(50, 0.3)])
    p = forward(robot, q)[:, :3, 3]
    p = np.vstack([p, p[:1]])  # and back in one jump
    found = np.vstack(list(joints_of(arm, blocks("xyz", p), q[0], 1e-9).blocks))
    np.testing.assert_allclose(forward(robot, found)[:, :3, 3], p, atol=1e-9)
    low, high = robot.limits.position.T
    assert ((found >= low - 1e-8) & (found <= high + 1e-8)).all()
    assert np.abs(np.diff(found[:50], axis=0)).max() < 0.15
    solutions = solve(robot, partial_target(p[-1]), found[-2], 1e-9)
    every = solutions.joints[solutions.within_limits]
    assert np.abs(found[-1] - found[-2]).max() <= np.abs(every - found[-2]).max(axis=1).min() + 1e-6
    stretched = forward(robot, np.array([[0.3, 0.01, 0.01]]))[:, :3, 3]
    beyond = np.vstack([stretched, stretched * 0.9005 / np.linalg.norm(stretched)])  # half a millimetre
    with pytest.raises(PlanningError, match="row 1"):
        list(joints_of(arm, blocks("xyz", beyond), np.array([0.3, 0.01, 0.01]), 1e-6).blocks)
    far = np.vstack([p[:3], [[2.0, 0.0, 0.0]]])
    with pytest.raises(PlanningError, match="row 3"):
        list(joints_of(arm, blocks("xyz", far), q[0], 1e-9).blocks)
