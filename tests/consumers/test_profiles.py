"""Profiles as data: one file adds a consumer, and a file that is wrong says where."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from planted_faults import motion, surroundings

from trajcli.consumers.judgement import CHECKS, judge_by_profile, load_profile
from trajcli.consumers.profile import PROFILES, Profile, profile_names
from trajcli.errors import InputError
from trajcli.judge.reconstruction import INTERPOLATIONS

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


WHOLE = """\
title: A crane
interpolation: linear
note: It swings.
rows: {rate: 250, align: true, columns: [t, q]}
sources:
  manual: {text: Manual of the crane, date: "2026-11"}
  code: {text: crane.cpp, commit: abc1234, date: "2025-01"}
rules:
  - id: crane-steps
    check: differences
    severity: necessary
    text: No haste.
    parameters: {order: velocity, period: 4.0e-3, limit: [0.5, 0.25]}
    source: code
  - id: crane-oil
    severity: recommended
    text: Oil it.
    source: manual
"""


def read(folder: Path, text: str) -> Profile:
    (folder / "crane.yaml").write_text(text)
    return load_profile("crane", folder)


def test_what_stands_in_a_file_is_what_is_read(tmp_path: Path) -> None:
    found = read(tmp_path, WHOLE)
    assert (found.name, found.title, found.interpolation, found.note) == (
        "crane",
        "A crane",
        "linear",
        "It swings.",
    )
    assert (found.rows.rate, found.rows.align, found.rows.columns) == (250, True, ("t", "q"))
    assert found.rows.words == "rows at 250 Hz, moves of whole periods, columns t, q"
    steps, oil = found.rules
    assert (steps.id, steps.check, steps.severity) == ("crane-steps", "differences", "necessary")
    assert steps.parameters == {"order": "velocity", "period": 4e-3, "limit": [0.5, 0.25]}
    assert (steps.source.text, steps.source.commit, steps.source.date) == ("crane.cpp", "abc1234", "2025-01")
    assert (oil.check, oil.severity, oil.parameters) == (None, "recommended", {})
    assert (oil.source.text, oil.source.commit) == ("Manual of the crane", None)


def test_without_rows_it_takes_whole_states_at_any_times(tmp_path: Path) -> None:
    found = read(tmp_path, "\n".join(line for line in WHOLE.splitlines() if not line.startswith("rows")))
    assert found.rows.words == "columns t, q, qd, qdd"
    assert (found.rows.rate, found.rows.align) == (None, False)
    half = read(tmp_path, WHOLE.replace("rate: 250, align: true, columns: [t, q]", "rate: 8"))
    assert half.rows.words == "rows at 8 Hz, columns t, q, qd, qdd"


def test_the_interpolations_of_profiles_are_those_of_check(tmp_path: Path) -> None:
    for name in INTERPOLATIONS:
        assert read(tmp_path, WHOLE.replace("linear", name)).interpolation == name
    for name in ("spline", "Linear", "''"):
        with pytest.raises(InputError, match="unknown interpolation"):
            read(tmp_path, WHOLE.replace("linear", name))


ROWS, STEPS = "rows: {rate: 250, align: true, columns: [t, q]}", "    text: No haste.\n"
LIST = "`columns`: expected a list of groups of columns"
RATE, ALIGN = "`rate`: expected a number above 0, Hz", "`align`: expected true or false"
NUMBER = "`limit`: expected a number, a list of numbers or a word"


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        ("rate: 250", "rate: 0", [RATE]),
        ("rate: 250", "rate: -250", [RATE]),
        ("rate: 250", "rate: fast", [RATE]),
        ("rate: 250", "rate: true", [RATE]),
        ("rate: 250", "rate: .inf", ["expected a finite number, got .inf"]),
        ("rate: 250", "rate: .nan", ["expected a finite number, got .nan"]),
        ("align: true", "align: 1", [ALIGN]),
        ("[t, q]", "[]", [LIST]),
        ("[t, q]", "[t, place]", [LIST]),
        ("[t, q]", "[place, q]", [LIST]),
        ("[t, q]", "t", [LIST]),
        ("rate: 250, align: true", "rate: 0, align: 1", [RATE, ALIGN]),
        ("rate: 250", "speed: 250", ["unknown key 'speed'"]),
        ("rate: 250, align: true", "align: true, speed: 250", ["unknown key 'speed'"]),
        ("note: It swings.", "notes: It swings.", ["unknown key 'notes'"]),
        ("note: It swings.", "note: 3", ["`note`: expected a text"]),
        ("title: A crane", "title: [A crane]", ["`title`: expected a text"]),
        (ROWS, "rows: 250", ["`rows`: expected a mapping"]),
        ("text: crane.cpp, ", "", ["`text` is missing"]),
        ("text: Manual of the crane, ", "", ["`text` is missing"]),
        ('{text: crane.cpp, commit: abc1234, date: "2025-01"}', "crane.cpp", ["expected a mapping"]),
        ("commit: abc1234", "branch: main", ["unknown key 'branch'"]),
        ("    severity: necessary\n", "", ["`severity` is missing"]),
        ("    severity: recommended\n", "", ["`severity` is missing"]),
        ("    source: manual\n", "", ["`source` is missing"]),
        ("    source: manual\n", "    source: manual\n    sorce: code\n", ["unknown key 'sorce'"]),
        (STEPS, "", ["`text` is missing"]),
        (STEPS, "    text:\n", ["`text` is missing"]),
        ("  - id: crane-steps\n    check", "  - check", ["`id` is missing"]),
        ("severity: necessary", "severity: needed", ["unknown severity 'needed'"]),
        ("order: velocity, ", "", ["`order` is missing"]),
        ("order: velocity, period: 4.0e-3, ", "", ["`order` is missing", "`period` is missing"]),
        ("order: velocity", "order: velocity, oder: 1", ["unknown key 'oder'"]),
        ("[0.5, 0.25]", "[]", [NUMBER]),
        ("[0.5, 0.25]", "[0.5, fast]", [NUMBER]),
        ("[0.5, 0.25]", "[fast, 0.5]", [NUMBER]),
        ("[0.5, 0.25]", "[0.5, true]", [NUMBER]),
        ("[0.5, 0.25]", "[0.5, .nan]", ["expected a finite number, got .nan"]),
        ("[0.5, 0.25]", ".inf", ["expected a finite number, got .inf"]),
        (
            "parameters: {order: velocity",
            "parameters: {note: {a: 1}, order: velocity",
            ["unknown key 'note'"],
        ),
        ("source: code", "source: book", ["unknown source 'book'"]),
    ],
)
def test_every_flaw_of_a_file_is_named(tmp_path: Path, old: str, new: str, messages: list[str]) -> None:
    assert old in WHOLE
    with pytest.raises(InputError) as caught:
        read(tmp_path, WHOLE.replace(old, new, 1))
    found = [problem.message for problem in caught.value.problems]
    assert found[: len(messages)] == messages
    assert all(problem.place is not None for problem in caught.value.problems)


def test_a_key_that_nobody_knows_is_told_where_it_stands(tmp_path: Path) -> None:
    """Not where its value does."""
    text = WHOLE.replace("rate: 250", "rate: 250, speed: 40", 1)
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    (problem,) = caught.value.problems
    before = text[: text.index("speed: 40")].splitlines()
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (len(before), len(before[-1]) + 1)


@pytest.mark.parametrize("key", ["title", "sources", "rules"])
def test_what_every_file_has(tmp_path: Path, key: str) -> None:
    """A file without it is refused, whatever follows from that besides."""
    parts = re.split(r"^(?=[a-z])", WHOLE, flags=re.MULTILINE)
    with pytest.raises(InputError) as caught:
        read(tmp_path, "".join(part for part in parts if not part.startswith(key)))
    assert f"`{key}` is missing" in [problem.message for problem in caught.value.problems]


def test_a_rule_that_stands_twice_is_found_wherever_they_are(tmp_path: Path) -> None:
    more = "  - {id: crane-steps, severity: recommended, text: Again., source: code}\n"
    with pytest.raises(InputError, match="the rule 'crane-steps' stands twice"):
        read(tmp_path, WHOLE + more)


def test_a_parameter_may_be_a_yes_or_no(tmp_path: Path) -> None:
    """Of a note, which no check reads."""
    found = read(tmp_path, WHOLE + "    parameters: {oil: true, grade: SAE 30, litres: 2}\n")
    assert found.rules[1].parameters == {"oil": True, "grade": "SAE 30", "litres": 2}
