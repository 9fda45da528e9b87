"""Units of recorded columns: what each says, what a user, a format or a job says, and which of them counts."""

from __future__ import annotations

import math

import pytest

from trajcli.errors import InputError
from trajcli.streams.recorded.column_roles import NamedFile, assign_roles
from trajcli.streams.recorded.column_units import (
    ColumnScales,
    SaidUnits,
    columns_said,
    is_own_language,
    no_unit,
    parse_units,
    scales_of,
)
from trajcli.units import Units

DEG, MM = math.pi / 180, 1e-3
TWO = ("revolute", "prismatic")


def scales(names: str, said: str | None = None, **of: object) -> ColumnScales:
    file = NamedFile("rows.csv", tuple(names.split(",")), lambda name: None)
    return scales_of(file, assign_roles(file), parse_units(said), **of)  # type: ignore[arg-type]


@pytest.mark.parametrize("quantity", ["q", "qd", "qdd", "qddd"])
def test_a_unit_in_a_name_is_per_second_as_often_as_the_quantity_says(quantity: str) -> None:
    """Without a joint's type either kind of unit may stand; the other columns stay open."""
    found = scales(f"t,q1,q2,{quantity}1_deg,{quantity}2_mm" if quantity != "q" else "t,q1_deg,q2_mm")
    assert found.factors[-2:] == pytest.approx([DEG, MM], rel=1e-15)
    assert found.open == ((1, 2) if quantity != "q" else ())
    rate = {"q": "", "qd": "/s", "qdd": "/s^2", "qddd": "/s^3"}[quantity]
    written = scales(
        f"t,q1,q2,{quantity}1 [deg{rate}],{quantity}2 [mm{rate}]" if rate else "t,q1 [deg],q2 [mm]"
    )
    assert written.factors[-2:] == pytest.approx([DEG, MM], rel=1e-15)


def test_turns_per_minute_are_velocities() -> None:
    found = scales("t,q1,qd1 [rpm]", "rad")
    assert found.factors.tolist() == pytest.approx([1.0, 1.0, 2 * math.pi / 60])
    with pytest.raises(InputError, match="'rpm' is no unit of an angle or length per second squared"):
        scales("t,q1,qdd1 [rpm]", "rad")


@pytest.mark.parametrize(
    ("said", "factors"),
    [
        ("deg,mm", [DEG, MM]),
        ("deg", [DEG, None]),
        ("mm", [None, MM]),
        ("rad,m", [1.0, 1.0]),
        (None, [None, None]),
    ],
)
def test_what_a_user_says_counts_for_joints_of_its_dimension(
    said: str | None, factors: list[float | None]
) -> None:
    """In every derivative; what nothing says is open, and stays as it is."""
    found = scales("t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2", said, joint_types=TWO)
    expected = [1.0 if factor is None else factor for factor in factors]
    assert found.factors == pytest.approx([1.0, *expected * 3, 1.0, 1.0], rel=1e-15)
    assert found.open == tuple(k for k in range(1, 7) if factors[1 - k % 2] is None)


def test_who_counts_before_whom() -> None:
    """A name before a user, a user before a format, a format before a job."""
    plain, job = Units(), Units("deg", "mm")
    assert scales("t,q1_deg", "rad", joint_types=["revolute"]).factors[1] == pytest.approx(DEG)
    assert scales("t,q1", "deg", plain=plain, declared=Units()).factors[1] == pytest.approx(DEG)
    assert scales("t,q1", plain=plain, declared=job).factors[1] == 1.0
    assert scales("t,q1", declared=job).factors[1] == pytest.approx(DEG)
    assert scales("t,q1", declared=job, joint_types=["prismatic"]).factors[1] == pytest.approx(MM)
    both = scales("t,q1,q2", "mm", plain=plain, joint_types=TWO)
    assert both.factors[1:] == pytest.approx([1.0, MM])
    assert both.open == ()


def test_it_is_said_which_units_columns_that_name_none_are_read_in() -> None:
    text, plain, job = "columns that name no unit are read in", Units(), Units("deg", "mm")
    assert scales("t,q1", "deg", plain=plain).notes == (f"{text} deg, as --units says",)
    assert scales("t,q1", "deg,mm", plain=plain).notes == (f"{text} deg and mm, as --units says",)
    assert scales("t,q1", declared=job).notes == (f"{text} deg and mm, as the job or the robot says",)
    otherwise = f"{text} rad and m: --units says otherwise where they are not"
    assert scales("t,q1", plain=plain, declared=job).notes == (otherwise,)
    for silent in (
        scales("t,q1", "deg"),
        scales("t,q1", plain=plain),
        scales("t,q1", plain=plain, declared=plain),
        scales("t,q1_deg,tau1", plain=plain, declared=job),
        scales("t,q1_deg", declared=job),
    ):
        assert silent.notes == ()


@pytest.mark.parametrize(
    ("name", "said", "per_second"),
    [
        ("t", None, 1.0),
        ("t_ms", None, 1e3),
        ("t_us", None, 1e6),
        ("t_ns", None, 1e9),
        ("t", "ms", 1e3),
        ("t", "us", 1e6),
        ("t_us", "ms", 1e6),
    ],
)
def test_stamps_are_in_what_their_name_says_before_what_a_user_says(
    name: str, said: str | None, per_second: float
) -> None:
    found = scales(f"{name},q1_deg", said)
    assert found.per_second == per_second
    assert found.factors[0] == 1 / per_second


def test_units_of_a_job_are_those_of_angles_and_lengths() -> None:
    assert parse_units(Units("deg", "mm")) == SaidUnits("deg", "mm", None)
    assert parse_units("us, deg ,m") == SaidUnits("deg", "m", "us")
    assert parse_units(None) == SaidUnits()


@pytest.mark.parametrize(
    ("names", "said", "message"),
    [
        ("t,q1_deg,tau1_deg", None, "'deg' is no unit of effort"),
        ("t,q1_mm", ("revolute",), "'mm' is no unit of an angle, and the joint is revolute"),
        ("t,q1_deg", ("prismatic",), "'deg' is no unit of a length, and the joint is prismatic"),
        ("t_deg,q1", None, "'deg' is no unit of time"),
    ],
)
def test_units_of_another_kind_are_refused(names: str, said: tuple[str, ...] | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scales(names, None, joint_types=said)


def test_efforts_may_say_their_unit() -> None:
    assert scales("t,q1_deg,tau1_Nm").factors.tolist() == pytest.approx([1.0, DEG, 1.0])


@pytest.mark.parametrize(
    ("names", "own"),
    [
        ("t,q1,qd1,qdd1", True),
        ("t,q1_deg,tau1,move,x,y,z", True),
        ("t,q1,tau12", True),
        ("t,q1,tau01", False),
        ("t,q,qd1", False),
        ("t,q1,position", False),
        ("time,q1", False),
        ("t,q1,x1", False),
    ],
)
def test_a_file_is_of_our_language_where_every_name_is(names: str, own: bool) -> None:
    assert is_own_language(names.split(",")) is own
    assert is_own_language(names.split(",")[::-1]) is own


def test_columns_of_our_own_that_name_no_unit_have_the_one_that_is_said() -> None:
    """By what each measures; what names a unit keeps it, and times and moves have none."""
    names = ["t", "q1", "q2", "qd2", "q3_mm", "x", "move"]
    said = SaidUnits("deg", "mm")
    found = columns_said(names, said, ("revolute", "prismatic", "prismatic"))
    assert [column.unit for column in found] == [None, "deg", "mm", "mm", "mm", "mm", None]
    assert [column.unit for column in columns_said(names, SaidUnits(length="m"), ("revolute",))][5] is None


def test_lengths_alone_may_be_said_and_stamps_of_rostopic_too() -> None:
    """Messages print nanoseconds; a user goes before that, as before the units of a language."""
    plain = Units()
    assert scales("t,q1", "mm", joint_types=("prismatic",), plain=plain).notes == (
        "columns that name no unit are read in mm, as --units says",
    )
    echo = "%time,field.position0,field.position1"
    assert scales(echo, "rad").per_second == 1e9
    assert scales(echo, "rad,ms").per_second == 1e3


@pytest.mark.parametrize(("largest", "guess"), [(12.0, "radians?"), (13.0, "degrees?"), (120.0, "degrees?")])
def test_two_turns_are_the_most_that_is_taken_for_radians(largest: float, guess: str) -> None:
    error = no_unit(NamedFile("rows.csv", ("t", "q1"), lambda name: None), ["q1"], largest)
    assert f"values up to {largest:.3g}: {guess} say it" in str(error.problems[0].hint)


@pytest.mark.parametrize("units", ["deg,rad", "m,mm", "ms,us", "deg,deg"])
def test_two_units_of_one_dimension_are_refused(units: str) -> None:
    first, second = units.split(",")
    with pytest.raises(InputError, match=f"--units: {first} and {second} are both units of"):
        parse_units(units)
