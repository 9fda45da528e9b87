"""Tolerances by column: what a user writes, and what holds for which column."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite

from trajcli.columns import Column
from trajcli.errors import InputError, Problem

ALL = "*"  # the key of a tolerance for every column


def parse_tolerances(text: str) -> dict[str, float]:
    """Return the tolerances in `q=1e-9,qd=1e-6`, or under `ALL` the bare number for every column.

    A name is that of a kind of columns (`q`) or of one column (`q1_deg`).

    Raises:
        InputError: When an entry is neither a number nor a name with one, a number is negative or not finite,
            or a name stands twice.
    """
    tolerances: dict[str, float] = {}
    problems = []
    for entry in text.split(","):
        name, equals, number = (part.strip() for part in entry.rpartition("="))
        flaw = _flaw(entry.strip(), name, equals, number, tolerances)
        if flaw:
            problems.append(Problem(flaw, "such as q=1e-9,qd=1e-6, or one number for all columns"))
        else:
            tolerances[name or ALL] = float(number)
    if problems:
        raise InputError(*problems)
    return tolerances


def tolerance_of(tolerances: Mapping[str, float], column: Column) -> float:
    """Return what holds for `column`: its own entry, else its kind's, else that for all, else zero."""
    for name in (column.name, column.kind, ALL):
        if name in tolerances:
            return tolerances[name]
    return 0.0


def require_known(tolerances: Mapping[str, float], columns: Iterable[Column]) -> None:
    """Refuse a tolerance that is for none of `columns`.

    Raises:
        InputError: Naming the columns and kinds there are.
    """
    names = list(dict.fromkeys(name for column in columns for name in (column.kind, column.name)))
    unknown = [name for name in tolerances if name != ALL and name not in names]
    if unknown:
        from difflib import get_close_matches

        near = get_close_matches(unknown[0], names, 1)
        hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(names)}"
        raise InputError(f"the tolerance for '{unknown[0]}' fits no column that both files have", hint=hint)


def _flaw(entry: str, name: str, equals: str, number: str, known: Mapping[str, float]) -> str | None:
    try:
        value = float(number)
    except ValueError:
        return f"the tolerance '{entry}' does not end in a number"
    if not (isfinite(value) and value >= 0):
        return f"the tolerance '{entry}' is {value:g}, expected a finite number of at least 0"
    if equals and not name:
        return f"the tolerance '{entry}' names no column"
    if (name or ALL) in known:
        return f"the tolerance '{entry}' comes after another one for the same columns"
    return None
