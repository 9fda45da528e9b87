"""A command whose words may be numbers: negative ones are no options, and an option may take several."""

from __future__ import annotations

import re

import typer
import typer.core

_NUMBER_LIKE = re.compile(r"[-+]?\.?[0-9][^=]*")
JOINED = ("--qd", "--near")
"""Options that take all the numbers behind them."""


class NumbersCommand(typer.core.TyperCommand):
    """Takes `--qd 1 -2 3` as one option and `-90` as a number, with or without `--` before it."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Return what is left of the words when options are taken away."""
        ctx.ignore_unknown_options = True
        return super().parse_args(ctx, joined(args))


def joined(args: list[str]) -> list[str]:
    """Return the words with the numbers behind each of `JOINED` put into one word, separated by commas."""
    words: list[str] = []
    rest = list(args)
    while rest and rest[0] != "--":
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if name not in JOINED:
            words.append(word)
            continue
        values = [value] if equals else []
        while rest and _NUMBER_LIKE.fullmatch(rest[0]):
            values.append(rest.pop(0))
        words += [f"{name}={','.join(values)}"] if values else [word]
    return words + rest
