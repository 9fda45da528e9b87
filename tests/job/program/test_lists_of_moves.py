"""Lists of moves: what is wrong with repeats, calls and sequences, where, and what helps; the oracle is the text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refused_jobs import refused, where

from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.output.recording import _job_text
from trajcli.planning.plan import plan_job

HEAD = """\
version: 1
robot: ur5e
limits: {velocity: 1}
start: {joints: 0}
"""
POINTS = """\
points:
  corner: {xyz: [0.4, -0.2, 0.2], rpy: [3, 0, 0]}
  other: {xyz: [0.4, 0.2, 0.2], rpy: [3, 0, 0]}
  slot: {grid: {from: corner, steps: [{count: 3, xyz: [0, 0.1, 0]}]}}
  pair: [corner, other]
  duo: [other, corner]
  near: {from: slot, offset: {xyz: [0, 0, 0.1]}}
  both: {grid: {from: near, steps: [{count: 2, xyz: [0.1, 0, 0]}]}}
"""
HOLD = "{planner: hold, duration: 1}"


def job(moves: str, sequences: str = "", points: str = POINTS) -> str:
    return f"{HEAD}{points}{'sequences: ' + sequences if sequences else ''}\nmoves: {moves}\n"


def read(moves: str, sequences: str = "") -> LoadedJob:
    return job_from_text(job(moves, sequences))


def to(name: str) -> str:
    return f"{{planner: quintic, to: {name}, duration: 9}}"


@pytest.mark.parametrize(
    ("moves", "sequences", "at", "message", "hint"),
    [
        ("7", "{s: []}", "7", "expected a list of moves", ""),
        (f"[{HOLD}]", "7", "7", "expected a mapping {NAME: [move, ...]}", ""),
        (f"[{HOLD}]", "{s: 7}", "7", "expected a list of moves", ""),
        (f"[{HOLD}, {{repeat: 2, moves: 7}}]", "", "7", "expected a list of moves", ""),
        (f"[{HOLD}, {{repeat: slot, moves: []}}]", "", "[]", "a list of moves is empty", ""),
        (f"[{{moves: [{HOLD}], repeat: }}]", "", "}]", "or names that are many, got", ""),
        (f"[{{repeat: {{x: 1}}, moves: [{HOLD}]}}]", "", "{x", "got a value of another kind", ""),
        (
            f"[{{repeat: slto, moves: [{HOLD}]}}]",
            "",
            "slto",
            "'slto' is not many itself",
            "did you mean 'slot'?",
        ),
        (
            f"[{{repeat: zzzz, moves: [{HOLD}]}}]",
            "",
            "zzzz",
            "'zzzz' is not many itself",
            "names that are many",
        ),
        (f"[{{repeat: [pair, slot], moves: [{HOLD}]}}]", "", "[pair", "pair is 2, slot is 3", ""),
        (f"[{{repeat: 2, label: 7, moves: [{HOLD}]}}]", "", "7", "expected a text, got 7", ""),
        (
            f"[{{repeat: both, moves: [{HOLD}]}}]",
            "",
            "both",
            "'both' differs from round to round of slot",
            "write it within `repeat: slot`",
        ),
        (f"[{HOLD}, {{call: a}}]", "{a: [{call: b}], b: [{call: c}], c: [{call: b}]}", "b}], c: [", "", ""),
        ("[{call: rset}]", f"{{rest: [{HOLD}]}}", "rset", "no sequence 'rset'", "did you mean 'rest'?"),
        ("[{call: zzzz}]", f"{{rest: [{HOLD}]}}", "zzzz", "no sequence 'zzzz'", "rest"),
        ("[{call: rest}]", "", "rest", "no sequence 'rest'", "the job has no `sequences`"),
        (f"[{HOLD}, {to('near')}]", "", "{planner: quintic", "'slot' is many (3), and no round says", "slot"),
        (
            "[{repeat: pair, moves: [{call: s}]}]",
            f"{{s: [{HOLD}, {to('slot')}]}}",
            "{planner: quintic",
            "'slot' is many (3), and no round says",
            "write the move within `- {repeat: slot, moves: [...]}`",
        ),
    ],
)
def test_what_is_wrong_with_a_list_is_shown_where_it_stands(
    moves: str, sequences: str, at: str, message: str, hint: str
) -> None:
    if "call: b}]" in sequences:
        at, message = "b}]}", "the sequence 'b' calls itself (b -> c -> b)"
    text = job(moves, sequences)
    problem = refused(text)
    assert message in problem.text()
    assert hint in (problem.hint or "")
    assert problem.place is not None
    if "repeat: }" not in moves:
        assert (problem.place.line, problem.place.column) == where(text, at)


def test_names_that_go_together_are_at_the_same_number_in_every_round() -> None:
    loaded = read(f"[{{repeat: [pair, duo], moves: [{to('pair')}, {to('duo')}]}}]")
    found = [move.to.xyz[1] for move in loaded.job.moves]
    assert found == [-0.2, 0.2, 0.2, -0.2]
    document = loaded.document
    assert [document.round_of(move) for move in range(4)] == [  # type: ignore[attr-defined]
        *["pair 1 of 2, duo 1 of 2"] * 2,
        *["pair 2 of 2, duo 2 of 2"] * 2,
    ]


def test_rounds_come_in_order_and_a_call_has_those_of_where_it_stands() -> None:
    calls = f"{{go: [{to('slot')}, {{repeat: 2, label: twice, moves: [{HOLD}]}}]}}"
    loaded = read(f"[{{repeat: slot, moves: [{{call: go, label: there}}]}}, {HOLD}]", calls)
    document = loaded.document
    words = [document.round_of(move) for move in range(10)]  # type: ignore[attr-defined]
    wanted = [
        f"slot {k} of 3, there{more}"
        for k in (1, 2, 3)
        for more in ("", ", twice, round 1 of 2", ", twice, round 2 of 2")
    ]
    assert words == [*wanted, ""]
    assert [loaded.job.moves[k].to.xyz[1] for k in (0, 3, 6)] == pytest.approx([-0.2, -0.1, 0.0])


def test_parts_of_moves_and_calls_count_as_moves() -> None:
    """A move with an approach is two: 1000 times 501 of them are 1 002 000 entries."""
    move = "{planner: line, to: corner, approach: 0.1}"
    text = job("[{repeat: 1000, moves: [{call: s}, {repeat: 500, moves: [{call: s}]}]}]", f"{{s: [{move}]}}")
    assert "the moves are 1002000 entries" in refused(text).message


def test_a_hundred_calls_may_stand_one_in_another_whatever_repeats_are_between() -> None:
    def chain(count: int) -> str:
        links = ", ".join(f"s{k}: [{{repeat: 1, moves: [{{call: s{k + 1}}}]}}]" for k in range(count - 1))
        return f"{{{links}, s{count - 1}: [{HOLD}]}}"

    assert len(read("[{call: s0}]", chain(100)).job.moves) == 1
    assert "more than 100 sequences call one another" in refused(job("[{call: s0}]", chain(101))).message


def test_sequences_that_nobody_calls_are_read_with_all_their_moves() -> None:
    """The flaw is in the last move of the second one, within a round; it is shown where it stands."""
    flawed = "{planner: quintic, to: corner, duration: -9}"
    text = job(
        f"[{HOLD}]", f"{{a: [{HOLD}], b: [{HOLD}, {{repeat: slot, moves: [{to('near')}, {flawed}]}}]}}"
    )
    problem = refused(text)
    assert "got -9" in problem.text()
    assert problem.place is not None
    assert problem.place.column == len("sequences: ") + text.split("sequences: ")[1].index("-9") + 1


def test_defaults_hold_for_lines_in_rounds_in_the_units_of_the_job() -> None:
    text = job(
        "[{repeat: slot, moves: [{planner: line, to: slot, approach: 50}]}]\n"
        "units: {length: mm}\ndefaults: {law: {shape: quintic, duration: 3}}",
        points=POINTS.replace("0.4", "400").replace("0.2", "200").replace("0.1", "100"),
    )
    moves = job_from_text(text).job.moves
    assert len(moves) == 6
    assert {move.law.duration for move in moves[1::2]} == {3.0}
    heights = [
        before.to.xyz[2] - after.to.xyz[2] for before, after in zip(moves[::2], moves[1::2], strict=True)
    ]
    assert heights == pytest.approx([-0.05 * np.cos(3)] * 3)


def test_the_job_that_a_log_holds_says_what_an_option_has_replaced(tmp_path: Path) -> None:
    """Read again without the option it is the same motion: 3 moves of 0.1 rad at 0.05 rad/s."""
    text = """
        version: 1
        robot: {joints: 1}
        limits: {velocity: 1}
        start: {joints: 0}
        points: {a: {joints: 0.1}, b: {joints: 0.2}, c: {joints: 0.3}, l: [a, b, c]}
        moves: [{repeat: l, moves: [{planner: trapezoid, to: l}]}]
    """
    (tmp_path / "job.yaml").write_text(
        text.replace("{velocity: 1}", "{velocity: 1, acceleration: 1}"), "utf-8"
    )
    plan = plan_job(load_job(tmp_path / "job.yaml", ["limits.velocity=0.05"]))
    again = plan_job(job_from_text(_job_text(plan)))
    each = 0.1 / 0.05 + 0.05 / 1
    assert [plan.trajectory.duration, again.trajectory.duration] == pytest.approx([3 * each] * 2, rel=1e-9)
