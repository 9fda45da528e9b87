"""What fastest laws along paths are asked for: states at both ends, all limits, and what is said of the law."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.quartic_law import ReversingLawError
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.errors import PlanningError
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners import course
from trajcli.planners.law_events import distance_from_bound
from trajcli.planners.waypoints import fastest_law
from trajcli.planners.waypoints.fastest_law import (
    events_of_law,
    require_continuous_curvature,
    solve_second_order,
    solve_within_jerk,
)
from trajcli.planners.waypoints.joint_path import JointPath

Array = NDArray[np.float64]
S = np.array([0.0, 1.0, 2.0, 4.0])
Q = np.array([[0.0, 0.0], [1.0, -0.5], [1.5, 0.5], [2.0, 2.0]])
FIRST, LAST = np.array([1.6, -1.2]), np.array([0.3, 0.4])


def robot(joints: int = 2) -> Robot:
    bounds = (("velocity", 2.0), ("acceleration", 8.0), ("jerk", 80.0))
    limits = replace(unlimited(joints), **{name: np.array([[-b, b]] * joints) for name, b in bounds})
    every = tuple(Joint(f"j{k + 1}") for k in range(joints))
    return Robot("bare", every, limits, None, np.eye(4), np.eye(4))


def path(first: float, last: float) -> JointPath:
    """Return a cubic path that begins with q' = FIRST and ends with q' = LAST, passed there at two speeds."""
    spline = CubicSpline(S, Q, bc_type=((1, FIRST), (1, LAST)))
    return JointPath(PiecewisePolynomial(S, spline.c), S, np.zeros_like(Q), (first, last))


class AskedError(Exception):
    """Raised in the place of a solution, with what was asked for."""

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__()
        self.args, self.named = args, named


@pytest.fixture
def asks(monkeypatch: pytest.MonkeyPatch) -> None:
    def solved(*args: Any, **named: Any) -> None:
        raise AskedError(*args, **named)

    monkeypatch.setattr(fastest_law, "jerk_limited_time_optimal", solved)
    monkeypatch.setattr(fastest_law, "time_optimal", solved)
    monkeypatch.setattr(fastest_law, "solved_within_efforts", lambda curve, robot, solve: solve(("effort",)))
    monkeypatch.setattr(fastest_law, "path_constraints", lambda curve, robot: ("path",))
    tool = SimpleNamespace(constraints=lambda curve: ("tool", "path"), jerk_constraints=("jerk of the tool",))
    monkeypatch.setattr(course, "JointCourse", lambda curve, robot: tool)


def asked(
    acceleration: Array, speeds: tuple[float, float], *, bends: bool = True, of_tool: bool = False
) -> AskedError:
    with pytest.raises(AskedError) as caught:
        solve_within_jerk(path(*speeds), acceleration, robot(), bends=bends, of_tool=of_tool)
    return caught.value


@pytest.mark.usefixtures("asks")
@pytest.mark.parametrize("acceleration", [[0.5, -0.4], [-3.0, 1.0], [0.0, 0.0]])
@pytest.mark.parametrize("speeds", [(0.5, 0.25), (0.5, 0.0), (2.0, 0.25)])
def test_a_path_is_bent_so_that_an_arm_in_motion_keeps_its_acceleration(
    acceleration: list[float], speeds: tuple[float, float]
) -> None:
    """By the chain rule qdd = q'' sd^2 + q' sdd; at the end, where sdd is 0, the arm has none."""
    found = asked(np.array(acceleration), speeds)
    curve, (speed, along) = found.args[0], found.named["start"]
    slope, bend = (curve.evaluate(0.0, order) for order in (1, 2))
    np.testing.assert_allclose(slope, FIRST, atol=1e-12)
    assert speed == speeds[0]
    np.testing.assert_allclose(bend * speed**2 + slope * along, acceleration, atol=1e-12)
    assert along == pytest.approx(float(FIRST @ acceleration) / 4.0)
    assert found.named["end"] == (speeds[1], 0.0)
    plain = path(*speeds).curve.piece_ends(2)[1][-1]
    np.testing.assert_allclose(curve.piece_ends(2)[1][-1], [0.0, 0.0] if speeds[1] else plain, atol=1e-12)
    np.testing.assert_allclose(curve.evaluate(S), Q, atol=1e-12)


@pytest.mark.usefixtures("asks")
def test_a_path_whose_end_alone_moves_is_bent_there() -> None:
    found, plain = asked(np.zeros(2), (0.0, 0.25)), path(0.0, 0.25).curve
    np.testing.assert_allclose(found.args[0].piece_ends(2)[1][-1], [0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.args[0].evaluate(0.0, 2), plain.evaluate(0.0, 2), atol=1e-12)
    assert found.named["start"] == (0.0, 0.0)
    assert found.named["end"] == (0.25, 0.0)


@pytest.mark.usefixtures("asks")
@pytest.mark.parametrize(("bends", "speeds"), [(True, (0.0, 0.0)), (False, (0.5, 0.25))])
def test_a_path_that_rests_at_its_ends_or_may_not_be_bent_stays_what_it_is(
    bends: bool, speeds: tuple[float, float]
) -> None:
    found = asked(np.zeros(2), speeds, bends=bends)
    assert found.args[0].coefficients.tobytes() == path(*speeds).curve.coefficients.tobytes()
    assert found.named["start"] == (speeds[0], 0.0)
    assert found.named["end"] == (speeds[1], 0.0)


@pytest.mark.usefixtures("asks")
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("size", [2.0, -2.0, 200.0])
def test_an_acceleration_along_a_path_that_may_not_be_bent_is_kept_to_a_billionth(
    size: float, side: float
) -> None:
    across = side * abs(size) * np.array([0.6, 0.8])
    kept = asked(size * FIRST + 1e-10 * across, (0.5, 0.0), bends=False)
    assert kept.named["start"] == pytest.approx((0.5, size))
    for off in (1e-8, 1e-3, 1.0):
        with pytest.raises(PlanningError) as caught:
            solve_within_jerk(
                path(0.5, 0.0), size * FIRST + off * across, robot(), bends=False, of_tool=False
            )
        (problem,) = caught.value.problems
        assert problem.joint == "j2"
        assert problem.value == pytest.approx(size * -1.2 + off * across[1])


@pytest.mark.parametrize("bends", [True, False])
@pytest.mark.parametrize("acceleration", [[0.8, -0.6], [0.0, -0.1]])
def test_an_arm_at_rest_has_no_acceleration_to_begin_with(acceleration: list[float], bends: bool) -> None:
    with pytest.raises(PlanningError, match="leaves it"):
        solve_within_jerk(path(0.0, 0.25), np.array(acceleration), robot(), bends=bends, of_tool=False)


@pytest.mark.usefixtures("asks")
@pytest.mark.parametrize("of_tool", [True, False])
def test_a_law_keeps_every_limit(of_tool: bool) -> None:
    found = asked(np.zeros(2), (0.5, 0.25), of_tool=of_tool)
    further = ("tool", "path", "effort") if of_tool else ("path", "effort")
    assert found.named["further"] == further
    assert found.named["further_jerk"] == (("jerk of the tool",) if of_tool else ())
    for given, bound in zip(found.args[1:], (2.0, 8.0, 80.0), strict=True):
        np.testing.assert_array_equal(given, [[-bound, bound]] * 2)
    with pytest.raises(AskedError) as caught:
        solve_second_order(path(0.5, 0.25), robot(), of_tool=of_tool)
    assert caught.value.named == {"start_velocity": 0.5, "end_velocity": 0.25, "further": further}
    for given, bound in zip(caught.value.args[1:], (2.0, 8.0), strict=True):
        np.testing.assert_array_equal(given, [[-bound, bound]] * 2)


def line(length: float, speeds: tuple[float, float]) -> JointPath:
    curve = PiecewisePolynomial(np.array([0.0, length]), np.array([[[1.0]], [[0.0]]]))
    return JointPath(curve, curve.breaks, np.zeros((2, 1)), speeds)


@pytest.mark.parametrize("speeds", [(0.5, 1.0), (1.0, 0.5), (0.0, 0.0)])
def test_a_straight_way_between_speeds(speeds: tuple[float, float]) -> None:
    """At 8 rad/s^2 up to 2 rad/s and down again, over 3 rad."""
    motion = solve_second_order(line(3.0, speeds), robot(1), of_tool=False)
    ramps = [(2.0 - v) / 8.0 for v in speeds]
    way = 3.0 - sum((2.0 + v) / 2 * t for v, t in zip(speeds, ramps, strict=True))
    assert motion.trajectory.duration == pytest.approx(sum(ramps) + way / 2.0, rel=1e-4)
    ends = motion.trajectory.piece_ends(1)
    np.testing.assert_allclose([ends[0][0, 0], ends[1][-1, 0]], speeds, atol=1e-9)


@pytest.mark.parametrize("speeds", [(1.0, 0.0), (0.0, 1.0)])
def test_a_speed_that_is_too_high_is_told_with_the_share_that_is_not(speeds: tuple[float, float]) -> None:
    """Over 0.01 rad at 8 rad/s^2 it changes from 0 to 0.4 rad/s."""
    with pytest.raises(PlanningError) as caught:
        solve_second_order(line(0.01, speeds), robot(1), of_tool=False)
    share = float(str(caught.value).split("at most ")[1].split(" of it")[0])
    assert share == pytest.approx(0.4, rel=1e-3)


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        (ReversingLawError(), "finds no motion that starts with such velocities and accelerations"),
        (SimpleNamespace(over=1.25), "passes a limit by 1.25 times"),
        (SimpleNamespace(speed=4.0, allowed=1.0), "at most 0.25 of it"),
    ],
)
def test_ends_for_which_there_is_no_law_are_refused(
    monkeypatch: pytest.MonkeyPatch, raised: Any, told: str
) -> None:
    def refused(*_: object, **__: object) -> None:
        error = raised
        if isinstance(raised, SimpleNamespace):
            kind = UnsettledSpeedError if hasattr(raised, "over") else UnreachableSpeedError
            error = kind.__new__(kind)
            vars(error).update(vars(raised))
        raise error

    monkeypatch.setattr(fastest_law, "jerk_limited_time_optimal", refused)
    monkeypatch.setattr(fastest_law, "time_optimal", refused)
    for solve in (
        lambda: solve_within_jerk(path(0.5, 0.0), np.zeros(2), robot(), bends=True, of_tool=False),
        lambda: solve_second_order(path(0.5, 0.0), robot(), of_tool=False),
    ):
        with pytest.raises(PlanningError) as caught:
            solve()
        assert told in str(caught.value)


@pytest.mark.parametrize(
    "rule", ["computed", "shape_preserving", "natural", "clamped", "quintic", "not_a_knot", None]
)
def test_rules_whose_curvature_jumps_are_refused(rule: Any) -> None:
    if rule in ("computed", "shape_preserving"):
        with pytest.raises(PlanningError, match=f"rule {rule} jumps"):
            require_continuous_curvature(rule)
    else:
        require_continuous_curvature(rule)


def told(factor: float = 1.0, **fields: Any) -> dict[str, str]:
    """Return what is said of a law, by its kind."""
    motion = {
        "refinements": 0, "grid": np.zeros(101), "stretch": 1.0, "stops": np.zeros(0), "stop_times": np.zeros(0),
        "lower_bound": 1.9, "law": SimpleNamespace(duration=2.0),
    }  # fmt: skip
    events = list(events_of_law(SimpleNamespace(**motion | fields), robot(), factor))  # type: ignore[arg-type]
    return {event.kind: event.message for event in events}


def test_what_is_said_of_a_law() -> None:
    assert list(told()) == ["bound"]
    assert not told(1.5)
    assert "refined once, to 101 grid" in told(refinements=1)["refined"]
    assert "refined 3 times, to 101 grid" in told(refinements=3)["refined"]


@pytest.mark.parametrize(("stretch", "conceded"), [(1.0005, False), (1.0015, True), (1.5, True)])
def test_a_stretch_by_more_than_a_thousandth_is_told(stretch: float, conceded: bool) -> None:
    assert ("stretched" in told(stretch=stretch)) is conceded


@pytest.mark.parametrize(
    ("count", "text"),
    [(1, "1 corner, at t = 0 s"), (2, "2 corners, at t = 0, 1 s"), (10, "8, 9 s"), (11, "8, 9, ... s")],
)
def test_of_many_stops_the_first_ten_are_listed(count: int, text: str) -> None:
    assert text in told(stops=np.arange(count), stop_times=np.arange(float(count)))["stops"]
    slow = told(3.0, stops=np.arange(count), stop_times=np.arange(float(count)) / 3)
    assert text in slow["stops"]


@pytest.mark.parametrize(("lower", "said"), [(0.999, "0.11"), (0.75, "34"), (0.4, "150"), (0.009, "12000")])
def test_how_far_above_its_bound_a_law_is_has_two_digits_rounded_up_and_no_exponent(
    lower: float, said: str
) -> None:
    motion: Any = SimpleNamespace(lower_bound=lower, law=SimpleNamespace(duration=1.0))
    text = distance_from_bound(motion, robot(1)).message
    assert text.startswith(f"at most {said} % above")
