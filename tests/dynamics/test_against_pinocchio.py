"""Inverse dynamics of arms from URDFs against what pinocchio says of them, recorded; and live where it is installed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from extras import require_module

from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.kinematics.robot import Friction, Payload
from trajcli.urdf.serial_robot import robot_of_urdf

ARMS = json.loads(
    (Path(__file__).parents[1] / "oracles" / "inverse_dynamics.json").read_text(encoding="utf-8")
)["arms"]
MODELS = Path(__file__).parents[1] / "urdf" / "models"


def plain(robot):
    """Return the arm without friction and rotors, of which rnea knows nothing."""
    return replace(
        robot, joints=tuple(replace(joint, friction=Friction(), rotor=0.0) for joint in robot.joints)
    )


def close(found, wanted):
    assert np.abs(found - np.array(wanted)).max() <= 1e-10 * np.abs(wanted).max()


@pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm["name"])
def test_efforts_gravity_and_mass_matrix(arm):
    """Base tilted or hanging, payload attached."""
    robot = plain(robot_of_urdf(arm["urdf"].encode(), arm["name"], exact=True).robot)
    base = np.eye(4)
    base[:3, :3] = arm["base"]
    payload = Payload(
        arm["payload"]["mass"], np.array(arm["payload"]["com"]), np.array(arm["payload"]["inertia"])
    )
    dynamics = InverseDynamics(replace(robot, base=base @ robot.base), payload=payload)
    for state in arm["states"]:
        close(dynamics.effort(state["q"], state["qd"], state["qdd"]), state["effort"])
        close(dynamics.gravity_effort(state["q"]), state["gravity"])
        close(dynamics.mass_matrix(state["q"]), state["mass_matrix"])


@pytest.mark.parametrize("name", ["ur5", "panda", "xarm7", "so101", "kr16_2"])
def test_whole_urdfs_of_the_models(name):
    """The files themselves, fixed links and branches included, read by both."""
    require_module("pinocchio", "pin")
    import pinocchio as pin

    read = robot_of_urdf((MODELS / f"{name}.urdf").read_bytes(), name, exact=True)
    full = pin.buildModelFromUrdf(str(MODELS / f"{name}.urdf"))
    locked = [full.getJointId(joint) for joint in list(full.names)[1:] if joint not in read.robot.joint_names]
    model = pin.buildReducedModel(full, locked, pin.neutral(full)) if locked else full
    data, dynamics = model.createData(), InverseDynamics(plain(read.robot))
    for q, qd, qdd in np.random.default_rng(1).normal(size=(20, 3, len(read.robot.joints))):
        close(dynamics.effort(q, qd, qdd), pin.rnea(model, data, q, qd, qdd))
