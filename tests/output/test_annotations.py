"""Annotations, read back by other readers: of XML, of the published schema of SARIF, of commands of GitHub."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree as ET

import pytest
from pydantic_sarif.model import StaticAnalysisResultsFormatSarifVersion210JsonSchema as SarifLog

from trajcli.errors import (
    FileError,
    InputError,
    Place,
    PlanningError,
    Problem,
    TrajcliError,
    VerificationError,
)
from trajcli.output.annotations import AnnotationForm, annotations_of, render_annotations

PLACED = Problem("j1 is too fast", place=Place("jobs/a.yaml", 6, 5), joint="j1", time=0.125, kind="velocity")
WARNED = Problem("stretched", place=Place("jobs/b.yaml", 3, 1), kind="slowed", severity="warning")
NOTED = Problem("snapped to 1 ms", place=Place("rows.csv", 0, 0), kind="period", row=12, severity="note")
HARD = 'a, b: 50% of "x" <y> & \r\nline two :: \x1b[31m \ud800 \ufffe ü'


def sarif(*found: Problem, **options: Any) -> dict[str, Any]:
    """Return the one run of a log that keeps the published schema."""
    text = render_annotations(found, "sarif", **options)
    SarifLog.model_validate_json(text)
    log = json.loads(text)
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    return run


def cases(text: str) -> list[tuple[str, str, list[str]]]:
    """Return classname, name and failures of the cases of a JUnit document, whose counts are right."""
    root = ET.fromstring(text.encode("utf-8"))
    for element in [root, *root.iter("testsuite")]:
        assert int(element.attrib["tests"]) == len(list(element.iter("testcase")))
        assert int(element.attrib["failures"]) == len(list(element.iter("failure")))
    return [
        (case.attrib["classname"], case.attrib["name"], [f.attrib["message"] for f in case.iter("failure")])
        for case in root.iter("testcase")
    ]


def command(line: str) -> tuple[str, dict[str, str], str]:
    """Return kind, properties and message of a command, as the runner of GitHub Actions undoes its escapes."""
    match = re.fullmatch(r"::(\w+) ([^\n]*?)::([^\n]*)", line)
    assert match is not None, line
    pairs = dict(pair.split("=", 1) for pair in match[2].split(","))
    return match[1], {key: undone(value, of_property=True) for key, value in pairs.items()}, undone(match[3])


def undone(text: str, *, of_property: bool = False) -> str:
    """Return a text without the runner's escapes, the percent sign last."""
    escapes = [("%3A", ":"), ("%2C", ",")] if of_property else []
    for escape, character in [*escapes, ("%0D", "\r"), ("%0A", "\n"), ("%25", "%")]:
        text = text.replace(escape, character)
    return text


def test_commands_of_github() -> None:
    lines = render_annotations([PLACED, WARNED, NOTED], "github").splitlines()
    assert lines[0] == "::error file=jobs/a.yaml,line=6,col=5,title=trajcli%3A velocity::j1 is too fast"
    assert [command(line)[0] for line in lines] == ["error", "warning", "notice"]
    assert command(lines[2]) == (
        "notice",
        {"file": "rows.csv", "title": "trajcli: period"},
        "snapped to 1 ms (row 12)",
    )
    assert render_annotations([], "github") == ""


def test_hard_texts_stay_one_command() -> None:
    (line,) = render_annotations(
        [Problem(HARD, place=Place("dir, one/50%:x.yaml", 1, 0), kind="a,b")], "github"
    ).splitlines()
    kind, given, message = command(line)
    assert (kind, given["file"], given["line"]) == ("error", "dir, one/50%:x.yaml", "1")
    assert message == HARD.replace("\x1b", "\\x1b").replace("\ud800", "\\ud800").replace("\ufffe", "\\ufffe")
    assert "line" in given
    assert "title" in given


def test_standard_input_is_no_file_of_a_repository() -> None:
    (line,) = render_annotations(
        [Problem("wrong", place=Place("<stdin>", 3, 4), kind="input")], "github"
    ).splitlines()
    assert line == "::error title=trajcli%3A input::wrong"


def test_junit_has_a_suite_for_each_file_also_where_nothing_is_wrong() -> None:
    text = render_annotations([PLACED, WARNED], "junit", ["jobs/a.yaml", "jobs/b.yaml", "jobs/c.yaml"])
    assert cases(text) == [
        ("jobs/a.yaml", "velocity", ["j1 is too fast"]),
        ("jobs/b.yaml", "verification", []),
        ("jobs/b.yaml", "slowed", []),
        ("jobs/c.yaml", "verification", []),
    ]
    assert "jobs/a.yaml:6: j1 is too fast" in text
    assert "warning: jobs/b.yaml:3: stretched" in text


def test_junit_names_what_was_judged_and_cases_differ() -> None:
    found = [Problem(f"j{joint}", place=Place("a.csv", 0, 0), kind="limit") for joint in (1, 2)]
    assert cases(render_annotations(found, "junit", ["a.csv"])) == [
        ("a.csv", "limit 1 of 2", ["j1"]),
        ("a.csv", "limit 2 of 2", ["j2"]),
    ]
    assert cases(render_annotations([], "junit", ["a.csv"])) == [("a.csv", "verification", [])]


def test_junit_holds_hard_texts() -> None:
    (case,) = cases(render_annotations([Problem(HARD, place=Place(HARD, 0, 0), kind="r")], "junit"))
    shown = HARD.replace("\x1b", "\\x1b").replace("\ud800", "\\ud800").replace("\ufffe", "\\ufffe")
    assert case[2] == [shown]


def test_sarif_keeps_the_published_schema() -> None:
    run = sarif(PLACED, WARNED, NOTED)
    names = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert names == ["velocity", "slowed", "period"]
    assert run["tool"]["driver"]["rules"][0]["shortDescription"]["text"] == "A finding of the kind velocity."
    assert [result["level"] for result in run["results"]] == ["error", "warning", "note"]
    assert [names[result["ruleIndex"]] for result in run["results"]] == names
    first, _, last = run["results"]
    assert first["locations"][0]["physicalLocation"] == {
        "artifactLocation": {"uri": "jobs/a.yaml"},
        "region": {"startLine": 6, "startColumn": 5},
    }
    assert first["properties"] == {"joint": "j1", "time": 0.125}
    assert last["properties"] == {"row": 12}
    assert "region" not in last["locations"][0]["physicalLocation"]
    assert sarif()["results"] == []


@pytest.mark.parametrize("file", ["a b/ü%.yaml", "/tmp/a b.yaml", "q?x#y.yaml"])
def test_names_of_files_are_uris(file: str) -> None:
    (result,) = sarif(Problem(HARD, place=Place(file, 1, 0), kind="input"))["results"]
    uri = urlsplit(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"])
    assert (uri.scheme, unquote(uri.path), uri.query, uri.fragment) == (
        "file" if file.startswith("/") else "",
        file,
        "",
        "",
    )


def test_a_time_that_is_not_finite_is_left_out() -> None:
    (result,) = sarif(Problem("m", time=float("inf"), kind="r"))["results"]
    assert "properties" not in result
    assert "locations" not in result


ERRORS = [
    (VerificationError, "verification"),
    (InputError, "input"),
    (PlanningError, "planning"),
    (FileError, "file"),
    (TrajcliError, "bug"),
]


@pytest.mark.parametrize(("kind", "rule"), ERRORS)
def test_problems_of_errors(kind: type[TrajcliError], rule: str) -> None:
    problem = Problem("wrong", "do this", Place("a.yaml", 3, 7), joint="j2", time=1.5)
    placed, plain = annotations_of(kind(problem, Problem("more", kind="velocity")), "b.yaml")
    assert placed == replace(problem, kind=rule)
    assert plain == Problem("more", kind="velocity", place=Place("b.yaml", 0, 0))
    text = render_annotations([placed, plain], "github")
    assert text == (
        f"::error file=a.yaml,line=3,col=7,title=trajcli%3A {rule}::wrong (do this)\n"
        "::error file=b.yaml,title=trajcli%3A velocity::more\n"
    )


@pytest.mark.parametrize("form", ["github", "junit", "sarif"])
def test_texts_end_in_a_line_feed(form: AnnotationForm) -> None:
    assert render_annotations([PLACED], form).endswith("\n")


@pytest.mark.parametrize("text", ["100%0A", "%25", "a%2Cb%3Ac", "50%"])
def test_what_looks_like_an_escape_of_the_runner_is_none(text: str) -> None:
    (line,) = render_annotations([Problem(text, place=Place(text, 1, 0), kind=text)], "github").splitlines()
    assert command(line) == ("error", {"file": text, "line": "1", "title": f"trajcli: {text}"}, text)


@pytest.mark.parametrize(("text", "added"), [("row 12 is late", True), ("row 1 is late", False)])
def test_a_row_is_told_unless_the_message_names_that_one(text: str, *, added: bool) -> None:
    (line,) = render_annotations([Problem(text, row=1, kind="time")], "github").splitlines()
    assert command(line)[2] == text + " (row 1)" * added


def test_a_problem_of_no_kind_is_a_bug() -> None:
    assert command(render_annotations([Problem("odd")], "github").strip())[1] == {"title": "trajcli: bug"}
    assert cases(render_annotations([Problem("odd")], "junit")) == [("trajcli", "bug", ["odd"])]
    assert [result["ruleId"] for result in sarif(Problem("odd"))["results"]] == ["bug"]


def test_junit_of_nothing_has_one_case_that_passes() -> None:
    """Services take a document without cases for a run that has failed."""
    assert cases(render_annotations([], "junit")) == [("trajcli", "verification", [])]


def test_junit_names_no_line_of_a_whole_file() -> None:
    root = ET.fromstring(render_annotations([NOTED], "junit").encode())
    (said,) = root.iter("system-out")
    assert said.text == "note: snapped to 1 ms (row 12)"


def test_sarif_counts_columns_in_characters_and_names_standard_input() -> None:
    """Of a name that is no text, what is none is shown as its escape."""
    run = sarif(*(Problem("m", place=Place(file, 2, 3), kind="input") for file in ("-", "a\udcff.yaml")))
    assert run["columnKind"] == "unicodeCodePoints"
    places = [result["locations"][0]["physicalLocation"] for result in run["results"]]
    assert [unquote(place["artifactLocation"]["uri"]) for place in places] == ["stdin", r"a\udcff.yaml"]
