"""A pose in every representation, and where a representation is not determined by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.euler import EulerAngles, check_sequence, euler_from_matrix, rpy_from_matrix
from trajcli.geometry.pose import transform_points
from trajcli.geometry.rotation import Frame, axis_angle_from_matrix
from trajcli.pipeline.pose_view import angles_view, plain, pose_view
from trajcli.suggest import did_you_mean
from trajcli.units import AngleUnit, LengthUnit, Quantity, Units, factor


def parse_units(text: str) -> Units:
    """Return the units that "deg,mm" names; what it leaves out is rad or m.

    Raises:
        InputError: When a word is none of rad, deg, m and mm, or two name units of the same kind.
    """
    chosen: dict[str, str] = {}
    for word in filter(None, (part.strip() for part in text.split(","))):
        if word not in ("rad", "deg", "m", "mm"):
            raise InputError(f"--units: expected rad or deg, m or mm, got {word}", hint="such as deg,mm")
        kind = "angle" if word in ("rad", "deg") else "length"
        if kind in chosen:
            raise InputError(f"--units: {chosen[kind]} and {word} are both units of {kind}")
        chosen[kind] = word
    angle: AngleUnit = "deg" if chosen.get("angle") == "deg" else "rad"
    length: LengthUnit = "mm" if chosen.get("length") == "mm" else "m"
    return Units(angle, length)


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
    told = pose_view(pose, units)
    told["axis_angle"] = {"axis": plain(about.axis), "angle": float(about.angle) / angle}
    singular = _at_lock("rpy", ("x", "z"), rpy_from_matrix(rotation), units)
    if euler is not None:
        sequence, frame = euler
        found = euler_from_matrix(sequence, rotation, frame)
        told["euler"] = [angles_view(found.angles, units), angles_view(found.alternative, units)]
        singular |= _at_lock("euler", ("the first axis", "the third"), found, units)
    if about.axis_free:
        singular["axis_angle"] = "the angle is zero: any axis is right"
    elif about.sign_free:
        singular["axis_angle"] = "the angle is half a turn: the opposite axis is right too"
    told["determinant"] = float(np.linalg.det(rotation))
    if point is not None:
        told["point"] = plain(transform_points(pose, point) / length)
    if singular:
        told["singular"] = singular
    return told


def _at_lock(name: str, about: tuple[str, str], found: EulerAngles, units: Units) -> dict[str, str]:
    """Return what to say of angles at gimbal lock, under the name of the representation."""
    if not found.singular:
        return {}
    lock = int(found.lock)
    first, _, third = (found.angles / factor(Quantity("angle"), units)).tolist()
    value = f"{round(first + lock * third, 12) + 0.0:.9g} {units.angle}"
    word, sign = ("sum", "plus") if lock > 0 else ("difference", "minus")
    text = f"gimbal lock: of the angles about {about[0]} and {about[1]} only the {word} is determined "
    return {name: text + f"(first {sign} third = {value})"}
