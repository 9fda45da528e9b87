"""Which panels a picture has, of which joints and whose traces, marks and points: by what the job and the files say."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.judge.judgement import Judgement
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.panel import Panel, Picture
from trajcli.plots.picture import picture_of
from trajcli.streams.table import Table

GEOMETRY = "convention: standard, joints: [{a: 0.5, velocity: 9}, {a: 0.3, velocity: 9}]"
LINK = "{a: 0.5, velocity: 9, link: {mass: 1, com: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0]}}"
BARE = "joints: [{velocity: 9}, {velocity: 9}]"
TIMES = [0.0, 1.0, 2.0]


def plan_of(*moves: str, robot: str = BARE, more: str = "") -> Plan:
    listed = "".join(f"  - {{{move}}}\n" for move in moves)
    head = f"version: 1\nrobot: {{{robot}}}\nstart: {{joints: [0, 0]}}\n{more}moves:\n"
    return plan_job(job_from_text(head + listed, "job.yaml"))


def move(planner: str, q: list[float], more: str = "duration: 1") -> str:
    return f"planner: {planner}, to: {{joints: {q}}}, {more}"


CUBIC = move("cubic", [0.1, 0.2])
BACK = move("cubic", [0, 0])


def table(name: str, header: str, *values: float) -> Table:
    """Return rows with these values one behind the other, and the time before them."""
    names = ("t", *header.split(","))
    rows = np.array([[t, *(t + 0.01 * k for k in range(len(names) - 1))] for t in TIMES])
    if values:
        rows[:, 1:] = values
    return Table(names, rows, np.zeros(len(names), dtype=np.int64), name)


def panels(picture: Picture) -> dict[str, Panel]:
    return {panel.title: panel for block in picture.blocks for panel in block.panels}


def shown(picture: Picture) -> set[str]:
    """Return the symbols of its axes, and whether it has views of the path."""
    symbols = {panel.y_label.split(" [")[0] for panel in panels(picture).values()}
    return symbols | ({"path"} if picture.views is not None else set())


QD, QDD, QDDD, TAU, SD = "q\u0307", "q\u0308", "q\u20db", "\u03c4", "s\u0307"


def test_a_picture_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="there is nothing to plot") as refused:
        picture_of(None)
    assert refused.value.problems[0].hint == "give a plan or a file"


def test_marks_and_names_of_a_file_over_two_plans_are_those_of_the_file() -> None:
    """The plan that is drawn as a file is drawn is not judged as one."""
    first, second = plan_of(CUBIC), plan_of(move("cubic", [0.2, 0.1]))
    error = Finding("velocity", joint="j1", value=10.0, limit=9.0, time=0.5)
    found = Judgement((error, Finding("time", severity="warning")), "linear", 3)
    picture = picture_of(
        first, [table("a/rows.csv", "q1,q2,qd1,qd2")], ["qd"], judgements=[found], second=second
    )
    assert picture.title == "job.yaml: verified, 1 s; job.yaml: verified, 1 s; rows.csv: EXCEEDED, 1 finding"
    assert picture.sources == ("job.yaml", "job.yaml", "rows.csv")
    panel = panels(picture)["j1: velocity"]
    assert panel.findings.tolist() == [[0.5, 10.0]]
    assert [trace.source for trace in panel.traces] == [0, 1, 2]


def test_the_title_counts_what_has_to_be_changed() -> None:
    """A move that is too short for two limits is to be longer, once; two such moves are two."""
    robot = "joints: [{velocity: 9, acceleration: 9}, {velocity: 9, acceleration: 9}]"
    short, back = (move("cubic", [q, 0], "duration: 0.125") for q in (1, 0))
    one, two = plan_of(short, robot=robot), plan_of(short, back, robot=robot)
    assert len(one.verdict.findings) > 1
    assert picture_of(one).title == "job: NOT VERIFIED, 1 finding, 0.125 s"
    assert picture_of(two).title == "job: NOT VERIFIED, 2 findings, 0.25 s"


@pytest.mark.parametrize(
    ("header", "has"), [("q1,q2", "it has columns for q"), ("move", "it has columns for none")]
)
def test_a_file_that_has_nothing_of_what_is_drawn_says_what_it_has(header: str, has: str) -> None:
    with pytest.raises(InputError, match=r"a\.csv has no columns for qd, qdd") as refused:
        picture_of(plan_of(CUBIC), [table("a.csv", header)], ["qd", "qdd"])
    assert refused.value.problems[0].hint == has


def test_the_difference_of_two_plans_is_of_the_joints_that_are_asked_for() -> None:
    first, second = plan_of(CUBIC), plan_of(move("cubic", [0.2, 0.1]))
    found = panels(picture_of(first, quantities=["q"], joints=["j2"], second=second))
    assert list(found) == ["j2: position", "j2: difference"]


def test_phase_planes_are_drawn_where_they_are_asked_for() -> None:
    robot = "joints: [{velocity: 9, acceleration: 9}, {velocity: 9, acceleration: 9}]"
    plan = plan_of("planner: time_optimal, through: [{joints: [1, 2]}], to: {joints: [2, 1]}", robot=robot)
    assert SD in shown(picture_of(plan))
    assert shown(picture_of(plan, quantities=["qd"])) == {QD}


def test_the_tool_of_a_file_is_that_of_the_job_at_its_time() -> None:
    """Stretched along x the arm is 0.8 m long, and a metre longer behind the change of the tool."""
    plan = plan_of(
        "planner: hold, duration: 1", "tool: {xyz: [1, 0, 0]}", "planner: hold, duration: 1", robot=GEOMETRY
    )
    picture = picture_of(plan, [table("a.csv", "q1,q2", 0, 0)], ["path"])
    assert picture.views is not None
    assert dict(picture.views.traces)[1][[0, -1], 0] == pytest.approx([0.8, 1.8])


def test_files_alone_show_what_any_of_them_has() -> None:
    files = [table("a.csv", "q1,qd1"), table("b.csv", "q1,qdd1,x,y,z")]
    picture = picture_of(None, files)
    assert shown(picture) == {"q", QD, QDD, "path"}
    assert [trace.source for trace in panels(picture)["j1: acceleration"].traces] == [1]
    assert picture.title == "a.csv and 1 more file"
    three = picture_of(None, [*files, table("c.csv", "q1")])
    assert three.title == "a.csv and 2 more files"
    assert picture_of(None, files[:1]).title == "a.csv"


@pytest.mark.parametrize(
    ("jerks", "planners", "has"),
    [
        (("", ""), ("quintic", "quintic"), True),
        (("", ""), ("quintic", "cubic"), False),
        ((", jerk: 999", ""), ("quintic", "cubic"), True),
        (("", ", jerk: 999"), ("cubic", "quintic"), True),
    ],
)
def test_jerks_are_drawn_where_any_is_limited_or_none_is_infinite(
    jerks: tuple[str, str], planners: tuple[str, str], has: bool
) -> None:
    robot = f"joints: [{', '.join(f'{{velocity: 9{jerk}}}' for jerk in jerks)}]"
    plan = plan_of(move(planners[0], [0.1, 0.2]), move(planners[1], [0, 0]), robot=robot)
    assert (QDDD in shown(picture_of(plan))) == has


def test_jerks_are_drawn_where_one_move_limits_them() -> None:
    limited = move("cubic", [0, 0], "duration: 1, limits: {jerk: 999}")
    assert QDDD in shown(picture_of(plan_of(CUBIC, limited)))


@pytest.mark.parametrize(
    ("link", "moves", "has"),
    [
        (LINK, (CUBIC,), False),
        (
            LINK.replace("mass: 1", "mass: 2").replace("velocity: 9", "velocity: 9, effort: 999"),
            (CUBIC,),
            True,
        ),
        (LINK, ("attach: {mass: 1}", CUBIC, "detach: {}", BACK), True),
    ],
)
def test_efforts_are_drawn_where_one_is_limited_or_something_is_carried(
    link: str, moves: tuple[str, ...], has: bool
) -> None:
    plan = plan_of(*moves, robot=f"convention: standard, joints: [{link}, {LINK}]")
    assert (TAU in shown(picture_of(plan))) == has


def test_efforts_are_drawn_where_a_file_has_them() -> None:
    plan = plan_of(CUBIC, robot=f"convention: standard, joints: [{LINK}, {LINK}]")
    assert [TAU in shown(picture_of(plan, [table("a.csv", names)])) for names in ("q1,tau2", "q1,q2")] == [
        True,
        False,
    ]


FLY = "planner: jerk_limited, synchronize: phase, to: {joints: [%s]}"


@pytest.mark.parametrize(
    ("moves", "more", "has"),
    [
        ((CUBIC,), "", set()),
        ((CUBIC, move("cubic", [0, 0], "duration: 1, limits: {tcp: {speed: 9}}")), "", {"speed"}),
        ((CUBIC,), "limits: {tcp: {angular_speed: 9}}\n", {"speed"}),
        (
            (CUBIC, "planner: line, to: {xyz: [0.7, 0.2, 0]}, law: {shape: quintic, duration: 2}"),
            "",
            {"speed", "path"},
        ),
        ((FLY % "0.2, 0.1", FLY % "0.1, 0.9"), "zone: {joints: 0.05}\n", {"speed", "path"}),
    ],
)
def test_the_tool_is_drawn_where_it_is_limited_led_or_flies_by(
    moves: tuple[str, ...], more: str, has: set[str]
) -> None:
    joint = "velocity: 9, acceleration: 99, jerk: 999"
    robot = f"convention: standard, joints: [{{a: 0.5, {joint}}}, {{a: 0.3, {joint}}}]"
    plan = plan_of(*moves, robot=robot, more=more)
    assert (plan.flyby is not None) == ("zone" in more)
    assert shown(picture_of(plan)) & {"speed", "path"} == has
