"""Measurements of arms whose joints are called as coordinates of the tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.measurements import read_measurements
from trajcli.job.read import job_from_text
from trajcli.units import Units

GANTRY = """\
version: 1
robot: {convention: standard, joints: [{name: x, type: prismatic}, {name: y, type: prismatic, alpha: 1}, {name: c}]}
start: {joints: 0}
moves: [{planner: hold, duration: 1}]
"""


def test_a_column_is_that_of_a_joint_or_of_the_tool_and_not_of_both(tmp_path: Path) -> None:
    robot, file = job_from_text(GANTRY).robot, tmp_path / "measured.csv"
    file.write_text("q1,q2_mm,q3_deg,x,y,z\n1,2000,90,4,5,6\n")
    found = read_measurements(str(file), robot, Units())
    np.testing.assert_allclose(found.joints, [[1, 2, np.pi / 2]])
    np.testing.assert_allclose(found.kinds[0].target.poses[..., :3, 3], [[4, 5, 6]])
    for names in ("x,y,c,z", "x_mm,q2,q3,z", "x,y,c,qw,qx,qy,qz"):
        file.write_text(f"{names}\n{','.join('1000000'[: names.count(',') + 1])}\n")
        with pytest.raises(InputError, match=r"x.* is a joint and a coordinate of the tool") as caught:
            read_measurements(str(file), robot, Units())
        assert caught.value.problems[0].hint == "call joints q1, q2, ..."
