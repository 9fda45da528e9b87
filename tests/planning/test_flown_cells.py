"""Random programs of a UR5e in a turned frame, with loops and zones: their rows in a file, by a model of their own.

Lines, arcs and joint moves lead to points of a work object and to the places of a grid. The judge knows the arm's
Denavit-Hartenberg table from its maker, takes poses and rates from rows, and asks the command `check` at the end.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli.running import call
from scipy.spatial.transform import Rotation
from tally import Tally
from tiers import few

D = (0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996)
A = (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0)
ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
BASE = np.diag([-1.0, -1.0, 1.0, 1.0])  # the frame of the base in ROS is turned by 180 deg
HOME = (0, -100, 100, -90, -90, 0)
SEEDS = 10


def placed(values: dict[str, Any]) -> np.ndarray:
    """Return the matrix of a pose in mm and deg."""
    matrix = np.eye(4)
    matrix[:3, 3] = np.array(values["xyz"]) / 1000
    matrix[:3, :3] = Rotation.from_euler("xyz", values["rpy"], degrees=True).as_matrix()
    return matrix


def written(matrix: np.ndarray) -> dict[str, Any]:
    """Return a pose as a job has it."""
    angles = Rotation.from_matrix(matrix[:3, :3]).as_euler("xyz", degrees=True)
    return {"xyz": (1000 * matrix[:3, 3]).round(6).tolist(), "rpy": angles.round(8).tolist()}


def tool_poses(q: np.ndarray, tool: np.ndarray) -> np.ndarray:
    """Return the poses of the tool, (N, 4, 4), of joints (N, 6) in rad."""
    pose = np.broadcast_to(BASE, (len(q), 4, 4))
    for theta, d, a, alpha in zip(q.T, D, A, ALPHA, strict=True):
        link = np.zeros((len(q), 4, 4))
        link[:, :2, 0] = np.stack([np.cos(theta), np.sin(theta)], axis=1)
        link[:, :2, 1] = np.stack([-np.sin(theta), np.cos(theta)], axis=1) * np.cos(alpha)
        link[:, :2, 2] = np.stack([np.sin(theta), -np.cos(theta)], axis=1) * np.sin(alpha)
        link[:, :2, 3] = a * link[:, :2, 0]
        link[:, 2], link[:, 3, 3] = (0.0, np.sin(alpha), np.cos(alpha), d), 1.0
        pose = pose @ link
    return pose @ tool


class Program:
    """A drawn job.

    Attributes:
        job: As YAML has it.
        tool: Its pose on the flange.
        stops: The poses of the tool before and behind each move, (moves + 1, 4, 4).
        planners: Of each move.
    """

    def __init__(self, seed: int) -> None:
        draws = np.random.default_rng(seed)
        self.draws, uniform = draws, draws.uniform
        tool = {
            "xyz": uniform(-50, 150, 3).round().tolist(),
            "rpy": [0, *uniform(-40, 40, 2).round().tolist()],
        }
        self.tool, start = placed(tool), (HOME + uniform(-15, 15, 6)).round(3)
        home = tool_poses(np.radians(start)[None], self.tool)[0]
        frame = home.copy()
        frame[:3, :3] = Rotation.from_euler("xyz", uniform(-1, 1, 3)).as_matrix()
        table = written(frame)
        self.points, self.places = self._drawn_points(placed(table), home)
        self.planners: list[str] = []
        self.stops = [home]
        moves = self._drawn_moves()
        limits = {"velocity": uniform(40, 180), "acceleration": uniform(200, 1500), "jerk": uniform(4e3, 4e4)}
        if draws.random() < 0.5:
            limits["tcp"] = {"speed": uniform(150, 2000), "acceleration": uniform(1500, 20000)}
        self.limits = json.loads(json.dumps(limits), parse_float=lambda text: round(float(text), 2))
        self.job = {
            "version": 1,
            "units": {"angle": "deg", "length": "mm"},
            "robot": "ur5e",
            "tool": tool,
            "limits": self.limits,
            "zone": round(float(np.exp(uniform(np.log(2), np.log(60)))), 3),
            "frames": {"table": table},
            "points": self.points,
            "start": {"joints": start.tolist()},
            "moves": moves,
            "output": {
                "rate": 500,
                "units": {"angle": "rad", "length": "m"},
                "columns": ["t", "q", "qd", "qdd", "pose", "zone", "move"],
            },
        }

    def _drawn_points(
        self, frame: np.ndarray, home: np.ndarray
    ) -> tuple[dict[str, Any], dict[str, list[np.ndarray]]]:
        """Return points of the work object, one of which is many, and where they are in the world."""
        points, places = {}, {}
        size = self.draws.uniform(0.02, 0.1)
        for name in ("a", "b", "c"):
            pose = np.eye(4)
            turn = Rotation.from_rotvec(self.draws.uniform(-0.3, 0.3, 3)).as_matrix()
            pose[:3, :3] = frame[:3, :3].T @ home[:3, :3] @ turn
            pose[:3, 3] = self.draws.uniform(-size, size, 3)
            points[name] = {**written(pose), "in": "table"}
            places[name] = [frame @ placed(points[name])]
        step = [round(float(self.draws.uniform(20, 50)), 2), 0, 0]
        points["slots"] = {"grid": {"from": "a", "steps": [{"count": 2, "xyz": step}], "frame": "table"}}
        second = places["a"][0].copy()
        second[:3, 3] += frame[:3, :3] @ np.array(step) / 1000
        places["slots"] = [places["a"][0], second]
        return points, places

    def _drawn_moves(self) -> list[dict[str, Any]]:
        """Return moves to points, the last but one perhaps a round for each place of the grid."""
        moves: list[dict[str, Any]] = []
        for name in self.draws.permutation(["a", "b", "c"])[: self.draws.integers(2, 4)]:
            moves.append(self._move(str(name)))
            self._done(moves[-1], self.places[str(name)][0])
        if self.draws.random() < 0.4:
            there, back = self._move("slots"), self._move("c")
            moves.append({"repeat": "slots", "moves": [there, back]})
            for place in self.places["slots"]:
                self._done(there, place)
                self._done(back, self.places["c"][0])
        return moves

    def _move(self, name: str) -> dict[str, Any]:
        law: dict[str, Any] = {"shape": "time_optimal"}
        if self.draws.random() < 0.6:
            law["speed"] = round(float(self.draws.uniform(50, 1000)), 1)
        kind = self.draws.choice(["line", "arc", "jerk_limited"], p=[0.5, 0.1, 0.4])
        kind = "line" if (name, kind) == ("slots", "arc") else kind  # the tool may be there already
        if kind == "jerk_limited":
            return {"planner": "jerk_limited", "to": name, "synchronize": "phase"}
        if kind == "arc":
            via = self.draws.uniform(-40, 40, 3).round(3).tolist()
            return {"planner": "arc", "via": {"xyz": via, "in": "table"}, "to": name, "law": law}
        return {"planner": "line", "to": name, "law": law}

    def _done(self, move: dict[str, Any], place: np.ndarray) -> None:
        self.planners.append(move["planner"])
        self.stops.append(place)


def judged(seed: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> int:
    """Judge the rows of a program; return how many zones it flies by, -1 where it is refused."""
    program, job, rows = Program(seed), tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(json.dumps(program.job), encoding="utf-8")
    code, _, said = call(capfd, "plan", job, "-o", rows, "--report", tmp_path / "report.json", "-q")
    if code in (1, 3):  # out of reach, or within limits only when it is slowed down
        return -1
    assert code == 0, (seed, said)
    zones = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))["flyby"]["zones"]
    table = np.genfromtxt(rows, delimiter=",", names=True)
    block = np.array(table.tolist())
    poses = tool_poses(block[:, 1:7], program.tool)
    _joints_keep_limits(program, block)
    np.testing.assert_allclose(poses[:, :3, 3], block[:, 19:22], rtol=0, atol=1e-8)
    _tool_keeps_limits(program, block[:, 0], poses[:, :3, 3])
    _tool_is_where_it_may_be(program, zones, poses[:, :3, 3], table)
    np.testing.assert_allclose(poses[-1], program.stops[-1], rtol=0, atol=3e-6)
    assert call(capfd, "check", rows, "--job", job).code == 0, seed
    return len(zones)


def _joints_keep_limits(program: Program, block: np.ndarray) -> None:
    """Assert that rates are within limits, the jerk by the mean value of what accelerations change, and belong together."""
    limits = {name: np.radians(program.limits[name]) for name in ("velocity", "acceleration", "jerk")}
    steps = np.diff(block[:, 0])[:, None]
    q, qd, qdd = block[:, 1:7], block[:, 7:13], block[:, 13:19]
    assert np.abs(qd).max() <= limits["velocity"] * (1 + 1e-9) + 1e-9
    assert np.abs(qdd).max() <= limits["acceleration"] * (1 + 1e-9) + 1e-9
    assert (np.abs(np.diff(qdd, axis=0)) <= limits["jerk"] * (steps + 1e-9) * (1 + 1e-9) + 2e-9).all()
    mean = steps * (qd[1:] + qd[:-1]) / 2
    assert (np.abs(np.diff(q, axis=0) - mean) <= limits["jerk"] * steps**3 / 8 + 1e-8).all()
    np.testing.assert_allclose(qd[[0, -1]], 0, atol=1e-8)


def _tool_keeps_limits(program: Program, times: np.ndarray, places: np.ndarray) -> None:
    """Assert what mean values over one row and over two say of the tool, whose joints are rounded to 5e-10 rad."""
    tool, step = program.limits.get("tcp", {}), times[1]
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert (ways <= tool.get("speed", np.inf) / 1000 * np.diff(times) * (1 + 1e-6) + 2e-9).all()
    bends = np.linalg.norm(np.diff(places[:-1], 2, axis=0), axis=1)  # the last row is no whole step behind
    assert (bends <= tool.get("acceleration", np.inf) / 1000 * step**2 * (1 + 1e-6) + 3e-8).all()


def _tool_is_where_it_may_be(
    program: Program, zones: list[dict[str, Any]], places: np.ndarray, table: np.ndarray
) -> None:
    """Assert that the tool is within each zone while it is in it, and else on the lines of its moves."""
    for number, zone in enumerate(zones, 1):
        corner = program.stops[zone["move"] + 1][:3, 3]
        inside = places[table["zone"] == number]
        assert zone["used"] <= zone["asked"] * (1 + 1e-9)
        assert np.linalg.norm(inside - corner, axis=1).max(initial=0.0) <= zone["asked"] + 1e-8
    for number, planner in enumerate(program.planners):
        along = places[(table["zone"] == 0) & (table["move"] == number)] - program.stops[number][:3, 3]
        if planner == "line" and along.size:
            whole = program.stops[number + 1][:3, 3] - program.stops[number][:3, 3]
            share = np.clip(along @ whole / (whole @ whole), 0.0, 1.0)
            assert np.linalg.norm(along - share[:, None] * whole, axis=1).max() <= 1e-6 + 1e-8


@pytest.mark.full
@pytest.mark.parametrize("seed", few([13, 0, 1, 6], 1))
def test_a_random_cell_keeps_all_that_its_rows_say(
    seed: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert judged(seed, tmp_path, capfd) > 0


@pytest.mark.soak
@pytest.mark.parametrize("block", range(20))
def test_two_hundred_random_cells(
    block: int, tmp_path: Path, capfd: pytest.CaptureFixture[str], tally: Tally
) -> None:
    zones = [
        judged(seed, tmp_path, capfd) for seed in range(1000 + SEEDS * block, 1000 + SEEDS * (block + 1))
    ]
    tally(
        {
            "programs": SEEDS,
            "planned": sum(each >= 0 for each in zones),
            "zones": sum(max(z, 0) for z in zones),
        }
    )
