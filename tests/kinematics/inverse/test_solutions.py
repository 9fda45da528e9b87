"""What is read from solutions: numbers written down by hand, of no solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm

from trajcli.errors import PlanningError
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.solutions import Solutions, check_reachable, least_violation

BOUNDS = np.array([[-1.0, 2.0], [0.1, 0.5]])
NAMES = (Branch("left", "up"), Branch("left", "down"), Branch("right", "up"))


def made(joints, valid=True, closure=None) -> Solutions:
    """Return solutions of two joints, (*batch, 3, 2)."""
    q = np.array(joints, dtype=float)
    shape = q.shape[:-1]
    rows = np.zeros((*shape, 2)) if closure is None else np.array(closure)
    none = np.zeros(shape, dtype=bool)
    method = IkMethod("by hand", "numeric", (), "", labels=NAMES)
    free = np.zeros(q.shape, dtype=bool)
    return Solutions(method, q, np.broadcast_to(valid, shape), rows, none, free, BOUNDS)


def test_a_branch_is_within_limits_where_it_is_valid_and_no_joint_is_outside_on_either_side():
    found = made([[0.0, 0.3], [2.5, 0.3], [0.0, 0.05]])
    assert found.within_limits.tolist() == [True, False, False]
    assert found.excess.tolist() == [[0, 0], [0.5, 0], [0, pytest.approx(-0.05)]]
    assert made([[0.0, 0.3]] * 3, [True, False, True]).within_limits.tolist() == [True, False, True]


def test_the_shortfall_is_that_of_the_branch_with_the_least_sum_and_none_where_one_is_valid():
    closure = [[0.3, 0.0], [0.1, 0.1], [0.05, 0.4]]  # the second is neither the nearest nor the straightest
    assert made(np.zeros((3, 2)), False, closure).shortfall.tolist() == [0.1, 0.1]
    turned = [[0.15, 0.0], [0.1, 0.1], [1.0, 0.0]]
    assert made(np.zeros((3, 2)), False, turned).shortfall.tolist() == [0.15, 0.0]
    # outside the limits it is reached nevertheless
    assert made(np.full((3, 2), 9.0), [False, False, True], closure).shortfall.tolist() == [0.0, 0.0]
    lost = [[np.nan, 0.0], [0.7, 0.2], [np.inf, 0.0]]
    assert made(np.zeros((3, 2)), False, lost).shortfall.tolist() == [0.7, 0.2]
    both = made(np.zeros((2, 3, 2)), [[False] * 3, [True] * 3], [closure, closure])
    assert both.shortfall.tolist() == [[0.1, 0.1], [0.0, 0.0]]


def test_the_nearest_branch_has_the_smallest_largest_difference():
    q = [[0.5, 0.3], [0.4, 0.4], [0.0, 0.5]]  # largest differences of 0.5, 0.4 and 0.5; sums of 0.5, 0.8, 0.5
    near = np.array([0.0, 0.0])
    assert made(q).nearest(near) == 1
    assert made(q, [True, False, True]).nearest(near) == 0
    outside = made([[2.1, 0.3], [0.9, 0.3], [2.0, 0.4]])
    assert outside.nearest(np.array([2.1, 0.3])) == 2
    assert outside.nearest(np.array([2.1, 0.3]), within_limits=False) == 0
    assert made(q, False).nearest(near) == -1
    assert made([q, q], [[True] * 3, [False] * 3]).nearest(near).tolist() == [1, -1]


def test_a_name_means_every_choice_that_is_given():
    found = made(np.zeros((3, 2)))
    assert found.named(shoulder="left", elbow="up").tolist() == [True, False, False]
    assert found.named(shoulder=None, elbow="up", wrist=None).tolist() == [True, False, True]
    assert found.named(shoulder="right", elbow="down").tolist() == [False, False, False]


def test_the_least_violation_is_of_the_valid_branch_whose_worst_joint_is_least_outside():
    q = [[-1.5, 0.3], [2.05, 0.85], [2.3, 0.75]]  # outside by 0.5, by 0.05 and 0.35, by 0.3 and 0.25
    worst = least_violation(made(q))
    assert (worst.branch, worst.joint) == (2, 0)
    worst = least_violation(made(q, [True, True, False]))
    assert (worst.branch, worst.joint, worst.value) == (1, 1, 0.85)
    assert worst.excess == pytest.approx(0.35)
    worst = least_violation(made(q, [True, False, False]))
    assert (worst.branch, worst.joint, worst.excess, worst.value) == (0, 0, -0.5, -1.5)
    assert least_violation(made([*q[:2], [0.0, 0.2]])) is None
    assert least_violation(made([q, np.zeros((3, 2)) + 0.2]), (1,)) is None
    with pytest.raises(ValueError, match="no valid branch"):
        least_violation(made(q, False))


ARM = arm("planar RP")


@pytest.mark.parametrize(
    ("q", "text"),
    [
        ([-1.5, 0.3], "j1 at -1.5, its limit is -1, 0.5 too far"),
        ([2.5, 0.3], "j1 at 2.5, its limit is 2, 0.5 too far"),
        ([0.0, 0.02], "j2 at 0.02, its limit is 0.1, 0.08 too far"),
    ],
)
def test_the_joint_that_is_outside_is_told_with_the_limit_on_its_side(q, text):
    with pytest.raises(PlanningError) as caught:
        check_reachable(ARM, made([q] * 3, [True, False, True]))
    (problem,) = caught.value.problems
    assert text in problem.text()
    assert "the nearest of 2 answers" in problem.text()
    joint = int(q[1] < 0.1)
    assert {problem.amounts[name].joint for name in ("value", "limit", "excess")} == {joint}
    assert problem.joint == ARM.joint_names[joint]


def test_of_a_batch_the_first_target_that_has_no_answer_is_told():
    fine, lost = np.array([[0.0, 0.3]] * 3), np.array([[0.0, 0.9]] * 3)
    check_reachable(ARM, made([fine, fine]))
    with pytest.raises(
        PlanningError, match=r"reaches the pose \(number 1 of the batch, from 0\) only outside"
    ):
        check_reachable(ARM, made([fine, lost, lost]))
    missed = made(
        [fine, fine, fine],
        [[True] * 3, [False] * 3, [True] * 3],
        np.full((3, 3, 2), [0.123456789, np.pi / 2]),
    )
    with pytest.raises(PlanningError, match=r"number 1 of .* within 0\.123457 m and 1\.5708 rad") as caught:
        check_reachable(ARM, missed)
    assert caught.value.problems[0].hint == "move the target, or leave coordinates of its orientation free"
    with pytest.raises(PlanningError) as caught:
        check_reachable(ARM, missed, turning_helps=False)
    assert caught.value.problems[0].hint == "move the target"
    fixed = replace(missed, fixed_axis="x")
    with pytest.raises(PlanningError) as caught:
        check_reachable(ARM, fixed)
    assert caught.value.problems[0].hint == (
        "no joint turns the x axis of the tool: mean another one, with `tool_axis`"
    )
