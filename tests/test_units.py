"""Units against published conversion factors and hand calculations."""

from __future__ import annotations

import math

import pytest
from any_text import CHARACTERS
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.errors import Amount, InputError
from trajcli.units import (
    Quantity,
    UnitError,
    Units,
    amount_text,
    effort_quantity,
    effort_unit,
    factor,
    joint_quantity,
    joint_units,
    named_units,
    parse_quantity,
    to_user,
    typeset,
    unit_name,
    units_of,
)

ANGLE, VELOCITY, ACCELERATION, JERK = (Quantity("angle", order) for order in range(4))
LENGTH, SPEED, LENGTH2, LENGTH3 = (Quantity("length", order) for order in range(4))
TIME, FREQUENCY, RATIO = Quantity("time"), Quantity("frequency"), Quantity("ratio")
DEG_MM = Units("deg", "mm")

PARSED = [
    ("120 deg/s", VELOCITY, 2.0943951023931953),
    ("180deg", ANGLE, math.pi),
    ("-90 °", ANGLE, -math.pi / 2),
    ("1.5 rad", ANGLE, 1.5),
    ("2 mrad", ANGLE, 0.002),
    ("0.5 rev", ANGLE, math.pi),
    ("30 rev/min", VELOCITY, math.pi),
    ("30 rpm", VELOCITY, math.pi),
    ("90 deg/s^2", ACCELERATION, math.pi / 2),
    ("90 deg/s²", ACCELERATION, math.pi / 2),
    ("1 rad/ms^2", ACCELERATION, 1e6),
    ("1e3 rad/s^3", JERK, 1000.0),
    ("1 rad/s³", JERK, 1.0),
    ("0.3m", LENGTH, 0.3),
    ("250 mm", LENGTH, 0.25),
    ("25 cm", LENGTH, 0.25),
    ("50 um", LENGTH, 5e-5),
    (" +.25 mm/s ", SPEED, 0.00025),
    ("6 m/min", SPEED, 0.1),
    ("250 mm/s^2", LENGTH2, 0.25),
    ("2000 mm / s^3", LENGTH3, 2.0),
    ("0.5 s", TIME, 0.5),
    ("500 ms", TIME, 0.5),
    ("250 us", TIME, 0.00025),
    ("2 min", TIME, 120.0),
    ("500 Hz", FREQUENCY, 500.0),
    ("1 kHz", FREQUENCY, 1000.0),
    ("3.2 kg", Quantity("mass"), 3.2),
    ("250 g", Quantity("mass"), 0.25),
    ("400 N", Quantity("force"), 400.0),
    ("0.4 kN", Quantity("force"), 400.0),
    ("28 N m", Quantity("torque"), 28.0),
    ("28 Nm", Quantity("torque"), 28.0),
    ("1.5 kN m", Quantity("torque"), 1500.0),
    ("1.5 kNm", Quantity("torque"), 1500.0),
    ("0.02 kg m^2", Quantity("inertia"), 0.02),
    ("0.02 kg m²", Quantity("inertia"), 0.02),
]


@pytest.mark.parametrize(("text", "quantity", "value"), PARSED)
def test_strings_with_units(text: str, quantity: Quantity, value: float) -> None:
    assert parse_quantity(text, quantity) == pytest.approx(value, rel=4e-16)


REFUSED = [
    ("120 mm/s", VELOCITY, 'expected an angle per second such as "120 deg/s", got "120 mm/s"'),
    ("120 deg", VELOCITY, 'expected an angle per second such as "120 deg/s", got "120 deg"'),
    ("120 deg/s", ANGLE, 'expected an angle such as "120 deg", got "120 deg/s"'),
    ("1 deg/s^2", JERK, 'expected an angle per second cubed such as "120 deg/s^3", got "1 deg/s^2"'),
    ("1 rad", LENGTH2, 'expected a length per second squared such as "250 mm/s^2", got "1 rad"'),
    ("1 deg", TIME, 'expected a time such as "0.5 s", got "1 deg"'),
    ("1 s", FREQUENCY, 'expected a frequency such as "500 Hz", got "1 s"'),
    ("3", TIME, 'expected a time such as "0.5 s", got "3": write 3 without quotes, or give it a unit'),
    ("0.5", RATIO, 'expected a number without a unit such as 0.5, got "0.5": write 0.5 without quotes'),
    ("50 %", RATIO, 'expected a number without a unit such as 0.5, got "50 %"'),
    ("fast", VELOCITY, 'expected an angle per second such as "120 deg/s", got "fast"'),
    ("", TIME, 'expected a time such as "0.5 s", got ""'),
    ("5 degrees", ANGLE, "(units: rad, mrad, deg, °, rev)"),
    ("5 sec", TIME, "(units: s, ms, us, min)"),
    ("5 deg/h", VELOCITY, "(units: rad, mrad, deg, °, rev, per s, ms, us, min)"),
    ("1 deg/s/s", ACCELERATION, "(units: "),
    ("nan deg", ANGLE, "expected an angle"),
    ("1_0 deg", ANGLE, "expected an angle"),
    ("١ deg", ANGLE, "expected an angle"),
    ("1e400 m", LENGTH, '"1e400 m" is too large'),
    ("9e307 rev", ANGLE, "is too large"),
    (
        "1,5 deg",
        ANGLE,
        'expected an angle such as "120 deg", got "1,5 deg": write 1.5, decimals have a point',
    ),
    ("28 N", Quantity("torque"), 'expected a torque such as "28 N m", got "28 N"'),
]


@pytest.mark.parametrize(("text", "quantity", "message"), REFUSED)
def test_refused_strings(text: str, quantity: Quantity, message: str) -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity(text, quantity)
    said = str(caught.value)
    assert said.endswith(message) if message.endswith(")") else message in said
    assert isinstance(caught.value, ValueError)
    if message.startswith("expected") and "units:" not in message and " such as " in message:
        assert said == message


def test_long_strings_are_cut_in_messages() -> None:
    with pytest.raises(UnitError) as caught:
        parse_quantity("x" * 100_000, TIME)
    assert len(str(caught.value)) < 120


def test_names() -> None:
    names = [unit_name(Quantity("angle", order), DEG_MM) for order in range(4)]
    assert names == ["deg", "deg/s", "deg/s^2", "deg/s^3"]
    assert [unit_name(Quantity("length", order), Units()) for order in range(4)] == [
        "m",
        "m/s",
        "m/s^2",
        "m/s^3",
    ]
    assert [unit_name(quantity, DEG_MM) for quantity in (TIME, FREQUENCY, RATIO)] == ["s", "Hz", ""]


def test_factors() -> None:
    for quantity in (ANGLE, JERK, LENGTH, LENGTH3, TIME, FREQUENCY, RATIO):
        assert factor(quantity, Units()) == 1.0
    assert factor(VELOCITY, DEG_MM) == math.pi / 180
    assert factor(LENGTH2, DEG_MM) == 0.001
    assert [factor(quantity, DEG_MM) for quantity in (TIME, FREQUENCY, RATIO)] == [1.0, 1.0, 1.0]


@pytest.mark.parametrize("quantity", [ANGLE, JERK, LENGTH, SPEED, TIME])
def test_the_name_of_a_unit_can_be_read(quantity: Quantity) -> None:
    for units in (Units(), DEG_MM):
        assert parse_quantity(f"7 {unit_name(quantity, units)}", quantity) == 7.0 * factor(quantity, units)


@settings(deadline=None, max_examples=200)
@given(
    st.floats(-1e6, 1e6).filter(lambda x: x == 0 or abs(x) > 1e-300),
    st.sampled_from([ANGLE, ACCELERATION, LENGTH, TIME]),
)
def test_round_trips(value: float, quantity: Quantity) -> None:
    for units in (Units(), DEG_MM):
        back = to_user(value * factor(quantity, units), quantity, units)
        assert abs(back - value) <= math.ulp(value)


@settings(deadline=None, max_examples=200)
@given(st.floats(-1e6, 1e6))
def test_degrees_as_the_standard_library_converts_them(value: float) -> None:
    assert abs(value * factor(ANGLE, DEG_MM) - math.radians(value)) <= math.ulp(math.radians(value))


@settings(deadline=None, max_examples=300)
@given(
    st.text(CHARACTERS, max_size=20)
    | st.from_regex(
        r"[-+.0-9e]{1,5} ?(deg|mm|s|rpm|Hz)(/s|/min)?(\^2|³)?", fullmatch=True, alphabet=CHARACTERS
    )
)
def test_any_string_is_a_finite_number_or_refused(text: str) -> None:
    for quantity in (VELOCITY, LENGTH, TIME, FREQUENCY, RATIO):
        try:
            value = parse_quantity(text, quantity)
        except UnitError:
            continue
        assert math.isfinite(value)


def test_quantities_and_units_that_do_not_exist() -> None:
    for dimension, order in (("time", 1), ("ratio", 1), ("frequency", -1), ("angle", 4)):
        with pytest.raises(ValueError, match="no time derivative"):
            Quantity(dimension, order)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no such units"):
        Units("grad")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no such units"):
        Units("rad", "cm")  # type: ignore[arg-type]


def test_what_joints_measure() -> None:
    """A slide has lengths and forces, all others have angles and torques."""
    for order in range(4):
        assert joint_quantity("revolute", order) == Quantity("angle", order)
        assert joint_quantity("prismatic", order) == Quantity("length", order)
    assert joint_units(["revolute", "prismatic"]) == ["rad", "m"]
    assert joint_units(["prismatic", "revolute"], 3) == ["m/s^3", "rad/s^3"]
    assert [effort_quantity(kind).dimension for kind in ("revolute", "prismatic")] == ["torque", "force"]
    assert [effort_unit(kind) for kind in ("revolute", "prismatic")] == ["N m", "N"]
    assert [typeset(unit) for unit in ("deg", "deg/s^2", "mm/s^3")] == ["deg", "deg/s²", "mm/s³"]


@pytest.mark.parametrize(
    ("amount", "text"),
    [
        (Amount(math.pi / 2, 1, 0), "90 deg/s"),
        (Amount(0.25, 2, 1), "250 mm/s^2"),
        (Amount(0.25, 3, dimension="length"), "250 mm/s^3"),
        (Amount(math.pi, dimension="angle"), "180 deg"),
        (Amount(0.5), "0.5 s"),
        (Amount((0.1, -0.2), dimension="length"), "[100, -200] mm"),
        (Amount(28.0, joint=0, unit="N m"), "28 N m"),
        (Amount(math.inf, 1, 0), "unlimited"),
        (Amount(-math.inf, 0, 1), "unlimited"),
    ],
)
def test_amounts_of_messages_are_said_in_the_units_of_the_user(amount: Amount, text: str) -> None:
    assert amount_text(amount, ["revolute", "prismatic"], DEG_MM) == text


@pytest.mark.parametrize(
    ("value", "units"),
    [
        ({}, Units()),
        (None, Units()),
        ("deg", Units()),
        ({"angle": "deg"}, Units("deg")),
        ({"length": "mm"}, Units(length="mm")),
        ({"angle": "degrees", "length": "mm"}, Units(length="mm")),
        ({"angle": "deg", "length": 3, "time": "ms"}, Units("deg")),
    ],
)
def test_units_are_those_that_are_right(value: object, units: Units) -> None:
    assert units_of(value) == units


def test_a_text_names_one_unit_of_each_dimension() -> None:
    assert named_units("mm") == {"length": "mm"}
    assert named_units(" m, rad") == {"length": "m", "angle": "rad"}
    assert named_units("us,deg", ("us", "ms")) == {"time": "us", "angle": "deg"}


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("degs", "--units: unknown unit 'degs'", "did you mean 'deg'?"),
        ("deg,", "--units: unknown unit ''", "units are rad, deg, m, mm, ms"),
        ("us", "--units: unknown unit 'us'", "units are rad, deg, m, mm, ms"),
        ("m,deg,mm", "--units: m and mm are both units of length", None),
    ],
)
def test_units_that_are_none_or_too_many_are_refused(text: str, message: str, hint: str | None) -> None:
    with pytest.raises(InputError) as caught:
        named_units(text, ("ms",))
    (problem,) = caught.value.problems
    assert (problem.message, problem.hint) == (message, hint)
