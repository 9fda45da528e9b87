"""Measurements of a tool's pose in files: YAML, a list of joints and pose; or CSV, a row for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, TypeVar

import numpy as np

from trajcli.columns import GROUPS, Column, group_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem, TrajcliError
from trajcli.geometry.rotation import matrix_from_quaternion
from trajcli.job.files.recorded_values import joint_values, refuse_large, unit_quaternions
from trajcli.job.messages import validated
from trajcli.job.yaml.document import Document
from trajcli.job.yaml.load import read_document
from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.inverse.target import IkTarget, partial_target
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Model, Number, ReadingContext, shown
from trajcli.language.per_joint import PerJoint
from trajcli.language.targets import PoseFields, ik_target
from trajcli.streams.table import Table, read_csv
from trajcli.suggest import did_you_mean
from trajcli.units import Quantity, Units

V = TypeVar("V")
_Deviation = tuple[float | None, float | None] | None
_AXES, _QUATERNION, _DEVIATIONS = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("position", "angle")
_OWN = tuple(f"sigma_{name}" for name in _DEVIATIONS)
_YAML = (".yaml", ".yml", ".json")
_MOST_PROBLEMS = 10
_EveryJoint = Annotated[tuple[float, ...], PerJoint(0, "Position of each joint (angle or length unit).")]


class DeviationSpec(Model):
    """Standard deviations of a measurement."""

    position: (
        Annotated[float, Number(Quantity("length"), "Of each coordinate (length unit).", above=0.0)] | None
    ) = None
    angle: Annotated[float, Number(Quantity("angle"), "About each axis (angle unit).", above=0.0)] | None = (
        None
    )


class MeasurementSpec(Model):
    """A pose, or a part of one, measured at known joint values."""

    joints: _EveryJoint
    pose: PoseFields
    sigma: DeviationSpec | None = None


class ConfigurationSpec(Model):
    """Joint values where a pose could be measured."""

    joints: _EveryJoint
    pose: PoseFields | None = None
    sigma: DeviationSpec | None = None


def read_measurements(path: str, robot: Robot, units: Units) -> Measurements:
    """Return the measurements of a file: YAML by its ending, otherwise CSV; `-` is a CSV on standard input.

    A YAML file is a list of {joints, pose, sigma?}; what a pose leaves out was not measured, nor is a
    coordinate of its xyz that is null. A CSV has q1 .., some of x, y, z, all or none of qw qx qy qz, and
    maybe sigma_position, sigma_angle.

    Args:
        path: Of the file.
        robot: Its joints.
        units: Of the plain numbers of a YAML file.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    if not path.lower().endswith(_YAML):
        return _from_table(read_csv(path), robot)
    document, entries = _entries(path, robot, units, _measured)
    joints, targets, deviations = zip(*entries, strict=True)
    places = [document.place((index,)) for index in range(len(targets))]
    flaw = next(_flaws_of_deviations(deviations, targets), None)
    if flaw is not None:
        raise InputError(Problem(flaw[1], flaw[2], places[flaw[0]]))
    spread = None if deviations[0] is None else np.array([[a or 1.0, b or 1.0] for a, b in deviations])
    return Measurements(np.array(joints), tuple(_kinds(targets)), spread)


def read_configurations(path: str, robot: Robot, units: Units) -> Array:
    """Return joint values (N, n), rad or m, of a file with or without measured poses.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    if not path.lower().endswith(_YAML):
        return joint_values(read_csv(path), robot)

    def joints(item: Any, document: Document, index: int, context: ReadingContext) -> Any:  # noqa: ANN401
        return validated(ConfigurationSpec, item, document, context, (index,)).joints

    return np.array(_entries(path, robot, units, joints)[1])


def _first_of_each(problems: Sequence[Problem]) -> list[Problem]:
    """Return the first problem of each message, with how many more there are like it."""
    alike: dict[str, list[Problem]] = {}
    for problem in problems:
        alike.setdefault(problem.text(), []).append(problem)
    found = []
    for same in list(alike.values())[:_MOST_PROBLEMS]:
        first, more = same[0], len(same) - 1
        others = f"{more} more measurement{'s are' * (more > 1) or ' is'} like this"
        hint = first.hint if not more else others if first.hint is None else f"{first.hint}; {others}"
        found.append(replace(first, hint=hint))
    return found


def _entries(
    path: str, robot: Robot, units: Units, read: Callable[[Any, Document, int, ReadingContext], V]
) -> tuple[Document, list[V]]:
    """Return what each entry of a list is read as."""
    document = read_document(path, any_root=True)
    content = document.root.value
    if not isinstance(content, list) or not content:
        got = "an empty list" if isinstance(content, list) else shown(document.plain())
        hint = "such as `- {joints: [0, 0.5], pose: {xyz: [0.4, 0.1, 0.3]}}`"
        raise InputError(Problem(f"expected a list of measurements, got {got}", hint, document.place(())))
    context = ReadingContext(units, robot.joint_names, robot.joint_types)
    entries, problems = list[V](), list[Problem]()
    for index, item in enumerate(document.plain()):
        try:
            entries.append(read(item, document, index, context))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(*_first_of_each(problems))
    return document, entries


def _measurement(
    item: Any,  # noqa: ANN401
    document: Document,
    index: int,
    context: ReadingContext,
) -> tuple[MeasurementSpec, tuple[bool, bool, bool] | None]:
    """Return a measurement, and which coordinates of xyz were measured where one is null."""
    pose = item.get("pose") if isinstance(item, Mapping) else None
    xyz = pose.get("xyz") if isinstance(pose, Mapping) else None
    if not (isinstance(xyz, list) and len(xyz) == 3 and None in xyz) or pose is None:
        return validated(MeasurementSpec, item, document, context, (index,)), None
    x, y, z = (entry is not None for entry in xyz)
    if not (x or y or z):
        message = "no coordinate of xyz was measured"
        raise InputError(Problem(message, "leave xyz out", document.place((index, "pose", "xyz"))))
    filled = {**item, "pose": {**pose, "xyz": [0.0 if entry is None else entry for entry in xyz]}}
    return validated(MeasurementSpec, filled, document, context, (index,)), (x, y, z)


def _measured(
    item: Any,  # noqa: ANN401
    document: Document,
    index: int,
    context: ReadingContext,
) -> tuple[Any, IkTarget, _Deviation]:
    spec, fixed = _measurement(item, document, index, context)
    target = _target(spec, fixed, document, index)
    return spec.joints, target, None if spec.sigma is None else (spec.sigma.position, spec.sigma.angle)


def _target(
    spec: MeasurementSpec, fixed: tuple[bool, bool, bool] | None, document: Document, index: int
) -> IkTarget:
    if spec.pose.configuration is not None:
        at = document.place((index, "pose", "configuration"), key=True)
        raise InputError(Problem("a measured pose has no configuration: it has joints", "leave it out", at))
    at = document.place((index, "pose"))
    if not spec.pose.gives_pose:
        raise InputError(Problem("the pose says nothing", "such as {xyz: [0.4, 0, 0.3]}", at))
    try:
        target = ik_target(spec.pose)
    except TrajcliError as error:
        raise InputError(*(replace(problem, place=at) for problem in error.problems)) from None
    return target if fixed is None else replace(target, position=fixed)


def _kinds(targets: Sequence[IkTarget]) -> Iterator[MeasuredKind]:
    """Yield the measurements that fix the same coordinates, together."""
    by_kind: dict[tuple[Any, ...], list[int]] = {}
    for index, target in enumerate(targets):
        axis = None if target.orientation in ("all", "none") else target.tool_axis
        by_kind.setdefault((target.position, target.orientation, axis), []).append(index)
    for rows in by_kind.values():
        poses, aims = (np.stack([getattr(targets[row], name) for row in rows]) for name in ("poses", "aims"))
        yield MeasuredKind(np.array(rows), replace(targets[rows[0]], poses=poses, aims=aims))


def _flaws_of_deviations(
    deviations: Sequence[_Deviation], targets: Sequence[IkTarget]
) -> Iterator[tuple[int, str, str]]:
    """Yield the measurements that lack a deviation which others have, or their own part needs."""
    if not any(deviations):
        return
    for index, (given, target) in enumerate(zip(deviations, targets, strict=True)):
        needed = any(target.position), target.orientation != "none"
        for name, value, wanted in zip(_DEVIATIONS, given or (None, None), needed, strict=True):
            if wanted and value is None:
                message = f"measurement {index + 1} has no standard deviation of its {name}"
                yield index, message, f"give `sigma: {{{name}: ...}}` to all measurements, or to none"


def _from_table(table: Table, robot: Robot) -> Measurements:
    columns = {name: parse_column(name) for name in table.names}
    _refuse_unknown(table, columns, robot)
    joints = joint_values(table, robot)
    numbered = {robot.joint_names[c.joint or 0] for c in columns.values() if c.kind == "q"}
    for name, column in columns.items():
        if column.kind in {*_AXES} & {*robot.joint_names} - numbered:
            text = f"{table.file}: {name} is a joint and a coordinate of the tool"
            raise InputError(text, hint="call joints q1, q2, ...")
    axes = [_values(table, columns, name) for name in _AXES]
    turns = [_values(table, columns, name) for name in _QUATERNION]
    missing = [name for name, values in zip(_QUATERNION, turns, strict=True) if values is None]
    if 0 < len(missing) < len(_QUATERNION):
        raise InputError(f"{table.file}: a quaternion has qw, qx, qy, qz: there is no {', '.join(missing)}")
    measured = [values is not None for values in axes]
    if missing and not any(measured):
        hint = "a measured position has some of x, y, z; an orientation qw, qx, qy, qz"
        raise InputError(f"{table.file}: there are no columns of a measured pose", hint=hint)
    zero = np.zeros(len(joints))
    position = np.stack([zero if values is None else values for values in axes], axis=1)
    refuse_large(position, table)
    rotation = None
    if not missing:
        rows = np.stack([values for values in turns if values is not None], axis=1)
        rotation = matrix_from_quaternion(unit_quaternions(rows, table))
    x, y, z = measured
    target = partial_target(position, fixed=(x, y, z), rotation=rotation)
    deviations = _table_deviations(table, columns, any(measured), rotation is not None)
    return Measurements(joints, (MeasuredKind(np.arange(len(joints)), target),), deviations)


def _refuse_unknown(table: Table, columns: Mapping[str, Column], robot: Robot) -> None:
    """Refuse a name that is no column of ours: it may be a misspelt one."""
    names = [*(f"q{i + 1}" for i in range(len(robot.joints))), *_AXES, *_QUATERNION, *_OWN]
    for name, column in columns.items():
        ours = group_of(column) in GROUPS or column.kind in (*_OWN, *robot.joint_names)
        if not ours and column.joint is None:
            hint = did_you_mean(name, names) or f"the columns are {', '.join(names)}, with _deg or _mm"
            raise InputError(f"{table.file}: there is no column '{name}'", hint=hint)


def _values(table: Table, columns: Mapping[str, Column], kind: str) -> Array | None:
    """Return the values (N,) of one kind in SI; None where there is no such column."""
    names = [name for name, column in columns.items() if column.kind == kind and column.joint is None]
    if not names:
        return None
    if len(names) > 1:
        raise InputError(f"{table.file}: {names[0]} and {names[1]} are columns of the same number")
    unit = columns[names[0]].unit
    allowed = {"sigma_angle": "deg", **dict.fromkeys((*_AXES, "sigma_position"), "mm")}.get(kind)
    if unit not in (None, allowed):
        hint = f"call it {kind}" + (f" (SI) or {kind}_{allowed}" if allowed else "")
        raise InputError(f"{table.file}: the column {names[0]} cannot be in {unit}", hint=hint)
    return np.asarray(table.column(names[0]) * columns[names[0]].factor)


def _table_deviations(
    table: Table, columns: Mapping[str, Column], position: bool, orientation: bool
) -> Array | None:
    """Return the deviations (N, 2) of a table; None where it has none."""
    found = [_values(table, columns, name) for name in _OWN]
    if all(values is None for values in found):
        return None
    deviations = np.ones((len(table.columns), 2))
    for index, (values, wanted) in enumerate(zip(found, (position, orientation), strict=True)):
        if values is None and wanted:
            hint = "give both of them, or none"
            raise InputError(f"{table.file}: there is no column {_OWN[index]}", hint=hint)
        if values is not None and not (values > 0).all():
            row = int(np.flatnonzero(values <= 0)[0])
            raise InputError(f"{table.file}, row {row + 1}: {_OWN[index]} must be above 0")
        if values is not None:
            deviations[:, index] = values
    return deviations
