"""What is a breach and what is rounding."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.limits.tolerances import allowed_jump, exceeds


@pytest.mark.parametrize("bound", [1e-3, 1.0, 2e4])
def test_a_bound_gives_way_by_a_billionth(bound: float) -> None:
    assert exceeds(bound * (1 + 2e-9) + 1e-12, bound)
    assert not exceeds(bound * (1 + 0.5e-9), bound)
    assert not exceeds(bound, bound)
    assert not exceeds(-2 * bound, bound)


@pytest.mark.parametrize("bound", [-2.0, -1e-3, 0.0])
def test_a_bound_below_zero_gives_way_upwards_too(bound: float) -> None:
    assert not exceeds(bound, bound)
    assert not exceeds(bound + 0.5e-12, bound)
    assert not exceeds(bound + 0.5e-9 * abs(bound), bound)
    assert exceeds(bound + 2e-9 * abs(bound) + 2e-12, bound)


def test_nothing_exceeds_infinity_and_a_number_that_is_none_exceeds_everything() -> None:
    assert not exceeds(1e300, np.inf)
    assert exceeds(np.nan, 1.0)
    assert exceeds([1.0, 3.0], [2.0, 2.0]).tolist() == [False, True]


def test_a_late_break_explains_a_difference_and_a_slow_joint_does_not() -> None:
    allowed = allowed_jump(np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.array([[1e15, 0.0], [1e15, 0.0]]))
    assert allowed[0] == pytest.approx([1e-9, 1e-12], rel=1e-2)
    assert allowed[1] == pytest.approx([0.444, 1e-12], rel=1e-2)
