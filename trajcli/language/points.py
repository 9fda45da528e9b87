"""Points by name, relative to a point, or recorded: how they become the states that they stand for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationError
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.curves.piecewise import Array
from trajcli.language.numbers import (
    AT_KEY,
    SI,
    FlawError,
    ReadingContext,
    flaws_below,
    refuse,
    shown,
    written_number,
)
from trajcli.language.poses import ROTATIONS, Pose, moved
from trajcli.language.targets import RELATIVE, PoseFields, Relative, Target
from trajcli.units import Quantity

RELATIVE_DEFINITION = "relative to "
"""Begins a comment that stands in a schema for a state relative to a point; the name of its model ends it."""

RELATIVE_FIELDS: dict[str, JsonSchemaValue] = {
    "from": {"type": "string", "description": "Name of a point, or here: where the arm stands then."},
    "offset": {**Pose("").json_schema(), "description": "How far from it; what it leaves out is zero."},
    "frame": {
        "type": "string",
        "default": "tool",
        "description": "Whose axes the offset is along and about: those of the tool there, of world, or of a "
        "frame.",
    },
}
"""Schema of what makes a state relative to a point."""

BESIDE = ("configuration", "velocity", "acceleration", "joints", "time", "blend")
"""Fields of a state that may stand beside `from`."""
HERE = "here"
_LONGEST_CHAIN = 100  # points, each relative to the next
_Fields = dict[str, Any]


class ListOrRecorded(ABC):
    """Lets a mapping, such as {csv: PATH}, stand for a list of places.

    Attributes:
        listed: Type of the list.
        recorded: What a mapping is read as.
    """

    listed: ClassVar[Any]
    recorded: ClassVar[type]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        listed = handler.generate_schema(self.listed)
        return core_schema.with_info_wrap_validator_function(
            self._read,
            listed,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                self._write, info_arg=True, schema=listed
            ),
        )

    @abstractmethod
    def from_mapping(self, value: Mapping[str, Any], context: ReadingContext) -> Any:  # noqa: ANN401
        """Return what a mapping of a job stands for.

        Raises:
            FlawError: When it stands for nothing.
        """

    @abstractmethod
    def written(
        self,
        value: Any,  # noqa: ANN401
        serialize: core_schema.SerializerFunctionWrapHandler,
        context: ReadingContext,
    ) -> Any:  # noqa: ANN401
        """Return what is recorded as a job writes it."""

    def _read(
        self,
        value: Any,  # noqa: ANN401
        validate: core_schema.ValidatorFunctionWrapHandler,
        info: core_schema.ValidationInfo,
    ) -> Any:  # noqa: ANN401
        if isinstance(value, self.recorded):
            return value
        if not isinstance(value, Mapping):
            return validate(value)
        try:
            return self.from_mapping(value, info.context or SI)
        except FlawError as error:
            raise refuse(error.flaws) from None

    def _write(
        self,
        value: Any,  # noqa: ANN401
        serialize: core_schema.SerializerFunctionWrapHandler,
        info: core_schema.SerializationInfo,
    ) -> Any:  # noqa: ANN401
        if not isinstance(value, self.recorded):
            return serialize(value)
        return value if info.context is None else self.written(value, serialize, info.context)


class Named:
    """Lets the name of a point, or an offset from one, stand for a state, of the model named `model`."""

    def __init__(self, model: str = "Target") -> None:
        self.model = model

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.with_info_wrap_validator_function(self._read, handler(source))

    @staticmethod
    def _read(
        value: Any,  # noqa: ANN401
        validate: core_schema.ValidatorFunctionWrapHandler,
        info: core_schema.ValidationInfo,
    ) -> Any:  # noqa: ANN401
        context = info.context or SI
        target = Named._target(value, validate, context)
        if isinstance(target, Target) and target.waits:
            context.waits = True
        return target

    @staticmethod
    def _target(
        value: Any,  # noqa: ANN401
        validate: core_schema.ValidatorFunctionWrapHandler,
        context: ReadingContext,
    ) -> Any:  # noqa: ANN401
        """Return the state that a value of a file stands for."""
        if isinstance(value, str):
            return _of_name(value, validate, context)
        if not isinstance(value, Mapping | Target):
            hint = "write {joints: ...}, or the name of a point"
            raise refuse([((), f"expected a state, got {shown(value)}", hint)])
        if isinstance(value, Mapping) and ("from" in value or "in" in value):
            try:
                value = _relative(value, context) if "from" in value else _in_world(value, context)
            except FlawError as error:
                raise refuse(error.flaws) from None
        return validate(value)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        name = {"type": "string", "description": "Name of a point under `points`."}
        return {"anyOf": [name, handler(schema), {"$comment": RELATIVE_DEFINITION + self.model}]}


NamedTarget = Annotated[Target, Named()]


def _of_name(name: str, validate: core_schema.ValidatorFunctionWrapHandler, context: ReadingContext) -> Any:  # noqa: ANN401
    """Return the state that a name stands for; a flaw of the point is reported where the point stands."""
    try:
        names = _names_from(name, context)
    except FlawError as error:
        raise refuse(error.flaws) from None
    state = context.points[names[-1]]
    try:
        if isinstance(state, Mapping) and ("from" in state or "in" in state):
            state = _of_point(names[-1], context)
        return validate(state)
    except (FlawError, ValidationError) as error:
        if isinstance(error, ValidationError) and _is_target(state, context):
            raise  # nothing is wrong where the point stands: it cannot stand here
        raise refuse([]) from None


def _is_target(state: Any, context: ReadingContext) -> bool:  # noqa: ANN401
    """Return whether the state of a point is one, whatever a list of points asks of it."""
    try:
        Target.model_validate(state, context=context)
    except ValidationError:
        return False
    return True


def _names_from(name: str, context: ReadingContext) -> list[str]:
    """Return a name and the names that it stands for, the last one that of a state."""
    points, names = context.points, [name]
    if name not in points:
        raise FlawError(f"there is no point '{name}'", hint=_hint_to_names(name, points))
    while isinstance(state := points[names[-1]], str):
        if state in names:
            raise FlawError(f"the point '{state}' is named by itself ({' -> '.join([*names, state])})")
        if state not in points:
            raise _flaw_elsewhere()
        names.append(state)
    return names


def _hint_to_names(name: str, points: Mapping[str, Any]) -> str:
    from trajcli.suggest import did_you_mean, valid_names

    return did_you_mean(name, points) or valid_names(points, "points") or "the job has no `points`"


def _flaw_elsewhere() -> FlawError:
    """Return the error about a flaw that is reported where the point stands."""
    error = FlawError("a point is wrong")
    error.flaws = []
    return error


def _relative(value: Mapping[str, Any], context: ReadingContext) -> _Fields:
    """Return the fields of the state that is given relative to a point, or to where the arm stands."""
    if value["from"] == HERE:
        return _moved(value, HERE, None, context)
    name = _name_in(value, context)
    return _moved(value, name, _of_point(name, context), context)


def _of_point(name: str, context: ReadingContext) -> _Fields:
    """Return the fields of a point that may itself be relative to others, at most to a chain of 100."""
    chain = [name]
    while chain[-1] not in context.shifted and _mapping(chain[-1], context).get("from", HERE) != HERE:
        try:
            following = _name_in(context.points[chain[-1]], context)
        except FlawError:
            raise _flaw_elsewhere() from None
        if following in chain:
            circle = " -> ".join([*chain[chain.index(following) :], following])
            raise FlawError(f"the point '{following}' is relative to itself ({circle})", "from")
        if len(chain) == _LONGEST_CHAIN:
            text = f"more than {_LONGEST_CHAIN} points stand one relative to the next"
            raise FlawError(text, "from", hint="give one of them as a pose of its own")
        chain.append(following)
    last = chain.pop()
    fields = context.shifted.get(last)
    if fields is None:
        own = _mapping(last, context)
        make: Callable[[], _Fields] = partial(dict, own)
        if "in" in own:
            make = partial(_in_world, own, context)
        elif "from" in own:
            make = partial(_moved, own, HERE, None, context)
        fields = context.shifted[last] = _elsewhere(make, context)
    for link in reversed(chain):
        moved = partial(_moved, context.points[link], last, fields, context)
        fields, last = _elsewhere(moved, context), link
        context.shifted[link] = fields
    return fields


def _elsewhere(make: Callable[[], _Fields], context: ReadingContext) -> _Fields:
    """Return the fields of another point, whose flaws are reported where that stands."""
    try:
        fields = make()
    except FlawError:
        raise _flaw_elsewhere() from None
    if not _is_target(fields, context):
        raise _flaw_elsewhere()
    return fields


def _in_world(value: Mapping[str, Any], context: ReadingContext) -> _Fields:
    """Return the fields of a state that is given in a frame, in world."""
    from trajcli.language.frames import in_world

    return in_world(value, context)


def _mapping(name: str, context: ReadingContext) -> Mapping[str, Any]:
    state = context.points[name]
    if not isinstance(state, Mapping):
        raise _flaw_elsewhere()
    return state


def _name_in(value: Mapping[str, Any], context: ReadingContext) -> str:
    """Return the name of the point that a relative state starts from, at the end of all names for it."""
    name = value["from"]
    if not isinstance(name, str):
        raise FlawError(f"expected the name of a point, got {shown(name)}", "from")
    with flaws_below("from"):
        return _names_from(name, context)[-1]


def _moved(value: Mapping[str, Any], name: str, point: _Fields | None, context: ReadingContext) -> _Fields:
    """Return the fields of a state that is relative to a point, or to where the arm stands."""
    offset, axes = _offset(value, context), _axes(value.get("frame", "tool"), context)
    for key in value:
        every = key == "joints" and not isinstance(value[key], Mapping)
        if (key in PoseFields.model_fields and key not in BESIDE) or every or key == "in":
            text = f"from and {key} exclude each other"
            hint = "say along whose axes: `frame`" if key == "in" else "leave one of them out"
            if key in ("xyz", *ROTATIONS):
                hint = f"say how far from the point: offset: {{{key}: ...}}"
            raise FlawError(text, key, AT_KEY, hint=hint)
        if key not in (*RELATIVE_FIELDS, *BESIDE):
            from trajcli.suggest import did_you_mean, valid_names

            keys = (*RELATIVE_FIELDS, *BESIDE[:4])
            raise FlawError(
                f"unknown key '{key}'", key, AT_KEY, hint=did_you_mean(key, keys) or valid_names(keys)
            )
    beside = {key: value[key] for key in value if key in BESIDE}
    posed = point is not None and not {RELATIVE, *PoseFields.model_fields}.isdisjoint(point)
    if posed and point is not None:
        beside = {key: point[key] for key in ("joints", "configuration") if key in point} | beside
    if point is None or ("joints" in point and not posed) or "joints_by" in point or RELATIVE in point:
        if axes is not None:
            offset = moved(np.eye(4), offset, axes)
        rows = tuple(map(tuple, offset.tolist()))
        return {RELATIVE: Relative(name, rows, axes is not None), **beside}
    return {**_displaced(name, _pose_of(name, point, context), offset, axes), **beside}


def _offset(value: Mapping[str, Any], context: ReadingContext) -> Array:
    with flaws_below("offset"):
        return Pose("").read(value.get("offset", {}), context)


def _axes(frame: Any, context: ReadingContext) -> Array | None:  # noqa: ANN401
    """Return the axes (3, 3) that an offset is along and about; None for those of the tool."""
    if frame in ("tool", "world"):
        return None if frame == "tool" else np.eye(3)
    from trajcli.language.frames import frame_named

    with flaws_below("frame"):
        return frame_named(frame, context)[:3, :3]


def _pose_of(name: str, point: _Fields, context: ReadingContext) -> PoseFields:
    """Return the pose of a point, which is not given by its joints."""
    given = {key: point[key] for key in PoseFields.model_fields if key in point}
    if not given:
        hint = "give it as a pose, or by its joints"
        raise FlawError(
            f"the point '{name}' is given without a pose: nothing is relative to it", "from", hint=hint
        )
    return PoseFields.model_validate(given, context=context)


def _displaced(name: str, pose: PoseFields, offset: Array, axes: Array | None) -> _Fields:
    """Return the fields of a pose after an offset along and about axes (3, 3): those of the tool for None.

    That is T @ offset, or p + A d and A R_offset A^T R.
    """
    whole, turns = pose.rotation_form is not None, not np.array_equal(offset[:3, :3], np.eye(3))
    if not pose.gives_position:
        raise FlawError(f"the point '{name}' has no position to be relative to", "from")
    if not whole and (turns or axes is None):
        what = "the frame of the tool is not known there" if axes is None else "the offset cannot turn it"
        hint = f"give '{name}' an orientation" + ("" if turns else ", or say `frame: world`")
        raise FlawError(f"the point '{name}' has no whole orientation: {what}", "from", hint=hint)
    at = pose.full_pose()
    along = at[:3, :3] if axes is None else axes
    position = at[:3, 3] + along @ offset[:3, 3]
    fields = pose.model_dump(context=ReadingContext(), exclude_none=True, exclude={"xyz"})
    if turns or pose.rotation_form == "matrix":
        kept = fields.keys() - {pose.rotation_form}
        rotation = at[:3, :3]
        if turns:
            turn = offset[:3, :3] if axes is None else axes @ offset[:3, :3] @ axes.T
            rotation = rotation @ turn if axes is None else turn @ rotation
        fields = {**{key: fields[key] for key in kept}, "matrix": rotation.tolist()}
    return {"xyz": [written_number(float(x), Quantity("length")) for x in position], **fields}
