"""The cycloidal law against its formula."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.curves.rest_to_rest import PEAKS, cycloid_law

ERRORS = (1e-15, 1e-14, 5e-13, 2e-11)  # of the peaks of s and its derivatives


def formula(u: np.ndarray, order: int) -> np.ndarray:
    angle = 2 * np.pi * u
    if order == 0:
        return u - np.sin(angle) / (2 * np.pi)
    if order == 1:
        return 1 - np.cos(angle)
    return (2 * np.pi) ** (order - 1) * (np.sin(angle) if order == 2 else np.cos(angle))


@pytest.mark.parametrize("duration", [1e-3, 0.37, 1.0, 6.13151, 1e3])
@pytest.mark.parametrize("order", range(4))
def test_the_law_follows_its_formula(duration: float, order: int) -> None:
    law = cycloid_law(duration)
    t = np.linspace(0, duration, 5001)
    got = law.evaluate(t, order)[:, 0] * duration**order
    assert np.abs(got - formula(t / duration, order)).max() <= ERRORS[order] * PEAKS[order]


@pytest.mark.parametrize("duration", [0.37, 1.0, 6.13151])
def test_pieces_join_and_ends_rest(duration: float) -> None:
    law = cycloid_law(duration)
    for order in range(4):
        first, last = (ends * duration**order for ends in law.piece_ends(order))
        assert np.abs(first[1:] - last[:-1]).max() <= ERRORS[order] * PEAKS[order]
        wanted = (1.0, 0.0, 0.0, 4 * np.pi**2)[order]
        assert last[-1, 0] == pytest.approx(wanted, abs=ERRORS[order] * PEAKS[order])
        assert first[0, 0] == (pytest.approx(wanted, rel=1e-15) if order == 3 else 0.0)


def test_peaks_are_met() -> None:
    law = cycloid_law(1.0)
    t = np.linspace(0, 1, 4 * 2500 + 1)
    for order in range(1, 4):
        assert np.abs(law.evaluate(t, order)).max() == pytest.approx(PEAKS[order], rel=5e-12)
