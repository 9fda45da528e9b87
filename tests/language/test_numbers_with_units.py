"""Numbers of files: their units, and the bounds of what a robot can need, on both sides of each."""

from __future__ import annotations

import math
import pickle
import unicodedata
from typing import Annotated

import pytest
from jsonschema import Draft202012Validator
from pydantic import TypeAdapter

from trajcli.errors import InputError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.language.numbers import (
    LONGEST_NAME,
    FlawError,
    Number,
    PointName,
    ReadingContext,
    flaw_of_name,
    number_schema,
    object_schema,
    read_number,
    shown,
)
from trajcli.language.per_joint import NamedValues
from trajcli.units import Quantity, Units

DEG = math.pi / 180
MM = Units("deg", "mm")
BOUNDED = [  # quantity, largest in SI, least above zero in SI
    (Quantity("angle"), 1e12, 1e-15),
    (Quantity("length"), 1e12, 1e-15),
    (Quantity("angle", 1), 1e30, 1e-12),
    (Quantity("length", 2), 1e30, 1e-12),
    (Quantity("length", 3), 1e30, 1e-12),
    (Quantity("time"), 1e12, 1e-12),
    (Quantity("frequency"), 1e12, 1e-12),
    (Quantity("ratio"), 1e12, 1e-12),
    (Quantity("mass"), 1e12, 1e-12),
]
PER_UNIT = {"angle": DEG, "length": 1e-3}


@pytest.mark.parametrize(("quantity", "most", "least"), BOUNDED)
@pytest.mark.parametrize("units", [Units(), MM], ids=["si", "deg, mm"])
def test_numbers_are_bounded_on_both_sides_in_any_unit(
    quantity: Quantity, most: float, least: float, units: Units
) -> None:
    unit = 1.0 if units == Units() else PER_UNIT.get(quantity.dimension, 1.0)
    for sign in (1, -1):
        inside, outside = (sign * most / unit * factor for factor in (1 - 1e-9, 1 + 1e-9))
        assert read_number(inside, quantity, units) == pytest.approx(sign * most, rel=1e-8)
        with pytest.raises(FlawError, match="expected a magnitude of at most") as caught:
            read_number(outside, quantity, units)
        said = str(caught.value).split("at most ")[1].split(" ")[0].rstrip(",")
        assert float(said) == pytest.approx(most / unit, rel=1e-5)
    positive, context = Number(quantity, "", above=0.0), ReadingContext(units)
    assert positive.read(least / unit * (1 + 1e-9), context) == pytest.approx(least, rel=1e-8)
    assert Number(quantity, "", above=0.0).read(least, ReadingContext()) == least
    with pytest.raises(FlawError, match="expected at least") as caught:
        positive.read(least / unit * (1 - 1e-9), context)
    assert float(str(caught.value).split("at least ")[1].split(" ")[0].rstrip(",")) == pytest.approx(
        least / unit, rel=1e-5
    )
    schema = number_schema(quantity)
    schema = schema.get("anyOf", [schema])[0]
    assert schema["minimum"] == -schema["maximum"]
    assert schema["maximum"] >= most / unit
    above = number_schema(quantity, exclusiveMinimum=0.0)
    assert above.get("anyOf", [above])[0]["minimum"] == least


@pytest.mark.parametrize(
    ("text", "quantity", "si"),
    [
        ("-90 deg", Quantity("angle"), -math.pi / 2),
        ("1 rev/min", Quantity("angle", 1), 2 * math.pi / 60),
        ("-3 mm/ms^2", Quantity("length", 2), -3000.0),
        ("2 cm/min^3", Quantity("length", 3), 0.02 / 216000),
        ("250 g", Quantity("mass"), 0.25),
        ("2 kHz", Quantity("frequency"), 2000.0),
        ("3 kN", Quantity("force"), 3000.0),
        ("1.5 min", Quantity("time"), 90.0),
    ],
)
def test_a_text_says_its_unit_whatever_that_of_the_file(text: str, quantity: Quantity, si: float) -> None:
    for units in (Units(), MM):
        assert read_number(text, quantity, units) == pytest.approx(si, rel=1e-15)
    with pytest.raises(FlawError, match="expected a magnitude of at most"):
        read_number(text.replace(text.split(" ", maxsplit=1)[0], "9e40"), quantity, MM)


RULES = [  # the rule of a number, what it takes, what it refuses
    ({"above": 0.0}, [1e-3, 7.0], [0.0, -1e-9]),
    ({"at_least": 0.0}, [0.0, 1e-13, 7.0], [-1e-300]),
    ({"above": 0.0, "at_most": 1.0}, [1e-3, 1.0], [0.0, 1.0 + 1e-15, -0.5]),
    ({}, [-1.0, 0.0, 1e-300], []),
]


@pytest.mark.parametrize(("rule", "taken", "refused"), RULES)
def test_rules_of_numbers_hold_at_their_ends(
    rule: dict[str, float], taken: list[float], refused: list[float]
) -> None:
    number = Number(Quantity("ratio"), "", **rule)
    assert [number.read(value, ReadingContext()) for value in taken] == taken
    for value in [*refused, True, None, "1", math.nan, math.inf]:
        with pytest.raises(FlawError):
            number.read(value, ReadingContext())


def test_names_are_texts_of_one_line_that_show() -> None:
    assert flaw_of_name("") == "expected a text that is not empty"
    assert flaw_of_name("ä" * LONGEST_NAME) is None
    assert f"has {LONGEST_NAME + 1}" in (flaw_of_name("a" * (LONGEST_NAME + 1)) or "")
    for letter in ("\n", "\x1b", "\u200e", "\u2028", "\u2029", "\ud800"):
        assert "no control characters" in (flaw_of_name(f"a{letter}b") or ""), unicodedata.category(letter)
    for letter in (" ", "\u00a0", "\U0001f600", "\u0301"):
        assert flaw_of_name(f"a{letter}b") is None


def test_a_letter_that_no_name_holds_is_said_by_its_number() -> None:
    assert "got U+200E in" in (flaw_of_name("a\u200eb\n") or "")
    assert "got U+000A in" in (flaw_of_name("ab\n") or "")


SHOWN = [  # a value, how messages quote it
    ("up", '"up"'),
    ("x" * 300, f'"{"x" * 100}..."'),
    (True, "true"),
    (False, "false"),
    (None, "null"),
    (0.1234567890123, "0.1234567890123"),
    (0.1 + 0.2, "0.3"),
    (12345678901234567890, "12345678901234567890"),
    ({"a": 1}, "a mapping"),
    ([1], "a list"),
    ((1,), "a list"),
]


@pytest.mark.parametrize(("value", "text"), SHOWN)
def test_messages_quote_values_as_they_stand_in_a_file(value: object, text: str) -> None:
    assert shown(value) == text


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, "x", None])
def test_what_is_no_number_is_refused_with_the_unit_of_one(value: object) -> None:
    expected = "expected a finite number (deg), got" if isinstance(value, float) else "expected a"
    with pytest.raises(FlawError) as caught:
        read_number(value, Quantity("angle"), MM)
    assert str(caught.value).startswith(expected)
    with pytest.raises(FlawError, match=r"expected a( finite)? number, got"):
        read_number(value if isinstance(value, float) else True, Quantity("ratio"), MM)


@pytest.mark.parametrize("value", [1e20, "1e20 deg", 1e-20])
def test_what_no_robot_has_is_told_to_be_looked_at_again(value: float | str) -> None:
    with pytest.raises(FlawError) as caught:
        Number(Quantity("angle", 1) if value == 1e-20 else Quantity("angle"), "", above=0.0).read(
            value, ReadingContext(MM)
        )
    assert caught.value.flaws[0][2] == "no robot has such a number: check its exponent and its unit"


def test_schemas_of_numbers_round_bounds_up_to_three_digits_and_keep_stated_ones() -> None:
    assert number_schema(Quantity("length"))["anyOf"][0]["maximum"] == pytest.approx(1e15, rel=1e-12)
    assert number_schema(Quantity("angle"))["anyOf"][0]["maximum"] == pytest.approx(5.73e13, rel=1e-12)
    share = Number(Quantity("ratio"), "", above=0.0, at_most=1.0).json_schema()
    told = [Draft202012Validator(share).is_valid(each) for each in (0.5, 1, 0, 1.5, "1")]
    assert told == [True, True, False, False, False]
    length = Draft202012Validator(Number(Quantity("length"), "", at_least=-1.0, at_most=2.0).json_schema())
    told = [length.is_valid(each) for each in (-1, 2, "-3 mm", "+3 mm", ".5 mm", -1.5, 2.5, "far", True)]
    assert told == [True] * 5 + [False] * 4


def test_the_schema_of_a_field_says_what_it_is_and_which_names_there_are() -> None:
    field = TypeAdapter(Annotated[float, Number(Quantity("time"), "How long.")])
    assert field.json_schema()["description"] == "How long."
    name = Draft202012Validator(PointName("").json_schema())
    for taken in ("p1", "1a", "e5", "heres", "a" * LONGEST_NAME):
        assert name.is_valid(taken), taken
    for refused in ("", "here", "tool", "stop", "1", "-2.5e-3", "a" * (LONGEST_NAME + 1), 3, None):
        assert not name.is_valid(refused), refused


def job(line: str) -> LoadedJob:
    text = f"version: 1\nrobot: {{joints: 2}}\nstart: {{joints: 0}}\n{line}\n"
    return job_from_text(f"{text}moves: [{{planner: hold, duration: 1}}]\n")


@pytest.mark.parametrize(
    "name", ["here", "world", "base", "tool", "stop", "1", "-2.5", "+.5e-3", "7.", "1E9"]
)
def test_words_and_numbers_are_no_names_of_points(name: str) -> None:
    for section, value in (("points", "{joints: 0}"), ("frames", "{}"), ("tools", "{}")):
        with pytest.raises(InputError, match="is no name of a point, a frame or a tool"):
            job(f'{section}: {{"{name}": {value}}}')


@pytest.mark.parametrize("name", ["heres", "Here", "1a", "p1", "1 2", "e5", "-", ".", "ä", "0x1", "1_0"])
def test_other_words_are(name: str) -> None:
    assert list(job(f'points: {{"{name}": {{joints: 0}}}}').job.points) == [name]


EMPTY = [
    "name:",
    "limits:",
    "tool:",
    "base:",
    "zone:",
    "output: {times: }",
    "limits: {tcp: {speed: }}",
    "points: {a: {joints: 0, in: }}",
]


@pytest.mark.parametrize("line", EMPTY)
def test_what_may_be_left_out_may_not_be_left_empty(line: str) -> None:
    with pytest.raises(InputError, match="got null"):
        job(line)


def test_named_values_survive_a_process() -> None:
    """A batch sends its jobs to others."""
    values = NamedValues((1.0, 0.0, 3.0), (True, False, True))
    again = pickle.loads(pickle.dumps(values))
    assert (again, again.named, again.by_index) == (values, values.named, {0: 1.0, 2: 3.0})


def test_a_mapping_has_the_keys_that_it_needs_and_no_others() -> None:
    schema = object_schema({"a": {"type": "integer"}, "b": {}}, "a", description="Both.")
    valid = Draft202012Validator(schema).is_valid
    given = ({"a": 1}, {"a": 1, "b": None}, {"b": 1}, {"a": 1, "c": 1}, {"a": "1"}, [1])
    assert [valid(each) for each in given] == [True, True, False, False, False, False]
    assert schema["description"] == "Both."
