"""Comparison of moves along a path with toppra: the same path and limits, and what each motion uses of them.

toppra keeps the limits at the points of its grid. What its motion uses between them is found here as for our
own: q(s(t)) is a polynomial between neighbouring times, and its extremes are at the roots of its derivative.

Source: Pham and Pham, A New Approach to Time-Optimal Path Parameterization Based on Reachability Analysis,
IEEE Trans. Robotics 34 (2018).
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.operations import compose
from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.errors import PlanningError
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Limits
from trajcli.limits.tolerances import exceeds
from trajcli.planners.planner import PlannedMove

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.constraints import JointConstraint
    from trajcli.peers.geometric_path import GeometricPath

_UNLIMITED = 1e3  # times the largest limit of its kind: the solver of toppra takes no infinite ones
_FEWEST, _MOST = 100, 2000  # points of the grid of one smooth path


@comparable
class LimitUse:
    """The limit of velocity or acceleration of which a motion uses most.

    Attributes:
        quantity: "velocity" or "acceleration".
        joint: Index.
        used: Largest part of the limit: 1 is all of it.
        time: When, s from the start of the motion.
    """

    quantity: Literal["velocity", "acceleration"]
    joint: int
    used: float
    time: float


@comparable
class LimitBreach:
    """A limit that the motion of a peer breaks, as found for all t by the roots of polynomials.

    Attributes:
        order: 0 for position, 1 velocity, 2 acceleration, 3 jerk.
        joint: Index.
        value: What it reaches, SI.
        limit: SI.
        time: When, s from the start of the motion.
    """

    order: int
    joint: int
    value: float
    limit: float
    time: float


@frozen
class PathReference:
    """The motion of toppra along a path.

    Attributes:
        duration: Seconds.
        use: What it uses of the limits; None where nothing is limited.
        breaches: Limits of position, velocity and acceleration that it breaks.
        deviation: By how much its path misses that of the motion it is compared with, rad or m.
    """

    duration: float
    use: LimitUse | None
    breaches: tuple[LimitBreach, ...] = ()
    deviation: float = 0.0


def path_reference(move: PlannedMove) -> PathReference | None:
    """Return the motion of toppra along the path of a time-optimal move; None for other moves.

    Velocities at the ends are those of the move. Limits of the tool and of the jerk are not toppra's: a move
    that keeps them may be slower for that.

    Raises:
        PlanningError: When toppra finds no motion.
    """
    from trajcli.curves.time_optimal.constraints import JointConstraint, is_at_rest

    plane = move.planned.phase_plane
    joints = (
        None
        if plane is None
        else next((c for c in plane.constraints if isinstance(c, JointConstraint)), None)
    )
    if plane is None or joints is None:
        return None
    # where the path itself is at rest, any sd is rest, and toppra may choose none
    ends = [
        0.0 if still else max(0.0, float(plane.law.evaluate(time, 1)[0]))
        for still, time in zip(is_at_rest(joints.path), (plane.law.start, plane.law.end), strict=True)
    ]
    return _along(joints, plane.stops, (ends[0], ends[1]), move.robot.limits)


def reference_along(
    geometric: GeometricPath, limits: Limits, velocities: tuple[Array, Array] | None = None
) -> PathReference | None:
    """Return the motion of toppra along a path of joint space; None where no rate is limited.

    Args:
        geometric: The path.
        limits: Those of velocity and acceleration count.
        velocities: Of the joints at the start and at the end, each of shape (n,); rest unless given.

    Raises:
        PlanningError: When toppra finds no motion.
    """
    if not (np.isfinite(limits.velocity).any() or np.isfinite(limits.acceleration).any()):
        return None
    from trajcli.curves.time_optimal.constraints import JointConstraint

    path = geometric.path
    joints = JointConstraint(path, limits.velocity, limits.acceleration)
    speeds = (0.0, 0.0)
    if velocities is not None:
        along = [path.evaluate(s, 1, side=side) for s, side in ((path.start, "right"), (path.end, "left"))]  # type: ignore[arg-type]
        first, last = (
            max(0.0, float(velocity @ tangent) / float(tangent @ tangent))
            for velocity, tangent in zip(velocities, along, strict=True)
        )
        speeds = first, last
    found = _along(joints, geometric.stops, speeds, limits)
    return replace(found, deviation=geometric.deviation)


def _along(joints: JointConstraint, stops: Array, ends: tuple[float, float], limits: Limits) -> PathReference:
    """Return toppra's motion from the speed along the path at its start to that at its end."""
    parts = list(_smooth_parts(joints.path, stops))
    curves = []
    for index, (low, high) in enumerate(parts):
        speeds = (ends[0] if index == 0 else 0.0, ends[1] if index == len(parts) - 1 else 0.0)
        curves.append(compose(joints.path, _law(joints, low, high, speeds)))
    curve = concatenate(curves)
    return PathReference(curve.duration, limit_use(curve, limits), breaches_of(curve, limits, (0, 1, 2)))


def breaches_of(curve: PiecewisePolynomial, limits: Limits, orders: Sequence[int]) -> tuple[LimitBreach, ...]:
    """Return which limits a curve q(t) breaks, of each joint and quantity the worst, for all t.

    Args:
        curve: Of n joints.
        limits: Of as many.
        orders: Derivatives that are judged: 0 for position, to 3 for jerk.
    """
    found = []
    for order, extremes in zip(orders, peaks(curve, orders), strict=True):
        bounds = limits.of_order(order)
        for joint in range(curve.dimension):
            sides = (
                (extremes.low[joint], bounds[joint, 0], extremes.low_time[joint], -1.0),
                (extremes.high[joint], bounds[joint, 1], extremes.high_time[joint], 1.0),
            )
            beyond = [
                (
                    sign * (value - bound),
                    LimitBreach(order, joint, float(value), float(bound), float(time) - curve.start),
                )
                for value, bound, time, sign in sides
                if exceeds(sign * value, sign * bound)
            ]
            found += [max(beyond, key=lambda pair: pair[0])[1]] if beyond else []
    return tuple(found)


def limit_use(curve: PiecewisePolynomial, limits: Limits) -> LimitUse | None:
    """Return the limit of velocity or acceleration that a curve q(t) uses most, for all t; None: no limit."""
    uses = []
    names: tuple[Literal["velocity", "acceleration"], ...] = ("velocity", "acceleration")
    for name, extremes in zip(names, peaks(curve, (1, 2)), strict=True):
        low, high = getattr(limits, name).T
        parts = np.stack([extremes.low / low, extremes.high / high])
        side, joint = np.unravel_index(int(parts.argmax()), parts.shape)
        time = (extremes.low_time, extremes.high_time)[side][joint]
        uses.append(LimitUse(name, int(joint), float(parts[side, joint]), float(time - curve.start)))
    largest = max(uses, key=lambda use: use.used)
    return largest if largest.used > 0 else None


def _smooth_parts(path: PiecewisePolynomial, stops: Array) -> Iterator[tuple[float, float]]:
    """Yield the intervals of s between the corners of a path, where every motion stops."""
    inside = stops[(stops > path.start) & (stops < path.end)]
    ends = [path.start, *inside.tolist(), path.end]
    yield from pairwise(ends)


def _law(
    joints: JointConstraint, low: float, high: float, speeds: tuple[float, float]
) -> PiecewisePolynomial:
    """Return toppra's law s(t) from `low` to `high`: a constant sdd between points of its grid."""
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint
    from toppra.exceptions import ToppraError

    bounds = [JointVelocityConstraint(_finite(joints.velocity))]
    if np.isfinite(joints.acceleration).any():
        scheme = DiscretizationType.Interpolation
        bounds.append(JointAccelerationConstraint(_finite(joints.acceleration), discretization_scheme=scheme))
    grid, sd = _grid(joints.path, low, high), None
    with _quiet(), suppress(ToppraError):
        solver = TOPPRA(bounds, _toppra_path(joints.path, low, high), gridpoints=grid)
        _, sd, _ = solver.compute_parameterization(*speeds)
    if sd is None or not np.isfinite(sd).all() or not (sd[1:] + sd[:-1] > 0).all():
        raise PlanningError("toppra finds no motion along the path", hint="leave --reference out")
    steps = np.diff(grid)
    durations = 2 * steps / (sd[1:] + sd[:-1])
    coefficients = np.stack([(sd[1:] ** 2 - sd[:-1] ** 2) / (4 * steps), sd[:-1], grid[:-1]])
    return PiecewisePolynomial(np.concatenate([[0.0], np.cumsum(durations)]), coefficients[:, :, None])


def _grid(path: PiecewisePolynomial, low: float, high: float) -> Array:
    """Return points of the path for toppra: its breaks, and points evenly between them."""
    breaks = path.breaks[(path.breaks > low) & (path.breaks < high)]
    ends = np.concatenate([[low], breaks, [high]])
    wanted = np.clip(8 * ends.size, _FEWEST, _MOST)
    parts = np.maximum(1, np.ceil(np.diff(ends) / (high - low) * wanted)).astype(int)
    points = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)]
    return np.append(np.concatenate(points), high)


def _finite(bounds: Array) -> Array:
    """Return bounds (n, 2) with numbers far above all others for infinite ones."""
    largest = np.abs(bounds[np.isfinite(bounds)]).max(initial=1.0)
    far = _UNLIMITED * largest
    return np.clip(bounds, -far, far)


def _toppra_path(path: PiecewisePolynomial, low: float, high: float) -> Any:  # noqa: ANN401
    """Return the path as toppra takes it, exactly, from `low` to `high`."""
    from toppra.interpolator import AbstractGeometricPath

    class ExactPath(AbstractGeometricPath):  # type: ignore[misc]
        @property
        def dof(self) -> int:
            return path.dimension

        @property
        def path_interval(self) -> Array:
            return np.array([low, high])

        @property
        def waypoints(self) -> tuple[Array, Array]:
            inside = path.breaks[(path.breaks >= low) & (path.breaks <= high)]
            return inside, path.evaluate(inside)

        def __call__(self, path_positions: Array, order: int = 0) -> Array:
            return path.evaluate(np.clip(path_positions, low, high), order)

    return ExactPath()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep toppra's log and numpy's warnings off the terminal: what they are about is judged here."""
    logger = logging.getLogger("toppra")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        with np.errstate(all="ignore"):
            yield
    finally:
        logger.setLevel(level)
