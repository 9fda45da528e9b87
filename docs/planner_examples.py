"""What a person has to say about each planner: a minimal job, and what its fields leave open."""

from __future__ import annotations

_HEAD = "version: 1\nunits: {angle: deg}\nrobot: {joints: 1}\n"
_FROM_20 = "start: {joints: [20]}\nmoves:\n"

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
velocities and accelerations of start and target must not leave; with `none` each arrives by itself.""",
    "hold": "It starts and ends at rest; a start that moves is refused (exit 3).",
}
