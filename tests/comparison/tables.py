"""Tables of numbers to compare."""

from __future__ import annotations

import numpy as np

from trajcli.comparison.difference import compare
from trajcli.streams.table import Table


def table(columns, file="a.csv"):
    values = np.stack([np.asarray(column, dtype=float) for column in columns.values()], axis=1)
    return Table(tuple(columns), values, np.full(len(columns), 9), file)


def motion(count=101, period=0.01, file="a.csv", start=0.0, **more):
    """q1 = sin 3t and its derivatives."""
    t = start + np.arange(count) * period
    columns = {"t": t, "q1": np.sin(3 * t), "qd1": 3 * np.cos(3 * t), "qdd1": -9 * np.sin(3 * t)}
    return table(columns | {name: function(t) for name, function in more.items()}, file)


def changed(source, name, row, by, file="b.csv"):
    columns = source.columns.copy()
    columns[row, source.names.index(name)] += by
    return Table(source.names, columns, source.decimals, file)


def without(source, *names, file="b.csv"):
    kept = [place for place, name in enumerate(source.names) if name not in names]
    return Table(tuple(source.names[k] for k in kept), source.columns[:, kept], source.decimals[kept], file)


def cut(source, count, file="b.csv"):
    return Table(source.names, source.columns[:count], source.decimals, file)


def exactly(a, b, **options):
    return compare(a, b, {}, {}, **options)
