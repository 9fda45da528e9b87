"""Judgement of a file that a command draws: what it is judged by, and the error that says what was found."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trajcli.errors import Problem, TrajcliError
from trajcli.findings import Finding
from trajcli.judge.file import CheckedFile, CheckOptions, check_file
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource
from trajcli.units import amount_text


def judged_file(source: ByteSource, options: CheckOptions, plan: Plan | None = None) -> CheckedFile | str:
    """Return the judgement of a file; why there is none where nothing of it can be judged.

    Args:
        source: The file.
        options: What it is judged by.
        plan: Of a job that was planned before.
    """
    try:
        with np.errstate(all="ignore"):  # what is not finite is for the judge to find
            return check_file(source, options, plan)
    except TrajcliError as error:
        return error.problems[0].text()


def problems_of(checked: CheckedFile, *, every: bool) -> Iterator[Problem]:
    """Yield what is certainly wrong with a file, the worst first.

    Args:
        checked: The file.
        every: Whether each finding is said; otherwise the worst of each move and kind, with how many more.
    """
    alike: dict[object, list[Finding]] = {}
    for number, finding in enumerate(checked.judgement.errors):
        alike.setdefault(number if every else (finding.move, finding.kind), []).append(finding)
    for group in alike.values():
        problem = _problem(checked, group[0])
        more = f" (and {len(group) - 1} more like it: --all)" if len(group) > 1 else ""
        yield replace(problem, message=problem.message + more)


def _problem(checked: CheckedFile, finding: Finding) -> Problem:
    text = finding.text(lambda amount: amount_text(amount, checked.robot.joint_types, checked.units))
    return finding.problem(f"{checked.motion.source}: {text}")
