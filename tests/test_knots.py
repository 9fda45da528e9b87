"""Knots: what the interpolation of ros2_control's joint_trajectory_controller makes of them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from tiers import few

from trajcli.curves.piecewise import Array, PiecewisePolynomial, constant
from trajcli.errors import InputError
from trajcli.job.read import job_from_text, load_job
from trajcli.knots import LARGEST_DEVIATION, Knots, knot_grid, knots_at, knots_of
from trajcli.output.report import report_of
from trajcli.planning.plan import plan_job
from trajcli.trajectory import Span, State, Trajectory, resting

EXAMPLES = Path(__file__).parent.parent / "examples"
SMOOTH = ["quintic", "slow", "scorbot_draw", "cycloidal", "stop"]
ROUGH = ["trapezoid", "septic", "sync", "units", "blends_ur5e", "time_optimal", "dispense", "cubic", "gantry"]


def played(knots: Knots, t: np.ndarray) -> np.ndarray:
    """Return (3, N, n) of the controller's quintic segments, written from trajectory.cpp of ros2_controllers."""
    times = knots.nanoseconds / 1e9
    k = np.clip(np.searchsorted(times, t, "right") - 1, 0, times.size - 2)
    T, u = (times[k + 1] - times[k])[:, None], (t - times[k])[:, None]
    p0, v0, a0 = knots.position[k], knots.velocity[k], knots.acceleration[k]
    p1, v1, a1 = knots.position[k + 1], knots.velocity[k + 1], knots.acceleration[k + 1]
    c3 = (20 * (p1 - p0) - 3 * a0 * T**2 + a1 * T**2 - 12 * v0 * T - 8 * v1 * T) / (2 * T**3)
    c4 = (30 * (p0 - p1) + 3 * a0 * T**2 - 2 * a1 * T**2 + 16 * v0 * T + 14 * v1 * T) / (2 * T**4)
    c5 = (12 * (p1 - p0) - a0 * T**2 + a1 * T**2 - 6 * v0 * T - 6 * v1 * T) / (2 * T**5)
    c = [p0, v0, a0 / 2, c3, c4, c5]
    position = sum(c[i] * u**i for i in range(6))
    velocity = sum(i * c[i] * u ** (i - 1) for i in range(1, 6))
    acceleration = sum(i * (i - 1) * c[i] * u ** (i - 2) for i in range(2, 6))
    return np.array([position, velocity, acceleration])


def largest_differences(trajectory: Trajectory, knots: Knots) -> np.ndarray:
    """Return the largest difference of order 0 to 2 on times between and beside all breaks and knots."""
    curve = trajectory.curve
    marks = np.unique(np.concatenate([curve.breaks, knots.nanoseconds / 1e9]))
    marks = marks[marks <= curve.end]
    within = marks[:-1, None] + np.diff(marks)[:, None] * np.linspace(0, 1, 41)
    t = np.minimum(within.reshape(-1), min(curve.end, knots.nanoseconds[-1] / 1e9))
    t = t[t >= 0]
    wanted = curve.evaluate_orders(t, (0, 1, 2)).transpose(1, 0, 2)
    return np.abs(played(knots, t) - wanted).max(axis=(1, 2))


def trajectory_of(name: str) -> Trajectory:
    return plan_job(load_job(str(EXAMPLES / f"{name}.yaml"))).trajectory


def trajectory_of_job(move: dict, **limits: float) -> Trajectory:
    names = ("velocity", "acceleration", "jerk")
    bounds = {name: limits[name] for name in names if name in limits}
    joints = [{"name": f"j{k}", "type": "revolute", **bounds} for k in range(3)]
    job = {"version": 1, "robot": {"joints": joints}, "start": {"joints": [0, 0.1, -0.2]}, "moves": [move]}
    return plan_job(job_from_text(json.dumps(job))).trajectory


@pytest.mark.parametrize("name", few(SMOOTH, 3))
def test_quintics_of_continuity_two_are_reproduced(name: str) -> None:
    trajectory = trajectory_of(name)
    knots = knots_of(trajectory)
    assert (largest_differences(trajectory, knots) <= [1e-9, 1e-8, 1e-6]).all()
    assert knots.deviation.position <= 1e-9
    assert knots.deviation.velocity <= 1e-8
    assert (knots.velocity[-1] == 0.0).all()


@pytest.mark.parametrize("seed", range(8))
def test_jerk_limited_motion_at_odd_times_is_reproduced(seed: int) -> None:
    rng = np.random.default_rng(seed)
    target = rng.uniform(-2, 2, 3).tolist()
    trajectory = trajectory_of_job(
        {"planner": "jerk_limited", "to": {"joints": target}}, velocity=1.3, acceleration=3.7, jerk=41.0
    )
    knots = knots_of(trajectory)
    assert (largest_differences(trajectory, knots) <= [1e-9, 1e-8, 1e-6]).all()


@pytest.mark.full
@pytest.mark.parametrize("name", few(ROUGH + SMOOTH))
def test_every_trajectory_is_reproduced_within_the_stated_deviation(name: str) -> None:
    trajectory = trajectory_of(name)
    knots = knots_of(trajectory)
    position, velocity, _ = largest_differences(trajectory, knots)
    assert position <= knots.deviation.position + 1e-13
    assert velocity <= knots.deviation.velocity * (1 + 1e-9) + 1e-9
    assert knots.deviation.position <= LARGEST_DEVIATION == 1e-6
    if name != "sync":  # its velocity is there within 1e-14 s
        assert position >= 0.9 * knots.deviation.position - 1e-13  # nothing is claimed to be worse than it is


@pytest.mark.full
@pytest.mark.parametrize("name", few(ROUGH + SMOOTH))
def test_a_controller_takes_the_times_and_the_end(name: str) -> None:
    trajectory = trajectory_of(name)
    knots = knots_of(trajectory)
    whole = knots.nanoseconds
    assert whole.dtype == np.int64
    assert whole[0] == 0
    assert (np.diff(whole) >= 1000).all()
    assert -1e-3 <= whole[-1] - trajectory.duration * 1e9 <= 1.001  # rounded up, but for a break beside it
    assert (knots.velocity[-1] == 0.0).all()
    shape = (whole.size, trajectory.curve.dimension)
    assert knots.position.shape == knots.velocity.shape == knots.acceleration.shape == shape


@pytest.mark.parametrize("name", few(SMOOTH, 3))
def test_knots_are_states_at_their_whole_nanoseconds(name: str) -> None:
    trajectory = trajectory_of(name)
    knots = knots_of(trajectory)
    t = np.minimum(knots.nanoseconds / 1e9, trajectory.curve.end)
    for order, values in enumerate((knots.position, knots.velocity)):
        scale = 1 + np.abs(values).max()
        assert (
            np.abs(values - trajectory.curve.evaluate(t, order)).max() <= 1e-11 * scale
        )  # a break within 1e-12 s counts


def made_of(curve: PiecewisePolynomial, end: State) -> Trajectory:
    n = curve.dimension
    names = tuple(f"j{k}" for k in range(n))
    span = Span(0, "quintic", 0.0, curve.end, 1)
    start = resting(np.zeros(n))
    return Trajectory(curve, names, ("revolute",) * n, (span,), start, end)


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("times", [(0.0, 0.8, 0.9, 1.0), (0.0, 0.1, 0.9, 1.0), (0.0, 0.1, 0.2, 1.0)])
def test_the_deviation_is_that_of_the_worst_interval_and_joint(times, sign: int, joint: int) -> None:
    """Of t^6 a quintic with the states of both ends of a length h misses (h/2)^6 at most, in the middle (Hermite).

    Its error is t^3 (h - t)^3, of which the derivative reaches 96 / sqrt(5)^5 (h/2)^5.
    """
    coefficients = np.zeros((7, 1, 3))
    coefficients[0, 0] = 0.1
    coefficients[0, 0, joint] = sign * 2.0
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    end = State(*(curve.evaluate(1.0, order) for order in range(3)))
    found = knots_at(made_of(curve, end), np.array(times)).deviation
    half = np.diff(times).max() / 2
    assert found.position == pytest.approx(2 * half**6, rel=1e-6)
    assert found.velocity == pytest.approx(2 * 96 / 5**2.5 * half**5, rel=1e-6)
    assert found.joints == (joint,) * 2


@pytest.mark.parametrize("sign", [1, -1])
def test_the_deviation_is_found_where_nobody_looks_first(sign: int) -> None:
    """Of t^7 a quintic misses t^3 (t - 1)^3 (t + 3): each derivative is largest at a root of the next one."""
    coefficients = np.zeros((8, 1, 1))
    coefficients[0] = sign
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    end = State(*(curve.evaluate(1.0, order) for order in range(3)))
    found = knots_at(made_of(curve, end), np.array([0.0, 1.0])).deviation
    missed = np.poly1d([1, 0, 0, 0]) * np.poly1d([1, -1]) ** 3 * np.poly1d([1, 3])
    for order, value in enumerate((found.position, found.velocity)):
        of_order = missed.deriv(order) if order else missed
        at = [root.real for root in of_order.deriv().roots if abs(root.imag) < 1e-3 and 0 <= root.real <= 1]
        assert value == pytest.approx(max(abs(of_order(t)) for t in [*at, 0.0, 1.0]), rel=1e-6)


def touching(seed: int, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Return polynomials u^3 (1 - u)^3 r(u) (13, pieces, 3) for u in [0, 1], and their extents, (2, pieces, 3).

    A quintic with the states at their ends is zero. The extents are those of value and derivative, at numpy's roots.
    """
    rng, bump = np.random.default_rng(seed), np.poly1d([-1, 3, -3, 1, 0, 0, 0])
    coefficients, extents = np.zeros((13, pieces, 3)), np.zeros((2, pieces, 3))
    for piece, joint in np.ndindex(pieces, 3):
        curve = bump * np.poly1d(rng.uniform(-1, 1, 7))
        for order in (0, 1):
            roots = curve.deriv(order + 1).roots
            at = np.clip(roots.real[np.abs(roots.imag) < 1e-7], 0, 1)
            extents[order, piece, joint] = np.abs((curve.deriv(order) if order else curve)(at)).max()
        coefficients[:, piece, joint] = curve.coeffs
    return coefficients, extents


@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("seed", few(range(30), 2))
def test_the_deviation_is_found_among_many_that_are_hardly_smaller(seed: int, order: int) -> None:
    """Of 40 pieces of three joints all miss 1e-8 to 1e-6 less than one of them does."""
    coefficients, extents = touching(seed, 40)
    less = 10.0 ** np.random.default_rng(seed).uniform(-8, -6, extents[order].shape)
    piece, joint = 7 + seed, seed % 3
    less[piece, joint] = 0.0
    coefficients *= (-1) ** seed * (1 - less) / extents[order]
    curve = PiecewisePolynomial(np.arange(41.0), coefficients)
    found = knots_at(made_of(curve, resting(np.zeros(3))), np.arange(41.0)).deviation
    assert (found.position, found.velocity)[order] == pytest.approx(1.0, rel=1e-10)
    assert found.joints[order] == joint
    other = ((1 - less) * extents[1 - order] / extents[order]).max()
    assert (found.position, found.velocity)[1 - order] == pytest.approx(other, rel=1e-10)


def test_control_points_far_away_hide_no_deviation() -> None:
    """Those of u^3 (1 - u)^3 T(u) are far beyond it where T is a polynomial of Chebyshev that swings between +-1."""
    swinging = np.poly1d(np.polynomial.chebyshev.cheb2poly([0] * 6 + [1])[::-1])(np.poly1d([2, -1]))
    bump = np.poly1d([-1, 3, -3, 1, 0, 0, 0])
    coefficients = np.zeros((13, 2, 1))
    coefficients[:, 0, 0], coefficients[6:, 1, 0] = (bump * swinging).coeffs, 1.1 * bump.coeffs
    curve = PiecewisePolynomial(np.arange(3.0), coefficients)
    found = knots_at(made_of(curve, resting(np.zeros(1))), np.arange(3.0)).deviation
    assert found.position == pytest.approx(1.1 / 64, rel=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_only_the_interval_that_misses_too_much_is_divided(sign: int) -> None:
    """Of 5000 pieces of 1 ms three are bumps: half of one of 1.05 um misses 2^6 times less, a third of one of 70 3^6."""
    coefficients = np.zeros((7, 5000, 2))
    for piece, sizes in ((4500, (70.0, 1.05)), (4600, (0.0, 1.05)), (4700, (0.0, 0.95))):
        bump = sign * np.array([-1, 3, -3, 1, 0, 0, 0]) * 64e-6 / 1e-3 ** np.arange(6, -1, -1)
        coefficients[:, piece] = bump[:, None] * sizes
    curve = PiecewisePolynomial(np.arange(5001) / 1000, coefficients)
    whole = knots_of(made_of(curve, resting(np.zeros(2)))).nanoseconds
    wanted = [4_500_333_333, 4_500_666_666, 4_600_500_000]
    assert np.setdiff1d(whole, np.arange(5001) * 1_000_000).tolist() == wanted


def test_around_a_step_of_the_acceleration_quintics_stay_within_both_sides() -> None:
    """From 4 to 0 and from 0 to -4 rad/s^2, 1 rad/s between: no 21st part beyond them, and 20 nm beside the curve."""
    move = {"planner": "trapezoid", "to": {"joints": [1, 0.1, -0.2]}, "velocity": 1.0, "acceleration": 4.0}
    trajectory = trajectory_of_job(move, velocity=9, acceleration=90)
    knots = knots_of(trajectory)
    t = np.concatenate([time + np.linspace(-1e-3, 1e-3, 20_001) for time in (0.25, 1.0)])
    position, _, acceleration = played(knots, t)
    assert -4 * (1 + 1e-3) <= acceleration.min() <= -4 * (1 - 1e-3)
    assert 4 * (1 - 1e-3) <= acceleration.max() <= 4 * (1 + 1e-3)
    cruising = (t > 0.25 + 3e-4) & (t < 1.0 - 3e-4)
    assert np.abs(acceleration[cruising]).max() <= 4e-3
    assert np.abs(position - trajectory(t)).max() <= knots.deviation.position * (1 + 1e-6) <= 2.1e-8


@pytest.mark.parametrize("period", [0.25, 0.2499, 0.2501, 0.2502])
def test_rows_of_a_rate_beside_a_step_are_on_the_quintics_between_its_knots(period: float) -> None:
    """From 4 to 0 rad/s^2 at 0.25 s, within 0.2 ms about it: rows there and behind make no 21st part beyond."""
    move = {"planner": "trapezoid", "to": {"joints": [1, 0.1, -0.2]}, "velocity": 1.0, "acceleration": 4.0}
    trajectory = trajectory_of_job(move, velocity=9, acceleration=90)
    knots = knots_of(trajectory)
    grid = knot_grid(trajectory, knots, 1 / period)
    motion = np.stack([trajectory(grid.local, order) for order in range(3)], axis=1)
    grid.put_states(0, (0, 1, 2), motion)
    rows = replace(
        knots,
        nanoseconds=np.rint(grid.local * 1e9).astype(np.int64),
        position=motion[:, 0],
        velocity=motion[:, 1],
        acceleration=motion[:, 2],
    )
    t = 0.25 + np.linspace(-1e-3, 1e-3, 20_001)
    assert np.abs(played(rows, t) - played(knots, t)).max(axis=(1, 2)) == pytest.approx(0, abs=4e-3)
    assert period == 0.25 or period in rows.times.round(9)


@pytest.mark.parametrize("rate", [100.0, 999.9, 1000 / 7])
def test_rows_at_a_rate_and_at_knots_are_a_microsecond_apart(rate: float) -> None:
    """Each time of the rate has a row, or a knot within a microsecond; each knot has its row."""
    trajectory = trajectory_of("trapezoid")
    knots = knots_of(trajectory)
    rows = np.concatenate([local for _, local in knot_grid(trajectory, knots, rate).blocks()])
    assert np.diff(rows).min() >= 1e-6 * (1 - 1e-6)
    wanted = np.arange(int(trajectory.duration * rate) + 1) / rate
    assert _apart(wanted, rows).max() <= 1e-6
    assert _apart(knots.times, rows).max() == 0.0


def _apart(times: Array, rows: Array) -> Array:
    """Return how far times are from the nearest of rows that rise."""
    behind = np.clip(np.searchsorted(rows, times), 1, rows.size - 1)
    return np.minimum(np.abs(times - rows[behind - 1]), np.abs(times - rows[behind]))


def test_the_deviation_of_many_knots_is_that_of_the_last_interval() -> None:
    coefficients = np.zeros((7, 1, 1))
    coefficients[0] = 1.0
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    end = State(*(curve.evaluate(1.0, order) for order in range(3)))
    times = np.append(np.linspace(0.0, 0.8, 17_000), 1.0)
    assert knots_at(made_of(curve, end), times).deviation.position == pytest.approx(0.1**6, rel=1e-6)


def test_a_trajectory_of_no_length_is_one_knot() -> None:
    knots = knots_of(made_of(constant([0.3, 0.4], 0.0), resting(np.array([0.3, 0.4]))))
    assert knots.nanoseconds.tolist() == [0]
    assert knots.position.tolist() == [[0.3, 0.4]]
    assert knots.deviation.position == 0.0


def test_breaks_within_a_microsecond_are_one_knot() -> None:
    # acceleration 1 up to t = 1, within 0.3 us to -1, and down to rest at about t = 2
    breaks = np.array([0.0, 1.0, 1.0 + 1e-7, 1.0 + 3e-7, 2.0])
    pieces, q, v = [], 0.0, 0.0
    for length, a in zip(np.diff(breaks), [1.0, 0.5, -0.5, -1.0], strict=True):
        pieces.append([a / 2, v, q])
        q, v = q + v * length + a * length**2 / 2, v + a * length
    curve = PiecewisePolynomial(breaks, np.array(pieces).T[:, :, None])
    knots = knots_of(made_of(curve, resting(np.array([q]))))
    assert (np.diff(knots.nanoseconds) >= 1000).all()
    at = np.searchsorted(knots.nanoseconds, 1_000_000_000)
    assert (knots.nanoseconds[at - 1 : at + 1] - 1_000_000_000).tolist() == [-200_000, 200_000]
    assert knots.acceleration[at - 1 : at + 1, 0].tolist() == [1.0, -1.0]
    assert knots.deviation.position <= 1e-7  # 0.3 us of an acceleration of 2 rad/s^2, for a second


def rising(breaks: list[float], highest: list[float], degree: int) -> PiecewisePolynomial:
    """Return the smooth curve from rest at zero whose highest derivative is constant on each piece."""
    state, pieces = np.zeros(degree), []
    for length, value in zip(np.diff(breaks), highest, strict=True):
        taylor = np.poly1d(np.append(value, state) / [math.factorial(k) for k in range(degree, -1, -1)])
        pieces.append(
            taylor.coeffs if taylor.order == degree else np.append(np.zeros(degree - taylor.order), taylor)
        )
        state = np.array(
            [taylor.deriv(k)(length) if k else taylor(length) for k in range(degree - 1, -1, -1)]
        )
    return PiecewisePolynomial(np.array(breaks), np.array(pieces).T[:, :, None])


def ending(curve: PiecewisePolynomial) -> State:
    return State(*(curve.evaluate(curve.end, order) for order in range(3)))


@pytest.mark.parametrize(
    ("breaks", "jerks"),
    [
        ([0.0, 0.0100000004, 10.0], [20.0, 0.0]),
        ([0.0, 9.9899999996, 10.1], [0.05, -6.0]),
        ([0.0, 0.3, 0.3000087, 1.2], [2.0, 0.0, -2.0]),
    ],
)
def test_breaks_off_their_knots_cost_nothing_over_long_intervals(
    breaks: list[float], jerks: list[float]
) -> None:
    """A jerk j that ends e after its knot leaves e j of acceleration, which a quintic carries h^2 / 58 far."""
    trajectory = made_of(curve := rising(breaks, jerks, 3), ending(curve))
    knots = knots_of(trajectory)
    assert largest_differences(trajectory, knots)[0] <= 1e-9
    assert knots.deviation.position <= 1e-9
    assert len(knots.nanoseconds) <= 16


@pytest.mark.parametrize("stepping", [0, 1, 2])
def test_a_knot_stands_behind_the_step_of_any_joint(stepping: int) -> None:
    """The break is 0.4 ns behind a whole nanosecond, and the next one is behind the break."""
    one = rising([0.0, 19.0000000004, 20.0], [1.0, -9.0], 2)
    rows = np.zeros((3, 2, 3))
    rows[:, :, stepping] = one.coefficients[:, :, 0]
    curve = PiecewisePolynomial(one.breaks, rows)
    assert 19_000_000_001 in knots_of(made_of(curve, ending(curve)), 2).nanoseconds


def test_cubics_are_ten_times_nearer_than_quintics_must_be() -> None:
    coefficients = np.zeros((7, 1, 1))
    coefficients[0] = 0.1
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    knots = knots_of(made_of(curve, ending(curve)), 2)
    joined = CubicHermiteSpline(knots.times, knots.position, knots.velocity)
    t = np.linspace(0.0, 1.0, 20_001)
    assert np.abs(joined(t) - curve.evaluate(t)).max() <= LARGEST_DEVIATION / 10
    assert knots_of(made_of(curve, ending(curve))).deviation.position <= LARGEST_DEVIATION


@pytest.mark.parametrize("breaks", [[0.0, 1.0, 1.000005], [0.0, 0.000005, 1.0]])
def test_a_break_next_to_an_end_is_no_knot(breaks: list[float]) -> None:
    curve = rising(breaks, [0.5, -0.5], 2)
    assert (np.diff(knots_of(made_of(curve, ending(curve))).nanoseconds) >= 10_000).all()


def test_steps_that_follow_each_other_soon_have_two_knots_each() -> None:
    """Every 400 us: one a quarter of that before, and one behind, where a small step alone takes 200."""
    curve = rising([4e-4 * k for k in range(9)], [(-1.0) ** k for k in range(8)], 2)
    knots = knots_of(made_of(curve, ending(curve)))
    steps = 400_000 * np.arange(1, 8)
    assert knots.nanoseconds[1:-1].tolist() == (steps[:, None] + [-100_000, 100_000]).ravel().tolist()
    assert knots.acceleration[1:-1, 0] == pytest.approx(np.repeat((-1.0) ** np.arange(8), 2)[1:-1], abs=1e-9)


@pytest.mark.parametrize("apart", [30_000, 40_000, 100_000, 600_000])
def test_steps_near_to_each_other_between_long_pieces_have_two_knots_each(apart: int) -> None:
    """The first has its neighbour behind it, the last before it: a quarter of the way, at least 10 us."""
    curve = rising([0.0, 1.0, 1.0 + 1e-9 * apart, 2.5], [1.0, -1.0, 1.0], 2)
    knots = knots_of(made_of(curve, ending(curve)))
    steps = 1_000_000_000 + apart * np.arange(2)
    half = min(apart // 4, 200_000)
    if half < 10_000:  # there rounding would show: a knot stands at each
        whole = knots.nanoseconds
        assert whole[np.abs(whole - steps.mean()) < 2 * apart].tolist() == steps.tolist()
        return
    assert knots.nanoseconds[1:-1].tolist() == (steps[:, None] + [-half, half]).ravel().tolist()
    assert knots.acceleration[1:-1, 0] == pytest.approx([1.0, -1.0, -1.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("units", [-3, -1, 0, 1, 3])
def test_the_acceleration_of_a_knot_is_that_behind_a_break_that_rounding_moves(units: int) -> None:
    """A break a few units in the last place before or behind a whole nanosecond is there."""
    curve = rising([0.0, 0.3 + units * float(np.spacing(0.3)), 1.0], [1.0, -1.0], 2)
    trajectory = made_of(curve, ending(curve))
    for knots in (knots_of(trajectory, 2), knots_at(trajectory, np.array([0.0, 0.3, 1.0]))):
        at = np.searchsorted(knots.nanoseconds, 300_000_000)
        assert knots.nanoseconds[at] == 300_000_000
        assert knots.acceleration[at, 0] == pytest.approx(-1.0, abs=1e-9)


def test_cubics_cost_nothing_where_the_acceleration_steps_off_its_knot() -> None:
    """Of a step a that comes e before its knot a velocity e a is left, which a cubic carries 4 h / 27 far."""
    trajectory = made_of(curve := rising([0.0, 19.0000000004, 20.0], [1.0, -9.0], 2), ending(curve))
    knots = knots_of(trajectory, 2)
    joined = CubicHermiteSpline(knots.times, knots.position, knots.velocity)
    t = np.linspace(0.0, min(curve.end, knots.times[-1]), 20_001)
    assert np.abs(joined(t) - curve.evaluate(t)).max() <= 1e-9
    assert len(knots.nanoseconds) <= 16


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_knots_cannot_cure_has_no_more_of_them(side: float) -> None:
    """Positions of 10^8 are rounded by 1e-8; a velocity that changes in 3 ns is there in no row."""
    far = rising([0.0, 0.1, 100.0, 100.1], [side * 1e7, 0.0, -side * 1e7], 2)
    assert len(knots_of(made_of(far, ending(far)), 2).nanoseconds) == 4
    ramp = rising([0.0, 0.1, 0.100000003, 2.0], [0.0, 1e8, 0.0], 2)
    knots = knots_of(made_of(ramp, ending(ramp)), 2)
    assert len(knots.nanoseconds) <= 70
    assert knots.deviation.position <= LARGEST_DEVIATION / 10  # as of all cubics


def test_knots_are_a_microsecond_apart_however_much_is_missed() -> None:
    """In 20 us a motion that no microsecond is short enough for."""
    coefficients = np.zeros((7, 1, 1))
    coefficients[0] = 1e36
    curve = PiecewisePolynomial(np.array([0.0, 2e-5]), coefficients)
    knots = knots_of(made_of(curve, ending(curve)))
    assert knots.deviation.position > LARGEST_DEVIATION
    assert np.diff(knots.nanoseconds).tolist() == [1000] * 20


def test_an_end_in_motion_keeps_its_velocity() -> None:
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[0.5]], [[0.0]], [[0.0]]]))
    one = np.array([1.0])
    knots = knots_of(made_of(curve, State(one / 2, one, one)))
    assert knots.velocity[-1] == 1.0


def test_the_report_says_how_many_and_how_good() -> None:
    plan = plan_job(load_job(str(EXAMPLES / "septic.yaml")))
    knots, report = knots_of(plan.trajectory), report_of(plan).knots
    assert report is not None
    assert report.count == len(knots.nanoseconds) > plan.trajectory.curve.pieces + 1
    assert report.deviation.position == knots.deviation.position
    assert (report.deviation.position_unit, report.deviation.velocity_unit) == ("rad", "rad/s")
    broken = plan_job(load_job(str(EXAMPLES / "septic.yaml"), ["limits.velocity=0.001"]))
    assert not broken.verdict.passed
    assert report_of(broken).knots is None


def test_a_motion_of_thousands_of_years_is_explained_without_knots() -> None:
    """5e11 s: float64 tells nanoseconds apart up to 2^53 of them."""
    text = (EXAMPLES / "sync.yaml").read_text().replace("velocity: 10}", "velocity: 1.0e-10}")
    plan = plan_job(job_from_text(text))
    assert plan.trajectory.duration == pytest.approx(5e11, rel=1e-9)
    assert report_of(plan).knots is None
    with pytest.raises(InputError, match="whole nanoseconds"):
        knots_of(plan.trajectory)
