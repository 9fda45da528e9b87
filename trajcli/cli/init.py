"""Starter job on the command line: `trajcli init`."""

from __future__ import annotations

import sys
from pathlib import Path

from trajcli.errors import InputError
from trajcli.streams.whole_file import standard_output, whole_file

STARTER = Path(__file__).parent / "starter.yaml"


def run_init(file: str, *, force: bool) -> int:
    """Write the starter job; return the exit code.

    Raises:
        InputError: When the file exists and `force` is not given.
        FileError: When it cannot be written.
    """
    text = STARTER.read_bytes()
    if file == "-":
        with standard_output() as out:
            out.write(text)
        return 0
    if not force and Path(file).exists():
        raise InputError(f"{file} exists", hint="name another file, or say --force to overwrite it")
    with whole_file(file) as out:
        out.write(text)
    print(f"{file} written; now: trajcli plan {file} > out.csv", file=sys.stderr)  # noqa: T201
    return 0
