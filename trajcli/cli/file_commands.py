"""Commands about files of motions and their pictures, those who take them, and schemas.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

from typing import Annotated, Literal

from trajcli.cli.command import Command
from trajcli.cli.options import (
    EveryFinding,
    Json,
    Overrides,
    TopicName,
    argument,
    joint_names,
    option,
    profile_words,
    quantity_names,
)


class DiffCommand(Command):
    """Compare files column by column, in folders by name. Exit 0: equal, 1: different, 2: not comparable."""

    example = "trajcli diff old.csv new.csv --atol 1e-9"

    files: Annotated[
        list[str],
        argument(
            "A... B",
            "Two files, or files and folders and the folder to compare them with; - is CSV from stdin.",
        ),
    ]
    atol: Annotated[
        str, option("--atol", "Absolute tolerance: 1e-9, or by column: q=1e-9,qd1=1e-6.", "TOL")
    ] = ""
    rtol: Annotated[str, option("--rtol", "Relative tolerance, in the same form.", "TOL")] = ""
    resample: Annotated[bool, option("--resample", "Interpolate B at the times of A when they differ.")] = (
        False
    )
    topic: TopicName = None
    view: Annotated[
        str | None, option("--view", "Also write a page that plays both of two files.", "FILE")
    ] = None
    robot: Annotated[str | None, option("--robot -r", "The arm of that page.", "NAME|FILE|JOB")] = None
    as_json: Json = False


class PlotCommand(Command):
    """Draw joints, tool and phase plane with limits. Exit 1: the job or a file breaks one, as shown."""

    example = "trajcli plot examples/ur5e_pick.yaml -o pick.svg"

    files: Annotated[
        list[str],
        argument("JOB|FILE...", "A job, two, files of rows or messages, or such over a job; - is stdin."),
    ]
    output: Annotated[
        str | None,
        option(
            "--output -o",
            "FILE.svg, .png or .pdf; - is stdout. Else the stem of the first job, or file, with .svg, here.",
            "FILE",
        ),
    ] = None
    kind: Annotated[
        Literal["svg", "png", "pdf"] | None, option("--format", "Where no name says it; else svg.")
    ] = None
    quantities: Annotated[
        str | None,
        option(
            "--quantities",
            "Some of q,qd,qdd,qddd,tau,tool,path,phase; else those that suit the job.",
            "LIST",
            autocompletion=quantity_names,
        ),
    ] = None
    joints: Annotated[
        list[str],
        option("--joints", "Only these, as a,b or a b; else all.", "NAME...", autocompletion=joint_names),
    ] = []
    override: Overrides = []
    quiet: Annotated[bool, option("--quiet -q", "Do not say what was written.")] = False
    every: EveryFinding = False


class ViewCommand(Command):
    """Write a page that plays a motion, or two, in any browser: 3D, plots, findings. Exit 1: findings."""

    example = "trajcli view examples/ur5e_pick.yaml -o view.html"

    sources: Annotated[
        list[str],
        argument(
            "JOB|FILE...",
            "A job, or a file of rows or messages, - from standard input; a second to compare it with.",
        ),
    ]
    output: Annotated[
        str | None, option("--output -o", "Write the page to FILE.html instead of stdout.", "FILE")
    ] = None
    compress: Annotated[bool, option("--compress", "Half the size, for browsers since 2023.")] = False
    robot: Annotated[
        str | None,
        option(
            "--robot -r",
            "The arm of a file: of the catalogue, a robot file, a URDF, or a job.",
            "NAME|FILE|JOB",
        ),
    ] = None
    meshes: Annotated[
        float,
        option(
            "--meshes",
            "Of a URDF: how long its visual meshes may be, simplified to that; with 0 none are drawn.",
            "MB",
            min=0,
        ),
    ] = 0.5
    override: Overrides = []
    every: EveryFinding = False


class ProfilesCommand(Command):
    """List the consumers whose rules are known, or the rules of one, with their sources."""

    example = "trajcli profiles ros-jtc"

    name: Annotated[
        str | None, argument("NAME", "One consumer; without it all are listed.", autocompletion=profile_words)
    ] = None
    as_json: Json = False


class SchemaCommand(Command):
    """Print a JSON Schema: editors read it where `# yaml-language-server: $schema=FILE` heads a job."""

    example = "trajcli schema job"

    kind: Annotated[
        Literal["job", "robot", "report", "explanation"], argument(None, "Which schema.", show_default=True)
    ] = "job"


class InitCommand(Command):
    """Write a commented starter job that plans as it stands."""

    example = "trajcli init job.yaml"

    file: Annotated[str, argument("FILE", "The file to write; - is stdout.")] = "job.yaml"
    force: Annotated[bool, option("--force", "Overwrite the file if it exists.")] = False


COMMANDS = (DiffCommand, PlotCommand, ViewCommand, ProfilesCommand, SchemaCommand, InitCommand)
