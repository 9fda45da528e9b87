"""Faults between the rows and the finished file, each of which must be found."""

from __future__ import annotations

from contextlib import contextmanager
from errno import ENOSPC
from pathlib import Path

import numpy as np
import pytest

from trajcli.columns import parse_column
from trajcli.errors import FileError, TrajcliError
from trajcli.streams import formats
from trajcli.streams.formats import write_verified
from trajcli.streams.whole_file import whole_file

COLUMNS = [parse_column(name) for name in ("t", "q1", "q2")]
ROWS = np.column_stack([np.arange(5000) / 1000, np.random.default_rng(0).normal(size=(5000, 2))])


BLOCKS = [slice(low, low + 600) for low in range(0, len(ROWS), 600)]


class Disk:
    """A file that passes everything on, and does `fault` to it at one of its flushes, one a block and one more."""

    def __init__(self, stream, fault, at):
        self._stream, self._fault, self._left = stream, fault, at

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        if self._fault is full:
            raise OSError(ENOSPC, "No space left on device")
        return self._stream.write(text)

    def flush(self):
        self._stream.flush()
        if self._left == 0:
            self._fault(Path(self._stream.name))
        self._left -= 1


def full(path):
    pass


def flip(place):
    def fault(path):
        text = bytearray(path.read_bytes())
        text[place] ^= 1
        path.write_bytes(text)

    return fault


def cut(count):
    return lambda path: path.write_bytes(path.read_bytes()[:-count])


def exchange(path):
    """Exchange two pieces of the last block."""
    text = path.read_bytes()
    assert text[-1040:-1000] != text[-5040:-5000]
    path.write_bytes(text[:-5040] + text[-1040:-1000] + text[-5000:-1040] + text[-5040:-5000] + text[-1000:])


def written(tmp_path, monkeypatch, fault, at):
    @contextmanager
    def faulty(path):
        with whole_file(path) as stream:
            yield Disk(stream, fault, at)

    monkeypatch.setattr(formats, "whole_file", faulty)
    write_verified(tmp_path / "out.csv", (ROWS[block] for block in BLOCKS), COLUMNS)


def test_without_a_fault_the_file_appears(tmp_path, monkeypatch):
    written(tmp_path, monkeypatch, lambda path: None, 0)
    read = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    assert np.abs(read - ROWS).max() <= 0.501e-9


@pytest.mark.parametrize(
    ("fault", "at", "message"),
    [
        (flip(0), 0, "begins with"),
        (flip(5000), 0, ""),
        (flip(-1), 0, ""),
        (flip(-7000), 3, ""),
        (flip(-2), len(BLOCKS) - 1, ""),
        (exchange, 0, ""),
        (exchange, 5, ""),
        (cut(1), 4, ""),
        (cut(10_000), 4, ""),
        (cut(10_000), len(BLOCKS) - 1, "ends after"),
        (lambda path: path.write_bytes(b""), 0, "begins with"),
        (lambda path: path.write_bytes(path.read_bytes() + b"\n"), len(BLOCKS), ""),
        (
            lambda path: path.write_bytes(path.read_bytes() + b"0,0,0\n"),
            len(BLOCKS),
            "goes on after the 5000",
        ),
    ],
)
def test_a_fault_of_the_disk_is_found(tmp_path, monkeypatch, fault, at, message):
    with pytest.raises(TrajcliError, match=f"the file read back .*{message}") as caught:
        written(tmp_path, monkeypatch, fault, at)
    assert caught.value.exit_code == 70
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_is_an_error_of_the_file(tmp_path, monkeypatch):
    with pytest.raises(FileError, match="No space left"):
        written(tmp_path, monkeypatch, full, 0)
    assert list(tmp_path.iterdir()) == []


def test_rows_that_fail_leave_no_file(tmp_path):
    def rows():
        yield ROWS[:600]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_verified(tmp_path / "out.csv", rows(), COLUMNS)
    assert list(tmp_path.iterdir()) == []
