"""Nearest valid names, for messages about a name that does not exist."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Mapping, Sequence

_QUOTED = 100  # characters of a text in messages
_LONGEST = 64  # characters: nobody mistypes more, and difflib's time grows with the square
_LISTED = 24


def abridged(text: str) -> str:
    """Return a text of a file as messages quote it: in one line, and of a long one the beginning."""
    short = text if len(text) <= _QUOTED else f"{text[:_QUOTED]}..."
    return short if short.isprintable() else repr(short)[1:-1]


def nearest(name: str, names: Iterable[str]) -> str | None:
    """Return the valid name nearest to `name`, or None when none is near.

    Case, and `-` or a space for `_`, count for nothing.
    """
    from difflib import get_close_matches

    if not name or len(name) > _LONGEST:
        return None
    plain: dict[str, str] = {}
    for valid in names:
        plain.setdefault(_plain(valid), valid)
    near = get_close_matches(_plain(name), plain, 1)
    return plain[near[0]] if near else None


def meant_word(
    mapping: Mapping[str, Any], key: str, keys: Container[str], words: Sequence[str]
) -> str | None:
    """Return which of `words` a mapping gives under a key, both perhaps mistyped; without it the first."""
    near = key if key in mapping else nearest(key, (other for other in mapping if other not in keys))
    return nearest(str(mapping.get(near or "", words[0])), words)


def nearest_names(name: str, names: Iterable[str], count: int = 3) -> list[str]:
    """Return the valid names that are most like `name`, the nearest first, however little they are."""
    from difflib import get_close_matches

    plain = {_plain(valid): valid for valid in names}
    return [plain[near] for near in get_close_matches(_plain(name[:_LONGEST]), plain, count, cutoff=0.0)]


def did_you_mean(name: str, names: Iterable[str]) -> str | None:
    """Return the hint "did you mean 'x'?" for the nearest valid name, or None when none is near."""
    near = nearest(name, names)
    return f"did you mean '{near}'?" if near is not None else None


def named_like(name: str, names: Iterable[str]) -> str | None:
    """Return the hint that asks for the names that begin with `name`, else for the nearest; or None."""
    every = list(names)
    longer = [f"'{each}'" for each in every if name and _plain(each).startswith(_plain(name))]
    return f"did you mean {' or '.join(longer)}?" if longer else did_you_mean(name, every)


def valid_names(names: Iterable[str], what: str = "valid names") -> str | None:
    """Return the hint that lists the valid names, of many the first; None when there are none."""
    every = list(names)
    if not every:
        return None
    more = f" ... ({len(every) - _LISTED} more)" if len(every) > _LISTED else ""
    return f"{what}: {', '.join(every[:_LISTED])}{more}"


def _plain(name: str) -> str:
    return name.casefold().replace("-", "_").replace(" ", "_")
