"""Kinds of limits: where each stands, in which unit, how it scales with time, and who judges it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from importlib import import_module
from math import isfinite
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amounts
from trajcli.findings import Finding, NamedJoints, at_time
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Limits, Robot
from trajcli.trajectory import MoveInterval, Promise, Span, State, Trajectory

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.constraints import PathConstraint
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.kinematics.zone import ZoneAround


ToolLimit = Literal["speed", "acceleration", "jerk", "angular_speed", "angular_acceleration", "angular_jerk"]
"""Keys of the limits of the tool."""
_RATES = ("", "/s", "/s^2", "/s^3")
ScaleFactor = Literal["velocity", "acceleration", "jerk"]


@comparable
class LimitKind:
    """One kind of limit.

    Attributes:
        name: In findings, events and reports.
        family: Module of `trajcli.limits` that judges it, together with others.
        order: Of the derivative of a position, or of an angle, in whose unit it is; None for torques and
            forces.
        factor: Under `limits.scale`, by which it is multiplied; None for none.
        picture: Which panel of a picture shows it: the column of a joint, or a speed of the tool; None for
            none.
        planned: Which planners keep it themselves: all, those of paths of the tool, or none; by others a move
            that finds its duration is stretched to it.
    """

    name: str
    family: str
    order: int | None
    factor: ScaleFactor | None = None
    picture: str | None = None
    planned: Literal["always", "on paths", "never"] = "always"

    @property
    def of_tool(self) -> bool:
        """Whether it bounds the tool, not a joint."""
        return self.name.startswith("tool_")

    @property
    def key(self) -> str:
        """Where it stands under `limits`, or under `limits.tcp`."""
        return self.name.removeprefix("tool_")

    @property
    def words(self) -> str:
        """What people call it."""
        return self.key.replace("_", " ")

    @property
    def event(self) -> str:
        """Kind of the event of a move that is stretched to it."""
        return f"within_{self.family}" + ("" if "_by_" in self.family else "_limits")

    @property
    def dimension(self) -> Literal["length", "angle"]:
        """Of a limit of the tool: what its unit measures, over a power of the time."""
        return "angle" if self.key.startswith("angular_") else "length"

    @property
    def unit(self) -> str:
        """Of a limit of the tool, SI."""
        return ("rad" if self.dimension == "angle" else "m") + _RATES[self.order or 0]

    def stated(self, limits: Limits) -> bool:
        """Return whether somebody stated such a limit."""
        if self.of_tool:
            return isfinite(getattr(limits.tcp, self.key))
        bounds: Array = getattr(limits, self.key)
        return bool(np.isfinite(bounds[:, :1] if self.name == "velocity_by_position" else bounds).any())


KINDS = (
    LimitKind("position", "joints", 0, None, "q"),
    LimitKind("velocity", "joints", 1, "velocity", "qd"),
    LimitKind("acceleration", "joints", 2, "acceleration", "qdd"),
    LimitKind("jerk", "joints", 3, "jerk", "qddd"),
    LimitKind("velocity_by_position", "velocity_by_position", 1, "velocity", "qd", "never"),
    LimitKind("effort", "effort", None, None, "tau", "never"),
    LimitKind("tool_speed", "tool", 1, "velocity", "speed", "on paths"),
    LimitKind("tool_angular_speed", "tool", 1, "velocity", "angular speed", "on paths"),
    LimitKind("tool_acceleration", "tool", 2, "acceleration", None, "on paths"),
    LimitKind("tool_angular_acceleration", "tool", 2, "acceleration", None, "on paths"),
    LimitKind("tool_jerk", "tool", 3, "jerk", None, "never"),
    LimitKind("tool_angular_jerk", "tool", 3, "jerk", None, "never"),
)
"""All of them, in the order in which they are judged."""

KIND_OF: Mapping[str, LimitKind] = {kind.name: kind for kind in KINDS}
JOINT_KINDS = tuple(kind for kind in KINDS if not kind.of_tool)
LIMITS_OF_JOINTS = frozenset(kind.name for kind in JOINT_KINDS)
STRETCHABLE = frozenset(kind.name for kind in KINDS if kind.order != 0)
"""Kinds of findings that a longer time may take away."""
TOOL_KINDS = tuple(kind for kind in KINDS if kind.of_tool)
SPEED_KINDS = tuple(kind for kind in TOOL_KINDS if kind.picture)
"""Those of the tool that pictures show: its speed and its angular speed."""


class LimitSurvey(ABC):
    """What a motion uses of the limits of one family."""

    @abstractmethod
    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield a finding for each limit that the motion does not keep.

        Args:
            joints: Of the motion.
            origin: Time on its curve from which times of findings count, s.
        """

    @abstractmethod
    def excess(self) -> float:
        """Return by what part of a limit the motion is above it; what is at most 0 passes as verified."""


@frozen
class LimitedMove:
    """A move of a trajectory, and the limits in force.

    Attributes:
        trajectory: The whole.
        span: The move.
        limits: In force.
        robot: The arm, with the same limits; None where nobody says.
        motion: The reference motion of the tool along a path; None in joint space.
    """

    trajectory: Trajectory
    span: Span
    limits: Limits
    robot: Robot | None = None
    motion: ToolMotion | None = None

    @cached_property
    def numbers(self) -> tuple[int, int]:
        """Of the first piece of its curve, and of the one behind its last; equal where it has no length."""
        curve = self.trajectory.curve
        middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
        first, last = np.searchsorted(middles, [self.span.start, self.span.end]).tolist()
        return first, last

    @property
    def pieces(self) -> tuple[Array, Array]:
        """Breaks (w + 1,) and coefficients (degree + 1, w, n) of its curve."""
        (first, last), curve = self.numbers, self.trajectory.curve
        return curve.breaks[first : last + 1], curve.coefficients[:, first:last]


Narrowing = Callable[[Array], tuple[Array, Array]]
"""Returns the least and the largest value allowed, each (N,), where all joints are at positions (N, n)."""


class LimitFamily(ABC):
    """Judge of some kinds of limits. Those that stand alone have a family of one."""

    @abstractmethod
    def survey(self, move: LimitedMove) -> LimitSurvey | None:
        """Return what a move uses of its limits; None where they cannot be judged in it."""

    def over_at_ends(self, robot: Robot | None, ends: Sequence[State], use: tuple[str, int, float]) -> bool:
        """Return whether a move is over a limit in the states in which it begins or ends.

        No duration helps against that.

        Args:
            robot: With the limits in force; None where nobody says.
            ends: These states.
            use: Kind of the limit, index of the joint (-1 for the tool), and the limit.
        """
        del robot, ends, use
        return False

    def narrowing(self, limits: Limits, joint: int, order: int) -> Narrowing | None:
        """Return by what the limits of a derivative of a joint are narrowed; None where they are not.

        Pictures show it.
        """
        del limits, joint, order
        return None

    def why_not_in_state(self, robot: Robot, state: State) -> tuple[str, Amounts] | None:
        """Return what is said of a joint that is over a limit in a state; None where none is.

        In the message `{verb}` stands for "starts" or "ends".
        """
        del robot, state
        return None

    def path_constraints(self, path: PiecewisePolynomial, robot: Robot) -> tuple[PathConstraint, ...]:
        """Return the rows of these limits for time-optimal laws along a path q(s); none unless said here.

        Raises:
            PlanningError: When no law whatever keeps them.
        """
        del path, robot
        return ()


def path_constraints(path: PiecewisePolynomial, robot: Robot) -> tuple[PathConstraint, ...]:
    """Return the rows for time-optimal laws along a path q(s) of the limits that joints have besides rates.

    Args:
        path: q(s).
        robot: With the limits in force.

    Raises:
        PlanningError: When no law whatever keeps one of them.
    """
    kinds = (each for _, each in families(robot.limits, further=True))
    return tuple(row for each in kinds for row in each.path_constraints(path, robot))


def narrowings(limits: Limits, joint: int, order: int) -> list[Narrowing]:
    """Return all by which the limits of a derivative of a joint are narrowed."""
    every = (each.narrowing(limits, joint, order) for _, each in families(limits, further=True))
    return [each for each in every if each is not None]


def family(name: str) -> LimitFamily:
    """Return a family by its name; its module is loaded when it is first asked for."""
    loaded: LimitFamily = import_module(f"trajcli.limits.{name}").FAMILY
    return loaded


def has_further_limits(limits: Limits) -> bool:
    """Return whether a limit is stated that not every planner keeps itself."""
    return any(kind.planned != "always" for kind in _stated(limits))


def families(limits: Limits, *, further: bool = False) -> Iterator[tuple[str, LimitFamily]]:
    """Yield the families of which a limit is stated.

    Args:
        limits: In force.
        further: Leave out those that every planner keeps itself.
    """
    stated = [kind.family for kind in _stated(limits) if not (further and kind.planned == "always")]
    for name in dict.fromkeys(stated):
        yield name, family(name)


@lru_cache(maxsize=8)  # the moves of a job have the same limits, nearly all
def _stated(limits: Limits) -> tuple[LimitKind, ...]:
    return tuple(kind for kind in KINDS if kind.stated(limits))


def check_flown(trajectory: Trajectory, promises: Sequence[Promise]) -> Iterator[Finding]:
    """Yield what is wrong with the parts of moves that fly by corners.

    Args:
        trajectory: What to judge.
        promises: What each span says of itself.
    """
    for span, promise in zip(trajectory.spans, promises, strict=True):
        for part in promise.parts:
            move = limited_part(trajectory, span, part)
            if move.span.duration > 0:
                yield from part_findings(move, part.around)


def limited_part(trajectory: Trajectory, span: Span, part: MoveInterval) -> LimitedMove:
    """Return a part of a move with its limits."""
    within = replace(span, start=span.start + part.start, end=min(span.start + part.end, span.end))
    return LimitedMove(trajectory, within, part.robot.limits, part.robot, part.tool)


def part_findings(move: LimitedMove, around: ZoneAround | None) -> Iterator[Finding]:
    """Yield the limits that a part of a move does not keep, and where it leaves its zone.

    Args:
        move: The part.
        around: Its zone; None on a path.
    """
    for _, family in families(move.limits):
        survey = family.survey(move)
        if survey is not None:
            for finding in survey.over(move.trajectory, move.trajectory.curve.start):
                yield replace(finding, move=move.span.index)
    if around is None:
        return
    from trajcli.kinematics.zone import ZONE_RELATIVE

    share, when = around.largest_share(PiecewisePolynomial(*move.pieces))
    if share <= 1 + ZONE_RELATIVE:
        return
    how = f"{share:.9g} times as far from its corner as it may be"
    yield Finding(
        move=move.span.index,
        kind="zone",
        value=share,
        limit=1.0,
        time=when,
        method="bounded",
        hint="this is a bug: report it",
        message=f"the motion leaves its zone: it is {how} {at_time(when)}",
    )
