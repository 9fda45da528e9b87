"""The command-line reference, from the commands' own signatures."""

from __future__ import annotations

import typing
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from inspect import Parameter, getdoc, signature, unwrap
from typing import Any, Literal

from typer.models import ArgumentInfo, OptionInfo

from docs.markdown import first_sentence, table
from trajcli.cli.app import app
from trajcli.cli.outcome import BUG, INTERRUPTED, PIPE_CLOSED
from trajcli.errors import TrajcliError

_INTRODUCTION = """\
Data go to stdout, words for people to stderr. A file that is written appears whole or not at all. `-`
is standard input where a file is read, and standard output where one is written. `NO_COLOR` is
honoured. `trajcli --version` prints the version, `trajcli --version --verbose` those of all libraries and
what extras lack, as a report of a bug needs it. `trajcli --install-completion` completes commands in
the shell, with names of robots and profiles, paths for `--set` and `--vary`, joints and quantities of
pictures, and every command has `--help`."""

_JSON_ERRORS = """\
With `--errors json` an error is one line on stderr, errors of usage included:
`{"error": CLASS, "exit": CODE, "problems": [...]}`. Each problem has the same keys; what is not
known is `null`:

| key | meaning |
|---|---|
| `message`, `hint` | What is wrong, and what would fix it, in the job's units. |
| `file`, `line`, `column`, `length` | Where it stands; lines and columns count from 1. |
| `move` | The move, from 0. |
| `joint` | The joint's name. |
| `time` | When, s from the start of the trajectory, as in the message and in the report. |
| `value`, `limit` | The number and the bound that it breaks, SI. |"""

_OTHER_CODES = [
    (INTERRUPTED, "Interrupted by the user."),
    (PIPE_CLOSED, "The reader closed the pipe; nothing is said about it."),
]


@dataclass(frozen=True)
class CommandParameter:
    """An argument or option of a command.

    Attributes:
        info: What typer knows about it.
        name: The function's parameter.
        choices: The words it may be; empty when it may be anything.
        default: What holds when it is left out; `Parameter.empty` when it may not be.
    """

    info: ArgumentInfo | OptionInfo
    name: str
    choices: tuple[str, ...]
    default: Any

    @property
    def shown(self) -> str:
        """How it is written on the command line."""
        value = self.info.metavar or "|".join(self.choices)
        if isinstance(self.info, ArgumentInfo):
            return f"`{value if self.info.metavar else self.name.upper()}`"
        # inside Annotated, typer takes the first name for what used to be the default
        names = sorted(map(str, [self.info.default, *(self.info.param_decls or ())]), key=len)
        return f"`{', '.join(names)}{f' {value}' if value else ''}`"

    @property
    def default_shown(self) -> str:
        """What the reference says about its default."""
        if self.default is Parameter.empty:
            return "required"
        return f"`{self.default}`" if self.default not in (None, False, "", []) else ""


def command_names() -> list[str]:
    """Return the names of the commands, in order."""
    return [_callback(command).__name__ for command in app.registered_commands]


def parameters(function: Callable[..., Any]) -> Iterator[CommandParameter]:
    """Yield the arguments and options of a command."""
    hints = typing.get_type_hints(function, include_extras=True)
    for name, parameter in signature(function).parameters.items():
        bare, info = typing.get_args(hints[name])[:2]
        choices = typing.get_args(bare) if typing.get_origin(bare) is Literal else ()
        yield CommandParameter(info, name, choices, parameter.default)


def cli_reference() -> str:
    """Return the page."""
    parts = ["# Command line", _INTRODUCTION]
    for command in app.registered_commands:
        parts += list(_command(_callback(command), str(command.epilog)))
    return (
        "\n\n".join([*parts, "## Exit codes", _exit_codes(), "## Errors for programs", _JSON_ERRORS]) + "\n"
    )


def _callback(command: Any) -> Callable[..., Any]:  # noqa: ANN401
    callback: Callable[..., Any] = unwrap(command.callback)
    return callback


def _command(function: Callable[..., Any], epilog: str) -> Iterator[str]:
    found = list(parameters(function))
    arguments = [item for item in found if isinstance(item.info, ArgumentInfo)]
    options = [item for item in found if isinstance(item.info, OptionInfo)]
    usage = " ".join(
        item.shown[1:-1] if item.default is Parameter.empty else f"[{item.shown[1:-1]}]" for item in arguments
    )
    yield f"## trajcli {function.__name__}"
    yield f"`trajcli {function.__name__} {usage} [options]`"
    yield getdoc(function) or ""
    yield f"Example: `{epilog.removeprefix('Example: ')}`"
    rows = [[item.shown, item.default_shown, _help(item)] for item in (*arguments, *options)]
    yield table(["argument or option", "default", "meaning"], rows)


def _help(item: CommandParameter) -> str:
    several = isinstance(item.default, list)
    choices = (
        f" One of {', '.join(item.choices)}." if item.choices and isinstance(item.info, ArgumentInfo) else ""
    )
    return f"{item.info.help}{choices}{' May stand several times.' if several else ''}"


def _exit_codes() -> str:
    rows = [(0, "Done, and verified.")]
    rows += [(error.exit_code, first_sentence(error.__doc__)) for error in TrajcliError.__subclasses__()]
    rows += [(BUG, "A bug in trajcli."), *_OTHER_CODES]
    return table(["exit", "meaning"], [[str(code), text] for code, text in rows])
