"""Robots of jobs: the model of a robot in a file, the catalogue, and the robot that a job names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

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

from trajcli.errors import FileError, InputError, Place, Problem, utf8
from trajcli.frozen import frozen
from trajcli.job.model import UnitsSpec
from trajcli.job.yaml.document import STDIN, read_bytes
from trajcli.job.yaml.load import Document, parse_document
from trajcli.kinematics.robot import QUANTITIES, Joint, Limits, Robot
from trajcli.language.dynamics import FrictionSpec, LinkSpec
from trajcli.language.limits import EffortBound, JointBound, VelocityByPosition
from trajcli.language.numbers import (
    MAX_JOINTS,
    NO_TRUTH,
    Model,
    Name,
    Number,
    ReadingContext,
    refuse,
    shown,
)
from trajcli.language.per_joint import UNLIMITED, LowerUpper
from trajcli.language.poses import Pose
from trajcli.units import Quantity, Units, units_of

if TYPE_CHECKING:
    from trajcli.urdf.serial_robot import UrdfRobot

M = TypeVar("M", bound=Model)

_URDF_ENDINGS = (".urdf", ".xacro", ".xml")
_ANGLE, _LENGTH = Quantity("angle"), Quantity("length")
_TYPES = ("revolute", "prismatic")
DH_ROW = {"theta": _ANGLE, "d": _LENGTH, "a": _LENGTH, "alpha": _ANGLE, "beta": _ANGLE}


class JointModel(Model):
    """One joint: its DH row and its limits."""

    name: Annotated[str, Name("Unique name; j1, j2, ... when left out.")] | None = None
    type: Annotated[Literal["revolute", "prismatic"], Field(description="How the joint moves.")] = "revolute"
    theta: Annotated[float, Number(_ANGLE, "Angle about z (angle unit).")] = 0.0
    d: Annotated[float, Number(_LENGTH, "Offset along z (length unit).")] = 0.0
    a: Annotated[float, Number(_LENGTH, "Length along x (length unit).")] = 0.0
    alpha: Annotated[float, Number(_ANGLE, "Angle about x (angle unit).")] = 0.0
    beta: Annotated[
        float,
        Number(_ANGLE, "Angle about y behind alpha, where axes are almost parallel (Hayati; angle unit)."),
    ] = 0.0
    sign: Annotated[Literal[1, -1], NO_TRUTH, Field(description="Direction in which the joint counts.")] = 1
    position: Annotated[LowerUpper, JointBound(0, "Range [lower, upper] (angle or length unit).")] = UNLIMITED
    velocity: Annotated[LowerUpper, JointBound(1, "Velocity limit, or [lower, upper], per s.")] = UNLIMITED
    acceleration: Annotated[LowerUpper, JointBound(2, "Acceleration limit, or [lower, upper], per s^2.")] = (
        UNLIMITED
    )
    jerk: Annotated[LowerUpper, JointBound(3, "Jerk limit, or [lower, upper], per s^3.")] = UNLIMITED
    effort: Annotated[LowerUpper, EffortBound("Torque or force limit, or [lower, upper], N m or N.")] = (
        UNLIMITED
    )
    friction: Annotated[FrictionSpec, Field(description="Friction of the joint.")] = FrictionSpec()
    rotor: Annotated[
        float,
        Number(
            Quantity("inertia"),
            "Motor's inertia reflected to the joint, kg m^2 (kg for a slide).",
            at_least=0.0,
        ),
    ] = 0.0
    link: Annotated[LinkSpec | None, Field(description="Mass and inertia of the link behind the joint.")] = (
        None
    )

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
        # the units of the limits depend on the type, which stands beside them, perhaps mistyped
        if isinstance(info.context, ReadingContext) and isinstance(data, dict):
            given = data.get("type", _TYPES[0])
            if given not in _TYPES or not data.keys() <= cls.model_fields.keys():
                from trajcli.suggest import meant_word

                given = meant_word(data, "type", cls.model_fields, _TYPES)
            info.context.joint_types = (given,)
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

    name: Annotated[str, Name("For messages and reports.")] = "robot"
    units: Annotated[
        UnitsSpec | None, Field(description="Only in a robot file; inline the job's units hold.")
    ] = None
    source: Annotated[str | None, Field(description="Where the numbers come from.")] = None
    licence: Annotated[str | None, Field(description="Licence of the source.")] = None
    note: Annotated[str | None, Field(description="What a user should know about the numbers.")] = None
    maker: Annotated[str | None, Field(description="Who builds the robot.")] = None
    origin: Annotated[
        Literal["real", "textbook"] | None,
        Field(description="A robot that is built, or an example of a text."),
    ] = None
    date: Annotated[str | None, Field(description="When the source was read, such as 2026-11.")] = None
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
            if joint.velocity_by_position is not None and not np.isfinite(joint.position).all():
                text = f"velocity_by_position of {names[index]} needs its position limits"
                hint = "give the joint `position: [lower, upper]`"
                raise refuse([(("joints", index, "velocity_by_position"), text, hint)])
        described = [joint for joint in joints if any(key in joint.model_fields_set for key in DH_ROW)]
        if described and self.convention is None:
            text = "joints with theta, d, a, alpha or beta need a `convention`"
            raise refuse([((), text, "say `convention: standard` or `convention: modified`")])
        return self

    def joint_names(self) -> list[str]:
        """Return the names of the joints: j1, j2, ... where none is given."""
        return [joint.name or f"j{number}" for number, joint in enumerate(self.joints, 1)]

    def as_robot(self, *, efforts: bool = True) -> Robot:
        """Return the robot that this describes.

        Args:
            efforts: Whether its efforts are in force; they are where all links have their inertia.
        """
        joints = tuple(
            Joint(
                name,
                m.type,
                m.theta,
                m.d,
                m.a,
                m.alpha,
                m.sign,
                m.beta,
                m.effort,
                m.friction.as_friction(),
                m.rotor,
                None if m.link is None else m.link.as_inertia(),
            )
            for name, m in zip(self.joint_names(), self.joints, strict=True)
        )
        position, *rates = (np.array([getattr(m, quantity) for m in self.joints]) for quantity in QUANTITIES)
        near = [m.velocity_by_position for m in self.joints]
        by_position = np.array([(np.inf, 0.0) if m is None else (m.deceleration, m.offset) for m in near])
        judged = efforts and self.convention is not None and all(m.link is not None for m in self.joints)
        effort = np.array([m.effort if judged else UNLIMITED for m in self.joints])
        limits = Limits(
            position, rates[0], rates[1], rates[2], velocity_by_position=by_position, effort=effort
        )
        base, tool = (np.eye(4) if pose is None else pose for pose in (self.base, self.tool))
        return Robot(self.name, joints, limits, self.convention, base, tool)


@frozen
class RobotSheet:
    """A robot file: the robot, and what the file says beside it.

    Attributes:
        robot: In SI.
        units: Of the file's plain numbers.
        source: Where the numbers come from; None where the file does not say, as below.
        licence: Of the source.
        note: What a user should know about the numbers.
        text: The file as it stands; None where the robot is that of a job, or of a URDF.
        maker: Who builds the robot.
        origin: Whether it is built (real) or stands in a text (textbook).
        date: When the source was read.
        concessions: What was taken for granted in reading it, as events: kind and message.
    """

    robot: Robot
    units: Units
    source: str | None
    licence: str | None
    note: str | None
    text: str | None
    maker: str | None = None
    origin: str | None = None
    date: str | None = None
    concessions: tuple[tuple[str, str], ...] = ()


def find_sheet(value: Any, document: Document, units: Units) -> RobotSheet:  # noqa: ANN401
    """Return the sheet of the robot that stands under `robot` in a job.

    Args:
        value: A name, {file: PATH} or {urdf: PATH} (relative to the job's folder), or the robot itself.
        document: The job's.
        units: The job's, in force for a robot that stands in the job.

    Raises:
        InputError: With every flaw of the robot.
        FileError: When the robot's file cannot be read.
    """
    if isinstance(value, str):
        return _from_catalogue(value, document)
    if isinstance(value, Mapping) and not value.keys().isdisjoint(("file", "urdf", "rail", "arm")):
        return _from_entry(value, document, units)
    if not isinstance(value, Mapping):
        from trajcli.job.messages import no_robot

        raise InputError(no_robot(value, document))
    if "joints" not in value:
        _check_not_of_catalogue(value, document)
    for key in value:
        place = document.place(("robot", key), key=True)
        if key == "units":
            raise InputError(
                Problem("a robot inside a job uses the job's units", "leave `units` out here", place)
            )
        if "joints" not in value:
            from trajcli.suggest import nearest

            near = nearest(key, ["file", "urdf", *RobotModel.model_fields])
            if near in ("file", "urdf"):
                raise InputError(Problem(f"unknown key '{key}'", f"did you mean '{near}'?", place))
    robot = _validated(value, document, ("robot",), units, RobotModel).as_robot()
    return RobotSheet(robot, units, None, None, None, None)


def _check_not_of_catalogue(value: Mapping[str, Any], document: Document) -> None:
    """Refuse the name of a robot of the catalogue with anything beside it."""
    from trajcli.catalogue.entries import catalogue_names

    if value.get("name") in catalogue_names():
        from trajcli.job.messages import named_with_more

        raise InputError(named_with_more(value, document))


def _from_entry(value: Mapping[str, Any], document: Document, units: Units) -> RobotSheet:
    """Return the sheet of a robot that stands in a file, or on a rail."""
    if "file" in value or "urdf" in value:
        return (_from_file_entry if "file" in value else _from_urdf_entry)(value, document)
    from trajcli.job.files.rail import RobotOnRail, arm_on_rail, document_of_arm

    model = _validated(value, document, ("robot",), units, RobotOnRail)
    sheet = find_sheet(model.arm, document_of_arm(document), units)
    try:
        return replace(sheet, robot=arm_on_rail(model, sheet.robot), text=None)
    except InputError as error:
        raise error.located(place=document.place(("robot", "rail"))) from None


def load_robot(name: str | Path) -> Robot:
    """Return a robot of the catalogue by its name, or the robot of a robot file or a URDF by its path.

    Raises:
        InputError: When the catalogue has no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    return load_sheet(name).robot


def load_sheet(name: str | Path) -> RobotSheet:
    """Return the sheet of a robot of the catalogue by its name, or of a robot file or a URDF by its path.

    Raises:
        InputError: When the catalogue has no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    from trajcli.catalogue.entries import catalogue_names, nearest_robots

    if str(name) in catalogue_names():
        return _sheet_of_catalogue(str(name))
    if isinstance(name, Path) or _looks_like_a_path(name) or is_urdf(name):
        return read_sheet(str(name))
    raise InputError(f"the catalogue has no robot '{name}'", hint=nearest_robots(name))


def is_urdf(path: str | Path) -> bool:
    """Return whether the name of a file ends as that of a URDF, or of XML."""
    return str(path).lower().endswith(_URDF_ENDINGS)


def read_urdf(
    path: str,
    *,
    root: str | None = None,
    tip: str | None = None,
    exact: bool = False,
    soft: bool = False,
) -> UrdfRobot:
    """Return the robot of a URDF, with what was decided in reading it; see `robot_of_urdf`.

    Raises:
        InputError: When the file is no URDF, or has no such chain.
        FileError: When it cannot be read.
    """
    from trajcli.urdf.read import MAX_BYTES

    name = STDIN if path == "-" else path
    read = _robot_of_urdf(read_bytes(path, MAX_BYTES), name, root, tip, exact, soft)
    return replace(read, robot=replace(read.robot))


@lru_cache(maxsize=64)
def _robot_of_urdf(
    content: bytes, name: str, root: str | None, tip: str | None, exact: bool, soft: bool
) -> UrdfRobot:
    """Return the robot of a URDF's content: many jobs of one process convert it once."""
    from trajcli.urdf.serial_robot import robot_of_urdf

    return robot_of_urdf(content, name, root=root, tip=tip, exact=exact, soft=soft)


def urdf_sheet(path: str, read: UrdfRobot) -> RobotSheet:
    """Return the sheet of a robot that was read from a URDF."""
    note = "; ".join(read.remarks)
    events = {"root_chosen": read.choice, "angles_snapped": read.snapping}
    conceded = tuple((kind, message) for kind, message in events.items() if message is not None)
    return RobotSheet(read.robot, Units(), utf8(Path(path).name), None, note, None, concessions=conceded)


def read_sheet(path: str) -> RobotSheet:
    """Return the sheet of a robot file, or of a URDF.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    if is_urdf(path):
        try:
            return urdf_sheet(path, read_urdf(path))
        except InputError as error:
            raise error.located(place=Place(path, 1, 1)) from None
    sheet = _sheet_of(read_bytes(path), STDIN if path == "-" else path, own_efforts=True)
    return replace(sheet, robot=replace(sheet.robot))  # of its own: a robot keeps what was computed of it


@lru_cache(maxsize=256)
def _sheet_of(content: bytes, path: str, *, own_efforts: bool) -> RobotSheet:
    """Return the sheet of a robot file's content: many jobs of one process read it once."""
    document = parse_document(content, path)
    plain = document.plain()
    units = units_of(plain.get("units"))
    model = _validated({"name": utf8(Path(path).stem), **plain}, document, (), units, RobotModel)
    text, conceded = "\n".join(document.lines), tuple[tuple[str, str], ...]()
    if "matrix" in text:
        from trajcli.job.messages import matrices_off_rotation

        conceded = tuple(
            (event.kind, f"{path}: {event.message}") for event in matrices_off_rotation(document)
        )
    said = (model.source, model.licence, model.note, text, model.maker, model.origin, model.date)
    # numbers that nobody has looked at count where a job asks for them
    own_efforts = own_efforts and not is_urdf(model.source or "")
    return RobotSheet(model.as_robot(efforts=own_efforts), units, *said, conceded)


def _from_urdf_entry(value: Mapping[str, Any], document: Document) -> RobotSheet:
    kinds: dict[str, tuple[type, str]] = {
        "urdf": (str, "a path"),
        "root": (str, "the name of a link"),
        "tip": (str, "the name of a link"),
        "exact": (bool, "true or false"),
    }
    for key, given in value.items():
        if key not in kinds:
            from trajcli.suggest import did_you_mean

            hint = did_you_mean(key, kinds) or "beside `urdf` stand root, tip and exact"
            place = document.place(("robot", key), key=True)
            raise InputError(Problem(f"unknown key '{key}' beside `urdf`", hint, place))
        kind, wanted = kinds[key]
        if not isinstance(given, kind):
            place = document.place(("robot", key))
            raise InputError(Problem(f"expected {wanted}, got {shown(given)}", None, place))
    path = str(Path(document.file).parent / value["urdf"])
    try:
        return urdf_sheet(path, read_urdf(path, **{key: value[key] for key in value if key != "urdf"}))
    except FileError as error:
        raise error.located(place=document.place(("robot", "urdf"))) from None
    except InputError as error:
        fields = [problem.field for problem in error.problems if problem.field is not None]
        raise error.located(place=document.place(("robot", *(fields[0] if fields else ("urdf",))))) from None


def _sheet_of_catalogue(name: str) -> RobotSheet:
    """Return the sheet of a robot of the catalogue, whose efforts nobody has looked at."""
    from trajcli.catalogue.entries import robot_file

    sheet = _sheet_of(robot_file(name).encode(), f"{name}.yaml", own_efforts=False)
    return replace(sheet, robot=replace(sheet.robot))


def _from_catalogue(name: str, document: Document) -> RobotSheet:
    from trajcli.catalogue.entries import catalogue_names, nearest_robots

    if name in catalogue_names():
        return _sheet_of_catalogue(name)
    hint = f"a file is named by {{file: {name}}}" if _looks_like_a_path(name) else nearest_robots(name)
    hint = f"a URDF is named by {{urdf: {name}}}" if is_urdf(name) else hint
    raise InputError(Problem(f"the catalogue has no robot '{name}'", hint, document.place(("robot",))))


def _looks_like_a_path(name: str) -> bool:
    return "/" in name or "\\" in name or name.endswith((".yaml", ".yml"))


def _from_file_entry(value: Mapping[str, Any], document: Document) -> RobotSheet:
    extra = [key for key in value if key != "file"]
    if extra:
        place = document.place(("robot", extra[0]), key=True)
        hint = "change the robot under the job's `limits`, or copy its file"
        raise InputError(Problem(f"unknown key '{extra[0]}' beside `file`", hint, place))
    if not isinstance(value["file"], str):
        place = document.place(("robot", "file"))
        raise InputError(Problem(f"expected a path, got {shown(value['file'])}", None, place))
    try:
        return read_sheet(str(Path(document.file).parent / value["file"]))
    except FileError as error:
        raise error.located(place=document.place(("robot", "file"))) from None


def _validated(
    value: Mapping[str, Any], document: Document, at: tuple[str, ...], units: Units, kind: type[M]
) -> M:
    try:
        return kind.model_validate(value, context=ReadingContext(units))
    except ValidationError as error:
        from trajcli.job.messages import problems_of

        raise InputError(*problems_of(error, kind, document, at)) from None
