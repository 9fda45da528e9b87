"""Joint values on a path and their derivatives, against a root finder and its finite differences."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from followed_paths import CASES, case, numeric_slopes, off, solved
from scipy.linalg import null_space
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.following.follower import LostError, aspect_of, follower
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance

STEP = 0.012  # of the path, between the points of the differences
STENCILS = {  # central, of order 6
    1: np.array([-1, 9, -45, 0, 45, -9, 1]) / 60,
    2: np.array([2, -27, 270, -490, 270, -27, 2]) / 180,
}
NAMES = list(CASES)


def followed(case_):
    return follower(case_.robot, case_.path.at_s, case_.start, 0.0)


def around(case_, held, middle, step):
    """Return joints at seven values of s around one, (7, n), each from the last."""
    s = middle + step * np.arange(-3, 4)
    rows, near = [], case_.start
    for at in np.concatenate([np.linspace(0, s[0], 6)[1:-1], s]):
        near = solved(case_, at, held, near)
        rows.append(near)
    return s, np.array(rows[-7:])


@pytest.mark.parametrize("name", few(NAMES, 4))
def test_values_and_derivatives_by_place(name):
    made = CASES[name]
    arm, length = followed(made), made.path.length
    s, peers = around(made, arm.held, 0.4 * length, STEP * length)
    exact = arm.exact(s, "right", peers + 0.01 * np.random.default_rng(0).normal(size=peers.shape))
    np.testing.assert_allclose(exact[0], peers, rtol=0, atol=1e-11)
    for order, stencil in STENCILS.items():
        difference = stencil @ peers / (STEP * length) ** order
        scale = np.abs(exact[order]).max() + 1
        np.testing.assert_allclose(exact[order][3], difference, rtol=0, atol=3e-6 * scale)


@pytest.mark.parametrize(
    "name", [name for name in NAMES if "arc" in name or "yaw" in name or "pitch" in name]
)
def test_derivatives_by_time(name):
    made = CASES[name]
    arm, length = followed(made), made.path.length
    law = PiecewisePolynomial(np.array([0.0, 2.0]), np.array([0.05, 0.1, 0.1, 0.0])[:, None, None] * length)
    motion = motion_along(made.path, law, law.breaks, Tolerance())
    step, middle = 0.02, 0.9
    times = middle + step * np.arange(-3, 4)
    rows, near = [], made.start
    for time in times:
        near = solved(made, law.evaluate(time)[0], arm.held, near)
        rows.append(near)
    timed = type(arm)(arm.robot, motion.reference_at, arm.start, arm.held)
    exact = timed.exact(np.array([middle]), "right", np.array([rows[3]]))[:, 0]
    for order, stencil in STENCILS.items():
        difference = stencil @ np.array(rows) / step**order
        np.testing.assert_allclose(
            exact[order], difference, rtol=0, atol=3e-6 * (np.abs(exact[order]).max() + 1)
        )


@pytest.mark.parametrize("name", NAMES)
def test_what_is_held_is_what_the_target_leaves_free(name):
    made = CASES[name]
    arm = followed(made)
    free = null_space(numeric_slopes(made, 0.0, made.start), rcond=1e-6).T
    assert len(arm.held) == made.free == len(free)
    np.testing.assert_allclose(arm.held @ arm.held.T, np.eye(made.free), atol=1e-12)
    np.testing.assert_allclose(arm.held.T @ arm.held, free.T @ free, atol=1e-6)


@pytest.mark.parametrize("name", few([name for name in NAMES if CASES[name].free], 5))
def test_what_is_free_comes_back_with_the_tool(name):
    """Held directions make joints a function of s: to the end and back leads to the start."""
    made = CASES[name]
    arm = followed(made)
    there = np.linspace(0, made.path.length, 13)
    q = made.start
    for at in np.concatenate([there, there[::-1]]):
        q = arm.exact(np.array([at]), "right", q[None])[0, 0]
        assert np.abs(off(made, at, q[None])).max() < 1e-9
        assert np.abs(arm.held @ (q - made.start)).max(initial=0) < 1e-10
    np.testing.assert_allclose(q, made.start, rtol=0, atol=1e-9)


def test_a_guess_on_no_branch_is_lost_with_its_place():
    made = CASES["ur5e, pose"]
    arm = followed(made)
    s = np.array([0.03, 0.01, 0.02])
    guess = np.tile(made.start, (3, 1))
    guess[0] += 2.0
    guess[2] -= 2.0
    with pytest.raises(LostError) as caught:
        arm.exact(s, "right", guess)
    np.testing.assert_array_equal(caught.value.s, [0.02, 0.03])


def test_out_of_reach_is_lost_with_the_distance():
    made = case("rrp", [0.3, 0.5, 0.3], "none", move=(0.05, 0.0, 0.0))
    far = case("planar3r", [0.3, 0.05, 0.02], "yaw", "x")
    assert made.path.length == pytest.approx(0.05)
    arm = followed(far)
    beyond = arm.reference_at

    def stretched(s, side):
        reference = beyond(s, side)
        reference.poses[:, :3, 3] *= 3.0
        return reference

    with pytest.raises(LostError) as caught:
        type(arm)(arm.robot, stretched, arm.start, arm.held).exact(np.array([0.01]), "right", far.start[None])
    assert caught.value.s.tolist() == [0.01]


def test_the_other_branch_is_no_answer():
    """An elbow arm's mirror image has the same tool: the sign of the determinant tells them apart."""
    made = CASES["cobra600, yaw of x"]
    arm = followed(made)
    mirror = made.start.copy()
    k = np.arctan2(0.275 * np.sin(1.5), 0.325 + 0.275 * np.cos(1.5))
    mirror[0] += 2 * k
    mirror[1] *= -1
    mirror[3] += 2 * k - 2 * 1.5  # the heading is q1 + q2 - q4
    assert np.abs(off(made, 0.0, mirror[None])).max() < 1e-12
    assert arm.exact(np.zeros(1), "right", made.start[None])[0, 0] == pytest.approx(made.start)
    with pytest.raises(LostError):
        arm.exact(np.zeros(1), "right", mirror[None])
    ahead = arm.exact(np.array([1e-3]), "right", made.start[None])[0]
    for order in ([0, 1], [1, 0]):
        places, guesses = np.array([1e-3, 0.0])[order], np.stack([ahead[0], mirror])[order]
        with pytest.raises(LostError) as caught:  # one of two is enough, and it is the one that is told
            arm.exact(places, "right", guesses)
        assert caught.value.s.tolist() == [0.0]
    with pytest.raises(LostError) as caught:
        arm.exact(np.array([1e-3, 0.0]), "right", np.stack([mirror, mirror]))
    assert caught.value.s.tolist() == [0.0, 1e-3]


@pytest.mark.parametrize("name", ["puma560, direction", "ur5e, direction of x", "panda, direction"])
def test_a_direction_has_a_hand_too(name):
    made = CASES[name]
    arm = followed(made)
    assert abs(arm.aspect.sign) == 1.0
    other = replace(arm, aspect=replace(arm.aspect, sign=-arm.aspect.sign))
    with pytest.raises(LostError):
        other.exact(np.zeros(1), "right", made.start[None])


def test_a_singular_start_has_no_hand():
    made = case("puma560", [0.2, 0.7, -0.8, 0.4, 0.0, -0.3])
    assert followed(made).aspect.sign == 0.0


def test_joint_values_that_are_a_quarter_of_a_radian_from_the_guess_are_another_branch():
    made = CASES["ur5e, pose"]
    arm = followed(made)
    for off_by, fits in ((0.2, True), (-0.2, True), (0.27, False), (-0.27, False)):
        guess = made.start + off_by * np.eye(6)[5]
        if fits:
            assert arm.exact(np.zeros(1), "right", guess[None])[0, 0] == pytest.approx(made.start, abs=1e-9)
        else:
            with pytest.raises(LostError) as caught:
                arm.exact(np.zeros(1), "right", guess[None])
            assert caught.value.s.tolist() == [0.0]


def test_an_orientation_that_is_missed_alone_is_lost():
    made = case("cartesian", [0.3, 0.2, 0.4], turn=(0.01, 0.0, 0.0))
    with pytest.raises(LostError) as caught:
        followed(made).exact(np.array([made.path.length]), "right", made.start[None] + 0.05)
    assert caught.value.s.tolist() == [made.path.length]


@pytest.mark.parametrize("beyond", [1e-3, 1e-6, -1e-6, 3e-9])
def test_a_little_out_of_reach_is_lost_too(beyond):
    """An arm that is stretched along x, or against it, and a tool that goes on."""
    made = case("planar3r", [0.0 if beyond > 0.0 else np.pi, 0.0, 0.0], "yaw", "x")
    arm = followed(made)
    outwards = arm.reference_at

    def further(s, side):
        reference = outwards(np.zeros_like(s), side)
        reference.poses[:, 0, 3] += beyond
        return reference

    with pytest.raises(LostError):
        type(arm)(arm.robot, further, arm.start, arm.held).exact(np.zeros(1), "right", made.start[None])


def test_the_aspect_of_dependent_rows_is_told_where_they_span_the_same_space():
    """Rows of a plane arm with a third that no joint changes: their mirror image is the other aspect."""
    reference, poses = SimpleNamespace(orientation="none"), np.eye(4)[None]
    rows = np.array([[[1.0, 0.2], [0.3, 1.0], [0.0, 0.0]]])
    aspect = aspect_of(reference, poses, rows)
    assert abs(aspect.sign) == 1.0
    mirrored, other = rows * [[1.0], [-1.0], [1.0]], rows[:, [0, 2, 1]]
    tilted = np.array([[[1.0, 0.2], [-0.3, -1.0], [-0.5, -0.5]]])
    for changed, expected in (
        (rows, False),
        (2 * rows, False),
        (mirrored, True),
        (other, False),
        (tilted, False),
    ):
        assert aspect.changed(reference, poses, changed).tolist() == [expected]
    assert aspect_of(reference, poses, rows * [[1.0], [0.0], [0.0]]).sign == 0.0
