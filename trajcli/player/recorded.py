"""Scene of a file of samples: joint values that were written before, with what a judge finds in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import EFFORT, Column, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, utf8
from trajcli.findings import Finding
from trajcli.judge.file import CheckedFile
from trajcli.kinematics.robot import JointType, Robot
from trajcli.player.rows import ORDERS, DrawnRows, rows_of_samples
from trajcli.player.scene import (
    BUDGET,
    dressed,
    geometry_of,
    joints_in_units,
    limits_of,
    opening,
    order_of,
    waypoints_of,
)
from trajcli.queries.arm import open_sheet
from trajcli.queries.forward import refuse_far
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.joint_columns import JointColumns, converted, joint_columns, refuse_zero
from trajcli.streams.reading import read_table
from trajcli.streams.table import Table
from trajcli.trajectory import Trajectory
from trajcli.units import AngleUnit, LengthUnit, Units, amount_text
from trajcli.version import __version__

_NO_ROBOT = "A file of joint values says nothing of the arm: name it with --robot to see it move."
_PLAIN_UNITS = ["rad or m", "rad/s or m/s", "rad/s² or m/s²", "rad/s³ or m/s³", "N m or N"]
_SUFFIXES: dict[str | None, JointType] = {"deg": "revolute", "mm": "prismatic"}


def scene_of_file(
    source: str | ByteSource,
    arm: str | Robot | None = None,
    checked: CheckedFile | str | None = None,
    meshes: float = BUDGET,
) -> dict[str, Any]:
    """Return the scene of a file with columns t, q1.. and perhaps qd1.., qdd1.., qddd1.., move.

    Args:
        source: Its path; "-" is standard input.
        arm: A robot, or its name: of the catalogue, of a robot file, or of a job.
        checked: The judgement of the file, or why there is none; None where nobody asked for one.
        meshes: How long the visual meshes of the arm's URDF may be, MB; with 0 none are shown.

    Raises:
        InputError: When a column is missing or does not fit the robot, a time does not increase, or there is
            no such robot.
        FileError: When a file cannot be read.
    """
    name = arm if isinstance(arm, str) else None
    robot = arm if isinstance(arm, Robot) else None if name is None else open_sheet(name).robot
    table = read_table(source, joints=None if robot is None else robot.joint_names)
    columns = [parse_column(name) for name in table.names]
    times = _times(table)
    values = _joint_values(table, columns, robot)
    rows, kept = rows_of_samples(times, values)
    units, moves = _units_of(columns), _moves(table)
    facts = [f"{times.size} row{'s' * (times.size != 1)}", f"{times[-1] - times[0]:.6g} s"]
    waypoints = [(float(times[row]), values["q"][row], "") for row in _ends(moves, times.size)]
    limits = [] if robot is None else [(float(times[0]), float(times[-1]), robot.limits)]
    from trajcli.player.meshes import meshes_of_robot

    scene = {
        "version": 1,
        "title": utf8(Path(table.file).name),
        "subtitle": " · ".join(facts if robot is None else [robot.name, *facts]),
        **_judgement(checked, units, float(times[0])),
        "made_by": f"Made by trajcli {__version__}",
        "joints": _joints(columns, robot, units),
        **geometry_of(robot, rows, units, _NO_ROBOT, trajectory=_of_job(checked)),
        "rows": rows.packed(),
        "moves": [_move(label, times[low], times[high]) for label, low, high in moves],
        "limits": limits_of(limits),
        "waypoints": waypoints_of(waypoints) if robot is not None and robot.convention else [],
        **{key: [] for key in ("events", "steps", "loads", "marks", "zones", "signals")},
        "notes": [*_judgement_notes(checked), *_notes(rows, kept, times)],
    }
    return dressed(scene, *meshes_of_robot(name, meshes))


def _of_job(checked: CheckedFile | str | None) -> Trajectory | None:
    """Return the trajectory of the job by which a file was judged; None where there is none."""
    plan = checked.plan if isinstance(checked, CheckedFile) else None
    return None if plan is None else plan.trajectory


def _judgement(checked: CheckedFile | str | None, units: Units, start: float) -> dict[str, Any]:
    """Return the verdict and the errors of a file; what has no time stands at its start, s."""
    if checked is None or isinstance(checked, str):
        unjudged = {"state": "unjudged", "text": "not judged"}
        return {"verdict": unjudged, "findings": [], "causes": [], "opens_at": None}
    judgement, count = checked.judgement, len(checked.judgement.errors)
    state, text = "verified", str(judgement.verdict)
    if not judgement.passed:
        state, text = "violated", f"{count} finding{'s' * (count != 1)}"
    findings = [_finding(found, checked.robot, units, start) for found in judgement.errors]
    causes = [[index] for index in range(count)]
    return {
        "verdict": {"state": state, "text": text},
        "findings": findings,
        "causes": causes,
        "opens_at": opening(judgement.errors, causes),
    }


def _finding(finding: Finding, robot: Robot, units: Units, start: float) -> dict[str, Any]:
    return {
        "time": start if finding.time is None else finding.time,
        "joint": robot.joint_names.index(finding.joint) if finding.joint in robot.joint_names else None,
        "order": None if finding.value is None else order_of(finding.kind),
        "value": finding.value,
        "label": "" if finding.move is None else f"move {finding.move}:",
        "message": finding.text(lambda amount: amount_text(amount, robot.joint_types, units)),
        "hint": finding.hint,
    }


def _judgement_notes(checked: CheckedFile | str | None) -> Iterator[str]:
    """Yield that a file was not judged, and why; else what the judge did not judge, or took for granted."""
    if isinstance(checked, CheckedFile):
        yield from checked.judgement.notes
        return
    yield "A file of samples: its limits and its continuity were not judged."
    if checked is not None:
        yield f"Why not: {checked}."


def _times(table: Table) -> Array:
    """Return the times (N,), s."""
    if "t" not in table.names:
        raise InputError(
            f"{table.file} has no column 't'",
            hint=f"its columns are {', '.join(table.names[:12])}{converted(table.names, table.file)}",
        )
    times = table.column("t")
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if len(wrong):
        row = int(wrong[0]) + 1
        after = f"the time {times[row]:.12g} s follows {times[row - 1]:.12g} s"
        raise InputError(f"{table.file}, row {row} (from 0): {after}, expected times that increase")
    return times


def _of_kind(columns: Sequence[Column], kind: str) -> list[Column]:
    return sorted((c for c in columns if c.kind == kind and c.joint is not None), key=lambda c: c.joint or 0)


def _joint_values(table: Table, columns: Sequence[Column], robot: Robot | None) -> dict[str, Array]:
    """Return the positions, and what derivatives the file has of all joints, each (N, n), SI."""
    refuse_zero(table.names, table.file)
    count = _joint_count(table, columns) if robot is None else len(robot.joints)
    values = {}
    for name in (*ORDERS, EFFORT):
        found = _of_kind(columns, name)
        whole = [column.joint for column in found] == list(range(count))
        if robot is not None and (whole or name == "q"):
            values[name] = joint_columns(robot, table.names, table.file, name).values(table.columns)
        elif whole:
            indices = np.array([table.names.index(column.name) for column in found])
            factors = np.array([column.factor for column in found])
            values[name] = JointColumns(None, indices, factors, []).values(table.columns)
    refuse_far(values["q"], table.file)
    return values


def _joint_count(table: Table, columns: Sequence[Column]) -> int:
    """Return the number of joints, whose positions the file must hold."""
    found = _of_kind(columns, "q")
    if [column.joint for column in found] != list(range(len(found))) or not found:
        listed = ", ".join(column.name for column in found) or "none"
        raise InputError(
            f"{table.file} has the joint columns {listed}, expected q1, q2, ...",
            hint=f"its columns are {', '.join(table.names[:12])}{converted(table.names, table.file)}",
        )
    return len(found)


def _joints(columns: Sequence[Column], robot: Robot | None, units: Units) -> list[dict[str, Any]]:
    """Return names and units of the joints; where no robot says their kind, a plain name leaves both open."""
    if robot is not None:
        return joints_in_units(robot.joint_names, robot.joint_types, units)
    found = _of_kind(columns, "q")
    names = [f"q{number}" for number in range(1, len(found) + 1)]
    shown = joints_in_units(names, [_SUFFIXES.get(column.unit, "revolute") for column in found], units)
    plain = {"units": _PLAIN_UNITS, "scale": 1.0}
    return [joint if column.unit else {**joint, **plain} for joint, column in zip(shown, found, strict=True)]


def _units_of(columns: Sequence[Column]) -> Units:
    suffixes = {column.unit for column in columns}
    angle: AngleUnit = "deg" if "deg" in suffixes else "rad"
    length: LengthUnit = "mm" if "mm" in suffixes else "m"
    return Units(angle, length)


def _moves(table: Table) -> list[tuple[str, int, int]]:
    """Return label, first and last row of each move; none where the file does not say."""
    if "move" not in table.names:
        return []
    index = table.column("move")
    borders: list[int] = (np.flatnonzero(np.diff(index) != 0) + 1).tolist()
    starts = [0, *borders]
    return [
        (f"{index[low]:g}", low, high) for low, high in zip(starts, [*borders, len(index) - 1], strict=True)
    ]


def _ends(moves: Sequence[tuple[str, int, int]], count: int) -> list[int]:
    """Return the rows of waypoints: where moves meet, or the two ends of the file."""
    return [0, *(high for _, _, high in moves)] if moves else [0, count - 1]


def _move(label: str, start: float, end: float) -> dict[str, Any]:
    text = {"index": label, "label": f"move {label}", "detail": f"{end - start:.6g} s"}
    return {"start": float(start), "end": float(end), **text}


def _notes(rows: DrawnRows, kept: NDArray[np.intp], times: Array) -> list[str]:
    notes = []
    if "qd" not in rows.values:
        notes.append("The file has no velocities: the speed of the tool is that between its rows.")
    if kept.size < times.size:
        notes.append(f"Drawn are {kept.size} of {times.size} rows, the extremes of each column among them.")
    return notes
