"""Continuity of edited motions: jumps that an operation has made, and the deviation of a coarser one."""

from __future__ import annotations

import numpy as np

from trajcli.editing.edited_motion import EditedMotion
from trajcli.errors import Problem
from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Robot, unlimited

_RULES = ("continuity", "time", "derivative")
_SHARES = (0.0, 0.25, 0.5, 0.75)
"""Where a piece is compared; the error of a Hermite polynomial is largest about its middle."""


def new_jumps(before: EditedMotion, after: EditedMotion) -> list[Problem]:
    """Return what is discontinuous about a motion, as it is written, and was not before."""
    known = {_kind(finding) for finding in _jumps(before)}
    found = [finding for finding in _jumps(after.as_written()) if _kind(finding) not in known]
    return [finding.problem(f"{before.rows.source}: {finding.text()}") for finding in found]


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
