"""Whatever stands in a job, it is read or refused in its place, never anything else."""

from __future__ import annotations

import json
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_mappings import jobs

from trajcli.errors import InputError, Problem
from trajcli.job.read import job_from_text

SCALARS = [None, True, False, 0, -1, 1, 2.5, 1e300, -1e-300, 10**20, "", "x", "3 deg", "5 mm/s", "home"]
COLLECTIONS = [
    [],
    {},
    [None],
    [[]],
    {"a": 1},
    [1, 2],
    ["1 deg", True],
    {"j1": 3},
    {"xyz": 1},
    {"planner": "hold"},
]
JUNK = st.sampled_from([*SCALARS, *COLLECTIONS])


def _paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(below for key, item in inside for below in _paths(item, (*path, key)))]


def _put(value: Any, path: tuple[Any, ...], junk: Any) -> Any:
    if not path:
        return junk
    if isinstance(value, dict):
        return {**value, path[0]: _put(value[path[0]], path[1:], junk)}
    return [_put(item, path[1:], junk) if index == path[0] else item for index, item in enumerate(value)]


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(jobs(), st.data())
def test_junk_is_refused_in_its_place(plain: dict[str, Any], data: st.DataObject) -> None:
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(_paths(plain)[1:]))
        plain = _put(plain, path, data.draw(JUNK))
    for problem in _problems(plain):
        assert problem.message
        assert not problem.amounts
        assert problem.place is not None
        assert (problem.place.file, problem.place.line) == ("job.json", 1)


def _problems(plain: dict[str, Any]) -> tuple[Problem, ...]:
    try:
        job_from_text(json.dumps(plain, ensure_ascii=False), "job.json")
    except InputError as error:
        return error.problems or (Problem(""),)
    return ()
