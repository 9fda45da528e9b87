"""Joints a hair from their limits: what retiming sees of them, and what is said of states and findings."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from trajcli.curves.extrema import Peaks
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import Amount, PlanningError
from trajcli.findings import Finding
from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.limits import joints, velocity_by_position
from trajcli.limits.joints import JointSurvey
from trajcli.trajectory import State

END, D, OFFSET = 2.0, 6.0, 0.3
UNLIMITED = np.array([[-np.inf, np.inf]])


def of_velocity(low: float, high: float) -> Limits:
    return Limits(UNLIMITED, np.array([[low, high]]), UNLIMITED, UNLIMITED)


def of_position() -> Limits:
    bounds = Limits(np.array([[-END, END]]), UNLIMITED, UNLIMITED, UNLIMITED)
    return dataclasses.replace(bounds, velocity_by_position=np.array([[D, OFFSET]]))


def one_joint(limits: Limits) -> Robot:
    return Robot("one", (Joint("j1", "revolute"),), limits, None, np.eye(4), np.eye(4))


def survey(low: float, high: float, limits: Limits) -> JointSurvey:
    still = Peaks(*(np.zeros(1) for _ in range(4)))
    moving = Peaks(np.array([low]), np.array([0.1]), np.array([high]), np.array([0.2]))
    return JointSurvey((still, moving, still, still), limits)


@pytest.mark.parametrize("share", [1 - 1e-9, 1.0, 1 + 0.5e-10])
@pytest.mark.parametrize("side", ["low", "high"])
def test_a_motion_at_its_limit_is_not_stretched(share: float, side: str) -> None:
    at = survey(*((-share, 1e-3) if side == "low" else (-1e-3, 2 * share)), of_velocity(-1.0, 2.0))
    assert at.excess() < 0


@pytest.mark.parametrize("side", ["low", "high"])
def test_a_motion_over_its_limit_by_less_than_a_finding_is_stretched_in_either_direction(side: str) -> None:
    share = 1 + 2e-10
    over = survey(*((-share, 1e-3) if side == "low" else (-1e-3, 2 * share)), of_velocity(-1.0, 2.0))
    assert 0.9e-10 < over.excess() < 1.1e-10
    assert not list(over.over(one_joint(of_velocity(-1.0, 2.0))))


@pytest.mark.parametrize(("velocity", "limit"), [(-0.75, -0.5), (2.5, 2.0), (-3.0, -0.5)])
def test_a_state_is_told_the_limit_of_its_own_direction(velocity: float, limit: float) -> None:
    state = State(np.zeros(1), np.array([velocity]), np.zeros(1))
    _, amounts = joints.FAMILY.why_not_in_state(one_joint(of_velocity(-0.5, 2.0)), state) or ("", {})
    assert amounts["limit"] == Amount(limit, 1, 0)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("speed", [0.75, 2.5])
def test_a_state_too_near_to_either_end_is_told_the_limit_towards_that_end(sign: int, speed: float) -> None:
    distance = 0.05
    state = State(np.array([sign * (END - distance)]), np.array([sign * speed]), np.zeros(1))
    _, amounts = velocity_by_position.FAMILY.why_not_in_state(one_joint(of_position()), state) or ("", {})
    limit = amounts["limit"]
    assert isinstance(limit, Amount)
    assert limit.order == 1
    assert limit.value == pytest.approx(sign * (np.sqrt(2 * D * distance) - OFFSET), rel=1e-9)
    assert amounts["value"] == Amount(sign * speed, 1, 0)


def too_fast() -> velocity_by_position.ApproachUse:
    return velocity_by_position.ApproachUse(
        component=0, used=1.5, velocity=1.5, limit=1.0, distance=0.1, time=3.25
    )


def found(origin: float | None) -> Finding:
    survey = velocity_by_position.ApproachSurvey((too_fast(),))
    (finding,) = survey.over(one_joint(of_position()), *([] if origin is None else [origin]))
    return finding


def test_times_of_findings_are_those_of_the_curve_unless_it_begins_elsewhere() -> None:
    assert found(None).time == 3.25
    assert found(1.0).time == 2.25


@pytest.mark.parametrize(("distance", "where"), [(0.1, "before"), (-0.1, "beyond")])
def test_a_finding_says_on_which_side_of_the_end_the_joint_is(distance: float, where: str) -> None:
    finding = velocity_by_position.approach_excess(
        one_joint(of_position()), dataclasses.replace(too_fast(), distance=distance)
    )
    assert f"{where} the end of its range" in finding.message
    assert finding.amounts["distance"] == Amount(0.1, 0, 0, dimension="angle")


@pytest.mark.parametrize("end", [END + 0.02, END - 0.001])
def test_a_path_into_the_zone_without_motion_is_refused_with_its_distance(end: float) -> None:
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[end - 1.0]]]))
    with pytest.raises(PlanningError) as caught:
        velocity_by_position.FAMILY.path_constraints(path, one_joint(of_position()))
    (problem,) = caught.value.problems
    distance = problem.amounts["distance"]
    assert isinstance(distance, Amount)
    assert 0.0 <= distance.value < OFFSET**2 / (2 * D)
    assert distance.order == 0


def test_a_velocity_is_told_in_units_of_velocity_and_a_distance_in_those_of_position() -> None:
    amounts = found(None).amounts
    orders = {name: amounts[name].order for name in ("value", "limit", "distance")}
    assert orders == {"value": 1, "limit": 1, "distance": 0}


@pytest.mark.parametrize("share", [1 + 0.5e-10, 1 + 2e-10])
def test_an_approach_is_stretched_from_a_tenth_of_the_tolerance_on(share: float) -> None:
    use = dataclasses.replace(too_fast(), used=share)
    assert (velocity_by_position.ApproachSurvey((use,)).excess() > 0) is (share > 1 + 1e-10)


def test_only_a_joint_with_such_a_limit_narrows_its_velocities() -> None:
    family = velocity_by_position.FAMILY
    assert family.narrowing(of_velocity(-1.0, 1.0), 0, 1) is None
    assert family.narrowing(of_position(), 0, 0) is None
    allowed = family.narrowing(of_position(), 0, 1)
    assert allowed is not None
    low, high = allowed(np.array([[END - 0.5], [0.5 - END]]))
    near, far = np.sqrt(2 * D * np.array([0.5, 2 * END - 0.5])) - OFFSET
    assert high == pytest.approx([near, far])
    assert low == pytest.approx([-far, -near])
