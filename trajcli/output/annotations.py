"""Annotations for continuous integration: findings as JUnit, SARIF 2.1.0 and commands of GitHub Actions.

An annotation knows no job, no plan and no file format: whoever judges makes them of what it found.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal

from trajcli.errors import (
    FileError,
    InputError,
    Place,
    PlanningError,
    Problem,
    TrajcliError,
    VerificationError,
)
from trajcli.version import __version__

AnnotationForm = Literal["github", "junit", "sarif"]

_RULES: tuple[tuple[type[TrajcliError], str], ...] = (
    (VerificationError, "verification"),
    (InputError, "input"),
    (PlanningError, "planning"),
    (FileError, "file"),
)
_SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold, not even as references."""

_STANDARD_INPUT = ("-", "<stdin>")


def annotations_of(error: TrajcliError, file: str | None = None) -> tuple[Problem, ...]:
    """Return the problems of an error, each with a kind, and with the file that it is about.

    Args:
        error: Its problems without a kind of their own get that which its class names.
        file: What a problem is about that has no place in a file; "-" is standard input.
    """
    kind = next((name for of_class, name in _RULES if isinstance(error, of_class)), "bug")
    whole = None if file is None else Place(file, 0, 0)
    return tuple(
        replace(problem, kind=problem.kind or kind, place=problem.place or whole)
        for problem in error.problems
    )


def render_annotations(
    problems: Sequence[Problem], form: AnnotationForm, subjects: Sequence[str] = ()
) -> str:
    """Return a text for a service of continuous integration; it ends in a line feed unless it is empty.

    Args:
        problems: What was found, each with its kind; a place in line 0 is the whole file.
        form: "github" gives one line for each; "junit" and "sarif" one document, whatever was found.
        subjects: The files that were judged: JUnit names those, too, with which nothing is wrong.
    """
    problems = [_with_all_said(problem) for problem in problems]
    if form == "github":
        return "".join(f"{_github(problem)}\n" for problem in problems)
    if form == "junit":
        return _junit(problems, subjects)
    return json.dumps(_sarif(problems), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def _with_all_said(problem: Problem) -> Problem:
    """Return a problem whose message has its numbers, its hint, and its row where it does not name it."""
    text, hint = problem.text(), problem.advice()
    text += f" ({hint})" if hint else ""
    if problem.row is not None and not re.search(rf"\brow {problem.row}\b", text):
        text += f" (row {problem.row})"
    return replace(problem, message=text, hint=None, amounts={}, kind=problem.kind or "bug")


def _place(problem: Problem) -> Place:
    """Return the place of a problem; without a name of a file where there is none."""
    return problem.place or Place("", 0, 0)


def _github(problem: Problem) -> str:
    """Return a command that GitHub's runner reads from the output of a step."""
    kind = "notice" if problem.severity == "note" else problem.severity
    place = _place(problem)
    given = {"file": place.file, "line": place.line, "col": place.column}
    if place.file in _STANDARD_INPUT:
        given = {}
    given["title"] = f"trajcli: {problem.kind}"
    texts = ((key, _github_data(str(value))) for key, value in given.items() if value)
    pairs = (f"{key}={text.replace(':', '%3A').replace(',', '%2C')}" for key, text in texts)
    return f"::{kind} {','.join(pairs)}::{_github_data(problem.message)}"


def _github_data(text: str) -> str:
    """Return a message with the escapes that the runner undoes."""
    text = _encodable(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return _NO_XML.sub(_escaped, text)


def _encodable(text: str) -> str:
    """Return a text with what UTF-8 cannot hold as escapes."""
    return text.encode("utf-8", "backslashreplace").decode()


def _escaped(match: re.Match[str]) -> str:
    """Return a character that a document cannot hold as its escape in Python."""
    return match[0].encode("unicode_escape", "backslashreplace").decode("ascii")


def _junit(problems: Sequence[Problem], subjects: Sequence[str]) -> str:
    """Return a JUnit document: a suite for each file, in it a case for each problem, one if all is right."""
    from xml.etree import ElementTree as ET

    files = dict.fromkeys([*subjects, *(_place(problem).file for problem in problems)])
    root = ET.Element("testsuites", {"name": "trajcli"})
    for file in files or {"": None}:
        of_file = [problem for problem in problems if _place(problem).file == file]
        suite = ET.SubElement(root, "testsuite", {"name": _xml(file) or "trajcli"})
        if all(problem.severity != "error" for problem in of_file):
            ET.SubElement(suite, "testcase", _case(file, "verification"))
        for name, problem in _numbered(of_file):
            case = ET.SubElement(suite, "testcase", _case(file, name))
            _add_outcome(case, problem)
        _count(suite)
    _count(root)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _case(file: str, name: str) -> dict[str, str]:
    return {"classname": _xml(file) or "trajcli", "name": _xml(name), "time": "0"}


def _numbered(problems: Sequence[Problem]) -> Iterator[tuple[str, Problem]]:
    """Yield each annotation under its rule, with a number where there are several: names of cases differ."""
    count = Counter(str(problem.kind) for problem in problems)
    used: Counter[str] = Counter()
    for problem in problems:
        rule = str(problem.kind)
        used[rule] += 1
        yield rule if count[rule] == 1 else f"{rule} {used[rule]} of {count[rule]}", problem


def _add_outcome(case: Any, problem: Problem) -> None:  # noqa: ANN401
    """Add to a case that it failed, or what it says although it did not."""
    from xml.etree import ElementTree as ET

    place = _place(problem)
    where = f"{place.file}:{place.line}: " if place.line else ""
    text = _xml(where + problem.message)
    if problem.severity != "error":
        ET.SubElement(case, "system-out").text = f"{problem.severity}: {text}"
        return
    attributes = {"message": _xml(problem.message), "type": _xml(str(problem.kind))}
    ET.SubElement(case, "failure", attributes).text = text


def _count(element: Any) -> None:  # noqa: ANN401
    """Write into a suite how many cases it has, and how many of them failed."""
    element.set("tests", str(sum(1 for _ in element.iter("testcase"))))
    element.set("failures", str(sum(1 for _ in element.iter("failure"))))
    element.set("errors", "0")


def _xml(text: str) -> str:
    return _NO_XML.sub(_escaped, text)


def _sarif(problems: Sequence[Problem]) -> dict[str, Any]:
    """Return a log of the Static Analysis Results Interchange Format.

    Source: OASIS, "Static Analysis Results Interchange Format (SARIF) Version 2.1.0", 2020.
    """
    names = list(dict.fromkeys(str(problem.kind) for problem in problems))
    driver = {
        "name": "trajcli",
        "version": __version__,
        "rules": [_sarif_rule(name) for name in names],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_sarif_result(problem, names.index(str(problem.kind))) for problem in problems],
    }
    return {"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _sarif_rule(name: str) -> dict[str, Any]:
    text = {"text": f"A finding of the kind {name.replace('_', ' ')}."}
    return {"id": name, "shortDescription": text, "fullDescription": text, "help": text}


def _sarif_result(problem: Problem, index: int) -> dict[str, Any]:
    time = problem.time if problem.time is not None and math.isfinite(problem.time) else None
    given = {"joint": problem.joint, "time": time, "row": problem.row}
    result: dict[str, Any] = {
        "ruleId": str(problem.kind),
        "ruleIndex": index,
        "level": problem.severity,
        "message": {"text": _encodable(problem.message)},
    }
    properties = {key: value for key, value in given.items() if value is not None}
    if properties:
        result["properties"] = properties
    place = _place(problem)
    if place.file:
        physical: dict[str, Any] = {"artifactLocation": {"uri": _uri(place.file)}}
        region = {"startLine": place.line, "startColumn": place.column}
        if place.line:
            physical["region"] = {key: value for key, value in region.items() if value}
        result["locations"] = [{"physicalLocation": physical}]
    return result


def _uri(file: str) -> str:
    """Return a relative reference, or the URI of an absolute path."""
    from pathlib import Path
    from urllib.parse import quote

    if file in _STANDARD_INPUT:
        return "stdin"
    path = Path(file)
    if path.is_absolute():
        return path.as_uri()
    return quote(path.as_posix(), safe="/", errors="backslashreplace")
