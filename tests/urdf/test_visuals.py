"""Visual meshes of URDFs: read, found, placed, simplified.

Oracles: the volume inside a closed surface by the theorem of Gauss, poses of links by an independent reader, the
distance of points from a sphere.
"""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from independent_reader import ReadBack

from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.forward import link_poses
from trajcli.planning.plan import plan_job
from trajcli.player.meshes import meshes_of_job, meshes_of_robot
from trajcli.player.scene import scene_of_plan
from trajcli.urdf import visuals
from trajcli.urdf.mesh_files import ball, box, cylinder, read_mesh
from trajcli.urdf.serial_robot import robot_of_urdf
from trajcli.urdf.visuals import found_file, visuals_of

SIZE = np.array([0.2, 0.3, 0.4])
POINTS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * SIZE
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TRIANGLES = POINTS[[[q[0], q[k], q[k + 1]] for q in QUADS for k in (1, 2)]]


def volume(corners: np.ndarray) -> float:
    """Return the volume inside a closed surface: a sixth of the sum of the triple products of its triangles."""
    return abs(float(np.linalg.det(corners).sum())) / 6


def stl_binary() -> bytes:
    records = b"".join(struct.pack("<12fH", *[0.0] * 3, *triangle.ravel(), 0) for triangle in TRIANGLES)
    return b"solid is what some begin with".ljust(80) + struct.pack("<I", len(TRIANGLES)) + records


def stl_ascii() -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in triangle)
        + "endloop\nendfacet\n"
        for triangle in TRIANGLES
    )
    return f"solid box\n{facets}endsolid box\n".encode()


def obj() -> bytes:
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS)
    faces = "".join(f"f {q[0] + 1}/1/1 {q[1] + 1}//2 {q[2] + 1} {q[3] - 8}\n" for q in QUADS)
    return f"# box\nvn 0 0 1\n{points}{faces}".encode()


def dae(kind: str = "polylist") -> bytes:
    """Return the box in mm with y up, turned by a node and moved, in red."""
    ours = POINTS @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]).T * 1000  # z up is y up there
    numbers = " ".join(f"{value:g}" for value in (ours - [10, 0, 0]).ravel())
    rows = QUADS if kind == "polylist" else [[q[0], q[k], q[k + 1]] for q in QUADS for k in (1, 2)]
    places = " ".join(f"{place} 0" for row in rows for place in row)
    count = f"<vcount>{' '.join(str(len(row)) for row in rows)}</vcount>" if kind == "polylist" else ""
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.001" name="mm"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique><phong><diffuse><color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="f" count="24">{numbers}</float_array></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<{kind} material="paint" count="{len(rows)}"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#n" offset="1"/>{count}<p>{places}</p></{kind}>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>10 0 0</translate><rotate>0 1 0 360</rotate><node><scale>1 1 1</scale>
<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="paint" target="#m"/></technique_common></bind_material></instance_geometry>
</node></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>""".encode()


FILES = {
    "a.stl": stl_binary,
    "b.STL": stl_ascii,
    "c.obj": obj,
    "d.dae": dae,
    "e.dae": lambda: dae("triangles"),
}


@pytest.mark.parametrize("name", FILES)
def test_formats_hold_the_same_box(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(FILES[name]())
    (surface,) = read_mesh(tmp_path / name)
    assert volume(surface.corners) == pytest.approx(np.prod(SIZE))
    assert np.allclose(surface.corners.reshape(-1, 3).max(axis=0), SIZE / 2, atol=1e-7)
    assert surface.color == ((1.0, 0.0, 0.0) if name.endswith("dae") else None)


def test_plain_bodies_have_their_volumes() -> None:
    slices = 32 * np.sin(2 * np.pi / 32) / 2  # of a circle of radius 1, as a polygon
    assert volume(box(SIZE)) == pytest.approx(np.prod(SIZE))
    assert volume(cylinder(0.1, 0.5)) == pytest.approx(slices * 0.01 * 0.5)
    assert volume(ball(0.1)) == pytest.approx(4 / 3 * np.pi * 1e-3, rel=0.03)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.stl", stl_binary()[:-10], "it holds no triangles"),
        ("a.stl", b"", "it holds no triangles"),
        ("a.stl", stl_ascii().replace(b"0.2", b"nan"), "nowhere"),
        ("a.obj", obj() + b"f 1 2 99\n", "damaged"),
        ("a.dae", b"<COLLADA", "damaged"),
        ("a.dae", b'<!DOCTYPE x [<!ENTITY a "b">]><COLLADA/>', "DOCTYPE"),
        ("a.dae", dae().replace(b"#g", b"#h"), "damaged"),
        (
            "a.dae",
            dae().replace(b"<node><scale>", b'<node id="n"><instance_node url="#n"/><scale>'),
            "holds itself",
        ),
        ("a.dae", dae().replace(b"<scale>", b"<node>" * 2000 + b"</node>" * 2000 + b"<scale>"), "damaged"),
        ("a.fbx", b"", ".stl, .obj, .dae"),
    ],
)
def test_what_is_no_mesh_is_refused(name: str, content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=re.escape(said)):
        read_mesh(tmp_path / name)


ARM = """<robot name="arm">
<material name="blue"><color rgba="0 0 1 1"/></material>
<link name="world"/>
<link name="base"><visual><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry></visual></link>
<link name="upper"><visual><origin xyz="0.1 0.2 0.3" rpy="0.3 -0.4 0.5"/><geometry><mesh filename="MESH" scale="2 1 0.5"/></geometry><material name="blue"/></visual></link>
<link name="fore"><visual><geometry><box size="0.1 0.2 0.3"/></geometry></visual></link>
<link name="hand"><visual><origin xyz="0 0 0.05"/><geometry><sphere radius="0.05"/></geometry></visual></link>
<joint name="fix" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0.5 0 0" rpy="0 0 0.7"/></joint>
<joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0.1 0.3" rpy="0.2 0 0"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="2"/></joint>
<joint name="j2" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0.1" rpy="0 0.3 0"/><axis xyz="1 0 1"/><limit lower="-3" upper="3" effort="9" velocity="2"/></joint>
<joint name="end" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.1 0 0.2" rpy="1 0 0"/></joint>
</robot>"""
JOB = """version: 1
robot: {urdf: arm.urdf}
limits: {acceleration: 5}
start: {joints: [0, 0]}
moves: [{planner: trapezoid, to: {joints: [1, -0.5]}}]
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(ARM.replace("MESH", "box.stl"))
    (tmp_path / "box.stl").write_bytes(stl_binary())
    (tmp_path / "job.yaml").write_text(JOB)
    return tmp_path / "arm.urdf"


def test_surfaces_move_with_their_links(arm: Path) -> None:
    """Corners of every visual stand where an independent reader of the file has them, at any joint values."""
    data = arm.read_bytes()
    robot, seen, back = (
        robot_of_urdf(data, str(arm)).robot,
        visuals_of(data, str(arm)),
        ReadBack(data.decode()),
    )
    assert [row for row, _ in seen.surfaces] == [0, 1, 2, 2]
    assert [surface.color for _, surface in seen.surfaces] == [None, (0, 0, 1), None, None]
    q = np.array([0.7, -1.1])
    frames = link_poses(robot, q)
    bodies = {
        "base": cylinder(0.1, 0.2),
        "upper": TRIANGLES * [2, 1, 0.5],
        "fore": box([0.1, 0.2, 0.3]),
        "hand": ball(0.05),
    }
    for (row, surface), (link, body) in zip(seen.surfaces, bodies.items(), strict=True):
        element = next(each for each in back.root.iter("link") if each.get("name") == link).find("visual")
        pose = back.forward({"j1": 0.7, "j2": -1.1}, link) @ back.pose(element)
        expected = body @ pose[:3, :3].T + pose[:3, 3]
        shown = surface.corners @ frames[row][:3, :3].T + frames[row][:3, 3]
        assert np.allclose(shown, expected, atol=1e-6)  # numbers of an STL have 24 bits


VISUALS = """<robot name="arm">
<material name="blue"><color rgba="0 0 1 1"/></material>
<link name="rail"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="base"><visual><geometry><box size="2 2 2"/></geometry><material name="blue"><color rgba="1 0.5 0 1"/></material></visual>
<visual><geometry><box size="3 3 3"/></geometry><material name="blue"/></visual>
<visual><origin xyz="1 2"/><geometry><box size="9 9 9"/></geometry></visual>
<visual><geometry><mesh filename="box.dae"/></geometry><material name="blue"/></visual>
<visual><geometry><mesh filename="box.dae"/></geometry></visual></link>
<link name="arm"><visual><geometry><box size="4 4 4"/></geometry></visual></link>
<link name="hand"><visual><geometry><box size="5 5 5"/></geometry></visual></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="base"/><axis xyz="0 0 1"/></joint>
<joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><origin xyz="0 0 1" rpy="1.5708 0 0"/><axis xyz="0 0 1"/></joint>
<joint name="roll" type="continuous"><parent link="arm"/><child link="hand"/><origin xyz="0 0 1000"/><axis xyz="0 0 1"/></joint>
</robot>"""


def sizes(path: Path, **options: object) -> list[tuple[int, float]]:
    """Return row and edge of each box."""
    surfaces = visuals_of(path.read_bytes(), str(path), **options).surfaces  # type: ignore[arg-type]
    return [(row, round(float(np.ptp(surface.corners[..., 0])), 6)) for row, surface in surfaces]


def test_every_visual_counts_with_its_own_colour_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(VISUALS)
    (tmp_path / "box.dae").write_bytes(dae())
    read, known = list[Path](), visuals.read_mesh
    monkeypatch.setattr(visuals, "read_mesh", lambda file: read.append(file) or known(file))
    found = visuals_of(path.read_bytes(), str(path))
    assert [row for row, _ in found.surfaces] == [0, 1, 1, 1, 1, 2, 3]
    own, named, painted, plain = (surface.color for row, surface in found.surfaces if row == 1)
    assert (own, named, painted, plain) == ((1, 0.5, 0), (0, 0, 1), (0, 0, 1), (1, 0, 0))
    assert read == [tmp_path / "box.dae"]
    assert len(found.unread) == 1
    assert "xyz: expected 3 numbers" in found.unread[0]


def test_the_chain_is_the_one_that_is_named_and_as_exact_as_asked(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(VISUALS)
    assert sizes(path) == [(0, 1), (1, 2), (1, 3), (2, 4), (3, 5)]
    assert sizes(path, tip="arm") == [(0, 1), (1, 2), (1, 3), (2, 4), (2, 5)]
    assert sizes(path, root="base", tip="arm") == [(0, 2), (0, 3), (1, 4), (1, 5)]
    fixed = VISUALS.replace('name="roll" type="continuous"', 'name="roll" type="fixed"')
    data = (
        fixed.replace('xyz="0 0 1000"', 'xyz="0 0 1000" rpy="1.5708 0 0"')
        .replace('<link name="hand"><visual>', '<link name="hand"><visual><origin xyz="0 1000 0"/>')
        .encode()
    )
    for exact, angle in ((False, np.pi / 2), (True, 1.5708)):
        robot = robot_of_urdf(data, "arm.urdf", exact=exact).robot
        hand = visuals_of(data, "arm.urdf", exact=exact).surfaces[-1].surface
        pose = link_poses(robot, np.zeros(2))[2]
        shown = pose[:3, :3] @ hand.corners.reshape(-1, 3).mean(axis=0) + pose[:3, 3]
        first, both = (np.array([0, -np.sin(each), np.cos(each)]) for each in (angle, 2 * angle))
        across = np.array([0, both[2], -both[1]])  # y of the hand
        assert shown == pytest.approx(np.array([0, 0, 1]) + 1000 * first + 1000 * across, abs=1e-6)


def test_packages_are_found_where_ros_looks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    urdf = tmp_path / "arm_description/urdf/arm.urdf"
    places = {
        "above": tmp_path / "arm_description/meshes/above.stl",
        "beside": tmp_path / "other/meshes/beside.stl",
        "ros": tmp_path / "ws/src/far/ros.stl",
        "itself": tmp_path / "one/itself.stl",
        "ament": tmp_path / "install/share/far/ament.stl",
        "relative": tmp_path / "arm_description/urdf/relative.stl",
        "cmake": tmp_path / "built/share/near/c make.stl",
        "own": tmp_path / "arm_description/own.stl",
        "inner": tmp_path / "arm_description/arm_description/own.stl",
    }
    for place in places.values():
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()
    monkeypatch.setenv("ROS_PACKAGE_PATH", os.pathsep.join(map(str, (tmp_path / "ws/src", tmp_path / "one"))))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "install"))
    monkeypatch.setenv("CMAKE_PREFIX_PATH", str(tmp_path / "built"))
    names = {
        "above": "package://arm_description/meshes/above.stl",
        "beside": "package://other/meshes/beside.stl",
        "ros": "package://far/ros.stl",
        "itself": "package://one/itself.stl",
        "ament": "package://far/ament.stl",
        "relative": "relative.stl",
        "cmake": "model://near/c%20make.stl",
        "own": "package://arm_description/own.stl",  # the package itself comes before what is in it
        "inner": "package://arm_description/arm_description/own.stl",
    }
    assert {key: found_file(name, urdf) for key, name in names.items()} == places
    assert found_file(f"file://{places['ros']}", urdf) == places["ros"]
    for name in ("package://far/nothing.stl", "http://example.org/a.stl", "nothing.stl", "", "n" * 300):
        assert found_file(name, urdf) is None


@pytest.mark.full
def test_meshes_keep_to_their_budget_and_to_their_shape(arm: Path) -> None:
    angles = np.linspace(-np.pi / 2, np.pi / 2, 200)
    turns = np.linspace(0, 2 * np.pi, 401)
    rings = np.stack(
        [
            np.cos(angles)[:, None] * np.cos(turns),
            np.cos(angles)[:, None] * np.sin(turns),
            np.sin(angles)[:, None] + 0 * turns,
        ],
        axis=-1,
    )
    a, b, c, d = rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]
    fine = np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )
    records = b"".join(struct.pack("<12fH", *[0.0] * 3, *triangle.ravel(), 0) for triangle in fine)
    (arm.parent / "box.stl").write_bytes(bytes(80) + struct.pack("<I", len(fine)) + records)
    for budget in (0.3, 0.05):
        meshes, remarks = meshes_of_robot(str(arm), budget)
        size = sum(len(str(mesh)) for mesh in meshes)
        assert 0.3e6 * budget < size <= 1e6 * budget * 1.02
        assert re.fullmatch(r"meshes of the URDF: [\d,]+ triangles, simplified to [\d,]+", remarks[0])
        sphere = next(mesh for mesh in meshes if mesh["row"] == 1)["points"]
        extents = np.array(sphere["high"]) - sphere["low"]
        assert volume_of(sphere) > 0
        assert np.all(extents < 4.2)
        assert np.all(extents > 0.9)
    assert meshes_of_robot(str(arm), 0) == ([], [])


def volume_of(packed: dict) -> float:
    return float(np.prod(np.array(packed["high"]) - packed["low"]))


def test_a_page_says_what_it_did_not_find_and_draws_the_rest(arm: Path) -> None:
    arm.write_text(ARM.replace("MESH", "package://nowhere/box.stl"))
    loaded = load_job(arm.parent / "job.yaml")
    scene = scene_of_plan(plan_job(loaded))
    assert {mesh["row"] for mesh in scene["robot"]["meshes"]} == {0, 2}
    said = "meshes not found, their links are drawn from the table: package://nowhere/box.stl"
    assert said in scene["notes"]
    (arm.parent / "box.stl").write_bytes(b"nothing")
    arm.write_text(ARM.replace("MESH", "box.stl"))
    assert any("box.stl: it holds no triangles" in text for text in meshes_of_job(loaded, 1.0)[1])


def test_an_arm_without_a_urdf_has_no_meshes() -> None:
    loaded = job_from_text(JOB.replace("{urdf: arm.urdf}", "{joints: 2}"))
    assert meshes_of_job(loaded, 1.0) == ([], [])
    assert meshes_of_robot("ur5e", 1.0) == ([], [])
    assert meshes_of_robot(None, 1.0) == ([], [])
