"""Fastest laws of a tool that two slides carry, so that path, joints and limits are known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from trajcli.errors import MissingLimitError
from trajcli.job.read import job_from_text
from trajcli.kinematics.following.tool_path import SpeedLimits
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.planner import Planned
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.time_optimal import limits_of_law
from trajcli.planning.plan import plan_job

V, A, FAR = 2.0, 5.0, 1e4


def planned(to: list[float], law: dict[str, Any] | None = None, **limits: Any) -> Planned:
    """Return how a line of the tool from the origin is planned, with a law time_optimal."""
    load = "{mass: 5, com: [0, 0, 0], inertia: [0, 0, 0, 0, 0, 0]}"
    slides = [
        {"name": "x", "type": "prismatic", "alpha": 90, "theta": 90, "link": yaml.safe_load(load)},
        {"name": "y", "type": "prismatic", "link": yaml.safe_load(load)},
    ]
    job = {
        "version": 1,
        "units": {"angle": "deg"},
        "robot": {"convention": "standard", "joints": slides},
        "limits": {"velocity": V, "acceleration": A, "jerk": None, **limits},
        "start": {"joints": [0, 0]},
        "moves": [{"planner": "line", "to": {"joints": to}, "law": {"shape": "time_optimal", **(law or {})}}],
    }
    plan = plan_job(job_from_text(yaml.safe_dump(job)))
    assert plan.verdict.passed
    return plan.moves[0].planned


def trapezoid(length: float, speed: float, acceleration: float) -> float:
    """Return how long the fastest motion from rest to rest lasts."""
    if length < speed**2 / acceleration:
        return float(2 * np.sqrt(length / acceleration))
    return length / speed + speed / acceleration


@pytest.mark.parametrize(
    ("law", "tcp", "speed", "acceleration"),
    [
        ({}, {}, V, A),
        ({}, {"speed": 0.5}, 0.5, A),
        ({}, {"acceleration": 3.0}, V, 3.0),
        ({"speed": 0.5}, {"speed": 1.0}, 0.5, A),
        ({"acceleration": 1.5}, {"acceleration": 3.0, "speed": 0.7}, 0.7, 1.5),
        ({"speed": 0.5, "acceleration": 1.5}, {}, 0.5, 1.5),
    ],
)
def test_the_fastest_law_is_the_trapezoid_within_the_lowest_limits(
    law: dict[str, float], tcp: dict[str, float], speed: float, acceleration: float
) -> None:
    made = planned([-1.8, 0], law, tcp=tcp)
    wanted = trapezoid(1.8, speed, acceleration)
    assert made.curve.duration == pytest.approx(wanted, rel=1e-3)
    assert made.continuity == 1
    (bound,) = (event for event in made.events if event.kind == "bound")
    least: Any = bound.amounts["bound"]
    assert least.value <= made.curve.duration * (1 + 1e-12)
    assert least.value == pytest.approx(wanted, rel=1e-3)


def test_a_law_that_lasts_longer_is_the_fastest_slowed_down() -> None:
    """Its phases go with it, and it is not said to be near the fastest; one that asks for less is the fastest."""
    fast = planned([1.8, 0])
    for least, factor in ((0.5 * fast.curve.duration, 1.0), (2 * fast.curve.duration, 2.0)):
        made = planned([1.8, 0], {"minimum_duration": least})
        assert made.curve.duration == pytest.approx(factor * fast.curve.duration)
        assert made.law is None or made.law.duration == pytest.approx(made.curve.duration)
        assert made.phase_plane is not None
        assert made.phase_plane.law.duration == pytest.approx(made.curve.duration)
        assert made.tool is not None
        assert made.tool.law.duration == pytest.approx(made.curve.duration)
        assert [(phase.name, phase.joint) for phase in made.phases] == [
            ("acceleration +", 0),
            ("velocity +", 0),
            ("acceleration -", 0),
        ]
        ends = factor * np.array([0, V / A, 1.8 / V, 1.8 / V + V / A])
        assert [phase.start for phase in made.phases] == pytest.approx(ends[:-1], abs=0.01)
        assert [phase.end for phase in made.phases] == pytest.approx(ends[1:], abs=0.01)
        assert ("bound" in {event.kind for event in made.events}) is (factor == 1.0)


def test_phases_in_which_a_force_binds_are_named_by_it() -> None:
    """A slide across gravity, of 5 kg with 10 N: 2 m/s^2."""
    made = planned([0, 3.0], effort=[1e4, 10.0])
    assert [(phase.name, phase.joint) for phase in made.phases] == [
        ("effort +", 1),
        ("velocity +", 1),
        ("effort -", 1),
    ]
    assert made.curve.duration == pytest.approx(trapezoid(3.0, V, 2.0), rel=1e-3)


@pytest.mark.parametrize(
    ("law", "limits", "jerk"),
    [
        ({"jerk": 20.0}, {"tcp": {"jerk": 90.0}}, 20.0),
        ({}, {"jerk": [20.0, None]}, 20.0),
        ({}, {"jerk": [20.0, None], "tcp": {"jerk": 5.0}}, 5.0),
        ({"jerk": 4.0}, {"jerk": [20.0, None], "tcp": {"jerk": 5.0}}, 4.0),
    ],
)
def test_limits_of_jerk_are_those_of_joints_of_the_tool_and_of_the_law(
    law: dict[str, float], limits: dict[str, Any], jerk: float
) -> None:
    """Nothing else binds: a quarter of the time each way of each sign."""
    made = planned([0.3, 0], law, velocity=FAR, acceleration=FAR, **limits)
    assert made.curve.duration == pytest.approx((32 * 0.3 / jerk) ** (1 / 3), rel=2e-3)
    assert made.continuity == 2


def test_a_limit_of_jerk_of_a_joint_that_rests_changes_nothing() -> None:
    made = planned([1.8, 0], jerk=[None, 1.0])
    assert made.curve.duration == pytest.approx(trapezoid(1.8, V, A), rel=1e-3)
    assert made.continuity == 1


def test_who_moves_and_has_no_limit_is_named() -> None:
    for to, lacking in (([1, 1], ("x", "y")), ([1, 0], ("x",)), ([0, 1], ("y",))):
        with pytest.raises(MissingLimitError) as caught:
            planned(to, acceleration=None)
        assert [name in str(caught.value) for name in ("x", "y")] == [name in lacking for name in ("x", "y")]
    assert planned([1, 0], acceleration=[A, None]).curve.duration == pytest.approx(
        trapezoid(1, V, A), rel=1e-3
    )


def test_limits_of_a_law_take_the_place_of_those_of_the_tool() -> None:
    limits = ToolLimits(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert limits_of_law(LawSpec(shape="time_optimal"), limits) == limits
    spec = LawSpec(
        shape="time_optimal", speed=0.5, acceleration=0.6, angular_speed=0.7, angular_acceleration=0.8
    )
    assert limits_of_law(spec, limits) == ToolLimits(0.5, 0.6, 3.0, 0.7, 0.8, 6.0)
    assert limits_of_law(LawSpec(shape="time_optimal", jerk=9.0), limits).jerk == 9.0
    steps = SpeedLimits(np.array([0.0, 1.0, 2.0]), (0, 1, 2), np.array([0.2, 0.3]), np.array([0.9, 0.1]))
    assert limits_of_law(spec, limits, steps) == ToolLimits(0.3, 0.6, 3.0, 0.9, 0.8, 6.0)
