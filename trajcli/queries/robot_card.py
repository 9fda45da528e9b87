"""Data sheet of a robot: its table, limits, reach, inverse kinematics and source."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable
from trajcli.job.robot import DH_ROW, RobotSheet
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.robot import QUANTITIES, Friction, Robot
from trajcli.queries.pose import pose_view
from trajcli.units import Quantity, factor, joint_quantity, to_user

# Measured: within 2e-4 of what ten times as many draws find, for every robot of the catalogue.
_SEED, _ROUNDS, _DRAWN, _KEPT = 20, 8, 1024, 32


@comparable
class ReachRange:
    """How far the tcp gets from the origin of the base, m.

    Attributes:
        sampled: The largest distance that a search finds over the joint ranges; a little below the true one.
        bound: The lengths of all links added: no configuration gets further. Both are infinite where a slide
            has no limits.
    """

    sampled: float
    bound: float


def kind_of(robot: Robot) -> str:
    """Return the joints from the base on, such as "RRP"; of one type their number: "6R"."""
    letters = "".join("RP"[kind == "prismatic"] for kind in robot.joint_types)
    return f"{len(letters)}{letters[0]}" if len(set(letters)) == 1 and len(letters) > 3 else letters


def reach_of(robot: Robot) -> ReachRange | None:
    """Return the reach of a robot; None where it has no geometry."""
    if robot.convention is None:
        return None
    slides = np.array([kind == "prismatic" for kind in robot.joint_types])
    ranges = np.array(robot.limits.position)
    whole_turns = ~slides & (ranges[:, 1] - ranges[:, 0] >= 2.0 * np.pi)
    ranges[whole_turns] = -np.pi, np.pi
    if not np.isfinite(ranges[slides]).all():
        return ReachRange(np.inf, np.inf)
    bound = float(np.linalg.norm(robot.tool[:3, 3]))
    for joint, (low, high), slides_here in zip(robot.joints, ranges, slides, strict=True):
        ends = joint.d + joint.sign * np.array([low, high]) if slides_here else np.array([joint.d])
        bound += float(np.hypot(joint.a, np.abs(ends).max()))
    return ReachRange(_furthest(robot, ranges), bound)


def _furthest(robot: Robot, ranges: Array) -> float:
    """Return the largest distance of the tcp from the base: random draws, then ever closer to the best."""
    draws = np.random.default_rng(_SEED)
    low, high = ranges.T
    best = draws.uniform(low, high, (_DRAWN, len(ranges)))
    for turn in range(1, _ROUNDS + 1):
        distances = np.linalg.norm(forward(robot, best)[:, :3, 3] - robot.base[:3, 3], axis=1)
        kept = best[np.argsort(-distances, kind="stable")[:_KEPT]]
        steps = draws.normal(size=(_DRAWN, len(ranges))) * (high - low) * 0.3**turn
        best = np.concatenate([kept, np.clip(np.repeat(kept, _DRAWN // _KEPT, axis=0) + steps, low, high)])
    return float(np.linalg.norm(forward(robot, best)[:, :3, 3] - robot.base[:3, 3], axis=1).max())


def robot_row(name: str, sheet: RobotSheet) -> dict[str, Any]:
    """Return what a list says of a robot.

    The reach is in m, null where unlimited; `units` are those of the robot's file; `limits` are the
    quantities that are limited for some joint; `ik` is the method, `closed_form` whether it is no search.
    """
    robot, reach = sheet.robot, reach_of(sheet.robot)
    limited = [
        quantity
        for order, quantity in enumerate(QUANTITIES)
        if np.isfinite(robot.limits.of_order(order)).any()
    ]
    method = None if robot.convention is None else method_for(robot)
    return {
        "name": name,
        "title": robot.name,
        "joints": len(robot.joints),
        "kind": kind_of(robot),
        "reach": None if reach is None else _finite(reach.sampled),
        "units": asdict(sheet.units),
        "maker": sheet.maker,
        "origin": sheet.origin,
        "limits": limited,
        "ik": method and method.name,
        "closed_form": method and method.family != "numeric",
        "source": sheet.source,
        "date": sheet.date,
    }


def robot_card(name: str, sheet: RobotSheet) -> dict[str, Any]:
    """Return the data sheet of a robot, in the units of its file; what is not limited is null."""
    robot, units = sheet.robot, sheet.units
    reach, length = reach_of(robot), factor(Quantity("length"), units)
    return {
        "name": name,
        "title": robot.name,
        "kind": kind_of(robot),
        "maker": sheet.maker,
        "origin": sheet.origin,
        "source": sheet.source,
        "date": sheet.date,
        "licence": sheet.licence,
        "note": sheet.note,
        "units": asdict(units),
        "convention": robot.convention,
        "joints": [_joint_card(sheet, index) for index in range(len(robot.joints))],
        "dynamics": [_dynamics_card(sheet, index) for index in range(len(robot.joints))],
        "base": pose_view(robot.base, units),
        "tool": pose_view(robot.tool, units),
        "mobility": len(robot.joints),
        "reach": reach and {key: _finite(value / length) for key, value in asdict(reach).items()},
        "ik": None if robot.convention is None else _inverse_card(robot),
    }


def _inverse_card(robot: Robot) -> dict[str, Any]:
    method = method_for(robot)
    branches = [
        {choice: name for choice, name in asdict(branch).items() if name is not None}
        for branch in method.branches
    ]
    return {"method": method.name, "family": method.family, "reason": method.reason, "branches": branches}


def _joint_card(sheet: RobotSheet, index: int) -> dict[str, Any]:
    joint, units = sheet.robot.joints[index], sheet.units
    tilted = any(each.beta for each in sheet.robot.joints)
    row = {key: quantity for key, quantity in DH_ROW.items() if tilted or key != "beta"}
    table = {key: round(to_user(getattr(joint, key), quantity, units), 12) for key, quantity in row.items()}
    limits: dict[str, Any] = {}
    for order, quantity in enumerate(QUANTITIES):
        scale = factor(joint_quantity(joint.type, order), units)
        low, high = (sheet.robot.limits.of_order(order)[index] / scale).tolist()
        limits[quantity] = [_finite(low), _finite(high)] if np.isfinite([low, high]).any() else None
    rates = sheet.robot.limits.velocity_by_position[index]
    if np.isfinite(rates[0]):
        scales = [factor(joint_quantity(joint.type, order), units) for order in (2, 1)]
        both = zip(("deceleration", "offset"), (rates / scales).tolist(), strict=True)
        limits["velocity_by_position"] = {name: _finite(value) for name, value in both}
    described = table if sheet.robot.convention is not None else {}
    return {"name": joint.name, "type": joint.type, **described, "sign": joint.sign, **limits}


def _dynamics_card(sheet: RobotSheet, index: int) -> dict[str, Any]:
    """Return effort, friction, rotor and link of a joint, SI but for the centre of mass."""
    joint, length = sheet.robot.joints[index], factor(Quantity("length"), sheet.units)
    effort = [_finite(bound) for bound in joint.effort]
    link = joint.link
    solid = link and {
        "mass": link.mass,
        "com": [round(x / length, 12) for x in link.com],
        "inertia": list(link.inertia),
    }
    further = {"friction": joint.friction != Friction() and asdict(joint.friction), "rotor": joint.rotor}
    given = {key: value for key, value in further.items() if value}
    return {"joint": joint.name, "effort": effort if effort != [None, None] else None, **given, "link": solid}


def _finite(value: float) -> float | None:
    return round(value, 12) if np.isfinite(value) else None
