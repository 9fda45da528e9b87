"""Composition, interpolation and representations of poses, in the user's units.

Composition multiplies steps about fixed or current axes, read as they stand; interpolation leads from one
pose to another for s from 0 to 1; a report has every representation, and says what the pose leaves open.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.geometry.euler import (
    EulerAngles,
    check_sequence,
    euler_from_matrix,
    matrix_from_euler,
    rpy_from_matrix,
)
from trajcli.geometry.paths.euler_interpolation import euler_interpolation
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.geometry.pose import PoseInterpolation, build, interpolate, invert, transform_points
from trajcli.geometry.rotation import (
    Frame,
    axis_angle_from_matrix,
    compose_turns,
    nearest_rotation,
    quaternion_from_matrix,
    without_jumps,
)
from trajcli.job.inline import inline_document, read_at
from trajcli.language.numbers import FlawError, ReadingContext, shown
from trajcli.language.poses import Pose, read_numbers
from trajcli.suggest import did_you_mean
from trajcli.units import Quantity, Units, factor

OrientationInterpolation = Literal["axis_angle", "euler"]

_OWN_KEYS = ("frame", "invert")
_RPY: tuple[str, Frame] = ("XYZ", "fixed")


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
class PoseStep:
    """One pose of the chain.

    Attributes:
        pose: Shape (4, 4), in m; a matrix has the entries that the user wrote.
        frame: The axes it is carried out about: "current" those moved so far, "fixed" the first ones.
        typed: Its orientation where that was written as three angles.
    """

    pose: Array
    frame: Frame = "current"
    typed: TypedAngles | None = None


def read_steps(words: Sequence[str], units: Units) -> list[PoseStep]:
    """Return the steps that words describe.

    Args:
        words: Each a pose as in a job, with `frame` and `invert` beside it, or @FILE.
        units: Of plain numbers.

    Raises:
        InputError: When one is no step; a matrix that is no rotation within 1e-4 is refused with its defect.
        FileError: When a file cannot be read.
    """
    names = ["STEP"] if len(words) == 1 else [f"STEP {number}" for number in range(1, len(words) + 1)]
    documents = [inline_document(word, name) for word, name in zip(words, names, strict=True)]
    return [read_at(document, units, _step) for document in documents]


def read_end(word: str, units: Units) -> PoseStep:
    """Return the pose that the word behind --to describes, without `frame` and `invert`.

    Raises:
        InputError: When it is no pose.
        FileError: When its file cannot be read.
    """
    return read_at(inline_document(word, "--to"), units, _end)


def composed(steps: Sequence[PoseStep]) -> Array:
    """Return the pose (4, 4) that the steps lead to, each about its own axes."""
    return compose_turns([(step.pose, step.frame) for step in steps], 4)


def _step(value: Mapping[str, Any], context: ReadingContext) -> PoseStep:
    frame, inverted = value.get("frame", "current"), value.get("invert", False)
    if frame not in ("current", "fixed"):
        raise FlawError(f"expected current or fixed, got {shown(frame)}", "frame")
    if not isinstance(inverted, bool):
        raise FlawError(f"expected true or false, got {shown(inverted)}", "invert")
    fields = {key: item for key, item in value.items() if key not in _OWN_KEYS}
    step = _end(fields, context)
    pose, typed = (invert(step.pose), None) if inverted else (step.pose, step.typed)
    return PoseStep(pose, cast("Frame", frame), typed)


def _end(fields: Mapping[str, Any], context: ReadingContext) -> PoseStep:
    if not fields:
        hint = "such as {rpy: [0, 0, 90]} or {xyz: [1, 0, 0]}"
        raise FlawError("neither a position nor an orientation is given", hint=hint)
    pose = np.array(Pose("pose").read(fields, context))
    if "matrix" in fields:
        pose[:3, :3] = [row[:3] for row in fields["matrix"][:3]]
    return PoseStep(pose, "current", _typed(fields, context))


def _typed(fields: Mapping[str, Any], context: ReadingContext) -> TypedAngles | None:
    if "rpy" in fields:
        sequence, frame, given = "XYZ", "fixed", fields["rpy"]
    elif "euler" in fields:
        euler = fields["euler"]
        sequence, frame, given = euler["sequence"], euler.get("frame", "current"), euler["angles"]
    else:
        return None
    first, middle, last = read_numbers(given, 3, Quantity("angle"), context).tolist()
    return TypedAngles(sequence, cast("Frame", frame), (first, middle, last))


def parse_fractions(text: str) -> Array:
    """Return the values of "0,0.5,1", shape (k,).

    Raises:
        InputError: When one is no number from 0 to 1.
    """
    values = []
    for word in text.replace(",", " ").split():
        try:
            value = float(word)
        except ValueError:
            value = float("nan")
        if not 0.0 <= value <= 1.0:
            raise InputError(f"--s: expected numbers from 0 to 1, got {word}", hint="such as --s 0,0.5,1")
        values.append(value)
    if not values:
        raise InputError("--s holds no number", hint="such as --s 0,0.5,1")
    return np.array(values)


def pose_path(
    start: PoseStep,
    end: PoseStep,
    s: Array,
    path: PoseInterpolation = "line",
    orientation: OrientationInterpolation = "axis_angle",
    euler: tuple[str, Frame] | None = None,
) -> Array:
    """Return the poses (k, 4, 4) at s (k,).

    Args:
        start: At s = 0.
        end: At s = 1.
        s: From 0 to 1.
        path: "line" for a straight line of the origin, "screw" for constant twist.
        orientation: On a line: about one fixed axis, or "euler" for angles that change evenly, in the
            sequence of the end; where the end was not typed as angles, in that of `euler`, else as rpy. Of
            angles that were not typed, the triple and the turns nearest to the other end's are taken; at
            gimbal lock the angle that is free is the other end's.
        euler: Sequence and frame.

    Raises:
        InputError: When a screw is asked for with Euler angles.
    """
    ends = [build(nearest_rotation(pose[:3, :3]), pose[:3, 3]) for pose in (start.pose, end.pose)]
    if path == "screw" and orientation == "euler":
        message = "--orientation euler is for --path line: a screw turns about its own axis"
        raise InputError(message, hint="leave one of them out")
    poses = interpolate(ends[0], ends[1], s, path)
    if orientation == "euler":
        poses[:, :3, :3] = _even_angles(start, end, np.stack(ends)[:, :3, :3], s, euler)
    return poses


def _even_angles(
    start: PoseStep, end: PoseStep, rotations: Array, s: Array, euler: tuple[str, Frame] | None
) -> Array:
    sequence, frame = (end.typed.sequence, end.typed.frame) if end.typed else euler or _RPY
    typed = [_own(side, sequence, frame) for side in (start, end)]
    first, last = euler_interpolation(rotations, SegmentProgress.even(1.0), sequence, frame, typed).angles
    angles = (1.0 - s)[:, None] * first + s[:, None] * last
    return matrix_from_euler(sequence, angles, frame)


def _own(side: PoseStep, sequence: str, frame: Frame) -> Array | None:
    """Return the angles that the user typed in this very sequence."""
    typed = side.typed
    if typed is None or (typed.sequence, typed.frame) != (sequence, frame):
        return None
    return np.array(typed.angles)


def pose_view(pose: Array, units: Units) -> dict[str, Any]:
    """Return one pose (4, 4), in m, as {matrix, xyz, rpy, quat_wxyz} in the given units.

    `matrix` has its translation in the unit of length; `rpy` are angles about the fixed axes x, y and z,
    read off the matrix as it stands. The quaternion has w >= 0; where w is zero but for rounding, its first
    other component that is not is positive.
    """
    rotation = pose[:3, :3]
    shown = np.array(pose)
    shown[:3, 3] /= factor(Quantity("length"), units)
    return {
        "matrix": plain(shown),
        "xyz": plain(shown[:3, 3]),
        "rpy": angles_view(rpy_from_matrix(rotation).angles, units),
        "quat_wxyz": plain(without_jumps(quaternion_from_matrix(rotation)[None], None)[0]),
    }


def angles_view(angles: Array, units: Units) -> list[float]:
    """Return angles, rad, in the given units; of half a turn the positive one, which is the same."""
    shown: list[float] = plain(np.where(angles == -np.pi, np.pi, angles) / factor(Quantity("angle"), units))
    return shown


def plain(values: ArrayLike) -> Any:  # noqa: ANN401
    """Return an array as nested lists of floats, without negative zeros."""
    return (np.asarray(values, dtype=np.float64) + 0.0).tolist()


def parse_sequence(text: str) -> tuple[str, Frame]:
    """Return sequence and frame of "ZYZ" (current axes) or "ZYZ:fixed".

    Raises:
        InputError: When it is no sequence, or the frame is neither current nor fixed.
    """
    sequence, colon, frame = text.partition(":")
    check_sequence(sequence)
    if colon and frame not in ("current", "fixed"):
        hint = did_you_mean(frame, ("current", "fixed")) or "such as ZYZ:fixed"
        raise InputError(f"--euler {text}: expected current or fixed after the colon, got {frame}", hint=hint)
    return sequence.upper(), "fixed" if frame == "fixed" else "current"


def pose_report(
    pose: Array, units: Units, euler: tuple[str, Frame] | None = None, point: Sequence[float] | None = None
) -> dict[str, Any]:
    """Return {matrix, xyz, rpy, quat_wxyz, axis_angle, euler?, determinant, point?, singular?} of one pose.

    Args:
        pose: Shape (4, 4), in m; angles are read off its entries as they are.
        units: Of what is returned.
        euler: Sequence and frame for `euler`, which holds both triples of angles.
        point: A point (3,), m, in the pose's own frame, for `point`: the same in the frame the pose is in.
    """
    rotation = pose[:3, :3]
    angle, length = factor(Quantity("angle"), units), factor(Quantity("length"), units)
    about = axis_angle_from_matrix(rotation)
    report = pose_view(pose, units)
    report["axis_angle"] = {"axis": plain(about.axis), "angle": float(about.angle) / angle}
    singular = _at_lock("rpy", ("x", "z"), rpy_from_matrix(rotation), units)
    if euler is not None:
        sequence, frame = euler
        triples = euler_from_matrix(sequence, rotation, frame)
        report["euler"] = [angles_view(triples.angles, units), angles_view(triples.alternative, units)]
        singular |= _at_lock("euler", ("the first axis", "the third"), triples, units)
    if about.axis_free:
        singular["axis_angle"] = "the angle is zero: any axis is right"
    elif about.sign_free:
        singular["axis_angle"] = "the angle is half a turn: the opposite axis is right too"
    report["determinant"] = float(np.linalg.det(rotation))
    if point is not None:
        report["point"] = plain(transform_points(pose, point) / length)
    if singular:
        report["singular"] = singular
    return report


def _at_lock(name: str, about: tuple[str, str], triples: EulerAngles, units: Units) -> dict[str, str]:
    """Return what to say of angles at gimbal lock, under the name of the representation."""
    if not triples.singular:
        return {}
    lock = int(triples.lock)
    first, _, third = (triples.angles / factor(Quantity("angle"), units)).tolist()
    value = f"{round(first + lock * third, 12) + 0.0:.9g} {units.angle}"
    word, sign = ("sum", "plus") if lock > 0 else ("difference", "minus")
    text = f"gimbal lock: of the angles about {about[0]} and {about[1]} only the {word} is determined "
    return {name: text + f"(first {sign} third = {value})"}
