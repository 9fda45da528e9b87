"""Rules of consumers: one planted fault a rule, found, named and timed; clean twins are satisfied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import (
    CHANGE,
    HOME,
    judged,
    motion,
    only,
    quintic,
    surroundings,
    with_value,
)

from trajcli.consumers.judgement import judge_by_profile, load_profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion

CLEAN = {
    "ros-jtc": motion(period=0.1, rows=21),
    "franka-fer": motion(),
    "franka-fr3": motion(),
    "ur-servoj": motion(6, 2e-3, 501),
    "ur-passthrough": motion(6, 0.1, 21, decimals=6),
}


@pytest.mark.parametrize("profile", CLEAN)
def test_a_clean_motion_breaks_no_rule(profile: str) -> None:
    verdict = judged(CLEAN[profile], profile)
    assert verdict.findings == ()
    assert verdict.accepted


# --- time stamps ---


@pytest.mark.parametrize("change", [0.0, -0.3e-9, -0.05])
def test_a_stamp_that_does_not_increase_in_whole_nanoseconds(change: float) -> None:
    rows = CLEAN["ros-jtc"]
    t = rows.t.copy()
    t[8] = t[7] + change
    breach = only(judged(replace(rows, t=t), "ros-jtc"))
    assert (breach.rule, breach.severity, breach.kind, breach.row) == (
        "jtc-increasing-times",
        "error",
        "time",
        9,
    )
    assert breach.time == t[8]


def test_stamps_a_nanosecond_apart_are_accepted() -> None:
    rows = CLEAN["ros-jtc"]
    t = rows.t.copy()
    t[8] = t[7] + 1e-9
    assert judged(replace(rows, t=t), "ros-jtc").findings == ()


@pytest.mark.parametrize(
    ("profile", "rule"),
    [("franka-fr3", "fr3-period"), ("franka-fer", "fer-period"), ("ur-servoj", "servoj-period")],
)
def test_a_row_beside_the_period(profile: str, rule: str) -> None:
    rows = CLEAN[profile]
    t = rows.t.copy()
    t[100:] += 2e-5
    breach = only(judged(replace(rows, t=t), profile))
    assert (breach.rule, breach.severity, breach.kind, breach.row) == (rule, "error", "time", 101)
    assert breach.value == pytest.approx(rows.t[1] + 2e-5)
    assert breach.hint is not None
    assert "align" in breach.hint
    rate = 500 if profile == "ur-servoj" else 1000
    assert f"`trajcli resample --rate {rate}` leaves the last row where it stands" in breach.hint


def test_stamps_that_are_rounded_are_at_their_period() -> None:
    rows = CLEAN["franka-fr3"]
    coarse = replace(rows.resolution, time=5e-4)
    shifted = rows.t + np.random.default_rng(3).uniform(-4e-4, 4e-4, rows.t.size)
    assert judged(replace(rows, t=shifted, resolution=coarse), "franka-fr3").findings == ()


def test_a_segment_that_becomes_zero_microseconds_aborts() -> None:
    rows = CLEAN["ur-passthrough"]
    t, q, qd, qdd = (
        np.insert(values, 5, values[4], axis=0) for values in (rows.t, rows.q, rows.qd, rows.qdd)
    )
    t[5] += 3e-7
    verdict = judged(replace(rows, t=t, q=q, qd=qd, qdd=qdd), "ur-passthrough")
    found = {breach.rule: breach for breach in verdict.findings}
    breach = found["passthrough-durations"]
    assert (breach.severity, breach.kind, breach.row, breach.count) == ("error", "time", 6, 1)
    assert breach.value == pytest.approx(3e-7, abs=1e-12)


@pytest.mark.parametrize("shortest", [5, 6])
def test_of_segments_that_become_zero_the_shortest_is_named(shortest: int) -> None:
    rows = CLEAN["ur-passthrough"]
    t, q, qd, qdd = (
        np.insert(values, [5, 5], values[4], axis=0) for values in (rows.t, rows.q, rows.qd, rows.qdd)
    )
    t[5:7] = t[4] + (1e-7 if shortest == 5 else 4e-7), t[4] + 5e-7
    verdict = judged(replace(rows, t=t, q=q, qd=qd, qdd=qdd), "ur-passthrough")
    breach = {each.rule: each for each in verdict.findings}["passthrough-durations"]
    assert (breach.row, breach.count, breach.move) == (shortest + 1, 2, None)
    assert breach.value == pytest.approx(1e-7, abs=1e-12)


@pytest.mark.parametrize(
    ("named", "name"),
    [(None, "q5"), (("a", "b"), "q5"), (tuple("abcdefg"), "e"), (tuple("abcdefgh"), "q5")],
    ids=["none", "two", "seven", "eight"],
)
def test_joints_that_the_file_does_not_name_have_the_names_of_the_robot_or_numbers(
    named: tuple[str, ...] | None, name: str
) -> None:
    """Names of a robot that has other joints are none of these."""
    rows = replace(with_value(CLEAN["franka-fr3"], "q", 500, 4, 1e-3), joints=None)
    found = judged(rows, "franka-fr3", Surroundings(named, HOME[7])).findings
    assert {each.joint for each in found if each.rule == "fr3-acceleration"} == {name}


def test_a_first_point_at_time_zero_is_no_zero_duration() -> None:
    assert CLEAN["ur-passthrough"].t[0] == 0


def test_durations_of_no_whole_microseconds_are_noted() -> None:
    rows = CLEAN["ur-passthrough"]
    t = rows.t.copy()
    t[10] += 4e-7
    judgement = judged(replace(rows, t=t), "ur-passthrough")
    breach = only(judgement)
    assert judgement.accepted
    assert (breach.rule, breach.severity, breach.row, breach.count) == (
        "passthrough-whole-microseconds",
        "warning",
        11,
        2,
    )
    assert breach.value == pytest.approx(4e-7, rel=1e-3)


def test_a_motion_longer_than_an_int32_of_microseconds() -> None:
    rows = CLEAN["ur-passthrough"]
    t = rows.t.copy()
    t[-1] = 2147.5
    judgement = judged(replace(rows, t=t), "ur-passthrough")
    assert not judgement.accepted
    breach = {breach.rule: breach for breach in judgement.findings}["passthrough-longest"]
    assert (breach.severity, breach.time, breach.row, breach.limit) == ("error", 2147.5, 21, 2147)
    t[-1] = 2147.0
    assert judged(replace(rows, t=t), "ur-passthrough").findings == ()


def test_errors_come_first_whenever_they_are() -> None:
    rows = CLEAN["ur-passthrough"]
    t = rows.t.copy()
    t[5] += 4e-7
    t[-1] = 2147.5
    found = judged(replace(rows, t=t), "ur-passthrough").findings
    assert [breach.severity for breach in found] == ["error", "warning"]
    assert found[0].time > found[1].time


def test_the_first_of_several_stamps_that_are_too_late_is_named_with_the_latest_as_value() -> None:
    rows = CLEAN["ur-passthrough"]
    t = rows.t.copy()
    t[-3:] += 2147.0
    found = {each.rule: each for each in judged(replace(rows, t=t), "ur-passthrough").findings}
    late = found["passthrough-longest"]
    assert (late.row, late.time, late.value, late.count) == (19, t[-3], t[-1], 3)
    assert "(row 19) is the first" in late.message


# --- joints and points ---


def test_names_of_joints() -> None:
    rows = CLEAN["ros-jtc"]
    names = list(rows.joints or ())
    doubled = only(judged(replace(rows, joints=(*names[:6], names[0])), "ros-jtc", Surroundings()))
    assert (doubled.rule, doubled.severity) == ("jtc-joint-names", "error")
    assert "twice" in doubled.message
    empty = only(judged(replace(rows, joints=(*names[:6], " ")), "ros-jtc", Surroundings()))
    assert "no name" in empty.message
    stranger = judged(replace(rows, joints=(*names[:6], "joint_77")), "ros-jtc")
    messages = [breach.message for breach in stranger.findings]
    assert messages == [
        "the robot has no joint 'joint_77'",
        "the joint 'joint_7' is missing",
    ] or messages == [
        "the joint 'joint_7' is missing",
        "the robot has no joint 'joint_77'",
    ]


@pytest.mark.parametrize("missing", [0, 3, 6])
def test_a_partial_goal_misses_a_joint(missing: int) -> None:
    rows, others = CLEAN["ros-jtc"], np.delete(np.arange(7), missing)
    part = replace(
        rows,
        q=rows.q[:, others],
        qd=rows.qd[:, others],
        qdd=rows.qdd[:, others],
        joints=tuple(f"joint_{joint + 1}" for joint in others),
        resolution=replace(
            rows.resolution, **{name: getattr(rows.resolution, name)[others] for name in ("q", "qd", "qdd")}
        ),
    )
    found = judged(part, "ros-jtc", Surroundings(surroundings(7).joints, HOME[7][others]))
    told = [(each.kind, each.joint, each.message) for each in found.findings]
    assert told == [("joints", None, f"the joint 'joint_{missing + 1}' is missing")]


@pytest.mark.parametrize(
    ("profile", "joints"), [("franka-fr3", 6), ("franka-fer", 6), ("ur-servoj", 7), ("ur-passthrough", 7)]
)
def test_the_number_of_joints(profile: str, joints: int) -> None:
    period = {"ur-servoj": 2e-3}.get(profile, 1e-3)
    found = judged(motion(joints, period), profile).findings
    assert [
        (each.rule.split("-", 1)[1], each.severity, each.kind, each.joint, each.value)
        for each in found
        if "joints" in each.rule
    ] == [("joints", "error", "joints", None, joints)]


@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["q", "qd", "qdd"])
def test_a_point_without_a_number(name: str, missing: float) -> None:
    rows = with_value(CLEAN["ros-jtc"], name, 4, 2, missing)
    (breach,) = [each for each in judged(rows, "ros-jtc").findings if each.rule == "jtc-complete-points"]
    assert (breach.rule, breach.joint, breach.row, breach.severity) == (
        "jtc-complete-points",
        "joint_3",
        5,
        "error",
    )


def test_the_time_of_a_row_is_told_to_the_nanosecond_of_a_short_file() -> None:
    rows = CLEAN["ros-jtc"]
    moving = with_value(replace(rows, t=rows.t + 0.123456789), "qd", -1, 3, -1.3e-7)
    (told,) = [each for each in judged(moving, "ros-jtc").findings if each.rule == "jtc-last-velocity"]
    assert " at t = 2.12345679 s (row 21);" in told.message


def test_a_last_velocity_above_the_epsilon_of_float32() -> None:
    epsilon = float(np.finfo(np.float32).eps)
    rows = with_value(CLEAN["ros-jtc"], "qd", -1, 3, -1.3e-7)
    breach = only(judged(rows, "ros-jtc"))
    assert (breach.rule, breach.kind, breach.joint, breach.row, breach.time, breach.value) == (
        "jtc-last-velocity",
        "end",
        "joint_4",
        21,
        2.0,
        -1.3e-7,
    )
    assert breach.limit == pytest.approx(epsilon, rel=5e-3)
    assert judged(with_value(CLEAN["ros-jtc"], "qd", -1, 3, 1.1e-7), "ros-jtc").findings == ()


@pytest.mark.parametrize("columns", ["q,qd", "q,qd,qdd"])
@pytest.mark.parametrize(("velocity", "taken"), [(1.19e-7, True), (1.195e-7, False)])
def test_a_last_velocity_is_told_from_rest_by_the_epsilon_of_float32(
    velocity: float, columns: str, *, taken: bool
) -> None:
    rows = with_value(motion(period=0.1, rows=21, columns=columns), "qd", -1, 3, -velocity)
    assert [each.rule for each in judged(rows, "ros-jtc").findings] == ["jtc-last-velocity"] * (not taken)


def test_names_of_a_message_are_judged_with_those_that_are_left_out() -> None:
    """It names the joints in another order, and a gripper that the arm has not; joints have the names of their columns."""
    rows = CLEAN["ros-jtc"]
    names = rows.joints or ()
    rows = with_value(replace(rows, message_joints=(*names[::-1], "gripper")), "qd", -1, 0, 1e-3)
    found = {each.rule: each for each in judged(rows, "ros-jtc", surroundings(7)).findings}
    assert found["jtc-joint-names"].message == "the robot has no joint 'gripper'"
    assert found["jtc-joint-names"].joint is None
    assert found["jtc-last-velocity"].joint == "joint_1"
    same = replace(rows, message_joints=names[::-1])
    (told,) = judged(same, "ros-jtc", surroundings(7)).findings
    assert told.joint == "joint_1"


def test_efforts_are_rejected() -> None:
    rows = replace(CLEAN["ros-jtc"], tau=np.zeros((21, 7)))
    breach = only(judged(rows, "ros-jtc"))
    assert (breach.rule, breach.kind, breach.severity, breach.row, breach.count, breach.joint) == (
        "jtc-effort",
        "effort",
        "error",
        1,
        21,
        None,
    )


def test_positions_alone_step_in_velocity() -> None:
    rows = motion(period=0.1, rows=21, columns="q")
    found = judged(rows, "ros-jtc").findings
    assert {(each.rule, each.severity, each.kind) for each in found} == {
        ("jtc-positions-only", "warning", "jump")
    }
    assert len(found) == 7
    # the largest second difference of the rows, those before and behind at rest
    at_rest = np.concatenate([rows.q[:1], rows.q, rows.q[-1:]])
    steps = np.diff(at_rest, 2, axis=0) / 0.1
    for joint, breach in enumerate(sorted(found, key=lambda each: each.joint or "")):
        row = int(np.abs(steps[:, joint]).argmax())
        assert abs(breach.value) == pytest.approx(abs(steps[row, joint]), rel=1e-9)
        assert (abs(breach.time - rows.t[row]) < 1e-9) or abs(steps[breach.row - 1, joint]) == pytest.approx(
            abs(steps[row, joint]), rel=1e-9
        )


def test_a_first_point_at_zero_is_jumped_to() -> None:
    for profile, rule in (
        ("ros-jtc", "jtc-first-point"),
        ("franka-fr3", "fr3-start"),
        ("franka-fer", "fer-start"),
        ("ur-passthrough", "passthrough-first-point"),
    ):
        rows = CLEAN[profile]
        count = rows.q.shape[1]
        stands = HOME[count].copy()
        stands[1] += 0.01
        breach = only(judged(rows, profile, Surroundings(rows.joints, stands)))
        assert (breach.rule, breach.kind, breach.severity, breach.joint, breach.row) == (
            rule,
            "start",
            "warning",
            "joint_2",
            1,
        )
        assert breach.value == pytest.approx(-0.01)
        unknown = judged(rows, profile, Surroundings(rows.joints))
        assert [name for name, _ in unknown.unjudged if name == rule] == [rule]


@pytest.mark.parametrize("columns", ["q", "q,qd", "q,qd,qdd"])
def test_a_later_first_point_is_reached_by_a_spline(columns: str) -> None:
    """Rest to rest over T: peaks of the polynomial are D/T, 3/2 D/T and 15/8 D/T."""
    rows = motion(period=0.1, rows=21, columns=columns)
    later = replace(rows, t=rows.t + 0.5)
    stands = HOME[7].copy()
    stands[2] -= 0.2
    peak = {"q": 1.0, "q,qd": 1.5, "q,qd,qdd": 15 / 8}[columns] * 0.2 / 0.5
    free = np.tile([-np.inf, np.inf], (7, 1))
    for limit, broken in ((peak * 0.999, True), (peak * 1.001, False)):
        limits = Limits(free, np.tile([-limit, limit], (7, 1)), free, free)
        found = judged(later, "ros-jtc", Surroundings(rows.joints, stands, limits)).findings
        found = tuple(each for each in found if each.rule == "jtc-first-point")
        assert bool(found) == broken
        if broken:
            assert (found[0].kind, found[0].joint, found[0].severity) == ("velocity", "joint_3", "warning")
            assert found[0].value == pytest.approx(peak, rel=1e-9)


# --- differences at the period of a controller ---

LIMITS = {
    "franka-fr3": ([2.62] * 4 + [5.26, 4.18, 5.26], [10.0] * 7, [5000.0] * 7),
    "franka-fer": (
        [2.175] * 4 + [2.61] * 3,
        [15, 7.5, 10, 12.5, 15, 20, 20],
        [7500, 3750, 5000, 6250, 7500, 10000, 10000],
    ),
}


@pytest.mark.parametrize("profile", LIMITS)
@pytest.mark.parametrize("joint", [0, 3, 6])
def test_a_bump_of_one_row_is_jerk(profile: str, joint: int) -> None:
    """One row that is b off has third differences of b (1, -3, 3, -1): 3 b / h^3 is the worst."""
    rows = motion()
    limit = LIMITS[profile][2][joint]
    quiet = float(np.abs(np.diff(rows.q[:, joint], 3)).max())
    bump = (1.0001 * (limit - 1e-3) * 1e-9 + quiet) / 3
    breach = only(judged(with_value(rows, "q", 500, joint, bump), profile))
    assert (breach.rule.split("-", 1)[1], breach.kind, breach.method) == ("jerk", "jerk", "differences")
    assert breach.joint == f"joint_{joint + 1}"
    assert breach.row in (502, 503)
    assert abs(breach.value) > limit - 1e-3
    assert judged(with_value(rows, "q", 500, joint, 0.9 * (limit * 1e-9 - quiet) / 3), profile).findings == ()


def ramp(profile: str, joint: int, order: int, share: float) -> RecordedMotion:
    """Return rows from rest to rest whose largest velocity, or acceleration, is a share of the limit.

    The acceleration is a smooth bump up and one down, so that the jerk stays small.
    """
    limit = LIMITS[profile][order - 1][joint] - 1e-3
    h, duration = 1e-3, 2.0
    count = round(duration / h)
    u = np.arange(count + 1) / count
    shape = quintic(u)[0]
    # differences of a curve, so that the largest difference is known exactly: scale the rows themselves
    largest = np.abs(np.diff(shape, order)).max() / h**order
    change = share * limit / largest
    base = motion(rows=count + 1, decimals=None)
    q = np.tile(HOME[7], (count + 1, 1))
    q[:, joint] += change * (shape - 0.5 if joint == 0 else shape)
    zeros = np.zeros_like(q)
    return replace(base, q=q, qd=zeros, qdd=zeros)


@pytest.mark.parametrize("order", [1, 2])
def test_differences_of_velocity_and_acceleration(order: int) -> None:
    kind = ("", "velocity", "acceleration")[order]
    for share, broken in ((1.0001, True), (0.9999, False)):
        rows = ramp("franka-fr3", 0, order, share)
        if order == 2:
            # with 10 rad/s^2 a quintic of 2 s would be far too fast: shorten it instead
            rows = short(share)
        found = judged(rows, "franka-fr3", Surroundings(rows.joints, rows.q[0])).findings
        assert [(each.rule, each.kind) for each in found if each.kind == kind] == (
            [(f"fr3-{kind}", kind)] if broken else []
        )
        if broken:
            value = np.abs(np.diff(rows.q[:, 0], order) / 1e-3**order).max()
            breach = next(each for each in found if each.kind == kind)
            assert abs(breach.value) == pytest.approx(value, rel=1e-12)
            assert breach.factor == pytest.approx((value / (breach.limit**2) ** 0.5) ** (1 / order), rel=1e-9)


def short(share: float) -> RecordedMotion:
    """Return a quintic of 0.2 s with a share of 9.999 rad/s^2 as its largest second difference."""
    h, count = 1e-3, 400
    shape = quintic(np.arange(count + 1) / count)[0]
    change = share * (10.0 - 1e-3) / (np.abs(np.diff(shape, 2)).max() / h**2)
    base = motion(rows=count + 1, decimals=None)
    q = np.tile(HOME[7], (count + 1, 1))
    q[:, 0] += change * shape
    return replace(base, q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))


def test_six_decimals_make_jerk_that_is_real_to_the_robot() -> None:
    """Third differences of rounded positions: at most 8 half units of 1e-6 over 1 ms are 4000 rad/s^3."""
    rows = motion(decimals=6, columns="q")
    found = {each.rule: each for each in judged(rows, "franka-fr3").findings}
    decimals = found["fr3-decimals"]
    assert (decimals.kind, decimals.severity) == ("quantisation", "warning")
    assert decimals.value == pytest.approx(4000)
    noisy = np.abs(np.diff(rows.q, 3, axis=0)).max() / 1e-9
    exact = np.abs(np.diff(motion(decimals=None).q, 3, axis=0)).max() / 1e-9
    assert exact < 400 < 2000 < noisy
    # what the robot sees is what is judged, to the last bit
    assert ("fr3-jerk" in found) == (noisy > 5000 - 1e-3)
    coarse = motion(decimals=5, columns="q")
    jerk = next(each for each in judged(coarse, "franka-fr3").findings if each.rule == "fr3-jerk")
    assert "decimals" in jerk.message
    assert jerk.factor is None
    assert judged(motion(decimals=9, columns="q"), "franka-fr3").findings == ()


def test_velocity_by_position() -> None:
    """At 0.1 rad before the end joint 1 may move with sqrt(2 6 0.1) - 0.3 = 0.795 rad/s, less 1e-3."""
    rows = motion(rows=2001, decimals=None)
    upper = 2.7501
    for offset, broken in ((-1e-4, True), (1e-4, False)):
        q = np.tile(HOME[7], (2001, 1))
        allowed = np.sqrt(2 * 6 * 0.1) - 0.3 - 1e-3 - offset
        # a quintic whose largest velocity, in its middle, is where 0.1 rad are left
        shape = quintic(rows.t / 2.0)[0]
        change = allowed / (np.abs(np.diff(shape)).max() / 1e-3)
        fastest = int(np.abs(np.diff(shape)).argmax())
        q[:, 0] = upper - 0.1 + change * (shape - shape[fastest])
        moved = replace(rows, q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))
        inside = np.abs(np.diff(q[:, 0]) / 1e-3) <= np.maximum(
            np.sqrt(12 * np.maximum(upper - q[:-1, 0], 0)) - 0.3 - 1e-3, 0
        )
        found = [
            each
            for each in judged(moved, "franka-fr3", Surroundings(rows.joints, q[0])).findings
            if each.rule == "fr3-velocity-by-position"
        ]
        assert bool(found) == (not inside.all())
        assert bool(found) or not broken
        if found:
            assert (found[0].kind, found[0].joint) == ("velocity_by_position", "joint_1")
            assert found[0].count == int((~inside).sum())


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("faster", "broken"), [(-1e-9, False), (0.0, False), (5e-9, True)])
def test_a_joint_that_is_just_as_fast_as_the_end_of_its_range_allows(
    faster: float, side: float, *, broken: bool
) -> None:
    """Each step is sqrt(12 x) - 0.3 - 1e-3 times a millisecond: rounding of positions is some 1e-13 of that."""
    rows, upper = motion(rows=21, decimals=None), 2.7501
    q = np.tile(HOME[7], (21, 1))
    q[0, 0] = upper - 0.1
    for k in range(20):
        q[k + 1, 0] = q[k, 0] + 1e-3 * (np.sqrt(12 * (upper - q[k, 0])) - 0.3 - 1e-3) * (1 + faster)
    q[:, 0] *= side
    moved = replace(rows, q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))
    found = judged(moved, "franka-fr3", Surroundings(rows.joints, q[0])).findings
    assert ("fr3-velocity-by-position" in {each.rule for each in found}) == broken


def test_a_joint_may_not_move_within_its_dead_zone() -> None:
    """o^2 / (2 d) = 7.5 mrad before its limit joint 1 may only leave."""
    rows = motion(rows=501, decimals=None)
    shape = quintic(rows.t / 0.5)[0]
    for towards in (True, False):
        q = np.tile(HOME[7], (501, 1))
        q[:, 0] = 2.7501 - 0.007 + 0.001 * (shape if towards else -shape)
        moved = replace(rows, q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))
        found = judged(moved, "franka-fr3", Surroundings(rows.joints, q[0])).findings
        assert ["fr3-velocity-by-position"] * towards == [each.rule for each in found]
        if towards:
            assert found[0].limit == 0
            assert found[0].factor is None


@pytest.mark.parametrize("profile", LIMITS)
def test_a_position_out_of_range(profile: str) -> None:
    ends = {"franka-fr3": 1.7918, "franka-fer": 1.7628}
    shift = np.zeros(7)
    shift[1] = ends[profile] + 1e-6 - (HOME[7] + CHANGE[7])[1]
    rows = motion()
    moved = replace(rows, q=rows.q + shift)
    found = judged(moved, profile, Surroundings(rows.joints, moved.q[0])).findings
    breach = next(each for each in found if each.rule.endswith("-position") and each.kind == "position")
    assert (breach.joint, breach.severity, breach.limit, breach.row) == (
        "joint_2",
        "error",
        ends[profile],
        1001,
    )


def test_room_for_lost_packets() -> None:
    """libfranka takes 3 ms of the largest acceleration off: 2.175 - 1e-3 - 3e-3 (15 - 1e-3) for joint 1."""
    allowed = 2.175 - 1e-3 - 3e-3 * (15 - 1e-3)
    rows = ramp("franka-fer", 0, 1, (allowed + 1e-4) / (2.175 - 1e-3))
    found = judged(rows, "franka-fer", Surroundings(rows.joints, rows.q[0])).findings
    assert [(each.rule, each.severity) for each in found if each.kind == "velocity"] == [
        ("fer-lost-packets", "warning")
    ]
    rows = ramp("franka-fer", 0, 1, (allowed - 1e-4) / (2.175 - 1e-3))
    found = judged(rows, "franka-fer", Surroundings(rows.joints, rows.q[0])).findings
    assert [each for each in found if each.kind == "velocity"] == []


@pytest.mark.parametrize("profile", LIMITS)
@pytest.mark.parametrize(
    ("name", "row", "at"), [("qd", 0, "start"), ("qdd", 0, "start"), ("qd", -1, "end"), ("qdd", -1, "end")]
)
def test_rest_at_both_ends(profile: str, name: str, row: int, at: str) -> None:
    rows = with_value(motion(), name, row, 4, 0.02)
    breach = only(judged(rows, profile))
    assert (breach.rule.split("-", 1)[1], breach.kind, breach.severity, breach.joint) == (
        f"rest-{at}",
        at,
        "warning",
        "joint_5",
    )
    assert breach.row == (1 if at == "start" else 1001)
    assert f" 0.02 {'rad/s' if name == 'qd' else 'rad/s^2'}," in breach.message


def test_rest_without_columns_is_seen_in_differences() -> None:
    rows = motion(rows=1001, columns="q", decimals=None)
    cut = replace(rows, t=rows.t[:900], q=rows.q[:900])
    found = judged(cut, "franka-fr3").findings
    assert {each.rule for each in found} == {"fr3-rest-end"}
    assert {each.method for each in found} == {"differences"}


def test_torques_and_their_rate() -> None:
    for profile in LIMITS:
        prefix = profile.split("-")[1]
        tau = np.zeros((1001, 7))
        tau[:, 4] = 11.9
        rows = replace(motion(), tau=tau)
        assert judged(rows, profile).findings == ()
        tau[:, 4] = 12.1
        breach = only(judged(rows, profile))
        assert (breach.rule, breach.kind, breach.severity, breach.count) == (
            f"{prefix}-torque",
            "effort",
            "warning",
            1001,
        )
        tau[:, 4] = 10.0
        tau[700:, 4] += 1.1
        breach = only(judged(rows, profile))
        assert (breach.rule, breach.row, breach.value) == (f"{prefix}-torque-rate", 701, pytest.approx(1100))


def test_efforts_that_a_file_does_not_have_are_not_judged() -> None:
    verdict = judged(motion(), "franka-fr3")
    assert dict(verdict.unjudged) == {
        "fr3-torque": "the file has no efforts",
        "fr3-torque-rate": "the file has no efforts",
    }


def test_rows_at_another_rate_are_not_taken_for_differences() -> None:
    verdict = judged(motion(period=0.01, rows=101), "franka-fr3")
    assert {each.rule for each in verdict.findings} == {"fr3-period"}
    assert dict(verdict.unjudged)["fr3-jerk"].startswith("most of its rows are not 0.001 s apart")


# --- Universal Robots ---


@pytest.mark.parametrize(
    ("speed", "rules"), [(6.29, ["servoj-speed"]), (20.01, ["servoj-step", "servoj-speed"]), (6.28, [])]
)
def test_speeds_of_servoj(speed: float, rules: list[str]) -> None:
    rows = CLEAN["ur-servoj"]
    own = float(rows.q[251, 2] - rows.q[250, 2])
    q = rows.q.copy()
    q[251:, 2] += speed * 2e-3 - own
    found = judged(replace(rows, q=q), "ur-servoj").findings
    assert [each.rule for each in found] == rules
    for breach in found:
        assert (breach.severity, breach.row, breach.joint, breach.count) == ("error", 252, "joint_3", 1)
        assert breach.value == pytest.approx(speed)


def test_numbers_beyond_int32() -> None:
    for name, kind in (("q", "position"), ("qd", "velocity"), ("qdd", "acceleration")):
        own = getattr(CLEAN["ur-passthrough"], name)[10, 1]
        rows = with_value(CLEAN["ur-passthrough"], name, 10, 1, 2147.484 - own)
        found = [each for each in judged(rows, "ur-passthrough").findings if each.rule == "passthrough-range"]
        assert [(each.kind, each.row, each.joint, each.severity) for each in found] == [
            (kind, 11, "joint_2", "error")
        ]
        assert found[0].limit == pytest.approx(2147.483647, rel=1e-12)


def test_rounded_durations_move_the_curve() -> None:
    """Each duration of 1.4 us is sent as 1 us: after k points all come 0.4 k us early."""
    rows = motion(6, 0.1, 21, decimals=6)
    clean = judged(replace(rows, t=np.round(rows.t, 6)), "ur-passthrough")
    assert clean.findings == ()
    count = 2001
    t = np.arange(count) * 1.0004e-3
    base = motion(6, 1.0004e-3, count, decimals=None)
    late = -np.arange(count) * 4e-7
    off = np.abs(base.qd * late[:, None])
    found = [
        each
        for each in judged(replace(base, t=t), "ur-passthrough").findings
        if each.rule == "passthrough-quantisation"
    ]
    assert {each.joint for each in found} == {f"joint_{k + 1}" for k in range(6) if off[:, k].max() > 1.05e-5}
    for breach in found:
        joint = int((breach.joint or "")[-1]) - 1
        assert breach.value == pytest.approx(off[:, joint].max(), abs=1e-6)  # and half a unit
        assert (breach.severity, breach.kind) == ("warning", "quantisation")


def test_durations_below_a_millisecond_move_positions_alone_as_well() -> None:
    """Each of 500.4 us is sent as 500 us: after k points all come 0.4 k us early."""
    base = motion(6, 5.004e-4, 2001, decimals=None, columns="q")
    early = np.arange(2001) * 4e-7
    speeds = np.abs(np.diff(base.q, axis=0, prepend=base.q[:1])) / 5.004e-4
    found = judge_by_profile([base], load_profile("ur-passthrough"), surroundings(6)).findings
    told = {each.joint: each.value for each in found if each.rule == "passthrough-quantisation"}
    largest = (speeds * early[:, None]).max(axis=0)
    assert len(told) == 6
    assert list(told.values()) == pytest.approx([largest[int(joint[-1]) - 1] for joint in told], abs=6e-7)


def test_breaches_are_counted_by_move() -> None:
    rows = motion(6, 2e-3, 501)
    q = rows.q.copy()
    q[100:, 2] += 0.02
    q[300:, 2] += 0.05
    q[310:, 2] += 0.03
    move = np.repeat([0, 1, 2], [150, 155, 196]).astype(np.int64)
    found = judged(replace(rows, q=q, move=move), "ur-servoj").findings
    speeds = [each for each in found if each.rule == "servoj-speed"]
    assert [(each.move, each.row, each.count) for each in speeds] == [(0, 101, 1), (1, 301, 1), (2, 311, 1)]


def test_a_straight_motion_steps_at_both_ends() -> None:
    """From rest to a constant velocity and back: all of it at the first and at the last row."""
    rows = motion(period=0.1, rows=11, columns="q")
    q = HOME[7] + np.outer(np.arange(11) * 0.1, [0.0, 0.3, 0, 0, 0, 0, 0])
    found = judged(replace(rows, q=q), "ros-jtc").findings
    assert [(each.joint, each.row, each.value, each.count) for each in found] == [
        ("joint_2", 1, pytest.approx(0.3), 2)
    ]
    stopping = replace(rows, q=np.concatenate([q[:1], q[:1], q[:-2]]))  # it starts later, and ends in motion
    found = judged(stopping, "ros-jtc").findings
    assert [(each.row, each.count) for each in found] == [(3, 2)]
    faster = q.copy()
    faster[-1, 1] += 0.06
    found = judged(replace(rows, q=faster), "ros-jtc").findings
    assert [(each.row, each.value) for each in found] == [(11, pytest.approx(-0.9))]


def test_the_approach_begins_where_the_arm_stands() -> None:
    """A cubic from rest that arrives in motion backwards overshoots its point, here beyond the range.

    From 0 with velocity 0 to d with velocity -w over T: q = (3 d + w T) u^2 - (2 d + w T) u^3.
    """
    rows = motion(period=0.1, rows=21, columns="q,qd")
    assert rows.qd is not None
    qd = rows.qd.copy()
    qd[0, 2] = -1.0
    later = replace(rows, t=rows.t + 0.5, qd=qd)
    stands = HOME[7].copy()
    stands[2] -= 0.2
    a, b = 3 * 0.2 + 0.5, 2 * 0.2 + 0.5
    peak = stands[2] + 4 * a**3 / (27 * b**2)  # at u = 2 a / (3 b)
    free = np.tile([-np.inf, np.inf], (7, 1))
    for upper, broken in ((peak - 1e-6, True), (peak + 1e-6, False)):
        position = free.copy()
        position[2, 1] = upper
        found = judged(
            later, "ros-jtc", Surroundings(rows.joints, stands, Limits(position, free, free, free))
        )
        own = [each for each in found.findings if each.rule == "jtc-first-point"]
        assert [(each.kind, each.joint) for each in own] == [("position", "joint_3")] * broken
        if broken:
            assert own[0].value == pytest.approx(peak, rel=1e-9)
