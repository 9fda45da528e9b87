"""Poses in job files: a position, one of several forms of orientation, and the branch that reaches them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.language.numbers import (
    AT_KEY,
    TWO_TURNS,
    FieldType,
    FlawError,
    Model,
    ReadingContext,
    flaws_below,
    number_schema,
    object_schema,
    read_number,
    refuse,
    shown,
    written_number,
)
from trajcli.language.per_joint import read_each
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.vendor_flags import VendorFlags

MAKERS = ("abb", "kuka", "fanuc")
"""Makers whose flags of a configuration are known."""
EulerSequence = Literal["XYX", "XYZ", "XZX", "XZY", "YXY", "YXZ", "YZX", "YZY", "ZXY", "ZXZ", "ZYX", "ZYZ"]
SEQUENCES = get_args(EulerSequence)
ROTATIONS = ("rpy", "quat_wxyz", "quat_xyzw", "rotvec", "matrix", "axis_angle", "euler")
"""The forms of a full orientation."""
_ROUNDING = 1e-14  # a rotation written with all its digits stays as it stands, bit by bit
_NO_LENGTH = 1e-100  # below it squares vanish
_ANGLE, _LENGTH, _RATIO = Quantity("angle"), Quantity("length"), Quantity("ratio")


def numbers_schema(count: int, quantity: Quantity) -> JsonSchemaValue:
    """Return the schema of a list of numbers."""
    return {"type": "array", "items": number_schema(quantity), "minItems": count, "maxItems": count}


AXIS_SCHEMA: JsonSchemaValue = {"anyOf": [{"enum": ["x", "y", "z"]}, numbers_schema(3, _RATIO)]}
"""Schema of the name of an axis, or three numbers."""
_ROW = {"type": "array", "items": number_schema(_LENGTH), "minItems": 3, "maxItems": 4}
MATRIX_SCHEMA: JsonSchemaValue = {**_ROW, "items": _ROW}
"""Schema of three or four rows; in the last column may stand lengths."""


@comparable
class Pose(FieldType):
    """A full pose; what it leaves out is zero. It is read into a (4, 4) matrix, lengths in m."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
        """Return the pose, shape (4, 4)."""
        if isinstance(value, np.ndarray):
            return value
        if not isinstance(value, Mapping):
            raise FlawError(f"expected a pose such as {{xyz: [0, 0, 0], rpy: [0, 0, 0]}}, got {shown(value)}")
        unknown = [key for key in value if key not in ("xyz", *ROTATIONS)]
        if unknown:
            raise FlawError(
                f"unknown key '{unknown[0]}'",
                unknown[0],
                AT_KEY,
                hint=f"a pose has xyz, {', '.join(ROTATIONS)}",
            )
        given = [key for key in ROTATIONS if key in value]
        if len(given) > 1:
            raise FlawError(
                f"{given[0]} and {given[1]} exclude each other", given[1], hint="leave one of them out"
            )
        return _pose(value, given[0] if given else None, context)

    def write(self, value: Array, context: ReadingContext) -> dict[str, Any]:
        """Return the pose as a rotation matrix and a position in metres."""
        xyz = [written_number(length, _LENGTH) for length in value[:3, 3].tolist()]
        return {"xyz": xyz, "matrix": value[:3, :3].tolist()}

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a pose."""
        numbers = numbers_schema
        euler = {
            "sequence": {"enum": list(SEQUENCES)},
            "frame": {"enum": ["current", "fixed"]},
            "angles": numbers(3, _ANGLE),
        }
        described = {
            "xyz": {**numbers(3, _LENGTH), "description": "Position (length unit)."},
            "rpy": {
                **numbers(3, _ANGLE),
                "description": "Angles about the fixed axes x, y, z: R = Rz Ry Rx (angle unit).",
            },
            "quat_wxyz": {**numbers(4, _RATIO), "description": "Unit quaternion, w first."},
            "quat_xyzw": {**numbers(4, _RATIO), "description": "Unit quaternion, w last (ROS, scipy)."},
            "rotvec": {
                **numbers(3, _ANGLE),
                "description": "Axis times angle, as rx, ry, rz of a UR pendant (angle unit).",
            },
            "matrix": {**MATRIX_SCHEMA, "description": "Rotation 3x3, or homogeneous 4x4."},
            "axis_angle": object_schema(
                {"axis": AXIS_SCHEMA, "angle": number_schema(_ANGLE)},
                "axis",
                "angle",
                description="Rotation by an angle about an axis.",
            ),
            "euler": object_schema(
                euler, "sequence", "angles", description="Euler angles about current or fixed axes."
            ),
        }
        return {"type": "object", "properties": described, "additionalProperties": False}


def moved(pose: Array, offset: Array, axes: Array) -> Array:
    """Return a pose (4, 4) after an offset (4, 4) along and about axes (3, 3), about its own origin."""
    result = np.eye(4)
    result[:3, :3] = axes @ offset[:3, :3] @ axes.T @ pose[:3, :3]
    result[:3, 3] = pose[:3, 3] + axes @ offset[:3, 3]
    return result


def _pose(value: Mapping[str, Any], form: str | None, context: ReadingContext) -> Array:
    def read(key: str, item: Any) -> Array:  # noqa: ANN401
        try:
            return _READERS[key](item, context)
        except InputError as error:
            raise FlawError(str(error), hint=error.problems[0].hint) from None

    fields = read_each(((key, value[key]) for key in (form, "xyz") if key is not None and key in value), read)
    pose = np.eye(4)
    if form is not None:
        size = len(fields[form])
        if size == 4 and "xyz" in value:
            raise FlawError(
                "a 4x4 matrix already has a position", "xyz", hint="leave xyz out, or give a 3x3 matrix"
            )
        pose[:size, :size] = fields[form]
    if "xyz" in value:
        pose[:3, 3] = fields["xyz"]
    return pose


def read_numbers(
    value: object, count: int, quantity: Quantity, context: ReadingContext, *path: str | int
) -> Array:
    """Return `count` numbers of one quantity in SI, shape (count,).

    Raises:
        FlawError: Names each that does not fit.
    """
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != count:
        got = f"{len(value)} values" if isinstance(value, list) else shown(value)
        raise FlawError(f"expected {count} numbers, got {got}", *path)
    with flaws_below(*path):
        read = read_each(enumerate(value), lambda _, item: read_number(item, quantity, context.units))
    numbers = np.array([*read.values()])
    if quantity == _ANGLE and context.units.angle == "rad" and max(abs(numbers)) > TWO_TURNS:
        context.has_far_angle = True
    return numbers


def read_rows(value: Any, context: ReadingContext) -> tuple[tuple[float, ...], ...]:  # noqa: ANN401
    """Return the rows of a 3x3 or 4x4 matrix, the position in m.

    Raises:
        FlawError: Names each entry that does not fit.
    """
    if not isinstance(value, list | tuple) or len(value) not in (3, 4):
        got = f"{len(value)} rows" if isinstance(value, list) else shown(value)
        raise FlawError(f"expected a 3x3 or 4x4 matrix, row by row, got {got}")
    context.has_matrix, size = True, len(value)

    def entry(index: int, column: int, item: Any) -> float:  # noqa: ANN401
        return read_number(item, _LENGTH if column == 3 != index else _RATIO, context.units)

    def row_of(index: int, row: Any) -> tuple[float, ...]:  # noqa: ANN401
        if not isinstance(row, list | tuple) or len(row) != size:
            got = f"{len(row)} values" if isinstance(row, list) else shown(row)
            raise FlawError(f"expected a row of {size} numbers, got {got}")
        return tuple(read_each(enumerate(row), partial(entry, index)).values())

    return tuple(read_each(enumerate(value), row_of).values())


def _matrix(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    pose = np.array(read_rows(value, context))
    if len(pose) == 4 and (pose[3] != [0, 0, 0, 1]).any():
        row = ", ".join(f"{number:.9g}" for number in pose[3].tolist())
        raise FlawError(f"the last row of a 4x4 matrix must be [0, 0, 0, 1], it is [{row}]", 3)
    pose[:3, :3] = _projected(pose[:3, :3])
    return pose


def _projected(matrix: Array) -> Array:
    from trajcli.geometry.rotation import check_rotation, nearest_rotation

    check_rotation(matrix)
    off = np.abs(matrix @ matrix.T - np.eye(3)).max()
    return matrix if off <= _ROUNDING else nearest_rotation(matrix)


def _position(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    return read_numbers(value, 3, _LENGTH, context)


def _rpy(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    from trajcli.geometry.euler import matrix_from_rpy

    return matrix_from_rpy(read_numbers(value, 3, _ANGLE, context))


def _quaternion(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    from trajcli.geometry.rotation import check_quaternion, matrix_from_quaternion

    numbers = read_numbers(value, 4, _RATIO, context)
    check_quaternion(numbers)
    return matrix_from_quaternion(numbers)


def _quaternion_w_last(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    numbers = read_numbers(value, 4, _RATIO, context).tolist()
    try:
        return _quaternion([numbers[3], *numbers[:3]], context)
    except InputError as error:
        hint = "divide it by its length" if any(numbers) else "no rotation is (0, 0, 0, 1)"
        raise FlawError(str(error), hint=hint) from None


def _rotation_vector(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    from trajcli.geometry.rotation import exp

    return exp(read_numbers(value, 3, _ANGLE, context))


def _axis_angle(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    from trajcli.geometry.rotation import matrix_from_axis_angle

    def read(key: str, item: Any) -> Array:  # noqa: ANN401
        return read_axis(item, context) if key == "axis" else read_numbers([item], 1, _ANGLE, context)

    fields = read_each(_exactly(value, ("axis", "angle"), ()).items(), read)
    return matrix_from_axis_angle(fields["axis"], fields["angle"][0])


def read_axis(value: Any, context: ReadingContext, *path: str) -> Array:  # noqa: ANN401
    """Return a unit vector (3,) from x, y, z or three numbers.

    Raises:
        FlawError: When it is neither, or has no direction.
    """
    numbers = read_direction(value, context, *path)
    return numbers / float(np.linalg.norm(numbers))


def read_direction(value: Any, context: ReadingContext, *path: str | int) -> Array:  # noqa: ANN401
    """Return three numbers (3,), or x, y or z as such, likewise."""
    if isinstance(value, str) and value in ("x", "y", "z"):
        return np.asarray(np.eye(3)["xyz".index(value)])
    numbers = read_numbers(value, 3, _RATIO, context, *path)
    length = np.linalg.norm(numbers)
    if length < _NO_LENGTH:
        raise FlawError(f"an axis of length {length:g} has no direction", *path)
    return numbers


def _euler(value: Any, context: ReadingContext) -> Array:  # noqa: ANN401
    from trajcli.geometry.euler import matrix_from_euler

    fields = _exactly(value, ("sequence", "angles"), ("frame",))
    sequence, frame = fields["sequence"], fields.get("frame", "current")
    if sequence not in SEQUENCES:
        is_lower = isinstance(sequence, str) and sequence.upper() in SEQUENCES
        hint = f"did you mean '{sequence.upper()}'?" if is_lower else f"one of {', '.join(SEQUENCES)}"
        raise FlawError(f"unknown sequence {shown(sequence)}", "sequence", hint=hint)
    if frame not in ("current", "fixed"):
        raise FlawError(f"expected current or fixed, got {shown(frame)}", "frame")
    return matrix_from_euler(sequence, read_numbers(fields["angles"], 3, _ANGLE, context, "angles"), frame)


def _exactly(value: Any, needed: tuple[str, ...], optional: tuple[str, ...]) -> Mapping[str, Any]:  # noqa: ANN401
    if not isinstance(value, Mapping):
        raise FlawError(f"expected {{{', '.join(needed)}}}, got {shown(value)}")
    missing = [key for key in needed if key not in value]
    if missing:
        raise FlawError(f"`{missing[0]}` is missing")
    unknown = [key for key in value if key not in (*needed, *optional)]
    if unknown:
        raise FlawError(
            f"unknown key '{unknown[0]}'",
            unknown[0],
            AT_KEY,
            hint=f"the keys are {', '.join((*needed, *optional))}",
        )
    return value


_READERS = {
    "xyz": _position,
    "rpy": _rpy,
    "quat_wxyz": _quaternion,
    "quat_xyzw": _quaternion_w_last,
    "rotvec": _rotation_vector,
    "matrix": _matrix,
    "axis_angle": _axis_angle,
    "euler": _euler,
}


@comparable
class Bits(FieldType):
    """A whole number of bits, or a text of them such as 'B010'."""

    largest: int
    description: str

    def read(self, value: Any, context: ReadingContext) -> int:  # noqa: ANN401
        """Return the number."""
        given = value
        if isinstance(value, str):
            text = value.strip().strip("'").upper()
            given = int(text[1:], 2) if re.fullmatch("B[01]{1,8}", text) else value
        if type(given) is not int or not 0 <= given <= self.largest:
            message = f"expected a whole number from 0 to {self.largest} or bits such as 'B010'"
            raise FlawError(f"{message}, got {shown(value)}")
        return given

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number or a text of bits."""
        number = {"type": "integer", "minimum": 0, "maximum": self.largest}
        return {"anyOf": [number, {"type": "string", "pattern": "^'?[Bb][01]{1,8}'?$"}]}


class KukaStatus(Model):
    """Status and turn of a KUKA position."""

    s: Annotated[int, Bits(31, "Status: bit 0 overhead, bit 1 elbow, bit 2 joint 5 below zero.")]
    t: Annotated[int, Bits(63, "Turn: a bit for each joint that is below zero.")] | None = None


class Configuration(Model):
    """Which branch of the inverse kinematics is meant; what is left out does not matter."""

    shoulder: Annotated[Literal["left", "right"] | None, Field(description="Side of the arm.")] = None
    elbow: Annotated[Literal["up", "down"] | None, Field(description="Side of the elbow.")] = None
    wrist: Annotated[Literal["flip", "no_flip"] | None, Field(description="Side of the wrist.")] = None
    abb: Annotated[
        tuple[int, int, int, int] | None,
        Field(strict=True, description="ABB: quadrants of joints 1, 4 and 6, and the branch 0 to 7."),
    ] = None
    kuka: KukaStatus | None = None
    fanuc: Annotated[
        str | None,
        Field(description="FANUC: as in the program, such as 'N U T, 0, 0, 0', with turns or not."),
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _list_of_four(cls, data: Any) -> Any:  # noqa: ANN401
        if not isinstance(data, Mapping) or not isinstance(data.get("abb"), list):
            return data
        abb = data["abb"]
        if len(abb) != 4 or any(type(number) is not int for number in abb) or not 0 <= abb[3] <= 7:
            hint = "[cf1, cf4, cf6, cfx]: quadrants of joints 1, 4 and 6, and a branch from 0 to 7"
            raise refuse([(("abb",), "expected four whole numbers, the last from 0 to 7", hint)])
        return {**data, "abb": tuple(abb)}

    @model_validator(mode="after")
    def _is_of_one_maker(self) -> Configuration:
        given = [key for key in ("shoulder", "elbow", "wrist", *MAKERS) if getattr(self, key) is not None]
        makers = [key for key in given if key in MAKERS]
        if makers and len(given) > 1:
            other = next(key for key in given if key != makers[0])
            raise refuse(
                [((makers[0],), f"{makers[0]} and {other} exclude each other", "leave one of them out")]
            )
        if self.fanuc is not None and self.flags is None:
            hint = "N or F, U or D, T or B, and perhaps the turns of joints 1, 4 and 6: 'N U T, 0, 0, 0'"
            raise refuse([(("fanuc",), f"expected a FANUC configuration, got {shown(self.fanuc)}", hint)])
        return self

    @property
    def flags(self) -> VendorFlags | None:
        """What the flags of a maker say; None where none are given."""
        if self.abb is None and self.kuka is None and self.fanuc is None:
            return None
        from trajcli.kinematics.inverse.vendor_flags import abb_flags, fanuc_flags, kuka_flags

        if self.abb is not None:
            return abb_flags(self.abb)
        return fanuc_flags(self.fanuc or "") if self.kuka is None else kuka_flags(self.kuka.s, self.kuka.t)

    @property
    def branch_names(self) -> dict[str, str]:
        """What is named of the branch itself, such as {"elbow": "up"}."""
        given = {key: getattr(self, key) for key in ("shoulder", "elbow", "wrist")}
        return {key: name for key, name in given.items() if name is not None}

    @property
    def asked(self) -> dict[str, str]:
        """All that is named, such as {"elbow": "up"} or {"abb": "[0, 0, 0, 1]"}."""
        return self.branch_names if self.flags is None else dict([self.flags.text.split(" ", 1)])

    @property
    def text(self) -> str:
        """What is asked for in words, such as "left up" or "abb [0, 0, 0, 1]"."""
        return " ".join(self.branch_names.values()) if self.flags is None else self.flags.text
