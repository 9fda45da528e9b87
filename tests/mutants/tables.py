"""Tables of the mutation campaign: files with their tests, operators, scores, mutants by hand, survivors with reasons."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
KINDS = ("equivalent", "convention", "small")


@dataclass(frozen=True)
class Survivor:
    """A mutant that no test kills, by its line before and after, and why it may live."""

    file: str
    line: str
    change: str
    kind: str
    why: str


@dataclass(frozen=True)
class Planted:
    """A mutant that somebody wrote: a text that stands in a file, and what takes its place where it first stands."""

    file: str
    text: str
    change: str


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads((HERE / name).read_text(encoding="utf-8"))


def subjects() -> dict[str, tuple[str, ...]]:
    """Return the tests of each file, by the path of the file."""
    return {
        path: tuple(group["tests"]) for group in _read("subjects.toml")["subject"] for path in group["files"]
    }


def operators() -> frozenset[str]:
    """Return the names of the operators of Cosmic Ray that are used."""
    return frozenset(_read("subjects.toml")["operators"])


def read_survivors() -> list[Survivor]:
    """Return the survivors that have a reason."""
    return [Survivor(**entry) for entry in _read("survivors.toml").get("survivor", [])]


def read_planted() -> list[Planted]:
    """Return the mutants that somebody wrote, file by file."""
    return [Planted(path, *pair) for path, pairs in _read("planted.toml").items() for pair in pairs]


def read_scores() -> dict[str, dict[str, int]]:
    """Return by file how many mutants there are, were tried and survived, and the seed of the sample."""
    return dict(_read("scores.toml"))


def write_score(place: Path, path: str, score: Mapping[str, int]) -> None:
    """Write the score of one file into the table of scores, which stays sorted by file."""
    line = f'"{path}" = {{ ' + ", ".join(f"{name} = {value}" for name, value in score.items()) + " }"
    head, *lines = place.read_text(encoding="utf-8").splitlines()
    kept = [other for other in lines if re.match(r'"([^"]+)"', other) and not other.startswith(f'"{path}"')]
    place.write_text("\n".join([head, *sorted([*kept, line])]) + "\n", encoding="utf-8")
