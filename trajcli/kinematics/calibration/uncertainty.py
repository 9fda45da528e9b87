"""Uncertainty of calibrated parameters: standard deviations and correlations.

Where deviations of the measurements are not given, those of position and of orientation are estimated, each
from its own residuals and the freedoms that a fit leaves to them which weighs both by these estimates: so the
deviations of the parameters hold whatever scale between lengths and angles was fitted with.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.calibration.fit import Fit, Options
from trajcli.kinematics.calibration.identifiability import identifiability
from trajcli.kinematics.calibration.measurements import Measurements
from trajcli.kinematics.calibration.parameters import ArmParameter

WORTH_MENTIONING = 0.9
"""Magnitude of a correlation from which on it is reported."""

_MOST_CORRELATIONS = 10
_FREEDOM = 0.5  # of one kind of residual, below which both kinds are taken together
_ROUNDS = 20  # of weighing both kinds anew
_EXACT = 1e-10  # of the other kind's variance: one that falls so low tells nothing, and the first one counts


@comparable
class Correlation:
    """Two parameters whose errors go together: -1 to 1."""

    first: ArmParameter
    second: ArmParameter
    value: float


@frozen
class Uncertainty:
    """How well parameters are known.

    Attributes:
        deviations: Of each parameter, rad or m; None where a combination that is not determined holds it, or
            the measurements leave no freedom to estimate their noise.
        noise: Standard deviation of a measured coordinate of position, m, and of orientation, rad; None where
            none was measured, or there is no freedom.
        correlations: The largest ones worth mentioning.
    """

    deviations: tuple[float | None, ...]
    noise: tuple[float | None, float | None]
    correlations: tuple[Correlation, ...]


def uncertainty(
    fit: Fit, measurements: Measurements, parameters: Sequence[ArmParameter], options: Options
) -> Uncertainty:
    """Return the uncertainty of a fit.

    The covariance is P S P^T, with P the pseudo-inverse that maps residuals to parameters and S that of the
    measurements; a robust loss counts by its final weights, which is approximate.

    Source: Seber and Wild, Nonlinear Regression (1989), section 2.1.
    """
    residuals, jacobian = measurements.differences(fit.robot, parameters)
    weights = measurements.weights(options.length) * np.sqrt(fit.weights)[:, None]
    weighted = residuals * weights
    rows = (jacobian * weights[:, :, None]).reshape(-1, len(parameters)) @ fit.span
    left, values, right = np.linalg.svd(rows, full_matrices=False)
    variances = _variances(weighted, left, fit, measurements)
    if variances is None:
        return Uncertainty((None,) * len(parameters), (None, None), ())
    kinds = np.repeat(np.arange(2), 3)
    inverse = fit.span @ (right.T / values)
    spread = left * np.tile(np.sqrt(variances[kinds]), len(residuals))[:, None]
    root = inverse @ spread.T
    covariance = root @ root.T
    free = _undetermined(fit, jacobian * weights[:, :, None], parameters, options)
    held = [parameter not in free for parameter in parameters]
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return Uncertainty(
        tuple(float(value) if each else None for value, each in zip(deviations, held, strict=True)),
        _noise(variances, measurements, options),
        _correlations(covariance, deviations, held, parameters),
    )


def _undetermined(
    fit: Fit, jacobian: Array, parameters: Sequence[ArmParameter], options: Options
) -> set[ArmParameter]:
    seen = fit.nominal
    if fit.released:
        seen = identifiability(jacobian.reshape(-1, len(parameters)), parameters, options.length)
    return {share.parameter for shares in seen.combinations for share in shares}


def _variances(weighted: Array, left: Array, fit: Fit, measurements: Measurements) -> Array | None:
    """Return the variances (2,) of weighted residuals (N, 6) by kind; None without freedom.

    `left` (6 N, r) is an orthonormal basis of what the parameters do to them.

    Source: Koch, Parameter Estimation and Hypothesis Testing in Linear Models (1999), section 3.6.
    """
    if measurements.deviations is not None:
        return np.ones(2)
    parts = weighted.reshape(-1, 2, 3)
    basis = left.reshape(*parts.shape, left.shape[1])
    grams, pulls = np.einsum("nkci,nkcj->kij", basis, basis), np.einsum("nkci,nkc->ki", basis, parts)
    squares = np.square(parts).sum(axis=(0, 2))
    counts = np.array(measurements.counts) * float(fit.weights.mean())
    freedoms = counts.sum() - left.shape[1]
    if freedoms <= _FREEDOM:
        return None
    variances = first = np.full(2, squares.sum() / freedoms)
    for step in range(_ROUNDS):
        if variances.min() <= _EXACT * variances.max():
            return first
        rows = grams / variances[:, None, None]
        inverse = np.linalg.inv(rows.sum(axis=0))
        change = inverse @ (pulls / variances[:, None]).sum(axis=0)
        missed = np.maximum(squares - 2.0 * pulls @ change + grams @ change @ change, 0.0)
        freedom = counts - np.einsum("kij,ji->k", rows, inverse)
        variances = np.where(freedom > _FREEDOM, missed / np.maximum(freedom, _FREEDOM), variances)
        first = first if step else variances
        if freedom.min() <= _FREEDOM:
            break
    return np.asarray(variances)


def _noise(
    variances: Array, measurements: Measurements, options: Options
) -> tuple[float | None, float | None]:
    if measurements.deviations is not None:
        return None, None
    position, angle = np.sqrt(variances) / [1.0, options.length]
    counts = measurements.counts
    return float(position) if counts[0] else None, float(angle) if counts[1] else None


def _correlations(
    covariance: Array, deviations: Array, held: Sequence[bool], parameters: Sequence[ArmParameter]
) -> tuple[Correlation, ...]:
    usable = [i for i, each in enumerate(held) if each and deviations[i] > 0]
    pairs = (
        Correlation(parameters[i], parameters[j], float(covariance[i, j] / (deviations[i] * deviations[j])))
        for i, j in combinations(usable, 2)
    )
    large = [pair for pair in pairs if abs(pair.value) >= WORTH_MENTIONING]
    return tuple(sorted(large, key=lambda pair: -abs(pair.value))[:_MOST_CORRELATIONS])
