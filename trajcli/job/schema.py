"""JSON Schemas of job, robot file and report, generated from their models."""

from __future__ import annotations

import json
from typing import Any, Literal

SchemaKind = Literal["job", "robot", "report"]
_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_TITLES = {"job": "trajcli job, version 1", "robot": "trajcli robot", "report": "trajcli verification report"}


def schema_text(kind: SchemaKind) -> str:
    """Return the schema as indented JSON, as it is committed."""
    return json.dumps(schema_of(kind), indent=2, ensure_ascii=False) + "\n"


def schema_of(kind: SchemaKind) -> dict[str, Any]:
    """Return the JSON Schema of a job file, a robot file, or a report."""
    schema = {"job": _job, "robot": _robot, "report": _report}[kind]()
    return {"$schema": _DIALECT, **_without_titles(schema), "title": _TITLES[kind]}


def _job() -> dict[str, Any]:
    from trajcli.job.model import ROBOT_DEFINITION, Job

    reference = {"$ref": "#/$defs/RobotModel"}
    own = _without_nulls(Job.model_json_schema())
    schema: dict[str, Any] = _replaced(own, {"$comment": ROBOT_DEFINITION}, reference)
    robot = _robot()
    definitions = robot.pop("$defs", {})
    schema["$defs"] = dict(sorted({**schema["$defs"], **definitions, "RobotModel": robot}.items()))
    return schema


def _robot() -> dict[str, Any]:
    from trajcli.job.robot import RobotModel

    schema: dict[str, Any] = _without_nulls(RobotModel.model_json_schema())
    return schema


def _report() -> dict[str, Any]:
    from trajcli.job.report import Report

    return Report.model_json_schema(mode="serialization")


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
    forms = [form for form in schema.pop("anyOf", []) if form != {"type": "null"}]
    return {**forms[0], **schema} if len(forms) == 1 else {**schema, "anyOf": forms}
