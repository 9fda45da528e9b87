"""Efforts and loads of a page: by the equation of a pendulum, by `trajcli dynamics`, and only while they are carried."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from cli.running import call
from planned_examples import planned_example

from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.scene import scene_of_plan

LENGTH, MASS, INERTIA, COULOMB, CARRIED, G = 0.5, 4.0, 0.1, 1.5, 1.2, 9.81
PENDULUM = f"""
version: 1
units: {{angle: deg, length: mm}}
robot:
  convention: standard
  joints:
    - {{name: swivel, a: {1e3 * LENGTH}, velocity: 120, acceleration: 400, effort: [-50, 60], friction: {{coulomb: {COULOMB}}},
       link: {{mass: {MASS}, com: [0, 0, 0], inertia: [0.01, 0.1, {INERTIA}, 0, 0, 0]}}}}
gravity: [0, -{G}, 0]
start: {{joints: [10]}}
moves:
  - {{planner: trapezoid, to: {{joints: [40]}}}}
  - {{attach: {{mass: {CARRIED}, com: [20, 0, 0]}}}}
  - {{planner: trapezoid, to: {{joints: [-20]}}, limits: {{effort: 45}}}}
"""


def unpacked(scene: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times (N,) and values (N, n) of a quantity, from what the page holds."""
    from base64 import b64decode

    rows = scene["rows"]
    columns = rows["quantities"][name]
    low, high, width = np.array(columns["low"]), np.array(columns["high"]), columns["width"]
    raw = np.frombuffer(b64decode(columns["values"]), np.uint8).reshape(len(low), -1, width).astype(float)
    values = low[:, None] + raw @ 256.0 ** np.arange(width) * (high - low)[:, None] / (256.0**width - 1)
    return np.frombuffer(b64decode(rows["times"]), "<f8"), values.T


@pytest.fixture(scope="module")
def carry() -> tuple[Plan, dict[str, Any]]:
    plan = planned_example("pick_carry_place")
    return plan, scene_of_plan(plan)


def test_efforts_are_those_of_the_equation_of_motion_on_both_sides_of_a_step() -> None:
    plan = plan_job(job_from_text(PENDULUM))
    times, tau = unpacked(scene_of_plan(plan), "tau")
    taken = plan.trajectory.spans[1].start
    before = np.append(times[1:] == times[:-1], False)
    expected = []
    for time, left in zip(times, before, strict=True):
        side = "left" if left else "right"
        q, qd, qdd = (plan.trajectory.curve.evaluate(time, order, side=side)[0] for order in range(3))
        carried = CARRIED if time > taken or (time == taken and not left) else 0.0
        reach = LENGTH + 0.02
        inertia = INERTIA + MASS * LENGTH**2 + carried * reach**2
        held = (MASS * LENGTH + carried * reach) * G * np.cos(q)
        expected.append(inertia * qdd + held + COULOMB * np.sign(np.round(qd, 9)))
    assert (times == taken).sum() == 2
    assert tau[:, 0] == pytest.approx(np.array(expected), abs=1e-5)


def test_efforts_are_those_of_the_command(
    carry: tuple[Plan, dict[str, Any]], capfd: pytest.CaptureFixture[str]
) -> None:
    plan, scene = carry
    times, tau = unpacked(scene, "tau")
    span = plan.trajectory.spans[2]
    inside = (times > span.start) & (times < span.end) & np.append(True, np.diff(times) > 0)
    inside &= np.append(np.diff(times) > 0, True)
    states = plan.trajectory.curve.evaluate_orders(times[inside], (0, 1, 2))
    names = [f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7)]
    lines = [",".join(map(repr, row)) for row in states.reshape(len(states), -1).tolist()]
    rows = "\n".join([",".join(names), *lines, ""])
    payload = "{mass: 5, com: [0, 0, 0.08]}"
    said = call(capfd, "dynamics", "-r", "ur5e", "--si", "--payload", payload, "-", stdin=rows)
    assert said.code == 0, said.err
    found = np.loadtxt(io.StringIO(said.out), delimiter=",", skiprows=1)
    assert len(found) > 30
    assert np.abs(found - tau[inside]).max() < 1e-4
    assert np.abs(found).max() > 50


def test_a_load_is_there_while_it_is_carried(carry: tuple[Plan, dict[str, Any]]) -> None:
    plan, scene = carry
    (load,) = scene["loads"]
    assert (load["start"], load["end"]) == (plan.trajectory.spans[2].start, plan.trajectory.spans[2].end)
    assert load["mass"] == 5
    assert load["com"] == [0, 0, 0.08]
    assert 4 / 3 * np.pi * load["radius"] ** 3 * 2700 == pytest.approx(5)


def test_what_is_put_down_and_taken_up_again_is_there_twice() -> None:
    again = (
        "  - {detach: {}}\n  - {planner: trapezoid, to: {joints: [0]}}\n"
        f"  - {{attach: {{mass: {CARRIED}, com: [20, 0, 0]}}}}\n"
    )
    moves = "  - {planner: trapezoid, to: {joints: [10]}}\n"
    plan = plan_job(job_from_text(PENDULUM + again + moves + moves.replace("10", "20")))
    spans = plan.trajectory.spans
    loads = scene_of_plan(plan)["loads"]
    intervals = [(load["start"], load["end"]) for load in loads]
    assert intervals == [(spans[2].start, spans[2].end), (spans[6].start, spans[7].end)]
    assert all((load["mass"], load["com"]) == (CARRIED, pytest.approx([0.02, 0, 0])) for load in loads)


def test_the_tightest_limit_is_that_of_the_summary(carry: tuple[Plan, dict[str, Any]]) -> None:
    assert "effort of shoulder_lift_joint uses" in carry[1]["moves"][0]["detail"]


def test_limits_of_effort_step_with_the_moves() -> None:
    scene = scene_of_plan(plan_job(job_from_text(PENDULUM)))
    assert [part["bounds"][4] for part in scene["limits"]] == [[[-50, 60]], [[-45, 45]]]


def test_a_payload_shows_efforts_that_nothing_limits() -> None:
    assert "tau" not in scene_of_plan(planned_example("ur5e_pick"))["rows"]["quantities"]
    text = PENDULUM.replace("effort: [-50, 60], ", "").replace(", limits: {effort: 45}", "")
    scene = scene_of_plan(plan_job(job_from_text(text)))
    assert "tau" in scene["rows"]["quantities"]
    assert all(len(part["bounds"]) == 4 for part in scene["limits"])
    bare = text.replace(f"  - {{attach: {{mass: {CARRIED}, com: [20, 0, 0]}}}}\n", "")
    assert "tau" not in scene_of_plan(plan_job(job_from_text(bare)))["rows"]["quantities"]


ALONE = PENDULUM[: PENDULUM.index("moves:")] + "moves:\n  - {planner: trapezoid, to: {joints: [40]}}\n"


@pytest.mark.parametrize(("mass", "radius"), [(1e-6, 0.012), (500.0, 0.35)])
def test_a_load_is_neither_lost_nor_larger_than_an_arm(mass: float, radius: float) -> None:
    text = PENDULUM.replace(f"mass: {CARRIED},", f"mass: {mass},").replace("effort: [-50, 60], ", "")
    (load,) = scene_of_plan(plan_job(job_from_text(text.replace(", limits: {effort: 45}", ""))))["loads"]
    assert (load["mass"], load["radius"]) == (mass, radius)


def test_what_is_taken_up_at_the_end_counts_from_the_end_on() -> None:
    """The last row is before it; nothing carries what is taken up then."""
    alone, after = (
        scene_of_plan(plan_job(job_from_text(ALONE + more)))
        for more in ("", f"  - {{attach: {{mass: {CARRIED}, com: [20, 0, 0]}}}}\n")
    )
    assert after["loads"] == []
    assert unpacked(after, "tau")[1] == pytest.approx(unpacked(alone, "tau")[1], abs=1e-6)


def test_each_move_has_the_efforts_of_what_is_carried_in_it() -> None:
    """The weight of what is carried, at the ends of moves, by the lever; what is between two moves takes no time."""
    attach = f"  - {{attach: {{mass: {CARRIED}, com: [20, 0, 0]}}}}\n"
    moves = [f"  - {{planner: trapezoid, to: {{joints: [{angle}]}}}}\n" for angle in (40, 60, 80, 30)]
    text = ALONE.replace(
        moves[0], "".join([attach, moves[0], "  - {detach: {}}\n", *moves[1:3], attach, moves[3]])
    )
    plan = plan_job(job_from_text(text))
    times, tau = unpacked(scene_of_plan(plan), "tau")
    for span in (span for span in plan.trajectory.spans if not span.handles):
        inside = np.flatnonzero((times > span.start) & (times < span.end))
        for side, row in (("right", inside[0]), ("left", inside[-1])):
            q, qd, qdd = (
                float(plan.trajectory.curve.evaluate(times[row], k, side=side)[0]) for k in range(3)
            )
            carried = CARRIED if span.index in (1, 6) else 0.0
            inertia = INERTIA + MASS * LENGTH**2 + carried * (LENGTH + 0.02) ** 2
            held = (MASS * LENGTH + carried * (LENGTH + 0.02)) * G * np.cos(q)
            assert tau[row, 0] == pytest.approx(inertia * qdd + held + COULOMB * np.sign(qd), abs=1e-4)


def test_efforts_are_shown_where_they_are_limited_and_inertias_are_known() -> None:
    assert "tau" in scene_of_plan(plan_job(job_from_text(ALONE)))["rows"]["quantities"]
    start, end = PENDULUM.index("\n       link:"), PENDULUM.index("gravity:")
    massless = (PENDULUM[:start] + "}\n" + PENDULUM[end:]).replace("effort: [-50, 60], ", "")
    scene = scene_of_plan(plan_job(job_from_text(massless.replace(", limits: {effort: 45}", ""))))
    assert len(scene["loads"]) == 1
    assert "tau" not in scene["rows"]["quantities"]


def test_nothing_of_no_mass_is_a_load() -> None:
    assert (
        scene_of_plan(plan_job(job_from_text(PENDULUM.replace(f"mass: {CARRIED},", "mass: 0,"))))["loads"]
        == []
    )


def test_a_load_keeps_its_place_on_the_flange_where_the_tool_is_changed() -> None:
    moves = "  - {tool: light}\n  - {planner: trapezoid, to: {joints: [10]}}\n"
    text = PENDULUM.replace("gravity:", "tools: {light: {xyz: [5, 0, 0]}}\ngravity:") + moves
    first, second = scene_of_plan(plan_job(job_from_text(text)))["loads"]
    assert (first["com"][0], second["com"][0]) == pytest.approx((0.02, 0.015))
    assert first["end"] == second["start"]
