"""Joint states and trajectories from messages in CDR, many at once where they are laid out alike.

The messages of a topic mostly differ in nothing but their numbers: the layout of the first is read entry by
entry, and taken for all that have the same bytes around the numbers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.streams.mcap.cdr import Bytes

_STATES = ("position", "velocity", "acceleration", "effort")
STAMP = (4, 8)
"""Where the stamp of a message stands, and its length, bytes."""


class DamagedMessageError(ValueError):
    """A message that ends too early, or is no CDR of its type."""


@frozen
class JointSeries:
    """States of joints at N times.

    Attributes:
        names: n names.
        nanoseconds: Shape (N,).
        position: Shape (N, n), or (N, 0) where the messages have none, as the others.
        velocity: Likewise.
        acceleration: Likewise.
        effort: Likewise.
    """

    names: tuple[str, ...]
    nanoseconds: NDArray[np.int64]
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array


@comparable
class StateLayout:
    """Where the parts of a message with one state of joints stand.

    Attributes:
        order: "<" or ">", of its bytes.
        names: Of the joints.
        sequences: Offset and count of positions, velocities, accelerations and efforts.
        free: Offset and length, in bytes, of all parts but the stamp that differ from message to message.
        length: Of the message, in bytes.
    """

    order: str
    names: tuple[str, ...]
    sequences: tuple[tuple[int, int], ...]
    free: tuple[tuple[int, int], ...]
    length: int


class _Cursor:
    """A place in a message that moves along its entries."""

    def __init__(self, message: bytes) -> None:
        if len(message) < 4 or message[0] != 0 or message[1] not in (0, 1):
            raise DamagedMessageError("it is not in plain CDR")
        self.order, self.message, self.at = "<" if message[1] else ">", message, 4

    def number(self, kind: str, size: int) -> int:
        self.align(size)
        self.need(size)
        (value,) = struct.unpack_from(self.order + kind, self.message, self.at)
        self.at += size
        return int(value)

    def align(self, size: int) -> None:
        self.at += (4 - self.at) % size

    def need(self, size: int) -> None:
        if self.at + size > len(self.message):
            raise DamagedMessageError(f"it ends after {len(self.message)} bytes")

    def text(self) -> str:
        size = self.number("I", 4)
        self.need(size)
        data = self.message[self.at : self.at + size]
        self.at += size
        return data.rstrip(b"\0").decode("utf-8", "replace")

    def texts(self) -> tuple[str, ...]:
        count = self.number("I", 4)
        self.need(4 * count)
        return tuple(self.text() for _ in range(count))

    def sequence(self) -> tuple[int, int]:
        """Return where a sequence of float64 starts, and its count."""
        count = self.number("I", 4)
        if count:
            self.align(8)
        self.need(8 * count)
        start = self.at
        self.at += 8 * count
        return start, count

    def time(self) -> int:
        """Return a time, ns."""
        return self.number("i", 4) * 1_000_000_000 + self.number("I", 4)

    def values(self) -> Array:
        start, count = self.sequence()
        return np.frombuffer(self.message, self.order + "f8", count, start).astype(np.float64)


def joint_state_layout(message: bytes) -> StateLayout:
    """Return the layout of a sensor_msgs/JointState message.

    Raises:
        DamagedMessageError: When it is damaged.
    """
    cursor = _Cursor(message)
    cursor.time()
    cursor.text()
    names = cursor.texts()
    position, velocity, effort = (cursor.sequence() for _ in range(3))
    return _layout(cursor, names, (position, velocity, (cursor.at, 0), effort), (position, velocity, effort))


def controller_state_layout(message: bytes, fields: Sequence[str], field: str) -> StateLayout:
    """Return the layout of a field of a control_msgs/JointTrajectoryControllerState message.

    Args:
        message: The message.
        fields: Names of its fields that are points of trajectories, in their order.
        field: Which of them.

    Raises:
        DamagedMessageError: When it is damaged.
    """
    cursor = _Cursor(message)
    cursor.time()
    cursor.text()
    names = cursor.texts()
    chosen: tuple[tuple[int, int], ...] = ()
    every: list[tuple[int, int]] = []
    for name in fields:
        sequences = tuple(cursor.sequence() for _ in _STATES)
        cursor.align(4)
        duration = (cursor.at, 1)
        cursor.time()
        every += [*sequences, duration]
        chosen = sequences if name == field else chosen
    return _layout(cursor, names, chosen, every)


def _layout(
    cursor: _Cursor,
    names: tuple[str, ...],
    sequences: tuple[tuple[int, int], ...],
    numbers: Sequence[tuple[int, int]],
) -> StateLayout:
    for (_, count), what in zip(sequences, _STATES, strict=True):
        if count not in (0, len(names)):
            raise DamagedMessageError(f"it has {count} values of {what} for {len(names)} joints")
    free = tuple((at, 8 * count) for at, count in numbers)
    return StateLayout(cursor.order, names, sequences, free, len(cursor.message))


def joint_states(
    data: Bytes,
    starts: NDArray[np.int64],
    lengths: NDArray[np.int64],
    layout_of: Callable[[bytes], StateLayout] = joint_state_layout,
) -> JointSeries:
    """Return the states of messages that hold one each; JointState has no accelerations.

    Args:
        data: Bytes in which the messages stand.
        starts: Where each starts, shape (N,), N >= 1.
        lengths: Of each, shape (N,).
        layout_of: Where the parts of a message stand.

    Raises:
        DamagedMessageError: When one is damaged, or has other joints or quantities than the first.
    """
    count = starts.size
    first = layout_of(data[starts[0] : starts[0] + lengths[0]].tobytes())
    stamps = np.empty(count, np.int64)
    values = [np.empty((count, number)) for _, number in first.sequences]
    left = np.arange(count)
    while left.size:
        start, length = int(starts[left[0]]), int(lengths[left[0]])
        layout = layout_of(data[start : start + length].tobytes())
        same = [number for _, number in layout.sequences] == [number for _, number in first.sequences]
        if layout.names != first.names or not same:
            raise DamagedMessageError("it is about other joints or quantities than the first of its topic")
        alike = left[lengths[left] == length]
        raw = np.lib.stride_tricks.sliding_window_view(data, length)[starts[alike]]
        fits = _fits(raw, layout)
        if not fits.all():
            alike, raw = alike[fits], raw[fits]
        stamps[alike] = _stamps(raw, layout.order)
        for out, (at, number) in zip(values, layout.sequences, strict=True):
            part = np.ascontiguousarray(raw[:, at : at + 8 * number])
            out[alike] = part.view(layout.order + "f8") if number else part.astype(np.float64)
        left = left[:0] if alike.size == left.size else np.setdiff1d(left, alike, assume_unique=True)
    return JointSeries(first.names, stamps, *(values[0], values[1], values[2], values[3]))


def _fits(raw: Bytes, layout: StateLayout) -> NDArray[np.bool_]:
    """Return which messages (N, length) have the bytes of the first but for stamp and numbers."""
    fits = np.ones(len(raw), dtype=bool)
    low = 0
    for at, length in (STAMP, *layout.free, (layout.length, 0)):
        same = raw[:, low:at] == raw[0, low:at]
        if not same.all():  # of all bytes at once that is seen soonest
            fits &= same.all(axis=1)
        low = at + length
    return fits


def _stamps(raw: Bytes, order: str) -> NDArray[np.int64]:
    seconds, nanoseconds = (
        np.ascontiguousarray(raw[:, at : at + 4]).view(order + kind)[:, 0].astype(np.int64)
        for at, kind in ((4, "i4"), (8, "u4"))
    )
    return seconds * 1_000_000_000 + nanoseconds


def joint_trajectory(message: bytes) -> JointSeries:
    """Return the points of a trajectory_msgs/JointTrajectory message, at their times from its start.

    Raises:
        DamagedMessageError: When it is damaged, or its points differ in what they give.
    """
    cursor = _Cursor(message)
    cursor.time()
    cursor.text()
    names = cursor.texts()
    count = cursor.number("I", 4)
    if not count:
        raise DamagedMessageError("it has no points")
    cursor.need(24 * count)
    times, states = np.empty(count, np.int64), []
    for k in range(count):
        states.append([cursor.values() for _ in _STATES])
        times[k] = cursor.time()
        sizes = [each.size for each in states[k]]
        if sizes != [each.size for each in states[0]] or not {*sizes} <= {0, len(names)}:
            raise DamagedMessageError(f"its point {k} has {sizes} values for {len(names)} joints")
    columns = [np.array([state[k] for state in states]).reshape(count, -1) for k in range(len(_STATES))]
    return JointSeries(names, times, *(columns[0], columns[1], columns[2], columns[3]))
