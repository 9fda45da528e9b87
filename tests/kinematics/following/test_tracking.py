"""The coarse curve along a path: on the branch of the start to the end, or stuck where a root finder is too."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from followed_paths import CASES, solved
from tiers import few

from trajcli.curves.hermite_fit import fit
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import FixedOrientation, TangentOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following import tracking
from trajcli.kinematics.following.follower import LostError, follower
from trajcli.kinematics.following.tolerance import Tolerance, probes, tolerance_ratio
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.following.tracking import StuckError, track_branch
from trajcli.kinematics.forward import forward

NAMES = [
    "ur5e, pose on an arc",
    "panda, direction",
    "scorbot, position",
    "cobra600, yaw of x",
    "planar3r, yaw of x",
]


def tracked(made):
    arm = follower(made.robot, made.path.at_s, made.start, 0.0)
    return arm, track_branch(arm, made.path.breaks)


@pytest.mark.parametrize("name", NAMES)
def test_it_is_near_a_root_finders_joints_everywhere(name):
    made = CASES[name]
    arm, curve = tracked(made)
    assert (curve.start, curve.end) == (0.0, made.path.length)
    near = made.start
    for s in np.linspace(0, made.path.length, 15):
        near = solved(made, s, arm.held, near)
        assert np.abs(curve.evaluate(s) - near).max() < 0.01


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
def test_the_fit_keeps_its_promise_of_joints_and_tool(name, tolerance):
    made = CASES[name]
    arm, coarse = tracked(made)
    breaks = made.path.breaks
    ratio = tolerance_ratio(arm, Tolerance(tolerance, tolerance), breaks, coarse.evaluate(probes(breaks)))
    curve = fit(arm.joint_state, ratio, breaks, coarse.evaluate)
    s = np.linspace(0, made.path.length, 77)
    exact = arm.exact(s, "right", coarse.evaluate(s))
    fitted = curve.evaluate_orders(s, (0, 1, 2)).swapaxes(0, 1)
    assert np.abs(fitted[0] - exact[0]).max() <= tolerance
    aside = forward(made.robot, fitted[0])[:, :3, 3] - arm.reference_at(s, "right").poses[:, :3, 3]
    assert np.linalg.norm(aside, axis=1).max() <= tolerance
    for order in (1, 2):
        peak = np.abs(exact[order]).max()
        assert (
            np.abs(fitted[order] - exact[order]).max() <= 2 * tolerance * peak
        )  # between its probes the error may be larger


def winding(radius, *, turning):
    """Return a UR5e on short and shorter segments, their corners rounded or sharp, that end in an arc.

    The tool keeps its orientation, or with `turning` its attitude to the path.
    """
    begun = CASES["ur5e, pose"]
    start = begun.path.poses.evaluate(np.zeros(1))[0][0]
    steps = np.tile([[0.03, 0.0, 0.0], [0.0, 0.002, 0.001], [-0.03, 0.01, 0.0]], (3, 1))
    corners = start[:3, 3] + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    segments = [Line(*ends) for ends in pairwise(corners)]
    segments.append(Arc(corners[-1], corners[-1] + [0.0, -0.01, 0.02], [1, 0, 0], 2.0))
    chain = join(segments, radius)
    kept = FixedOrientation(start[:3, :3], chain.length)
    poses = PoseCurve(chain, TangentOrientation(chain, start[:3, :3]) if turning else kept)
    return replace(begun, path=ToolPath(poses, begun.path.position, "all"))


@pytest.mark.parametrize(
    ("radius", "turning", "questions"), few([(0.0, False, 23), (0.001, False, 36), (0.001, True, 150)], 1)
)
def test_short_ways_are_followed_in_few_steps(radius, turning, questions, monkeypatch):
    """The step goes on from segment to segment; where the direction jumps, what was known before it is left."""
    made, asked = winding(radius, turning=turning), []
    arm = follower(made.robot, made.path.at_s, made.start, 0.0)
    exact = type(arm).exact
    monkeypatch.setattr(type(arm), "exact", lambda self, s, *more: asked.append(s) or exact(self, s, *more))
    curve = track_branch(arm, made.path.breaks)
    assert len(asked) <= questions
    for s in np.linspace(0, made.path.length, 61):
        near = curve.evaluate(s)
        assert np.abs(solved(made, s, arm.held, near) - near).max() < 5e-3


L1, L2, HAND = 0.3, 0.2, 0.1  # the links of the planar arm, m
PLANAR = CASES["planar3r, yaw of x"].robot


def wrist_path(position):
    """Return the path of a tool that heads along x, on a curve of its position."""
    poses = PoseCurve(position, FixedOrientation(np.eye(3), position.length))
    return ToolPath(poses, (True, True, True), "yaw", "x", (0.0,))


def elbow_of(radius):
    """Return the elbow's angle with the wrist at a radius, by the law of cosines."""
    return np.arccos((radius**2 - L1**2 - L2**2) / (2 * L1 * L2))


def joints_at(wrist):
    """Return joint values, elbow positive, with the wrist there (2,) and the last link along x."""
    q2 = elbow_of(np.hypot(*wrist))
    q1 = np.arctan2(wrist[1], wrist[0]) - np.arctan2(L2 * np.sin(q2), L1 + L2 * np.cos(q2))
    return np.array([q1, q2, -q1 - q2])


def test_it_is_stuck_where_the_reach_ends():
    """The wrist on x = 0.35 reaches up to y = sqrt(0.5^2 - 0.35^2), and there the arm is straight."""
    wrist = np.array([0.35, 0.05])
    begin = np.array([wrist[0] + HAND, wrist[1], 0.0])
    path = wrist_path(Line(begin, begin + np.array([0.0, 0.4, 0.0])))
    with pytest.raises(StuckError) as caught:
        track_branch(follower(PLANAR, path.at_s, joints_at(wrist), 0.0), path.breaks)
    edge = np.sqrt((L1 + L2) ** 2 - 0.35**2) - 0.05
    assert edge - 1e-5 < caught.value.s < edge
    assert 0 < caught.value.joints[1] < 0.02
    y, elbow = 0.05 + caught.value.s, caught.value.joints[1]
    assert elbow == pytest.approx(elbow_of(np.hypot(0.35, y)), rel=1e-9)
    assert caught.value.rates[1] == pytest.approx(
        -y / (L1 * L2 * np.sin(elbow)), rel=1e-6
    )  # of the law of cosines


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7])
def test_it_does_not_pass_from_one_elbow_to_the_other(gap):
    """The wrist comes to within a gap of the workspace boundary, where the mirror image is as near, and goes back."""
    edge, near = L1 + L2, L1 + L2 - 0.02
    turn = np.array([np.cos(0.3), np.sin(0.3), 0.0])
    points = near * turn * [1, -1, 1], np.array([edge - gap, 0, 0]), near * turn
    path = wrist_path(Arc.through(*(point + np.array([HAND, 0, 0]) for point in points)))
    curve = track_branch(follower(PLANAR, path.at_s, joints_at(points[0][:2]), 0.0), path.breaks)
    elbow = curve.evaluate(np.linspace(0, path.length, 2001))[:, 1]
    assert (elbow > 0).all()
    assert curve.evaluate(path.length / 2)[1] == pytest.approx(elbow_of(edge - gap), abs=0.02)
    assert elbow[-1] == pytest.approx(elbow_of(near), abs=1e-9)


def test_a_tolerance_finer_than_rounding_is_met_as_far_as_rounding_lets_it():
    made = CASES["ur5e, pose on an arc"]
    arm, coarse = tracked(made)
    breaks = made.path.breaks
    ratio = tolerance_ratio(arm, Tolerance(1e-13, 1e-13), breaks, coarse.evaluate(probes(breaks)))
    curve = fit(arm.joint_state, ratio, breaks, coarse.evaluate)
    s = np.linspace(0, made.path.length, 77)
    exact = arm.exact(s, "right", coarse.evaluate(s))
    assert np.abs(curve.evaluate(s) - exact[0]).max() < 1e-12
    assert curve.pieces < 1000


LENGTH = 2.0


class Given:
    """A follower whose references are given functions of s and side; it knows no joints."""

    length = LENGTH

    def __init__(self, **functions):
        self.functions = functions

    def reference_at(self, s, side):
        s = np.asarray(s)
        none = np.zeros((s.size, 6))
        values = {
            name: self.functions.get(name, lambda s, side: none)(s, side)
            for name in ("first", "second", "aims")
        }
        return SimpleNamespace(**values)


@pytest.mark.parametrize("name", ["first", "second", "aims"])
@pytest.mark.parametrize("column", [0, 5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_derivative_jumps_where_its_sides_differ_by_more_than_a_millionth(name, column, sign):
    """At the second of three breaks, by 2e-6 of the largest one, or by half of that."""

    def stepping(size):
        def values(s, side):
            found = np.tile([3.0, 0, 0, 0, 0, -1.0], (s.size, 1))
            found[:, column] += sign * size * 3.0 * ((s == 2.0) & (side == "right"))
            return found

        return values

    for size, jumps in ((2e-6, True), (5e-7, False)):
        found = tracking._jumps(Given(**{name: stepping(size)}), np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
        assert found.tolist() == [False, False, jumps, False]


@pytest.mark.parametrize(("place", "column"), [(0.2, 0), (0.5, 2), (0.8, 4)])
def test_the_speed_of_an_interval_is_the_largest_that_is_seen_in_it(place, column):
    """In lengths of the arm where the tool moves, in rad where it turns; one without any is slow, not at rest."""

    def peaked(s, side):
        found = np.zeros((s.size, 6))
        found[:, column] = np.where((s > 1) & (np.abs(s - 1 - place) < 0.05), -3.0, 0.0)
        return found

    found = tracking._speeds(Given(first=peaked), np.array([0.0, 1.0, 2.0, 4.0]))
    assert found[1] == pytest.approx(3.0 / LENGTH if column < 3 else 3.0)
    np.testing.assert_allclose(found[[0, 2]] * [1.0, 2.0], 1e-9)


def test_short_neighbours_are_taken_together_and_long_ones_are_not():
    """None that goes beyond 0.02 together; all ends, and the ways of all, are kept."""
    rng = np.random.default_rng(3)
    breaks = np.append(0.0, np.cumsum(rng.uniform(1e-3, 1e-2, 60)))
    speeds = rng.choice([0.1, 1.0, 30.0], 60)
    kept, merged = tracking._together(breaks, speeds)
    assert (kept[0], kept[-1]) == (breaks[0], breaks[-1])
    assert np.isin(kept, breaks).all()
    ways = np.diff(np.interp(kept, breaks, np.append(0.0, np.cumsum(speeds * np.diff(breaks)))))
    np.testing.assert_allclose(merged * np.diff(kept), ways, rtol=1e-9)
    single = np.diff(np.searchsorted(breaks, kept)) == 1
    assert (ways[~single] <= 0.02 + 1e-12).all()
    assert (~single).any()
    assert (ways[:-1] + ways[1:] > 0.02).all()  # no two that would have been near enough
    few = tracking._together(breaks[:20], speeds[:19])
    assert few[0].size == 20


class Lost(Given):
    """A follower whose joints are lost in some of the places that are asked for."""

    def __init__(self, lost):
        super().__init__()
        self.lost = lost

    def exact(self, s, side, guess):
        values = np.zeros((3, s.size, 2))
        values[0] = guess
        values[2, self.lost, 1] = np.nan
        return values


@pytest.mark.parametrize("lost", [[0], [1], [0, 1]])
def test_joints_that_are_lost_anywhere_are_lost(lost):
    """In one of two places, or in both."""
    s, guess = np.array([0.5, 1.0]), np.array([[1.0, 2.0], [3.0, 4.0]])
    with pytest.raises(LostError) as caught:
        tracking._exact(Lost(lost), s, "right", guess)
    assert np.atleast_1d(caught.value.s).tolist() == s[lost].tolist()
    tracking._exact(Lost([]), s, "right", guess)


class Polynomial(Given):
    """A follower whose joints are polynomials of s, wherever they are looked for."""

    def __init__(self, joints):
        super().__init__()
        self.joints = joints

    def exact(self, s, side, guess):
        return np.array([[joint.deriv(order)(s) for joint in self.joints] for order in range(3)]).swapaxes(
            1, 2
        )


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("size", [2.0, -2.0])
def test_a_prediction_is_off_by_what_it_leaves_out(joint, size):
    """Of size s^3, from s = 0 on with two derivatives: by all of it, in either direction; a parabola is exact."""
    step = 0.4
    for power, off in ((3, abs(size) * step**3), (2, 0.0)):
        joints = [np.poly1d([0.3, -0.2]), np.poly1d([-0.1, 0.7])]
        joints[joint] = np.poly1d([size, *[0.0] * power])
        follower_of = Polynomial(joints)
        state = follower_of.exact(np.zeros(1), "right", None)[:, 0]
        exact, deviation = tracking._attempt(follower_of, 0.0, step, state)
        assert deviation == pytest.approx(off, abs=1e-15)
        np.testing.assert_allclose(exact, follower_of.exact(np.array([0.2, 0.4]), "left", None))


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("size", [5.0, -5.0])
def test_a_bulge_between_both_ends_counts_ten_times(joint, size):
    """Of size s^3 (s - h)^3 no derivative that is known differs from none; in the middle it is h^6 / 64."""
    step = 0.8
    bulge = size * np.poly1d([1.0, 0.0, 0.0, 0.0]) * np.poly1d([1.0, -step]) ** 3
    joints = [np.poly1d([0.3]), np.poly1d([-0.1])]
    joints[joint] = bulge
    follower_of = Polynomial(joints)
    _, deviation = tracking._attempt(
        follower_of, 0.0, step, follower_of.exact(np.zeros(1), "right", None)[:, 0]
    )
    assert deviation == pytest.approx(10.0 * abs(size) * step**6 / 64)
