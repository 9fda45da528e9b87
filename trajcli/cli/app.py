"""The application that holds all commands, and other names of theirs.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from itertools import pairwise
from typing import Any

import typer
import typer.core

from trajcli.cli.command import CommandLine, register

_JUDGE = "trajcli plan JOB --no-output"
_OTHER_NAMES = {
    **dict.fromkeys(("validate", "verify", "lint", "test"), _JUDGE),
    **dict.fromkeys(("run", "simulate", "sample", "generate", "execute", "trajectory"), "trajcli plan JOB"),
    **dict.fromkeys(("transform", "rotation", "quaternion", "euler"), "trajcli pose STEP..."),
    **dict.fromkeys(("forward", "forward-kinematics"), "trajcli fk"),
    **dict.fromkeys(("inverse", "inverse-kinematics", "solve"), "trajcli ik"),
    "kinematics": "trajcli fk, trajcli ik or trajcli jacobian",
    **dict.fromkeys(("list", "ls", "robot", "catalogue", "catalog"), "trajcli robots"),
    **dict.fromkeys(("compare", "cmp"), "trajcli diff A B"),
    **dict.fromkeys(("new", "create", "start", "example"), "trajcli init"),
    **dict.fromkeys(("show", "describe", "info"), "trajcli explain JOB"),
    **dict.fromkeys(("draw", "graph", "picture", "chart"), "trajcli plot JOB"),
    **dict.fromkeys(("player", "animate", "animation", "html"), "trajcli view JOB -o view.html"),
    "report": "trajcli plan JOB --report FILE",
    "help": "trajcli --help",
    "version": "trajcli --version",
    **dict.fromkeys(("doctor", "versions"), "trajcli --version --verbose"),
}  # fmt: skip


GROUPS = {
    "Plan and judge": ("plan", "check", "explain", "payload", "batch", "sweep"),
    "Look": ("view", "plot", "diff"),
    "Motions": ("retime", "resample", "concat", "reverse", "slice", "convert"),
    "Kinematics and dynamics": ("fk", "ik", "jacobian", "dynamics", "pose", "mobility"),
    "Robots": ("robots", "urdf", "calibrate"),
    "Files and consumers": ("init", "schema", "profiles"),
}
"""The commands as `--help` lists them; each stands in one group."""


class Commands(typer.core.TyperGroup):
    """The commands, which know by what other names people call them."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command of the first word, its name, and the words behind it."""
        other = _OTHER_NAMES.get(args[0].lower())
        if args[0] not in self.commands and other is not None:
            ctx.fail(f"No such command '{args[0]}': here it is `{other}`.")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401
        """Run a command; of a wrong value the reason is said, and what was given."""
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix("Value error, ")
            found: list[Any] = getattr(error.__cause__, "errors", list)()
            if found and repr(found[0]["input"]) not in error.message:
                error.message = f"{found[0]['input']!r}: {error.message}"
            raise

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401
        """Write the commands by group, each with the first sentence of its help, uncut."""
        for title, words in GROUPS.items():
            records = [(word, self.commands[word].help or "") for word in words if word in self.commands]
            if records:
                with formatter.section(title):
                    formatter.write_dl([(word, _first_sentence(text)) for word, text in records])

    def main(self, args: Sequence[str] | None = None, *more: Any, **options: Any) -> Any:  # noqa: ANN401
        """Run the command; errors of usage have the form that the words ask for."""
        form = _form_of_errors(sys.argv[1:] if args is None else args)
        if form is None:
            return super().main(args, *more, **options)
        try:
            code = super().main(args, *more, **{**options, "standalone_mode": False})
        except Exception as error:
            words = getattr(error, "format_message", None)
            if words is None:  # no error of usage
                raise
            from trajcli.cli.outcome import report_error
            from trajcli.errors import InputError

            report_error(InputError(words(), hint="see --help"), form)
            sys.exit(InputError.exit_code)
        sys.exit(code or 0)


def _first_sentence(text: str) -> str:
    words = " ".join(text.split("\n\n", maxsplit=1)[0].split())
    return words.split(". ")[0].rstrip(".")


def _form_of_errors(words: Sequence[str]) -> Any:  # noqa: ANN401
    """Return in which form for programs errors are wanted; None where they are for people. The last holds."""
    options = words[: words.index("--")] if "--" in words else words
    parts = [part for word in options for part in word.split("=", 1 if word.startswith("--errors=") else 0)]
    asked = [form for name, form in pairwise(parts) if name == "--errors"][-1:]
    return next((form for form in asked if form in ("json", "github", "junit", "sarif")), None)


def application(commands: Sequence[type[CommandLine]]) -> typer.Typer:
    """Return the application with some commands."""
    made = typer.Typer(
        name="trajcli",
        cls=Commands,
        help="Trajectory planning for serial robots: a YAML job in, a verified sample stream out. "
        "`trajcli --version` prints the version, `trajcli --version --verbose` those of its libraries, too.",
        epilog="Example: trajcli init job.yaml && trajcli plan job.yaml\n\n"
        "Exit codes: 0 done and verified, 1 judged and found wrong, 2 wrong input, 3 no curve exists, "
        "4 file trouble, 70 a bug in trajcli.",
        rich_markup_mode=None,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    made.callback()(lambda: None)  # typer then asks for a command's name also where there is only one
    register(made, commands)
    return made


def commands_of_groups() -> Iterator[tuple[type[CommandLine], ...]]:
    """Yield the commands of one module after the other, in the order of `--help`."""
    for group in ("job", "file", "arm", "motion"):
        yield import_module(f"trajcli.cli.{group}_commands").COMMANDS


def run() -> None:
    """Run the command that the command line names; where it names none, print help.

    Typer makes every command it knows: more work than a plan, so it gets one.
    """
    seen: list[type[CommandLine]] = []
    for commands in commands_of_groups():
        for command in commands:
            if sys.argv[1:2] == [command.word()]:
                application([command])()
                return
        seen += commands
    application(seen)()


def __getattr__(name: str) -> typer.Typer:
    if name != "app":
        raise AttributeError(f"module 'trajcli.cli.app' has no attribute '{name}'")
    app = globals()["app"] = application([each for commands in commands_of_groups() for each in commands])
    return app
