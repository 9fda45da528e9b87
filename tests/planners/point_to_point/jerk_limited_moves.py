"""Random moves for jerk_limited, and judges of what it plans, written without the code under test."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.language.numbers import ReadingContext
from trajcli.planners.point_to_point.jerk_limited import JerkLimited
from trajcli.trajectory import State


def arm(velocity, acceleration, jerk):
    """Return a robot from bounds (n,) or (n, 2)."""

    def bounds(values):
        values = np.asarray(values, dtype=float)
        return values if values.ndim == 2 else np.stack([-values, values], axis=1)

    n = len(velocity)
    limits = Limits(bounds([np.inf] * n), bounds(velocity), bounds(acceleration), bounds(jerk))
    joints = tuple(Joint(f"j{k + 1}") for k in range(n))
    return Robot("arm", joints, limits, None, np.eye(4), np.eye(4))


def state(position, velocity=0.0, acceleration=0.0):
    position = np.asarray(position, dtype=float)
    return State(position, np.zeros_like(position) + velocity, np.zeros_like(position) + acceleration)


def move_to(end, joints=True, **fields):
    names = tuple(f"j{k + 1}" for k in range(end.position.size))
    to = {"velocity": end.velocity.tolist(), "acceleration": end.acceleration.tolist()}
    if joints:
        to["joints"] = end.position.tolist()
    context = ReadingContext(joint_names=names, joint_types=("revolute",) * len(names))
    return JerkLimited.model_validate({"planner": "jerk_limited", "to": to, **fields}, context=context)


def random_move(seed, n, *, moving=True, spread=0.0):
    """Return (start, end, robot): states that are inside the limits, and neither come from nor lead outside."""
    rng = np.random.default_rng(seed)
    velocity, acceleration = 10 ** rng.uniform(-1, 1, n), 10 ** rng.uniform(-0.5, 1.5, n)
    jerk = 10 ** rng.uniform(0, 3.5, n)
    states = []
    for _ in range(2):
        position = rng.normal(size=n) * 10 ** rng.uniform(-spread, spread, n)
        v = moving * rng.uniform(-0.95, 0.95, n) * velocity * (rng.random(n) < 0.7)
        peak = np.minimum(acceleration, np.sqrt(2 * jerk * (velocity - np.abs(v))))
        a = moving * rng.uniform(-0.95, 0.95, n) * peak * (rng.random(n) < 0.7)
        states.append(State(position, v, a))
    return *states, arm(velocity, acceleration, jerk)


def peaks(curve):
    """Return the largest magnitude of each derivative at the ends of pieces, shape (4, n)."""
    return np.stack([np.abs(curve.piece_ends(order)).max(axis=(0, 1)) for order in range(4)])


def misses(curve, start, end, tolerance=1e-12):
    """Return which (end of the curve, order, joint) do not fit, relative to the joint's peaks."""
    scale = np.where(peaks(curve) > 0, peaks(curve), 1.0)
    found = []
    for order, name in enumerate(("position", "velocity", "acceleration")):
        first, last = curve.piece_ends(order)
        for side, value, wanted in (("start", first[0], start), ("end", last[-1], end)):
            off = np.abs(value - getattr(wanted, name)) / scale[order]
            found += [(side, order, joint) for joint in np.flatnonzero(off > tolerance).tolist()]
    return found


def drift(curve, joint):
    """Return by how much the curve's own jerks, integrated exactly, leave it; relative, by order."""
    p, v, a = (Fraction(float(curve.piece_ends(order)[0][0, joint])) for order in (0, 1, 2))
    jerks = curve.piece_ends(3)[0][:, joint]
    for begin, end, jerk in zip(curve.breaks[:-1], curve.breaks[1:], jerks, strict=True):
        t, j = Fraction(float(end)) - Fraction(float(begin)), Fraction(float(jerk))
        p, v, a = p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
    scale = np.where(peaks(curve) > 0, peaks(curve), 1.0)[:, joint]
    ends = [curve.piece_ends(order)[1][-1, joint] for order in (0, 1, 2)]
    # an acceleration that is off by rounding moves the rest of the motion
    scale[1] = max(scale[1], scale[2] * curve.duration)
    scale[0] = max(scale[0], scale[1] * curve.duration)
    return [abs(float(x) - y) / s for x, y, s in zip((p, v, a), ends, scale[:3], strict=True)]


def excesses(curve, limits, tolerance=1e-9):
    """Return the (order, joint) whose peaks over all t break the limits; velocity peaks where acceleration is zero."""
    found = []
    for order in (1, 2, 3):
        low, high = limits.of_order(order).T
        values = [*curve.piece_ends(order)]
        if order == 1:
            a, j = curve.piece_ends(2)[0], curve.piece_ends(3)[0]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = np.where(j != 0, -a / j, 0.0)
            inside = (t > 0) & (t < curve.lengths[:, None])
            values.append(np.where(inside, curve.piece_ends(1)[0] + a * t / 2, 0.0))
        top, bottom = np.max(values, axis=(0, 1)), np.min(values, axis=(0, 1))
        broken = (top > high * (1 + tolerance)) | (bottom < low * (1 + tolerance))
        found += [(order, joint) for joint in np.flatnonzero(broken).tolist()]
    return found


def steps(curve, tolerance=1e-9):
    """Return the largest jump of position, velocity and acceleration inside, relative to the joint's peak."""
    found = []
    for order in (0, 1, 2):
        first, last = curve.piece_ends(order)
        scale = np.where(peaks(curve) > 0, peaks(curve), 1.0)[order]
        found.append(float((np.abs(first[1:] - last[:-1]) / scale).max(initial=0.0)))
    return max(found)


def ruckigs_own(start, end, robot, minimum_duration=None):
    """Return ruckig's trajectory of all joints at once, in the job's own units."""
    import ruckig

    n = start.position.size
    wanted, answer = ruckig.InputParameter(n), ruckig.Trajectory(n)
    for name, values in (("current", start), ("target", end)):
        for key in ("position", "velocity", "acceleration"):
            setattr(wanted, f"{name}_{key}", getattr(values, key).tolist())
    for key in ("velocity", "acceleration"):
        low, high = getattr(robot.limits, key).T
        setattr(wanted, f"min_{key}", low.tolist())
        setattr(wanted, f"max_{key}", high.tolist())
    wanted.max_jerk = np.abs(robot.limits.jerk).min(axis=1).tolist()
    if minimum_duration is not None:
        wanted.minimum_duration = minimum_duration
    assert int(ruckig.Ruckig(n).calculate(wanted, answer)) >= 0
    return answer
