"""From URDF to a verified pick and place: a UR-like, a KUKA-like and a rail-mounted arm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from independent_reader import ReadBack
from tiers import few

import trajcli

MODELS = Path(__file__).parent / "models"
JOB = """\
version: 1
units: {{angle: deg, length: mm}}
robot: {{urdf: arm.urdf}}
limits:
  acceleration: {acceleration}
  jerk: {jerk}
  tcp: {{speed: 400, acceleration: 2000, angular_speed: 180, angular_acceleration: 900}}
points:
  above: {{xyz: {xyz}, matrix: {matrix}}}
  pick: {{from: above, offset: {{xyz: [0, 0, 80]}}}}
start: {{joints: {home}}}
moves:
  - {{planner: jerk_limited, to: above}}
  - {{planner: line, to: pick, law: {{shape: quintic, duration: 1}}}}
  - {{planner: hold, duration: 0.3}}
  - {{planner: line, to: above, law: {{shape: quintic, duration: 1}}}}
  - {{planner: jerk_limited, to: {{joints: {home}}}}}
output: {{rate: 100}}
"""
RAIL = """\
  <link name="floor"/><link name="carriage"/>
  <joint name="rail" type="prismatic">
    <parent link="floor"/><child link="carriage"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="500"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="carriage"/><child link="world"/><origin xyz="0 0 0.4"/></joint>
</robot>
"""


@pytest.mark.full
@pytest.mark.parametrize(
    ("kind", "above"),
    few(
        [
            ("ur5", [0.0, -1.6, 1.7, -1.7, -1.57, 0.0]),
            ("kr16_2", [0.1, -1.5, 1.7, 0.2, 1.2, 0.0]),
            ("rail", [0.2, 0.1, -1.6, 1.7, -1.7, -1.5, 0.0]),
        ],
        1,
    ),
)
def test_pick_and_place(kind: str, above: list[float], tmp_path: Path) -> None:
    text = (MODELS / f"{'ur5' if kind == 'rail' else kind}.urdf").read_text(encoding="utf-8")
    (tmp_path / "arm.urdf").write_text(text.replace("</robot>", RAIL) if kind == "rail" else text)
    arm = trajcli.load_robot(tmp_path / "arm.urdf")
    pose = arm.fk(above)
    slides = [joint.type == "prismatic" for joint in arm.joints]
    units = ["m" if slide else "rad" for slide in slides]
    job = JOB.format(
        acceleration=[2000 if slide else 500 for slide in slides],
        jerk=[20000 if slide else 5000 for slide in slides],
        home=[f"{value + 0.1!r} {unit}" for value, unit in zip(above, units, strict=True)],
        xyz=(1000 * pose[:3, 3]).tolist(),
        matrix=pose[:3, :3].tolist(),
    )
    (tmp_path / "job.yaml").write_text(job)
    plan = trajcli.plan(tmp_path / "job.yaml")
    assert plan.verdict.passed, plan.verdict.text
    reader = ReadBack((tmp_path / "arm.urdf").read_text(encoding="utf-8"))
    spans = [plan.trajectory.spans[k].end for k in (0, 1)]
    q = [dict(zip(arm.joint_names, row, strict=True)) for row in plan.trajectory(spans)]
    reached = [reader.forward(values, "tool0") for values in q]
    first = reader.forward(q[0], "floor" if kind == "rail" else "world")
    assert np.allclose(first, np.eye(4))
    assert np.abs(reached[0] - pose).max() <= 1e-5  # snapped angles, and what a line may deviate
    assert np.abs(reached[1][:3, 3] - pose[:3, 3] - 0.08 * pose[:3, 2]).max() <= 1e-5
