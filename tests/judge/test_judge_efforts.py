"""Torques of recorded motions: what is over a limit, where, with which payload, and what rounding explains."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import load_job
from trajcli.judge.file import CheckOptions, check_file
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job

ARM = """
name: arm
convention: standard
units: {angle: deg, length: mm}
joints:
  - {name: a, a: 500, effort: LIMIT, link: {mass: 4, com: [-250, 0, 0], inertia: [0.01, 0.1, 0.1, 0, 0, 0]}}
  - {name: b, a: 400, link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}}
base: {rpy: [90, 0, 0]}
"""
JOB = """
version: 1
units: {angle: deg, length: mm}
robot: {file: arm.yaml}
limits: {effort: null}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [90, 20]}, duration: 1}
  - {attach: {mass: 3}}
  - {planner: quintic, to: {joints: [0, 90]}, duration: 1}
output: {rate: 250, columns: [t, q, qd, qdd, move]}
"""


@pytest.fixture
def rows(tmp_path: Path) -> Path:
    """Write the arm, the job, and the rows of its motion; return the folder."""
    (tmp_path / "arm.yaml").write_text(ARM.replace("LIMIT", "1000"))
    (tmp_path / "job.yaml").write_text(JOB)
    plan = plan_job(load_job(tmp_path / "job.yaml"))
    write_plan(plan, str(tmp_path / "rows.csv"), "full")
    return tmp_path


def efforts(folder: Path, limit: float, **options: str) -> list[Finding]:
    """Return the findings of efforts with a limit of the first joint."""
    (folder / "arm.yaml").write_text(ARM.replace("LIMIT", str(limit)))
    options = options or {"robot": str(folder / "arm.yaml")}
    judgement = check_file(str(folder / "rows.csv"), CheckOptions(**options)).judgement
    return [found for found in judgement.findings if found.kind == "effort"]


def peak_of(folder: Path, move: int, carried: float) -> tuple[float, float]:
    """Return the largest torque of joint a in a move and its time, by Lagrange, on dense points of the plan."""
    plan = plan_job(load_job(folder / "job.yaml"))
    span = plan.trajectory.spans[move]
    t = np.linspace(span.start, span.end, 20001)[1:-1]
    q, qd, qdd = (plan.trajectory(t, order) for order in range(3))
    m, first = 2 + carried, (2 * 0.2 + carried * 0.4) / (2 + carried)
    inertia = 0.05 + 2 * (0.2 - first) ** 2 + carried * (0.4 - first) ** 2
    cosine, sine = np.cos(q[:, 1]), np.sin(q[:, 1])
    m12 = inertia + m * (first**2 + 0.5 * first * cosine)
    m11 = 0.1 + 4 * 0.25**2 + m12 + m * (0.25 + 0.5 * first * cosine)
    h = -m * 0.5 * first * sine
    gravity = 9.81 * ((4 * 0.25 + m * 0.5) * np.cos(q[:, 0]) + m * first * np.cos(q.sum(axis=1)))
    tau = m11 * qdd[:, 0] + m12 * qdd[:, 1] + h * (2 * qd[:, 0] * qd[:, 1] + qd[:, 1] ** 2) + gravity
    return float(tau.max()), float(t[tau.argmax()])


def test_a_torque_over_its_limit_is_found_with_its_place(rows: Path) -> None:
    most, time = peak_of(rows, 0, 0.0)
    (found,) = [found for found in efforts(rows, 0.9 * most) if found.move == 0]
    assert (found.joint, found.severity, found.certainty, found.method) == (
        "a",
        "error",
        "exceeded",
        "bounded",
    )
    assert found.value == pytest.approx(most, rel=1e-5)
    assert found.limit == pytest.approx(0.9 * most)
    assert found.time == pytest.approx(time, abs=2e-3)
    assert found.factor is not None
    assert found.factor > 1
    assert "needs a torque of" in found.text()
    assert not [found for found in efforts(rows, 1.0001 * most) if found.move == 0]


def test_a_payload_counts(rows: Path) -> None:
    most, _ = peak_of(rows, 0, 2.0)
    arm = str(rows / "arm.yaml")
    heavy = {"robot": arm, "payload": "{mass: 2}"}
    assert [found.move for found in efforts(rows, 0.999 * most, **heavy)][:1] == [0]
    assert not [found for found in efforts(rows, 1.001 * most, **heavy) if found.move == 0]
    assert not [found for found in efforts(rows, 0.999 * most) if found.move == 0]


def test_limits_that_are_given_beside_a_payload_are_in_force(rows: Path) -> None:
    """Tighter ones than the maker's, and his where none are given."""
    most, _ = peak_of(rows, 0, 2.0)
    (rows / "limits.yaml").write_text(f"effort: {{a: {0.5 * most!r}}}\n")
    heavy = {"robot": str(rows / "arm.yaml"), "payload": "{mass: 2}"}
    (found,) = (
        each for each in efforts(rows, 2 * most, **heavy, limits=str(rows / "limits.yaml")) if each.move == 0
    )
    assert found.limit == pytest.approx(0.5 * most)
    assert not [each for each in efforts(rows, 2 * most, **heavy) if each.move == 0]


def test_a_job_says_what_each_move_carries(rows: Path) -> None:
    most = peak_of(rows, 2, 3.0)[0]
    assert most > peak_of(rows, 2, 0.0)[0] * 1.2
    for factor, expected in ((0.999, [2]), (1.001, [])):
        job = JOB.replace("effort: null", f"effort: {{a: {factor * most!r}}}")
        (rows / "job.yaml").write_text(job)
        found = efforts(rows, 1000, job=str(rows / "job.yaml"))
        assert [one.move for one in found] == expected


def test_a_planted_peak_between_two_rows_is_found(rows: Path) -> None:
    """A ten-thousandth over the limit, where no row stands."""
    most, time = peak_of(rows, 0, 0.0)
    lines = (rows / "rows.csv").read_text().splitlines()
    stamps = np.array([float(line.split(",")[0]) for line in lines[1:]])
    coarse = [lines[0], *[line for line, t in zip(lines[1:], stamps, strict=True) if abs(t - time) > 0.02]]
    (rows / "rows.csv").write_text("\n".join(coarse) + "\n")
    options = {"robot": str(rows / "arm.yaml"), "interpolate": "quintic"}
    over = [found for found in efforts(rows, most * (1 - 1e-4), **options) if found.move == 0]
    assert [found.joint for found in over] == ["a"]
    assert not [found for found in efforts(rows, most * (1 + 1e-4), **options) if found.move == 0]


def test_lines_between_rows_have_no_acceleration_to_judge(rows: Path) -> None:
    assert not efforts(rows, 1, robot=str(rows / "arm.yaml"), interpolate="linear")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"job": "job.yaml", "payload": "{mass: 1}"}, "--job and --payload exclude each other"),
        ({"robot": "planar2r", "payload": "{mass: 1}"}, "states no efforts"),
        ({"robot": "arm.yaml", "payload": "{mass: -1}"}, "at least 0 kg"),
    ],
)
def test_one_clear_error(rows: Path, options: dict[str, str], message: str) -> None:
    placed = {key: str(rows / value) if value.endswith(".yaml") else value for key, value in options.items()}
    with pytest.raises(InputError, match=message):
        check_file(str(rows / "rows.csv"), CheckOptions(**placed))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("last", [0.0, -3e-14, -1e-9])
def test_friction_at_rest_is_that_of_the_motion_before(last: float, side: int, tmp_path: Path) -> None:
    """1 kg in 0.5 m, I = 0.33 kg m^2, brakes with 10 rad/s^2 and 1 N m of friction: 2.3 of 2.5 N m, and 3.3 without.

    Where the braking begins, between two rows, quintics take more than 2.5 N m: that is a warning.
    """
    (tmp_path / "arm.yaml").write_text(
        "name: arm\nconvention: standard\njoints:\n  - {a: 1, effort: 2.5, friction: {coulomb: 1}, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    t = np.append(np.arange(38) * 0.004, 0.15)
    braked = np.maximum(t - 0.05, 0.0)
    rows = np.column_stack([t, t - 5 * braked**2, 1 - 10 * braked, np.where(braked > 0, -10.0, 0.0)])
    rows[-1, 2] = last
    rows[:, 1:] *= side
    np.savetxt(tmp_path / "rows.csv", rows, "%.16e", ",", header="t,q1,qd1,qdd1", comments="")
    found = check_file(str(tmp_path / "rows.csv"), CheckOptions(robot=str(tmp_path / "arm.yaml"))).judgement
    (effort,) = (each for each in found.findings if each.kind == "effort")
    assert (effort.severity, effort.certainty, found.verdict) == ("warning", "exceeded", "satisfied")
    assert -3.3 * 1.6 + 1 < side * effort.value < -2.5
    assert effort.time < 0.06


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("deceleration", "verdict"), [(5.0, "exceeded"), (4.0, "satisfied")])
def test_a_joint_that_turns_slowly_has_the_friction_of_its_way_back(
    deceleration: float, verdict: str, side: int, tmp_path: Path
) -> None:
    """I = 0.33 kg m^2 with 1 N m of friction: back, at 0.4 rad/s at most, it takes 1.65 + 1 or 1.32 + 1 of 2.5 N m."""
    (tmp_path / "arm.yaml").write_text(
        "name: arm\nconvention: standard\njoints:\n  - {a: 1, effort: 2.5, friction: {coulomb: 1}, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    t = np.array([0.0, 1.0 / deceleration])  # from 0.6 to -0.4 rad/s
    rows = np.column_stack(
        [t, 0.6 * t - 0.5 * deceleration * t**2, 0.6 - deceleration * t, [-deceleration] * 2]
    )
    rows[:, 1:] *= side
    np.savetxt(tmp_path / "rows.csv", rows, "%.16e", ",", header="t,q1,qd1,qdd1", comments="")
    found = check_file(str(tmp_path / "rows.csv"), CheckOptions(robot=str(tmp_path / "arm.yaml"))).judgement
    efforts = [each for each in found.findings if each.kind == "effort"]
    assert found.verdict == verdict
    assert [side * each.value for each in efforts] == pytest.approx([-2.65] if efforts else [], rel=1e-5)


def swing(
    folder: Path, t: np.ndarray, largest: float, columns: int, decimals: int, side: int
) -> tuple[str, list[Finding]]:
    """Return verdict and efforts of I = 0.33 kg m^2 that swings at 1 Hz, of which 2.5 N m are allowed on one side."""
    allowed = [-1e4, 2.5] if side > 0 else [-2.5, 1e4]
    (folder / "arm.yaml").write_text(
        f"name: arm\nconvention: standard\njoints:\n  - {{a: 1, effort: {allowed}, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    w = 2 * np.pi
    states = [-np.sin(w * t) / w**2, -np.cos(w * t) / w, np.sin(w * t)]
    rows = np.column_stack([t, *(largest * values for values in states)])[:, : columns + 1]
    names = ["t", "q1", "qd1", "qdd1"][: columns + 1]
    numbers = ["%.6f", *[f"%.{decimals}f"] * columns]
    np.savetxt(folder / "rows.csv", rows, numbers, ",", header=",".join(names), comments="")
    options = CheckOptions(robot=str(folder / "arm.yaml"))
    judged = check_file(str(folder / "rows.csv"), options).judgement
    return judged.verdict, [each for each in judged.findings if each.kind == "effort"]


@pytest.mark.parametrize("decimals", [4, 6])
@pytest.mark.parametrize("columns", [2, 3])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("late", "over"), [(1e-4, True), (-1e-4, True), (1e-4, False)])
def test_a_short_interval_hides_no_torque_elsewhere_and_is_none_itself(
    late: float, side: int, columns: int, decimals: int, tmp_path: Path, *, over: bool
) -> None:
    """Of decimals 0.1 ms make hundreds of N m; 0.33 times 9 rad/s^2 are over 2.5, and certainly so between other rows."""
    t = np.sort(np.append(np.arange(21) * 0.05, 0.5 + late))
    verdict, found = swing(tmp_path, t, 9.0 if over else 6.0, columns, decimals, side)
    assert verdict == ("exceeded" if over else "satisfied")
    assert {each.certainty for each in found} <= {"exceeded" if over else "within rounding"}
    for each in found if over else ():
        assert each.value == pytest.approx(side * 0.33 * 9.0, rel=0.03)
        assert each.factor == pytest.approx((0.33 * 9.0 / 2.5) ** 0.5, rel=0.02)
        assert each.time == pytest.approx(0.5 - 0.25 * side, abs=0.03)


@pytest.mark.parametrize("decimals", [4, 6])
@pytest.mark.parametrize("columns", [2, 3])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("largest", "over"), [(7.8, True), (7.4, False)])
def test_what_dense_rows_state_is_over_a_limit_whatever_their_decimals_make_of_the_curve(
    largest: float, side: int, columns: int, decimals: int, tmp_path: Path, *, over: bool
) -> None:
    """0.33 times 7.6 rad/s^2 are 2.5 N m; the curve through four decimals has 200 N m."""
    verdict, found = swing(tmp_path, np.arange(251) * 4e-3, largest, columns, decimals, side)
    assert verdict == ("exceeded" if over else "satisfied")
    certain = [each for each in found if (each.certainty, each.severity) == ("exceeded", "error")]
    assert len(certain) == over
    assert all((each.certainty == "exceeded") == (abs(each.value) - 2.5 > each.rounding) for each in found)
    for each in certain:
        assert each.value == pytest.approx(side * 0.33 * largest, rel=0.02 if decimals == 4 else 0.05)
        assert each.factor == pytest.approx((abs(each.value) / 2.5) ** 0.5, rel=1e-5)
        assert each.row == round(each.time / 4e-3 - 0.01) + 1
        assert each.time == pytest.approx(0.5 - 0.25 * side, abs=0.03)
        assert each.method == ("sampled" if decimals == 4 else each.method)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("largest", "over"), [(7.8, True), (7.4, False)])
@pytest.mark.parametrize("decimals", [3, 6])
def test_a_torque_between_sparse_rows_is_hidden_by_no_short_interval(
    decimals: int, largest: float, side: int, tmp_path: Path, *, over: bool
) -> None:
    """At the rows beside 0.25 and 0.75 s there is a twentieth less than between them; 7.6 rad/s^2 are allowed.

    Three decimals make a quarter of a newton metre of the curve, so that nothing is certain.
    """
    t = np.sort(np.append(np.arange(11) * 0.1, 0.5001))
    verdict, found = swing(tmp_path, t, largest, 3, decimals, side)
    assert (verdict == "exceeded") == (over and decimals == 6)
    for each in found if verdict == "exceeded" else ():
        assert (each.severity, each.certainty, each.method) == ("error", "exceeded", "bounded")
        assert each.value == pytest.approx(side * 0.33 * largest, rel=1e-3)
        assert each.time == pytest.approx(0.5 - 0.25 * side, abs=1e-3)


@pytest.mark.parametrize("asked", [True, False])
@pytest.mark.parametrize("side", [1, -1])
def test_a_torque_of_the_curve_through_dense_rows_is_an_error_where_somebody_asked_for_it(
    side: int, tmp_path: Path, *, asked: bool
) -> None:
    """A step of acceleration between two rows, of which the quintic makes 1.12 times as much; beside a short interval."""
    t = np.sort(np.append(np.arange(51) * 4e-3, 0.1601))
    since = np.maximum(t - 0.1212, 0.0)
    rows = np.column_stack([t, 0.5 * since**2, since, since > 0])
    rows[:, 1:] *= side
    (tmp_path / "arm.yaml").write_text(
        "name: arm\nconvention: standard\njoints:\n  - {a: 1, effort: 0.3465, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    np.savetxt(tmp_path / "rows.csv", rows, "%.8f", ",", header="t,q1,qd1,qdd1", comments="")
    options = CheckOptions(robot=str(tmp_path / "arm.yaml"), interpolate="quintic" if asked else None)
    judged = check_file(str(tmp_path / "rows.csv"), options).judgement
    assert judged.verdict == ("exceeded" if asked else "satisfied")
    (told,) = (each for each in judged.findings if each.kind == "effort")
    assert (told.severity == "error") == asked
    assert not asked or told.value == pytest.approx(side * 0.33 * 1.12, rel=5e-3)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("columns", "joined"), [(1, "jtc-upsampling"), (3, "jtc-upsampling"), (3, "jtc")])
@pytest.mark.parametrize(("share", "over"), [(0.9, True), (1.1, False)])
def test_torques_of_controllers_that_join_rows_in_their_own_ways(
    share: float, columns: int, joined: str, side: int, tmp_path: Path, *, over: bool
) -> None:
    """A swing from rest to rest, 9 rad/s^2 at its ends; of a spline through positions rows state no torque."""
    (tmp_path / "arm.yaml").write_text(
        f"name: arm\nconvention: standard\njoints:\n  - {{a: 1, effort: {share * 0.33 * 9.0}, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    t, w = np.arange(101) * 0.01, 2 * np.pi
    states = [(1 - np.cos(w * t)) / w**2, np.sin(w * t) / w, np.cos(w * t)]
    rows = np.column_stack([t, *(side * 9.0 * values for values in states)])[:, : columns + 1]
    header = "t,q1,qd1,qdd1"[: 4 + 4 * (columns > 1) + 5 * (columns > 2)]
    np.savetxt(tmp_path / "rows.csv", rows, "%.9f", ",", header=header, comments="")
    options = CheckOptions(robot=str(tmp_path / "arm.yaml"), interpolate=joined)
    judged = check_file(str(tmp_path / "rows.csv"), options).judgement
    assert judged.verdict == ("exceeded" if over else "satisfied")
    for each in judged.findings:
        assert (each.kind, abs(each.value)) == ("effort", pytest.approx(0.33 * 9.0, rel=0.02))


@pytest.mark.parametrize("side", [1, -1])
def test_a_joint_that_rounding_alone_turns_at_rest_has_not_gone_back(side: int, tmp_path: Path) -> None:
    """It brakes with 10 rad/s^2 and 1 N m of friction: 2.3 of 2.5 N m; a last velocity of a unit is none."""
    (tmp_path / "arm.yaml").write_text(
        "name: arm\nconvention: standard\njoints:\n  - {a: 1, effort: 2.5, friction: {coulomb: 1}, "
        "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}}\n"
    )
    t = np.arange(26) * 0.004
    rows = np.column_stack([t, t - 5 * t**2, 1 - 10 * t, np.full(26, -10.0)])
    rows[-1, 2] = -1e-4
    rows[:, 1:] *= side
    np.savetxt(tmp_path / "rows.csv", rows, "%.4f", ",", header="t,q1,qd1,qdd1", comments="")
    found = check_file(str(tmp_path / "rows.csv"), CheckOptions(robot=str(tmp_path / "arm.yaml"))).judgement
    assert not [each for each in found.errors if each.kind == "effort"]
