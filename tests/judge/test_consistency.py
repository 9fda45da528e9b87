"""What two columns may differ by, source by source: each alone, on both sides of its line, in either direction.

All motions are so simple that what a source explains is one product: rows at rest, or at one speed.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from recorded_rows import bare_robot

from trajcli.findings import Finding
from trajcli.judge.consistency import Changes
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Limits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

COUNT = 24
DENSE = np.cumsum(0.004 + 0.001 * (np.arange(COUNT) % 3))  # s; no multiples of a period
OFF = 1e-5
SIDES = pytest.mark.parametrize("side", [1, -1])


def rows(*columns: np.ndarray, t: np.ndarray = DENSE, late: float = 0.0, **off: float) -> RecordedMotion:
    """Return rows of one joint, or of several, with the roundings of their columns."""
    stated = [each[:, None] if each.ndim == 1 else each for each in columns]
    roundings = [np.full(stated[0].shape[1], off.get(name, 0.0)) for name in ("q", "qd", "qdd")]
    every = [*stated, None, None][:3]
    return RecordedMotion(t, *every, None, None, None, None, Resolution(late, *roundings), "rows")


def inconsistent(motion: RecordedMotion, limits: Limits | None = None) -> list[Finding]:
    """Return the jumps, and the columns that are no derivatives."""
    robot = bare_robot(limits or unlimited(motion.q.shape[1]))
    judgement = judge_motion(lambda: [motion], Requirements(robot))
    return [each for each in judgement.findings if each.rule in ("continuity", "derivative")]


@SIDES
@pytest.mark.parametrize(("share", "jumps"), [(0.95, False), (1.05, True)])
def test_a_point_without_a_velocity_makes_no_jump_of_what_limits_allow_elsewhere(
    share: float, jumps: bool, side: int
) -> None:
    """The velocity changes once, by that share of what the limit of 2 rad/s^2 allows between two rows."""
    step = side * share * 2.0 * (DENSE[12] - DENSE[11])
    qd = np.where(np.arange(COUNT) < 12, 0.0, step)
    q = np.append(0.0, np.cumsum(np.diff(DENSE) * (qd[:-1] + qd[1:]) / 2.0))
    qd[3] = np.nan
    limits = replace(unlimited(1), acceleration=np.array([[-2.0, 2.0]]))
    found = [each for each in of_points(rows(q, qd, q=1e-12, qd=1e-12), limits) if each[0] == "jump"]
    assert found == [("jump", "velocity")] * jumps


@SIDES
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.3, True)])
def test_both_values_of_a_change_may_be_rounded(share: float, broken: bool, order: int, side: int) -> None:
    """The rate is zero throughout; the values are off in turns, up and down."""
    still = np.zeros(COUNT)
    off = side * share * OFF * (-1.0) ** np.arange(COUNT)
    columns = [off, still] if order == 0 else [np.zeros(COUNT), off, still]
    motion = rows(*columns, **{("q", "qd")[order]: OFF})
    found = [each for each in inconsistent(motion) if each.quantity == ("velocity", "acceleration")[order]]
    assert [each.kind for each in found] == (["derivative"] if broken else [])


def of_points(motion: RecordedMotion, limits: Limits) -> list[tuple[str, str | None]]:
    """Return kinds and quantities that are inconsistent of points, some of which lack velocities."""
    judgement = judge_motion(lambda: [motion], Requirements(bare_robot(limits), interpolate="jtc"))
    return [(f.kind, f.quantity) for f in judgement.findings if f.rule in ("continuity", "derivative")]


@pytest.mark.parametrize("hole", [0, COUNT // 2, COUNT - 1])
@pytest.mark.parametrize("order", [1, 2])
def test_a_point_without_a_rate_hides_nothing_of_the_others(order: int, hole: int) -> None:
    """The column says twice what is true."""
    columns = [np.sin(DENSE), np.cos(DENSE), -np.sin(DENSE)][: order + 1]
    columns[order] = 2.0 * columns[order]
    columns[order][hole] = np.nan
    name = ("velocity", "acceleration")[order - 1]
    assert of_points(rows(*columns, q=1e-12, qd=1e-12, qdd=1e-12), unlimited(1)) == [("derivative", name)]
    columns[order] = columns[order] / 2.0
    assert of_points(rows(*columns, q=1e-12, qd=1e-12, qdd=1e-12), unlimited(1)) == []


def test_a_jump_beside_a_point_without_a_velocity_is_one() -> None:
    q, qd = np.where(np.arange(COUNT) < COUNT // 2, 0.0, 1.0), np.zeros(COUNT)
    qd[COUNT // 2] = np.nan
    limits = replace(unlimited(1), velocity=np.array([[-2.0, 2.0]]))
    assert of_points(rows(q, qd, q=1e-12, qd=1e-12), limits) == [("jump", "position")]


@SIDES
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.3, True)])
def test_both_rates_of_an_interval_may_be_rounded(share: float, broken: bool, order: int, side: int) -> None:
    """Values that do not change, and a rate that is one number throughout."""
    still, rate = np.zeros(COUNT), np.full(COUNT, side * share * OFF)
    columns = [still, rate] if order == 0 else [still, still, rate]
    motion = rows(*columns, **{("qd", "qdd")[order]: OFF})
    (found,) = inconsistent(motion) or [None]
    assert (found is not None) == broken
    if found is not None:
        assert (found.kind, found.severity) == ("derivative", "error")
        assert found.value == pytest.approx(side * share * OFF, rel=1e-6)
        assert found.limit == pytest.approx(0.0, abs=1e-12)
        assert found.rounding == pytest.approx(OFF, rel=0.01)  # and a thousandth of the peak, which is meant


@SIDES
@pytest.mark.parametrize(
    ("steps", "jump"), [((1, 1), False), ((1, 4.1), True), ((1, 3.9), False), ((1, -1), True)]
)
def test_of_three_rows_that_go_on_in_one_direction_none_jumps(
    steps: tuple[float, float], jump: bool, side: int
) -> None:
    """As one of four, which is over a limit of the velocity alone; there and back is a jump, as ever."""
    q = side * np.cumsum([0.0, *steps])
    limits = replace(unlimited(1), velocity=np.array([[-0.5, 0.5]]))
    found = inconsistent(rows(q, t=np.arange(3.0)), limits)
    assert bool(found) == jump


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.3, True)])
def test_both_stamps_of_an_interval_may_be_rounded(share: float, broken: bool, side: int) -> None:
    late, speed = 1e-4, np.full(COUNT, side * 1.0)
    true = DENSE + share * late * (-1.0) ** np.arange(COUNT)
    found = inconsistent(rows(side * true, speed, late=late))
    assert [each.kind for each in found] == (["derivative"] if broken else [])


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9e-3, False), (1.4e-3, True), (5e-3, True)])
def test_a_column_that_differs_by_a_thousandth_of_its_peak_is_meant(
    share: float, broken: bool, side: int
) -> None:
    found = inconsistent(rows(side * DENSE, np.full(COUNT, side * (1 + share))))
    assert [each.kind for each in found] == (["derivative"] if broken else [])


@SIDES
@pytest.mark.parametrize("quick", [0, 1])
@pytest.mark.parametrize(("share", "broken"), [(0.8e-4, False), (1.5e-4, True)])
def test_beside_a_quick_joint_a_slow_one_may_differ_by_a_ten_thousandth(
    share: float, broken: bool, quick: int, side: int
) -> None:
    q, qd = np.zeros((COUNT, 2)), np.zeros((COUNT, 2))
    q[:, quick], qd[:, quick] = DENSE, 1.0
    qd[:, 1 - quick] = side * share
    found = inconsistent(rows(q, qd))
    assert [each.joint for each in found] == ([f"j{2 - quick}"] if broken else [])


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.99, False), (1.02, True)])
def test_between_distant_rows_a_joint_may_do_all_that_its_limits_allow(
    share: float, broken: bool, side: int
) -> None:
    """From rest to rest within T it goes a T^2 / 4 far; with no acceleration at its ends j T^2 / 4 faster."""
    t, length, still = 0.5 * np.arange(12.0), 0.5, np.zeros(12)
    step = np.where(np.arange(12) > 2, 1.0, 0.0)
    limits = replace(unlimited(1), acceleration=np.array([[-1.0, 2.0]]))
    far = side * share * 2.0 * length**2 / 4
    assert bool(inconsistent(rows(far * step, still, t=t), limits)) == broken
    limits = replace(unlimited(1), jerk=np.array([[-3.0, 1.0]]), acceleration=np.array([[-9.0, 9.0]]))
    gain = side * share * 3.0 * length**2 / 4
    speed = gain * (np.arange(12) % 2)
    moved = np.append(0.0, np.cumsum(np.full(11, gain / 2 * length)))
    assert [each.quantity for each in inconsistent(rows(moved, speed, still, t=t), limits)] == (
        ["acceleration"] if broken else []
    )


@pytest.mark.parametrize(
    ("first", "wrong", "persistent"),
    [(0, 16, False), (0, 17, True), (183, 17, True), (184, 16, False), (100, 32, False), (100, 33, True)],
)
def test_a_column_is_wrong_where_most_of_the_intervals_around_are(
    first: int, wrong: int, persistent: bool
) -> None:
    """Around an inner interval are 65 of them, 32 on each side; at an end there are 33."""
    change, none = np.ones((200, 1)), np.zeros((200, 1))
    disagree = np.zeros((200, 1), dtype=bool)
    disagree[first : first + wrong] = True
    of_velocity = Changes(1, change, none, change, none)
    assert of_velocity.persistent(disagree).any() == persistent
    assert not (of_velocity.persistent(disagree) & ~disagree).any()
    of_position = Changes(0, change, none, change, none)
    assert (of_position.persistent(disagree) == disagree).all()


def test_intervals_at_rest_do_not_count_and_few_do_not_judge() -> None:
    """Four of four that move are too few, five are most of eight; the others are still, up to rounding."""
    none, error = np.zeros((200, 1)), np.full((200, 1), 1e-3)
    for wrong in (4, 5):
        disagree = np.zeros((200, 1), dtype=bool)
        disagree[100 : 100 + wrong] = True
        change = np.where(disagree, 1.0, 0.4e-3)
        found = Changes(1, change, error, change, none).persistent(disagree)
        assert found.any() == (wrong == 5)


@SIDES
@pytest.mark.parametrize(("times", "jumps"), [(3.5, False), (4.5, True), (30.0, True)])
@pytest.mark.parametrize("at", [0, 1, 11, COUNT - 2])
@pytest.mark.parametrize("beside", [0.0, 9.0])
def test_a_jump_is_four_times_the_changes_beside_it(
    beside: float, at: int, times: float, jumps: bool, side: int
) -> None:
    """Of positions alone, over the limit of velocity; another joint may have none, and may move faster."""
    steps = np.full(COUNT - 1, 1e-3)
    steps[at] *= times
    q = np.zeros((COUNT, 2))
    q[1:, 0], q[:, 1] = side * np.cumsum(steps), beside * DENSE
    velocity = np.array([[-0.3, 0.5], [-np.inf, np.inf]] if side > 0 else [[-0.5, 0.3], [-np.inf, np.inf]])
    found = inconsistent(rows(q), replace(unlimited(2), velocity=velocity))
    assert [(each.kind, each.joint, each.row) for each in found] == (
        [("jump", "j1", at + 1)] if jumps else []
    )
    if jumps:
        assert found[0].value == pytest.approx(side * times * 1e-3)


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.2, True)])
def test_a_jump_may_last_longer_than_its_stamps_say(share: float, broken: bool, side: int) -> None:
    """Two stamps may be off; the other direction may be slower, or not at all."""
    late, q = 1e-4, np.zeros(COUNT)
    length = DENSE[12] - DENSE[11]
    q[12:] = side * 2.0 * (length + share * 2 * late)
    velocity = np.array([[-1.0, 2.0] if side > 0 else [-2.0, 1.0]])
    found = inconsistent(rows(q, late=late), replace(unlimited(1), velocity=velocity))
    assert [each.kind for each in found] == (["jump"] if broken else [])


@SIDES
@pytest.mark.parametrize(("step", "jumps"), [(0.0, False), (0.02, True)])
def test_a_velocity_that_changes_evenly_over_uneven_rows_does_not_jump(
    step: float, jumps: bool, side: int
) -> None:
    """2 % over the limit of the acceleration throughout: where some rows are missing it goes on as it did."""
    t = np.delete(1e-3 * np.arange(40), np.s_[14:21])
    fast = side * (1.02 * t + np.where(t > 0.0135, step, 0.0))
    q = np.append(0.0, np.cumsum(0.5 * (fast[1:] + fast[:-1]) * np.diff(t)))
    limits = replace(unlimited(1), acceleration=np.array([[-1.0, 1.0]]))
    found = inconsistent(rows(q, fast, t=t), limits)
    assert [(each.kind, each.quantity, each.row) for each in found] == [("jump", "velocity", 14)] * jumps


@SIDES
@pytest.mark.parametrize(
    ("speed", "share", "jumps"), [(1.0, 0.9, False), (1.0, 1.1, True), (1e-3, 0.9, True)]
)
def test_a_velocity_may_be_off_by_what_rounded_positions_make_of_a_quintic(
    speed: float, share: float, jumps: bool, side: int
) -> None:
    """15 / 8 of the difference of its ends over its length, and less than 1e-4 of the largest velocity."""
    qd = np.full(COUNT, speed)
    qd[12:] += side * share * 15 / 8 * 2 * 1e-9 / (DENSE[12] - DENSE[11])
    motion = rows(speed * DENSE, qd, np.zeros(COUNT), q=1e-9)
    assert [(each.kind, each.quantity) for each in inconsistent(motion)] == [("jump", "velocity")] * jumps


@SIDES
def test_rates_of_a_joint_that_rests_are_no_jump_of_its_position(side: int) -> None:
    qd = np.zeros(COUNT)
    qd[8:18] = side * 0.5
    (found,) = inconsistent(rows(np.zeros(COUNT), qd))
    assert (found.kind, found.quantity, found.value) == ("derivative", "velocity", side * 0.5)


@SIDES
def test_the_column_that_jumps_is_named(side: int) -> None:
    """A joint at 1 rad/s, whose velocities have a block of zeros: positions go on as before."""
    qd = np.full(COUNT, side * 1.0)
    qd[8:18] = 0.0
    assert {each.kind for each in inconsistent(rows(side * DENSE, qd))} == {"derivative"}
    q = side * np.where(np.arange(COUNT) < 12, DENSE, DENSE + 0.1)  # and where it is the position
    found = inconsistent(rows(q, np.full(COUNT, side * 1.0)))
    assert [(each.kind, each.quantity, each.row) for each in found] == [("jump", "position", 12)]


@pytest.mark.parametrize("length", [0.5, 10.0])
def test_a_distant_row_beside_near_ones_may_be_reached_by_all_that_limits_allow(length: float) -> None:
    """Also where a move takes so long that it gets further than with the largest step of acceleration."""
    t = np.append(DENSE, DENSE[-1] + length * np.arange(1, 4))
    far = 0.99 * 2.0 * length**2 / 4
    q, still = np.where(t > DENSE[-1], far, 0.0), np.zeros(t.size)
    limits = replace(unlimited(1), acceleration=np.array([[-1.0, 2.0]]))
    assert inconsistent(rows(q, still, t=t), limits) == []


@SIDES
def test_between_distant_rows_an_acceleration_may_be_another_one(side: int) -> None:
    """Rows state the one limit throughout, and between them it is the other one."""
    t, length = 0.5 * np.arange(12.0), 0.5
    qd = side * 2.0 * t
    q = np.append(0.0, np.cumsum(length * (qd[1:] + qd[:-1]) / 2))
    limits = replace(unlimited(1), acceleration=np.array([[-1.0, 2.0] if side > 0 else [-2.0, 1.0]]))
    found = inconsistent(rows(q, qd, np.full(12, -side * 1.0), t=t), limits)
    assert [each for each in found if each.quantity == "acceleration"] == []


@SIDES
def test_accelerations_that_switch_between_rows_are_no_wrong_column(side: int) -> None:
    """One and minus one in turns, as long as the rows say or twice as long."""
    qdd = side * (-1.0) ** np.arange(COUNT)
    gains = 0.9 * qdd[:-1] * np.diff(DENSE)
    qd = np.append(0.0, np.cumsum(gains))
    q = np.append(0.0, np.cumsum(np.diff(DENSE) * (qd[1:] + qd[:-1]) / 2))
    wide = replace(unlimited(1), acceleration=np.array([[-2.0, 2.0]]))
    assert inconsistent(rows(q, qd, qdd), wide) == []


@pytest.mark.parametrize("stated", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_all_that_moves_or_is_said_to_move_is_counted(side: float, stated: float) -> None:
    """Eleven intervals of thirty that move are too few; an interval that agrees is none of the wrong ones."""
    none, disagree = np.zeros((30, 1)), np.zeros((30, 1), dtype=bool)
    disagree[:11] = True
    moved, said = np.full((30, 1), side * (stated == 0)), np.full((30, 1), side * stated)
    for change, of_column in ((moved, said), (said, moved)):
        assert not Changes(1, change, none, of_column, none).persistent(disagree).any()
        every = np.ones((30, 1), dtype=bool)
        every[17] = False
        assert (Changes(1, change, none, of_column, none).persistent(every) == every).all()


@SIDES
@pytest.mark.parametrize("at", [0, 11, COUNT - 3])
def test_of_two_large_changes_side_by_side_the_larger_one_is_the_jump(at: int, side: int) -> None:
    steps = np.full(COUNT - 1, 1e-3)
    steps[at : at + 2] *= 10.0, 8.0
    q = np.append(0.0, side * np.cumsum(steps))
    velocity = np.array([[-0.3, 0.3]])
    (found,) = inconsistent(rows(q), replace(unlimited(1), velocity=velocity))
    assert (found.kind, found.row, found.count) == ("jump", at + 1, 1)


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.2, True)])
def test_a_jump_may_be_as_much_larger_as_both_rows_are_rounded(share: float, broken: bool, side: int) -> None:
    q = np.zeros(COUNT)
    q[12:] = side * (2.0 * (DENSE[12] - DENSE[11]) + share * 2 * OFF)
    velocity = np.array([[-1.0, 2.0] if side > 0 else [-2.0, 1.0]])
    found = inconsistent(rows(q, q=OFF), replace(unlimited(1), velocity=velocity))
    assert [each.kind for each in found] == (["jump"] if broken else [])


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.1, True)])
def test_without_limits_of_jerk_an_acceleration_steps_between_its_limits(
    share: float, broken: bool, side: int
) -> None:
    """Rows state none, and between them it may be anything: the gain may differ by 2 a T."""
    t, length, a = 0.5 * np.arange(12.0), 0.5, 2.0
    gain = side * share * 2 * a * length
    speed = gain * (np.arange(12) % 2)
    moved = np.append(0.0, np.cumsum(np.full(11, gain / 2 * length)))
    limits = replace(unlimited(1), acceleration=np.array([[-a, a]]))
    found = inconsistent(rows(moved, speed, np.zeros(12), t=t), limits)
    assert [each.quantity for each in found] == (["acceleration"] if broken else [])


@pytest.mark.parametrize("count", [10, 20, 40])
@pytest.mark.parametrize("milliseconds", [7, 9, 10])
def test_few_rows_of_whole_milliseconds_are_no_contradiction(milliseconds: int, count: int) -> None:
    """With three decimals 1/142 s fits twenty rows of 7 ms, over which velocities would be half a percent off."""
    t = np.round(np.arange(count) * milliseconds / 1000, 3)
    assert inconsistent(rows(np.sin(3 * t), 3 * np.cos(3 * t), t=t, late=5e-4)) == []
    assert inconsistent(rows(np.sin(3 * t), 3.03 * np.cos(3 * t), t=t, late=5e-4))


@SIDES
def test_one_distant_row_excuses_no_dense_ones(side: int) -> None:
    """Velocities that are a twentieth too large, and limits that allow anything from the last row but one to the last."""
    t = np.append(DENSE, DENSE[-1] + 0.5)
    wide = replace(unlimited(1), acceleration=np.array([[-10.0, 10.0]]))
    found = inconsistent(rows(side * t, np.full(t.size, side * 1.05), t=t), wide)
    assert [(each.kind, each.quantity) for each in found] == [("derivative", "velocity")]


def test_rounding_counts_between_distant_rows_of_an_arm_with_hardly_any_limits() -> None:
    t, off = 0.5 * np.arange(12.0), 0.9 * OFF * (-1.0) ** np.arange(12)
    hardly = replace(unlimited(1), acceleration=np.array([[-1e-7, 1e-7]]))
    assert inconsistent(rows(off, np.zeros(12), t=t, q=OFF), hardly) == []


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.99, False), (1.02, True)])
def test_rows_at_20_hertz_are_distant(share: float, broken: bool, side: int) -> None:
    t, far = 0.05 * np.arange(12.0), 2.0 * 0.05**2 / 4
    q = side * share * far * np.where(np.arange(12) > 2, 1.0, 0.0)
    limits = replace(unlimited(1), acceleration=np.array([[-1.0, 2.0]]))
    assert bool(inconsistent(rows(q, np.zeros(12), t=t), limits)) == broken


@SIDES
@pytest.mark.parametrize("other", [[-1e3, 1e3], [-np.inf, np.inf]])
@pytest.mark.parametrize(
    ("own", "jumps"), [([-1e3, 1e3], False), ([-np.inf, 1e3], True), ([-1e3, np.inf], True)]
)
def test_a_velocity_jumps_where_no_limit_says_how_fast_it_may_change(
    own: list[float], jumps: bool, other: list[float], side: int
) -> None:
    """By 1 rad/s between two rows, which state no acceleration; within its limits it might be anything."""
    qd = np.zeros((COUNT, 2))
    qd[12:, 0] = side * 1.0
    q = np.vstack([np.zeros((1, 2)), np.cumsum(0.5 * (qd[1:] + qd[:-1]) * np.diff(DENSE)[:, None], axis=0)])
    limits = replace(unlimited(2), acceleration=np.array([own, other]))
    found = inconsistent(rows(q, qd, 0 * qd), limits)
    assert [(each.kind, each.quantity, each.row) for each in found] == [("jump", "velocity", 12)] * jumps


@SIDES
def test_a_position_jumps_whatever_limits_of_acceleration_say(side: int) -> None:
    q = np.where(np.arange(COUNT) < 12, 0.0, side * 1e-3)
    limits = replace(unlimited(1), acceleration=np.array([[-1e3, 1e3]]))
    found = inconsistent(rows(q, np.zeros(COUNT)), limits)
    assert [(each.kind, each.quantity, each.row) for each in found] == [("jump", "position", 12)]


@SIDES
def test_two_rows_that_say_nothing_else_are_a_motion_that_is_too_fast(side: int) -> None:
    """2 rad in 1 s, where 1.5 rad/s are allowed; a column of velocities that says rest makes it a jump."""
    q, t, still = np.array([0.0, side * 2.0]), np.array([0.0, 1.0]), np.zeros(2)
    limits = replace(unlimited(1), velocity=np.array([[-1.5, 1.5]]))
    judgement = judge_motion(lambda: [rows(q, t=t)], Requirements(bare_robot(limits)))
    assert [(each.kind, each.value) for each in judgement.errors] == [("velocity", side * 2.0)]
    assert [each.kind for each in inconsistent(rows(q, still, t=t), limits)] == ["jump"]
    three = rows(np.array([0.0, side * 2.0, side * 2.0]), t=np.arange(3.0))
    assert [each.kind for each in inconsistent(three, limits)] == ["jump"]


@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.3, True)])
def test_values_in_single_precision_are_rounded_by_a_share_of_each(share: float, broken: bool) -> None:
    """At 100 rad by 6e-6 in turns, up and down; the rate is zero throughout."""
    q = 100.0 * (1.0 + share * 2.0**-24 * (-1.0) ** np.arange(COUNT))
    motion = rows(q, np.zeros(COUNT))
    motion = replace(motion, resolution=replace(motion.resolution, relative=(2.0**-24,) * 3))
    assert [each.kind for each in inconsistent(motion)] == (["derivative"] if broken else [])


@pytest.mark.parametrize(("off", "broken"), [(0.45e-12, False), (0.7e-12, True)])
def test_a_joint_that_rests_may_be_off_by_a_picoradian(off: float, broken: bool) -> None:
    q = off * (-1.0) ** np.arange(COUNT)
    assert [each.kind for each in inconsistent(rows(q, np.zeros(COUNT)))] == (
        ["derivative"] if broken else []
    )


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(0.9e-3, False), (1.4e-3, True)])
def test_of_a_column_its_peak_counts_not_where_it_is_slow(share: float, broken: bool, side: int) -> None:
    """From rest to 1 rad/s at one acceleration; the column is off by a thousandth of that everywhere."""
    rate = DENSE / DENSE[-1]
    q = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(DENSE)))
    found = inconsistent(rows(side * q, side * (rate + share)))
    assert [each.kind for each in found] == (["derivative"] if broken else [])


def moved_by(qd: np.ndarray) -> np.ndarray:
    """Return positions that go with velocities."""
    return np.append(0.0, np.cumsum(0.5 * (qd[1:] + qd[:-1]) * np.diff(DENSE)))


@SIDES
def test_a_velocity_that_steps_within_its_limits_beside_wrong_accelerations_does_not_jump(side: int) -> None:
    """The column of accelerations says 30 throughout: it is that column which is wrong, in all intervals."""
    qd = np.where(np.arange(COUNT) < 12, 0.0, side * 0.1)
    limits = replace(unlimited(1), acceleration=np.array([[-1e3, 1e3]]))
    found = inconsistent(rows(moved_by(qd), qd, np.full(COUNT, side * 30.0)), limits)
    assert [(each.kind, each.quantity) for each in found] == [("derivative", "acceleration")]


@SIDES
def test_beside_an_acceleration_of_one_row_a_velocity_that_hardly_changes_does_not_jump(side: int) -> None:
    qd, qdd = np.where(np.arange(COUNT) < 12, 0.0, side * 1e-6), np.zeros(COUNT)
    qdd[12] = side * 50.0
    assert [each.kind for each in inconsistent(rows(moved_by(qd), qd, qdd))] == []


@SIDES
@pytest.mark.parametrize(("rate", "jumps"), [(0.0, True), (9.0, False)])
def test_a_step_of_a_position_that_its_velocity_says_is_no_jump(rate: float, jumps: bool, side: int) -> None:
    """It is over the limit of velocity, and the velocity in the row behind it says even more."""
    q, qd = np.where(np.arange(COUNT) < 12, 0.0, side * 1e-2), np.zeros(COUNT)
    qd[12] = side * rate
    limits = replace(unlimited(1), velocity=np.array([[-0.5, 0.5]]))
    assert [each.kind for each in inconsistent(rows(q, qd), limits)] == ["jump"] * jumps


@SIDES
def test_of_jumps_in_both_directions_the_larger_one_is_named(side: int) -> None:
    q = np.zeros(COUNT)
    q[6:], q[16:] = side * 1e-3, -side * 1e-3
    (found,) = inconsistent(rows(q, np.zeros(COUNT)))
    assert (found.kind, found.row, found.count) == ("jump", 16, 2)
    assert found.value == pytest.approx(-side * 2e-3)


class _KnownTool:
    """A tool that jumps where the joint jumps downwards, and notes what it is asked."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self.asked: list[tuple[list[float], int]] = []

    def see(self, *_: object, **__: object) -> None:
        pass

    def findings(self) -> list[Finding]:
        return []

    def changes_branch(self, q: np.ndarray, jump: int) -> bool:
        self.asked.append((q[:, 0].tolist(), jump))
        return bool(q[jump + 1, 0] > q[jump, 0])


@pytest.mark.parametrize("first", [1, 2, 8])
def test_where_the_tool_does_not_jump_with_a_joint_it_is_the_branch_that_changes(first: int) -> None:
    """The row before the jump and the one behind it are compared with those beside them."""
    q = 1e-4 * np.arange(float(COUNT))
    q[first:] += 1.0
    q[16:] -= 0.7
    tool = _KnownTool()
    tool.notes.append("what cannot be judged")
    motion = rows(q, np.gradient(1e-4 * np.arange(COUNT), DENSE))
    known: Any = tool
    judged = judge_motion(lambda: [motion], Requirements(bare_robot(unlimited(1)), tool=lambda: known))
    found = [(each.kind, each.row) for each in judged.findings if each.kind in ("jump", "branch")]
    assert sorted(found) == [("branch", first), ("jump", 16)]
    low = max(first - 2, 0)
    assert (q[low : first + 2].tolist(), first - 1 - low) in tool.asked
    assert (q[14:18].tolist(), 1) in tool.asked
    assert judged.notes == ("what cannot be judged",)
