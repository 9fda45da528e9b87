"""Bounds of the joints' efforts for all t: samples, and a proof of what is between them.

On each piece of the curve nine rows give a polynomial of degree 8. What an effort does between the rows is
off it by at most f^(9) / 9! times 8! / 4 (h / 8)^9, and that derivative is bounded by the recursion of Newton
and Euler itself, run on power series that bound the sizes of its vectors: a turn multiplies by the
exponential of the joint's growth, a cross product by a product. The polynomial lies within the hull of its
control points, which closes in on it when it is divided.

Coulomb friction jumps where a joint turns back: pieces are cut there, and each of them has one sign.

Source: as of `trajcli/curves/bernstein.py` and `trajcli/kinematics/power_series.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trajcli.curves.bernstein import BETWEEN_NODES, NODES_DEGREE, control_points, hull_matrices
from trajcli.curves.extrema import critical_points
from trajcli.curves.piecewise import Array, derivative_coefficients, distinct, horner, taylor_shift
from trajcli.dynamics.newton_euler import InverseDynamics, direction
from trajcli.frozen import frozen
from trajcli.kinematics.power_series import growth, series_exponential, series_product

_CLOSE = 1e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-6  # N m or N: what is smaller need not be known so well
_HALVINGS, _DIVISIONS, _MOST = 12, 24, 1 << 16
_EDGE = 1e-12  # of a piece: a joint that turns back nearer to its end does so there
_STEPS = 60  # of the search of a stretch
_LEAST = 1e-9  # by which a stretch grows at least, from step to step
_PARTS = 4  # of an effort: dynamic, viscous, Coulomb, gravity


@frozen
class EffortPeak:
    """The largest effort of a joint over time in one direction; negative where it never acts in it.

    Attributes:
        value: The largest one sampled, N m or N.
        time: Where that is, s.
        most: What it does not exceed at any time.
        parts: What it consists of: M qdd + C qd, viscous friction, Coulomb friction, gravity.
    """

    value: float
    time: float
    most: float
    parts: tuple[float, float, float, float]

    @property
    def gravity(self) -> float:
        """The part of gravity."""
        return self.parts[3]

    @property
    def static(self) -> float:
        """What does not change with the speed of the motion: gravity and Coulomb friction."""
        return self.parts[2] + self.parts[3]


@frozen
class EffortSurvey:
    """Efforts at nine rows of each of P pieces, and how far off they may be between them.

    Attributes:
        span: Where the curve begins and ends, s.
        starts: Of the pieces, s, shape (P,); in no order.
        lengths: Of the pieces, s, shape (P,).
        parts: As those of `EffortPeak`, shape (P, 9, n, 4).
        rest: Of the sum, shape (P, n).
        limits: Bounds of the joints: the smaller magnitudes, for which efforts are to be known, shape (n,).
    """

    span: tuple[float, float]
    starts: Array
    lengths: Array
    parts: Array
    rest: Array
    limits: Array

    @property
    def room(self) -> Array:
        """How near to the efforts of each joint their bounds are to come, shape (n,)."""
        largest: Array = np.abs(self.parts.sum(axis=3)).max(axis=(0, 1), initial=0.0)
        return _CLOSE * np.maximum(np.minimum(largest, self.limits), _SMALL)

    def doubtful(self, limits: Array, room: float) -> Iterator[tuple[int, int, float]]:
        """Yield index, direction and magnitude of the limits that a first look at the hull does not prove.

        Args:
            limits: Lower and upper bounds, shape (n, 2).
            room: By what part of a limit it may be passed.
        """
        points = np.tensordot(hull_matrices()[0], self.parts.sum(axis=3), axes=(1, 1))
        high = (points.max(axis=0) + self.rest).max(axis=0, initial=0.0)
        low = (points.min(axis=0) - self.rest).min(axis=0, initial=0.0)
        for joint, (lower, upper) in enumerate(limits.tolist()):
            for sign, most, limit in ((1, high[joint], upper), (-1, -low[joint], -lower)):
                if not most <= limit * (1.0 + room):
                    yield joint, sign, limit

    def highest(self, stretch: float = 1.0) -> list[EffortPeak]:
        """Return the largest effort of each joint upwards.

        Args:
            stretch: How many times longer the motion is to last, at least 1.
        """
        return [self.peak(joint, 1, stretch) for joint in range(self.rest.shape[1])]

    def lowest(self, stretch: float = 1.0) -> list[EffortPeak]:
        """Return the same downwards: of the efforts with the other sign."""
        return [self.peak(joint, -1, stretch) for joint in range(self.rest.shape[1])]

    def peak(self, joint: int, sign: int, stretch: float = 1.0) -> EffortPeak:
        """Return the largest effort of one joint in one direction.

        Args:
            joint: Index.
            sign: 1 for upwards, -1 for the largest of the effort with the other sign.
            stretch: How many times longer the motion is to last, at least 1; times are of that as it is.
        """
        if not self.lengths.size:
            return EffortPeak(0.0, self.span[0], 0.0, (0.0, 0.0, 0.0, 0.0))
        weights = sign * np.array([stretch**-2.0, 1.0 / stretch, 1.0, 1.0])
        rows, rest = self.parts[:, :, joint] * weights, self.rest[:, joint]
        if not (np.isfinite(rows).all() and np.isfinite(rest).all()):
            return EffortPeak(np.inf, self.span[0], np.inf, (np.inf, 0.0, 0.0, 0.0))
        found = _largest(rows, rest, (self.starts, self.lengths), float(self.room[joint]))
        return replace(found, time=min(max(found.time, self.span[0]), self.span[1]))


@frozen
class EffortStretch:
    """By what factor a motion must last longer, so that the effort of a joint keeps its limit.

    Attributes:
        factor: At least 1; infinite where no stretch helps.
        peak: What decides: where the effort is largest in the motion so stretched, or nearly so; or where
            what does not change with the speed is over the limit.
    """

    factor: float
    peak: EffortPeak


def needed_stretch(survey: EffortSurvey, joint: int, sign: int, limit: float, room: float) -> EffortStretch:
    """Return the smallest stretch with which one joint keeps its limit in one direction.

    Gravity g and Coulomb friction stay, what inertia takes shrinks with the square of the stretch k and
    viscous friction v with k, so that k^2 = max over t of (effort - g) / (limit - g), without v. Where the
    effort is largest for one k, the limit gives the next one; these rise to the smallest.

    Args:
        survey: Of the motion.
        joint: Index.
        sign: 1 for upwards, -1 for downwards.
        limit: Above 0, N m or N.
        room: By what part of the limit it may be passed by what is proven.

    Source: Dinkelbach, On nonlinear fractional programming, Management Science 13 (1967).
    """
    factor = 1.0
    for _ in range(_STEPS):
        peak = survey.peak(joint, sign, factor)
        if peak.most <= limit * (1.0 + room):
            return EffortStretch(factor, peak)
        free = limit - peak.static
        inertial, viscous = peak.parts[0] * factor**2, peak.parts[1] * factor
        if not 0.0 < free < np.inf or not np.isfinite(peak.value):
            break
        root = viscous**2 + 4.0 * inertial * free
        if root < 0.0 or viscous + root**0.5 <= 0.0:
            break
        wanted = (viscous + root**0.5) / (2.0 * free)
        factor = max(wanted, factor * (1.0 + max(0.5 * room, _LEAST)))
    return EffortStretch(np.inf, peak)


def effort_survey(
    dynamics: InverseDynamics, breaks: Array, coefficients: Array, limits: Array | None = None
) -> EffortSurvey:
    """Return the efforts of a motion as what bounds them for all t.

    Args:
        dynamics: Of the arm with what it carries.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
        limits: Lower and upper bounds of the efforts, shape (n, 2), where bounds are needed for these.
    """
    long = np.diff(breaks) > 0
    starts, lengths = breaks[:-1][long], np.diff(breaks)[long]
    pieces = cut_where_joints_turn(dynamics, starts, lengths, coefficients[:, long])
    least = np.full(len(dynamics.links), np.inf) if limits is None else np.abs(limits).min(axis=1)
    span = float(breaks[0]), float(breaks[-1])
    known = replace(_known(dynamics, *pieces), span=span, limits=least)
    if not lengths.size:
        return known
    coefficients = pieces[2]
    for _ in range(_HALVINGS):
        coarse = (known.rest > known.room).any(axis=1) & np.isfinite(known.rest).all(axis=1)
        if not coarse.any():
            break
        half, early = known.lengths[coarse] / 2, coefficients[:, coarse]
        late = taylor_shift(early, np.broadcast_to(half[:, None], early.shape[1:]))
        both = np.concatenate([early, late], axis=1)
        begins = known.starts[coarse]
        more = _known(dynamics, np.concatenate([begins, begins + half]), np.tile(half, 2), both)
        coefficients = np.concatenate([coefficients[:, ~coarse], both], axis=1)
        known = replace(
            known,
            starts=np.concatenate([known.starts[~coarse], more.starts]),
            lengths=np.concatenate([known.lengths[~coarse], more.lengths]),
            parts=np.concatenate([known.parts[~coarse], more.parts]),
            rest=np.concatenate([known.rest[~coarse], more.rest]),
        )
    return known


def _known(dynamics: InverseDynamics, starts: Array, lengths: Array, coefficients: Array) -> EffortSurvey:
    """Return the efforts at nine rows of each piece, and how far off they may be between them."""
    inside = lengths[:, None] * np.linspace(0.0, 1.0, NODES_DEGREE + 1)
    q, qd, qdd = (
        horner(derivative_coefficients(coefficients, order)[:, :, None], inside[..., None])
        for order in range(3)
    )
    joints, unknown = dynamics.robot.joints, np.full(len(dynamics.links), np.inf)
    if not all(np.isfinite(values).all() for values in (q, qd, qdd)):
        nothing = np.full((*q.shape, _PARTS), np.inf)  # nothing is known of what no float64 holds
        return EffortSurvey((0.0, 0.0), starts, lengths, nothing, nothing[:, 0, :, 0], unknown)
    parts = np.empty((*q.shape, _PARTS))
    parts[..., 0], parts[..., 3] = dynamics.apart_from_gravity(q, qd, qdd)
    parts[..., 1] = qd * [joint.friction.viscous for joint in joints]
    signs = direction(qd[:, NODES_DEGREE // 2])
    parts[..., 2] = (signs * [joint.friction.coulomb for joint in joints])[:, None]
    n = NODES_DEGREE + 1
    highest = effort_majorants(dynamics, q[:, 0], growth(coefficients, lengths, n + 2))[n]
    rest = highest * BETWEEN_NODES * lengths[:, None] ** n
    return EffortSurvey((0.0, 0.0), starts, lengths, parts, rest, unknown)


def cut_where_joints_turn(
    dynamics: InverseDynamics, starts: Array, lengths: Array, coefficients: Array
) -> tuple[Array, Array, Array]:
    """Return starts, lengths and coefficients of pieces in which no joint with Coulomb friction turns back.

    Args:
        dynamics: Of the arm.
        starts: Of the pieces of the joints' curve, s, shape (P,).
        lengths: Of the pieces, above 0, s, shape (P,).
        coefficients: Of the pieces, (degree + 1, P, n), highest power first, from their starts on.
    """
    rubs = np.array([joint.friction.coulomb > 0.0 for joint in dynamics.robot.joints])
    if not rubs.any() or not lengths.size:
        return starts, lengths, coefficients
    rubbing = np.ascontiguousarray(coefficients[:, :, rubs])
    speeds = control_points(derivative_coefficients(rubbing, 1), lengths[:, None])
    turns = (speeds.min(axis=0) < 0) & (speeds.max(axis=0) > 0)
    if not turns.any():
        return starts, lengths, coefficients
    roots = critical_points(rubbing, lengths, (0,))[0]
    owners: list[int] = []
    cuts: list[float] = []
    for piece, length in enumerate(lengths.tolist()):
        inner = distinct(roots[:, piece, turns[piece]].reshape(-1))
        inner = inner[(inner > _EDGE * length) & (inner < (1.0 - _EDGE) * length)]
        cuts += [0.0, *inner.tolist()]
        owners += [piece] * (inner.size + 1)
    owner, begins = np.array(owners), np.array(cuts)
    last = np.append(owner[1:] != owner[:-1], True)
    ends = np.where(last, lengths[owner], np.append(begins[1:], 0.0))
    chosen = coefficients[:, owner]
    shifted = taylor_shift(chosen, np.broadcast_to(begins[:, None], chosen.shape[1:]))
    return starts[owner] + begins, ends - begins, shifted


def effort_majorants(dynamics: InverseDynamics, start: Array, rising: Array) -> Array:
    """Return bounds of |effort^(k)| / k! of each joint on whole pieces, shape (K, P, n).

    Coulomb friction, constant on a piece, counts only for k = 0, where it is left out.

    Args:
        dynamics: Of the arm with what it carries.
        start: Joint values (P, n) at the beginning of the pieces.
        rising: From `growth` of power series, (K + 2, P, n).
    """
    orders = np.arange(len(rising) - 2)[:, None, None]
    first = (orders + 1.0) * rising[1:-1]
    second = (orders + 1.0) * (orders + 2.0) * rising[2:]
    turns, levers, wrenches = _outward_majorants(dynamics, start, rising[:-2], first, second)
    result = np.empty(first.shape)
    force = moment = np.zeros(first.shape[:2])
    for i in reversed(range(first.shape[2])):
        force, moment = force + wrenches[i][0], moment + wrenches[i][1]
        joint = dynamics.robot.joints[i]
        result[:, :, i] = force if dynamics.links[i].prismatic else moment
        result[:, :, i] += joint.rotor * second[:, :, i] + joint.friction.viscous * first[:, :, i]
        moment = series_product(turns[i], moment + series_product(levers[i], force))
        force = series_product(turns[i], force)
    return result


def _outward_majorants(
    dynamics: InverseDynamics, start: Array, rising: Array, first: Array, second: Array
) -> tuple[list[Array], list[Array], list[tuple[Array, Array]]]:
    """Return bounds of each joint's turn, of the lever to it, and of the force and moment on its solid."""
    turns, levers, wrenches = [], [], []
    zero = np.zeros(first.shape[:2])
    spin, change, bend, rise = zero, zero, zero, zero.copy()
    rise[0] = np.linalg.norm(dynamics.robot.gravity)
    for i, link in enumerate(dynamics.links):
        lever, turn = zero.copy(), zero.copy()
        slide = (
            np.abs(link.sign * start[:, i] + link.d) if link.prismatic else np.full(len(start), abs(link.d))
        )
        if link.prismatic:
            slide += rising[0, :, i]
            lever[1:] = rising[1:, :, i]
        else:
            turn[1:] = rising[1:, :, i]
        turn = series_exponential(turn)
        square = len(link.screw) == 3  # without a tilt the slide is square to the lever
        lever[0] = np.hypot(link.screw[0], slide) if square else abs(link.screw[0]) + slide
        rise = rise + series_product(lever, bend)
        if link.prismatic:
            rise = rise + 2.0 * series_product(spin, first[:, :, i]) + second[:, :, i]
        rise, before = series_product(turn, rise), series_product(turn, spin)
        spin, change = before, series_product(turn, change)
        if not link.prismatic:
            spin = spin + first[:, :, i]
            change = change + second[:, :, i] + series_product(before, first[:, :, i])
        square_of_spin = series_product(spin, spin)
        bend = change + square_of_spin
        wrenches.append(_wrench_majorants(link.solid.sizes, rise, change, square_of_spin))
        turns.append(turn)
        levers.append(lever)
    return turns, levers, wrenches


def _wrench_majorants(
    solid: tuple[float, float, float, float], rise: Array, change: Array, spin: Array
) -> tuple[Array, Array]:
    """Return bounds of the force on a solid and of its moment; `spin` is that of its square."""
    mass, first, largest, uneven = solid
    return mass * rise + first * (change + spin), largest * change + uneven * spin + first * rise


def _largest(parts: Array, rest: Array, pieces: tuple[Array, Array], room: float) -> EffortPeak:
    """Return the peak of sums of parts at nine rows of pieces (P, 9, 4), off by `rest` (P,) between them.

    Args:
        parts: With their weights.
        rest: How far off the sums may be.
        pieces: Starts and lengths, each (P,).
        room: How close to the peak the hull must come.
    """
    hull, halves = hull_matrices()
    points, (starts, lengths) = hull @ parts, pieces
    value, time, most, chosen = -np.inf, float(starts.min()), -np.inf, points[0, 0]
    for _ in range(_DIVISIONS):
        sums = points.sum(axis=2)
        ends = sums[:, [0, -1]]
        piece, end = np.unravel_index(int(ends.argmax()), ends.shape)
        if ends[piece, end] > value:
            value, time = float(ends[piece, end]), float(starts[piece] + end * lengths[piece])
            chosen = points[piece, -1 if end else 0]
        over = sums.max(axis=1)
        wide = over > value + room
        if not wide.any() or len(points) > _MOST:
            return _peak(value, time, max(most, float((over + rest).max())), chosen)
        most = max(most, float((over + rest)[~wide].max(initial=-np.inf)))
        points = (halves[:, None] @ points[wide]).reshape(-1, *points.shape[1:])
        rest, lengths, starts = (
            np.tile(rest[wide], 2),
            np.tile(lengths[wide] / 2, 2),
            np.tile(starts[wide], 2),
        )
        starts[len(starts) // 2 :] += lengths[len(starts) // 2 :]
    return _peak(value, time, max(most, float((points.sum(axis=2).max(axis=1) + rest).max())), chosen)


def _peak(value: float, time: float, most: float, parts: Array) -> EffortPeak:
    dynamic, viscous, coulomb, gravity = parts.tolist()
    return EffortPeak(value, time, most, (dynamic, viscous, coulomb, gravity))
