"""Where rows begin and end: planted offsets of any joint, in either direction, on both sides of each line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_rows import bare_robot, part, rows_of
from recorded_rows import judged as judged_by

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import load_job
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Payload, ToolLimits, unlimited
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job
from trajcli.streams.recorded_motion import RecordedMotion, Resolution
from trajcli.trajectory import State

TOLERANCE, OFF = np.array([1e-3, 2e-3, 3e-3]), np.array([1e-6, 2e-6, 3e-6])
START, END = np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.5, -0.6])
T = np.array([0.0, 0.7, 1.9, 2.4])


def motion(off: np.ndarray = OFF) -> RecordedMotion:
    """Return rows that rest at the start and then at the end, with roundings of their columns by joint."""
    q, qd = np.stack([START, START, END, END]), np.zeros((4, 3))
    return RecordedMotion(T, q, qd, None, None, None, None, None, Resolution(0.0, off, off, off), "rows")


def judged(rows: RecordedMotion, *, end: bool = True, blocks: int = 10) -> Judgement:
    """Return the judgement of rows that shall begin in START, and end in END where that is said."""
    states = [State(each, np.zeros(3), np.zeros(3)) for each in (START, END)]
    required = Requirements(
        bare_robot(unlimited(3)),
        start=states[0] if end else None,
        start_tolerance=TOLERANCE if end else None,
        end=states[1] if end else None,
    )
    parts = [part(rows, slice(low, low + blocks)) for low in range(0, len(rows.t), blocks)]
    return judge_motion(lambda: parts, required)


def states_of(rows: RecordedMotion, *, end: bool = True) -> list[Finding]:
    return [found for found in judged(rows, end=end).findings if found.rule == "state"]


def moved(rows: RecordedMotion, name: str, row: int, joint: int, by: float) -> RecordedMotion:
    values = getattr(rows, name).copy()
    values[row, joint] += by
    return replace(rows, **{name: values})


def test_a_motion_from_start_to_end_is_as_it_shall_be() -> None:
    assert states_of(motion()) == []


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize(("row", "kind"), [(0, "start"), (-1, "end")])
@pytest.mark.parametrize(
    ("roundings", "certainty"), [(-0.5, None), (0.5, "within rounding"), (1.5, "exceeded"), (2.9, "exceeded")]
)
def test_a_position_beyond_its_tolerance(roundings, certainty, row, kind, joint, sign) -> None:
    by = sign * (TOLERANCE[joint] + roundings * OFF[joint])
    found = states_of(moved(motion(), "q", row, joint, by))
    if certainty is None:
        assert found == []
        return
    (one,) = found
    assert (one.kind, one.joint, one.quantity) == (kind, f"j{joint + 1}", "position")
    assert (one.severity, one.certainty, one.row) == ("error", certainty, range(1, 5)[row])
    assert one.value - one.limit == pytest.approx(by, rel=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize(("row", "kind"), [(0, "start"), (-1, "end")])
@pytest.mark.parametrize("end", [True, False])
@pytest.mark.parametrize("share", [0.9, 1.1, 100.0])
def test_a_velocity_that_rounding_does_not_explain(share, end, row, kind, joint, sign) -> None:
    """Beside its rounding six decimals of rest are allowed. Nobody asked for rest at the end: a warning."""
    by = sign * share * (OFF[joint] + 1e-6)
    found = states_of(moved(motion(), "qd", row, joint, by), end=end)
    if share < 1 or (kind == "start" and not end):
        assert found == []
        return
    (one,) = found
    assert (one.kind, one.joint, one.quantity, one.value) == (kind, f"j{joint + 1}", "velocity", by)
    assert (one.severity, one.certainty) == ("error" if end else "warning", "exceeded")


def test_messages_of_ends_name_joint_number_unit_and_time() -> None:
    """A slide among turning joints: m, m/s and m/s^2, within its own tolerance."""
    robot = bare_robot(unlimited(3))
    robot = replace(robot, joints=(robot.joints[0], Joint("lift", "prismatic"), robot.joints[2]))
    rows = replace(motion(), t=5.0 + T, qdd=np.zeros((4, 3)))
    for row in (0, -1):
        rows = moved(moved(rows, "q", row, 1, 0.01), "qd", row, 1, 0.25)
    rows = moved(rows, "qdd", -1, 1, 0.5)
    states = [State(each, np.zeros(3), np.zeros(3)) for each in (START, END)]
    required = Requirements(robot, start=states[0], start_tolerance=TOLERANCE, end=states[1])
    found = [each for each in judge_motion(lambda: [rows], required).findings if each.rule == "state"]
    for each in found:
        assert each.rounding == pytest.approx(OFF[1] + (each.quantity != "position") * 1e-6, rel=1e-6)
    assert {(each.text(), each.time) for each in found} == {
        ("the first row has lift at -0.19 m at t = 5 s, expected -0.2 m within 0.002 m", 5.0),
        ("the first row has a velocity of lift of 0.25 m/s at t = 5 s, expected 0 m/s", 5.0),
        ("the last row has lift at 0.51 m at t = 7.4 s, expected 0.5 m within 0.002 m", 7.4),
        ("the last row has a velocity of lift of 0.25 m/s at t = 7.4 s, expected 0 m/s", 7.4),
        ("the last row has an acceleration of lift of 0.5 m/s^2 at t = 7.4 s, expected 0 m/s^2", 7.4),
    }
    (turned,) = states_of(moved(motion(), "q", 0, 2, 0.01))
    assert turned.text().endswith("has j3 at 0.31 rad at t = 0 s, expected 0.3 rad within 0.003 rad")


@pytest.mark.parametrize("row", [0, -1])
def test_a_row_that_states_no_velocity_is_at_none_that_is_wrong(row: int) -> None:
    """As controllers take it, whatever other joints have: a row states what all of its joints have."""
    for joints in (slice(0, 3), slice(0, 1)):
        rows = moved(motion(), "qd", row, 1, 0.5)
        rows.qd[row, joints] = np.nan
        states = [State(each, np.zeros(3), np.zeros(3)) for each in (START, END)]
        required = Requirements(
            robot=bare_robot(unlimited(3)),
            start=states[0],
            start_tolerance=TOLERANCE,
            end=states[1],
            interpolate="jtc",
        )
        assert judge_motion(lambda rows=rows: [rows], required).findings == ()


def test_a_wrong_stamp_is_one_of_its_move() -> None:
    rows = replace(motion(), t=np.array([0.0, 0.7, 1.9, 1.8]), move=np.array([0, 0, 1, 1]))
    (found,) = [each for each in judged(rows).findings if each.kind == "time"]
    assert (found.move, found.row) == (1, 4)


@pytest.mark.parametrize("name", ["q", "qd"])
@pytest.mark.parametrize("row", [0, -1])
def test_a_joint_with_rough_numbers_hides_no_other_one(name: str, row: int) -> None:
    """The first joint is off by more, which its rounding explains; the third one by what nothing explains."""
    rows = motion(np.array([1e-1, 1e-6, 1e-6]))
    rows = moved(moved(rows, name, row, 0, 5e-2), name, row, 2, 1e-2)
    (found,) = states_of(rows)
    assert (found.joint, found.severity, found.certainty) == ("j3", "error", "exceeded")


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize(("row", "kind"), [(0, "start"), (-1, "end")])
def test_joints_that_are_where_they_shall_be_hide_no_rough_one(row: int, kind: str, joint: int) -> None:
    """One joint is beyond its tolerance by half of its rounding, which is larger than what the others have left."""
    off = np.where(np.arange(3) == joint, 1e-1, 1e-6)
    (found,) = states_of(moved(motion(off), "q", row, joint, 5e-2))
    assert (found.kind, found.joint, found.certainty) == (kind, f"j{joint + 1}", "within rounding")


@pytest.mark.parametrize(("order", "name"), [(1, "velocity"), (2, "acceleration")])
def test_each_rate_has_the_rounding_of_its_own_columns(order: int, name: str) -> None:
    """Velocities of two decimals and accelerations of four, or the other way round, both off by 1e-3."""
    rows = replace(motion(), qdd=np.zeros((4, 3)))
    for column in ("qd", "qdd"):
        rows = moved(rows, column, -1, 1, 1e-3)
    rough, fine = np.full(3, 5e-3), np.full(3, 5e-5)
    given = (fine, rough) if order == 1 else (rough, fine)
    (found,) = states_of(replace(rows, resolution=Resolution(0.0, OFF, *given)))
    assert (found.kind, found.joint, found.quantity, found.severity) == ("end", "j2", name, "error")
    assert found.rounding == pytest.approx(5e-5 + 1e-6, rel=1e-6)


@pytest.mark.parametrize("blocks", [1, 2, 3, 10])
@pytest.mark.parametrize(
    ("stamps", "wrong"),
    [
        ((0.0, 0.7, 0.7, 2.4), [3]),
        ((0.0, 0.7, 0.6, 2.4), [3]),
        ((0.0, 1.9, 0.7, 0.8), [3, 4]),  # later than the row before, earlier than the latest one
        ((0.0, 0.7, 1.9, 1.9), [4]),
    ],
)
def test_stamps_are_later_than_all_before_them(stamps, wrong, blocks) -> None:
    judgement = judged(replace(motion(), t=np.array(stamps)), blocks=blocks)
    found = [each for each in judgement.findings if each.rule == "time"]
    assert sum(each.count for each in found) == len(wrong)
    assert {each.row for each in found} <= set(wrong)
    assert all((each.severity, each.certainty) == ("error", "exceeded") for each in found)


@pytest.mark.parametrize("stamp", [-1.0, 2.99, 2.98, np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [300, 301, 599])
def test_stamps_are_later_than_those_of_the_block_before(row: int, stamp: float) -> None:
    """Rows 10 ms apart come 300 at a time: stamps of the first of a block, of the second and of the last are wrong."""
    t = 0.01 * np.arange(600)
    t[row] = stamp
    off = np.zeros(3)
    rows = RecordedMotion(
        t,
        np.tile(START, (600, 1)),
        None,
        None,
        None,
        None,
        None,
        None,
        Resolution(0.0, off, off, off),
        "rows",
    )
    (found,) = [each for each in judged(rows, end=False, blocks=300).findings if each.rule == "time"]
    assert (found.row, found.count, found.severity, found.certainty) == (row + 1, 1, "error", "exceeded")
    stamps = (stamp, stamp, t[row - 1]) if np.isfinite(stamp) else (None, None, None)
    assert (found.value, found.time, found.limit) == stamps


@pytest.mark.parametrize("blocks", [100, 256, 300])
@pytest.mark.parametrize("late", [2, 7])
def test_a_clock_that_stands_at_first_hides_nothing_behind_it(late: int, blocks: int) -> None:
    """256 rows with one stamp, of which the first one counts, then one that goes 5 rad/s between two of twenty."""
    t = np.append(np.zeros(256), 0.01 * np.arange(1, 21))
    q = np.where(np.arange(276) < 256 + late, 0.0, 0.05)[:, None]
    exact = np.zeros(1)
    rows = RecordedMotion(
        t, q, None, None, None, None, None, None, Resolution(0.0, exact, exact, exact), "rows"
    )
    robot = bare_robot(replace(unlimited(1), velocity=np.array([[-1.0, 1.0]])))
    parts = [part(rows, slice(low, low + blocks)) for low in range(0, 276, blocks)]
    found = {each.kind: each for each in judge_motion(lambda: parts, Requirements(robot)).findings}
    assert (found["time"].count, found["velocity"].count) == (255, 1)
    assert found["velocity"].value == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["q", "qd"])
@pytest.mark.parametrize("row", [0, -1])
def test_rounding_by_a_share_of_each_number_explains_what_it_may(row: int, name: str) -> None:
    """Of numbers of single precision 2^-24 of 0.5 explains a position, and of 20 a velocity."""
    relative, joint = 2.0**-24, 1
    states = [State(each, np.full(3, 20.0), np.zeros(3)) for each in (START, END)]
    given = replace(motion(np.zeros(3)), qd=np.full((4, 3), 20.0))
    shares = tuple(relative * (each == name) for each in ("q", "qd", "qdd"))  # its own alone
    single = replace(given, resolution=replace(given.resolution, relative=shares))
    required = Requirements(
        bare_robot(unlimited(3)),
        start=states[0],
        start_tolerance=TOLERANCE,
        end=states[1],
        interpolate="linear",
    )
    size = 20.0 if name == "qd" else abs((START, END)[row][joint]) + TOLERANCE[joint]
    line = 1e-6 if name == "qd" else TOLERANCE[joint]
    for share in (0.5, 1.5):
        by = np.sign(getattr(given, name)[row, joint]) * (line + share * relative * size)
        for rows, explained in ((single, share < 1), (given, False)):
            blocks = [moved(rows, name, row, joint, by)]
            findings = judge_motion(blocks.copy, required).findings
            found = [each.certainty for each in findings if each.rule == "state"]
            silent = explained and name == "qd"
            assert found == ([] if silent else ["within rounding" if explained else "exceeded"])


@pytest.mark.parametrize("wanted", [0.0, -2.0, np.nan])
@pytest.mark.parametrize("over", [0.0, 1e-3, -1e-3])
@pytest.mark.parametrize("joint", range(3))
def test_the_last_row_has_the_acceleration_of_the_end(joint: int, over: float, wanted: float) -> None:
    """What the planned motion ends with; where it steps in the end, nobody says how rows brake."""
    end = np.where(np.arange(3) == joint, wanted, 0.0)
    qdd = np.zeros((4, 3))
    qdd[-1] = np.nan_to_num(end)
    qdd[-1, joint] += over
    state = State(END, np.zeros(3), end)
    required = Requirements(bare_robot(unlimited(3)), end=state, start_tolerance=TOLERANCE)
    found = judge_motion(lambda: [replace(motion(), qdd=qdd)], required).findings
    found = [each for each in found if each.rule == "state"]
    assert bool(found) == (bool(over) and np.isfinite(wanted))
    for each in found:
        assert (each.kind, each.quantity, each.joint, each.severity) == (
            "end",
            "acceleration",
            f"j{joint + 1}",
            "error",
        )
        assert each.value - each.limit == pytest.approx(over, rel=1e-6)
        assert "an acceleration of" in each.message


@pytest.mark.parametrize("joint", range(3))
def test_a_joint_that_steps_in_the_end_hides_no_other_one(joint: int) -> None:
    """What nobody says of one joint is said of the two others, the second of which is off."""
    stepping, other = np.arange(3) == joint, (joint + 1) % 3
    state = State(END, np.zeros(3), np.where(stepping, np.nan, 0.0))
    qdd = np.zeros((4, 3))
    qdd[-1, joint], qdd[-1, other] = 7.0, -0.5
    required = Requirements(bare_robot(unlimited(3)), end=state, start_tolerance=TOLERANCE)
    findings = judge_motion(lambda: [replace(motion(), qdd=qdd)], required).findings
    (found,) = [each for each in findings if each.rule == "state"]
    assert (found.joint, found.value, found.limit, found.count) == (f"j{other + 1}", -0.5, 0.0, 1)


@pytest.mark.parametrize(("planner", "judged"), [("quintic", True), ("cubic", False)])
def test_an_acceleration_that_steps_in_the_end_is_not_promised(
    planner: str, judged: bool, tmp_path: Path
) -> None:
    job, file = tmp_path / "job.yaml", tmp_path / "rows.csv"
    job.write_text(
        "{version: 1, robot: {joints: 1}, limits: {velocity: 9, acceleration: 50, jerk: null}, start: {joints: [0]}, "
        f"moves: [{{planner: {planner}, to: {{joints: [1]}}, duration: 1}}], output: {{rate: 100}}}}"
    )
    write_plan(plan_job(load_job(str(job))), str(file), "full")
    head, *lines = file.read_text().splitlines()
    values = [float(text) for text in lines[-1].split(",")]
    file.write_text(
        "\n".join([head, *lines[:-1], ",".join(map(repr, [*values[:-1], values[-1] - 0.5]))]) + "\n"
    )
    found = check_file(str(file), CheckOptions(job=str(job))).judgement
    assert any(each.kind == "end" and each.quantity == "acceleration" for each in found.findings) is judged


@pytest.mark.parametrize("blocks", [3, 400])
def test_a_row_dropped_with_its_stamps_kept_is_a_warning(blocks: int) -> None:
    t = np.arange(401) * 0.01
    kept = np.delete(np.arange(401), [77, 200, 201])
    q = np.repeat(np.sin(t)[kept, None], 3, axis=1)
    nothing = Resolution(0.0, np.zeros(3), np.zeros(3), np.zeros(3))
    rows = RecordedMotion(t[kept], q, None, None, None, None, None, None, nothing, "rows")
    (found,) = (each for each in judged(rows, end=False, blocks=blocks).findings if each.kind == "time")
    assert (found.severity, found.count, found.row) == ("warning", 2, 200)
    assert (found.value, found.limit) == pytest.approx((0.03, 0.01))
    sparse = np.unique(np.concatenate([np.arange(0, 401, 4), np.arange(0, 401, 10)]))  # of no one period
    rows = replace(rows, t=t[sparse], q=np.repeat(np.sin(t)[sparse, None], 3, axis=1))
    assert not [each for each in judged(rows, end=False).findings if each.kind == "time"]


def test_a_single_row_is_a_motion_of_no_duration() -> None:
    one = part(motion(), slice(0, 1))
    robot = bare_robot(unlimited(3))
    assert judge_motion(lambda: [one], Requirements(robot)).verdict == "satisfied"
    low = replace(robot.limits, position=np.array([[-1.0, 1.0], [-0.1, 1.0], [-1.0, 1.0]]))
    (found,) = judge_motion(lambda: [one], Requirements(replace(robot, limits=low))).findings
    assert (found.kind, found.joint, found.value, found.limit) == ("position", "j2", -0.2, -0.1)


@pytest.mark.parametrize("blocks", [100, 300, 1000])
def test_start_and_holes_of_a_long_file_are_where_they_are(blocks: int) -> None:
    """600 rows, one of which is missing; the first one is beside the start, and no other."""
    q = np.tile(START, (600, 1))
    q[0, 1] += 0.01
    kept = np.arange(600) != 450
    off = np.zeros(3)
    t = 0.01 * np.arange(600)
    rows = RecordedMotion(
        t[kept], q[kept], None, None, None, None, None, None, Resolution(1e-9, off, off, off), "rows"
    )
    states = [State(each, np.zeros(3), np.zeros(3)) for each in (START, START)]
    robot = bare_robot(unlimited(3))
    required = Requirements(robot, start=states[0], start_tolerance=TOLERANCE, end=states[1])
    parts = [part(rows, slice(low, low + blocks)) for low in range(0, 599, blocks)]
    findings = judge_motion(lambda: parts, required).findings
    (beside,) = [each for each in findings if each.rule == "state"]
    assert (beside.kind, beside.row, beside.time, beside.joint) == ("start", 1, 0.0, "j2")
    (hole,) = [each for each in findings if each.rule == "time"]
    assert (hole.row, hole.severity) == (451, "warning")
    assert hole.time == pytest.approx(4.51)


@pytest.mark.parametrize("name", ["q", "qd", "qdd"])
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_number_that_is_none_is_refused_with_its_row(wrong: float, name: str) -> None:
    rows = replace(motion(), qdd=np.zeros((4, 3)))
    values = getattr(rows, name).copy()
    values[2, 1] = wrong
    if name == "q":
        with pytest.raises(InputError, match="row 3"):
            judged(replace(rows, **{name: values}))
    else:  # a column with a hole is none
        assert judged(replace(rows, **{name: values})).interpolation in ("linear", "cubic")


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "jerk", "effort"])
@pytest.mark.parametrize("first", [True, False])
def test_between_two_moves_the_looser_limits_of_both_are_in_force(first: bool, name: str) -> None:
    wide, narrow = (
        replace(unlimited(2), **{name: np.array([[-a, b], [-b, a]])}) for a, b in ((2, 3), (1, 1))
    )
    mixed = replace(unlimited(2), **{name: np.array([[-1.0, 3.0], [-3.0, 1.0]])})
    robots = [bare_robot(each) for each in (wide, narrow)]
    by_move = dict(enumerate(robots if first else robots[::-1]))
    between = Requirements(robots[0], by_move=by_move).robot_between(0, 1).limits
    assert getattr(between, name).tolist() == [[-2, 3], [-3, 2]]
    by_move[0] = bare_robot(mixed)
    between = Requirements(robots[0], by_move=by_move).robot_between(0, 1).limits
    other = getattr(narrow if first else wide, name)
    both = np.array([[-1.0, 3.0], [-3.0, 1.0]])
    assert (
        getattr(between, name).tolist()
        == np.stack(
            [np.minimum(both[:, 0], other[:, 0]), np.maximum(both[:, 1], other[:, 1])], axis=1
        ).tolist()
    )


def test_between_two_moves_the_tool_has_the_looser_limits() -> None:
    limits = [replace(unlimited(2), tcp=ToolLimits(speed=a, jerk=b)) for a, b in ((0.1, 5.0), (0.2, 4.0))]
    by_move = dict(enumerate(map(bare_robot, limits)))
    tcp = Requirements(by_move[0], by_move=by_move).robot_between(0, 1).limits.tcp
    assert (tcp.speed, tcp.jerk, tcp.acceleration) == (0.2, 5.0, np.inf)


@pytest.mark.parametrize("first", [True, False])
def test_between_two_moves_the_looser_limits_by_position_are_in_force(first: bool) -> None:
    """Half as fast is a quarter of the deceleration and half of the offset; without a limit all is allowed."""
    position, none = np.tile([-9.0, 9.0], (3, 1)), [np.inf, 0.0]
    rows = [[20.0, 0.1], [5.0, 0.05], none], [[5.0, 0.05], [20.0, 0.1], [5.0, 0.05]]
    limits = [replace(unlimited(3), position=position, velocity_by_position=np.array(each)) for each in rows]
    by_move = dict(enumerate(map(bare_robot, limits if first else limits[::-1])))
    between = Requirements(by_move[0], by_move=by_move).robot_between(0, 1).limits
    assert between.velocity_by_position.tolist() == [[20.0, 0.1], [20.0, 0.1], none]


@pytest.mark.parametrize("row", [0, 3])
@pytest.mark.parametrize(("name", "by"), [("q", 0.01), ("qd", -0.1)])
def test_all_joints_that_are_elsewhere_are_counted(name: str, by: float, row: int) -> None:
    both = moved(moved(motion(), name, row, 0, by), name, row, 2, -2 * by)
    (found,) = states_of(both)
    assert (found.joint, found.count) == ("j3", 2)


@pytest.mark.parametrize("same", [(0, 0), (0, 1), (1, 0)])
def test_a_tool_carries_one_thing_where_neither_it_nor_its_load_changes(same: tuple[int, int]) -> None:
    loads = [Payload(1.0, np.zeros(3), np.eye(3)) for _ in range(2)]
    first = replace(bare_robot(unlimited(2)), payload=loads[0], tool_load=loads[0])
    second = replace(first, payload=loads[same[0]], tool_load=loads[same[1]])
    assert Requirements(first, by_move={1: second}).carries_one(0, 1) == (same == (0, 0))


@pytest.mark.parametrize("order", [1, -1])
def test_of_two_moves_that_begin_to_brake_alike_the_one_nearer_to_its_end_is_looser(order: int) -> None:
    pairs = [np.array([[2.0, offset]]) for offset in (0.3, 0.1)][::order]
    position = np.array([[-9.0, 9.0]])
    limits = [replace(unlimited(1), position=position, velocity_by_position=pair) for pair in pairs]
    robots = list(map(bare_robot, limits))
    between = Requirements(robots[0], by_move={1: robots[1]}).robot_between(0, 1)
    np.testing.assert_array_equal(between.limits.velocity_by_position, [[2.0, 0.1]])


def waving(joints: int = 2) -> RecordedMotion:
    """Return 601 rows at 100 Hz of sin t and its derivatives, of which each joint is a little later."""
    t = 0.01 * np.arange(601)
    x = t[:, None] + 0.1 * np.arange(joints)
    off = np.full(joints, 1e-12)
    states = np.sin(x), np.cos(x), -np.sin(x)
    return RecordedMotion(t, *states, None, None, None, None, Resolution(0.0, off, off, off), "rows")


@pytest.mark.parametrize("name", ["q", "qd", "qdd"])
def test_a_number_that_is_none_is_refused_wherever_it_stands(name: str) -> None:
    rows = waving()
    getattr(rows, name)[500, 1] = np.nan
    with pytest.raises(InputError, match="row 501 has nan for joint 2"):
        judged_by(rows, unlimited(2), blocks=300)


@pytest.mark.parametrize("planned", [False, True])
def test_a_row_that_is_missing_is_told_but_of_a_plan(planned: bool) -> None:
    whole = waving()
    kept = np.arange(601) != 300
    rows = replace(whole, **{name: getattr(whole, name)[kept] for name in ("t", "q", "qd", "qdd")})
    found = [each for each in judged_by(rows, unlimited(2), planned=planned).findings if each.rule == "time"]
    assert [(each.row, each.severity) for each in found] == ([] if planned else [(301, "warning")])


def test_wrong_velocities_of_one_joint_hide_no_wrong_accelerations_of_another() -> None:
    rows = waving(3)
    rows.qd[:, 0] *= 1.5
    rows.qdd[:, 2] *= 1.5
    found = {
        (each.joint, each.quantity)
        for each in judged_by(rows, unlimited(3)).findings
        if each.kind == "derivative"
    }
    assert found == {("j1", "velocity"), ("j3", "acceleration")}


def test_wrong_velocities_in_one_move_hide_no_wrong_accelerations_in_another() -> None:
    rows = replace(waving(1), move=np.repeat([0, 1], [300, 301]))
    rows.qd[:300] *= 1.5
    rows.qdd[300:] *= 1.5
    found = [each for each in judged_by(rows, unlimited(1)).findings if each.kind == "derivative"]
    assert ("velocity", 0) in {(each.quantity, each.move) for each in found}
    assert ("acceleration", 1) in {(each.quantity, each.move) for each in found}


@pytest.mark.parametrize("blocks", [20, 256, 257])
def test_what_changes_of_the_jerk_explain_is_the_same_in_blocks(blocks: int) -> None:
    """300 of them between 901 dense rows: on both sides of a piece two others tell of one, beside a block's end too."""
    rng = np.random.default_rng(1)
    breaks = np.concatenate([[0.0], np.sort(rng.uniform(0.0, 9.0, 300)), [9.0]])
    rows, state = np.zeros((4, 301, 1)), np.zeros(3)
    for k, (length, jerk) in enumerate(zip(np.diff(breaks), rng.choice([-1.0, 1.0], 301), strict=True)):
        rows[:, k, 0] = [jerk / 6, state[2] / 2, state[1], state[0]]
        state = np.array([np.polyval(np.polyder(rows[:, k, 0], order), length) for order in range(3)])
    curve = PiecewisePolynomial(breaks, rows)
    limits = replace(unlimited(1), acceleration=0.9 * np.abs(curve.piece_ends(2)).max() * np.array([[-1, 1]]))
    whole = judged_by(rows_of(curve, 0.01, 2), limits)
    assert whole.findings[0].count > 10
    assert judged_by(rows_of(curve, 0.01, 2), limits, blocks=blocks).findings == whole.findings
