"""JSON Schemas of what stands for moves and points: repeats, calls, grids and lists."""

from __future__ import annotations

from trajcli.language.numbers import LONGEST_NAME, number_schema, object_schema
from trajcli.units import Quantity

MOVES_DEFINITION = "a list of moves"
"""Stands in a schema for the list of moves, which such an entry stands in."""
_NAME = {"type": "string", "minLength": 1}
_LABEL = {**_NAME, "maxLength": LONGEST_NAME, "description": "What it is for, shown with its moves."}
_LISTED = {"type": "array", "items": _NAME, "minItems": 1, "uniqueItems": True}


STRUCTURES = (
    object_schema(
        {
            "repeat": {
                "anyOf": [{"type": "integer", "minimum": 1}, _NAME, _LISTED],
                "description": "How often; or the name of points or frames that are many, a round for each; "
                "or several such names, which go together.",
            },
            "moves": {"$comment": MOVES_DEFINITION},
            "label": _LABEL,
        },
        "repeat",
        "moves",
        description="Moves that are done several times.",
    ),
    object_schema(
        {"call": {**_NAME, "description": "Name of a sequence under `sequences`."}, "label": _LABEL},
        "call",
        description="The moves of a sequence.",
    ),
)
"""Entries among the moves that stand for several of them."""

_DISTANCE = number_schema(Quantity("length"), exclusiveMinimum=0)
_NUMBERS = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
STRAIGHT = {
    "anyOf": [
        _DISTANCE,
        object_schema(
            {
                "distance": {**_DISTANCE, "description": "How far from the end of it (length unit)."},
                "axis": {
                    "anyOf": [{"enum": ["x", "-x", "y", "-y", "z", "-z"]}, _NUMBERS],
                    "default": "-z",
                    "description": "Along which axis the point before, or behind, lies.",
                },
                "frame": {**_NAME, "default": "tool", "description": "Whose axis: tool, world or a frame."},
                "law": {"$ref": "#/$defs/LawSpec"},
                "zone": {
                    "$ref": "#/properties/zone",
                    "description": "Zone about the point before, or behind; left out: the job's.",
                },
            },
            "distance",
            description="A straight part of a move.",
        ),
    ]
}
"""What stands under `approach` and `retreat`."""

_STEP = object_schema(
    {
        "count": {"type": "integer", "minimum": 1, "description": "Places, the first included."},
        "xyz": {
            "type": "array",
            "items": number_schema(Quantity("length")),
            "minItems": 3,
            "maxItems": 3,
            "description": "From a place to the next (length unit).",
        },
    },
    "count",
    "xyz",
    description="One direction of a grid.",
)
_GRID = object_schema(
    {
        "from": {**_NAME, "description": "The first place."},
        "steps": {
            "type": "array",
            "items": _STEP,
            "minItems": 1,
            "description": "The directions; the last one turns fastest.",
        },
        "frame": {**_NAME, "description": "In whose axes the steps are: that of the first place."},
    },
    "from",
    "steps",
    description="Places in rows and columns.",
)
MANY = (
    object_schema({"grid": _GRID}, "grid", description="Many: a place for each round of a repeat."),
    {**_LISTED, "description": "Many: names, one for each round of a repeat."},
)
"""What stands under a name that is many."""
