"""How two tables of numbers differ, as values and in words."""

from __future__ import annotations

from trajcli.frozen import comparable

_SHOWN = 20  # columns told about by name


@comparable
class Deviation:
    """The difference of one pair of values.

    Attributes:
        column: Name in the first file; its unit is that of all numbers here.
        row: Index of the row in the first file, from 0.
        time: The row's time, s; None where the files have no times.
        a: Value in the first file.
        b: Value in the second file, in the unit of the first.
        difference: Magnitude of b - a.
        tolerance: What would have been accepted.
    """

    column: str
    row: int
    time: float | None
    a: float
    b: float
    difference: float
    tolerance: float

    @property
    def severity(self) -> tuple[float, float]:
        """What the worst difference has most of: the share of its tolerance; without one, the difference."""
        if self.tolerance > 0:
            return self.difference / self.tolerance, self.difference
        return (float("inf") if self.difference > 0 else 0.0), self.difference


@comparable
class ColumnDifference:
    """How one column compares.

    Attributes:
        worst: The largest difference, measured by its tolerance.
        first: The first one that is not accepted; None where there is none.
        count: Rows that are not accepted.
    """

    worst: Deviation
    first: Deviation | None
    count: int


@comparable
class Difference:
    """How two files compare.

    Attributes:
        files: Their names.
        rows: Pairs of rows that were compared.
        columns: One for each column that both have, in the order of the first file.
        missing: Columns that only one file has: name, and index of the file that lacks it.
        ended: Index of the file that ends early, and its last time, s; None when neither does.
        notes: What was done to make the files comparable, in sentences.
    """

    files: tuple[str, str]
    rows: int
    columns: tuple[ColumnDifference, ...]
    missing: tuple[tuple[str, int], ...] = ()
    ended: tuple[int, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def equal(self) -> bool:
        """Whether the files have the same columns and rows, and all differences are accepted."""
        return not self.missing and self.ended is None and not any(column.count for column in self.columns)

    @property
    def worst(self) -> Deviation:
        """The largest difference of all columns, measured by its tolerance."""
        return max((column.worst for column in self.columns), key=lambda deviation: deviation.severity)

    @property
    def first(self) -> Deviation | None:
        """The difference in the earliest row that is not accepted; None when all are."""
        found = [column.first for column in self.columns if column.first is not None]
        return min(found, key=lambda deviation: deviation.row, default=None)


def describe(difference: Difference) -> str:
    """Return lines for people, without a line feed at the end."""
    a, b = difference.files
    what = f"{_count(difference.rows, 'row')}, {_count(len(difference.columns), 'column')}"
    lines = [
        f"{'equal' if difference.equal else 'different'}: {a} and {b} ({what} compared)",
        *difference.notes,
    ]
    lines += [f"{difference.files[index]} has no column {name}" for name, index in difference.missing]
    if difference.ended is not None:
        index, time = difference.ended
        lines.append(
            f"{difference.files[index]} ends at t = {time:.12g} s, before {difference.files[1 - index]}"
        )
    if difference.first is not None:
        lines.append("first: " + _say(difference.first))
    if difference.worst.difference > 0:
        lines.append("worst: " + _say(difference.worst))
    return "\n".join(lines + _columns(difference))


def _columns(difference: Difference) -> list[str]:
    """Return a line for each column that differs, when there are several."""
    differing = [column for column in difference.columns if column.count]
    if len(differing) < 2:
        return []
    lines = [f"  {_count(column.count, 'row')} of {_say(column.worst)}" for column in differing[:_SHOWN]]
    rest = len(differing) - len(lines)
    return [f"{len(differing)} columns differ, each with its worst:", *lines] + [f"  and {rest} more"] * (
        rest > 0
    )


def _say(deviation: Deviation) -> str:
    where = f"in row {deviation.row}" if deviation.time is None else f"at t = {deviation.time:.12g} s"
    apart = f"{deviation.difference:.3g} apart (tolerance {deviation.tolerance:.3g})"
    return f"{deviation.column} {where}: {deviation.a!r} against {deviation.b!r}, {apart}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")
