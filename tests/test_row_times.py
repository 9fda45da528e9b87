"""Rows as near to each other, to a break or to the end as float64 can tell: they must still be told apart."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.grids import KnotGrid, ListedGrid, UniformGrid, onto_breaks
from trajcli.samples import sample
from trajcli.trajectory import Span, State, Trajectory

UNIX = 1.7e9  # s: now, since 1970


def finest_rate(duration: float, start: float) -> float:
    """Return the highest rate that is accepted, found by halving."""
    low, high = 1.0, 1e12
    while high > low * (1 + 1e-9):
        rate = (low * high) ** 0.5
        try:
            UniformGrid(duration, rate, start)
        except InputError:
            high = rate
        else:
            low = rate
    return low


@pytest.mark.parametrize("start", [UNIX, -UNIX, 2.0**31, 3.3e12])
@pytest.mark.parametrize("part", [1.0, 0.7, 0.51])
def test_rows_at_the_finest_rate_are_evenly_spaced(start, part):
    """Times are rounded to float64: of no two neighbours does that take or add a fifth of the period."""
    duration = 2000 * float(np.spacing(abs(start)))
    grid = UniformGrid(duration, finest_rate(duration, start) * part, start)
    times = np.concatenate([block[0] for block in grid.blocks()])
    assert times.size > 3
    gaps = np.diff(times)[:-1] * grid.rate
    assert gaps.min() >= 0.8
    assert gaps.max() <= 1.2


def test_a_rate_is_not_refused_where_times_are_fine():
    """Periods of 16 or 17 of what float64 resolves: 2 microseconds at 1e9 s, 8 ms at 2e12 s."""
    for start, period in ((2.0**30 * 0.9, 2e-6), (2.0**41, 16 * 2.0**-11)):
        times = np.concatenate([block[0] for block in UniformGrid(100 * period, 1 / period, start).blocks()])
        assert np.unique(times).size == 101


def test_neighbouring_rows_before_a_break_are_two():
    """Rows that rounding put just before a break are laid onto it: of a steady motion no two rows are the same."""
    duration = 2.0**33  # s, of which neighbours are 2e-6 s apart
    breaks = np.array([0.0, 1e-3, duration])
    curve = PiecewisePolynomial(breaks, np.array([[1.0, 1.0], [0.0, 1e-3]])[:, :, None])
    rest = State(np.zeros(1), np.ones(1), np.zeros(1))
    end = State(np.array([duration]), np.ones(1), np.zeros(1))
    spans = (Span(0, "quintic", 0.0, duration, 1),)
    trajectory = Trajectory(
        curve=curve, joint_names=("j1",), joint_types=("revolute",), spans=spans, start=rest, end=end
    )
    rate = finest_rate(duration, 0.0)
    (rows,) = islice(sample(trajectory, UniformGrid(duration, rate), ["t", "q"]), 1)
    assert (np.diff(rows, axis=0) > 0).all()


def test_an_end_that_float64_cannot_tell_from_a_grid_time_takes_its_place():
    start, unit = 2.0**30, 2.0**-22  # at 2^30 s float64 goes by 2^-22 s
    period = 16 * unit
    for beyond, rows in ((-0.4, 101), (0.0, 101), (0.4, 101), (1.5, 101), (4.0, 102)):
        grid = UniformGrid(100 * period + beyond * unit, 1 / period, start)
        times = np.concatenate([block[0] for block in grid.blocks()])
        assert np.unique(times).size == times.size == rows


@pytest.mark.parametrize("rate", [1.0, 1e-3, 1e-7, 1e-12])
def test_a_motion_has_its_start_and_its_end_however_low_the_rate_is(rate: float) -> None:
    (times,) = [block[1] for block in UniformGrid(0.8, rate, 5.0).blocks()]
    assert times.tolist() == [0.0, 0.8]
    assert (UniformGrid(0.0, rate).count, UniformGrid(1e-10, rate).count) == (1, 1)


def stepping(duration: float, when: float) -> Trajectory:
    """Return a joint that rests, and from `when` on goes at 1 rad/s."""
    curve = PiecewisePolynomial([0.0, when, duration], np.array([[0.0, 1.0], [0.0, 0.0]])[:, :, None])
    still, going = State(*np.zeros((3, 1))), State(np.array([duration - when]), np.ones(1), np.zeros(1))
    spans = (Span(0, "quintic", 0.0, duration, 1),)
    return Trajectory(
        curve=curve, joint_names=("j1",), joint_types=("revolute",), spans=spans, start=still, end=going
    )


@pytest.mark.parametrize(
    ("duration", "when", "rounding"),
    [(2.0, 0.7, 1e-12), (1e6, 4e5, 4 * np.spacing(1e6))],
    ids=["short", "long"],
)
def test_a_row_that_rounding_put_before_a_break_is_at_it(duration, when, rounding):
    """A picosecond before, or a few units in the last place: the later piece speaks, and not for rows before."""
    times = when - rounding * np.array([5.0, 0.7, -1.0])
    for time, speed in zip(times, (0.0, 1.0, 1.0), strict=True):
        (rows,) = sample(stepping(duration, when), ListedGrid(duration, np.array([time])), ["qd"])
        assert rows.tolist() == [[speed]]


def test_an_end_just_behind_a_grid_time_takes_its_place_by_a_share_of_the_period():
    """A millionth of a period of 2 s are 2000 ns: an end 1 us behind a row is that row, one 3 us behind is its own."""
    for late, rows in ((1e-6, 6), (3e-6, 7), (-1e-6, 6)):
        grid = UniformGrid(10 + late, 0.5)
        ((times, local),) = grid.blocks()
        assert (grid.count, times.size) == (rows, rows)
        assert local[-1] == 10 + late


def test_no_row_of_given_times_or_of_knots_lies_behind_the_end():
    """0.1 + 0.2 - 0.1 is more than 0.2, and a knot in whole nanoseconds may be half of one behind."""
    listed = ListedGrid(0.2, np.array([0.1, 0.1 + 0.2]), 0.1)
    ((times, local),) = listed.blocks()
    assert times[-1] == 0.1 + 0.2
    assert (local[0], local[-1]) == (0.0, 0.2)
    at = np.array([0, 1])
    knots = KnotGrid(0.1234567886, np.array([0.0, 0.123456789]), at, np.zeros((3, 2, 1)), 5.0)
    ((times, local),) = knots.blocks()
    assert times.tolist() == [5.0, 5.0 + 0.123456789]
    assert local.tolist() == [0.0, 0.1234567886]


def test_states_of_knots_go_into_the_rows_and_orders_that_a_block_holds():
    """Knots are rows 1, 3 and 4 of six; of a block from row 2 on with velocity and acceleration these are 3 and 4."""
    states = np.arange(18.0).reshape(3, 3, 2) + 100
    grid = KnotGrid(1.0, np.linspace(0, 1, 6), np.array([1, 3, 4]), states)
    motion = np.zeros((3, 3, 2))
    grid.put_states(2, [1, 2, 3], motion)
    expected = np.zeros((3, 3, 2))
    for row, knot in ((1, 1), (2, 2)):
        expected[row, 0], expected[row, 1] = states[1, knot], states[2, knot]
    np.testing.assert_array_equal(motion, expected)


def test_the_start_stays_where_the_first_piece_is_shorter_than_rounding():
    breaks = np.array([0.0, 5e-13, 1.0])
    assert onto_breaks(np.array([0.0, 1e-13, 0.5, 1 - 5e-13]), breaks).tolist() == [0.0, 5e-13, 0.5, 1.0]
