"""How a pose of a job is reached, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from trajcli.cli.matrix_text import numbers
from trajcli.pipeline.arm import Arm


def pose_reached_lines(move: Mapping[str, Any], arm: Arm) -> Iterator[str]:
    """Yield what `explain` says of the poses from which a move comes and to which it goes."""
    for key, head, origin in (
        ("from_pose", "starts at a pose", "zero"),
        ("to_pose", "goes to a pose", "where the arm comes from"),
    ):
        told = move[key]
        if told is not None:
            units = dict.fromkeys(arm.joint_unit(i) for i in range(len(arm.robot.joints)))
            yield f"  {head}: joints {numbers(told['joints'])} ({', '.join(units)})"
            yield f"    branch: {_branch(told)}; {_singular(told)}"
            yield f"    chosen: {_choice(told['chosen'], origin)}"
            if "free_direction" in told:
                along = numbers(told["free_direction"])
                yield f"    the arm can move without leaving the pose: joints along {along}"


def _branch(told: Mapping[str, Any]) -> str:
    return _named(told["branch"]) if told["branch"] else f"without a name ({told['method']})"


def _named(names: Mapping[str, str]) -> str:
    return ", ".join(f"{choice} {name}" for choice, name in names.items())


def _singular(told: Mapping[str, Any]) -> str:
    here, nearby = told["rank"]["here"], told["rank"]["nearby"]
    return f"singular (rank {here}, nearby {nearby})" if told["singular"] else "not singular"


def _choice(chosen: Mapping[str, Any], origin: str) -> str:
    count, within = chosen["candidates"], chosen["within_limits"]
    if within == 1:
        return "the only answer within the limits"
    answers = f"of {within} answers found within the limits, "
    nearest = f"the nearest to {origin}"
    if not chosen["configuration"]:
        return answers + nearest
    named = f"{_named(chosen['configuration'])} as the configuration says"
    return answers + (f"{count} have {named}; of these {nearest}" if count > 1 else f"1 has {named}")
