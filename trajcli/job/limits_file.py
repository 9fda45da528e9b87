"""Limits of a file of their own: what stands under `limits` in a job, or a joint_limits.yaml of MoveIt."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trajcli.errors import InputError
from trajcli.job.files.moveit_limits import MoveItReader, read_moveit_limits
from trajcli.job.limits import with_job_limits
from trajcli.job.messages import validated
from trajcli.job.model import UnitsSpec
from trajcli.job.yaml.document import Document
from trajcli.job.yaml.load import parse_document, read_document
from trajcli.kinematics.robot import Robot
from trajcli.language.limits import JobLimitsSpec
from trajcli.language.numbers import ReadingContext
from trajcli.planners.planner import Event
from trajcli.units import Units

_MOVEIT = ("joint_limits", "robot_description_planning")


def with_limits_file(robot: Robot, path: str, units: Units) -> tuple[Robot, tuple[Event, ...]]:
    """Return a robot with the limits of a file in force, and what there is to note about them.

    Args:
        robot: With limits of its own, which those of the file replace.
        path: Of the file, or limits as YAML: `{velocity: 2}`.
        units: Of its plain numbers, unless it says them itself: `units: {angle: deg}`.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    if path.startswith("{"):
        return _applied(robot, parse_document(path, "--limits"), units)
    if path.replace(".", "", 1).isdigit():
        hint = f"one that holds such as `velocity: {path}`, or write --limits '{{velocity: {path}}}'"
        raise InputError(f"--limits expects a file, got {path}", hint=hint)
    return _applied(robot, read_document(path), units)


def with_limits(robot: Robot, limits: Mapping[str, Any]) -> tuple[Robot, tuple[Event, ...]]:
    """Return a robot with limits in force that are given as under `limits` in a job, in SI.

    Raises:
        InputError: With every flaw of them.
    """
    from trajcli.job.dump import mapping_text

    return _applied(robot, parse_document(mapping_text(limits), "limits"), Units())


def _applied(robot: Robot, document: Document, units: Units) -> tuple[Robot, tuple[Event, ...]]:
    plain = dict(document.plain())
    units = _stated_units(plain.pop("units", None), document, units)
    spec, of_file = JobLimitsSpec(), None
    if any(map(_is_of_moveit, plain.items())):
        of_file = MoveItReader(document, robot).read()
    else:
        context = ReadingContext(units, robot.joint_names, robot.joint_types)
        spec = validated(JobLimitsSpec, plain, document, context)
        if spec.file is not None:
            of_file = read_moveit_limits(spec.file, document, robot)
    effective, events = with_job_limits(robot, of_file.under(spec) if of_file else spec, "the given")
    return effective, (*(of_file.events if of_file else ()), *events)


def _is_of_moveit(entry: tuple[str, Any]) -> bool:
    return entry[0] in _MOVEIT or (isinstance(entry[1], Mapping) and "ros__parameters" in entry[1])


def _stated_units(value: Any, document: Document, units: Units) -> Units:  # noqa: ANN401
    """Return the units that a file says, and those known before for what it does not say."""
    if value is None:
        return units
    stated = validated(UnitsSpec, value, document, None, ("units",))
    given = {name: getattr(stated, name) for name in stated.model_fields_set}
    return Units(given.get("angle", units.angle), given.get("length", units.length))
