"""Names that are many: where flaws of grids and lists stand, what helps, and what a name means in two rounds."""

from __future__ import annotations

import numpy as np
import pytest
from refused_jobs import refused, where

from trajcli.job.read import LoadedJob, job_from_text

HEAD = """\
version: 1
robot: ur5e
limits: {velocity: 1}
start: {joints: [0, -1.6, 1.6, -1.6, -1.6, 0]}
moves: [{planner: hold, duration: 1}]
points:
  corner: {xyz: [0.4, -0.2, 0.2], rpy: [3, 0, 0]}
  other: {xyz: [0.4, 0.3, 0.2], rpy: [3, 0, 0]}
"""


@pytest.mark.parametrize(
    ("point", "at", "message", "hint"),
    [
        ("a: [corner, 'cornr']", "'cornr'", "there is no point or frame 'cornr'", "did you mean 'corner'?"),
        ("a: [corner, zzz]", "zzz", "there is no point or frame 'zzz'", "corner"),
        ("a: [corner, other, 'other']", "'other'", "'other' stands twice in 'a'", ""),
        ("a: [corner, {x: 1}]", "{x: 1}", "expected the name of a point", "list the names"),
        ("l: [corner, other]\n  a: []", "[]", "a list of points is empty", ""),
        ("l: [corner, other]\n  a: [other, 'l']", "'l'", "'l' is many (2), expected one", ""),
        ("a: {grid: {from: corner}}", "{from", "`steps` is missing", ""),
        ("a: {grid: {steps: [{count: 2, xyz: [1, 0, 0]}]}}", "{steps", "`from` is missing", ""),
        ("a: {grid: 7}", "7", "expected {from: NAME, steps: [...]}", ""),
        ("a: {grid: {from: corner, steps: 7}}", "7", "expected a list of steps", "count: 4"),
        (
            "a: {grid: {from: [corner], steps: [{count: 2, xyz: [1, 0, 0]}]}}",
            "[corner]",
            "expected a name",
            "",
        ),
        (
            "a: {grid: {from: corner, frame: 7.0, steps: [{count: 2, xyz: [1, 0, 0]}]}}",
            "7.0",
            "expected a name",
            "",
        ),
        ("a: {grid: {from: corner, steps: [7]}}", "7", "expected a mapping with count, xyz", ""),
        ("a: {grid: {from: corner, steps: [{count: 2}]}}", "{count", "`xyz` is missing", ""),
        ("a: {grid: {from: corner, steps: [{xyz: [1, 0, 0]}]}}", "{xyz", "`count` is missing", ""),
        (
            "a: {grid: {from: corner, steps: [{count: 1, xyz: [0, 1, 0]}, {count: -3, xyz: [1, 0, 0]}]}}",
            "-3",
            "expected a whole number of at least 1, got -3",
            "",
        ),
        (
            "a: {grid: {from: corner, steps: [{count: 1, xyz: [0, 1, 0]}, {count: 3, xyz: [1, 5 kg, 0]}]}}",
            "5 kg",
            "expected a length such as",
            "",
        ),
        (
            "a: {grid: {from: corner, steps: [{count: 1, xyz: [0, 1, 0]}]}, at: 2}",
            "at:",
            "unknown key 'at'",
            "grid",
        ),
        ("a: {grid: {from: corner, step: 2}}", "step:", "unknown key 'step'", "did you mean 'steps'?"),
        (
            "a: {grid: {from: corner, steps: [{cout: 1}]}}",
            "cout",
            "unknown key 'cout'",
            "did you mean 'count'?",
        ),
        (
            "a: {joints: 0}\nframes:\n  a: {xyz: [1, 0, 0]}",
            "{xyz: [1",
            "'a' is a point and a frame",
            "share names",
        ),
        (
            "a: [corner, other]\nframes:\n  a: {xyz: [1, 0, 0]}",
            "{xyz: [1",
            "'a' is a point and a frame",
            "share names",
        ),
    ],
)
def test_a_flaw_of_what_is_many_is_shown_where_it_stands(
    point: str, at: str, message: str, hint: str
) -> None:
    text = f"{HEAD}  {point}\n"
    if "joints" in point:
        text += "  grid_of_frames: {grid: {from: a, steps: [{count: 1, xyz: [1, 0, 0]}]}}\n"
    problem = refused(text)
    assert message in problem.text()
    assert hint in (problem.hint or "")
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == where(text, at)


@pytest.mark.parametrize(
    "key", ["zone", "law", "limits", "at", "duration", "tolerance", "orientation", "approach", "retreat"]
)
def test_what_is_of_moves_has_no_place_in_a_repeat(key: str) -> None:
    """`- {repeat: ..., moves: [...]}` takes none of it; a call says which keys it takes."""
    move = f"{{repeat: 2, {key}: 1, moves: [{{planner: hold, duration: 1}}]}}"
    problem = refused(HEAD.replace("[{planner: hold, duration: 1}]", f"[{move}]"))
    assert (problem.message, problem.hint) == (
        f"unknown key '{key}'",
        f"`{key}` stands in the moves, in each that it is for",
    )
    called = HEAD.replace("[{planner: hold, duration: 1}]", f"[{{call: rest, {key}: 1}}]")
    hint = refused(called + "sequences: {rest: [{planner: hold, duration: 1}]}\n").hint or ""
    assert "stands in the moves" not in hint
    assert "call" in hint or "did you mean" in hint


LISTED = "  slot: {grid: {from: corner, steps: [{count: 2, xyz: [0, 0.1, 0]}]}}\n  near: {from: slot, offset: {}}\n"


def test_a_list_differs_from_round_to_round_where_any_of_its_names_does() -> None:
    """The last name of the list is given by a grid; the list is within its rounds, and the other way it is not."""
    outer = "[{repeat: slot, moves: [{repeat: a, moves: [{planner: quintic, to: a, duration: 9}]}]}]"
    text = HEAD.replace("[{planner: hold, duration: 1}]", outer) + LISTED + "  a: [corner, near]\n"
    assert len(job_from_text(text).job.moves) == 4
    problem = refused(
        text.replace("{repeat: slot, moves: [{repeat: a,", "{repeat: a, moves: [{repeat: slot,")
    )
    assert problem.message == "'a' differs from round to round of slot"
    assert problem.hint == "write it within `repeat: slot`"


def read(points: str, moves: str) -> LoadedJob:
    return job_from_text(HEAD.replace("[{planner: hold, duration: 1}]", moves) + points)


FRAMES = """\
  seat: {in: work, xyz: [0.1, 0, 0], rpy: [3, 0, 0]}
  also: seat
  slot: {grid: {from: NAME, steps: [{count: 3, xyz: [0, 0.01, 0]}]}}
frames:
  table: {xyz: [0.3, 0, 0], rpy: [0, 0, 0.5]}
  work: {grid: {from: table, frame: world, steps: [{count: 2, xyz: [0, 0, 0.1]}]}}
"""
NESTED = "[{repeat: work, moves: [{repeat: slot, moves: [{planner: quintic, to: slot, duration: 9}]}]}]"


@pytest.mark.parametrize("name", ["seat", "also"])
def test_a_grid_in_a_grid_is_in_the_axes_of_its_frame_and_is_told_by_both_rounds(name: str) -> None:
    loaded = read(FRAMES.replace("NAME", name), NESTED)
    cos, sin = np.cos(0.5), np.sin(0.5)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    wanted = [
        [0.3, 0, 0.1 * level] + turn @ [0.1, 0.01 * along, 0] for level in range(2) for along in range(3)
    ]
    found = [move.to.xyz for move in loaded.job.moves]
    np.testing.assert_allclose(found, wanted, atol=1e-12)
    names = {point for point in loaded.job.points if point.startswith("slot")}
    assert names == {f"slot (slot {k} of 3, work {n} of 2)" for k in (1, 2, 3) for n in (1, 2)}


def test_targets_that_are_written_on_one_line_are_each_approached_by_themselves() -> None:
    """Tools that point down approach from above: 0.1 m along z of world, whatever line the targets stand on."""
    places = [(0.4, -0.2, 0.2), (0.5, -0.1, 0.25), (0.4, 0.1, 0.3)]
    moves = ", ".join(
        f"{{planner: line, to: {{xyz: [{x}, {y}, {z}], rpy: [{np.pi}, 0, 0]}}, approach: 0.1}}"
        for x, y, z in places
    )
    loaded = read("  target in line 5: {joints: 0}\n", f"[{moves}]")
    found = [move.to.xyz for move in loaded.job.moves]
    wanted = [(x, y, z + above) for x, y, z in places for above in (0.1, 0.0)]
    np.testing.assert_allclose(found, wanted, atol=1e-12)
