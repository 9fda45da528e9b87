"""Where a job's robot comes from: the catalogue, a robot file, or the job itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from trajcli.errors import FileError, InputError, Problem
from trajcli.frozen import frozen
from trajcli.job.load import Document, read_document
from trajcli.job.messages import problems_of
from trajcli.job.robot_model import RobotModel
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import ReadingContext, shown
from trajcli.suggest import did_you_mean, nearest, valid_names
from trajcli.units import Units

CATALOGUE = Path(__file__).parent.parent / "catalogue"


@frozen
class RobotSheet:
    """A robot file: the robot, and what the file says beside it.

    Attributes:
        robot: In SI.
        units: Of the file's plain numbers.
        source: Where the numbers come from; None where the file does not say, as below.
        licence: Of the source.
        note: What a user should know about the numbers.
        text: The file as it stands.
    """

    robot: Robot
    units: Units
    source: str | None
    licence: str | None
    note: str | None
    text: str


def catalogue_names() -> list[str]:
    """Return the names of the robots that come with trajcli."""
    return sorted(path.stem for path in CATALOGUE.glob("*.yaml"))


def find_robot(value: Any, document: Document, units: Units) -> Robot:  # noqa: ANN401
    """Return the robot that stands under `robot` in a job.

    Args:
        value: A name, {file: PATH} (relative to the job's folder), or the robot itself.
        document: The job's, for places.
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
    model = _validated({"name": Path(path).stem, **plain}, document, (), units)
    text = "\n".join(document.lines)
    return RobotSheet(model.as_robot(), units, model.source, model.licence, model.note, text)


def _no_robot(value: object, document: Document) -> Problem:
    hint = f"the catalogue has {', '.join(catalogue_names())}"
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


def _suggestion(name: str, names: list[str]) -> str | None:
    return did_you_mean(name, names) or valid_names(names, "its robots")


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
