"""Poses that stand in a word of the command line: YAML as in a job, or @FILE for the file that holds it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem
from trajcli.job.document import Document
from trajcli.job.load import parse_document, read_document
from trajcli.planners.poses import Pose
from trajcli.planners.reading import AT_KEY, FlawError, ReadingContext
from trajcli.units import Units

T = TypeVar("T")


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
