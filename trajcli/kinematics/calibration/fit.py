"""Least-squares calibration: Levenberg and Marquardt's steps among the parameters that are identifiable.

Steps stay in the combinations that the measurements determine at the nominal parameters; what they do not
determine keeps its nominal value, as by steps of least norm. Where these combinations leave residuals that
others, unidentifiable at the nominal parameters and weakly identifiable at the calibrated ones, explain far
beyond chance, those are released too, and named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.calibration.identifiability import Identifiability, identifiability
from trajcli.kinematics.calibration.measurements import Measurements
from trajcli.kinematics.calibration.parameters import ArmParameter, shifted
from trajcli.kinematics.robot import Robot

Loss = Literal["linear", "huber", "cauchy"]

_MOST_STEPS = 100
_SMALLEST_STEP = 1e-13  # of a step in the scaled parameters, m
_ENOUGH = 1e-13  # relative decrease of the cost that is rounding
_FIRST_DAMPING, _MOST_DAMPING = 1e-4, 1e8  # of the squared largest singular value
_SMALLEST_SCALE = 1e-12  # m: exact data have no noise to measure a loss by
_SAME_SCALE = 0.01
_OUTLIER = 3.0  # over the scale of the loss
_MOST_SCALES = 20
_BEYOND_CHANCE = 30.0  # of F, the decrease for each released combination over the variance: 5.5 deviations
_STABLE = 5  # changes of rank at most


@comparable
class Options:
    """How residuals count.

    Attributes:
        length: Metres that count like a radian.
        loss: Of each measurement's weighted residual.
        loss_scale: Where the loss leaves the square, over the median of the measurements' residuals: 1.5 is
            about the 95 % quantile where all six coordinates are measured with normal noise.
    """

    length: float
    loss: Loss = "linear"
    loss_scale: float = 1.5


@frozen
class Fit:
    """A calibrated robot.

    Attributes:
        robot: With its new parameters.
        nominal: What the measurements tell at the nominal parameters.
        span: Shape (p, r): the changes that the steps could take.
        released: How many combinations that are not determined at the nominal parameters were released.
        iterations: Accepted steps.
        weights: Of each measurement by the loss, shape (N,): 1 where it is linear.
        loss_scale: Where the loss left the square, m, or deviations where these are known; None: nowhere.
        outliers: Indices of measurements whose residual is more than three times that.
        converged: Whether the last steps came to rest.
    """

    robot: Robot
    nominal: Identifiability
    span: Array
    released: int
    iterations: int
    weights: Array
    loss_scale: float | None
    outliers: tuple[int, ...]
    converged: bool


def calibrate(
    robot: Robot, measurements: Measurements, parameters: Sequence[ArmParameter], options: Options
) -> Fit:
    """Return the robot whose tool is nearest to the measured poses.

    Args:
        robot: With nominal parameters.
        measurements: At least one.
        parameters: Which may change.
        options: How residuals count.

    Raises:
        InputError: When the robot has no geometry, or joint values are not finite.

    Source: Levenberg (1944) and Marquardt (1963) as in Nocedal and Wright (2006), section 10.3; Hollerbach
    and Wampler, The calibration index and taxonomy for robot kinematic calibration methods, Int. J. Robotics
    Research 15 (1996), for scaling and rank.
    """
    problem = _Problem(measurements, parameters, options)
    seen = problem.seen(robot)
    fit = _converged(
        problem, Fit(robot, seen, seen.basis, 0, 0, np.ones(len(measurements.joints)), None, (), True)
    )
    for _ in range(_STABLE):
        now = problem.seen(fit.robot)
        if now.rank <= fit.span.shape[1]:
            break
        trial = _converged(problem, replace(fit, span=now.basis, released=now.rank - seen.rank))
        if not problem.beyond_chance(fit, trial):
            break
        fit = trial
    return fit


class _Problem:
    """Weighted residuals of a robot, and their cost."""

    def __init__(
        self, measurements: Measurements, parameters: Sequence[ArmParameter], options: Options
    ) -> None:
        self.measurements, self.parameters, self.options = measurements, parameters, options
        self.weights = measurements.weights(options.length)

    def seen(self, robot: Robot) -> Identifiability:
        _, jacobian = self.rows(robot)
        return identifiability(
            jacobian.reshape(-1, len(self.parameters)), self.parameters, self.options.length
        )

    def rows(self, robot: Robot) -> tuple[Array, Array]:
        """Return the weighted residuals (N, 6) and their Jacobian (N, 6, p)."""
        missed, jacobian = self.measurements.differences(robot, self.parameters)
        jacobian *= self.weights[:, :, None]
        return missed * self.weights, jacobian

    def loss_scale(self, robot: Robot) -> float:
        """Return where the loss of a robot's residuals leaves the square."""
        return max(self.options.loss_scale * float(np.median(self.norms(robot))), _SMALLEST_SCALE)

    def norms(self, robot: Robot) -> Array:
        """Return the length (N,) of each measurement's weighted residual."""
        return np.asarray(np.linalg.norm(self.rows(robot)[0], axis=1))

    def beyond_chance(self, fit: Fit, trial: Fit) -> bool:
        """Return whether released combinations take away more of the squares than noise lets them."""
        before, after = (
            float(np.einsum("n,ni,ni", each.weights, rows := self.rows(each.robot)[0], rows))
            for each in (fit, trial)
        )
        added = trial.span.shape[1] - fit.span.shape[1]
        freedom = sum(self.measurements.counts) - trial.span.shape[1]
        variance = after / freedom if freedom > 0 and self.measurements.deviations is None else 1.0
        enough = _SMALLEST_SCALE**2 * sum(self.measurements.counts)  # exact data have no variance
        return bool(freedom > 0 and before - after > max(added * _BEYOND_CHANCE * variance, enough))


def _converged(problem: _Problem, fit: Fit) -> Fit:
    """Return the fit that no step improves; the scale of a robust loss follows the residuals' median."""
    if problem.options.loss == "linear":
        return _descended(problem, fit, None)
    scale = problem.loss_scale(fit.robot)
    for _ in range(_MOST_SCALES):
        fit = replace(_descended(problem, fit, scale), loss_scale=scale)
        last, scale = scale, problem.loss_scale(fit.robot)
        if abs(scale - last) <= _SAME_SCALE * last:
            break
    far = problem.norms(fit.robot) > _OUTLIER * scale
    return replace(fit, outliers=tuple(np.flatnonzero(far).tolist()))


def _descended(problem: _Problem, fit: Fit, scale: float | None) -> Fit:
    """Return the fit after steps of Levenberg and Marquardt, the first of them without damping."""
    robot, damping, loss = fit.robot, 0.0, problem.options.loss
    residuals, jacobian = problem.rows(robot)
    cost, weights = _cost(residuals, loss, scale)
    iterations, converged = fit.iterations, False
    for _ in range(_MOST_STEPS):
        step = _step(residuals, jacobian, weights, fit.span, damping)
        trial = shifted(robot, problem.parameters, fit.span @ step)
        next_residuals, next_jacobian = problem.rows(trial)
        next_cost, next_weights = _cost(next_residuals, loss, scale)
        if not next_cost <= cost:
            converged = damping > _MOST_DAMPING or np.abs(step).max(initial=0.0) <= _SMALLEST_STEP
            if converged:
                break
            damping = max(_FIRST_DAMPING, 10.0 * damping)
            continue
        decrease = cost - next_cost
        robot, cost, weights = trial, next_cost, next_weights
        residuals, jacobian = next_residuals, next_jacobian
        damping = 0.0 if damping <= _FIRST_DAMPING else 0.1 * damping
        iterations += 1
        converged = decrease <= _ENOUGH * cost or np.abs(step).max(initial=0.0) <= _SMALLEST_STEP
        if converged:
            break
    return replace(fit, robot=robot, iterations=iterations, weights=weights, converged=bool(converged))


def _step(residuals: Array, jacobian: Array, weights: Array, span: Array, damping: float) -> Array:
    """Return the step (r,) in the coordinates of the span."""
    root = np.sqrt(weights)[:, None]
    rows = np.asarray(jacobian.reshape(-1, jacobian.shape[2]) @ span).reshape(*residuals.shape, -1)
    joined = np.concatenate([rows, residuals[:, :, None]], axis=2) * root[:, :, None]
    triangle = np.asarray(np.linalg.qr(joined.reshape(-1, joined.shape[2]), mode="r"))
    left, values, right = np.linalg.svd(triangle[:, :-1], full_matrices=False)
    bound = max(float(values.max(initial=0.0)), np.finfo(np.float64).tiny)
    ratio = values / bound
    kept = ratio > np.finfo(np.float64).eps
    filtered = np.where(kept, ratio / (ratio**2 + damping + ~kept), 0.0) / bound
    return np.asarray(right.T @ (filtered * (left.T @ triangle[:, -1])))


def _cost(residuals: Array, loss: Loss, scale: float | None) -> tuple[float, Array]:
    """Return the sum of the loss over measurements, and the weights (N,) of the steps that lower it.

    Source: Huber, Robust Statistics (1981), section 7.8; Holland and Welsch, Robust regression using
    iteratively reweighted least squares (1977).
    """
    squares = np.einsum("ni,ni->n", residuals, residuals)
    if loss == "linear" or scale is None:
        return float(squares.sum()), np.ones(len(squares))
    ratio = squares / scale**2
    if loss == "cauchy":
        return float(scale**2 * np.log1p(ratio).sum()), 1.0 / (1.0 + ratio)
    root = np.sqrt(np.maximum(ratio, 1.0))
    return float(scale**2 * np.where(ratio <= 1.0, ratio, 2.0 * root - 1.0).sum()), 1.0 / root
