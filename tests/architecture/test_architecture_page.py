"""The map of the house names only what exists, and names every package."""

from __future__ import annotations

import ast
import re
from functools import cache
from importlib import import_module

from sources import ROOT, the_sources

PAGE = ROOT / "docs" / "architecture.md"
MOST_LINES = 120  # two pages
OUTSIDE = {"N", "X"}


def quoted(text: str) -> set[str]:
    return set(re.findall(r"`([^`\n]+)`", text))


@cache
def classes() -> set[str]:
    return {
        node.name if isinstance(node, ast.ClassDef) else ast.unparse(node.targets[0])
        for tree in the_sources().trees.values()
        for node in tree.body
        if isinstance(node, ast.ClassDef | ast.Assign)
    }


def missing(text: str) -> set[str]:
    """Return the names of a page that nothing has."""
    known, wrong = classes(), set()
    for name in quoted(text):
        if re.fullmatch(r"(trajcli|tests|docs)/[\w/.]*", name):
            if not (ROOT / name).exists():
                wrong.add(name)
        elif re.fullmatch(r"trajcli(\.\w+)+", name):
            if not _resolves(name):
                wrong.add(name)
        elif re.fullmatch(r"[A-Z][a-z]\w+", name) and name not in known:
            wrong.add(name)
    return wrong


def _resolves(name: str) -> bool:
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            value = import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[count:]:
            if not hasattr(value, attribute):
                return False
            value = getattr(value, attribute)
        return True
    return False


def test_every_name_of_the_map_exists() -> None:
    assert not missing(PAGE.read_text(encoding="utf-8"))


def test_a_name_that_nothing_has_is_found() -> None:
    page = "`trajcli/curves/nothing.py` `trajcli.planning.plan.nothing` `Nothing` `trajcli/curves/` `Robot`"
    assert missing(page) == {"trajcli/curves/nothing.py", "trajcli.planning.plan.nothing", "Nothing"}


def test_the_map_names_every_package() -> None:
    packages = {
        path.parent.relative_to(ROOT).as_posix() + "/" for path in (ROOT / "trajcli").rglob("__init__.py")
    } - {"trajcli/"}
    assert packages <= quoted(PAGE.read_text(encoding="utf-8"))


def test_the_map_has_two_pages() -> None:
    assert len(PAGE.read_text(encoding="utf-8").splitlines()) <= MOST_LINES
