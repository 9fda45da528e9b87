"""What a peer's motion breaks and uses of limits, and what is said of it: on polynomials whose extremes are known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_peer_lower_bound import limits, state

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Joint, Robot
from trajcli.peers import move_reference
from trajcli.peers.lower_bound import LowerBound, NoBound
from trajcli.peers.move_reference import bound_report, contradictions_of, is_faster, reference_of
from trajcli.peers.path_reference import LimitBreach, LimitUse, breaches_of, limit_use
from trajcli.trajectory import Span

START = 2.0


def swing(joint: int, side: float) -> PiecewisePolynomial:
    """Return a curve of two joints from 2 s to 5 s: q = u^3 - 3 u^2 with u from 0 to 3, on one side, and a still joint."""
    coefficients = np.zeros((4, 1, 2))
    coefficients[:2, 0, joint] = np.array([1.0, -3.0]) * side
    return PiecewisePolynomial(np.array([START, START + 3.0]), coefficients)


WORST = {0: (-4.0, 2.0), 1: (9.0, 3.0), 2: (12.0, 3.0), 3: (6.0, 0.0)}
"""Of the swing: position -4 at u = 2; velocity 9 and acceleration 12 at u = 3; the jerk is 6."""


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_a_limit_of_either_side_is_broken_where_the_curve_is_beyond_it_most(
    order: int, side: float, joint: int
) -> None:
    curve, (value, u) = swing(joint, side), WORST[order]
    value *= side
    names = ("position", "velocity", "acceleration", "jerk")
    given = replace(limits([1e3] * 2, [1e3] * 2, [1e3] * 2), position=np.tile([-1e3, 1e3], (2, 1)))
    for bound, broken in ((abs(value) * (1 - 1e-6), True), (abs(value), False), (abs(value) + 1e-13, False)):
        rows = getattr(given, names[order]).copy()
        rows[joint, int(value > 0)] = np.copysign(bound, value)
        found = breaches_of(curve, replace(given, **{names[order]: rows}), (0, 1, 2, 3))
        if not broken:
            assert found == ()
            continue
        (breach,) = found
        assert (breach.order, breach.joint) == (order, joint)
        assert (breach.value, breach.limit) == (pytest.approx(value), pytest.approx(value, rel=2e-6))
        assert breach.time == pytest.approx(u)
    both = getattr(given, names[order]).copy()
    both[joint] = np.array([-0.1, 0.1])
    both[1 - joint] = np.array([-0.1, 0.1])
    (breach,) = breaches_of(curve, replace(given, **{names[order]: both}), (order,))
    assert breach.value == pytest.approx(value)  # the worse side, whichever comes first


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("velocity", "acceleration", "expected"),
    [
        (18.0, 48.0, ("velocity", 0.5, 3.0)),
        (72.0, 48.0, ("acceleration", 0.25, 3.0)),
        (np.inf, 48.0, ("acceleration", 0.25, 3.0)),
        (36.0, np.inf, ("velocity", 0.25, 3.0)),
    ],
)
def test_the_limit_that_is_used_most(
    velocity: float, acceleration: float, expected: tuple[Any, float, float], side: float, joint: int
) -> None:
    given = limits([velocity] * 2, [acceleration] * 2)
    quantity, used, u = expected
    found = limit_use(swing(joint, side), given)
    assert found == LimitUse(quantity, joint, pytest.approx(used), pytest.approx(u))  # type: ignore[arg-type]
    # the other direction alone: the velocity falls to -3 at u = 1, the acceleration begins at -6
    loose = {"velocity": limits([1e9] * 2, [1e9] * 2).velocity.copy()}
    loose["velocity"][:, int(side < 0)] = -side * 6.0
    found = limit_use(swing(joint, side), replace(limits([1e9] * 2, [1e9] * 2), **loose))
    assert found == LimitUse("velocity", joint, pytest.approx(0.5), pytest.approx(1.0))  # type: ignore[arg-type]


def test_nothing_is_used_of_limits_that_are_none() -> None:
    assert limit_use(swing(0, 1.0), limits([np.inf] * 2, [np.inf] * 2)) is None


RAIL = Robot(
    "r", (Joint("turn"), Joint("rail", "prismatic")), limits([2.0] * 2, [4.0] * 2), None, np.eye(4), np.eye(4)
)


def test_a_bound_is_reported_with_its_joint_its_ratio_and_the_units_of_what_is_broken() -> None:
    breaches = (LimitBreach(2, 1, -3.0, -2.0, 0.5), LimitBreach(0, 0, 1.5, 1.0, 0.25))
    found = bound_report(LowerBound(2.0, 1, breaches), 3.0, RAIL)
    assert (found.duration, found.ratio, found.joint, found.reason) == (2.0, 1.5, "rail", None)
    said = [(v.joint, v.quantity, v.value, v.limit, v.unit, v.time) for v in found.violations]
    assert said == [
        ("rail", "acceleration", -3.0, -2.0, "m/s^2", 0.5),
        ("turn", "position", 1.5, 1.0, "rad", 0.25),
    ]
    none = bound_report(LowerBound(0.0, None), 3.0, RAIL)
    assert (none.duration, none.ratio, none.joint) == (0.0, None, None)
    unknown = bound_report(NoBound("its velocity is unlimited", 1), 3.0, RAIL)
    assert (unknown.duration, unknown.ratio, unknown.joint) == (None, None, "rail")
    assert unknown.reason == "its velocity is unlimited"


def made_move(**more: Any) -> Any:
    """Return what stands for a move by 2 rad of a joint, which takes 2 s / 2 + 2 / 4 from rest to rest."""
    start, end = state([0.0, 0.0]), state([2.0, 0.0])
    planned = {"no_lower_bound": None, "begins": None, "end": end, "via_points": None, **more}
    return SimpleNamespace(planned=SimpleNamespace(**planned), start=start, duration=3.0, robot=RAIL)


def test_a_move_is_compared_from_where_it_begins() -> None:
    """On a zone's far side it begins elsewhere than its entry; a planner may say why nothing bounds it."""
    assert reference_of(made_move()).duration == pytest.approx(1.5)
    assert reference_of(made_move(begins=state([1.0, 0.0]))).duration == pytest.approx(1.0)
    said = reference_of(made_move(no_lower_bound="it has no end of its own"))
    assert (said.duration, said.ratio, said.reason) == (None, None, "it has no end of its own")


def via(missed: float, *points: float) -> Any:
    return SimpleNamespace(
        points=np.stack([points, np.zeros(len(points))], axis=1), missed=np.array([[0.0], [missed]])
    )


def test_points_that_are_passed_count_where_they_bound_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """To 3 and back to 2, 2 s and 1 s; missed by more than rounding on either side, they bound nothing."""
    for missed, counts in ((0.0, True), (5e-13, True), (1e-11, False), (-1e-11, False)):
        found = reference_of(made_move(via_points=via(missed, 0.0, 3.0, 2.0)))
        assert (found.through_points, found.duration) == (counts, pytest.approx(3.0 if counts else 1.5))
        assert found.ratio == pytest.approx(3.0 / found.duration)
    between = reference_of(made_move(via_points=via(0.0, 0.0, 1.0, 2.0)))
    assert (between.through_points, between.duration) == (False, pytest.approx(1.5))
    breach = LimitBreach(1, 0, 3.0, 2.0, 0.1)
    monkeypatch.setattr(move_reference, "fastest_duration", lambda *_: LowerBound(1.5, 0, (breach,)))
    found = reference_of(made_move(via_points=via(0.0, 0.0, 3.0, 2.0)))
    assert [violation.value for violation in found.violations] == [3.0]


def test_each_move_that_is_too_fast_is_found_with_its_place_and_its_factor() -> None:
    spans = [Span(k + 5, "made", 2.0 * k, 2.0 * k + 1.5, 1) for k in range(4)]
    bounds = [bound_report(LowerBound(d, 1), 1.5, RAIL) for d in (1.5 * (1 + 1e-5), 1.5 * (1 + 1e-7), 3.0)]
    found = contradictions_of(spans, [*bounds, None])
    assert [(f.move, f.kind, f.value, f.time, f.joint, f.unit) for f in found] == [
        (5, "reference", 1.5, 1.5, "rail", "s"),
        (7, "reference", 1.5, 5.5, "rail", "s"),
    ]
    assert [f.factor for f in found] == [pytest.approx(1 + 1e-5), 2.0]
    assert [f.limit for f in found] == [1.5 * (1 + 1e-5), 3.0]
    assert not is_faster(0.0, 1.0)
    assert not is_faster(1.0, 1.0)
