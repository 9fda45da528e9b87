"""Annotations for continuous integration: findings as JUnit, SARIF 2.1.0 and commands of GitHub Actions.

An annotation knows no job, no plan and no file format: whoever judges makes them of what it found.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

from trajcli.errors import (
    FileError,
    InputError,
    PlanningError,
    Problem,
    TrajcliError,
    VerificationError,
    utf8,
)
from trajcli.frozen import comparable
from trajcli.version import __version__

AnnotationForm = Literal["github", "junit", "sarif"]
Severity = Literal["error", "warning", "note"]

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


@comparable
class Annotation:
    """Something that was found, and where.

    Attributes:
        rule: A stable word for programs, such as "velocity".
        severity: "error" makes a run fail.
        message: What was found, with the numbers.
        file: The file it is about, as its user names it; "-" is standard input; None where there is none.
        line: Of the file, from 1; None where it has no lines, or the whole file is meant.
        column: In the line, from 1.
        row: Of a table, from 1 without its header.
        joint: Name of the joint.
        time: Seconds.
    """

    rule: str
    severity: Severity
    message: str
    file: str | None = None
    line: int | None = None
    column: int | None = None
    row: int | None = None
    joint: str | None = None
    time: float | None = None

    @property
    def text(self) -> str:
        """The message, with the row where it does not name it itself."""
        named = self.row is None or re.search(rf"\brow {self.row}\b", self.message)
        return self.message if named else f"{self.message} (row {self.row})"


def annotations_of(error: TrajcliError, file: str | None = None) -> tuple[Annotation, ...]:
    """Return an annotation for each problem of an error.

    Args:
        error: Its problems without a kind of their own are of a rule that its class names.
        file: What a problem is about that has no place in a file.
    """
    rule = next((name for kind, name in _RULES if isinstance(error, kind)), "bug")
    return tuple(_annotation(problem, rule, file) for problem in error.problems)


def _annotation(problem: Problem, rule: str, file: str | None) -> Annotation:
    where, hint = problem.place, problem.advice()
    text = problem.text() + (f" ({hint})" if hint else "")
    found = Annotation(problem.kind or rule, "error", text, file, joint=problem.joint, time=problem.time)
    if where is None:
        return found
    return Annotation(**{**vars(found), "file": where.file, "line": where.line, "column": where.column})


def render_annotations(
    annotations: Sequence[Annotation],
    form: AnnotationForm,
    subjects: Sequence[str] = (),
    rules: Mapping[str, str] | None = None,
) -> str:
    """Return a text for a service of continuous integration; it ends in a line feed unless it is empty.

    Args:
        annotations: What was found.
        form: "github" gives one line for each; "junit" and "sarif" one document, whatever was found.
        subjects: The files that were judged: JUnit names those, too, with which nothing is wrong.
        rules: What was judged, with a sentence about each; what is annotated besides is added.
    """
    rules = rules or {}
    if form == "github":
        return "".join(f"{_github(annotation)}\n" for annotation in annotations)
    if form == "junit":
        return _junit(annotations, subjects, tuple(rules))
    return json.dumps(_sarif(annotations, rules), ensure_ascii=False, indent=2, allow_nan=False) + "\n"


def _github(annotation: Annotation) -> str:
    """Return a command that GitHub's runner reads from the output of a step."""
    kind = "notice" if annotation.severity == "note" else annotation.severity
    given = {"file": annotation.file, "line": annotation.line, "col": annotation.column}
    if annotation.file in _STANDARD_INPUT:
        given = {}
    given["title"] = f"trajcli: {annotation.rule}"
    pairs = (f"{key}={_github_property(str(value))}" for key, value in given.items() if value is not None)
    return f"::{kind} {','.join(pairs)}::{_github_data(annotation.text)}"


def _github_data(text: str) -> str:
    """Return a message with the escapes that the runner undoes."""
    text = utf8(text).replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return _NO_XML.sub(_escaped, text)


def _github_property(text: str) -> str:
    return _github_data(text).replace(":", "%3A").replace(",", "%2C")


def _escaped(match: re.Match[str]) -> str:
    """Return a character that a document cannot hold as its escape in Python."""
    return match[0].encode("unicode_escape", "backslashreplace").decode("ascii")


def _junit(annotations: Sequence[Annotation], subjects: Sequence[str], rules: Sequence[str]) -> str:
    """Return a JUnit document: a suite for each file, in it a case for each rule and each annotation."""
    from xml.etree import ElementTree as ET

    files = dict.fromkeys([*subjects, *(annotation.file or "" for annotation in annotations)])
    root = ET.Element("testsuites", {"name": "trajcli"})
    for file in files or {"": None}:
        of_file = [annotation for annotation in annotations if (annotation.file or "") == file]
        suite = ET.SubElement(root, "testsuite", {"name": _xml(file) or "trajcli"})
        broken = {annotation.rule for annotation in of_file}
        failed = any(annotation.severity == "error" for annotation in of_file)
        for rule in [rule for rule in rules if rule not in broken] or ["verification"][failed:]:
            ET.SubElement(suite, "testcase", _case(file, rule))
        for name, annotation in _numbered(of_file):
            case = ET.SubElement(suite, "testcase", _case(file, name))
            _add_outcome(case, annotation)
        _count(suite)
    _count(root)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _case(file: str, name: str) -> dict[str, str]:
    return {"classname": _xml(file) or "trajcli", "name": _xml(name), "time": "0"}


def _numbered(annotations: Sequence[Annotation]) -> Iterator[tuple[str, Annotation]]:
    """Yield each annotation under its rule, with a number where there are several: names of cases differ."""
    count = Counter(annotation.rule for annotation in annotations)
    used: Counter[str] = Counter()
    for annotation in annotations:
        rule = annotation.rule
        used[rule] += 1
        yield rule if count[rule] == 1 else f"{rule} {used[rule]} of {count[rule]}", annotation


def _add_outcome(case: Any, annotation: Annotation) -> None:  # noqa: ANN401
    """Add to a case that it failed, or what it says although it did not."""
    from xml.etree import ElementTree as ET

    where = "" if annotation.line is None else f"{annotation.file}:{annotation.line}: "
    text = _xml(where + annotation.text)
    if annotation.severity != "error":
        ET.SubElement(case, "system-out").text = f"{annotation.severity}: {text}"
        return
    attributes = {"message": _xml(annotation.text), "type": _xml(annotation.rule)}
    ET.SubElement(case, "failure", attributes).text = text


def _count(element: Any) -> None:  # noqa: ANN401
    """Write into a suite how many cases it has, and how many of them failed."""
    element.set("tests", str(sum(1 for _ in element.iter("testcase"))))
    element.set("failures", str(sum(1 for _ in element.iter("failure"))))
    element.set("errors", "0")


def _xml(text: str) -> str:
    return _NO_XML.sub(_escaped, text)


def _sarif(annotations: Sequence[Annotation], rules: Mapping[str, str]) -> dict[str, Any]:
    """Return a log of the Static Analysis Results Interchange Format.

    Source: OASIS, "Static Analysis Results Interchange Format (SARIF) Version 2.1.0", 2020.
    """
    names = list(dict.fromkeys([*rules, *(annotation.rule for annotation in annotations)]))
    driver = {
        "name": "trajcli",
        "version": __version__,
        "rules": [_sarif_rule(name, rules.get(name)) for name in names],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_sarif_result(annotation, names.index(annotation.rule)) for annotation in annotations],
    }
    return {"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _sarif_rule(name: str, sentence: str | None) -> dict[str, Any]:
    text = {"text": sentence or f"A finding of the kind {name.replace('_', ' ')}."}
    return {"id": name, "shortDescription": text, "fullDescription": text, "help": text}


def _sarif_result(annotation: Annotation, index: int) -> dict[str, Any]:
    time = annotation.time if annotation.time is not None and math.isfinite(annotation.time) else None
    known = {"joint": annotation.joint, "time": time, "row": annotation.row}
    result: dict[str, Any] = {
        "ruleId": annotation.rule,
        "ruleIndex": index,
        "level": annotation.severity,
        "message": {"text": utf8(annotation.text)},
    }
    properties = {key: value for key, value in known.items() if value is not None}
    if properties:
        result["properties"] = properties
    if annotation.file is not None:
        physical: dict[str, Any] = {"artifactLocation": {"uri": _uri(annotation.file)}}
        region = {"startLine": annotation.line, "startColumn": annotation.column}
        if annotation.line is not None:
            physical["region"] = {key: value for key, value in region.items() if value is not None}
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
