"""What a command line sets: every option by each of its names, its choices, and what holds where it is left out.

Oracle: a table of lines and of what each of them asks for.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from running import call
from yaml_files import read_yaml

from trajcli.cli import command

Capture = pytest.CaptureFixture[str]
FORMATS = ("csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal")
LINES = read_yaml(Path(__file__).parent / "command_lines.yaml")


@pytest.fixture
def understood(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """The fields of each command that would have run."""
    found: list[dict[str, Any]] = []
    monkeypatch.setattr(command, "_run", lambda one: found.append(dict(vars(one))) or 0)
    return found


@pytest.mark.parametrize(("line", "fields"), LINES, ids=[line for line, _ in LINES])
def test_a_line_sets_its_fields_and_no_others(
    line: str, fields: dict[str, Any], understood: list[dict[str, Any]], capfd: Capture
) -> None:
    assert call(capfd, *shlex.split(line)).code == 0
    (found,) = understood
    assert found.keys() >= fields.keys()
    assert {name: value for name, value in found.items() if value or name in fields} == {
        "errors": "text",
        **fields,
    }


EDITS = ("retime F", "resample F --rate 5", "concat F", "reverse F", "slice F", "convert F")
CHOICES: dict[str, tuple[str, ...]] = {
    **{f"{edit} --format": FORMATS for edit in (*EDITS, "plan J", "batch J")},
    "plan J --rows": ("rate", "knots", "both"),
    "plan J --digits": ("fixed", "full"),
    "plan J --compression": ("zstd", "lz4", "none"),
    "plan J --errors": ("text", "json", "github", "junit", "sarif"),
    "batch J --errors": ("text", "json", "github", "junit", "sarif"),
    "explain J --errors": ("text", "json"),
    "check F --interpolate": ("hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling"),
    "check F --format": ("table", "json", "junit", "sarif", "github"),
    "batch J --engine": ("processes", "dask"),
    "sweep J --vary a=1 --engine": ("process", "dask"),
    "plot J --format": ("svg", "png", "pdf"),
    "schema": ("job", "robot", "report", "explanation"),
    "fk -r R Q --digits": ("fixed", "full"),
}


@pytest.mark.parametrize(("line", "choices"), CHOICES.items(), ids=list(CHOICES))
def test_choices_are_those_that_are_documented(
    line: str, choices: tuple[str, ...], understood: list[dict[str, Any]], capfd: Capture
) -> None:
    for choice in choices:
        assert call(capfd, *line.split(), choice).code == 0
        assert choice in understood[-1].values()
    assert call(capfd, *line.split(), f"{choices[0]}x").code == 2


@pytest.mark.parametrize(
    "line", ["plan", "check", "batch", "sweep J", "resample F", "concat", "diff", "plot", "view", "retime"]
)
def test_what_must_be_given_is_asked_for(line: str, understood: list[dict[str, Any]], capfd: Capture) -> None:
    assert call(capfd, *line.split()).code == 2
    assert understood == []


@pytest.mark.parametrize(("value", "code"), [("0", 0), ("-0.1", 2), ("1.5", 0)])
def test_meshes_have_a_length(
    value: str, code: int, understood: list[dict[str, Any]], capfd: Capture
) -> None:
    assert call(capfd, "view", "J", f"--meshes={value}").code == code
    assert [fields["meshes"] for fields in understood] == [float(value)] * (code == 0)


@pytest.mark.parametrize(
    ("name", "option", "words"),
    [
        ("plan", "--rows", "[default: rate; of ROS messages knots]"),
        ("plan", "--format", "[default: csv]"),
        ("plan", "--digits", "fixed: nine decimals; full: every bit"),
        ("check", "--topic", "[default: /joint_states]"),
        ("explain", "JOB", "- is standard input"),
        ("fk", "--tool", "POSE T_flange_tcp"),
        ("fk", "--base", "POSE T_world_base"),
        ("fk", "--si", "in rad and m"),
        ("fk", "--digits", "fixed: nine decimals; full: every bit"),
    ],
)
def test_help_says_what_holds(name: str, option: str, words: str, capfd: Capture) -> None:
    text = " ".join(call(capfd, name, "--help").out.partition("Arguments:")[2].split())
    beginning = re.search(rf"(?:^|(?:-\w, )| ){option} ", text)
    assert beginning is not None
    assert words in text[beginning.start() :][:300]
