"""Comparison of sample streams on the command line: `trajcli diff`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trajcli.cli.outcome import error_as_json, print_json, print_lines, report_error
from trajcli.comparison.difference import as_json, compare, describe, parse_tolerances
from trajcli.errors import InputError, TrajcliError
from trajcli.streams.reading import is_log, motion_files, read_table, with_joints
from trajcli.streams.whole_file import is_folder, kind_of

if TYPE_CHECKING:
    from trajcli.cli.file_commands import DiffCommand


def run_diff(options: DiffCommand) -> int:
    """Compare files and print what differs; return 0 when nothing does, else 1, or 2 where one cannot be.

    Raises:
        InputError: When nothing can be compared.
        FileError: When a file cannot be read.
    """
    *others, last = options.files
    if not others:
        raise InputError("diff compares two files, and there is one", hint="trajcli diff A B")
    if others == ["-"] and last == "-":
        raise InputError("only one of the files can be standard input")
    alone = len(others) == 1 and not any(map(is_folder, options.files))
    _check_view(options, alone=alone)
    tolerances = [parse_tolerances(text) if text else {} for text in (options.atol, options.rtol)]
    code, found = 0, list[dict[str, Any]]()
    for a, b in [(others[0], last)] if alone else _pairs(others, last):
        try:
            lacking = [name for name in (a, b) if not alone and kind_of(name) != "file"]
            mapping, text = _without(a, b, lacking[0]) if lacking else _compared(a, b, options, tolerances)
        except TrajcliError as error:
            if alone:
                raise
            report_error(error, options.errors)
            mapping, text = {"equal": False, "files": [a, b], **error_as_json(error)}, None
        code = max(code, mapping.get("exit", int(not mapping["equal"])))
        found.append(mapping)
        if text is not None and not options.as_json:
            print_lines(text.splitlines())
    if options.as_json:
        print_json(found[0] if alone else found)
    if options.view is not None:
        from trajcli.cli.view import write_comparison

        write_comparison(others[0], last, options.view, options.robot)
    return code


def _check_view(options: DiffCommand, *, alone: bool) -> None:
    """Refuse a page of many files, one of what can be read once only, and an arm without a page."""
    if options.view is None:
        if options.robot is not None:
            raise InputError("--robot is the arm of a page, and there is none", hint="add --view FILE.html")
        return
    if not alone or "-" in options.files:
        raise InputError("--view is of two files", hint="name two files, and neither as -")
    from trajcli.player.page import check_page_name

    check_page_name(options.view)  # standard output takes what differs


def _compared(
    a: str, b: str, options: DiffCommand, tolerances: Sequence[Mapping[str, float]]
) -> tuple[dict[str, Any], str]:
    """Return how two files compare, for programs and for people."""
    if options.topic is not None and not (is_log(a) or is_log(b)):
        raise InputError("--topic is about MCAP, and neither file is one", hint="leave --topic out")
    first, second = read_table(a, options.topic), read_table(b, options.topic)
    if first.joints is not None and second.joints is not None:
        if set(first.joints) != set(second.joints):
            names = f"{', '.join(first.joints)}; {second.file} has {', '.join(second.joints)}"
            raise InputError(f"the files are of different joints: {first.file} has {names}")
        second = with_joints(second, first.joints)
    difference = compare(first, second, *tolerances, resample=options.resample)
    return as_json(difference), describe(difference)


def _without(a: str, b: str, lacking: str) -> tuple[dict[str, Any], str]:
    """Return that one of two files is not there, for programs and for people."""
    text = f"different: {b if lacking == a else a} has no counterpart {lacking}"
    return {"equal": False, "files": [a, b], "lacking": lacking}, text


def _pairs(others: Sequence[str], folder: str) -> Iterator[tuple[str, str]]:
    """Yield pairs of files of the same names; of two folders also those that one of them lacks."""
    if not is_folder(folder):
        raise InputError(f"several files are compared with those of a folder, and {folder} is none")
    for other in others:
        if is_folder(other):
            sides = (other, folder)
            names = {str(Path(file).relative_to(side)) for side in sides for file in motion_files(side)}
            yield from ((str(Path(other, name)), str(Path(folder, name))) for name in sorted(names))
        else:
            yield other, str(Path(folder, Path(other).name))
