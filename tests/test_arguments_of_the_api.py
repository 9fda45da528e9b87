"""Arguments of the API for Python, each by what it changes: in numbers, in files, in what is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trajcli
from tests.cli.running import call
from trajcli.batches import sweep
from trajcli.errors import Problem

SLIDE: dict[str, Any] = {
    "version": 1,
    "units": {"angle": "deg", "length": "mm"},
    "robot": {"joints": [{"name": "turn"}, {"name": "slide", "type": "prismatic"}]},
    "limits": {"velocity": 100},
    "start": {"joints": [0, 0]},
    "moves": [
        {"planner": "quintic", "to": {"joints": [40, 10]}, "duration": 2},
        {"planner": "quintic", "to": {"joints": [0, 30]}, "duration": 1},
    ],
}


def job_file(folder: Path, job: dict[str, Any] = SLIDE, name: str = "job", **changes: Any) -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps({**job, **changes}))
    return path


@pytest.mark.parametrize("per_move", [False, True])
@pytest.mark.parametrize("fastest", [False, True])
def test_a_motion_is_retimed_as_a_whole_or_move_by_move(
    tmp_path: Path, per_move: bool, fastest: bool
) -> None:
    """Quintics at 15/8 of their mean speed, 37.5 and 75 deg/s of 25: as a whole both are stretched by the worse one."""
    output = {"columns": ["t", "q", "qd", "qdd", "move"], "rate": 100}
    fast = job_file(tmp_path, output=output)
    trajcli.plan(fast).save(tmp_path / "rows.csv")
    limited = job_file(tmp_path, name="limited", limits={"velocity": 60})
    motion = trajcli.retime(tmp_path / "rows.csv", job=limited, per_move=per_move, fastest=fastest)
    first = (37.5 / 60 if fastest else 1.0) if per_move else 75 / 60
    assert motion.duration == pytest.approx(2 * first + 75 / 60, rel=1e-6)
    assert len(motion.stretches) == (2 if per_move else 1)
    assert motion.qd is not None
    assert np.degrees(np.abs(motion.qd[:, 0]).max()) == pytest.approx(60, rel=1e-4)


def test_numbers_of_a_file_without_units_are_in_those_of_the_job_by_the_kind_of_joint(tmp_path: Path) -> None:
    """Degrees of the joint that turns, millimetres of the one that slides; a motion may begin at any time."""
    rows = tmp_path / "rows.csv"
    rows.write_text("time,turn_pos,slide_pos\n3.0,0.0,0.0\n3.5,10.0,5.0\n4.5,20.0,30.0\n")
    motion = trajcli.retime(rows, job=job_file(tmp_path))
    assert motion.q.tolist() == [
        [0, 0],
        pytest.approx([np.radians(10), 5e-3]),
        pytest.approx([np.radians(20), 0.03]),
    ]
    assert motion.duration == pytest.approx(1.5)
    assert "(3 rows, 2 joints, 1.5 s)" in repr(motion)


def test_joints_are_in_the_order_of_the_arm_and_its_limits_count(tmp_path: Path) -> None:
    """A file that names the slide first, of 12 mm/s at most; and one of an arm of the catalogue."""
    rows = tmp_path / "rows.csv"
    rows.write_text("time,slide_pos,turn_pos\n" + "".join(f"{k},{6 * k:.6f},{k:.6f}\n" for k in range(5)))
    slow = job_file(tmp_path, limits={"velocity": [100, 3]})
    motion = trajcli.retime(rows, job=slow)
    assert motion.q == pytest.approx(np.outer(np.arange(5), [np.radians(1), 6e-3]))
    assert motion.duration == pytest.approx(4 * 2, rel=1e-5)
    arm = tmp_path / "arm.csv"
    arm.write_text("t,q1,q2,q3,q4,q5,q6\n" + "".join(f"{k},{4 * k:.6f},0,0,0,0,0\n" for k in range(2)))
    fastest = trajcli.load_robot("ur5e").limits.velocity[0, 1]
    assert trajcli.retime(arm, robot="ur5e").duration == pytest.approx(4 / fastest, rel=1e-5)


def test_a_file_that_names_no_moves_has_those_of_the_job_at_its_times(tmp_path: Path) -> None:
    output = {"columns": ["t", "q", "qd", "qdd"], "rate": 100}
    trajcli.plan(job_file(tmp_path, output=output)).save(tmp_path / "rows.csv")
    limited = job_file(tmp_path, name="limited", limits={"velocity": 60})
    motion = trajcli.retime(tmp_path / "rows.csv", job=limited, per_move=True)
    assert [stretch.factor for stretch in motion.stretches] == pytest.approx([1, 75 / 60], rel=1e-6)


def test_numbers_that_nobody_gives_a_unit_are_kept_on_another_grid(tmp_path: Path) -> None:
    rows = tmp_path / "rows.csv"
    rows.write_text("time,turn_pos\n" + "".join(f"{k},{2 * k}\n" for k in range(4)))
    motion = trajcli.resample(rows, 2, output=tmp_path / "after.csv")
    assert motion.q[:, 0] == pytest.approx(np.arange(7.0), abs=1e-9)
    assert motion.t == pytest.approx(np.arange(7) / 2)
    for rate in (0, -1, float("nan"), "2"):
        with pytest.raises(trajcli.InputError, match="rate: expected rows per second above 0"):
            trajcli.resample(rows, rate)  # type: ignore[arg-type]


def test_a_motion_that_jumps_where_its_file_does_not_is_refused_and_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = tmp_path / "rows.csv"
    rows.write_text("t,q1\n0,0\n1,1\n2,2\n")
    said = Problem("j1 jumps", joint="j1")
    monkeypatch.setattr("trajcli.editing.requirements.new_jumps", lambda before, after: [said])
    with pytest.raises(trajcli.VerificationError, match="j1 jumps"):
        trajcli.resample(rows, 2, output=tmp_path / "after.csv")
    assert not (tmp_path / "after.csv").exists()


def test_what_is_written_is_what_is_judged(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The motion of the file that is written is read back: its decimals are those that keep the limits."""
    trajcli.plan(job_file(tmp_path, output={"rate": 50})).save(tmp_path / "rows.csv")
    limited = job_file(tmp_path, name="limited", limits={"velocity": 41.7})
    written = trajcli.retime(tmp_path / "rows.csv", job=limited, output=tmp_path / "after.csv")
    code, out, err = call(capfd, "check", tmp_path / "after.csv", "--job", limited)
    assert code == 0, out + err
    again = trajcli.resample(tmp_path / "after.csv", 100)
    assert again.duration == pytest.approx(written.duration, abs=1e-8)
    assert not (tmp_path / "again.csv").exists()
    trajcli.resample(tmp_path / "after.csv", 100, output=tmp_path / "again.csv")
    assert (tmp_path / "again.csv").exists()


STEP: dict[str, Any] = {
    "version": 1,
    "robot": {"joints": 1},
    "limits": {"velocity": 2, "acceleration": 8, "jerk": 40},
    "start": {"joints": [0]},
    "moves": [{"planner": "jerk_limited", "to": {"joints": [1]}}],
    "output": {"rate": 7},
}


def test_a_batch_is_strict_for_a_consumer_and_has_its_rows_where_it_is_asked_to(tmp_path: Path) -> None:
    """Quintics between seven rows per second pass the jerk; between knots they are the motion itself."""
    jobs = [job_file(tmp_path, STEP)]

    def outcome(name: str, **options: Any) -> tuple[str, int]:
        (one,) = trajcli.batch(jobs, tmp_path / name, processes=1, **options)
        rows = tmp_path / name / "job.csv"
        return one.outcome, rows.read_text().count("\n") - 1 if rows.exists() else 0

    assert outcome("plain") == ("written", 8)
    assert outcome("plain") == ("unchanged", 8)
    assert outcome("plain", force=True) == ("written", 8)
    assert outcome("strict", strict=True) == ("failed", 0)
    assert outcome("ros", consumer="ros-jtc") == ("failed", 0)
    switches = trajcli.plan(jobs[0]).trajectory.curve.pieces + 1
    kind, count = outcome("knots", rows="knots", strict=True)
    assert kind == "written"
    assert count >= switches
    kind, count = outcome("knots for ros", rows="knots", consumer="ros-jtc", strict=True)
    assert (kind, count >= switches) == ("written", True)


def test_rows_of_a_job_that_fails_now_are_set_aside(tmp_path: Path) -> None:
    job = job_file(tmp_path, STEP)
    trajcli.batch(job, processes=1)
    job_file(tmp_path, STEP, limits={"velocity": 2, "acceleration": 8, "jerk": -1})
    (failed,) = trajcli.batch(job, processes=1)
    assert failed.outcome == "failed"
    assert not (tmp_path / "job.csv").exists()
    assert (tmp_path / "job.csv.stale").exists()


def test_a_sweep_draws_by_its_seed_and_keeps_its_table(tmp_path: Path) -> None:
    job, table = job_file(tmp_path, STEP), tmp_path / "table.csv"
    vary = {"limits.velocity": "0.5..2:30", "limits.jerk": [20, 40]}
    drawn = [trajcli.sweep(job, vary, processes=1, samples=3, seed=seed) for seed in (1, 2, 1)]
    values = [[row.values for row in each.rows] for each in drawn]
    assert [len(each) for each in values] == [3, 3, 3]
    assert values[0] == values[2] != values[1]
    for row in drawn[0].rows:
        limits = {**STEP["limits"], "velocity": float(row.values[0]), "jerk": float(row.values[1])}
        plan = trajcli.plan({**STEP, "limits": limits})
        assert row.point.duration == pytest.approx(plan.trajectory.duration, rel=1e-9)
    trajcli.sweep(job, {"limits.jerk": [40, 20]}, table, processes=1)
    assert table.read_text().count("\n") == 3


def test_rows_of_a_sweep_are_in_the_order_of_its_values_whichever_is_done_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = sweep.outcomes_of

    def last_first(*arguments: Any) -> Iterator[Any]:
        yield from reversed(list(done(*arguments)))

    monkeypatch.setattr(sweep, "outcomes_of", last_first)
    found = trajcli.sweep(job_file(tmp_path, STEP), {"limits.jerk": [20, 40, 30]}, processes=1)
    assert [float(row.values[0]) for row in found.rows] == [20, 40, 30]
    durations = [row.point.duration for row in found.rows]
    assert durations[0] > durations[2] > durations[1]


def test_an_arm_names_its_frames_and_its_solutions_beyond_limits() -> None:
    robot = trajcli.load_robot("irb4600")
    q = np.array([0.3, 0.2, 0.1, 0.4, 0.5, 0.6])
    pose, turn = robot.fk(q), robot.fk(q)[:3, :3]
    world, tcp = robot.jacobian(q), robot.jacobian(q, "tcp")
    np.testing.assert_allclose(tcp[:3], turn.T @ world[:3], atol=1e-12)
    np.testing.assert_allclose(tcp[3:], turn.T @ world[3:], atol=1e-12)
    low, high = robot.limits.position.T
    every, inside = robot.ik(pose, near=q, every=True), robot.ik(pose, near=q)
    assert 0 < len(inside) < len(every)
    for found in every:
        kept = bool(((found.joints >= low - 1e-9) & (found.joints <= high + 1e-9)).all())
        assert found.within_limits == kept
        assert ("outside limits" in repr(found)) == (not kept)
        missed = robot.fk(found.joints) - pose
        assert np.abs(missed[:3, 3]).max() <= found.closure + 1e-12
    distances = [np.abs(found.joints - q).max() for found in every]
    assert distances == sorted(distances)
    assert not every[0].singular
    straight = robot.fk(
        [0.3, 0.2, 0.1, 0.4, 0.0, 0.6]
    )  # the wrist stretched: its first and last axis are one
    assert any(found.singular for found in robot.ik(straight))


def test_rows_and_consumer_of_a_plan_go_before_its_job(tmp_path: Path) -> None:
    job = job_file(tmp_path, STEP)
    assert trajcli.plan(job, rows="knots").loaded.job.output.rows == "knots"
    assert trajcli.plan(job, rows="knots", consumer="ros-jtc").loaded.job.output.rows == "knots"
    with pytest.raises(trajcli.VerificationError, match="ros-jtc at 7 Hz"):
        trajcli.plan(job, rows="rate", consumer="ros-jtc")
    knots = job_file(tmp_path, STEP, output={"rows": "knots"})
    with pytest.raises(trajcli.VerificationError, match="the rows have 1 joint, and 6 are moved"):
        trajcli.plan(knots, consumer="ur-servoj")
    with pytest.raises(trajcli.InputError, match="ur-servoj takes rows at 500 Hz, and `rows: knots`"):
        trajcli.plan(knots, rows="knots", consumer="ur-servoj")


def test_a_plan_for_a_consumer_is_saved_with_the_digits_that_it_needs(tmp_path: Path) -> None:
    """Of 20 rad/s^3 a rounding of 1e-9 rad makes 60 at 1 kHz: rows of a plan for nobody have nine decimals all the same."""
    limits = {"velocity": 0.1, "acceleration": 1, "jerk": 20}
    moves = [{"planner": "quintic", "to": {"joints": [0.1]}, "duration": 3}]
    job = job_file(tmp_path, {**STEP, "limits": limits, "moves": moves}, output={"rate": 1000})
    longest = {}
    for consumer in (None, "ros-jtc"):
        for digits in (None, "fixed", "full"):
            trajcli.plan(job, consumer=consumer).save(tmp_path / "rows.csv", digits=digits)  # type: ignore[arg-type]
            cells = (tmp_path / "rows.csv").read_text().split("\n", 1)[1].replace("\n", ",").split(",")
            longest[consumer, digits] = max(len(cell.partition(".")[2]) for cell in cells)
    assert longest[None, None] == longest[None, "fixed"] == longest["ros-jtc", "fixed"] == 9
    assert longest["ros-jtc", None] == longest["ros-jtc", "full"] > 12


def test_a_motion_of_arrays_is_judged_by_all_that_is_given() -> None:
    """A quintic of 1 rad in 1 s between two rows: 1.875 rad/s; as a cubic 1.5, along a line 1."""
    ends: Any = ([0.0, 1.0], [[0.0], [1.0]])
    still = {"qd": [[0.0], [0.0]], "qdd": [[0.0], [0.0]]}
    for limit, given in ((1.876, still), (1.501, {"qd": still["qd"]})):
        assert trajcli.check(*ends, limits={"velocity": limit}, **given).findings == ()
        (found,) = trajcli.check(*ends, limits={"velocity": limit - 0.002}, **given).findings
        assert found.value == pytest.approx(limit - 0.001)
    asked = trajcli.check(*ends, limits={"velocity": 1.7}, interpolate="cubic", **still)
    assert asked.findings == ()


def test_pages_are_packed_and_pictures_have_the_joints_that_are_asked_for(tmp_path: Path) -> None:
    plan = trajcli.plan(SLIDE)
    sizes = {}
    for compress in (False, True):
        trajcli.view(plan, tmp_path / "page.html", compress=compress)
        sizes[compress] = (tmp_path / "page.html").stat().st_size
    assert sizes[True] < 0.8 * sizes[False]
    names = {}
    for joints in ((), ("turn",), "slide"):
        trajcli.plot(plan, tmp_path / "picture.svg", joints=joints, quantities="q")
        names[joints] = {name for name in ("turn", "slide") if name in (tmp_path / "picture.svg").read_text()}
    assert names[("turn",)] == {"turn"}
    assert names["slide"] == {"slide"}
    with pytest.raises(trajcli.InputError, match="a job names its own"):
        trajcli.view(plan, tmp_path / "none.html", beside=plan, robot="ur5e")


@pytest.mark.parametrize("given", ["x", None, [1.0], True])
def test_what_is_no_number_is_refused_by_name(given: Any) -> None:
    arm = trajcli.load_robot("ur5e")
    pose = arm.fk([0, -1, 1, 0, 1, 0])
    with pytest.raises(trajcli.InputError, match="tolerance: expected a number, got"):
        arm.ik(pose, tolerance=given)
    with pytest.raises(trajcli.InputError, match="rate: expected a number, got"):
        trajcli.plan(SLIDE).trajectory.sample(given)
    assert arm.ik(pose, tolerance=np.float32(1e-6))
    assert len(trajcli.plan(SLIDE).trajectory.sample(np.int64(2)).t) == 7


@pytest.mark.parametrize("off", [5e-6, 1e-9])
def test_a_pose_that_is_off_a_rotation_means_the_nearest_one(off: float) -> None:
    """The polar factor, by the square root of R^T R; answers reach it, not what is off."""
    arm = trajcli.load_robot("ur5e")
    pose = arm.fk([0.3, -1, 1, 0.2, 1, 0.1])
    pose[:3, :3] += off * np.array([[0, 1, 0.5], [0.2, 0, 0], [0, 0.3, 0.7]])
    values, vectors = np.linalg.eigh(pose[:3, :3].T @ pose[:3, :3])
    nearest = pose[:3, :3] @ vectors @ np.diag(values**-0.5) @ vectors.T
    answers = arm.ik(pose)
    assert answers
    for answer in answers:
        np.testing.assert_allclose(arm.fk(answer.joints)[:3, :3], nearest, atol=0.05 * off, rtol=0)


def test_answers_are_named_as_far_as_their_arm_has_names_and_the_nearest_to_zero_comes_first() -> None:
    arm = trajcli.load_robot("scara")
    answers = arm.ik(arm.fk(np.full(len(arm.joints), 0.3)))
    assert {tuple(answer.branch.items()) for answer in answers} == {(("elbow", "up"),), (("elbow", "down"),)}
    assert {repr(answer).split("], ")[1] for answer in answers} == {"up)", "down)"}
    six = trajcli.load_robot("ur5e")
    found = [np.abs(answer.joints).max() for answer in six.ik(six.fk([0.3, -1.2, 1.4, -0.7, 0.9, 0.2]))]
    assert len(found) == 8
    assert found == sorted(found)


def test_lines_are_a_text_and_no_path() -> None:
    with pytest.raises(trajcli.InputError):
        trajcli.plan("moves:\n- hold\n")


def test_a_table_of_no_format_is_refused_before_anything_is_planned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(sweep, "outcomes_of", lambda *arguments: asked.append(arguments))
    with pytest.raises(trajcli.InputError, match="xyz"):
        trajcli.sweep(
            job_file(tmp_path, STEP), {"limits.jerk": [20, 40]}, tmp_path / "table.xyz", processes=1
        )
    assert asked == []
    assert not (tmp_path / "table.xyz").exists()
