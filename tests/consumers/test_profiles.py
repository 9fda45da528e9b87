"""Profiles as data: one file adds a consumer, and a file that is wrong says where."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from planted_faults import motion, surroundings

from trajcli.consumers.judgement import CHECKS, judge_by_profile, load_profile
from trajcli.consumers.profile import PROFILES, profile_names
from trajcli.errors import InputError

MADE_UP = """\
title: A shaking table
sources:
  manual: {text: Manual of the table, date: "2026-11"}
rules:
  - id: table-steps
    check: differences
    severity: recommended
    text: It does not like to be hurried.
    parameters: {order: velocity, period: 1.0e-3, limit: 0.5}
    source: manual
  - id: table-oil
    severity: recommended
    text: Oil it.
    source: manual
"""


def test_one_file_adds_a_consumer(tmp_path: Path) -> None:
    (tmp_path / "table.yaml").write_text(MADE_UP)
    assert profile_names(tmp_path) == ["table"]
    table = load_profile("table", tmp_path)
    found = judge_by_profile([motion()], table, surroundings(7)).findings
    # a quintic of 0.5 rad in 1 s moves with up to 15/8 of its mean velocity
    joints = {breach.joint for breach in found}
    assert joints == {
        f"joint_{k + 1}"
        for k, change in enumerate((0.5, 0.3, 0.4, 0.3, 0.2, 0.4, 0.5))
        if change * 15 / 8 > 0.5
    }
    assert {(breach.rule, breach.severity) for breach in found} == {("table-steps", "warning")}
    slower = replace(table.rules[0], parameters={**table.rules[0].parameters, "limit": 1.0})
    assert judge_by_profile([motion()], replace(table, rules=(slower,))).findings == ()


@pytest.mark.parametrize(
    ("old", "new", "message", "hint"),
    [
        (
            "check: differences",
            "check: diferences",
            "unknown check 'diferences'",
            "did you mean 'differences'?",
        ),
        (
            "severity: recommended\n    text: It",
            "severity: wanted\n    text: It",
            "unknown severity 'wanted'",
            "valid names",
        ),
        ("limit: 0.5", "limt: 0.5", "unknown key 'limt'", "did you mean 'limit'?"),
        (", limit: 0.5", "", "`limit` is missing", None),
        ("limit: 0.5", "limit: {a: 1}", "`limit`: expected a number, a list of numbers or a word", None),
        (
            "source: manual\n  - id: table-oil",
            "source: book\n  - id: table-oil",
            "unknown source 'book'",
            "valid names",
        ),
        ("id: table-oil", "id: table-steps", "the rule 'table-steps' stands twice", None),
        ("title: A shaking table\n", "", "`title` is missing", None),
        ("sources:\n", "interpolation: wobbly\nsources:\n", "unknown interpolation 'wobbly'", "valid names"),
        ("    text: Oil it.\n", "", "`text` is missing", None),
        (', date: "2026-11"', "", "`date` is missing", None),
    ],
)
def test_a_wrong_file_says_where(tmp_path: Path, old: str, new: str, message: str, hint: str | None) -> None:
    assert old in MADE_UP
    (tmp_path / "table.yaml").write_text(MADE_UP.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_profile("table", tmp_path)
    problem = caught.value.problems[0]
    assert problem.message == message
    assert hint is None or (problem.hint or "").startswith(hint)
    assert problem.place is not None
    assert problem.place.file.endswith("table.yaml")


def test_unknown_names() -> None:
    with pytest.raises(InputError, match="there is no profile 'franka-fr'") as caught:
        load_profile("franka-fr")
    assert caught.value.problems[0].hint == "did you mean 'franka-fr3'?"
    with pytest.raises(InputError, match="no profile"):
        load_profile("../profiles/ros-jtc")


@pytest.mark.parametrize("name", profile_names())
def test_each_rule_says_where_it_is_from(name: str) -> None:
    profile = load_profile(name)
    assert profile.title
    for rule in profile.rules:
        assert rule.text.endswith((".", ")"))
        assert rule.source.date == "2026-11"
        assert rule.source.text
        if "libfranka" in rule.source.text or "ros2_controllers" in rule.source.text:
            assert rule.source.commit is not None


def test_the_profiles_that_come_with_trajcli() -> None:
    assert profile_names() == ["franka-fer", "franka-fr3", "ros-jtc", "ur-passthrough", "ur-servoj"]
    used = {rule.check for name in profile_names() for rule in load_profile(name).rules} - {None}
    assert used == set(CHECKS)
    assert all(path.suffix == ".yaml" for path in PROFILES.iterdir())


def test_limits_are_those_of_the_catalogue() -> None:
    """Both are from the same documents, and were read separately."""
    import numpy as np

    from trajcli.job.robot import load_robot

    for name, arm in (("franka-fr3", "fr3"), ("franka-fer", "panda")):
        limits = load_robot(arm).limits
        rules = {rule.id.split("-", 1)[1]: rule.parameters for rule in load_profile(name).rules}
        for kind in ("velocity", "acceleration", "jerk"):
            assert (
                np.broadcast_to(rules[kind]["limit"], 7)
                == limits.of_order(("", "velocity", "acceleration", "jerk").index(kind))[:, 1]
            ).all()
        assert (np.array(rules["position"]["lower"]) == limits.position[:, 0]).all()
        assert (np.array(rules["position"]["upper"]) == limits.position[:, 1]).all()
        if name == "franka-fr3":
            near = rules["velocity-by-position"]
            assert (limits.velocity_by_position == np.array([near["deceleration"], near["offset"]]).T).all()
