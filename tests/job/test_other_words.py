"""Words of other programs, slips of the pen and names that no message can hold: each gets the nearest right thing."""

from __future__ import annotations

import re

import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

JOB = """version: 1
robot: {joints: 1}
start: {joints: [0]}
moves:
  - {planner: cubic, to: {joints: [1]}, duration: 1}
"""


def problems(text: str) -> list[tuple[int, str]]:
    with pytest.raises(InputError) as caught:
        job_from_text(text)
    return [
        (problem.place.line if problem.place else 0, f"{problem.text()} | {problem.hint}")
        for problem in caught.value.problems
    ]


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("planner: cubic", "planer: cubic", 5, "did you mean 'planner'?"),
        ("planner: cubic", "planner: minimum jerk", 5, "write `planner: quintic`"),
        ("planner: cubic", 'planner: " LIN "', 5, "write `planner: line`"),
        ("to: {", "Target: {", 5, "did you mean 'to'?"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "Wait: 2", 5, "{planner: hold, duration: 2}"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "line: 2", 5, "write `- {planner: line, ...}`"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "atach: 2", 5, "did you mean 'attach'?"),
        ("duration: 1", "duration: 1, limits: fast", 5, 'got "fast" | its keys: position'),
        ("version: 1", "version: 1\nlimits: {tcp: fast}", 2, 'got "fast" | its keys: speed'),
        ("{joints: 1}", "{name: ur5e, note: x, tool: {xyz: [0, 0, 1]}}", 2, "and `tool` beside `robot` in"),
        ("{joints: 1}", "true", 2, "got true | such as ur5e: `trajcli robots` lists the names"),
        ("duration: 1", "duration: 1, times: [1]", 5, "{repeat: 3, moves: [...]}"),
        ("to: {", "target: {", 5, "unknown key 'target' | did you mean 'to'?"),
        ("duration: 1", "duration: 1, limits: {accel: 2}", 5, "did you mean 'acceleration'?"),
        ("duration: 1", "duration: 0,2", 5, "write 0.2: decimals have a point"),
        ("duration: 1", 'duration: "0,2 s"', 5, "write 0.2, decimals have a point"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "wait: 2", 5, "{planner: hold, duration: 2}"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "stop: 2", 5, "{planner: hold, duration: 2}"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "movej: 2", 5, "{planner: jerk_limited, ...}"),
        (
            "planner: cubic, to: {joints: [1]}, duration: 1",
            "loop: {times: 3}",
            5,
            "{repeat: 3, moves: [...]}",
        ),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "mark: here", 5, "a move has a `label`"),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "gripper: 1", 5, "attach and detach"),
        (
            "{planner: cubic, to: {joints: [1]}, duration: 1}",
            "{repeat: 2, zone: 0.1, moves: [{planner: cubic, to: {joints: [1]}, duration: 1}]}",
            5,
            "`zone` stands in the moves, in each that it is for",
        ),
        ("duration: 1", "duration: 1, io: 4", 5, "`at: {signal: NAME, value: 1}` in the move before"),
        (
            "cubic, to: {joints: [1]}",
            "spline, through: [{joints: [0.5], time: 0.5}], to: {joints: [1]}, times: [0, 1]",
            5,
            "a point of `through` has its own: {joints: ..., time: ...}",
        ),
        ("planner: cubic, to: {joints: [1]}, duration: 1", "goto: a", 5, "{planner: jerk_limited, to: a}"),
        ("{planner: cubic, to: {joints: [1]}, duration: 1}", "wait", 5, "{planner: hold, duration: ...}"),
        ("{planner: cubic, to: {joints: [1]}, duration: 1}", "[1, 2]", 5, "{planner: ..., to: ...}"),
        ("duration: 1", "duration: 1, wait: 2", 5, "{planner: hold, duration: ...}"),
        ("duration: 1", "duration: 1, accel: 2", 5, "under `limits`: {acceleration: ...}"),
        ("joints: [1]", "joints: [1,5]", 5, "decimals have a point"),
        ("version: 1", "version: 1\nwobj: {a: {xyz: [0, 0, 0]}}", 2, "under `frames`"),
        ("planner: cubic", "planner: stop", 5, "{planner: jerk_limited, to: {velocity: 0}}"),
        (
            "{joints: 1}",
            "{name: ur5e, base: {xyz: [0, 0, 1]}}",
            2,
            "write `robot: ur5e`, and `base` beside `robot`",
        ),
    ],
)
def test_what_is_meant_is_said(old: str, new: str, line: int, said: str) -> None:
    found = problems(JOB.replace(old, new))
    assert [place for place, _ in found] == [line]
    assert said in found[0][1]


def test_an_arm_of_the_catalogue_that_is_given_as_its_own_is_said_at_its_name() -> None:
    with pytest.raises(InputError) as caught:
        job_from_text(JOB.replace("{joints: 1}", "{tool: {xyz: [0, 0, 1]}, name: ur5e}"))
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("ur5e}")


def test_the_name_of_a_point_among_the_moves_is_where_a_move_goes() -> None:
    text = JOB.replace("{planner: cubic, to: {joints: [1]}, duration: 1}", "there")
    (found,) = problems(text + "points: {there: {joints: [1]}}\n")
    assert "write `- {planner: jerk_limited, to: there}`" in found[1]


@pytest.mark.parametrize(
    ("start", "line", "whose"), [("{joints: [2]}", 3, "the start:"), ("a", 6, "point 'a':")]
)
def test_a_start_outside_its_limit_is_blamed_on_itself(start: str, line: int, whose: str) -> None:
    from trajcli.output.report import verification_error
    from trajcli.planning.plan import plan_job

    text = JOB.replace("joints: 1}", "joints: [{position: [-1, 1.5]}]}").replace(
        "start: {joints: [0]}", f"start: {start}"
    )
    plan = plan_job(job_from_text(text + "points: {a: {joints: [2]}}\n"))
    (found,) = verification_error(plan).problems
    assert found.place is not None
    assert (found.place.line, found.move) == (line, 0)
    assert f"{whose} the position of j1 reaches 2 rad at t = 0 s, its limit is 1.5 rad" in found.text()


def test_a_move_that_stands_for_another_word_is_read_when_it_is_written_so() -> None:
    text = JOB + "  - {planner: hold, duration: 2}\n  - {planner: cubic, to: {joints: [0]}, duration: 1}\n"
    assert [move.tag for move in job_from_text(text).job.moves] == ["cubic", "hold", "cubic"]


@pytest.mark.parametrize("bad", ["\n", "\x07", "\u2028", "\u202e", "\x9b"])
@pytest.mark.parametrize("where", ["joint", "robot", "job", "point"])
def test_control_characters_in_names_are_refused(bad: str, where: str) -> None:
    name = f'"a\\u{ord(bad):04x}::error file=x::b"'
    text = {
        "joint": JOB.replace("{joints: 1}", f"{{joints: [{{name: {name}}}]}}"),
        "robot": JOB.replace("{joints: 1}", f"{{name: {name}, joints: 1}}"),
        "job": JOB + f"name: {name}\n",
        "point": JOB + f"points: {{? {name} : {{joints: [1]}}}}\n",
    }[where]
    (found,) = problems(text)
    assert f"U+{ord(bad):04X}" in found[1]
    assert bad not in found[1]


@pytest.mark.parametrize("where", ["{joints: [{name: NAME}]}", "{name: NAME, joints: 1}"])
def test_a_name_without_end_is_not_printed_whole(where: str) -> None:
    (found,) = problems(JOB.replace("{joints: 1}", where.replace("NAME", "n" * 1_000_000)))
    assert "at most 200 characters" in found[1]
    assert len(found[1]) < 300


def test_a_text_without_end_is_not_printed_whole() -> None:
    long = "n" * 1_000_000
    for text in (JOB + f"{long[:1000]}: 1\n", JOB.replace("planner: cubic", f"planner: {long}")):
        assert all(len(said) < 600 for _, said in problems(text))


def test_degrees_in_a_pose_read_as_radians_are_an_event_though_the_job_plans() -> None:
    from trajcli.planning.plan import plan_job

    text = """version: 1
robot: ur5e
limits: {acceleration: 5, jerk: 50}
start: {joints: [0, -1.5, 1, 0, 1, 0]}
moves:
  - {planner: jerk_limited, to: {xyz: [0.4, 0.1, 0.2], rpy: [180, 0, 0]}}
"""
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    assert [event.message for event in plan.events if event.kind == "units"] == [
        "angles up to 180 look like degrees: say `units: {angle: deg}`"
    ]
    meant = text.replace("robot: ur5e", "units: {angle: deg}\nrobot: ur5e").replace("-1.5, 1", "-80, 60")
    meant = meant.replace("acceleration: 5, jerk: 50", "acceleration: 300, jerk: 3000")
    assert not [event for event in plan_job(job_from_text(meant)).events if event.kind == "units"]
    with_unit = text.replace("[180, 0, 0]", '["180 deg", 0, 0]')
    assert not [event for event in plan_job(job_from_text(with_unit)).events if event.kind == "units"]


@pytest.mark.parametrize("place", ["between moves", "in a move"])
def test_what_is_said_of_signals_works(place: str) -> None:
    move = "{planner: cubic, to: {joints: [1]}, duration: 1}"
    (found,) = problems(JOB.replace(move, "{gripper: 1}"))
    entry, beside = (
        text.replace("NAME", "grip") for text in re.findall(r"`([^`]+)`", found[1].split(" | ")[1])
    )
    new = (
        f"{move}\n  {entry}" if place == "between moves" else move.replace("duration", f"{beside}, duration")
    )
    loaded = job_from_text(JOB.replace(move, new))
    assert [signal.name for signal in plan_job(loaded).trajectory.signals] == ["grip"]
