"""Limits of velocity by position for all t, on the curve through recorded rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.checks.finding import at_time
from trajcli.checks.tolerances import exceeds
from trajcli.curves.approach import ROOM, allowed_speed, uses_of_pieces
from trajcli.curves.piecewise import Array, derivative_coefficients, horner
from trajcli.errors import Amount
from trajcli.frozen import frozen
from trajcli.judge.finding import Certainty, JudgedFinding
from trajcli.judge.intervals import Intervals, JointAxes
from trajcli.judge.worst import Worst
from trajcli.kinematics.robot import Limits

_HOPELESS = 1e4  # a stretch that is larger is none


def judge_velocity_by_position(
    window: Intervals, pieces: slice, limits: Limits, move: int, axes: JointAxes, worst: Worst
) -> None:
    """Add where joints move faster towards the end of their range than their distance from there allows.

    Args:
        window: The rows.
        pieces: Which ones; of a degree of one at least.
        limits: In force.
        move: Its index, -1 for none.
        axes: The joints.
        worst: What is added to.
    """
    if not limits.has_velocity_by_position or int(window.highest[pieces].max(initial=0)) < 1:
        return
    used, times = uses_of_pieces(window.coefficients[:, pieces], window.lengths[pieces], limits.approach, 1.0)
    found = np.nonzero(exceeds(used, 1.0))
    if not found[0].size:
        return
    fast = _fast_approaches(window, pieces, limits, found, (times[found], used[found]))
    certainties: tuple[Certainty, ...] = ("exceeded", "within rounding")
    for certainty in certainties:
        chosen = fast.certain == (certainty == "exceeded")
        worst.add(
            "velocity_by_position",
            move,
            fast.joint,
            fast.used,
            lambda k: fast.finding(window, axes, k),
            certainty=certainty,
            chosen=chosen,
        )


@frozen
class _FastApproaches:
    """Where joints approach the ends of their ranges too fast, m of them.

    Attributes:
        piece: Index of each, shape (m,).
        joint: Index of its joint.
        local: Seconds from the start of the piece.
        distance: To the end of the range, SI.
        speed: Signed, SI.
        bound: On it, with its sign.
        rounding: By how much the speed may be off beside its bound.
        used: Share of the bound.
    """

    piece: NDArray[np.intp]
    joint: NDArray[np.intp]
    local: Array
    distance: Array
    speed: Array
    bound: Array
    rounding: Array
    used: Array

    @property
    def certain(self) -> NDArray[np.bool_]:
        """Which of them rounding does not explain."""
        return np.asarray(np.abs(self.speed) - np.abs(self.bound) > self.rounding)

    def finding(self, window: Intervals, axes: JointAxes, k: int) -> JudgedFinding:
        """Return one of them as a finding."""
        piece, joint, local = int(self.piece[k]), int(self.joint[k]), float(self.local[k])
        value, limit = float(self.speed[k]), float(self.bound[k])
        time = float(window.t[piece]) + local
        ahead = Amount(abs(float(self.distance[k])), 0, joint, axes.dimension(joint))
        where = "beyond" if self.distance[k] < 0 else "before"
        speed = f"the velocity of {{joint}} reaches {{value}} {at_time(time)}, {{distance}} {where} the end"
        return JudgedFinding(
            rule="limit",
            severity="error",
            kind="velocity_by_position",
            joint=axes.names[joint],
            value=value,
            limit=limit,
            time=time,
            row=window.row_at(piece, local),
            factor=float(self.used[k]) if self.used[k] < _HOPELESS else None,
            rounding=float(self.rounding[k]),
            message=f"{speed} of its range, where its limit is {{limit}}",
            amounts={**axes.amounts(joint, 1, value, limit), "distance": ahead},
        )


def _fast_approaches(
    window: Intervals,
    pieces: slice,
    limits: Limits,
    found: tuple[NDArray[np.intp], ...],
    at: tuple[Array, Array],
) -> _FastApproaches:
    """Return the states in which limits are used most, from indices of uses, their times and sizes."""
    limited, (piece, column), (local, used) = limits.approach.limited, found, at
    joint, piece = limited[column % limited.size], piece + pieces.start
    chosen = window.coefficients[:, piece, joint]
    position, speed = horner(chosen, local), horner(derivative_coefficients(chosen, 1), local)
    rows = window.piece_rows(piece, joint, max(int(window.highest[piece].max()), 1))
    upwards = column < limited.size
    low, high = limits.position[joint].T
    distance = np.where(upwards, high - position, position - low)
    d, o = limits.approach.deceleration[joint], limits.approach.offset[joint]
    bound, roomy = (allowed_speed(distance + more, d, o) - ROOM for more in (0.0, rows.error(0)))
    bound = np.where(bound > ROOM, bound, 0.0)
    sign = np.where(upwards, 1.0, -1.0)
    rounding = rows.error(1) + np.maximum(roomy - bound, 0.0)
    return _FastApproaches(piece, joint, local, distance, speed, sign * bound, rounding, used)
