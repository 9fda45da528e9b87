"""Commands about arms and poses, whose words may be numbers: negative ones are no options.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Literal

import typer

from trajcli.cli.command import Command, Words
from trajcli.cli.options import (
    ArmUnits,
    Base,
    DigitsOption,
    Joints,
    Json,
    RobotName,
    Si,
    Tool,
    argument,
    option,
    robot_names,
)

_NUMBER_LIKE = re.compile(r"[-+]?(?:\.?[0-9][^=]*|\.?nan|\.?inf(?:inity)?)", re.IGNORECASE)
JOINED = ("--qd", "--qdd", "--near", "--point", "--s")
"""Options that take all the numbers behind them."""
ROBOT_FILES = (".yaml", ".yml", ".urdf")


class NumbersParser(Words):
    """Takes `--qd 1 -2 3` as one option and `-90` as a number, with or without `--` before it."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Return what is left of the words when options are taken away."""
        takes: dict[str, int] = {}
        for parameter in self.get_params(ctx):
            if getattr(parameter, "is_flag", None) is not None:  # an option
                count = 0 if parameter.is_flag else parameter.nargs  # type: ignore[attr-defined]
                takes |= dict.fromkeys(parameter.opts, count)
        words = sorted_words(joined(args), takes)
        self._refuse_robot_as_argument(ctx, words)
        return super().parse_args(ctx, words)

    def _refuse_robot_as_argument(self, ctx: typer.Context, words: list[str]) -> None:
        """Say where the robot stands, where it is the first argument of a command that takes an option."""
        if "--" not in words:
            return
        options, first = words[: words.index("--")], words[words.index("--") + 1 :][:1]
        takes_robot = any("--robot" in each.opts for each in self.get_params(ctx))
        given = any(each in ("--robot", "-r") or each.startswith(("--robot=", "-r")) for each in options)
        a_robot = bool(first) and (first[0].endswith(ROBOT_FILES) or first[0] in robot_names(""))
        if takes_robot and a_robot and not given:
            ctx.fail(f"The robot is an option: trajcli {ctx.info_name} --robot {first[0]} ...")


def joined(args: list[str]) -> list[str]:
    """Return the words with the numbers behind each of `JOINED` put into one word, separated by commas.

    A word that has commas itself holds all the numbers.
    """
    words: list[str] = []
    left = list(args)
    while left and left[0] != "--":
        word = left.pop(0)
        name, equals, value = word.partition("=")
        if name not in JOINED:
            words.append(word)
            continue
        values = [value] if equals else []
        while left and _NUMBER_LIKE.fullmatch(left[0]) and "," not in "".join(values):
            values.append(left.pop(0))
        words += [f"{name}={','.join(values)}"] if values else [word]
    return words + left


def sorted_words(args: list[str], takes: Mapping[str, int]) -> list[str]:
    """Return the words with options first, then `--`, then everything else in its order.

    An option whose value is missing comes last and alone, so that `--` is not taken for it.

    Args:
        args: The words as they were typed.
        takes: How many words each option takes.
    """
    options: list[str] = []
    others: list[str] = []
    left = list(args)
    while left and left[0] != "--":
        word = left.pop(0)
        if word == "-" or not word.startswith("-") or _NUMBER_LIKE.fullmatch(word):
            others.append(word)
            continue
        count = takes.get(word, 0)
        if len(left) < count or "--" in left[:count]:
            return [*options, word]
        options += [word, *left[:count]]
        left = left[count:]
    return [*options, "--", *others, *left[1:]]


class NumbersCommand(Command):
    """A command whose words may be numbers."""

    parser = NumbersParser


class FkCommand(NumbersCommand):
    """Compute the pose of the tool from joint values, or from each row of a CSV.

    Joint values outside the robot's limits have a pose too; a line on stderr says which they are.
    """

    example = "trajcli fk --robot ur5e 0 -90 90 0 90 0"

    robot: RobotName
    joints: Joints
    tool: Tool = None
    base: Base = None
    frame: Annotated[Literal["world", "base"], option("--frame", "Where the pose is counted from.")] = "world"
    links: Annotated[bool, option("--links", "Also the frame of each link.")] = False
    units: ArmUnits = None
    si: Si = False
    as_json: Json = False
    digits: DigitsOption = "fixed"


class IkCommand(NumbersCommand):
    """Find all joint values that bring the tool to a pose; of a CSV of poses, the way that stays nearest.

    An answer is singular where the tool can move in fewer directions, of those that the pose fixes, than it
    can nearby. What is free is a direction in which the joints can move while the pose is kept.

    Exit codes: 0 an answer lies within the limits; 3 the pose is out of reach, or all its answers lie outside
    the limits (they are printed with --all); 2 robot, pose or rows are wrong; 4 a file cannot be read.
    """

    example = "trajcli ik -r ur5e --pose '{xyz: [0.4, 0.1, 0.3]}'"

    robot: RobotName
    rows: Annotated[list[str] | None, argument("-", "- reads poses from a CSV.")] = None
    pose: Annotated[
        str | None,
        option(
            "--pose",
            "T_world_tcp as YAML or @FILE; what it leaves out is free. joints: {NAME: X} pins joints.",
            "POSE",
        ),
    ] = None
    near: Annotated[
        str | None, option("--near", "Joint values to be near to, instead of zero; -- ends them.", "Q...")
    ] = None
    every: Annotated[
        bool, option("--all", "Also answers outside the limits; of a CSV every branch of each pose.")
    ] = False
    turns: Annotated[bool, option("--turns", "Also every full turn of a joint that its limits allow.")] = (
        False
    )
    tolerance: Annotated[
        float, option("--tolerance", "What an answer may miss by, m and rad: 1e-12 to 1.", "TOL")
    ] = 1e-6
    tool: Tool = None
    base: Base = None
    units: ArmUnits = None
    si: Si = False
    as_json: Json = False
    digits: DigitsOption = "fixed"


class JacobianCommand(NumbersCommand):
    """Compute the Jacobian of the tool, its manipulability and rank, and the directions that are lost.

    The Jacobian is the one of textbooks: angular rows in rad, columns per rad, whatever the unit of angles
    is; lengths are in the unit of lengths. Joint values and --qd are in the units of the robot's file.
    """

    example = "trajcli jacobian --robot ur5e 0 -90 90 0 90 0"

    robot: RobotName
    joints: Joints
    tool: Tool = None
    base: Base = None
    frame: Annotated[
        Literal["world", "base", "tcp"], option("--frame", "In whose axes the rows are written.")
    ] = "world"
    rates: Annotated[
        str | None,
        option("--qd", "A rate for each joint, for the acceleration they cause; -- ends them.", "V..."),
    ] = None
    units: ArmUnits = None
    si: Si = False
    as_json: Json = False


class DynamicsCommand(NumbersCommand):
    """Compute joint torques (N m) and forces (N) of a motion, and the parts they are made of.

    tau = M(q) qdd + C(q, qd) qd + g(q) + friction, with the rotors in M. Joint values and rates are in the
    units of the robot's file, everything else is SI. Rows of q, qd and qdd become rows of tau.
    """

    example = "trajcli dynamics -r ur5e --payload '{mass: 5}' 0 -45 90 0 90 0"

    robot: RobotName
    joints: Joints
    tool: Tool = None
    base: Base = None
    payload: Annotated[
        str | None, option("--payload", "What the tool carries, {mass, com?, inertia?} or @FILE.", "PAYLOAD")
    ] = None
    rates: Annotated[str | None, option("--qd", "A velocity for each joint; -- ends them.", "V...")] = None
    accelerations: Annotated[
        str | None, option("--qdd", "An acceleration for each joint; -- ends them.", "A...")
    ] = None
    units: ArmUnits = None
    si: Si = False
    as_json: Json = False
    digits: DigitsOption = "fixed"


class PoseCommand(NumbersCommand):
    """Multiply rotations and displacements about fixed and current axes; print every representation."""

    example = "trajcli pose --units deg '{rpy: [0, 0, 90]}' '{xyz: [1, 0, 0]}'"

    steps: Annotated[
        list[str], argument("STEP...", "Poses as YAML or @FILE, with `frame` and `invert` beside.")
    ]
    units: Annotated[str, option("--units", "Of plain numbers, such as deg,mm; else rad and m.", "UNITS")] = (
        ""
    )
    inverse: Annotated[bool, option("--inverse", "Take the inverse of the result.")] = False
    point: Annotated[
        str | None, option("--point", "A point in the pose's frame, to be said in the first.", "X Y Z")
    ] = None
    euler: Annotated[str | None, option("--euler", "Also both triples of these angles.", "ZYZ[:fixed]")] = (
        None
    )
    to: Annotated[str | None, option("--to", "Print poses on the way to this one.", "POSE")] = None
    s: Annotated[str | None, option("--s", "Where on the way, from 0 to 1.", "S,...")] = None
    path: Annotated[
        Literal["line", "screw"] | None,
        option("--path", "line: the origin goes straight; screw: constant twist."),
    ] = None
    orientation: Annotated[
        Literal["axis_angle", "euler"] | None,
        option("--orientation", "On a line: about one axis, or by even Euler angles."),
    ] = None
    as_json: Json = False


class RobotsCommand(Command):
    """List the catalogue, or show a robot: DH table, limits, reach, inverse kinematics, source."""

    example = "trajcli robots ur5e"

    name: Annotated[
        str | None,
        argument(
            "NAME|FILE", "One robot, or a job's; without it all are listed.", autocompletion=robot_names
        ),
    ] = None
    kind: Annotated[
        str | None, option("--kind", "List those with joints such as 6R or RRPR; real; textbook.", "KIND")
    ] = None
    joints: Annotated[int | None, option("--joints", "List those with that many joints.", "N", min=1)] = None
    maker: Annotated[
        str | None, option("--maker", "List those of a maker; part of the name will do.", "TEXT")
    ] = None
    text: Annotated[str | None, option("--search", "List those with this in their names.", "TEXT")] = None
    as_yaml: Annotated[bool, option("--yaml", "Print the robot's file, to start a new one from.")] = False
    as_urdf: Annotated[bool, option("--urdf", "Print the robot as URDF, for viewers and ROS.")] = False
    as_json: Json = False


class UrdfCommand(Command):
    """Make a robot file of a URDF: DH table, base, tool, limits, inertias. What was decided is on stderr."""

    example = "trajcli urdf arm.urdf -o robot.yaml"

    file: Annotated[str, argument("FILE", "The URDF; - is standard input.")]
    root: Annotated[
        str | None, option("--root", "Where the chain begins; else the outermost link.", "LINK")
    ] = None
    tip: Annotated[
        str | None,
        option("--tip", "Where it ends, the tcp; else the longest chain without a gripper.", "LINK"),
    ] = None
    exact: Annotated[bool, option("--exact", "Keep angles within 1e-3 rad of right angles as they are.")] = (
        False
    )
    soft: Annotated[bool, option("--soft", "Tighten ranges to the soft limits of <safety_controller>.")] = (
        False
    )
    output: Annotated[
        str | None, option("--output -o", "Write the robot file instead of printing it.", "FILE")
    ] = None
    verbose: Annotated[
        bool, option("--verbose -v", "Every note on what was decided, not only the first.")
    ] = False


class CalibrateCommand(Command):
    """Find the parameters of an arm from measured poses: DH rows, base and tool.

    What the measurements cannot tell keeps its nominal value, and is named. JSON is in rad and m.

    Exit codes: 0 done; 2 robot, parameters or measurements are wrong, or too few; 4 a file cannot be read or
    written.
    """

    example = "trajcli calibrate -r ur5e --plan 20"

    robot: RobotName
    file: Annotated[
        str | None,
        argument(
            "FILE",
            "Measured poses: a YAML list of {joints, pose}, or a CSV, - on stdin; candidates of --plan.",
        ),
    ] = None
    free: Annotated[
        str,
        option(
            "--free",
            "Parameters: all, dh, base, tool, a joint, or such as j1.theta,j2.d,base.x,tool.rz.",
            "all|NAME,...",
        ),
    ] = "all"
    output: Annotated[
        str | None, option("--output -o", "The corrected robot's file; a plan's CSV.", "FILE")
    ] = None
    scale: Annotated[
        str | None, option("--scale", "Length that counts like a radian; else all lengths of the arm.", "L")
    ] = None
    loss: Annotated[
        Literal["linear", "huber", "cauchy"],
        option("--loss", "How a measurement far off counts: squared, or less."),
    ] = "linear"
    loss_scale: Annotated[
        float | None,
        option(
            "--loss-scale", "Times the median residual: what is beyond counts less; 1.5 if left out.", "K"
        ),
    ] = None
    plan: Annotated[
        int | None, option("--plan", "Propose N configurations to measure, as CSV or JSON.", "N")
    ] = None
    measure: Annotated[
        Literal["pose", "position"] | None,
        option("--measure", "What --plan expects to be measured; pose if left out."),
    ] = None
    tool: Tool = None
    units: ArmUnits = None
    si: Si = False
    as_json: Json = False


class MobilityCommand(Command):
    """Count the freedoms of a robot or a linkage by the formula of Gruebler and Kutzbach."""

    example = "trajcli mobility --links 4 --joints 1x4 --space planar"

    robot: Annotated[
        str | None,
        option(
            "--robot -r", "The open chain of a robot, or of a job's.", "NAME|FILE", autocompletion=robot_names
        ),
    ] = None
    links: Annotated[int | None, option("--links", "Number of links, the frame counted.", "N")] = None
    joints: Annotated[
        str | None,
        option(
            "--joints",
            "Freedoms of the joints: 1x4,3x2, or by kind: Rx4,Sx2 (R P H: 1, C U: 2, S: 3).",
            "F|FxCOUNT,...",
        ),
    ] = None
    space: Annotated[
        Literal["spatial", "planar"], option("--space", "Where the links move: lambda 6 or 3.")
    ] = "spatial"
    passive: Annotated[int, option("--passive", "Freedoms that change nothing for the others.", "F0")] = 0
    as_json: Json = False


COMMANDS = (
    FkCommand,
    IkCommand,
    JacobianCommand,
    DynamicsCommand,
    PoseCommand,
    RobotsCommand,
    UrdfCommand,
    CalibrateCommand,
    MobilityCommand,
)
