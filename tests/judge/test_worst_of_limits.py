"""Which of several offences is named, with which value, where rows and the curve between them say different things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_rows import bare_robot, rounded_rows

from trajcli.findings import Finding
from trajcli.judge import joint_limits
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Friction, Joint, Limits, LinkInertia, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

SIDES = [1, -1]


def motion_of(*columns: np.ndarray, t: np.ndarray, rounding: float = 0.0) -> RecordedMotion:
    """Return rows of one joint whose positions alone are rounded."""
    stated = [*(np.asarray(column, dtype=float)[:, None] for column in columns), None, None][:3]
    exact = np.zeros(1)
    return RecordedMotion(
        t, *stated, None, None, None, None, Resolution(0.0, exact + rounding, exact, exact), "rows"
    )


def bounded(kind: str, low: float, high: float) -> Limits:
    return replace(unlimited(1), **{kind: np.array([[low, high]])})


def over(motion: RecordedMotion, limits: Limits, interpolate: str) -> list[Finding]:
    """Return what is over limits for those who join the rows so."""
    judgement = judge_motion(lambda: [motion], Requirements(bare_robot(limits), interpolate=interpolate))
    return [found for found in judgement.findings if found.rule == "limit"]


@pytest.mark.parametrize("side", SIDES)
def test_of_both_sides_of_a_velocity_that_counts_which_must_last_longer(side: int) -> None:
    """1.5 where 1 is allowed, and 11 where 10 are: half as long again is more than a tenth."""
    t = np.arange(4.0)
    q = side * np.append(0.0, np.cumsum([1.5, 0.0, -11.0]))
    limits = bounded("velocity", *sorted([side * 1.0, -side * 10.0]))
    (found,) = over(motion_of(q, t=t), limits, "linear")
    assert (found.value, found.limit, found.count) == (side * 1.5, side * 1.0, 2)


@pytest.mark.parametrize("side", SIDES)
def test_of_both_ends_of_a_range_that_counts_which_is_left_further(side: int) -> None:
    """By 0.5 beyond 1, and by 1 beyond 10: of ranges about another zero the shares would be others."""
    q = side * np.array([0.0, 1.5, 0.0, -11.0])
    limits = bounded("position", *sorted([side * 1.0, -side * 10.0]))
    (found,) = over(motion_of(q, t=np.arange(4.0)), limits, "linear")
    assert (found.value, found.limit) == (-side * 11.0, -side * 10.0)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rounding", [0.0, 0.05])
def test_where_rounding_explains_what_the_curve_has_the_value_is_that_of_the_rows(
    rounding: float, side: int
) -> None:
    """Rows state 1 where 0.99 are allowed. Between them a cubic has 1 + 1.5 (1.02 - 1), if its way is as written."""
    t, qd = np.arange(2.0), side * np.ones(2)
    motion = motion_of(side * np.array([0.0, 1.02]), qd, t=t, rounding=rounding)
    (found,) = over(motion, bounded("velocity", *sorted([side * 0.99, -side * 9.0])), "cubic")
    assert found.certainty == "exceeded"
    assert found.value == pytest.approx(side * (1.0 if rounding else 1.03), rel=1e-9)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("stated", [0.0, 1.05])
def test_velocities_of_rows_say_nothing_of_a_spline_through_positions(stated: float, side: int) -> None:
    """From rest to rest over 4 in 6 s one cubic is fastest with 1, where 0.99 are allowed: rounding explains that."""
    t = np.arange(7.0)
    q = side * 4.0 * (t / 6) ** 2 * (3 - 2 * t / 6)
    motion = motion_of(q, side * np.full(7, stated), t=t, rounding=0.01)
    limits = bounded("velocity", *sorted([side * 0.99, -side * 9.0]))
    (found,) = over(motion, limits, "jtc-upsampling")
    assert found.certainty == "within rounding"
    assert found.value == pytest.approx(side * 1.0, rel=1e-9)
    (exact,) = over(replace(motion, resolution=motion_of(q, t=t).resolution), limits, "jtc-upsampling")
    assert exact.certainty == "exceeded"


@pytest.mark.parametrize("worst", [0, 5, 11])
@pytest.mark.parametrize("side", SIDES)
def test_of_many_pieces_that_leave_a_limit_in_between_the_worst_is_found_wherever_it_is(
    worst: int, side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From rest to rest the largest velocity of a cubic is 3/2 of its mean: more than are looked at together."""
    monkeypatch.setattr(joint_limits, "_MANY", 4)
    lengths, means = np.tile([1.0, 0.25, 2.0], 4), np.full(12, 1.0)
    means[worst] = 1.2
    t, q = (np.append(0.0, np.cumsum(steps)) for steps in (lengths, means * lengths))
    motion = motion_of(side * q, np.zeros(13), t=t)
    (found,) = over(motion, bounded("velocity", *sorted([side * 1.4, -side * 9.0])), "cubic")
    assert found.count == 12
    assert found.value == pytest.approx(side * 1.8, rel=1e-9)
    assert found.time == pytest.approx((t[worst] + t[worst + 1]) / 2, abs=1e-9)


@pytest.mark.parametrize("size", [1e-7, 1.0, 1e7])
@pytest.mark.parametrize("side", SIDES)
def test_what_is_over_a_limit_is_so_in_any_unit(side: int, size: float) -> None:
    """From rest to rest by 3/2 of the mean velocity: a ten thousandth over its limit, or below it."""
    t, q = np.arange(3.0), side * size * np.array([0.0, 1.0, 1.0])
    for share, count in ((1 + 1e-4, 1), (1 - 1e-4, 0)):
        limits = bounded("velocity", *sorted([side * size * 1.5 / share, -side * size * 9.0]))
        assert len(over(motion_of(q, np.zeros(3), t=t), limits, "cubic")) == count


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("slow", [0, 1])
def test_pieces_of_each_move_have_their_own_lengths_and_limits(slow: int, side: int) -> None:
    """From rest to rest by 1 in 1 s, and after 0.5 s of rest in 0.25 s and in 2 s: with 1.5, 6 and 0.75."""
    t, q = np.array([0.0, 1.0, 1.5, 1.75, 3.75]), np.array([0.0, 1.0, 1.0, 2.0, 3.0])
    motion = replace(motion_of(side * q, np.zeros(5), t=t), move=np.array([0, 0, 1, 1, 1]))
    robots = [bare_robot(bounded("velocity", *sorted([side * most, -side * 99.0]))) for most in (1.501, 6.01)]
    tight = [bare_robot(bounded("velocity", *sorted([side * most, -side * 99.0]))) for most in (1.49, 5.99)]
    for chosen, count in ((robots, 0), ([*robots[:slow], tight[slow], *robots[slow + 1 :]], 1)):
        required = Requirements(chosen[0], by_move=dict(enumerate(chosen)), interpolate="cubic")
        found = [each for each in judge_motion(lambda: [motion], required).findings if each.rule == "limit"]
        assert len(found) == count
        for each in found:
            assert (each.move, each.count) == (slow, 1)
            assert each.value == pytest.approx(side * (1.5, 6.0)[slow])
            assert each.time == pytest.approx((0.5, 1.625)[slow])


def approached(side: int, most: float) -> Limits:
    """Return a limit of the velocity towards an end of the range that is so far that it is the same everywhere."""
    far = 1e6
    position = np.array([sorted([side * far, -side * 1e4 * far])])
    by_position = np.array([[most**2 / (2 * far), 0.0]])
    return replace(unlimited(1), position=position, velocity_by_position=by_position)


@pytest.mark.parametrize("by_position", [False, True])
@pytest.mark.parametrize("length", [0.25, 4.0])
@pytest.mark.parametrize("side", SIDES)
def test_a_piece_of_a_later_move_ends_after_its_own_time(length: float, side: int, by_position: bool) -> None:
    """After a second of rest steadily faster, to 1.5 at the last row, which alone is over its limit of 1.25."""
    t = np.array([0.0, 1.0, 2.0, 2.0 + length])
    q, qd = np.array([0.0, 0.0, 0.0, 0.75 * length]), np.array([0.0, 0.0, 0.0, 1.5])
    motion = replace(motion_of(side * q, side * qd, t=t), move=np.array([0, 0, 1, 1]))
    limits = [
        approached(side, most) if by_position else bounded("velocity", *sorted([side * most, -side * 99.0]))
        for most in (9.0, 1.25)
    ]
    robots = [bare_robot(each) for each in limits]
    required = Requirements(robots[0], by_move=dict(enumerate(robots)), interpolate="cubic")
    (found,) = [each for each in judge_motion(lambda: [motion], required).findings if each.rule == "limit"]
    assert found.kind == ("velocity_by_position" if by_position else "velocity")
    assert (found.value, found.time, found.row) == (pytest.approx(side * 1.5), pytest.approx(t[-1]), 4)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("columns", [1, 2, 3])
def test_speeds_are_as_uncertain_beside_a_limit_by_position_as_beside_any_other(
    columns: int, side: int
) -> None:
    """The limit is the same everywhere, and no less certain where the joint is."""
    t = np.arange(3.0)
    rows = [side * np.array([0.0, 1.0, 2.0]), side * np.ones(3), np.zeros(3)][:columns]
    motion = motion_of(*rows, t=t, rounding=0.01)
    interpolate = ("linear", "cubic", "quintic")[columns - 1]
    limits = approached(side, 0.9), bounded("velocity", *sorted([side * 0.9, -side * 99.0]))
    (approach,), (speed,) = (over(motion, each, interpolate) for each in limits)
    assert (approach.kind, speed.kind) == ("velocity_by_position", "velocity")
    assert approach.rounding == pytest.approx(speed.rounding, rel=1e-5)
    assert approach.certainty == speed.certainty == "exceeded"


@pytest.mark.parametrize("side", SIDES)
def test_limits_by_position_are_as_certain_on_lines_as_on_the_cubics_behind_them(side: int) -> None:
    """Rows that state no velocity are joined by lines, those behind them that are slower by cubics."""
    t, q = np.arange(5.0), np.array([0.0, 2.0, 4.0, 5.1, 6.2])
    motion = motion_of(side * q, side * np.array([np.nan, np.nan, 1.1, 1.1, 1.1]), t=t, rounding=0.01)
    limits = approached(side, 1.0)
    (found,) = over(replace(motion, t=t), limits, "jtc")
    assert (found.value, found.certainty) == (pytest.approx(side * 2.0), "exceeded")
    assert found.rounding < 0.1


MASS = 2.0


def slides(side: int, most: float) -> Robot:
    """Return two slides at right angles, each of 2 kg; the force of the second one has a limit."""
    link = LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    joints = tuple(Joint(f"s{k}", "prismatic", alpha=k * np.pi / 2, link=link) for k in range(2))
    effort = np.array([[-np.inf, np.inf], sorted([side * most, -side * 99.0])])
    limits = replace(unlimited(2), effort=effort)
    return Robot("slides", joints, limits, "modified", np.eye(4), np.eye(4), gravity=np.zeros(3))


def steps(t: np.ndarray, q: np.ndarray, rounding: tuple[float, float] = (0.0, 0.0)) -> RecordedMotion:
    """Return rows at rest of two joints, whose accelerations are rounded."""
    exact, still = np.zeros(2), np.zeros((t.size, 2))
    resolution = Resolution(0.0, exact, exact, np.array(rounding))
    return RecordedMotion(
        t, np.stack([still[:, 0], q], axis=1), still, still, None, None, None, None, resolution, "rows"
    )


@pytest.mark.parametrize("side", SIDES)
def test_a_force_is_as_uncertain_as_the_accelerations_of_the_joints_that_make_it(side: int) -> None:
    """The other slide moves at a right angle to it: what its accelerations are off by is none of this force."""
    t, q = np.array([0.0, 1.0]), side * np.array([0.0, 1.0])
    told = []
    for rounding in ((0.0, 0.1), (0.2, 0.1), (0.1, 0.0)):
        required = Requirements(slides(side, 2.0))
        judgement = judge_motion(lambda rounding=rounding: [steps(t, q, rounding)], required)
        (found,) = [each for each in judgement.findings if each.rule == "limit"]
        assert (found.kind, found.joint) == ("effort", "s1")
        assert found.value == pytest.approx(side * MASS * 10 / 3**0.5, rel=1e-5)
        told.append(found.rounding)
    assert told[0] == told[1] > MASS * 0.1
    assert told[2] < 1e-9


@pytest.mark.parametrize("share", [0.5, 1.5])
@pytest.mark.parametrize("side", SIDES)
def test_a_torque_is_as_uncertain_as_where_the_arm_is_held(side: int, share: float) -> None:
    """A mass of 4 kg at half a metre, held 1 rad above the horizon; positions have three decimals, rates six."""
    link = LinkInertia(4.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    upright = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
    off, torque = 5e-4, 4.0 * 9.81 * 0.5 * np.cos(1.0)
    limit = torque - share * off * 4.0 * 9.81 * 0.5 * np.sin(1.0)
    limits = replace(unlimited(1), effort=np.array([[-limit, limit]]))
    weight = np.array([0.0, 0.0, -9.81 * side])
    arm = Robot(
        "arm", (Joint("a", a=0.5, link=link),), limits, "standard", upright, np.eye(4), gravity=weight
    )
    t, still = 100.0 * np.arange(3), np.zeros((3, 1))
    resolution = Resolution(0.0, np.array([off]), *np.full((2, 1), 5e-7))
    rows = RecordedMotion(t, still + 1.0, still, still, None, None, None, None, resolution, "rows")
    (found,) = judge_motion(lambda: [rows], Requirements(arm)).findings
    assert (found.value, found.kind) == (pytest.approx(side * torque, rel=1e-5), "effort")
    assert found.certainty == ("within rounding" if share < 1 else "exceeded")


@pytest.mark.parametrize("side", SIDES)
def test_viscous_friction_is_as_uncertain_as_the_velocity(side: int) -> None:
    """A slide of no weight at 2 m/s, whose friction of 7 N s/m is a hair over its limit."""
    slide, t, still = slides(side, 13.999), 100.0 * np.arange(3), np.zeros((3, 2))
    joints = (slide.joints[0], replace(slide.joints[1], friction=Friction(viscous=7.0)))
    slide = replace(slide, joints=joints)
    speeds = np.tile([0.0, side * 2.0], (3, 1))
    resolution = Resolution(0.0, np.zeros(2), np.array([0.0, 5e-4]), np.zeros(2))
    rows = RecordedMotion(t, t[:, None] * speeds, speeds, still, None, None, None, None, resolution, "rows")
    (found,) = [f for f in judge_motion(lambda: [rows], Requirements(slide)).findings if f.kind == "effort"]
    assert (found.value, found.certainty) == (pytest.approx(side * 14.0), "within rounding")
    assert found.rounding == pytest.approx(7.0 * (1.875 + 2.0 + 1.0) * 5e-4, rel=0.01)  # of a quintic


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("dense_first", [False, True])
def test_rows_are_dense_or_not_where_the_force_is(dense_first: bool, side: int) -> None:
    """From rest to rest in 1 s or in 5 ms, beside rest in the other one: all rows state a force of none."""
    lengths = [0.005, 1.0]
    t = np.array([0.0, *np.cumsum(lengths if dense_first else lengths[::-1])])
    for fast in (0, 1):
        length = t[fast + 1] - t[fast]
        q = side * length**2 * (np.arange(3) > fast)
        judgement = judge_motion(lambda q=q: [steps(t, q)], Requirements(slides(side, 2.0)))
        (found,) = [each for each in judgement.findings if each.kind == "effort"]
        assert found.severity == ("error" if length > 0.01 else "warning")
        assert found.row == fast + 1


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("columns", [2, 3])
@pytest.mark.parametrize("decimals", [3, 4])
@pytest.mark.parametrize("asked", [True, False])
@pytest.mark.parametrize(("beyond", "verdict"), [(0.05, "exceeded"), (-0.01, "")])
def test_rows_that_state_more_than_the_way_to_the_end_allows_are_certain_whatever_their_decimals_are(
    beyond: float, verdict: str, decimals: int, columns: int, side: int, *, asked: bool
) -> None:
    """At 0.6 rad/s up to where sqrt(12 x) - 0.3 is so much less; positions a millisecond apart tell 0.1 or 1 rad/s."""
    speed, start, left = 0.6, 0.2, (0.6 - beyond + 0.3) ** 2 / 12
    t = 1e-3 * np.arange(int((start - left) / speed * 1e3) + 1)
    q, qd = side * (1.0 - start + speed * t), np.full(t.size, side * speed)
    rows = rounded_rows(t, [q, qd, 0.0 * t][:columns], decimals)
    limits = replace(
        unlimited(1), position=np.array([[-1.0, 1.0]]), velocity_by_position=np.array([[6.0, 0.3]])
    )
    joined = ("cubic" if columns == 2 else "quintic") if asked else None
    judged = judge_motion(lambda: [rows], Requirements(bare_robot(limits), interpolate=joined))
    (told,) = [each for each in judged.findings if each.kind == "velocity_by_position"] or [None]
    assert (judged.verdict == "exceeded") == (verdict == "exceeded")
    if verdict and told is not None:
        assert (told.value, told.certainty) == (pytest.approx(side * speed), "exceeded")
        assert told.time == pytest.approx(t[-1], abs=3e-3)
        assert abs(told.limit) == pytest.approx(speed - beyond, abs=0.01)
        assert told.factor == pytest.approx(told.value / told.limit)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("share", [0.97, 0.995, 1.005])
def test_what_a_weight_takes_between_sparse_rows_is_hidden_by_no_short_interval(
    share: float, side: int
) -> None:
    """2 kg lifted with 3 m/s^2 at most, 0.15 less at the rows beside; the first slide bears it and stands still.

    Six decimals make hundreds of newtons of an interval of 0.1 ms.
    """
    t, w = np.sort(np.append(np.arange(11) * 0.1, 0.5001)), 2 * np.pi
    states = (-np.sin(w * t) / w**2, -np.cos(w * t) / w, np.sin(w * t))
    rows = [np.round(np.stack([0 * t, 3.0 * side * each], axis=1), 6) for each in states]
    half, lifted = np.full(2, 0.5e-6), MASS * (9.81 + 3.0)
    motion = RecordedMotion(t, *rows, None, None, None, None, Resolution(0.0, half, half, half), "rows")
    arm = replace(slides(side, share * lifted), gravity=side * np.array([0.0, 9.81, 0.0]))
    found = [f for f in judge_motion(lambda: [motion], Requirements(arm)).findings if f.kind == "effort"]
    told = [each for each in found if each.certainty == "exceeded"]
    assert len(told) == (share < 1)
    for each in told:
        assert (each.joint, each.severity, each.method) == ("s1", "error", "bounded")
        assert each.value == pytest.approx(side * lifted, rel=1e-3)
        assert each.time == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("coarse", [0, 1])
def test_a_last_velocity_of_a_unit_turns_no_slide_back_whichever_has_fewer_decimals(
    coarse: int, side: int
) -> None:
    """Braking 2 kg by 10 m/s^2 takes 19 N with 1 N of friction, and 21 N if the last row went back."""
    t, off = 0.008 * np.arange(8), np.full(2, 0.5e-12)
    off[coarse] = 0.5e-5
    braked = [0.56 * t - 5.0 * t**2, 0.56 - 10.0 * t, 0.0 * t - 10.0]
    rows = [side * np.tile(each[:, None], (1, 2)) for each in braked]
    rows[1][-1] = -1.9 * side * off
    arm = slides(-side, 20.5)
    arm = replace(arm, joints=tuple(replace(joint, friction=Friction(1.0, 0.0)) for joint in arm.joints))
    exact = np.zeros(2)
    motion = RecordedMotion(t, *rows, None, None, None, None, Resolution(0.0, exact, off, exact), "rows")
    errors = judge_motion(lambda: [motion], Requirements(arm)).errors
    assert not [each for each in errors if each.kind == "effort"]


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("largest", "over"), [(9.0, True), (6.0, False)])
def test_what_dense_rows_of_a_later_move_state_is_hidden_by_no_short_interval(
    largest: float, side: int, *, over: bool
) -> None:
    """2 kg that swing; 7.6 m/s^2 are allowed, and a velocity that is off by 2 mm/s makes 20 of an interval of 0.1 ms."""
    t, w = np.append([-1.0, -0.5], np.sort(np.append(np.arange(251) * 4e-3, 0.5001))), 2 * np.pi
    swings = np.maximum(t, 0.0)
    q = side * largest * (-np.sin(w * swings) / w**2 - np.minimum(t, 0.0) / w)
    qd = side * largest * -np.cos(w * swings) / w + side * 2e-3 * (t == 0.5001)
    rows = [np.stack([0 * t, np.round(each, places)], axis=1) for each, places in ((q, 6), (qd, 3))]
    resolution = Resolution(0.0, np.full(2, 0.5e-6), np.full(2, 2.5e-3), np.zeros(2))
    moves = (t >= 0).astype(int)
    motion = RecordedMotion(t, *rows, None, None, None, moves, None, resolution, "rows")
    required = Requirements(slides(side, 98.0), by_move={0: slides(side, 98.0), 1: slides(side, MASS * 7.6)})
    found = [f for f in judge_motion(lambda: [motion], required).findings if f.kind == "effort"]
    certain = [each for each in found if (each.certainty, each.severity) == ("exceeded", "error")]
    assert len(certain) == over
    for each in certain:
        assert (each.move, each.joint, each.method) == (1, "s1", "sampled")
        assert each.value == pytest.approx(side * MASS * largest, rel=0.06)
        assert abs(each.value) - MASS * 7.6 > each.rounding > 0
        assert each.time == pytest.approx(0.25, abs=0.05)
        assert each.time == pytest.approx(t[each.row - 1 : each.row + 1].mean(), abs=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_friction_of_a_joint_that_turns_back_makes_no_force_of_another_uncertain(side: int) -> None:
    """The second slide speeds up by 1.05 m/s^2 in 8 ms, the first one goes to and fro against 5 N of friction."""
    t, k = 0.008 * np.arange(8), np.arange(8)
    qd = np.stack([np.where(k % 2, 1.2e-3, -1e-3), side * np.where(k < 4, 0.0, 1.05 * 0.008)], axis=1)
    q = np.concatenate([np.zeros((1, 2)), np.cumsum(0.004 * (qd[1:] + qd[:-1]), axis=0)])
    q[4:, 1] += side * 0.008**2 * 0.2 / 6
    exact = np.zeros(2)
    motion = RecordedMotion(t, q, qd, None, None, None, None, None, Resolution(0.0, *[exact] * 3), "rows")
    arm = slides(side, MASS)
    arm = replace(arm, joints=(replace(arm.joints[0], friction=Friction(5.0, 0.0)), arm.joints[1]))
    (found,) = [f for f in judge_motion(lambda: [motion], Requirements(arm)).findings if f.kind == "effort"]
    assert (found.joint, found.severity) == ("s1", "error")
    assert found.value == pytest.approx(side * MASS * 1.25, rel=1e-5)


def rubbing_slides(side: int, most: float) -> Robot:
    """Return slides of which the second one has 0.5 N of friction, and another one of its own."""
    arm, frictions = slides(side, most), (Friction(2.0, 3.0), Friction(0.5, 7.0))
    joints = zip(arm.joints, frictions, strict=True)
    return replace(arm, joints=tuple(replace(joint, friction=friction) for joint, friction in joints))


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("most", "severity"), [(1.4, "error"), (1.6, "warning"), (2.4, "warning")])
def test_on_which_side_friction_is_no_row_at_rest_says(most: float, severity: str, side: int) -> None:
    """2 kg start with 1 m/s^2 against 0.5 N: 2.5 N, and 1.5 to who takes the row for the end of a way back."""
    t = 0.008 * np.arange(6)
    qdd = side * np.where(t == 0, 1.0, 0.2)
    qd = np.append(0.0, np.cumsum(0.004 * (qdd[1:] + qdd[:-1])))
    q = np.append(0.0, np.cumsum(0.004 * (qd[1:] + qd[:-1]) - 0.008**2 * np.diff(qdd) / 12))
    rows = [np.stack([0 * t, each], axis=1) for each in (q, qd, qdd)]
    motion = RecordedMotion(t, *rows, None, None, None, None, Resolution(0.0, *np.zeros((3, 2))), "rows")
    judgement = judge_motion(lambda: [motion], Requirements(rubbing_slides(side, most)))
    (found,) = [each for each in judgement.findings if each.kind == "effort"]
    assert (found.joint, found.severity) == ("s1", severity)
    assert found.value == pytest.approx(side * 2.5, rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
def test_a_weight_that_hangs_still_has_no_friction(side: int) -> None:
    """2 kg take 19.62 N, which is certain as nothing moves beside."""
    t, still = 0.008 * np.arange(6), np.zeros((6, 2))
    motion = RecordedMotion(
        t, still, still, still, None, None, None, None, Resolution(0.0, *np.zeros((3, 2))), "rows"
    )
    arm = replace(rubbing_slides(side, 19.2), gravity=side * np.array([0.0, 9.81, 0.0]))
    (found,) = judge_motion(lambda: [motion], Requirements(arm)).findings
    assert (found.kind, found.severity) == ("effort", "error")
    assert found.value == pytest.approx(side * MASS * 9.81, rel=1e-5)
    assert found.rounding < 1e-9


@pytest.mark.parametrize(("share", "certainty"), [(0.9, "within rounding"), (1.1, "exceeded")])
def test_a_centripetal_force_is_as_uncertain_as_the_turning_that_makes_it(
    share: float, certainty: str
) -> None:
    """A slide holds 2 kg half a metre from an axis that turns with 3 rad/s: 9 N, and 2 m r w for each rad/s of error."""
    link = LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    joints = (Joint("turn", link=link), Joint("slide", "prismatic", alpha=np.pi / 2, link=link))
    off, force = 5e-4, MASS * 0.5 * 3.0**2
    rounding = 2 * MASS * 0.5 * 3.0 * off  # of a row; of the quintic between them more, as above
    effort = np.array([[-np.inf, np.inf], [-(force - share * rounding), np.inf]])
    limits = replace(unlimited(2), effort=effort)
    arm = Robot("arm", joints, limits, "modified", np.eye(4), np.eye(4), gravity=np.zeros(3))
    t, still = 100.0 * np.arange(3), np.zeros((3, 2))
    resolution = Resolution(0.0, np.zeros(2), np.array([off, 0.0]), np.zeros(2))
    rows = RecordedMotion(
        t,
        np.stack([3.0 * t, still[:, 1] + 0.5], axis=1),
        np.stack([still[:, 0] + 3.0, still[:, 1]], axis=1),
        still,
        None,
        None,
        None,
        None,
        resolution,
        "rows",
    )
    (found,) = [f for f in judge_motion(lambda: [rows], Requirements(arm)).findings if f.kind == "effort"]
    assert (found.value, found.certainty) == (pytest.approx(-force, rel=1e-4), certainty)
    between = 1.875 + 2.0 + 1.0 if share < 1 else 1.0
    assert found.rounding == pytest.approx(between * rounding, rel=0.01)
