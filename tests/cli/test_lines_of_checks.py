"""Lines of `trajcli check`: which findings a table lists, in which units, and what would keep the limits."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from running import call

from trajcli.cli import check
from trajcli.errors import Amount
from trajcli.findings import Finding
from trajcli.judge.judgement import Judgement
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.units import Units

Capture = pytest.CaptureFixture[str]
ROBOT = Robot(
    "arm", (Joint("turn"), Joint("lift", type="prismatic")), unlimited(2), None, np.eye(4), np.eye(4)
)


def finding(kind: str = "velocity", **more: Any) -> Finding:
    amounts = {
        "joint": "turn",
        "value": Amount(np.pi / 2, 1, 0, "angle"),
        "limit": Amount(np.pi / 4, 1, 0, "angle"),
    }
    message = f"the {kind} of {{joint}} reaches {{value}}, its limit is {{limit}}"
    given: dict[str, Any] = {"joint": "turn", "value": np.pi / 2, "limit": np.pi / 4, "time": 0.25, "row": 3}
    return Finding(kind, **{**given, "amounts": amounts, "message": message, **more})


def checked(*findings: Finding, **more: Any) -> Any:
    given = {"interpolation": "cubic", "rows": 9, "source": "rows.csv", **more}
    judgement = Judgement(findings, **given)
    motion = SimpleNamespace(source="rows.csv")
    return SimpleNamespace(judgement=judgement, robot=ROBOT, units=Units("deg", "mm"), motion=motion)


def cells(line: str) -> list[str]:
    return re.split(r"\s{2,}", line.strip())


def test_a_table_has_values_in_the_units_of_the_user_and_what_is_not_known_as_a_dash() -> None:
    plain = finding(
        "effort", joint=None, value=1.5, limit=-2.0, time=None, row=None, amounts={}, message="much", count=7
    )
    jump = finding("jump", quantity="velocity", factor=1.5, severity="warning", rule="continuity")
    sure = finding(certainty="within rounding")
    head, *lines = list(check._lines(checked(finding(factor=2.0), plain, jump, sure)))
    assert head == "rows.csv: exceeded (9 rows, joined by cubics)"
    assert cells(lines[0]) == ["kind", "joint", "value", "limit", "t (s)", "row", "times", "stretch"]
    angle = ["90 deg/s", "45 deg/s", "0.25", "3", "1"]
    assert cells(lines[1]) == ["exceeded", "velocity", "turn", *angle, "2"]
    assert cells(lines[2]) == ["exceeded", "effort", "-", "1.5", "-2", "-", "-", "7"]
    assert cells(lines[3]) == ["warning", "jump of velocity", "turn", *angle, "1.5"]
    assert cells(lines[4]) == ["within rounding", "velocity", "turn", *angle]
    assert len(lines) == 5
    moves = list(check._lines(checked(finding(move=0), finding())))
    assert cells(moves[1])[:4] == ["kind", "joint", "move", "value"]
    assert [cells(line)[3] for line in moves[2:4]] == ["0", "-"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({}, "rows.csv: satisfied (9 rows, joined by cubics)"),
        ({"rows": 1, "period": 0.002}, "rows.csv: satisfied (1 row, every 0.002 s, joined by cubics)"),
        ({"source": None, "interpolation": "hold"}, "-: satisfied (9 rows, held from row to row)"),
        (
            {"planned_rows": True, "planned_with": "--rows knots"},
            "rows.csv: satisfied (9 rows, joined by cubics, rows of the motion that the job plans with `--rows knots`)",
        ),
        ({"planned_rows": False}, "rows.csv: satisfied (9 rows, joined by cubics)"),
    ],
)
def test_the_first_line_says_what_was_judged(more: dict[str, Any], said: str) -> None:
    assert list(check._lines(checked(**more))) == [said]


def test_the_worst_of_each_group_are_listed_and_the_others_counted() -> None:
    """30 that are certain, and four of each other group, however they stand."""
    certain = [finding(row=k) for k in range(35)]
    rounding = [finding(certainty="within rounding", row=k) for k in range(6)]
    warnings = [finding(severity="warning", row=k, certainty="within rounding") for k in range(5)]
    mixed = [each for some in zip(certain, [*rounding, *warnings] * 4, strict=False) for each in some][
        : 11 * 2
    ]
    every = [*certain, *rounding, *warnings]
    for findings, listed in (
        (every, 30 + 4 + 4),
        (certain[:30], 30),
        (certain[:31], 30),
        (mixed, 11 + 4 + 4),
    ):
        lines = list(check._lines(checked(*findings)))
        rows = [line for line in lines[2:] if cells(line)[0] in ("exceeded", "within rounding", "warning")]
        assert len(rows) == listed
        more = len(findings) - listed
        assert (f"  and {more} more: --format json has all of them" in lines) == (more > 0)


def test_what_has_no_number_is_said_and_rules_and_hints_once_each() -> None:
    stamp = finding(
        "time", value=None, limit=None, message="the time of {joint} is not finite", hint="mend it"
    )
    own = finding(rule="U1", hint="mend it")
    gap = finding("time", value=None, limit=None, rule="U2", message="there is a gap")
    lines = list(check._lines(checked(stamp, gap, own, own, finding(), notes=("a note",))))
    assert lines[-5:] == [
        "  the time of turn is not finite",
        "  there is a gap",
        "  U1: the velocity of turn reaches 90 deg/s, its limit is 45 deg/s",
        "  mend it",
        "  a note",
    ]


def test_a_stretch_keeps_the_limits_where_it_helps_against_all_that_is_certain() -> None:
    last = "  the motion keeps these limits when it takes 1.5 times as long"
    some = [
        finding(factor=1.5),
        finding(factor=1.25),
        finding(certainty="within rounding"),
        finding(severity="warning"),
    ]
    assert list(check._lines(checked(*some)))[-1] == last
    assert list(check._lines(checked(*some, finding())))[-1] != last
    assert list(check._lines(checked(*some[2:])))[-1] != last
    up = list(check._lines(checked(finding(factor=1 + 1 / 3e6))))[-1]
    assert float(up.split()[-4]) >= 1 + 1 / 3e6  # rounded up: less would not be enough
    row = cells(
        list(check._lines(checked(finding(factor=1 + 1 / 3e6, value=0.0, amounts={}, message="none"))))[2]
    )
    assert row[3] == "0"
    assert float(row[-1]) >= 1 + 1 / 3e6


@pytest.mark.parametrize(
    ("findings", "events", "code", "strict"),
    [
        ([], (), 0, 0),
        ([], ("an event",), 0, 1),
        ([finding(severity="warning")], (), 0, 0),
        ([finding(certainty="within rounding")], (), 0, 1),
        ([finding()], (), 1, 1),
    ],
)
def test_strict_refuses_events_and_what_rounding_explains(
    findings: list[Finding], events: tuple[str, ...], code: int, strict: int
) -> None:
    judgement = checked(*findings, events=events).judgement
    assert (check._failed(judgement, strict=False), check._failed(judgement, strict=True)) == (code, strict)


def test_annotations_are_of_the_kind_or_of_the_rule_of_a_consumer() -> None:
    kinds = [(each.kind, each.severity) for each in check._annotations(
        checked(finding(), finding(rule="U1"), finding("jump", rule="continuity", certainty="within rounding"),
                finding(severity="warning")), "rows.csv")]  # fmt: skip
    assert kinds == [("velocity", "error"), ("U1", "error"), ("jump", "note"), ("velocity", "warning")]
    (one,) = check._annotations(checked(finding(move=2)), "other.csv")
    assert one.text() == "the velocity of turn reaches 90 deg/s, its limit is 45 deg/s"
    assert one.place is not None
    assert (one.place.file, one.place.line, one.move) == ("other.csv", 0, 2)


def test_problems_are_those_that_are_certain_the_worst_of_each_move_and_kind() -> None:
    first = finding(move=0)
    some = [
        first,
        replace(first, row=4),
        replace(first, move=1),
        finding("jerk", move=0),
        finding(severity="warning"),
    ]
    file = checked(*some, finding(certainty="within rounding"))
    every = list(check.problems_of(file, every=True))
    assert len(every) == 4
    assert all("more like it" not in problem.text() for problem in every)
    short = [problem.text() for problem in check.problems_of(file, every=False)]
    assert len(short) == 3
    assert short[0].startswith("rows.csv: the velocity of turn reaches")
    assert short[0].endswith("(and 1 more like it: --all)")
    assert "more like it" not in short[1] + short[2]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("one.yaml").write_text(
        "units: {angle: rad}\njoints: [{velocity: 2, position: [-9, 9]}]\n", encoding="utf-8"
    )
    for name, rate in (("slow", 1), ("fast", 3), ("broken", None)):
        rows = "".join(f"{t},{'x' if rate is None else rate * t},{rate}\n" for t in range(3))
        Path(f"{name}.csv").write_text(f"t,q1,qd1\n{rows}", encoding="utf-8")
    return tmp_path


CODES = {"slow": 0, "fast": 1, "broken": 2, "none": 4}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("form", ["table", "json", "junit", "github"])
@pytest.mark.parametrize(
    "names", ["slow fast", "fast slow", "fast broken slow", "none broken", "broken fast none"]
)
def test_the_code_is_the_worst_of_all_files(names: str, form: str, capfd: Capture) -> None:
    files = [f"{name}.csv" for name in names.split()]
    outcome = call(capfd, "check", *files, "-r", "one.yaml", "--format", form)
    assert outcome.code == max(CODES[name] for name in names.split())
    if form == "table":
        assert outcome.out.count("satisfied") == names.count("slow")
        assert outcome.out.count(".csv: exceeded") == names.count("fast")
    if form == "github":
        assert outcome.out.count("::error file=fast.csv") == names.count("fast")
    if form in ("table", "json"):
        assert outcome.err.count("error:") == names.count("broken") + names.count("none")


@pytest.mark.usefixtures("folder")
def test_strict_refuses_limits_that_are_looser_than_the_robots(capfd: Capture) -> None:
    words = ("check", "slow.csv", "-r", "one.yaml", "--limits", "{velocity: 5}")
    assert call(capfd, *words).code == 0
    assert call(capfd, *words, "--strict").code == 1


@pytest.mark.usefixtures("folder")
def test_one_file_that_cannot_be_judged_is_the_error_of_the_command(capfd: Capture) -> None:
    for form, out in (("table", ""), ("json", "")):
        outcome = call(capfd, "check", "broken.csv", "-r", "one.yaml", "--format", form)
        assert (outcome.code, outcome.out) == (2, out)
        assert outcome.err.count("error:") == 1
    assert "<failure" in call(capfd, "check", "none.csv", "-r", "one.yaml", "--format", "junit").out
    for words in (("-", "-"), ("fast.csv", "-", "-")):
        outcome = call(capfd, "check", *words, "-r", "one.yaml")
        assert (outcome.code, outcome.err.count("standard input can be read once")) == (2, 1)
    both = call(capfd, "check", "fast.csv", "-r", "one.yaml", "--json", "--format", "junit")
    assert both.code == 2
    assert "exclude each other" in both.err
