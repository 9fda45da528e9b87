"""Commands about many jobs, and tools that make one motion of another.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

from typing import Annotated, Literal

from trajcli.cli.command import Command, CommandLine
from trajcli.cli.options import (
    ColumnMap,
    Consumer,
    FieldName,
    FileUnits,
    JobErrors,
    JobFile,
    MotionForm,
    RowTimes,
    TopicName,
    argument,
    option,
    robot_names,
    setting_paths,
)

MotionSource = Annotated[
    str, argument("FILE", "CSV, MCAP, ROS messages, JSON lines, .npy, .npz; - is stdin.")
]
MotionOutput = Annotated[
    str | None, option("--output -o", "OUT.csv, .mcap, .jsonl or .yaml; else CSV to stdout.", "OUT")
]
Quiet = Annotated[bool, option("--quiet -q", "Nothing on stderr but errors.")]
Count = Annotated[str | None, option("-j", "Processes at a time; else one a core.", "N")]
Timeout = Annotated[
    str | None, option("--timeout", "For each job; 0 for no end.", "SECONDS", show_default="600")
]
Scheduler = Annotated[
    str | None,
    option(
        "--scheduler",
        "Of the cluster, such as tcp://10.0.0.5:8786; else that of Dask's configuration.",
        "ADDRESS",
    ),
]


class EditCommand(Command):
    """A tool that reads a motion and writes one."""

    module = "edit"

    output: MotionOutput = None
    form: MotionForm = None
    columns: ColumnMap = None
    units: FileUnits = None
    topic: TopicName = None
    field: FieldName = None
    quiet: Quiet = False


class BatchCommand(CommandLine):
    """Plan many jobs, and write each; unchanged ones are skipped. Prints a line of JSON for each job.

    On a terminal a line for people takes its place, and why jobs failed stands at the end.
    """

    example = "trajcli batch examples/cubic.yaml examples/quintic.yaml -o rows"

    jobs: Annotated[list[str], argument("JOB|DIR...", "Job files, and folders with job files.")]
    output: Annotated[
        str | None, option("--output -o", "Where the rows go; else beside each job, under its name.", "DIR")
    ] = None
    count: Count = None
    form: Annotated[
        Literal["csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal"], option("--format", "Of the rows.")
    ] = "csv"
    rows: RowTimes = None
    consumer: Consumer = None
    force: Annotated[bool, option("--force", "Plan unchanged jobs, too.")] = False
    timeout: Timeout = None
    engine: Annotated[
        Literal["processes", "dask"],
        option("--engine", "Processes of this machine, or the workers of a Dask cluster."),
    ] = "processes"
    scheduler: Scheduler = None
    quiet: Annotated[bool, option("--quiet -q", "No summary on stderr.")] = False
    strict: Annotated[
        bool, option("--strict", "A job with an event fails: a concession, or a warning of --for.")
    ] = False
    errors: JobErrors = "text"


class SweepCommand(Command):
    """Plan one job over a grid of values: a row each with verdict, duration, what binds, and a bound.

    Points that an earlier sweep into the same table has planned are not planned again.
    """

    example = "trajcli sweep examples/quintic.yaml --vary moves.0.duration=1..3:3"

    job: JobFile
    vary: Annotated[
        list[str],
        option(
            "--vary",
            "A path as for --set, and its values: A..B:N, both ends included, or v1,v2,...",
            "PATH=VALUES",
            autocompletion=setting_paths,
        ),
    ]
    samples: Annotated[
        str | None, option("--samples", "So many of the combinations, drawn evenly by chance.", "N")
    ] = None
    seed: Annotated[str | None, option("--seed", "Of that chance.", "S", show_default="0")] = None
    count: Count = None
    engine: Annotated[
        Literal["process", "dask"],
        option("--engine", "Processes of this machine, or the workers of a Dask cluster."),
    ] = "process"
    scheduler: Scheduler = None
    timeout: Timeout = None
    output: Annotated[
        str | None, option("--output -o", "FILE.csv or .jsonl; else CSV to stdout.", "FILE")
    ] = None
    plot: Annotated[
        str | None, option("--plot", "FILE.svg, .png or .pdf: the durations, of two --vary as a map.", "FILE")
    ] = None
    best: Annotated[
        str | None,
        option(
            "--best",
            "Say the verified row with the smallest number in a column; with -COLUMN the largest.",
            "COLUMN",
        ),
    ] = None
    strict: Annotated[bool, option("--strict", "Exit 1 when a row is not verified.")] = False
    force: Annotated[bool, option("--force", "Plan points that are known, too.")] = False
    quiet: Annotated[bool, option("--quiet -q", "No summary on stderr.")] = False


class RetimeCommand(EditCommand):
    """Stretch a motion by the smallest factor that keeps the limits, and say the factor, joint and limit."""

    example = "trajcli retime rows.csv --job examples/ur5e_pick.yaml -o slower.csv"

    file: MotionSource
    job: Annotated[str | None, option("--job", "The job whose limits are kept.", "JOB")] = None
    robot: Annotated[
        str | None,
        option("--robot -r", "The arm whose limits are kept.", "NAME|FILE", autocompletion=robot_names),
    ] = None
    fastest: Annotated[
        bool, option("--fastest", "Also faster: over the shortest time that keeps the limits.")
    ] = False
    per_move: Annotated[bool, option("--per-move", "A factor for each move, by the column `move`.")] = False


class ResampleCommand(EditCommand):
    """Write a motion at rows of another rate, on the curve through its rows."""

    example = "trajcli resample rows.csv --rate 500 -o coarse.csv"

    file: MotionSource
    rate: Annotated[str, option("--rate", "Rows per second.", "HZ")]


class ConcatCommand(EditCommand):
    """Join motions one after the other, in the columns and units of the first; their states must agree."""

    example = "trajcli concat there.csv back.csv -o both.csv"

    files: Annotated[list[str], argument("FILE...", "Motions, each of which begins where the last ends.")]


class ReverseCommand(EditCommand):
    """Write a motion that goes back over the same time."""

    example = "trajcli reverse rows.csv -o back.csv"

    file: MotionSource


class SliceCommand(EditCommand):
    """Write the part of a motion between two times, with a row at each of them."""

    example = "trajcli slice rows.csv --from 0.25 --to 0.75 -o part.csv"

    file: MotionSource
    first: Annotated[str | None, option("--from", "Time of the file, s; else its start.", "T")] = None
    last: Annotated[str | None, option("--to", "Time of the file, s; else its end.", "T")] = None


class ConvertCommand(EditCommand):
    """Write a motion in another format."""

    example = "trajcli convert rows.csv -o rows.mcap"

    file: MotionSource
    robot: Annotated[
        str | None,
        option(
            "--robot -r",
            "Whose joints they are: their order, their names in messages and logs, their units.",
            "NAME|FILE",
            autocompletion=robot_names,
        ),
    ] = None
    si: Annotated[bool, option("--si", "Of a CSV too: columns t, q1, q2, ... in rad and m.")] = False


COMMANDS: tuple[type[CommandLine], ...] = (
    BatchCommand,
    SweepCommand,
    RetimeCommand,
    ResampleCommand,
    ConcatCommand,
    ReverseCommand,
    SliceCommand,
    ConvertCommand,
)
