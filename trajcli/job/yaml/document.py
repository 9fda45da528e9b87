"""Syntax tree of a YAML file: values, and where each of them stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from trajcli.errors import Place
from trajcli.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence


class Node(NamedTuple):
    """A value and where it stands; a tuple, as a file has one for each number and a frozen class costs three.

    Attributes:
        value: A scalar, a list of nodes, or nodes by key.
        line: From 1.
        column: From 1.
        length: Characters that the value takes on that line, of a block its first key or dash; at least 1.
        text: A scalar as it stands in the file, quotes included; empty for lists and mappings.
        keys: The nodes of a mapping's keys.
    """

    value: bool | int | float | str | list[Node] | dict[str, Node] | None
    line: int
    column: int
    length: int
    text: str = ""
    keys: dict[str, Node] | None = None

    def child(self, step: str | int) -> Node | None:
        """Return the node under a key, or at an index from 0; None when there is none."""
        if isinstance(self.value, dict):
            return self.value.get(step) if isinstance(step, str) else None
        if isinstance(self.value, list) and isinstance(step, int) and 0 <= step < len(self.value):
            items: list[Node] = self.value
            return items[step]
        return None

    def plain(self) -> Any:  # noqa: ANN401
        """Return the value as new dicts, lists and scalars, without places."""
        value = self.value
        if isinstance(value, dict):
            return {key: node.plain() for key, node in value.items()}
        if isinstance(value, list):
            return [node.plain() for node in value]
        return value


@frozen
class Document:
    """One YAML document.

    Attributes:
        file: Its path as the user wrote it, or "<stdin>".
        lines: The lines of the file, without their ends.
        root: The whole of it.
    """

    file: str
    lines: tuple[str, ...]
    root: Node

    def node(self, path: Sequence[str | int]) -> Node | None:
        """Return the node at a path such as ("moves", 0, "duration"), or None when there is none."""
        node: Node | None = self.root
        for step in path:
            node = node.child(step) if node is not None else None
        return node

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where the deepest existing node on the path stands.

        Args:
            path: Keys, and indices from 0.
            key: Point at the last key itself instead of its value, if the whole path exists.
        """
        node = shown = self.root
        for depth, step in enumerate(path, 1):
            child = node.child(step)
            if child is None:
                break
            keys = node.keys if key and depth == len(path) else None
            shown = keys.get(str(step), child) if keys else child
            node = child
        return place(self.file, self.lines, shown.line, shown.column, shown.length)

    def round_of(self, move: int) -> str:
        """Return in which round of a repeat a move is, such as "slot 3 of 18"; empty outside of any."""
        del move
        return ""

    def without_round(self, point: str) -> str:
        """Return the name of a point as it is written, without the round of a repeat in which it is that."""
        return point

    def plain(self) -> Any:  # noqa: ANN401
        """Return the whole as new dicts, lists and scalars."""
        return self.root.plain()


def place(file: str, lines: Sequence[str], line: int, column: int, length: int = 1) -> Place:
    """Return a place in a file for errors; one behind the last text is moved to the end of that."""
    if line > len(lines) or (line == len(lines) and not lines[-1]):
        line = max((number for number, text in enumerate(lines, 1) if text.strip()), default=1)
        column, length = len(lines[line - 1].rstrip()) + 1, 1
    return Place(file, line, column, lines[line - 1], max(length, 1))
