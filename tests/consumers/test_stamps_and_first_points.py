"""What is said of stamps and of first points: numbers, words and hints of findings, and why a rule is not judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_faults import HOME, judged, motion

from trajcli.consumers.rule_check import Surroundings
from trajcli.findings import Finding
from trajcli.kinematics.robot import Limits
from trajcli.streams.recorded_motion import RecordedMotion

FREE = np.tile([-np.inf, np.inf], (7, 1))


def told(rows: RecordedMotion, profile: str, rule: str, around: Surroundings | None = None) -> Finding | None:
    """Return what breaks one rule, in whatever blocks the rows come; None where it is kept."""
    found = [each for each in judged(rows, profile, around).findings if each.rule == rule]
    assert len(found) < 2
    return found[0] if found else None


@pytest.mark.parametrize(
    ("step", "words", "hint"),
    [
        (0.0, "repeats the stamp before it, in whole units of 1e-09 s", "leave one of the two rows out"),
        (-0.25, "stands 0.25 s before it, in whole units of 1e-09 s", "sort the rows by time"),
    ],
)
def test_a_stamp_that_does_not_increase_is_told_by_how_much(step: float, words: str, hint: str) -> None:
    rows = motion(period=0.1, rows=21)
    t = rows.t.copy()
    t[9] = t[8] + step
    found = told(replace(rows, t=t), "ros-jtc", "jtc-increasing-times")
    assert found is not None
    assert (found.row, found.value, found.limit) == (10, pytest.approx(step, abs=1e-12), 1e-9)
    assert found.message.endswith(words)
    assert found.hint == hint


@pytest.mark.parametrize("late", [2e-4, -3e-4])
def test_a_row_beside_its_period_is_told_its_distance_and_the_rate(late: float) -> None:
    rows = motion(rows=21)
    t = rows.t.copy()
    t[12:] += late
    found = told(replace(rows, t=t), "franka-fr3", "fr3-period")
    assert found is not None
    assert (found.row, found.value, found.limit, found.count) == (13, pytest.approx(1e-3 + late), 1e-3, 1)
    assert f"stands {1e-3 + late:.9g} s after the one before it, and the period is 0.001 s" in found.message
    assert "at 1000 Hz" in (found.hint or "")
    assert "{rate: 1000, align: true}" in (found.hint or "")


@pytest.mark.parametrize(("off", "broken"), [(0.9e-9, False), (1.1e-9, True)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_clock_that_counts_whole_nanoseconds_is_at_its_period(
    off: float, side: float, *, broken: bool
) -> None:
    """Of stamps that are exact one nanosecond is none beside the period."""
    rows = motion(rows=21)
    rows = replace(rows, resolution=replace(rows.resolution, time=0.0))
    t = rows.t.copy()
    t[12:] += side * off
    assert (told(replace(rows, t=t), "franka-fr3", "fr3-period") is not None) == broken


@pytest.mark.parametrize("decimals", [3, 4, 9])
def test_stamps_of_few_decimals_hide_no_missing_row(decimals: int) -> None:
    """In milliseconds two neighbours may be off by a whole period: the one that is not there is told all the same."""
    rows = motion(rows=21)
    rows = replace(rows, resolution=replace(rows.resolution, time=0.5 * 10.0**-decimals))
    assert told(rows, "franka-fr3", "fr3-period") is None
    part = {name: np.delete(getattr(rows, name), 12, axis=0) for name in ("t", "q", "qd", "qdd")}
    found = told(replace(rows, **part), "franka-fr3", "fr3-period")
    assert found is not None
    assert (found.row, found.value) == (13, pytest.approx(2e-3))


def test_the_row_that_is_furthest_beside_its_period_is_told() -> None:
    """One interval of half of it is worse than one that lasts a tenth longer."""
    rows = motion(rows=21)
    periods = np.full(20, 1e-3)
    periods[[4, 9]] = 1.1e-3, 0.5e-3
    found = told(replace(rows, t=np.append(0.0, np.cumsum(periods))), "franka-fr3", "fr3-period")
    assert found is not None
    assert (found.row, found.count) == (11, 2)


@pytest.mark.parametrize("part", [0.3, -0.4])
def test_a_segment_is_told_what_it_becomes_in_whole_units(part: float) -> None:
    """Of microseconds a part is lost, of the tenth row; 1e-3 of one, and what float64 rounds, are allowed."""
    rows = motion(6, 0.1, 21)
    t = rows.t.copy()
    t[9:] += part * 1e-6
    found = told(replace(rows, t=t), "ur-passthrough", "passthrough-whole-microseconds")
    assert found is not None
    assert (found.row, found.kind, found.count) == (10, "quantisation", 1)
    assert found.value == pytest.approx(abs(part) * 1e-6, rel=1e-6)
    assert found.limit == pytest.approx(1e-9 + 4 * np.spacing(t[9]), rel=1e-12)
    assert f"lasts {0.1 + part * 1e-6:.12g} s, which becomes 0.1 s in whole units of 1e-06 s" in found.message
    assert found.hint == "put points at whole multiples of 1e-06 s"


def test_a_segment_that_becomes_zero_is_told_what_to_leave_out() -> None:
    rows = motion(6, 0.1, 21)
    t = rows.t.copy()
    t[9] = t[8] + 4e-7
    found = told(replace(rows, t=t), "ur-passthrough", "passthrough-durations")
    assert found is not None
    assert (found.row, found.kind, found.limit) == (10, "time", 1e-6)
    assert found.value == pytest.approx(4e-7)
    assert found.message.endswith(" s, which becomes 0 s in whole units of 1e-06 s")
    assert found.hint == "leave one of the two points out"


@pytest.mark.parametrize("latest", [12, 20])
def test_of_stamps_that_are_too_late_the_latest_is_the_value_wherever_it_stands(latest: int) -> None:
    """Rows that are not sorted, in one block and in several."""
    rows = motion(6, 0.1, 21)
    t = rows.t.copy()
    t[10:] += 2147.0
    t[latest] += 50.0
    found = told(replace(rows, t=t), "ur-passthrough", "passthrough-longest")
    assert found is not None
    assert (found.row, found.value, found.count) == (11, t[latest], 11)


@pytest.mark.parametrize("joint", [0, 4, 5])
def test_a_first_point_is_as_near_as_the_decimals_of_its_joint_tell(joint: int) -> None:
    """It is 1e-5 beside where the arm stands; of the fifth joint four decimals are known, of the others more."""
    rows = motion(period=0.1, rows=21)
    coarse = np.where(np.arange(7) == 4, 5e-5, 1e-8 * np.arange(1, 8))
    rows = replace(rows, resolution=replace(rows.resolution, q=coarse))
    around = Surroundings(rows.joints, HOME[7] - 1e-5 * np.eye(7)[joint])
    found = told(rows, "ros-jtc", "jtc-first-point", around)
    assert (found is None) == (joint == 4)
    if found is not None:
        assert (found.joint, found.value) == (f"joint_{joint + 1}", pytest.approx(1e-5))
        assert found.limit == pytest.approx(1e-6 + coarse[joint])


def test_a_first_point_is_not_judged_where_the_arm_is_another_or_its_limits_are_unknown() -> None:
    rows = motion(period=0.1, rows=21)
    for around, later, why in (
        (Surroundings(rows.joints, HOME[6]), 0.0, "where the arm stands before is not known"),
        (Surroundings(rows.joints), 0.0, "where the arm stands before is not known"),
        (Surroundings(rows.joints, HOME[7]), 1.0, "the limits of the robot are not known"),
    ):
        unjudged = dict(judged(replace(rows, t=rows.t + later), "ros-jtc", around).unjudged)
        assert unjudged.keys() == {"jtc-first-point"}
        assert unjudged["jtc-first-point"].startswith(why)


@pytest.mark.parametrize("span", [0.5, 0.005])
@pytest.mark.parametrize("worse", ["velocity", "acceleration"])
def test_of_limits_on_the_curve_to_the_first_point_the_one_that_is_passed_further_is_told(
    worse: str, span: float
) -> None:
    """A quintic over 0.2 rad: 15/8 D / T and 10 / sqrt(3) D / T^2; one is 1.1 times its limit, one 1.3 times."""
    rows = motion(period=0.1, rows=21)
    size = {"velocity": 15 / 8 * 0.2 / span, "acceleration": 10 / 3**0.5 * 0.2 / span**2}
    bound = {name: value / (1.3 if name == worse else 1.1) for name, value in size.items()}
    rates = [np.tile([-each, each], (7, 1)) for each in bound.values()]
    around = Surroundings(rows.joints, HOME[7] - 0.2 * np.eye(7)[2], Limits(FREE, *rates, FREE))
    found = told(replace(rows, t=rows.t + span), "ros-jtc", "jtc-first-point", around)
    assert found is not None
    assert (found.kind, found.joint, abs(found.value)) == (worse, "joint_3", pytest.approx(size[worse]))
    side = np.sign(found.value)
    unit = {"velocity": "rad/s", "acceleration": "rad/s^2"}[worse]
    assert f"reaches {side * size[worse]:.6g} {unit} at t = " in found.message
    assert found.message.endswith(f"its limit is {side * bound[worse]:.6g}")


def test_a_limit_of_zero_is_one_on_the_curve_to_the_first_point() -> None:
    rows = motion(period=0.1, rows=21)
    position = FREE.copy()
    position[2, 0] = 0.0
    around = Surroundings(rows.joints, HOME[7] - 0.2 * np.eye(7)[2], Limits(position, FREE, FREE, FREE))
    found = told(replace(rows, t=rows.t + 0.5), "ros-jtc", "jtc-first-point", around)
    assert found is not None
    assert (found.kind, found.joint, found.value, found.limit) == ("position", "joint_3", -0.2, 0.0)
