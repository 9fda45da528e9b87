"""Outcome of a command: its exit code, its errors, and its output as text for people or JSON for programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, TextIO

from trajcli.cli.progress import columns, is_terminal
from trajcli.errors import LONGEST_LINE, InputError, Problem, TrajcliError

if TYPE_CHECKING:
    from trajcli.columns import Column
    from trajcli.curves.piecewise import Array
    from trajcli.streams.decimals import Digits

ErrorForm = Literal["text", "json", "github", "junit", "sarif"]

FILE_FAILED, BUG, INTERRUPTED, PIPE_CLOSED = 4, 70, 130, 141


def exit_code(run: Callable[[Any], int], options: Any, form: ErrorForm) -> int:  # noqa: ANN401
    """Return the exit code of a command; its errors are rendered on standard error.

    Args:
        run: What the command does.
        options: What the command line says.
        form: How errors are written.
    """
    try:
        return _outcome(run, options, form)
    except BrokenPipeError:  # nobody reads the errors either
        return PIPE_CLOSED
    except OSError:  # standard error cannot be written
        return FILE_FAILED


def _outcome(run: Callable[[Any], int], options: Any, form: ErrorForm) -> int:  # noqa: ANN401
    try:
        return run(options)
    except TrajcliError as error:
        report_error(error, form)
        return error.exit_code
    except BrokenPipeError:
        return PIPE_CLOSED
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        if error.filename is not None:
            return report_bug(error, form)
        return FILE_FAILED  # of standard error: nobody can be told
    except Exception as error:  # noqa: BLE001
        return report_bug(error, form)


def refuse_two_inputs(sources: Sequence[str]) -> None:
    """Refuse standard input, which is named "-", in two places.

    Raises:
        InputError: When it is.
    """
    if sources.count("-") > 1:
        raise InputError("standard input can be read once")


def refuse_beside_rows(given: Mapping[str, object], one: str) -> None:
    """Refuse options that are about one thing, such as a state, beside rows from standard input.

    Raises:
        InputError: Names the first that is given.
    """
    for name in (name for name, value in given.items() if value):
        raise InputError(f"{name} is for one {one}, rows from standard input become a CSV")


def report_error(error: TrajcliError, form: ErrorForm = "text") -> None:
    """Print an error on standard error, for people, as JSON, or for a service of continuous integration."""
    if form == "json":
        import json

        print(json.dumps(error_as_json(error), ensure_ascii=False), file=sys.stderr)  # noqa: T201
        return
    if form != "text":
        from trajcli.output.annotations import annotations_of, render_annotations

        print(render_annotations(annotations_of(error), form), end="", file=sys.stderr)  # noqa: T201
        return
    from trajcli.cli.frames import render_problem
    from trajcli.cli.terminal import is_coloured

    color, width = is_coloured(sys.stderr), columns() if is_terminal(sys.stderr) else None
    for problem in error.problems:
        print(render_problem(problem, color=color, width=width), file=sys.stderr)  # noqa: T201


def error_as_json(error: TrajcliError) -> dict[str, Any]:
    """Return an error as a mapping that JSON can hold: its class, its exit code and its problems."""
    from trajcli.cli.frames import problem_as_json

    problems = [problem_as_json(problem) for problem in error.problems]
    return {"error": type(error).__name__, "exit": error.exit_code, "problems": problems}


def report_bug(error: Exception, form: ErrorForm = "text") -> int:
    """Print an error that nobody raised on purpose on standard error; return its exit code.

    It is a bug but where a library is missing or too old.
    """
    import traceback

    from trajcli.version import library_error

    of_library = library_error(error)
    if of_library is not None:
        report_error(of_library, form)
        return of_library.exit_code
    message = f"a bug in trajcli: {error}"
    if form == "json":
        import json

        said = {"error": type(error).__name__, "exit": BUG, "problems": [{"message": message}]}
        print(json.dumps(said), file=sys.stderr)  # noqa: T201
        return BUG
    if form != "text":
        report_error(TrajcliError(Problem(message)), form)
        return BUG
    traceback.print_exception(error)
    request = "This is a bug in trajcli. Please report it with the lines above and the job file."
    print(request, file=sys.stderr)  # noqa: T201
    return BUG


def print_lines(lines: Iterable[str], *, verdict: bool = False) -> None:
    """Print lines for people: what a file names cannot begin another line, or be a command of a log.

    Args:
        lines: As they stand in a file; a terminal has them broken between words.
        verdict: Whether the first one holds a verdict, which has a colour.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    texts = [f"{_line(line, sys.stdout)}\n" for line in lines]
    if verdict and texts:
        texts[0] = _with_verdict(texts[0], sys.stdout)
    print_text("".join(texts))


def _with_verdict(text: str, stream: TextIO | None) -> str:
    from trajcli.cli.terminal import with_verdict

    return with_verdict(text, stream)


def _line(text: str, stream: TextIO | None) -> str:
    """Return a line as it is shown; what is plain costs nothing."""
    if not (len(text) <= LONGEST_LINE and text.isascii() and text.isprintable()):
        from trajcli.cli.frames import shown

        text = shown(text)
    if not is_terminal(stream):
        return text
    from trajcli.cli.terminal import wrapped

    return wrapped(text, stream)


def print_text(text: str) -> None:
    """Print a document as it is: JSON, YAML, XML.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    from trajcli.streams.whole_file import write_content  # `--help` writes by other means

    write_content(text.encode(errors="backslashreplace"))


def print_rows(columns: Sequence[Column], blocks: Iterable[Array], digits: Digits = "fixed") -> None:
    """Print rows as CSV, block by block, with a line of names in front.

    Raises:
        InputError: When a block cannot be computed.
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    from trajcli.streams.csv import write_csv
    from trajcli.streams.whole_file import standard_output

    with standard_output() as out:
        write_csv(blocks, columns, out, digits)


def print_remark(text: str | None, *, verdict: bool = False) -> None:
    """Print a line for people on standard error, where there is one; one about a verdict has its colour."""
    if text is None:
        return
    line = _line(text, sys.stderr)
    print(_with_verdict(line, sys.stderr) if verdict else line, file=sys.stderr)  # noqa: T201


def print_report(report: Any, lines: Iterable[str], *, as_json: bool) -> None:  # noqa: ANN401
    """Print a report as JSON, or for people in lines.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    if as_json:
        print_json(report)
    else:
        print_lines(lines)


def print_json(value: Any) -> None:  # noqa: ANN401
    """Print a value as JSON; a matrix takes a line for each row.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    print_text("".join(_written(value, "")) + "\n")


def _written(value: Any, indent: str) -> Iterable[str]:  # noqa: ANN401
    import json

    deeper = indent + "  "
    if isinstance(value, dict) and value:
        for i, (key, item) in enumerate(value.items()):
            yield f"{',' if i else '{'}\n{deeper}{json.dumps(key)}: "
            yield from _written(item, deeper)
        yield f"\n{indent}}}"
    elif isinstance(value, list) and any(isinstance(item, list | dict) for item in value):
        for i, item in enumerate(value):
            yield f"{',' if i else '['}\n{deeper}"
            yield from _written(item, deeper)
        yield f"\n{indent}]"
    else:
        yield json.dumps(value, ensure_ascii=False, allow_nan=False)
