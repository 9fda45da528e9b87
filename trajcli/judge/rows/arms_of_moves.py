"""The arm with the tool that is on its flange in each move of a job."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import MountedTool, Robot
from trajcli.planners.planner import PlannedMove


class ArmsOfMoves:
    """An arm whose tool may differ from move to move.

    Attributes:
        own: The arm with its first tool.
        changes: Whether any move has another one.
    """

    def __init__(self, own: Robot, moves: Iterable[PlannedMove]) -> None:
        """Take the tools of moves.

        Args:
            own: The arm with its first tool, as it stands in some frame.
            moves: Of the job; those without another tool count as none.
        """
        self.own = own
        by_tool: dict[bytes, Robot] = {own.tool.tobytes(): own}
        self._by_move: dict[int, Robot] = {}
        for move in moves:
            bits = move.robot.tool.tobytes()
            if bits not in by_tool:
                by_tool[bits] = own.with_tool(MountedTool(move.robot.tool))
            if by_tool[bits] is not own:
                self._by_move[move.index] = by_tool[bits]
        self.changes = bool(self._by_move)

    def of(self, move: int) -> Robot:
        """Return the arm of a move."""
        return self._by_move.get(move, self.own)

    def values(
        self,
        count: int,
        moves: NDArray[np.int64] | None,
        of_arm: Callable[[Robot, NDArray[np.intp]], Array],
    ) -> Array:
        """Return values of rows (N, ...), each of the arm of its move.

        Args:
            count: How many rows.
            moves: Index of the move of each row, (N,); None where nothing says it: the first tool counts.
            of_arm: Values of an arm and of the indices of some rows, shape (k, ...).
        """
        if moves is None or not self.changes:
            return of_arm(self.own, np.arange(count))
        found: Array | None = None
        arms = {id(self.of(move)): self.of(move) for move in np.unique(moves).tolist()}
        owner = np.array([id(self.of(move)) for move in moves.tolist()])
        for key, arm in arms.items():
            rows = np.flatnonzero(owner == key)
            part = of_arm(arm, rows)
            found = np.empty((moves.size, *part.shape[1:])) if found is None else found
            found[rows] = part
        return np.empty(0) if found is None else found
