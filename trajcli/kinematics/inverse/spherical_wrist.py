"""Six joints of which the last three turn about axes that meet in one point.

The point does not move with the wrist, so the first three joints bring it to G w: as many answers as the base
has (`bases`: four for the elbow and Stanford bases, two for the cylindrical, one for the Cartesian). With
their rotation R the wrist has to make R^-1 G: joints 4 and 5 bring axis 6 to its direction, two answers, and
joint 6 turns the rest. Eight solutions over a base with four.

Where axis 5 is at right angles to both others the two answers differ by half a turn of joints 4 and 6 and the
sign of joint 5's bend: "no_flip" is the positive one. Where the bend vanishes only the sum (or difference) of
joints 4 and 6 is fixed.

An arm whose first three axes meet is the same read from the tool to the base.

Source: Pieper, The Kinematics of Manipulators under Computer Control (1968); Siciliano, Sciavicco, Villani
and Oriolo, Robotics: Modelling, Planning and Control (2009), section 2.12.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from trajcli.kinematics.columns import Column, cross, dot
from trajcli.kinematics.inverse.bases import Base, base_of
from trajcli.kinematics.inverse.elbow import same_way
from trajcli.kinematics.inverse.lines import (
    Arm,
    Floats,
    Goal,
    InverseGoal,
    Line,
    across_floats,
    common_point,
    parallel,
)
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.inverse.subproblems import (
    Mirrored,
    Opposed,
    Turn,
    Value,
    Watch,
    across,
    added,
    square_wrist,
    turned,
    turned_back,
    two_turns,
    unit,
)


@dataclass(frozen=True, eq=False)
class SphericalWrist:
    """The solver of one arm."""

    base: Base
    lines: tuple[Line, ...]
    center: Floats

    def __call__(self, goal: Goal, watch: Watch) -> Sequence[Value]:
        """Return the joints: choices of the base, then wrist."""
        four, five, six = (line.direction for line in self.lines)
        values = self.base.reach(self.center, goal.point(self.center), watch)
        turns = _turns(self.base.lines, values)
        aim = goal.direction(six)
        for axis, turn in turns:
            aim = turned_back(aim, axis, turn)
        fourth, fifth = two_turns(four, five, six, aim, watch)
        axis_four: Column = four
        for axis, turn in reversed(turns):
            axis_four = turned(axis_four, axis, turn)
        last = last_turn((four, five, six), fifth, axis_four, goal, watch)
        return [*values, fourth, fifth, last]


def last_turn(
    axes: tuple[Floats, Floats, Floats], bend: Turn | Opposed, first_axis: Column, goal: Goal, watch: Watch
) -> Turn | Mirrored:
    """Return the turn about the last axis: it brings the tool's view of the first axis to where it must be.

    Args:
        axes: The three axes at zero.
        bend: The turns about the second.
        first_axis: Where the first axis points.
        goal: The displacement of the tool.
        watch: Right after the turns about the first two, so that their choice is its last.
    """
    first, second, last = axes
    if square_wrist(first, second, last):
        side = goal.direction(across_floats(last, second))
        seen = dot(side, first_axis), dot(goal.direction(second), first_axis)
        return watch.mirrored(unit(seen, watch))
    view = goal.view(first_axis)
    bent = turned_back(first, second, bend.both() if isinstance(bend, Opposed) else bend)
    return unit((dot(across(bent, last), view), dot(cross(bent, last), view)), watch)


def match(arm: Arm) -> Method | None:
    """Return the method where the arm has six joints, a spherical wrist and a base that `bases` knows."""
    for backwards in (False, True):
        solver = _solver(reversed_arm(arm) if backwards else arm)
        if solver is None:
            continue
        base = solver.base
        joints = (
            "3, 2 and 1 meet in one point, and joints 6 to 4"
            if backwards
            else ("4, 5 and 6 meet in one point, and joints 1 to 3")
        )
        reason = f"axes {joints} ({''.join('RP'[line.prismatic] for line in base.lines)}) are a {base.name}"
        name = f"spherical {'shoulder under' if backwards else 'wrist over'} {base.name}"
        run = partial(_backwards, solver) if backwards else solver
        return Method(name, "spherical wrist", (*base.choices, "wrist"), reason, run)
    return None


def reversed_arm(arm: Arm) -> Arm:
    """Return the arm read from the tool to the base: the inverse displacement has the same joint values."""
    return replace(arm, lines=tuple(line.opposite for line in reversed(arm.lines)))


def _solver(arm: Arm) -> SphericalWrist | None:
    if len(arm.lines) != 6 or arm.kinds[3:] != "RRR":
        return None
    center, base = common_point(arm.lines[3:], arm.length), base_of(arm)
    if center is None or base is None:
        return None
    return SphericalWrist(base, arm.lines[3:], center)


def _backwards(solver: SphericalWrist, goal: Goal, watch: Watch) -> Sequence[Value]:
    return list(solver(InverseGoal(goal), watch))[::-1]


def _turns(lines: Sequence[Line], values: Sequence[Value]) -> list[tuple[Floats, Turn]]:
    """Return the axes and turns of the joints that turn, neighbours about parallel axes as one."""
    result: list[tuple[Floats, Turn]] = []
    previous: Line | None = None
    for line, value in zip(lines, values, strict=True):
        if not isinstance(value, tuple):
            continue
        if previous is not None and parallel(previous, line):
            result[-1] = previous.direction, added(result[-1][1], value, same_way(previous, line))
            continue
        result.append((line.direction, value))
        previous = line
    return result
