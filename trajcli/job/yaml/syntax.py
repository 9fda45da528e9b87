"""Explanation of YAML syntax errors, at the place of their cause.

libyaml and PyYAML's own parser stop at the same characters, with words that differ a little.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from trajcli.errors import Problem
from trajcli.job.yaml.document import place

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_GLUED = re.compile(r"""^[\s\-?]*(?P<text>[^\s"'#:,\[\]{}][^\s"'#:,\[\]{}]*:[^\s:/][^\s]*)""")
_HAS_VALUE = re.compile(r""":\s+[^\s#|>&!]""")


class _Complaint(NamedTuple):
    """What the parser said: lines and columns count from 0 here."""

    context: tuple[int, int]
    problem: tuple[int, int]
    lines: Sequence[str]

    def line(self, number: int) -> str:
        return self.lines[number] if 0 <= number < len(self.lines) else ""

    @property
    def here(self) -> str:
        """The rest of the line from the problem on."""
        return self.line(self.problem[0])[self.problem[1] :]


class _Verdict(NamedTuple):
    message: str
    hint: str | None
    at: tuple[int, int]
    length: int = 1


def syntax_problem(error: Exception, file: str, lines: Sequence[str]) -> Problem:
    """Return what is wrong with the syntax of a file.

    Args:
        error: What the parser raised; its marks count from 0.
        file: For the place.
        lines: Of the file.
    """
    problem = _mark(error, "problem_mark") or (max(len(lines) - 1, 0), 0)
    context = _mark(error, "context_mark") or problem
    words = [getattr(error, name, None) for name in ("context", "problem")]
    text = "; ".join(word for word in words if word) or str(error)
    complaint = _Complaint(context, problem, lines)
    for pattern, judge in _RULES:
        if pattern.search(text):
            verdict = judge(complaint)
            break
    else:
        verdict = _Verdict(f"this is no valid YAML: {text.splitlines()[0]}", None, problem)
    (line, column), length = verdict.at, verdict.length
    return Problem(verdict.message, verdict.hint, place(file, lines, line + 1, column + 1, length))


def spaced(glued: str) -> str:
    """Return the hint that puts a space after the first colon of `key:value`."""
    key, _, value = glued.partition(":")
    return f"write '{key}: {value}'"


def _mark(error: Exception, name: str) -> tuple[int, int] | None:
    mark = getattr(error, name, None)
    return (mark.line, mark.column) if mark is not None else None


def _glued(complaint: _Complaint, *numbers: int) -> _Verdict | None:
    """Return the verdict that a space is missing after a colon in one of the lines."""
    for number in numbers:
        match = _GLUED.match(complaint.line(number))
        if match:
            glued = match["text"]
            at = (number, match.start("text"))
            return _Verdict(f"no space after the colon in '{glued}'", spaced(glued), at, len(glued))
    return None


def _stray_colon(complaint: _Complaint) -> _Verdict:
    number, column = complaint.problem
    line, before = complaint.line(number), _line_before(complaint)
    if _HAS_VALUE.search(line[:column]):
        hint = "put the value in quotes, or write {key: value}"
        return _Verdict("a second `key: value` in one line", hint, complaint.problem)
    glued = _glued(complaint, before)
    if glued is not None:
        return glued
    start, key = len(line) - len(line.lstrip()), line[:column].strip()
    if _HAS_VALUE.search(complaint.line(before)):
        hint = f"line {before + 1} already has a value: check the indentation"
        return _Verdict(f"the key '{_cut(key)}' stands too far right", hint, (number, start), len(key))
    if before >= 0:
        text = complaint.line(before).strip()
        at = (before, complaint.line(before).index(text))
        return _Verdict(f"'{_cut(text)}' has no colon", "write `key: value`", at, len(text))
    return _Verdict("a colon cannot stand here", "put a text that holds a colon in quotes", complaint.problem)


def _line_before(complaint: _Complaint) -> int:
    """Return the number of the last line with content before the problem, or -1."""
    number = complaint.problem[0] - 1
    while number >= 0 and not complaint.line(number).partition("#")[0].strip():
        number -= 1
    return number


def _no_colon(complaint: _Complaint) -> _Verdict:
    number, column = complaint.context
    glued = _glued(complaint, number)
    if glued is not None:
        return glued
    text = complaint.line(number)[column:].partition(" #")[0].rstrip()
    return _Verdict(f"'{_cut(text)}' has no colon", "write `key: value`", complaint.context, len(text))


def _open_bracket(complaint: _Complaint) -> _Verdict:
    number, column = complaint.context
    bracket = complaint.line(number)[column : column + 1]
    close = {"[": "]", "{": "}"}.get(bracket, bracket)
    same_line = complaint.problem[0] == number and complaint.here.strip()
    if not same_line:
        return _Verdict(f"'{bracket}' is never closed", f"a comma or '{close}' is missing", complaint.context)
    if complaint.here[0] in "]}":
        message = f"'{complaint.here[0]}' does not close '{bracket}' of column {column + 1}"
        return _Verdict(message, f"'{close}' is missing", complaint.problem)
    message = f"expected ',' or '{close}' before this"
    return _Verdict(message, "a comma is missing, or quotes around a text", complaint.problem)


def _no_key(complaint: _Complaint) -> _Verdict:
    number, column = complaint.problem
    before = complaint.line(number)[:column].rstrip()
    here = complaint.here
    if here[:1] in ("]", "}"):
        return _Verdict(f"'{here[0]}' closes nothing", "remove it", complaint.problem)
    if here.startswith(":"):
        return _Verdict("a key is missing before the colon", None, complaint.problem)
    if before[-1:] in ("'", '"', "]", "}"):
        hint = "inside '...' write '' for a quote" if before[-1] == "'" else "check quotes and brackets"
        return _Verdict("text after the end of the value", hint, complaint.problem, len(here.rstrip()))
    if here.startswith("-"):
        hint = "a list stands below its key; after each '-' comes a space"
        return _Verdict("a list item among the keys of a mapping", hint, complaint.problem)
    glued = _glued(complaint, number)
    if glued is not None:
        return glued
    message = (
        f"this line begins in column {column + 1}, the keys before it in column {complaint.context[1] + 1}"
    )
    return _Verdict(message, "align the keys of one mapping", complaint.problem, _word(here))


def _no_item(complaint: _Complaint) -> _Verdict:
    column = complaint.context[1] + 1
    if complaint.here.startswith("-"):
        hint = "after each '-' comes a space, and the items of one list are aligned"
        return _Verdict(
            f"no item of the list of column {column}", hint, complaint.problem, _word(complaint.here)
        )
    message = f"this line belongs to no item of the list of column {column}"
    hint = "begin it with '- ', or align it with the keys of its item"
    return _Verdict(message, hint, complaint.problem, _word(complaint.here))


def _open_quote(complaint: _Complaint) -> _Verdict:
    number, column = complaint.context
    quote = complaint.line(number)[column : column + 1]
    return _Verdict(f"the quote {quote} is never closed", None, complaint.context)


def _bad_start(complaint: _Complaint) -> _Verdict:
    if complaint.here.startswith("\t"):
        return _Verdict("a tab in the indentation", "indent with spaces", complaint.problem)
    character = complaint.here[:1]
    return _Verdict(f"a value cannot begin with {character}", "put the text in quotes", complaint.problem)


def _bad_escape(complaint: _Complaint) -> _Verdict:
    number, column = complaint.problem
    start = complaint.line(number).rfind(
        "\\", 0, column + 1
    )  # the parsers stop before or behind the backslash
    at = (number, start) if start >= 0 else complaint.problem
    escape = complaint.line(number)[at[1] : at[1] + 2]
    hint = "in double quotes write \\\\ for a backslash, or use single quotes"
    return _Verdict(f"{escape} is no escape", hint, at, 2)


def _no_value(complaint: _Complaint) -> _Verdict:
    here = complaint.here[:1]
    if here == ":":
        return _Verdict("a key is missing before the colon", None, complaint.problem)
    message = f"expected a value, got '{here}'" if here else "expected a value"
    return _Verdict(message, None, complaint.problem)


def _glued_in_brackets(complaint: _Complaint) -> _Verdict:
    return _Verdict("no space after the colon", "write `key: value`", complaint.problem)


def _bad_question(complaint: _Complaint) -> _Verdict:
    return _Verdict("a value cannot begin with ?", "put the text in quotes", complaint.problem)


def _bad_item(complaint: _Complaint) -> _Verdict:
    hint = "begin the list in the next line, or write [a, b]"
    return _Verdict("a list item cannot begin here", hint, complaint.problem)


def _bad_marker(complaint: _Complaint) -> _Verdict:
    number, column = complaint.context
    marker = complaint.line(number)[column : column + 1]
    return _Verdict(f"a value cannot begin with {marker}", "put the text in quotes", complaint.context)


def _bad_block(complaint: _Complaint) -> _Verdict:
    return _Verdict(
        "this is no block text", "after | or > the line ends; the text is indented", complaint.context
    )


def _bad_directive(complaint: _Complaint) -> _Verdict:
    return _Verdict(
        "directives are not read: files are YAML 1.2", "remove this line", (complaint.problem[0], 0)
    )


def _after_end(complaint: _Complaint) -> _Verdict:
    glued = _glued(complaint, complaint.problem[0])
    if glued is not None:
        return glued
    if complaint.here[:1] in ("]", "}"):
        return _Verdict(f"'{complaint.here[0]}' closes nothing", "remove it", complaint.problem)
    if complaint.here.startswith(":"):
        return _Verdict("no space after the colon", "write `key: value`", complaint.problem)
    before = _line_before(complaint)
    if complaint.line(before)[:1].isalpha():  # a comment ends what was to be a key
        return _no_colon(complaint._replace(context=(before, 0)))
    return _Verdict("text after the end of the document", None, complaint.problem, _word(complaint.here))


def _word(text: str) -> int:
    return len(text.split(maxsplit=1)[0]) if text.strip() else 1


def _cut(text: str) -> str:
    return text if len(text) <= 40 else text[:40] + "..."


_RULES: tuple[tuple[re.Pattern[str], Callable[[_Complaint], _Verdict]], ...] = tuple(
    (re.compile(pattern), judge)
    for pattern, judge in (
        (r"mapping values are not allowed", _stray_colon),
        (r"unexpected ':'", _glued_in_brackets),
        (r"mapping keys are not allowed", _bad_question),
        (r"could not find expected ':'", _no_colon),
        (r"flow (sequence|mapping).*expected ',' or", _open_bracket),
        (r"quoted scalar.*(end of stream|document (separator|indicator))", _open_quote),
        (r"quoted scalar", _bad_escape),
        (r"cannot start any token|tab character", _bad_start),
        (r"directive|incompatible YAML", _bad_directive),
        (r"block scalar", _bad_block),
        (r"(anchor|alias|tag\b)", _bad_marker),
        (r"sequence entries are not allowed", _bad_item),
        (r"node content", _no_value),
        (r"document start", _after_end),
        (r"parsing a block mapping", _no_key),
        (r"parsing a block collection", _no_item),
    )
)
