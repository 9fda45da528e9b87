"""Spherical wrist: six joints of which the last three turn about axes that meet in one point.

The wrist centre w does not move with the wrist, so the first three joints bring it to G w: as many solutions
as their positioning structure has. With their rotation R, R^-1 G = R(first) R(second) R(last) is left for the
wrist: its first two joints bring the last axis to R^-1 G last, two solutions, and joint 6 is found from how
the tool sees the first axis. Eight solutions over a structure with four.

Where axis 5 is at right angles to both others the two solutions differ by half a turn of joints 4 and 6 and
the sign of joint 5's bend: "no_flip" is the positive one, from axis 4 to axis 6 about axis 5 as the table
draws them, whichever way the joints count and wherever they are zero. Where first and last axis are in line
only the sum (or difference) of their turns is fixed: the first is zero then, the last makes the sum.

An arm whose first three axes meet is the same read from the tool to the base.

Source: Pieper (1968); Murray, Li and Sastry (1994), section 3.3.2; Siciliano et al. (2009), section 2.12.5.
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
from trajcli.kinematics.inverse.families.elbow import same_direction
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

WristAxes = tuple[ScrewAxis, ScrewAxis, ScrewAxis]
WristTurns = tuple[Turn | Mirrored, Turn | Opposed, Turn | Mirrored]


def wrist_turns(
    axes: WristAxes,
    back: Callable[[VectorEntries], VectorEntries],
    first_axis: VectorEntries,
    goal: Displacement,
    flags: DegeneracyFlags,
) -> WristTurns:
    """Return the turns about three axes, with one more choice.

    Args:
        axes: The first, second and last axis at zero.
        back: Takes a direction to what it was before the joints before the wrist moved.
        first_axis: Where the first axis points.
        goal: The displacement of the tool.
        flags: Of the block.
    """
    first, second, last = (axis.direction for axis in axes)
    sign = axes[0].sign * axes[1].sign * axes[2].sign
    aim = back(goal.direction(last))
    around, bend = two_turns(first, second, last, aim, flags, sign)
    end = _last((first, second, last), bend, first_axis, goal, flags, sign)
    aligned = np.asarray(_distance(aim, first, bend) < FREE)
    if not aligned.any():
        return around, bend, end
    marker = aside(last)
    pair = bend.turn if isinstance(bend, Opposed) else bend
    if isinstance(around, Mirrored) and not isinstance(bend, Opposed):
        pair = np.asarray(bend[0])[0], np.asarray(bend[1])[0]
    seen = turned_back(back(goal.direction(marker)), second, pair)
    total = unit(onto(last, marker, seen), flags)
    return _replaced(around, aligned, (1.0, 0.0)), bend, _replaced(end, aligned, total)


def _distance(aim: VectorEntries, axis: Floats, bend: Turn | Opposed) -> Array:
    """Return how far the unit vector `aim` is from an axis: the sine of a square wrist's bend."""
    if isinstance(bend, Opposed):
        return np.abs(bend.turn[1])
    away = across(aim, axis)
    return np.asarray(np.sqrt(dot(away, away)))


def _replaced(value: Turn | Mirrored, where: Flags, turn: Turn) -> Turn | Mirrored:
    old = value.turn if isinstance(value, Mirrored) else value
    new = np.where(where, turn[0], old[0]), np.where(where, turn[1], old[1])
    return Mirrored(new) if isinstance(value, Mirrored) else new


def _last(
    directions: tuple[Floats, Floats, Floats],
    bend: Turn | Opposed,
    first_axis: VectorEntries,
    goal: Displacement,
    flags: DegeneracyFlags,
    sign: float,
) -> Turn | Mirrored:
    """Return the turn about the last axis that brings the tool's view of the first to where it must be."""
    first, second, last = directions
    if square_wrist(first, second, last):
        second = second if sign > 0.0 else (-second[0], -second[1], -second[2])
        side = goal.direction(across_floats(last, second))
        seen = dot(side, first_axis), dot(goal.direction(second), first_axis)
        return flags.mirrored(unit(seen, flags))
    view = goal.view(first_axis)
    bent = turned_back(first, second, bend.both() if isinstance(bend, Opposed) else bend)
    return unit((dot(across(bent, last), view), dot(cross(bent, last), view)), flags, FREE)


@frozen
class SphericalWrist:
    """The solver of one arm."""

    structure: PositioningStructure
    axes: tuple[ScrewAxis, ...]
    center: Floats

    def __call__(self, goal: Displacement, flags: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints: choices of the positioning structure, then wrist."""
        four, five, six = self.axes
        values = self.structure.solve(self.center, goal.point(self.center), flags)
        turns = _turns(self.structure.axes, values)
        axis_four: VectorEntries = four.direction
        for direction, turn in reversed(turns):
            axis_four = turned(axis_four, direction, turn)
        back = partial(_back, turns)
        return [*values, *wrist_turns((four, five, six), back, axis_four, goal, flags)]


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where the arm has six joints, a spherical wrist and a positioning structure."""
    for backwards in (False, True):
        solver = _solver(reversed_arm(arm) if backwards else arm, from_base=not backwards)
        if solver is None:
            continue
        structure = solver.structure
        joints = (
            "3, 2 and 1 meet in one point, and joints 6 to 4"
            if backwards
            else ("4, 5 and 6 meet in one point, and joints 1 to 3")
        )
        kinds = "".join("RP"[axis.prismatic] for axis in structure.axes)
        reason = f"axes {joints} ({kinds}) place it ({structure.name})"
        name = f"spherical {'shoulder under' if backwards else 'wrist over'} {structure.name}"
        run = partial(_backwards, solver) if backwards else solver
        return IkMethod(name, "spherical wrist", (*structure.choices, "wrist"), reason, run)
    return None


def reversed_arm(arm: AxisGeometry) -> AxisGeometry:
    """Return the arm read from the tool to the base: the inverse displacement has the same joint values."""
    return replace(arm, axes=tuple(axis.opposite for axis in reversed(arm.axes)))


def _solver(arm: AxisGeometry, *, from_base: bool) -> SphericalWrist | None:
    if len(arm.axes) != 6 or arm.kinds[3:] != "RRR":
        return None
    center, structure = (
        common_point(arm.axes[3:], arm.length),
        positioning_structure(arm, from_base=from_base),
    )
    if center is None or structure is None:
        return None
    return SphericalWrist(structure, arm.axes[3:], center)


def _backwards(solver: SphericalWrist, goal: Displacement, flags: DegeneracyFlags) -> Sequence[Value]:
    return list(solver(InverseDisplacement(goal), flags))[::-1]


def _back(turns: Sequence[tuple[Floats, Turn]], vector: VectorEntries) -> VectorEntries:
    for axis, turn in turns:
        vector = turned_back(vector, axis, turn)
    return vector


def _turns(axes: Sequence[ScrewAxis], values: Sequence[Value]) -> list[tuple[Floats, Turn]]:
    """Return the axes and turns of the joints that turn, neighbours about parallel axes as one."""
    result: list[tuple[Floats, Turn]] = []
    previous: ScrewAxis | None = None
    for axis, value in zip(axes, values, strict=True):
        if not isinstance(value, tuple):
            continue
        if previous is not None and parallel(previous, axis):
            result[-1] = previous.direction, added(result[-1][1], value, same_direction(previous, axis))
            continue
        result.append((axis.direction, value))
        previous = axis
    return result
