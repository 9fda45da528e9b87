"""Losses by their derivative, steps towards the least squares, and what of parameters is determined."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import least_squares

from trajcli.kinematics.calibration import fit as fit_module
from trajcli.kinematics.calibration.fit import Fit, Options, _cost
from trajcli.kinematics.calibration.identifiability import identifiability
from trajcli.kinematics.calibration.parameters import ArmParameter

TWO = [ArmParameter("one", "theta", 0), ArmParameter("other", "theta", 1)]


@pytest.mark.parametrize("loss", ["linear", "huber", "cauchy"])
@pytest.mark.parametrize("scale", [0.1, 1.0, 30.0])
def test_weights_are_the_slope_of_a_loss_by_the_square_of_each_residual(loss: str, scale: float) -> None:
    """Of the cost c of one residual of the square r: w = dc / dr; near 0 every loss is the square."""
    for size in (1e-3, 0.05, 0.099, 0.101, 0.9, 1.1, 7.0, 200.0):
        residuals = size / np.sqrt(6.0) * np.ones((1, 6))
        cost, (weight,) = _cost(residuals, loss, scale)  # type: ignore[arg-type]
        step = 1e-5
        more, less = (_cost(residuals * np.sqrt(1 + side * step), loss, scale)[0] for side in (1, -1))  # type: ignore[arg-type]
        assert weight == pytest.approx((more - less) / (2 * step * size**2), rel=1e-5)
        assert cost <= size**2 * (1 + 1e-12)
        if size < 1e-2 * scale:
            assert cost == pytest.approx(size**2, rel=1e-3)


@pytest.mark.parametrize("loss", ["linear", "huber", "cauchy"])
@pytest.mark.parametrize("scale", [0.1, 1.0, 30.0])
def test_a_loss_is_that_of_scipy(loss: str, scale: float) -> None:
    """Which halves the sum; without a loss the scale says nothing, and none need be given."""
    sizes = np.array([1e-3, 0.05, 0.099, 0.101, 0.9, 1.1, 7.0, 29.0, 200.0])
    peer = least_squares(lambda x: sizes + 0.0 * x[0], [0.0], loss=loss, f_scale=scale, max_nfev=1)
    residuals = sizes[:, None] / np.sqrt(6.0) * np.ones(6)
    for given in (scale, None) if loss == "linear" else (scale,):
        assert _cost(residuals, loss, given)[0] == pytest.approx(2 * peer.cost, rel=1e-12)  # type: ignore[arg-type]


@pytest.mark.parametrize(("apart", "rank"), [(1e-3, 2), (1e-6, 2), (4e-8, 2), (4e-9, 1), (0.0, 1)])
@pytest.mark.parametrize("size", [1.0, 1e-4])
def test_parameters_that_do_nearly_alike_are_told_apart_from_1e_8_on(
    apart: float, rank: int, size: float
) -> None:
    """Of two columns of the length 1 at an angle the smaller singular value is half that, relative to the larger."""
    columns = np.array([[1.0, size * np.cos(apart)], [0.0, size * np.sin(apart)], [0.0, 0.0]])
    found = identifiability(columns, TWO, 1.0)
    assert found.rank == rank
    assert len(found.combinations) == 2 - rank
    if rank == 1:
        weights = [share.weight for share in found.combinations[0]]
        assert weights[1] / weights[0] == pytest.approx(-1.0 / size, rel=1e-6)
        assert weights[0] > 0


@pytest.mark.parametrize("size", [0.2, 3.0, 1e-6])
def test_steps_go_in_what_is_determined_by_how_much_each_parameter_does(size: float) -> None:
    """Two columns alike but for their size: of a step each takes a part as large as what it does is small."""
    found = identifiability(np.array([[1.0, size], [2.0, 2 * size]]), TWO, 1.0)
    assert found.basis.shape == (2, 1)
    assert found.basis[1, 0] / found.basis[0, 0] == pytest.approx(1.0 / size, rel=1e-9)
    assert np.linalg.norm(np.array([[1.0, size], [2.0, 2 * size]]) @ found.basis) > 1.0


@pytest.mark.parametrize(("size", "rank"), [(1e-3, 2), (1e-8, 2), (1e-12, 1), (0.0, 1)])
def test_a_parameter_that_does_little_is_determined_and_one_that_does_nothing_is_not(
    size: float, rank: int
) -> None:
    found = identifiability(np.array([[1.0, 0.0], [0.0, size]]), TWO, 1.0)
    assert found.rank == rank
    assert [[share.parameter for share in shares] for shares in found.combinations] == [[TWO[1]]] * (2 - rank)


class OneNumber:
    """A problem of one parameter x: its robots are x, its residual a function of it."""

    parameters, options = ("x",), Options(1.0)

    def __init__(self, residual, slope):
        self.residual, self.slope = residual, slope

    def rows(self, x):
        residuals, jacobian = np.zeros((1, 6)), np.zeros((1, 6, 1))
        residuals[0, 0], jacobian[0, 0, 0] = self.residual(x), -self.slope(x)
        return residuals, jacobian


def descended(monkeypatch, residual, slope, start: float) -> Fit:
    """Return the fit from a start by steps of Levenberg and Marquardt."""
    monkeypatch.setattr(fit_module, "shifted", lambda x, _, step: x + float(step[0]))
    problem = cast("Any", OneNumber(residual, slope))
    begun = Fit(cast("Any", start), cast("Any", None), np.eye(1), 0, 0, np.ones(1), None, (), True)
    return fit_module._descended(problem, begun, None)


@pytest.mark.parametrize("start", [1.5, 3.0, -8.0, 200.0])
def test_a_step_that_makes_it_worse_is_taken_back(start: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's steps for arctan x = 0 diverge from 1.3918 on: x - (1 + x^2) arctan x is further off, on the other side."""
    fit = descended(monkeypatch, np.arctan, lambda x: 1 / (1 + x**2), start)
    assert abs(float(cast("Any", fit.robot))) < 1e-9
    assert fit.converged


def test_a_step_to_where_nothing_is_defined_is_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 3 Newton's step for log x = 0 leads to 3 - 3 log 3, below 0."""
    fit = descended(monkeypatch, lambda x: np.log(x) if x > 0 else np.nan, lambda x: 1 / x, 3.0)
    assert float(cast("Any", fit.robot)) == pytest.approx(1.0, abs=1e-9)
    assert fit.converged


@pytest.mark.parametrize("start", [-2.0, 0.5])
def test_residuals_that_no_parameters_make_least_are_no_end(
    start: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """exp(-x) is less the larger x is: Newton's steps are all 1."""
    fit = descended(monkeypatch, lambda x: np.exp(-x), lambda x: -np.exp(-x), start)
    assert float(cast("Any", fit.robot)) == pytest.approx(start + fit.iterations, rel=1e-6)
    assert fit.iterations > 20
    assert not fit.converged


def test_a_step_stays_in_what_is_determined() -> None:
    """Of two residuals by two parameters alike there is the step along both: the least one is half for each."""
    residuals, jacobian = np.zeros((1, 6)), np.zeros((1, 6, 2))
    residuals[0, 0], jacobian[0, 0] = 3.0, [2.0, 2.0]
    step = fit_module._step(residuals, jacobian, np.ones(1), np.eye(2), 0.0)
    np.testing.assert_allclose(step, [0.75, 0.75])


@pytest.mark.parametrize("damping", [1e-4, 0.1, 3.0])
def test_a_damped_step_is_that_of_the_normal_equations(damping: float) -> None:
    """(J^T W J + d s^2 I) step = J^T W r, with the largest singular value s of what is weighted."""
    rng = np.random.default_rng(3)
    residuals, jacobian = rng.normal(size=(7, 6)), rng.normal(size=(7, 6, 4))
    weights, span = rng.uniform(0.1, 1.0, 7), rng.normal(size=(4, 3))
    root = np.sqrt(weights)
    J = (jacobian * root[:, None, None]).reshape(42, 4) @ span
    r = (residuals * root[:, None]).reshape(42)
    matrix = J.T @ J + damping * np.linalg.norm(J, 2) ** 2 * np.eye(3)
    found = fit_module._step(residuals, jacobian, weights, span, damping)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, J.T @ r), rtol=1e-9)


class Location(fit_module._Problem):
    """A problem of one number x: how far it is from each of some numbers."""

    def __init__(self, numbers: np.ndarray, loss: Any) -> None:
        self.numbers, self.options, self.parameters = numbers, Options(1.0, loss), []

    def rows(self, robot: Any) -> tuple[np.ndarray, np.ndarray]:
        residuals, jacobian = np.zeros((self.numbers.size, 6)), np.zeros((self.numbers.size, 6, 1))
        residuals[:, 0], jacobian[:, 0, 0] = self.numbers - robot, 1.0
        return residuals, jacobian


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize("start", [-300.0, 0.5, 40.0])
def test_the_scale_of_a_loss_is_that_of_the_residuals_it_ends_with(
    loss: str, start: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it starts: 1.5 medians of them, within a hundredth; the slopes of all losses add up to nothing."""
    monkeypatch.setattr(fit_module, "shifted", lambda x, _, step: x + float(step[0]))
    numbers = np.append(np.random.default_rng(6).normal(size=60), [30.0, 31.0, -5.0])
    problem = Location(numbers, loss)
    begun = Fit(cast("Any", start), cast("Any", None), np.eye(1), 0, 0, np.ones(63), None, (), True)
    fit = fit_module._converged(problem, begun)
    off = numbers - float(cast("Any", fit.robot))
    scale = fit.loss_scale
    assert scale is not None
    assert scale == pytest.approx(1.5 * np.median(np.abs(off)), rel=0.0101)
    ratio = np.abs(off) / scale
    weights = 1.0 / (1.0 + ratio**2) if loss == "cauchy" else 1.0 / np.maximum(ratio, 1.0)
    np.testing.assert_allclose(fit.weights, weights, rtol=1e-6)
    assert abs((weights * off).sum()) < 1e-5
    assert fit.outliers == tuple(np.flatnonzero(ratio > 3.0).tolist())
    assert fit.converged


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize("unit", [1e-6, 1e4])
def test_the_scale_of_a_loss_does_not_depend_on_the_unit(
    unit: float, loss: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit_module, "shifted", lambda x, _, step: x + float(step[0]))
    numbers = np.append(np.random.default_rng(8).normal(size=40), [20.0, -9.0])
    begun = Fit(cast("Any", 2.0), cast("Any", None), np.eye(1), 0, 0, np.ones(42), None, (), True)
    one = fit_module._converged(Location(numbers, loss), begun)
    other = fit_module._converged(
        Location(unit * numbers, loss), replace(begun, robot=cast("Any", 2.0 * unit))
    )
    assert other.loss_scale == pytest.approx(unit * cast("float", one.loss_scale), rel=1e-6)
    assert other.outliers == one.outliers
    np.testing.assert_allclose(other.weights, one.weights, rtol=1e-5)
