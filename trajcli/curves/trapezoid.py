"""Trapezoidal velocity profiles of one variable: bounded speed and acceleration, given boundary velocities.

A profile is a velocity that is linear between knots; its position is a chain of parabolas (the slides' 2-1-2).
All functions look along the displacement: the distance is positive, or there is nothing to solve.

With boundary speeds w0, w1 >= 0, cruise speed V, and ramps of rate a (speeding up) and d (slowing down), the
motion covers D = V T - (V - w0)^2 / (2 a) - (V - w1)^2 / (2 d) in T = (V - w0)/a + (V - w1)/d + cruise.

Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), sections 3.2 and
3.2.7; Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, increasing


class InfeasibleProfileError(ValueError):
    """No profile exists.

    Attributes:
        reason: "too_fast" (cannot stop in time), "too_slow" (cannot reach the final speed in time), "turns" (ends
            against its direction), "speed" or "acceleration" (outside the interval), "duration" (too short).
        low: The number must be above this (or at least this, for accelerations and durations).
        high: The number must be at most this.
    """

    def __init__(self, reason: str, low: float = math.nan, high: float = math.inf) -> None:
        super().__init__(f"{reason}: outside [{low}, {high}]")
        self.reason, self.low, self.high = reason, low, high


@dataclass(frozen=True)
class Rates:
    """What a motion in one direction may do: all positive; speed may be infinite.

    Attributes:
        speed: Largest speed.
        acceleration: Rate of speeding up.
        deceleration: Rate of slowing down.
    """

    speed: float
    acceleration: float
    deceleration: float


@dataclass(frozen=True)
class Profile:
    """A velocity that is linear between knots.

    Attributes:
        knots: (duration of the stretch, velocity at its end) in order.
        initial: Velocity at the start.
    """

    initial: float
    knots: tuple[tuple[float, float], ...]

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

    def then(self, other: Profile) -> Profile:
        """Return this profile followed by another that starts with the velocity in which this one ends."""
        return Profile(self.initial, self.knots + other.knots)

    def mirrored(self) -> Profile:
        """Return the profile in the opposite direction."""
        return Profile(-self.initial, tuple((length, -velocity) for length, velocity in self.knots))

    def stretched(self, factor: float) -> Profile:
        """Return the profile that takes `factor` times as long over the same distance."""
        return Profile(self.initial / factor, tuple((t * factor, v / factor) for t, v in self.knots))

    def phases(self) -> list[tuple[str, float, float]]:
        """Return (name, start, end) of each stretch: accelerate, cruise, decelerate or rest."""
        named, start, before = [], 0.0, self.initial
        for length, velocity in self.knots:
            change = abs(velocity) - abs(before)
            flat = "cruise" if velocity else "rest"
            name = flat if change == 0 else "accelerate" if change > 0 else "decelerate"
            if length > 0:
                named.append((name, start, start + length))
            start, before = start + length, velocity
        return named

    def curve(self, start: float, end: float) -> PiecewisePolynomial:
        """Return the position (n = 1) from `start`; the last piece is laid to end exactly in `end`."""
        knots = [knot for knot in self.knots if knot[0] > 0]
        if not knots:
            return PiecewisePolynomial(np.zeros(2), np.full((1, 1, 1), start))
        breaks = increasing(np.concatenate([[0.0], np.cumsum([length for length, _ in knots])]))
        velocity = np.array([self.initial, *(v for _, v in knots)])
        lengths = np.array([length for length, _ in knots])
        position = start + np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * lengths)])
        position[1:] += (end - position[-1]) * breaks[1:] / breaks[-1]
        slope = np.diff(velocity) / np.diff(breaks)  # so that velocities meet where breaks are rounded
        coefficients: Array = np.stack([slope / 2, velocity[:-1], position[:-1]])[:, :, None]
        return PiecewisePolynomial(breaks, coefficients)


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
    if distance < 0 or (distance == 0 and (initial < 0 or (initial == 0 and final < 0))):
        mirrored = fastest_profile(-distance, -initial, -final, backward, forward, overshoot=overshoot)
        return mirrored.mirrored()
    if initial < 0:
        brake = _ramp(initial, 0.0, backward)
        return brake.then(
            fastest_profile(distance - brake.distance, 0.0, final, forward, backward, overshoot=overshoot)
        )
    if final < 0:
        if not overshoot:
            raise InfeasibleProfileError("turns")
        return _with_run_up(distance, initial, final, forward, backward)
    stopping = (initial**2 - final**2) / (2 * forward.deceleration)
    if stopping > distance * (1 + 1e-12):
        if not overshoot:
            raise InfeasibleProfileError("too_fast", stopping)
        brake = _ramp(initial, 0.0, forward)
        return brake.then(
            fastest_profile(distance - brake.distance, 0.0, final, forward, backward, overshoot=True)
        )
    if -stopping * forward.deceleration / forward.acceleration > distance * (1 + 1e-12):
        if not overshoot:
            raise InfeasibleProfileError("too_slow", -stopping * forward.deceleration / forward.acceleration)
        return _with_run_up(distance, initial, final, forward, backward)
    return _direct(distance, initial, final, forward)


def profile_of_duration(
    distance: float, initial: float, final: float, duration: float, rates: Rates
) -> Profile:
    """Return the profile over a positive `distance` that lasts `duration` with the given ramps.

    The cruise speed is what is looked for; it may lie below the boundary speeds. `rates.speed` is not used.

    Raises:
        InfeasibleProfileError: When the ramps are too flat for so short a duration (or so long a one, where the
            boundary speeds leave no room to stop); "acceleration" with the least one for rest to rest, else "duration".
    """
    a, d = rates.acceleration, rates.deceleration
    for first, second in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        up, down = (a if first > 0 else d), (d if second > 0 else a)
        square = first / (2 * up) + second / (2 * down)
        linear = duration + first * initial / up + second * final / down
        rest = distance + first * initial**2 / (2 * up) + second * final**2 / (2 * down)
        for cruise in _roots(square, -linear, rest):
            fits = (
                first * (cruise - initial) >= -1e-12 * cruise and second * (cruise - final) >= -1e-12 * cruise
            )
            ramps = abs(cruise - initial) / up + abs(cruise - final) / down
            if cruise > 0 and fits and ramps <= duration * (1 + 1e-12):
                return _three(
                    initial, cruise, final, abs(cruise - initial) / up, abs(cruise - final) / down, duration
                )
    if initial == 0 and final == 0:
        raise InfeasibleProfileError("acceleration", 2 * distance * (1 + a / d) / duration**2)
    shortest = fastest_profile(distance, initial, final, rates, rates).duration
    slowest = math.sqrt(max(0.0, _dip(distance, initial, final, rates)))
    longest = _three_through(initial, slowest, final, rates) if slowest else math.inf
    raise InfeasibleProfileError("duration", shortest, longest)


def signed_profile_of_duration(
    distance: float, initial: float, final: float, duration: float, forward: Rates, backward: Rates
) -> Profile:
    """Return the profile of `profile_of_duration` for a signed distance; running away is stopped first.

    Raises:
        InfeasibleProfileError: As `profile_of_duration`, or "turns" when it ends against its direction.
    """
    if distance < 0 or (distance == 0 and initial < 0):
        mirrored = signed_profile_of_duration(-distance, -initial, -final, duration, backward, forward)
        return mirrored.mirrored()
    if final < 0 or (distance == 0 and (initial or final)):
        raise InfeasibleProfileError("turns")
    if distance == 0:
        return Profile(0.0, ((duration, 0.0),))
    if initial >= 0:
        return profile_of_duration(distance, initial, final, duration, forward)
    brake = _ramp(initial, 0.0, backward)
    left = duration - brake.duration
    if left <= 0:
        raise InfeasibleProfileError(
            "duration", fastest_profile(distance, initial, final, forward, backward).duration
        )
    return brake.then(profile_of_duration(distance - brake.distance, 0.0, final, left, forward))


def profile_of_speed(
    distance: float,
    initial: float,
    final: float,
    duration: float,
    speed: float,
    deceleration: float | None = None,
) -> Profile:
    """Return the profile over a positive `distance` that lasts `duration` with cruise speed `speed`.

    The rate of the ramps is what is looked for: both the same, or that of speeding up where `deceleration` is given.

    Raises:
        InfeasibleProfileError: When the speed lies outside the interval that the duration allows.
    """
    low = distance / duration
    high = 2 * low - min(initial, final) if initial == final else math.inf
    surplus = speed * duration - distance
    up, down = (speed - initial) ** 2 / 2, (speed - final) ** 2 / 2
    if surplus <= 0 or speed > high * (1 + 1e-12) or speed < max(initial, final):
        raise InfeasibleProfileError("speed", low, high)
    inverse = (surplus - down / deceleration) / up if deceleration and up else surplus / (up + down)
    rise = (speed - initial) * inverse
    fall = (speed - final) / deceleration if deceleration else (speed - final) * inverse
    if inverse <= 0 or rise + fall > duration * (1 + 1e-12):
        raise InfeasibleProfileError("speed", low, high)
    return _three(initial, speed, final, rise, fall, duration)


def _three(initial: float, cruise: float, final: float, rise: float, fall: float, duration: float) -> Profile:
    flat = duration - rise - fall
    if flat <= 1e-12 * duration:
        rise, flat = duration - fall, 0.0
    return Profile(initial, ((rise, cruise), (flat, cruise), (fall, final)))


def _ramp(initial: float, final: float, rates: Rates) -> Profile:
    faster = abs(final) > abs(initial)
    rate = rates.acceleration if faster else rates.deceleration
    return Profile(initial, ((abs(final - initial) / rate, final),))


def _with_run_up(distance: float, initial: float, final: float, forward: Rates, backward: Rates) -> Profile:
    run_up = _ramp(0.0, final, forward if final > 0 else backward)
    before = fastest_profile(distance - run_up.distance, initial, 0.0, forward, backward, overshoot=True)
    return before.then(run_up)


def _direct(distance: float, initial: float, final: float, rates: Rates) -> Profile:
    a, d = rates.acceleration, rates.deceleration
    peak = math.sqrt(max(0.0, (2 * a * d * distance + d * initial**2 + a * final**2) / (a + d)))
    peak = max(peak, initial, final)
    if peak <= rates.speed:
        rise, fall = (peak - initial) / a, (peak - final) / d
        return Profile(initial, ((rise, peak), (fall, final)))
    cruise = rates.speed
    if min(initial, final) > cruise:
        cruise = max(cruise, math.sqrt(max(0.0, _dip(distance, initial, final, rates))))
    rise = abs(cruise - initial) / (a if cruise >= initial else d)
    fall = abs(cruise - final) / (d if cruise >= final else a)
    covered = (initial + cruise) / 2 * rise + (cruise + final) / 2 * fall
    return Profile(
        initial, ((rise, cruise), (max(0.0, (distance - covered) / cruise), cruise), (fall, final))
    )


def _dip(distance: float, initial: float, final: float, rates: Rates) -> float:
    """Return the square of the speed at which slowing down from `initial` meets speeding up to `final`."""
    a, d = rates.acceleration, rates.deceleration
    return (initial**2 / d + final**2 / a - 2 * distance) * a * d / (a + d)


def _three_through(initial: float, cruise: float, final: float, rates: Rates) -> float:
    return (initial - cruise) / rates.deceleration + (final - cruise) / rates.acceleration


def _roots(a: float, b: float, c: float) -> list[float]:
    """Return the real roots of a x^2 + b x + c, smallest first."""
    if a == 0:
        return [-c / b] if b else []
    discriminant = b * b - 4 * a * c
    if discriminant < -1e-12 * b * b:
        return []
    q = -(b + math.copysign(math.sqrt(max(0.0, discriminant)), b)) / 2
    return sorted({q / a, c / q} if q else {0.0})
