"""Noise, deviations and correlations of parameters, and when released ones explain more than noise lets them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import minimize

from trajcli.kinematics.calibration import uncertainty
from trajcli.kinematics.calibration.fit import Fit, Options, _Problem
from trajcli.kinematics.calibration.parameters import ArmParameter

Pairs = list[tuple[int, int, float]]


def pairs(covariance: np.ndarray, known: list[bool]) -> Pairs:
    """Return the correlations that are reported, by the numbers of the parameters."""
    deviations, numbers = np.sqrt(np.diag(covariance)), cast("Any", range(len(known)))
    found = uncertainty._correlations(covariance, deviations, known, numbers)
    return [(cast("Any", each.first), cast("Any", each.second), each.value) for each in found]


def covariance(values: dict[tuple[int, int], float], deviations: list[float]) -> np.ndarray:
    correlations = np.eye(len(deviations))
    for (i, j), value in values.items():
        correlations[i, j] = correlations[j, i] = value
    return correlations * np.outer(deviations, deviations)


def test_correlations_are_those_of_the_covariance_the_largest_first() -> None:
    """Of either sign, whatever the deviations; from 0.9 on."""
    of = covariance({(0, 1): 0.95, (1, 3): -0.97, (0, 2): 0.89, (2, 3): -0.9}, [2.0, 1e-3, 5.0, 0.1])
    assert pairs(of, [True] * 4) == [
        (1, 3, pytest.approx(-0.97)),
        (0, 1, pytest.approx(0.95)),
        (2, 3, pytest.approx(-0.9)),
    ]


def test_parameters_that_are_not_determined_have_no_correlation() -> None:
    of = covariance({(0, 1): 0.95, (1, 2): -0.97, (0, 2): 0.93}, [2.0, 1e-3, 5.0])
    assert pairs(of, [True, False, True]) == [(0, 2, pytest.approx(0.93))]
    of[1] = of[:, 1] = 0.0  # exactly known: nothing goes together with it
    with np.errstate(all="raise"):
        assert pairs(of, [True] * 3) == [(0, 2, pytest.approx(0.93))]


def test_the_ten_largest_correlations_are_reported() -> None:
    values = {(i, j): 0.9 + 0.005 * (i + j) for i in range(6) for j in range(i + 1, 6)}
    found = pairs(covariance(values, [1.0] * 6), [True] * 6)
    assert [value for *_, value in found] == pytest.approx(sorted(values.values(), reverse=True)[:10])


def problem(counts: tuple[int, int], deviations: object = None) -> _Problem:
    """Return a problem whose robots are their residuals."""
    made = _Problem.__new__(_Problem)
    made.measurements = cast("Any", SimpleNamespace(counts=counts, deviations=deviations))
    made.rows = lambda robot: (cast("Any", robot), np.empty(0))  # type: ignore[method-assign]
    return made


def fitted(squares: float, released: int, count: int = 20, weight: float = 1.0) -> Fit:
    """Return a fit of so many parameters, with residuals of a weighted sum of squares."""
    residuals = np.zeros((count, 6))
    residuals[:, 2] = np.sqrt(squares / count / weight)
    parts = {"robot": residuals, "span": np.eye(9)[:, :released], "weights": np.full(count, weight)}
    return cast("Any", SimpleNamespace(**parts))


@pytest.mark.parametrize("weight", [1.0, 0.25])
@pytest.mark.parametrize("added", [1, 3])
def test_released_parameters_must_explain_more_than_noise(added: int, weight: float) -> None:
    """60 coordinates, 4 + `added` parameters, a variance of 1: by the F-test that the module names, in its numbers."""
    from trajcli.kinematics.calibration.fit import _BEYOND_CHANCE

    freedom = 60 - 4 - added
    after, needed = float(freedom), added * _BEYOND_CHANCE
    for share, beyond in ((0.99, False), (1.01, True)):
        before = fitted(after + share * needed, 4, weight=weight)
        assert problem((60, 0)).beyond_chance(before, fitted(after, 4 + added, weight=weight)) is beyond


def test_stated_deviations_are_the_noise_and_no_freedom_tells_nothing() -> None:
    from trajcli.kinematics.calibration.fit import _BEYOND_CHANCE

    for share, beyond in (
        (0.99, False),
        (1.01, True),
    ):  # residuals in units of the deviations: a variance of 1
        before, after = fitted(5.0 + share * _BEYOND_CHANCE, 4), fitted(5.0, 5)
        assert problem((60, 0), (1e-3, None)).beyond_chance(before, after) is beyond
    assert problem((30, 30)).beyond_chance(fitted(60.0, 4), fitted(20.0, 5))
    assert not problem((3, 2)).beyond_chance(fitted(1e3, 4), fitted(1.0, 5))
    assert not problem((2, 0)).beyond_chance(fitted(1e3, 4), fitted(1.0, 5))


def test_exact_data_have_no_variance() -> None:
    """Rounding that is left after a fit, of less than a picometre in each coordinate, is explained by nothing."""
    for off, beyond in ((0.9e-12, False), (1.1e-12, True), (1e-3, True)):
        assert problem((60, 0)).beyond_chance(fitted(60 * off**2, 4), fitted(0.0, 5)) is beyond


def test_variances_are_by_kind_or_of_both_where_one_has_no_freedom() -> None:
    """Squares of 2 and of 0.5 over freedoms by hand: coordinates times the mean weight, less what the fit took."""
    rows = np.zeros((10, 6))
    rows[:, 1], rows[:, 4] = np.sqrt(0.2), np.sqrt(0.05)  # sums of squares: 2 and 0.5
    fit = cast("Any", SimpleNamespace(weights=np.full(10, 0.8)))

    def found(counts: tuple[int, int], taken: tuple[int, int], stated: object = None) -> Any:
        left = np.zeros((10, 6, sum(taken)))  # each column takes one coordinate that is no residual
        at = [(k, 0) for k in range(taken[0])] + [(k, 3) for k in range(taken[1])]
        for column, (row, coordinate) in enumerate(at):
            left[row, coordinate, column] = 1.0
        measured = cast("Any", SimpleNamespace(counts=counts, deviations=stated))
        return uncertainty._variances(rows, left.reshape(60, -1), fit, measured)

    np.testing.assert_allclose(found((30, 30), (4, 2)), [2.0 / 20, 0.5 / 22])
    np.testing.assert_allclose(found((30, 3), (4, 2)), [2.0 / 20, 2.5 / 20.4])  # 0.4 left: taken together
    np.testing.assert_allclose(found((3, 30), (2, 4)), [2.5 / 20.4, 0.5 / 20])
    assert found((5, 5), (4, 4)) is None
    np.testing.assert_allclose(found((5, 5), (4, 4), (1e-3, 1e-3)), [1.0, 1.0])


class LinearMeasurements:
    """Measurements whose residuals and Jacobian are given, as those of a linear model."""

    def __init__(
        self, count: int, parameters: int, seed: int = 0, counts: tuple[int, int] | None = None
    ) -> None:
        rng = np.random.default_rng(seed)
        self.residuals, self.jacobian = rng.normal(size=(count, 6)), rng.normal(size=(count, 6, parameters))
        self.residuals[:, 3:] *= 0.03
        self.counts = (3 * count, 3 * count) if counts is None else counts
        for kind, number in enumerate(self.counts):
            if not number:
                self.residuals[:, 3 * kind : 3 * kind + 3] = self.jacobian[:, 3 * kind : 3 * kind + 3] = 0.0
        self.deviations: np.ndarray | None = None

    def differences(self, robot: object, parameters: object) -> tuple[np.ndarray, np.ndarray]:
        return self.residuals, self.jacobian

    def weights(self, length: float) -> np.ndarray:
        if self.deviations is None:
            return np.broadcast_to([1.0, 1.0, 1.0, length, length, length], self.residuals.shape)
        return np.repeat(1.0 / self.deviations, 3, axis=1)


NAMES = [ArmParameter(f"p{k}", "theta", k) for k in range(4)]


def fit_of(made: LinearMeasurements, span: np.ndarray, combinations: object = (), released: int = 0) -> Fit:
    """Return a fit with weights of a robust loss."""
    weights = np.random.default_rng(9).uniform(0.3, 1.0, len(made.residuals))
    nominal = SimpleNamespace(combinations=combinations)
    parts = {"robot": None, "span": span, "weights": weights, "nominal": nominal, "released": released}
    return cast("Any", SimpleNamespace(**parts))


def restricted(logarithms: np.ndarray, rows: np.ndarray, residuals: np.ndarray, counts: np.ndarray) -> float:
    """Return the restricted likelihood of variances by kind (2,), its logarithm times -2, but for a constant."""
    inverse = np.exp(-logarithms)[np.arange(len(rows)) % 6 // 3]
    normal = rows.T @ (inverse[:, None] * rows)
    missed = residuals - rows @ np.linalg.solve(normal, rows.T @ (inverse * residuals))
    return float(counts @ logarithms + np.linalg.slogdet(normal)[1] + inverse @ missed**2)


def by_pseudo_inverse(made: LinearMeasurements, fit: Fit, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance of the parameters, and the likeliest variance of either kind of residual."""
    weights = (made.weights(length) * np.sqrt(fit.weights)[:, None]).ravel()
    rows = (made.jacobian.reshape(len(weights), -1) * weights[:, None]) @ fit.span
    inverse, residuals = np.linalg.pinv(rows), made.residuals.ravel() * weights
    variances, counts = np.ones(2), np.array(made.counts) * fit.weights.mean()
    if made.deviations is None and all(made.counts):
        least = minimize(restricted, np.zeros(2), (rows, residuals, counts), "Nelder-Mead", tol=1e-10)
        variances = np.exp(least.x)
    elif made.deviations is None:
        missed = residuals - rows @ (inverse @ residuals)
        variances *= (missed**2).sum() / (counts.sum() - rows.shape[1])
    mapped = fit.span @ inverse
    kind = np.arange(len(weights)) % 6 // 3
    return mapped @ np.diag(variances[kind]) @ mapped.T, variances


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("length", [1.0, 0.2])
@pytest.mark.parametrize("counts", [None, (60, 0), (0, 60)])
@pytest.mark.parametrize("rank", [4, 2])
def test_deviations_are_those_of_the_pseudo_inverse(
    rank: int, counts: tuple[int, int] | None, length: float, *, stated: bool
) -> None:
    """Of a linear model with weights, in which steps go in two or all four directions of four parameters."""
    made = LinearMeasurements(20, 4, counts=counts)
    if stated:
        made.deviations = np.random.default_rng(2).uniform(0.5, 2.0, (20, 2))
    span = np.random.default_rng(5).normal(size=(4, rank))
    fit = fit_of(made, span)
    found = uncertainty.uncertainty(fit, cast("Any", made), NAMES, Options(length))
    wanted, variances = by_pseudo_inverse(made, fit, length)
    np.testing.assert_allclose(cast("Any", found.deviations), np.sqrt(np.diag(wanted)), rtol=1e-6)
    noise = [np.sqrt(variances[0]), np.sqrt(variances[1]) / length]
    known = [None if stated or not made.counts[k] else pytest.approx(noise[k]) for k in range(2)]
    assert list(found.noise) == known


@pytest.mark.parametrize("length", [0.01, 100.0])
def test_noise_is_told_whatever_scale_was_fitted_with(length: float) -> None:
    """Of 48 numbers by 20 parameters: the kind that counts more brings its noise into residuals of the other."""
    names, found = [ArmParameter(f"p{k}", "theta", k) for k in range(20)], []
    for seed in range(40):
        made = LinearMeasurements(8, 20, seed)
        weights = made.weights(length).ravel()
        rows = made.jacobian.reshape(48, 20) * weights[:, None]
        noise = made.residuals.ravel() * weights
        made.residuals = ((noise - rows @ np.linalg.lstsq(rows, noise)[0]) / weights).reshape(8, 6)
        fit = fit_of(made, np.eye(20))
        fit.weights[:] = 1.0
        found.append(uncertainty.uncertainty(fit, cast("Any", made), names, Options(length)).noise)
    np.testing.assert_allclose(np.mean(np.square(cast("Any", found)), axis=0), [1.0, 0.03**2], rtol=0.2)


def test_what_no_combination_leaves_open_has_a_deviation() -> None:
    """Of two combinations every parameter is open; after a release those that count are seen anew."""
    shares = [[SimpleNamespace(parameter=NAMES[0])], [SimpleNamespace(parameter=NAMES[k]) for k in (1, 3)]]
    made = LinearMeasurements(20, 4)
    made.jacobian[:, :, 3] = 2.0 * made.jacobian[:, :, 2]

    def held(combinations: object, released: int) -> list[bool]:
        fit = fit_of(made, np.eye(4)[:, :3], combinations, released)
        return [
            each is not None
            for each in uncertainty.uncertainty(fit, cast("Any", made), NAMES, Options(1.0)).deviations
        ]

    assert held(shares, 0) == [False, False, True, False]
    assert held((), 0) == [True] * 4
    assert held((), 1) == held(shares, 1) == [True, True, False, False]


def test_a_parameter_that_outliers_alone_would_tell_is_not_known() -> None:
    """The one measurement that it moves has no weight any more."""
    made = LinearMeasurements(20, 4)
    made.jacobian[1:, :, 3] = 0.0
    fit = fit_of(made, np.eye(4)[:, :3], (), 1)
    fit.weights[0] = 0.0
    found = uncertainty.uncertainty(fit, cast("Any", made), NAMES, Options(1.0))
    assert [each is not None for each in found.deviations] == [True, True, True, False]


def test_without_freedom_nothing_is_known() -> None:
    """Of three coordinates and three parameters nothing is left to tell the noise by."""
    made = LinearMeasurements(1, 4, counts=(3, 0))
    found = uncertainty.uncertainty(fit_of(made, np.eye(4)[:, :3]), cast("Any", made), NAMES, Options(1.0))
    assert found.deviations == (None,) * 4
    assert (found.noise, found.correlations) == ((None, None), ())


def test_noise_is_told_where_no_parameter_is() -> None:
    """With nothing fitted it is the root mean square of the residuals, by kind."""
    made = LinearMeasurements(20, 4)
    fit = fit_of(made, np.zeros((4, 0)))
    fit.weights[:] = 1.0
    found = uncertainty.uncertainty(fit, cast("Any", made), NAMES, Options(1.0))
    wanted = [float(np.sqrt(np.mean(made.residuals[:, part] ** 2))) for part in (slice(3), slice(3, 6))]
    np.testing.assert_allclose(cast("Any", found.noise), wanted)


@pytest.mark.parametrize("exact", [0, 1])
@pytest.mark.parametrize("size", [0.0, 1e-15, 1e-9])
def test_one_kind_may_be_exact(exact: int, size: float) -> None:
    """As in measurements that were computed in part; its 30 numbers determine 10 of 20 parameters."""
    names = [ArmParameter(f"p{k}", "theta", k) for k in range(20)]
    made = LinearMeasurements(10, 20)
    made.residuals[:, 3 * exact : 3 * exact + 3] *= size
    made.jacobian[:, 3 * exact : 3 * exact + 3, 10:] = 0.0
    found = uncertainty.uncertainty(fit_of(made, np.eye(20)), cast("Any", made), names, Options(1.0))
    noise = np.array(cast("Any", found.noise))
    assert np.isfinite(noise).all()
    assert noise[exact] < noise[1 - exact]
    assert all(abs(pair.value) <= 1.0 + 1e-9 for pair in found.correlations)
