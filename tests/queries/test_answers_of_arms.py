"""Answers of an arm of two turns, and of one on a slide, whose joint values are those of the law of cosines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.errors import InputError, PlanningError
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.language.poses import Configuration
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.inverse import Wanted, answer_reports, find_answers, free_directions, require_answer
from trajcli.units import Units

A, B = 0.5, 0.3
DEG = np.pi / 180


def planar(*ranges: tuple[float, float], slide: bool = False) -> ArmInUnits:
    """Return an arm in the plane with ranges in deg, perhaps on a slide along z."""
    joints = (Joint("j1", a=A), Joint("j2", a=B))
    if slide:
        joints = (Joint("lift", type="prismatic"), *joints)
    free = unlimited(len(joints))
    bounds = free.position.copy()
    bounds[-2 : -2 + len(ranges) or None] = np.array(ranges).reshape(-1, 2) * DEG
    robot = Robot("two", joints, replace(free, position=bounds), "standard", np.eye(4), np.eye(4))
    return ArmInUnits(robot, Units("deg", "mm"))


def closed_form(x: float, y: float) -> dict[str, np.ndarray]:
    """Return the joint values, deg, that reach a point: the elbow above the line to it, and below."""
    inner = np.arccos((x * x + y * y - A * A - B * B) / (2 * A * B))
    found = {}
    for name, q2 in (("up", -inner), ("down", inner)):
        q1 = np.arctan2(y, x) - np.arctan2(B * np.sin(q2), A + B * np.cos(q2))
        found[name] = np.degrees([q1, q2])
    return found


POINT = np.array([0.4, 0.2, 0.0])
UP, DOWN = closed_form(*POINT[:2]).values()
WIDE = ((-400, 400), (-170, 170))


def told(arm: ArmInUnits, wanted: Wanted, near: object = None, **options: bool) -> list[tuple[float, ...]]:
    values = None if near is None else np.asarray(near, dtype=float) * arm.joint_factors
    solutions, chosen = find_answers(arm, wanted, values, 1e-6)
    reports = answer_reports(arm, solutions, chosen, wanted, values, **options)
    assert all(report["closure"] < 1e-9 for report in reports)
    return [tuple(np.round(report["joints"], 6)) for report in reports]


def same(found: list[tuple[float, ...]], *wanted: object) -> None:
    np.testing.assert_allclose(found, np.array(wanted, dtype=float), atol=1e-6)


def test_both_branches_are_answers_and_the_nearest_comes_first() -> None:
    arm, wanted = planar(*WIDE), Wanted(partial_target(POINT))
    same(told(arm, wanted), UP, DOWN)
    same(told(arm, wanted, np.add(UP, (5, 3))), UP, DOWN)
    same(told(arm, wanted, np.add(DOWN, (5, -3))), DOWN, UP)
    same(told(arm, wanted, np.add(DOWN, (360, 0))), np.add(DOWN, (360, 0)), np.add(UP, (0, 0)))
    # of the largest differences the smaller: 100 and 20 against 90 and 80
    near = (UP + DOWN) / 2 + [0, 5]
    same(told(arm, wanted, near), *sorted((UP, DOWN), key=lambda q: np.abs(q - near).max()))


def test_names_choose_a_branch() -> None:
    arm = planar(*WIDE)
    same(told(arm, Wanted(partial_target(POINT), {}, Configuration(elbow="up"))), UP)
    same(told(arm, Wanted(partial_target(POINT), {}, Configuration(elbow="down"))), DOWN)
    for choice in ({"shoulder": "left"}, {"elbow": "up", "wrist": "flip"}):
        with pytest.raises(InputError, match=f"no choice of {[*choice][-1]}") as caught:
            told(arm, Wanted(partial_target(POINT), {}, Configuration(**choice)))
        assert f"leave {[*choice][-1]} out" in str(caught.value.problems[0].hint)


def test_turns_are_all_that_the_ranges_allow() -> None:
    arm, wanted = planar(*WIDE), Wanted(partial_target(POINT))
    same(
        told(arm, wanted, turns=True),
        np.subtract(UP, (360, 0)),
        UP,
        np.subtract(DOWN, (360, 0)),
        DOWN,
        np.add(DOWN, (360, 0)),
    )
    same(told(arm, wanted, np.add(DOWN, (400, 0)), turns=True)[:2], np.add(DOWN, (360, 0)), UP)


def test_answers_outside_the_range_are_told_on_request() -> None:
    arm, wanted = planar((-400, 400), (-100, 170)), Wanted(partial_target(POINT))
    same(told(arm, wanted), DOWN)
    same(told(arm, wanted, every=True), UP, DOWN)
    solutions, chosen = find_answers(arm, wanted, None, 1e-6)
    inside = [
        report["within_limits"] for report in answer_reports(arm, solutions, chosen, wanted, every=True)
    ]
    assert inside == [False, True]
    require_answer(arm, solutions, chosen, wanted)
    for name, only in (("up", "only outside the limits"), ("down", None)):
        asked = replace(wanted, configuration=Configuration(elbow=name))
        solutions, chosen = find_answers(arm, asked, None, 1e-6)
        if only is None:
            require_answer(arm, solutions, chosen, asked)
            continue
        with pytest.raises(PlanningError, match=f"reaches the pose with up {only}") as caught:
            require_answer(arm, solutions, chosen, asked)
        assert caught.value.problems[0].hint == "within the limits: down"
    tight = planar((-400, 400), (-10, 10))
    solutions, chosen = find_answers(tight, wanted, None, 1e-6)
    with pytest.raises(PlanningError, match="j2"):
        require_answer(tight, solutions, chosen, wanted)
    asked = replace(wanted, configuration=Configuration(elbow="up"))
    solutions, chosen = find_answers(tight, asked, None, 1e-6)
    with pytest.raises(PlanningError, match="only outside the limits") as caught:
        require_answer(tight, solutions, chosen, asked)
    assert caught.value.problems[0].hint == "no other branch is inside either"


def test_the_closure_is_the_larger_of_the_two_misses() -> None:
    arm, wanted = planar(*WIDE), Wanted(partial_target(POINT))
    solutions, chosen = find_answers(arm, wanted, None, 1e-6)
    misses = np.array([[1e-7, 3e-7], [4e-7, 2e-7]])
    found = answer_reports(arm, replace(solutions, closure=misses), chosen, wanted)
    assert [report["closure"] for report in found] == [3e-7, 4e-7]


def test_the_numbers_of_a_maker_choose_one_answer_each() -> None:
    """ABB, `confdata`: cfx tells the eight postures apart, and is even where joint 5 is above zero."""
    arm = ArmInUnits(load_robot("irb120"), Units())
    pose = forward(arm.robot, np.array([0.4, 0.3, -0.2, 0.9, 0.7, -0.5]))
    wanted = Wanted(partial_target(pose[:3, 3], rotation=pose[:3, :3]))
    solutions, chosen = find_answers(arm, wanted, None, 1e-6)
    assert chosen.sum() > 2
    postures = []
    for posture in range(8):
        asked = replace(wanted, configuration=Configuration(abb=(0, 0, -1, posture)))
        met = find_answers(arm, asked, None, 1e-6)[1]
        assert ((solutions.joints[met][:, 4] > 0) == (posture % 2 == 0)).all()
        postures.append(met)
    assert (np.sum(postures, axis=0) == chosen).all()


def test_the_quadrants_of_a_maker_choose_the_turns() -> None:
    """ABB, `confdata`: quadrant k of a joint is from 90 k to 90 (k + 1) deg."""
    arm = ArmInUnits(load_robot("irb4600"), Units("deg", "m"))
    pose = forward(arm.robot, np.radians([-20, 30, 5, -100, 40, 190]))
    wanted = Wanted(partial_target(pose[:3, 3], rotation=pose[:3, :3]))
    for sixth, value in ((2, 190.0), (-2, -170.0)):
        asked = replace(wanted, configuration=Configuration(abb=(-1, -2, sixth, 0)))
        same(told(arm, asked), (-20, 30, 5, -100, 40, value))
    near = (-20, 30, 5, 300, 40, 150)
    same(
        told(arm, replace(wanted, configuration=Configuration(abb=(-1, -2, -2, 0))), near)[:1],
        (-20, 30, 5, -100, 40, -170),
    )
    with_turns = replace(wanted, configuration=Configuration(abb=(-1, 2, 2, 0)))
    same(told(arm, with_turns, turns=True), (-20, 30, 5, 260, 40, 190))
    missing = replace(wanted, configuration=Configuration(abb=(-1, -2, 0, 0)))
    solutions, chosen = find_answers(arm, missing, None, 1e-6)
    found = answer_reports(arm, solutions, chosen, missing, turns=True)
    assert [report["turns_not_met"] for report in found] == [["joint_6"]] * 2
    assert sorted(round(report["joints"][5]) for report in found) == [-170, 190]
    for near, value in ((None, -170), ((0, 0, 0, 0, 0, 100), 190)):
        same(told(arm, missing, near), (-20, 30, 5, -100, 40, value))
    pinned = replace(missing, configuration=Configuration(abb=(-1, -2, 2, 0)), pins={5: np.radians(-170.0)})
    solutions, chosen = find_answers(arm, pinned, None, 1e-6)
    (report,) = answer_reports(arm, solutions, chosen, pinned)
    assert report["turns_not_met"] == ["joint_6"]
    np.testing.assert_allclose(report["joints"], (-20, 30, 5, -100, 40, -170), atol=1e-6)


def test_a_posture_of_a_maker_beyond_the_limits_is_no_answer() -> None:
    arm = ArmInUnits(load_robot("irb120"), Units())
    wanted = Wanted(
        partial_target(np.array([0.3, 0.1, 0.5]), rotation=np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]))
    )
    for posture in (2, 3, 4, 5, 6, 7):
        asked = replace(wanted, configuration=Configuration(abb=(0, 0, 0, posture)))
        solutions, chosen = find_answers(arm, asked, None, 1e-6)
        assert chosen.sum() == 1
        assert answer_reports(arm, solutions, chosen, asked) == []
        with pytest.raises(PlanningError, match=rf"with abb \[0, 0, 0, {posture}\] only outside") as caught:
            require_answer(arm, solutions, chosen, asked)
        assert "left up no_flip" in str(caught.value.problems[0].hint)


@pytest.mark.parametrize("configuration", [None, Configuration(elbow="up")])
def test_a_point_out_of_reach_is_missed_by_what_is_between(configuration: Configuration | None) -> None:
    arm = planar(*WIDE)
    wanted = Wanted(partial_target(np.array([1.0, 0.0, 0.0])), {}, configuration)
    solutions, chosen = find_answers(arm, wanted, None, 1e-6)
    assert answer_reports(arm, solutions, chosen, wanted, every=True) == []
    with pytest.raises(PlanningError, match="cannot reach the pose: it comes within 200 mm"):
        require_answer(arm, solutions, chosen, wanted)


def test_a_stretched_arm_is_singular_and_stands_alone() -> None:
    """Along its own direction it cannot move, and no joint is free; anywhere else both directions are there."""
    arm = planar(*WIDE)
    for point, singular in (([A + B, 0, 0], True), (POINT, False)):
        wanted = Wanted(partial_target(np.array(point)))
        solutions, chosen = find_answers(arm, wanted, None, 1e-6)
        for report in answer_reports(arm, solutions, chosen, wanted):
            assert (report["singular"], "free_direction" in report) == (singular, False)


def test_pinned_joints_keep_their_values_and_what_is_free_leaves_them() -> None:
    """On a slide of z the height is fixed by it alone, so that x alone leaves one freedom to the two turns."""
    arm = planar(*WIDE, slide=True)
    on_line = partial_target(np.array([0.4, 0.0, 0.1]), fixed=(True, False, True))
    found = told(arm, Wanted(on_line, {1: 30 * DEG}), turns=True)
    for lift, q1, q2 in found:
        assert (lift, q1) == (100.0, 30.0)
        assert A * np.cos(q1 * DEG) + B * np.cos((q1 + q2) * DEG) == pytest.approx(0.4)
    assert len(found) == 2
    joints = np.array([0.1, 0.3, 0.9])
    for units in (Units("deg", "mm"), Units()):
        shown = ArmInUnits(arm.robot, units)
        (free,) = free_directions(shown, joints, on_line)
        slope = np.array([-A * np.sin(0.3) - B * np.sin(1.2), -B * np.sin(1.2)])  # dx by q1 and q2
        assert free[0] == pytest.approx(0, abs=1e-12)
        assert slope @ free[1:] == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(free) == pytest.approx(1)
    height = partial_target(np.array([0.4, 0.0, 0.1]), fixed=(True, False, False))
    mixed = ArmInUnits(arm.robot, Units("deg", "mm"))
    directions = list(free_directions(mixed, joints, height))
    assert len(directions) == 2  # the slide, and the turns against each other
    (pinned,) = free_directions(mixed, joints, height, {0})
    assert pinned[0] == 0
    (lifted,) = free_directions(mixed, joints, height, {1})
    np.testing.assert_allclose(np.abs(lifted), [1, 0, 0], atol=1e-12)


def test_a_free_direction_is_in_the_units_of_the_user() -> None:
    """A turn about z against a slide along x: 1 rad moves the tip by 0.5 m across, so 1 deg by 0.5 pi / 180 m."""
    robot = Robot(
        "cart",
        (Joint("cart", type="prismatic", alpha=np.pi / 2), Joint("turn", a=0.5)),
        unlimited(2),
        "standard",
        np.eye(4),
        np.eye(4),
    )
    along = partial_target(np.array([0, 0, 0.5]), fixed=(False, False, True))
    q = np.array([0.3, 0.4])
    slope = np.array([1.0, 0.5 * np.cos(0.4)])  # dz by the slide in m and by the turn in rad
    for units, factors in (
        (Units(), (1, 1)),
        (Units("deg", "mm"), (1e-3, DEG)),
        (Units("rad", "mm"), (1e-3, 1)),
    ):
        (free,) = free_directions(ArmInUnits(robot, units), q, along)
        assert slope @ (free * factors) == pytest.approx(0, abs=1e-12)
        assert np.linalg.norm(free) == pytest.approx(1)
        assert abs(free).min() > 1e-6
