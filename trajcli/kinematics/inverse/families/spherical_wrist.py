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

The last three turns of an arm: two that bring the last axis to its direction, one that turns the tool.

With R what the joints before have done, R^-1 G = R(first) R(second) R(last). The first two bring the last
axis to R^-1 G last, two answers; the third is found from how the tool sees the first axis. Where first and
last axis are in line only the sum of their turns is fixed: the first is zero then, the last makes the sum.

Source: Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 3.3.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import VectorEntries, cross, dot
from trajcli.kinematics.inverse.families.elbow import same_way
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.positioning import PositioningStructure, positioning_structure
from trajcli.kinematics.inverse.families.screw_axes import (
    AxisGeometry,
    Displacement,
    Floats,
    InverseDisplacement,
    ScrewAxis,
    across_floats,
    aside,
    common_point,
    parallel,
)
from trajcli.kinematics.inverse.families.subproblems import (
    FREE,
    DegeneracyFlags,
    Mirrored,
    Opposed,
    Turn,
    Value,
    across,
    added,
    onto,
    square_wrist,
    turned,
    turned_back,
    two_turns,
    unit,
)

Axes = tuple[Floats, Floats, Floats]
WristTurns = tuple[Turn | Mirrored, Turn | Opposed, Turn | Mirrored]


def wrist_turns(
    axes: Axes,
    back: Callable[[VectorEntries], VectorEntries],
    first_axis: VectorEntries,
    goal: Displacement,
    watch: DegeneracyFlags,
) -> WristTurns:
    """Return the turns about three axes, with one more choice.

    Args:
        axes: First, second and last axis at zero.
        back: Takes a direction to what it was before the joints before the hand moved.
        first_axis: Where the first axis points.
        goal: The displacement of the tool.
        watch: Of the block.
    """
    first, second, last = axes
    aim = back(goal.direction(last))
    around, bend = two_turns(first, second, last, aim, watch)
    end = _last(axes, bend, first_axis, goal, watch)
    aligned = np.asarray(_distance(aim, first, bend) < FREE)
    if not aligned.any():
        return around, bend, end
    marker = aside(last)
    pair = bend.turn if isinstance(bend, Opposed) else bend
    if isinstance(around, Mirrored) and not isinstance(bend, Opposed):
        pair = np.asarray(bend[0])[0], np.asarray(bend[1])[0]
    seen = turned_back(back(goal.direction(marker)), second, pair)
    total = unit(onto(last, marker, seen), watch)
    return _replaced(around, aligned, (1.0, 0.0)), bend, _replaced(end, aligned, total)


def _distance(aim: VectorEntries, axis: Floats, bend: Turn | Opposed) -> Array:
    """Return how far the unit vector `aim` is from an axis: the sine of a square wrist's bend."""
    if isinstance(bend, Opposed):
        return bend.turn[1]
    away = across(aim, axis)
    return np.asarray(np.sqrt(dot(away, away)))


def _replaced(value: Turn | Mirrored, where: Flags, turn: Turn) -> Turn | Mirrored:
    """Return a value with another turn in some places."""
    old = value.turn if isinstance(value, Mirrored) else value
    new = np.where(where, turn[0], old[0]), np.where(where, turn[1], old[1])
    return Mirrored(new) if isinstance(value, Mirrored) else new


def _last(
    axes: tuple[Floats, Floats, Floats],
    bend: Turn | Opposed,
    first_axis: VectorEntries,
    goal: Displacement,
    watch: DegeneracyFlags,
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
    return unit((dot(across(bent, last), view), dot(cross(bent, last), view)), watch, FREE)


@frozen
class SphericalWrist:
    """The solver of one arm."""

    base: PositioningStructure
    lines: tuple[ScrewAxis, ...]
    center: Floats

    def __call__(self, goal: Displacement, watch: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints: choices of the base, then wrist."""
        four, five, six = (line.direction for line in self.lines)
        values = self.base.reach(self.center, goal.point(self.center), watch)
        turns = _turns(self.base.lines, values)
        axis_four: VectorEntries = four
        for axis, turn in reversed(turns):
            axis_four = turned(axis_four, axis, turn)
        back = partial(_back, turns)
        return [*values, *wrist_turns((four, five, six), back, axis_four, goal, watch)]


def match(arm: AxisGeometry) -> IkMethod | None:
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
        return IkMethod(name, "spherical wrist", (*base.choices, "wrist"), reason, run)
    return None


def reversed_arm(arm: AxisGeometry) -> AxisGeometry:
    """Return the arm read from the tool to the base: the inverse displacement has the same joint values."""
    return replace(arm, lines=tuple(line.opposite for line in reversed(arm.lines)))


def _solver(arm: AxisGeometry) -> SphericalWrist | None:
    if len(arm.lines) != 6 or arm.kinds[3:] != "RRR":
        return None
    center, base = common_point(arm.lines[3:], arm.length), positioning_structure(arm)
    if center is None or base is None:
        return None
    return SphericalWrist(base, arm.lines[3:], center)


def _backwards(solver: SphericalWrist, goal: Displacement, watch: DegeneracyFlags) -> Sequence[Value]:
    return list(solver(InverseDisplacement(goal), watch))[::-1]


def _back(turns: Sequence[tuple[Floats, Turn]], vector: VectorEntries) -> VectorEntries:
    """Return a direction as it was before the turns."""
    for axis, turn in turns:
        vector = turned_back(vector, axis, turn)
    return vector


def _turns(lines: Sequence[ScrewAxis], values: Sequence[Value]) -> list[tuple[Floats, Turn]]:
    """Return the axes and turns of the joints that turn, neighbours about parallel axes as one."""
    result: list[tuple[Floats, Turn]] = []
    previous: ScrewAxis | None = None
    for line, value in zip(lines, values, strict=True):
        if not isinstance(value, tuple):
            continue
        if previous is not None and parallel(previous, line):
            result[-1] = previous.direction, added(result[-1][1], value, same_way(previous, line))
            continue
        result.append((line.direction, value))
        previous = line
    return result
