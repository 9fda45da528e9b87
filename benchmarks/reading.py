"""A table of 10^5 rows of nineteen columns read from CSV, in the forms in which others write numbers."""

from __future__ import annotations

import atexit
import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

ROWS, WIDTH = 10**5, 19
FORMS = {"six": "%.6f", "all": "%.17g", "scientific": "%.18e"}


def _file(form: str) -> Path:
    """Return a file of smooth motions, as a recorder would write it."""
    import numpy as np

    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    path, t = Path(folder.name) / "rows.csv", np.arange(ROWS) / 1000
    rows = np.column_stack([t, *(np.sin(t * (k + 1) / WIDTH + k) * 3 for k in range(WIDTH - 1))])
    np.savetxt(path, rows, form, ",", header=",".join(f"c{k}" for k in range(WIDTH)), comments="")
    return path


def _some(columns):
    return columns[:: ROWS // 4].reshape(-1)


def _ours(form: str):
    from trajcli.streams.table import read_csv

    path = _file(FORMS[form])
    return lambda: read_csv(path).columns, _some


def _loadtxt(form: str):
    import numpy as np

    path = _file(FORMS[form])
    return lambda: np.loadtxt(path, delimiter=",", skiprows=1), _some


six, six_loadtxt = partial(_ours, "six"), partial(_loadtxt, "six")
all_digits, all_loadtxt = partial(_ours, "all"), partial(_loadtxt, "all")
scientific, scientific_loadtxt = partial(_ours, "scientific"), partial(_loadtxt, "scientific")


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: six decimals, as many digits as restore each bit, and numpy's default."""
    found = []
    for name, ours, theirs in (
        ("six decimals", "six", "six_loadtxt"),
        ("17 digits", "all_digits", "all_loadtxt"),
        ("%.18e", "scientific", "scientific_loadtxt"),
    ):
        runs = compete(
            {part: Function(sys.executable, "benchmarks.reading", part) for part in (ours, theirs)}
        )
        title = f"read 10^5 x 19 of CSV, {name}"
        found.append(Figure(title, "np.loadtxt", runs[ours].seconds, runs[theirs].seconds, 0.5))
    return found
