"""Curves of joints that follow a path: the tolerance they are made within, and the turns of the tool that count."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest

from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following.tolerance import Tolerance, ToleranceRatio
from trajcli.kinematics.following.tool_path import SpeedLimits, ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.planners.tool_path import follow
from trajcli.planners.tool_path.follow import (
    FollowedPath,
    FollowingDiagnosis,
    diagnosis_on_path,
    followed,
)

ARM = Robot("planar", (Joint("a", a=0.5), Joint("b", a=0.5)), unlimited(2), "standard", np.eye(4), np.eye(4))
START = np.array([0.1, 0.8])


def line(tcp: ToolLimits | None = None, speeds: SpeedLimits | None = None) -> FollowedPath:
    """Return the joints of a planar arm along a line, on which its geometry says how the tool turns."""
    robot = replace(ARM, limits=replace(ARM.limits, tcp=tcp or ToolLimits()))
    pose = forward(robot, START)
    straight = Line(pose[:3, 3], np.array([0.1, 0.6, 0.0]))
    still = AxisAngleOrientation(np.stack([pose[:3, :3]] * 2), SegmentProgress.even(straight.length))
    path = ToolPath(PoseCurve(straight, still), (True, True, True), "none", "z", ())
    return followed(robot, replace(path, speeds=speeds), START)


@pytest.mark.parametrize(
    ("tcp", "asked", "expected"),
    [
        (None, Tolerance(2e-3, 6e-4), (1e-3, 3e-4)),
        (None, Tolerance(2e-7, 6e-8), (1e-7, 3e-8)),
        (
            ToolLimits(speed=1.0),
            Tolerance(2e-3, 6e-4),
            (1e-6, 1e-6),
        ),  # at a limit of its rates it is not above it
        (ToolLimits(angular_acceleration=1.0), Tolerance(2e-3, 6e-8), (1e-6, 3e-8)),
        (ToolLimits(speed=1.0), Tolerance(2e-7, 6e-4), (1e-7, 1e-6)),
    ],
)
def test_joints_over_s_have_half_of_each_tolerance_and_a_small_one_where_the_tool_is_limited(
    monkeypatch: pytest.MonkeyPatch, tcp: ToolLimits | None, asked: Tolerance, expected: tuple[float, float]
) -> None:
    made, seen = line(tcp), list[Tolerance]()
    ratio = follow.tolerance_ratio

    def noted(exact: follow.Follower, tolerance: Tolerance, *rest: np.ndarray) -> ToleranceRatio:
        seen.append(tolerance)
        return ratio(exact, tolerance, *rest)

    monkeypatch.setattr(follow, "tolerance_ratio", noted)
    made.by_s(asked)
    assert [(each.position, each.angle) for each in seen] == [pytest.approx(expected)]


INF = np.inf


@pytest.mark.parametrize(
    ("angular_speeds", "tcp", "counts"),
    [
        ((INF, INF, INF), {}, False),
        ((INF, INF, 2.0), {}, True),
        ((2.0, INF, INF), {}, True),
        ((INF, INF, INF), {"angular_speed": 2.0}, True),
        ((INF, INF, INF), {"angular_acceleration": 2.0}, True),
        (None, {"angular_acceleration": 2.0}, True),
        (None, {"speed": 2.0}, False),
    ],
)
def test_a_free_turn_counts_where_some_segment_or_the_whole_path_limits_it(
    angular_speeds: tuple[float, ...] | None, tcp: dict[str, float], counts: bool
) -> None:
    speeds = None
    if angular_speeds is not None:
        length = float(np.linalg.norm(forward(ARM, START)[:3, 3] - [0.1, 0.6, 0.0]))
        borders = np.linspace(0.0, length, 4)
        speeds = SpeedLimits(borders, (0, 1, 2, 3), np.full(3, 9.0), np.array(angular_speeds))
    made = line(speeds=speeds)
    seen = made.limited_by(ToolLimits(**tcp))
    turning = np.abs(seen.poses.evaluate(np.array([0.2]))[1][:, 3:]).max()
    assert (turning > 0.1) == counts
    assert counts or seen is made.path


@pytest.mark.parametrize("elbow", [1e-2, -3e-4])
def test_a_singularity_is_told_by_the_smallest_over_the_largest_singular_value(elbow: float) -> None:
    made, joints = line(), np.array([0.3, elbow])
    largest, smallest = np.linalg.svd(jacobian(ARM, joints)[:2], compute_uv=False)
    error = diagnosis_on_path(ARM, made.path, made.follower)._singular(0.2, joints, np.array([3.0, -9.0]))
    said = re.search(r"singular value (\S+)\)", error.problems[0].message)
    assert said is not None
    assert float(said[1]) == pytest.approx(smallest / largest, rel=0.05)
    assert error.problems[0].joint == "b"


@dataclass(frozen=True)
class Asked:
    """What is asked of an arm at some places of a path."""

    s: np.ndarray
    orientation: str


@pytest.mark.parametrize(
    ("reached", "orientation", "advised"),
    [
        ({1, 2, 3}, "all", True),
        ({1, 2}, "all", False),
        ({2, 3}, "all", False),
        ({1}, "all", False),
        (set(), "all", False),
        ({1, 2, 3}, "direction", False),  # nothing is left that could be free
    ],
)
def test_a_free_roll_is_advised_where_all_of_the_path_is_reached_with_it(
    monkeypatch: pytest.MonkeyPatch, reached: set[int], orientation: str, advised: bool
) -> None:
    def answers(own: FollowingDiagnosis, asked: Asked) -> tuple[list[np.ndarray], np.ndarray]:
        assert asked.orientation == "direction"
        return [START[None] if int(s) in reached else START[None][:0] for s in asked.s], np.zeros((0, 2))

    monkeypatch.setattr(FollowingDiagnosis, "_answers", answers)
    diagnosis = FollowingDiagnosis(ARM, lambda s, _: Asked(s, orientation), 3.0, None, False)  # type: ignore[arg-type, return-value]
    assert diagnosis._reached_with_free_roll(np.array([1.0, 2.0, 3.0])) is advised
