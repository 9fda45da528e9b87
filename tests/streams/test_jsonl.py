"""JSON lines: read by Python's own reader, they hold every bit; faults in a file are noticed."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest

from trajcli.columns import GROUPS, Column, columns_of
from trajcli.errors import TrajcliError
from trajcli.streams.jsonl import verify_jsonl, write_jsonl_blocks
from trajcli.units import Units

COLUMNS = columns_of(("t", "q", "qd", "pose", "path", "move"), ("revolute", "prismatic"), Units())


def random_rows(count, columns=COLUMNS):
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(count, len(columns))) * 10.0 ** rng.integers(-20, 20, (count, len(columns)))
    whole = [k for k, column in enumerate(columns) if column.whole_numbers]
    rows[:, whole] = (np.arange(count) // 3)[:, None]
    return rows


def written(rows, columns=COLUMNS, size=4):
    out = io.BytesIO()
    blocks = [rows[low : low + size] for low in range(0, len(rows), size)]
    assert [len(block) for block in write_jsonl_blocks(blocks, columns, out)] == [
        len(block) for block in blocks
    ]
    return out, blocks


def test_each_line_is_an_object_with_every_bit():
    rows = random_rows(10)
    out, _ = written(rows)
    lines = out.getvalue().decode().splitlines()
    assert len(lines) == 10
    for line, row in zip(lines, rows.tolist(), strict=True):
        value = json.loads(line)
        assert list(value) == ["t", "q", "qd", "pose", "path", "move"]
        assert [value["t"], *value["q"], *value["qd"], *value["pose"], *value["path"], value["move"]] == row
        assert type(value["move"]) is int
        assert [len(value[key]) for key in ("q", "qd", "pose", "path")] == [2, 2, 7, 3]


def test_one_joint_is_a_list_too():
    columns = columns_of(("t", "q"), ("revolute",), Units())
    out, _ = written(np.array([[0.0, 0.25]]), columns)
    assert json.loads(out.getvalue()) == {"t": 0.0, "q": [0.25]}


def test_every_group_has_its_key():
    columns = columns_of(GROUPS, ("revolute",) * 3, Units(), ["grip"])
    out, blocks = written(random_rows(5, columns), columns)
    expected = ["signal.grip" if group == "signals" else group for group in GROUPS]
    assert list(json.loads(out.getvalue().splitlines()[0])) == expected
    verify_jsonl(out, blocks, columns)


def test_a_value_that_is_not_finite_is_refused():
    rows = random_rows(6)
    rows[5, 2] = np.nan
    with pytest.raises(TrajcliError, match=r"q2 is nan in row 5"):
        written(rows)


def changed(text, row, change):
    lines = text.splitlines(keepends=True)
    lines[row] = change(lines[row])
    return b"".join(lines)


FAULTS = [
    lambda text: changed(text, 7, lambda line: line.replace(b'"t":', b'"t":1')),
    lambda text: changed(text, 7, lambda line: line.replace(b'"qd"', b'"qe"')),
    lambda text: changed(text, 7, lambda line: b"{}\n"),
    lambda text: changed(text, 7, lambda line: b"[1]\n"),
    lambda text: changed(text, 7, lambda line: line[:-5] + b"\n"),
    lambda text: changed(text, 7, lambda line: b""),
    lambda text: text + b"{}\n",
    lambda text: text[:-1],
    lambda text: text[: len(text) // 2],
]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_is_not_what_was_written_is_noticed(fault):
    out, blocks = written(random_rows(10))
    verify_jsonl(out, blocks, COLUMNS)
    wrong = fault(out.getvalue())
    assert wrong != out.getvalue()
    with pytest.raises(TrajcliError, match=r"the file read back|row 7"):
        verify_jsonl(io.BytesIO(wrong), blocks, COLUMNS)


def test_columns_apart_of_one_group_are_not_mixed():
    columns = (Column("q", 0), Column("t"), Column("q", 1))
    out = io.BytesIO()
    with pytest.raises(TrajcliError, match="the columns q stand apart"):
        list(write_jsonl_blocks([np.zeros((1, 3))], columns, out))


@pytest.mark.parametrize("fault", FAULTS[:6])
def test_the_row_that_is_wrong_is_told(fault):
    out, blocks = written(random_rows(10))
    with pytest.raises(TrajcliError, match=r"^row 7 of the file read back"):
        verify_jsonl(io.BytesIO(fault(out.getvalue())), blocks, COLUMNS)
    with pytest.raises(TrajcliError, match="ends after 9 rows"):
        verify_jsonl(io.BytesIO(out.getvalue()[:-1]), blocks, COLUMNS)
