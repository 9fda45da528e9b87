"""Motions of one variable as values: what a problem is, the names of phases, bounds by direction, and braking."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ruckig

from trajcli.curves.phases import PhaseChain
from trajcli.errors import PlanningError
from trajcli.planners import ruckig as planner
from trajcli.planners.ruckig import (
    BoundaryProblem,
    PhaseProfile,
    _with_less,
    _within,
    fastest,
    fastest_of,
    inside,
    together,
)

BOUNDS = np.array([[-1.0, 1.0], [-2.0, 2.0], [-10.0, 10.0]])
UNEVEN = np.array([[-0.5, 1.0], [-3.0, 2.0], [-10.0, 14.0]])


def problem(
    final: Any = (3.0, 0, 0), initial: Any = (0.0, 0, 0), bounds: Any = BOUNDS, **more: Any
) -> BoundaryProblem:
    given = tuple(map(float, initial)), tuple(map(float, final))
    return BoundaryProblem("x", *given, np.asarray(bounds, dtype=float), **more)  # type: ignore[arg-type]


def without(order: int) -> np.ndarray:
    """Return bounds of which those of an order, and of the next ones, are infinite."""
    bounds = BOUNDS.copy()
    bounds[order - 1 :] = [-np.inf, np.inf]
    return bounds


def own(asked: BoundaryProblem) -> ruckig.Trajectory:
    """Return ruckig's own answer, in SI and with the smaller jerk."""
    wanted, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    (p, v, a), (target, last, change) = asked.initial, asked.final
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = [p], [v], [a]
    wanted.target_position, wanted.target_velocity, wanted.target_acceleration = [target], [last], [change]
    (wanted.min_velocity, wanted.max_velocity), (wanted.min_acceleration, wanted.max_acceleration) = (
        [[low], [high]] for low, high in asked.bounds[:2].tolist()
    )
    wanted.max_jerk = [float(np.abs(asked.bounds[2]).min())]
    if asked.control == "velocity":
        wanted.control_interface = ruckig.ControlInterface.Velocity
    assert ruckig.Ruckig(1).calculate(wanted, answer) == ruckig.Result.Working
    return answer


def names(profile: PhaseProfile) -> list[str]:
    return [phase.name for phase in profile.phases(0)]


def test_the_derivative_that_is_constant_is_the_lowest_above_which_nothing_is_bounded() -> None:
    assert [problem(bounds=bounds).order for bounds in (BOUNDS, without(3), without(2))] == [3, 2, 1]
    free = BOUNDS.copy()
    free[1] = [-np.inf, np.inf]
    assert problem(bounds=free).order == 3


def test_what_needs_no_change_is_steady() -> None:
    held = [problem((0, 0, 0)), problem((9, 0.5, 0), (0, 0.5, 0), control="velocity")]
    assert [each.steady for each in held] == [True, True]
    others = [
        problem((1, 0, 0)),
        problem((0, 0.5, 0), (0, 0.5, 0)),
        problem((0, 0.5, 0), (0, 0.4, 0), control="velocity"),
        problem((0, 0.5, 1), (0, 0.5, 0), control="velocity"),
        problem((0, 0.5, 0), (0, 0.5, 1), control="velocity"),
    ]
    assert not [each for each in others if each.steady]
    assert problem((9, 0.5, 0), (1, 0.5, 0), control="velocity").displacement == 0.0
    assert problem((9, 0.5, 0), (1, 0.5, 0)).displacement == 8.0


def test_rest_and_arrival_are_told_by_both_ends() -> None:
    assert problem().rests
    for k, end in [(k, end) for k in (1, 2) for end in ("initial", "final")]:
        state = [0.0, 0.0, 0.0]
        state[k] = 0.1
        assert not problem(**{"final": (3.0, 0, 0), end: state}).rests
    assert not problem(control="velocity").rests
    assert problem((2, 0.1, 0.3), (2, 0.1, 0.3)).done
    assert not problem((2, 0.1, 0.3), (2, 0.1, 0.2)).done
    assert not problem((2, 0.1, 0.3), (2, 0.2, 0.3)).done
    assert not problem((2, 0.1, 0.3), (1, 0.1, 0.3)).done


@pytest.mark.parametrize("duration", [0.0, 2.5])
def test_a_steady_motion_goes_as_far_as_its_speed(duration: float) -> None:
    for bounds in (BOUNDS, without(3), without(2)):
        asked = problem((0, 0.5, 0), (1, 0.5, 0), bounds, control="velocity")
        made = fastest_of(asked, duration)
        assert made.duration == duration
        ends = made.curve().piece_ends()[1][-1] if duration else np.array([1.0])
        assert float(ends[0]) == pytest.approx(1.0 + 0.5 * duration)
        assert names(made) == (["cruise"] if duration else [])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_phases_of_both_directions_have_the_signs_of_their_jerks(sign: float) -> None:
    made = fastest(problem((sign * 3, 0, 0)))
    forth, back = ("jerk +", "jerk -") if sign > 0 else ("jerk -", "jerk +")
    level = "constant acceleration"
    assert names(made) == [forth, level, back, "cruise", back, level, forth]
    for phase in made.phases(0):
        middle = 0.5 * (phase.start + phase.end)
        jerk = float(made.curve().evaluate(middle, 3)[0])
        assert jerk == pytest.approx({"jerk +": 10.0, "jerk -": -10.0}.get(phase.name, 0.0), abs=1e-6)


def test_equal_neighbours_are_one_phase_from_the_start_of_the_first() -> None:
    made = fastest(problem((0.1, 0, 0), bounds=without(3)))
    assert [(each.name, each.start, each.end) for each in made.phases(2)] == [
        ("constant acceleration", 0.0, pytest.approx(2 * np.sqrt(0.1 / 2)))
    ]
    assert made.phases(2)[0].joint == 2


def test_a_slow_motion_cruises_too() -> None:
    made = fastest(problem((1e-9, 0, 0), bounds=1e-10 * BOUNDS))
    assert "cruise" in names(made)
    assert "rest" not in names(made)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("bounds", [BOUNDS, without(3)], ids=["jerk", "acceleration"])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_bound_is_kept_up_to_rounding_in_each_direction(
    order: int, bounds: np.ndarray, sign: float
) -> None:
    """The motion reaches all its bounds, that of the velocity in its direction."""
    made = fastest(problem((sign * 3, 0, 0), bounds=bounds))
    assert _within(made, bounds)
    if not np.isfinite(bounds[order - 1]).all():
        return
    for side in (0, 1):
        reached = order > 1 or (side == 1) == (sign > 0)
        for less, kept in ((1e-11, True), (1e-8, not reached), (0.1, not reached)):
            lower = bounds.copy()
            lower[order - 1, side] *= 1 - less
            assert _within(made, lower) is kept


def test_what_is_given_up_is_jerk_and_acceleration_where_no_end_needs_it() -> None:
    for acceleration, factor in ((0.0, 0.9), (1.79, 0.9), (1.81, 1.0), (-1.81, 1.0)):
        for ends in ({"initial": (0, 0, acceleration)}, {"final": (3, 0, acceleration)}):
            less = _with_less(problem(**ends), 0.1).bounds
            np.testing.assert_allclose(less, BOUNDS * [[1.0], [factor], [0.9]])


def test_only_rounding_is_laid_onto_a_bound() -> None:
    above, far = 1.0 + 4e-13, 1.0 + 1e-11
    assert [inside(value, -1.0, 1.0) for value in (0.3, above, far, -above, -far)] == [
        0.3,
        1.0,
        far,
        -1.0,
        -far,
    ]


@pytest.mark.parametrize("distance", [3.0, 0.2, 1e-3, -3.0, -0.2, -1e-3])
def test_bounds_that_differ_by_direction_are_those_of_ruckig(distance: float) -> None:
    mirrored = -UNEVEN[:, ::-1] * [[1], [0], [1]] + [[0, 0], [-2, 2], [0, 0]]
    for bounds in (
        mirrored,
        -UNEVEN[:, ::-1],
        UNEVEN,
        UNEVEN * [[1], [0], [1]] + [[0, 0], [-2, 2], [0, 0]],
        BOUNDS,
    ):
        asked = problem((distance, 0, 0), bounds=bounds)
        made = fastest(asked)
        assert made.duration == pytest.approx(own(asked).duration, rel=1e-9)
        assert _within(made, bounds)
        slower = fastest_of(asked, 2 * made.duration)
        assert slower.duration == 2 * made.duration
        assert _within(slower, bounds)
        assert float(slower.curve().evaluate(slower.duration)[0]) == pytest.approx(distance, rel=1e-9)


def test_no_motion_is_faster_than_the_fastest() -> None:
    for asked in (problem(), problem((3, 0.2, 0)), problem((1e-3, 0, 0)), problem((1e-12, 0, 0))):
        made = fastest(asked)
        again = fastest_of(asked, 0.5 * made.duration)
        assert again.duration == pytest.approx(made.duration, rel=1e-9)
        assert float(again.curve().evaluate(again.duration)[0]) == pytest.approx(asked.final[0], rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stretched_motion_is_no_faster_than_the_fastest(sign: float) -> None:
    """In 1e5 s a millisecond of braking is no finer than rounding leaves it: the fastest is stretched instead."""
    bounds = np.array([[-1.0, 1.0], [-1e3, 1e3], [-1e6, 1e6]])
    asked = problem((sign * 1e5, 0, 0), bounds=bounds)
    made = fastest_of(asked, 5e4)
    assert made.duration == pytest.approx(1e5 + 2e-3, rel=1e-12)
    assert np.abs(made.curve().evaluate(np.linspace(0, made.duration, 101), 1)).max() <= 1 + 1e-9


@pytest.mark.parametrize("units", [(0.25, 8.0), (8.0, 0.25)])
@pytest.mark.parametrize(
    ("first", "last", "longer"),
    [
        ((0, -0.3, 0.5), (3, 0.2, 0), None),
        ((0, -0.3, 0.5), (3, 0.2, 0), 9.0),
        ((0, 0.5, 0), (0.05, 0.5, 0), 0.3),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_units_of_ruckig_change_nothing(
    sign: float,
    first: Any,
    last: Any,
    longer: float | None,
    units: tuple[float, float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Powers of two of time and of length; the last one has to go back first, and lasts longer than is wanted."""
    asked = problem(sign * np.array(last), sign * np.array(first))
    as_it_is = fastest(asked) if longer is None else fastest_of(asked, longer)
    monkeypatch.setattr(planner, "_units", lambda *_: iter([units]))
    made = fastest(asked) if longer is None else fastest_of(asked, longer)
    assert made.duration == pytest.approx(as_it_is.duration, rel=1e-12)
    assert made.chain.durations == pytest.approx(as_it_is.chain.durations, rel=1e-9)
    assert made.chain.constants == pytest.approx(as_it_is.chain.constants, rel=1e-9)


@pytest.mark.parametrize(("misses", "best"), [([2e-9] * 3, None), ([8e-10, 3e-10, 6e-10], 1)])
def test_of_motions_that_miss_their_target_the_nearest_is_taken_and_none_that_jumps(
    misses: list[float], best: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A billionth of the peaks is a jump that verification would find."""
    found = iter([(PhaseProfile(0.0, PhaseChain((), (), (), ()), k), miss) for k, miss in enumerate(misses)])
    monkeypatch.setattr(planner, "_attempts", lambda *_: [(0.0, (1.0, 1.0))] * len(misses))
    monkeypatch.setattr(planner, "_corrected", lambda *_: next(found))
    monkeypatch.setattr(planner, "_within", lambda *_: True)
    asked = problem((3, 0.2, 0))
    if best is None:
        with pytest.raises(PlanningError, match="no motion within"):
            fastest(asked)
    else:
        assert fastest(asked).duration == best


def test_all_last_as_long_as_the_slowest_and_the_minimum() -> None:
    asked = [problem((distance, 0, 0)) for distance in (1.0, 3.0, -0.2)]
    profiles = [fastest(each) for each in asked]
    for least, wanted in ((0.0, profiles[1].duration), (9.0, 9.0)):
        made = together(asked, profiles, least)
        assert [each.duration for each in made] == [wanted] * 3
        ends = [float(each.curve().evaluate(wanted)[0]) for each in made]
        np.testing.assert_allclose(ends, [1.0, 3.0, -0.2], rtol=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_start_beyond_its_velocity_is_braked_first_and_no_longer(sign: float) -> None:
    asked = problem((sign * 5, 0, 0), (0, sign * 2, 0))
    made, phases = fastest(asked), own(asked).profiles[0][0]
    assert names(made)[0] == "brake"
    assert names(made).count("brake") == 1
    assert made.phases(0)[0].end == pytest.approx(phases.brake.duration, rel=1e-9)
    assert made.duration == pytest.approx(own(asked).duration, rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("longer", [None, 6.0])
def test_a_run_down_is_braked_into_its_bounds_before_it_goes_to_its_velocity(
    sign: float, longer: float | None
) -> None:
    """From 2 m/s, 1 m/s beyond the limit, as fast as 2 m/s^2 and 10 m/s^3 allow; then on to 0.3 m/s."""
    asked = problem((0, sign * 0.3, 0), (0, sign * 2, 0), control="velocity", brake=True)
    made = fastest(asked) if longer is None else fastest_of(asked, longer)
    assert names(made)[0] == "brake"
    curve = made.curve()
    inside = made.phases(0)[0].end
    assert inside >= (2 - 1) / 2
    times = np.linspace(inside, made.duration, 501)
    assert np.abs(curve.evaluate(times, 1)).max() <= 1 + 1e-9
    assert float(curve.evaluate(made.duration, 1)[0]) == pytest.approx(sign * 0.3)
    if longer is None:
        assert made.duration == pytest.approx((2 - 0.3) / 2 + 2 / 10, rel=0.15)
    else:
        assert made.duration == longer
    unbraked = replace(asked, brake=False)
    assert "brake" not in names(fastest(unbraked))
    assert fastest(unbraked).duration == pytest.approx((2 - 0.3) / 2 + 2 / 10, rel=2e-3)


@pytest.mark.parametrize("turned", [False, True])
def test_where_one_must_last_longer_those_before_and_behind_it_last_as_long(turned: bool) -> None:
    """In 0.05 m at 0.5 m/s there is no time to stop: what lasts a little longer has to go back first."""
    asked = [problem((0.0084, 0, 0)), problem((0.05, 0.5, 0), (0, 0.5, 0)), problem((0.008, 0, 0))]
    asked = asked[::-1] if turned else asked
    profiles = [fastest(each) for each in asked]
    quickest = max(each.duration for each in profiles)
    made = together(asked, profiles)
    assert made[0].duration > 2 * quickest
    assert len({each.duration for each in made}) == 1
    for each, profile in zip(asked, made, strict=True):
        assert float(profile.curve().evaluate(profile.duration)[0]) == pytest.approx(each.final[0], rel=1e-9)


@pytest.mark.parametrize(
    ("left", "name"), [(1e-3, "cruise"), (-1e-3, "cruise"), (1e-12, "rest"), (-1e-12, "rest"), (0.0, "rest")]
)
@pytest.mark.parametrize("scale", [1.0, 1e-6])
def test_a_phase_that_is_slow_beside_the_others_is_a_cruise_and_what_rounding_leaves_is_rest(
    left: float, name: str, scale: float
) -> None:
    """From the peak velocity down to a thousandth of it, or to what rounding leaves; in metres and in micrometres."""
    start, brake = (0.0, scale), -scale * (1.0 - left)
    chain = PhaseChain(start, (np.nan, np.nan), (1.0, 2.0), (brake, 0.0))
    assert names(PhaseProfile(0.0, chain, 3.0)) == ["constant acceleration", name]


@pytest.mark.parametrize("final", [(0.0, 0.3, 1.0), (0.4, -0.5, 1.0), (0.0, -0.5, 0.9)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_comes_back_otherwise_than_it_went_ends_where_it_shall(final: Any, side: float) -> None:
    """Alone what comes back to its place with the opposite velocity and the same acceleration is a change of velocity."""
    target = [side * value for value in final]
    asked = problem(target, (0.0, side * 0.5, side * 1.0))
    quickest = fastest(asked)
    assert quickest.duration == pytest.approx(own(asked).duration, rel=1e-9)
    for made in (quickest, fastest_of(asked, 2.0 * quickest.duration, quickest)):
        curve = made.curve()
        ends = [float(curve.evaluate(curve.end, order, side="left")[0]) for order in range(3)]
        assert ends == pytest.approx(target, abs=1e-12)
