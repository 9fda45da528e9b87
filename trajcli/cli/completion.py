"""Completion by the shell of paths of a job, its joints, and quantities of pictures.

Functions of typer; whatever is wrong with the job, they offer what is known without it, and say nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any

import typer

_DEPTH = 3  # keys below which paths of the schema are not offered
_FROM_SCHEMA = ("units", "limits", "defaults", "when_over_limit", "zone", "output")


def paths_that_begin(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the paths of a job that begin so, each with its sign of equality: those it has, and may have."""
    from trajcli.job.schema import schema_of

    job = _job(ctx)
    paths = {*_stated(job), *_possible(schema_of("job"), job)}
    return sorted(f"{path}=" for path in paths if path.startswith(incomplete))


def joints_that_begin(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the names of the job's joints that begin so, behind those of a list that stand there."""
    from trajcli.errors import TrajcliError
    from trajcli.job.read import load_job

    for name in _sources(ctx):
        with suppress(TrajcliError, OSError, ValueError):
            return _behind_commas(load_job(name).robot.joint_names, incomplete)
    return []


def quantities_that_begin(incomplete: str) -> list[str]:
    """Return the quantities of pictures that begin so, behind those of a list that stand there."""
    from trajcli.plots.choice import QUANTITY_NAMES

    return _behind_commas(QUANTITY_NAMES, incomplete)


def _behind_commas(names: Iterable[str], incomplete: str) -> list[str]:
    """Return a list with each name at its end that begins as its last one, and is not among the others."""
    before, comma, begun = incomplete.rpartition(",")
    taken = before.split(",")
    return [f"{before}{comma}{name}" for name in names if name.startswith(begun) and name not in taken]


def _sources(ctx: typer.Context) -> list[str]:
    """Return the files that the command line names; what a shell completes has no standard input."""
    given = [ctx.params.get(key) for key in ("job", "sources", "files")]
    named = [name for value in given if value for name in ([value] if isinstance(value, str) else value)]
    return [name for name in (*named, *map(str, ctx.args)) if name != "-"]


def _job(ctx: typer.Context) -> Mapping[str, Any]:
    """Return the job that the command line names, as it stands in its file; nothing where there is none."""
    from trajcli.errors import TrajcliError
    from trajcli.job.yaml.load import read_document

    for name in _sources(ctx):
        with suppress(TrajcliError, OSError, ValueError):
            content: dict[str, Any] = read_document(name).plain()
            return content
    return {}


def _stated(value: Any, path: str = "") -> Iterator[str]:  # noqa: ANN401
    """Yield the path of each value that a job states: of numbers, texts, and lists of these."""
    inside: Iterable[tuple[Any, Any]] = ()
    if isinstance(value, Mapping):
        inside = value.items()
    elif isinstance(value, list) and any(isinstance(item, Mapping | list) for item in value):
        inside = enumerate(value)
    elif path:
        yield path
    for key, item in inside:
        yield from _stated(item, f"{path}.{key}" if path else str(key))


def _possible(schema: Mapping[str, Any], job: Mapping[str, Any]) -> Iterator[str]:
    """Yield paths that a job may have beside: what holds for all of it, and the fields of its moves."""
    definitions = schema["$defs"]
    for name in _FROM_SCHEMA:
        yield from _fields(schema["properties"][name], definitions, name, _DEPTH)
    planners = {
        form["properties"]["planner"]["const"]: form
        for form in definitions.values()
        if "planner" in form.get("properties", {})
    }
    moves = job.get("moves")
    for index, move in enumerate(moves if isinstance(moves, list) else ()):
        form = planners.get(move.get("planner")) if isinstance(move, Mapping) else None
        if form is not None:
            yield from _fields(form, definitions, f"moves.{index}", _DEPTH)


def _fields(form: Mapping[str, Any], definitions: Mapping[str, Any], path: str, depth: int) -> Iterator[str]:
    """Yield the paths below a part of the schema, or its own where it has none."""
    if "$ref" in form:
        form = definitions[form["$ref"].rpartition("/")[2]]
    properties = form.get("properties", {})
    if not properties or depth == 0:
        yield path
    elif depth > 0:
        for name, inner in properties.items():
            yield from _fields(inner, definitions, f"{path}.{name}", depth - 1)
