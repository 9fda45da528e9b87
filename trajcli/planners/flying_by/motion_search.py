"""The fastest motions that are found of chains that differ in paces and borders, one after another.

Along a straight line in joint space one variable has the same bounds everywhere, and the search is exact.
Along other paths typical bounds stand for them; how much faster or slower the exact law is between the states
that were found sets the pace of a second search. Zones cost little where laws are dear: their pace is lowered
to what limits allow before any law is looked for.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.limits.kinds import TOOL_KINDS
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.chain_parts import ChainRow, PathPart, backwards, row_of
from trajcli.planners.flying_by.flown_parts import (
    CourseLaws,
    FlownPart,
    NoLawError,
    findings_of,
    flown_parts,
    joint_uses,
    zone_motion,
)
from trajcli.planners.flying_by.search import FoundStates, begin_search
from trajcli.planners.flying_by.stopping_laws import StoppingLaws

_MOST = 16  # searches
_LOWERINGS = 8  # of zones, before laws are looked for
_MORE = 1e-6  # by which a pace is lowered beyond what is needed
_SLOWER = 0.95  # the pace of a course that has no law between the states that were found
_CALMINGS = 3  # of states at borders near which there is no law
_CALM = (0.99, 0.9)  # times speed and acceleration
_LONGER = 1.05  # times the duration: what costs more is no help
_EASINGS = 4  # of a course, before states at its borders are those of slower laws
_EASED = 0.985  # of the pace of a bent course: states on its limits leave a law no room
_TRIES, _FASTER, _STEEPER = 6, 1.01, 1.06  # bolder states: times their speeds, times their accelerations
_ENOUGH = 1e-4  # relative: a gain that is worth another law
_CAREFUL = 0.97  # of the pace of a law from rest to rest: a state that is too fast costs a law in vain
_ROUGH = 1e-3  # size of grids whose states show which zones are over a limit
_BASIN = 0.02  # size of grids at which the better of two searches is known
POWERS = np.arange(1, 4)  # of a pace, in velocities, accelerations and jerks
_ORDERS = {kind.name: kind.order for kind in TOOL_KINDS}
_ALIKE = 0.03  # relative: a pace that changes by less is known
_STEPS = "in zones the tool's jerk cannot be limited where that of joints is not: say `limits: {jerk: ...}`"


@frozen
class _Motion:
    """A motion that was found.

    Attributes:
        chain: With the paces of its zones.
        row: The chain as nodes and parts.
        states: At the nodes, (N, 2).
        lowering: How much longer the search has it last than with zones that were not lowered, s.
    """

    chain: FlyByChain
    row: ChainRow
    states: Array
    lowering: float


class MotionSearch:
    """Searches of chains that are much the same: each begins where the last one ended.

    Attributes:
        chain: That of the last motion, its zones lowered to the pace that limits allow.
        model: Duration of the fastest that was found, before the pace of any zone was lowered, s.
        lowered: Whether a derivative of the joints was lowered in a zone for a limit of the tool.
    """

    def __init__(self, laws: CourseLaws, *, by_order: bool = True, within: float = math.inf) -> None:
        """Begin.

        Args:
            laws: Of courses, as far as they are known.
            by_order: Whether limits of the tool lower in zones the derivative of the joints that they are
                about, else the pace.
            within: Duration that is known without this search, s: what is expected to last longer is no use.
        """
        self.lowered, self._by_order = False, by_order
        self._within = min(within * (1 + _ROUGH), sys.float_info.max)
        self.chain: FlyByChain
        self.model = math.inf
        self._paces: dict[int, float] = {}
        self._lowering = 0.0
        self._near: Array | None = None
        self._changes: Array | None = None
        self._zones: dict[tuple[object, ...], tuple[list[Finding], Array]] = {}
        self._laws, self._stopping = laws, StoppingLaws(laws)
        self._motion: _Motion
        self._doubtful = set[int]()  # courses that have had no law

    def fastest(self, chain: FlyByChain) -> list[FlownPart]:
        """Return the parts of the fastest motion that is found: courses and zones in turns.

        Raises:
            PlanningError: When none is found.
        """
        self.chain, eased = chain, self._eased(chain)
        best: list[FlownPart] | None = None
        for _ in range(_MOST):
            found, row = self._searched(eased)
            if found.duration > self._within:
                if math.isinf(found.duration) and best is None and self._stopping.slow_all(self.chain):
                    continue
                break
            try:
                found, parts = self._flown(row, found)
            except NoLawError as error:
                if best is not None:
                    break
                self._ease(error, eased, found.states)
                continue
            second = best is not None
            if best is None or duration_of(parts) < duration_of(best):
                best, self._motion = parts, _Motion(self.chain, row, found.states, self._lowering)
            if self.exact or (not second and self._leaves_zones(parts)):
                break
            if self._adapted(_changes(chain, row, found, parts)) <= _ALIKE or second:
                break
        if best is None:
            raise PlanningError("no motion through its zones is found within the limits")
        self.chain = self._motion.chain  # a later search may have lowered zones more
        self.model = min(self.model, duration_of(best) - self._motion.lowering)
        return best

    @staticmethod
    def _eased(chain: FlyByChain) -> Array:
        return np.array([1.0 if course.uniform else _EASED for course in chain.courses])

    def by_pace(self, chain: FlyByChain, least: float) -> MotionSearch | None:
        """Return a search in which limits of the tool lower the pace of zones, if that looks faster.

        Args:
            chain: That was searched, its zones not lowered.
            least: How long its motion lasts, s; infinite where there is none.
        """
        other = MotionSearch(self._laws, by_order=False, within=least)
        other.chain, other._near, other._zones = chain, self._near, self._zones
        try:
            expected = other._searched(self._eased(chain), roughly=True)[0].duration
        except PlanningError:
            return None
        other._paces, other._lowering = self._paces, 0.0
        return other if expected <= least else None

    def _flown(self, row: ChainRow, found: FoundStates) -> tuple[FoundStates, list[FlownPart]]:
        """Return the parts of a motion, and its states: those at borders near which laws fail are calmed."""
        kept, failed = self._stopping.parts(self.chain), list[NoLawError]()
        longest = _LONGER * found.duration
        while True:
            try:
                return found, flown_parts(self.chain, row, found.states, self._laws, kept, self._doubtful)
            except NoLawError as error:
                failed.append(error)
                self._doubtful.update(error.failing)
            if failed[-1].far:
                raise failed[0]
            calm = {self._failing(index, s) for index, s in failed[-1].failing.items()}
            found = self._calmed(calm, row, found.states)
            if len(failed) > _CALMINGS or found.duration > longest:
                raise failed[0]

    def _failing(self, index: int, s: float | None) -> int:
        """Return the node at the end of a course that is nearer to where its law fails."""
        first, last = self.chain.stretch(index)
        return 2 * index - (s is None or s - first <= last - s)

    def _calmed(self, calm: set[int], row: ChainRow, states: Array) -> FoundStates:
        """Return states with less acceleration and speed at some nodes, and new ones across zones."""
        states = states.copy()
        states[[node + 1 for node in calm]] *= _CALM
        free = {node ^ 1 for node in calm} - calm
        nodes = [
            node if k in free else replace(node, given=states[k + 1]) for k, node in enumerate(row.nodes)
        ]
        return begin_search(nodes, row.parts, self.chain.ends, states).until().found()

    def _leaves_zones(self, parts: Sequence[FlownPart]) -> bool:
        """Return whether zones of a motion have to change: what is better now is not so then."""
        return any(findings_of(self.chain, k, parts[k]) for k in range(1, len(parts), 2))

    def _ease(self, error: NoLawError, eased: Array, states: Array) -> None:
        """Ask for less of courses that have no law between the states that were found."""
        for index, s in error.failing.items():
            course = self.chain.courses[index]
            if eased[index] > _EASED ** (_EASINGS + 0.5) and not course.uniform:
                self._paces[id(course)] *= _SLOWER
                eased[index] *= _EASED
            else:
                self._paces.pop(id(course), None)  # the pace of the law that stops
                self._stopping.slow(self.chain, index, s, states)

    @property
    def shares(self) -> Array:
        """The parts of the limits of joints that zones use, (k, 3)."""
        return np.array([corner.shares for corner in self.chain.corners]).reshape(-1, 3)

    @property
    def exact(self) -> bool:
        """Whether all courses are straight lines in joint space."""
        return all(course.uniform for course in self.chain.courses)

    def bolder(self, parts: list[FlownPart]) -> list[FlownPart]:
        """Return the parts of a faster motion, as long as bolder states at borders of bent paths have one.

        What bends of a path take of the jerk is known at its borders alone: the search is careful there.

        Args:
            parts: What `fastest` has returned, within all limits.
        """
        if self.exact:
            return parts
        bent = np.repeat([not course.uniform for course in self.chain.courses], 2)
        bent[[0, -1]] = False
        kept = self._stopping.parts(self.chain)
        bent[[2 * k + side for k in kept for side in (0, 1)]] = False
        states = self._motion.states
        for _ in range(_TRIES):
            states = np.where(bent[:, None], states * [_FASTER, _STEEPER], states)
            try:
                if any(findings for findings, _ in self._over(states)):
                    break
                other = flown_parts(self.chain, self._motion.row, states, self._laws, kept)
            except PlanningError:
                break
            if duration_of(other) > duration_of(parts) * (1 - _ENOUGH):
                break
            if any(findings_of(self.chain, k, part) for k, part in enumerate(other)):
                break
            parts = other
            self._raise_shares(parts)
        self.model = min(self.model, duration_of(parts) - self._motion.lowering)
        return parts

    def _raise_shares(self, parts: Sequence[FlownPart]) -> None:
        """Raise the shares of zones that use more of their joints' limits: limits of the tool allow it."""
        shares = self.shares
        for k, (part, corner) in enumerate(zip(parts[1::2], self.chain.corners, strict=False)):
            shares[k] *= np.maximum(joint_uses(part.curve, corner.limits).max(axis=1), 1.0)
        self.chain = with_shares(self.chain, np.minimum(shares, 1.0))

    def _adapted(self, changes: Array) -> float:
        """Change the paces of bent courses by factors (k,); return the largest change, relative."""
        for course, factor in zip(self.chain.courses, changes.tolist(), strict=True):
            if not course.uniform:
                self._paces[id(course)] *= factor
        return float(np.abs(changes - 1).max())

    def _searched(self, eased: Array, *, roughly: bool = False) -> tuple[FoundStates, ChainRow]:
        """Return the states found, and their row, once zones are as slow as limits ask for."""
        before = math.inf
        paces = [self._pace(k) for k in range(len(self.chain.courses))]
        for turn in range(_LOWERINGS):
            row = row_of(self.chain, paces, eased.tolist(), self._stopping.states(self.chain))
            changes, self._changes = self._changes, None
            for found in _found(row, self.chain.ends, self._near, changes, twice=self.exact):
                if found.duration > self._within:
                    return found, row
                if self.exact:
                    self.model = min(self.model, found.duration)
                self._lowering += max(found.duration - before, 0.0)
                self._near, before = found.states, found.duration
                if turn + 1 < _LOWERINGS and self._lowered(found.states):
                    break
                if roughly:
                    return found, row
            else:
                break
        return found, row

    def _lowered(self, states: Array) -> bool:
        """Lower the pace of zones that are over a limit, and the states beside them; return if any is."""
        if not self.chain.corners:
            return False
        shares = self.shares
        lowered = shares * [self._kept_shares(*each) for each in self._over(states)]
        self.chain = with_shares(self.chain, lowered)
        if not (lowered < shares).any():
            return False
        paces = np.pad(np.repeat(((lowered / shares) ** (1 / POWERS)).min(axis=1), 2), 1, constant_values=1.0)
        self._near, self._changes = states * paces[:, None] ** POWERS[:2], 1 - paces
        return True

    def _kept_shares(self, findings: Sequence[Finding], used: Array) -> Array:
        """Return by what to lower velocity, acceleration and jerk of the joints, of which they use (3,)."""
        shares = np.ones(3)
        for finding in findings:
            order = _ORDERS.get(finding.kind) if self._by_order else None
            powers = POWERS if order is None else np.where(order == POWERS, POWERS, 0)
            if (finding.factor or 1.0) > 1.0:
                kept = ((finding.factor or 1.0) * (1 + _MORE)) ** -powers
                shares = np.minimum(shares, kept if order is None else np.where(powers, kept * used, 1.0))
                self.lowered |= order is not None
        return shares

    def _over(self, states: Array) -> list[tuple[list[Finding], Array]]:
        """Return what is wrong with the motion through each zone, and what its joints use, (3,)."""
        over = []
        for k, corner in enumerate(self.chain.corners):
            borders = states[2 * k + 1 : 2 * k + 3]
            key = (k, corner.left, corner.joined, corner.shares, borders.tobytes())
            if key not in self._zones:
                motion = zone_motion(self.chain, k, borders)
                findings = findings_of(self.chain, 2 * k + 1, motion)
                used = np.minimum(joint_uses(motion.curve, corner.limits).max(axis=1), 1.0)
                self._zones[key] = findings, used
                if any(finding.kind.endswith("_jump") for finding in findings):
                    raise PlanningError(_STEPS)  # at any size and pace
            over.append(self._zones[key])
        return over

    def _pace(self, index: int) -> float:
        """Return by what the law of a course is taken to be faster than its typical bounds let it be."""
        course = self.chain.courses[index]
        if course.uniform:
            return 1.0
        if id(course) not in self._paces:
            law, ends = self._stopping.law(self.chain, index), self._stopping.ends(self.chain, index)
            part = PathPart(course.typical_bounds(0.0, course.length), course.length)
            expected = float(part.durations(ends[:1], ends[1:])[0, 0])
            self._paces[id(course)] = _CAREFUL * expected / law.curve.duration
        return self._paces[id(course)]


def with_shares(chain: FlyByChain, shares: Array) -> FlyByChain:
    """Return a chain whose zones use other parts of the limits of joints, (k, 3)."""
    corners = zip(chain.corners, shares.tolist(), strict=True)
    return replace(chain, corners=tuple(replace(corner, shares=tuple(each)) for corner, each in corners))


def duration_of(parts: Sequence[FlownPart]) -> float:
    """Return the duration of a motion, s."""
    return math.fsum(part.curve.duration for part in parts)


def _found(
    row: ChainRow,
    ends: tuple[Array, Array],
    near: Array | None,
    changes: Array | None = None,
    *,
    twice: bool,
) -> Iterator[FoundStates]:
    """Yield the states that are found for a row of nodes and parts, at last the fastest.

    Those of rough grids come before where paths bend: they show which zones are to be slower.
    """
    if not twice:
        forward = begin_search(row.nodes, row.parts, ends, near, changes)
        forward = forward.until(_ROUGH)
        yield forward.found()
        yield forward.until().found()
        return
    forward = begin_search(row.nodes, row.parts, ends, near)
    mirror = np.array([1.0, -1.0])
    back, back_near = backwards(row), None if near is None else near[::-1] * mirror
    other = begin_search(back.nodes, back.parts, (ends[1] * mirror, ends[0] * mirror), back_near).until(
        _BASIN
    )
    forward = forward.until(_BASIN)
    if forward.best.duration <= other.best.duration:
        yield forward.until().found()
        return
    found = other.until().found()
    yield FoundStates(found.states[::-1] * mirror, found.durations[::-1])


def _changes(chain: FlyByChain, row: ChainRow, found: FoundStates, parts: Sequence[FlownPart]) -> Array:
    """Return by what the law of each course is faster than the search took it for."""
    changes = np.ones(len(chain.courses))
    for k, course in enumerate(chain.courses):
        part = row.parts[2 * k]
        if not course.uniform and isinstance(part, PathPart):
            first, last = found.states[2 * k : 2 * k + 1], found.states[2 * k + 1 : 2 * k + 2]
            expected = float(part.durations(first, last)[0, 0])
            changes[k] = expected / parts[2 * k].curve.duration
    return changes
