"""The table of planners: names of jobs, words of others for them, and moves with some fields changed."""

from __future__ import annotations

import json
from typing import Any

import pytest
from pydantic import ValidationError

from trajcli.job.read import job_from_text
from trajcli.planners import ALSO_CALLED, HANDLING, PLANNERS, changed, moves_adapter
from trajcli.planners.planner import Planner

OF_OTHERS = {
    "movej movel movec movep": "jerk_limited line arc path",  # URScript
    "ptp lin circ": "jerk_limited line arc",  # KUKA, Pilz
    "jtraj ctraj mstraj trapezoidal": "quintic line blends trapezoid",  # Robotics Toolbox
    "lspb min_jerk totg topp_ra": "trapezoid quintic time_optimal time_optimal",  # books, MoveIt, toppra
    "wait dwell sleep pause": "hold hold hold hold",
}


@pytest.mark.parametrize("words", OF_OTHERS)
def test_words_of_other_programs_lead_to_what_they_do_there(words: str) -> None:
    for word, planner in zip(words.split(), OF_OTHERS[words].split(), strict=True):
        assert ALSO_CALLED[word] == planner
    assert {*ALSO_CALLED.values()} <= {*PLANNERS}
    assert not {*ALSO_CALLED} & {*PLANNERS}


def test_each_name_loads_the_planner_that_calls_itself_so() -> None:
    for table in (PLANNERS, HANDLING):
        for tag in table:
            assert table[tag].model_fields["planner"].default == tag
        assert len(table) == len([*table])
    assert "line" in PLANNERS
    assert "attach" not in PLANNERS


def move(**fields: Any) -> Planner:
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": {"acceleration": 5, "jerk": 50},
        "start": {"joints": [0, -1.2, 1.1, 0.2, 0.4, 0]},
        "moves": [{"to": {"joints": [0.1, -1.2, 1.1, 0.2, 0.4, 0]}, **fields}],
    }
    return job_from_text(json.dumps(job)).job.moves[0]


def test_a_changed_move_keeps_what_nobody_changes() -> None:
    given = move(planner="quintic", duration=2, label="there", when_over_limit="slow")
    longer = changed(given, {"duration": 3.0})
    assert longer is not None
    assert longer.model_dump() == {**given.model_dump(), "duration": 3.0}
    other = changed(given, {"planner": "septic"})
    assert other is not None
    assert (other.tag, other.label, other.when_over_limit) == ("septic", "there", "slow")
    assert other.model_dump()["duration"] == 2
    assert other.model_dump()["to"] == given.model_dump()["to"]


def test_what_the_other_planner_does_not_have_is_left_out() -> None:
    given = move(planner="jerk_limited", synchronize="phase", minimum_duration=2)
    other = changed(given, {"planner": "quintic", "duration": 4.0})
    assert other is not None
    assert other.model_dump()["duration"] == 4
    assert "synchronize" not in other.model_dump()


def test_a_mapping_changes_fields_of_a_field() -> None:
    """The law keeps its speed; what the job says beside a change does not win over it."""
    target = {"xyz": [0.4, 0.1, 0.3]}
    given: Any = move(planner="line", to=target, law={"shape": "quintic", "speed": 0.1})
    other: Any = changed(given, {"law": {"shape": "jerk_limited"}})
    assert (other.law.shape, other.law.speed) == ("jerk_limited", 0.1)
    assert other.law.model_fields_set == {"shape", "speed"}


@pytest.mark.parametrize("change", [{"duration": -1.0}, {"planner": "hold", "to": None}, {"speed": 1.0}])
def test_what_does_not_fit_is_no_move(change: dict[str, Any]) -> None:
    assert changed(move(planner="quintic", duration=2), change) is None


def test_a_list_of_moves_has_at_least_one_of_the_planners_named() -> None:
    adapter = moves_adapter(["hold"])
    for wrong in ([], [{"planner": "line"}]):
        with pytest.raises(ValidationError):
            adapter.validate_python(wrong)
