"""Planar arms and SCARA: all turns are about parallel axes (2R, 3R, RP and RPR, and 3R with a slide).

Seen along the axes k the arm is planar; slides along k commute with all of it, wherever they are in the
chain. The angle of the tool about k is the sum of the turns.

* 2R and RP: the tcp's position in the plane, two solutions each.
* 3R (and a slide: RRPR, RRRP, PRRR, RPRR): the position of the third axis is that of a point of the tool,
  joints 1 and 2 bring it there, two solutions; joint 3 completes the angle of the tool, the slide is the
  difference in height.
* RPR: the same with a turn and a slide in the plane: two solutions.

"Up" has the elbow on the left of the line from shoulder to point, seen against k of the first turn; of a
slide it is the longer one.

Source: Siciliano et al. (2009), section 2.12.1; Craig (2005), chapter 4.
"""

from __future__ import annotations

from collections.abc import Sequence

from trajcli.frozen import frozen
from trajcli.kinematics.columns import dot, minus, product
from trajcli.kinematics.inverse.families.elbow import parallel_pair, same_direction
from trajcli.kinematics.inverse.families.method import IkMethod
from trajcli.kinematics.inverse.families.positioning import turn_and_slide
from trajcli.kinematics.inverse.families.screw_axes import (
    AxisGeometry,
    Displacement,
    Floats,
    ScrewAxis,
    aside,
    parallel,
    perpendicular,
)
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Turn,
    Value,
    added,
    onto,
    unit,
)

_NAMES = {"RR": "planar 2R", "RP": "planar RP", "RRR": "planar 3R", "RPR": "planar RPR"}


@frozen
class Planar:
    """The solver of one arm.

    Attributes:
        plane: The joints that move in the plane: RR, RP, RRR or RPR.
        indices: Of these joints in the chain.
        rise: Index of the slide along k; None where there is none.
        axes: All joints.
        tip: The tcp at zero.
    """

    plane: tuple[ScrewAxis, ...]
    indices: tuple[int, ...]
    rise: int | None
    axes: tuple[ScrewAxis, ...]
    tip: Floats

    def __call__(self, goal: Displacement, flags: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints: choice elbow."""
        one, two, *after = self.plane
        point = after[0].point if after else self.tip
        aim = goal.point(point)
        first: Turn
        values: list[Value] = [0.0] * len(self.axes)
        if two.prismatic:
            first, slide = turn_and_slide(one, two, point, aim, flags)
            total, values[self.indices[1]] = first, slide
        else:
            first, second = parallel_pair(one, two, point, aim, flags)
            total = added(first, second, same_direction(one, two))
            values[self.indices[1]] = second
        values[self.indices[0]] = first
        if after:
            lacking = added(_angle_of_tool(one, goal, flags), total, -1.0)
            values[self.indices[2]] = lacking[0], product(same_direction(one, after[0]), lacking[1])
        if self.rise is not None:
            slide_axis = self.axes[self.rise].direction
            values[self.rise] = dot(slide_axis, minus(aim, point))
        return values


def _angle_of_tool(one: ScrewAxis, goal: Displacement, flags: DegeneracyFlags) -> Turn:
    marker = aside(one.direction)
    return unit(onto(one.direction, marker, goal.direction(marker)), flags)


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where all turns are about parallel axes and the slides are as in the list above."""
    turns = [axis for axis in arm.axes if not axis.prismatic]
    if not turns or not parallel(*turns):
        return None
    rises = [i for i, axis in enumerate(arm.axes) if axis.prismatic and parallel(axis, turns[0])]
    indices = tuple(i for i in range(len(arm.axes)) if i not in rises)
    plane = tuple(arm.axes[i] for i in indices)
    kinds = "".join("RP"[axis.prismatic] for axis in plane)
    if kinds not in _NAMES or len(rises) > (1 if kinds == "RRR" else 0):
        return None
    if "P" in kinds and not perpendicular(plane[0], plane[1]):
        return None
    solver = Planar(plane, indices, rises[0] if rises else None, arm.axes, arm.tip)
    name = "SCARA" if rises else _NAMES[kinds]
    reason = "all turns are about parallel axes" + (", and the slide runs along them" if rises else "")
    if len(plane) == 3:
        return IkMethod(name, name, ("elbow",), reason, solver)
    return IkMethod(name, name, ("elbow",), reason, solver, "position", turns[0].direction)
