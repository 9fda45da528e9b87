"""Bounds that refusals of a law name: given back as they are printed, they pass."""

from __future__ import annotations

import re
from itertools import product

import numpy as np
import pytest
from tiers import few
from tool_jobs import DOWN, line, plan, refusal

from trajcli.errors import Amount

START = {"xyz": [0.4, 0.1, 0.3], "rpy": DOWN}
FREE = {"velocity": None, "acceleration": None, "jerk": None}
NUMBER = r"([-+.e\d]+) "


def said(law, *, to):
    error = refusal("ur5e", START, line({"xyz": to}, law=law), limits=FREE)
    return error.problems[0].text(), error.problems[0].advice()


def target(length):
    return [0.4, 0.1 + length, 0.3]


@pytest.mark.parametrize(
    ("length", "duration"), few(list(product([0.1, 0.05, 0.1234567, 1 / 30, 0.2 / 7], [2.0, 0.75, 1.1])), 4)
)
def test_the_least_acceleration_of_a_trapezoid_is_a_triangle_that_passes(length, duration):
    """The area of the triangle is the length: a = 4 L / T^2; there is no cruise that rounding makes."""
    law = {"shape": "trapezoid", "duration": duration}
    text, advice = said({**law, "acceleration": length / duration**2}, to=target(length))
    printed = float(re.search(r"at least " + NUMBER, text + " ").group(1))
    assert 0 <= printed / (4 * length / duration**2) - 1 + 1e-13 < 1e-8
    assert "`law`" in advice
    for acceleration in (printed, 4 * length / duration**2):
        move = line({"xyz": target(length)}, law={**law, "acceleration": acceleration})
        made = plan("ur5e", START, move, limits=FREE)
        tool = made.moves[0].planned.tool
        assert np.diff(tool.law.breaks).min() > 0.9e-5 * duration
        jerks = made.trajectory.curve.evaluate(np.linspace(0, duration, 999), 3)
        assert np.abs(jerks).max() < 1e3


@pytest.mark.parametrize("rounding", few([-3, -2, -1, 0, 1, 2, 3], 4))
def test_rounding_of_the_length_makes_no_cruise(rounding):
    """The issue's example, 100 mm in 2 s with 100 mm/s^2, its start off by rounding."""
    start = {"xyz": [0.4, 0.1 + rounding * 2e-15, 0.3], "rpy": DOWN}
    law = {"shape": "trapezoid", "duration": 2.0, "acceleration": 0.1}
    made = plan("ur5e", start, line({"xyz": target(0.1)}, law=law), limits=FREE)
    np.testing.assert_allclose(made.moves[0].planned.tool.law.breaks, [0, 1, 2], atol=1e-12)


@pytest.mark.parametrize(
    ("length", "duration"), few(list(product([0.1, 1 / 30, 0.2 / 7], [0.75, 1.1, 2 / 3])), 5)
)
def test_the_speeds_that_a_trapezoid_may_have_pass(length, duration):
    law = {"shape": "trapezoid", "duration": duration}
    text, _ = said({**law, "speed": 0.9 * length / duration}, to=target(length))
    low, high = (float(word) for word in re.search(f"above {NUMBER}.*at most {NUMBER}", text + " ").groups())
    assert low >= length / duration * (1 - 1e-13)
    assert high <= 2 * length / duration * (1 + 1e-13)
    plan("ur5e", START, line({"xyz": target(length)}, law={**law, "speed": high}), limits=FREE)


@pytest.mark.parametrize(
    ("shape", "length"), few(list(product(["cubic", "quintic", "cycloidal"], [0.1, 1 / 30, 0.2 / 7])), 5)
)
def test_the_duration_that_a_polynomial_needs_passes(shape, length):
    law = {"shape": shape, "speed": 0.03}
    text, advice = said({**law, "duration": 0.1}, to=target(length))
    least = re.search(r"that takes " + NUMBER, text + " ").group(1)
    assert least in advice
    assert "`law`" in advice
    plan("ur5e", START, line({"xyz": target(length)}, law={**law, "duration": float(least)}), limits=FREE)


@pytest.mark.parametrize(
    "value", [np.sqrt(2), 2 / 3, 1e-7 / 3, 123456.7891234, 0.1, -np.sqrt(2), 9.9999999999]
)
def test_bounds_are_shown_on_the_side_that_keeps_them(value):
    up, down = (float(Amount(value, rounded=side).numbers()) for side in ("up", "down"))
    assert down <= value <= up
    assert up - down <= 1.1e-8 * abs(value)
    assert Amount(0.1 + 1e-17, rounded="up").numbers() == "0.1"
