"""What is skipped is said once, with the one command that installs it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from extras import pytest_terminal_summary, require_module

ROOT = Path(__file__).parents[1]
SETUP = "make -B setup EXTRAS=dev,dask,docs,viewers"


def skipped(name: str, package: str | None = None) -> SimpleNamespace:
    """Return the report of a test that was skipped for want of a module."""
    with pytest.raises(pytest.skip.Exception) as caught:
        require_module(name, package)
    return SimpleNamespace(longrepr=("test.py", 1, f"Skipped: {caught.value}"))


def said(*reports: SimpleNamespace) -> list[str]:
    lines: list[str] = []
    pytest_terminal_summary(SimpleNamespace(getreports=lambda _: list(reports), write_line=lines.append))
    return lines


def test_each_thing_is_said_once_with_one_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("extras._ALL", False)
    assert said() == []
    assert said(SimpleNamespace(longrepr=("test.py", 1, "Skipped: root may read everything"))) == []
    extra, other = skipped("no_such_module"), skipped("no_such_peer", "peer")
    tail = "installs the modules"
    assert said(extra, extra) == [f"2 tests were skipped, which need no_such_module: `{SETUP}` {tail}"]
    (both,) = said(other, extra)
    assert both.startswith("2 tests were skipped, which need no_such_module, no_such_peer: ")
    assert both.endswith(f": `{SETUP} && .venv/bin/python -m pip install peer` {tail}")
    assert said(other) == [
        f"1 tests were skipped, which need no_such_peer: `.venv/bin/python -m pip install peer` {tail}"
    ]


def test_the_command_names_all_extras_that_tests_use() -> None:
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(SETUP.partition("EXTRAS=")[2].split(",")) <= known.keys()
    assert SETUP.partition("EXTRAS=")[2] in (ROOT / "Makefile").read_text()


def test_where_all_extras_are_asked_for_an_absent_one_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("extras._ALL", True)
    with pytest.raises(pytest.fail.Exception, match="needs no_such_module"):
        require_module("no_such_module")
    with pytest.raises(pytest.skip.Exception):
        require_module("no_such_peer", "peer")
