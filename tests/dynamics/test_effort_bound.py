"""Bounds of efforts for all t against dense samples, and against motions whose true efforts are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from counted_calls import calls_of
from heavy_arms import random_arm, random_payload
from scipy.optimize import minimize_scalar
from tiers import few

from trajcli.curves import node_bound
from trajcli.dynamics import effort_bound
from trajcli.dynamics.effort_bound import effort_majorants, effort_survey, needed_stretch
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.geometry.power_series import growth
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Robot, point_mass, unlimited

NODES = np.linspace(0.0, 1.0, 9)


def lift(mass: float = 5.0, friction: Friction = Friction(), gravity: float = 9.81) -> InverseDynamics:  # noqa: B008
    """Return one vertical slide: its effort is mass (qdd + gravity) and friction."""
    slide = Joint("lift", "prismatic", friction=friction, link=LinkInertia(mass, (0.1, 0.2, 0.3), (0.0,) * 6))
    robot = Robot("lift", (slide,), unlimited(1), "standard", np.eye(4), np.eye(4))
    return InverseDynamics(robot, np.array([0.0, 0.0, -gravity]))


def dense(dynamics, breaks, coefficients, count=3001):
    """Return the efforts at many times, both sides of each break."""
    efforts = []
    for p, length in enumerate(np.diff(breaks)):
        t = np.linspace(0.0, length, count)
        state = [
            np.stack([np.polyval(np.polyder(row, order), t) for row in coefficients[:, p].T], axis=1)
            for order in range(3)
        ]
        efforts.append(dynamics.effort(*state))
    return np.concatenate(efforts)


def efforts_near(dynamics, breaks, coefficients, time):
    """Return the efforts just before, at and just behind a time: Coulomb friction jumps where a joint turns back."""
    efforts = []
    for t in np.clip(time + np.array([-1e-8, 0.0, 1e-8]), breaks[0], breaks[-1]):
        p = int(np.clip(np.searchsorted(breaks, t, "right") - 1, 0, len(breaks) - 2))
        rows = coefficients[:, p].T
        state = [np.array([np.polyval(np.polyder(row, k), t - breaks[p]) for row in rows]) for k in range(3)]
        efforts.append(dynamics.effort(*state))
    return np.array(efforts)


def random_motion(rng, joints):
    pieces, degree = int(rng.integers(1, 4)), int(rng.integers(1, 6))
    breaks = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.8, pieces))]) + rng.uniform(-1, 1)
    return breaks, rng.normal(size=(degree + 1, pieces, joints)) * rng.uniform(0.1, 4.0)


def random_dynamics(rng, friction):
    joints = int(rng.integers(1, 8))
    arm = random_arm(rng, joints, rng.choice(["standard", "modified"]), friction=friction)
    return InverseDynamics(arm, rng.normal(size=3) * 9, random_payload(rng) if rng.random() < 0.5 else None)


@pytest.mark.parametrize("seed", few(range(30)))
def test_bounds_are_never_below_samples_and_hardly_above(seed):
    require_sound_and_tight(seed)


@pytest.mark.soak
@pytest.mark.parametrize("first", range(0, 1000, 100))
def test_bounds_of_a_thousand_motions(first):
    for seed in range(first, first + 100):
        require_sound_and_tight(seed)


def require_sound_and_tight(seed):
    rng = np.random.default_rng(seed)
    dynamics = random_dynamics(rng, friction=seed % 3 == 0)
    breaks, coefficients = random_motion(rng, len(dynamics.links))
    survey = effort_survey(dynamics, breaks, coefficients)
    efforts = dense(dynamics, breaks, coefficients)
    scale = np.abs(efforts).max(axis=0)
    for sign, peaks in ((1, survey.highest()), (-1, survey.lowest())):
        upper_bound = np.array([peak.upper_bound for peak in peaks])
        near = np.array([efforts_near(dynamics, breaks, coefficients, peak.time) for peak in peaks])
        sampled = np.maximum((sign * efforts).max(axis=0), (sign * near).max(axis=1).diagonal())
        assert (upper_bound >= sampled - 1e-9 * scale).all()
        assert (upper_bound <= sampled + 1e-4 * scale).all()
        for joint, peak in enumerate(peaks):
            assert sum(peak.parts) == pytest.approx(peak.value, abs=1e-12 * scale[joint])
            assert breaks[0] <= peak.time <= breaks[-1]
            assert peak.value <= peak.upper_bound


@pytest.mark.parametrize("seed", few(range(20)))
def test_majorants_bound_taylor_coefficients_everywhere(seed):
    rng = np.random.default_rng(1000 + seed)
    dynamics = random_dynamics(rng, friction=False)
    viscous = tuple(
        replace(j, friction=Friction(0.0, float(rng.uniform(0, 2)))) for j in dynamics.robot.joints
    )
    dynamics = InverseDynamics(replace(dynamics.robot, joints=viscous))
    length, (_, coefficients) = 0.2, random_motion(rng, len(dynamics.links))
    coefficients = coefficients[:, :1]
    found = effort_majorants(dynamics, coefficients[-1], growth(coefficients, np.array([length]), 9))[:, 0]
    nodes = (1 - np.cos(np.pi * np.arange(41) / 40)) / 2 * length
    state = [
        np.stack([np.polyval(np.polyder(row, order), nodes) for row in coefficients[:, 0].T], axis=1)
        for order in range(3)
    ]
    efforts = np.polynomial.chebyshev.Chebyshev.fit
    for joint, values in enumerate(dynamics.effort(*state).T):
        series, factorial = efforts(nodes, values, 16, domain=[0.0, length]), 1.0
        for k in range(5):
            factorial *= max(k, 1)
            true = np.abs(series.deriv(k)(np.linspace(0, length, 101)) if k else values).max() / factorial
            rounding = 1e-15 * np.abs(values).max() * (256 / (length / 2)) ** k
            assert true <= found[k, joint] * (1 + 1e-6) + rounding


def two_joints(second: Joint, first_length: float) -> InverseDynamics:
    """Return a turning joint without mass that carries a second one, in a plane without gravity."""
    nothing = LinkInertia(1e-12, (0.0, 0.0, 0.0), (0.0,) * 6)
    joints = (Joint("turn", a=first_length, link=nothing), second)
    return InverseDynamics(Robot("two", joints, unlimited(2), "modified", np.eye(4), np.eye(4)), np.zeros(3))


def test_majorants_know_centripetal_forces():
    """A point at the end of a short second link of an arm that turns steadily: m a l w^2 sin q2 at the second joint."""
    far = two_joints(Joint("elbow", a=10.0, link=LinkInertia(2.0, (0.1, 0.0, 0.0), (0.0,) * 6)), 0.0)
    motion = np.array([[[5.0, 0.0]], [[0.0, np.pi / 2]]])
    bound = effort_majorants(far, motion[-1], growth(motion, np.array([1e-6]), 4))[0, 0]
    true = far.effort([0.0, np.pi / 2], [5.0, 0.0], [0.0, 0.0])
    assert true[1] == pytest.approx(2.0 * 10.0 * 0.1 * 25.0)
    assert (np.abs(true) <= bound * (1 + 1e-9)).all()


def test_majorants_know_coriolis_forces():
    """A point that slides outwards on a turning arm: 2 m r w v at the turning joint."""
    slide = Joint(
        "slide", "prismatic", alpha=np.pi / 2, d=0.1, link=LinkInertia(2.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    )
    arm = two_joints(slide, 0.0)
    motion = np.array([[[1.0, 50.0]], [[0.0, 0.0]]])
    bound = effort_majorants(arm, motion[-1], growth(motion, np.array([1e-9]), 4))[0, 0]
    true = arm.effort([0.0, 0.0], [1.0, 50.0], [0.0, 0.0])
    assert abs(true[0]) == pytest.approx(2.0 * 2.0 * 0.1 * 50.0)
    assert (np.abs(true) <= bound * (1 + 1e-6)).all()


def hidden_peak(size: float) -> tuple[np.ndarray, float]:
    """Return a polynomial that is 1 at all nodes, highest power first, and its largest value between them."""
    product = np.poly(NODES)
    largest = minimize_scalar(lambda x: -np.polyval(product, x), bounds=(0.0, NODES[1]), method="bounded")
    product *= size / -largest.fun
    product[-1] += 1.0
    return product, 1.0 + size


def hidden_motion(size: float, length: float) -> np.ndarray:
    """Return q(t) of one slide, whose acceleration has a peak that nine rows do not show."""
    joint = np.polyint(np.polyint(hidden_peak(size)[0])) * length**2
    return (joint / length ** np.arange(joint.size - 1, -1, -1))[:, None, None]


@pytest.mark.parametrize("length", [0.05, 1.0, 7.0])
def test_a_planted_peak_between_rows_is_found(length):
    """A peak of 0.01 % that none of nine rows shows."""
    found = effort_survey(lift(), np.array([0.0, length]), hidden_motion(1e-4, length)).highest()[0]
    true = 5.0 * (9.81 + 1.0001)
    assert found.value == pytest.approx(true, rel=1e-6)
    assert true * (1 - 1e-12) <= found.upper_bound <= true * (1 + 1e-6)


@pytest.mark.parametrize("length", [0.05, 1.0, 7.0])
def test_the_remainder_covers_a_peak_that_no_row_shows(length, monkeypatch):
    """So small a peak is not worth halving the piece: the bound is what the rows show plus the remainder."""
    dynamics, size = lift(gravity=0.0), 1e-8
    motion = hidden_motion(size, length)
    found = effort_survey(dynamics, np.array([0.0, length]), motion).highest()[0]
    assert found.upper_bound - 5.0 >= 5.0 * size * (1 - 1e-5)
    monkeypatch.setattr(effort_bound, "_HALVINGS", 0)
    found = effort_survey(dynamics, np.array([0.0, length]), motion).highest()[0]
    assert 5.0 * size * (1 - 1e-5) <= found.upper_bound - 5.0 <= 2.1 * 5.0 * size
    monkeypatch.setattr(node_bound, "BETWEEN_NODES", node_bound.BETWEEN_NODES / 10)
    found = effort_survey(dynamics, np.array([0.0, length]), motion).highest()[0]
    assert (
        found.upper_bound - 5.0 < 5.0 * size * 0.5
    )  # ten times too small a remainder would be noticed above


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("beside", [None, 0, 1])
def test_a_first_look_knows_of_a_peak_that_no_row_shows(sign, beside):
    """Alone, behind a piece that rests, or before it: what is known of one piece exactly is not known of another."""
    motion = sign * hidden_motion(1e-8, 1.0)
    if beside is not None:
        motion = np.insert(motion, beside, 0.0, axis=1)
    survey = effort_survey(lift(gravity=0.0), np.arange(motion.shape[1] + 1.0), motion)
    limit = 5.0 * (1.0 + 0.9e-8)
    found = list(survey.doubtful(np.array([[-limit, limit]]), 1e-10))
    assert found == [(0, sign, limit)]


@pytest.mark.parametrize("sign", [1, -1])
def test_a_first_look_doubts_no_limit_that_is_a_few_remainders_away(sign):
    """The remainder is at most 2.2 times what hides between nine rows: a looser look would ask for each motion anew."""
    survey = effort_survey(lift(gravity=0.0), np.array([0.0, 1.0]), sign * hidden_motion(1e-8, 1.0))
    limit = 5.0 * (1.0 + 1e-7)
    assert not list(survey.doubtful(np.array([[-limit, limit]]), 1e-10))


@pytest.mark.parametrize("hidden", [0.0, 4e-6])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_peak_is_as_near_as_the_smaller_of_two_limits_asks(sign, hidden):
    """Some 250 N one way, and 1e-6 below 1 N the other way, between rows: by hand 1000 (t - 0.4317)^2 - (1 - 1e-6).

    What nine rows do not show is far below the bound of the larger of the two, and far above that of the smaller.
    """
    at, free = 0.4317, 1.0 - 1e-6
    effort = np.array([1000.0, -2000.0 * at, 1000.0 * at**2 - free])
    if hidden:
        product = hidden_peak(hidden)[0]
        effort = np.polyadd(effort, product - np.eye(1, product.size, product.size - 1)[0])
        free = -minimize_scalar(lambda t: np.polyval(effort, t), bounds=(0.4, 0.5), method="bounded").fun
    joint = np.polyint(np.polyint(effort)) / 5.0
    survey = effort_survey(
        lift(gravity=0.0),
        np.array([0.0, 1.0]),
        sign * joint[:, None, None],
        np.array([[-1.0, 1e3] if sign > 0 else [-1e3, 1.0]]),
    )
    found = survey.peak(0, -sign)
    assert free * (1 - 1e-9) <= found.upper_bound <= free * (1 + 2e-7)
    assert found.time == pytest.approx(at, abs=1e-3)


def test_coulomb_friction_jumps_where_a_joint_turns_back():
    dynamics = lift(2.0, Friction(coulomb=3.0))
    coefficients = np.array([1.0, -1.0, 0.0])[:, None, None]  # qd = 2 t - 1, qdd = 2
    survey = effort_survey(dynamics, np.array([0.0, 1.0]), coefficients)
    high, low = survey.highest()[0], survey.lowest()[0]
    assert high.upper_bound == pytest.approx(2.0 * 11.81 + 3.0)
    assert low.upper_bound == pytest.approx(-2.0 * 11.81 + 3.0)
    assert high.time == pytest.approx(0.5, abs=1e-9) or high.time > 0.5
    assert high.parts == pytest.approx((4.0, 0.0, 3.0, 19.62))


def test_coulomb_friction_jumps_where_a_joint_turns_back_and_back_again():
    """m qdd + c sign(qd), by hand, of qd = (t - 0.3) (t - 0.7): it leaves a piece as it came."""
    coefficients = np.polyint(np.poly([0.3, 0.7]))[:, None, None]
    survey = effort_survey(lift(2.0, Friction(coulomb=3.0), 0.0), np.array([0.0, 1.0]), coefficients)
    assert survey.highest()[0].upper_bound == pytest.approx(2.0 + 3.0)
    assert survey.lowest()[0].upper_bound == pytest.approx(0.8 + 3.0)


@pytest.mark.parametrize("turn", [1e-7, 1e-9])
def test_a_joint_that_turns_back_just_behind_its_start_rubs_either_way(turn):
    """It begins with 1e-3 m/s, and has turned after a small part of its piece: m qdd - c, then m qdd + c."""
    coefficients = np.array([0.5e-3 / turn, -1e-3, 0.0])[:, None, None]
    survey = effort_survey(lift(2.0, Friction(coulomb=3e4), 0.0), np.array([0.0, 1.0]), coefficients)
    assert survey.highest()[0].upper_bound == pytest.approx(2e-3 / turn + 3e4)
    assert survey.lowest()[0].upper_bound == pytest.approx(3e4 - 2e-3 / turn)


def test_a_joint_that_is_never_faster_than_what_counts_as_rest_does_not_turn():
    coefficients = np.array([1e-3, -0.8e-3, 0.0])[:, None, None]  # qd = 2e-3 (t - 0.4), qdd = 2e-3
    for still, lowest in ((1e-2, -3.004), (1e-6, 2.996)):
        survey = effort_survey(
            lift(2.0, Friction(coulomb=3.0), 0.0), np.array([0.0, 1.0]), coefficients, still=still
        )
        assert survey.lowest()[0].upper_bound == pytest.approx(lowest)


def test_a_short_piece_counts():
    pieces = np.zeros((3, 3, 1))
    pieces[0, 1] = 25.0  # 50 m/s^2 for a tenth of a millisecond
    survey = effort_survey(lift(), np.array([0.0, 1.0, 1.0001, 2.0]), pieces)
    assert survey.highest()[0].upper_bound == pytest.approx(5.0 * (9.81 + 50.0))


def test_bounds_are_as_near_as_the_sum_of_parts_asks_and_not_as_each_of_them():
    """A lift that falls: of 49 N of gravity and as much of inertia 1 - (t - 0.4317)^2 is left."""
    joint = np.polyint(np.polyint([-1.0, 2 * 0.4317, 1.0 - 0.4317**2 - 49.05])) / 5.0
    survey = effort_survey(lift(), np.array([0.0, 1.0]), joint[:, None, None])
    assert 1.0 <= survey.highest()[0].upper_bound <= 1.0 + 1.5e-7


def test_bounds_of_a_joint_are_as_near_as_its_own_efforts_ask():
    """The first of two slides moves ten thousand tons by 1 m/s^2, the second one 1 kg: it needs 1 - (t - 0.4317)^2."""
    slides = tuple(replace(lift(mass).robot.joints[0], name=f"{mass} kg") for mass in (1e7, 1.0))
    robot = Robot("two", slides, unlimited(2), "standard", np.eye(4), np.eye(4))
    second = np.polyint(np.polyint([-1.0, 2 * 0.4317, -(0.4317**2)]))
    motion = np.stack([np.array([0.0, 0.0, 0.5, 0.0, 0.0]), second], axis=-1)[:, None]
    survey = effort_survey(InverseDynamics(robot, np.zeros(3)), np.array([0.0, 1.0]), motion)
    assert 1.0 <= survey.highest()[1].upper_bound <= 1.0 + 1.5e-7


def test_a_motion_of_no_length_asks_for_nothing():
    survey = effort_survey(lift(), np.array([2.0, 2.0]), np.zeros((2, 1, 1)))
    for peak in (survey.highest()[0], survey.lowest()[0]):
        assert (peak.value, peak.upper_bound, peak.parts, peak.time) == (0.0, 0.0, (0.0,) * 4, 2.0)
    assert needed_stretch(survey, 0, 1, 1.0, 1e-6).factor == 1.0


def test_peaks_are_of_the_motion_as_it_is_unless_asked_otherwise():
    """m (a / k^2 + g) and v / k, by hand: a lift that is stretched to k times as long."""
    coefficients = np.array([2.0, 0.0, 0.0])[:, None, None]  # qdd = 4 up to qd = 4
    survey = effort_survey(lift(5.0, Friction(1.0, 2.0)), np.array([0.0, 1.0]), coefficients)
    assert survey.peak(0, 1).upper_bound == pytest.approx(20.0 + 49.05 + 1.0 + 8.0)
    assert survey.peak(0, 1, 2.0).upper_bound == pytest.approx(5.0 + 49.05 + 1.0 + 4.0)
    assert survey.highest(2.0)[0].upper_bound == pytest.approx(5.0 + 49.05 + 1.0 + 4.0)
    assert survey.lowest(2.0)[0].upper_bound == pytest.approx(-5.0 - 49.05 - 1.0)
    assert survey.peak(0, 1, np.inf).upper_bound == pytest.approx(50.05)


def test_peaks_in_either_direction_are_of_the_motion_as_it_is():
    """The same lift falls as it rose: without gravity what it needs downwards is what it needed upwards."""
    rows = np.array([2.0, 0.0, 0.0])[:, None, None]
    up, down = (effort_survey(lift(5.0, gravity=0.0), np.array([0.0, 1.0]), sign * rows) for sign in (1, -1))
    assert up.highest()[0].upper_bound == pytest.approx(20.0)
    assert down.lowest()[0].upper_bound == pytest.approx(20.0)


@pytest.mark.parametrize("reverse", [False, True])
def test_what_rounding_makes_of_rest_at_either_end_turns_no_joint(reverse):
    """A joint trembles by 1e-13 in the first tenth of a piece, or in the last, and else moves one way."""
    t = np.linspace(0.0, 1.0, 11)
    wave = np.poly1d([1.0, -0.05]) * np.poly1d([1.0, -0.09]) * 1e-11  # of its speed, zero at 0.05 and 0.09
    speed = wave + np.poly1d([1.0, 0.0]) ** 6
    roots = np.sort(speed.roots[np.isreal(speed.roots)].real)
    inner = roots[(roots > 0) & (roots < 1)]
    assert np.abs(speed(t[:2])).max() < 1e-5
    still = 1e-5
    coefficients = np.polyint(speed).coeffs
    if reverse:
        mirrored = np.polyint(speed)(np.poly1d([-1.0, 1.0]))
        inner, coefficients = np.sort(1 - inner), -mirrored.coeffs
    planted = np.sort(np.append(inner, 0.95 if reverse else 0.05))
    assert effort_bound._turns(planted, coefficients, 1.0, still).size == 0
    middle = np.append(planted, 0.5)
    assert effort_bound._turns(np.sort(middle), coefficients, 1.0, still).tolist() == [0.5]


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(("still", "turns"), [(0.04, True), (0.06, False)])
def test_a_joint_turns_where_it_is_faster_than_rest_at_the_end_of_its_piece_alone(still, turns, reverse):
    """At 1 m/s^2 it moves with 0.05 m/s there, and turns 0.05 s from that end."""
    roots = np.array([0.95 if reverse else 0.05])
    speed = np.array([1.0, -roots[0]])
    found = effort_bound._turns(roots, np.polyint(speed), 1.0, still)
    assert found.tolist() == roots.tolist() * turns


@pytest.mark.filterwarnings("error")
def test_what_no_float_holds_is_not_proven():
    with np.errstate(over="ignore", invalid="ignore"):
        survey = effort_survey(lift(), np.array([0.0, 1.0]), np.full((3, 1, 1), 1e308))
        doubts = list(survey.doubtful(np.array([[-60.0, 60.0]]), 1e-6))
    assert survey.highest()[0].upper_bound == np.inf
    assert doubts == [(0, 1, 60.0), (0, -1, 60.0)]
    once = calls_of(lambda: survey.peak(0, 1))
    assert calls_of(lambda: needed_stretch(survey, 0, 1, 60.0, 1e-6)) < 2 * once


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("room", [1e-9, 1e-6, 1e-3])
def test_a_first_look_sees_a_limit_that_is_passed_by_more_than_its_slack(room, joint, sign):
    """Three slides in a row hold masses steadily; the second piece is the heavier one of two."""
    slides = tuple(replace(lift(2.0).robot.joints[0], name=f"slide{i}") for i in range(3))
    robot = Robot("lift", slides, unlimited(3), "standard", np.eye(4), np.eye(4))
    dynamics = InverseDynamics(robot, np.array([0.0, 0.0, -9.81 * sign]))
    pieces = np.zeros((3, 2, 3))
    pieces[0, 1, 0] = 0.5 * sign  # the first slide, and all that it carries, by 1 m/s^2
    survey = effort_survey(dynamics, np.array([0.0, 1.0, 2.0]), pieces)
    efforts = sign * np.array([6.0, 4.0, 2.0]) * 10.81
    for share, seen in ((0.5, []), (1.5, [joint])):
        limits = np.tile([-1e3, 1e3], (3, 1))
        limits[joint, int(sign > 0)] = efforts[joint] / (1.0 + share * room)
        found = list(survey.doubtful(limits, room))
        assert [index for index, *_ in found] == seen
        assert all(each == (joint, sign, abs(limits[joint, int(sign > 0)])) for each in found)


@pytest.mark.parametrize("seed", range(10))
def test_a_first_look_overlooks_nothing_that_dense_samples_show(seed):
    rng = np.random.default_rng(700 + seed)
    dynamics = random_dynamics(rng, friction=seed % 2 == 0)
    breaks, coefficients = random_motion(rng, len(dynamics.links))
    efforts, survey = dense(dynamics, breaks, coefficients), effort_survey(dynamics, breaks, coefficients)
    for joint in range(len(dynamics.links)):
        for sign, side in ((1, 1), (-1, 0)):
            peak = (sign * efforts[:, joint]).max()
            limits = np.tile([-np.inf, np.inf], (len(dynamics.links), 1))
            limits[joint, side] = sign * peak / (1.0 + 2e-6 * np.sign(peak))
            assert [found[:2] for found in survey.doubtful(limits, 1e-6)] == [(joint, sign)] or peak <= 0


def test_stretch_of_a_lift_in_closed_form():
    """m (a / k^2 + g) = limit, with viscous friction m a / k^2 + v / k + m g = limit."""
    coefficients = np.array([2.0, 0.0, 0.0])[:, None, None]  # qdd = 4 up to qd = 4
    survey = effort_survey(lift(), np.array([0.0, 1.0]), coefficients)
    found = needed_stretch(survey, 0, 1, 60.0, 0.0)
    assert found.factor == pytest.approx((20.0 / (60.0 - 49.05)) ** 0.5, rel=1e-8)
    survey = effort_survey(lift(5.0, Friction(1.0, 2.0)), np.array([0.0, 1.0]), coefficients)
    free = 60.0 - 49.05 - 1.0
    wanted = (8.0 + (64.0 + 80.0 * free) ** 0.5) / (2 * free)
    assert needed_stretch(survey, 0, 1, 60.0, 0.0).factor == pytest.approx(wanted, rel=1e-8)
    assert needed_stretch(survey, 0, 1, 200.0, 0.0).factor == 1.0
    brake = np.array([-5 / 3, 1.0, -0.5, 0.0])[:, None, None]  # helped by friction, from 0.5 m/s down
    survey = effort_survey(lift(0.05, Friction(0.0, 0.1)), np.array([0.0, 0.2]), brake)
    assert needed_stretch(survey, 0, 1, 0.5105, 0.0).factor == pytest.approx(25 * 0.0105**0.5 - 1.25, 1e-4)


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_stretch_of_a_light_and_of_a_heavy_lift(scale):
    dynamics = lift(5.0 * scale, Friction(0.0, 2.0 * scale))
    survey = effort_survey(dynamics, np.array([0.0, 1.0]), np.array([2.0, 0.0, 0.0])[:, None, None])
    free = 60.0 - 49.05
    wanted = (8.0 + (64.0 + 80.0 * free) ** 0.5) / (2 * free)
    found = needed_stretch(survey, 0, 1, 60.0 * scale, 1e-6)
    assert found.factor == pytest.approx(wanted, rel=1e-2 if scale < 1 else 2e-6)


def test_what_is_not_resolved_is_given_up_at_once():
    """A remainder does not shrink in a slower motion: above the limit it is, whatever the stretch."""
    survey = effort_survey(lift(), np.array([0.0, 1.0]), np.array([2.0, 0.0, 0.0])[:, None, None])
    nodes = replace(survey.nodes, remainder=np.full_like(survey.nodes.remainder, 150.0))
    vague = replace(survey, nodes=nodes)
    assert needed_stretch(vague, 0, 1, 60.0, 0.0).factor == np.inf
    once = calls_of(lambda: vague.peak(0, 1))
    assert calls_of(lambda: needed_stretch(vague, 0, 1, 60.0, 0.0)) < 2 * once


@pytest.mark.parametrize("off", [0.0, 0.08])
@pytest.mark.parametrize("above", [1.0001, 1.0015, 1.003])
def test_a_motion_is_stretched_until_its_bound_is_proven_and_hardly_further(above, off):
    """m (4 / k^2 + g) + off keeps 1.001 times a limit with the smallest k, in steps of half a thousandth."""
    survey = effort_survey(lift(), np.array([0.0, 1.0]), np.array([2.0, 0.0, 0.0])[:, None, None])
    survey = replace(survey, nodes=replace(survey.nodes, remainder=np.full((1, 1), off)))
    limit, slack = 69.05 / above, 1e-3
    smallest = max((20.0 / (limit * (1 + slack) - off - 49.05)) ** 0.5, 1.0)
    found = needed_stretch(survey, 0, 1, limit, slack)
    assert found.peak.upper_bound <= limit * (1 + slack)
    assert smallest * (1 - 1e-12) <= found.factor <= max((20.0 / (limit - 49.05)) ** 0.5, smallest) * 1.0006


@pytest.mark.parametrize("qdd", [0.0, -0.2])
def test_no_stretch_makes_a_bound_of_a_static_load_closer(qdd):
    """What is over the limit is the remainder: a lift that hangs, or falls a little, bears no more when it is slower."""
    survey = effort_survey(lift(), np.array([0.0, 1.0]), np.array([0.5 * qdd, 0.0, 0.0])[:, None, None])
    vague = replace(survey, nodes=replace(survey.nodes, remainder=np.full((1, 1), 2.0)))
    assert needed_stretch(vague, 0, 1, 49.5, 1e-6).factor == np.inf
    once = calls_of(lambda: vague.peak(0, 1))
    assert calls_of(lambda: needed_stretch(vague, 0, 1, 49.5, 1e-6)) < 2 * once


def test_no_stretch_helps_where_gravity_alone_is_over_the_limit():
    survey = effort_survey(lift(), np.array([0.0, 1.0]), np.array([2.0, 0.0, 0.0])[:, None, None])
    found = needed_stretch(survey, 0, 1, 49.0, 1e-6)
    assert found.factor == np.inf
    assert found.peak.gravity == pytest.approx(49.05)


def test_a_fast_motion_may_keep_a_limit_that_gravity_alone_exceeds():
    falling = np.array([-2.0, 0.0, 0.0])[:, None, None]  # qdd = -4
    survey = effort_survey(lift(), np.array([0.0, 1.0]), falling)
    assert needed_stretch(survey, 0, 1, 40.0, 1e-6).factor == 1.0


@pytest.mark.parametrize("seed", few(range(12)))
def test_stretch_is_the_smallest(seed):
    rng = np.random.default_rng(300 + seed)
    dynamics = random_dynamics(rng, friction=seed % 2 == 0)
    breaks, coefficients = random_motion(rng, len(dynamics.links))
    survey, joint = effort_survey(dynamics, breaks, coefficients), 0
    static = max(peak.static for peak in (survey.highest(1e6)[joint], survey.lowest(1e6)[joint]))
    limit = (
        1.2 * static
        + 0.3 * max(survey.highest()[joint].upper_bound, survey.lowest()[joint].upper_bound)
        + 0.1
    )
    needed = max(needed_stretch(survey, joint, sign, limit, 0.0).factor for sign in (1, -1))
    powers = np.arange(len(coefficients) - 1, -1, -1)[:, None, None]
    for share, kept in ((1.0, True), (0.999, needed == 1.0)):
        factor = max(needed * share, 1.0)
        efforts = dense(dynamics, breaks * factor, coefficients / factor**powers)[:, joint]
        assert (np.abs(efforts).max() <= limit * (1 + 1e-6)) == kept


def test_payload_takes_its_share():
    heavy = replace(lift().robot, payload=point_mass(3.0))
    survey = effort_survey(
        InverseDynamics(heavy), np.array([0.0, 1.0]), np.array([2.0, 0.0, 0.0])[:, None, None]
    )
    assert survey.highest()[0].upper_bound == pytest.approx(8.0 * 13.81)
