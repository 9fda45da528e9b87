"""JSON lines: an object for each row, with an array for each group of columns, in SI.

A line reads `{"t": 0.008, "q": [...], "qd": [...], "qdd": [...], "move": 0}`, by the columns in use. The
numbers of a pose are under `pose` (x, y, z, qw, qx, qy, qz), those of `twist`, `twistd` and `path` likewise.
Each number has as many digits as restore all its bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, BinaryIO

import numpy as np

from trajcli.columns import SIGNALS, Column, group_of, require_finite
from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.frozen import frozen


@frozen
class _Key:
    """A key of each object: the columns [first, stop) of its rows; a single number where it stands alone."""

    name: str
    first: int
    stop: int
    alone: bool
    whole_numbers: bool

    def of(self, row: list[float]) -> Any:  # noqa: ANN401
        if not self.alone:
            return row[self.first : self.stop]
        return int(row[self.first]) if self.whole_numbers else row[self.first]


def write_jsonl_blocks(rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO) -> Iterator[Array]:
    """Write blocks of rows (N, m) in SI, and yield each as soon as its text has left for `out`.

    Args:
        rows: Blocks; they are taken one by one, so that memory does not grow with their number.
        columns: What the rows hold; whole groups in SI.
        out: Where to.

    Raises:
        TrajcliError: When a value is not finite; its row and what follows are not written.
    """
    from pydantic_core import to_json

    keys = _keys(columns)
    written = 0
    for block in rows:
        require_finite(block, columns, written)
        lines = (to_json({key.name: key.of(row) for key in keys}) for row in block.tolist())
        out.write(b"".join(line + b"\n" for line in lines))
        written += len(block)
        yield block


def verify_jsonl(written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column]) -> None:
    """Read a stream from its beginning and compare every number, bit by bit, with the rows behind it.

    Args:
        written: What `write_jsonl_blocks` wrote; it need hold no block that is not yet taken from `rows`.
        rows: The same blocks once more.
        columns: As in `write_jsonl_blocks`.

    Raises:
        TrajcliError: When a key, a number or the count of rows differs.
    """
    written.seek(0)
    keys, count = _keys(columns), 0
    for block in rows:
        for row in block:
            line = written.readline()
            if not line.endswith(b"\n"):
                raise TrajcliError(f"the file read back ends after {count} rows, but more were written")
            if not np.array_equal(_numbers(line, keys, count), row):
                raise TrajcliError(f"row {count} of the file read back differs from what was written")
            count += 1
    if written.read(1):
        raise TrajcliError(f"the file read back goes on after the {count} rows that were written")


def _numbers(line: bytes, keys: Sequence[_Key], row: int) -> list[float]:
    """Return the numbers of a line, in the order of the columns."""
    from pydantic_core import from_json

    try:
        value = from_json(line)
        if list(value) != [key.name for key in keys]:
            raise TrajcliError(f"row {row} of the file read back has other keys than were written")
        return [number for key in keys for number in ([value[key.name]] if key.alone else value[key.name])]
    except (ValueError, TypeError) as error:
        raise TrajcliError(f"row {row} of the file read back is no object of numbers: {error}") from error


def _keys(columns: Sequence[Column]) -> tuple[_Key, ...]:
    """Return the keys of each object, in the order of the columns."""
    keys: list[_Key] = []
    for index, column in enumerate(columns):
        group = column.kind if group_of(column) == SIGNALS else group_of(column)
        if keys and keys[-1].name == group:
            keys[-1] = _Key(group, keys[-1].first, index + 1, alone=False, whole_numbers=False)
        elif any(key.name == group for key in keys):
            raise TrajcliError(f"the columns {group} stand apart")
        else:
            alone = group == column.kind and column.joint is None
            keys.append(_Key(group, index, index + 1, alone, column.whole_numbers))
    return tuple(keys)
