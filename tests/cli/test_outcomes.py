"""Exit codes and what is printed, whatever a command raises: for people, for programs, and where nobody reads."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable
from typing import Any

import pytest

from trajcli.cli.outcome import exit_code, print_json, print_lines, print_remark, print_text
from trajcli.errors import (
    LONGEST_LINE,
    FileError,
    InputError,
    PlanningError,
    Problem,
    TrajcliError,
    VerificationError,
)

Capture = pytest.CaptureFixture[str]


def raising(error: BaseException) -> Callable[[Any], int]:
    def run(options: Any) -> int:
        assert options == "words"
        raise error

    return run


TWO = (Problem("first é"), Problem("second"))


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (VerificationError(*TWO), 1),
        (InputError(*TWO), 2),
        (PlanningError(*TWO), 3),
        (FileError(*TWO), 4),
    ],
)
def test_an_error_has_its_code_and_all_of_its_problems_are_said(
    error: TrajcliError, code: int, capsys: Capture
) -> None:
    assert exit_code(raising(error), "words", "text") == code
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "error: first é\nerror: second\n")
    assert exit_code(raising(error), "words", "json") == code
    said = capsys.readouterr()
    assert said.out == ""
    assert "first é" in said.err  # as it is, not escaped
    found = json.loads(said.err)
    assert (found["error"], found["exit"]) == (type(error).__name__, code)
    assert [problem["message"] for problem in found["problems"]] == ["first é", "second"]
    assert exit_code(raising(error), "words", "github") == code
    assert capsys.readouterr().err.count("::error ") == 2
    assert exit_code(lambda _: 5, "words", "text") == 5


@pytest.mark.parametrize(
    ("error", "code"),
    [(KeyboardInterrupt(), 130), (BrokenPipeError(), 141), (OSError(28, "no space"), 4)],
)
def test_what_is_no_error_of_the_job_is_silent(error: BaseException, code: int, capsys: Capture) -> None:
    for form in ("text", "json", "github"):
        assert exit_code(raising(error), "words", form) == code  # type: ignore[arg-type]
        assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    "error", [RuntimeError("it broke"), OSError(2, "it broke", "a file"), OSError(13, "it broke", "b")]
)
def test_any_other_error_is_a_bug_and_says_where(error: Exception, capsys: Capture) -> None:
    assert exit_code(raising(error), "words", "text") == 70
    said = capsys.readouterr()
    assert said.out == ""
    assert "Traceback" in said.err
    assert "it broke" in said.err
    assert "Please report it" in said.err
    assert exit_code(raising(error), "words", "json") == 70
    found = json.loads(capsys.readouterr().err)
    assert (found["error"], found["exit"]) == (type(error).__name__, 70)
    assert "it broke" in found["problems"][0]["message"]
    assert exit_code(raising(error), "words", "github") == 70
    assert "it broke" in capsys.readouterr().err


def test_a_library_that_is_missing_is_no_bug(capsys: Capture) -> None:
    missing = ModuleNotFoundError("No module named 'ruckig'", name="ruckig")
    code = exit_code(raising(missing), "words", "text")
    err = capsys.readouterr().err
    assert code == InputError.exit_code or code == FileError.exit_code
    assert "ruckig" in err
    assert "Traceback" not in err


class Unwritable(io.StringIO):
    """A stream that cannot be written."""

    def __init__(self, error: OSError) -> None:
        super().__init__()
        self.error = error

    def write(self, _: str) -> int:
        raise self.error


@pytest.mark.parametrize(("error", "code"), [(BrokenPipeError(), 141), (OSError(28, "no space"), 4)])
def test_errors_that_cannot_be_written_end_the_command(
    error: OSError, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stderr", Unwritable(error))
    assert exit_code(raising(InputError("wrong")), "words", "text") == code


def test_lines_for_people_are_no_commands(capfd: Capture) -> None:
    print_lines(["a\x1b[2Jb", "ü\u202e", "x" * (LONGEST_LINE + 9), "plain"])
    lines = capfd.readouterr().out.split("\n")
    assert lines == ["a\\x1b[2Jb", "ü\\u202e", "x" * LONGEST_LINE + "...", "plain", ""]
    print_remark("a\nb")
    assert capfd.readouterr() == ("", "a\\nb\n")
    print_text("a\ud800é\n")
    assert capfd.readouterr().out == "a\\ud800é\n"


def test_json_has_a_line_for_each_row_of_a_matrix(capfd: Capture) -> None:
    value = {
        "matrix": [[1, 0.5], [0, 1]],
        "é": "ü",
        'a"b': {},
        "n": None,
        "mixed": [1, {"a": []}],
        "flat": [1, 2],
    }
    print_json(value)
    text = capfd.readouterr().out
    assert json.loads(text) == value
    assert text.startswith('{\n  "matrix": [\n    [1, 0.5],\n    [0, 1]\n  ],\n')
    assert '"ü"' in text
    assert '"flat": [1, 2]\n}\n' in text
    print_json([])
    assert capfd.readouterr().out == "[]\n"
    for wrong in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="JSON"):
            print_json({"a": wrong})
