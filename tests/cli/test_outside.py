"""What the world does to a command: closed streams, signals, a reader that stops.

Oracle: what a shell sees, in processes of their own.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from running import ENDLESS, FAST, JOB, LONG, Outcome, begun, call, warm
from tiers import few

SIGNALS = [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)]
TRAJCLI = " ".join([sys.executable, "-m", "trajcli"])


def shell(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of a shell, in which `trajcli` is the command: a fresh process where streams are closed or signals come."""
    line = command.replace("trajcli", TRAJCLI if "&-" in command or "kill" in command else warm()[0])
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, text=True, cwd=folder, timeout=60, check=False
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "job.yaml").write_text(JOB)
    (tmp_path / "fast.yaml").write_text(FAST)
    (tmp_path / "endless.yaml").write_text(ENDLESS.replace("1e6", "3e5"))
    return tmp_path


@pytest.fixture
def rows(folder: Path, capfd: pytest.CaptureFixture[str]) -> str:
    return call(capfd, "plan", folder / "job.yaml", "-q").out


@pytest.mark.full
def test_rows_hold_no_summary_where_standard_error_is_closed(folder: Path, rows: str) -> None:
    for line in ("trajcli plan job.yaml 2>&-", "trajcli plan job.yaml <&- 2>&-"):
        done = shell(line, folder)
        assert (done.returncode, done.stdout) == (0, rows)
    done = shell("trajcli plan job.yaml -o a.csv 2>&-", folder)
    assert (done.returncode, done.stdout) == (0, "")
    assert (folder / "a.csv").read_text() == rows
    done = shell("trajcli plan fast.yaml 2>&-", folder)
    assert (done.returncode, done.stdout) == (1, "")


@pytest.mark.parametrize(
    "words", few(["plan job.yaml", "--help", "--version", "fk --help", "robots ur5e", "schema"], 2)
)
@pytest.mark.parametrize("stream", ["&-", "/dev/full"])
def test_a_closed_or_full_standard_output_is_4(folder: Path, words: str, stream: str) -> None:
    done = shell(f"trajcli {words} >{stream}", folder)
    reason = "it is closed" if stream == "&-" else "No space left on device"
    assert (done.returncode, done.stdout) == (4, "")
    assert done.stderr == f"error: cannot write standard output: {reason}\n"


@pytest.mark.full
def test_rows_in_a_file_need_no_stream(folder: Path, rows: str) -> None:
    done = shell("trajcli plan job.yaml -o a.csv <&- >&- 2>&-", folder)
    assert done.returncode == 0
    assert (folder / "a.csv").read_text() == rows


@pytest.mark.parametrize("line", ["trajcli plan - <&-", "trajcli diff - job.yaml <&-"])
def test_a_closed_standard_input_is_4(folder: Path, line: str) -> None:
    done = shell(line, folder)
    assert done.returncode == 4
    assert done.stderr.startswith(("error: standard input cannot be read", "error: cannot read stdin"))
    assert "Traceback" not in done.stderr


def test_a_full_standard_error_changes_nothing_but_the_code(folder: Path, rows: str) -> None:
    done = shell("trajcli plan job.yaml 2>/dev/full", folder)
    assert (done.returncode, done.stdout) == (4, rows)


@pytest.mark.parametrize("words", ["--help", "plan --help", "--version"])
def test_help_that_nobody_reads_is_141(words: str) -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([*warm(), *words.split()], stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


def started(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    """Start a command that writes without end into `a.csv`, and wait until it does."""
    process = begun(*words, cwd=folder)
    until = time.monotonic() + 30
    while not any(part.stat().st_size for part in folder.glob(".*.part")):
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.005)
    return process


@pytest.mark.parametrize(("number", "code"), few(SIGNALS, 1))
def test_a_signal_leaves_no_half_file(folder: Path, number: signal.Signals, code: int) -> None:
    (folder / "a.csv").write_text("old")
    before = sorted(path.name for path in folder.iterdir())
    process = started(folder, "plan", "endless.yaml", "-o", "a.csv", "--report", "r.json")
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (code, b"", b"")
    assert sorted(path.name for path in folder.iterdir()) == before  # no report without its rows either
    assert (folder / "a.csv").read_text() == "old"


@pytest.mark.parametrize(("number", "code"), few(SIGNALS, 1))
def test_a_signal_ends_a_command_whose_reader_has_stopped(
    folder: Path, number: signal.Signals, code: int
) -> None:
    (folder / "long.yaml").write_text(LONG)
    process = begun("plan", "long.yaml", "-q", cwd=folder)
    assert process.stdout is not None
    assert os.read(process.stdout.fileno(), 9) == b"t,q1_deg\n"
    time.sleep(0.2)  # it waits for us to read on
    process.send_signal(number)
    try:
        assert process.wait(timeout=10) == code
    finally:
        process.kill()
        _, err = process.communicate()
    assert err == b""


@pytest.mark.full
def test_a_hangup_that_is_ignored_stays_ignored(folder: Path) -> None:
    """As `nohup` asks for."""
    (folder / "long.yaml").write_text(ENDLESS.replace("1e6", "1e5"))
    line = "trap '' HUP; trajcli plan long.yaml -o a.csv & wait_for=$!; sleep 0.4; kill -HUP $wait_for; wait $wait_for"
    assert shell(line, folder).returncode == 0
    assert (folder / "a.csv").exists()


def test_rows_that_cannot_be_written_leave_no_report(folder: Path) -> None:
    done = shell("trajcli plan job.yaml --report r.json > /dev/full", folder)
    assert done.returncode == 4
    assert not (folder / "r.json").exists()


def test_a_refused_plan_has_a_report(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    job, report = tmp_path / "fast.yaml", tmp_path / "r.json"
    job.write_text(FAST)
    assert call(capfd, "plan", job, "--report", report).code == 1
    assert '"verdict": "violated"' in report.read_text()


ROBOT = "joints: [{velocity: 2}]\n"
OWN_FILES = JOB.replace("{joints: [{velocity: 90}]}", "{file: arm.yaml}").replace(
    "planner: quintic, to: {joints: 30}, duration: 1",
    "planner: spline, through: {csv: points.csv}, duration: 1",
)
OVERWRITES = [
    ("trajcli plan own.yaml -o points.csv", "the rows", "the recording"),
    ("trajcli plan own.yaml --report arm.yaml", "--report", "the robot's file"),
    ("trajcli plan own.yaml --report ./own.yaml", "--report", "the job"),
    ("trajcli plan own.yaml --resolved soft.yaml", "--resolved", "the job"),
    ("trajcli plan own.yaml --resolved hard.yaml", "--resolved", "the job"),
    ("trajcli plan own.yaml -o soft.csv", "the rows", "the job"),
    ("trajcli sweep own.yaml --vary moves.0.duration=1,2 -o points.csv", "the table", "the recording"),
    ("trajcli sweep own.yaml --vary moves.0.duration=1,2 --plot own.svg", "the picture", "the recording"),
    ("trajcli retime rows.csv --job own.yaml -o points.csv", "-o", "the recording"),
    ("trajcli retime rows.csv --robot own.yaml -o points.csv", "-o", "the recording"),
    ("trajcli plan - --report job.yaml < job.yaml", "--report", "the job"),
    ("trajcli plan ../$(basename $PWD)/own.yaml -q >> own.yaml", "the rows", "the job"),
]


@pytest.mark.parametrize(("line", "output", "overwritten"), OVERWRITES)
def test_an_output_never_overwrites_what_was_read(
    folder: Path,
    line: str,
    output: str,
    overwritten: str,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    (folder / "own.yaml").write_text(OWN_FILES)
    (folder / "arm.yaml").write_text(ROBOT)
    (folder / "points.csv").write_text("q1\n0\n0.2\n")
    (folder / "soft.yaml").symlink_to("own.yaml")
    (folder / "soft.csv").symlink_to("own.yaml")
    (folder / "own.svg").symlink_to("points.csv")
    (folder / "hard.yaml").hardlink_to(folder / "own.yaml")
    assert call(capfd, "plan", "own.yaml", "--no-output").code == 0
    before = {path: path.read_bytes() for path in folder.iterdir()}
    if ">" in line or "<" in line:  # what the shell has opened is known by its number
        done = shell(line, folder)
        outcome = Outcome(done.returncode, done.stdout, done.stderr)
    else:
        outcome = call(capfd, *line.split()[1:])
    assert outcome.code == 2
    assert outcome.err.startswith(f"error: {output} to ")
    assert f" would overwrite {overwritten} " in outcome.err
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    "words",
    [
        "-o a.csv --report link.csv",
        "-o old.csv --report hard.csv",
        "-o ./a.csv --resolved jobs/../a.csv",
        "--report /dev/stdout",
        "-o /dev/stdout --report /dev/fd/1",
        "--report out.txt > out.txt",
    ],
)
def test_two_outputs_never_share_a_file(
    folder: Path, words: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "jobs").mkdir()
    (folder / "link.csv").symlink_to("a.csv")
    (folder / "old.csv").write_text("old")
    (folder / "hard.csv").hardlink_to(folder / "old.csv")
    if ">" in words or "/dev" in words:
        done = shell(f"trajcli plan job.yaml {words}", folder)
        outcome = Outcome(done.returncode, done.stdout, done.stderr)
    else:
        outcome = call(capfd, "plan", "job.yaml", *words.split())
    assert outcome.code == 2
    assert " cannot both go to " in outcome.err
    assert not (folder / "a.csv").exists()
    assert (folder / "old.csv").read_text() == "old"


def test_devices_take_several_outputs(folder: Path, rows: str) -> None:
    assert shell("trajcli plan job.yaml -o /dev/null --report /dev/null", folder).returncode == 0
    done = shell("trajcli plan job.yaml -q -o /dev/stdout --report r.json", folder)
    assert (done.returncode, done.stdout) == (0, rows)
