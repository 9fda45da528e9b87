"""Rows of a page: what is packed can be unpacked, no visible jump is lost, and the page stays small."""

from __future__ import annotations

from base64 import b64decode
from typing import Any

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.player.rows import (
    FRAMES,
    MOST_ROWS,
    DrawnRows,
    frame_times,
    packed,
    rows_of_curve,
    rows_of_samples,
)


def unpacked(columns: dict[str, Any]) -> np.ndarray:
    """Written from the description: little-endian levels of some bytes between the extremes of a column."""
    low, high, width = np.array(columns["low"]), np.array(columns["high"]), columns["width"]
    raw = np.frombuffer(b64decode(columns["values"]), np.uint8).reshape(len(low), -1, width).astype(float)
    levels = raw @ 256.0 ** np.arange(width)
    return low[:, None] + levels * (high - low)[:, None] / (256.0**width - 1)


@pytest.mark.parametrize("width", [2, 3])
def test_packed_numbers_come_back_within_half_a_level(width: int) -> None:
    columns = np.random.default_rng(1).uniform(-3, 7, (5, 40))
    columns[3] = 2.5  # constant
    error = np.abs(unpacked(packed(columns, width)) - columns)
    assert error.max() <= 0.5001 * 10 / (256**width - 1)
    assert error[3].max() == 0
    assert (
        error[np.arange(5), columns.argmax(axis=1)] <= 1e-15
    ).all()  # a peak stands at its limit, not above


def test_frames_are_sixty_a_second_and_hold_both_ends() -> None:
    times = frame_times(0.0, 2.01)
    assert times[[0, -1]].tolist() == [0, 2.01]
    assert np.diff(times)[:-1] == pytest.approx(1 / 60, abs=1e-12)
    assert frame_times(1.0, 1.0).tolist() == [1.0]


def test_an_hour_has_fewer_frames_a_second() -> None:
    assert frame_times(0.0, 3600.0).size <= MOST_ROWS
    assert 60 * FRAMES < frame_times(0.0, 60.0).size <= 60 * FRAMES + 1


def trapezoid() -> PiecewisePolynomial:
    """1 m in 3 s, acceleration 0.5 m/s^2 at either end for 1 s: the acceleration steps at 1 s and at 2 s."""
    return PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0, 3.0]),
        np.array([[0.25, 0, -0.25], [0, 0.5, 0.5], [0, 0.25, 0.75]])[:, :, None],
    )


def test_a_step_in_acceleration_has_a_row_on_either_side() -> None:
    rows = rows_of_curve(trapezoid(), [], [])
    acceleration = rows.values["qdd"][:, 0]
    for time, before, after in ((1.0, 0.5, 0.0), (2.0, 0.0, -0.5)):
        assert acceleration[rows.times == time].tolist() == [before, after]
    assert (np.diff(rows.times) >= 0).all()


def test_smooth_breaks_have_no_rows_but_borders_and_findings_have() -> None:
    smooth = PiecewisePolynomial(
        np.array([0.0, 0.505, 1.0]), np.array([[1.0, 1.0], [0.0, 0.505]])[:, :, None]
    )
    assert 0.505 not in rows_of_curve(smooth, [], []).times
    assert (rows_of_curve(smooth, [0.505], []).times == 0.505).sum() == 2
    assert (rows_of_curve(smooth, [], [0.7077]).times == 0.7077).sum() == 1


def test_of_very_many_jumps_the_largest_have_rows() -> None:
    breaks = np.linspace(0, 1, 1001)
    velocity = np.random.default_rng(2).uniform(0.9, 1.1, 1000)
    velocity[400:] += 5
    positions = np.append(0, np.cumsum(velocity * 1e-3))[:-1]
    rows = rows_of_curve(PiecewisePolynomial(breaks, np.stack([velocity, positions])[:, :, None]), [], [])
    assert rows.times.size <= 61 + 2 * 30  # half a jump a frame
    assert (rows.times == breaks[400]).sum() == 2


def test_a_long_file_keeps_its_extremes() -> None:
    times = np.arange(20_001) / 2000
    q = np.sin(times)[:, None]
    q[7_777] = 4
    rows, kept = rows_of_samples(times, {"q": q})
    assert kept.size < 700
    assert rows.values["q"].max() == 4
    assert (rows.times == times[kept]).all()


def test_a_long_file_keeps_the_lowest_and_the_highest_of_every_column_of_every_quantity() -> None:
    times = np.arange(20_001) / 2000
    chance = np.random.default_rng(4)
    values = {name: chance.uniform(-1, 1, (times.size, 2)) for name in ("q", "qd", "tau")}
    for k, each in enumerate(values.values()):
        each[3_001 + 11 * k, 0], each[5_003 + 13 * k, 1] = -3, 4
        each[7_007 + 17 * k, 0], each[9_011 + 19 * k, 1] = 5, -6
    rows, kept = rows_of_samples(times, values)
    assert kept.size < 700
    for name, each in values.items():
        assert rows.values[name].min(axis=0).tolist() == each.min(axis=0).tolist()
        assert rows.values[name].max(axis=0).tolist() == each.max(axis=0).tolist()


def test_of_several_joints_each_shows_its_jumps_and_small_ones_of_any_order_are_seen() -> None:
    """The acceleration of the second joint steps by a hundredth at 1 s, its jerk at 2 s; the first one rests."""
    breaks, coefficients = np.array([0.0, 1.0, 2.0, 3.0]), np.zeros((4, 3, 2))
    coefficients[3, :, 0] = 7.0
    coefficients[:, :, 1] = np.array([[0, 0.5, 1, 0], [0, 0.505, 2, 1.5], [1e-3, 0.505, 3.01, 4.005]]).T
    rows = rows_of_curve(PiecewisePolynomial(breaks, coefficients), [], [])
    assert [(rows.times == time).sum() for time in (1.0, 2.0)] == [2, 2]
    after = rows_of_curve(PiecewisePolynomial(breaks, coefficients), [], [7.0, -1.0])
    assert (after.times[0], after.times[-1]) == (0.0, 3.0)


def test_positions_and_efforts_are_packed_finer_than_rates() -> None:
    values = {name: np.linspace(0, 1, 9)[:, None] for name in ("q", "qd", "tau")}
    scene = DrawnRows(np.arange(9.0), values).packed()["quantities"]
    assert {name: each["width"] for name, each in scene.items()} == {"q": 3, "qd": 2, "tau": 3}


def test_a_short_file_keeps_every_row() -> None:
    times = np.arange(11) / 10
    assert rows_of_samples(times, {"q": times[:, None]})[1].tolist() == list(range(11))
