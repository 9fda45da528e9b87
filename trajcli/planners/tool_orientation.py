"""How the orientation changes along a path of the tool."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    OrientationCurve,
    SegmentProgress,
    TangentOrientation,
)
from trajcli.geometry.paths.position import PositionCurve
from trajcli.planners.tool_target import ToolTarget

Orientation = Literal["axis_angle", "euler", "fixed", "tangent"]

_SAME = 1e-9  # of an entry of a matrix: two orientations that are meant to be one


def orientation_along(
    how: Orientation,
    start: Array,
    targets: Sequence[ToolTarget],
    place: PositionCurve | None,
    progress: SegmentProgress | None,
) -> OrientationCurve:
    """Return R(s) from the orientation at the start through those of the targets.

    Args:
        how: The way.
        start: Shape (3, 3).
        targets: One for each segment.
        place: The path; None for a rotation alone.
        progress: How far each segment is done; None for a rotation alone: s is then the angle.

    Raises:
        InputError: When the targets do not give what the way needs.
        PlanningError: When they ask for another orientation than the way has.
    """
    rotations = np.stack([start, *(target.pose[:3, :3] for target in targets)])
    turns = float(np.abs(rotations - start).max())
    if how == "fixed":
        if turns > _SAME:
            message = "orientation: fixed keeps the orientation, but the target asks for another one"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        return FixedOrientation(start, 0.0 if progress is None else progress.length)
    if how == "tangent":
        if turns > _SAME:
            message = "orientation: tangent follows from the path, but the target asks for an orientation"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        if place is None:
            message = "orientation: tangent needs a path, and the tool stays in its place"
            raise PlanningError(message, hint="use axis_angle")
        return TangentOrientation(place, start)
    if how == "euler":
        return _even(rotations, targets, progress)
    return (
        AxisAngleOrientation.between(*rotations)
        if progress is None
        else AxisAngleOrientation(rotations, progress)
    )


def _even(
    rotations: Array, targets: Sequence[ToolTarget], progress: SegmentProgress | None
) -> OrientationCurve:
    from trajcli.geometry.paths.euler_interpolation import euler_interpolation

    forms = {(typed[1], typed[2]) for target in targets if (typed := target.typed) is not None}
    if len(forms) != 1:
        what = "different angles" if forms else "no angles"
        message = f"orientation: euler goes evenly in the target's angles, and the targets have {what}"
        raise InputError(message, hint="give each target `euler` of one sequence, or `rpy`")
    sequence, frame = forms.pop()
    known = [None, *(None if target.typed is None else target.typed[0] for target in targets)]
    return euler_interpolation(rotations, progress, sequence, frame, known)  # type: ignore[arg-type]
