"""Visuals of a URDF: which surfaces move with which row of its chain, and the files that hold them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.urdf.joint_properties import origin_of
from trajcli.urdf.mesh_files import Surface, ball, box, cylinder, read_mesh
from trajcli.urdf.read import Element, UrdfDocument, parse_urdf
from trajcli.urdf.serial_robot import links_of_rows, origins_and_table
from trajcli.urdf.tree import serial_path

_Color = tuple[float, float, float]


class RowSurface(NamedTuple):
    """A surface that moves with a row.

    Attributes:
        row: From 1; 0 is the base.
        surface: Its corners in the frame of the row, or of the base, m.
    """

    row: int
    surface: Surface


class Visuals(NamedTuple):
    """What a URDF shows.

    Attributes:
        surfaces: In the order of the chain.
        missing: Files that were not found, as the URDF names them.
        unread: Files that could not be read, each with the reason.
    """

    surfaces: tuple[RowSurface, ...]
    missing: tuple[str, ...]
    unread: tuple[str, ...]


def visuals_of(
    data: bytes, file: str, *, root: str | None = None, tip: str | None = None, exact: bool = False
) -> Visuals:
    """Return what a URDF shows of the chain of `robot_of_urdf`, and of what is fixed to it.

    A visual that is wrong, or whose file is, is left out.

    Args:
        data: The whole file.
        file: Its path, from whose folder others are looked for.
        root: Link where the chain begins, as there.
        tip: Link where it ends.
        exact: Whether angles near right ones are kept as they are.

    Raises:
        InputError: When the file is no URDF, or has no such chain.
    """
    document = parse_urdf(data, file, visuals=True)
    path = serial_path(document, root, tip)
    origins, table = origins_and_table(document, path, exact=exact)
    found = _Reader(document)
    for row, links in enumerate(links_of_rows(document, path, origins, table, [])):
        for link, pose in links:
            for visual in (each for each in document.links[link].inside if each.name == "visual"):
                found.add(row, pose, visual)
    return Visuals(tuple(found.surfaces), tuple(found.missing), tuple(found.unread))


class _Reader:
    """Surfaces of visuals, one after the other; each file is read once."""

    def __init__(self, document: UrdfDocument) -> None:
        self._document = document
        self._files: dict[str, list[Surface]] = {}
        self.surfaces: list[RowSurface] = []
        self.missing: dict[str, None] = {}
        self.unread: dict[str, None] = {}

    def add(self, row: int, pose: Array, visual: Element) -> None:
        """Add a visual of a link that stands so in the frame of a row."""
        try:
            pose = pose @ origin_of(self._document, visual)
            color = self._color(visual)
            for surface in self._shape(visual.first("geometry")):
                corners = surface.corners @ pose[:3, :3].T + pose[:3, 3]
                self.surfaces.append(RowSurface(row, Surface(corners, color or surface.color)))
        except InputError as error:
            self.unread[error.problems[0].text()] = None

    def _shape(self, geometry: Element | None) -> list[Surface]:
        """Return a box, a cylinder, a ball, or what a mesh holds."""
        numbers = self._document.numbers
        shape = None if geometry is None or not geometry.inside else geometry.inside[0]
        if shape is None:
            return []
        if shape.name == "box":
            return [Surface(box(numbers(shape, "size", 3, (0.0, 0.0, 0.0))))]
        if shape.name in ("cylinder", "sphere"):
            (radius,) = numbers(shape, "radius", 1, (0.0,)).tolist()
            (length,) = numbers(shape, "length", 1, (0.0,)).tolist()
            return [Surface(ball(radius) if shape.name == "sphere" else cylinder(radius, length))]
        if shape.name != "mesh":
            return []
        scale = numbers(shape, "scale", 3, (1.0, 1.0, 1.0))
        return [
            Surface(each.corners * scale, each.color)
            for each in self._mesh(shape.attributes.get("filename", ""))
        ]

    def _mesh(self, name: str) -> list[Surface]:
        if name not in self._files:
            self._files[name] = []
            path = found_file(name, Path(self._document.file))
            if path is None:
                self.missing[name] = None
            else:
                try:
                    self._files[name] = read_mesh(path)
                except (OSError, ValueError) as error:
                    reason = error.strerror if isinstance(error, OSError) else error
                    self.unread[f"{name}: {reason}"] = None
        return self._files[name]

    def _color(self, visual: Element) -> _Color | None:
        """Return the colour of a visual's material, its own or that of the robot with its name."""
        material = visual.first("material")
        named = (
            None if material is None else self._document.materials.get(material.attributes.get("name", ""))
        )
        for each in (material, named):
            color = None if each is None else each.first("color")
            if color is not None:
                red, green, blue, _ = self._document.numbers(color, "rgba", 4, (0.7, 0.7, 0.7, 1.0)).tolist()
                return red, green, blue
        return None


def found_file(name: str, urdf: Path) -> Path | None:
    """Return the file that a URDF names; None where it is in none of the places that are looked at.

    A package is looked for among the folders above the URDF, in those of ROS_PACKAGE_PATH, and in `share` of
    those of AMENT_PREFIX_PATH and CMAKE_PREFIX_PATH. Nothing is fetched.
    """
    scheme, separator, file = name.partition("://")
    file = unquote(file)
    if not separator:
        paths: Iterator[Path] = iter([urdf.parent / name])
    elif scheme == "file":
        paths = iter([Path(file)])
    elif scheme in ("package", "model"):
        package, _, inside = file.partition("/")
        paths = (folder / inside for folder in _packages(package, urdf))
    else:
        return None
    return next((path for path in paths if os.path.isfile(path)), None)  # noqa: PTH113  (Path's own may raise)


def _packages(package: str, urdf: Path) -> Iterator[Path]:
    """Yield the folders that may be those of a package."""
    for folder in urdf.absolute().parents:
        if folder.name == package:
            yield folder
        yield folder / package
    for variable, below in (
        ("ROS_PACKAGE_PATH", ""),
        ("AMENT_PREFIX_PATH", "share"),
        ("CMAKE_PREFIX_PATH", "share"),
    ):
        for entry in filter(None, os.environ.get(variable, "").split(os.pathsep)):
            folder = Path(entry) / below
            yield folder / package
            if folder.name == package:
                yield folder
