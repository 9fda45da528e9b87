"""Sweeps at their edges: what is refused, what is kept of a point, and what a table says of it; the oracle is
each job by itself, and counting."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from test_sweep import Counted, swept

from trajcli.batches.sweep import PointLedger, Sweep, axis_of, outcomes_of, parse_axis, sweep_of
from trajcli.batches.task import JobOutcome
from trajcli.errors import InputError
from trajcli.job.read import load_job
from trajcli.job.yaml.load import parse_document
from trajcli.planning.plan import plan_job

JOB = """\
version: 1
units: {angle: deg}
robot: {joints: 1}
limits: {velocity: 90, acceleration: 360}
frames: {table: {xyz: [1, 0, 0]}}
start: {joints: 0}
moves:
  - {planner: trapezoid, to: {joints: 30}}
  - {planner: trapezoid, to: {joints: 60}}
"""
TWO_VALUES = "limits.velocity=60,90"


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(JOB, "utf-8")
    return "job.yaml"


def run(sweep: Sweep, table: str | None = None) -> tuple[int, list[JobOutcome]]:
    """Return how many points were planned, and what came of all, by row."""
    counted = Counted()
    outcomes = dict(outcomes_of(sweep, PointLedger(table), counted))
    return counted.planned, [outcomes[row] for row in sorted(outcomes)]


def test_a_list_of_texts_keeps_its_texts() -> None:
    (text,) = axis_of("a", [["x, y", "z", "{w", "u}"]]).values
    assert parse_document(text, "", any_root=True).plain() == ["x, y", "z", "{w", "u}"]


def test_spaces_about_a_path_are_none_of_it(job: str) -> None:
    assert [parse_axis(f" limits.velocity {text}").path for text in ("=1..3:3", "=1,2")] == [
        "limits.velocity"
    ] * 2
    assert [each.point.verdict for each in run(swept(job, "limits.velocity =60..90:2"))[1] if each.point] == [
        "verified"
    ] * 2


def test_an_end_too_small_for_a_float_is_refused() -> None:
    with pytest.raises(InputError, match=r"1e-400 is no number from 1e-308 to 1\.79e308"):
        parse_axis("a=1e-400..1:3")


@pytest.mark.parametrize(
    ("varied", "message", "hint"),
    [
        (
            ["limits.velocity=1,2", "moves.0.duration=1", "moves.0.duration=2"],
            "moves.0.duration stands",
            "one",
        ),
        (["moves.0.duration=-1,-2"], "expected a number above 0 s, got -1", ""),
        (["sequences.pick.0.duration=1,2"], "the job has no sequences.pick", ""),
        (["frames.tabel.xyz=[1; 0; 0]"], "the job has no frames.tabel", "did you mean 'table'?"),
        (["frames.desk.xyz=1,2"], "the job has no frames.desk", "table"),
    ],
)
def test_the_error_names_what_is_wrong_and_what_there_is(
    job: str, varied: list[str], message: str, hint: str
) -> None:
    with pytest.raises(InputError) as refused:
        swept(job, *varied)
    (problem,) = refused.value.problems
    assert message in problem.message
    assert hint in (problem.hint or "")


def test_what_only_several_values_together_make_whole_is_swept(job: str) -> None:
    """Neither value alone makes the job one that can be read."""
    Path(job).write_text(
        JOB.replace("to: {joints: 30}", "to: {joints: x}").replace("joints: 0}", "joints: y}")
    )
    _, outcomes = run(swept(job, "moves.0.to.joints=30", "start.joints=10,x"))
    assert [each.point and each.point.verdict for each in outcomes] == ["verified", "input"]


def test_every_combination_may_be_drawn(job: str) -> None:
    """Parts of 5 that are 3: 1, 2 and 2 long; of each part one is drawn."""
    drawn = [tuple(swept(job, "limits.velocity=1..5:5", samples=3, seed=seed).rows) for seed in range(40)]
    assert set(drawn) == {(0, second, third) for second in (1, 2) for third in (3, 4)}
    axis = [parse_axis("limits.velocity=1..50:50")]
    assert sweep_of(job, JOB.encode(), axis, 9).rows == swept(job, "limits.velocity=1..50:50", samples=9).rows


def test_no_more_than_a_million_combinations_are_drawn(job: str) -> None:
    vast = ("limits.velocity=1..90:2000", "limits.acceleration=1..360:2000")
    with pytest.raises(InputError, match="--samples 1000001: expected 1 to 1000000 of 4000000 combinations"):
        swept(job, *vast, samples=1_000_001)


def test_the_reason_is_that_of_the_first_finding(job: str) -> None:
    (outcome,) = run(swept(job, "limits.position=20"))[1]
    findings = plan_job(load_job(job, ["limits.position=20"])).verdict.findings
    assert {finding.move for finding in findings} == {0, 1}
    assert outcome.point is not None
    assert outcome.point.reason is not None
    assert "reaches 30 deg" in outcome.point.reason  # the second move reaches 60


def test_a_point_that_is_known_is_as_it_was_planned(job: str) -> None:
    sweep = swept(job, "limits.position=20,90", "moves.0.duration=-1,1,2")
    planned, first = run(sweep, "new/folder/table.csv")
    known, second = run(sweep, "new/folder/table.csv")
    assert (planned, known) == (6, 0)
    assert [each.point for each in second] == [each.point for each in first]
    assert [each.duration for each in second] == [each.duration for each in first]
    assert {each.outcome for each in second} == {"unchanged"}
    assert any(each.point and each.point.reason for each in second)


def test_what_is_no_point_in_what_was_kept_is_planned_again(job: str) -> None:
    sweep = swept(job, TWO_VALUES)
    _, first = run(sweep, "table.csv")
    kept = Path(".table.csv.sweep.jsonl")
    lines = kept.read_text("utf-8").splitlines()
    odd = ["5", "null", "[1]", '"text"', "{}", json.dumps({"inputs": "a", "verdict": "verified", "b": 1})]
    kept.write_text("\n".join([*odd, lines[0]]) + "\n", "utf-8")
    planned, second = run(sweep, "table.csv")
    assert planned == 1
    assert [each.point for each in second] == [each.point for each in first]
    kept.write_bytes(b"\xff\xfe" + lines[0].encode())
    assert run(sweep, "table.csv")[0] == 2


def test_where_nothing_can_be_kept_the_sweep_is_done_all_the_same(job: str) -> None:
    sweep = swept(job, TWO_VALUES)
    Path(".table.csv.sweep.jsonl").mkdir()
    planned, outcomes = run(sweep, "table.csv")
    assert planned == 2
    assert [each.point for each in outcomes] == [each.point for each in run(sweep)[1]]
