"""The base of everything that a job file may hold."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationInfo, model_validator

from trajcli.planners.reading import NULL


class Model(BaseModel):
    """Base of everything that a job file may hold: frozen, and strict about unknown keys."""

    # Most models stand only in others, and never need the reader that would be made with each class.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _nothing_left_empty(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        # `duration:` with nothing behind it is a slip of the pen: only what a file leaves out is left out
        if info.context is None or not isinstance(data, dict) or None not in data.values():
            return data
        optional = {name for name, field in cls.model_fields.items() if field.default is None}
        return {key: NULL if value is None and key in optional else value for key, value in data.items()}
