"""What the curve that joins rows passes, and uses, of limits: against polynomials through all rows, sampled densely."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_plans import arm, made_plan
from test_intervals_that_are_looked_at import GROUPS, RATE, made_curve, made_grid
from tiers import few

from trajcli.curves.hermite import hermite_coefficients
from trajcli.findings import at_time
from trajcli.grids import ListedGrid, UniformGrid
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.output.delivery import joined_rows as module
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.samples import sample
from trajcli.units import Units

ARM = arm(Joint("turn", a=0.3), Joint("out", type="prismatic"))
KINDS = ("velocity", "acceleration", "jerk")


def drawn_robot(rng: np.random.Generator, tool: bool) -> Robot:
    """Return an arm whose limits differ by joint and by direction, with limits of its tool or none."""
    bounds = {
        kind: np.stack([-rng.uniform(0.5, 2, 2), rng.uniform(0.5, 2, 2)], axis=1) * 6.0**order
        for order, kind in enumerate(KINDS)
    }
    of_tool = ToolLimits(speed=rng.uniform(0.3, 1), acceleration=rng.uniform(1, 6)) if tool else ToolLimits()
    return replace(ARM, limits=replace(unlimited(2), **bounds, tcp=of_tool))


def drawn(seed: int, stated: int, grid_kind: str, tools: int = 0) -> tuple[Any, JoinedRows]:
    """Return a plan of four moves with limits of their own, and rows of it, some of whose intervals pass limits."""
    rng = np.random.default_rng([seed, stated, 7])
    lengths, coefficients = made_curve(rng, 2 * stated - 1, int(rng.integers(2)))
    robots = [drawn_robot(rng, k < tools) for k in range(2)]
    robots += robots[::-1]  # two moves have the same limits, one behind the other
    more = [0.25, 0.3, 0.15]
    last = coefficients[:, -1:]
    lengths += more
    coefficients = np.concatenate([coefficients, last, last, last], axis=1)
    for k in (-3, -2, -1):  # they begin where the piece before ends
        for joint in range(2):
            coefficients[-1, k, joint] = np.polyval(coefficients[:, k - 1, joint], lengths[k - 1])
    counts = (1, len(lengths) - 3, 1, 1)
    plan = made_plan(
        lengths, coefficients, [(n, robot, None) for n, robot in zip(counts, robots, strict=True)]
    )
    return plan, JoinedRows(
        plan, made_grid(rng, plan, grid_kind), ("t", *GROUPS[:stated], "move"), exact=True
    )


def all_pieces(
    plan: Any, rows: JoinedRows, stated: int
) -> Iterator[tuple[tuple[int, int], list[np.ndarray]]]:
    """Yield for the moves of two rows the derivatives (n, samples) of all intervals from one to the other, by order."""
    table = np.concatenate([*sample(plan.trajectory, rows.grid, (*GROUPS[:stated], "move"), robot=ARM)])
    times = np.concatenate([local for _, local in rows.grid.blocks()])
    states = np.moveaxis(table[:, :-1].reshape(times.size, stated, 2), 1, 0)
    lengths = np.diff(times)
    pieces = hermite_coefficients(states[:, :-1], states[:, 1:], lengths[:, None])
    t = np.linspace(0, 1, 201)[:, None] * lengths
    values = [np.zeros((*t.shape, 2)) for _ in range(4)]
    for coefficient in pieces:  # by Horner, and likewise the derivatives over their factorials
        for order in (3, 2, 1, 0):
            values[order] = values[order] * t[..., None] + (values[order - 1] if order else coefficient)
    values = [value * factor for value, factor in zip(values, (1, 1, 2, 6), strict=True)]
    of_moves = np.stack([table[:-1, -1], table[1:, -1]], axis=1).astype(int)
    for before, after in np.unique(of_moves, axis=0).tolist():
        here = (of_moves == (before, after)).all(axis=1)
        yield (before, after), [value[:, here].reshape(-1, 2).T for value in values]


def looser(first: Robot, second: Robot, order: int) -> np.ndarray:
    one, other = first.limits.of_order(order), second.limits.of_order(order)
    return np.stack([np.minimum(one[:, 0], other[:, 0]), np.maximum(one[:, 1], other[:, 1])], axis=1)


def shares(plan: Any, rows: JoinedRows, stated: int) -> dict[tuple[str, str | None, int], float]:
    """Return the largest share of each limit, by kind, joint and the move of the row before."""
    found: dict[tuple[str, str | None, int], float] = {}
    for (before, after), values in all_pieces(plan, rows, stated):
        robots = plan.moves[before].robot, plan.moves[after].robot
        for order in range(1, stated + 1):
            bounds = looser(*robots, order)
            used = np.maximum(values[order] / bounds[:, :1], values[order] / bounds[:, 1:]).max(axis=1)
            for joint, share in enumerate(used.tolist()):
                key = KINDS[order - 1], ARM.joints[joint].name, before
                found[key] = max(found.get(key, 0.0), share)
        speed = np.hypot(0.3 * values[1][0], values[1][1])
        turning = np.hypot(0.3 * values[2][0], 0.3 * values[1][0] ** 2)
        of_tool = {"speed": speed, "acceleration": np.hypot(turning, values[2][1])}
        for kind, sizes in of_tool.items():
            if kind == "speed" or stated > 1:
                bound = max(getattr(robot.limits.tcp, kind) for robot in robots)
                key = f"tool_{kind}", None, before
                found[key] = max(found.get(key, 0.0), float(sizes.max()) / bound)
    return found


@pytest.mark.parametrize(("kind", "tools"), [("uniform", 0), ("uniform", 2), ("listed", 1), ("listed", 2)])
@pytest.mark.parametrize("stated", [1, 2, 3])
@pytest.mark.parametrize("seed", few(range(20), 2))
def test_each_limit_that_the_joined_curve_passes_is_found_in_each_move(
    seed: int, stated: int, kind: str, tools: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a curve that is not verified itself: what it passes where rows are joined as planned is of no account here."""
    plan, rows = drawn(seed, stated, kind, tools)
    monkeypatch.setattr(module, "_ROWS", 16)
    monkeypatch.setattr(module, "_JUDGED", 11)
    monkeypatch.setattr(  # every interval is looked at
        module.JoinedRows, "_unproven", lambda self, times, degree: np.arange(times.size - 1)
    )
    monkeypatch.setattr(
        module.JoinedRows, "_unproven_blocks", lambda self, grid, degree: range(-(-grid.count // 16))
    )
    true = shares(plan, rows, stated)
    judged = rows.judgement()
    assert judged is not None
    found = {(f.kind, f.joint, f.move): f for f in judged.findings}
    for key, share in true.items():
        if share > 1.02:
            assert key in found, (key, share)
            assert found[key].excess == pytest.approx(share, rel=2e-2)
        elif share < 0.98:
            assert key not in found
    assert bool(judged.events) == bool(found)
    times = np.concatenate([local for _, local in rows.grid.blocks()]) + 3.0
    for finding in found.values():
        assert finding.severity == "warning"
        assert finding.row is not None
        assert finding.time == pytest.approx(times[finding.row - 1], abs=1e-9)
        assert at_time(finding.time) in finding.message
    worst = rows.judgement(worst_only=True)
    assert worst is not None
    largest: dict[Any, float] = {}
    for (name, joint, _), finding in found.items():
        largest[name, joint] = max(largest.get((name, joint), 0.0), finding.excess)
    of_worst: dict[Any, float] = {}
    for finding in worst.findings:
        key = finding.kind, finding.joint
        of_worst[key] = max(of_worst.get(key, 0.0), finding.excess)
    assert of_worst == pytest.approx(largest)
    first = rows.judgement(first_only=True)
    assert first is not None
    assert bool(first.findings) == bool(found)
    loosely = rows.judgement(slack=max((f.excess for f in found.values()), default=1.0) * 1.001 - 1.0)
    assert loosely is not None
    assert not loosely.findings


@pytest.mark.parametrize("stated", [1, 2, 3])
@pytest.mark.parametrize("seed", few(range(20), 4))
def test_what_is_used_of_limits_is_that_of_the_plan_and_of_the_joined_curve(seed: int, stated: int) -> None:
    plan, rows = drawn(seed, stated, "uniform")
    joined = shares(plan, rows, stated)
    expected: dict[tuple[int, int], tuple[float, str]] = {}
    for (kind, name, move), share in joined.items():
        if kind in KINDS:
            key = KINDS.index(kind) + 1, move
            expected[key] = max(expected.get(key, (0.0, "")), (share, name or ""))
    for number, move in enumerate(plan.moves):
        for order in (1, 2, 3):
            bounds, peaks = move.robot.limits.of_order(order), plan.verdict.peaks[number][order]
            for joint, name in enumerate(("turn", "out")):
                share = max(peaks.low[joint] / bounds[joint, 0], peaks.high[joint] / bounds[joint, 1])
                expected[order, number] = max(expected.get((order, number), (0.0, "")), (share, name))
    found: dict[tuple[int, int], tuple[float, str]] = {}
    for share, order, joint, move in rows.uses():
        if order <= stated or share > 0:
            found[order, move] = max(found.get((order, move), (0.0, "")), (share, ("turn", "out")[joint]))
    for key, (share, name) in expected.items():
        if key[0] <= stated and share > 1e-6:
            assert found[key][0] == pytest.approx(share, rel=2e-2)
            second = joined.get((KINDS[key[0] - 1], "out" if name == "turn" else "turn", key[1]), 0.0)
            assert found[key][1] == name or second > 0.97 * share


@pytest.mark.parametrize("sides", [(1.0, 3.0), (3.0, 1.0)])
@pytest.mark.parametrize("tight", [0, 1])
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("stated", [1, 2, 3])
def test_nine_decimals_make_up_a_share_of_a_limit(
    stated: int, order: int, tight: int, sides: tuple[float, float]
) -> None:
    """A position off by half a unit at both ends, one up and one down; the least limit of any move counts, in its unit."""
    units, length = Units(angle="deg", length="mm"), 0.004
    half = (np.radians(0.5e-9), 0.5e-12)[tight]
    bounds = np.tile([-np.inf, np.inf], (2, 1))
    bounds[tight] = -sides[0], sides[1]
    strict = replace(ARM, limits=replace(unlimited(2), **{KINDS[order - 1]: bounds}))
    moves = [(1, ARM, None), (1, strict, None), (1, ARM, None)]
    plan = made_plan([0.5, 0.25, 0.25], np.zeros((2, 3, 2)), moves, units=units)
    states = np.zeros((2, stated, 1))
    states[:, 0] = [[half], [-half]]
    row = hermite_coefficients(states[0], states[1], np.array([length]))[:, 0]
    t = np.linspace(0, length, 2001)
    size = float(np.abs(np.polyval(np.polyder(row, order), t)).max())
    for grid in (UniformGrid(1.0, 1 / length), UniformGrid(0.1 + length, 10.0)):
        rows = JoinedRows(plan, grid, ("t", *GROUPS[:stated]))
        assert rows.rounding() == pytest.approx(size if order <= stated else 0.0, rel=1e-3)
    listed = ListedGrid(1.0, np.array([0.0, 0.3, 0.3 + length, 0.9]))
    some = JoinedRows(plan, listed, ("t", *GROUPS[:stated]))
    assert some.rounding() == pytest.approx(size if order <= stated else 0.0, rel=1e-3)
    two = JoinedRows(plan, UniformGrid(length, 10.0), ("t", *GROUPS[:stated]))
    assert two.rounding() == pytest.approx(size if order <= stated else 0.0, rel=1e-3)
    one = JoinedRows(plan, UniformGrid(0.0, RATE), ("t", *GROUPS[:stated]))
    assert one.rounding() == 0.0
