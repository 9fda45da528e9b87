"""`trajcli plan`: jobs that are written or judged, the summary for people, annotations for CI."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from trajcli.cli.outcome import BUG, print_remark, print_text, refuse_two_inputs, report_bug, report_error
from trajcli.cli.progress import is_terminal, progress
from trajcli.errors import Amount, InputError, Place, Problem, TrajcliError, VerificationError
from trajcli.grids import Grid
from trajcli.job.read import LoadedJob, files_of, load_job
from trajcli.output.write import grid_of, write_rows, write_text
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.formats import StreamFormat, format_of
from trajcli.streams.whole_file import identity, refuse_overwriting, remove_aside, set_aside

if TYPE_CHECKING:
    from trajcli.cli.job_commands import PlanCommand
    from trajcli.consumers.profile import Profile
    from trajcli.job.report import MoveReport
    from trajcli.job.report_parts import PathReferenceReport, PeerViolation, ReferenceReport
    from trajcli.judge.judgement import Judgement
    from trajcli.output.annotations import AnnotationForm
    from trajcli.output.delivery.for_consumer import ForConsumer
    from trajcli.output.delivery.joined_rows import JoinedRows
    from trajcli.output.recording import LogOptions
    from trajcli.planning.flown_job import FlyBy

_EXCLUDED = ("output", "report", "resolved")
_FEW_STEPS = 9  # in acceleration: of more the largest says most
_STILL = 1e-9  # rad/s or m/s, below which a joint only rounds


def run_plan(options: PlanCommand) -> int:
    """Plan and judge each job, whatever is wrong with the others; return the worst exit code.

    Raises:
        InputError: When several jobs would be written.
    """
    jobs, form = [options.job, *options.others], options.errors
    refuse_two_inputs(jobs)
    if len(jobs) > 1:
        _check_nothing_is_written(options)
    if form == "text" or form == "json":
        return max(_exit_code_of_job(job, options) for job in jobs)
    return _annotated(jobs, options, form)


def _check_nothing_is_written(options: PlanCommand) -> None:
    if not options.no_output:
        hint = "only judge them with --no-output, or write them with `trajcli batch`"
        raise InputError("several jobs cannot be written to one stream", hint=hint)
    for name in (name for name in _EXCLUDED if getattr(options, name) is not None):
        raise InputError(f"--{name} is about one job, and there are several", hint="name one job")


def _exit_code_of_job(job: str, options: PlanCommand) -> int:
    """Judge one of several jobs; report what is wrong with it, and return its exit code."""
    try:
        plan_and_write(job, options)
    except TrajcliError as error:
        report_error(error, options.errors)
        return error.exit_code
    except OSError:
        raise
    except Exception as error:  # noqa: BLE001
        return report_bug(error, options.errors)
    return 0


def _annotated(jobs: Sequence[str], options: PlanCommand, form: AnnotationForm) -> int:
    """Judge jobs; write one document, or a line for each annotation; return the worst exit code."""
    from trajcli.output.annotations import annotations_of, render_annotations

    code = 0
    found: list[Problem] = []
    quiet = options if form == "github" else options.replaced(quiet=True)  # a document stands alone
    for job in jobs:
        try:
            found += _concessions(plan_and_write(job, quiet), job)
        except TrajcliError as error:
            found += annotations_of(error, job)
            code = max(code, error.exit_code)
        except OSError:
            raise
        except Exception as error:  # noqa: BLE001
            from trajcli.version import library_error

            of_library = library_error(error)
            found += annotations_of(of_library or TrajcliError(Problem(f"a bug in trajcli: {error}")), job)
            code = max(code, of_library.exit_code if of_library else BUG)
    print(render_annotations(found, form, jobs), end="", file=sys.stderr)  # noqa: T201
    return code


def _concessions(plan: Plan, job: str) -> Iterator[Problem]:
    """Yield what was conceded in a plan that verifies."""
    for event in plan.events:
        place = Place(job, 0, 0) if event.move is None else plan.loaded.place_of_move(event.move)
        text = event.text(plan.loaded.say)
        yield Problem(text, place=place, kind=event.kind, severity="warning")


def plan_and_write(job: str, options: PlanCommand) -> Plan:
    """Plan, judge and write a job; return the plan, which verifies.

    Raises:
        TrajcliError: When anything is wrong; then no rows were written.
    """
    form = _check_options(options)
    loaded = load_job(job, options.override, rate=options.rate, rows=options.rows, si=options.si)
    wanted = _wanted(loaded, options)
    loaded = loaded if wanted is None else wanted[0]
    _check_beside_job(loaded, options)
    log = _log_options(options)
    if log is not None:
        from trajcli.output.recording import check_log_options

        check_log_options(log, loaded.robot, loaded.job.output.start_time)
    if options.resolved is not None:
        from trajcli.job.dump import dump_job

        write_text(dump_job(loaded), options.resolved)
    table = _shows_table(options)
    with (
        _older_rows_aside(options),
        progress(to_terminal=options.output in (None, "-") and not options.no_output and not table),
    ):
        with np.errstate(all="ignore"):  # what is not finite is for the checks to find
            made = None if wanted is None else _made(wanted, form, options)
            plan = plan_job(loaded) if made is None else made.plan
        grid = grid_of(plan)
        plan, rows = _beside_rows(plan, grid, form, options, made)
        refusal = _refusal(plan, options, made)
        if refusal is None and options.reference:
            refusal = _contradicted(plan)
        if refusal is None and not options.no_output and not table:
            digits = (options.digits or "fixed") if made is None else made.digits
            write_rows(plan, grid, options.output, digits, form=form, log=log)
            remove_aside(options.output or "-")
    if options.report is not None or options.reference:
        _report(plan, options, made, rows)  # behind the rows: where it stands, they do
    if refusal is not None:
        _set_aside(options)
        raise refusal
    if not options.quiet:
        written = 0 if options.no_output or table or form.content == "knots" else grid.count
        missing = form.content == "log" and loaded.robot.convention is None
        _summarise(plan, written, geometry_missing=missing, details=options.verbose)
        if made is not None:
            _summarise_consumer(made)
    if table:
        _print_table(plan)
    return plan


def _shows_table(options: PlanCommand) -> bool:
    """Return whether people who asked for no rows see a table of the moves in their place."""
    return (
        options.output is None and options.form is None and not options.no_output and is_terminal(sys.stdout)
    )


def _print_table(plan: Plan) -> None:
    from trajcli.cli.terminal import on_terminal, tightest_lines

    last = "rows: -o FILE.csv writes them, -o - prints them here"
    print_text(on_terminal([*tightest_lines(plan, sys.stdout), last]))


@contextmanager
def _older_rows_aside(options: PlanCommand) -> Iterator[None]:
    """Take rows of an earlier plan out of the way where a new one fails."""
    try:
        yield
    except TrajcliError:
        _set_aside(options)
        raise


def _set_aside(options: PlanCommand) -> None:
    aside = None if options.no_output or options.output is None else set_aside(options.output)
    if aside is not None:
        print_remark(f"{options.output} was of an earlier plan: it is {aside} now")


def _beside_rows(
    plan: Plan, grid: Grid, form: StreamFormat, options: PlanCommand, made: ForConsumer | None
) -> tuple[Plan, tuple[JoinedRows, Judgement] | None]:
    """Return a plan with the event of rows that pass a limit between them, and what was judged of them."""
    if not plan.verdict.passed:
        return plan, None
    if made is not None:
        return plan, None if made.joined is None else (made.rows, made.joined)
    from trajcli.output.delivery.joined import joined_rows, with_event

    rows = joined_rows(plan, grid, form, options.digits or "fixed")
    plan, judged = with_event(plan, rows, form)
    return plan, None if judged is None else (rows, judged)


def _wanted(loaded: LoadedJob, options: PlanCommand) -> tuple[LoadedJob, Profile, str] | None:
    """Return the job as the consumer takes its rows that the command line, or it, names; and what that is."""
    if options.consumer is None and loaded.job.output.consumer is None:
        return None
    from trajcli.output.consumer import job_for

    kept = {"rate": options.rate is not None, "rows": options.rows is not None}
    return job_for(loaded, options.consumer, kept)


def _made(wanted: tuple[LoadedJob, Profile, str], form: StreamFormat, options: PlanCommand) -> ForConsumer:
    from trajcli.output.delivery.for_consumer import Writing, plan_for

    return plan_for(*wanted, Writing(form, options.digits, _log_options(options)))


def _log_options(options: PlanCommand) -> LogOptions | None:
    if options.topics is None and options.epoch is None and options.compression is None:
        return None
    from trajcli.output.recording import LogOptions

    return options.part(LogOptions)


def _contradicted(plan: Plan) -> VerificationError | None:
    """Return the error of moves that are faster than any motion within their limits can be."""
    from trajcli.peers.move_reference import contradictions_of, reference_of

    found = contradictions_of(plan.trajectory.spans, [reference_of(move) for move in plan.moves])
    problems = [
        one.problem(f"{_where(plan, one.move)}{one.message}", plan.loaded.place_of_move(one.move or 0))
        for one in found
    ]
    return VerificationError(*problems) if problems else None


def _summarise_consumer(made: ForConsumer) -> None:
    from trajcli.output.consumer import counted

    lines = [*made.said, made.summary]
    if made.rules is not None:
        unjudged = ", ".join(rule for rule, _ in made.rules.unjudged)
        lines.append(f"for {made.profile.name}: all necessary rules are kept")
        lines += [f"  {each.rule}: {each.message}{counted(each)}" for each in made.rules.findings]
        lines += [f"  not judged: {unjudged}"] if unjudged else []
    for line in lines:
        print_remark(line)


def _refusal(plan: Plan, options: PlanCommand, made: ForConsumer | None) -> VerificationError | None:
    """Return why no rows are written: findings, concessions that `--strict` refuses, or the consumer."""
    if not plan.verdict.passed:
        from trajcli.output.report import verification_error

        return verification_error(plan, every=options.every or options.errors != "text")
    if options.strict and plan.events:
        from trajcli.output.report import concession_error

        return concession_error(plan)
    if made is None:
        return None
    from trajcli.output.consumer import refusal_of
    from trajcli.output.delivery.for_consumer import refusal

    broken = None if made.rules is None else refusal_of(plan, made.rules, strict=options.strict)
    return broken or (refusal(made, ()) if made.over else None)


def _check_options(options: PlanCommand) -> StreamFormat:
    """Return the format of the output; refuse options that do not fit it, or each other."""
    given_of_log = _log_options(options)
    log = () if given_of_log is None else given_of_log.given
    if options.no_output:
        # a consumer is judged by the form in which the motion would come to it
        named = options.form if options.consumer is None else None
        given = {"--output": options.output, "--format": named, **dict.fromkeys(log, "")}
        for name in (name for name, value in given.items() if value is not None):
            raise InputError(f"--no-output and {name} exclude each other", hint="leave one of them out")
    form = format_of(options.output, options.form)
    if log and form.content != "log":
        hint = "write one with -o FILE.mcap, or with --format mcap to a pipe"
        raise InputError(f"{log[0]} is about MCAP, and the rows are written as {form.name}", hint=hint)
    if options.digits is not None and not form.decimals:
        raise InputError(f"--digits is about CSV, {form.name} has every bit", hint="leave --digits out")
    if options.rate is not None and form.content == "knots" and options.rows in (None, "knots"):
        hint = "leave --rate out, or say --rows rate"
        raise InputError(f"--rate is about rows, {form.name} has knots", hint=hint)
    to_stream = options.output in (None, "-") and not options.no_output
    if to_stream and not form.text and sys.stdout is not None and sys.stdout.isatty():
        raise InputError(f"{form.name} is not written to a terminal", hint="name a file with -o")
    _check_outputs(options)
    return form


def _check_outputs(options: PlanCommand) -> None:
    taken: dict[tuple[object, ...], str] = {}
    for name, path in _outputs(options):
        same = identity(path)
        other = name if same is None else taken.setdefault(same, name)
        if other != name:
            raise InputError(f"{name} and {other} cannot both go to {path}", hint="name another file")


def _outputs(options: PlanCommand) -> Iterator[tuple[str, str]]:
    if not options.no_output:
        yield "the rows", options.output or "-"
    for name, path in (("--report", options.report), ("--resolved", options.resolved)):
        if path is not None:
            yield name, path


def _check_beside_job(loaded: LoadedJob, options: PlanCommand) -> None:
    """Refuse a rate of the knots alone, and to write over a file that the job was read from."""
    if options.rate is not None and loaded.job.output.rows == "knots":
        raise InputError("--rate is about rows between the knots", hint="leave it out, or say --rows both")
    refuse_overwriting(_outputs(options), files_of(loaded.document))


def _report(
    plan: Plan,
    options: PlanCommand,
    made: ForConsumer | None,
    rows: tuple[JoinedRows, Judgement] | None,
) -> None:
    from trajcli.output.delivery.delivered import report_with_rows

    rules = None if made is None else made.rules
    report = report_with_rows(plan, rows, rules, peers=options.reference)
    if options.report is not None:
        write_text(report.model_dump_json(indent=2) + "\n", options.report)
    from trajcli.job.report_parts import in_units

    compared = options.reference and plan.verdict.passed and not options.quiet
    for move in report.moves if compared else []:
        if move.reference is not None:
            text = _compared(move, move.reference)
            print_remark(f"move {move.index} ({move.planner}): {text}")
        for line in peer_lines(in_units(move, plan.loaded.units)):
            print_remark(line)


def peer_lines(move: MoveReport) -> Iterator[str]:
    """Yield how a move compares with toppra along its path, and which limits the peers break."""
    if move.path_reference is not None:
        yield f"  {_beside_toppra(move, move.path_reference)}"
        yield from violation_lines("toppra", move.path_reference.violations)
    if move.reference is not None:
        yield from violation_lines("ruckig", move.reference.violations)


def violation_lines(peer: str, violations: Sequence[PeerViolation]) -> Iterator[str]:
    """Yield the worst limit that a peer breaks, and how many more."""
    if not violations:
        return

    def beyond(one: PeerViolation) -> tuple[bool, float]:
        return one.quantity == "position", abs(one.value / one.limit - 1) if one.limit else np.inf

    worst = max(violations, key=beyond)
    more = f", and {len(violations) - 1} more" if len(violations) > 1 else ""
    reached = f"{worst.value:.9g} {worst.unit}, its limit is {worst.limit:.9g}"
    yield f"  {peer} breaks a limit: the {worst.quantity} of {worst.joint} reaches {reached}{more}"


def _compared(move: MoveReport, bound: ReferenceReport) -> str:
    if bound.duration is None:
        return f"no bound for {bound.joint}: {bound.reason}"
    if bound.ratio is None:
        speeds = [max(-peak.low, peak.high) for peak in move.peaks if peak.quantity == "velocity"]
        return "no bound: it ends where it starts" if max(speeds) > _STILL else "nothing to move"
    where = " through its points" if bound.through_points else "" if move.tool is None else " off the path"
    how = f"the fastest{where}"
    return f"{move.duration:.6g} s, {bound.ratio:.4g} x {how} under the same limits ({bound.duration:.6g} s)"


def _beside_toppra(move: MoveReport, other: PathReferenceReport) -> str:
    if other.duration is None or other.ratio is None:
        return other.reason or "nothing to move"
    uses = ", toppra ".join(
        f"{100 * use.used:.5g} % ({use.quantity} of {use.joint})" for use in (other.own_use, other.use) if use
    )
    beside = "" if move.tool is None else ", which does not know the limits of the tool"
    return (
        f"{other.ratio:.4g} x toppra along the same path ({other.duration:.6g} s{beside}); "
        f"most used of a limit: {uses}"
    )


def _summarise(plan: Plan, rows: int, *, geometry_missing: bool, details: bool) -> None:
    for number, line in enumerate(summary(plan, rows, details=details).splitlines()):
        print_remark(line, verdict=number == 0)
    if geometry_missing:
        text = "  the robot has no geometry: the log has no frames, no robot description and no tool path"
        print_remark(text)


def summary(plan: Plan, rows: int, *, details: bool = False) -> str:
    """Return the verdict in a few lines: extent, tightest limit, what was not checked, concessions.

    Args:
        plan: It verifies.
        rows: How many were written.
        details: Whether to say, too, how curves were computed.
    """
    from trajcli.planning.binding_limits import tightest_limit

    count = plan.loaded.move_count
    head = f"{plan.loaded.name}: verified, {count} move{'s' * (count != 1)}, {plan.trajectory.duration:.6g} s"
    lines = [head + (f", {rows} row{'s' * (rows != 1)}" if rows else "")]
    tightest = tightest_limit(plan)
    if tightest:
        lines.append(f"  tightest limit: {tightest}")
    if plan.flyby is not None and plan.flyby.zones:
        lines.append(f"  {_flown(plan.flyby)}")
    if plan.unchecked:
        lines.append(f"  without a limit, not checked: {plan.unchecked}")
    if plan.verdict.unchecked_of_tool:
        names = ", ".join(name.replace("_", " ") for name in plan.verdict.unchecked_of_tool)
        lines.append(f"  limited, but not checked in every move: {names} of the tool")
    if plan.verdict.sampled:
        said = "; ".join(f"{what}, {_moves(indices)}" for what, indices in plan.verdict.sampled)
        lines.append(f"  on samples only: {said}")
    if plan.verdict.steps:
        lines.append(f"  the acceleration steps{_steps(plan)}")
    lines += [
        f"  {event.kind}: {_where(plan, event.move)}{event.message}"
        for event in (*plan.events, *plan.remarks)
        if details or not event.is_internal
    ]
    return "\n".join(lines)


def _flown(flyby: FlyBy) -> str:
    count, saved = len(flyby.zones), 1 - flyby.duration / flyby.stopping
    corners = f"flies by {count} corner{'s' * (count != 1)}"
    gained = f"{100 * saved:.3g} % less than the {flyby.stopping:.6g} s of stopping there"
    bound = "" if flyby.second_order is None else f"; bound: {flyby.second_order:.6g} s (second_order)"
    return f"{corners}: {gained}{bound}"


def _steps(plan: Plan) -> str:
    """Return where the acceleration steps: the first of a few, of many the largest and their number."""
    steps = plan.verdict.steps
    if len(steps) <= _FEW_STEPS:
        more = f" and {len(steps) - 1} more" if len(steps) > 1 else ""
        return f": {steps[0].joint} at t = {steps[0].time:.6g} s{more}"
    largest = max(steps, key=lambda step: abs(step.size))
    joint = plan.trajectory.joint_names.index(largest.joint)
    size = plan.loaded.say(Amount(abs(largest.size), 2, joint))
    return f" {len(steps)} times, by up to {size} ({largest.joint} at t = {largest.time:.6g} s)"


def _moves(indices: Sequence[int]) -> str:
    more = f" and {len(indices) - 5} more" if len(indices) > 5 else ""
    return f"move{'s' * (len(indices) > 1)} {', '.join(str(index) for index in indices[:5])}{more}"


def _where(plan: Plan, move: int | None) -> str:
    return "" if move is None else f"{plan.loaded.called(move)}: "
