"""Poses on the way from one pose to another, for values of s from 0 to 1."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.euler import euler_from_matrix, matrix_from_euler
from trajcli.geometry.pose import PoseInterpolation, build, interpolate
from trajcli.geometry.rotation import Frame, nearest_rotation
from trajcli.pipeline.pose_steps import TypedAngles

Orientation = Literal["axis_angle", "euler"]
_RPY: tuple[str, Frame] = ("XYZ", "fixed")


@frozen
class End:
    """One end of the way.

    Attributes:
        pose: Shape (4, 4).
        typed: Its orientation where the user wrote it as three angles.
    """

    pose: Array
    typed: TypedAngles | None


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
    start: End,
    end: End,
    s: Array,
    way: PoseInterpolation = "line",
    orientation: Orientation = "axis_angle",
    euler: tuple[str, Frame] | None = None,
) -> Array:
    """Return the poses (k, 4, 4) at s (k,).

    Args:
        start: At s = 0.
        end: At s = 1.
        s: From 0 to 1.
        way: "line" for a straight line of the origin, "screw" for constant twist.
        orientation: On a line: about one fixed axis, or "euler" for angles that change evenly, in the
            sequence of the end; where the end was not typed as angles, in that of `euler`, else as rpy. Of
            angles that were not typed, the triple and the turns nearest to the other end's are taken.
        euler: Sequence and frame.

    Raises:
        InputError: When a screw is asked for with Euler angles.
    """
    ends = [build(nearest_rotation(pose[:3, :3]), pose[:3, 3]) for pose in (start.pose, end.pose)]
    if way == "screw" and orientation == "euler":
        message = "--orientation euler is for --path line: a screw turns about its own axis"
        raise InputError(message, hint="leave one of them out")
    poses = interpolate(ends[0], ends[1], s, way)
    if orientation == "euler":
        poses[:, :3, :3] = _even_angles(start, end, s, euler)
    return poses


def _even_angles(start: End, end: End, s: Array, euler: tuple[str, Frame] | None) -> Array:
    sequence, frame = (end.typed.sequence, end.typed.frame) if end.typed else euler or _RPY
    first, last = (_own(side, sequence, frame) for side in (start, end))
    if last is None:
        last = _nearest(end.pose, sequence, frame, np.zeros(3) if first is None else first)
    if first is None:
        first = _nearest(start.pose, sequence, frame, last)
    angles = (1.0 - s)[:, None] * first + s[:, None] * last
    return matrix_from_euler(sequence, angles, frame)


def _own(side: End, sequence: str, frame: Frame) -> Array | None:
    """Return the angles that the user typed in this very sequence."""
    typed = side.typed
    if typed is None or (typed.sequence, typed.frame) != (sequence, frame):
        return None
    return np.array(typed.angles)


def _nearest(pose: Array, sequence: str, frame: Frame, aim: Array) -> Array:
    found = euler_from_matrix(sequence, pose[:3, :3], frame)
    turn = 2.0 * np.pi
    triples: Sequence[Array] = [
        angles + turn * np.round((aim - angles) / turn) for angles in (found.angles, found.alternative)
    ]
    return min(triples, key=lambda angles: float(np.abs(angles - aim).max()))
