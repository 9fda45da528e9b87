"""Triangles of the mesh files of robot descriptions, STL, OBJ and COLLADA, and of boxes, cylinders, balls.

Sources: StereoLithography Interface Specification, 3D Systems (1988); Wavefront, Advanced Visualizer Manual,
appendix B1 (1993); COLLADA 1.4.1 specification, Khronos (2008).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array

MOST_BYTES = 200_000_000
_AROUND = 32  # corners of a circle
_UP = {  # what COLLADA calls up, as the z axis
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}


class Surface(NamedTuple):
    """Triangles of one colour.

    Attributes:
        corners: Shape (n, 3, 3): triangle, corner, x y z.
        color: Red, green and blue, each 0 to 1; None where the file says none.
    """

    corners: Array
    color: tuple[float, float, float] | None = None


def read_mesh(path: Path) -> list[Surface]:
    """Return the triangles of a file; its name's ending says what it is.

    Raises:
        OSError: When it cannot be read.
        ValueError: When it is none of these formats, larger than `MOST_BYTES`, or damaged.
    """
    readers = {".stl": _stl, ".obj": _obj, ".dae": _collada}
    read = readers.get(path.suffix.lower())
    if read is None:
        raise ValueError(f"a mesh is {', '.join(readers)}")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"it is larger than {MOST_BYTES / 1e6:g} MB")
    try:
        found = [each for each in read(path.read_bytes()) if len(each.corners)]
    except (IndexError, KeyError, AttributeError, TypeError, SyntaxError, RecursionError) as error:
        raise ValueError("it is damaged") from error
    if not found or not all(np.isfinite(each.corners).all() for each in found):
        raise ValueError("it holds no triangles, or some that are nowhere")
    return found


def _stl(data: bytes) -> Iterator[Surface]:
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count:  # an ASCII file has words where this number is
        records = np.frombuffer(
            data, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("", "<u2")]), offset=84
        )
        yield Surface(records["corners"].astype(float))
        return
    lines = map(str.split, data.decode("ascii", "replace").splitlines())
    words = [line[1:4] for line in lines if line[:1] == ["vertex"]]
    yield Surface(np.array(words, float).reshape(-1, 3, 3))


def _obj(data: bytes) -> Iterator[Surface]:
    points: list[list[float]] = []
    corners: list[int] = []
    for line in data.decode("utf-8", "replace").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "f":
            numbers = [int(word.partition("/")[0]) for word in words]
            indices = [number - 1 if number > 0 else len(points) + number for number in numbers]
            corners += _fan(indices)
    yield Surface(np.array(points, float).reshape(-1, 3)[np.array(corners, int)].reshape(-1, 3, 3))


def _fan(corners: Sequence[int]) -> list[int]:
    """Return the corners of the triangles of a polygon, one after the other."""
    return [corner for k in range(1, len(corners) - 1) for corner in (corners[0], corners[k], corners[k + 1])]


def _collada(data: bytes) -> Iterator[Surface]:
    from xml.etree import ElementTree as ET

    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ValueError("a DOCTYPE is refused: it can make a small file unpack to a huge one")
    root = ET.fromstring(data)  # noqa: S314  (without a DOCTYPE there are no entities)
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    unit = root.find("asset/unit")
    up = root.findtext("asset/up_axis", "Y_UP").strip()
    turn = _UP.get(up, np.eye(3)) * (1.0 if unit is None else float(unit.get("meter", "1")))
    named = {str(element.get("id")): element for element in root.iter() if element.get("id")}
    scene = root.find("scene/instance_visual_scene")
    start = root.find("library_visual_scenes/visual_scene") if scene is None else named.get(_target(scene))
    for node in () if start is None else start.findall("node"):
        for surface in _nodes(node, np.eye(4), named):
            yield Surface(surface.corners @ turn.T, surface.color)


def _target(element: Any) -> str:  # noqa: ANN401
    return str(element.get("url") or element.get("target") or element.get("source") or "").removeprefix("#")


def _nodes(
    node: Any,  # noqa: ANN401
    pose: Array,
    named: dict[str, Any],
    around: tuple[Any, ...] = (),
) -> Iterator[Surface]:
    """Yield what stands in a node, which stands in others, and in those below it."""
    if node in around:
        raise ValueError("a node of it holds itself")
    pose = pose @ _pose(node)
    for instance in node.findall("instance_geometry"):
        bound = {each.get("symbol"): _target(each) for each in instance.iter("instance_material")}
        mesh = named[_target(instance)].find("mesh")
        for part in () if mesh is None else mesh:
            if part.tag in ("triangles", "polylist", "polygons"):
                corners = _corners(part, mesh, named)
                color = _color(named.get(bound.get(part.get("material"), "")), named)
                yield Surface(corners @ pose[:3, :3].T + pose[:3, 3], color)
    others = [named[_target(other)] for other in node.findall("instance_node")]
    for below in (*others, *node.findall("node")):
        yield from _nodes(below, pose, named, (*around, node))


def _pose(node: Any) -> Array:  # noqa: ANN401
    """Return the transformation of a node, (4, 4): its elements one after the other."""
    pose = np.eye(4)
    for element in node:
        if element.tag not in ("matrix", "translate", "rotate", "scale"):
            continue
        numbers, step = np.array(element.text.split(), float), np.eye(4)
        if element.tag == "matrix":
            step = numbers.reshape(4, 4)
        elif element.tag == "translate":
            step[:3, 3] = numbers
        elif element.tag == "scale":
            step[:3, :3] = np.diag(numbers)
        else:
            (x, y, z), angle = numbers[:3] / np.linalg.norm(numbers[:3]), numbers[3] * pi / 180
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            step[:3, :3] = (
                np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
            )  # Rodrigues
        pose = pose @ step
    return pose


def _corners(part: Any, mesh: Any, named: dict[str, Any]) -> Array:  # noqa: ANN401
    """Return the triangles of a part of a mesh, (n, 3, 3); polygons as fans."""
    inputs = part.findall("input")
    stride = 1 + max(int(each.get("offset")) for each in inputs)
    vertex = next(each for each in inputs if each.get("semantic") == "VERTEX")
    positions = next(
        each for each in named[_target(vertex)].findall("input") if each.get("semantic") == "POSITION"
    )
    source = named[_target(positions)]
    points = np.array(source.findtext("float_array", "").split(), float).reshape(-1, 3)
    lists = [np.array((each.text or "").split(), int).reshape(-1, stride) for each in part.findall("p")]
    rows = [each[:, int(vertex.get("offset"))] for each in lists]
    if part.tag == "polylist":
        ends = np.cumsum(np.array(part.findtext("vcount", "").split(), int))
        rows = np.split(rows[0], ends[:-1])
    if part.tag != "triangles":
        rows = [np.array(_fan(row.tolist()), int) for row in rows]
    return points[np.concatenate(rows)].reshape(-1, 3, 3) if rows else np.empty((0, 3, 3))


def _color(material: Any, named: dict[str, Any]) -> tuple[float, float, float] | None:  # noqa: ANN401
    """Return the diffuse colour of a material; None where it is a picture, or there is none."""
    effect = None if material is None else material.find("instance_effect")
    found = None if effect is None else named[_target(effect)].find(".//diffuse/color")
    if found is None:
        return None
    red, green, blue = map(float, found.text.split()[:3])
    return red, green, blue


def box(size: Array) -> Array:
    """Return the triangles of a box about its centre, (12, 3, 3)."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return np.asarray((signs * size)[[corner for side in sides for corner in _fan(side)]].reshape(-1, 3, 3))


def turned(profile: Sequence[tuple[float, float]]) -> Array:
    """Return the triangles of a profile of radii and heights that turns about z, (n, 3, 3)."""
    angles = np.linspace(0, 2 * pi, _AROUND + 1)
    rings = [
        np.stack([r * np.cos(angles), r * np.sin(angles), np.full(angles.size, z)], axis=1)
        for r, z in profile
    ]
    parts: list[NDArray[np.float64]] = []
    for low, high in pairwise(rings):
        parts.append(np.stack([low[:-1], low[1:], high[1:]], axis=1))
        parts.append(np.stack([low[:-1], high[1:], high[:-1]], axis=1))
    return np.concatenate(parts)


def cylinder(radius: float, length: float) -> Array:
    """Return the triangles of a cylinder about z, its centre in the middle, (n, 3, 3)."""
    return turned([(0.0, -length / 2), (radius, -length / 2), (radius, length / 2), (0.0, length / 2)])


def ball(radius: float) -> Array:
    """Return the triangles of a ball, (n, 3, 3)."""
    angles = np.linspace(-pi / 2, pi / 2, _AROUND // 2 + 1)
    return turned([(radius * float(np.cos(a)), radius * float(np.sin(a))) for a in angles])
