"""Which intervals of rows are judged: all in which what joins the rows is not the planned curve, with what the rows state."""

from __future__ import annotations

from dataclasses import replace
from math import factorial
from typing import Any

import numpy as np
import pytest
from made_plans import arm, made_plan
from tiers import few

from trajcli.curves.hermite import hermite_coefficients
from trajcli.grids import Grid, KnotGrid, ListedGrid, UniformGrid
from trajcli.kinematics.robot import Joint, unlimited
from trajcli.output.delivery import joined_rows as module
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.samples import sample
from trajcli.units import Units

GROUPS = ("q", "qd", "qdd")
RATE = 40.0
TIGHT = np.tile([-1e-9, 1e-9], (2, 1))
ROBOT = replace(
    arm(Joint("turn", a=0.3), Joint("out", type="prismatic")),
    limits=replace(unlimited(2), velocity=TIGHT, acceleration=TIGHT, jerk=TIGHT),
)


def made_curve(rng: np.random.Generator, degree: int, joint: int) -> tuple[list[float], np.ndarray]:
    """Return lengths and coefficients of pieces whose breaks lie on rows or beside them, where a derivative steps or none.

    One joint moves by them; the other is one polynomial throughout, of degree 1.
    """
    lengths, rows = [], [rng.uniform(-1, 1, degree + 1)]
    for k in range(int(rng.integers(2, 6))):
        kind = rng.integers(4)
        on_row = np.ceil(sum(lengths) * RATE + 1e-6) / RATE - sum(lengths) + rng.integers(0, 8) / RATE
        lengths.append(float(on_row if kind < 2 else rng.uniform(0.03, 0.3) if kind < 3 else 4e-10))
        if k:
            states = [
                np.polyval(np.polyder(rows[-1], i), lengths[-2]) / factorial(i) for i in range(degree + 1)
            ]
            kept = int(rng.integers(1, degree + 2))  # derivatives that go on
            states[kept:] = rng.uniform(-1, 1, degree + 1 - kept)
            rows.append(np.array(states[::-1]))
    coefficients = np.zeros((degree + 1, len(rows), 2))
    coefficients[:, :, joint] = np.array(rows).T
    coefficients[-1, :, 1 - joint] = 0.3 * np.append(0.0, np.cumsum(lengths[:-1])) - 1.0
    coefficients[-2, :, 1 - joint] = 0.3
    return lengths, coefficients


def made_grid(rng: np.random.Generator, plan: Any, kind: str) -> Grid:
    duration, curve = plan.trajectory.duration, plan.trajectory.curve
    uniform = UniformGrid(duration, RATE, 3.0)
    if kind == "uniform":
        return uniform
    local = np.append(uniform.local(0, uniform.count - 1), duration)
    if kind == "listed":
        others = rng.uniform(0, duration, 5)
        kept = [t for t in others if np.abs(t - local).min() > 1e-6]
        return ListedGrid(duration, 3.0 + np.unique([*local, *kept]), 3.0)
    at = np.unique(rng.integers(0, local.size, 3))
    states = np.stack([curve.evaluate(np.minimum(local[at], curve.end), order) for order in range(3)])
    states[0] += 1e-3 * (rng.random((at.size, 1)) < 0.7)
    return KnotGrid(duration, local, at, states, 3.0)


def intervals_that_differ(plan: Any, times: np.ndarray, rows: np.ndarray) -> set[int]:
    """Return the intervals in which the polynomials through rows (N, stated, n) are not the curve."""
    curve, lengths = plan.trajectory.curve, np.diff(times)
    states = np.moveaxis(rows, 1, 0)
    pieces = hermite_coefficients(states[:, :-1], states[:, 1:], lengths[:, None])
    found = set()
    for k, (begin, length) in enumerate(zip(times[:-1].tolist(), lengths.tolist(), strict=True)):
        t = length * np.linspace(0.02, 0.98, 49)
        other = np.stack([np.polyval(row, t) for row in pieces[:, k].T], axis=1)
        if np.abs(other - curve.evaluate(begin + t)).max() > 1e-10:
            found.add(k)
    return found


@pytest.mark.parametrize("kind", ["uniform", "listed", "knots"])
@pytest.mark.parametrize("stated", [1, 2, 3])
@pytest.mark.parametrize("seed", few(range(24), 5))
def test_every_interval_that_is_not_the_planned_curve_is_judged(
    seed: int, stated: int, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ROWS", 16)
    monkeypatch.setattr(module, "_JUDGED", 5)
    rng = np.random.default_rng([seed, stated, len(kind)])
    for degree in range(2 * stated - 1, 8, 2):
        lengths, coefficients = made_curve(rng, degree, int(rng.integers(2)))
        moves = [(1, ROBOT, None), (len(lengths) - 1, ROBOT, None)]
        plan = made_plan(lengths, coefficients, moves, units=Units(length="mm"))
        grid = made_grid(rng, plan, kind)
        groups = (*GROUPS[:stated], "move")
        table = np.concatenate([*sample(plan.trajectory, grid, groups, robot=ROBOT)])
        times = np.concatenate([local for _, local in grid.blocks()])
        states = table[:, :-1].reshape(times.size, stated, 2)
        joined = JoinedRows(plan, grid, ("t", *groups), exact=bool(seed % 2))
        chosen = joined.interpolation
        assert chosen == ("linear", "cubic", "quintic")[stated - 1]
        seen: list[int] = []
        for window in joined._windows(chosen):
            index = np.asarray(window.rows) - 1
            seen += index.tolist()
            assert np.array_equal(window.begun, times[index])
            assert window.lengths == pytest.approx(np.diff(times)[index], rel=1e-9)
            for side, rows in enumerate((index, index + 1)):
                assert np.abs(np.moveaxis(states[rows], 1, 0) - window.stated[:, side]).max() < 1e-12
            assert np.array_equal(window.moves, table[index, -1])
            assert np.array_equal(window.moves_after, table[index + 1, -1])
            rounding = [0.0, 0.0] if seed % 2 else [0.5e-9, 0.5e-12]
            for of_order in (window.resolution.q, window.resolution.qd, window.resolution.qdd):
                assert of_order == pytest.approx(rounding)
        assert len(seen) == len({*seen})
        assert intervals_that_differ(plan, times, states) <= {*seen}, (lengths, degree)
        assert joined.same_curve == (not seen)


@pytest.mark.parametrize("stated", [2, 3])
def test_where_all_is_one_polynomial_nothing_is_judged(stated: int) -> None:
    """Breaks on rows at which no derivative that rows state steps, of the degree that they determine."""
    rng, degree = np.random.default_rng(1), 2 * stated - 1
    row = rng.uniform(-1, 1, degree + 1)
    later = [np.polyval(np.polyder(row, i), 0.5) / factorial(i) for i in range(degree + 1)][::-1]
    later[0] += 0.5  # the highest derivative steps
    later = np.array(later)
    coefficients = np.stack([row, later], axis=1)[:, :, None] * [1.0, -2.0]
    plan = made_plan([0.5, 0.5], coefficients, [(1, ROBOT, None), (1, ROBOT, None)])
    joined = JoinedRows(plan, UniformGrid(1.0, RATE), ("t", *GROUPS[:stated]))
    assert joined.same_curve
    judged = joined.judgement()
    assert judged is not None
    assert (judged.findings, judged.rows) == ((), 41)
