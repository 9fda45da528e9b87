"""The bound of what joined rows differ by, term by term: against the difference itself, on rows close together.

The least slack with which a piece counts as kept, times its limit, is the bound. Each curve here makes one term of it
dominate; the bound is never below the largest difference that dense rows show, and not far above it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_plans import arm, in_joint, made_plan

from trajcli.curves.hermite import hermite_coefficients
from trajcli.kinematics.robot import Joint, Limits, Robot, ToolLimits, unlimited
from trajcli.output.delivery import period_bound
from trajcli.output.delivery.period_bound import pieces_within

START = 5.0  # of the curves: not zero

BARE = arm(Joint("a", a=0.1), Joint("b", a=0.1))
CRANK = arm(Joint("a", a=2.0))
PAIR = arm(Joint("a", a=1e-9), Joint("b", a=2.0))


def limited(n: int, **bounds: Any) -> Limits:
    return replace(unlimited(n), **bounds)


def planned(
    lengths: Sequence[float], coefficients: np.ndarray, moves: Sequence[tuple[int, Robot, Any]]
) -> Any:
    return made_plan(lengths, coefficients, moves, start=START)


def least_slack(plan: Any, length: float, stated: int, piece: int = 0) -> float:
    """Return from which slack on a piece counts as kept."""
    low, high = 1e-30, 1e30
    for _ in range(48):  # of 138 in the logarithm
        middle = float(np.sqrt(low * high))
        if pieces_within(plan, length, stated, middle)[piece]:
            high = middle
        else:
            low = middle
    return high


def is_least_slack(slack: float, plan: Any, length: float, stated: int, piece: int) -> bool:
    """Return whether a piece counts as kept from that slack on, to a billionth of it."""
    under, over = (pieces_within(plan, length, stated, slack * (1 + off))[piece] for off in (-1e-9, 1e-9))
    return bool(over and not under)


def joined(row: np.ndarray, begin: float, length: float, stated: int) -> np.ndarray:
    """Return the polynomial (from `begin` on) that shares derivatives with another at both ends of an interval."""
    ends = [[np.polyval(np.polyder(row, k), begin + t) for k in range(stated)] for t in (0.0, length)]
    states = np.array(ends)[:, :, None]
    return hermite_coefficients(states[0], states[1], np.array([length]))[:, 0]


def difference(row: np.ndarray, begin: float, length: float, stated: int, order: int) -> float:
    """Return the largest difference of a derivative in an interval."""
    t = np.linspace(0.0, length, 4001)
    other = np.polyder(joined(row, begin, length, stated), order)
    return float(np.abs(np.polyval(other, t) - np.polyval(np.polyder(row, order), begin + t)).max())


NAMES = ("position", "velocity", "acceleration", "jerk")


@pytest.mark.parametrize("sides", [(1.0, 3.0), (3.0, 1.0)])
@pytest.mark.parametrize(("joint", "piece", "sign"), [(0, 0, 1.0), (1, 1, -1.0), (1, 0, -1.0), (0, 1, 1.0)])
@pytest.mark.parametrize(
    ("stated", "shares"),
    [(2, [1]), (2, [0, 1]), (2, [0, 0, 1]), (2, [1, 1]), (3, [1]), (3, [0, 1]), (3, [1, 1]), (3, [1, 0, 1])],
)
def test_each_power_of_each_joint_counts_in_each_derivative(
    stated: int, shares: list[float], joint: int, piece: int, sign: float, sides: tuple[float, float]
) -> None:
    """Powers from twice the number of stated derivatives on, up to the end of a piece, where all are largest."""
    lengths, length = (0.5, 2.0), 1e-3
    row = np.zeros(2 * stated + 4)
    for k, share in enumerate(shares):
        power = 2 * stated + k
        size = lengths[piece] ** k * np.prod(np.arange(k + 1, power + 1, dtype=float))
        row[-1 - power] = sign * share / size  # the derivative of order 2 `stated` is a share at the end
    coefficients = np.zeros((row.size, 2, 2))
    coefficients[:, piece, joint] = row
    for order in range(1, stated + 1):
        limits = limited(2, **{NAMES[order]: in_joint(2, joint, -sides[0], sides[1])})
        plan = planned(lengths, coefficients, [(2, replace(BARE, limits=limits), None)])
        off = sum(shares) * length ** (2 * stated - order) * CONSTANTS[stated][order]
        assert is_least_slack(off, plan, length, stated, piece)
        assert pieces_within(plan, length, stated, 1e-30)[1 - piece]
    for low, high in ((-np.inf, 1.0), (-1.0, np.inf)):
        limits = limited(2, position=in_joint(2, joint, low, high))
        plan = planned(lengths, coefficients, [(2, replace(BARE, limits=limits), None)])
        off = sum(shares) * length ** (2 * stated) * CONSTANTS[stated][0]
        assert is_least_slack(off, plan, length, stated, piece)


CONSTANTS = {
    2: (1 / 384, np.sqrt(3) / 216, 1 / 12),
    3: (1 / 46080, np.sqrt(5) / 30000, 1 / 1920, 1 / 120),
}
"""Largest differences where the derivative of order 4 or 6 is 1 throughout an interval of 1 s."""


@pytest.mark.parametrize("stated", [2, 3])
def test_the_constants_are_those_of_a_power(stated: int) -> None:
    row = np.zeros(2 * stated + 1)
    row[0] = 1.0 / np.prod(np.arange(1.0, 2 * stated + 1))
    for order, constant in enumerate(CONSTANTS[stated]):
        assert difference(row, 0.0, 1.0, stated, order) == pytest.approx(constant, rel=1e-4)


@pytest.mark.parametrize("tight", [0, 1, 2])
def test_each_move_has_limits_of_its_own(tight: int) -> None:
    """Moves of one, three and two pieces of unequal lengths: those of one are not kept, the others are."""
    counts, lengths = (1, 3, 2), [0.3, 0.1, 2.0, 0.05, 1.0, 0.4]
    coefficients = np.ones((8, 6, 2))
    strict = replace(BARE, limits=limited(2, velocity=in_joint(2, 1, -1e-9, 1.0)))
    robots = [strict if k == tight else BARE for k in range(3)]
    plan = planned(lengths, coefficients, [(n, robot, None) for n, robot in zip(counts, robots, strict=True)])
    within = pieces_within(plan, 1e-2, 3, 2e-7)
    assert within.tolist() == [k != tight for k, n in enumerate(counts) for _ in range(n)]
    for kind in ("effort", "velocity_by_position"):
        rows = {
            "effort": in_joint(2, 1, -1e9, 1e9),
            "velocity_by_position": np.array([[np.inf, 0.0], [1e9, 0.0]]),
        }
        other = replace(BARE, limits=limited(2, **{kind: rows[kind], "position": in_joint(2, 1, -1e9, 1e9)}))
        robots = [other if k == tight else BARE for k in range(3)]
        plan = planned(
            lengths, coefficients, [(n, robot, None) for n, robot in zip(counts, robots, strict=True)]
        )
        within = pieces_within(plan, 1e-2, 3, 1e9)
        assert within.tolist() == [k != tight for k, n in enumerate(counts) for _ in range(n)], kind


def moved_by_crank(reach: float, angular: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Return which derivatives of the tool of a crank come of q, qd, qdd, qddd (4, N): complex, (3, N)."""

    def derivatives(q: np.ndarray) -> np.ndarray:
        if angular:
            return q[1:].astype(complex)
        turn = reach * np.exp(1j * q[0])
        return np.stack(
            [
                1j * q[1] * turn,
                (1j * q[2] - q[1] ** 2) * turn,
                (1j * q[3] - 3 * q[1] * q[2] - 1j * q[1] ** 3) * turn,
            ]
        )

    return derivatives


TOOL = {
    "speed": 0,
    "acceleration": 1,
    "jerk": 2,
    "angular_speed": 0,
    "angular_acceleration": 1,
    "angular_jerk": 2,
}


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("kind", TOOL)
@pytest.mark.parametrize(
    "lower", [(0.0, 0.0, 0.0), (0.0, 0.0, 30.0), (0.0, 0.0, 3e4), (0.0, 1e5, 0.0), (1e7, 0.0, 0.0)]
)
def test_derivatives_of_the_tool(kind: str, both: bool, lower: tuple[float, float, float]) -> None:
    """A crank of 2 m with a large velocity, acceleration or jerk, and two joints on one axis that share it.

    A piece is as long as the distance of two rows, its sixth derivative the same throughout.
    """
    length, stated, row = 1e-2, 3, np.zeros(7)
    row[0] = 1e10 / 720
    jerk, acceleration, velocity = lower
    row[3:6] = jerk / 6, acceleration / 2, velocity
    parts = [row / 2, row / 2] if both else [row]
    robot = PAIR if both else CRANK
    robot = replace(robot, limits=limited(len(parts), tcp=ToolLimits(**{kind: 1.0})))
    plan = planned([length], np.stack(parts, axis=1)[:, None], [(1, robot, None)])
    t, derivatives = np.linspace(0, length, 4001), moved_by_crank(2.0, kind.startswith("angular"))
    both_ways = [
        derivatives(np.stack([np.polyval(np.polyder(each, order), t) for order in range(4)]))
        for each in (row, joined(row, 0.0, length, stated))
    ]
    true = float(np.abs(both_ways[1] - both_ways[0])[TOOL[kind]].max())
    assert not pieces_within(plan, length, stated, true * (1 - 1e-6))[0]  # the bound is at least that
    if not kind.startswith("angular"):  # two axes that turn each other would need what parallel ones do not
        assert pieces_within(plan, length, stated, 6 * true)[0]


@pytest.mark.parametrize(
    "rates", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (2.0, 3.0, 5.0), (0.1, 7.0, 0.2)]
)
def test_the_products_are_those_of_an_exponential(rates: tuple[float, float, float]) -> None:
    """All derivatives of e^q by q are 1 where q is 0: its Taylor coefficients by time are the sum of powers of q."""
    q = np.array([rates[2] / 6, rates[1] / 2, rates[0], 0.0])
    square = np.polymul(q, q)
    series = np.polyadd(np.polyadd(q, square / 2), np.polymul(square, q) / 6)
    found = period_bound._products(np.array(rates)[:, None])[:, 0]
    assert found == pytest.approx(series[[-2, -3, -4]] * [1, 2, 6])


@pytest.mark.parametrize("kind", TOOL)
def test_one_limit_of_several_is_enough(kind: str) -> None:
    """Of six limits of the tool one is tight, wherever it stands among them."""
    row = np.zeros((7, 1, 1))
    row[0] = 1.0
    robot = replace(CRANK, limits=limited(1, tcp=ToolLimits(**{**dict.fromkeys(TOOL, 1e9), kind: 1e-20})))
    assert not pieces_within(planned([1e-2], row, [(1, robot, None)]), 1e-2, 3, 2e-7).any()


def test_a_slide_lengthens_the_reach() -> None:
    """An arm that turns while it stands 10 m out: its speed differs by ten times what the joint does."""
    row, length = np.zeros(7), 1e-2
    row[0] = 1.0 / 720
    out = np.zeros(7)
    out[-1] = -10.0
    joints = (Joint("turn", alpha=-np.pi / 2), Joint("out", type="prismatic", alpha=0.0))
    robot = arm(*joints)
    robot = replace(robot, limits=limited(2, tcp=ToolLimits(speed=1.0)))
    plan = planned([length], np.stack([row, out], axis=1)[:, None], [(1, robot, None)])
    true = 10.0 * difference(row, 0.0, length, 3, 1)
    assert 1 - 1e-6 <= least_slack(plan, length, 3) / true <= 1.5


@pytest.mark.parametrize(("position", "angle"), [(1e-6, 1e3), (1e3, 1e-6)])
def test_a_tool_on_a_path_is_off_it_by_a_thousandth_of_its_tolerance_at_most(
    position: float, angle: float
) -> None:
    """Whatever the slack: as the tool of a crank of 2 m moves by twice its joint, the joint may be off by half."""
    path = SimpleNamespace(tolerance=SimpleNamespace(position=position, angle=angle))
    length, allowed = 1e-2, 1e-3 * min(position / 2.0, angle)
    row = np.zeros(7)
    row[0] = 1.0
    unit = difference(row, 0.0, length, 3, 0)
    for share, kept in ((0.999, True), (1.001, False)):
        scaled = (row * share * allowed / unit)[:, None, None]
        plan = planned([length], scaled, [(1, CRANK, path)])
        assert pieces_within(plan, length, 3, 1e9).tolist() == [kept]
        both = np.concatenate([scaled, scaled], axis=2) / 2
        plan = planned([length], both, [(1, PAIR, path)])
        assert pieces_within(plan, length, 3, 1e9).tolist() == [kept]
        assert pieces_within(planned([length], scaled, [(1, CRANK, None)]), length, 3, 1e-30).all()


def test_the_speed_of_the_tool_is_that_of_the_own_move() -> None:
    """Of two moves with the same sixth derivative one turns fast: only there an error of the joint counts for so much."""
    length, coefficients = 1e-2, np.zeros((7, 2, 1))
    coefficients[0] = 1.0 / 720
    coefficients[5, 1] = 30.0
    robot = replace(CRANK, limits=limited(1, tcp=ToolLimits(jerk=1.0)))
    slow, fast = planned([length] * 2, coefficients, [(1, robot, None)] * 2), coefficients[:, ::-1]
    order = planned([length] * 2, fast, [(1, robot, None)] * 2)
    found = [[least_slack(plan, length, 3, piece) for piece in (0, 1)] for plan in (slow, order)]
    assert found[0] == pytest.approx(found[1][::-1])
    assert found[0][1] > found[0][0] * 1.01


def test_a_border_that_rounding_moves_changes_no_piece_of_a_move() -> None:
    """Moves begin where a sum of durations says, breaks where the curve says."""
    strict = replace(BARE, limits=limited(2, velocity=in_joint(2, 1, -1e-9, 1.0)))
    for off in (-1e-15, 1e-15):
        plan = planned([0.7, 0.1], np.ones((8, 2, 2)), [(1, strict, None), (1, BARE, None)])
        first, second = plan.trajectory.spans
        spans = (replace(first, end=first.end + off), replace(second, start=second.start + off))
        plan.trajectory = replace(plan.trajectory, spans=spans)
        assert pieces_within(plan, 1e-2, 3, 2e-7).tolist() == [False, True]
