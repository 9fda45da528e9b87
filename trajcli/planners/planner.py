"""Contract of planners: what each is given and what it returns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts, PlanningError, Problem, said
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Payload, Robot
from trajcli.language.limits import LimitsSpec
from trajcli.language.numbers import Model, Name
from trajcli.language.zones import SignalsField, ZoneField
from trajcli.trajectory import Destination, MoveInterval, Promise, Span, State, Trajectory, ViaPoints

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.phase_plane import PhasePlane
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.language.targets import Target
    from trajcli.planners.course import Course

Resolve = Callable[["Target", Array], "Target"]
WhenOverLimit = Literal["error", "slow"]
_REMARKS = frozenset(
    ("refined", "bound", "fastest_found", "zone_stops", "branch_taken", "weave_fitted", "own_tool_replaced")
)  # kinds of events that are about how a curve was computed, and concede nothing
_GIVEN = ("duration", "velocity", "acceleration", "deceleration", "timed")  # where they say how long it lasts
_WHOLE = 1e-3  # of a hundredth of a percent: what rounding may put above a proven bound
LITTLE = 1e-3
"""Relative: a law that is stretched by less still counts as the fastest."""


@comparable
class Phase:
    """A named interval of a move.

    Attributes:
        name: Such as "accelerate", "cruise", "jerk +".
        start: Seconds from the start of the move.
        end: Seconds from the start of the move.
        joint: Index of the joint it is about; None when it is about all of them.
        point: Index of the point that it rounds, among the via points; None where it rounds none.
    """

    name: str
    start: float
    end: float
    joint: int | None = None
    point: int | None = None


@comparable
class Event:
    """A concession, which would otherwise go unnoticed; or a remark on how a curve was computed.

    Attributes:
        kind: A stable word for programs, such as "slowed".
        message: One sentence for people, with the numbers.
        move: Index of the move; None when it is about the whole job.
        amounts: Numbers and names that the message holds as `{name}`.
    """

    kind: str
    message: str
    move: int | None = None
    amounts: Amounts = field(default_factory=dict)

    @property
    def concedes(self) -> bool:
        """Whether anything was given up: a finer grid, or a law a thousandth longer, gives up nothing."""
        return self.kind not in _REMARKS

    @property
    def is_internal(self) -> bool:
        """Whether it is about the computation alone, and nothing that the motion does or keeps."""
        return self.kind in ("refined", "bound")

    def text(self, say: Callable[[Amount], str] = str) -> str:
        """Return the message with its amounts said by `say`."""
        return said(self.message, self.amounts, say)


def stretched(factor: float) -> Event:
    """Return the event of a time-optimal law that lasts `factor` times longer than it was computed."""
    return Event("stretched", f"stretched {factor:.9g} times to keep all limits between grid points")


@frozen
class Certificate:
    """What is known of how near a motion through points is to the fastest.

    Attributes:
        lower: No motion through the points within the limits is faster, s.
        joint: Index of the joint that needs so long; None where several together do.
        found: Durations to which the starting points of the search led, s, infinite where one led to none.
        agreeing: How many of these are the motion's, or longer by a thousandth at most.
        stopping: Duration of the motion that stops at each point, s; infinite where there is none.
        off_chords: By how much each joint leaves the straight chords between the points at most, shape (n,).
        off_times: Where it does, s from the start of the move, shape (n,).
        polyline: Whether it keeps to the straight chords, so that only such motions are compared.
    """

    lower: float
    joint: int | None
    found: tuple[float, ...]
    agreeing: int
    stopping: float
    off_chords: Array
    off_times: Array
    polyline: bool = False

    def remark(self, duration: float, names: Sequence[str]) -> Event:
        """Return the event that says this of a motion of `duration` seconds of joints of these names."""
        near = "nothing is known of the fastest possible"
        if self.lower > 0:
            above = max(math.ceil(1e4 * (duration / self.lower - 1) - _WHOLE) / 100, 0.0)
            where = " along the polyline" if self.polyline else ""
            near = f"at most {above:.6g} % above the fastest possible{where}, {{lower}}"
        starts = f"{self.agreeing} of {len(self.found)} starting points agree"
        stops = "" if np.isinf(self.stopping) else "; stopping at each point takes {stopping}"
        joint = int(self.off_chords.argmax())
        amounts: Amounts = {
            "lower": Amount(self.lower, rounded="down"),
            "stopping": Amount(self.stopping),
            "off": Amount(float(self.off_chords[joint]), 0, joint),
            "joint": names[joint],
            "time": Amount(float(self.off_times[joint])),
        }
        message = f"{near}; {starts}{stops}; it leaves the chords by up to {{off}} ({{joint}} at {{time}})"
        return Event("fastest_found", message, amounts=amounts)

    def scaled(self, factor: float) -> Certificate:
        """Return what is known of the motion that takes `factor` times as long."""
        return replace(self, off_times=self.off_times * factor)


@frozen
class Planned:
    """What a planner returns.

    Attributes:
        curve: q(t) from t = 0 to the move's duration.
        end: The state in which the move declares to end.
        law: s(t) with values in [0, 1] where one law moves all joints along a straight line, else None.
        phases: Named intervals, in order of time.
        events: Concessions.
        arrivals: Seconds after which each joint alone has arrived, shape (n,); None where all share one law.
        via_points: The points that it passes between start and target, where it has any.
        origin: Where the zero of the planner's own time lies on the curve, s: above zero where the motion had
            to begin before it.
        begins: The state in which the curve begins where the method does not let its start be imposed.
        ends_open: Whether the method says the velocity in which it ends, as nobody states one.
        tool: The reference motion of the tool, where the move follows a path of it.
        wanted_speed: Speed along the tool's path that is asked for, m/s, or rad/s where the tool turns in
            its place; None where none is.
        formulas: s(t) in words of mathematics with `{T}` for the duration, where the curve is a fit of
            q0 + dq s(t) with another law than a polynomial; behind it those of ds/dt and d2s/dt2.
        virtual: Indices of the breaks of the curve that are virtual points of a spline.
        one_piece_per_interval: Whether equal polynomials that follow each other are one each, as between
            the points of a spline.
        binding_phases: Whether the phases say, one after the other, which limit binds.
        no_lower_bound: Why nothing is known of the shortest duration between its end states.
        remedies: What would help against a finding, by its kind, where that depends on the method.
        virtual_points: Points that the method adds to those that it is given.
        phase_plane: Of a time-optimal law: the law s(t), and what limits it.
        braking: How a start outside the velocity or acceleration limits is brought inside first: by each
            joint, or by all on one line; None where it is not.
        continuity: Derivatives that join inside it, where they are fewer than its planner promises.
        certificate: Of a motion that was searched for: how near to the fastest it is.
        parts: Where it flies by a corner: what is on its path, and what within a zone.
    """

    curve: PiecewisePolynomial
    end: State
    law: PiecewisePolynomial | None = None
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()
    arrivals: tuple[float, ...] | None = None
    via_points: ViaPoints | None = None
    origin: float = 0.0
    begins: State | None = None
    ends_open: bool = False
    tool: ToolMotion | None = None
    wanted_speed: float | None = None
    formulas: tuple[str, str, str] | None = None
    virtual: tuple[int, ...] = ()
    one_piece_per_interval: bool = False
    binding_phases: bool = False
    no_lower_bound: str | None = None
    remedies: Mapping[str, str] = field(default_factory=dict)
    virtual_points: ViaPoints | None = None
    phase_plane: PhasePlane | None = None
    braking: Literal["each", "line"] | None = None
    continuity: Literal[1, 2] | None = None
    certificate: Certificate | None = None
    parts: tuple[MoveInterval, ...] = ()


class Planner(Model):
    """A method of planning one move: its fields are its parameters, in SI.

    Adding one takes a file here with a subclass, a line in `planners/__init__.py`, and an example.

    Attributes:
        continuity: Derivatives that join without a jump at either end and inside: 1 (velocity) or 2
            (acceleration). A step in the derivative after that is legal where the joint has no limit on it.
        one_shape: Whether all its motions between two positions of rest differ by their duration alone, so
            that a stretched one is still the fastest of its kind.
        proportional: Whether another duration scales the times of all its parts alike, so that between given
            velocities at its ends each position is linear in the duration.
        follows_jerk: Whether it plans within the limits of jerk, and perhaps not without them.
        handles: Whether it stands between moves and moves nothing, such as what takes up a payload.
        changes_tool: Whether poses are of another tool behind it.
        needs_geometry: What it does that an arm of bare joints cannot; empty for nothing.
        smoother: Changes of its fields that make a move without steps in acceleration, each by the words that
            ask for it; "planner" may be among them.
        faster: Likewise changes that keep the limits where slowing the whole move costs much more time.
        limits: Tightens the job's limits for this move; applied before `plan` is called.
        when_over_limit: Overrides the job's; applied after `plan` was called.
        label: What it is for, in the job's words.
        zone: About the corner in which it ends, within which the motion may fly by; None for the job's.
        at: Signals that it sets on its way.
    """

    continuity: ClassVar[Literal[1, 2]]
    one_shape: ClassVar[bool] = False
    proportional: ClassVar[bool] = False
    follows_jerk: ClassVar[bool] = False
    handles: ClassVar[bool] = False
    changes_tool: ClassVar[bool] = False
    needs_geometry: ClassVar[str] = ""
    smoother: ClassVar[Mapping[str, Mapping[str, Any]]] = {}
    faster: ClassVar[Mapping[str, Mapping[str, Any]]] = {}

    limits: Annotated[LimitsSpec | None, Field(description="Tighter limits for this move.")] = None
    when_over_limit: Annotated[
        WhenOverLimit | None, Field(description="Overrides the job's for this move.")
    ] = None
    label: Annotated[str, Name("What it is for, shown in reports and pictures.")] | None = None
    zone: (
        Annotated[
            Any,
            ZoneField(
                "About the corner in which the move ends: within it the motion flies by; left out: the job's."
            ),
        ]
        | None
    ) = None
    at: (
        Annotated[
            Any,
            SignalsField("Signals that it sets: about the corner in which it ends, or along its path."),
        ]
        | None
    ) = None

    @property
    def tag(self) -> str:
        """The planner's name in job files."""
        return str(type(self).model_fields["planner"].default)

    @property
    def caption(self) -> str:
        """What it is for, in few words of the job; empty where that says nothing."""
        return self.label or ""

    @property
    def joins(self) -> Literal[1, 2]:
        """The continuity of this move: the planner's, unless its fields promise more."""
        return self.continuity

    @property
    def finds_duration(self) -> bool:
        """Whether only the limits say how long it lasts: no duration, no times and no rates are given."""
        return not any(getattr(self, name, None) for name in _GIVEN)

    @property
    def target(self) -> Target | None:
        """The target as it stands in the job; None where the move names none."""
        target: Target | None = getattr(self, "to", None)
        return target

    @property
    def destination(self) -> Destination | None:
        """Where the move ends, as the job says it."""
        target, tolerance = self.target, getattr(self, "tolerance", None)
        if target is None or not target.gives_joints_or_pose:
            return None
        within = None if tolerance is None else (tolerance.position, tolerance.angle)
        if target.joints is not None:
            return Destination(np.array(target.joints), None, within)
        from trajcli.language.targets import ik_target

        return Destination(
            None, ik_target(target), within, {} if target.pinned is None else target.pinned.by_index
        )

    def with_joint_targets(self, resolve: Resolve, near: Array) -> Self:
        """Return the planner with joints instead of the poses that it goes to in joint space.

        Args:
            resolve: From a target, and joint values (n,) to be near to, to the same target by its joints.
            near: Joint values (n,) of where the arm comes from, rad or m.
        """
        return self

    def coming_from(self, origin: Target | None) -> Self:
        """Return the planner that knows how the job gives the state in which the arm stands before it.

        Args:
            origin: The job's start, or the last target that a move before it names; None where that was
                recorded, or left open.
        """
        return self

    def carried_after(self, payload: Payload | None) -> Payload | None:
        """Return what the tool carries behind the move that begins with a payload; None for nothing.

        Raises:
            FlawError: When it takes up a second one, or leaves what is not there.
        """
        return payload

    def equipped(self, robot: Robot) -> Robot:
        """Return the robot with what is on its flange from this move on.

        Raises:
            FlawError: When what is taken up or left does not fit.
        """
        return robot

    def with_duration(self, duration: float) -> Self:
        """Return the planner of the same move over `duration` seconds.

        Raises:
            PlanningError: When it has no such field.
        """
        fields = type(self).model_fields
        names = [name for name in ("duration", "minimum_duration") if name in fields]
        if not names:
            raise PlanningError(f"{self.tag} cannot last longer than it does")
        given = [name for name in names if getattr(self, name) is not None]
        return self.model_copy(update={(given or names[::-1])[0]: duration})

    def without_duration(self) -> tuple[float, Self] | None:
        """Return the given duration, s, and the move that finds it itself; None where none is given."""
        given: float | None = getattr(self, "duration", None)
        return None if given is None else (given, self.model_copy(update={"duration": None}))

    def searched_from(self, planned: Planned) -> Self:
        """Return the planner of the same move that searches near a motion of it, if it searches at all."""
        del planned
        return self

    def lasting(self, duration: float) -> Iterator[tuple[str, Self]]:
        """Yield what may be given to a move so that it lasts `duration` seconds, and the move with it."""
        given = getattr(self, "duration", None) is not None
        if "duration" in type(self).model_fields:
            yield f"`duration: {duration:.12g}`", self.model_copy(update={"duration": duration})
        if "minimum_duration" in type(self).model_fields and not given:
            longer = self.model_copy(update={"minimum_duration": duration})
            yield f"`minimum_duration: {duration:.12g}`", longer

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move that begins in `start` at t = 0.

        Args:
            start: The acceleration is zero for a planner of continuity 1.
            robot: Carries the limits in force for this move.

        Raises:
            MissingLimitError: When a limit is needed that nobody gave.
            PlanningError: When no such move exists.
        """
        raise TypeError(f"{type(self).__name__} does not say how to plan")

    def within_tool_limits(self, start: State, robot: Robot) -> Planned | None:
        """Return a move of joints within the limits of the tool; None where stretching is all there is.

        Args:
            start: As for `plan`.
            robot: Likewise.

        Raises:
            PlanningError: When no such move exists.
        """
        del start, robot
        return None

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        return f"{self.tag} stops at its ends"

    def course(self, start: Array, robot: Robot, planned: Planned) -> Course:
        """Return the move as joints along a path.

        Args:
            start: Joint values, (n,).
            robot: Carries the limits within which it is flown.
            planned: Its motion with stops at its ends.

        Raises:
            PlanningError: When the arm cannot follow.
        """
        raise TypeError(f"{type(self).__name__} has no course")

    def on_rows(self, start: State, robot: Robot, period: float, least: float) -> Planned | None:
        """Return the move with all breaks of its curve on rows; None where the method has no such motion.

        Args:
            start: As for `plan`.
            robot: Likewise.
            period: Of the rows, s.
            least: Shortest duration, s.
        """
        del start, robot, period, least
        return None


@frozen
class PlannedMove:
    """A move with all that it was planned from.

    Attributes:
        index: Number in the job, from 0.
        planner: The move as it stands in the job.
        start: State in which it begins.
        robot: With the limits in force for this move.
        planned: What the planner returned, stretched where that was asked for.
        over_limit: What is done where it is over its limits.
        stretch: How many times longer it lasts than its planner said.
        not_slowed: Why no duration keeps its limits, where one was looked for in vain.
    """

    index: int
    planner: Planner
    start: State
    robot: Robot
    planned: Planned
    over_limit: WhenOverLimit = "error"
    stretch: float = 1.0
    not_slowed: Problem | None = None

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.planned.curve.duration

    @property
    def continuity(self) -> Literal[1, 2]:
        """Derivatives that join without a jump inside it and at rest."""
        return self.planned.continuity or self.planner.joins

    @property
    def at_rest(self) -> bool:
        """Whether it begins and ends at rest."""
        return self.start.at_rest and self.planned.end.at_rest

    @property
    def promise(self) -> Promise:
        """What the move says of itself; ends whose velocities follow from its times are none of its terms."""
        planned, follows = self.planned, self.planned.begins is not None and not self.start.velocity.any()
        flies_on = bool(planned.parts) and planned.parts[-1].around is not None
        return Promise(
            planned.via_points,
            planned.tool,
            self.robot,
            None if follows else (self.start, planned.end),
            self.over_limit,
            planned.remedies,
            None if flies_on else self.planner.destination,
            planned.braking,
            planned.parts,
        )

    def span(self, start: float, end: float, of_round: str = "", ends: str = "") -> Span:
        """Return the part of a trajectory, from `start` to `end` s, that is this move.

        Args:
            start: s.
            end: s.
            of_round: In which round of a repeat it is.
            ends: The points between which it goes.
        """
        planner, payload = self.planner, self.robot.payload
        values = self.index, planner.tag, start, end, self.continuity, payload, planner.caption
        return Span(*values, of_round, ends, planner.handles)

    def alone(self) -> Trajectory:
        """Return the trajectory of this move alone."""
        names, types = self.robot.joint_names, self.robot.joint_types
        spans = (self.span(0.0, self.duration),)
        return Trajectory(self.planned.curve, names, types, spans, self.start, self.planned.end)
