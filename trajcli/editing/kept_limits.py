"""Limits that a retimed motion keeps: of a job and each of its moves, or of a robot."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from trajcli.errors import Amount, InputError
from trajcli.frozen import frozen
from trajcli.judge.motion import Requirements
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.units import Units, amount_text


@frozen
class KeptLimits:
    """What a motion is retimed by.

    Attributes:
        robot: With the limits in force where no move has others.
        requirements: For the judge of rows.
        units: Of files that name none, and of messages.
        say: Returns a number of a message in these units.
    """

    robot: Robot
    requirements: Requirements
    units: Units
    say: Callable[[Amount], str]


def kept_limits(job: str | None, robot: str | None) -> KeptLimits:
    """Return the limits of a job, or of a robot by its name or file.

    Raises:
        InputError: When neither is named, or both are, or one has flaws.
        FileError: When a file cannot be read.
    """
    if (job is None) == (robot is None):
        both = "--job and --robot exclude each other" if job else "by which limits is the motion retimed?"
        raise InputError(both, hint="name a job with --job, or an arm with --robot")
    if job is not None:
        return _of_job(job)
    from trajcli.queries.arm import open_sheet

    sheet = open_sheet(str(robot))
    return _kept(Requirements(sheet.robot), sheet.units)


def _of_job(path: str) -> KeptLimits:
    from trajcli.job.read import load_job
    from trajcli.planning.plan import plan_job

    loaded = load_job(path)
    with np.errstate(all="ignore"):
        plan = plan_job(loaded)
    by_move = {move.index: move.robot for move in plan.moves}
    return _kept(Requirements(loaded.robot, by_move), loaded.units)


def _kept(requirements: Requirements, units: Units) -> KeptLimits:
    from dataclasses import replace

    robot = requirements.robot
    arms = [robot, *requirements.by_move.values()]
    if robot.convention is not None and any(arm.limits.tcp != ToolLimits() for arm in arms):
        from trajcli.judge.recorded_tool import ToolJudge

        requirements = replace(requirements, tool=lambda: ToolJudge(robot))
    say = partial(amount_text, joint_types=robot.joint_types, units=units)
    return KeptLimits(robot, requirements, units, say)
