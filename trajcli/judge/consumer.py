"""Findings by the rules of a consumer, beside the judgement of limits."""

from __future__ import annotations

from trajcli.consumers.judgement import checks_of, judgement_of, load_profile
from trajcli.consumers.profile import Profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.curves.piecewise import Array
from trajcli.findings import Finding
from trajcli.kinematics.robot import Robot
from trajcli.streams.recorded_motion import RecordedMotion


class ConsumerJudge:
    """Judge of the rows of a motion by the profile of its consumer, block by block.

    Attributes:
        profile: Its rules; `profile.interpolation` says how the consumer runs from row to row.
    """

    def __init__(self, profile: str, robot: Robot | None = None, start: Array | None = None) -> None:
        """Take a profile by its name.

        Args:
            profile: Such as "ros-jtc".
            robot: Whose joints and limits count.
            start: Positions in which the arm stands when the motion begins, shape (n,), where a job says it.

        Raises:
            InputError: When there is no such profile.
        """
        self.profile: Profile = load_profile(profile)
        of_robot = (None, None) if robot is None else (robot.joint_names, robot.limits)
        self._checks = checks_of(self.profile, Surroundings(of_robot[0], start, of_robot[1]))

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
