"""Reconstruction of the curve that a consumer makes of rows.

Between two rows a consumer holds the first, or joins both by the polynomial of least degree that has what
both rows state: positions (linear), velocities too (cubic), accelerations too (quintic).

Source: ros2_controllers 94e74de, joint_trajectory_controller/src/trajectory.cpp, for `jtc`: decided for each
segment by what both of its ends hold; and for `jtc-upsampling`: the cubic spline with continuous acceleration
and rest at both ends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import InputError

if TYPE_CHECKING:
    from trajcli.streams.recorded_motion import RecordedMotion

Interpolation = Literal["hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling"]
INTERPOLATIONS: tuple[Interpolation, ...] = ("hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling")
_STATED = {"hold": 0, "linear": 1, "cubic": 2, "quintic": 3}
_COLUMNS = ("positions", "velocities", "accelerations")


def reconstruct(motion: RecordedMotion, interpolate: Interpolation | None = None) -> PiecewisePolynomial:
    """Return the curve q(t) through the rows of a motion, over their time stamps as they are.

    Args:
        motion: Rows with finite, strictly increasing stamps, two at least.
        interpolate: How rows are joined; the highest that the columns allow unless given.

    Raises:
        InputError: When the motion lacks a column that this takes.
    """
    chosen = chosen_interpolation(interpolate, motion.qd is not None, motion.qdd is not None)
    return PiecewisePolynomial(
        motion.t, piece_coefficients(np.diff(motion.t), motion.q, motion.qd, motion.qdd, chosen)
    )


def chosen_interpolation(asked: str | None, velocities: bool, accelerations: bool) -> Interpolation:
    """Return how rows are joined: as asked, or by the highest degree that the columns allow.

    Raises:
        InputError: When the columns do not allow what is asked.
    """
    stated = 1 + velocities + (velocities and accelerations)
    if asked is None:
        return ("linear", "cubic", "quintic")[stated - 1]
    if asked not in INTERPOLATIONS:
        raise InputError(f"no such interpolation: {asked}", hint=f"one of {', '.join(INTERPOLATIONS)}")
    if _STATED.get(asked, 1) > stated:
        present = (True, velocities, accelerations)
        lacking = next(name for name, there in zip(_COLUMNS, present, strict=True) if not there)
        raise InputError(
            f"{asked} pieces need {lacking}, and there are none",
            hint=f"say --interpolate {('linear', 'cubic')[stated - 1]}, or leave it out",
        )
    return asked


def piece_coefficients(
    lengths: Array, q: Array, qd: Array | None, qdd: Array | None, interpolation: Interpolation
) -> Array:
    """Return the coefficients (degree + 1, N - 1, n) of the pieces between N rows, highest power first.

    Args:
        lengths: Of the intervals between rows, s, positive, shape (N - 1,).
        q: Positions, shape (N, n).
        qd: Velocities; under `jtc` NaN where a row states none.
        qdd: Accelerations, likewise.
        interpolation: One that these allow.
    """
    if _STATED.get(interpolation) == 0:
        return q[None, :-1].copy()
    if interpolation == "jtc-upsampling":
        from trajcli.curves.splines.cubic import clamped

        times = np.append(0.0, np.cumsum(lengths))
        standing = np.zeros(q.shape[1])
        return clamped(times, q, standing, standing).coefficients
    if interpolation == "jtc":
        return _by_segment(lengths, q, qd, qdd)
    rows = np.stack([rows for rows in (q, qd, qdd)[: _STATED[interpolation]] if rows is not None])
    return hermite_coefficients(rows[:, :-1], rows[:, 1:], lengths[:, None])


def _by_segment(lengths: Array, q: Array, qd: Array | None, qdd: Array | None) -> Array:
    """Return coefficients of pieces whose degree follows from what both of their ends state."""
    counts = stated_orders(q, qd, qdd)
    of_piece = np.minimum(counts[:-1], counts[1:])
    degree = 2 * int(of_piece.max(initial=1)) - 1
    coefficients = np.zeros((degree + 1, lengths.size, q.shape[1]))
    stated = [rows for rows in (q, qd, qdd) if rows is not None]
    for count in range(1, len(stated) + 1):
        chosen = np.flatnonzero(of_piece == count)
        if chosen.size:
            ends = [np.stack([rows[chosen + side] for rows in stated[:count]]) for side in (0, 1)]
            pieces = hermite_coefficients(ends[0], ends[1], lengths[chosen, None])
            coefficients[degree + 1 - 2 * count :, chosen] = pieces
    return coefficients


def stated_orders(q: Array, qd: Array | None, qdd: Array | None) -> NDArray[np.intp]:
    """Return for each row how many of position, velocity, acceleration it states, the first ones, (N,)."""
    counts = np.ones(len(q), dtype=np.intp)
    for order, rows in enumerate((qd, qdd), 1):
        if rows is not None:
            counts[(counts == order) & np.isfinite(rows).all(axis=1)] += 1
    return counts
