"""The rules of the architecture: the house keeps them, and each is seen to fail where it is broken."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import dead_code_rules
import file_rules
import floor_rules
import function_rules
import pytest
import safety_rules
import word_rules
from sources import ROOT, Offence, Planted, Rule, Sources, the_sources

from trajcli.planners import PLANNERS

RULES = [
    *dead_code_rules.RULES,
    *file_rules.RULES,
    *function_rules.RULES,
    *floor_rules.RULES,
    *safety_rules.RULES,
    *word_rules.RULES,
]
LONG = ("no_code_is_dead",)
"""Rules that read every file in several ways."""
EACH = [pytest.param(rule, id=rule.name, marks=[pytest.mark.full] * (rule.name in LONG)) for rule in RULES]
PLANTED = [
    pytest.param(rule, planted, id=f"{rule.name}-{number}")
    for rule in RULES
    for number, planted in enumerate(rule.planted)
]


@pytest.mark.parametrize("rule", EACH)
def test_the_house_keeps_the_rule(rule: Rule) -> None:
    wrong = rule.offences(the_sources(), rule.exceptions)
    assert not wrong, "\n" + "\n".join(f"{where}: {text}" for where, text in wrong)


@pytest.mark.parametrize(("rule", "planted"), PLANTED)
def test_a_planted_offence_is_found(rule: Rule, planted: Planted) -> None:
    right, wrong = planted.test_folders
    assert rule.offences(Sources(planted.clean, right), {}) == []
    assert rule.offences(Sources({**planted.clean, **planted.wrong}, wrong), {}) == planted.offences


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_can_fail_and_has_few_exceptions(rule: Rule) -> None:
    assert rule.planted
    assert all(planted.offences for planted in rule.planted)
    assert len(rule.exceptions) <= rule.most
    assert all(len(reason.split()) > 2 for reason in rule.exceptions.values()), "an exception says why"


def test_an_exception_is_accepted_once_and_refused_where_it_is_not_needed() -> None:
    rule = next(rule for rule in RULES if rule.check is file_rules.files_are_not_too_long)
    sources = Sources({"a.py": "\n" * 501, "b.py": "\n"})
    assert rule.offences(sources, {"a.py": "a long table"}) == []
    stale = rule.offences(sources, {"a.py": "a long table", "b.py": "none"})
    assert stale == [Offence("b.py", "this exception is not needed")]


def test_the_names_of_planners_are_read_from_their_table() -> None:
    assert floor_rules.tags_of_planners(the_sources()) == set(PLANNERS)


def test_contributing_shows_the_same_floors() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| (.*) \|$", text, re.MULTILINE)
    shown = [set(re.findall(r"`(\w+)(?:/|\.py)`", row)) for _, row in rows]
    assert [int(number) for number, _ in rows] == list(range(len(rows)))
    for floor, rooms in enumerate(floor_rules.FLOORS[: len(rows)]):
        others = {room for other in floor_rules.FLOORS if other != rooms for room in other}
        assert set(rooms) <= shown[floor]
        assert not shown[floor] & others
    assert "cli" in shown[-1]


def test_folders_of_one_shape_exist() -> None:
    assert file_rules.ONE_SHAPE.keys() <= the_sources().folders


def test_files_of_tests_have_names_of_their_own() -> None:
    """Pytest refuses a second file of a name."""
    names = Counter(path.name for path in (ROOT / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []


CLOCK = re.compile(r"\b(?:process_time|perf_counter)(?:_ns)?\(")


def test_no_test_measures_time() -> None:
    """It would fail on a busy machine: `calls_of` counts calls, and the benchmarks measure."""
    assert CLOCK.search("start = time.process_time()")
    files = [path for path in (ROOT / "tests").rglob("*.py") if path != Path(__file__)]
    assert files
    assert [str(path) for path in files if CLOCK.search(path.read_text(encoding="utf-8"))] == []
