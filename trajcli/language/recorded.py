"""Recorded waypoints, and recorded poses of the tool."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, read_only
from trajcli.frozen import frozen

SAME_POSITION = 1e-9
"""rad or m: points no joint of which is further from the one before are one, as rounding leaves them."""

_SAME_POSITION_OF_TOOL = 1e-8  # m: what nine decimals leave of a position


@frozen
class Recorded:
    """Joint values recorded point by point.

    Attributes:
        positions: Shape (m, n), rad or m, m >= 1.
        times: Shape (m,), s, increasing; None where the file has none.
        file: Its name, for messages.
        merge: Points no joint of which is further than this from the one before are left out: rad or m, one
            for each joint, or none for zero.
    """

    positions: Array
    times: Array | None = None
    file: str = "recorded points"
    merge: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", read_only(self.positions))
        if self.times is not None:
            object.__setattr__(self, "times", read_only(self.times))

    def __eq__(self, other: object) -> bool:
        """Compare points, times and tolerance; the same points from another file are the same."""
        return isinstance(other, Recorded) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        times = b"" if self.times is None else self.times.tobytes()
        return self.positions.shape, self.positions.tobytes(), times, self.merge

    @property
    def _merge_distance(self) -> Array:
        return np.array(self.merge or (0.0,))

    def begins_at(self, start: Array) -> bool:
        """Return whether the first of several points is where the arm stands, `start` (n,)."""
        near = bool((np.abs(self.positions[0] - start) <= self._merge_distance).all())
        return near and len(self.positions) > 1

    def after(self, start: Array, target: Array | None = None) -> Recorded:
        """Return the points that come after `start`, and before `target` where the recording is not the end.

        A first point that is where the arm stands is the start itself, and times count from it. A point is
        left out where no joint is further than `merge` from the last point that was kept, the end apart; with
        times, only if `merge` is above zero, because standing still may be meant.

        Args:
            start: Where the arm stands when the recording begins, shape (n,).
            target: Where the move goes after the last point, shape (n,); None: the last point is its end.
        """
        first = int(self.begins_at(start))
        positions, times = self.positions[first:], self.times
        if times is not None:
            times = (times - times[0] if first else times)[first:]
        if times is None or any(self.merge):
            ends = positions if target is None else np.vstack([positions, target])
            rows = _moved(start, ends, np.maximum(self._merge_distance, SAME_POSITION))
            rows = rows if target is None else rows[:-1]
            positions, times = positions[rows], None if times is None else times[rows]
        return Recorded(positions, times, self.file, self.merge)


@frozen
class RecordedPoses:
    """Poses of the tool recorded one by one.

    Attributes:
        positions: Shape (m, 3), m, in world, m >= 1.
        quaternions: Unit quaternions (m, 4), w first; None where the file has none.
        file: Its name, for messages.
        merge: Poses that are no further than this from the one before are left out, m.
    """

    positions: Array
    quaternions: Array | None = None
    file: str = "recorded poses"
    merge: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", read_only(self.positions))
        if self.quaternions is not None:
            object.__setattr__(self, "quaternions", read_only(self.quaternions))

    def __eq__(self, other: object) -> bool:
        """Compare poses and tolerance; the same poses from another file are the same."""
        return isinstance(other, RecordedPoses) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        turned = b"" if self.quaternions is None else self.quaternions.tobytes()
        return self.positions.shape, self.positions.tobytes(), turned, self.merge

    def begins_at(self, start: Array) -> bool:
        """Return whether the first of several poses is where the tool is, (3,), m."""
        near = float(np.linalg.norm(self.positions[0] - start)) <= max(self.merge, _SAME_POSITION_OF_TOOL)
        return near and len(self.positions) > 1

    def after(self, start: Array) -> RecordedPoses:
        """Return the poses that come after a position (3,), m, none within `merge` of the one before.

        A first pose that is where the tool stands is the start itself. The last one is kept.
        """
        first = int(self.begins_at(start))
        rows = np.arange(first, len(self.positions))
        if self.merge > 0:
            rows = first + _kept(
                start, self.positions[first:], lambda step: bool(np.linalg.norm(step) > self.merge)
            )
        turned = None if self.quaternions is None else self.quaternions[rows]
        return RecordedPoses(self.positions[rows], turned, self.file, self.merge)


def _moved(start: Array, positions: Array, merge: Array) -> NDArray[np.intp]:
    """Return those rows of which a joint is further than `merge` from the last one kept, and the last row."""
    if (np.abs(np.diff(positions, axis=0, prepend=start[None])) > merge).any(axis=1).all():
        return np.arange(len(positions))
    return _kept(start, positions, lambda step: bool((np.abs(step) > merge).any()))


def _kept(start: Array, positions: Array, is_far: Callable[[Array], bool]) -> NDArray[np.intp]:
    """Return the rows that are far from the last one that was kept, and the last row."""
    kept, before = [], start
    for row, position in enumerate(positions):
        if is_far(position - before):
            kept.append(row)
            before = position
    end = len(positions) - 1
    return np.array(kept if kept[-1:] == [end] else [*kept[:-1], end], dtype=np.intp)
