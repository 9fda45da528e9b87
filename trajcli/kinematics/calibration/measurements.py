"""Measured poses of a tool, whole or in part, and how far a robot misses them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.calibration.identifiability import identification_jacobian
from trajcli.kinematics.calibration.parameters import ArmParameter
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import IkTarget, closure_of, residual_jacobian, residuals
from trajcli.kinematics.robot import Robot


@frozen
class MeasuredKind:
    """Measurements that fix the same coordinates of a pose.

    Attributes:
        rows: Which measurements these are, shape (K,).
        target: What they measured, a flat batch of K.
    """

    rows: NDArray[np.intp]
    target: IkTarget


@frozen
class Measurements:
    """Poses that were measured at known joint values.

    Attributes:
        joints: Shape (N, n), rad or m.
        kinds: Each measurement is in one of them.
        deviations: Standard deviations of position, m, and orientation, rad, shape (N, 2); None where they
            are not known, and are the same for all.
    """

    joints: Array
    kinds: tuple[MeasuredKind, ...]
    deviations: Array | None = None

    @property
    def counts(self) -> tuple[int, int]:
        """How many numbers were measured of positions, and of orientations."""
        position = sum(len(kind.rows) * sum(kind.target.position) for kind in self.kinds)
        return position, sum(len(kind.rows) * kind.target.coordinates for kind in self.kinds) - position

    def weights(self, length: float) -> Array:
        """Return what residuals are multiplied with, (N, 6): 1 and `length`, or one over the deviations."""
        if self.deviations is None:
            return np.broadcast_to([1.0, 1.0, 1.0, length, length, length], (len(self.joints), 6))
        return np.repeat(1.0 / self.deviations, 3, axis=1)

    def differences(self, robot: Robot, parameters: Sequence[ArmParameter]) -> tuple[Array, Array]:
        """Return the residuals (N, 6), measured less computed, and their Jacobian (N, 6, p) by parameters.

        Position comes first; what was not measured is zero. Residuals of orientation are rotation vectors
        phi; a turn dw of the tool counts as -dw there. That leaves the gradient of phi^T phi exact (the left
        Jacobian of SO(3) maps phi to itself), and so the answer, if not each step.
        """
        poses, slopes = identification_jacobian(robot, self.joints, parameters)
        missed = np.zeros((len(poses), 6))
        jacobian = np.zeros(slopes.shape)
        for kind in self.kinds:
            split = sum(kind.target.position)
            part, slope = (
                residuals(kind.target, poses[kind.rows]),
                residual_jacobian(kind.target, poses[kind.rows], slopes[kind.rows]),
            )
            turns = slice(3, 3 + part.shape[1] - split)
            missed[kind.rows, :split], missed[kind.rows, turns] = part[:, :split], part[:, split:]
            jacobian[kind.rows, :split], jacobian[kind.rows, turns] = slope[:, :split], slope[:, split:]
        return missed, jacobian

    def root_mean_squares(self, robot: Robot) -> tuple[float | None, float | None]:
        """Return the root mean squares of the distance, m, and of the angle, rad; None where none counts."""
        poses = forward(robot, self.joints)
        squares: tuple[list[Array], list[Array]] = ([], [])
        for kind in self.kinds:
            missed = closure_of(kind.target, poses[kind.rows])
            if any(kind.target.position):
                squares[0].append(missed[:, 0] ** 2)
            if kind.target.orientation != "none":
                squares[1].append(missed[:, 1] ** 2)
        position, angle = (float(np.sqrt(np.concatenate(part).mean())) if part else None for part in squares)
        return position, angle
