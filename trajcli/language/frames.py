"""Frames of a job: where they stand in world, and what is given in one of them as it is in world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from trajcli.curves.piecewise import Array
from trajcli.language.numbers import AT_KEY, FlawError, ReadingContext, flaws_below, shown, written_number
from trajcli.language.poses import Pose, moved
from trajcli.language.targets import AIMS, PoseFields
from trajcli.units import Quantity

_ABOVE = ("world", "base")
"""Frames that every job has."""
OF_GRID = "\0grid"
"""Key of a frame of a grid, which no file can write."""
_LONGEST_CHAIN = 100  # frames, each in the next
_UPRIGHT = 1e-9  # rad from the vertical: rounding


class _ChainError(FlawError):
    """A frame that is given in itself, or in too many: said where the frame that is read first stands."""


def frame_named(name: Any, context: ReadingContext, chain: tuple[str, ...] = ()) -> Array:  # noqa: ANN401
    """Return where a frame stands, T_world_frame (4, 4), m.

    Args:
        name: One of the job's, world, or base: where the arm stands.
        context: With the frames of the job.
        chain: Frames that are given in this one.

    Raises:
        FlawError: When there is no such frame, or it is given in itself; without a flaw where the frame's own
            place says what is wrong.
    """
    if not isinstance(name, str):
        raise FlawError(f"expected the name of a frame, got {shown(name)}")
    if name in _ABOVE:
        return np.eye(4) if name == "world" else context.base
    if name not in context.frames:
        from trajcli.suggest import did_you_mean, valid_names

        names = (*context.frames, *_ABOVE)
        hint = did_you_mean(name, names) or valid_names(names, "frames")
        raise FlawError(f"there is no frame '{name}'", hint=hint)
    if name in chain:
        circle = chain[chain.index(name) :]
        context.circular.update(circle)
        raise _ChainError(f"the frame '{name}' is given in itself ({' -> '.join([*circle, name])})")
    if name in context.circular:
        error = FlawError(f"the frame '{name}' is given in itself")
        error.flaws = []
        raise error
    if len(chain) == _LONGEST_CHAIN:
        text = f"more than {_LONGEST_CHAIN} frames stand one in the next"
        raise _ChainError(text, hint="give one in world")
    if name not in context.placed:
        try:
            context.placed[name] = pose_of_frame(context.frames[name], context, (*chain, name))
        except FlawError as error:  # of another flaw the frame's own place tells
            error.flaws = [((), *flaw[1:]) for flaw in error.flaws if isinstance(error, _ChainError)]
            raise
    return context.placed[name]


def pose_of_frame(value: Any, context: ReadingContext, chain: tuple[str, ...] = ()) -> Array:  # noqa: ANN401
    """Return where a frame stands that a file gives by `value`, inside those of `chain`: (4, 4), m.

    Raises:
        FlawError: When it is no pose, or given in no frame.
    """
    if isinstance(value, Mapping) and OF_GRID in value:
        value = value[OF_GRID]
        origin = frame_named(value["from"], context, chain)
        offset = Pose("").read(value["offset"], context)
        return moved(origin, offset, frame_named(value["frame"], context, chain)[:3, :3])
    if not isinstance(value, Mapping) or "in" not in value:
        return Pose("").read(value, context)
    with flaws_below("in"):
        outer = frame_named(value["in"], context, chain)
    return np.asarray(outer @ Pose("").read({key: value[key] for key in value if key != "in"}, context))


def in_world(value: Mapping[str, Any], context: ReadingContext) -> dict[str, Any]:
    """Return the fields of a state that is given in a frame, in world; a pose with flaws as it stands.

    Raises:
        FlawError: When there is no such frame, no pose, or a part of an orientation that is about a vertical
            while that of the frame leans.
    """
    others = {key: item for key, item in value.items() if key != "in"}
    given = {key: others[key] for key in PoseFields.model_fields if key in others}
    with flaws_below("in"):
        frame = frame_named(value["in"], context)
    try:
        pose = PoseFields.model_validate(given, context=context)
    except ValidationError:
        return others
    if not pose.gives_pose:
        text = "`in` says in which frame a pose is given, and there is none"
        raise FlawError(text, "in", AT_KEY, hint="leave it out")
    fields = pose.model_dump(context=ReadingContext(), exclude_none=True, exclude={"xyz"})
    if not np.array_equal(frame[:3, :3], np.eye(3)):
        for key in (pose.rotation_form or "", *AIMS):
            fields.pop(key, None)
        fields |= _turned(pose, frame[:3, :3], str(value["in"]))
    elif pose.matrix is not None:
        fields["matrix"] = pose.full_pose()[:3, :3].tolist()
    if pose.gives_position:
        position = frame[:3, :3] @ pose.full_pose()[:3, 3] + frame[:3, 3]
        fields["xyz"] = [written_number(x, Quantity("length")) for x in position.tolist()]
    return {**{key: item for key, item in others.items() if key not in given}, **fields}


def _turned(pose: PoseFields, axes: Array, name: str) -> dict[str, Any]:
    """Return the orientation of a pose, or the part of one, turned by the axes (3, 3) of a frame."""
    if pose.rotation_form is not None:
        return {"matrix": (axes @ pose.full_pose()[:3, :3]).tolist()}
    if pose.direction is not None:
        return {"direction": (axes @ np.array(pose.direction)).tolist()}
    if pose.yaw is None and pose.pitch is None:
        return {}
    if float(np.hypot(axes[0, 2], axes[1, 2])) > _UPRIGHT:
        part = "yaw" if pose.pitch is None else "pitch"
        hint = "give a `direction`, or a whole orientation"
        raise FlawError(f"{part} is about the vertical, and the z axis of '{name}' leans", part, hint=hint)
    sign = float(np.sign(axes[2, 2]))
    if pose.pitch is not None:
        return {"pitch": written_number(sign * pose.pitch, Quantity("angle"))}
    turn = float(np.arctan2(axes[1, 0], axes[0, 0]))
    return {"yaw": written_number(turn + sign * (pose.yaw or 0.0), Quantity("angle"))}
