"""Starter job on the command line: `trajcli init`."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from trajcli.cli.outcome import print_remark
from trajcli.errors import InputError
from trajcli.streams.whole_file import kind_of, write_content

if TYPE_CHECKING:
    from trajcli.cli.file_commands import InitCommand

STARTER = Path(__file__).parent / "starter.yaml"


def run_init(options: InitCommand) -> int:
    """Write the starter job; return the exit code.

    Raises:
        InputError: When the file exists and `force` is not given.
        FileError: When it cannot be written.
    """
    file = options.file
    text = STARTER.read_bytes()
    if file == "-":
        write_content(text)
        return 0
    if not options.force and kind_of(file) is not None:
        raise InputError(f"{file} exists", hint="name another file, or say --force to overwrite it")
    write_content(text, file)
    print_remark(f"{file} written; now: trajcli plan {quote(file)} > out.csv")
    return 0
