"""The smallest number within a bound, among intervals of every width."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.curves.smallest_feasible import smallest_feasible


def outside(*intervals: tuple[float, float]):
    """Return by what part x is outside the nearest interval."""

    def excess(x: np.ndarray) -> np.ndarray:
        return np.min([np.maximum(low / x, x / high) - 1 for low, high in intervals], axis=0)

    return excess


@settings(max_examples=60, deadline=None)
@given(
    left=st.floats(1.01, 900),
    width=st.floats(-11, 0).map(lambda power: 10.0**power),
    gap=st.floats(1.2, 50),
    block=st.sampled_from([1, 3, 64]),
)
def test_the_left_end_of_the_first_interval_is_found(
    left: float, width: float, gap: float, block: int
) -> None:
    first = (left, left * (1 + width))
    found = smallest_feasible(
        outside(first, (gap * first[1], 5000.0 + gap * first[1])), 1.0, 1e6, block=block
    )
    assert found == pytest.approx(left, rel=1e-12)


def test_a_feasible_start_is_the_answer() -> None:
    assert smallest_feasible(outside((0.5, 3.0)), 1.0, 10.0) == 1.0


@pytest.mark.parametrize("block", [1, 64])
def test_nothing_feasible_gives_nothing(block: int) -> None:
    assert smallest_feasible(lambda x: 0.1 + (x - 3) ** 2, 1.0, 10.0, block=block) is None
    assert smallest_feasible(lambda x: np.full_like(x, np.inf), 1.0, 10.0, block=block) is None
    assert smallest_feasible(outside((20.0, 30.0)), 1.0, 10.0, block=block) is None


@pytest.mark.parametrize("block", [1, 64])
def test_infinite_stretches_do_not_hide_what_follows(block: int) -> None:
    def excess(x: np.ndarray) -> np.ndarray:
        return np.where((x > 2) & (x < 4), np.inf, 7.0 - x)

    assert smallest_feasible(excess, 1.0, 100.0, block=block) == pytest.approx(7.0, rel=1e-12)


@pytest.mark.parametrize("block", [1, 64])
def test_a_dip_that_stays_above_hides_none_behind_it(block: int) -> None:
    """A near miss at 3, a narrow interval at 20, and nothing else."""

    def excess(x: np.ndarray) -> np.ndarray:
        return np.minimum(0.05 + np.abs(np.log(x / 3.0)), outside((20.0, 20.0 * (1 + 1e-6)))(x))

    assert smallest_feasible(excess, 1.0, 100.0, block=block) == pytest.approx(20.0, rel=1e-12)


@pytest.mark.parametrize("edge", [1.7, 3.0, 9.99])
def test_what_is_found_is_feasible_itself(edge: float) -> None:
    """Not merely near: whoever asked for the least factor that keeps a limit uses it as it is."""
    found = smallest_feasible(lambda x: edge - x, 1.0, 10.0)
    assert found is not None
    assert edge <= found <= edge * (1 + 2e-13)


def test_an_excess_of_nothing_is_feasible() -> None:
    assert smallest_feasible(lambda x: np.maximum(2.0 - x, 0.0), 1.0, 10.0) == pytest.approx(2.0, rel=1e-12)


def test_the_first_of_several_valleys_counts() -> None:
    """0.9 + cos(a) with a = 2 pi ln x / ln 1.2 is not above 0 from arccos(-0.9) on, and again 1.2 times further."""
    found = smallest_feasible(lambda x: 0.9 + np.cos(2 * np.pi * np.log(x) / np.log(1.2)), 1.0, 10.0)
    assert found == pytest.approx(1.2 ** (np.arccos(-0.9) / (2 * np.pi)), rel=1e-9)


@pytest.mark.parametrize("bottoms", [(3.0, 7.0), (1.02, 2.0), (9.9,)])
def test_of_narrow_dips_the_first_one_counts_and_one_at_the_end_is_seen(bottoms: tuple[float, ...]) -> None:
    def excess(x: np.ndarray) -> np.ndarray:
        return np.min([np.abs(x - bottom) - 1e-4 for bottom in bottoms], axis=0)

    assert smallest_feasible(excess, 1.0, 10.0) == pytest.approx(bottoms[0] - 1e-4, rel=1e-9)
