"""Payload capacity: the largest mass with which a job still verifies, and what binds there.

At each instant every effort is affine in the mass that is carried, so that rows of a plan nearly say which
mass brings one to its limit. The bracket around it is halved by the job's own verdict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import InputError, Problem, TrajcliError, VerificationError
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import Payload, Robot, point_mass
from trajcli.limits.effort import EffortFamily
from trajcli.limits.kinds import LimitedMove
from trajcli.limits.tolerances import EFFORT_RELATIVE
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Carried, Plan, plan_job
from trajcli.planning.planned_move import KnownMoves
from trajcli.progress import progress_of

PlanWith = Callable[[LoadedJob, Carried], Plan]
"""Returns the plan of a job with what the tool carries in a move instead."""
LARGEST = 1e6
"""What no arm carries, kg."""
_CLOSE = 1e-10  # relative: width at which a bracket is closed
_GUESS = 1e-4  # relative: how near the rows of a plan come to its mass
_ALLOWED = (0.0, EFFORT_RELATIVE)  # what gravity alone may take beyond a limit: none, or that of a verdict
_EACH = 64  # rows of a piece


@frozen
class PayloadCapacity:
    """The largest mass with which a job still verifies.

    Attributes:
        mass: kg; None where any mass will do.
        com: Where it is carried, in the frame of the tcp, m, (3,); None where the job carries it at several.
        moves: Indices of the moves in which it is carried.
        joint: Name of the joint that binds; None where none does.
        move: Index of the move in which it binds.
        time: When, s from the start of the trajectory.
        effort: Of the joint there, N m or N.
        limit: That it reaches.
        cause: What is wrong with more, in words; None where any mass will do.
    """

    mass: float | None
    com: Array | None
    moves: tuple[int, ...]
    joint: str | None = None
    move: int | None = None
    time: float | None = None
    effort: float | None = None
    limit: float | None = None
    cause: str | None = None


def payload_capacity(
    loaded: LoadedJob, at: int | None = None, planned: PlanWith | None = None
) -> PayloadCapacity:
    """Return the largest mass with which a job verifies, each move planned anew as the job says it.

    Args:
        loaded: The job. Where it attaches payloads their masses are sought, all of them the same, each at its
            centre of mass and with its inertia; where it attaches none, that of a point at the tcp.
        at: Index of a move: only what is carried there is sought, or, where nothing is, a point at the tcp in
            this move alone.
        planned: Returns the plan of the job with what the tool carries; unless given, it is for no consumer.

    Raises:
        InputError: When there is no such move, or no limit of effort is in force in it.
        TrajcliError: Of the job, when it does not even verify without the payload.
    """
    alone = partial(plan_job, advise=False, planned=KnownMoves())  # most moves are the same with every mass
    search = _Search(loaded, _carriers(loaded, at), planned or alone)
    low, high = search.bracket_of_stops() or search.bracket()
    if high is None:
        return PayloadCapacity(None, search.com, search.moves)
    return search.result(low, high)


def _carriers(loaded: LoadedJob, at: int | None) -> dict[int, Payload]:
    """Return what is carried in the moves that count, by their index; of the mass that the job says.

    What is attached keeps its place on the flange: the tcp of another tool sees it elsewhere.
    """
    moves = loaded.job.moves
    hint = f"its moves are 0 to {len(moves) - 1}"
    if at is not None and not 0 <= at < len(moves):
        raise InputError(f"--at {at}: {loaded.name} has no such move", hint=hint)
    held, taken, robot = dict[int, Payload](), dict[int, int](), loaded.robot
    for index, planner in enumerate(moves):
        robot = planner.equipped(robot)
        if robot.payload is not None:
            held[index], taken[index] = robot.payload, taken.get(index - 1, index)
    if at in held:
        return {index: payload for index, payload in held.items() if taken[index] == taken[at]}
    if at is not None:
        if moves[at].handles:
            raise InputError(f"--at {at}: nothing is carried there", hint="name a move, or what attaches")
        return {at: point_mass(0.0)}
    return held or dict.fromkeys(range(len(moves)), point_mass(0.0))


class _Search:
    """Attempts at planning a job with different masses."""

    def __init__(self, loaded: LoadedJob, carriers: dict[int, Payload], planned: PlanWith) -> None:
        self._loaded, self._carriers, self._planned = loaded, carriers, planned
        self.moves = tuple(sorted(carriers))
        self.template = carriers[self.moves[0]]
        alike = len({tuple(payload.com.tolist()) for payload in carriers.values()}) == 1
        self.com = self.template.com if alike else None
        self._plans: dict[float, Plan | TrajcliError] = {}

    def attempt(self, mass: float) -> Plan | TrajcliError:
        if mass not in self._plans:
            try:
                with progress_of(f"trial {len(self._plans) + 1}, {mass:.9g} kg"):
                    self._plans[mass] = self._planned(self._loaded, partial(self._carried, mass))
            except TrajcliError as error:
                self._plans[mass] = error
        return self._plans[mass]

    def _carried(self, mass: float, index: int, payload: Payload | None) -> Payload | None:
        own = self._carriers.get(index)
        return payload if own is None else Payload(mass, own.com, own.inertia)

    def passes(self, mass: float) -> bool:
        plan = self.attempt(mass)
        return isinstance(plan, Plan) and plan.verdict.passed

    def feasible_mass(self) -> tuple[float, Plan]:
        """Return a mass with which the job verifies, and its plan: none, or else that of the job."""
        for mass in (0.0, self.template.mass):
            plan = self.attempt(mass)
            if isinstance(plan, Plan) and plan.verdict.passed:
                return mass, plan
        empty = self.attempt(0.0)
        if isinstance(empty, TrajcliError):
            raise empty
        worst = max(empty.verdict.findings, key=lambda finding: finding.kind == "effort")
        hint = worst.hint or "`trajcli plan` says what is wrong"
        text = f"the job does not verify even without the payload: {worst.text(self._loaded.say)}"
        place = self._loaded.place_of_move(worst.move or 0)
        raise VerificationError(Problem(text, hint, place, worst.move, worst.joint, worst.time))

    def require_limits(self, plan: Plan) -> None:
        """Raise when no effort is limited where the payload is carried."""
        if not any(plan.moves[index].robot.limits.has_effort for index in self.moves):
            place = self._loaded.document.place(("limits",))
            hint = "say `limits: {effort: robot}`, or give them by joint"
            message = "no limit of effort is in force, so there is no largest payload"
            raise InputError(Problem(message, hint, place))

    def bracket(self) -> tuple[float, float | None]:
        """Return a mass that verifies and one above it, as near as they get, that does not; None: any."""
        low, plan = self.feasible_mass()
        self.require_limits(plan)
        low, high = self._bracket(low, plan)
        return (low, None) if high is None else self.closed(low, high)

    def bracket_of_stops(self) -> tuple[float, float | None] | None:
        """Return the bracket of the job with stops, where both its ends hold for the one that flies, too.

        Motions through zones are slowed until they keep efforts: as a rule the arm carries what it can with
        stops, which is found in a fraction of the time.
        """
        if not self._loaded.job.flies_by:
            return None
        stopping = replace(self._loaded, job=self._loaded.job.with_stops())
        try:
            low, high = _Search(stopping, self._carriers, self._planned).bracket()
        except TrajcliError:
            return None
        if not self.passes(LARGEST if high is None else low) or (high is not None and self.passes(high)):
            return None
        return low, high

    def _bracket(self, low: float, plan: Plan) -> tuple[float, float | None]:
        """Return a mass that verifies and one above it that does not; None where any does."""
        guesses = sorted(mass for mass in self._guesses(plan) if low < mass < LARGEST)
        near = [mass * factor for mass in guesses for factor in (1 - _GUESS, 1 + _GUESS)]
        beyond = 2.0 ** np.arange(-3, np.ceil(np.log2(LARGEST)) + 1)
        for mass in sorted({*near, *(beyond * max([1.0, *guesses])).tolist()}):
            if mass <= low:
                continue
            if not self.passes(mass):
                return low, mass
            low = mass
        return low, None

    def _guesses(self, plan: Plan) -> Iterator[float]:
        """Yield masses that bring an effort of a plan to its limit, of its motion and of the arm at rest."""
        for index in self.moves:
            move = plan.moves[index]
            if move.duration > 0 and move.robot.limits.has_effort:
                yield from _masses_at_limit(move, self._carriers[index])

    def closed(self, low: float, high: float) -> tuple[float, float]:
        """Return the bracket as narrow as it gets.

        Masses are tried beside the one where the line through what two too large ones take meets the limit.
        Where the motion is the same at both ends only its efforts change between them.
        """
        below, further, beside = self.attempt(low), high * (1 + _GUESS), _CLOSE / 4
        motion = below if _same_motion(below, self.attempt(high)) else None
        while high - low > _CLOSE * high:
            middle, x, y = 0.5 * (low + high), self._over(high, motion), self._over(further, motion)
            for allowed in _ALLOWED:
                root = 0.0 if x == y else high - (x - allowed) * (further - high) / (y - x)
                lower, upper = root * (1 - beside), root * (1 + beside)
                if low * (1 - _CLOSE / 8) < root < high:
                    middle = lower if lower > low else upper if upper < high else middle
                    beside *= 4
                    break
            if self.passes(middle) if motion is None else self._over(middle, motion) <= 0:
                low = middle
            else:
                high, further = middle, high
        return low, high

    def _over(self, mass: float, motion: Plan | TrajcliError | None) -> float:
        """Return by which part of an effort limit a mass is over it: in a motion, or failing; else 0."""
        if isinstance(motion, Plan):
            return self._share(motion, mass) - 1.0 - EFFORT_RELATIVE
        failed = self.attempt(mass)
        if isinstance(failed, Plan):
            shares = [f.excess for f in failed.verdict.findings if f.kind == "effort"]
            return max(shares, default=1.0) - 1.0 - EFFORT_RELATIVE
        value, limit = failed.problems[0].value, failed.problems[0].limit
        return value / limit - 1.0 if value and limit else 0.0

    def _share(self, plan: Plan, mass: float) -> float:
        """Return the largest share of a limit that the efforts of a plan have with another mass."""
        share = 0.0
        for index in self.moves:
            move, own = plan.moves[index], self._carriers[index]
            robot = replace(move.robot, payload=Payload(mass, own.com, own.inertia))
            if robot.limits.has_effort:
                span = plan.trajectory.spans[index]
                efforts = EffortFamily().survey(LimitedMove(plan.trajectory, span, robot.limits, robot))
                share = max(share, 0.0 if efforts is None else efforts.share())
        return share

    def result(self, low: float, high: float) -> PayloadCapacity:
        """Return the capacity within a bracket, and what binds: what fails at its upper end."""
        capacity = PayloadCapacity(low, self.com, self.moves)
        failed = self.attempt(high)
        if isinstance(failed, Plan):
            worst = max(failed.verdict.findings, key=lambda found: (found.kind == "effort", found.excess))
            binds = replace(capacity, move=worst.move, time=worst.time, cause=worst.text(self._loaded.say))
            if worst.kind != "effort":
                return binds
            return replace(binds, joint=worst.joint, effort=worst.value, limit=worst.limit)
        problem = failed.problems[0]
        binds = replace(capacity, move=problem.move, time=problem.time, cause=problem.message)
        if problem.joint is None or problem.kind not in ("effort", None):
            return binds
        return replace(
            binds,
            joint=problem.joint,
            time=problem.time if problem.time is not None else self._time(low, problem),
            effort=problem.value,
            limit=problem.limit,
        )

    def _time(self, mass: float, problem: Problem) -> float | None:
        """Return when the joint of a problem is nearest to its limit in the plan with a mass."""
        plan, value = self.attempt(mass), problem.value
        if not isinstance(plan, Plan) or problem.move is None or problem.joint is None or value is None:
            return None
        efforts = plan.verdict.efforts[problem.move]
        if efforts is None:
            return None
        joint = plan.trajectory.joint_names.index(problem.joint)
        peak = (efforts.highest if value > 0 else efforts.lowest)[joint]
        return peak.time - plan.trajectory.curve.start


def _same_motion(a: Plan | TrajcliError, b: Plan | TrajcliError) -> bool:
    if not (isinstance(a, Plan) and isinstance(b, Plan)):
        return False
    one, other = a.trajectory.curve, b.trajectory.curve
    return np.array_equal(one.breaks, other.breaks) and np.array_equal(one.coefficients, other.coefficients)


def _masses_at_limit(move: PlannedMove, payload: Payload) -> Iterator[float]:
    """Yield the least mass that brings a joint to its limit on rows of a move, in motion and at rest."""
    curve, limits = move.planned.curve, move.robot.limits.effort
    inside = np.linspace(0.0, 1.0, _EACH)
    times = (curve.breaks[:-1, None] + curve.lengths[:, None] * inside).reshape(-1)
    q, qd, qdd = (curve.evaluate(times, order) for order in range(3))
    for rates in ((qd, qdd), (np.zeros_like(q), np.zeros_like(q))):
        without, with_one = (_efforts(move.robot, payload, mass, q, rates) for mass in (0.0, 1.0))
        slope = with_one - without
        with np.errstate(divide="ignore", invalid="ignore"):
            masses = (np.where(slope > 0, limits[:, 1], limits[:, 0]) - without) / slope
        masses = masses[np.isfinite(masses) & (masses > 0)]
        if masses.size:
            yield float(masses.min())


def _efforts(robot: Robot, payload: Payload, mass: float, q: Array, rates: tuple[Array, Array]) -> Array:
    carrying = replace(robot, payload=Payload(mass, payload.com, payload.inertia))
    return InverseDynamics(carrying).effort(q, *rates)
