"""Consumers, columns, topics and fields that are named beside a job, and rows at the borders of its moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from test_files_beside_jobs import TWO_MOVES as SLOW_MOVES

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import load_job
from trajcli.judge.file import CheckedFile, CheckOptions, Delivered, check_file
from trajcli.streams.mcap.definitions import CONTROLLER_STATE, JOINT_STATE, JOINT_TRAJECTORY, definition_of
from trajcli.streams.recorded_motion import MotionFile

RULE = "=" * 80
NO_TIME = {"sec": 0, "nanosec": 0}
QUINTIC = """\
version: 1
robot: {joints: 2}
limits: {velocity: 9, acceleration: ACCELERATION, jerk: null}
start: {joints: [0, 0.5]}
moves: [{planner: quintic, to: {joints: [1, 0.5]}, duration: DURATION}]
output: {rate: 100FOR}
"""
TWO_MOVES = SLOW_MOVES.replace("[1, 0]}, duration: 1}", "[1, 0]}, duration: 0.3}")
PLANAR = """\
version: 1
robot: planar2r
limits: {velocity: 3, acceleration: 8, jerk: 60}
start: {joints: [0.3, 1.2]}
moves: [{planner: quintic, to: {joints: [0.9, 0.8]}}]
"""


def quintic(duration: float = 1.0, limit: float = 90.0, consumer: str = "") -> str:
    """Return a job of one move whose first joint goes 1 rad by the minimum-jerk law."""
    job = QUINTIC.replace("ACCELERATION", f"{limit}").replace("DURATION", f"{duration}")
    return job.replace("FOR", f", for: {consumer}" if consumer else "")


def checked(
    folder: Path,
    job: str,
    text: Sequence[str],
    delivered: Delivered | None = None,
    **asked: str | None,
) -> CheckedFile:
    """Return a file of lines judged by a job."""
    (folder / "job.yaml").write_text(job)
    (folder / "rows.csv").write_text("\n".join(text) + "\n")
    options = CheckOptions(job=str(folder / "job.yaml"), **asked)
    return check_file(str(folder / "rows.csv"), options, delivered=delivered)


def rows_of_quintic(duration: float = 1.0, decimals: int = 9) -> list[str]:
    """Return the rows of the job of one move, their stamps with so many decimals."""
    t = np.append(np.arange(0.0, duration - 1e-9, 0.01), duration)
    u = t / duration
    q = 10 * u**3 - 15 * u**4 + 6 * u**5
    return [
        "t,q1,q2",
        *(f"{a:.{decimals}f},{b:.9f},0.5" for a, b in zip(t.tolist(), q.tolist(), strict=True)),
    ]


def asked_for(calls: list[str | None]) -> Delivered:
    """Return what is asked for the plan for a consumer, has none, and keeps for whom it was."""

    def refuse(_: object, profile: str | None, __: str) -> object:
        calls.append(profile)
        raise PlanningError("none")

    return refuse  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("job", "option", "wanted"),
    [
        ("", None, []),
        ("", "ros-jtc", ["ros-jtc"]),
        ("ur-servoj", None, [None]),  # the one that the job names
        ("ur-servoj", "ros-jtc", ["ros-jtc"]),
        ("ros-jtc", "ros-jtc", ["ros-jtc", None]),  # beside the option the job's own rows do not count
    ],
)
def test_of_two_consumers_that_are_named_that_of_the_option_counts(
    job: str, option: str | None, wanted: list[str | None], tmp_path: Path
) -> None:
    calls = list[str | None]()
    found = checked(tmp_path, quintic(consumer=job), rows_of_quintic(), asked_for(calls), profile=option)
    assert calls == wanted
    assert found.judgement.planned_rows is True
    assert found.judgement.planned_with is None


def test_rows_of_the_plan_are_planned_for_nobody_though_their_stamps_last_longer(tmp_path: Path) -> None:
    """1.0006 s is written as 1.001 s, which is longer than the motion, as rows for a consumer are."""
    calls = list[str | None]()
    found = checked(tmp_path, quintic(1.0006), rows_of_quintic(1.0006, 3), asked_for(calls))
    assert (found.judgement.planned_rows, calls) == (True, [])
    others = rows_of_quintic(1.0006, 3)
    others[50] = f"{others[50][:-1]}6"  # 0.1 rad off: they may be of a slower motion for somebody
    assert checked(tmp_path, quintic(1.0006), others, asked_for(calls)).judgement.planned_rows is False
    assert "ros-jtc" in calls


def test_a_plan_that_exceeds_a_limit_is_compared_with_nothing(tmp_path: Path) -> None:
    """The law reaches 10 / sqrt(3) = 5.77 rad/s^2."""
    calls = list[str | None]()
    found = checked(tmp_path, quintic(limit=5.7), rows_of_quintic(), asked_for(calls)).judgement
    assert (found.planned_rows, calls) == (None, [])


def test_columns_that_are_named_are_the_joints_whatever_poses_stand_beside_them(tmp_path: Path) -> None:
    """The poses are where the arm starts, and stay there; the named columns end at 0.4 rad."""
    u = np.linspace(0.0, 1.0, 21)
    pose = [0.3 * np.cos(0.3) + 0.2 * np.cos(1.5), 0.3 * np.sin(0.3) + 0.2 * np.sin(1.5)]
    states = np.column_stack([u, 0.3 + 0.1 * u, np.full_like(u, 1.2), *np.tile(pose, (21, 1)).T])
    lines = [",".join(f"{value:.9f}" for value in row) for row in states.tolist()]
    text = ["t,first,second,x,y,z", *(f"{line},0" for line in lines)]
    named = checked(tmp_path, PLANAR, text, columns="q1=first,q2=second", units="rad,m")
    assert not [note for note in named.judgement.notes if "found back" in note]
    np.testing.assert_allclose(named.motion.whole().q[-1], [0.4, 1.2])
    poses = checked(tmp_path, PLANAR, text, units="rad,m")
    assert [note for note in poses.judgement.notes if "found back" in note]


def log(
    path: Path,
    topics: Sequence[str],
    kind: str,
    definition: str,
    state: Callable[[int, int], dict[str, object]],
) -> None:
    """Write a log of 5 states, 0.1 s apart, in each topic."""
    from mcap_ros2.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        schema = writer.register_msgdef(kind, definition)
        for k in range(5):
            header = {"stamp": {"sec": 0, "nanosec": k * 10**8}, "frame_id": ""}
            for number, topic in enumerate(topics):
                writer.write_message(topic, schema, {"header": header, **state(number, k)}, log_time=k)
        writer.finish()


def judged_log(path: Path, job: Path, **asked: str) -> CheckedFile:
    job.write_text(PLANAR)
    return check_file(str(path), CheckOptions(job=str(job), **asked))


@pytest.mark.parametrize("topic", [0, 1])
def test_a_topic_that_is_named_is_read_though_another_has_states_too(topic: int, tmp_path: Path) -> None:
    def state(number: int, k: int) -> dict[str, object]:
        q = [0.3 + 0.1 * k * number, 1.2]
        return {"name": ["j1", "j2"], "position": q, "velocity": [], "effort": []}

    log(tmp_path / "a.mcap", ["/one", "/other"], JOINT_STATE, definition_of(JOINT_STATE), state)
    with pytest.raises(InputError, match="several topics with joints"):
        judged_log(tmp_path / "a.mcap", tmp_path / "job.yaml")
    found = judged_log(tmp_path / "a.mcap", tmp_path / "job.yaml", topic=["/one", "/other"][topic])
    np.testing.assert_allclose(found.motion.whole().q[-1], [0.3 + 0.4 * topic, 1.2])


@pytest.mark.parametrize("field", ["reference", "feedback"])
def test_a_field_that_is_named_is_read_as_the_hint_says(field: str, tmp_path: Path) -> None:
    """Also of an arm with geometry, whose joints would be found back from poses."""
    parts = definition_of(JOINT_TRAJECTORY).partition(RULE)[2]
    point = "trajectory_msgs/JointTrajectoryPoint"
    definition = (
        f"std_msgs/Header header\nstring[] joint_names\n{point} reference\n{point} feedback\n{RULE}{parts}"
    )

    def state(_: int, k: int) -> dict[str, object]:
        empty = {"velocities": [], "accelerations": [], "effort": [], "time_from_start": NO_TIME}
        reference, feedback = {"positions": [0.3, 1.2]}, {"positions": [0.3 + 0.1 * k, 1.2]}
        return {"joint_names": ["j1", "j2"], "reference": reference | empty, "feedback": feedback | empty}

    log(tmp_path / "a.mcap", ["/state"], CONTROLLER_STATE, definition, state)
    with pytest.raises(InputError, match="holds the states reference, feedback") as caught:
        judged_log(tmp_path / "a.mcap", tmp_path / "job.yaml")
    assert f"--field {field}" in (caught.value.problems[0].hint or "")
    found = judged_log(tmp_path / "a.mcap", tmp_path / "job.yaml", field=field)
    np.testing.assert_allclose(found.motion.whole().q[-1], [0.7 if field == "feedback" else 0.3, 1.2])


def test_columns_of_the_tool_are_not_read_where_the_robot_has_no_geometry(tmp_path: Path) -> None:
    head, *lines = rows_of_quintic()
    found = checked(
        tmp_path, quintic(), [f"{head},x,y,z,qw,qx,qy,qz", *(f"{line},1,2,3,1,0,0,0" for line in lines)]
    ).judgement
    assert "columns that are not read: x, y, z, qw, qx, qy, qz" in found.notes
    assert found.verdict == "satisfied"


@pytest.mark.parametrize("law", ["quintic, duration: 1", "trapezoid, duration: 0.001"])
def test_a_remark_on_a_job_is_nothing_that_it_concedes(law: str, tmp_path: Path) -> None:
    """A tool in the place of that of the arm is one; with a plan and without: no trapezoid lasts a millisecond."""
    job = "version: 1\nrobot: fr3\nlimits: {velocity: 0.5}\ntool: {xyz: [0, 0, 0.1]}\nstart: {joints: [0, 0, 0, -1.5, 0, 1.5, 0]}\n"
    job += f"moves: [{{planner: {law}, to: {{joints: [0.1, 0, 0, -1.5, 0, 1.5, 0]}}}}]\n"
    (tmp_path / "job.yaml").write_text(job)
    assert [event.kind for event in load_job(tmp_path / "job.yaml").events] == ["own_tool_replaced"]
    rows = [f"{0.01 * k:.2f},0,0,0,-1.5,0,1.5,0" for k in range(3)]
    assert checked(tmp_path, job, ["t,q1,q2,q3,q4,q5,q6,q7", *rows]).judgement.events == ()


def stamps(begins: float, late: int) -> list[str]:
    """Return rows 0.1 s apart, the fourth some roundings late, in which a joint goes 0.25 rad after that.

    The first one lies 0.7 of a rounding after `begins`, a number of its own, and all are written to the last digit.
    """
    unit = Decimal(float(np.spacing(abs(begins))))
    t = [
        Decimal(begins) + Decimal("0.7") * unit + Decimal("0.1") * k + late * unit * (k == 3)
        for k in range(14)
    ]
    return ["t,q1,q2", *(f"{each:.45f},0,{0.25 * (k > 3)}" for k, each in enumerate(t))]


@pytest.mark.parametrize("begins", [0.5, 3.0, 2.0**20, -(2.0**20) + 8])
@pytest.mark.parametrize(("late", "move"), [(0, 1), (-5, 0)])
def test_a_row_is_of_the_move_that_begins_there_as_far_as_numbers_of_its_size_say(
    begins: float, late: int, move: int, tmp_path: Path
) -> None:
    """The second move begins 0.3 s after the first row and has 2 rad/s, and from the fourth row on there are 2.5.

    The first row is read as 0.3 roundings later than it is, the fourth as up to half a rounding earlier.
    """
    found = checked(tmp_path, TWO_MOVES, stamps(begins, late), interpolate="linear").judgement
    assert not [note for note in found.notes if "no column `move`" in note]
    fast = [(each.joint, each.move) for each in found.findings if each.kind == "velocity"]
    assert fast == ([("j2", 1)] if move else [])


@pytest.mark.parametrize("size", [13, 12, 1])
def test_the_last_row_says_how_long_a_file_lasts_though_it_stands_alone(
    size: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = MotionFile.blocks
    monkeypatch.setattr(MotionFile, "blocks", lambda self, rows=size: blocks(self, rows))
    found = checked(tmp_path, TWO_MOVES, stamps(0.0, 0), interpolate="linear").judgement
    assert not [note for note in found.notes if "no column `move`" in note]


@pytest.mark.parametrize(
    ("lasts", "decimals", "named"), [(1.3004, 3, True), (1.3004, 4, True), (1.302, 3, False)]
)
def test_a_file_lasts_as_long_as_the_plan_within_the_rounding_of_its_stamps(
    lasts: float, decimals: int, named: bool, tmp_path: Path
) -> None:
    """1.3004 s is written as 1.300 s; 2 ms are four roundings."""
    t = np.append(0.1 * np.arange(13), lasts if decimals == 4 else 1.3)
    rows = [f"{each:.{decimals}f},0,0" for each in t.tolist()]
    job = TWO_MOVES.replace("duration: 1,", f"duration: {lasts - 0.3:.4f},")
    notes = checked(tmp_path, job, ["t,q1,q2", *rows]).judgement.notes
    assert any("no column `move`" in note for note in notes) is not named


def constant_speeds(speeds: Sequence[float], moves: Sequence[int]) -> list[str]:
    """Return rows 0.1 s apart in which the second joint goes at so many rad/s in each of some moves, for 1 s."""
    q2 = np.append(0.0, np.cumsum(np.repeat(speeds, 10) * 0.1))
    of_rows = np.append(np.repeat(moves, 10), moves[-1])
    return [
        "t,q1,q2,move",
        *(f"{0.1 * k:.9f},0,{q:.9f},{move}" for k, (q, move) in enumerate(zip(q2, of_rows, strict=True))),
    ]


NO_PLAN = """\
version: 1
robot: {joints: 2}
limits: {velocity: 3, acceleration: 50}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [0, 1]}, duration: 1, limits: {velocity: [3, 0.5]}}
  - {planner: quintic, to: {joints: [0, 2]}, duration: 1}
  - {planner: trapezoid, to: {joints: [0, 9]}, duration: 0.01}
"""


def test_without_a_plan_limits_of_single_moves_count(tmp_path: Path) -> None:
    """Its first move allows its second joint 0.5 rad/s, its last has no law."""
    judgement = checked(tmp_path, NO_PLAN, constant_speeds([0.4, 0.6], [0, 1])).judgement
    assert not judgement.findings
    judgement = checked(tmp_path, NO_PLAN, constant_speeds([0.6, 0.6], [0, 1])).judgement
    fast = [(each.move, each.joint, each.limit) for each in judgement.findings if each.kind == "velocity"]
    assert fast == [(0, "j2", 0.5)]


def test_without_a_plan_what_a_tool_carries_counts(tmp_path: Path) -> None:
    """Held at rest a UR5e stretched forward bears itself, and not 12 kg more: gravity alone takes 178 N m."""
    job = """\
version: 1
robot: ur5e
limits: {acceleration: 10, effort: robot}
start: {joints: [0, 0, 0, 0, 1.5, 0]}
moves:
  - {planner: hold, duration: 1}
  - {attach: {mass: 12, com: [0, 0, 0.08]}}
  - {planner: hold, duration: 1}
"""
    names = ",".join(f"{name}{joint}" for name in ("q", "qd", "qdd") for joint in range(1, 7))
    rows = [f"{0.1 * k:.1f},0,0,0,0,1.5,0,{'0,' * 12}{0 if k < 10 else 2}" for k in range(21)]
    judgement = checked(tmp_path, job, [f"t,{names},move", *rows]).judgement
    assert any("the job has no plan" in note for note in judgement.notes)
    efforts = [(each.move, each.joint) for each in judgement.findings if each.kind == "effort"]
    assert efforts == [(2, "shoulder_lift_joint")]


@pytest.mark.parametrize(("moves", "said"), [([0, 1], None), ([1, 7], "7"), ([8, 9], "8, 9")])
def test_moves_that_the_job_does_not_have_are_named(
    moves: list[int], said: str | None, tmp_path: Path
) -> None:
    notes = checked(tmp_path, TWO_MOVES, constant_speeds([0.1, 0.1], moves)).judgement.notes
    assert [note for note in notes if f"no move {said}:" in note] == [n for n in notes if "no move" in n]
    assert any("no move" in note for note in notes) is (said is not None)
