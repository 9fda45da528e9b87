"""Chains of lines and arcs as jobs: stops, rounded corners, segments that overlap in time, the fastest law."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tool_jobs import LIMITS, TCP, plan, planned, poses_of, times_of

from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist

DOWN = [np.pi, 0, 0]
START = {
    "xyz": [0.4, 0.1, 0.05],
    "rpy": DOWN,
    "configuration": {"shoulder": "left", "elbow": "up", "wrist": "no_flip"},
}
POINTS = np.array([START["xyz"], [0.4, 0.3, 0.05], [0.5, 0.3, 0.05], [0.5, 0.2, 0.15]])
TURNS = [[np.pi, 0, 0], [np.pi, 0.2, 0.3], [np.pi - 0.2, 0.1, 0.5], [np.pi, 0, 0.5]]
LENGTHS = np.linalg.norm(np.diff(POINTS, axis=0), axis=1)


def path(*, turning=False, **fields):
    segments = []
    for point, turn in zip(POINTS[1:].tolist(), TURNS[1:], strict=True):
        segments.append({"line": {"xyz": point, **({"rpy": turn} if turning else {})}})
    return {"planner": "path", "corner": "stop", "segments": segments, **fields}


def rates(made, times):
    robot, curve = made.moves[0].robot, made.trajectory.curve
    q, qd, qdd = (curve.evaluate(times, order) for order in range(3))
    return tcp_twist(robot, q, qd), tcp_acceleration(robot, q, qd, qdd)


def away_from_segments(places):
    """Return how far places (N, 3) are from the nearest segment of the polyline."""
    found = []
    for a, b in itertools.pairwise(POINTS):
        part = np.clip((places - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        found.append(np.linalg.norm(places - a - part[:, None] * (b - a), axis=1))
    return np.min(found, axis=0)


def trapezoid(length, speed=TCP["speed"], acceleration=TCP["acceleration"]):
    return length / speed + speed / acceleration


def test_a_chain_with_stops_lasts_as_long_as_its_segments():
    made = plan("ur5e", START, path(corner="stop"))
    each = [trapezoid(length) for length in LENGTHS]
    assert made.trajectory.duration == pytest.approx(sum(each), rel=1e-9)
    at = np.cumsum(each)[:-1]
    np.testing.assert_allclose(poses_of(made, at)[:, :3, 3], POINTS[1:-1], atol=2e-6)
    assert np.abs(rates(made, at)[0]).max() < 1e-6
    assert away_from_segments(poses_of(made, times_of(made, 1001))[:, :3, 3]).max() < 2e-6


@pytest.mark.full
@pytest.mark.parametrize("radius", [0.005, 0.02, 0.04])
def test_a_rounded_corner_leaves_the_segments_only_within_its_radius(radius):
    made = plan("ur5e", START, path(corner="round", radius=radius))
    places = poses_of(made, times_of(made, 2001))[:, :3, 3]
    away = away_from_segments(places)
    assert 0.05 * radius < away.max() < radius
    to_corner = np.linalg.norm(places[:, None] - POINTS[1:-1], axis=2).min(axis=1)
    assert away[to_corner > radius * (1 + 1e-9)].max() < 2e-6
    velocity, acceleration = rates(made, times_of(made, 2001)[1:-1])
    speed = np.linalg.norm(velocity[:, :3], axis=1)
    assert speed[200:-200].min() > 1e-2  # it does not stop
    assert np.linalg.norm(acceleration[:, :3], axis=1).max() <= TCP["acceleration"] * (1 + 1e-5)


def test_a_radius_that_does_not_fit_is_shrunk_and_said():
    made = plan("ur5e", START, path(corner="round", radius=0.3))
    events = [event for event in made.events if event.kind == "shrunk"]
    assert len(events) == 2
    assert "was shrunk from 0.3 m to" in events[0].message
    away = away_from_segments(poses_of(made, times_of(made, 2001))[:, :3, 3])
    said = [float(event.message.split("passes at ")[1].split()[0]) for event in events]
    places = poses_of(made, times_of(made, 4001))[:, :3, 3]
    missed = [np.linalg.norm(places - corner, axis=1).min() for corner in POINTS[1:-1]]
    assert said == pytest.approx(missed, rel=1e-2)
    assert away.max() > 0.005


def done(t, begin, length, law):
    """Return how far a segment is done, by its own trapezoid."""
    speed, acceleration = law
    ramp = speed / acceleration
    duration = length / speed + ramp
    x = np.clip(t - begin, 0, duration)
    left = duration - x
    rising, falling = acceleration * x**2 / 2, length - acceleration * left**2 / 2
    return np.where(x < ramp, rising, np.where(left < ramp, falling, speed * (x - ramp / 2))), duration


OVERLAP = 0.1


@pytest.mark.parametrize("turning", [False, True])
def test_overlapping_segments_are_the_textbooks_sum(turning):
    """p = p0 + sum of what each segment has done; the rotations of segments one after the other."""
    law = (0.2, 1.0)
    fields = {
        "law": {"speed": law[0], "acceleration": law[1], "angular_speed": 100, "angular_acceleration": 1000}
    }
    made = plan(
        "ur5e",
        START,
        path(corner="overlap", overlap=OVERLAP, turning=turning, **fields),
        limits={"acceleration": 100},
    )
    t = times_of(made, 601)
    place, begin = np.tile(POINTS[0], (t.size, 1)), 0.0
    rotation = Rotation.from_euler("xyz", np.tile(TURNS[0], (t.size, 1)))
    for k, length in enumerate(LENGTHS):
        s, duration = done(t, begin, length, law)
        place = place + (s / length)[:, None] * (POINTS[k + 1] - POINTS[k])
        if turning:
            a, b = (Rotation.from_euler("xyz", turn) for turn in TURNS[k : k + 2])
            rotation = rotation * Rotation.from_rotvec((s / length)[:, None] * (a.inv() * b).as_rotvec())
        begin += duration - OVERLAP
    assert made.trajectory.duration == pytest.approx(begin + OVERLAP, rel=1e-9)
    poses = poses_of(made, t)
    np.testing.assert_allclose(poses[:, :3, 3], place, atol=2e-6)
    np.testing.assert_allclose(poses[:, :3, :3], rotation.as_matrix(), atol=4e-6)


def test_rates_of_overlapping_segments_are_finite_differences():
    fields = {"law": {"shape": "quintic", "duration": 4}, "tolerance": {"position": 1e-8, "angle": 1e-8}}
    made = plan("ur5e", START, path(corner="overlap", overlap=0.3, turning=True, **fields))
    motion, step = made.moves[0].planned.tool, 1e-4
    t = np.linspace(0.05, made.trajectory.duration - 0.05, 41)
    before, here, after = (motion.reference(t + shift) for shift in (-step, 0, step))
    np.testing.assert_allclose(here.second, (after.first - before.first) / (2 * step), rtol=0, atol=1e-4)
    turned = Rotation.from_matrix(after.poses[:, :3, :3] @ np.swapaxes(before.poses[:, :3, :3], 1, 2))
    np.testing.assert_allclose(here.first[:, 3:], turned.as_rotvec() / (2 * step), rtol=0, atol=1e-6)
    velocity, acceleration = rates(made, t)
    np.testing.assert_allclose(velocity, here.first, rtol=0, atol=1e-6)
    np.testing.assert_allclose(acceleration, here.second, rtol=0, atol=1e-5)


def test_overlapping_segments_keep_the_tools_acceleration():
    """Where one slows down and the next speeds up across a sharp turn, their accelerations add up."""
    back = [{"line": {"xyz": point}} for point in ([0.4, 0.3, 0.05], [0.41, 0.15, 0.05])]
    ramp = TCP["speed"] / TCP["acceleration"]
    move = {"planner": "path", "segments": back, "corner": "overlap", "overlap": ramp}
    made = plan("ur5e", START, move)
    acceleration = np.linalg.norm(rates(made, times_of(made, 4001))[1][:, :3], axis=1)
    assert acceleration.max() <= TCP["acceleration"] * (1 + 1e-5)


@pytest.mark.full
@pytest.mark.parametrize("corner", [{"corner": "stop"}, {"corner": "round", "radius": 0.02}])
def test_the_fastest_law_keeps_all_limits_and_uses_one(corner):
    limits = {**LIMITS, "velocity": 1.5, "acceleration": 6.0}
    made = plan("ur5e", START, path(turning=True, law={"shape": "time_optimal"}, **corner), limits=limits)
    t = times_of(made, 6001)
    curve = made.trajectory.curve
    velocity, acceleration = rates(made, t)
    use = np.stack(
        [
            np.linalg.norm(velocity[:, :3], axis=1) / TCP["speed"],
            np.linalg.norm(velocity[:, 3:], axis=1) / TCP["angular_speed"],
            np.linalg.norm(acceleration[:, :3], axis=1) / TCP["acceleration"],
            np.linalg.norm(acceleration[:, 3:], axis=1) / TCP["angular_acceleration"],
            np.abs(curve.evaluate(t, 1)).max(axis=1) / 1.5,
            np.abs(curve.evaluate(t, 2)).max(axis=1) / 6.0,
        ]
    )
    assert use.max() <= 1 + 1e-5
    assert (
        np.mean(use.max(axis=0) > 0.75) > 0.9
    )  # where the path is bent, 0.6 and 0.8 of a limit are shared out
    slower = plan("ur5e", START, path(turning=True, **corner), limits=limits, when_over_limit="slow")
    assert made.trajectory.duration < slower.trajectory.duration * (1 + 1e-3)


def test_a_turning_that_bends_keeps_the_angular_acceleration():
    """Angles that go evenly make a rotation whose axis turns: along and across it share the limit."""
    limits = {
        **LIMITS,
        "acceleration": 400.0,
        "tcp": {**TCP, "angular_speed": 3.0, "angular_acceleration": 4.0},
    }
    to = {"euler": {"sequence": "XYZ", "angles": [2.4, 0.9, 0.9]}}
    move = {"planner": "line", "to": to, "orientation": "euler", "law": {"shape": "time_optimal"}}
    made = plan("ur5e", START, move, limits=limits)
    acceleration = np.linalg.norm(rates(made, times_of(made, 6001))[1][:, 3:], axis=1)
    assert 2.0 < acceleration.max() <= 4.0 * (1 + 1e-5)


def across(*targets: dict, overlap: float, **law):
    segments = [{"line": target} for target in targets]
    return {"planner": "path", "segments": segments, "corner": "overlap", "overlap": overlap, "law": law}


def turned_about(*rpy):
    return {"rpy": (np.array(DOWN) + rpy).tolist()}


TOGETHER = {
    "turning back": [
        {"xyz": [0.4, 0.3, 0.05], **turned_about(0, 0, 0.5)},
        {"xyz": [0.5, 0.3, 0.05], **turned_about(0, 0, -0.2)},
    ],
    "about two axes": [
        {"xyz": [0.4, 0.2, 0.05], **turned_about(0, 0, 0.9)},
        {"xyz": [0.5, 0.2, 0.05], **turned_about(0.6, 0, 0.9)},
    ],
    "straight on": [{"xyz": [0.4, 0.3, 0.05]}, {"xyz": [0.4, 0.5, 0.05]}],
    "a short one": [{"xyz": [0.4, 0.15, 0.05]}, {"xyz": [0.4, 0.4, 0.05]}],
}


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("name", TOGETHER)
def test_what_overlapping_segments_do_together_keeps_the_limits_of_the_tool(name, number):
    """Both may cruise, speed up, or turn at once; plan() wants the verdict of all limits to pass."""
    tcp = {"speed": 0.5, "acceleration": 3.0, "angular_speed": 2.0, "angular_acceleration": 12.0}
    targets, overlap = TOGETHER[name], (0.1, 0.25)[number]
    shape = ("trapezoid", "quintic")[(number + [*TOGETHER].index(name)) % 2]
    made = plan("ur5e", START, across(*targets, overlap=overlap, shape=shape), limits={"tcp": tcp})
    velocity, acceleration = rates(made, times_of(made, 2001))
    sizes = [velocity[:, :3], acceleration[:, :3], velocity[:, 3:], acceleration[:, 3:]]
    used = np.array([np.linalg.norm(size, axis=1).max() for size in sizes]) / list(tcp.values())
    assert 0.7 < used.max() <= 1 + 1e-5


@pytest.mark.parametrize("law", [{"speed": 0.5, "acceleration": 5.0}, {"shape": "quintic", "duration": 1.0}])
def test_a_law_that_overlapping_segments_are_told_is_not_slowed_down(law):
    """Two that cruise at once are at twice the speed that is named: its finding is of that."""
    made = planned(
        "ur5e",
        START,
        across(*TOGETHER["straight on"], overlap=0.3, **law),
        limits={"tcp": {"speed": 0.5}},
        advise=False,
    )
    assert made.trajectory.duration == pytest.approx(
        law.get("duration", 2 * (0.2 / 0.5 + 0.1) - 0.3), rel=1e-9
    )
    speeds = np.linalg.norm(rates(made, times_of(made, 2001))[0][:, :3], axis=1)
    (found,) = made.verdict.findings
    assert found.kind == "tool_speed"
    assert found.value == pytest.approx(speeds.max(), rel=1e-5)


def test_an_overlap_longer_than_ramps_lengthens_them_and_leaves_the_speed():
    """Over ramps as long as the overlap the speeds of both add up to the full one: 2 L / v + overlap."""
    tcp = {"speed": 0.5, "acceleration": 5.0}
    made = plan("ur5e", START, across(*TOGETHER["straight on"], overlap=0.15), limits={"tcp": tcp})
    assert made.trajectory.duration == pytest.approx(2 * 0.2 / 0.5 + 0.15, rel=2e-3)
