"""`python -m trajcli`, and the entry point of the command."""

from __future__ import annotations

import os


def main() -> None:
    """Run the command line."""
    # One thread is faster for arrays this small, and starts faster; whoever asks for more gets them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    from trajcli.cli.app import app

    app()


if __name__ == "__main__":
    main()
