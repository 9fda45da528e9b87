"""Rules of consumers for every joint, direction and derivative, and at the numbers where they begin to be broken."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import HOME, judged, motion, surroundings, with_value
from scipy.interpolate import BPoly

from trajcli.consumers.executed import approach_excesses
from trajcli.consumers.judgement import judge_by_profile, load_profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.findings import Finding
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion

SIDES = pytest.mark.parametrize("side", [-1.0, 1.0])
STILL = np.tile(HOME[7], (21, 1))
FRANKA = replace(motion(rows=21), q=STILL, qd=np.zeros_like(STILL), qdd=np.zeros_like(STILL))


def found(rows: RecordedMotion, profile: str, rule: str) -> list[Finding]:
    """Return what breaks one rule; the arm stands where the rows begin."""
    around = Surroundings(rows.joints, rows.q[0])
    every = judge_by_profile([rows], load_profile(profile), around).findings
    return [each for each in every if each.rule == rule]


@SIDES
@pytest.mark.parametrize("name", ["q", "qd", "qdd"])
def test_numbers_beyond_int32_in_either_direction(name: str, side: float) -> None:
    rows = motion(6, 0.1, 21)
    own = getattr(rows, name)[10, 1]
    for beyond in (2147.4837, 2147.4836):
        planted = with_value(rows, name, 10, 1, side * beyond - own)
        broken = found(planted, "ur-passthrough", "passthrough-range")
        assert [(each.value, each.limit) for each in broken] == (
            [(pytest.approx(side * beyond), side * 2147.483647)] if beyond > 2147.48365 else []
        )


@SIDES
def test_of_numbers_beyond_int32_the_largest_is_told_in_whichever_direction(side: float) -> None:
    """Accelerations are judged where there are no velocities, too."""
    rows = motion(6, 0.1, 21, columns="q,qdd")
    assert rows.qdd is not None
    qdd = rows.qdd.copy()
    qdd[7, 3], qdd[12, 3] = -side * 3000.0, side * 2500.0
    (told,) = found(replace(rows, qdd=qdd), "ur-passthrough", "passthrough-range")
    assert (told.kind, told.joint, told.row, told.value) == ("acceleration", "joint_4", 8, -side * 3000.0)
    assert (told.limit, told.count) == (-side * 2147.483647, 2)


@SIDES
@pytest.mark.parametrize("comes", ["early", "late"])
@pytest.mark.parametrize(("speed", "broken"), [(24.0, False), (26.0, True)])
def test_what_stamps_make_of_points_without_velocities_is_that_of_straight_lines(
    speed: float, side: float, comes: str, *, broken: bool
) -> None:
    """All points but the first come 0.4 us early or late, one at 24 or 26 rad/s: 9.6e-6 or 10.4e-6 of 1e-5."""
    rows = motion(6, 0.1, 21, columns="q")
    t = 0.1 * np.arange(21)
    t[1:] += 4e-7 if comes == "early" else -4e-7
    q = np.zeros((21, 6))
    q[1:, 2] = side * 0.1 * np.cumsum(np.where(np.arange(20) == 13, speed, 5.0))
    told = judged(replace(rows, t=t, q=q), "ur-passthrough", Surroundings(rows.joints, q[0])).findings
    off = [each for each in told if each.rule == "passthrough-quantisation"]
    assert [(each.joint, each.row, each.count) for each in off] == [("joint_3", 15, 1)] * broken
    assert [each.value for each in off] == [pytest.approx(speed * 4e-7)] * broken
    assert all(f"comes 4e-07 s {comes}, and joint_3 is" in each.message for each in off)


@SIDES
@pytest.mark.parametrize("first", [0.0, 12.5])
@pytest.mark.parametrize(("beside", "broken"), [(0.4e-6, True), (0.1e-6, False)])
def test_rounding_of_positions_adds_to_what_stamps_make(
    beside: float, broken: bool, first: float, side: float
) -> None:
    """All points come 0.4 us early, at 24.5 rad/s: 9.8e-6 of 1e-5; whenever the stamps begin."""
    rows = motion(6, 0.1, 21)
    q, qd = np.tile(HOME[6], (21, 1)), np.zeros((21, 6))
    q[:, 1], qd[1:, 1] = 1.0 + side * beside, 24.5
    t = first + 0.1 * np.arange(21) + np.where(np.arange(21) > 0, 4e-7, 0.0)
    planted = replace(rows, t=t, q=q, qd=qd, qdd=np.zeros_like(q))
    assert bool(found(planted, "ur-passthrough", "passthrough-quantisation")) == broken


PEAKS = {"position": (1.0, 0), "velocity": (15 / 8, 1), "acceleration": (10 / 3**0.5, 2), "jerk": (60.0, 3)}
"""Of a quintic from rest to rest over a distance 1 in a time 1, and the order (Biagiotti, section 2.1)."""


@SIDES
@pytest.mark.parametrize("joint", [0, 6])
@pytest.mark.parametrize("kind", PEAKS)
def test_the_approach_keeps_each_limit_of_each_joint(kind: str, joint: int, side: float) -> None:
    """From 0.2 rad beside the first point in half a second; the other direction has more of it."""
    rows = motion(period=0.1, rows=21)
    factor, order = PEAKS[kind]
    later, stands = replace(rows, t=rows.t + 0.5), HOME[7].copy()
    stands[joint] -= side * 0.2
    peak = factor * 0.2 / 0.5**order + (0.0 if order else side * stands[joint])
    for share, broken in ((-1e-6, True), (1e-6, False)):
        bounds = [np.tile([-np.inf, np.inf], (7, 1)) for _ in range(4)]
        bounds[order][joint] = [-9e3, peak + share] if side > 0 else [-peak - share, 9e3]
        around = Surroundings(rows.joints, stands, Limits(*bounds))
        every = judge_by_profile([later], load_profile("ros-jtc"), around).findings
        over = [(each.kind, each.joint) for each in every if each.rule == "jtc-first-point"]
        assert over == ([(kind, f"joint_{joint + 1}")] if broken else [])


@pytest.mark.parametrize("worse", [1, 2])
def test_of_several_limits_that_the_approach_breaks_the_worst_is_named(worse: int) -> None:
    """As above by a tenth, and one of the two by half."""
    rows, stands = motion(period=0.1, rows=21), HOME[7].copy()
    stands[2] -= 0.2
    bounds = [np.tile([-np.inf, np.inf], (7, 1)) for _ in range(4)]
    for kind in ("velocity", "acceleration"):
        factor, order = PEAKS[kind]
        bounds[order][2, 1] = factor * 0.2 / 0.5**order / (1.5 if order == worse else 1.1)
    around = Surroundings(rows.joints, stands, Limits(*bounds))
    every = judge_by_profile([replace(rows, t=rows.t + 0.5)], load_profile("ros-jtc"), around).findings
    (one,) = [each for each in every if each.rule == "jtc-first-point"]
    assert (one.kind, one.count) == (["velocity", "acceleration"][worse - 1], 2)
    assert one.factor is None or one.value / one.limit == pytest.approx(1.5)


@SIDES
def test_a_joint_that_rests_in_its_dead_zone_is_no_fault(side: float) -> None:
    q = STILL.copy()
    q[:, 0] = side * (2.7501 - 1e-3)
    assert found(replace(FRANKA, q=q), "franka-fr3", "fr3-velocity-by-position") == []
    q[1::2, 0] = np.nextafter(q[1::2, 0], side * 9.0)  # what rounding makes of a number is no motion
    assert found(replace(FRANKA, q=q), "franka-fr3", "fr3-velocity-by-position") == []
    q[1::2, 0] += side * 2e-14
    assert found(replace(FRANKA, q=q), "franka-fr3", "fr3-velocity-by-position") != []


@SIDES
def test_the_distance_from_either_end_is_told(side: float) -> None:
    q = STILL.copy()
    q[:, 0] = side * (2.7501 - 0.1)
    q[10:, 0] += side * 1e-3
    (one,) = found(replace(FRANKA, q=q), "franka-fr3", "fr3-velocity-by-position")
    assert ", 0.1 rad before the end of its range" in one.message
    allowed = np.sqrt(2 * 6 * 0.1) - 0.3 - 1e-3
    assert [one.value, one.limit] == pytest.approx([side, side * allowed], rel=1e-6)
    assert one.factor == pytest.approx(1 / allowed, rel=1e-6)


def pushed(share: float, side: float, period: float = 1e-3) -> RecordedMotion:
    q = STILL.copy()
    q[:, 3] += side * share * (2.62 - 1e-3) * 1e-3 * np.arange(21)
    return replace(FRANKA, t=period * np.arange(21), q=q)


@SIDES
@pytest.mark.parametrize(("beyond", "broken"), [(0.0, False), (3e-9, True)])
def test_a_speed_just_at_its_limit_is_no_fault(beyond: float, broken: bool, side: float) -> None:
    """Differences of positions near 2 rad are rounded by up to 4e-13 rad/s."""
    over = found(pushed(1 + beyond, side), "franka-fr3", "fr3-velocity")
    assert bool(over) == broken
    assert all("decimals" not in each.message for each in over)


@pytest.mark.parametrize(("period", "taken"), [(1.009e-3, True), (1.02e-3, False), (0.98e-3, False)])
def test_rows_a_hundredth_beside_the_period_are_at_it(period: float, taken: bool) -> None:
    assert bool(found(pushed(1.1, 1.0, period), "franka-fr3", "fr3-velocity")) == taken


def test_rules_about_seven_joints_are_not_judged_for_six() -> None:
    rows = replace(motion(6), tau=np.zeros((1001, 6)))
    unjudged = dict(judged(rows, "franka-fer").unjudged)
    profile = load_profile("franka-fer")
    of_seven = [
        rule.id for rule in profile.rules if any(np.size(each) == 7 for each in rule.parameters.values())
    ]
    assert len(of_seven) > 5
    assert {name: unjudged.get(name) for name in of_seven} == dict.fromkeys(
        of_seven, "it is about 7 joints, and there are 6"
    )


@pytest.mark.parametrize("count", [6, 7, 8])
def test_changes_of_effort_are_judged_where_there_are_as_many_joints(count: int) -> None:
    """Of a consumer that has a limit for each of seven; efforts jump in each row."""
    franka = load_profile("franka-fr3")
    (rule,) = (each for each in franka.rules if each.check == "effort_rate")
    limits = {**rule.parameters, "limit": [1000.0] * 6 + [1e9]}
    alone = replace(franka, rules=(replace(rule, parameters=limits),))
    q = np.zeros((21, count))
    tau = np.where(np.arange(21)[:, None] % 2, 50.0, -50.0) * np.ones(count)
    rows = replace(FRANKA, q=q, qd=q, qdd=q, tau=tau, joints=tuple(f"j{k}" for k in range(count)))
    rows = replace(rows, resolution=replace(FRANKA.resolution, **dict.fromkeys(("q", "qd", "qdd"), q[0])))
    judgement = judge_by_profile([rows], alone, Surroundings(rows.joints))
    assert {each.joint for each in judgement.findings} == (
        {f"j{k}" for k in range(6)} if count == 7 else set()
    )
    unjudged = {} if count == 7 else {rule.id: f"it is about 7 joints, and there are {count}"}
    assert dict(judgement.unjudged) == unjudged


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("profile", ["franka-fr3", "ros-jtc", "ur-servoj", "ur-passthrough"])
def test_a_few_rows_at_rest_are_at_rest(profile: str, count: int) -> None:
    joints = 6 if profile.startswith("ur") else 7
    period = {"franka-fr3": 1e-3, "ur-servoj": 2e-3}.get(profile, 0.1)
    rows = motion(joints, period, max(count, 2), columns="q")
    rows = replace(rows, t=rows.t[:count], q=np.tile(HOME[joints], (count, 1)))
    around = Surroundings(rows.joints, HOME[joints])
    assert judge_by_profile([rows], load_profile(profile), around).findings == ()


@pytest.mark.parametrize("row", [5, 6, 7, 8])
def test_the_largest_step_of_velocity_has_its_row_in_blocks_too(row: int) -> None:
    """Straight lines: slow until a row, five times as fast behind it, and slow to the end."""
    rows = motion(period=0.1, rows=21, columns="q")
    speed = np.where(np.arange(20) < row, 0.02, 0.1) - 0.004 * np.maximum(np.arange(20) - row, 0)
    q = np.tile(HOME[7], (21, 1))
    q[1:, 4] += np.cumsum(0.1 * speed)
    (one,) = judged(replace(rows, q=q), "ros-jtc").findings
    assert (one.joint, one.row) == ("joint_5", row + 1)
    assert one.value == pytest.approx(0.08)


@pytest.mark.parametrize("profile", ["franka-fr3", "franka-fer"])
def test_where_rows_are_jumped_to_the_time_of_the_first_one_is_no_matter(profile: str) -> None:
    around = Surroundings(
        FRANKA.joints, STILL[0] + 0.01 * np.eye(7)[4], Limits(*[np.tile([-9.0, 9.0], (7, 1))] * 4)
    )
    for begins in (0.0, 2.0):
        every = judge_by_profile(
            [replace(FRANKA, t=FRANKA.t + begins)], load_profile(profile), around
        ).findings
        (one,) = [each for each in every if each.rule.endswith("-start")]
        assert (one.kind, one.joint, one.value) == ("start", "joint_5", pytest.approx(-0.01))


@SIDES
@pytest.mark.parametrize("begins", [100.0, -100.02])
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.2, True)])
def test_stamps_of_few_digits_are_as_rough_as_they_are_large(
    share: float, broken: bool, begins: float, side: float
) -> None:
    """At 100 s, or as long before an event, a ten millionth of it, of both stamps of an interval."""
    rough = replace(FRANKA.resolution, relative_time=1e-7)
    t = begins + FRANKA.t
    t[10:] += side * share * 2 * 1e-7 * 100.0
    assert bool(found(replace(FRANKA, t=t, resolution=rough), "franka-fr3", "fr3-period")) == broken


@pytest.mark.parametrize(("off", "broken"), [(0.0, False), (1e-5, True)])
def test_stamps_since_1970_are_as_rough_as_float64_is_there(off: float, broken: bool) -> None:
    """A quarter of a microsecond stands between two of them."""
    t = 1.7e9 + FRANKA.t
    t[10:] += off
    assert bool(found(replace(FRANKA, t=t), "franka-fr3", "fr3-period")) == broken


@pytest.mark.parametrize(("first", "step", "broken"), [(0.6, 0.8, True), (0.4, 0.2, False)])
def test_stamps_are_counted_in_whole_nanoseconds_and_not_their_differences(
    first: float, step: float, broken: bool
) -> None:
    """0.6 and 1.4 ns are both 1; 0.4 and 0.6 are 0 and 1."""
    rows = motion(period=0.1, rows=21)
    t = rows.t.copy()
    t[7] += first * 1e-9
    t[8] = t[7] + step * 1e-9
    assert bool(found(replace(rows, t=t), "ros-jtc", "jtc-increasing-times")) == broken


@SIDES
@pytest.mark.parametrize(("beyond", "broken"), [(0.0, False), (5e-9, True)])
def test_a_torque_just_at_its_limit_is_no_fault(beyond: float, broken: bool, side: float) -> None:
    tau = np.zeros((21, 7))
    tau[:, 4] = side * 12.0 * (1 + beyond)
    over = found(replace(FRANKA, tau=tau), "franka-fr3", "fr3-torque")
    assert [(each.joint, each.value, each.limit) for each in over] == (
        [("joint_5", tau[0, 4], side * 12.0)] if broken else []
    )


@pytest.mark.parametrize(("value", "end"), [(-0.1, -0.1458), (-3.1, -3.0481)])
def test_a_range_on_one_side_of_zero_has_two_ends(value: float, end: float) -> None:
    q = STILL.copy()
    q[:, 3] = value
    (one,) = found(replace(FRANKA, q=q), "franka-fr3", "fr3-position")
    assert (one.joint, one.value, one.limit, one.count) == ("joint_4", value, end, 21)


@SIDES
@pytest.mark.parametrize(("units", "broken"), [(1, False), (3, True)])
def test_a_unit_of_the_last_decimal_is_no_motion(units: int, broken: bool, side: float) -> None:
    """It may be there by rounding: a millionth in a millisecond, of which rest leaves 5000 / 6 millionths."""
    rows = motion(rows=21, columns="q", decimals=6)
    q = STILL.copy()
    q[-1, 3] += side * units * 1e-6
    assert bool(found(replace(rows, q=q), "franka-fr3", "fr3-rest-end")) == broken


@pytest.mark.parametrize(("off", "noted"), [(0.5e-9, False), (5e-9, True)])
def test_a_thousandth_of_a_unit_is_no_part_of_a_duration(off: float, noted: bool) -> None:
    rows = motion(6, 0.1, 21)
    t = rows.t.copy()
    t[10:] += off
    assert bool(found(replace(rows, t=t), "ur-passthrough", "passthrough-whole-microseconds")) == noted


@pytest.mark.parametrize("name", ["franka-fr3", "ros-jtc", "ur-servoj", "ur-passthrough"])
def test_every_rule_of_a_profile_is_judged_alone_as_among_the_others(name: str) -> None:
    """The last one, too: rows in which all that can be wrong is wrong somewhere."""
    joints = 6 if name.startswith("ur") else 7
    rows = motion(joints, 0.0123, 41)
    rng = np.random.default_rng(1)
    wrong = replace(
        rows,
        t=np.round(rows.t * 3e4, 3) % 7e3,
        q=rows.q + rng.normal(size=rows.q.shape) * 900,
        qd=rng.normal(size=rows.q.shape) * 3e3,
        tau=rng.normal(size=rows.q.shape) * 900,
    )
    profile, around = load_profile(name), Surroundings(rows.joints, rows.q[0] + 1.0)
    every = {each.rule for each in judge_by_profile([wrong], profile, around).findings}
    for rule in profile.rules:
        alone = judge_by_profile([wrong], replace(profile, rules=(rule,)), around)
        assert {each.rule for each in alone.findings} == {rule.id} & every
    assert every


@pytest.mark.parametrize(("share", "broken"), [(0.99, False), (1.01, True)])
@pytest.mark.parametrize("joint", [0, 6])
def test_decimals_that_make_more_jerk_than_a_share_of_its_limit_are_too_few(
    joint: int, share: float, broken: bool
) -> None:
    """Third differences of positions that are off by h are off by 8 h over 1e-9 s^3; 25 rad/s^3 are allowed."""
    half = np.zeros(7)
    half[joint] = share * 25.0 * 1e-9 / 8.0
    rough = replace(FRANKA.resolution, q=half)
    assert bool(found(replace(FRANKA, resolution=rough), "franka-fr3", "fr3-decimals")) == broken


@pytest.mark.parametrize("joint", [0, 4, 6])
def test_joints_have_the_names_of_the_file_and_not_those_of_the_robot_in_its_order(joint: int) -> None:
    names = tuple(f"joint_{k}" for k in (3, 1, 7, 2, 5, 4, 6))
    rows = replace(with_value(FRANKA, "qd", -1, joint, 0.02), joints=names)
    around = Surroundings(FRANKA.joints, STILL[0])
    every = judge_by_profile([rows], load_profile("franka-fr3"), around).findings
    assert {each.joint for each in every if each.rule == "fr3-rest-end"} == {names[joint]}


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.99, False), (1.01, True)])
@pytest.mark.parametrize("row", [0, 10, -1])
def test_numbers_of_few_bits_are_as_rough_as_the_largest_of_a_joint(
    row: int, share: float, side: float, *, broken: bool
) -> None:
    """Of single precision and less a share of each position is lost; 25 rad/s^3 are 8 of them over 1e-9 s^3."""
    q = np.zeros((21, 7))
    q[row, 4] = side * 2.0
    rough = replace(FRANKA.resolution, q=np.zeros(7), relative=(share * 25.0 * 1e-9 / 8.0 / 2.0,) * 3)
    told = found(replace(FRANKA, q=q, resolution=rough), "franka-fr3", "fr3-decimals")
    assert [each.joint for each in told] == ["joint_5"] * broken
    assert [each.limit for each in told] == [pytest.approx(25.0)] * broken


@pytest.mark.parametrize("largest", [0, 1, 2])
@pytest.mark.parametrize(("share", "broken"), [(0.99, False), (1.01, True), (1.2, True)])
def test_numbers_of_few_bits_are_as_rough_as_the_largest_of_any_block(
    largest: int, share: float, *, broken: bool
) -> None:
    """A long file comes block by block; its largest position may stand in any of them, and is told once."""
    blocks = []
    for k in range(3):
        rough = replace(
            FRANKA.resolution, q=np.zeros(7), relative=(share * 25.0 * 1e-9 / 8.0 / 2.0, 0.0, 0.0)
        )
        q = np.full((21, 7), 2.0 if k == largest else 1.9)
        blocks.append(replace(FRANKA, q=q, resolution=rough, first_row=1 + 21 * k))
    every = judge_by_profile(blocks, load_profile("franka-fr3"), Surroundings(FRANKA.joints, q[0])).findings
    told = [each for each in every if each.rule == "fr3-decimals"]
    assert [(each.value, each.row, each.count) for each in told] == [
        (pytest.approx(share * 25.0), 1 + 21 * largest, 1)
    ] * broken


def test_of_joints_that_are_rounded_alike_the_one_with_the_least_jerk_is_named() -> None:
    """The second joint of this arm may have 3750 rad/s^3, the others more."""
    rough = replace(FRANKA.resolution, q=np.full(7, 3e-9))
    (told,) = found(replace(FRANKA, resolution=rough), "franka-fer", "fer-decimals")
    assert (told.joint, told.value) == ("joint_2", pytest.approx(24.0))


def straight(period: float, speeds: np.ndarray) -> RecordedMotion:
    """Return rows of positions alone, between which joint 3 moves at given speeds, rad/s."""
    q = np.zeros((len(speeds) + 1, 7))
    q[1:, 2] = np.cumsum(period * speeds)
    t = period * np.arange(len(speeds) + 1)
    return replace(motion(period=period, rows=len(t), columns="q", decimals=None), t=t, q=q)


@SIDES
@pytest.mark.parametrize("period", [0.1, 5e-4])
@pytest.mark.parametrize(("size", "broken"), [(5e-9, True), (5e-10, False)])
def test_a_step_of_velocity_is_more_than_a_billionth(
    size: float, period: float, side: float, *, broken: bool
) -> None:
    """A joint that moves at one speed for two intervals, and rests before and behind."""
    rows = straight(period, side * np.array([0.0, size, size, 0.0]))
    told = found(rows, "ros-jtc", "jtc-positions-only")
    assert [(each.joint, each.row, each.count) for each in told] == [("joint_3", 2, 2)] * broken


def test_points_with_velocities_have_no_steps_of_them() -> None:
    """They are joined by cubics, whether they have accelerations or not."""
    around = Surroundings(FRANKA.joints, HOME[7])
    for columns in ("q,qd", "q,qd,qdd"):
        assert judged(motion(period=0.1, rows=21, columns=columns), "ros-jtc", around).findings == ()


def test_a_stamp_that_repeats_makes_no_velocity_without_bounds() -> None:
    """The joint goes on while the time stands still: at 0.5, at no speed that is known, at 0.5."""
    rows = straight(0.1, np.full(6, 0.5))
    t = np.array([0.0, 0.1, 0.2, 0.2, 0.3, 0.4, 0.5])
    (told,) = found(replace(rows, t=t), "ros-jtc", "jtc-positions-only")
    assert (told.value, told.row, told.count) == (pytest.approx(0.5), 1, 4)


@SIDES
@pytest.mark.parametrize("joint", [0, 6])
def test_a_curve_to_the_first_point_is_told_by_what_it_reaches_and_when(joint: int, side: float) -> None:
    """From rest to rest a quintic reaches 10 / sqrt(3) D / T^2 at (1 -+ 1 / sqrt(3)) T / 2, and brakes as hard."""
    span, distance = 0.4, 0.5
    later = replace(FRANKA, t=FRANKA.t + span)
    start = STILL[0] - side * distance * np.eye(7)[joint]
    peak = 10 / 3**0.5 * distance / span**2
    free = np.tile([-np.inf, np.inf], (7, 1))
    for low, high in ((0.9, 0.8), (0.9, 1.1), (1.1, 0.8), (1.1, 1.1)):
        limits = Limits(free, free, np.tile([-low * peak, high * peak], (7, 1)), free)
        told = sorted(approach_excesses(later, start, limits), key=lambda each: each[2])
        speeding, braking = ((1 - side * way / 3**0.5) * span / 2 for way in (1, -1))
        wanted = [(joint, "acceleration", -peak, -low * peak, braking)] * (low < 1)
        wanted += [(joint, "acceleration", peak, high * peak, speeding)] * (high < 1)
        assert [each[:2] for each in told] == [each[:2] for each in wanted]
        for each, by_hand in zip(told, wanted, strict=True):
            assert each[2:] == pytest.approx(by_hand[2:], rel=1e-6)


def test_of_points_the_first_one_is_where_the_curve_to_it_arrives() -> None:
    """With velocities alone a cubic, from rest to rest as fast as 3 D / (2 T) in its middle."""
    t, q = 0.5 + 0.1 * np.arange(21), STILL.copy()
    qd = np.zeros((21, 7))
    qd[1:, 2] = 9.0  # of the others nothing counts
    rows = replace(FRANKA, t=t, q=q, qd=qd, qdd=None)
    free, bound = np.tile([-np.inf, np.inf], (7, 1)), np.tile([-0.59, 0.59], (7, 1))
    (told,) = approach_excesses(rows, STILL[0] - 0.2 * np.eye(7)[2], Limits(free, bound, free, free))
    assert told == (2, "velocity", pytest.approx(0.6), 0.59, pytest.approx(0.25))


@pytest.mark.parametrize("columns", ["q,qd", "q,qd,qdd"])
@pytest.mark.parametrize("late", [0.0, 4e-7])
@pytest.mark.parametrize(("apart", "near"), [(3e-5, True), (1.2e-3, True), (8e-3, False)])
def test_points_so_near_that_whole_numbers_make_an_acceleration(
    apart: float, near: bool, late: float, columns: str
) -> None:
    """Scipy joins the points as they are sent: beyond what the planned ones have is what was said, and no more."""
    joint, limit = 2, 5.0
    t = np.array([0.0, 0.5, 0.5 + apart, 1.0]) + late * np.arange(4)
    q, qd, qdd = (np.zeros((4, 6)) for _ in range(3))
    q[:, joint] = 0.1 + 0.6 * t - 2.0 * t**2 / 2 + 3e-7  # the third point is rounded by another amount
    qd[:, joint], qdd[:, joint] = 0.6 - 2.0 * t, -2.0
    rows = replace(motion(6, 0.1, 4), t=t, q=q, qd=qd, qdd=qdd)
    rows = rows if "qdd" in columns else replace(rows, qdd=None)
    free, bound = np.tile([-np.inf, np.inf], (6, 1)), np.tile([-limit, limit], (6, 1))
    limits = Limits(free, free, bound, free)
    around = replace(surroundings(6), limits=limits)
    told = [
        each for each in judged(rows, "ur-passthrough", around).findings if each.rule.endswith("near-points")
    ]
    sent = np.cumsum(np.append(0.0, np.rint(np.diff(rows.t) / 1e-6))) * 1e-6
    names = [values for values in (rows.q, rows.qd, rows.qdd) if values is not None]
    states = np.stack([np.rint(values[:, joint] / 1e-6) * 1e-6 for values in names], axis=1)
    largest = 0.0
    for k in range(3):
        curve = BPoly.from_derivatives(sent[k : k + 2], states[k : k + 2]).derivative(2)
        largest = max(largest, np.abs(curve(np.linspace(*sent[k : k + 2], 2001)) + 2.0).max())
    assert bool(told) == near == (largest > 1.0)
    for each in told:
        assert (each.joint, each.row, each.severity) == ("joint_3", 3, "warning")
        assert each.limit == pytest.approx(0.2 * limit)
        # rates are rounded as well
        assert each.value == pytest.approx(largest, rel=0.02, abs=8e-6 / apart)
