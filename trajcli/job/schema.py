"""JSON Schemas of job, robot file, report and explanation, generated from their models."""

from __future__ import annotations

import json
from typing import Any, Literal

from trajcli.errors import InputError

SchemaKind = Literal["job", "robot", "report", "explanation"]
_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_TITLES = {
    "job": "trajcli job, version 1",
    "robot": "trajcli robot, version 1",
    "report": "trajcli verification report, version 1",
    "explanation": "trajcli explanation, version 1: what explain --json prints",
}


def schema_text(kind: SchemaKind) -> str:
    """Return the schema as indented JSON, as it is committed."""
    return json.dumps(schema_of(kind), indent=2, ensure_ascii=False) + "\n"


def schema_of(kind: SchemaKind) -> dict[str, Any]:
    """Return the JSON Schema of a job file, a robot file, a report, or an explanation.

    Raises:
        InputError: When the kind is none of these.
    """
    if kind not in _TITLES:
        raise InputError(f"there is no schema {kind!r}", hint=f"the kinds are {', '.join(_TITLES)}")
    schema = {"job": _job, "robot": _robot, "report": _report, "explanation": _explanation}[kind]()
    return {"$schema": _DIALECT, **_without_titles(schema), "title": _TITLES[kind]}


def _job() -> dict[str, Any]:
    from trajcli.catalogue.entries import catalogue_names
    from trajcli.job.files.rail import RobotOnRail
    from trajcli.job.model import CATALOGUE_NAME, RAIL_DEFINITION, ROBOT_DEFINITION, Job
    from trajcli.job.program.schemas import MOVES_DEFINITION
    from trajcli.language.points import RELATIVE_DEFINITION

    schema: dict[str, Any] = _without_nulls(Job.model_json_schema())
    robot, on_rail = _robot(), _without_nulls(RobotOnRail.model_json_schema())
    definitions = {**schema["$defs"], **robot.pop("$defs", {}), **on_rail.pop("$defs"), "RobotModel": robot}
    on_rail["properties"]["arm"] |= schema["properties"]["robot"]
    definitions["RobotOnRail"] = on_rail
    stand_ins: dict[str, dict[str, Any]] = {
        ROBOT_DEFINITION: {"$ref": "#/$defs/RobotModel"},
        RAIL_DEFINITION: {"$ref": "#/$defs/RobotOnRail"},
        MOVES_DEFINITION: {"$ref": "#/properties/moves"},
        CATALOGUE_NAME: {"enum": catalogue_names(), "description": "A robot of the catalogue."},
    }
    for name in ("Target", "Waypoint"):
        stand_ins[RELATIVE_DEFINITION + name] = {"$ref": f"#/$defs/Relative{name}"}
        definitions[f"Relative{name}"] = _relative(definitions[name])
    schema["$defs"] = dict(sorted((name, _described(node)) for name, node in definitions.items()))
    for comment, instead in stand_ins.items():
        schema = _replaced(schema, {"$comment": comment}, instead)
    return schema


def _relative(state: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a state that is given relative to a point."""
    from trajcli.language.points import BESIDE, RELATIVE_FIELDS

    beside = {key: state["properties"][key] for key in BESIDE if key in state["properties"]}
    return {
        "type": "object",
        "description": "A state whose pose is that of a point, displaced: such as 100 mm above it.",
        "properties": {**RELATIVE_FIELDS, **beside},
        "required": ["from"],
        "additionalProperties": False,
    }


def _described(definition: dict[str, Any]) -> dict[str, Any]:
    """Return the definition of a move with its description at `planner`, where an editor shows it.

    Its approach and retreat are moves of their own, which no planner knows of.
    """
    properties = definition.get("properties", {})
    planner = properties.get("planner", {})
    if "const" not in planner:
        return definition
    from trajcli.job.program.schemas import STRAIGHT

    text = " ".join(definition["description"].split("\n\n")[0].split())
    words = {"retreat": "Before it, straight from where the arm stands to this far from there."}
    if "to" in properties:
        words = {"approach": "To a point this far from the target, then straight to it.", **words}
    parts = {key: {**STRAIGHT, "description": description} for key, description in words.items()}
    return {**definition, "properties": {**properties, "planner": {**planner, "description": text}, **parts}}


def _robot() -> dict[str, Any]:
    from trajcli.job.robot import RobotModel

    schema: dict[str, Any] = _without_nulls(RobotModel.model_json_schema())
    return schema


def _report() -> dict[str, Any]:
    from trajcli.job.report import Report

    return Report.model_json_schema(mode="serialization")


def _explanation() -> dict[str, Any]:
    from trajcli.job.explanation import Explanation

    return Explanation.model_json_schema()


def _replaced(node: Any, old: dict[str, Any], new: dict[str, Any]) -> Any:  # noqa: ANN401
    if node == old:
        return new
    if isinstance(node, dict):
        return {key: _replaced(value, old, new) for key, value in node.items()}
    return [_replaced(item, old, new) for item in node] if isinstance(node, list) else node


def _without_titles(node: Any) -> Any:  # noqa: ANN401
    """Return the schema without the titles that only repeat a field's name."""
    if isinstance(node, dict):
        kept = {key: value for key, value in node.items() if not (key == "title" and isinstance(value, str))}
        return {key: _without_titles(value) for key, value in kept.items()}
    return [_without_titles(item) for item in node] if isinstance(node, list) else node


def _without_nulls(node: Any) -> Any:  # noqa: ANN401
    """Return the schema of a file: what it may leave out is not written as null."""
    if isinstance(node, list):
        return [_without_nulls(item) for item in node]
    if not isinstance(node, dict):
        return node
    schema = {key: _without_nulls(value) for key, value in node.items()}
    if isinstance(schema.get("default"), dict) or schema.get("default", ...) in ([], [None, None]):
        del schema["default"]  # the parts of the value carry their own
    if schema.get("default", ...) is not None:
        return schema
    del schema["default"]
    if "anyOf" not in schema:
        return schema
    forms = [form for form in schema.pop("anyOf") if form != {"type": "null"}]
    return {**forms[0], **schema} if len(forms) == 1 else {**schema, "anyOf": forms}
