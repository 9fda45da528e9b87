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
from dataclasses import replace
from functools import partial

from trajcli.frozen import frozen
from trajcli.kinematics.columns import Column
from trajcli.kinematics.inverse.bases import Base, base_of
from trajcli.kinematics.inverse.elbow import same_way
from trajcli.kinematics.inverse.hand import hand
from trajcli.kinematics.inverse.lines import (
    Arm,
    Floats,
    Goal,
    InverseGoal,
    Line,
    common_point,
    parallel,
)
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.inverse.subproblems import (
    Turn,
    Value,
    Watch,
    added,
    turned,
    turned_back,
)


@frozen
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
        axis_four: Column = four
        for axis, turn in reversed(turns):
            axis_four = turned(axis_four, axis, turn)
        back = partial(_back, turns)
        return [*values, *hand((four, five, six), back, axis_four, goal, watch)]


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
        reason = (
            f"axes {joints} ({''.join('RP'[line.prismatic] for line in base.lines)}) place it ({base.name})"
        )
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


def _back(turns: Sequence[tuple[Floats, Turn]], vector: Column) -> Column:
    """Return a direction as it was before the turns."""
    for axis, turn in turns:
        vector = turned_back(vector, axis, turn)
    return vector


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
