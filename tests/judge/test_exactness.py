"""Exact judgement of random rows against dense samples of an independent interpolant, locally refined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from recorded_rows import judged
from scipy.interpolate import BPoly, PPoly
from scipy.optimize import minimize_scalar
from tiers import few

from trajcli.kinematics.robot import Limits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

KINDS = ("position", "velocity", "acceleration", "jerk")
ORDERS = {"linear": 1, "cubic": 2, "quintic": 3}
DENSE = 200


def random_rows(rng: np.random.Generator, stated: int, joints: int) -> RecordedMotion:
    """Return rows of random states at random times: a random piecewise polynomial, unlike any motion."""
    count = int(rng.integers(2, 12))
    t = np.cumsum(np.exp(rng.uniform(np.log(0.02), np.log(2.0), count)))
    states = [rng.normal(size=(count, joints)) * 10.0 ** rng.uniform(-1, 1) for _ in range(stated)]
    nothing = np.zeros(joints)
    exact = Resolution(0.0, nothing, nothing, nothing)
    return RecordedMotion(t, *states, *[None] * (3 - stated), None, None, None, None, exact, "random")


def polynomials(motion: RecordedMotion, joint: int, stated: int) -> PPoly:
    """Return scipy's interpolant of the rows of one joint."""
    known = [rows[:, joint] for rows in (motion.q, motion.qd, motion.qdd)[:stated]]
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(motion.t, np.stack(known, axis=1)))


def sampled_extremes(curve: PPoly, order: int) -> tuple[float, float]:
    """Return the lowest and the highest value that is found with dense samples and both sides of breaks."""
    derivative = curve.derivative(order) if order else curve
    found: list[float] = []
    for k, (low, high) in enumerate(zip(curve.x[:-1], curve.x[1:], strict=True)):
        piece = np.poly1d(derivative.c[:, k])
        local = np.linspace(0.0, high - low, DENSE)
        values = piece(local)
        found += [values.min(), values.max()]
        for sign, best in ((1.0, int(values.argmin())), (-1.0, int(values.argmax()))):
            around = (local[max(best - 1, 0)], local[min(best + 1, DENSE - 1)])
            result = minimize_scalar(
                lambda x, piece=piece, sign=sign: sign * piece(x),
                bounds=around,
                method="bounded",
                options={"xatol": 1e-14},
            )
            found.append(float(piece(result.x)))
    return min(found), max(found)


def tight(extremes: np.ndarray, share: np.ndarray) -> Limits:
    """Return limits, each a share of the largest magnitude of its quantity and joint, (orders, joints)."""
    rows = np.full((4, extremes.shape[1], 2), (-np.inf, np.inf))
    size = np.abs(extremes).max(axis=2) * share
    rows[: len(size)] = np.stack([-size, size], axis=2)
    return Limits(*rows)


@pytest.mark.parametrize("seed", few(range(60)))
def test_the_judgement_is_that_of_dense_samples(seed: int) -> None:
    """Never less severe, and at most 1e-9 more."""
    rng = np.random.default_rng(seed)
    asked = ("linear", "cubic", "quintic")[seed % 3]
    stated, joints = ORDERS[asked], int(rng.integers(1, 4))
    motion = random_rows(rng, stated, joints)
    curves = [polynomials(motion, joint, stated) for joint in range(joints)]
    extremes = np.array([[sampled_extremes(curve, order) for curve in curves] for order in range(stated + 1)])
    share = rng.uniform(0.5, 1.2, extremes.shape[:2])
    judgement = judged(motion, tight(extremes, share), interpolate=asked)
    found = {(each.kind, each.joint): each for each in judgement.findings if each.rule == "limit"}
    for order in range(stated + 1):
        for joint in range(joints):
            worst = np.abs(extremes[order, joint]).max()
            finding = found.pop((KINDS[order], f"j{joint + 1}"), None)
            if share[order, joint] > 1:
                assert finding is None
                continue
            assert finding is not None
            assert finding.certainty == "exceeded"
            assert finding.severity == "error"
            assert abs(finding.value) >= worst * (1 - 1e-12)
            assert abs(finding.value) <= worst * (1 + 1e-9)
            at = curves[joint](finding.time, order) if order < stated else None
            if at is not None:
                assert at == pytest.approx(finding.value, rel=1e-6, abs=1e-9)
    assert not found


@pytest.mark.soak
@pytest.mark.parametrize("block", range(10))
def test_the_judgement_is_that_of_dense_samples_at_length(block: int) -> None:
    for seed in range(100):
        test_the_judgement_is_that_of_dense_samples(1000 + 100 * block + seed)


@pytest.mark.parametrize("seed", few(range(24)))
def test_rows_at_a_period_of_many_digits_keep_limits_that_the_motion_has(seed: int) -> None:
    """Stamps of six decimals say the period to some nanoseconds: what that makes of accelerations is rounding."""
    random = np.random.default_rng(seed)
    count, duration = int(random.integers(20, 300)), random.uniform(0.5, 3.0)
    x = np.linspace(0.0, 1.0, count)
    states = [10 * x**3 - 15 * x**4 + 6 * x**5, 30 * (x - x * x) ** 2, 60 * x * (1 - x) * (1 - 2 * x)]
    rows = [np.round(values / duration**k, 9)[:, None] for k, values in enumerate(states)]
    off = np.full(1, 0.5e-9)
    t, resolution = np.round(duration * x, 6), Resolution(0.5e-6, off, off, off)
    motion = RecordedMotion(t, *rows, None, None, None, None, resolution, "rows")
    peaks = 15 / 8 / duration, 10 / 3**0.5 / duration**2, 60 / duration**3
    for share, certain in ((1.0, False), (0.98, True)):
        bounds = {
            name: share * peak * np.array([[-1.0, 1.0]])
            for name, peak in zip(("velocity", "acceleration", "jerk"), peaks, strict=True)
        }
        judgement = judged(motion, replace(unlimited(1), **bounds), interpolate="quintic")
        assert (judgement.verdict == "exceeded") == certain


@pytest.mark.parametrize("count", [41, 75, 118])
def test_rows_are_missing_at_a_period_of_many_digits(count: int) -> None:
    """Where half of the rows are missing the interval may be off by as much as all others together."""
    off, period = np.full(1, 0.5e-9), 0.004421159
    for k in few(range(4, count // 2), 10):
        index = np.delete(np.arange(count), np.arange(k, k + count // 2))
        t = np.round(period * index, 6)
        q, resolution = np.round(period * index, 9)[:, None], Resolution(0.5e-6, off, off, off)
        motion = RecordedMotion(t, q, *6 * [None], resolution, "rows")
        for limit, certain in ((1.0, False), (0.999, True)):
            bounds = replace(unlimited(1), velocity=np.array([[-limit, limit]]))
            assert (judged(motion, bounds).verdict == "exceeded") == certain


@pytest.mark.parametrize(
    ("period", "decimals", "first"), [(0.004421159, 6, 0.0), (0.004421159, 6, 0.2e-6), (1 / 24, 3, -0.4e-3)]
)
@pytest.mark.parametrize("count", [13, 299])
def test_of_a_last_row_beside_the_period_both_stamps_are_rounded(
    count: int, period: float, decimals: int, first: float
) -> None:
    """All that is not known of the period, times the rows before it, and of where the rows begin."""
    late = 0.5 * 10.0**-decimals
    for beside in few(np.linspace(0.05, 0.95, 40), 12):
        t = first + period * np.append(np.arange(count), count - 1 + beside)
        for share, certain in ((1.0, False), (1.02 + 4 * late / (beside * period), True)):
            q = np.append(t[:-1], t[-2] + share * (t[-1] - t[-2]))[:, None]
            resolution = Resolution(late, *(np.full(1, 1e-12) for _ in range(3)))
            motion = RecordedMotion(np.round(t, decimals), q, *6 * [None], resolution, "rows")
            bounds = replace(unlimited(1), velocity=np.array([[-1.0, 1.0]]))
            if certain and 4 * late > 0.5 * beside * period:
                continue
            assert (judged(motion, bounds).verdict == "exceeded") == certain
