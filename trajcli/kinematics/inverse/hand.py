"""The last three turns of an arm: two that bring the last axis to its direction, one that turns the tool.

With R what the joints before have done, R^-1 G = R(first) R(second) R(last). The first two bring the last
axis to R^-1 G last, two answers; the third is found from how the tool sees the first axis. Where first and
last axis are in line only the sum of their turns is fixed: the first is zero then, the last makes the sum.

Source: Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 3.3.2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import Column, cross, dot
from trajcli.kinematics.inverse.lines import Floats, Goal, across_floats, aside
from trajcli.kinematics.inverse.subproblems import (
    FREE,
    Mirrored,
    Opposed,
    Turn,
    Watch,
    across,
    onto,
    square_wrist,
    turned_back,
    two_turns,
    unit,
)

Axes = tuple[Floats, Floats, Floats]
Hand = tuple[Turn | Mirrored, Turn | Opposed, Turn | Mirrored]


def hand(axes: Axes, back: Callable[[Column], Column], first_axis: Column, goal: Goal, watch: Watch) -> Hand:
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


def _distance(aim: Column, axis: Floats, bend: Turn | Opposed) -> Array:
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
    return unit((dot(across(bent, last), view), dot(cross(bent, last), view)), watch, FREE)
