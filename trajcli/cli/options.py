"""Arguments and options that several commands share. Only typer is imported here."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import typer


def option(names: str, text: str, metavar: str | None = None, **more: Any) -> Any:  # noqa: ANN401
    """Return an option: its names, as "--output -o", its help, and what stands there for its value."""
    return typer.Option(*names.split(), help=text, metavar=metavar, **more)


def argument(metavar: str | None, text: str, **more: Any) -> Any:  # noqa: ANN401
    """Return an argument: what stands for it in usage, and its help."""
    return typer.Argument(help=text, metavar=metavar, **more)


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


JobFile = Annotated[str, argument("JOB", "The job file; - is standard input.")]
Overrides = Annotated[
    list[str],
    option(
        "--set",
        "Override a value of the job, such as moves.0.duration=3.",
        "PATH=VALUE",
        autocompletion=setting_paths,
    ),
]
Consumer = Annotated[
    str | None,
    option(
        "--for",
        "Plan for a consumer, such as ros-jtc, and judge the rows by its rules: `trajcli profiles`.",
        "PROFILE",
        autocompletion=profile_words,
    ),
]
RowTimes = Annotated[
    Literal["rate", "knots", "both"] | None,
    option(
        "--rows",
        "Rows at the times of the rate, at the knots of the curve, or at both.",
        show_default="rate; of ROS messages knots",
    ),
]
Errors = Annotated[Literal["text", "json"], option("--errors", "How errors are written to stderr.")]
JobErrors = Annotated[
    Literal["text", "json", "github", "junit", "sarif"],
    option(
        "--errors",
        "How errors are written to stderr: for people, for programs, or for continuous integration.",
    ),
]
RobotName = Annotated[
    str,
    option(
        "--robot -r",
        "A robot of the catalogue, a robot file, a URDF, or a job: its robot, base and tool.",
        "NAME|FILE",
        autocompletion=robot_names,
    ),
]
Tool = Annotated[
    str | None,
    option("--tool", "T_flange_tcp as YAML or @FILE, instead of the robot's own or the job's.", "POSE"),
]
Base = Annotated[
    str | None,
    option("--base", "T_world_base as YAML or @FILE, instead of the robot's own or the job's.", "POSE"),
]
ArmUnits = Annotated[
    str | None, option("--units", "Of numbers, such as deg,mm; else those of the robot's file.", "UNITS")
]
Si = Annotated[bool, option("--si", "Numbers in rad and m, whatever units the robot's file has.")]
Json = Annotated[bool, option("--json", "Print JSON for programs.")]
EveryFinding = Annotated[bool, option("--all", "Every finding, not only the worst of each move and kind.")]
Joints = Annotated[
    list[str], argument("Q...", "A value for each joint, in the units of the robot's file; - reads a CSV.")
]
DigitsOption = Annotated[
    Literal["fixed", "full"], option("--digits", "Of a CSV. fixed: nine decimals; full: every bit.")
]
MotionForm = Annotated[
    Literal["csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal"] | None,
    option("--format", "Of stdout, and which message a .yaml holds.", show_default="csv"),
]
ColumnMap = Annotated[
    str | None, option("--columns", "What columns are: t=timestamp,q=target_q,qd=target_qd.", "MAP")
]
FileUnits = Annotated[str | None, option("--units", "Of columns that name none, such as deg,mm.", "UNITS")]
TopicName = Annotated[str | None, option("--topic", "MCAP: the topic.", "T", show_default="/joint_states")]
FieldName = Annotated[str | None, option("--field", "Of messages with several states: the one meant.", "F")]
