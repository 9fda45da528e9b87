"""Rules of splines with unequal states at their ends against scipy, and what a search of times begins with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BPoly, CubicHermiteSpline, CubicSpline, PchipInterpolator, make_interp_spline

from trajcli.errors import MissingLimitError
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.waypoints import spline_rules
from trajcli.planners.waypoints.spline_rules import Rule, curve_through, fastest_spline_times
from trajcli.planners.waypoints.through_points import PointTable

Array = NDArray[np.float64]

T = np.array([0.0, 1.0, 2.5, 3.0, 5.0])
Q = np.array([[0.0, 1.0], [2.0, 0.5], [1.0, -1.0], [3.0, -1.5], [3.5, -3.0]])
V = np.array([[0.5, -0.2], [0.1, 0.3], [-0.4, 0.2], [0.3, -0.6], [0.2, -0.7]])
A = np.array([[0.3, -1.0], [0.2, 0.4], [0.5, 0.1], [-0.3, 0.6], [1.1, 0.7]])


def table(q: Array, v: Array | None = None, a: Array | None = None, given: object = True) -> PointTable:
    """Return points with velocities and accelerations, all of them given, or what the last argument says."""
    rates = np.stack([np.zeros(q.shape) if row is None else row for row in (v, a)])
    return PointTable(q, None, rates, np.broadcast_to(given, (2, len(q))).astype(bool), np.zeros(len(q)))


def ends_only(rows: Array) -> Array:
    """Return rows in which only the first and the last are not zero."""
    return np.vstack([rows[:1], 0 * rows[1:-1], rows[-1:]])


def computed(t: Array, q: Array, v: Array) -> CubicHermiteSpline:
    slopes = np.diff(q, axis=0) / np.diff(t)[:, None]
    inner = np.where(slopes[1:] * slopes[:-1] > 0, (slopes[1:] + slopes[:-1]) / 2, 0)
    return CubicHermiteSpline(t, q, np.vstack([v[:1], inner, v[-1:]]))


def virtual(t: Array, q: Array, v: Array, a: Array, between: tuple[float, float]) -> object:
    knots = [*[t[0]] * 4, between[0], *t[1:-1], between[1], *[t[-1]] * 4]
    ends = [[(1, v[k]), (2, a[k])] for k in (0, -1)]
    return make_interp_spline(t, q, k=3, t=knots, bc_type=tuple(ends))


def assert_same(rule: Rule, points: PointTable, spline: object, virtual_times: object = None) -> None:
    """The curve of a rule and that of scipy agree with their derivatives, inside all pieces."""
    at = np.concatenate([np.linspace(a, b, 9)[1:-1] for a, b in pairwise(T)])
    for order in range(3):
        got = curve_through(rule, points, T, virtual_times).evaluate(at, order)  # type: ignore[arg-type]
        np.testing.assert_allclose(got, spline(at, order), rtol=0, atol=1e-11)  # type: ignore[operator]


@pytest.mark.parametrize("v", [V, -V, 0 * V])
def test_rules_with_velocities_at_the_ends_are_those_of_scipy(v: Array) -> None:
    assert_same("imposed", table(Q, v), CubicHermiteSpline(T, Q, v))
    assert_same("computed", table(Q, v), computed(T, Q, v))
    assert_same("clamped", table(Q, v), CubicSpline(T, Q, bc_type=((1, v[0]), (1, v[-1]))))


@pytest.mark.parametrize(("times", "between"), [(None, (0.5, 4.0)), ((0.9, 3.1), (0.9, 3.1))])
def test_virtual_points_let_each_end_have_its_velocity_and_acceleration(
    times: tuple[float, float] | None, between: tuple[float, float]
) -> None:
    points = table(Q, ends_only(V), ends_only(A))
    assert_same("continuous_acceleration", points, virtual(T, Q, V, A, between), times)


@pytest.mark.parametrize("rule", ["natural", "not_a_knot"])
@pytest.mark.parametrize("first", [[0.0, 0.0], [0.5, 0.0], [0.0, -0.5]])
@pytest.mark.parametrize("last", [None, [0.0, 0.0], [0.0, 0.7]])
def test_an_end_that_moves_or_is_stated_replaces_the_condition_of_the_rule(
    rule: Rule, first: list[float], last: list[float] | None
) -> None:
    open_end = (2, [0.0, 0.0]) if rule == "natural" else "not-a-knot"
    v = np.vstack([[first], np.zeros((3, 2)), [last or [0.0, 0.0]]])
    points = table(Q, v, given=[True, False, False, False, last is not None])
    ends = ((1, first) if any(first) else open_end, open_end if last is None else (1, last))
    assert_same(rule, points, CubicSpline(T, Q, bc_type=ends))


@pytest.mark.parametrize("last", [[0.2, -0.7], [0.7, 0.0]])
def test_a_monotone_spline_has_the_velocities_of_its_ends(last: list[float]) -> None:
    inner = PchipInterpolator(T, Q).derivative()(T[1:-1])
    v = np.vstack([[[0.5, -0.2]], inner, [last]])
    assert_same("shape_preserving", table(Q, ends_only(v)), CubicHermiteSpline(T, Q, v))


def bounded_parabolas(t: Array, rows: Array, ends: Array) -> Array:
    """Return slopes of parabolas through three neighbours, none at a turn, at most thrice the smaller chord."""
    chords = np.diff(rows, axis=0) / np.diff(t)[:, None]
    largest = 3 * np.minimum(np.abs(chords[:-1]), np.abs(chords[1:]))
    inner = np.clip(np.gradient(rows, t, axis=0)[1:-1], -largest, largest)
    return np.vstack([ends[:1], np.where(chords[1:] * chords[:-1] > 0, inner, 0), ends[-1:]])


@pytest.mark.parametrize("velocities", [(1,), (3,), (1, 3), (1, 2, 3), ()])
@pytest.mark.parametrize("accelerations", [(1,), (2, 3), ()])
def test_a_quintic_takes_what_each_point_gives_and_computes_the_rest(
    velocities: tuple[int, ...], accelerations: tuple[int, ...]
) -> None:
    given = np.zeros((2, 5), dtype=bool)
    given[0, list(velocities)], given[1, list(accelerations)] = True, True
    rates = np.where((given | [True, False, False, False, True])[:, :, None], [V, A], 0.0)
    v = np.where((given[0] | (T == 0) | (T == 5))[:, None], V, bounded_parabolas(T, Q, V))
    a = np.where((given[1] | (T == 0) | (T == 5))[:, None], A, bounded_parabolas(T, v, A))
    pieces = BPoly.from_derivatives(T, np.stack([Q, v, a], axis=1))
    assert_same("quintic", table(Q, *rates, given=given), lambda at, order: pieces(at, nu=order))


def robot(
    velocity: object = np.inf, acceleration: object = np.inf, jerk: object = np.inf, joints: int = 1
) -> Robot:
    """Return a robot with limits that are one for both directions, or lists of bounds of its joints."""

    def bounds(limit: object) -> Array:
        both = np.array(limit, dtype=float)
        return both if both.ndim else np.array([[-both, both]] * joints)

    named = {"velocity": bounds(velocity), "acceleration": bounds(acceleration), "jerk": bounds(jerk)}
    every = tuple(Joint(f"j{k + 1}") for k in range(joints))
    return Robot("bare", every, replace(unlimited(joints), **named), None, np.eye(4), np.eye(4))


class Search:
    """Stands in the place of a search of durations: it keeps what it is asked to begin with, and returns that."""

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor

    def __call__(self, family: object, guess: Array, bounds: Array, further: Iterable[Array]) -> Array:
        self.guess, self.further = guess, list(further)
        return self.factor * [*self.further, guess][0]


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Search:
    made = Search()
    monkeypatch.setattr(spline_rules, "fastest_durations", made)
    return made


class Dense:
    """Stands in the place of laws of few parameters: it keeps what these are made of, and finds nothing."""

    made: list[tuple[Array, tuple[float, float] | None, Array]]

    def __init__(self, family: object, u: Array, bounds: Array, slopes: tuple[float, float] | None) -> None:
        self.of = u, slopes

    def durations(self, guess: Array) -> None:
        Dense.made.append((*self.of, guess))


@pytest.fixture
def dense(monkeypatch: pytest.MonkeyPatch, search: Search) -> Search:
    monkeypatch.setattr(spline_rules, "DensePoints", Dense)
    Dense.made = []
    return search


@pytest.mark.parametrize(
    ("limits", "durations"),
    [
        ({"velocity": [[-2.0, 1.0], [-5.0, 9.0]]}, [8.0, 0.8, 4.0]),
        ({"velocity": [[-1.0, 2.0], [-9.0, 5.0]]}, [8.0, 0.8, 4.0]),
        ({"acceleration": [[-4.0, 2.0], [-9.0, 9.0]]}, [2.0, 2 / 3, 2**0.5]),
        ({"jerk": [[-1.0, 4.0], [-9.0, 9.0]]}, [2.0, (4 / 9) ** (1 / 3), 4 ** (1 / 3)]),
        ({"velocity": [[-100.0, 100.0]] * 2, "acceleration": [[-2.0, 4.0]] * 2}, [2.0, 2**0.5, 2**0.5]),
    ],
)
def test_a_search_of_times_begins_with_what_the_slowest_joint_needs_in_its_slower_direction(
    search: Search, limits: dict[str, object], durations: list[float]
) -> None:
    q = np.array([[0.0, 0.0], [8.0, 1.0], [8.0, 5.0], [4.0, 5.0]])
    times, events = fastest_spline_times("clamped", table(q), robot(**limits, joints=2))  # type: ignore[arg-type]
    np.testing.assert_allclose(search.guess, durations)
    np.testing.assert_allclose(times, [0.0, *np.cumsum(durations)])
    assert not events
    assert not search.further


@pytest.mark.parametrize(
    ("v", "a", "limits", "duration"),
    [
        (0.5, 0.0, {"acceleration": 2.0}, 0.5 / 2),
        (-0.5, 0.0, {"acceleration": [[-2.0, 4.0]]}, 0.5 / 2),
        (0.5, 0.0, {"jerk": 8.0}, (0.5 / 8) ** 0.5),
        (0.0, -3.0, {"jerk": 8.0}, 3 / 8),
        (0.5, 3.0, {"jerk": 8.0, "acceleration": 2.0}, 3 / 8),
    ],
)
def test_where_it_returns_to_its_start_the_rates_of_the_ends_say_how_long_that_takes(
    search: Search, v: float, a: float, limits: dict[str, object], duration: float
) -> None:
    rates = [np.array([[0.0], [0.0]]), np.array([[0.0], [0.0]])]
    for last in (0, 1):
        for values, value in zip(rates, (v, a), strict=True):
            values[:] = 0.0
            values[last] = value
        points = table(np.array([[0.3], [0.3]]), *rates)
        fastest_spline_times("quintic", points, robot(**limits))  # type: ignore[arg-type]
        np.testing.assert_allclose(search.guess, [duration])


@pytest.mark.parametrize(
    ("first", "last", "joints"),
    [([0.5, 0.0], [0.0, 0.0], "j1"), ([0.0, 0.0], [0.0, -0.5], "j2"), ([0.5, 0.0], [0.0, -0.5], "j1, j2")],
)
def test_a_return_to_the_start_needs_limits_of_acceleration_of_what_moves_at_either_end(
    search: Search, first: list[float], last: list[float], joints: str
) -> None:
    points = table(np.array([[0.3, 0.1]] * 2), np.array([first, last]))
    with pytest.raises(MissingLimitError, match=f"a limit on the acceleration of {joints} to find"):
        fastest_spline_times("clamped", points, robot(1.0, joints=2))


@pytest.mark.parametrize(
    ("limits", "lacking"),
    [
        ({"velocity": [[-np.inf, 1.0], [-1.0, 1.0], [-1.0, np.inf]]}, "velocity of j1"),
        ({"velocity": [[-1.0, np.inf], [-1.0, 1.0], [-1.0, np.inf]]}, "velocity of j1"),
        (
            {"velocity": [[-np.inf, 1.0], [-1.0, 1.0], [-1.0, 1.0]], "acceleration": [[-1.0, np.inf]] * 3},
            "velocity of j1",
        ),
        ({"velocity": [[-np.inf, 1.0]] * 3}, "velocity of j1, j2"),
        ({"velocity": [[-np.inf, 1.0], [-1.0, 1.0], [-1.0, 1.0]], "acceleration": 1.0}, None),
        ({"acceleration": [[-1.0, 1.0]] * 2 + [[-np.inf, np.inf]], "jerk": [[-np.inf, 1.0]] * 3}, None),
    ],
)
def test_a_joint_that_moves_needs_one_limit_in_both_directions(
    search: Search, limits: dict[str, object], lacking: str | None
) -> None:
    points = table(np.array([[0.0, 0.0, 1.0], [1.0, -1.0, 1.0]]))
    bounds = {"velocity": [[-np.inf, np.inf]] * 3, "acceleration": np.inf, "jerk": np.inf} | limits
    if lacking is None:
        assert fastest_spline_times("clamped", points, robot(**bounds, joints=3))[0][-1] > 0  # type: ignore[arg-type]
        return
    with pytest.raises(MissingLimitError, match=f"needs a limit on the {lacking} to find"):
        fastest_spline_times("clamped", points, robot(**bounds, joints=3))  # type: ignore[arg-type]


def test_no_piece_begins_with_less_than_a_thousandth_of_the_mean(search: Search) -> None:
    q = np.array([[0.0], [1.0], [1.0 + 1e-6], [2.0]])
    fastest_spline_times("clamped", table(q), robot(1.0))
    np.testing.assert_allclose(search.guess, [1.0, 2e-3 / 3, 1.0], rtol=1e-5)


def line(count: int, length: float = 2.0) -> Array:
    """Return points on a straight line of two joints, of which the first has the longer way."""
    return np.outer(np.linspace(0, length, count), [1.0, -0.5])


@pytest.mark.parametrize(("count", "many"), [(32, False), (33, True)])
def test_many_points_begin_with_the_fastest_motion_along_a_line(
    search: Search, count: int, many: bool
) -> None:
    """From rest to rest in a trapezoid of velocity: distance / v + v / a."""
    fastest_spline_times("clamped", table(line(count)), robot(1.0, 4.0, joints=2))
    assert len(search.further) == many
    for durations in search.further:
        assert durations.sum() == pytest.approx(2.0 / 1.0 + 1.0 / 4.0, rel=1e-3)
        np.testing.assert_allclose(durations, durations[::-1], rtol=0.02)


@pytest.mark.parametrize(
    "acceleration", [[[-4.0, 4.0], [-np.inf, 4.0]], [[-4.0, np.inf], [-4.0, 4.0]], np.inf]
)
def test_no_motion_along_a_line_says_anything_without_limits_of_acceleration(
    search: Search, acceleration: object
) -> None:
    fastest_spline_times("clamped", table(line(40)), robot(1.0, acceleration, joints=2))
    assert not search.further


def test_a_joint_that_stands_needs_no_limits_for_a_motion_along_the_path(dense: Search) -> None:
    q, free = line(80) * [1.0, 0.0], [-np.inf, np.inf]
    v = np.vstack([[[0.5, 0.0]], np.zeros((78, 2)), [[0.3, 0.0]]])
    limits = robot([[-1.0, 1.0], free], [[-4.0, 4.0], free], [[-40.0, 40.0], free], joints=2)
    fastest_spline_times("clamped", table(q, v), limits)
    assert [durations.sum() for durations in dense.further] == pytest.approx([2.25], rel=1e-3)
    ((_, slopes, _),) = Dense.made
    np.testing.assert_allclose(slopes, [0.5 * 79 / 2, 0.3 * 79 / 2])


@pytest.mark.parametrize("order", [1, -1])
def test_distances_that_rounding_swallows_are_no_path(search: Search, order: int) -> None:
    far = np.vstack([[[0.0, 0.0]], np.column_stack([np.full(40, 1e9), 1e-9 * np.arange(40)])])[::order]
    fastest_spline_times("clamped", table(far), robot(1.0, 4.0, joints=2))
    assert not search.further


@pytest.mark.parametrize(("factor", "told"), [(0.99, False), (1.04, False), (1.06, True), (1.4, True)])
def test_times_a_twentieth_above_those_along_the_path_are_told(
    search: Search, factor: float, told: bool
) -> None:
    search.factor = factor
    times, events = fastest_spline_times("clamped", table(line(40)), robot(1.0, 4.0, joints=2))
    assert [event.kind for event in events] == ["local_optimum"] * told
    for event in events:
        amounts = {name: float(amount.value) for name, amount in event.amounts.items()}  # type: ignore[union-attr]
        assert amounts["least"] == pytest.approx(2.25, rel=1e-3)
        assert amounts["duration"] == pytest.approx(2.25 * factor, rel=1e-3)
        assert amounts["duration"] == pytest.approx(times[-1], rel=1e-12)


@pytest.mark.parametrize(
    ("count", "jerk", "laws"), [(72, 40.0, 0), (73, 40.0, 1), (73, [[-40.0, 40.0], [-40.0, np.inf]], 0)]
)
def test_dense_points_within_jerk_are_passed_by_laws_of_few_parameters(
    dense: Search, count: int, jerk: object, laws: int
) -> None:
    fastest_spline_times("clamped", table(line(count)), robot(1.0, 4.0, jerk, joints=2))
    assert len(Dense.made) == laws
    for _, _, guess in Dense.made:
        np.testing.assert_array_equal(guess, dense.further[0])


@pytest.mark.parametrize(("ratio", "laws"), [(3.9, 1), (4.1, 2)])
def test_distances_that_differ_by_four_count_in_a_parameter(dense: Search, ratio: float, laws: int) -> None:
    steps = np.where(np.arange(79) % 2, 0.01, 0.01 * ratio)
    q = np.concatenate([[0.0], np.cumsum(steps)])[:, None]
    v = np.vstack([[[0.5]], np.zeros((78, 1)), [[0.3]]])
    fastest_spline_times("computed", table(q, v), robot(1.0, 4.0, 40.0))
    assert len(Dense.made) == laws
    by_distance = np.concatenate([[0.0], np.cumsum(steps + steps.mean() / 4)])
    for (parameter, slopes, _), u in zip(Dense.made, (np.arange(80.0), by_distance), strict=False):
        np.testing.assert_allclose(parameter, u)
        through = CubicSpline(u, q[:, 0], bc_type="not-a-knot")
        np.testing.assert_allclose(slopes, [0.5 / through(u[0], 1), 0.3 / through(u[-1], 1)])


@pytest.mark.parametrize(
    ("rule", "first", "last", "slopes"),
    [
        ("clamped", [0.5, -0.25], [0.3, -0.15], (0.5, 0.3)),
        ("clamped", [0.5, 0.5], [0.0, -0.15], (0.2, 0.06)),  # what lies along the path counts
        ("clamped", [-0.5, 0.25], [0.3, -0.15], (0.0, 0.3)),
        ("clamped", [0.5, -0.25], [-0.3, 0.15], (0.5, 0.0)),
        ("natural", [0.0, 0.0], [0.0, 0.0], None),
        ("not_a_knot", [0.0, 0.0], [0.0, 0.0], None),
    ],
)
def test_laws_of_dense_points_begin_and_end_as_fast_as_the_arm(
    dense: Search, rule: Rule, first: list[float], last: list[float], slopes: tuple[float, float] | None
) -> None:
    v = np.vstack([[first], np.zeros((78, 2)), [last]])
    fastest_spline_times(rule, table(line(80, 1.0), v), robot(1.0, 4.0, 40.0, joints=2))
    ((_, found, _),) = Dense.made
    if slopes is None:
        assert found is None
    else:
        np.testing.assert_allclose(found, 79 * np.array(slopes), rtol=1e-9, atol=1e-9)
