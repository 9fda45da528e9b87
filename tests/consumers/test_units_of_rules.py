"""Messages of the rules of consumers say the unit of each joint: those of a slide are about metres and newtons."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from planted_faults import motion

from trajcli.consumers.judgement import judge_by_profile, load_profile
from trajcli.consumers.profile import profile_names
from trajcli.consumers.rule_check import Surroundings
from trajcli.findings import Finding
from trajcli.kinematics.robot import JointType, Limits
from trajcli.streams.recorded_motion import RecordedMotion

NUMBER = r"-?[0-9.]+(e[-+][0-9]+)?"
LIMITS = Limits(*(np.tile([-1e-3, 1e-3], (7, 1)) for _ in range(4)))


def wild() -> RecordedMotion:
    """Return rows that each rule about numbers refuses: they begin and end in motion, far away, and step."""
    rows = motion(period=1e-3, rows=41, decimals=3)
    q = rows.q + 20 * np.sin(np.arange(41))[:, None]
    rates = {
        "qd": np.full_like(q, 5e3),
        "qdd": np.full_like(q, 6e3),
        "tau": np.outer(np.arange(41) % 2, np.full(7, 1e3)),
    }
    return replace(rows, t=rows.t + 1e-3, q=q, **rates)


def told(profile: str, types: tuple[JointType, ...] | None, columns: str) -> list[Finding]:
    """Return what a consumer finds of rows with some of the columns."""
    every = wild()
    some = {name: getattr(every, name) if name in columns.split() else None for name in ("qd", "qdd", "tau")}
    rows = replace(every, **some)
    around = Surroundings(rows.joints, rows.q[0] + 3.0, LIMITS, types)
    return list(judge_by_profile([rows], load_profile(profile), around).findings)


@pytest.mark.parametrize("columns", ["", "qd", "qd qdd tau"])
@pytest.mark.parametrize("profile", profile_names())
def test_a_slide_has_metres_where_a_turning_joint_has_radians(profile: str, columns: str) -> None:
    turning, unknown = told(profile, ("revolute",) * 7, columns), told(profile, None, columns)
    assert [each.message for each in unknown] == [each.message for each in turning]
    for sliding in range(7):
        types = tuple[JointType, ...]("prismatic" if k == sliding else "revolute" for k in range(7))
        for one, other in zip(turning, told(profile, types, columns), strict=True):
            message = one.message
            if one.joint == f"joint_{sliding + 1}":
                message = re.sub(r"\brad\b", "m", message.replace("N m", "N"))
            assert other.message == message


@pytest.mark.parametrize(
    ("profile", "columns", "rule", "said"),
    [
        ("franka-fr3", "", "fr3-velocity", f"is {NUMBER} rad/s at"),
        ("franka-fr3", "", "fr3-acceleration", f"is {NUMBER} rad/s\\^2 at"),
        ("franka-fr3", "", "fr3-jerk", f"is {NUMBER} rad/s\\^3 at"),
        (
            "franka-fr3",
            "",
            "fr3-decimals",
            f"to {NUMBER} rad, which makes a jerk of up to {NUMBER} rad/s\\^3 as",
        ),
        ("franka-fr3", "qd qdd tau", "fr3-torque-rate", f"changes by {NUMBER} N m/s at"),
        ("ros-jtc", "qd", "jtc-last-velocity", f"is {NUMBER} rad/s, at"),
        ("ros-jtc", "qd", "jtc-first-point", f"the jerk of joint_1 reaches {NUMBER} rad/s\\^3 at t"),
        ("ros-jtc", "", "jtc-positions-only", f"steps by {NUMBER} rad/s at"),
        ("ur-passthrough", "qd qdd", "passthrough-range", f", {NUMBER} rad/s\\^2 at"),
        ("ur-passthrough", "qd qdd", "passthrough-near-points", f"of up to {NUMBER} rad/s\\^2, its limit"),
    ],
)
def test_each_rule_says_its_unit(profile: str, columns: str, rule: str, said: str) -> None:
    messages = [each.message for each in told(profile, None, columns) if each.rule == rule]
    assert any(re.search(said, message) for message in messages), messages[:2]
