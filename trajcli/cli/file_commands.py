"""Commands about files of motions and their pictures, those who take them, and schemas.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from trajcli.cli.options import Errors, Json, Overrides, profile_words
from trajcli.cli.outcome import guarded


def register_file_commands(app: typer.Typer) -> None:
    """Add the commands diff, plot, view, profiles and schema."""
    app.command(epilog="Example: trajcli diff old.csv new.csv --atol 1e-9")(diff)
    app.command(epilog="Example: trajcli plot examples/ur5e_pick.yaml -o pick.svg")(plot)
    app.command(epilog="Example: trajcli view examples/ur5e_pick.yaml -o view.html")(view)
    app.command(epilog="Example: trajcli profiles ros-jtc")(profiles)
    app.command(epilog="Example: trajcli schema job")(schema)


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
            help="Some of q,qd,qdd,qddd,tau,tool,path,phase; else those that suit the job.",
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
    """Draw joints, tool and phase plane with limits. Exit 1: the job or a file breaks one, as shown."""
    from trajcli.cli.plot import PlotOptions, run_plot

    every = every or errors == "json"
    return run_plot(files, override, PlotOptions(output, kind, quantities, tuple(joints), quiet, every))


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
    """Write a page that plays the motion in any browser: 3D, plots, findings. Exit 1: there are findings."""
    from trajcli.cli.view import ViewOptions, run_view

    return run_view(source, override, ViewOptions(output, compress, robot))


@guarded
def profiles(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="One consumer; without it all are listed.", autocompletion=profile_words
        ),
    ] = None,
    as_json: Json = False,
    errors: Errors = "text",
) -> int:
    """List the consumers whose rules are known, or the rules of one, with their sources."""
    from trajcli.cli.profiles import run_profiles

    return run_profiles(name, as_json=as_json)


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
