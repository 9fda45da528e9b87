"""Efforts and payloads in jobs: what is read, what is in force, and what is refused at its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.planning.plan import plan_job

JOB = """
version: 1
units: {angle: deg, length: mm}
robot:
  name: arm
  convention: standard
  joints:
    - {name: a, a: 500, velocity: 90, acceleration: 300, effort: 60, link: {mass: 4, com: [-250, 0, 0], inertia: [0.01, 0.1, 0.1, 0, 0, 0]}}
    - {name: b, a: 400, velocity: 90, acceleration: 300, effort: [-20, 25], link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}}
gravity: [0, -9.81, 0]
limits: {}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [9, 20]}}
  - {attach: {mass: 1.2, com: [0, 0, 60]}}
  - {planner: quintic, to: {joints: [0, 90]}, limits: {}}
  - {detach: {}}
  - {planner: quintic, to: {joints: [0, -90]}}
"""


def changed(*changes: tuple[str, str]) -> LoadedJob:
    """Return the job with some text replaced."""
    text = JOB
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return job_from_text(text)


def test_efforts_that_stand_in_the_job_are_in_force_in_si() -> None:
    loaded = changed()
    assert loaded.robot.limits.effort.tolist() == [[-60, 60], [-20, 25]]
    assert loaded.robot.gravity.tolist() == [0, -9.81, 0]  # m/s^2 although lengths are in mm
    assert loaded.events == ()


@pytest.mark.parametrize(
    ("written", "bounds"),
    [
        ("7", [[-7, 7], [-7, 7]]),
        ("[7, [-3, 4]]", [[-7, 7], [-3, 4]]),
        ("{b: 7}", [[-60, 60], [-7, 7]]),
        ("{b: [-1, 2]}", [[-60, 60], [-1, 2]]),
        ('{b: "0.007 kN m"}', [[-60, 60], [-7, 7]]),
        ("robot", [[-60, 60], [-20, 25]]),
        ("null", [[-np.inf, np.inf]] * 2),
    ],
)
def test_limits_replace_the_efforts_of_the_robot(written: str, bounds: list[list[float]]) -> None:
    loaded = changed(("limits: {}", f"limits: {{effort: {written}}}"))
    assert loaded.robot.limits.effort.tolist() == bounds
    assert loaded.events == ()  # none is looser, and null is told by the report


def test_a_looser_effort_is_an_event() -> None:
    (event,) = changed(("limits: {}", "limits: {effort: {a: 61}}")).events
    assert event.kind == "looser_limit"
    assert event.text() == "the job's effort limit of a is looser than the robot's: 61 N m instead of 60 N m"


def test_efforts_of_links_without_inertia_are_not_in_force_unless_asked_for() -> None:
    bare = (", link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}", "")
    assert not changed(bare).robot.limits.has_effort
    for asked in ("robot", "{a: 3}"):
        with pytest.raises(InputError, match="has none behind joint b") as refused:
            changed(bare, ("limits: {}", f"limits: {{effort: {asked}}}"))
        (problem,) = refused.value.problems
        assert problem.place is not None
        assert problem.place.line == JOB[: JOB.index("limits: {}")].count("\n") + 1
    with pytest.raises(InputError, match="has none behind joint b"):
        changed(bare, ("limits: {}}", "limits: {effort: {b: 3}}}"))
    assert not changed(bare, ("limits: {}", "limits: {effort: null}")).robot.limits.has_effort


def test_efforts_of_the_catalogue_and_of_a_urdf_count_when_asked_for(tmp_path: Path) -> None:
    head = "version: 1\nstart: {joints: 0}\nmoves: [{planner: hold, duration: 1}]\n"
    urdf = """<robot name="r"><link name="w"/><link name="l"><inertial><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
    <joint name="a" type="revolute"><parent link="w"/><child link="l"/><axis xyz="0 0 1"/>
    <limit effort="9" velocity="1" lower="-1" upper="1"/></joint></robot>"""
    (tmp_path / "r.urdf").write_text(urdf)
    job = tmp_path / "job.yaml"
    job.write_text(head + "robot: {urdf: r.urdf}\n")
    assert not load_job(job).robot.limits.has_effort
    job.write_text(head + "robot: {urdf: r.urdf}\nlimits: {effort: robot}\n")
    loaded = load_job(job)
    assert loaded.robot.limits.effort.tolist() == [[-9, 9]]
    assert job_from_text(dump_job(loaded)).robot.limits.effort.tolist() == [[-9, 9]]
    job.write_text(head + "robot: {urdf: r.urdf}\nlimits: {effort: 10}\n")
    assert [event.kind for event in load_job(job).events] == ["looser_limit"]


def test_a_robot_without_efforts_has_none_to_take() -> None:
    with pytest.raises(InputError, match="arm states no efforts"):
        changed((" effort: 60,", ""), (" effort: [-20, 25],", ""), ("limits: {}", "limits: {effort: robot}"))


@pytest.mark.parametrize("written", ["{b: 21}", "70", "null", "{a: null}"])
def test_a_move_can_only_tighten_efforts(written: str) -> None:
    with pytest.raises(InputError, match="a move can only tighten limits: the effort limit of"):
        changed(("limits: {}}", f"limits: {{effort: {written}}}}}"))


def test_each_move_has_its_efforts_and_what_the_tool_carries() -> None:
    loaded = changed(("limits: {}}", "limits: {effort: {b: 19}}}"))
    plan = plan_job(loaded)
    assert [move.index for move in plan.moves] == [0, 1, 2, 3, 4]
    assert [span.planner for span in plan.trajectory.spans][1::2] == ["attach", "detach"]
    carried = [None if span.payload is None else span.payload.mass for span in plan.trajectory.spans]
    assert carried == [None, 1.2, 1.2, None, None]
    assert [move.robot.payload for move in plan.moves] == [span.payload for span in plan.trajectory.spans]
    payload = plan.moves[2].robot.payload
    assert payload is not None
    assert payload.com.tolist() == [0, 0, 0.06]
    assert not payload.inertia.any()
    assert plan.moves[2].robot.limits.effort.tolist() == [[-60, 60], [-19, 19]]
    assert plan.moves[4].robot.limits.effort.tolist() == [[-60, 60], [-20, 25]]


def test_what_the_tool_takes_up_and_leaves_takes_no_time() -> None:
    attach, detach = ("  - {attach: {mass: 1.2, com: [0, 0, 60]}}\n", ""), ("  - {detach: {}}\n", "")
    free = ("limits: {}", "limits: {effort: null}")
    with_both, without = (
        plan_job(loaded).trajectory for loaded in (changed(free), changed(free, attach, detach))
    )
    assert with_both.duration == without.duration
    assert np.array_equal(with_both.curve.coefficients, without.curve.coefficients)
    zero = [span.duration for span in with_both.spans]
    assert (zero[1], zero[3]) == (0, 0)


def test_a_payload_is_taken_up_in_motion_and_before_the_first_move() -> None:
    text = JOB.replace("to: {joints: [9, 20]}}", "to: {joints: [9, 20], velocity: [5, -5]}}")
    plan = plan_job(job_from_text(text))
    assert plan.moves[2].start.velocity == pytest.approx(np.radians([5, -5]))
    first = JOB.replace("moves:\n", "moves:\n  - {attach: {mass: 2}}\n  - {detach: {}}\n")
    assert plan_job(job_from_text(first)).trajectory.spans[2].payload is None


def test_a_resolved_job_has_its_payloads_and_efforts() -> None:
    loaded = changed(
        ("limits: {}", "limits: {effort: {a: null}}"),
        ("mass: 1.2,", "mass: 1.2, inertia: [1, 1, 1, 0, 0, 0],"),
    )
    again = job_from_text(dump_job(loaded))
    assert again.robot.limits.effort.tolist() == loaded.robot.limits.effort.tolist()
    assert again.robot.gravity.tolist() == loaded.robot.gravity.tolist()
    assert again.job.moves == loaded.job.moves
    assert again.events == ()
    assert dump_job(again) == dump_job(loaded)


ATTACH = "{attach: {mass: 1.2, com: [0, 0, 60]}}"


@pytest.mark.parametrize(
    ("old", "new", "message", "at"),
    [
        (ATTACH, "{attach: {mass: -1}}", "expected a number at least 0 kg, got -1", "-1}}"),
        (ATTACH, "{attach: {}}", "`mass` is missing", "{}}"),
        (ATTACH, "{attach: 3}", "expected a mapping, got 3", "3}"),
        (ATTACH, "{attach: {mass: 1, com: [1, 2]}}", "expected 3 numbers, got 2 values", "[1, 2]"),
        (ATTACH, "{attach: {mass: 1, inertia: [1, 1]}}", "expected 6 numbers, got 2 values", "[1, 1]"),
        (ATTACH, "{attach: {mass: 1, inertia: [1, 1, -1, 0, 0, 0]}}", "negative moment", "[1, 1, -1"),
        (ATTACH, "{attach: {mass: 1, inertia: [1, 1, 2.1, 0, 0, 0]}}", "above the sum", "[1, 1, 2"),
        (ATTACH, "{attach: {mass: 0, inertia: [1, 1, 1, 0, 0, 0]}}", "nothing without mass", "[1, 1, 1"),
        (ATTACH, "{attach: {mass: 1, mss: 2}}", "unknown key 'mss'", "mss"),
        (ATTACH, "{attach: {mass: 1}, limits: {}}", "unknown key 'limits'", "limits: {}}\n  - {pl"),
        (ATTACH, "{atach: {mass: 1}}", "a move needs `planner`", "{atach"),
        (ATTACH, "{detach: {}}", "nothing is attached here", "{}}\n  - {pl"),
        ("{detach: {}}", "{attach: {mass: 2}}", "the tool carries 1.2 kg already", "{mass: 2}"),
        ("{detach: {}}", "{detach: {mass: 2}}", "unknown key 'mass'", "mass: 2}}\n  - {planner"),
        ("gravity: [0, -9.81, 0]", "gravity: [0, -9.81]", "expected 3 numbers, got 2 values", "[0, -9.81]"),
        ("gravity: [0, -9.81, 0]", "gravity: [0, .nan, 0]", "expected a finite number", ".nan"),
        ("effort: 60", "effort: -60", "expected a number above 0 (N m or N)", "-60"),
        ("effort: 60", 'effort: "60 N"', "expected a torque such as", '"60 N"'),
        ("convention: standard", "# none", "a `convention`", "name: arm"),
    ],
)
def test_one_clear_error_at_its_place(old: str, new: str, message: str, at: str) -> None:
    assert old in JOB
    text = JOB.replace(old, new, 1)
    with pytest.raises(InputError) as refused:
        job_from_text(text)
    (problem,) = refused.value.problems
    assert message in problem.message
    assert problem.place is not None
    before = text[: text.index(at)]
    assert problem.place.line == before.count("\n") + 1
    assert problem.place.column == len(before) - before.rfind("\n")


def test_a_payload_needs_geometry_and_a_move() -> None:
    bare = "version: 1\nrobot: {joints: 2}\nstart: {joints: 0}\nmoves:\n  - {attach: {mass: 1}}\n"
    with pytest.raises(InputError, match="nothing moves"):
        job_from_text(bare)
    with pytest.raises(InputError, match="a payload needs a robot with geometry"):
        job_from_text(bare + "  - {planner: hold, duration: 1}\n")
