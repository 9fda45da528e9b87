"""What the documents say about a field of a model: its form, its unit, its default."""

from __future__ import annotations

import types
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from docs.markdown import first_sentence, table
from trajcli.job.model import Output, OutputUnits, RobotSource, UnitsSpec
from trajcli.job.robot import JointModel
from trajcli.kinematics.robot import MountedTool
from trajcli.language.dynamics import FrictionSpec, Gravity, LinkSpec, NamedTool, PayloadSpec
from trajcli.language.limits import (
    UNLIMITED,
    Bounds,
    EffortBound,
    Efforts,
    JobLimitsSpec,
    JointBound,
    JointRate,
    LimitsSpec,
    Scale,
    ToolLimitsSpec,
    VelocityByPosition,
)
from trajcli.language.numbers import FieldType, Name, Number
from trajcli.language.per_joint import JointDistance, PerJoint
from trajcli.language.poses import Bits, KukaStatus, Pose
from trajcli.language.targets import (
    AxisAngleSpec,
    Configuration,
    Direction,
    EulerSpec,
    Matrix,
    Numbers,
    Target,
)
from trajcli.language.waypoints import PointsField, Waypoint
from trajcli.language.zones import SignalsField, ZoneField
from trajcli.planners import PLANNERS, Planner
from trajcli.planners.tool_path.arc import ArcFields
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import ToleranceSpec
from trajcli.planners.tool_path.segments import Segment, SegmentLaw, SegmentsField
from trajcli.planners.tool_path.weave import WeaveSpec
from trajcli.planners.waypoints.blends import BlendDurations
from trajcli.planners.waypoints.time_optimal import PathParameter
from trajcli.planners.waypoints.waypoints import SegmentTimes
from trajcli.units import Quantity, Units, unit_name

SECTIONS: dict[type, str] = {
    UnitsSpec: "[units](#units)",
    LimitsSpec: "[limits](#limits)",
    JobLimitsSpec: "[limits](#limits)",
    Scale: "[factors](#scale)",
    Target: "[state](#states)",
    Output: "[output](#output)",
    OutputUnits: "[units of the columns](#units-of-the-columns)",
    JointModel: "[joint](#joints)",
    FrictionSpec: "[friction](#friction)",
    LinkSpec: "[link](#link)",
    PayloadSpec: "[payload](#payload)",
    AxisAngleSpec: "[axis and angle](#axis-and-angle)",
    EulerSpec: "[Euler angles](#euler-angles)",
    Configuration: "[configuration](#configuration)",
    Waypoint: "[waypoint](#points-on-the-path)",
    ToolLimitsSpec: "[limits of the tool](#limits-of-the-tool)",
    VelocityByPosition: "[by position](#velocity-by-position)",
    LawSpec: "[law](#law)",
    ToleranceSpec: "[tolerance](#tolerance)",
    Segment: "[segments](#segments)",
    WeaveSpec: "[weave](#weave)",
    SegmentLaw: "[law of a segment](#laws-of-segments)",
    ArcFields: "[arc](#arcs)",
}
"""Where a model that stands inside another one is described."""

_BY_JOINT = "[for each joint](#values-by-joint)"
_LEFT_OUT = "left out"
_POINTS = "list of [waypoints](#points-on-the-path), or `{positions, times, merge}`, or `{csv, merge}`"


def field_table(model: type[BaseModel], left_out: Mapping[str, str] | None = None) -> str:
    """Return the table of a model's fields.

    Args:
        model: Fields that every planner has are not listed for a planner.
        left_out: What it means that an optional field is left out, by field.
    """
    rows = [
        [
            f"`{field.alias or name}`",
            _form(field),
            _unit(field),
            _default(name, field, left_out or {}),
            _description(field),
        ]
        for name, field in model.model_fields.items()
        if name not in hidden_fields(model) and not (field.alias or name).startswith("\0")
    ]
    return table(["field", "what may stand there", "unit", "default", "meaning"], rows)


def hidden_fields(model: type[BaseModel]) -> set[str]:
    """Return the fields that every planner has, for a planner; they are described once."""
    return {"planner", *Planner.model_fields} if model in PLANNERS.values() else set()


def field_type(field: FieldInfo) -> FieldType | None:
    """Return what reads a field's value, where that is a type of the job language."""
    return next((item for item in _annotations(field) if isinstance(item, FieldType)), None)


def _annotations(field: FieldInfo) -> list[Any]:
    nested = [
        item
        for arm in get_args(field.annotation)
        if get_origin(arm) is Annotated and get_origin(field.annotation) is not dict
        for item in get_args(arm)[1:]
    ]
    return [*field.metadata, *nested]


def _form(field: FieldInfo) -> str:
    if any(isinstance(item, SegmentsField) for item in field.metadata):
        return "list of [segments](#segments), or `{csv, in, merge}`"
    if any(isinstance(item, PointsField) for item in field.metadata):
        return _POINTS
    reader = field_type(field)
    return _type_form(field.annotation) if reader is None else _reader_form(reader)


def _reader_form(reader: FieldType) -> str:
    if isinstance(reader, Number):
        return _number_form(reader)
    if isinstance(reader, JointRate):
        return f"number {reader.rule}"
    if isinstance(reader, PerJoint):
        above = "" if reader.above is None else f" above {reader.above:g}"
        return f"number{above}, {_BY_JOINT}"
    if isinstance(reader, Bounds):
        return f"[bound](#bounds), {_BY_JOINT}"
    if isinstance(reader, Numbers):
        return f"list of {reader.count} numbers"
    forms: dict[type, str] = {
        Direction: "`x` or `y` or `z` or a list of 3 numbers",
        Name: "text of one line",
        Matrix: "3 rows of 3 numbers, or 4 of 4",
        JointBound: "[bound](#bounds)",
        EffortBound: "[bound](#bounds)",
        Efforts: f"[bound](#bounds), {_BY_JOINT}, or `robot`",
        Gravity: "list of 3 numbers",
        Pose: "[pose](#poses)",
        Bits: "whole number, or bits such as `'B010'`",
        NamedTool: "name of a tool, or a [tool](programs.md#tools)",
        RobotSource: "[robot](#robot)",
        JointDistance: f"number at least 0, {_BY_JOINT}",
        ZoneField: "number at least 0, `stop`, or {position, orientation, joints}: [zones](zones.md)",
        SignalsField: "{signal, value, when, before}, or a list of these: [signals](programs.md#signals)",
        BlendDurations: "number above 0, or a list of them",
        SegmentTimes: "list of numbers at least 0",
        PathParameter: "`chord` or `centripetal` or `uniform` or a list of numbers",
    }
    return forms[type(reader)]


def _number_form(number: Number) -> str:
    rules = [("above", number.above), ("at least", number.at_least), ("at most", number.at_most)]
    stated = " and ".join(f"{word} {bound:g}" for word, bound in rules if bound is not None)
    return f"number {stated}".rstrip()


def _bare(annotation: Any) -> Any:  # noqa: ANN401
    """Return a type without its alternative None."""
    if get_origin(annotation) is Annotated:
        return _bare(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        arms = [arm for arm in get_args(annotation) if arm is not type(None)]
        return _bare(arms[0]) if len(arms) == 1 else annotation
    return annotation


def _type_form(annotation: Any) -> str:  # noqa: ANN401
    bare = _bare(annotation)
    origin, arms = get_origin(bare), get_args(bare)
    if origin is Literal:
        return " or ".join(f"`{arm}`" for arm in arms)
    if origin in (list, tuple):
        return f"list of {_type_form(arms[0])}".replace("number", "numbers")
    if origin is dict:
        return f"names, each with a {_type_form(arms[1])}"
    if origin in (Union, types.UnionType):
        return "[move](#moves)"
    plain = {
        np.ndarray: "[pose](#poses)",
        MountedTool: "[tool](programs.md#tools)",
        Any: "[defaults](#defaults)",
        bool: "`true` or `false`",
        str: "text",
        float: "number",
        int: "whole number",
        KukaStatus: "`{s, t}`",
        Planner: "[move](#moves)",
    }
    return plain[bare] if bare in plain else SECTIONS[bare]


def _unit(field: FieldInfo) -> str:
    reader = field_type(field)
    if isinstance(reader, PerJoint | Bounds | JointBound | JointRate):
        return "joint" + ("", "/s", "/s^2", "/s^3")[reader.order]
    if isinstance(reader, Number | Numbers):
        return _quantity_unit(reader.quantity)
    if isinstance(reader, EffortBound | Efforts):
        return "N m or N"
    if isinstance(reader, Gravity):
        return "m/s^2"
    if isinstance(reader, ZoneField):
        return "length unit"
    if isinstance(reader, JointDistance | BlendDurations | SegmentTimes):
        return "joint" if isinstance(reader, JointDistance) else "s"
    listed = [item for item in get_args(_bare(field.annotation)) if get_origin(item) is Annotated]
    inner = [item for arm in listed for item in get_args(arm) if isinstance(item, Number)]
    return _quantity_unit(inner[0].quantity) if inner else ""


def _quantity_unit(quantity: Quantity) -> str:
    if quantity.dimension in ("angle", "length"):
        return quantity.dimension + ("", "/s", "/s^2", "/s^3")[quantity.order]
    return unit_name(quantity, Units())


def _default(name: str, field: FieldInfo, left_out: Mapping[str, str]) -> str:
    if field.is_required():
        return "required"
    default = field.default
    if name in left_out:
        return left_out[name]
    if default is None or default in ((), {}):
        return _LEFT_OUT
    if default == UNLIMITED:
        return "unlimited"
    if isinstance(default, BaseModel):
        return "its defaults"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, list | tuple):
        return f"`[{', '.join(map(str, default))}]`"
    return f"`{default:g}`" if isinstance(default, float) else f"`{default}`"


def _description(field: FieldInfo) -> str:
    reader, bare = field_type(field), _bare(field.annotation)
    text = field.description or (reader.description if reader else "")
    if not text and isinstance(bare, type) and issubclass(bare, BaseModel):
        text = first_sentence(bare.__doc__)
    return text
