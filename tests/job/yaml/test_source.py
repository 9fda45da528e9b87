"""Files and standard input as sources."""

from __future__ import annotations

import io
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from trajcli.errors import FileError, InputError
from trajcli.job.yaml.load import read_document

TEXT = "a: 1\n"


def test_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(TEXT.encode())))
    read = read_document("-")
    assert (read.file, read.plain()) == ("<stdin>", {"a": 1})
    for broken in (None, SimpleNamespace(buffer=io.BytesIO())):
        if broken is not None:
            broken.buffer.close()
        monkeypatch.setattr(sys, "stdin", broken)
        with pytest.raises(FileError, match="standard input"):
            read_document("-")


def test_files(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(TEXT)
    read = read_document(str(path))
    assert read.file == str(path)
    assert read.plain() == {"a": 1}
    path.write_text("- 1\n- {b: 2}\n")
    assert read_document(str(path), any_root=True).plain() == [1, {"b": 2}]
    with pytest.raises(InputError, match="expected a mapping"):
        read_document(str(path))


@pytest.mark.parametrize(
    ("name", "message"),
    [("absent.yaml", "no file"), (".", "folder"), ("a\0b", "cannot be read"), ("x" * 5000, "cannot be read")],
)
def test_files_that_cannot_be_read(tmp_path: Path, name: str, message: str) -> None:
    with pytest.raises(FileError, match=message) as caught:
        read_document(str(tmp_path / name))
    assert caught.value.exit_code == 4


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_file_without_permission(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(TEXT)
    path.chmod(0)
    with pytest.raises(FileError, match="permission denied"):
        read_document(str(path))


def test_a_file_that_is_too_long_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "long.yaml"
    with path.open("wb") as file:
        file.truncate(3_000_000_000)  # sparse: takes no room
    with pytest.raises(InputError) as caught:
        read_document(str(path))
    (problem,) = caught.value.problems
    assert "3000.0 MB" in problem.message
    assert "5 MB" in problem.message
    assert problem.place is not None
    assert str(problem.place) == f"{path}:1:1"
