"""`python -m trajcli`, and the entry point of the command."""

from __future__ import annotations

import os
import sys

def main() -> None:
    """Run the command line."""
    # One BLAS thread is faster for arrays this small, and starts faster; whoever asks for more gets them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    if sys.argv[1:] == ["--version"]:  # typer would import pydantic to read an option of its own
        from trajcli import __version__

        print(f"trajcli {__version__}")  # noqa: T201
        return
    from trajcli.cli.app import app

    app()

if __name__ == "__main__":
    main()
