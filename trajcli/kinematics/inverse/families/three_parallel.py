"""Arms whose joints 2, 3 and 4 turn about parallel axes: elbow and pitch (4R), and roll (5R), UR (6R).

Turns about the three do not change what lies along them, h = h2:

1. h . R1^-1 (G w - o1) = h . (w - o1) gives joint 1, for a point w that the joints after the fourth do not
   move: the tcp (4R), a point of axis 5 (5R), the point where axes 5 and 6 meet (6R). Two answers.
2. What is left, R1^-1 G = R(h, s) R5 R6, tells the sum s of the three angles and the joints after: with six
   joints the last axis is brought to its direction by s and joint 5, two answers; with fewer, s is the angle
   of one vector. The last joint is found from how the tool sees h.
3. The place of axis 4 is then known, and joints 2 and 3 are a pair of parallel turns. Two answers; joint 4 is
   what lacks to s.

Four solutions for the 4R and 5R arms, eight for the 6R. Where axis 6 is parallel to h only three of the four
angles about that direction are fixed. A 4R arm meets a pose only if its tool can stand so, a 5R arm likewise;
closure tells by how much it cannot.

Source: Hawkins, Analytic inverse kinematics for the Universal Robots UR-5/UR-10 arms (2013), here from lines
instead of lengths; Siciliano, Sciavicco, Villani and Oriolo, Robotics (2009), section 2.12.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from trajcli.frozen import frozen
from trajcli.kinematics.columns import VectorEntries, cross, dot, minus, product
from trajcli.kinematics.inverse.families.elbow import (
    before,
    forward_sign,
    parallel_pair,
    same_way,
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

    def __call__(self, goal: Displacement, watch: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints: choices shoulder, wrist where there are six joints, elbow."""
        one, two, three, four = self.arm.lines[:4]
        axis = two.direction
        target = goal.point(self.point)
        sign = forward_sign(one, two, self.arm.forward)
        first = shoulder_turn(one, axis, self.point, target, watch, sign)
        total, after = self._sum(goal, first, watch)
        aim = minus(before(one, target, first), turned(minus(self.point, four.point), axis, total))
        up = across_floats(one.direction, axis)
        second, third = parallel_pair(two, three, four.point, aim, watch, up)
        rest = added(added(total, second, -1.0), third, -same_way(two, three))
        fourth = rest[0], product(same_way(two, four), rest[1])
        return [first, second, third, fourth, *after]

    def _sum(self, goal: Displacement, first: Turn, watch: DegeneracyFlags) -> tuple[Turn, list[Value]]:
        """Return the turn about h that joints 2 to 4 make together, and the turns of the joints after."""
        one, two, *_, last = self.arm.lines
        axis = two.direction
        seen = turned(axis, one.direction, first)
        if len(self.arm.lines) == 6:
            five = self.arm.lines[4].direction
            axes = axis, five, last.direction
            total, fifth, sixth = wrist_turns(
                axes, partial(turned_back, axis=one.direction, turn=first), seen, goal, watch
            )
            return total.both() if isinstance(total, Mirrored) else total, [fifth, sixth]
        marker = last.direction if len(self.arm.lines) == 5 else across_floats(one.direction, axis)
        aim = turned_back(goal.direction(marker), one.direction, first)
        return unit(onto(axis, marker, aim), watch), [_roll(goal, last.direction, axis, seen, watch)] if len(
            self.arm.lines
        ) == 5 else []


def _roll(
    goal: Displacement, last: Floats, axis: Floats, seen: VectorEntries, watch: DegeneracyFlags
) -> Turn:
    """Return the angle about the last axis after which the tool sees h where it points."""
    cosine = dot(goal.direction(across(axis, last)), seen)
    sine = dot(goal.direction(cross(axis, last)), seen)
    return unit((cosine, sine), watch)


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where axes 2, 3 and 4 are parallel, 1 is not, and the rest fits."""
    count, lines = len(arm.lines), arm.lines
    if not 4 <= count <= 6 or set(arm.kinds) != {"R"} or not parallel(*lines[1:4]) or parallel(*lines[:2]):
        return None
    reason, choices = "axes 2, 3 and 4 are parallel", ["shoulder", "elbow"]
    point: Floats | None = (float(arm.home[0, 3]), float(arm.home[1, 3]), float(arm.home[2, 3]))
    if count > 4 and parallel(lines[3], lines[4]):
        return None
    if count == 5:
        point = lines[4].point
        reason += " and axis 5 is not"
    if count == 6:
        if parallel(lines[4], lines[5]):
            return None
        point = meeting_point(lines[4], lines[5], arm.length)
        choices.insert(1, "wrist")
        reason += " and axes 5 and 6 meet"
    if point is None:
        return None
    names: tuple[Choice, ...] = tuple(choices)  # type: ignore[arg-type]
    return IkMethod(_NAMES[count], _NAMES[count], names, reason, ThreeParallel(arm, point))
