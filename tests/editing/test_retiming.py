"""Retiming: the factor of the closed form, nothing less verifies, and derivatives scale by its powers."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import sqrt
from pathlib import Path

import numpy as np
import pytest
from motions_on_disk import JOB, planned, quintic, table

from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.operations import cut
from trajcli.editing.requirements import kept_limits
from trajcli.editing.retiming import Stretch, retime
from trajcli.editing.writing import as_read, write_motion
from trajcli.errors import InputError, VerificationError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.motion import Requirements
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.robot import Robot
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job
from trajcli.streams.decimals import Digits
from trajcli.streams.recorded_motion import open_motion

PEAKS = (15 / 8, 10 / 3**0.5, 60.0)
"""Of the quintic over distance 1 in 1 s: velocity, acceleration, jerk."""


def rows_of(path: Path, distance: float = 1.0, duration: float = 1.0, rate: float = 100.0) -> Path:
    """Write a quintic of one joint with all its bits."""
    t = np.arange(round(duration * rate) + 1) / rate
    columns = (t, *quintic(t, distance, duration))
    lines = (",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True))
    path.write_text("t,q1,qd1,qdd1,qddd1\n" + "\n".join(lines) + "\n")
    return path


def robot(path: Path, limits: str) -> Path:
    path.write_text(f"joints: [{{{limits}}}]\n")
    return path


def retimed(source: Path, arm: Path, *, fastest: bool = False) -> tuple[EditedMotion, Stretch]:
    requirements, motion = (
        kept_limits(None, str(arm)).requirements,
        read_motion(str(source), ReadingOptions()),
    )
    found, (stretch,) = retime(
        motion, requirements, fastest=fastest, as_read=partial(as_read, path="out.csv")
    )
    return found, stretch


def verdict(path: Path, arm: Path) -> str:
    return check_file(str(path), CheckOptions(robot=str(arm))).judgement.verdict


def test_knots_far_apart_are_made_faster_up_to_their_limits(tmp_path: Path) -> None:
    """Between rests a cubic over distance 1 in T reaches 6 / T^2; whoever goes too fast does not jump."""
    source, arm = tmp_path / "knots.csv", robot(tmp_path / "arm.yaml", "velocity: 9, acceleration: 8")
    source.write_text("t,q1,qd1\n0.0,0.0,0.0\n1.0,1.0,0.0\n2.0,0.0,0.0\n")
    _, stretch = retimed(source, arm, fastest=True)
    assert stretch.factor == pytest.approx(0.75**0.5, rel=2e-4)
    assert stretch.binding is not None
    assert stretch.binding.kind == "acceleration"


@pytest.mark.parametrize(
    ("reached", "hint"), [(2.0, "another time of the motion does not help"), (200.0, "degrees?")]
)
def test_what_no_time_mends_is_said_at_the_time_of_the_file(
    reached: float, hint: str, tmp_path: Path
) -> None:
    source, arm = tmp_path / "late.csv", robot(tmp_path / "arm.yaml", "position: [-1, 1]")
    source.write_text(f"t,q1\n110.0,0.0\n111.0,{reached}\n112.0,0.0\n")
    with pytest.raises(VerificationError, match="at t = 111 s") as refused:
        retimed(source, arm)
    (problem,) = refused.value.problems
    assert (problem.joint, problem.time, problem.kind) == ("j1", 111.0, "position")
    assert hint in str(problem.hint)


@pytest.mark.parametrize("fastest", [False, True])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_closed_form_for_each_order(order: int, fastest: bool, tmp_path: Path) -> None:
    """A peak that uses its limit c times asks for the factor c^(1 / order)."""
    name = ("velocity", "acceleration", "jerk")[order - 1]
    share = 0.4 if fastest else 2.5
    arm = robot(tmp_path / "arm.yaml", f"{name}: {PEAKS[order - 1] / share!r}")
    found, stretch = retimed(rows_of(tmp_path / "rows.csv"), arm, fastest=fastest)
    expected = share ** (1 / order)
    assert stretch.factor == pytest.approx(expected, rel=2e-4)
    assert stretch.binding is not None
    assert (stretch.binding.kind, stretch.binding.joint) == (name, "j1")
    assert found.rows.t[-1] == pytest.approx(stretch.factor, abs=1e-9)
    rows = quintic(np.arange(101) / 100, 1.0, 1.0)
    for power, key in enumerate(("q", "qd", "qdd", "qddd")):
        values = getattr(found.rows, key)[:, 0]
        np.testing.assert_allclose(values, rows[power] / stretch.factor**power, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_a_thousandth_less_does_not_verify(name: str, tmp_path: Path) -> None:
    order = ("velocity", "acceleration", "jerk").index(name) + 1
    arm = robot(tmp_path / "arm.yaml", f"{name}: {PEAKS[order - 1] / 3!r}")
    source = rows_of(tmp_path / "rows.csv")
    assert verdict(source, arm) == "exceeded"
    found, stretch = retimed(source, arm)
    write_motion(found, str(tmp_path / "out.csv"))
    assert verdict(tmp_path / "out.csv", arm) != "exceeded"
    less = 0.999 * stretch.factor
    short = rows_of(tmp_path / "short.csv", 1.0, less, 100 / less)
    assert verdict(short, arm) == "exceeded"


def test_twice_as_long_is_what_a_plan_of_twice_the_time_is(tmp_path: Path) -> None:
    """The peer is the planner: 30 deg in 1 s peak at 56.25 deg/s, in 2 s at half of that."""
    job = JOB.replace("  - {planner: septic, to: {joints: [-10, 5]}, duration: 2}\n", "")
    source = planned(tmp_path / "rows.csv", job)
    arm = tmp_path / "arm.yaml"
    arm.write_text("units: {angle: deg}\njoints: [{name: base, velocity: 28.125}, {name: arm}]\n")
    found, stretch = retimed(source, arm)
    assert stretch.factor == pytest.approx(2, rel=1e-8)
    write_motion(found, str(tmp_path / "out.csv"))
    slow = planned(tmp_path / "slow.csv", job.replace("duration: 1}", "duration: 2}").replace("100", "50"))
    assert table(tmp_path / "out.csv")[0] == table(slow)[0]
    np.testing.assert_allclose(table(tmp_path / "out.csv")[1], table(slow)[1], atol=2e-6)


def test_a_velocity_by_position_is_a_bound_of_the_velocity(tmp_path: Path) -> None:
    """A quintic from 0 to 1 under |v| <= sqrt(2 d (1.1 - q)) - o: the largest quotient over time."""
    d, o = 0.5, 0.1
    arm = robot(
        tmp_path / "arm.yaml",
        f"position: [-1, 1.1], velocity_by_position: {{deceleration: {d}, offset: {o}}}",
    )
    t = np.linspace(0, 1, 200001)
    q, qd, *_ = quintic(t, 1.0, 1.0)
    expected = float((qd / (np.sqrt(2 * d * (1.1 - q)) - o)).max())
    found, stretch = retimed(rows_of(tmp_path / "rows.csv"), arm)
    assert stretch.factor == pytest.approx(expected, rel=3e-4)
    assert stretch.binding is not None
    assert stretch.binding.kind == "velocity_by_position"
    write_motion(found, str(tmp_path / "out.csv"))
    assert verdict(tmp_path / "out.csv", arm) != "exceeded"


def test_a_motion_within_its_limits_keeps_its_time(tmp_path: Path) -> None:
    source = rows_of(tmp_path / "rows.csv")
    found, stretch = retimed(source, robot(tmp_path / "arm.yaml", "velocity: 2"))
    assert stretch == Stretch(1.0, None, None) or (stretch.factor, stretch.binding) == (1.0, None)
    write_motion(found, str(tmp_path / "out.csv"))
    np.testing.assert_array_equal(table(tmp_path / "out.csv")[1], table(source)[1])


def test_fastest_never_slows_down_what_keeps_its_limits(tmp_path: Path) -> None:
    source = rows_of(tmp_path / "rows.csv")
    _, stretch = retimed(source, robot(tmp_path / "arm.yaml", f"velocity: {PEAKS[0]!r}"), fastest=True)
    assert 0.9998 <= stretch.factor <= 1


@pytest.mark.parametrize(
    ("limits", "message"),
    [("", "no limit bounds how fast"), ("acceleration: null, position: [-2, 2]", "no limit bounds how fast")],
)
def test_without_limits_nothing_is_the_fastest(limits: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        retimed(rows_of(tmp_path / "rows.csv"), robot(tmp_path / "arm.yaml", limits), fastest=True)


@pytest.mark.parametrize("fastest", [False, True])
def test_what_no_time_mends_is_refused(fastest: bool, tmp_path: Path) -> None:
    source = rows_of(tmp_path / "rows.csv")
    with pytest.raises(VerificationError, match="the position of j1 reaches 1"):
        retimed(source, robot(tmp_path / "arm.yaml", "position: [0, 0.9], velocity: 1"), fastest=fastest)
    text = source.read_text().splitlines()
    text[50] = text[50].replace(text[50].split(",")[1], "0.9")
    source.write_text("\n".join(text) + "\n")
    with pytest.raises(VerificationError, match=r"at t = 0\.(48|49)"):
        retimed(source, robot(tmp_path / "arm.yaml", "velocity: 1"), fastest=fastest)


def of_moves(tmp_path: Path, *, fastest: bool, limits: str = "") -> tuple[Array, tuple[Stretch, ...]]:
    """Retime each move of the two of the job; the first peaks at 56.25, the second at 43.75 deg/s."""
    source = planned(tmp_path / "rows.csv")
    job = tmp_path / "job.yaml"
    job.write_text(JOB.replace("start:", f"limits: {{velocity: {{base: 30}}}}{limits}\nstart:"))
    job.write_text(
        job.read_text().replace("duration: 1}", "duration: 10}").replace("duration: 2}", "duration: 10}")
    )
    kept = kept_limits(str(job), None)
    motion = read_motion(
        str(source), ReadingOptions(), joints=kept.robot.joint_names, joint_types=kept.robot.joint_types
    )
    found, stretches = retime(motion, kept.requirements, fastest=fastest, per_move=True)
    write_motion(found, str(tmp_path / "out.csv"))
    return table(tmp_path / "out.csv")[1], stretches


def test_what_joins_rows_where_the_law_changes_makes_no_factor_larger(tmp_path: Path) -> None:
    """A trapezoid there and back at 20 of 90 deg/s^2; what joins its rows passes 20 by a factor of 1.37."""
    job = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 1000, acceleration: 90}]}
start: {joints: [0]}
moves:
  - {planner: trapezoid, to: {joints: [50]}, velocity: 20, acceleration: 20}
  - {planner: trapezoid, to: {joints: [0]}, velocity: 20, acceleration: 20}
output: {rate: 100, columns: [t, q, qd, qdd, move]}
"""
    (tmp_path / "job.yaml").write_text(job)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    motion = read_motion(str(planned(tmp_path / "rows.csv", job)), ReadingOptions())
    _, stretches = retime(motion, kept.requirements, fastest=True, per_move=True)
    assert [stretch.factor for stretch in stretches] == pytest.approx([sqrt(20 / 90)] * 2, rel=2e-4)


@pytest.mark.parametrize(("rate", "factor"), [(30, sqrt(1.37394)), (100, 1.0)])
def test_rows_of_a_plan_that_stand_far_apart_are_stretched(
    rate: float, factor: float, tmp_path: Path
) -> None:
    """The factor of `docs/check.md`, by which the quintics between rows every 1/30 s pass the acceleration."""
    job = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 60, acceleration: 120}]}
start: {joints: [0]}
moves: [{planner: trapezoid, to: {joints: [50]}}]
output: {rate: %g}
"""
    (tmp_path / "job.yaml").write_text(job % rate)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    motion = read_motion(str(planned(tmp_path / "rows.csv", job % rate)), ReadingOptions())
    _, (stretch,) = retime(motion, kept.requirements)
    assert stretch.factor == pytest.approx(factor, rel=1e-4)


@pytest.mark.parametrize("fastest", [False, True])
def test_each_move_by_its_own_factor(fastest: bool, tmp_path: Path) -> None:
    rows, stretches = of_moves(tmp_path, fastest=fastest)
    assert [stretch.moves for stretch in stretches] == [(0,), (1,)]
    factors = [stretch.factor for stretch in stretches]
    assert factors == pytest.approx([56.25 / 30, 40 * 35 / 16 / 2 / 30], rel=2e-4)
    assert rows[100, 0] == pytest.approx(factors[0], abs=1e-8)
    assert rows[-1, 0] == pytest.approx(factors[0] + 2 * factors[1], abs=1e-8)
    before = table(tmp_path / "rows.csv")[1]
    np.testing.assert_allclose(rows[:100, 3:5], before[:100, 3:5] / factors[0], atol=1e-7)
    np.testing.assert_allclose(rows[100:, 3:5], before[100:, 3:5] / factors[1], atol=1e-7)
    np.testing.assert_array_equal(rows[:, -1], before[:, -1])


@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_a_hold_keeps_its_time_between_moves_that_become_faster(digits: Digits, tmp_path: Path) -> None:
    """A quintic over 50 deg in T reaches 15/8 50/T deg/s: within 60 it takes 1.5625 s."""
    job = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 60}]}
start: {joints: [0]}
moves:
  - {planner: quintic, to: {joints: [50]}, duration: 3}
  - {planner: hold, duration: 0.4}
  - {planner: quintic, to: {joints: [0]}, duration: 4}
output: {rate: 50, columns: [t, q, qd, qdd, move]}
"""
    (tmp_path / "job.yaml").write_text(job)
    write_plan(plan_job(job_from_text(job)), str(tmp_path / "rows.csv"), digits=digits)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    motion = read_motion(str(tmp_path / "rows.csv"), ReadingOptions())
    found, stretches = retime(motion, kept.requirements, fastest=True, per_move=True)
    assert [stretch.factor for stretch in stretches] == pytest.approx([1.5625 / 3, 1, 1.5625 / 4], rel=2e-4)
    held = found.rows.t[found.rows.move == 1]
    assert held[-1] - held[0] == pytest.approx(0.4 - 1 / 50)


@pytest.mark.parametrize("velocity", ["[20, 0]", "[-20, 0]", "[0, -20]", "[0, 1]"])
def test_moves_that_meet_in_motion_share_a_factor(velocity: str, tmp_path: Path) -> None:
    """Whichever joint moves, and whatever way."""
    job = JOB.replace("joints: [30, -20]}", f"joints: [30, -20], velocity: {velocity}}}")
    source = planned(tmp_path / "rows.csv", job)
    arm = tmp_path / "arm.yaml"
    arm.write_text("units: {angle: deg}\njoints: [{name: base, velocity: 20}, {name: arm}]\n")
    found, stretches = retime(
        read_motion(str(source), ReadingOptions()), kept_limits(None, str(arm)).requirements, per_move=True
    )
    assert [stretch.moves for stretch in stretches] == [(0, 1)]
    assert found.rows.t[-1] == pytest.approx(3 * stretches[0].factor, abs=1e-8)


def test_a_file_without_moves_has_none_to_retime(tmp_path: Path) -> None:
    kept = kept_limits(None, str(robot(tmp_path / "arm.yaml", "velocity: 1")))
    motion = read_motion(str(rows_of(tmp_path / "rows.csv")), ReadingOptions())
    with pytest.raises(InputError, match="no column `move`"):
        retime(motion, kept.requirements, per_move=True)


@pytest.mark.full
def test_rows_with_nine_decimals_verify_as_they_are_written(tmp_path: Path) -> None:
    """Numbers that are rounded twice must not disagree: by 37 factors, faster and slower."""
    job = JOB.replace("qddd, move", "move").replace("rate: 100", "rate: 1000")
    source = planned(tmp_path / "rows.csv", job)
    arm = tmp_path / "arm.yaml"
    for velocity in np.geomspace(15, 200, 8):
        arm.write_text(
            f"units: {{angle: deg}}\njoints: [{{name: base, velocity: {velocity}}}, {{name: arm}}]\n"
        )
        found, stretch = retimed(source, arm, fastest=True)
        assert stretch.factor == pytest.approx(56.25 / velocity, rel=2e-4)
        write_motion(found, str(tmp_path / "out.csv"))
        assert verdict(tmp_path / "out.csv", arm) != "exceeded"


LIMITED = JOB.replace("duration: 1}", "duration: 1, limits: {velocity: {base: 30}}}")
"""Its first move peaks at 56.25 deg/s, the second one at 43.75 deg/s."""


@pytest.mark.parametrize("ending", ["csv", "mcap"])
def test_rows_without_moves_have_the_limits_of_the_moves_at_their_times(ending: str, tmp_path: Path) -> None:
    """As for `trajcli check`; rows that last longer or shorter are of a move that nobody knows."""
    (tmp_path / "job.yaml").write_text(LIMITED)
    rows = planned(tmp_path / f"rows.{ending}", JOB.replace(", move", ""))
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    motion = read_motion(
        str(rows), ReadingOptions(), joints=kept.robot.joint_names, joint_types=kept.robot.joint_types
    )
    _, (stretch,) = retime(kept.with_moves(motion), kept.requirements)
    assert stretch.factor == pytest.approx(56.25 / 30, rel=2e-4)
    found, stretches = retime(kept.with_moves(motion), kept.requirements, per_move=True)
    assert [each.moves for each in stretches] == [(0,), (1,)]
    write_motion(found, str(tmp_path / "out.csv"))
    assert "move" not in table(tmp_path / "out.csv")[0]
    assert found.rows.t[-1] == pytest.approx(56.25 / 30 + 2, rel=2e-4)
    with pytest.raises(InputError, match="has no column `move` and does not last as long as the plan"):
        retime(kept.with_moves(cut(motion, 0.0, 2.0)), kept.requirements)


def test_rows_that_say_no_move_have_the_limits_that_all_moves_have(tmp_path: Path) -> None:
    job = LIMITED.replace("duration: 2}", "duration: 2, limits: {velocity: {base: 30}}}")
    (tmp_path / "job.yaml").write_text(job)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    rows = planned(tmp_path / "rows.csv", JOB.replace(", move", ""))
    motion = read_motion(
        str(rows), ReadingOptions(), joints=kept.robot.joint_names, joint_types=kept.robot.joint_types
    )
    part = kept.with_moves(cut(motion, 0.0, 2.0))
    assert part.rows.move is None
    _, (stretch,) = retime(part, kept.requirements)
    assert stretch.factor == pytest.approx(56.25 / 30, rel=2e-4)


LIFT = """\
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 800, effort: robot}
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: quintic, to: {joints: [20, -60, 60, 0, 90, 0]}, duration: 1}
  - {attach: {mass: 8, com: [0, 0, 0.08]}}
  - {planner: quintic, to: {joints: [-20, 0, 0, 0, 90, 0]}, duration: 1}
output: {rate: 100, columns: [t, q, qd, qdd, tau, move]}
"""


@pytest.mark.full
def test_rows_without_moves_carry_what_the_moves_at_their_times_do(tmp_path: Path) -> None:
    """The peer are the same rows with their moves; and as often as the load differs, it must be known."""
    (tmp_path / "job.yaml").write_text(LIFT)
    kept = kept_limits(str(tmp_path / "job.yaml"), None)
    factors = []
    for columns in (", move", ""):
        free = LIFT.replace(", effort: robot", "").replace(", tau, move", columns)
        rows = planned(tmp_path / "rows.csv", free)
        motion = read_motion(str(rows), ReadingOptions(), joints=kept.robot.joint_names)
        factors.append(retime(kept.with_moves(motion), kept.requirements)[1][0].factor)
    assert factors[0] > 1.5
    assert factors[0] == factors[1]
    with pytest.raises(InputError, match="whose moves differ in limits, tool or load"):
        retime(kept.with_moves(cut(motion, 1.2, 2.0)), kept.requirements)


UR_GOAL = Path(__file__).parents[1] / "oracles/recorded/ur_goal.yaml"


@pytest.mark.parametrize("ending", ["csv", "yaml", "mcap"])
def test_the_goal_of_an_ur_that_is_within_its_limit_at_its_points_only(ending: str, tmp_path: Path) -> None:
    """Universal_Robots_ROS2_Driver, issue 1273: 6.87 rad/s^2 between points that state 5 at most."""
    names = open_motion(UR_GOAL).joints
    assert names is not None
    arm = tmp_path / "arm.yaml"
    arm.write_text("joints:\n" + "".join(f"  - {{name: {name}, acceleration: 5}}\n" for name in names))
    path = str(tmp_path / f"out.{ending}")
    kept = kept_limits(None, str(arm))
    found, (stretch,) = retime(
        read_motion(str(UR_GOAL), ReadingOptions()), kept.requirements, as_read=partial(as_read, path=path)
    )
    assert stretch.factor == pytest.approx((6.87031 / 5) ** 0.5, rel=1e-4)
    assert stretch.binding is not None
    assert (stretch.binding.kind, stretch.binding.joint) == ("acceleration", "elbow_joint")
    write_motion(found, path)
    assert verdict(Path(path), arm) != "exceeded"


@pytest.mark.parametrize("names", [(None, None), ("a.yaml", "ur5e")])
def test_limits_are_of_a_job_or_of_a_robot(names: tuple[str | None, str | None]) -> None:
    with pytest.raises(InputError, match=r"limits|exclude"):
        kept_limits(*names)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_faster_motion_takes_nothing_of_its_rounding(sign: int, tmp_path: Path) -> None:
    """Velocities of three decimals: the largest that is written is at its limit, in either direction."""
    t = np.arange(101) / 100
    q, qd, *_ = quintic(t, float(sign), 1.0)
    lines = (f"{a:.2f},{b:.15f},{c:.3f}\n" for a, b, c in zip(t, q, qd, strict=True))
    source = tmp_path / "rows.csv"
    source.write_text("t,q1,qd1\n" + "".join(lines))
    bounds = "[-2.5, 9]" if sign < 0 else "[-9, 2.5]"
    _, stretch = retimed(source, robot(tmp_path / "arm.yaml", f"velocity: {bounds}"), fastest=True)
    assert 1 - 1e-6 <= stretch.factor / (1.875 / 2.5) < 1 + 2e-4


@pytest.mark.parametrize("begin", [-5.0, 0.0, 1.7e9])
def test_a_factor_does_not_depend_on_when_a_motion_begins(begin: float, tmp_path: Path) -> None:
    """Stamps of a clock have few digits left, and the motion is as fast as before; it begins when it did."""
    arm = robot(tmp_path / "arm.yaml", "velocity: 2.5, acceleration: 8, jerk: 100")
    motion = read_motion(str(rows_of(tmp_path / "rows.csv")), ReadingOptions())
    later = replace(motion, rows=replace(motion.rows, t=motion.rows.t + begin))
    found, (stretch,) = retime(later, kept_limits(None, str(arm)).requirements, fastest=True)
    assert stretch.factor == pytest.approx(max(1.875 / 2.5, (PEAKS[1] / 8) ** 0.5, 0.6 ** (1 / 3)), rel=2e-4)
    assert found.rows.t[0] == begin
    assert found.rows.t[-1] - begin == pytest.approx(stretch.factor, abs=1e-6)


@pytest.mark.parametrize("limits", ["velocity: 1, acceleration: 2", "effort: 3"])
def test_what_stands_still_has_no_fastest_time(limits: str, tmp_path: Path) -> None:
    source = tmp_path / "rows.csv"
    source.write_text("t,q1\n0,1\n1,1\n2,1\n")
    with pytest.raises(InputError, match="no limit bounds how fast"):
        retimed(source, robot(tmp_path / "arm.yaml", limits), fastest=True)


def test_a_move_of_one_joint_travels_and_noise_of_the_last_decimal_does_not(tmp_path: Path) -> None:
    """The first and the third of three moves are of one joint; in the second a last digit comes and goes."""
    names = ("a", "b")
    arm = tmp_path / "arm.yaml"
    arm.write_text(f"joints: [{{name: {names[0]}, velocity: 10}}, {{name: {names[1]}, velocity: 10}}]\n")
    source = tmp_path / "rows.csv"
    points = [(0, 0, 0), (1, 0, 0), (1, 0.001, 1), (1, 0, 1), (1, 0, 2), (1, 2, 2)]
    source.write_text(
        "t,a,b,move\n" + "".join(f"{k},{a:.3f},{b:.3f},{m}\n" for k, (a, b, m) in enumerate(points))
    )
    motion = read_motion(str(source), ReadingOptions(units="rad"), joints=names)
    _, stretches = retime(motion, kept_limits(None, str(arm)).requirements, fastest=True, per_move=True)
    assert [stretch.moves for stretch in stretches] == [(0,), (1,), (2,)]
    assert [stretch.factor for stretch in stretches] == pytest.approx([0.1, 1, 0.2], rel=1e-2)


STILL = """\
version: 1
robot: fr3
start: {joints: [0, -0.8, 0, -2.3, 0, 1.6, 0.8]}
moves: [{planner: quintic, to: {joints: [0.1, -0.8, 0, -2.3, 0, 1.6, 0.8]}, duration: 2}]
output: {rate: 50, columns: [t, q, qd, qdd]}
"""


def other_arm(arm: Robot, what: str) -> Robot:
    """Return an arm with twice a limit of the first joint, another limit of the tool, or another tool."""
    if what == "tool":
        return replace(arm, tool=arm.tool + np.eye(4)[3] * 0.1)
    if what == "tcp":
        return replace(arm, limits=replace(arm.limits, tcp=replace(arm.limits.tcp, speed=0.3)))
    changed = getattr(arm.limits, what).copy()
    changed[0] *= 2
    return replace(arm, limits=replace(arm.limits, **{what: changed}))


@pytest.mark.parametrize("what", ["velocity", "jerk", "velocity_by_position", "effort", "tcp", "tool"])
def test_moves_that_differ_in_anything_that_counts_are_to_be_named(what: str, tmp_path: Path) -> None:
    """Rows that name no move have the limits of all, where these are the same; a tool counts with its limits."""
    plain = load_robot("fr3")
    limits = plain.limits
    arm = replace(
        plain,
        limits=replace(limits, effort=np.full((7, 2), [-90.0, 90.0]), jerk=np.full((7, 2), [-9e3, 9e3])),
    )
    motion = read_motion(str(planned(tmp_path / "rows.csv", STILL)), ReadingOptions())
    same = Requirements(arm, {0: arm, 1: replace(arm)})
    _, (stretch,) = retime(motion, same)
    assert stretch.factor == 1.0
    with pytest.raises(InputError, match="whose moves differ in limits, tool or load"):
        retime(motion, Requirements(arm, {0: arm, 1: other_arm(arm, what)}))


def test_a_tool_counts_for_its_own_limits_without_efforts(tmp_path: Path) -> None:
    arm = load_robot("fr3")
    motion = read_motion(str(planned(tmp_path / "rows.csv", STILL)), ReadingOptions())
    moves = {0: arm, 1: other_arm(arm, "tool")}
    assert retime(motion, Requirements(arm, moves))[1][0].factor == 1.0
    with pytest.raises(InputError, match="whose moves differ in limits, tool or load"):
        retime(motion, Requirements(arm, moves, tool=lambda: ToolJudge(arm)))


def coarse(path: Path, columns: str = "t,q1,qd1", decimals: int = 3) -> Path:
    """Write a quintic over distance 1 in 1 s whose velocities have few decimals, and maybe efforts of 1 N m."""
    t = np.arange(101) / 100
    q, qd, *_ = quintic(t, 1.0, 1.0)
    behind = ",1.0" if "tau" in columns else ""
    lines = (f"{a:.2f},{b:.5f},{c:.{decimals}f}{behind}\n" for a, b, c in zip(t, q, qd, strict=True))
    path.write_text(f"{columns}\n" + "".join(lines))
    return path


def test_what_is_over_by_its_rounding_alone_keeps_its_time(tmp_path: Path) -> None:
    """The largest velocity that is written is 1.875, which may be 1.8746: neither faster nor slower is asked for."""
    arm = robot(tmp_path / "arm.yaml", "velocity: 1.8748")
    source = coarse(tmp_path / "rows.csv")
    assert verdict(source, arm) == "within rounding"
    for fastest in (False, True):
        assert retimed(source, arm, fastest=fastest)[1].factor == 1.0


def test_a_border_that_rests_as_far_as_decimals_tell_divides_moves(tmp_path: Path) -> None:
    source, arm = tmp_path / "rows.csv", robot(tmp_path / "arm.yaml", "velocity: 20")
    rows = ["0.0,0.00,0.000,0", "1.0,1.00,0.001,1", "2.0,-1.00,0.000,1"]
    source.write_text("t,q1,qd1,move\n" + "\n".join(rows) + "\n")
    motion, limits = read_motion(str(source), ReadingOptions()), kept_limits(None, str(arm))
    _, stretches = retime(motion, limits.requirements, fastest=True, per_move=True)
    assert [stretch.factor for stretch in stretches] == pytest.approx([1.5 / 20, 3 / 20], rel=1e-2)


def test_what_is_written_of_a_retimed_motion_and_what_is_not(tmp_path: Path) -> None:
    """Derivatives have the decimals of a plan, at least; efforts would be others, which a note says."""
    arm = robot(tmp_path / "arm.yaml", "velocity: 1.5")
    found, _ = retimed(coarse(tmp_path / "rows.csv", "t,q1,qd1,tau1"), arm)
    written = {column.name: column.decimals for column in found.columns}
    assert written == {"t": 9, "q1": 5, "qd1": 9}
    assert any("efforts are left out" in note for note in found.notes)
    finer, _ = retimed(coarse(tmp_path / "fine.csv", decimals=11), arm)
    assert {column.name: column.decimals for column in finer.columns} == {"t": 9, "q1": 5, "qd1": 11}
    assert not any("efforts" in note for note in finer.notes)


def test_stamps_nearer_than_a_millisecond_have_more_decimals(tmp_path: Path) -> None:
    """A hundred rows in 14 ms: nine decimals would change their velocities."""
    arm = robot(tmp_path / "arm.yaml", "velocity: 137")
    found, stretch = retimed(rows_of(tmp_path / "rows.csv"), arm, fastest=True)
    assert stretch.factor == pytest.approx(1.875 / 137, rel=2e-4)
    said = found.as_written().rows.t
    np.testing.assert_allclose(said, np.arange(101) / 100 * stretch.factor, rtol=0, atol=6e-13)
    t = np.append([0.0, 2e-4], np.arange(1, 101) / 100)  # one of them is enough
    rows = zip(t, *quintic(t, 1.0, 1.0)[:2], strict=True)
    (tmp_path / "rows.csv").write_text(
        "t,q1,qd1\n" + "".join(f"{a:.4f},{b:.17g},{c:.17g}\n" for a, b, c in rows)
    )
    slower, _ = retimed(tmp_path / "rows.csv", robot(arm, "velocity: 1.5"))
    assert slower.columns[0].decimals == 12


@pytest.mark.parametrize("velocity", [1e4, 0.01])
def test_a_factor_may_be_far_from_one(velocity: float, tmp_path: Path) -> None:
    """A hundred rows in 0.2 ms, and in three minutes."""
    arm = robot(tmp_path / "arm.yaml", f"velocity: {velocity}")
    found, stretch = retimed(rows_of(tmp_path / "rows.csv"), arm, fastest=True)
    assert stretch.factor == pytest.approx(1.875 / velocity, rel=2e-4)
    assert found.rows.t[-1] == pytest.approx(stretch.factor, rel=1e-6)


@pytest.mark.parametrize("side", [1, -1])
def test_a_weight_that_no_time_makes_lighter_is_named(side: int, tmp_path: Path) -> None:
    """The second joint holds 1 kg half a metre out, 4.9 N m, and 4 are allowed; it moves by a hundredth of a radian."""
    arm, source = tmp_path / "arm.yaml", tmp_path / "rows.csv"
    link = "link: {mass: 1, com: [-0.5, 0, 0], inertia: [0.08, 0.08, 0.08, 0, 0, 0]}"
    arm.write_text(
        "name: arm\nconvention: standard\nbase: {rpy: [90 deg, 0, 0]}\njoints:\n"
        f"  - {{name: base, {link}}}\n  - {{name: arm, a: 1, effort: 4, {link}}}\n"
    )
    first = 0.0 if side > 0 else np.pi
    source.write_text(f"t,q1,q2,qd1,qd2\n0,0,{first},0,0\n1,0,{first + 0.01},0,0\n2,0,{first},0,0\n")
    limits = kept_limits(None, str(arm))
    motion = read_motion(str(source), ReadingOptions(), joints=limits.robot.joint_names)
    with pytest.raises(
        VerificationError, match="no stretch keeps the limits: arm needs a torque of"
    ) as refused:
        retime(motion, limits.requirements)
    (problem,) = refused.value.problems
    assert (problem.joint, problem.kind) == ("arm", "effort")


@pytest.mark.parametrize(
    ("decimals", "velocity", "fewer"), [(5, 200.0, 9), (3, 6.0, 3), (3, 20.0, 2), (3, 200.0, 1), (2, 20.0, 1)]
)
def test_velocities_of_few_decimals_that_become_larger_are_written_with_those_that_are_certain(
    decimals: int, velocity: float, fewer: int, tmp_path: Path
) -> None:
    """Rounded to a half of the last decimal, then made ten times as large: whoever reads them finds no contradiction."""
    t = np.arange(1001) / 1000
    q, qd, *_ = quintic(t, 1.0, 1.0)
    source, arm = tmp_path / "rows.csv", robot(tmp_path / "arm.yaml", f"velocity: {velocity}")
    lines = (f"{a:.4f},{b:.9f},{c:.{decimals}f}\n" for a, b, c in zip(t, q, qd, strict=True))
    source.write_text("t,q1,qd1\n" + "".join(lines))
    found, stretch = retimed(source, arm, fastest=True)
    assert stretch.factor == pytest.approx(1.875 / velocity, rel=0.01)
    lost = max(decimals - fewer, 0)
    assert [column.decimals for column in found.columns] == [12, 9, fewer]
    told = [f"with {lost} decimal{'s' * (lost > 1)} fewer" in note for note in found.notes]
    assert told == [True] * (lost > 0)
    write_motion(found, str(tmp_path / "out.csv"))
    assert verdict(tmp_path / "out.csv", arm) == "satisfied"


def test_whole_numbers_of_radians_per_second_are_exact_to_who_reads_them(tmp_path: Path) -> None:
    """Where no decimal of the velocities is certain there is no file that keeps its word."""
    t = np.arange(501) / 500
    q, qd, *_ = quintic(t, 1.0, 1.0)
    lines = (f"{a:.3f},{b:.9f},{c:.2f}\n" for a, b, c in zip(t, q, qd, strict=True))
    source = tmp_path / "rows.csv"
    source.write_text("t,q1,qd1\n" + "".join(lines))
    with pytest.raises(VerificationError, match="the velocity of j1 says 19 rad/s"):
        retimed(source, robot(tmp_path / "arm.yaml", "velocity: 20"), fastest=True)


@pytest.mark.parametrize("ending", ["mcap", "yaml"])
def test_whole_nanoseconds_make_nothing_faster_than_it_may_be(ending: str, tmp_path: Path) -> None:
    """Lines between six rows: the step in the middle takes 0.2 s of 1, and stamps of messages round what it becomes."""
    t = np.arange(6) / 5
    rows = zip(t, quintic(t, 1.0, 1.0)[0], strict=True)
    source, path = tmp_path / "rows.csv", str(tmp_path / f"out.{ending}")
    source.write_text("t,q1\n" + "".join(f"{a:.1f},{b:.17g}\n" for a, b in rows))
    kept = kept_limits(None, str(robot(tmp_path / "arm.yaml", "velocity: 3.7")))
    motion = read_motion(str(source), ReadingOptions())
    found, (stretch,) = retime(motion, kept.requirements, fastest=True, as_read=partial(as_read, path=path))
    assert stretch.factor == pytest.approx(5 * (0.68256 - 0.31744) / 3.7, rel=1e-5)
    write_motion(found, path)
    assert verdict(Path(path), tmp_path / "arm.yaml") != "exceeded"
