"""Motions that each consumer accepts, to plant one fault in each.

They are closed forms: a quintic from rest to rest, sampled at the consumer's period, and rounded as a file is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tiers import QUICK

from trajcli.consumers.judgement import ProfileJudgement, judge_by_profile, load_profile
from trajcli.consumers.rule_check import Surroundings
from trajcli.findings import Finding
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

HOME = {
    6: np.array([0.0, -1.2, 1.1, 0.2, 0.4, 0.0]),
    7: np.array([0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.5]),
}
CHANGE = {
    6: np.array([0.5, 0.3, -0.4, 0.2, 0.1, 0.6]),
    7: np.array([0.5, 0.3, -0.4, 0.3, 0.2, 0.4, -0.5]),
}


def quintic(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return 10 u^3 - 15 u^4 + 6 u^5 and its first two derivatives."""
    return (
        10 * u**3 - 15 * u**4 + 6 * u**5,
        30 * u**2 - 60 * u**3 + 30 * u**4,
        60 * u - 180 * u**2 + 120 * u**3,
    )


def motion(
    joints: int = 7,
    period: float = 1e-3,
    rows: int = 1001,
    decimals: int | None = 12,
    columns: str = "q,qd,qdd",
) -> RecordedMotion:
    """Return the rows of a quintic over `period * (rows - 1)` seconds."""
    duration = period * (rows - 1)
    t = np.arange(rows) * period
    s, sd, sdd = (values[:, None] for values in quintic(np.arange(rows) / (rows - 1)))
    change = CHANGE[joints]
    states = [HOME[joints] + s * change, sd * change / duration, sdd * change / duration**2]
    half = 0.0
    if decimals is not None:
        states = [np.round(values, decimals) for values in states]
        half = 0.5 * 10.0**-decimals
    q, qd, qdd = (
        values if name in columns.split(",") else None
        for name, values in zip(("q", "qd", "qdd"), states, strict=True)
    )
    coarse = np.full(joints, half)
    resolution = Resolution(0.5e-9, coarse, coarse, coarse)
    names = tuple(f"joint_{index + 1}" for index in range(joints))
    return RecordedMotion(t, q, qd, qdd, None, None, None, names, resolution, "rows.csv")


def surroundings(joints: int) -> Surroundings:
    """Return what a job would say of the arm: its joints, and that it stands where the motion begins."""
    return Surroundings(tuple(f"joint_{index + 1}" for index in range(joints)), HOME[joints])


def with_value(rows: RecordedMotion, name: str, row: int, joint: int, change: float) -> RecordedMotion:
    """Return the motion with one number of one row changed."""
    values = getattr(rows, name).copy()
    values[row, joint] += change
    return replace(rows, **{name: values})


def blocks(rows: RecordedMotion, size: int) -> list[RecordedMotion]:
    """Return the same rows in blocks."""
    parts = []
    for low in range(0, rows.t.size, size):
        cut = {
            name: None if getattr(rows, name) is None else getattr(rows, name)[low : low + size]
            for name in ("t", "q", "qd", "qdd", "qddd", "tau", "move")
        }
        parts.append(replace(rows, **cut, first_row=rows.first_row + low))
    return parts


def judged(rows: RecordedMotion, profile: str, around: Surroundings | None = None) -> ProfileJudgement:
    """Return what a profile says of the motion, in one block and in blocks of several sizes alike."""
    around = around or surroundings(rows.q.shape[1])
    rules = load_profile(profile)
    whole = judge_by_profile([rows], rules, around)
    for size in (1, 7, 61, 333):
        if not size < rows.t.size <= size * (50 if QUICK else 1500):
            continue
        parts = judge_by_profile(blocks(rows, size), rules, around)
        assert parts.findings == whole.findings, size
    return whole


def only(judgement: ProfileJudgement) -> Finding:
    """Return the one breach that there is."""
    assert len(judgement.findings) == 1, [(each.rule, each.joint) for each in judgement.findings]
    return judgement.findings[0]
