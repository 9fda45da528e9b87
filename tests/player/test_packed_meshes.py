"""Meshes of a page, unpacked by a reader of their own: volumes by the theorem of Gauss, colours, budgets, remarks."""

from __future__ import annotations

import struct
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import load_job
from trajcli.player.meshes import meshes_of_job, meshes_of_robot

JOINT = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="2"/></joint>'
JOB = "version: 1\nrobot: {urdf: arm.urdf%s}\nlimits: {acceleration: 5}\nstart: {joints: [0]}\nmoves: [{planner: trapezoid, to: {joints: [1]}}]\n"


def visual(geometry: str, color: str = "", origin: str = "") -> str:
    painted = f'<material name="m{color}"><color rgba="{color} 1"/></material>' if color else ""
    return f"<visual>{origin}<geometry>{geometry}</geometry>{painted}</visual>"


def box(*size: float) -> str:
    return f'<box size="{" ".join(map(str, size))}"/>'


def arm(folder: Path, *links: str, origin: str = "") -> str:
    """Write a URDF of links b, l1, l2... that turn about z, a metre above each other; return its path."""
    names = ["b", *(f"l{k}" for k in range(1, len(links)))]
    joints = [JOINT.format(f"j{k}", names[k - 1], names[k]) for k in range(1, len(links))]
    bodies = [f'<link name="{name}">{body}</link>' for name, body in zip(names, links, strict=True)]
    text = f'<robot name="arm">{"".join(bodies + joints)}</robot>'
    (folder / "arm.urdf").write_text(text.replace('<origin xyz="0 0 1"/>', origin or '<origin xyz="0 0 1"/>'))
    return str(folder / "arm.urdf")


def stl(path: Path, corners: np.ndarray) -> None:
    records = np.zeros(
        len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("", "<u2")])
    )
    records["corners"] = corners
    path.write_bytes(bytes(80) + struct.pack("<I", len(corners)) + records.tobytes())


def numbers(packed: dict[str, Any]) -> np.ndarray:
    """Return the columns (m, N) that a page reads: little-endian numbers between the extremes of each."""
    low, high, width = np.array(packed["low"]), np.array(packed["high"]), packed["width"]
    digits = np.frombuffer(b64decode(packed["values"]), np.uint8).reshape(low.size, -1, width)
    share = (digits * 256.0 ** np.arange(width)).sum(axis=2) / (256.0**width - 1)
    return low[:, None] + share * (high - low)[:, None]


def corners_of(mesh: dict[str, Any]) -> np.ndarray:
    """Return the triangles of a mesh (n, 3, 3)."""
    points, faces = numbers(mesh["points"]), np.rint(numbers(mesh["faces"])).astype(int)
    assert mesh["count"] == points.shape[1]
    assert mesh["triangles"] == faces.shape[1]
    return np.asarray(points[:, faces].transpose(2, 1, 0))


def volume(mesh: dict[str, Any]) -> float:
    """Return the volume inside a closed surface whose triangles are seen from outside."""
    return float(np.linalg.det(corners_of(mesh)).sum()) / 6


def sphere(turns: int) -> np.ndarray:
    """Return the triangles of a ball of radius 1, from outside, (n, 3, 3)."""
    up, around = np.meshgrid(np.linspace(-1.57079, 1.57079, turns // 2), np.linspace(0, 2 * np.pi, turns))
    rings = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    a, b, c, d = rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]
    return np.concatenate([np.stack(each, axis=2).reshape(-1, 3, 3) for each in ((a, b, c), (a, c, d))])


def test_surfaces_of_a_link_are_one_mesh_for_each_colour(tmp_path: Path) -> None:
    moved = '<origin xyz="5 0 0"/>'
    path = arm(
        tmp_path,
        visual(box(0.2, 0.3, 0.4), "1 0 0")
        + visual(box(1, 1, 1), "1 0 0", moved)
        + visual(box(2, 2, 2), "0 0.2 0"),
        visual(box(1, 1, 0.001)),
    )
    meshes, remarks = meshes_of_robot(path, 1.0)
    assert [(mesh["row"], mesh["color"]) for mesh in meshes] == [(0, "#ff0000"), (0, "#003300"), (1, None)]
    assert [volume(mesh) for mesh in meshes] == pytest.approx([1.024, 8, 0.001], rel=1e-3)
    assert [mesh["triangles"] for mesh in meshes] == [24, 12, 12]
    assert np.ptp(corners_of(meshes[0]), axis=(0, 1)) == pytest.approx([5.6, 1, 1], abs=1e-3)
    assert remarks == ["meshes of the URDF: 48 triangles"]


def test_triangles_without_extent_and_double_ones_are_left_out(tmp_path: Path) -> None:
    a, b, c, d = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    faces = [[a, c, b], [a, b, d], [b, c, d], [a, d, c]]
    same = [[c, b, a], [d, a, b]]
    stl(tmp_path / "tip.stl", np.array([*faces, *same, [a, a, b], [a, b, b], [a, b, a], [-d, -d, -d]]))
    path = arm(tmp_path, visual('<mesh filename="tip.stl"/>'), visual(box(0, 0, 0)))
    meshes, remarks = meshes_of_robot(path, 1.0)
    assert [mesh["triangles"] for mesh in meshes] == [4]
    assert volume(meshes[0]) == pytest.approx(1 / 6, rel=1e-3)
    assert remarks == ["meshes of the URDF: 22 triangles, simplified to 4"]


@pytest.mark.parametrize("budget", [0.03, 0.002])
def test_meshes_fill_their_budget_and_keep_their_shape(tmp_path: Path, budget: float) -> None:
    stl(tmp_path / "ball.stl", sphere(80))
    path = arm(tmp_path, visual(box(0.01, 0.01, 0.01), "1 0 0"), visual('<mesh filename="ball.stl"/>'))
    meshes, _ = meshes_of_robot(path, budget)
    assert 0.45e6 * budget < sum(len(str(mesh)) for mesh in meshes) <= 1e6 * budget
    count = meshes[-1]["triangles"]  # a polyhedron within the ball, whose cells have an area of 4 pi / count
    assert volume(meshes[-1]) == pytest.approx(4 / 3 * np.pi, rel=120 / count)
    radii = np.linalg.norm(corners_of(meshes[-1]), axis=-1)
    assert 1 - 8 / count < radii.min() <= radii.max() < 1.001


def test_more_points_than_two_bytes_count_have_three(tmp_path: Path) -> None:
    across, along = np.meshgrid(np.arange(264.0), np.arange(250.0))
    points = np.stack([across, along, 0.02 * across * along], axis=-1)
    corners = [points[:-1, :-1], points[:-1, 1:], points[1:, 1:]]
    stl(tmp_path / "field.stl", np.stack(corners, axis=2).reshape(-1, 3, 3))
    (field,), _ = meshes_of_robot(arm(tmp_path, visual('<mesh filename="field.stl"/>'), ""), 5.0)
    x, y, z = corners_of(field).transpose(2, 0, 1)
    assert field["triangles"] == 263 * 249
    assert field["count"] > 65536
    assert np.abs(z - 0.02 * x * y).max() < 0.06
    assert np.ptp(x, axis=1) == pytest.approx(1, abs=0.01)
    assert np.ptp(y, axis=1) == pytest.approx(1, abs=0.01)


def test_a_job_says_which_chain_and_how_exactly(tmp_path: Path) -> None:
    edges = [visual(box(edge, edge, edge), origin='<origin xyz="0 1000 0"/>') for edge in (2, 3, 5)]
    arm(tmp_path, *edges, origin='<origin xyz="0 0 1000" rpy="1.5708 0 0"/>')

    def shown(options: str, joints: int) -> tuple[list[int], np.ndarray]:
        text = JOB.replace("[0]", str([0] * joints)).replace("[1]", str([1] * joints)) % options
        (tmp_path / "job.yaml").write_text(text)
        meshes, _ = meshes_of_job(load_job(tmp_path / "job.yaml"), 1.0)
        ends = np.array([[each["points"][end] for end in ("low", "high")] for each in meshes])
        return [round(float(edge)) for edge in np.ptp(ends, axis=1).min(axis=1)], ends

    assert shown("", 2)[0] == [2, 3, 5]
    assert shown(", root: l1", 1)[0] == [3, 5]
    (edges_to_tip, snapped), (_, exact) = shown(", tip: l1", 1), shown(", tip: l1, exact: true", 1)
    assert edges_to_tip == [2, 5]  # what is beyond the tip moves with it
    # boxes stand 1000 m from axes that are 1.5708 from each other, which is no right angle
    assert 0.5 < np.abs(exact - snapped).max() / (1000 * (1.5708 - np.pi / 2)) < 2.5


def test_without_a_budget_no_file_is_opened(tmp_path: Path) -> None:
    path = arm(tmp_path, visual(box(1, 1, 1)), "")
    (tmp_path / "job.yaml").write_text(JOB % "")
    assert meshes_of_job(load_job(tmp_path / "job.yaml"), 0.0) == ([], [])
    assert meshes_of_robot(path, 0.0) == ([], [])


def test_remarks_say_what_is_missing(tmp_path: Path) -> None:
    assert meshes_of_robot(arm(tmp_path, "", ""), 1.0) == (
        [],
        ["the URDF has no visual meshes: its links are drawn from its table"],
    )
    gone = "".join(visual(f'<mesh filename="{k}.stl"/>') for k in range(8))
    (tmp_path / "bad.stl").write_bytes(b"nothing")
    names = ", ".join(f"{k}.stl" for k in range(6))
    lost = f"meshes not found, their links are drawn from the table: {names} and 2 more"
    _, remarks = meshes_of_robot(arm(tmp_path, gone, ""), 1.0)
    assert remarks == [lost]
    _, remarks = meshes_of_robot(arm(tmp_path, visual('<mesh filename="bad.stl"/>'), ""), 1.0)
    assert [text.partition(",")[0] for text in remarks] == ["meshes not read"]
