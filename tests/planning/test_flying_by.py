"""Programs that fly by their corners: durations, limits, zones, laws, hard cases, and what is refused."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from planned_examples import planned_example
from tiers import few

from trajcli.checks.verify import verify
from trajcli.errors import InputError, MissingLimitError
from trajcli.grids import UniformGrid
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.job.report_parts import in_units
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample

FAST = {"velocity": 3, "acceleration": 8, "jerk": 60}
START = {"joints": [0.3, 1.2]}
CORNER, END = (0.9, 1.25), (1.0, 2.0)


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {"joints": list(joints)}, **fields}


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def flown(*moves: dict[str, Any], robot: Any = "planar2r", **fields: Any) -> Plan:
    """Return the plan of a job, verified."""
    job = {"version": 1, "robot": robot, "limits": FAST, "start": START, "zone": 0.02, **fields}
    plan = _planned(json.dumps({**job, "moves": list(moves) or [to(*CORNER), to(*END)]}))
    assert plan.verdict.passed, plan.verdict.findings
    return plan


def duration(*moves: dict[str, Any], **fields: Any) -> float:
    return flown(*moves, **fields).trajectory.duration


DEG = np.pi / 180
HOME, ABOVE_PICK, PICK = (
    (0, -90, 90, -90, -90, 0),
    (25, -80, 110, -120, -90, 25),
    (25, -68, 118, -140, -90, 25),
)
ABOVE_PLACE, PLACE = (-60, -85, 105, -110, -90, -60), (-60, -74, 114, -130, -90, -60)


def pick(zone: float) -> Plan:
    """Return examples/ur5e_pick.yaml with jerk_limited for its last move."""
    hold = {"planner": "hold", "duration": 0.4}
    slow = {"limits": {"velocity": 30}}
    return flown(
        to(*ABOVE_PICK),
        to(*PICK, **slow),
        hold,
        to(*ABOVE_PICK, limits={"velocity": 60}),
        to(*ABOVE_PLACE, synchronize="phase"),
        to(*PLACE, **slow),
        hold,
        to(*ABOVE_PLACE),
        to(*HOME),
        robot="ur5e",
        units={"angle": "deg", "length": "mm"},
        limits={"acceleration": 800, "jerk": 8000, "scale": {"velocity": 0.6}},
        start={"joints": list(HOME)},
        zone=zone,
    )


@pytest.mark.full
@pytest.mark.parametrize(
    ("zone", "most", "found"), few([(10, 4.486, 4.4842), (20, 4.360, 4.3583), (50, 4.011, 4.0091)], 1)
)
def test_a_pick_is_as_fast_as_the_fastest_known(zone, most, found):
    """Found by another search, of four unknowns a zone, by sequential linear programmes."""
    plan = pick(zone)
    motion = plan.trajectory.duration - 0.8
    assert found * (1 - 1e-3) <= motion <= most
    assert plan.flyby is not None
    assert plan.flyby.stopping - 0.8 == pytest.approx(4.8419, abs=1e-4)
    assert len(plan.flyby.zones) == 4


@pytest.mark.parametrize(("zone", "most", "found"), [(0.02, 1.292, 1.2909), (0.05, 1.218, 1.2167)])
def test_a_corner_of_two_joint_moves_is_as_fast_as_the_fastest_known(zone, most, found):
    """Linear programmes for given times of leaving and meeting lead to 1.2926 to 1.2945 with 0.02 m."""
    assert found * (1 - 1e-3) <= duration(zone=zone) <= most


@pytest.mark.full
@pytest.mark.parametrize(("zone", "most"), few([(0.02, 1.353), (0.05, 1.184)], 1))
def test_a_corner_of_two_lines_of_the_tool_is_flown_by(zone, most):
    lines = [
        {"planner": "line", "to": {"xyz": [x, y, 0]}, "law": {"shape": "time_optimal"}}
        for x, y in ((0.300748, 0.392283), (0.154969, 0.392283))
    ]
    plan = flown(*lines, zone=zone)
    assert plan.trajectory.duration <= most
    assert plan.flyby is not None
    assert plan.flyby.stopping == pytest.approx(1.6139, abs=1e-3)


@pytest.mark.full
@pytest.mark.parametrize("order", few([3, 2, 1], 1))
def test_a_zone_that_is_lowered_uses_the_parts_of_limits_that_are_said_and_its_bound_is_not_lowered(order):
    """A limit of the tool takes of the derivative of joints that it is about, and what it leaves of it is used."""
    limit = {1: {"speed": 0.3}, 2: {"acceleration": 3}, 3: {"jerk": 15}}[order]
    bounds = {**FAST, "acceleration": 40, "jerk": 600} if order == 1 else FAST
    plan = flown(limits={**bounds, "tcp": limit}, zone=0.1 if order == 1 else 0.02)
    assert plan.flyby is not None
    (zone,) = plan.flyby.zones
    times = np.linspace(zone.entered, zone.left, 4001)[1:-1]
    rates = plan.trajectory.curve.evaluate_orders(times, (1, 2, 3))
    most = np.abs(rates).max(axis=(0, 2)) / [*bounds.values()]
    assert zone.shares[order - 1] < 0.99
    assert most[order - 1] == pytest.approx(zone.shares[order - 1], rel=1e-3)
    assert plan.flyby.searched < plan.flyby.duration * (1 - 1e-3)


@pytest.mark.full
def test_limits_of_the_tool_leave_lines_a_gain():
    """With joints held to what no tool of a plane exceeds, which is slower along lines, there is one, too."""
    corners = [(0.4, 0.2, 0.3), (0.4, 0.4, 0.3), (0.1, 0.4, 0.3)]
    lines = [{"planner": "line", "to": {"xyz": list(at)}, "law": {"shape": "time_optimal"}} for at in corners]
    slides = [
        {"type": "prismatic", "alpha": -np.pi / 2},
        {"type": "prismatic", "theta": -np.pi / 2, "alpha": -np.pi / 2},
        {"type": "prismatic"},
    ]
    gantry = {"convention": "standard", "joints": slides}
    held = {"velocity": 1, "acceleration": 2 / np.sqrt(2), "jerk": 20 / np.sqrt(2)}
    limits = {"speed": 0.5, "acceleration": 2, "jerk": 20}
    lasts = [
        flown(
            *lines, robot=gantry, limits={**bounds, "tcp": limits}, zone=0.05, start={"xyz": [0.1, 0.2, 0.3]}
        ).trajectory.duration
        for bounds in ({"velocity": 1, "acceleration": 5, "jerk": 50}, held)
    ]
    stopping = 2 * (0.3 / 0.5 + 0.5 / 2 + 2 / 20) + (0.2 / 0.5 + 0.5 / 2 + 2 / 20)  # of seven phases each
    assert lasts[0] < lasts[1] < stopping
    assert lasts[0] < 0.85 * stopping


@pytest.mark.full
def test_ramps_of_rounding_are_no_steps_in_velocity():
    """A joint changes its velocity by 3e-8 deg/s in 6e-11 s, within its acceleration: rows show nothing of it."""
    corners = [(400, 300, 250), (600, 300, 250), (600, 100, 250)]
    turned = {"rpy": [180, 0, 0]}
    lines = [
        {"planner": "line", "to": {"xyz": list(corner), **turned}, "law": {"shape": "time_optimal"}}
        for corner in corners
    ]
    plan = flown(
        *lines,
        robot="ur5e",
        units={"angle": "deg", "length": "mm"},
        limits={"acceleration": 800, "jerk": 8000, "tcp": {"speed": 1000}},
        start={"xyz": [400, 100, 250], **turned, "configuration": {"elbow": "up"}},
        zone=20,
    )
    assert (plan.trajectory.curve.lengths < 1e-9).any()
    assert "velocity_step" not in {event.kind for event in plan.events}


@pytest.mark.full
def test_parts_of_paths_beside_zones_are_proven_to_be_on_their_paths():
    plan = planned_example("flying_cell")
    promises = [move.promise for move in plan.moves]
    limits = [move.robot.limits for move in plan.moves]
    assert plan.verdict.sampled == (("branch", (1, 3, 5, 7)),)

    def stricter(promise):
        tools = [part.tool and replace(part.tool, tolerance=Tolerance(1e-12, 1e-6)) for part in promise.parts]
        parts = zip(promise.parts, tools, strict=True)
        return replace(promise, parts=tuple(replace(part, tool=tool) for part, tool in parts))

    found = verify(plan.trajectory, limits, [stricter(promise) for promise in promises]).findings
    assert [(f.move, f.kind) for f in found] == [(move, "tool_path") for move in (1, 3, 5, 7)]


@pytest.mark.full
@pytest.mark.parametrize(
    ("zone", "saved"),
    [(2e-4, 31.95e-3), (5e-5, 19.88e-3), (1e-6, 5.31e-3), (1e-7, 2.46e-3), (1e-9, 0.528e-3)],
)
def test_what_a_small_zone_saves_falls_with_the_cube_root_of_its_radius(zone, saved):
    plan = flown(zone=zone)
    assert plan.flyby is not None
    assert plan.flyby.stopping - plan.flyby.duration == pytest.approx(saved, rel=0.01)


@pytest.mark.parametrize("zone", [1e-4, 0.3])
def test_moves_that_go_straight_on_are_one_move(zone):
    whole = duration(to(1.5, 1.3))
    three = [to(0.5, 1.2 + 0.1 / 6), to(0.9, 1.25), to(1.5, 1.3)]
    assert duration(*three, zone=zone) == pytest.approx(whole, rel=1e-9)
    assert duration(*three[1:], zone=zone) == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize(("far", "velocity"), few([(3.0, 0.1), (0.3, 0.0), (3.0, 0.0), (0.3, 0.1)], 2))
def test_lines_that_go_straight_on_are_one_move_whichever_parameter_they_have(far, velocity):
    """A straight line of time_optimal is by its length, one of jerk_limited by its share: 0.4 is no end of 1."""
    line = {"planner": "time_optimal", "path": "polyline"}
    fields = {"robot": {"joints": 2}, "limits": {"velocity": 1, "acceleration": 4, "jerk": 40}}
    fields |= {"zone": {"joints": [0.05, 0.05]}, "start": {"joints": [0, 0], "velocity": [velocity] * 2}}
    along = {"synchronize": "phase"}
    want = duration(to(far, far, **along), to(2 * far, 2 * far), to(2 * far, 0), **fields)
    others = [(along, line), (line, {}), (line, line)]
    for first, second in few(others[:: 1 if far > 1 else -1], 1):
        moves = to(far, far, **first), to(2 * far, 2 * far, **second), to(2 * far, 0)
        assert duration(*moves, **fields) == pytest.approx(want, rel=1e-9)


def test_a_larger_zone_is_never_slower():
    found = [duration(zone=zone) for zone in (0.0, 3e-5, 1e-4, 0.02, 0.05, 0.3)]
    assert all(b <= a * (1 + 1e-4) for a, b in itertools.pairwise(found))


def test_the_way_back_takes_as_long():
    back = duration(to(*CORNER), to(*START["joints"]), start={"joints": list(END)})
    assert back == pytest.approx(duration(), rel=1e-4)


@pytest.mark.full
@pytest.mark.parametrize("k", [0.5, 3.0])
def test_limits_times_powers_of_k_divide_the_time_by_k(k):
    faster = {"velocity": 3 * k, "acceleration": 8 * k**2, "jerk": 60 * k**3}
    assert duration(limits=faster) == pytest.approx(duration() / k, rel=3e-4)


def pose(q):
    """Return the place of the tool of planar2r by its textbook formula."""
    return np.stack(
        [
            0.3 * np.cos(q[:, 0]) + 0.2 * np.cos(q.sum(axis=1)),
            0.3 * np.sin(q[:, 0]) + 0.2 * np.sin(q.sum(axis=1)),
        ]
    ).T


HARD = {
    "turning back": (to(*CORNER), to(*START["joints"])),
    "turning back half of the way": (to(*CORNER), to(0.6, 1.225)),
    "the same point twice": (to(*CORNER), to(*CORNER), to(*END)),
    "closed": (to(*CORNER), to(*END), to(*START["joints"])),
    "zones that meet": (to(0.35, 1.25), to(0.4, 1.25), to(0.45, 1.3), to(0.5, 1.2)),
}


@pytest.mark.parametrize(("zone", "name"), few([(zone, name) for zone in (0.02, 0.5) for name in HARD], 4))
def test_rows_at_10_khz_keep_limits_and_zones(name, zone):
    moves = HARD[name]
    plan = flown(*moves, zone=zone)
    curve = plan.trajectory.curve
    times = np.linspace(0, curve.end, int(curve.end * 1e4))
    for order, limit in ((1, 3.0), (2, 8.0), (3, 60.0)):
        assert np.abs(curve.evaluate(times, order)).max() <= limit * (1 + 1e-9)
    for order in range(3):
        first, last = curve.piece_ends(order)
        assert np.abs(first[1:] - last[:-1]).max() <= 1e-9 * max(1.0, np.abs(last).max())
    points = [np.array(START["joints"]), *(np.array(move["to"]["joints"]) for move in moves)]
    assert plan.flyby is not None
    inside = np.zeros(times.size, dtype=bool)
    for found in plan.flyby.zones:
        within = (times >= found.entered) & (times <= found.left)
        q = curve.evaluate(times[within])
        corner = points[found.move + 1]
        off = np.linalg.norm(pose(q) - pose(corner[None]), axis=1)
        assert off.max() <= zone * (1 + 1e-6)
        assert off.max() == pytest.approx(found.farthest, abs=1e-4)
        inside |= within
    q = curve.evaluate(times[~inside])
    gaps = [
        np.abs((q - a) @ np.array([a[1] - b[1], b[0] - a[0]])) / np.linalg.norm(b - a)
        for a, b in itertools.pairwise(points)
        if not np.array_equal(a, b)
    ]
    assert np.min(gaps, axis=0).max() <= 1e-9
    assert plan.flyby.duration <= plan.flyby.stopping


def test_joint_limits_inside_are_the_higher_of_both_and_outside_those_of_the_move():
    plan = flown(to(*CORNER, limits={"velocity": 1.0}), to(*END))
    curve, zone = plan.trajectory.curve, plan.flyby.zones[0]
    times = np.linspace(0, zone.entered, 2000)
    assert np.abs(curve.evaluate(times, 1)).max() <= 1.0 + 1e-9
    inside = np.linspace(zone.entered, zone.left, 500)
    assert 1.0 < np.abs(curve.evaluate(inside, 1)).max() <= 3.0


@pytest.mark.parametrize("robot", [{"joints": 3}, "planar3r"])
def test_a_joint_of_a_zone_that_may_not_leave_the_corner_leaves_the_others_their_sizes(robot: Any) -> None:
    """The second one stands in both moves: any size of it, and none, is the same zone of the others."""
    moves = to(1.0, 0.4, 0.2), to(1.0, 0.4, 1.2)
    fields = {"robot": robot, "start": {"joints": [0.0, 0.4, 0.2]}}
    wide, none = (flown(*moves, zone={"joints": [0.1, size, 0.1]}, **fields) for size in (0.1, 0.0))
    assert none.trajectory.duration == wide.trajectory.duration
    (one,), (other,) = none.flyby.zones, wide.flyby.zones
    assert (one.joint, one.used, one.entered, one.left) == (
        other.joint,
        other.used,
        other.entered,
        other.left,
    )
    assert one.used <= 0.1


@pytest.mark.full
def test_a_zone_may_be_an_angle_or_joints_and_all_of_them_hold():
    joints = flown(zone={"joints": 0.05})
    assert joints.flyby.zones[0].of == "joints"
    q = joints.trajectory.curve.evaluate(
        np.linspace(joints.flyby.zones[0].entered, joints.flyby.zones[0].left, 400)
    )
    assert np.abs(q - CORNER).max() <= 0.05 * (1 + 1e-6)
    bare = flown(robot={"joints": 2}, zone={"joints": 0.05})
    assert bare.trajectory.duration == pytest.approx(joints.trajectory.duration, rel=1e-9)
    assert bare.flyby.zones[0].nearest is None
    both = flown(zone={"orientation": 0.05, "position": 0.03})
    assert both.flyby.zones[0].of == "orientation"
    assert both.flyby.zones[0].turn <= 0.05 * (1 + 1e-6)


def test_a_start_in_motion_along_its_line_is_kept():
    line = np.array(CORNER) - START["joints"]
    velocity = (line / np.linalg.norm(line)).tolist()
    plan = flown(start={**START, "velocity": velocity})
    np.testing.assert_allclose(plan.trajectory.curve.evaluate(0.0, 1), velocity, atol=1e-12)
    off = flown(start={**START, "velocity": [0.6, -0.5]})
    (event,) = (event for event in off.events if event.kind == "not_faster")
    assert "leaves it" in event.message
    assert off.flyby.duration == off.flyby.stopping


def test_without_limits_of_jerk_velocities_join():
    limits = {"velocity": 3, "acceleration": 8}
    plan = flown(limits=limits)
    curve = plan.trajectory.curve
    first, last = curve.piece_ends(1)
    assert np.abs(first[1:] - last[:-1]).max() <= 1e-9
    assert plan.trajectory.duration < duration()


@pytest.mark.full
def test_a_limit_of_the_tool_holds_in_its_zone_and_on_the_lines_beside_it():
    plan = flown(limits={**FAST, "tcp": {"speed": 0.3}})
    curve = plan.trajectory.curve
    times = np.linspace(0, curve.end, 20000)
    places = pose(curve.evaluate(times))
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times)
    assert 0.29 < speed.max() <= 0.3 * (1 + 1e-6)
    assert plan.flyby.duration < plan.flyby.stopping


@pytest.mark.parametrize(
    ("moves", "reason"),
    [
        ((to(*CORNER), to(*END, zone=0.02)), "it is the last move"),
        ((to(*CORNER, zone=0.02), {"planner": "hold", "duration": 1}, to(*END)), "hold stops at its ends"),
        ((to(*CORNER, zone=0.02, minimum_duration=2), to(*END)), "`minimum_duration` is given"),
        ((to(*CORNER, zone=0.02), to(*END, synchronize="none")), "joints arrive one by one"),
        ((to(*CORNER, zone=0.02), to(*END, brake=True)), "brings its start inside"),
        (
            (to(*CORNER, zone=0.02), {"planner": "quintic", "to": {"joints": END}, "duration": 1}),
            "quintic stops at its ends",
        ),
    ],
)
def test_a_zone_that_cannot_be_is_refused_on_its_line_and_a_default_there_is_a_remark(moves, reason):
    job = {"version": 1, "robot": "planar2r", "limits": FAST, "start": START, "moves": list(moves)}
    with pytest.raises(InputError) as caught:
        plan_job(job_from_text(json.dumps(job, indent=1)))
    (problem,) = caught.value.problems
    assert reason in problem.message
    assert problem.place is not None
    assert '"zone"' in problem.place.source
    plain = [{key: value for key, value in move.items() if key != "zone"} for move in moves]
    plan = flown(*plain)
    assert any(reason in remark.message for remark in plan.remarks if remark.kind == "zone_stops")
    assert not [event for event in plan.events if event.kind == "zone_stops"]


def test_bare_joints_have_no_ball():
    job = {"version": 1, "robot": {"joints": 2}, "limits": FAST, "start": START}
    with pytest.raises(InputError, match="no geometry"):
        plan_job(job_from_text(json.dumps({**job, "moves": [to(*CORNER, zone=0.02), to(*END)]})))


def test_jobs_that_stop_everywhere_are_as_they_are_without_zones():
    plain = (
        flown(zone=None)
        if False
        else plan_job(
            job_from_text(
                json.dumps(
                    {
                        "version": 1,
                        "robot": "planar2r",
                        "limits": FAST,
                        "start": START,
                        "moves": [to(*CORNER), to(*END)],
                    }
                )
            )
        )
    )
    stopped = flown(zone="stop")
    np.testing.assert_array_equal(plain.trajectory.curve.coefficients, stopped.trajectory.curve.coefficients)


def findings(plan: Plan, moves):
    trajectory = replace(plan.trajectory)
    return {
        f.kind
        for f in verify(trajectory, [m.robot.limits for m in moves], [m.promise for m in moves]).findings
    }


def test_each_fault_that_is_planted_is_caught_by_name():
    plan = flown()
    first, second = plan.moves
    part = first.planned.parts[-1]
    smaller = replace(part, around=replace(part.around, zone=part.around.zone.scaled(1 / 1.02)))
    changed = replace(first, planned=replace(first.planned, parts=(*first.planned.parts[:-1], smaller)))
    assert findings(plan, [changed, second]) == {"zone"}
    limits, promises = [m.robot.limits for m in plan.moves], [changed.promise, second.promise]
    (left,) = verify(plan.trajectory, limits, promises).findings
    assert (left.move, left.limit) == (0, 1.0)
    assert left.value == pytest.approx(1.02, rel=1e-4)
    lower = replace(part.robot, limits=replace(part.robot.limits, velocity=part.robot.limits.velocity / 30))
    changed = replace(
        first, planned=replace(first.planned, parts=(*first.planned.parts[:-1], replace(part, robot=lower)))
    )
    assert "velocity" in findings(plan, [changed, second])
    curve = plan.trajectory.curve
    late = int(np.searchsorted(curve.breaks, plan.flyby.zones[0].left)) - 1
    for order, sign, kind in ((1, 1.01, "velocity_jump"), (2, -1.0, "acceleration_jump")):
        coefficients = curve.coefficients.copy()
        coefficients[-1 - order, late] *= sign
        broken = replace(plan.trajectory, curve=replace(curve, coefficients=coefficients))
        moves = [first, second]
        found = verify(broken, [m.robot.limits for m in moves], [m.promise for m in moves]).findings
        assert kind in {finding.kind for finding in found}, found


def test_a_chain_with_no_way_stops_and_says_why():
    """A limit of position at the corner leaves no room for a motion about it."""
    tight = {**FAST, "position": [[0.0, 0.9], [1.0, 2.2]]}
    plan = flown(to(*CORNER), to(0.3, 2.0), limits=tight)
    assert plan.flyby.duration <= plan.flyby.stopping


def test_a_job_that_lacks_a_limit_says_which():
    job = {
        "version": 1,
        "robot": "planar2r",
        "limits": {"tcp": {"speed": 0.2, "acceleration": 1.0}},
        "zone": 0.01,
    }
    lines = [
        {"planner": "line", "to": {"xyz": [x, 0.3, 0]}, "law": {"shape": "trapezoid"}} for x in (0.3, 0.2)
    ]
    with pytest.raises(MissingLimitError, match="to fly by a corner") as caught:
        plan_job(job_from_text(json.dumps({**job, "start": START, "moves": lines})))
    assert "velocity" in str(caught.value)


def test_rows_and_reports_say_where_zones_are(monkeypatch):
    monkeypatch.setattr(
        "trajcli.planners.flying_by.proven_bound._PROGRAMMES", ((0.005, 8),)
    )  # a bound, if none so close
    plan = flown(to(*CORNER), to(*END), to(0.3, 2.1), zone=20, units={"length": "mm"})
    report = report_of(plan)
    assert report.flyby is not None
    assert [zone.move for zone in report.flyby.zones] == [0, 1]
    grid = UniformGrid(plan.trajectory.duration, 500, 0.0)
    rows = np.concatenate(list(sample(plan.trajectory, grid, ("t", "zone", "move"))))
    for zone in report.flyby.zones:
        times = rows[rows[:, 1] == zone.number, 0]
        assert zone.entered <= times[0] < zone.entered + 2.1e-3
        assert zone.left - 2.1e-3 < times[-1] < zone.left
        changed = rows[np.searchsorted(rows[:, 2], zone.move + 1), 0]
        assert zone.entered < changed < zone.left
        assert zone.used == pytest.approx(zone.asked, rel=1e-6) == pytest.approx(0.02)
        assert 0 < zone.nearest < zone.farthest <= 0.02 * (1 + 1e-6)
        assert 0 < zone.deviation <= zone.nearest * (1 + 1e-3)
        assert zone.binds.partition(" of ")[2] in plan.trajectory.joint_names
    assert report.flyby.saved == pytest.approx(report.flyby.stopping - report.duration)
    assert report.flyby.bound.duration <= report.duration
    outside = rows[rows[:, 1] == 0]
    assert len(outside) > 0.7 * len(rows)
    shown = in_units(report, plan.loaded.units).flyby
    assert shown is not None
    assert shown.zones[0].asked == pytest.approx(20)
    assert shown.zones[0].length_unit == "mm"


@pytest.mark.full
def test_a_job_that_is_written_out_flies_the_same():
    plan = pick(20)
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    np.testing.assert_array_equal(plan.trajectory.curve.breaks, again.trajectory.curve.breaks)


@pytest.mark.full
def test_a_time_optimal_move_is_flown_by_at_its_ends_and_passes_its_points():
    inner = [(1.0, 1.6), (0.8, 1.9)]
    through = {
        "planner": "time_optimal",
        "through": [{"joints": list(point)} for point in inner],
        "to": {"joints": [0.6, 2.2]},
    }
    plan = flown(to(*CORNER), through, to(0.2, 2.0))
    assert len(plan.flyby.zones) == 2
    assert plan.flyby.duration < 0.9 * plan.flyby.stopping
    passed = plan.moves[1].planned.via_points
    begun = plan.trajectory.spans[1].start
    np.testing.assert_allclose(plan.trajectory.curve.evaluate(begun + passed.times), inner, atol=1e-9)
    late = replace(passed, times=passed.times + 1e-3)
    changed = replace(plan.moves[1], planned=replace(plan.moves[1].planned, via_points=late))
    assert findings(plan, [plan.moves[0], changed, plan.moves[2]]) == {"waypoint"}


@pytest.mark.full
@pytest.mark.parametrize(
    "second",
    few(
        [
            {"planner": "arc", "center": [0.4, 0.2, 0.25], "axis": "z", "angle": 1.0},
            {"planner": "screw", "to": {"xyz": [0.3, 0.3, 0.3], "rpy": [np.pi, 0, 0.5]}},
        ],
        1,
    ),
)
def test_arcs_and_screws_are_flown_by(second):
    law = {"law": {"shape": "time_optimal"}}
    first = {"planner": "line", "to": {"xyz": [0.4, 0.3, 0.25], "rpy": [np.pi, 0, 0]}, **law}
    branch = {"shoulder": "left", "elbow": "up", "wrist": "no_flip"}
    start = {"xyz": [0.4, 0.1, 0.05], "rpy": [np.pi, 0, 0], "configuration": branch}
    limits = {"velocity": 3, "acceleration": 14, "jerk": 140}
    plan = flown(first, {**second, **law}, robot="ur5e", start=start, limits=limits, zone=0.02)
    assert len(plan.flyby.zones) == 1
    assert plan.flyby.duration < 0.97 * plan.flyby.stopping
    assert plan.flyby.zones[0].farthest <= 0.02 * (1 + 1e-6)


@pytest.mark.full
def test_seven_joints_and_slides_are_flown_by():
    seven = [0.1, -0.6, 0.2, -2.0, 0.1, 1.6, 0.7]
    limits = {"velocity": 2, "acceleration": 8, "jerk": 100}
    moves = [to(*(value + 0.2 for value in seven)), to(*(value - 0.1 for value in seven))]
    plan = flown(*moves, robot="panda", limits=limits, start={"joints": seven}, zone=0.03)
    assert len(plan.flyby.zones) == 1
    joints = [
        {"type": "prismatic", "alpha": 1.5707963267948966},
        {"type": "prismatic", "alpha": 1.57},
        {"a": 0.2},
    ]
    arm = {"convention": "standard", "joints": joints}
    plan = flown(to(0.2, 0.1, 0.3), to(0.3, 0.3, 0.8), robot=arm, limits=limits, start={"joints": [0, 0, 0]})
    assert len(plan.flyby.zones) == 1
