"""Arguments and options that several commands share. Only typer is imported here."""

from __future__ import annotations

from typing import Annotated, Literal

import typer


def robot_names(incomplete: str) -> list[str]:
    """Return the names of the catalogue that begin so, for the shell; no robot is read for that."""
    from trajcli.catalogue.entries import catalogue_names

    return [name for name in catalogue_names() if name.startswith(incomplete)]


def profile_words(incomplete: str) -> list[str]:
    """Return the names of consumers' profiles that begin so, for the shell; none is read for that."""
    from pathlib import Path

    folder = Path(__file__).parent.parent / "profiles"
    return sorted(path.stem for path in folder.glob("*.yaml") if path.stem.startswith(incomplete))


def setting_paths(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the paths for `--set` that begin so, for the shell."""
    from trajcli.cli.completion import paths_that_begin

    return paths_that_begin(ctx, incomplete)


def joint_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the names of the job's joints that begin so, for the shell."""
    from trajcli.cli.completion import joints_that_begin

    return joints_that_begin(ctx, incomplete)


def quantity_names(incomplete: str) -> list[str]:
    """Return the quantities of pictures that begin so, for the shell."""
    from trajcli.cli.completion import quantities_that_begin

    return quantities_that_begin(incomplete)


JobFile = Annotated[str, typer.Argument(metavar="JOB", help="The job file; - is standard input.")]
Overrides = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        help="Override a value of the job, such as moves.0.duration=3.",
        autocompletion=setting_paths,
    ),
]
Consumer = Annotated[
    str | None,
    typer.Option(
        "--for",
        metavar="PROFILE",
        help="Plan for a consumer, such as ros-jtc, and judge the rows by its rules: `trajcli profiles`.",
        autocompletion=profile_words,
    ),
]
RowTimes = Annotated[
    Literal["rate", "knots", "both"] | None,
    typer.Option(
        "--rows",
        help="Rows at the times of the rate, at the knots of the curve, or at both.",
        show_default="rate; of ROS messages knots",
    ),
]
Errors = Annotated[
    Literal["text", "json"], typer.Option("--errors", help="How errors are written to stderr.")
]
JobErrors = Annotated[
    Literal["text", "json", "github", "junit", "sarif"],
    typer.Option(
        "--errors",
        help="How errors are written to stderr: for people, for programs, or for continuous integration.",
    ),
]
RobotName = Annotated[
    str,
    typer.Option(
        "--robot",
        "-r",
        metavar="NAME|FILE",
        help="A robot of the catalogue, a robot file, a URDF, or a job: its robot, base and tool.",
        autocompletion=robot_names,
    ),
]
Tool = Annotated[
    str | None,
    typer.Option(
        "--tool",
        metavar="POSE",
        help="T_flange_tcp as YAML or @FILE, instead of the robot's own or the job's.",
    ),
]
Base = Annotated[
    str | None,
    typer.Option(
        "--base",
        metavar="POSE",
        help="T_world_base as YAML or @FILE, instead of the robot's own or the job's.",
    ),
]
ArmUnits = Annotated[
    str | None,
    typer.Option(
        "--units", metavar="UNITS", help="Of numbers, such as deg,mm; else those of the robot's file."
    ),
]
Si = Annotated[bool, typer.Option("--si", help="Numbers in rad and m, whatever units the robot's file has.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
Joints = Annotated[
    list[str],
    typer.Argument(
        metavar="Q...", help="A value for each joint, in the units of the robot's file; - reads a CSV."
    ),
]
DigitsOption = Annotated[
    Literal["fixed", "full"],
    typer.Option("--digits", help="Of a CSV. fixed: nine decimals; full: every bit."),
]
MotionForm = Annotated[
    Literal["csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal"] | None,
    typer.Option("--format", help="Of stdout, and which message a .yaml holds.", show_default="csv"),
]
ColumnMap = Annotated[
    str | None,
    typer.Option("--columns", metavar="MAP", help="What columns are: t=timestamp,q=target_q,qd=target_qd."),
]
FileUnits = Annotated[
    str | None, typer.Option("--units", metavar="UNITS", help="Of columns that name none, such as deg,mm.")
]
TopicName = Annotated[
    str | None, typer.Option("--topic", metavar="T", help="MCAP: the topic.", show_default="/joint_states")
]
FieldName = Annotated[
    str | None, typer.Option("--field", metavar="F", help="Of messages with several states: the one meant.")
]
