"""Links and joints of a file in the Unified Robot Description Format, each element with its place.

Only what a chain needs is interpreted, and only when it is asked for: a flaw in a mesh or in a joint beyond
the tip does no harm. No other file is opened: `package://` stands in meshes alone, which are passed over but
where a picture is made.

Source: the URDF XML specification of urdfdom (https://wiki.ros.org/urdf/XML).
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import NamedTuple
from xml.parsers import expat

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem, utf8
from trajcli.frozen import frozen
from trajcli.language.numbers import LARGEST_POSITION, LARGEST_RATE, flaw_of_name
from trajcli.suggest import did_you_mean, valid_names

MAX_BYTES = 10_000_000
MAX_DEPTH = 100
JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")

_NUMBER = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"[-+]?inf(?:inity)?", re.IGNORECASE)
_QUOTED = 60  # characters of the user's text that a message repeats
_SKIPPED = ("visual", "collision", "gazebo", "transmission", "material", "sensor", "ros2_control")


class Element(NamedTuple):
    """An element of XML: its name, attributes, place and the elements inside."""

    name: str
    attributes: Mapping[str, str]
    line: int
    column: int
    inside: list[Element]

    def first(self, name: str) -> Element | None:
        """Return the first element of a name inside this one; None where there is none."""
        return next((element for element in self.inside if element.name == name), None)


class JointElement(NamedTuple):
    """A joint as the file has it."""

    name: str
    type: str
    parent: str
    child: str
    element: Element

    @property
    def moves(self) -> bool:
        """Whether it is revolute, continuous or prismatic."""
        return self.type in JOINT_TYPES[:3]

    @property
    def mimics(self) -> str | None:
        """Name of the joint that it mimics; None where it moves by itself."""
        mimic = self.element.first("mimic")
        return None if mimic is None else mimic.attributes.get("joint", "another joint")


@frozen
class UrdfDocument:
    """A URDF that was parsed.

    Attributes:
        file: Its path, for messages.
        lines: Its text.
        name: Of the robot.
        links: By name, in the order of the file.
        joints: By name, in the order of the file.
        materials: Those of the whole robot by name, where visuals are asked for.
    """

    file: str
    lines: tuple[str, ...]
    name: str
    links: Mapping[str, Element]
    joints: Mapping[str, JointElement]
    materials: Mapping[str, Element]

    def place(self, element: Element, attribute: str | None = None) -> Place:
        """Return where an element stands, or an attribute of it that is on the same line."""
        return _place(self.file, self.lines, element.line, element.column, element.name, attribute)

    def refused(
        self, message: str, element: Element, attribute: str | None = None, hint: str | None = None
    ) -> InputError:
        """Return the error about an element."""
        return InputError(Problem(message, hint, self.place(element, attribute)))

    def numbers(
        self, element: Element | None, attribute: str, count: int, default: tuple[float, ...]
    ) -> Array:
        """Return the numbers of an attribute, shape (count,); the default where it is absent.

        Raises:
            InputError: When they are not so many finite numbers, or one is larger than any robot needs.
        """
        text = None if element is None else element.attributes.get(attribute)
        if element is None or text is None:
            return np.array(default)
        words = text.split()
        if len(words) != count or not all(map(_NUMBER.fullmatch, words)):
            wanted = "a number" if count == 1 else f"{count} numbers with spaces between"
            got = f'"{text[:_QUOTED]}"' + (f", {len(words)} of them" if len(words) not in (1, count) else "")
            raise self.refused(f"{attribute}: expected {wanted}, got {got}", element, attribute)
        values = np.array(list(map(float, words)))
        if not (np.abs(values) <= LARGEST_POSITION).all():
            wanted = f"expected a magnitude of at most {LARGEST_POSITION:g}"
            raise self.refused(f'{attribute}: {wanted}, got "{text[:_QUOTED]}"', element, attribute)
        return values

    def number(self, element: Element | None, attribute: str) -> float | None:
        """Return the number of an attribute; None where it is absent, infinite where it says so.

        Raises:
            InputError: When it is no number, or larger than any robot needs.
        """
        text = None if element is None else element.attributes.get(attribute)
        if element is None or text is None:
            return None
        if _INFINITE.fullmatch(text.strip()):
            return math.copysign(math.inf, -1.0 if text.strip()[0] == "-" else 1.0)
        if not _NUMBER.fullmatch(text.strip()):
            message = f'{attribute}: expected a number, got "{text[:_QUOTED]}"'
            raise self.refused(message, element, attribute)
        value = float(text)
        if not abs(value) <= LARGEST_RATE:
            message = f'{attribute}: expected a magnitude of at most {LARGEST_RATE:g}, got "{text[:_QUOTED]}"'
            raise self.refused(message, element, attribute)
        return value


def parse_urdf(data: bytes, file: str, *, visuals: bool = False) -> UrdfDocument:
    """Return the links and joints of a URDF.

    Args:
        data: The whole file, of at most `MAX_BYTES`.
        file: Its path, for messages.
        visuals: Whether the visuals of links, and materials, are kept.

    Raises:
        InputError: When it is no XML or no URDF, with line and column: also for a DOCTYPE, xacro that is not
            expanded, more than `MAX_DEPTH` elements in each other, and names that are missing or stand twice.
    """
    if len(data) > MAX_BYTES:
        message = f"the file is {len(data) / 1e6:.1f} MB long; at most {MAX_BYTES / 1e6:g} MB are read"
        raise InputError(Problem(message, place=Place(file, 1, 1)))
    data = data.removeprefix(codecs.BOM_UTF8)  # a column of the first line for expat
    blank = len(data) - len(data.lstrip(b" \t\r\n"))  # some files begin with an empty line
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    lines = tuple(data.decode("utf-16" if wide else "utf-8", "replace").splitlines())
    skipped = [name for name in _SKIPPED if not visuals or name not in ("visual", "material")]
    root = _Builder(file, lines, data[:blank].count(b"\n"), skipped).parse(data[blank:])
    stem = utf8(PurePath(file).stem)
    empty = UrdfDocument(file, lines, root.attributes.get("name") or stem, {}, {}, {})
    if root.name != "robot":
        raise empty.refused(f"expected <robot>, got <{root.name}>: this is no URDF", root)
    links: dict[str, Element] = {}
    joints: dict[str, JointElement] = {}
    for element in root.inside:
        if element.name == "link":
            links[_unique_name(empty, element, links)] = element
        elif element.name == "joint":
            name = _unique_name(empty, element, joints)
            joints[name] = JointElement(name, *_joint_words(empty, element, name), element)
    _check_links(empty, links, joints)
    materials = {item.attributes.get("name", ""): item for item in root.inside if item.name == "material"}
    return UrdfDocument(file, lines, empty.name, links, joints, materials)


def _unique_name(document: UrdfDocument, element: Element, taken: Mapping[str, object]) -> str:
    name = element.attributes.get("name", "")
    if not name.strip():
        raise document.refused(f"a <{element.name}> has no name", element, "name")
    flaw = flaw_of_name(name)
    if flaw is not None:
        raise document.refused(flaw, element, "name")
    if name in taken:
        raise document.refused(f"the name of {element.name} '{name}' stands twice", element, "name")
    return name


def _joint_words(document: UrdfDocument, element: Element, name: str) -> tuple[str, str, str]:
    """Return type, parent and child of a joint."""
    ends = []
    for role in ("parent", "child"):
        inside = element.first(role)
        link = None if inside is None else inside.attributes.get("link")
        if not link:
            raise document.refused(f"joint '{name}' has no <{role} link=\"...\">", inside or element)
        ends.append(link)
    return element.attributes.get("type", ""), ends[0], ends[1]


def _check_links(
    document: UrdfDocument, links: Mapping[str, Element], joints: Mapping[str, JointElement]
) -> None:
    """Refuse joints of links that do not exist, and links behind two joints."""
    if not links:
        first = Element("robot", {}, 1, 1, [])
        raise document.refused("the robot has no links", first, hint=_expanding(document.file))
    above: dict[str, str] = {}
    for joint in joints.values():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                hint = did_you_mean(link, links) or valid_names(links, "links")
                inside = joint.element.first(role) or joint.element
                message = f"joint '{joint.name}' has the {role} '{link}', and there is no such link"
                raise document.refused(message, inside, "link", hint)
        if joint.child in above:
            message = f"link '{joint.child}' is the child of '{above[joint.child]}' and of '{joint.name}'"
            hint = "trajcli plans for open chains: leave one of the joints out"
            raise document.refused(message, joint.element, hint=hint)
        above[joint.child] = joint.name


class _Builder:
    """Handlers of expat that build the elements of links and joints."""

    def __init__(
        self, file: str, lines: tuple[str, ...], skipped_lines: int, left_out: Sequence[str]
    ) -> None:
        self._file, self._lines, self._skipped, self._left_out = file, lines, skipped_lines, left_out
        self._open: list[Element | None] = []
        self._root: Element | None = None
        self._parser = expat.ParserCreate()  # without namespaces: prefixes that are not declared do no harm

    def parse(self, data: bytes) -> Element:
        """Return the outermost element."""
        parser = self._parser
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.StartDoctypeDeclHandler = self._doctype
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            late = "declaration not at start" in reason
            hint = "`<?xml ...?>` must be the very first of a file: move it there" if late else None
            column = error.offset + 1
            at = _place(self._file, self._lines, error.lineno + self._skipped, column)
            raise InputError(Problem(f"the file is no XML: {reason}", hint, at)) from None
        except (ValueError, LookupError) as error:  # an encoding that expat does not know
            at = Place(self._file, 1, 1, self._lines[0] if self._lines else "")
            raise InputError(
                Problem(f"the file cannot be decoded: {error}", "save it as UTF-8", at)
            ) from None
        if self._root is None:  # expat refuses an empty file itself
            raise InputError(Problem("the file is empty", place=Place(self._file, 1, 1)))
        return self._root

    def _here(self, name: str = "", attribute: str | None = None) -> Place:
        line = self._parser.CurrentLineNumber + self._skipped
        return _place(self._file, self._lines, line, self._parser.CurrentColumnNumber + 1, name, attribute)

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= MAX_DEPTH:
            message = f"more than {MAX_DEPTH} elements stand in each other"
            raise InputError(Problem(message, place=self._here(name)))
        self._refuse_xacro(name, attributes)
        line = self._parser.CurrentLineNumber + self._skipped
        element = Element(name, attributes, line, self._parser.CurrentColumnNumber + 1, [])
        above = self._open[-1] if self._open else None
        if not self._open:
            self._root = element
        elif above is None or name in self._left_out:
            self._open.append(None)
            return
        else:
            above.inside.append(element)
        self._open.append(element)

    def _end(self, name: str) -> None:
        self._open.pop()

    def _refuse_xacro(self, name: str, attributes: Mapping[str, str]) -> None:
        hint = _expanding(self._file)
        if name.startswith("xacro:"):
            message = f"<{name}> is xacro, a language of macros that must be expanded first"
            raise InputError(Problem(message, hint, self._here(name)))
        for key, text in attributes.items():
            if "${" in text or ("$(" in text and key != "filename"):
                message = (
                    f'{key}="{text[:_QUOTED]}" is xacro, a language of macros that must be expanded first'
                )
                raise InputError(Problem(message, hint, self._here(name, key)))

    def _doctype(self, *_: object) -> None:
        hint = "a URDF needs none: remove the line"
        message = "a DOCTYPE is refused: it can make a small file unpack to a huge one, or name other files"
        raise InputError(Problem(message, hint, self._here()))


def _expanding(file: str) -> str:
    """Return the hint how xacro is expanded."""
    stem = PurePath(file).name.removesuffix(".xacro").removesuffix(".urdf").removesuffix(".xml")
    source = file if file.endswith(".xacro") else f"{stem}.urdf.xacro"
    return f"if it is xacro, expand it: xacro {source} > {stem}.urdf"


def _place(
    file: str, lines: tuple[str, ...], line: int, column: int, name: str = "", attribute: str | None = None
) -> Place:
    """Return the place of an element's name, or of its attribute where that is on the same line."""
    source = lines[line - 1] if 0 < line <= len(lines) else ""
    if attribute is not None:
        match = re.compile(rf"\b{re.escape(attribute)}\s*=\s*(\"[^\"]*\"|'[^']*'|)").search(source, column)
        if match:
            return Place(file, line, match.start() + 1, source, match.end() - match.start())
    return Place(file, line, column, source, max(len(name) + 1, 1))
