"""Names of outputs: what is the same file, what is no file, and what is renamed or removed beside one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from trajcli.errors import InputError
from trajcli.streams.whole_file import (
    descriptor_of,
    identity,
    is_special,
    refuse_overwriting,
    remove_aside,
    remove_unfinished,
    set_aside,
)


def test_what_is_set_aside_replaces_nothing(tmp_path: Path) -> None:
    rows = tmp_path / "rows.csv"
    (tmp_path / "rows.csv.stale2").symlink_to(tmp_path / "nowhere")
    names = []
    for text in ("one", "two", "three"):
        rows.write_text(text)
        names.append(set_aside(str(rows)))
    assert names == [f"{rows}.stale", f"{rows}.stale3", f"{rows}.stale4"]
    assert [Path(str(name)).read_text() for name in names] == ["one", "two", "three"]
    assert set_aside(str(rows)) is None


def test_what_is_no_file_is_not_set_aside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("-").write_text("a file of that name")
    os.mkfifo("pipe")
    Path("folder").mkdir()
    Path("device").symlink_to("/dev/null")  # by a link: who runs as root would lose the device itself
    assert [set_aside(name) for name in ("-", "pipe", "folder", "device", "none")] == [None] * 5
    assert sorted(path.name for path in tmp_path.iterdir()) == ["-", "device", "folder", "pipe"]


def test_what_was_set_aside_is_removed_where_it_is_a_file(tmp_path: Path) -> None:
    rows, kept = tmp_path / "rows.csv", tmp_path / "kept"
    rows.write_text("old")
    set_aside(str(rows))
    remove_aside(str(rows))
    assert not [*tmp_path.iterdir()]
    kept.write_text("of somebody")
    Path(f"{rows}.stale").symlink_to(kept)
    remove_aside(str(rows))
    assert Path(f"{rows}.stale").is_symlink()
    assert kept.read_text() == "of somebody"


def test_what_cannot_be_renamed_is_not_said_to_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError("as in a folder that is closed")

    rows = tmp_path / "rows.csv"
    rows.write_text("one")
    monkeypatch.setattr(Path, "replace", refuse)
    assert set_aside(str(rows)) is None
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]


def test_what_stands_beside_standard_output_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("-.stale").write_text("a file of that name")
    remove_aside("-")
    assert Path("-.stale").is_file()


def test_two_outputs_to_the_descriptor_of_a_device_are_one(tmp_path: Path) -> None:
    """A terminal, say; the device itself takes any number of outputs."""
    with Path(os.devnull).open("wb") as device, (tmp_path / "a").open("wb") as file:
        number = device.fileno()
        assert identity(f"/dev/fd/{number}") == identity("-", number) == identity(f"/proc/self/fd/{number}")
        assert identity(f"/dev/fd/{number}") not in (None, identity(f"/dev/fd/{file.fileno()}"))
    assert identity(os.devnull) is None


def test_only_what_the_process_left_is_removed(tmp_path: Path) -> None:
    for name in (".trajcli-12-ab.part", ".trajcli-123-ab.part", ".trajcli-12-ab.csv", "trajcli-12-a.part"):
        (tmp_path / name).touch()
    remove_unfinished(tmp_path, 12)
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {".trajcli-123-ab.part", ".trajcli-12-ab.csv", "trajcli-12-a.part"}


def test_descriptors_devices_and_pipes_are_special(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").touch()
    special = [
        "/dev/stdout",
        "/dev/stderr",
        "/dev/fd/7",
        "/proc/self/fd/12",
        "/dev/null",
        str(tmp_path / "pipe"),
    ]
    assert [is_special(name) for name in special] == [True] * 6
    assert [is_special(str(tmp_path / name)) for name in ("file", "", "none", "b\0")] == [False] * 4
    assert [descriptor_of(name) for name in special] == [1, 2, 7, 12, None, None]


def test_one_file_has_one_identity_whatever_it_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("file").touch()
    Path("other").touch()
    Path("link").symlink_to("file")
    os.link("file", "hard")
    Path("linked").symlink_to("folder")
    same = {
        identity(name)
        for name in ("file", "./file", "folder/../file", "link", "hard", str(tmp_path / "file"))
    }
    assert len(same) == 1
    assert identity("other") not in same
    assert identity("folder/new") == identity("linked/new") == identity(str(tmp_path / "folder/new"))
    assert identity("folder/new") != identity("new")
    assert identity("/dev/null") is None


def test_an_input_is_not_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rows").touch()
    Path("link").symlink_to("rows")
    with pytest.raises(InputError, match=r"the output to \./link would overwrite the job rows"):
        refuse_overwriting(
            [("the report", "new"), ("the output", "./link")], [("the file", "x"), ("the job", "rows")]
        )
    refuse_overwriting([("the output", "/dev/null")], [("the job", "/dev/null"), ("the job", "rows")])


def test_standard_input_is_an_input_as_well(tmp_path: Path) -> None:
    """`trajcli ... - -o rows < rows` would read what it has just emptied; standard output is another descriptor."""
    rows = tmp_path / "rows"
    rows.write_text("t,q1\n")
    code = (
        "import sys\nfrom trajcli.streams.whole_file import refuse_overwriting\n"
        "refuse_overwriting([('output', sys.argv[1])], [('input', '-')])"
    )
    for output, refused in ((rows, True), (tmp_path / "other", False)):
        with rows.open("rb") as stream:
            done = subprocess.run(
                [sys.executable, "-c", code, str(output)],
                stdin=stream,
                capture_output=True,
                text=True,
                check=False,
            )
        assert ("would overwrite input -" in done.stderr) == refused, done.stderr
        assert (done.returncode != 0) == refused
