"""A trajectory: one curve q(t) of all joints, and where each move begins and ends on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial, numeric, read_only, real_number
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.grids import AT_BREAK, NANOSECOND, UniformGrid, onto_breaks, outside_trajectory
from trajcli.kinematics.robot import JointType, MountedTool, Payload, Robot

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.kinematics.inverse.target import IkTarget
    from trajcli.kinematics.zone import ZoneAround

_ROUNDING = 1e-9  # s: a time this far outside is at the end
_BORDER_UNITS = (
    4.0  # in the last place: a span whose length was added up in another order ends beside a break
)


@frozen
class State:
    """Position, velocity and acceleration of all joints, each of shape (n,), SI."""

    position: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "acceleration"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def bits(self) -> bytes:
        """All of it, as a key."""
        return b"".join(each.tobytes() for each in (self.position, self.velocity, self.acceleration))

    @property
    def at_rest(self) -> bool:
        """Whether velocity and acceleration are zero."""
        return not (self.velocity.any() or self.acceleration.any())


def resting(position: Array) -> State:
    """Return the state of rest at `position` (n,)."""
    zero = np.zeros_like(position)
    return State(position, zero, zero)


@frozen
class ViaPoints:
    """The points that a move passes, its start and its target among them.

    Attributes:
        times: When, s from the start of the move, shape (m,).
        points: Shape (m, n), rad or m.
        missed: The distance at which each joint passes each point, shape (m, n); zero where it goes through.
    """

    times: Array
    points: Array
    missed: Array

    def __post_init__(self) -> None:
        for name in ("times", "points", "missed"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def scaled(self, factor: float) -> ViaPoints:
        """Return the same points of a motion that takes `factor` times as long."""
        return ViaPoints(self.times * factor, self.points, self.missed)


@frozen
class Destination:
    """Where a move ends, as the job says it.

    Attributes:
        joints: Joint values (n,), rad or m; None where a pose is given.
        pose: The coordinates of the tcp's pose that the job fixes; None where joints are given.
        tolerance: How near the tool comes, m and rad, where it follows a path; None in joint space.
        pins: Values of joints that the job fixes beside the pose, by index, rad or m.
    """

    joints: Array | None = None
    pose: IkTarget | None = None
    tolerance: tuple[float, float] | None = None
    pins: Mapping[int, float] = field(default_factory=dict)


@frozen
class MoveInterval:
    """A part of a move that flies by a corner: on its path, or within a zone.

    Attributes:
        start: Seconds from the start of the move.
        end: Likewise.
        robot: The arm with the limits in force in it.
        tool: The reference motion of the tool along its path, from the start of the part; None for none.
        around: The zone; None on the path.
    """

    start: float
    end: float
    robot: Robot
    tool: ToolMotion | None = None
    around: ZoneAround | None = None


@frozen
class Promise:
    """What a move says of itself, for those who judge it.

    Attributes:
        via_points: The points that it passes.
        tool: The reference motion of its tool along a path.
        robot: The arm with the limits in force; None where nobody says.
        ends: The states in which it declares to begin and to end; None where nobody says.
        over_limit: "slow" where it was made as long as its limits ask for, if that helps; "error" where that
            can be asked for; None where it cannot.
        remedies: What would help against a finding, by its kind.
        destination: Where it ends; None where the job does not say it.
        braking: How a start outside the velocity or acceleration limits is brought inside first, as fast as
            possible: by each joint, or by all on one line; None where it is not.
        parts: Where it flies by a corner; each has limits of its own.
    """

    via_points: ViaPoints | None = None
    tool: ToolMotion | None = None
    robot: Robot | None = None
    ends: tuple[State, State] | None = None
    over_limit: Literal["error", "slow"] | None = None
    remedies: Mapping[str, str] = field(default_factory=dict)
    destination: Destination | None = None
    braking: Literal["each", "line"] | None = None
    parts: tuple[MoveInterval, ...] = ()


@comparable
class Span:
    """The part of the trajectory that is one move.

    Attributes:
        index: Number of the move in the job, from 0.
        planner: Its planner's tag.
        start: Seconds from the start of the trajectory.
        end: Seconds from the start of the trajectory; equals the next span's start.
        continuity: Derivatives that the planner promises to join without a jump: 1 or 2.
        payload: What the tool carries meanwhile; None for nothing.
        label: What it is for, in the job's words; empty where it says nothing.
        round: In which round of a repeat it is, such as "slot 3 of 18"; empty outside of any.
        ends: The points between which it goes, such as "pick -> place"; empty without names.
        handles: Whether it is no move: an entry that takes up a payload, or leaves it.
        tool: What is on the flange, where that is another tool than the robot's; None where it is not.
    """

    index: int
    planner: str
    start: float
    end: float
    continuity: int
    payload: Payload | None = None
    label: str = ""
    round: str = ""
    ends: str = ""
    handles: bool = False
    tool: MountedTool | None = None

    def arm(self, robot: Robot) -> Robot:
        """Return the robot with the tool and the payload that it has meanwhile."""
        if self.tool is not None:
            robot = robot.with_tool(self.tool)
        return robot if self.payload is robot.payload else replace(robot, payload=self.payload)

    @property
    def title(self) -> str:
        """What it is, such as "pick -> above_place (jerk_limited)"; without a name only its planner."""
        return move_title(self.ends, self.label, self.planner, self.round)

    @property
    def origin(self) -> str:
        """The name of the point from which it goes; empty without one."""
        return self.ends.partition(" -> ")[0] if " -> " in self.ends else ""

    @property
    def goal(self) -> str:
        """The name of the point to which it goes; empty without one."""
        return self.ends.rpartition("-> ")[2]

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.end - self.start


def move_title(ends: str, label: str | None, planner: str, round_of: str) -> str:
    """Return the title of a move, by which it goes everywhere: its label or points, planner and round."""
    name, how = label or ends, f"{planner}, {round_of}" if round_of else planner
    return f"{name} ({how})" if name else how


@frozen
class Rows:
    """States of the joints at some times.

    Attributes:
        t: When, s, shape (N,).
        q: Positions, rad or m, shape (N, n).
        qd: Velocities, per second.
        qdd: Accelerations, per second squared.
    """

    t: Array
    q: Array
    qd: Array
    qdd: Array

    def __repr__(self) -> str:
        span = f", {self.t[0]:g} s to {self.t[-1]:g} s" if len(self.t) else ""
        return f"Rows({len(self.t)} rows, {self.q.shape[-1]} joints{span})"

    def __len__(self) -> int:
        return len(self.t)


@comparable
class SignalChange:
    """A value that a signal has from some time on.

    Attributes:
        time: Seconds from the start of the trajectory.
        value: From then on.
        move: Index of the move that sets it.
    """

    time: float
    value: float
    move: int


@comparable
class Signal:
    """A signal: 0 before its first change.

    Attributes:
        name: Its name.
        changes: In order of time.
    """

    name: str
    changes: tuple[SignalChange, ...]

    def values(self, times: Array) -> Array:
        """Return its values at times (N,) from the start: at a change, to a nanosecond, the new one."""
        after = np.searchsorted([change.time for change in self.changes], times + NANOSECOND, "right")
        return np.array([0.0, *(change.value for change in self.changes)])[after]


@frozen
class Trajectory:
    """The motion of all joints over time.

    A call gives states: `trajectory(t)` positions, `trajectory(t, 1)` velocities, of any shape of times.

    Attributes:
        curve: q(t) from t = 0, rad or m by joint.
        joint_names: n names.
        joint_types: n types.
        spans: One for each move, in order, covering the whole curve.
        start: State in which the job says that the arm stands when t = 0.
        end: State in which the last move declares to end.
        laws: For each span the time law s(t) of the tool along its path, m, from t = 0; None without one.
        start_time: Time at which the job lets it start, s. Calls and samples count from there, the curve and
            the spans from 0.
        zones: When each zone about a corner is entered and left, s from the start, shape (Z, 2).
        signals: By their names, in the order in which the job names them.
    """

    curve: PiecewisePolynomial
    joint_names: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    spans: tuple[Span, ...]
    start: State
    end: State
    laws: tuple[PiecewisePolynomial | None, ...] = ()
    start_time: float = 0.0
    zones: tuple[tuple[float, float], ...] = ()
    signals: tuple[Signal, ...] = ()

    def __repr__(self) -> str:
        moves, joints = sum(not span.handles for span in self.spans), len(self.joint_names)
        of_moves = f"{moves} move{'s' * (moves != 1)}"
        return f"Trajectory({joints} joint{'s' * (joints != 1)}, {of_moves}, {self.duration:g} s)"

    def __call__(self, t: ArrayLike, order: int = 0) -> Array:
        """Return the positions of the joints, or a derivative of them, shape (*t.shape, n), SI.

        Args:
            t: Times of any shape, s, from `start_time` on. At a break the later piece counts.
            order: 0 for positions, 1 velocities, 2 accelerations, and so on.

        Raises:
            InputError: When a time is no number or outside the trajectory, or the order is none.
        """
        times = np.asarray(numeric(t, "t"), dtype=np.float64)
        if isinstance(order, bool) or not isinstance(order, int | np.integer) or order < 0:
            raise InputError(f"the order of the derivative is {order!r}, expected 0, 1, 2 or more")
        local = np.atleast_1d(times).reshape(-1) - self.start_time
        outside = ~((local >= -_ROUNDING) & (local <= self.duration + _ROUNDING))
        if outside.any():
            start = self.start_time
            raise outside_trajectory(times.reshape(-1)[outside][0], start, start + self.duration)
        local = onto_breaks(np.clip(local, 0.0, self.duration), self.curve.breaks)
        return self.curve.evaluate(local, order).reshape(*times.shape, self.curve.dimension)

    def of_tools(
        self, robot: Robot, times: Array, values: Callable[[Robot, NDArray[np.intp]], Array]
    ) -> Array:
        """Return values at times (N,), s from the start, each of the arm with the tool that it has then.

        At a change the new tool counts.

        Args:
            robot: The arm with its own tool.
            times: In any order.
            values: Of an arm, and of the indices of some of the times, shape (k, ...).
        """
        moving = [span for span in self.spans if span.duration > 0] or list(self.spans[:1])
        if all(span.tool is None for span in moving):
            return values(robot, np.arange(times.size))
        owner = np.searchsorted([span.start for span in moving], times + AT_BREAK, "right") - 1
        found: Array | None = None
        by_tool: dict[int, list[int]] = {}
        for number in np.unique(np.maximum(owner, 0)).tolist():
            by_tool.setdefault(id(moving[number].tool), []).append(number)
        for numbers in by_tool.values():
            rows = np.flatnonzero(np.isin(np.maximum(owner, 0), numbers))
            part = values(replace(moving[numbers[0]].arm(robot), payload=None), rows)
            if found is None:
                found = np.empty((times.size, *part.shape[1:]))
            found[rows] = part
        return np.empty(0) if found is None else found

    def sample(self, rate: float) -> Rows:
        """Return states at a rate, Hz, and one exactly at the end: the rows of `trajcli plan`, in SI.

        Raises:
            InputError: When the rate is not above 0, or so high that times would be equal.
        """
        parts = list(UniformGrid(self.duration, real_number(rate, "rate"), self.start_time).blocks())
        local = onto_breaks(np.concatenate([part for _, part in parts]), self.curve.breaks)
        states = self.curve.evaluate_orders(local, (0, 1, 2))
        return Rows(np.concatenate([times for times, _ in parts]), *(states[:, k] for k in range(3)))

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.curve.duration

    def before(self, times: Array, order: int = 0) -> Array:
        """Return a derivative of the joints just before `times` (k,), (k, n): rounding crosses no break."""
        breaks = self.curve.breaks
        last = np.clip(np.searchsorted(breaks, times), 1, breaks.size - 1)
        beside = times - breaks[last - 1] <= _BORDER_UNITS * np.spacing(np.abs(times))
        on_breaks = np.where(beside & (last > 1), breaks[last - 1], np.minimum(times, breaks[-1]))
        return self.curve.evaluate(on_breaks, order, side="left")

    def span_at(self, time: float) -> Span:
        """Return the span that holds `time`; at a border the later one, as long as it has a length."""
        later = [span for span in self.spans if span.start <= time and span.duration > 0]
        return later[-1] if later else self.spans[0]
