"""Files and folders of motions: `check` and `diff` of many, in text, JSON and annotations."""

from __future__ import annotations

import json
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from running import call

T = np.linspace(0, 1, 21)
SLOW = T**3 * (10 - 15 * T + 6 * T**2)  # 1.875 rad/s at most


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """Two folders of motions: one in both, one that differs, one that each lacks, one that is none."""
    monkeypatch.chdir(tmp_path)
    for folder, scale in (("old", 1.0), ("new", 1.5)):
        (tmp_path / folder / "sub").mkdir(parents=True)
        for name, size in (("same", 1.0), ("sub/other", scale), (f"only_{folder}", 1.0)):
            rows = "\n".join(f"{t:.9f},{size * q:.9f}" for t, q in zip(T, SLOW, strict=True))
            (tmp_path / folder / f"{name}.csv").write_text(f"t,q1\n{rows}\n")
    (tmp_path / "old" / "job.yaml").write_text("version: 1\nmoves: []\n")
    (tmp_path / "old" / ".hidden.csv").write_text("no rows\n")
    (tmp_path / "one.yaml").write_text(
        "convention: standard\njoints: [{a: 1, velocity: 2, position: [-9, 9]}]\n"
    )
    return tmp_path


def test_check_judges_each_file_of_a_folder(folders, capfd):
    many = call(capfd, "check", "old", "new/sub/other.csv", "-r", "one.yaml")
    verdicts = [line for line in many.out.splitlines() if not line.startswith(" ")]
    assert [line.split(" (")[0] for line in verdicts] == [
        "old/only_old.csv: satisfied",
        "old/same.csv: satisfied",
        "old/sub/other.csv: satisfied",
        "new/sub/other.csv: exceeded",  # 2.81 rad/s of 2
    ]
    assert many.code == 1
    told = json.loads(call(capfd, "check", "old", "new/sub/other.csv", "-r", "one.yaml", "--json").out)
    assert [one["verdict"] for one in told] == ["satisfied"] * 3 + ["exceeded"]
    assert told[3]["file"] == "new/sub/other.csv"
    alone = json.loads(call(capfd, "check", "new/sub/other.csv", "-r", "one.yaml", "--json").out)
    assert alone["verdict"] == "exceeded"
    assert {"file": "new/sub/other.csv", **alone} == told[3]
    same = call(capfd, "check", "new/sub/other.csv", "-r", "one.yaml", "--format", "json").out
    assert json.loads(same) == alone


def test_a_file_that_is_no_motion_holds_up_no_other(folders, capfd):
    (folders / "old" / "broken.csv").write_text("t,q1\n0,zero\n")
    found = call(capfd, "check", "old", "-r", "one.yaml")
    assert found.code == 2
    assert found.err.startswith("old/broken.csv:2:")
    assert found.out.count("satisfied") == 3
    told = json.loads(call(capfd, "check", "old", "-r", "one.yaml", "--json").out)
    assert [one.get("exit") for one in told] == [2, None, None, None]
    document = call(capfd, "check", "old", "-r", "one.yaml", "--format", "junit").out
    suites = ET.fromstring(document.encode())
    assert [(suite.get("name"), suite.get("failures")) for suite in suites] == [
        ("old/broken.csv", "1"),
        ("old/only_old.csv", "0"),
        ("old/same.csv", "0"),
        ("old/sub/other.csv", "0"),
    ]


def test_diff_of_folders_compares_files_of_the_same_names(folders, capfd):
    found = call(capfd, "diff", "old", "new")
    assert found.code == 1
    assert [line for line in found.out.splitlines() if line.startswith(("equal", "different"))] == [
        "different: new/only_new.csv has no counterpart old/only_new.csv",
        "different: old/only_old.csv has no counterpart new/only_old.csv",
        "equal: old/same.csv and new/same.csv (21 rows, 2 columns compared)",
        "different: old/sub/other.csv and new/sub/other.csv (21 rows, 2 columns compared)",
    ]
    told = json.loads(call(capfd, "diff", "old", "new", "--json").out)
    assert [one["equal"] for one in told] == [False, False, True, False]
    worst = told[3]["columns"][1]["worst"]
    assert (worst["column"], worst["row"], worst["difference"]) == ("q1", 20, 0.5)
    one = json.loads(call(capfd, "diff", "old/sub/other.csv", "new/sub/other.csv", "--json").out)
    assert one == told[3]
    for names in (["old/same.csv", "old/sub/other.csv", "new/sub"], ["old/sub", "new/sub"]):
        assert call(capfd, "diff", *names).code == 1
    assert call(capfd, "diff", "old/same.csv", "new").code == 0
    assert call(capfd, "diff", "old/sub", "new/sub", "--atol", "q=0.5").code == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["check", "empty", "-r", "one.yaml"], "there is no motion in the folder empty"),
        (["check", "-", "-", "-r", "one.yaml"], "standard input can be read once"),
        (["check", "old", "--json", "--format", "sarif"], "--json and --format sarif exclude each other"),
        (["diff", "old/same.csv"], "diff compares two files, and there is one"),
        (["diff", "old", "old/same.csv", "new/same.csv"], "new/same.csv is none"),
        (["diff", "old", "new/same.csv"], "new/same.csv is none"),
    ],
)
def test_what_cannot_be_meant_is_refused(words, message, folders, capfd):
    (folders / "empty").mkdir()
    refused = call(capfd, *words)
    assert refused.code == 2
    assert message in refused.err


@pytest.mark.parametrize("command", ["retime", "check", "fk", "plan", "robots"])
def test_one_letter_means_one_thing(command, capfd):
    refused = call(capfd, command, "-j", "2", "x")
    assert refused.code == 2
    assert "-j is how many processes `batch` uses; say --job, or --json" in refused.err


@pytest.mark.parametrize("command", ["plan", "resample", "batch"])
def test_where_the_json_of_rows_is(command, capfd):
    assert "--format jsonl, the report of `plan` with --report FILE" in call(capfd, command, "--json").err


def test_standard_input_is_one_file(capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "diff", "-", "-", stdin="t,q1\n0,1\n")
    assert done.code == 2
    assert done.err.startswith("error: only one of the files can be standard input")
