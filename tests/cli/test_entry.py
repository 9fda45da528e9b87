"""What the entry point does before a command runs: only what that command needs."""

from __future__ import annotations

import errno
import os
import signal
import sys
from types import SimpleNamespace
from typing import Any

import pytest

import trajcli.__main__ as entry
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


def failing(error: BaseException) -> Any:
    """Return a function that raises."""

    def run(*_words: object) -> None:
        raise error

    return run


def after(cause: BaseException, code: int) -> SystemExit:
    """Return what leaves with a code while another error is handled."""
    leaving = SystemExit(code)
    leaving.__context__ = cause
    return leaving


ENDS = [  # what ends the command line, its exit code, what stands on standard error
    (SystemExit(None), 0, ""),
    (SystemExit(3), 3, ""),
    (SystemExit("a reason"), 1, ""),
    (after(BrokenPipeError(), 1), 141, ""),
    (after(OSError(errno.ENOSPC, "full"), 1), 1, ""),
    (KeyboardInterrupt(), 130, ""),
    (BrokenPipeError(), 141, ""),
    (
        OSError(errno.ENOSPC, "No space left on device"),
        4,
        "error: cannot write standard output: No space left on device\n",
    ),
    (OSError(errno.EBADF, "Bad file descriptor"), 4, "error: cannot write standard output: it is closed\n"),
    (
        ModuleNotFoundError("gone", name="nothing"),
        2,
        "error: the library nothing is not installed, which this needs: ",
    ),
]


@pytest.mark.parametrize(("error", "code", "said"), ENDS, ids=range(len(ENDS)))
def test_each_end_of_the_command_line_has_its_exit_code(
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    error: BaseException,
    code: int,
    said: str,
) -> None:
    replaced: list[tuple[int, int]] = []
    monkeypatch.setattr(os, "dup2", lambda *numbers: replaced.append(numbers))
    monkeypatch.setattr(commands, "run", failing(error))
    monkeypatch.setattr(sys, "argv", ["trajcli", "plan"])
    assert entry._run() == code
    told = capfd.readouterr()
    assert (told.out, told.err[: len(said)], bool(told.err)) == ("", said, bool(said))
    assert [number for _, number in replaced] == [1] * (code == 4)  # else what is buffered fails again


def test_an_error_of_our_own_modules_is_not_one_of_a_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(commands, "run", failing(ModuleNotFoundError("gone", name="trajcli.gone")))
    monkeypatch.setattr(sys, "argv", ["trajcli", "plan"])
    with pytest.raises(ModuleNotFoundError):
        entry._run()


@pytest.mark.parametrize(
    "words", [["plan", "--version"], ["--version"], ["--version", "-v"], ["--version", "plan"]]
)
def test_the_version_is_asked_for_by_the_first_word_alone(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], words: list[str]
) -> None:
    monkeypatch.setattr(commands, "run", failing(SystemExit(7)))
    monkeypatch.setattr(sys, "argv", ["trajcli", *words])
    assert entry._run() == (7 if words[0] == "plan" else 2 if "plan" in words else 0)
    lines = capfd.readouterr().out.splitlines()
    assert len(lines) == 1 if words == ["--version"] else len(lines) > 2 if "-v" in words else not lines


def stream(error: BaseException | None) -> SimpleNamespace:
    return SimpleNamespace(flush=(lambda: None) if error is None else failing(error))


FULL = OSError(errno.ENOSPC, "No space left on device")
LEFT = [  # of standard output and standard error what flushing raises, and the code at the end
    (None, None, 3),
    (FULL, None, 4),
    (None, FULL, 3),
    (BrokenPipeError(), None, 141),
    (None, BrokenPipeError(), 141),
    (KeyboardInterrupt(), None, 130),
]


@pytest.mark.parametrize(("out", "err", "code"), LEFT)
def test_what_cannot_be_flushed_at_the_end_decides_the_exit_code(
    monkeypatch: pytest.MonkeyPatch, out: BaseException | None, err: BaseException | None, code: int
) -> None:
    handled: dict[int, object] = {}
    monkeypatch.setattr(signal, "signal", handled.__setitem__)
    monkeypatch.setattr(os, "dup2", lambda *_: None)
    monkeypatch.setattr(os, "_exit", lambda number: failing(SystemExit(number))())
    monkeypatch.setattr(sys, "stdout", stream(out))
    monkeypatch.setattr(sys, "stderr", stream(err))
    with pytest.raises(SystemExit) as left:
        entry._leave(3)
    assert left.value.code == code
    assert handled == {signal.SIGTERM: signal.SIG_DFL, signal.SIGHUP: signal.SIG_DFL}


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_with_its_code_and_the_next_one_is_not_heard(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    handled: dict[int, object] = {}
    monkeypatch.setattr(signal, "signal", handled.__setitem__)
    with pytest.raises(SystemExit) as left:
        entry._end(number, None)
    assert left.value.code == 128 + number
    assert handled == {signal.SIGTERM: signal.SIG_IGN, signal.SIGHUP: signal.SIG_IGN}


@pytest.mark.parametrize("asked", [True, False])
def test_what_the_caller_asks_for_is_kept(monkeypatch: pytest.MonkeyPatch, asked: bool) -> None:
    """Signals that are ignored, threads, plugins of pydantic."""
    handled: dict[int, object] = {}
    done: list[object] = []
    monkeypatch.setattr(signal, "signal", handled.__setitem__)
    usual = {signal.SIGTERM: signal.SIG_DFL, signal.SIGHUP: signal.SIG_IGN if asked else signal.SIG_DFL}
    monkeypatch.setattr(signal, "getsignal", usual.__getitem__)
    monkeypatch.setattr(entry.gc, "set_threshold", lambda *_: None)
    monkeypatch.setattr(entry, "_fill_closed_streams", lambda: done.append("streams"))
    monkeypatch.setattr(entry, "_run", lambda: done.append("run") or 5)
    monkeypatch.setattr(entry, "_leave", done.append)
    names = {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "3", "PYDANTIC_DISABLE_PLUGINS": "one"}
    for name, value in names.items():
        monkeypatch.setenv(name, value)
        if not asked:
            monkeypatch.delenv(name)
    monkeypatch.setitem(sys.modules, _NoPlugins.REAL, sys)
    entry.main()
    assert done == ["streams", "run", 5]
    assert [os.environ[name] for name in names] == ([*names.values()] if asked else ["1", "1", "__all__"])
    assert (sys.modules[_NoPlugins.REAL] is sys) == asked
    assert sorted(handled) == [signal.SIGTERM] if asked else sorted(usual)
