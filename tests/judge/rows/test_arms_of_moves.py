"""Each move has the arm with its own tool, in the frame in which the rows are."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trajcli
from trajcli.judge.rows.tool_rows import ArmsOfMoves
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import MountedTool, Robot


def pose(seed: int) -> np.ndarray:
    """Return a random frame (4, 4)."""
    rng, found = np.random.default_rng(seed), np.eye(4)
    found[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    found[:3, 3] = rng.uniform(-0.3, 0.3, 3)
    return found


FRAME = pose(99)
ARM: Robot = trajcli.load_robot("ur5e")
TOOLS = {0: pose(0), 1: pose(1), 2: pose(0), 4: pose(2), 7: pose(3)}
"""By the index of a move: the third one has the tool of the first again, two indices are of no move."""


def arms(count: int = 5) -> ArmsOfMoves:
    """Return the arms of some moves, rows seen in a frame; the first tool is that of the first move."""
    own = ARM.with_tool(MountedTool(TOOLS[0])).seen_from(FRAME)
    moves = [
        SimpleNamespace(index=index, robot=ARM.with_tool(MountedTool(tool)))
        for index, tool in list(TOOLS.items())[:count]
    ]
    return ArmsOfMoves(own, moves)


def test_the_arm_of_a_move_has_its_tool_and_stands_where_rows_are_seen_from() -> None:
    """The pose of the tool in the frame is the inverse frame times that in the world."""
    q = np.random.default_rng(5).uniform(-1, 1, 6)
    found = arms()
    assert found.changes
    for move in range(8):
        tool = TOOLS.get(move, TOOLS[0])
        in_world = forward(ARM.with_tool(MountedTool(tool)), q)
        np.testing.assert_allclose(forward(found.of(move), q), np.linalg.inv(FRAME) @ in_world, atol=1e-12)
    assert not arms(1).changes


@pytest.mark.parametrize("moves", [[0, 1, 2, 4, 7], [7, 7, 4, 1, 0, 2, 1, 4], [4], [3, 1, 3], [2, 0]])
def test_values_of_rows_are_those_of_the_arm_of_their_move(moves: list[int]) -> None:
    q = np.random.default_rng(6).uniform(-1, 1, (len(moves), 6))
    found = arms()
    poses = found.values(len(moves), np.array(moves), lambda arm, k: forward(arm, q[k]))
    wanted = [forward(found.of(move), row) for move, row in zip(moves, q, strict=True)]
    np.testing.assert_allclose(poses, np.stack(wanted), atol=1e-13)
    of_first = found.values(len(moves), None, lambda arm, k: forward(arm, q[k]))
    np.testing.assert_allclose(of_first, forward(found.own, q), atol=1e-13)


def test_no_rows_have_no_values() -> None:
    """As in a block all of whose rows are left out."""
    nothing = np.empty(0, dtype=np.int64)
    assert arms().values(0, nothing, lambda arm, k: forward(arm, np.zeros((k.size, 6)))).size == 0
