"""Commands about jobs and sample streams, and the application that holds all commands.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import sys
from typing import Annotated, Literal, get_type_hints

import typer

from trajcli.cli.arm_commands import register
from trajcli.cli.options import Errors, JobFile, Json, Overrides
from trajcli.cli.outcome import guarded

app = typer.Typer(
    name="trajcli",
    help="Trajectory planning for serial robots: a YAML job in, a verified sample stream out. "
    "`trajcli --version` prints the version.",
    epilog="Exit codes: 0 done and verified, 1 judged and found wrong, 2 wrong input, 3 no curve exists, "
    "4 file trouble, 70 a bug in trajcli.",
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def commands() -> None:
    """Let typer ask for a command's name also where `run` leaves only one."""


@app.command()
@guarded
def plan(
    job: JobFile,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write rows to FILE.csv instead of stdout."),
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
        Literal["fixed", "full"], typer.Option("--digits", help="fixed: nine decimals; full: every bit.")
    ] = "fixed",
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit 1 when a concession (event) was made.")
    ] = False,
    reference: Annotated[
        bool, typer.Option("--reference", help="Compare each move with the fastest under the same limits.")
    ] = False,
    no_output: Annotated[bool, typer.Option("--no-output", help="Only judge: write no rows.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No summary on stderr.")] = False,
    errors: Errors = "text",
) -> int:
    """Plan a job, verify it, and write its samples as CSV."""
    from trajcli.cli.plan import PlanOptions, run_plan

    options = PlanOptions(rate, output, report, resolved, digits, strict, reference, no_output, quiet)
    return run_plan(job, override, options)


@app.command()
@guarded
def explain(
    job: JobFile,
    override: Overrides = [],  # noqa: B006
    as_json: Json = False,
    errors: Errors = "text",
) -> int:
    """Say each move in words and formulas: polynomials, phases, peaks, branches, and how fast it could be."""
    from trajcli.cli.explain import run_explain

    return run_explain(job, override, as_json=as_json)


@app.command()
@guarded
def diff(
    a: Annotated[str, typer.Argument(metavar="A", help="A CSV file; - is standard input.")],
    b: Annotated[str, typer.Argument(metavar="B", help="The CSV file to compare it with.")],
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
    errors: Errors = "text",
) -> int:
    """Compare two CSV files column by column. Exit 0: equal, 1: different, 2: cannot be compared."""
    from trajcli.cli.diff import run_diff

    return run_diff(a, b, atol, rtol, resample=resample)


@app.command()
@guarded
def schema(
    kind: Annotated[
        Literal["job", "robot", "report"], typer.Argument(help="Which schema.", show_default=True)
    ] = "job",
    errors: Errors = "text",
) -> int:
    """Print a JSON Schema, for completion and checking in an editor."""
    from trajcli.job.schema import schema_text
    from trajcli.streams.whole_file import standard_output

    with standard_output() as out:
        out.write(schema_text(kind).encode())
    return 0


@app.command()
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
