"""The workers of a Dask cluster do what the processes of this machine do."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from extras import require_module

from trajcli.batches import cluster as on_workers
from trajcli.batches.task import JobOutcome, Task
from trajcli.cli.app import app

Capture = pytest.CaptureFixture[str]
JOB = """\
version: 1
units: {angle: deg}
robot: {file: arm.yaml}
start: {joints: 0}
moves:
  - {planner: quintic, to: {joints: 30}, duration: 1}
output: {rate: 10, columns: [t, q]}
"""
pytestmark = pytest.mark.filterwarnings("ignore")  # what Dask warns of is not ours


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    require_module("distributed")
    import dask
    from distributed import LocalCluster

    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("jobs").mkdir()
    Path("jobs/arm.yaml").write_text("joints: [{velocity: 2}]\n")
    for name, text in {"a": JOB, "b": JOB, "fast": JOB.replace("duration: 1", "duration: 0.1")}.items():
        Path(f"jobs/{name}.yaml").write_text(text)
    return tmp_path


def run(capfd: Capture, *words: str) -> tuple[int, dict[str, dict[str, Any]], str]:
    """Run a batch; return its exit code, its lines by the stems of the jobs, and standard error."""
    capfd.readouterr()
    with pytest.raises(SystemExit) as left:
        app(["batch", *words])
    out, err = capfd.readouterr()
    values = [json.loads(line) for line in out.splitlines()]
    code: Any = left.value.code
    return code, {Path(value["job"]).stem: value for value in values}, err


def on(capfd: Capture, cluster: Any, *words: str) -> tuple[int, dict[str, dict[str, Any]], str]:
    return run(capfd, *words, "--engine", "dask", "--scheduler", cluster.scheduler_address)


@pytest.mark.usefixtures("folder")
def test_a_cluster_does_what_processes_do(cluster: Any, capfd: Capture) -> None:
    code, found, err = on(capfd, cluster, "jobs", "-o", "out")
    assert code == 1
    assert "3 jobs: 2 written, 1 failed, " in err
    _, expected, _ = run(capfd, "jobs", "-o", "other", "-j", "1")
    for values in (found, expected):
        for value in values.values():
            del value["seconds"]
    text = json.dumps(expected).replace("other/", "out/")
    assert {**found, "fast": None} == {**json.loads(text), "fast": None}
    assert found["fast"]["error"] == expected["fast"]["error"]
    for name in ("a.csv", "b.csv"):
        assert Path("out", name).read_bytes() == Path("other", name).read_bytes()

    def outcomes(of: tuple[int, dict[str, dict[str, Any]], str]) -> set[str]:
        return {value["outcome"] for value in of[1].values()}

    assert outcomes(on(capfd, cluster, "jobs", "-o", "out")) == {"unchanged", "failed"}
    assert outcomes(run(capfd, "jobs", "-o", "out", "-j", "1")) == {"unchanged", "failed"}
    Path("jobs/arm.yaml").write_text("joints: [{velocity: 3}]\n")
    assert outcomes(on(capfd, cluster, "jobs", "-o", "out")) == {"written", "failed"}


@pytest.mark.usefixtures("folder")
def test_a_sweep_is_the_same_table(cluster: Any, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["sweep", "jobs/a.yaml", "--vary", "moves.0.duration=0.1..1:4", "--vary", "name=x,y"]
    engines = (["-j", "2"], ["--engine", "dask", "--scheduler", cluster.scheduler_address])
    tables = []
    for engine in engines:
        with pytest.raises(SystemExit, match=r"^0$"):
            app([*words, *engine])
        tables.append(capfd.readouterr().out)
    assert tables[0] == tables[1]
    assert tables[0].count("exceeded") == 4
    assert tables[0].count("verified") == 4


@pytest.mark.usefixtures("folder")
def test_a_killed_worker_costs_its_own_job(
    cluster: Any, capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    arrived: list[str] = []

    def noted(future: Any, task: Task) -> JobOutcome:
        arrived.append(Path(task.job.job).stem)
        return outcome_of(future, task)

    outcome_of = on_workers._outcome
    monkeypatch.setattr(on_workers, "_outcome", noted)
    Path("jobs/fast.yaml").write_text(
        JOB.replace("rate: 10", "rate: 1e6").replace("duration: 1}", "duration: 1000}")
    )
    killer = Thread(target=kill_when_under_way, args=(cluster, arrived))
    killer.start()
    code, found, _ = on(capfd, cluster, "jobs", "-o", "out")
    killer.join()
    assert (code, found["fast"]["outcome"], found["fast"]["exit"]) == (70, "crashed", 70)
    assert "KilledWorker" in found["fast"]["error"]
    assert set(found) == {"a", "b", "fast"}


def kill_when_under_way(cluster: Any, arrived: list[str]) -> None:
    """Kill the worker once the outcomes of the others have left it, and it writes the job that does not end."""
    end = time.monotonic() + 150
    while not ({*arrived} == {"a", "b"} and list(Path("out").glob(".trajcli-*.part"))):
        assert time.monotonic() < end
        time.sleep(0.05)
    os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)


@pytest.mark.usefixtures("folder")
def test_a_scheduler_that_is_not_there(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    require_module("distributed")
    monkeypatch.setattr("trajcli.batches.cluster._CONNECTING", 0.5)
    with pytest.raises(SystemExit, match=r"^2$"):
        app(["batch", "jobs", "--engine", "dask"])
    out, err = capfd.readouterr()
    assert out == ""
    assert "the engine dask needs the address of a scheduler" in err
    with pytest.raises(SystemExit, match=r"^4$"):
        app(["batch", "jobs", "--engine", "dask", "--scheduler", "tcp://127.0.0.1:9"])
    out, err = capfd.readouterr()
    assert out == ""
    assert "the scheduler tcp://127.0.0.1:9 cannot be reached" in err
    assert "Traceback" not in err


@pytest.mark.usefixtures("folder")
def test_a_cluster_without_workers_is_one_error(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    require_module("distributed")
    from distributed import LocalCluster

    monkeypatch.setattr("trajcli.batches.cluster._CONNECTING", 1.0)
    with LocalCluster(n_workers=0, dashboard_address=None) as empty:
        address = empty.scheduler_address
        words = ("--engine", "dask", "--scheduler", address)
        for command in (["batch", "jobs"], ["sweep", "jobs/a.yaml", "--vary", "moves.0.duration=1,2"]):
            capfd.readouterr()
            with pytest.raises(SystemExit, match=r"^4$"):
                app([*command, *words])
            out, err = capfd.readouterr()
            assert out == ""
            assert f"error: the scheduler {address} has no workers" in err
            assert f"`dask worker {address}` starts one" in err
            assert "standard output" not in err


@pytest.mark.usefixtures("folder")
def test_without_dask_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, capfd: Capture) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)  # as where it is not installed
    code, _, err = run(capfd, "jobs", "--engine", "dask", "--scheduler", "tcp://127.0.0.1:9")
    assert code == 2
    assert "the engine dask needs the packages dask and distributed" in err
    assert "pip install 'trajcli[dask]'" in err
