"""Colours, widths and the table of the tightest moves, by a terminal and a plan that are made up."""

from __future__ import annotations

import io
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from trajcli.cli import terminal
from trajcli.cli.progress import is_terminal
from trajcli.cli.terminal import (
    columns,
    fitted_table,
    on_terminal,
    painted,
    shown_table,
    tightest_lines,
    with_verdict,
    wrapped,
)

GREEN, RED, YELLOW, BOLD, RESET = (f"\x1b[{code}m" for code in ("1;32", "1;31", "33", "1", "0"))


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return not super().isatty()


@pytest.fixture(autouse=True)
def _screen(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "60")


@pytest.mark.parametrize(
    ("line", "painted_line"),
    [
        ("a: verified, 1 s", f"a: {GREEN}verified{RESET}, 1 s"),
        ("a: not verified, 1 s", f"a: {RED}not verified{RESET}, 1 s"),
        ("a: satisfied", f"a: {GREEN}satisfied{RESET}"),
        ("a: within rounding", f"a: {GREEN}within rounding{RESET}"),
        ("a: exceeded by a verified one", f"a: {RED}exceeded{RESET} by a verified one"),
        ("a: verified; b: failed", f"a: {GREEN}verified{RESET}; b: {RED}failed{RESET}"),
        ("not-verified.csv: satisfied", f"not-verified.csv: {GREEN}satisfied{RESET}"),
        ("a: unverified", "a: unverified"),
    ],
)
def test_a_verdict_is_red_where_something_is_wrong_and_a_name_is_none(line: str, painted_line: str) -> None:
    assert with_verdict(line, Terminal()) == painted_line
    assert with_verdict(line, io.StringIO()) == line


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", ""), ("FORCE_COLOR", "")])
def test_a_variable_that_is_empty_says_nothing_of_colours(
    name: str, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, value)
    assert painted("x", "1", Terminal()) == f"{BOLD}x{RESET}"
    assert painted("x", "1", io.StringIO()) == painted("x", "1", None) == "x"
    assert painted("", "1", Terminal()) == ""


def test_a_dumb_terminal_and_a_closed_one_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = Terminal()
    closed.close()
    assert [is_terminal(stream) for stream in (Terminal(), io.StringIO(), closed, None)] == [True] + 3 * [
        False
    ]
    monkeypatch.setenv("TERM", "dumb")
    assert not is_terminal(Terminal())


@pytest.mark.parametrize(("said", "taken"), [("60", 60), ("40", 40), ("39", 40), ("3", 40), ("200", 200)])
def test_a_terminal_has_forty_columns_at_least(
    said: str, taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", said)
    assert columns() == taken


def test_lines_are_broken_where_they_are_wider_than_the_terminal_as_it_shows_them() -> None:
    fits, wide = "  " + "word " * 11 + "end", "  " + "word " * 12 + "end"
    assert wrapped(fits, Terminal()) == fits
    coloured = fits.replace("word", f"{RED}word{RESET}", 1)
    assert wrapped(coloured, Terminal()) == coloured  # colours take no columns
    lines = wrapped(wide, Terminal()).splitlines()
    assert len(lines) == 2
    assert max(map(len, lines)) <= 60
    assert [len(line) - len(line.lstrip()) for line in lines] == [2, 4]
    assert " ".join(" ".join(lines).split()) == " ".join(wide.split())
    assert wrapped(wide, io.StringIO()) == wide


def test_columns_are_shortened_in_their_order_and_no_more_than_is_needed() -> None:
    rows = [["n", "title", "what"], ["1", "a" * 40, "b" * 30]]
    (head, line) = fitted_table(rows, (1, 2))
    assert line == f"1  {'a' * (60 - 3 - 2 - 30 - 3)}...  {'b' * 30}"
    assert len(line) == 60
    (_, line) = fitted_table(rows, (2, 1))
    assert line == f"1  {'a' * (60 - 3 - 2 - 16)}  {'b' * 13}...".replace("a" * 39, f"{'a' * 36}...")
    (_, line) = fitted_table([["n", "title"], ["1", "a" * 57]], (1,))
    assert line == f"1  {'a' * 57}"
    assert head.split() == ["n", "title", "what"]
    (_, line) = fitted_table([["n"], ["a\x1b[2K"]], ())
    assert line == "a\\x1b[2K"


TABLE = [["name", "first", "second", "last"], ["a" * 20, "b" * 12, "c" * 12, "d" * 12], ["e", "f", "g", "h"]]


def table(dropped: list[str], stream: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr(sys, "stdout", stream)
    return list(shown_table(TABLE, (0,), dropped))


def test_columns_are_left_out_on_a_terminal_until_the_others_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(table(["first"], io.StringIO(), monkeypatch)[1].split()) == 4
    lines = table(["none", "second", "first"], Terminal(), monkeypatch)
    assert [line.split() for line in lines] == [
        ["name", "first", "last"],
        ["a" * 20, "b" * 12, "d" * 12],
        ["e", "f", "h"],
    ]
    monkeypatch.setenv("COLUMNS", "40")
    lines = table(["none", "second", "first"], Terminal(), monkeypatch)
    assert [line.split() for line in lines] == [["name", "last"], ["a" * 20, "d" * 12], ["e", "h"]]


def span(index: int, *, handles: bool = False, label: str = "", ends: str = "") -> SimpleNamespace:
    title = f"{label or ends} (planner)"
    return SimpleNamespace(
        index=index,
        handles=handles,
        title=title,
        label=label,
        ends=ends,
        planner="planner",
        duration=1.25,
        end=99.0,
    )


def tight(each: SimpleNamespace, used: float, name: str | None) -> SimpleNamespace:
    share = f"{100 * used:.4g} %"
    return SimpleNamespace(span=each, name=name or f"velocity of j{each.index}", share=share, used=used)


def lines_of(
    monkeypatch: pytest.MonkeyPatch,
    spans: list[SimpleNamespace],
    uses: dict[int, float],
    name: str | None = None,
) -> list[str]:
    found = [tight(each, uses[each.index], name) for each in spans if each.index in uses]
    monkeypatch.setattr("trajcli.planning.binding_limits.tightest_of_moves", lambda plan: found)
    plan: Any = SimpleNamespace(trajectory=SimpleNamespace(spans=spans))
    return list(tightest_lines(plan, Terminal()))


def test_the_moves_that_use_most_are_listed_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve moves, and what attaches in between: those that use least are left out, of equal ones the last."""
    spans = [span(k, handles=k == 3, label=f"m{k}") for k in range(13)]
    uses = {k: 0.5 for k in range(13) if k not in (2, 3)} | {5: 0.4, 12: 0.9994, 11: 0.9996}
    head, *lines, last = lines_of(monkeypatch, spans, uses)
    assert head.startswith(BOLD)
    numbers = [int(line.removeprefix(YELLOW).split()[0]) for line in lines]
    assert numbers == [0, 1, 4, 6, 7, 8, 9, 10, 11, 12]
    assert [line.startswith(YELLOW) for line in lines] == [False] * 8 + [True, False]
    assert lines[0].split() == ["0", "m0", "(planner)", "1.25", "velocity", "of", "j0", "50", "%"]
    assert last == "and 2 more moves that use less of their limits"
    *_, last = lines_of(monkeypatch, spans[:12], uses)
    assert last == "and 1 more move that uses less of their limits"
    few = lines_of(monkeypatch, spans[:11], uses)
    assert len(few) == 11
    assert few[3].split() == ["2", "m2", "(planner)", "1.25", "-", "-"]


def test_of_moves_that_use_the_same_the_first_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    spans = [span(k, label=f"m{k}") for k in range(12)]
    _, *lines, _ = lines_of(monkeypatch, spans, dict.fromkeys(range(12), 0.5))
    assert [int(line.split()[0]) for line in lines] == list(range(10))


@pytest.mark.parametrize(("width", "cut"), [("72", 1), ("60", 2)])
def test_titles_are_shortened_before_what_binds(
    width: str, cut: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    spans = [span(0, label="a label that is rather long and says a lot")]
    _, line = lines_of(monkeypatch, spans, {0: 0.5}, "velocity of a_joint_of_the_arm")
    assert (len(line), line.count("...")) == (int(width), cut)
    assert ("velocity of a_joint_of_the_arm" in line) == (cut == 1)


def test_where_it_is_too_wide_a_move_is_called_by_what_says_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "56")
    spans = [
        span(0, label="a label that is rather long", ends="a -> b"),
        span(1, ends="c -> d"),
        span(2),
    ]
    _, first, second, third = lines_of(monkeypatch, spans, {0: 0.5, 1: 0.5, 2: 0.5})
    assert first.split()[1:3] == ["a", "label"]
    assert second.split()[1:4] == ["c", "->", "d"]
    assert third.split()[1] == "planner"
    assert [line.split()[-2:] for line in (first, second, third)] == [["50", "%"]] * 3
    assert max(map(len, (first, second, third))) == 56


def test_a_text_for_standard_output_ends_each_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal.sys, "stdout", Terminal())
    assert on_terminal(["a", "b " * 40]) == f"a\n{'b ' * 29}b\n  {'b ' * 9}b\n"
