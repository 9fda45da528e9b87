"""What rounding may make of one piece between two rows, against scipy's Hermite curves through rows that are off."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BPoly, CubicSpline

from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.rounding import PieceRows, stated_errors

Array = NDArray[np.float64]
U = np.linspace(0.0, 1.0, 41)
OFF = 1e-6
LENGTH = 0.1
NAMES = ("q", "qd", "qdd")


def rows_off(count: int, source: str, draw: int) -> tuple[Array, PieceRows]:
    """Return what both rows state of one joint, shape (count, 2), and the piece, of which one source is off."""
    ends = np.random.default_rng(draw).normal(size=(count, 2)) * 0.1 ** np.arange(count - 1, -1, -1)[:, None]
    if draw >= 8:  # one term of the bound dominates: the last column alone says that the joint moves
        ends[:-1] = 0.0
    errors = tuple(np.array([OFF if name == source else 0.0]) for name in NAMES[:count])
    late = np.array([OFF if source == "late" else 0.0])
    stated = tuple(values[:, None] for values in ends)
    return ends, PieceRows(np.array([LENGTH]), late, stated, errors)


def curve(ends: Array, length: float, order: int) -> Array:
    """Return a derivative of the Hermite curve through both ends at the same shares of its length."""
    joined = BPoly.from_derivatives([0.0, length], ends.T.tolist())
    return np.asarray(joined.derivative(order)(U * length) if order else joined(U * length))


def largest_change(count: int, source: str, order: int, draw: int) -> float:
    """Return by how much a derivative changes where the values of one column, or the length, are off."""
    ends = rows_off(count, source, draw)[0]
    right, length = curve(ends, LENGTH, order), LENGTH
    if source == "late":
        return max(float(np.abs(curve(ends, length + by, order) - right).max()) for by in (-OFF, OFF))
    column = NAMES.index(source)
    changes = []
    for signs in product((-OFF, OFF), repeat=2):
        other = ends.copy()
        other[column] += signs
        changes.append(float(np.abs(curve(other, length, order) - right).max()))
    return max(changes)


CASES = [
    (count, source, order) for count in (2, 3) for source in (*NAMES[:count], "late") for order in range(4)
]


@pytest.mark.parametrize(("count", "source", "order"), CASES, ids=str)
def test_the_error_of_a_piece_bounds_what_each_source_makes(count: int, source: str, order: int) -> None:
    """Each source alone: the bound holds for all rows, and for some it is not far too high.

    It is a sum of bounds: those of D and E of an acceleration are 24 times what both make of a velocity.
    """
    shares = []
    for draw in range(12):
        true = largest_change(count, source, order, draw)
        bound = float(rows_off(count, source, draw)[1].error(order)[0])
        assert true <= bound * (1 + 1e-9) + 1e-13
        shares.append(bound / max(true, 1e-300))
    assert min(shares) < (25.0 if (count, source, order) == (3, "qdd", 1) else 5.0)


def worst_together(ends: Array, errors: Array, late: float, order: int) -> float:
    """Return by how much a derivative changes at most where all columns, and the length, are off at once.

    Changes of the columns add up: each value is off to the side that adds to the others, at each place.
    """
    worst, right = 0.0, curve(ends, LENGTH, order)
    for length in (LENGTH - late, LENGTH + late):
        by_length = curve(ends, length, order) - right
        parts = np.zeros(U.size)
        for column, end in product(range(len(ends)), range(2)):
            unit = np.zeros_like(ends)
            unit[column, end] = errors[column]
            parts += np.abs(curve(unit, length, order))
        worst = max(worst, float((np.abs(by_length) + parts).max()))
    return worst


@pytest.mark.parametrize(("count", "order"), list(product((2, 3), (1, 2, 3))))
def test_the_error_of_a_piece_bounds_what_all_sources_make_together(count: int, order: int) -> None:
    """Of any sizes beside each other, of rows that agree and of rows that state far more than they go."""
    rng, shares = np.random.default_rng([count, order]), []
    for _ in range(30):
        powers = LENGTH ** -np.arange(float(count))
        errors, late = OFF * powers * 10.0 ** rng.uniform(-4, 0, count), LENGTH * 10.0 ** rng.uniform(-8, -5)
        ends = rng.normal(size=(count, 2)) * powers[:, None] * 10.0 ** rng.uniform(-3, 0, (count, 1))
        stated = tuple(values[:, None] for values in ends)
        off = tuple(np.array([error]) for error in errors)
        bound = float(PieceRows(np.array([LENGTH]), np.array([late]), stated, off).error(order)[0])
        true = worst_together(ends, errors, late, order)
        assert true <= bound * (1 + 1e-9)
        shares.append(bound / true)
    assert min(shares) < 2.5


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("late", [0.0, 0.05, 0.1, 0.3])
def test_what_two_rows_make_certain_is_the_least_that_rounding_leaves(late: float, sign: float) -> None:
    """Stamps that may hide the whole length make the speed uncertain upwards alone."""
    ends = (sign * np.array([[0.2], [0.5]]),)
    rows = PieceRows(np.array([LENGTH]), np.array([late]), ends, (np.array([0.01]),))
    off = np.linspace(-0.01, 0.01, 5)
    lengths = np.linspace(max(LENGTH - late, 1e-9), LENGTH + late, 9)
    least = min((0.3 + a - b) / length for a, b, length in product(off, off, lengths))
    assert rows.certain_difference(0, sign)[0] == pytest.approx(least, rel=1e-12)
    assert rows.certain_difference(0, -sign)[0] == -np.inf


def test_a_speed_far_beyond_its_limit_is_certain_whatever_the_stamps_hide(tmp_path: Path) -> None:
    """Stamps of two decimals, 10 and 20 ms apart, may be off by 5 ms each: 1 rad in 30 ms is 33 rad/s."""
    rows, arm = tmp_path / "rows.csv", tmp_path / "arm.yaml"
    stamps = ("0.00", "0.01", "0.03", "0.04", "0.05", "0.07")
    rows.write_text("t,q1\n" + "".join(f"{t},{k}.000\n" for k, t in enumerate(stamps)))
    for limit, verdict in ((33, "exceeded"), (60, "within rounding")):
        arm.write_text(f"joints: [{{velocity: {limit}}}]\n")
        assert check_file(str(rows), CheckOptions(robot=str(arm))).judgement.verdict == verdict


@pytest.mark.parametrize(("order", "most"), [(0, 1.0), (1, 3.0), (2, 12.0), (3, 24.0)])
def test_the_error_of_a_spline_bounds_rounding_that_alternates(order: int, most: float) -> None:
    """Positions that are off by turns up and down make the largest derivatives of all."""
    times, signs = LENGTH * np.arange(40.0), (-1.0) ** np.arange(40)
    spline = CubicSpline(times, OFF * signs)
    middle = np.linspace(1.5, 2.5, 2001) + 1e-9
    largest = float(np.abs(spline(middle, order)).max())
    assert largest == pytest.approx(most * OFF / LENGTH**order, rel=1e-3)
    still = PieceRows(np.array([LENGTH]), np.zeros(1), (np.zeros((2, 1)),), (np.array([OFF]),), spline=True)
    assert largest <= still.error(order)[0] <= 4.1 * largest


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("order", range(4))
@pytest.mark.parametrize("draw", range(6))
def test_the_error_of_a_piece_is_that_of_its_mirror_images(draw: int, order: int, count: int) -> None:
    """What moves the other way, or is passed from its end to its start, is known as well."""
    rng = np.random.default_rng(draw)
    ends = rng.normal(size=(count, 2)) * (rng.random((count, 2)) < 0.6)
    errors = tuple(np.array([OFF]) for _ in range(count))
    signs = (-1.0) ** np.arange(count)[:, None]
    found = [
        PieceRows(
            np.array([LENGTH]), np.array([OFF]), tuple(each[:, None] for each in of_ends), errors
        ).error(order)
        for of_ends in (ends, -ends, signs * ends[:, ::-1], -signs * ends[:, ::-1])
    ]
    np.testing.assert_allclose(found, [found[0]] * 4, rtol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rows_that_agree_with_each_other_are_off_by_their_stamps_alone(sign: float) -> None:
    """Of an acceleration a that is constant the gain of velocity is off by a times the lateness: E, and no more.

    Of one that goes from -a to a the way is off, by 2 T late 2 a / 12: D. Largest values as in the module.
    """
    length, late, a = 1.0, 1e-7, 2.0 * sign
    nothing = tuple(np.zeros(1) for _ in range(3))

    def error(q: list[float], v: list[float], w: list[float], order: int) -> float:
        ends = tuple(np.array(each)[:, None] for each in (q, v, w))
        return float(PieceRows(np.array([length]), np.array([late]), ends, nothing).error(order)[0])

    steady = [0.0, 0.0], [-a / 2, a / 2], [a, a]
    bent = [0.0, -a / 6], [0.0, 0.0], [-a, a]
    gain, way = abs(a) * late, 2 * late * 2 * abs(a) / 12
    assert error(*steady, 2) == pytest.approx(1.5 * gain, rel=1e-3)
    assert error(*steady, 3) == pytest.approx(6.0 * gain, rel=1e-3)
    assert error(*bent, 2) == pytest.approx(10 / np.sqrt(3) * way, rel=1e-3)
    assert error(*bent, 3) == pytest.approx(60.0 * way + 2 * abs(a) * late, rel=1e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("size", [0.0, 1e-3, 3.0, 1e6])
def test_numbers_of_all_digits_are_off_by_a_few_units_in_the_last_place(size: float, sign: float) -> None:
    """Three sums and a product, each rounded to the nearest, are off by two units: that much, and not ten times it."""
    error = float(stated_errors(np.array([[sign * size]]), np.zeros(1), 0.0)[0, 0])
    assert 2 * np.spacing(size) <= error <= 20 * np.spacing(size)
