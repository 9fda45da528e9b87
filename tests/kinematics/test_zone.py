"""Zones: proven bounds of distance, angle and joints against dense samples of screw exponentials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle_robots import exponentials, random_arm, screws
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.kinematics.zone import Zone, ZoneAround, _Intervals

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


@pytest.mark.parametrize("seed", few(range(6), 3))
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


@pytest.mark.parametrize("measure", ["position", "orientation", "joints"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_zone_holds_what_no_measure_leaves_by_more_than_is_conceded(measure: str, sign: float):
    """One measure is at its end, the others are wide: half a concession further it holds, two further it does not."""
    robot, corner = random_arm(np.random.default_rng(5), 3, "standard"), np.array([0.3, -0.4, 0.9])
    joints = corner + sign * np.array([[0.02, 0.01, 0.03]])
    wide = ZoneAround(robot, corner, Zone(position=9.0, orientation=3.0, joints=(1.0, 1.0, 1.0)))
    (distance,), (angle,) = wide.offsets(joints)
    sizes = {"position": distance, "orientation": angle, "joints": np.abs(joints - corner)[0]}
    more = np.array([1e-4, 0.0] if measure == "position" else [0.0, 1e-4])
    for further, held in ((0.5, True), (2.0, False)):
        size = sizes[measure] - further * more.max()
        tight = {measure: tuple(size) if measure == "joints" else float(size)}
        around = replace(wide, zone=replace(wide.zone, **tight))
        assert around.holds(joints, more[None]) == [held]


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


def arm(*rows):
    """Return an arm of standard DH rows (type, a, alpha)."""
    joints = tuple(Joint(f"j{k}", kind, a=a, alpha=alpha) for k, (kind, a, alpha) in enumerate(rows))
    return Robot("arm", joints, unlimited(len(joints)), "standard", np.eye(4), np.eye(4))


LEVER = ("revolute", 1.0, 0.0)
SLIDE = ("prismatic", 0.0, 0.0)
ACROSS = ("revolute", 0.0, np.pi / 2)
ONE_TERM = {
    "a lever that speeds up": (arm(LEVER), [[2.0], [0.0], [0.3]]),
    "a lever at constant speed": (arm(LEVER), [[0.0], [2.0], [0.3]]),
    "two levers at constant speed": (arm(LEVER, LEVER), [[0.0, 0.0], [1.0, 1.5], [0.3, 0.1]]),
    "a short lever in front of a long one": (
        arm(("revolute", 0.01, 0.0), LEVER),
        [[0.0, 0.0], [2.0, 0.1], [0.3, 0.1]],
    ),
    "a slide that speeds up": (
        arm(SLIDE, ("revolute", 0.001, 0.0)),
        [[0.02, 0.0], [0.0, 0.0], [0.0, 0.2]],
    ),
    "a slide on a turning arm": (arm(ACROSS, SLIDE), [[0.0, 0.0], [0.5, 4.0], [0.0, 0.0]]),
    "a short lever": (arm(("revolute", 0.01, 0.0)), [[0.0], [2.0], [0.3]]),
    "a slide that carries a lever": (arm(SLIDE, LEVER), [[0.0, 0.0], [2.0, 0.1], [0.0, 0.3]]),
    "a short slide on a turning arm": (arm(ACROSS, SLIDE), [[0.0, 0.0], [3.0, 0.2], [0.0, 0.0]]),
    "a slide that travels far and turns": (arm(ACROSS, SLIDE), [[0.0, 0.0], [3.0, 20.0], [0.0, 0.01]]),
    "a slide at the axis of an arm that turns slowly": (
        arm(ACROSS, SLIDE),
        [[0.0, 0.0], [0.01, 4.0], [0.0, 0.0]],
    ),
    "a lever that stands upright": (arm(ACROSS, LEVER), [[0.0, 2.0], [0.0, 0.0], [0.0, np.pi / 2]]),
}


@pytest.mark.parametrize("name", ONE_TERM)
def test_each_term_of_the_bound_of_the_tools_acceleration_counts(name):
    """Arms in which one term dominates: bound over largest value within 1 and 30, by differences of poses."""
    robot, rows = ONE_TERM[name]
    coefficients, length, step = np.array(rows)[:, None, :], 0.5, 1e-4
    curve = PiecewisePolynomial(np.array([0.0, length]), coefficients)
    times = np.linspace(step, length - step, 300)
    before, here, after = (
        exponentials(*screws(robot), curve.evaluate(times + shift))[:, :3, 3] for shift in (-step, 0.0, step)
    )
    largest = np.linalg.norm(after - 2 * here + before, axis=1).max() / step**2
    pieces = _Intervals(curve.breaks[:-1], curve.lengths, curve.coefficients)
    around = ZoneAround(robot, np.array(rows[-1]), Zone(position=1.0))
    (bend,), _ = around._tool_rates(pieces.ends()[0], *pieces.rates(), pieces.lengths)
    assert 1 - 1e-5 <= bend / largest <= 30


@pytest.mark.parametrize(
    ("zone", "most"), [(Zone(position=1.0), 0.25), (Zone(joints=(1.0,)), 0.25), (Zone(orientation=1.0), 0.25)]
)
def test_the_first_look_at_an_interval_is_no_lower_than_what_is_inside(zone, most):
    """A joint that goes out and back within one interval, q = t - t^2: its ends show nothing of it."""
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[-1.0]], [[1.0]], [[0.0]]]))
    pieces = _Intervals(curve.breaks[:-1], curve.lengths, curve.coefficients)
    at_ends, bound = ZoneAround(arm(LEVER), np.zeros(1), zone)._bounds(pieces)
    assert at_ends[0] == pytest.approx(0.0, abs=1e-9)
    assert most * (1 - 1e-2) <= bound[0] <= 4 * most


@pytest.mark.parametrize("joints", [1, 2])
def test_an_angle_grows_as_fast_as_all_turns_together(joints):
    """There and back at nearly one speed: with x = 1 - 2 t the speed is (3 x - x^3) / 2, the angle 5 / 16 at x = 0.

    Joints with parallel axes share it.
    """
    coefficients = np.array([1.0, -2.0, 0.0, 1.0, 0.0])[:, None, None] * np.full(joints, 1.0 / joints)
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    angles = curve.evaluate(np.array([0.0, 0.5, 1.0])).sum(axis=1)
    assert angles == pytest.approx([0.0, 0.3125, 0.0])
    around = ZoneAround(arm(*[LEVER] * joints), np.zeros(joints), Zone(orientation=0.95 * 0.3125))
    assert around.largest_share(curve)[0] == pytest.approx(1 / 0.95, rel=1e-5)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("mover", [0, 1])
@pytest.mark.parametrize("late", [False, True])
def test_each_joint_is_looked_at_on_both_sides_and_in_both_halves_of_a_piece(side, mover, late):
    """Up and back within one piece, t^4 (1 - t), at most 4^4 / 5^5 at t = 0.8; or backward in time."""
    up = np.poly1d([-1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    row = up if late else up(np.poly1d([-1.0, 1.0]))
    coefficients, top = np.zeros((6, 1, 2)), 4**4 / 5**5
    coefficients[:, 0, mover] = side * row.coeffs
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    around = [
        ZoneAround(arm(LEVER, LEVER), np.zeros(2), Zone(joints=(part * top,) * 2)) for part in (0.9, 2.0)
    ]
    share, when = around[0].largest_share(curve)
    assert share == pytest.approx(1 / 0.9, rel=1e-5)
    assert when == pytest.approx(0.8 if late else 0.2, abs=1e-2)
    assert 0.5 <= around[1].largest_share(curve)[0] <= 1.0
    at_top = np.zeros((1, 2))
    at_top[0, mover] = side * top
    assert around[1].shares(at_top) == pytest.approx([0.5])


def test_what_takes_too_many_parts_is_not_proven(monkeypatch):
    monkeypatch.setattr("trajcli.kinematics.zone._AT_ONCE", 0)
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([-1.0, 1.0, 0.0]).reshape(3, 1, 1))
    around = ZoneAround(arm(LEVER), np.zeros(1), Zone(joints=(0.26,)))
    assert around.largest_share(curve)[0] in (pytest.approx(0.25 / 0.26, rel=0.05), np.inf)
    assert ZoneAround(arm(LEVER), np.zeros(1), Zone(joints=(0.2,))).largest_share(curve)[0] == np.inf


@pytest.mark.parametrize("where", ["early", "late", "middle"])
@pytest.mark.parametrize("kind", ["position", "orientation", "joints"])
def test_what_ends_near_the_border_and_passes_it_in_between_is_seen(kind, where):
    """A joint on its way, and back: its ends use much of the zone, and 1.02 of it are used for a short time."""
    row = {
        "early": [-2.8, 1.0, 1.02 - 1 / 11.2],  # largest after 1 / 5.6
        "late": [-2.8, 4.6, 1.02 - 4.6**2 / 11.2],  # after 4.6 / 5.6
        "middle": [-0.48, 0.48, 0.9],
    }[where]
    joint = SLIDE if kind == "position" else LEVER
    zone = Zone(joints=(1.0,)) if kind == "joints" else Zone(**{kind: 1.0})
    for side in (1.0, -1.0):
        curve = PiecewisePolynomial(np.array([0.0, 1.0]), side * np.array(row)[:, None, None])
        share, when = ZoneAround(arm(joint), np.zeros(1), zone).largest_share(curve)
        assert share == pytest.approx(1.02, rel=1e-5)
        assert when == pytest.approx(row[1] / (-2 * row[0]), abs=1e-2)
        wide = Zone(joints=(1.03,)) if kind == "joints" else Zone(**{kind: 1.03})
        assert ZoneAround(arm(joint), np.zeros(1), wide).largest_share(curve)[0] <= 1.0


def test_each_measure_of_a_zone_counts_alone_and_grows_with_it():
    around = arm(("revolute", 0.5, 0.0), SLIDE)
    joints = np.array([[0.2, 0.0], [0.0, 0.3], [-0.2, -0.4]])
    distance, angle = ZoneAround(around, np.zeros(2), Zone()).offsets(joints)
    for zone, used in (
        (Zone(position=0.25), distance / 0.25),
        (Zone(orientation=0.1), angle / 0.1),
        (Zone(joints=(0.4, 0.8)), [0.5, 0.375, 0.5]),
        (Zone(position=9.0, orientation=0.1), np.maximum(angle / 0.1, distance / 9.0)),
        (Zone(position=9.0, orientation=9.0, joints=(9.0, 0.1)), [0.2 / 9.0, 3.0, 4.0]),
    ):
        shares = ZoneAround(around, np.zeros(2), zone).shares(joints)
        assert shares == pytest.approx(used)
        assert ZoneAround(around, np.zeros(2), zone.scaled(2.0)).shares(joints) == pytest.approx(shares / 2)


@pytest.mark.parametrize("back", [False, True])
def test_a_motion_that_is_furthest_out_where_it_begins_or_ends_says_so(back):
    row = [[0.9], [-1.2]] if not back else [[0.9], [-0.3]]  # from -1.2 to -0.3, or from -0.3 to 0.6
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array(row)[:, None, :])
    share, when = ZoneAround(arm(LEVER), np.zeros(1), Zone(orientation=0.5)).largest_share(curve)
    assert share == pytest.approx(1.2 / 0.5 if not back else 0.6 / 0.5, rel=1e-6)
    assert when == (1.0 if back else 0.0)


def bump(sizes: list[float], pieces: int = 1) -> PiecewisePolynomial:
    """Return the curve that goes from 0 to sizes and back, 4 u (1 - u), in each piece of 1 s."""
    rows = np.array([-4.0, 4.0, 0.0])[:, None, None] * np.array(sizes)
    return PiecewisePolynomial(np.arange(pieces + 1.0), np.tile(rows, (1, pieces, 1)))


@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, -1, -1), (1, 0, 1), (0, 1, 1), (1, 1, 0)])
def test_what_all_joints_do_together_counts(signs):
    """A stretched arm of three levers: to first order the tool goes 3, 2 and 1 times what its joints turn."""
    size = 1e-4
    curve = bump([size * sign for sign in signs])
    away = size * abs(np.dot(signs, [3.0, 2.0, 1.0]))
    for share in (1.1, 1.01, 0.99):
        around = ZoneAround(arm(LEVER, LEVER, LEVER), np.zeros(3), Zone(position=away / share))
        found, when = around.largest_share(curve)
        assert found == pytest.approx(share, rel=1e-3) if share > 1 else found <= 1.0
        assert share < 1 or when == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("tight", ["position", "orientation", "joints"])
def test_a_measure_with_room_hides_none_that_has_not(tight):
    """A bump of 0.1 rad of a lever of 1 m: 0.1 rad, and a chord of 2 sin 0.05."""
    sizes = {"position": 2 * np.sin(0.05), "orientation": 0.1, "joints": 0.1}
    for share in (1.2, 0.9):
        zone = {name: size / (share if name == tight else 0.05) for name, size in sizes.items()}
        around = ZoneAround(
            arm(LEVER), np.zeros(1), Zone(zone["position"], zone["orientation"], (zone["joints"],))
        )
        found, _ = around.largest_share(bump([0.1]))
        assert found == pytest.approx(share, rel=1e-4) if share > 1 else found <= 1.0


@pytest.mark.parametrize("pieces", [1, 40])
def test_many_pieces_that_come_near_the_border_are_all_proven_to_stay_within(pieces):
    around = ZoneAround(arm(LEVER, LEVER), np.zeros(2), Zone(position=0.3001, joints=(0.1001, 0.1001)))
    assert around.largest_share(bump([0.1, 0.1], pieces))[0] <= 1.0


@pytest.mark.parametrize("enough", [0.2, 0.8])
def test_what_is_more_than_enough_is_told_to_a_millionth(enough):
    around = ZoneAround(arm(LEVER), np.zeros(1), Zone(joints=(0.2,)))
    found, _ = around.largest_share(bump([0.1]), enough)
    assert 0.5 * (1 - 1e-9) <= found <= max(0.5 * (1 + 2e-6), enough)


@pytest.mark.parametrize("angle", [0.5, 1.5, 2.0, 2.5, 3.1, -2.5])
def test_an_angle_is_that_of_the_turn_up_to_half_a_turn(angle):
    """One joint turns the tool on a lever of 1 m: its chord is 2 sin(angle / 2)."""
    distance, turned = ZoneAround(arm(LEVER), np.full(1, 0.3), Zone()).offsets(np.array([[0.3 + angle]]))
    assert turned == pytest.approx([abs(angle)])
    assert distance == pytest.approx([2 * np.sin(abs(angle) / 2)])


@pytest.mark.parametrize("alone", ["position", "orientation", "joints"])
@pytest.mark.parametrize("over", [0.01, -0.01])
def test_one_measure_of_a_zone_is_enough_to_leave_it(alone, over):
    """0.3 rad of a lever of 1 m, by a chord of 2 sin 0.15."""
    size = {"position": 2 * np.sin(0.15), "orientation": 0.3, "joints": 0.3}[alone] - over
    zone = Zone(**{alone: (size,) if alone == "joints" else size})
    held = ZoneAround(arm(LEVER), np.zeros(1), zone).holds(np.array([[0.3], [-0.3]]), np.zeros((2, 2)))
    assert held.tolist() == [over < 0] * 2


@pytest.mark.parametrize("begins", [0.0, 2.0, -3.0])
def test_the_time_is_that_of_the_curve_whenever_that_begins_and_however_long_its_pieces_are(begins):
    """At 1 rad/s for 1 s and for 3 s more; a bump as high in the middle of 1 s that follow."""
    breaks = begins + np.array([0.0, 1.0, 4.0, 5.0])
    line = np.array([[0.0, 0.0, -4.4], [1.0, 1.0, 4.4], [0.0, 1.0, 0.0]])[:, :, None]
    around = ZoneAround(arm(LEVER), np.zeros(1), Zone(joints=(2.0,)))
    share, when = around.largest_share(PiecewisePolynomial(breaks, line))
    assert (share, when) == (pytest.approx(2.0), pytest.approx(begins + 4.0))
    share, when = around.largest_share(PiecewisePolynomial(breaks[2:], 2.0 * line[:, 2:]))
    assert (share, when) == (pytest.approx(1.1), pytest.approx(begins + 4.5, abs=0.05))
    assert around.largest_share(PiecewisePolynomial(breaks[:2], np.zeros((1, 1, 1)))) == (0.0, begins)


def test_a_slide_that_stands_out_is_a_lever():
    """By 5 m on an arm that turns by 1e-4 rad and back: the tool goes 5e-4 m away."""
    curve = bump([1e-4, 0.0])
    rows = curve.coefficients.copy()
    rows[-1, :, 1] = 5.0
    around = ZoneAround(arm(ACROSS, SLIDE), np.array([0.0, 5.0]), Zone(position=5e-4 / 1.1))
    assert around.largest_share(PiecewisePolynomial(curve.breaks, rows))[0] == pytest.approx(1.1, rel=1e-3)


@pytest.mark.parametrize(("mover", "share"), [(0, 2.0), (1, np.inf)])
def test_a_joint_that_may_not_leave_the_corner_is_out_where_it_does_and_hides_no_other(mover, share):
    corner = np.array([0.3, 0.7])
    robot = random_arm(np.random.default_rng(0), 2, "standard")
    around = ZoneAround(robot, corner, Zone(joints=(0.1, 0.0)))
    coefficients = np.zeros((2, 1, 2))
    coefficients[0, 0, mover], coefficients[1, 0] = 0.2, corner
    found, _ = around.largest_share(PiecewisePolynomial(np.array([0.0, 1.0]), coefficients))
    assert found == pytest.approx(share) or found > 1e9
    (moved,) = around.shares(corner[None] + 0.2 * np.eye(2)[mover])
    assert (moved == pytest.approx(2.0)) == (mover == 0)
    assert moved > 1.0
