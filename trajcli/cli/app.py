"""The application that holds all commands, and other names of theirs.

Only typer is imported here: `--help` must stay fast.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import typer
import typer.core

from trajcli.cli.arm_commands import ARM_COMMANDS
from trajcli.cli.command import register
from trajcli.cli.file_commands import FILE_COMMANDS
from trajcli.cli.job_commands import JOB_COMMANDS
from trajcli.cli.motion_commands import MOTION_COMMANDS

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
}  # fmt: skip


class Commands(typer.core.TyperGroup):
    """The commands, which know by what other names people call them."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command of the first word, its name, and the words behind it."""
        known = _OTHER_NAMES.get(args[0].lower())
        if args[0] not in self.commands and known is not None:
            ctx.fail(f"No such command '{args[0]}': here it is `{known}`.")
        return super().resolve_command(ctx, args)

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:  # noqa: ANN401
        """Run the command; errors of usage have the form that the words ask for."""
        form = _form_of_errors(sys.argv[1:] if args is None else args)
        if form is None:
            return super().main(args, *rest, **options)
        try:
            code = super().main(args, *rest, **{**options, "standalone_mode": False})
        except Exception as error:
            words = getattr(error, "format_message", None)
            if words is None:  # no error of usage
                raise
            from trajcli.cli.outcome import report_error
            from trajcli.errors import InputError

            report_error(InputError(words(), hint="see --help"), form)
            sys.exit(InputError.exit_code)
        sys.exit(code or 0)


def _form_of_errors(words: Sequence[str]) -> Any:  # noqa: ANN401
    """Return in which form for programs errors are wanted; None where they are for people."""
    options = list(words[: words.index("--")] if "--" in words else words)
    forms = ("json", "github", "junit", "sarif")
    asked = (
        form for form in forms if f"--errors={form}" in options or ("--errors", form) in pairwise(options)
    )
    return next(asked, None)


app = typer.Typer(
    name="trajcli",
    cls=Commands,
    help="Trajectory planning for serial robots: a YAML job in, a verified sample stream out. "
    "`trajcli --version` prints the version.",
    epilog="Example: trajcli init job.yaml && trajcli plan job.yaml\n\n"
    "Exit codes: 0 done and verified, 1 judged and found wrong, 2 wrong input, 3 no curve exists, "
    "4 file trouble, 70 a bug in trajcli.",
    rich_markup_mode=None,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def commands() -> None:
    """Let typer ask for a command's name also where `run` leaves only one."""


register(app, (*JOB_COMMANDS, *FILE_COMMANDS, *ARM_COMMANDS, *MOTION_COMMANDS))


def run() -> None:
    """Run the command that the command line names; where it names none, print help."""
    # Typer makes every command it knows: more work than a plan.
    known = {info.callback.__name__: info for info in app.registered_commands if info.callback}
    app.registered_commands = [known[word] for word in sys.argv[1:2] if word in known] or [*known.values()]
    app()
