"""Limits of the tool over rows of few decimals: what they state is over a limit, whatever the curve through them is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_rows import rounded_rows

from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

LARGEST, TURN = 3.0, 2 * np.pi
SIZES = {"speed": LARGEST / TURN, "acceleration": LARGEST, "jerk": LARGEST * TURN}
NEEDED = {"speed": 1, "acceleration": 2, "jerk": 3}  # columns of joints whose differences state it
OF_ARMS = [("revolute", name) for name in (*SIZES, *(f"angular_{name}" for name in SIZES))] + [
    ("prismatic", name) for name in SIZES
]


def swing(
    joint: str,
    limit: str,
    share: float,
    t: np.ndarray,
    columns: int,
    decimals: int,
    *,
    asked: bool = False,
    arm: float = 1.0,
) -> tuple[str, list[Finding]]:
    """Return the verdict and what is found of a tool that swings at 1 Hz by one joint, beside it where that turns.

    Its limit is a share of the largest derivative of the joint; of a point that turns the square of the speed adds 2 %.
    """
    q = [LARGEST * TURN ** (k - 2) * np.sin(TURN * t + k * np.pi / 2)[:, None] for k in range(3)]
    states = [np.round(values, decimals) for values in q[:columns]] + [None] * (3 - columns)
    half = np.array([0.5 * 10.0**-decimals])
    name = limit.removeprefix("angular_")
    bounds = replace(unlimited(1), tcp=ToolLimits(**{limit: share * SIZES[name]}))
    tool = np.eye(4)
    tool[0, 3] = arm
    robot = Robot("arm", (Joint("a", type=joint),), bounds, "standard", np.eye(4), tool)
    rows = RecordedMotion(t, *states, None, None, None, None, Resolution(0.0, half, half, half), "rows")
    joined = ("linear", "cubic", "quintic")[columns - 1] if asked else None
    judgement = judge_motion(
        lambda: (rows,), Requirements(robot, tool=lambda: ToolJudge(robot), interpolate=joined)
    )
    return judgement.verdict, [found for found in judgement.findings if found.kind == f"tool_{limit}"]


@pytest.mark.parametrize(("joint", "limit"), OF_ARMS)
@pytest.mark.parametrize("more", [0, 1])
@pytest.mark.parametrize(("share", "over"), [(0.9, True), (1.1, False)])
def test_dense_rows_that_state_too_much_are_over_the_limit(
    share: float, more: int, limit: str, joint: str, *, over: bool
) -> None:
    """By the differences of their last column, or of the last but one; decimals make many times as much of the curve."""
    name = limit.removeprefix("angular_")
    columns = min(NEEDED[name] + more, 3)
    t = np.arange(251) * 4e-3
    verdict, found = swing(joint, limit, share, t, columns, 4)
    assert (verdict == "exceeded") == over
    for each in found if over else ():
        assert (each.severity, each.certainty) == ("error", "exceeded")
        assert abs(each.value - SIZES[name]) <= 0.03 * SIZES[name] + each.rounding
        assert 0.0 < each.rounding < 0.2 * SIZES[name]
        if name != "speed":
            assert each.method == "sampled"
            assert each.time / 4e-3 % 1.0 == pytest.approx(0.5, abs=0.01)
        assert each.row == round(each.time / 4e-3 - 0.25) + 1


@pytest.mark.parametrize(("joint", "limit"), OF_ARMS)
@pytest.mark.parametrize(("share", "over"), [(0.9, True), (1.15, False)])
@pytest.mark.parametrize("asked", [False, True])
def test_a_short_interval_of_sparse_rows_hides_nothing(
    share: float, limit: str, joint: str, *, over: bool, asked: bool
) -> None:
    """A tenth of a millisecond makes of six decimals thousands of times what is allowed, and nothing of it certain."""
    name = limit.removeprefix("angular_")
    t = np.sort(np.append(np.arange(51) * 0.02, [0.3201, 0.8201]))
    verdict, found = swing(joint, limit, share, t, 3, 6, asked=asked)
    assert (verdict == "exceeded") == over
    for each in found if over else ():
        assert (each.severity, each.certainty) == ("error", "exceeded")
        assert each.value == pytest.approx(SIZES[name], rel=0.1)


@pytest.mark.parametrize("asked", [False, True])
def test_dense_rows_whose_curve_alone_is_over_a_limit_are_over_it_where_somebody_asked(
    *, asked: bool
) -> None:
    """Beside a short interval that rounding explains: a step of acceleration between two rows, of which the quintic makes 1.12 m/s^2."""
    t = np.sort(np.append(np.arange(51) * 4e-3, 0.1601))
    since = np.maximum(t - 0.1212, 0.0)
    states = [0.5 * since**2, since, (since > 0).astype(float)]
    rows = rounded_rows(t, states, 8)
    limits = replace(unlimited(1), tcp=ToolLimits(acceleration=1.05))
    robot = Robot("arm", (Joint("a", type="prismatic"),), limits, "standard", np.eye(4), np.eye(4))
    joined = "quintic" if asked else None
    judgement = judge_motion(
        lambda: (rows,), Requirements(robot, tool=lambda: ToolJudge(robot), interpolate=joined)
    )
    found = [each for each in judgement.findings if each.kind == "tool_acceleration"]
    assert [each.certainty == "exceeded" and each.severity == "error" for each in found] == [asked]


@pytest.mark.parametrize(("joint", "limit"), OF_ARMS)
@pytest.mark.parametrize("period", [4e-3, 2e-2])
@pytest.mark.parametrize("asked", [False, True])
def test_what_rounding_makes_of_rows_is_never_certain(
    period: float, limit: str, joint: str, *, asked: bool
) -> None:
    """Three decimals, of which differences and curves make more than is allowed."""
    t = np.arange(round(1 / period) + 1) * period
    for columns in range(NEEDED[limit.removeprefix("angular_")], 4):
        verdict, _ = swing(joint, limit, 1.03, t, columns, 3, asked=asked)
        assert verdict != "exceeded"


@pytest.mark.parametrize(
    ("joint", "limit"), [("prismatic", "acceleration"), ("revolute", "angular_acceleration")]
)
@pytest.mark.parametrize(("share", "over"), [(0.99, True), (1.01, False)])
def test_what_is_largest_between_sparse_rows_is_hidden_by_no_short_interval(
    share: float, limit: str, joint: str, *, over: bool
) -> None:
    """The mean of 0.1 s around the peak is a sixtieth less than this; a point half a metre away has half of it."""
    t = np.sort(np.append(np.arange(11) * 0.1, 0.5001))
    verdict, found = swing(joint, limit, share, t, 3, 6, arm=0.5)
    assert (verdict == "exceeded") == over
    for each in found if over else ():
        assert (each.method, each.value) == ("bounded", pytest.approx(LARGEST, rel=1e-3))
        assert min(abs(each.time - 0.25), abs(each.time - 0.75)) < 1e-3


def test_a_turn_is_told_from_what_a_point_beside_it_does() -> None:
    """By dense rows: half a metre away from the axis the acceleration is half of the angular one."""
    t = np.arange(251) * 4e-3
    for limit, share, over in (
        ("angular_acceleration", 0.9, True),
        ("acceleration", 0.45, True),
        ("acceleration", 0.56, False),
        ("angular_speed", 0.9, True),
        ("speed", 0.56, False),
    ):
        verdict, _ = swing("revolute", limit, share, t, NEEDED[limit.removeprefix("angular_")], 4, arm=0.5)
        assert (verdict == "exceeded") == over, limit


@pytest.mark.parametrize(("excess", "verdict"), [(0.005, "within rounding"), (0.03, "exceeded")])
def test_an_acceleration_is_as_certain_as_the_rounding_where_it_is(excess: float, verdict: str) -> None:
    """A tool at 1 m stops and goes back within 10 s, at 3 rad/s at both ends, where it takes 9 m/s^2 inwards.

    A position is off by 1 mrad: at 3 rad/s that makes 2 w^2 of it, 18 mm/s^2, and where it stands still next to nothing.
    """
    speed, t = 3.0, np.array([0.0, 10.0])
    q, qd, qdd = np.zeros(2), np.array([-speed, speed]), np.full(2, 2 * speed / 10.0)
    tool = np.eye(4)
    tool[0, 3] = 1.0
    bounds = replace(unlimited(1), tcp=ToolLimits(acceleration=float(np.hypot(speed**2, qdd[0])) - excess))
    robot = Robot("arm", (Joint("a", type="revolute"),), bounds, "standard", np.eye(4), tool)
    off = [np.full(1, each) for each in (1e-3, 1e-6, 1e-6)]
    columns = [each[:, None] for each in (q, qd, qdd)]
    rows = RecordedMotion(t, *columns, None, None, None, None, Resolution(0.0, *off), "rows")
    needs = Requirements(robot, tool=lambda: ToolJudge(robot), interpolate="quintic")
    assert judge_motion(lambda: (rows,), needs).verdict == verdict
