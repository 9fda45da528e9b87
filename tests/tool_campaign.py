"""Random moves along paths of the tool, and an arm that follows them without the code that planned them.

The tracker goes along the path in small steps: Newton's method on the pose from forward kinematics, its slopes
by central differences. What a target leaves free is held as the planner promises: joint values keep their
components along the directions that are free at the start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from tool_jobs import Fields, arm

from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot

ROBOTS = ("puma560", "ur5e", "panda", "scorbot", "cobra600", "planar3r")
KINDS = ("line", "arc", "path")
_STEP = 1e-6  # rad or m: of central differences
_SURE = 0.05  # rad or m: a longer correction halves the step


@dataclass(frozen=True)
class Task:
    """One random job."""

    robot: str
    kind: str
    start: list[float]
    move: Fields


def task(seed: int, kind: str, name: str) -> Task:
    """Return the random job of a number."""
    rng = np.random.default_rng(seed)
    robot = arm(name)
    low, high = np.clip(robot.limits.position.T, -2.6, 2.6)
    q = low + (high - low) * rng.uniform(0.05, 0.95, len(low))
    made = _Maker(rng, name, forward(robot, q))
    move = getattr(made, kind)()
    return Task(name, kind, q.tolist(), move | made.law() | {"when_over_limit": "slow"})


@dataclass
class _Maker:
    rng: np.random.Generator
    name: str
    pose: np.ndarray

    @property
    def flat(self) -> bool:
        return self.name == "planar3r"

    def aside(self, least: float, most: float) -> np.ndarray:
        """Return a random vector; of a planar arm, in its plane."""
        way = self.rng.normal(size=3)
        if self.flat:
            way[2] = 0.0
        return way / np.linalg.norm(way) * self.rng.uniform(least, most)

    def form(self) -> str:
        forms = {"scorbot": ["pitch", "none"], "cobra600": ["yaw", "none"], "planar3r": ["yaw", "none"]}
        return str(self.rng.choice(forms.get(self.name, ["quat", "quat", "none", "direction"])))

    def target(self, form: str, place: np.ndarray) -> Fields:
        """Return a target near an earlier pose."""
        self.pose = self.pose.copy()
        self.pose[:3, 3] = place
        said: Fields = {"xyz": place.tolist()}
        if form == "quat":
            turn = Rotation.from_rotvec(self.rng.normal(size=3) * 0.4)
            self.pose[:3, :3] = turn.as_matrix() @ self.pose[:3, :3]
            said["quat_wxyz"] = Rotation.from_matrix(self.pose[:3, :3]).as_quat(scalar_first=True).tolist()
        elif form == "direction":
            turn = Rotation.from_rotvec(self.rng.normal(size=3) * 0.4)
            said["direction"] = (turn.as_matrix() @ self.pose[:3, 2]).tolist()
        elif form == "pitch":
            z = self.pose[2, 2]
            said["pitch"] = float(
                np.clip(np.arcsin(np.clip(z, -1, 1)) + self.rng.uniform(-0.5, 0.5), -1.5, 1.5)
            )
        elif form == "yaw":
            x = self.pose[:3, 0]
            said |= {"yaw": float(np.arctan2(x[1], x[0]) + self.rng.uniform(-0.8, 0.8)), "tool_axis": "x"}
        return said

    def line(self) -> Fields:
        return {"planner": "line", "to": self.target(self.form(), self.pose[:3, 3] + self.aside(0.02, 0.35))}

    def bent(self, form: str | None) -> Fields:
        """Return the fields of an arc."""
        here = self.pose[:3, 3].copy()
        if form is None or self.rng.random() < 0.5:
            axis = np.array([0.0, 0, 1]) if self.flat else self.aside(1, 1)
            arm_ = np.cross(axis, self.aside(1, 1))
            center = here + arm_ / np.linalg.norm(arm_) * self.rng.uniform(0.02, 0.15)
            angle = float(self.rng.uniform(0.3, 4) * self.rng.choice([-1, 1]))
            pitch = 0.0 if self.flat else float(self.rng.choice([0, 0.03]))
            moved = Rotation.from_rotvec(axis * angle).as_matrix() @ (here - center)
            self.pose = self.pose.copy()
            self.pose[:3, 3] = center + moved + axis * pitch * angle / (2 * np.pi)
            return {"center": center.tolist(), "axis": axis.tolist(), "angle": angle, "pitch": pitch}
        via = here + self.aside(0.03, 0.15)
        end = via + self.aside(0.03, 0.15)
        return {"via": {"xyz": via.tolist()}, "to": self.target(form, end)}

    def arc(self) -> Fields:
        fields = self.bent(self.form())
        turning = {"orientation": "tangent"} if "angle" in fields and self.rng.random() < 0.3 else {}
        whole = {} if self.name in ("scorbot", "cobra600") else turning
        return {"planner": "arc", **fields, **whole}

    def path(self) -> Fields:
        form, segments = self.form(), []
        for _ in range(self.rng.integers(2, 5)):
            if form in ("none", "quat") and self.rng.random() < 0.4:
                segments.append({"arc": self.bent(form if form == "none" else None)})
            else:
                segments.append({"line": self.target(form, self.pose[:3, 3] + self.aside(0.02, 0.2))})
        corner: Fields = (
            {"corner": "round", "radius": 0.02} if self.rng.random() < 0.5 else {"corner": "stop"}
        )
        return {"planner": "path", "segments": segments, **corner}

    def law(self) -> Fields:
        shapes = ["trapezoid", "trapezoid", "quintic", "cubic", "cycloidal", "jerk_limited", "time_optimal"]
        shape = str(self.rng.choice(shapes))
        return {"law": {"shape": shape, **({"jerk": 20.0} if shape == "jerk_limited" else {})}}


class StoppedError(Exception):
    """The tracker cannot go on.

    Attributes:
        place: How far it came.
    """

    def __init__(self, place: float) -> None:
        super().__init__(place)
        self.place = place


@dataclass
class Tracker:
    """An arm that goes along a path in small steps."""

    robot: Robot
    path: ToolPath
    joints: np.ndarray
    place: float = 0.0
    asked: tuple[float, ToolReference] | None = None

    def __post_init__(self) -> None:
        n = len(self.robot.joints)
        rng = np.random.default_rng(1)
        ranks = [
            np.linalg.matrix_rank(self.slopes(self.joints + rng.normal(size=n) * 0.2, 0.0), 1e-7)
            for _ in "abc"
        ]
        right = np.linalg.svd(self.slopes(self.joints, 0.0))[2]
        self.held, self.kept = right[max(ranks) :], right[max(ranks) :] @ self.joints

    def off(self, joints: np.ndarray, place: float) -> np.ndarray:
        """Return (N, m): what is between the tcp of joints (N, n) and the path."""
        if self.asked is None or self.asked[0] != place:
            self.asked = place, self.path.at_s(np.array([place]), "left")
        demand, poses = self.asked[1], forward(self.robot, joints)
        parts = [poses[:, :3, 3] - demand.poses[0, :3, 3]]
        axis = poses[:, :3, "xyz".index(demand.tool_axis)]
        if demand.orientation == "all":
            turned = Rotation.from_matrix(poses[:, :3, :3] @ demand.poses[0, :3, :3].T)
            parts.append(turned.as_rotvec())
        elif demand.orientation == "direction":
            aim = demand.poses[0, :3, "xyz".index(demand.tool_axis)]
            parts.append(axis - aim)
        elif demand.orientation == "yaw":
            away = np.arctan2(axis[:, 1], axis[:, 0]) - demand.aims[0, 0]
            parts.append(np.arctan2(np.sin(away), np.cos(away))[:, None])
        elif demand.orientation == "pitch":
            parts.append((np.arcsin(np.clip(axis[:, 2], -1, 1)) - demand.aims[0, 0])[:, None])
        return np.concatenate(parts, axis=1)

    def linearised(self, joints: np.ndarray, place: float) -> tuple[np.ndarray, np.ndarray]:
        """Return that of joints (n,), shape (m,), and how they change it, (m, n)."""
        n = joints.size
        rows = self.off(joints + _STEP * np.concatenate([np.eye(n), -np.eye(n), np.zeros((1, n))]), place)
        return rows[-1], (rows[:n] - rows[n:-1]).T / (2 * _STEP)

    def slopes(self, joints: np.ndarray, place: float) -> np.ndarray:
        """Return how the joints change that, (m, n)."""
        return self.linearised(joints, place)[1]

    def ratio(self) -> float:
        """Return the smallest over the largest singular value, of the directions that are held too."""
        values = np.linalg.svd(
            np.concatenate([self.slopes(self.joints, self.place), self.held]), compute_uv=False
        )
        return float(values[len(self.joints) - 1] / values[0])

    def bare_ratio(self) -> float:
        """Return the same of the tool alone: of what the arm can do anywhere."""
        values = np.linalg.svd(self.slopes(self.joints, self.place), compute_uv=False)
        return float(values[len(self.joints) - len(self.held) - 1] / values[0])

    def solved(self, guess: np.ndarray, place: float, rounds: int = 8) -> np.ndarray | None:
        """Return joint values near a guess, or None."""
        q = guess
        for left in reversed(range(rounds + 1)):
            off, slopes = self.linearised(q, place)
            missed = np.concatenate([off, self.held @ q - self.kept])
            if np.abs(missed).max() < 1e-11 or not left:
                break
            q = q - np.linalg.lstsq(np.concatenate([slopes, self.held]), missed, rcond=1e-10)[0]
        good = np.abs(missed).max() < 1e-8
        return q if good else None

    def go(self, place: float, least: float = 1e-5) -> np.ndarray:
        """Go on to a place and return the joints there, (n,).

        Raises:
            StoppedError: When steps of `least` of the path are too long.
        """
        step = min(place - self.place, self.path.length / 50)
        while self.place < place:
            step = min(step, place - self.place)
            there = place if step >= place - self.place else self.place + step
            q = self.solved(self.joints, there)
            if q is None or np.abs(q - self.joints).max() > _SURE:
                step /= 2
                if step < least * self.path.length:
                    raise StoppedError(self.place)
                continue
            self.joints, self.place = q, there
            step *= 1.5
        return self.joints

    def reaches(self, place: float, tries: int = 40) -> bool:
        """Return whether any joint values at all meet the path at a place."""
        n = len(self.robot.joints)
        rng = np.random.default_rng(2)
        bare = Tracker(self.robot, self.path, self.joints)
        bare.held, bare.kept = np.empty((0, n)), np.empty(0)
        return any(bare.solved(rng.uniform(-np.pi, np.pi, n), place, 60) is not None for _ in range(tries))


def way_of(task_: Task, loaded: Any) -> ToolPath:
    """Return the path of a job's move."""
    before = forward(loaded.robot, np.array(task_.start))
    return loaded.job.moves[0].path_from(before, loaded.robot).path


def demand_at(path: ToolPath, places: np.ndarray) -> ToolReference:
    return path.at_s(places, "left")
