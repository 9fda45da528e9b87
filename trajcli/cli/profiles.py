"""Profiles of consumers on the command line: `trajcli profiles`, and the words for what a profile finds."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import table_lines
from trajcli.cli.outcome import print_report
from trajcli.consumers.judgement import load_profile
from trajcli.consumers.profile import ConsumerRule, Profile, profile_names

if TYPE_CHECKING:
    from trajcli.cli.file_commands import ProfilesCommand

_WIDTH = 100


def run_profiles(options: ProfilesCommand) -> int:
    """Print the profiles that there are, or the rules of one; return the exit code.

    Raises:
        InputError: When there is no such profile.
    """
    name = options.name
    profiles = [load_profile(each) for each in profile_names()] if name is None else [load_profile(name)]
    views = [profile_view(profile) for profile in profiles]
    lines = _table(profiles) if name is None else _rules(profiles[0])
    print_report(views if name is None else views[0], lines, as_json=options.as_json)
    return 0


def profile_view(profile: Profile) -> dict[str, Any]:
    """Return a profile as `trajcli profiles --json` prints it."""
    return {
        "name": profile.name,
        "title": profile.title,
        "interpolation": profile.interpolation,
        "note": profile.note,
        "rows": {"rate": profile.rows.rate, "align": profile.rows.align, "columns": profile.rows.columns},
        "rules": [
            {
                "id": rule.id,
                "check": rule.check,
                "severity": rule.severity,
                "text": rule.text,
                "parameters": dict(rule.parameters),
                "source": rule.source.text,
                "commit": rule.source.commit,
                "date": rule.source.date,
            }
            for rule in profile.rules
        ],
    }


def _table(profiles: list[Profile]) -> Iterator[str]:
    head = ["name", "necessary", "recommended", "notes", "consumer"]
    rows = []
    for profile in profiles:
        kinds = [_kind(rule) for rule in profile.rules]
        counts = [str(kinds.count(kind)) for kind in ("necessary", "recommended", "note")]
        rows.append([profile.name, *counts, profile.title])
    yield from table_lines([head, *rows], "")


def _kind(rule: ConsumerRule) -> str:
    return "note" if rule.check is None else rule.severity


def _rules(profile: Profile) -> Iterator[str]:
    yield f"{profile.name}: {profile.title}"
    if profile.interpolation:
        yield f"interpolation: {profile.interpolation}"
    yield from textwrap.wrap(f"takes: {profile.rows.words}", _WIDTH, subsequent_indent="  ")
    if profile.note:
        yield from textwrap.wrap(f"note: {profile.note}", _WIDTH, subsequent_indent="  ")
    for rule in profile.rules:
        yield ""
        yield f"{rule.id} ({_kind(rule)})"
        yield from _wrapped(rule.text)
        if rule.parameters:
            shown = ", ".join(f"{name} {_number(value)}" for name, value in rule.parameters.items())
            yield from _wrapped(f"parameters (SI): {shown}")
        commit = f" at commit {rule.source.commit}" if rule.source.commit else ""
        yield from _wrapped(f"source: {rule.source.text}{commit}, read {rule.source.date}")


def _wrapped(text: str) -> Iterator[str]:
    yield from textwrap.wrap(
        text, _WIDTH, initial_indent="  ", subsequent_indent="    ", break_on_hyphens=False
    )


def _number(value: Any) -> str:  # noqa: ANN401
    if isinstance(value, list):
        return "[" + ", ".join(map(_number, value)) + "]"
    return str(value) if isinstance(value, str | bool) else f"{value:.9g}"
