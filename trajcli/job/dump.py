"""Resolved jobs as YAML: points instead of their names, limits in force, numbers in SI.

Each number carries its SI unit with all its digits, so that reading the text gives the same job bit by bit.
The job's own units are kept: they decide how rows are written, unless `output.units` does.
"""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from math import isfinite, isnan
from pathlib import PurePath
from sys import float_info
from typing import Any

import numpy as np

from trajcli.errors import InputError
from trajcli.job.read import LoadedJob
from trajcli.job.robot import DH_ROW, RobotSheet
from trajcli.kinematics.robot import GRAVITY, QUANTITIES, Robot
from trajcli.language.dynamics import NamedTool, written_dynamics
from trajcli.language.limits import ToolLimitsSpec, written_bound
from trajcli.language.numbers import ReadingContext, written_number
from trajcli.language.per_joint import UNLIMITED
from trajcli.language.poses import Pose
from trajcli.units import Quantity, joint_quantity

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_YAML_WORDS = {"null", "true", "false"}
_STAND = "base of the rail"  # the base of a resolved robot is the frame of its first row
_DEEPEST = 100  # levels of mappings and lists in each other; no job has as many as ten
_ENDLESS = "does a mapping or a list hold itself?"
_INVISIBLE = ("Cc", "Cf", "Zl", "Zp", "Cn", "Co")


def dump_job(loaded: LoadedJob) -> str:
    """Return a job as YAML that reads as the same job: robot and limits in force, points, moves, output.

    Limits, base and tool of the job have become the robot's, and overrides are part of what they changed.
    """
    robot, job = loaded.robot, loaded.job
    context = ReadingContext(loaded.units, robot.joint_names, robot.joint_types)
    left_out = {"robot", "base", "tool", "limits"}
    written = job.model_dump(context=context, exclude=left_out, exclude_none=True, by_alias=True)
    moves = [_without_empty(move) if "planner" in move else move for move in map(_move, written["moves"])]
    ordered = {
        "version": job.version,
        "name": loaded.name,
        "units": written["units"],
        "robot": robot_as_mapping(robot),
        **_tools(loaded, written, context),
        **({} if job.gravity == GRAVITY else {"gravity": written["gravity"]}),
        "limits": {**_tool_limits(robot, context), **_efforts(robot)},
        "frames": {key: frame for key, frame in written["frames"].items() if key == job.output.frame},
        "points": written["points"],
        "start": written["start"],
        "zone": written.get("zone", {}),
        "moves": [],
        "when_over_limit": job.when_over_limit,
        "output": written["output"],
    }
    if robot.foot is not None and job.output.frame == "base":
        ordered["frames"] = {_STAND: Pose("").write(robot.stand, context)}
        ordered["output"]["in"] = _STAND
    if job.output.times is not None:
        ordered["output"].pop("rate")
    return "\n".join(_block({**_without_empty(ordered), "moves": moves})) + "\n"


def _tools(loaded: LoadedJob, written: Mapping[str, Any], context: ReadingContext) -> dict[str, Any]:
    """Return the tools that moves put on, and the first one where the robot does not say all of it."""
    job, first = loaded.job, loaded.job.tool
    tools = {"tools": written["tools"]} if job.tools else {}
    if first is None or not (first.name or first.load):
        return tools
    return {**tools, "tool": NamedTool("").write(first, context)}


def _move(written: dict[str, Any]) -> dict[str, Any]:
    """Return a move with its planner first; what handles a payload has none."""
    return {"planner": written.pop("planner"), **written} if "planner" in written else written


def dump_robot(sheet: RobotSheet) -> str:
    """Return a robot as a robot file in rad and m, which reads as the same robot bit by bit.

    Limits of the tool are not part of it: they belong to jobs.
    """
    written = robot_as_mapping(sheet.robot, plain=True)
    beside = {key: getattr(sheet, key) for key in ("source", "licence", "note")}
    head = {"name": written.pop("name"), "units": {"angle": "rad", "length": "m"}}
    given = {key: text for key, text in beside.items() if text is not None}
    return "\n".join(_block({**head, **given, **written})) + "\n"


def robot_as_mapping(robot: Robot, *, plain: bool = False) -> dict[str, Any]:
    """Return a robot as it may stand under `robot` in a job, to be read bit by bit.

    Args:
        robot: Any.
        plain: Whether numbers are without units, for a file in rad and m; else they carry theirs, for a job
            of any units.
    """
    say: Callable[[float, Quantity], float | str] = (lambda value, _: value) if plain else written_number
    described = robot.convention is not None
    keys = {"convention": robot.convention} if described else {}
    joints = [_joint_as_mapping(robot, index, say, described=described) for index in range(len(robot.joints))]
    poses = {key: getattr(robot, key) for key in ("base", "tool")}
    turned = {key: pose for key, pose in poses.items() if not np.array_equal(pose, np.eye(4))}
    written = {
        key: {
            "xyz": [say(x, Quantity("length")) for x in pose[:3, 3].tolist()],
            "matrix": pose[:3, :3].tolist(),
        }
        for key, pose in turned.items()
    }
    return {"name": robot.name, **keys, "joints": joints, **written}


def _joint_as_mapping(
    robot: Robot, index: int, say: Callable[[float, Quantity], float | str], *, described: bool
) -> dict[str, Any]:
    joint = robot.joints[index]
    keys = [key for key in DH_ROW if key != "beta" or joint.beta] if described else []
    row = {key: say(getattr(joint, key), DH_ROW[key]) for key in keys}
    bounds = [robot.limits.of_order(order)[index].tolist() for order in range(len(QUANTITIES))]
    limits = {
        quantity: written_bound((low, high), joint_quantity(joint.type, order), say)
        for order, (quantity, (low, high)) in enumerate(zip(QUANTITIES, bounds, strict=True))
    }
    rates = robot.limits.velocity_by_position[index].tolist()
    near = {
        name: say(value, joint_quantity(joint.type, order))
        for name, order, value in (("deceleration", 2, rates[0]), ("offset", 1, rates[1]))
    }
    by_position = {"velocity_by_position": near} if np.isfinite(rates[0]) else {}
    described_by = {**row, "sign": joint.sign, **limits, **by_position, **written_dynamics(joint, say)}
    return {"name": joint.name, "type": joint.type, **described_by}


def mapping_text(mapping: Mapping[str, Any]) -> str:
    """Return a job, a robot or a part of one as YAML.

    Args:
        mapping: Of mappings, lists, texts, numbers, truth values and None; numpy's arrays and numbers too.

    Raises:
        InputError: When a key is no text, or a value is of another kind.
    """
    return "\n".join(_block(_plain(mapping, ()))) + "\n"


def _plain(value: Any, path: tuple[str | int, ...]) -> Any:  # noqa: ANN401
    """Return a value with lists for arrays and tuples, and Python's numbers for numpy's."""
    if len(path) > _DEEPEST:
        raise InputError(f"{_path_text(path[:4])}...: more than {_DEEPEST} levels deep", hint=_ENDLESS)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, PurePath):
        value = str(value)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise InputError(f"{_path_text(path)}: expected texts as keys, got {key!r}")
        return {str(key): _plain(item, (*path, key)) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, (*path, index)) for index, item in enumerate(value)]
    if isinstance(value, int) and value.bit_length() > float_info.max_exp:
        raise InputError(f"{_path_text(path)}: too large: a number is at most {float_info.max:.1e}")
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise InputError(
        f"{_path_text(path)}: a value of type {type(value).__name__}",
        hint="a job has mappings, lists, texts, numbers, true, false and None",
    )


def _path_text(path: tuple[str | int, ...]) -> str:
    return "the job's " + ".".join(map(str, path)) if path else "the job"


def _tool_limits(robot: Robot, context: ReadingContext) -> dict[str, Any]:
    """Return the limits of the tool that are in force, which no robot file holds."""
    given = {name: value for name, value in asdict(robot.limits.tcp).items() if isfinite(value)}
    spec = ToolLimitsSpec(**given)
    return {"tcp": spec.model_dump(context=context, exclude_none=True)} if given else {}


def _efforts(robot: Robot) -> dict[str, Any]:
    """Return the efforts that are in force, where the robot's joints do not say the same."""
    in_force = robot.limits.effort.tolist()
    if all((low, high) == joint.effort for (low, high), joint in zip(in_force, robot.joints, strict=True)):
        return {}
    bounds = [None if tuple(bound) == UNLIMITED else bound for bound in in_force]
    return {"effort": dict(zip(robot.joint_names, bounds, strict=True))}


def _without_empty(value: Any) -> Any:  # noqa: ANN401
    """Return the value without the keys that hold an empty mapping: none is different from leaving it out."""
    if isinstance(value, list):
        return [_without_empty(item) for item in value]
    if not isinstance(value, Mapping):
        return value
    kept = {key: _without_empty(item) for key, item in value.items()}
    return {key: item for key, item in kept.items() if item != {}}


def _block(mapping: Mapping[str, Any], indent: str = "") -> Iterator[str]:
    """Yield the lines of a mapping: a line for each value that holds no further mappings."""
    for key, value in mapping.items():
        name, deeper = f"{indent}{_key(key)}:", indent + "  "
        if isinstance(value, Mapping) and any(map(_holds_mappings, value.values())):
            yield name
            yield from _block(value, deeper)
        elif isinstance(value, list) and _holds_mappings(value):
            yield name
            yield from (f"{deeper}- {flow_text(item)}" for item in value)
        else:
            yield f"{name} {flow_text(value)}"


def _holds_mappings(value: object) -> bool:
    return isinstance(value, Mapping) or (
        isinstance(value, list) and bool(value) and isinstance(value[0], Mapping)
    )


def flow_text(value: Any) -> str:  # noqa: ANN401
    """Return a value of lists, mappings and scalars as YAML on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)}: {flow_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow_text, value)) + "]"
    if isinstance(value, float) and not isfinite(value):
        return ".nan" if isnan(value) else ".inf" if value > 0 else "-.inf"
    return _text(value) if isinstance(value, str) else json.dumps(value)


def _key(name: str) -> str:
    return name if _PLAIN.fullmatch(name) and name.lower() not in _YAML_WORDS else _quoted(name)


def _text(text: str) -> str:
    return _key(text) if " " not in text else _quoted(text)


def _quoted(text: str) -> str:
    """Return a text in double quotes, with what shows nothing as escapes."""
    return "".join(
        f"\\U{ord(char):08X}" if unicodedata.category(char) in _INVISIBLE else char
        for char in json.dumps(text, ensure_ascii=False)
    )
