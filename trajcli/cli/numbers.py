"""Formatting of numbers, matrices and tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from trajcli.units import Units

_DECIMALS = 12  # below is rounding of sines and cosines


def number(value: float) -> str:
    """Return a number with up to nine digits, without what rounding left of a zero."""
    return f"{round(value, _DECIMALS) + 0.0:.9g}"


def numbers(values: Sequence[float]) -> str:
    """Return numbers separated by blanks."""
    return "  ".join(map(number, values))


def matrix_lines(rows: Sequence[Sequence[float]], indent: str = "  ") -> Iterator[str]:
    """Yield the lines of a matrix with aligned columns."""
    cells = [[number(value) for value in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        yield indent + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))


def pose_lines(view: Mapping[str, Any], units: Units, indent: str = "  ") -> Iterator[str]:
    """Yield the lines of a pose as `pose_view` gives it."""
    yield from matrix_lines(view["matrix"], indent)
    yield f"{indent}xyz ({units.length}): {numbers(view['xyz'])}"
    yield f"{indent}rpy ({units.angle}, about fixed x, y, z): {numbers(view['rpy'])}"
    yield f"{indent}quat_wxyz: {numbers(view['quat_wxyz'])}"


def table_lines(rows: Sequence[Sequence[str]], indent: str = "  ") -> Iterator[str]:
    """Yield the lines of a table: texts to the left, numbers to the right, the first row as the head."""
    width = [max(map(len, column)) for column in zip(*rows, strict=True)]
    right = [all(_is_number(cell) for cell in column[1:]) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = [cell.rjust(width[i]) if right[i] else cell.ljust(width[i]) for i, cell in enumerate(row)]
        yield (indent + "  ".join(cells)).rstrip()


def _is_number(cell: str) -> bool:
    return cell.lstrip("-+")[:1].isdigit() or cell in ("", "-")
