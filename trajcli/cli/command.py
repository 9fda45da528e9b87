"""Descriptions of commands: one class a command, whose fields are its arguments and options for typer.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from functools import cached_property
from importlib import import_module
from inspect import Parameter, Signature, get_annotations
from typing import Any, ClassVar, NoReturn, Self, TypeVar, dataclass_transform, get_type_hints

import typer
import typer.core

from trajcli.cli.options import Errors
from trajcli.cli.outcome import ErrorForm, exit_code

P = TypeVar("P")
_ARGUMENT_TYPE = re.compile(r" <(?:str|int|float|list\[str\])>$")
_MEANT = {
    "-j": "-j is how many processes `batch` uses; say --job, or --json",
    "--json": "rows are JSON with --format jsonl, the report of `plan` with --report FILE, "
    "and `batch` prints nothing else",
}
_OF_JOB = {
    "--limits": "velocity",
    **{f"--{name}": name for name in ("velocity", "acceleration", "jerk", "effort")},
}  # what a job says of its limits


class Words(typer.core.TyperCommand):
    """Takes words apart, and says what an option means where a command has none of that name."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Return what is left of the words when options are taken away."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            name = getattr(error, "option_name", "")
            meant = _MEANT.get(name)
            if name in _OF_JOB and any("--set" in param.opts for param in self.get_params(ctx)):
                key = f"limits.{_OF_JOB[name]}"
                meant = f"a job says its limits, and --set {key}=NUMBER changes one, in the units of the job"
            if meant is None or type(error).__name__ != "NoSuchOption":
                raise
            ctx.fail(f"{error}: {meant}")

    def collect_usage_pieces(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Return the words behind the command's name, without marks of what must be given."""
        return [re.sub(r"^\{(.*)\}$", r"\1", piece) for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]  # noqa: ANN401
        """Write arguments by their names alone, and defaults as they are typed."""
        for title, kind in (("Arguments", "argument"), ("Options", "option")):
            of_kind = [param for param in self.get_params(ctx) if param.param_type_name == kind]
            records = [record for param in of_kind if (record := param.get_help_record(ctx)) is not None]
            if records:
                with formatter.section(title):
                    formatter.write_dl(
                        [(_ARGUMENT_TYPE.sub("", name), _default(text)) for name, text in records]
                    )


def _default(text: str) -> str:
    """Return a help text whose default, given in words, stands in no parentheses of its own."""
    return re.sub(r"\[default: \(([^()]*)\)(?=[\];])", r"[default: \1", text)


@dataclass_transform(kw_only_default=True, frozen_default=True)
class CommandLine:
    """What a command line says; a subclass states each argument and option once, its docstring is the help.

    `trajcli NAME` is what the class `NameCommand` describes, and `run_name` in the module of that name does.

    Attributes:
        example: A command line that runs.
        module: Where the function stands; the command's name where it is empty.
        parser: How typer takes the words apart.
    """

    example: ClassVar[str]
    module: ClassVar[str] = ""
    parser: ClassVar[type[typer.core.TyperCommand]] = Words
    errors: ErrorForm

    def __init__(self, **given: Any) -> None:  # noqa: ANN401
        vars(self).update(given)

    def replaced(self, **given: Any) -> Self:  # noqa: ANN401
        """Return the same with other values for some fields."""
        return type(self)(**{**vars(self), **given})

    def part(self, kind: type[P]) -> P:
        """Return a frozen value whose fields are those of the same names here."""
        return kind(**{name: getattr(self, name) for name in kind.__match_args__})  # type: ignore[attr-defined]

    @classmethod
    def word(cls) -> str:
        """Return the command's name."""
        return cls.__name__.removesuffix("Command").lower()

    @classmethod
    def fields(cls) -> dict[str, Any]:
        """Return the type of each field with what typer knows; a command's own before inherited ones."""
        hints = get_type_hints(cls, include_extras=True)
        described = cls.__mro__[: cls.__mro__.index(CommandLine)]
        return {name: hints[name] for each in described for name in get_annotations(each)}


class Command(CommandLine):
    """A command whose errors are for people, or for programs as JSON."""

    errors: Errors = "text"


class Callback:
    """A command as the function that typer asks for; its options are read when typer makes the command."""

    def __init__(self, command: type[CommandLine]) -> None:
        self._command = command
        self.__name__, self.__doc__ = command.word(), command.__doc__

    @cached_property
    def __annotations__(self) -> dict[str, Any]:  # type: ignore[override]
        return self._command.fields()

    @cached_property
    def __signature__(self) -> Signature:
        command = self._command
        return Signature(
            [
                Parameter(
                    name,
                    Parameter.KEYWORD_ONLY,
                    default=getattr(command, name, Parameter.empty),
                    annotation=hint,
                )
                for name, hint in self.__annotations__.items()
            ]
        )

    def __call__(self, **given: Any) -> NoReturn:  # noqa: ANN401
        """Leave with the exit code of the command."""
        command = self._command(**given)
        sys.exit(exit_code(_run, command, command.errors))


def _run(command: CommandLine) -> int:
    module = import_module(f"trajcli.cli.{command.module or command.word()}")
    return int(getattr(module, f"run_{command.word()}")(command))


def register(app: typer.Typer, commands: Iterable[type[CommandLine]]) -> None:
    """Add commands to an application, in their order."""
    for command in commands:
        app.command(command.word(), cls=command.parser, epilog=f"Example: {command.example}")(
            Callback(command)
        )
