"""Three parallel axes, of joints 2 to 4: arms with elbow and pitch (4R), with roll (5R), and UR (6R).

Turns about the three do not change what lies along them, h = h2:

1. h . R1^-1 (G w - o1) = h . (w - o1) gives joint 1, for a point w that the joints after the fourth do not
   move: the tcp (4R), a point of axis 5 (5R), the point where axes 5 and 6 meet (6R). Two solutions.
2. What is left, R1^-1 G = R(h, s) R5 R6, gives the sum s of the three angles and the joints after: with six
   joints the last axis is brought to its direction by s and joint 5, two solutions; with fewer, s is the
   angle of one vector. The last joint is found from how the tool sees h.
3. The position of axis 4 is then known, and joints 2 and 3 are a pair of parallel turns. Two solutions; joint
   4 makes the sum s.

Four solutions for the 4R and 5R arms, eight for the 6R. Where axis 6 is parallel to h only three of the four
angles about that direction are fixed. A 4R or 5R arm meets a pose only if it can give its tool that
orientation; the residual says by how much it cannot.

Source: Hawkins, Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms (2013), here from screw
axes instead of lengths; Siciliano et al. (2009), section 2.12.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from trajcli.frozen import frozen
from trajcli.kinematics.columns import VectorEntries, cross, dot, minus, product
from trajcli.kinematics.inverse.families.elbow import (
    before_turn,
    forward_sign,
    parallel_pair,
    same_direction,
    shoulder_turn,
)
from trajcli.kinematics.inverse.families.method import Choice, IkMethod
from trajcli.kinematics.inverse.families.screw_axes import (
    AxisGeometry,
    Displacement,
    Floats,
    across_floats,
    meeting_point,
    parallel,
)
from trajcli.kinematics.inverse.families.spherical_wrist import wrist_turns
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Mirrored,
    Turn,
    Value,
    across,
    added,
    onto,
    turned,
    turned_back,
    unit,
)

_NAMES = {4: "elbow and pitch", 5: "elbow, pitch and roll", 6: "three parallel axes (UR)"}


@frozen
class ThreeParallel:
    """The solver of one arm.

    Attributes:
        arm: Four to six joints, the second to fourth about parallel axes.
        point: A point, at zero, that the joints after the fourth do not move.
    """

    arm: AxisGeometry
    point: Floats

    def __call__(self, goal: Displacement, flags: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints: choices shoulder, wrist where there are six joints, elbow."""
        one, two, three, four = self.arm.axes[:4]
        axis = two.direction
        target = goal.point(self.point)
        sign = forward_sign(one, two, self.arm.forward)
        first = shoulder_turn(one, axis, self.point, target, flags, sign)
        total, after = self._sum(goal, first, flags)
        aim = minus(before_turn(one, target, first), turned(minus(self.point, four.point), axis, total))
        up = across_floats(self.arm.upward, axis)
        second, third = parallel_pair(two, three, four.point, aim, flags, up)
        lacking = added(added(total, second, -1.0), third, -same_direction(two, three))
        fourth = lacking[0], product(same_direction(two, four), lacking[1])
        return [first, second, third, fourth, *after]

    def _sum(self, goal: Displacement, first: Turn, flags: DegeneracyFlags) -> tuple[Turn, list[Value]]:
        """Return the turn about h that joints 2 to 4 make together, and the turns of the joints after."""
        one, two, *_, last = self.arm.axes
        axis = two.direction
        seen = turned(axis, one.direction, first)
        if len(self.arm.axes) == 6:
            five = self.arm.axes[4]
            back = partial(turned_back, axis=one.direction, turn=first)
            total, fifth, sixth = wrist_turns((two, five, last), back, seen, goal, flags)
            return total.both() if isinstance(total, Mirrored) else total, [fifth, sixth]
        marker = last.direction if len(self.arm.axes) == 5 else across_floats(one.direction, axis)
        aim = turned_back(goal.direction(marker), one.direction, first)
        total = unit(onto(axis, marker, aim), flags)
        return total, [_roll(goal, last.direction, axis, seen, flags)] if len(self.arm.axes) == 5 else []


def _roll(
    goal: Displacement, last: Floats, axis: Floats, seen: VectorEntries, flags: DegeneracyFlags
) -> Turn:
    """Return the angle about the last axis after which the tool sees h where it points."""
    cosine = dot(goal.direction(across(axis, last)), seen)
    sine = dot(goal.direction(cross(axis, last)), seen)
    return unit((cosine, sine), flags)


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where axes 2, 3 and 4 are parallel, 1 is not, and the rest fits."""
    count, axes = len(arm.axes), arm.axes
    if not 4 <= count <= 6 or set(arm.kinds) != {"R"} or not parallel(*axes[1:4]) or parallel(*axes[:2]):
        return None
    reason, choices = "axes 2, 3 and 4 are parallel", ["shoulder", "elbow"]
    point: Floats | None = arm.tip
    if count > 4 and parallel(axes[3], axes[4]):
        return None
    if count == 5:
        point = axes[4].point
        reason += " and axis 5 is not"
    if count == 6:
        point = meeting_point(axes[4], axes[5], arm.length)
        choices.insert(1, "wrist")
        reason += " and axes 5 and 6 meet"
    if point is None:
        return None
    names: tuple[Choice, ...] = tuple(choices)  # type: ignore[arg-type]
    return IkMethod(_NAMES[count], _NAMES[count], names, reason, ThreeParallel(arm, point))
