"""`python -m trajcli`, and the entry point of the command."""

from __future__ import annotations

import gc
import os
import sys
from typing import NoReturn

INTERRUPTED, PIPE_CLOSED = 130, 141


def main() -> NoReturn:
    """Run the command line, and leave with its exit code."""
    # One BLAS thread is faster for arrays this small, and starts faster; whoever asks for more gets them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The many objects that imports make are no garbage: looking through them costs as much as a bare start.
    gc.set_threshold(100_000, 20, 20)
    _leave(_run())


def _run() -> int:
    try:
        if sys.argv[1:] == ["--version"]:  # typer would import pydantic to read an option of its own
            from trajcli import __version__

            print(f"trajcli {__version__}")  # noqa: T201
            return 0
        from trajcli.cli.app import app

        app()
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    except KeyboardInterrupt:  # before a command has begun to listen for it
        return INTERRUPTED
    return 0


def _leave(code: int) -> NoReturn:
    """End the process once all output has left it: taking the interpreter apart costs more than planning."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:
        code = PIPE_CLOSED
    os._exit(code)


if __name__ == "__main__":
    main()
