"""Joint limits of MoveIt: the file joint_limits.yaml as limits of a job, in SI.

A value counts where its flag, such as `has_velocity_limits`, is true or is not given; where the flag is false
the joint is unlimited. What the file leaves out stays the robot's own.

Source: MoveIt 2, moveit_ros/planning/robot_model_loader (flags and values), and Pilz Industrial Motion
Planner, joint_limits_extension (deceleration, negative).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from trajcli.errors import FileError, InputError, Problem
from trajcli.frozen import frozen
from trajcli.job.yaml.load import Document, read_document
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.language.limits import LimitsSpec
from trajcli.language.numbers import SI, FlawError, check_not_tiny, read_number, shown
from trajcli.language.per_joint import UNLIMITED, LowerUpper
from trajcli.planners.planner import Event
from trajcli.suggest import did_you_mean, nearest, valid_names
from trajcli.units import joint_quantity

Keys = tuple[str, ...]
"""Path below the root of a file."""

_ORDERS = {"position": 0, "velocity": 1, "acceleration": 2, "deceleration": 2, "jerk": 3}
_KEYS = (
    *(f"has_{quantity}_limits" for quantity in _ORDERS),
    "min_position",
    *(f"max_{quantity}" for quantity in _ORDERS),
)
_IGNORED = (
    "angle_wraparound",
    "has_effort_limits",
    "max_effort",
    "has_soft_limits",
    "soft_lower_limit",
    "soft_upper_limit",
    "k_position",
    "k_velocity",
)
_SCALING = ("default_velocity_scaling_factor", "default_acceleration_scaling_factor")
_AROUND = ("joint_limits", "robot_description_planning", "ros__parameters")
_WORDS = {"yes": True, "on": True, "no": False, "off": False}  # YAML 1.1, which ROS reads
_MOST_NAMES = 8  # that an event lists


@frozen
class MoveItLimits:
    """Limits of a file.

    Attributes:
        bounds: For each quantity (lower, upper) of each joint, SI; None where the file says nothing.
        events: What was ignored, left to the robot, or is by direction.
    """

    bounds: dict[str, tuple[LowerUpper | None, ...]]
    events: tuple[Event, ...]

    def under(self, spec: LimitsSpec) -> LimitsSpec:
        """Return the limits of a job: those of the file where the job itself says nothing."""
        merged = {}
        for quantity in QUANTITIES:
            own, of_file = getattr(spec, quantity), self.bounds[quantity]
            own = own or (None,) * len(of_file)
            both = tuple(a if a is not None else b for a, b in zip(own, of_file, strict=True))
            merged[quantity] = both if any(bound is not None for bound in both) else ()
        return spec.model_copy(update=merged)


def read_moveit_limits(path: str, document: Document, robot: Robot) -> MoveItLimits:
    """Return the limits of a file that a job names under `limits`.

    Args:
        path: Relative to the job's folder.
        document: The job's.
        robot: With limits of its own, and the names of the joints.

    Raises:
        InputError: With every flaw of the file, each with its place there.
        FileError: When it cannot be read; with the place of its name in the job.
    """
    folder = Path(document.file).parent
    try:
        limits = read_document(str(folder / path))
    except FileError as error:
        raise error.located(place=document.place(("limits", "file"))) from None
    return MoveItReader(limits, robot).read()


class MoveItReader:
    """Reads one file, and gathers its flaws and events."""

    def __init__(self, document: Document, robot: Robot) -> None:
        self._document, self._robot = document, robot
        self._events: list[Event] = []

    def read(self) -> MoveItLimits:
        """Return the limits.

        Raises:
            InputError: With the flaws of all joints.
        """
        around = self._around()
        joints, names = self._mapping(around), self._robot.joint_names
        if not set(joints) & set(names):
            raise InputError(self._stranger(around, joints))
        entries = {
            name: _JointEntry(self._document, (*around, name), self._robot, joint)
            for joint, name in enumerate(names)
            if name in joints
        }
        found = {name: entry.bounds() for name, entry in entries.items()}
        problems = [problem for entry in entries.values() for problem in entry.problems]
        if problems:
            raise InputError(*problems)
        bounds = {
            quantity: tuple(found[name].get(quantity) if name in found else None for name in names)
            for quantity in QUANTITIES
        }
        self._note("has limits of {names}, which the robot does not have: ignored", set(joints) - set(names))
        self._note("has no limits of {names}: the robot's own hold", set(names) - set(joints))
        braking = [name for name, entry in entries.items() if entry.by_direction]
        self._note(
            "gives {names} a deceleration: this pair of limits is by direction, not by braking", braking
        )
        return MoveItLimits(bounds, tuple(self._events))

    def _around(self) -> Keys:
        """Return the path of `joint_limits`, and note the scaling factors on it."""
        path: Keys = ()
        while not path or path[-1] != "joint_limits":
            mapping = self._mapping(path)
            self._note_scaling(mapping)
            nodes = [k for k, v in mapping.items() if isinstance(v, dict) and "ros__parameters" in v]
            step = next((key for key in (*_AROUND, *nodes) if key in mapping), None)
            if step is None:
                near = next((key for key in mapping if nearest(key, ["joint_limits"])), None)
                hint = f"is `{near}` meant?" if near else "MoveIt's file has `joint_limits: {JOINT: ...}`"
                raise InputError(Problem("expected a key `joint_limits`", hint, self._document.place(path)))
            path = (*path, step)
        self._note_scaling(self._mapping(path))
        return path

    def _mapping(self, path: Keys) -> dict[str, Any]:
        """Return what stands at a path; nothing stands for an empty mapping."""
        node = self._document.node(path)
        value = None if node is None else node.plain()
        if isinstance(value, dict):
            return value
        if value is not None:
            place = self._document.place(path)
            raise InputError(Problem(f"expected a mapping, got {shown(value)}", None, place))
        return {}

    def _note_scaling(self, mapping: dict[str, Any]) -> None:
        given = [f"{key} {shown(mapping[key])}" for key in _SCALING if key in mapping]
        if given:
            message = "{file}: {what} ignored: say `scale` under `limits`"
            amounts = {"file": self._document.file, "what": " and ".join(given)}
            self._events.append(Event("limits_file", message, amounts=amounts))

    def _note(self, message: str, names: Sequence[str] | set[str]) -> None:
        """Note something about joints: those of the robot in its order, others by name."""
        own = self._robot.joint_names
        listed = sorted(set(names) - set(_SCALING), key=lambda n: (own.index(n) if n in own else len(own), n))
        if listed:
            more = f" and {len(listed) - _MOST_NAMES} more" if len(listed) > _MOST_NAMES else ""
            amounts = {"file": self._document.file, "names": ", ".join(listed[:_MOST_NAMES]) + more}
            self._events.append(Event("limits_file", f"{{file}} {message}", amounts=amounts))

    def _stranger(self, around: Keys, joints: dict[str, Any]) -> Problem:
        """Return that the file is of another robot."""
        names = self._robot.joint_names
        hint = valid_names(names, "joints of the robot")
        first = next((name for name in joints if name not in _SCALING), None)
        if first is None:
            return Problem("no joint has limits here", hint, self._document.place(around))
        place = self._document.place((*around, first), key=True)
        message = f"none of the joints here is one of the robot's, the first is '{first}'"
        return Problem(message, did_you_mean(first, names) or hint, place)


class _JointEntry:
    """What the file says of one joint; gathers flaws.

    Attributes:
        problems: The flaws, once `bounds` was asked for.
        by_direction: Whether a deceleration makes the limits of acceleration a pair.
    """

    def __init__(self, document: Document, path: Keys, robot: Robot, joint: int) -> None:
        self._document, self._path, self._robot, self._joint = document, path, robot, joint
        self.problems: list[Problem] = []
        self.by_direction = False
        node = document.node(path)
        value = None if node is None else node.plain()
        self._given: dict[str, Any] = value if isinstance(value, dict) else {}
        if not isinstance(value, dict) and value is not None:
            self._refuse(f"expected a mapping, got {shown(value)}")

    def bounds(self) -> dict[str, LowerUpper]:
        for key in self._given:
            meant = None if key in (*_KEYS, *_IGNORED) else nearest(key, _KEYS)
            if meant is not None:
                self._refuse(f"unknown key '{key}'", key, f"did you mean '{meant}'?", at_key=True)
        flags = {quantity: self._flag(f"has_{quantity}_limits") for quantity in _ORDERS}
        bounds = dict(self._magnitudes(flags))
        position, braking = self._position(flags["position"]), self._deceleration(flags["deceleration"])
        if position is not None:
            bounds["position"] = position
        if braking is not None:
            own = self._robot.limits.acceleration[self._joint].tolist()
            bounds["acceleration"] = (braking, bounds.get("acceleration", own)[1])
            self.by_direction = True
        return bounds

    def _refuse(
        self, message: str, key: str | None = None, hint: str | None = None, *, at_key: bool = False
    ) -> None:
        path = self._path if key is None else (*self._path, key)
        self.problems.append(Problem(message, hint, self._document.place(path, key=at_key)))

    def _flag(self, flag: str) -> bool | None:
        """Return whether a flag is set; None where it is not given."""
        if flag not in self._given:
            return None
        value = self._given[flag]
        value = _WORDS.get(value.lower(), value) if isinstance(value, str) else value
        if not isinstance(value, bool):
            self._refuse(f"expected true or false, got {shown(value)}", flag)
            return None
        return value

    def _magnitudes(self, flags: dict[str, bool | None]) -> Iterator[tuple[str, LowerUpper]]:
        """Yield the bounds of velocity, acceleration and jerk that the file gives."""
        for quantity in ("velocity", "acceleration", "jerk"):
            key = f"max_{quantity}"
            if flags[quantity] is False:
                yield quantity, UNLIMITED
            elif self._has(quantity, flags[quantity], key):
                size = self._number(key, _ORDERS[quantity])
                if size is not None and size <= 0:
                    self._refuse(f"expected a number above 0, got {shown(self._given[key])}", key)
                elif size is not None:
                    yield quantity, (-size, size)

    def _position(self, flag: bool | None) -> LowerUpper | None:
        """Return the range that the file gives; an end that it leaves out is the robot's."""
        keys = ("min_position", "max_position")
        if flag is False:
            return UNLIMITED
        if not self._has("position", flag, *keys):
            return None
        own = self._robot.limits.position[self._joint].tolist()
        pairs = zip(keys, own, strict=True)
        low, high = (self._number(key, 0) if key in self._given else end for key, end in pairs)
        if low is None or high is None:
            return None
        if low >= high:
            key = keys[1] if keys[1] in self._given else keys[0]
            self._refuse(f"expected min_position below max_position, got {low:.9g} and {high:.9g}", key)
        return low, high

    def _deceleration(self, flag: bool | None) -> float | None:
        """Return the deceleration that the file gives, which is negative."""
        key = "max_deceleration"
        if flag is False or not self._has("deceleration", flag, key):
            return None
        value = self._number(key, 2)
        if value is not None and value >= 0:
            text = f"expected a number below 0, got {shown(self._given[key])}"
            self._refuse(text, key, "for Pilz' planners a deceleration is negative")
            return None
        return value

    def _has(self, quantity: str, flag: bool | None, *keys: str) -> bool:
        """Return whether one of the values is given; refuse a flag that promises one that is not."""
        present = any(key in self._given for key in keys)
        if flag and not present:
            name = f"has_{quantity}_limits"
            self._refuse(f"{name} is true, but {' and '.join(keys)} is not given", name, at_key=True)
        return present

    def _number(self, key: str, order: int) -> float | None:
        """Return a number in SI; None where it is none."""
        value, quantity = self._given[key], joint_quantity(self._robot.joint_types[self._joint], order)
        if isinstance(value, str):
            self._refuse(f"expected a number, got {shown(value)}", key)
            return None
        try:
            number = read_number(value, quantity, SI.units)
            check_not_tiny(abs(number) if order else 0.0, value, quantity, SI.units)
        except FlawError as error:
            self._refuse(str(error), key, error.flaws[0][2])
            return None
        return number
