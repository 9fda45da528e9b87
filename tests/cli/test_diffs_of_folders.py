"""`trajcli diff`: tolerances in their places, files that cannot be compared among others, logs beside tables."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from running import JOB, call

Capture = pytest.CaptureFixture[str]
ROWS = "t,q1\n0,100\n1,200\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two folders: of four names two files are equal, one differs, one is no table; and one is in the first only."""
    monkeypatch.chdir(tmp_path)
    for name in ("old", "new"):
        Path(name).mkdir()
        for file in ("a", "d"):
            Path(name, f"{file}.csv").write_text(ROWS, encoding="utf-8")
        Path(name, "b.csv").write_text("t,q1\n0,0\n1,what\n" if name == "old" else ROWS, encoding="utf-8")
    return tmp_path


def test_a_file_that_cannot_be_compared_costs_no_other(capfd: Capture) -> None:
    code, out, err = call(capfd, "diff", "old", "new")
    assert (code, err.count("error:")) == (2, 1)
    assert [line.split(" (")[0] for line in out.splitlines()] == [
        "equal: old/a.csv and new/a.csv",
        "equal: old/d.csv and new/d.csv",
    ]
    code, out, err = call(capfd, "diff", "old", "new", "--json", "--errors", "json")
    assert [json.loads(line)["exit"] for line in err.splitlines()] == [2]
    found = json.loads(out)
    assert (code, [one["equal"] for one in found]) == (2, [True, False, True])
    assert (found[1]["files"], found[1]["exit"]) == (["old/b.csv", "new/b.csv"], 2)


def test_what_one_folder_lacks_is_a_difference_wherever_it_stands(capfd: Capture) -> None:
    Path("old/b.csv").unlink()
    code, out, err = call(capfd, "diff", "old", "new")
    assert (code, err) == (1, "")
    assert "different: new/b.csv has no counterpart old/b.csv" in out.splitlines()
    Path("new/b.csv").unlink()
    assert call(capfd, "diff", "old", "new").code == 0
    Path("new/a.csv").write_text(ROWS.replace("200", "201"), encoding="utf-8")
    assert call(capfd, "diff", "old", "new").code == 1


def test_two_files_that_cannot_be_compared_are_one_error(capfd: Capture) -> None:
    code, out, err = call(capfd, "diff", "old/b.csv", "new/b.csv", "--json")
    assert (code, out, err.count("error:")) == (2, "", 1)
    assert call(capfd, "diff", "old/none.csv", "new/b.csv").code == 4


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("--atol", "0.9"), 1),
        (("--atol", "1.1"), 0),
        (("--rtol", "0.004"), 1),
        (("--rtol", "0.006"), 0),
        (("--rtol", "0.9e-3", "--atol", "1.1"), 0),
    ],
)
def test_each_tolerance_is_its_own(words: tuple[str, ...], code: int, capfd: Capture) -> None:
    """201 beside 200: one apart, five thousandths of it."""
    Path("new/a.csv").write_text(ROWS.replace("200", "201"), encoding="utf-8")
    assert call(capfd, "diff", "old/a.csv", "new/a.csv", *words).code == code


def test_a_topic_is_of_the_file_that_is_a_log(capfd: Capture) -> None:
    Path("job.yaml").write_text(JOB.replace("[t, q]", "[t, q, qd, qdd]"), encoding="utf-8")
    assert call(capfd, "plan", "job.yaml", "--si", "-o", "rows.csv").code == 0
    assert call(capfd, "plan", "job.yaml", "-o", "log.mcap").code == 0
    for pair in (("rows.csv", "log.mcap"), ("log.mcap", "rows.csv")):
        near = call(capfd, "diff", *pair, "--topic", "/joint_states", "--atol", "1e-8")
        assert (near.code, near.err) == (0, ""), near.out
        other = call(capfd, "diff", *pair, "--topic", "/nothing")
        assert (other.code, "/nothing" in other.err) == (2, True)
    none = call(capfd, "diff", "rows.csv", "rows.csv", "--topic", "/joint_states")
    assert (none.code, "--topic is about MCAP" in none.err) == (2, True)


def test_an_arm_is_of_a_page(capfd: Capture) -> None:
    refused = call(capfd, "diff", "old/a.csv", "new/a.csv", "--robot", "job.yaml")
    assert (refused.code, refused.out) == (2, "")
    assert "--robot is the arm of a page, and there is none\n  add --view FILE.html" in refused.err
    for words in (("old", "new"), ("old/a.csv", "-")):
        page = call(capfd, "diff", *words, "--view", "both.html", stdin=ROWS)
        assert (page.code, "--view is of two files" in page.err) == (2, True)
