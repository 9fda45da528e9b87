"""The times that `spline` finds from the limits, against a search of scipy through splines of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicHermiteSpline, CubicSpline, PchipInterpolator, make_interp_spline
from scipy.optimize import minimize
from through_jobs import assert_passes, curve_of, plan, refusal
from tiers import few

VELOCITY, ACCELERATION = 1.0, 3.0
WITHIN = 1.02  # of the fastest
STARTS = 6
SAMPLES = 24  # of each piece


def cubic(ends):
    return lambda t, q: CubicSpline(t, q, bc_type=ends)


def virtual(t, q):
    """Return the cubic of continuous acceleration, two knots more than points, at rest at both ends."""
    first, last = (t[0] + t[1]) / 2, (t[-2] + t[-1]) / 2
    still = [(1, np.zeros(q.shape[1])), (2, np.zeros(q.shape[1]))]
    knots = [*[t[0]] * 4, first, *t[1:-1], last, *[t[-1]] * 4]
    return make_interp_spline(t, q, k=3, t=knots, bc_type=(still, still))


def computed(t, q):
    slopes = np.diff(q, axis=0) / np.diff(t)[:, None]
    inner = np.where(np.sign(slopes[1:]) == np.sign(slopes[:-1]), (slopes[1:] + slopes[:-1]) / 2, 0)
    return CubicHermiteSpline(t, q, np.vstack([0 * q[:1], inner, 0 * q[:1]]))


def monotone(t, q):
    """Return the cubics with the inner velocities of scipy's PCHIP, at rest at both ends."""
    inner = PchipInterpolator(t, q).derivative()(t[1:-1])
    return CubicHermiteSpline(t, q, np.vstack([0 * q[:1], inner, 0 * q[:1]]))


def parabolic(t, values):
    """Return the slopes of parabolas through three neighbours: none at a turn, at most thrice the smaller chord."""
    chords = np.diff(values, axis=0) / np.diff(t)[:, None]
    most = 3 * np.minimum(np.abs(chords[:-1]), np.abs(chords[1:]))
    inner = np.clip(np.gradient(values, t, axis=0)[1:-1], -most, most)
    return np.vstack([0 * values[:1], np.where(chords[1:] * chords[:-1] > 0, inner, 0), 0 * values[:1]])


def quintic(t, q):
    velocities = parabolic(t, q)
    pieces = BPoly.from_derivatives(t, np.stack([q, velocities, parabolic(t, velocities)], axis=1))
    return lambda at, order: pieces(at, nu=order)


RULES = {
    "natural": cubic("natural"),
    "clamped": cubic("clamped"),
    "not_a_knot": cubic("not-a-knot"),
    "continuous_acceleration": virtual,
    "computed": computed,
    "quintic": quintic,
    "shape_preserving": monotone,
}


def room(curve, t, down):
    """Return what is left of the limits, in samples; an acceleration that jumps counts from both sides."""
    at = (t[:-1, None] + np.diff(t)[:, None] * np.linspace(1e-9, 1 - 1e-9, SAMPLES)).ravel()
    velocity, acceleration = curve(at, 1).ravel(), curve(at, 2).ravel()
    return np.concatenate(
        [1 - np.maximum(velocity / VELOCITY, -velocity / down), 1 - np.abs(acceleration) / ACCELERATION]
    )


def fastest(rule, q, guess, down=VELOCITY):
    """Return the least duration that a search from several starts finds."""
    rng, best = np.random.default_rng(1), np.inf

    def times(y):
        return np.concatenate([[0.0], np.cumsum(np.exp(y))])

    for k in few(range(STARTS), 3):
        found = minimize(
            lambda y: np.exp(y).sum(),
            np.log(guess) + (k > 0) * rng.normal(0, 0.4, guess.size),
            constraints={"type": "ineq", "fun": lambda y: room(RULES[rule](times(y), q), times(y), down)},
            method="SLSQP",
            options={"maxiter": 150},
        )
        t = times(found.x)
        if room(RULES[rule](t, q), t, down).min() > -1e-6:
            best = min(best, t[-1])
    return best


def free(rule, q, **rest):
    points = [{"joints": row} for row in q[1:].tolist()]
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    move = {"planner": "spline", "rule": rule, "through": points}
    return plan({"joints": q[0].tolist()}, move, limits=limits, **rest)


@pytest.mark.parametrize("rule", few(list(RULES), 4))
@pytest.mark.parametrize(("seed", "joints", "count"), few([(2, 2, 4), (1, 1, 4), (3, 2, 6)], 1))
def test_no_slower_than_the_fastest(rule, seed, joints, count):
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.uniform(-1, 1, (count, joints)), axis=0)
    made = free(rule, q)
    times = made.moves[0].planned.via_points.times
    assert_passes(made, times, q)
    assert made.trajectory.duration <= WITHIN * fastest(rule, q, np.diff(times))


def test_the_closed_form_of_two_points():
    """A clamped cubic over the way D takes max(3 D / 2 V, sqrt(6 D / A))."""
    for distance in (0.1, 5.0):
        made = free("clamped", np.array([[0.0], [distance]]))
        expected = max(1.5 * distance / VELOCITY, np.sqrt(6 * distance / ACCELERATION))
        assert made.trajectory.duration == pytest.approx(expected, rel=1e-9)


def test_limits_by_direction():
    q = np.array([[0.0], [1.0], [0.2], [1.5]])
    points = [{"joints": row} for row in q[1:].tolist()]
    limits = {"velocity": [[-0.2, VELOCITY]], "acceleration": ACCELERATION}
    made = plan({"joints": q[0].tolist()}, {"planner": "spline", "through": points}, limits=limits)
    times = made.moves[0].planned.via_points.times
    assert made.trajectory.duration <= WITHIN * fastest(
        "continuous_acceleration", q, np.diff(times), down=0.2
    )
    assert made.verdict.peaks[0][1].low[0] == pytest.approx(-0.2, rel=1e-6)


def test_a_limit_of_jerk_counts():
    q = np.array([[0.0], [1.0], [0.2], [1.5]])
    points = [{"joints": row} for row in q[1:].tolist()]
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION, "jerk": 2.0}
    made = plan({"joints": q[0].tolist()}, {"planner": "spline", "through": points}, limits=limits)
    assert made.trajectory.duration > free("continuous_acceleration", q).trajectory.duration
    curve = curve_of(made)
    jerk = np.abs(np.concatenate(curve.piece_ends(3)))  # of a cubic: one number a piece
    assert jerk.max() == pytest.approx(2.0, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("rule", ["continuous_acceleration", "quintic", "shape_preserving", "natural"])
def test_a_duration_keeps_the_proportions_of_the_fastest(rule):
    q = np.cumsum(np.random.default_rng(4).uniform(-1, 1, (5, 2)), axis=0)
    points = [{"joints": row} for row in q[1:].tolist()]
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    move = {"planner": "spline", "rule": rule, "through": points, "duration": 30.0}
    made = plan({"joints": q[0].tolist()}, move, limits=limits)
    alone = free(rule, q)
    assert made.trajectory.duration == 30.0
    at = alone.moves[0].planned.via_points.times / alone.trajectory.duration
    np.testing.assert_allclose(made.moves[0].planned.via_points.times / 30.0, at, rtol=1e-9)
    assert_passes(made, at * 30.0, q)


def test_a_duration_that_is_too_short_is_over_its_limits():
    q = np.array([[0.0], [1.0], [0.5]])
    points = [{"joints": row} for row in q[1:].tolist()]
    move = {"planner": "spline", "through": points, "duration": 0.5}
    start, limits = {"joints": [0.0]}, {"velocity": VELOCITY, "acceleration": ACCELERATION}
    made = plan(start, move, limits=limits, passes=False)
    assert {finding.kind for finding in made.verdict.findings} == {"velocity", "acceleration"}
    slowed = plan(start, {**move, "when_over_limit": "slow"}, limits=limits)
    assert slowed.trajectory.duration == pytest.approx(
        free("continuous_acceleration", q).trajectory.duration, rel=1e-6
    )


def test_an_end_that_no_times_can_keep():
    points = [{"joints": [1.0]}, {"joints": [2.0], "velocity": 5}]
    error = refusal(
        {"joints": [0.0]},
        {"planner": "spline", "through": points},
        limits={"velocity": VELOCITY, "acceleration": ACCELERATION},
    )
    assert error.exit_code == 3
    assert "within all limits" in str(error)


def test_many_points_take_no_longer_than_stopping_at_each():
    """Between two points at rest a quintic needs max(15 d / 8 V, sqrt(10 d / sqrt(3) A))."""
    q = np.cumsum(np.random.default_rng(5).uniform(-0.5, 0.5, (60, 3)), axis=0)
    made = free("continuous_acceleration", q)
    ways = np.abs(np.diff(q, axis=0)).max(axis=1)
    stopping = np.maximum(1.875 * ways / VELOCITY, np.sqrt(10 / np.sqrt(3) * ways / ACCELERATION)).sum()
    assert made.trajectory.duration < 0.8 * stopping
    np.testing.assert_array_less(np.diff(made.moves[0].planned.via_points.times), 10)
    assert_passes(made, made.moves[0].planned.via_points.times, q)
    curve = curve_of(made)
    assert np.abs(curve.evaluate(np.linspace(0, curve.duration, 10_001), 2)).max() <= ACCELERATION * (
        1 + 1e-9
    )


@pytest.mark.parametrize("rule", ["imposed", "computed", "clamped"])
def test_a_return_to_the_start_in_motion(rule):
    """The cubic v t (1 - t/T)^2 has its largest acceleration, 4 v / T, at the start."""
    start = {"joints": [0.3], "velocity": [0.5]}
    move = {"planner": "spline", "rule": rule, "to": {"joints": [0.3]}}
    made = plan(start, move, limits={"velocity": VELOCITY, "acceleration": ACCELERATION})
    assert made.trajectory.duration == pytest.approx(4 * 0.5 / ACCELERATION, rel=1e-8)


def test_a_quintic_return_to_the_start_in_motion():
    """The quintic v T (u - 6 u^3 + 8 u^4 - 3 u^5) has its largest jerk, 36 v / T^2, at the start."""
    start = {"joints": [0.0], "velocity": [-0.5]}
    move = {"planner": "spline", "rule": "quintic", "to": {"joints": [0.0]}}
    made = plan(start, move, limits={"velocity": VELOCITY, "acceleration": 20.0, "jerk": 10.0})
    assert made.trajectory.duration == pytest.approx(np.sqrt(36 * 0.5 / 10.0), rel=1e-8)


@pytest.mark.parametrize("rule", ["natural", "not_a_knot", "continuous_acceleration", "shape_preserving"])
def test_a_return_to_the_start_in_motion_has_a_verdict(rule):
    """Monotone from a point to itself is only rest; the other rules overshoot and come back."""
    start, move = {"joints": [0.3], "velocity": [0.5]}, {"planner": "spline", "to": {"joints": [0.3]}}
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    if rule == "shape_preserving":
        assert "monotone" in str(refusal(start, move | {"rule": rule}, limits=limits))
        return
    curve = curve_of(plan(start, move | {"rule": rule}, limits=limits))
    t = np.linspace(curve.start, curve.end, 2001)
    second = np.abs(curve.evaluate(t, 2)).max()
    assert curve.evaluate(t[:1], 1)[0, 0] == pytest.approx(0.5)
    assert second == pytest.approx(ACCELERATION, rel=1e-3)


def test_a_return_to_the_start_in_motion_without_a_limit_that_takes_time():
    start, move = {"joints": [0.3], "velocity": [0.5]}, {"planner": "spline", "to": {"joints": [0.3]}}
    assert "limit on the acceleration of j1" in str(refusal(start, move, limits={"velocity": VELOCITY}))


def straight_through_the_turns(q, velocity, acceleration):
    """Return the least time in which one joint runs from turn to turn of its points, at rest in each."""
    kept = np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1
    runs = np.abs(np.diff(q[[0, *kept, -1]]))
    cruising = runs > velocity**2 / acceleration
    return np.where(
        cruising, runs / velocity + velocity / acceleration, 2 * np.sqrt(runs / acceleration)
    ).sum()


@pytest.mark.full
@pytest.mark.parametrize("count", few([100, 300, 1000, 3000], 2))
def test_dense_points_are_passed_about_as_fast_as_any_motion_could(count):
    q = np.sin(10 * np.arange(count + 1) / count)
    points = [{"joints": [value]} for value in q[1:].tolist()]
    limits = {"velocity": 1.0, "acceleration": 5.0}
    made = plan({"joints": [0.0]}, {"planner": "spline", "through": points}, limits=limits)
    assert made.trajectory.duration <= 1.05 * straight_through_the_turns(q, 1.0, 5.0)


@pytest.mark.full
@pytest.mark.parametrize("rule", few(["natural", "clamped", "computed", "quintic", "shape_preserving"], 2))
def test_dense_points_of_two_joints_in_every_rule(rule):
    """Four times as many points on the same curve do not slow it down."""
    limits = {"velocity": 1.0, "acceleration": 5.0}
    durations = []
    for count in (80, 320):
        u = np.linspace(0, 6, count + 1)
        q = np.stack([np.sin(u), np.sin(1.3 * u)], axis=1)
        points = [{"joints": row} for row in q[1:].tolist()]
        move = {"planner": "spline", "rule": rule, "through": points}
        durations.append(plan({"joints": q[0].tolist()}, move, limits=limits).trajectory.duration)
    assert durations[1] <= 1.05 * durations[0]


@pytest.mark.parametrize("rule", ["natural", "not_a_knot"])
def test_slowing_down_helps_where_the_rule_leaves_the_ends_open(rule):
    """Times that are f times as long divide the velocities of a spline by f, those of its ends, too."""
    t, q = np.array([0, 0.5, 1]), np.array([0, 1, 2.5])
    start, through = (
        {"joints": [0]},
        [{"joints": [v], "time": at} for v, at in zip(q[1:], t[1:], strict=True)],
    )
    move, limits = {"planner": "spline", "rule": rule, "through": through}, {"velocity": VELOCITY}
    spline = CubicSpline(t, q, bc_type=rule.replace("_", "-"))
    factor = np.abs(spline(np.linspace(0, 1, 20001), 1)).max() / VELOCITY
    (finding,) = plan(start, move, passes=False, limits=limits).verdict.findings
    assert finding.hint.startswith(f"it must last {factor:.6g} times longer")
    slower = plan(start, move | {"when_over_limit": "slow"}, limits=limits)
    assert slower.trajectory.duration == pytest.approx(factor, rel=1e-6)
