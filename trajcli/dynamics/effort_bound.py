"""Bounds of the joints' efforts for all t, from nine nodes of each piece of a motion.

The ninth derivative of an effort is bounded by the recursion of Newton and Euler itself, run on power series
that bound the sizes of its vectors: a rotation multiplies by the exponential of the joint's growth, a cross
product by a product.

Coulomb friction jumps where a joint turns back: pieces are cut there, and each of them has one sign.

Source: as of `trajcli/curves/node_bound.py` and `trajcli/geometry/power_series.py`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trajcli.curves.extrema import critical_points
from trajcli.curves.node_bound import NODES_DEGREE, NodeSurvey, at_nodes, hull_matrices, node_survey
from trajcli.curves.piecewise import Array, control_points, derivative_coefficients, distinct, taylor_shift
from trajcli.dynamics.newton_euler import REST, InverseDynamics, direction
from trajcli.frozen import frozen
from trajcli.geometry.power_series import growth, series_exponential, series_product

_CLOSE = 1e-7  # relative: of the remainder, and of the hull
_SMALL = 1e-6  # N m or N: what is smaller need not be known so well
_HALVINGS = 12
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
        upper_bound: What it does not exceed at any time.
        parts: What it consists of: M qdd + C qd, viscous friction, Coulomb friction, gravity.
    """

    value: float
    time: float
    upper_bound: float
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
    """Efforts of a motion at the nodes of its pieces, and how far off they may be between them.

    Attributes:
        span: Where the curve begins and ends, s.
        nodes: Values of n joints, with the parts of `EffortPeak`; remainders of their sums.
        limits: Bounds of the joints: the smaller magnitudes, for which efforts are to be known, shape (n,).
    """

    span: tuple[float, float]
    nodes: NodeSurvey
    limits: Array

    def doubtful(self, limits: Array, slack: float) -> Iterator[tuple[int, int, float]]:
        """Yield index, direction and magnitude of the limits that a first look at the hull does not prove.

        Args:
            limits: Lower and upper bounds, shape (n, 2).
            slack: By what part of a limit it may be passed.
        """
        points = np.tensordot(hull_matrices()[0], self.nodes.values.sum(axis=3), axes=(1, 1))
        remainder = self.nodes.remainder
        high = (points.max(axis=0) + remainder).max(axis=0, initial=0.0)
        low = (points.min(axis=0) - remainder).min(axis=0, initial=0.0)
        for joint, (lower, upper) in enumerate(limits.tolist()):
            for sign, upper_bound, limit in ((1, high[joint], upper), (-1, -low[joint], -lower)):
                if not upper_bound <= limit * (1.0 + slack):
                    yield joint, sign, limit

    def highest(self, stretch: float = 1.0) -> list[EffortPeak]:
        """Return the largest effort of each joint upwards.

        Args:
            stretch: How many times longer the motion is to last, at least 1.
        """
        return [self.peak(joint, 1, stretch) for joint in range(self.limits.size)]

    def lowest(self, stretch: float = 1.0) -> list[EffortPeak]:
        """Return the same downwards: of the efforts with the other sign."""
        return [self.peak(joint, -1, stretch) for joint in range(self.limits.size)]

    def peak(self, joint: int, sign: int, stretch: float = 1.0) -> EffortPeak:
        """Return the largest effort of one joint in one direction.

        Args:
            joint: Index.
            sign: 1 for upwards, -1 for the largest of the effort with the other sign.
            stretch: How many times longer the motion is to last, at least 1; times are of that as it is.
        """
        if not self.nodes.lengths.size:
            return EffortPeak(0.0, self.span[0], 0.0, (0.0, 0.0, 0.0, 0.0))
        weights = sign * np.array([stretch**-2.0, 1.0 / stretch, 1.0, 1.0])
        slack = float(_slack(self.nodes.values, self.limits)[joint])
        weighted = replace(self.nodes, values=self.nodes.values * weights)
        found = weighted.largest(joint, _sum, lambda _: slack)
        dynamic, viscous, coulomb, gravity = found.entries.tolist()
        time = min(found.time, self.span[1])
        return EffortPeak(found.value, time, found.upper_bound, (dynamic, viscous, coulomb, gravity))


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


def needed_stretch(survey: EffortSurvey, joint: int, sign: int, limit: float, slack: float) -> EffortStretch:
    """Return the smallest stretch with which one joint keeps its limit in one direction.

    Gravity g and Coulomb friction stay, what inertia takes shrinks with the square of the stretch k and
    viscous friction v with k, so that k^2 = max over t of (effort - g) / (limit - g), without v. Where the
    effort is largest for one k, the limit gives the next one; these rise to the smallest.

    Args:
        survey: Of the motion.
        joint: Index.
        sign: 1 for upwards, -1 for downwards.
        limit: Above 0, N m or N.
        slack: By what part of the limit it may be passed by what is proven.

    Source: Dinkelbach, On nonlinear fractional programming, Management Science 13 (1967).
    """
    factor = 1.0
    for _ in range(_STEPS):
        peak = survey.peak(joint, sign, factor)
        if peak.upper_bound <= limit * (1.0 + slack):
            return EffortStretch(factor, peak)
        free = limit - peak.static
        inertial, viscous = peak.parts[0] * factor**2, peak.parts[1] * factor
        if not free > 0.0 or not np.isfinite(peak.value):
            break
        if peak.upper_bound - peak.value > 2.0 * limit:
            break  # of a motion that its pieces do not resolve nothing near is known, however slow
        root = viscous**2 + 4.0 * inertial * free
        if root < 0.0 or viscous + root**0.5 <= 0.0:
            break
        wanted = (viscous + root**0.5) / (2.0 * free)
        factor = max(wanted, factor * (1.0 + max(0.5 * slack, _LEAST)))
    return EffortStretch(np.inf, peak)


def effort_survey(
    dynamics: InverseDynamics,
    breaks: Array,
    coefficients: Array,
    limits: Array | None = None,
    still: float = REST,
) -> EffortSurvey:
    """Return the efforts of a motion as what bounds them for all t.

    Args:
        dynamics: Of the arm with what it carries.
        breaks: Of the joints' curve, (P + 1,), s.
        coefficients: Of its pieces, (degree + 1, P, n), highest power first, from the break on.
        limits: Lower and upper bounds of the efforts, shape (n, 2), where bounds are needed for these.
        still: Of `cut_where_joints_turn`.
    """
    long = np.diff(breaks) > 0
    starts, lengths = breaks[:-1][long], np.diff(breaks)[long]
    least = np.full(len(dynamics.links), np.inf) if limits is None else np.abs(limits).min(axis=1)
    nodes = node_survey(
        lambda coefficients, lengths: _values_at_nodes(dynamics, coefficients, lengths),
        cut_where_joints_turn(dynamics, starts, lengths, coefficients[:, long], still),
        lambda values: _slack(values, least),
        _HALVINGS,
    )
    return EffortSurvey((float(breaks[0]), float(breaks[-1])), nodes, least)


def _sum(parts: Array) -> Array:
    return np.asarray(parts.sum(axis=-1))


def _slack(values: Array, limits: Array) -> Array:
    """Return how near to the efforts of each joint their bounds are to come, shape (n,)."""
    largest: Array = np.abs(_sum(values)).max(axis=(0, 1), initial=0.0)
    return np.asarray(_CLOSE * np.maximum(np.minimum(largest, limits), _SMALL))


def _values_at_nodes(dynamics: InverseDynamics, coefficients: Array, lengths: Array) -> tuple[Array, Array]:
    """Return the parts of efforts at the nodes (P, 9, n, 4), and majorants of the ninth order (P, n)."""
    q, qd, qdd = at_nodes(coefficients, lengths)
    parts = np.empty((*q.shape, _PARTS))
    if not all(np.isfinite(values).all() for values in (q, qd, qdd)):
        parts[...] = np.inf  # nothing is known of what no float64 holds
        return parts, parts[:, 0, :, 0]
    joints = dynamics.robot.joints
    parts[..., 0], parts[..., 3] = dynamics.apart_from_gravity(q, qd, qdd)
    parts[..., 1] = qd * [joint.friction.viscous for joint in joints]
    signs = direction(qd[:, NODES_DEGREE // 2])
    parts[..., 2] = (signs * [joint.friction.coulomb for joint in joints])[:, None]
    n = NODES_DEGREE + 1
    return parts, effort_majorants(dynamics, q[:, 0], growth(coefficients, lengths, n + 2))[n]


def cut_where_joints_turn(
    dynamics: InverseDynamics, starts: Array, lengths: Array, coefficients: Array, still: float = REST
) -> tuple[Array, Array, Array]:
    """Return starts, lengths and coefficients of pieces in which no joint with Coulomb friction turns back.

    Args:
        dynamics: Of the arm.
        starts: Of the pieces of the joints' curve, s, shape (P,).
        lengths: Of the pieces, above 0, s, shape (P,).
        coefficients: Of the pieces, (degree + 1, P, n), highest power first, from their starts on.
        still: A joint that is no faster than this until the piece ends, or since it began, rests there and
            does not turn, rad/s or m/s.
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
        of_joints = [
            _turns(roots[:, piece, joint], rubbing[:, piece, joint], length, still)
            for joint in np.flatnonzero(turns[piece])
        ]
        inner = distinct(np.concatenate([np.empty(0), *of_joints]))
        cuts += [0.0, *inner.tolist()]
        owners += [piece] * (inner.size + 1)
    owner, begins = np.array(owners), np.array(cuts)
    last = np.append(owner[1:] != owner[:-1], True)
    ends = np.where(last, lengths[owner], np.append(begins[1:], 0.0))
    chosen = coefficients[:, owner]
    shifted = taylor_shift(chosen, np.broadcast_to(begins[:, None], chosen.shape[1:]))
    return starts[owner] + begins, ends - begins, shifted


def _turns(roots: Array, coefficients: Array, length: float, still: float) -> Array:
    """Return when, of times (k,), a joint turns on a piece, but for what rounding makes of rest."""
    inner = roots[(roots > _EDGE * length) & (roots < (1.0 - _EDGE) * length)]
    slopes = derivative_coefficients(coefficients, 1)
    for side, end in ((-1, length), (0, 0.0)):
        while inner.size:
            beyond = np.array([0.5 * (inner[side] + end), end])
            if np.abs(np.polyval(slopes, beyond)).max() > still:
                break
            inner = np.delete(inner, side)
    return inner


def effort_majorants(dynamics: InverseDynamics, start: Array, rising: Array) -> Array:
    """Return bounds of |effort^(k)| / k! of each joint on whole pieces, shape (K, P, n).

    Coulomb friction, constant on a piece, counts only for k = 0, where it is left out.

    Args:
        dynamics: Of the arm with what it carries.
        start: Joint values (P, n) at the beginning of the pieces.
        rising: From `growth` of power series, (K + 2, P, n).
    """
    orders = np.arange(len(rising) - 2)[:, None, None]
    qd = (orders + 1.0) * rising[1:-1]
    qdd = (orders + 1.0) * (orders + 2.0) * rising[2:]
    rotations, levers, wrenches = _outward_majorants(dynamics, start, rising[:-2], qd, qdd)
    result = np.empty(qd.shape)
    force = moment = np.zeros(qd.shape[:2])
    for i in reversed(range(qd.shape[2])):
        force, moment = force + wrenches[i][0], moment + wrenches[i][1]
        joint = dynamics.robot.joints[i]
        result[:, :, i] = force if dynamics.links[i].prismatic else moment
        result[:, :, i] += joint.rotor * qdd[:, :, i] + joint.friction.viscous * qd[:, :, i]
        moment = series_product(rotations[i], moment + series_product(levers[i], force))
        force = series_product(rotations[i], force)
    return result


def _outward_majorants(
    dynamics: InverseDynamics, start: Array, rising: Array, qd: Array, qdd: Array
) -> tuple[list[Array], list[Array], list[tuple[Array, Array]]]:
    """Return majorants of each joint's rotation, of the lever to it, and of force and moment on its solid.

    Majorants, each (K, P): `w` of the angular velocity, `alpha` of its derivative, `a` of the acceleration of
    the origin, gravity included, `r` of the lever from the origin before, `rotation` of a rotation matrix.
    """
    rotations, levers, wrenches = [], [], []
    zero = np.zeros(qd.shape[:2])
    w, alpha, alpha_and_w2, a = zero, zero, zero, zero.copy()
    a[0] = np.linalg.norm(dynamics.robot.gravity)
    for i, link in enumerate(dynamics.links):
        r, angle = zero.copy(), zero.copy()
        d = np.abs(link.sign * start[:, i] + link.d) if link.prismatic else np.full(len(start), abs(link.d))
        if link.prismatic:
            d += rising[0, :, i]
            r[1:] = rising[1:, :, i]
        else:
            angle[1:] = rising[1:, :, i]
        rotation = series_exponential(angle)
        square = len(link.screw) == 3  # without a tilt d is square to the length along x
        r[0] = np.hypot(link.screw[0], d) if square else abs(link.screw[0]) + d
        a = a + series_product(r, alpha_and_w2)
        if link.prismatic:
            a = a + 2.0 * series_product(w, qd[:, :, i]) + qdd[:, :, i]
        a, w, alpha = (series_product(rotation, majorant) for majorant in (a, w, alpha))
        if not link.prismatic:
            alpha = alpha + qdd[:, :, i] + series_product(w, qd[:, :, i])
            w = w + qd[:, :, i]
        w2 = series_product(w, w)
        alpha_and_w2 = alpha + w2
        wrenches.append(_wrench_majorants(link.solid.sizes, a, alpha, w2))
        rotations.append(rotation)
        levers.append(r)
    return rotations, levers, wrenches


def _wrench_majorants(
    solid: tuple[float, float, float, float], a: Array, alpha: Array, w2: Array
) -> tuple[Array, Array]:
    """Return majorants of the force on a solid and of its moment, from those of a, alpha and w^2."""
    mass, first, largest, uneven = solid
    return mass * a + first * (alpha + w2), largest * alpha + uneven * w2 + first * a
