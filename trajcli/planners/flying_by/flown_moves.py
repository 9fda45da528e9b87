"""Moves of a chain that flies by, cut where the tool is nearest to each corner, and what zones came to."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any, Literal

import numpy as np

from trajcli.curves.operations import cut, scale_time, times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.errors import Amount, Amounts, PlanningError
from trajcli.frozen import frozen
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.kinematics.zone import ZoneAround
from trajcli.planners.boundary_states import instant
from trajcli.planners.course import Course
from trajcli.planners.flying_by.between_stops import with_looser_limits
from trajcli.planners.flying_by.flown_parts import FlownPart, joint_uses, move_part, state_at
from trajcli.planners.flying_by.within_limits import FlownChain
from trajcli.planners.planner import Event, Phase, Planned, PlannedMove
from trajcli.trajectory import MoveInterval, ViaPoints

_SAMPLES = 513  # of a zone, at which its distances are looked at
_KEPT = 16  # intervals of the path to its corner, and from there, that pictures show
_DIMENSIONS: dict[str, Literal["length", "angle"]] = {"position": "length", "orientation": "angle"}
_OF_PATHS = ("merged", "moved_center", "shrunk", "turns_back", "jerk_limit_both_ways")  # events, not of a law
_SHRUNK = 1e-6  # relative: a zone that is smaller by less is as large as was asked for


@frozen
class FlownZone:
    """What a zone came to.

    Attributes:
        number: From 1.
        move: Index of the move that ends in its corner.
        of: What its borders are measured by: "position", "orientation" or "joints".
        joint: Index of the joint, where it is joints.
        asked: Its size, m, rad or as the joint.
        used: Its size at the nearer border.
        entered: When it is entered, s from the start of the trajectory.
        left: When it is left.
        passed: When the tool is nearest to the corner.
        nearest: Smallest distance of the tool from the corner, m; None without geometry.
        farthest: Largest distance, m; None likewise.
        deviation: Largest distance of the tool from the programmed path, m; None likewise.
        turn: Largest angle of the tool from how it stands in the corner, rad; None likewise.
        binds: Which limit is used most in it.
        shares: What parts of velocity, acceleration and jerk of the joints it may use: below 1 where lowered.
        pace: How much slower than what its joints allow a motion with no more than these parts is.
        programmed: Joints along the programmed path from its border to the corner, and from there to the
            other border, shape (m, n).
    """

    number: int
    move: int
    of: str
    joint: int | None
    asked: float
    used: float
    entered: float
    left: float
    passed: float
    nearest: float | None
    farthest: float | None
    deviation: float | None
    turn: float | None
    binds: str
    shares: tuple[float, float, float]
    pace: float
    programmed: Array

    def shifted(self, time: float, number: int) -> FlownZone:
        """Return the zone `time` s later, with `number` zones before it."""
        times = {name: getattr(self, name) + time for name in ("entered", "left", "passed")}
        return replace(self, number=self.number + number, **times)

    def tool_path(self, robot: Robot) -> Array:
        """Return the programmed positions of the tool from border to border, m, shape (m, 3)."""
        return np.asarray(forward(robot, self.programmed)[:, :3, 3])

    def ball(self, robot: Robot) -> Array | None:
        """Return the corner and the radius that is used, m, shape (4,); None of a zone that is no ball."""
        if self.of != "position":
            return None
        corner = forward(robot, self.programmed[len(self.programmed) // 2])[:3, 3]
        return np.append(corner, self.used)


def flown_zones(chain: FlownChain) -> list[FlownZone]:
    """Return what the zones of a chain came to, times from its start."""
    zones, begun = [], 0.0
    for number, part in enumerate(chain.parts):
        if number % 2:
            k = number // 2
            zones.append(_flown_zone(chain, k, part, begun))
        begun += part.curve.duration
    return zones


def _flown_zone(chain: FlownChain, k: int, part: FlownPart, begun: float) -> FlownZone:
    corner, curve = chain.chain.corners[k], part.curve
    around, robot = corner.around, corner.robot
    of, joint, asked, used = _size(around, curve)
    time = nearest_time(around, curve)
    tool: Any = (None, None, None, None)
    programmed = _programmed(chain.chain.courses[k : k + 2], (corner.left, corner.joined))
    if robot.convention is not None:
        times = np.append(np.linspace(curve.start, curve.end, _SAMPLES), time)
        joints = curve.evaluate(times)
        distance, angle = around.offsets(joints)
        off = _off_path(robot, curve, programmed)
        tool = float(distance.min()), float(distance.max()), off, float(angle.max())
    return FlownZone(
        number=k + 1,
        move=chain.moves[k],
        of=of,
        joint=joint,
        asked=asked,
        used=used,
        entered=begun,
        left=begun + curve.duration,
        passed=begun + time - curve.start,
        nearest=tool[0],
        farthest=tool[1],
        deviation=tool[2],
        turn=tool[3],
        binds=_binds(robot, curve),
        shares=corner.shares,
        pace=corner.pace,
        programmed=programmed[:: _SAMPLES // _KEPT],
    )


def _size(around: ZoneAround, curve: PiecewisePolynomial) -> tuple[str, int | None, float, float]:
    """Return what limits a zone, the joint that does, its size, and that at the nearer border."""
    zone, ends = around.zone, curve.evaluate(np.array([curve.start, curve.end]))
    rows: list[tuple[str, int | None, float, Array]] = []
    if zone.needs_geometry:
        distance, angle = around.offsets(ends)
        for name, size, values in (
            ("position", zone.position, distance),
            ("orientation", zone.orientation, angle),
        ):
            if size is not None:
                rows.append((name, None, size, values))
    for joint, size in enumerate(around.joint_sizes.tolist() if zone.joints else ()):
        rows.append(("joints", joint, size, np.abs(ends[:, joint] - around.corner[joint])))
    shares = np.max([values / size for _, _, size, values in rows], axis=0)
    nearer = int(shares.argmin())
    name, joint_index, size, values = max(rows, key=lambda row: float(row[3][nearer] / row[2]))
    return name, joint_index, size, float(values[nearer])


def nearest_time(around: ZoneAround, curve: PiecewisePolynomial) -> float:
    """Return when a motion is nearest to the corner: the tool, or the joints of an arm without geometry."""

    def distances(times: Array) -> Array:
        joints = curve.evaluate(times)
        if around.robot.convention is not None:
            return around.offsets(joints)[0]
        return np.asarray(np.linalg.norm((joints - around.corner) / around.joint_sizes, axis=1))

    return _least_at(distances, curve)


def _least_at(values: Callable[[Array], Array], curve: PiecewisePolynomial) -> float:
    """Return when a value is least in a motion, not quite at its ends: ever closer to the least sample."""
    low, high = curve.start, curve.end
    for _ in range(4):
        times = np.linspace(low, high, 65)
        index = int(values(times).argmin())
        low, high = float(times[max(index - 1, 0)]), float(times[min(index + 1, 64)])
    inset = 1e-6 * curve.duration
    return min(max(0.5 * (low + high), curve.start + inset), curve.end - inset)


def _programmed(courses: Sequence[Course], borders: tuple[float, float]) -> Array:
    """Return joints along the programmed path within a zone, (m, n): the corner is in the middle."""
    before = courses[0].curve.evaluate(np.linspace(borders[0], courses[0].length, _SAMPLES))
    behind = courses[1].curve.evaluate(np.linspace(0.0, borders[1], _SAMPLES))
    return np.concatenate([before, behind[1:]])


def _off_path(robot: Robot, curve: PiecewisePolynomial, programmed: Array) -> float:
    """Return the largest distance of the tool from the programmed path, m."""
    path = forward(robot, programmed)[:, :3, 3]
    starts, steps = path[:-1], np.diff(path, axis=0)
    squares = np.maximum(np.square(steps).sum(axis=1), np.finfo(np.float64).tiny)

    def nearness(times: Array) -> Array:
        return -_squares_to(forward(robot, curve.evaluate(times))[:, None, :3, 3], starts, steps, squares)

    return math.sqrt(-nearness(np.array([_least_at(nearness, curve)]))[0])


def _squares_to(positions: Array, starts: Array, steps: Array, squares: Array) -> Array:
    """Return the squared distances (N,) of positions (N, 1, 3) from the nearest of segments (m, 3)."""
    along = np.clip(((positions - starts) * steps).sum(axis=2) / squares, 0.0, 1.0)
    off = positions - starts - along[:, :, None] * steps
    return np.asarray(np.square(off).sum(axis=2).min(axis=1))


def _binds(robot: Robot, curve: PiecewisePolynomial) -> str:
    """Return the limit of a joint of which a motion uses most, in words."""
    used = joint_uses(curve, robot.limits)
    order, joint = divmod(int(used.argmax()), used.shape[1])
    return f"{QUANTITIES[order + 1]} of {robot.joint_names[joint]}" if used.max() > 0 else "nothing"


def moves_as_flown(moves: Sequence[PlannedMove], chain: FlownChain) -> Iterator[PlannedMove]:
    """Yield the moves of a chain as they are flown: one of no length stays in the corner that it stands in.

    Args:
        moves: As planned with stops, those without a length among them; of two neighbours the looser limits
            are in force behind that.
        chain: The motion.
    """
    pieces, robots = list(_pieces(chain)), [move.robot for move in moves if move.index in chain.moves]
    state, parts = state_at(pieces[0][0], pieces[0][0].start), pieces[0][1][:1]
    for move in moves:
        if move.index not in chain.moves:
            part = replace(parts[-1], start=0.0, end=0.0)
            yield replace(move, start=state, planned=Planned(instant(state), state, parts=(part,)))
            continue
        number = chain.moves.index(move.index)
        curve, parts = pieces[number]
        end = state_at(curve, curve.end)
        planned = Planned(
            curve,
            end,
            phases=tuple(_phases(parts)),
            events=tuple(event for event in move.planned.events if event.kind in _OF_PATHS),
            via_points=_passed(chain, number, parts),
            wanted_speed=move.planned.wanted_speed,
            continuity=move.planned.continuity,
            parts=parts,
        )
        robot = reduce(with_looser_limits, robots[max(number - 1, 0) : number + 2], move.robot)
        yield replace(move, start=state, robot=robot, planned=planned, stretch=chain.stretch)
        state = end


def _passed(chain: FlownChain, number: int, parts: Sequence[MoveInterval]) -> ViaPoints | None:
    """Return the points that a move passes between its zones; None where it has none."""
    points, law = chain.chain.courses[number].passed, chain.parts[2 * number].law
    if points is None or law is None:
        return None
    first, last = chain.chain.stretch(number)
    kept = (points.s > first) & (points.s < last)
    begun = next(part.start for part in parts if part.around is None)
    times = begun + times_at(law, points.s[kept]) - law.start
    return ViaPoints(times, points.points[kept], points.missed[kept]) if kept.any() else None


def _pieces(chain: FlownChain) -> Iterator[tuple[PiecewisePolynomial, tuple[MoveInterval, ...]]]:
    """Yield the curve of each move from t = 0, and its parts."""
    count = len(chain.chain.courses)
    halves = []
    for k, corner in enumerate(chain.chain.corners):
        curve = chain.parts[2 * k + 1].curve
        halves.append(cut(curve, nearest_time(corner.around, curve)))
    for k in range(count):
        own: list[tuple[int, FlownPart]] = [(2 * k, chain.parts[2 * k])]
        if k:
            own.insert(0, (2 * k - 1, FlownPart(halves[k - 1][1])))
        if k + 1 < count:
            own.append((2 * k + 1, FlownPart(halves[k][0])))
        parts, begun = [], 0.0
        for number, part in own:
            parts.append(move_part(chain.chain, number, part, begun))
            begun = parts[-1].end
        curve = concatenate([part.curve.shifted(-part.curve.start) for _, part in own])
        parts[-1] = replace(parts[-1], end=curve.end)
        yield curve, tuple(parts)


def _phases(parts: Sequence[MoveInterval]) -> Iterator[Phase]:
    for part in parts:
        yield Phase("along the path" if part.around is None else "within the zone", part.start, part.end)


def stretched_chain(chain: FlownChain, factor: float) -> FlownChain:
    """Return the chain that lasts `factor` times longer; refuse one that begins in motion."""
    if factor == 1:
        return chain
    if chain.chain.ends[0].any():
        raise PlanningError("what begins in motion cannot be stretched")
    parts = tuple(
        FlownPart(
            scale_time(part.curve, factor),
            part.tool and part.tool.scaled(factor),
            part.law and scale_time(part.law, factor),
        )
        for part in chain.parts
    )
    return replace(chain, parts=parts, stretch=chain.stretch * factor)


def zone_events(zones: Sequence[FlownZone]) -> Iterator[Event]:
    """Yield the events of zones that had to shrink, or whose pace was lowered."""
    for zone in zones:
        if zone.used < zone.asked * (1 - _SHRUNK):
            share = zone.used / zone.asked
            message = f"the zone at its end has {{used}}, {share:.3g} of the {{asked}} that was asked for"
            dimension = _DIMENSIONS.get(zone.of)
            amounts: Amounts = {
                "used": Amount(zone.used, 0, zone.joint, dimension),
                "asked": Amount(zone.asked, 0, zone.joint, dimension),
            }
            yield Event("shrunk", message, zone.move, amounts)
        parts = zip(QUANTITIES[1:], zone.shares, strict=False)
        lowered = " and ".join(f"{share:.6g} of the {name}" for name, share in parts if share < 1)
        if lowered:
            text = f"the zone at its end is flown through with at most {lowered} that its joints allow"
            yield Event("lowered", f"{text}: other limits ask for it", zone.move)
