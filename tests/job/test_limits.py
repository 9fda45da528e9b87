"""Limits: the robot's, replaced and then scaled by the job, tightened by a move."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.limits import looser_tool_bounds, with_move_limits
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.language.limits import LimitsSpec

DEG = math.pi / 180
ROBOT = """{joints: [{name: turn, position: [-90, 90], velocity: 100, acceleration: [-300, 200]},
  {name: lift, type: prismatic, velocity: 500, jerk: 9000}]}"""


def job(limits: str, move_limits: str = "{}") -> LoadedJob:
    return job_from_text(
        f"version: 1\nunits: {{angle: deg, length: mm}}\nrobot: {ROBOT}\nlimits: {limits}\nstart: {{joints: 0}}\n"
        f"moves: [{{planner: hold, duration: 1, limits: {move_limits}}}]\n"
    )


def bounds(loaded: LoadedJob, order: int) -> list[list[float]]:
    """The limits in force, in deg and mm."""
    return (loaded.robot.limits.of_order(order) / np.array([[DEG], [1e-3]])).tolist()


INF = math.inf
ASKED = [  # limits of the job, order, limits in force
    ("{}", 1, [[-100, 100], [-500, 500]]),
    ("{velocity: 50}", 1, [[-50, 50], [-50, 50]]),
    ("{velocity: [50, 60]}", 1, [[-50, 50], [-60, 60]]),
    ("{velocity: {lift: 60}}", 1, [[-100, 100], [-60, 60]]),
    ("{velocity: [[-20, 30], 60]}", 1, [[-20, 30], [-60, 60]]),
    ("{velocity: {turn: [-20, 30]}}", 1, [[-20, 30], [-500, 500]]),
    ("{velocity: {turn: 1 rad/s, lift: 10 cm/s}}", 1, [[-1 / DEG, 1 / DEG], [-100, 100]]),
    ("{velocity: null}", 1, [[-INF, INF], [-INF, INF]]),
    ("{velocity: [null, 60]}", 1, [[-INF, INF], [-60, 60]]),
    ("{velocity: {turn: null}}", 1, [[-INF, INF], [-500, 500]]),
    ("{scale: {velocity: 0.5}}", 1, [[-50, 50], [-250, 250]]),
    ("{velocity: 80, scale: {velocity: 0.5}}", 1, [[-40, 40], [-40, 40]]),
    ("{scale: {acceleration: 0.5}}", 2, [[-150, 100], [-INF, INF]]),
    ("{jerk: 1000, scale: {jerk: 0.1}}", 3, [[-100, 100], [-100, 100]]),
    ("{position: {turn: [-45, 0]}}", 0, [[-45, 0], [-INF, INF]]),
    ("{position: 30}", 0, [[-30, 30], [-30, 30]]),
]


@pytest.mark.parametrize(("limits", "order", "expected"), ASKED)
def test_limits_in_force(limits: str, order: int, expected: list[list[float]]) -> None:
    assert bounds(job(limits), order) == [pytest.approx(row, rel=1e-14) for row in expected]


LOOSER = [  # limits of the job, what the events say
    (
        "{velocity: {turn: 120}}",
        ["the job's velocity limit of turn is looser than the robot's: 120 deg/s instead of 100 deg/s"],
    ),
    (
        "{velocity: null}",
        [
            "the job's velocity limit of turn is looser than the robot's: unlimited instead of 100 deg/s",
            "the job's velocity limit of lift is looser than the robot's: unlimited instead of 500 mm/s",
        ],
    ),
    (
        "{acceleration: {turn: [-310, 150]}}",
        [
            "the job's acceleration limit of turn is looser than the robot's: -310 deg/s^2 instead of -300 deg/s^2"
        ],
    ),
    (
        "{position: {turn: [-90, 91]}}",
        ["the job's position limit of turn is looser than the robot's: 91 deg instead of 90 deg"],
    ),
    ("{velocity: {turn: 100}, acceleration: {lift: 5}, jerk: {turn: 1}}", []),
    ("{velocity: {turn: 1.7453292519943295 rad/s}}", []),
]


@pytest.mark.parametrize(("limits", "texts"), LOOSER)
def test_a_looser_limit_is_an_event(limits: str, texts: list[str]) -> None:
    loaded = job(limits)
    assert [event.text(loaded.say) for event in loaded.events] == texts
    assert {event.kind for event in loaded.events} <= {"looser_limit"}


def test_a_move_tightens_and_scales_what_the_job_left() -> None:
    loaded = job("{velocity: 80}", "{velocity: {turn: 40}, scale: {velocity: 0.5, jerk: 0.1}}")
    robot = with_move_limits(loaded.robot, loaded.job.moves[0].limits, 0)
    assert robot.limits.velocity[:, 1] == pytest.approx([20 * DEG, 0.04])
    assert robot.limits.jerk[1] == pytest.approx([-0.9, 0.9])
    assert np.array_equal(robot.limits.position, loaded.robot.limits.position)


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ("{velocity: {turn: 101}}", "the velocity limit of turn is 100 deg/s, got 101 deg/s"),
        ("{velocity: {turn: null}}", "the velocity limit of turn is 100 deg/s, got unlimited"),
        ("{position: {turn: [-91, 0]}}", "the position limit of turn is -90 deg, got -91 deg"),
        (
            "{velocity: {turn: 101}, scale: {velocity: 0.1}}",
            "the velocity limit of turn is 100 deg/s, got 101 deg/s",
        ),
    ],
)
def test_a_move_cannot_loosen(limits: str, text: str) -> None:
    with pytest.raises(InputError) as caught:
        job("{}", limits)
    assert [p.message for p in caught.value.problems] == [f"a move can only tighten limits: {text}"]


def test_a_move_built_in_python_cannot_loosen_either() -> None:
    robot = job("{}").robot
    spec = LimitsSpec(velocity=[2.0, None])  # type: ignore[arg-type]
    assert with_move_limits(robot, None, 0) is robot
    with pytest.raises(InputError, match="can only tighten limits"):
        with_move_limits(robot, spec, 3)


@pytest.mark.parametrize("k", [0.25, 0.5, 1.0])
def test_a_scale_of_velocities_is_that_of_every_speed(k: float) -> None:
    """By position, where sqrt(2 d x) - o becomes k times that at every distance x; of the tool; of no acceleration."""
    text = (
        "version: 1\nrobot: fr3\nlimits: {{scale: {{velocity: {}}}, tcp: {{speed: 0.4, acceleration: 3}}}}\n"
    )
    text += "start: {{joints: [0, -0.8, 0, -2.3, 0, 1.6, 0.8]}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    plain, scaled = (job_from_text(text.format(factor)).robot.limits for factor in (1.0, k))
    x = np.linspace(0.01, 2, 7)[:, None]
    speeds = [
        np.sqrt(2 * each.velocity_by_position[:, 0] * x) - each.velocity_by_position[:, 1]
        for each in (plain, scaled)
    ]
    assert np.isfinite(speeds[0]).all()
    np.testing.assert_allclose(speeds[1], k * speeds[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(scaled.velocity, k * plain.velocity, rtol=1e-15)
    assert (scaled.tcp.speed, scaled.tcp.acceleration) == (pytest.approx(0.4 * k), 3)


@pytest.mark.parametrize(("more", "events"), [(1e-14, 0), (-1e-3, 0), (1e-10, 1), (1e-3, 1)])
def test_the_same_limit_in_another_unit_is_not_looser(more: float, events: int) -> None:
    velocity = 100 * DEG * (1 + more)
    assert len(job(f"{{velocity: {{turn: {velocity!r} rad/s}}}}").events) == events


@pytest.mark.parametrize(("speed", "looser"), [(0.4, []), (0.39, []), (0.4 * (1 + 1e-9), ["speed"])])
def test_a_move_loosens_the_tool_by_more_than_rounding(speed: float, looser: list[str]) -> None:
    robot = job("{tcp: {speed: 400, acceleration: 2000}}").robot
    spec = LimitsSpec(tcp={"speed": speed})  # type: ignore[arg-type]
    assert [name for name, _ in looser_tool_bounds(robot, spec)] == looser
