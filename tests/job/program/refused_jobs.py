"""Jobs that are refused, and where something stands in their text."""

from __future__ import annotations

import pytest

from trajcli.errors import InputError, Problem
from trajcli.job.read import job_from_text


def refused(text: str) -> Problem:
    """Return the one problem of a job."""
    with pytest.raises(InputError) as caught:
        job_from_text(text, "job.yaml")
    (problem,) = caught.value.problems
    return problem


def where(text: str, at: str) -> tuple[int, int]:
    """Return the line and the column, from 1 on, at which a text holds another one for the last time."""
    index = text.rindex(at)
    return text.count("\n", 0, index) + 1, index - text.rfind("\n", 0, index)
