"""What a command prints: text for people or JSON for programs, on standard output."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from trajcli.streams.whole_file import standard_output


def print_lines(lines: Iterable[str]) -> None:
    """Print lines of text.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    text = "\n".join(lines) + "\n"
    with standard_output() as out:
        out.write(text.encode(errors="backslashreplace"))


def print_json(value: Any) -> None:  # noqa: ANN401
    """Print a value as JSON; a matrix takes a line for each row.

    Raises:
        FileError: When standard output cannot be written.
        BrokenPipeError: When its reader has closed it.
    """
    print_lines(["".join(_written(value, ""))])


def _written(value: Any, indent: str) -> Iterable[str]:  # noqa: ANN401
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
