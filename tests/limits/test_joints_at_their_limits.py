"""Joints a hair from their limits: what retiming sees of them, and what is said of states and findings."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from trajcli.curves.extrema import Peaks, peaks_between
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import Amount, PlanningError
from trajcli.findings import Finding
from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.limits import joints, velocity_by_position
from trajcli.limits.joints import JointSurvey
from trajcli.limits.kinds import LimitedMove
from trajcli.trajectory import Span, State, Trajectory

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


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("limit", "rule"), [(1.0, "where its limit is"), (0.0, "where it may not move towards it")]
)
def test_a_finding_says_what_a_joint_may_do_in_the_direction_in_which_it_moves(
    limit: float, rule: str, sign: int
) -> None:
    use = dataclasses.replace(too_fast(), velocity=sign * 1.5, limit=sign * limit)
    finding = velocity_by_position.approach_excess(one_joint(of_position()), use)
    assert rule in finding.message
    told = (finding.value, finding.limit, finding.amounts["value"].value, finding.amounts["limit"].value)
    assert told == (sign * 1.5, sign * limit, sign * 1.5, sign * limit)


@pytest.mark.parametrize("end", [END + 0.02, END - 0.001])
def test_a_path_into_the_zone_without_motion_is_refused_with_its_distance(end: float) -> None:
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[end - 1.0]]]))
    with pytest.raises(PlanningError) as caught:
        velocity_by_position.FAMILY.path_constraints(path, one_joint(of_position()))
    (problem,) = caught.value.problems
    distance = problem.amounts["distance"]
    assert isinstance(distance, Amount)
    assert problem.text().endswith(f"towards its position limit, {distance} from it, where it may not")
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


def several(count: int, bounds: Limits) -> Robot:
    return Robot("some", tuple(Joint(f"j{k}") for k in range(count)), bounds, None, np.eye(4), np.eye(4))


@pytest.mark.parametrize(
    ("low", "high", "limit"), [(-0.8, 10.1, -0.5), (-0.6, 10.3, 10.0), (-0.8, 10.3, None), (-9.0, 9.0, -0.5)]
)
def test_of_positions_beyond_both_ends_the_further_one_is_named(
    low: float, high: float, limit: float
) -> None:
    bounds = Limits(np.array([[-0.5, 10.0]]), UNLIMITED, UNLIMITED, UNLIMITED)
    still = Peaks(*(np.zeros(1) for _ in range(4)))
    beyond = Peaks(np.array([low]), np.array([0.1]), np.array([high]), np.array([0.2]))
    (found,) = JointSurvey((beyond, still, still, still), bounds).over(one_joint(bounds))
    if limit is not None:
        assert (found.limit, found.value) == (limit, low if limit < 0 else high)


@pytest.mark.parametrize("at", [0, 1])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("name", "rate"), [("velocity", 1), ("acceleration", 2)])
def test_a_joint_is_over_at_either_end_of_a_move(name: str, rate: int, sign: int, at: int) -> None:
    """By the rate that is limited, in its direction, and its own one."""
    ends = [[np.zeros(2) for _ in range(3)] for _ in range(2)]
    ends[at][rate][1] = sign * 1.5
    states = [State(*end) for end in ends]
    arm = several(2, of_velocity(-1.0, 1.0))
    assert joints.FAMILY.over_at_ends(arm, states, (name, 1, sign * 1.0))
    assert not joints.FAMILY.over_at_ends(arm, states, (name, 1, sign * 1.6))
    assert not joints.FAMILY.over_at_ends(arm, states, (name, 1, -sign * 1.0))
    assert not joints.FAMILY.over_at_ends(arm, states, (name, 0, sign * 1.0))
    other = "acceleration" if name == "velocity" else "velocity"
    assert not joints.FAMILY.over_at_ends(arm, states, (other, 1, sign * 1.0))
    assert not joints.FAMILY.over_at_ends(arm, states, ("jerk", 1, sign * 1.0))


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("order", range(3))
@pytest.mark.parametrize("value", [1.5, -0.7])
def test_one_joint_of_a_state_beyond_one_limit_is_told(value: float, order: int, joint: int) -> None:
    bounds = np.tile([-0.5, 1.0], (3, 1))
    arm = several(3, Limits(bounds, bounds, bounds, np.tile([-np.inf, np.inf], (3, 1))))
    values = [np.zeros(3) for _ in range(3)]
    assert joints.FAMILY.why_not_in_state(arm, State(*values)) is None
    values[order][joint] = value
    said = joints.FAMILY.why_not_in_state(arm, State(*values))
    assert said is not None
    assert said[1]["joint"] == f"j{joint}"
    assert said[1]["value"] == Amount(value, order, joint)
    assert said[1]["limit"] == Amount(1.0 if value > 0 else -0.5, order, joint)


def test_each_move_is_judged_by_its_own_limits_whoever_shares_them() -> None:
    """Five moves at 1.5, of which the third and the last allow only 1."""
    wide, narrow = of_velocity(-2.0, 2.0), of_velocity(-1.0, 1.0)
    curve = PiecewisePolynomial(
        np.arange(6.0), np.stack([np.full((5, 1), 1.5), 1.5 * np.arange(5.0)[:, None]])
    )
    times = np.stack([np.arange(5.0), np.arange(1.0, 6.0)], axis=1)
    peaks = peaks_between(curve, times)
    assert joints.moves_over(peaks, [wide, wide, narrow, wide, narrow]) == [2, 4]
    assert joints.moves_over(peaks, [narrow, wide, wide, narrow, wide]) == [0, 3]


@pytest.mark.parametrize("worst", [0, 1, 2])
def test_each_joint_that_is_too_fast_near_its_end_counts(worst: int) -> None:
    uses = [dataclasses.replace(too_fast(), component=k, used=0.5, velocity=0.5) for k in range(3)]
    arm = several(3, of_position())
    assert velocity_by_position.ApproachSurvey(()).excess() == -np.inf
    assert velocity_by_position.ApproachSurvey(tuple(uses)).excess() < 0
    uses[worst] = dataclasses.replace(too_fast(), component=worst, velocity=-1.5, limit=-1.0)
    one = velocity_by_position.ApproachSurvey(tuple(uses))
    assert one.excess() == pytest.approx(0.5)
    assert [found.joint for found in one.over(arm)] == [f"j{worst}"]
    every = [dataclasses.replace(too_fast(), component=k) for k in range(3)]
    assert len(list(velocity_by_position.ApproachSurvey(tuple(every)).over(arm))) == 3


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("joint", range(2))
def test_a_path_is_refused_for_the_joint_that_may_not_move_at_either_end(joint: int, sign: int) -> None:
    """Nearer than o^2 / (2 d) = 0.0075 to its end; further away it may, towards either end, if slowly."""
    bounds = Limits(*(np.tile(each, (2, 1)) for each in (np.array([[-END, END]]), *[UNLIMITED] * 3)))
    arm = several(2, dataclasses.replace(bounds, velocity_by_position=np.tile([D, OFFSET], (2, 1))))
    for near, refused in ((0.005, True), ((OFFSET + 1e-6) ** 2 / (2 * D), False), (0.01, False)):
        moved = np.full(2, 0.1)
        moved[joint] = sign * (END - near)
        path = PiecewisePolynomial(np.array([0.0, 1.0]), np.stack([moved[None], np.zeros((1, 2))]))
        if not refused:
            assert len(velocity_by_position.FAMILY.path_constraints(path, arm)) == 1
            continue
        with pytest.raises(PlanningError) as caught:
            velocity_by_position.FAMILY.path_constraints(path, arm)
        (problem,) = caught.value.problems
        assert problem.joint == problem.amounts["joint"] == f"j{joint}"
        assert problem.amounts["distance"].value == pytest.approx(near, abs=1e-9)
        assert problem.amounts["distance"].joint == joint
        resting = PiecewisePolynomial(path.breaks, np.stack([np.eye(2)[None, 1 - joint], moved[None]]))
        assert len(velocity_by_position.FAMILY.path_constraints(resting, arm)) == 1  # it stays where it is


@pytest.mark.parametrize(("position", "limit"), [(0.2, 0.5), (-0.2, 0.5), (2.2, 2.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_state_outside_a_range_that_does_not_hold_zero_is_told_the_end_that_it_is_beyond(
    sign: int, position: float, limit: float
) -> None:
    bounds = Limits(np.sort(sign * np.array([[0.5, 2.0]])), *[UNLIMITED] * 3)
    state = State(np.array([sign * position]), np.zeros(1), np.zeros(1))
    _, amounts = joints.FAMILY.why_not_in_state(one_joint(bounds), state) or ("", {})
    assert amounts["limit"] == Amount(sign * limit, 0, 0)


@pytest.mark.parametrize(
    ("begins", "ends", "kinds"),
    [
        (0.0, 1.0, {"velocity", "acceleration"}),
        (1.0 - 1e-5, 1.0, {"velocity", "acceleration"}),
        (1.0, 1.0, {"velocity"}),
        (0.0, 0.4, {"acceleration"}),  # it is as fast as 0.8 rad/s then
    ],
)
def test_a_move_of_no_duration_has_no_acceleration_and_no_factor(
    begins: float, ends: float, kinds: set[str]
) -> None:
    """At 1 s it goes 2 rad/s and accelerates with 2 rad/s^2; nothing that takes no time can take longer."""
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[0.0]], [[0.0]]]))
    span = Span(0, "quintic", begins, ends, 2)
    start, end = (State(np.array([q]), np.array([v]), np.array([2.0])) for q, v in ((0.0, 0.0), (1.0, 2.0)))
    whole = Trajectory(curve, ("j1",), ("revolute",), (span,), start, end)
    one = np.array([[-1.0, 1.0]])
    survey = joints.FAMILY.survey(LimitedMove(whole, span, Limits(UNLIMITED, one, one, UNLIMITED)))
    found = list(survey.over(whole))
    assert {each.kind for each in found} == kinds
    assert all((each.factor is None) is (begins == ends) for each in found)
    near = velocity_by_position.FAMILY.survey(LimitedMove(whole, span, of_position()))
    assert len(near.uses) == (ends - begins == 1.0)  # of a whole piece


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_motion_is_stretched_for_any_derivative_in_either_direction(order: int, side: int) -> None:
    one = np.array([[-1.0, 1.0]])
    peaks = [Peaks(*(np.zeros(1) for _ in range(4))) for _ in range(4)]
    low, high = sorted((0.25 * -side, 1.5 * side))
    peaks[order] = Peaks(np.array([low]), np.array([0.1]), np.array([high]), np.array([0.2]))
    assert JointSurvey(tuple(peaks), Limits(one, one, one, one)).excess() > 0.1
    wide = [2.0 * one if k == order else one for k in range(4)]
    assert JointSurvey(tuple(peaks), Limits(*wide)).excess() < 0


@pytest.mark.parametrize("moves", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_each_joint_is_over_each_of_its_limits_by_itself(seed: int, *, moves: bool) -> None:
    """Against a plain search: the worse end by distance of positions, and by ratio of their derivatives."""
    rng = np.random.default_rng(seed)
    bounds = [np.stack([-rng.uniform(0.5, 2, 3), rng.uniform(0.5, 2, 3)], axis=1) for _ in range(4)]
    peaks = tuple(
        Peaks(-rng.uniform(0.2, 3, 3), rng.uniform(5, 6, 3), rng.uniform(0.2, 3, 3), rng.uniform(5, 6, 3))
        for _ in range(4)
    )
    arm, names = several(3, Limits(*bounds)), ("position", "velocity", "acceleration", "jerk")
    expected = {}
    for order, joint in np.ndindex(4 if moves else 2, 3):
        (low, high), peak = bounds[order][joint], peaks[order]
        ends = [(peak.low[joint], low, peak.low_time[joint]), (peak.high[joint], high, peak.high_time[joint])]
        if not any(abs(value) > abs(limit) for value, limit, _ in ends):
            continue
        value, limit, time = max(
            ends, key=lambda end: end[0] / end[1] if order else abs(end[0]) - abs(end[1])
        )
        factor = (value / limit) ** (1 / order) if order and moves else None
        expected[names[order], f"j{joint}"] = (value, limit, time - 4.5, factor, order, joint)
    found = list(JointSurvey(peaks, Limits(*bounds), moves).over(arm, 4.5))
    assert {(each.kind, each.joint) for each in found} == expected.keys()
    assert len(found) == len(expected) > 1
    for each in found:
        value, limit, time, factor, order, joint = expected[each.kind, each.joint]
        assert (each.value, each.limit, each.time) == (value, limit, pytest.approx(time))
        assert each.factor == (None if factor is None else pytest.approx(factor))
        for name, amount in (("value", value), ("limit", limit)):
            told = each.amounts[name]
            assert (told.value, told.order, told.joint) == (amount, order, joint)
        assert each.text().startswith(f"the {each.kind} of j{joint} reaches ")
        assert f" at t = {time:.9g} s, its limit is " in each.text()


def test_of_a_state_the_first_joint_that_is_over_its_limit_is_told_in_words() -> None:
    one = np.tile([-1.0, 1.0], (3, 1))
    values = np.array([0.0, -1.5, 2.5])
    for order, name in enumerate(("position", "velocity", "acceleration")):
        state = [np.zeros(3) for _ in range(3)]
        state[order] = values
        text, amounts = joints.FAMILY.why_not_in_state(
            several(3, Limits(one, one, one, one)), State(*state)
        ) or (
            "",
            {},
        )
        assert text == f"{{joint}} {{verb}} with {name} {{value}}, its limit is {{limit}}"
        assert (amounts["joint"], amounts["value"].value) == ("j1", -1.5)


def test_limits_must_be_as_many_as_moves() -> None:
    free = of_velocity(-1.0, 1.0)
    curve = PiecewisePolynomial(np.arange(3.0), np.zeros((1, 2, 1)))
    peaks = peaks_between(curve, np.array([[0.0, 1.0], [1.0, 2.0]]))
    for count in (1, 3):
        with pytest.raises(ValueError, match=f"{count} limits for 2 moves"):
            joints.moves_over(peaks, [free] * count)


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_move_is_over_by_any_joint_and_any_derivative(order: int, joint: int) -> None:
    """Two moves of equal limits that are values of their own; the second one moves a joint with t^3."""
    bounds = [np.tile([-100.0, 100.0], (3, 1)) for _ in range(4)]
    wide = Limits(*bounds)
    tight = [each.copy() for each in bounds]
    tight[order][joint] = [-1e-3, 2.0]
    rows = np.zeros((4, 2, 3))
    rows[0, 1, joint] = 1.0  # 3 t^2, 6 t and 6: over 2 for t in (0.9, 1)
    peaks = peaks_between(PiecewisePolynomial(np.arange(3.0), rows), np.array([[0.0, 1.0], [1.0, 2.0]]))
    assert joints.moves_over(peaks, [wide, dataclasses.replace(wide)]) == []
    assert joints.moves_over(peaks, [Limits(*tight), Limits(*tight)]) == [1]
    assert joints.moves_over(peaks, [Limits(*tight), wide]) == []
    shared = dataclasses.replace(Limits(*tight), acceleration=wide.acceleration, jerk=wide.jerk)
    other = dataclasses.replace(shared, velocity=shared.velocity, acceleration=tight[2], jerk=tight[3])
    assert joints.moves_over(peaks, [shared, other]) == [1]


@pytest.mark.parametrize("first", [0.5, 2.0])
@pytest.mark.parametrize("begins", [0.0, 7.0])
def test_a_move_is_surveyed_from_its_own_start_to_its_own_end(begins: float, first: float) -> None:
    """Of two moves at 0.5 and at 2 rad/s one is over 1 rad/s, in whichever order, on curves of whatever clock."""
    speeds = np.array([first, 1.0 / first])
    rows = np.stack([speeds, [0.0, first]])[:, :, None]
    curve = PiecewisePolynomial(begins + np.arange(3.0), rows)
    spans = tuple(Span(k, "quintic", float(k), k + 1.0, 2) for k in range(2))
    start, end = (
        State(np.array([q]), np.array([v]), np.zeros(1)) for q, v in zip((0.0, 2.5), speeds, strict=True)
    )
    whole = Trajectory(curve, ("j1",), ("revolute",), spans, start, end)
    bounds = of_velocity(-1.0, 1.0)
    for k, span in enumerate(spans):
        found = list(joints.FAMILY.survey(LimitedMove(whole, span, bounds)).over(whole, begins))
        assert [(each.value, each.limit) for each in found] == [(2.0, 1.0)] * int(speeds[k] > 1)
        assert all(k <= each.time <= k + 1 for each in found)
    assert joints.moves_over(joints.peaks_by_move(whole), [bounds] * 2) == [int(first < 1)]
