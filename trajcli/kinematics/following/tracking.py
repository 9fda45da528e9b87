"""The first, coarse joint curve along a path: from place to place, each predicted from the last."""

from __future__ import annotations

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, horner
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.following.follower import Follower, LostError

_FIRST = 1 / 8  # of the first stretch between breaks
_LOOKS = np.array([0.2, 0.5, 0.8])  # of a stretch: where it is asked how fast the tool moves
_STILL = 1e-9  # lengths of the arm and rad: a stretch with less is done at once
_SAME = 1e-6  # of the largest: a derivative with less does not jump at a break
_SIDES: tuple[Side, Side] = ("left", "right")
_REST = 0.7  # of what is left of a stretch: with a longer step it is done at once
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


def track_branch(follower: Follower, breaks: Array) -> PiecewisePolynomial:
    """Return a coarse curve of joint values along the path, good enough as a guess everywhere on it.

    Args:
        follower: The arm; its start belongs to the first break.
        breaks: Shape (m,), increasing: where the second derivative may jump, and the ends.

    Raises:
        StuckError: When the joints cannot be followed to the end.
    """
    shortest = _SHORTEST * float(breaks[-1] - breaks[0])
    nodes, pieces, paces = [float(breaks[0])], [], _paces(follower, breaks)
    motion = float(breaks[1] - breaks[0]) * _FIRST * float(paces[0])
    state = _exact(follower, breaks[:1], "right", follower.start[None])[:, 0]
    turns = _turns(follower, breaks)
    for end, pace, turned in zip(breaks[1:].tolist(), paces.tolist(), turns.tolist(), strict=True):
        place = nodes[-1]
        if turned:
            state = _exact(follower, np.array([place]), "right", state[:1])[:, 0]
        while place < end:
            step = end - place if motion > _REST * (end - place) * pace else motion / pace
            try:
                reached, off = _tried(follower, place, step, state)
                lost = None
            except LostError as error:
                off, lost = np.inf, error
            if off > _SURE:
                motion = 0.3 * step * pace
                if 0.3 * step < shortest:
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
            most = max(3.0, motion / (step * pace))
            motion = step * pace * float(np.clip((_AIM / max(off, 1e-12)) ** (1 / _ORDER), 0.5, most))
    return PiecewisePolynomial(np.array(nodes), np.stack(pieces, axis=1))


def _paces(follower: Follower, breaks: Array) -> Array:
    """Return how fast the tool moves and turns in each stretch (m - 1,), in lengths of the arm and rad."""
    inner = (breaks[:-1, None] + np.diff(breaks)[:, None] * _LOOKS).reshape(-1)
    rates = follower.demands(inner, "right").first / np.repeat([follower.length, 1.0], 3)
    paces = np.abs(rates).sum(axis=1).reshape(-1, _LOOKS.size).max(axis=1)
    return np.asarray(np.maximum(paces, _STILL / np.diff(breaks)))


def _turns(follower: Follower, breaks: Array) -> Flags:
    """Return for each stretch (m - 1,) whether a derivative of the demand jumps where it begins."""
    left, right = (follower.demands(breaks[1:-1], side) for side in _SIDES)
    jumps = np.zeros(breaks.size - 2, dtype=bool)
    for name in ("first", "second", "aims"):
        one, other = getattr(left, name), getattr(right, name)
        jumps |= np.abs(one - other).max(axis=1, initial=0.0) > _SAME * np.abs([one, other]).max(initial=0.0)
    return np.append(False, jumps)


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
