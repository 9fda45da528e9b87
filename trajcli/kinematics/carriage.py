"""Arm on a rail or a lift: a slide under the first joint, whose row fits the rows of the arm.

The axis of a slide is a direction, so that its row has no lengths: B Tz(q) Rx(alpha) Rz(c) is where the arm
stands, with the z axis of B along the rail, its x axis along the common normal of rail and first joint, and c
added to the theta of that joint.

Source: Denavit and Hartenberg (1955).
"""

from __future__ import annotations

from dataclasses import replace
from math import atan2

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.robot import QUANTITIES, Joint, Limits, Robot

_PARALLEL = 1e-12  # of a unit vector: a lift


def on_carriage(arm: Robot, axis: Array, slide: Joint, bounds: Limits, mount: Array) -> Robot:
    """Return an arm on a slide.

    Args:
        arm: With geometry; its own base does not count.
        axis: Direction in which the slide counts, (3,), in the frame of the base.
        slide: Its name, effort, friction, rotor and mass; a prismatic joint.
        bounds: Of the slide alone.
        mount: Where the arm stands when the slide is at zero, in the frame of the base, (4, 4).
    """
    first, modified = arm.joints[0], arm.convention == "modified"
    frame = mount @ row_pose((0.0, 0.0, first.a, first.alpha, first.beta)) if modified else mount
    foot, alpha, turn = _foot(axis / np.linalg.norm(axis), frame)
    rail = replace(slide, alpha=0.0 if modified else alpha)
    turned = replace(first, theta=first.theta + turn)
    if modified:
        turned = replace(turned, alpha=alpha, a=0.0, beta=0.0)
    return replace(
        arm,
        joints=(rail, turned, *arm.joints[1:]),
        limits=_stacked(bounds, arm.limits),
        base=foot,
        foot=foot,
    )


def _foot(axis: Array, frame: Array) -> tuple[Array, float, float]:
    """Return the frame (4, 4) of a slide, and alpha and c between it and the frame of the first joint."""
    foot = frame.copy()
    across, along = np.cross(axis, frame[:3, 2]), float(axis @ frame[:3, 2])
    sine = float(np.linalg.norm(across))
    x = frame[:3, 0] if sine <= _PARALLEL else across / sine
    foot[:3, :3] = np.column_stack([x, np.cross(axis, x), axis])
    alpha = atan2(0.0 if sine <= _PARALLEL else sine, along)
    left = row_pose((0.0, 0.0, 0.0, -alpha, 0.0))[:3, :3] @ foot[:3, :3].T @ frame[:3, :3]
    return foot, alpha, 0.0 if sine <= _PARALLEL else atan2(float(left[1, 0]), float(left[0, 0]))


def _stacked(first: Limits, others: Limits) -> Limits:
    """Return the limits of a joint and those behind it; those of the tool are the others'."""
    names = (*QUANTITIES, "velocity_by_position", "effort")
    rows = {name: np.concatenate([getattr(first, name), getattr(others, name)]) for name in names}
    return Limits(**rows, tcp=others.tcp)
