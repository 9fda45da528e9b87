"""Tables of sweeps: their text, the best of their rows, and a picture of them."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import numpy as np

from trajcli.batches.sweep import number_text
from trajcli.batches.task import SweepPoint
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.job.yaml.load import parse_document
from trajcli.plots.axes import shortened
from trajcli.plots.legend import COLOURS, LIMIT_COLOUR
from trajcli.plots.write import figure_bytes, format_of_picture
from trajcli.streams.whole_file import whole_file
from trajcli.suggest import did_you_mean, valid_names

Form = Literal["csv", "jsonl"]
RESULTS = ("verdict", "duration", "tightest", "bound")
_NUMBERS = ("duration", "bound")
_WIDTH, _HEIGHT = 7.0, 4.6  # of a picture, inches
_TICKS, _LABEL, _SIZE = 9, 1.1, 9.0  # most labels of an axis, inches each may take, size of texts in points
_GREY = [0xDD / 255] * 3


@frozen
class SweepRow:
    """One row.

    Attributes:
        values: Of what was varied, as YAML.
        point: What came of the job.
    """

    values: tuple[str, ...]
    point: SweepPoint

    def plain(self) -> list[Any]:
        """Return the values of the row as numbers, texts, lists."""
        read = [parse_document(value, "", any_root=True).plain() for value in self.values]
        return [*read, *(getattr(self.point, name) for name in RESULTS)]


@frozen
class SweepTable:
    """What came of a sweep.

    Attributes:
        paths: What was varied, as the user wrote it.
        rows: In the order of the combinations, of the last path the values change first.
    """

    paths: tuple[str, ...]
    rows: tuple[SweepRow, ...]

    def __repr__(self) -> str:
        return f"SweepTable({', '.join(self.paths)}: {_title(self)})"

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the columns."""
        return (*self.paths, *RESULTS)

    def text(self, form: Form) -> str:
        """Return the table as CSV with a header, or as JSON lines."""
        if form == "jsonl":
            lines = (json.dumps(dict(zip(self.columns, row.plain(), strict=True))) for row in self.rows)
            return "".join(f"{line}\n" for line in lines)
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows:
            writer.writerow(self.cells(row))
        return out.getvalue()

    def cells(self, row: SweepRow) -> list[str]:
        """Return the texts of a row; empty ones where nothing is known."""
        return [*row.values, *(_cell(getattr(row.point, name)) for name in RESULTS)]

    def save(self, path: str | Path) -> None:
        """Write the table; the ending of the name, .csv or .jsonl, says in which form.

        Raises:
            InputError: When it has another ending.
            FileError: When it cannot be written.
        """
        text = self.text(form_of_table(str(path)))
        with whole_file(path) as out:
            out.write(text.encode())

    def best(self, column: str) -> SweepRow | None:
        """Return the verified row with the smallest number in a column, or with -COLUMN the largest.

        Raises:
            InputError: When there is no such column, or it holds other things than numbers.
        """
        name = check_column(self.paths, column)
        index = self.columns.index(name)
        rows = [row for row in self.rows if row.point.verdict == "verified"]
        found = [(row.plain()[index], row) for row in rows]
        numbers = [(value, row) for value, row in found if value is not None]
        if any(isinstance(value, bool) or not isinstance(value, int | float) for value, _ in numbers):
            raise InputError(f"--best {column}: {name} holds other things than numbers")
        sign = -1 if column != name else 1
        return min(numbers, key=lambda each: sign * each[0], default=(None, None))[1]

    def plot(self, path: str | Path) -> None:
        """Draw the duration over what was varied: a curve over one path, a map over two.

        Raises:
            InputError: When more is varied, or the ending of the name is that of no picture.
            FileError: When the file cannot be written.
        """
        kind = check_picture(self.paths, str(path))
        content = figure_bytes(lambda: _figure(self), kind, _title(self))
        with whole_file(path) as out:
            out.write(content)


def _cell(value: str | float | None) -> str:
    return "" if value is None else value if isinstance(value, str) else number_text(value)


def form_of_table(path: str) -> Form:
    """Return the form of a table from the ending of its name.

    Raises:
        InputError: When it is another one.
    """
    ending = Path(path).suffix.lower()
    if ending not in (".csv", ".jsonl"):
        raise InputError(f"a table is written as .csv or .jsonl, not as '{Path(path).name}'")
    return "csv" if ending == ".csv" else "jsonl"


def check_column(paths: Sequence[str], column: str) -> str:
    """Return the name of a column that may be best, without its sign.

    Raises:
        InputError: When there is none of that name, or it never holds numbers.
    """
    columns, name = (*paths, *_NUMBERS), column.removeprefix("-")
    if name not in columns:
        hint = did_you_mean(name, columns) or valid_names(columns)
        raise InputError(f"--best {column}: there is no column of numbers '{name}'", hint=hint)
    return name


def check_picture(paths: Sequence[str], path: str) -> str:
    """Return the format of a picture, from the ending of its name.

    Raises:
        InputError: When it is none, or more is varied than a picture shows.
    """
    if len(paths) > 2:
        raise InputError(f"a picture is of one or two values, not of {len(paths)}", hint="leave --plot out")
    return format_of_picture(path, None)


def _title(table: SweepTable) -> str:
    verified = sum(row.point.verdict == "verified" for row in table.rows)
    return f"{len(table.rows)} rows, {verified} verified"


def _figure(table: SweepTable) -> Any:  # noqa: ANN401
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, _HEIGHT), layout="constrained")
    plane = figure.add_subplot()
    plane.set_title(_title(table), fontsize=_SIZE, loc="left")
    plane.tick_params(labelsize=_SIZE)
    plane.set_xlabel(shortened(table.paths[0], _SIZE, _WIDTH - 2), fontsize=_SIZE)
    (_draw_curve if len(table.paths) == 1 else _draw_map)(figure, plane, table)
    return figure


def _draw_curve(figure: Any, plane: Any, table: SweepTable) -> None:  # noqa: ANN401
    """Draw durations and their bounds; crosses are over a limit, ticks at the foot have no motion."""
    del figure
    x = _abscissas(plane.xaxis, tuple(row.values[0] for row in table.rows))
    table = SweepTable(table.paths, tuple(table.rows[k] for k in x.argsort(kind="stable")))
    x.sort()
    durations, bounds = (_numbers(table, name) for name in _NUMBERS)
    verified = np.array([row.point.verdict == "verified" for row in table.rows])
    shown = np.where(verified, durations, np.nan)
    plane.plot(x, shown, color=COLOURS[0], marker="o", markersize=3, label="verified", gid="verified")
    if np.isfinite(bounds).any():
        style: dict[str, Any] = {"color": COLOURS[3], "linestyle": "--", "linewidth": 0.8}
        plane.plot(x, bounds, label="bound", gid="bound", **style)
    beyond, missing = ~verified & np.isfinite(durations), np.isnan(durations)
    if beyond.any():
        style = {"color": LIMIT_COLOUR, "marker": "x", "linestyle": "none"}
        plane.plot(x[beyond], durations[beyond], label="over a limit", gid="exceeded", **style)
    if missing.any():
        style = {"color": LIMIT_COLOUR, "marker": "|", "linestyle": "none", "markersize": 12}
        foot = {"transform": plane.get_xaxis_transform(), "clip_on": False}
        plane.plot(x[missing], np.zeros(missing.sum()), label="no motion", gid="missing", **style, **foot)
    plane.set_ylabel("duration [s]", fontsize=_SIZE)
    plane.legend(fontsize=_SIZE, frameon=False)


def _draw_map(figure: Any, plane: Any, table: SweepTable) -> None:  # noqa: ANN401
    """Draw durations as colours; crosses are over a limit, grey has no motion, white was not asked for."""
    across, up = (_in_order(row.values[axis] for row in table.rows) for axis in (0, 1))
    colours, asked = np.full((len(up), len(across)), np.nan), np.zeros((len(up), len(across)))
    beyond = list[tuple[int, int]]()
    for row, duration in zip(table.rows, _numbers(table, "duration").tolist(), strict=True):
        x, y = across.index(row.values[0]), up.index(row.values[1])
        colours[y, x], asked[y, x] = duration, 1.0
        if row.point.verdict != "verified" and np.isfinite(duration):
            beyond.append((x, y))
    _label_ticks(plane.xaxis, across)
    _label_ticks(plane.yaxis, up)
    plane.set_ylabel(shortened(table.paths[1], _SIZE, _HEIGHT - 1), fontsize=_SIZE)
    grey = np.where(asked[..., None] > 0, _GREY, 1.0)
    plane.imshow(grey, origin="lower", aspect="auto", interpolation="nearest")
    if np.isfinite(colours).any():
        shown = plane.imshow(
            colours, origin="lower", aspect="auto", interpolation="nearest", cmap="viridis", gid="durations"
        )
        bar = figure.colorbar(shown, ax=plane)
        bar.set_label("duration [s]", fontsize=_SIZE)
        bar.ax.tick_params(labelsize=_SIZE)
    for x, y in beyond:
        plane.plot([x], [y], color=LIMIT_COLOUR, marker="x", linestyle="none", gid="exceeded")


def _in_order(values: Iterable[str]) -> tuple[str, ...]:
    """Return values once each: numbers rising, others as they come."""
    once = tuple(dict.fromkeys(values))
    with suppress(ValueError):
        return tuple(sorted(once, key=float))
    return once


def _numbers(table: SweepTable, name: str) -> Array:
    return np.array([getattr(row.point, name) for row in table.rows], dtype=np.float64)


def _abscissas(axis: Any, values: tuple[str, ...]) -> Array:  # noqa: ANN401
    """Return where values stand on an axis: at their numbers, or one after the other with their names."""
    try:
        return np.array([float(value) for value in values])
    except ValueError:
        _label_ticks(axis, values)
        return np.arange(len(values), dtype=np.float64)


def _label_ticks(axis: Any, values: tuple[str, ...]) -> None:  # noqa: ANN401
    """Write values below an axis, as many as there is room for."""
    step = -(-len(values) // _TICKS)
    chosen = range(0, len(values), step)
    axis.set_ticks(list(chosen), [shortened(values[index], _SIZE, _LABEL) for index in chosen])
