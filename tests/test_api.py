"""The API for Python: jobs of every form, callable trajectories, one-line texts, arms."""

from __future__ import annotations

import copy
import csv
import json
import pickle
import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

import trajcli
from tests.cli.running import run
from trajcli.api.plans import is_yaml
from trajcli.streams.reading import read_table

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
CUBIC = {
    "version": 1,
    "units": {"angle": "deg"},
    "robot": {"joints": 1},
    "start": {"joints": 20},
    "moves": [{"planner": "cubic", "to": {"joints": [50]}, "duration": 1}],
}
START_AND_MOVES = "version: 1\nstart: {joints: 0}\nmoves: [{planner: hold, duration: 1}]\n"
TEXT = """
version: 1
units: {angle: deg}
robot: {joints: 1}
start: {joints: 20}
moves: [{planner: cubic, to: {joints: [50]}, duration: 1}]
"""


def test_a_path_a_text_a_mapping_and_a_read_job_give_the_same_plan(tmp_path: Path) -> None:
    file = tmp_path / "job.yaml"
    file.write_text(TEXT)
    loaded = trajcli.load_job(file)
    numpy_mapping = {**CUBIC, "start": {"joints": np.array([20.0])}, "robot": {"joints": np.int64(1)}}
    curves = [
        trajcli.plan(job).trajectory.curve.coefficients
        for job in (file, str(file), TEXT, TEXT.strip(), CUBIC, numpy_mapping, loaded)
    ]
    for other in curves[1:]:
        np.testing.assert_array_equal(other, curves[0])
    # 20 + 90 t^2 - 60 t^3, the textbook's cubic
    assert np.rad2deg(curves[0][:, 0, 0]) == pytest.approx([-60, 90, 0, 20])


def test_a_flow_mapping_is_a_text_and_a_name_is_a_path() -> None:
    assert is_yaml("{version: 1}")
    assert is_yaml('{"version":1,"robot":"ur5e"}')
    assert is_yaml("version: 1")
    assert not is_yaml("folder/job.yaml")
    assert not is_yaml("C:/folder/job.yaml")
    with pytest.raises(trajcli.FileError, match=r"nowhere\.yaml"):
        trajcli.plan("nowhere.yaml")


@pytest.mark.parametrize(
    ("job", "message"),
    [
        ({**CUBIC, "moves": [{"planner": "cubik", "to": {"joints": 1}}]}, "cubik"),
        ({**CUBIC, "start": {"joints": float("nan")}}, "expected a finite number, got .nan"),
        ({**CUBIC, "start": {"joints": {1, 2}}}, "the job's start.joints: a value of type set"),
        ({**CUBIC, 3: 4}, "expected texts as keys, got 3"),
        (3, "expected a job, got a value of type int"),
        (None, "expected a job, got a value of type NoneType"),
    ],
)
def test_a_wrong_job_is_one_clear_error(job: object, message: str) -> None:
    with pytest.raises(trajcli.InputError, match=re.escape(message)):
        trajcli.plan(job)  # type: ignore[arg-type]


def test_an_error_shows_its_place_and_advice_in_a_traceback(tmp_path: Path) -> None:
    file = tmp_path / "job.yaml"
    file.write_text(TEXT.replace("cubic", "cubik"))
    with pytest.raises(trajcli.InputError) as raised:
        trajcli.plan(file)
    assert raised.value.__notes__ == [f"{file}:6:19: did you mean 'cubic'?"]
    with pytest.raises(trajcli.InputError) as raised:
        trajcli.plan({**CUBIC, "start": {"joints": float("nan")}})
    assert raised.value.__notes__ == ["mapping:4:17"]


def test_overrides_change_a_file_and_nothing_else() -> None:
    plan = trajcli.plan(EXAMPLES / "cubic.yaml", overrides=["moves.0.duration=3"])
    assert plan.trajectory.duration == 3
    with pytest.raises(trajcli.InputError, match="overrides are for job files"):
        trajcli.plan(CUBIC, overrides=["moves.0.duration=3"])


def test_a_trajectory_is_a_function_of_time() -> None:
    trajectory = trajcli.plan(CUBIC).trajectory
    t = np.linspace(0, 1, 12).reshape(3, 4)
    for order, expected in enumerate([20 + 90 * t**2 - 60 * t**3, 180 * t - 180 * t**2, 180 - 360 * t]):
        values = trajectory(t, order)
        assert values.shape == (3, 4, 1)
        np.testing.assert_allclose(np.rad2deg(values[..., 0]), expected, atol=1e-12)
    assert trajectory(0.5).shape == (1,)


def test_times_count_from_the_start_time() -> None:
    plan = trajcli.plan({**CUBIC, "output": {"start_time": 10}})
    assert plan.trajectory.start_time == 10
    assert np.rad2deg(plan.trajectory(10.5)) == pytest.approx([35])
    rows = plan.trajectory.sample(4)
    assert rows.t.tolist() == [10, 10.25, 10.5, 10.75, 11]


@pytest.mark.parametrize("time", [-0.01, 1.01, float("nan"), float("inf")])
def test_a_time_outside_is_an_error(time: float) -> None:
    with pytest.raises(trajcli.InputError, match="lies outside the trajectory"):
        trajcli.plan(CUBIC).trajectory([0.5, time])


@pytest.mark.parametrize("order", [-1, 1.5, True, "1"])
def test_a_wrong_order_is_an_error(order: object) -> None:
    with pytest.raises(trajcli.InputError, match="the order of the derivative is"):
        trajcli.plan(CUBIC).trajectory(0.5, order)  # type: ignore[arg-type]


@given(rate=st.floats(0.5, 2000))
def test_the_ends_of_rounded_times_are_inside(rate: float) -> None:
    trajectory = trajcli.plan({**CUBIC, "output": {"start_time": 0.1}}).trajectory
    rows = trajectory.sample(rate)
    np.testing.assert_allclose(trajectory(rows.t), rows.q, atol=1e-12)


@pytest.mark.parametrize("rate", [0, -1, float("nan"), float("inf"), 1e30])
def test_a_wrong_rate_is_an_error(rate: float) -> None:
    with pytest.raises(trajcli.InputError, match="the rate"):
        trajcli.plan(CUBIC).trajectory.sample(rate)


def test_samples_are_the_rows_that_the_command_writes() -> None:
    job = EXAMPLES / "ur5e_pick.yaml"
    rows = trajcli.plan(job).trajectory.sample(125)
    with (Path(__file__).parent / "golden/ur5e_pick.csv").open() as file:
        written = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])
    factors = np.pi / 180
    assert len(rows) == len(written)
    np.testing.assert_allclose(rows.t, written[:, 0], atol=1e-9)
    for k, values in enumerate((rows.q, rows.qd, rows.qdd)):
        np.testing.assert_allclose(values, written[:, 1 + 6 * k : 7 + 6 * k] * factors, atol=1e-9)


def test_every_text_is_one_short_line() -> None:
    plan = trajcli.plan(EXAMPLES / "ur5e_pick.yaml")
    robot = trajcli.load_robot("ur5e")
    solution = robot.ik(robot.fk([0.1] * 6))[0]
    shown = [
        plan,
        plan.trajectory,
        plan.trajectory.sample(10),
        plan.verdict,
        plan.loaded,
        plan.trajectory.curve,
        robot,
        robot.limits,
        solution,
    ]
    for value in shown:
        assert "\n" not in repr(value)
        assert len(repr(value)) <= 160, repr(value)
    assert repr(plan) == "PlannedJob('ur5e_pick', UR5e, 9 moves, 6.8513 s, verified)"
    assert repr(plan.trajectory) == "Trajectory(6 joints, 9 moves, 6.8513 s)"
    assert repr(robot) == "Arm('UR5e', 6 joints, standard DH rows)"


@pytest.mark.parametrize("change", [{}, {"limits": {"velocity": 40}}])
def test_a_plan_goes_to_another_process_and_back(change: dict[str, object], tmp_path: Path) -> None:
    """By pickle, as multiprocessing and caches of results do; a deep copy is made in the same manner."""
    plan = trajcli.plan({**CUBIC, **change})
    for copied in (pickle.loads(pickle.dumps(plan)), copy.deepcopy(plan)):
        assert repr(copied) == repr(plan)
        assert repr(copied.verdict) == repr(plan.verdict)
        assert copied.report() == plan.report()
        np.testing.assert_array_equal(copied.trajectory([0.25, 0.75], 1), plan.trajectory([0.25, 0.75], 1))
        if not change:
            copied.save(tmp_path / "copied.csv")
            plan.save(tmp_path / "plan.csv")
            assert (tmp_path / "copied.csv").read_bytes() == (tmp_path / "plan.csv").read_bytes()


def test_a_verdict_says_what_is_wrong() -> None:
    plan = trajcli.plan({**CUBIC, "limits": {"velocity": 40}})
    assert repr(plan.verdict) == "Verdict(1 finding: velocity of j1)"


def test_a_plan_saves_itself(tmp_path: Path) -> None:
    plan = trajcli.plan(EXAMPLES / "sync.yaml")
    plan.save(tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_bytes() == (Path(__file__).parent / "golden/sync.csv").read_bytes()
    with pytest.raises(trajcli.InputError, match=r"not as \.txt"):
        plan.save(tmp_path / "rows.txt")
    wrong = trajcli.plan({**CUBIC, "limits": {"velocity": 40}})
    with pytest.raises(trajcli.VerificationError, match="reaches 45 deg/s"):
        wrong.save(tmp_path / "wrong.csv")
    assert [file.name for file in tmp_path.iterdir()] == ["rows.csv"]


@pytest.mark.parametrize(("name", "consumer"), [("trapezoid", None), ("sync", None), ("septic", "ros-jtc")])
def test_a_report_is_that_of_the_command(name: str, consumer: str | None, tmp_path: Path) -> None:
    """Rows that are joined, and rules of the consumer, stand in it, too."""
    report = tmp_path / "report.json"
    options = ("--rate", "30") if consumer is None else ("--for", consumer)
    command = ["plan", str(EXAMPLES / f"{name}.yaml"), "--no-output", "-q", "--report", str(report), *options]
    assert run(*command).code == 0
    overrides = ["output.rate=30"] if consumer is None else []
    made = trajcli.plan(EXAMPLES / f"{name}.yaml", overrides=overrides, consumer=consumer).report()
    assert json.loads(made.model_dump_json()) == json.loads(report.read_text("utf-8"))
    assert made.verdict == "verified"
    assert made.rows is not None
    assert (made.consumer is None) == (consumer is None)


@pytest.mark.parametrize("ending", ["csv", "mcap", "jsonl", "yaml"])
def test_a_plan_saves_itself_in_every_format(ending: str, tmp_path: Path) -> None:
    plan = trajcli.plan(EXAMPLES / "ur5e_pick.yaml")
    plan.save(tmp_path / f"rows.{ending}", digits="full")
    table = read_table(tmp_path / f"rows.{ending}")
    t = table.column("t")
    for joint in range(6):
        name, factor = (f"q{joint + 1}_deg", np.pi / 180) if ending == "csv" else (f"q{joint + 1}", 1.0)
        expected = plan.trajectory(np.minimum(t, plan.trajectory.duration))[:, joint]
        np.testing.assert_allclose(table.column(name) * factor, expected, atol=1e-8)


def test_logs_of_save_and_of_batch_have_the_report_of_plan(tmp_path: Path) -> None:
    """With the event of rows every 1/30 s of a trapezoid that pass its acceleration between them."""
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nrobot: {joints: [{velocity: 1, acceleration: 2}]}\nstart: {joints: 0}\n"
        "moves: [{planner: trapezoid, to: {joints: 1}}]\noutput: {rate: 30}\n"
    )
    logs = [tmp_path / f"{name}.mcap" for name in ("plan", "save", "job")]
    assert run("plan", str(job), "-q", "-o", str(logs[0])).code == 0
    trajcli.plan(job).save(logs[1])
    assert run("batch", str(job), "-j", "1", "-q", "--format", "mcap").code == 0
    reports = []
    for log in logs:
        with log.open("rb") as stream:
            attached = make_reader(stream).iter_attachments()
            reports.append(next(json.loads(each.data) for each in attached if each.name == "report.json"))
    assert [event["kind"] for event in reports[0]["events"]] == ["joined_over_limit"]
    assert reports[1] == reports[0]
    assert reports[2] == reports[0]


def test_a_notebook_draws_a_plan():
    plan = trajcli.plan(EXAMPLES / "cubic.yaml")
    picture = plan._repr_svg_()
    root = ET.fromstring(picture)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert picture == trajcli.plan(EXAMPLES / "cubic.yaml")._repr_svg_()


def test_an_arm_answers_questions() -> None:
    robot = trajcli.load_robot("ur5e")
    q = np.array([0.3, -1.2, 1.4, -0.7, 0.9, 0.2])
    pose = robot.fk(q)
    solutions = robot.ik(pose, near=q)
    assert len(solutions) == 8
    np.testing.assert_allclose(solutions[0].joints, q, atol=1e-9)
    for solution in solutions:
        np.testing.assert_allclose(robot.fk(solution.joints), pose, atol=1e-9)
        assert solution.within_limits
    assert {tuple(solution.branch.values()) for solution in solutions} == {
        (shoulder, elbow, wrist)
        for shoulder in ("left", "right")
        for elbow in ("up", "down")
        for wrist in ("flip", "no_flip")
    }
    # the Jacobian's linear rows are the derivative of the position
    step = 1e-6
    columns = [
        (robot.fk(q + step * e)[:3, 3] - robot.fk(q - step * e)[:3, 3]) / (2 * step) for e in np.eye(6)
    ]
    np.testing.assert_allclose(robot.jacobian(q)[:3], np.transpose(columns), atol=1e-8)
    far = pose.copy()
    far[0, 3] = 10.0
    assert robot.ik(far) == ()


def test_the_arm_of_a_job_has_its_base_and_its_tool(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text("robot: planar2r\nbase: {xyz: [1, 0, 0]}\n" + START_AND_MOVES)
    plain, of_job = trajcli.load_robot("planar2r"), trajcli.load_robot(tmp_path / "job.yaml")
    shift = np.array([[0, 0, 0, 1.0], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    np.testing.assert_allclose(of_job.fk([0.5, 0.25]), plain.fk([0.5, 0.25]) + shift, atol=1e-15)


@pytest.mark.full
def test_the_page_runs_as_it_stands(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    (tmp_path / "examples").symlink_to(EXAMPLES)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text("version: 2")
    names: dict[str, object] = {}
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    for block in blocks:
        exec(block, names)
        for line in block.splitlines():
            statement, _, promised = line.partition("  # ")
            if promised.strip().startswith(("PlannedJob", "True")):
                assert repr(eval(statement, names)) == promised.strip()
    assert len(blocks) == 7
    for name in (
        "swing.csv",
        "faster.csv",
        "swing_500.csv",
        "pick.svg",
        "swing.html",
        "out/cubic.csv",
        "out/quintic.csv",
    ):
        assert (tmp_path / name).exists()


def test_a_rounded_pose_is_projected_and_a_wrong_one_refused() -> None:
    robot = trajcli.load_robot("ur5e")
    pose = robot.fk([0.3, -1.2, 1.4, -0.7, 0.9, 0.2])
    found = robot.ik(np.round(pose, 5))
    assert len(found) == 8
    assert max(solution.closure for solution in found) < 1e-9, "of the rotation that is nearest"
    for wrong in (np.eye(3), 2 * pose, pose * [-1, 1, 1, 1], np.full((4, 4), np.nan)):
        with pytest.raises(trajcli.InputError):
            robot.ik(wrong)


def test_words_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    with pytest.raises(trajcli.InputError, match="no frame 'flange'"):
        trajcli.load_robot("ur5e").jacobian([0.0] * 6, "flange")  # type: ignore[arg-type]
    with pytest.raises(trajcli.InputError, match="fixed or full digits, got 'all'"):
        trajcli.plan(CUBIC).save(tmp_path / "rows.csv", digits="all")  # type: ignore[arg-type]
    with pytest.raises(trajcli.InputError, match=r"moves\.0\.duration has no values"):
        trajcli.sweep(EXAMPLES / "cubic.yaml", {"moves.0.duration": []})
    with pytest.raises(trajcli.InputError, match=r"a page is HTML, and 'view\.txt' is"):
        trajcli.view(EXAMPLES / "cubic.yaml", tmp_path / "view.txt")
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("name", [3, None, {"joints": 2}])
def test_a_robot_that_is_no_name_is_wrong_input(name: object) -> None:
    with pytest.raises(trajcli.InputError, match="the catalogue has no robot"):
        trajcli.load_robot(name)  # type: ignore[arg-type]


def test_what_is_no_array_of_numbers_is_wrong_input() -> None:
    robot, words = trajcli.load_robot("ur5e"), ["a"] * 6
    pose, trajectory = robot.fk([0.3] * 6), trajcli.plan(CUBIC).trajectory
    for call, message in (
        (lambda: robot.fk(words), "q: expected an array of numbers, got <U1"),
        (lambda: robot.ik(pose, words), "near: expected an array of numbers, got <U1"),
        (lambda: robot.ik(pose, np.zeros((2, 6))), "near: expected the values of 6 joints, got shape (2, 6)"),
        (lambda: robot.ik("pose"), "pose: expected an array of numbers"),
        (lambda: trajectory("now"), "t: expected an array of numbers"),
        (
            lambda: trajcli.check([0, 1], [[0, 1], [0]]),
            "q: expected an array of numbers, got rows of several",
        ),
        (lambda: trajcli.check([0, 1], [0, 1]), "q: expected shape (N, n), a row for each time"),
    ):
        with pytest.raises(trajcli.InputError, match=re.escape(message)):
            call()


def test_arguments_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    job, table = EXAMPLES / "cubic.yaml", tmp_path / "rows.csv"
    table.write_text("t,q1\n0,0\n1,0\n")
    vary, page = {"moves.0.duration": [1]}, tmp_path / "page.html"
    endless: dict[str, object] = {}
    endless["moves"] = [endless]
    for call, message in (
        (lambda: trajcli.sweep(job, vary, processes=0), "processes: expected 1 to 1024, got 0"),
        (lambda: trajcli.sweep(job, vary, timeout=-1), "timeout: expected seconds above 0, or None for ever"),
        (lambda: trajcli.batch(job, timeout=float("nan")), "timeout: expected seconds above 0"),
        (lambda: trajcli.batch([]), "there is no job in an empty list"),
        (lambda: trajcli.batch(job, form="xyz"), "rows are written in no format 'xyz'"),  # type: ignore[arg-type]
        (lambda: trajcli.view(job, page, robot="ur5e"), "robot: it is for files of rows"),
        (lambda: trajcli.view(job, page, meshes=-1), "meshes: expected megabytes, 0 at least, got -1"),
        (lambda: trajcli.resample(table, "100"), "rate: expected rows per second above 0"),  # type: ignore[arg-type]
        (lambda: trajcli.sweep(job, "moves.0.duration=1"), "vary: expected a mapping of paths to values"),  # type: ignore[arg-type]
        (lambda: trajcli.sweep(job, {"moves.0.duration": 1.0}), "moves.0.duration has no values"),  # type: ignore[dict-item]
        (lambda: trajcli.sweep(job, {"moves.0.duration": np.array(1.0)}), "moves.0.duration has no values"),
        (lambda: trajcli.plan(job, consumer=table), "there is no profile"),  # type: ignore[arg-type]
        (lambda: trajcli.schema_of("jobs"), "there is no schema 'jobs'"),  # type: ignore[arg-type]
        (lambda: trajcli.resample(table, True), "rate: expected rows per second above 0, got True"),
        (lambda: trajcli.plan({"moves": endless}), "more than 100 levels deep"),
    ):
        with pytest.raises(trajcli.InputError, match=re.escape(message)):
            call()
    assert [*tmp_path.iterdir()] == [table]


def test_one_name_serves_where_several_may_stand(tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_bytes((EXAMPLES / "cubic.yaml").read_bytes())
    assert [outcome.outcome for outcome in trajcli.batch(str(job), processes=1)] == ["written"]
    trajcli.plot(job, tmp_path / "one.svg", over=tmp_path / "job.csv", quantities="q,qd", joints="j1")
    trajcli.plot(
        job, tmp_path / "two.svg", over=[tmp_path / "job.csv"], quantities=["q", "qd"], joints=["j1"]
    )
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    assert trajcli.plan(job, overrides="moves.0.duration=3").trajectory.duration == 3
    values: list[Iterable[float]] = [[1.0, 2.0], np.array([1.0, 2.0]), (value for value in (1.0, 2.0))]
    for points in values:
        table = trajcli.sweep(job, {"moves.0.duration": points}, processes=1)
        assert [row.point.duration for row in table.rows] == [1.0, 2.0]


def test_the_text_of_a_job_in_one_line_is_a_job_everywhere(tmp_path: Path) -> None:
    text = "{version: 1, robot: {joints: 1}, start: {joints: 0}, moves: [{planner: cubic, to: {joints: 1}, duration: 1}]}"
    assert trajcli.plan(text).verdict.passed
    trajcli.plot(text, tmp_path / "job.svg")
    trajcli.view(text, tmp_path / "job.html")
    table = trajcli.sweep(text, {"moves.0.duration": [1, 2]}, processes=1)
    assert [row.point.verdict for row in table.rows] == ["verified", "verified"]


def test_files_are_judged_in_pages_and_pictures_as_the_commands_do(tmp_path: Path) -> None:
    job, rows = tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(TEXT + "limits: {velocity: 100}\n")
    rows.write_text("t,q1_deg\n0,20\n0.01,50\n")
    for beside, arm in ((None, job), (job, None)):
        trajcli.view(rows, tmp_path / "page.html", beside=beside, robot=arm)
        page = (tmp_path / "page.html").read_text()
        assert "not judged" not in page
        assert '"state":"violated"' in page
    trajcli.view(trajcli.plan(job), tmp_path / "of_plan.html", beside=rows)
    trajcli.view(job, tmp_path / "of_job.html", beside=rows)
    assert (tmp_path / "of_plan.html").read_bytes() == (tmp_path / "of_job.html").read_bytes()
    trajcli.plot(job, tmp_path / "marked.svg", over=rows)
    run("plot", str(job), str(rows), "-o", str(tmp_path / "by_command.svg"))
    assert (tmp_path / "marked.svg").read_bytes() == (tmp_path / "by_command.svg").read_bytes()


def test_a_format_whose_rows_are_joined_otherwise_than_was_judged_is_refused(tmp_path: Path) -> None:
    """Cubics keep the steps of a trapezoid; a log has accelerations as well, and quintics pass them."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 2, "acceleration": 8},
        "start": {"joints": [0]},
        "moves": [{"planner": "trapezoid", "to": {"joints": [1]}}],
        "output": {"for": "ros-jtc", "columns": ["t", "q", "qd"], "rows": "knots"},
    }
    plan = trajcli.plan(job)
    for name in ("rows.csv", "rows.npz", "goal.yaml"):
        plan.save(tmp_path / name)
        assert (tmp_path / name).exists()
    with pytest.raises(trajcli.VerificationError, match="the acceleration of j1 reaches") as refused:
        plan.save(tmp_path / "log.mcap")
    assert not (tmp_path / "log.mcap").exists()
    assert abs(refused.value.problems[0].limit or 0.0) == pytest.approx(8, rel=1e-9)
