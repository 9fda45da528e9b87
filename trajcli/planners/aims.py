"""Targets as they stand in a file: a pose of which parts may be left out, and the branch that is meant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import Axis
from trajcli.kinematics.inverse.method import NAMES, Branch
from trajcli.kinematics.inverse.target import Target, partial_target
from trajcli.planners.poses import Pose, read_numbers
from trajcli.planners.reading import AT_KEY, FlawError, ReadingContext, shown
from trajcli.units import Quantity

_WHOLE = ("rpy", "quat_wxyz", "matrix", "axis_angle", "euler")
_PARTIAL = ("yaw", "pitch", "direction")
_KEYS = ("xyz", *_WHOLE, *_PARTIAL, "tool_axis", "configuration")
_ANGLE, _RATIO = Quantity("angle"), Quantity("ratio")


@dataclass(frozen=True, eq=False)
class Aim:
    """What the tcp shall reach, and how.

    Attributes:
        target: What is fixed of the tcp's pose in world.
        configuration: The choices that are asked for; None where any is right.
    """

    target: Target
    configuration: Branch


def read_aim(value: Any, context: ReadingContext) -> Aim:  # noqa: ANN401
    """Return the target that a mapping of a file describes.

    Raises:
        FlawError: When it does not fit.
    """
    if not isinstance(value, Mapping):
        raise FlawError(f"expected a pose such as {{xyz: [0, 0, 0], rpy: [0, 0, 0]}}, got {shown(value)}")
    unknown = [key for key in value if key not in _KEYS]
    if unknown:
        hint = f"a target has {', '.join(_KEYS)}"
        raise FlawError(f"unknown key '{unknown[0]}'", unknown[0], AT_KEY, hint=hint)
    given = [key for key in (*_WHOLE, *_PARTIAL) if key in value]
    if len(given) > 1:
        hint = "leave one of them out"
        raise FlawError(f"{given[0]} and {given[1]} exclude each other", given[1], AT_KEY, hint=hint)
    form = given[0] if given else None
    configuration = _configuration(value.get("configuration", {}))
    try:
        return Aim(_target(value, form, context), configuration)
    except InputError as error:
        path = (form,) if form is not None else ()
        raise FlawError(str(error), *path, hint=error.problems[0].hint) from None


def _target(value: Mapping[str, Any], form: str | None, context: ReadingContext) -> Target:
    if "tool_axis" in value and form not in _PARTIAL:
        hint = f"it goes with {', '.join(_PARTIAL)}"
        raise FlawError("tool_axis has nothing to say here", "tool_axis", AT_KEY, hint=hint)
    axis = value.get("tool_axis", "z")
    if axis not in ("x", "y", "z"):
        raise FlawError(f"expected x, y or z, got {shown(axis)}", "tool_axis")
    pose = Pose("target").read({key: value[key] for key in ("xyz", *_WHOLE) if key in value}, context)
    has_position = "xyz" in value or (form == "matrix" and len(value["matrix"]) == 4)
    position = pose[:3, 3] if has_position else None
    if form in _WHOLE:
        return partial_target(position, rotation=pose[:3, :3])
    if form is None:
        return partial_target(position)
    partial = {form: _partial(value[form], form, context)}
    return partial_target(position, tool_axis=cast("Axis", axis), **partial)  # type: ignore[arg-type]


def _partial(value: Any, form: str, context: ReadingContext) -> Array | float:  # noqa: ANN401
    if form == "direction":
        return read_numbers(value, 3, _RATIO, context, form)
    return float(read_numbers([value], 1, _ANGLE, context, form)[0])


def _configuration(value: Any) -> Branch:  # noqa: ANN401
    if not isinstance(value, Mapping):
        raise FlawError(f"expected a mapping such as {{elbow: up}}, got {shown(value)}", "configuration")
    for choice, name in value.items():
        if choice not in NAMES:
            hint = f"the choices are {', '.join(NAMES)}"
            raise FlawError(f"unknown key '{choice}'", "configuration", choice, AT_KEY, hint=hint)
        names = NAMES[choice]
        if name not in names:
            expected = " or ".join(names)
            raise FlawError(f"expected {expected}, got {shown(name)}", "configuration", choice)
    return Branch(**value)
