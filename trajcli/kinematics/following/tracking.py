"""Branch tracking by continuation: the first, coarse joint curve along a path.

Every step predicts the joint values from the derivatives at its beginning and corrects them by Newton's
method; its length follows from how far off the prediction was.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, horner
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.following.follower import Follower, LostError

_FIRST = 1 / 8  # of the first interval between breaks
_PROBES = np.array([0.2, 0.5, 0.8])  # of an interval: where the speed of the tool is looked at
_STILL = 1e-9  # lengths of the arm and rad: an interval with less is one step
_SAME = 1e-6  # of the largest: a derivative with less does not jump at a break
_SIDES: tuple[Side, Side] = ("left", "right")
_WHOLE = 0.7  # of what is left of an interval: a longer step takes all of it
_JUMPED = 0.15  # rad or m: a prediction that is off by more may have led to another branch
_BULGE = 10.0  # how many times nearer a curve through both ends of a step shall be than a prediction
_MANY = 32  # breaks of which neighbours may be taken together
_NEAR = 0.02  # lengths of the arm and rad: so little all of them together
_AIM = 0.05  # rad or m by which predictions may be off
_SHORTEST = 1e-6  # of the path: where so short a step fails, the joints race
_ORDER = 3  # of the error of the prediction, in the step


class StuckError(ValueError):
    """The joints cannot be followed any further.

    Attributes:
        s: How far the path could be followed.
        joints: Joint values there, shape (n,).
        rates: Their derivative along the path there, shape (n,).
    """

    def __init__(self, s: float, joints: Array, rates: Array) -> None:
        super().__init__(f"the joints cannot be followed beyond {s!r}")
        self.s = s
        self.joints = joints
        self.rates = rates


def track_branch(follower: Follower, breaks: Array) -> PiecewisePolynomial:
    """Return a coarse curve of joint values along the path, good enough as a guess everywhere on it.

    Args:
        follower: The arm; its start belongs to the first break.
        breaks: Shape (m,), increasing: where the second derivative may jump, and the ends.

    Raises:
        StuckError: When the joints cannot be followed to the end.
    """
    shortest = _SHORTEST * float(breaks[-1] - breaks[0])
    breaks, speeds = _together(breaks, _speeds(follower, breaks))
    nodes, pieces = [float(breaks[0])], list[Array]()
    travel = float(breaks[1] - breaks[0]) * _FIRST * float(speeds[0])
    state = _exact(follower, breaks[:1], "right", follower.start[None])[:, 0]
    jumps = _jumps(follower, breaks)
    for end, speed, jump in zip(breaks[1:].tolist(), speeds.tolist(), jumps.tolist(), strict=True):
        s = nodes[-1]
        if jump:
            state = _exact(follower, np.array([s]), "right", state[:1])[:, 0]
        while s < end:
            step = end - s if travel > _WHOLE * (end - s) * speed else travel / speed
            try:
                exact, deviation = _attempt(follower, s, step, state)
            except LostError:
                deviation = np.inf
            if deviation > _JUMPED:
                travel = 0.3 * step * speed
                if 0.3 * step < shortest:
                    raise StuckError(s, state[0], state[1])
                continue
            middle, last = exact[:, 0], exact[:, 1]
            pieces += [
                hermite_coefficients(*ends, np.array(0.5 * step))
                for ends in ((state, middle), (middle, last))
            ]
            half = s + 0.5 * step
            s = end if step == end - s else s + step
            nodes += [half, s]
            state = last
            largest = max(3.0, travel / (step * speed))
            travel = (
                step * speed * float(np.clip((_AIM / max(deviation, 1e-12)) ** (1 / _ORDER), 0.5, largest))
            )
    return PiecewisePolynomial(np.array(nodes), np.stack(pieces, axis=1))


def _speeds(follower: Follower, breaks: Array) -> Array:
    """Return how fast the tool moves and turns in each interval (m - 1,), in lengths of the arm and rad."""
    inner = (breaks[:-1, None] + np.diff(breaks)[:, None] * _PROBES).reshape(-1)
    rates = follower.reference_at(inner, "right").first / np.repeat([follower.length, 1.0], 3)
    speeds = np.abs(rates).sum(axis=1).reshape(-1, _PROBES.size).max(axis=1)
    return np.asarray(np.maximum(speeds, _STILL / np.diff(breaks)))


def _together(breaks: Array, speeds: Array) -> tuple[Array, Array]:
    """Return breaks (k,) and speeds (k - 1,), short neighbouring intervals taken together.

    Whatever the tool does in them it stays so near that one curve is a guess for all.
    """
    travels = speeds * np.diff(breaks)
    if breaks.size < _MANY:
        return breaks, speeds
    kept, gone = [0], 0.0
    for k, travel in enumerate(travels.tolist()):
        if k > kept[-1] and gone + travel > _NEAR:
            kept.append(k)
            gone = 0.0
        gone += travel
    firsts = np.array(kept)
    merged = np.append(breaks[firsts], breaks[-1])
    return merged, np.add.reduceat(travels, firsts) / np.diff(merged)


def _jumps(follower: Follower, breaks: Array) -> Flags:
    """Return for each interval (m - 1,) whether a derivative of the reference jumps where it begins."""
    left, right = (follower.reference_at(breaks[1:-1], side) for side in _SIDES)
    jumps = np.zeros(breaks.size - 2, dtype=bool)
    for name in ("first", "second", "aims"):
        one, other = getattr(left, name), getattr(right, name)
        jumps |= np.abs(one - other).max(axis=1, initial=0.0) > _SAME * np.abs([one, other]).max(initial=0.0)
    return np.append(False, jumps)


def _attempt(follower: Follower, s: float, step: float, state: Array) -> tuple[Array, float]:
    """Return what is exact half a step and a step further, (3, 2, n), and the deviation of the predictions.

    Half a step further the curve between the ends of the step is a prediction too: the joints may race there.
    """
    further = step * np.array([[0.5], [1.0]])
    predicted = state[0] + further * (state[1] + 0.5 * further * state[2])
    exact = _exact(follower, s + further[:, 0], "left", predicted)
    between = horner(hermite_coefficients(state, exact[:, 1], np.array(step)), np.array(0.5 * step))
    deviation = float(np.abs(exact[0] - predicted).max())
    return exact, max(deviation, _BULGE * float(np.abs(between - exact[0, 0]).max()))


def _exact(follower: Follower, s: Array, side: Side, guess: Array) -> Array:
    """Return joint values and two derivatives (3, N, n)."""
    values = follower.exact(s, side, guess)
    broken = ~np.isfinite(values).all(axis=(0, 2))
    if broken.any():
        raise LostError(s[broken])
    return values
