"""`trajcli plot`: which file it writes, from what, and what it refuses."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from running import EXAMPLES, FAST, JOB, call, run, warm
from tiers import few

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(JOB)
    (tmp_path / "rows.csv").write_text("t,q1_deg\n0,0\n1,30\n")
    return tmp_path


def test_a_picture_is_called_as_the_first_file_and_stands_in_this_folder(here: Path, capfd: Capture) -> None:
    (here / "jobs").mkdir()
    (here / "jobs" / "pick.yaml").write_text(JOB)
    assert call(capfd, "plot", "jobs/pick.yaml") == (0, "", "pick.svg written\n")
    assert (here / "pick.svg").read_bytes().startswith(b"<?xml")
    assert call(capfd, "plot", "rows.csv", "--format", "png", "-q") == (0, "", "")
    assert (here / "rows.png").read_bytes().startswith(b"\x89PNG")
    assert call(capfd, "plot", "rows.csv", "job.yaml").err == "job.svg written\n"


@pytest.mark.parametrize(
    ("name", "begins"), few([("a.svg", b"<?xml"), ("a.png", b"\x89PNG"), ("a.PDF", b"%PDF")], 2)
)
def test_the_ending_says_the_format(name: str, begins: bytes, here: Path, capfd: Capture) -> None:
    assert call(capfd, "plot", "job.yaml", "-o", name).code == 0
    assert (here / name).read_bytes().startswith(begins)


def test_standard_streams(here: Path, capfd: Capture) -> None:
    drawn = run("plot", "-", "-o", "-", stdin=JOB)
    assert drawn.code == 0
    assert drawn.out.startswith("<?xml")
    assert "stdin: verified" in drawn.out
    assert drawn.err == ""
    rows = call(capfd, "plot", "-", "-o", "-", "--quantities", "q", stdin="t,q1_deg\n0,0\n1,30\n")
    assert rows.code == 0
    assert "q [deg]" in rows.out
    assert call(capfd, "plot", "-", stdin="t,q1_deg\n0,0\n1,30\n").err == "plot.svg written\n"
    assert (here / "plot.svg").exists()


def test_the_same_command_writes_the_same_bytes(here: Path, capfd: Capture) -> None:
    assert run("plot", "job.yaml", "-o", "a.svg").code == 0
    assert call(capfd, "plot", "job.yaml", "-o", "b.svg").code == 0
    assert (here / "a.svg").read_bytes() == (here / "b.svg").read_bytes()


def test_a_job_that_breaks_a_limit_is_drawn_and_refused(here: Path, capfd: Capture) -> None:
    (here / "fast.yaml").write_text(FAST)
    code, out, err = call(capfd, "plot", "fast.yaml")
    assert (code, out) == (1, "")
    assert "fast.svg written" in err
    assert "the velocity of j1 reaches 225 deg/s" in err
    text = (here / "fast.svg").read_text()
    assert "NOT VERIFIED, 1 finding" in text
    assert 'id="panel1-findings"' in text
    assert call(capfd, "plan", "fast.yaml", "--no-output").code == 1


def test_values_can_be_set(here: Path, capfd: Capture) -> None:
    assert call(capfd, "plot", "job.yaml", "--set", "moves.0.duration=0.25").code == 1
    assert call(capfd, "plot", "job.yaml", "--set", "name=other", "-o", "a.svg").code == 0
    assert "other: verified" in (here / "a.svg").read_text()


@pytest.mark.parametrize(
    "words", [["--joints", "elbow_joint,wrist_1_joint"], ["--joints", "elbow_joint", "wrist_1_joint"],
              ["--joints", "elbow_joint", "--joints", "wrist_1_joint"]]
)  # fmt: skip
def test_joints_are_named_by_commas_or_blanks(words: list[str], here: Path, capfd: Capture) -> None:
    code, _, err = call(
        capfd, "plot", EXAMPLES / "ur5e_pick.yaml", *words, "--quantities", "q", "-o", "a.svg"
    )
    assert (code, err) == (0, "a.svg written\n")
    text = (here / "a.svg").read_text()
    assert text.count("_joint: position</text>") == 2
    assert "wrist_1_joint: position" in text


def test_files_lie_over_a_job_with_a_legend(here: Path, capfd: Capture) -> None:
    assert call(capfd, "plot", "job.yaml", "rows.csv", "-o", "a.svg").code == 0
    text = (here / "a.svg").read_text()
    for part in (">rows.csv</text>", ">job</text>", 'id="panel0-source0"', 'id="panel0-source1"'):
        assert part in text


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (
            ["job.yaml", "--quantities", "q,tol"],
            2,
            "there is no quantity 'tol' to plot\n  did you mean 'tool'?",
        ),
        (["job.yaml", "--quantities", "q,q"], 2, "the quantity 'q' is asked for twice"),
        (["job.yaml", "--quantities", ","], 2, "no quantities are asked for"),
        (["job.yaml", "--quantities", "phase"], 2, "no move of the job has a time-optimal law"),
        (["job.yaml", "--joints", "j7"], 2, "there is no joint 'j7'"),
        (["--joints", "j1"], 2, "JOB|FILE"),
        (["job.yaml", "-o", "a.gif"], 2, "pictures are not written as .gif"),
        (["job.yaml", "-o", "a.svg", "--format", "pdf"], 2, "contradict each other"),
        (["job.yaml", "job.yaml", "job.yaml"], 2, "two jobs can be plotted, and there are 3"),
        (["-", "-"], 2, "only one of the files can be standard input"),
        (["rows.csv", "--set", "name=x"], 2, "--set overrides values of a job, and there is none"),
        (["missing.yaml"], 4, "there is no file 'missing.yaml'"),
        (["missing.csv"], 4, "cannot read missing.csv"),
        (["missing"], 4, "there is no file 'missing'"),
        (["job.yaml", "-o", "no/such/folder.svg"], 4, "cannot write no/such/folder.svg"),
    ],
)
def test_what_is_wrong_is_said(words: list[str], code: int, message: str, here: Path, capfd: Capture) -> None:
    outcome = call(capfd, "plot", *words)
    assert outcome.code == code
    assert message in outcome.err
    assert outcome.out == ""
    assert sorted(path.name for path in here.iterdir()) == ["job.yaml", "rows.csv"]


def test_a_picture_never_overwrites_what_it_is_drawn_from(here: Path, capfd: Capture) -> None:
    (here / "plan.svg").write_text(JOB)
    (here / "rows.svg").symlink_to("rows.csv")
    code, _, err = call(capfd, "plot", "plan.svg")
    assert code == 2
    assert "the picture to plan.svg would overwrite the job plan.svg" in err
    assert call(capfd, "plot", "rows.csv").code == 2
    assert (here / "rows.csv").read_text().startswith("t,q1_deg")


def test_a_file_without_a_known_ending_is_told_by_its_first_line(here: Path, capfd: Capture) -> None:
    (here / "job.trajectory").write_text(JOB)
    (here / "rows.dat").write_text("t,q1_deg\n0,0\n1,30\n")
    assert call(capfd, "plot", "job.trajectory", "rows.dat").err == "job.svg written\n"


def test_no_binary_goes_to_a_terminal(here: Path) -> None:
    leader, follower = os.openpty()
    done = subprocess.run(
        [*warm(), "plot", "job.yaml", "-o", "-", "--format", "png"],
        check=False,
        stdout=follower,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.close(follower)
    os.close(leader)
    assert done.returncode == 2
    assert "a terminal shows no png" in done.stderr
    assert "-o job.png" in done.stderr


def test_errors_are_json_where_asked_for(here: Path, capfd: Capture) -> None:
    (here / "fast.yaml").write_text(FAST)
    code, _, err = call(capfd, "plot", "fast.yaml", "--errors", "json", "-q")
    assert code == 1
    assert '"exit": 1' in err


SHOW = "import sys; from trajcli.cli.app import app\ntry:\n    app(sys.argv[1:])\nfinally:\n    print(*sys.modules)\n"


def test_only_what_is_needed_is_imported(here: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SHOW, "plot", "job.yaml", "-q"], capture_output=True, text=True, check=True
    )
    modules = set(done.stdout.split())
    assert "matplotlib.figure" in modules
    unneeded = {
        "matplotlib.pyplot",
        "matplotlib.backends.backend_pdf",
        "scipy",
        "toppra",
    }
    assert not modules & unneeded


PEAK = "t,q1_deg,qd1_deg\n0,0,0\n0.5,15,{rate}\n1,30,0\n"  # a job of 90 deg/s at most


def test_a_file_that_exceeds_the_job_is_drawn_marked_and_refused(here: Path, capfd: Capture) -> None:
    (here / "rows.csv").write_text(PEAK.format(rate=95))
    code, out, err = call(capfd, "plot", "rows.csv", "job.yaml", "-o", "a.svg")
    assert (code, out) == (1, "")
    said = "error: rows.csv: the velocity of j1 reaches 95 deg/s at t = 0.5 s, its limit is 90 deg/s"
    assert err.startswith(f"a.svg written\n{said}\n")
    assert "rows.csv: EXCEEDED, 1 finding" in (here / "a.svg").read_text()
    assert 'id="panel1-findings"' in (here / "a.svg").read_text()
    assert call(capfd, "check", "rows.csv", "--job", "job.yaml").code == 1
    from_pipe = run("plot", "-", "job.yaml", "-q", "-o", "b.svg", stdin=PEAK.format(rate=95))
    assert from_pipe.code == 1
    assert from_pipe.err.startswith(said.replace("rows.csv", "stdin"))


def test_a_file_is_judged_by_the_values_that_are_set(here: Path, capfd: Capture) -> None:
    (here / "rows.csv").write_text(PEAK.format(rate=95))
    assert call(capfd, "plot", "rows.csv", "job.yaml", "--set", "limits.velocity=96", "-q") == (0, "", "")
    (here / "rows.csv").write_text(PEAK.format(rate=85))
    assert call(capfd, "plot", "rows.csv", "job.yaml") == (0, "", "job.svg written\n")
    assert "EXCEEDED" not in (here / "job.svg").read_text()


def test_a_file_that_cannot_be_judged_is_drawn_and_said(here: Path, capfd: Capture) -> None:
    (here / "rows.csv").write_text("t,qd1_deg\n0,0\n1,30\n")
    code, out, err = call(capfd, "plot", "rows.csv", "job.yaml")
    assert (code, out) == (0, "")
    remark, written = err.splitlines()
    assert remark.startswith("rows.csv is not judged: ")
    assert written == "job.svg written"
    assert call(capfd, "plot", "rows.csv", "job.yaml", "-q") == (0, "", "")


def test_two_jobs_are_drawn_over_each_other_and_both_are_refused(here: Path, capfd: Capture) -> None:
    (here / "fast.yaml").write_text(FAST)
    (here / "quick.svg").write_text(JOB.replace("duration: 1", "duration: 0.5"))
    code, _, err = call(capfd, "plot", "fast.yaml", "quick.svg", "-o", "a.svg")
    assert (code, err.splitlines()[0]) == (1, "a.svg written")
    assert [f"reaches {rate} deg/s" in err for rate in (225, 112.5)] == [True, True]
    text = (here / "a.svg").read_text()
    assert "fast: NOT VERIFIED, 1 finding, 0.25 s; quick: NOT VERIFIED, 1 finding, 0.5 s" in text
    assert 'id="panel0-source1"' in text
    code, _, err = call(capfd, "plot", "job.yaml", "quick.svg", "-o", "quick.svg")
    assert (code, "would overwrite the job quick.svg" in err) == (2, True)


def test_every_file_that_exceeds_the_job_is_refused(here: Path, capfd: Capture) -> None:
    for name, rate in (("one.csv", 95), ("two.csv", 96)):
        (here / name).write_text(PEAK.format(rate=rate))
    code, _, err = call(capfd, "plot", "one.csv", "two.csv", "job.yaml", "-o", "a.svg")
    assert code == 1
    assert [f"{name}: the velocity of j1" in err for name in ("one.csv", "two.csv")] == [True, True]
    assert "one.csv: EXCEEDED, 1 finding; two.csv: EXCEEDED, 1 finding" in (here / "a.svg").read_text()


@pytest.mark.parametrize("files", [("two.yaml",), ("pair.csv", "slow.yaml")])
def test_every_finding_is_told_where_it_is_asked_for(
    files: tuple[str, ...], here: Path, capfd: Capture
) -> None:
    two = JOB.replace("[{velocity: 90}]", "[{velocity: 90}, {velocity: 90}]")
    (here / "slow.yaml").write_text(two)
    (here / "two.yaml").write_text(two.replace("duration: 1", "duration: 0.25"))
    (here / "pair.csv").write_text(
        "t,q1_deg,q2_deg,qd1_deg,qd2_deg\n0,0,0,0,0\n0.5,15,15,95,95\n1,30,30,0,0\n"
    )
    told = {}
    for options in ((), ("--all",), ("--errors", "json")):
        code, _, err = call(capfd, "plot", *files, "-q", "-o", "a.svg", *options)
        assert code == 1
        told[options] = [f"the velocity of {joint} reaches" in err for joint in ("j1", "j2")]
    assert told == {(): [True, False], ("--all",): [True, True], ("--errors", "json"): [True, True]}


def test_messages_that_name_their_joints_are_drawn_by_these_names(here: Path, capfd: Capture) -> None:
    (here / "pair.yaml").write_text(
        "version: 1\nrobot: {joints: [{name: up, velocity: 9}, {name: out, velocity: 9}]}\n"
        "start: {joints: [0, 0]}\nmoves: [{planner: cubic, to: {joints: [1, 2]}, duration: 1}]\n"
    )
    ros = "joint_names: [NAMES]\npoints:\n"
    for second, q in ((0, (0, 0)), (1, (1, 2))):
        ros += f"- {{positions: [{q[0]}, {q[1]}], velocities: [0, 0], time_from_start: {{sec: {second}, nanosec: 0}}}}\n"
    swapped = ros.replace("NAMES", "out, up").replace("[1, 2]", "[2, 1]")
    drawn = []
    for text in (ros.replace("NAMES", "up, out"), swapped):
        (here / "rows.yaml").write_text(text)
        assert call(capfd, "plot", "rows.yaml", "pair.yaml", "-q", "-o", "a.svg") == (0, "", "")
        drawn.append((here / "a.svg").read_bytes())
    assert drawn[0] == drawn[1]


def test_a_third_job_is_advised_as_rows(here: Path, capfd: Capture) -> None:
    for name in ("b.yaml", "c.yaml"):
        (here / name).write_text(JOB)
    code, _, err = call(capfd, "plot", "job.yaml", "b.yaml", "c.yaml")
    assert (code, "trajcli plan c.yaml -o rows.csv" in err) == (2, True)


def test_joints_are_names_beside_standard_input(here: Path, capfd: Capture) -> None:
    done = call(capfd, "plot", "-", "--joints", "j1", "-o", "a.svg", stdin=JOB)
    assert (done.code, done.err) == (0, "a.svg written\n")
    (here / "two").write_text(JOB)
    assert call(capfd, "plot", "two", "--joints", "j1", "-q", "-o", "b.svg").code == 0  # it is there
