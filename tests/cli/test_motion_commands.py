"""`trajcli retime`, `resample`, `concat`, `reverse`, `slice`, `convert`: files in, files out."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from running import EXAMPLES, JOB, call

from trajcli.errors import Problem
from trajcli.streams.recorded_motion import open_motion

Capture = pytest.CaptureFixture[str]
PICK = EXAMPLES / "ur5e_pick.yaml"


WRITTEN: dict[str, bytes] = {}  # rows, planned once in a process


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: Capture) -> Path:
    """A folder with the rows of two jobs."""
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(JOB.replace("[t, q]", "[t, q, qd, qdd]"))
    for job, rows in (("job.yaml", "rows.csv"), (PICK, "pick.csv")):
        if rows not in WRITTEN:
            assert call(capfd, "plan", job, "-q", "-o", rows).code == 0
            WRITTEN[rows] = Path(rows).read_bytes()
        Path(rows).write_bytes(WRITTEN[rows])
    return tmp_path


def numbers(path: str) -> tuple[list[str], np.ndarray]:
    text = Path(path).read_text()
    return text.split("\n", 1)[0].split(","), np.loadtxt(path, delimiter=",", skiprows=1)


pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.parametrize(
    "words", [("reverse",), ("resample", "--rate", "10"), ("slice", "--from", "0.2"), ("convert",)]
)
def test_rows_go_to_standard_output_and_words_to_the_other(words: tuple[str, ...], capfd: Capture) -> None:
    name, *options = words
    code, out, err = call(capfd, name, "rows.csv", *options)
    assert code == 0
    assert out.startswith("t,q1_deg,qd1_deg,qdd1_deg\n")
    assert err.startswith("rows.csv: ")
    call(capfd, name, "rows.csv", *options, "-o", "out.csv", "-q")
    assert Path("out.csv").read_text() == out
    assert capfd.readouterr().err == ""


def test_resampled_rows_that_jump_are_not_written(capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "trajcli.editing.requirements.new_jumps", lambda *_: [Problem("the position of j1 jumps")]
    )
    code, _, err = call(capfd, "resample", "rows.csv", "--rate", "20", "-o", "out.csv")
    assert code == 1
    assert "the position of j1 jumps" in err
    assert not Path("out.csv").exists()


def test_laws_on_the_command_line(capfd: Capture) -> None:
    for words in (
        ("reverse", "pick.csv", "-o", "back.csv"),
        ("reverse", "back.csv", "-o", "again.csv"),
        ("resample", "pick.csv", "--rate", "125", "-o", "same.csv"),
        ("slice", "pick.csv", "--to", "2.496", "-o", "first.csv"),
        ("slice", "pick.csv", "--from", "2.496", "-o", "second.csv"),
        ("concat", "first.csv", "second.csv", "-o", "whole.csv"),
    ):
        assert call(capfd, *words).code == 0, words
    for name in ("again.csv", "same.csv", "whole.csv"):
        assert Path(name).read_bytes() == Path("pick.csv").read_bytes(), name


def test_formats_there_and_back(capfd: Capture) -> None:
    names, rows = numbers("pick.csv")
    scale = np.array([np.pi / 180 if name.endswith("_deg") else 1.0 for name in names])
    for ending in ("mcap", "jsonl"):
        assert call(capfd, "convert", "pick.csv", "-o", f"there.{ending}").code == 0
        assert call(capfd, "convert", f"there.{ending}", "-o", "back.csv").code == 0
        plain, back = numbers("back.csv")
        kept = [name.removesuffix("_deg") for name in names]
        assert plain == [name for name in kept if ending == "jsonl" or name != "move"]
        columns = [kept.index(name) for name in plain]
        np.testing.assert_allclose(back, (rows * scale)[:, columns], rtol=0, atol=6e-10)
    lines = [json.loads(line) for line in Path("there.jsonl").read_text().splitlines()]
    np.testing.assert_array_equal([line["q"] for line in lines], np.deg2rad(rows[:, 1:7]))


def test_a_log_keeps_the_names_of_the_joints(capfd: Capture) -> None:
    assert call(capfd, "plan", PICK, "-q", "-o", "pick.mcap").code == 0
    assert call(capfd, "reverse", "pick.mcap", "-o", "back.mcap").code == 0
    before, after = open_motion("pick.mcap"), open_motion("back.mcap")
    assert after.joints == before.joints
    assert after.joints is not None
    np.testing.assert_array_equal(after.whole().q, before.whole().q[::-1])


@pytest.mark.parametrize("form", ["ros", "ros-goal"])
def test_a_message_has_the_rows_as_points(form: str, capfd: Capture) -> None:
    assert call(capfd, "convert", "rows.csv", "-o", "goal.yaml", "--format", form).code == 0
    message = yaml.safe_load(Path("goal.yaml").read_text())
    points = (message["trajectory"] if form == "ros-goal" else message)["points"]
    _, rows = numbers("rows.csv")
    times = [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in points]
    np.testing.assert_allclose(times, rows[:, 0], atol=1e-9)
    for key, column in (("positions", 1), ("velocities", 2), ("accelerations", 3)):
        np.testing.assert_allclose(
            [point[key][0] for point in points], np.deg2rad(rows[:, column]), atol=1e-12
        )
    code, _, err = call(capfd, "convert", "goal.yaml", "-o", "back.csv")
    assert (code, "columns number the joints: j1" in err) == (0, True)


def test_a_message_about_other_joints_is_checked_by_its_numbers(capfd: Capture) -> None:
    """As the hint says: converted, it has no names that contradict those of the robot."""
    robot = "{joints: [{name: a, velocity: 2}, {name: b, velocity: 2}]}"
    Path("arm.yaml").write_text(robot)
    points = [f"- {{positions: [0.{k}, 0.5], time_from_start: {{sec: {k}}}}}\n" for k in (0, 1)]
    Path("goal.yaml").write_text(f"joint_names: [x, y]\npoints:\n{''.join(points)}")
    found = call(capfd, "check", "goal.yaml", "--robot", "arm.yaml")
    assert (found.code, "trajcli convert" in found.err) == (2, True)
    assert call(capfd, "convert", "goal.yaml", "-o", "back.csv").code == 0
    assert call(capfd, "check", "back.csv", "--robot", "arm.yaml").code == 0


def test_a_stranger_keeps_names_order_and_units(capfd: Capture) -> None:
    text = "Time;q2_deg;q1_mm\n0.000;10.00;1.5\n0.250;20.50;2.5\n0.500;30.00;3.0\n"
    Path("log.csv").write_text(text)
    code, out, _ = call(capfd, "reverse", "log.csv")
    assert code == 0
    assert out == "Time,q2_deg,q1_mm\n0.000,30.00,3.0\n0.250,20.50,2.5\n0.500,10.00,1.5\n"
    code, out, _ = call(capfd, "resample", "log.csv", "--rate", "8")
    assert out.splitlines()[1:3] == ["0.000,10.000000000,1.500000000", "0.125,15.250000000,2.000000000"]


def test_a_message_has_what_the_file_has_and_keeps_its_verdict(capfd: Capture) -> None:
    """Points of positions alone are joined by straight lines, as rows are; with velocities by cubics."""
    Path("arm.yaml").write_text(
        "joints: [{name: lift, type: prismatic, position: [0, 0.2], velocity: 1}, {name: turn, velocity: 100}]\n"
        "units: {angle: deg}\n"
    )
    t = np.arange(11) / 10
    q = t**3 * (10 - 15 * t + 6 * t**2)
    qd = 30 * t**2 * (1 - t) ** 2
    sets = {
        "t,turn,lift": np.stack([t, 40 * q, 0.1 * q], axis=1),
        "t,q1,q2,qd1,qd2": np.stack([t, 0.1 * q, 0.7 * q, 0.1 * qd, 0.7 * qd], axis=1),
    }
    turned = (np.radians(40), 0.7)  # plain names are in SI
    for number, (header, rows) in enumerate(sets.items()):
        np.savetxt("log.csv", rows, "%.9f", ",", header=header, comments="")
        code, _, err = call(capfd, "convert", "log.csv", "--robot", "arm.yaml", "-o", "goal.yaml")
        assert code == 0, err
        message = yaml.safe_load(Path("goal.yaml").read_text())
        assert message["joint_names"] == ["lift", "turn"]
        for k, point in enumerate(message["points"]):
            assert [*point] == ["positions", *["velocities"] * number, "time_from_start"]
            np.testing.assert_allclose(point["positions"], [0.1 * q[k], turned[number] * q[k]], atol=1e-9)
        found = [call(capfd, "check", file, "-r", "arm.yaml") for file in ("log.csv", "goal.yaml")]
        how = "joined by cubics" if number else "joined by straight lines"
        assert [(each.code, how in each.out) for each in found] == [(0, True)] * 2


def test_what_a_message_leaves_out_is_said(capfd: Capture) -> None:
    Path("log.csv").write_text("t,q1,qdd1,tau1\n0,0,0,1\n1,1,0,2\n2,2,0,3\n")
    _, _, err = call(capfd, "convert", "log.csv", "--units", "rad", "-o", "goal.yaml")
    assert [line.split()[2] for line in err.splitlines() if "left out" in line] == ["qdd", "tau"]
    assert call(capfd, "convert", "-", "-r", "-").err.startswith("error: standard input can be read once")
    Path("arm.yaml").write_text("joints: [{name: turn}]\nunits: {angle: deg}\n")
    refused = call(capfd, "convert", "log.csv", "-r", "arm.yaml", "-o", "arm.yaml")
    assert (refused.code, "would overwrite the robot's file arm.yaml" in refused.err) == (2, True)
    refused = call(capfd, "convert", "log.csv", "-r", "ur5e", "--si", "--columns", "q1=q1")
    assert (refused.code, "1 joint (q1), expected 6" in refused.err) == (2, True)
    Path("angles.csv").write_text("t,turn\n0,0\n1,90\n")
    for robot, code in (("arm.yaml", 0), ("turning.yaml", 2)):
        Path("turning.yaml").write_text("joints: [{name: turn}]\n")
        told = call(capfd, "convert", "angles.csv", "-r", robot, "--si")
        assert (told.code, "--units deg" in told.err) == (code, code == 2)
    refused = call(capfd, "convert", "log.csv", "-r", "planar2r", "-o", "goal.yaml")
    assert (refused.code, "1 joint (q1), expected 2" in refused.err) == (2, True)


def test_positions_alone_are_judged_alike_in_a_log(capfd: Capture) -> None:
    Path("arm.yaml").write_text("units: {angle: deg}\njoints: [{name: j1, velocity: 10, jerk: 5}]\n")
    Path("log.csv").write_text("t,q1_deg\n0,0\n1,10\n2,0\n")
    assert call(capfd, "convert", "log.csv", "-o", "log.mcap").code == 0
    assert call(capfd, "retime", "log.csv", "--robot", "arm.yaml", "-o", "slow.mcap").code == 0
    for name in ("log.csv", "log.mcap", "slow.mcap"):
        told = call(capfd, "check", name, "--robot", "arm.yaml", "--format", "json")
        found = json.loads(told.out)
        assert (found["verdict"], found["interpolation"]) == ("satisfied", "linear")


@pytest.mark.parametrize("start", [0, 12, 1_700_000_000])
def test_stamps_are_the_same_behind_a_log(capfd: Capture, start: int) -> None:
    """Also where they are times of a clock: a log that `convert` wrote says from when its times count."""
    Path("log.csv").write_text(f"t,q1,qd1\n{start},0,0\n{start + 1},1,0.5\n{start + 2},2,0\n")
    assert call(capfd, "convert", "log.csv", "-o", "log.mcap").code == 0
    assert call(capfd, "convert", "log.mcap", "-o", "back.csv").code == 0
    stamps = [float(row.partition(",")[0]) for row in Path("back.csv").read_text().splitlines()[1:]]
    assert stamps == [start, start + 1, start + 2]


def test_retime_says_factor_joint_and_limit(capfd: Capture) -> None:
    Path("arm.yaml").write_text("units: {angle: deg}\njoints: [{name: wrist, velocity: 40}]\n")
    assert call(capfd, "check", "rows.csv", "--robot", "arm.yaml").code == 1
    code, _, err = call(capfd, "retime", "rows.csv", "--robot", "arm.yaml", "-o", "slow.csv")
    assert code == 0
    factor = float(re.search(r"factor ([0-9.]+)", err)[1])  # type: ignore[index]
    assert factor == pytest.approx(56.25 / 40, rel=1e-4)  # a quintic peaks at 15/8 of its mean
    assert "by the velocity of wrist, whose limit is 40 deg/s" in err
    assert f"it takes {factor:.4g}" in err
    assert call(capfd, "check", "slow.csv", "--robot", "arm.yaml").code == 0
    names, rows = numbers("rows.csv")
    assert numbers("slow.csv")[0] == names
    less = rows / np.array([1 / (0.999 * factor), 1, 0.999 * factor, (0.999 * factor) ** 2])
    np.savetxt("fast.csv", less, "%.9f", ",", header=",".join(names), comments="")
    assert call(capfd, "check", "fast.csv", "--robot", "arm.yaml").code == 1


def test_retime_by_a_job_and_by_its_moves(capfd: Capture) -> None:
    code, _, err = call(capfd, "retime", "pick.csv", "--job", PICK, "-o", "same.csv")
    assert code == 0
    assert "factor 1, its limits are kept as it is" in err
    assert Path("same.csv").read_bytes() == Path("pick.csv").read_bytes()
    assert (
        call(capfd, "retime", "pick.csv", "--robot", "ur5e", "--fastest", "--per-move", "-o", "f.csv").code
        == 0
    )
    assert call(capfd, "check", "f.csv", "--robot", "ur5e").code == 0
    assert numbers("f.csv")[1][-1, 0] < 0.7 * numbers("pick.csv")[1][-1, 0]


def test_a_jump_is_exit_1_with_the_jump(capfd: Capture) -> None:
    code, out, err = call(capfd, "concat", "rows.csv", "rows.csv", "-o", "both.csv")
    assert (code, out) == (1, "")
    assert "the position of j1 jumps by -30 from the end of rows.csv (30) to the start of rows.csv (0)" in err
    assert not Path("both.csv").exists()


@pytest.mark.parametrize(
    "words", [("resample", "--rate", "90"), ("resample", "--rate", "300"), ("slice", "--from", "1.2345")]
)
def test_rows_between_rows_verify(words: tuple[str, ...], capfd: Capture) -> None:
    """What the columns of the new file say agrees with itself, and keeps limits as the old one does."""
    name, *options = words
    assert call(capfd, name, "pick.csv", *options, "-o", "out.csv").code == 0
    assert numbers("out.csv")[0] == numbers("pick.csv")[0]
    found = json.loads(call(capfd, "check", "out.csv", "--robot", "ur5e", "--format", "json").out)
    assert found["verdict"] != "exceeded", found["findings"]


WRONG = [
    (("resample", "rows.csv", "--rate", "fast"), 2, "--rate expects rows per second, got 'fast'"),
    (("resample", "rows.csv", "--rate", "-5"), 2, "--rate expects rows per second"),
    (("resample", "rows.csv", "--rate", "1e-320"), 2, "a number of at least 1e-12"),
    (("resample", "rows.csv", "--rate", "1e12"), 2, "is too high"),
    (("slice", "rows.csv", "--from", "soon"), 2, "--from expects seconds, got 'soon'"),
    (("slice", "rows.csv", "--from", "2"), 2, "--from 2: rows.csv goes from 0 s to 1 s"),
    (("slice", "rows.csv", "--from", "0.5", "--to", "0.5"), 2, "is not before"),
    (("concat", "rows.csv"), 2, "concat joins two files at least"),
    (("concat", "rows.csv", "pick.csv"), 2, "has 1 joint"),
    (("retime", "-", "--job", "-"), 2, "standard input can be read once"),
    (("plan", "-", "-", "--no-output"), 2, "standard input can be read once"),
    (("reverse", "none.csv"), 4, "none.csv"),
    (("reverse", "job.yaml"), 2, "job.yaml"),
    (("reverse", "rows.csv", "-o", "rows.csv"), 2, "-o to rows.csv would overwrite the rows of rows.csv"),
    (("reverse", "rows.csv", "-o", "out.xyz"), 2, "rows are written as"),
    (("convert", "rows.csv", "-o", "out.csv", "--format", "mcap"), 2, "contradicts the name of the file"),
    (("convert", "bare.csv", "-o", "out.mcap"), 2, "--units"),
    (("retime", "rows.csv"), 2, "by which limits is the motion retimed?"),
    (("retime", "rows.csv", "--robot", "ur5e"), 2, "expected 6"),
    (("retime", "rows.csv", "--robot", "arm.yaml", "--per-move"), 2, "no column `move`"),
    (
        ("retime", "rows.csv", "--robot", "arm.yaml", "--fastest"),
        2,
        "no limit bounds how fast rows.csv may be",
    ),
]


@pytest.mark.parametrize(("words", "code", "message"), WRONG)
def test_what_is_wrong(words: tuple[str, ...], code: int, message: str, folder: Path, capfd: Capture) -> None:
    Path("arm.yaml").write_text("joints: 1\n")
    Path("bare.csv").write_text("time,Axis 1\n0,0\n1,113\n")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    outcome = call(capfd, *words)
    assert (outcome.code, outcome.out) == (code, "")
    assert message in outcome.err
    assert "Traceback" not in outcome.err
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("names", ["time [ms],shoulder_pos,elbow_pos", "t_ms,q0_deg,q1_deg"])
def test_advice_for_other_names_is_followed_to_the_letter(names: str, folder: Path, capfd: Capture) -> None:
    """What fk, plot and view refuse is refused no more once it is written in plain columns."""
    (folder / "log.csv").write_text(f"{names}\n0,0,0\n250,90,0\n500,90,-90\n")
    words = (
        ["fk", "-r", "planar2r", "-"],
        ["plot", "log.csv", "-o", "log.svg"],
        ["view", "log.csv", "-o", "log.html"],
    )
    for line in words:
        found = call(capfd, *line, stdin=(folder / "log.csv").read_text())
        assert found.code == 2
        assert "`trajcli convert FILE --si`" in found.err
    found = call(capfd, "convert", "log.csv", "--si")
    if "deg" not in names:
        assert found.code == 2
        assert "--units deg" in found.err
        found = call(capfd, "convert", "log.csv", "--si", "--units", "deg")
    assert found.out.splitlines()[0] == "t,q1,q2"
    (folder / "log.csv").write_text(found.out)
    told = call(capfd, *words[0], stdin=found.out)
    poses = np.loadtxt(told.out.splitlines()[1:], delimiter=",")
    # links of 0.3 m and 0.2 m
    np.testing.assert_allclose(poses[:, 0], [0, 0.25, 0.5])
    np.testing.assert_allclose(poses[:, 1:3], [[0.5, 0], [0, 0.5], [0.2, 0.3]], atol=1e-8)
    for line in words[1:]:
        assert call(capfd, *line).code == 0


@pytest.mark.parametrize("ending", ["mcap", "jsonl", "npz"])
def test_what_decimals_excuse_is_said_where_the_new_file_has_no_such(
    ending: str, folder: Path, capfd: Capture
) -> None:
    """Rows of sin t at 500 Hz with three decimals: what they change by is no velocity of three decimals."""
    rows = [f"{t:.3f},{np.sin(t):.3f},{np.cos(t):.3f}" for t in (np.arange(200) / 500).tolist()]
    (folder / "log.csv").write_text("t,q1,qd1\n" + "\n".join(rows) + "\n")
    remark = "`check` may find what the decimals of this file excuse"
    (folder / "one.yaml").write_text("joints: 1\n")
    assert call(capfd, "check", "log.csv", "-r", "one.yaml").code == 0
    for command in (["convert", "log.csv"], ["slice", "log.csv", "--to", "0.1"]):
        found = call(capfd, *command, "-o", f"new.{ending}")
        assert remark in found.err
        assert "the velocity of j1" in found.err
        wrong = ending != "jsonl"  # whose numbers show their decimals as well
        assert call(capfd, "check", f"new.{ending}", "-r", "one.yaml").code == wrong
        assert call(capfd, *command, "-q", "-o", f"new.{ending}").err == ""
        found = call(capfd, *command, "-o", "new.csv")
        assert remark not in found.err
        assert call(capfd, "check", "new.csv", "-r", "one.yaml").code == 0
    assert remark not in call(capfd, "convert", "rows.csv", "-o", f"new.{ending}").err  # of a plan


def test_rows_that_number_the_joints_of_states_in_json_say_which_these_are(
    folder: Path, capfd: Capture
) -> None:
    """Drivers name the joints in the order of the alphabet, and no column of a CSV does."""
    rows = [
        {
            "header": {"stamp": {"sec": k, "nanosec": 0}},
            "name": ["elbow", "base"],
            "position": [k / 8, -k / 4],
        }
        for k in range(3)
    ]
    (folder / "states.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    found = call(capfd, "convert", "states.jsonl", "-o", "states.csv")
    assert "columns number the joints: elbow, base" in found.err
    np.testing.assert_array_equal(numbers("states.csv")[1][:, 1:], [[0, 0], [1 / 8, -1 / 4], [2 / 8, -2 / 4]])
    (folder / "arm.yaml").write_text("joints: [{name: base}, {name: elbow}]\n")
    found = call(capfd, "convert", "states.jsonl", "-r", "arm.yaml", "-o", "states.csv")
    assert "columns number the joints: base, elbow" in found.err
    np.testing.assert_array_equal(numbers("states.csv")[1][:, 1:], [[0, 0], [-1 / 4, 1 / 8], [-2 / 4, 2 / 8]])
    found = call(capfd, "convert", "states.jsonl", "-o", "states.yaml")
    assert "columns number" not in found.err
    assert yaml.safe_load((folder / "states.yaml").read_text())["joint_names"] == ["elbow", "base"]
