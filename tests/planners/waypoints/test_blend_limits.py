"""Limits that parabolic blends keep where they find their accelerations, times or durations themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from through_jobs import curve_of, plan, timed

from trajcli.errors import MissingLimitError
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.waypoints import blends as module
from trajcli.planners.waypoints.blends import blend_times
from trajcli.planners.waypoints.through_points import PointTable

POINTS = [[0.0, 0.0], [0.6, -0.2], [0.5, 0.4], [1.2, 0.1]]


def largest(made: object) -> float:
    """Return the largest acceleration anywhere."""
    return float(np.abs(np.concatenate(curve_of(made).piece_ends(2))).max())


def untimed(limits: dict[str, object], **fields: object) -> object:
    start, *through = [{"joints": q} for q in POINTS]
    return plan(start, {"planner": "blends", "through": through, **fields}, limits={"jerk": None, **limits})


@pytest.mark.parametrize("bounds", [(-2.0, 5.0), (-5.0, 2.0)])
def test_of_a_limit_that_differs_by_direction_blends_use_the_smaller_one(bounds: tuple[float, float]) -> None:
    start, through = timed([0, 1, 2, 3], [[0.0], [0.3], [0.1], [0.4]])
    made = plan(
        start, {"planner": "blends", "through": through}, limits={"jerk": None, "acceleration": [bounds]}
    )
    assert largest(made) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(("own", "limit", "used"), [(2.0, 4.0, 2.0), (9.0, 4.0, 4.0), (None, 4.0, 4.0)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_times_that_are_found_keep_the_smaller_of_limit_and_own_acceleration(
    own: float | None, limit: float, used: float, sign: float
) -> None:
    """In either direction: of one joint the motion is mirrored."""
    start, *through = [{"joints": [sign * q]} for q in (0.0, 0.5, 0.7, 1.5)]
    move = {"planner": "blends", "through": through} | ({} if own is None else {"acceleration": own})
    made = plan(start, move, limits={"jerk": None, "velocity": 1, "acceleration": limit})
    assert largest(made) == pytest.approx(used, rel=1e-6)


@pytest.mark.parametrize("ends", ["centred", "inside"])
def test_a_duration_is_that_of_the_whole_motion_with_its_blends(ends: str) -> None:
    """The first and the last blend last differently, and with them all times keep their proportions."""
    limits = {"velocity": 1, "acceleration": [3, 1]}
    free = untimed(limits, end_blends=ends)
    long = untimed(limits, end_blends=ends, duration=9)
    assert long.trajectory.duration == pytest.approx(9, rel=1e-12)
    factor = 9 / free.trajectory.duration
    np.testing.assert_allclose(curve_of(long).breaks, factor * curve_of(free).breaks, rtol=1e-9, atol=1e-9)
    assert largest(long) == pytest.approx(largest(free) / factor**2, rel=1e-9)


def table(points: object) -> PointTable:
    q = np.array(points)
    return PointTable(q, None, np.zeros((2, *q.shape)), np.zeros((2, len(q)), dtype=bool), np.zeros(len(q)))


def robot() -> Robot:
    limits = replace(unlimited(2), velocity=np.array([[-1.0, 1.0]] * 2))
    return Robot("bare", (Joint("j1"), Joint("j2")), limits, None, np.eye(4), np.eye(4))


@pytest.mark.parametrize("bounds", [(-np.inf, 3.0), (-3.0, np.inf), (-np.inf, np.inf)])
def test_a_joint_that_moves_needs_its_acceleration_in_both_directions(bounds: tuple[float, float]) -> None:
    limits = np.array([(-3.0, 3.0), bounds])
    with pytest.raises(MissingLimitError, match="j2"):
        blend_times(table(POINTS), None, robot(), limits, "inside", exactly=False)
    still = table([[q, 0.5] for q, _ in POINTS])
    times, _ = blend_times(still, None, robot(), limits, "inside", exactly=False)
    assert (np.diff(times) > 0).all()


@pytest.mark.parametrize("points", [POINTS])
def test_of_several_shares_of_the_segments_the_fastest_is_taken(
    points: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = np.array([[-3.0, 3.0], [-2.0, 2.0]])

    def lasts() -> float:
        return float(blend_times(table(points), None, robot(), limits, "inside", exactly=True)[0][-1])

    best, shares = lasts(), module._SHARES
    assert max(shares) < 0.5 * (1 - 0.1)  # beside a point that is passed exactly there are two blends
    single = []
    for share in shares:
        monkeypatch.setattr(module, "_SHARES", (share,))
        single.append(lasts())
    assert best == pytest.approx(min(single), rel=1e-12)
    monkeypatch.setattr(module, "_SHARES", shares[::-1])
    assert lasts() == pytest.approx(best, rel=1e-12)
    assert np.ptp(single) > 1e-3 * best


@pytest.mark.parametrize(("ends", "shift"), [("inside", 0.0), ("centred", 0.15)])
def test_a_motion_through_its_ends_begins_and_ends_as_far_beside_them_as_it_goes_in_half_a_blend(
    ends: str, shift: float
) -> None:
    q, v = np.array([[0.0, 1.0], [2.0, 0.0], [1.0, 3.0]]), np.array([[0.5, 0.0], [-1.0, 0.25]])
    start, through = timed([0, 1, 3], q, velocity=v[1].tolist())
    move = {"planner": "blends", "through": through, "blend_durations": 0.3, "end_blends": ends}
    made = plan(start | {"velocity": v[0].tolist()}, move)
    curve, planned = curve_of(made), made.moves[0].planned
    assert curve.duration == pytest.approx(3 + 2 * shift)
    first, last = q[0] - shift * v[0], q[-1] + shift * v[1]
    np.testing.assert_allclose([curve.evaluate(0.0), curve.evaluate(curve.end)], [first, last], atol=1e-12)
    np.testing.assert_allclose([curve.evaluate(0.0, 1), curve.evaluate(curve.end, 1)], v, atol=1e-12)
    np.testing.assert_allclose([planned.begins.position, planned.end.position], [first, last], atol=1e-12)
    np.testing.assert_allclose([planned.begins.velocity, planned.end.velocity], v)
