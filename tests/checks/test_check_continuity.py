"""Jumps that are there by very little, on one side, or only as far as breaks are rounded."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from motions import between, limits, state, trajectory

from trajcli.checks import continuity
from trajcli.checks.continuity import JERK_HINT, acceleration_steps, check_continuity
from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.trajectory import State, Trajectory

FREE, LIMITED = limits(), limits(jerk=1e9)
QUANTITIES = ("position", "velocity", "acceleration")
PEAK = {"position": 2.0, "velocity": 1.875, "acceleration": 10 / np.sqrt(3)}


def steps_of(*args):
    return list(acceleration_steps(*args))


def bump(kind: str, size: float, duration: float) -> np.ndarray:
    """Return the quintic (6,) that begins with a jump in one quantity and ends in nothing at all."""
    derivatives = np.zeros((3, 2, 1))
    derivatives[QUANTITIES.index(kind), 0] = size
    return hermite_pieces([0.0, duration], derivatives).coefficients[:, 0, 0]


def with_jump(kind: str, size: float) -> PiecewisePolynomial:
    """Return quintics 1 -> 2 -> 1 of a second each, with a jump in the middle and none at the end."""
    curve = between([1.0], [2.0], [1.0], duration=1.0)
    coefficients = curve.coefficients.copy()
    coefficients[:, 1, 0] += bump(kind, size, 1.0)
    return PiecewisePolynomial(curve.breaks, coefficients)


def declared_end(curve: PiecewisePolynomial) -> State:
    return State(*(curve.piece_ends(order)[1][-1] for order in range(3)))


def judge(curve: PiecewisePolynomial, bounds=FREE):
    whole = trajectory(curve, end=declared_end(curve))
    return check_continuity(whole, [bounds])


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("kind", QUANTITIES)
def test_a_jump_of_two_billionths_of_the_peak_is_found_and_one_of_half_a_billionth_is_not(
    kind: str, sign: float
) -> None:
    assert judge(with_jump(kind, sign * 0.5e-9 * PEAK[kind]), LIMITED) == []
    found = judge(with_jump(kind, sign * 2e-9 * PEAK[kind]), LIMITED)
    assert [(f.move, f.joint, f.kind, f.time) for f in found] == [(0, "j1", f"{kind}_jump", 1.0)]
    assert found[0].value == pytest.approx(sign * 2e-9 * PEAK[kind], rel=1e-5)
    assert found[0].limit == pytest.approx(1e-9 * PEAK[kind], rel=1e-2)
    assert found[0].factor is None


@pytest.mark.parametrize("first", [True, False])
def test_a_jump_is_measured_by_the_largest_value_of_the_whole_motion(first: bool) -> None:
    """Half a billionth of the peak, which another move reaches: that one goes to 2000, and this one from 1 to 2."""
    small, large = with_jump("position", 0.5e-9 * 2000), between([1.0], [2000.0], [1.0])
    moves = (large, small) if first else (small, large)
    assert check_continuity(trajectory(*moves), [LIMITED, LIMITED]) == []
    quick = between(
        [2000.0], [1.0], [2000.0], duration=1.0
    )  # another joint, which is no measure of the first
    rows = np.concatenate([small.coefficients, quick.coefficients], axis=2)
    (found,) = check_continuity(trajectory(PiecewisePolynomial(small.breaks, rows)), [limits(2, jerk=1e9)])
    assert (found.kind, found.joint) == ("position_jump", "j1")


def test_a_valid_motion_has_no_jumps() -> None:
    for conditions in (3, 4):
        curve = between(
            [1.0, 0.0, 3.0], [-2.0, 0.0, 3.1], [0.4, 0.0, 3.1], duration=0.37, conditions=conditions
        )
        assert judge(curve, limits(3, jerk=1e9)) == []
        assert steps_of(trajectory(curve)) == []


def test_a_step_in_acceleration_is_legal_where_no_jerk_limit_is() -> None:
    curve = with_jump("acceleration", 0.25)
    assert judge(curve, FREE) == []
    assert judge(curve, limits(velocity=100.0, acceleration=100.0)) == []
    for one_sided in (LIMITED, limits(jerk=(-np.inf, 5e3)), limits(jerk=(-5e3, np.inf))):
        found = judge(curve, one_sided)
        assert [(f.kind, f.time, f.hint) for f in found] == [("acceleration_jump", 1.0, JERK_HINT)]
        assert found[0].value == pytest.approx(0.25)
    whole = trajectory(curve, end=declared_end(curve))
    steps = steps_of(whole)
    assert [(s.move, s.joint, s.time) for s in steps] == [(0, "j1", 1.0)]
    assert steps[0].size == pytest.approx(0.25)
    assert steps_of(whole, [FREE]) == steps
    assert steps_of(whole, [LIMITED]) == []


def test_joints_are_judged_one_by_one() -> None:
    curve = between([0.0, 1.0, 2.0], [1.0, 1.0, 3.0], duration=1.0, conditions=2)
    bounds = limits(3, jerk=np.array([[-np.inf, np.inf], [-9.0, 9.0], [-9.0, 9.0]]))
    whole = trajectory(curve)
    assert [(f.joint, f.kind, f.time) for f in check_continuity(whole, [bounds])] == [
        ("j3", "acceleration_jump", 0.0)
    ]
    assert [(s.joint, s.time, round(s.size, 9)) for s in steps_of(whole, [bounds])] == [
        ("j1", 0.0, 6.0),
        ("j1", 1.0, 6.0),
    ]


def test_the_start_must_be_where_the_arm_is() -> None:
    curve = between([1.0], [2.0])
    for declared, kind, value in (
        (state([1.1]), "position_jump", -0.1),
        (state([1.0], velocity=0.3), "velocity_jump", -0.3),
        (state([1.0], acceleration=0.7), "acceleration_jump", -0.7),
    ):
        found = check_continuity(trajectory(curve, start=declared), [LIMITED])
        assert [(f.move, f.kind, f.time) for f in found] == [(0, kind, 0.0)]
        assert found[0].value == pytest.approx(value)
    assert check_continuity(trajectory(curve, start=state([1.0], acceleration=0.7)), [FREE]) == []


def test_the_end_must_be_what_the_last_move_declares() -> None:
    curve = between([1.0], [2.0])
    for declared, kind, value in (
        (state([2.1]), "position_jump", 0.1),
        (state([2.0], velocity=-0.3), "velocity_jump", -0.3),
        (state([2.0], acceleration=0.7), "acceleration_jump", 0.7),
    ):
        found = check_continuity(trajectory(curve, curve_at(2.0), end=declared), [LIMITED, LIMITED])
        assert [(f.move, f.kind, f.time) for f in found] == [(1, kind, 5.0)]
        assert found[0].value == pytest.approx(value)


def curve_at(position: float) -> PiecewisePolynomial:
    return constant([position], 3.0)


def test_a_motion_that_begins_in_an_accelerating_arm_does_not_step() -> None:
    parabola = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.5, 3.0])[:, None, None])
    whole = trajectory(parabola, start=state([3.0], 0.5, 2.0), end=state([4.5], 2.5, 2.0))
    assert check_continuity(whole, [LIMITED]) == []
    assert steps_of(whole) == []


def test_a_jump_at_a_border_is_the_later_moves() -> None:
    first, second = between([0.0], [1.0]), between([1.5], [2.0])
    found = check_continuity(trajectory(first, second), [FREE, FREE])
    assert [(f.move, f.kind, f.time, f.value) for f in found] == [
        (1, "position_jump", 2.0, pytest.approx(0.5))
    ]


def cubics(*positions: float) -> list[PiecewisePolynomial]:
    return [between([a], [b], duration=1.0, conditions=2) for a, b in pairwise(positions)]


def test_a_step_at_a_border_is_a_finding_where_either_move_steps_and_limits_its_jerk() -> None:
    cubic, quintic = cubics(0.0, 1.0)[0], between([1.0], [2.0], duration=1.0)

    def moves_found(moves, bounds):
        return sorted((f.move, f.time) for f in check_continuity(trajectory(*moves), bounds))

    assert moves_found([cubic, quintic], [FREE, LIMITED]) == []
    assert moves_found([cubic, quintic], [LIMITED, FREE]) == [(0, 0.0)]
    steps = steps_of(trajectory(cubic, quintic), [FREE, LIMITED])
    assert [(s.move, s.time) for s in steps] == [(0, 0.0), (0, 1.0)]
    back = between([1.0], [0.0], duration=1.0)
    assert moves_found([back, cubic], [LIMITED, FREE]) == []
    assert moves_found([back, cubic], [FREE, LIMITED]) == [(1, 1.0)]
    ramp_up = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0, 0, 0])[:, None, None])
    after = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, -3.0, 3.0, 1.0])[:, None, None])
    assert moves_found([ramp_up, after], [LIMITED, FREE]) == [(0, 1.0)]
    assert moves_found([ramp_up, after], [FREE, LIMITED]) == [(1, 1.0)]
    assert moves_found([ramp_up, after], [LIMITED, LIMITED]) == [(1, 1.0)]
    assert moves_found([ramp_up, after], [FREE, FREE]) == []


def test_an_acceleration_of_a_rounding_is_zero() -> None:
    """The cubic steps down to what is left of zero: the step stays its own, and the quintic is not blamed."""
    quintic = between([1.0], [2.0], duration=1.0)
    coefficients = quintic.coefficients.copy()
    coefficients[3] += 1e-13
    whole = trajectory(cubics(0.0, 1.0)[0], PiecewisePolynomial(quintic.breaks, coefficients))
    assert check_continuity(whole, [FREE, LIMITED]) == []
    assert [s.move for s in steps_of(whole)] == [0, 0]


@pytest.mark.parametrize(
    ("share", "owned"), [(0.4, False), (0.6, True), (1.8, True), (-0.4, False), (-1.8, True)]
)
@pytest.mark.parametrize("later", [True, False])
def test_half_of_what_rounding_explains_is_an_acceleration_of_zero(
    later: bool, share: float, owned: bool
) -> None:
    """The cubic, whose acceleration is 6 at its ends, is free; the quintic ends, or begins, with nearly none."""
    states = np.zeros((3, 2, 1))
    states[0] = [[1.0], [2.0]]
    states[2, 0 if later else 1] = share * 6e-9
    quintic = hermite_pieces([0.0, 1.0], states)
    if later:
        whole = trajectory(cubics(0.0, 1.0)[0], quintic)
        found = check_continuity(whole, [FREE, LIMITED])
    else:
        whole = trajectory(quintic, cubics(2.0, 3.0)[0])
        found = check_continuity(whole, [LIMITED, FREE])
    assert [(each.move, each.kind) for each in found] == [(int(later), "acceleration_jump")] * owned


def test_a_move_joined_with_the_same_acceleration_does_not_step() -> None:
    parts = [
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0, 0.0])[:, None, None]),
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 2.0, 1.0])[:, None, None]),
    ]
    whole = trajectory(*parts, end=state([4.0], 4.0))
    assert [(s.time, s.size, s.move) for s in steps_of(whole)] == [(0.0, 2.0, 0), (2.0, -2.0, 1)]


def test_the_largest_of_many_steps_is_named_and_of_equal_ones_the_first() -> None:
    heights = [0.0, 1.0, 1.0, 4.0, 6.0]
    curve = between(*([h] for h in heights), duration=1.0, conditions=2)
    found = check_continuity(trajectory(curve), [LIMITED])
    assert [(f.time, f.value) for f in found] == [(3.0, pytest.approx(30.0))]
    even = between([0.0], [1.0], [1.0], [2.0], duration=1.0, conditions=2)
    assert [f.time for f in check_continuity(trajectory(even), [LIMITED])] == [0.0]
    nearly = between([0.0], [1.0], [1.0], [2.0 + 1e-14], duration=1.0, conditions=2)
    assert [f.time for f in check_continuity(trajectory(nearly), [LIMITED])] == [0.0]
    assert [s.time for s in steps_of(trajectory(even))] == [0.0, 1.0, 2.0, 3.0]


def steep_trapezoid(acceleration: float, length: float = 1.0) -> PiecewisePolynomial:
    """Return one unit of travel at unit speed between ramps of 1 / acceleration."""
    ramp = 1.0 / acceleration
    pieces = [[acceleration / 2, 0.0, 0.0], [0.0, 1.0, ramp / 2], [-acceleration / 2, 1.0, ramp / 2 + length]]
    breaks = np.array([0.0, ramp, ramp + length, 2 * ramp + length])
    return PiecewisePolynomial(breaks, np.array(pieces).T[:, :, None])


@pytest.mark.parametrize("acceleration", [1e3, 1e9, 1e13, 1e15])
def test_a_steep_ramp_is_not_a_jump(acceleration: float) -> None:
    curve = steep_trapezoid(acceleration)
    whole = trajectory(curve, end=state([1.0 + 1 / acceleration]))
    assert check_continuity(whole, [FREE]) == []
    assert len(steps_of(whole)) == 4


@pytest.mark.parametrize("block", [1, 2, 16_384])
@pytest.mark.parametrize("speed", [1e13, -1e13])
@pytest.mark.parametrize("before", [True, False])
def test_a_position_is_late_by_the_slope_on_either_side_of_its_break(
    before: bool, speed: float, block: int, monkeypatch
) -> None:
    """By a unit in the last place of the break at 1 s, times a slope that is there on one side alone, and shortly."""
    monkeypatch.setattr(continuity, "_BLOCK", block)
    late = speed * np.spacing(1.0)
    border = 1.0 - 1e-14 if before else 1.0 + 1e-14
    way = speed * abs(border - 1.0)
    heights = [2.0, 2.0, 2.0 + way + late] if before else [2.0, 2.0 + late, 2.0 + late + way]
    breaks = np.array([0.0, *sorted([1.0, border]), 2.0])
    curve = PiecewisePolynomial(breaks, np.array([[0.0, speed, 0.0], heights])[:, :, None])
    assert [each.kind for each in judge(curve) if each.kind == "position_jump"] == []


def test_a_jump_beside_a_ramp_that_is_not_steep_is_a_jump() -> None:
    """The last ramp at 1e15 misses its end by 0.1 of the speed, which its break explains; at 1e9 nothing does."""
    steep = steep_trapezoid(1e15)
    missed = float(np.abs(steep.piece_ends(1)[1][-1, 0]))
    assert missed > 0.05
    curve = steep_trapezoid(1e9)
    found = check_continuity(trajectory(curve, end=state([1.0 + 1e-9], velocity=missed)), [FREE])
    assert [f.kind for f in found] == ["velocity_jump"]


def test_a_joint_that_rests_may_tremble_by_rounding_only() -> None:
    for size, kinds in ((5e-13, []), (2e-12, ["velocity_jump"])):
        wobble = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[size, 0.0], [3.0, 0.0]])[:, None, :])
        end = state([3.0 + size, 0.0])
        found = check_continuity(trajectory(wobble, start=state([3.0, 0.0]), end=end), [limits(2)])
        assert {f.kind for f in found} == set(kinds)


def test_a_curve_of_no_length_is_where_it_should_be() -> None:
    assert check_continuity(trajectory(constant([2.0], 0.0)), [LIMITED]) == []
    found = check_continuity(trajectory(constant([2.0], 0.0), start=state([1.0])), [LIMITED])
    assert [(f.kind, f.value) for f in found] == [("position_jump", 1.0)]


def test_moves_of_no_length_own_no_jump() -> None:
    hold = constant([1.0], 0.0)
    whole = trajectory(between([0.0], [1.0]), hold, hold, between([1.25], [2.0]), hold)
    assert [f.move for f in check_continuity(whole, [FREE] * 5)] == [3]


@pytest.mark.parametrize("units", [-2, 0, 2])
def test_a_jump_is_the_later_moves_though_borders_are_rounded(units: int) -> None:
    plain = trajectory(between([0.0], [1.0]), between([1.5], [2.0]))
    border = 2.0 + units * np.spacing(2.0)
    spans = (replace(plain.spans[0], end=border), replace(plain.spans[1], start=border))
    (found,) = check_continuity(replace(plain, spans=spans), [FREE, FREE])
    assert (found.move, found.kind, found.time) == (1, "position_jump", 2.0)


def test_times_count_from_the_start_of_the_trajectory() -> None:
    plain = trajectory(between([0.0], [1.0]), between([1.5], [2.0]))
    curve = plain.curve.shifted(-3.0)
    moved = Trajectory(curve, plain.joint_names, plain.joint_types, plain.spans, plain.start, plain.end)
    assert [(f.move, f.time) for f in check_continuity(moved, [FREE, FREE])] == [(1, 2.0)]


def test_limits_must_be_as_many_as_moves() -> None:
    with pytest.raises(ValueError, match="2 limits for 1 moves"):
        check_continuity(trajectory(between([0.0], [1.0])), [FREE, FREE])
    with pytest.raises(ValueError, match="0 limits for 1 moves"):
        acceleration_steps(trajectory(between([0.0], [1.0])), [])


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_exactly_the_jumps_that_were_put_in_are_found(data) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    joints, pieces = data.draw(st.integers(1, 3)), data.draw(st.integers(2, 6))
    duration = float(10.0 ** rng.uniform(-3, 2))
    curve = between(*rng.normal(size=(pieces + 1, joints)), duration=duration)
    coefficients, expected = curve.coefficients.copy(), set()
    split = data.draw(st.integers(1, pieces - 1))
    for row in range(1, pieces):
        kind, joint = data.draw(st.sampled_from(QUANTITIES)), data.draw(st.integers(0, joints - 1))
        order = QUANTITIES.index(kind)
        peak = np.abs(curve.evaluate(np.linspace(0, curve.end, 999), order)).max(axis=0)[joint]
        size = data.draw(st.sampled_from([0.0, 1e-11, 1e-7, -1e-4])) * peak
        assume(abs(size) <= 1e-11 * peak or abs(size) > 1e-11)
        coefficients[:, row, joint] += bump(kind, size, duration)
        if abs(size) > 1e-9 * peak:
            expected.add((1 if row >= split else 0, f"j{joint + 1}", f"{kind}_jump"))
    parts = [
        PiecewisePolynomial(curve.breaks[a : b + 1] - curve.breaks[a], coefficients[:, a:b])
        for a, b in ((0, split), (split, pieces))
    ]
    found = check_continuity(trajectory(*parts, end=declared_end(curve)), [limits(joints, jerk=1e9)] * 2)
    assert {(f.move, f.joint, f.kind) for f in found} == expected
    assert len(found) == len(expected)
    for finding in found:
        nearest = np.abs(curve.breaks - finding.time).min()
        assert nearest <= 1e-12 * curve.end


@pytest.mark.parametrize("block", [1, 2, 3, 16_384])
@pytest.mark.parametrize("at", range(5))
@pytest.mark.parametrize("order", range(3))
def test_a_jump_at_any_break_is_found_and_has_its_time(order: int, at: int, block: int, monkeypatch) -> None:
    """Four pieces at rest but for one derivative that jumps by 1; at the start and at the end against the states."""
    monkeypatch.setattr(continuity, "_BLOCK", block)
    rows = np.zeros((3, 4, 2))
    rows[2 - order, at:, 1] = 1.0 if order < 2 else 0.5
    for k in range(4):  # what follows from it
        if order > 0:
            q, v = (rows[2, k, 1], rows[1, k, 1])
            following = np.array([q + v * 0.5 + rows[0, k, 1] * 0.25, v + rows[0, k, 1]])
            if k < 3:
                rows[2, k + 1, 1] = following[0]
                rows[1, k + 1, 1] = following[1] if order == 2 else rows[1, k + 1, 1]
    curve = PiecewisePolynomial(0.5 * np.arange(5.0), rows)
    end = [curve.piece_ends(k)[1][-1].copy() for k in range(3)]
    if at == 4:
        end[order][1] += 1.0
    whole = trajectory(curve, start=state([0.0, 0.0]), end=State(*end))
    (found,) = check_continuity(whole, [limits(2, jerk=1e9)])
    assert (found.kind, found.joint, found.move) == (f"{QUANTITIES[order]}_jump", "j2", 0)
    assert [found.time, found.value] == pytest.approx([0.5 * at, 1.0])
    for name in ("value", "limit"):
        assert (found.amounts[name].order, found.amounts[name].joint, found.amounts["joint"]) == (
            order,
            1,
            "j2",
        )
    steps = [(step.time, step.joint, step.size) for step in acceleration_steps(whole, [limits(2)])]
    assert steps == ([(pytest.approx(0.5 * at), "j2", pytest.approx(1.0))] if order == 2 else [])


def test_steps_count_from_the_start_of_the_curve() -> None:
    rows = np.zeros((3, 2, 1))
    rows[0, 1] = 0.5
    curve = PiecewisePolynomial(np.array([3.0, 4.0, 5.0]), rows)
    end = State(*(curve.piece_ends(k)[1][-1] for k in range(3)))
    whole = replace(trajectory(PiecewisePolynomial(curve.breaks - 3.0, rows), end=end), curve=curve)
    assert [step.time for step in steps_of(whole)] == [1.0]


def test_a_step_between_two_accelerations_is_the_later_moves() -> None:
    """t^3 up to 6 at 1 s, and from there with -6: both sides are none, whichever move comes first in the list."""
    parts = [
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0, 0.0, 0.0])[:, None, None]),
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, -3.0, 3.0, 1.0])[:, None, None]),
    ]
    whole = trajectory(*parts)
    assert [(s.move, s.time, s.size) for s in steps_of(whole)] == [(1, 1.0, pytest.approx(-12.0))]


def test_moves_are_named_by_their_index_and_not_by_their_place() -> None:
    plain = trajectory(between([0.0], [1.0]), *cubics(1.5, 2.0))
    spans = tuple(replace(span, index=span.index + 3) for span in plain.spans)
    whole = replace(plain, spans=spans)
    assert [(f.move, f.kind) for f in check_continuity(whole, [FREE, LIMITED])] == [
        (4, "position_jump"),
        (4, "acceleration_jump"),
    ]
    assert [s.move for s in steps_of(whole)] == [4, 4]


@pytest.mark.filterwarnings("ignore:invalid value encountered in maximum")
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("at_end", [True, False])
def test_a_declared_state_that_is_no_number_is_not_met(value: float, at_end: bool) -> None:
    plain = trajectory(between([0.0], [1.0]))
    name = "end" if at_end else "start"
    (found,) = check_continuity(replace(plain, **{name: state([value])}), [FREE])
    assert (found.kind, found.time) == ("position_jump", 2.0 if at_end else 0.0)


def test_each_joint_of_each_move_has_its_own_jump_and_what_rounding_explains_of_it() -> None:
    """Three moves of three joints that each begin 0.1 further on; the joints go 1, 10 and 100 far."""
    ways = np.array([1.0, 10.0, 100.0])
    moves = [between(list(0.1 + 1.1 * k * ways), list(0.1 + (1.1 * k + 1) * ways)) for k in range(3)]
    whole = trajectory(*moves, start=state([0.0, 0.0, 0.0]))
    found = check_continuity(whole, [limits(3)] * 3)
    assert [(f.move, f.joint, f.time) for f in found] == [
        (k, f"j{joint}", 2.0 * k) for k in range(3) for joint in (1, 2, 3)
    ]
    assert [f.value for f in found] == pytest.approx([0.1] * 3 + [*(0.1 * ways)] * 2)
    furthest = 0.1 + 3.2 * ways
    assert [f.limit for f in found] == pytest.approx([*(1e-9 * furthest)] * 3, rel=1e-2)


@pytest.mark.parametrize("begins", [0.0, 1e6])
@pytest.mark.parametrize(("units", "found"), [(1.0, 0), (6.0, 1)])
def test_breaks_are_as_exact_as_the_time_at_which_they_stand(units: float, found: int, begins: float) -> None:
    """A ramp of some units in the last place of its times, and a position that is late by one of them, or by six."""
    unit = np.spacing(begins + 1.0)
    speed = 1e-4 / unit
    late = units * 1e-4
    breaks = begins + 1.0 + unit * np.array([0.0, 8.0])
    curve = PiecewisePolynomial(
        np.array([begins, *breaks, begins + 2.0]),
        np.array([[0.0, speed, 0.0], [2.0, 2.0 + late, 2.0 + late + 8e-4]])[:, :, None],
    )
    plain = between([0.0], [1.0])
    whole = replace(trajectory(plain, start=state([2.0]), end=state([2.0 + late + 8e-4])), curve=curve)
    told = [each for each in check_continuity(whole, [FREE]) if each.kind == "position_jump"]
    assert len(told) == found
    for each in told:
        assert each.time == pytest.approx(1.0)
        assert "at t = 1 s" in each.text()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("more", "time"), [(1e-14, 1.0), (1e-9, 2.0)])
def test_a_jump_that_is_larger_by_more_than_rounding_is_the_larger_one(
    more: float, time: float, sign: float
) -> None:
    """Half a radian forth and a little more back."""
    levels = sign * np.array([0.0, 0.5, -0.5 * more])
    found = judge(PiecewisePolynomial(np.arange(4.0), levels[None, :, None]))
    assert [(each.kind, each.time) for each in found] == [("position_jump", time)]


@pytest.mark.parametrize("first", [0, 1])
def test_at_a_border_one_joint_steps_to_rest_and_another_one_from_rest(first: int) -> None:
    """Cubics of one joint up to the border, and of the other behind it: each step is of the move that has it."""
    moving = cubics(0.0, 1.0)[0].coefficients[:, 0, 0]
    rows = np.zeros((4, 2, 2))
    rows[:, 0, first], rows[:, 1, 1 - first], rows[3, 1, first] = moving, moving, 1.0
    parts = [PiecewisePolynomial(np.array([0.0, 1.0]), rows[:, [k]]) for k in range(2)]
    whole = trajectory(*parts)
    found = check_continuity(whole, [limits(2, jerk=1e9)] * 2)
    names = [f"j{first + 1}", f"j{2 - first}"]
    assert [(each.move, each.joint, each.time) for each in found] == [(0, names[0], 0.0), (1, names[1], 1.0)]
    steps = [(step.time, step.joint, step.move) for step in steps_of(whole)]
    assert sorted(steps) == [
        (0.0, names[0], 0),
        *sorted([(1.0, names[0], 0), (1.0, names[1], 1)]),
        (2.0, names[1], 1),
    ]
