"""Commands about jobs and sample streams, and the application that holds all commands.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, get_type_hints

import typer
import typer.core

from trajcli.cli.arm_commands import register
from trajcli.cli.file_commands import register_file_commands
from trajcli.cli.motion_commands import register_tools
from trajcli.cli.options import Errors, JobErrors, JobFile, Json, Overrides, profile_words, robot_names
from trajcli.cli.outcome import guarded

_JUDGE = "trajcli plan JOB --no-output"
_OTHER_NAMES = {
    **dict.fromkeys(("validate", "verify", "lint", "test"), _JUDGE),
    **dict.fromkeys(("run", "simulate", "sample", "generate", "execute", "trajectory"), "trajcli plan JOB"),
    **dict.fromkeys(("transform", "rotation", "quaternion", "euler"), "trajcli pose STEP..."),
    **dict.fromkeys(("forward", "forward-kinematics"), "trajcli fk"),
    **dict.fromkeys(("inverse", "inverse-kinematics", "solve"), "trajcli ik"),
    "kinematics": "trajcli fk, trajcli ik or trajcli jacobian",
    **dict.fromkeys(("list", "ls", "robot", "catalogue", "catalog"), "trajcli robots"),
    **dict.fromkeys(("compare", "cmp"), "trajcli diff A B"),
    **dict.fromkeys(("new", "create", "start", "example"), "trajcli init"),
    **dict.fromkeys(("show", "describe", "info"), "trajcli explain JOB"),
    **dict.fromkeys(("draw", "graph", "picture", "chart"), "trajcli plot JOB"),
    **dict.fromkeys(("player", "animate", "animation", "html"), "trajcli view JOB -o view.html"),
    "report": "trajcli plan JOB --report FILE",
    "help": "trajcli --help",
    "version": "trajcli --version",
}  # fmt: skip


class Commands(typer.core.TyperGroup):
    """The commands, which know by what other names people call them."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command of the first word, its name, and the words behind it."""
        known = _OTHER_NAMES.get(args[0].lower())
        if args[0] not in self.commands and known is not None:
            ctx.fail(f"No such command '{args[0]}': here it is `{known}`.")
        return super().resolve_command(ctx, args)

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:  # noqa: ANN401
        """Run the command; errors of usage have the form that the words ask for."""
        form = _form_of_errors(sys.argv[1:] if args is None else args)
        if form is None:
            return super().main(args, *rest, **options)
        try:
            code = super().main(args, *rest, **{**options, "standalone_mode": False})
        except Exception as error:
            words = getattr(error, "format_message", None)
            if words is None:  # no error of usage
                raise
            from trajcli.cli.outcome import report_error
            from trajcli.errors import InputError

            report_error(InputError(words(), hint="see --help"), form)
            sys.exit(InputError.exit_code)
        sys.exit(code or 0)


def _form_of_errors(words: Sequence[str]) -> Any:  # noqa: ANN401
    """Return in which form for programs errors are wanted; None where they are for people."""
    options = list(words[: words.index("--")] if "--" in words else words)
    forms = ("json", "github", "junit", "sarif")
    asked = (
        form for form in forms if f"--errors={form}" in options or ("--errors", form) in pairwise(options)
    )
    return next(asked, None)


app = typer.Typer(
    name="trajcli",
    cls=Commands,
    help="Trajectory planning for serial robots: a YAML job in, a verified sample stream out. "
    "`trajcli --version` prints the version.",
    epilog="Example: trajcli init job.yaml && trajcli plan job.yaml\n\n"
    "Exit codes: 0 done and verified, 1 judged and found wrong, 2 wrong input, 3 no curve exists, "
    "4 file trouble, 70 a bug in trajcli.",
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def commands() -> None:
    """Let typer ask for a command's name also where `run` leaves only one."""


@app.command(epilog="Example: trajcli plan examples/ur5e_pick.yaml -o rows.csv")
@guarded
def plan(
    job: JobFile,
    others: Annotated[
        list[str], typer.Argument(metavar="JOB", help="More jobs, which are only judged: with --no-output.")
    ] = [],  # noqa: B006
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="FILE.csv, .mcap, .jsonl or .yaml (a ROS message).",
        ),
    ] = None,
    form: Annotated[
        Literal["csv", "mcap", "jsonl", "ros", "ros-goal"] | None,
        typer.Option("--format", help="Of stdout, and which message a .yaml holds.", show_default="csv"),
    ] = None,
    report: Annotated[
        str | None, typer.Option("--report", metavar="FILE", help="Write the verification report as JSON.")
    ] = None,
    resolved: Annotated[
        str | None,
        typer.Option(
            "--resolved", metavar="FILE", help="Write the job as it was understood: names, units and limits."
        ),
    ] = None,
    rate: Annotated[str | None, typer.Option("--rate", metavar="HZ", help="Rows per second.")] = None,
    override: Overrides = [],  # noqa: B006
    digits: Annotated[
        Literal["fixed", "full"] | None,
        typer.Option("--digits", help="fixed: nine decimals; full: every bit.", show_default="fixed"),
    ] = None,
    topics: Annotated[
        str | None,
        typer.Option(
            "--topics",
            metavar="/A,/B",
            help="MCAP: topics beside the usual ones, /joint_trajectory_point or /tool_twist.",
        ),
    ] = None,
    epoch: Annotated[
        str | None,
        typer.Option("--epoch", metavar="SECONDS", help="MCAP: time of the log at t = 0.", show_default="0"),
    ] = None,
    compression: Annotated[
        Literal["zstd", "lz4", "none"] | None,
        typer.Option("--compression", help="MCAP: of the messages.", show_default="zstd"),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Exit 1 when there is an event: a concession, or a warning of --for."),
    ] = False,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference",
            help="Compare each move with the fastest under the same limits, along a path with toppra.",
        ),
    ] = False,
    consumer: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="PROFILE",
            help="Judge the rows as written by the rules of a consumer, such as ros-jtc: `trajcli profiles`.",
            autocompletion=profile_words,
        ),
    ] = None,
    no_output: Annotated[bool, typer.Option("--no-output", help="Only judge: write no rows.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No summary on stderr.")] = False,
    si: Annotated[
        bool, typer.Option("--si", help="Rows in rad and m, whatever units the job has: plain column names.")
    ] = False,
    every: Annotated[
        bool, typer.Option("--all", help="Every finding, not only the worst of each move and kind.")
    ] = False,
    errors: JobErrors = "text",
) -> int:
    """Plan a job, verify it, and write it: rows as CSV or JSON lines, a log, or a goal for a controller."""
    from trajcli.cli.plan import PlanOptions, run_plan

    log = None
    if topics is not None or epoch is not None or compression is not None:
        from trajcli.output.recording import LogOptions

        log = LogOptions(topics, epoch, compression)
    options = PlanOptions(
        rate=rate,
        output=output,
        report=report,
        resolved=resolved,
        form=form,
        digits=digits,
        log=log,
        strict=strict,
        reference=reference,
        consumer=consumer,
        no_output=no_output,
        quiet=quiet,
        every=every or errors != "text",
        si=si,
    )
    if not others and errors in ("text", "json"):
        return run_plan(job, override, options)
    from trajcli.cli.gate import run_gate

    return run_gate([job, *others], override, options, errors)


@app.command(epilog="Example: trajcli explain examples/cubic.yaml")
@guarded
def explain(
    job: JobFile,
    override: Overrides = [],  # noqa: B006
    move: Annotated[
        int | None, typer.Option("--move", metavar="N", help="Only this move, counted from 0.")
    ] = None,
    derivatives: Annotated[
        bool, typer.Option("--derivatives", help="Also the polynomials of velocity and acceleration.")
    ] = False,
    sensitivity: Annotated[
        bool,
        typer.Option(
            "--sensitivity", help="What each limit that is 10 % higher would save: plans the moves anew."
        ),
    ] = False,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference", help="Compare each move along a path with toppra, and judge what peers return."
        ),
    ] = False,
    as_json: Json = False,
    errors: Errors = "text",
) -> int:
    """Say each move in words and formulas: polynomials, phases, peaks, branches, and how fast it could be."""
    from trajcli.cli.explain import ExplainOptions, run_explain

    return run_explain(job, override, ExplainOptions(move, derivatives, sensitivity, reference, as_json))


@app.command(epilog="Example: trajcli payload examples/pick_carry_place.yaml")
@guarded
def payload(
    job: JobFile,
    override: Overrides = [],  # noqa: B006
    at: Annotated[
        int | None,
        typer.Option("--at", metavar="MOVE", help="Only what is carried in this move, counted from 0."),
    ] = None,
    as_json: Json = False,
    errors: Errors = "text",
) -> int:
    """Find the largest mass with which a job still verifies, and which joint then is at its limit, and when.

    It is the mass of what the job attaches, at its centre of mass and with its inertia; where it attaches
    nothing, of a point at the tcp. Moves that find their durations are planned anew for each mass.

    Exit codes: 0 found; 1, 2, 3 as of plan, where the job does not verify even without it.
    """
    from trajcli.cli.payload import run_payload

    return run_payload(job, override, at, as_json=as_json)


@app.command(epilog="Example: trajcli check rows.csv --job examples/ur5e_pick.yaml")
@guarded
def check(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A CSV, JSON lines, ROS, MCAP or .npy file; - is stdin.")
    ],
    job: Annotated[
        str | None,
        typer.Option("--job", metavar="JOB", help="Robot, limits, start, end and paths that it shall keep."),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            "-r",
            metavar="NAME|FILE",
            help="Instead of a job: a robot of the catalogue, a robot file or a URDF.",
            autocompletion=robot_names,
        ),
    ] = None,
    limits: Annotated[
        str | None,
        typer.Option(
            "--limits",
            metavar="FILE",
            help="Of the joints and the tool instead of the robot's: as under `limits` in a job.",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            "--columns",
            metavar="MAP",
            help="What columns are, such as t=timestamp,q=target_q: prefixes or names.",
        ),
    ] = None,
    units: Annotated[
        str | None, typer.Option("--units", metavar="UNITS", help="Of columns that name none, as deg,mm.")
    ] = None,
    topic: Annotated[
        str | None,
        typer.Option("--topic", metavar="T", help="MCAP: the topic.", show_default="/joint_states"),
    ] = None,
    field: Annotated[
        str | None,
        typer.Option("--field", metavar="F", help="Of messages with several states, such as reference."),
    ] = None,
    interpolate: Annotated[
        Literal["hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling"] | None,
        typer.Option(
            "--interpolate",
            help="How the consumer joins the rows.",
            show_default="the highest degree that the columns allow",
        ),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="PROFILE",
            help="Also the rules of a consumer: `trajcli profiles` lists them.",
            autocompletion=profile_words,
        ),
    ] = None,
    carried: Annotated[
        str | None,
        typer.Option(
            "--payload",
            metavar="PAYLOAD",
            help="What the arm of --robot carries, {mass, com?, inertia?} or @FILE; its efforts then count.",
        ),
    ] = None,
    start_tolerance: Annotated[
        str | None,
        typer.Option(
            "--start-tolerance",
            metavar="X",
            help="How near the first row must be to the job's start.",
            show_default="0.001 rad or m",
        ),
    ] = None,
    form: Annotated[
        Literal["table", "json", "junit", "sarif", "github"],
        typer.Option("--format", help="Of what is printed."),
    ] = "table",
    reference: Annotated[
        bool,
        typer.Option(
            "--reference", help="Compare with ruckig between its ends, and with toppra along its points."
        ),
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit 1 also within rounding, and when there are events.")
    ] = False,
    errors: Errors = "text",
) -> int:
    """Judge anybody's trajectory for all t. Exit 0: satisfied or within rounding, 1: exceeded."""
    from trajcli.cli.check import run_check
    from trajcli.judge.file import CheckOptions

    options = CheckOptions(
        job=job,
        robot=robot,
        limits=limits,
        columns=columns,
        units=units,
        topic=topic,
        field=field,
        interpolate=interpolate,
        profile=profile,
        start_tolerance=start_tolerance,
        payload=carried,
    )
    return run_check(file, options, form, strict=strict, reference=reference)


register_file_commands(app)


@app.command(epilog="Example: trajcli init job.yaml")
@guarded
def init(
    file: Annotated[str, typer.Argument(metavar="FILE", help="The file to write; - is stdout.")] = "job.yaml",
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it exists.")] = False,
    errors: Errors = "text",
) -> int:
    """Write a commented starter job that plans as it stands."""
    from trajcli.cli.init import run_init

    return run_init(file, force=force)


register(app)
register_tools(app)


def run() -> None:
    """Run the command that the command line names; where it names none, print help."""
    # Typer makes every command it knows, and evaluates each annotation four times: more work than a plan.
    known = {info.callback.__name__: info for info in app.registered_commands if info.callback}
    wanted = [known[word] for word in sys.argv[1:2] if word in known] or [*known.values()]
    for info in wanted:
        if info.callback:
            info.callback.__annotations__.update(get_type_hints(info.callback, include_extras=True))
    app.registered_commands = wanted
    app()
