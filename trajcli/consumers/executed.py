"""Rules about the curve that a consumer runs: steps of velocity, points in whole numbers, the approach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np

from trajcli.consumers.rule_check import RuleCheck, when
from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.kinematics.robot import QUANTITIES, Limits
from trajcli.limits.tolerances import exceeds
from trajcli.streams.recorded_motion import RecordedMotion

__all__ = ["IntegerRange", "QuantisedCurve", "RoundedSegments", "VelocitySteps"]

_ROUNDING = 1e-9  # relative


class VelocitySteps(RuleCheck):
    """Velocities that step from one straight line to the next, where points have positions only."""

    _before: tuple[Array, Array] | None = None
    _slope: Array | None = None

    def _take(self, rows: RecordedMotion) -> None:
        if rows.qd is not None:
            return
        t, q = rows.t, rows.q
        if self._before is not None:
            t, q = np.append(self._before[0], t), np.concatenate([self._before[1], q])
        self._before = t[-1:], q[-1:]
        lasting = np.diff(t) > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes = np.where(lasting[:, None], np.diff(q, axis=0) / np.diff(t)[:, None], 0.0)
        if not len(slopes):
            self._last = rows
            return
        # the arm is at rest before the first point
        earlier = np.zeros((1, q.shape[1])) if self._slope is None else self._slope
        steps = np.diff(np.concatenate([earlier, slopes]), axis=0)
        self._slope = slopes[-1:]
        # the line that begins at a row: the last row of the block before is the first of these
        self._note_steps(rows, steps, len(q) - len(rows.q))

    def _finish(self) -> None:
        if self._last is not None and self._slope is not None:
            rows = self._last
            steps = np.zeros_like(rows.q)
            steps[-1] = -self._slope[0]
            self._note_steps(rows, steps, 0)

    _last: RecordedMotion | None = None

    def _note_steps(self, rows: RecordedMotion, steps: Array, carried: int) -> None:
        previous, self._last = self._last, rows
        if carried and previous is not None:
            of_last = np.zeros_like(previous.q)
            of_last[-1] = steps[0]
            self._note_block(previous, of_last)
        of_block = np.zeros_like(rows.q)
        own = steps[carried:][: len(rows.q)]
        of_block[: len(own)] = own
        self._note_block(rows, of_block)

    def _note_block(self, rows: RecordedMotion, steps: Array) -> None:
        fastest = np.abs(steps).max(initial=0.0)

        def fields(index: int, joint: int) -> dict[str, Any]:
            step = float(steps[index, joint])
            return {
                "kind": "jump",
                "value": step,
                "limit": 0.0,
                "message": f"the velocity of {self.joint_name(rows, joint)} steps by {step:.6g} "
                f"{self.unit(joint, 1)} {when(rows, index)}, as straight lines are run from point to point",
                "hint": "give velocities, and accelerations where there are any, in every point",
            }

        self.note_rows(rows, np.abs(steps) > _ROUNDING * max(fastest, 1.0), np.abs(steps), fields)


class IntegerRange(RuleCheck):
    """Values that are sent as whole numbers of `unit`, of magnitude at most `largest`."""

    parameters: ClassVar[Mapping[str, Any]] = {"unit": None, "largest": None}

    def _take(self, rows: RecordedMotion) -> None:
        limit = self.number("unit") * self.number("largest")
        for order, values in enumerate((rows.q, rows.qd, rows.qdd)):
            if values is None:
                continue

            def fields(index: int, joint: int, order: int = order, values: Array = values) -> dict[str, Any]:
                value, name = float(values[index, joint]), QUANTITIES[order]
                return {
                    "kind": name,
                    "value": value,
                    "limit": float(np.copysign(limit, value)),
                    "message": f"the {name} of {self.joint_name(rows, joint)}, {value:.6g} "
                    f"{self.unit(joint, order)} {when(rows, index)}, is beyond {limit:.9g}, the largest "
                    "number that can be sent",
                }

            self.note_rows(rows, np.abs(values) > limit, np.abs(values), fields)


class QuantisedCurve(RuleCheck):
    """Points as whole numbers of `unit`, segments as whole numbers of `time_unit`: how far that moves them.

    Durations are rounded one by one, so that the stamps drift apart: a point comes early or late by that, and
    the arm is off by its velocity times that, beside the rounding of the position. At most `tolerance`.
    """

    parameters: ClassVar[Mapping[str, Any]] = {"unit": None, "time_unit": None, "tolerance": None}

    _before: tuple[float, float, Array] | None = None
    _first: float | None = None

    def _take(self, rows: RecordedMotion) -> None:
        unit, time_unit = self.number("unit"), self.number("time_unit")
        before = self._before or (float(rows.t[0]), 0.0, rows.q[0])
        steps = np.diff(rows.t, prepend=before[0])
        ticks = before[1] + np.cumsum(np.rint(steps / time_unit))
        self._first = float(rows.t[0]) if self._first is None else self._first
        late = ticks * time_unit - (rows.t - self._first)
        velocity = rows.qd
        if velocity is None:
            moved = np.diff(rows.q, axis=0, prepend=before[2][None])
            with np.errstate(divide="ignore", invalid="ignore"):
                velocity = np.where(steps[:, None] > 0, moved / steps[:, None], 0.0)
        self._before = float(rows.t[-1]), float(ticks[-1]), rows.q[-1]
        off = np.abs(np.rint(rows.q / unit) * unit - rows.q) + np.abs(velocity * late[:, None])
        tolerance = self.number("tolerance")

        def fields(index: int, joint: int) -> dict[str, Any]:
            apart = f"{abs(float(late[index])):.3g} s {'late' if late[index] > 0 else 'early'}"
            return {
                "kind": "quantisation",
                "value": float(off[index, joint]),
                "limit": tolerance,
                "message": f"in whole units of {unit:g} and {time_unit:g} s the point {when(rows, index)} "
                f"comes {apart}, and {self.joint_name(rows, joint)} is "
                f"{float(off[index, joint]):.3g} {self.unit(joint)} off",
                "hint": f"put points at whole multiples of {time_unit:g} s",
            }

        self.note_rows(rows, off > tolerance, off, fields)


class RoundedSegments(RuleCheck):
    """Points as whole numbers of `unit`, segments of `time_unit`: what acceleration this makes between two.

    Where two points that are h apart are off against each other by e, a quintic has 10 e / (sqrt(3) h^2) of
    it, a cubic 6 e / h^2. At most `share` of the robot's limit.
    """

    parameters: ClassVar[Mapping[str, Any]] = {"unit": None, "time_unit": None, "share": None}

    _before: tuple[float, Array] | None = None

    def _take(self, rows: RecordedMotion) -> None:
        limits, unit, time_unit = self.around.limits, self.number("unit"), self.number("time_unit")
        if rows.qd is None or limits is None or len(limits.acceleration) != rows.q.shape[1]:
            self.unjudged = (
                None if rows.qd is None else "the limits of the robot are not known: give a job or a robot"
            )
            return
        bound = np.abs(limits.acceleration).min(axis=1)
        time, position = self._before or (float(rows.t[0]), rows.q[0])
        q = np.concatenate([position[None], rows.q])
        self._before = float(rows.t[-1]), rows.q[-1]
        steps = np.diff(rows.t, prepend=time)[:, None]
        lasts = np.rint(steps / time_unit) * time_unit
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.abs(np.diff(np.rint(q / unit), axis=0) * unit - np.diff(q, axis=0) * (lasts / steps))
            made = (6.0 if rows.qdd is None else 10 / 3**0.5) * off / lasts**2
        made = np.where(lasts > 0, made, 0.0)  # a segment that becomes none is another rule's

        def fields(index: int, joint: int) -> dict[str, Any]:
            value = float(made[index, joint])
            return {
                "kind": "quantisation",
                "quantity": "acceleration",
                "value": value,
                "limit": self.number("share") * float(bound[joint]),
                "message": f"the segment that ends {when(rows, index)} lasts {float(steps[index, 0]):.6g} s: "
                f"in whole units of {unit:g} that makes an acceleration of {self.joint_name(rows, joint)} "
                f"of up to {value:.4g} {self.unit(joint, 2)}, its limit is {float(bound[joint]):.6g}",
                "hint": "put points further apart, as those of a rate are",
            }

        self.note_rows(rows, made > self.number("share") * bound, made / bound, fields)


def approach_excesses(
    rows: RecordedMotion, start: Array, limits: Limits
) -> Iterator[tuple[int, str, float, float, float]]:
    """Yield where the curve from rest at `start` to the first point exceeds limits.

    The curve is a straight line where the points have positions only, a cubic with velocities, and a quintic
    with accelerations.

    Args:
        rows: They begin at a time above 0, when the arm is at `start`.
        start: Shape (n,).
        limits: Of n joints.

    Yields:
        Index of the joint, quantity, value, limit, and the time, s.
    """
    curve = _approach(rows, start)
    for order, extremes in enumerate(peaks(curve)):
        bounds = limits.of_order(order)
        for joint in range(start.size):
            ends = (
                (-extremes.low[joint], -bounds[joint, 0], extremes.low_time[joint], -1.0),
                (extremes.high[joint], bounds[joint, 1], extremes.high_time[joint], 1.0),
            )
            for value, bound, time, sign in ends:
                if exceeds(value, bound):
                    found = sign * float(value), sign * float(bound), float(time)
                    yield joint, QUANTITIES[order], *found


def _approach(rows: RecordedMotion, start: Array) -> PiecewisePolynomial:
    """Return the curve from rest at `start` to the first of the rows."""
    time, change = float(rows.t[0]), rows.q[0] - start
    end = [change]
    for values in (rows.qd, rows.qdd):
        if values is None:
            break
        end.append(values[0])
    # powers from the first free one on: those below are zero, as the arm is at rest
    count = len(end)
    powers = np.arange(count, 2 * count)
    matrix = np.array(
        [
            [np.prod(power - np.arange(order)) * time ** (power - order) for power in powers]
            for order in range(count)
        ]
    )
    solved = np.linalg.solve(matrix, np.stack(end))
    coefficients = np.zeros((2 * count, start.size))
    coefficients[powers] = solved
    coefficients[0] = start
    return PiecewisePolynomial(np.array([0.0, time]), coefficients[::-1][:, None, :])
