"""Limits: the robot's, replaced and then scaled by the job, tightened by a move."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.limits import with_move_limits
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
