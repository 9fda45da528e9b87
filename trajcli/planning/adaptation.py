"""Moves planned for what a consumer makes of their rows: within tighter limits, or from row to row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import KIND_OF
from trajcli.planners.flying_by import FlownChain
from trajcli.planners.planner import Planned, PlannedMove
from trajcli.planning.retime import slow_to_limits, with_duration
from trajcli.trajectory import State

Cap = tuple[int, str, int]
"""What is tightened: index of a move, kind of a limit, index of a joint, -1 for the tool."""


@frozen
class Adaptation:
    """By what moves are planned otherwise than their limits alone say.

    Attributes:
        caps: Magnitudes within which they are planned, SI. Of bounds that differ by direction it is the
            larger one's, and the other one is as many times tighter.
        stretches: How many times longer a move lasts behind that, by its index.
        period: Of rows on which the breaks of their curves shall fall, s; None for any.
        planned: Moves that were planned already, with all that they depend on, their rows too.
        fastest: Likewise, as their planners and limits make them, by `key`.
        chains: Chains that fly by corners, likewise, before they are stretched.
    """

    caps: Mapping[Cap, float] = field(default_factory=dict)
    stretches: Mapping[int, float] = field(default_factory=dict)
    period: float | None = None
    planned: dict[Any, PlannedMove] = field(default_factory=dict)
    fastest: dict[Any, PlannedMove] = field(default_factory=dict)
    chains: dict[Any, FlownChain] = field(default_factory=dict)

    @property
    def changes_nothing(self) -> bool:
        """Whether moves are planned as their limits alone say."""
        return not self.caps and not self.stretches and self.period is None

    def note_repeated(self, before: int, move: int, start: State, grid: tuple[float, bool]) -> None:
        """Note that a move is the same motion as one before, with the same start and nothing changed."""
        for noted, key, other in (
            (self.planned, self.whole_key(before, start, grid), self.whole_key(move, start, grid)),
            (self.fastest, self.key(before, start), self.key(move, start)),
        ):
            if key in noted:
                noted[other] = replace(noted[key], index=move)

    def where_slowed(self) -> Adaptation:
        """Return what is known of moves that nothing changed, slowed where they are over a limit."""
        slowed = {
            key: slow_to_limits(replace(move, over_limit="slow"))
            for key, move in self.fastest.items()
            if move.planner.when_over_limit is None
        }
        return Adaptation(fastest=slowed, chains=self.chains)

    def tightens(self, move: int) -> bool:
        """Return whether a limit of a move is tightened."""
        return any(index == move for index, _, _ in self.caps)

    def key(self, move: int, start: State) -> Any:  # noqa: ANN401
        """Return what the fastest curve of a move depends on beside the job: its start, and its limits."""
        own = ((*key[1:], cap) for key, cap in self.caps.items() if key[0] == move)
        return move, start.bits, tuple(sorted(own))

    def whole_key(self, move: int, start: State, grid: tuple[float, bool]) -> Any:  # noqa: ANN401
        """Return all that a move depends on beside the job: also its rows, and how it is stretched."""
        return *self.key(move, start), grid, self.stretches.get(move, 1.0), self.period

    def chain_key(self, moves: Sequence[PlannedMove]) -> Any:  # noqa: ANN401
        """Return what the fastest motion by the corners of some moves depends on beside the job."""
        return tuple(self.key(move.index, move.start) for move in moves)

    def stretched(self, move: PlannedMove) -> PlannedMove:
        """Return a move that lasts longer, where it shall."""
        factor = self.stretches.get(move.index, 1.0)
        return move if factor == 1 or move.duration == 0 else with_duration(move, move.duration * factor)

    def within(self, robot: Robot, move: int) -> Robot:
        """Return the robot with the limits within which a move is planned."""
        limits = robot.limits
        for (index, name, joint), cap in self.caps.items():
            if index != move:
                continue
            kind = KIND_OF[name]
            if kind.of_tool:
                limits = replace(limits, tcp=replace(limits.tcp, **{kind.key: cap}))
                continue
            bounds = np.array(getattr(limits, kind.key))
            if name == "velocity_by_position":
                bounds[joint, 0] = cap
            else:
                nearer = cap * proportions(bounds[joint])
                bounds[joint] = np.clip(bounds[joint], -nearer, nearer)
            changed: dict[str, Any] = {kind.key: bounds}
            limits = replace(limits, **changed)
        return robot if limits is robot.limits else replace(robot, limits=limits)


def proportions(bounds: Array) -> Array:
    """Return how large the bounds (2,) of a joint are beside the larger one; 1 for infinite ones."""
    sizes = np.abs(bounds)
    finite = np.isfinite(sizes)
    return np.where(finite, sizes, 1.0) / np.where(finite, sizes[finite].max(initial=0.0), 1.0)


def without_bounds(planned: Planned) -> Planned:
    """Return a motion within tightened limits without what it says of the fastest within them."""
    events = tuple(event for event in planned.events if event.kind != "bound")
    return replace(planned, events=events, certificate=None, binding_phases=False)
