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
        others = np.sort(rng.uniform(0, duration, 5))
        kept = [t for t in others[::2] if np.abs(t - local).min() > 1e-3]  # else the last bits are a jerk
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
@pytest.mark.parametrize("seed", few(range(24), 3))
def test_every_interval_that_is_not_the_planned_curve_is_judged(
    seed: int, stated: int, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ROWS", 16)
    monkeypatch.setattr(module, "_JUDGED", 5)
    monkeypatch.setattr(module, "_PIECES", 2)
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
        joined = JoinedRows(plan, grid, ("t", *groups), exact=bool(seed // 8 % 2))
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
            rounding = [0.0, 0.0] if seed // 8 % 2 else [0.5e-9, 0.5e-12]
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
    later[0] += 0.5  # the highest derivative steps, and of cubics the acceleration, which no row states
    if stated == 2:
        later[1] += 0.3
    later = np.array(later)
    coefficients = np.stack([row, later], axis=1)[:, :, None] * [1.0, -2.0]
    plan = made_plan([0.5, 0.5], coefficients, [(1, ROBOT, None), (1, ROBOT, None)])
    joined = JoinedRows(plan, UniformGrid(1.0, RATE), ("t", *GROUPS[:stated]))
    assert joined.same_curve
    judged = joined.judgement()
    assert judged is not None
    assert (judged.findings, judged.rows) == ((), 41)


@pytest.mark.parametrize(
    ("columns", "joints", "way"),
    [
        (("t", "q"), 2, "linear"),
        (("t", "q", "qd"), 2, "cubic"),
        (("t", "q", "qd", "qdd"), 2, "quintic"),
        (("q", "qd", "qdd"), 2, None),
        (("t", "qd", "qdd"), 2, None),
        (("t", "q", "qdd"), 2, "linear"),
        (("t", "q", "pose", "twist", "twistd"), 6, "linear"),
        (("t", "qd", "pose"), 6, None),
        (("t", "pose"), 6, "linear"),
        (("t", "pose", "twist"), 6, "cubic"),
        (("t", "pose", "twist", "twistd"), 6, "quintic"),
        (("t", "pose", "twist", "twistd"), 5, "quintic"),
        (("t", "pose", "twist", "twistd"), 7, "linear"),
        (("pose",), 6, None),
        (("t", "twist"), 6, None),
    ],
)
def test_columns_say_how_rows_are_joined(columns: tuple[Any, ...], joints: int, way: str | None) -> None:
    """Positions with their derivatives; poses only where there are none, as six rates of a tool tell those of at most six joints."""
    robot = arm(*(Joint(f"j{k}", a=0.1) for k in range(joints)))
    plan = made_plan([1.0], np.zeros((2, 1, joints)), [(1, robot, None)])
    rows = JoinedRows(plan, UniformGrid(1.0, 10.0), columns)
    orders = {None: 0, "linear": 1, "cubic": 2, "quintic": 3}[way]
    assert (rows.interpolation, rows.judged_orders) == (way, orders)
    assert rows.same_curve == (way is not None)
    assert (rows.judgement() is None) == (way is None)
    if way is None:
        assert rows.rounding() == 0.0


@pytest.mark.parametrize(("step", "looked_at"), [(1e-7, True), (-1e-7, True), (1e-11, False)])
@pytest.mark.parametrize(("order", "stated"), [(1, 2), (2, 3), (1, 3)])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_step_of_a_derivative_at_a_row_is_one_from_a_billionth_of_its_joint_on(
    joint: int, order: int, stated: int, step: float, looked_at: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside another joint whose derivatives are a million times as large: of 1, in the middle of a second."""
    monkeypatch.setattr(module, "_PIECES", 1)
    coefficients = np.zeros((3, 2, 2))
    coefficients[0], coefficients[1] = 0.5, [[0.5], [1.0]]  # qdd = 1, qd from 0.5 to 1.5
    coefficients[:, :, 1 - joint] *= 1e6
    coefficients[2 - order, 1, joint] += step / order
    for each in range(2):
        coefficients[2, 1, each] = np.polyval(coefficients[:, 0, each], 0.5)
    plan = made_plan([0.5] * 2, coefficients, [(2, ROBOT, None)])
    rows = JoinedRows(plan, UniformGrid(1.0, 20.0), ("t", *GROUPS[:stated]))
    assert rows._unproven(rows.grid.local(0, 21), 2 * stated - 1).tolist() == ([9, 10] if looked_at else [])


def test_a_knot_that_lies_beside_the_curve_is_looked_at_from_a_tenth_of_a_picometre_on() -> None:
    times, at = np.linspace(0.0, 1.0, 11), np.array([4])
    for off, found in ((1e-12, [3, 4]), (1e-14, [])):
        for joint in range(2):
            plan = made_plan([1.0], np.zeros((2, 1, 2)), [(1, ROBOT, None)])
            states = np.zeros((3, 1, 2))
            states[0, 0, joint] = off
            rows = JoinedRows(plan, KnotGrid(1.0, times, at, states), ("t", *GROUPS))
            assert rows._unproven(times, 5).tolist() == found


def test_rows_judge_a_curve_of_another_degree_as_soon_as_it_may_pass_a_limit_by_two_ten_millionths() -> None:
    """A joint that is off by e / limit = 1.9e-7 in its jerk needs no look; by 2.1e-7 it does."""
    coefficients, period = np.zeros((7, 1, 2)), 1 / RATE
    coefficients[0, 0, 1] = 1.0 / 720
    for share, looked_at in ((1.9e-7, False), (2.1e-7, True)):
        bounds = np.tile([-np.inf, np.inf], (2, 1))
        bounds[1] = np.array([-1.0, 1.0]) * period**3 / 120 / share
        robot = replace(ROBOT, limits=replace(unlimited(2), jerk=bounds))
        rows = JoinedRows(
            made_plan([1.0], coefficients, [(1, robot, None)]), UniformGrid(1.0, RATE), ("t", *GROUPS)
        )
        assert rows.same_curve != looked_at


@pytest.mark.parametrize("off", [-1e-13, 0.0, 1e-13])
@pytest.mark.parametrize("first", [True, False])
def test_a_piece_of_another_degree_is_looked_at_from_its_first_interval_to_its_last(
    off: float, first: bool
) -> None:
    """It begins, or ends, at a row but for rounding, where no derivative steps that rows state."""
    coefficients = np.zeros((7, 2, 2))
    coefficients[0, 1 - first] = 1.0
    if first:
        shifted = np.polynomial.polynomial.polyfromroots([-0.5] * 6)[::-1]
        coefficients[:, 0], coefficients[:, 1] = np.eye(7, 1), 0.0
        coefficients[:, 1] = shifted[:, None]
        coefficients[0, 1] = 0.0
        coefficients[1:4, 1] = 0.0  # q, qd and qdd go on
    plan = made_plan([0.5 + off, 0.5 - off], coefficients, [(2, ROBOT, None)])
    rows = JoinedRows(plan, UniformGrid(1.0, 20.0), ("t", *GROUPS))
    own = range(10) if first else range(10, 20)
    assert {*own} <= {*rows._unproven(rows.grid.local(0, 21), 5).tolist()}


@pytest.mark.parametrize("begin", [-7e-10, -4e-10, -2e-10, 0.0, 3e-10, 8e-10])
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("knots", [False, True])
def test_rows_beside_a_piece_of_less_than_a_nanosecond_state_an_acceleration_from_outside(
    joint: int, begin: float, knots: bool
) -> None:
    """It grows from 1 to 2 without a step, in 0.4 ns about the row at 0.5 s: what joins that row is no planned curve."""
    coefficients, lengths = np.zeros((4, 3, 2)), [0.5 + begin, 4e-10, 0.5 - begin - 4e-10]
    coefficients[1, :, joint] = 0.5, 0.5, 1.0
    coefficients[0, 1, joint] = 1 / 6 / 4e-10
    for k in (1, 2):
        for power in (0, 1):
            row = np.polyder(coefficients[:, k - 1, joint], power)
            coefficients[3 - power, k, joint] = np.polyval(row, lengths[k - 1])
    plan = made_plan(lengths, coefficients, [(3, ROBOT, None)])
    times = UniformGrid(1.0, 20.0).local(0, 21)
    first = plan.trajectory.curve.evaluate_orders(times[:1], (0, 1, 2)).transpose(1, 0, 2)
    grid = KnotGrid(1.0, times, np.array([0]), first) if knots else UniformGrid(1.0, 20.0)
    rows = JoinedRows(plan, grid, ("t", *GROUPS))
    states = np.concatenate([*sample(plan.trajectory, grid, GROUPS, robot=ROBOT)]).reshape(21, 3, 2)
    differ = intervals_that_differ(plan, times, states)
    assert differ
    assert differ <= {*rows._unproven(times, 5).tolist()}


@pytest.mark.parametrize("order", [1, 2])
def test_an_immense_acceleration_elsewhere_hides_no_step(order: int) -> None:
    """A ramp of 2 ns, beside which what steps at 0.5 s is little."""
    coefficients, lengths = np.zeros((3, 3, 2)), [2e-9, 0.5 - 2e-9, 0.5]
    coefficients[0, 0, 0], coefficients[1, 1:, 0] = 0.5 * order / 2e-9, 1.0 * order
    coefficients[2 - order, 2, 0] += 0.3
    for k in (1, 2):
        coefficients[2, k, 0] = np.polyval(coefficients[:, k - 1, 0], lengths[k - 1])
    rows = JoinedRows(
        made_plan(lengths, coefficients, [(3, ROBOT, None)]),
        UniformGrid(1.0, 20.0),
        ("t", *GROUPS[: order + 1]),
    )
    assert rows._unproven(rows.grid.local(0, 21), 2 * order + 1).tolist() == [0, 9, 10]


@pytest.mark.parametrize("joint", [0, 1])
def test_an_immense_acceleration_behind_a_row_hides_no_step_there(joint: int) -> None:
    """It steps from 0.3 to 0 at a row, and is 1e9 two nanoseconds later: the interval before that row counts."""
    coefficients, lengths = np.zeros((4, 3, 2)), [0.5, 2e-9, 0.5 - 2e-9]
    coefficients[1, :, joint] = 0.15, 0.0, 0.5e9
    coefficients[0, 1, joint] = 1e9 / 2e-9 / 6
    for k in (1, 2):
        for power in (0, 1):
            row = np.polyder(coefficients[:, k - 1, joint], power)
            coefficients[3 - power, k, joint] = np.polyval(row, lengths[k - 1])
    rows = JoinedRows(
        made_plan(lengths, coefficients, [(3, ROBOT, None)]), UniformGrid(1.0, 20.0), ("t", *GROUPS)
    )
    assert rows._unproven(rows.grid.local(0, 21), 5).tolist() == [9, 10]
