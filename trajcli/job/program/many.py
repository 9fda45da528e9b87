"""Points and frames that are many: grids and lists, and what their names mean within a round."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import prod

from trajcli.errors import InputError, Problem
from trajcli.frozen import frozen
from trajcli.job.yaml.document import Document, Node
from trajcli.language.frames import OF_GRID
from trajcli.language.numbers import FlawError, ReadingContext, written_number
from trajcli.language.poses import read_numbers
from trajcli.suggest import did_you_mean, valid_names
from trajcli.units import Quantity

MOST_ENTRIES = 1_000_000
"""Entries of a list of moves once it is expanded, and places of a grid."""
SECTIONS = ("points", "frames")
"""Where names stand that may be many."""
_LENGTH = Quantity("length")
_NAMING = ("to", "via", "line", "in", "from", "frame")
"""Keys whose text names a point or a frame; so do the texts of a list under `through`."""

_OF_MOVES = ("zone", "law", "limits", "at", "duration", "tolerance", "orientation", "approach", "retreat")
"""Keys of moves, which no repeat has."""
_LONGEST_CHAIN = 100  # points and frames of a round, each given by the next
_Path = tuple[str | int, ...]
Rounds = Mapping[str, int]
"""Which of the many a name means, from 0, by name."""


@frozen
class _Grid:
    """Places in rows and columns: the first one, and the steps to the others.

    Attributes:
        origin: Name of the first.
        frame: In whose axes the steps are.
        counts: Places along each direction, the first included; the last direction turns fastest.
        steps: From place to place along each direction, m.
    """

    origin: Node
    frame: Node | None
    counts: tuple[int, ...]
    steps: tuple[tuple[float, ...], ...]

    def offset(self, index: int) -> list[float]:
        """Return how far a place is from the first, m."""
        offset = [0.0, 0.0, 0.0]
        for count, step in zip(reversed(self.counts), reversed(self.steps), strict=True):
            index, along = divmod(index, count)
            offset = [sofar + along * part for sofar, part in zip(offset, step, strict=True)]
        return offset


class ManyNames:
    """The names of points and frames of a document, of which some are many.

    Attributes:
        counts: How many each name is that is many.
        made: The points and frames of rounds: by section and name, the node and the path of what it is of.
    """

    def __init__(self, document: Document, context: ReadingContext) -> None:
        self._document, self._context = document, context
        self._at: dict[str, tuple[_Path, Node]] = {}
        self._sections: dict[str, str] = {}
        self._grids: dict[str, _Grid] = {}
        self._lists: dict[str, list[Node]] = {}
        self._needs: dict[str, tuple[str, ...]] = {}
        self._needs_of: dict[int, tuple[str, ...]] = {}
        self._in_making: list[str] = []
        self.counts: dict[str, int] = {}
        self.made: dict[str, dict[str, tuple[Node, _Path]]] = {section: {} for section in SECTIONS}
        for section in SECTIONS:
            node = document.node((section,))
            for name, value in node.value.items() if node and isinstance(node.value, dict) else ():
                self._add(name, value, (section, name))

    def _add(self, name: str, value: Node, path: _Path) -> None:
        if name in self._at:
            raise self.refused(f"'{name}' is a point and a frame", path, "points and frames share names")
        self._at[name], self._sections[name] = (path, value), str(path[0])
        if isinstance(value.value, list):
            self._lists[name] = self._listed(value, path)
            self.counts[name] = len(value.value)
        elif isinstance(value.value, dict) and "grid" in value.value:
            self._grids[name] = self._grid(value, path)
            self.counts[name] = prod(self._grids[name].counts)

    def add_target(self, node: Node, path: _Path) -> str:
        """Return the name of a new point, which is the target of a move."""
        name = f"target in line {node.line}"
        while name in self._at:
            name += "'"
        self._at[name], self._sections[name] = (path, node), "points"
        return name

    def advice(self, name: str, path: _Path) -> str:
        """Return what helps where a name at a path, which no move is, is one of many or is given by these."""
        first = str((self._lists[name][0] if name in self._lists else self._grids[name].origin).value)
        if path == ("start",) and self._sections[name] == "frames":
            return f"give the pose in one of them: {{in: {first}, ...}}"
        return f"name one, such as {first}"

    def waits(self, name: str) -> bool:
        """Return whether a point is relative to where the arm stands, and so differs from move to move."""
        reached = [name, *self._reached(name)]
        nodes = [self._at[one][1] for one in reached if one in self._at]
        return "here" in reached or any(node.child("joints_by") is not None for node in nodes)

    def refused(self, message: str, path: _Path, hint: str | None = None, *, key: bool = False) -> InputError:
        """Return the error about something at a path."""
        return InputError(Problem(message, hint, self._document.place(path, key=key)))

    def check(self) -> None:
        """Refuse what names that are many name wrongly.

        Raises:
            InputError: When the first of a grid or a place of a list is no such name, or is many.
        """
        for name, listed in self._lists.items():
            path, seen = self._at[name][0], set[str]()
            for index, node in enumerate(listed):
                self._one(str(node.value), (*path, index))
                if node.value in seen:
                    raise self.refused(f"'{node.value}' stands twice in '{name}'", (*path, index))
                seen.add(str(node.value))
        for name, grid in self._grids.items():
            path = (*self._at[name][0], "grid")
            self._one(str(grid.origin.value), (*path, "from"))
            if name in self._reached(name):
                raise self.refused(f"the grid '{name}' begins at itself", (*path, "from"))

    def _reached(self, name: str) -> set[str]:
        """Return the names that a name is given by."""
        reached: set[str] = set()
        todo = list(self._named_by(name))
        while todo:
            other = todo.pop()
            if other not in reached:
                reached.add(other)
                todo += self._named_by(other)
        return reached

    def _named_by(self, name: str) -> list[str]:
        if name not in self._at:
            return []
        if name in self._lists:
            return [str(node.value) for node in self._lists[name]]
        if name in self._grids:
            grid = self._grids[name]
            frame = self._frame_of(grid.origin) if grid.frame is None else str(grid.frame.value)
            return [str(grid.origin.value), frame]
        return list(naming_texts(self._at[name][1]))

    def needs(self, name: str) -> tuple[str, ...]:
        """Return the names that are many, of which a round must say which one is meant where this name is."""
        if name not in self._needs:
            reached = self._reached(name) | {name}
            self._needs[name] = tuple(one for one in self.counts if one in reached)
        return self._needs[name]

    def needs_of(self, node: Node) -> tuple[str, ...]:
        """Return likewise what a move needs."""
        if id(node) not in self._needs_of:
            needed = {one for text in naming_texts(node) for one in self.needs(text)}
            self._needs_of[id(node)] = tuple(one for one in self.counts if one in needed)
        return self._needs_of[id(node)]

    def words(self, rounds: Rounds, among: Sequence[str]) -> str:
        """Return a round in words, such as "slot 3 of 18"."""
        return ", ".join(f"{name} {rounds[name] + 1} of {self.counts[name]}" for name in among)

    def meant(self, name: str, rounds: Rounds) -> str:
        """Return the name of the point or frame that a name means in a round."""
        needed = self.needs(name)
        if not needed:
            return name
        if name in self._lists:
            return self.meant(str(self._lists[name][rounds[name]].value), rounds)
        path, node = self._at[name]
        words = self.words(rounds, needed)
        made_name = words if needed == (name,) else f"{name} ({words})"
        while made_name in self._at:
            made_name += "'"
        made = self.made[self._sections[name]]
        if made_name not in made:
            if len(self._in_making) == _LONGEST_CHAIN:
                message = f"more than {_LONGEST_CHAIN} points and frames are given one by the next"
                raise self.refused(message, path, "give one of them as a pose of its own")
            made[made_name] = (node, path)  # before what it names, which may be itself
            self._in_making.append(made_name)
            made[made_name] = (self._of_round(name, node, rounds), path)
            self._in_making.pop()
        return made_name

    def _of_round(self, name: str, node: Node, rounds: Rounds) -> Node:
        if name not in self._grids:
            return self.renamed(node, rounds)
        grid = self._grids[name]
        offset = [written_number(x, _LENGTH) for x in grid.offset(rounds[name])]
        xyz = node._replace(value=[node._replace(value=x) for x in offset], keys=None)
        frame = node._replace(value=self._frame_of(grid.origin)) if grid.frame is None else grid.frame
        fields = {
            "from": grid.origin._replace(value=self.meant(str(grid.origin.value), rounds)),
            "offset": node._replace(value={"xyz": xyz}, keys=None),
            "frame": frame._replace(value=self.meant(str(frame.value), rounds)),
        }
        made = node._replace(value=fields, keys=None)
        return made if self._sections[name] == "points" else made._replace(value={OF_GRID: made})

    def _frame_of(self, origin: Node) -> str:
        """Return the name of the frame in which a point or a frame is given, by itself or by others."""
        name, seen = str(origin.value), set[str]()
        while name in self._at and name not in seen:
            seen.add(name)
            node = self._at[name][1]
            named, start = node.child("in"), node.value if isinstance(node.value, str) else node.child("from")
            if named is not None:
                return str(named.value)
            name = start if isinstance(start, str) else "" if start is None else str(start.value)
        return "world"

    def renamed(self, node: Node, rounds: Rounds) -> Node:
        """Return a point or a move with the names that it means in a round; itself where it needs none."""
        return _with_names(node, "to", lambda name: self.meant(name, rounds))

    def make_the_rest(self) -> None:
        """Make the first of all that no round has reached, so that it is read."""
        first = dict.fromkeys(self.counts, 0)
        reached = {path for made in self.made.values() for _, path in made.values()}
        for name, (path, _) in self._at.items():
            if path not in reached:
                self.meant(name, first)

    def named(self, section: str) -> dict[str, Node]:
        """Return the points or frames by name: those that are one, and those of rounds."""
        single = {
            name: node
            for name, (_, node) in self._at.items()
            if self._sections[name] == section and not self.needs(name)
        }
        return single | {name: node for name, (node, _) in self.made[section].items()}

    def places(self) -> dict[_Path, _Path]:
        """Return where points and frames are written that do not stand under their name."""
        found = {(self._sections[name], name): path for name, (path, _) in self._at.items()}
        for section, made in self.made.items():
            found |= {(section, name): path for name, (_, path) in made.items()}
        return {at: path for at, path in found.items() if at != path}

    def _one(self, name: str, path: _Path) -> None:
        """Refuse a name that is not that of one point or frame."""
        if name not in self._at:
            hint = did_you_mean(name, self._at) or valid_names(self._at, "points and frames")
            raise self.refused(f"there is no point or frame '{name}'", path, hint)
        if name in self.counts:
            raise self.refused(f"'{name}' is many ({self.counts[name]}), expected one", path)

    def _listed(self, value: Node, path: _Path) -> list[Node]:
        items: list[Node] = value.value  # type: ignore[assignment]
        if not items:
            raise self.refused("a list of points is empty", path)
        for index, item in enumerate(items):
            if not isinstance(item.value, str):
                hint = "give each a name under `points`, and list the names"
                raise self.refused("expected the name of a point", (*path, index), hint)
        return items

    def _grid(self, value: Node, path: _Path) -> _Grid:
        self.only(value, ("grid",), path)
        grid, path = value.child("grid"), (*path, "grid")
        if grid is None or not isinstance(grid.value, dict):
            raise self.refused("expected {from: NAME, steps: [...]}", path)
        self.only(grid, ("from", "steps", "frame"), path)
        origin, steps, frame = (grid.value.get(key) for key in ("from", "steps", "frame"))
        for key, node in (("from", origin), ("steps", steps), ("frame", frame)):
            if node is None and key != "frame":
                raise self.refused(f"`{key}` is missing", path)
            if key != "steps" and node is not None and not isinstance(node.value, str):
                raise self.refused("expected a name", (*path, key))
        if origin is None or steps is None or not isinstance(steps.value, list) or not steps.value:
            hint = "such as steps: [{count: 4, xyz: [0.1, 0, 0]}]"
            raise self.refused("expected a list of steps", (*path, "steps"), hint)
        read = [self._step(step, (*path, "steps", index)) for index, step in enumerate(steps.value)]
        counts = tuple(count for count, _ in read)
        if prod(counts) > MOST_ENTRIES:
            raise self.refused(f"a grid of {prod(counts)} places, expected at most {MOST_ENTRIES}", path)
        return _Grid(origin, frame, counts, tuple(step for _, step in read))

    def _step(self, node: Node, path: _Path) -> tuple[int, tuple[float, ...]]:
        self.only(node, ("count", "xyz"), path)
        count, xyz = node.child("count"), node.child("xyz")
        if count is None or xyz is None:
            raise self.refused(f"`{'count' if count is None else 'xyz'}` is missing", path)
        if type(count.value) is not int or count.value < 1:
            raise self.refused(f"expected a whole number of at least 1, got {count.text}", (*path, "count"))
        try:
            return count.value, tuple(read_numbers(xyz.plain(), 3, _LENGTH, self._context).tolist())
        except FlawError as error:
            below, message, hint = error.flaws[0]
            raise self.refused(message, (*path, "xyz", *below), hint) from None

    def only(self, node: Node, keys: tuple[str, ...], path: _Path) -> None:
        """Refuse a node that is no mapping, or has another key.

        Raises:
            InputError: Names the key.
        """
        if not isinstance(node.value, dict):
            raise self.refused(f"expected a mapping with {', '.join(keys)}", path)
        for key in node.value:
            if key not in keys:
                hint = did_you_mean(key, keys) or valid_names(keys)
                if key in _OF_MOVES and "moves" in keys:
                    hint = f"`{key}` stands in the moves, in each that it is for"
                raise self.refused(f"unknown key '{key}'", (*path, key), hint, key=True)


def fields_of(node: Node | None) -> dict[str, Node]:
    """Return the fields of a mapping; none of what is none."""
    return node.value if node is not None and isinstance(node.value, dict) else {}


def naming_texts(node: Node, key: str | int = "to") -> Iterator[str]:
    """Yield the texts below a node that name points or frames."""
    if isinstance(node.value, str):
        if key in _NAMING:
            yield node.value
    elif isinstance(node.value, list):
        for item in node.value:
            yield from naming_texts(item, "to" if key == "through" else "")
    elif isinstance(node.value, dict):
        for name, below in node.value.items():
            if name != "euler":  # whose frame is none of these
                yield from naming_texts(below, name)


def _with_names(node: Node, key: str, meant: Callable[[str], str]) -> Node:
    """Return a node in which names stand for what they mean; the node itself where none changes."""
    if isinstance(node.value, str):
        name = meant(node.value) if key in _NAMING else node.value
        return node if name == node.value else node._replace(value=name)
    if isinstance(node.value, list):
        items = [_with_names(item, "to" if key == "through" else "", meant) for item in node.value]
        same = all(new is old for new, old in zip(items, node.value, strict=True))
        return node if same else node._replace(value=items)
    if isinstance(node.value, dict):
        below = {
            name: item if name == "euler" else _with_names(item, name, meant)
            for name, item in node.value.items()
        }
        return node if all(below[name] is node.value[name] for name in below) else node._replace(value=below)
    return node
