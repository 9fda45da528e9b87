"""Programs that say the same in other words: a cell that stands elsewhere, mirrored, larger, in other units, in slow motion.

No number of ours is compared with a stored one. A joint motion must not notice where the cell stands, nor in what
units, signs or sizes it is described; with velocities k, accelerations k^2 and jerks k^3 times as large it takes
1 / k of the time.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

Fields = dict[str, Any]
DEGREE = np.pi / 180
ROWS = [(0.1625, 0, 90), (0, -0.425, 0), (0, -0.3922, 0), (0.1333, 0, 90), (0.0997, 0, -90), (0.0996, 0, 0)]
RATES = {"velocity": (1, 1.5, 3.5), "acceleration": (2, 5.0, 20.0), "jerk": (3, 50.0, 400.0)}  # order, range
OF_TOOL = {"speed": 1, "acceleration": 2, "jerk": 3}
OF_TURNS = {"angular_speed": 1, "angular_acceleration": 2}
KINDS = ["jerk_limited", "quintic", "trapezoid", "spline", "line", "arc", "screw", "path"]


def pose(matrix: np.ndarray) -> Fields:
    return {
        "xyz": matrix[:3, 3].tolist(),
        "quat_xyzw": Rotation.from_matrix(matrix[:3, :3]).as_quat().tolist(),
    }


def within(rng: np.random.Generator, size: float, turn: float) -> np.ndarray:
    """Return a small random change of a pose, (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(rng.uniform(-turn, turn, 3)).as_matrix()
    matrix[:3, 3] = rng.uniform(-size, size, 3)
    return matrix


def flange(q: np.ndarray) -> np.ndarray:
    """Return the pose of the last link by its rows of Denavit and Hartenberg."""
    whole = np.eye(4)
    for (d, a, alpha), angle in zip(ROWS, q.tolist(), strict=True):
        about_z, about_x = np.eye(4), np.eye(4)
        about_z[:3, :3] = Rotation.from_euler("z", angle).as_matrix()
        about_x[:3, :3] = Rotation.from_euler("x", alpha * DEGREE).as_matrix()
        about_z[2, 3], about_x[0, 3] = d, a
        whole = whole @ about_z @ about_x
    return whole


def random_arm(rng: np.random.Generator) -> Fields:
    """Return a UR5e whose limits differ by joint and direction."""
    joints = []
    for d, a, alpha in ROWS:
        joint = {"d": d, "a": a, "alpha": alpha * DEGREE, "position": [-6.0, 6.2]}
        for key, (_, low, high) in RATES.items():
            one, other = rng.uniform(low, high, 2).tolist()
            joint[key] = one if rng.random() < 0.5 else [-one, other]
        joints.append(joint)
    return {"convention": "standard", "joints": joints}


def random_move(rng: np.random.Generator, place: np.ndarray) -> tuple[Fields, np.ndarray]:
    """Return a move from a place (4, 4), SI, and where it ends."""

    def further(size: float) -> np.ndarray:
        step = within(rng, size, 0.3)
        step[:3, 3] += place[:3, 3]
        step[:3, :3] = place[:3, :3] @ step[:3, :3]
        return step

    kind = str(rng.choice(KINDS))
    move: Fields = {"planner": kind}
    if kind == "path":
        stops = []
        for _ in range(2):
            place = further(0.08)
            stops.append({"line": {**pose(place), "in": "cell"}})
        return {**move, "segments": stops, "radius": 0.01, "law": {"shape": "quintic"}}, place
    if kind == "spline":
        place = further(0.08)
        move |= {"through": [{**pose(place), "in": "cell"}], "duration": float(rng.uniform(3, 6))}
    if kind == "arc":
        place = further(0.08)
        move["via"] = {"xyz": pose(place)["xyz"], "in": "cell"}
    if kind in ("line", "arc", "screw"):
        shape = str(rng.choice(["quintic", "cycloidal", "jerk_limited", "time_optimal"]))
        move["law"] = {
            "shape": shape,
            "speed": float(rng.uniform(0.1, 0.3)),
            "acceleration": 2.0,
            "jerk": 40.0,
        }
    place = further(0.08)
    return {**move, "to": {**pose(place), "in": "cell"}}, place


def random_program(seed: int) -> Fields:
    """Return a job, SI, whose poses stand in a frame of their own."""
    rng = np.random.default_rng(seed)
    start = np.array([0.3, -1.3, 1.5, -1.3, -1.5, 0.2]) + rng.uniform(-0.3, 0.3, 6)
    tool = within(rng, 0.05, 0.4)
    place, moves = flange(start) @ tool, []
    for _ in range(3):
        move, place = random_move(rng, place)
        moves.append(move)
    tcp = {
        "speed": 0.6,
        "acceleration": 4.0,
        "jerk": 60.0,
        "angular_speed": 2.0,
        "angular_acceleration": 16.0,
    }
    there = pose(np.eye(4))
    return {
        "version": 1,
        "robot": random_arm(rng),
        "tool": pose(tool),
        "base": there,
        "frames": {"cell": there},
        "limits": {"tcp": tcp},
        "start": {"joints": start.tolist()},
        "moves": moves,
    }


def changed(value: Any, change: Callable[[Fields], None]) -> Any:
    """Change each mapping of a value in place."""
    if isinstance(value, dict):
        change(value)
    for below in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        changed(below, change)
    return value


def scale(mapping: Fields, key: str, factor: float) -> None:
    """Multiply a number, or a pair of numbers, where the mapping has it."""
    if key in mapping:
        value = mapping[key]
        mapping[key] = [factor * each for each in value] if isinstance(value, list) else factor * value


def scale_lengths(mapping: Fields, factor: float) -> None:
    """Multiply the lengths of a row, a pose, a move, a law or limits of the tool, and their rates."""
    for key in ("a", "d", "xyz", "radius", "speed"):
        scale(mapping, key, factor)
    for key in ("acceleration", "jerk") if "speed" in mapping else ():
        scale(mapping, key, factor)


def moved(job: Fields) -> float:
    """Let the cell stand elsewhere."""
    there = pose(within(np.random.default_rng(1), 1.0, 2.0))
    job["base"] = job["frames"]["cell"] = there
    return 1.0


def faster(job: Fields) -> float:
    """Let all of it be 1.7 times as fast."""

    def change(mapping: Fields) -> None:
        if "alpha" in mapping:
            for key, (order, *_) in RATES.items():
                scale(mapping, key, 1.7**order)
        elif "speed" in mapping:
            for key, order in {**OF_TOOL, **OF_TURNS}.items():
                scale(mapping, key, 1.7**order)
        scale(mapping, "duration", 1 / 1.7)

    changed(job, change)
    return 1 / 1.7


def larger(job: Fields) -> float:
    """Let all lengths be 1.6 times as large, the tolerance of paths too."""

    def change(mapping: Fields) -> None:
        scale_lengths(mapping, 1.6)
        if mapping.get("planner") in ("line", "arc", "screw", "path"):
            mapping["tolerance"] = {"position": 1.6e-6, "angle": 1e-6}

    changed(job, change)
    return 1.0


def mirrored(job: Fields) -> float:
    """Turn left to right: all joints turn the other way."""

    def change(mapping: Fields) -> None:
        scale(mapping, "alpha", -1.0)
        for key in ("position", *RATES) if "alpha" in mapping else ():
            if isinstance(mapping[key], list):
                mapping[key] = [-each for each in reversed(mapping[key])]
        if "xyz" in mapping:
            mapping["xyz"][1] *= -1
        if "quat_xyzw" in mapping:
            mapping["quat_xyzw"] = (np.array([-1, 1, -1, 1]) * mapping["quat_xyzw"]).tolist()

    changed({key: job[key] for key in ("robot", "tool", "moves")}, change)
    scale(job["start"], "joints", -1.0)
    return 1.0


def in_degrees(job: Fields) -> float:
    """Say it in degrees and millimetres."""

    def change(mapping: Fields) -> None:
        scale_lengths(mapping, 1e3)
        for key in ("alpha", "position", "joints", *OF_TURNS):
            if not isinstance(mapping.get(key), list) or not isinstance(mapping[key][0], dict):
                scale(mapping, key, 1 / DEGREE)
        for key in RATES if "alpha" in mapping else ():
            scale(mapping, key, 1 / DEGREE)

    changed(job, change)
    job["units"] = {"angle": "deg", "length": "mm"}
    return 1.0


def outcome(job: Fields) -> Plan | str:
    """Return the plan of a job, or how it is refused."""
    try:
        return plan_job(job_from_text(json.dumps(job)))
    except TrajcliError as error:
        return type(error).__name__


@cache
def outcome_of(seed: int) -> Plan | str:
    return outcome(random_program(seed))


@pytest.mark.parametrize("law", few([moved, faster, larger, mirrored, in_degrees], 2))
@pytest.mark.parametrize("seed", few(range(12), 1))
def test_a_program_in_other_words_is_the_same_motion(seed: int, law: Callable[[Fields], float]) -> None:
    before, other = outcome_of(seed), random_program(seed)
    pace = law(other)
    after = outcome(other)
    if isinstance(before, str) or isinstance(after, str):
        assert before == after
        return
    assert before.verdict.passed == after.verdict.passed
    whole = before.trajectory.duration
    assert after.trajectory.duration == pytest.approx(whole * pace, rel=1e-5)
    times = np.linspace(0.0, min(whole, after.trajectory.duration / pace), 201)
    sign = -1.0 if law is mirrored else 1.0
    moving = np.abs(before.trajectory(times) - sign * after.trajectory(times * pace)).max()
    assert moving < 3e-4
