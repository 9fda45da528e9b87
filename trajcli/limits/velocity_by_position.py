"""Limits of velocity by position for all t, from the roots of polynomials.

A joint that is x before the end of its range may move towards it with at most max(0, sqrt(2 d x) - o). That
limit does not change when the move takes longer, so that the share of it that is used is the smallest stretch
that keeps it. Where a joint moves towards an end to which it is nearer than o^2 / (2 d), no stretch does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.approach import ApproachUse, approach_uses
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts, PlanningError, of_joint
from trajcli.findings import Finding, NamedJoints, at_time, excess_amounts, joint_amounts
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Limits, Robot
from trajcli.limits.kinds import LimitedMove, LimitFamily, LimitSurvey, Narrowing
from trajcli.limits.tolerances import exceeds
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.constraints import PathConstraint

_HOPELESS = 1e4  # a stretch that is larger is none: the limit there is next to nothing
_ROOM = 1e-10  # relative; a tenth of the tolerance of limits
_NONE = 1e-9  # SI: a velocity limit below it lets nothing move


@frozen
class ApproachSurvey(LimitSurvey):
    """Where joints use most of their limits, one use for each joint that has such a limit."""

    uses: tuple[ApproachUse, ...]

    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield where a joint moves faster towards the end of its range than its distance allows."""
        over = (use for use in self.uses if exceeds(abs(use.velocity), abs(use.limit)))
        return (approach_excess(joints, replace(use, time=use.time - origin)) for use in over)

    def excess(self) -> float:
        """Return by how much of a limit the joints are above it."""
        return max((use.used - (1 + _ROOM) for use in self.uses), default=-np.inf)


def approach_excess(joints: NamedJoints, use: ApproachUse) -> Finding:
    """Return where a joint is over its limit, with the sentence that says it."""
    joint, limit = use.component, use.limit + 0.0  # no -0
    where = "beyond" if use.distance < 0 else "before"
    rule = "where its limit is {limit}" if limit else "where it may not move towards it ({limit})"
    return Finding(
        kind="velocity_by_position",
        joint=joints.joint_names[joint],
        value=use.velocity,
        limit=limit,
        time=use.time,
        factor=use.used if use.used < _HOPELESS else None,
        message=f"the velocity of {{joint}} reaches {{value}} {at_time(use.time)}, "
        f"{{distance}} {where} the end of its range, {rule}",
        amounts={
            **joint_amounts(joints, joint, 0, distance=abs(use.distance)),
            **excess_amounts(joints, joint, 1, use.velocity, limit),
        },
    )


class ApproachFamily(LimitFamily):
    """Velocity by position."""

    def survey(self, move: LimitedMove) -> ApproachSurvey:
        """Return where joints use most of their limits in a move; one of no length uses nothing."""
        breaks, coefficients = move.pieces
        if not coefficients.shape[1]:
            return ApproachSurvey(())
        with np.errstate(over="ignore", invalid="ignore"):
            return ApproachSurvey(tuple(approach_uses(breaks, coefficients, move.limits.approach)))

    def over_at_ends(self, robot: Robot | None, ends: Sequence[State], use: tuple[str, int, float]) -> bool:
        """Return whether a joint is over its limit where the move declares to begin or to end."""
        del use
        return robot is not None and any(_joint_over(robot.limits, state) is not None for state in ends)

    def narrowing(self, limits: Limits, joint: int, order: int) -> Narrowing | None:
        """Return the velocities with which a joint may approach the ends of its range."""
        if order != 1 or not np.isfinite(limits.velocity_by_position[joint, 0]):
            return None

        def allowed(positions: Array) -> tuple[Array, Array]:
            low, high = limits.approach.bounds(positions)
            return low[:, joint], high[:, joint]

        return allowed

    def why_not_in_state(self, robot: Robot, state: State) -> tuple[str, Amounts] | None:
        """Return which joint is too fast for its distance from the end of its range."""
        joint = _joint_over(robot.limits, state)
        if joint is None:
            return None
        velocity = float(state.velocity[joint])
        bound = robot.limits.approach.bounds(state.position)[int(velocity > 0)]
        amounts: Amounts = {
            "joint": robot.joint_names[joint],
            "value": Amount(velocity, 1, joint),
            "limit": Amount(float(bound[joint]), 1, joint),
        }
        return (
            "{joint} {verb} with {value}; so near to its position limit at most {limit} is allowed",
            amounts,
        )

    def path_constraints(self, path: PiecewisePolynomial, robot: Robot) -> tuple[PathConstraint, ...]:
        """Return the rows of these limits for time-optimal laws.

        Raises:
            PlanningError: When the path leads a joint towards its position limit where it may not move there.
        """
        from trajcli.curves.time_optimal.constraints import ApproachConstraint

        limits = robot.limits.approach
        for use in approach_uses(path.breaks, path.coefficients, limits):
            if abs(use.limit) < _NONE < abs(use.velocity):
                message = (
                    "{joint} would move towards its position limit, {distance} from it, where it may not"
                )
                amounts = {"distance": Amount(max(use.distance, 0.0), 0, use.component)}
                hint = "keep further from the limit: velocity_by_position allows no motion towards it so near"
                raise PlanningError(of_joint(robot.joint_names[use.component], message, hint, amounts))
        return (ApproachConstraint(path, limits),)


FAMILY = ApproachFamily()


def _joint_over(limits: Limits, state: State) -> int | None:
    """Return the index of a joint that is over its limit in a state; None where none is."""
    low, high = limits.approach.bounds(state.position)
    over = np.flatnonzero(exceeds(state.velocity, high) | exceeds(-state.velocity, -low))
    return int(over[0]) if over.size else None
