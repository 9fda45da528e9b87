"""Jobs of every kind at random, as the plain mappings that a file holds."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import strategies as st

from trajcli.language.numbers import NO_NAMES

ANGLES = {"rad": 1.0, "deg": 57.0}
NAMES = st.text(st.characters(exclude_categories=("Cs", "Cn", "Co")), min_size=1, max_size=8).filter(
    lambda name: name.isprintable() and name == name.strip()
)

POINT_NAMES = NAMES.filter(
    lambda name: name not in NO_NAMES and re.fullmatch(r"[-+]?[.0-9]+[.eE0-9+-]*", name) is None
)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


MAGNITUDES = numbers(1e-6, 1e6)


@st.composite
def bounds(draw: st.DrawFn) -> Any:
    kind = draw(st.sampled_from(["size", "pair", "null"]))
    if kind == "null":
        return None
    return draw(MAGNITUDES) if kind == "size" else [-draw(MAGNITUDES), draw(MAGNITUDES)]


@st.composite
def robots(draw: st.DrawFn) -> dict[str, Any]:
    count = draw(st.integers(1, 6))
    described = draw(st.booleans())
    joints = []
    for index in range(count):
        joint: dict[str, Any] = {"type": draw(st.sampled_from(["revolute", "prismatic"]))}
        if draw(st.booleans()):
            joint["name"] = f"{draw(NAMES)} {index}"
        if described:
            joint |= {key: draw(numbers(-4, 4)) for key in ("theta", "d", "a", "alpha")}
            joint["sign"] = draw(st.sampled_from([1, -1]))
        for quantity in ("position", "velocity", "acceleration", "jerk"):
            if draw(st.booleans()):
                joint[quantity] = draw(bounds())
        joints.append(joint)
    robot: dict[str, Any] = {"joints": joints}
    if described:
        robot["convention"] = draw(st.sampled_from(["standard", "modified"]))
        robot["base"] = {
            "xyz": draw(st.lists(numbers(-3, 3), min_size=3, max_size=3)),
            "rpy": [draw(numbers(-3, 3)), 0, 1],
        }
        robot["tool"] = {
            "euler": {"sequence": "ZYZ", "angles": draw(st.lists(numbers(-3, 3), min_size=3, max_size=3))}
        }
    return robot


@st.composite
def states(draw: st.DrawFn, count: int, imposed: int) -> dict[str, Any]:
    state: dict[str, Any] = {"joints": draw(st.lists(numbers(-1e3, 1e3), min_size=count, max_size=count))}
    for key in ("velocity", "acceleration")[:imposed]:
        if draw(st.booleans()):
            state[key] = draw(st.lists(numbers(-9, 9), min_size=count, max_size=count))
    return state


@st.composite
def moves(draw: st.DrawFn, count: int) -> dict[str, Any]:
    planner, imposed = draw(
        st.sampled_from(
            [
                ("cubic", 1),
                ("quintic", 2),
                ("septic", 2),
                ("cycloidal", 0),
                ("trapezoid", 1),
                ("jerk_limited", 2),
                ("hold", 0),
            ]
        )
    )
    move: dict[str, Any] = {"planner": planner}
    if planner != "hold":
        move["to"] = draw(states(count, imposed))
    if planner == "hold" or (planner != "jerk_limited" and draw(st.booleans())):
        move["duration"] = draw(MAGNITUDES)
    if planner in ("trapezoid", "jerk_limited") and "duration" not in move and draw(st.booleans()):
        move |= {"minimum_duration": draw(MAGNITUDES), "synchronize": draw(st.sampled_from(["time", "none"]))}
    if planner == "trapezoid" and draw(st.booleans()):
        move["acceleration"] = draw(st.lists(MAGNITUDES, min_size=count, max_size=count))
    if draw(st.booleans()):
        scales = st.dictionaries(st.sampled_from(["velocity", "jerk"]), numbers(1e-3, 1))
        move["limits"] = {"scale": draw(scales)}
    if draw(st.booleans()):
        move["when_over_limit"] = draw(st.sampled_from(["slow", "error"]))
    return move


@st.composite
def jobs(draw: st.DrawFn) -> dict[str, Any]:
    """Return a job: units, an inline robot, limits, points, a start, moves and output."""
    robot = draw(robots())
    count = len(robot["joints"])
    job: dict[str, Any] = {
        "version": 1,
        "name": draw(NAMES),
        "units": {
            "angle": draw(st.sampled_from(["rad", "deg"])),
            "length": draw(st.sampled_from(["m", "mm"])),
        },
        "robot": robot,
        "points": {draw(POINT_NAMES): draw(states(count, 2))},
        "start": draw(states(count, 1)),
        "moves": draw(st.lists(moves(count), min_size=1, max_size=3)),
        "output": {"start_time": draw(numbers(-5, 5))},
    }
    if draw(st.booleans()):
        job["limits"] = {
            "velocity": draw(st.lists(bounds(), min_size=count, max_size=count)),
            "scale": {"velocity": 0.3},
        }
    if draw(st.booleans()):
        job["output"]["times"] = sorted(draw(st.sets(numbers(0, 9), min_size=1, max_size=4)))
    else:
        job["output"] |= {"rate": draw(MAGNITUDES), "align": draw(st.booleans())}
    return job
