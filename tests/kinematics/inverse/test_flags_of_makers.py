"""Flags of ABB, KUKA and FANUC as formulas of joint values: quadrants, bits, counts, and arms that have no such branches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm

from trajcli.errors import InputError
from trajcli.geometry.rotation import exp
from trajcli.job.robot import load_robot
from trajcli.kinematics.inverse.vendor_flags import abb_flags, fanuc_flags, first_of_six, kuka_flags
from trajcli.kinematics.robot import Joint, Robot, unlimited

ABB, KUKA = load_robot("irb4600"), load_robot("kr6_r900")
Q = np.random.default_rng(3).uniform(-6.5, 6.5, (400, 6))
ON_A_WALL = np.eye(4)
ON_A_WALL[:3, :3], ON_A_WALL[:3, 3] = exp(np.array([1.2, 0.9, -0.4])), (3.0, -40.0, 5.0)


def on_rails(robot: Robot, kinds: tuple[str, ...]) -> Robot:
    """Return an arm behind joints whose axis is that of its base."""
    rows = tuple(Joint(f"rail {k}", kind) for k, kind in enumerate(kinds))  # type: ignore[arg-type]
    return replace(robot, joints=(*rows, *robot.joints), limits=unlimited(6 + len(rows)))


@pytest.mark.parametrize("joint", [0, 3, 5])
def test_abb_counts_quarter_turns_and_on_the_border_both_count(joint: int) -> None:
    place = (0, 3, 5).index(joint)
    for number in range(-4, 4):
        numbers = [0, 0, 0, 0]
        numbers[place] = number
        missed = abb_flags(numbers).missed_turns(ABB, Q)[:, place]
        assert (missed == (np.floor(Q[:, joint] / (np.pi / 2)) != number)).all()
    borders = np.zeros((2, 6))
    borders[:, joint] = np.pi / 2 + np.array([1e-12, -1e-12])
    for number, fits in ((0, True), (1, True), (-1, False), (2, False)):
        numbers[place] = number
        assert (abb_flags(numbers).missed_turns(ABB, borders)[:, place] == (not fits)).all()


def test_kuka_has_a_bit_for_each_joint_below_zero() -> None:
    for turn in (0, 1, 0b101010, 0b010011, 63):
        missed = kuka_flags(2, turn).missed_turns(KUKA, Q)
        below = np.array([bool(turn >> joint & 1) for joint in range(6)])
        assert (missed == ((Q < 0.0) != below)).all()
        assert not kuka_flags(2, turn).missed_turns(KUKA, np.zeros((1, 6))).any()
    assert kuka_flags(2, None).missed_turns(KUKA, Q).shape == (400, 0)


def test_fanuc_counts_whole_turns_from_half_a_turn_on() -> None:
    arm_of_fanuc = load_robot("m10ia")
    for text, counts in (
        ("N U T, 0, 0, 0", (0, 0, 0)),
        ("NUT 1 -1 0", (1, -1, 0)),
        ("FUT 0,1,-1", (0, 1, -1)),
    ):
        flags = fanuc_flags(text)
        assert flags is not None
        turns = np.round(Q[:, [0, 3, 5]] / (2 * np.pi))
        assert (flags.missed_turns(arm_of_fanuc, Q) == (turns != counts)).all()
    border = np.array([[np.pi, 0, 0, 0, 0, 0.0]])
    for text in ("NUT 0 0 0", "NUT 1 0 0"):
        assert not fanuc_flags(text).missed_turns(arm_of_fanuc, border).any()  # type: ignore[union-attr]


def test_a_kuka_whose_zero_is_elsewhere_in_the_catalogue_counts_as_its_controller() -> None:
    """A2 is 90 deg less than joint 2, A4 and A6 turn the other way."""
    controller = Q * [1, 1, 1, -1, 1, -1] + [0, -np.pi / 2, 0, 0, 0, 0]
    missed = kuka_flags(2, 0b011010).missed_turns(load_robot("kr210_l150"), Q)
    assert (missed == ((controller < 0.0) != [False, True, False, True, True, False])).all()


@pytest.mark.parametrize("kinds", [("prismatic",), ("prismatic", "prismatic")])
def test_rails_below_an_arm_change_none_of_its_flags(kinds: tuple[str, ...]) -> None:
    q = np.hstack([np.full((400, len(kinds)), -0.4), Q])
    for robot, flags in (
        (ABB, abb_flags([0, 1, -1, 3])),
        (KUKA, kuka_flags(6, 0b011010)),
        (KUKA, kuka_flags(1, None)),
    ):
        rail = on_rails(robot, kinds)
        assert first_of_six(rail) == len(kinds)
        assert (flags.met(rail, q) == flags.met(robot, Q)).all()
        assert 10 < np.count_nonzero(flags.met(rail, q)) < 100  # one of eight branches
        assert (flags.missed_turns(rail, q) == flags.missed_turns(robot, Q)).all()


def test_an_arm_on_a_slanted_wall_far_away_has_the_same_flags() -> None:
    for robot, flags in ((ABB, abb_flags([0, 0, 0, 5])), (KUKA, kuka_flags(3, None))):
        assert (flags.met(replace(robot, base=ON_A_WALL), Q) == flags.met(robot, Q)).all()


@pytest.mark.parametrize(
    ("bend", "positive", "negative"), [(0.0, True, True), (1e-3, True, False), (-1e-3, False, True)]
)
def test_with_joint_5_at_zero_either_sign_of_it_is_met(bend: float, positive: bool, negative: bool) -> None:
    q = np.array([[0.2, 0.1, 0.1, 0.3, bend, 0.2]])
    assert [bool(abb_flags([0, 0, 0, branch]).met(ABB, q)[0]) for branch in (0, 1)] == [positive, negative]


def changed(joint: int, **more: float) -> Robot:
    """Return an ABB with a row that is longer or turned by so much."""
    rows = list(ABB.joints)
    rows[joint] = replace(rows[joint], **{key: getattr(rows[joint], key) + by for key, by in more.items()})
    return replace(ABB, joints=tuple(rows))


@pytest.mark.parametrize(
    "robot",
    [
        *(changed(joint, alpha=0.01) for joint in (0, 1)),
        *(changed(joint, a=0.01) for joint in (3, 4)),
        on_rails(ABB, ("revolute",)),
        arm("wrist over two axes that meet"),
        arm("wrist over SCARA"),
    ],
    ids=lambda robot: f"{robot.name} {len(robot.joints)}",
)
def test_arms_with_other_axes_have_no_such_branches(robot: Robot) -> None:
    with pytest.raises(InputError, match="no branches of ABB, KUKA or FANUC"):
        first_of_six(robot)


def test_rounded_rows_of_such_an_arm_are_still_such_an_arm() -> None:
    assert first_of_six(ABB) == 0
    for robot in (changed(3, a=1e-9), changed(4, a=1e-9), changed(0, alpha=1e-8), changed(1, alpha=1e-8)):
        assert first_of_six(robot) == 0
