"""Every number of every format is read back: a file agrees with its rows, in blocks of any size, and with no others."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from trajcli.columns import columns_of, parse_column
from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.knots import knots_of
from trajcli.output.recording import LogOptions, recording_of
from trajcli.output.write import grid_of
from trajcli.planning.plan import plan_job
from trajcli.samples import sample
from trajcli.streams.formats import FORMATS, Goal, WriteOptions
from trajcli.streams.mcap.verify import verify_mcap
from trajcli.units import Units

COLUMNS = [parse_column(name) for name in ("t", "q1", "q2", "qd1", "qd2", "signal.glue", "move")]
ROWS = np.column_stack(
    [
        np.arange(40) / 100,
        np.random.default_rng(0).normal(size=(40, 4)) * [1, 50, 1e-3, 3000],
        *[np.arange(40) // 9] * 2,
    ]
)
ROWS[7, 1:5] = 0.0
OF_ROWS = {"csv": ("csv", "fixed"), "full": ("csv", "full"), "jsonl": ("jsonl", "full")}
OF_ROWS |= {name: (name, "full") for name in ("npy", "npz")}


def in_blocks(rows: np.ndarray, *sizes: int) -> Iterator[np.ndarray]:
    """Yield the rows in blocks of these sizes, and what is left."""
    for size in sizes:
        yield rows[:size]
        rows = rows[size:]
    yield rows


def written(name: str) -> tuple[Any, io.BytesIO]:
    """Return what verifies a format, and the rows in it."""
    form, digits = OF_ROWS[name]
    write, verify = FORMATS[form].functions(WriteOptions(digits=digits))  # type: ignore[arg-type,index]
    out = io.BytesIO()
    for _ in write(in_blocks(ROWS, 13, 9), COLUMNS, out):
        pass
    return verify, out


@pytest.mark.parametrize("name", OF_ROWS)
@pytest.mark.parametrize("sizes", [(), (1,), (39,), (13, 9), (5, 0, 20, 3), (0,), (40,)])
def test_rows_agree_in_blocks_of_any_size(name: str, sizes: tuple[int, ...]) -> None:
    verify, out = written(name)
    verify(out, in_blocks(ROWS, *sizes), COLUMNS)


@pytest.mark.parametrize("name", OF_ROWS)
@pytest.mark.parametrize("row", [0, 7, 21, 39])
@pytest.mark.parametrize("column", range(7))
def test_no_other_number_agrees(name: str, row: int, column: int) -> None:
    """Of a text with nine decimals by a unit of the last; of all others by one bit; of counts by one."""
    verify, out = written(name)
    exact = ROWS[row, column]
    least = 1.0 if column > 4 else 1.01e-9 if name == "csv" else float(np.spacing(abs(exact)))
    for by in (least, -least):
        other = ROWS.copy()
        other[row, column] += by
        for sizes in ((), (20,), (1, 38)):
            with pytest.raises(TrajcliError, match="read back"):
                verify(out, in_blocks(other, *sizes), COLUMNS)


@pytest.mark.parametrize("name", OF_ROWS)
def test_neither_fewer_rows_agree_nor_more(name: str) -> None:
    verify, out = written(name)
    for other in (ROWS[:-1], ROWS[:20], ROWS[1:], np.vstack([ROWS, ROWS[-1:]]), ROWS[:0]):
        for sizes in ((), (10,)):
            with pytest.raises(TrajcliError, match="read back"):
                verify(out, in_blocks(other, *sizes), COLUMNS)


@pytest.mark.parametrize("name", OF_ROWS)
def test_no_other_columns_agree(name: str) -> None:
    verify, out = written(name)
    others = [*COLUMNS[:3], parse_column("qdd1"), parse_column("qdd2"), *COLUMNS[5:]]
    swapped = [*COLUMNS[:1], *COLUMNS[3:5], *COLUMNS[1:3], *COLUMNS[5:]]
    for columns in (others, swapped):
        with pytest.raises(TrajcliError, match="read back"):
            verify(out, in_blocks(ROWS), columns)


@pytest.mark.parametrize("name", OF_ROWS)
def test_what_follows_the_rows_is_no_part_of_them(name: str) -> None:
    verify, out = written(name)
    if name == "npz":
        return  # the directory of an archive stands at its end: what follows is not read
    longer = io.BytesIO(out.getvalue() + out.getvalue()[-8:])
    with pytest.raises(TrajcliError, match="read back"):
        verify(longer, in_blocks(ROWS), COLUMNS)


JOB = """\
version: 1
robot: ur5e
start: {joints: [0, -1.5, 1.5, -1.5, -1.5, 0.3]}
moves:
  - {planner: quintic, to: {joints: [0.3, -1.4, 1.6, -1.5, -1.5, 0]}, duration: 1}
  - {planner: quintic, to: {joints: [0.5, -1.3, 1.6, -1.2, -1.4, 0]}, duration: 1}
output: {rate: 20, columns: [t, q, qd, qdd, tau]}
"""
PLAN = plan_job(job_from_text(JOB))
GROUPS = ("t", "q", "qd", "qdd", "tau")


def log() -> tuple[np.ndarray, Any, Any, io.BytesIO]:
    """Return rows, columns and recording of a log, and the log."""
    rows = np.concatenate([*sample(PLAN.trajectory, grid_of(PLAN), GROUPS, Units(), robot=PLAN.loaded.robot)])
    columns = columns_of(GROUPS, PLAN.loaded.robot.joint_types, Units(), [])
    recording = recording_of(PLAN, LogOptions(compression="none"))
    write, _ = FORMATS["mcap"].functions(WriteOptions(recording=lambda: recording))
    out = io.BytesIO()
    for _ in write(in_blocks(rows, 11), columns, out):
        pass
    return rows, columns, recording, out


def test_every_state_of_a_log_is_read_back() -> None:
    rows, columns, recording, out = log()
    for sizes in ((), (1,), (11,), (5, 30), (40,)):
        verify_mcap(out, in_blocks(rows, *sizes), columns, recording)
    for row in (0, 12, 40):
        for column in range(rows.shape[1]):
            other = rows.copy()
            other[row, column] += 1.01e-9 if column == 0 else np.spacing(abs(other[row, column]))
            for sizes in ((), (20,)):
                with pytest.raises(TrajcliError, match="read back"):
                    verify_mcap(out, in_blocks(other, *sizes), columns, recording)


def test_a_log_is_read_back_by_its_format_and_with_its_own_recording() -> None:
    rows, columns, recording, out = log()
    _, verify = FORMATS["mcap"].functions(WriteOptions(recording=lambda: recording))
    verify(out, in_blocks(rows), columns)
    with pytest.raises(TrajcliError, match="read back"):
        verify(out, in_blocks(rows + 1e-3), columns)
    _, verify = FORMATS["mcap"].functions(WriteOptions(recording=lambda: replace(recording, metadata={})))
    with pytest.raises(TrajcliError, match="read back"):
        verify(out, in_blocks(rows), columns)


def test_a_log_of_other_columns_does_not_agree() -> None:
    rows, columns, recording, out = log()
    without = [k for k, column in enumerate(columns) if column.kind != "tau"]
    with pytest.raises(TrajcliError, match="read back has 6 of 0 columns tau"):
        verify_mcap(out, in_blocks(rows[:, without]), [columns[k] for k in without], recording)


def test_a_log_holds_as_many_states_as_rows_of_its_clock_with_its_metadata() -> None:
    rows, columns, recording, out = log()
    for other in (rows[:-1], rows[1:], rows[:1], np.vstack([rows, rows[-1:]])):
        with pytest.raises(TrajcliError, match="read back"):
            verify_mcap(out, in_blocks(other), columns, recording)
    metadata = dict(recording.metadata)
    first = next(iter(metadata))
    for wrong in (
        replace(recording, epoch=recording.epoch + 1),
        replace(recording, metadata=metadata | {first: metadata[first] + "x"}),
        replace(recording, metadata={}),
    ):
        with pytest.raises(TrajcliError, match="read back"):
            verify_mcap(out, in_blocks(rows), columns, wrong)


def test_any_changed_byte_of_a_log_is_found() -> None:
    """Also of messages whose numbers are not compared, and of the summary: by checksums."""
    rows, columns, recording, out = log()
    text = out.getvalue()
    for place in (*range(0, len(text), 997), *range(len(text) - 7000, len(text), 97)):
        changed = bytearray(text)
        changed[place] ^= 1
        with pytest.raises(TrajcliError):
            verify_mcap(io.BytesIO(bytes(changed)), in_blocks(rows), columns, recording)


def csv_of(rows: np.ndarray, columns: Any, *sizes: int, digits: Any = "fixed") -> tuple[Any, io.BytesIO]:
    write, verify = FORMATS["csv"].functions(WriteOptions(digits=digits))
    out = io.BytesIO()
    for _ in write(in_blocks(rows, *sizes), columns, out):
        pass
    return verify, out


def test_full_digits_agree_bit_by_bit_also_where_there_are_nine() -> None:
    rows = np.array([[0.123456789, -1.987654321], [2.000000001, -0.000000003]])
    verify, out = csv_of(rows, COLUMNS[1:3], digits="full")
    verify(out, in_blocks(rows, 1), COLUMNS[1:3])
    for place in ((0, 0), (0, 1), (1, 0)):
        other = rows.copy()
        other[place] = np.nextafter(other[place], 9.0)
        with pytest.raises(TrajcliError, match="read back"):
            verify(out, in_blocks(other, 1), COLUMNS[1:3])


def test_rows_that_are_alike_are_counted_behind_numbers_that_are_read() -> None:
    """A number of 10^5 is read, with rows behind it; that these are all the same hides nothing."""
    rows = np.tile([0.5, -0.25], (50, 1))
    rows[0] = 123456.7, 0.1
    verify, out = csv_of(rows, COLUMNS[1:3], 5)
    for sizes in ((1,), (5,), (1, 3, 40), (49,)):
        verify(out, in_blocks(rows, *sizes), COLUMNS[1:3])
    for other in (rows[:-1], np.vstack([rows, rows[-1:]])):
        with pytest.raises(TrajcliError, match="read back"):
            verify(out, in_blocks(other, 1, 3), COLUMNS[1:3])


@pytest.mark.parametrize("message", ["ros", "ros-goal"])
@pytest.mark.parametrize("orders", [1, 2, 3])
def test_every_number_of_a_message_is_read_back(message: Any, orders: int) -> None:
    knots, names = knots_of(PLAN.trajectory), PLAN.trajectory.joint_names
    write, _ = FORMATS[message].functions(WriteOptions(goal=lambda: Goal(names, knots, orders)))
    out = io.BytesIO()
    for _ in write([], (), out):
        pass

    def verified(other: Any, joints: Any = names, stated: int = orders) -> None:
        FORMATS[message].functions(WriteOptions(goal=lambda: Goal(joints, other, stated)))[1](out, [], ())

    verified(knots)
    for name in ("position", "velocity", "acceleration")[:orders]:
        for index in ((0, 0), (1, 5), (-1, 2)):
            values = getattr(knots, name).copy()
            values[index] += np.spacing(abs(values[index]))
            with pytest.raises(TrajcliError, match="read back"):
                verified(replace(knots, **{name: values}))
    for index, by in ((1, 1), (1, 10**9), (-1, -1)):
        times = knots.nanoseconds.copy()
        times[index] += by
        with pytest.raises(TrajcliError, match="read back"):
            verified(replace(knots, nanoseconds=times))
    with pytest.raises(TrajcliError, match="read back"):
        verified(knots, (*names[:-1], "other"))
    with pytest.raises(TrajcliError, match="read back"):
        verified(knots, stated=orders % 3 + 1)
