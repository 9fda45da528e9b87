"""Comparison of a written log with the rows that it was written from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import BinaryIO

import numpy as np

from trajcli.columns import Column
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.streams.mcap.decode import JointSeries, joint_states
from trajcli.streams.mcap.log_records import HEAD, LogRecords, MessageBlock
from trajcli.streams.mcap.messages import BY_ROW, JOINT_ACCELERATIONS, JOINT_STATES
from trajcli.streams.mcap.recording import Recording
from trajcli.streams.mcap.records import RECORD_HEAD


def verify_mcap(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], recording: Recording
) -> None:
    """Read a log from its beginning and compare every state with the rows, bit by bit.

    Args:
        written: What `write_mcap_blocks` wrote; it need hold a block only when that was taken from `rows`.
        rows: The same blocks once more.
        columns: As in `write_mcap_blocks`.
        recording: Likewise.

    Raises:
        TrajcliError: When a state, a checksum or a count differs.
    """
    written.seek(0)
    log = _StatesReadBack(written)
    where = {
        kind: [k for k, column in enumerate(columns) if column.kind == kind]
        for kind in ("q", "qd", "qdd", "tau")
    }
    count = 0
    for block in rows:
        times = np.rint(block[:, 0] * 1e9).astype(np.int64) + recording.epoch
        states = {JOINT_STATES: ("q", "qd", "tau"), JOINT_ACCELERATIONS: ("qdd",)}
        for topic, kinds in states.items():
            if not where[kinds[0]]:
                continue
            read = log.take(topic, len(block))
            if not np.array_equal(read[0], times):
                raise TrajcliError(f"{topic} read back has other times than were written from row {count} on")
            for kind, values in zip(kinds, read[1:], strict=False):
                _compare(values, block[:, where[kind]], f"{kind} in {topic}", count)
        count += len(block)
    log.finish(count, recording)


def _compare(read: Array, wanted: Array, what: str, before: int) -> None:
    if read.shape != wanted.shape:
        raise TrajcliError(f"the file read back has {read.shape[1]} of {wanted.shape[1]} columns {what}")
    wrong = read.view(np.int64) != np.ascontiguousarray(wanted).view(np.int64)
    if wrong.any():
        row, joint = np.argwhere(wrong)[0]
        raise TrajcliError(
            f"the file read back says {read[row, joint]!r} in row {before + row}, joint {joint + 1}, of "
            f"{what}, where the curve is {wanted[row, joint]!r}"
        )


class _StatesReadBack:
    """The states of a log, as many at a time as are asked for."""

    def __init__(self, stream: BinaryIO) -> None:
        self._log = LogRecords(stream, "the file read back", checked=True)
        self._blocks = self._log.blocks()
        self._left: dict[str, list[JointSeries]] = {JOINT_STATES: [], JOINT_ACCELERATIONS: []}
        self._counts: dict[int, int] = {}

    def take(self, topic: str, count: int) -> tuple[Array, ...]:
        """Return times, positions, velocities and efforts of the next messages of a topic."""
        parts = self._left[topic]
        while sum(part.nanoseconds.size for part in parts) < count:
            block = next(self._blocks, None)
            if block is None:
                raise TrajcliError(f"the file read back has too few messages of {topic}")
            self._note(block)
        names = ("nanoseconds", "position", "velocity", "effort")
        whole = [np.concatenate([getattr(part, name) for part in parts]) for name in names]
        others = {name: values[count:] for name, values in zip(names, whole, strict=True)}
        none = others["position"][:, :0]
        self._left[topic] = [JointSeries(parts[0].names, **others, acceleration=none)]
        return tuple(values[:count] for values in whole)

    def _note(self, block: MessageBlock) -> None:
        for channel, offsets in block.offsets.items():
            self._counts[channel] = self._counts.get(channel, 0) + offsets.size
            topic = self._log.channels[channel].topic
            if topic in self._left and offsets.size:
                lengths = block.heads(offsets)["length"].astype(np.int64) - (HEAD - RECORD_HEAD.size)
                self._left[topic].append(joint_states(block.data, offsets + HEAD, lengths))

    def finish(self, rows: int, recording: Recording) -> None:
        """Read the rest, and refuse other counts than were written."""
        for block in self._blocks:
            self._note(block)
        statistics, log = self._log.statistics, self._log
        counts = {channel: count for channel, count in self._counts.items() if count}
        if statistics is None or statistics.channel_message_counts != counts:
            raise TrajcliError("the file read back has other messages than its summary counts")
        by_topic = {log.channels[channel].topic: count for channel, count in counts.items()}
        if any(by_topic[topic] != rows for topic in BY_ROW if topic in by_topic) or (
            log.metadata.get("trajcli") != dict(recording.metadata)
        ):
            raise TrajcliError("the file read back has other messages or metadata than were written")
