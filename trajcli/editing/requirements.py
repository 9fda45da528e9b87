"""Requirements of edited motions: limits of a job and each of its moves, or of a robot; continuity."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from trajcli.editing.edited_motion import EditedMotion
from trajcli.errors import Amount, InputError, Problem, TrajcliError, VerificationError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.judge.consistency import OF_ROUNDING
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import QUANTITIES, Joint, Robot, ToolLimits, unlimited
from trajcli.units import Units, amount_text

if TYPE_CHECKING:
    from trajcli.judge.file import Delivered
    from trajcli.planning.plan import Plan

_RULES = ("continuity", "time", "derivative")
_SHARES = (0.0, 0.25, 0.5, 0.75)
"""Where a piece is compared; the error of a Hermite polynomial is largest about its middle."""


@frozen
class KeptLimits:
    """What a motion is retimed by.

    Attributes:
        robot: With the limits in force where no move has others.
        requirements: For the judge of rows.
        units: Of files that name none, and of messages.
        say: Returns a number of a message in these units.
        plan: Of the job; None without one.
    """

    robot: Robot
    requirements: Requirements
    units: Units
    say: Callable[[Amount], str]
    plan: Plan | None = None

    def with_moves(self, motion: EditedMotion, delivered: Delivered | None = None) -> EditedMotion:
        """Return a motion whose rows say their moves where the file, or the times of the plan, say them.

        Args:
            motion: Any.
            delivered: Returns the plan of a job for a consumer, for whom these rows may be.
        """
        from trajcli.judge.file import moves_by_time

        rows, plan = motion.rows, self.plan
        if rows.move is not None or plan is None:
            return motion
        named = moves_by_time(plan, (rows,))
        differ = len({id(robot) for robot in self.requirements.by_move.values()}) > 1
        if named is None and delivered is not None and differ:
            from trajcli.judge.rows.rows_for_consumers import consumers_of_rows

            for made in consumers_of_rows(rows, plan):
                with suppress(TrajcliError), np.errstate(all="ignore"):
                    named = moves_by_time(delivered(made.loaded, made.profile, motion.format), (rows,))
                if named is not None:
                    break
        return motion if named is None else replace(motion, rows=named(rows))


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
    return replace(_kept(Requirements(loaded.robot, by_move), loaded.units), plan=plan)


def _kept(requirements: Requirements, units: Units) -> KeptLimits:
    robot = requirements.robot
    arms = [robot, *requirements.by_move.values()]
    if robot.convention is not None and any(arm.limits.tcp != ToolLimits() for arm in arms):
        from trajcli.judge.recorded_tool import ToolJudge

        requirements = replace(requirements, tool=lambda: ToolJudge(robot))
    say = partial(amount_text, joint_types=robot.joint_types, units=units)
    return KeptLimits(robot, requirements, units, say)


def refuse_new_jumps(before: EditedMotion, after: EditedMotion, *more: EditedMotion) -> None:
    """Refuse a motion that jumps where those that it is made of do not.

    Raises:
        VerificationError: With what `new_jumps` finds.
    """
    problems = new_jumps(before, after, *more)
    if problems:
        raise VerificationError(*problems)


def new_jumps(before: EditedMotion, after: EditedMotion, *more: EditedMotion) -> list[Problem]:
    """Return what is discontinuous about a motion, as it is written, and was not before, nor in `more`."""
    found = [each for each in _more_jumps(after, before, *more) if not _is_rounding(each, before)]
    return [finding.problem(f"{before.rows.source}: {finding.text()}") for finding in found]


def _more_jumps(after: EditedMotion, *before: EditedMotion) -> list[Finding]:
    kinds = {_kind(finding) for each in before for finding in _jumps(each)}
    return [finding for finding in _jumps(after.as_written()) if _kind(finding) not in kinds]


def no_longer_excused(motion: EditedMotion, read: EditedMotion) -> tuple[str, ...]:
    """Return the remark that the rounding of a file explains jumps, and that of a new one does not.

    Args:
        motion: As it was read.
        read: As it will be read.
    """
    before, after = motion.rows.resolution, read.rows.resolution
    finer = any((getattr(after, name) < getattr(before, name)).any() for name in ("q", "qd", "qdd"))
    found = _more_jumps(read, motion) if finer else ()
    more = f", and {len(found) - 1} more" if len(found) > 1 else ""
    text = "`check` may find what the decimals of this file excuse, and those of the new one do not"
    return (f"{text}: {motion.rows.source}: {found[0].text()}{more}",) if found else ()


def _is_rounding(finding: Finding, before: EditedMotion) -> bool:
    """Return whether a row between those of a file is off by what the rounding of their positions makes."""
    if finding.quantity is None or finding.joint is None or finding.time is None or finding.value is None:
        return False
    rows, order = before.rows, QUANTITIES.index(finding.quantity)
    after = min(max(int(np.searchsorted(rows.t, finding.time, side="right")), 1), rows.t.size - 1)
    length = float(rows.t[after] - rows.t[after - 1])
    off = float(rows.resolution.q[before.joint_names.index(finding.joint)])
    missed = abs(finding.value - (finding.limit or 0.0))
    return length > 0 and missed <= finding.rounding + OF_ROUNDING[order] * off / length**order


def _kind(finding: Finding) -> tuple[str, str | None, str | None]:
    return finding.kind, finding.quantity, finding.joint


def _jumps(motion: EditedMotion) -> list[Finding]:
    """Return jumps, stamps and derivatives that are certainly wrong."""
    joints = tuple(Joint(name) for name in motion.joint_names)
    bare = Robot(motion.rows.source, joints, unlimited(len(joints)), None, np.eye(4), np.eye(4))
    judgement = judge_motion(lambda: (motion.rows,), Requirements(bare))
    return [finding for finding in judgement.errors if finding.rule in _RULES]


def worst_deviation(before: EditedMotion, after: EditedMotion) -> tuple[int, float]:
    """Return the joint whose curve is changed most, and by how much, rad or m.

    Both curves are compared at the breaks of both, and between them.
    """
    first, second = before.curve(), after.curve()
    breaks = np.union1d(first.breaks, second.breaks)
    breaks = breaks[(breaks >= second.start) & (breaks <= second.end)]
    breaks = breaks[(breaks >= first.start) & (breaks <= first.end)]
    times = np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * np.array(_SHARES)).ravel(), breaks[-1:])
    largest = np.abs(first.evaluate(times) - second.evaluate(times)).max(axis=0)
    return int(largest.argmax()), float(largest.max())
