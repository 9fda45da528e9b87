"""The JSON Schemas: current, valid, and of one mind with the reader."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from jsonschema import Draft202012Validator
from random_mappings import jobs

from trajcli.catalogue.entries import catalogue_names, robot_file
from trajcli.cli.init import STARTER
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.job.schema import SchemaKind, schema_text
from trajcli.job.yaml.load import parse_document, read_document
from trajcli.planners import HANDLING, PLANNERS

ROOT = Path(__file__).parents[2]
JOBS = [*sorted((ROOT / "examples").glob("*.yaml")), STARTER]
ROBOTS = sorted((ROOT / "examples/robots").glob("*.yaml"))
KINDS: tuple[SchemaKind, ...] = get_args(SchemaKind)
COMMITTED = {kind: (ROOT / "schemas" / f"{kind}.schema.json").read_text(encoding="utf-8") for kind in KINDS}
VALIDATORS = {kind: Draft202012Validator(json.loads(text)) for kind, text in COMMITTED.items()}


def flaws(kind: SchemaKind, plain: Any) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in VALIDATORS[kind].iter_errors(plain)]


@pytest.mark.parametrize("kind", KINDS)
def test_committed_schemas_are_current(kind: SchemaKind) -> None:
    assert COMMITTED[kind] == schema_text(kind), "run `make schema`"


@pytest.mark.parametrize("kind", KINDS)
def test_schemas_are_valid(kind: SchemaKind) -> None:
    schema = json.loads(COMMITTED[kind], parse_constant=pytest.fail)  # NaN and infinity are no JSON
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    Draft202012Validator.check_schema(_once(schema, set()))


def _once(value: Any, seen: set[str]) -> Any:
    """Return a schema in which what stands in several places stands in the first alone: half as long to check."""
    if isinstance(value, list):
        return [_once(item, seen) for item in value]
    if not isinstance(value, dict):
        return value
    text = json.dumps(value)
    if text in seen:
        return {}
    seen.add(text)
    return {key: _once(item, seen) for key, item in value.items()}


@pytest.mark.parametrize("path", JOBS, ids=lambda path: path.stem)
def test_jobs_are_accepted(path: Path) -> None:
    assert flaws("job", read_document(str(path)).plain()) == []


@pytest.mark.parametrize("path", JOBS[:-1], ids=lambda path: path.stem)
def test_examples_name_their_schema_and_say_what_they_show(path: Path) -> None:
    first, second, *_ = path.read_text(encoding="utf-8").splitlines()
    assert first == "# yaml-language-server: $schema=../schemas/job.schema.json"
    assert second.startswith("# ")


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots_are_accepted(path: Path) -> None:
    assert flaws("robot", read_document(str(path)).plain()) == []


@pytest.mark.parametrize("name", catalogue_names())
def test_robots_of_the_catalogue_are_accepted(name: str) -> None:
    assert flaws("robot", parse_document(robot_file(name).encode(), name).plain()) == []


def test_there_is_an_example_for_each_planner() -> None:
    moves = [move for path in JOBS[:-1] for move in read_document(str(path)).plain()["moves"]]
    used = {move.get("planner") or next(iter(move)) for move in moves}
    assert used - {"repeat"} == {*PLANNERS, *HANDLING}


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(jobs())
def test_random_mappings_are_accepted_as_the_reader_does(plain: dict[str, Any]) -> None:
    loaded = job_from_text(json.dumps(plain, ensure_ascii=False))
    assert flaws("job", plain) == []

    assert flaws("job", parse_document(dump_job(loaded), "resolved").plain()) == []


ACCEPTED = [  # key, value
    (
        "moves",
        [{"planner": "jerk_limited", "to": {"joints": 1}, "approach": {"distance": 0.1, "zone": 0.02}}],
    ),
    (
        "moves",
        [{"planner": "jerk_limited", "to": {"joints": 1}, "retreat": {"distance": 0.1, "zone": "stop"}}],
    ),
    (
        "moves",
        [{"planner": "line", "to": {"xyz": [1, 0, 0]}, "approach": {"distance": 1, "zone": {"joints": 1}}}],
    ),
    ("zone", "stop"),
    ("zone", "20 mm"),
    ("zone", {"position": 0, "orientation": "3 deg"}),
    ("limits", {"acceleration": {"j1": [None, "2 rad/s^2"], "j2": [-1, None]}}),
    ("robot", {"joints": [{"position": [-1, None], "jerk": [None, None]}]}),
]


@pytest.mark.parametrize(("key", "value"), ACCEPTED)
def test_what_the_reader_takes_the_schema_accepts(key: str, value: Any) -> None:
    assert flaws("job", {**JOB, key: value}) == []


JOB: dict[str, Any] = {
    "version": 1,
    "robot": {"joints": 2},
    "start": {"joints": 0},
    "moves": [{"planner": "quintic", "to": {"joints": [1, 2]}, "duration": 3}],
}
MOVE = JOB["moves"][0]
WRONG = [
    {"version": 2},
    {"verson": 1},
    {"units": {"angle": "degrees"}},
    {"units": None},
    {"robot": 4},
    {"robot": {"joints": 13}},
    {"robot": {"joints": 0}},
    {"robot": {"joints": [{"typ": "prismatic"}]}},
    {"robot": {"joints": [{"velocity": 0}]}},
    {"robot": {"joints": [{"sign": 2}]}},
    {"robot": {"joints": [{"velocity": [1, 2, 3]}]}},
    {"robot": {"joints": 2, "base": {"xyz": [1, 2]}}},
    {"robot": {"joints": 2, "base": {"euler": {"sequence": "ABC", "angles": [1, 2, 3]}}}},
    {"robot": {"file": "x", "tool": {}}},
    {"start": [0, 0]},
    {"start": None},
    {"start": {"joints": True}},
    {"start": {"joints": [None, 1]}},
    {"start": {"joints": ["fast", 1]}},
    {"start": {"jonts": 1}},
    {"zone": {}},
    {"zone": {"radius": 1}},
    {"zone": "here"},
    {"zone": -1},
    {"moves": []},
    {"moves": {}},
    {"moves": [{**MOVE, "planner": "quintc"}]},
    {"moves": [{"to": {"joints": 1}}]},
    {"moves": [{**MOVE, "duration": 0}]},
    {"moves": [{**MOVE, "duration": -1}]},
    {"moves": [{**MOVE, "duration": None}]},
    {"moves": [{**MOVE, "duration": [1]}]},
    {"moves": [{**MOVE, "speed": 1}]},
    {"moves": [{**MOVE, "when_over_limit": "stop"}]},
    {"moves": [{"planner": "quintic", "duration": 1}]},
    {"moves": [{"planner": "hold"}]},
    {"moves": [{"planner": "hold", "duration": 1, "to": "x"}]},
    {"moves": [{"planner": "trapezoid", "to": {"joints": 1}, "velocity": 0}]},
    {"moves": [{"planner": "trapezoid", "to": {"joints": 1}, "overshoot": 2}]},
    {"moves": [{"planner": "jerk_limited", "to": {"joints": 1}, "synchronize": "both"}]},
    {"limits": {"velocty": 1}},
    {"limits": {"velocity": -1}},
    {"limits": {"velocity": True}},
    {"limits": {"scale": {"velocity": 1.5}}},
    {"limits": {"scale": {"velocity": 0}}},
    {"output": {"rate": 0}},
    {"output": {"columns": ["t", "pos"]}},
    {"output": {"columns": []}},
    {"output": {"times": []}},
    {"output": {"align": "yes"}},
    {"output": {"align": 1}},
    {"version": True},
    {"version": "1"},
    {"robot": {"joints": [{"sign": True}]}},
    {"robot": {"joints": [{"name": 1}]}},
    {"robot": {"joints": True}},
    {"name": True},
    {"output": {"times": [True]}},
    {"when_over_limit": "never"},
    {"points": {"a": [1, 2]}},
]


@pytest.mark.parametrize("change", WRONG, ids=str)
def test_wrong_jobs_are_refused_by_schema_and_reader(change: dict[str, Any]) -> None:
    from trajcli.errors import InputError

    assert flaws("job", JOB) == []
    plain = {**JOB, **change}
    assert flaws("job", plain)
    with pytest.raises(InputError):
        job_from_text(json.dumps(plain))


GOOD = {
    "duration": ("moves", 0, "duration"),
    "joints": ("start", "joints"),
    "velocity": ("start", "velocity"),
    "limit": ("limits", "velocity", "j2"),
    "range": ("limits", "position", "j2", 1),
    "rate": ("output", "rate"),
    "start_time": ("output", "start_time"),
    "xyz": ("points", "p", "xyz", 0),
    "angle": ("points", "p", "euler", "angles", 1),
    "a": ("robot", "joints", 1, "a"),
    "theta": ("robot", "joints", 0, "theta"),
    "jerk": ("robot", "joints", 0, "jerk"),
    "tcp": ("limits", "tcp", "speed"),
    "tool": ("tool", "xyz", 2),
    "quaternion": ("tool", "quat_wxyz", 0),
    "time": ("moves", 1, "through", 0, "time"),
}
"""Where a number stands in the job below."""
FAR = {
    "duration": (1.01e12, -1.01e12, 0.99e-12),
    "joints": (1.01e15, -1.01e15),
    "velocity": (1.01e33, -1.01e33),
    "limit": (1.01e33, 0.99e-12),
    "range": (1.01e15,),
    "rate": (1.01e12, 0.99e-12),
    "start_time": (1.01e12, -1.01e12),
    "xyz": (1.01e15, -1.01e15),
    "angle": (5.74e13, -5.74e13),
    "a": (1.01e15, -1.01e15),
    "theta": (5.74e13, -5.74e13),
    "jerk": (1.01e33, 0.99e-12),
    "tcp": (1.01e33, 0.99e-12),
    "tool": (1.01e15,),
    "quaternion": (1.01e12,),
    "time": (1.01e12, 0.99e-12),
}
"""Beyond what the reader takes in the units that allow most."""
NEAR = {
    "duration": (0.99e12, 1.01e-12),
    "joints": (0.99e12,),
    "velocity": (0.99e30,),
    "limit": (0.99e33, 1.01e-9),
    "range": (0.99e15,),
    "rate": (1.01e-12,),
    "start_time": (0.99e12, -0.99e12),
    "angle": (5.72e13, -5.72e13),
    "a": (0.99e15, -0.99e15),
    "theta": (5.72e13,),
    "jerk": (5.72e31, 5.74e-11),
    "tcp": (0.99e33, 1.01e-9),
    "tool": (0.99e15,),
}
"""Within it, in a job in degrees and millimetres whose second joint slides."""


def _with(number: Any, *path: Any) -> dict[str, Any]:
    """A job in deg and mm with another number at a path."""
    job: dict[str, Any] = {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "robot": {
            "convention": "standard",
            "joints": [{"theta": 0, "jerk": 9}, {"type": "prismatic", "a": 1, "position": [0, 1]}],
        },
        "tool": {"xyz": [0, 0, 1], "quat_wxyz": [1, 0, 0, 0]},
        "limits": {"velocity": {"j2": 5}, "position": {"j2": [-5, 5]}, "tcp": {"speed": 5}},
        "points": {"p": {"xyz": [1, 0, 0], "euler": {"sequence": "ZYZ", "angles": [0, 1, 2]}}},
        "start": {"joints": 0, "velocity": 0},
        "moves": [
            {"planner": "quintic", "to": {"joints": [1, 2]}, "duration": 3},
            {"planner": "spline", "through": [{"joints": 1, "time": 0.5}]},
        ],
        "output": {"rate": 100, "start_time": 0},
    }
    node: Any = job
    for step in path[:-1]:
        node = node[step]
    assert path[-1] in node if isinstance(node, dict) else len(node) > path[-1]
    node[path[-1]] = number
    return job


@pytest.mark.parametrize("name", GOOD)
def test_numbers_that_no_robot_has_are_refused_by_schema_and_reader(name: str) -> None:
    from trajcli.errors import InputError

    for far in FAR[name]:
        plain = _with(far, *GOOD[name])
        assert flaws("job", plain), far
        with pytest.raises(InputError):
            job_from_text(json.dumps(plain))


@pytest.mark.parametrize("name", NEAR)
def test_numbers_within_the_bounds_are_accepted_by_schema_and_reader(name: str) -> None:
    for near in NEAR[name]:
        plain = _with(near, *GOOD[name])
        assert flaws("job", plain) == [], near
        job_from_text(json.dumps(plain))


def _described(schema: Any, path: str = "") -> list[str]:
    """The properties without a description, of the schema or of what they refer to."""
    lacking = []
    for name, field in schema.get("properties", {}).items():
        told = (
            "description" in field
            or "$ref" in field
            or any("$ref" in form for form in field.get("anyOf", []))
        )
        if not told and "const" not in field:
            lacking.append(f"{path}.{name}")
    return lacking


@pytest.mark.parametrize("kind", ["job", "robot"])
def test_every_field_is_described(kind: SchemaKind) -> None:
    schema = VALIDATORS[kind].schema
    parts = {"": schema, **schema["$defs"]}
    assert [lack for name, part in parts.items() for lack in _described(part, name)] == []


@pytest.mark.parametrize("text", [" 3 s", "\t3s", "3 s "])
def test_spaces_about_a_number_are_accepted_by_schema_and_reader(text: str) -> None:
    plain = _with(text, *GOOD["duration"])
    assert flaws("job", plain) == []
    assert job_from_text(json.dumps(plain)).job.moves[0].duration == 3
