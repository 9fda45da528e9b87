"""Error classes, one branch for each exit code of the command line, and the problems that they carry.

A problem is one sentence about one thing that is wrong, with the numbers in it, its place in a file (if it
stands in one), and what would fix it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from typing import Literal, Self

from trajcli.frozen import comparable


@comparable
class Place:
    """Part of one line of a file. Lines and columns count from 1; line 0 is the whole file."""

    file: str
    line: int
    column: int
    source: str = ""
    length: int = 1

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


_DIGITS = 9
_FEW_DIGITS = 6
_SHOWN = 1e-13  # relative: a number that misses by no more than rounding is shown as it is


@comparable
class Amount:
    """A number inside a message, in SI, which a reader may want in other units.

    Attributes:
        value: SI; several are coordinates of a position.
        order: 0 for a position, 1 to 3 for its time derivatives.
        joint: Index of the joint that says whether angle or length is meant.
        dimension: "length" or "angle" of the tool; with neither this nor a joint the number is a time.
        rounded: "up" for a lower bound, "down" for an upper one: the number that is shown keeps it.
        unit: Where it is the same in all units of a job, such as "N m".
        digits: Of the number that is shown, in its unit; of coordinates nine.
    """

    value: float | tuple[float, ...]
    order: int = 0
    joint: int | None = None
    dimension: Literal["length", "angle"] | None = None
    rounded: Literal["up", "down"] | None = None
    unit: str | None = None
    digits: int = _DIGITS

    def __str__(self) -> str:
        if self.unit is not None:
            return f"{self.numbers()} {self.unit}"
        unit = {"length": " m", "angle": " rad", None: ""}[self.dimension]
        return self.numbers() + (unit + ("", "/s", "/s^2", "/s^3")[self.order] if unit else "")

    def numbers(self, scale: Callable[[float], float] = float) -> str:
        """Return the number, or the coordinates in brackets, each after `scale`."""
        if isinstance(self.value, tuple):
            return "[" + ", ".join(f"{scale(value) + 0.0:.9g}" for value in self.value) + "]"
        return f"{_towards(scale(self.value), self.rounded, self.digits):.{self.digits}g}"


def at_least(value: float) -> str:
    """Return a lower bound with six digits, rounded up where it is another number then."""
    return f"{_towards(value, 'up', _FEW_DIGITS):.{_FEW_DIGITS}g}"


def inward(value: float) -> Literal["up", "down"]:
    """Return the side to which a number is rounded so that its magnitude does not become more."""
    return "down" if value > 0 else "up"


def _towards(value: float, side: Literal["up", "down"] | None, digits: int = _DIGITS) -> float:
    """Return a number rounded to some digits, up or down where it is another one then."""
    nearest = float(f"{value:.{digits}g}")
    wrong = nearest < value if side == "up" else nearest > value
    if side is None or not wrong or abs(nearest - value) <= _SHOWN * abs(value):
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return nearest + (unit if side == "up" else -unit)


Amounts = Mapping[str, Amount | str]
"""What stands for each `{name}` in a message: a number, or a text of the user's, such as a joint's name."""

LONGEST_LINE = 4000
"""Characters of a message, or of a line for people, at most."""
_HALF_LINE = LONGEST_LINE // 2 - 3
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
"""Control characters, ends of lines, and what turns the direction of a text."""
_FIELD = re.compile(r"\{(\w+)\}")


@comparable
class Problem:
    """One thing that is wrong.

    A message with amounts is a template. What the user wrote, such as the name of a joint, is an amount of it
    and no part of its text, so that a joint named `{limit}` is just a name.

    Attributes:
        message: What is wrong, with the number and the bound, in the user's units.
        hint: What would fix it; it holds amounts as the message does.
        place: Where it stands in the user's file.
        move: Index of the move, from 0.
        joint: Name of the joint.
        time: Seconds from the start of the trajectory; in what a planner raises, of its move.
        value: The offending number, SI.
        limit: The bound it breaks, SI.
        amounts: Numbers and names that the message holds as `{name}`.
        field: Where below the move the value stands that it is about, such as ("to",); None where it is about
            no one value.
        kind: A stable word for programs, such as "velocity", where it comes from a finding.
        row: Of a table, from 1 without its header.
        severity: What services of continuous integration make of it: only an error fails their run.
    """

    message: str
    hint: str | None = None
    place: Place | None = None
    move: int | None = None
    joint: str | None = None
    time: float | None = None
    value: float | None = None
    limit: float | None = None
    amounts: Amounts = field(default_factory=dict)
    field: tuple[str | int, ...] | None = None
    kind: str | None = None
    row: int | None = None
    severity: Literal["error", "warning", "note"] = "error"

    def text(self, say: Callable[[Amount], str] = str) -> str:
        """Return the message with its amounts as `say` writes them."""
        return said(self.message, self.amounts, say)

    def advice(self, say: Callable[[Amount], str] = str) -> str | None:
        """Return the hint with its amounts as `say` writes them."""
        return None if self.hint is None else said(self.hint, self.amounts, say)

    def within(self, context: str) -> Problem:
        """Return the problem with `context: ` in front of its message."""
        if not self.amounts:
            return replace(self, message=f"{context}: {self.message}")
        name = f"context{len(self.amounts)}"
        return replace(self, message=f"{{{name}}}: {self.message}", amounts={**self.amounts, name: context})


def of_joint(
    name: str,
    message: str,
    hint: str | None,
    amounts: Amounts,
    *,
    value: float | None = None,
    limit: float | None = None,
    time: float | None = None,
) -> Problem:
    """Return a problem of a joint, whose message may name it as `{joint}`; the others are as in `Problem`."""
    named = {"joint": name, **amounts}
    return Problem(message, hint, joint=name, time=time, value=value, limit=limit, amounts=named)


def said(message: str, amounts: Amounts, say: Callable[[Amount], str] = str) -> str:
    """Return a message with its amounts, which stand in it as `{name}`, as `say` writes them.

    It is filled in one pass: braces inside of what is filled in are text. Of a very long one the middle is
    left out: a file may hold a name of a million characters.
    """

    def fill(match: re.Match[str]) -> str:
        amount = amounts.get(match[1], match[0])
        return amount if isinstance(amount, str) else say(amount)

    text = _FIELD.sub(fill, message) if amounts else message
    return text if len(text) <= LONGEST_LINE else f"{text[:_HALF_LINE]} ... {text[-_HALF_LINE:]}"


def utf8(name: str) -> str:
    """Return the name of a file in one line: bytes that are no UTF-8, and control characters, as escapes."""
    text = name.encode("utf-8", "backslashreplace").decode()
    return _CONTROL.sub(lambda match: match[0].encode("unicode_escape").decode("ascii"), text)


class TrajcliError(Exception):
    """Base of all errors that trajcli raises on purpose.

    Attributes:
        exit_code: What the command line returns for it.
        problems: At least one problem.
    """

    exit_code = 70

    def __init__(self, *problems: Problem | str, hint: str | None = None) -> None:
        self.problems = tuple(Problem(p, hint) if isinstance(p, str) else p for p in problems)
        super().__init__(*self.problems)

    def __str__(self) -> str:
        return "\n".join(problem.text() for problem in self.problems)

    def located(self, **fields: object) -> Self:
        """Return the same error with `fields` (of `Problem`) filled in where they are still empty."""
        problems = []
        for problem in self.problems:
            empty = {name: value for name, value in fields.items() if getattr(problem, name) is None}
            problems.append(replace(problem, **empty))  # type: ignore[arg-type]
        return self._of(problems)

    def said_by(self, say: Callable[[Amount], str]) -> Self:
        """Return the same error with the amounts of its messages as `say` writes them."""
        return self._of(
            replace(p, message=p.text(say), hint=p.advice(say), amounts={}) for p in self.problems
        )

    def _of(self, problems: Iterable[Problem]) -> Self:
        """Return the same error of other problems, whatever its class is made from."""
        made = type(self).__new__(type(self))
        made.__dict__ |= self.__dict__ | {"problems": tuple(problems)}
        made.args = made.problems
        return made


class VerificationError(TrajcliError):
    """A curve exists and a check fails, or files differ: nothing was written."""

    exit_code = 1


class InputError(TrajcliError):
    """The input is wrong: usage, content of a file, files that cannot be compared."""

    exit_code = 2


class MissingLimitError(InputError):
    """A planner needs a limit that nobody gave."""


class PlanningError(TrajcliError):
    """No curve exists: unreachable, impossible timing."""

    exit_code = 3


class FileError(TrajcliError):
    """A file is missing, unreadable or unwritable."""

    exit_code = 4
