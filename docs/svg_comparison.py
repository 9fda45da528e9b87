"""Comparison of two SVG pictures by what they show: texts, and the curves and marks of each panel.

Versions of matplotlib write the same picture in other bytes. So texts are compared word by word, and what is
drawn of each part that trajcli names ("panel0-source0") by its extent and its length.
"""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

Extent = NDArray[np.float64]

_PART = re.compile(r"(?:panel\d+|view-\w+?)-[a-z][\w-]*")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_SVG = "{http://www.w3.org/2000/svg}"
_NEAR = 0.5  # points, of 1/72 inch
_LENGTH = 0.01


def is_current(picture: Path, drawn: bytes) -> bool:
    """Return whether a file shows what was drawn; a file that is not there does not."""
    return picture.exists() and same_picture(picture.read_bytes(), drawn)


def same_picture(first: bytes, second: bytes) -> bool:
    """Return whether two pictures have the same texts, and the same parts of the same extent and length."""
    if first == second:
        return True
    one, two = ET.fromstring(first), ET.fromstring(second)  # noqa: S314
    if _texts(one) != _texts(two):
        return False
    a, b = _parts(one), _parts(two)
    return [name for name, _ in a] == [name for name, _ in b] and all(
        np.allclose(x, y, rtol=_LENGTH, atol=_NEAR) for (_, x), (_, y) in zip(a, b, strict=True)
    )


def _texts(picture: ET.Element) -> list[str]:
    return ["".join(text.itertext()) for text in picture.iter(f"{_SVG}text")]


def _parts(picture: ET.Element) -> list[tuple[str, Extent]]:
    """Return the named parts in the order of their names, each with its extent and length."""
    parts = [
        (group.get("id", ""), _extent(group))
        for group in picture.iter(f"{_SVG}g")
        if _PART.fullmatch(group.get("id", ""))
    ]
    return sorted(parts, key=lambda part: (part[0], *part[1].tolist()))


def _extent(group: ET.Element) -> Extent:
    """Return left, top, right, bottom and the length of all that is drawn in a group, points."""
    lines = [_points(path.get("d", "")) for path in group.iter(f"{_SVG}path")]
    marks = [[float(use.get("x", "0")), float(use.get("y", "0"))] for use in group.iter(f"{_SVG}use")]
    known = np.vstack([*[line for line in lines if line.size], np.array(marks).reshape(-1, 2)])
    if not known.size:
        return np.zeros(5)
    length = sum(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines if len(line) > 1)
    return np.array([*known.min(axis=0), *known.max(axis=0), length])


def _points(data: str) -> NDArray[np.float64]:
    numbers = [float(text) for text in _NUMBER.findall(data)]
    return np.array(numbers).reshape(-1, 2)
