"""Wrong jobs: what is said about each, and where."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from yaml_files import read_yaml

from trajcli.errors import InputError, Problem
from trajcli.job.read import job_from_text
from trajcli.planners import ALSO_CALLED, PLANNERS
from trajcli.planning.plan import plan_job

JOB = """\
version: 1
units: {angle: deg, length: mm}
robot: cobra600
points:
  home: {joints: [0, 0, 0, 0]}
start: home
moves:
  - {planner: quintic, to: {joints: [10, 10, 10, 10]}, duration: 2}
"""
TO = "{joints: [10, 10, 10, 10]}"
DURATION = "duration: 2"


@cache
def problems_of(text: str) -> list[Problem]:
    with pytest.raises(InputError) as caught:
        job_from_text(text, "job.yaml")
    assert caught.value.exit_code == 2
    return list(caught.value.problems)


def underlined(problem: Problem) -> str:
    place = problem.place
    assert place is not None
    assert place.source[place.column - 1 : place.column] != " "
    return place.source[place.column - 1 : place.column - 1 + place.length]


def changed(old: str, new: str) -> str:
    assert JOB.count(old) == 1, old
    return JOB.replace(old, new)


CASES = read_yaml(Path(__file__).parent / "wrong_jobs.yaml")
SEVERAL = [
    ("moves:\n  - ", "moves: []\nmove:\n  "),  # the old list is now an unknown key
    ("{joints: [0, 0, 0, 0]}", "home"),  # a circle is said of each name in it
]


@pytest.mark.parametrize(("old", "new", "line", "text", "message", "hint"), CASES)
def test_one_flaw(old: str, new: str, line: int, text: str, message: str, hint: str | None) -> None:
    problem = problems_of(changed(old, new))[0]
    assert problem.place is not None
    assert (problem.place.file, problem.place.line) == ("job.yaml", line)
    if text:
        assert underlined(problem) == text
    assert problem.message == message
    assert problem.hint is None if hint is None else hint in (problem.hint or "")


@pytest.mark.parametrize(("old", "new"), [case[:2] for case in CASES if tuple(case[:2]) not in SEVERAL])
def test_one_flaw_is_one_problem(old: str, new: str) -> None:
    assert len(problems_of(changed(old, new))) == 1


def test_all_flaws_at_once_in_the_order_of_the_file() -> None:
    problems = problems_of("""\
units: {angle: degree, length: mm}
robot:
  joints: [{velocity: 0}, {type: prismatic, jerk: x}]
  tool: {xyz: [0, 0]}
limits: {velocity: true, scale: {jerk: 0}}
points:
  a: {joints: [1, oops]}
  b: {joint: 3}
start: c
moves:
  - {planner: quintic, to: a, duration: -1}
  - {planner: quintc, to: a}
  - {to: a}
  - {planner: hold, duration: 1, speed: 2}
output: {rate: fast, columns: [t, p]}
extra: 1
""")
    found = [(p.place.line, p.message) for p in problems if p.place is not None]
    assert found == [
        (1, "`version` is missing"),
        (1, 'expected rad or deg, got "degree"'),
        (3, "expected a number above 0, a pair [lower, upper] or null (unlimited), got 0"),
        (3, 'expected a length per second cubed such as "250 mm/s^3", got "x"'),
        (4, "expected 3 numbers, got 2 values"),
        (5, "expected a number (rad/s), got true"),
        (5, "expected a number above 0 and at most 1, got 0"),
        (7, 'expected an angle such as "120 deg", got "oops"'),
        (8, "unknown key 'joint'"),
        (9, "there is no point 'c'"),
        (11, "expected a number above 0 s, got -1"),
        (12, "unknown planner 'quintc'"),
        (13, "a move needs `planner`"),
        (14, "unknown key 'speed'"),
        (15, 'expected a frequency such as "500 Hz", got "fast"'),
        (15, 'expected t, q, qd, qdd, qddd, pose, twist, twistd, path, tau, zone, signals or move, got "p"'),
        (16, "unknown key 'extra'"),
    ]


def test_a_flaw_of_a_point_is_said_once_where_the_point_stands() -> None:
    text = changed("[0, 0, 0, 0]", "[0, 0, 0]").replace(TO, "home")
    assert [(p.place and p.place.line) for p in problems_of(text)] == [5]


def test_all_limits_that_moves_loosen_come_at_once() -> None:
    text = changed("start: home", "start: home\nlimits: {velocity: 4}")
    text = text.replace(DURATION, "limits: {position: [50, 89, [0, 210], null], velocity: {j2: 5, j3: 3}}")
    text += "  - {planner: hold, duration: 1, limits: {velocity: null}}\n"
    assert [(p.place and p.place.line, underlined(p), p.move, p.joint) for p in problems_of(text)] == [
        (9, "89", 0, "j2"),
        (9, "5", 0, "j2"),
        (10, "null", 1, "j1"),
        (10, "null", 1, "j2"),
        (10, "null", 1, "j3"),
        (10, "null", 1, "j4"),
    ]


@pytest.mark.parametrize(
    ("word", "planner"),
    [
        *(("PTP", "jerk_limited"), ("LIN", "line"), ("CIRC", "arc"), ("movej", "jerk_limited")),
        *(("MoveL", "line"), ("movec", "arc"), ("lspb", "trapezoid"), ("minimum_jerk", "quintic")),
        *(("ruckig", "jerk_limited"), ("toppra", "time_optimal")),
    ],
)
def test_words_of_other_programs_name_the_planner_and_all_are_listed(word: str, planner: str) -> None:
    hint = problems_of(changed("planner: quintic", f"planner: {word}"))[0].hint or ""
    assert f"write `planner: {planner}`" in hint
    assert all(f" {name}" in hint for name in PLANNERS)


def test_other_names_lead_to_planners() -> None:
    assert set(ALSO_CALLED.values()) <= set(PLANNERS)
    assert not set(ALSO_CALLED) & set(PLANNERS)


LINE = """version: 1
units: {angle: deg, length: mm}
robot: ur5e
start: {xyz: [400, 100, 250], rpy: [180, 0, 0]}
moves:
  - {planner: line, to: {xyz: [450, 100, 250]}, WORDS}
"""


@pytest.mark.parametrize(
    ("words", "law"),
    [
        ("duration: 3", "law: {shape: quintic, duration: 3}"),
        ("time: 3 s", "law: {shape: quintic, duration: 3 s}"),
        ("shape: cubic, duration: 3", "law: {shape: cubic, duration: 3}"),
        ("speed: 50 mm/s, acceleration: 100", "law: {speed: 50 mm/s, acceleration: 100}"),
        ("velocity: 50, acceleration: 100", "law: {speed: 50, acceleration: 100}"),
        ("duration: 3, law: {shape: quintic}", "law: {shape: quintic, duration: 3}"),
    ],
)
def test_fields_of_the_law_beside_it_are_shown_where_they_stand(words: str, law: str) -> None:
    problems = problems_of(LINE.replace("WORDS", words))
    assert all(law in (problem.hint or "") for problem in problems)
    assert not plan_job(job_from_text(LINE.replace("WORDS", law))).verdict.findings


def test_a_radius_belongs_to_a_path() -> None:
    problem = problems_of(LINE.replace("WORDS", "radius: 10"))[0]
    assert "corner: round, radius: " in (problem.hint or "")


EULER = "{xyz: [0.4, 0, 0.3], euler: {angles: [0, 0, 0]}}"
TAGS = [  # lines, the first message, its hint; keys and names of points are those of planners and entries
    (f"moves: [{{planner: path, segments: [{{line: {EULER}}}]}}]", "`sequence` is missing", "the axes"),
    ("moves: [{planner: path, segments: [{line: {axis_angle: {axis: z}}}]}]", "`angle` is missing", "angle"),
    ("moves: [{planner: path, segments: [{line: {rpyy: 0}}]}]", "unknown key 'rpyy'", "did you mean 'rpy'?"),
    (f"points: {{hold: {EULER}}}", "`sequence` is missing", "the axes"),
    (f"points: {{attach: {EULER}}}", "`sequence` is missing", "the axes"),
    ("points: {euler: {rpyy: 0}}", "unknown key 'rpyy'", "did you mean 'rpy'?"),
    ("points: {path: {rpyy: 0}}", "unknown key 'rpyy'", "did you mean 'rpy'?"),
    ("sequences: {line: [{attach: {mass: 1, come: 0}}]}", "unknown key 'come'", "did you mean 'com'?"),
]


@pytest.mark.parametrize(("lines", "message", "hint"), TAGS)
def test_names_that_planners_have_too(lines: str, message: str, hint: str) -> None:
    moves = "" if lines.startswith("moves") else "moves: [{planner: hold, duration: 1}]\n"
    text = f"version: 1\nrobot: ur5e\nstart: {{joints: 0}}\n{lines}\n{moves}"
    problem = problems_of(text)[0]
    assert problem.message == message
    assert (problem.hint or "").startswith(hint)


@pytest.mark.parametrize("point", ["halt", "{velocity: 0}"])
def test_a_state_that_is_no_waypoint_is_refused_where_it_is_named(point: str) -> None:
    line = f"  - {{planner: spline, through: [home, {point}, home]}}\n"
    text = JOB.replace("start:", "  halt: {velocity: 0}\nstart:") + line
    (problem,) = problems_of(text)
    assert problem.message == "a waypoint needs `joints` or a pose"
    assert problem.place is not None
    assert (problem.place.line, underlined(problem)) == (10, point)


def test_the_hint_to_a_number_as_a_key_works_for_joints_and_for_points() -> None:
    text = """\
version: 1
robot: {joints: [{name: "1"}, {name: "2"}]}
points: {7: {joints: {1: 3, 2: 4}}}
start: {joints: 0}
moves: [{planner: quintic, to: 7, duration: 1}]
"""
    with pytest.raises(InputError) as caught:
        job_from_text(text)
    hints = [(p.place and p.place.column, p.hint) for p in caught.value.problems]
    assert hints == [(n, f'write "{k}", of a point p{k}') for n, k in ((10, 7), (23, 1), (29, 2))]
    text = text.replace("{7:", "{p7:").replace("to: 7", "to: p7").replace("1: 3, 2:", '"1": 3, "2":')
    assert job_from_text(text).job.points["p7"].joints == (3.0, 4.0)


def test_a_pair_in_the_place_of_a_list_is_one_of_numbers() -> None:
    for pair, hint in (("[-1, 2]", "{NAME: [-1, 2]}"), ("[true, 2]", None), ("[-1, 2, 3]", None)):
        text = f"version: 1\nrobot: {{joints: {3 if '3' in pair else 2}}}\nlimits: {{velocity: {pair}}}\n"
        with pytest.raises(InputError) as caught:
            job_from_text(f"{text}start: {{joints: 0}}\nmoves: [{{planner: hold, duration: 1}}]\n")
        (problem,) = caught.value.problems
        assert (problem.hint or "").endswith(hint or "")
        assert bool(problem.hint) == (hint is not None)
