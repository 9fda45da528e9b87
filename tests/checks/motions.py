"""Motions to judge, and a judge that samples them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hermite_curves import hermite_pieces
from scipy.interpolate import PPoly
from scipy.optimize import minimize_scalar

from trajcli.curves.piecewise import PiecewisePolynomial, concatenate
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Span, State, Trajectory

KINDS = ("position", "velocity", "acceleration", "jerk")


def state(position: Sequence[float], velocity: float = 0.0, acceleration: float = 0.0) -> State:
    n = len(position)
    return State(np.array(position), np.full(n, velocity), np.full(n, acceleration))


def between(*positions: Sequence[float], duration: float = 2.0, conditions: int = 3) -> PiecewisePolynomial:
    """Return a polynomial from rest to rest for each pair of positions, as one curve."""
    derivatives = np.zeros((conditions, len(positions), len(positions[0])))
    derivatives[0] = positions
    return hermite_pieces(duration * np.arange(len(positions)), derivatives)


def trajectory(
    *moves: PiecewisePolynomial, start: State | None = None, end: State | None = None
) -> Trajectory:
    """Join moves; unless stated the arm rests where the first begins and the last ends."""
    curve = concatenate(moves)
    borders = np.concatenate([[0.0], np.cumsum([move.duration for move in moves])])
    spans = [Span(k, "quintic", float(borders[k]), float(borders[k + 1]), 2) for k in range(len(moves))]
    names = tuple(f"j{k + 1}" for k in range(curve.dimension))
    return Trajectory(
        curve=curve,
        joint_names=names,
        joint_types=("revolute",) * curve.dimension,
        spans=tuple(spans),
        start=start or state(curve.piece_ends()[0][0].tolist()),
        end=end or state(curve.piece_ends()[1][-1].tolist()),
    )


def limits(joints: int = 1, **bounds: float | tuple[float, float] | np.ndarray) -> Limits:
    """Return limits: a number bounds both directions of all joints, a pair one each; the rest is unlimited."""
    arrays = {}
    for kind in KINDS:
        bound = bounds.get(kind, np.inf)
        if np.ndim(bound) == 2:
            arrays[kind] = np.asarray(bound)
        else:
            arrays[kind] = np.tile((-bound, bound) if np.ndim(bound) == 0 else bound, (joints, 1))
    return Limits(**arrays)


def sampled_peaks(piece: PiecewisePolynomial, order: int) -> np.ndarray:
    """Return low and high of each joint over the one piece of a curve, (n, 2): samples and a refined search."""
    found = np.empty((piece.dimension, 2))
    t = np.linspace(0.0, piece.duration, 150)
    for joint in range(piece.dimension):
        function = PPoly(piece.coefficients[:, :, joint], [0.0, piece.duration]).derivative(order)
        for column, sign in enumerate((1.0, -1.0)):
            values = sign * function(t)
            best = values.min()
            around = np.concatenate([[np.inf], values, [np.inf]])
            valleys = np.flatnonzero((values <= around[:-2]) & (values <= around[2:]))
            for k in sorted(valleys, key=lambda k: values[k])[:3]:
                search = minimize_scalar(
                    lambda x, sign=sign, function=function: sign * function(x),
                    bounds=(t[max(k - 1, 0)], t[min(k + 1, t.size - 1)]),
                    method="bounded",
                    options={"xatol": 1e-9 * piece.duration},
                )
                best = min(best, search.fun)
            found[joint, column] = sign * best
    return found


def single_pieces(curve: PiecewisePolynomial) -> list[PiecewisePolynomial]:
    return [
        PiecewisePolynomial(curve.breaks[k : k + 2], curve.coefficients[:, k : k + 1])
        for k in range(curve.pieces)
    ]
