"""Validation errors as problems that quote the file: place, what was expected, the nearest name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from trajcli.errors import Problem
from trajcli.job.yaml.load import Document
from trajcli.language.numbers import AT_KEY, FieldPath, Flaw, shown
from trajcli.planners import ALSO_CALLED, HANDLING, PLANNERS
from trajcli.suggest import did_you_mean, valid_names

_KINDS = {
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "dict_type": "a mapping",
    "int_type": "a whole number",
    "list_type": "a list",
    "model_attributes_type": "a mapping",
    "model_type": "a mapping",
    "string_type": "a text",
    "tuple_type": "a list",
}

_LAW_FIELDS = {
    "shape": "shape",
    "duration": "duration",
    "time": "duration",
    "minimum_duration": "minimum_duration",
    "speed": "speed",
    "velocity": "speed",
    "vel": "speed",
    "acceleration": "acceleration",
    "acc": "acceleration",
    "deceleration": "deceleration",
    "jerk": "jerk",
    "angular_speed": "angular_speed",
    "angular_acceleration": "angular_acceleration",
}
"""Words that stand beside `to` in other programs, with the field of the law that is meant."""
_NEEDS_NO_LIMIT = "quintic"  # the shape of a law that a duration is enough for


def problems_of(
    error: ValidationError, model: type[BaseModel], document: Document, prefix: FieldPath = ()
) -> list[Problem]:
    """Return one problem for each flaw, at its place in the file, in the order of the file.

    Args:
        error: Of pydantic.
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
    detail: ErrorDetails, model: type[BaseModel], document: Document, prefix: FieldPath
) -> list[tuple[FieldPath, str, str | None, bool]]:
    """Return (path in the file, message, hint, whether the key itself is wrong) of each flaw of one error."""
    kind, context, loc = detail["type"], detail.get("ctx", {}), detail["loc"]
    path = _path_in_file(_without_key_of_entry(loc), document, prefix)
    if kind == "flaws":
        flaws: list[Flaw] = context["flaws"]
        return [_flaw((*path, *below), text, hint) for below, text, hint in flaws]
    if kind == "extra_forbidden":
        names = _field_names(model, loc[:-1])
        known = (
            _other_place(path, names, document) or did_you_mean(str(path[-1]), names) or valid_names(names)
        )
        return [(path, f"unknown key '{path[-1]}'", known, True)]
    if kind == "missing":
        field = _model_at(model, loc[:-1]).model_fields[str(loc[-1])]
        return [(path, f"`{loc[-1]}` is missing", _described(field), False)]
    if kind == "union_tag_invalid":
        return [((*path, "planner"), *_unknown_planner(detail["input"]), False)]
    message, hint = _text(kind, context, detail["input"])
    if hint is None and kind in ("model_type", "model_attributes_type"):
        hint = valid_names(_field_names(model, loc), "its keys")
    return [(path, message, hint, False)]


def _without_key_of_entry(loc: FieldPath) -> FieldPath:
    """Return the path without the tag of an entry among the moves, which is a key of it, too."""
    return (*loc[:2], *loc[3:]) if loc[:1] == ("moves",) and loc[2:3] and loc[2] in HANDLING else loc


def _flaw(path: FieldPath, text: str, hint: str | None) -> tuple[FieldPath, str, str | None, bool]:
    at_key = path[-1:] == (AT_KEY,)
    return path[:-1] if at_key else path, text, hint, at_key


def _unknown_planner(move: object) -> tuple[str, str | None]:
    tag = move.get("planner") if isinstance(move, Mapping) else move
    if not isinstance(tag, str):
        return f"expected a planner's name, got {shown(tag)}", _every_planner()
    if tag in HANDLING:
        return f"{tag} is no planner", f"write `- {{{tag}: ...}}`: it stands alone between moves"
    meant = ALSO_CALLED.get(tag.strip().casefold().replace("-", "_").replace(" ", "_"))
    own = f"write `planner: {meant}` ({_every_planner()})" if meant else did_you_mean(tag, PLANNERS)
    return f"unknown planner '{tag}'", own or _every_planner()


def _every_planner() -> str:
    return f"planners: {', '.join(PLANNERS)}"


def _other_place(path: FieldPath, names: list[str], document: Document) -> str | None:
    """Return where a key of a move along a path stands instead, with the text to write."""
    move, key = document.node(path[:-1]), str(path[-1])
    if "law" not in names or move is None or not isinstance(move.value, dict):
        return None
    if key == "radius":
        return (
            "corners are rounded in a path: "
            "{planner: path, segments: [{line: ...}, {line: ...}], corner: round, radius: ...}"
        )
    if _LAW_FIELDS.get(key) is None:
        return None
    law = move.child("law")
    parts = dict(law.value) if law is not None and isinstance(law.value, dict) else {}
    parts |= {
        field: move.value[name]
        for name, field in _LAW_FIELDS.items()
        if name in move.value and field not in parts
    }
    texts = {name: node.text for name, node in parts.items()}
    if "shape" not in texts and texts.keys() <= {"duration"} and document.node(("limits", "tcp")) is None:
        texts = {"shape": _NEEDS_NO_LIMIT, **texts}
    if not all(texts.values()):
        return f"`{_LAW_FIELDS[key]}` stands under `law`"
    written = ", ".join(f"{name}: {text}" for name, text in texts.items())
    return f"`{_LAW_FIELDS[key]}` stands under `law`: write `law: {{{written}}}`"


def _text(kind: str, context: Mapping[str, Any], value: object) -> tuple[str, str | None]:
    if kind == "union_tag_not_found":
        keys = [str(key) for key in value] if isinstance(value, Mapping) else []
        meant = [near for key in keys if (near := did_you_mean(key, HANDLING))]
        if meant:
            return "a move needs `planner`", meant[0]
        return "a move needs `planner`", f"{_every_planner()}; between moves stand {' and '.join(HANDLING)}"
    if kind == "literal_error":
        names = [word.strip().strip("'") for word in context["expected"].replace(" or ", ", ").split(",")]
        quoted = isinstance(value, str) and value in names  # "1" where 1 is meant
        hint = f"write {value} without quotes" if quoted else did_you_mean(str(value), names)
        return f"expected {context['expected'].replace(chr(39), '')}, got {shown(value)}", hint
    if kind == "too_short":
        return f"the list is too short: expected at least {context['min_length']}", None
    if kind == "too_long":
        return f"expected at most {context['max_length']}, got {context['actual_length']}", None
    if kind == "string_too_short":
        return "expected a text that is not empty", None
    return f"expected {_KINDS.get(kind, 'another value')}, got {shown(value)}", None


def _described(field: FieldInfo) -> str | None:
    """Return what a field is for, as its annotation says."""
    texts = (getattr(note, "description", None) for note in field.metadata)
    text = field.description or next((text for text in texts if text), None)
    return text and text[0].lower() + text[1:].rstrip(".")


def _path_in_file(loc: FieldPath, document: Document, prefix: FieldPath) -> FieldPath:
    """Return the path of `loc` without the tags that pydantic puts in for the members of a union."""
    path = prefix
    for step in loc:
        node = document.node(path)
        if node is None or not isinstance(node.value, dict | list):
            break
        is_tag = isinstance(node.value, dict) and step in PLANNERS and "planner" in node.value
        if not is_tag or step in node.value:
            path = (*path, step)
    return path


def _field_names(model: type[BaseModel], loc: FieldPath) -> list[str]:
    """Return the keys that may stand at `loc`, read off the model."""
    fields = _model_at(model, loc).model_fields
    return [name for name, field in fields.items() if not field.exclude]


def _model_at(model: type[BaseModel], loc: FieldPath) -> type[BaseModel]:
    """Return the model of the mapping at `loc`."""
    current = model
    for step in loc:
        if isinstance(step, str) and step in PLANNERS:
            current = PLANNERS[step]
        elif isinstance(step, str) and step in HANDLING and step not in current.model_fields:
            current = HANDLING[step]
        elif isinstance(step, str) and step in current.model_fields:
            current = _model_in(current.model_fields[step].annotation) or current
    return current


def _model_in(annotation: Any) -> Any:  # noqa: ANN401
    """Return the model inside an annotation such as list[Model] or Model | None."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        model = _model_in(argument)
        if model is not None:
            return model
    return None
