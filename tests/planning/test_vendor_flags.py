"""Configurations in the flags of ABB, KUKA and FANUC: which branch and which turns they mean, by geometry."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from trajcli.errors import InputError, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.vendor_flags import abb_flags, fanuc_flags, kuka_flags
from trajcli.planning.plan import Plan, plan_job


def planned(robot: Any, to: dict[str, Any], start: list[float] | None = None) -> Plan:
    job = {
        "version": 1,
        "units": {"angle": "deg"},
        "robot": robot,
        "limits": {"acceleration": 400, "velocity": 100, "jerk": 4000},
        "start": {"joints": start or [0, 0, 0, 0, 20, 0]},
        "moves": [{"planner": "quintic", "to": to}],
    }
    return plan_job(job_from_text(json.dumps(job)))


def pose_of(name: str, q: list[float]) -> dict[str, Any]:
    pose = forward(load_robot(name), np.radians(q))
    return {"xyz": pose[:3, 3].tolist(), "matrix": pose[:3, :3].tolist()}


def end(plan: Plan) -> np.ndarray:
    return np.degrees(plan.moves[0].planned.end.position)


# of each arm joint values, in deg, and the flags that its maker's manual gives them
ABB = [
    ([20, 10, 5, 30, 40, 50], [0, 0, 0, 0]),
    ([20, 10, 5, 30, -40, 50], [0, 0, 0, 1]),
    ([-20, 30, 5, -100, 40, 190], [-1, -2, 2, 0]),
    ([20, 80, -160, 30, 40, 50], [0, 0, 0, 2]),
    ([20, 80, -160, 30, -40, -50], [0, 0, -1, 3]),
    ([100, -80, 5, 30, 40, 50], [1, 0, 0, 4]),
    ([-100, -80, 5, 30, -40, 50], [-2, 0, 0, 5]),
]
# KUKA: A3 at 90 deg is the usual side of the elbow, bit 1; A5 below zero bit 2; wrist behind A1 bit 0. Positions
# that controllers have written, in programs that are public, have these pairs: 2 with 2, 10, 34, 35; 6 with 26, 27, 50
KUKA = [
    ([10, -90, 90, 20, 30, 40], {"s": "B010", "t": "B000010"}),
    ([-10, -90, 90, -20, -30, 40], {"s": 6, "t": "'B011011'"}),
    ([10, -60, -60, 20, 30, 40], {"s": "B000", "t": 6}),
    ([10, -150, 60, 20, 30, -40], {"s": "B011", "t": 34}),
    *(
        (
            [-a if turn >> k & 1 else a for k, a in enumerate([10, 80, 90, 20, 30, 40])],
            {"s": status, "t": turn},
        )
        for status, turn in ((2, 2), (2, 10), (2, 34), (2, 35), (6, 26), (6, 27), (6, 50))
    ),
]
# FANUC, angles of the description (joint 3 without joint 2): F where J5 is above zero, B behind J1
FANUC = [
    ([10, 10, 0, 20, -60, 30], "N U T, 0, 0, 0"),
    ([10, 10, 0, 20, 60, 30], "FUT 000"),
    ([10, 10, 0, 20, -60, 230], "N U T, 0, 0, 1"),
    ([10, 10, 0, -185, -60, -200], "'N U T, 0, -1, -1'"),
    ([10, 80, -120, 20, -60, 30], "N D T"),
    ([10, -80, 10, 20, 60, 30], "F U B, 0, 0, 0"),
]
CASES = [
    *(("irb4600", q, {"abb": flags}) for q, flags in ABB),
    *(("kr6_r900", q, {"kuka": flags}) for q, flags in KUKA),
    *(("kr150_2", q, {"kuka": flags}) for q, flags in KUKA[:1]),
    *(("m10ia", q, {"fanuc": flags}) for q, flags in FANUC),
]


@pytest.mark.parametrize(("name", "q", "flags"), CASES)
def test_flags_lead_to_the_joints_that_have_them(name: str, q: list[float], flags: dict[str, Any]) -> None:
    plan = planned(name, {**pose_of(name, q), "configuration": flags})
    np.testing.assert_allclose(end(plan), q, atol=1e-6)
    assert not [event for event in plan.events if event.kind == "turns_not_met"]


def horizontal(robot: Any, q: np.ndarray) -> float:
    """Return how far the wrist centre is ahead of joint 1, from positions alone: the tcp turned by joints 4 to 6."""
    points = []
    for k in range(12):
        turned = q.copy()
        turned[3:] = np.sin([1.0 + k, 2.0 + 3 * k, 5.0 + 7 * k])
        points.append(forward(robot, turned)[:3, 3])
    rows = np.array(points)  # they lie on spheres about the wrist centre
    size = np.hstack([2 * rows, np.ones((12, 1))])
    centre = np.linalg.lstsq(size, np.square(rows).sum(axis=1), rcond=None)[0][:3]
    ahead = forward(robot, np.zeros(6))[:2, 3]
    turn = np.sign(robot.joints[0].sign) * (1 if robot.joints[0].alpha < 0 else -1) * q[0]
    c, s = np.cos(turn), np.sin(turn)
    return float(centre[:2] @ (np.array([[c, -s], [s, c]]) @ ahead) / np.linalg.norm(ahead))


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "make"),
    [
        (
            "irb4600",
            lambda front, up, above: abb_flags([0, 0, 0, (not front) * 4 + (not up) * 2 + (not above)]),
        ),
        ("kr6_r900", lambda front, up, above: kuka_flags((not front) + 2 * up + 4 * (not above), None)),
        ("lrmate200id", lambda front, up, above: fanuc_flags("NF"[above] + "DU"[up] + "BT"[front])),
    ],
)
def test_eight_flags_tell_eight_branches_apart(name: str, make: Any) -> None:
    robot, rng = load_robot(name), np.random.default_rng(2)
    q = rng.uniform(-1.4, 1.4, (100, 6))
    count = np.zeros(100)
    ahead = np.array([horizontal(robot, row) > 0 for row in q])
    for front in (False, True):
        for up in (False, True):
            for above in (False, True):
                met = make(front, up, above).met(robot, q)
                count += met
                assert not (met & (ahead != front)).any()
                assert not (met & ((q[:, 4] > 0) != above)).any()
    assert (count == 1).all()


def test_turns_out_of_range_are_an_event_and_the_nearest_are_taken() -> None:
    to = {**pose_of("irb4600", ABB[0][0]), "configuration": {"abb": [2, 0, 0, 0]}}
    plan = planned("irb4600", to)
    (event,) = [event for event in plan.events if event.kind == "turns_not_met"]
    assert event.move == 0
    assert "abb [2, 0, 0, 0] says turns of joint_1" in event.message
    np.testing.assert_allclose(end(plan), ABB[0][0], atol=1e-6)


def test_of_several_turns_that_fit_the_nearest_is_first() -> None:
    robot = load_robot("irb4600")
    joints = np.radians(ABB[2][0])
    for sixth, values in ((100, (190, -170)), (-100, (-170, 190))):
        near = np.radians([0, 0, 0, 0, 0, sixth])
        found, missed = kuka_flags(2, None).in_turns(robot, joints, near)
        kept = found[np.abs(found[:, 3] - joints[3]) < 1.0]
        np.testing.assert_allclose(np.degrees(kept[:, 5]), values)
        assert missed == []


def test_turns_do_not_move_a_joint_that_is_pinned() -> None:
    to = {**pose_of("irb4600", ABB[2][0]), "joints": {"joint_6": -170}}
    for sixth, missed in ((-2, False), (2, True)):
        plan = planned("irb4600", {**to, "configuration": {"abb": [-1, -2, sixth, 0]}})
        np.testing.assert_allclose(end(plan), [-20, 30, 5, -100, 40, -170], atol=1e-6)
        assert any(event.kind == "turns_not_met" for event in plan.events) == missed


def test_flags_hold_on_a_path_and_on_a_rail() -> None:
    robot = {"rail": {"axis": "y", "velocity": 1, "acceleration": 2, "jerk": 20}, "arm": "irb4600"}
    to = {**pose_of("irb4600", ABB[1][0]), "joints": {"rail": 0}, "configuration": {"abb": ABB[1][1]}}
    plan = planned(robot, to, [0, *[0] * 4, 20, 0])
    np.testing.assert_allclose(end(plan)[1:], ABB[1][0], atol=1e-6)
    other = planned(robot, {**to, "configuration": {"abb": [0, 0, 1, 1]}}, [0, *[0] * 4, 20, 0])
    (event,) = [event for event in other.events if event.kind == "turns_not_met"]
    assert "says turns of joint_6 that" in event.message
    line = {"planner": "line", "law": {"shape": "quintic", "duration": 2}}
    job = {
        "version": 1,
        "robot": "irb4600",
        "limits": {"acceleration": 4},
        "start": {"joints": [0, 0, 0, 0, 0.5, 0]},
    }
    for branch, fits in ((0, True), (1, False)):
        to = {"from": "here", "offset": {"xyz": [0, 0, 0.1]}, "configuration": {"abb": [0, 0, 0, branch]}}
        text = json.dumps({**job, "moves": [{**line, "to": to}]})
        if fits:
            assert plan_job(job_from_text(text)).verdict.passed
            continue
        with pytest.raises(TrajcliError, match=r"another configuration than abb \[0, 0, 0, 1\]"):
            plan_job(job_from_text(text))


@pytest.mark.parametrize("name", ["ur5e", "scara", "panda"])
def test_arms_without_such_branches_are_named(name: str) -> None:
    q = [10, -60, 60, 10, 50, 20, 10][: len(load_robot(name).joints)]
    q = q if name != "scara" else [10, 20, 0.1, 10]
    to = {**pose_of(name, q), "configuration": {"abb": [0, 0, 0, 0]}}
    with pytest.raises(
        TrajcliError, match="has no branches of ABB, KUKA or FANUC: it is not an elbow arm"
    ) as caught:
        planned(name, to, [0] * len(q))
    assert load_robot(name).name in str(caught.value)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ({"abb": [0, 0, 1]}, "expected four whole numbers, the last from 0 to 7"),
        ({"abb": [0, 0, 0, 8]}, "expected four whole numbers, the last from 0 to 7"),
        ({"abb": [0, 0, 0.5, 1]}, "expected four whole numbers, the last from 0 to 7"),
        ({"abb": 3}, "expected"),
        (
            {"kuka": {"s": "B012"}},
            "expected a whole number from 0 to 31 or bits such as 'B010', got \"B012\"",
        ),
        ({"kuka": {"s": 2, "t": 64}}, "expected a whole number from 0 to 63"),
        ({"kuka": {"t": 2}}, "`s` is missing"),
        ({"kuka": {"s": 2, "u": 2}}, "unknown key 'u'"),
        ({"fanuc": "N X T"}, 'expected a FANUC configuration, got "N X T"'),
        ({"fanuc": "NUT 00"}, "expected a FANUC configuration"),
        ({"fanuc": "NUT", "elbow": "up"}, "fanuc and elbow exclude each other"),
        ({"fanuc": "NUT", "abb": [0, 0, 0, 0]}, "abb and fanuc exclude each other"),
    ],
)
def test_wrong_flags_are_refused(flags: Any, message: str) -> None:
    with pytest.raises(InputError) as caught:
        planned("irb4600", {"xyz": [1, 0, 1], "rpy": [0, 90, 0], "configuration": flags})
    assert message in caught.value.problems[0].message
    assert caught.value.problems[0].place is not None


def test_a_start_that_several_branches_reach_says_which_one_is_taken() -> None:
    job = {"version": 1, "robot": "irb4600", "start": pose_of("irb4600", ABB[0][0])}
    hold = {"moves": [{"planner": "hold", "duration": 1}]}
    (remark,) = plan_job(job_from_text(json.dumps({**job, **hold}))).remarks
    assert remark.kind == "branch_taken"
    assert "branches reach the start: " in remark.message
    assert "is taken, nearest to zero" in remark.message
    job["start"]["configuration"] = {"abb": ABB[0][1]}  # type: ignore[index]
    assert not plan_job(job_from_text(json.dumps({**job, **hold}))).remarks
