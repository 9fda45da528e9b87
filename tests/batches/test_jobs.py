"""Jobs of a batch: which files they are, and where their rows go."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from trajcli.batches.jobs import BatchJob, find_jobs
from trajcli.errors import InputError

JOB = "version: 1\nrobot: 1\nmoves: []\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    texts = {
        "jobs/b.yaml": JOB,
        "jobs/a.yml": JOB,
        "jobs/deep/a.yaml": '{"version": 1, "moves": []}',
        "jobs/short.yaml": "{robot: ur5e, start: home}",
        "jobs/broken.yaml": "moves: [\n",
        "jobs/robots/arm.yaml": "joints: 6\nunits: {angle: deg}\nnote: 'start: here'\n",
        "jobs/measured.yaml": "- {joints: [0], version: x}\n".replace(", version: x", ""),
        "jobs/.hidden/c.yaml": JOB,
        "jobs/rows.csv": "t\n0\n",
        "none/arm.yaml": "joints: 6\n",
        "twin/b.yaml": JOB,
    }
    for name, text in texts.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text)
    return tmp_path


@pytest.mark.usefixtures("folder")
def test_jobs_of_a_folder_keep_their_path_below_it() -> None:
    found = find_jobs(["jobs"], "out", "csv")
    assert found.jobs == (
        BatchJob("jobs/a.yml", "out/a.csv"),
        BatchJob("jobs/b.yaml", "out/b.csv"),
        BatchJob("jobs/broken.yaml", "out/broken.csv"),
        BatchJob("jobs/deep/a.yaml", "out/deep/a.csv"),
        BatchJob("jobs/short.yaml", "out/short.csv"),
    )
    assert found.no_jobs == ("jobs/measured.yaml", "jobs/robots/arm.yaml")


@pytest.mark.usefixtures("folder")
def test_jobs_that_are_named_are_jobs_and_stay_beside_themselves() -> None:
    found = find_jobs(["jobs/robots/arm.yaml", "jobs/none.yaml"], None, "mcap")
    assert found.jobs == (
        BatchJob("jobs/robots/arm.yaml", "jobs/robots/arm.mcap"),
        BatchJob("jobs/none.yaml", "jobs/none.mcap"),
    )
    assert [job.output for job in find_jobs(["jobs/deep/a.yaml"], "out", "jsonl").jobs] == ["out/a.jsonl"]


@pytest.mark.usefixtures("folder")
def test_goals_that_a_batch_has_written_are_no_jobs() -> None:
    Path("jobs/out").mkdir()
    Path("jobs/out/b.yaml").write_text(JOB)
    names = {job.job for job in find_jobs(["jobs"], "jobs/out", "ros").jobs}
    assert "jobs/b.yaml" in names
    assert "jobs/out/b.yaml" not in names
    assert "jobs/out/b.yaml" in {job.job for job in find_jobs(["jobs"], "out", "csv").jobs}


@pytest.mark.parametrize(
    ("names", "output", "form", "message"),
    [
        (["jobs/b.yaml", "twin/b.yaml"], "out", "csv", "jobs/b.yaml and twin/b.yaml would both be written to out/b.csv"),
        (["jobs/b.yaml", "jobs/b.yaml"], None, "csv", "would both be written to jobs/b.csv"),
        (["jobs/b.yaml", "./jobs/../jobs/b.yaml"], None, "csv", "would both be written to"),
        ([""], None, "csv", "the name of a job is empty"),
        (["jobs/b.yaml"], None, "ros", "the rows of jobs/b.yaml would overwrite jobs/b.yaml"),
        (["jobs/deep/a.yaml", "twin/b.yaml"], "jobs/deep", "ros-goal", "would overwrite jobs/deep/a.yaml"),
        (["none"], "out", "csv", "there is no job in none"),
        (["-"], "out", "csv", "a batch reads no standard input"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("folder")
def test_what_cannot_be_a_batch(names: list[str], output: str | None, form: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        find_jobs(names, output, form)  # type: ignore[arg-type]


@pytest.mark.usefixtures("folder")
def test_links_to_one_output_are_one_output() -> None:
    Path("out").mkdir()
    Path("out/b.csv").write_text("")
    os.link("out/b.csv", "out/a.csv")
    with pytest.raises(InputError, match="would both be written to"):
        find_jobs(["jobs/b.yaml", "jobs/deep/a.yaml"], "out", "csv")
