"""Losses by their derivative, and how far a parameter must differ from others to be determined."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.kinematics.calibration.fit import _cost
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
