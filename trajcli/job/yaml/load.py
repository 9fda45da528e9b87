"""Strict reading of YAML 1.2, with the place of every value.

Refused is what makes a file mean something else than it seems to say: duplicate keys, anchors, tags, merge
keys, several documents, NaN and infinity; and what no job needs: deep nesting. All problems of a file are
reported at once. Plain scalars mean what the core schema of YAML 1.2 says.

Source: YAML 1.2.2 specification, section 10.3.2 (tag resolution of the core schema).
"""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, Any

import yaml
from yaml.events import (
    AliasEvent,
    MappingEndEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)
from yaml.scanner import ScannerError

from trajcli.errors import InputError, Problem
from trajcli.job.yaml.document import (
    STDIN,
    Document,
    Node,
    check_characters,
    decode,
    place,
    read_bytes,
    split_lines,
    tab_problem,
)

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["MAX_DEPTH", "Document", "Node", "parse_document", "read_document"]

MAX_DEPTH = 32

_CUT_BY_COMMA = re.compile(r"[:\[,]\s*([-+]?\d+),$")
_MARKER = re.compile(r"[&*!][^\s,\[\]{}]*")
_REPEATED = "put what is used twice under `points`, and name it there"

_START = Node(None, 1, 1, 1)

Scalar = bool | int | float | str | None

_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_FIRST_OF_NUMBERS = frozenset("0123456789+-.")
_is_decimal = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?").fullmatch
_RADIX = re.compile(r"0(?:o[0-7]+|x[0-9a-fA-F]+)")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_QUOTED = 40  # characters of a number that a message repeats
_LARGEST = sys.float_info.max


class _PureLoader(yaml.SafeLoader):
    """The parser in Python, which takes tabs between tokens and refuses escapes as libyaml does."""

    def scan_to_next_token(self) -> None:
        super().scan_to_next_token()
        while self.peek() == "\t":
            self.forward()
            super().scan_to_next_token()

    def scan_flow_scalar_non_spaces(self, double: bool, start_mark: Any) -> Any:  # noqa: ANN401
        try:
            chunks = super().scan_flow_scalar_non_spaces(double, start_mark)
            "".join(chunks).encode()
        except (ValueError, OverflowError):  # beyond Unicode, or half of a surrogate pair
            raise ScannerError("in a quoted scalar", start_mark, "unknown escape", self.get_mark()) from None
        return chunks


_Loader: Any = getattr(yaml, "CSafeLoader", _PureLoader)


class _TooDeepError(Exception):
    """Ends the walk."""


def read_document(path: str, *, any_root: bool = False) -> Document:
    """Return the document of a YAML file; `-` is standard input.

    Args:
        path: Of the file.
        any_root: Whether the whole may be something else than a mapping.

    Raises:
        InputError: With every problem of the file, each with its place.
        FileError: When it is missing or cannot be read.
    """
    return parse_document(read_bytes(path), STDIN if path == "-" else path, any_root=any_root)


def parse_document(data: bytes | str, file: str, *, any_root: bool = False) -> Document:
    """Return the document of a YAML text.

    Args:
        data: The text.
        file: Its name in messages.
        any_root: Whether the whole may be something else than a mapping.

    Raises:
        InputError: With every problem of the text, each with its place.
    """
    text = decode(data if isinstance(data, bytes) else data.encode("utf-8", "surrogatepass"), file)
    lines = split_lines(text)
    check_characters(text, file, lines)
    walk = _Walk(text, file, lines)
    root = walk.document()
    if root is not None and not (any_root or walk.problems):
        walk.check_root(root)
    if root is None or walk.problems:
        raise InputError(*sorted(walk.problems, key=_position))
    return Document(file, lines, root)


def _position(problem: Problem) -> tuple[int, int]:
    return (problem.place.line, problem.place.column) if problem.place else (0, 0)


class _Walk:
    """One pass over the events of a text: its nodes, and every problem."""

    def __init__(self, text: str, file: str, lines: tuple[str, ...]) -> None:
        self.text, self.file, self.lines = text, file, lines
        self.problems: list[Problem] = []
        self.next: Callable[[], Any] = _Loader(text).get_event

    def document(self) -> Node | None:
        """Return the root; None, with a problem, when there is none or its end was not reached."""
        tabs = tab_problem(self.file, self.lines) if "\t" in self.text else None
        if tabs is not None:
            self.problems.append(tabs)
        try:
            return self._only_document()
        except _TooDeepError:
            pass
        except yaml.YAMLError as error:
            if tabs is None:  # else they are the cause, or as likely as any other
                from trajcli.job.yaml.syntax import syntax_problem

                self.problems.append(syntax_problem(error, self.file, self.lines))
        return None

    def check_root(self, root: Node) -> None:
        """Report a root that is no mapping."""
        if isinstance(root.value, dict):
            return
        kind = "a list" if isinstance(root.value, list) else f"the single value {root.text[:40]}"
        text = root.value if isinstance(root.value, str) else ""
        hint = "write a space after each colon" if ":" in text else None
        if self.file.endswith((".csv", ".txt")) and "," in text:
            hint = "rows are judged by `trajcli check`, and drawn by `trajcli plot`"
        self._report(f"expected a mapping (lines of `key: value`), got {kind}", root, hint)

    def _only_document(self) -> Node | None:
        self.next()  # the start of the stream
        event = self.next()
        if isinstance(event, StreamEndEvent):
            self._report("the file is empty" + " but for comments" * bool(self.text.strip()), _START)
            return None
        if event.tags or event.version not in (None, (1, 2)):
            self._report(
                "directives are not read: files are YAML 1.2", self._marked(event), "remove this line"
            )
        root = self._node(self.next(), 1)
        self.next()  # the end of the document
        event = self.next()
        if not isinstance(event, StreamEndEvent):
            hint = "keep one document a file"
            self._report("a second document begins here, expected one", self._marked(event), hint)
        elif root.value is None and not root.text:
            self._report("the document is empty", root)
        return root

    def _node(self, event: Any, depth: int) -> Node:  # noqa: ANN401
        """Return the node that begins with `event`."""
        kind = type(event)
        if kind is ScalarEvent:
            return self._scalar(event)
        if kind is AliasEvent:
            return self._refuse_marker(event)
        if depth > MAX_DEPTH:
            self._report(f"nested more than {MAX_DEPTH} deep", self._marked(event))
            raise _TooDeepError
        if event.anchor is not None or event.tag is not None:
            self._refuse_marker(event)
        return self._sequence(event, depth) if kind is SequenceStartEvent else self._mapping(event, depth)

    def _scalar(self, event: Any) -> Node:  # noqa: ANN401
        start, end, text = event.start_mark, event.end_mark, event.value
        line, column = start.line, start.column
        length = (end.column if end.line == line else len(self.lines[line])) - column
        if event.anchor is not None or event.tag is not None:
            return self._refuse_marker(event)
        if event.style:
            return Node(text, line + 1, column + 1, length, self.text[start.index : end.index])
        try:
            return Node(resolve(text), line + 1, column + 1, length or 1, text)
        except ScalarError as error:
            node = Node(text, line + 1, column + 1, length, text)
            self._report(str(error), node, error.hint)
            return node

    def _sequence(self, start: Any, depth: int) -> Node:  # noqa: ANN401
        items: list[Node] = []
        advance, scalar = self.next, self._scalar
        while (kind := type(event := advance())) is not SequenceEndEvent:
            items.append(scalar(event) if kind is ScalarEvent else self._node(event, depth + 1))
        return Node(items, *self._extent(start, event))

    def _mapping(self, start: Any, depth: int) -> Node:  # noqa: ANN401
        items: dict[str, Node] = {}
        keys: dict[str, Node] = {}
        while type(event := self.next()) is not MappingEndEvent:
            key = self._node(event, depth + 1)
            value = self._node(self.next(), depth + 1)
            name = key.value
            if type(name) is not str or ":" in name or key.text == "<<":
                name = self._name(key, value)
            if name in keys:
                line, column = keys[name][1:3]
                where = f"line {line}" if line != key.line else f"column {column}"
                self._report(f"the key '{name}' already stands in {where}", key, "keep one of them")
            elif name is not None:
                items[name], keys[name] = value, key
        return Node(items, *self._extent(start, event, next(iter(keys.values()), None)), keys=keys)

    def _name(self, key: Node, value: Node) -> str | None:
        """Return the name that a key gives; None, with a problem, when it gives none."""
        name, hint = key.value, None
        glued = isinstance(name, str) and name == key.text and value.value is None and not value.text
        if key.text == "<<":
            message, hint = "merge keys are not read", _REPEATED
        elif glued and (value.line, value.column) == (key.line, key.column + key.length):
            from trajcli.job.yaml.syntax import spaced

            message, hint = f"no space after the colon in '{name}'", spaced(str(name))
        elif isinstance(name, str):
            return name
        elif isinstance(name, list | dict):
            message = f"a {'list' if isinstance(name, list) else 'mapping'} cannot be a key, expected a name"
        elif key.text[:1] in ("&", "*", "!"):
            return None  # refused where it stands
        elif not key.text:
            message = "a key is missing before the colon"
        else:
            hint = f'write "{key.text}"'
            if not isinstance(name, bool | None):
                hint = self._decimal_comma(key) or f"{hint}, of a point p{key.text}"
            message = f"the key {key.text} is no name"
        self._report(message, key, hint)
        return None

    def _decimal_comma(self, key: Node) -> str | None:
        """Return the hint where a comma cut a number into a value and a key, as in `duration: 0,2`."""
        before = _CUT_BY_COMMA.search(self.lines[key.line - 1][: key.column - 1])
        if before is None or not key.text.isdigit():
            return None
        return f"write {before[1]}.{key.text}: decimals have a point"

    def _refuse_marker(self, event: Any) -> Node:  # noqa: ANN401
        """Report the anchor, alias or tag at the start of an event, and return it as a node without value."""
        line, column = event.start_mark.line, event.start_mark.column
        match = _MARKER.match(self.lines[line], column)
        marker = match[0] if match else ""
        kind = {"&": "anchors", "*": "aliases"}.get(marker[:1], "tags")
        hint = "leave it out: types are known" if kind == "tags" else _REPEATED
        node = Node(None, line + 1, column + 1, len(marker), marker)
        self._report(f"{kind} are not read, got {marker}", node, hint)
        return node

    def _extent(self, start: Any, end: Any, first: Node | None = None) -> tuple[int, int, int]:  # noqa: ANN401
        """Return where a collection stands: in brackets all of its line, else its first key or dash."""
        begin, finish = start.start_mark, end.end_mark
        length = first.length if first is not None else 1
        if start.flow_style:
            line = self.lines[begin.line]
            length = (finish.column if finish.line == begin.line else len(line.rstrip())) - begin.column
        return begin.line + 1, begin.column + 1, length

    def _marked(self, event: Any) -> Node:  # noqa: ANN401
        start, end = event.start_mark, event.end_mark
        length = end.column - start.column if end.line == start.line else 1
        return Node(None, start.line + 1, start.column + 1, length)

    def _report(self, message: str, at: Node, hint: str | None = None) -> None:
        there = place(self.file, self.lines, at.line, at.column, at.length)
        self.problems.append(Problem(message, hint, there))


class ScalarError(ValueError):
    """A plain scalar is a number that cannot be used; the message says why.

    Attributes:
        hint: What would fix it.
    """

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def resolve(text: str) -> Scalar:
    """Return the value of a plain scalar: null, a bool, an int, a float, or the text itself.

    Raises:
        ScalarError: When it is a number that is not finite, or that float64 cannot hold.
    """
    if not text or text[0] not in _FIRST_OF_NUMBERS:
        return _WORDS.get(text, text)
    if _is_decimal(text):
        if "." in text and 0.0 < abs(value := float(text)) <= _LARGEST:
            return value  # what nearly all numbers of a long file are
        return _int(text, 10) if text.lstrip("+-").isdigit() else _float(text)
    if _RADIX.fullmatch(text):
        return _int(text[2:], 8 if text[1] == "o" else 16)
    if _NOT_FINITE.fullmatch(text):
        hint = "a bound that is not there is written null" if text[-1] in "fF" else None
        raise ScalarError(f"expected a finite number, got {text}", hint)
    return text


def _float(text: str) -> float:
    value = float(text)
    if abs(value) > _LARGEST:
        raise ScalarError(f"{_shown(text)} is too large: a number is at most 1.8e308")
    if not value and text.lower().partition("e")[0].strip("+-0."):
        raise ScalarError(f"{_shown(text)} is too small: it would be read as 0")
    return value


def _int(digits: str, radix: int) -> int:
    try:
        value = int(digits, radix)  # ValueError: more digits than Python reads
        float(value)
    except (ValueError, OverflowError):
        raise ScalarError(f"{_shown(digits)} is too large: a number is at most 1.8e308") from None
    return value


def _shown(text: str) -> str:
    return text if len(text) <= _QUOTED else f"{text[:_QUOTED]}... ({len(text)} characters)"
