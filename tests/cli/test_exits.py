"""Exit codes and streams, in processes of their own."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from running import COMMAND, EXAMPLES, FAST, IMPOSSIBLE, JOB, LONG, ROOT, SLOWED, begun, call, run, warm

Capture = pytest.CaptureFixture[str]

HEADER = "t,q1_deg\n"


def test_a_job_from_standard_input_to_standard_output() -> None:
    code, out, err = run("plan", "-", stdin=JOB, fresh=True)
    assert code == 0
    assert out.splitlines()[0] == HEADER.strip()
    assert out.splitlines()[-1] == "1.000000000,30.000000000"
    assert len(out.splitlines()) == 12
    assert err.startswith("stdin: verified, 1 move, 1 s, 11 rows\n")


CODES = [
    (JOB, (), 0, ""),
    (FAST, (), 1, "the velocity of j1 reaches 225 deg/s at t = 0.125 s, its limit is 90 deg/s"),
    (SLOWED, ("--strict",), 1, "slowed: stretched 2.5 times"),
    (JOB.replace("quintic", "quintc"), (), 2, "unknown planner 'quintc'"),
    (
        JOB.replace("quintic", "jerk_limited").replace(", duration: 1", ""),
        (),
        2,
        "needs a limit on the acceleration",
    ),
    (IMPOSSIBLE, (), 3, "no trapezoid of 1 s"),
    (JOB, ("-o", "/no/such/folder/a.csv"), 4, "cannot write /no/such/folder/a.csv"),
]


@pytest.mark.parametrize(("job", "options", "code", "message"), CODES)
def test_exit_codes(job: str, options: tuple[str, ...], code: int, message: str, capfd: Capture) -> None:
    alone = options == () and code < 3  # in a process of its own
    words = ("plan", "-", *options)
    outcome = run(*words, stdin=job) if alone else call(capfd, *words, stdin=job)
    assert outcome.code == code
    assert message in outcome.err
    assert outcome.out.startswith(HEADER) if code == 0 else outcome.out == ""
    assert "Traceback" not in outcome.err


def test_a_missing_file_and_no_arguments(capfd: Capture) -> None:
    code, out, err = call(capfd, "plan", "no.yaml")
    assert (code, out) == (4, "")
    assert "there is no file 'no.yaml'" in err
    code, out, err = call(capfd, "plan")
    assert (code, out) == (2, "")
    assert "Missing argument 'JOB'" in err


@pytest.mark.parametrize(
    "words",
    [
        "check @",
        "diff @ b.csv",
        "diff a b @",
        "fk -r @ 0",
        "batch @",
        "robots @",
        "init @",
        "view a.csv --robot @",
    ],
)
def test_names_that_are_too_long_are_no_bug(words: str, capfd: Capture) -> None:
    outcome = call(capfd, *words.replace("@", "n" * 300).split())
    assert outcome.code in (2, 4)
    assert "error: " in outcome.err or "failed: " in outcome.err


def test_an_interrupt_is_130(tmp_path: Path) -> None:
    pipe = tmp_path / "rows"
    os.mkfifo(pipe)
    job = tmp_path / "job.yaml"
    job.write_text(LONG)
    words = [*COMMAND, "plan", str(job), "-q", "-o", str(pipe)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    with pipe.open("rb") as rows:
        assert rows.read(len(HEADER)) == HEADER.encode()  # it writes now, and waits for us to read on
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, out, err) == (130, b"", b"")


def test_a_closed_pipe_is_141_and_silent(tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(LONG)
    process = begun("plan", job, "-q")
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdout.readline() == HEADER.encode()
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait(timeout=30) == 141


@pytest.mark.parametrize("job", [JOB, FAST])
def test_errors_that_nobody_reads_are_141(job: str) -> None:
    read, write = os.pipe()
    os.close(read)
    words = [*warm(), "plan", "-", "--no-output"]
    done = subprocess.run(
        words, input=job.encode(), stderr=write, stdout=subprocess.PIPE, timeout=60, check=False
    )
    os.close(write)
    assert (done.returncode, done.stdout) == (141, b"")


def test_a_full_disk_is_4() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("without /dev/full")
    with Path("/dev/full").open("w") as full:
        words = [*warm(), "plan", str(EXAMPLES / "cubic.yaml")]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False)
    assert done.returncode == 4
    assert "cannot write standard output: No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_main_example_as_it_is_typed() -> None:
    outcome = run("plan", "examples/ur5e_pick.yaml", cwd=ROOT, fresh=True)
    assert outcome.code == 0
    assert outcome.out == (ROOT / "tests/golden/ur5e_pick.csv").read_text()


def test_no_color_where_nobody_looks() -> None:
    for environment in ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, {"TERM": "xterm-256color"}):
        assert "\x1b" not in run("plan", "-", stdin=FAST, env={**os.environ, **environment}).err
    assert "\x1b[1;31merror:" in run("plan", "-", stdin=FAST, env={**os.environ, "FORCE_COLOR": "1"}).err


def test_full_digits_are_bit_exact(capfd: Capture) -> None:
    import numpy as np

    from trajcli.job.read import job_from_text
    from trajcli.planning.plan import plan_job

    job = JOB.replace("{angle: deg}", "{}").replace("joints: 30", "joints: 0.7")
    code, out, _ = call(capfd, "plan", "-", "--digits", "full", stdin=job)
    assert code == 0
    rows = np.array([[float(value) for value in line.split(",")] for line in out.splitlines()[1:]])
    curve = plan_job(job_from_text(job)).trajectory.curve
    assert np.array_equal(rows[:, 0], np.arange(11) / 10)
    assert np.array_equal(rows[:, 1], curve.evaluate(rows[:, 0])[:, 0])
