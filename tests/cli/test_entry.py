"""What the entry point does before a command runs: only what that command needs."""

from __future__ import annotations

import sys

import pytest

from trajcli.__main__ import _NoPlugins
from trajcli.cli import app as commands


def names_after(monkeypatch: pytest.MonkeyPatch, *words: str) -> list[str]:
    """Return which commands the entry point makes for a command line."""
    made = []
    register = commands.register
    monkeypatch.setattr(commands, "register", lambda app, some: (made.extend(some), register(app, some)))
    monkeypatch.setattr(sys, "argv", ["trajcli", *words])
    with pytest.raises(SystemExit):
        commands.run()
    return [command.word() for command in made]


def test_only_the_command_that_is_named_is_made(monkeypatch, capsys):
    assert names_after(monkeypatch, "fk", "--help") == ["fk"]
    assert " fk [OPTIONS] {Q...}" in capsys.readouterr().out  # its name, though it is the only one


@pytest.mark.parametrize("words", [(), ("--help",), ("plam",), ("--show-completion",)])
def test_without_a_command_all_are_made(monkeypatch, words):
    assert {"plan", "explain", "diff", "schema", "init", "fk", "ik"} < set(names_after(monkeypatch, *words))


def test_a_misspelt_command_is_answered_from_all_of_them(monkeypatch, capsys):
    names_after(monkeypatch, "plam")
    assert "Did you mean 'plan'" in capsys.readouterr().err


def test_pydantic_finds_no_plugins_but_all_else_of_its_own_module(monkeypatch):
    monkeypatch.setitem(sys.modules, _NoPlugins.REAL, _NoPlugins(_NoPlugins.REAL))
    from pydantic.plugin._loader import get_plugins

    assert list(get_plugins()) == []
    from pydantic.plugin._loader import PYDANTIC_ENTRY_POINT_GROUP

    assert PYDANTIC_ENTRY_POINT_GROUP == "pydantic"
    assert not isinstance(sys.modules[_NoPlugins.REAL], _NoPlugins)
