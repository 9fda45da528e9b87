"""Segments with laws of their own: closed forms on a straight path, and speeds by independent kinematics."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from independent_motion import series_of, tool_rates
from tool_jobs import DOWN, plan, refusal

from trajcli.api.plans import plan as plan_mapping
from trajcli.checks.tool import SampledTool, check_tool
from trajcli.curves.operations import scale_time, times_at
from trajcli.output.explain import explanation
from trajcli.plots.planned_motion import PlannedMotion

HERE = [0.4, 0.1, 0.3]
OPTIMAL = {"shape": "time_optimal", "speed": 0.25}
FREE = {"velocity": 10.0, "acceleration": 4.0, "jerk": None}
JERKY = {"velocity": 3.0, "acceleration": 12.0, "jerk": 150.0}
SPEEDS = (0.1, 0.4, None, 0.05)  # None: that of the move


@cache
def straight(speeds, lengths, **law):
    """Return the plan of segments of one straight line on three sliding joints."""
    segments = [
        {"line": {"xyz": [end, 0.0, 0.0]}, **({"law": {"speed": speed}} if speed else {})}
        for speed, end in zip(speeds, np.cumsum(lengths).tolist(), strict=True)
    ]
    move = {
        "planner": "path",
        "corner": "stop",
        "segments": segments,
        "law": {"shape": "time_optimal", **law},
    }
    return plan("cartesian", {"xyz": [0.0, 0.0, 0.0]}, move, limits=FREE)


@cache
def bent(jerk=None):
    """Return the plan of four lines around a rectangle, with a stop in the last corner."""
    places = [[0.4, 0.25], [0.5, 0.25], [0.5, 0.1], [0.42, 0.1]]
    segments = [{"line": {"xyz": [*place, 0.3]}} for place in places]
    for segment, speed, radius in zip(segments, SPEEDS, (0.01, 0.01, 0.0, None), strict=True):
        if speed is not None:
            segment["law"] = {"speed": speed}
        if radius is not None:
            segment["radius"] = radius
    move = {"planner": "path", "segments": segments, "law": OPTIMAL}
    return plan("ur5e", {"xyz": HERE, "rpy": DOWN}, move, limits={**JERKY, "jerk": jerk})


def speeds_of(curve, robot, low, high):
    """Return speeds of the tool between two times, from Taylor series of products of matrices."""
    times = np.linspace(low, high, 801)
    piece = np.clip(np.searchsorted(curve.breaks, times, "right") - 1, 0, curve.pieces - 1)
    return tool_rates(robot, series_of(curve, piece, times - curve.breaks[piece]))[:, 0]


@pytest.mark.parametrize("faster", [True, False])
def test_two_speeds_on_a_line_take_the_time_of_their_ramps(faster):
    """The step is taken with the limit of acceleration, on the side of the segment that may be faster."""
    (slow, fast), a = (0.2, 0.5), FREE["acceleration"]
    lengths = (0.3, 0.4) if faster else (0.4, 0.3)
    made = straight((slow, fast) if faster else (fast, slow), lengths)
    of_slow = slow / a + (0.3 - slow**2 / (2 * a)) / slow
    ramps = (fast**2 - slow**2) / (2 * a) + fast**2 / (2 * a)
    of_fast = (fast - slow) / a + (0.4 - ramps) / fast + fast / a
    assert made.trajectory.duration == pytest.approx(of_slow + of_fast, rel=1e-6)


def test_the_law_of_the_move_counts_where_a_segment_has_none():
    made = straight((None, 0.2), (0.3, 0.3), speed=0.5)
    a = FREE["acceleration"]
    first = 0.5 / a + (0.3 - 0.25 / (2 * a) - (0.25 - 0.04) / (2 * a)) / 0.5 + 0.3 / a
    last = (0.3 - 0.04 / (2 * a)) / 0.2 + 0.2 / a
    assert made.trajectory.duration == pytest.approx(first + last, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("jerk", [None, JERKY["jerk"]])
def test_each_segment_keeps_its_speed_and_holds_it(jerk):
    made = bent(jerk)
    move, curve = made.moves[0], made.trajectory.curve
    path = move.planned.tool.path
    assert np.allclose(path.speeds.speed, [0.1, 0.4, 0.25, 0.05])
    times = times_at(move.planned.tool.law, path.speeds.borders)
    for low, high, most in zip(times[:-1], times[1:], (0.1, 0.4, 0.25, 0.05), strict=True):
        found = speeds_of(curve, move.robot, low, high)
        assert found.max() <= most * (1 + 1e-6)
        assert found.max() >= 0.97 * most


@pytest.mark.full
def test_a_radius_of_zero_stops_at_that_corner_alone():
    made = bent()
    tool, curve = made.moves[0].planned.tool, made.trajectory.curve
    passed = times_at(tool.law, tool.path.speeds.borders[1:-1])
    found = [float(speeds_of(curve, made.moves[0].robot, time, time).max()) for time in passed]
    assert min(found[:2]) > 0.05
    assert found[2] < 1e-6


@pytest.mark.full
def test_half_a_corner_belongs_to_each_of_its_segments():
    """The law steps where the blend of 10 mm is nearest to its corner."""
    made = bent()
    borders = made.moves[0].planned.tool.path.speeds.borders
    places, _, _ = made.moves[0].planned.tool.path.poses.evaluate(borders[1:3])
    for place, corner in zip(places[:, :2, 3], ([0.4, 0.25], [0.5, 0.25]), strict=True):
        off = np.abs(place - corner)
        assert off[0] == pytest.approx(off[1], abs=1e-9)
        assert 0 < off[0] < 0.005


def test_a_motion_that_is_too_fast_on_one_segment_alone_is_found():
    made = straight((0.1, 0.4, 0.25, 0.05), (0.1, 0.2, 0.2, 0.1))
    span, move = made.trajectory.spans[0], made.moves[0]
    tool = SampledTool(made.trajectory, span, move.robot, move.planned.tool)
    assert not check_tool(tool)
    path = move.planned.tool.path
    lower = replace(path.speeds, speed=path.speeds.speed * [1.0, 1.0, 0.9, 1.0])
    slower = replace(tool, motion=replace(tool.motion, path=replace(path, speeds=lower)))
    (finding,) = check_tool(slower)
    assert (finding.kind, finding.limit) == ("tool_speed", pytest.approx(0.225))
    assert finding.value == pytest.approx(0.25, rel=1e-4)
    assert finding.message.startswith("segment 2: the speed of the tool")
    low, high = slower.speed_runs[2].times
    assert low <= finding.time <= high
    faster = replace(
        tool,
        trajectory=replace(
            made.trajectory,
            curve=scale_time(made.trajectory.curve, 0.8),
            spans=(replace(span, end=span.end * 0.8),),
        ),
        span=replace(span, end=span.end * 0.8),
        motion=tool.motion.scaled(0.8),
    )
    kinds = [finding.kind for finding in check_tool(faster)]
    assert kinds.count("tool_speed") == 4


def test_segments_with_equal_speeds_are_one_in_the_report():
    speeds = (0.1, 0.1, None, 0.2)
    made = straight(speeds, (0.1, 0.1, 0.1, 0.1), speed=0.1)
    runs = explanation(made).moves[0].tool.segments
    assert [(run.first, run.last) for run in runs] == [(0, 2), (3, 3)]
    assert [run.peaks[0].limit for run in runs] == [0.1, 0.2]
    assert runs[0].ends == runs[1].begins == pytest.approx(0.3)
    assert runs[0].peaks[0].bound == pytest.approx(0.1, rel=1e-6)
    assert runs[0].start == 0
    assert runs[1].end == pytest.approx(made.trajectory.duration)


def test_pictures_show_limits_that_step():
    made = straight((0.1, 0.4, 0.25, 0.05), (0.1, 0.2, 0.2, 0.1))
    line = PlannedMotion(made).tool_limit(angular=False)
    assert line[:, 1].tolist() == [0.1, 0.1, 0.4, 0.4, 0.25, 0.25, 0.05, 0.05]
    assert (np.diff(line[:, 0]) >= 0).all()
    assert line[-1, 0] == pytest.approx(made.trajectory.duration)
    assert np.isnan(PlannedMotion(made).tool_limit(angular=True)[:, 1]).all()


@pytest.mark.full
def test_a_path_that_is_flown_by_keeps_the_speeds_of_its_segments():
    places = [[0.3, 0.25, 0.3], [0.4, 0.25, 0.3]]
    segments = [
        {"line": {"xyz": place}, "law": {"speed": v}} for place, v in zip(places, (0.1, 0.2), strict=True)
    ]
    way = {"planner": "path", "radius": 0.01, "segments": segments, "law": OPTIMAL}
    lines = [
        {"planner": "line", "to": {"xyz": to}, "law": {"speed": 0.25, "acceleration": 2.0}}
        for to in ([0.3, 0.1, 0.3], [0.4, 0.15, 0.3])
    ]
    start = {"xyz": HERE, "rpy": DOWN}
    made = plan("ur5e", start, lines[0], way, lines[1], zone=0.02, limits={**FREE, "acceleration": 12.0})
    assert made.flyby is not None
    assert len(made.flyby.zones) == 2
    move, span = made.moves[1], made.trajectory.spans[1]
    for part in move.planned.parts:
        if part.tool is not None:
            times = span.start + part.start + times_at(part.tool.law, part.tool.path.speeds.borders)
            for low, high, most in zip(times[:-1], times[1:], (0.1, 0.2), strict=True):
                found = speeds_of(made.trajectory.curve, move.robot, low, high)
                assert 0.97 * most <= found.max() <= most * (1 + 1e-5)


def test_laws_of_segments_are_refused_where_one_law_is_for_all():
    segments = [{"line": {"xyz": [0.4, 0.2, 0.3]}, "law": {"speed": 0.1}}]
    for shape in ("trapezoid", "quintic"):
        move = {"planner": "path", "segments": segments, "law": {"shape": shape, "speed": 0.2}}
        (problem,) = refusal("ur5e", {"xyz": HERE, "rpy": DOWN}, move).problems
        assert problem.message.endswith(f"a {shape} law is one for the whole path")
        assert problem.hint == "say law: {shape: time_optimal} in the move"


def test_a_law_of_a_segment_says_something():
    move = {"planner": "path", "segments": [{"line": {"xyz": [0.4, 0.2, 0.3]}, "law": {}}], "law": OPTIMAL}
    (problem,) = refusal("ur5e", {"xyz": HERE, "rpy": DOWN}, move).problems
    assert "gives `speed`, `angular_speed` or both" in problem.message


def test_the_law_of_defaults_is_that_of_the_move():
    """Without a shape the defaults are time_optimal, so that segments may have laws."""
    made = plan_mapping(
        {
            "version": 1,
            "robot": "cartesian",
            "limits": FREE,
            "defaults": {"law": {"speed": 0.5}},
            "start": {"xyz": [0.0, 0.0, 0.0]},
            "moves": [
                {"planner": "path", "segments": [{"line": {"xyz": [0.4, 0.0, 0.0]}, "law": {"speed": 0.2}}]}
            ],
        }
    )
    a = FREE["acceleration"]
    assert made.trajectory.duration == pytest.approx(0.4 / 0.2 + 0.2 / a, rel=1e-6)
