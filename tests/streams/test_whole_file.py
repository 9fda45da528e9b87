from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from trajcli.errors import FileError
from trajcli.streams.whole_file import (
    is_folder,
    kind_of,
    paths_below,
    standard_output,
    whole_file,
    write_content,
)

AS_ROOT = os.geteuid() == 0


def write(path, text=b"new"):
    with whole_file(path) as out:
        out.write(text)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("old", [None, b"old"])
def test_a_file_appears_at_the_end(tmp_path, old):
    path = tmp_path / "out.csv"
    if old is not None:
        path.write_bytes(old)
    with whole_file(str(path)) as out:
        out.write(b"new")
        out.flush()
        assert (path.read_bytes() if path.exists() else None) == old
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["out.csv"]


@pytest.mark.parametrize("failure", [KeyboardInterrupt, SystemExit, ValueError, GeneratorExit])
@pytest.mark.parametrize("old", [None, b"old"])
def test_a_failure_leaves_what_was(tmp_path, failure, old):
    path = tmp_path / "out.csv"
    if old is not None:
        path.write_bytes(old)
    with pytest.raises(failure), whole_file(path) as out:  # noqa: PT012
        out.write(b"half")
        raise failure
    assert names(tmp_path) == ([] if old is None else ["out.csv"])
    assert old is None or path.read_bytes() == old


def test_permissions_are_kept_and_new_files_obey_the_umask(tmp_path):
    path = tmp_path / "out.csv"
    before = os.umask(0o027)
    try:
        write(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o640
        path.chmod(0o606)
        write(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o606
    finally:
        os.umask(before)


def test_a_symbolic_link_stays(tmp_path):
    (tmp_path / "there").mkdir()
    link, target = tmp_path / "link.csv", tmp_path / "there" / "target.csv"
    link.symlink_to(target)
    for _ in range(2):  # dangling, then not
        write(link)
        assert link.is_symlink()
        assert target.read_bytes() == b"new"
    assert names(tmp_path / "there") == ["target.csv"]


def test_the_longest_name_fits(tmp_path):
    write(tmp_path / ("n" * 255))
    assert names(tmp_path) == ["n" * 255]


def test_only_files_can_be_read_back(tmp_path):
    with whole_file(tmp_path / "out.csv") as out:
        assert out.readable()
    with whole_file("/dev/null") as out:
        assert not out.readable()
        out.write(b"gone")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_pipe_is_written_to(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write(pipe)
    reader.join()
    assert read == [b"new"]
    assert names(tmp_path) == ["pipe"]


def test_an_open_descriptor_takes_what_follows_and_nothing_of_a_failure():
    reading, writing = os.pipe()
    write(f"/dev/fd/{writing}", b"one ")
    write(f"/dev/fd/{writing}", b"two")
    with pytest.raises(ValueError, match="half"), whole_file(f"/proc/self/fd/{writing}") as out:  # noqa: PT012
        out.write(b"half a row")
        raise ValueError("half")
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        assert stream.read() == b"one two"


def test_nothing_of_a_failure_reaches_standard_output(monkeypatch):
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as shown, monkeypatch.context() as patched:
        patched.setattr(sys, "stdout", shown)
        with standard_output() as out:
            out.write(b"whole")
        with pytest.raises(ValueError, match="half"), standard_output() as out:  # noqa: PT012
            out.write(b"half a row")
            raise ValueError("half")
    with os.fdopen(reading, "rb") as stream:
        assert stream.read() == b"whole"


def test_dev_stdout_goes_where_stdout_goes(tmp_path):
    """Also when that is a file: what stood in it before stays, and what comes later follows."""
    path = tmp_path / "out.txt"
    code = (
        "from trajcli.streams.whole_file import whole_file\nwith whole_file('{}') as out: out.write(b'new ')"
    )
    with path.open("wb") as stream:
        for name in ("/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"):
            os.write(stream.fileno(), b"before ")
            subprocess.run([sys.executable, "-c", code.format(name)], stdout=stream, check=True)
    assert path.read_bytes() == b"before new " * 3


@pytest.mark.parametrize(
    ("name", "reason", "hint"),
    [
        ("nowhere/out.csv", "No such file or directory", "the directory must exist"),
        ("file/out.csv", "Not a directory", None),
        ("", "Is a directory", None),
        ("loop", "Too many levels of symbolic links", None),
        ("n" * 256, "File name too long", None),
    ],
)
def test_an_impossible_path_is_named_with_its_reason(tmp_path, name, reason, hint):
    (tmp_path / "file").write_text("")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    path = f"{tmp_path}/{name}"
    with pytest.raises(FileError) as caught:
        write(path)
    assert str(caught.value) == f"cannot write {path}: {reason}"
    assert caught.value.problems[0].hint == hint
    assert names(tmp_path) == ["file", "loop"]


@pytest.mark.skipif(AS_ROOT, reason="root may write everywhere")
def test_what_may_not_be_written_is_not_replaced(tmp_path):
    path = tmp_path / "out.csv"
    path.write_text("old")
    path.chmod(0o444)
    with pytest.raises(FileError, match="Permission denied"):
        write(path)
    path.chmod(0o644)
    tmp_path.chmod(0o555)
    with pytest.raises(FileError, match="Permission denied"):
        write(path)
    tmp_path.chmod(0o755)
    assert path.read_text() == "old"


@pytest.mark.skipif(AS_ROOT, reason="root may read everything")
def test_closed_folders_are_errors_of_files(tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0)
    with pytest.raises(FileError, match="cannot be read: Permission denied"):
        paths_below(closed)
    assert is_folder(closed)
    assert not is_folder(closed / "a")
    with pytest.raises(FileError, match="cannot read"):
        kind_of(closed / "a")


def test_what_stands_under_a_path(tmp_path):
    (tmp_path / "a").touch()
    (tmp_path / "loop").symlink_to("loop")
    found = [kind_of(tmp_path / name) for name in ("", "a", "a/b", "none", "loop", "b\0")]
    assert found == ["folder", "file", None, None, None, None]
    assert kind_of("/dev/null") == "other"
    assert not is_folder(tmp_path / ("x" * 300))
    with pytest.raises(FileError, match="File name too long") as caught:
        kind_of(tmp_path / ("x" * 300))
    assert caught.value.exit_code == 4


def test_what_is_below_a_folder_is_listed_by_name(tmp_path):
    wanted = [
        tmp_path / "a",
        *(tmp_path / "a" / f"{number:02d}.csv" for number in range(20)),
        tmp_path / "b.csv",
    ]
    wanted[0].mkdir()
    for path in wanted[:0:-1]:
        path.write_bytes(b"")
    assert paths_below(tmp_path) == wanted
    assert paths_below(str(tmp_path), "*9.csv") == [wanted[10], wanted[20]]
    with pytest.raises(FileError, match=r"b\.csv' cannot be read: "):
        paths_below(tmp_path / "b.csv")


def test_a_disk_that_fills_leaves_what_was(tmp_path):
    path = tmp_path / "out.csv"
    path.write_text("old")
    with pytest.raises(FileError, match="No space left on device") as caught, whole_file(path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.exit_code == 4
    assert path.read_text() == "old"
    assert names(tmp_path) == ["out.csv"]


def test_a_full_device_is_told_even_when_all_fits_the_buffer():
    with pytest.raises(FileError, match="cannot write /dev/full: No space left on device"):
        write("/dev/full")


def run(code, **options):
    code = f"from trajcli.streams.whole_file import standard_output\n{code}"
    return subprocess.run(
        [sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, check=False, **options
    )


WRITE = """
try:
    with standard_output() as out: out.write(b'x' * {})
except Exception as error: raise SystemExit(f'{{type(error).__name__}}: {{error}}')
"""


@pytest.mark.parametrize("count", [1, 10**6])
def test_standard_output_fails_once_and_clearly(count):
    with Path("/dev/full").open("wb") as full:
        done = run(WRITE.format(count), stdout=full)
    assert done.returncode == 1
    assert done.stderr == "FileError: cannot write standard output: No space left on device\n"


@pytest.mark.parametrize("count", [1, 10**6])
def test_a_closed_pipe_stays_a_closed_pipe(count):
    read, write_end = os.pipe()
    os.close(read)
    done = run(WRITE.format(count), stdout=write_end)
    os.close(write_end)
    assert done.returncode == 1
    assert done.stderr == "BrokenPipeError: [Errno 32] Broken pipe\n"


def test_a_missing_standard_output_is_told():
    done = run(WRITE.format(1), preexec_fn=lambda: os.close(1))
    assert done.stderr == "FileError: cannot write standard output: it is closed\n"


def test_standard_output_in_memory(capsysbinary):
    with standard_output() as out:
        out.write(b"bytes")
    assert capsysbinary.readouterr().out == b"bytes"


@pytest.mark.parametrize("path", [None, "-"])
def test_content_for_standard_output_makes_no_file(
    path: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfdbinary: pytest.CaptureFixture[bytes],
) -> None:
    monkeypatch.chdir(tmp_path)
    write_content(b"\x00rows\n", path)
    assert capfdbinary.readouterr().out == b"\x00rows\n"
    assert list(tmp_path.iterdir()) == []
    write_content(b"\x00rows\n", "out.bin")
    assert (tmp_path / "out.bin").read_bytes() == b"\x00rows\n"
    assert capfdbinary.readouterr().out == b""
