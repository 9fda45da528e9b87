"""Accelerations of rows without velocities: no curve has them, and what a row states counts all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_rows import judged

import trajcli
from trajcli.findings import Finding
from trajcli.judge import motion as judge_of_motions
from trajcli.kinematics.robot import Limits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

T = 0.1 * np.arange(600.0)  # more rows than are seen at once


def stated(accelerations: np.ndarray, rounding: float = 0.0) -> RecordedMotion:
    """Return rows of joints that stand, with accelerations (N, n) and no velocities."""
    n = accelerations.shape[1]
    exact = np.zeros(n)
    resolution = Resolution(0.0, exact, exact, exact + rounding)
    q = np.zeros_like(accelerations)
    return RecordedMotion(T[: len(q)], q, None, accelerations, None, None, None, None, resolution, "rows")


def limits_of(*pairs: tuple[float, float]) -> Limits:
    return replace(unlimited(len(pairs)), acceleration=np.array(pairs))


def over(found: tuple[Finding, ...]) -> list[tuple[object, ...]]:
    """Return joint, value, limit, row, count and factor of what is over a limit."""
    return [(f.joint, f.value, f.limit, f.row, f.count, f.factor) for f in found if f.rule == "limit"]


@pytest.mark.parametrize("blocks", [None, 100])
def test_each_row_counts_once_and_the_worst_of_each_joint_is_named(
    blocks: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also the first row and the last one, and those at which blocks meet."""
    monkeypatch.setattr(judge_of_motions, "_FIRST_ROWS", 50)
    a = np.zeros((len(T), 2))
    a[:, 0], a[:, 1] = 3.0, 1.0
    a[-1, 0], a[300, 1] = 8.0, -4.0
    found = judged(stated(a), limits_of((-1.0, 2.0), (-2.0, 5.0)), blocks).findings
    assert sorted(over(found)) == [
        ("j1", 8.0, 2.0, 600, 600, pytest.approx(2.0)),  # in twice the time a quarter
        ("j2", -4.0, -2.0, 301, 1, pytest.approx(np.sqrt(2))),
    ]


def test_limits_are_kept_up_to_themselves() -> None:
    a = np.tile([2.0, -2.0], (3, 1))
    assert over(judged(stated(a), limits_of((-1.0, 2.0), (-2.0, 5.0))).findings) == []
    assert len(over(judged(stated(a * 1.001), limits_of((-1.0, 2.0), (-2.0, 5.0))).findings)) == 2


@pytest.mark.parametrize(("rounding", "certainty"), [(0.2, "within rounding"), (0.05, "exceeded")])
def test_what_rounding_explains_is_no_error(rounding: float, certainty: str) -> None:
    found = judged(stated(np.full((3, 1), 2.1), rounding), limits_of((-2.0, 2.0))).findings
    assert [f.certainty for f in found if f.rule == "limit"] == [certainty]


def test_nobody_asks_about_them_who_asks_for_a_curve() -> None:
    """Nor are they those of a curve that has them."""
    rows, limits = stated(np.full((3, 1), 3.0)), limits_of((-2.0, 2.0))
    assert over(judged(rows, limits, interpolate="linear").findings) == []
    assert over(judged(replace(rows, qdd=None), limits).findings) == []
    with_velocities = replace(rows, q=1.5 * T[:3, None] ** 2, qd=3.0 * T[:3, None])
    (found,) = over(judged(with_velocities, limits).findings)
    assert found[:3] == ("j1", pytest.approx(3.0), 2.0)


def test_arrays_are_judged_likewise() -> None:
    judgement = trajcli.check(
        [0, 1, 2], np.zeros((3, 1)), qdd=np.full((3, 1), 3.0), limits={"acceleration": 2.0}
    )
    assert judgement.verdict == "exceeded"
    assert (
        trajcli.check([0, 1], [[0], [0]], qdd=[[2], [-2]], limits={"acceleration": 2.0}).verdict
        == "satisfied"
    )
