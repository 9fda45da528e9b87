"""The first, coarse joint curve along a path: from place to place, each predicted from the last."""

from __future__ import annotations

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, horner
from trajcli.kinematics.following.follower import Follower, LostError

_FIRST = 1 / 8  # of a stretch between breaks
_SURE = 0.15  # rad or m: a prediction that is off by more may have led to another branch
_BULGE = 10.0  # times that a curve through both ends of a step is to be nearer than a prediction from one
_AIM = 0.05  # rad or m by which predictions may be off
_SHORTEST = 1e-6  # of the path: where so little a step is not sure, the joints race
_ORDER = 3  # of the error of the prediction, in the step


class StuckError(ValueError):
    """The joints cannot be followed any further.

    Attributes:
        place: How far the path could be followed.
        joints: Joint values there, shape (n,).
        rates: Their derivative along the path there, shape (n,).
        lost: Why the next step failed, where no joint values met the target; None where they jumped.
    """

    def __init__(self, place: float, joints: Array, rates: Array, lost: LostError | None) -> None:
        super().__init__(f"the joints cannot be followed beyond {place!r}")
        self.place = place
        self.joints = joints
        self.rates = rates
        self.lost = lost


def track(follower: Follower, breaks: Array) -> PiecewisePolynomial:
    """Return a coarse curve of joint values along the path, good enough as a guess everywhere on it.

    Args:
        follower: The arm; its start belongs to the first break.
        breaks: Shape (m,), increasing: where the second derivative may jump, and the ends.

    Raises:
        StuckError: When the joints cannot be followed to the end.
    """
    shortest = _SHORTEST * float(breaks[-1] - breaks[0])
    nodes, pieces, q = [float(breaks[0])], [], follower.start
    for end in breaks[1:].tolist():
        place, step = nodes[-1], (end - nodes[-1]) * _FIRST
        state = _exact(follower, np.array([place]), "right", q[None])[:, 0]
        while place < end:
            step = min(step, end - place)
            if step > 0.7 * (end - place):
                step = end - place
            try:
                reached, off = _tried(follower, place, step, state)
                lost = None
            except LostError as error:
                off, lost = np.inf, error
            if off > _SURE:
                step *= 0.3
                if step < shortest:
                    raise StuckError(place, state[0], state[1], lost)
                continue
            middle, last = reached[:, 0], reached[:, 1]
            pieces += [
                hermite_coefficients(*ends, np.array(0.5 * step))
                for ends in ((state, middle), (middle, last))
            ]
            half = place + 0.5 * step
            place = end if step == end - place else place + step
            nodes += [half, place]
            state = last
            step *= float(np.clip((_AIM / max(off, 1e-12)) ** (1 / _ORDER), 0.5, 3.0))
        q = state[0]
    return PiecewisePolynomial(np.array(nodes), np.stack(pieces, axis=1))


def _tried(follower: Follower, place: float, step: float, state: Array) -> tuple[Array, float]:
    """Return what is exact half a step and a step further, (3, 2, n), and how far off the guesses of it were.

    Half a step further the curve between the ends of the step is a guess too: the joints may race there.
    """
    further = step * np.array([[0.5], [1.0]])
    predicted = state[0] + further * (state[1] + 0.5 * further * state[2])
    reached = _exact(follower, place + further[:, 0], "left", predicted)
    between = horner(hermite_coefficients(state, reached[:, 1], np.array(step)), np.array(0.5 * step))
    off = float(np.abs(reached[0] - predicted).max())
    return reached, max(off, _BULGE * float(np.abs(between - reached[0, 0]).max()))


def _exact(follower: Follower, places: Array, side: Side, guess: Array) -> Array:
    """Return joint values and two derivatives (3, N, n)."""
    values = follower.exact(places, side, guess)
    broken = ~np.isfinite(values).all(axis=(0, 2))
    if broken.any():
        raise LostError(places[broken], guess[broken][0], (0.0, 0.0))
    return values
