"""Splines through waypoints, at times that are given or that the limits allow."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.hermite import ShapeError
from trajcli.curves.splines.virtual_points import virtual_points
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import FieldPath, Flaw, refuse_flaws
from trajcli.language.recorded import Recorded
from trajcli.language.targets import Numbers
from trajcli.language.waypoints import Waypoint
from trajcli.planners.boundary_states import same_state, standstill
from trajcli.planners.planner import Event, Planned
from trajcli.planners.waypoints.spline_rules import (
    FREE_ENDS,
    IMPOSES,
    INNER,
    Rule,
    curve_through,
    fastest_spline_times,
)
from trajcli.planners.waypoints.through_points import (
    OPEN_END_REMEDIES,
    REMEDIES,
    PointTable,
    ThroughPoints,
    via_points,
)
from trajcli.trajectory import State, ViaPoints
from trajcli.units import Quantity


class Spline(ThroughPoints):
    """A smooth curve through all points, at times that are given or follow from the limits.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.2; Biagiotti and
    Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), chapter 4.
    """

    continuity: ClassVar[Literal[1, 2]] = 1
    proportional: ClassVar[bool] = True

    planner: Literal["spline"] = "spline"
    rule: Annotated[
        Rule,
        Field(
            description="What fixes the curve between the points. imposed: velocities of the waypoints; "
            "computed: velocities from the slopes, zero where their sign changes; continuous_acceleration: "
            "two virtual points let the ends impose velocity and acceleration; natural, clamped, not_a_knot: "
            "cubic splines of numerical analysis; quintic: continuous acceleration with given or computed "
            "inner values; shape_preserving: monotone between points, no overshoot."
        ),
    ] = "continuous_acceleration"
    virtual_times: (
        Annotated[
            tuple[float, ...],
            Numbers(2, Quantity("time"), "Times of the two virtual points of continuous_acceleration, s."),
        ]
        | None
    ) = None

    @property
    def joins(self) -> Literal[1, 2]:
        """Acceleration joins where the rule imposes it at both ends."""
        return 2 if IMPOSES[self.rule] == 2 else 1

    @model_validator(mode="after")
    def _says_what_the_rule_needs(self) -> Spline:
        refuse_flaws(
            [
                *self._flaws_inside(),
                *self._flaws_of_blends(),
                *self._flaws_of_target(),
                *self._flaws_of_virtual_times(),
            ]
        )
        return self

    def _flaws_inside(self) -> Iterator[Flaw]:
        lacking = "rule imposed needs the velocity of every waypoint between start and target"
        if isinstance(self.through, Recorded):
            if self.rule == "imposed":
                yield ("rule",), lacking, "recorded points have none: use computed"
            return
        between = self.through if self.to is not None else self.through[:-1]
        for k, point in enumerate(between):
            if self.rule == "imposed" and point.velocity is None:
                yield ("through", k), lacking, "give it a `velocity`, or use computed"
            for order, name in ((1, "velocity"), (2, "acceleration")):
                if order > INNER.get(self.rule, 0) and getattr(point, name) is not None:
                    instead = "leave it out, or use quintic"
                    yield (
                        ("through", k, name),
                        f"rule {self.rule} computes the {name} between the ends",
                        instead,
                    )

    def _flaws_of_blends(self) -> Iterator[Flaw]:
        for path, point, _ in self._numbered():
            if point.blend is not None:
                yield (*path, "blend"), "a spline goes through its points", "use blends, or leave it out"

    def _flaws_of_target(self) -> Iterator[Flaw]:
        path, target = self._target()
        if target is None:
            return
        for order, name in ((1, "velocity"), (2, "acceleration")):
            values = getattr(target, name)
            if order > IMPOSES[self.rule] and any(values or ()):
                text = f"rule {self.rule} does not impose the {name} at its end"
                yield (*path, name), text, "use continuous_acceleration or quintic, or leave it out"

    def _target(self) -> tuple[FieldPath, Waypoint | None]:
        if self.to is not None:
            return ("to",), self.to
        if isinstance(self.through, Recorded):
            return (), None
        return ("through", len(self.through) - 1), self.through[-1]

    def _flaws_of_virtual_times(self) -> Iterator[Flaw]:
        if self.virtual_times is None:
            return
        path: FieldPath = ("virtual_times",)
        if self.rule != "continuous_acceleration":
            yield (
                path,
                f"rule {self.rule} has no virtual points",
                "leave it out, or use continuous_acceleration",
            )
            return
        between = isinstance(self.through, Recorded) or len(self.listed) > 1
        if not self.timed and (between or not self.duration):
            yield path, "virtual times need waypoints with times", "give each waypoint a `time`"
        elif not isinstance(self.through, Recorded):
            yield from self._flaws_of_intervals(*self.virtual_times)

    def _flaws_of_intervals(self, first: float, last: float) -> Iterator[Flaw]:
        times = [0.0, *(point.time or self.duration or 0.0 for point in self.listed)]
        if 0 < first < times[1] and times[-2] < last < times[-1] and first < last:
            return
        spans = " and ".join(f"{a:.12g} to {b:.12g} s" for a, b in (times[:2], times[-2:]))
        text = f"the virtual points must lie inside the first interval and inside the last one, {spans}"
        yield ("virtual_times",), text, "leave it out for their middles"

    def with_duration(self, duration: float) -> Self:
        """Return the planner whose points, virtual ones too, are passed in the same proportion.

        Raises:
            PlanningError: When virtual times belong to a recording whose end nothing but its file says.
        """
        longer = super().with_duration(duration)
        if self.virtual_times is None:
            return longer
        last = self._last_time() or self.duration
        if last is None:
            raise PlanningError("virtual times cannot be stretched with a recording", hint="leave them out")
        times = tuple(time * (duration / last) for time in self.virtual_times)
        return longer.model_copy(update={"virtual_times": times})

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the curve through all points.

        Raises:
            MissingLimitError: When times are left out and a moving joint has no limit.
            PlanningError: When no times keep the limits, or the ends ask for what the rule cannot do.
        """
        points = self.waypoints(start, robot)
        coincident = points.times is None and not np.ptp(points.positions, axis=0).any()
        if coincident and same_state(start, points.target) and (start.at_rest or not self.duration):
            return standstill(points.target, self.duration or 0.0, REMEDIES)
        times, events = self._times_of(points, robot)
        curve = self._curve(points, times, robot)
        return Planned(
            curve,
            self._end(points, curve),
            via_points=via_points(points, times),
            begins=_beginning(curve) if self.rule in FREE_ENDS else None,
            ends_open=self.rule in FREE_ENDS and not points.given[0, -1],
            events=(*points.events, *events),
            one_piece_per_interval=True,
            virtual=(1, curve.pieces - 1) if self.rule == "continuous_acceleration" else (),
            remedies=OPEN_END_REMEDIES if self.rule in FREE_ENDS else REMEDIES,
            virtual_points=_virtual(curve) if self.rule == "continuous_acceleration" else None,
        )

    def _times_of(self, points: PointTable, robot: Robot) -> tuple[Array, tuple[Event, ...]]:
        """Return when the points are passed, and what there is to say of times that are found."""
        if points.times is not None:
            return points.times, ()
        if self.duration and points.count == 2:
            return np.array([0.0, self.duration]), ()
        try:
            times, events = fastest_spline_times(self.rule, points, robot)
        except ShapeError as error:
            raise _not_monotone(error, robot, given=False) from None
        return (times / times[-1] * self.duration, ()) if self.duration else (times, events)

    def _curve(self, points: PointTable, times: Array, robot: Robot) -> PiecewisePolynomial:
        try:
            return curve_through(self.rule, points, times, self.virtual_times)
        except ShapeError as error:
            raise _not_monotone(error, robot, given=points.times is not None) from None
        except ValueError as error:  # a virtual time outside its interval
            raise PlanningError(str(error), hint="give other `virtual_times`, or leave them out") from None

    def _end(self, points: PointTable, curve: PiecewisePolynomial) -> State:
        if self.rule not in FREE_ENDS:
            return points.target
        velocity = points.rates[0, -1] if points.given[0, -1] else curve.piece_ends(1)[1][-1]
        return State(points.positions[-1], velocity, np.zeros(curve.dimension))


def _not_monotone(error: ShapeError, robot: Robot, *, given: bool) -> PlanningError:
    name, joint = robot.joint_names[error.component], error.component
    message = f"{{velocity}} of {{joint}} at the {error.end} point keeps the curve from being monotone"
    amounts = {"velocity": Amount(error.velocity, 1, joint)}
    if given:
        message += ", {low} to {high} would not"
        amounts |= {
            "low": Amount(error.low, 1, joint, rounded="up"),
            "high": Amount(error.high, 1, joint, rounded="down"),
        }
    hint = "change that velocity, or use another rule than shape_preserving"
    helps = not given and error.velocity * (error.low + error.high) > 0.0  # against the way no time does
    hint += ", or give every waypoint a `time`" if helps else ""
    return PlanningError(of_joint(name, message, hint, amounts))


def _virtual(curve: PiecewisePolynomial) -> ViaPoints:
    times, positions = virtual_points(curve)
    return ViaPoints(times, positions, np.zeros_like(positions))


def _beginning(curve: PiecewisePolynomial) -> State:
    position, velocity = (curve.piece_ends(order)[0][0] for order in (0, 1))
    return State(position, velocity, np.zeros_like(position))
