"""Inverse kinematics of one target: every answer, in the user's units."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, field
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.inverse.joint_turns import all_turns
from trajcli.kinematics.inverse.pinned_joints import solve_pinned, without_pinned
from trajcli.kinematics.inverse.solutions import Solutions, check_reachable
from trajcli.kinematics.inverse.solve import reached_if_turned
from trajcli.kinematics.inverse.target import IkTarget, held_jacobian, rank_of, ranks
from trajcli.language.poses import Configuration

if TYPE_CHECKING:
    from trajcli.queries.arm import ArmInUnits


@frozen
class Wanted:
    """What joint values are asked for.

    Attributes:
        target: What is fixed of the tcp's pose.
        pins: Values of joints that are pinned, by index, rad or m.
        configuration: The names that a branch must have.
    """

    target: IkTarget
    pins: Mapping[int, float] = field(default_factory=dict)
    configuration: Configuration | None = None


def find_answers(
    arm: ArmInUnits, wanted: Wanted, near: Array | None, tolerance: float
) -> tuple[Solutions, Flags]:
    """Return all branches of one target, and which of them are answers as it is asked for, shape (branches,).

    Args:
        arm: The arm.
        wanted: One target.
        near: Joint values (n,), rad or m; zero if absent.
        tolerance: What an answer may miss the target by, m and rad.

    Raises:
        InputError: When a choice is asked for that the arm does not have for this target.
        PlanningError: When every joint is pinned.
    """
    solutions = solve_pinned(arm.robot, wanted.target, wanted.pins, near, tolerance)
    configuration = wanted.configuration or Configuration()
    for choice in configuration.branch_names:
        if getattr(solutions.names[0], choice) is None:
            raise InputError(
                f"{arm.robot.name} has no choice of {choice} for this target: {solutions.method.reason}",
                hint=f"leave {choice} out of `configuration`",
            )
    chosen = solutions.valid & solutions.named(**configuration.branch_names)
    flags = configuration.flags
    return solutions, chosen if flags is None else chosen & flags.met(arm.robot, solutions.joints)


def answer_reports(
    arm: ArmInUnits,
    solutions: Solutions,
    chosen: Flags,
    wanted: Wanted,
    near: Array | None = None,
    *,
    every: bool = False,
    turns: bool = False,
) -> list[dict[str, Any]]:
    """Return [{joints, branch, within_limits, closure, singular, ...}] of one target.

    `closure` is the larger of the miss in m and in rad. `singular`: of the directions that the target fixes,
    the tcp can move in fewer than it can nearby, as `ranks` finds. `free_direction` is a unit vector of joint
    values: the arm can move along it while what is fixed of the pose rests; without it the answer stands
    alone, as that of a stretched arm does although it is singular. `turns_not_met` names the joints that no
    turn within their limits brings where flags of a maker want them.

    Args:
        arm: The arm.
        solutions: All branches.
        chosen: Which of them to return, shape (branches,).
        wanted: What was asked for; pinned joints neither move nor turn.
        near: Joint values (n,): the nearest answer comes first.
        every: Whether answers outside the limits count too.
        turns: Whether every full turn that the limits allow is an answer of its own.
    """
    usable = np.flatnonzero(chosen if every else chosen & solutions.within_limits)
    if not len(usable):
        return []
    others = [joint for joint in range(len(arm.robot.joints)) if joint not in wanted.pins]
    moving = without_pinned(arm.robot, wanted.pins) if wanted.pins else arm.robot
    here, nearby = ranks(moving, solutions.joints[usable][:, others], wanted.target)
    reports = []
    for branch, lost in zip(usable.tolist(), (here < nearby).tolist(), strict=True):
        found, missed = _turned(arm, solutions.joints[branch], wanted, near, turns=turns)
        for joints in found:
            reports.append((joints, _answer(arm, solutions, branch, joints, wanted, lost)))
            if missed:
                reports[-1][1]["turns_not_met"] = [arm.robot.joint_names[joint] for joint in missed]
    if near is not None:
        reports.sort(key=lambda pair: float(np.abs(pair[0] - near).max()))
    return [answer for _, answer in reports]


def _turned(
    arm: ArmInUnits, joints: Array, wanted: Wanted, near: Array | None, *, turns: bool
) -> tuple[Array, list[int]]:
    """Return joint values (n,) in the turns that are asked for, (k, n), and the joints that miss theirs."""
    flags = (wanted.configuration or Configuration()).flags
    if flags is not None and flags.turns:
        found, missed = flags.in_turns(
            arm.robot, joints, np.zeros_like(joints) if near is None else near, wanted.pins
        )
        return found[: None if turns else 1], missed
    if not turns:
        return joints[None], []
    return all_turns(arm.robot, joints, wanted.pins), []


def require_answer(arm: ArmInUnits, solutions: Solutions, chosen: Flags, wanted: Wanted) -> None:
    """Do nothing when one of the chosen branches is within the limits.

    Raises:
        PlanningError: By how much the target is out of reach; or which joint is outside its limits.
    """
    if (chosen & solutions.within_limits).any():
        return
    named = (wanted.configuration or Configuration()).text
    if solutions.valid.any() and named:
        others = [
            str(name) for name, fine in zip(solutions.names, solutions.within_limits, strict=True) if fine
        ]
        only = "only outside the limits" if chosen.any() else "not at all"
        raise PlanningError(
            f"{arm.robot.name} reaches the pose with {named} {only}",
            hint=f"within the limits: {'; '.join(others)}" if others else "no other branch is inside either",
        )
    try:
        moving = without_pinned(arm.robot, wanted.pins) if wanted.pins else arm.robot
        turning_helps = bool(solutions.valid.any()) or reached_if_turned(moving, wanted.target)
        check_reachable(arm.robot, solutions, turning_helps=turning_helps)
    except PlanningError as error:
        raise error.said_by(arm.say) from None


def _answer(
    arm: ArmInUnits, solutions: Solutions, branch: int, joints: Array, wanted: Wanted, singular: bool
) -> dict[str, Any]:
    from trajcli.queries.pose import plain

    names = {choice: name for choice, name in asdict(solutions.names[branch]).items() if name is not None}
    report = {
        "joints": plain(joints / arm.joint_factors),
        "branch": names,
        "within_limits": bool(solutions.within_limits[branch]),
        "closure": float(solutions.closure[branch].max()),
        "singular": singular,
    }
    if solutions.free[branch].any():
        report["free_direction"] = plain(next(free_directions(arm, joints, wanted.target, wanted.pins)))
    return report


def free_directions(
    arm: ArmInUnits, joints: Array, target: IkTarget, pins: Collection[int] = ()
) -> Iterator[Array]:
    """Yield unit vectors (n,) of joint values, in the user's units, that leave what is fixed of the pose.

    Args:
        arm: The arm.
        joints: Where it stands, (n,), rad or m.
        target: What is fixed of the pose.
        pins: Indices of joints that stay.
    """
    others = [joint for joint in range(len(joints)) if joint not in pins]
    _, values, right = np.linalg.svd(held_jacobian(arm.robot, joints[None], target)[0][:, others])
    from trajcli.queries.jacobian import simplest

    rank = min(int(rank_of(values)), len(others) - 1)
    for direction in simplest(right[rank:]):
        shown = np.zeros(len(joints))
        shown[others] = direction / arm.joint_factors[others]
        yield shown / np.linalg.norm(shown)
