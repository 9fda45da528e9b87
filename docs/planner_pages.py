"""The pages of planners: which one to take, and the fields of each, from the table of planners."""

from __future__ import annotations

from docs.fields import field_table
from docs.markdown import ROOT, table
from docs.planner_examples import LEFT_OUT
from docs.reference_pages import linked, reference_link
from trajcli.planners import PLANNERS

WISHES = {
    "cubic": (
        "from state to state in a given time, as the textbook does it",
        "the joint has a limit of jerk",
    ),
    "quintic": (
        "the same, softly: accelerations at both ends are yours",
        "it shall be as fast as possible",
    ),
    "septic": ("softer still: the jerk begins and ends at zero", "limits are tight"),
    "cycloidal": (
        "from rest to rest with an acceleration that is a sine, as cams do it",
        "the arm is moving",
    ),
    "trapezoid": ("speed up, cruise, slow down: a cruise speed or a ramp of your choice", "jerk has a limit"),
    "jerk_limited": (
        "as fast as velocity, acceleration and jerk allow; stop, run up, catch a moving arm",
        "the duration is given",
    ),
    "hold": ("wait: for a gripper, a camera, a weld", "the arm is moving"),
    "spline": (
        "one smooth curve through points, with or without times; play a recording",
        "the path between the points matters",
    ),
    "blends": (
        "straight from point to point in joint space, corners rounded by parabolas",
        "points must be met",
    ),
    "time_optimal": (
        "as fast as velocity, acceleration and jerk allow along a path through points",
        "only the ends count",
    ),
    "waypoints": (
        "as fast as velocity, acceleration and jerk allow through points, on whatever path between them",
        "the path between the points matters",
    ),
    "line": ("the tool straight from pose to pose, or turning in its place", "only the end counts"),
    "arc": ("the tool on a circle, several turns, a helix", "only the end counts"),
    "path": (
        "the tool along lines and arcs without stopping: seams, beads, contours",
        "one line or arc will do",
    ),
    "screw": ("the tool about and along one axis: a lever, a thread, a hinge", "a straight line is needed"),
}
"""What a user wants who should take a planner, and what speaks against it."""

_CHAPTERS = {
    "point_to_point": (
        "From state to state, in joint space",
        "The shape in space between the ends does not matter.",
    ),
    "waypoints": ("Through points, in joint space", "Points may be joint values, poses, or a recorded file."),
    "tool_path": (
        "Along a path of the tool",
        "The tool follows a curve in space, and the joints follow the tool.",
    ),
}
_INTRODUCTION = """\
# Which planner?

Take the first line that fits. Each name leads to a page with its curves, what it
guarantees, when not to use it, and a worked exercise.

*Continuity 2* means that position, velocity and acceleration have no jumps, so that the jerk is finite and
may have a limit; with *continuity 1* the acceleration may step. Moves follow each other in one job, and each
may have its own planner."""
_END = """\
## Still undecided?

* Between two points, and nothing else is asked: `jerk_limited`. It is the fastest, and its limits are yours.
  Where no limit of jerk is known, begin with ten times the acceleration per second, as our examples do.
* In a given time: `quintic`.
* The tool must go straight: `line`.
* `trajcli plan JOB --reference` says by what factor each move is slower than the fastest one within the same
  limits.

## Where the exercises come from

The exercises that the pages work through are those of Phạm Duy Hưng's lecture *Thiết kế quỹ đạo chuyển
động robot* (Design of robot trajectories), University of Engineering and Technology, Vietnam National
University, Hanoi. It follows chapter 4 of Siciliano et al., *Robotics: Modelling, Planning and Control*
(2009), which is "the book" on these pages."""


def planner_table() -> str:
    """Return the page with the table."""
    parts = [_INTRODUCTION]
    for chapter, (heading, about) in _CHAPTERS.items():
        rows = [
            [wish, f"[`{name}`](planners/{name}.md)", _continuity(name, chapter), reason]
            for name, (wish, reason) in WISHES.items()
            if chapter in PLANNERS[name].__module__.split(".")
        ]
        parts += [f"## {heading}", about, table(["you want", "planner", "continuity", "not where"], rows)]
    return "\n\n".join([*parts, _END]) + "\n"


def _continuity(name: str, chapter: str) -> str:
    choices = {"spline": "1 or 2, by rule", "time_optimal": "2 within limits of jerk, or 1"}
    if name in choices:
        return choices[name]
    return "1 or 2, by law" if chapter == "tool_path" else str(PLANNERS[name].continuity)


def planner_page(name: str) -> str:
    """Return the page of a planner with its fields as they are now: the last section."""
    page = (ROOT / f"docs/planners/{name}.md").read_text(encoding="utf-8")
    return page.partition("## Fields\n")[0] + _fields(name)


def _fields(name: str) -> str:
    place = f"docs/planners/{name}.md"
    own = linked(field_table(PLANNERS[name], LEFT_OUT), place)
    link = f"[job reference]({reference_link(name, place)})"
    shared = f"`limits` and `when_over_limit`, which [every move]({reference_link('moves', place)}) has"
    return f"## Fields\n\nBeside {shared}; the {link} says more.\n\n{own}\n"
