"""Circular arcs and helices by arc length, from three points, or from center, axis and angle.

p(f) = start - r (1 - cos f) x + r sin f y + (pitch / 2 pi) f z, with z the axis, x from the center to the
start, y = z cross x and f the angle. One radian is sqrt(r^2 + (pitch / 2 pi)^2) of arc length.

Source: Siciliano et al. (2009), section 4.2.2; there, too, the parameter of a circle is its arc length, not
its angle.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import Amount, InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.position import (
    SAME_POINT,
    Side,
    Smooth,
    Triple,
    inside,
    point,
    shown_length,
    shown_position,
    shown_vector,
)
from trajcli.geometry.power_series import series_exponential
from trajcli.geometry.rotation import Array, exp

LOOSE = 1e-3  # of radius or chord: numbers typed with three digits fit, a wrong one does not
COLLINEAR = 1e-6  # sine of the angle at the middle of three points, below which rounding makes the circle
HALF_TURN = 1e-3  # rad from half a turn, within which typed digits decide the plane
_TURN = 2.0 * np.pi


@frozen
class Arc(Smooth):
    """A circular arc, or a helix: several turns are possible.

    A center that is not quite in the plane of the start is moved along the axis into it.

    Attributes:
        start: Shape (3,), m.
        center: Shape (3,), m, in the plane of the start that the axis is perpendicular to.
        axis: Unit vector (3,).
        angle: Rad, right-handed about the axis, of either sign.
        pitch: Distance along the axis for a whole turn of positive angle, m, of either sign.
        moved: How far the center that was given has been moved to fit, m.

    Raises:
        InputError: For an axis without direction, an arc of no angle, a start in the center, numbers not
            finite.
        PlanningError: When the axis is not perpendicular to the line from center to start.
    """

    start: Array
    center: Array
    axis: Array
    angle: float
    pitch: float = 0.0
    moved: float = 0.0

    def __post_init__(self) -> None:
        start, center = point(self.start, "start"), point(self.center, "center")
        axis = direction(self.axis)
        along = float((start - center) @ axis)
        radius = float(np.linalg.norm(start - center - along * axis))
        if radius <= SAME_POINT:
            text = "an arc needs a radius: the start lies {radius} from the axis through {center}"
            raise InputError(
                Problem(text, amounts={"radius": shown_length(radius), "center": shown_position(center)})
            )
        if abs(along) > LOOSE * radius:
            raise _oblique_axis(start, center, axis, along)
        if not (np.isfinite(self.angle) and np.isfinite(self.pitch)):
            raise InputError(f"angle and pitch of an arc must be finite: {self.angle}, {self.pitch}")
        if abs(self.angle) * radius <= SAME_POINT:
            amounts = {"angle": Amount(float(self.angle), 0, None, "angle")}
            raise InputError(Problem("an arc by an angle of {angle} has no length", amounts=amounts))
        for name, value in {
            "start": start,
            "center": point(center + along * axis, "center"),
            "axis": point(axis, "axis"),
            "moved": float(np.hypot(self.moved, along)),
        }.items():
            object.__setattr__(self, name, value)

    @classmethod
    def through(cls, start: ArrayLike, via: ArrayLike, target: ArrayLike) -> Arc:
        """Return the arc from `start` through `via` to `target`, each (3,), m.

        Raises:
            InputError: When two of the points coincide.
            PlanningError: When they lie on one line.
        """
        a, b, c = point(start, "start"), point(via, "via point"), point(target, "target")
        for name, one, other in (
            ("start and via", a, b),
            ("via and target", b, c),
            ("start and target", a, c),
        ):
            if np.linalg.norm(one - other) <= SAME_POINT:
                raise _coincident(name, one)
        normal = np.cross(b - a, c - b)
        sine = float(np.linalg.norm(normal) / (np.linalg.norm(b - a) * np.linalg.norm(c - b)))
        if sine <= COLLINEAR:
            raise _collinear(a, b, c)
        u, w = b - a, c - a
        area = 2.0 * (normal @ normal)
        center = a + (w @ w) * (u @ (u - w)) / area * u + (u @ u) * (w @ (w - u)) / area * w
        return cls(a, center, normal, _turned(a - center, c - center, direction(normal)))

    @classmethod
    def around(
        cls, start: ArrayLike, center: ArrayLike, target: ArrayLike, axis: ArrayLike | None = None
    ) -> Arc:
        """Return the arc about `center` from `start` to `target`, each (3,), m.

        A center that typed digits put beside its line is moved to the nearest one that fits; `moved` says
        how far.

        Args:
            start: Where it starts.
            center: As far from the start as from the target.
            target: Where it ends.
            axis: The arc goes right-handed about it, by less than a turn; without it the shorter one.

        Raises:
            InputError: When points coincide, or at half a turn without an axis.
            PlanningError: When the center is not equidistant, the target off the plane, or the axis oblique.
        """
        a, c, b = point(start, "start"), point(center, "center"), point(target, "target")
        chord = b - a
        distance = float(np.linalg.norm(chord))
        for name, one, other in (("start and center", a, c), ("center and target", c, b)):
            if np.linalg.norm(one - other) <= SAME_POINT:
                raise _coincident(name, one)
        if distance <= SAME_POINT:
            raise _coincident("start and target", a)
        unit = chord / distance
        aside = float((c - (a + b) / 2.0) @ unit)
        middle = c - aside * unit
        if abs(aside) > LOOSE * np.linalg.norm(a - middle):
            raise _not_equidistant(a, c, b, middle)
        z = _shorter_axis(a - middle, b - middle) if axis is None else _across(axis, unit, distance)
        foot = middle + ((a - middle) @ z) * z  # where the constructor, too, will move the center
        return cls(a, middle, z, _turned(a - foot, b - foot, z), moved=aside)

    @cached_property
    def radius(self) -> float:
        """Distance from the axis, m."""
        return float(np.linalg.norm(self.start - self.center))

    @cached_property
    def length(self) -> float:
        """Arc length, m, the climb of a helix included."""
        return abs(self.angle) * self._metres

    @property
    def end(self) -> Array:
        """Last point, shape (3,), m."""
        return np.asarray(self.evaluate(np.array([self.length]))[0][0])

    @cached_property
    def _metres(self) -> float:
        """Arc length for each radian."""
        return float(np.hypot(self.radius, self.pitch / _TURN))

    @cached_property
    def _frame(self) -> tuple[Array, Array]:
        """Unit vectors x and y in the plane, x towards the start."""
        x = (self.start - self.center) / self.radius
        return x, np.cross(self.axis, x)

    @property
    def _rate(self) -> float:
        """Signed radians for each metre of arc length."""
        return float(np.copysign(1.0 / self._metres, self.angle))

    def s_of(self, position: Array) -> float:
        """Return the arc length, m, at which the first turn passes a position (3,) on the circle."""
        turned = _turned(self.start - self.center, position - self.center, self.axis)
        turned = turned if self.angle > 0 else (_TURN - turned) % _TURN
        return min(turned / abs(self.angle), 1.0) * self.length

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says; both sides are the same."""
        x, y = self._frame
        f = self._rate * inside(s, self.length)[:, None]
        cosine, sine = np.cos(f), np.sin(f)
        versine = 2.0 * np.sin(f / 2.0) ** 2  # 1 - cos f would lose the digits of a flat arc
        climb = self.pitch / _TURN * self.axis
        positions = self.start + self.radius * (sine * y - versine * x) + f * climb
        first = self._rate * (self.radius * (cosine * y - sine * x) + climb)
        second = -(self._rate**2) * self.radius * (cosine * x + sine * y)
        return positions, first, second

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says: a rotation about the axis, of a helix too."""
        values = inside(s, self.length)
        rate = self._rate * self.axis
        return exp(values[:, None] * rate), np.tile(rate, (values.size, 1)), np.zeros((values.size, 3))

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says.

        In the plane p is the radius times exp(i f), whose series exp of that of f bounds; f is even in s.
        """
        del s
        angle = abs(self._rate) * rising
        turned = series_exponential(angle)
        return self.radius * turned + abs(self.pitch) / _TURN * angle, turned


def direction(axis: ArrayLike) -> Array:
    """Return the unit vector (3,) along an axis.

    Raises:
        InputError: When it has none.
    """
    values = point(axis, "axis")
    length = float(np.linalg.norm(values))
    if not (length > 0.0 and np.isfinite(length)):
        raise InputError("an axis of length 0 has no direction", hint="such as z or [0, 0, 1]")
    return np.asarray(values / length)


def _turned(first: Array, last: Array, axis: Array) -> float:
    """Return the angle in (0, 2 pi) about `axis` from one radius to the other."""
    return float(np.arctan2(axis @ np.cross(first, last), first @ last) % _TURN)


def _shorter_axis(first: Array, last: Array) -> Array:
    """Return the axis of the shorter arc from one radius to the other."""
    normal = np.cross(first, last)
    if np.arctan2(np.linalg.norm(normal), first @ last) >= np.pi - HALF_TURN:
        raise InputError(
            "start, center and target lie on one line: half a turn, to which every plane through them and "
            "both ways round belong",
            hint="add `axis`, such as axis: z; the arc goes right-handed about it",
        )
    return direction(normal)


def _across(axis: ArrayLike, chord: Array, distance: float) -> Array:
    """Return the axis perpendicular to the unit `chord`, if it nearly is."""
    given = direction(axis)
    slope = float(given @ chord)
    if abs(slope) > LOOSE:
        text = (
            "the target lies {off} off the plane of the arc, which goes through the start perpendicular to "
            f"the axis {shown_vector(given)} (allowed is {{most}})"
        )
        hint = "leave `axis` out, or give `center`, `axis`, `angle` and `pitch` for a helix"
        amounts = {"off": shown_length(abs(slope) * distance), "most": shown_length(LOOSE * distance)}
        raise PlanningError(Problem(text, hint, amounts=amounts))
    return direction(given - slope * chord)


def _oblique_axis(start: Array, center: Array, axis: Array, along: float) -> PlanningError:
    text = (
        f"the axis {shown_vector(axis)} is not perpendicular to the line from the center {{center}} to the "
        "start {start}: along the axis they are {along} apart"
    )
    amounts = {
        "center": shown_position(center),
        "start": shown_position(start),
        "along": shown_length(abs(along)),
    }
    amounts["right"] = shown_position(center + along * axis)
    hint = "the center of a circle about this axis through the start is {right}"
    return PlanningError(Problem(text, hint, amounts=amounts))


def _coincident(names: str, where: Array) -> InputError:
    hint = "give `center`, `axis` and `angle` for whole turns" if "center" not in names else None
    text = f"{names} of the arc coincide at {{where}}: no circle follows from them"
    return InputError(Problem(text, hint, amounts={"where": shown_position(where)}))


def _collinear(start: Array, via: Array, target: Array) -> PlanningError:
    text = "start {start}, via {via} and target {target} are collinear"
    amounts = {"start": shown_position(start), "via": shown_position(via), "target": shown_position(target)}
    if (via - start) @ (target - via) > 0.0:
        text, hint = f"{text}: use line, this arc is straight", "line: {to: ...}"
    else:
        text, hint = f"{text} and via is not between the others: no arc goes through them", "move via"
    return PlanningError(Problem(text, hint, amounts=amounts))


def _not_equidistant(start: Array, center: Array, target: Array, right: Array) -> PlanningError:
    text = (
        "the center {center} is {near} from the start and {far} from the target: they do not lie on one "
        f"circle about it (it may be {LOOSE:g} of the radius out of place, it is {{off}})"
    )
    ends = {"near": start, "far": target, "off": right}
    amounts = {name: shown_length(float(np.linalg.norm(end - center))) for name, end in ends.items()}
    amounts |= {"center": shown_position(center), "right": shown_position(right)}
    return PlanningError(Problem(text, "the nearest center that fits is {right}", amounts=amounts))
