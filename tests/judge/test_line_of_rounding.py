"""The line between exceeded and within rounding: planted excesses of half a rounding, of 1.5 and of 2.9.

Each motion is so simple that what rounding may do to it is a product of two numbers: the rows may be off by
so much, and the largest slope of a Hermite interpolant by its displacement is known.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from judge.test_between_rows import LAW, OVER, PEAK, approach, over, peaked
from recorded_rows import bare_robot

from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Limits, LinkInertia, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

PLANTED = [(0.5, "within rounding"), (0.9, "within rounding"), (1.5, "exceeded"), (2.9, "exceeded")]
"""Excess in roundings, and what is certain about it."""
SIDES = [1, -1]
OFF = 1e-6  # by which a column is off
T = np.array([0.0, 0.3, 0.8, 1.2, 1.9])  # no multiples of a period


def rows(q: object, qd: object = None, qdd: object = None, /, **off: float) -> RecordedMotion:
    """Return rows of one joint, or of several, with the roundings of some columns; the others are exact."""
    columns = [None if each is None else np.array(each, dtype=float) for each in (q, qd, qdd)]
    columns = [each[:, None] if each is not None and each.ndim == 1 else each for each in columns]
    roundings = [np.full(columns[0].shape[1], off.get(name, 0.0)) for name in ("q", "qd", "qdd")]
    resolution = Resolution(off.get("late", 0.0), *roundings)
    return RecordedMotion(T, *columns, None, None, None, None, resolution, "planted")


def one_limit(kind: str, side: int, size: float) -> Limits:
    """Return a limit of one kind and one direction; a tenth more is allowed the other way."""
    bounds = [[-size * 1.1, size] if side > 0 else [-size, size * 1.1]]
    return replace(unlimited(1), **{kind: np.array(bounds)})


def found_in(motion: RecordedMotion, robot: Robot, kind: str, interpolate: str | None) -> Finding:
    """Return what is over a limit: one kind."""
    judgement = judge_motion(lambda: [motion], Requirements(robot, interpolate=interpolate))
    (found,) = [each for each in judgement.findings if each.rule == "limit"]
    assert found.kind == kind
    return found


def moved_in(piece: int, by: float) -> tuple[list[float], dict[str, float]]:
    """Return positions that change in one piece only."""
    return [0.0] * (piece + 1) + [by] * (T.size - piece - 1), {"q": OFF}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("row", [0, 2, 4])
def test_positions_that_rows_state(row, planted, certainty, side):
    q = np.zeros(T.size)
    q[row] = side
    limits = one_limit("position", side, 1.0 - planted * OFF)
    found = found_in(rows(q, q=OFF), bare_robot(limits), "position", None)
    assert (found.certainty, found.severity) == (certainty, "error")
    assert (found.row, found.value) == (row + 1, side)
    assert found.rounding == pytest.approx(OFF, rel=1e-6)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", range(4))
def test_velocities_that_two_rows_state(piece, planted, certainty, side):
    """Both may be off, so that their difference is off by twice that."""
    q, off = moved_in(piece, 0.5 * side)
    length = T[piece + 1] - T[piece]
    limits = one_limit("velocity", side, (0.5 - planted * 2 * OFF) / length)
    found = found_in(rows(q, **off), bare_robot(limits), "velocity", "linear")
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.value == pytest.approx(0.5 * side / length, rel=1e-9)
    assert found.rounding == pytest.approx(2 * OFF / length, rel=1e-6)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", range(4))
def test_velocities_that_positions_make_certain_where_a_column_is_coarse(piece, planted, certainty, side):
    """The column hides ten times as much of the curve; between two rows some speed is that of their difference."""
    q, off = moved_in(piece, 0.5 * side)
    length = T[piece + 1] - T[piece]
    qd = np.zeros(T.size)
    qd[piece : piece + 2] = 0.5 * side / length
    limits = one_limit("velocity", side, (0.5 - planted * 2 * OFF) / length)
    motion = rows(q, qd, **off, qd=20 * OFF / length)
    judgement = judge_motion(lambda: [motion], Requirements(bare_robot(limits), interpolate="cubic"))
    found = [each for each in judgement.findings if each.kind == "velocity" and each.rule == "limit"]
    assert certainty in {each.certainty for each in found}
    assert ("exceeded" in {each.certainty for each in found}) == (certainty == "exceeded")


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", range(4))
def test_time_stamps_that_are_off(piece, planted, certainty, side):
    """Both stamps of an interval may be: it may be shorter by twice that."""
    q, _ = moved_in(piece, 0.5 * side)
    length = T[piece + 1] - T[piece]
    fastest, speed = 0.5 / (length - 2 * OFF), 0.5 / length
    limits = one_limit("velocity", side, speed - planted * (fastest - speed))
    found = found_in(rows(q, late=OFF), bare_robot(limits), "velocity", "linear")
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.rounding == pytest.approx(fastest - speed, rel=1e-6)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("row", [0, 2, 4])
def test_rates_that_a_row_states(row, order, planted, certainty, side):
    """Linear rates, largest at one row: its column says more of it than rougher columns and their curve."""
    kind, lengths, rate = ("velocity", "acceleration")[order - 1], np.diff(T), np.full(T.size, 0.5 * side)
    rate[row] = side

    def summed(changes: np.ndarray) -> np.ndarray:
        return np.append(0.0, np.cumsum(changes))

    columns = [summed(lengths * (rate[1:] + rate[:-1]) / 2), rate]
    if order == 2:
        bend = lengths**2 * np.diff(rate) / 12
        columns.insert(0, summed(lengths * (columns[0][1:] + columns[0][:-1]) / 2 - bend))
    off = {"q": 1e-3, "qd": OFF} if order == 1 else {"q": 1e-3, "qd": 1e-3, "qdd": OFF}
    limits = one_limit(kind, side, 1.0 - planted * OFF)
    found = found_in(rows(*columns, **off), bare_robot(limits), kind, ("cubic", "quintic")[order - 1])
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.rounding > 1e-4


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("back", [False, True])
def test_numbers_of_few_digits_are_off_by_a_share_of_the_larger_one(back, planted, certainty, side):
    """From 0 to 1 or back: both are taken to be as rough as the 1, so that their difference is off by twice that."""
    length, q = T[3] - T[2], np.where((T[2] < T) != back, side * 1.0, 0.0)
    moves = -side if back else side
    limits = one_limit("velocity", moves, (1.0 - planted * 2 * OFF) / length)
    motion = rows(q)
    motion = replace(motion, resolution=replace(motion.resolution, relative=(OFF,) * 3))
    found = found_in(motion, bare_robot(limits), "velocity", "linear")
    assert (found.certainty, found.severity, found.row) == (certainty, "error", 3)
    assert found.rounding == pytest.approx(2 * OFF / length, rel=1e-6)


PEAKS = {
    ("cubic", "velocity"): (1.5, 1),
    ("cubic", "acceleration"): (6.0, 2),
    ("quintic", "velocity"): (1.875, 1),
    ("quintic", "acceleration"): (10 / sqrt(3), 2),
    ("quintic", "jerk"): (60.0, 3),
}
"""Largest derivative from rest to rest over a distance 1 in a time 1, and its order (Biagiotti, section 2.1)."""


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", [0, 1, 3])
@pytest.mark.parametrize("case", PEAKS)
def test_peaks_that_only_the_curve_has(case, piece, planted, certainty, side):
    """All rows rest; one distance may be off by twice the rounding of positions."""
    (interpolate, kind), (factor, order) = case, PEAKS[case]
    q, off = moved_in(piece, 0.5 * side)
    share = factor / (T[piece + 1] - T[piece]) ** order
    nothing = np.zeros(T.size)
    motion = rows(q, nothing, nothing if interpolate == "quintic" else None, **off)
    limits = one_limit(kind, side, share * (0.5 - planted * 2 * OFF))
    found = found_in(motion, bare_robot(limits), kind, interpolate)
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.value == pytest.approx(side * share * 0.5, rel=1e-9)
    assert found.rounding == pytest.approx(share * 2 * OFF, rel=1e-6)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", [0, 1, 3])
def test_speeds_by_position(piece, planted, certainty, side):
    """The velocity is off by that of two positions, the bound by that of the distance: both count."""
    length, d, o = T[piece + 1] - T[piece], 20.0, 0.1
    q, off = moved_in(piece, 0.5 * side)
    speed = 0.5 / length

    def left(excess: float) -> float:
        """Return the distance to the end at which the bound is passed by so much."""
        return (speed - excess + o) ** 2 / (2 * d)

    def rounding(x: float) -> float:
        return 2 * OFF / length + np.sqrt(2 * d * (x + OFF)) - np.sqrt(2 * d * x)

    x = left(planted * rounding(left(0.0)))
    end = 0.5 + x
    position = [[-9.0, end]] if side > 0 else [[-end, 9.0]]
    limits = replace(unlimited(1), position=np.array(position), velocity_by_position=np.array([[d, o]]))
    found = found_in(rows(q, **off), bare_robot(limits), "velocity_by_position", "linear")
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.value == pytest.approx(side * speed, rel=1e-9)
    assert found.rounding == pytest.approx(rounding(x), rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(("planted", "certainty"), PLANTED)
@pytest.mark.parametrize("piece", [0, 1, 3])
@pytest.mark.parametrize("turned", [0.0, np.pi], ids=["along", "against"])
@pytest.mark.parametrize("limited", [0, 1])
def test_forces_of_two_slides(limited, turned, piece, planted, certainty, side):
    """The first one moves both masses, the second one its own: forces are off by what both accelerations are.

    Where the second one slides the other way, its acceleration takes from the force: its error still adds.
    """
    link = LinkInertia(2.0, (0.0, 0.0, 0.0), (0.0,) * 6), LinkInertia(3.0, (0.0, 0.0, 0.0), (0.0,) * 6)
    joints = tuple(Joint(f"s{k}", "prismatic", alpha=k * turned, link=link[k]) for k in range(2))
    by, off = moved_in(piece, 0.5 * side)
    share = 10 / sqrt(3) / (T[piece + 1] - T[piece]) ** 2
    mass, together = ((2 + 3, 2 + 3 + 3), (3, 3 + 3))[limited]
    rounding = together * share * 2 * OFF
    size = mass * share * 0.5 - planted * rounding
    effort = np.tile([-np.inf, np.inf], (2, 1))
    effort[limited] = [-np.inf, size] if side > 0 else [-size, np.inf]
    limits = replace(unlimited(2), effort=effort)
    arm = Robot("slides", joints, limits, "modified", np.eye(4), np.eye(4), gravity=np.zeros(3))
    q, nothing = np.zeros((T.size, 2)), np.zeros((T.size, 2))
    q[:, limited] = by
    found = found_in(rows(q, nothing, nothing, **off), arm, "effort", "quintic")
    assert (found.certainty, found.severity) == (certainty, "error")
    assert found.value == pytest.approx(side * mass * share * 0.5, rel=1e-5)
    assert found.rounding == pytest.approx(rounding, rel=1e-5)


@pytest.mark.parametrize("side", SIDES)
def test_where_the_distance_lets_nobody_approach_each_speed_is_too_fast(side):
    """At 0.4 within o^2 / (2 d) = 0.5 of the end; away from it nothing is wrong."""
    t, q = np.array([0.0, 0.5, 1.0]), np.array([0.0, 0.2, 0.4])
    limits = replace(
        unlimited(1),
        position=np.array([sorted([side * 0.49, -side * 9.0])]),
        velocity_by_position=np.array([[1.0, 1.0]]),
    )
    exact = Resolution(0.0, *[np.full(1, 1e-6)] * 3)
    for places, verdict in ((q, "exceeded"), (q[::-1], "satisfied")):
        motion = RecordedMotion(t, side * places[:, None], None, None, None, None, None, None, exact, "rows")
        judged = judge_motion(lambda rows=motion: [rows], Requirements(bare_robot(limits)))
        assert judged.verdict == verdict
        for found in judged.findings:
            assert (found.limit, found.value) == (pytest.approx(0.0, abs=1e-9), pytest.approx(side * 0.4))


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize(
    ("size", "off", "severity"), [(1.0, 1e-5, "warning"), (1.5, 0.0, "error"), (1.5, 1e-5, "warning")]
)
def test_rounding_explains_of_an_approach_what_a_change_of_the_law_leaves(size, off, severity, side):
    motion = peaked(1, 2, size * LAW, side)
    rounded = replace(motion, resolution=Resolution(0.0, np.full(1, off), np.zeros(1), np.zeros(1)))
    (found,) = over(rounded, bare_robot(approach(side, PEAK - OVER)))
    assert (found.kind, found.severity) == ("velocity_by_position", severity)
