"""Overrides of a job: values such as `--set moves.0.duration=3` that replace the file's, or add to them.

A path into a pose, a list or a bound of joints that the job leaves out first writes what then counts: with
`base.xyz.0=100` the rest of the base is that of the robot.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple

from trajcli.errors import InputError, Place
from trajcli.frozen import frozen
from trajcli.job.yaml.document import Document, Node
from trajcli.job.yaml.load import MAX_DEPTH, parse_document
from trajcli.units import units_of

if TYPE_CHECKING:
    from trajcli.kinematics.robot import Robot

_Steps = tuple[str | int, ...]
_QUOTED = 40  # characters of a path without end that a message repeats
_BARE = (
    "xyz",
    "rpy",
    "quat_wxyz",
    "quat_xyzw",
    "rotvec",
    "matrix",
    "joints",
    "direction",
    "through",
    "segments",
    "inertia",
    "times",
)
"""Lists that a job leaves out without another taking their place."""
_RATES = ("velocity", "acceleration", "deceleration")
"""Likewise where they stand in a move."""
_STATES = frozenset(("start", "points", "to"))
"""Keys of states, or of what holds them: rates that one leaves out are zero."""


class Setting(NamedTuple):
    """What an option says about one value.

    Attributes:
        option: The option as the user wrote it, for messages.
        path: Keys, and indices from 0.
        value: YAML.
    """

    option: str
    path: tuple[str | int, ...]
    value: str


def parse_setting(text: str, option: str = "--set") -> Setting:
    """Return what `PATH=VALUE` says, such as "moves.0.duration=3".

    Raises:
        InputError: When it is not of that form.
    """
    name, equals, value = text.partition("=")
    steps = tuple(
        int(step) if step.isdecimal() and len(step) < _QUOTED else step for step in name.strip().split(".")
    )
    if not equals or "" in steps:
        raise InputError(f"{option} {text}: expected PATH=VALUE", hint=f"such as {option} moves.0.duration=3")
    if len(steps) > MAX_DEPTH:
        depth = f"a path of {len(steps)} parts, a job is at most {MAX_DEPTH} levels deep"
        raise InputError(
            f"{option} {text[:_QUOTED]}...: {depth}", hint=f"such as {option} moves.0.duration=3"
        )
    return Setting(f"{option} {text}", steps, value or "null")


@frozen
class PatchedDocument(Document):
    """A document in which options have replaced parts, or added some.

    Attributes:
        patches: What the options say, by what they replace or begin.
    """

    patches: Mapping[tuple[str, ...], Document] = field(default_factory=dict)

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where the deepest existing node on the path stands, in the file or in an option."""
        steps = tuple(map(str, path))
        for depth in range(len(steps), 0, -1):
            patch = self.patches.get(steps[:depth])
            if patch is not None:
                return patch.place(path[depth:], key=key)
        return super().place(path, key=key)


def overridden(document: Document, settings: Sequence[Setting]) -> Document:
    """Return the document with the settings put in; later ones win.

    Raises:
        InputError: When a path leads through something that is no mapping or list, or a value is no YAML.
    """
    if not settings:
        return document
    for setting in settings:
        _refuse_keys_of_values(document, setting)
        document = _patched(_written_out(document, setting), setting)
    return document


def _refuse_keys_of_values(document: Document, setting: Setting) -> None:
    """Refuse a path through a name, a number or nothing."""
    path, words = setting.path, [str(step) for step in setting.path]
    for depth in range(len(path)):
        node = document.node(path[:depth])
        if node is None or isinstance(node.value, dict | list):
            continue
        hint = f"write the whole of it: {'.'.join(words[:depth])}=..." if depth else None
        if isinstance(node.value, str) and document.node(("points", node.value)):
            hint = f"it is a point: {'.'.join(['points', node.value, *words[depth:]])}=..."
        inside = f"would stand inside {node.text or 'an empty value'}, which holds no keys"
        raise InputError(f"{setting.option}: '{words[depth]}' {inside}", hint=hint)


def _patched(document: Document, setting: Setting) -> PatchedDocument:
    patch = parse_document(setting.value, setting.option, any_root=True)
    path, steps = setting.path, tuple(map(str, setting.path))
    root = _with(document.root, path, patch.root, setting.option)
    before = document.patches if isinstance(document, PatchedDocument) else {}
    patches = {at: each for at, each in before.items() if at[: len(steps)] != steps}
    for depth in range(1, len(steps) + 1):
        if depth == len(steps) or document.node(path[:depth]) is None:
            patches[steps[:depth]] = patch
    return PatchedDocument(document.file, document.lines, root, patches)


def _written_out(document: Document, setting: Setting) -> Document:
    """Return the document with the first thing on a setting's path that it leaves out, as it then counts."""
    path = setting.path
    lacking = [depth for depth in range(1, len(path)) if document.node(path[:depth]) is None]
    for depth in lacking:
        default = _default(document, path[:depth], path[depth])
        if default is not None:
            return _patched(document, Setting(setting.option, path[:depth], json.dumps(default)))
    for depth in lacking:
        in_move = depth > 1 and isinstance(path[depth - 2], int)
        if isinstance(path[depth], int) and path[depth - 1] in (*_BARE, *(_RATES if in_move else ())):
            left_out = ".".join(map(str, path[:depth]))
            message = f"{setting.option}: the job has no {left_out}, and nothing takes its place"
            raise InputError(message, hint=f"write the whole of it: {left_out}=[...]")
    return document


def _default(document: Document, path: _Steps, step: str | int) -> Any:  # noqa: ANN401
    """Return what counts where a job leaves out the value at a path; None where a mapping may begin empty."""
    *above, key = path
    if (
        key in ("xyz", "rpy")
        and above
        and (above[0] in ("base", "tool", "frames", "tools") or above[-1] == "offset")
    ):
        return [0, 0, 0]
    if path in (("base",), ("tool",)):
        return _pose_of_robot(document, str(key))
    if not isinstance(step, int):
        return None
    if path == ("gravity",):
        from trajcli.kinematics.robot import GRAVITY

        return list(GRAVITY)
    if path == ("output", "columns"):
        from trajcli.job.model import Output

        return list(Output.model_fields["columns"].default)
    if key == "com":
        return [0, 0, 0]
    if above[-1:] == ["limits"]:
        return _bounds_in_force(document, path)
    if key in ("velocity", "acceleration") and not _STATES.isdisjoint(above):
        return [0] * len(_robot(document).joints)
    return None


def _robot(document: Document) -> Robot:
    """Return the robot of a job, as it is without the job's limits."""
    from trajcli.job.robot import find_sheet

    plain = document.plain()
    return find_sheet(plain.get("robot"), document, units_of(plain.get("units"))).robot


def _in_force(document: Document, *, scaled: bool) -> Robot:
    """Return the robot of a job with the job's limits in force, as they are with or without its `scale`."""
    from trajcli.job.files.moveit_limits import read_moveit_limits
    from trajcli.job.limits import with_job_limits
    from trajcli.job.messages import validated
    from trajcli.language.limits import JobLimitsSpec, LimitsSpec, Scale
    from trajcli.language.numbers import ReadingContext

    robot, plain = _robot(document), document.plain()
    context = ReadingContext(units_of(plain.get("units")), robot.joint_names, robot.joint_types)
    spec = validated(JobLimitsSpec, plain.get("limits", {}), document, context, ("limits",))
    limits: LimitsSpec = spec if scaled else spec.model_copy(update={"scale": Scale()})
    if spec.file is not None:
        limits = read_moveit_limits(spec.file, document, robot).under(limits)
    return with_job_limits(robot, limits)[0]


def _pose_of_robot(document: Document, key: str) -> dict[str, Any]:
    """Return the robot's own base or tool, as it may stand in a job of any units."""
    from trajcli.geometry.euler import rpy_from_matrix
    from trajcli.language.numbers import written_number
    from trajcli.units import Quantity

    robot = _robot(document)
    pose = robot.stand if key == "base" else robot.tool
    angles = rpy_from_matrix(pose[:3, :3]).angles.tolist()
    return {
        "xyz": [written_number(length, Quantity("length")) for length in pose[:3, 3].tolist()],
        "rpy": [written_number(angle, Quantity("angle")) for angle in angles],
    }


def _bounds_in_force(document: Document, path: _Steps) -> list[Any] | None:
    """Return a limit of all joints, as it counts where a job or a move does not say it."""
    from trajcli.kinematics.robot import QUANTITIES
    from trajcli.language.limits import written_bound
    from trajcli.language.per_joint import UNLIMITED
    from trajcli.units import joint_quantity

    if path[-1] not in (*QUANTITIES, "effort"):
        return None
    robot = _in_force(document, scaled=path[0] != "limits")
    if path[-1] == "effort":
        return [None if tuple(row) == UNLIMITED else row for row in robot.limits.effort.tolist()]
    order = QUANTITIES.index(str(path[-1]))
    rows = zip(robot.joint_types, robot.limits.of_order(order).tolist(), strict=True)
    return [written_bound((low, high), joint_quantity(kind, order)) for kind, (low, high) in rows]


def _with(node: Node, steps: _Steps, new: Node, option: str) -> Node:
    """Return the node with `new` at the path `steps` below it."""
    if not steps:
        return new
    step, value = steps[0], node.value
    if isinstance(value, list):
        if not isinstance(step, int) or step >= len(value):
            entries = f"{len(value)} entr{'y' if len(value) == 1 else 'ies'}"
            raise InputError(
                f"{option}: there is no '{step}' in a list of {entries}", hint="they count from 0"
            )
        items = [_with(v, steps[1:], new, option) if i == step else v for i, v in enumerate(value)]
        return node._replace(value=items)
    fields, name = value if isinstance(value, dict) else {}, str(step)
    below = fields.get(name, node._replace(value={}, keys={}))
    return node._replace(value={**fields, name: _with(below, steps[1:], new, option)})
