"""How far columns about the tool may be from what the joints make of it, by the rounding of both: on both sides of that.

A wheel of a radius turns to and fro and a slide moves along its axis, by sines. Joints that are off by e put the tool off by
twice the larger of the length of the arm and 1 m, times e; derivatives by the product rule.
"""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.columns import parse_column
from trajcli.findings import Finding
from trajcli.judge.rows.tool_rows import ArmsOfMoves
from trajcli.judge.tool_columns import ToolTable, judge_tool_columns
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

POSE = ["x", "y", "z", "qw", "qx", "qy", "qz"]
TWIST = ["vx", "vy", "vz", "wx", "wy", "wz"]
TWISTD = ["ax", "ay", "az", "ex", "ey", "ez"]
NAMES = [*POSE, *TWIST, *TWISTD]
T = np.linspace(0.0, 2.0, 80)
ROW = 60
OFF = 1e-4
SIDES = pytest.mark.parametrize("side", [1.0, -1.0])
SHARES = pytest.mark.parametrize(("share", "over"), [(0.95, False), (1.05, True)])
EXACT = 1e-9  # what is left to the forward kinematics of other processors


def states(t: np.ndarray = T) -> list[np.ndarray]:
    """Return angle and slide with two derivatives, each (N, 2)."""
    return [
        np.stack([np.sin(3 * t), 0.3 * np.cos(t)], axis=1),
        np.stack([3 * np.cos(3 * t), -0.3 * np.sin(t)], axis=1),
        np.stack([-9 * np.sin(3 * t), -0.3 * np.cos(t)], axis=1),
    ]


def true_columns(radius: float, t: np.ndarray = T) -> np.ndarray:
    """Return pose, twist and twistd of a point on the wheel, (N, 19): k x p w, and k x p w' - p w^2."""
    (angle, slide), (rate, sliding), (change, faster) = (each.T for each in states(t))
    nothing = 0.0 * t
    p = radius * np.stack([np.cos(angle), np.sin(angle), nothing], axis=1)
    k_x_p = np.stack([-p[:, 1], p[:, 0], nothing], axis=1)
    k = np.array([0.0, 0.0, 1.0])
    half = angle / 2
    return np.hstack(
        [
            p + slide[:, None] * k,
            np.stack([np.cos(half), nothing, nothing, np.sin(half)], axis=1),
            rate[:, None] * k_x_p + sliding[:, None] * k,
            rate[:, None] * k,
            change[:, None] * k_x_p - (rate**2)[:, None] * p + faster[:, None] * k,
            change[:, None] * k,
        ]
    )


def wheel(radius: float) -> ArmsOfMoves:
    both = Joint("turn", "revolute", a=radius), Joint("slide", "prismatic")
    return ArmsOfMoves(Robot("wheel", both, unlimited(2), "standard", np.eye(4), np.eye(4)), [])


def findings(
    radius: float, values: np.ndarray, off: tuple[float, float, float], halves: np.ndarray | None = None
) -> list[Finding]:
    """Return what columns are found to be beside joints whose values and derivatives are off by so much."""
    resolution = Resolution(0.0, *(np.full(2, each) for each in off))
    motion = RecordedMotion(T, *states(), None, None, None, None, resolution, "rows")
    columns = tuple(parse_column(name) for name in NAMES)
    table = ToolTable(columns, np.zeros(19) if halves is None else halves, lambda: [values])
    return judge_tool_columns([motion], table, wheel(radius), None, wheel(radius))


def planted(radius: float, name: str, by: float) -> np.ndarray:
    values = true_columns(radius)
    values[ROW, NAMES.index(name)] += by
    return values


@pytest.mark.parametrize("radius", [0.5, 3.0])
def test_true_columns_are_no_faults(radius: float) -> None:
    assert findings(radius, true_columns(radius), (0.0, 0.0, 0.0)) == []


OFF_BY = {
    ("x", "position", 0): lambda speed, change: 1.0,
    ("vy", "velocity", 0): lambda speed, change: speed,
    ("vx", "velocity", 1): lambda speed, change: 1.0,
    ("wz", "angular velocity", 0): lambda speed, change: speed,
    ("ay", "acceleration", 0): lambda speed, change: change + speed**2,
    ("az", "acceleration", 1): lambda speed, change: 2.0 * speed,
    ("ex", "angular acceleration", 1): lambda speed, change: 2.0 * speed,
    ("ax", "acceleration", 2): lambda speed, change: 1.0,
}
"""By name, quantity and order of what is off: how far that puts a derivative of the tool off, by the rates of the joints."""


@SIDES
@SHARES
@pytest.mark.parametrize("radius", [0.5, 3.0])
@pytest.mark.parametrize(("name", "quantity", "order"), OFF_BY)
def test_rounding_of_joints_explains_so_much_of_each_derivative(
    name: str, quantity: str, order: int, radius: float, share: float, side: float, *, over: bool
) -> None:
    """Both joints are off, in one of the derivatives."""
    _, rates, changes = (np.abs(each[ROW]).sum() for each in states())
    slack = 2.0 * max(radius, 1.0) * 2 * OFF * OFF_BY[name, quantity, order](rates, changes) + EXACT
    off = tuple(OFF * (k == order) for k in range(3))
    found = findings(radius, planted(radius, name, side * share * slack), off)  # type: ignore[arg-type]
    assert [(each.quantity, each.row, each.severity) for each in found] == [
        (quantity, ROW + 1, "error")
    ] * over


@SIDES
@SHARES
@pytest.mark.parametrize(
    ("name", "group"), [("y", POSE), ("vz", TWIST), ("wx", TWIST), ("ay", TWISTD), ("ez", TWISTD)]
)
def test_decimals_of_a_group_explain_what_they_make_together(
    name: str, group: list[str], share: float, side: float, *, over: bool
) -> None:
    """Those of other groups say nothing of it: they are exact here."""
    halves = np.array([OFF * (other in group) for other in NAMES])
    slack = OFF * np.sqrt(len(group)) + EXACT
    found = findings(1.0, planted(1.0, name, side * share * slack), (0.0, 0.0, 0.0), halves)
    assert [each.row for each in found] == [ROW + 1] * over


@SIDES
@pytest.mark.parametrize("decimals", [(5, 9), (9, 3), (5, 3)])
@pytest.mark.parametrize("name", ["vx", "vz", "wz", "ay", "ez"])
def test_rates_beside_positions_alone_are_off_by_the_rounding_of_both(
    name: str, decimals: tuple[int, int], side: float
) -> None:
    """Rows 5 ms apart: decimals of the joints and of the columns explain a hundredth of the rates, not a third more."""
    times = np.linspace(0.0, 2.0, 401)
    kept, at = slice(NAMES.index("vx"), None), NAMES.index(name)
    columns = tuple(parse_column(each) for each in NAMES[kept])
    of_joints, of_columns = (0.5 * 10.0**-digits for digits in decimals)
    resolution = Resolution(0.0, np.full(2, of_joints), np.zeros(2), np.zeros(2))
    motion = RecordedMotion(times, np.round(states(times)[0], decimals[0]), *(None,) * 6, resolution, "rows")
    for factor in (1.0, 1.0 + side / 3):
        values = true_columns(1.0, times)
        values[:, at] *= factor
        rounded = np.round(values[:, kept], decimals[1])
        table = ToolTable(columns, np.full(len(columns), of_columns), lambda rounded=rounded: [rounded])
        found = judge_tool_columns([motion], table, wheel(1.0), None, wheel(1.0))
        assert {each.kind for each in found} == ({"derivative"} if factor != 1.0 else set())
        numbers = [each.amounts[key] for each in found for key in ("value", "limit")]
        assert {getattr(number, "dimension", None) for number in numbers} <= {
            "angle" if name in ("wz", "ez") else "length"
        }


@pytest.mark.parametrize("order", [1, -1])
def test_the_row_that_rounding_explains_least_is_named(order: int) -> None:
    """A slow row that is off by a little more than its slack, ten times, beside a fast one that is off by as much as twice."""
    rates = np.abs(states()[1]).sum(axis=1)
    slow, fast = (int(at) for at in (rates.argmin(), rates.argmax()))
    assert rates[fast] > 8 * rates[slow]
    values = true_columns(1.0)
    for row, share in ((slow, 10.0), (fast, 2.0)):
        values[row, NAMES.index("vx")] += order * share * (4.0 * OFF * rates[row] + EXACT)
    (found,) = findings(1.0, values, (OFF, 0.0, 0.0))
    assert (found.row, found.count) == (slow + 1, 2)
    assert found.value == pytest.approx(10.0 * (found.limit or 0.0), rel=1e-6)


@SIDES
@pytest.mark.parametrize("name", ["vx", "vy", "wz"])
def test_rounding_of_positions_explains_no_velocity_that_is_off_by_three_times_as_much(
    name: str, side: float
) -> None:
    """Rows 5 ms apart: both joints are off by 0.5e-4, which makes 0.08 m/s or rad/s at twice their reach of 1 m."""
    times = np.linspace(0.0, 2.0, 401)
    kept, at = slice(NAMES.index("vx"), NAMES.index("ax")), NAMES.index(name)
    resolution = Resolution(0.0, np.full(2, 0.5e-4), np.zeros(2), np.zeros(2))
    motion = RecordedMotion(times, np.round(states(times)[0], 4), *(None,) * 6, resolution, "rows")
    for off in (0.0, 0.3):
        values = true_columns(1.0, times)
        values[:, at] += side * off
        table = ToolTable(
            tuple(parse_column(each) for each in TWIST), np.zeros(6), lambda values=values: [values[:, kept]]
        )
        found = judge_tool_columns([motion], table, wheel(1.0), None, wheel(1.0))
        assert {each.kind for each in found} == ({"derivative"} if off else set())
