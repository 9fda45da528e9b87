"""Windows of rows by themselves: their moves, jumps of derivatives against scipy, what explains a piece, roundings."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from recorded_rows import bare_robot, judged
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from trajcli.judge.intervals import Intervals, JoinedPairs, explained_by_law
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

ROWS, JOINTS = 7, 2


def window_of(seed: int, **changes: object) -> Intervals:
    """Return a window of cubic pieces through random rows of two joints."""
    rng = np.random.default_rng(seed)
    lengths = rng.uniform(0.005, 0.02, ROWS - 1)
    q, qd = rng.normal(size=(2, ROWS, JOINTS))
    off = [rng.uniform(1e-6, 1e-3, JOINTS) for _ in range(3)]
    fields = {
        "t": np.append(0.0, np.cumsum(lengths)),
        "lengths": lengths,
        "late": rng.uniform(0.0, 1e-4, ROWS - 1),
        "states": (q, qd, None),
        "rows": 10 + np.arange(ROWS),
        "moves": np.zeros(ROWS, dtype=np.int64),
        "interpolation": "cubic",
        "resolution": Resolution(0.0, *off, relative=(1e-5,) * 3),
        "first": 0,
        "last": ROWS - 1,
        "ends": True,
    }
    return Intervals(**(fields | changes))


@pytest.mark.parametrize("seed", range(12))
def test_each_interval_is_of_the_moves_of_its_rows_and_in_one_run(seed: int) -> None:
    rng = np.random.default_rng(seed)
    moves = np.sort(rng.integers(0, 3, ROWS)) if seed % 3 else np.repeat([0, 1], [ROWS - 1, 1])
    first, last = (0, ROWS - 1) if seed % 2 else (1, ROWS - 2)
    runs = list(window_of(seed, moves=moves, first=first, last=last).runs())
    found = [(*pair, piece) for pair, low, high in runs for piece in range(low, high)]
    assert found == [(moves[piece], moves[piece + 1], piece) for piece in range(first, last)]
    assert all(one[0] != other[0] for one, other in pairwise(runs))


@pytest.mark.parametrize("seed", range(8))
def test_each_pair_of_rows_is_of_its_moves_and_in_one_run(seed: int) -> None:
    rng = np.random.default_rng(seed)
    before = np.sort(rng.integers(0, 2, ROWS - 1))
    after = before if seed % 2 else np.sort(rng.integers(0, 3, ROWS - 1))
    window, nothing = window_of(seed), np.zeros((1, 2, ROWS - 1, JOINTS))
    fields = {name: getattr(window, name) for name in window.__dataclass_fields__} | {"moves": before}
    pairs = JoinedPairs(**fields, stated=nothing, moves_after=after, begun=window.t[:-1])
    runs = list(pairs.runs())
    found = [(*pair, piece) for pair, low, high in runs for piece in range(low, high)]
    assert found == [(before[piece], after[piece], piece) for piece in range(ROWS - 1)]


@pytest.mark.parametrize("seed", range(3))
def test_jumps_are_those_at_the_two_nearest_rows_on_either_side(seed: int) -> None:
    """At the first and the last row a piece is compared with what the one beside it goes on with."""
    window = window_of(seed)
    q, qd, _ = window.states
    pieces = [
        CubicHermiteSpline(window.t[k : k + 2], q[k : k + 2], qd[k : k + 2], extrapolate=True)
        for k in range(ROWS - 1)
    ]
    for order, jumps in zip((2, 3), window.jumps, strict=True):
        beside = [(0, 1), *((k - 1, k) for k in range(1, ROWS - 1)), (ROWS - 3, ROWS - 2)]
        at_rows = np.array(
            [
                np.abs(
                    pieces[a].derivative(order)(window.t[row]) - pieces[b].derivative(order)(window.t[row])
                )
                for row, (a, b) in enumerate(beside)
            ]
        )
        for piece in range(ROWS - 1):
            near = at_rows[max(piece - 1, 0) : piece + 3]
            np.testing.assert_allclose(jumps[piece], near.max(axis=0), rtol=1e-9)


@pytest.mark.parametrize("orders", [2, 3])
def test_pairs_of_rows_are_joined_by_what_both_state(orders: int) -> None:
    """Their values and derivatives at both ends, and the rounding of each by joint: none but that of a double."""
    window, rng = window_of(6), np.random.default_rng(orders)
    stated, off = (
        rng.normal(size=(orders, 2, ROWS - 1, JOINTS)) * 10.0 ** rng.integers(-6, 6),
        np.array([1e-3, 0.0]),
    )
    fields = {name: getattr(window, name) for name in window.__dataclass_fields__}
    fields["resolution"] = Resolution(0.0, off, off, off)
    pairs = JoinedPairs(**fields, stated=stated, moves_after=window.moves[:-1], begun=window.t[:-1])
    for piece in range(ROWS - 1):
        for joint in range(JOINTS):
            curve = np.poly1d(pairs.coefficients[:, piece, joint])
            size = np.abs(stated[:, :, piece, joint]).max()
            for order in range(orders):
                ends = (
                    [curve.deriv(order)(at) for at in (0.0, window.lengths[piece])]
                    if order
                    else [curve(at) for at in (0.0, window.lengths[piece])]
                )
                np.testing.assert_allclose(ends, stated[order, :, piece, joint], rtol=1e-6, atol=1e-9 * size)
    for joint in range(JOINTS):
        rows = pairs.piece_rows(np.arange(ROWS - 1), np.full(ROWS - 1, joint), orders)
        np.testing.assert_array_equal((rows.length, rows.late), (window.lengths, window.late))
        np.testing.assert_array_equal(rows.ends, stated[..., joint])
        largest = np.abs(stated[..., joint]).max(axis=1)
        np.testing.assert_allclose(rows.errors, off[joint] + 4.0 * np.spacing(largest), rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_jumps_beside_two_pieces_are_those_at_their_three_rows(seed: int) -> None:
    window = window_of(seed)
    q, qd, _ = window.states
    short = replace(window, t=window.t[:3], lengths=window.lengths[:2], states=(q[:3], qd[:3], None))
    one, other = (
        CubicHermiteSpline(window.t[k : k + 2], q[k : k + 2], qd[k : k + 2], extrapolate=True) for k in (0, 1)
    )
    for order, jumps in zip((2, 3), short.jumps, strict=True):
        at_rows = np.abs(one.derivative(order)(short.t) - other.derivative(order)(short.t))
        np.testing.assert_allclose(jumps, [at_rows.max(axis=0)] * 2, rtol=1e-9)


@pytest.mark.parametrize(("share", "verdict"), [(0.99, "exceeded"), (1.01, "satisfied")])
def test_the_jerk_of_a_spline_through_positions_is_judged(share: float, verdict: str) -> None:
    """From rest to rest in a cubic: 12 d / T^3 all the time (Biagiotti and Melchiorri 2008, section 2.1.4)."""
    nothing = np.zeros(1)
    rows = RecordedMotion(
        *(np.array([0.0, 2.0]), np.array([[0.1], [0.4]]), None, None, None, None, None, None),
        Resolution(0.0, nothing, nothing, nothing),
        "rows",
    )
    limits = replace(unlimited(1), jerk=np.array([[-1.0, 1.0]]) * share * 12 * 0.3 / 2.0**3)
    required = Requirements(bare_robot(limits), interpolate="jtc-upsampling")
    assert judge_motion(lambda: [rows], required).verdict == verdict


@pytest.mark.parametrize("joint", range(JOINTS))
def test_the_rows_of_a_piece_have_the_larger_rounding_of_both_of_its_joint(joint: int) -> None:
    """Half a unit of its own column, and a share of the larger of both numbers."""
    window = window_of(4)
    rows = window.piece_rows(np.arange(ROWS - 1), np.full(ROWS - 1, joint), 2)
    np.testing.assert_array_equal(rows.length, window.lengths)
    np.testing.assert_array_equal(rows.late, window.late)
    for values, off, ends, errors in zip(
        window.states[:2], (window.resolution.q, window.resolution.qd), rows.ends, rows.errors, strict=True
    ):
        both = np.stack([values[:-1, joint], values[1:, joint]])
        np.testing.assert_array_equal(ends, both)
        np.testing.assert_allclose(errors, off[joint] + 1e-5 * np.abs(both).max(axis=0), rtol=1e-9)


@pytest.mark.parametrize(("changed", "at"), [(0.0, 0), (0.5, 0), (0.999, 0), (1.0, 1)])
def test_a_time_is_at_the_row_before_it_or_at_its_own(changed: float, at: int) -> None:
    window = window_of(5)
    fields = {name: getattr(window, name) for name in window.__dataclass_fields__}
    nothing, after = np.zeros((1, 2, ROWS - 1, JOINTS)), window.moves[:-1]
    pairs = JoinedPairs(**fields, stated=nothing, moves_after=after, begun=window.t[:-1])
    for each in (window, pairs):
        assert each.row_at(2, changed * window.lengths[2]) == 12 + at


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("last", "verdict"), [(1, "satisfied"), (0, "exceeded")])
def test_the_last_interval_of_a_file_may_be_between_two_moves(last: int, verdict: str, side: int) -> None:
    """The second move begins with the last row: between both the looser limits of the two are in force."""
    t = 0.01 * np.arange(9)
    q = side * np.append(np.zeros(8), 0.05)[:, None]  # 5 rad/s at last
    moves = np.append(np.zeros(8, dtype=np.int64), last)
    exact = np.zeros(1)
    rows = RecordedMotion(
        t, q, None, None, None, None, moves, None, Resolution(0.0, exact, exact, exact), "rows"
    )
    slow, fast = (
        bare_robot(replace(unlimited(1), velocity=np.array([[-limit, limit]]))) for limit in (1.0, 9.0)
    )
    required = Requirements(slow, by_move={0: slow, 1: fast}, interpolate="linear")
    assert judge_motion(lambda: [rows], required).verdict == verdict


@pytest.mark.parametrize("side", [1, -1])
def test_rounding_that_alternates_explains_what_a_spline_through_all_rows_makes_of_it(side: int) -> None:
    """Rows +e, -e, +e at a period h: the spline through them is at 3 e / h between them, no joint moves at all."""
    e, h = 0.5e-3, 0.01
    q = side * e * np.where(np.arange(40) % 2, 1.0, -1.0)[:, None]
    rows = RecordedMotion(
        h * np.arange(40),
        q,
        None,
        None,
        None,
        None,
        None,
        None,
        Resolution(0.0, *([np.array([e])] * 3)),
        "rows",
    )
    limits = replace(unlimited(1), velocity=np.array([[-0.5, 0.5]]) * e / h)
    assert judged(rows, limits, interpolate="jtc-upsampling").verdict == "within rounding"


@pytest.mark.parametrize("order", [0, 1])
def test_a_law_that_changes_once_between_dense_rows_is_explained(order: int) -> None:
    """The acceleration steps within a piece, at its worst place: scipy tells how far cubic pieces then miss the law.

    That much is explained: of the velocity no more than four times as much, of the position no more than twelve times.
    """
    h = 0.01
    t, within = h * np.arange(-4.0, 6.0), np.linspace(0.0, h, 101)
    misses = []
    for change in np.linspace(0.0, h, 41):
        past, later = (np.clip(times - change, 0.0, None) for times in (t, within))
        pieces = CubicHermiteSpline(t, 0.5 * past**2, past)
        true = later if order else 0.5 * later**2
        miss = float(np.abs(pieces(within, order) - true).max())
        states = (0.5 * past[:, None] ** 2, past[:, None], None)
        same = {
            "lengths": np.full(9, h),
            "late": np.zeros(9),
            "rows": np.arange(10),
            "moves": np.zeros(10, int),
        }
        window = window_of(0, t=t, states=states, last=9, **same)
        (explained,) = explained_by_law(window, np.array([4]), np.array([0]), order, 2)
        assert miss <= explained
        misses.append((miss, explained))
    worst, allowed = max(misses)
    assert allowed <= (4 if order else 12) * worst


def test_a_change_of_law_explains_nothing_between_rows_that_are_further_apart_than_a_controllers() -> None:
    """At 100 Hz and faster rows are taken one by one."""
    lengths = np.array([0.005, 0.01, 0.0101, 0.02, 0.05, 0.01])
    window = window_of(0, t=np.append(0.0, np.cumsum(lengths)), lengths=lengths)
    pieces = np.arange(lengths.size)
    explained = explained_by_law(window, pieces, np.zeros_like(pieces), 2, 2)
    assert np.isfinite(explained).tolist() == [True, True, False, False, False, True]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("count", [2, 3, 400])
@pytest.mark.parametrize("over", [0, 1, 2])
def test_of_rows_that_are_held_the_last_one_is_judged_too(over: int, count: int, side: int) -> None:
    """Nothing follows it. Of rows alike the first that is over the limit is named."""
    t, q = 0.004 * np.arange(count), np.zeros(count)
    over = min(over, count)
    q[count - over :] = side * 1.5
    exact = Resolution(0.0, *[np.zeros(1)] * 3)
    rows = RecordedMotion(t, q[:, None], None, None, None, None, None, None, exact, "rows")
    found = judged(rows, replace(unlimited(1), position=np.array([[-1.0, 1.0]])), interpolate="hold").findings
    assert [(each.kind, each.value, each.row) for each in found] == [
        ("position", side * 1.5, count - over + 1)
    ] * (over > 0)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("share", "verdict"), [(0.99, "exceeded"), (1.01, "satisfied")])
def test_a_spline_through_many_rows_is_that_of_all_of_them(order: int, share: float, verdict: str) -> None:
    """A joint gains speed over 300 rows and stops in the last interval: scipy knows the spline, and where it is worst."""
    t = 0.5 * np.arange(300.0)
    q = 0.01 * t**2 + 0.02 * np.sin(t)
    spline = CubicSpline(t, q, bc_type="clamped")
    times = np.linspace(t[0], t[-1], 299 * 64 + 1)
    sizes = np.abs(spline(times, order))
    assert times[sizes.argmax()] >= t[-3]
    rows = RecordedMotion(
        t, q[:, None], None, None, None, None, None, None, Resolution(0.0, *[np.zeros(1)] * 3), "rows"
    )
    bound = share * sizes.max() * np.array([[-1.0, 1.0]])
    limits = replace(unlimited(1), **{("velocity", "acceleration")[order - 1]: bound})
    assert judged(rows, limits, interpolate="jtc-upsampling").verdict == verdict


@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("seed", range(3))
def test_the_error_of_a_spline_bounds_what_rounding_makes_of_it_beside_short_pieces(
    seed: int, order: int
) -> None:
    """Two rows here and there stand a thousandth of the others apart: scipy knows the spline through the errors."""
    rng = np.random.default_rng(seed)
    lengths, e = np.where(rng.random(60) < 0.1, 1e-3, rng.uniform(0.5, 1.0, 60)), 1e-4
    t, q = np.append(0.0, np.cumsum(lengths)), e * rng.choice([-1.0, 1.0], 61)
    spline = CubicSpline(t, q, bc_type="clamped")
    same = {
        "lengths": lengths,
        "late": np.zeros(60),
        "rows": np.arange(61),
        "moves": np.zeros(61, int),
        "last": 60,
    }
    exact = Resolution(0.0, *[np.full(1, e)] * 3)
    window = window_of(
        0, t=t, states=(q[:, None], None, None), interpolation="jtc-upsampling", resolution=exact, **same
    )
    errors = window.piece_rows(np.arange(60), np.zeros(60, int), 1).error(order)
    for piece, error in enumerate(errors.tolist()):
        times = np.linspace(t[piece], t[piece + 1], 66)[1:-1]
        assert np.abs(spline(times, order)).max() <= error * (1 + 1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_two_rows_close_together_make_nothing_certain_of_a_spline_beside_them(side: int) -> None:
    """At 0.5 rad/s, rounded to 2 mrad; of two rows 1 ms apart that makes 2 rad/s."""
    t = np.array([0.0, 1.0, 1.001, 2.001, 3.001])
    q = side * (0.5 * t + 1e-3 * np.array([0.0, -1.0, 1.0, 0.0, 0.0]))
    exact = Resolution(0.0, np.full(1, 1e-3), np.zeros(1), np.zeros(1))
    rows = RecordedMotion(t, q[:, None], None, None, None, None, None, None, exact, "rows")
    limits = replace(unlimited(1), velocity=np.array([[-0.7, 0.7]]))
    assert judged(rows, limits, interpolate="jtc-upsampling").verdict == "within rounding"
    fast = replace(unlimited(1), velocity=np.array([[-0.4, 0.4]]))
    assert judged(rows, fast, interpolate="jtc-upsampling").verdict == "exceeded"
