"""Messages: amounts are filled in once, and what the user wrote is text whatever it looks like.

The oracle of a refusal is the same refusal of the same job with harmless names, and these replaced in its words.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from tiers import few

from trajcli.cli.frames import problem_as_json, render_problem
from trajcli.errors import Amount, Place, Problem, TrajcliError, said
from trajcli.job.dump import robot_as_mapping
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.output.report import report_of, verification_error
from trajcli.planning.plan import plan_job

ROOT = Path(__file__).parents[1]
AWKWARD = [
    "{limit}",
    "{value}",
    "{before}",
    "{{x}}",
    "%s",
    "{joint}",
    "{context3}",
    "{0}",
    "{",
    "\\1",
    r"\g<0>",
]
LIMITS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 5.0}
TCP = {"speed": 0.25, "acceleration": 2.0, "angular_speed": 1.5, "angular_acceleration": 12.0}
DOWN = [3.0, 0, 0]
START = {
    "xyz": [0.4, 0.1, 0.05],
    "rpy": DOWN,
    "configuration": {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
}
FAR = {"xyz": [2.4, 0.3, 0.25], "rpy": DOWN}
REST = {"joints": [0, 0]}
TIMED = [{"joints": [1, 1], "time": 1}, {"joints": [0, 3], "time": 2}]


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"joints": list(joints), **fields}


JOBS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "limit": (REST, {"planner": "quintic", "to": to(1, 2), "duration": 0.5}),
    "jump": (REST, {"planner": "cubic", "to": to(1, 2), "duration": 9}),
    "slowed": (
        REST,
        {"planner": "quintic", "to": to(1, 2), "duration": 0.5, "when_over_limit": "slow"},
    ),
    "looser": (REST, {"planner": "quintic", "to": to(1, 2), "duration": 9, "limits": {"velocity": 7}}),
    "not at rest": (
        to(0, 0, velocity=[0.5, 0]),
        {"planner": "cycloidal", "to": to(1, 2), "duration": 5},
    ),
    "trapezoid": (REST, {"planner": "trapezoid", "to": to(1, 2), "duration": 1, "velocity": 0.5}),
    "straight line": (to(0, 0, velocity=[0.5, 0]), {"planner": "trapezoid", "to": to(1, 2)}),
    "waits": (
        REST,
        {"planner": "trapezoid", "to": to(0.1, 2, velocity=[0.1, 0]), "synchronize": "none"},
    ),
    "too fast at the end": (REST, {"planner": "jerk_limited", "to": to(1, 2, velocity=[1.5, 0])}),
    "approach": (
        REST,
        {"planner": "jerk_limited", "to": to(1, 2, velocity=[0.9, 0], acceleration=[-1.5, 0])},
    ),
    "phase": (
        REST,
        {"planner": "jerk_limited", "to": to(1, 2, velocity=[0.5, 0]), "synchronize": "phase"},
    ),
    "monotone": (
        REST,
        {
            "planner": "spline",
            "rule": "shape_preserving",
            "through": [TIMED[0], to(2, 4, time=2, velocity=[9, 0])],
        },
    ),
    "polyline": (
        REST,
        {"planner": "time_optimal", "path": "polyline", "through": [to(1, 1), to(2, 4, velocity=0.1)]},
    ),
    "blend": (
        REST,
        {"planner": "blends", "through": TIMED, "acceleration": 0.1, "end_blends": "inside"},
    ),
    "shrunk": (REST, {"planner": "blends", "through": TIMED, "blend_durations": 5}),
    "points": (START, {"planner": "spline", "through": ["PoInT", to(1, -1, 1, 0, 1, 0)]}),
    "looser in the job": (REST, {"planner": "quintic", "to": to(1, 2), "duration": 9}),
    "out of reach": (START, {"planner": "line", "to": {"xyz": [2.4, 0.3, 0.25]}}),
    "singularity": (START, {"planner": "line", "to": {"xyz": [-0.4, -0.1, 0.05]}}),
    "arrival": (START, {"planner": "line", "to": to(1, -1, 1, 0, 1, 0)}),
    "pose": (START, {"planner": "quintic", "to": {"xyz": [0.9, 0.8, 0.25], "rpy": DOWN}, "duration": 4}),
}


SEARCHING = ("out of reach", "singularity")  # for seconds
SLOW = (
    "arrival",
    "pose",
    "points",
)  # an arm of six joints is read, and searches
PLAIN = {
    "Jo0Nt": "{}",
    "RoBot": "{}",
    "PoInT": "{}",
    **{f"Jo{joint}Nt": f"Jo{joint}Nt{{}}" for joint in range(1, 6)},
}
"""Harmless names, and how each is replaced: of awkward ones only the first can stand alone."""


def renamed(text: str, awkward: str) -> str:
    for plain, form in PLAIN.items():
        text = text.replace(plain, form.replace("{}", awkward))
    return text


def job_of(case: str) -> str:
    """Return the job of a case, with harmless names."""
    start, move = JOBS[case]
    if "xyz" in start:
        robot = robot_as_mapping(load_robot("ur5e"))
        for joint, entry in enumerate(robot["joints"]):
            entry["name"] = f"Jo{joint}Nt"
        limits: dict[str, Any] = {"velocity": 6.0, "acceleration": 100.0, "jerk": None, "tcp": TCP}
    else:
        robot = {"joints": [{"name": f"Jo{joint}Nt", **LIMITS} for joint in range(2)]}
        limits = {"velocity": 3.0} if case == "looser in the job" else {}
    job = {"version": 1, "robot": {**robot, "name": "RoBot"}, "start": start, "moves": [move]}
    return json.dumps({**job, "limits": limits, "points": {"PoInT": FAR} if "xyz" in start else {}})


@cache
def plain_words(case: str) -> list[str]:
    return words_of(job_of(case))


def words_of(job: str) -> list[str]:
    """Return all that a job makes the house say: of errors, events and findings, as text and as JSON."""
    problems, events = [], []
    try:
        plan = plan_job(job_from_text(job))
    except TrajcliError as error:
        problems = [replace(problem, place=None) for problem in error.problems]
    else:
        events = [event.message for event in report_of(plan).events]
        if not plan.verdict.passed:
            problems = [replace(problem, place=None) for problem in verification_error(plan).problems]
    assert problems or events
    mappings = [problem_as_json(problem) for problem in problems]
    texts = [text[key] or "" for text in mappings for key in ("message", "hint", "joint")]
    return [*events, *(render_problem(problem, color=False) for problem in problems), *texts]


@pytest.mark.parametrize(
    ("case", "name"),
    [
        (case, name)
        for case in JOBS
        for name in few(AWKWARD, 0 if case in SEARCHING else 1 if case in SLOW else 3)
    ],
)
def test_names_of_joints_and_robots_are_text(case: str, name: str) -> None:
    expected = [renamed(text, name) for text in plain_words(case)]
    assert any(name in text for text in expected), expected
    assert words_of(renamed(job_of(case), json.dumps(name)[1:-1])) == expected


def test_amounts_are_filled_in_once() -> None:
    amounts = {"joint": "{value}", "value": Amount(2.0, 1, 0), "limit": Amount(1.0, 1, 0)}
    assert said("{joint} has {value}, at most {limit}; {other} {}", amounts) == (
        "{value} has 2, at most 1; {other} {}"
    )
    assert said("{joint} has {value}", amounts, lambda amount: "{joint}") == "{value} has {joint}"
    assert said("{value}", {}) == "{value}"


def test_contexts_add_up_and_are_text() -> None:
    literal = Problem("the point {context0} is missing").within("{limit}")
    assert literal.text() == "{limit}: the point {context0} is missing"
    template = Problem("{joint} has {value}", amounts={"joint": "{value}", "value": Amount(2.0)})
    assert template.within("{value}").within("{joint}").text() == "{joint}: {value}: {value} has 2"


def kinds_of_errors() -> list[type[TrajcliError]]:
    """Return every class of errors that the package has."""
    found = []
    for file in sorted((ROOT / "trajcli").rglob("*.py")):
        for name in re.findall(r"^class (\w+)\(\w*Error\):", file.read_text(encoding="utf-8"), re.MULTILINE):
            kind = getattr(import_module(".".join(file.relative_to(ROOT).with_suffix("").parts)), name)
            found += [kind] if issubclass(kind, TrajcliError) else []
    return [TrajcliError, *found]


MADE_FROM: dict[str, Callable[[type[Any]], Any]] = {
    "StandstillError": lambda kind: kind(0.25),
    "NoLawError": lambda kind: kind("too fast", {1: 0.5}),
}


@pytest.mark.parametrize("kind", kinds_of_errors(), ids=lambda kind: kind.__name__)
def test_an_error_that_is_located_and_said_is_the_same_one(kind: type[TrajcliError]) -> None:
    """Whatever its class is made from: what it knows stays, its place is added, its numbers get their units."""
    made = MADE_FROM.get(kind.__name__, lambda kind: kind("one thing"))(kind)
    before, place = made.__dict__.copy(), Place("job.yaml", 3, 5)
    for other in (made.located(place=place), made.said_by(str), made.located(place=place).said_by(str)):
        assert type(other) is kind
        assert (other.exit_code, str(other)) == (made.exit_code, str(made))
        assert other.args == other.problems
        assert other.__dict__.keys() == before.keys()
        assert all(other.__dict__[key] == before[key] for key in before.keys() - {"problems"})
    assert [problem.place for problem in made.located(place=place).problems] == [place]
    assert [problem.place for problem in made.problems] == [None]
