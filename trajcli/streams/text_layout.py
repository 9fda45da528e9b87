"""Layout of tables in text: the line of names, the separator of cells, points or commas in decimals."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from typing import BinaryIO

from trajcli.errors import InputError, Place, Problem
from trajcli.frozen import comparable

LONGEST_LINE = 1 << 16
"""Bytes: what has no line feed by then is no table."""

_MOST_COMMENTS = 1000  # lines in front of the names
_NUMBER = re.compile(rb"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_LOCAL_NUMBER = re.compile(rb"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_FIRST_DECIMALS = re.compile(
    rb"(?:^|[;\t \"])[+-]?[0-9]*([.,])[0-9]+(?:[eE][+-]?[0-9]+)?(?=[;\t \"\r]|$)", re.MULTILINE
)
_COMMENT = (b"#", b"%", b"sep=")  # the last one is Excel's: it says the separator, which is seen anyway
_QUOTED = re.compile(r'"[^"]*"')
_HEAD = "a CSV begins with a line of the columns' names"


def is_number(cell: bytes) -> bool:
    """Return whether a cell is a decimal number, blanks around it left out."""
    return _NUMBER.fullmatch(cell.strip()) is not None


@comparable
class Header:
    """The line of names of a table.

    Attributes:
        names: The columns' names, those at the end without one left out.
        text: The line as it is written.
        line: Its number, from 1.
        file: Name of the file, for messages.
    """

    names: tuple[str, ...]
    text: str
    line: int
    file: str

    def place(self, name: str | None = None) -> Place:
        """Return where a name stands, or the whole line."""
        if name not in self.names:
            return Place(self.file, self.line, 1, self.text, max(len(self.text), 1))
        at = self.text.find(name, _cells_of(self.text)[self.names.index(name)][0] - 1)
        return Place(self.file, self.line, max(at, 0) + 1, self.text, max(len(name), 1))


def read_header(stream: BinaryIO, file: str) -> tuple[Header, bytes]:
    """Read the names of a table: its first line, or the last of several lines of comments.

    Returns:
        The names, and what was read behind them.

    Raises:
        InputError: When there are none, or one is missing, doubled or a number.
    """
    line, number, text = _line(stream, file).removeprefix(BOM_UTF8), 1, b""
    while line.lstrip().startswith(_COMMENT) and number < _MOST_COMMENTS:
        behind = [_line(stream, file, number + 1)]
        while behind[-1] and not behind[-1].strip() and len(behind) < _MOST_COMMENTS:
            behind.append(_line(stream, file, number + 1))
        if not behind[-1].strip() or _NUMBER.match(behind[-1].lstrip()):
            text = b"".join(behind)
            break  # the comment is the line of names
        line, number = behind[-1], number + len(behind)
    header = _decoded(line, file)
    names = _names(header)
    _refuse_flaws(names, Header(names, header, number, file))
    return Header(names, header, number, file), text


def _line(stream: BinaryIO, file: str, number: int = 1) -> bytes:
    line = stream.readline(LONGEST_LINE)
    if not line and number == 1:
        raise InputError(f"{file} is empty", hint=_HEAD)
    if b"\0" in line or len(line) == LONGEST_LINE:
        raise InputError(f"{file} is not text", hint=_HEAD)
    return line


def _decoded(line: bytes, file: str) -> str:
    try:
        return line.decode().rstrip("\r\n")
    except UnicodeDecodeError:
        pass
    if any(byte < 9 or 0x80 <= byte < 0xA0 for byte in line):  # no letters in any code of a byte each
        raise InputError(f"{file} is not text", hint=_HEAD)
    return line.decode("latin-1").rstrip("\r\n")


def _names(text: str) -> tuple[str, ...]:
    """Return the names of a line; "column 1" is the first without one, as that of an index before others."""
    names = [name.strip().removeprefix('"').removesuffix('"').strip() for _, name in _cells_of(text)]
    while len(names) > 1 and not names[-1]:
        names.pop()
    return (names[0] or "column 1", *names[1:]) if len(names) > 1 else tuple(names) or ("",)


def _refuse_flaws(names: Sequence[str], header: Header) -> None:
    """Refuse a name that is missing, doubled or a number."""
    for index, name in enumerate(names):
        message = hint = None
        if not name:
            message = f"column {index + 1} of {len(names)} has no name"
        elif is_number(name.encode()) or _LOCAL_NUMBER.fullmatch(name.encode()):
            message = f"{name} stands where a column's name should be"
            hint = "put a line of names on top: t,q1,q2"
        elif name in names[:index]:
            message = f"there are two columns '{name}'"
        if message is not None:
            column = ([at for at, _ in _cells_of(header.text)] or [1])[index]
            place = Place(header.file, header.line, column, header.text, max(len(name), 1))
            raise InputError(Problem(message, hint, place))


def _separator(text: str) -> str:
    """Return what separates the names of a line: the first of some marks that stands outside of quotes."""
    return next((mark for mark in ";,\t" if mark in _QUOTED.sub("", text)), " ")


def _cells_of(text: str) -> list[tuple[int, str]]:
    """Return the cells of a line of names, each with its column, from 1; marks in quotes separate none."""
    plain = text.lstrip().lstrip("#%") if text.lstrip().startswith(("#", "%")) else text
    hidden, before = _QUOTED.sub(lambda quoted: "_" * len(quoted[0]), plain), len(text) - len(plain)
    separator = _separator(text)
    if separator == " ":
        found = [(match.start() + 1, match[0]) for match in re.finditer(r"\S+", hidden)]
    else:
        found = list(_split(hidden, separator))
    return [(before + at, plain[at - 1 : at - 1 + len(cell)]) for at, cell in found]


@comparable
class RowLayout:
    """How the rows of a table are written.

    Attributes:
        separator: Between cells: a comma, a semicolon, a tab or a blank.
        decimal_comma: Whether a comma stands for the decimal point.
        width: Cells of a row.
        open_ended: Whether each row ends in a separator.
    """

    separator: str
    decimal_comma: bool
    width: int
    open_ended: bool

    def plain(self, text: bytes) -> bytes:
        """Return whole lines with commas between cells, points in decimals and no blanks around cells."""
        if self.decimal_comma:
            text = text.replace(b",", b".")
        if self.separator == " ":
            text = text.replace(b"\t", b" ")
            while b"  " in text:
                text = text.replace(b"  ", b" ")
            text = text.replace(b"\n ", b"\n").replace(b" \n", b"\n").removeprefix(b" ").replace(b" ", b",")
        else:
            text = _without_blanks(text, self.separator.encode())
            if self.separator != ",":
                text = text.replace(self.separator.encode(), b",")
        return text.replace(b",\n", b"\n") if self.open_ended else text

    def cells(self, line: str) -> list[tuple[int, str]]:
        """Return the cells of a line as they are written, each with its column, from 1."""
        if self.separator == " ":
            return [(match.start() + 1, match[0]) for match in re.finditer(r"\S+", line)]
        return list(_split(line, self.separator))[
            : -1 if self.open_ended and line.rstrip(" \r").endswith(self.separator) else None
        ]

    def number(self, cell: str) -> bytes:
        """Return a cell with a point in its decimals."""
        return cell.strip().replace(",", "." if self.decimal_comma else ",").encode()


def _split(line: str, separator: str) -> Iterator[tuple[int, str]]:
    column = 1
    for cell in line.split(separator):
        yield column, cell
        column += len(cell) + 1


def _without_blanks(text: bytes, separator: bytes) -> bytes:
    """Return a text without blanks beside separators and ends of lines."""
    if b" " in text or (separator != b"\t" and b"\t" in text):
        blanks = b" " if separator == b"\t" else b" \t"
        for blank in (blanks[k : k + 1] for k in range(len(blanks))):
            for mark in (separator, b"\n"):
                for pair in (blank + mark, mark + blank):
                    while pair in text:
                        text = text.replace(pair, mark)
        text = text.lstrip(blanks)
    return text


def layout_of(names: Sequence[str], header: str, first: bytes, rows: bytes = b"") -> RowLayout:
    """Return how rows are written whose names and first row are these.

    Args:
        names: The columns' names.
        header: The line of names.
        first: The first row, without its line feed.
        rows: More rows; where none of the first has decimals, their first number that has some says what
            stands before these.
    """
    named = _separator(header)
    line = first.rstrip(b"\r\n").decode("latin-1")
    for separator in dict.fromkeys((named, ";", ",", "\t", " ")):
        cells = line.split() if separator == " " else line.split(separator)
        open_ended = separator != " " and len(cells) == len(names) + 1 and not cells[-1].strip()
        if len(cells) == len(names) + open_ended and (len(names) > 1 or separator == named):
            local = any(_LOCAL_NUMBER.fullmatch(cell.strip().encode("latin-1")) for cell in cells)
            mark = _FIRST_DECIMALS.search(rows)
            local = separator != "," and (local or (mark is not None and mark[1] == b","))
            return RowLayout(separator, local, len(names), open_ended)
    return RowLayout(named, decimal_comma=False, width=len(names), open_ended=False)
