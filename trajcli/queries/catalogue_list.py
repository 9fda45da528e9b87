"""List of the catalogue: what its table says of each robot, in an index beside the files, and choice from it.

The index says of which files it was made: of others the list is made anew, robot by robot.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Sequence
from typing import Any

from trajcli.catalogue.entries import CATALOGUE, catalogue_names
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.suggest import did_you_mean

INDEX = CATALOGUE.with_name("index.json")
"""The file of the index, which `make docs` writes."""
IN_INDEX = ("name", "title", "joints", "kind", "reach", "units", "maker", "origin")
"""What the index says of a robot: what the table shows, and what robots are chosen by."""
_ORIGINS = ("real", "textbook")


@comparable
class Selection:
    """Which robots of the catalogue are meant; what is None chooses nothing.

    Attributes:
        kind: The joints from the base on, such as "6R" or "RRPR", or an origin: "real", "textbook".
        joints: How many there are.
        maker: Part of the maker's name, in letters of any case.
        text: Part of the name in the catalogue or of the robot's own name, in letters of any case.
    """

    kind: str | None = None
    joints: int | None = None
    maker: str | None = None
    text: str | None = None


def catalogue_rows() -> list[dict[str, Any]]:
    """Return what the table says of each robot of the catalogue: `IN_INDEX`."""
    try:
        index = json.loads(INDEX.read_bytes())
        if index["files"] == checksum():
            return list(index["robots"])
    except (OSError, ValueError, KeyError, TypeError):
        pass  # without an index the list only takes longer
    return [{key: row[key] for key in IN_INDEX} for row in rows_of_files()]


def checksum() -> int:
    """Return a number that a catalogue with another text hardly has."""
    return zlib.crc32(CATALOGUE.read_bytes())


def rows_of_files() -> list[dict[str, Any]]:
    """Return all that a list says of each robot, of its file: `trajcli.queries.robot_card.robot_row`."""
    from trajcli.queries.arm import open_sheet
    from trajcli.queries.robot_card import robot_row

    return [robot_row(name, open_sheet(name)) for name in catalogue_names()]


def selected(rows: Sequence[dict[str, Any]], selection: Selection) -> list[dict[str, Any]]:
    """Return the rows of the robots that a selection means.

    Raises:
        InputError: When no robot has that kind, or no maker that name.
    """
    _check_selection(rows, selection)
    return [row for row in rows if _is_selected(row, selection)]


def _check_selection(rows: Sequence[dict[str, Any]], selection: Selection) -> None:
    """Refuse a kind and a maker that no robot has."""
    kinds = [*sorted({row["kind"] for row in rows}), *_ORIGINS]
    if selection.kind is not None and _letters(selection.kind) not in map(_letters, kinds):
        hint = did_you_mean(selection.kind, kinds) or f"the catalogue has {', '.join(kinds)}"
        raise InputError(f"the catalogue has no robot of the kind '{selection.kind}'", hint=hint)
    makers = sorted({row["maker"] for row in rows if row["maker"]})
    part = (selection.maker or "").casefold()
    if not any(part in maker.casefold() for maker in makers):
        hint = did_you_mean(part, makers) or f"makers are {', '.join(makers)}"
        raise InputError(f"the catalogue has no robot of a maker '{selection.maker}'", hint=hint)


def _is_selected(row: dict[str, Any], selection: Selection) -> bool:
    return (
        (selection.kind is None or _letters(selection.kind) in (_letters(row["kind"]), row["origin"]))
        and (selection.joints is None or row["joints"] == selection.joints)
        and (not selection.maker or selection.maker.casefold() in (row["maker"] or "").casefold())
        and (selection.text or "").casefold() in f"{row['name']}\n{row['title']}".casefold()
    )


def _letters(kind: str) -> str:
    """Return a kind letter by letter: "6r" as "RRRRRR"; any other word in small letters."""
    count, letter = kind[:-1], kind[-1:].upper()
    if count.isascii() and count.isdigit() and len(count) <= 2 and letter in ("R", "P"):
        return letter * int(count)
    return kind.upper() if kind and set(kind.upper()) <= {"R", "P"} else kind.casefold()
