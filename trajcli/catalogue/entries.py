"""Robots that come with trajcli: their names, and the robot file of each, out of the one file that holds all.

Little is imported: the shell asks for the names.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

CATALOGUE = Path(__file__).parent / "robots.yaml"
"""The file of all robots: a YAML document each, with its name as the document's anchor."""
_BEGINNING = re.compile(r"^--- &(\w+)\n", re.MULTILINE)


def catalogue_names() -> list[str]:
    """Return the names of the robots that come with trajcli, sorted."""
    return list(_robot_files())


def robot_file(name: str) -> str:
    """Return the text of a robot file of the catalogue.

    Raises:
        KeyError: When the catalogue has no such robot.
    """
    return _robot_files()[name]


def nearest_robots(name: str) -> str:
    """Return which robots are meant by a name that the catalogue does not have, and how to see all."""
    from trajcli.suggest import did_you_mean, nearest_names

    names = catalogue_names()
    near = did_you_mean(name, names) or f"its nearest names are {', '.join(nearest_names(name, names))}"
    return f"{near}{'' if near.endswith('?') else ';'} `trajcli robots` lists all {len(names)}"


@cache
def _robot_files() -> dict[str, str]:
    """Return the text of each robot file by its name."""
    _, *parts = _BEGINNING.split(CATALOGUE.read_text(encoding="utf-8"))
    return dict(sorted(zip(parts[::2], parts[1::2], strict=True)))
