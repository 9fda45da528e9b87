"""Recorded poses of the tool: x, y, z and quaternions from a CSV file that a job names."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError
from trajcli.job.files.recorded_values import folder_of, named_at, placed_text
from trajcli.job.yaml.load import Document
from trajcli.language.numbers import LARGEST_POSITION, FlawError
from trajcli.language.recorded import RecordedPoses
from trajcli.streams.table import Table, read_csv

_LENGTHS, _QUATERNION = ("x", "y", "z"), ("qw", "qx", "qy", "qz")
_UNIT = 1e-4  # by which the length of a quaternion may differ from 1: what few decimals leave


def read_poses(path: str, document: Document) -> RecordedPoses:
    """Return the recorded poses of a job.

    Args:
        path: Relative to the job's folder.
        document: The job's.

    Raises:
        FileError: When it cannot be read; with the place of its name in the job.
        FlawError: When it is not as it should be.
    """
    try:
        table = read_csv(folder_of(document) / path)
        return RecordedPoses(_positions(table), _quaternions(table), table.file)
    except FileError as error:
        raise error.located(place=document.place(named_at(document, path, "segments"))) from None
    except InputError as error:
        flaws = "; ".join(map(placed_text, error.problems))
        raise FlawError(flaws, "csv", hint=error.problems[0].hint) from None


def _positions(table: Table) -> Array:
    """Return the positions (m, 3), m."""
    positions = np.stack([_length(table, name) for name in _LENGTHS], axis=1)
    if np.abs(positions).max() > LARGEST_POSITION:
        most = f"{LARGEST_POSITION:g} m"
        raise InputError(f"{table.file}: a value is larger than {most}", hint="check its exponent and unit")
    return positions


def _length(table: Table, name: str) -> Array:
    found = [(each, factor) for each, factor in ((name, 1.0), (f"{name}_mm", 1e-3)) if each in table.names]
    if not found:
        hint = f"columns are those that `pose` writes: call it {name} (m) or {name}_mm"
        raise InputError(f"{table.file}: no column {name}", hint=hint)
    if len(found) > 1:
        raise InputError(f"{table.file}: two columns for {name}: {found[0][0]} and {found[1][0]}")
    return np.asarray(table.column(found[0][0]) * found[0][1])


def _quaternions(table: Table) -> Array | None:
    """Return unit quaternions (m, 4), w first; None where there are no such columns."""
    known = [name for name in _QUATERNION if name in table.names]
    if not known:
        return None
    if len(known) < len(_QUATERNION):
        lacking = ", ".join(name for name in _QUATERNION if name not in known)
        hint = "give qw, qx, qy and qz, or none of them: the orientation is then kept"
        raise InputError(f"{table.file}: no column {lacking}", hint=hint)
    rows = np.stack([table.column(name) for name in _QUATERNION], axis=1)
    sizes = np.linalg.norm(rows, axis=1)
    wrong = np.flatnonzero(np.abs(sizes - 1.0) > _UNIT)
    if wrong.size:
        row = int(wrong[0])
        text = f"{table.file}: row {row + 1}: the quaternion has length {sizes[row]:.6g}, not 1"
        raise InputError(text, hint="the order is qw, qx, qy, qz")
    return np.asarray(rows / sizes[:, None])
