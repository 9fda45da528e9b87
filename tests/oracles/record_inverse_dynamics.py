"""Records inverse dynamics by pinocchio into inverse_dynamics.json: `python record_inverse_dynamics.py FILE.urdf:TIP...`.

Each arm is recorded as what pinocchio read of its URDF: a chain of joints with their placements, axes and inertias,
written as a URDF of its own without shapes. The base is turned at random, and the tool carries a payload.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin

STATES = 3
DIGITS = 17


def chain_to(full: pin.Model, tip: str) -> tuple[pin.Model, pin.SE3]:
    """Return the joints that lead to a frame, all others locked at zero, and where the frame is on the last one."""
    parent = full.frames[full.getFrameId(tip, pin.FrameType.BODY)].parentJoint
    support = set(full.supports[parent].tolist()) - {0}
    locked = [k for k in range(1, full.njoints) if k not in support]
    model = pin.buildReducedModel(full, locked, pin.neutral(full)) if locked else full
    return model, model.frames[model.getFrameId(tip, pin.FrameType.BODY)].placement


def axis_of(model: pin.Model, index: int) -> tuple[str, list[float]]:
    """Return kind and axis of a joint, by the motion that it makes."""
    data = model.createData()
    joint = model.joints[index]
    value = [0.0] if joint.nq == 1 else [1.0, 0.0]
    q = pin.neutral(model)
    q[joint.idx_q : joint.idx_q + joint.nq] = value
    pin.computeJointJacobians(model, data, q)
    column = pin.getJointJacobian(model, data, index, pin.LOCAL)[:, joint.idx_v]
    slides = not column[3:].any()
    return ("prismatic" if slides else "revolute"), (column[:3] if slides else column[3:]).tolist()


def said(values) -> str:
    return " ".join(repr(float(value)) for value in values)


def origin(placement: pin.SE3) -> str:
    return (
        f'<origin xyz="{said(placement.translation)}" rpy="{said(pin.rpy.matrixToRpy(placement.rotation))}"/>'
    )


def urdf_of(model: pin.Model, tip: pin.SE3, name: str) -> str:
    """Return the chain as a URDF."""
    lines = [f'<robot name="{name}">', '<link name="link0"/>']
    for k in range(1, model.njoints):
        inertia = model.inertias[k]
        i = inertia.inertia
        names = {
            "ixx": i[0, 0],
            "iyy": i[1, 1],
            "izz": i[2, 2],
            "ixy": i[0, 1],
            "ixz": i[0, 2],
            "iyz": i[1, 2],
        }
        tensor = " ".join(f'{key}="{float(value)!r}"' for key, value in names.items())
        center, mass = said(inertia.lever), repr(float(inertia.mass))
        kind, axis = axis_of(model, k)
        lines += [
            f'<link name="link{k}"><inertial><origin xyz="{center}"/><mass value="{mass}"/><inertia {tensor}/></inertial></link>',
            f'<joint name="joint{k}" type="{kind}">{origin(model.jointPlacements[k])}<parent link="link{k - 1}"/>',
            f'<child link="link{k}"/><axis xyz="{said(axis)}"/><limit lower="-9" upper="9" velocity="9" effort="9"/></joint>',
        ]
    last = model.njoints - 1
    lines += [
        '<link name="tcp"/>',
        f'<joint name="end" type="fixed">{origin(tip)}<parent link="link{last}"/><child link="tcp"/></joint>',
    ]
    return "\n".join([*lines, "</robot>"])


def recorded(path: Path, tip: str, rng: np.random.Generator) -> dict:
    """Return an arm with its states."""
    model, end = chain_to(pin.buildModelFromUrdf(str(path)), tip)
    text = urdf_of(model, end, path.stem)
    base = pin.exp3(rng.normal(size=3) * 2)
    moments = rng.uniform(0.0, 0.05, 3)
    tensor = np.diag([moments[1] + moments[2], moments[0] + moments[2], moments[0] + moments[1]])
    turn = pin.exp3(rng.normal(size=3))
    payload = pin.Inertia(3.2, rng.normal(size=3) * 0.1, turn @ tensor @ turn.T)
    model.gravity = pin.Motion(base.T @ [0.0, 0.0, -9.81], np.zeros(3))
    model.appendBodyToJoint(model.njoints - 1, payload, end)
    data, states = model.createData(), []
    for _ in range(STATES):
        q, qd, qdd = rng.uniform(-3, 3, model.nv), rng.normal(size=model.nv), rng.normal(size=model.nv)
        full = np.concatenate(
            [[x] if model.joints[k + 1].nq == 1 else [np.cos(x), np.sin(x)] for k, x in enumerate(q)]
        )
        effort = pin.rnea(model, data, full, qd, qdd).copy()
        gravity = pin.computeGeneralizedGravity(model, data, full).copy()
        mass = np.triu(pin.crba(model, data, full))
        mass = mass + np.triu(mass, 1).T
        values = {"q": q, "qd": qd, "qdd": qdd, "effort": effort, "gravity": gravity, "mass_matrix": mass}
        states.append({name: value.tolist() for name, value in values.items()})
    carried = {"mass": payload.mass, "com": payload.lever.tolist(), "inertia": payload.inertia.tolist()}
    return {"name": path.stem, "urdf": text, "base": base.tolist(), "payload": carried, "states": states}


if __name__ == "__main__":
    rng = np.random.default_rng(15)
    arms = [recorded(Path(path), tip, rng) for path, tip in (item.rsplit(":", 1) for item in sys.argv[1:])]
    source = (
        f"pinocchio {pin.__version__}: rnea, computeGeneralizedGravity, crba; base turned, payload at the tip"
    )
    out = Path(__file__).with_name("inverse_dynamics.json")
    out.write_text(json.dumps({"source": source, "arms": arms}, indent=1) + "\n", encoding="utf-8")
