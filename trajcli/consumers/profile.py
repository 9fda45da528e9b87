"""Profiles of consumers: what a controller asks of a motion, as data files with source and date.

A profile is one YAML file in `trajcli/profiles/`, in SI. What its rules compute stands in the table of
`trajcli.consumers.judgement`; a rule without a check is a note, which no rows can break.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Literal

from trajcli.columns import GROUPS, Group
from trajcli.errors import InputError, Problem
from trajcli.frozen import frozen
from trajcli.job.yaml.document import Document
from trajcli.job.yaml.load import read_document
from trajcli.suggest import did_you_mean, valid_names

PROFILES = Path(__file__).parent.parent / "profiles"
"""Folder of the profiles that come with trajcli."""

RuleSeverity = Literal["necessary", "recommended"]
_SEVERITIES = ("necessary", "recommended")
_HEAD = {"title": str, "interpolation": str, "note": str, "rows": dict, "sources": dict, "rules": list}
_ROWS = ("rate", "align", "columns")
_RULE = ("id", "check", "severity", "text", "parameters", "source")
_SOURCE = ("text", "commit", "date")
_INTERPOLATIONS = ("hold", "linear", "cubic", "quintic", "jtc", "jtc-upsampling")


@frozen
class Source:
    """Where a rule is from.

    Attributes:
        text: Which document or file.
        commit: Of the repository that was read; None for a document without one.
        date: When it was read, such as 2026-11.
    """

    text: str
    commit: str | None
    date: str


@frozen
class ConsumerRule:
    """One thing that a consumer asks of a motion.

    Attributes:
        id: Unique in the profile.
        check: What is computed, a name of the table of checks; None for a note.
        severity: Whether the consumer refuses or aborts a motion that breaks it, or runs it less well.
        text: One sentence for people.
        parameters: Of the check, SI.
        source: Where it is from.
    """

    id: str
    check: str | None
    severity: RuleSeverity
    text: str
    parameters: Mapping[str, Any]
    source: Source


@frozen
class WantedRows:
    """Rows as a consumer takes them.

    Attributes:
        columns: What stands in a row.
        rate: Hz; None where it takes rows at any times.
        align: Whether each move lasts a whole number of periods.
    """

    columns: tuple[Group, ...] = ("t", "q", "qd", "qdd")
    rate: float | None = None
    align: bool = False

    @property
    def words(self) -> str:
        """What it takes, for people."""
        rate = [] if self.rate is None else [f"rows at {self.rate:g} Hz"]
        align = ["moves of whole periods"] if self.align else []
        return ", ".join([*rate, *align, f"columns {', '.join(self.columns)}"])


@frozen
class Profile:
    """What a consumer asks of a motion.

    Attributes:
        name: Of the file, without its ending.
        title: Of the consumer.
        interpolation: How it runs from row to row, by the name that `--interpolate` takes; None where that
            is not known.
        note: What a user should know beside the rules.
        rows: As it takes them.
        rules: In the order of the file.
    """

    name: str
    title: str
    interpolation: str | None
    note: str | None
    rows: WantedRows
    rules: tuple[ConsumerRule, ...]


def profile_names(folder: Path | None = None) -> list[str]:
    """Return the names of the profiles in a folder, those that come with trajcli unless another is given."""
    return sorted(path.stem for path in (folder or PROFILES).glob("*.yaml"))


def read_profile(name: str, checks: Mapping[str, Mapping[str, Any]], folder: Path | None = None) -> Profile:
    """Return the profile that stands in the file of that name.

    Args:
        name: Of the file, without its ending.
        checks: The checks that a rule may name: the names of their parameters and the defaults of these,
            None where one must be given.
        folder: Where it is; that of the profiles that come with trajcli unless another is given.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    document = read_document(str((folder or PROFILES) / f"{name}.yaml"))
    problems = [*_flaws(document, checks)]
    if problems:
        raise InputError(*problems)
    plain = document.plain()
    sources = {
        key: Source(each["text"], each.get("commit"), each["date"]) for key, each in plain["sources"].items()
    }
    rules = tuple(
        ConsumerRule(
            each["id"],
            each.get("check"),
            each["severity"],
            each["text"],
            each.get("parameters") or {},
            sources[each["source"]],
        )
        for each in plain["rules"]
    )
    asked = plain.get("rows", {})
    columns = tuple(asked.get("columns", WantedRows.columns))
    rows = WantedRows(columns, asked.get("rate"), asked.get("align", False))
    return Profile(name, plain["title"], plain.get("interpolation"), plain.get("note"), rows, rules)


def _flaws(document: Document, checks: Mapping[str, Mapping[str, Any]]) -> Iterator[Problem]:
    plain = document.plain()
    yield from _of_keys(document, (), plain, _HEAD, ("title", "sources", "rules"))
    for key, kind in _HEAD.items():
        if key in plain and not isinstance(plain[key], kind):
            wanted = {str: "a text", dict: "a mapping", list: "a list"}[kind]
            yield Problem(f"`{key}`: expected {wanted}", None, document.place((key,)))
            return
    interpolation = plain.get("interpolation")
    if interpolation is not None and interpolation not in _INTERPOLATIONS:
        text = f"unknown interpolation '{interpolation}'"
        yield Problem(text, valid_names(_INTERPOLATIONS), document.place(("interpolation",)))
    yield from _of_rows(document, plain.get("rows", {}))
    for key, source in plain.get("sources", {}).items():
        yield from _of_keys(document, ("sources", key), source, _SOURCE, ("text", "date"))
    seen: set[str] = set()
    for index, rule in enumerate(plain.get("rules", [])):
        yield from _of_rule(document, index, plain, checks)
        name = rule.get("id") if isinstance(rule, dict) else None
        if name in seen:
            yield Problem(f"the rule '{name}' stands twice", None, document.place(("rules", index, "id")))
        seen.add(str(name))


def _of_rows(document: Document, rows: Mapping[str, Any]) -> Iterator[Problem]:
    yield from _of_keys(document, ("rows",), rows, _ROWS, ())
    columns = rows.get("columns")
    if columns is not None and not (isinstance(columns, list) and columns and {*columns} <= {*GROUPS}):
        text = "`columns`: expected a list of groups of columns"
        yield Problem(text, valid_names(GROUPS), document.place(("rows", "columns")))
    if not (rows.get("rate") is None or (_is_number(rows["rate"]) and rows["rate"] > 0)):
        yield Problem("`rate`: expected a number above 0, Hz", None, document.place(("rows", "rate")))
    if not isinstance(rows.get("align", False), bool):
        yield Problem("`align`: expected true or false", None, document.place(("rows", "align")))


def _of_rule(
    document: Document, index: int, plain: Mapping[str, Any], checks: Mapping[str, Mapping[str, Any]]
) -> Iterator[Problem]:
    at, rule = ("rules", index), plain["rules"][index]
    flaws = [*_of_keys(document, at, rule, _RULE, ("id", "severity", "text", "source"))]
    yield from flaws
    if flaws:
        return
    choices = {"severity": _SEVERITIES, "source": tuple(plain.get("sources", {})), "check": tuple(checks)}
    for key, names in choices.items():
        if rule.get(key) is not None and rule[key] not in names:
            hint = did_you_mean(str(rule[key]), names) or valid_names(names)
            yield Problem(f"unknown {key} '{rule[key]}'", hint, document.place((*at, key)))
            return
    parameters = rule.get("parameters") or {}
    wanted = checks[rule["check"]] if rule.get("check") else {}
    if rule.get("check"):
        required = [name for name, default in wanted.items() if default is None]
        yield from _of_keys(document, (*at, "parameters"), parameters, (*wanted,), required)
    for name, value in parameters.items():
        if not _is_parameter(value):
            text = f"`{name}`: expected a number, a list of numbers or a word"
            yield Problem(text, None, document.place((*at, "parameters", name)))


def _is_parameter(value: Any) -> bool:  # noqa: ANN401
    if isinstance(value, list):
        return bool(value) and all(_is_number(each) for each in value)
    return isinstance(value, str | bool) or _is_number(value)


def _is_number(value: Any) -> bool:  # noqa: ANN401
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _of_keys(
    document: Document,
    at: Sequence[str | int],
    value: Any,  # noqa: ANN401
    names: Sequence[str] | Mapping[str, Any],
    required: Sequence[str],
) -> Iterator[Problem]:
    """Yield a problem for each key of a mapping that is unknown or missing."""
    if not isinstance(value, dict):
        yield Problem("expected a mapping", None, document.place(at))
        return
    for key in value:
        if key not in names:
            hint = did_you_mean(str(key), names) or valid_names(names)
            yield Problem(f"unknown key '{key}'", hint, document.place((*at, key), key=True))
    for key in required:
        if value.get(key) is None:
            yield Problem(f"`{key}` is missing", None, document.place(at))
