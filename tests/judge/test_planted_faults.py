"""Planted faults: each is found, named and timed, and its clean twin is satisfied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from recorded_rows import bare_robot, judged, part, rows_of
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.judge.judgement import Judgement
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

DURATION, DISTANCE = 2.0, 1.2
PEAKS = (DISTANCE * 1.875 / DURATION, DISTANCE * 10 / 3**0.5 / DURATION**2, DISTANCE * 60 / DURATION**3)
"""Of a quintic from rest to rest: velocity, acceleration, jerk (Biagiotti and Melchiorri, section 2.1)."""
AT = (1.0, DURATION * (0.5 - 3**0.5 / 6), 0.0)


def quintic(joints: int = 3) -> PiecewisePolynomial:
    """Return a quintic from rest to rest, the same for each joint but for its size."""
    derivatives = np.zeros((3, 2, joints))
    derivatives[0, 1] = DISTANCE / np.arange(1, joints + 1)
    return hermite_pieces(np.array([0.0, DURATION]), derivatives)


def limits(over: float = 1e-9, joints: int = 3, **others: float) -> Limits:
    """Return limits that the quintic just keeps, or that it breaks by a part."""
    bounds = {"position": 2.0, "velocity": PEAKS[0], "acceleration": PEAKS[1], "jerk": PEAKS[2], **others}
    rows = {}
    for name, bound in bounds.items():
        size = bound / np.arange(1, joints + 1) * (1 + over) if name != "position" else np.full(joints, bound)
        rows[name] = np.stack([-size, size], axis=1)
    return Limits(**rows)


def worst(judgement: Judgement, kind: str, joint: str | None = "j1") -> Finding:
    found = [each for each in judgement.findings if (each.kind, each.joint) == (kind, joint)]
    assert len(found) == 1, judgement.findings
    return found[0]


@pytest.mark.parametrize("decimals", [None, 9, 6])
@pytest.mark.parametrize("orders", [1, 2, 3])
@pytest.mark.parametrize("period", [1e-3, 4e-3, 0.02])
def test_a_motion_at_its_limits_is_no_false_alarm(period: float, orders: int, decimals: int | None) -> None:
    room = 1e-3 if period > 0.01 and orders == 2 else 1e-9  # cubics bend more than the quintic
    judgement = judged(rows_of(quintic(), period, orders, decimals), limits(room))
    assert judgement.passed, judgement.findings
    if orders != 2:  # cubics bend otherwise than the quintic between rows, and a warning says so
        assert [found for found in judgement.findings if found.severity == "warning"] == []


@pytest.mark.parametrize("kind", ["velocity", "acceleration", "jerk"])
@pytest.mark.parametrize("period", [1e-3, 0.05])
def test_a_hundredth_of_a_percent_is_seen(kind: str, period: float) -> None:
    order = ("velocity", "acceleration", "jerk").index(kind)
    tight = limits(0.1, **{kind: PEAKS[order] / (1 + 1e-4) / 1.1})
    motion = rows_of(quintic(), period)
    judgement = judged(motion, tight)
    found = worst(judgement, kind)
    assert judgement.verdict == "exceeded"
    assert found.severity == "error"
    assert abs(abs(found.value) / PEAKS[order] - 1) < 1e-5
    assert found.factor == pytest.approx((1 + 1e-4) ** (1 / (order + 1)), rel=1e-5)
    near = {AT[order], DURATION - AT[order], *([1.0] if kind == "jerk" else [])}
    assert min(abs(found.time - time) for time in near) < period
    assert found.row == pytest.approx(found.time / period + 1, abs=1.0)


def test_a_peak_between_two_rows_is_found() -> None:
    """Seven rows of a quintic miss its acceleration's peak by 3 %."""
    motion = rows_of(quintic(), DURATION / 6)
    sampled = np.abs(motion.qdd[:, 0]).max()
    assert sampled < 0.98 * PEAKS[1]
    judgement = judged(motion, limits(acceleration=sampled * 1.0001))
    found = worst(judgement, "acceleration")
    assert abs(found.value) == pytest.approx(PEAKS[1], rel=1e-9)
    assert min(abs(found.time - AT[1]), abs(found.time - DURATION + AT[1])) < 1e-6
    assert judged(motion, limits()).verdict == "satisfied"


def changed(motion: RecordedMotion, name: str, row: int | slice, joint: int, by: float) -> RecordedMotion:
    values = getattr(motion, name).copy()
    values[row, joint] += by
    return replace(motion, **{name: values})


def test_a_jump_in_acceleration_is_found() -> None:
    """The second half is 2 rad/s^2 higher in acceleration, and moves as that says."""
    curve, step = quintic(), 2.0
    halves = hermite_pieces(
        np.array([0.0, 1.0, 2.0]),
        curve.evaluate_orders(np.array([0.0, 1.0, 2.0]), (0, 1, 2)).transpose(1, 0, 2),
    )
    coefficients = np.array(halves.coefficients)
    coefficients[3, 1, 1] += step / 2
    motion = rows_of(PiecewisePolynomial(halves.breaks, coefficients), 1e-3, decimals=9)
    judgement = judged(motion, limits(1.0))
    found = worst(judgement, "jump", "j2")
    assert (found.quantity, found.rule, found.count) == ("acceleration", "continuity", 1)
    assert found.value == pytest.approx(step, rel=1e-2)
    assert abs(found.time - 1.0) <= 1.001e-3
    certain = [each for each in judgement.findings if each.certainty == "exceeded"]
    assert {each.joint for each in certain} == {"j2"}
    unlimited = judged(motion, limits(1.0, jerk=np.inf))
    assert not [each for each in unlimited.findings if each.kind == "jump"]


@pytest.mark.parametrize("orders", [1, 2, 3])
def test_a_jump_in_position_is_found(orders: int) -> None:
    motion = changed(rows_of(quintic(), 1e-3, orders, 9), "q", slice(700, None), 2, 0.3)
    found = worst(judged(motion, limits(0.5)), "jump", "j3")
    assert (found.quantity, found.row, found.count) == ("position", 700, 1)
    assert found.value == pytest.approx(0.3, rel=1e-2)
    assert found.time == pytest.approx(0.699)


def test_a_doubled_stamp_is_found() -> None:
    motion = rows_of(quintic(), 1e-3, decimals=9)
    stamps = motion.t.copy()
    stamps[500] = stamps[499]
    judgement = judged(replace(motion, t=stamps), limits())
    found = worst(judgement, "time", None)
    assert (found.row, found.time, found.count, found.rule) == (501, pytest.approx(0.499), 1, "time")
    assert "doubled" in found.message
    assert judgement.verdict == "exceeded"


@pytest.mark.parametrize(("by", "word"), [(0.0, "doubled"), (-0.0005, "earlier")])
def test_a_stamp_is_compared_with_those_of_blocks_before(by: float, word: str) -> None:
    """The first row of the second block is not later than the last one of the first."""
    motion = rows_of(quintic(), 1e-3, decimals=9)
    stamps = motion.t.copy()
    stamps[500] = stamps[499] + by
    found = worst(judged(replace(motion, t=stamps), limits(0.5), 500), "time", None)
    assert (found.row, found.count, found.limit) == (501, 1, pytest.approx(0.499))
    assert word in found.message


@pytest.mark.parametrize(("value", "word"), [(np.nan, "nan"), (np.inf, "inf"), (0.1, "earlier")])
def test_a_bad_stamp_is_found(value: float, word: str) -> None:
    motion = rows_of(quintic(), 1e-3, decimals=9)
    stamps = motion.t.copy()
    stamps[500] = value
    found = worst(judged(replace(motion, t=stamps), limits()), "time", None)
    assert found.row == 501
    assert word in found.message


@pytest.mark.parametrize("fault", ["scaled", "degrees", "neighbour", "sign", "shifted"])
def test_a_wrong_velocity_column_is_found(fault: str) -> None:
    motion = rows_of(quintic(), 1e-3, decimals=9)
    qd = motion.qd.copy()
    qd[:, 1] = {
        "scaled": qd[:, 1] * 1.02,
        "degrees": np.degrees(qd[:, 1]),
        "neighbour": qd[:, 0],
        "sign": -qd[:, 1],
        "shifted": np.roll(qd[:, 1], 25),
    }[fault]
    judgement = judged(replace(motion, qd=qd), limits(0.5))
    found = worst(judgement, "derivative", "j2")
    assert (found.quantity, found.rule) == ("velocity", "derivative")
    if fault != "shifted":
        assert abs(found.time - 1.0) < 0.2  # where it is fastest
    assert not [each for each in judgement.findings if each.kind == "derivative" and each.joint != "j2"]
    assert not [each for each in judgement.findings if each.kind == "jump" and each.quantity == "position"]


def test_a_wrong_acceleration_column_is_found() -> None:
    motion = rows_of(quintic(), 1e-3, decimals=9)
    qdd = motion.qdd.copy()
    qdd[:, 2] *= 1.5
    found = worst(judged(replace(motion, qdd=qdd), limits(1.0)), "derivative", "j3")
    assert found.quantity == "acceleration"
    assert found.value == pytest.approx(1.5 * found.limit, rel=1e-2)


def test_degrees_for_radians_are_hinted_at() -> None:
    motion = rows_of(quintic(), 0.01, 1)
    found = worst(judged(replace(motion, q=np.degrees(motion.q)), limits()), "position")
    assert found.hint is not None
    assert "degrees" in found.hint
    assert found.value == pytest.approx(np.degrees(DISTANCE))


def test_an_irregular_24_hz_file_in_six_decimals_is_taken_as_24_hz() -> None:
    """Stamps of 0.041667 s: as they stand the velocity is off by up to 1.2e-5 of itself."""
    motion = rows_of(quintic(), 1 / 24, 1, 9, 6)
    judgement = judged(motion, limits(0.01))
    assert judgement.period == pytest.approx(1 / 24, rel=1e-15)
    assert any("24 Hz" in note for note in judgement.notes)
    peak = np.abs(np.diff(rows_of(quintic(), 1 / 24, 1).q[:, 0])).max() * 24
    found = worst(judged(motion, limits(velocity=peak / (1 + 1e-5))), "velocity")
    assert found.certainty == "exceeded"
    assert found.value == pytest.approx(peak, rel=1e-7)
    assert judged(motion, limits(velocity=peak * (1 + 1e-7))).verdict == "satisfied"


@pytest.mark.parametrize("skipped", [0, 1, 5])
@pytest.mark.parametrize("begins", [0.0, 1.2345678])
def test_a_file_may_begin_at_any_row_and_at_any_time(begins: float, skipped: int) -> None:
    """Rows at 24 Hz in six decimals: as they stand, each interval may be off by a millionth of a second."""
    motion = rows_of(quintic(), 1 / 24, 1, 9)
    rows = part(motion, slice(skipped, -1))
    written = np.round(rows.t + begins, 6)
    judgement = judged(
        replace(rows, t=written, resolution=replace(rows.resolution, time=0.5e-6), first_row=1), limits(0.01)
    )
    assert judgement.period == pytest.approx(1 / 24, rel=1e-15)
    assert judgement.verdict == "satisfied"


def test_what_rounding_explains_is_within_rounding() -> None:
    """Six decimals at 1 kHz leave 1e-3 rad/s of doubt."""
    motion = rows_of(quintic(), 1e-3, 1, 6)
    slope = np.abs(np.diff(motion.q[:, 0])).max() * 1000
    judgement = judged(motion, limits(velocity=slope * (1 - 1e-6)))
    assert judgement.verdict == "within rounding"
    assert worst(judgement, "velocity").rounding == pytest.approx(1e-3, rel=1e-6)
    assert judged(motion, limits(velocity=slope - 1.1e-3)).verdict == "exceeded"
    assert judged(motion, limits(velocity=slope - 0.9e-3)).verdict == "within rounding"


@pytest.mark.parametrize(
    ("orders", "blocks"),
    few([(1, 1), (1, 7), (1, 75), (2, 7), (2, 1), (2, 75), (3, 75), (3, 1), (3, 7)], 3),
)
def test_blocks_change_nothing(orders: int, blocks: int) -> None:
    motion = changed(rows_of(quintic(), 8e-3, orders, 9), "q", slice(190, None), 2, 0.3)
    motion = replace(motion, move=np.repeat([0, 1, 2], [100, 75, len(motion.t) - 175]))
    tight = limits(-0.05)
    entire, cut = judged(motion, tight), judged(motion, tight, blocks)
    assert entire.verdict == cut.verdict == "exceeded"
    views = [
        {(f.kind, f.quantity, f.joint, f.move): f for f in judgement.findings} for judgement in (entire, cut)
    ]
    assert views[0].keys() == views[1].keys()
    for key, found in views[0].items():
        other = views[1][key]
        assert (found.count, found.certainty, found.severity) == (
            other.count,
            other.certainty,
            other.severity,
        )
        assert [found.value, found.time] == pytest.approx([other.value, other.time], rel=1e-9)
    assert (entire.period, entire.rows) == (cut.period, cut.rows)


def test_the_stamps_of_a_later_block_may_fit_no_period() -> None:
    motion = rows_of(quintic(), 2e-3, 2, 9)
    stamps = motion.t.copy()
    stamps[850] += 0.0005
    judgement = judged(replace(motion, t=stamps), limits(0.5), 40)
    assert judgement.period is None
    assert judgement.rows == len(stamps)


def test_sparse_points_need_not_say_what_happens_between_them() -> None:
    """A move of 2 s from rest to rest as its two ends: velocities of zero do not say that nothing moves."""
    motion = rows_of(quintic(), DURATION)
    assert len(motion.t) == 2
    assert judged(motion, limits()).verdict == "satisfied"
    assert judged(motion, limits(jerk=np.inf)).verdict == "satisfied"
    assert judged(motion, limits(jerk=np.inf, acceleration=np.inf)).verdict == "satisfied"


def test_a_joint_too_fast_towards_its_end_is_found() -> None:
    """|v| <= sqrt(2 d x) - o at the distance x before the end of the range: sampled densely for the oracle."""
    curve, end, d, o = quintic(1), 1.6, 2.0, 0.1
    t = np.linspace(0.0, DURATION, 400_001)
    share = curve.evaluate(t, 1)[:, 0] / (np.sqrt(2 * d * (end - curve.evaluate(t)[:, 0])) - o)
    worst_share, at = share.max(), t[share.argmax()]

    def near(part: float) -> Limits:
        """Return limits of which the motion uses a part: k (sqrt(2 d x) - o) has k^2 d and k o."""
        k = worst_share / part
        none = np.array([[-np.inf, np.inf]])
        return Limits(
            np.array([[-2.0, end]]), none, none, none, velocity_by_position=np.array([[k**2 * d, k * o]])
        )

    for period in (1e-3, 0.05):
        motion = rows_of(curve, period, decimals=12)
        assert judged(motion, near(1 - 1e-6)).verdict == "satisfied"
        judgement = judged(motion, near(1 + 1e-4))
        found = worst(judgement, "velocity_by_position")
        assert judgement.verdict == "exceeded"
        assert abs(found.time - at) < 0.01
        assert found.value / found.limit == pytest.approx(1 + 1e-4, rel=1e-6)
        assert found.factor == pytest.approx(1 + 1e-4, rel=1e-6)


def dipping(dips: tuple[int, ...]) -> PiecewisePolynomial:
    """Return an acceleration of 1 rad/s^2, then -1, that leaves for 2 ms within some intervals of 8 ms."""
    edges = sorted({0.0, 0.4, 0.8, *(0.008 * k + at for k in dips for at in (0.003, 0.005))})
    lengths, middle = np.diff(edges), np.array(edges[:-1]) + np.diff(edges) / 2
    away = (middle % 0.008 > 0.003) & (middle % 0.008 < 0.005) & np.isin(middle // 0.008, dips)
    pieces = np.zeros((3, lengths.size, 1))
    pieces[0, :, 0] = 0.5 * np.where(middle < 0.4, 1.0, -1.0) * np.where(away, -1.0, 1.0)
    speed = np.concatenate([[0.0], np.cumsum(2 * pieces[0, :, 0] * lengths)])
    pieces[1, :, 0] = speed[:-1]
    pieces[2, 1:, 0] = np.cumsum(lengths * (speed[:-1] + speed[1:]) / 2)[:-1]
    return PiecewisePolynomial(np.array(edges), pieces)


def test_steps_of_acceleration_between_rows_are_no_wrong_column() -> None:
    """The rows show 1 rad/s^2 throughout, and in three intervals of four the velocity gains half as much."""
    dips = (20, 21, 23, 70, 71, 73)
    motion = rows_of(dipping(dips), 0.008, decimals=9)
    wide = limits(joints=1, velocity=9.0, acceleration=99.0, jerk=1e9)
    assert np.ptp(np.asarray(motion.qdd)[:50]) == 0.0
    assert judged(motion, wide).verdict == "satisfied"
    found = worst(judged(replace(motion, qdd=1.02 * np.asarray(motion.qdd)), wide), "derivative")
    assert found.quantity == "acceleration"


@pytest.mark.parametrize("limit", [2.0, np.inf])
def test_a_short_ramp_within_the_limit_is_no_jump(limit: float) -> None:
    """Two velocities, and 2 rad/s^2 for 3 ms between two rows: only where nothing bounds it, it may be a jump."""
    pieces = np.zeros((3, 3, 1))
    pieces[:, :, 0] = [[0.0, 1.0, 0.0], [0.5, 0.5, 0.506], [0.0, 0.0505, 0.0505 + 0.003 * 0.503]]
    motion = rows_of(PiecewisePolynomial(np.array([0.0, 0.101, 0.104, 0.3]), pieces), 0.01, decimals=9)
    judgement = judged(motion, limits(0.0, joints=1, velocity=9.0, acceleration=limit, jerk=np.inf))
    assert {each.kind for each in judgement.errors} == (set() if np.isfinite(limit) else {"jump"})


@pytest.mark.parametrize("blocks", [None, 300, 7])
@pytest.mark.parametrize(("share", "verdict"), [(0.95, "within rounding"), (1.1, "exceeded")])
def test_stamps_of_no_period_explain_by_how_much_both_ends_of_an_interval_are_rounded(
    share: float, verdict: str, blocks: int | None
) -> None:
    """Stamps are late and early by turns, 0.1 ms each, of rows that go at just 1 rad/s: in the last ones only."""
    half = 1e-4
    t = np.cumsum(np.random.default_rng(3).uniform(0.01, 0.03, 900))
    off = np.where(np.arange(900) < 880, 0.0, share * half * (-1.0) ** np.arange(900))
    rows = rows_of(quintic(1), 0.5, 1)
    rows = replace(rows, t=t + off, q=t[:, None], resolution=Resolution(half, *3 * (np.zeros(1),)))
    within = judged(rows, limits(joints=1, position=99.0, velocity=1.0), blocks)
    assert within.verdict == verdict
    assert within.period is None


@pytest.mark.parametrize(("between", "told"), [(5, 0), (8, 0), (10, 39), (20, 39)])
def test_longer_intervals_are_holes_where_there_are_nine_of_one_period_for_each(
    between: int, told: int
) -> None:
    steps = np.array(([1] * between + [2]) * 40)
    t = np.concatenate([[0.0], np.cumsum(steps)])[:-1] * 0.01
    rows = replace(rows_of(quintic(1), 0.5, 1), t=t, q=np.zeros((len(t), 1)))
    holes = [each for each in judged(rows, limits(joints=1)).findings if each.rule == "time"]
    assert [each.count for each in holes] == ([told] if told else [])
    assert [each.severity for each in holes] == ["warning"] * len(holes)


def test_the_period_of_rows_one_of_which_is_missing_is_none() -> None:
    rows = rows_of(quintic(1), 0.01, 1)
    assert judged(rows, limits(joints=1)).period == pytest.approx(0.01)
    kept = np.arange(len(rows.t)) != 77
    assert judged(replace(rows, t=rows.t[kept], q=rows.q[kept]), limits(joints=1)).period is None


def test_rows_that_name_no_move_have_the_limits_of_the_arm() -> None:
    slow = bare_robot(limits(-0.5, 1))
    rows = rows_of(quintic(1), 0.01, 3)
    assert judged(rows, limits(joints=1), by_move={0: slow}).passed
    of_first = replace(rows, move=np.zeros(len(rows.t), dtype=np.int64))
    found = judged(of_first, limits(joints=1), by_move={0: slow}).findings
    assert found
    assert {each.move for each in found} == {0}
    assert {each.move for each in judged(rows, limits(-0.5, 1)).findings} == {None}


def test_the_velocity_of_a_single_row_moves_nothing() -> None:
    """It is said that the motion does not end at rest; positions that do not follow from it there are none."""
    rows = part(rows_of(quintic(1), 0.01, 3), slice(100, 101))
    found = judged(rows, limits(joints=1))
    assert (found.interpolation, found.passed) == ("hold", True)
    assert [(each.rule, each.kind, each.severity) for each in found.findings] == [("state", "end", "warning")]


@pytest.mark.parametrize("blocks", [None, 300])
def test_rows_late_in_a_long_log_are_as_far_apart_as_their_period(blocks: int | None) -> None:
    """After 100000 s at 1 kHz a stamp is rounded by a hundred-millionth of the period; rows go at 1 rad/s."""
    steps = np.arange(900)
    t = 1e5 + 1e-3 * steps
    assert np.ptp(np.diff(t)) > 1e-11
    rows = replace(rows_of(quintic(1), 0.5, 1), t=t, q=1e-3 * steps[:, None])
    assert judged(rows, limits(joints=1, velocity=1.0), blocks).verdict == "satisfied"
    (found,) = judged(rows, limits(-1e-8, joints=1, velocity=1.0), blocks).errors
    assert (found.kind, found.certainty, found.value) == (
        "velocity",
        "exceeded",
        pytest.approx(1.0, rel=1e-10),
    )


def test_positions_within_two_turns_do_not_look_like_degrees() -> None:
    found = worst(judged(rows_of(quintic(), 0.01, 1), limits(0.5, position=1.0)), "position")
    assert found.value == pytest.approx(DISTANCE)
    assert "degrees" not in (found.hint or "")


@pytest.mark.parametrize(("excess", "looks"), [(28.0, True), (2.0, False)])
def test_velocities_far_over_their_limits_look_like_degrees(excess: float, looks: bool) -> None:
    motion = rows_of(quintic(1), 0.01, 1)
    motion = replace(motion, q=np.degrees(motion.q))
    peak = np.abs(np.diff(motion.q[:, 0])).max() / 0.01
    inf = dict.fromkeys(("position", "acceleration", "jerk"), np.inf)
    found = worst(judged(motion, limits(joints=1, velocity=peak / excess, **inf)), "velocity")
    assert ("degrees" in (found.hint or "")) is looks


@pytest.mark.parametrize("sizes", [(60.0, 1.0), (1.0, 60.0)])
def test_lengths_do_not_look_like_degrees(sizes: tuple[float, float]) -> None:
    """A slide goes too far, or a joint without a range turns often: the other one of them is beyond its own range."""
    motion = rows_of(quintic(2), 0.01, 1)
    motion = replace(motion, q=motion.q * sizes)
    wide = limits(joints=2, velocity=1e9, acceleration=1e9, jerk=1e9, position=0.5)
    second = np.inf if sizes[1] > 1 else 0.5
    bare = bare_robot(replace(wide, position=np.array([[-0.5, 0.5], [-second, second]])))
    robot = replace(bare, joints=(replace(bare.joints[0], type="prismatic"), bare.joints[1]))
    found = judge_motion(lambda: [motion], Requirements(robot)).findings
    assert {each.kind for each in found} == {"position"}
    assert not [each.hint for each in found if "degrees" in (each.hint or "")]


@pytest.mark.parametrize(("turns", "looks"), [(1.95, False), (-1.95, False), (2.05, True), (-2.05, True)])
def test_only_what_goes_beyond_two_turns_looks_like_degrees(turns: float, looks: bool) -> None:
    """Joints of wrists turn more than once: a range that they pass is no question of units."""
    motion = rows_of(quintic(1), 0.01, 1)
    motion = replace(motion, q=motion.q / DISTANCE * turns * 2.0 * np.pi)
    wide = limits(joints=1, velocity=1e9, acceleration=1e9, jerk=1e9, position=1.0)
    found = worst(judged(motion, wide), "position")
    assert abs(found.value) == pytest.approx(abs(turns) * 2.0 * np.pi)
    assert ("degrees" in (found.hint or "")) is looks


class _Consumer:
    """Rules with one finding that says itself what fixes it."""

    def take(self, block: RecordedMotion) -> None:
        del block

    def result(self) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
        fields = {"limit": 1.0, "time": 0.0, "message": "far", "rule": "range"}
        return (Finding(kind="position", joint="j1", value=1e9, hint="stay in the range", **fields),), ()


def test_what_a_finding_says_itself_is_not_taken_for_degrees() -> None:
    motion = rows_of(quintic(1), 0.01, 1)
    free = limits(joints=1, **dict.fromkeys(("position", "velocity", "acceleration", "jerk"), 1e9))
    found = worst(judged(replace(motion, q=np.degrees(motion.q)), free, consumer=_Consumer), "position")
    assert found.hint == "stay in the range"


@pytest.mark.parametrize(("off", "told"), [(0.0, False), (1e-13, False), (1e-7, True)])
def test_stamps_that_floating_point_rounds_are_as_they_were(off: float, told: bool) -> None:
    """One of them stands beside its multiple of 10 ms, by some units in the last place or by its rounding to 1 us."""
    rows = rows_of(quintic(1), 0.01, 1)
    t = 0.01 * np.arange(len(rows.t))
    t[50] += off
    rows = replace(rows, t=t, resolution=Resolution(1e-6, *3 * (np.zeros(1),)))
    judgement = judged(rows, limits(joints=1))
    assert judgement.period == pytest.approx(0.01, rel=1e-12)
    moved = [float(note.split(" by ")[1].split(" s ")[0]) for note in judgement.notes]
    assert moved == ([pytest.approx(off, rel=0.01)] if told else [])


def test_what_is_furthest_beyond_its_limit_is_said_first() -> None:
    """Whoever says it: the rules of a consumer are asked last, and a warning that the end moves is behind all."""
    rows = part(rows_of(quintic(1), 0.01, 2), slice(0, 150))
    free = dict.fromkeys(("position", "acceleration", "jerk"), np.inf)
    found = judged(rows, limits(joints=1, velocity=0.5 * PEAKS[0], **free), consumer=_Consumer).findings
    kinds = [(each.kind, each.severity) for each in found]
    assert kinds == [("position", "error"), ("velocity", "error"), ("end", "warning")]
