"""Nearest names."""

from __future__ import annotations

import pytest

from trajcli.suggest import (
    abridged,
    did_you_mean,
    meant_word,
    named_like,
    nearest,
    nearest_names,
    valid_names,
)

PLANNERS = ["cubic", "quintic", "septic", "jerk_limited", "hold"]


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("quintc", "quintic"),
        ("Quintic", "quintic"),
        ("QUINTIC", "quintic"),
        ("JERK   LIMITED", "jerk_limited"),
        ("jerk-limited", "jerk_limited"),
        ("jerk limited", "jerk_limited"),
        ("jerklimited", "jerk_limited"),
        ("xyz", None),
        ("", None),
        ("quintic" * 10_000, None),
    ],
)
def test_nearest(name: str, near: str | None) -> None:
    assert nearest(name, PLANNERS) == near
    assert did_you_mean(name, PLANNERS) == (f"did you mean '{near}'?" if near else None)


def test_valid_names() -> None:
    assert valid_names(PLANNERS) == "valid names: cubic, quintic, septic, jerk_limited, hold"
    assert valid_names(["deg", "rad"], "angles") == "angles: deg, rad"
    assert valid_names([]) is None
    all_of_them = valid_names(f"p{i}" for i in range(24))
    assert all_of_them is not None
    assert all_of_them.endswith(", p22, p23")
    many = valid_names(f"p{i}" for i in range(40))
    assert many is not None
    assert many.endswith("p23 ... (16 more)")


def test_the_nearest_names_are_told_however_far_they_are() -> None:
    assert nearest_names("quintc", PLANNERS)[0] == "quintic"
    assert nearest_names("cube", PLANNERS, 1) == ["cubic"]
    assert len(nearest_names("xyz", PLANNERS)) == 3
    assert set(nearest_names("?" * 10_000, PLANNERS, 9)) == set(PLANNERS)


def test_of_a_long_text_the_end_counts_for_nothing() -> None:
    """Nobody mistypes more than some dozens of characters."""
    begun = "jerk_limited" + "-" * 52
    assert nearest_names(begun + "hold" * 10_000, PLANNERS) == nearest_names(begun, PLANNERS)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("UR5", "did you mean 'ur5' or 'ur5e'?"),
        ("ur1", "did you mean 'ur10e' or 'ur16e'?"),
        ("kr 16", "did you mean 'kr16_2'?"),
        ("KR-16", "did you mean 'kr16_2'?"),
        ("kr17_2", "did you mean 'kr16_2'?"),
        ("", None),
        ("zzz", None),
    ],
)
def test_names_that_begin_so_come_before_those_that_are_like_it(name: str, hint: str | None) -> None:
    assert named_like(name, ["ur5", "ur5e", "ur10e", "kr16_2", "ur16e"]) == hint


@pytest.mark.parametrize("length", [1, 99, 100, 101, 5000])
def test_a_quoted_text_is_whole_up_to_a_hundred_characters(length: int) -> None:
    text = ("0123456789" * 500)[:length]
    assert abridged(text) == (text if length <= 100 else text[:100] + "...")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a\nb", r"a\nb"),
        ("\x1b[31m", r"\x1b[31m"),
        ("\u202eab", r"\u202eab"),
        ("b\u00fcchse 'x'", "b\u00fcchse 'x'"),
    ],
)
def test_a_quoted_text_is_one_line_without_what_steers_a_terminal(text: str, line: str) -> None:
    assert abridged(text) == line


@pytest.mark.parametrize(
    ("mapping", "meant"),
    [
        ({"type": "prismatic"}, "prismatic"),
        ({"type": "Prismtic", "tipe": "revolute"}, "prismatic"),
        ({"tipe": "prismatic"}, "prismatic"),
        ({"tpe": "prismtc", "d": 3}, "prismatic"),
        ({"d": "prismatic"}, "revolute"),
        ({}, "revolute"),
        ({"type": "helix"}, None),
        ({"type": 3}, None),
    ],
)
def test_a_word_is_meant_though_it_or_its_key_is_mistyped(
    mapping: dict[str, object], meant: str | None
) -> None:
    assert meant_word(mapping, "type", ("type", "d"), ("revolute", "prismatic")) == meant
