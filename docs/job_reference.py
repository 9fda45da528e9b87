"""The job reference, from the models that read jobs."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path

import trajcli.units
from docs.fields import field_table
from docs.markdown import ROOT, first_sentence, table
from docs.planner_examples import EXAMPLES, LEFT_OUT, NOTES
from docs.tool_path_reference import tool_path_sections
from trajcli.columns import GROUPS, Group
from trajcli.job.model import Job, Output, OutputUnits, UnitsSpec
from trajcli.job.robot import JointModel, RobotModel
from trajcli.job.yaml.load import read_document
from trajcli.language.dynamics import FrictionSpec, LinkSpec, PayloadSpec
from trajcli.language.limits import JobLimitsSpec, Scale, ToolLimitsSpec, VelocityByPosition
from trajcli.language.numbers import MAX_JOINTS
from trajcli.language.poses import SEQUENCES, Configuration
from trajcli.language.targets import AxisAngleSpec, EulerSpec, Target
from trajcli.language.waypoints import Waypoint
from trajcli.planners import PLANNERS
from trajcli.planners.planner import Planner
from trajcli.planners.point_to_point.point_to_point import PointToPoint
from trajcli.planners.tool_path.line import Defaults

_INTRODUCTION = """\
A job is one YAML document. Numbers follow YAML 1.2; anchors, tags, duplicate keys, unknown keys, NaN
and infinity are errors. All errors of a file are reported at once, each with its line and column.

The column *unit* says what a plain number measures: `angle` and `length` are the units chosen under
`units`, `joint` is the angle unit for a revolute joint and the length unit for a prismatic one. Time is
always in seconds."""

_STATES = """\
A state is the name of a point, a mapping, or [relative to a point](#relative-points). What it leaves out
is zero."""

_PROGRAMS = """\
Points and frames may be many, a grid or a list of names, and among the moves may stand
`{repeat: ..., moves: [...]}` and `{call: NAME}`: see [programs](programs.md)."""

_RELATIVE = """\
`{from: pick, offset: {xyz: [0, 0, -100]}}` is the pose of the point `pick`, displaced by the pose `offset`.
With `frame: tool` (the default) the offset is along and about the axes that the tool has in that point,
T_point T_offset: for a tool that looks down, negative z is above. With `frame: world`, or another frame, it
is along and about the axes of that: the position is moved by `xyz`, the orientation turned about the tcp.

The point is given as a pose, by its joints or relative to another point, or it is `here`: where the arm
stands before the move. Then, and from joints, the pose is found as the job is planned, with the tool in force
there; above joints that were taught the arm stays on their branch. The `configuration` of a point holds, too,
if none stands beside `from`. A point without a whole orientation can only be displaced, with
`frame: world`. `velocity` and `acceleration`, and in a [waypoint](#points-on-the-path) `time` and `blend`,
stand beside `from`."""

_VALUES = """\
A value for each joint has one of three forms: one value that holds for all joints, a list with one
entry for each joint, or a mapping by joint name. In a mapping every joint of a position is named; of a
velocity or an acceleration, the joints that are left out are zero; of limits, they keep what they have."""

_BOUNDS = """\
A bound is a number above 0 (it holds in both directions), a pair `[lower, upper]` by direction, or
`null`: unlimited, not checked, and the report says so. A pair for a velocity, acceleration or jerk has
a negative and a positive number; `null` at one end of a pair (not of an effort's) leaves that end open.
Under `limits` a list always has one entry for each joint; to give one
joint a pair, name it: `{j1: [-90, 120]}`."""

_LIMITS = """\
A job's `limits` replace the robot's, then `scale` multiplies them. A limit that is looser than the
robot's is allowed, and reported as an event. A move's `limits` apply to that move only, and can only
tighten; a `file` is of the job alone."""

_MOVEIT = """\
`limits: {file: joint_limits.yaml}` takes the limits of a MoveIt package as they are, in rad, m and s whatever
the units of the job. They stand under `joint_limits`, which may lie under `robot_description_planning`
and `ros__parameters`.

| key of a joint | meaning |
|---|---|
| `min_position`, `max_position` | range; an end that is left out is the robot's |
| `max_velocity`, `max_acceleration`, `max_jerk` | magnitude |
| `max_deceleration` | negative (Pilz): with the acceleration it makes the pair of limits, by direction |
| `has_velocity_limits`, ... | false: unlimited; true: the value must be there; left out: a value counts |

Other keys of a joint are ignored (effort, PID, soft limits, `angle_wraparound`), but for misspelt ones.
Joints that the robot does not have and scaling factors are ignored, with an event; joints that the file
leaves out keep the robot's limits, with an event. Whatever else stands under `limits` wins, joint by joint;
`scale` multiplies last."""

_TOOL_LIMITS = """\
Speeds and accelerations of the tcp, in world. They hold in every move of an arm with geometry: the laws of
[moves along a path](#along-a-path-of-the-tool) take them from here, and a move in joint space without a
duration, times or rates of its own keeps them, with an event. All moves are verified. `jerk` is the
one along the path; in joint space it is not judged, and the summary says so."""

_ROBOT = f"""\
Under `robot` stands the name of a robot of the [catalogue](robots.md), `{{file: PATH}}` or
`{{urdf: PATH}}` (relative to the job's folder), or the robot itself. Beside `urdf` may stand `root` and
`tip`, the links between which the chain is taken, and `exact: true`, which keeps angles near right ones as
they are: see [Bring your arm in](urdf.md).

`{{rail: {{axis: x, ...}}, arm: ur5e}}` is an arm on a [rail](programs.md#an-arm-on-a-rail).

`joints: 6` means six bare revolute joints `j1` to `j6`: no geometry, no limits, and enough for every move on
this page. A robot has 1 to {MAX_JOINTS} joints. A robot file holds the same mapping, with its own `units`."""

_JOINTS = """\
With standard rows the pose of a link is Rz(theta) Tz(d) Tx(a) Rx(alpha); with modified rows it is
Rx(alpha) Tx(a) Rz(theta) Tz(d). The joint's value q is added: theta + sign q for a revolute joint, d +
sign q for a prismatic one."""

_EFFORTS = """\
`effort` limits the torque of a revolute joint (N m) and the force of a slide (N), in any units of the job.
What drives a joint is tau = M(q) qdd + C(q, qd) qd + g(q) + coulomb sign(qd) + viscous qd, with the rotors in
M and with the [payload](#payload). All links need their mass and inertia, else the job is refused.

`effort: robot` takes the efforts that the robot itself states. Those of a robot that stands in the job, or
in a robot file of your own, are in force without it where all links have their inertia; those of the
catalogue and of a URDF only with it, for many of them are guesses: the report names their source and says
whether efforts were judged."""

_PAYLOAD = """\
`- {attach: {mass: 3.2}}` between two moves: from there on the tool carries a payload, until `- {detach: {}}`.
Neither takes time nor moves anything; they count among the `moves`, so that the number of a move in messages
and in the column `move` is its place in the list. Each move is planned and judged with what it carries. A
`start` with a payload is an `attach` before the first move.

An `inertia` that no solid has is refused: a principal moment below zero, or one above the sum of the two
others. A point mass (all zeros, the default) and a thin rod are possible."""

_TOOL_CHANGE = """\
`- {tool: NAME}` between two moves, where the arm stands and in no time, puts another
[tool](programs.md#tools) on the flange; a pose in the place of the name is one, too. It counts among the
`moves`."""

_SIGNAL = """\
`- {signal: NAME, value: NUMBER}` between two moves sets a [signal](programs.md#signals) where the arm stands,
in no time. It counts among the `moves`, too."""

_DYNAMICS = """\
Effort, friction, rotor and link are what [efforts](#efforts) are computed from. They are in SI whatever
the units of the file, but for the centre of mass, which is a length. An inertia that no solid has is refused:
a mass not above zero, a principal moment below zero, or one above the sum of the two others."""

_BY_POSITION = """\
A joint that is the distance x before the end of its range may move towards that end with at most
max(0, sqrt(2 d x) - o), and away from it as its `velocity` says: a joint that brakes with the deceleration d
then stops before the end. Nearer than o^2 / (2 d) it may not move towards the end at all. The Franka FR3
aborts a motion that exceeds such limits. The joint needs `position`: the range in force says where it ends.
The factor `velocity` under `scale` scales this limit, too. It is verified for all t, from the roots of
polynomials; moves that find their duration themselves keep it: `time_optimal` by its law, others by the
smallest stretch, with an event."""

_POSES = f"""\
A pose is a mapping with a position `xyz: [x, y, z]` and at most one orientation; what it leaves out is
zero. Poses of points, targets, `tool` and `base` are read alike.

| key | orientation |
|---|---|
| `rpy` | `[about x, about y, about z]`, fixed axes: R = Rz Ry Rx |
| `quat_wxyz` | unit quaternion, w first |
| `quat_xyzw` | unit quaternion, w last: the order of ROS and scipy |
| `rotvec` | axis times angle, `[rx, ry, rz]` as a UR pendant shows them |
| `matrix` | 3x3, or 4x4 with the position inside |
| `axis_angle` | `{{axis: x, y, z or [x, y, z], angle}}` |
| `euler` | `{{sequence, angles, frame}}`: three angles about `current` axes (the default) or `fixed` ones |

The sequences of Euler angles are {", ".join(SEQUENCES)}."""

_POSE_TARGETS = """\
A state is given by all its `joints` or by a pose of the tcp in world, not by both. What a pose leaves out is
free: with `xyz` alone the orientation, with an orientation alone the position; `yaw`, `pitch` and
`direction` fix a part of the orientation. The joints are found by inverse kinematics: the branch that
`configuration` names, or else the one nearest to where the arm comes from (for the `start`: nearest to
where all joints are zero; of several a remark says which). Some `joints` by name beside a pose are
[pinned](programs.md#pinned-joints). A rotation matrix may be off by 1e-4: the nearest rotation is taken,
and an
event tells so."""

_CONFIGURATION = """\
Which branch is meant, whatever the signs and zeros of the joints. `left` reaches to the side where axis 2
stands beside axis 1 (along the x axis of the first link where they meet), `right` over the shoulder; `up` has
the elbow higher in world (for planar arms: left of the line to the tcp, against the z axis of the table);
`no_flip` bends joint 5 positively about its z axis in the table. `trajcli ik` lists the branches of a pose by
these names.

Programs of ABB, KUKA and FANUC name it by flags of their own, which six-axis elbow arms with a spherical
wrist
understand, on a rail, too:

| flags | mean |
|---|---|
| `abb: [cf1, cf4, cf6, cfx]` | quadrants of joints 1, 4 and 6 (0: from 0 to 90 deg, -1: from -90 deg to \
0), and cfx: + 4 with the wrist behind joint 1, + 2 behind the lower arm, + 1 with joint 5 below zero |
| `kuka: {s: 2, t: 35}` | status, a number or `'B010'`: bit 0 with the wrist behind joint 1, bit 1 with \
joint 3 on the side of 90 deg from the stretched arm, bit 2 with joint 5 below zero; turn, which may be \
left out: bit 0 with joint 1 below zero, and so on |
| `fanuc: 'N U T, 0, 0, 0'` | F with joint 5 above zero, else N; U with the elbow bent as at zero, else \
D; T with the wrist ahead of joint 1, else B; turns of joints 1, 4 and 6, which may be left out: 0 \
within 180 deg from zero |

The branch is read from where the axes are, the turns from the joint values, which are those of the
controller. Turns that the range of the joints does not allow on that branch are the event `turns_not_met`.
On a
path only the branch counts, and where it is another one the move is refused."""

_WAYPOINTS = """\
A point that a move passes: the name of a point, or a state with a position and, if it is said when, a
`time`. Poses are reached on the branch nearest to the point before. A table `{positions: [[...], ...],
times: [...]}` is the shorter form for joint values without anything else; `{csv: FILE}` takes the table
from a file beside the job, with a column for each joint (`q1`, `q1_deg`, or the joint's name) and, if its
points have times, `t`. A first row of a table that is where the arm stands is the start itself; times
then count from it. Rows of a table that are nearer than `merge` to the one before are left out."""

_STRAIGHT = """\
Any move with a target `to` may have an `approach`: it goes by its own planner to the point that lies so far
from the target, then straight to it. `retreat` comes before any move: straight back from where it stands.

| key | what may stand there | default |
|---|---|---|
| `distance` | number above 0, a length; `approach: 80` is `{distance: 80}` | required |
| `axis` | `x`, `-x`, `y`, `-y`, `z`, `-z` or a list of 3 numbers | `-z` |
| `frame` | whose axis: `tool`, `world` or a frame | `tool` |
| `law` | that of the straight part | the job's default, else time_optimal |

Each part is a move of its own, a `line` where it is straight; all have the move's label and limits."""

_DEFAULTS = """\
What a job states under `defaults` holds for every `line`, `arc`, `path` and `screw`, the straight parts of
approaches among them, and for nothing in joint space."""

_MOVES = """\
Each move starts in the state in which the one before it ended: position and velocity, and the
acceleration where both planners have continuity 2 (else it is zero). Where a `duration` may be left
out, the move then takes the shortest time within the limits in force. A move over zero distance is held
for the time it is given, or lasts 0 s.

Every move has these fields beside its own:
"""

_MEANINGS: dict[Group, str] = {
    "t": "time, s",
    "q": "position of each joint",
    "qd": "velocity of each joint",
    "qdd": "acceleration of each joint",
    "qddd": "jerk of each joint",
    "pose": "`x y z qw qx qy qz`: position and unit quaternion of the tcp in world",
    "twist": "`vx vy vz wx wy wz`: velocity at the tcp and angular velocity, in world",
    "twistd": "`ax ay az ex ey ez`: time derivative of the twist",
    "path": "`s sd sdd`: arc length of the tcp along its path and two derivatives; 0 without a path",
    "tau": "effort of each joint, N m or N in any units: inverse dynamics with what the tool carries",
    "zone": "number of the zone about a corner that the motion is in, from 1; 0 on a path",
    "signals": "`signal.NAME` for each signal of the job, as they come there; 0 before the first value",
    "move": "index of the move, from 0; at the border of two moves, that of the later one",
}

_COLUMNS = """\
A group is written for all joints: `q` becomes `q1, q2, ...`. A column in SI units has its plain name;
any other carries its unit: `q1_deg`, `qd1_deg` (deg/s), `q3_mm`, `x_mm`, `wx_deg` (deg/s). The columns
are in the [units](#units-of-the-columns) under `output`, else in those of the job; quaternions have none.

The tcp is that of the robot with its base and tool: `pose`, `twist` and `twistd` need a robot with
geometry. The quaternion begins with w >= 0 (where w is zero but for rounding, with the first other
component above zero) and never jumps to the other sign from one row to the next.

`path` is in the unit of length; s begins at 0 in each move along a path, and all three are 0 in other
moves, also where the tool only rotates about the tcp.

Rows stand at `start_time + k / rate`; the last row is exactly the end."""

_OUTPUT_UNITS = """\
`output: {units: {angle: rad, length: m}}` writes rows in SI from a job in degrees and millimetres, and so
does `trajcli plan --si`, whatever the job says. Messages and explanations stay in the units of the job,
reports in SI."""


def job_reference() -> str:
    """Return the whole reference, which `docs.reference_pages` cuts into pages."""
    parts = ["# Job reference", _INTRODUCTION]
    parts += [
        "## Job",
        field_table(Job, dict.fromkeys(("points", "frames", "tools", "sequences"), "none")),
        _PROGRAMS,
    ]
    parts += ["## Units", field_table(UnitsSpec), *_strings_with_units()]
    parts += ["## States", _STATES, field_table(Target, {"joints": "see the planner"}), _POSE_TARGETS]
    parts += ["### Relative points", _RELATIVE]
    parts += ["### Axis and angle", field_table(AxisAngleSpec), "### Euler angles", field_table(EulerSpec)]
    parts += ["### Configuration", _CONFIGURATION, field_table(Configuration)]
    parts += ["### Points on the path", _WAYPOINTS, field_table(Waypoint, {"joints": "a pose instead"})]
    parts += ["## Values by joint", _VALUES]
    parts += ["## Limits", _LIMITS, field_table(JobLimitsSpec)]
    parts += ["### Scale", first_sentence(Scale.__doc__), field_table(Scale), "### Bounds", _BOUNDS]
    parts += ["### Efforts", _EFFORTS]
    parts += ["### Limits of MoveIt", _MOVEIT]
    parts += ["### Limits of the tool", _TOOL_LIMITS, field_table(ToolLimitsSpec)]
    parts += ["## Robot", _ROBOT, field_table(RobotModel)]
    parts += ["### Joints", _JOINTS, field_table(JointModel)]
    parts += ["### Velocity by position", _BY_POSITION, field_table(VelocityByPosition)]
    parts += ["### Dynamics of a joint", _DYNAMICS]
    parts += ["#### Friction", field_table(FrictionSpec), "#### Link", field_table(LinkSpec)]
    parts += ["### Poses", _POSES]
    parts += ["## Moves", _MOVES.rstrip(), _common_fields(), "### Approach and retreat", _STRAIGHT]
    parts += ["### Defaults", _DEFAULTS, field_table(Defaults)]
    parts += ["### Payload", _PAYLOAD, field_table(PayloadSpec)]
    parts += ["### Tool", _TOOL_CHANGE, "### Signal", _SIGNAL]
    parts += tool_path_sections()
    parts += ["## Planners"]
    for tag, planner in PLANNERS.items():
        parts += [f"### {tag}", *_planner(tag, planner)]
    parts += ["## Output", field_table(Output), "### Columns", _columns(), _COLUMNS]
    parts += ["### Units of the columns", _OUTPUT_UNITS, field_table(OutputUnits)]
    return "\n\n".join(parts) + "\n"


def _strings_with_units() -> Iterator[str]:
    """Yield what a string with a unit may say, from the docstring of the module that reads it."""
    documented = inspect.getdoc(trajcli.units) or ""
    yield 'A number may also be a string that says its own unit, such as `"120 deg/s"`:'
    yield documented[documented.index("| dimension") :]


def _common_fields() -> str:
    tags = " or ".join(f"[`{tag}`](#{tag})" for tag in PLANNERS)
    rows = field_table(Planner).splitlines()
    head, own = rows[:2], rows[2:]
    return "\n".join([*head, f"| `planner` | {tags} |  | required | Method of planning. |", *own])


def _planner(tag: str, planner: type[Planner]) -> Iterator[str]:
    about, _, source = (inspect.getdoc(planner) or "").partition("Source:")
    yield " ".join(about.split())
    yield _continuity(planner)
    yield field_table(planner, LEFT_OUT)
    if tag in NOTES:
        yield NOTES[tag]
    if source:
        yield f"Source: {' '.join(source.split())}"
    yield f"```yaml\n{EXAMPLES[tag]}```"
    used = [f"[{path.name}](../examples/{path.name})" for path in _examples_of(tag)]
    yield f"Curves, guarantees and a worked exercise: [{tag}](planners/{tag}.md). Used in {', '.join(used)}."


def _examples_of(tag: str) -> list[Path]:
    """Return the examples with a move of a planner; each planner has one."""
    found = [
        path
        for path in sorted((ROOT / "examples").glob("*.yaml"))
        if any(move.get("planner") == tag for move in read_document(str(path)).plain()["moves"])
    ]
    if not found:
        raise RuntimeError(f"there is no example of the planner {tag} in examples/")
    return found


def _continuity(planner: type[Planner]) -> str:
    joins = {
        1: "position and velocity have no jumps, the acceleration may step",
        2: "position, velocity and acceleration have no jumps",
    }
    text = f"Continuity {planner.continuity}: {joins[planner.continuity]}."
    if issubclass(planner, PointToPoint):
        imposed = [name for order, name in ((1, "velocity"), (2, "acceleration")) if order <= planner.imposes]
        text += f" The target may have {' and '.join(imposed)} beside its position." if imposed else ""
    return text


def _columns() -> str:
    return table(["group", "columns"], [[f"`{group}`", _MEANINGS[group]] for group in GROUPS])
