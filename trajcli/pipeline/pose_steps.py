"""A chain of rotations and displacements about fixed and current axes, read as it stands and multiplied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.geometry.pose import invert
from trajcli.geometry.rotation import Frame, compose_turns
from trajcli.job.inline import inline_document, read_at
from trajcli.language.numbers import FlawError, ReadingContext, shown
from trajcli.language.poses import Pose, read_numbers
from trajcli.units import Quantity, Units

_OWN_KEYS = ("frame", "invert")


@comparable
class TypedAngles:
    """Three angles as the user wrote them.

    Attributes:
        sequence: Of axes, such as "ZYZ".
        frame: Whether the axes are current or fixed.
        angles: Rad.
    """

    sequence: str
    frame: Frame
    angles: tuple[float, float, float]


@frozen
class Step:
    """One pose of the chain.

    Attributes:
        pose: Shape (4, 4), in m; a matrix has the entries that the user wrote.
        frame: The axes it is carried out about: "current" those moved so far, "fixed" the first ones.
        typed: Its orientation where that was written as three angles.
    """

    pose: Array
    frame: Frame
    typed: TypedAngles | None


def read_steps(words: Sequence[str], units: Units) -> list[Step]:
    """Return the steps that words describe.

    Args:
        words: Each a pose as in a job, with `frame` and `invert` beside it, or @FILE.
        units: Of plain numbers.

    Raises:
        InputError: When one is no step; a matrix that is no rotation within 1e-4 is refused with its defect.
        FileError: When a file cannot be read.
    """
    names = ["STEP"] if len(words) == 1 else [f"STEP {number}" for number in range(1, len(words) + 1)]
    return [read_step(word, name, units) for word, name in zip(words, names, strict=True)]


def read_step(word: str, name: str, units: Units) -> Step:
    """Return the step that one word describes; `name` is what messages call it.

    Raises:
        InputError: When it is no step.
        FileError: When its file cannot be read.
    """
    return read_at(inline_document(word, name), units, _step)


def read_end(word: str, name: str, units: Units) -> Step:
    """Return the pose that one word describes, without `frame` and `invert`.

    Raises:
        InputError: When it is no pose.
        FileError: When its file cannot be read.
    """
    return read_at(inline_document(word, name), units, _end)


def composed(steps: Sequence[Step]) -> Array:
    """Return the pose (4, 4) that the steps lead to, each about its own axes."""
    return compose_turns([(step.pose, step.frame) for step in steps], 4)


def _step(value: Mapping[str, Any], context: ReadingContext) -> Step:
    frame, inverted = value.get("frame", "current"), value.get("invert", False)
    if frame not in ("current", "fixed"):
        raise FlawError(f"expected current or fixed, got {shown(frame)}", "frame")
    if not isinstance(inverted, bool):
        raise FlawError(f"expected true or false, got {shown(inverted)}", "invert")
    fields = {key: item for key, item in value.items() if key not in _OWN_KEYS}
    step = _end(fields, context)
    if inverted:
        return Step(invert(step.pose), cast("Frame", frame), None)
    return Step(step.pose, cast("Frame", frame), step.typed)


def _end(fields: Mapping[str, Any], context: ReadingContext) -> Step:
    if not fields:
        hint = "such as {rpy: [0, 0, 90]} or {xyz: [1, 0, 0]}"
        raise FlawError("neither a position nor an orientation is given", hint=hint)
    pose = np.array(Pose("pose").read(fields, context))
    if "matrix" in fields:
        pose[:3, :3] = [row[:3] for row in fields["matrix"][:3]]
    return Step(pose, "current", _typed(fields, context))


def _typed(fields: Mapping[str, Any], context: ReadingContext) -> TypedAngles | None:
    """Return the angles of fields that were found to be a pose."""
    if "rpy" in fields:
        sequence, frame, given = "XYZ", "fixed", fields["rpy"]
    elif "euler" in fields:
        euler = fields["euler"]
        sequence, frame, given = euler["sequence"], euler.get("frame", "current"), euler["angles"]
    else:
        return None
    first, middle, last = read_numbers(given, 3, Quantity("angle"), context).tolist()
    return TypedAngles(sequence, cast("Frame", frame), (first, middle, last))
