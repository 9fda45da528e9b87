"""Causes of the findings of a plan: which findings have one, and which of them is the worst."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from trajcli.errors import Place, Problem
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import QUANTITIES
from trajcli.planning.plan import Plan
from trajcli.units import joint_quantity, to_user

_SAME = 9  # decimals of a position, rad or m: positions that agree so far are one
_WRITTEN = 1e-6  # relative: a number of the file that differs by less is the one that was taken


@frozen
class Cause:
    """Findings that one change would end.

    Attributes:
        findings: The worst first, the others in the order of the verdict.
        indices: Where each stands in the verdict.
    """

    findings: tuple[Finding, ...]
    indices: tuple[int, ...]

    @property
    def worst(self) -> Finding:
        """The one that is said where there is room for one."""
        return self.findings[0]


def causes_of(plan: Plan) -> tuple[Cause, ...]:
    """Return the causes of what a plan's verdict found, in the order in which they were found."""
    from trajcli.planning.advice import unit_hint

    alike: dict[tuple[float | str | None, ...], list[int]] = {}
    units, findings = unit_hint(plan.loaded), plan.verdict.findings
    for index, finding in enumerate(findings):
        alike.setdefault(_cause(finding, units), []).append(index)
    causes = []
    for indices in alike.values():
        worst = max(indices, key=lambda index: badness(findings[index]))
        order = (worst, *(index for index in indices if index != worst))
        causes.append(Cause(tuple(findings[index] for index in order), order))
    return tuple(causes)


def _cause(finding: Finding, units: str | None) -> tuple[float | str | None, ...]:
    """Return what findings of one cause share.

    That is: numbers in other units than were meant; a point outside its limit, of several moves; a move that
    is too short, for whatever limit; steps of the acceleration, which break that of jerk, too; else the move
    and the kind.
    """
    if finding.kind in QUANTITIES and finding.hint is not None and finding.hint == units:
        return (finding.hint,)
    if finding.kind == "position" and finding.value is not None:
        return finding.kind, finding.joint, round(finding.value, _SAME)
    if finding.kind in ("jerk", "acceleration_jump"):
        return finding.move, finding.hint
    if finding.factor is not None and finding.hint is not None:
        return finding.move, finding.hint
    return finding.move, finding.kind


def badness(finding: Finding) -> tuple[float, float, float]:
    """Return how bad a finding is, to compare those of one cause.

    Positions and steps come first; then what asks for the longest motion, or is furthest beyond its limit: of
    positions by distance, else by the part of the limit.
    """
    first = math.inf if finding.kind in ("position", "acceleration_jump") else 0.0
    if finding.kind == "position" or not finding.limit:
        return first, 0.0, round(abs((finding.value or 0.0) - (finding.limit or 0.0)), _SAME)
    return first, finding.factor or 0.0, finding.excess


def problem_of(plan: Plan, finding: Finding) -> Problem:
    """Return the problem that an error carries about a finding, with the line that it is about."""
    index, said = finding.move or 0, finding.text(plan.loaded.say)
    if finding.kind == "position" and finding.time == plan.trajectory.curve.start:
        whose, position = plan.loaded.start_meant()
        return replace(finding, move=index).problem(f"{whose}: {said}", position)
    where = _number(plan.loaded, finding) or plan.loaded.place_of_move(index)
    return replace(finding, move=index).problem(f"{plan.loaded.called(index)}: {said}", where)


def _number(loaded: LoadedJob, finding: Finding) -> Place | None:
    """Return where the number stands that puts a joint outside its limit; None where none does."""
    robot = loaded.robot
    if finding.kind != "position" or finding.move is None or finding.value is None:
        return None
    joint = robot.joint_names.index(finding.joint) if finding.joint in robot.joint_names else None
    if joint is None:
        return None
    wanted = to_user(finding.value, joint_quantity(robot.joint_types[joint]), loaded.units)
    for path in _targets(loaded, finding.move):
        for key in (joint, robot.joint_names[joint]):
            node = loaded.document.node((*path, "joints", key))
            number = None if node is None else node.value
            if isinstance(number, int | float) and math.isclose(number, wanted, rel_tol=_WRITTEN):
                return loaded.document.place((*path, "joints", key))
    return None


def _targets(loaded: LoadedJob, move: int) -> Iterator[tuple[str | int, ...]]:
    """Yield the paths of the targets of a move, then of its start; of a name that of its point."""
    through = loaded.document.node(("moves", move, "through"))
    count = len(through.value) if through is not None and isinstance(through.value, list) else 0
    points = (("moves", move, "through", k) for k in range(count))
    for path in [*points, ("moves", move, "to"), ("moves", max(move - 1, 0), "to")]:
        node = loaded.document.node(path)
        name = None if node is None else node.value
        yield ("points", name) if isinstance(name, str) and name in loaded.job.points else path
