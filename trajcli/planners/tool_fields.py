"""What a target of a move along a path of the tool may say."""

from __future__ import annotations

from collections.abc import Iterator

from trajcli.language.numbers import FieldPath, Flaw
from trajcli.language.targets import Target


def flaws_of_target(target: Target, path: FieldPath, planner: str) -> Iterator[Flaw]:
    """Yield what is wrong with the target of a move along a path: it is a place, and at rest."""
    if not target.is_place:
        yield path, f"{planner} needs a pose or `joints` in its target", None
    for name in ("velocity", "acceleration"):
        if any(getattr(target, name) or ()):
            yield (*path, name), f"{planner} ends at rest", "leave it out, or use a move in joint space"
