"""The tables of the mutation campaign name what exists, and each survivor has its reason."""

from collections import Counter
from pathlib import Path

import pytest

from tests.mutants.tables import (
    KINDS,
    Survivor,
    read_planted,
    read_scores,
    read_survivors,
    subjects,
    write_score,
)

ROOT = Path(__file__).parents[2]
WHOLE = ("checks", "judge", "dynamics", "limits", "consumers")


def faults_of(survivor: Survivor) -> list[str]:
    """Return what is wrong with one entry."""
    path = ROOT / survivor.file
    lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []
    return [
        *([] if survivor.file in subjects() else ["its file is not in the table"]),
        *([] if survivor.line in lines else ["its line is not in the file"]),
        *([] if survivor.change != survivor.line else ["it changes nothing"]),
        *([] if survivor.kind in KINDS else ["its kind is none of " + ", ".join(KINDS)]),
        *([] if len(survivor.why.split()) > 3 else ["no reason is given"]),
    ]


def test_each_survivor_stands_in_its_file_and_has_a_reason() -> None:
    wrong = {(entry.file, entry.line): faults_of(entry) for entry in read_survivors()}
    assert not {where: faults for where, faults in wrong.items() if faults}
    assert max(Counter(read_survivors()).values(), default=1) == 1, "an entry stands twice"


def test_a_wrong_entry_is_seen() -> None:
    assert len(faults_of(Survivor("trajcli/none.py", "a", "a", "luck", "because"))) == 5


def test_each_file_that_proves_or_judges_is_in_the_table_with_tests_that_exist() -> None:
    table = subjects()
    missing = [
        path
        for folder in WHOLE
        for found in (ROOT / "trajcli" / folder).rglob("*.py")
        if found.name != "__init__.py" and (path := found.relative_to(ROOT).as_posix()) not in table
    ]
    named = {*table, *(test for tests in table.values() for test in tests)}
    assert not missing
    assert not [path for path in named if not (ROOT / path).exists()]


def test_planted_mutants_stand_in_files_of_the_table_and_change_them() -> None:
    planted = read_planted()
    assert {mutant.file for mutant in planted} <= subjects().keys()
    assert len(set(planted)) == len(planted)
    assert all(mutant.text != mutant.change for mutant in planted)
    texts = {mutant.file: (ROOT / mutant.file).read_text(encoding="utf-8") for mutant in planted}
    gone = [mutant for mutant in planted if mutant.text not in texts[mutant.file]]
    assert not gone, "of lines that were changed: what does the same to them now?"


def test_no_stored_number_of_our_own_kills_a_mutant() -> None:
    assert not [test for tests in subjects().values() for test in tests if "golden" in test]


def test_scores_are_of_files_in_the_table_and_agree_with_the_reasons() -> None:
    given = Counter(survivor.file for survivor in read_survivors())
    for path, score in read_scores().items():
        assert path in subjects()
        assert 0 <= score["open"] <= score["survived"] <= score["tried"] <= score["mutants"]
        assert given[path] or score["open"] == score["survived"], f"{path} has survivors without a reason"


@pytest.mark.parametrize("path", ["a.py", "b.py", "c.py"])
def test_a_score_replaces_that_of_its_file_only(tmp_path: Path, path: str) -> None:
    place = tmp_path / "scores.toml"
    place.write_text('# head\n"a.py" = { tried = 1 }\n"c.py" = { tried = 2 }\n', encoding="utf-8")
    write_score(place, path, {"tried": 3})
    before = {"a.py": 1, "c.py": 2} | {path: 3}
    wanted = ["# head", *(f'"{name}" = {{ tried = {before[name]} }}' for name in sorted(before))]
    assert place.read_text(encoding="utf-8").splitlines() == wanted
