"""Rows of the limits of a tool, against the accelerations that they allow: arcs, turning tools, oblique parameters."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.curves.piecewise import Array, Side
from trajcli.curves.time_optimal.time_law import LawPieces, law_pieces
from trajcli.kinematics.following.tool_path import SpeedLimits
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_constraint import ToolConstraint

TURN = np.array([0.3, -0.4, 0.2])


@dataclass
class Screwed:
    """A tool on a helix of radius 0.3 m that turns about one axis, or about two, by s or by an uneven parameter.

    Attributes:
        second: Rate about a second axis: the axis of the turning turns.
        uneven: Part of s^2 in the parameter of the helix.
        radius: m.
        slow: Part of s^2 in the turning.
    """

    second: float = 0.0
    uneven: float = 0.0
    radius: float = 0.3
    slow: float = 0.0
    length: float = 1.0

    @property
    def poses(self) -> Screwed:
        return self

    def evaluate(self, s: Array, side: Side = "right") -> tuple[Array, Array, Array]:
        """Return poses and derivatives by s, written out by hand."""
        del side
        c, r = self.uneven, self.radius
        g, g1, g2 = (each[:, None] for each in (s + c * s**2, 1 + 2 * c * s, 2 * c + 0 * s))
        cosine, sine, one = np.cos(g), np.sin(g), np.ones_like(g)
        p = np.hstack([r * cosine, r * sine, 0.2 * g])
        by_g, by_gg = (
            np.hstack([-r * sine, r * cosine, 0.2 * one]),
            np.hstack([-r * cosine, -r * sine, 0 * one]),
        )
        first = Rotation.from_rotvec((s + self.slow * s**2)[:, None] * TURN)
        other = self.second * np.array([0.0, 0.0, 1.0])
        both = first * Rotation.from_rotvec(s[:, None] * other)
        poses = np.tile(np.eye(4), (s.size, 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = both.as_matrix(), p
        speed = (1 + 2 * self.slow * s)[:, None] * TURN
        carried = first.apply(np.tile(other, (s.size, 1)))
        w = speed + carried
        w1 = 2 * self.slow * TURN + np.cross(speed, carried)
        return poses, np.hstack([by_g * g1, w]), np.hstack([by_gg * g1**2 + by_g * g2, w1])


GRID = np.linspace(0.0, 1.0, 9)


def shares(tool: Screwed, x: Array, u: Array, limits: ToolLimits) -> Array:
    """Return speed, angular speed and both accelerations over their limits, (4, p), at sd^2 x and sdd u."""
    _, first, second = tool.evaluate(GRID)
    rates = [first * np.sqrt(x)[:, None], second * x[:, None] + first * u[:, None]]
    sizes = [np.linalg.norm(rate[:, part], axis=1) for rate in rates for part in (slice(0, 3), slice(3, 6))]
    bounds = limits.speed, limits.angular_speed, limits.acceleration, limits.angular_acceleration
    return np.array([size / bound for size, bound in zip(sizes, bounds, strict=True)])


def farthest(constraint: ToolConstraint, angle: float, side: Side = "right") -> tuple[Array, Array]:
    """Return sd^2 and sdd (p,) at the border of what rows allow, in a direction of their plane."""
    rows = constraint.rows(GRID, side)
    x, u = max(np.sin(angle), 0.0), np.cos(angle)
    uses = np.max((rows.a * u + rows.b * x) / rows.c, axis=1)
    with np.errstate(divide="ignore"):
        scale = np.minimum(1 / np.maximum(uses, 1e-300), rows.cap / max(x, 1e-300))
    return scale * x, scale * u


ANGLES = np.linspace(0.0, np.pi, 41)


def border(constraint: ToolConstraint, tool: Screwed) -> Array:
    """Return the shares (4, angles, p) that the border of the rows uses."""
    used = [shares(tool, *farthest(constraint, angle), constraint.limits) for angle in ANGLES]
    return np.stack(used, axis=1)


@pytest.mark.parametrize("uneven", [0.0, 0.7, -0.4])
def test_rows_of_an_acceleration_fill_a_circle_to_98_percent(uneven: float) -> None:
    tool = Screwed(uneven=uneven)
    used = border(ToolConstraint(tool, ToolLimits(acceleration=2.0), oblique=uneven != 0), tool)[2]
    assert used.max() <= 1 + 1e-12
    assert used.min() >= np.cos(np.pi / 16) - 1e-12
    assert used.max(axis=0).min() >= 0.999


def test_on_a_straight_line_the_whole_acceleration_is_allowed() -> None:
    tool = Screwed(radius=0.0)
    used = border(ToolConstraint(tool, ToolLimits(acceleration=2.0)), tool)[2]
    np.testing.assert_allclose(used[[0, -1]], 1.0, rtol=1e-12)
    both = [farthest(ToolConstraint(tool, ToolLimits(acceleration=2.0)), angle)[1] for angle in (0.0, np.pi)]
    np.testing.assert_allclose(both, [[10.0] * 9, [-10.0] * 9])


@pytest.mark.parametrize("slow", [0.0, 0.6, -0.3])
def test_about_one_axis_the_whole_angular_acceleration_is_allowed(slow: float) -> None:
    tool = Screwed(slow=slow)
    used = border(ToolConstraint(tool, ToolLimits(angular_acceleration=3.0)), tool)[3]
    assert used.max() <= 1 + 1e-12
    np.testing.assert_allclose(used[[0, 7, -7, -1]], 1.0, rtol=1e-9)


@pytest.mark.parametrize("slow", [0.0, 0.6])
@pytest.mark.parametrize("second", [0.5, 0.02])
def test_about_two_axes_the_angular_acceleration_is_kept(second: float, slow: float) -> None:
    """Along the axis 0.6 of it are used, across 0.8: together all of it where both are."""
    tool = Screwed(second=second, slow=slow)
    constraint = ToolConstraint(tool, ToolLimits(angular_acceleration=3.0))
    used = border(constraint, tool)[3]
    assert used.max() <= 1 + 1e-12
    np.testing.assert_allclose(used[[0, -1]], 0.6, rtol=1e-12)
    _, first, change = tool.evaluate(GRID)
    axis = first[:, 3:] / np.linalg.norm(first[:, 3:], axis=1)[:, None]
    across = np.linalg.norm(np.cross(change[:, 3:], axis), axis=1)
    np.testing.assert_allclose(constraint.rows(GRID, "right").cap * across, 0.8 * 3.0, rtol=1e-9)


@pytest.mark.parametrize(
    "limits", [ToolLimits(speed=0.5), ToolLimits(angular_speed=0.4), ToolLimits(0.5, inf, inf, 0.4)]
)
def test_the_cap_is_the_slower_of_both_speeds(limits: ToolLimits) -> None:
    tool = Screwed(second=0.5, uneven=0.3)
    for found in (
        ToolConstraint(tool, limits).rows(GRID, "right").cap,
        ToolConstraint(tool, limits).largest(GRID, "right"),
    ):
        np.testing.assert_allclose(shares(tool, found, 0 * found, limits)[:2].max(axis=0), 1.0, rtol=1e-12)


@pytest.mark.parametrize("uneven", [0.0, 0.7])
def test_the_largest_speed_is_that_whose_acceleration_across_the_path_is_allowed(uneven: float) -> None:
    """On the helix it goes 0.3 g'^2 sd^2 to its axis, and the rows allow no more than a fiftieth less."""
    tool, limits = Screwed(uneven=uneven), ToolLimits(acceleration=2.0)
    constraint = ToolConstraint(tool, limits, oblique=uneven != 0)
    largest = constraint.largest(GRID, "right")
    np.testing.assert_allclose(0.3 * (1 + 2 * uneven * GRID) ** 2 * largest, 2.0, rtol=1e-9)
    both = ToolConstraint(tool, ToolLimits(speed=0.01, acceleration=2.0)).largest(GRID, "right")
    assert (both < 0.01 * largest).all()
    allowed = np.max([farthest(constraint, angle)[0] for angle in ANGLES], axis=0)
    assert (allowed <= largest * (1 + 1e-12)).all()
    assert (allowed >= 0.95 * largest).all()


def test_chords_and_turns_take_as_long_as_at_the_larger_limits_of_both_their_ends() -> None:
    tool = Screwed(second=0.5)
    poses = tool.evaluate(GRID)[0]
    chords = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    rotations = Rotation.from_matrix(poses[:, :3, :3])
    turns = (rotations[:-1].inv() * rotations[1:]).magnitude()
    for speed, angular in ((0.2, 100.0), (100.0, 0.1)):
        limits = ToolLimits(speed=speed, angular_speed=angular)
        expected = np.maximum(chords / speed, turns / angular)
        np.testing.assert_allclose(ToolConstraint(tool, limits).shortest(GRID), expected, rtol=1e-9)
    for first, second in ((0.1, 0.4), (0.4, 0.1)):
        both = np.array([first, second]), np.array([50.0, 50.0])
        steps = SpeedLimits(np.array([0.0, 0.3125, 1.0]), (0, 1, 2), *both)
        stepping = ToolConstraint(tool, ToolLimits(speed=7.0), steps).shortest(GRID)
        fastest = np.where(GRID[1:] < 0.3125, first, np.where(GRID[:-1] > 0.3125, second, 0.4))
        np.testing.assert_allclose(stepping, chords / fastest, rtol=1e-9)


def test_speeds_that_step_have_two_sides() -> None:
    tool = Screwed()
    steps = SpeedLimits(np.array([0.0, 0.5, 1.0]), (0, 1, 2), np.array([0.1, 0.4]), np.array([inf, inf]))
    constraint = ToolConstraint(tool, ToolLimits(speed=7.0), steps)
    size = np.hypot(0.3, 0.2)
    for side, at in (("left", 0.1), ("right", 0.4)):
        for cap in (constraint.rows(GRID, side).cap, constraint.largest(GRID, side)):  # type: ignore[arg-type]
            np.testing.assert_allclose(np.sqrt(cap[[1, 4, 7]]) * size, [0.1, at, 0.4], rtol=1e-12)


@pytest.mark.parametrize("oblique", [False, True])
def test_a_deceleration_is_one_of_the_law(oblique: bool) -> None:
    tool = Screwed()
    constraint = ToolConstraint(tool, ToolLimits(acceleration=20.0), oblique=oblique, deceleration=1.5)
    for angle, wanted in ((0.0, 20.0 / np.hypot(0.3, 0.2)), (np.pi, -1.5)):
        np.testing.assert_allclose(farthest(constraint, angle)[1], wanted, rtol=1e-12)
    law = law_pieces(np.array([0.0, 0.5, 1.0]), np.array([0.0, 2.0, 0.0]))
    faster = np.hypot(2.0 * np.hypot(0.3, 0.2), 0.3 * 2.0)  # along the helix, and to its axis where sd^2 is 2
    np.testing.assert_allclose(constraint.excess(law)[1], [faster / 20.0, 2.0 / 1.5], rtol=1e-9)
    free = ToolConstraint(tool, ToolLimits(acceleration=20.0)).excess(law)[1]
    assert free.max() < 0.5


@pytest.mark.parametrize(
    ("limits", "deceleration", "bounded"),
    [
        (ToolLimits(), inf, False),
        (ToolLimits(speed=1.0, angular_speed=1.0), inf, False),
        (ToolLimits(acceleration=1.0), inf, True),
        (ToolLimits(angular_acceleration=1.0), inf, True),
        (ToolLimits(), 2.0, True),
    ],
)
def test_any_acceleration_bounds_the_law(limits: ToolLimits, deceleration: float, bounded: bool) -> None:
    assert ToolConstraint(Screwed(), limits, deceleration=deceleration).bounds_sdd == bounded


def test_what_a_piece_uses_between_its_ends_counts() -> None:
    """With s = 3 t^2 - 2 t^3 the speed is 1.5 in the middle, and zero at both ends."""
    law = LawPieces(np.array([1.0]), np.array([[-2.0], [3.0], [0.0], [0.0]]))
    found = ToolConstraint(Screwed(), ToolLimits(speed=0.4)).excess(law)[0]
    assert 0.95 <= float(found[0]) / (1.5 * np.hypot(0.3, 0.2) / 0.4) <= 1 + 1e-9
