"""Choice of robots from a list: by kind, number of joints, maker and words, in letters of any case."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from trajcli.errors import InputError
from trajcli.queries import catalogue_list
from trajcli.queries.catalogue_list import Selection, selected


def row(name: str, kind: str, maker: str | None, origin: str | None, title: str) -> dict[str, object]:
    joints = sum(map(int, kind[::2])) if kind[0].isdigit() else len(kind)
    return {"name": name, "kind": kind, "joints": joints, "maker": maker, "origin": origin, "title": title}


ROWS = [
    row("alpha6", "6R", "Acme Robotics", "real", "Acme A6"),
    row("beta7", "7R", "Bolt", "real", "Bolt seven"),
    row("scara", "RRPR", "Acme Robotics", "real", "Acme S4"),
    row("planar", "2R", None, "textbook", "Planar arm"),
    row("gantry", "3P", "Bolt", None, "Straße"),
]


@pytest.mark.parametrize(
    ("selection", "names"),
    [
        (Selection(), "alpha6 beta7 scara planar gantry"),
        (Selection(kind="6R"), "alpha6"),
        (Selection(kind="6r"), "alpha6"),
        (Selection(kind="RRRRRR"), "alpha6"),
        (Selection(kind="rr"), "planar"),
        (Selection(kind="02R"), "planar"),
        (Selection(kind="ppp"), "gantry"),
        (Selection(kind="rrpr"), "scara"),
        (Selection(kind="Real"), "alpha6 beta7 scara"),
        (Selection(kind="textbook"), "planar"),
        (Selection(joints=6), "alpha6"),
        (Selection(joints=4), "scara"),
        (Selection(joints=5), ""),
        (Selection(maker="acme"), "alpha6 scara"),
        (Selection(maker="ROBOT"), "alpha6 scara"),
        (Selection(maker=""), "alpha6 beta7 scara planar gantry"),
        (Selection(text="BET"), "beta7"),
        (Selection(text="seven"), "beta7"),
        (Selection(text="STRASSE"), "gantry"),
        (Selection(kind="real", maker="acme", joints=4), "scara"),
        (Selection(kind="real", text="planar"), ""),
    ],
)
def test_a_selection_means_the_robots_of_which_all_of_it_is_true(selection: Selection, names: str) -> None:
    assert [one["name"] for one in selected(ROWS, selection)] == names.split()


@pytest.mark.parametrize(
    ("selection", "said", "hint"),
    [
        (Selection(kind="5R"), "no robot of the kind '5R'", "R"),
        (Selection(kind="RR RR"), "no robot of the kind", "R"),
        (Selection(kind="R"), "no robot of the kind", "R"),
        (Selection(kind="textbok"), "no robot of the kind", "did you mean 'textbook'?"),
        (Selection(maker="Bold"), "no robot of a maker 'Bold'", "did you mean 'Bolt'?"),
        (Selection(maker="zzz"), "no robot of a maker 'zzz'", "makers are Acme Robotics, Bolt"),
    ],
)
def test_a_kind_and_a_maker_that_no_robot_has_are_refused(selection: Selection, said: str, hint: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        selected(ROWS, selection)
    assert hint in str(caught.value.problems[0].hint)


@pytest.mark.parametrize("index", ["of another catalogue", "[]", "{", "{}", '{"files": 1}', None])
def test_an_index_counts_only_for_the_catalogue_that_it_was_made_of(
    index: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, table = tmp_path / "index.json", tmp_path / "catalogue"
    table.write_bytes(b"a" * 1000 + b"b")
    monkeypatch.setattr(catalogue_list, "INDEX", place)
    monkeypatch.setattr(catalogue_list, "CATALOGUE", table)
    of_files = [{key: f"{key} {number}" for key in (*catalogue_list.IN_INDEX, "mass")} for number in range(3)]
    monkeypatch.setattr(catalogue_list, "rows_of_files", lambda: of_files)
    wanted = [{key: one[key] for key in catalogue_list.IN_INDEX} for one in of_files]
    right = {"files": catalogue_list.checksum(), "robots": [{"name": "first"}, {"name": "last"}]}
    if index is None:
        assert catalogue_list.catalogue_rows() == wanted
    elif index == "of another catalogue":
        place.write_text(json.dumps(right), encoding="utf-8")
        assert catalogue_list.catalogue_rows() == right["robots"]
        table.write_bytes(b"a" * 1000 + b"c")
        assert catalogue_list.catalogue_rows() == wanted
    else:
        place.write_text(index, encoding="utf-8")
        assert catalogue_list.catalogue_rows() == wanted
