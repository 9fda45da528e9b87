"""YAML file as text, of bounded size and in clean UTF-8, and as a tree: values, and where each stands."""

from __future__ import annotations

import codecs
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from trajcli.errors import FileError, InputError, Place, Problem
from trajcli.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

MAX_BYTES = 5_000_000
STDIN = "<stdin>"

_BREAK = re.compile(r"\r\n|\r|\n")
_PLAIN = bytes([*b"\t\n\r", *range(0x20, 0x7F)])
# What YAML calls printable, less what shows as nothing or ends lines for some programs only.
_FORBIDDEN = "[^\t\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
_WIDE_MARKS = (  # the marks of UTF-32 first: UTF-16's little-endian one is the beginning of theirs
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)


class Node(NamedTuple):
    """A value and where it stands; a tuple, as a file has one for each number and a frozen class costs three.

    Attributes:
        value: A scalar, a list of nodes, or nodes by key.
        line: From 1.
        column: From 1.
        length: Characters that the value takes on that line, of a block its first key or dash; at least 1.
        text: A scalar as it stands in the file, quotes included; empty for lists and mappings.
        keys: The nodes of a mapping's keys.
    """

    value: bool | int | float | str | list[Node] | dict[str, Node] | None
    line: int
    column: int
    length: int
    text: str = ""
    keys: dict[str, Node] | None = None

    def child(self, step: str | int) -> Node | None:
        """Return the node under a key, or at an index from 0; None when there is none."""
        if isinstance(self.value, dict):
            return self.value.get(step) if isinstance(step, str) else None
        if isinstance(self.value, list) and isinstance(step, int) and 0 <= step < len(self.value):
            items: list[Node] = self.value
            return items[step]
        return None

    def plain(self) -> Any:  # noqa: ANN401
        """Return the value as new dicts, lists and scalars, without places."""
        value = self.value
        if isinstance(value, dict):
            return {key: node.plain() for key, node in value.items()}
        if isinstance(value, list):
            return [node.plain() for node in value]
        return value


@frozen
class Document:
    """One YAML document.

    Attributes:
        file: Its path as the user wrote it, or "<stdin>".
        lines: The lines of the file, without their ends.
        root: The whole of it.
    """

    file: str
    lines: tuple[str, ...]
    root: Node

    def node(self, path: Sequence[str | int]) -> Node | None:
        """Return the node at a path such as ("moves", 0, "duration"), or None when there is none."""
        node: Node | None = self.root
        for step in path:
            node = node.child(step) if node is not None else None
        return node

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where the deepest existing node on the path stands.

        Args:
            path: Keys, and indices from 0.
            key: Point at the last key itself instead of its value, if the whole path exists.
        """
        node = shown = self.root
        for depth, step in enumerate(path, 1):
            child = node.child(step)
            if child is None:
                break
            keys = node.keys if key and depth == len(path) else None
            shown = keys.get(str(step), child) if keys else child
            node = child
        return place(self.file, self.lines, shown.line, shown.column, shown.length)

    def round_of(self, move: int) -> str:
        """Return in which round of a repeat a move is, such as "slot 3 of 18"; empty outside of any."""
        del move
        return ""

    def without_round(self, point: str) -> str:
        """Return the name of a point as it is written, without the round of a repeat in which it is that."""
        return point

    def plain(self) -> Any:  # noqa: ANN401
        """Return the whole as new dicts, lists and scalars."""
        return self.root.plain()


def place(file: str, lines: Sequence[str], line: int, column: int, length: int = 1) -> Place:
    """Return a place in a file for errors; one behind the last text is moved to the end of that."""
    if line > len(lines) or (line == len(lines) and not lines[-1]):
        line = max((number for number, text in enumerate(lines, 1) if text.strip()), default=1)
        column, length = len(lines[line - 1].rstrip()) + 1, 1
    return Place(file, line, column, lines[line - 1], max(length, 1))


def read_bytes(path: str, largest: int = MAX_BYTES) -> bytes:
    """Return the content of a file, or of standard input for `-`.

    Args:
        path: The file.
        largest: How many bytes it may have.

    Raises:
        FileError: When it is missing or cannot be read.
        InputError: When it is longer.
    """
    if path == "-":
        return _read_stdin(largest)
    try:
        with Path(path).open("rb") as file:
            data = file.read(largest + 1)
        size = max(Path(path).stat().st_size, len(data))
    except FileNotFoundError:
        raise FileError(f"there is no file '{path}'") from None
    except IsADirectoryError:
        raise FileError(f"'{path}' is a folder, expected a file") from None
    except PermissionError:
        raise FileError(f"'{path}' may not be read: permission denied") from None
    except (OSError, ValueError) as error:  # ValueError: a NUL byte in the path
        reason = getattr(error, "strerror", None) or error
        raise FileError(f"'{path}' cannot be read: {reason}") from None
    return _bounded(data, path, size, largest)


def _read_stdin(largest: int) -> bytes:
    try:
        data = sys.stdin.buffer.read(largest + 1)
    except (OSError, ValueError, AttributeError) as error:  # closed, or absent: then sys.stdin is None
        raise FileError(f"standard input cannot be read: {error}") from None
    return _bounded(data, STDIN, len(data), largest)


def _bounded(data: bytes, file: str, size: int, largest: int = MAX_BYTES) -> bytes:
    if len(data) <= largest:
        return data
    length = f"{size / 1e6:.1f} MB long" if size > largest + 1 else f"longer than {largest / 1e6:g} MB"
    message = f"the file is {length}; at most {largest / 1e6:g} MB ({largest} bytes) are read"
    raise InputError(Problem(message, place=Place(file, 1, 1)))


def decode(data: bytes, file: str) -> str:
    """Return the text of a file.

    Raises:
        InputError: When it is too long, not UTF-8, or begins with a byte order mark.
    """
    _bounded(data, file, len(data))
    for mark, name in _WIDE_MARKS:
        if data.startswith(mark):
            hint = "save it as UTF-8"
            raise InputError(Problem(f"the file is {name}, expected UTF-8", hint, Place(file, 1, 1)))
    if data.startswith(codecs.BOM_UTF8):
        hint = "save it as UTF-8 without BOM, or remove its first three bytes: tail -c +4 FILE"
        raise InputError(Problem("the file begins with a byte order mark (BOM)", hint, Place(file, 1, 1)))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        lines = split_lines(data[: error.start].decode("utf-8"))
        remainder = data[error.start : error.start + 200].decode("utf-8", "replace")
        source = lines[-1] + split_lines(remainder)[0]
        at = Place(file, len(lines), len(lines[-1]) + 1, source)
        message = (
            f"the byte 0x{data[error.start]:02X} is not UTF-8: the file is binary, or in another encoding"
        )
        raise InputError(Problem(message, "save it as UTF-8", at)) from None


def split_lines(text: str) -> tuple[str, ...]:
    """Return the lines without their ends; a text that ends with a line break has an empty last one."""
    return tuple(_BREAK.split(text) if "\r" in text else text.split("\n"))


def check_characters(text: str, file: str, lines: Sequence[str]) -> None:
    """Refuse characters that have no business in a text.

    Raises:
        InputError: Naming the first of them, and how many there are.
    """
    if not text.isascii() or text.encode().translate(None, _PLAIN):
        forbidden = re.compile(_FORBIDDEN)  # slow to compile, and nearly never needed
        found = [(number, m) for number, line in enumerate(lines, 1) for m in forbidden.finditer(line)]
        if not found:
            return
        number, first = found[0]
        more = f" (and {len(found) - 1} more like it)" if len(found) > 1 else ""
        message = f"{_character(first[0])} cannot stand in a job file{more}"
        hint = (
            "the file looks binary"
            if "\0" in text
            else "remove it, or write it as an escape in double quotes"
        )
        raise InputError(Problem(message, hint, place(file, lines, number, first.start() + 1)))


def _character(character: str) -> str:
    import unicodedata

    name = unicodedata.name(character, "").lower()
    kind = "the NUL byte" if character == "\0" else "the control character"
    kind = kind if ord(character) < 0xA0 else "the invisible character"
    return f"{kind} U+{ord(character):04X}{f' ({name})' if name else ''}"


def tab_problem(file: str, lines: Sequence[str]) -> Problem | None:
    """Return what is wrong with tabs in the indentation: one problem, at the first of them."""
    found = []
    for number, line in enumerate(lines, 1):
        if "\t" in line:
            column = line.index("\t") + 1
            if not line[: column - 1].strip(" "):
                found.append((number, column, len(line) - len(line.lstrip(" \t")) - column + 1))
    if not found:
        return None
    more = f" (and in {len(found) - 1} more line{'s' * (len(found) > 2)})" if len(found) > 1 else ""
    message = f"a tab in the indentation{more}"
    return Problem(message, "indent with spaces", place(file, lines, *found[0]))
