"""`trajcli batch`: what it writes, what it skips, and that nothing stops it or stays behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from running import COMMAND, ENDLESS, EXAMPLES, FAST, IMPOSSIBLE, JOB, ROOT, SLOWED, begun, call, run
from tiers import few

Capture = pytest.CaptureFixture[str]
ROBOT = "joints: [{velocity: 2}]\n"
OF_FILE = JOB.replace("{joints: [{velocity: 90}]}", "{file: arm.yaml}")
STEM = ".trajcli-batch.json"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("jobs").mkdir()
    return tmp_path


def write(**texts: str) -> None:
    for name, text in texts.items():
        Path(f"jobs/{name}.yaml").write_text(text)


def lines(out: str) -> dict[str, dict[str, Any]]:
    """Return the lines of a batch by the stems of their jobs; all have the same keys."""
    values = [json.loads(line) for line in out.splitlines()]
    keys = ["job", "outcome", "exit", "error", "problems", "duration", "output", "hash", "seconds"]
    assert all(list(value) == keys for value in values)
    return {Path(value["job"]).stem: value for value in values}


def batch(capfd: Capture, *options: str) -> tuple[int, dict[str, str]]:
    """Run a batch of the folder; return its exit code, and the outcome of each job."""
    code, out, _ = call(capfd, "batch", "jobs", "-o", "out", *options)
    return code, {name: line["outcome"] for name, line in lines(out).items()}


def files(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


@pytest.mark.full
def test_examples_are_written_as_plan_writes_them(tmp_path: Path, capfd: Capture) -> None:
    names = ["quintic", "ur5e_pick", "recorded", "moveit_limits", "gantry", "slow"]
    code, out, err = call(
        capfd, "batch", *(EXAMPLES / f"{name}.yaml" for name in names), "-o", tmp_path, "-j", "2"
    )
    found = lines(out)
    assert (code, set(found)) == (0, set(names))
    assert err.startswith("6 jobs: 6 written, ")
    for name, line in found.items():
        assert (line["outcome"], line["exit"], line["error"], line["problems"]) == ("written", 0, None, [])
        assert line["output"] == str(tmp_path / f"{name}.csv")
        assert Path(line["output"]).read_bytes() == (ROOT / f"tests/golden/{name}.csv").read_bytes()
        assert len(line["hash"]) == 64
        assert line["seconds"] > 0
    assert files(str(tmp_path)) == {f"{name}.csv" for name in names} | {STEM}
    assert found["quintic"]["duration"] == 4


def test_a_folder_beside_its_jobs_in_another_format(folder: Path, capfd: Capture) -> None:
    Path("jobs/deep").mkdir()
    write(a=JOB, **{"deep/b": JOB})
    Path("jobs/arm.yaml").write_text(ROBOT)
    code, out, err = call(capfd, "batch", "jobs", "--format", "jsonl")
    assert (code, {line["output"] for line in lines(out).values()}) == (
        0,
        {"jobs/a.jsonl", "jobs/deep/b.jsonl"},
    )
    assert "no jobs, left out: jobs/arm.yaml\n" in err
    assert json.loads(Path("jobs/a.jsonl").read_text().splitlines()[0])["q"] == [0]


@pytest.mark.full
def test_only_what_changed_is_planned(folder: Path, capfd: Capture) -> None:
    write(a=JOB, b=OF_FILE, c=OF_FILE.replace("arm", "other"))
    for name in ("arm", "other"):
        Path(f"jobs/{name}.yaml").write_text(ROBOT)
    assert batch(capfd) == (0, dict.fromkeys("abc", "written"))
    made = Path("out/a.csv").stat().st_mtime_ns
    assert batch(capfd) == (0, dict.fromkeys("abc", "unchanged"))
    assert Path("out/a.csv").stat().st_mtime_ns == made
    Path("jobs/arm.yaml").write_text(ROBOT.replace("2", "3"))
    assert batch(capfd) == (0, {"a": "unchanged", "b": "written", "c": "unchanged"})
    write(a=JOB.replace("duration: 1", "duration: 2"))
    assert batch(capfd)[1] == {"a": "written", "b": "unchanged", "c": "unchanged"}
    Path("out/b.csv").write_text(Path("out/b.csv").read_text()[:-1])
    Path("out/c.csv").unlink()
    assert batch(capfd)[1] == {"a": "unchanged", "b": "written", "c": "written"}
    assert batch(capfd, "--force")[1] == dict.fromkeys("abc", "written")
    Path(f"out/{STEM}").write_text("{")
    assert batch(capfd)[1] == dict.fromkeys("abc", "written")
    assert batch(capfd)[1] == dict.fromkeys("abc", "unchanged")


def test_files_count_from_the_folder_of_their_job(
    folder: Path, capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("one", "two"):
        Path(name).mkdir()
        Path(name, "a.yaml").write_text(OF_FILE)
        Path(name, "arm.yaml").write_text(ROBOT)
    monkeypatch.chdir("one")
    assert lines(call(capfd, "batch", ".").out)["a"]["outcome"] == "written"
    monkeypatch.chdir("../two")
    assert lines(call(capfd, "batch", "../one").out)["a"]["outcome"] == "unchanged"
    Path("../one/arm.yaml").write_text(ROBOT.replace("2", "0.01"))
    assert lines(call(capfd, "batch", "../one").out)["a"]["outcome"] == "failed"


def test_other_formats_are_not_unchanged(folder: Path, capfd: Capture) -> None:
    write(a=JOB)
    assert batch(capfd, "--format", "ros")[1] == {"a": "written"}
    assert batch(capfd, "--format", "ros")[1] == {"a": "unchanged"}
    assert batch(capfd, "--format", "ros-goal")[1] == {"a": "written"}
    assert "FollowJointTrajectory" in Path("out/a.yaml").read_text()


@pytest.mark.parametrize("key", ["csv", "urdf", "limits"])
def test_files_of_every_kind_count(key: str, folder: Path, capfd: Capture) -> None:
    source = {
        "csv": ("recorded.yaml", "recordings/lead_through.csv", b"\n\n"),
        "limits": ("moveit_limits.yaml", "moveit/joint_limits.yaml", b"\n# more\n"),
        "urdf": (None, None, b"<!-- more -->"),
    }[key]
    if source[0] is None:
        code, urdf, _ = call(capfd, "robots", "ur5e", "--urdf")
        assert code == 0
        named = Path("jobs/arm.urdf")
        named.write_text(urdf)
        write(
            a="version: 1\nrobot: {urdf: arm.urdf}\nstart: {joints: 0}\nmoves: [{planner: hold, duration: 1}]\n"
        )
    else:
        named = Path("jobs") / source[1]  # type: ignore[operator]
        named.parent.mkdir()
        named.write_bytes((EXAMPLES / source[1]).read_bytes())  # type: ignore[operator]
        write(a=(EXAMPLES / source[0]).read_text())
    assert batch(capfd)[1] == {"a": "written"}
    assert batch(capfd)[1] == {"a": "unchanged"}
    with named.open("ab") as file:
        file.write(source[2])
    assert batch(capfd)[1] == {"a": "written"}


def test_one_broken_job_never_stops_the_others(folder: Path, capfd: Capture) -> None:
    write(a=JOB, fast=FAST, impossible=IMPOSSIBLE, junk="moves: [\n", z=JOB)
    Path("jobs/bytes.yaml").write_bytes(b"version: 1\xff\x00")
    Path("jobs/folder.yaml").mkdir()
    code, out, err = call(capfd, "batch", "jobs", "none.yaml", "-o", "out")
    found = lines(out)
    assert code == 4
    exits = {"a": 0, "z": 0, "fast": 1, "junk": 2, "bytes": 2, "impossible": 3, "none": 4}
    assert {name: line["exit"] for name, line in found.items()} == exits
    assert {line["outcome"] for name, line in found.items() if exits[name]} == {"failed"}
    assert "the velocity of j1 reaches 225 deg/s" in found["fast"]["error"]
    (problem,) = found["fast"]["problems"]
    assert (problem["file"], problem["line"], problem["joint"]) == ("jobs/fast.yaml", 6, "j1")
    assert found["fast"]["output"] is found["fast"]["duration"] is None
    assert files("out") == {"a.csv", "z.csv", STEM}
    *named, last = err.splitlines()
    assert sorted(line.split(": ")[0] for line in named) == sorted(
        [*(f"jobs/{name}.yaml" for name in ("bytes", "fast", "impossible", "junk")), "none.yaml"]
    )
    assert "jobs/fast.yaml: failed: move 0 (quintic): the velocity of j1 reaches 225 deg/s" in err
    assert last.startswith("7 jobs: 5 failed, 2 written, ")


def test_rows_of_a_job_that_fails_now_are_set_aside(folder: Path, capfd: Capture) -> None:
    write(a=JOB)
    assert batch(capfd)[0] == 0
    kept = Path("out/a.csv").read_bytes()
    write(a=FAST)
    failed = call(capfd, "batch", "jobs", "-o", "out", "--force")
    assert "  out/a.csv was of an earlier batch: it is out/a.csv.stale now\n" in failed.err
    assert batch(capfd) == (1, {"a": "failed"})
    assert Path("out/a.csv.stale").read_bytes() == kept
    assert files("out") == {"a.csv.stale", STEM}
    write(a=JOB)
    assert batch(capfd) == (0, {"a": "written"})
    assert files("out") == {"a.csv", STEM}
    assert Path("out/a.csv").read_bytes() == kept


def test_a_file_that_no_batch_wrote_stays(folder: Path, capfd: Capture) -> None:
    write(a=JOB)
    assert batch(capfd)[0] == 0
    write(a=FAST, b=FAST)
    for name in ("a.csv", "b.csv", "a.csv.stale"):
        Path(f"out/{name}").write_text("of somebody else")
    assert batch(capfd)[0] == 1
    assert files("out") == {"a.csv", "b.csv", "a.csv.stale", STEM}
    write(a=JOB, b=JOB)
    assert batch(capfd)[0] == 0
    assert Path("out/a.csv.stale").read_text() == "of somebody else"


def test_annotations_of_a_batch_are_one_document(folder: Path, capfd: Capture) -> None:
    write(a=JOB, fast=FAST, junk="moves: [\n")
    code, out, err = call(capfd, "batch", "jobs", "-o", "out", "--errors", "junit")
    assert (code, len(lines(out))) == (2, 3)
    suites = {suite.get("name"): suite.get("failures") for suite in ET.fromstring(err.encode())}
    assert suites == {"jobs/a.yaml": "0", "jobs/fast.yaml": "1", "jobs/junk.yaml": "1"}
    results = json.loads(call(capfd, "batch", "jobs", "-o", "out", "--errors", "sarif").err)["runs"][0][
        "results"
    ]
    assert {one["ruleId"] for one in results} == {"velocity", "input"}
    commands = call(capfd, "batch", "jobs", "-o", "out", "--errors", "github").err.splitlines()
    assert sorted(line.split(",")[0] for line in commands) == [
        "::error file=jobs/fast.yaml",
        "::error file=jobs/junk.yaml",
    ]
    told = [
        json.loads(line)
        for line in call(capfd, "batch", "jobs", "-o", "o", "-q", "--errors", "json").err.splitlines()
    ]
    assert sorted(one["exit"] for one in told) == [1, 2]


def test_events_fail_a_job_that_is_strict(folder: Path, capfd: Capture) -> None:
    write(a=JOB, slow=SLOWED)
    assert batch(capfd) == (0, {"a": "written", "slow": "written"})
    code, out, _ = call(capfd, "batch", "jobs", "-o", "out", "--strict")
    found = lines(out)
    assert (code, found["a"]["outcome"], found["slow"]["outcome"]) == (1, "written", "failed")
    assert found["slow"]["error"].startswith("slowed: stretched 2.5 times")
    assert call(capfd, "plan", "jobs/slow.yaml", "--no-output", "--strict").code == 1


@pytest.mark.usefixtures("folder")
def test_a_job_that_reads_the_output_of_another_is_refused(capfd: Capture) -> None:
    write(a=JOB, b=JOB.replace("moves:\n", "moves:\n  - {planner: spline, through: {csv: a.csv}}\n"))
    code, out, _ = call(capfd, "batch", "jobs")
    found = lines(out)
    assert (code, found["a"]["exit"], found["b"]["exit"]) == (2, 0, 2)
    assert found["b"]["error"] == "the recording jobs/a.csv is the output of jobs/a.yaml in this batch"


WRONG = [
    (("jobs", "-j", "0"), "-j expects 1 to 1024 processes, got '0'"),
    (("jobs", "-j", 5000 * "9"), "-j expects 1 to 1024 processes, got '999"),
    (("jobs", "-j", "two"), "-j expects"),
    (("jobs", "--timeout", "soon"), "--timeout expects seconds, got 'soon'"),
    (("jobs", "--timeout", "inf"), "--timeout expects seconds"),
    (("jobs", "--scheduler", "tcp://x:1"), "--scheduler is about a cluster"),
    (("jobs", "--engine", "dask", "-j", "2"), "-j is about processes of this machine"),
    (("jobs", "jobs/a.yaml", "-o", "out"), "would both be written to out/a.csv"),
    (("jobs", "--format", "ros"), "would overwrite jobs/a.yaml"),
    (("-",), "a batch reads no standard input"),
    (("jobs", "--for", "ros-jct"), "there is no profile 'ros-jct'\n  did you mean 'ros-jtc'?"),
]


@pytest.mark.parametrize(("words", "message"), WRONG)
@pytest.mark.usefixtures("folder")
def test_a_wrong_batch_is_2_and_nothing_begins(words: tuple[str, ...], message: str, capfd: Capture) -> None:
    write(a=JOB)
    code, out, err = call(capfd, "batch", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert files(".") == {"jobs"}
    assert files("jobs") == {"a.yaml"}


@pytest.mark.usefixtures("folder")
def test_a_consumer_that_nobody_has_costs_no_rows(capfd: Capture) -> None:
    """Rows of jobs whose files are wrong are set aside; here no file is."""
    write(a=JOB)
    assert batch(capfd) == (0, {"a": "written"})
    before = files("out")
    assert call(capfd, "batch", "jobs", "-o", "out", "--for", "nobody").code == 2
    assert files("out") == before
    assert batch(capfd) == (0, {"a": "unchanged"})


def test_an_output_folder_that_is_a_file(folder: Path, capfd: Capture) -> None:
    write(a=JOB)
    Path("out").write_text("kept")
    code, out, _ = call(capfd, "batch", "jobs", "-o", "out")
    assert (code, "cannot make the folder 'out'" in lines(out)["a"]["error"]) == (4, True)
    assert Path("out").read_text() == "kept"


def children(pid: int) -> list[int]:
    """Return the processes that a process has begun and that are alive."""
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()]


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(condition: Callable[[], Any], seconds: float = 20.0) -> Any:
    """Wait until a condition holds, and return it."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)
    return value


def parts() -> list[Path]:
    return list(Path("out").glob(".trajcli-*.part")) if Path("out").is_dir() else []


def both_under_way() -> bool:
    """Return whether the quick job is written, and both others are."""
    return Path("out/a.csv").exists() and len(parts()) == 2


def begin(*options: str) -> subprocess.Popen[bytes]:
    """Begin a batch of jobs of which two do not end."""
    write(
        a=JOB,
        long=ENDLESS.replace("duration: 1", "duration: 1000"),
        longer=ENDLESS.replace("duration: 1", "duration: 2000"),
    )
    return begun("batch", "jobs", "-o", "out", "-j", "2", *options, start_new_session=True)


@pytest.mark.parametrize(("number", "code"), few([(signal.SIGINT, 130), (signal.SIGTERM, 143)], 1))
@pytest.mark.usefixtures("folder")
def test_an_interrupt_leaves_no_half_file_and_no_process(number: int, code: int) -> None:
    process = begin()
    until(both_under_way)
    workers = children(process.pid)
    assert len(workers) == 2
    process.send_signal(number)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (code, b"")
    assert [json.loads(line)["outcome"] for line in out.splitlines()] == ["written"]
    assert not any(map(alive, workers))
    assert files("out") == {"a.csv", STEM}


@pytest.mark.usefixtures("folder")
def test_a_terminal_interrupts_all_processes_at_once() -> None:
    process = begin()
    until(both_under_way)
    workers = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, b"")
    assert not any(map(alive, workers))
    assert files("out") == {"a.csv", STEM}


@pytest.mark.usefixtures("folder")
def test_no_process_outlives_the_one_that_began_it() -> None:
    process = begin()
    until(both_under_way)
    workers = children(process.pid)
    process.kill()
    process.communicate(timeout=30)
    until(lambda: not any(map(alive, workers)))
    assert parts() == []


@pytest.mark.usefixtures("folder")
def test_killed_workers_and_endless_jobs_cost_their_own_job() -> None:
    process = begin("--timeout", "2")
    until(both_under_way)
    os.kill(children(process.pid)[0], signal.SIGKILL)
    out, _ = process.communicate(timeout=60)
    found = lines(out.decode())
    assert process.returncode == 70
    assert sorted(line["outcome"] for line in found.values()) == ["crashed", "timed out", "written"]
    assert {line["exit"] for line in found.values()} == {0, 3, 70}
    assert files("out") == {"a.csv", STEM}


@pytest.mark.usefixtures("folder")
def test_a_closed_pipe_is_141_and_ends_all() -> None:
    process = begin()
    until(both_under_way)
    workers = children(process.pid)
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    os.kill(workers[0], signal.SIGKILL)  # its job is done with a line, which nobody reads
    assert (process.wait(30), process.stderr.read()) == (141, b"")
    process.stderr.close()
    assert not any(map(alive, workers))
    assert parts() == []


@pytest.mark.full
@pytest.mark.usefixtures("folder")
def test_progress_on_a_terminal_only() -> None:
    pty = pytest.importorskip("pty")
    write(**{f"job{number}": JOB for number in range(12)})
    ours, theirs = pty.openpty()
    words = [*COMMAND, "batch", "jobs", "-o", "out"]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=theirs, timeout=60, check=True)
    os.close(theirs)
    shown = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert "\r\x1b[2K11 of 12 jobs: 11 written, " in shown
    assert shown.rpartition("\x1b[2K")[2].startswith("12 jobs: 12 written, ")
    assert len(done.stdout.splitlines()) == 12
    outcome = run("batch", "jobs", "-o", "out", "-q")
    assert (outcome.code, outcome.err) == (0, "")
