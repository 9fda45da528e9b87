"""Denavit-Hartenberg rows of chains of any axes, against products of their poses and turns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.kinematics.dh_rows import AxisInChain, DhTable, dh_table, row_pose


def pose(rotation: np.ndarray, point: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation, point
    return result


def motion(joint: AxisInChain, value: float) -> np.ndarray:
    """Return the displacement of a joint in its own frame."""
    if joint.prismatic:
        return pose(np.eye(3), value * joint.axis)
    return pose(Rotation.from_rotvec(value * joint.axis).as_matrix(), np.zeros(3))


def poses_of_links(joints: list[AxisInChain], tip: np.ndarray, q: np.ndarray) -> list[np.ndarray]:
    """Return the poses of all joints' frames behind their motion, and of the tip, in the root."""
    frame, result = np.eye(4), []
    for joint, value in zip(joints, q, strict=True):
        frame = frame @ joint.origin @ motion(joint, value)
        result.append(frame)
    return [*result, frame @ tip]


def poses_of_table(table: DhTable, joints: list[AxisInChain], q: np.ndarray) -> list[np.ndarray]:
    """Return the same by the rows, with the product of a row's turns and slides written out."""
    frame, result = table.base, []
    for (theta, d, a, alpha, beta), link, joint, value in zip(
        table.rows, table.links, joints, q, strict=True
    ):
        theta, d = (theta, d + value) if joint.prismatic else (theta + value, d)
        turns = [("z", theta, (0, 0, d)), ("x", alpha, (a, 0, 0)), ("y", beta, (0, 0, 0))]
        for axis, angle, step in turns:
            turn = pose(Rotation.from_euler(axis, angle).as_matrix(), np.zeros(3))
            frame = frame @ (
                pose(np.eye(3), np.array(step, dtype=float)) @ turn
                if axis == "x"
                else turn @ pose(np.eye(3), np.array(step, dtype=float))
            )
        result.append(frame @ link)
    return [*result, frame @ table.tool]


def chain(rng: np.random.Generator, count: int, kind: str) -> tuple[list[AxisInChain], np.ndarray]:
    """Return joints whose axes are any, or at right angles, or parallel, or almost; slides among them."""
    joints = []
    for _ in range(count):
        point = rng.uniform(-1, 1, 3) * rng.choice([0, 1], 3)
        if kind == "any":
            rotation, axis = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
        else:
            rotation = Rotation.from_euler("xyz", rng.integers(-1, 3, 3) * np.pi / 2).as_matrix().round()
            axis = np.eye(3)[rng.integers(3)] * rng.choice([-1, 1])
        if kind == "almost parallel":
            rotation = Rotation.from_rotvec(rng.normal(size=3) * 10.0 ** rng.uniform(-9, -4)).as_matrix()
            axis = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
            point = rng.uniform(-1, 1, 3)
        joints.append(
            AxisInChain(bool(rng.random() < 0.3), pose(rotation, point), axis / np.linalg.norm(axis))
        )
    tip = pose(Rotation.random(rng=rng).as_matrix() if kind == "any" else np.eye(3), rng.uniform(-1, 1, 3))
    return joints, tip


@pytest.mark.parametrize("kind", ["any", "right", "almost parallel"])
@pytest.mark.parametrize("seed", range(12))
def test_a_chain_and_its_rows_move_alike(kind: str, seed: int) -> None:
    """Tip and links, with a first joint that slides and next ones that do; a >= 0, and no number is out of bounds."""
    rng = np.random.default_rng(seed)
    joints, tip = chain(rng, 1 + seed % 6, kind)
    table = dh_table(joints, tip)
    for q in rng.uniform(-2, 2, (3, len(joints))):
        for ours, wanted in zip(
            poses_of_table(table, joints, q), poses_of_links(joints, tip, q), strict=True
        ):
            np.testing.assert_allclose(
                ours, wanted, rtol=0, atol=1e-11 if kind == "almost parallel" else 1e-13
            )
    rows = np.array(table.rows)
    assert (rows[:, 2] >= 0.0).all()
    assert (np.abs(rows[:, [0, 3, 4]]) <= np.pi).all()
    assert np.abs(rows[:, 1:3]).max() < 1e4
    assert not np.signbit(rows[rows == 0.0]).any()
    if kind == "right":
        assert (rows[:, 3] / (np.pi / 2) == (rows[:, 3] / (np.pi / 2)).round()).all()
        turn = table.base[:3, :3]
        assert (turn == turn.round()).all()
        assert not np.signbit(turn[turn == 0.0]).any()


def two(axis: list[float], point: list[float], slides: bool = False) -> DhTable:
    """Return the table of a turn about z of the root, and a joint with its axis through a point."""
    first = AxisInChain(False, np.eye(4), np.array([0.0, 0.0, 1.0]))
    size = np.linalg.norm(axis)
    second = AxisInChain(slides, pose(np.eye(3), np.array(point)), np.array(axis) / size)
    return dh_table([first, second], np.eye(4))


@pytest.mark.parametrize(
    ("axis", "point", "slides", "row"),
    [
        (
            [0, 0, 1],
            [0.3, 0.4, 0.7],
            False,
            (np.arctan2(4, 3), 0.0, 0.5, 0.0, 0.0),
        ),  # d is left to the next row
        ([0, 0, -1], [0.3, 0.4, 0.7], False, (np.arctan2(4, 3), 0.0, 0.5, np.pi, 0.0)),
        ([0, 0, 1], [0.0, 0.0, 0.7], False, (0.0, 0.0, 0.0, 0.0, 0.0)),
        ([0, 0, 1], [0.0, 1e-16, 0.7], False, (0.0, 0.0, 0.0, 0.0, 0.0)),
        ([1e-4, 0, 1], [0.0, 1e-16, 0.0], False, (0.0, 0.0, 0.0, 0.0, np.arctan(1e-4))),
        ([0, 0, 1], [0.3, 0.4, 0.7], True, (0.0, 0.0, 0.0, 0.0, 0.0)),  # a slide has no line of its own
        ([0, -1, 0], [0.5, 0.2, 0.7], False, (0.0, 0.7, 0.5, np.pi / 2, 0.0)),
        ([0, 1, 0], [0.5, 0.2, 0.7], False, (0.0, 0.7, 0.5, -np.pi / 2, 0.0)),
        ([0, 1, 0], [-0.5, 0.2, 0.7], False, (np.pi, 0.7, 0.5, np.pi / 2, 0.0)),
        (
            [1, 0, 0],
            [0.5, 0.0, 0.7],
            False,
            (np.pi / 2, 0.7, 0.0, np.pi / 2, 0.0),
        ),  # they meet: theta within a quarter
        ([-1, 0, 0], [0.5, 0.0, 0.7], False, (np.pi / 2, 0.7, 0.0, -np.pi / 2, 0.0)),
        ([0, 1, 0], [0.0, 0.2, 0.7], False, (0.0, 0.7, 0.0, -np.pi / 2, 0.0)),
        ([0, -1, 0], [0.0, 0.2, 0.7], False, (0.0, 0.7, 0.0, np.pi / 2, 0.0)),
        ([0, -1, 0], [0.5, 0.2, 0.7], True, (0.0, 0.0, 0.0, np.pi / 2, 0.0)),
        ([0, -1, 1], [0.5, 0.2, 0.7], False, (0.0, 0.9, 0.5, np.pi / 4, 0.0)),  # the normal stands higher
    ],
)
def test_rows_between_two_axes_are_those_of_the_drawing(axis, point, slides, row) -> None:
    np.testing.assert_allclose(two(axis, point, slides).rows[0], row, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("tilt", "hayati"), [(1e-13, True), (0.9e-3, True), (1.1e-3, False), (1e-15, False)])
def test_axes_are_almost_parallel_below_a_thousandth_and_parallel_where_rounding_tilts_them(
    tilt, hayati
) -> None:
    _, d, a, alpha, beta = two([np.sin(tilt), 0.0, np.cos(tilt)], [0.3, 0.4, 0.7]).rows[0]
    assert (beta != 0.0) == hayati
    assert (d == 0.0) == (tilt < 1e-3)
    if hayati:  # through where the axis passes z = 0
        np.testing.assert_allclose(a, np.hypot(0.3 - 0.7 * np.tan(tilt), 0.4), rtol=1e-15)
    if tilt < 1e-14:
        assert (alpha, beta) == (0.0, 0.0)
    assert two([0.5e-3, 0.0, 1.0], [0.3, 0.4, 0.7], True).rows[0][4] == 0.0


def test_the_last_row_takes_what_it_can_of_the_tool() -> None:
    joint = AxisInChain(False, np.eye(4), np.array([0.0, 0.0, 1.0]))
    turn = Rotation.from_euler("z", 0.3).as_matrix()
    upright = dh_table([joint], pose(turn, np.array([0.1, 0.2, 0.4])))
    np.testing.assert_allclose(upright.rows[0], (0.3, 0.4, 0.0, 0.0, 0.0), rtol=0, atol=1e-15)
    back = Rotation.from_euler("z", -0.3).as_matrix() @ [0.1, 0.2, 0.0]
    np.testing.assert_allclose(upright.tool, pose(np.eye(3), back), rtol=0, atol=1e-15)
    for rotation in (np.diag([1.0, -1.0, -1.0]), Rotation.from_euler("y", 1e-9).as_matrix()):
        tip = pose(rotation, np.array([0.1, 0.2, 0.4]))
        other = dh_table([joint], tip)
        assert other.rows == ((0.0,) * 5,)
        np.testing.assert_allclose(other.tool, tip, rtol=0, atol=1e-15)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 3e-16, 1), (0.6, 0, 0.8)])
@pytest.mark.parametrize("slides", [False, True])
def test_the_base_stands_on_the_first_axis_next_to_the_root(axis, slides) -> None:
    """Its z axis is the joint's and its x axis in the plane of that and the root's x; a slide starts at the root."""
    point = np.array([0.3, -0.2, 0.7])
    joint = AxisInChain(slides, pose(np.eye(3), point), np.array(axis, dtype=float))
    base = dh_table([joint], np.eye(4)).base
    np.testing.assert_allclose(base[:3, 2], axis, rtol=0, atol=1e-15)
    z = base[:3, 2]
    np.testing.assert_allclose(
        base[:3, 3], np.zeros(3) if slides else point - (point @ z) * z, rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(base[:3, :3].T @ base[:3, :3], np.eye(3), rtol=0, atol=1e-15)
    assert np.linalg.det(base[:3, :3]) > 0.0
    assert abs(np.cross([0.0, 1.0, 0.0] if abs(axis[0]) == 1 else [1.0, 0.0, 0.0], z) @ base[:3, 0]) < 1e-15
    assert (base[:3, :3] == base[:3, :3].round()).all() or axis[0] == 0.6
    assert not np.signbit(base[base == 0.0]).any()


def test_a_pose_of_a_row_is_the_product_of_its_turns_and_slides() -> None:
    theta, d, a, alpha, beta = row = (0.3, 0.2, 0.5, -0.7, 0.4)
    turns = [Rotation.from_euler(axis, angle) for axis, angle in (("z", theta), ("x", alpha), ("y", beta))]
    point = turns[0].apply([a, 0.0, 0.0]) + np.array([0.0, 0.0, d])
    np.testing.assert_allclose(
        row_pose(row), pose((turns[0] * turns[1] * turns[2]).as_matrix(), point), atol=1e-15
    )
