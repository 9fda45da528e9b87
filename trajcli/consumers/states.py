"""Rules about states: joints that are named, rest at the ends, ranges of values, and what a row may hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np

from trajcli.consumers.differences import at_period, largest_rounding, rounding_noise
from trajcli.consumers.rule_check import OfFirstRow, RuleCheck, when
from trajcli.curves.piecewise import Array
from trajcli.streams.recorded_motion import RecordedMotion
from trajcli.suggest import did_you_mean

__all__ = [
    "AtRest",
    "CompletePoints",
    "EffortAbsent",
    "EffortRange",
    "JointCount",
    "JointNames",
    "LastVelocity",
    "PositionRange",
]

_ROUNDING = 1e-9  # relative


class JointNames(OfFirstRow):
    """Names of joints that are not empty, unique, and those of the robot, none left out."""

    def _judge(self, rows: RecordedMotion) -> None:
        names, required = rows.message_joints or rows.joints, self.around.joints
        if names is None:
            self.unjudged = "the file names no joints"
            return
        for joint, name in enumerate(names):
            if not name.strip():
                self._note(rows, joint, f"joint {joint + 1} has no name", None)
            elif name in names[:joint]:
                self._note(rows, joint, f"the joint '{name}' stands twice", None)
            elif required is not None and name not in required:
                self._note(rows, joint, f"the robot has no joint '{name}'", did_you_mean(name, required))
        for name in required or ():
            if name not in names:
                self._note(rows, None, f"the joint '{name}' is missing", "a goal names all joints")

    def _note(self, rows: RecordedMotion, joint: int | None, message: str, hint: str | None) -> None:
        fields = {"kind": "joints", "value": 1.0, "limit": 0.0, "message": message, "hint": hint}
        self.note(rows, None if rows.message_joints else joint, 0, 1.0, fields)


class JointCount(OfFirstRow):
    """As many joints as the consumer moves, `count`."""

    parameters: ClassVar[Mapping[str, Any]] = {"count": None}

    def _judge(self, rows: RecordedMotion) -> None:
        count, wanted = rows.q.shape[1], int(self.number("count"))
        if count != wanted:
            text = f"the rows have {count} joint{'s' * (count != 1)}, and {wanted} are moved"
            fields = {"kind": "joints", "value": float(count), "limit": float(wanted), "message": text}
            self.note(rows, None, 0, 1.0, {**fields, "hint": "`trajcli profiles` lists other consumers"})


class CompletePoints(RuleCheck):
    """Numbers in every point: positions, and velocities and accelerations where there are any."""

    def _take(self, rows: RecordedMotion) -> None:
        for name, values in (("positions", rows.q), ("velocities", rows.qd), ("accelerations", rows.qdd)):
            if values is None:
                continue
            missing = ~np.isfinite(values)

            def fields(index: int, joint: int, name: str = name) -> dict[str, Any]:
                which = self.joint_name(rows, joint)
                return {
                    "kind": "position",
                    "value": 1.0,
                    "limit": 0.0,
                    "message": f"the point {when(rows, index)} has no number for {which} among its {name}",
                    "hint": f"give {name} in every point, or in none",
                }

            self.note_rows(rows, missing, missing.astype(np.float64), fields)


class LastVelocity(RuleCheck):
    """Velocities of the last point of magnitude at most `limit`."""

    parameters: ClassVar[Mapping[str, Any]] = {"limit": None}

    _last: RecordedMotion | None = None

    def _take(self, rows: RecordedMotion) -> None:
        self._last = rows

    def _finish(self) -> None:
        rows, limit = self._last, self.number("limit")
        if rows is None or rows.qd is None:
            return
        last = rows.qd[-1]

        def fields(index: int, joint: int) -> dict[str, Any]:
            value = float(last[joint])
            return {
                "kind": "end",
                "value": value,
                "limit": limit,
                "message": f"the last velocity of {self.joint_name(rows, joint)} is {value:.6g} "
                f"{self.unit(joint, 1)}, {when(rows, index)}; at most {limit:.3g} is accepted",
                "hint": "end at rest, with a last velocity of exactly 0.0",
            }

        self.note_row(rows, rows.t.size - 1, np.abs(last) > limit, np.abs(last), fields)


class EffortAbsent(RuleCheck):
    """Points without efforts."""

    def _take(self, rows: RecordedMotion) -> None:
        if rows.tau is None:
            return
        given = np.asarray(np.isfinite(rows.tau).any(axis=1))

        def fields(index: int) -> dict[str, Any]:
            return {
                "kind": "effort",
                "value": float(rows.tau[index].size) if rows.tau is not None else 0.0,
                "limit": 0.0,
                "message": f"the point {when(rows, index)} has efforts",
                "hint": "leave `effort` empty in every point, in a job `tau` out of `columns`",
            }

        self.note_times(rows, given, -rows.t, fields)


class EffortRange(RuleCheck):
    """Efforts of magnitude at most `limit`, by joint."""

    parameters: ClassVar[Mapping[str, Any]] = {"limit": None}

    def _take(self, rows: RecordedMotion) -> None:
        values = rows.tau
        if values is None:
            self.unjudged = "the file has no efforts"
            return
        if not self.fits("limit", values.shape[1]):
            return
        limit = self.vector("limit", values.shape[1])
        share = np.abs(values) / limit

        def fields(index: int, joint: int) -> dict[str, Any]:
            value = float(values[index, joint])
            return {
                "kind": "effort",
                "value": value,
                "limit": float(np.copysign(limit[joint], value)),
                "message": f"the effort of {self.joint_name(rows, joint)} is {value:.6g} "
                f"{self.effort_unit(joint)} {when(rows, index)}, and {limit[joint]:.6g} is recommended",
            }

        self.note_rows(rows, share > 1 + _ROUNDING, share, fields)


class PositionRange(RuleCheck):
    """Positions inside `lower` and `upper`, by joint."""

    parameters: ClassVar[Mapping[str, Any]] = {"lower": None, "upper": None}

    def _take(self, rows: RecordedMotion) -> None:
        count = rows.q.shape[1]
        if not self.fits("lower", count):
            return
        ranges = self.vector("lower", count), self.vector("upper", count)
        beyond = np.maximum(ranges[0] - rows.q, rows.q - ranges[1])

        def fields(index: int, joint: int) -> dict[str, Any]:
            value = float(rows.q[index, joint])
            limit = float(ranges[int(value >= ranges[1][joint])][joint])
            return {
                "kind": "position",
                "value": value,
                "limit": limit,
                "message": f"the position of {self.joint_name(rows, joint)} is {value:.9g} "
                f"{self.unit(joint)} {when(rows, index)}, its range ends at {limit:.9g}",
            }

        self.note_rows(rows, beyond >= 0, beyond, fields)


class AtRest(RuleCheck):
    """Rest `at` the start or the end: velocity and acceleration are zero.

    Of columns for these, up to `velocity` and `acceleration` and their rounding. Without them of differences
    of the first or last positions, up to what one `period` at the limit of `jerk` leaves; not judged where
    these stand further apart.
    """

    parameters: ClassVar[Mapping[str, Any]] = {
        "at": None,
        "period": None,
        "jerk": None,
        "velocity": 1e-6,
        "acceleration": 1e-3,
    }

    _rows: RecordedMotion | None = None
    _near: Array | None = None
    """Up to three rows, the stamp before the positions."""

    def _take(self, rows: RecordedMotion) -> None:
        if self.word("at") == "start":
            before = np.empty((0, 1 + rows.q.shape[1])) if self._near is None else self._near
            near = np.column_stack([rows.t, rows.q])[: 3 - len(before)]
            self._rows, self._near = self._rows or rows, np.concatenate([before, near])
            return
        near = np.column_stack([rows.t[-3:], rows.q[-3:]])
        if self._near is not None and len(near) < 3:
            near = np.concatenate([self._near, near])[-3:]
        self._rows, self._near = rows, near

    def _finish(self) -> None:
        rows, near = self._rows, self._near
        if rows is None or near is None or not self.fits("jerk", rows.q.shape[1]):
            return
        index = 0 if self.word("at") == "start" else rows.t.size - 1
        for order, kind, values, allowed, method in self._rates(rows, near, index):
            size = np.abs(values) / np.maximum(allowed, 1e-300)

            def fields(
                index: int,
                joint: int,
                order: int = order,
                kind: str = kind,
                values: Array = values,
                allowed: Array = allowed,
                method: str = method,
            ) -> dict[str, Any]:
                return {
                    "kind": self.word("at"),
                    "value": float(values[joint]),
                    "limit": float(allowed[joint]),
                    "method": method,
                    "message": f"at its {self.word('at')}, {when(rows, index)}, "
                    f"{self.joint_name(rows, joint)} has the {kind} {float(values[joint]):.6g} "
                    f"{self.unit(joint, order)}, and is not at rest",
                }

            self.note_row(rows, index, np.abs(values) > allowed, size, fields)

    def _rates(
        self, rows: RecordedMotion, near: Array, index: int
    ) -> Iterator[tuple[int, str, Array, Array, str]]:
        """Yield order, name, values, what is allowed and how it is judged, of velocity and acceleration."""
        period, resolution = self.number("period"), rows.resolution
        jerk = self.vector("jerk", rows.q.shape[1])
        columns = ((1, "velocity", rows.qd, resolution.qd), (2, "acceleration", rows.qdd, resolution.qdd))
        for order, kind, column, rounding in columns:
            if column is not None:
                yield order, kind, column[index], self.number(kind) + rounding, "exact"
                continue
            if len(near) <= order:
                continue
            if not at_period(near[:, 0], period).all():
                self.unjudged = f"its rows there are not {period:g} s apart, as its consumer takes them"
                return
            values = np.diff(near[:, 1:], order, axis=0) / period**order
            # from rest, or to it: jerk h^2 / 6 and jerk h are what differences make of one period
            left = jerk * (period**2 / 6 if order == 1 else period)
            noise = rounding_noise(order, largest_rounding(near[:, 1:], resolution), period)
            first = values[0] if self.word("at") == "start" else values[-1]
            yield order, kind, first, left * (1 + _ROUNDING) + noise, "differences"
