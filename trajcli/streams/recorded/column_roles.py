"""Roles of columns: which hold the time and which the positions and derivatives of each joint.

What names leave open is refused with the choices, and the text of `--columns` that makes each of them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NoReturn

from trajcli.errors import InputError, Place, Problem
from trajcli.frozen import frozen
from trajcli.streams.recorded.column_names import (
    JOINT_QUANTITIES,
    MOVE,
    TIME,
    ColumnName,
    read_name,
    split_unit,
)
from trajcli.suggest import did_you_mean, valid_names

NONE = "none"
"""What `--columns qd=none` says: that these columns are left out."""

_SHOWN = 12  # names in a note
_BESIDE = ("error", "output")  # kinds of values that are no motion where others are
_JOINT_KEY = re.compile(r"(q|qd|qdd|qddd|tau)([1-9][0-9]*)")
_ECHO = "field."  # what the names of `rostopic echo -p` begin with
_STAMP = "field.header.stamp"
_ECHO_NAME = re.compile(r"field\.(?:joint_)?names?([0-9]+)")

ColumnGroup = dict[int | str, int]
"""The columns of one quantity and kind: the index of the column by the joint as its name has it."""


@frozen
class ColumnRoles:
    """What the columns of a file are.

    Attributes:
        time: Index of the column of time.
        joints: For each quantity that the file has, the indices of its n columns.
        move: Index of the column that counts moves; None without one.
        names: What each column's name says, with the unit that `--columns` gives it.
        joint_names: n names of joints; None where the file numbers them.
        fixed: Indices of columns of text that must be the same in all rows.
        nanoseconds: Whether times without a unit are ns, as `rostopic echo -p` prints them.
        unread: Names of the columns that are not used.
    """

    time: int
    joints: Mapping[str, tuple[int, ...]]
    move: int | None
    names: tuple[ColumnName, ...]
    joint_names: tuple[str, ...] | None
    fixed: tuple[int, ...] = ()
    nanoseconds: bool = False
    unread: tuple[str, ...] = ()

    @property
    def taken(self) -> tuple[int, ...]:
        """Indices of the columns that are used, rising."""
        every = [self.time, *(index for found in self.joints.values() for index in found)]
        return tuple(sorted(every if self.move is None else [*every, self.move]))


@frozen
class NamedFile:
    """The names of a file's columns, and where they stand.

    Attributes:
        file: Its name.
        names: The columns' names.
        place: Where a column's name stands, or all of them; None in files without a line of names.
        first: The texts of the first row; nothing where rows have no texts.
    """

    file: str
    names: tuple[str, ...]
    place: Callable[[str | None], Place | None]
    first: tuple[str, ...] = ()

    def wrong(self, message: str, hint: str | None = None, name: str | None = None) -> InputError:
        """Return the error that says what is wrong with a column, or with all of them."""
        place = self.place(name)
        text = message if place is not None else f"{self.file}: {message}"
        return InputError(Problem(text, hint, place))


def parse_mapping(text: str | Mapping[str, str] | None) -> dict[str, str]:
    """Return what `--columns` says: "t=timestamp,q=target_q".

    Raises:
        InputError: When it is none, or names an unknown quantity or one twice.
    """
    if text is None:
        return {}
    pairs: Iterable[tuple[str, str, str]]
    pairs = [(k, "=", v) for k, v in text.items()] if isinstance(text, Mapping) else _pairs(text)
    mapping: dict[str, str] = {}
    keys = (TIME, *JOINT_QUANTITIES, MOVE)
    for key, sign, value in pairs:
        name, column = key.strip(), value.strip()
        if not sign or not name or not column:
            raise InputError(
                f"--columns: '{key}{sign}{value}' is no mapping", hint="such as t=time,q=target_q"
            )
        if name not in keys and _JOINT_KEY.fullmatch(name) is None:
            hint = did_you_mean(name, keys) or valid_names([*keys, "q1", "qd1"], "known are")
            raise InputError(f"--columns: unknown quantity '{name}'", hint=hint)
        if name in mapping:
            raise InputError(f"--columns: {name} is mapped twice", hint="map it once")
        mapping[name] = column
    return mapping


def _pairs(text: str) -> list[tuple[str, str, str]]:
    return [part.partition("=") for part in text.split(",")]


def assign_roles(
    file: NamedFile, columns: str | Mapping[str, str] | None = None, joints: Sequence[str] | None = None
) -> ColumnRoles:
    """Return what the columns of a file are.

    Args:
        file: Their names.
        columns: What the user says they are, as in `--columns`.
        joints: Names of the joints that are expected; a column may have such a name.

    Raises:
        InputError: When time or positions are missing or ambiguous, or a joint is missing.
    """
    return _Assignment(file, parse_mapping(columns), joints).roles()


class _Assignment:
    """The search for the role of each column."""

    def __init__(self, file: NamedFile, mapping: Mapping[str, str], joints: Sequence[str] | None) -> None:
        self._file, self._mapping = file, dict(mapping)
        self._joints = tuple(joints or ())
        self._names = [self._read(name) for name in file.names]
        self._echo = "t" not in file.names and any(name.startswith(_ECHO) for name in file.names)
        self._chosen: dict[str, ColumnGroup] = {}

    def _read(self, text: str) -> ColumnName:
        for plain, unit in ((text, None), split_unit(text)):
            if plain in self._joints:
                return ColumnName(text, "q", plain, unit, "", "*")
        return read_name(text)

    def roles(self) -> ColumnRoles:
        for key, value in self._mapping.items():
            if value.lower() != NONE or (key not in JOINT_QUANTITIES and value in self._file.names):
                self._map(key, value)
        positions = self._positions()
        for quantity in JOINT_QUANTITIES[1:]:
            if quantity in self._chosen or self._mapping.get(quantity, "").lower() != NONE:
                self._derivative(quantity, positions)
        time, move = self._time(), self._move()
        keys = self._ordered(positions)
        joints = {quantity: tuple(found[key] for key in keys) for quantity, found in self._chosen.items()}
        names, fixed = self._joint_names(keys)
        used = {time, move, *fixed, *(index for found in joints.values() for index in found)}
        unread = tuple(name for index, name in enumerate(self._file.names) if index not in used)
        return ColumnRoles(time, joints, move, tuple(self._names), names, fixed, self._echo, unread)

    # --columns

    def _map(self, key: str, value: str) -> None:
        """Take the columns that the user names for a quantity, or for one of a joint."""
        found = self._columns_of(value, single=key in (TIME, MOVE) or _JOINT_KEY.fullmatch(key) is not None)
        single = _JOINT_KEY.fullmatch(key)
        quantity, joint = (single[1], int(single[2])) if single else (key, None)
        group: ColumnGroup = {}
        for index in found:
            read = self._names[index]
            own: int | str = len(group) + 1 if read.joint is None else read.joint
            own = self._number_of(read.text, value) if read.quantity is None else own
            self._take(quantity, group, own if joint is None else joint, index)
            unit = read.unit if value == read.text else split_unit(value)[1] or read.unit
            self._names[index] = replace(read, quantity=quantity, unit=unit)
        self._chosen.setdefault(quantity, {}).update(group)

    def _columns_of(self, value: str, *, single: bool) -> list[int]:
        """Return the indices of the columns that a name, or what it begins with, means."""
        plain = split_unit(value)[0]
        for wanted in dict.fromkeys((value, plain)):
            for match in (str, str.casefold):
                whole = [index for index, name in enumerate(self._file.names) if match(name) == match(wanted)]
                stems = [k for k, read in enumerate(self._names) if match(read.stem) == match(wanted)]
                if whole:
                    return whole
                if len(stems) == 1 or (stems and not single):
                    return stems
        begun = [
            k
            for k, name in enumerate(self._file.names)
            if re.fullmatch(_numbered_form(plain), split_unit(name)[0])
        ]
        if begun and not single:
            return begun
        every = dict.fromkeys([*self._file.names, *(read.stem for read in self._names)])
        hint = did_you_mean(value, every) or valid_names(self._file.names, "its columns are")
        raise self._file.wrong(f"--columns: there is no column '{value}'", hint)

    def _number_of(self, name: str, stem: str) -> int | str:
        numbers = re.findall(r"[0-9]+", split_unit(name)[0][len(stem) :] or name)
        return int(numbers[-1]) if numbers else name

    # positions, derivatives

    def _groups(self, quantity: str) -> dict[tuple[str, str], ColumnGroup]:
        """Return the columns of a quantity by the kind of their values and their stem."""
        groups: dict[tuple[str, str], ColumnGroup] = {}
        taken = {index for found in self._chosen.values() for index in found.values()}
        numbered = any(read.quantity == "q" and isinstance(read.joint, int) for read in self._names)
        for index, read in enumerate(self._names):
            if read.quantity != quantity or read.joint is None or index in taken:
                continue
            if isinstance(read.joint, int) or not numbered or read.joint in self._joints:
                self._take(quantity, groups.setdefault((read.kind, read.stem), {}), read.joint, index)
        whole = {key: group for key, group in groups.items() if key[0] not in _BESIDE}
        return whole or groups

    def _take(self, quantity: str, group: ColumnGroup, joint: int | str, index: int) -> None:
        """Put a column into a group; refused where it has one of the joint."""
        if joint in group:
            names = [self._file.names[k] for k in (group[joint], index)]
            named = f"{quantity}1=NAME,{quantity}2=NAME"
            hint = f"leave one out, or name a column for each joint: --columns {named}"
            raise self._file.wrong(f"two columns are of one joint: {', '.join(names)}", hint, names[1])
        group[joint] = index

    def _positions(self) -> ColumnGroup:
        if "q" in self._chosen:
            return self._chosen["q"]
        groups = self._groups("q")
        if len(groups) == 1:
            self._chosen["q"] = next(iter(groups.values()))
            return self._chosen["q"]
        if groups:
            choices = [self._text(kind, stem) for kind, stem in groups]
            self._refuse("the positions are ambiguous", groups, choices)
        named = self._listed(dict(enumerate(range(len(self._names)))))
        hint = f"it has {named}; name them: --columns q=... or q1=NAME,q2=NAME"
        for quantity in ("qd", "qdd"):  # where one letter says it, as in the axes A1 and A2
            for (_, stem), group in self._groups(quantity).items():
                if len(stem.strip("_ .[(")) == 1:
                    hint = f"--columns q={stem} takes {self._listed(group)} as positions"
        if {"x", "y", "z"} <= {*self._file.names}:
            hint += "; poses of the tool are judged by `trajcli check FILE --job JOB`"
        raise self._file.wrong("no columns are positions of joints, such as q1, q2", hint)

    def _refuse(
        self, message: str, groups: Mapping[tuple[str, str], ColumnGroup], choices: Sequence[str]
    ) -> NoReturn:
        listed = " or ".join(self._listed(group) for group in groups.values())
        raise self._file.wrong(f"{message}: {listed}", " or ".join(f"--columns {each}" for each in choices))

    def _text(self, kind: str, stem: str) -> str:
        """Return the mapping that chooses the positions of a stem, and what is of the same kind."""
        parts = [f"q={stem}"]
        for quantity in ("qd", "qdd") if kind else ():
            same = [other for found, other in self._groups(quantity) if found == kind]
            parts += [f"{quantity}={same[0]}"] if len(same) == 1 else []
        return ",".join(parts)

    def _listed(self, group: ColumnGroup) -> str:
        names = [self._file.names[index] for index in group.values()]
        return ", ".join(names) if len(names) <= 3 else f"{names[0]} .. {names[-1]}"

    def _derivative(self, quantity: str, positions: ColumnGroup) -> None:
        """Choose the columns of a quantity that belong to the positions."""
        if quantity not in self._chosen:
            groups = self._groups(quantity)
            kind = self._names[next(iter(positions.values()))].kind
            same = {key: group for key, group in groups.items() if key[0] == kind}
            if len(same) > 1:
                choices = [f"{quantity}={stem}" for _, stem in same]
                self._refuse(f"two sets of columns are {quantity}", same, choices)
            if not same:
                return
            self._chosen[quantity] = next(iter(same.values()))
        found = self._chosen[quantity]
        if len(found) != len(positions) or (
            set(found) != set(positions) and not self._fitted(quantity, positions)
        ):
            message = (
                f"{len(positions)} positions ({self._listed(positions)}), but {len(found)} of {quantity} "
                f"({self._listed(found)})"
            )
            raise self._file.wrong(
                message, f"--columns {quantity}={NONE} leaves these out", self._first_name(found)
            )

    def _fitted(self, quantity: str, positions: ColumnGroup) -> bool:
        """Return whether columns can be taken in their order: they are numbered otherwise than positions."""
        found = self._chosen[quantity]
        if not all(isinstance(key, int) for key in (*found, *positions)):
            return False
        pairs = zip(sorted(positions, key=int), sorted(found, key=int), strict=True)
        self._chosen[quantity] = {ours: found[theirs] for ours, theirs in pairs}
        return True

    def _first_name(self, group: ColumnGroup) -> str:
        return self._file.names[next(iter(group.values()))]

    def _ordered(self, positions: ColumnGroup) -> list[int | str]:
        """Return the joints in order; refused where one of their numbers is missing."""
        numbers = [key for key in positions if isinstance(key, int)]
        if len(numbers) < len(positions):
            return list(positions)
        missing = sorted(set(range(1, max(numbers))) - set(numbers))
        if missing:
            stem, number = self._names[next(iter(positions.values()))].stem, missing[0]
            named = stem.replace("*", str(number)) if "*" in stem else f"{stem}{number}"
            message = f"the positions are {self._listed(positions)}: {named} is missing"
            raise self._file.wrong(
                message, "joints are numbered from 0 or from 1", self._first_name(positions)
            )
        return sorted(numbers)

    # time, names, notes

    def _time(self) -> int:
        if TIME in self._chosen:
            return next(iter(self._chosen.pop(TIME).values()))
        found = [index for index, read in enumerate(self._names) if read.quantity == TIME]
        if self._echo and len(found) > 1 and _STAMP in self._file.names:
            return self._stamp(found)
        if len(found) > 1:  # one that is called as its unit is the time where nothing else is
            units = [k for k in found if self._names[k].unit and self._names[k].stem == self._names[k].text]
            found = [k for k in found if k not in units] or found
        if len(found) == 1:
            return found[0]
        names = [self._file.names[index] for index in found]
        if names:
            choices = " or ".join(f"--columns t={name}" for name in names)
            raise self._file.wrong(f"{len(names)} columns are times: {', '.join(names)}", choices)
        shown = ", ".join(self._file.names[:_SHOWN])
        hint = f"name it: --columns t=NAME, or `check --rate HZ` where there is none; the columns are {shown}"
        raise self._file.wrong("no column is the time, such as t or time", hint)

    def _stamp(self, found: Sequence[int]) -> int:
        """Return the stamp of messages, or the time at which they came where they have none."""
        stamp = self._file.names.index(_STAMP)
        text = self._file.first[stamp] if stamp < len(self._file.first) else ""
        if text.strip().strip("0."):
            return stamp
        return next(index for index in found if index != stamp)

    def _move(self) -> int | None:
        chosen = self._chosen.pop(MOVE, None)
        if chosen is not None:
            return next(iter(chosen.values()))
        if self._mapping.get(MOVE, "").lower() == NONE:
            return None
        return next((index for index, read in enumerate(self._names) if read.quantity == MOVE), None)

    def _joint_names(self, keys: Sequence[int | str]) -> tuple[tuple[str, ...] | None, tuple[int, ...]]:
        """Return the names of the joints, and the columns whose rows hold them."""
        named = [key for key in keys if isinstance(key, str)]
        if named:
            return tuple(str(key) for key in keys), ()
        in_rows = {
            int(match[1]): index
            for index, name in enumerate(self._file.names)
            if (match := _ECHO_NAME.fullmatch(name)) is not None
        }
        if not set(keys) <= in_rows.keys() or len(self._file.first) < len(self._file.names):
            return None, ()
        columns = tuple(in_rows[int(key)] for key in keys)
        return tuple(self._file.first[index].strip().strip('"') for index in columns), columns


def note_of_unread(names: Sequence[str]) -> tuple[str, ...]:
    """Return the sentence that names the columns that are not read; nothing where there are none."""
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (f"columns that are not read: {', '.join(names[:_SHOWN])}{more}",) if names else ()


def _numbered_form(stem: str) -> str:
    """Return the pattern of names that begin with a stem and go on with a number."""
    return re.escape(stem) + r"[ _.\[(]*[0-9]+[\])]?"


def ordered_joints(
    file: NamedFile, roles: ColumnRoles, names: Sequence[str] | None, wanted: Sequence[str] | None
) -> tuple[list[int], tuple[str, ...] | None, tuple[str, ...]]:
    """Return which joints of a file are wanted, by index and in order, their names, and notes about it.

    Args:
        file: The file.
        roles: What its columns are.
        names: Names of its joints; None where it numbers them.
        wanted: Names of the joints that are expected; None where any are.

    Raises:
        InputError: When the file has other joints, or another number of them.
    """
    count = len(roles.joints["q"])
    doubled = next((name for index, name in enumerate(names or ()) if name in (names or ())[:index]), None)
    if doubled is not None:
        raise file.wrong(f"there are two joints '{doubled}'", "a joint has one name, which stands once")
    everything = list(range(count))
    if wanted is None:
        return everything, None if names is None else tuple(names), ()
    of_message = names is not None and roles.joint_names is None
    if names is not None and (of_message or set(wanted) & set(names)):
        missing = [name for name in wanted if name not in names]
        if missing:
            hint = did_you_mean(missing[0], names) or valid_names(names, "its joints are")
            none = of_message and len(missing) == len(wanted)
            more = "; rows that `trajcli convert` makes of it number them in this order" if none else ""
            raise file.wrong(f"there is no joint '{missing[0]}'", f"{hint}{more}")
        others = [name for name in names if name not in wanted]
        notes = (f"joints that are not of the robot: {', '.join(others)}",) if others else ()
        return [list(names).index(name) for name in wanted], tuple(wanted), notes
    if count != len(wanted):
        listed = ", ".join(names or (file.names[index] for index in roles.joints["q"]))
        message = f"{count} joint{'s' * (count != 1)} ({listed}), expected {len(wanted)}"
        raise file.wrong(message, f"the robot's joints are {', '.join(wanted)}")
    if names is None:
        return everything, tuple(wanted), ()
    note = f"joints are taken in the order of the file: {', '.join(names)} as {', '.join(wanted)}"
    return everything, tuple(wanted), (note,)
