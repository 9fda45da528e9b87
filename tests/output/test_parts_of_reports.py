"""Parts of reports, of values that are put together by hand: efforts, loads, tools, zones and savings."""

from __future__ import annotations

import json
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_plans import arm

from trajcli.dynamics.effort_bound import EffortPeak
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Limits, Payload
from trajcli.output.report import report_of
from trajcli.output.report_parts import (
    effort_reports,
    efforts_report,
    flyby_report,
    payload_report,
    with_savings,
)
from trajcli.planning.binding_limits import Saving
from trajcli.planning.plan import plan_job

NONE = np.tile([-np.inf, np.inf], (2, 1))


def peak(value: float, time: float, bound: float, gravity: float) -> EffortPeak:
    return EffortPeak(value, time, bound, (value - gravity, 0.0, 0.0, gravity))


def reports_of(efforts: list[list[float]], highest: list[EffortPeak], lowest: list[EffortPeak]) -> list[Any]:
    """Return the reports of the efforts of two joints, turn and slide, in a move that begins at 10 s."""
    limits = Limits(NONE, NONE, NONE, NONE, effort=np.array(efforts))
    robot = arm(Joint("turn", type="revolute"), Joint("slide", type="prismatic"))
    robot = SimpleNamespace(
        joints=robot.joints, joint_names=robot.joint_names, joint_types=robot.joint_types, limits=limits
    )
    plan: Any = SimpleNamespace(
        verdict=SimpleNamespace(efforts=[None, SimpleNamespace(highest=highest, lowest=lowest)]),
        moves=[None, SimpleNamespace(robot=robot)],
        trajectory=SimpleNamespace(curve=SimpleNamespace(start=10.0)),
    )
    assert effort_reports(plan, 0) is None
    assert effort_reports(plan, 2) is None
    return effort_reports(plan, 1) or []


def test_the_side_that_uses_more_of_its_limit_says_head_room_and_gravity() -> None:
    """30 of 60 upwards and 15 of 20 downwards, by what is proven: downwards counts, with its own signs."""
    turn, slide = reports_of(
        [[-20, 60], [-100, 50]],
        [peak(29, 11.0, 30, 12), peak(39, 12.0, 40, -10)],
        [peak(14, 13.0, 15, 7), peak(-5, 14.0, -4, 10)],
    )
    assert (turn.unit, slide.unit) == ("N m", "N")
    assert (turn.low, turn.high, turn.low_time, turn.high_time) == (-14, 29, 3.0, 1.0)
    assert (turn.bound, turn.limit) == ((-15, 30), (-20, 60))
    assert (turn.used, turn.head_room) == (0.75, 5)
    assert (turn.gravity, turn.gravity_share) == (-7, 0.5)  # the arm hangs on the joint from above
    assert (slide.low, slide.bound) == (5, (4, 40))  # it always pushes upwards
    assert (slide.used, slide.head_room) == (0.8, 10)
    assert (slide.gravity, slide.gravity_share) == (-10, -10 / 39)


def test_of_one_side_without_a_limit_the_other_one_counts() -> None:
    """80 N m downwards use nothing of no limit; where no side has one the larger effort is told."""
    open_, free = reports_of(
        [[-math.inf, 60], [-math.inf, math.inf]],
        [peak(29, 11.0, 30, 12), peak(3, 12.0, 3, 2)],
        [peak(80, 13.0, 81, 7), peak(5, 14.0, 5, 4)],
    )
    assert (open_.limit, open_.used, open_.head_room, open_.gravity) == ((None, 60), 0.5, 30, 12)
    assert (free.limit, free.used, free.head_room, free.gravity) == ((None, None), None, None, -4)


def test_a_joint_that_never_acts_uses_nothing() -> None:
    report, _ = reports_of(
        [[-20, 60], [-1, 1]], [peak(-1e-9, 11.0, 0.0, 0)] * 2, [peak(0.0, 11.0, -1e-9, 0)] * 2
    )
    assert (report.used, report.gravity_share) == (0.0, 0.0)
    assert report.head_room == pytest.approx(20)


def test_the_inertia_of_a_load_stands_as_in_a_urdf() -> None:
    """ixx, iyy, izz, then the products xy, xz, yz."""
    tensor = np.array([[1, 0.1, 0.2], [0.1, 1.5, 0.3], [0.2, 0.3, 2.0]])
    report = payload_report(Payload(2.0, np.array([0.1, 0.2, 0.3]), tensor))
    assert report is not None
    assert (report.mass, report.com) == (2.0, [0.1, 0.2, 0.3])
    assert report.inertia == [1, 1.5, 2.0, 0.1, 0.2, 0.3]
    assert payload_report(None) is None


def job(**fields: Any) -> Any:
    text = {
        "version": 1,
        "robot": "ur5e",
        "start": {"joints": [0, -1.2, 1.1, 0.2, 0.4, 0]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.1, -1.2, 1.1, 0.2, 0.4, 0]}, "duration": 2}],
        **fields,
    }
    return plan_job(job_from_text(json.dumps(text)))


def test_the_tool_is_reported_where_tools_have_names_or_change() -> None:
    """Turned by a quarter about x: y of the tool is z of the flange, the second column of its matrix."""
    quarter = {"xyz": [0.1, 0, 0.2], "rpy": [math.pi / 2, 0, 0]}
    assert report_of(job(tool=quarter)).moves[0].mounted is None
    heavy = report_of(job(tools={"gun": {**quarter, "mass": 2}}, tool="gun")).moves[0].mounted
    assert heavy is not None
    assert heavy.load is not None
    assert heavy.load.mass == 2
    named = report_of(job(tools={"gun": quarter}, tool="gun")).moves[0].mounted
    assert named is not None
    assert (named.name, named.load) == ("gun", None)
    assert named.xyz == pytest.approx([0.1, 0, 0.2])
    assert np.array(named.matrix)[:, 1] == pytest.approx([0, 0, 1])
    changes = job(moves=[{"tool": {"xyz": [0, 0, 0.3]}}, {"planner": "hold", "duration": 1}])
    mounted = report_of(changes).moves[1].mounted
    assert mounted is not None
    assert (mounted.name, mounted.xyz) == (None, pytest.approx([0, 0, 0.3]))


def zone(**fields: Any) -> Any:
    whole = {
        "number": 1,
        "move": 3,
        "of": "position",
        "joint": None,
        "asked": 0.1,
        "used": 0.05,
        "pace": 1.0,
        "entered": 1.0,
        "left": 2.0,
        "nearest": 0.01,
        "farthest": 0.04,
        "deviation": 0.02,
        "turn": 0.3,
        "binds": "jerk of a",
    }
    return SimpleNamespace(**{**whole, **fields})


def test_zones_are_measured_by_their_kind_and_a_chain_saves_the_difference() -> None:
    zones = [zone(), zone(of="orientation"), zone(of="joints", joint=1, pace=0.8), zone(of="joints", joint=0)]
    flyby: Any = SimpleNamespace(
        duration=7.0, stopping=10.0, searched=6.5, zones=zones, best_bound=(5.0, "second_order")
    )
    report = flyby_report(flyby, ("prismatic", "revolute"), ("slide", "turn"))
    assert (report.duration, report.stopping, report.saved, report.searched) == (7, 10, 3, 6.5)
    assert report.bound is not None
    assert (report.bound.duration, report.bound.method) == (5.0, "second_order")
    assert [(each.of, each.unit, each.joint) for each in report.zones] == [
        ("position", "m", None),
        ("orientation", "rad", None),
        ("joints", "rad", "turn"),
        ("joints", "m", "slide"),
    ]
    assert [each.lowered for each in report.zones] == [None, None, 0.8, None]
    first = report.zones[0]
    assert (first.asked, first.used, first.entered, first.left) == (0.1, 0.05, 1.0, 2.0)
    assert (first.nearest, first.farthest, first.deviation, first.turn) == (0.01, 0.04, 0.02, 0.3)
    flyby.best_bound = None
    assert flyby_report(flyby, ("revolute",) * 2, ("a", "b")).bound is None


def test_savings_of_moves_add_up_the_largest_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the moves looked at, of 2 s and 3 s; what rounding leaves is nothing; one unknown makes a total unknown."""
    text = {
        "version": 1,
        "robot": {"joints": 2},
        "start": {"joints": [0, 0]},
        "moves": [
            {"planner": "quintic", "to": {"joints": [1, 1]}, "duration": 2},
            {"planner": "hold", "duration": 7},
            {"planner": "quintic", "to": {"joints": [0, 0]}, "duration": 3},
        ],
    }
    plan = plan_job(job_from_text(json.dumps(text)))
    found = [
        Saving(0, 0, 1, 0.1),
        Saving(0, 1, 2, 0.4),
        Saving(0, 0, 3, 1e-9),
        Saving(0, 1, 1, 0.02),
        Saving(2, 0, 1, 0.5),
        Saving(2, 1, 2, None, "no motion was found"),
        Saving(2, 0, 3, -1e-9),
    ]
    monkeypatch.setattr("trajcli.planning.binding_limits.savings_of", lambda plan, moves: iter(found))
    report = with_savings(report_of(plan), plan, [0, 2])
    own = [[(s.joint, s.quantity, s.saved, s.share) for s in move.savings or ()] for move in report.moves]
    assert own[0] == [
        ("j2", "acceleration", 0.4, 0.2),
        ("j1", "velocity", 0.1, 0.05),
        ("j2", "velocity", 0.02, 0.01),
        ("j1", "jerk", 0.0, 0.0),
    ]
    assert report.moves[1].savings is None
    assert [line[:3] for line in own[2]] == [
        ("j1", "velocity", 0.5),
        ("j2", "acceleration", None),
        ("j1", "jerk", 0.0),
    ]
    totals = [(s.joint, s.quantity, s.saved, s.share, s.reason) for s in report.savings or ()]
    assert totals[:2] == [
        ("j1", "velocity", pytest.approx(0.6), pytest.approx(0.12), None),
        ("j2", "velocity", 0.02, 0.01, None),
    ]
    assert sorted(totals[2:]) == [
        ("j1", "jerk", 0.0, 0.0, None),
        ("j2", "acceleration", None, None, "no motion was found"),
    ]


@pytest.mark.parametrize(
    ("efforts", "lacking", "stated", "reason"),
    [
        (
            [(-math.inf, math.inf), (-5, 5)],
            (),
            None,
            "those of arm count where the job says `limits: {effort: robot}`",
        ),
        ([(-math.inf, math.inf)] * 2, (), None, "no limit of effort is given"),
        ([(-math.inf, math.inf)] * 2, (), "robot", "no limit of effort is given"),
        ([(-5, 5)] * 2, (), (None, None), "the job's limits say null"),
        ([(-5, 5)] * 2, ("turn",), (None, None), "no mass and inertia of the links behind turn"),
    ],
)
def test_why_no_effort_is_judged(efforts: Any, lacking: tuple[str, ...], stated: Any, reason: str) -> None:
    """The masses of an arm that lacks some are said to be where the others are."""
    robot = SimpleNamespace(
        name="arm",
        convention="standard",
        without_inertia=lacking,
        gravity=np.array([0, 0, 1.62]),
        joints=[SimpleNamespace(effort=each) for each in efforts],
    )
    limits = None if stated is None else SimpleNamespace(effort=stated)
    loaded = SimpleNamespace(robot=robot, source="the file", job=SimpleNamespace(limits=limits))
    plan: Any = SimpleNamespace(loaded=loaded, verdict=SimpleNamespace(efforts=[None, None]))
    report = efforts_report(plan)
    assert report is not None
    assert (report.judged, report.reason, report.inertials) == (False, reason, "the file")
    assert report.gravity == [0, 0, 1.62]
    plan.verdict.efforts[1] = object()
    assert efforts_report(plan) == report.model_copy(update={"judged": True, "reason": None})
    robot.without_inertia = ("slide", "turn")
    assert efforts_report(plan).inertials is None  # type: ignore[union-attr]
