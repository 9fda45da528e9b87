"""Inline values on the command line: numbers, poses and payloads, as YAML or as @FILE."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeVar

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem
from trajcli.job.messages import validated
from trajcli.job.yaml.document import Document
from trajcli.job.yaml.load import parse_document, read_document
from trajcli.kinematics.robot import Payload, Robot
from trajcli.language.dynamics import PayloadSpec
from trajcli.language.numbers import AT_KEY, FlawError, ReadingContext, within_bounds
from trajcli.language.poses import Pose
from trajcli.language.targets import AskedPose
from trajcli.units import (
    Quantity,
    UnitError,
    Units,
    factor,
    parse_quantity,
    unit_name,
)

T = TypeVar("T")
_NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")


def inline_number(word: str, name: str, quantity: Quantity, units: Units) -> float:
    """Return a plain number in the given units, or one with its own unit such as "90deg", in SI.

    Raises:
        InputError: When the word is no such number, or it is too large.
    """
    unit = unit_name(quantity, units)
    if _NUMBER.fullmatch(word):
        return _bounded(float(word) * factor(quantity, units), word, name, quantity, units)
    try:
        return _bounded(parse_quantity(word, quantity), word, name, quantity, units)
    except UnitError as error:
        raise InputError(
            f"{name}: expected a number{f' ({unit})' if unit else ''}, got {word[:40]}", hint=str(error)
        ) from None


def _bounded(number: float, word: str, name: str, quantity: Quantity, units: Units) -> float:
    try:
        return within_bounds(number, word, quantity, units)
    except FlawError as error:
        raise InputError(f"{name}: {error}", hint=error.flaws[0][2]) from None


def inline_document(word: str, name: str) -> Document:
    """Return the mapping that a word holds, or the file that it names as @FILE.

    Args:
        word: Such as "{xyz: [0, 0, 0.1]}" or "@tool.yaml".
        name: What the word is called in messages, such as "--tool".

    Raises:
        InputError: With every problem of the text, each with its place.
        FileError: When the file cannot be read.
    """
    return read_document(word[1:]) if word.startswith("@") else parse_document(word, name)


def inline_pose(word: str, name: str, units: Units) -> Array:
    """Return the pose that a word describes, shape (4, 4), lengths in m; what it leaves out is zero.

    Args:
        word: YAML, or @FILE.
        name: What the word is called in messages.
        units: Of plain numbers.

    Raises:
        InputError: When it is no pose.
        FileError: When the file cannot be read.
    """
    document = inline_document(word, name)
    return read_at(document, units, Pose(name).read)


def inline_target(word: str, units: Units, robot: Robot) -> AskedPose:
    """Return the target that the word behind --pose describes; what it leaves out is free.

    Args:
        word: YAML, or @FILE.
        units: Of plain numbers.
        robot: Whose joints may be pinned.

    Raises:
        InputError: When it is no pose, or says nothing.
        FileError: When the file cannot be read.
    """
    document = inline_document(word, "--pose")
    context = ReadingContext(units, robot.joint_names, robot.joint_types)
    target = validated(AskedPose, document.plain(), document, context)
    if not target.gives_pose:
        hint = "give a position, an orientation or both, such as {xyz: [0.4, 0, 0.3], rpy: [0, 0, 0]}"
        raise InputError(Problem("the target fixes nothing", hint, document.place(())))
    return target


def inline_payload(word: str, units: Units) -> Payload:
    """Return the payload that the word behind --payload describes.

    Args:
        word: As under `attach` in a job, or @FILE.
        units: Of plain numbers; its mass and inertia are in kg and kg m^2 in any.

    Raises:
        InputError: When it is no payload, or one that no solid has.
        FileError: When the file cannot be read.
    """
    document = inline_document(word, "--payload")
    return validated(PayloadSpec, document.plain(), document, ReadingContext(units)).as_payload()


def read_at(document: Document, units: Units, read: Callable[[Any, ReadingContext], T]) -> T:
    """Return what `read` makes of the plain content of a document.

    Raises:
        InputError: With the place of every flaw that `read` raises.
    """
    try:
        return read(document.plain(), ReadingContext(units))
    except FlawError as error:
        raise InputError(*(_placed(document, *flaw) for flaw in error.flaws)) from None


def _placed(document: Document, path: tuple[str | int, ...], message: str, hint: str | None) -> Problem:
    at_key = path[-1:] == (AT_KEY,)
    return Problem(message, hint, document.place(path[:-1] if at_key else path, key=at_key))
