"""Steps as a sequence, against the list that they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.checks.continuity import AccelerationStep, AccelerationSteps

EXPECTED = [
    AccelerationStep(2, "a", 0.5, 1.0),
    AccelerationStep(2, "b", 0.5, -1.0),
    AccelerationStep(4, "b", 0.75, 2.0),
]
STEPS = AccelerationSteps(
    np.array([2, 2, 4]),
    np.array([0, 1, 1]),
    np.array([0.5, 0.5, 0.75]),
    np.array([1.0, -1.0, 2.0]),
    ("a", "b"),
)


def test_steps_are_a_sequence():
    assert list(STEPS) == EXPECTED
    assert len(STEPS) == 3
    assert (STEPS[0], STEPS[-1]) == (EXPECTED[0], EXPECTED[-1])
    assert STEPS[1:] == EXPECTED[1:]
    assert STEPS[::-1] == EXPECTED[::-1]
    with pytest.raises(IndexError):
        STEPS[3]


def test_no_steps_are_nothing():
    nothing = np.empty(0, dtype=int)
    assert not AccelerationSteps(nothing, nothing, np.empty(0), np.empty(0), ("a",))
