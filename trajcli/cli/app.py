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
from trajcli.cli.options import Errors, JobFile, Json, Overrides
from trajcli.cli.outcome import guarded

_JUDGE = "trajcli plan JOB --no-output"
_OTHER_NAMES = {
    **dict.fromkeys(("validate", "check", "verify", "lint", "test"), _JUDGE),
    **dict.fromkeys(("run", "simulate", "sample", "generate", "execute", "trajectory"), "trajcli plan JOB"),
    **dict.fromkeys(("convert", "transform", "rotation", "quaternion", "euler"), "trajcli pose STEP..."),
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
        """Run the command; errors of usage are JSON where the words ask for that."""
        if not _wants_json(sys.argv[1:] if args is None else args):
            return super().main(args, *rest, **options)
        try:
            code = super().main(args, *rest, **{**options, "standalone_mode": False})
        except Exception as error:
            words = getattr(error, "format_message", None)
            if words is None:  # no error of usage
                raise
            from trajcli.cli.outcome import report_error
            from trajcli.errors import InputError

            report_error(InputError(words(), hint="see --help"), as_json=True)
            sys.exit(InputError.exit_code)
        sys.exit(code or 0)


def _wants_json(words: Sequence[str]) -> bool:
    options = list(words[: words.index("--")] if "--" in words else words)
    return "--errors=json" in options or ("--errors", "json") in pairwise(options)


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
        bool, typer.Option("--strict", help="Exit 1 when a concession (event) was made.")
    ] = False,
    reference: Annotated[
        bool,
        typer.Option(
            "--reference",
            help="Compare each move with the fastest under the same limits, along a path with toppra.",
        ),
    ] = False,
    no_output: Annotated[bool, typer.Option("--no-output", help="Only judge: write no rows.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No summary on stderr.")] = False,
    si: Annotated[
        bool, typer.Option("--si", help="Rows in rad and m, whatever units the job has: plain column names.")
    ] = False,
    every: Annotated[
        bool, typer.Option("--all", help="Every finding, not only the worst of each move and kind.")
    ] = False,
    errors: Errors = "text",
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
        no_output=no_output,
        quiet=quiet,
        every=every or errors == "json",
        si=si,
    )
    return run_plan(job, override, options)


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
    as_json: Json = False,
    errors: Errors = "text",
) -> int:
    """Say each move in words and formulas: polynomials, phases, peaks, branches, and how fast it could be."""
    from trajcli.cli.explain import ExplainOptions, run_explain

    return run_explain(job, override, ExplainOptions(move, derivatives, as_json))


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


@app.command(epilog="Example: trajcli diff old.csv new.csv --atol 1e-9")
@guarded
def diff(
    a: Annotated[str, typer.Argument(metavar="A", help="A CSV or MCAP file; - is CSV from standard input.")],
    b: Annotated[str, typer.Argument(metavar="B", help="The file to compare it with.")],
    atol: Annotated[
        str,
        typer.Option(
            "--atol", metavar="TOL", help="Absolute tolerance: 1e-9, or by column: q=1e-9,qd1=1e-6."
        ),
    ] = "",
    rtol: Annotated[
        str, typer.Option("--rtol", metavar="TOL", help="Relative tolerance, in the same form.")
    ] = "",
    resample: Annotated[
        bool, typer.Option("--resample", help="Interpolate B at the times of A when they differ.")
    ] = False,
    topic: Annotated[
        str | None,
        typer.Option(
            "--topic",
            metavar="T",
            help="MCAP: the topic, of JointState or JointTrajectory.",
            show_default="/joint_states",
        ),
    ] = None,
    errors: Errors = "text",
) -> int:
    """Compare two files column by column. Exit 0: equal, 1: different, 2: cannot be compared."""
    from trajcli.cli.diff import run_diff

    return run_diff(a, b, atol, rtol, resample=resample, topic=topic)


@app.command(epilog="Example: trajcli plot examples/ur5e_pick.yaml -o pick.svg")
@guarded
def plot(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="JOB|FILE...", help="A job, files of rows or messages, or such over a job; - is stdin."
        ),
    ],
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="FILE.svg, .png or .pdf; - is stdout. Else the first name's stem with .svg, in this folder.",
        ),
    ] = None,
    kind: Annotated[
        Literal["svg", "png", "pdf"] | None, typer.Option("--format", help="Where no name says it; else svg.")
    ] = None,
    quantities: Annotated[
        str | None,
        typer.Option(
            "--quantities",
            metavar="LIST",
            help="Some of q,qd,qdd,qddd,tool,path,phase; else those that suit the job.",
        ),
    ] = None,
    joints: Annotated[
        list[str], typer.Option("--joints", metavar="NAME...", help="Only these, as a,b or a b; else all.")
    ] = [],  # noqa: B006
    override: Overrides = [],  # noqa: B006
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not say what was written.")] = False,
    every: Annotated[
        bool, typer.Option("--all", help="Every finding, not only the worst of each move and kind.")
    ] = False,
    errors: Errors = "text",
) -> int:
    """Draw joints, tool and phase plane with limits. Exit 1: one is broken, and the picture shows where."""
    from trajcli.cli.plot import PlotOptions, run_plot

    every = every or errors == "json"
    return run_plot(files, override, PlotOptions(output, kind, quantities, tuple(joints), quiet, every))


@app.command(epilog="Example: trajcli view examples/ur5e_pick.yaml -o view.html")
@guarded
def view(
    source: Annotated[
        str,
        typer.Argument(metavar="JOB|FILE", help="A job, or a file of rows or messages; - is standard input."),
    ],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the page to FILE.html instead of stdout."),
    ] = None,
    compress: Annotated[
        bool, typer.Option("--compress", help="Half the size, for browsers since 2023.")
    ] = False,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            "-r",
            metavar="NAME|FILE|JOB",
            help="The arm of a file: of the catalogue, a robot file, a URDF, or a job.",
        ),
    ] = None,
    override: Overrides = [],  # noqa: B006
    errors: Errors = "text",
) -> int:
    """Write a page that plays the motion: the arm in 3D with linked plots, in one file for any browser."""
    from trajcli.cli.view import ViewOptions, run_view

    return run_view(source, override, ViewOptions(output, compress, robot))


@app.command(epilog="Example: trajcli schema job")
@guarded
def schema(
    kind: Annotated[
        Literal["job", "robot", "report", "explanation"],
        typer.Argument(help="Which schema.", show_default=True),
    ] = "job",
    errors: Errors = "text",
) -> int:
    """Print a JSON Schema, for completion and checking in an editor."""
    from trajcli.job.schema import schema_text
    from trajcli.streams.whole_file import standard_output

    with standard_output() as out:
        out.write(schema_text(kind).encode())
    return 0


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
