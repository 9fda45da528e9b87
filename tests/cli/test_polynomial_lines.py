"""Lines about polynomials: each, read back as a formula, has the values of the polynomial that it prints."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import Any

import pytest
from numpy.polynomial import Polynomial

from trajcli.cli.polynomials import (
    amount,
    blend_lines,
    knot_lines,
    law_lines,
    polynomial_lines,
    polynomial_text,
)


def row(start: float, end: float, *absolute: float, unit: str = "deg", **more: Any) -> SimpleNamespace:
    """Return the report of a polynomial by its coefficients in powers of t."""
    local = Polynomial(absolute)(Polynomial([start, 1.0])).coef.tolist()
    local += [0.0] * (len(absolute) - len(local))
    given = {"velocity": None, "unshifted": None, **more}
    return SimpleNamespace(start=start, end=end, absolute=list(absolute), local=local, unit=unit, **given)


def move(*joints: list[SimpleNamespace], **more: Any) -> SimpleNamespace:
    given = {
        "closed_form": None,
        "closed_form_derivatives": None,
        "path": None,
        "origin": 0.0,
        "breaks": [0.0, 1.0],
    }
    polynomials = {f"j{number}": rows for number, rows in enumerate(joints, 1)}
    return SimpleNamespace(**{**given, "polynomials": polynomials, "joints": list(polynomials), **more})


def value(formula: str, **times: float) -> float:
    """Return what a printed formula is at a time."""
    text = re.sub(r"(?<=[\di)]) (?=[tup(])", " * ", formula.replace("^", "**"))
    return float(eval(text, {"pi": math.pi}, times))


@pytest.mark.parametrize(
    ("coefficients", "text"),
    [
        ([20, 0, 90, -60], "20 + 90 t^2 - 60 t^3"),
        ([0, 1, -1], "t - t^2"),
        ([0, -1], "-t"),
        ([-1], "-1"),
        ([1, 2], "1 + 2 t"),
        ([0, 0], "0"),
        ([], "0"),
        ([1e-12, 12345678901.5], "1e-12 + 1.23456789e+10 t"),
    ],
)
def test_a_polynomial_is_printed_as_in_a_book(coefficients: list[float], text: str) -> None:
    assert polynomial_text(coefficients) == text
    for time in (0.5, 2.0):
        assert value(text, t=time) == pytest.approx(Polynomial(coefficients or [0])(time), rel=1e-9)


def test_multiples_of_pi_stand_in_brackets_where_they_are_fractions() -> None:
    coefficients = [-math.pi / 2, math.pi, -3 * math.pi / 2, 0.7]
    text = polynomial_text(coefficients, "u", ["-pi/2", "pi", "-3 pi/2", None])
    assert text == "-pi/2 + pi u - (3 pi/2) u^2 + 0.7 u^3"
    assert value(text, u=1.3) == pytest.approx(Polynomial(coefficients)(1.3))
    (line,) = polynomial_lines(move([row(0, 1, *coefficients, unit="rad")]))
    exact, decimal = line.removeprefix("  q1(t) = ").split(" = ")
    for formula in (exact, decimal):
        assert value(formula, t=1.3) == pytest.approx(Polynomial(coefficients)(1.3), rel=1e-9)
    (line,) = polynomial_lines(move([row(0, 1, math.pi, unit="deg")]))
    assert line == "  q1(t) = 3.141592654"


@pytest.mark.parametrize(
    ("number", "unit", "beside", "text"),
    [
        (math.pi / 2, "rad", True, "pi/2 = 1.57079633"),
        (-math.pi, "rad/s", False, "-pi"),
        (math.pi / 2, "deg", True, "1.57079633"),
        (1.5, "rad", True, "1.5"),
        (1.5, "m", False, "1.5"),
    ],
)
def test_an_amount_in_rad_may_be_a_multiple_of_pi(number: float, unit: str, beside: bool, text: str) -> None:
    assert amount(number, unit, beside=beside) == text
    assert amount(2 / 3, "m", 4) == "0.6667"


def test_pieces_have_their_times_and_joints_their_numbers() -> None:
    pieces = [row(0, 0.5, 1, 2, 3), row(0.5, 2, 4, 5, 6)]
    lines = list(polynomial_lines(move(pieces, [row(0, 2, 7)])))
    assert lines == [
        "  0 <= t <= 0.5: q1(t) = 1 + 2 t + 3 t^2",
        "  0.5 <= t <= 2: q1(t) = 4 + 5 t + 6 t^2",
        "  q2(t) = 7",
    ]
    assert list(polynomial_lines(move([row(0, 1, 5, 1), row(1, 2, 5, 1)]))) == ["  q1(t) = 5 + t"]
    assert list(law_lines([row(0, 1, 0, 2)])) == ["  s(t) = 2 t"]
    assert list(law_lines([row(0, 1, 0, 2)] * 41)) == ["  s(t): 41 pieces, listed by --json"]
    assert len(list(law_lines([row(0, 1, 0, k) for k in range(40)]))) == 40


def test_derivatives_are_those_of_the_polynomial() -> None:
    given = Polynomial([1, -2, 3, 0.5])
    lines = list(polynomial_lines(move([row(0, 1, *given.coef, velocity=[])])))
    for order, (dots, line) in enumerate(zip(("", "d", "dd"), lines, strict=True)):
        head, formula = line.strip().split(" = ")
        assert head == f"q{dots}1(t)"
        assert value(formula, t=0.3) == pytest.approx(given.deriv(order)(0.3) if order else given(0.3))


@pytest.mark.parametrize("start", [1e3, 2e5])
def test_a_late_piece_is_printed_from_its_start_where_powers_of_t_would_lose_digits(start: float) -> None:
    given = Polynomial([5.0, 0.3, -0.2, 0.1])(Polynomial([-start, 1.0]))
    late = row(start, start + 1, *given.coef, velocity=[])
    late.local = [5.0, 0.3, -0.2, 0.1]
    lines = list(polynomial_lines(move([late])))
    assert lines[0] == f"  q1(t) = 5 + 0.3 (t - {start:g}) - 0.2 (t - {start:g})^2 + 0.1 (t - {start:g})^3"
    assert lines[1] == f"  qd1(t) = 0.3 - 0.4 (t - {start:g}) + 0.3 (t - {start:g})^2"
    short = row(0.0, 1e-3, 0, 0, 0, 1e9)
    assert list(polynomial_lines(move([short]))) == ["  q1(t) = 1000000000 t^3"]
    near = row(3.0, 4.0, *Polynomial([5.0, 0.3])(Polynomial([-3.0, 1.0])).coef)
    assert list(polynomial_lines(move([near]))) == ["  q1(t) = 4.1 + 0.3 t"]


def test_shifted_moves_have_the_times_of_the_job_too() -> None:
    own = Polynomial([1.0, 2.0])
    there = own(Polynomial([0.25, 1.0])).coef.tolist()
    lines = list(polynomial_lines(move([row(0.25, 1, *own.coef, unshifted=there)], origin=0.25)))
    assert lines == [
        "  q1(t) = 1 + 2 t",
        "  in unshifted time u = t - 0.25:",
        "    0 <= u <= 0.75: q1(u) = 1.5 + 2 u",
    ]


def test_what_a_difference_of_times_leaves_of_zero_is_zero() -> None:
    shifted = move([row(0.3, 1, 1.0, unshifted=[1.0])], origin=0.1 + 0.2)
    assert list(polynomial_lines(shifted))[2].startswith("    0 <= u <= 0.7: ")


def test_what_nobody_reads_is_counted() -> None:
    many = [row(k, k + 1, k) for k in range(61)]
    told = polynomial_lines(move(many[:60], many[:60]))
    assert len(list(told)) == 120
    (line,) = polynomial_lines(move(many, many))
    assert line == "  q1(t) .. q2(t): 61 pieces each of degree 0, listed by --json"
    (line,) = polynomial_lines(move(many, many[:60]))
    assert line == "  q1(t) .. q2(t): 121 pieces of degree 0, listed by --json"
    (line,) = polynomial_lines(move([row(0, 1, 1)], [row(0, 1, *range(11))]))
    assert line == "  q1(t) .. q2(t): 1 pieces each of degree 10, listed by --json"
    (line,) = polynomial_lines(move([row(0, 1, *range(11))]))
    assert line == "  q1(t): 1 pieces of degree 10, listed by --json"
    assert len(list(polynomial_lines(move([row(0, 1, *range(1, 11))])))) == 1
    (line,) = polynomial_lines(move([row(0, 1, 1, 2, 3)], path=object(), breaks=[0, 1, 2, 3]))
    assert line == "  joints: 3 pieces of degree 2, listed by --json"


def test_closed_forms_stand_in_place_of_polynomials() -> None:
    forms = {"j1": "sin t", "j2": "cos t"}
    lines = list(
        polynomial_lines(
            move([], [], closed_form=forms, closed_form_derivatives={"j2": ["-sin t", "-cos t"]})
        )
    )
    assert lines == ["  q1(t) = sin t", "  q2(t) = cos t", "  qd2(t) = -sin t", "  qdd2(t) = -cos t"]


def knot(time: float, values: list[list[float]], virtual: bool) -> SimpleNamespace:
    position, velocity, acceleration = values
    return SimpleNamespace(
        time=time,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        virtual=virtual,
        units=["rad", "m"],
    )


def test_knots_of_joints_that_move_with_the_accelerations_inside() -> None:
    knots = [
        knot(0, [[0, 5], [0, 0], [1, 0]], False),
        knot(0.5, [[1, 5], [2, 0], [3, 0]], True),
        knot(0.1 + 0.2, [[4, 5], [5, 0], [math.pi, 0]], True),
        knot(2, [[7, 5], [8, 0], [9, 0]], False),
    ]
    lines = list(knot_lines(move([], [], knots=knots)))
    assert lines == [
        "  virtual points at t = 0.5 and 0.3 s",
        "  knots of q1, and ddP1, the accelerations at the inner ones:",
        "    t = 0: q = 0, qd = 0, qdd = 1",
        "    t = 0.5, virtual: q = 1, qd = 2, qdd = 3",
        "    t = 0.3, virtual: q = 4, qd = 5, qdd = pi = 3.14159265",
        "    t = 2: q = 7, qd = 8, qdd = 9",
        "    ddP1 = [3, pi]",
    ]
    assert list(knot_lines(move([], knots=None))) == []
    assert list(knot_lines(move([], [], knots=knots[:1] * 61)))[1:] == ["  61 knots, listed by --json"]
    assert len(list(knot_lines(move([], [], knots=knots[:1] * 60)))) > 60


def test_blends_of_each_joint_in_the_times_of_the_job() -> None:
    blends = [
        SimpleNamespace(
            joint=joint, time=time, start=time - 0.1, end=time + 0.3, coefficients=[1, 2, -3], unit="m"
        )
        for joint, time in (("j2", 0.2), ("j1", 0.7), ("j2", 0.9))
    ]
    lines = list(blend_lines(move([], [], blends=blends, origin=0.25)))
    numbers = "b0 = 1, b1 = 2, b2 = -3"
    assert lines == [
        "  blends of q1 = b0 + b1 (u - t_k) + b2 (u - t_k)^2:",
        f"    t_k = 0.7, from 0.6 to 1: {numbers}",
        "  blends of q2 = b0 + b1 (u - t_k) + b2 (u - t_k)^2:",
        f"    t_k = 0.2, from 0.1 to 0.5: {numbers}",
        f"    t_k = 0.9, from 0.8 to 1.2: {numbers}",
    ]
    assert "(t - t_k)" in next(blend_lines(move([], [], blends=blends)))
    assert list(blend_lines(move([], blends=None))) == []
    assert list(blend_lines(move([], blends=blends * 41))) == ["  123 blends, listed by --json"]
    assert len(list(blend_lines(move([], [], blends=blends * 40)))) == 122
