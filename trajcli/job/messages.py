"""From pydantic's errors to problems that quote the file: line, column, what was expected, the nearest name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from trajcli.errors import Problem
from trajcli.job.load import Document
from trajcli.job.suggest import did_you_mean, valid_names
from trajcli.planners import PLANNERS
from trajcli.planners.reading import Flaw, shown

Path = tuple[str | int, ...]
_KINDS = {
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "list_type": "a list",
    "bool_type": "true or false",
}
_KINDS |= {"string_type": "a text", "model_attributes_type": "a mapping", "int_type": "a whole number"}
_KINDS |= {"bool_parsing": "true or false"}


def problems_of(
    error: ValidationError, model: type[BaseModel], document: Document, prefix: Path = ()
) -> list[Problem]:
    """Return one problem for each flaw, at its place in the file, in the order of the file.

    Args:
        error: What pydantic found.
        model: The model of the mapping at `prefix`.
        document: The file.
        prefix: Where in the file the validated mapping stands.
    """
    problems: dict[tuple[int, int, str], Problem] = {}
    for detail in error.errors(include_url=False):
        for path, message, hint, at_key in _flaws(detail, model, document, prefix):
            place = document.place(path, key=at_key)
            problems.setdefault((place.line, place.column, message), Problem(message, hint, place))
    return [problems[key] for key in sorted(problems, key=lambda key: key[:2])]


def _flaws(
    detail: ErrorDetails, model: type[BaseModel], document: Document, prefix: Path
) -> list[tuple[Path, str, str | None, bool]]:
    kind, context = detail["type"], detail.get("ctx", {})
    path, inside_name = _path_in_file(detail["loc"], document, prefix)
    if inside_name:
        return []  # the flaw is the named point's, and is reported where the point stands
    if kind == "flaws":
        flaws: list[Flaw] = context["flaws"]
        return [((*path, *below), text, hint, False) for below, text, hint in flaws]
    if kind == "extra_forbidden":
        names = _field_names(model, detail["loc"][:-1])
        known = did_you_mean(str(path[-1]), names) or valid_names(names)
        return [(path, f"unknown key '{path[-1]}'", known, True)]
    if kind == "missing":
        return [(path, f"`{detail['loc'][-1]}` is missing", None, False)]
    at = (*path, "planner") if kind == "union_tag_invalid" else path
    return [(at, *_text(kind, context, detail["input"]), False)]


def _text(kind: str, context: Mapping[str, Any], value: object) -> tuple[str, str | None]:
    if kind == "union_tag_invalid":
        tag = str(context["tag"])
        return f"unknown planner '{tag}'", did_you_mean(tag, PLANNERS) or valid_names(PLANNERS)
    if kind == "union_tag_not_found":
        return "a move needs `planner`", valid_names(PLANNERS)
    if kind == "literal_error":
        names = [word.strip().strip("'") for word in context["expected"].replace(" or ", ", ").split(",")]
        hint = did_you_mean(str(value), names)
        return f"expected {context['expected'].replace(chr(39), '')}, got {shown(value)}", hint
    if kind == "too_short":
        return f"expected at least {context['min_length']}, got {context['actual_length']}", None
    if kind == "too_long":
        return f"expected at most {context['max_length']}, got {context['actual_length']}", None
    if kind == "string_too_short":
        return "expected a text that is not empty", None
    return f"expected {_KINDS.get(kind, 'another value')}, got {shown(value)}", None


def _path_in_file(loc: Path, document: Document, prefix: Path) -> tuple[Path, bool]:
    """Return the path of `loc` without the union tags, and whether it goes on below a point's name."""
    path = prefix
    for step in loc:
        node = document.node(path)
        value = node.value if node is not None else None
        if isinstance(value, dict):
            is_tag = step in PLANNERS and "planner" in value and step not in value
            if not is_tag:
                path = (*path, step)
        elif isinstance(value, list):
            path = (*path, step)
        elif isinstance(value, str):
            return path, True
    return path, False


def _field_names(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """Return the keys that may stand at `loc`, read off the model."""
    current: Any = model
    for step in loc:
        if isinstance(step, str) and step in PLANNERS:
            current = PLANNERS[step]
        elif isinstance(step, str) and isinstance(current, type) and issubclass(current, BaseModel):
            field = current.model_fields.get(step)
            current = _model_in(field.annotation) if field is not None else current
    return list(current.model_fields) if isinstance(current, type) and issubclass(current, BaseModel) else []


def _model_in(annotation: Any) -> Any:  # noqa: ANN401
    """Return the model inside an annotation such as list[Model] or Model | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _model_in(argument)
        if found is not None:
            return found
    return None
