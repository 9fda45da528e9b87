"""`python -m trajcli`, and the entry point of the command."""

from __future__ import annotations

import errno
import gc
import os
import signal
import sys
from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn

FILE_FAILED, INTERRUPTED, PIPE_CLOSED = 4, 130, 141

_REUSED = 1 << 24  # bytes: what is smaller is used anew when it has been freed
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class _NoPlugins(ModuleType):
    """Finds no plugins of pydantic, without the email and zipfile that its own module imports for that."""

    REAL = "pydantic.plugin._loader"

    @staticmethod
    def get_plugins() -> tuple[()]:
        """Return that there are none."""
        return ()

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        if name.startswith("__"):
            raise AttributeError(name)
        del sys.modules[self.REAL]  # a pydantic that asks for more gets the real module
        return getattr(import_module(self.REAL), name)


def main() -> NoReturn:
    """Run the command line, and leave with its exit code."""
    _fill_closed_streams()
    for number in _ENDING:
        if signal.getsignal(number) == signal.SIG_DFL:  # `nohup` ignores one of them
            signal.signal(number, _end)
    # One BLAS thread is faster for arrays this small, and starts faster; whoever asks for more gets them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__") == "__all__":
        sys.modules[_NoPlugins.REAL] = _NoPlugins(_NoPlugins.REAL)
    # The many objects that imports make are no garbage: looking through them costs as much as a bare start.
    gc.set_threshold(100_000, 20, 20)
    # Once such a block was freed, glibc keeps freed arrays for the next ones. None of it is touched.
    bytes(_REUSED)
    _leave(_run())


def _fill_closed_streams() -> None:
    """Put something behind each standard stream that the caller has closed.

    Without this the next file that is opened takes the number of the stream, and what is meant for the stream
    goes into the file. Nobody reads standard error then; reading the others, or writing them, fails.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:  # the lowest free number is this one: all before it are taken
            flag = os.O_RDWR if name == "stderr" else os.O_WRONLY if name == "stdin" else os.O_RDONLY
            if os.open(os.devnull, flag) == number:
                setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115


def _end(number: int, frame: object) -> NoReturn:
    """End on a signal as a shell reports it, once files that are half written have been removed."""
    for other in _ENDING:
        signal.signal(other, signal.SIG_IGN)
    raise SystemExit(128 + number)


def _run() -> int:
    try:
        if sys.argv[1:2] == ["--version"]:  # typer would import pydantic to read an option of its own
            return _print_version(sys.argv[2:])
        from trajcli.cli.app import run

        run()
    except SystemExit as leaving:
        if isinstance(leaving.__context__, BrokenPipeError):  # of the help: typer makes a failure of it
            return PIPE_CLOSED
        return leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    except KeyboardInterrupt:  # before a command has begun to listen for it
        return INTERRUPTED
    except ImportError as error:  # of what reads the command line
        from trajcli.version import library_error

        of_library = library_error(error)
        if of_library is None:
            raise
        print(f"error: {of_library}", file=sys.stderr)  # noqa: T201
        return of_library.exit_code
    except OSError as error:  # the help, or the version, could not be written
        return _unwritten(error)
    return 0


def _print_version(words: list[str]) -> int:
    from trajcli.version import __version__, version_lines

    if words and words not in (["--verbose"], ["-v"]):
        print("error: --version takes --verbose and nothing else", file=sys.stderr)  # noqa: T201
        return 2
    print("\n".join(version_lines()) if words else f"trajcli {__version__}")  # noqa: T201
    return 0


def _leave(code: int) -> NoReturn:
    """End the process once all output has left it: taking the interpreter apart costs more than planning."""
    for (
        number
    ) in _ENDING:  # nothing is half written any more, and a reader that has stopped shall not hold us
        signal.signal(number, signal.SIG_DFL)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            code = _unwritten(error) if stream is sys.stdout or isinstance(error, BrokenPipeError) else code
        except KeyboardInterrupt:
            code = INTERRUPTED
    os._exit(code)


def _unwritten(error: OSError) -> int:
    """Say that standard output cannot be written; return the exit code."""
    if isinstance(error, BrokenPipeError):
        return PIPE_CLOSED
    reason = "it is closed" if error.errno == errno.EBADF else error.strerror
    with suppress(OSError):
        os.write(2, f"error: cannot write standard output: {reason}\n".encode())
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is left in the buffer fails only once
    return FILE_FAILED


if __name__ == "__main__":
    main()
