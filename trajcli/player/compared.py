"""Scene of two motions, from their starts on: the second beside the first, both with their verdicts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trajcli.errors import InputError

_OF_OTHER = ("title", "subtitle", "verdict", "joints", "robot", "length", "tool", "rows", "loads")
"""What a page shows of the second motion."""


def scene_of_two(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scene of two motions of one kind of arm; limits, moves and marks are those of the first.

    Args:
        first: A scene, as of a plan or a file.
        second: Another.

    Raises:
        InputError: When their joints are not of the same number and kinds.
    """
    kinds = [[_kind(joint) for joint in scene["joints"]] for scene in (first, second)]
    if len(kinds[0]) != len(kinds[1]):
        counts = [f"{scene['title']} has {len(scene['joints'])}" for scene in (first, second)]
        raise InputError(
            f"the motions have not as many joints: {counts[0]}, {counts[1]}", hint="view each alone"
        )
    for number, pair in enumerate(zip(*kinds, strict=True)):
        if "?" not in pair and pair[0] != pair[1]:
            names = [f"{kind} in {scene['title']}" for kind, scene in zip(pair, (first, second), strict=True)]
            raise InputError(f"joint {number + 1} is {' and '.join(names)}", hint="view each alone")
    other = {key: second[key] for key in _OF_OTHER if key in second}
    notes = [f"{second['title']}: {note}" for note in second["notes"]]
    findings = [f"{second['title']}: {one['label']} {one['message']}" for one in _worst(second)]
    return {
        **first,
        "other": {**other, "moves": second["moves"]},
        "notes": [*first["notes"], *findings, *notes],
    }


def _worst(scene: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [scene["findings"][cause[0]] for cause in scene["causes"]]


def _kind(joint: Mapping[str, Any]) -> str:
    unit = joint["units"][0]
    return "?" if " or " in unit else {"deg": "an angle", "rad": "an angle"}.get(unit, "a length")
