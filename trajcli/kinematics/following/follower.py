"""Joint values, velocities and accelerations of an arm whose tool is on a given path.

At every place the joints solve the target's equations by Newton's method from a guess, then J q' = x' and
J q'' = x'' - J' q'. What the target leaves free, a tool's roll or the elbow of a seven-joint arm, is held:
the joint values keep their components along the directions that are free at the start. So q is a function of
the place on the path alone, the same forwards and backwards.

Source: Siciliano, Sciavicco, Villani and Oriolo, Robotics: Modelling, Planning and Control (2009), sections
3.5 and 3.7; Baillieul, Kinematic programming alternatives for redundant manipulators (ICRA 1985).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from trajcli.curves.piecewise import Array, Side
from trajcli.frozen import frozen
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.demand import Demand
from trajcli.kinematics.following.hand import NO_HAND, Hand, hand_of
from trajcli.kinematics.following.solved import Solved, acceleration_bias
from trajcli.kinematics.inverse.target import Target, residual_jacobian, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot

Demands = Callable[[Array, Side], Demand]

_ITERATIONS = 12
_NEAR = 1e-8  # rad or m: after a step as short as this Newton's method is at what rounding allows
_GOOD = 1e-10  # scaled residual that still counts as met where rounding is larger
_LONGEST = 0.5  # rad, or arm lengths, in one step
_ELSEWHERE = 0.25  # rad or m: joint values this far from the guess are on another branch
_RANK = 1e-6  # of the largest singular value: directions with less are free
_AROUND, _SPREAD = 4, 0.1  # configurations, rad or m: an arm is regular almost everywhere


class LostError(ValueError):
    """No joint values near the guess meet the target.

    Attributes:
        places: All places where that is so, ascending.
        joints: The nearest that was found at the first of them, shape (n,).
        missed: By how much it misses there: m, rad.
    """

    def __init__(self, places: Array, joints: Array, missed: tuple[float, float]) -> None:
        super().__init__(f"no joint values meet the target at {places[0]!r}")
        self.places = places
        self.joints = joints
        self.missed = missed


@frozen
class Follower:
    """An arm that follows a demand.

    Attributes:
        robot: The arm.
        demands: The tool at places (N,) of the path, from one side of breaks.
        start: Joint values at the beginning of the path, shape (n,).
        held: Unit directions of joint values that are kept, shape (f, n).
        hand: On which side of singular configurations the arm starts, and stays.
    """

    robot: Robot
    demands: Demands
    start: Array
    held: Array
    hand: Hand = NO_HAND

    @cached_property
    def length(self) -> float:
        """Length of the arm, m, by which positions are divided."""
        return characteristic_length(self.robot)

    def exact(self, places: Array, side: Side, guess: Array) -> Array:
        """Return joint values and their first and second derivative, shape (3, N, n).

        Args:
            places: Shape (N,).
            side: Which side of a break is meant.
            guess: Joint values nearby, shape (N, n).

        Raises:
            LostError: When no joint values near the guess meet the target.
        """
        return self.solved(places, side, guess).values

    def solved(self, places: Array, side: Side, guess: Array) -> Solved:
        """Return these values with what is known of the arm there.

        Raises:
            LostError: As `exact`.
        """
        demand = self.demands(places, side)
        target = demand.target()
        q, poses, columns, slopes = self._met(target, guess, places)
        other = self.hand.changed(demand, poses, slopes)
        if other.any():
            first_other = int(np.flatnonzero(other)[np.argmin(places[other])])
            raise LostError(np.sort(places[other]), q[first_other], (0.0, 0.0))
        first = self._divided(slopes, self._scaled(demand.rates(), target))
        bias = acceleration_bias(columns, first)
        twist = (columns @ first[..., None])[..., 0]
        second = self._divided(slopes, self._scaled(demand.accelerations(poses, bias, twist), target))
        return Solved(np.stack([q, first, second]), demand, target, columns)

    def _met(self, target: Target, guess: Array, places: Array) -> tuple[Array, Array, Array, Array]:
        """Return joint values (N, n) that meet the target, and there poses, Jacobians and scaled rows."""
        q, short = guess, False
        for iteration in range(_ITERATIONS + 1):
            poses, columns = linearisation(self.robot, q)
            slopes = self._rows(target, poses, columns)
            differences = residuals(target, poses)
            errors = self._scaled(differences, target, (self.start - q) @ self.held.T)
            if short or iteration == _ITERATIONS:
                break
            step = self._divided(slopes, errors)
            q = q + np.clip(step, -_LONGEST, _LONGEST)
            short = bool((np.abs(step) <= _NEAR).all())
        size = np.abs(errors).max(axis=1)
        lost = ~(size <= _GOOD) | (np.abs(q - guess).max(axis=1) > _ELSEWHERE)
        if lost.any():
            first = int(np.flatnonzero(lost)[np.argmin(places[lost])])
            split = sum(target.position)
            parts = differences[first, :split], differences[first, split:]
            missed = float(np.linalg.norm(parts[0])), float(np.linalg.norm(parts[1]))
            raise LostError(np.sort(places[lost]), q[first], missed)
        return q, poses, columns, slopes

    def rows(self, demand: Demand, poses: Array, columns: Array) -> Array:
        """Return the scaled rows (N, m + f, n) of tcp poses (N, 4, 4) and Jacobians (N, 6, n) in world."""
        return self._rows(demand.target(), poses, columns)

    def _rows(self, target: Target, poses: Array, columns: Array) -> Array:
        rows = residual_jacobian(target, poses, columns)
        rows[:, : sum(target.position)] /= self.length
        if not len(self.held):
            return rows
        kept = np.broadcast_to(self.held, (len(poses), *self.held.shape))
        return np.concatenate([rows, kept], axis=1)

    def _scaled(self, rates: Array, target: Target, kept: Array | None = None) -> Array:
        """Return rates of the target's rows, those of the position by length, with those that are kept."""
        if kept is None:
            kept = np.zeros((len(rates), len(self.held)))
        scaled = np.concatenate([rates, kept], axis=1)
        scaled[:, : sum(target.position)] /= self.length
        return scaled

    @staticmethod
    def _divided(slopes: Array, rates: Array) -> Array:
        """Return the joint rates (N, n) that have the given rates of the rows (N, m)."""
        if slopes.shape[1] == slopes.shape[2]:
            try:
                return np.asarray(np.linalg.solve(slopes, rates[..., None])[..., 0])
            except np.linalg.LinAlgError:
                pass
        return np.asarray((np.linalg.pinv(slopes, rcond=1e-12) @ rates[..., None])[..., 0])


def follower(robot: Robot, demands: Demands, start: Array, place: float) -> Follower:
    """Return the follower that begins in joint values `start` (n,) at a place of the path.

    Args:
        robot: The arm.
        demands: The tool along the path.
        start: Joint values there, which meet the demand.
        place: The beginning of the path.
    """
    bare = Follower(robot, demands, start, np.empty((0, start.size)))
    demand = demands(np.array([place]), "right")
    here = linearisation(robot, start[None])
    # sines of whole numbers are as good as random ones, and need no generator to be loaded
    spread = np.sin(np.arange(1, _AROUND * start.size + 1)).reshape(_AROUND, start.size)
    around = start + _SPREAD * spread
    nearby = bare.rows(demands(np.full(_AROUND, place), "right"), *linearisation(robot, around))
    values = np.linalg.svd(nearby, compute_uv=False)
    rank = int((values > _RANK * values[:, :1]).sum(axis=1).max())
    _, _, right = np.linalg.svd(bare.rows(demand, *here)[0])
    held = Follower(robot, demands, start, right[rank:])
    return replace(held, hand=hand_of(demand, here[0], held.rows(demand, *here)))
