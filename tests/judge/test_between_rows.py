"""What only the curve between rows has: when it is an error, and whose it is.

The oracle is a motion whose largest value is known: a parabola (or a ramp, of the highest derivative that the
pieces have) that the rows give back exactly.
"""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from recorded_rows import bare_robot

from trajcli.findings import Finding
from trajcli.judge import joint_limits
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Friction, Joint, Limits, LinkInertia, Payload, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

PERIOD, PIECES, FAR = 0.008, 9, 1e6
PEAK, OVER = 1.0, 0.01
"""Largest value of the derivative that is limited, and how much of it is beyond the limit."""
SIDES = [1, -1]
ALONE = np.array([0, 0, 0, 0, 1, 2, 2, 2, 2, 2])
"""Moves of rows, by which the piece in the middle has findings of its own."""
LAW, LAST = 0.14, 1.4
"""Shares of the step that a change of the law explains: below the highest derivative, and of this itself."""


def motion_of(*columns: np.ndarray | None, t: np.ndarray, moves: list[int] | None = None) -> RecordedMotion:
    """Return rows of some joints without rounding."""
    stated = [*columns, None, None][:3]
    exact = np.zeros(stated[0].shape[1])
    move = None if moves is None else np.array(moves)
    return RecordedMotion(t, *stated, None, None, move, None, Resolution(0.0, exact, exact, exact), "rows")


def peaked(
    order: int,
    orders: int,
    share: float,
    side: int = 1,
    *,
    at: float = 0.5,
    bent: float = 24.0,
    period: float = PERIOD,
) -> RecordedMotion:
    """Return rows whose derivative of some order is largest, `PEAK`, within the piece in the middle.

    Args:
        order: Of that derivative.
        orders: 2 for positions and velocities, 3 for accelerations, too.
        share: `OVER` by the step of the highest derivative of a piece, times powers of the period.
        side: 1 for a largest value, -1 for a least one.
        at: Where in the piece, as a part of it.
        bent: The parabola falls by this times `OVER` in one period.
        period: s.
    """
    t = period * np.arange(PIECES + 1.0)
    middle, before, level = (PIECES // 2 + at) * period, (PIECES // 2 - 1) * period, orders
    below = level - order
    shape = (
        Polynomial([PEAK, 0.0, -bent * OVER / period**2]) if below else Polynomial([PEAK, 4 * OVER / period])
    )
    wave = shape.integ(order) if order else shape
    if not below:  # it is largest in the last row
        middle, before = t[-1], t[-3]
    step = (-1.0) ** (below + 1) * OVER / (share * period**below)
    rows = []
    for k in range(orders):
        early = np.where(t < before, t - before, 0.0) ** (level - k) / factorial(level - k)
        rows.append(side * (wave.deriv(k)(t - middle) + step * early)[:, None])
    return motion_of(*rows, t=t)


def bounded(order: int, side: int, bound: float) -> Limits:
    """Return a limit of one order on one side; on the other there is room."""
    kind = ("position", "velocity", "acceleration", "jerk")[order]
    row = [-FAR, bound] if side > 0 else [-bound, FAR]
    return replace(unlimited(1), **{kind: np.array([row])})


def over(motion: RecordedMotion, robot: Robot, **asked: object) -> list[Finding]:
    """Return what is over limits."""
    judgement = judge_motion(lambda: [motion], Requirements(robot, **asked))
    return [found for found in judgement.findings if found.rule == "limit"]


CASES = [(0, 2, LAW), (1, 2, LAW), (2, 2, LAST), (1, 3, LAW), (2, 3, LAW), (3, 3, LAST)]
"""Order that is limited, columns, and the share that is explained."""


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("order", "orders", "share"), CASES)
def test_a_change_of_the_law_explains_so_much(order: int, orders: int, share: float, side: int) -> None:
    limits = bounded(order, side, PEAK - OVER)
    for size, severity in ((1.0, "warning"), (2.2, "error")):
        motion = peaked(order, orders, size * share, side)
        (found,) = over(motion, bare_robot(limits))
        assert (found.severity, found.certainty) == (severity, "exceeded")
        assert found.value == pytest.approx(side * PEAK, rel=1e-6)
        assert found.text().endswith("changes its law") == (severity == "warning")
        (asked_for,) = over(motion, bare_robot(limits), interpolate=("cubic", "quintic")[orders - 2])
        (planned,) = over(motion, bare_robot(limits), planned=True)
        assert asked_for.severity == planned.severity == "error"
        assert "law" not in asked_for.text()


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("rounding", "severity"), [(0.12, "error"), (0.2, "warning")])
def test_rounding_adds_to_what_a_change_of_the_law_explains(
    rounding: float, severity: str, side: int
) -> None:
    """The step explains 0.65 of the excess; a velocity is off by 5/2 of what its column is: by 0.3, or by 0.5."""
    motion = peaked(1, 2, 2.2 * LAW, side)
    off, exact = np.full(1, rounding * OVER), np.zeros(1)
    motion = replace(motion, resolution=Resolution(0.0, exact, off, exact))
    (found,) = over(motion, bare_robot(bounded(1, side, PEAK - OVER)))
    assert (found.severity, found.certainty) == (severity, "exceeded")
    assert found.rounding == pytest.approx(2.5 * rounding * OVER, rel=1e-6)


@pytest.mark.parametrize("side", SIDES)
def test_a_little_beyond_a_limit_between_rows_is_no_worse_than_far_beyond(side: int) -> None:
    """Rows of a trapezoid with nine decimals: joined, its acceleration reaches 1.37 times that of every row."""
    rate, t = 20.0, 0.01 * np.arange(200)
    late = np.maximum(t - 1.0, 0.0)
    q, qd, qdd = rate * (t**2 - late**2) / 2, rate * (t - late), np.where(t < 1.0, rate, 0.0)
    motion = motion_of(*(side * each[:, None] for each in (q, qd, qdd)), t=t)

    def found(limit: float, off: float = 0.5e-9) -> list[Finding]:
        half = np.array([off])
        rows = replace(motion, resolution=Resolution(0.0, half, half, half))
        return over(rows, bare_robot(bounded(2, side, limit)))

    (far,) = found(1.01 * rate)
    assert far.severity == "warning"
    assert abs(far.value) > 1.3 * rate
    for share in (1e-3, 1e-6, 2e-7, 5e-8, 2e-9):  # rounding explains 3e-7 of it
        assert {each.severity for each in found((1 - share) * abs(far.value))} <= {"warning"}, share
    (stated,) = [each for each in found((1 - 1e-8) * rate) if each.severity == "error"]
    assert (stated.certainty, stated.count) == ("exceeded", 100)
    (stated,) = [each for each in found((1 - 1e-8) * rate, 0.5e-6) if each.severity == "error"]
    assert (stated.certainty, stated.count) == ("within rounding", 99)


@pytest.mark.parametrize("side", SIDES)
def test_jerk_that_changed_earlier_explains_little(side: int) -> None:
    """500 m/s^3 that end before: a tenth of it times T^2 are 3.2e-3 of an excess of 1e-2."""
    motion = peaked(1, 2, 1e9, side)
    early = np.minimum(motion.t - (PIECES // 2 - 1) * PERIOD, 0.0)[:, None]
    for jerk, severity in ((500.0, "error"), (2000.0, "warning")):
        q, qd = motion.q - side * jerk * early**3 / 6, motion.qd - side * jerk * early**2 / 2
        (found,) = over(replace(motion, q=q, qd=qd), bare_robot(bounded(1, side, PEAK - OVER)))
        assert (found.severity, found.kind) == (severity, "velocity")


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("last", [False, True])
def test_a_change_of_the_law_in_the_first_and_in_the_last_piece_is_one(last: bool, side: int) -> None:
    """From 10 m/s^2 to none within it, as a cubic has it; all others rest. Its mean is 5."""
    t, qd = PERIOD * np.arange(7), np.zeros(7)
    qd[0] = -5.0 * PERIOD
    q = np.zeros(7)
    q[0] = 10.0 * PERIOD**2 / 6
    if last:  # the same backward in time
        q, qd = q[::-1], -qd[::-1]
    motion = motion_of(side * q[:, None], side * qd[:, None], t=t)
    for limit, severity in ((8.0, "warning"), (4.9, "error")):
        (found,) = over(motion, bare_robot(bounded(2, side, limit)))
        assert (found.kind, found.severity) == ("acceleration", severity)
        assert found.value == pytest.approx(side * 10.0)


@pytest.mark.parametrize("order", [1, 2])
def test_rows_that_stand_far_apart_explain_nothing(order: int) -> None:
    for period, severity in ((0.01, "warning"), (0.0101, "error")):
        motion = peaked(order, order + 1, LAW, period=period)
        (found,) = over(motion, bare_robot(bounded(order, 1, PEAK - OVER)))
        assert found.severity == severity


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("order", [1, 2])
def test_what_rows_state_or_two_of_them_make_certain_is_an_error(order: int, side: int) -> None:
    """The parabola falls by c in one period: c/4 until the next rows, and c/12 in the mean between these."""
    for bent, severity in ((12.2, "warning"), (11.8, "error"), (3.9, "error")):
        motion = peaked(order, order + 1, LAW, side, bent=bent)
        (found,) = over(motion, bare_robot(bounded(order, side, PEAK - OVER)))
        assert found.severity == severity, bent


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("at", [0.3, 0.7])
def test_a_row_at_either_end_states_it(at: float, side: int) -> None:
    """Only the row nearer to the peak is over the limit."""
    motion = replace(peaked(1, 2, LAW, side, at=at, bent=1 / 0.4**2), move=ALONE)
    (found,) = (each for each in over(motion, bare_robot(bounded(1, side, PEAK - OVER))) if each.move == 1)
    assert found.severity == "error"


def approach(side: int, bound: float) -> Limits:
    """Return a limit by position so far from the end of the range that it is nearly the same everywhere."""
    position = [-1e4 * FAR, FAR] if side > 0 else [-FAR, 1e4 * FAR]
    by_position = np.array([[bound**2 / (2 * FAR), 0.0]])
    return replace(unlimited(1), position=np.array([position]), velocity_by_position=by_position)


@pytest.mark.parametrize("side", SIDES)
def test_a_change_of_the_law_explains_so_much_of_an_approach(side: int) -> None:
    limits = approach(side, PEAK - OVER)
    for size, severity in ((1.0, "warning"), (2.2, "error")):
        motion = peaked(1, 2, size * LAW, side)
        (found,) = over(motion, bare_robot(limits))
        assert (found.kind, found.severity) == ("velocity_by_position", severity)
        (asked_for,) = over(motion, bare_robot(limits), interpolate="cubic")
        assert asked_for.severity == "error"
    for period, severity in ((0.01, "warning"), (0.0101, "error")):
        (found,) = over(peaked(1, 2, LAW, side, period=period), bare_robot(limits))
        assert found.severity == severity


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("at", [0.3, 0.7])
def test_a_row_at_either_end_approaches_too_fast(at: float, side: int) -> None:
    motion = replace(peaked(1, 2, LAW, side, at=at, bent=1 / 0.4**2), move=ALONE)
    (found,) = (each for each in over(motion, bare_robot(approach(side, PEAK - OVER))) if each.move == 1)
    assert found.severity == "error"


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("at", [0.15, 0.85])
def test_a_row_that_moves_away_as_fast_does_not_approach(at: float, side: int) -> None:
    """Forward at 1 in a piece, and backward at 1.17 in one of the rows beside it: the law changes between them."""
    motion = peaked(1, 2, LAW, side, at=at, bent=300.0)
    assert (side * motion.qd).min() < -1.1
    (found,) = over(motion, bare_robot(approach(side, PEAK - OVER)))
    assert (found.kind, found.severity) == ("velocity_by_position", "warning")
    assert found.value == pytest.approx(side * PEAK)


@pytest.mark.parametrize("side", SIDES)
def test_an_approach_in_a_later_move_has_its_own_place(side: int) -> None:
    """At 0.5 s the second joint is 0.02 m before its end, where 0.2 m/s are allowed, at 0.4 m/s."""
    t = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    q = np.zeros((t.size, 2))
    q[:, 1] = side * np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.08, 0.08])
    end = [-9.0, 0.1] if side > 0 else [-0.1, 9.0]
    by_position = np.array([[np.inf, 0.0], [1.0, 0.0]])
    limits = replace(unlimited(2), position=np.array([[-9.0, 9.0], end]), velocity_by_position=by_position)
    (found,) = over(motion_of(q, t=t, moves=[0, 0, 1, 1, 1, 1, 1]), bare_robot(limits), interpolate="linear")
    assert (found.kind, found.joint, found.move, found.row) == ("velocity_by_position", "j2", 1, 6)
    assert [found.time, found.value, found.limit] == pytest.approx([0.5, side * 0.4, side * 0.2], rel=1e-6)


@pytest.mark.parametrize("worst", [1, 5])
@pytest.mark.parametrize("side", SIDES)
def test_pieces_of_every_degree_are_judged(worst: int, side: int) -> None:
    """Rows with accelerations make quintics, those without cubics: from rest to rest 1.875 and 1.5 d/T."""
    t, distances = np.arange(8.0), np.array([0.0, 0.3, 0.0, 0.0, 0.0, 0.3, 0.0])
    distances[worst] = 0.4
    q = side * np.append(0.0, np.cumsum(distances))[:, None]
    qdd = np.where(np.arange(8) < 4, np.nan, 0.0)[:, None]
    peaks = np.where(np.arange(7) < 4, 1.5, 1.875) * distances
    limits = bounded(1, side, 0.4)
    (found,) = over(motion_of(q, np.zeros_like(q), qdd, t=t), bare_robot(limits), interpolate="jtc")
    assert found.count == 2
    assert found.value == pytest.approx(side * peaks.max(), rel=1e-9)
    assert found.time == pytest.approx(peaks.argmax() + 0.5)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("first", [True, False])
def test_a_derivative_that_pieces_do_not_determine_is_not_judged(first: bool, side: int) -> None:
    """Rows without accelerations say nothing of jerk, whatever cubics through them have: -12 d/T^3."""
    t, cubic = np.arange(8.0), np.arange(8) < 4
    stated = ~cubic if first else cubic
    distances = np.where(stated[:-1] & stated[1:], 0.1, -5.0)  # their jerk has the other sign
    q = side * np.append(0.0, np.cumsum(distances))[:, None]
    qdd = np.where(stated, 0.0, np.nan)[:, None]
    motion = motion_of(q, np.zeros_like(q), qdd, t=t)
    limits = bounded(3, side, 6.1)  # of quintics from rest to rest over 0.1: 60 d/T^3
    assert over(motion, bare_robot(limits), interpolate="jtc") == []
    (found,) = over(motion, bare_robot(bounded(3, side, 5.9)), interpolate="jtc")
    assert (found.kind, found.count) == ("jerk", 3)
    assert found.value == pytest.approx(side * 6.0, rel=1e-9)


@pytest.mark.parametrize("middle", [2.5, 1.9])
def test_of_many_pieces_the_worst_is_found(middle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows state more than is allowed nearly everywhere; a piece that ends slower is fastest in between."""
    monkeypatch.setattr(joint_limits, "_MANY", 4)
    t, speed = np.arange(9.0), np.array([2.0, 2, 2, 2, 1.5, 1.5, 2, 0, 0])[:, None]
    distance = np.array([2.0, 2, 2, 1.75, middle, 1.75, 1, 0.65])  # the last one from rest to rest
    q = np.append(0.0, np.cumsum(distance))[:, None]
    peak = 1.5 + 1.5 * (
        middle - 1.5
    )  # of a cubic: the speed at both ends, and 3/2 of what the mean is above it
    limits = bounded(1, 1, 0.9)  # which the last one passes in between only, by 0.075
    (found,) = over(motion_of(q, speed, t=t), bare_robot(limits), interpolate="cubic")
    assert (found.count, found.row) == (8, 5)
    assert [found.value, found.time] == pytest.approx([peak, 4.5])


# Slides: the force of one is its mass times its acceleration.

MASS = 2.0


def slides(side: int, size: float, joints: int = 1, payload: Payload | None = None) -> Robot:
    """Return slides at right angles to each other, each of 2 kg; the force of the last one has a limit."""
    links = [LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6) for k in range(joints)]
    turned = [Joint(f"s{k}", "prismatic", alpha=k * np.pi / 2, link=links[k]) for k in range(joints)]
    effort = np.full((joints, 2), [-np.inf, np.inf])
    effort[-1] = [-FAR, size] if side > 0 else [-size, FAR]
    limits = replace(unlimited(joints), effort=effort)
    nothing = np.zeros(3)
    return Robot(
        "slides", tuple(turned), limits, "modified", np.eye(4), np.eye(4), gravity=nothing, payload=payload
    )


@pytest.mark.parametrize("side", SIDES)
def test_a_force_that_only_the_curve_has_is_a_warning(side: int) -> None:
    """Rows have 0.06 less than the peak."""
    motion = peaked(2, 3, LAW, side)
    robot = slides(side, MASS * (PEAK - OVER))
    (found,) = over(motion, robot)
    assert (found.kind, found.severity, found.row) == ("effort", "warning", PIECES // 2 + 1)
    assert found.value == pytest.approx(side * MASS * PEAK, rel=1e-5)
    assert found.time == pytest.approx((PIECES / 2) * PERIOD, rel=1e-3)
    (asked_for,) = over(motion, robot, interpolate="quintic")
    (sparse,) = over(peaked(2, 3, LAW, side, period=0.0101), robot)
    (stated,) = over(peaked(2, 3, LAW, side, bent=3.9), robot)
    assert asked_for.severity == sparse.severity == stated.severity == "error"


@pytest.mark.parametrize("side", SIDES)
def test_forces_of_other_joints_say_nothing_about_this_one(side: int) -> None:
    """The first slide is ten times as fast and moves both: its rows state more than the second one may."""
    alone = peaked(2, 3, LAW, side)
    both = [np.concatenate([10 * rows, rows], axis=1) for rows in (alone.q, alone.qd, alone.qdd)]
    (found,) = over(motion_of(*both, t=alone.t), slides(side, MASS * (PEAK - OVER), joints=2))
    assert (found.joint, found.severity) == ("s1", "warning")
    assert found.value == pytest.approx(side * MASS * PEAK, rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("rounding", "severity"), [(1e-6, "error"), (2.4e-4, "error"), (2.6e-4, "warning")])
def test_a_force_that_rows_have_but_for_their_rounding_is_one_of_the_curve_alone(
    rounding: float, severity: str, side: int
) -> None:
    """Rows state 2.5e-4 of an acceleration more than is allowed, and the curve 1e-2."""
    motion, exact = peaked(2, 3, LAW, side, bent=3.9), np.zeros(1)
    motion = replace(motion, resolution=Resolution(0.0, exact, exact, exact + rounding))
    (found,) = over(motion, slides(side, MASS * (PEAK - OVER)))
    assert (found.kind, found.severity, found.certainty) == ("effort", severity, "exceeded")


@pytest.mark.parametrize("side", SIDES)
def test_of_both_directions_of_a_force_that_counts_which_is_exceeded_more(side: int) -> None:
    """A force of 1.5 where 1 is allowed, and of 11 where 10 are: half as much again is more than a tenth."""
    t = PERIOD * np.arange(8)
    qdd = side * np.array([0.0, 1.5, 1.5, 0.0, -11.0, -11.0, 0.0, 0.0]) / MASS
    qd = np.append(0.0, np.cumsum(PERIOD * (qdd[1:] + qdd[:-1]) / 2))
    q = np.append(0.0, np.cumsum(PERIOD * (qd[1:] + qd[:-1]) / 2 - PERIOD**2 * np.diff(qdd) / 12))
    robot = slides(1, FAR)
    effort = np.array([sorted([side * 1.0, -side * 10.0])])
    robot = replace(robot, limits=replace(robot.limits, effort=effort))
    (found,) = over(motion_of(*(each[:, None] for each in (q, qd, qdd)), t=t), robot)
    assert [found.value, found.limit] == pytest.approx([side * 1.5, side * 1.0], rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("row", [0, 3, 5])
def test_one_row_that_states_the_force_is_enough(row: int, side: int) -> None:
    """An acceleration that is largest in one row, linear beside it; the first and the last one count, too."""
    t = PERIOD * np.arange(6)
    qdd = side * np.where(np.arange(6) == row, 1.0, 0.5)
    qd = np.append(0.0, np.cumsum(PERIOD * (qdd[1:] + qdd[:-1]) / 2))
    q = np.append(0.0, np.cumsum(PERIOD * (qd[1:] + qd[:-1]) / 2 - PERIOD**2 * np.diff(qdd) / 12))
    motion = motion_of(*(each[:, None] for each in (q, qd, qdd)), t=t)
    (found,) = over(motion, slides(side, MASS * 0.9))
    assert (found.severity, found.row) == ("error", row + 1)
    assert found.value == pytest.approx(side * MASS, rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
def test_velocities_alone_state_a_force(side: int) -> None:
    """A cubic of 0.02 m/s more in 8 ms has 2.5 m/s^2 in the mean, and twice its bend at its ends."""
    for mean, severity in ((0.95, "warning"), (1.05, "error")):
        t = PERIOD * np.arange(8)
        qd = side * np.where(np.arange(8) < 4, 0.0, mean * PERIOD)
        q = np.append(0.0, np.cumsum(PERIOD * (qd[1:] + qd[:-1]) / 2))
        q[4:] += side * PERIOD**2 * 0.2 / 6
        (found,) = over(motion_of(q[:, None], qd[:, None], t=t), slides(side, MASS))
        assert (found.kind, found.severity) == ("effort", severity)
        assert found.value == pytest.approx(side * MASS * (mean + 0.2), rel=1e-5)


def rubbing(side: int, size: float, friction: Friction) -> Robot:
    """Return one slide with friction, whose force is limited."""
    arm = slides(side, size)
    return replace(arm, joints=(replace(arm.joints[0], friction=friction),))


def braked(side: int, speed: float, brake: float) -> RecordedMotion:
    """Return rows that fall from a speed with one deceleration, to rest where that is long enough."""
    t = PERIOD * np.arange(8)
    since = np.minimum(t, speed / brake)
    q, qd = speed * since - brake * since**2 / 2, speed - brake * since
    qdd = np.full(8, -brake)
    return motion_of(*(side * each[:, None] for each in (q, qd, qdd)), t=t)


@pytest.mark.parametrize("side", SIDES)
def test_friction_of_rows_has_the_direction_and_the_size_of_their_speed(side: int) -> None:
    """2 kg driven at 1 m/s against 3 N s/m and 0.5 N, with 1 m/s^2 at one row and 0.5 beside it."""
    t = PERIOD * np.arange(6)
    qdd = side * np.where(np.arange(6) == 3, 1.0, 0.5)
    qd = side * 1.0 + np.append(0.0, np.cumsum(PERIOD * (qdd[1:] + qdd[:-1]) / 2))
    q = np.append(0.0, np.cumsum(PERIOD * (qd[1:] + qd[:-1]) / 2 - PERIOD**2 * np.diff(qdd) / 12))
    motion = motion_of(*(each[:, None] for each in (q, qd, qdd)), t=t)
    needed = MASS * 1.0 + 3.0 * abs(qd[3]) + 0.5
    friction = Friction(coulomb=0.5, viscous=3.0)
    (found,) = over(motion, rubbing(side, needed - 0.1, friction))
    assert (found.severity, found.row) == ("error", 4)
    assert found.value == pytest.approx(side * needed, rel=1e-5)
    assert over(motion, rubbing(side, needed + 0.01, friction)) == []


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("noise", [0.9, -0.9])
def test_a_row_at_rest_by_its_decimals_has_the_friction_of_the_motion_beside(noise: float, side: int) -> None:
    """Braking 2 kg by 10 m/s^2 takes 20 N, 1 N of it by friction: 19 N, and 21 N if the last row went back."""
    last, off = 7, 1e-5
    motion = braked(side, PERIOD * last * 10.0, 10.0)
    qd = motion.qd.copy()
    qd[last] = side * noise * off
    exact = np.zeros(1)
    rounded = replace(motion, qd=qd, resolution=Resolution(0.0, exact, np.full(1, off), exact))
    errors = [
        each for each in over(rounded, rubbing(-side, 20.5, Friction(1.0, 0.0))) if each.severity == "error"
    ]
    assert errors == []
    assert over(motion, rubbing(-side, 18.5, Friction(1.0, 0.0)))[0].severity == "error"


def test_no_row_says_when_a_payload_changed() -> None:
    """Only between the last row of a move and the first of the next the slide is accelerated."""
    t, q = np.arange(6.0), np.array([0.0, 0, 0, 1, 1, 1])[:, None]
    motion = motion_of(q, np.zeros_like(q), np.zeros_like(q), t=t, moves=[0, 0, 0, 1, 1, 1])
    size = MASS * 10 / 3**0.5 * 0.99  # of a quintic from rest to rest over 1 m in 1 s
    same, carrying = slides(1, size), slides(1, size, payload=Payload(1.0, np.zeros(3), np.zeros((3, 3))))
    assert [found.kind for found in over(motion, same, by_move={0: same, 1: same})] == ["effort"]
    assert over(motion, same, by_move={0: same, 1: carrying}) == []
    assert over(motion, same, by_move={0: carrying, 1: same}) == []


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("speed", "goes_back"), [(5e-10, False), (1e-7, True), (1e-5, True)])
def test_a_row_goes_back_if_its_speed_is_more_than_nine_decimals_leave_of_rest(
    speed: float, goes_back: bool, side: int
) -> None:
    """As above with exact rows: 19 N, and 21 N if the last row goes back."""
    last = 7
    motion = braked(side, PERIOD * last * 10.0, 10.0)
    qd = motion.qd.copy()
    qd[last] = -side * speed
    found = over(replace(motion, qd=qd), rubbing(-side, 20.5, Friction(1.0, 0.0)))
    assert [each.severity for each in found] == ["error"] * goes_back


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("friction", [Friction(3.0, 0.0), Friction(0.0, 3.0)])
def test_friction_is_that_of_velocities_where_rows_have_no_accelerations(
    friction: Friction, side: int
) -> None:
    """A slide at a steady 1 m/s, far on the other side of zero: 3 N, whatever its place is."""
    t = PERIOD * np.arange(6)
    motion = motion_of(side * (t - 5.0)[:, None], np.full((6, 1), side * 1.0), t=t)
    (found,) = over(motion, rubbing(side, 2.9, friction))
    assert (found.kind, found.severity) == ("effort", "error")
    assert found.value == pytest.approx(side * 3.0, rel=1e-6)
    assert over(motion, rubbing(side, 3.1, friction)) == []


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("length", [0.25, 4.0])
def test_a_force_in_a_later_move_has_its_own_time(length: float, side: int) -> None:
    """After a second of rest steadily more, to 2 kg times 1.5 m/s^2 at the last row, which alone is over 2.5 N."""
    t = np.array([0.0, 1.0, 2.0, 2.0 + length])
    last = np.array([0.25 * length**2, 0.75 * length, 1.5])  # of an acceleration that grows evenly from none
    q, qd, qdd = (np.array([[0.0], [0.0], [0.0], [side * value]]) for value in last)
    robots = dict(enumerate([slides(side, 9.0), slides(side, 2.5)]))
    required = Requirements(robots[0], by_move=robots)
    judgement = judge_motion(lambda: [motion_of(q, qd, qdd, t=t, moves=[0, 0, 1, 1])], required)
    (found,) = [each for each in judgement.findings if each.rule == "limit"]
    assert (found.kind, found.move, found.row) == ("effort", 1, 4)
    assert [found.value, found.time] == pytest.approx([side * 3.0, t[-1]], rel=1e-6)
