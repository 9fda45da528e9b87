"""A command whose words may be numbers: negative ones are no options, and an option may take several."""

from __future__ import annotations

import re
from collections.abc import Mapping

import typer
import typer.core

_NUMBER_LIKE = re.compile(r"[-+]?(?:\.?[0-9][^=]*|\.?nan|\.?inf(?:inity)?)", re.IGNORECASE)
JOINED = ("--qd", "--near", "--point", "--s")
"""Options that take all the numbers behind them."""


class NumbersCommand(typer.core.TyperCommand):
    """Takes `--qd 1 -2 3` as one option and `-90` as a number, with or without `--` before it."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override]
        """Return what is left of the words when options are taken away."""
        takes: dict[str, int] = {}
        for parameter in self.get_params(ctx):
            if getattr(parameter, "is_flag", None) is not None:  # an option
                count = 0 if parameter.is_flag else parameter.nargs  # type: ignore[attr-defined]
                takes |= dict.fromkeys(parameter.opts, count)
        return super().parse_args(ctx, sorted_words(joined(args), takes))


def joined(args: list[str]) -> list[str]:
    """Return the words with the numbers behind each of `JOINED` put into one word, separated by commas.

    A word that has commas itself holds all the numbers.
    """
    words: list[str] = []
    rest = list(args)
    while rest and rest[0] != "--":
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if name not in JOINED:
            words.append(word)
            continue
        values = [value] if equals else []
        while rest and _NUMBER_LIKE.fullmatch(rest[0]) and "," not in "".join(values):
            values.append(rest.pop(0))
        words += [f"{name}={','.join(values)}"] if values else [word]
    return words + rest


def sorted_words(args: list[str], takes: Mapping[str, int]) -> list[str]:
    """Return the words with options first, then `--`, then everything else in its order.

    An option whose value is missing comes last and alone, so that `--` is not taken for it.

    Args:
        args: The words as they were typed.
        takes: How many words each option takes.
    """
    options: list[str] = []
    others: list[str] = []
    rest = list(args)
    while rest and rest[0] != "--":
        word = rest.pop(0)
        if word == "-" or not word.startswith("-") or _NUMBER_LIKE.fullmatch(word):
            others.append(word)
            continue
        count = takes.get(word, 0)
        if len(rest) < count or "--" in rest[:count]:
            return [*options, word]
        options += [word, *rest[:count]]
        rest = rest[count:]
    return [*options, "--", *others, *rest[1:]]
