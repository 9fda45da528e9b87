"""`trajcli plot`: which file it writes, from what, and what it refuses."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from running import EXAMPLES, FAST, JOB, call, run, warm

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


@pytest.mark.parametrize(("name", "begins"), [("a.svg", b"<?xml"), ("a.png", b"\x89PNG"), ("a.PDF", b"%PDF")])
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
