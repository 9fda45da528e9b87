"""Parts of a move: retreat, the move itself and its approach, with the defaults of the job."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from trajcli.frozen import frozen
from trajcli.job.program.many import ManyNames, fields_of
from trajcli.job.yaml.document import Node
from trajcli.language.numbers import FlawError, Number, ReadingContext, written_number
from trajcli.language.poses import read_axis
from trajcli.planners import PLANNERS
from trajcli.units import Quantity

_LENGTH = Quantity("length")
_DEFAULTS = ("law", "tolerance", "orientation")
_STRAIGHT = ("distance", "axis", "frame", "law", "zone")
_OF_ALL_PARTS = ("label", "limits", "when_over_limit")
_OF_THE_TARGET = ("zone", "at")
_FASTEST = "time_optimal"
_ALONE = ("shape", "duration")  # a law that names one of these takes nothing from the defaults

_Path = tuple[str | int, ...]


@frozen
class MovePart:
    """One plain move.

    Attributes:
        node: The move.
        places: Where what does not stand in the move itself is written, by its path below the move.
    """

    node: Node
    places: Mapping[_Path, _Path] = field(default_factory=dict)


class Parts:
    """The parts of which moves consist."""

    def __init__(self, names: ManyNames, defaults: Node | None, context: ReadingContext) -> None:
        self._names, self._context = names, context
        if defaults is not None:
            names.only(defaults, _DEFAULTS, ("defaults",))
        self._defaults = fields_of(defaults)
        self._made: dict[int, list[MovePart]] = {}

    def of(self, entry: Node, path: _Path) -> list[MovePart]:
        """Return the plain moves that an entry of the moves is, in order."""
        if id(entry) not in self._made:
            self._made[id(entry)] = self._parts(entry, path)
        return self._made[id(entry)]

    def _parts(self, entry: Node, path: _Path) -> list[MovePart]:
        fields = fields_of(entry)
        own = {key: node for key, node in fields.items() if key not in ("approach", "retreat")}
        if own.keys() == fields.keys():
            return [self._with_defaults(MovePart(entry))]
        parts = []
        if "retreat" in fields:
            offset, frame = self._offset(fields["retreat"], (*path, "retreat"))
            here = _relative(entry, "here", offset, frame)
            parts.append(self._straight(fields, "retreat", path, here, entry))
        if "approach" not in fields:
            return [*parts, self._with_defaults(MovePart(_mapping(entry, own)))]
        target = fields.get("to")
        if target is None or not isinstance(target.value, str | dict):
            raise self._names.refused("an approach needs a target `to`", (*path, "approach"))
        offset, frame = self._offset(fields["approach"], (*path, "approach"))
        name = (
            target.value if isinstance(target.value, str) else self._names.add_target(target, (*path, "to"))
        )
        first = {key: node for key, node in own.items() if key not in _OF_THE_TARGET}
        first["to"] = _relative(target, name, offset, frame)
        first |= _zone(fields["approach"])
        last = _relative(target, "here", -offset, frame) if self._names.waits(name) else target
        before = MovePart(_mapping(entry, first), _written_in((*path, "approach"), "zone", "frame"))
        ending = self._straight(fields, "approach", path, last, entry)
        return [*parts, self._with_defaults(before), ending]

    def _straight(
        self, fields: Mapping[str, Node], key: str, path: _Path, target: Node, entry: Node
    ) -> MovePart:
        """Return the straight part of an approach or a retreat."""
        given, relative = fields_of(fields[key]), target is not fields.get("to")
        of_end = given if key == "retreat" else fields
        move = {name: fields[name] for name in _OF_ALL_PARTS if name in fields}
        move |= {"planner": entry._replace(value="line"), "to": target}
        move |= {name: of_end[name] for name in _OF_THE_TARGET if name in of_end}
        if "law" in given:
            move["law"] = given["law"]
        names = ["law", *["zone"] * (of_end is given), *["frame"] * relative]
        part = MovePart(_mapping(entry, move), _written_in((*path, key), *names))
        return self._with_defaults(part, fastest=True)

    def _with_defaults(self, part: MovePart, *, fastest: bool = False) -> MovePart:
        """Return a part with the defaults of the job where it does not say otherwise."""
        fields = fields_of(part.node)
        planner = fields["planner"].value if "planner" in fields else None
        if not isinstance(planner, str) or planner not in PLANNERS or not (self._defaults or fastest):
            return part
        fields, places = dict(fields), dict(part.places)
        for key in (key for key in _DEFAULTS if key in PLANNERS[planner].model_fields):
            default = self._defaults.get(key)
            if key == "law":
                default = self._default_law(default, part.node, fastest=fastest)
            if default is None:
                continue
            own = fields.get(key)
            if own is None:
                fields[key], places[(key,)] = default, ("defaults", key)
            elif _is_added_to(key, own) and isinstance(default.value, dict):
                added = {name: node for name, node in default.value.items() if name not in fields_of(own)}
                fields[key] = _mapping(own, {**fields_of(own), **added})
                places |= {(key, name): ("defaults", key, name) for name in added}
        return MovePart(_mapping(part.node, fields), places)

    def _default_law(self, law: Node | None, at: Node, *, fastest: bool) -> Node | None:
        """Return the default law, which is time-optimal where it names no shape."""
        if law is None:
            return _mapping(at, {"shape": at._replace(value=_FASTEST)}) if fastest else None
        if not isinstance(law.value, dict) or "shape" in law.value:
            return law
        return _mapping(law, {"shape": law._replace(value=_FASTEST), **law.value})

    def _offset(self, given: Node, path: _Path) -> tuple[np.ndarray, Node]:
        """Return how far from the target a straight part begins or ends, m, and along whose axes."""
        fields, at = {"distance": given}, path
        if isinstance(given.value, dict):
            self._names.only(given, _STRAIGHT, path)
            fields, at = given.value, (*path, "distance")
            if "distance" not in fields:
                raise self._names.refused("`distance` is missing", path)
        try:
            distance = Number(_LENGTH, "", above=0.0).read(fields["distance"].plain(), self._context)
        except FlawError as error:
            raise self._names.refused(str(error), at, error.flaws[0][2]) from None
        axis = self._axis(fields.get("axis"), (*path, "axis"))
        return distance * axis, fields.get("frame", given._replace(value="tool"))

    def _axis(self, given: Node | None, path: _Path) -> np.ndarray:
        """Return the unit vector of an axis, (3,)."""
        value = "-z" if given is None else given.plain()
        negative = isinstance(value, str) and value.startswith("-")
        try:
            axis = read_axis(value[1:] if negative else value, self._context)
        except FlawError as error:
            hint = "one of x, -x, y, -y, z, -z, or three numbers"
            raise self._names.refused(str(error), path, hint) from None
        return -axis if negative else axis


def _written_in(path: _Path, *names: str) -> dict[_Path, _Path]:
    """Return where fields of a part are written that stand in its approach or its retreat."""
    return {("to", name) if name == "frame" else (name,): (*path, name) for name in names}


def _zone(given: Node) -> dict[str, Node]:
    zone = given.child("zone")
    return {} if zone is None else {"zone": zone}


def _is_added_to(key: str, own: Node) -> bool:
    """Return whether what a move says is completed from the defaults."""
    return isinstance(own.value, dict) and (key != "law" or own.value.keys().isdisjoint(_ALONE))


def _mapping(like: Node, fields: Mapping[str, Node]) -> Node:
    """Return a mapping that stands where another node does."""
    return like._replace(value=dict(fields), keys=None)


def _relative(like: Node, name: str, xyz: np.ndarray, frame: Node) -> Node:
    """Return a target relative to a point, by so much, m."""
    written = (written_number(x, _LENGTH) for x in xyz.tolist())
    numbers = like._replace(value=[like._replace(value=x, keys=None) for x in written], keys=None)
    offset = _mapping(like, {"xyz": numbers})
    return _mapping(like, {"from": like._replace(value=name, keys=None), "offset": offset, "frame": frame})
