"""Judgement of a motion by the profile of its consumer."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from trajcli.consumers.differences import Differences, EffortRate, RoundingNoise, VelocityTowardsEnds
from trajcli.consumers.executed import IntegerRange, QuantisedCurve, RoundedSegments, VelocitySteps
from trajcli.consumers.profile import Profile, profile_names, read_profile
from trajcli.consumers.rule_check import RuleCheck, Surroundings, surroundings_of
from trajcli.consumers.stamps import (
    ControllerPeriod,
    FirstPoint,
    IncreasingTimes,
    LongestTime,
    SegmentDurations,
)
from trajcli.consumers.states import (
    AtRest,
    CompletePoints,
    EffortAbsent,
    EffortRange,
    JointCount,
    JointNames,
    LastVelocity,
    PositionRange,
)
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.streams.recorded_motion import RecordedMotion
from trajcli.suggest import named_like, valid_names

CHECKS: Mapping[str, type[RuleCheck]] = {
    "at_rest": AtRest,
    "complete_points": CompletePoints,
    "rounding_noise": RoundingNoise,
    "differences": Differences,
    "effort_absent": EffortAbsent,
    "effort_range": EffortRange,
    "effort_rate": EffortRate,
    "first_point": FirstPoint,
    "increasing_times": IncreasingTimes,
    "integer_range": IntegerRange,
    "joint_count": JointCount,
    "joint_names": JointNames,
    "last_velocity": LastVelocity,
    "longest_time": LongestTime,
    "period": ControllerPeriod,
    "position_range": PositionRange,
    "quantised_curve": QuantisedCurve,
    "rounded_segments": RoundedSegments,
    "segment_durations": SegmentDurations,
    "velocity_by_position": VelocityTowardsEnds,
    "velocity_steps": VelocitySteps,
}
"""What a rule may compute, by the word under `check` in a profile."""


@frozen
class ProfileJudgement:
    """What a motion does against the rules of a consumer.

    Attributes:
        profile: The rules.
        findings: Errors first, each by time.
        unjudged: Rules that could not be judged, and why.
    """

    profile: Profile
    findings: tuple[Finding, ...]
    unjudged: tuple[tuple[str, str], ...]

    @property
    def accepted(self) -> bool:
        """Whether all necessary rules are kept."""
        return not any(found.severity == "error" for found in self.findings)


def load_profile(name: str, folder: Path | None = None) -> Profile:
    """Return a profile by its name.

    Args:
        name: Such as "ros-jtc".
        folder: Where to look; the folder of those that come with trajcli unless another is given.

    Raises:
        InputError: When there is none of that name, or with every flaw of its file.
        FileError: When its file cannot be read.
    """
    names = profile_names(folder)
    if name not in names:
        hint = named_like(name, names) or valid_names(names, "profiles")
        raise InputError(f"there is no profile '{name}'", hint=hint)
    parameters: Mapping[str, Mapping[str, Any]] = {key: each.parameters for key, each in CHECKS.items()}
    return read_profile(name, parameters, folder)


def judge_by_profile(
    blocks: Iterable[RecordedMotion], profile: Profile, around: Surroundings | None = None
) -> ProfileJudgement:
    """Return what a motion does against the rules of a consumer; memory does not grow with its rows.

    Args:
        blocks: All its rows, in order.
        profile: The rules.
        around: What is known beside the rows.
    """
    checks = checks_of(profile, around or Surroundings())
    for rows in blocks:
        for check in checks:
            if rows.t.size:
                check.take(rows)
    return judgement_of(profile, checks)


def checks_of(profile: Profile, around: Surroundings) -> Sequence[RuleCheck]:
    """Return the judges of the rules of a profile, to which blocks of rows are given one by one."""
    return [CHECKS[rule.check](rule, around) for rule in profile.rules if rule.check is not None]


def judgement_of(profile: Profile, checks: Sequence[RuleCheck]) -> ProfileJudgement:
    """Return what judges found that have taken all rows."""
    for check in checks:
        check.finish()
    order = [rule.id for rule in profile.rules]
    findings = sorted(
        (found for check in checks for found in check.findings()),
        key=lambda each: (each.severity != "error", each.time, order.index(each.rule), each.joint or ""),
    )
    unjudged = ((check.rule.id, check.unjudged) for check in checks if check.unjudged is not None)
    return ProfileJudgement(profile, tuple(findings), tuple(unjudged))


class ConsumerJudge:
    """Judge of the rows of a motion by the profile of its consumer, block by block.

    Attributes:
        profile: Its rules; `profile.interpolation` says how the consumer runs from row to row.
    """

    def __init__(self, profile: str, robot: Robot, start: Array | None = None) -> None:
        """Take a profile by its name.

        Args:
            profile: Such as "ros-jtc".
            robot: Whose joints and limits count.
            start: Positions in which the arm stands when the motion begins, shape (n,), where a job says it.

        Raises:
            InputError: When there is no such profile.
        """
        self.profile: Profile = load_profile(profile)
        self._checks = checks_of(self.profile, surroundings_of(robot, start))

    def take(self, rows: RecordedMotion) -> None:
        """Judge the next rows."""
        if rows.t.size:
            for check in self._checks:
                check.take(rows)

    def result(self) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
        """Return the findings, and a sentence for each rule that is not judged; once, behind all rows."""
        judgement = judgement_of(self.profile, self._checks)
        notes = tuple(f"the rule {rule} is not judged: {reason}" for rule, reason in judgement.unjudged)
        return judgement.findings, notes
