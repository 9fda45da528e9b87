"""The largest payload of two links in a vertical plane, against their torques in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from planning.test_payload_capacity import CARRYING, EMPTY, FREE, HEAD, LAST, WHOLE, verifies
from tiers import few

from trajcli.cli.job_commands import PayloadCommand
from trajcli.cli.payload import run_payload
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import InputError, PlanningError, Problem, TrajcliError, VerificationError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.robot import Payload, point_mass
from trajcli.planning.payload_capacity import Carried, PayloadCapacity, payload_capacity
from trajcli.planning.plan import Plan, plan_job

G = 9.81


def held(pose: Sequence[float], limits: str, attached: str, at: int | None = None) -> PayloadCapacity:
    """Return the capacity of an arm that stands."""
    text = f"{HEAD}\nlimits: {{effort: {limits}}}\nstart: {{joints: {list(pose)}}}\n"
    return payload_capacity(
        job_from_text(f"{text}moves:\n{attached}  - {{planner: hold, duration: 1}}\n"), at
    )


def torques(pose: Sequence[float], com: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return what holds the links, and what holds one kilogram more, N m."""
    first, both = np.radians([pose[0], pose[0] + pose[1]])
    elbow = 0.5 * np.cos(first)
    place = elbow + (0.4 + com[0]) * np.cos(both) - com[1] * np.sin(both)
    own = 2 * (elbow + 0.2 * np.cos(both)), 2 * 0.2 * np.cos(both)
    return G * np.array([own[0] + 4 * 0.25 * np.cos(first), own[1]]), G * np.array([place, place - elbow])


@pytest.mark.parametrize("com", few([(0.06, 0.02), (0.0, 0.3), (-0.2, 0.0)], 2))
@pytest.mark.parametrize("pose", few([(0, 20), (180, -20), (60, 80), (-120, -50)], 2))
def test_of_an_arm_that_stands(pose: Sequence[float], com: Sequence[float]) -> None:
    """Limits differ by direction, and the joint that binds by the pose."""
    low, high = np.array([-70.0, -20.0]), np.array([90.0, 30.0])
    own, each = torques(pose, com)
    masses = (np.where(each > 0, high, low) - own) / each
    attached = f"  - {{attach: {{mass: 1, com: [{1e3 * com[0]}, {1e3 * com[1]}, 0]}}}}\n"
    found = held(pose, "{a: [-70, 90], b: [-20, 30]}", attached)
    joint = int(masses.argmin())
    assert found.mass == pytest.approx(masses[joint], rel=2e-6)
    assert (found.joint, found.move, found.moves) == ("ab"[joint], 1, (0, 1))
    assert found.limit == pytest.approx(np.where(each > 0, high, low)[joint])
    assert found.effort == pytest.approx(found.limit, rel=1e-5)
    assert found.com == pytest.approx([*com, 0])


def test_a_counterweight_without_which_nothing_verifies() -> None:
    """Behind the elbow: the links alone are too heavy, and so is a load that lifts them too hard."""
    found = held((0, 0), "{a: 90, b: [-40, 3]}", "  - {attach: {mass: 1, com: [-600, 0, 0]}}\n")
    own, each = torques((0, 0), (-0.6, 0))
    assert own[1] > 3
    assert found.mass == pytest.approx((-40 - own[1]) / each[1], rel=2e-6)
    assert (found.joint, found.limit) == ("b", -40)


def test_tons_are_found_as_kilograms_are() -> None:
    found = held((0, 0), "{a: 90000, b: 90000}", "")
    own, each = torques((0, 0), (0, 0))
    assert found.mass == pytest.approx((90000 - own[0]) / each[0], rel=2e-6)


def test_more_than_any_arm_carries_is_any_mass() -> None:
    """A millionth of a degree beside the vertical, where a mass of some thousand tons is too much."""
    assert held((89.99999, 0), "{a: 1000, b: 1000}", "").mass is None


def _counted(job: str, at: int | None = None) -> tuple[PayloadCapacity, int]:
    """Return the capacity, and with how many masses the job was planned."""
    tried = set[float]()

    def planned(loaded: LoadedJob, carried: Carried) -> Plan:
        masses = (carried(k, None) for k in range(len(loaded.job.moves)))
        tried.add(max(each.mass for each in masses if each is not None))
        return plan_job(loaded, carried, advise=False)

    return payload_capacity(job_from_text(job), at, planned), len(tried)


@pytest.mark.parametrize(
    ("job", "most"),
    few([(CARRYING, 6), (FREE, 12), (CARRYING.replace("b: [-40, 30]", "b: [-15, 30]"), 6)], 2),
)
def test_few_masses_are_tried_and_the_next_larger_one_fails(job: str, most: int) -> None:
    """Where the motion is given its rows say which mass; else each has its own, and a line leads there."""
    job = job.replace(LAST, "")
    found, tried = _counted(job.replace("MASS", "0.5"))
    assert tried <= most
    largest = float(found.mass or 0)
    assert verifies(job, largest)
    assert not verifies(job, largest * (1 + 1e-6))


def test_of_several_moves_that_carry_it_the_one_that_takes_most_binds() -> None:
    """Of motions that are given; it is not the last one."""
    found = payload_capacity(job_from_text(EMPTY))
    assert (found.move, found.moves) == (0, (0, 1, 2))
    assert verifies(WHOLE, float(found.mass or 0))
    assert not verifies(WHOLE, float(found.mass or 0) * (1 + 1e-6))


def test_of_several_payloads_the_one_that_is_meant() -> None:
    """The others keep the mass that the job says, also where that is too much."""
    bounds, coms = np.array([90, 30]), ((0.06, 0.02), (0.0, 0.0))
    text = HEAD + "limits: {effort: {a: 90, b: 30}}\nstart: {joints: [0, 20]}\nmoves:\n"
    text += "  - {attach: {mass: 1, com: [60, 20, 0]}}\n  - {planner: hold, duration: 1}\n  - {detach: {}}\n"
    text += "  - {attach: {mass: 2}}\n  - {planner: hold, duration: 1}\n"
    alone, last, every = (payload_capacity(job_from_text(text), at) for at in (1, 4, None))
    assert (alone.moves, last.moves, every.moves) == ((0, 1), (3, 4), (0, 1, 3, 4))
    for found, com in zip((alone, last), coms, strict=True):
        own, each = torques((0, 20), com)
        assert found.mass == pytest.approx(((bounds - own) / each).min(), rel=2e-6)
    assert every.mass == pytest.approx(min(alone.mass or 0, last.mass or 0), rel=1e-6)
    assert (every.com, last.com) == (None, pytest.approx([0, 0, 0]))
    with pytest.raises(TrajcliError):
        payload_capacity(job_from_text(text.replace("{mass: 2}", "{mass: 200}")), 1)
    second = "  - {planner: hold, duration: 1}\n"
    (one,) = held((0, 20), "{a: 90, b: 30}", second, 0).moves
    assert one == 0


@pytest.mark.parametrize("coms", few([([0, 0, 0], [300, 100, 0]), ([300, 100, 0], [0, 0, 0])], 1))
def test_each_of_several_payloads_counts_where_it_is_carried(coms: tuple[list[float], list[float]]) -> None:
    """Whether the one that is further out is the first or the second; of motions that are given."""
    text = HEAD + "limits: {effort: {a: 90, b: 30}}\nstart: {joints: [0, 0]}\nmoves:\n"
    for com, target in zip(coms, ([90, 20], [0, 0]), strict=True):
        text += f"  - {{attach: {{mass: MASS, com: {com}}}}}\n"
        text += f"  - {{planner: quintic, to: {{joints: {target}}}, duration: 2.5}}\n  - {{detach: {{}}}}\n"
    found = payload_capacity(job_from_text(text.replace("MASS", "1")))
    assert found.move == 1 + 3 * coms.index([300, 100, 0])
    assert verifies(text, float(found.mass or 0))
    assert not verifies(text, float(found.mass or 0) * (1 + 2e-6))


def _failing_above(
    largest: float, problem: Problem | LoadedJob
) -> Callable[[LoadedJob, Callable[..., Payload | None]], Plan]:
    """Return a planner that raises a problem, or plans another job, with more than a mass."""

    def planned(loaded: LoadedJob, carried: Callable[..., Payload | None]) -> Plan:
        if (carried(1, None) or point_mass(0.0)).mass <= largest:
            return plan_job(loaded, carried, advise=False)
        if isinstance(problem, Problem):
            raise PlanningError(problem)
        return plan_job(problem, carried, advise=False)

    return planned


HORIZONTAL = (
    HEAD.replace("gravity: [0, -9.81, 0]", "gravity: [0, 0, -9.81]")
    + "limits: {effort: 9000}\nstart: {joints: [0, 0]}\nmoves:\n  - {planner: hold, duration: 0.2}\n"
    + "  - {planner: quintic, to: {joints: [20, 40]}, duration: 1.5}\n"
)


@pytest.mark.parametrize(
    ("kind", "time", "shown"),
    [
        (None, 2.5, ("b", 2.5, -41.0, -40.0)),
        ("effort", 2.5, ("b", 2.5, -41.0, -40.0)),
        ("velocity", 2.5, (None, 2.5, None, None)),
        ("velocity", None, (None, None, None, None)),
    ],
)
def test_what_a_refusal_says_of_an_effort_is_told(
    kind: str | None, time: float | None, shown: tuple[object, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And of anything else its place and its words alone: 41 deg/s are no torque."""
    monkeypatch.setattr("trajcli.planning.payload_capacity._CLOSE", 0.1)
    problem = Problem("it slips", joint="b", move=1, time=time, value=-41.0, limit=-40.0, kind=kind)
    found = payload_capacity(job_from_text(HORIZONTAL), planned=_failing_above(2.0, problem))
    assert found.mass == pytest.approx(2.0, rel=0.1)
    assert (found.joint, found.time, found.effort, found.limit) == shown
    assert (found.move, found.cause) == (1, "it slips")


@pytest.mark.parametrize("value", [-41.0, 31.0])
def test_where_a_refusal_has_no_time_it_is_that_of_the_largest_effort_with_the_mass(
    value: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the joint, in the move and in the direction that are named."""
    monkeypatch.setattr("trajcli.planning.payload_capacity._CLOSE", 0.1)
    problem = Problem("it slips", joint="b", move=1, value=value, limit=value * 0.99)
    found = payload_capacity(job_from_text(HORIZONTAL), planned=_failing_above(2.0, problem))
    plan = plan_job(job_from_text(HORIZONTAL))
    times = np.linspace(0.2, 1.7, 3001)
    carrying = InverseDynamics(replace(plan.loaded.robot, payload=point_mass(float(found.mass or 0))))
    efforts = carrying.effort(*(plan.trajectory(times, order) for order in range(3)))[:, 1]
    peak = times[efforts.argmax() if value > 0 else efforts.argmin()]
    assert found.time == pytest.approx(peak, abs=1e-3)


@pytest.mark.parametrize(
    ("stopping", "flying", "wanted"), [(2.0, 1.0, 1.0), (1.0, 2.0, 2.0), (-1.0, 2.0, 2.0)]
)
def test_what_flies_by_corners_carries_less_or_more_than_what_stops(
    stopping: float, flying: float, wanted: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where nothing that stops verifies; the arm drops what is heavier."""
    monkeypatch.setattr("trajcli.planning.payload_capacity._CLOSE", 0.05)
    moves = [f"{{planner: quintic, to: {{joints: [{x}, 20]}}, duration: 1}}" for x in (10, 20)]
    text = HORIZONTAL[: HORIZONTAL.index("moves:")] + f"zone: 10\nmoves: [{', '.join(moves)}]\n"
    loaded = job_from_text(text)
    assert loaded.job.flies_by

    def planned(given: LoadedJob, carried: Callable[..., Payload | None]) -> Plan:
        payload = carried(0, None)
        assert payload is not None
        if payload.mass > (flying if given.job.flies_by else stopping):
            raise PlanningError("it slips")
        return plan_job(replace(given, job=given.job.with_stops()), carried, advise=False)

    assert payload_capacity(loaded, planned=planned).mass == pytest.approx(wanted, rel=0.1)


def test_what_is_no_effort_has_no_joint_that_needs_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """With more than two kilograms this job is too fast."""
    monkeypatch.setattr("trajcli.planning.payload_capacity._CLOSE", 0.1)
    faster = job_from_text(HORIZONTAL.replace("duration: 1.5}", "duration: 0.6}"))
    found = payload_capacity(job_from_text(HORIZONTAL), planned=_failing_above(2.0, faster))
    worst = max(plan_job(faster).verdict.findings, key=lambda each: each.excess)
    assert (worst.kind, worst.move) == ("acceleration", 1)
    assert (found.joint, found.effort, found.limit) == (None, None, None)
    assert found.cause is not None
    assert "acceleration" in found.cause
    assert (found.move, found.time) == (1, worst.time)


@pytest.mark.full
def test_only_limits_where_something_is_carried_count() -> None:
    """Those of a move, in a job that has none."""
    job = CARRYING.replace("MASS", "1").replace("limits: {effort: {a: 90, b: [-40, 30]}}\n", "")
    own = "limits: {effort: {a: 90, b: [-40, 30]}}}"
    elsewhere = job.replace("duration: 4}", f"duration: 4, {own}")
    with pytest.raises(InputError, match="no limit of effort"):
        payload_capacity(job_from_text(elsewhere))
    here = job.replace("duration: 1.5}", f"duration: 1.5, {own}")
    before = "  - {planner: hold, duration: 0.5}\n"  # behind `attach`, without a limit
    here = here.replace(
        "  - {planner: quintic, to: {joints: [20, 90]}",
        f"{before}  - {{planner: quintic, to: {{joints: [20, 90]}}",
    )
    assert (payload_capacity(job_from_text(here)).mass or 0) > 0


@pytest.mark.parametrize("target", [(160, 0), (20, 0)])
def test_where_gravity_alone_binds_its_time_is_that_of_the_pose(
    target: Sequence[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A free duration is no help: where the arm reaches out furthest, at one end of the move."""
    monkeypatch.setattr("trajcli.planning.payload_capacity._CLOSE", 2e-5)
    text = HEAD + "limits: {effort: {a: [-40, 60], b: 9}}\nstart: {joints: [90, 0]}\nmoves:\n"
    text += "  - {attach: {mass: 1}}\n  - {planner: hold, duration: 0.5}\n"
    text += f"  - {{planner: quintic, to: {{joints: {list(target)}}}}}\n  - {{planner: hold, duration: 1}}\n"
    found = payload_capacity(job_from_text(text))
    own, each = torques(target, (0, 0))
    bounds = np.where(each > 0, [60, 9], [-40, -9])
    masses = (bounds - own) / each
    assert found.mass == pytest.approx(masses.min(), rel=1e-4)
    assert found.joint == "ab"[int(masses.argmin())]
    assert found.move in (2, 3)
    assert found.time is not None
    plan = plan_job(job_from_text(text))
    reached = np.degrees(plan.trajectory.curve.evaluate(np.array([found.time]))[0])
    assert reached == pytest.approx(target, abs=6)


@pytest.mark.parametrize("further", [0, 1])
def test_of_two_joints_over_their_limits_the_one_that_is_further_over_binds(further: int) -> None:
    """A gripper that takes thrice as much as soon as it takes more than two kilograms, in a horizontal plane."""
    text = (
        HEAD.replace("[0, -9.81, 0]", "[0, 0, -9.81]") + "limits: {effort: LIMITS}\nstart: {joints: [0, 0]}\n"
    )
    text += "moves:\n  - {planner: quintic, to: {joints: [90, 60]}, duration: 2}\n"

    def planned(loaded: LoadedJob, carried: Carried) -> Plan:
        def taken(index: int, payload: Payload | None) -> Payload:
            given = carried(index, payload) or point_mass(0.0)
            return point_mass(3.0 * given.mass if given.mass > 2 else given.mass)

        return plan_job(loaded, taken, advise=False)

    plan = plan_job(job_from_text(text.replace("LIMITS", "9000")))
    rows = [plan.trajectory(np.linspace(0, 2, 2001), order) for order in range(3)]
    peaks = {
        mass: np.abs(InverseDynamics(replace(plan.loaded.robot, payload=point_mass(mass))).effort(*rows)).max(
            axis=0
        )
        for mass in (2.0, 6.0)
    }
    limits = np.where(np.arange(2) == further, peaks[2.0], 0.5 * (peaks[2.0] + peaks[6.0]))
    found = payload_capacity(job_from_text(text.replace("LIMITS", str(limits.tolist()))), planned=planned)
    shares = peaks[6.0] / limits
    assert shares[further] > shares[1 - further] > 1.1
    assert found.mass == pytest.approx(2.0, rel=1e-4)
    assert found.joint == "ab"[further]
    assert abs(found.effort or 0) == pytest.approx(peaks[6.0][further], rel=1e-3)


@pytest.mark.parametrize("move", [0, 1, 2])
def test_a_job_that_does_not_verify_empty_says_where(move: int) -> None:
    lines = EMPTY.splitlines()
    row = next(k for k, line in enumerate(lines) if "planner" in line) + move
    lines[row] = lines[row][: lines[row].index("duration")] + "duration: 0.6}"
    text = "\n".join(lines).replace("limits: {effort: {a: 90, b: [-40, 30]}}", "limits: {effort: 9000}")
    with pytest.raises(VerificationError, match="does not verify even without the payload") as refused:
        payload_capacity(job_from_text(text, "job.yaml"))
    (problem,) = refused.value.problems
    (worst,) = [each for each in plan_job(job_from_text(text)).verdict.findings[:1] if each.move == move]
    assert (problem.move, problem.joint, problem.time) == (move, worst.joint, worst.time)
    assert worst.hint is not None
    assert problem.hint == worst.hint
    assert problem.place is not None
    assert (problem.place.file, problem.place.line) == ("job.yaml", row + 1)


def test_of_several_things_that_are_wrong_without_a_payload_the_effort_is_named() -> None:
    """In a horizontal plane: the first move is too fast, and 0.1 N m do not move the second one in 1.5 s."""
    text = EMPTY.replace("duration: 2}", "duration: 0.6}").replace(
        "limits: {effort: {a: 90, b: [-40, 30]}}\n", ""
    )
    text = text.replace("duration: 1.5}", "duration: 1.5, limits: {effort: {a: 0.1}}}")
    text = text.replace("gravity: [0, -9.81, 0]", "gravity: [0, 0, -9.81]")
    findings = plan_job(job_from_text(text)).verdict.findings
    assert findings[0].kind != "effort"
    with pytest.raises(VerificationError, match="a needs a torque of") as refused:
        payload_capacity(job_from_text(text))
    (problem,) = refused.value.problems
    assert (problem.joint, problem.move) == ("a", 1)


def test_what_is_missing_is_said_at_its_place() -> None:
    text = EMPTY.replace("effort: {a: 90, b: [-40, 30]}", "velocity: 90")
    with pytest.raises(InputError, match="no limit of effort is in force") as refused:
        payload_capacity(job_from_text(text, "job.yaml"))
    (problem,) = refused.value.problems
    assert problem.place is not None
    line = text.splitlines()[problem.place.line - 1]
    assert line.startswith("limits:")
    with pytest.raises(InputError) as refused:
        payload_capacity(job_from_text(EMPTY), 3)
    assert refused.value.problems[0].hint == "its moves are 0 to 2"


def _told(job: Path, capsys: pytest.CaptureFixture[str], **options: Any) -> list[str]:
    """Return the lines that the command prints."""
    assert run_payload(PayloadCommand(job=str(job), **options)) == 0
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("output", ["", "output: {for: ros-jtc, rate: 50}\n"])
def test_the_command_seeks_what_is_carried_in_a_move_with_the_values_that_are_set(
    output: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pose, coms, limits = (0, 20), ((0.06, 0.02), (0.0, 0.3)), np.array([90, 30])
    text = HEAD + "limits: {effort: {a: 90, b: 30}}\nstart: {joints: [0, 20]}\nmoves:\n"
    for x, y in coms:
        text += f"  - {{attach: {{mass: 1, com: [{1e3 * x}, {1e3 * y}, 0]}}}}\n"
        text += "  - {planner: hold, duration: 0.1}\n  - {detach: {}}\n"
    job = tmp_path / "job.yaml"
    job.write_text(text + output, encoding="utf-8")
    for move, com in ((1, coms[0]), (4, coms[1]))[: 1 if output else 2]:
        own, each = torques(pose, com)
        (line, _) = _told(job, capsys, at=move)
        assert float(line.split()[-2]) == pytest.approx(((limits - own) / each).min(), rel=1e-5)
        assert f" in move {move}: " in line
    if output:
        return
    own, each = torques(pose, (0.2, 0))
    set_to = ["moves.0.attach.com=[200, 0, 0]", "limits.effort.a=70"]
    (line, _) = _told(job, capsys, at=1, override=set_to)
    assert float(line.split()[-2]) == pytest.approx(((np.array([70, 30]) - own) / each).min(), rel=1e-5)
    assert "[200, 0, 0] mm of the tcp" in line


def test_what_a_slide_holds_is_a_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(
        """\
version: 1
robot:
  convention: standard
  joints:
    - {name: turn, velocity: 1, link: {mass: 1, com: [0, 0, 0], inertia: [0.1, 0.1, 0.1, 0, 0, 0]}}
    - {name: lift, type: prismatic, velocity: 1, link: {mass: 2, com: [0, 0, 0], inertia: [0.1, 0.1, 0.1, 0, 0, 0]}}
limits: {effort: {turn: 10, lift: 100}}
start: {joints: [0, 0.2]}
moves: [{planner: hold, duration: 1}]
""",
        encoding="utf-8",
    )
    first, second = _told(job, capsys)
    assert float(first.split()[-2]) == pytest.approx(100 / 9.81 - 2, rel=1e-5)
    assert "lift needs 100 N in move 0" in second
    assert second.endswith("its limit is 100 N")
