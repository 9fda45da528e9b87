"""Paths of joints through points: splines by their rule, polylines with rounded corners, paths of motions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.parabolic_blends.blends import blended
from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.curves.splines.cubic import not_a_knot
from trajcli.curves.splines.hermite import ShapeError, parabola_velocities
from trajcli.curves.third_order.curved_paths import BESIDE, rounded_polyline
from trajcli.errors import Amount, PlanningError, Problem, of_joint
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Event
from trajcli.planners.waypoints.spline_rules import Rule, curve_through
from trajcli.planners.waypoints.through_points import PointTable

Parameter = Literal["chord", "centripetal", "uniform"] | tuple[float, ...]

_REVERSAL = np.radians(1.0)  # from half a turn, nearer to which a rounded corner would be a spike
_STRAIGHT = 1e-12  # of the largest slope: segments whose slopes differ by less go straight on
_OFF = 1e-9  # relative: a velocity this little off the path is on it
_PARABOLA_BESIDE = 1.0 / 8.0  # of the change of slope over the length of a blend
_ROOM = 0.999  # of a segment that two blends may share: each keeps a straight piece between
_AT_REST = 0.08  # of a motion's time, at each of its ends, in which s is not its time
_PIECES, _PER_SEGMENT, _FEWEST = 48, 6, 2  # of the path of a motion: in all, on the mean and at least
_FINE = 4001  # times of a motion, between which those of its knots are found


@frozen
class JointPath:
    """A path through points.

    Attributes:
        curve: q(s).
        s: Path parameter at each point, shape (m,).
        missed: By how much each joint passes beside each point, shape (m, n).
        speeds: sd at the start and at the end.
        events: What was conceded.
    """

    curve: PiecewisePolynomial
    s: Array
    missed: Array
    speeds: tuple[float, float]
    events: tuple[Event, ...] = ()


def spline_through(rule: Rule, parameter: Parameter, points: PointTable, robot: Robot) -> JointPath:
    """Return the spline of a rule; where the arm moves at an end, the path has that direction there.

    A quintic that ends at rest leaves its end towards the next point.

    Raises:
        PlanningError: When the parameter has another number of values than points, or shape_preserving does
            not allow the direction.
    """
    s = _parameter_values(parameter, points)
    q, ends = points.positions, points.rates[0, [0, -1]]
    slopes, speeds = np.zeros_like(ends), [0.0, 0.0]
    for k, (velocity, piece) in enumerate(zip(ends, (0, -1), strict=True)):
        speed = float(np.linalg.norm(velocity))
        chord = np.diff(q, axis=0)[piece] / np.diff(s)[piece]
        if speed:
            slopes[k] = velocity / speed * np.linalg.norm(chord)
            speeds[k] = speed / float(np.linalg.norm(chord))
        elif rule == "quintic":  # without slope and curvature it would take infinite sd to leave the end
            slopes[k] = chord
    rates = np.zeros_like(points.rates)
    rates[0, [0, -1]] = slopes
    sloped = replace(points, rates=rates)
    try:
        curve = curve_through(rule, _bent_where_all_turn(sloped, s) if rule == "quintic" else sloped, s)
    except ShapeError as error:
        name = robot.joint_names[error.component]
        message = f"the velocity of {name} at the {error.end} point does not let the path be monotone there"
        raise PlanningError(Problem(message, "use rule not_a_knot", joint=name)) from None
    return JointPath(curve, s, np.zeros_like(q), (speeds[0], speeds[1]))


def _bent_where_all_turn(points: PointTable, s: Array) -> PointTable:
    """Return the points with the accelerations of parabolas where all joints turn back at once.

    There the computed velocities and accelerations of a quintic vanish, and it would take infinite sd to
    leave the point as fast as the joints can.
    """
    ends = points.rates[0, [0, -1]]
    computed: Array = parabola_velocities(s, points.positions, *ends)
    turning = np.logical_not(computed.any(axis=1))
    turning[[0, -1]] = False
    if not turning.any():
        return points
    slopes = np.diff(points.positions, axis=0) / np.diff(s)[:, None]
    rates, given = points.rates.copy(), points.given.copy()
    rates[1, 1:-1][turning[1:-1]] = (2 * np.diff(slopes, axis=0) / (s[2:] - s[:-2])[:, None])[turning[1:-1]]
    given[1] = given[1] | turning
    return replace(points, rates=rates, given=given)


def _parameter_values(parameter: Parameter, points: PointTable) -> Array:
    if isinstance(parameter, tuple):
        if len(parameter) != points.count:
            message = f"{len(parameter)} values of the parameter for {points.count} points"
            raise PlanningError(message, hint="give one for each point, none twice, or use chord")
        return np.array(parameter)
    chords = np.linalg.norm(np.diff(points.positions, axis=0), axis=1)
    steps = {"chord": chords, "centripetal": np.sqrt(chords), "uniform": np.ones_like(chords)}[parameter]
    return np.concatenate([[0.0], np.cumsum(steps)])


def polyline_through(points: PointTable, corner: Array, robot: Robot, *, smooth: bool) -> JointPath:
    """Return straight segments, corners rounded by curves that stay within `corner` of them.

    Args:
        points: What to pass.
        corner: How far each joint may pass from a corner, rad or m, shape (n,): all above zero, or all zero
            for sharp corners.
        robot: For the names of joints.
        smooth: Whether curvature joins, instead of parabolas.

    Raises:
        PlanningError: When the arm moves at an end in another direction than the segment there.
    """
    q, s = points.positions, _parameter_values("chord", points)
    slopes = np.diff(q, axis=0) / np.diff(s)[:, None]
    speeds = tuple(
        _along(slope, velocity, robot)
        for slope, velocity in zip(slopes[[0, -1]], points.rates[0, [0, -1]], strict=True)
    )
    turn = np.abs(np.diff(slopes, axis=0))
    turn[turn <= _STRAIGHT * np.abs(slopes).max()] = 0.0  # rounding bends no straight line
    if not corner.any() or not turn.any():
        curve = PiecewisePolynomial(s, np.stack([slopes, q[:-1]]))
        return JointPath(curve, s, np.zeros_like(q), (speeds[0], speeds[1]))
    wanted, beside = np.zeros(points.count), BESIDE if smooth else _PARABOLA_BESIDE
    sharpest = (turn / corner).max(axis=1)
    back = _turns_back(slopes)
    wanted[1:-1] = np.where(back, 0.0, 1.0 / beside / np.where(sharpest > 0, sharpest, np.inf))
    spans = np.diff(s)
    limit = np.full(points.count, np.inf)
    limit[1:-1] = _ROOM * np.minimum(spans[:-1], spans[1:])
    used = np.minimum(wanted, limit)
    if smooth:
        curve, missed = rounded_polyline(s, q, used)
    else:
        curve, missed = _with_parabolas(s, q, used, [0, *(np.flatnonzero(back) + 1).tolist(), len(s) - 1])
    events = (*_stops(back), *_shrunk(wanted, used))
    return JointPath(curve, s, missed, (speeds[0], speeds[1]), events)


def _with_parabolas(
    s: Array, points: Array, blends: Array, stops: Sequence[int]
) -> tuple[PiecewisePolynomial, Array]:
    """Return segments with parabolas of lengths (m,) at points (m, n), and by what these are missed."""
    slopes = np.diff(points, axis=0) / np.diff(s)[:, None]
    curves, missed = [], np.zeros_like(points)
    for low, high in pairwise(stops):
        part = slice(low, high + 1)
        speeds = {"start_velocity": slopes[low], "end_velocity": slopes[high - 1]}
        motion = blended(s[part], points[part], blends[part], ends="inside", **speeds)
        curves.append(motion.curve)
        missed[part] = np.maximum(missed[part], motion.missed)
    return concatenate(curves), missed


def _turns_back(slopes: Array) -> NDArray[np.bool_]:
    """Return at which of the points between segments of slopes (m, n) the path turns back, (m - 1,)."""
    along = slopes / np.linalg.norm(slopes, axis=1)[:, None]
    sums, apart = (np.linalg.norm(along[1:] + sign * along[:-1], axis=1) for sign in (1.0, -1.0))
    return np.asarray(2.0 * np.arctan2(sums, apart) < _REVERSAL)


def _stops(back: NDArray[np.bool_]) -> Iterator[Event]:
    """Yield the event of each point at which the path turns back."""
    for k in np.flatnonzero(back).tolist():
        yield Event("turns_back", f"the path turns back at point {k + 1}, and stops there")


def _along(slope: Array, velocity: Array, robot: Robot) -> float:
    """Return sd with which the path of a slope has the velocity."""
    speed = float(velocity @ slope) / float(slope @ slope)
    off = np.abs(velocity - speed * slope)
    if off.max() > _OFF * np.abs(velocity).max() or speed < 0:
        joint = int(off.argmax())
        message = "a polyline is straight at its ends, but {velocity} of {joint} leaves it"
        hint = "use `path: spline`, or let the move before end at rest"
        amounts = {"velocity": Amount(float(velocity[joint]), 1, joint)}
        raise PlanningError(of_joint(robot.joint_names[joint], message, hint, amounts))
    return speed


def _shrunk(wanted: Array, used: Array) -> tuple[Event, ...]:
    less = np.flatnonzero(used[1:-1] < wanted[1:-1])
    if not less.size:
        return ()
    share = used[1:-1][less] / wanted[1:-1][less]
    worst = int(less[share.argmin()])
    more = f"; {less.size - 1} more likewise" if less.size > 1 else ""
    part = f"{100 * share.min():.4g} % of the deviation asked for"
    text = f"the corner at point {worst + 1} is rounded by {part}: its segments are too short for more{more}"
    return (Event("shrunk", text),)


def path_of_motion(curve: PiecewisePolynomial, times: Array) -> tuple[PiecewisePolynomial, Array]:
    """Return the path of a motion from rest to rest, q(s), and the s of some of its points.

    It is a cubic spline through many of its points: at `times` exactly that motion, and near to it between.
    Inside, s is the time, which goes on where all joints turn back at once. At rest, where q goes with the
    third power of time, so does s: the path leaves its ends with a slope that is not zero.

    Args:
        curve: q(t) from t = 0.
        times: At which points are passed, its start and its end among them, shape (m,).
    """
    fine = np.linspace(0.0, curve.end, _FINE)
    passed, s = _slow_at_rest(times, curve.end), _slow_at_rest(fine, curve.end)
    step = passed[-1] / max(_PIECES, _PER_SEGMENT * (times.size - 1))
    knots, at_points = [times[:1]], [0]
    for k, (low, high) in enumerate(pairwise(passed.tolist())):
        count = max(_FEWEST, round((high - low) / step))
        inner = np.interp(np.linspace(low, high, count + 1)[1:-1], s, fine)
        knots += [inner, times[k + 1 : k + 2]]
        at_points.append(at_points[-1] + count)
    chosen = np.concatenate(knots)
    values = _slow_at_rest(chosen, curve.end)
    return not_a_knot(values, curve.evaluate(chosen)), values[at_points]


def _slow_at_rest(times: Array, end: float) -> Array:
    """Return a parameter that grows as time does, but next to 0 and to the end with its third power."""
    width = _AT_REST * end
    return np.asarray(times - _behind(times, width) + _behind(end - times, width) - _behind(end, width))


def _behind(times: Array | float, width: float) -> Array:
    """Return by what a parameter is behind the time once it has grown from 0: its rate rises to 1 in `width`.

    The rate is 2 u^2 up to u = 1/2, and 1 - 2 (1 - u)^2 from there to u = 1.
    """
    u = np.minimum(np.asarray(times) / width, 1.0)
    grown = np.where(u < 0.5, 2 * u**3 / 3, u - 0.5 + 2 * (1 - u) ** 3 / 3)
    return np.asarray(width * (u - grown))
