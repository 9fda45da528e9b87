"""Ledgers of the folders of a batch: whose rows are whose, and which are put aside."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from trajcli.batches import jobs
from trajcli.batches.jobs import BatchJob, BatchJobs, Ledgers, find_jobs
from trajcli.batches.ledger import LEDGER_NAME, LedgerEntry, hash_of_inputs, read_ledger
from trajcli.errors import InputError


def written(path: Path, text: str) -> LedgerEntry:
    """Write rows, and return what a ledger says of them."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return LedgerEntry(f"inputs of {path.name}", ("a.yaml",), hashlib.sha256(text.encode()).hexdigest(), 1.5)


@pytest.fixture
def two(tmp_path: Path) -> list[BatchJob]:
    """Two jobs of one name, whose rows go to two folders that are not theirs, and a third beside the first."""
    names = (("a/p.yaml", "out/a/p.csv"), ("b/p.yaml", "out/b/p.csv"), ("a/q.yaml", "out/a/q.csv"))
    return [BatchJob(str(tmp_path / job), str(tmp_path / rows)) for job, rows in names]


def test_entries_stand_in_the_ledger_beside_their_rows(two: list[BatchJob], tmp_path: Path) -> None:
    entries = {job.output: written(Path(job.output), job.job) for job in two}
    record = Ledgers(two)
    assert record.entries() == {}
    for job in two:
        record.add(job, entries[job.output])
    assert not list(tmp_path.rglob(LEDGER_NAME))  # a batch of five seconds writes them once
    record.write()
    assert read_ledger(tmp_path / "out/a" / LEDGER_NAME).keys() == {"p.csv", "q.csv"}
    assert read_ledger(tmp_path / "out/b" / LEDGER_NAME).keys() == {"p.csv"}
    assert Ledgers(two).entries() == entries


def test_a_long_batch_writes_its_ledgers_on_the_way(
    two: list[BatchJob], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = Ledgers(two)
    monkeypatch.setattr(jobs, "monotonic", lambda: 1e12)
    record.add(two[0], written(Path(two[0].output), "t\n"))
    assert (tmp_path / "out/a" / LEDGER_NAME).exists()


def test_rows_that_a_batch_did_not_write_are_left_alone(two: list[BatchJob]) -> None:
    """Rows of an earlier batch are put aside where there are no new ones; those of somebody else stay."""
    ours, theirs, none = two
    record = Ledgers(two)
    for job in (ours, theirs):
        record.add(job, written(Path(job.output), f"t\n{job.job}\n"))
    record.write()
    Path(theirs.output).write_text("t\nby hand\n", encoding="utf-8")
    again = Ledgers(two)
    assert again.set_aside(none) is None
    assert again.set_aside(theirs) is None
    assert Path(theirs.output).read_text(encoding="utf-8") == "t\nby hand\n"
    stale = again.set_aside(ours)
    assert stale == f"{ours.output}.stale"
    assert not Path(ours.output).exists()
    assert Path(stale).exists()
    foreign = Path(f"{theirs.output}.stale")
    foreign.write_text("mine", encoding="utf-8")
    for job in (ours, theirs):
        again.add(job, written(Path(job.output), "t\nnew\n"))
    assert not Path(stale).exists()
    assert foreign.read_text(encoding="utf-8") == "mine"


def test_the_owner_of_an_output_is_found_by_its_real_path(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    found = BatchJobs((BatchJob("a.yaml", str(tmp_path / "link/a.csv")),), ())
    assert found.owners() == {os.path.realpath(tmp_path / "real/a.csv"): "a.yaml"}


JOB = "robot: ur5e\nmoves: []\n"


def test_folders_are_searched_for_jobs_as_far_as_they_are_not_hidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies in a hidden folder is searched where that is named, and what is below it likewise."""
    for name in (
        ".cell/a.YAML",
        ".cell/.git/b.yaml",
        ".cell/deep/.c.yaml",
        ".cell/deep/.svn/x/d.yaml",
        ".cell/out/e.yaml",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(JOB, encoding="utf-8")
    (tmp_path / ".cell/folder.yaml").mkdir()
    monkeypatch.chdir(tmp_path)
    found = find_jobs([".cell"], None, "csv")
    assert found.jobs == (
        BatchJob(".cell/a.YAML", ".cell/a.csv"),
        BatchJob(".cell/out/e.yaml", ".cell/out/e.csv"),
    )
    assert found.no_jobs == ()
    assert [job.job for job in find_jobs([".cell"], ".cell/out", "csv").jobs] == [".cell/a.YAML"]
    assert len(find_jobs([".cell"], ".cell", "csv").jobs) == 2


@pytest.mark.parametrize(
    ("text", "is_job"),
    [
        ("start: home\n", True),
        ("a: 1\nversion: 1\n", True),
        ("  {\n version: 1}", True),
        ('{"robot": 1, "moves": []}', True),
        ("'start': home\n", True),
        ("robot: {start: 1}\n", False),
        ("sequence:\n  moves: []\n", False),
        ("starter: 1\n", False),
        ("note: 'start'\n", False),
    ],
)
def test_a_job_has_a_key_that_only_jobs_have(text: str, is_job: bool, tmp_path: Path) -> None:
    (tmp_path / "file.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "sure.yaml").write_text(JOB, encoding="utf-8")
    found = find_jobs([str(tmp_path)], None, "csv")
    assert (len(found.jobs) == 2) == is_job
    assert len(found.jobs) + len(found.no_jobs) == 2


def test_a_file_that_cannot_be_read_is_a_job_so_that_planning_says_why(tmp_path: Path) -> None:
    (tmp_path / "gone.yaml").symlink_to(tmp_path / "nowhere.yaml")
    assert [Path(job.job).name for job in find_jobs([str(tmp_path)], None, "csv").jobs] == ["gone.yaml"]


def test_outputs_and_jobs_are_compared_with_all_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.yaml", "b.yaml", "x/c.yaml", "y/c.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(JOB, encoding="utf-8")
    with pytest.raises(InputError, match=r"x/c\.yaml and y/c\.yaml would both be written"):
        find_jobs(["a.yaml", "x/c.yaml", "y/c.yaml"], "out", "csv")
    with pytest.raises(InputError, match=r"the rows of x/c\.yaml would overwrite y/c\.yaml"):
        find_jobs(["x/c.yaml", "y/c.yaml"], "y", "ros")


def test_a_device_takes_any_number_of_outputs(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / f"{name}.yaml").write_text(JOB, encoding="utf-8")
        (tmp_path / f"{name}.csv").symlink_to(os.devnull)
    assert len(find_jobs([str(tmp_path)], None, "csv").jobs) == 2


def test_a_file_counts_to_its_last_byte(tmp_path: Path) -> None:
    long = tmp_path / "arm.urdf"
    long.write_bytes(b" " * 100_000 + b"a")
    before = hash_of_inputs("a.yaml", b"job", [str(long)], "csv")
    long.write_bytes(b" " * 100_000 + b"b")
    assert hash_of_inputs("a.yaml", b"job", [str(long)], "csv") != before
    assert hash_of_inputs("a", b"bjob", [], "csv") != hash_of_inputs("ab", b"job", [], "csv")
