"""Comparison of sample streams on the command line: `trajcli diff`."""

from __future__ import annotations

from trajcli.cli.outcome import print_lines
from trajcli.comparison.difference import compare, describe, parse_tolerances
from trajcli.errors import InputError
from trajcli.streams.table import read_csv


def run_diff(a: str, b: str, atol: str, rtol: str, *, resample: bool) -> int:
    """Compare two CSV files and print what differs; return 0 when nothing does, else 1.

    Raises:
        InputError: When they cannot be compared.
        FileError: When one cannot be read.
    """
    if a == b == "-":
        raise InputError("only one of the files can be standard input")
    tolerances = [parse_tolerances(text) if text else {} for text in (atol, rtol)]
    difference = compare(read_csv(a), read_csv(b), *tolerances, resample=resample)
    print_lines([describe(difference)])
    return 0 if difference.equal else 1
