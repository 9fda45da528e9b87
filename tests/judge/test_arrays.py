"""`trajcli.check`: arrays in, the judgement of `check` out; wrong input is an InputError."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from counted_calls import calls_of

import trajcli
from trajcli.errors import FileError
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Limits, Robot, ToolLimits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

T = 0.02 * np.arange(50)
Q = np.outer(np.sin(T), np.full(7, 0.3)) + np.array([0, 0, 0, -1.5, 0, 1.5, 0])
QD = np.outer(np.cos(T), np.full(7, 0.3))
QDD = np.outer(-np.sin(T), np.full(7, 0.3))


def test_a_chunk_within_its_limits_is_satisfied() -> None:
    judgement = trajcli.check(T, Q, robot="panda")
    assert (judgement.verdict, judgement.findings, judgement.interpolation) == ("satisfied", (), "linear")
    assert judgement.period == pytest.approx(0.02)
    assert trajcli.check(T, Q, robot="panda", qd=QD, qdd=QDD).interpolation == "quintic"
    assert trajcli.check(T.astype(np.float32), Q.astype(np.float32), robot="panda").verdict == "satisfied"
    assert trajcli.check(T.tolist(), Q.tolist(), robot=trajcli.load_robot("panda")).verdict == "satisfied"


def test_limits_are_given_as_in_a_job_in_si() -> None:
    fastest = float(np.abs(np.diff(Q[:, 0])).max() / 0.02)
    broken = trajcli.check(T, Q, robot="panda", limits={"velocity": fastest * 0.999})
    assert broken.verdict == "exceeded"
    assert {found.kind for found in broken.findings} == {"velocity"}
    assert broken.findings[0].limit == pytest.approx(fastest * 0.999)
    fast = Q * [30, 1, 1, 1, 1, 1, 1]
    limits = {"velocity": {"panda_joint1": None}, "position": {"panda_joint1": None}}
    assert trajcli.check(T, fast, robot="panda").verdict == "exceeded"
    assert trajcli.check(T, fast, robot="panda", limits=limits).verdict == "satisfied"


def test_limits_that_are_looser_than_those_of_the_robot_are_said_as_of_a_file(tmp_path: Path) -> None:
    """`trajcli check --strict` does not accept them."""
    rows = np.column_stack([T, Q])
    header = ",".join(["t", *(f"q{k}" for k in range(1, Q.shape[1] + 1))])
    np.savetxt(tmp_path / "rows.csv", rows, delimiter=",", header=header, comments="", fmt="%.9f")
    options = CheckOptions(robot="panda", limits="{velocity: 99}")
    of_file = check_file(str(tmp_path / "rows.csv"), options).judgement.events
    assert ["99 rad/s instead of" in event for event in of_file] == [True] * 7
    for _ in range(2):
        assert trajcli.check(T, Q, robot="panda", limits={"velocity": 99}).events == of_file
    assert trajcli.check(T, Q, robot="panda", limits={"velocity": 0.9}).events == ()


def test_bare_joints_have_the_limits_alone() -> None:
    none = np.tile([-np.inf, np.inf], (7, 1))
    own = Limits(none, np.tile([-0.2, 0.2], (7, 1)), none, none)
    assert trajcli.check(T, Q, limits=own).findings[0].joint == "j1"
    assert trajcli.check(T, Q, limits={"velocity": 0.2}).verdict == "exceeded"
    assert trajcli.check(T, Q).verdict == "satisfied"


def test_degrees_for_radians_are_hinted_at() -> None:
    judgement = trajcli.check(T, np.degrees(Q), robot="panda")
    assert "degrees" in (judgement.findings[0].hint or "")
    assert judgement.findings[0].kind == "position"


@pytest.mark.parametrize(("times", "looks"), [(57.3, True), (1.0, False)])
def test_degrees_of_joints_without_ranges_are_hinted_at_once(times: float, looks: bool) -> None:
    """Where no range is passed velocities tell; turns that are a little too fast are none."""
    share = np.linspace(0.0, 1.0, 201)
    q = times * np.outer(10 * share**3 - 15 * share**4 + 6 * share**5, [15.0, 14.0])  # rad, in 2 s
    found = trajcli.check(2.0 * share, q, limits={"velocity": 0.9 * 15 * 1.875 / 2.0})
    assert found.verdict == "exceeded"
    assert sum("degrees" in (each.hint or "") for each in found.findings) == looks


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("block", [0, 1, 2])
def test_degrees_are_hinted_at_wherever_and_to_whichever_side_joints_go(block: int, side: float) -> None:
    """There and back by 300 in one of three blocks of rows, and 1 in the others; a range that is passed is told first."""
    share = np.linspace(0.0, 1.0, 300, endpoint=False)
    one = np.sin(np.pi * share) ** 4
    q = side * np.concatenate([(300.0 if k == block else 1.0) * one for k in range(3)])[:, None]
    t, free, exact = np.arange(900) * 0.01, np.array([[-np.inf, np.inf]]), np.zeros(1)
    rows = [slice(300 * k, 300 * k + 300) for k in range(3)]
    blocks = [
        RecordedMotion(t[of], q[of], *(None,) * 6, Resolution(0.0, exact, exact, exact), "rows", 1 + of.start)
        for of in rows
    ]
    velocity, position = np.array([[-5.0, 5.0]]), np.array([[-100.0, 100.0]])
    for limits, kind in (
        (Limits(free, velocity, free, free), "velocity"),
        (Limits(position, velocity, free, free), "position"),
    ):
        robot = Robot("one", (Joint("j1"),), limits, None, np.eye(4), np.eye(4))
        found = judge_motion(lambda: blocks, Requirements(robot)).findings
        assert [each.kind for each in found if "degrees" in (each.hint or "")] == [kind]


def test_a_doubled_time_is_a_finding() -> None:
    times = T.copy()
    times[20] = times[19]
    judgement = trajcli.check(times, Q, robot="panda")
    assert ("time", 21) in {(found.kind, found.row) for found in judgement.findings}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"q": Q[:, :6]}, r"q: expected shape \(50, 7\)"),
        ({"q": Q[0]}, r"q: expected shape \(50, 7\)"),
        ({"times": T[:-1]}, r"q: expected shape \(49, 7\)"),
        ({"times": T[:1], "q": Q[:1]}, "at least 2"),
        ({"qd": QD[1:]}, r"qd: expected shape"),
        ({"q": np.where(Q > 1.7, np.nan, Q)}, r"q\[\d+, \d\] is not a finite number"),
        ({"times": np.append(T[:-1], np.inf)}, r"times\[49\] is not a finite number"),
        ({"qdd": np.full_like(Q, np.nan), "qd": QD}, r"qdd\[0, 0\]"),
        ({"q": Q.astype(str)}, "expected an array of numbers"),
        ({"qd": QD > 0}, "qd: expected an array of numbers"),
        ({"times": T[:, None]}, r"times: expected shape \(N,\)"),
        ({"q": np.zeros((50, 0)), "robot": None}, r"q: expected shape \(N, n\)"),
        ({"q": 1.0, "robot": None}, r"q: expected shape \(N, n\)"),
        ({"robot": "pandaa"}, "no robot"),
        ({"limits": {"velocty": 1}}, "velocty"),
        ({"limits": 3}, "expected a mapping"),
        ({"interpolate": "cubic"}, "cubic pieces need velocities"),
        ({"interpolate": "spline"}, "no such interpolation"),
    ],
)
def test_wrong_input_is_an_input_error(changes: dict, said: str) -> None:
    arguments = {"times": T, "q": Q, "robot": "panda"} | changes
    with pytest.raises(trajcli.InputError, match=said):
        trajcli.check(**arguments)


def test_fifty_rows_of_seven_joints_are_quick() -> None:
    """2 ms of work is what is asked for: some thousand calls, and no reading of the arm again."""

    def check() -> None:
        trajcli.check(T, Q, robot="panda", qd=QD, qdd=QDD)

    check()
    assert calls_of(check) < 6000


@pytest.mark.parametrize("digits", [1, 8])
def test_limits_are_those_of_the_call_whatever_numpy_prints_of_them(digits: int) -> None:
    """What is kept of earlier calls is kept by every digit: notebooks print one or two."""
    robot, fast = trajcli.load_robot("panda"), np.outer(0.3 * T, np.ones(7)) + Q[0]
    wanted = [
        (0.3 * (1 + 1e-8), "satisfied"),
        (0.3 * (1 - 1e-8), "exceeded"),
        (0.26, "exceeded"),
        (0.34, "satisfied"),
    ]
    with np.printoptions(precision=digits, suppress=True):
        for limit, verdict in wanted:
            pairs = [np.array([-limit, limit])] * 7
            for velocity in (
                np.full(7, limit),
                dict(zip(robot.joint_names, np.full(7, limit), strict=True)),
                pairs,
            ):
                assert trajcli.check(T, fast, robot=robot, limits={"velocity": velocity}).verdict == verdict


@pytest.mark.parametrize("name", ["times", "q", "qd", "qdd"])
@pytest.mark.parametrize(("kind", "rounding"), [("f2", 2.0**-11), ("f4", 2.0**-24), ("f8", 0.0), ("i4", 0.0)])
def test_single_and_half_precision_explain_half_a_unit_of_their_last_place(
    name: str, kind: str, rounding: float
) -> None:
    """At 1 rad half a unit is 2^-24, or 2^-11. Of times and rates it explains none of the positions.

    Of four arrays one is of fewer bits; whole numbers are not rounded. A position is beyond its limit by half of that
    rounding, or by more.
    """
    at = 1.0
    arrays = {
        "times": np.arange(5.0),
        "q": np.full((5, 1), at),
        "qd": np.zeros((5, 1)),
        "qdd": np.zeros((5, 1)),
    }
    arrays[name] = arrays[name].astype(kind)
    for share in (0.5, 1.2, 3.0):
        limit = at - share * (rounding or 2.0**-24)
        found = trajcli.check(**arrays, limits={"position": [[-9.0, limit]]})
        explained = rounding > 0 and name == "q" and share < 1
        assert found.verdict == ("within rounding" if explained else "exceeded"), share


@pytest.mark.parametrize(
    "kinds", [("f8", "f2", "f2"), ("f4", "f4", "f2"), ("f2", "f8", "f8"), ("f2", "f8", "f4")]
)
def test_derivatives_differ_by_no_more_than_their_own_bits(kinds: tuple[str, ...]) -> None:
    """Sine and cosine rounded by numpy; a step of rates is one where these bits make less of it.

    Half a unit is up to 2^-11, so that two make 0.5 of the next derivative within 2 ms.
    """
    t = np.arange(0.0, 6.0, 0.002)
    for wrong, step in ((None, 0.0), ("qd", 2.0), ("qdd", 2.0)):
        rates = {"q": np.sin(t), "qd": np.cos(t), "qdd": -np.sin(t)}
        given = {
            name: (values + step * (name == wrong) * (t > 2.0))[:, None].astype(kind)
            for (name, values), kind in zip(rates.items(), kinds, strict=True)
        }
        found = trajcli.check(t, **given)
        assert found.verdict == ("satisfied" if wrong is None else "exceeded"), wrong


@pytest.mark.parametrize("single", [True, False])
def test_times_of_single_precision_explain_velocities_between_them(*, single: bool) -> None:
    """A joint at 1 rad/s, its rows at no period, 64 s from the start of the clock; stamps are rounded to 2^-18 s."""
    meant = 64.0 + np.cumsum(np.random.default_rng(3).uniform(0.005, 0.02, 40))
    rounded = meant.astype(np.float32)
    found = trajcli.check(
        rounded if single else rounded.astype(np.float64), meant[:, None], limits={"velocity": 1.0}
    )
    assert found.verdict == ("within rounding" if single else "exceeded")


@pytest.mark.parametrize("rows", [100, 1000])
@pytest.mark.parametrize("period", [0.008, 1 / 240, 1 / 30, 0.1])
def test_positions_at_stamps_that_were_multiplied_in_single_precision_keep_their_velocity(
    period: float, rows: int
) -> None:
    """Of k * dt in single precision every multiple is off by its own rounding; the joint stands at v t at each."""
    t = np.arange(rows, dtype=np.float32) * np.float32(period)
    for speed, verdict in ((0.9, "satisfied"), (0.9 * (1 + 3e-8), "within rounding"), (0.91, "exceeded")):
        found = trajcli.check(t, speed * t[:, None].astype(float), limits={"velocity": 0.9})
        assert (found.verdict, found.period) == (verdict, pytest.approx(period, rel=1e-6))


def test_a_row_that_is_missing_at_stamps_in_single_precision_is_told() -> None:
    t = np.delete(np.arange(200, dtype=np.float32) * np.float32(0.008), 77)
    found = trajcli.check(t, 0.9 * t[:, None].astype(float), limits={"velocity": 1.0})
    assert [(each.kind, each.row) for each in found.findings] == [("time", 78)]


def test_two_rows_are_a_motion() -> None:
    assert trajcli.check(T[:2], Q[:2], robot="panda").rows == 2


def test_a_file_of_a_robot_that_was_changed_is_read_anew(tmp_path: Path) -> None:
    file, fastest = tmp_path / "robot.yaml", float(np.abs(np.diff(Q[:, 0])).max() / 0.02)
    for number, (share, verdict) in enumerate([(1.01, "satisfied"), (0.99, "exceeded"), (1.01, "satisfied")]):
        joints = ", ".join([f"{{velocity: {share * fastest}}}"] * 7)
        file.write_text(f"{{convention: standard, joints: [{joints}]}}", encoding="utf-8")
        os.utime(file, (number, number))
        assert trajcli.check(T, Q, robot=file).verdict == verdict


@pytest.mark.parametrize(("share", "verdict"), [(1.01, "satisfied"), (0.99, "exceeded")])
def test_the_tool_of_an_arm_keeps_its_limits(share: float, verdict: str) -> None:
    """A wheel of a radius of 0.5 m at 2 rad/s."""
    joint, limits = Joint("turn", "revolute", a=0.5), replace(unlimited(1), tcp=ToolLimits(speed=share))
    wheel = Robot("wheel", (joint,), limits, "standard", np.eye(4), np.eye(4))
    found = trajcli.check(T, 2.0 * T[:, None], robot=wheel, qd=np.full((50, 1), 2.0))
    assert found.verdict == verdict
    assert {each.kind for each in found.findings if each.severity == "error"} == (
        {"tool_speed"} if share < 1 else set()
    )


@pytest.mark.parametrize("name", ["qd", "qdd"])
@pytest.mark.parametrize(("kind", "rounding"), [("f2", 2.0**-11), ("f4", 2.0**-24), ("f8", 0.0)])
def test_few_bits_of_a_rate_explain_none_of_another(name: str, kind: str, rounding: float) -> None:
    """A joint that reaches 1 rad/s at 1 rad/s^2, in binary numbers of few digits; its end is beyond the limit."""
    t = np.arange(9.0)[:, None] / 8.0
    rates = {"qd": t, "qdd": np.ones_like(t)}
    rates[name] = rates[name].astype(kind)
    for share in (0.5, 1.2):
        limit = 1.0 - share * (rounding or 2.0**-24)
        found = trajcli.check(t[:, 0], t**2 / 2.0, **rates, limits={"velocity": limit})
        explained = rounding > 0 and name == "qd" and share < 1
        assert found.verdict == ("within rounding" if explained else "exceeded"), share


def test_a_robot_whose_name_is_too_long_for_a_file_is_an_error_of_the_file() -> None:
    with pytest.raises(FileError, match="File name too long"):
        trajcli.check(np.arange(3.0), np.zeros((3, 2)), robot="arm" * 100)
