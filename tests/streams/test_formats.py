"""The table of formats: what a file's name promises, and that a format is one entry."""

from __future__ import annotations

import io
import os

import numpy as np
import pytest

from trajcli.columns import columns_of
from trajcli.errors import InputError, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.knots import knots_of
from trajcli.planning.plan import plan_job
from trajcli.streams import formats
from trajcli.streams.formats import (
    DEFAULT,
    FORMATS,
    Goal,
    StreamFormat,
    WriteOptions,
    format_of,
    write_verified,
)
from trajcli.units import Units

COLUMNS = columns_of(("t", "q"), ("revolute", "prismatic"), Units("deg", "mm"))
ROWS = np.arange(6.0).reshape(2, 3)


@pytest.mark.parametrize(
    "path", ["out.csv", "OUT.CSV", "a.txt/o.csv", "-", "/dev/stdout", "/dev/null", "/dev/fd/63"]
)
def test_rows_are_csv_where_a_name_says_so_and_on_devices(path):
    assert format_of(path) is FORMATS["csv"] is DEFAULT


def test_a_pipe_needs_no_name(tmp_path):
    os.mkfifo(tmp_path / "rows")
    assert format_of(tmp_path / "rows") is DEFAULT


def test_a_name_without_an_ending_is_refused(tmp_path):
    with pytest.raises(
        InputError,
        match=r"^rows are written as CSV or MCAP or JSON lines or NPY or NPZ or a ROS message, not to a file without an ending, 'out'$",
    ):
        format_of(tmp_path / "a.csv" / "out")


@pytest.mark.parametrize("ending", [".json", ".yml", ".xlsx", ".parquet", ".txt", ".cvs"])
def test_a_name_of_another_format_is_refused(ending, tmp_path):
    with pytest.raises(InputError) as caught:
        write_verified(tmp_path / f"out{ending}", [ROWS], COLUMNS)
    (problem,) = caught.value.problems
    assert (
        problem.message
        == f"rows are written as CSV or MCAP or JSON lines or NPY or NPZ or a ROS message, not as {ending.lower()}"
    )
    assert problem.hint == "name the file .csv or .mcap or .jsonl or .npy or .npz or .yaml"
    assert list(tmp_path.iterdir()) == []


def test_a_format_is_one_entry(tmp_path, monkeypatch):
    seen = []

    def write(rows, columns, out):
        seen.append([(column.quantity, column.joint, column.factor) for column in columns])
        for block in rows:
            out.write(repr(block.tolist()).encode())
            yield block

    def verify(written, rows, columns):
        for block in rows:
            assert written.read().decode() == repr(block.tolist())

    monkeypatch.setattr(
        formats, "FORMATS", {**FORMATS, "rows": StreamFormat("rows", lambda _: (write, verify))}
    )
    monkeypatch.setattr(formats, "ENDINGS", {".csv": ("csv",), ".rows": ("rows",)})
    write_verified(tmp_path / "out.rows", [ROWS], COLUMNS)
    assert (tmp_path / "out.rows").read_text() == repr(ROWS.tolist())
    assert [(quantity.dimension, joint) for quantity, joint, _ in seen[0]] == [
        ("time", None), ("angle", 0), ("length", 1),
    ]  # fmt: skip
    with pytest.raises(InputError) as caught:
        format_of("out.mcap")
    (problem,) = caught.value.problems
    assert problem.message == "rows are written as CSV or rows, not as .mcap"
    assert problem.hint == "name the file .csv or .rows"


def test_a_format_that_is_asked_for_decides_what_a_name_leaves_open(tmp_path):
    assert format_of("a.yaml") is FORMATS["ros"]
    assert format_of("a.yaml", "ros-goal") is FORMATS["ros-goal"]
    assert format_of(None, "jsonl") is format_of("-", "jsonl") is FORMATS["jsonl"]
    assert format_of("/dev/stdout", "mcap") is FORMATS["mcap"]
    with pytest.raises(InputError, match=r"--format ros contradicts the name of the file, a\.csv") as caught:
        format_of("a.csv", "ros")
    assert caught.value.problems[0].hint == "leave --format out, or name the file .yaml"


def blocks():
    """Return columns of a joint, and rows whose numbers have more than nine decimals."""
    rows = np.stack([np.arange(5) / 10, np.arange(5) / 7, np.arange(5) / 3, np.arange(5) / 9], axis=1)
    return columns_of(("t", "q", "qd", "qdd"), ("revolute",), Units()), rows


def test_a_file_that_holds_something_else_does_not_appear(tmp_path):
    """Whatever a writer makes of rows, they are read again, each block when it is written."""
    columns, rows = blocks()

    def damaged(options):
        write, verify = FORMATS["csv"].functions(options)

        def write_others(rows, columns, out):
            kept = list(rows)
            others = write([block + 1e-8 for block in kept], columns, out)
            yield from (block for block, _ in zip(kept, others, strict=True))

        return write_others, verify

    for some in ([rows], [rows[:2], rows[2:]]):
        with pytest.raises(TrajcliError):
            write_verified(tmp_path / "a.csv", some, columns, form=StreamFormat("damaged", damaged))
        assert not (tmp_path / "a.csv").exists()
    write_verified(tmp_path / "a.csv", [rows], columns)
    assert (tmp_path / "a.csv").exists()


@pytest.mark.parametrize("name", ["csv", "jsonl", "npy", "npz"])
def test_what_a_format_says_of_itself_is_so(name):
    """Text can be decoded, and digits change what is written where nine decimals are few."""
    columns, rows = blocks()
    form, written = FORMATS[name], {}
    for digits in ("fixed", "full"):
        out = io.BytesIO()
        form.write([rows], columns, out, WriteOptions(digits))
        written[digits] = out.getvalue()
    assert (written["fixed"] != written["full"]) == form.decimals
    assert (b"\0" not in written["full"]) == form.text


@pytest.mark.parametrize("name", ["mcap", "ros", "ros-goal"])
def test_a_format_of_a_motion_is_not_written_of_a_table(name):
    columns, rows = blocks()
    with pytest.raises(TrajcliError, match="there is only a table"):
        FORMATS[name].write([rows], columns, io.BytesIO(), WriteOptions())


@pytest.mark.parametrize("name", ["csv", "jsonl", "npy", "npz"])
@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_rows_that_are_others_than_those_of_a_stream_are_refused(name, digits):
    """By a decimal that is shown: with all digits by the last bits, too."""
    columns, rows = blocks()
    write, verify = FORMATS[name].functions(WriteOptions(digits))
    out = io.BytesIO()
    for _ in write([rows], columns, out):
        pass
    verify(io.BytesIO(out.getvalue()), [rows], columns)
    others = rows.copy()
    others[3, 2] += 1e-14 if digits == "full" or name != "csv" else 1e-8
    with pytest.raises(TrajcliError):
        verify(io.BytesIO(out.getvalue()), [others], columns)


def test_rows_have_nine_decimals_and_units_of_the_job_in_csv_alone():
    columns, rows = blocks()
    out = io.BytesIO()
    DEFAULT.write([rows], columns, out, WriteOptions())
    assert out.getvalue().splitlines()[2] == b"0.100000000,0.142857143,0.333333333,0.111111111"
    assert [name for name, form in FORMATS.items() if not form.si] == ["csv"]
    contents = {name: form.content for name, form in FORMATS.items() if form.content != "rows"}
    assert contents == {"mcap": "log", "ros": "knots", "ros-goal": "knots"}
    assert [name for name, form in FORMATS.items() if not form.text] == ["mcap", "npy", "npz"]


def motion(target=1.0, orders=3):
    """Return options for the motion of a joint to a target."""
    move = f"{{planner: quintic, to: {{joints: {target}}}, duration: 1}}"
    plan = plan_job(job_from_text(f"version: 1\nrobot: {{joints: 1}}\nstart: {{joints: 0}}\nmoves: [{move}]"))
    return WriteOptions(goal=lambda: Goal(("j",), knots_of(plan.trajectory), orders))


@pytest.mark.parametrize(("name", "begins"), [("ros", b"joint_names:"), ("ros-goal", b"trajectory:")])
def test_a_message_is_that_of_its_name_and_states_so_many_orders_and_is_compared(name, begins):
    columns, rows = blocks()
    for orders, stated in ((1, (False, False)), (2, (True, False)), (3, (True, True))):
        write, verify = FORMATS[name].functions(motion(orders=orders))
        out = io.BytesIO()
        assert [block.tolist() for block in write([rows], columns, out)] == [rows.tolist()]
        text = out.getvalue()
        assert begins in text
        assert (b"trajectory:" in text) == (name == "ros-goal")
        assert (b"velocities" in text, b"accelerations" in text) == stated
        verify(io.BytesIO(text), [rows], columns)
        with pytest.raises(TrajcliError):
            FORMATS[name].functions(motion(1.001, orders))[1](io.BytesIO(text), [rows], columns)
    assert Goal((), None).orders == 3
