"""Rows of numbers in text, block by block, with the decimals that they show."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from math import isfinite
from typing import BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem
from trajcli.streams.decimals import NotFixedError, scan_fixed
from trajcli.streams.number_cells import decimals_of, scan_decimals
from trajcli.streams.recorded.column_names import unit_of
from trajcli.streams.text_layout import LONGEST_LINE, Header, RowLayout, is_number, layout_of

_SHOWN = 40  # characters of a cell, and
_SHOWN_LINE = 200  # of a line, in a message
_QUOTED = re.compile(rb'"[^"]*"')
_UNITS = "a line of units is not read: leave it out, and say them by --units, or in the names: q1_deg"
_CUT = "the file ends in the middle of a line: it may have been cut"


def chunks(stream: BinaryIO, file: str, before: bytes, size: int) -> Iterator[bytes]:
    """Yield whole lines of a stream, each ending in a line feed, but for the last line where it has none.

    Args:
        stream: Of text.
        file: Its name, for messages.
        before: What was read already, and is part of the lines.
        size: About as many bytes are yielded at a time.

    Raises:
        InputError: When a line has no end, so that this is no table.
    """
    while text := before + stream.read(size):
        before = b""
        if not text.endswith(b"\n"):
            tail = stream.readline(LONGEST_LINE)
            if len(tail) == LONGEST_LINE:
                raise InputError(f"{file} is no table: it has a line of more than {LONGEST_LINE} bytes")
            text += tail
        if b"\r" in text:
            text = text.replace(b"\r\n", b"\n")
        yield text


class RowReader:
    """Parser of rows, which counts their decimals.

    Attributes:
        decimals: The most decimals seen, by column that is taken.
    """

    def __init__(self, header: Header, taken: Sequence[int] | None = None, fixed: Sequence[int] = ()) -> None:
        """Prepare to read rows under a header.

        Args:
            header: Names of the columns.
            taken: Indices of the columns that hold numbers to be taken, rising; all unless given.
            fixed: Indices of columns whose texts must be those of the first row.
        """
        self._header = header
        self._taken = list(range(len(header.names))) if taken is None else list(taken)
        self._fixed = list(fixed)
        self._all = len(self._taken) == len(header.names)
        self._line = header.line + 1
        self._layout: RowLayout | None = None
        self._texts: set[bytes] = set()  # of the fixed columns: one in a file without flaws
        self.decimals = np.zeros(len(self._taken), dtype=np.int64)
        self._fixed_form = True  # as many decimals as in the first row, until they are not
        self._first: list[int] = []

    def read(self, text: bytes) -> Array:
        """Return the rows (N, columns) of whole lines.

        Raises:
            InputError: With the place of the first thing that is wrong.
        """
        if self._layout is None:
            first = next((line for line in text.split(b"\n") if line.strip()), None)
            if first is None:
                self._line += text.count(b"\n")
                return np.empty((0, len(self._taken)))
            self._layout = layout_of(self._header.names, self._header.text, first, text)
        layout = self._layout
        plain = text if text.endswith(b"\n") else text + b"\n"
        usual = layout.separator == "," and not layout.open_ended and self._fixed_form
        plain = plain if usual else layout.plain(plain)
        try:
            rows = self._numbers(plain)
        except NotFixedError:
            rows = self._numbers_of_any_form(layout.plain(plain) if usual else plain, text, layout)
        self._line += text.count(b"\n")
        return rows

    def _numbers(self, text: bytes) -> Array:
        """Return the rows of lines in a usual form; NotFixedError where they are in another one."""
        if not self._all:
            text = self._taken_cells(text)
        width = len(self._taken)
        if not self._first:
            cells = text.partition(b"\n")[0].split(b",")
            self._first = [len(cell.partition(b".")[2]) for cell in cells]
            self._fixed_form = len(cells) == width
        if self._fixed_form:
            try:
                rows = scan_fixed(text, self._first)
                self.decimals = np.maximum(self.decimals, self._first)
            except NotFixedError:
                self._fixed_form = False
            else:
                return rows
        rows, decimals = scan_decimals(text, width)
        self.decimals = np.maximum(self.decimals, decimals)
        return rows

    def _taken_cells(self, text: bytes) -> bytes:
        """Return the cells of the columns that are taken; NotFixedError where lines are of another width."""
        width = len(self._header.names)
        buffer = np.frombuffer(text, dtype=np.uint8).copy()
        feeds = buffer == ord("\n")
        ends = np.flatnonzero(feeds | (buffer == ord(",")))
        if b'"' in text or ends.size % width or feeds.sum() * width != ends.size:
            raise NotFixedError
        if not feeds[ends[width - 1 :: width]].all():
            raise NotFixedError
        lengths = np.diff(ends, prepend=-1)
        self._compare_texts(_cells_of(buffer, lengths, width, self._fixed), ends.size // width)
        buffer[ends[self._taken[-1] :: width]] = ord("\n")
        return _cells_of(buffer, lengths, width, self._taken)

    def _compare_texts(self, texts: bytes, count: int) -> None:
        """Take the texts of some rows; NotFixedError where they are not those of all rows before."""
        if self._fixed:
            first = texts[: len(texts) // count]
            if texts != first * count or self._differ([first[:-1]]):
                raise NotFixedError

    def _differ(self, texts: Iterable[bytes]) -> bool:
        """Take texts of rows, with commas between cells; return whether there are two by now."""
        self._texts |= {b",".join(map(bytes.strip, text.split(b","))) for text in texts}
        return len(self._texts) > 1

    def _numbers_of_any_form(self, plain: bytes, written: bytes, layout: RowLayout) -> Array:
        """Return the rows of lines whose numbers are written in any form."""
        lines = [self._split(line) for line in plain.split(b"\n") if line.strip()]
        if not lines:
            return np.empty((0, len(self._taken)))
        if not all(len(line) == layout.width for line in lines):
            self._explain(written, layout)
        cells = [[line[index] for index in self._taken] for line in lines]
        try:
            rows = np.array([list(map(_number, line)) for line in cells])
        except ValueError:
            self._explain(written, layout)
        texts = (b",".join(line[index] for index in self._fixed) for line in lines)
        if not np.isfinite(rows).all() or self._differ(texts):
            self._explain(written, layout)
        shown = [max(map(decimals_of, column)) for column in zip(*cells, strict=True)]
        self.decimals = np.maximum(self.decimals, shown)
        return rows

    def _split(self, line: bytes) -> list[bytes]:
        """Return the cells of a line without quotation marks, between which commas do not separate."""
        if b'"' not in line:
            return line.split(b",")
        hidden = _QUOTED.sub(lambda match: match[0].replace(b",", b"\x1f"), line)
        cells = [cell.replace(b"\x1f", b",").strip() for cell in hidden.split(b",")]
        return [cell[1:-1] if re.fullmatch(_QUOTED, cell) else cell for cell in cells]

    def _explain(self, text: bytes, layout: RowLayout) -> NoReturn:
        """Say what is wrong with the first of some lines that is wrong."""
        lines = text.split(b"\n")
        for index, line in enumerate(lines):
            flaw = self._flaw_of(line, self._line + index, layout) if line.strip() else None
            if flaw is not None:
                message, hint, place = flaw
                last = index == len(lines) - 1  # it has no line feed
                raise InputError(Problem(message, _CUT if last else hint, place))
        place = Place(self._header.file, self._line, 1, _shown_line(lines[0]))
        raise InputError(Problem("the rows are about other joints than the first one", None, place))

    def _flaw_of(self, line: bytes, number: int, layout: RowLayout) -> tuple[str, str | None, Place] | None:
        """Return what is wrong with a line, what would fix it, and where; None where nothing is."""
        source, names = line.decode("utf-8", "replace"), self._header.names
        if '"' in source:
            cells = list(_found_in(source, self._split(layout.plain(line + b"\n")[:-1])))
        else:
            cells = layout.cells(source)
        if len(cells) != len(names):
            place = Place(
                self._header.file, number, 1, _shown_line(line), max(min(len(source), _SHOWN_LINE), 1)
            )
            return (
                f"the line has {len(cells)} values, expected {len(names)} as in line {self._header.line}",
                None,
                place,
            )
        for index in self._taken:
            column, cell = cells[index]
            text = layout.number(cell)
            if not (is_number(text) and isfinite(float(text))):
                shown = cell.strip() if len(cell) <= _SHOWN else cell.strip()[:_SHOWN] + "..."
                place = Place(self._header.file, number, column, _shown_line(line), max(len(cell), 1))
                value = f"'{shown}'" if shown else "empty"
                hint = _UNITS if unit_of(cell.strip(' "[]()')) else None
                return f"{names[index]} is {value}, expected a finite number", hint, place
        return None


def _found_in(line: str, cells: Sequence[bytes]) -> Iterator[tuple[int, str]]:
    """Yield the cells of a quoted line, each with its column, from 1."""
    at = 0
    for text in (cell.decode("latin-1") for cell in cells):
        at = max(line.find(text, at), at)
        yield at + 1, text
        at += len(text)


def _cells_of(
    buffer: NDArray[np.uint8], lengths: NDArray[np.intp], width: int, columns: Sequence[int]
) -> bytes:
    """Return the cells of some columns, each with the byte behind it."""
    if not columns:
        return b""
    chosen = np.zeros(width, np.bool_)
    chosen[list(columns)] = True
    return buffer[np.repeat(np.tile(chosen, lengths.size // width), lengths)].tobytes()


def _number(cell: bytes) -> float:
    if not is_number(cell):
        raise ValueError
    return float(cell)


def _shown_line(line: bytes) -> str:
    text = line.decode("utf-8", "replace")
    return text if len(text) <= _SHOWN_LINE else text[:_SHOWN_LINE]
