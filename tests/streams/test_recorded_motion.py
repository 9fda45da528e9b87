"""Motions of anybody: every dialect of names, units that are said or asked for, rounding, one clear error."""

from __future__ import annotations

import io
import json
from math import pi
from pathlib import Path

import numpy as np
import pytest
from any_text import CHARACTERS
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.errors import InputError, TrajcliError
from trajcli.streams import recorded_motion
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.recorded_motion import open_motion
from trajcli.streams.row_sources import EXACT, ArrayRows, ColumnExtents, TimedRows, unplaced
from trajcli.units import Units

FILES = Path(__file__).parents[1] / "oracles" / "recorded"


def written(folder, text, name="in.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refused(folder, text, name="in.csv", **options):
    """Return place, message and hint of the one error about a file."""
    with pytest.raises(InputError) as caught:
        open_motion(written(folder, text, name), **options)
    (problem,) = caught.value.problems
    place = "" if problem.place is None else str(problem.place).removeprefix(f"{folder}/")
    return place, problem.message, problem.hint or ""


def table(names, rows, separator=","):
    return names + "\n" + "".join(separator.join(map(str, row)) + "\n" for row in rows)


COUNTED = [[0.5 * k, *(10 * k + j for j in range(1, 25))] for k in range(4)]
"""Rows whose value says where it stands: 10 times the row, and the column."""

DIALECTS = {
    "libfranka": ("time,q1,q2,dq1,dq2,ddq1,ddq2", {"q": (1, 2), "qd": (3, 4), "qdd": (5, 6)}),
    "logger with a pose": ("time,q1,q2,v1,v2,x,y,z,yaw,pitch,roll", {"q": (1, 2), "qd": (3, 4)}),
    "capitals": ("Time,Q1,Q2,Qdot1,Qdot2", {"q": (1, 2), "qd": (3, 4)}),
    "qv and tau": ("time,q1,q2,qv1,qv2,tau1,tau2", {"q": (1, 2), "qd": (3, 4), "tau": (5, 6)}),
    "from zero": ("t[s],q0,q1", {"q": (1, 2)}),
    "out of order": ("t,q2,q1", {"q": (2, 1)}),
    "joints by name": ("time,a_position,b_position,a_velocity,b_velocity", {"q": (1, 2), "qd": (3, 4)}),
    "joints by name, mixed": ("time,a_velocity,a_position,b_velocity,b_position", {"q": (2, 4), "qd": (1, 3)}),
    "quantity first": ("time,position_a,position_b", {"q": (1, 2)}),
    "names alone": ("time,left_joint,right_joint", {"q": (1, 2)}),
    "panda": ("time,panda_joint1,panda_joint2", {"q": (1, 2)}),
    "Mimic": ("Time, Axis 1, Axis 2", {"q": (1, 2)}),
    "Agilebot": (
        "ts,pts_J1,pts_J2,vel_J1,vel_J2,acc_J1,acc_J2,jerk_J1,jerk_J2,do_port",
        {"q": (1, 2), "qd": (3, 4), "qdd": (5, 6), "qddd": (7, 8)},
    ),
    "PlotJuggler": ("__time,/joint_states/a/position,/joint_states/b/position", {"q": (1, 2)}),
    "brackets": ("t,q[0],q[1],dq[0],dq[1]", {"q": (1, 2), "qd": (3, 4)}),
    "number within": ("t,joint_1_pos,joint_2_pos,joint_1_vel,joint_2_vel", {"q": (1, 2), "qd": (3, 4)}),
    "dots": ("t,q1,q2,q_dot1,q_dot2,q1_ddot,q2_ddot", {"q": (1, 2), "qd": (3, 4), "qdd": (5, 6)}),
    "errors beside": ("t,q1,q2,q_error1,q_error2", {"q": (1, 2)}),
    "a comment in front": ("# recorded on a robot\n# time,q1,q2", {"q": (1, 2)}),
}  # fmt: skip


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", ", "])
@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_is_read(dialect, separator, tmp_path):
    names, expected = DIALECTS[dialect]
    if separator == " " and dialect == "Mimic":
        pytest.skip("names with blanks cannot be separated by blanks")
    width = names.splitlines()[-1].count(",") + 1
    rows = [row[:width] for row in COUNTED]
    text = table(names.replace(", ", ",").replace(",", separator), rows, separator)
    motion = open_motion(written(tmp_path, text), units="rad").whole()
    assert motion.t.tolist() == [0.0, 0.5, 1.0, 1.5]
    for quantity in ("q", "qd", "qdd", "qddd", "tau"):
        found = getattr(motion, quantity)
        if quantity in expected:
            assert found.tolist() == [[10.0 * k + j for j in expected[quantity]] for k in range(4)]
        else:
            assert found is None


def test_a_column_of_text_is_left_out(tmp_path):
    text = 'time,joint1,joint2,description\n0,0.1,0.2,start\n1,0.3,0.4,"of, course"\n2,1,2,\n'
    found = open_motion(written(tmp_path, text), units="rad")
    assert found.whole().q.tolist() == [[0.1, 0.2], [0.3, 0.4], [1.0, 2.0]]
    assert (found.unread, found.notes) == (("description",), ())


ECHO = (
    "%time,field.header.seq,field.header.stamp,field.name0,field.name1,field.position0,field.position1,"
    "field.velocity0,field.velocity1\n"
    "1500000000000000000,1,{0},elbow,wrist,0.5,-1.5,0.25,0.75\n"
    "1500000000250000000,2,{1},elbow,wrist,0.75,-1.25,0.5,0.5\n"
)


def test_names_in_the_rows_of_an_echo(tmp_path):
    stamped = ECHO.format(1400000000000000000, 1400000000500000000)
    found = open_motion(written(tmp_path, stamped), units="rad")
    motion = found.whole()
    assert found.joints == ("elbow", "wrist")
    assert motion.t.tolist() == [1.4e9, 1.4e9 + 0.5]
    assert motion.qd.tolist() == [[0.25, 0.75], [0.5, 0.5]]
    unstamped = open_motion(written(tmp_path, ECHO.format(0, 0)), units="rad").whole()
    assert np.diff(unstamped.t).tolist() == pytest.approx([0.25], abs=5e-7)  # a float64 of 48 years
    place, message, _ = refused(
        tmp_path, stamped + stamped.splitlines()[2].replace("elbow,wrist", "wrist,elbow")
    )
    assert (place, message) == ("in.csv:2:1", "the rows are about other joints than the first one")


def test_degrees_that_a_column_names(tmp_path):
    names = "t_ms,q1 [deg],q2_rad,qd1_deg/s,qd2 (rad/s)"
    motion = open_motion(written(tmp_path, table(names, [[0, 90, 1, 180, 2], [500, 45, 2, 90, 3]]))).whole()
    assert motion.t.tolist() == [0.0, 0.5]
    np.testing.assert_allclose(motion.q, [[pi / 2, 1], [pi / 4, 2]])
    np.testing.assert_allclose(motion.qd, [[pi, 2], [pi / 2, 3]])


@pytest.mark.parametrize(
    ("options", "scales"),
    [
        ({"units": "deg"}, [pi / 180, pi / 180]),
        ({"units": "rad"}, [1, 1]),
        ({"units": "deg,mm", "joint_types": ["revolute", "prismatic"]}, [pi / 180, 1e-3]),
        ({"declared": Units("deg", "mm"), "joint_types": ["prismatic", "revolute"]}, [1e-3, pi / 180]),
        ({"declared": Units("deg", "mm"), "units": "rad"}, [1, 1]),
    ],
)
def test_units_that_somebody_says(options, scales, tmp_path):
    text = table("time,q1,q2,v1,v2", [[0, 10.5, 20.5, 1.5, 2.5]])
    motion = open_motion(written(tmp_path, text), **options).whole()
    np.testing.assert_allclose(motion.q[0], np.array([10.5, 20.5]) * scales, rtol=1e-15)
    np.testing.assert_allclose(motion.qd[0], np.array([1.5, 2.5]) * scales, rtol=1e-15)


def test_units_are_never_guessed(tmp_path):
    place, message, hint = refused(tmp_path, table("time,q1,q2", [[0, 1, 2], [1, -113, 2]]))
    assert (place, message) == ("in.csv:1:6", "nothing says the unit of q1, q2")
    assert hint.startswith("values up to 113: degrees?")
    assert "--units deg" in hint
    # mm says nothing about a revolute joint
    with pytest.raises(InputError, match="nothing says the unit of q1, q2"):
        open_motion(tmp_path / "in.csv", units="mm", joint_types=["revolute", "revolute"])


def test_our_own_names_are_si_whatever_the_job_says(tmp_path):
    path = written(tmp_path, table("t,q1,q2_deg,move", [[0, 1.5, 90, 0]]))
    declared = open_motion(path, declared=Units("deg", "mm"))
    np.testing.assert_allclose(declared.whole().q, [[1.5, pi / 2]])
    assert "rad and m" in declared.notes[-1]
    assert declared.whole().move.tolist() == [0]
    said = open_motion(path, units="deg")
    np.testing.assert_allclose(said.whole().q, [[1.5 * pi / 180, pi / 2]])


@pytest.mark.parametrize(
    ("names", "options", "message", "hint"),
    [
        ("t,q1,q2,q_des1,q_des2", {}, "positions are ambiguous: q1, q2 or q_des1, q_des2", "--columns q=q or --columns q=q_des"),
        (
            "timestamp,actual_q_0,actual_qd_0,target_q_0,target_qd_0",
            {},
            "positions are ambiguous: actual_q_0 or target_q_0",
            "--columns q=actual_q,qd=actual_qd or --columns q=target_q,qd=target_qd",
        ),
        ("t,time,q1", {}, "2 columns are times: t, time", "--columns t=t or --columns t=time"),
        ("q1,q2", {}, "no column is the time", "--columns t=NAME"),
        ("t,x,y", {}, "no columns are positions", "--columns q="),
        ("t,a,b,a_vel,b_vel", {}, "no columns are positions", "q1=NAME,q2=NAME"),
        ("t,A1,A2", {}, "no columns are positions", "--columns q=A takes A1, A2 as positions"),
        ("t,q1,q3", {}, "q2 is missing", "numbered"),
        ("t,q2,q3", {}, "q1 is missing", "numbered"),
        ("t,q1,q2,v1", {}, "2 positions (q1, q2), but 1 of qd (v1)", "--columns qd=none"),
        ("t,q1,q2,v1,v2,qd1,qd2", {}, "two sets of columns are qd", "--columns qd=v or --columns qd=qd"),
        ("t,q1,q2", {"joints": ["a", "b", "c"]}, "2 joints (q1, q2), expected 3", "a, b, c"),
        ("t,a_pos,b_pos", {"joints": ["a", "bb"]}, "there is no joint 'bb'", "did you mean 'b'?"),
        ("t,q1,q2", {"columns": "q=target"}, "there is no column 'target'", "its columns are"),
        ("t,q1,q2", {"columns": "p=q"}, "unknown quantity 'p'", ""),
        ("t,q1,q2", {"columns": "q"}, "is no mapping", "such as"),
        ("t,q1,q2", {"columns": "q=q,q=q"}, "mapped twice", ""),
        ("t,q1,q2", {"units": "degs"}, "unknown unit 'degs'", "did you mean 'deg'?"),
        ("t,q1,q2", {"units": "deg,rad"}, "both units of angle", ""),
        ("t,q1_mm,q2", {"joint_types": ["revolute"] * 2}, "'mm' is no unit of an angle", ""),
        ("t [deg],q1,q2", {}, "'deg' is no unit of time", ""),
        ("t,q1,q1", {}, "there are two columns 'q1'", ""),
    ],
)  # fmt: skip
def test_what_is_open_is_refused_with_the_choices(names, options, message, hint, tmp_path):
    rows = [[k, *range(1, names.count(",") + 1)] for k in range(3)]
    _, said, advice = refused(tmp_path, table(names, rows), **options)
    assert message in said
    assert hint in advice


MAPPED = "timestamp actual_q_0 actual_q_1 target_q_0 target_q_1 actual_qd_0 actual_qd_1 target_qd_0 target_qd_1 foo bar"


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ("q=target_q", {"q": (3, 4), "qd": (7, 8)}),
        ("q=actual_q,qd=target_qd", {"q": (1, 2), "qd": (7, 8)}),
        ("t=timestamp,q=target_q,qd=none", {"q": (3, 4)}),
        ("q1=foo,q2=bar", {"q": (9, 10)}),
        ("q=target_q[deg],qd=none", {"q": (3, 4)}),
        ({"q": "actual_q", "tau1": "foo", "tau2": "bar"}, {"q": (1, 2), "qd": (5, 6), "tau": (9, 10)}),
    ],
)
def test_columns_that_the_user_names(columns, expected, tmp_path):
    rows = [row[:11] for row in COUNTED]
    motion = open_motion(written(tmp_path, table(MAPPED, rows, " ")), columns=columns, units="rad").whole()
    for quantity in ("q", "qd", "tau"):
        found = getattr(motion, quantity)
        wanted = None
        if quantity in expected:
            wanted = np.array([[10.0 * k + j for j in expected[quantity]] for k in range(4)])
            wanted *= pi / 180 if "[deg]" in columns else 1.0
        assert (found is None) == (wanted is None)
        if wanted is not None:
            np.testing.assert_allclose(found, wanted)


def test_joints_are_put_in_the_order_of_the_robot(tmp_path):
    path = written(tmp_path, table("t,elbow_pos,base_pos,finger_pos", [[0, 1, 2, 3]]))
    found = open_motion(path, units="rad", joints=["base", "elbow"])
    assert found.whole().q.tolist() == [[2.0, 1.0]]
    assert found.joints == ("base", "elbow")
    assert found.notes == ("joints that are not of the robot: finger",)
    renamed = open_motion(path, units="rad", joints=["j1", "j2", "j3"])
    assert renamed.whole().q.tolist() == [[1.0, 2.0, 3.0]]
    assert "elbow, base, finger as j1, j2, j3" in renamed.notes[-1]


def test_a_semicolon_and_decimal_commas(tmp_path):
    text = "t;q1;q2\n0,5;-1,25;3\n1;2,5;4,125\n"
    motion = open_motion(written(tmp_path, text)).whole()
    assert motion.t.tolist() == [0.5, 1.0]
    assert motion.q.tolist() == [[-1.25, 3.0], [2.5, 4.125]]
    assert motion.resolution.q.tolist() == [0.005, 0.0005]


@pytest.mark.parametrize("separator", [" ", "\t", ";", "  ", "\t ", " , "])
@pytest.mark.parametrize("form", ["%.9f", "%.4f", "%.17g", "%.6e", "%10.3f"])
def test_separators_and_forms_of_numbers(separator, form, tmp_path, monkeypatch):
    values = np.random.default_rng(0).normal(size=(400, 3)) * [1, 30, 1e-3]
    values[:, 0] = np.arange(400) / 125
    out = io.StringIO()
    np.savetxt(
        out, values, form, separator, header="t q1 q2".replace(" ", separator.strip(" ") or " "), comments=""
    )
    monkeypatch.setattr(recorded_motion, "_KEPT", 100)  # rows are read anew
    monkeypatch.setattr("trajcli.streams.table._CHUNK", 1000)
    found = open_motion(written(tmp_path, out.getvalue()))
    expected = np.loadtxt(io.StringIO(out.getvalue().replace(separator.strip(" ") or " ", " ")), skiprows=1)
    for _ in range(2):
        blocks = list(found.blocks(100))
        assert [len(block.t) for block in blocks] == [100] * 4
        assert [block.first_row for block in blocks] == [1, 101, 201, 301]
        np.testing.assert_array_equal(np.concatenate([block.t for block in blocks]), expected[:, 0])
        np.testing.assert_array_equal(np.concatenate([block.q for block in blocks]), expected[:, 1:])


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("t,q1\n0,1\n1,2\n2", "in.csv:4:1", "the line has 1 values, expected 2"),
        ("t,q1\n0,1\n1,2\n2,", "in.csv:4:3", "q1 is empty"),
        ("t,q1\n0,1\n1,abc\n2,x\n" * 1, "in.csv:3:3", "q1 is 'abc'"),
        ("t,q1\n" + "0;1;2\n" * 50, "in.csv:2:1", "the line has 1 values"),
        ("t,q1\n0,1\n1,2,3\n", "in.csv:3:1", "the line has 3 values"),
        ("t q1\n0 1\n1 2 3\n", "in.csv:3:1", "the line has 3 values"),
        ("t;q1\n0;1\n1;nan\n", "in.csv:3:3", "q1 is 'nan'"),
        ("t,q1,note\n0,1,a\n1,x,b\n", "in.csv:3:3", "q1 is 'x'"),
        ("t,q1\n0,1\n1,-1e308\n", "in.csv:1:3", "q1 is -1e+308 in row 2"),
        ("t,q1,move\n0,1,0\n1,2,0.5\n2,3,1\n", "in.csv:1:6", "move is 0.5 in row 2"),
        ("t,q1,move\n0,1,0\n1,2,-1.25\n", "in.csv:1:6", "move is -1.25 in row 2"),
        ("t,q1\n", "in.csv:1:1", "no rows"),
        ("", "", "is empty"),
        ("Dear reader, this is no table.\n" * 30, "in.csv:1:1", "no columns are positions"),
        (b"\x00\x01\x02", "", "is not text"),
        ("t,q1\n0," + "1" * 10**5 + "\n", "in.csv:2:3", "expected a finite number"),
    ],
)
def test_one_clear_error(text, place, message, tmp_path):
    at, said, _ = refused(tmp_path, text)
    assert at == place
    assert message in said


@pytest.mark.parametrize(
    ("magic", "what"),
    [
        (b"#ROSBAG V2.0\nabc", "a bag of ROS 1"),
        (b"SQLite format 3\x00", "a bag of ROS 2"),
        (b"PAR1\x15", "parquet"),
        (b"\x89HDF\r\n\x1a\n", "HDF5"),
        (b"PK\x03\x04\x14", "archive"),
        (b"\x1f\x8b\x08", "gzip"),
    ],
)
def test_formats_that_are_not_read_are_named(magic, what, tmp_path):
    _, message, hint = refused(tmp_path, magic)
    assert what in message
    assert hint


EXTREMES = [
    "1e-99999999999999999999",
    "1e99",
    "-1e99",
    "1e-320",
    "0",
    "-0",
    "1e18",
    "123456789012345678901234567890",
]


@pytest.mark.parametrize("first", EXTREMES)
@pytest.mark.parametrize("second", EXTREMES)
@pytest.mark.filterwarnings("error")
def test_no_number_overflows(first, second, tmp_path):
    text = table("t,q1,qd1_deg", [[first, second, 1], [second, 1, first], [3, first, second]])
    found = open_motion(written(tmp_path, text))
    assert np.isfinite(found.resolution.q).all()
    assert found.whole().t.tolist() == [float(first), float(second), 3.0]


def test_a_cut_file_is_said_to_be_cut(tmp_path):
    assert "cut" in refused(tmp_path, "t,q1\n0,1\n1,2\n2")[2]


@pytest.mark.parametrize(
    ("cells", "half"),
    [
        (["0.5", "1.25"], 0.005),
        (["1e-3", "2"], 0.0005),
        (["1", "2"], 0.0),  # nobody rounds to whole radians
        (["0.100", "2"], 0.0005),
    ],
)
def test_the_rounding_is_half_a_unit_of_the_last_decimal(cells, half, tmp_path):
    text = table("t,q1,qd1", [[f"{k}.50", cell, "0.1234"] for k, cell in enumerate(cells)])
    resolution = open_motion(written(tmp_path, text)).resolution
    assert resolution.time == 0.005
    assert resolution.q.tolist() == pytest.approx([half])
    assert resolution.qd.tolist() == pytest.approx([0.00005])
    assert resolution.qdd.tolist() == [0.0]


def test_whole_degrees_and_milliseconds_are_rounded(tmp_path):
    resolution = open_motion(
        written(tmp_path, table("t_ms,q1_deg", [[0, 10], [42, 20], [83, 30]]))
    ).resolution
    assert resolution.time == pytest.approx(0.0005)
    assert resolution.q.tolist() == pytest.approx([0.5 * pi / 180])


def test_zeros_without_a_point_are_written_as_other_joints(tmp_path):
    resolution = open_motion(
        written(tmp_path, table("t,q1_deg,q2_deg", [[0, 0, 1.25], [1, 0, 1.5]]))
    ).resolution
    np.testing.assert_allclose(resolution.q, np.array([0.005, 0.005]) * pi / 180)


def test_a_pipe_is_read_as_often_as_needed(monkeypatch):
    text = b"t,q1\n0.0,0.25\n0.5,0.5\n"
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(text)))
    monkeypatch.setattr(recorded_motion, "_KEPT", 0)
    found = open_motion("-")
    assert found.source == "stdin"
    assert found.whole().q.tolist() == found.whole().q.tolist() == [[0.25], [0.5]]


def test_a_message_through_a_pipe(monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO((FILES / "ur_goal.yaml").read_bytes())))
    assert open_motion("-").format == "ros"


def test_json_lines_of_others(tmp_path):
    lines = [{"stamp": 0.02 * k, "frame": "base", "positions": [0.1 * k, 1.0], "extra": {}} for k in range(3)]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    found = open_motion(written(tmp_path, text, "rows.log"), units="rad")
    assert found.format == "jsonl"
    assert found.notes == ("keys that are not read: frame, extra",)
    assert found.whole().q[:, 1].tolist() == [1.0] * 3
    with pytest.raises(InputError, match="nothing says the unit"):
        open_motion(tmp_path / "rows.log")


def test_a_real_goal_has_its_points_and_their_rounding():
    found = open_motion(FILES / "ur_goal.yaml")
    motion = found.whole()
    assert found.joints is not None
    assert found.joints[2] == "elbow_joint"
    np.testing.assert_allclose(motion.t, [0, 0.1, 0.2, 0.3, 0.4], atol=1e-12)
    assert motion.qdd[3].tolist() == [4.1831, -5.0001, 4.6394, -0.0610, -0.2166, 4.2241]
    np.testing.assert_allclose(found.resolution.qd, 0.5e-4)
    # the quintics between the points, from Hermite's six conditions: what the report is about
    peaks = []
    for k in range(4):
        h = motion.t[k + 1] - motion.t[k]
        ends = np.array(
            [motion.q[k], motion.qd[k], motion.qdd[k], motion.q[k + 1], motion.qd[k + 1], motion.qdd[k + 1]]
        )
        s = np.polynomial.polynomial
        conditions = [
            [s.polyval(at, s.polyder(np.eye(6)[c], order)) if order else at**c for c in range(6)]
            for at in (0.0, h)
            for order in range(3)
        ]
        coefficients = np.linalg.solve(np.array(conditions), ends)
        peaks.append(np.abs(s.polyval(np.linspace(0, h, 2001), s.polyder(coefficients, 2))).max())
    assert peaks[0] == pytest.approx(6.87, abs=0.005)
    assert peaks[3] == pytest.approx(5.54, abs=0.005)
    assert np.abs(motion.qdd).max() == 5.0001


@pytest.mark.parametrize("name", ["jtraj", "mstraj", "toppra", "ruckig", "degrees_24hz"])
def test_files_of_peers(name):
    path = FILES / f"{name}.csv"
    found = open_motion(path, units="deg" if name == "degrees_24hz" else None)
    numbers = np.loadtxt(path, delimiter=",", skiprows=1)
    scale = pi / 180 if name == "degrees_24hz" else 1.0
    motion = found.whole()
    np.testing.assert_array_equal(motion.t, numbers[:, 0])
    np.testing.assert_allclose(motion.q, numbers[:, 1:7] * scale, rtol=1e-15)


def test_a_chunk_in_single_precision():
    found = open_motion(FILES / "chunk_float32.npy", units="rad", joints=[f"j{k}" for k in range(7)])
    assert found.resolution.relative == (2.0**-24, 0.0, 0.0)
    assert found.resolution.relative_time == 2.0**-24
    assert found.resolution.q.tolist() == [0.0] * 7
    np.testing.assert_array_equal(found.whole().q, np.load(FILES / "chunk_float32.npy")[:, 1:].astype(float))


def opened(path):
    """Return the motion of a file; None where it is refused, which must be by one problem."""
    try:
        return open_motion(path, units="rad,m")
    except TrajcliError as error:
        (_,) = error.problems
        return None


ALPHABET = st.text(st.sampled_from("tq12 ,;\t\n.#%-eE\"'xNa[]deg_:{}\r\x00é"), max_size=200)


@settings(max_examples=300, deadline=None)
@given(
    st.one_of(
        ALPHABET, st.text(CHARACTERS, max_size=50), ALPHABET.map(lambda text: "t,q1,q2\n0,1,2\n" + text)
    )
)
def test_any_text_is_a_motion_or_an_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "in.txt"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    found = opened(path)
    if found is not None:
        motion = found.whole()
        assert np.isfinite(motion.q).all()
        assert len(motion.t) == found.rows >= 1


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=100), st.sampled_from(["", "\x93NUMPY", "\x89MCAP0\r\n"]))
def test_any_bytes_are_a_motion_or_an_error(tmp_path_factory, content, magic):
    path = tmp_path_factory.mktemp("fuzz") / "in"
    path.write_bytes(magic.encode("latin-1") + content)
    opened(path)


@pytest.mark.parametrize("name", ["in.csv", "in.jsonl"])
def test_a_joint_that_stands_says_nothing_of_its_decimals(tmp_path: Path, name: str) -> None:
    """Six decimals, written without the zeros in the end; the third joint moves in whole tenths, by its own digits."""
    rows = [
        [round(0.1 * k, 1), round(0.1234567 * k, 6), 0.3, round(0.1 * k, 1), 0.5, 0.0, 1.25] for k in range(9)
    ]
    text = table("t,q1,q2,q3,qd1,qd2,qd3", rows)
    if name == "in.jsonl":
        text = "".join(json.dumps({"t": row[0], "q": row[1:4], "qd": row[4:]}) + "\n" for row in rows)
    resolution = open_motion(written(tmp_path, text, name)).resolution
    assert resolution.q.tolist() == pytest.approx([5e-7, 5e-7, 0.05])
    assert resolution.qd.tolist() == pytest.approx([0.005] * 3)


def test_a_joint_in_another_unit_has_decimals_of_its_own(tmp_path: Path) -> None:
    """Whole degrees of a joint that stands are those of the other joint in degrees; no decimals of millimetres."""
    rows = [[0.1 * k, round(1.234 * k, 3), 90, 0.5, round(0.12345 * k, 5)] for k in range(5)]
    resolution = open_motion(
        written(tmp_path, table("t,q1_deg,q2_deg,q3_mm,q4_mm", rows)),
        joint_types=("revolute", "revolute", "prismatic", "prismatic"),
    ).resolution
    assert resolution.q.tolist() == pytest.approx([5e-4 * pi / 180] * 2 + [5e-9] * 2)


@pytest.mark.parametrize("size", [1, 2, 6])
def test_a_column_stands_where_it_does_so_in_all_blocks(size: int) -> None:
    """Columns that begin or end elsewhere, above or below, move; one that is 0.3 throughout stands."""
    rows = np.full((6, 5), 0.3)
    rows[0, 1], rows[-1, 2], rows[0, 3], rows[-1, 4] = 0.2, 0.2, -0.4, 0.4
    extents = ColumnExtents(5)
    for low in range(0, 6, size):
        extents.add(rows[low : low + size])
    assert extents.still.tolist() == [True, False, False, False, False]
    assert extents.largest.tolist() == [0.3, 0.3, 0.3, 0.4, 0.4]


@pytest.mark.parametrize("size", [1, 2, 6])
@pytest.mark.parametrize("taken", [[0, 1, 3], [0, 2], [2, 1], [1, 2, 3]])
def test_rows_at_a_rate_have_their_times_in_front(taken: list[int], size: int) -> None:
    """Six rows at 4 Hz, in blocks: the columns that are asked for, of which the time is the first."""
    values = np.arange(18.0).reshape(6, 3) + 0.5

    class InBlocks(ArrayRows):
        def blocks(self, taken, fixed):
            for low in range(0, 6, size):
                yield self.columns[low : low + size, list(taken)]

    named = NamedFile("rows", ("q1", "q2", "q3"), unplaced)
    rows = InBlocks("csv", named, values, np.array([3, 4, 5]), np.array([0.0, 1e-8, 2e-8]))
    timed = TimedRows(rows, 4.0)
    assert timed.named.names == ("t", "q1", "q2", "q3")
    whole = np.column_stack([np.arange(6) / 4.0, values])
    np.testing.assert_array_equal(np.concatenate(list(timed.blocks(taken, []))), whole[:, taken])
    assert timed.decimals(taken).tolist() == np.array([EXACT, 3, 4, 5])[taken].tolist()
    assert timed.relative.tolist() == [0.0, 0.0, 1e-8, 2e-8]
