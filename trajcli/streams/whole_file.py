"""Atomic writing of files: they appear whole or not at all."""

from __future__ import annotations

import errno
import os
import re
import secrets
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from io import UnsupportedOperation
from itertools import count
from pathlib import Path
from typing import BinaryIO, Literal

from trajcli.errors import FileError, InputError

_DESCRIPTOR = re.compile(
    r"/dev/(?:(?P<name>stdout|stderr)|fd/(?P<number>[0-9]+))|/proc/self/fd/(?P<other>[0-9]+)"
)
_NUMBERS = {"stdout": 1, "stderr": 2}


@contextmanager
def whole_file(path: str | Path) -> Iterator[BinaryIO]:
    """Open `path` for writing; the file appears under its name when the block ends, and only if it ends well.

    The new file replaces an old one in one step and keeps its permissions; a symbolic link stays, and what it
    points to is replaced. A device, a pipe or an open descriptor such as /dev/stdout is written to
    directly: only then is the stream not `readable()`.

    Raises:
        FileError: When the file cannot be written; the old one is as it was.
        BrokenPipeError: When the reader of a pipe has closed it.
    """
    with _named_errors(str(path)):
        special = _open_special(str(path))
        if special is not None:
            with special, _nothing_after_failure(special):
                yield special
            return
        target = Path(os.path.realpath(path))
        mode = _mode_of(target)
        # The name is short whatever the target's is, and its permissions are what the umask leaves.
        temporary = target.with_name(f".trajcli-{os.getpid()}-{secrets.token_hex(8)}.part")
        try:
            with temporary.open("x+b") as stream:
                if mode is not None:
                    os.fchmod(stream.fileno(), mode)
                yield stream
            temporary.replace(target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


def remove_unfinished(folder: str | Path, process: int) -> None:
    """Remove what a process has half written in a folder: one that was killed could not do so itself."""
    with suppress(OSError):
        for path in Path(folder).glob(f".trajcli-{process}-*.part"):
            path.unlink(missing_ok=True)


@contextmanager
def standard_output() -> Iterator[BinaryIO]:
    """Open standard output for bytes; what is written has left when the block ends.

    Raises:
        FileError: When it cannot be written, as on a full disk.
        BrokenPipeError: When its reader has closed it.
    """
    with _named_errors("standard output"):
        if sys.stdout is None:
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        try:
            number = os.dup(sys.stdout.fileno())
        except UnsupportedOperation:  # replaced by a stream in memory, as tests do
            yield sys.stdout.buffer
            return
        # A stream of our own takes with it what could not be written: the interpreter will not try again.
        with os.fdopen(number, "wb") as stream, _nothing_after_failure(stream):
            yield stream


def write_content(content: bytes, path: str | Path | None = None) -> None:
    """Write a file, which appears whole or not at all; None and "-" are standard output.

    Raises:
        FileError: When it cannot be written.
        BrokenPipeError: When the reader of the pipe has closed it.
    """
    with standard_output() if path in (None, "-") else whole_file(str(path)) as out:
        out.write(content)


@contextmanager
def _nothing_after_failure(stream: BinaryIO) -> Iterator[None]:
    """Drop what a failed block has left in the buffer: closing would wait for a reader that has stopped."""
    try:
        yield
    except BaseException:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        raise


@contextmanager
def _named_errors(name: str) -> Iterator[None]:
    """Turn the system's errors into ours, which name the file. A closed pipe is no error of a file."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        closed = error.errno == errno.EBADF
        reason = "it is closed" if closed else error.strerror or str(error)
        raise FileError(f"cannot write {name}: {reason}", hint=_hint(error)) from error


def _hint(error: OSError) -> str | None:
    if isinstance(error, FileNotFoundError):
        return "the directory must exist"
    if isinstance(error, PermissionError):
        return "the directory must be writable, and so must the file where there is one"
    return None


def set_aside(path: str) -> str | None:
    """Rename what is in a file, which is of no use under its name any more; return its name then.

    The name ends in .stale, or .stale2 and so on where such a file is there: none is replaced. Where there is
    no file, or it is a device or a pipe, or cannot be renamed, nothing is done.
    """
    if path == "-" or is_special(path) or not Path(path).is_file():
        return None
    names = (f"{path}.stale{number if number > 1 else ''}" for number in count(1))
    aside = next(name for name in names if not os.path.lexists(name))
    with suppress(OSError):
        Path(path).replace(aside)
        return aside
    return None


def remove_aside(path: str) -> None:
    """Remove what `set_aside` left of a file that is whole again; where there is nothing, nothing is done."""
    aside = Path(f"{path}.stale")
    if path != "-" and not is_special(path) and aside.is_file() and not aside.is_symlink():
        with suppress(OSError):
            aside.unlink()


def is_special(path: str) -> bool:
    """Return whether a path is an open descriptor such as /dev/stdout, a device or a pipe."""
    if descriptor_of(path) is not None:
        return True
    try:
        kind = Path(path).stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(kind) or stat.S_ISDIR(kind))


def kind_of(path: str | Path) -> Literal["file", "folder", "other"] | None:
    """Return what stands under a path; None where there is nothing.

    Raises:
        FileError: When it cannot be looked at: a folder on the way is closed, or the name is too long.
    """
    try:
        mode = Path(path).stat().st_mode
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return None
    except OSError as error:
        if error.errno == errno.ELOOP:  # links in a circle lead to nothing
            return None
        raise FileError(f"cannot read {path}: {error.strerror or error}") from None
    return "file" if stat.S_ISREG(mode) else "folder" if stat.S_ISDIR(mode) else "other"


def is_folder(path: str | Path) -> bool:
    """Return whether a path is that of a folder; not where it cannot be looked at: who reads it says why."""
    with suppress(FileError):
        return kind_of(path) == "folder"
    return False


def paths_below(folder: str | Path, pattern: str = "*") -> list[Path]:
    """Return what is below a folder, by name.

    Raises:
        FileError: When the folder cannot be read.
    """
    try:
        next(Path(folder).iterdir(), None)  # `rglob` takes a folder that may not be read for an empty one
        return sorted(Path(folder).rglob(pattern))
    except OSError as error:
        raise FileError(f"the folder '{folder}' cannot be read: {error.strerror}") from None


def descriptor_of(path: str) -> int | None:
    """Return the number of the open descriptor that a path stands for; None when it stands for a file."""
    match = _DESCRIPTOR.fullmatch(path)
    return int(match["number"] or match["other"] or _NUMBERS[match["name"]]) if match else None


def identity(path: str, descriptor: int = 1) -> tuple[object, ...] | None:
    """Return what is equal for two names of one file: other spellings, links, an open descriptor.

    None is equal to nothing: any number of outputs may go to a device such as /dev/null.

    Args:
        path: The name; "-" stands for the descriptor.
        descriptor: 0 for standard input, 1 for standard output.
    """
    number = descriptor if path == "-" else descriptor_of(path)
    try:
        status = Path(path).stat() if number is None else os.fstat(number)
    except (OSError, ValueError):  # it does not exist yet
        return ("path", os.path.realpath(path))
    if stat.S_ISCHR(status.st_mode) or stat.S_ISBLK(status.st_mode):
        return None if number is None else ("descriptor", number)
    return ("file", status.st_dev, status.st_ino)


def refuse_overwriting(outputs: Iterable[tuple[str, str]], inputs: Iterable[tuple[str, str]]) -> None:
    """Refuse to write over a file that is read; of outputs and inputs both: what each is, and its path.

    Raises:
        InputError: When one would be.
    """
    read = {identity(path, 0): f"{what} {path}" for what, path in inputs}
    for name, path in outputs:
        same = identity(path)
        if same is not None and same in read:
            raise InputError(f"{name} to {path} would overwrite {read[same]}", hint="name another file")


def _open_special(path: str) -> BinaryIO | None:
    """Return a stream to what is not a regular file, unless it is one."""
    number = descriptor_of(path)
    if number is not None:
        # A duplicate shares the position: what was written before stays, what comes later follows.
        return os.fdopen(os.dup(number), "wb")
    with suppress(FileNotFoundError):
        kind = Path(path).stat().st_mode
        if not stat.S_ISREG(kind):
            return Path(path).open("wb")
    return None


def _mode_of(target: Path) -> int | None:
    """Return the permissions of an existing file, which must be writable; None where there is none."""
    try:
        mode = stat.S_IMODE(target.stat().st_mode)
    except FileNotFoundError:
        return None
    with target.open("r+b"):
        return mode
