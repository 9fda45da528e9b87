"""Trapezoidal velocity profiles of one variable: bounded speed and acceleration, given boundary velocities.

Along the displacement, with boundary speeds w0, w1 >= 0, cruise speed V, and ramps of rate a (speeding up)
and d (slowing down), the motion covers D = V T - (V - w0)^2 / (2 a) - (V - w1)^2 / (2 d) in the time
T = (V - w0)/a + (V - w1)/d + cruise. What runs away from the target at the start, or must run up from
behind it at the end, is a ramp to or from rest before or after that.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), sections 3.2
and 3.2.7; Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
"""

from __future__ import annotations

import math
from dataclasses import replace

from trajcli.curves.velocity_profile import Profile, Rates
from trajcli.frozen import comparable

_ROUNDING = 1e-12  # relative: what a speed, a distance or a duration may miss its bound by
_DOUBLE = 1e-15  # relative: a discriminant this small is zero, and both roots are one


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
    distance: float, initial: float, final: float, forward: Rates, backward: Rates, *, overshoot: bool = False
) -> Profile:
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
    way = _way(distance, initial, final, forward, backward, overshoot=overshoot)
    return way.with_middle(_fastest_middle(way))


def profile_of_duration(
    distance: float,
    initial: float,
    final: float,
    duration: float,
    forward: Rates,
    backward: Rates,
    *,
    overshoot: bool = False,
) -> Profile:
    """Return the profile over a signed `distance` that lasts `duration` with the given ramps.

    The cruise speed is what is looked for; it may lie below the boundary speeds. The speeds of `forward` and
    `backward` are not used. Other arguments are those of `fastest_profile`.

    Raises:
        InfeasibleProfileError: As `fastest_profile`; "acceleration" with the least one when from rest to rest
            equal ramps are too flat; else "duration" with the shortest and the longest.
    """
    way = _way(distance, initial, final, forward, backward, overshoot=overshoot)
    around = way.before.duration + way.after.duration
    middle = _middle_of_duration(way, duration - around)
    if middle is not None:
        return way.with_middle(middle)
    equal = way.rates.acceleration == way.rates.deceleration
    if initial == 0 and final == 0 and equal:
        raise InfeasibleProfileError("acceleration", 4 * abs(distance) / duration**2)
    shortest = way.with_middle(_fastest_middle(way)).duration
    raise InfeasibleProfileError("duration", shortest, around + _slowest_middle(way))


def profile_of_speed(
    distance: float,
    initial: float,
    final: float,
    duration: float,
    speed: float,
    deceleration: float | None = None,
) -> Profile:
    """Return the profile over a positive `distance` that lasts `duration` with cruise speed `speed`.

    The rate of the ramps is what is looked for: both the same, or that of speeding up where `deceleration` is
    given. Boundary speeds are not negative, and not above the cruise speed.

    Raises:
        InfeasibleProfileError: "speed", when it lies outside the interval that the duration allows.
    """
    low, high = _speeds_of_duration(distance, initial, final, duration, deceleration)
    surplus = speed * duration - distance
    if initial == final == speed and abs(surplus) <= _ROUNDING * distance:
        return Profile(speed, ((duration, speed),))
    up, down = (speed - initial) ** 2 / 2, (speed - final) ** 2 / 2
    if deceleration is not None:
        surplus -= down / deceleration
    weight = up if deceleration is not None else up + down
    above = speed > low and speed >= max(initial, final) and surplus > _ROUNDING * distance
    if not above or speed > high * (1 + _ROUNDING) or weight == 0:
        raise InfeasibleProfileError("speed", max(low, initial, final), high)
    inverse = surplus / weight
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
class _Way:
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

    before: Profile
    after: Profile
    direction: int
    distance: float
    initial: float
    final: float
    rates: Rates

    def mirrored(self) -> _Way:
        """Return the way in the opposite direction."""
        before, after = self.before.mirrored(), self.after.mirrored()
        return replace(self, before=before, after=after, direction=-self.direction)

    def with_middle(self, middle: Profile) -> Profile:
        """Return the whole profile."""
        signed = middle if self.direction > 0 else middle.mirrored()
        return self.before.then(signed).then(self.after)


def _way(
    distance: float, initial: float, final: float, forward: Rates, backward: Rates, *, overshoot: bool
) -> _Way:
    if distance < 0 or (distance == 0 and (initial < 0 or (initial == 0 and final < 0))):
        return _way(-distance, -initial, -final, backward, forward, overshoot=overshoot).mirrored()
    change = (initial - final) * (initial + final) / 2
    needed = change / forward.deceleration if change > 0 else -change / forward.acceleration
    fits = needed <= distance * (1 + _ROUNDING)
    if initial >= 0 and final >= 0 and fits:
        before, after = Profile(initial), Profile(final)
        return _Way(before, after, 1, distance, initial, final, forward)
    if initial >= 0 and not overshoot:
        reason = "turns" if final < 0 else "too_fast" if change > 0 else "too_slow"
        raise InfeasibleProfileError(reason, needed)
    if initial < 0 or (final >= 0 and change > 0):
        brake = _ramp(initial, 0.0, forward if initial > 0 else backward)
        rest = _way(distance - brake.distance, 0.0, final, forward, backward, overshoot=overshoot)
        return replace(rest, before=brake.then(rest.before))
    run_up = _ramp(0.0, final, forward if final > 0 else backward)
    rest = _way(distance - run_up.distance, initial, 0.0, forward, backward, overshoot=overshoot)
    return replace(rest, after=rest.after.then(run_up))


def _ramp(initial: float, final: float, rates: Rates) -> Profile:
    faster = abs(final) > abs(initial)
    rate = rates.acceleration if faster else rates.deceleration
    return Profile(initial, ((abs(final - initial) / rate, final),))


def _fastest_middle(way: _Way) -> Profile:
    if way.distance == 0:
        return Profile(way.initial)
    distance, initial, final, rates = way.distance, way.initial, way.final, way.rates
    a, d = rates.acceleration, rates.deceleration
    square = (2 * a * d * distance + d * initial**2 + a * final**2) / (a + d)
    peak = max(math.sqrt(square), initial, final)
    if peak <= rates.speed * (1 + _ROUNDING):
        return Profile(initial, (((peak - initial) / a, peak), ((peak - final) / d, final)))
    cruise = rates.speed
    if min(initial, final) > cruise:
        cruise = max(cruise, _lowest_speed(way))
    rise = abs(cruise - initial) / (a if cruise >= initial else d)
    fall = abs(cruise - final) / (d if cruise >= final else a)
    covered = (initial + cruise) / 2 * rise + (cruise + final) / 2 * fall
    flat = max(0.0, (distance - covered) / cruise)
    return Profile(initial, ((rise, cruise), (flat, cruise), (fall, final)))


def _middle_of_duration(way: _Way, duration: float) -> Profile | None:
    """Return the middle that lasts `duration`, or None; a ramp may lead up to the cruise or down to it."""
    if way.distance == 0:
        return Profile(0.0, ((duration, 0.0),)) if way.initial == 0 and duration >= 0 else None
    if duration <= 0:
        return None
    a, d, initial, final = way.rates.acceleration, way.rates.deceleration, way.initial, way.final
    for first, second in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        up, down = (a if first > 0 else d), (d if second > 0 else a)
        square = first / (2 * up) + second / (2 * down)
        linear = duration + first * initial / up + second * final / down
        rest = way.distance + first * initial**2 / (2 * up) + second * final**2 / (2 * down)
        for cruise in _roots(square, -linear, rest):
            room = _ROUNDING * cruise
            rise, fall = abs(cruise - initial) / up, abs(cruise - final) / down
            fits = first * (cruise - initial) >= -room and second * (cruise - final) >= -room
            if cruise > 0 and fits and rise + fall <= duration * (1 + _ROUNDING):
                return _three(initial, cruise, final, rise, fall, duration)
    return None


def _lowest_speed(way: _Way) -> float:
    """Return where slowing down at once meets speeding up at the end; 0 where there is time to stop."""
    a, d = way.rates.acceleration, way.rates.deceleration
    square = (way.initial**2 / d + way.final**2 / a - 2 * way.distance) * a * d / (a + d)
    return math.sqrt(max(0.0, square))


def _slowest_middle(way: _Way) -> float:
    """Return how long the middle can last: as long as wanted where it may stop, or nearly so."""
    lowest = _lowest_speed(way)
    if lowest == 0:
        return math.inf
    slowing, speeding = way.initial - lowest, way.final - lowest
    return max(0.0, slowing / way.rates.deceleration + speeding / way.rates.acceleration)


def _three(initial: float, cruise: float, final: float, rise: float, fall: float, duration: float) -> Profile:
    flat = duration - rise - fall
    if flat <= _ROUNDING * duration:
        rise, flat = duration - fall, 0.0
    return Profile(initial, ((rise, cruise), (flat, cruise), (fall, final)))


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
