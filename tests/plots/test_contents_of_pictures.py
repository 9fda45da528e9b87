"""Which panels a picture has, of which joints and whose traces, marks and points: by what the job and the files say."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.judge.judgement import Judgement
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.display_units import DisplayUnits
from trajcli.plots.panel import Panel, Picture
from trajcli.plots.picture import _phase_panel, picture_of
from trajcli.streams.table import Table
from trajcli.units import Units

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


def test_a_phase_plane_has_its_limit_from_both_sides_and_its_law_with_every_break() -> None:
    """A law s = t^2 that is slower than the limits, which fall from 8 to 6 at s = 1, where it must not stop, but at 2.25."""

    class Plane:
        law = PiecewisePolynomial(
            np.array([0.0, 0.7, 1.5]), np.array([[[1.0], [1.0]], [[0.0], [1.4]], [[0.0], [0.49]]])
        )
        breaks, stops, dimension = np.array([0.0, 1.0, 2.25]), np.array([1.0]), "length"

        def largest_speed(self, s: np.ndarray, side: str = "right") -> np.ndarray:
            high = s < 1 if side == "right" else s <= 1
            return np.where(high, np.where(s < 0.5, np.inf, 8.0), 6.0)

    planned = SimpleNamespace(phase_plane=Plane())
    move = SimpleNamespace(index=4, planner=SimpleNamespace(tag="line"), planned=planned)
    panel = _phase_panel(move, DisplayUnits(("a",), ("revolute",), Units("deg", "mm")))  # type: ignore[arg-type]
    assert (panel.title, panel.x_label, panel.y_label) == (
        "move 4 line: phase plane",
        "s [mm]",
        f"{SD} [mm/s]",
    )
    (trace,), (limit,) = panel.traces, panel.limits
    assert (trace.x[0], trace.x[-1]) == pytest.approx((0, 2250))
    assert np.abs(trace.x - 490).min() < 1e-9
    np.testing.assert_allclose(trace.y, 2 * np.sqrt(1000 * trace.x), atol=1e-9)
    assert (np.diff(limit[:, 0]) >= 0).all()
    assert (limit[0, 0], limit[-1, 0]) == pytest.approx((0, 2250))
    assert limit[limit[:, 0] == 1000][:, 1].tolist() == [8000, 0, 6000]
    assert np.isnan(limit[limit[:, 0] < 499, 1]).all()
    assert {*limit[(limit[:, 0] > 501) & (limit[:, 0] < 1000), 1]} == {8000}
    assert {*limit[limit[:, 0] > 1000, 1]} == {6000}


def arm_of(count: int) -> Plan:
    robot = f"joints: [{', '.join(['{velocity: 9}'] * count)}]"
    head = f"version: 1\nrobot: {{{robot}}}\nstart: {{joints: 0}}\nmoves: [{{planner: cubic, to: {{joints: 1}}, duration: 1}}]\n"
    return plan_job(job_from_text(head))


def test_panels_stand_by_joints_and_quantities() -> None:
    (two,) = picture_of(arm_of(2), quantities=["q", "qd"]).blocks
    named = ["j1: position", "j2: position", "j1: velocity", "j2: velocity"]
    assert ([panel.title for panel in two.panels], two.columns, two.headings) == (named, 2, ())
    (three,) = picture_of(arm_of(3), quantities=["q", "qd"]).blocks
    assert [panel.title for panel in three.panels] == ["j1", "j1", "j2", "j2", "j3", "j3"]
    assert [panel.y_label[:2].strip() for panel in three.panels] == ["q", QD] * 3
    assert (three.columns, three.headings) == (2, ("position", "velocity"))
    (one,) = picture_of(arm_of(4), quantities=["qd"]).blocks
    assert [panel.title for panel in one.panels] == ["j1", "j2", "j3", "j4"]
    assert set(one.headings) == {"velocity"}
    assert len(one.headings) == one.columns > 1


def test_marks_are_those_of_their_joint_and_stand_at_positions_alone() -> None:
    spline = "planner: spline, through: [{joints: [0.1, 0.5]}], to: {joints: [0.2, 0.9]}, duration: 2"
    found = panels(picture_of(plan_of(spline), quantities=["q", "qd"]))
    for joint, values in (("j1", [0, 0.1, 0.2]), ("j2", [0, 0.5, 0.9])):
        at = found[f"{joint}: position"]
        assert {0.1 * round(10 * value) for value in values} <= {*np.round(at.waypoints[:, 1], 9)} | {0.0}
        assert at.waypoints[:, 1].max() == pytest.approx(values[-1])
        assert len(at.virtual_points) == 2
        assert values[0] < at.virtual_points[0, 1] < values[1] < at.virtual_points[1, 1] < values[2]
        assert not found[f"{joint}: velocity"].waypoints.size
        assert not found[f"{joint}: velocity"].virtual_points.size


@pytest.mark.parametrize(("velocity", "unlimited"), [("9", False), ("[-9, 9]", False), ("null", True)])
def test_a_panel_without_any_limit_says_so(velocity: str, unlimited: bool) -> None:
    plan = plan_of(
        CUBIC, move("cubic", [0, 0], "duration: 1"), robot=f"joints: [{{velocity: {velocity}}}, {{}}]"
    )
    found = panels(picture_of(plan, quantities=["qd"]))
    assert [found[f"j{k}: velocity"].unlimited for k in (1, 2)] == [unlimited, True]
    # where one move has a limit, the panel has one
    limited = plan_of(CUBIC, move("cubic", [0, 0], "duration: 1, limits: {velocity: 8}"), robot="joints: 2")
    assert not any(panel.unlimited for panel in panels(picture_of(limited, quantities=["qd"])).values())
    files = panels(picture_of(None, [table("a.csv", "q1,qd1")]))
    assert not any(panel.unlimited for panel in files.values())


def test_speeds_of_the_tool_have_their_limits_findings_and_files() -> None:
    """In the files both joints turn at 0.5 and at 1 rad/s, 0.8 m and 0.3 m from the tool."""
    spins = "planner: cubic, to: {joints: [0.2, 0.4]}, duration: 0.6"
    plan = plan_of(
        spins,
        "planner: hold, duration: 1",
        robot=GEOMETRY,
        more="limits: {tcp: {angular_speed: 7}}\n",
    )
    files = [table(name, "q1,q2,qd1,qd2", 0, 0, rate, rate) for name, rate in (("a.csv", 0.5), ("b.csv", 1))]
    error = Finding("tool_angular_speed", value=1.25, limit=1.0, time=0.5)
    other = Finding("tool_speed", value=2.5, limit=1.0, time=0.75)
    judged = [Judgement((error, other), "linear", 3), None]
    picture = picture_of(plan, files, ["tool", "path"], judgements=judged)
    found = panels(picture)
    speed, angular = found["speed of the tool"], found["angular speed of the tool"]
    assert [trace.source for trace in speed.traces] == [trace.source for trace in angular.traces] == [0, 1, 2]
    assert [trace.y[0] for trace in speed.traces[1:]] == pytest.approx([0.55, 1.1])
    assert [trace.y[0] for trace in angular.traces[1:]] == pytest.approx([1, 2])
    assert (speed.unlimited, angular.unlimited) == (True, False)
    assert {*angular.limits[0][:, 1]} == {7.0}
    for panel, time, value in ((speed, 0.75, 2.5), (angular, 0.5, 1.25)):
        assert [row for row in panel.findings.tolist() if np.isfinite(row[1])] == [[time, value]]
    assert picture.blocks[-1].columns == 2
    assert picture.views is not None
    assert [source for source, _ in picture.views.traces] == [0, 1, 2]
    assert picture.views.traces[2][1][0] == pytest.approx([0.8, 0, 0])
    assert len(picture.views.waypoints) > 0


@pytest.mark.parametrize(
    ("files", "called"),
    [
        (("a/x.csv", "b/y.csv"), ("x.csv", "y.csv")),
        (("a/x.csv", "b/x.csv"), ("a/x.csv", "b/x.csv")),
        (("a/x.csv", "a/x.csv"), ("x.csv", "x.csv")),
    ],
)
def test_files_are_called_without_folders_where_that_tells_them_apart(
    files: tuple[str, ...], called: tuple[str, ...]
) -> None:
    assert picture_of(None, [table(file, "q1") for file in files]).sources == called
    over = picture_of(plan_of(CUBIC), [table(file, "q1,q2") for file in files], ["q"])
    assert over.sources == ("job", *called)


def test_findings_of_the_plan_and_of_files_stand_together() -> None:
    """A cubic of 1 rad in 0.25 s reaches 3 / 2 * 4 rad/s = 6 rad/s in its middle."""
    plan = plan_of(move("cubic", [1, 0], "duration: 0.25"), robot="joints: [{velocity: 5}, {velocity: 5}]")
    error = Finding("velocity", joint="j1", value=7.0, limit=5.0, time=1.5)
    files = [table("a.csv", "q1,q2,qd1,qd2"), table("b.csv", "q1,q2,qd1,qd2")]
    judged = [None, Judgement((error,), "linear", 3)]
    found = panels(picture_of(plan, files, ["qd"], judgements=judged))["j1: velocity"].findings
    np.testing.assert_allclose(found, [[0.125, 6.0], [1.5, 7.0]])


def test_findings_about_the_tool_stand_at_its_speed_or_its_angular_speed() -> None:
    """The first joint alone turns a stretched arm: 0.8 m from the tool, at 3 / 2 of its mean rate in the middle."""
    plan = plan_of(
        move("cubic", [0.4, 0]), robot=GEOMETRY, more="limits: {tcp: {speed: 0.1, angular_speed: 0.2}}\n"
    )
    found = panels(picture_of(plan, quantities=["tool"]))
    for title, value in (("speed of the tool", 0.48), ("angular speed of the tool", 0.6)):
        rows = found[title].findings
        own = rows[np.isfinite(rows[:, 1])]
        np.testing.assert_allclose(own, [[0.5, value]], atol=1e-6)
        assert len(rows) == 2


def test_a_limit_of_the_tool_in_one_move_is_one_of_its_panel() -> None:
    plan = plan_of(
        CUBIC, move("cubic", [0, 0], "duration: 1, limits: {tcp: {angular_speed: 9}}"), robot=GEOMETRY
    )
    found = panels(picture_of(plan, quantities=["tool"]))
    titles = ("speed of the tool", "angular speed of the tool")
    assert [found[title].unlimited for title in titles] == [True, False]


def test_of_many_planes_the_first_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = "joints: [{velocity: 9, acceleration: 9}, {velocity: 9, acceleration: 9}]"
    moves = [
        f"planner: time_optimal, through: [{{joints: [{k}, 2]}}], to: {{joints: [2, {k}]}}" for k in (1, 3)
    ]
    plan = plan_of(*moves, robot=robot)
    for most, titles in ((1, ["move 0"]), (2, ["move 0", "move 1"])):
        monkeypatch.setattr("trajcli.plots.picture.MOST_PLANES", most)
        (block,) = picture_of(plan, quantities=["phase"]).blocks
        assert [panel.title.split(" time")[0] for panel in block.panels] == titles
        assert block.columns == most
