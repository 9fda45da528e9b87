"""Bounds of joints that turn and joints that slide: units, ends, forms, and the same again in a resolved job."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, job_from_text

DEG, INF = math.pi / 180, math.inf
ROBOT = "{joints: [{name: turn}, {name: lift, type: prismatic}, {name: roll}]}"
LINK = "link: {mass: 1, com: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0]}"
HEAVY = f"{{convention: standard, joints: [{{name: turn, {LINK}}}, {{name: lift, type: prismatic, {LINK}}}]}}"


def job(
    limits: str, robot: str = ROBOT, moves: str = "{planner: hold, duration: 1}", more: str = ""
) -> LoadedJob:
    text = f"version: 1\nunits: {{angle: deg, length: mm}}\nrobot: {robot}\nlimits: {limits}\nstart: {{joints: 0}}\n"
    return job_from_text(f"{text}{more}moves: [{moves}]\n", "job.yaml")


def both(loaded: LoadedJob) -> list[LoadedJob]:
    """Return a job and what its resolved form is read as, also where plain numbers are in rad and m."""
    text = dump_job(loaded)
    assert "angle: deg, length: mm" in text
    in_si = text.replace("angle: deg, length: mm", "angle: rad, length: m")
    return [loaded, job_from_text(text), job_from_text(in_si)]


BOUNDS = [  # as written, (lower, upper) of each joint in deg and mm
    ("30", [(-30, 30), (-30, 30), (-30, 30)]),
    ("[30, 40, null]", [(-30, 30), (-40, 40), (-INF, INF)]),
    ("[[-10, 30], [-40, 5], 7]", [(-10, 30), (-40, 5), (-7, 7)]),
    ("{lift: [null, 40], turn: [-30, null]}", [(-30, INF), (-INF, 40), (-INF, INF)]),
    ("{roll: [-1, 2]}", [(-INF, INF), (-INF, INF), (-1, 2)]),
    ("{roll: [null, null], lift: 3}", [(-INF, INF), (-3, 3), (-INF, INF)]),
]


@pytest.mark.parametrize(
    ("order", "quantity"), list(enumerate(["position", "velocity", "acceleration", "jerk"]))
)
@pytest.mark.parametrize(("written", "expected"), BOUNDS)
def test_bounds_in_every_form_by_joint_and_direction(
    order: int, quantity: str, written: str, expected: list[tuple[float, float]]
) -> None:
    si = np.array(expected) * np.array([[DEG], [1e-3], [DEG]])
    for each in both(job(f"{{{quantity}: {written}}}")):
        np.testing.assert_allclose(each.robot.limits.of_order(order), si, rtol=1e-15)
        others = [each.robot.limits.of_order(k) for k in range(4) if k != order]
        assert np.isinf(others).all()


def test_bounds_of_a_joint_itself_and_of_its_range() -> None:
    near = "velocity_by_position: {deceleration: 300, offset: 20}, position: [-100, 200]"
    robot = (
        f"{{joints: [{{velocity: 90, {near}}}, {{type: prismatic, velocity: [-90, 45], jerk: 7, {near}}}]}}"
    )
    for each in both(job("{scale: {velocity: 0.5}}", robot)):
        limits = each.robot.limits
        np.testing.assert_allclose(limits.velocity, [[-45 * DEG, 45 * DEG], [-0.045, 0.0225]], rtol=1e-15)
        np.testing.assert_allclose(limits.position, [[-100 * DEG, 200 * DEG], [-0.1, 0.2]], rtol=1e-15)
        np.testing.assert_allclose(limits.jerk, [[-INF, INF], [-0.007, 0.007]], rtol=1e-15)
        scaled = [[75 * DEG, 10 * DEG], [0.075, 0.01]]  # k (sqrt(2 d x) - o) = sqrt(2 k^2 d x) - k o
        np.testing.assert_allclose(limits.velocity_by_position, scaled, rtol=1e-15)


def test_rates_near_a_limit_are_above_zero_and_offsets_at_least_zero() -> None:
    for near, message in (
        ("deceleration: 0", "above 0, got 0"),
        ("deceleration: -1", "above 0, got -1"),
        ("deceleration: 1, offset: -1", "at least 0, got -1"),
        ("deceleration: 1e-13", "expected at least 5.72958e-11"),
    ):
        robot = f"{{joints: [{{position: [0, 9], velocity_by_position: {{{near}}}}}]}}"
        with pytest.raises(InputError, match=message):
            job("{}", robot)
    robot = "{joints: [{position: [0, 9], velocity_by_position: {deceleration: 1, offset: 0}}]}"
    assert job("{}", robot).robot.limits.velocity_by_position.tolist() == [[DEG, 0]]


POSITIONS = [
    ("[20, 30]", (20, 30)),
    ("[-30, -20]", (-30, -20)),
    ("[0, 30]", (0, 30)),
    ("[null, -20]", (-INF, -20)),
]


@pytest.mark.parametrize(("pair", "ends"), POSITIONS)
def test_a_range_need_not_hold_zero_and_a_rate_must(pair: str, ends: tuple[float, float]) -> None:
    found = job(f"{{position: {{turn: {pair}}}}}").robot.limits.position[0]
    np.testing.assert_allclose(found, np.array(ends) * DEG, rtol=1e-15)
    with pytest.raises(InputError, match="a negative and a positive number"):
        job(f"{{velocity: {{turn: {pair}}}}}")


WRONG = [
    ("position", "[30, 20]", "the lower number first, got [30, 20]", "["),
    ("position", "[20, 20]", "the lower number first, got [20, 20]", "["),
    ("velocity", "[-30, 0]", "a negative and a positive number, got [-30, 0]", "["),
    ("velocity", "[0, 30]", "a negative and a positive number, got [0, 30]", "["),
    ("jerk", "[-1e-13, 30]", "expected at least 5.72958e-11 deg/s^3, got -1e-13", "["),
    ("jerk", "[-30, 1e-13]", "expected at least 5.72958e-11 deg/s^3, got 1e-13", "["),
    ("acceleration", "1e-13", "expected at least 5.72958e-11 deg/s^2, got 1e-13", "1e-13"),
    ("position", "1e-15", "expected at least 5.72958e-14 deg, got 1e-15", "1e-15"),
    ("velocity", "0", "expected a number above 0", "0"),
    ("velocity", "-3", "expected a number above 0", "-3"),
    ("velocity", "[-30, 20, 10]", "expected a pair [lower, upper], got 3 values", "["),
    ("velocity", "[-30, up]", 'such as "120 deg/s", got "up"', "up"),
    ("velocity", '["-3 m/s", 4]', 'such as "120 deg/s", got "-3 m/s"', '"-3'),
]  # fmt: skip


@pytest.mark.parametrize(("quantity", "written", "message", "at"), WRONG)
def test_wrong_bounds_are_refused_at_their_end(quantity: str, written: str, message: str, at: str) -> None:
    with pytest.raises(InputError) as caught:
        job(f"{{{quantity}: {{turn: {written}}}}}")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith(at)


def test_limits_of_the_tool_are_lengths_and_angles() -> None:
    names = [f"{part}{kind}" for part in ("", "angular_") for kind in ("speed", "acceleration", "jerk")]
    for each in both(job("{tcp: {" + ", ".join(f"{name}: {k}" for k, name in enumerate(names, 3)) + "}}")):
        found = [getattr(each.robot.limits.tcp, name) for name in names]
        np.testing.assert_allclose(found, [0.003, 0.004, 0.005, 6 * DEG, 7 * DEG, 8 * DEG], rtol=1e-15)
    for name in names:
        wrong = "3 deg/s" if name in ("speed", "angular_jerk") else "3 m/s"
        wrong = "3 m" if name.endswith("speed") else wrong
        with pytest.raises(InputError, match="per second"):
            job(f"{{tcp: {{{name}: {wrong}}}}}")


@pytest.mark.parametrize("factor", ["0", "1.0001", "-0.5", "50 %", "null"])
def test_factors_of_limits_are_above_zero_and_at_most_one(factor: str) -> None:
    for name in ("velocity", "acceleration", "jerk"):
        with pytest.raises(InputError):
            job(f"{{scale: {{{name}: {factor}}}}}")
        assert job(f"{{{name}: 8, scale: {{{name}: 1}}}}").robot.limits.velocity.shape == (3, 2)


EFFORTS = [
    ("30", [(-30, 30), (-30, 30)]),
    ("[30 N m, 2 kN]", [(-30, 30), (-2000, 2000)]),
    ("{lift: [-5 N, 7 N]}", [(-INF, INF), (-5, 7)]),
    ("{lift: null, turn: [-3, 4]}", [(-3, 4), (-INF, INF)]),
    ("{turn: null, lift: null}", [(-INF, INF), (-INF, INF)]),
]


@pytest.mark.parametrize(("written", "expected"), EFFORTS)
def test_efforts_are_torques_and_forces_in_any_units_of_the_job(
    written: str, expected: list[tuple[float, float]]
) -> None:
    for each in both(job(f"{{effort: {written}}}", HEAVY)):
        assert each.robot.limits.effort.tolist() == [list(pair) for pair in expected]


OF_JOINTS = HEAVY.replace("name: turn,", "name: turn, effort: 30 N m,").replace(
    "name: lift,", "name: lift, effort: [-5 N, 0.2 kN],"
)
WRONG_EFFORTS = ["[30 N, 2 N]", "[3, 4 N m]", "{lift: [-5, 0]}", "{turn: [0, 5]}", "{turn: [3, 5]}", "0", "-2",
                 "{turn: [-5, null]}", "{turn: [-5, 5, 6]}", "[1, 2, 3]", "rbot", "{elbow: 3}"]  # fmt: skip


def test_efforts_of_the_joints_themselves() -> None:
    for limits in ("{}", "{effort: robot}"):
        for each in both(job(limits, OF_JOINTS)):
            assert each.robot.limits.effort.tolist() == [[-30, 30], [-5, 200]]
    for each in both(job("{effort: {turn: null}}", OF_JOINTS)):
        assert each.robot.limits.effort.tolist() == [[-INF, INF], [-5, 200]]


@pytest.mark.parametrize("written", WRONG_EFFORTS)
def test_wrong_efforts_are_refused(written: str) -> None:
    with pytest.raises(InputError) as caught:
        job(f"{{effort: {written}}}", HEAVY)
    assert all(problem.place and problem.place.line == 4 for problem in caught.value.problems)


def test_rates_of_zones_and_tables_are_those_of_their_joints() -> None:
    moves = "{planner: spline, through: {positions: [[10, 20, 30]], merge: [1, 2, 0]}}"
    for each in both(job("{}", moves=moves, more="zone: {joints: {roll: 3, turn: 0, lift: 4 cm}}\n")):
        assert each.job.zone.joints == pytest.approx((0, 0.04, 3 * DEG), rel=1e-15)
        (move,) = each.job.moves
        assert move.through.merge == pytest.approx((DEG, 0.002, 0), rel=1e-15)  # type: ignore[attr-defined]
        assert move.through.positions[0] == pytest.approx((10 * DEG, 0.02, 30 * DEG))  # type: ignore[attr-defined]
    for key, wrong in (
        ("joints", "{roll: 3, turn: -1, lift: 4}"),
        ("joints", "[1, 2]"),
        ("orientation", "-1"),
    ):
        with pytest.raises(InputError):
            job("{}", more=f"zone: {{{key}: {wrong}}}\n")


def test_states_by_joint_say_which_joint_is_left_out() -> None:
    for line, message in (
        ("{turn: 1, roll: 2}", "no value for lift"),
        ("{}", "no value for turn, lift, roll"),
    ):
        with pytest.raises(InputError, match=message):
            job("{}", more=f"points: {{p: {{joints: {line}}}}}\n")
    with pytest.raises(InputError, match="no value for turn, lift, roll"):  # some are pinned, not none
        job("{}", more="points: {p: {joints: {}, xyz: [1, 2, 3]}}\n")
    with pytest.raises(InputError) as caught:
        job("{}", more="points: {p: {joints: [1, 2, x, 4]}, q: {joints: {turn: x, lift: 1 deg, roll: 3}}}\n")
    found = [(p.message.partition(",")[0], p.hint) for p in caught.value.problems]
    assert found[0] == ("expected 3 values", "the joints are turn, lift, roll; decimals have a point")
    assert [text[:20] for text, _ in found[1:]] == ["expected an angle su", "expected a length su"]
    with pytest.raises(InputError) as caught:
        job("{}", more="points: {p: {joints: x}, q: {joints: [1, 2]}}\n")
    assert [p.hint for p in caught.value.problems] == [None, "the joints are turn, lift, roll"]


def test_rates_that_are_left_out_are_zero_and_the_others_are_written_by_name() -> None:
    state = "{joints: [1, 2, 3], velocity: {roll: 5}, acceleration: {lift: 7, turn: 9}}"
    for each in both(job("{}", more=f"points: {{p: {state}}}\n")):
        point = each.job.points["p"]
        assert point.velocity == pytest.approx((0, 0, 5 * DEG))
        assert point.acceleration == pytest.approx((9 * DEG, 0.007, 0))
        assert point.as_state().velocity.tolist() == list(point.velocity or ())
        assert point.as_state().acceleration.tolist() == list(point.acceleration or ())
    text = dump_job(job("{}", more=f"points: {{p: {state}}}\n"))
    assert 'velocity: {roll: "0.08726646259971647 rad/s"}' in text


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk", "position"])
def test_limits_of_a_move_are_those_of_its_joints_again_in_the_resolved_job(quantity: str) -> None:
    moves = (
        f"{{planner: hold, duration: 1, limits: {{{quantity}: {{lift: 5, roll: [-7, 6], turn: [null, 8]}}}}}}"
    )
    order = ["position", "velocity", "acceleration", "jerk"].index(quantity)
    expected = [(-INF, 8 * DEG), (-0.005, 0.005), (-7 * DEG, 6 * DEG)]
    for each in both(job("{}", moves=moves)):
        limits = each.job.moves[0].limits
        assert limits is not None
        np.testing.assert_allclose(np.array(limits.of_order(order)), expected, rtol=1e-15)
    for each in both(job("{}", moves=moves.replace("roll: [-7, 6], turn: [null, 8]", "turn: null"))):
        limits = each.job.moves[0].limits
        assert limits is not None
        assert limits.of_order(order) == ((-INF, INF), (-0.005, 0.005), None)


def test_efforts_of_a_move_are_those_of_its_joints_again_in_the_resolved_job() -> None:
    moves = "{planner: hold, duration: 1, limits: {effort: {lift: [-5 N, 0.1 kN], turn: null}}}"
    for each in both(job("{}", HEAVY, moves)):
        limits = each.job.moves[0].limits
        assert limits is not None
        assert limits.effort == ((-INF, INF), (-5, 100))
    same, _ = (
        each.job.moves[0].limits for each in both(job("{}", HEAVY, moves.replace(", turn: null", "")))[1:]
    )
    assert same is not None
    assert same.effort == (None, (-5, 100))
