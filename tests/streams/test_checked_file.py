"""Faults between the rows and the finished file, each of which must be found."""

from __future__ import annotations

import threading
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


class Disk:
    """A file that passes everything on, and does what `fault` does to it when it is flushed."""

    def __init__(self, stream, fault):
        self._stream, self._fault = stream, fault

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        if self._fault is full:
            raise OSError(ENOSPC, "No space left on device")
        return self._stream.write(text)

    def flush(self):
        self._stream.flush()
        self._fault(Path(self._stream.name))


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
    text = path.read_bytes()
    assert text[1000:1040] != text[50000:50040]
    path.write_bytes(text[:1000] + text[50000:50040] + text[1040:50000] + text[1000:1040] + text[50040:])


def written(tmp_path, monkeypatch, fault):
    @contextmanager
    def faulty(path):
        with whole_file(path) as stream:
            yield Disk(stream, fault)

    monkeypatch.setattr(formats, "whole_file", faulty)
    blocks = (ROWS[low : low + 600] for low in range(0, len(ROWS), 600))
    write_verified(tmp_path / "out.csv", blocks, COLUMNS)


def test_without_a_fault_the_file_appears(tmp_path, monkeypatch):
    written(tmp_path, monkeypatch, lambda path: None)
    read = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    assert np.abs(read - ROWS).max() <= 0.501e-9


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (flip(0), "checksum"),
        (flip(70_000), "checksum"),
        (flip(-1), "checksum"),
        (exchange, "checksum"),
        (cut(1), "bytes, but"),
        (cut(100_000), "bytes, but"),
        (lambda path: path.write_bytes(b""), "has 0 bytes"),
        (lambda path: path.write_bytes(path.read_bytes() + b"\n"), "bytes, but"),
    ],
)
def test_a_fault_of_the_disk_is_found(tmp_path, monkeypatch, fault, message):
    with pytest.raises(TrajcliError, match=f"the file read back .*{message}") as caught:
        written(tmp_path, monkeypatch, fault)
    assert caught.value.exit_code == 70
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_up_is_an_error_of_the_file(tmp_path, monkeypatch):
    before = threading.active_count()
    with pytest.raises(FileError, match="No space left"):
        written(tmp_path, monkeypatch, full)
    assert list(tmp_path.iterdir()) == []
    assert threading.active_count() == before


def test_rows_that_fail_leave_no_thread_and_no_file(tmp_path):
    def rows():
        yield ROWS[:600]
        raise KeyboardInterrupt

    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        write_verified(tmp_path / "out.csv", rows(), COLUMNS)
    assert threading.active_count() == before
    assert list(tmp_path.iterdir()) == []
