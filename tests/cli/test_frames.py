"""Problems as code frames and as JSON."""

from __future__ import annotations

import json
import math
import re
import unicodedata

import numpy as np
import pytest
from any_text import CHARACTERS
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.cli.frames import WIDTH, problem_as_json, render_problem, shown
from trajcli.errors import LONGEST_LINE, Amount, Place, Problem

LINE = "  - {planner: quintc, to: b, duration: 3}"


def test_a_frame() -> None:
    problem = Problem(
        "unknown planner 'quintc'", "did you mean 'quintic'?", Place("job.yaml", 7, 15, LINE, 6)
    )
    assert render_problem(problem, color=False) == (
        "job.yaml:7:15: error: unknown planner 'quintc'\n"
        "   7 |   - {planner: quintc, to: b, duration: 3}\n"
        "     |               ^^^^^^ did you mean 'quintic'?"
    )


def test_colors_only_add_escapes() -> None:
    problem = Problem("m", "h", Place("f", 1, 3, "a: b"))
    colored = render_problem(problem, color=True)
    assert "\x1b[1;31m^\x1b[0m" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == render_problem(problem, color=False)


def test_without_place_or_source() -> None:
    assert render_problem(Problem("no such robot"), color=False) == "error: no such robot"
    assert (
        render_problem(Problem("no such robot", "name it"), color=False) == "error: no such robot\n  name it"
    )
    bare = render_problem(Problem("the file is empty", place=Place("f", 1, 1)), color=False)
    assert bare == "f:1:1: error: the file is empty"


def test_amounts_are_said() -> None:
    problem = Problem("takes {needed}", amounts={"needed": Amount(0.25)})
    assert render_problem(problem, color=False) == "error: takes 0.25"
    assert problem_as_json(problem)["message"] == "takes 0.25"


def test_a_long_hint_has_its_own_line() -> None:
    hint = "valid names: " + ", ".join(f"planner{i}" for i in range(9))
    rows = render_problem(Problem("m", hint, Place("f", 12345, 15, LINE, 6)), color=False).splitlines()
    assert rows[1:] == ["12345 | " + LINE, "      | " + " " * 14 + "^" * 6, "      = " + hint]


def columns(text: str) -> int:
    """Columns of a terminal, for the characters of these tests."""
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text
    )


@pytest.mark.parametrize(
    "before",
    [
        "a: ",
        "日本: ",
        "e\u0301u\u0308: ",
        "😀😀 ",
        "\t\t",
        "x\u200by: ",
        "\x1b[31m",
        "a\u202eb",
        "\ue000",
        "",
    ],
)
@pytest.mark.parametrize("token", ["WRONG", "日本", "e\u0301"])
def test_the_caret_stands_below_its_token(before: str, token: str) -> None:
    place = Place("f", 3, len(before) + 1, f"{before}{token} after", len(token))
    _, source, carets = render_problem(Problem("m", place=place), color=False).splitlines()
    assert columns(source[: source.rindex(token)]) == carets.index("^")
    assert carets.count("^") == columns(token)
    assert not re.search(r"[\x00-\x1f\u200b\u202e\ue000]", source)


@pytest.mark.parametrize("at", [0, 40, 90, 130, 5000, 9990])
def test_long_lines_are_cut_around_the_caret(at: int) -> None:
    line = "x" * at + "WRONG" + "y" * (10_000 - at)
    _, source, carets = render_problem(
        Problem("m", place=Place("f", 1, at + 1, line, 5)), color=False
    ).splitlines()
    assert source.index("WRONG") == carets.index("^")
    assert carets.endswith("^" * 5)
    assert len(source) <= WIDTH + len("   1 | ")
    assert ("..." in source[:12]) == (at > 92)
    assert source.endswith("...") == (at < 9000)


def test_a_token_longer_than_the_line_is_underlined_as_far_as_it_is_shown() -> None:
    place = Place("f", 1, 4, "a: " + "z" * 500, 500)
    _, source, carets = render_problem(Problem("m", place=place), color=False).splitlines()
    assert carets.count("^") == source.count("z") > 80


@pytest.mark.parametrize("width", [40, 60, 81])
@pytest.mark.parametrize("at", [0, 20, 57, 300])
@pytest.mark.parametrize(
    "hint", ["short", "a hint of many words that takes more than a line of a terminal has", "日" * 17]
)
def test_no_line_is_wider_than_the_terminal_and_no_word_is_lost(width: int, at: int, hint: str) -> None:
    line = "é: " + "日x" * at + "WRONG, " + "y" * 300
    place = Place("job.yaml", 123456, 4 + 2 * at, line, 5)
    message = "a message of so many words that it has to be folded on a terminal of eighty columns"
    text = render_problem(Problem(message, hint, place), color=False, width=width)
    rows = text.split("\n")
    assert all(columns(row) <= width or " " not in row.strip(" =|^") for row in rows)
    assert text.split(" | ")[0].replace("\n", " ").split() == [
        "job.yaml:123456:" + f"{4 + 2 * at}:",
        "error:",
        *message.split(),
        "123456",
    ]
    source = next(row for row in rows if row.startswith("123456 | "))
    carets = rows[rows.index(source) + 1]
    assert columns(source[: source.index("WRONG")]) == carets.index("^")
    assert "".join(hint.split()) in "".join(text.split())


@pytest.mark.parametrize("width", [20, 33, 80])
def test_messages_of_wide_letters_are_folded_by_columns(width: int) -> None:
    words = " ".join(["日本語", "a\u0301", "x" * 5] * 20)
    rows = render_problem(Problem(words, words), color=False, width=width).split("\n")
    assert " ".join(row.strip() for row in rows) == f"error: {words} {words}"
    assert width - 8 < max(map(columns, rows)) <= width


def test_a_hint_stands_beside_the_carets_where_it_fits() -> None:
    place = Place("f", 1, 1, "ab", 2)
    for hint, width, beside in (
        ("x" * 30, 40, True),
        ("x" * 31, 40, False),
        ("日" * 15, 40, True),
        ("日" * 16, 40, False),
    ):
        rows = render_problem(Problem("m", hint, place), color=False, width=width).split("\n")
        assert (rows[2] == f"     | ^^ {hint}") == beside
        assert len(rows) == (3 if beside else 4)


def test_what_is_shown_is_one_line_in_which_a_long_word_stays_whole() -> None:
    assert shown("a\tb\u2028c\u2029d") == "a    b\\u2028c\\u2029d"
    assert shown("x" * (LONGEST_LINE + 3)) == "x" * (LONGEST_LINE + 3)
    assert shown("x" * (LONGEST_LINE + 4)) == "x" * LONGEST_LINE + "..."
    word = "/a/path/that/is/longer/than/the/terminal/is/wide.yaml"
    assert word in render_problem(Problem(f"there is no file {word} at all"), color=False, width=30)
    place = Place("f", 1, 4, "\uff21\uff22 x", 1)  # wide letters
    assert render_problem(Problem("m", place=place), color=False).splitlines()[2] == "     |      ^"


def test_there_is_a_caret_behind_the_end_of_a_line() -> None:
    for column in (3, 4):
        rows = render_problem(Problem("m", place=Place("f", 1, column, "a:", 1)), color=False).splitlines()
        assert rows[2] == "     |   ^"


def test_numbers_of_json_are_finite_and_each_its_own() -> None:
    found = problem_as_json(Problem("m", time=0.0, value=1.5, limit=-2.5))
    assert (found["time"], found["value"], found["limit"]) == (0.0, 1.5, -2.5)
    found = problem_as_json(Problem("m", time=math.nan, value=-math.inf, limit=0.0))
    assert (found["time"], found["value"], found["limit"]) == (None, None, 0.0)


def test_control_characters_of_messages_are_shown_as_escapes() -> None:
    problem = Problem("got \x1b[2J\r\n\0\u202e", "not \x07", Place("a\x1bb", 1, 1, "a: 1"))
    text = render_problem(problem, color=False)
    assert "got \\x1b[2J\\r\\n\\x00\\u202e" in text
    assert "not \\x07" in text
    assert text.startswith("a\\x1bb:1:1: ")
    assert not re.search(r"[\x00-\x09\x0b-\x1f]", text)


@pytest.mark.full
@settings(deadline=None, max_examples=200)
@given(
    st.text(CHARACTERS, max_size=250),
    st.integers(1, 260),
    st.integers(1, 260),
    st.text(CHARACTERS, max_size=120),
)
def test_any_place_makes_a_frame(source: str, column: int, length: int, text: str) -> None:
    rows = render_problem(
        Problem(text, text or None, Place("f", 1, column, source, length)), color=False
    ).split("\n")
    assert 1 <= len(rows) <= 4
    for row in rows[1:3] if len(rows) > 2 else []:
        assert row[:7] in ("   1 | ", "     | ")
    if len(rows) > 2:
        assert columns(rows[1]) <= WIDTH + 7 + 2
        assert "^" in rows[2]


def test_json_holds_everything_and_only_what_json_knows() -> None:
    place = Place("job.yaml", 7, 15, LINE, 6)
    problem = Problem("m", "h", place, 2, "elbow", np.float64(0.5), float("inf"), math.nan)
    text = json.dumps(problem_as_json(problem), allow_nan=False)
    assert json.loads(text) == {
        "message": "m",
        "hint": "h",
        "file": "job.yaml",
        "line": 7,
        "column": 15,
        "length": 6,
        "move": 2,
        "joint": "elbow",
        "time": 0.5,
        "value": None,
        "limit": None,
    }
    assert set(problem_as_json(Problem("m")).values()) == {"m", None}
