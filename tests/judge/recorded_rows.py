"""Recordings to judge: rows of motions that keep their limits, and the same with one fault planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.judge.judgement import Judgement
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.streams.recorded_motion import RecordedMotion, Resolution


def bare_robot(limits: Limits) -> Robot:
    """Return joints j1, j2, ... without geometry."""
    joints = tuple(Joint(f"j{k + 1}") for k in range(len(limits.position)))
    return Robot("bare", joints, limits, None, np.eye(4), np.eye(4))


def rows_of(
    curve: PiecewisePolynomial,
    period: float,
    orders: int = 3,
    decimals: int | None = None,
    time_decimals: int | None = None,
) -> RecordedMotion:
    """Return the rows of a curve at a period, and one at its end, written with some decimals."""
    count = int(np.floor(curve.duration / period * (1 + 1e-12)))
    t = curve.start + period * np.arange(count + 1)
    if t[-1] < curve.end - 1e-9 * period:
        t = np.append(t, curve.end)
    states = curve.evaluate_orders(np.clip(t, curve.start, curve.end), (0, 1, 2))
    n = curve.dimension
    off = np.full(n, 0.0 if decimals is None else 0.5 * 10.0**-decimals)
    written = [states[:, k] if decimals is None else np.round(states[:, k], decimals) for k in range(orders)]
    written += [None] * (3 - orders)
    places = decimals if time_decimals is None else time_decimals
    late = 0.0 if places is None else 0.5 * 10.0**-places
    resolution = Resolution(late, off, off, off)
    stamps = t if places is None else np.round(t, places)
    return RecordedMotion(stamps, *written, None, None, None, None, resolution, "rows")


def rounded_rows(t: np.ndarray, states: list[np.ndarray], decimals: int) -> RecordedMotion:
    """Return rows of one joint by its states (N,) at exact times, written with some decimals."""
    half = np.full(1, 0.5 * 10.0**-decimals)
    written = [*(np.round(values, decimals)[:, None] for values in states), *[None] * (3 - len(states))]
    return RecordedMotion(t, *written, None, None, None, None, Resolution(0.0, half, half, half), "rows")


def judged(motion: RecordedMotion, limits: Limits, blocks: int | None = None, **asked: object) -> Judgement:
    """Return the judgement of rows by limits, given whole or in blocks of some rows."""
    size = blocks or len(motion.t)
    parts = [part(motion, slice(low, low + size)) for low in range(0, len(motion.t), size)]
    return judge_motion(lambda: parts, Requirements(bare_robot(limits), **asked))


def part(motion: RecordedMotion, rows: slice) -> RecordedMotion:
    """Return some rows of a motion."""
    names = ("t", "q", "qd", "qdd", "move")
    some = {name: None if getattr(motion, name) is None else getattr(motion, name)[rows] for name in names}
    return replace(motion, **some, first_row=motion.first_row + (rows.start or 0))
