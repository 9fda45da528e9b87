"""Comparison of sample streams on the command line: `trajcli diff`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.cli.outcome import print_lines
from trajcli.comparison.difference import compare, describe, parse_tolerances
from trajcli.errors import InputError
from trajcli.streams.reading import is_log, read_table

if TYPE_CHECKING:
    from trajcli.cli.file_commands import DiffCommand


def run_diff(options: DiffCommand) -> int:
    """Compare two files and print what differs; return 0 when nothing does, else 1.

    Raises:
        InputError: When they cannot be compared.
        FileError: When one cannot be read.
    """
    a, b, topic = options.a, options.b, options.topic
    if a == b == "-":
        raise InputError("only one of the files can be standard input")
    if topic is not None and not (is_log(a) or is_log(b)):
        raise InputError("--topic is about MCAP, and neither file is one", hint="leave --topic out")
    tolerances = [parse_tolerances(text) if text else {} for text in (options.atol, options.rtol)]
    difference = compare(read_table(a, topic), read_table(b, topic), *tolerances, resample=options.resample)
    print_lines([describe(difference)])
    return 0 if difference.equal else 1
