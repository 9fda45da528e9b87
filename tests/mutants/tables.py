"""Tables of the mutation campaign: files with their tests, operators, scores, mutants by hand, survivors with reasons."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
KILLERS = HERE / "killers.json"
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


@cache
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


def _mark(mutant: Planted) -> str:
    return hashlib.sha256("\0".join([mutant.file, mutant.text, mutant.change]).encode()).hexdigest()[:12]


def read_killers() -> dict[Planted, str]:
    """Return the test that last killed each planted mutant, where that is written down."""
    marks = json.loads(KILLERS.read_text(encoding="utf-8"))
    tests = {mark: test for test, killed in marks.items() for mark in killed}
    return {mutant: tests[_mark(mutant)] for mutant in read_planted() if _mark(mutant) in tests}


def write_killers(killers: Mapping[Planted, str | None]) -> None:
    """Write down which test killed each of these mutants, None for none; of mutants that are planted no more nothing is kept."""
    by_test: dict[str, list[str]] = {}
    for mutant, test in (read_killers() | killers).items():
        if test is not None:
            by_test.setdefault(test, []).append(_mark(mutant))
    lines = [f"  {json.dumps(test)}: {json.dumps(sorted(marks))}" for test, marks in sorted(by_test.items())]
    KILLERS.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def read_scores() -> dict[str, dict[str, int]]:
    """Return by file how many mutants there are, were tried and survived, and the seed of the sample."""
    return dict(_read("scores.toml"))


def write_score(place: Path, path: str, score: Mapping[str, int]) -> None:
    """Write the score of one file into the table of scores, which stays sorted by file."""
    line = f'"{path}" = {{ ' + ", ".join(f"{name} = {value}" for name, value in score.items()) + " }"
    head, *lines = place.read_text(encoding="utf-8").splitlines()
    kept = [other for other in lines if re.match(r'"([^"]+)"', other) and not other.startswith(f'"{path}"')]
    place.write_text("\n".join([head, *sorted([*kept, line])]) + "\n", encoding="utf-8")
