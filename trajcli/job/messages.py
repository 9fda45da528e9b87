"""Validation errors as problems that quote the file: place, what was expected, the nearest name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, TypeVar, get_origin

import numpy as np
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from trajcli.errors import InputError, Problem
from trajcli.geometry.rotation import check_rotation
from trajcli.job.yaml.document import Node
from trajcli.job.yaml.load import Document
from trajcli.language.limits import LimitsSpec
from trajcli.language.numbers import AT_KEY, FieldPath, Flaw, FlawError, ReadingContext, shown
from trajcli.language.points import RELATIVE_FIELDS
from trajcli.language.poses import read_rows
from trajcli.language.targets import Target
from trajcli.planners import ALSO_CALLED, HANDLING, PLANNERS, defaults_of_paths
from trajcli.planners.planner import Event, Planner
from trajcli.suggest import abridged, did_you_mean, valid_names

M = TypeVar("M", bound=BaseModel)
_NOTED = 1e-12  # a smaller defect of a rotation matrix is rounding
_KINDS = {
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
_KEYS_ELSEWHERE = {
    "move": "moves",
    "target": "to",
    "goal": "to",
    "end": "to",
    "position": "xyz",
    "orientation": "rpy",
    "accel": "acceleration",
    "acc": "acceleration",
    "vel": "velocity",
    "speed": "velocity",
    "decel": "deceleration",
    "time": "duration",
    "waypoints": "through",
    "points": "through",
    "torque": "effort",
    "tcp": "tool",
    "waypoint": "to",
    **dict.fromkeys(
        ("blend", "blend_radius", "radius", "rounding", "c_dis", "c_ptp", "z", "cnt", "fine", "corner", "r"),
        "zone",
    ),
    **dict.fromkeys(
        (f"z{size}" for size in (0, 1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)), "zone"
    ),
}
"""Keys of other programs, with that of a job where such a key may stand."""
_ENTRIES_ELSEWHERE = {
    **dict.fromkeys(
        ("wait", "sleep", "dwell", "pause", "delay"),
        "write `- {{planner: hold, duration: {value}}}`: the arm stands for that long",
    ),
    **dict.fromkeys(
        ("repeat", "loop", "for", "while", "times"),
        "write `- {{repeat: 3, moves: [...]}}`, or in place of 3 the name of points that are many",
    ),
    **dict.fromkeys(
        ("mark", "label", "comment", "marker", "id"),
        "a move has a `label`, which reports and pictures show",
    ),
    **dict.fromkeys(
        ("io", "output", "signal", "set", "gripper", "grip", "open", "close", "event"),
        "write `- {{signal: NAME, value: 1}}` where the arm stands, or `at: {{signal: NAME, value: 1}}` in "
        "the move before; what the tool then carries is said by attach and detach",
    ),
    **dict.fromkeys(
        ("goto", "go", "move", "move_to", "moveto"),
        "write `- {{planner: jerk_limited, to: {value}}}`",
    ),
    "stop": "every move ends at rest unless it has a `zone`, or its target a velocity; to stand still for "
    "2 s write `- {{planner: hold, duration: 2}}`",
}
"""Entries among the moves of other programs, with what says the same."""
_NOT_HERE = {
    **dict.fromkeys(
        ("frame", "wobj", "workobject", "uframe"),
        "frames stand under `frames` of the job, and a pose in one says `in: NAME`",
    ),
    "offset": "a state says how far from a point: `{{from: NAME, offset: ...}}`, or `from: here`",
}
"""Sections of other programs, with what says the same."""
_TIMES = ("times", "knots", "time_stamps", "timestamps")
"""Words for the times of points."""
_PLANNERS_ELSEWHERE = {
    "repeat": "a round is an entry of its own: `{repeat: 3, moves: [...]}`",
    "stop": "every move ends at rest unless it has a `zone`, or its target a velocity; a moving arm is "
    "stopped by `{planner: jerk_limited, to: {velocity: 0}}`",
}
"""Planners of other programs that are more than another name."""
_NEEDS_NO_LIMIT = "quintic"  # the shape of a law that a duration is enough for


def validated(
    model: type[M], value: object, document: Document, context: ReadingContext | None, at: FieldPath = ()
) -> M:
    """Return what a model makes of the plain content of a document at a path.

    Raises:
        InputError: With every flaw of it.
    """
    try:
        return model.model_validate(value, context=context)
    except ValidationError as error:
        raise InputError(*problems_of(error, model, document, at)) from None


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
        key = str(path[-1])
        if key in RELATIVE_FIELDS and _meant_by_another("from", names, document.node(path[:-1])):
            return []  # they are right beside the key that is meant
        hint = _other_place(path, names, document) or _other_key(key, names) or valid_names(names)
        return [(path, f"unknown key '{abridged(key)}'", hint, True)]
    if kind == "missing":
        name = str(loc[-1])
        if _meant_by_another(name, _field_names(model, loc[:-1]), document.node(path[:-1])):
            return []  # the key that stands for it is unknown, and says so
        field = _model_at(model, loc[:-1]).model_fields[name]
        return [(path, f"`{name}` is missing", _described(field), False)]
    if kind == "too_short" and len(detail["input"]) >= context["min_length"]:
        return []  # entries that are wrong, and say so, are not counted
    if kind == "union_tag_invalid":
        return [((*path, "planner"), *_unknown_planner(detail["input"]), False)]
    message, hint = _text(kind, context, detail["input"])
    if hint is None and kind in ("model_type", "model_attributes_type"):
        hint = _meant_word(path, detail["input"], document) or valid_names(
            _field_names(model, loc), "its keys"
        )
    return [(path, message, hint, False)]


def _without_key_of_entry(loc: FieldPath) -> FieldPath:
    """Return the path without the tag of an entry among the moves, which is a key of it, too."""
    at = _tag_at(loc)
    return (*loc[:at], *loc[at + 1 :]) if loc[at : at + 1] and loc[at] in HANDLING else loc


def _tag_at(loc: FieldPath) -> int:
    """Return where in a path the tag of an entry among the moves stands, if it is that long."""
    return {"moves": 2, "sequences": 3}.get(str(loc[0]), len(loc)) if loc else 0


def _flaw(path: FieldPath, text: str, hint: str | None) -> tuple[FieldPath, str, str | None, bool]:
    at_key = path[-1:] == (AT_KEY,)
    return path[:-1] if at_key else path, text, hint, at_key


def _unknown_planner(move: object) -> tuple[str, str | None]:
    tag = move.get("planner") if isinstance(move, Mapping) else move
    if not isinstance(tag, str):
        return f"expected a planner's name, got {shown(tag)}", _every_planner()
    if tag.casefold() in _PLANNERS_ELSEWHERE:
        return f"unknown planner '{tag}'", _PLANNERS_ELSEWHERE[tag.casefold()]
    meant = ALSO_CALLED.get(tag.strip().casefold().replace("-", "_").replace(" ", "_"))
    own = f"write `planner: {meant}` ({_every_planner()})" if meant else did_you_mean(tag, PLANNERS)
    return f"unknown planner '{abridged(tag)}'", own or _every_planner()


def _other_key(key: str, names: Sequence[str]) -> str | None:
    """Return the key that is meant where another stands: that of other programs, or the nearest name."""
    word = key.casefold()
    meant = _KEYS_ELSEWHERE.get(word, word)
    if meant in names:
        return f"did you mean '{meant}'?"
    if meant in LimitsSpec.model_fields and "limits" in names:
        return f"it stands under `limits`: {{{meant}: ...}}"
    if word in _TIMES and "through" in names:
        return "a point of `through` has its own: {joints: ..., time: ...}"
    elsewhere = _NOT_HERE.get(word) or _ENTRIES_ELSEWHERE.get(word)
    return did_you_mean(key, names) if elsewhere is None else elsewhere.format(value="...")


def _meant_by_another(name: str, names: Sequence[str], node: Node | None) -> bool:
    """Return whether a mapping has a key that stands for one that is missing."""
    keys = node.value if node is not None and isinstance(node.value, dict) else {}
    return any(key not in names and _other_key(key, names) == f"did you mean '{name}'?" for key in keys)


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
        return "a move needs `planner`", _meant_entry(value if isinstance(value, Mapping) else {})
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


def _meant_entry(entry: Mapping[Any, object]) -> str:
    """Return what an entry of the moves without a planner should be."""
    for key, value in entry.items():
        word = str(key).casefold()
        if word in _ENTRIES_ELSEWHERE:
            return _ENTRIES_ELSEWHERE[word].format(
                value=abridged(str(value)) if isinstance(value, int | float | str) else "..."
            )
        if word in PLANNERS or word in ALSO_CALLED:
            return f"write `- {{planner: {ALSO_CALLED.get(word, word)}, ...}}`"
        near = None if word == "to" else did_you_mean(str(key), (*HANDLING, "planner"))
        if near:
            return near
    return f"{_every_planner()}; between moves stand {', '.join(HANDLING)}"


def _meant_word(path: FieldPath, value: object, document: Document) -> str | None:
    """Return what an entry of the moves that is no mapping should be; None where it is no such entry."""
    if path[:1] != ("moves",) or len(path) != 2:
        return None
    if not isinstance(value, str):
        return "write `- {planner: ..., to: ...}`"
    points = document.node(("points", value))
    return f"write `- {{planner: jerk_limited, to: {value}}}`" if points else _meant_entry({value: None})


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
    at = _model_at(model, loc)
    fields = at.model_fields.items()
    names = [field.alias or name for name, field in fields if field.description or not field.exclude]
    if issubclass(at, Planner) and "planner" in names:
        return [*names, *(["approach"] if "to" in names else []), "retreat"]
    return [*names, "from"] if issubclass(at, Target) else names


def _model_at(model: type[BaseModel], loc: FieldPath) -> type[BaseModel]:
    current, named = model, False  # whether the next step is a name that the user chose
    for index, step in enumerate(map(str, loc)):
        field = None if named else current.model_fields.get(step)
        named = field is not None and get_origin(field.annotation) is dict
        if index == _tag_at(loc) and (step in PLANNERS or step in HANDLING):
            current = PLANNERS[step] if step in PLANNERS else HANDLING[step]
        elif index == 0 and step == "defaults":
            current = defaults_of_paths()
        elif field is not None:
            current = _model_in(field.annotation) or current
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


def named_with_more(value: Mapping[str, Any], document: Document) -> Problem:
    """Return the problem of a robot of the catalogue that is given as if it stood in the job."""
    name, others = value["name"], [key for key in value if key != "name"]
    beside = [key for key in others if key in ("base", "tool", "limits", "gravity")]
    hint = f"write `robot: {name}`"
    if beside:
        hint += f", and {' and '.join(f'`{key}`' for key in beside)} beside `robot` in the job"
    message = f"{name} is a robot of the catalogue, and stands here without its joints"
    return Problem(message, hint, document.place(("robot", "name")))


def no_robot(value: object, document: Document) -> Problem:
    """Return the problem of something under `robot` that is none."""
    hint = "such as ur5e: `trajcli robots` lists the names of the catalogue"
    if isinstance(value, int) and not isinstance(value, bool):
        hint = f"for {value} bare joints write {{joints: {value}}}"
    message = f"expected a robot's name, {{file: PATH}}, {{urdf: PATH}} or a robot, got {shown(value)}"
    return Problem(message, hint, document.place(("robot",)))


def matrices_off_rotation(document: Document) -> Iterator[Event]:
    """Yield the event of each matrix that is not quite a rotation, so that the nearest one is taken.

    Args:
        document: Of a job or of a robot, without flaws.
    """
    seen: set[int] = set()  # a move that is repeated has one matrix
    for path, node in _matrices(document.root):
        if id(node.value) in seen:
            continue
        seen.add(id(node.value))
        with suppress(FlawError):  # a list of names that is called so
            rows = read_rows(node.plain(), ReadingContext())
            defect = check_rotation(np.array([row[:3] for row in rows[:3]]))
            if defect > _NOTED:
                move = path[1] if isinstance(path[1], int) else None  # `moves` is the one list at the top
                where = ".".join(map(str, path if move is None else path[2:]))
                text = f"the matrix {where} is off a rotation by {defect:.3g}: the nearest one is taken"
                yield Event("nearest_rotation", text, move)


def _matrices(node: Node, *path: str | int) -> Iterator[tuple[FieldPath, Node]]:
    """Yield the lists under a key `matrix`, and where each is."""
    value = node.value
    if isinstance(value, dict):
        for key, below in value.items():
            if key == "matrix" and isinstance(below.value, list):
                yield (*path, key), below
            else:
                yield from _matrices(below, *path, key)
    elif isinstance(value, list):
        for index, below in enumerate(value):
            yield from _matrices(below, *path, index)
