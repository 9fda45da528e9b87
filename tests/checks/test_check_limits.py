"""Motions that break a limit by very little, or in one place, direction or side only."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import KINDS, between, limits, sampled_peaks, single_pieces, trajectory

from trajcli.checks.verify import check_limits
from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.findings import Finding
from trajcli.limits.joints import peaks_by_move
from trajcli.trajectory import Trajectory

# Peaks of the septic from 0 to 1 in one second, all of them inside: t = 1/2, (1 -+ 1/sqrt 5)/2, 1/2
SEPTIC = {"velocity": 2.1875, "acceleration": 84 * math.sqrt(5) / 25, "jerk": 105 / 2}


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, findings
    return findings[0]


@pytest.mark.parametrize(("kind", "peak"), SEPTIC.items())
def test_a_limit_is_broken_two_billionths_above_it_and_not_half_a_billionth(kind: str, peak: float) -> None:
    move = trajectory(between([0.0], [1.0], duration=1.0, conditions=4))
    assert check_limits(move, [limits(**{kind: peak / (1 + 0.5e-9)})]) == []
    found = only(check_limits(move, [limits(**{kind: peak / (1 + 2e-9)})]))
    assert (found.move, found.joint, found.kind, found.method) == (0, "j1", kind, "exact")
    assert abs(found.value) == pytest.approx(peak, rel=1e-13)
    assert abs(found.limit) == peak / (1 + 2e-9)
    assert 0 < found.time < 1
    assert move.curve.evaluate(found.time, KINDS.index(kind))[0] == pytest.approx(found.value, rel=1e-12)


@pytest.mark.parametrize("over", [2e-9, 0.5e-9])
def test_a_position_may_not_pass_its_limit_between_the_ends(over: float) -> None:
    curve = PiecewisePolynomial(
        np.array([0.0, 4.0]), np.array([0.625, -5.625, 12.5, 5, 0, 10])[:, None, None]
    )
    top = -minimum(curve)
    found = check_limits(trajectory(curve), [limits(position=(0.0, top / (1 + over)))])
    assert [f.kind for f in found] == (["position"] if over > 1e-9 else [])
    if found:
        assert found[0].factor is None
        assert found[0].value == pytest.approx(top, rel=1e-12)
        assert 3 < found[0].time < 4


def minimum(curve: PiecewisePolynomial) -> float:
    return float(-sampled_peaks(curve, 0)[0, 1])


@pytest.mark.parametrize(("kind", "order"), [("velocity", 1), ("acceleration", 2), ("jerk", 3)])
def test_the_factor_is_the_stretch_after_which_the_limit_holds(kind: str, order: int) -> None:
    bound = {kind: SEPTIC[kind] / 1.7}
    found = only(
        check_limits(trajectory(between([0.0], [1.0], duration=1.0, conditions=4)), [limits(**bound)])
    )
    assert found.factor == pytest.approx(1.7 ** (1 / order), rel=1e-12)
    for duration, broken in ((found.factor, False), (found.factor * 0.999, True)):
        longer = trajectory(between([0.0], [1.0], duration=duration, conditions=4))
        assert bool(check_limits(longer, [limits(**bound)])) is broken


@pytest.mark.parametrize("displacement", [1.0, -1.0])
@pytest.mark.parametrize("narrow", ["up", "down"])
def test_a_bound_by_direction_binds_in_its_direction_only(displacement: float, narrow: str) -> None:
    move = trajectory(between([0.0], [displacement], duration=1.0))
    pair = (-3.0, 1.0) if narrow == "up" else (-1.0, 3.0)
    found = check_limits(move, [limits(velocity=pair)])
    if (displacement > 0) == (narrow == "up"):
        assert only(found).value == pytest.approx(1.875 * displacement)
        assert only(found).limit == displacement
        assert only(found).factor == pytest.approx(1.875)
    else:
        assert found == []


def test_of_both_directions_the_worse_is_named() -> None:
    move = trajectory(between([0.0], [1.0], duration=1.0))
    peak = 10 / math.sqrt(3)
    found = only(check_limits(move, [limits(acceleration=(-2.0, 4.0))]))
    assert (found.value, found.limit) == (pytest.approx(-peak), -2.0)
    found = only(check_limits(move, [limits(acceleration=(-4.0, 2.0))]))
    assert (found.value, found.limit) == (pytest.approx(peak), 2.0)
    found = only(check_limits(move, [limits(position=(0.1, 0.7))]))
    assert (found.value, found.limit, found.time) == (pytest.approx(1.0), 0.7, 1.0)


def test_the_left_side_of_a_break_is_seen() -> None:
    """Acceleration rises to 5 and falls to 0 at the break, where the right side is as slow as can be."""
    ramp = PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0]), np.array([[[5 / 6], [0]], [[0], [0]], [[0], [2.5]], [[0], [5 / 6]]])
    )
    found = only(check_limits(trajectory(ramp), [limits(acceleration=4.0)]))
    assert (found.value, found.time, found.limit) == (pytest.approx(5.0), 1.0, 4.0)
    assert check_limits(trajectory(ramp), [limits(acceleration=5.0)]) == []
    mirrored = PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0]), np.array([[[0], [-5 / 6]], [[0], [2.5]], [[0.0], [0]], [[0], [0]]])
    )
    assert only(check_limits(trajectory(mirrored), [limits(acceleration=4.0)])).time == 1.0


def test_each_move_is_judged_by_its_own_limits_and_its_own_side_of_the_border() -> None:
    fast, slow = (
        between([0.0], [1.0], duration=1.0, conditions=2),
        between([1.0], [1.5], duration=2.0, conditions=2),
    )
    whole = trajectory(fast, slow)
    tight, wide = limits(acceleration=1.0), limits(acceleration=7.0)
    assert check_limits(whole, [wide, tight]) == []
    found = only(check_limits(whole, [tight, wide]))
    assert (found.move, found.value, found.time) == (0, pytest.approx(6.0), 0.0)
    backwards = trajectory(slow, fast)
    found = only(check_limits(backwards, [tight, limits(acceleration=5.0)]))
    assert (found.move, found.value, found.time) == (1, pytest.approx(6.0), 2.0)


def test_borders_that_rounding_moved_do_not_mix_the_moves() -> None:
    durations = [0.1, 0.2, 0.3, 0.7, 1e-3, 0.6]
    moves = [between([0.0], [(-1) ** k * T**2], duration=T, conditions=2) for k, T in enumerate(durations)]
    whole = trajectory(*moves)
    late = [np.nextafter(span.end, 9.0) for span in whole.spans]
    spans = [
        type(span)(span.index, span.planner, start, end, 1)
        for span, (start, end) in zip(whole.spans, pairwise([0.0, *late]), strict=True)
    ]
    moved = Trajectory(
        whole.curve, whole.joint_names, whole.joint_types, tuple(spans), whole.start, whole.end
    )
    for of_span in peaks_by_move(moved):
        assert of_span[2].magnitude == pytest.approx(6.0, rel=1e-9)
        assert (of_span[2].high[0] > 0) & (of_span[2].low[0] < 0)


def test_times_count_from_the_start_of_the_trajectory() -> None:
    move = trajectory(between([0.0], [1.0], duration=1.0))
    later = Trajectory(
        move.curve.shifted(-3.0), move.joint_names, move.joint_types, move.spans, move.start, move.end
    )
    assert only(check_limits(later, [limits(velocity=1.0)])).time == pytest.approx(0.5)


def test_a_move_of_no_length_has_a_position_and_a_velocity() -> None:
    still = trajectory(constant([2.0], 0.0))
    assert [f.kind for f in check_limits(still, [limits(position=1.0, velocity=1.0)])] == ["position"]
    ramp = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([5.0, 0.0, 0.0])[:, None, None])
    whole = trajectory(
        ramp,
        constant([5.0], 0.0),
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([-5.0, 10.0, 5.0])[:, None, None]),
    )
    found = only(check_limits(whole, [limits(), limits(velocity=9.0, acceleration=1.0), limits()]))
    assert (found.move, found.kind, found.time, found.factor) == (1, "velocity", 1.0, None)


def test_limits_must_be_as_many_as_moves() -> None:
    with pytest.raises(ValueError, match="0 limits for 1 moves"):
        check_limits(trajectory(between([0.0], [1.0])), [])


@st.composite
def judged(draw):
    """Return a random trajectory with limits, and what is wrong with it by a refined search over samples."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    joints, moves = draw(st.integers(1, 2)), []
    for _ in range(draw(st.integers(1, 2))):
        pieces, degree = int(rng.integers(1, 3)), int(rng.integers(0, 8))
        lengths = 10.0 ** rng.uniform(-3, 2) * rng.uniform(0.2, 1.0, pieces)
        powers = lengths ** np.arange(degree, -1, -1)[:, None]
        breaks = np.concatenate([[0.0], np.cumsum(lengths)])
        moves.append(
            PiecewisePolynomial(breaks, rng.normal(size=(degree + 1, pieces, joints)) / powers[:, :, None])
        )
    closeness = draw(st.sampled_from([0.3, 1e-3, 1e-7]))
    limits_by_move, expected = [], set()
    for index, move in enumerate(moves):
        bounds = {}
        for order, kind in enumerate(KINDS):
            peaks = np.stack([sampled_peaks(piece, order) for piece in single_pieces(move)])
            extremes = np.stack([peaks[:, :, 0].min(axis=0), peaks[:, :, 1].max(axis=0)], axis=1)
            over = rng.choice(
                [-closeness, 0.0, closeness, np.inf], size=extremes.shape, p=[0.2, 0.0, 0.6, 0.2]
            )
            room = np.maximum(np.abs(extremes), 1e-3 * np.abs(extremes).max() + 1e-3)
            free = extremes + np.array([-1, 1]) * over * room
            if order:
                free = np.where(free * np.array([-1, 1]) > 0, free, np.array([-1, 1]) * room)
            free = np.where(free[:, :1] <= free[:, 1:], free, extremes + np.array([-1, 1]) * room)
            bounds[kind] = free
            for joint in np.flatnonzero((extremes[:, 0] < free[:, 0]) | (extremes[:, 1] > free[:, 1])):
                expected.add((index, f"j{joint + 1}", kind))
        limits_by_move.append(limits(**bounds))
    return trajectory(*moves), limits_by_move, expected


@settings(max_examples=60, deadline=None)
@given(judged())
def test_exactly_the_violations_of_a_refined_search_are_found(case) -> None:
    whole, limits_by_move, expected = case
    found = check_limits(whole, limits_by_move)
    assert {(f.move, f.joint, f.kind) for f in found} == expected
    assert len(found) == len(expected)
    for finding in found:
        span, order = whole.spans[finding.move], KINDS.index(finding.kind)
        joint = whole.joint_names.index(finding.joint)
        assert span.start <= finding.time <= span.end
        sides = [whole.curve.evaluate(finding.time, order, side=side)[joint] for side in ("left", "right")]
        assert min(abs(side - finding.value) for side in sides) <= 1e-6 * abs(finding.value)
        bounds = limits_by_move[finding.move].of_order(order)[joint]
        assert finding.value > bounds[1] or finding.value < bounds[0]
        assert finding.limit in bounds
