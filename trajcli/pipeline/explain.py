"""What a textbook would print about each move: polynomials, phases, peaks, in the job's units."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from trajcli.columns import joint_factors
from trajcli.curves.piecewise import Array, taylor_shift
from trajcli.job.report import PeakReport
from trajcli.pipeline.arm import Arm
from trajcli.pipeline.passing import passing_in_units
from trajcli.pipeline.plan import Plan
from trajcli.pipeline.reached_pose import reached_in_units
from trajcli.pipeline.report import report_of
from trajcli.pipeline.stretch import PlannedMove
from trajcli.units import Dimension, Quantity, Units, to_user, unit_name

_NOTHING = 1e-12  # of the largest term over the move: what is smaller came from rounding
_CANCELS = 1e4  # times larger than what they add up to: of ten digits, six are left
_SAME = 1e-9  # of the largest term: neighbouring pieces this close are one polynomial


@dataclass(frozen=True, eq=False)
class Stretch:
    """One polynomial of one joint, over one piece or several equal ones.

    Attributes:
        start: Seconds from the start of the move.
        end: Seconds from the start of the move.
        local: Coefficients in powers of (t - start), ascending, in the job's units.
        absolute: Coefficients in powers of t from the start of the move, ascending, in the job's units.
    """

    start: float
    end: float
    local: Array
    absolute: Array

    @property
    def text(self) -> str:
        """The polynomial in powers of t, or of (t - start) where the former would lose its digits."""
        powers = np.arange(self.local.size)
        terms = np.abs(self.local) * (self.end - self.start) ** powers
        cancelling = np.abs(self.absolute) * self.end**powers
        if cancelling.max() <= _CANCELS * terms.max():
            return polynomial_text(self.absolute)
        return polynomial_text(self.local, f"(t - {self.start:.10g})")


def stretches_of(move: PlannedMove, units: Units) -> list[list[Stretch]]:
    """Return the polynomials of each joint of a move, in order of time."""
    factors = joint_factors(move.robot.joint_types, units)
    curve = move.planned.curve
    return [
        _joint_stretches(curve.breaks, curve.coefficients[:, :, joint] / factors[joint])
        for joint in range(curve.dimension)
    ]


def _joint_stretches(breaks: Array, coefficients: Array) -> list[Stretch]:
    result: list[Stretch] = []
    for piece in range(breaks.size - 1):
        start, end = float(breaks[piece]), float(breaks[piece + 1])
        local = _without_noise(coefficients[::-1, piece], end - start)
        absolute = _without_noise(taylor_shift(coefficients[:, piece], np.array(-start))[::-1], end)
        if result and _equal(result[-1].absolute, absolute, end):
            result[-1] = Stretch(result[-1].start, end, result[-1].local, result[-1].absolute)
        else:
            result.append(Stretch(start, end, local, absolute))
    return result


def _without_noise(coefficients: Array, duration: float) -> Array:
    """Return ascending coefficients without those whose term is mere rounding over the duration."""
    terms = np.abs(coefficients) * duration ** np.arange(coefficients.size)
    cleaned: Array = np.where(terms <= _NOTHING * terms.max(), 0.0, coefficients)
    return cleaned


def _equal(a: Array, b: Array, duration: float) -> bool:
    powers = duration ** np.arange(a.size)
    return bool((np.abs(a - b) * powers <= _SAME * (np.abs(a) * powers).max()).all())


def explanation(plan: Plan) -> dict[str, Any]:
    """Return what `trajcli explain --json` prints: report, polynomials and phases, in the job's units."""
    units = plan.loaded.units
    report = report_of(plan, reference=True)
    return {
        "version": 1,
        "job": report.job,
        "robot": report.robot,
        "verdict": report.verdict,
        "units": {"angle": units.angle, "length": units.length, "time": "s"},
        "joints": list(plan.trajectory.joint_names),
        "duration": report.duration,
        "moves": [
            {
                **_move(plan, index),
                "peaks": [peak_in_units(peak, plan) for peak in entry.peaks],
                "binding": entry.binding and entry.binding.model_dump(),
                "reference": entry.reference and entry.reference.model_dump(),
            }
            for index, entry in enumerate(report.moves)
        ],
        "events": [event.model_dump() for event in report.events],
    }


def _move(plan: Plan, index: int) -> dict[str, Any]:
    move, span = plan.moves[index], plan.trajectory.spans[index]
    names = move.robot.joint_names
    arrivals = move.planned.arrivals
    polynomials = {
        name: [
            {"start": s.start, "end": s.end, "local": s.local.tolist(), "absolute": s.absolute.tolist()}
            for s in rows
        ]
        for name, rows in zip(names, stretches_of(move, plan.loaded.units), strict=True)
    }
    return {
        "index": index,
        "joints": list(names),
        "planner": span.planner,
        "start": span.start,
        "end": span.end,
        "duration": move.duration,
        "stretch": move.stretch,
        "continuity": span.continuity,
        "from_pose": _reached(plan, None) if index == 0 else None,
        "to_pose": _reached(plan, index),
        "breaks": move.planned.curve.breaks.tolist(),
        "polynomials": polynomials,
        "closed_form": closed_form(move, plan.loaded.units),
        "phases": [
            {**asdict(phase), "joint": None if phase.joint is None else names[phase.joint]}
            for phase in move.planned.phases
        ],
        "arrivals": None if arrivals is None else dict(zip(names, arrivals, strict=True)),
        **passing_in_units(move, span, plan.verdict, plan.loaded.units),
    }


def _reached(plan: Plan, index: int | None) -> dict[str, Any] | None:
    """Return how the pose was reached that a move goes to, or the job starts at; None where there is none."""
    reached = plan.reached[index]
    return None if reached is None else reached_in_units(reached, Arm(plan.loaded.robot, plan.loaded.units))


def closed_form(move: PlannedMove, units: Units) -> dict[str, str] | None:
    """Return the formula of each joint where the curve is the fit of one, else None."""
    if move.planned.closed_form is None:
        return None
    factors = joint_factors(move.robot.joint_types, units)
    start = move.start.position / factors
    change = (move.planned.end.position - move.start.position) / factors
    period = f"{move.duration:.10g}"
    return {
        name: f"{q:.10g}"
        + (
            f" {'-' if dq < 0 else '+'} {abs(dq):.10g} (t/{period} - sin(2 pi t/{period})/(2 pi))"
            if dq
            else ""
        )
        for name, q, dq in zip(move.robot.joint_names, start, change, strict=True)
    }


def peak_in_units(peak: PeakReport, plan: Plan) -> dict[str, Any]:
    """Return the extremes of one quantity with its unit, in the job's units."""
    joint = plan.trajectory.joint_names.index(peak.joint)
    dimension: Dimension = "length" if plan.trajectory.joint_types[joint] == "prismatic" else "angle"
    order = ("position", "velocity", "acceleration", "jerk").index(peak.quantity)
    quantity, units = Quantity(dimension, order), plan.loaded.units
    said = {key: to_user(getattr(peak, key), quantity, units) for key in ("low", "high")}
    limit = [None if bound is None else to_user(bound, quantity, units) for bound in peak.limit]
    return {**peak.model_dump(), **said, "limit": limit, "unit": unit_name(quantity, units)}


def polynomial_text(coefficients: Array, variable: str = "t") -> str:
    """Return ascending coefficients as a textbook prints them: "20 + 90 t^2 - 60 t^3"."""
    text = ""
    for power, coefficient in enumerate(coefficients.tolist()):
        size = f"{abs(coefficient):.10g}"
        if size == "0":
            continue
        factor = ("", variable, f"{variable}^{power}")[min(power, 2)]
        term = factor if size == "1" and power else f"{size} {factor}".strip()
        sign = "-" if coefficient < 0 else "+"
        text += f" {sign} {term}" if text else ("-" if sign == "-" else "") + term
    return text or "0"
