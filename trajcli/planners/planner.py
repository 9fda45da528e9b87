"""What every planner is and gives back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Self

from pydantic import Field

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts, PlanningError, said
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Robot
from trajcli.language.limits import LimitsSpec
from trajcli.language.numbers import Model
from trajcli.trajectory import State, ViaPoints

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.language.targets import Target

Resolve = Callable[["Target", Array], "Target"]
WhenOverLimit = Literal["error", "slow"]
_REMARKS = ("refined",)  # kinds of events that concede nothing
_LITTLE = 1e-3  # relative: a law that is stretched by less still counts as the fastest


@comparable
class Phase:
    """A named stretch of a move.

    Attributes:
        name: Such as "accelerate", "cruise", "jerk +".
        start: Seconds from the start of the move.
        end: Seconds from the start of the move.
        joint: Index of the joint it is about; None when it is about all of them.
    """

    name: str
    start: float
    end: float
    joint: int | None = None


@comparable
class Event:
    """A concession that was made, and would otherwise go unnoticed; or a remark on how a curve was found.

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

    def text(self, say: Callable[[Amount], str] = str) -> str:
        """Return the message with its amounts said by `say`."""
        return said(self.message, self.amounts, say)


def stretched(factor: float) -> Event:
    """Return the event of a time-optimal law that lasts `factor` times longer than it was found."""
    text = f"stretched {factor:.9g} times to keep all limits between the places"
    return Event("stretched" if factor > 1 + _LITTLE else "refined", text)


@frozen
class Planned:
    """What a planner returns.

    Attributes:
        curve: q(t) from t = 0 to the move's duration.
        end: The state in which the move declares to end.
        law: s(t) with values in [0, 1] where one law moves all joints along a straight line, else None.
        phases: Named stretches, in order of time.
        events: Concessions.
        arrivals: Seconds after which each joint alone has arrived, shape (n,); None where all share one law.
        closed_form: "cycloid" where the curve is a fit of q0 + dq (t/T - sin(2 pi t/T) / (2 pi)).
        passage: The points that it passes between start and target, where it has any.
        origin: Where the zero of the planner's own time lies on the curve, s: above zero where the motion had
            to begin before it.
        tool: What the tool was told to do, where the move follows a path of it.
        begins: The state in which the curve begins where the method does not let its start be imposed.
    """

    curve: PiecewisePolynomial
    end: State
    law: PiecewisePolynomial | None = None
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()
    arrivals: tuple[float, ...] | None = None
    closed_form: Literal["cycloid"] | None = None
    passage: ViaPoints | None = None
    origin: float = 0.0
    begins: State | None = None
    tool: ToolMotion | None = None


class Planner(Model):
    """A method of planning one move: its fields are its parameters, in SI.

    Adding one takes a file here with a subclass, a line in `planners/__init__.py`, and an example.

    Attributes:
        continuity: Derivatives that join without a jump at either end and inside: 1 (velocity) or 2
            (acceleration). A step in the derivative after that is legal where the joint has no limit on it.
        limits: Tightens the job's limits for this move; applied before `plan` is called.
        when_over_limit: Overrides the job's; applied after `plan` was called.
    """

    continuity: ClassVar[Literal[1, 2]]

    limits: Annotated[LimitsSpec | None, Field(description="Tighter limits for this move.")] = None
    when_over_limit: Annotated[
        WhenOverLimit | None, Field(description="Overrides the job's for this move.")
    ] = None

    @property
    def tag(self) -> str:
        """The planner's name in job files."""
        return str(type(self).model_fields["planner"].default)

    @property
    def joins(self) -> Literal[1, 2]:
        """The continuity of this move: the planner's, unless its fields promise more."""
        return self.continuity

    def with_places(self, resolve: Resolve, near: Array) -> Self:
        """Return the planner with joints in the place of poses that it goes to in joint space.

        Args:
            resolve: From a target, and joint values (n,) to be near to, to the same target by its joints.
            near: Joint values (n,) of where the arm comes from, rad or m.
        """
        return self

    def told_to_last(self, duration: float) -> Self:
        """Return the planner of the same move over `duration` seconds.

        Raises:
            PlanningError: When it cannot be told.
        """
        fields = type(self).model_fields
        names = [name for name in ("duration", "minimum_duration") if name in fields]
        if not names:
            raise PlanningError(f"{self.tag} cannot last longer than it does")
        given = [name for name in names if getattr(self, name) is not None]
        return self.model_copy(update={(given or names[::-1])[0]: duration})

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
