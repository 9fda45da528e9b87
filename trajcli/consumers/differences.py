"""Rules about backward differences of commanded positions at the period of a controller.

A controller that takes a position in each period knows no other derivatives than these, so that the rounding
of the numbers in a file is part of what it sees: nothing is allowed for it here.

Source: frankaemika/libfranka, rate_limiting.cpp: velocity, acceleration and jerk from positions 1 ms apart.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trajcli.consumers.rule_check import RuleCheck, when
from trajcli.curves.approach import ApproachLimits
from trajcli.curves.piecewise import Array
from trajcli.errors import at_least
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

__all__ = ["Differences", "EffortRate", "RoundingNoise", "VelocityTowardsEnds"]

_ORDERS = {"velocity": 1, "acceleration": 2, "jerk": 3}
_NEAR = 0.01  # relative: rows that are not as far apart as that are not at the controller's period
_ROUNDING = 1e-9  # relative


def rounding_noise(order: int, half_unit: Array, period: float) -> Array:
    """Return the largest error of a backward difference of positions that are rounded, shape (n,).

    The coefficients of a difference of order k are the binomial ones, and their magnitudes add up to 2^k.

    Args:
        order: 1 for velocity, 2 acceleration, 3 jerk.
        half_unit: Largest error of a position, shape (n,).
        period: s.
    """
    return np.asarray(2.0**order * half_unit / period**order)


def largest_rounding(positions: Array, resolution: Resolution) -> Array:
    """Return the largest error of some positions as a file writes them, by joint, shape (n,).

    Args:
        positions: Shape (N, n).
        resolution: Of the file.
    """
    return np.asarray(resolution.q + resolution.relative[0] * np.abs(positions).max(axis=0))


def at_period(times: Array, period: float) -> NDArray[np.bool_]:
    """Return which intervals between neighbouring stamps are those of a controller, shape (N - 1,)."""
    return np.asarray(np.abs(np.diff(times) - period) <= _NEAR * period)


class _AtPeriod(RuleCheck):
    """A rule about rows at the period of a controller; the motion begins at rest."""

    _before: Array | None = None
    _depth = 3

    _stamp: float | None = None
    _intervals = 0
    _at_period = 0

    def _take(self, rows: RecordedMotion) -> None:
        values = self._values(rows)
        if values is None:
            return
        self._count_intervals(rows)
        if self._before is None:
            # the arm stands where the motion begins
            self._before = np.repeat(values[:1], self._depth, axis=0)
        joined = np.concatenate([self._before, values])
        self._before = joined[-self._depth :]
        self._judge(rows, joined)

    def _values(self, rows: RecordedMotion) -> Array | None:
        return rows.q

    @abstractmethod
    def _judge(self, rows: RecordedMotion, values: Array) -> None:
        """Judge the values of the block, before which stand the last ones of the block before."""

    def _count_intervals(self, rows: RecordedMotion) -> None:
        times = rows.t if self._stamp is None else np.append(self._stamp, rows.t)
        near = at_period(times, self.number("period"))
        self._stamp = float(rows.t[-1])
        self._intervals += near.size
        self._at_period += int(np.count_nonzero(near))

    def _finish(self) -> None:
        if 2 * self._at_period < self._intervals:
            self.unjudged = (
                f"most of its rows are not {self.number('period'):g} s apart, as its consumer takes them"
            )
            self.forget()


class Differences(_AtPeriod):
    """Limits of a difference of positions: `order` is velocity, acceleration or jerk.

    `limit` is a number for each joint, or one for all; `margin` is taken off.
    """

    parameters: ClassVar[Mapping[str, Any]] = {"order": None, "period": None, "limit": None, "margin": 0.0}

    def _judge(self, rows: RecordedMotion, values: Array) -> None:
        name, period, count = self.word("order"), self.number("period"), rows.q.shape[1]
        if not self.fits("limit", count):
            return
        order = _ORDERS[name]
        limit = self.vector("limit", count) - self.number("margin")
        rates = (np.diff(values, order, axis=0) / period**order)[self._depth - order :]

        def fields(index: int, joint: int) -> dict[str, Any]:
            value, bound = float(rates[index, joint]), float(limit[joint])
            compared = values[index + self._depth - order : index + self._depth + 1]
            noise = rounding_noise(order, largest_rounding(compared, rows.resolution), period)
            rounded = abs(value) - noise[joint] <= bound
            text = (
                f"the {name} of {self.joint_name(rows, joint)} is {value:.6g} {self.unit(joint, order)} "
                f"{when(rows, index)}, as a difference over {period:g} s; the limit is {bound:.9g}"
            )
            if rounded:
                text += f", and the decimals of the file alone make up to {noise[joint]:.4g}"
            slower = None if rounded else float(abs(value) / bound) ** (1 / order)
            hint = (
                "write more decimals"
                if rounded
                else f"make the motion {at_least(slower or 1.0)} times longer"
            )
            return {
                "kind": name,
                "value": value,
                "limit": float(np.copysign(bound, value)),
                "factor": slower,
                "method": "differences",
                "message": text,
                "hint": hint,
            }

        with np.errstate(divide="ignore"):
            share = np.abs(rates) / limit
        self.note_rows(rows, share > 1 + _ROUNDING, share, fields)


class VelocityTowardsEnds(_AtPeriod):
    """Limits of the velocity towards the ends of the range, max(0, sqrt(2 d x) - o) at the distance x.

    Of a difference of positions, at the position before it, as the controller knows that one.
    """

    parameters: ClassVar[Mapping[str, Any]] = {
        "period": None,
        "lower": None,
        "upper": None,
        "deceleration": None,
        "offset": None,
        "margin": 0.0,
    }

    def _judge(self, rows: RecordedMotion, values: Array) -> None:
        period, count = self.number("period"), rows.q.shape[1]
        if not self.fits("lower", count):
            return
        ranges = np.stack([self.vector("lower", count), self.vector("upper", count)], axis=1)
        limits = ApproachLimits(ranges, self.vector("deceleration", count), self.vector("offset", count))
        before = values[self._depth - 1 : -1]
        rates = np.diff(values, axis=0)[self._depth - 1 :] / period
        low, high = limits.bounds(before)
        margin = self.number("margin")
        bound = np.maximum(np.where(rates > 0, high, -low) - margin, 0.0)
        excess = np.abs(rates) - bound * (1 + _ROUNDING)
        slack = rounding_noise(1, np.spacing(np.abs(before)), period)

        def fields(index: int, joint: int) -> dict[str, Any]:
            value, allowed = float(rates[index, joint]), float(bound[index, joint])
            end = ranges[joint, int(value > 0)]
            distance = abs(float(end - before[index, joint]))
            return {
                "kind": "velocity_by_position",
                "value": value,
                "limit": float(np.copysign(allowed, value)),
                "factor": abs(value) / allowed if allowed else None,
                "method": "differences",
                "message": f"the velocity of {self.joint_name(rows, joint)} is {value:.6g} "
                f"{self.unit(joint, 1)} {when(rows, index)}, {distance:.6g} {self.unit(joint)} before the "
                f"end of its range, where {allowed:.6g} is allowed",
                "hint": "slow it down towards the end of the range, or stay further away from it",
            }

        self.note_rows(rows, excess > slack, excess, fields)


class RoundingNoise(RuleCheck):
    """Decimals that are fine enough for differences: their noise is at most `share` of the limit of jerk."""

    parameters: ClassVar[Mapping[str, Any]] = {"period": None, "limit": None, "share": None}

    _worst = 0.0

    def _take(self, rows: RecordedMotion) -> None:
        if not self.fits("limit", rows.q.shape[1]):
            return
        limit = self.vector("limit", rows.q.shape[1])
        half = largest_rounding(rows.q, rows.resolution)
        noise = rounding_noise(3, half, self.number("period"))
        used = noise / limit
        joint = int(used.argmax())
        if used[joint] <= max(self.number("share"), self._worst):
            return
        self._worst = float(used[joint])
        self.forget()
        fields = {
            "kind": "quantisation",
            "value": float(noise[joint]),
            "limit": float(self.number("share") * limit[joint]),
            "message": f"positions are rounded to {2 * float(half[joint]):.3g} {self.unit(joint)}, which "
            f"makes a jerk of up to {float(noise[joint]):.4g} {self.unit(joint, 3)} as a difference over "
            f"{self.number('period'):g} s, of {float(limit[joint]):.6g} that {self.joint_name(rows, joint)} "
            "may have",
            "hint": f"write positions in {self.unit(joint)} with at least nine decimals",
        }
        # of numbers of few bits the largest is the coarsest
        roughest = int(np.abs(rows.q[:, joint]).argmax()) if rows.resolution.relative[0] else 0
        self.note(rows, joint, roughest, float(used[joint]), fields)


class EffortRate(_AtPeriod):
    """Limits of the change of effort per second, `limit`."""

    parameters: ClassVar[Mapping[str, Any]] = {"period": None, "limit": None}

    _depth = 1

    def _values(self, rows: RecordedMotion) -> Array | None:
        if rows.tau is None:
            self.unjudged = "the file has no efforts"
        return rows.tau

    def _judge(self, rows: RecordedMotion, values: Array) -> None:
        if not self.fits("limit", rows.q.shape[1]):
            return
        limit = self.vector("limit", rows.q.shape[1])
        rates = np.diff(values, axis=0) / self.number("period")

        def fields(index: int, joint: int) -> dict[str, Any]:
            value = float(rates[index, joint])
            return {
                "kind": "effort",
                "value": value,
                "limit": float(np.copysign(limit[joint], value)),
                "method": "differences",
                "message": f"the effort of {self.joint_name(rows, joint)} changes by {value:.6g} "
                f"{self.effort_unit(joint)}/s {when(rows, index)}, and {limit[joint]:.6g} is recommended",
            }

        share = np.abs(rates) / limit
        self.note_rows(rows, share > 1 + _ROUNDING, share, fields)
