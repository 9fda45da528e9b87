"""What trajcli writes is read as it was: in CSV, JSON lines, MCAP and ROS, by the curve that was planned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.job.read import load_job
from trajcli.knots import knots_of
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.recorded_motion import open_motion
from trajcli.units import Units

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module", params=["ur5e_pick", "sync"])
def plan(request) -> Plan:
    return plan_job(
        load_job(EXAMPLES / f"{request.param}.yaml", ["output.rate=125", "output.columns=[t,q,qd,qdd,move]"])
    )


@pytest.mark.parametrize(
    ("name", "digits", "tolerance"),
    [
        ("a.csv", "fixed", 5e-9),
        ("a.csv", "full", 1e-13),
        ("a.jsonl", "fixed", 1e-13),
        ("a.mcap", "fixed", 1e-13),
    ],
)
def test_rows_are_those_of_the_curve(plan, name, digits, tolerance, tmp_path):
    write_plan(plan, str(tmp_path / name), digits)
    robot = plan.trajectory
    found = open_motion(
        tmp_path / name, joints=robot.joint_names, joint_types=robot.joint_types, declared=Units()
    )
    motion = found.whole()
    at = np.minimum(motion.t, robot.duration)
    wanted = robot.curve.evaluate_orders(at, (0, 1, 2))
    inside = motion.t < robot.duration - 1e-8
    inside &= np.abs(motion.t[:, None] - robot.curve.breaks).min(axis=1) > 1e-8  # where derivatives may step
    rounding = 1e-8 * (1 + np.abs(robot.curve.evaluate(at, 3)).max()) if name == "a.mcap" else tolerance
    np.testing.assert_allclose(motion.q, wanted[:, 0], rtol=1e-12, atol=rounding)
    np.testing.assert_allclose(motion.qd[inside], wanted[inside, 1], rtol=1e-12, atol=rounding)
    np.testing.assert_allclose(motion.qdd[inside], wanted[inside, 2], rtol=1e-9, atol=2 * rounding)
    assert found.joints == robot.joint_names
    assert found.rows == len(motion.t)
    if name != "a.mcap":
        spans = np.array([span.start for span in robot.spans])
        later = np.searchsorted(spans, motion.t[inside], "right") - 1
        np.testing.assert_array_equal(motion.move[inside], later)
    if name == "a.csv" and digits == "fixed":
        assert found.resolution.time == 5e-10
        head = (tmp_path / name).read_text(encoding="utf-8").splitlines()[0].split(",")
        positions = [column for column in head if column[:1] == "q" and column[1:2].isdigit()]
        scales = [np.pi / 180 if "_" in column else 1.0 for column in positions]
        np.testing.assert_allclose(found.resolution.q, 5e-10 * np.array(scales))
    else:
        assert found.resolution.q.max() < 1e-12


def test_a_goal_is_its_knots(plan, tmp_path):
    write_plan(plan, str(tmp_path / "goal.yaml"))
    found = open_motion(tmp_path / "goal.yaml")
    knots, motion = knots_of(plan.trajectory), found.whole()
    assert motion.t.tolist() == (knots.nanoseconds / 1e9).tolist()
    assert motion.q.tolist() == knots.position.tolist()
    assert motion.qd.tolist() == knots.velocity.tolist()
    assert motion.qdd.tolist() == knots.acceleration.tolist()
    assert found.joints == plan.trajectory.joint_names
