"""Commands about jobs, and the judge of anybody's samples.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

from typing import Annotated, Literal

from trajcli.cli.command import Command, CommandLine
from trajcli.cli.options import (
    ColumnMap,
    Consumer,
    EveryFinding,
    FieldName,
    FileUnits,
    JobErrors,
    JobFile,
    Json,
    MotionForm,
    Overrides,
    RowTimes,
    TopicName,
    argument,
    option,
    profile_words,
    robot_names,
)


class PlanCommand(CommandLine):
    """Plan a job, verify it, and write it: rows as CSV or JSON lines, a log, or a goal for a controller."""

    example = "trajcli plan examples/ur5e_pick.yaml -o rows.csv"

    job: JobFile
    others: Annotated[list[str], argument("JOB", "More jobs, which are only judged: with --no-output.")] = []
    output: Annotated[
        str | None,
        option("--output -o", "FILE.csv, .mcap, .jsonl, .npy, .npz or .yaml (a ROS message).", "FILE"),
    ] = None
    form: MotionForm = None
    report: Annotated[str | None, option("--report", "Write the verification report as JSON.", "FILE")] = None
    resolved: Annotated[
        str | None,
        option("--resolved", "Write the job as it was understood: names, units and limits.", "FILE"),
    ] = None
    rate: Annotated[str | None, option("--rate", "Rows per second.", "HZ")] = None
    rows: RowTimes = None
    override: Overrides = []
    digits: Annotated[
        Literal["fixed", "full"] | None,
        option("--digits", "fixed: nine decimals; full: every bit.", show_default="fixed"),
    ] = None
    topics: Annotated[
        str | None,
        option(
            "--topics", "MCAP: topics beside the usual ones, /joint_trajectory_point or /tool_twist.", "/A,/B"
        ),
    ] = None
    epoch: Annotated[
        str | None, option("--epoch", "MCAP: time of the log at t = 0.", "SECONDS", show_default="0")
    ] = None
    compression: Annotated[
        Literal["zstd", "lz4", "none"] | None,
        option("--compression", "MCAP: of the messages.", show_default="zstd"),
    ] = None
    strict: Annotated[
        bool, option("--strict", "Exit 1 when there is an event: a concession, or a warning of --for.")
    ] = False
    reference: Annotated[
        bool,
        option(
            "--reference",
            "Compare each move with the fastest under the same limits, along a path with toppra.",
        ),
    ] = False
    consumer: Consumer = None
    no_output: Annotated[bool, option("--no-output", "Only judge: write no rows.")] = False
    quiet: Annotated[bool, option("--quiet -q", "No summary on stderr.")] = False
    verbose: Annotated[bool, option("--verbose -v", "Also how curves were computed, in the summary.")] = False
    si: Annotated[
        bool, option("--si", "Rows in rad and m, whatever units the job has: plain column names.")
    ] = False
    every: EveryFinding = False
    errors: JobErrors = "text"


class ExplainCommand(Command):
    """Explain each move in words and formulas: polynomials, phases, peaks, branches, how fast it could be."""

    example = "trajcli explain examples/cubic.yaml"

    job: JobFile
    override: Overrides = []
    move: Annotated[int | None, option("--move", "Only this move, counted from 0.", "N")] = None
    derivatives: Annotated[
        bool, option("--derivatives", "Also the polynomials of velocity and acceleration.")
    ] = False
    sensitivity: Annotated[
        bool, option("--sensitivity", "What each limit that is 10 % higher would save: plans the moves anew.")
    ] = False
    reference: Annotated[
        bool,
        option("--reference", "Compare each move along a path with toppra, and judge what peers return."),
    ] = False
    full: Annotated[bool, option("--full", "On a terminal, too, every formula, not only what binds.")] = False
    as_json: Json = False


class PayloadCommand(Command):
    """Find the largest mass with which a job still verifies, and which joint then is at its limit, and when.

    It is the mass of what the job attaches, at its centre of mass and with its inertia; where it attaches
    nothing, of a point at the tcp. Moves that find their durations are planned anew for each mass.

    Exit codes: 0 found; 1, 2, 3 as of plan, where the job does not verify even without it.
    """

    example = "trajcli payload examples/pick_carry_place.yaml"

    job: JobFile
    override: Overrides = []
    at: Annotated[
        int | None, option("--at", "Only what is carried in this move, counted from 0.", "MOVE")
    ] = None
    as_json: Json = False


class CheckCommand(Command):
    """Judge anybody's trajectory for all t. Exit 0: satisfied or within rounding, 1: exceeded."""

    example = "trajcli check rows.csv --job examples/ur5e_pick.yaml"

    files: Annotated[
        list[str],
        argument("FILE|DIR...", "CSV, JSON lines, ROS, MCAP, .npy or .npz, and folders of such; - is stdin."),
    ]
    job: Annotated[
        str | None, option("--job", "Robot, limits, start, end and paths that it shall keep.", "JOB")
    ] = None
    override: Overrides = []
    robot: Annotated[
        str | None,
        option(
            "--robot -r",
            "Instead of a job: a robot of the catalogue, a robot file or a URDF.",
            "NAME|FILE",
            autocompletion=robot_names,
        ),
    ] = None
    limits: Annotated[
        str | None,
        option(
            "--limits",
            "Instead of the robot's: as under `limits` in a job, in a file or as {velocity: 2}.",
            "FILE|LIMITS",
        ),
    ] = None
    columns: ColumnMap = None
    rate: Annotated[str | None, option("--rate", "Rows per second of a file without time.", "HZ")] = None
    units: FileUnits = None
    topic: TopicName = None
    field: FieldName = None
    interpolate: Annotated[
        Literal["hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling"] | None,
        option(
            "--interpolate",
            "How the consumer joins the rows.",
            show_default="the highest degree that the columns allow",
        ),
    ] = None
    profile: Annotated[
        str | None,
        option(
            "--for",
            "Also the rules of a consumer: `trajcli profiles` lists them.",
            "PROFILE",
            autocompletion=profile_words,
        ),
    ] = None
    payload: Annotated[
        str | None,
        option(
            "--payload",
            "What the arm of --robot carries, {mass, com?, inertia?} or @FILE; its efforts then count.",
            "PAYLOAD",
        ),
    ] = None
    start_tolerance: Annotated[
        str | None,
        option(
            "--start-tolerance",
            "How near the first row must be to the job's start.",
            "X",
            show_default="0.001 rad or m",
        ),
    ] = None
    form: Annotated[
        Literal["table", "json", "junit", "sarif", "github"], option("--format", "Of what is printed.")
    ] = "table"
    as_json: Json = False
    reference: Annotated[
        bool, option("--reference", "Compare with ruckig between its ends, and with toppra along its points.")
    ] = False
    strict: Annotated[bool, option("--strict", "Exit 1 also within rounding, and when there are events.")] = (
        False
    )


COMMANDS: tuple[type[CommandLine], ...] = (PlanCommand, ExplainCommand, PayloadCommand, CheckCommand)
