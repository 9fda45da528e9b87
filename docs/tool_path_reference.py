"""The part of the job reference that all moves along a path of the tool share."""

from __future__ import annotations

from docs.fields import field_table
from trajcli.planners.tool_path.arc import ArcFields
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import ToleranceSpec
from trajcli.planners.tool_path.segments import Segment, SegmentLaw
from trajcli.planners.tool_path.weave import WeaveSpec

_PATHS = """\
`line`, `arc`, `path` and `screw` lead the tcp along a path in space; the joints follow. They start and end
at rest. A target is a pose or the name of a point; without `xyz` the tool stays where it is and turns, and
without an orientation it keeps the one it has (an arm with fewer than six joints leaves it free). Joint
values may be a target too: the pose that belongs to them, or its place where that decides them all, as in an
arm with two joints. What a target fixes holds along the whole path: a
target with `yaw` alone fixes nothing but the yaw along the path.

The arm stays on the branch on which it starts, and arrives there: another `configuration` in the target is
refused, and so is a path through a singularity, out of reach, or out of the range of a joint (exit 3, with
the position s on the path and the joint). Joints that a target leaves free are held: see
[concepts](concepts.md#what-a-target-leaves-free).

`orientation` says how the tool turns along the path: `axis_angle` about one fixed axis by the shortest angle,
evenly in s; `euler` evenly in the three angles in which the target is given (`euler` or `rpy`, in world or
in a frame whose axes are those of world), from those of the start that are nearest to them (see below for
angles beyond 180 deg); `fixed` not at all; `tangent` with the path, so that the tool
keeps its attitude to it, as along a seam.

Angles beyond 180 deg are meant as they are typed: with `orientation: euler` the tool turns from 0 to 270 deg
by 270 deg, to 360 deg by a full turn, to -270 deg the other way round. They are counted from the angles in
which the job's `start`, or the target of the move before, was typed (in the same sequence and frame); where
these were not typed, from the angle of the start within 180 deg. From a start typed as 270 deg a target of 0
is reached by 270 deg back, and one of 360 deg by 90 deg on."""

_LAW = """\
How s grows with time. Speeds, accelerations and the jerk that the law does not name are those of
[`limits.tcp`](#limits-of-the-tool). With a `duration` no limit makes a law slower: it does what it names, and
the limits are verified. A polynomial then needs none, and a trapezoid the law's `speed`, or an acceleration;
a polynomial that would exceed a speed, an acceleration or a jerk that the law names beside is refused. A
path has one law from end to end, and its largest bend bounds the speed everywhere; only `time_optimal`
goes point by point.

Limits of joints are not looked at when a law is made, only when the move is verified, except by
`time_optimal`, which needs and keeps those of velocity and acceleration. A turn that the target leaves free
counts as the arm makes it, except where segments overlap. A move that is too fast is refused with the
factor, or stretched by it: `when_over_limit: slow`.

Along a bent path the tool also accelerates across. Of an acceleration in `limits.tcp`, 0.6 goes along the
path and 0.8 across where a path is bent anywhere (`time_optimal` divides it point by point). The
`acceleration` of the law is the one along the path alone; what comes across is then only verified."""

_TOLERANCE = """\
How near the joints' curve comes to the exact one; velocities and accelerations likewise, as a part of their
peaks. Finer means more pieces: at most 4096 for a move, and 256 more
for each place where path or law change. Where `limits.tcp` has limits, the curve comes as near as 1e-6
whatever is said here: else a tool whose law is at a limit would be above it."""

_SEGMENTS = """\
A segment begins where the one before it ends. `radius` is the length before and after the corner at its end
over which the path is rounded; it stands here for one corner or in the move for all. `radius: 0` stops at
that corner alone.

In the place of the list `{csv: FILE}` names a file of poses, to which lines lead: columns `x`, `y`, `z` (m,
or `x_mm` ...), and `qw`, `qx`, `qy`, `qz`, as the columns `pose` are written; without these the orientation
is kept. A first row where the tool stands is the start. `in` is the [frame](programs.md#frames) in which they
are given, and poses no further than `merge` from the one before are left out (the event `merged`)."""

_SEGMENT_LAWS = """\
Speeds of the tool on one segment, in the place of those of the move's law (or of
[`limits.tcp`](#limits-of-the-tool)). The move's law has the shape `time_optimal`, which steps from one speed
to the next within all limits. Of a rounded corner each of its two segments has its half. The speeds are
verified for all t on each segment; reports, `explain` and pictures show them."""

_WEAVE = """\
A swing to both sides of `line`, `arc` and `path`, across the path and square to the tool's z axis, or along
the part of `side` that is square to the path. `s`, the law and `at` are of the path without it: `speed: 10
mm/s` is along the seam, and what the tool does on top is verified against `limits.tcp`. Where the law names
no speed that of `limits.tcp` holds for the tool. The corners of a triangle and a trapezoid are rounded
within 5 % of a cycle, so that the path has a continuous second derivative, and the amplitude is reached. It
begins and ends on the seam, as at every stop; where neither whole nor half cycles fit, their length is
changed so that whole ones do (`weave_fitted`). A weave cannot be flown by."""

_ARCS = """\
Three ways to say which one: through `via` to `to`; about `center` to `to`, the shorter way round, or
right-handed about `axis`; about `center` and `axis` by a signed `angle`, also several turns, with `pitch` a
helix. A center may be off by 0.001 of the radius: it is moved, with an event. Half a turn to a target needs
`axis`."""

_OF_MOVE = dict.fromkeys(("speed", "angular_speed"), "from the move's `law`")
_SI = {"position": "`1e-6` m", "angle": "`1e-6` rad"}
_TAKEN = ("speed", "acceleration", "jerk", "angular_speed", "angular_acceleration")
_FROM_LIMITS = dict.fromkeys(_TAKEN, "from `limits.tcp`") | {
    "duration": "from the limits",
    "deceleration": "as `acceleration`",
}


def tool_path_sections() -> list[str]:
    """Return the sections on what moves along a path of the tool have in common."""
    parts = ["## Along a path of the tool", _PATHS, "### Law", _LAW, field_table(LawSpec, _FROM_LIMITS)]
    parts += ["### Tolerance", _TOLERANCE, field_table(ToleranceSpec, _SI)]
    parts += ["### Segments", _SEGMENTS, field_table(Segment)]
    parts += ["### Laws of segments", _SEGMENT_LAWS, field_table(SegmentLaw, _OF_MOVE)]
    parts += ["### Weave", _WEAVE, field_table(WeaveSpec)]
    parts += ["### Arcs", _ARCS, field_table(ArcFields)]
    return parts
