from __future__ import annotations

import tracemalloc
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from trajcli.columns import columns_of
from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.errors import InputError
from trajcli.grids import KnotGrid, ListedGrid, UniformGrid
from trajcli.samples import sample
from trajcli.trajectory import Signal, SignalChange, Span, Trajectory, resting
from trajcli.units import Units

ALL = ("t", "q", "qd", "qdd", "qddd", "move")


def trajectory_of(curve, borders=None, types=None):
    """The trajectory along `curve` whose moves end at `borders`."""
    n = curve.dimension
    ends = [0.0, *(borders if borders is not None else [curve.end])]
    spans = tuple(Span(k, "quintic", low, high, 1) for k, (low, high) in enumerate(pairwise(ends)))
    state = resting(np.zeros(n))
    return Trajectory(
        curve, tuple(f"j{k}" for k in range(n)), types or ("revolute",) * n, spans, state, state
    )


def random_curve(seed, pieces=5, n=3, degree=5, length=1.0):
    rng = np.random.default_rng(seed)
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, pieces))]) * length
    return PiecewisePolynomial(breaks, rng.normal(size=(degree + 1, pieces, n)))


def rows_of(*arguments, **options):
    return np.concatenate(list(sample(*arguments, **options)))


def times_of(grid, size=7):
    return np.concatenate([times for times, _ in grid.blocks(size)])


@settings(max_examples=80, deadline=None)
@given(
    rate=st.sampled_from([1.0, 3.0, 30.0, 125.0, 500.0, 1000.0, 7.3]),
    whole=st.integers(0, 1500),
    part=st.one_of(st.floats(0, 1), st.sampled_from([0.0, 5e-7, -5e-7, 2e-6, -2e-6])),
    start=st.sampled_from([0.0, 0.1, -3.0, 100.0]),
)
def test_rows_stand_on_the_grid_and_the_last_at_the_end(rate, whole, part, start):
    period = Fraction(1) / Fraction(rate)
    duration = max(float((whole + Fraction(part)) * period), 0.0)
    grid = UniformGrid(duration, rate, start)
    local = np.concatenate([each for _, each in grid.blocks(64)])
    times = times_of(grid, 64)
    assert times.size == local.size == grid.count
    assert local[-1] == duration
    assert times[-1] == start + duration
    # Each other row is the float64 nearest to k / rate, by exact arithmetic.
    assert all(each == float(k * period) for k, each in enumerate(local[:-1]))
    np.testing.assert_array_equal(times, start + local)
    assert (np.diff(times) > 0).all()
    # No grid time before the end is left out, none too close to it is left in.
    before = [k for k in range(whole + 3) if k * period < Fraction(duration) - period / 10**6]
    sure = [
        k for k in before if Fraction(duration) - k * period > 2 * max(period / 10**6, Fraction(1, 10**9))
    ]
    assert len(sure) + 1 <= grid.count <= len(before) + 1


def test_an_end_near_a_grid_time_takes_its_place():
    for duration in (1.0, 1.0 + 9e-10, 1.0 - 9e-10):
        times = times_of(UniformGrid(duration, 1000.0))
        assert times.size == 1001
        assert times[-1] == duration
    assert times_of(UniformGrid(1.0 + 1.2e-9, 1000.0)).size == 1002
    assert times_of(UniformGrid(1.0 - 1.2e-9, 1000.0)).size == 1001


def test_neighbouring_rows_never_show_the_same_time():
    for rate in (1e3, 1e5, 1e7):
        shown = [f"{time:.9f}" for time in times_of(UniformGrid(200.4 / rate, rate))]
        assert len(set(shown)) == len(shown)
        near = [f"{time:.9f}" for time in times_of(UniformGrid(200 / rate + 4e-10, rate))]
        assert len(set(near)) == len(near)


def test_the_millionth_row_is_not_accumulated():
    *_, (_, local) = UniformGrid(1000.0, 1000.0).blocks(4096)
    assert local[-2] == 999.999


@pytest.mark.parametrize(
    ("rate", "start", "message"),
    [
        (0.0, 0.0, "rate is 0 Hz"),
        (-5.0, 0.0, "rate is -5"),
        (float("nan"), 0.0, "rate is nan"),
        (float("inf"), 0.0, "rate is inf"),
        (1e9, 0.0, "too high"),
        (1e7, 1e9, "too high"),
        (10.0, float("inf"), "start time"),
    ],
)
def test_impossible_grids_are_refused(rate, start, message):
    with pytest.raises(InputError, match=message):
        UniformGrid(1.0, rate, start)


def test_a_trajectory_of_no_length_has_one_row():
    trajectory = trajectory_of(constant([1.0, -2.0], 0.0))
    rows = rows_of(trajectory, UniformGrid(0.0, 1000.0, 5.0), ALL)
    np.testing.assert_array_equal(rows, [[5.0, 1, -2, 0, 0, 0, 0, 0, 0, 0]])


@pytest.mark.parametrize("pieces", [1, 5, 3000])
def test_rows_are_what_scipy_evaluates(pieces):
    curve = random_curve(1, pieces, length=5 / pieces)
    grid = UniformGrid(curve.duration, 1000.0)
    rows = rows_of(trajectory_of(curve), grid, ALL, size=100)
    assert rows.shape == (grid.count, 14)
    peer = PPoly(curve.coefficients, curve.breaks)
    times = rows[:, 0]
    for order in range(4):
        expected = peer(times, nu=order)
        np.testing.assert_allclose(rows[:, 1 + 3 * order : 4 + 3 * order], expected, rtol=1e-11, atol=1e-11)


def test_block_size_changes_no_byte_beyond_rounding():
    curve = random_curve(2)
    trajectory, grid = trajectory_of(curve), UniformGrid(curve.duration, 700.0)
    blocks = list(sample(trajectory, grid, ALL, size=97))
    assert [len(block) for block in blocks[:-1]] == [97] * (len(blocks) - 1)
    np.testing.assert_allclose(np.concatenate(blocks), rows_of(trajectory, grid, ALL), rtol=1e-12, atol=1e-12)


def test_columns_come_in_the_order_asked_for():
    curve = random_curve(3)
    trajectory, grid = trajectory_of(curve), UniformGrid(curve.duration, 50.0)
    everything = rows_of(trajectory, grid, ALL)
    names = [column.name for column in columns_of(ALL, trajectory.joint_types, Units())]
    for groups in (("qdd", "t", "q"), ("move",), ("t",), ("qddd", "move", "qd")):
        places = [
            names.index(name)
            for name in [column.name for column in columns_of(groups, trajectory.joint_types, Units())]
        ]
        np.testing.assert_allclose(
            rows_of(trajectory, grid, groups), everything[:, places], rtol=1e-12, atol=1e-12
        )


def test_units_are_those_of_the_joint():
    curve = random_curve(4)
    trajectory = trajectory_of(curve, types=("revolute", "prismatic", "revolute"))
    grid = UniformGrid(curve.duration, 100.0)
    si, user = (rows_of(trajectory, grid, ("t", "q", "qdd"), units) for units in (None, Units("deg", "mm")))
    np.testing.assert_array_equal(si[:, 0], user[:, 0])
    np.testing.assert_allclose(np.deg2rad(user[:, [1, 3, 4, 6]]), si[:, [1, 3, 4, 6]], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(user[:, [2, 5]] / 1000, si[:, [2, 5]], rtol=1e-12, atol=1e-13)


def stairs(breaks):
    """A curve whose acceleration counts its pieces from 1."""
    breaks = np.asarray(breaks)
    coefficients = np.zeros((3, breaks.size - 1, 1))
    coefficients[0, :, 0] = (np.arange(breaks.size - 1) + 1) / 2
    return PiecewisePolynomial(breaks, coefficients)


def test_at_a_break_the_later_piece_speaks_and_at_the_end_the_last():
    # 0.1 + 0.2 is one rounding above the row at 0.3: rounding must not decide.
    curve = stairs([0.0, 0.1, 0.1 + 0.2, 0.7 - 1e-14, 1.0])
    rows = rows_of(trajectory_of(curve, list(curve.breaks[1:])), UniformGrid(1.0, 10.0), ("qdd", "move"))
    np.testing.assert_array_equal(rows[:, 0], [1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4])
    np.testing.assert_array_equal(rows[:, 1], rows[:, 0] - 1)


def test_a_move_of_no_length_has_no_row_and_keeps_its_number():
    curve = stairs([0.0, 0.5, 1.0])
    rows = rows_of(trajectory_of(curve, [0.5, 0.5, 1.0, 1.0]), UniformGrid(1.0, 4.0), ("move",))
    np.testing.assert_array_equal(rows[:, 0], [0, 0, 2, 2, 2])


def test_moves_are_those_of_span_at():
    curve = random_curve(5)
    trajectory = trajectory_of(curve, list(curve.breaks[1:]))
    rows = rows_of(trajectory, UniformGrid(curve.duration, 333.0), ("t", "move"))
    assert [trajectory.span_at(time).index for time in rows[:, 0]] == rows[:, 1].tolist()


def test_listed_times_count_from_the_start_time():
    curve = random_curve(6)
    times = np.array([2.0, 2.25, 2.5, 2.0 + curve.duration + 5e-10])
    rows = rows_of(trajectory_of(curve), ListedGrid(curve.duration, times, 2.0), ("t", "q"))
    np.testing.assert_array_equal(rows[:3, 0], times[:3])
    assert rows[3, 0] == 2.0 + curve.duration
    expected = PPoly(curve.coefficients, curve.breaks)(np.array([0.0, 0.25, 0.5, curve.duration]))
    np.testing.assert_allclose(rows[:, 1:], expected, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([], "empty"),
        ([0.5, 3.1], "time 3.1 s lies outside"),
        ([-1e-8, 0.5], "time -1e-08 s lies outside"),
        ([float("nan")], "outside"),
        ([0.5, 0.5], "0.5 s is followed by 0.5 s"),
        ([0.5, 0.4], "0.5 s is followed by 0.4 s"),
        ([0.5, 0.5 + 5e-10], "is followed by"),
        ([-5e-10, 0.0], "0 s is followed by 0 s"),
    ],
)
def test_impossible_lists_of_times_are_refused(times, message):
    with pytest.raises(InputError, match=message) as caught:
        ListedGrid(3.0, np.array(times))
    if "outside" in message:
        assert caught.value.problems[0].hint == "it lasts from 0 s to 3 s"


def test_memory_does_not_grow_with_the_rows():
    trajectory = trajectory_of(random_curve(7, n=6))

    def peak(rate):
        grid = UniformGrid(trajectory.duration, rate)
        tracemalloc.start()
        for _ in sample(trajectory, grid, ALL):
            pass
        result = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return result

    few, many = (peak(count / trajectory.duration) for count in (2e4, 2e5))
    assert many < 1.1 * few + 1e5
    assert many < 10e6


def test_a_block_holds_only_its_own_pieces_whatever_their_number():
    pieces = 200_000
    trajectory = trajectory_of(random_curve(2, pieces, degree=3))  # 19 MB of coefficients
    grid = UniformGrid(trajectory.duration, 1.0)
    tracemalloc.start()
    first = next(sample(trajectory, grid, ("t", "q", "move"), size=64))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    curve = trajectory.curve
    expected = PPoly(curve.coefficients[:, :300], curve.breaks[:301])(first[:, 0])
    np.testing.assert_allclose(first[:, 1:4], expected, rtol=1e-9, atol=1e-12)
    assert peak < 4e6


@pytest.mark.parametrize("ramp", [1e-14, 9e-10, 2e-9])
def test_a_row_beside_a_ramp_too_short_for_stamps_has_the_acceleration_outside_of_it(ramp):
    """Between two ramps 2 s with qdd = 0.6 u - 0.6, written by hand: -0.6 at its beginning, 0.6 at its end."""
    table = [[0.0, 0.1, 0.0], [0.5 / ramp, -0.3, -0.5 / ramp], [0.0, 1.0, 1.0], [0.0, 0.0, 1.6]]
    curve = PiecewisePolynomial([0.0, ramp, 2.0 + ramp, 2.0 + 2 * ramp], np.array(table)[:, :, None])
    rows = rows_of(trajectory_of(curve), UniformGrid(curve.end, 1.0), ("qdd", "qddd"), size=2)
    told = ramp > 1e-9
    expected = [1 / ramp if told else -0.6, 0.0, -1 / ramp if told else 0.6]
    np.testing.assert_allclose(rows[[0, 1, -1], 0], expected, rtol=1e-6, atol=1e-6)
    assert abs(rows[[0, -1], 1] - (0.0 if told else 0.6)).max() < 1e-6
    speeds = rows_of(trajectory_of(curve), UniformGrid(curve.end, 1.0), ("qd",), size=2)[[0, -1], 0]
    np.testing.assert_allclose(speeds, 0.0, atol=0.05)  # before the first ramp and behind the last one


@pytest.mark.parametrize("off", [2e-10, 5e-10, 9e-10, 1.5e-9])
def test_rows_before_a_break_do_not_know_of_short_pieces_elsewhere(off):
    """The acceleration steps from 1 to 3 just behind the row at 0.5 s; a piece of 0.3 ns stands at 0.2 s."""
    lengths = np.array([0.2, 3e-10, 0.3 - 3e-10 + off, 0.5 - off])
    coefficients = np.zeros((3, 4, 1))
    coefficients[0] = [[0.5], [1e9], [0.5], [1.5]]
    whole = trajectory_of(PiecewisePolynomial(np.append(0.0, np.cumsum(lengths)), coefficients))
    grid = UniformGrid(1.0, 10.0)
    for size in (1, 2, 3, 100):
        rows = np.concatenate([*sample(whole, grid, ("t", "qdd"), size=size)])
        assert rows[:, 1] == pytest.approx([1.0] * 6 + [3.0] * 5)


@pytest.mark.parametrize("seed", range(6))
def test_rows_do_not_depend_on_the_size_of_blocks(seed):
    """Of pieces of less than a nanosecond, at rows and within a nanosecond of rows, and of others."""
    rng = np.random.default_rng(seed)
    lengths = rng.choice([0.1, 0.05, 4e-10, 0.1 + 4e-10, 0.1 - 7e-10, 0.03], 30)
    curve = PiecewisePolynomial(np.append(0.0, np.cumsum(lengths)), rng.normal(size=(4, 30, 2)))
    grid = UniformGrid(curve.end, 20.0)
    found = [
        np.concatenate([*sample(trajectory_of(curve), grid, ALL, size=size)]) for size in (1, 2, 5, 4096)
    ]
    assert all(np.array_equal(rows, found[-1]) for rows in found)


def test_knots_stand_in_the_units_of_each_joint_block_by_block():
    """States of knots are in SI; they replace what the curve says there, in every block."""
    curve = random_curve(3, pieces=4, n=2)
    trajectory = trajectory_of(curve, types=("revolute", "prismatic"))
    local = np.linspace(0, curve.end, 9)
    at = np.array([0, 3, 4, 8])
    states = np.random.default_rng(1).normal(size=(3, 4, 2))
    grid = KnotGrid(curve.end, local, at, states)
    factors = np.array([np.pi / 180, 1e-3])
    rows = rows_of(trajectory, grid, ("q", "qd", "qdd"), Units("deg", "mm"), size=2).reshape(9, 3, 2)
    expected = np.stack([curve.evaluate(local, order) for order in range(3)], axis=1)
    expected[at] = states.transpose(1, 0, 2)
    np.testing.assert_allclose(rows, expected / factors, rtol=1e-9, atol=1e-9)


def test_numbers_of_moves_zones_and_paths_at_borders_that_rounding_has_missed():
    """Half a picosecond before a border is at it; entries of the job that move nothing leave gaps in the numbers."""
    curve = random_curve(4, pieces=2, n=1)
    border = float(curve.breaks[1])
    law = PiecewisePolynomial(np.array([0.0, curve.end - border]), np.array([[[2.0]], [[0.0]]]))
    spans = (Span(0, "quintic", 0.0, border, 1), Span(2, "line", border, curve.end, 1))
    trajectory = replace(
        trajectory_of(curve),
        spans=spans,
        laws=(None, law),
        zones=((0.2 * border, 0.5 * border), (border, 1.1 * border)),
    )
    times = np.array(
        [0.0, 0.2 * border - 5e-13, 0.3 * border, 0.5 * border - 5e-13, border - 5e-13, curve.end]
    )
    for size in (1, 9):
        rows = rows_of(trajectory, ListedGrid(curve.end, times), ("move", "zone", "path"), size=size)
        assert rows[:, 0].tolist() == [0, 0, 0, 0, 2, 2]
        assert rows[:, 1].tolist() == [0, 1, 1, 0, 2, 0]
        s = np.maximum(times - border, 0.0)
        np.testing.assert_allclose(rows[:, 2], np.where(rows[:, 0] == 2, 2 * s, 0), atol=1e-12)
        np.testing.assert_allclose(rows[:, 3], np.where(rows[:, 0] == 2, 2, 0), atol=1e-12)
        in_mm = rows_of(trajectory, ListedGrid(curve.end, times), ("path",), Units("deg", "mm"), size=size)
        np.testing.assert_allclose(in_mm, 1000 * rows[:, 2:], rtol=1e-12, atol=1e-12)


def test_signals_and_laws_count_from_the_start_whatever_the_time_of_the_first_row():
    """The law turns at 0.3 s of the second move, half a picosecond behind a row; where it ends its end counts."""
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 1)))
    law = PiecewisePolynomial(np.array([0.0, 0.3, 0.5 - 1e-12]), np.array([[[1.0], [3.0]], [[0.0], [0.3]]]))
    spans = (Span(0, "hold", 0.0, 0.5, 1), Span(1, "line", 0.5, 1.0, 1))
    signal = Signal("grip", (SignalChange(0.25, 1.0, 0), SignalChange(0.8, 0.5, 1)))
    trajectory = replace(trajectory_of(curve), spans=spans, laws=(None, law), signals=(signal,))
    local = np.array([0.0, 0.25 - 5e-13, 0.5, 0.8 - 5e-13, 1.0])
    rows = rows_of(trajectory, ListedGrid(1.0, 100 + local, 100.0), ("signals", "path"))
    assert rows[:, 0].tolist() == [0, 1, 1, 0.5, 0.5]
    np.testing.assert_allclose(rows[:, 1], [0, 0, 0, 0.3, 0.9], atol=1e-9)
    assert rows[:, 2].tolist() == [0, 0, 1, 3, 3]
