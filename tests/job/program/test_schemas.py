"""Schemas of rounds, calls, grids, straight parts and relative states, of one mind with the reader."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from trajcli.catalogue.entries import catalogue_names
from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.job.schema import SchemaKind, schema_of
from trajcli.planners import PLANNERS

MOVE = {"planner": "jerk_limited", "to": "b"}
LINE = {"planner": "line", "to": "b"}
JOB: dict[str, Any] = {
    "version": 1,
    "robot": "ur5e",
    "limits": {"acceleration": 5, "jerk": 50},
    "points": {
        "a": {"xyz": [0.4, 0.1, 0.3], "rpy": [3, 0, 0], "configuration": {"elbow": "up"}},
        "b": {"xyz": [0.4, 0.2, 0.3], "rpy": [3, 0, 0]},
        "slots": {"grid": {"from": "b", "steps": [{"count": 2, "xyz": [0.01, 0, 0]}]}},
        "both": ["a", "b"],
    },
    "sequences": {"there": [MOVE]},
    "start": "a",
    "moves": [MOVE],
}


@cache
def validator(kind: SchemaKind) -> Draft202012Validator:
    return Draft202012Validator(schema_of(kind))


def agreed(change: dict[str, Any]) -> bool:
    """Return whether a job with a change is right, on which schema and reader agree."""
    plain = json.loads(json.dumps({**JOB, **change}))
    accepted = validator("job").is_valid(plain)
    try:
        job_from_text(json.dumps(plain))
    except InputError:
        assert not accepted, "the schema accepts it, the reader does not"
        return False
    assert accepted, "the reader accepts it, the schema does not"
    return True


def moves(*entries: Any) -> dict[str, Any]:
    return {"moves": list(entries)}


def points(**named: Any) -> dict[str, Any]:
    return {"points": {**JOB["points"], **named}}


def straight(**fields: Any) -> dict[str, Any]:
    return moves({**MOVE, "approach": {"distance": 0.1, **fields}})


def grid(*steps: Any, **fields: Any) -> dict[str, Any]:
    return points(more={"grid": {"from": "b", "steps": list(steps), **fields}})


STEP = {"count": 1, "xyz": [0.01, 0, 0]}


@pytest.mark.parametrize(
    "change",
    [
        {},
        moves({"repeat": 1, "moves": [MOVE]}),
        moves({"repeat": 3, "moves": [{"repeat": 2, "moves": [MOVE], "label": "layers"}]}),
        moves({"repeat": "slots", "moves": [{**MOVE, "to": "slots"}]}),
        moves({"repeat": ["slots", "both"], "moves": [{**MOVE, "to": "slots"}]}),
        moves({"call": "there", "label": "x" * 200}),
        moves({**MOVE, "approach": 0.1, "retreat": "10 mm"}),
        moves({"planner": "hold", "duration": 1, "retreat": 0.1}),
        *(straight(axis=axis) for axis in ("x", "-x", "y", "-y", "z", "-z", [0, 1, 1])),
        straight(frame="world", zone=0.01, law={"speed": 0.1}),
        grid(STEP, {"count": 7, "xyz": ["1 mm", 0, 0]}, frame="world"),
        points(more=["a", "b"]),
        moves({**MOVE, "to": {"from": "b", "offset": {"xyz": [0, 0, 0.1]}, "frame": "world"}}),
        moves({**MOVE, "to": {"from": "here", "offset": {"xyz": [0, 0, 0.01]}, "velocity": 0}}),
        moves({"planner": "spline", "through": [{"from": "b", "time": 1}], "to": {"from": "b", "time": 2}}),
        {
            "robot": {
                "rail": {"axis": [1, 0, 0], "velocity": 1, "acceleration": 2, "jerk": 9},
                "arm": "ur5e",
            },
            "start": {"joints": 0},
            **moves({"planner": "hold", "duration": 1}),
        },
    ],
    ids=str,
)
def test_what_is_right(change: dict[str, Any]) -> None:
    assert agreed(change)


@pytest.mark.parametrize(
    "change",
    [
        moves({"repeat": 0, "moves": [MOVE]}),
        moves({"repeat": 1.5, "moves": [MOVE]}),
        moves({"repeat": "", "moves": [MOVE]}),
        moves({"repeat": [], "moves": [MOVE]}),
        moves({"repeat": ["slots", "slots"], "moves": [MOVE]}),
        moves({"repeat": 2}),
        moves({"moves": [MOVE]}),
        moves({"repeat": 2, "moves": []}),
        moves({"repeat": 2, "moves": [{"planner": "quintc"}]}),
        moves({"repeat": 2, "moves": [MOVE], "times": 3}),
        moves({"repeat": 2, "moves": [MOVE], "label": ""}),
        moves({"repeat": 2, "moves": [MOVE], "label": "x" * 201}),
        moves({"call": "there", "label": ""}),
        moves({"call": ""}),
        moves({"call": "there", "with": 1}),
        moves({**MOVE, "approach": 0}),
        moves({**MOVE, "approach": -0.1}),
        moves({**MOVE, "retreat": {}}),
        moves({"planner": "hold", "duration": 1, "approach": 0.1}),
        *(straight(axis=axis) for axis in ("w", "+z", [0, 1], [0, 1, 0, 0], [0, "up", 1])),
        straight(distance=0),
        straight(frame=""),
        straight(law={"sped": 1}),
        straight(zone=-1),
        straight(speed=1),
        grid(),
        grid({**STEP, "count": 0}),
        grid({"count": 2}),
        grid({"xyz": [1, 0, 0]}),
        grid({**STEP, "xyz": [1, 0]}),
        grid({**STEP, "xyz": [1, 0, 0, 0]}),
        grid({**STEP, "rpy": [1, 0, 0]}),
        grid(STEP, frame=""),
        grid(STEP, order="rows"),
        points(more={"grid": {"steps": [STEP]}}),
        points(more={"grid": {"from": "b"}}),
        points(more=[]),
        points(more=["a", "a"]),
        moves({**MOVE, "to": {"offset": {"xyz": [0, 0, 0.1]}}}),
        moves({**MOVE, "to": {"from": "b", "xyz": [0, 0, 1]}}),
        moves({**MOVE, "to": {"from": "b", "blend": 1}}),
        moves({"planner": "waypoints", "through": ["a"], "to": "b", "starts": True}),
        moves({"planner": "waypoints", "through": ["a"], "to": "b", "starts": 9}),
        {"robot": "ur5f"},
        {"robot": {"rail": {"axis": [1, 0, 0]}, "arm": "ur5f"}},
    ],
    ids=lambda change: str(change)[:120],
)
def test_what_is_wrong(change: dict[str, Any]) -> None:
    assert not agreed(change)


def test_a_move_says_what_it_is_where_an_editor_shows_it() -> None:
    """Its description stands at `planner`, and approach and retreat are fields of it; who goes nowhere has no approach."""
    schema = schema_of("job")
    kinds = {
        node["properties"]["planner"]["const"]: node
        for node in schema["$defs"].values()
        if "const" in node.get("properties", {}).get("planner", {})
    }
    assert kinds.keys() == {*PLANNERS}
    for node in kinds.values():
        shown = node["properties"]["planner"]["description"]
        assert shown
        assert "\n" not in shown
        assert " ".join(node["description"].split()).startswith(shown)
        assert "Before it" in node["properties"]["retreat"]["description"]
        assert ("approach" in node["properties"]) == ("to" in node["properties"])
    assert "straight to it" in kinds["line"]["properties"]["approach"]["description"]


def test_the_robots_of_the_catalogue_can_be_chosen() -> None:
    text = json.dumps(schema_of("job"))
    (names,) = {tuple(node["enum"]) for node in nodes(schema_of("job")) if "ur5e" in node.get("enum", ())}
    assert list(names) == catalogue_names()
    assert "$comment" not in text


def nodes(node: Any) -> Any:
    """Yield every mapping of a schema."""
    if isinstance(node, dict):
        yield node
    for each in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from nodes(each)


@pytest.mark.parametrize("kind", ["job", "robot", "report", "explanation"])
def test_a_schema_has_one_title_that_says_what_it_is_of(kind: SchemaKind) -> None:
    schema = schema_of(kind)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert kind in schema["title"]
    assert [node["title"] for node in nodes(schema) if isinstance(node.get("title"), str)] == [
        schema["title"]
    ]


@pytest.mark.parametrize("kind", ["job", "robot"])
def test_what_a_file_may_leave_out_has_no_default_of_null(kind: SchemaKind) -> None:
    assert all(node.get("default", ...) not in (None, [], [None, None]) for node in nodes(schema_of(kind)))
