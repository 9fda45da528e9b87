"""Which of two equal peaks is named: the earliest, where rounding alone makes another one higher."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import PiecewisePolynomial


def peaked(heights, size):
    """Return parabolas, each over one second from 0 to 0, of the given heights."""
    tops = np.array(heights) * size
    return PiecewisePolynomial(
        np.arange(tops.size + 1.0), np.stack([-4 * tops, 4 * tops, 0 * tops])[:, :, None]
    )


@pytest.mark.parametrize("size", [1.0, -300.0, 1e-7])
@pytest.mark.parametrize("more", [1, 80])
@pytest.mark.parametrize("together", [1, 32_768])
@pytest.mark.parametrize(("higher", "named"), [(0.0, 0.5), (4e-13, 0.5), (3e-12, 1.5)])
def test_a_peak_that_is_higher_by_rounding_is_no_other_one(size, more, higher, named, together, monkeypatch):
    """Few pieces or many, of which control points say where it pays to look; looked at together or not."""
    monkeypatch.setattr("trajcli.curves.extrema._PARTS", together)
    (found,) = peaks(peaked([1.0, 1.0 + higher, *[0.5] * more], size), (0,))
    value, time = (found.high, found.high_time) if size > 0 else (found.low, found.low_time)
    assert value[0] == pytest.approx((1.0 + higher) * size, rel=1e-15)
    assert time[0] == named
