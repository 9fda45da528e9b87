"""Plain scalars mean what the core schema of YAML 1.2 says; the table is the specification's, section 10.3.2."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.job.yaml.load import ScalarError, resolve

VALUES = [
    ("", None),
    ("~", None),
    ("null", None),
    ("Null", None),
    ("NULL", None),
    ("nULL", "nULL"),
    ("true", True),
    ("True", True),
    ("TRUE", True),
    ("false", False),
    ("False", False),
    ("FALSE", False),
    ("tRue", "tRue"),
    *[(word, word) for word in ("yes", "no", "on", "off", "y", "n", "Yes", "NO", "On", "OFF")],
    *[(word, word) for word in ("none", "None", "nil", "undefined", "nothing", "-", "~~", "true ", "N/A")],
    ("0", 0),
    ("-0", 0),
    ("+12", 12),
    ("-19", -19),
    ("010", 10),
    ("0o7", 7),
    ("0o17", 15),
    ("0o8", "0o8"),
    ("0O7", "0O7"),
    ("-0o7", "-0o7"),
    ("0x1F", 31),
    ("0x3A", 58),
    ("0xG", "0xG"),
    ("-0x1", "-0x1"),
    ("0b1", "0b1"),
    ("1e3", 1000.0),
    ("1E3", 1000.0),
    ("12e03", 12000.0),
    ("-2E+05", -200000.0),
    ("0.", 0.0),
    ("-0.0", -0.0),
    (".5", 0.5),
    ("+.5e-1", 0.05),
    ("5.", 5.0),
    (".", "."),
    ("-", "-"),
    ("+", "+"),
    ("1e", "1e"),
    ("e3", "e3"),
    ("1.2.3", "1.2.3"),
    ("1 2", "1 2"),
    ("1:30", "1:30"),
    ("190:20:30.15", "190:20:30.15"),
    ("1_000", "1_000"),
    ("1,5", "1,5"),
    ("2024-01-31", "2024-01-31"),
    ("12 deg", "12 deg"),
    ("nan", "nan"),
    ("inf", "inf"),
    ("-inf", "-inf"),
    (".infinity", ".infinity"),
    ("١", "١"),
    ("=", "="),
    ("9007199254740993", 9007199254740993),
    ("1" + "0" * 308, 10**308),
    ("1.7976931348623157e308", 1.7976931348623157e308),
    ("5e-324", 5e-324),
]


@pytest.mark.parametrize(("text", "value"), VALUES)
def test_core_schema(text: str, value: object) -> None:
    result = resolve(text)
    assert result == value
    assert type(result) is type(value)
    assert str(result) == str(value)  # tells 0.0 from -0.0


@pytest.mark.parametrize("text", [".nan", ".NaN", ".NAN", ".inf", "-.inf", "+.Inf", ".INF"])
def test_numbers_that_are_not_finite_are_refused(text: str) -> None:
    with pytest.raises(ScalarError, match="expected a finite number") as caught:
        resolve(text)
    assert text in str(caught.value)
    assert (caught.value.hint is not None) == ("n" in text.lower() and text[-1] in "fF")


@pytest.mark.parametrize(
    "text", ["1e309", "-1e400", "1" + "0" * 309, "-" + "9" * 400, "9" * 6000, "0x" + "F" * 300]
)
def test_numbers_too_large_for_a_double_are_refused(text: str) -> None:
    with pytest.raises(ScalarError, match="too large") as caught:
        resolve(text)
    assert len(str(caught.value)) < 150


@pytest.mark.parametrize("text", ["1e-400", "-0.00003e-330"])
def test_numbers_that_would_vanish_are_refused(text: str) -> None:
    with pytest.raises(ScalarError, match="too small"):
        resolve(text)


@settings(deadline=None, max_examples=300)
@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**300), 10**300))
def test_every_number_of_json_is_read_bit_for_bit(number: float) -> None:
    text = json.dumps(number)
    result = resolve(text)
    assert result == number
    assert type(result) is type(number)
