"""Zones: proven bounds of distance, angle and joints against dense samples of screw exponentials."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_robots import exponentials, random_arm, screws
from scipy.spatial.transform import Rotation

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.zone import Zone, ZoneAround

SAMPLES = 200


def motion(rng, joints, size, pieces=3):
    """Return a curve of cubics about a corner at its start, and that corner."""
    corner = rng.uniform(-1, 1, joints)
    coefficients = rng.uniform(-1, 1, (4, pieces, joints)) * size
    coefficients[-1] = corner
    return PiecewisePolynomial(np.linspace(0.0, 0.6, pieces + 1), coefficients), corner


def sampled(robot, curve, corner):
    """Return distances and angles of the tool from the corner, and how far the joints are, densely."""
    times = np.concatenate(
        [
            np.linspace(a, b, SAMPLES, endpoint=False)
            for a, b in zip(curve.breaks, curve.breaks[1:], strict=False)
        ]
    )
    joints = np.concatenate([curve.evaluate(times), curve.piece_ends()[1]])
    (at,), poses = (exponentials(*screws(robot), rows) for rows in (corner[None], joints))
    distance = np.array([np.linalg.norm(pose[:3, 3] - at[:3, 3]) for pose in poses])
    angle = np.array([Rotation.from_matrix(at[:3, :3].T @ pose[:3, :3]).magnitude() for pose in poses])
    return distance.max(), angle.max(), np.abs(joints - corner).max(axis=0)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_share_of_a_zone_is_bounded_for_all_times_and_no_higher_than_a_millionth(seed, convention):
    rng = np.random.default_rng(seed)
    robot = random_arm(rng, 2 + seed % 5, convention)
    curve, corner = motion(rng, len(robot.joints), 0.3)
    distance, angle, joints = sampled(robot, curve, corner)
    for zone, known in (
        (Zone(position=2 * distance), distance / (2 * distance)),
        (Zone(position=0.5 * distance), 2.0),
        (Zone(orientation=0.5 * angle), 2.0) if angle > 1e-6 else (Zone(position=0.1 * distance), 10.0),
        (Zone(joints=tuple(0.5 * joints)), 2.0),
    ):
        share, when = ZoneAround(robot, corner, zone).largest_share(curve)
        assert known * (1 - 1e-9) <= share <= max(known * (1 + 2e-4), 1.0)
        assert 0 <= when <= 0.6


@pytest.mark.parametrize("kind", ["position", "orientation"])
def test_a_zone_that_is_left_between_the_ends_of_a_piece_is_left(kind):
    rng = np.random.default_rng(5)
    robot = random_arm(rng, 3, "standard")
    corner = rng.uniform(-1, 1, 3)
    rate = rng.uniform(0.5, 1, 3)
    bow = np.stack([-rate, rate, corner])[:, None, :]  # q = corner + rate (t - t^2): back at its end
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), bow)
    distance, angle, _ = sampled(robot, curve, corner)
    size = {"position": distance, "orientation": angle}[kind]
    inside, outside = (
        ZoneAround(robot, corner, Zone(**{kind: size * part})).largest_share(curve)[0]
        for part in (1.01, 0.99)
    )
    assert inside <= 1 + 1e-6 < outside


def test_the_border_of_a_zone_is_proven_to_a_millionth():
    """A motion that begins on its border and goes inwards is within the zone: the proof ends there."""
    rng = np.random.default_rng(7)
    robot = random_arm(rng, 4, "standard")
    corner = rng.uniform(-1, 1, 4)
    line = np.stack([-0.1 * np.ones(4), corner + 0.1])[:, None, :]
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), line)
    around = ZoneAround(robot, corner, Zone(position=1.0))
    radius = float(around.offsets(curve.evaluate(np.zeros(1)))[0][0])
    for size, left in ((1 + 1e-9, False), (1 - 1e-4, True)):
        share, _ = ZoneAround(robot, corner, Zone(position=radius * size)).largest_share(curve)
        assert (share > 1 + 1e-6) == left


def test_a_zone_of_several_measures_is_the_tightest_of_them():
    rng = np.random.default_rng(3)
    robot = random_arm(rng, 3, "standard")
    curve, corner = motion(rng, 3, 0.2)
    joints = curve.evaluate(np.linspace(0, 0.6, 7))
    around = ZoneAround(robot, corner, Zone(position=1.0, orientation=1.0, joints=(1.0, 1.0, 1.0)))
    distance, angle = around.offsets(joints)
    most = np.max([distance, angle, np.abs(joints - corner).max(axis=1)], axis=0)
    np.testing.assert_allclose(around.shares(joints), most, rtol=1e-12)


@pytest.mark.parametrize(
    ("zone", "stops"),
    [
        (Zone(), True),
        (Zone(position=0.0), True),
        (Zone(position=0.1), False),
        (Zone(position=0.1, orientation=0.0), True),
        (Zone(joints=(0.0, 0.0)), True),
        (Zone(joints=(0.0, 0.1)), False),
    ],
)
def test_a_zone_of_no_size_stops(zone, stops):
    assert zone.stops == stops
