"""What a person has to say about each planner: a minimal job, and what its fields leave open."""

from __future__ import annotations

_HEAD = "version: 1\nunits: {angle: deg}\nrobot: {joints: 1}\n"
_FROM_20 = "start: {joints: [20]}\nmoves:\n"
_UR5E = (
    "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\n"
    "limits: {acceleration: 800, tcp: {speed: 250, acceleration: 1500, angular_speed: 90,"
    " angular_acceleration: 500}}\n"
    "start: {xyz: [400, 100, 300], rpy: [180, 0, 0], configuration: {elbow: up}}\nmoves:\n"
)

EXAMPLES = {
    "cubic": f"{_HEAD}{_FROM_20}  - {{planner: cubic, to: {{joints: [50]}}, duration: 1}}\n",
    "quintic": (
        f"{_HEAD}start: {{joints: [10], acceleration: 10}}\nmoves:\n"
        "  - {planner: quintic, to: {joints: [90], acceleration: 30}, duration: 4}\n"
    ),
    "septic": f"{_HEAD}{_FROM_20}  - {{planner: septic, to: {{joints: [50]}}, duration: 1}}\n",
    "cycloidal": (
        f"{_HEAD}limits: {{velocity: 60, acceleration: 200}}\n{_FROM_20}"
        "  - {planner: cycloidal, to: {joints: [50]}}\n"
    ),
    "trapezoid": (
        f"{_HEAD}{_FROM_20}  - {{planner: trapezoid, to: {{joints: [50]}}, duration: 1, velocity: 40}}\n"
    ),
    "jerk_limited": (
        f"{_HEAD}limits: {{velocity: 60, acceleration: 200, jerk: 2000}}\n{_FROM_20}"
        "  - {planner: jerk_limited, to: {joints: [50]}}\n"
        "  - {planner: jerk_limited, to: {velocity: 30}}        # a run-up: the position is left open\n"
        "  - {planner: jerk_limited, to: {joints: [20]}}\n"
    ),
    "spline": (
        f"{_HEAD}start: {{joints: [0]}}\nmoves:\n"
        "  - planner: spline                                     # example 5 of Pham's lecture\n"
        "    rule: computed\n"
        "    through: [{joints: [360], time: 2}, {joints: [90], time: 3}]\n"
        "    to: {joints: [180], time: 5}\n"
    ),
    "blends": (
        f"{_HEAD}start: {{joints: [0]}}\nmoves:\n"
        "  - planner: blends                                     # exercise 7 of Pham's lecture\n"
        "    through: [{joints: [360], time: 2}, {joints: [90], time: 3}, {joints: [180], time: 5}]\n"
        "    blend_durations: 0.2\n"
    ),
    "time_optimal": (
        "version: 1\nunits: {angle: deg}\nrobot: {joints: 2}\n"
        "limits: {velocity: 60, acceleration: 200}\nstart: {joints: [0, 0]}\nmoves:\n"
        "  - {planner: time_optimal, through: {positions: [[20, 30], [50, 25]]}, to: {joints: [60, 0]}}\n"
        "  - planner: time_optimal\n"
        "    path: polyline\n"
        "    corner: 3                                           # degrees\n"
        "    through: {positions: [[50, 25], [20, 30], [0, 0]]}\n"
    ),
    "waypoints": (
        "version: 1\nunits: {angle: deg}\nrobot: {joints: 2}\n"
        "limits: {velocity: 60, acceleration: 200, jerk: 2000}\nstart: {joints: [0, 0]}\nmoves:\n"
        "  - {planner: waypoints, through: {positions: [[20, 30], [50, 25]]}, to: {joints: [60, 0]}}\n"
        "  - planner: waypoints\n"
        "    through: [{joints: [50, 25], velocity: {j1: -20}}, {joints: [20, 30]}]\n"
        "    to: {joints: [0, 0]}\n"
        "    minimum_durations: [0.5, 0, 0]                      # s, one for each segment\n"
    ),
    "line": (
        f"{_UR5E}  - {{planner: line, to: {{xyz: [400, 300, 250]}}}}   # keeps its orientation\n"
        "  - {planner: line, to: {rpy: [180, 0, 60]}}                 # rotates about the tcp\n"
        "  - {planner: line, to: {xyz: [400, 100, 300], rpy: [180, 0, 0]},"
        " law: {shape: quintic, duration: 2}}\n"
    ),
    "arc": (
        f"{_UR5E}  - {{planner: arc, via: {{xyz: [450, 150, 300]}}, to: {{xyz: [400, 200, 300]}}}}\n"
        "  - {planner: arc, center: [400, 150, 300], axis: z, to: {xyz: [400, 100, 300]}}\n"
        "  - {planner: arc, center: [400, 150, 300], axis: z, angle: 2 rev, pitch: 15,"
        " law: {speed: 80}}   # a helix\n"
    ),
    "path": (
        f"{_UR5E}  - planner: path\n"
        "    corner: round\n"
        "    radius: 15\n"
        "    segments:\n"
        "      - {line: {xyz: [400, 200, 300]}}\n"
        "      - {line: {xyz: [450, 250, 300]}}\n"
        "      - {arc: {via: {xyz: [500, 200, 300]}, to: {xyz: [450, 150, 300]}}}\n"
        "    law: {shape: time_optimal, speed: 150}\n"
    ),
    "screw": f"{_UR5E}  - {{planner: screw, to: {{xyz: [450, 200, 250], rpy: [180, 0, 90]}}}}\n",
    "hold": f"{_HEAD}{_FROM_20}  - {{planner: hold, duration: 0.5}}\n",
}

FASTEST = "fastest within the limits"
LEFT_OUT = {
    "duration": FASTEST,
    "velocity": "see below",
    "acceleration": "see below",
    "deceleration": "as `acceleration`",
}
"""What it means that a field of a planner is left out."""

_JOINS = """\
What it has in common with the other moves along a path stands [above](#along-a-path-of-the-tool). With a
law of shape `quintic`, `cycloidal` or `jerk_limited` it begins and ends without acceleration."""

NOTES = {
    "cycloidal": "It starts and ends at rest; a start that moves is refused (exit 3).",
    "trapezoid": """\
Give two of `duration`, `velocity` and `acceleration`, or one, or none; what is missing comes from the
limits, and without a `duration` the move is the fastest. With all three, too much is asked (exit 2).
Magnitudes are positive.

A trapezoid over the distance D in the time T, from rest to rest, has a velocity above D/T and of at
most 2 D/T, and an acceleration of at least 4 D/T^2; outside of that the move is refused with the
interval (exit 3).

With `synchronize: time` one law moves all joints, so the path is a straight line in joint space. With
`synchronize: none` each joint has its own ramps and arrives by itself.""",
    "jerk_limited": """\
`to` may leave `joints` out: `{velocity: 0}` stops the arm as fast as the limits allow, `{velocity: 30}`
is a run-up. Joints that move need limits on velocity, acceleration and jerk (a stop needs none on
velocity). With `synchronize: time` all joints arrive together, in the shortest time in which every one
of them can; with `phase` they follow one law and the path is a straight line in joint space, which the
velocities and accelerations of start and target must not leave; with `none` each arrives by itself.

A start beyond a velocity or acceleration limit, or whose acceleration leads beyond one whatever is done, is
refused. With `brake: true` it is brought inside first, as fast as possible, each joint by itself (with
`synchronize: phase` all together); an event says so. Until then, and no longer, the limits that the start
breaks do not count; all others do.""",
    "spline": """\
`through` lists the [waypoints](#points-on-the-path) between the start and `to`; without `to` its last point
is the target. Either all of them have a `time` or none.

Without times the move is the fastest of its kind within the limits; a `duration` alone stretches that, and
with a recording it stretches the recording. What the ends impose depends on the rule: velocity and
acceleration with `continuous_acceleration` and `quintic`, velocity with `imposed`, `computed`, `clamped` and
`shape_preserving`, nothing with `natural` and `not_a_knot`: they begin and end with the velocity that the
rule has, which is an event at the start of a job that gives none, and a jump (an error) elsewhere.
`quintic` takes velocities and accelerations of the points between where they are given.""",
    "blends": """\
Points stand as for `spline`. The motion is straight from point to point; around each point a parabola
lasts for its `blend`, or for `blend_durations`, or is as short as an `acceleration` allows (each joint by
itself). A point between the ends is missed by the change of velocity times the blend's duration / 8, and
`explain` says by how much; `exactly` passes it through two points beside it.

With `end_blends: centred` the first and the last blend are centred on their times, so that the motion
begins half a blend before the start and lasts half a blend longer; `inside` keeps the times of both ends.
Blends that would overlap are shortened, with an event. Without times they are found from the limits of
velocity and acceleration, and so are the blends; a `duration` stretches all of that. It then starts and ends
at rest. With times the start and the target may have a velocity: a centred blend then begins before the
first point, which only the start of a job can do (an event, `begins_before`), and ends beyond the last.""",
    "time_optimal": """\
Points stand as for `spline`, without times: it is as fast as the limits of velocity, acceleration and jerk
allow along its path, which is a smooth curve through the points (`path: spline`; `rule` and `parameter`
say which one) or straight from point to point (`path: polyline`). On a polyline it stops at each point,
or, with `corner`, passes it at no more than that distance. The times of a recording are not used. `explain`
says which limit of which joint binds when. Where a joint has a limit of jerk, the limits of jerk are kept and
the acceleration has no steps: corners are rounded with continuous curvature, and rules whose curvature jumps
(`computed`, `shape_preserving`) are refused. `jerk: ignore` leaves the limits of jerk aside; where there is
none, the acceleration steps. Where the arm starts in motion, it keeps its acceleration, and a spline bends
so that it can; it ends in motion without acceleration. A `duration` stretches the fastest motion.""",
    "waypoints": """\
Points stand as for `time_optimal`. Between them the motion is free: it goes where it is fast, and may leave
the straight chords by as much as `explain` and the report say, so where obstacles stand between the points
take `time_optimal`. A `velocity` or `acceleration` of a point fixes the joints that it names; what it
leaves out is found. The last point's are zero unless given. Points that repeat the one before count once;
the minimum duration of what lay between goes to the next segment, or where there is none to the one before.

The search is deterministic: `starts` of these starting points are tried, in this order, and each is
improved until nothing is gained, or left where it nears the best too slowly. (1) Knots that are free,
eight in each segment, from six tenths of the
times of stopping at each point; (2) the straight motion of each collinear stretch; (3) twelve free knots,
from eight tenths of those times; (4) central differences of the points, at the best of six speeds; (5) six
free knots, from the times at the velocity limits; (6) eight, from the times of the best motion so far; (7)
ten, from equal times; (8) sixteen, from the times of the best so far. The motion that stops at each point
is always compared, too, so that no result is slower; once a motion is as fast as the proven bound, no more
starting points are tried. The lower bound that is named is proven, and so is what the motion is at most
above the fastest possible.

With `straight` it keeps to the polyline through the points: it passes collinear points without a stop, and
stops where the polyline turns.""",
    "line": _JOINS,
    "arc": f"""\
Which arc is meant is said in one of [three ways](#arcs). An arc by its angle ends with the orientation with
which it begins, unless `orientation: tangent` turns the tool along. {_JOINS}""",
    "path": f"""\
One law leads over all [segments](#segments); each of them may turn the tool to the orientation of its
target. At a corner the path stops (`stop`), or is rounded (`round`, the default) by a curve whose
curvature joins: its `radius` is measured along both segments, and shrinks to what they leave room for,
with an event. `explain` says at what distance a rounded corner is passed. Where the direction goes on
there is nothing to stop at; `round` then makes the curvatures of line and arc join, so that no
acceleration steps.

With `overlap` each segment has a law of its own and begins before the last one has ended, by that time:
the tool cuts the corners without stopping. An acceleration from `limits.tcp` is divided where two add up.

{_JOINS}""",
    "screw": f"""\
The axis follows from the two poses: the tool turns about it and moves along it evenly, as on a hinge or a
thread. The target gives its whole orientation, or none, which keeps it. {_JOINS}""",
    "hold": "It starts and ends at rest; a start that moves is refused (exit 3).",
}
