"""Curves through rows against the controller, and against the polynomials that the rows are of."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from trajcli.errors import InputError
from trajcli.judge.reconstruction import chosen_interpolation, reconstruct, stated_orders
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

sys.path.append(str(Path(__file__).parent.parent / "streams"))
import trajectory_controller

TIMES = np.array([0.0, 0.25, 1.0, 1.125])


def motion(q: np.ndarray, qd: np.ndarray | None = None, qdd: np.ndarray | None = None) -> RecordedMotion:
    nothing = np.zeros(q.shape[1])
    exact = Resolution(0.0, nothing, nothing, nothing)
    return RecordedMotion(TIMES, q, qd, qdd, None, None, None, None, exact, "rows")


def states(seed: int) -> list[np.ndarray]:
    return [np.random.default_rng([seed, order]).normal(size=(len(TIMES), 3)) for order in range(3)]


def message(q: np.ndarray, qd: np.ndarray | None, qdd: np.ndarray | None) -> dict:
    """Return the goal that the controller gets; NaN is a field that a point does not have."""
    points = []
    for k, time in enumerate(TIMES):
        point = {"time_from_start": {"sec": int(time), "nanosec": round(time % 1 * 1e9)}}
        for key, rows in (("positions", q), ("velocities", qd), ("accelerations", qdd)):
            present = rows is not None and np.isfinite(rows[k]).all()
            point[key] = rows[k].tolist() if present else []
        points.append(point)
    return {"joint_names": ["a", "b", "c"], "points": points}


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("asked", [None, "jtc"])
def test_curves_are_what_the_controller_runs(count: int, asked: str | None) -> None:
    q, qd, qdd = [*states(1)[:count], None, None][:3]
    curve = reconstruct(motion(q, qd, qdd), asked)
    times = np.linspace(0.0, 1.124, 200)
    run = trajectory_controller.run(message(q, qd, qdd), times)
    for order in range(3 if count > 1 else 1):
        assert np.abs(curve.evaluate(times, order) - run[order]).max() < 1e-9 * np.abs(run[order]).max()


@pytest.mark.parametrize(("asked", "orders"), [("linear", 1), ("cubic", 2), ("quintic", 3)])
def test_columns_beyond_what_is_asked_for_are_not_looked_at(asked: str, orders: int) -> None:
    """Both ends of each piece are as stated, by polynomials of least degree."""
    q, qd, qdd = states(3)
    curve = reconstruct(motion(q, qd, qdd), asked)
    assert curve.coefficients.shape[0] == 2 * orders
    for order, values in enumerate((q, qd, qdd)[:orders]):
        for side, rows in (("right", slice(0, -1)), ("left", slice(1, None))):
            found = curve.evaluate(TIMES[rows], order, side=side)
            np.testing.assert_allclose(found, values[rows], atol=1e-9)


def test_the_controller_decides_segment_by_segment() -> None:
    q, qd, qdd = states(2)
    qdd[1] = np.nan  # cubic beside it
    qd[3], qdd[3] = np.nan, np.nan  # and linear before it
    curve = reconstruct(motion(q, qd, qdd), "jtc")
    times = np.linspace(0.0, 1.124, 200)
    assert (
        np.abs(curve.evaluate(times) - trajectory_controller.run(message(q, qd, qdd), times)[0]).max() < 1e-9
    )


def test_upsampling_is_the_spline_with_rest_at_both_ends() -> None:
    q = states(3)[0]
    curve = reconstruct(motion(q), "jtc-upsampling")
    spline = CubicSpline(TIMES, q, bc_type="clamped")
    times = np.linspace(0.0, 1.125, 200)
    for order in range(3):
        assert np.allclose(curve.evaluate(times, order), spline(times, order), rtol=0, atol=1e-9)


def test_hold_keeps_each_row_until_the_next() -> None:
    q = states(4)[0]
    curve = reconstruct(motion(q), "hold")
    assert np.array_equal(curve.evaluate(np.array([0.0, 0.2, 0.25, 0.9])), q[[0, 0, 1, 1]])


def test_the_highest_that_the_columns_allow_is_the_default() -> None:
    assert chosen_interpolation(None, False, False) == "linear"
    assert chosen_interpolation(None, True, False) == "cubic"
    assert chosen_interpolation(None, True, True) == "quintic"
    assert chosen_interpolation(None, False, True) == "linear"
    assert chosen_interpolation("hold", True, True) == "hold"


def test_what_the_columns_do_not_allow_is_refused() -> None:
    with pytest.raises(InputError, match="cubic pieces need velocities"):
        chosen_interpolation("cubic", False, False)
    with pytest.raises(InputError, match="quintic pieces need accelerations"):
        chosen_interpolation("quintic", True, False)
    with pytest.raises(InputError, match="no such interpolation"):
        chosen_interpolation("spline", True, True)


@pytest.mark.parametrize(
    ("asked", "velocities", "instead"),
    [("cubic", False, "linear"), ("quintic", True, "cubic"), ("quintic", False, "linear")],
)
def test_advice_on_what_the_columns_allow_can_be_followed(asked: str, velocities: bool, instead: str) -> None:
    with pytest.raises(InputError) as refused:
        chosen_interpolation(asked, velocities, False)
    assert f"say --interpolate {instead}, or leave it out" in str(refused.value.problems[0].hint)
    assert (
        chosen_interpolation(instead, velocities, False)
        == instead
        == chosen_interpolation(None, velocities, False)
    )


def test_a_row_states_what_all_its_joints_state_one_after_the_other() -> None:
    """A velocity of one joint alone is none of the row, and an acceleration without a velocity does not count."""
    q, none = np.zeros((6, 2)), np.nan
    qd = np.array([[0, 0], [none, 0], [0, none], [none, none], [0, 0], [0, 0]])
    qdd = np.array([[0, 0], [0, 0], [0, 0], [0, 0], [0, none], [none, none]])
    assert stated_orders(q, qd, qdd).tolist() == [3, 1, 1, 1, 2, 2]
    assert stated_orders(q, qd, None).tolist() == [2, 1, 1, 1, 2, 2]
    assert stated_orders(q, None, qdd).tolist() == [1] * 6
