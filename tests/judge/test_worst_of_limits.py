"""Which of several offences is named, with which value, where rows and the curve between them say different things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_rows import bare_robot

from trajcli.findings import Finding
from trajcli.judge import joint_limits
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Limits, unlimited
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
    ways = np.full(12, 1.0)
    ways[worst] = 1.2
    motion = motion_of(side * np.append(0.0, np.cumsum(ways)), np.zeros(13), t=np.arange(13.0))
    (found,) = over(motion, bounded("velocity", *sorted([side * 1.4, -side * 9.0])), "cubic")
    assert found.count == 12
    assert found.value == pytest.approx(side * 1.8, rel=1e-9)
    assert found.time == pytest.approx(worst + 0.5, abs=1e-9)
