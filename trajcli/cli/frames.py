"""Rendering of problems: as text with the line of the file and a caret below it, and as JSON.

Text of a file never reaches the terminal as control characters: they are shown as escapes.
"""

from __future__ import annotations

import math
import textwrap
import unicodedata
from typing import TYPE_CHECKING, Any, NamedTuple

from trajcli.errors import LONGEST_LINE

if TYPE_CHECKING:
    from trajcli.errors import Place, Problem

WIDTH = 100  # columns of the terminal that a line of a frame takes at most, without the line number

_TAB = "    "
_CUT = "..."
_ESCAPED = (
    "Cc",
    "Cf",
    "Cs",
    "Co",
    "Cn",
    "Zl",
    "Zp",
)  # categories that show nothing, or something else than they are
_RESET, _BOLD, _RED, _CYAN = "\x1b[0m", "\x1b[1m", "\x1b[1;31m", "\x1b[36m"


class _Cell(NamedTuple):
    """One character of a line as it is shown."""

    text: str
    width: int


def render_problem(problem: Problem, *, color: bool, width: int | None = None) -> str:
    """Return a problem for people: place and message, then the line with a caret, then what would fix it.

    Args:
        problem: Amounts that are still in its message are written in SI.
        color: Whether to use the terminal's colors.
        width: Columns of the terminal, which no line passes; where there is none lines of the file have
            `WIDTH`, and messages stay one line.
    """
    paint = _painted if color else _plain
    place, hint = problem.place, shown(problem.advice() or "")
    where = f"{shown(place.file)}:{place.line}:{place.column}: " if place is not None else ""
    message = folded(f"{where}error: {shown(problem.text())}", width, "  ")
    message = message[: len(where)] + message[len(where) :].replace("error:", paint("error:", _RED), 1)
    rows = [message.replace(where.rstrip(), paint(where.rstrip(), _BOLD), 1) if where else message]
    if place is None or not place.source.strip():
        return "\n".join([*rows, *([paint(folded(f"  {hint}", width, "  "), _CYAN)] if hint else [])])
    gutter = " " * max(4, len(str(place.line)))
    space = WIDTH if width is None else width - len(gutter) - 3
    source, offset, length = _window(place, space)
    rows.append(f"{place.line:>{len(gutter)}} | {source}")
    carets = f"{gutter} | {' ' * offset}{paint('^' * length, _RED)}"
    fits = offset + length + 1 + sum(cell.width for cell in map(_cell, hint)) <= space
    if hint and fits:
        carets += f" {paint(hint, _CYAN)}"
    rows.append(carets)
    if hint and not fits:
        rows.append(folded(f"{gutter} = {hint}", width, f"{gutter}   ").replace(hint, paint(hint, _CYAN)))
    return "\n".join(rows)


def folded(text: str, width: int | None, indent: str) -> str:
    """Return a text in lines of so many columns, broken between words; in one where no width is given."""
    original, text = text, "".join(char + "\0" * (_cell(char).width - 1) for char in text)
    if width is None or len(text) <= width:
        return original
    first = text[: len(text) - len(text.lstrip())]
    lines = textwrap.wrap(
        text.lstrip(),
        width,
        initial_indent=first,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines).replace("\0", "")


def problem_as_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as a mapping that JSON can hold, with the same keys for every problem.

    Lines and columns count from 1, moves from 0, times from the start of the trajectory; `value` and
    `limit` are SI. What is not known, or not finite, is None.
    """
    place = problem.place
    return {
        "message": problem.text(),
        "hint": problem.advice(),
        "file": place.file if place is not None else None,
        "line": place.line if place is not None else None,
        "column": place.column if place is not None else None,
        "length": place.length if place is not None else None,
        "move": problem.move,
        "joint": problem.joint,
        "time": _finite(problem.time),
        "value": _finite(problem.value),
        "limit": _finite(problem.limit),
    }


def _finite(number: float | None) -> float | None:
    return float(number) if number is not None and math.isfinite(number) else None


def _painted(text: str, code: str) -> str:
    return f"{code}{text}{_RESET}"


def _plain(text: str, code: str) -> str:
    return text


def shown(text: str) -> str:
    """Return a line for people: control characters as escapes, and of a very long one the beginning."""
    short = text if len(text) <= LONGEST_LINE + len(_CUT) else text[:LONGEST_LINE] + _CUT
    plain = short.isascii() and short.isprintable()
    return short if plain else "".join(_cell(character).text for character in short)


def _cell(character: str) -> _Cell:
    """Return how a character is shown, and how many columns it takes."""
    if " " <= character <= "~":
        return _Cell(character, 1)
    if character == "\t":
        return _Cell(_TAB, len(_TAB))
    category = unicodedata.category(character)
    if category in _ESCAPED:
        escape = character.encode("unicode_escape").decode("ascii")
        return _Cell(escape, len(escape))
    if category in ("Mn", "Me"):
        return _Cell(character, 0)
    return _Cell(character, 2 if unicodedata.east_asian_width(character) in ("W", "F") else 1)


def _window(place: Place, width: int) -> tuple[str, int, int]:
    """Return the line as it is shown, the column of the first caret in it, and the number of carets.

    A line of more than `width` columns is cut behind the place, and before it only where that would not fit.
    """
    start = place.column - 1
    first = max(0, start - width)  # no need to measure a line of a million characters
    line = place.source.rstrip()
    cells = [_cell(character) for character in line[first : start + width]]
    at = min(start - first, len(cells))
    offset, total = sum(cell.width for cell in cells[:at]), sum(cell.width for cell in cells)
    length = sum(cell.width for cell in cells[at : at + place.length])
    right = _CUT if len(line) > start + width else ""
    left = _CUT if first or (total > width and offset + length + len(_CUT) > width) else ""
    while left and offset + len(left) > width // 3 and total + len(left + right) > width:
        gone = cells.pop(0)
        at, offset, total = at - 1, offset - gone.width, total - gone.width
    while cells and total + len(left + right) > width:
        total, right = total - cells.pop().width, _CUT
    length = sum(cell.width for cell in cells[at : at + place.length])
    return left + "".join(cell.text for cell in cells) + right, offset + len(left), max(length, 1)
