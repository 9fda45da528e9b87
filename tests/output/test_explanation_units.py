"""Numbers of `explain --json`: those of a job in mm and deg are those of the same job in SI, as their units say."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

import pytest
from tiers import few

from trajcli.job.explanation import Explanation
from trajcli.job.read import job_from_text
from trajcli.job.report import Report
from trajcli.job.report_parts import MeasuredIn, ReportPart
from trajcli.output.explain import explanation
from trajcli.output.report import report_of
from trajcli.planning.plan import plan_job

USER = {"deg": math.pi / 180, "mm": 1e-3}
SAME = {"deg": "rad", "mm": "m"}
PLAIN = {
    "gravity",  # m/s^2 in any units
    "gravity_share",
    *(
        "version",
        "index",
        "move",
        "start",
        "end",
        "duration",
        "stretch",
        "continuity",
        "used",
        "time",
        "seconds",
        "share",
        "saved",
        "low_time",
    ),
    *("high_time", "factor", "held", "ratio", "breaks", "origin", "here", "nearby", "candidates", "axis"),
    *("within_limits", "free_direction", "count"),
}
"""Times, ratios, counts and directions; `start` and `end` of a segment are points, and stand in lists."""

ARM = """\
robot: ur5e
limits: {acceleration: 800 deg/s^2, tcp: {speed: 250 mm/s, acceleration: 1500 mm/s^2, angular_speed: 90 deg/s,
  angular_acceleration: 500 deg/s^2}}
start: {xyz: [400 mm, 100 mm, 300 mm], rpy: [180 deg, 0 deg, 0 deg], configuration: {elbow: up}}
moves:
"""
PATHS = f"""{ARM}
  - {{planner: line, to: {{xyz: [400 mm, 200 mm, 300 mm]}}, law: {{speed: 120 mm/s}}}}
  - {{planner: line, to: {{rpy: [180 deg, 0 deg, 40 deg]}}, law: {{angular_speed: 20 deg/s}}}}
  - {{planner: screw, to: {{xyz: [420 mm, 200 mm, 280 mm], rpy: [180 deg, 0 deg, 70 deg]}}}}
  - {{planner: arc, center: [420 mm, 230 mm, 280 mm], axis: z, angle: 200 deg, pitch: 15 mm, law: {{speed: 80 mm/s}}}}
  - planner: path
    corner: round
    radius: 10 mm
    segments: [{{line: {{xyz: [420 mm, 150 mm, 300 mm]}}}}, {{line: {{xyz: [460 mm, 120 mm, 300 mm]}}}}]
    law: {{shape: time_optimal, speed: 200 mm/s}}
  - {{planner: jerk_limited, to: {{xyz: [400 mm, 100 mm, 300 mm], rpy: [180 deg, 0 deg, 0 deg]}}}}
"""
JOINTS = """\
robot: {joints: [{name: slide, type: prismatic}, {name: turn, type: revolute}]}
limits: {velocity: [100 mm/s, 20 deg/s], acceleration: [200 mm/s^2, 40 deg/s^2], jerk: null}
start: {joints: [0 mm, 0 deg]}
moves:
  - {planner: cycloidal, to: {joints: [100 mm, -40 deg]}, duration: 1}
  - {planner: trapezoid, to: {joints: [10 mm, -30 deg]}, synchronize: none}
  - planner: spline
    through: [{joints: [60 mm, 10 deg], time: 1}, {joints: [20 mm, 0 deg], time: 2}]
    to: {joints: [0 mm, 0 deg], time: 3}
  - planner: blends
    through: [{joints: [20 mm, 10 deg], time: 1}, {joints: [0 mm, 0 deg], time: 2}]
    blend_durations: 0.3
"""
JOBS = {
    "paths": PATHS.replace("jerk_limited", "quintic").replace(
        "rpy: [180 deg, 0 deg, 0 deg]}}", "rpy: [180 deg, 0 deg, 0 deg]}, duration: 2}"
    ),
    "joints": JOINTS,
}


def both(job: str) -> tuple[Any, Any]:
    """Return the explanation of a job in mm and deg, and of the same job in SI; its numbers carry their units."""
    texts = [f"version: 1\n{units}{job}" for units in ("units: {angle: deg, length: mm}\n", "")]
    plans = [plan_job(job_from_text(text)) for text in texts]
    user, si = (json.loads(explanation(plan, derivatives=True).model_dump_json()) for plan in plans)
    for part in polynomials_in(si):
        part["in_pi"] = None  # of jobs in rad alone
    return user, si


def polynomials_in(part: Any) -> Iterator[dict[str, Any]]:
    """Yield each polynomial of an explanation."""
    below = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    if isinstance(part, dict) and "absolute" in part:
        yield part
    for each in below:
        yield from polynomials_in(each)


def unit_of(part: dict[str, Any], key: str, count: int) -> list[str] | None:
    """Return the units of the numbers under a key of a part, one for each."""
    for name in (f"{key}_unit", f"{key.rsplit('_', maxsplit=1)[-1]}_unit", "unit"):
        if name in part:
            return [part[name]] * count
    return part.get("units")


def numbers(user: Any, si: Any, path: str = "") -> Iterator[tuple[str, float, float, str | None, str | None]]:
    """Yield path, number and unit in both of every number."""
    assert type(user) is type(si), path
    if isinstance(user, list):
        for k, (one, other) in enumerate(zip(user, si, strict=True)):
            yield from numbers(one, other, f"{path}[{k}]")
        return
    if not isinstance(user, dict):
        assert not isinstance(user, float), f"{path} has no unit beside it"
        return
    assert user.keys() == si.keys(), path
    for key, value in user.items():
        values, others = (each if isinstance(each, list) else [each] for each in (value, si[key]))
        if not any(isinstance(each, float | int) and not isinstance(each, bool) for each in values):
            yield from numbers(value, si[key], f"{path}.{key}")
            continue
        point = isinstance(value, list) and key in ("start", "end")
        plain = (key in PLAIN and not point) or path.endswith(".arrivals")
        units, si_units = (
            [None] * len(values) if plain else unit_of(p, key, len(values)) for p in (user, si)
        )
        assert units is not None, f"{path}.{key} has no unit beside it"
        assert si_units is not None
        for each in zip([f"{path}.{key}"] * len(values), values, others, units, si_units, strict=True):
            if each[1] is not None:
                yield each


@pytest.mark.parametrize("name", few(list(JOBS)[::-1], 1))
def test_every_number_is_in_the_units_of_the_job(name: str) -> None:
    user, si = both(JOBS[name])
    assert user["units"] == {"angle": "deg", "length": "mm", "time": "s"}
    seen = set()
    for path, value, other, unit, si_unit in numbers(user, si):
        seen.add(path.split(".")[-1])
        if unit is None or unit == "":
            assert value == pytest.approx(other, rel=1e-9, abs=1e-12), path
            continue
        head, slash, rate = unit.partition("/")
        assert head in USER, f"{path} is in {unit}"
        assert si_unit == SAME[head] + slash + rate, path
        assert value * USER[head] == pytest.approx(other, rel=1e-5, abs=1e-9), path
    expected = {
        "paths": "low high limit joints near point radius turn place angle pitch length advance center "
        "local absolute value bound wanted_speed deviation turned axis speed",
        "joints": "low high limit joints missed beyond local absolute value size unshifted velocity acceleration "
        "position coefficients",
    }
    assert set(expected[name].split()) <= seen


def test_rates_of_an_explanation_are_per_second() -> None:
    user, _ = both(JOINTS)
    for joint, unit in (("slide", "mm"), ("turn", "deg")):
        of_joint = [peak["unit"] for peak in user["moves"][0]["peaks"] if peak["joint"] == joint]
        assert of_joint == [unit, f"{unit}/s", f"{unit}/s^2", f"{unit}/s^3"]


def test_a_report_stays_in_si() -> None:
    """The report of a job in mm and deg is that of the same job in SI."""
    texts = [f"version: 1\n{units}{JOINTS}" for units in ("units: {angle: deg, length: mm}\n", "")]
    user, si = (json.loads(report_of(plan_job(job_from_text(text))).model_dump_json()) for text in texts)
    for report in (user, si):
        report["findings"] = [{**finding, "message": None} for finding in report["findings"]]
    assert user == si
    for joint, unit in (("slide", "m"), ("turn", "rad")):
        of_joint = [peak["unit"] for peak in user["moves"][0]["peaks"] if peak["joint"] == joint]
        assert of_joint == [unit, f"{unit}/s", f"{unit}/s^2", f"{unit}/s^3"]


def parts(kind: type[ReportPart] = ReportPart) -> Iterator[type[ReportPart]]:
    for part in kind.__subclasses__():
        yield part
        yield from parts(part)


def test_every_number_in_si_says_which_field_names_its_unit() -> None:
    reports = [part for part in parts() if part.__module__.startswith("trajcli.job")]
    assert {Report, Explanation} <= set(reports)
    fields = [(part, name, field) for part in reports for name, field in part.model_fields.items()]
    bare = [
        f"{part.__name__}.{name}"
        for part, name, field in fields
        if re.search(r"\bSI\b", field.description or "") and "float" in str(field.annotation)
        if not any(isinstance(each, MeasuredIn) for each in field.metadata)
    ]
    assert bare == []
