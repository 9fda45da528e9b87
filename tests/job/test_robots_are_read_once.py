"""Robot files: read once in a process as long as their content stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from trajcli.api.plans import load_robot
from trajcli.catalogue.entries import catalogue_names
from trajcli.job import robot as robots

ROBOT = "joints: [{velocity: 1}, {velocity: 2}]\n"


@pytest.fixture
def parsed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the files whose content is parsed from now on."""
    names: list[str] = []
    parse = robots.parse_document

    def counted(content: bytes, file: str) -> object:
        names.append(file)
        return parse(content, file)

    monkeypatch.setattr(robots, "parse_document", counted)
    robots._sheet_of.cache_clear()
    return names


def test_a_robot_is_parsed_once_and_anew_when_its_file_changes(tmp_path: Path, parsed: list[str]) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ROBOT)
    first, second = load_robot(path), load_robot(path)
    assert parsed == [str(path)]
    assert first is not second
    assert first.limits.velocity[:, 1].tolist() == second.limits.velocity[:, 1].tolist() == [1, 2]
    path.write_text(ROBOT.replace("2", "3"))
    assert load_robot(path).limits.velocity[:, 1].tolist() == [1, 3]
    assert parsed == [str(path)] * 2


def test_what_one_computes_of_its_robot_is_not_in_another(parsed: list[str]) -> None:
    first = load_robot("ur5e")
    first.fk([0.0] * 6)
    assert first.joint_names == load_robot("ur5e").joint_names
    assert len(parsed) == 1


def test_all_robots_of_the_catalogue_are_kept() -> None:
    assert robots._sheet_of.cache_info().maxsize > len(catalogue_names())
