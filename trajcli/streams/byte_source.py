"""Bytes of a file or of standard input, which can be read several times."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import SpooledTemporaryFile
from typing import IO, BinaryIO
from weakref import finalize

from trajcli.errors import FileError
from trajcli.streams.table import opened
from trajcli.streams.whole_file import is_special

_IN_MEMORY = 1 << 24  # bytes of a pipe that are held before they go to a temporary file
_COPIED = 1 << 20  # bytes at a time


class ByteSource:
    """A file, or what came through a pipe.

    Attributes:
        file: Its name, for messages.
        rate: Rows per second, where the file has no time and somebody says them; else None.
    """

    def __init__(self, source: str | Path, rate: float | None = None) -> None:
        """Open a path; "-" is standard input. What is no plain file is read to its end.

        Args:
            source: The path.
            rate: As the attribute.

        Raises:
            FileError: When it cannot be read.
        """
        self.file = "stdin" if str(source) == "-" else str(source)
        self.rate, self._path = rate, Path(source)
        self._spool: IO[bytes] | None = None
        if str(source) == "-" or is_special(str(source)):
            self._spool = SpooledTemporaryFile(max_size=_IN_MEMORY)  # noqa: SIM115
            finalize(self, self._spool.close)
            with opened(source, self.file) as stream:
                shutil.copyfileobj(stream, self._spool, _COPIED)

    @property
    def ending(self) -> str:
        """What the file's name ends in, in lower case, with its point; nothing for a pipe."""
        return "" if self._spool is not None else self._path.suffix.lower()

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """Give the bytes from the first on.

        Raises:
            FileError: When they cannot be read.
        """
        if self._spool is not None:
            self._spool.seek(0)
            yield self._spool  # type: ignore[misc]
            return
        try:
            with self._path.open("rb") as stream:
                yield stream
        except OSError as error:
            raise FileError(f"cannot read {self.file}: {error.strerror or error}") from error

    def head(self, count: int) -> bytes:
        """Return the first bytes."""
        with self.open() as stream:
            return stream.read(count)
