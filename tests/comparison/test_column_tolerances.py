from __future__ import annotations

import pytest
from tables import motion

from trajcli.comparison.difference import ALL, compare, parse_tolerances
from trajcli.errors import InputError


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1e-9", {ALL: 1e-9}),
        ("q=1e-9,qd=1e-6", {"q": 1e-9, "qd": 1e-6}),
        (" q1_deg = 0.5 , 0", {"q1_deg": 0.5, ALL: 0.0}),
        ("*=2", {ALL: 2.0}),
        ("a=b=1", {"a=b": 1.0}),
    ],
)
def test_tolerances_are_read(text, expected):
    assert parse_tolerances(text) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "does not end in a number"),
        ("q", "'q' does not end in a number"),
        ("q=", "does not end in a number"),
        ("q=1,", "does not end in a number"),
        ("q=-1", "'q=-1' is -1"),
        ("q=nan", "is nan"),
        ("inf", "is inf"),
        ("=1", "names no column"),
        ("q=1,q=2", "'q=2' comes after another one"),
        ("1,2", "'2' comes after another one"),
    ],
)
def test_wrong_tolerances_are_refused(text, words):
    with pytest.raises(InputError) as caught:
        parse_tolerances(text)
    assert words in str(caught.value)


def test_a_tolerance_for_nothing_is_refused():
    with pytest.raises(InputError, match="'qe' fits no column") as caught:
        compare(motion(), motion(), {"qe": 1.0}, {})
    assert caught.value.problems[0].hint.startswith("did you mean 'q")
    with pytest.raises(InputError, match="'move' fits no column"):
        compare(motion(), motion(), {}, {"move": 1.0})
