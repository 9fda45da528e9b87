"""Jobs whose corners are flown by: the chains of all moves, what they gained, and what was conceded."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from trajcli.errors import Amount, Amounts, InputError, MissingLimitError, Place, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import Robot
from trajcli.planners.flying_by import (
    FlownChain,
    FlownZone,
    close_bound,
    flown,
    flown_zones,
    moves_as_flown,
    second_order_bound,
    stretched_chain,
    zone_events,
)
from trajcli.planners.planner import Event, PlannedMove, Planner
from trajcli.progress import report_progress

if TYPE_CHECKING:
    from trajcli.kinematics.zone import Zone
    from trajcli.planning.adaptation import Adaptation

BoundMethod = Literal["proven", "second_order"]
_WHOLE = 1e-9  # of a period: what is this close to whole is whole
_FASTER = 1e-9  # relative: a chain that gains less stops


@frozen
class FlyBy:
    """What flying by gained.

    Attributes:
        duration: Of the job, s.
        stopping: Of the job with a stop at every corner, s.
        searched: Of the fastest motion that was found, before limits that it passed lowered its pace, s.
        zones: In order of time.
        chains: Those that fly; None where one stops although zones are named.
    """

    duration: float
    stopping: float
    searched: float
    zones: tuple[FlownZone, ...]
    chains: tuple[FlownChain, ...] | None

    @cached_property
    def second_order(self) -> float | None:
        """Duration below which no motion through these zones is, s; None where one stops or none flies."""
        if not self.chains:
            return None
        return self._with(second_order_bound(chain) for chain in self.chains)

    @cached_property
    def best_bound(self) -> tuple[float, BoundMethod] | None:
        """The highest duration that is known to be such a bound, s, and how it is known.

        Two straight moves in joint space have a proof that takes some seconds for each chain; others one that
        leaves out most limits of jerk. It is named after the weakest.
        """
        if not self.chains or self.second_order is None:
            return None
        close = [close_bound(chain) for chain in self.chains]
        if None in close and not any(close):
            return self.second_order, "second_order"
        found = [
            max(second_order_bound(chain), bound or 0.0)
            for chain, bound in zip(self.chains, close, strict=True)
        ]
        return self._with(found), "second_order" if None in close else "proven"

    def _with(self, bounds: Iterable[float]) -> float:
        """Return the duration of the job if each chain lasted as long as its bound, s."""
        chains = self.chains or ()
        return self.duration - math.fsum(
            chain.duration - bound for chain, bound in zip(chains, bounds, strict=True)
        )


def flown_plan(
    loaded: LoadedJob, stopping: Sequence[PlannedMove], corners: FlownCorners, adapted: Adaptation | None
) -> tuple[list[PlannedMove], FlyBy, list[Event]]:
    """Return the moves of a job, those between zones as one motion, what that gained, and what is said of it.

    Args:
        loaded: The job.
        stopping: Its moves as planned with stops.
        corners: Those that shall be flown by, and what is said of others.
        adapted: By what moves are planned otherwise than their limits alone say.
    """
    moves, flyby, events = _fly(loaded, stopping, corners.flown, adapted)
    return moves, flyby, [*corners.remarks, *events]


def _fly(
    loaded: LoadedJob,
    moves: Sequence[PlannedMove],
    corners: Sequence[FlownCorner],
    adapted: Adaptation | None,
) -> tuple[list[PlannedMove], FlyBy, list[Event]]:
    """Return the moves of a job with its corners flown by, what that gained, and what was conceded."""
    result = list(moves)
    number = {move.index: k for k, move in enumerate(moves)}
    events: list[Event] = []
    zones: list[FlownZone] = []
    saved, flown_by, groups = 0.0, list[FlownChain](), list(chains(corners))
    for group in groups:
        first = number[group[0].move]
        some = moves[first : first + len(group) + 1]
        report_progress(f"flying by the corners of moves {some[0].index} to {some[-1].index}")
        stopping = math.fsum(move.duration for move in some)
        chain = _chain(loaded, some, group, adapted, stopping, events)
        if chain is None:
            continue
        begun = math.fsum(move.duration for move in result[:first])
        of_chain = [zone.shifted(begun, len(zones)) for zone in flown_zones(chain)]
        events += zone_events(of_chain)
        result[first : first + len(some)] = moves_as_flown(some, chain)
        zones += of_chain
        saved += chain.duration - chain.model
        flown_by.append(chain)
    duration = math.fsum(move.duration for move in result)
    stopping = math.fsum(move.duration for move in moves)
    every = tuple(flown_by) if len(flown_by) == len(groups) else None
    flyby = FlyBy(duration, stopping, duration - max(saved, 0.0), tuple(zones), every)
    return result, flyby, events


def _chain(
    loaded: LoadedJob,
    moves: Sequence[PlannedMove],
    corners: Sequence[FlownCorner],
    adapted: Adaptation | None,
    stopping: float,
    events: list[Event],
) -> FlownChain | None:
    """Return the chain of some moves; None, with an event, where it is no faster than they are with stops."""
    amounts: Amounts = {"stopping": Amount(stopping)}
    try:
        chain = _fastest(moves, corners, adapted)
        if adapted is not None:
            chain = stretched_chain(chain, max(adapted.stretches.get(move.index, 1.0) for move in moves))
        if loaded.job.output.align:
            chain = _aligned(chain, loaded.job.output.rate)
    except MissingLimitError as error:
        raise error.located(place=loaded.place_of_move(moves[0].index)) from None
    except PlanningError as error:
        problem = error.problems[0]
        reason = problem.message
        first, last = moves[0].index, moves[-2].index
        corners_of = f"corner of move {first}" if first == last else f"corners of moves {first} to {last}"
        message = f"stops at the {corners_of}: {reason}"
        events.append(Event("not_faster", message, moves[0].index, {**amounts, **problem.amounts}))
        return None
    if chain.duration < stopping * (1 - _FASTER):
        return chain
    message = "flying by its corners is no faster than stopping there, which takes {stopping}"
    events.append(Event("not_faster", message, moves[0].index, amounts))
    return None


def _fastest(
    moves: Sequence[PlannedMove], corners: Sequence[FlownCorner], adapted: Adaptation | None
) -> FlownChain:
    """Return the fastest chain that was found; the search for one does not depend on how it is stretched."""
    robots, zones = [_adapted(move, moves, adapted) for move in moves], [corner.zone for corner in corners]
    if adapted is None:
        return flown(moves, zones, robots)
    key = adapted.chain_key(moves)
    if key not in adapted.chains:
        adapted.chains[key] = flown(moves, zones, robots)
    return adapted.chains[key]


def _adapted(move: PlannedMove, chain: Sequence[PlannedMove], adapted: Adaptation | None) -> Robot:
    """Return the robot of a move with the limits within which its chain is planned.

    What is tightened in one of its moves is in all: a zone belongs to two of them.
    """
    robot = move.robot
    if adapted is not None:
        for other in chain:
            robot = adapted.within(robot, other.index)
    return robot


def _aligned(chain: FlownChain, rate: float) -> FlownChain:
    periods = max(1, math.ceil(chain.duration * rate - _WHOLE))
    return stretched_chain(chain, periods / rate / chain.duration)


@frozen
class FlownCorner:
    """A corner that shall be flown by.

    Attributes:
        move: Index of the move that ends in it.
        zone: About it.
        explicit: Whether the move itself names the zone.
    """

    move: int
    zone: Zone
    explicit: bool


@frozen
class FlownCorners:
    """The corners of a job that shall be flown by.

    Attributes:
        flown: In order.
        remarks: On those where the zone of the job cannot be.
    """

    flown: tuple[FlownCorner, ...]
    remarks: tuple[Event, ...]


def flown_corners(loaded: LoadedJob) -> FlownCorners:
    """Return the corners of a job that shall be flown by, and remarks on those where its own zone cannot be.

    Raises:
        InputError: Where a move names a zone that cannot be, with one problem for each.
    """
    corners, remarks, refused = [], list[Event](), list[tuple[int, str]]()
    moves = loaded.job.moves
    for index, planner in enumerate(moves):
        explicit = planner.zone is not None
        zone = planner.zone if explicit else loaded.job.zone
        if zone is None or zone.stops or planner.handles or (not explicit and _stands(planner)):
            continue
        reason = _no_geometry(loaded, zone) or _why_not(moves, index)
        if reason is None:
            corners.append(FlownCorner(index, zone, explicit))
        elif explicit:
            refused.append((index, reason))
        else:
            remarks.append(_remark(index, reason))
    flown_by = {_place(loaded, corner.move) for corner in corners if corner.explicit}
    problems = [_problem(loaded, *each) for each in refused if _place(loaded, each[0]) not in flown_by]
    if problems:
        raise InputError(*problems)
    return FlownCorners(tuple(corners), (*remarks, *(_remark(*each) for each in refused)))


def _remark(index: int, reason: str) -> Event:
    return Event("zone_stops", f"stops at its end: {reason}", index)


def _place(loaded: LoadedJob, index: int) -> Place:
    """Return where the zone of a move is written: of several rounds it is the same place."""
    return loaded.document.place(("moves", index, "zone"))


def _stands(planner: Planner) -> bool:
    """Return whether a move goes nowhere: at its end nothing could be flown by."""
    return planner.target is None and "duration" in type(planner).model_fields


def _why_not(moves: Sequence[Planner], index: int) -> str | None:
    """Return why the corner at the end of a move cannot be flown by; None where it can."""
    own = moves[index].why_not_flown_by
    if own is not None:
        return own
    if index + 1 == len(moves):
        return "it is the last move"
    following = moves[index + 1]
    if following.handles:
        return f"the arm stands for `{following.tag}` behind it"
    reason = following.why_not_flown_by
    return None if reason is None else f"of move {index + 1} ({following.tag}) behind it, {reason}"


def _no_geometry(loaded: LoadedJob, zone: Zone) -> str | None:
    if loaded.robot.convention is not None or not zone.needs_geometry:
        return None
    return f"{loaded.robot.name} has no geometry, so its tool has no place: say `zone: {{joints: ...}}`"


def _problem(loaded: LoadedJob, index: int, reason: str) -> Problem:
    message = f"move {index} ({loaded.job.moves[index].tag}): its corner cannot be flown by: {reason}"
    return Problem(message, "leave `zone` out, or say `zone: stop`", _place(loaded, index), move=index)


def chains(corners: Sequence[FlownCorner]) -> Iterator[list[FlownCorner]]:
    """Yield the corners of each chain: those of moves that follow each other."""
    chain: list[FlownCorner] = []
    for corner in corners:
        if chain and corner.move != chain[-1].move + 1:
            yield chain
            chain = []
        chain.append(corner)
    if chain:
        yield chain


__all__ = ["FlownZone", "FlyBy", "flown_corners", "flown_plan"]
