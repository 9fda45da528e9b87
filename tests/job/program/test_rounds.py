"""Repeats and calls against the same moves written out by hand."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from counted_calls import calls_of

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.program.expand import ExpandedDocument
from trajcli.job.read import job_from_text
from trajcli.language.points import NamedTarget
from trajcli.planning.plan import Plan, plan_job

HEAD = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 4000}
start: {joints: [0, -90, 90, -90, -90, 0]}
"""
CORNER = "  corner: {xyz: [400, -200, 200], rpy: [180, 0, 0], configuration: {elbow: up}}\n"
PALLET = f"""\
points:
{CORNER}\
  home: {{joints: [0, -90, 90, -90, -90, 0]}}
  slot: {{grid: {{from: corner, steps: [{{count: 2, xyz: [0, 100, 0]}}, {{count: 3, xyz: [80, 0, 5]}}]}}}}
  above: {{from: slot, offset: {{xyz: [0, 0, 80]}}, frame: world}}
sequences:
  place:
    - {{planner: line, to: slot, law: {{shape: quintic, duration: 1}}}}
    - {{planner: hold, duration: 0.5}}
moves:
  - repeat: slot
    moves:
      - {{planner: jerk_limited, to: above}}
      - call: place
      - {{planner: jerk_limited, to: home}}
"""


def planned(text: str) -> Plan:
    return plan_job(job_from_text(HEAD + text, "job.yaml"))


def by_hand() -> str:
    """Return the pallet as somebody writes it who has no repeat."""
    places = [
        (400 + 80 * column, -200 + 100 * row, 200 + 5 * column)
        for row, column in itertools.product(range(2), range(3))
    ]
    lines = ["points:", "  home: {joints: [0, -90, 90, -90, -90, 0]}", "moves:"]
    for x, y, z in places:
        pose = "rpy: [180, 0, 0], configuration: {elbow: up}"
        lines.append(f"  - {{planner: jerk_limited, to: {{xyz: [{x}, {y}, {z + 80}], {pose}}}}}")
        law = "law: {shape: quintic, duration: 1}"
        lines.append(f"  - {{planner: line, to: {{xyz: [{x}, {y}, {z}], {pose}}}, {law}}}")
        lines.append("  - {planner: hold, duration: 0.5}")
        lines.append("  - {planner: jerk_limited, to: home}")
    return "\n".join(lines) + "\n"


@pytest.mark.full
def test_a_pallet_is_the_moves_written_out() -> None:
    plan, other = planned(PALLET), planned(by_hand())
    assert [span.planner for span in plan.trajectory.spans] == [
        span.planner for span in other.trajectory.spans
    ]
    assert plan.trajectory.duration == pytest.approx(other.trajectory.duration, abs=1e-9)
    times = np.linspace(0, other.trajectory.duration, 500)
    for order in range(3):
        rows, expected = (each.trajectory.curve.evaluate(times, order) for each in (plan, other))
        assert np.abs(rows - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.full
def test_the_resolved_job_is_the_expanded_one_bit_by_bit() -> None:
    plan = planned(PALLET)
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    assert len(again.loaded.job.moves) == 24
    np.testing.assert_array_equal(plan.trajectory.curve.breaks, again.trajectory.curve.breaks)
    np.testing.assert_array_equal(plan.trajectory.curve.coefficients, again.trajectory.curve.coefficients)


COUNTED = """\
sequences:
  swing:
    - {planner: quintic, to: a}
    - repeat: 2
      moves: [{planner: quintic, to: b}, {planner: hold, duration: 1}]
points: {a: {joints: 0}, b: {joints: [5, -80, 90, -90, -90, 0]}}
moves:
  - repeat: 3
    moves: [{call: swing}]
  - {planner: quintic, to: a}
"""


def test_counts_and_nested_repeats_give_the_same_bytes() -> None:
    swing = ["{planner: quintic, to: a}"] + ["{planner: quintic, to: b}", "{planner: hold, duration: 1}"] * 2
    moves = ", ".join([*swing * 3, "{planner: quintic, to: a}"])
    points = "points: {a: {joints: 0}, b: {joints: [5, -80, 90, -90, -90, 0]}}\n"
    plan, other = planned(COUNTED), planned(f"{points}moves: [{moves}]\n")
    np.testing.assert_array_equal(plan.trajectory.curve.breaks, other.trajectory.curve.breaks)
    np.testing.assert_array_equal(plan.trajectory.curve.coefficients, other.trajectory.curve.coefficients)
    assert [span.round for span in plan.trajectory.spans][4:7] == [
        "round 1 of 3, round 2 of 2",
        "round 2 of 3",
        "round 2 of 3, round 1 of 2",
    ]


def test_rounds_that_are_the_same_motion_are_planned_once() -> None:
    text = "moves: [{repeat: 40, moves: [{planner: quintic, to: {joints: 0}}, {planner: quintic, to: {joints: 0.5}}]}]\n"
    plan = planned(text)
    curves = {id(move.planned) for move in plan.moves}
    assert len(plan.moves) == 80
    assert len(curves) == 3  # the first comes from the start
    assert [move.index for move in plan.moves] == list(range(80))


LISTS = """\
points:
  a: {joints: 0}
  b: {joints: 1}
  c: {joints: 2}
  pick: [a, b]
  place: [c, a]
moves:
  - repeat: [pick, place]
    moves: [{planner: quintic, to: pick}, {planner: quintic, to: place}]
"""


def test_two_lists_go_together() -> None:
    moves = planned(LISTS).loaded.job.moves
    targets: list[NamedTarget] = [move.to for move in moves]  # type: ignore[attr-defined]
    assert [target.joints[0] for target in targets if target.joints] == pytest.approx(
        np.radians([0, 2, 1, 0])
    )


@pytest.mark.full
def test_a_place_is_so_many_times_the_step() -> None:
    text = """\
points:
  corner: {xyz: [0, 0, 0.1]}
  slot: {grid: {from: corner, steps: [{count: 400, xyz: [0.1, 0, 0]}, {count: 5, xyz: [0, 0.3, 0.7]}]}}
moves: [{repeat: slot, moves: [{planner: quintic, to: slot}]}]
"""
    head = HEAD.replace("length: mm", "length: m")
    job = job_from_text(head + text).job
    rows, columns = np.divmod(np.arange(2_000), 5)
    expected = np.stack([rows * 0.1, columns * 0.3, columns * 0.7 + 0.1], axis=-1)
    found = np.array([move.to.xyz for move in job.moves])  # type: ignore[attr-defined]
    assert np.abs(found - expected).max() <= 8e-15  # added up it would be 1e-13


WRONG = [
    ("  - call: plac\n", 2, "there is no sequence 'plac'", "did you mean 'place'?"),
    ("  - {repeat: slot, moves: [{call: place}], lable: x}\n", 2, "unknown key 'lable'", "label"),
    ("  - {repeat: corner, moves: [{call: place}]}\n", 2, "'corner' is not many itself", "slot"),
    (
        "  - {repeat: above, moves: [{call: place}]}\n",
        2,
        "'above' is not many itself",
        "write `repeat: slot`",
    ),
    ('  - {repeat: "3", moves: [{call: place}]}\n', 2, "'3' is not many itself", "without quotes: 3"),
    ("  - {repeat: 0, moves: [{call: place}]}\n", 2, "whole number of at least 1", None),
    ("  - {repeat: true, moves: [{call: place}]}\n", 2, "whole number of at least 1", None),
    (
        "  - {repeat: slot, moves: [{call: place}]}\n  - call: place\n",
        0,
        "'slot' is many (6)",
        "repeat: slot",
    ),
    ("  - {repeat: [slot, two], moves: [{call: place}]}\n", 2, "slot is 6, two is 2", None),
    ("  - {repeat: [slot, slot], moves: [{call: place}]}\n", 2, "different names", None),
    ("  - {repeat: 2}\n", 2, "needs `moves`", None),
    ("  - {repeat: 2, moves: []}\n", 2, "empty", None),
    ("  - {repeat: 2, label: [x], moves: [{call: place}]}\n", 2, "expected a text, got a list", None),
    ("  - {call: rest, label: {x: 1}}\n", 2, "expected a text, got a mapping", None),
    ("  - call: [place]\n", 2, "expected the name of a sequence", None),
    ("  - call: place\n", 0, "'slot' is many (6)", "{repeat: slot, moves: [...]}"),
    ("  - {planner: quintic, to: above}\n", 2, "'slot' is many (6)", "repeat: slot"),
    ("  - call: again\n", -1, "the sequence 'again' calls itself (again -> again)", None),
    ("  - {repeat: 1000, moves: [{repeat: 1001, moves: [{call: rest}]}]}\n", 2, "1001000 entries", None),
]
SECTIONS = f"""\
points:
{CORNER}\
  slot: {{grid: {{from: corner, steps: [{{count: 6, xyz: [0, 100, 0]}}]}}}}
  other: {{joints: 0}}
  two: [corner, other]
  above: {{from: slot, offset: {{xyz: [0, 0, 80]}}, frame: world}}
sequences:
  rest: [{{planner: hold, duration: 1}}]
  again: [{{call: again}}]
  place: [{{planner: quintic, to: slot}}]
moves:
"""


@pytest.mark.parametrize(("move", "line", "message", "hint"), WRONG)
def test_a_wrong_program_is_refused_on_its_line(move: str, line: int, message: str, hint: str | None) -> None:
    text = SECTIONS if "again" in move else SECTIONS.replace("  again: [{call: again}]\n", "")
    line += (HEAD + text).count("\n") - 1
    with pytest.raises(InputError) as caught:
        job_from_text(HEAD + text + move, "job.yaml")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert hint is None or hint in (problem.hint or "")
    assert problem.place is not None
    assert problem.place.line == line


def test_a_sequence_that_nobody_calls_is_no_longer_than_others() -> None:
    """It is read, too: without a bound, thirty million rounds of a hold fill the memory."""
    text = SECTIONS.replace("[{call: again}]", "[{repeat: 30000000, moves: [{call: rest}]}]")
    with pytest.raises(InputError, match="30000000 entries") as caught:
        job_from_text(HEAD + text + "  - call: rest\n")
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.source.startswith("  again:")


def test_what_no_round_reaches_is_read_too() -> None:
    text = SECTIONS.replace("  again: [{call: again}]\n", "").replace(
        "sequences:",
        "  far: {grid: {from: corner, steps: [{count: 2, xyz: [1, 0, 0]}], frame: nowhere}}\nsequences:",
    )
    with pytest.raises(InputError, match="there is no frame 'nowhere'") as caught:
        job_from_text(HEAD + text + "  - call: rest\n")
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.source.startswith("  far:")


def test_a_flaw_in_a_sequence_that_nobody_calls_is_placed_where_it_is_written() -> None:
    """Its rounds are written out, so that the flaw is the fourth entry, and the second one in the file."""
    lines = "  again:\n    - {repeat: 3, moves: [{call: rest}]}\n    - {planner: hold, duration: -1}\n"
    text = SECTIONS.replace("  again: [{call: again}]\n", lines)
    with pytest.raises(InputError, match="above 0 s, got -1") as caught:
        job_from_text(HEAD + text + "  - call: rest\n")
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.source == "    - {planner: hold, duration: -1}"


def test_a_sequence_that_is_called_again_counts_again() -> None:
    text = SECTIONS.replace("[{call: again}]", "[{repeat: 600000, moves: [{call: rest}]}]")
    with pytest.raises(InputError, match="1200000 entries"):
        job_from_text(HEAD + text + "  - call: again\n  - call: again\n")


def test_rounds_within_rounds_are_those_of_both_and_the_inner_one_counts() -> None:
    """A grid in a frame that is many: its places are the frame's plus the steps, in every round of the frame."""
    text = """\
frames:
  left: {xyz: [0, 300, 0]}
  right: {xyz: [0, -300, 0]}
  work: [left, right]
points:
  first: {in: work, xyz: [400, 0, 200], rpy: [180, 0, 0], configuration: {elbow: up}}
  slot: {grid: {from: first, steps: [{count: 2, xyz: [50, 0, 0]}]}}
moves:
  - repeat: work
    label: on
    moves: [{repeat: slot, moves: [{planner: jerk_limited, to: slot}]}]
  - repeat: [work, slot]
    moves: [{repeat: slot, label: in, moves: [{planner: jerk_limited, to: slot}]}]
"""
    loaded = job_from_text(HEAD + text)
    places = [[0.4 + 0.05 * k, y, 0.2] for y in (0.3, -0.3) for k in range(2)]
    found = [move.to.xyz for move in loaded.job.moves]  # type: ignore[attr-defined]
    np.testing.assert_allclose(found, [*places, *places], rtol=0, atol=1e-12)
    rounds = [f"{{}}work {frame} of 2{{}}slot {k} of 2" for frame in (1, 2) for k in (1, 2)]
    outer = [f", slot {frame} of 2, in, " for frame in (1, 1, 2, 2)]
    expected = [words.format("on, ", ", ") for words in rounds]
    expected += [words.format("", between) for words, between in zip(rounds, outer, strict=True)]
    document = loaded.document
    assert isinstance(document, ExpandedDocument)
    assert [document.round_of(index) for index in range(8)] == expected


def test_labels_of_calls_are_in_the_words_of_a_round() -> None:
    text = SECTIONS.replace("  again: [{call: again}]\n", "")
    moves = "  - {call: rest, label: c}\n  - {repeat: 2, label: a, moves: [{call: rest, label: b}]}\n"
    document = job_from_text(HEAD + text + moves).document
    assert isinstance(document, ExpandedDocument)
    expected = ["c", "a, round 1 of 2, b", "a, round 2 of 2, b"]
    assert [document.round_of(index) for index in range(3)] == expected


OUTSIDE = [  # what stands in no round: what it names, a name that is many
    ("start: two", "two"),
    ("start: {from: above, offset: {xyz: [0, 0, 10]}}", "slot"),
    ("start: above", "slot"),
    ("output: {in: work}", "work"),
    ("output: {in: shifted}", "work"),
]


def test_a_start_in_a_frame_that_is_many_is_given_in_one_of_them() -> None:
    text = """
        version: 1
        robot: ur5e
        frames: {left: {xyz: [0.4, 0, 0.3]}, right: {xyz: [0.4, 0.1, 0.3]}, work: [left, right]}
        points: {p: {in: work, xyz: [0, 0, 0.1], rpy: [3.1, 0, 0]}}
        limits: {velocity: 1}
        start: p
        moves: [{repeat: work, moves: [{planner: quintic, to: p, duration: 9}]}]
    """
    with pytest.raises(InputError, match=r"'work' is many \(2\), and no round") as caught:
        job_from_text(text)
    (problem,) = caught.value.problems
    assert problem.hint == "give the pose in one of them: {in: left, ...}"
    job_from_text(text.replace("start: p", "start: {in: left, xyz: [0, 0, 0.1], rpy: [3.1, 0, 0]}"))


@pytest.mark.parametrize(("line", "many"), OUTSIDE)
def test_start_and_output_name_none_that_is_many(line: str, many: str) -> None:
    head = HEAD if line.startswith("output") else HEAD[: HEAD.index("start: ")]
    frames = (
        "frames:\n  left: {}\n  right: {}\n  work: [left, right]\n  shifted: {in: work, xyz: [1, 0, 0]}\n"
    )
    text = SECTIONS.replace("  again: [{call: again}]\n", "").replace("sequences:", frames + "sequences:")
    with pytest.raises(InputError, match=rf"'{many}' is many \([0-9]\), and no round") as caught:
        job_from_text(f"{head}{line}\n{text}  - call: rest\n")
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.source == line
    assert problem.hint is not None
    advice, _, named = problem.hint.rpartition(" ")
    assert advice == "name one, such as"
    key = "start: " if line.startswith("start") else "output: {in: "
    job_from_text(f"{head}{key}{named}{'}' * key.count('{')}\n{text}  - call: rest\n")


POINTS = [
    ("a: {grid: {from: a, steps: [{count: 2, xyz: [1, 0, 0]}]}}", "'a' is many"),
    (
        "a: {grid: {from: b, steps: [{count: 2, xyz: [1, 0, 0]}]}}\n  b: {from: a, offset: {}}",
        "begins at itself",
    ),
    ("a: {grid: {from: corner, steps: [{count: 1000000000, xyz: [1, 0, 0]}]}}", "1000000000 places"),
    ("a: {grid: {from: corner, steps: [{count: 2, xyz: [1, 0]}]}}", "expected 3 numbers"),
    ("a: {grid: {from: corner, steps: [{count: 2.5, xyz: [1, 0, 0]}]}}", "whole number"),
    ("a: {grid: {from: corner, steps: []}}", "list of steps"),
    ("a: {grid: {from: corner, step: 1}}", "unknown key 'step'"),
    ("a: {grid: {from: conner, steps: [{count: 2, xyz: [1, 0, 0]}]}}", "no point or frame 'conner'"),
    ("a: [corner, conner]", "no point or frame 'conner'"),
    ("a: [corner, corner]", "stands twice"),
    ("here: {joints: 0}", "'here' is no name"),
    ("1e3: {joints: 0}", "'1e3' is no name"),
]


@pytest.mark.parametrize(("point", "message"), POINTS)
def test_wrong_points_are_refused(point: str, message: str) -> None:
    point = f'"1e3"{point[3:]}' if point.startswith("1e3") else point
    text = f"{HEAD}points:\n{CORNER}  {point}\nmoves: [{{planner: quintic, to: corner}}]\n"
    with pytest.raises(InputError) as caught:
        job_from_text(text, "job.yaml")
    assert message in caught.value.problems[0].message
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.line in (8, 9)


def test_a_flaw_in_a_move_that_is_repeated_is_said_once_and_names_the_round_when_it_plans() -> None:
    with pytest.raises(InputError) as caught:
        job_from_text(HEAD + PALLET.replace("duration: 0.5", "duratio: 0.5"), "job.yaml")
    assert [problem.message for problem in caught.value.problems] == ["unknown key 'duratio'"]
    with pytest.raises(InputError) as caught:
        job_from_text(HEAD + PALLET.replace("duration: 0.5", "comment: 0.5"), "job.yaml")
    assert [problem.message for problem in caught.value.problems] == [
        "`duration` is missing",
        "unknown key 'comment'",
    ]
    far = PALLET.replace("xyz: [80, 0, 5]", "xyz: [800, 0, 0]")
    with pytest.raises(
        Exception,
        match=r"move 4, home -> above \(jerk_limited, slot 2 of 6\): the point 'above \(slot 2 of 6\)'",
    ):
        planned(far)


def test_a_sequence_that_nobody_calls_is_read() -> None:
    text = SECTIONS.replace("  again: [{call: again}]\n", "").replace("duration: 1", "duration: -1")
    with pytest.raises(InputError, match="above 0") as caught:
        job_from_text(HEAD + text + "  - {planner: hold, duration: 1}\n", "job.yaml")
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.line == 13


def _calls(rows: int) -> int:
    """Return how many functions, those of C counted, a pallet of so many rows of places calls."""
    text = PALLET.replace("count: 2", f"count: {rows}").replace("[0, 100, 0]", "[0, 2, 0]")
    text = text.replace("planner: line", "planner: quintic").replace(
        "law: {shape: quintic, duration: 1}", "duration: 1"
    )
    text = text.replace("jerk_limited", "quintic")
    return calls_of(lambda: planned(text))


@pytest.mark.full
def test_calls_grow_as_the_places_of_a_pallet() -> None:
    _calls(2)  # what is made once
    few, more, many = (_calls(rows) for rows in (3, 5, 11))
    assert many - more < 1.02 * 3 * (more - few)


def nested(sequences: int, repeats: int, calls: str = "{call: s0}") -> str:
    """Return sequences that call one another, each within several repeats."""
    lines = []
    for index in range(sequences):
        inner = "{planner: hold, duration: 1}" if index == sequences - 1 else f"{{call: s{index + 1}}}"
        for _ in range(repeats):
            inner = f"{{repeat: 1, moves: [{inner}]}}"
        lines.append(f"  s{index}: [{inner}]\n")
    return f"sequences:\n{''.join(lines)}moves: [{calls}]\n"


BACKWARDS = ", ".join(f"{{call: s{index}}}" for index in reversed(range(1200)))
DEEP = [  # each is refused before the stack is full
    nested(100, 13),
    nested(1200, 0, BACKWARDS),
]


@pytest.mark.parametrize("text", DEEP, ids=["repeats", "calls"])
def test_what_is_nested_too_deep_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="more than 300 repeats and calls stand one in another") as caught:
        job_from_text(HEAD + text)
    assert caught.value.problems[0].place is not None


def test_what_is_nested_within_the_bound_is_read() -> None:
    assert len(job_from_text(HEAD + nested(100, 2)).job.moves) == 1
    with pytest.raises(InputError, match="more than 100 sequences call one another"):
        job_from_text(HEAD + nested(101, 1))
    circle = nested(2, 1).replace("{planner: hold, duration: 1}", "{call: s0}")
    with pytest.raises(InputError, match=r"calls itself \(s0 -> s1 -> s0\)"):
        job_from_text(HEAD + circle)


@pytest.mark.parametrize(("link", "many"), [("{from: p%d, offset: {xyz: [0, 0, 1]}}", 350), ("p%d", 1000)])
def test_a_long_chain_to_a_place_of_a_grid_is_refused(link: str, many: int) -> None:
    def job(count: int) -> str:
        chain = "".join(f"  p{index}: {link % (index + 1)}\n" for index in range(count - 1))
        grid = f"  p{count - 1}: {{grid: {{from: corner, steps: [{{count: 2, xyz: [1, 0, 0]}}]}}}}\n"
        move = f"moves: [{{repeat: p{count - 1}, moves: [{{planner: jerk_limited, to: p0}}]}}]\n"
        return f"{HEAD}points:\n{CORNER}{chain}{grid}{move}"

    assert len(job_from_text(job(100)).job.moves) == 2
    with pytest.raises(
        InputError, match="more than 100 points and frames are given one by the next"
    ) as caught:
        job_from_text(job(many))
    place = caught.value.problems[0].place
    assert place is not None
    assert place.source.startswith("  p100:")


def test_titles_leave_out_the_round_of_a_point_and_no_part_of_its_name() -> None:
    text = PALLET.replace("above", '"above (left)"') + '  - {planner: jerk_limited, to: "above (left)"}\n'
    with pytest.raises(InputError, match="is many"):
        job_from_text(HEAD + text)
    text = PALLET.replace("above", '"above (left)"').replace("home", '"shelf (left)"')
    loaded = job_from_text(HEAD + text)
    assert [loaded.ends(index) for index in range(4)] == [
        "-> above (left)",
        "above (left) -> slot 1 of 6",
        "",
        "slot 1 of 6 -> shelf (left)",
    ]
