"""What a job says of a file beside it: limits of each move, start, end, and whether its rows are proven already."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from trajcli.errors import InputError
from trajcli.judge import file as file_module
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.streams.recorded_motion import MotionFile

TWO_MOVES = """\
version: 1
robot: {joints: 2}
limits: {velocity: 9, acceleration: 90, jerk: null}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [1, 0]}, duration: 1}
  - {planner: quintic, to: {joints: [1, 1]}, duration: 1, limits: {velocity: 2}}
output: {rate: 100}
"""
"""Minimum-jerk laws reach 15/8 of their distance in a second."""
ONE_MOVE = """\
version: 1
robot: {joints: 2}
limits: {velocity: 9, acceleration: ACCELERATION, jerk: null}
start: {joints: [0, 0.5]}
moves: [{planner: PLANNER, to: {joints: [1, END]}, duration: 1}]
output: {rate: 100}
"""


def quintic(u: np.ndarray) -> list[np.ndarray]:
    """Return the minimum-jerk law from 0 to 1 and two derivatives."""
    u = np.clip(u, 0.0, 1.0)
    return [10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)]


def cubic(u: np.ndarray) -> list[np.ndarray]:
    return [u**2 * (3 - 2 * u), 6 * u * (1 - u), 6 - 12 * u]


def judged(folder: Path, job: str, rows: np.ndarray, names: str, **asked: str) -> Judgement:
    (folder / "job.yaml").write_text(job)
    lines = (",".join(f"{value:.9f}" for value in row) for row in rows.tolist())
    (folder / "rows.csv").write_text("\n".join([names, *lines]) + "\n")
    options = CheckOptions(job=str(folder / "job.yaml"), **asked)
    return check_file(str(folder / "rows.csv"), options).judgement


def two_moves(first: float, second: float, stretch: float = 1.0) -> np.ndarray:
    """Return rows of both moves with distances of their own."""
    t = 0.01 * np.arange(201)
    states = [
        np.stack([first * one, second * other], axis=1) / stretch**order
        for order, (one, other) in enumerate(zip(quintic(t), quintic(t - 1), strict=True))
    ]
    return np.hstack([t[:, None] * stretch, *states])


NAMES = "t,q1,q2,qd1,qd2,qdd1,qdd2"


@pytest.mark.parametrize("begins", [0.0, 5.0, -0.75])
@pytest.mark.parametrize(("second", "over"), [(1.06, False), (1.08, True), (-1.08, True)])
def test_rows_have_the_limits_of_the_moves_at_their_times(second, over, begins, tmp_path) -> None:
    """The second move has 2 rad/s, which 1.08 rad exceed; the first one goes at 2.25 rad/s, and may."""
    rows = two_moves(1.2, second)
    rows[:, 0] += begins
    judgement = judged(tmp_path, TWO_MOVES, rows, NAMES)
    found = [
        (each.joint, each.move, abs(each.limit)) for each in judgement.findings if each.kind == "velocity"
    ]
    assert found == ([("j2", 1, 2.0)] if over else [])
    assert not any("no column `move`" in note for note in judgement.notes)
    assert judgement.planned_rows is False


@pytest.mark.parametrize("stretch", [1.001, 0.999])
def test_rows_that_last_longer_or_shorter_are_of_no_move(stretch: float, tmp_path: Path) -> None:
    judgement = judged(tmp_path, TWO_MOVES, two_moves(1.2, 1.08, stretch), NAMES)
    assert not [each for each in judgement.findings if each.kind == "velocity"]
    assert any("no column `move`" in note for note in judgement.notes)


@pytest.mark.parametrize("stretch", [1.0, 2.0, 0.9])
def test_rows_of_a_job_of_one_move_are_of_that_whatever_they_last(stretch: float, tmp_path: Path) -> None:
    job = ONE_MOVE.replace("PLANNER", "quintic").replace("END", "0.5").replace("ACCELERATION", "90")
    rows = rows_of(quintic, 0.5)
    rows[:, 0] *= stretch
    slow = job.replace("duration: 1}", "duration: 1, limits: {velocity: 0.5}}")
    judgement = judged(tmp_path, slow, rows[:, :3], "t,q1,q2")
    assert [each.move for each in judgement.findings if each.kind == "velocity"] == [0]
    assert not any("no column `move`" in note for note in judgement.notes)


@pytest.mark.parametrize(("late", "named"), [(4e-7, True), (-4e-7, True), (3e-6, False)])
def test_a_file_lasts_as_long_as_the_plan_within_a_microsecond(
    late: float, named: bool, tmp_path: Path
) -> None:
    rows = two_moves(1.2, 1.08)
    rows[-1, 0] += late
    notes = judged(tmp_path, TWO_MOVES, rows, NAMES).notes
    assert any("no column `move`" in note for note in notes) is not named


@pytest.mark.parametrize(("step", "over"), [(0.025, True), (0.015, False)])
def test_a_row_where_a_move_begins_is_of_that_move_as_far_as_its_stamp_says(
    step: float, over: bool, tmp_path: Path
) -> None:
    """The second move begins at 1.0003 s, and the row of that time says 1.000: from there on 2 rad/s are allowed."""
    job = TWO_MOVES.replace("[1, 0]}, duration: 1}", "[1, 0]}, duration: 1.0003}")
    (tmp_path / "job.yaml").write_text(job)
    q = np.where(np.arange(201) > 100, step, 0.0)
    lines = [f"{0.01 * k:.3f},0.0,{each:.9f}" for k, each in enumerate(q.tolist())]
    (tmp_path / "rows.csv").write_text("\n".join(["t,q1,q2", *lines]) + "\n")
    judgement = check_file(str(tmp_path / "rows.csv"), CheckOptions(job=str(tmp_path / "job.yaml"))).judgement
    assert not any("no column `move`" in note for note in judgement.notes)
    found = [(each.joint, each.move) for each in judgement.findings if each.kind == "velocity"]
    assert found == ([("j2", 1)] if over else [])


@pytest.mark.parametrize(
    ("tolerance", "allowed"), [(None, 1e-3), ("0.02", 0.02), ("1 deg", np.pi / 180), ("0", 0.0)]
)
def test_the_first_row_is_where_the_job_starts(tolerance: str | None, allowed: float, tmp_path: Path) -> None:
    asked = {} if tolerance is None else {"start_tolerance": tolerance}
    for by in (allowed + 1e-5, allowed - 1e-5, -allowed - 1e-5):
        rows = two_moves(1.0, 1.0)
        rows[:, 2] += by
        findings = judged(tmp_path, TWO_MOVES, rows, NAMES, **asked).findings
        found = [each.joint for each in findings if (each.rule, each.kind) == ("state", "start")]
        assert found == (["j2"] if abs(by) > allowed else [])


def test_a_start_tolerance_below_zero_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least 0"):
        judged(tmp_path, TWO_MOVES, two_moves(1, 1), NAMES, start_tolerance="-0.1")


def rows_of(law, end: float, period: float = 0.01) -> np.ndarray:
    u = np.arange(round(1 / period) + 1) * period
    start, change = np.array([0.0, 0.5]), np.array([1.0, end - 0.5])
    states = [values[:, None] * change for values in law(u)]
    return np.hstack([u[:, None], start + states[0], *states[1:]])


@pytest.mark.parametrize("limit", [5.7, 5.8])
def test_rows_of_a_plan_that_fails_are_judged_like_any_others(limit: float, tmp_path: Path) -> None:
    """The law reaches 10/sqrt(3) = 5.77 rad/s^2: nothing is proven of a plan that exceeds its limits."""
    job = ONE_MOVE.replace("PLANNER", "quintic").replace("END", "0.5").replace("ACCELERATION", str(limit))
    judgement = judged(tmp_path, job, rows_of(quintic, 0.5), NAMES)
    passes = limit > 10 / 3**0.5
    assert judgement.verdict == ("satisfied" if passes else "exceeded")
    assert (judgement.planned_rows is True) is passes


@pytest.mark.parametrize(("asked", "verdict"), [({}, "satisfied"), ({"interpolate": "cubic"}, "exceeded")])
def test_rows_of_a_plan_are_proven_unless_somebody_says_how_they_are_joined(asked, verdict, tmp_path) -> None:
    """Every quarter of a second: cubics between these reach more than the law, and more than the limit."""
    rows, limit = rows_of(quintic, 0.5, 0.25)[:, :5], 5.8
    curve = CubicHermiteSpline(rows[:, 0], rows[:, 1], rows[:, 3])
    assert np.abs(curve(np.linspace(0, 1, 1001), 2)).max() > 1.05 * limit
    job = ONE_MOVE.replace("PLANNER", "quintic").replace("END", "0.5").replace("ACCELERATION", str(limit))
    judgement = judged(tmp_path, job, rows, "t,q1,q2,qd1,qd2", **asked)
    assert (judgement.planned_rows, judgement.verdict) == (True, verdict)
    severities = {each.severity for each in judgement.findings if each.kind == "acceleration"}
    assert severities == {"error" if asked else "warning"}


@pytest.mark.parametrize("end", [0.5, 1.5, -0.5])
@pytest.mark.parametrize("wrong", [None, 0, 1])
def test_an_acceleration_that_steps_in_the_end_is_promised_by_no_joint_but_those_that_stand(
    wrong: int | None, end: float, tmp_path: Path
) -> None:
    """Cubics end with an acceleration of six times their distance, down or up; a joint that stands ends with none."""
    job = ONE_MOVE.replace("PLANNER", "cubic").replace("END", str(end)).replace("ACCELERATION", "90")
    rows = rows_of(cubic, end)
    rows[50, 1] += 1e-5  # no rows of the plan
    if wrong is not None:
        rows[-1, 5 + wrong] += 0.5
    findings = judged(tmp_path, job, rows, NAMES).findings
    found = [each.joint for each in findings if (each.kind, each.quantity) == ("end", "acceleration")]
    assert found == (["j2"] if wrong == 1 and end == 0.5 else [])


@pytest.mark.parametrize("missing", [None, 1, 57, 98])
def test_a_row_that_is_missing_is_told_though_all_others_are_those_of_the_plan(
    missing: int | None, tmp_path: Path
) -> None:
    job = ONE_MOVE.replace("PLANNER", "quintic").replace("END", "0.5").replace("ACCELERATION", "90")
    rows = rows_of(quintic, 0.5)
    rows = rows if missing is None else np.delete(rows, missing, axis=0)
    judgement = judged(tmp_path, job, rows, NAMES)
    assert judgement.planned_rows is (missing is None)
    found = [(each.row, each.severity) for each in judgement.findings if each.kind == "time"]
    assert found == ([] if missing is None else [(missing + 1, "warning")])


@pytest.mark.parametrize(
    ("profile", "asked", "joined", "peak"),
    [
        (None, None, "quintic", 15 / 8),
        ("ros-jtc", None, "jtc", 15 / 8),  # as its controller does, whole states being there
        ("ros-jtc", "cubic", "cubic", 3 / 2),
        ("ros-jtc", "linear", "linear", 1.0),
        ("ros-jtc", "hold", "hold", 0.0),
        ("ur-servoj", None, "quintic", 15 / 8),  # nobody says how it joins rows
        ("ur-servoj", "cubic", "cubic", 3 / 2),
    ],
)
def test_rows_are_joined_as_a_profile_says_unless_somebody_says_otherwise(
    profile: str | None, asked: str | None, joined: str, peak: float, tmp_path: Path
) -> None:
    """From rest to rest over 1 rad in 1 s: what a quintic, a cubic, a straight line, and a step reach between rows."""
    (tmp_path / "arm.yaml").write_text("joints: 1\n")
    (tmp_path / "rows.csv").write_text("t,q1,qd1,qdd1\n0,0,0,0\n1,1,0,0\n2,1,0,0\n")
    for limit in (peak - 0.01, peak + 0.01):
        (tmp_path / "limits.yaml").write_text(f"velocity: {max(limit, 1e-3)}\n")
        options = CheckOptions(
            robot=str(tmp_path / "arm.yaml"),
            limits=str(tmp_path / "limits.yaml"),
            profile=profile,
            interpolate=asked,
        )
        judgement = check_file(str(tmp_path / "rows.csv"), options).judgement
        assert judgement.interpolation == joined
        over = [each.value for each in judgement.findings if (each.rule, each.kind) == ("limit", "velocity")]
        assert over == ([pytest.approx(peak)] if 0 < limit < peak else [])


def beside_arm(folder: Path, rows: str, joints: str = "joints: 1\n", **asked: str | None) -> Judgement:
    """Return the judgement of a file by an arm and limits of it, without a job."""
    (folder / "arm.yaml").write_text(joints)
    (folder / "rows.csv").write_text(rows)
    options = CheckOptions(**{"robot": str(folder / "arm.yaml"), **asked})
    return check_file(str(folder / "rows.csv"), options).judgement


@pytest.mark.parametrize("rate", [0.5, 100, 1e9])
def test_rows_without_times_have_the_rate_that_is_said(rate: float, tmp_path: Path) -> None:
    found = beside_arm(tmp_path, "q1\n0\n1\n2\n", rate=f"{rate:g}")
    assert found.period == pytest.approx(1 / rate)
    for wrong in ("0", "-1", "1.001e9"):
        with pytest.raises(InputError, match="above 0 and at most 1e"):
            beside_arm(tmp_path, "q1\n0\n1\n2\n", rate=wrong)


def test_options_that_exclude_each_other_or_lack_what_they_are_about_are_refused(tmp_path: Path) -> None:
    (tmp_path / "limits.yaml").write_text("velocity: 1\n")
    (tmp_path / "arm.yaml").write_text("joints: 2\n")
    other = {"limits": str(tmp_path / "limits.yaml"), "robot": str(tmp_path / "arm.yaml")}
    for name, path in other.items():
        with pytest.raises(InputError, match=f"--{name} is given"):
            judged(tmp_path, TWO_MOVES, two_moves(1, 1), NAMES, **{name: path})
    with pytest.raises(InputError, match="--payload exclude"):
        judged(tmp_path, TWO_MOVES, two_moves(1, 1), NAMES, payload="1 kg")
    with pytest.raises(InputError, match="--start-tolerance is about the start"):
        beside_arm(tmp_path, "t,q1\n0,0\n1,1\n", start_tolerance="0.1")
    with pytest.raises(InputError, match="judged by"):
        beside_arm(tmp_path, "t,q1\n0,0\n1,1\n", robot=None)
    with pytest.raises(InputError, match="overrides values of a job, and there is none"):
        beside_arm(tmp_path, "t,q1\n0,0\n1,1\n", override=("limits.velocity=1",))


@pytest.mark.parametrize(("units", "limit"), [(None, 30.0), ("deg", np.pi / 6)])
def test_limits_beside_an_arm_have_the_units_that_are_said(
    units: str | None, limit: float, tmp_path: Path
) -> None:
    """As in a job in rad, unless somebody says others; 30 rad/s are more than the sheet of the arm allows."""
    (tmp_path / "limits.yaml").write_text("velocity: 30\n")
    (tmp_path / "rows.csv").write_text("t,q1,q2,q3,q4,q5,q6\n0,0,0,0,0,0,0\n1,1,0,0,0,0,0\n2,100,0,0,0,0,0\n")
    options = CheckOptions(robot="ur5e", limits=str(tmp_path / "limits.yaml"), units=units)
    checked = check_file(str(tmp_path / "rows.csv"), options)
    np.testing.assert_allclose(checked.robot.limits.velocity[:, 1], limit)
    assert bool(checked.judgement.events) is (units is None)
    assert checked.units.angle == (units or "rad")


SHORT = "{planner: trapezoid, to: {joints: [0.4, 0]}, duration: 0.01}"


def test_a_job_without_a_plan_still_says_limits(tmp_path: Path) -> None:
    """No trapezoid lasts so short a time: so nothing is said of start and end, which these rows miss."""
    job = TWO_MOVES.replace("{velocity: 9,", "{position: [[-0.5, 0.5], [-0.5, 0.5]], velocity: 2,")
    job = job.replace("{planner: quintic, to: {joints: [1, 0]}, duration: 1}", SHORT)
    rows = two_moves(0.45, 0.2)
    rows[:, 2] += 0.2
    found = judged(tmp_path, job, rows, NAMES)
    assert any("the job has no plan" in note for note in found.notes)
    assert {each.kind for each in found.findings} == set()
    fast = judged(tmp_path, job, two_moves(1.2, 0.2), NAMES)  # beyond 0.5 rad, and at 2.25 rad/s
    assert {each.kind for each in fast.findings if each.certainty == "exceeded"} == {"position", "velocity"}


@pytest.mark.parametrize("law", ["planner: quintic, duration: 1", "planner: trapezoid, duration: 0.001"])
def test_what_a_job_takes_for_granted_is_said_with_and_without_a_plan(law: str, tmp_path: Path) -> None:
    """No trapezoid lasts so short a time."""
    job = "version: 1\nrobot: ur5e\nlimits: {velocity: 20}\nstart: {joints: [0, 0, 0, 0, 0, 0]}\n"
    job += f"moves: [{{{law}, to: {{joints: [0.5, 0, 0, 0, 0, 0]}}}}]\n"
    rows = np.hstack([0.01 * np.arange(3)[:, None], np.zeros((3, 6))])
    found = judged(tmp_path, job, rows, "t,q1,q2,q3,q4,q5,q6")
    assert any("20 rad/s" in event for event in found.events)
    assert any("has no plan" in note for note in found.notes) is ("trapezoid" in law)
    stricter = judged(tmp_path, job.replace("velocity: 20", "velocity: 1"), rows, "t,q1,q2,q3,q4,q5,q6")
    assert stricter.events == ()


@pytest.mark.parametrize("joint", [0, 1])
def test_a_start_tolerance_is_an_angle_or_a_length_by_joint(joint: int, tmp_path: Path) -> None:
    """5 is 5 deg where the joint turns, and 5 mm where it slides."""
    job = "version: 1\nunits: {angle: deg, length: mm}\nrobot: {joints: [{type: revolute}, {type: prismatic}]}\n"
    job += (
        "limits: {velocity: [900, 9000], acceleration: [9000, 90000], jerk: null}\nstart: {joints: [0, 0]}\n"
    )
    job += "moves: [{planner: quintic, to: {joints: [30, 100]}, duration: 1}]\noutput: {rate: 100}\n"
    allowed = (5.0, 5.0)
    for by in (0.99, 1.01, -1.01):
        start, t = np.zeros(2), 0.01 * np.arange(101)
        start[joint] = by * allowed[joint]
        states = start + quintic(t)[0][:, None] * (np.array([30.0, 100.0]) - start)
        rows = np.hstack([t[:, None], states])
        found = judged(tmp_path, job, rows, "t,q1,q2", start_tolerance="5", units="deg,mm").findings
        off = [each.joint for each in found if (each.rule, each.kind) == ("state", "start")]
        assert off == ([f"j{joint + 1}"] if abs(by) > 1 else [])


@pytest.mark.parametrize("by", [0.0, 2e-3])
def test_a_consumer_is_told_where_the_job_starts(by: float, tmp_path: Path) -> None:
    rows = two_moves(1.0, 1.0)
    rows[:, 2] += by
    found = judged(tmp_path, TWO_MOVES, rows, NAMES, profile="ros-jtc")
    assert [each.joint for each in found.findings if each.rule == "jtc-first-point"] == (["j2"] if by else [])
    assert not any("where the arm stands" in note for note in found.notes)


@pytest.mark.parametrize("interpolate", ["linear", "cubic", "quintic", "jtc-upsampling"])
def test_blocks_of_rows_are_judged_as_all_rows_at_once(
    interpolate: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where moves are told by the times of the first row and of the last one."""
    rows, names = two_moves(1.2, -1.08), NAMES
    rows[70, 3] += 0.3
    if (
        interpolate == "jtc-upsampling"
    ):  # a spline through positions, each piece of which depends on all of them
        rows, names = rows[:, :3], "t,q1,q2"

    def said() -> list[tuple[object, ...]]:
        found = judged(tmp_path, TWO_MOVES, rows, names, interpolate=interpolate).findings
        return sorted((each.kind, each.joint, each.move, each.row, each.value) for each in found)

    whole = said()
    assert ("j2", 1) in [each[1:3] for each in whole]
    monkeypatch.setattr(file_module, "JUDGED_ROWS", 7)
    plain = MotionFile.blocks
    monkeypatch.setattr(MotionFile, "blocks", lambda self, count=7: plain(self, count))
    assert said() == whole


def test_a_job_in_the_place_of_rows_is_named_before_anything_is_missed(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(TWO_MOVES)
    with pytest.raises(InputError) as caught:
        check_file(str(tmp_path / "job.yaml"), CheckOptions())
    assert "judged by" not in str(caught.value)
    assert "job" in caught.value.problems[0].text()


def test_a_column_of_moves_counts_and_not_their_times(tmp_path: Path) -> None:
    """Rows of the first second are said to be of the second move, which has 2 rad/s."""
    rows, names = two_moves(1.2, 1.0), f"{NAMES},move"
    assert not [each for each in judged(tmp_path, TWO_MOVES, rows, NAMES).findings if each.kind == "velocity"]
    rows = np.hstack([rows, np.ones((201, 1))])
    found = [each for each in judged(tmp_path, TWO_MOVES, rows, names).findings if each.kind == "velocity"]
    assert [(each.joint, each.limit) for each in found] == [("j1", 2.0)]


def test_what_a_profile_cannot_judge_is_said(tmp_path: Path) -> None:
    found = beside_arm(tmp_path, "t,q1,qd1\n0,0,0\n1,0,0\n", profile="ros-jtc")
    assert any("jtc-first-point is not judged" in note for note in found.notes)
    assert not beside_arm(tmp_path, "t,q1,qd1\n0,0,0\n1,0,0\n").notes


@pytest.mark.parametrize("option", ["job", "robot"])
def test_columns_without_units_have_those_that_the_job_or_the_robot_states(
    option: str, tmp_path: Path
) -> None:
    """Half a degree below the limit, and above it: in radians both would be far beyond; a note says what was taken."""
    robot = "{joints: [{type: revolute, position: [-60, 60]}]}"
    text = f"""\
version: 1
units: {{angle: deg}}
robot: {robot}
limits: {{velocity: 1000, acceleration: 100000, jerk: null}}
start: {{joints: [30]}}
moves: [{{planner: quintic, to: {{joints: [40]}}, duration: 1}}]
"""
    if option == "robot":
        text = "units: {angle: deg}\njoints: [{type: revolute, position: [-60, 60]}]\n"
    (tmp_path / "said.yaml").write_text(text)
    for top in (59.5, 60.5):
        degrees = 30 + (top - 30) * np.sin(np.linspace(0, np.pi / 2, 61))
        lines = [f"{0.05 * k:.2f},{value:.6f}" for k, value in enumerate(degrees)]
        (tmp_path / "rows.csv").write_text("\n".join(["time,joint1", *lines]) + "\n")
        asked = CheckOptions(**{option: str(tmp_path / "said.yaml")})
        judgement = check_file(str(tmp_path / "rows.csv"), asked).judgement
        found = [each.value for each in judgement.findings if each.kind in ("position", "start")]
        assert found == ([] if top < 60 else [pytest.approx(np.radians(top), abs=1e-6)])
        assert any("deg" in note for note in judgement.notes)


def test_a_spline_through_all_rows_is_one_whatever_is_read_at_a_time(tmp_path, monkeypatch) -> None:
    """It is at rest at both ends alone: where a block of rows ends it keeps its velocity of 1 rad/s."""
    monkeypatch.setattr(file_module, "JUDGED_ROWS", 100)
    t = 0.01 * np.arange(601)
    ramp = np.minimum(np.minimum(t, 6.0 - t), 0.5)
    way = ramp / 2 - np.sin(2 * np.pi * ramp) / (4 * np.pi)  # of a velocity of sin^2(pi t)
    q = np.where(t < 3, way + np.clip(t - 0.5, 0, None), 5.5 - way - np.clip(5.5 - t, 0, None))
    job = ONE_MOVE.replace("PLANNER", "quintic").replace("END", "0.5").replace("ACCELERATION", "20")
    for limit, over in ((1.001, False), (0.999, True)):
        said = job.replace("velocity: 9", f"velocity: {limit}")
        rows = np.stack([t, q, np.full_like(t, 0.5)], axis=1)
        findings = judged(tmp_path, said, rows, "t,q1,q2", interpolate="jtc-upsampling").findings
        assert [each.kind for each in findings if each.kind in ("velocity", "acceleration")] == [
            "velocity"
        ] * over
