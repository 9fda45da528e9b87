"""Signals in job files: what a move sets, and when."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal, get_args

from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.language.numbers import (
    AT_KEY,
    FlawError,
    Name,
    Number,
    ReadingContext,
    flaws_below,
    object_schema,
    shown,
)
from trajcli.language.per_joint import read_each
from trajcli.units import Quantity

Moment = Literal["enter", "nearest", "leave"]
_MOMENTS = get_args(Moment)
_PATTERN = "[A-Za-z][A-Za-z0-9_]*"


class SignalName(Name):
    """A name that columns and topics can end in."""

    def read(self, value: Any, context: ReadingContext) -> str:  # noqa: ANN401
        """Return the name."""
        name = super().read(value, context)
        if not re.fullmatch(_PATTERN, name):
            hint = "letters, digits and underscores, a letter first, such as gripper_1"
            raise FlawError(f"'{name}' is no name of a signal", hint=hint)
        return name

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of such a name."""
        return {**super().json_schema(), "pattern": f"^{_PATTERN}$"}


_NAME = SignalName("Name of the signal.")
_VALUE = Number(Quantity("ratio"), "What it is from then on.")
_BEFORE = Number(Quantity("time"), "So much earlier, s; below zero: later.")
_PATH = Number(Quantity("length"), "So far along the path of the move; below zero: from its end.")


@comparable
class SignalAt:
    """A signal that is set while a move goes on.

    Attributes:
        signal: Its name.
        value: What it is from then on.
        when: About the corner in which the move ends; at a stop all three are its arrival.
        along: Instead: how far along the path of the move, m; below zero from its end.
        before: So much earlier, s.
    """

    signal: str
    value: float
    when: Moment = "nearest"
    along: float | None = None
    before: float = 0.0


def read_signals(value: Any, context: ReadingContext) -> tuple[SignalAt, ...]:  # noqa: ANN401
    """Return one signal or a list of them, in SI.

    Raises:
        FlawError: With each flaw.
    """
    if isinstance(value, tuple):
        return value
    if not isinstance(value, list):
        return (_read_one(value, context),)
    if not value:
        raise FlawError("expected at least one signal")
    return tuple(read_each(enumerate(value), lambda _, item: _read_one(item, context)).values())


def written_signals(value: tuple[SignalAt, ...], context: ReadingContext) -> list[dict[str, Any]]:
    """Return signals as they are read, bit by bit."""
    return [
        {
            "signal": each.signal,
            "value": _VALUE.write(each.value, context),
            "when": each.when if each.along is None else {"path": _PATH.write(each.along, context)},
            "before": _BEFORE.write(each.before, context),
        }
        for each in value
    ]


def schema_of_signals() -> JsonSchemaValue:
    """Return the schema of one signal, or a list of them."""
    path = object_schema({"path": _PATH.json_schema()}, "path")
    when = {"anyOf": [{"enum": list(_MOMENTS)}, path]}
    parts = {
        "signal": {**_NAME.json_schema(), "description": "Name of the signal."},
        "value": {**_VALUE.json_schema(), "description": "What it is from then on."},
        "when": {**when, "default": "nearest", "description": "About the corner, or along the path."},
        "before": {**_BEFORE.json_schema(), "default": 0.0, "description": "So much earlier (s)."},
    }
    one = object_schema(parts, "signal", "value")
    return {"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]}


def _read_one(value: Any, context: ReadingContext) -> SignalAt:  # noqa: ANN401
    """Return one signal, in SI."""
    form = "{signal: NAME, value: NUMBER, when: enter | nearest | leave | {path: L}, before: s}"
    if not isinstance(value, Mapping):
        raise FlawError(f"expected {form}, got {shown(value)}")
    unknown = [key for key in value if key not in ("signal", "value", "when", "before")]
    if unknown:
        raise FlawError(f"a signal has no '{unknown[0]}'", unknown[0], AT_KEY, hint=f"it is {form}")
    missing = [key for key in ("signal", "value") if key not in value]
    if missing:
        raise FlawError(f"`{missing[0]}` is missing", hint=f"a signal is {form}")
    readers = {"signal": _NAME.read, "value": _VALUE.read, "before": _BEFORE.read, "when": _read_when}
    fields: dict[str, Any] = read_each(value.items(), lambda key, item: readers[key](item, context))
    when = fields.pop("when", "nearest")
    return SignalAt(**fields, **({"when": when} if isinstance(when, str) else {"along": when}))


def _read_when(value: Any, context: ReadingContext) -> str | float:  # noqa: ANN401
    """Return one of the moments about a corner, or how far along the path, m."""
    if isinstance(value, str) and value in _MOMENTS:
        return value
    if isinstance(value, Mapping) and list(value) == ["path"]:
        with flaws_below("path"):
            return float(_PATH.read(value["path"], context))
    raise FlawError(f"expected {', '.join(_MOMENTS)} or {{path: L}}, got {shown(value)}")
