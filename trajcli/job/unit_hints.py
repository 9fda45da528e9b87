"""Units that the numbers of a job look like: degrees read as radians, millimetres read as metres."""

from __future__ import annotations

import math
from collections.abc import Iterator

from trajcli.job.read import LoadedJob
from trajcli.job.yaml.document import Node
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import TWO_TURNS

_FAR = 50.0  # m: no arm reaches as far
_REACHES = 10.0  # times the length of the arm: far out of reach, and near it where a thousandth is meant
_ANGLES = ("rpy", "rotvec", "angles", "angle", "yaw", "pitch", "theta", "alpha", "beta")
_LENGTHS = ("xyz", "center", "a", "d")
_BY_JOINT = ("joints", "positions")
_SECTIONS = ("start", "points", "moves", "robot", "base", "tool")


def unit_hint(loaded: LoadedJob) -> str | None:
    """Return which `units` a job probably means, where its plain numbers are far too large as they are."""
    angles, lengths = [0.0], [0.0]
    for section in _SECTIONS:
        node = loaded.document.root.child(section)
        for is_length, value in _plain_numbers(node, section, loaded.robot):
            (lengths if is_length else angles).append(abs(value))
    units, looks, meant = loaded.units, [], {}
    if units.angle == "rad" and max(angles) > TWO_TURNS:
        looks.append(f"angles up to {max(angles):.6g} look like degrees")
        meant["angle"] = "deg"
    if units.length == "m" and max(lengths) > min(_FAR, _REACHES * _length_of(loaded.robot)):
        looks.append(f"lengths up to {max(lengths):.6g} look like millimetres")
        meant["length"] = "mm"
    if not looks:
        return None
    present: dict[str, str] = {"angle": units.angle, "length": units.length}
    kept = {kind: unit for kind, unit in present.items() if unit not in ("rad", "m")}
    written = ", ".join(f"{kind}: {unit}" for kind, unit in sorted({**kept, **meant}.items()))
    return f"{' and '.join(looks)}: say `units: {{{written}}}`"


def _length_of(robot: Robot) -> float:
    """Return the sum of the arm's DH lengths, m; infinite for bare joints."""
    if robot.convention is None:
        return math.inf
    return math.fsum(abs(joint.a) + abs(joint.d) for joint in robot.joints) or math.inf


def _plain_numbers(node: Node | None, key: str, robot: Robot) -> Iterator[tuple[bool, float]]:
    """Yield the numbers without a unit below a node, each with whether it is a length."""
    value = None if node is None else node.value
    if isinstance(value, dict):
        for name, below in value.items():
            if key in _BY_JOINT and name in robot.joint_names:
                yield from _of_joint(below, robot.joint_names.index(name), robot)
            else:
                yield from _plain_numbers(below, name, robot)
    elif isinstance(value, list):
        for index, below in enumerate(value):
            if key in _BY_JOINT and not isinstance(below.value, dict | list):
                yield from _of_joint(below, index, robot)
            else:
                yield from _plain_numbers(below, key, robot)
    elif key in _BY_JOINT and node is not None:
        yield from _of_joint(node, 0, robot)
    elif key in (*_ANGLES, *_LENGTHS) and isinstance(value, int | float):
        yield key in _LENGTHS, float(value)


def _of_joint(node: Node, joint: int, robot: Robot) -> Iterator[tuple[bool, float]]:
    """Yield the value of a joint, if it stands without a unit."""
    if isinstance(node.value, int | float) and joint < len(robot.joint_types):
        yield robot.joint_types[joint] == "prismatic", float(node.value)
