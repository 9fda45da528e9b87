"""Mesh files: scenes of COLLADA by products of scipy's rotations, polygons by their areas, names that look like data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.urdf.mesh_files import Surface, ball, box, cylinder, read_mesh

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1.5, 0.8, 0.3], [0.5, 1.4, 0.6], [-0.5, 0.8, 0.2], [0.3, 0.4, 2.0]])
TRIANGLES = np.array([[0, 1, 5], [1, 2, 5]])


def areas(corners: np.ndarray) -> np.ndarray:
    a, b, c = corners.swapaxes(0, 1)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def collada(nodes: str, *, up: str = "Z_UP", unit: str = "", more: str = "", scenes: str = "") -> bytes:
    """Return two triangles in green and one in blue, normals between the places of the points."""
    numbers = " ".join(map(str, POINTS.ravel()))
    places = " ".join(f"0 {place} 7" for place in TRIANGLES.ravel())
    paint = "".join(
        f'<effect id="e{k}"><profile_COMMON><technique><lambert><diffuse><color>{color} 1</color></diffuse></lambert>'
        f"</technique></profile_COMMON></effect>"
        for k, color in enumerate(("0 1 0.25", "0.125 0 1"))
    )
    materials = "".join(f'<material id="m{k}"><instance_effect url="#e{k}"/></material>' for k in (0, 1))
    inputs = '<input semantic="NORMAL" source="#n" offset="0"/><input semantic="VERTEX" source="#v" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2"/>'
    polygons = (
        f'<polygons material="b" count="1">{inputs}<p>{" ".join(f"0 {k} 7" for k in range(5))}</p></polygons>'
    )
    axis = f"<up_axis>{up}</up_axis>" if up else ""
    return f"""<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset>{unit}{axis}</asset>
<library_effects>{paint}</library_effects><library_materials>{materials}</library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array>{numbers}</float_array></source>
<vertices id="v"><input semantic="NORMAL" source="#n"/><input semantic="POSITION" source="#p"/></vertices>
<triangles material="a" count="2">{inputs}<p>{places}</p></triangles>{polygons}</mesh></geometry></library_geometries>
{more}<library_visual_scenes>{scenes}<visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


SHOWN = """<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="a" target="#m0"/>
<instance_material symbol="b" target="#m1"/></technique_common></bind_material></instance_geometry>"""


def read(content: bytes, folder: Path, name: str = "mesh.dae") -> list[Surface]:
    (folder / name).write_bytes(content)
    return read_mesh(folder / name)


def test_nodes_turn_scale_and_move_in_their_order_and_through_each_other(tmp_path: Path) -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_rotvec([0.3, -0.4, 0.5]).as_matrix(), [1, 2, 3]
    entries = " ".join(map(str, matrix.ravel()))
    inner = (
        f"<node><translate>4 5 6</translate><rotate>1 2 -2 70</rotate><scale>2 3 0.5</scale>{SHOWN}</node>"
    )
    found = read(collada(f"<node><matrix>{entries}</matrix>{inner}</node>"), tmp_path)
    turned = Rotation.from_rotvec(np.radians(70) * np.array([1, 2, -2]) / 3)
    inside = turned.apply(POINTS * [2, 3, 0.5]) + np.array([4, 5, 6])
    expected = inside @ matrix[:3, :3].T + matrix[:3, 3]
    assert found[0].corners == pytest.approx(expected[TRIANGLES])
    assert [surface.color for surface in found] == [(0.0, 1.0, 0.25), (0.125, 0.0, 1.0)]
    pentagon = found[1].corners
    assert len(pentagon) == 3
    assert pentagon[0, 0] == pytest.approx(expected[0])
    fan = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]])
    assert areas(pentagon) == pytest.approx(areas(expected[fan]))


UP = {  # where x, y and z of the file point, by the specification: right, up and in of the axis that is up
    "Z_UP": Rotation.identity(),
    "Y_UP": Rotation.from_euler("x", 90, degrees=True),
    "": Rotation.from_euler("x", 90, degrees=True),
}


@pytest.mark.parametrize("up", UP)
def test_what_is_up_becomes_z_and_the_unit_a_metre(up: str, tmp_path: Path) -> None:
    unit = '<unit meter="0.0254" name="inch"/>'
    found = read(collada(f"<node>{SHOWN}</node>", up=up, unit=unit), tmp_path)
    assert found[0].corners == pytest.approx((UP[up].apply(POINTS) * 0.0254)[TRIANGLES])


def test_x_that_is_up_becomes_z_and_y_points_left(tmp_path: Path) -> None:
    """With X_UP right is -y: `y` to the left of who looks along `z in`, as a rotation."""
    found = read(collada(f"<node>{SHOWN}</node>", up="X_UP"), tmp_path)
    x, y, z = POINTS.T
    assert found[0].corners == pytest.approx(np.stack([-y, -z, x], axis=1)[TRIANGLES])


def test_nodes_of_a_library_are_shown_where_they_are_named_in_the_scene_that_is_meant(tmp_path: Path) -> None:
    library = f'<library_nodes><node id="part"><translate>0 0 1</translate>{SHOWN}</node></library_nodes>'
    nodes = "".join(
        f'<node><translate>{x} 0 0</translate><instance_node url="#part"/></node>' for x in (10, 20)
    )
    other = f'<visual_scene id="other"><node>{SHOWN}</node></visual_scene>'
    found = read(collada(nodes, more=library, scenes=other), tmp_path)
    assert len(found) == 4
    for surface, x in zip(found[::2], (10, 20), strict=True):
        assert surface.corners == pytest.approx((POINTS + np.array([x, 0, 1]))[TRIANGLES])


def test_an_stl_may_be_called_after_what_it_holds(tmp_path: Path) -> None:
    text = "solid vertex 1 2 3 of a\nfacet normal 0 0 1\nouter loop\n"
    text += "".join(f"  vertex {x} {y} {z}\n" for x, y, z in POINTS[:3]) + "endloop\nendfacet\nendsolid\n"
    (surface,) = read(text.encode(), tmp_path, "mesh.stl")
    assert surface.corners == pytest.approx(POINTS[None, :3])


def test_faces_of_an_obj_count_from_either_end(tmp_path: Path) -> None:
    lines = [f"v {x} {y} {z} 0.5 0.5 0.5" for x, y, z in POINTS[:5]]
    lines += [
        "f -5/1/1 -4//2 -3 -2 -1",
        *(f"v {x} {y} {z}" for x, y, z in POINTS[5:]),
        "f 1 2 6",
        "f -6 -5 -1",
    ]
    (surface,) = read("\n".join(lines).encode(), tmp_path, "mesh.obj")
    wanted = POINTS[[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 5], [0, 1, 5]]]
    assert surface.corners == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("body", "size", "area"),
    [
        (box(np.array([1.0, 2.0, 3.0])), (1, 2, 3), 22.0),
        (cylinder(0.5, 2.0), (1, 1, 2), 2 * np.pi * 0.25 + np.pi * 2),
        (ball(0.5), (1, 1, 1), np.pi),
    ],
)
def test_bodies_are_closed_about_their_centres_and_face_outwards(
    body: np.ndarray, size: tuple[float, ...], area: float
) -> None:
    assert body.reshape(-1, 3).max(axis=0) == pytest.approx(np.array(size) / 2)
    assert body.reshape(-1, 3).min(axis=0) == pytest.approx(-np.array(size) / 2)
    assert areas(body).sum() == pytest.approx(area, rel=0.02)
    edges = np.round(body[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 6), 9) + 0.0
    edges = edges[np.abs(edges[:, :3] - edges[:, 3:]).max(axis=1) > 0]
    there = {tuple(edge) for edge in edges.tolist()}
    assert all((*edge[3:], *edge[:3]) in there for edge in there)  # each is passed the other way beside
