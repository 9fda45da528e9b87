"""One count and one title of each move in `plan`, `explain`, `plot` and `view`, of all examples."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from planned_examples import planned_example, planned_once
from tiers import QUICK as QUICK_TIER
from tiers import few

from trajcli.cli.explain import _head, _lines
from trajcli.job.read import load_job
from trajcli.output.explain import explanation
from trajcli.player.scene import scene_of_plan
from trajcli.plots.picture import picture_of

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ("pick_carry_place", "two_tools", "trapezoid")
FEWER_LIMITS = {"two_tools": ["limits.effort=null", "limits.jerk=null"]}
"""Of examples that are planned over seconds; no title says a limit."""
ALL = sorted(path.stem for path in EXAMPLES.glob("*.yaml"))


@pytest.mark.parametrize("name", few(dict.fromkeys([*QUICK, *few(ALL, 1)]), 2))
def test_moves_have_one_count_and_one_title(name: str) -> None:
    loaded = load_job(EXAMPLES / f"{name}.yaml", FEWER_LIMITS.get(name, []) if QUICK_TIER else [])
    plan = planned_once(loaded)
    entries = range(len(loaded.job.moves))
    titles = {k: loaded.title(k) for k in entries if not loaded.job.moves[k].handles}
    count = f"{len(titles)} move{'s' * (len(titles) != 1)}"

    explained = explanation(plan)
    told = [
        re.fullmatch(r"move (\d+): (.*), \S+ s, from t = \S+ s", line) for line in _lines(explained, plan)
    ]
    said = {int(match[1]): match[2] for match in told if match}
    assert {k: said[k] for k in titles} == titles
    assert f": {count}, " in _head(explained, plan)

    borders = picture_of(plan, quantities=["q"]).borders
    assert borders is not None
    assert dict(zip(borders.indices, borders.titles, strict=True)) == titles

    scene = scene_of_plan(plan)
    assert {move["index"]: move["title"] for move in scene["moves"]} == titles
    assert f" · {count} · " in scene["subtitle"]
    assert sorted([*titles, *(mark["index"] for mark in scene["marks"])]) == list(entries)


def test_a_remark_is_no_event() -> None:
    plan = planned_example("weave")
    assert plan.remarks
    scene = scene_of_plan(plan)
    assert len(scene["events"]) == len([event for event in plan.events if not event.is_internal])
    for remark in plan.remarks:
        assert any(remark.message in note for note in scene["notes"])
        assert all(remark.message != event["message"] for event in scene["events"])
