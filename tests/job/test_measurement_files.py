"""Files of measured poses: which coordinates were measured, in which units, with which deviations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.measurements import read_configurations, read_measurements
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.units import Units

ROBOT = Robot(
    "arm",
    (Joint("base", d=0.3, alpha=1.2), Joint("lift", type="prismatic"), Joint("wrist", a=0.25)),
    unlimited(3),
    "standard",
    np.eye(4),
    np.eye(4),
)
JOINTS = "[90, 200, -45]"
SI = (np.pi / 2, 0.2, -np.pi / 4)
UNITS = Units("deg", "mm")


def saved(folder: Path, text: str, name: str = "poses.yaml") -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("name", ["poses.yaml", "poses.yml", "poses.json", "POSES.YAML"])
def test_what_was_measured_alike_stands_together(tmp_path: Path, name: str) -> None:
    poses = [
        "{xyz: [400, 100, 300]}",
        "{rotvec: [0, 0, 90]}",
        "{xyz: [null, 110, null], rotvec: [90, 0, 0]}",
        "{xyz: [410, 100, 300]}",
        "{xyz: [500, 0, 0], direction: [0, 0, -1], tool_axis: x}",
        "{xyz: [60, null, 50]}",
        "{xyz: [600, 0, 0], direction: [0, -1, 0], tool_axis: y}",
        "{xyz: [700, 0, 0], direction: [1, 0, 0], tool_axis: x}",
    ]
    entries = ", ".join(f'{{"joints": {JOINTS}, "pose": {pose}}}' for pose in poses)
    found = read_measurements(saved(tmp_path, f"[{entries}]", name), ROBOT, UNITS)
    np.testing.assert_allclose(found.joints, [SI] * 8)
    assert found.deviations is None
    by_rows = {tuple(kind.rows.tolist()): kind.target for kind in found.kinds}
    assert by_rows.keys() == {(0, 3), (1,), (2,), (4, 7), (5,), (6,)}
    fixed = {rows: (target.position, target.orientation) for rows, target in by_rows.items()}
    none, every = (False,) * 3, (True,) * 3
    assert fixed[0, 3] == (every, "none")
    assert fixed[1,] == (none, "all")
    assert fixed[2,] == ((False, True, False), "all")
    assert fixed[5,] == ((True, False, True), "none")
    np.testing.assert_allclose(by_rows[0, 3].poses[:, :3, 3], [[0.4, 0.1, 0.3], [0.41, 0.1, 0.3]])
    np.testing.assert_allclose(by_rows[2,].poses[0, 1, 3], 0.11)
    turned = Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix()
    np.testing.assert_allclose(by_rows[2,].poses[0, :3, :3], turned, atol=1e-15)
    np.testing.assert_allclose(by_rows[4, 7].aims, [[0, 0, -1], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(by_rows[6,].aims, [[0, -1, 0]], atol=1e-15)


def test_deviations_are_those_of_position_and_angle(tmp_path: Path) -> None:
    """Of what was not measured the deviation counts for nothing, and is 1."""
    text = f"""
- {{joints: {JOINTS}, pose: {{xyz: [400, 0, 0], rotvec: [0, 0, 90]}}, sigma: {{position: 0.5, angle: 2}}}}
- {{joints: {JOINTS}, pose: {{xyz: [null, 0, 5]}}, sigma: {{position: 0.25}}}}
- {{joints: {JOINTS}, pose: {{rotvec: [0, 0, 90]}}, sigma: {{angle: 3}}}}
"""
    found = read_measurements(saved(tmp_path, text), ROBOT, UNITS)
    wanted = [[5e-4, np.radians(2)], [2.5e-4, 1.0], [1.0, np.radians(3)]]
    np.testing.assert_allclose(found.deviations, wanted)


@pytest.mark.parametrize(
    ("pose", "sigma", "said"),
    [
        ("{xyz: [1, 2, 3]}", "", "measurement 2 has no standard deviation of its position"),
        (
            "{xyz: [null, 2, null]}",
            ", sigma: {angle: 1}",
            "measurement 2 has no standard deviation of its position",
        ),
        ("{xyz: [1, 2, 3], rotvec: [0, 0, 1]}", ", sigma: {position: 1}", "deviation of its angle"),
        ("{rotvec: [0, 0, 1]}", ", sigma: {position: 1}", "deviation of its angle"),
        ("{}", "", "says nothing"),
        ("{xyz: [null, null, null]}", "", "no coordinate of xyz"),
        ("{xyz: [1, 2, 3], configuration: {elbow: up}}", "", "has no configuration"),
        ("{xyz: [1, 2, 3]}", ", sigma: {position: 0}", "above 0"),
    ],
)
def test_a_measurement_that_lacks_something_is_refused(
    tmp_path: Path, pose: str, sigma: str, said: str
) -> None:
    first = f"- {{joints: {JOINTS}, pose: {{xyz: [1, 2, 3]}}, sigma: {{position: 1}}}}\n"
    path = saved(tmp_path, f"{first}- {{joints: {JOINTS}, pose: {pose}{sigma}}}\n")
    with pytest.raises(InputError, match=said) as caught:
        read_measurements(path, ROBOT, UNITS)
    place = caught.value.problems[0].place
    assert place is not None
    assert place.line == 2


def test_wrong_measurements_of_ten_sorts_are_told_once_each(tmp_path: Path) -> None:
    keys = "abcdefghijkl"
    lines = [
        f"- {{joints: {JOINTS}, pose: {{xyz: [1, 2, 3]}}, not_{key}: 1}}" for key in (*keys, "a", "b", "a")
    ]
    with pytest.raises(InputError) as caught:
        read_measurements(saved(tmp_path, "\n".join(lines)), ROBOT, UNITS)
    problems = caught.value.problems
    assert len(problems) == 10
    assert "2 more measurements are like this" in str(problems[0].hint)
    assert "1 more measurement is like this" in str(problems[1].hint)
    assert "like this" not in str(problems[2].hint)


TABLE = "q1_deg,q2_mm,q3"
ROW = "90,200,-0.785398163397448"


def test_a_table_has_units_by_column(tmp_path: Path) -> None:
    head = f"{TABLE},sigma_angle_deg,z_mm,x,sigma_position_mm"
    path = saved(tmp_path, f"{head}\n{ROW},2,300,0.4,0.5\n{ROW},4,310,0.5,0.25\n", "poses.csv")
    found = read_measurements(path, ROBOT, UNITS)
    np.testing.assert_allclose(found.joints, [SI] * 2)
    np.testing.assert_allclose(found.deviations, [[5e-4, np.radians(2)], [2.5e-4, np.radians(4)]])
    (kind,) = found.kinds
    assert kind.rows.tolist() == [0, 1]
    assert (kind.target.position, kind.target.orientation) == ((True, False, True), "none")
    np.testing.assert_allclose(kind.target.poses[:, [0, 2], 3], [[0.4, 0.3], [0.5, 0.31]])


def test_deviations_of_positions_are_enough_for_positions(tmp_path: Path) -> None:
    path = saved(tmp_path, f"{TABLE},x,sigma_position\n{ROW},0.1,0.002\n", "poses.csv")
    np.testing.assert_allclose(read_measurements(path, ROBOT, UNITS).deviations, [[0.002, 1.0]])


def test_a_table_of_turns_needs_no_position(tmp_path: Path) -> None:
    quat = Rotation.from_rotvec([0.3, -0.2, 0.9])
    x, y, z, w = quat.as_quat()
    text = f"{TABLE},qw,qx,qy,qz,sigma_angle\n{ROW},{w:.6f},{x:.6f},{y:.6f},{z:.6f},0.1\n"
    found = read_measurements(saved(tmp_path, text, "poses.csv"), ROBOT, UNITS)
    (kind,) = found.kinds
    assert (kind.target.position, kind.target.orientation) == ((False,) * 3, "all")
    rotation = kind.target.poses[0, :3, :3]
    np.testing.assert_allclose(rotation, quat.as_matrix(), atol=2e-6)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(found.deviations, [[1.0, 0.1]])


@pytest.mark.parametrize(
    ("columns", "row", "said"),
    [
        ("x,sigma_position", "0.1,0", "row 2: sigma_position must be above 0"),
        ("x,sigma_position", "0.1,-1", "row 2: sigma_position must be above 0"),
        ("x,sigma_angle", "0.1,1", "no column sigma_position"),
        ("x,qw,qx,qy,qz,sigma_position", "0.1,1,0,0,0,1", "no column sigma_angle"),
        ("x,qw,qx,qy", "0.1,1,0,0", "there is no qz"),
        ("sigma_position", "1", "no columns of a measured pose"),
        ("x,x_mm", "0.1,100", "columns of the same number"),
        ("x_deg", "0.1", "cannot be in deg"),
        ("x,sigma_angle_mm", "0.1,1", "cannot be in mm"),
        ("x,qw_deg,qx,qy,qz", "0.1,1,0,0,0", "cannot be in deg"),
        ("x,yy", "0.1,1", "no column 'yy'"),
        ("x,qw,qx,qy,qz", "0.1,0.9,0,0,0", "length"),
        ("x", "1e13", r"larger than 1e\+12"),
    ],
)
def test_a_table_that_lacks_something_is_refused(tmp_path: Path, columns: str, row: str, said: str) -> None:
    fine = ",".join(
        "1" if name in ("qw", "sigma_position", "sigma_angle") else "0" for name in columns.split(",")
    )
    path = saved(tmp_path, f"{TABLE},{columns}\n{ROW},{fine}\n{ROW},{row}\n{ROW},{row}\n", "poses.csv")
    with pytest.raises(InputError, match=said):
        read_measurements(path, ROBOT, UNITS)


def test_a_joint_called_x_is_not_taken_for_a_coordinate(tmp_path: Path) -> None:
    robot = Robot("gantry", (Joint("x", type="prismatic"),), unlimited(1), "standard", np.eye(4), np.eye(4))
    with pytest.raises(InputError, match="a joint and a coordinate"):
        read_measurements(saved(tmp_path, "x,y\n1,2\n", "poses.csv"), robot, UNITS)
    found = read_measurements(saved(tmp_path, "q1,x,y\n1,2,3\n", "poses.csv"), robot, UNITS)
    assert found.joints.tolist() == [[1.0]]
    assert found.kinds[0].target.position == (True, True, False)


def test_configurations_stand_in_both_forms(tmp_path: Path) -> None:
    text = (
        f"- {{joints: {JOINTS}}}\n- {{joints: {{base: 0, lift: 1, wrist: 180}}, pose: {{xyz: [1, 2, 3]}}}}\n"
    )
    found = read_configurations(saved(tmp_path, text, "POSES.YML"), ROBOT, UNITS)
    np.testing.assert_allclose(found, [SI, (0, 1e-3, np.pi)])
    found = read_configurations(saved(tmp_path, f"{TABLE}\n{ROW}\n", "poses.csv"), ROBOT, UNITS)
    np.testing.assert_allclose(found, [SI])
