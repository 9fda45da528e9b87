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
from dataclasses import dataclass, replace

import numpy as np

from trajcli.curves.piecewise import Array, Side
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.demand import Demand
from trajcli.kinematics.following.hand import NO_HAND, Hand, hand_of
from trajcli.kinematics.inverse.target import residual_jacobian, residuals
from trajcli.kinematics.jacobian import jacobian_dot_qd, linearisation
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


@dataclass(frozen=True, eq=False)
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

    def exact(self, places: Array, side: Side, guess: Array) -> Array:
        """Return joint values and their first and second derivative, shape (3, N, n).

        Args:
            places: Shape (N,).
            side: Which side of a break is meant.
            guess: Joint values nearby, shape (N, n).

        Raises:
            LostError: When no joint values near the guess meet the target.
        """
        demand = self.demands(places, side)
        q, poses, columns = self._solved(demand, guess, places)
        slopes = self.rows(demand, poses, columns)
        other = self.hand.changed(demand, poses, slopes)
        if other.any():
            first_other = int(np.flatnonzero(other)[np.argmin(places[other])])
            raise LostError(np.sort(places[other]), q[first_other], (0.0, 0.0))
        first = self._divided(slopes, self._scaled(demand.rates(), demand))
        bias = jacobian_dot_qd(self.robot, q, first)
        twist = (columns @ first[..., None])[..., 0]
        second = self._divided(slopes, self._scaled(demand.accelerations(poses, bias, twist), demand))
        return np.stack([q, first, second])

    def _solved(self, demand: Demand, guess: Array, places: Array) -> tuple[Array, Array, Array]:
        """Return joint values (N, n), poses of the tcp and Jacobians there."""
        target = demand.target()
        q = guess.copy()
        poses, columns = linearisation(self.robot, q)
        for _ in range(_ITERATIONS):
            errors = self._errors(demand, poses, q)
            step = self._divided(self.rows(demand, poses, columns), errors)
            q = q + np.clip(step, -_LONGEST, _LONGEST)
            poses, columns = linearisation(self.robot, q)
            if (np.abs(step) <= _NEAR).all():
                break
        size = np.abs(self._errors(demand, poses, q)).max(axis=1)
        lost = ~(size <= _GOOD) | (np.abs(q - guess).max(axis=1) > _ELSEWHERE)
        if lost.any():
            first = int(np.flatnonzero(lost)[np.argmin(places[lost])])
            difference = residuals(target.rows([first]), poses[[first]])[0]
            split = sum(demand.position)
            missed = float(np.linalg.norm(difference[:split])), float(np.linalg.norm(difference[split:]))
            raise LostError(np.sort(places[lost]), q[first], missed)
        return q, poses, columns

    def _errors(self, demand: Demand, poses: Array, q: Array) -> Array:
        differences = residuals(demand.target(), poses)
        kept = (self.start - q) @ self.held.T
        return np.concatenate([self._by_length(differences, demand), kept], axis=1)

    def rows(self, demand: Demand, poses: Array, columns: Array) -> Array:
        """Return the scaled rows (N, m + f, n) of tcp poses (N, 4, 4) and Jacobians (N, 6, n) in world."""
        rows = residual_jacobian(demand.target(), poses, columns)
        rows[:, : sum(demand.position)] /= characteristic_length(self.robot)
        kept = np.broadcast_to(self.held, (len(poses), *self.held.shape))
        return np.concatenate([rows, kept], axis=1)

    def _scaled(self, rates: Array, demand: Demand) -> Array:
        still = np.zeros((len(rates), len(self.held)))
        return np.concatenate([self._by_length(rates, demand), still], axis=1)

    def _by_length(self, rows: Array, demand: Demand) -> Array:
        scaled = rows.copy()
        scaled[:, : sum(demand.position)] /= characteristic_length(self.robot)
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
