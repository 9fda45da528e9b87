"""Numbers of messages against decimal arithmetic, and what an error keeps when it is located or said."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal
from typing import Literal

import numpy as np
import pytest

from trajcli.errors import (
    LONGEST_LINE,
    Amount,
    FileError,
    InputError,
    MissingLimitError,
    Place,
    PlanningError,
    Problem,
    TrajcliError,
    VerificationError,
    at_least,
    inward,
    said,
    utf8,
)

VALUES = [
    *(np.random.default_rng(7).uniform(-1, 1, 60) * 10.0 ** np.arange(-30, 30)).tolist(),
    *(
        1.23456789012,
        -1.23456789012,
        9.99999999951,
        -9.99999999951,
        99999.96,
        100000.4,
        10.0000001,
        -10.0000001,
    ),
]


def rounded(value: float, digits: int, to: str) -> Decimal:
    """Return a number with so many digits, upwards or downwards."""
    exact = Decimal(repr(value))
    return exact.quantize(Decimal(1).scaleb(exact.adjusted() + 1 - digits), to)


@pytest.mark.parametrize("digits", [4, 6, 9])
@pytest.mark.parametrize(("side", "to"), [("up", ROUND_CEILING), ("down", ROUND_FLOOR)])
def test_a_bound_is_rounded_to_its_side(side: Literal["up", "down"], to: str, digits: int) -> None:
    shown = [Decimal(str(Amount(value, rounded=side, digits=digits))) for value in VALUES]
    assert shown == [rounded(value, digits, to) for value in VALUES]


def test_a_lower_bound_has_six_digits_and_is_never_less() -> None:
    assert [Decimal(at_least(value)) for value in VALUES] == [
        rounded(value, 6, ROUND_CEILING) for value in VALUES
    ]
    assert (at_least(0.0), at_least(2.0), at_least(1e-9)) == ("0", "2", "1e-09")


@pytest.mark.parametrize("side", ["up", "down"])
def test_what_misses_a_round_number_by_rounding_alone_is_that_number(side: Literal["up", "down"]) -> None:
    for value, text in (
        (0.1 + 0.2, "0.3"),
        (1 - 2**-53, "1"),
        (100 * (1 + 2**-52), "100"),
        (-0.7 - 0.1, "-0.8"),
    ):
        assert str(Amount(value, rounded=side)) == text
    assert str(Amount(1 + 1e-12, rounded="up")) == "1.00000001"
    assert str(Amount(1 - 1e-12, rounded="down")) == "0.999999999"


def test_towards_zero_the_magnitude_does_not_become_more() -> None:
    for value in VALUES:
        shown = Decimal(str(Amount(value, rounded=inward(value))))
        assert abs(shown) <= abs(Decimal(repr(value)))
        assert abs(shown) > abs(Decimal(repr(value))) * Decimal("0.99999998")


@pytest.mark.parametrize(
    ("amount", "text"),
    [
        (Amount(2.0, dimension="length"), "2 m"),
        (Amount(2.0, 1, dimension="length"), "2 m/s"),
        (Amount(2.0, 2, dimension="angle"), "2 rad/s^2"),
        (Amount(2.0, 3, dimension="angle"), "2 rad/s^3"),
        (Amount(2.0, 1, joint=0), "2"),
        (Amount(2.0, unit="N m"), "2 N m"),
        (Amount((0.1, -0.0, 1 / 3), dimension="length"), "[0.1, 0, 0.333333333] m"),
    ],
)
def test_a_number_has_its_unit(amount: Amount, text: str) -> None:
    assert str(amount) == text


def test_a_bound_is_rounded_in_the_unit_that_is_shown() -> None:
    third = Amount(1 / 3, dimension="length", rounded="up")
    assert third.numbers(lambda value: 1000 * value) == "333.333334"
    assert Amount((0.1, 0.25)).numbers(lambda value: 1000 * value) == "[100, 250]"


@pytest.mark.parametrize("length", [LONGEST_LINE - 1, LONGEST_LINE, LONGEST_LINE + 1, 10**6])
def test_of_a_long_message_both_ends_are_told(length: int) -> None:
    text = "begin " + "x" * (length - 10) + " end"
    shown = said("{text}", {"text": text})
    assert len(shown) <= LONGEST_LINE
    assert (shown[:6], shown[-4:]) == ("begin ", " end")
    assert (shown == text) == (length <= LONGEST_LINE)


def test_names_of_files_are_one_line_of_plain_text() -> None:
    assert utf8("b\u00fcro/job 1.yaml") == "b\u00fcro/job 1.yaml"
    assert utf8("a\nb\x1b[0m\x9b") == r"a\nb\x1b[0m\x9b"
    assert utf8("a\u2028\u202eb\u2066") == r"a\u2028\u202eb\u2066"
    assert utf8("a\udcff") == r"a\udcff"


def test_only_what_is_empty_is_filled_in() -> None:
    own = Problem("one", place=Place("a.yaml", 1, 2), move=0, joint="")
    one, two = (
        InputError(own, "two", hint="do").located(place=Place("b.yaml", 3, 4), move=5, joint="j").problems
    )
    assert one == own
    assert (str(two.place), two.move, two.joint, two.hint) == ("b.yaml:3:4", 5, "j", "do")


def test_an_error_says_its_numbers_in_message_and_hint_and_each_problem_in_a_line() -> None:
    amounts = {"value": Amount(0.5, 1, 0)}
    error = TrajcliError(Problem("it is {value}", "make {value} less", amounts=amounts), Problem("and that"))
    assert str(error) == "it is 0.5\nand that"
    first, second = error.said_by(lambda amount: f"{2 * float(str(amount))} deg").problems
    assert (first.message, first.hint, first.amounts) == ("it is 1.0 deg", "make 1.0 deg less", {})
    assert (second.message, second.hint) == ("and that", None)


def test_exit_codes_are_those_of_the_manual() -> None:
    kinds = (VerificationError, InputError, MissingLimitError, PlanningError, FileError, TrajcliError)
    assert [kind.exit_code for kind in kinds] == [1, 2, 2, 3, 4, 70]
