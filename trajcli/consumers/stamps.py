"""Rules about time stamps: their order, the period of a controller, and durations in whole units."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from trajcli.consumers.differences import largest_rounding
from trajcli.consumers.rule_check import OfFirstRow, RuleCheck, when
from trajcli.curves.piecewise import Array
from trajcli.findings import Finding
from trajcli.kinematics.robot import QUANTITIES
from trajcli.streams.recorded_motion import RecordedMotion

__all__ = ["ControllerPeriod", "FirstPoint", "IncreasingTimes", "LongestTime", "SegmentDurations"]

_UNITS = 4.0  # in the last place: two stamps are rounded, and their difference
_NEXT = 1e-9  # s: a clock of a controller counts whole nanoseconds
_WHOLE = 0.99  # of a period: a row that is off by it is missing, or doubled, however stamps are rounded


class _Intervals(RuleCheck):
    """A rule about the intervals between neighbouring rows."""

    _before: float | None = None

    def _take(self, rows: RecordedMotion) -> None:
        times = rows.t if self._before is None else np.concatenate([[self._before], rows.t])
        self._before = float(rows.t[-1])
        if times.size > 1:
            # one interval for each row that has one before it; the first row of a file has none
            self._judge(rows, times, int(rows.t.size - (times.size - 1)))

    @abstractmethod
    def _judge(self, rows: RecordedMotion, times: Array, first: int) -> None:
        """Judge the intervals of `times`; the k-th ends at row `first + k` of the block."""

    def _note(self, rows: RecordedMotion, over: Any, excess: Array, first: int, fields: Any) -> None:  # noqa: ANN401
        filled = np.zeros(rows.t.size, dtype=bool), np.zeros(rows.t.size)
        filled[0][first:], filled[1][first:] = over, excess
        self.note_times(rows, *filled, fields)


class IncreasingTimes(_Intervals):
    """Stamps that strictly increase when counted in whole units of `unit` seconds."""

    parameters: ClassVar[Mapping[str, Any]] = {"unit": None}

    def _judge(self, rows: RecordedMotion, times: Array, first: int) -> None:
        unit = self.number("unit")
        ticks = np.rint(times / unit)
        steps = np.diff(ticks)

        def fields(index: int) -> dict[str, Any]:
            step = float(steps[index - first])
            what = "repeats the stamp before it" if step == 0 else f"stands {-step * unit:.9g} s before it"
            return {
                "kind": "time",
                "value": step * unit,
                "limit": unit,
                "message": f"the row {when(rows, index)} {what}, in whole units of {unit:g} s",
                "hint": "leave one of the two rows out" if step == 0 else "sort the rows by time",
            }

        self._note(rows, steps <= 0, -steps, first, fields)


class ControllerPeriod(_Intervals):
    """Rows that are `period` seconds apart."""

    parameters: ClassVar[Mapping[str, Any]] = {"period": None}

    def _judge(self, rows: RecordedMotion, times: Array, first: int) -> None:
        period, resolution = self.number("period"), rows.resolution
        steps = np.diff(times)
        size = _sizes(times)
        rounding = 2 * (resolution.time + resolution.relative_time * size) + _NEXT
        rounding = np.minimum(rounding + _UNITS * np.spacing(size), _WHOLE * period)
        off = np.abs(steps - period)

        def fields(index: int) -> dict[str, Any]:
            step = float(steps[index - first])
            return {
                "kind": "time",
                "value": step,
                "limit": period,
                "message": f"the row {when(rows, index)} stands {step:.9g} s after the one before it, and "
                f"the period is {period:g} s",
                "hint": f"write it at {1 / period:g} Hz, its duration a whole number of periods: "
                f"`output: {{rate: {1 / period:g}, align: true}}`; `trajcli resample --rate {1 / period:g}` "
                "leaves the last row where it stands",
            }

        self._note(rows, off > rounding, off, first, fields)


class SegmentDurations(_Intervals):
    """Durations from point to point as whole numbers of `unit` seconds, none of them zero.

    The rule is about what `value` says: "zero" for durations that become zero, "whole" for those that are no
    whole number of units, and are therefore rounded.
    """

    parameters: ClassVar[Mapping[str, Any]] = {"unit": None, "about": None}

    def _judge(self, rows: RecordedMotion, times: Array, first: int) -> None:
        unit, zero = self.number("unit"), self.word("about") == "zero"
        steps = np.diff(times)
        ticks = np.rint(steps / unit)
        # stamps are float64 numbers, and their difference has the rounding of both
        rounding = _UNITS * np.spacing(_sizes(times)) + 1e-3 * unit
        off = np.abs(steps - ticks * unit)
        over = ticks <= 0 if zero else (off > rounding) & (ticks > 0)

        def fields(index: int) -> dict[str, Any]:
            step, becomes = float(steps[index - first]), float(ticks[index - first]) * unit
            ends = f"the segment that ends {when(rows, index)} lasts {step:.12g} s"
            text = f"{ends}, which becomes {becomes:.9g} s in whole units of {unit:g} s"
            hint = (
                "leave one of the two points out" if zero else f"put points at whole multiples of {unit:g} s"
            )
            return {
                "kind": "time" if zero else "quantisation",
                "value": step if zero else float(off[index - first]),
                "limit": unit if zero else float(rounding[index - first]),
                "message": text,
                "hint": hint,
            }

        self._note(rows, over, -steps if zero else off, first, fields)


def _sizes(times: Array) -> Array:
    """Return for each interval the larger magnitude of its two stamps."""
    return np.asarray(np.maximum(np.abs(times[1:]), np.abs(times[:-1])))


class LongestTime(RuleCheck):
    """Stamps, or durations from the first point, of at most `limit` seconds."""

    parameters: ClassVar[Mapping[str, Any]] = {"limit": None}

    _latest = 0.0

    def _take(self, rows: RecordedMotion) -> None:
        limit = self.number("limit")
        self._latest = max(self._latest, float(rows.t.max()))

        def fields(index: int) -> dict[str, Any]:
            return {
                "kind": "time",
                "value": self._latest,
                "limit": limit,
                "message": f"the row {when(rows, index)} is the first that lies beyond {limit:g} s",
                "hint": "split the motion",
            }

        self.note_times(replace(rows, move=None), rows.t > limit, -rows.t, fields)

    def findings(self) -> Iterator[Finding]:
        """Yield the first row beyond the limit, with the latest stamp as value."""
        yield from (replace(found, value=self._latest) for found in super().findings())


class FirstPoint(OfFirstRow):
    """The first point against the state in which the arm stands.

    A point at t = 0 is where the arm must stand already, within `tolerance`: what becomes of it otherwise
    says the text of the rule. With `later: curve`, a first point at t > 0 is reached by a curve
    from there, which must keep the limits of the robot.
    """

    parameters: ClassVar[Mapping[str, Any]] = {"tolerance": None, "later": "curve"}

    def _judge(self, rows: RecordedMotion) -> None:
        start = self.around.start
        if start is None or start.size != rows.q.shape[1]:
            self.unjudged = "where the arm stands before is not known: give a job, whose start says it"
        elif rows.t[0] > 0 and self.word("later") == "curve":
            self._approach(rows, start)
        else:
            self._jump(rows, start)

    def _jump(self, rows: RecordedMotion, start: Array) -> None:
        apart = rows.q[0] - start
        tolerance = self.number("tolerance") + largest_rounding(rows.q[:1], rows.resolution)

        def fields(index: int, joint: int) -> dict[str, Any]:
            return {
                "kind": "start",
                "value": float(apart[joint]),
                "limit": float(tolerance[joint]),
                "message": f"the first point, {when(rows, index)}, is {abs(float(apart[joint])):.6g} "
                f"{self.unit(joint)} from where {self.joint_name(rows, joint)} stands",
                "hint": "let the motion begin where the arm stands, or give its first point a later time",
            }

        self.note_row(rows, 0, np.abs(apart) > tolerance, np.abs(apart), fields)

    def _approach(self, rows: RecordedMotion, start: Array) -> None:
        from trajcli.consumers.executed import approach_excesses

        if self.around.limits is None:
            self.unjudged = "the limits of the robot are not known: give a job or a robot"
            return
        for joint, kind, value, limit, time in approach_excesses(rows, start, self.around.limits):
            fields = {
                "kind": kind,
                "value": value,
                "limit": limit,
                "message": f"on the curve from where the arm stands to the first point, {when(rows, 0)}, the "
                f"{kind} of {self.joint_name(rows, joint)} reaches {value:.6g} "
                f"{self.unit(joint, QUANTITIES.index(kind))} at t = {time:.6g} s, its limit is {limit:.6g}",
                "hint": "give the first point a later time, or let the motion begin where the arm stands",
            }
            self.note(rows, joint, 0, abs(value / limit) if limit else np.inf, fields)
