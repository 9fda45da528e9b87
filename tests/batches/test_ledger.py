"""The ledger of outputs: an entry counts only while all that it says is so."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from trajcli.batches.ledger import LedgerEntry, hash_of_file, hash_of_inputs, read_ledger, write_ledger

ENTRY = LedgerEntry("aa", ("robot.yaml",), "bb", 1.5)


def test_every_part_of_the_inputs_changes_the_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_bytes(b"abc")
    two.write_bytes(b"def")
    files = [str(one), str(two)]
    hashes = [
        hash_of_inputs("a.yaml", b"job", files, "csv"),
        hash_of_inputs("b.yaml", b"job", files, "csv"),
        hash_of_inputs("a.yaml", b"jo", files, "csv"),
        hash_of_inputs("a.yaml", b"job", files, "mcap"),
        hash_of_inputs("a.yaml", b"job", files[:1], "csv"),
        hash_of_inputs("a.yaml", b"job", files[::-1], "csv"),
    ]
    one.write_bytes(b"abcd")
    two.write_bytes(b"ef")  # the same bytes in a row
    hashes.append(hash_of_inputs("a.yaml", b"job", files, "csv"))
    monkeypatch.setattr("trajcli.batches.ledger.__version__", "0.0.0")
    hashes.append(hash_of_inputs("a.yaml", b"job", files, "csv"))
    assert None not in hashes
    assert len(set(hashes)) == len(hashes)
    assert hash_of_inputs("a.yaml", b"job", [*files, str(tmp_path / "none")], "csv") is None


def test_a_file_has_the_hash_of_its_content(tmp_path: Path) -> None:
    content = bytes(range(256)) * 10_000
    (tmp_path / "rows.csv").write_bytes(content)
    assert hash_of_file(str(tmp_path / "rows.csv")) == hashlib.sha256(content).hexdigest()
    assert hash_of_file(str(tmp_path / "none.csv")) is None


def test_an_entry_takes_the_place_of_that_of_the_same_output(tmp_path: Path) -> None:
    path, newer = tmp_path / "ledger.json", LedgerEntry("cc", (), "dd", 0.0)
    for entry in (ENTRY, newer):
        write_ledger(path, {"a.csv": entry})
    assert read_ledger(path) == {"a.csv": newer}
    path.write_bytes(path.read_bytes().replace(b'"layout": 1', b'"layout": 2'))  # of another version
    assert read_ledger(path) == {}


def test_entries_are_added_to_those_of_other_outputs(tmp_path: Path) -> None:
    path = tmp_path / "ledger.json"
    write_ledger(path, {})
    assert not path.exists()
    write_ledger(path, {"a.csv": ENTRY})
    write_ledger(path, {"b.csv": LedgerEntry("cc", (), "dd", 0.0)})
    assert read_ledger(path) == {"a.csv": ENTRY, "b.csv": LedgerEntry("cc", (), "dd", 0.0)}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b'{"layout": 1, "outputs": []}',
        b"{",
        b"\xff",
        b'{"layout": 2, "outputs": {}}',
        b'{"layout": 1}',
        b'{"layout": 1, "outputs": {"a": 3}}',
    ],
)
def test_what_is_no_ledger_says_nothing(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "ledger.json"
    path.write_bytes(content)
    assert read_ledger(path) == {}
    write_ledger(path, {"a.csv": ENTRY})
    assert read_ledger(path) == {"a.csv": ENTRY}


def test_a_ledger_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    write_ledger(tmp_path / "none" / "ledger.json", {"a.csv": ENTRY})
    assert not (tmp_path / "none").exists()
