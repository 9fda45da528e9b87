"""Limits of position, velocity, acceleration and jerk of joints for all t, from the roots of derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import IntervalPeaks, Peaks, peaks_between
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts
from trajcli.findings import Finding, NamedJoints, at_time, excess_amounts
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot, share_of_limits
from trajcli.limits.kinds import (
    LimitedMove,
    LimitFamily,
    LimitSurvey,
)
from trajcli.limits.tolerances import BORDER_UNITS, exceeds
from trajcli.trajectory import State, Trajectory

_ROOM = 1e-10  # relative; a tenth of the tolerance of limits, so that rounding does not tip the later verdict


@frozen
class JointSurvey(LimitSurvey):
    """Extremes of the joints.

    Attributes:
        peaks: Of position, velocity, acceleration and jerk, times on the curve.
        limits: In force.
        moves: Whether the motion has a duration: without one there is no time to accelerate in.
    """

    peaks: tuple[Peaks, ...]
    limits: Limits
    moves: bool = True

    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield the worst excess of each joint and quantity."""
        for order in range(4 if self.moves else 2):
            bounds, extremes = self.limits.of_order(order), self.peaks[order]
            broken = exceeds(extremes.high, bounds[:, 1]) | exceeds(-extremes.low, -bounds[:, 0])
            for joint in np.flatnonzero(broken).tolist():
                yield self._worst(joints, order, joint, bounds[joint], origin)

    def excess(self) -> float:
        """Return by how much of a limit the joints are above it."""
        return float(share_of_limits([(p.low, p.high) for p in self.peaks], self.limits)) - (1 + _ROOM)

    def _worst(self, joints: NamedJoints, order: int, joint: int, bounds: Array, origin: float) -> Finding:
        """Return the use in the direction that is worse: by ratio, or by distance where it is a position."""
        extremes = self.peaks[order]
        low, high = extremes.low[joint], extremes.high[joint]
        below, above = (
            (bounds[0] - low, high - bounds[1]) if order == 0 else (low / bounds[0], high / bounds[1])
        )
        downwards = below > above
        value, limit = (low, bounds[0]) if downwards else (high, bounds[1])
        time = extremes.low_time[joint] if downwards else extremes.high_time[joint]
        return joint_excess(
            joints, order, joint, float(value), float(limit), float(time) - origin, still=not self.moves
        )


def joint_excess(
    joints: NamedJoints,
    order: int,
    joint: int,
    value: float,
    limit: float,
    time: float,
    *,
    still: bool = False,
) -> Finding:
    """Return where a joint is over a limit of a derivative of its position.

    Args:
        joints: All of them.
        order: 0 for the position.
        joint: Index.
        value: SI.
        limit: SI.
        time: s.
        still: Whether the motion has no duration that could be longer.
    """
    name = QUANTITIES[order]
    return Finding(
        kind=name,
        joint=joints.joint_names[joint],
        value=value,
        limit=limit,
        time=time,
        factor=float(value / limit) ** (1 / order) if order and not still else None,
        message=f"the {name} of {{joint}} reaches {{value}} {at_time(time)}, its limit is {{limit}}",
        amounts=excess_amounts(joints, joint, order, value, limit),
    )


class JointFamily(LimitFamily):
    """Position, velocity, acceleration and jerk of joints."""

    def survey(self, move: LimitedMove) -> JointSurvey:
        """Return the extremes of the joints in a move."""
        curve, span = move.trajectory.curve, move.span
        (peaks,) = _peaks(curve, np.array([(span.start, span.end)]))
        return JointSurvey(peaks, move.limits, span.duration > 0)

    def over_at_ends(self, robot: Robot | None, ends: Sequence[State], use: tuple[str, int, float]) -> bool:
        """Return whether the joint is over its limit where the move declares to begin or to end."""
        del robot
        name, joint, limit = use
        order = QUANTITIES.index(name)
        rates = [(state.velocity, state.acceleration)[order - 1] for state in ends if order < 3]
        values = [float(rate[joint]) for rate in rates]
        return any(abs(value) > abs(limit) and value * limit > 0 for value in values)

    def why_not_in_state(self, robot: Robot, state: State) -> tuple[str, Amounts] | None:
        """Return which joint is over a limit in a state."""
        for order, values in enumerate((state.position, state.velocity, state.acceleration)):
            low, high = robot.limits.of_order(order).T
            over = exceeds(values, high) | exceeds(-values, -low)
            if over.any():
                joint = int(np.flatnonzero(over)[0])
                value = float(values[joint])
                amounts: Amounts = {
                    "joint": robot.joint_names[joint],
                    "value": Amount(value, order, joint),
                    "limit": Amount(float(high[joint] if value > high[joint] else low[joint]), order, joint),
                }
                return (
                    f"{{joint}} {{verb}} with {QUANTITIES[order]} {{value}}, its limit is {{limit}}",
                    amounts,
                )
        return None


FAMILY = JointFamily()


def moves_over(peaks: IntervalPeaks, limits_by_move: Sequence[Limits]) -> list[int]:
    """Return which spans are over a limit; of those of no length some are no findings.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    if len(peaks) != len(limits_by_move):
        raise ValueError(f"{len(limits_by_move)} limits for {len(peaks)} moves")
    over = np.zeros(len(peaks), dtype=bool)
    which, different = numbered(limits_by_move)
    for order, extremes in enumerate(peaks.of_orders):
        bounds = np.array([limits.of_order(order) for limits in different])[which]
        broken = exceeds(extremes.high, bounds[:, :, 1]) | exceeds(-extremes.low, -bounds[:, :, 0])
        over |= broken.any(axis=1)
    return np.flatnonzero(over).tolist()


def numbered(limits_by_move: Sequence[Limits]) -> tuple[NDArray[np.intp], list[Limits]]:
    """Return which limits each move has, (m,), and these, each once: those of many moves are one."""
    numbers, different, which = dict[int, int](), list[Limits](), list[int]()
    for limits in limits_by_move:
        number = numbers.setdefault(id(limits), len(numbers))
        if number == len(different):
            different.append(limits)
        which.append(number)
    return np.array(which, dtype=np.intp), different


def peaks_by_move(trajectory: Trajectory) -> IntervalPeaks:
    """Return for each span the extremes of position, velocity, acceleration and jerk, times on the curve.

    At the border of two moves each is asked for its own side.
    """
    spans = trajectory.spans
    starts, ends = np.array([span.start for span in spans]), np.array([span.end for span in spans])
    return _peaks(trajectory.curve, np.stack([starts, ends], axis=1))


def _peaks(curve: PiecewisePolynomial, spans: Array) -> IntervalPeaks:
    return peaks_between(curve, _on_breaks(spans + curve.start, curve.breaks))


def _on_breaks(times: Array, breaks: Array) -> Array:
    """Return `times` with those that rounding put beside a break moved onto it."""
    after = np.clip(np.searchsorted(breaks, times), 1, breaks.size - 1)
    low, high = breaks[after - 1], breaks[after]
    nearest = np.where(times - low < high - times, low, high)
    rounding = BORDER_UNITS * np.spacing(np.abs(nearest))
    return np.where(np.abs(times - nearest) <= rounding, nearest, times)
