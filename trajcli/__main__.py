"""`python -m trajcli`, and the entry point of the command."""

from __future__ import annotations

import gc
import os
import sys
from importlib import import_module
from types import ModuleType
from typing import Any, NoReturn

INTERRUPTED, PIPE_CLOSED = 130, 141


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
    # One BLAS thread is faster for arrays this small, and starts faster; whoever asks for more gets them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    if os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__") == "__all__":
        sys.modules[_NoPlugins.REAL] = _NoPlugins(_NoPlugins.REAL)
    # The many objects that imports make are no garbage: looking through them costs as much as a bare start.
    gc.set_threshold(100_000, 20, 20)
    _leave(_run())


def _run() -> int:
    try:
        if sys.argv[1:] == ["--version"]:  # typer would import pydantic to read an option of its own
            from trajcli.version import __version__

            print(f"trajcli {__version__}")  # noqa: T201
            return 0
        from trajcli.cli.app import run

        run()
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
