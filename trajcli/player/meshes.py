"""Visual meshes of a URDF as a page shows them: simplified to a budget, and packed.

Source: Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes, Modeling in
Computer Graphics (1993): points of one cell of a grid become one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.job.read import LoadedJob
from trajcli.job.robot import is_urdf
from trajcli.job.yaml.document import read_bytes
from trajcli.player.rows import packed
from trajcli.urdf.read import MAX_BYTES
from trajcli.urdf.visuals import RowSurface, Visuals, visuals_of

_FINEST = 2e-5  # of the size of all: points that are nearer are one
_COARSER = 1.35  # from one grid to the next
_BASE64 = 4 / 3
_NAMES = 6  # of files in a remark


class _Mesh(NamedTuple):
    """Triangles of one colour that move with a row: points (n, 3), and the three of each triangle (m, 3)."""

    row: int
    color: tuple[float, float, float] | None
    points: Array
    faces: NDArray[np.intp]

    @property
    def width(self) -> int:
        """How many bytes the number of a point takes."""
        return 2 if len(self.points) <= 65536 else 3

    @property
    def size(self) -> float:
        """How long it is in a page, bytes."""
        return _BASE64 * (6 * len(self.points) + 3 * self.width * len(self.faces)) + 200


def meshes_of_job(loaded: LoadedJob, budget: float) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the meshes of a job's URDF as the page reads them, and what there is to say of them.

    Args:
        loaded: The job; without a URDF, or where the arm is on a rail, there are none.
        budget: How long they may be, MB.
    """
    node = loaded.document.node(("robot",))
    source = None if node is None else node.plain()
    if budget <= 0 or not isinstance(source, Mapping) or not isinstance(source.get("urdf"), str):
        return [], []
    file = loaded.document.file
    folder = Path.cwd() if file in ("-", "<stdin>") else Path(file).parent
    options = {key: source[key] for key in ("root", "tip", "exact") if key in source}
    return _meshes(str(folder / source["urdf"]), options, budget)


def meshes_of_robot(name: str | None, budget: float) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the same of an arm that is named by the path of a URDF."""
    return _meshes(name, {}, budget) if name is not None and budget > 0 and is_urdf(name) else ([], [])


def _meshes(path: str, options: Mapping[str, Any], budget: float) -> tuple[list[dict[str, Any]], list[str]]:
    visuals = visuals_of(read_bytes(path, MAX_BYTES), path, **options)
    before = sum(len(each.surface.corners) for each in visuals.surfaces)
    meshes = _within(_welded(visuals.surfaces), 1e6 * budget)
    after = sum(len(mesh.faces) for mesh in meshes)
    return [_packed(mesh) for mesh in meshes], [*_remarks(visuals, before, after)]


def _welded(surfaces: Sequence[RowSurface]) -> list[_Mesh]:
    """Return surfaces with each point once; those of one row and colour are one."""
    corners: dict[tuple[int, tuple[float, float, float] | None], list[Array]] = {}
    for row, surface in surfaces:
        corners.setdefault((row, surface.color), []).append(surface.corners.reshape(-1, 3))
    return [
        _Mesh(row, color, points := np.concatenate(parts), np.arange(len(points)).reshape(-1, 3))
        for (row, color), parts in corners.items()
    ]


def _within(meshes: list[_Mesh], size: float) -> list[_Mesh]:
    """Return meshes that are no longer than so many bytes: on the finest grid of some that does it."""
    if not meshes:
        return []
    extent = max(float(np.ptp(mesh.points, axis=0).max()) for mesh in meshes)
    cell = _FINEST * max(extent, 1e-6)
    meshes = [_clustered(mesh, cell) for mesh in meshes]
    while sum(mesh.size for mesh in meshes) > size and cell < extent:
        cell *= _COARSER
        meshes = [_clustered(mesh, cell) for mesh in meshes]
    return [mesh for mesh in meshes if len(mesh.faces)]


def _clustered(mesh: _Mesh, cell: float) -> _Mesh:
    """Return a mesh whose points in one cell of a grid are one, in their middle."""
    cells = np.floor(mesh.points / cell).astype(np.int64)
    _, number, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    sums = [np.bincount(number, weights=column) for column in mesh.points.T]
    faces = number[mesh.faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    # the smallest first, in the same sense: triangles that have become one
    first = faces.argmin(axis=1)[:, None]
    faces = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1)
    faces = np.unique(faces, axis=0) if len(faces) else faces
    used, renumbered = np.unique(faces, return_inverse=True)
    points = (np.array(sums) / count).T[used]
    return mesh._replace(points=points, faces=renumbered.reshape(-1, 3))


def _packed(mesh: _Mesh) -> dict[str, Any]:
    color = mesh.color and "#" + "".join(
        f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in mesh.color
    )
    return {
        "row": mesh.row,
        "color": color,
        "points": packed(mesh.points.T),
        "count": len(mesh.points),
        "faces": packed(mesh.faces.T.astype(float), mesh.width),
        "triangles": len(mesh.faces),
    }


def _remarks(visuals: Visuals, before: int, after: int) -> Iterator[str]:
    if before:
        simpler = f", simplified to {after:,}" if after < before else ""
        yield f"meshes of the URDF: {before:,} triangles{simpler}"
    elif not visuals.missing and not visuals.unread:
        yield "the URDF has no visual meshes: its links are drawn from its table"
    for words, names in (("not found", visuals.missing), ("not read", visuals.unread)):
        if names:
            more = f" and {len(names) - _NAMES} more" if len(names) > _NAMES else ""
            yield f"meshes {words}, their links are drawn from the table: {', '.join(names[:_NAMES])}{more}"
