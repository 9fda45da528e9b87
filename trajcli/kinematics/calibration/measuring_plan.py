"""Optimal measuring configurations for calibration: the largest observability index O1 of a candidate set.

O1 = (s_1 ... s_r)^(1/r) / sqrt(N), from the singular values of the weighted identification Jacobian of N
configurations: the volume of what the parameters are determined by, and the D-optimality of experiments.
Which configurations are best does not depend on how parameters are scaled.

Source: Borm and Menq, Determination of optimal measurement configurations for robot calibration based on
observability measure, Int. J. Robotics Research 10 (1991), for the index; Sun and Hollerbach, Observability
index selection for robot calibration, IEEE ICRA (2008), for the choice of it; Mitchell, An algorithm for the
construction of D-optimal experimental designs, Technometrics 16 (1974), for exchanges.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.kinematics.calibration.identifiability import (
    Identifiability,
    identifiability,
    identification_jacobian,
)
from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.calibration.parameters import ArmParameter, units_of
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot

MeasuredPart = Literal["pose", "position"]
"""What each measurement will measure of the tool."""

CANDIDATES = 500
"""How many random candidates there are."""

_SEED = 20241
_ALL_OVER = 60  # configurations for each kind of measurement: more numbers than there are parameters
_MOST_PASSES = 20
_BETTER = 1e-9  # of the logarithm of the determinant: less is rounding
_RIDGE = 1e-9  # of the mean square of a candidate's rows: makes the first determinants differ from zero


@frozen
class MeasuringPlan:
    """Configurations to measure at.

    Attributes:
        chosen: Indices of the candidates, in the order in which the plan found them best.
        seen: What they determine.
        index: O1, by the Jacobian with lengths in m and angles times the scale.
        smallest: Its smallest singular value of those that are not zero.
        condition: The largest over the smallest one.
    """

    chosen: NDArray[np.intp]
    seen: Identifiability
    index: float
    smallest: float
    condition: float


def random_candidates(robot: Robot, count: int = CANDIDATES) -> Array:
    """Return configurations (count, n) spread evenly within the limits, the same at each call, rad or m.

    A revolute joint without limits, or with more than a turn, moves within half a turn to either side of its
    middle.

    Raises:
        InputError: When a prismatic joint has no limits.
    """
    low, high = robot.limits.position.T.copy()
    for index, joint in enumerate(robot.joints):
        limited = bool(np.isfinite([low[index], high[index]]).all())
        if joint.type == "revolute" and not (limited and high[index] - low[index] <= 2 * np.pi):
            middle = 0.5 * (low[index] + high[index]) if limited else 0.0
            low[index], high[index] = middle - np.pi, middle + np.pi
        elif not limited:
            hint = "give its `position`, or candidates in a file"
            raise InputError(f"the prismatic joint {joint.name} has no limits to choose from", hint=hint)
    spread: Array = np.random.default_rng(_SEED).random((count, len(low)))
    return np.asarray(low + spread * (high - low))


def attainable_rank(
    robot: Robot, measurements: Measurements, parameters: Sequence[ArmParameter], length: float
) -> int:
    """Return the rank that measurements of the same kinds would have at configurations all over.

    The joints move there by half a turn, or by `length`, to either side of zero, whatever their limits are.
    """
    count = len(measurements.kinds) * _ALL_OVER
    extent = [np.pi if kind == "revolute" else length for kind in robot.joint_types]
    joints = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (count, len(extent))) * extent
    poses = forward(robot, joints)
    kinds = []
    for number, kind in enumerate(measurements.kinds):
        rows = np.arange(number * _ALL_OVER, (number + 1) * _ALL_OVER)
        aims = np.broadcast_to(kind.target.aims[:1], (_ALL_OVER, *kind.target.aims.shape[1:]))
        kinds.append(MeasuredKind(rows, replace(kind.target, poses=poses[rows], aims=aims)))
    somewhere = Measurements(joints, tuple(kinds))
    jacobian = somewhere.differences(robot, parameters)[1] * somewhere.weights(length)[:, :, None]
    return identifiability(jacobian.reshape(-1, len(parameters)), parameters, length).rank


def measuring_plan(
    robot: Robot,
    candidates: Array,
    parameters: Sequence[ArmParameter],
    count: int,
    length: float,
    part: MeasuredPart = "pose",
) -> MeasuringPlan:
    """Return the configurations with the largest O1 that exchanges find.

    The first are taken one by one, each the best addition; then each is exchanged for the best other one, as
    long as that makes the determinant larger.

    Args:
        robot: With nominal parameters.
        candidates: Shape (M, n), rad or m.
        parameters: Which shall be calibrated.
        count: How many configurations are wanted.
        length: Metres that count like a radian.
        part: What is measured at each.

    Raises:
        InputError: When there are fewer candidates than that, or too few configurations for the parameters.
    """
    _, rows = identification_jacobian(robot, candidates, parameters)
    rows = rows[:, :3] if part == "position" else rows * np.repeat([1.0, length], 3)[:, None]
    seen = identifiability(rows.reshape(-1, len(parameters)), parameters, length)
    _check_counts(count, candidates, rows.shape[1], seen, part)
    chosen = _chosen((rows.reshape(-1, len(parameters)) @ seen.basis).reshape(*rows.shape[:2], -1), count)
    jacobian = rows[chosen].reshape(-1, len(parameters))
    final = identifiability(jacobian, parameters, length)
    values = np.linalg.svd(jacobian * units_of(parameters, length), compute_uv=False)[: final.rank]
    smallest = float(values[-1])
    index = float(np.exp(np.log(values).mean()) / np.sqrt(count))
    return MeasuringPlan(chosen, final, index, smallest, float(values[0]) / smallest)


def _check_counts(
    count: int, candidates: Array, coordinates: int, seen: Identifiability, part: MeasuredPart
) -> None:
    if seen.rank == 0:
        raise InputError("no measurement of the tool tells anything of these parameters", hint="free others")
    needed = -(-seen.rank // coordinates)
    if count < needed:
        least = f"{seen.rank} of the parameters, or combinations of them, need at least {needed} measurements"
        raise InputError(f"{count} measurements of a {part} have {count * coordinates} numbers: {least}")
    if count > len(candidates):
        message = f"there are {len(candidates)} candidates, and {count} configurations are wanted"
        raise InputError(message, hint="give a file with more candidates")


def _chosen(rows: Array, count: int) -> NDArray[np.intp]:
    """Return the indices (count,) of rows (M, m, r) whose squares have the largest determinant found."""
    squares = np.swapaxes(rows, 1, 2) @ rows
    ridge = _RIDGE * float(np.einsum("nii->n", squares).mean()) / rows.shape[2]
    information = ridge * np.eye(rows.shape[2])
    free = np.ones(len(rows), dtype=bool)
    chosen: list[int] = []
    for _ in range(count):
        best = int(np.where(free, _gains(rows, information), -np.inf).argmax())
        free[best] = False
        chosen.append(best)
        information = information + squares[best]
    for _ in range(_MOST_PASSES):
        changed = False
        for position, old in enumerate(chosen):
            without = information - squares[old]
            gains = _gains(rows, without)
            best = int(np.where(free, gains, -np.inf).argmax())
            if not free[best] or gains[best] <= gains[old] + _BETTER:
                continue
            free[old], free[best], chosen[position] = True, False, best
            information, changed = without + squares[best], True
        if not changed:
            break
    return np.array(chosen)


def _gains(rows: Array, information: Array) -> Array:
    """Return the logarithm (M,) by which each candidate multiplies the determinant of the information."""
    solved = rows @ np.linalg.inv(information)
    return np.asarray(np.linalg.slogdet(np.eye(rows.shape[1]) + solved @ np.swapaxes(rows, 1, 2))[1])
