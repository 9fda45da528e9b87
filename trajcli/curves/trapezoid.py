"""Trapezoidal velocity profiles of one variable: bounded speed and acceleration, given boundary velocities.

Along the displacement, with boundary speeds w0, w1 >= 0, cruise speed V, and ramps of rate a (speeding up)
and d (slowing down), the motion covers D = V T - (V - w0)^2 / (2 a) - (V - w1)^2 / (2 d) in the time
T = (V - w0)/a + (V - w1)/d + cruise. What runs away from the target at the start, or must run up from
behind it at the end, is a ramp to or from rest before or after that.
The velocity is linear between knots, and the position a chain of parabolas.

Source: Biagiotti and Melchiorri (2008), sections 3.2 and 3.2.7; Siciliano et al. (2009), section 4.2.1.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing
from trajcli.frozen import comparable

_ROUNDING_OF_SPEED = 1e-14  # of the largest speed: speeds this close differ by rounding
_ROUNDING = 1e-12  # relative: what a speed, a distance or a duration may miss its bound by
_DOUBLE = 1e-15  # relative: a discriminant this small is zero, and both roots are one


@comparable
class MotionBounds:
    """What a motion in one direction may do: all positive; speed may be infinite.

    Attributes:
        speed: Largest speed.
        acceleration: Rate of speeding up.
        deceleration: Rate of slowing down.
    """

    speed: float
    acceleration: float
    deceleration: float


@comparable
class VelocityProfile:
    """A velocity that is linear between knots.

    Attributes:
        initial: Velocity at the start.
        knots: (duration of the interval, velocity at its end) in order; without knots it has no length.
    """

    initial: float
    knots: tuple[tuple[float, float], ...] = ()

    @property
    def duration(self) -> float:
        """Seconds."""
        return math.fsum(length for length, _ in self.knots)

    @property
    def distance(self) -> float:
        """Signed distance covered."""
        velocities = [self.initial, *(velocity for _, velocity in self.knots)]
        return math.fsum(
            (velocities[i] + velocities[i + 1]) / 2 * knot[0] for i, knot in enumerate(self.knots)
        )

    def then(self, other: VelocityProfile) -> VelocityProfile:
        """Return this profile followed by another that starts with the velocity in which this one ends."""
        return VelocityProfile(self.initial, self.knots + other.knots)

    def mirrored(self) -> VelocityProfile:
        """Return the profile in the opposite direction."""
        return VelocityProfile(-self.initial, tuple((length, -velocity) for length, velocity in self.knots))

    def stretched(self, factor: float) -> VelocityProfile:
        """Return the profile that takes `factor` times as long over the same distance."""
        return VelocityProfile(self.initial / factor, tuple((t * factor, v / factor) for t, v in self.knots))

    def phases(self) -> list[tuple[str, float, float]]:
        """Return (name, start, end) of each interval: accelerate, cruise, decelerate or rest."""
        named, start, before = [], 0.0, self.initial
        for length, velocity in self.knots:
            change = abs(velocity) - abs(before)
            flat = "cruise" if velocity else "rest"
            name = flat if change == 0 else "accelerate" if change > 0 else "decelerate"
            if length > 0:
                named.append((name, start, start + length))
            start, before = start + length, velocity
        return named

    def curve(self, start: float, end: float, duration: float | None = None) -> PiecewisePolynomial:
        """Return the position (n = 1) from `start`; its pieces are laid to end exactly in `end`.

        Args:
            start: Where it begins.
            end: Where it ends: `start` plus the distance, rounding apart.
            duration: When it ends: the duration, rounding apart.
        """
        knots = self._lasting_knots()
        if not knots:
            return PiecewisePolynomial(np.zeros(2), np.full((1, 1, 1), start))
        lengths = np.array([length for length, _ in knots])
        velocity = np.array([self.initial, *(v for _, v in knots)])
        breaks = np.concatenate([[0.0], np.cumsum(lengths)])
        breaks[-1] = breaks[-1] if duration is None else duration
        breaks = increasing(breaks)
        position = start + np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * lengths)])
        position[1:] += (end - position[-1]) * breaks[1:] / breaks[-1]
        slope = np.diff(velocity) / np.diff(breaks)  # so that velocities meet where breaks are rounded
        coefficients: Array = np.stack([slope / 2, velocity[:-1], position[:-1]])[:, :, None]
        return PiecewisePolynomial(breaks, coefficients)

    def _lasting_knots(self) -> list[tuple[float, float]]:
        """Return the knots without intervals of no length, and ramps between speeds equal but for rounding.

        Such a ramp is shorter than the times of its ends are exact: its acceleration would be anything.
        """
        fastest = max(abs(velocity) for velocity in (self.initial, *(v for _, v in self.knots)))
        shortest = 8 * math.ulp(self.duration)
        kept: list[tuple[float, float]] = []
        before = self.initial
        for length, velocity in self.knots:
            same = abs(velocity - before) <= _ROUNDING_OF_SPEED * fastest
            if length > (shortest if same else 0.0):
                kept.append((length, before if same else velocity))
                before = kept[-1][1]
        return kept


class InfeasibleProfileError(ValueError):
    """No profile exists.

    Attributes:
        reason: "too_fast" (cannot stop in time), "too_slow" (cannot reach the final speed in time), "turns"
            (ends against its direction), "speed", "acceleration" or "duration" (outside the interval).
        low: The number must be above this (or at least this, for accelerations and durations).
        high: The number must be at most this.
    """

    def __init__(self, reason: str, low: float = math.nan, high: float = math.inf) -> None:
        super().__init__(f"{reason}: outside [{low}, {high}]")
        self.reason, self.low, self.high = reason, low, high


def fastest_profile(
    distance: float,
    initial: float,
    final: float,
    forward: MotionBounds,
    backward: MotionBounds,
    *,
    overshoot: bool = False,
) -> VelocityProfile:
    """Return the fastest profile over a signed `distance` from velocity `initial` to velocity `final`.

    Args:
        distance: May be negative or zero.
        initial: Signed velocity at the start. Running away from the target is stopped first.
        final: Signed velocity at the end.
        forward: What motion in the positive direction may do.
        backward: What motion in the negative direction may do.
        overshoot: Whether the motion may pass the target (or back up before it) where it cannot help it.

    Raises:
        InfeasibleProfileError: When the boundary velocities do not let it end there without turning round.
    """
    motion = _motion_parts(distance, initial, final, forward, backward, overshoot=overshoot)
    return motion.with_middle(_fastest_middle(motion))


def profile_of_duration(
    distance: float,
    initial: float,
    final: float,
    duration: float,
    forward: MotionBounds,
    backward: MotionBounds,
    *,
    overshoot: bool = False,
) -> VelocityProfile:
    """Return the profile over a signed `distance` that lasts `duration` with the given ramps.

    The cruise speed is what is looked for; it may lie below the boundary speeds. The speeds of `forward` and
    `backward` are not used. Other arguments are those of `fastest_profile`.

    Raises:
        InfeasibleProfileError: As `fastest_profile`; "acceleration" with the least one when from rest to rest
            equal ramps are too flat; else "duration" with the shortest and the longest.
    """
    motion = _motion_parts(distance, initial, final, forward, backward, overshoot=overshoot)
    around = motion.before.duration + motion.after.duration
    middle = _middle_of_duration(motion, duration - around)
    if middle is not None:
        return motion.with_middle(middle)
    equal = motion.rates.acceleration == motion.rates.deceleration
    if initial == 0 and final == 0 and equal:
        raise InfeasibleProfileError("acceleration", 4 * abs(distance) / duration**2)
    shortest = motion.with_middle(_fastest_middle(motion)).duration
    raise InfeasibleProfileError("duration", shortest, around + _slowest_middle(motion))


def profile_of_speed(
    distance: float,
    initial: float,
    final: float,
    duration: float,
    speed: float,
    deceleration: float | None = None,
    acceleration: float = math.inf,
) -> VelocityProfile:
    """Return the profile over a positive `distance` that lasts `duration` with cruise speed `speed`.

    The rate of the ramps is what is looked for: both the same, or that of speeding up where `deceleration` is
    given. Boundary speeds are not negative, and not above the cruise speed.

    Raises:
        InfeasibleProfileError: "speed", when it lies outside the interval that the duration allows;
            "acceleration", when speeding up takes more than that.
    """
    low, high = _speeds_of_duration(distance, initial, final, duration, deceleration)
    surplus = speed * duration - distance
    if initial == final == speed and abs(surplus) <= _ROUNDING * distance:
        return VelocityProfile(speed, ((duration, speed),))
    up, down = (speed - initial) ** 2 / 2, (speed - final) ** 2 / 2
    if deceleration is not None:
        surplus -= down / deceleration
    weight = up if deceleration is not None else up + down
    above = speed > low and speed >= max(initial, final) and surplus > _ROUNDING * distance
    if not above or speed > high * (1 + _ROUNDING) or weight == 0:
        raise InfeasibleProfileError("speed", max(low, initial, final), high)
    inverse = surplus / weight
    if acceleration * inverse * (1 + _ROUNDING) < 1.0:
        raise InfeasibleProfileError("acceleration", 1.0 / inverse)
    rise = (speed - initial) * inverse
    fall = (speed - final) * inverse if deceleration is None else (speed - final) / deceleration
    return _three(initial, speed, final, rise, fall, duration)


def _speeds_of_duration(
    distance: float, initial: float, final: float, duration: float, deceleration: float | None
) -> tuple[float, float]:
    """Return the interval of speeds of `profile_of_speed`, from infinitely steep ramps to no cruise."""
    mean = distance / duration
    if deceleration is None:
        return mean, mean + math.hypot(mean - initial, mean - final) / math.sqrt(2)
    change = (final - initial) / deceleration
    roots = _roots(
        0.5 / deceleration, -duration - final / deceleration, distance + final**2 / (2 * deceleration)
    )
    high = (2 * distance - initial * duration + final * change) / (duration + change)
    return roots[0] if roots else math.inf, high


@comparable
class _ThreePartMotion:
    """A motion in three parts, of which the middle goes straight to its end and is still to be found.

    Attributes:
        before: Up to the first rest, where the start needs one; signed.
        after: From the last rest on, where the end needs one; signed.
        direction: 1 or -1: that of the middle.
        distance: Of the middle, along its direction; not negative, and long enough to change speed in.
        initial: Speed in which the middle begins.
        final: Speed in which it ends; the same as `initial` where the distance is zero.
        rates: What the middle may do.
    """

    before: VelocityProfile
    after: VelocityProfile
    direction: int
    distance: float
    initial: float
    final: float
    rates: MotionBounds

    def mirrored(self) -> _ThreePartMotion:
        before, after = self.before.mirrored(), self.after.mirrored()
        return replace(self, before=before, after=after, direction=-self.direction)

    def with_middle(self, middle: VelocityProfile) -> VelocityProfile:
        signed = middle if self.direction > 0 else middle.mirrored()
        return self.before.then(signed).then(self.after)


def _motion_parts(
    distance: float,
    initial: float,
    final: float,
    forward: MotionBounds,
    backward: MotionBounds,
    *,
    overshoot: bool,
) -> _ThreePartMotion:
    """Return the parts of a motion whose arguments are those of `fastest_profile`."""
    if distance < 0 or (distance == 0 and (initial < 0 or (initial == 0 and final < 0))):
        return _motion_parts(-distance, -initial, -final, backward, forward, overshoot=overshoot).mirrored()
    change = (initial - final) * (initial + final) / 2
    needed = change / forward.deceleration if change > 0 else -change / forward.acceleration
    fits = needed <= distance * (1 + _ROUNDING)
    if initial >= 0 and final >= 0 and fits:
        before, after = VelocityProfile(initial), VelocityProfile(final)
        return _ThreePartMotion(before, after, 1, distance, initial, final, forward)
    if initial >= 0 and not overshoot:
        reason = "turns" if final < 0 else "too_fast" if change > 0 else "too_slow"
        raise InfeasibleProfileError(reason, needed)
    brake = _ramp(initial, 0.0, forward if initial > 0 else backward)
    run_up = _ramp(0.0, final, forward if final > 0 else backward)
    first = initial < 0 or (final >= 0 and change > 0)
    if overshoot and initial * final < 0:  # one turn, where the brake ends or where the run-up begins
        first = (brake.distance > distance - run_up.distance) == (initial > 0)
    if first:
        other = _motion_parts(distance - brake.distance, 0.0, final, forward, backward, overshoot=overshoot)
        return replace(other, before=brake.then(other.before))
    other = _motion_parts(distance - run_up.distance, initial, 0.0, forward, backward, overshoot=overshoot)
    return replace(other, after=other.after.then(run_up))


def _ramp(initial: float, final: float, rates: MotionBounds) -> VelocityProfile:
    faster = abs(final) > abs(initial)
    rate = rates.acceleration if faster else rates.deceleration
    return VelocityProfile(initial, ((abs(final - initial) / rate, final),))


def _fastest_middle(motion: _ThreePartMotion) -> VelocityProfile:
    if motion.distance == 0:
        return VelocityProfile(motion.initial)
    distance, initial, final, rates = motion.distance, motion.initial, motion.final, motion.rates
    a, d = rates.acceleration, rates.deceleration
    square = (2 * a * d * distance + d * initial**2 + a * final**2) / (a + d)
    peak = max(math.sqrt(square), initial, final)
    if peak <= rates.speed * (1 + _ROUNDING):
        return VelocityProfile(initial, (((peak - initial) / a, peak), ((peak - final) / d, final)))
    cruise = rates.speed
    if min(initial, final) > cruise:
        cruise = max(cruise, _lowest_speed(motion))
    rise = abs(cruise - initial) / (a if cruise >= initial else d)
    fall = abs(cruise - final) / (d if cruise >= final else a)
    covered = (initial + cruise) / 2 * rise + (cruise + final) / 2 * fall
    flat = max(0.0, (distance - covered) / cruise)
    return VelocityProfile(initial, ((rise, cruise), (flat, cruise), (fall, final)))


def _middle_of_duration(motion: _ThreePartMotion, duration: float) -> VelocityProfile | None:
    """Return the middle that lasts `duration`, or None; a ramp may lead up to the cruise or down to it."""
    if motion.distance == 0:
        return VelocityProfile(0.0, ((duration, 0.0),)) if motion.initial == 0 and duration >= 0 else None
    if duration <= 0:
        return None
    a, d, initial, final = motion.rates.acceleration, motion.rates.deceleration, motion.initial, motion.final
    for first, second in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        up, down = (a if first > 0 else d), (d if second > 0 else a)
        square = first / (2 * up) + second / (2 * down)
        linear = duration + first * initial / up + second * final / down
        constant = motion.distance + first * initial**2 / (2 * up) + second * final**2 / (2 * down)
        for cruise in _roots(square, -linear, constant):
            slack = _ROUNDING * cruise
            rise, fall = abs(cruise - initial) / up, abs(cruise - final) / down
            fits = first * (cruise - initial) >= -slack and second * (cruise - final) >= -slack
            if cruise >= 0 and fits and rise + fall <= duration * (1 + _ROUNDING):
                return _three(initial, cruise, final, rise, fall, duration)
    return None


def _lowest_speed(motion: _ThreePartMotion) -> float:
    """Return where slowing down at once meets speeding up at the end; 0 where there is time to stop."""
    a, d = motion.rates.acceleration, motion.rates.deceleration
    square = (motion.initial**2 / d + motion.final**2 / a - 2 * motion.distance) * a * d / (a + d)
    return math.sqrt(max(0.0, square))


def _slowest_middle(motion: _ThreePartMotion) -> float:
    """Return how long the middle can last: as long as wanted where it may stop, or nearly so."""
    lowest = _lowest_speed(motion)
    if lowest == 0:
        return math.inf
    slowing, speeding = motion.initial - lowest, motion.final - lowest
    return max(0.0, slowing / motion.rates.deceleration + speeding / motion.rates.acceleration)


def _three(
    initial: float, cruise: float, final: float, rise: float, fall: float, duration: float
) -> VelocityProfile:
    """Return rise, cruise and fall within a duration; a cruise of rounding length is left out."""
    flat = duration - rise - fall
    if flat <= _ROUNDING * duration:
        rise, flat = duration - fall, 0.0
    return VelocityProfile(initial, ((rise, cruise), (flat, cruise), (fall, final)))


def _roots(a: float, b: float, c: float) -> list[float]:
    """Return the real roots of a x^2 + b x + c, smallest first."""
    if a == 0:
        return [-c / b] if b else []
    discriminant = b * b - 4 * a * c
    if discriminant < -_ROUNDING * b * b:
        return []
    if discriminant <= _DOUBLE * b * b:
        return [-b / (2 * a)]
    q = -(b + math.copysign(math.sqrt(discriminant), b)) / 2
    return sorted({q / a, c / q})
