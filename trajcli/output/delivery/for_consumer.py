"""Plans for a consumer: rows as it takes them, which keep its rules and all limits as it joins them.

Where the rows of the plan do not, other rows of the same motion may; else the motion is planned within
tighter limits, or with the breaks of its curves on rows, whichever lasts less.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.consumers.judgement import ProfileJudgement
from trajcli.consumers.profile import Profile
from trajcli.errors import TrajcliError, VerificationError, at_least
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.grids import Grid, KnotGrid, UniformGrid
from trajcli.job.read import LoadedJob
from trajcli.judge.judgement import Judgement
from trajcli.kinematics.robot import QUANTITIES
from trajcli.knots import has_knots
from trajcli.output.consumer import in_trajectory, judge_as_written
from trajcli.output.delivery.joined import joined_rows, rows_that_keep, set_columns
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.output.write import grid_of
from trajcli.planners.planner import Event
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.plan import Carried, Plan, plan_job
from trajcli.progress import report_progress
from trajcli.streams.decimals import Digits
from trajcli.streams.formats import DEFAULT, StreamFormat

if TYPE_CHECKING:
    from trajcli.output.recording import LogOptions

_ROUNDS = 16  # of tightening: a jerk that switches between rows is less than twice its limit
_SLACK = 1e-6  # relative: what a joined curve may be above a limit
_COARSE = 0.05  # of a limit: what decimals alone may make up between knots
_PERIODS = 200  # periods by which a motion is stretched as a whole, one after the other
_FEW_PERIODS = 32  # likewise, where nothing else was found
_BY_RULE = 3.0  # times a limit of a rule: what passes it by more is a step, as of a start in motion
_ENOUGH = 1e-6  # relative: a motion that lasts longer by less than that needs no other beside it
_LONGER = 1e-9  # relative: a duration that differs by less is the same


@frozen
class Writing:
    """How rows are written.

    Attributes:
        form: The format.
        digits: Of numbers that are written as text; None for nine decimals, or every bit where these are few.
        log: What the command line says about a log.
    """

    form: StreamFormat = DEFAULT
    digits: Digits | None = None
    log: LogOptions | None = None


@frozen
class ForConsumer:
    """A plan, and what its consumer makes of its rows.

    Attributes:
        plan: Its job says the rows.
        profile: Of the consumer.
        grid: Where the rows stand.
        rows: As they are joined.
        joined: What the joined curve does against the limits; None where the plan does not verify.
        rules: What the rows do against the rules; None likewise, and where the joined curve is over a limit.
        shortest: How long the motion lasts when nobody joins its rows, s.
        digits: With which its numbers are written as text.
        decimal: Whether they are written as text.
        chosen: Whether every digit is written because nine decimals are few.
        said: What there is to say about its rows, one line each.
    """

    plan: Plan
    profile: Profile
    grid: Grid
    rows: JoinedRows
    joined: Judgement | None
    rules: ProfileJudgement | None
    shortest: float
    digits: Digits
    decimal: bool = True
    chosen: bool = False
    said: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Of its motion, s."""
        return self.plan.trajectory.duration

    @property
    def over(self) -> tuple[Finding, ...]:
        """What keeps the rows from being written: limits, and necessary rules."""
        limits = () if self.joined is None else (f for f in self.joined.findings if f.limit is not None)
        rules = () if self.rules is None else (f for f in self.rules.findings if f.severity == "error")
        return (*limits, *rules)

    @property
    def keeps(self) -> bool:
        """Whether the rows may be written."""
        return self.plan.verdict.passed and not self.over

    @property
    def uses_over(self) -> list[tuple[float, int, int, int]]:
        """Limits of joints that are passed between rows, as `JoinedRows.uses` says.

        Where rows stand very near, their stamps and last bits explain some; but the consumer runs them.
        """
        return [u for u in self.rows.uses() if u[0] > 1 + _SLACK and u[1] <= self.rows.judged_orders]

    @cached_property
    def coarse(self) -> bool:
        """Whether the decimals of the rows make up much of a limit."""
        return self.digits == "fixed" and self.decimal and self.rows.rounding() > _COARSE

    @property
    def rough(self) -> bool:
        """Whether the whole numbers that its consumer takes make much of a limit between near points."""
        found = () if self.rules is None else self.rules.findings
        return any(each.kind == "quantisation" and each.quantity for each in found)

    @property
    def clean(self) -> bool:
        """Whether the rows may be written, and rounding makes nothing of them that is worth speaking of."""
        return self.keeps and not self.uses_over and not self.coarse

    @property
    def where(self) -> str:
        """The consumer, and where the rows stand, in words."""
        output, grid, rows = self.plan.loaded.job.output, self.rows.grid, "given times"
        if isinstance(grid, UniformGrid):
            rows = f"{grid.rate:g} Hz"
        elif isinstance(grid, KnotGrid):
            rows = f"{output.rate:g} Hz and its knots" if output.rows == "both" else "its knots"
        return f"for {self.profile.name} at {rows}"

    @cached_property
    def summary(self) -> str:
        """What is used of the limits as the rows will be joined, and how much longer the motion lasts."""
        used = max(self.rows.uses(), default=None)
        words = ""
        if used is not None and used[0] > 0:
            share, order, joint, _ = used
            name = self.plan.trajectory.joint_names[joint]
            words = f", {100 * share:.4g} % of the {QUANTITIES[order]} of {name} used"
        longer = self.duration / self.shortest - 1 if self.shortest else 0.0
        cost = f"; {100 * longer:.2g} % longer than between the rows" if longer > _LONGER else ""
        bits = ", every bit of its numbers written" if self.digits == "full" and self.chosen else ""
        return f"{self.where}{bits}: joined as it will be{words}{cost}"


def plan_for(
    loaded: LoadedJob, profile: Profile, brought: str, writing: Writing, carried: Carried | None = None
) -> ForConsumer:
    """Return the plan of a job for a consumer; where rows keep no limits, and the job says so, a slower one.

    Args:
        loaded: From `job_for`, as the other two.
        profile: Of the consumer.
        brought: What it brought.
        writing: How the rows are written.
        carried: What the tool carries in a move instead, as in `plan_job`.

    Raises:
        VerificationError: When they do not keep them, and the job says `when_over_limit: error`; it names
            what was tried and helps.
        InputError: When a move loosens a limit, or lacks one it needs.
        PlanningError: When a move has no curve.
    """
    search = _Search(loaded, profile, writing, carried)
    said = (brought,) if brought else ()
    first = search.first()
    if first.plan.verdict.passed and any(move.planned.braking for move in first.plan.moves):
        from trajcli.output.delivery.slower_motion import refuse_braking

        refuse_braking(first.plan, first.where)
    if first.keeps or not first.plan.verdict.passed:
        return replace(first, said=said)
    from trajcli.output.delivery.slower_motion import may_be_cured

    if not all(map(may_be_cured, first.over)):
        return replace(first, said=said)
    if loaded.job.when_over_limit == "error":
        raise refusal(first, [*search.help(first)] or (search.help(first) if search.roughly() else ()))
    made = search.remedy(first)
    if not made.keeps and search.roughly():
        made = search.remedy(first)
    return replace(made, said=(*said, *made.said))


def rows_for(plan: Plan, profile: Profile, writing: Writing) -> ForConsumer:
    """Return what its consumer makes of a plan that was made for it, limits and rules."""
    return _Search(plan.loaded, profile, writing, None).judged(plan, by_rules=True)


def refusal(made: ForConsumer, remedies: Iterable[str]) -> VerificationError:
    """Return why rows are not written for a consumer: what is worst, and what helps."""
    plan = made.plan
    found = max(made.over, key=lambda found: found.excess)
    of_rule = made.rules is not None and found in made.rules.findings
    worst = in_trajectory(plan, found.said_by(plan.loaded.say))
    others = len({in_trajectory(plan, each).move for each in made.over} - {worst.move})
    more = f" (and in {others} more move{'s' * (others > 1)})" if others else ""
    hint = "; ".join(remedies) or "neither other rows nor a slower motion was found that keeps them"
    text = f"{worst.rule if of_rule else made.where}: {worst.message}{more}"
    problem = replace(worst, hint=hint).problem(text, plan.loaded.place_of_move(worst.move or 0))
    return VerificationError(replace(problem, severity="error", kind=worst.rule if of_rule else worst.kind))


class _Search:
    """Search for the smallest remedy of rows that pass a limit as their consumer joins them."""

    def __init__(
        self, loaded: LoadedJob, profile: Profile, writing: Writing, carried: Carried | None
    ) -> None:
        self._loaded, self._profile, self._writing, self._carried = loaded, profile, writing, carried
        self._shortest = 0.0
        self._first: ForConsumer | None = None
        self._begun = Adaptation()  # what it knows of moves, all that are adapted know
        self._rough, self._refused = False, False  # rough rows are taken; some were not

    def first(self) -> ForConsumer:
        """Return the plan as it is without its consumer; its moves are kept for what follows."""
        made = self._first = self.attempt(self._loaded, self._begun, rules=True)
        return made

    def _begins(self, loaded: LoadedJob, adapted: Adaptation) -> ForConsumer:
        """Return the plan of a job with rows that it may have, before anything is tightened."""
        first = self._first
        if first is None or loaded is not self._loaded or adapted is not self._begun:
            return self.attempt(loaded, adapted)
        over = first.joined is not None and any(found.limit is not None for found in first.joined.findings)
        return replace(first, rules=None) if over else first

    def attempt(
        self, loaded: LoadedJob, adapted: Adaptation | None = None, *, rules: bool = False
    ) -> ForConsumer:
        """Return a plan with what its consumer makes of it."""
        return self.judged(plan_job(loaded, self._carried, adapted=adapted), by_rules=rules)

    def judged(self, plan: Plan, *, by_rules: bool = False) -> ForConsumer:
        """Return what the consumer makes of a plan; by rules only where rows keep the limits, or as asked."""
        # the curve is judged by exact numbers; what their decimals make of it is looked at apart
        writing, grid, digits = self._writing, grid_of(plan), self._writing.digits or "fixed"
        shortest = self._shortest = self._shortest or plan.trajectory.duration
        rows, decimal = joined_rows(plan, grid, writing.form, "full"), writing.form.decimals
        made = ForConsumer(plan, self._profile, grid, rows, None, None, shortest, digits, decimal)
        if not plan.verdict.passed:
            return made
        joined, rules = rows.judgement(slack=_SLACK), None
        if by_rules or joined is None or all(found.limit is None for found in joined.findings):
            rules = judge_as_written(plan, grid, self._profile, writing.form, digits=digits, log=writing.log)
            rules = replace(rules, findings=tuple(_in_its_move(found, plan) for found in rules.findings))
        made = replace(made, joined=joined, rules=rules)
        if made.coarse and writing.digits is None:
            return replace(made, digits="full", chosen=True)
        return made

    def roughly(self) -> bool:
        """Take rough rows from now on, where such were refused; return whether they were."""
        self._rough = self._refused
        return self._rough

    def remedy(self, first: ForConsumer) -> ForConsumer:
        """Return the motion with other rows, else the shortest slower one; `first` where there is none."""
        other = self.other_rows(first)
        return self.slower(first) if other is None else other[0]

    def _takes(self, made: ForConsumer) -> bool:
        """Return whether rows will do; rough ones are refused first, as long as others may be found."""
        refused = made.clean and made.rough and not self._rough
        self._refused |= refused
        return made.clean and not refused

    def other_rows(self, made: ForConsumer) -> tuple[ForConsumer, Mapping[str, Any]] | None:
        """Return the motion with other rows that the consumer takes and that keep all, and what changes."""
        for other in rows_that_keep(made.rows, self._writing.form):
            if self._profile.rows.rate is not None and {*other.output} != {"columns"}:
                continue
            found = self.judged(replace(made.plan, loaded=made.plan.loaded.with_output(other.output)))
            if self._takes(found):
                words = " and ".join(
                    f"columns {', '.join(value)}"
                    if key == "columns"
                    else f"rows at {'its knots' if key == 'rows' else f'{value:g} Hz'}"
                    for key, value in other.output.items()
                )
                text = f"{words} keep all limits as {self._profile.name} joins them"
                return _with_event(found, "other_rows", text), other.output
        return None

    def slower(self, first: ForConsumer) -> ForConsumer:
        """Return the shortest motion that was found whose rows keep all; `first` where none was."""
        best: ForConsumer | None = None
        for stretched in (True, False) if self._loaded.job.flies_by else (False,):
            if stretched or best is None:
                best = self._best_of([*self._candidates(first)], first, stretched=stretched)
        best = self._stretched(first, best) or best
        stops = self._with_stops() if self._loaded.job.flies_by else None
        if stops is not None and not (best and best.duration < stops.duration):
            text = f"{stops.where}: no motion through the zones is faster than one that stops at the corners"
            return _with_event(stops, "not_faster", text)
        if best is None:
            return first
        if stops is not None and best.plan.flyby is not None:
            flyby = replace(best.plan.flyby, stopping=stops.duration)
            best = replace(best, plan=replace(best.plan, flyby=flyby))
        longer = best.duration / first.duration
        if longer <= 1 + _LONGER:
            return _with_event(best, "for_consumer", f"{best.where}: its breaks fall on rows")
        text = f"{best.where}: stretched {at_least(longer)} times so that its rows, joined, keep all limits"
        return _with_event(best, "slowed", text)

    def _with_stops(self) -> ForConsumer | None:
        """Return the motion that stops at all corners, where its rows keep all."""
        from trajcli.planning.flown_job import FlyBy

        job = self._loaded.job
        loaded = replace(self._loaded, job=job.with_stops())
        search = _Search(loaded, self._profile, self._writing, self._carried)
        search._rough = self._rough
        try:
            first = search.first()
            made = first if search._takes(first) else search.slower(first)
        except TrajcliError:
            return None
        if not made.keeps or (made.clean and not self._takes(made)):
            return None
        loaded = replace(loaded, job=job.model_copy(update={"output": made.plan.loaded.job.output}))
        flyby = FlyBy(made.duration, made.duration, made.duration, (), None)
        return replace(made, plan=replace(made.plan, loaded=loaded, flyby=flyby))

    def _best_of(
        self, candidates: Sequence[tuple[LoadedJob, Adaptation]], first: ForConsumer, *, stretched: bool
    ) -> ForConsumer | None:
        """Return the shortest motion of some candidates, of two that last as long that of the earlier one.

        Breaks on rows do least harm: such a motion is found soon, and ends the search of others early.
        """
        best, rank, enough = None, 0, first.duration * (1 + _ENOUGH)
        order = sorted(range(len(candidates)), key=lambda number: -_breaks_on_rows(*candidates[number]))
        for number in order:
            longest = np.inf if best is None else best.duration
            if longest <= enough:
                break
            if number > rank:
                longest = np.nextafter(longest, 0.0)
            with suppress(TrajcliError):
                made = self._tightened(*candidates[number], longest, stretched=stretched)
                best, rank = (best, rank) if made is None else (made, number)
        return best

    def _candidates(self, first: ForConsumer) -> Iterator[tuple[LoadedJob, Adaptation]]:
        """Yield jobs with rows that they may have, and how their moves are planned."""
        yield self._loaded, self._begun
        output, form = self._loaded.job.output, self._writing.form
        columns: list[dict[str, Any]] = [{}]
        jerk = any(np.isfinite(move.robot.limits.jerk).any() for move in first.plan.moves)
        if "qdd" in output.columns and form.content != "log" and not jerk:
            columns.append({"columns": self._profile.rows.columns[:3]})
        if self._profile.rows.rate is None and has_knots(first.plan.trajectory):
            for change in columns:
                yield self._loaded.with_output({"rows": "knots", "times": None, **change}), self._begun
        if isinstance(first.grid, UniformGrid) and form.content != "knots":
            for change in columns:
                yield (
                    self._loaded.with_output({"align": True, **change}),
                    replace(self._begun, period=1 / first.grid.rate),
                )

    def _stretched(self, first: ForConsumer, best: ForConsumer | None) -> ForConsumer | None:
        """Return the motion stretched as a whole by the fewest periods that do, where that beats the best.

        Through zones a motion has too many breaks for all of them to fall on rows by chance.
        """
        if not isinstance(first.grid, UniformGrid) or self._writing.form.content == "knots":
            return None
        if self._loaded.job.flies_by:
            return None
        from trajcli.output.delivery.slower_motion import StretchedMoves

        duration, rate = first.duration, first.grid.rate
        by_move = StretchedMoves(first.rows, rate, self._begun.fastest)
        longest = np.inf if best is None else best.duration
        count = _FEW_PERIODS if best is None else min(ceil((longest - duration) * rate), _PERIODS)
        for periods in range(1, count):
            factor = 1 + periods / (rate * duration)
            if by_move.are_over(factor):
                continue
            stretches = {move.index: factor for move in first.plan.moves}
            report_progress(f"planning for {self._profile.name}, {periods} periods longer")
            with suppress(TrajcliError):
                made = self.attempt(
                    self._loaded.with_output({"align": True}), replace(self._begun, stretches=stretches)
                )
                if made.duration >= longest:
                    return None
                if self._takes(made):
                    return made
        return None

    def _tightened(
        self, loaded: LoadedJob, adapted: Adaptation, longest: float, *, stretched: bool = False
    ) -> ForConsumer | None:
        """Return a motion whose rows keep all, within tighter limits where that is needed."""
        from trajcli.output.delivery.slower_motion import tightened

        for count in range(_ROUNDS):
            report_progress(f"planning for {self._profile.name}, round {count + 1}")
            made = self.attempt(loaded, adapted) if count else self._begins(loaded, adapted)
            if made.duration > longest:
                return None
            if made.clean or not made.plan.verdict.passed:
                return made if self._takes(made) else None
            tighter = tightened(made.plan, made.over, made.uses_over, adapted, stretched=stretched)
            if tighter is None:
                return None
            adapted = tighter
        return None

    def help(self, first: ForConsumer) -> Iterator[str]:
        """Yield what helps, each tried, with its duration."""
        job, document = self._loaded.job, self._loaded.document
        other = self.other_rows(first)
        if other is not None:
            changed = dict(other[1])
            columns = changed.pop("columns", None)
            options = [f"--{key} {value}" for key, value in changed.items()]
            instead = ""
            if columns is not None:  # `--for` brings its own
                options += [
                    *self._said_by_job(),
                    f"--set output.for={self._profile.name}",
                    set_columns(columns),
                ]
                instead = " in place of `--for`"
                if job.output.times is None and document.node(("output", "times")) is not None:
                    instead += " and without `output.times`"
            yield f"`{' '.join(options)}`{instead} keeps all limits, with {first.duration:.6g} s as now"
        slowed = replace(self._loaded, job=job.model_copy(update={"when_over_limit": "slow"}))
        slow = _Search(slowed, self._profile, self._writing, self._carried)
        slow._begun, slow._rough = self._begun.where_slowed(), self._rough
        slower = slow.slower(first)
        self._refused |= slow._refused
        if slower.keeps:
            yield f"`--set when_over_limit=slow` keeps all limits, with {slower.duration:.6g} s"

    def _said_by_job(self) -> Iterator[str]:
        """Yield options for what the job says of its rows, which goes before a consumer that it names."""
        wanted, document = self._profile.rows, self._loaded.document
        output = self._loaded.job.output
        if wanted.rate is not None and document.node(("output", "rate")) is not None:
            yield f"--rate {wanted.rate}"
        if document.node(("output", "rows")) is not None and output.rows in (None, "rate"):
            yield "--rows rate"
        if wanted.align and document.node(("output", "align")) is not None:
            yield "--set output.align=true"


def _breaks_on_rows(loaded: LoadedJob, adapted: Adaptation) -> int:
    """Return 2 for rows at the breaks of a curve, 1 where its breaks are moved onto rows, else 0."""
    return 2 if loaded.job.output.rows == "knots" else int(adapted.period is not None)


def _in_its_move(found: Finding, plan: Plan) -> Finding:
    """Return a finding of a rule with the move it is in, where rows do not say that and slowness may help."""
    if found.move is not None or found.time is None or not found.excess < _BY_RULE:
        return found
    begins = [span.start for span in plan.trajectory.spans]
    local = found.time - plan.loaded.job.output.start_time
    number = max(int(np.searchsorted(begins, local, "right")) - 1, 0)
    return replace(found, move=plan.trajectory.spans[number].index)


def _with_event(made: ForConsumer, kind: str, text: str) -> ForConsumer:
    """Return a plan with one more event."""
    events = (*made.plan.events, Event(kind, text))
    return replace(made, plan=replace(made.plan, events=events))
