"""Expansion of a program: repeats and calls as the plain moves that they stand for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from trajcli.errors import Place
from trajcli.frozen import frozen
from trajcli.job.program.many import MOST_ENTRIES, SECTIONS, ManyNames, Rounds, fields_of
from trajcli.job.program.parts import Parts
from trajcli.job.yaml.document import Document, Node
from trajcli.language.numbers import ReadingContext, flaw_of_name, shown
from trajcli.suggest import did_you_mean, valid_names
from trajcli.units import Units

_LONGEST_CHAIN = 100  # sequences, each called by the one before
_DEEPEST = 300  # repeats and calls, each within the one before
_Path = tuple[str | int, ...]


class _Entry(NamedTuple):
    """A move of the expanded list.

    Attributes:
        node: The move.
        path: Where it is written.
        rounds: In which rounds it is, such as "slot 3 of 18"; empty outside of repeats.
        places: Where what does not stand in it is written, by its path below the move.
    """

    node: Node
    path: _Path
    rounds: str
    places: Mapping[_Path, _Path]


@frozen
class ExpandedDocument(Document):
    """A document whose repeats and calls are written out.

    Attributes:
        written: The document as it stands in the file.
        entries: The moves.
        made: Where points and frames of rounds are written, and moves of sequences that nobody calls.
    """

    written: Document
    entries: Sequence[_Entry]
    made: Mapping[_Path, _Path]

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where in the file the deepest existing node on the path is written."""
        return self.written.place(self._written(tuple(path)), key=key)

    @property
    def patches(self) -> Mapping[_Path, Document]:
        """What options have replaced in the document as it stands in the file."""
        return getattr(self.written, "patches", {})

    def round_of(self, move: int) -> str:
        """Return in which round of a repeat a move is reached; empty outside of any."""
        return self.entries[move].rounds

    def without_round(self, point: str) -> str:
        """Return the name of a point as it is written, without the round in which it is that."""
        name = str(self.made.get(("points", point), (point,))[-1])
        return name if point.startswith(f"{name} (") else point

    def _written(self, path: _Path) -> _Path:
        if path[:1] == ("moves",) and path[1:] and isinstance(path[1], int) and path[1] < len(self.entries):
            entry = self.entries[path[1]]
            for depth in (4, 3):
                if path[2:depth] in entry.places:
                    return (*entry.places[path[2:depth]], *path[depth:])
            return (*entry.path, *path[2:])
        for depth in (2, 3):
            if path[:depth] in self.made:
                return (*self.made[path[:depth]], *path[depth:])
        return path

    def plain(self) -> Any:  # noqa: ANN401
        """Return the whole as dicts, lists and scalars; moves that are one in the file are one object."""
        sections: dict[str, Node] = self.root.value  # type: ignore[assignment]
        once: dict[int, Any] = {}
        moves: list[Node] = sections["moves"].value  # type: ignore[assignment]
        for node in moves:
            if id(node) not in once:
                once[id(node)] = node.plain()
        others = {key: node.plain() for key, node in sections.items() if key != "moves"}
        return {**others, "moves": [once[id(node)] for node in moves]}


def expanded(document: Document, units: Units) -> ExpandedDocument:
    """Return a document with its repeats and calls written out.

    Args:
        document: With moves and perhaps sequences.
        units: Of its plain numbers.

    Raises:
        InputError: When a repeat, a call, a sequence or a point that is many is wrong, or the expanded list
            of moves has more than a million entries.
    """
    context = ReadingContext(units)
    names = ManyNames(document, context)
    names.check()
    return _Expansion(document, names, Parts(names, document.node(("defaults",)), context)).document()


def _phrase(*words: str) -> str:
    return ", ".join(word for word in words if word)


class _Expansion:
    """The expansion of one document."""

    def __init__(self, document: Document, names: ManyNames, parts: Parts) -> None:
        self._document, self._names, self._parts = document, names, parts
        node = document.node(("sequences",))
        if node is not None and not isinstance(node.value, dict):
            raise names.refused("expected a mapping {NAME: [move, ...]}", ("sequences",))
        self._sequences: dict[str, Node] = {} if node is None else node.value  # type: ignore[assignment]
        self._counted: dict[tuple[str, frozenset[str]], int] = {}
        self._moves: dict[tuple[Any, ...], Node] = {}

    def document(self) -> ExpandedDocument:
        moves = self._document.node(("moves",))
        if moves is None or not isinstance(moves.value, list):
            raise self._names.refused("expected a list of moves", ("moves",))
        self._count(moves, ("moves",), frozenset(), ())
        for path in (("start",), ("output", "in")):
            if (node := self._document.node(path)) is not None:
                self._check_bound(node, path, frozenset(), moves=False)
        called = {name for name, _ in self._counted}
        entries = list(self._entries(moves, ("moves",), {}, ""))
        others = {name: self._uncalled(name) for name in self._sequences if name not in called}
        made: dict[_Path, _Path] = {
            ("sequences", name, index): entry.path
            for name, some in others.items()
            for index, entry in enumerate(some)
        }
        self._names.make_the_rest()
        root = self._root(moves, entries, others)
        made |= self._names.places()
        written = self._document
        return ExpandedDocument(written.file, written.lines, root, written, entries, made)

    def _root(self, moves: Node, entries: list[_Entry], others: Mapping[str, list[_Entry]]) -> Node:
        sections: dict[str, Node] = dict(self._document.root.value)  # type: ignore[arg-type]
        sections["moves"] = moves._replace(value=[entry.node for entry in entries])
        for section in SECTIONS:
            named = self._names.named(section)
            if named:
                sections[section] = sections.get(section, moves)._replace(value=named)
        if "sequences" in sections:
            of_names = {
                name: self._sequences[name]._replace(value=[entry.node for entry in some])
                for name, some in others.items()
            }
            sections["sequences"] = sections["sequences"]._replace(value=of_names)
        return self._document.root._replace(value=sections)

    def _uncalled(self, name: str) -> list[_Entry]:
        """Return the moves of a sequence that nobody calls in the first of all rounds: they are read, too."""
        path, bound = ("sequences", name), frozenset(self._names.counts)
        self._count(self._sequences[name], path, bound, (name,))
        first = dict.fromkeys(self._names.counts, 0)
        return list(self._entries(self._sequences[name], path, first, ""))

    def _count(self, listed: Node, path: _Path, bound: frozenset[str], chain: tuple[str, ...]) -> int:
        """Return how many entries a list of moves becomes; refuse what is wrong with its repeats.

        The chain holds what the list stands in: the names of sequences, and an empty one for a repeat.
        """
        self._not_too_deep(len(chain), path)
        if not isinstance(listed.value, list):
            raise self._names.refused("expected a list of moves", path)
        if not listed.value:
            raise self._names.refused("a list of moves is empty", path)
        total = 0
        for index, entry in enumerate(listed.value):
            keys, here = fields_of(entry), (*path, index)
            if "repeat" in keys:
                total += self._count_repeat(entry, here, bound, chain)
            elif "call" in keys:
                total += self._count_call(entry, here, bound, chain)
            else:
                parts = self._parts.of(entry, here)
                for part in parts:
                    self._check_bound(part.node, here, bound)
                total += len(parts)
        if total > MOST_ENTRIES:
            message = f"the moves are {total} entries when repeats and calls are written out"
            raise self._names.refused(f"{message}, expected at most {MOST_ENTRIES}", path)
        return total

    def _only(self, entry: Node, keys: tuple[str, ...], path: _Path) -> None:
        """Refuse other keys than these and a label, and what is no label."""
        self._names.only(entry, (*keys, "label"), path)
        label = entry.child("label")
        if label is None:
            return
        text = label.plain()
        flaw = flaw_of_name(text) if isinstance(text, str) else f"expected a text, got {shown(text)}"
        if flaw is not None:
            raise self._names.refused(flaw, (*path, "label"))

    def _count_repeat(self, entry: Node, path: _Path, bound: frozenset[str], chain: tuple[str, ...]) -> int:
        self._only(entry, ("repeat", "moves"), path)
        over, moves = entry.child("repeat"), entry.child("moves")
        if over is None or moves is None:
            raise self._names.refused("a repeat needs `moves`", path, "such as {repeat: 3, moves: [...]}")
        # of two of a name, one in the other, the inner counts
        count, names = self._rounds(over, (*path, "repeat"))
        for name in names:
            left = [one for one in self._names.needs(name) if one not in (*bound, *names)]
            if left:
                message = f"'{name}' differs from round to round of {left[0]}"
                raise self._names.refused(message, (*path, "repeat"), f"write it within `repeat: {left[0]}`")
        return count * self._count(moves, (*path, "moves"), bound | set(names), (*chain, ""))

    def _rounds(self, over: Node, path: _Path) -> tuple[int, tuple[str, ...]]:
        """Return how many rounds a repeat has, and the names over which it goes."""
        if type(over.value) is int and over.value >= 1:
            return over.value, ()
        listed = over.value if isinstance(over.value, list) else [over]
        counts = self._names.counts
        for node in listed:
            if not isinstance(node.value, str):
                message = "expected a whole number of at least 1, or names that are many"
                raise self._names.refused(f"{message}, got {node.text or 'a value of another kind'}", path)
            if node.value not in counts:
                hint = did_you_mean(node.value, counts) or valid_names(counts, "names that are many")
                if needed := self._names.needs(node.value):
                    hint = "write " + ", and within it ".join(f"`repeat: {one}`" for one in needed)
                if node.value.isdecimal():
                    hint = f"as a number, without quotes: {node.value}"
                message = f"'{node.value}' is not many itself"
                raise self._names.refused(message, path, hint or "no point of the job is a grid or a list")
        names = tuple(str(node.value) for node in listed)
        if not names or len(set(names)) < len(names):
            raise self._names.refused("expected different names", path)
        if len({counts[name] for name in names}) > 1:
            each = ", ".join(f"{name} is {counts[name]}" for name in names)
            raise self._names.refused(f"names that are repeated together need equal counts: {each}", path)
        return counts[names[0]], names

    def _count_call(self, entry: Node, path: _Path, bound: frozenset[str], chain: tuple[str, ...]) -> int:
        self._only(entry, ("call",), path)
        at, others = (*path, "call"), self._sequences
        name = fields_of(entry)["call"].value
        if not isinstance(name, str):
            raise self._names.refused("expected the name of a sequence", at)
        if name not in others:
            hint = (
                did_you_mean(name, others) or valid_names(others, "sequences") or "the job has no `sequences`"
            )
            raise self._names.refused(f"there is no sequence '{name}'", at, hint)
        if name in chain:
            circle = " -> ".join([*filter(None, chain[chain.index(name) :]), name])
            raise self._names.refused(f"the sequence '{name}' calls itself ({circle})", at)
        if len(chain) - chain.count("") == _LONGEST_CHAIN:
            raise self._names.refused(f"more than {_LONGEST_CHAIN} sequences call one another", at)
        key = (name, bound)
        if key not in self._counted:
            counted = self._count(self._sequences[name], ("sequences", name), bound, (*chain, name))
            self._counted[key] = counted
        return self._counted[key]

    def _check_bound(self, entry: Node, path: _Path, bound: frozenset[str], *, moves: bool = True) -> None:
        """Refuse a move, or what no round holds, that names one of many where no round says which."""
        for name in self._names.needs_of(entry):
            if name not in bound:
                message = f"'{name}' is many ({self._names.counts[name]}), and no round says which is meant"
                within = f"write the move within `- {{repeat: {name}, moves: [...]}}`"
                hint = within if moves else self._names.advice(name, path)
                raise self._names.refused(message, path, hint)

    def _not_too_deep(self, depth: int, path: _Path) -> None:
        if depth > _DEEPEST:
            message = f"more than {_DEEPEST} repeats and calls stand one in another"
            raise self._names.refused(message, path, "write some of them out")

    def _entries(
        self, listed: Node, path: _Path, rounds: Rounds, words: str, depth: int = 0
    ) -> Iterator[_Entry]:
        """Yield the moves that a list stands for, in its rounds."""
        self._not_too_deep(depth, path)
        items: list[Node] = listed.value  # type: ignore[assignment]
        for index, entry in enumerate(items):
            keys, here = fields_of(entry), (*path, index)
            label = str(keys["label"].value) if "label" in keys else ""
            if "repeat" in keys:
                count, names = self._rounds(keys["repeat"], (*here, "repeat"))
                for number in range(count):
                    now = {**rounds, **dict.fromkeys(names, number)}
                    counted = self._names.words(now, names)
                    said = _phrase(words, label, counted or f"round {number + 1} of {count}")
                    yield from self._entries(keys["moves"], (*here, "moves"), now, said, depth + 1)
            elif "call" in keys:
                name = str(keys["call"].value)
                at, said = ("sequences", name), _phrase(words, label)
                yield from self._entries(self._sequences[name], at, rounds, said, depth + 1)
            else:
                for part in self._parts.of(entry, here):
                    yield _Entry(self._of_round(part.node, rounds), here, words, part.places)

    def _of_round(self, entry: Node, rounds: Rounds) -> Node:
        """Return a move in a round; one that is the same in several is one node."""
        needed = self._names.needs_of(entry)
        key = (id(entry), *(rounds[name] for name in needed))
        if key not in self._moves:
            self._moves[key] = self._names.renamed(entry, rounds)
        return self._moves[key]
