"""Run the commands about arms in this process, with rows on standard input where a test has some."""

from __future__ import annotations

import io
import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer
from running import Outcome
from yaml_files import read_yaml

from trajcli.cli.arm_commands import COMMANDS
from trajcli.cli.command import register

ORACLES = Path(__file__).parents[1] / "oracles"


@cache
def arm_app() -> typer.Typer:
    app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)
    register(app, COMMANDS)
    return app


class Arms:
    """Calls commands and remembers nothing."""

    def __init__(self, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
        self._capfd, self._monkeypatch = capfd, monkeypatch

    def call(self, *arguments: str | float | Path, stdin: str = "") -> Outcome:
        self._monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(stdin.encode())))
        self._capfd.readouterr()
        with pytest.raises(SystemExit) as left:
            arm_app()([str(argument) for argument in arguments])
        return Outcome(left.value.code or 0, *self._capfd.readouterr())  # type: ignore[arg-type]

    def json(self, *arguments: str | float | Path, code: int = 0) -> Any:
        command, *rest = arguments
        outcome = self.call(command, "--json", *rest)
        assert outcome.code == code, outcome.err
        return json.loads(outcome.out, parse_constant=pytest.fail)


@cache
def cases(file: str) -> dict[str, dict[str, Any]]:
    rows = read_yaml(ORACLES / file)["cases"]
    return {row["id"]: row for row in rows}


def ids(file: str, *kinds: str) -> list[str]:
    return [name for name, case in cases(file).items() if case["kind"] in kinds]


def robot_file(folder: Path, table: dict[str, Any], **more: Any) -> Path:
    """Write the arm of an oracle case as a robot file, in rad and m."""
    kinds = {"R": "revolute", "P": "prismatic"}
    joints = [{**row, "type": kinds[row["type"]]} for row in table["dh"]]
    robot = {
        "convention": {"std": "standard", "mdh": "modified"}[table["convention"]],
        "joints": joints,
        **{key: {"matrix": table[key]} for key in ("base", "tool") if key in table},
        **more,
    }
    path = folder / "arm.yaml"
    path.write_text(json.dumps(robot))  # flow YAML
    return path
