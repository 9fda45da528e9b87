"""What the hints of wrong jobs advise: read as it is written, it is what was meant."""

from __future__ import annotations

import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text


def hint_of(move: str, more: str = "", robot: str = "ur5e") -> str:
    text = (
        f"version: 1\nrobot: {robot}\nstart: {{joints: [0, -1.5, 1.5, 0, 1.5, 0]}}\n{more}\nmoves: [{move}]\n"
    )
    with pytest.raises(InputError) as caught:
        job_from_text(text)
    return str(caught.value.problems[0].hint)


TO = "to: {xyz: [0.4, 0, 0.3]}"
TCP = "limits: {tcp: {speed: 0.2, acceleration: 1}}"


@pytest.mark.parametrize(
    ("move", "more", "law"),
    [
        (f"{{planner: line, {TO}, duration: 2}}", "", "{shape: quintic, duration: 2}"),
        (f"{{planner: line, {TO}, duration: 2}}", TCP, "{duration: 2}"),
        (f"{{planner: line, {TO}, duration: 2, law: {{shape: cubic}}}}", "", "{shape: cubic, duration: 2}"),
        (f"{{planner: line, {TO}, time: 2, law: {{duration: 3}}}}", "", "{shape: quintic, duration: 3}"),
    ],
)
def test_fields_beside_a_law_join_it(move: str, more: str, law: str) -> None:
    assert hint_of(move, more).endswith(f"write `law: {law}`")


def test_arms_of_the_catalogue_have_limits_beside_them_and_keys_are_those_of_the_file() -> None:
    assert "`limits` beside `robot`" in hint_of(
        "{planner: hold, duration: 1}", robot="{name: ur5e, limits: {velocity: 1}}"
    )
    names = hint_of("{planner: hold, duration: 1}", "output: {zzzzzz: 1}")
    assert " for" in names
    assert "consumer" not in names
