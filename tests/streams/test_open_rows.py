"""`open_rows`: the same numbers as `read_csv`, block by block, with its refusals."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import FileError, InputError
from trajcli.streams import table
from trajcli.streams.table import open_rows, read_csv


def test_blocks_are_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(0).normal(size=(500, 3)).round(9)
    path = tmp_path / "rows.csv"
    path.write_text("t,q1,q2\n" + "".join(",".join(f"{v:.9f}" for v in row) + "\n" for row in values))
    monkeypatch.setattr(table, "_CHUNK", 1000)
    rows = open_rows(path)
    blocks = list(rows.blocks)
    assert rows.names == ("t", "q1", "q2")
    assert len(blocks) > 5
    assert np.concatenate(blocks).tolist() == read_csv(path).columns.tolist()


def test_rows_are_read_when_they_are_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "rows.csv"
    path.write_text("q1\n" + "1\n" * 1000 + "x\n")
    monkeypatch.setattr(table, "_CHUNK", 100)
    rows = open_rows(path)
    assert next(rows.blocks).tolist() == [[1.0]] * 50  # a chunk
    with pytest.raises(InputError, match="q1 is 'x'") as caught:
        list(rows.blocks)
    place = caught.value.problems[0].place
    assert place is not None
    assert place.line == 1002


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "is empty"), ("q1,q1\n1,1\n", "two columns"), ("q1\n", "no rows"), ("q1\n\n\n", "no rows")],
)
def test_refusals(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        list(open_rows(path).blocks)


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(FileError):
        open_rows(tmp_path / "none.csv")


def test_what_the_taker_raises_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_text("q1\n1\n")

    def take() -> None:
        for _ in open_rows(path).blocks:
            raise BrokenPipeError

    with pytest.raises(BrokenPipeError):
        take()


def test_rows_of_standard_input_are_named_by_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with io.TextIOWrapper(io.BytesIO(b"t,q1\n0,1\n1,x\n")) as stream:
        monkeypatch.setattr("sys.stdin", stream)
        rows = open_rows("-")
        assert (rows.file, rows.names) == ("stdin", ("t", "q1"))
        with pytest.raises(InputError) as caught:
            list(rows.blocks)
    assert str(caught.value.problems[0].place).startswith("stdin:3:3")


def test_tables_are_not_changed(tmp_path: Path) -> None:
    (tmp_path / "rows.csv").write_text("t,q1\n0,1.25\n1,2\n")
    found = read_csv(tmp_path / "rows.csv")
    for array in (found.columns, found.decimals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 7
    assert found.column("q1").tolist() == [1.25, 2.0]
