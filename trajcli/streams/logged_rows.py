"""Rows from logs of messages, one for each state of joints, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.mcap.read import LoggedMotion, log_blocks
from trajcli.streams.row_sources import EXACT, in_columns

_NANOSECONDS = 9  # decimals of a stamp in whole nanoseconds


class LoggedRows:
    """Rows of a topic, which are read anew whenever they are asked for."""

    format = "mcap"
    si = True
    notes: tuple[str, ...] = ()

    def __init__(self, source: ByteSource, topic: str | None, field: str | None) -> None:
        """Read the first messages.

        Raises:
            FileError: When the file cannot be read.
            InputError: When it is no MCAP, or has no such topic or field.
        """
        self._source, self._topic, self._field = source, topic, field
        with source.open() as stream:
            first = next(log_blocks(stream, source.file, topic, field))
        self.joint_names: tuple[str, ...] | None = first.joint_names
        self._efforts = first.effort.shape[1]
        self.named, _ = in_columns(source.file, first.times, _states(first))
        self.relative = np.zeros(len(self.named.names))

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        with self._source.open() as stream:
            for block in log_blocks(stream, self._source.file, self._topic, self._field):
                if block.effort.shape[1] < self._efforts:
                    raise InputError(f"{self._source.file}: an effort of {block.topic} is not finite")
                states = (*_states(block)[:3], block.effort[:, : self._efforts])
                yield in_columns(self._source.file, block.times, states)[1][:, list(taken)]

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return that stamps are whole nanoseconds, and nothing else is rounded."""
        return np.array([EXACT if index else _NANOSECONDS for index in taken], dtype=np.int64)


def _states(motion: LoggedMotion) -> tuple[Array, Array, Array, Array]:
    return motion.position, motion.velocity, motion.acceleration, motion.effort
