"""Robots of jobs: the model of a robot in a file, the catalogue, and the robot that a job names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.errors import FileError, InputError, Problem, utf8
from trajcli.frozen import frozen
from trajcli.job.messages import problems_of
from trajcli.job.model import UnitsSpec
from trajcli.job.yaml.load import Document, read_document
from trajcli.kinematics.robot import QUANTITIES, Joint, Limits, Robot
from trajcli.language.limits import UNLIMITED, JointBound, LowerUpper, VelocityByPosition, written_bound
from trajcli.language.numbers import (
    MAX_JOINTS,
    Model,
    Number,
    ReadingContext,
    refuse,
    shown,
    written_number,
)
from trajcli.language.poses import Pose
from trajcli.suggest import did_you_mean, nearest, nearest_names
from trajcli.units import Quantity, Units, joint_quantity

CATALOGUE = Path(__file__).parent.parent / "catalogue"

_ANGLE, _LENGTH = Quantity("angle"), Quantity("length")
_DH = {"theta": _ANGLE, "d": _LENGTH, "a": _LENGTH, "alpha": _ANGLE, "beta": _ANGLE}


class JointModel(Model):
    """One joint: its DH row and its limits."""

    name: Annotated[
        str | None, Field(min_length=1, description="Unique name; j1, j2, ... when left out.")
    ] = None
    type: Annotated[Literal["revolute", "prismatic"], Field(description="How the joint moves.")] = "revolute"
    theta: Annotated[float, Number(_ANGLE, "Angle about z (angle unit).")] = 0.0
    d: Annotated[float, Number(_LENGTH, "Offset along z (length unit).")] = 0.0
    a: Annotated[float, Number(_LENGTH, "Length along x (length unit).")] = 0.0
    alpha: Annotated[float, Number(_ANGLE, "Angle about x (angle unit).")] = 0.0
    beta: Annotated[
        float,
        Number(_ANGLE, "Angle about y behind alpha, where axes are almost parallel (Hayati; angle unit)."),
    ] = 0.0
    sign: Annotated[Literal[1, -1], Field(description="Direction in which the joint counts.")] = 1
    position: Annotated[LowerUpper, JointBound(0, "Range [lower, upper] (angle or length unit).")] = UNLIMITED
    velocity: Annotated[LowerUpper, JointBound(1, "Velocity limit, or [lower, upper], per s.")] = UNLIMITED
    acceleration: Annotated[LowerUpper, JointBound(2, "Acceleration limit, or [lower, upper], per s^2.")] = (
        UNLIMITED
    )
    jerk: Annotated[LowerUpper, JointBound(3, "Jerk limit, or [lower, upper], per s^3.")] = UNLIMITED

    velocity_by_position: Annotated[
        VelocityByPosition | None,
        Field(
            description="Velocity limit near the position limits: |v| <= max(0, sqrt(2 d x) - o), x before "
            "the limit ahead."
        ),
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _announce_type(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        # the units of the limits depend on the type, which stands beside them
        if isinstance(info.context, ReadingContext) and isinstance(data, dict):
            info.context.joint_types = (str(data.get("type", "revolute")),)
        return data


class _Counted:
    """Lets a number stand for that many bare joints."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.no_info_before_validator_function(self._expand, handler(source))

    @staticmethod
    def _expand(value: Any) -> Any:  # noqa: ANN401
        if isinstance(value, list):
            return value
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse([((), f"expected a list of joints or their number, got {shown(value)}", None)])
        if not 1 <= value <= MAX_JOINTS:
            raise refuse([((), f"expected 1 to {MAX_JOINTS} joints, got {value}", None)])
        return [{} for _ in range(value)]

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [{"type": "integer", "minimum": 1, "maximum": MAX_JOINTS}, handler(schema)]}


class RobotModel(Model):
    """A robot: its joints as a Denavit-Hartenberg table with limits, base and tool."""

    name: Annotated[str, Field(description="For messages and reports.")] = "robot"
    units: Annotated[
        UnitsSpec | None, Field(description="Only in a robot file; inline the job's units hold.")
    ] = None
    source: Annotated[str | None, Field(description="Where the numbers come from.")] = None
    licence: Annotated[str | None, Field(description="Licence of the source.")] = None
    note: Annotated[str | None, Field(description="What a user should know about the numbers.")] = None
    convention: Annotated[
        Literal["standard", "modified"] | None,
        Field(description="Whose DH rows the joints are; modified: a and alpha belong to the link before."),
    ] = None
    joints: Annotated[
        list[JointModel],
        Field(
            min_length=1,
            max_length=MAX_JOINTS,
            description="From the base on; a number: that many bare joints.",
        ),
        _Counted(),
    ]
    base: Annotated[np.ndarray, Pose("T_world_base.")] | None = None
    tool: Annotated[np.ndarray, Pose("T_flange_tcp.")] | None = None

    @model_validator(mode="after")
    def _is_consistent(self) -> RobotModel:
        joints = self.joints
        names: list[str] = []
        for index, name in enumerate(self.joint_names()):
            if name in names:
                where = (
                    ("joints", index, "name") if joints[index].name else ("joints", names.index(name), "name")
                )
                raise refuse([(where, f"joint names must be unique, '{name}' stands twice", None)])
            names.append(name)
        for index, joint in enumerate(joints):
            if joint.velocity_by_position is not None and joint.position == UNLIMITED:
                text = f"velocity_by_position of {names[index]} needs its position limits"
                hint = "give the joint `position: [lower, upper]`"
                raise refuse([(("joints", index, "velocity_by_position"), text, hint)])
        described = [joint for joint in joints if any(key in joint.model_fields_set for key in _DH)]
        if described and self.convention is None:
            text = "joints with theta, d, a, alpha or beta need a `convention`"
            raise refuse([((), text, "say `convention: standard` or `convention: modified`")])
        return self

    def joint_names(self) -> list[str]:
        """Return the names of the joints: j1, j2, ... where none is given."""
        return [joint.name or f"j{number}" for number, joint in enumerate(self.joints, 1)]

    def as_robot(self) -> Robot:
        """Return the robot that this describes."""
        joints = tuple(
            Joint(name, m.type, m.theta, m.d, m.a, m.alpha, m.sign, m.beta)
            for name, m in zip(self.joint_names(), self.joints, strict=True)
        )
        position, *rates = (np.array([getattr(m, quantity) for m in self.joints]) for quantity in QUANTITIES)
        near = [m.velocity_by_position for m in self.joints]
        by_position = np.array([(np.inf, 0.0) if m is None else (m.deceleration, m.offset) for m in near])
        limits = Limits(position, rates[0], rates[1], rates[2], velocity_by_position=by_position)
        base, tool = (np.eye(4) if pose is None else pose for pose in (self.base, self.tool))
        return Robot(self.name, joints, limits, self.convention, base, tool)


def robot_as_mapping(robot: Robot) -> dict[str, Any]:
    """Return a robot as it may stand under `robot` in a job of any units, to be read bit by bit."""
    described = robot.convention is not None
    keys = {"convention": robot.convention} if described else {}
    joints = [_joint_as_mapping(robot, index, described=described) for index in range(len(robot.joints))]
    poses = {key: getattr(robot, key) for key in ("base", "tool")}
    turned = {key: pose for key, pose in poses.items() if not np.array_equal(pose, np.eye(4))}
    written = {key: Pose("").write(pose, ReadingContext()) for key, pose in turned.items()}
    return {"name": robot.name, **keys, "joints": joints, **written}


def _joint_as_mapping(robot: Robot, index: int, *, described: bool) -> dict[str, Any]:
    joint = robot.joints[index]
    keys = [key for key in _DH if key != "beta" or joint.beta] if described else []
    row = {key: written_number(getattr(joint, key), _DH[key]) for key in keys}
    bounds = [robot.limits.of_order(order)[index].tolist() for order in range(len(QUANTITIES))]
    limits = {
        quantity: written_bound((low, high), joint_quantity(joint.type, order))
        for order, (quantity, (low, high)) in enumerate(zip(QUANTITIES, bounds, strict=True))
    }
    rates = robot.limits.velocity_by_position[index].tolist()
    near = {
        name: written_number(value, joint_quantity(joint.type, order))
        for name, order, value in (("deceleration", 2, rates[0]), ("offset", 1, rates[1]))
    }
    by_position = {"velocity_by_position": near} if np.isfinite(rates[0]) else {}
    return {"name": joint.name, "type": joint.type, **row, "sign": joint.sign, **limits, **by_position}


@frozen
class RobotSheet:
    """A robot file: the robot, and what the file says beside it.

    Attributes:
        robot: In SI.
        units: Of the file's plain numbers.
        source: Where the numbers come from; None where the file does not say, as below.
        licence: Of the source.
        note: What a user should know about the numbers.
        text: The file as it stands; None where the robot is that of a job.
    """

    robot: Robot
    units: Units
    source: str | None
    licence: str | None
    note: str | None
    text: str | None


def catalogue_names() -> list[str]:
    """Return the names of the robots that come with trajcli."""
    return sorted(path.stem for path in CATALOGUE.glob("*.yaml"))


def find_robot(value: Any, document: Document, units: Units) -> Robot:  # noqa: ANN401
    """Return the robot that stands under `robot` in a job.

    Args:
        value: A name, {file: PATH} (relative to the job's folder), or the robot itself.
        document: The job's.
        units: The job's, in force for a robot that stands in the job.

    Raises:
        InputError: With every flaw of the robot.
        FileError: When the robot's file cannot be read.
    """
    if isinstance(value, str):
        return _from_catalogue(value, document)
    if isinstance(value, Mapping) and "file" in value:
        return _from_file_entry(value, document)
    if not isinstance(value, Mapping):
        raise InputError(_no_robot(value, document))
    for key in value:
        place = document.place(("robot", key), key=True)
        if key == "units":
            raise InputError(
                Problem("a robot inside a job uses the job's units", "leave `units` out here", place)
            )
        if "joints" not in value and nearest(key, ["file", *RobotModel.model_fields]) == "file":
            raise InputError(Problem(f"unknown key '{key}'", "did you mean 'file'?", place))
    return _validated(value, document, ("robot",), units).as_robot()


def load_robot(name: str | Path) -> Robot:
    """Return a robot of the catalogue by its name, or the robot of a file by its path.

    Raises:
        InputError: When the catalogue has no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    return load_sheet(name).robot


def load_sheet(name: str | Path) -> RobotSheet:
    """Return the sheet of a robot of the catalogue by its name, or of a robot file by its path.

    Raises:
        InputError: When the catalogue has no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    names = catalogue_names()
    if str(name) in names:
        return read_sheet(str(CATALOGUE / f"{name}.yaml"))
    if isinstance(name, Path) or _looks_like_a_path(name):
        return read_sheet(str(name))
    raise InputError(f"the catalogue has no robot '{name}'", hint=_suggestion(name, names))


def read_robot_file(path: str) -> Robot:
    """Return the robot of a robot file, which has its own units.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    return read_sheet(path).robot


def read_sheet(path: str) -> RobotSheet:
    """Return the sheet of a robot file.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    document = read_document(path)
    plain = document.plain()
    spec = plain.get("units") if isinstance(plain.get("units"), Mapping) else {}
    units = Units(
        "deg" if spec.get("angle") == "deg" else "rad",
        "mm" if spec.get("length") == "mm" else "m",
    )
    model = _validated({"name": utf8(Path(path).stem), **plain}, document, (), units)
    text = "\n".join(document.lines)
    return RobotSheet(model.as_robot(), units, model.source, model.licence, model.note, text)


def _no_robot(value: object, document: Document) -> Problem:
    hint = "such as ur5e: `trajcli robots` lists the names of the catalogue"
    if isinstance(value, int) and not isinstance(value, bool):
        hint = f"for {value} bare joints write {{joints: {value}}}"
    message = f"expected a robot's name, {{file: PATH}} or a robot, got {shown(value)}"
    return Problem(message, hint, document.place(("robot",)))


def _from_catalogue(name: str, document: Document) -> Robot:
    names = catalogue_names()
    if name in names:
        return read_robot_file(str(CATALOGUE / f"{name}.yaml"))
    hint = f"a file is named by {{file: {name}}}" if _looks_like_a_path(name) else _suggestion(name, names)
    raise InputError(Problem(f"the catalogue has no robot '{name}'", hint, document.place(("robot",))))


def _looks_like_a_path(name: str) -> bool:
    return "/" in name or "\\" in name or name.endswith((".yaml", ".yml"))


def _suggestion(name: str, names: list[str]) -> str:
    """Return which robots are meant, and how to see all."""
    near = did_you_mean(name, names) or f"its nearest names are {', '.join(nearest_names(name, names))}"
    return f"{near}{'' if near.endswith('?') else ';'} `trajcli robots` lists all {len(names)}"


def _from_file_entry(value: Mapping[str, Any], document: Document) -> Robot:
    extra = [key for key in value if key != "file"]
    if extra:
        place = document.place(("robot", extra[0]), key=True)
        hint = "change the robot under the job's `limits`, or copy its file"
        raise InputError(Problem(f"unknown key '{extra[0]}' beside `file`", hint, place))
    if not isinstance(value["file"], str):
        place = document.place(("robot", "file"))
        raise InputError(Problem(f"expected a path, got {shown(value['file'])}", None, place))
    folder = Path.cwd() if document.file in ("-", "<stdin>") else Path(document.file).parent
    try:
        return read_robot_file(str(folder / value["file"]))
    except FileError as error:
        raise error.located(place=document.place(("robot", "file"))) from None


def _validated(value: Mapping[str, Any], document: Document, at: tuple[str, ...], units: Units) -> RobotModel:
    try:
        return RobotModel.model_validate(value, context=ReadingContext(units))
    except ValidationError as error:
        raise InputError(*problems_of(error, RobotModel, document, at)) from None
