"""The tool in every row and between them: planted faults in each block, in the first and in the last row.

The arm is one link that turns, and a slide; its tool moves with L q' and with the slide's velocity, and the
largest slopes of Hermite interpolants from rest to rest are known. On a path it is the arm of a planned line.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from line_of_ur5e import plan
from tiers import few

import trajcli
from trajcli.columns import parse_column
from trajcli.findings import Finding
from trajcli.judge import recorded_tool, tool_path
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.judge.rows.tool_rows import ArmsOfMoves
from trajcli.judge.tool_columns import ToolTable, judge_tool_columns
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import tcp_twist
from trajcli.kinematics.robot import Joint, Limits, Robot, ToolLimits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution, blocks_of_size

LEVER, OFF, PERIOD = 0.5, 1e-6, 0.008
SIDES = pytest.mark.parametrize("side", [1.0, -1.0])


def link(joints: Limits | None = None, **tcp: float) -> Robot:
    """Return a joint that turns the tool at a distance of half a metre, and a slide along its axis."""
    limits = replace(joints or unlimited(2), tcp=ToolLimits(**tcp))
    both = (Joint("turn", "revolute", a=LEVER), Joint("slide", "prismatic"))
    return Robot("link", both, limits, "standard", np.eye(4), np.eye(4))


def rows(t: np.ndarray, *columns: np.ndarray | None, off: float = 0.0, late: float = 0.0) -> RecordedMotion:
    every = [*columns, None, None][:3]
    roundings = np.full(every[0].shape[1], off), np.zeros(every[0].shape[1]), np.zeros(every[0].shape[1])
    return RecordedMotion(t, *every, None, None, None, None, Resolution(late, *roundings), "rows")


def of_tool(motion: RecordedMotion, robot: Robot, interpolate: str | None = None) -> list[Finding]:
    required = Requirements(robot, interpolate=interpolate, tool=lambda: ToolJudge(robot))
    findings = judge_motion(lambda: [motion], required).findings
    return [each for each in findings if each.kind.startswith("tool_")]


@SIDES
@pytest.mark.parametrize("key", ["speed", "angular_speed"])
@pytest.mark.parametrize("piece", [0, 1, 62, 63, 64, 98])
def test_a_fast_piece_anywhere_in_a_long_file_is_found(
    piece: int, key: str, side: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More pieces than are looked at together, here 64; the slide beside moves in another one, slowly."""
    monkeypatch.setattr(recorded_tool, "_PIECES", 64)
    t = np.append(0.0, np.cumsum(0.02 + 0.01 * (np.arange(99) % 7)))
    q = np.zeros((100, 2))
    q[piece + 1 :, 0], q[50:, 1] = side * 0.01, 1e-4
    rate = 0.01 / (t[piece + 1] - t[piece]) * (LEVER if key == "speed" else 1.0)
    (found,) = of_tool(rows(t, q), link(**{key: 0.9 * rate}))
    assert (found.kind, found.severity, found.certainty) == (f"tool_{key}", "error", "exceeded")
    assert found.row in (piece + 1, piece + 2)
    assert t[piece] - 1e-9 <= found.time <= t[piece + 1] + 1e-9
    assert found.value == pytest.approx(rate, rel=1e-6)
    assert of_tool(rows(t, q), link(**{key: 1.001 * rate})) == []


ORDERS = {
    "speed": (1.875, 1),
    "angular_speed": (1.875, 1),
    "acceleration": (10 / 3**0.5, 2),
    "angular_acceleration": (10 / 3**0.5, 2),
    "jerk": (60.0, 3),
    "angular_jerk": (60.0, 3),
}
"""Largest derivative of a quintic from rest to rest over 1 in a time 1, and its order (Biagiotti, section 2.1)."""


@pytest.mark.parametrize(("planted", "certainty"), [(0.5, "within rounding"), (1.5, "exceeded")])
@pytest.mark.parametrize("piece", [0, 3])
@pytest.mark.parametrize("key", ORDERS)
def test_rounding_of_rows_explains_so_much_of_the_tool(
    key: str, piece: int, planted: float, certainty: str
) -> None:
    """The link turns by 1e-3 in one piece, which is off by twice the rounding of the rows; the slide is as rough.

    The link moves the tool by its lever and turns it, the slide moves it as far as itself.
    """
    t = np.array([0.0, 0.3, 0.8, 1.2, 1.9])
    factor, order = ORDERS[key]
    q, still = np.zeros((5, 2)), np.zeros((5, 2))
    q[piece + 1 :, 0] = 1e-3
    share = factor / (t[piece + 1] - t[piece]) ** order
    lever = 1.0 if key.startswith("angular") else LEVER
    rounding = (1.0 if key.startswith("angular") else LEVER + 1.0) * share * 2 * OFF
    limit = lever * share * 1e-3 - planted * rounding
    (found,) = of_tool(rows(t, q, still, still, off=OFF), link(**{key: limit}), "quintic")
    assert (found.kind, found.severity, found.certainty) == (f"tool_{key}", "error", certainty)
    assert found.value == pytest.approx(lever * share * 1e-3, rel=1e-4)
    assert found.rounding == pytest.approx(rounding, rel=1e-2)


@SIDES
@pytest.mark.parametrize("key", ["speed", "acceleration", "jerk"])
def test_rounding_of_a_slide_is_no_smaller_at_a_short_arm(key: str, side: float) -> None:
    """It goes just as fast as it may; its rows are rounded, and the arm at its end is a centimetre long."""
    t, (factor, order), still = np.array([0.0, 0.3, 0.8, 1.2, 1.9]), ORDERS[key], np.zeros((5, 2))
    q = np.zeros((5, 2))
    q[2:, 1] = side * 1e-3
    limit = factor / 0.5**order * 1e-3
    q[1, 1], q[2, 1] = -side * 0.99 * OFF, side * (1e-3 + 0.99 * OFF)
    robot = link(**{key: limit})
    short = replace(robot, joints=(replace(robot.joints[0], a=0.01), robot.joints[1]))
    (found,) = of_tool(rows(t, q, still, still, off=OFF), short, "quintic")
    assert (found.kind, found.certainty) == (f"tool_{key}", "within rounding")


@SIDES
@pytest.mark.parametrize("begin", [0.0, 0.3, -7.1, 1e9])
@pytest.mark.parametrize("ends_short", [True, False])
def test_rounding_at_a_peak_on_a_row_is_that_of_the_piece_with_the_peak(
    ends_short: bool, begin: float, side: float
) -> None:
    """A cubic from rest bends by 4 v / T in its end; beside it the slide goes on evenly, in a longer interval."""
    speed, still = side * 0.1, np.zeros(4)
    lengths, qd = [0.5, 0.25, 0.5], [0.0, 0.0, speed, speed]
    slide = np.cumsum([0.0, 0.0, 0.0, 0.5 * speed])
    if not ends_short:  # to rest: the same with time reversed
        qd, slide = qd[::-1], -slide[::-1]
    t = begin + np.append(0.0, np.cumsum(lengths))
    share = 6 * 2 * OFF / 0.25**2
    for planted, certainty in ((0.5, "within rounding"), (1.5, "exceeded")):
        robot = link(acceleration=4 * 0.1 / 0.25 - planted * (LEVER + 1.0) * share)
        motion = rows(t, np.stack([still, slide], axis=1), np.stack([still, qd], axis=1), off=OFF)
        (found,) = of_tool(motion, robot, "cubic")
        assert (found.value, found.row) == (pytest.approx(1.6), 3 if ends_short else 2)
        assert found.rounding == pytest.approx((LEVER + 1.0) * share, rel=0.1)
        assert (found.severity, found.certainty) == ("error", certainty)


@SIDES
@pytest.mark.parametrize("at", [0, 4, 8])
@pytest.mark.parametrize("key", ["speed", "angular_speed"])
def test_a_tool_that_only_the_curve_makes_too_fast_is_a_warning(key: str, at: int, side: float) -> None:
    """The mean is 1, the ends of one piece have 0.8: a cubic reaches 0.8 + 3/2 0.2 in its middle."""
    lever = LEVER if key == "speed" else 1.0
    for period, peaked, limit, severity in (
        (PERIOD, 0.8, 1.05, "warning"),
        (PERIOD, -0.6, 1.06, "warning"),  # 1.7 times the limit
        (PERIOD, 0.8, 0.99, "error"),  # the mean of two rows is over it
        (PERIOD, 0.8, 1 - 5e-5, "error"),  # likewise
        (0.02, 0.8, 1.05, "error"),  # they stand too far apart
        (PERIOD, -1.5, 1.1, "error"),  # more than twice the limit
    ):
        t = period * np.arange(10)
        q, qd = np.zeros((10, 2)), np.zeros((10, 2))
        q[:, 0], qd[:, 0] = side * t, side
        qd[at : at + 2, 0] = side * peaked
        peak = peaked + 1.5 * (1 - peaked)
        motion = rows(t, q, qd)
        (found,) = of_tool(motion, link(**{key: lever * limit}))
        assert (found.severity, found.certainty) == (severity, "exceeded"), (period, limit)
        assert (found.value, found.row) == (pytest.approx(lever * peak, rel=1e-5), at + 1)
        assert found.time == pytest.approx(t[at] + 0.5 * period, abs=1e-2 * period)
        if severity == "warning":
            (asked,) = of_tool(motion, link(**{key: lever * limit}), "cubic")
            assert asked.severity == "error"


@SIDES
@pytest.mark.parametrize("at", [0, 4, 8])
@pytest.mark.parametrize("key", ["acceleration", "angular_acceleration"])
def test_an_acceleration_of_the_tool_between_dense_rows_is_a_warning(key: str, at: int, side: float) -> None:
    """Velocities gain 1 m/s^2 in the mean, and one distance is a little short: its cubic bends by 0.2 more."""
    lever = LEVER if key == "acceleration" else 1.0
    t = PERIOD * np.arange(10)
    q, qd = np.zeros((10, 2)), np.zeros((10, 2))
    qd[:, 0] = side * 0.01 * t / PERIOD * PERIOD
    q[:, 0] = side * 0.01 * t**2 / 2 + 0.8  # it moves along no axis of the base
    q[at + 1 :, 0] -= side * 0.01 * 0.2 * PERIOD**2 / 6
    for limit, severity in ((1.1, "warning"), (0.99, "error")):
        (found,) = of_tool(rows(t, q, qd), link(**{key: lever * 0.01 * limit}))
        assert (found.kind, found.severity) == (f"tool_{key}", severity)
        assert found.value == pytest.approx(lever * 0.01 * 1.2, rel=1e-3)


@SIDES
def test_a_tool_that_stands_between_turns_is_a_warning_likewise(side: float) -> None:
    """It stands at 500 angles, at some of which rounding makes the cosine of the angle between rows more than 1."""
    steps = np.tile([1.0, 1.0, 0.0], 500)
    q, qd, t = np.zeros((1501, 2)), np.zeros((1501, 2)), PERIOD * np.arange(1501)
    q[1:, 0] = side * PERIOD * np.cumsum(steps)
    qd[1::3, 0] = 0.8 * side
    (found,) = of_tool(rows(t, q, qd), link(angular_speed=1.05))
    assert (found.severity, found.certainty) == ("warning", "exceeded")


@SIDES
@pytest.mark.parametrize("key", ["acceleration", "jerk"])
@pytest.mark.parametrize("share", [0.9, 1.1])
def test_points_that_state_less_have_no_derivatives_of_the_tool_that_others_have(
    share: float, key: str, side: float
) -> None:
    """Faster where points in the middle state positions alone; then a = 0.3 rad/s^2, so that it is fastest at the end.

    The acceleration is L (a^2 + w^4)^0.5, the jerk L (9 a^2 w^2 + w^6)^0.5.
    """
    t = np.array([0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.55, 0.6, 0.9, 1.0])
    late, a = np.maximum(t - 0.5, 0.0), 0.3
    turn = 0.2 * np.minimum(t, 0.1) + 5.0 * np.clip(t - 0.1, 0.0, 0.4) + late + a * late**2 / 2
    rate, still = np.where(t < 0.3, 0.2, 1.0 + a * late), 0.0 * t
    states = [np.stack([side * each, still], axis=1) for each in (turn, rate, np.where(t < 0.3, 0.0, a))]
    states[1][3:5] = np.nan
    w = float(rate[-1])
    value = LEVER * np.hypot(a, w**2) if key == "acceleration" else LEVER * np.hypot(3 * a * w, w**3)
    found = of_tool(rows(t, *states), link(**{key: share * value}), "jtc")
    assert [each.value for each in found] == [pytest.approx(value, rel=1e-5)] * (share < 1.0)
    assert [(each.time, each.row) for each in found] == [(pytest.approx(1.0), 10)] * (share < 1.0)


@SIDES
def test_an_even_turn_faster_than_the_jerk_of_the_tool_allows_is_an_error(side: float) -> None:
    """The rows' accelerations are all 0: the tool's are L w^2 and turn, which makes the jerk L w^3 in every row."""
    rate, t = 2.0, PERIOD * np.arange(10)
    q, qd = np.zeros((10, 2)), np.zeros((10, 2))
    q[:, 0], qd[:, 0] = side * rate * t, side * rate
    (found,) = of_tool(rows(t, q, qd, 0 * q), link(jerk=0.9 * LEVER * rate**3))
    assert (found.value, found.severity) == (pytest.approx(LEVER * rate**3, rel=1e-5), "error")
    assert of_tool(rows(t, q, qd, 0 * q), link(jerk=1.001 * LEVER * rate**3)) == []


@SIDES
@pytest.mark.parametrize("key", ["speed", "angular_speed"])
def test_dense_rows_that_are_over_a_limit_by_more_than_their_rounding_are_an_error(
    key: str, side: float
) -> None:
    """Both joints are off by twice their rounding in one interval: three times that is certain."""
    q, t = np.zeros((10, 2)), PERIOD * np.arange(10)
    q[:, 0] = side * t
    rounding = (1.0 if key == "angular_speed" else LEVER + 1.0) * 2 * OFF / PERIOD
    limit = (1.0 if key == "angular_speed" else LEVER) - 3 * rounding
    (found,) = of_tool(rows(t, q, off=OFF), link(**{key: limit}))
    assert (found.severity, found.certainty) == ("error", "exceeded")


# --- along a path ---


@cache
def line(rate: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stamps, positions and velocities of the line."""
    sampled = plan().trajectory.sample(rate)
    return sampled.t, np.round(sampled.q, 9), np.round(sampled.qd, 9)


def deviations(q: np.ndarray, t: np.ndarray, qd: np.ndarray | None = None, size: int = 5000) -> list[Finding]:
    robot, off = plan().moves[0].robot, np.full(6, 0.5e-9)
    moves = np.zeros(len(t), int)
    motion = RecordedMotion(t, q, qd, None, None, None, moves, None, Resolution(0.0, off, off, off), "rows")
    required = Requirements(robot, tool=lambda: ToolJudge(robot, {0: plan().moves[0].planned.tool}))
    found = judge_motion(lambda: blocks_of_motion(motion, size), required).findings
    return [each for each in found if each.kind == "deviation"]


def blocks_of_motion(motion: RecordedMotion, size: int) -> list[RecordedMotion]:
    names = ("t", "q", "qd", "qdd", "move")
    return [
        replace(
            motion,
            first_row=motion.first_row + low,
            **{
                name: None if getattr(motion, name) is None else getattr(motion, name)[low : low + size]
                for name in names
            },
        )
        for low in range(0, len(motion.t), size)
    ]


@cache
def aside() -> np.ndarray:
    """Return a unit vector square to the line."""
    _, q, _ = line(60)
    ends = forward(plan().moves[0].robot, q[[0, -1]])[:, :3, 3]
    across = np.cross(ends[1] - ends[0], [1.0, 0.0, 0.0])
    return across / np.linalg.norm(across)


def moved(q: np.ndarray, along: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Return joint velocities that move the tool, and turn it, to first order."""
    return np.linalg.solve(trajcli.load_robot("ur5e").jacobian(q), np.concatenate([along, about]))


@pytest.mark.parametrize(
    ("row", "quantity", "side", "size"),
    [
        (0, "position", 1.0, 5000),
        (63, "orientation", 1.0, 5000),
        (64, "position", -1.0, 5000),
        (99, "position", 1.0, 5000),
        (99, "orientation", -1.0, 70),
        (70, "position", 1.0, 70),
    ],
)
def test_a_row_beside_its_path_is_found_wherever_it_stands(
    row: int, quantity: str, side: float, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows that end on their way; more of them than are looked at together, here 64."""
    monkeypatch.setattr(tool_path, "_ROWS", 64)
    t, q, _ = (each[:100].copy() for each in line(60))
    by, nothing = side * 2e-4 * aside(), np.zeros(3)
    q[row] += moved(q[row], by, nothing) if quantity == "position" else moved(q[row], nothing, by)
    (found,) = deviations(q, t, size=size)
    assert (found.row, found.quantity) == (row + 1, quantity)
    assert (found.severity, found.certainty) == ("error", "exceeded")
    assert found.value == pytest.approx(2e-4, rel=2e-2)


@SIDES
@pytest.mark.parametrize("row", [1, 60, 119])
def test_a_curve_beside_its_path_between_rows_is_found(row: int, side: float) -> None:
    """A velocity that is off by w puts the middles beside it off by w T / 8, and no row."""
    t, q, qd = line(60)
    turned = qd.copy()
    turned[row] += moved(q[row], side * 8 * 2e-4 * 60 * aside(), np.zeros(3))
    assert deviations(q, t, qd) == []
    found = {each.quantity: each for each in deviations(q, t, turned)}["position"]
    assert found.value == pytest.approx(2e-4, rel=0.1)
    assert abs(found.time - t[row]) == pytest.approx(0.5 / 60, rel=1e-6)


# --- columns of the tool beside joints ---

COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz")


def columns_beside(
    q: np.ndarray, qd: np.ndarray | None, values: np.ndarray, size: int = 40, half: float = 0.0
) -> list[Finding]:
    """Return what pose and twist are found to be wrong, in blocks of some rows."""
    robot, count = link(), len(q)
    t = PERIOD * np.arange(count)
    motion = rows(t, q, qd)
    every = tuple(parse_column(name) for name in COLUMNS)
    table = ToolTable(every, np.full(len(every), half), lambda: blocks_of_size([values], size))
    arms = ArmsOfMoves(robot, [])
    return judge_tool_columns(blocks_of_motion(motion, size), table, arms, None, arms)


def true_columns(count: int = 90) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return joints, their velocities, and what they make of the tool."""
    u = np.arange(count) * PERIOD
    q, qd = np.stack([np.sin(u), 0.1 * u], axis=1), np.stack([np.cos(u), 0.1 + 0 * u], axis=1)
    poses = forward(link(), q)
    half = q[:, 0] / 2
    turned = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    return q, qd, np.hstack([poses[:, :3, 3], turned, tcp_twist(link(), q, qd)])


def test_what_joints_make_of_the_tool_is_no_fault() -> None:
    q, qd, values = true_columns()
    assert columns_beside(q, qd, values) == []
    values[:, 3:7] *= -1.0  # the same orientation
    assert columns_beside(q, qd, values) == []


@SIDES
@pytest.mark.parametrize("row", [0, 39, 40, 80, 89])
@pytest.mark.parametrize("column", [0, 1, 2, 7, 8, 9, 10, 11, 12])
def test_one_wrong_number_of_the_tool_is_found(column: int, row: int, side: float) -> None:
    q, qd, values = true_columns()
    quantity = "position" if column < 3 else "velocity" if column < 10 else "angular velocity"
    values[row, column] += side * 5e-9
    (found,) = columns_beside(q, qd, values)
    assert (found.quantity, found.row, found.severity) == (quantity, row + 1, "error")
    assert found.value == pytest.approx(5e-9, rel=1e-3)
    assert columns_beside(q, qd, values, half=5e-9) == []


@pytest.mark.parametrize("length", [0.9, 1.1])
@pytest.mark.parametrize("row", [0, 89])
def test_a_quaternion_of_another_length_is_none(row: int, length: float) -> None:
    q, qd, values = true_columns()
    values[row, 3:7] *= length
    (found,) = columns_beside(q, qd, values)
    assert (found.quantity, found.row) == ("orientation", row + 1)
    assert found.value == pytest.approx(0.1, rel=1e-6)


@pytest.mark.parametrize("angle", [4e-9, 1e-6, -1e-6, 3.0, np.pi])
def test_a_turned_quaternion_is_found_by_how_much(angle: float) -> None:
    q, qd, values = true_columns()
    half = (q[50, 0] + angle) / 2
    values[50, 3:7] = np.cos(half), 0.0, 0.0, np.sin(half)
    (found,) = columns_beside(q, qd, values)
    assert (found.quantity, found.row) == ("orientation", 51)
    assert found.value == pytest.approx(abs(angle), rel=1e-4)


@pytest.mark.parametrize("column", [0, 7])
def test_rates_that_are_judged_from_row_to_row_hide_no_wrong_pose(column: int) -> None:
    """Beside positions alone the twist is judged by how the tool moves, and the pose by where it is."""
    q, _, values = true_columns()
    assert columns_beside(q, None, values) == []
    if column == 7:
        values[:, 7] += 0.1
    values[50, 0] += 1e-6
    quantities = {each.quantity for each in columns_beside(q, None, values)}
    assert quantities == ({"position"} if column == 0 else {"position", "velocity"})


@pytest.mark.parametrize(("share", "certainty"), [(0.5, "within rounding"), (1.5, "exceeded")])
def test_rounding_of_rows_explains_so_much_beside_a_path(share: float, certainty: str) -> None:
    """By the module's slack: twice the length of the arm, or 2 where that is longer, times what all joints are off."""
    t, q, _ = (each.copy() for each in line(60))
    off, robot, path = np.full(6, 1e-6), plan().moves[0].robot, plan().moves[0].planned.tool
    slack = 2 * max(characteristic_length(robot), 1.0) * off.sum()
    q[60] += moved(q[60], (path.tolerance.position + share * slack) * aside(), np.zeros(3))
    motion = RecordedMotion(
        t, q, None, None, None, None, np.zeros(len(t), int), None, Resolution(0.0, off, off, off), "rows"
    )
    required = Requirements(robot, tool=lambda: ToolJudge(robot, {0: path}))
    findings = judge_motion(lambda: [motion], required).findings
    (found,) = [each for each in findings if (each.kind, each.quantity) == ("deviation", "position")]
    assert (found.certainty, found.severity) == (certainty, "error")


@pytest.mark.parametrize("beyond", [5e-5, 5e-6])
def test_a_little_more_than_its_limit_is_more(beyond: float) -> None:
    t = 0.3 * np.arange(5)
    q = np.zeros((5, 2))
    q[:, 0] = t
    (found,) = of_tool(rows(t, q), link(speed=LEVER / (1 + beyond)))
    assert (found.severity, found.certainty) == ("error", "exceeded")


def test_one_interval_that_is_long_leaves_nothing_unresolved() -> None:
    t = np.append(PERIOD * np.arange(10), 0.5)
    q, qd = np.zeros((11, 2)), np.zeros((11, 2))
    q[:, 0], qd[:, 0] = t, 1.0
    qd[4:6, 0] = 0.8
    (found,) = of_tool(rows(t, q, qd), link(speed=LEVER * 1.05))
    assert found.severity == "error"


@pytest.mark.parametrize(("key", "excess"), [("acceleration", 20.0), ("jerk", 600.0)])
def test_rounding_counts_with_the_speed_at_which_the_tool_is_turned(key: str, excess: float) -> None:
    """At 10 rad/s: a speed that is off by 15/8 of 2 off puts L w^2 off by 37.5 off, and L w^3 by 562 off."""
    t, rate, off = np.arange(4.0), 10.0, 1e-4
    q, qd = np.zeros((4, 2)), np.zeros((4, 2))
    q[:, 0], qd[:, 0] = rate * t, rate
    size = LEVER * rate ** (2 if key == "acceleration" else 3)
    (found,) = of_tool(rows(t, q, qd, 0 * q, off=off), link(**{key: size - excess * off}), "quintic")
    assert (found.kind, found.certainty) == (f"tool_{key}", "within rounding")
    (found,) = of_tool(rows(t, q, qd, 0 * q, off=off), link(**{key: 0.99 * size}), "quintic")
    assert found.certainty == "exceeded"


@pytest.mark.parametrize("first", [True, False])
def test_jerk_of_the_tool_is_judged_where_some_rows_have_accelerations(first: bool) -> None:
    t = np.arange(8.0)
    stated = (np.arange(8) < 4) == first
    q, still = np.zeros((8, 2)), np.zeros((8, 2))
    q[2 if first else 6 :, 0] = 1e-3  # within those that have
    qdd = np.where(stated[:, None], 0.0, np.full((8, 2), np.nan))
    motion = rows(t, q, still, qdd)
    (found,) = of_tool(motion, link(jerk=0.9 * LEVER * 60e-3), "jtc")
    assert found.value == pytest.approx(LEVER * 60e-3, rel=1e-4)
    assert of_tool(motion, link(jerk=1.01 * LEVER * 60e-3), "jtc") == []


@pytest.mark.parametrize("key", ["acceleration", "angular_acceleration", "jerk", "angular_jerk"])
def test_straight_lines_between_rows_say_nothing_of_accelerations_of_the_tool(key: str) -> None:
    """The motion that was sampled may bend as it likes between rows that state positions alone."""
    q, t = np.zeros((10, 2)), PERIOD * np.arange(10)
    q[:, 0] = 5.0 * t
    assert of_tool(rows(t, q), link(**{key: 1e-3})) == []


@pytest.mark.parametrize("pieces", [(30, 90), (90, 30)])
def test_of_fast_pieces_the_fastest_one_is_named(
    pieces: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are not looked at together."""
    monkeypatch.setattr(recorded_tool, "_PIECES", 64)
    q = np.zeros((100, 2))
    for piece, size in zip(pieces, (0.01, 0.02), strict=True):
        q[piece + 1 :, 0] += size
    (found,) = of_tool(rows(0.02 * np.arange(100), q), link(speed=0.1))
    assert (found.value, found.row) == (
        pytest.approx(LEVER * 0.02 / 0.02),
        pytest.approx(pieces[1] + 1, abs=1),
    )


@pytest.mark.parametrize("jump", [1, 3, 5])
@pytest.mark.parametrize(
    ("turn", "slide", "smooth"), [(0.035, 0.0, True), (0.045, 0.0, False), (0.0, 0.045, False)]
)
def test_joints_change_their_branch_where_the_tool_goes_on_as_before(
    turn: float, slide: float, smooth: bool, jump: int
) -> None:
    """The tool turns by 0.01 from row to row; a step of up to four times that is none of the tool."""
    steps = np.tile([0.01, 0.0], (6, 1))
    steps[jump] = [turn, slide] if turn else [0.01, slide]
    q = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    assert ToolJudge(link()).changes_branch(q, jump) == smooth


@pytest.mark.parametrize(("step", "smooth"), [(0.0, True), (3e-7, True), (3e-6, False)])
def test_joints_that_jump_while_the_tool_stands_change_their_branch(step: float, smooth: bool) -> None:
    """Of the tool that stands, a step of a micrometre or so is rounding."""
    q = np.zeros((6, 2))
    q[4:, 1] = step * LEVER  # in lengths of the arm
    assert ToolJudge(link()).changes_branch(q, 3) == smooth


def of_wrist(q: np.ndarray, size: int) -> list[Finding]:
    """Return singularities of a wrist, whose last axis goes along the first one's where its middle joint is at 0."""
    tilts = (-np.pi / 2, np.pi / 2, 0.0)
    joints = tuple(Joint(f"q{k}", "revolute", alpha=alpha) for k, alpha in enumerate(tilts))
    wrist = Robot("wrist", joints, unlimited(3), "standard", np.eye(4), np.eye(4))
    motion = rows(PERIOD * np.arange(len(q)), q)
    required = Requirements(wrist, tool=lambda: ToolJudge(wrist))
    judged = judge_motion(lambda: blocks_of_motion(motion, size), required).findings
    return [each for each in judged if each.kind == "singularity"]


@SIDES
@pytest.mark.parametrize(("count", "size"), [(40, 40), (40, 7), (600, 150)])
@pytest.mark.parametrize("row", [0, 2, 12, 30, -1])
def test_the_one_row_at_a_singularity_is_found(row: int, count: int, size: int, side: float) -> None:
    """Each row is more than a twentieth of a radian from the one before, so that all are looked at.

    Of axes z, x and one that is d off z the singular values are root 2, 1 and d / root 2.
    """
    q, row = np.zeros((count, 3)), row % count
    q[:, 0] = side * 0.06 * np.arange(count)
    q[:, 1] = np.minimum(0.06 * np.abs(np.arange(count) - row), 1.5) + 1e-5
    (found,) = of_wrist(q, size)
    assert (found.severity, found.row, found.time) == ("warning", row + 1, pytest.approx(PERIOD * row))
    assert (found.value, found.method) == (pytest.approx(0.5e-5, rel=1e-3), "sampled")


@pytest.mark.parametrize("size", [40, 7])
def test_of_rows_near_to_a_singularity_the_nearest_one_is_named(size: int) -> None:
    q = np.zeros((40, 3))
    q[:, 0], q[:, 1] = 0.025 * np.arange(40), 0.3  # every second row is looked at
    q[[18, 20, 22], 1] = 1.5e-3, 1e-5, 1.2e-3
    (found,) = of_wrist(q, size)
    assert (found.row, found.count, found.time) == (21, 3, pytest.approx(20 * PERIOD))


@pytest.mark.parametrize("size", [1e-4, 1e4])
def test_an_arm_is_as_far_from_its_singularities_as_the_same_one_in_another_size(size: float) -> None:
    both = tuple(Joint(name, "revolute", a=size) for name in ("shoulder", "elbow"))
    arm = Robot("arm", both, unlimited(2), "standard", np.eye(4), np.eye(4))
    q = np.stack([0.06 * np.arange(20), np.full(20, np.pi / 2)], axis=1)
    required = Requirements(arm, tool=lambda: ToolJudge(arm))
    judged = judge_motion(lambda: [rows(PERIOD * np.arange(20), q)], required).findings
    assert "singularity" not in [each.kind for each in judged]


@pytest.mark.parametrize("size", [1200, 100])
def test_a_slow_arm_that_stays_at_a_singularity_is_found(size: int) -> None:
    """It moves by a twentieth of a radian in 500 rows, of which no block has as many."""
    q = np.zeros((1200, 3))
    q[:, 0] = 1e-4 * np.arange(1200)
    q[:, 1] = np.maximum(0.06 - 1e-4 * np.arange(1200), 0.0)
    (found,) = of_wrist(q, size)
    assert 600 < found.row <= 1002
    assert (found.value < 1e-3, found.count) == (True, 1)


@SIDES
@pytest.mark.parametrize("begins", [True, False])
def test_rounding_of_speeds_counts_with_the_speed_at_the_peak(begins: bool, side: float) -> None:
    """An arm at 10 rad/s that brakes, or speeds up: L w^2 is largest where it is fastest, and off by 2 L w off."""
    off, t = 1e-4, 20.0 + np.arange(2.0)
    q, qd = np.zeros((2, 2)), np.zeros((2, 2))
    q[1, 0], qd[0 if begins else 1, 0] = side * 5.0, side * (10.0 + 0.99 * off)
    roundings = Resolution(0.0, np.zeros(2), np.array([off, 0.0]), np.zeros(2))
    motion = replace(rows(t, q, qd), resolution=roundings)
    truth = LEVER * np.hypot(10.0**2, 10.0)
    (found,) = of_tool(motion, link(acceleration=truth))
    assert (found.certainty, found.value) == (
        "within rounding",
        pytest.approx(truth + 20 * LEVER * off, abs=1e-4),
    )
    (found,) = of_tool(motion, link(acceleration=truth - 200 * LEVER * off))
    assert found.certainty == "exceeded"


@SIDES
def test_rounding_counts_with_the_speed_between_two_rows_at_rest(side: float) -> None:
    """A turn by d from rest to rest in a cubic: at its middle L w^2 with w = 3/2 d, of which w is off by 3 off."""
    off, turn = 1e-4, 10.0
    q = np.array([[-0.99 * off * side, 0.0], [side * (turn + 0.99 * off), 0.0]])
    roundings = Resolution(0.0, np.array([off, 0.0]), np.zeros(2), np.zeros(2))
    motion = replace(rows(np.arange(2.0), q, 0.0 * q), resolution=roundings)
    (found,) = of_tool(motion, link(acceleration=LEVER * (1.5 * turn) ** 2))
    assert (found.certainty, found.time) == ("within rounding", pytest.approx(0.5, abs=0.05))


@SIDES
def test_rounding_counts_with_the_speeds_of_joints_that_turn_against_each_other(side: float) -> None:
    """The second link keeps its direction and the tool goes around, which only the first one's speed makes."""
    off, rate, t = 1e-4, 100.0, np.arange(3.0)
    both = tuple(Joint(name, "revolute", a=0.5) for name in ("shoulder", "elbow"))
    limits = replace(unlimited(2), tcp=ToolLimits(acceleration=0.5 * rate**2))
    arm = Robot("arm", both, limits, "standard", np.eye(4), np.eye(4))
    turns = side * np.array([1.0, -1.0])
    motion = rows(t, rate * t[:, None] * turns, np.tile((rate + 0.99 * off) * turns, (3, 1)))
    rounded = replace(motion, resolution=Resolution(0.0, np.zeros(2), np.full(2, off), np.zeros(2)))
    (found,) = of_tool(rounded, arm)
    assert found.certainty == "within rounding"
    assert found.value - found.limit == pytest.approx(2 * 0.5 * rate * 0.99 * off, rel=0.15)


@SIDES
def test_rounding_of_the_jerk_of_a_turning_tool_is_the_sum_of_what_its_rates_are_off_by(side: float) -> None:
    """Of a jerk j and a turn at w: L (j - w^3) and 3 L w a, turned by the angle itself: by the rule of Leibniz.

    At 10 rad/s with a rounding of q in quintics of a second each: 15/4, 20 / root 3 and 120 of it in its rates.
    """
    off, rate, t = 1e-6, 10.0, np.arange(3.0)
    q, qd = np.zeros((3, 2)), np.zeros((3, 2))
    q[:, 0], qd[:, 0] = side * rate * t, side * rate
    roundings = Resolution(0.0, np.array([off, 0.0]), np.zeros(2), np.zeros(2))
    motion = replace(rows(t, q, qd, 0 * q), resolution=roundings)
    (found,) = of_tool(motion, link(jerk=0.9 * LEVER * rate**3), "quintic")
    own, turned = 120 + 3 * (rate * 20 / 3**0.5 + rate**2 * 15 / 4), rate**3
    assert found.rounding == pytest.approx(LEVER * (own + turned) * off, rel=2e-2)


@SIDES
def test_rounding_of_a_turn_counts_three_times_in_the_jerk_of_the_tool(side: float) -> None:
    """At 4 rad/s: 15/8 of twice the rounding more speed, and its cube: 3 L w^2 of it, beside 60 L of its own jerk."""
    off, rate, t = 1e-4, 4.0, np.arange(2.0)
    q, qd = np.zeros((2, 2)), np.zeros((2, 2))
    q[:, 0], qd[:, 0] = side * (rate * t + 0.99 * off * np.array([-1, 1])), side * rate
    roundings = Resolution(0.0, np.array([off, 0.0]), np.zeros(2), np.zeros(2))
    motion = replace(rows(t, q, qd, 0 * q), resolution=roundings)
    (found,) = of_tool(motion, link(jerk=LEVER * rate**3), "quintic")
    assert found.value == pytest.approx(
        LEVER * (rate**3 + (3 * rate**2 * 15 / 4 + 60) * 0.99 * off), rel=1e-4
    )
    assert found.certainty == "within rounding"


@SIDES
@pytest.mark.parametrize(("key", "power"), few([("speed", 1), ("acceleration", 2), ("jerk", 3)], 3))
def test_rounding_of_a_slide_that_is_swung_counts_with_its_length(key: str, power: int, side: float) -> None:
    """A beam at 25 rad/s, and a slide along it, which is a rounding further out.

    In the jerk of the tool that is off w^3, and what quintics of a second make of the slide half as much.
    """
    off, rate, t = 1e-4, 25.0, np.arange(3.0)
    joints = Joint("turn", "revolute", alpha=np.pi / 2), Joint("out", "prismatic")
    limits = replace(unlimited(2), tcp=ToolLimits(**{key: 0.5 * rate**power}))
    beam = Robot("beam", joints, limits, "standard", np.eye(4), np.eye(4))
    q, qd = np.zeros((3, 2)), np.zeros((3, 2))
    q[:, 0], q[:, 1], qd[:, 0] = side * rate * t, 0.5 + 0.99 * off, side * rate
    roundings = Resolution(0.0, np.array([0.0, off]), np.zeros(2), np.zeros(2))
    motion = replace(rows(t, q, qd, 0 * q), resolution=roundings)
    (found,) = of_tool(motion, beam, "quintic")
    assert found.value == pytest.approx((0.5 + 0.99 * off) * rate**power, rel=1e-6)
    assert found.certainty == "within rounding"
    farther = replace(motion, q=q + np.array([0.0, 20 * off]))
    assert [each.certainty for each in of_tool(farther, beam, "quintic")] == ["exceeded"]


@pytest.mark.parametrize(("key", "lever"), [("speed", LEVER), ("angular_speed", 1.0)])
def test_rows_at_which_the_tool_is_too_fast_are_counted_wherever_it_goes(key: str, lever: float) -> None:
    """Half a turn at an even speed, of which each direction in space has its share; then as far, but slower."""
    t = np.append(np.linspace(0.0, np.pi, 41), np.pi + np.linspace(0.0, 1.5 * np.pi, 41)[1:])
    turn = np.append(t[:41], np.pi + (t[41:] - np.pi) / 1.5)
    (found,) = of_tool(rows(t, np.stack([turn, 0.0 * t], axis=1)), link(**{key: 0.9 * lever}))
    assert found.count == 40


def test_of_a_path_whose_segments_overlap_it_is_said_that_it_is_not_judged() -> None:
    paths = {move: SimpleNamespace(path=path, overlaps=not path) for move, path in ((3, None), (5, False))}
    notes = ToolJudge(link(), {0: None, **paths}).notes
    assert notes == [f"move {k}: its segments overlap, the distance from them is not judged" for k in (3, 5)]
