"""What kind of file it is: rows, messages, logs or a job, by its name, its first bytes, and what is asked of it."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import FileError, InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import (
    format_of_rows,
    holds_motion,
    is_job,
    is_log,
    is_ros_message,
    motion_files,
    open_rows_of,
    read_table,
    refuse_job,
)

JOB = "version: 1\nrobot: ur5e\nstart: {joints: 0}\nmoves: []\n"
POINT = '{"positions": [0.5], "time_from_start": {"sec": 1, "nanosec": 0}}'
MESSAGE = f'{{"joint_names": ["a"], "points": [{POINT}]}}'


def written(folder: Path, text: str | bytes, name: str = "file") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    ("text", "job"),
    [
        (JOB, True),
        (f"# a job\n---\n{JOB}", True),
        (f"\ufeff# a job\n{JOB}", True),
        (json.dumps({"version": 1, "robot": "ur5e"}), True),
        ("t,q1\n0,1\n", False),
        ("# of a logger\n\n0 1 2\n", False),
        ("% rate: 100 Hz\n0;1;2\n", False),
        ("---\n---\nt;q1\n0;1\n", False),
        ("\ufefft\tq1\n0\t1\n", False),
        ('{"t": 0, "q": [0]}\n', False),
        (f"---\n{MESSAGE}\n", False),
        (b"\x93NUMPY\x01\x00", False),
        (b"\x89MCAP0\r\n", False),
    ],
)
def test_a_file_without_an_ending_is_a_job_by_how_it_begins(
    text: str | bytes, job: bool, tmp_path: Path
) -> None:
    assert is_job(str(written(tmp_path, text))) == job


def test_what_is_not_there_is_a_job_and_a_folder_is_none(tmp_path: Path) -> None:
    """Who reads it says that it is missing."""
    assert is_job(str(tmp_path / "none"))
    assert not is_job(str(tmp_path))


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ('{"t": 0, "q": [0]}\n{"t": 1, "q": [1]}\n', "jsonl"),
        ('\ufeff{"t": 0, "q": [0]}\n', "jsonl"),
        (MESSAGE, "ros"),
        (f"goal:\n- {MESSAGE[1:-1]}", "ros"),
        ("t,q1\n0,1\n", "csv"),
        (b"PK\x03\x04" + b"\0" * 26 + b"t.npy" + b"\0" * 9, "npz"),
        (b"PK\x03\x04" + b"\n" * 26 + b"t.npy" + b"\0" * 9, "npz"),
    ],
)
def test_the_format_of_rows_is_seen_in_their_first_bytes(
    text: str | bytes, kind: str, tmp_path: Path
) -> None:
    assert format_of_rows(ByteSource(written(tmp_path, text, "rows.log"))) == kind


@pytest.mark.parametrize(
    "text", ["joint_names: [a]\n", "- joint_names: [a]\n", MESSAGE, "goal:\n  'joint_names' : [a]\n"]
)
def test_a_message_has_the_names_of_joints_at_the_start_of_a_line(text: str, tmp_path: Path) -> None:
    assert is_ros_message(written(tmp_path, text, "a.yaml"))
    assert not is_ros_message(written(tmp_path, JOB + "name: of joint_names\n", "b.yaml"))


@pytest.mark.parametrize("option", ["topic", "field"])
def test_what_is_asked_of_a_log_is_refused_of_other_files_by_its_name(option: str, tmp_path: Path) -> None:
    rows = written(tmp_path, "t,q1\n0,1\n", "rows.csv")
    with pytest.raises(InputError, match=f"--{option} is about MCAP, and .*rows.csv is none"):
        open_rows_of(rows, **{option: "/a"})  # type: ignore[arg-type]
    assert read_table(rows, topic="/a").names == ("t", "q1")


def test_a_job_is_one_by_its_ending_and_rows_are_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert is_job(str(written(tmp_path, "neither key nor colon\n", "JOB.YAML")))
    assert not is_job(str(written(tmp_path, JOB, "ROWS.CSV")))
    monkeypatch.setattr("sys.stdin", None)
    assert not is_job("-")


def test_a_log_is_one_by_its_ending_or_its_first_bytes(tmp_path: Path) -> None:
    assert is_log(tmp_path / "none.MCAP")
    assert is_log(written(tmp_path, b"\x89MCAP0\r\n", "log"))
    assert not is_log(written(tmp_path, "t,q1\n0,1\n", "rows"))


def test_who_looks_at_a_pipe_takes_nothing_of_it() -> None:
    for first in (b"\x89MCAP0\r\n", b"joint_names: [a]\n"):
        reading, writing = os.pipe()
        os.write(writing, first)
        os.close(writing)
        assert [look(f"/dev/fd/{reading}") for look in (is_log, is_ros_message, holds_motion)] == [False] * 3
        assert os.read(reading, 99) == first
        os.close(reading)


def test_a_job_in_the_place_of_a_motion_is_refused(tmp_path: Path) -> None:
    for name, text in (("rows.csv", "t,q1\n0,1\n"), ("goal.yaml", MESSAGE), ("jerks.csv", JOB)):
        refuse_job(ByteSource(written(tmp_path, text, name)))
    with pytest.raises(InputError, match=r"job\.yaml"):
        refuse_job(ByteSource(written(tmp_path, JOB, "job.yaml")))
    with pytest.raises(FileError, match=r"none\.csv"):
        refuse_job(ByteSource(tmp_path / "none.csv"))


def test_hidden_files_are_no_motions_of_a_folder(tmp_path: Path) -> None:
    for name in (".hidden/a.csv", "shown/.b.csv", "shown/c.csv", "d.npy", "job.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        written(tmp_path, JOB, name)
    assert motion_files(str(tmp_path)) == [str(tmp_path / name) for name in ("d.npy", "shown/c.csv")]


def test_motions_of_a_folder_are_files_of_rows_in_any_case_and_logs(tmp_path: Path) -> None:
    for name in ("A.NPY", "b.txt", "c.Jsonl", "d.log", "e.dat", "f.md", "g.yml"):
        written(tmp_path, b"\x89MCAP0\r\n" if name == "d.log" else MESSAGE, name)
    (tmp_path / "h.csv").mkdir()
    os.mkfifo(tmp_path / "i.csv")
    found = [str(tmp_path / name) for name in ("A.NPY", "b.txt", "c.Jsonl", "d.log", "g.yml")]
    assert motion_files(str(tmp_path)) == found
    assert motion_files(str(tmp_path / "f.md")) == [str(tmp_path / "f.md")]


def test_arrays_without_times_are_at_the_rate_that_is_said(tmp_path: Path) -> None:
    rows = np.array([[1.0, 2.0], [3.0, 4.0]])
    np.save(tmp_path / "rows.npy", rows)
    np.savez(tmp_path / "rows.npz", q=rows)
    for name in ("rows.npy", "rows.npz"):
        found = open_rows_of(ByteSource(tmp_path / name, rate=4.0), joints=2)
        (block,) = found.blocks(range(3), ())
        assert block.tolist() == [[0, 1, 2], [0.25, 3, 4]]


def test_joints_that_are_wanted_move_no_columns_without_their_names(tmp_path: Path) -> None:
    """Of a message they do, with their decimals."""
    rows = read_table(written(tmp_path, "t,q1,q2\n0,1,2\n", "rows.csv"), joints=["b", "a"])
    assert (rows.names, rows.columns.tolist(), rows.joints) == (("t", "q1", "q2"), [[0, 1, 2]], None)
    points = "".join(f"- {{positions: [{k}, 0.125], time_from_start: {{sec: {k}}}}}\n" for k in range(2))
    goal = read_table(
        written(tmp_path, f"joint_names: [a, b]\npoints:\n{points}", "goal.yaml"), joints=["b", "a"]
    )
    assert (goal.names, goal.columns.tolist()) == (("t", "q1", "q2"), [[0, 0.125, 0], [1, 0.125, 1]])
    assert goal.joints == ("b", "a")
    assert goal.decimals[1] > goal.decimals[2]


def test_rows_without_times_are_at_the_rate_that_is_said(tmp_path: Path) -> None:
    rows = written(tmp_path, "q1,q2\n1,2\n3,4\n5,6\n", "rows.csv")
    table = read_table(ByteSource(rows, rate=4.0))
    assert table.names == ("t", "q1", "q2")
    assert table.columns.tolist() == [[0, 1, 2], [0.25, 3, 4], [0.5, 5, 6]]


def test_numbers_of_binary_files_have_every_decimal(tmp_path: Path) -> None:
    np.save(tmp_path / "rows.npy", np.array([[0.0, 0.1 + 0.2], [1.0, 1 / 3]]))
    table = read_table(tmp_path / "rows.npy")
    (value,) = {float(f"{each:.{table.decimals[1]}f}") - each for each in table.columns[:, 1]}
    assert value == 0.0


@pytest.mark.parametrize("before", [0, 90, 3000, 60_000])
def test_a_message_behind_words_of_any_length_is_one(before: int, tmp_path: Path) -> None:
    words = f"# {'w' * before}\n" if before else ""
    path = written(tmp_path, f"{words}joint_names: [a]\npoints:\n- {POINT}\n")
    assert format_of_rows(ByteSource(path)) == "ros"
    assert read_table(path).columns.tolist() == [[1.0, 0.5]]
