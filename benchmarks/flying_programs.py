"""Programs of moves whose corners are flown by, as jobs: those of known durations, and random ones."""

from __future__ import annotations

from typing import Any

import numpy as np

Job = dict[str, Any]

_DEGREES = {"angle": "deg", "length": "mm"}
_PICK = {  # of the UR5e, deg
    "home": (0, -90, 90, -90, -90, 0),
    "above_pick": (25, -80, 110, -120, -90, 25),
    "pick": (25, -68, 118, -140, -90, 25),
    "above_place": (-60, -85, 105, -110, -90, -60),
    "place": (-60, -74, 114, -130, -90, -60),
}


def pick(zone: float) -> Job:
    """Return a pick and place of joint moves with two holds; zone in mm."""
    slow = {"limits": {"velocity": 30}}
    hold = {"planner": "hold", "duration": 0.4}
    moves = [
        joint_move("above_pick"),
        joint_move("pick", **slow),
        hold,
        joint_move("above_pick", limits={"velocity": 60}),
        joint_move("above_place", synchronize="phase"),
        joint_move("place", **slow),
        hold,
        joint_move("above_place"),
        joint_move("home"),
    ]
    limits = {"acceleration": 800, "jerk": 8000, "scale": {"velocity": 0.6}}
    points = {name: {"joints": list(values)} for name, values in _PICK.items()}
    return _job("ur5e", _DEGREES, limits, "home", moves, zone, points)


def planar_joints(zone: float) -> Job:
    """Return two joint moves of a planar arm of two joints; zone in m."""
    moves = [joint_move({"joints": [0.9, 1.25]}), joint_move({"joints": [1.0, 2.0]})]
    return _planar(moves, zone)


def planar_lines(zone: float) -> Job:
    """Return two lines of the tool of a planar arm of two joints; zone in m."""
    return _planar([line({"xyz": [x, 0.392283, 0]}) for x in (0.300748, 0.154969)], zone)


def pallet(zone: float) -> Job:
    """Return a pick and place of lines up and down and joint moves across; zone in mm."""
    turned = {"rpy": [180, 0, -90]}
    branch = {"configuration": {"shoulder": "right", "elbow": "up", "wrist": "flip"}}
    corners = {
        "home": (350, 0, 350),
        "above_pick": (300, 300, 200),
        "pick": (300, 300, 80),
        "above_place": (450, -300, 200),
        "place": (450, -300, 80),
    }
    points = {name: {"xyz": list(xyz), **turned, **branch} for name, xyz in corners.items()}
    hold, fast = {"planner": "hold", "duration": 0.1}, {"synchronize": "phase"}
    moves = [
        joint_move("above_pick", **fast),
        line("pick", speed=1000),
        hold,
        line("above_pick", speed=1000),
        joint_move("above_place", **fast),
        line("place", speed=1000),
        hold,
        line("above_place", speed=1000),
        joint_move("home", **fast),
    ]
    limits = {"velocity": 180, "acceleration": 800, "jerk": 8000}
    return _job("ur5e", _DEGREES, limits, "home", moves, zone, points)


def random_joint_moves(seed: int, count: int = 3) -> Job:
    """Return joint moves of a UR5e from a seed: zones of 10 to 80 mm, jerks of 2000 to 30000 deg/s^3."""
    draws = np.random.default_rng(seed)
    targets = _home() + draws.uniform(-60.0, 60.0, (count, 6))
    zone, jerk = np.exp(draws.uniform(np.log([10.0, 2000.0]), np.log([80.0, 30000.0]))).round(3).tolist()
    moves = [joint_move({"joints": each}) for each in targets.round(3).tolist()]
    limits = {"acceleration": 800, "jerk": jerk}
    return _job("ur5e", _DEGREES, limits, {"joints": list(_PICK["home"])}, moves, zone)


def mixed_moves() -> Job:
    """Return a joint move, two lines of the tool, and a joint move of a UR5e, zones of 20 mm."""
    turned = {"rpy": [180, 0, 0], "configuration": {"elbow": "up"}}
    corners = ((400, 100, 250), (400, 300, 250), (400, 300, 100), (250, 350, 250))
    start, *targets = [{"xyz": list(corner), **turned} for corner in corners]
    moves = [joint_move(targets[0]), line(targets[1]), line(targets[0]), joint_move(targets[2])]
    return _job("ur5e", _DEGREES, {"acceleration": 800, "jerk": 8000}, start, moves, 20)


def without_zones(job: Job) -> Job:
    """Return the job that stops at every corner."""
    return {key: value for key, value in job.items() if key != "zone"}


def joint_move(to: Any, **fields: Any) -> Job:
    """Return a jerk-limited joint move to a target."""
    return {"planner": "jerk_limited", "to": to, **fields}


def line(to: Any, **law: Any) -> Job:
    """Return a line of the tool to a target, as fast as limits allow."""
    return {"planner": "line", "to": to, "law": {"shape": "time_optimal", **law}}


def _home() -> np.ndarray:
    return np.array(_PICK["home"], dtype=float)


def _planar(moves: list[Job], zone: float) -> Job:
    limits = {"velocity": 3, "acceleration": 8, "jerk": 60}
    return _job("planar2r", {}, limits, {"joints": [0.3, 1.2]}, moves, zone)


def _job(
    robot: str,
    units: dict[str, str],
    limits: Job,
    start: Any,
    moves: list[Job],
    zone: float,
    points: Job | None = None,
) -> Job:
    named = {"points": points} if points else {}
    job = {"version": 1, "units": units, "robot": robot, "limits": limits, "zone": zone, **named}
    return {**{key: value for key, value in job.items() if value}, "start": start, "moves": moves}
