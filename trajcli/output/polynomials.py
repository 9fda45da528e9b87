"""Polynomials of a move as a textbook prints them: in local and absolute time, with knots and blends.

What came from rounding is zero, and coefficients in rad are told as multiples of pi where they are such.

Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from trajcli.columns import joint_factors
from trajcli.curves.piecewise import Array, derivative_coefficients, taylor_shift
from trajcli.geometry.rotation import Flags
from trajcli.job.explanation import BlendReport, KnotReport, PolynomialReport, polynomial_reports
from trajcli.job.report_parts import in_units
from trajcli.planners.planner import Phase, PlannedMove
from trajcli.units import Units, joint_units

_NOTHING = 1e-12  # of the largest term of a piece: what is smaller came from rounding
_NOTHING_OF_ALL = 1e-14  # of the largest term of all pieces: likewise
_SMALLEST = 1e-15  # rad or m: nothing moves by less, over a whole piece
_SAME = 1e-9  # of the largest term: neighbouring pieces this close are one polynomial
_DENOMINATOR = 200  # the largest of a multiple of pi that is told; larger ones are near to any number
_NUMERATOR = 10_000  # likewise
_CONVERGENTS = 14  # of a continued fraction: the next one has a larger denominator
_DIGITS = 5e-11  # relative: a multiple of pi has the same ten digits


def polynomials_of(move: PlannedMove, units: Units, *, derivatives: bool) -> list[list[PolynomialReport]]:
    """Return the polynomials of each joint of a move, in order of time, in the units of the job.

    Args:
        move: The move.
        units: Of the job.
        derivatives: Whether they come with those of velocity and acceleration.
    """
    curve, origin = move.planned.curve, move.planned.origin
    factors = joint_factors(move.robot.joint_types, units)
    names = {"m": units.length, "rad": units.angle}
    return [
        polynomial_intervals(
            curve.breaks,
            curve.coefficients[:, :, joint] / factors[joint],
            names[unit],
            join=not move.planned.one_piece_per_interval,
            smallest=_SMALLEST / factors[joint],
            origin=origin,
            derivatives=derivatives,
        )
        for joint, unit in enumerate(joint_units(move.robot.joint_types))
    ]


def polynomial_intervals(
    breaks: Array,
    coefficients: Array,
    unit: str,
    *,
    join: bool = True,
    smallest: float = _SMALLEST,
    origin: float = 0.0,
    derivatives: bool = False,
) -> list[PolynomialReport]:
    """Return the polynomials of one component.

    Args:
        breaks: Shape (pieces + 1,).
        coefficients: Shape (degree + 1, pieces), highest power first, local to each break.
        unit: Of their values.
        join: Whether equal neighbours become one.
        smallest: What is smaller, in this unit, is nothing.
        origin: Zero of the times of the job, on the time of the breaks, s.
        derivatives: Whether they come with those of velocity and acceleration.
    """
    starts, ends = breaks[:-1], breaks[1:]
    terms = np.abs(coefficients) * (ends - starts) ** np.arange(coefficients.shape[0])[::-1, None]
    nothing = max(smallest, _NOTHING_OF_ALL * float(terms.max()))
    local = _without_noise(coefficients[::-1].T, ends - starts, nothing)
    absolute = _without_noise(taylor_shift(coefficients, -starts)[::-1].T, ends, nothing)
    firsts = _firsts(absolute, ends) if join else list(range(ends.size))
    lasts = ends.tolist()
    columns = {"start": starts[firsts], "end": ends[[first - 1 for first in [*firsts[1:], len(lasts)]]]}
    columns |= {"local": local[firsts], "absolute": absolute[firsts]}
    if origin:
        unshifted = taylor_shift(coefficients, origin - starts)[::-1].T
        columns["unshifted"] = _without_noise(unshifted, np.abs(ends - origin), nothing)[firsts]
    if derivatives:
        for order, name in ((1, "velocity"), (2, "acceleration")):
            columns[name] = derivative_coefficients(absolute[firsts].T[::-1], order)[::-1].T
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in values]
    if unit == "rad":
        for row, multiples in zip(rows, _coefficients_in_pi(absolute[firsts]), strict=True):
            row["in_pi"] = multiples
    return polynomial_reports({**row, "unit": unit} for row in rows)


def _without_noise(coefficients: Array, durations: Array, nothing: float) -> Array:
    """Return ascending coefficients (pieces, n) without those whose term over the duration is rounding."""
    terms = np.abs(coefficients) * durations[:, None] ** np.arange(coefficients.shape[1])
    least = np.maximum(_NOTHING * terms.max(axis=1, keepdims=True), nothing)
    return np.where(terms <= least, 0.0, coefficients)


def _firsts(absolute: Array, ends: Array) -> list[int]:
    """Return which of the polynomials (pieces, n) begin one that is another than those before it."""
    like = np.append(False, _equal(absolute[:-1], absolute[1:], ends[1:], 2 * _SAME))  # as the one before
    firsts = []
    for first, stop in pairwise([*np.flatnonzero(~like).tolist(), len(like)]):
        while first < stop:
            firsts.append(first)
            same = _equal(absolute[first], absolute[first + 1 : stop], ends[first + 1 : stop], _SAME)
            first += 1 + int(np.append(same, False).argmin())
    return firsts


def _equal(a: Array, b: Array, durations: ArrayLike, same: float) -> Flags:
    """Return whether polynomials (..., n) are equal as far as `same` of their largest term."""
    powers = np.asarray(durations)[..., None] ** np.arange(a.shape[-1])
    largest = (np.abs(a) * powers).max(axis=-1, keepdims=True)
    return np.asarray((np.abs(a - b) * powers <= same * largest).all(axis=-1))


def multiples_of_pi(values: ArrayLike) -> list[str | None]:
    """Return each number as a multiple of pi, such as "-47 pi/2", or None where it is none, or is zero.

    A number is such a multiple where ten digits do not tell it from one with small integers.
    """
    return [_multiple(ratio) for ratio in (np.asarray(values, dtype=np.float64).reshape(-1) / np.pi).tolist()]


def _multiple(ratio: float) -> str | None:
    """Return the multiple of pi that a ratio to it is, by convergents of its continued fraction; or None."""
    size = remainder = abs(ratio)
    if not 0.5 / _DENOMINATOR <= size <= _NUMERATOR:
        return None
    before, last = (0.0, 1.0), (1.0, 0.0)  # numerators and denominators
    for _ in range(_CONVERGENTS):
        whole = float(math.floor(remainder))
        before, last = last, (whole * last[0] + before[0], whole * last[1] + before[1])
        numerator, denominator = last
        if denominator > _DENOMINATOR or numerator > _NUMERATOR:
            return None
        if abs(numerator - size * denominator) <= _DIGITS * numerator:
            return _of_pi(int(math.copysign(numerator, ratio)), int(denominator))
        if remainder == whole:
            return None
        remainder = 1 / (remainder - whole)
    return None


def _of_pi(numerator: int, denominator: int) -> str:
    """Return a fraction of pi as it is printed."""
    size = "" if abs(numerator) == 1 else f"{abs(numerator)} "
    return f"{'-' * (numerator < 0)}{size}pi" + (f"/{denominator}" if denominator > 1 else "")


def _coefficients_in_pi(coefficients: Array) -> Iterable[list[str | None] | None]:
    """Yield the coefficients of each polynomial (pieces, n) as multiples of pi; None where none is one."""
    texts = multiples_of_pi(coefficients)
    count = coefficients.shape[1]
    for first in range(0, len(texts), count):
        row = texts[first : first + count]
        yield row if any(row) else None


def knots_of(move: PlannedMove, units: Units) -> list[KnotReport] | None:
    """Return the knots of a spline with virtual points, in the units of the job; None for other curves."""
    curve, virtual = move.planned.curve, move.planned.virtual
    if not virtual:
        return None
    types = move.robot.joint_types
    states = curve.evaluate_orders(curve.breaks, (0, 1, 2))
    nothing = _NOTHING * np.abs(states).max(axis=(0, 2), keepdims=True)
    states = np.where(np.abs(states) <= nothing, 0.0, states)
    names = [joint_units(types, order) for order in range(3)]
    knots = (
        KnotReport(
            time=time,
            virtual=index in virtual,
            position=position,
            velocity=velocity,
            acceleration=acceleration,
            units=names[0],
            velocity_units=names[1],
            acceleration_units=names[2],
        )
        for index, (time, (position, velocity, acceleration)) in enumerate(
            zip(curve.breaks.tolist(), states.tolist(), strict=True)
        )
    )
    return [in_units(knot, units) for knot in knots]


def blends_of(move: PlannedMove, units: Units) -> list[BlendReport] | None:
    """Return the parabolas about the points that they round, in the units of the job; None without any.

    Their times are those of the job, which count from `origin`.
    """
    phases, points = [p for p in move.planned.phases if p.point is not None], move.planned.via_points
    if not phases or points is None:
        return None
    joints = range(len(move.robot.joints))
    return [
        in_units(_blend(move, phase, float(points.times[phase.point or 0]), joint), units)
        for phase in phases
        for joint in (joints if phase.joint is None else [phase.joint])
    ]


def _blend(move: PlannedMove, phase: Phase, time: float, joint: int) -> BlendReport:
    """Return the parabola of one joint about the time at which its point is to be passed, in SI."""
    curve, origin = move.planned.curve, move.planned.origin
    middle = (phase.start + phase.end) / 2
    piece = int(np.clip(np.searchsorted(curve.breaks, middle, "right") - 1, 0, curve.pieces - 1))
    about = taylor_shift(curve.coefficients[:, piece, joint], np.array(time - curve.breaks[piece]))[::-1]
    duration = np.array([phase.end - phase.start])
    kept = _without_noise(np.pad(about, (0, max(0, 3 - about.size)))[None, :3], duration, _SMALLEST)
    return BlendReport(
        index=phase.point or 0,
        joint=move.robot.joint_names[joint],
        time=time - origin,
        start=phase.start - origin,
        end=phase.end - origin,
        coefficients=kept[0].tolist(),
        unit=joint_units(move.robot.joint_types)[joint],
    )
