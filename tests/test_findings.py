"""The collector of findings, against a plain search among all offences; findings as problems of errors."""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np
import pytest

from trajcli.errors import Amount, Place
from trajcli.findings import Collector, Finding, at_time, excess_amounts, tool_excess_amounts

GROUPS = (("error", "exceeded"), ("error", "within rounding"), ("warning", "exceeded"))


def finding(index: int) -> Finding:
    """Return a finding that remembers the number of its offence in `row`."""
    return Finding("velocity", "j1", 1.0, 0.5, 0.0, row=index)


def add(found: Collector, part: np.ndarray, k: int, rows: tuple[np.ndarray, ...]) -> None:
    """Add the rows of a part that are of the group k; of all are given moves, joints, excess and group."""
    moves, joints, excess, group = (values[part] for values in rows)
    severity, certainty = GROUPS[k]

    def make(row: int) -> Finding:
        return finding(int(part[row]))

    found.add(
        "velocity", moves, joints, excess, make, severity=severity, certainty=certainty, chosen=group == k
    )


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("blocks", [1, 3, 40])
def test_the_worst_of_each_joint_and_move_is_kept_and_all_are_counted(seed: int, blocks: int) -> None:
    random = np.random.default_rng(seed)
    joints, moves = random.integers(-1, 2, 40), random.integers(-1, 2, 40)
    excess = random.integers(-3, 4, 40) / 2.0  # many ties, and below zero
    group = random.integers(0, 3, 40)
    found = Collector()
    for part in np.array_split(np.arange(40), blocks):
        for k in range(len(GROUPS)):
            add(found, part, k, (moves, joints, excess, group))
    expected = set()
    for joint, move in product((-1, 0, 1), repeat=2):
        own = [k for k in range(40) if (joints[k], moves[k]) == (joint, move)]
        if own:
            best = min(group[k] for k in own)
            alike = [k for k in own if group[k] == best]
            worst = max(alike, key=lambda k: (excess[k], -k))
            expected.add((worst, len(alike), None if move < 0 else move, *GROUPS[best]))
    assert {(f.row, f.count, f.move, f.severity, f.certainty) for f in found.findings()} == expected


@pytest.mark.parametrize(("more", "row"), [(1e-10, 0), (1e-8, 1)])
def test_of_offences_that_are_alike_the_first_is_kept(more: float, row: int) -> None:
    sizes, same = np.array([2.0, 2.0 * (1 + more)]), np.array([-1, -1])
    together, apart = Collector(1e-9), Collector(1e-9)
    together.add("time", -1, same, sizes, finding)
    for k in range(2):
        apart.add("time", -1, same[:1], sizes[k : k + 1], lambda _, k=k: finding(k))
    assert [f.row for f in together.findings()] == [f.row for f in apart.findings()] == [row]


def test_an_infinite_excess_is_the_worst() -> None:
    found = Collector()
    found.add("jump", -1, np.array([0, 0, 0]), np.array([1.0, np.inf, np.inf]), finding)
    assert [(f.row, f.count) for f in found.findings()] == [(1, 3)]


def test_kinds_and_quantities_are_told_apart() -> None:
    found = Collector()
    for kind, quantity in (("jump", "position"), ("jump", "velocity"), ("branch", None)):
        found.add(kind, 2, np.array([0]), np.array([1.0]), finding, quantity=quantity)
    assert [f.move for f in found.findings()] == [2, 2, 2]


def test_a_finding_as_a_problem_keeps_its_place() -> None:
    amounts = {"value": Amount(1.0, 1, 0, "angle"), "joint": "j1"}
    wrong = Finding(
        "velocity", "j1", 1.0, 0.5, 0.25, 3, 7, message="{joint}: {value}", amounts=amounts, hint="slow down"
    )
    problem = wrong.problem(wrong.text(), Place("a.csv", 8, 2))
    assert (problem.text(), problem.hint, str(problem.place)) == ("j1: 1 rad/s", "slow down", "a.csv:8:2")
    assert (problem.move, problem.joint, problem.time, problem.row) == (3, "j1", 0.25, 7)
    assert (problem.value, problem.limit, problem.kind, problem.severity) == (1.0, 0.5, "velocity", "error")


def test_what_rounding_explains_is_a_note() -> None:
    severities = [
        Finding("jerk", None, 1.0, 0.5, 0.0, severity=severity, certainty=certainty).problem("").severity
        for severity, certainty in GROUPS
    ]
    assert severities == ["error", "note", "warning"]


def test_a_message_in_other_units_keeps_the_unit_of_the_numbers() -> None:
    wrong = Finding(
        "velocity", "j1", 1.0, 0.5, 0.0, message="{value}", amounts={"value": Amount(1.0, 1, 0, "length")}
    )
    said = wrong.said_by(lambda amount: f"{1000 * amount.value:g} mm/s")
    assert (said.text(), said.si_unit, said.value) == ("1000 mm/s", "m/s", 1.0)


def test_a_joint_may_have_a_name_that_looks_like_an_amount() -> None:
    amounts = {"value": Amount(1.0, 1, 0, "angle"), "joint": "{value}"}
    wrong = Finding("velocity", "{value}", 1.0, 0.5, message="{joint}: {value}", amounts=amounts)
    assert wrong.text() == wrong.said_by(str).text() == "{value}: 1 rad/s"


@pytest.mark.parametrize("seed", range(12))
def test_of_all_moves_together_the_worst_of_each_certainty_is_kept(seed: int) -> None:
    """Blocks are moves: of each joint and each certainty the worst one, counted in the move in which it is."""
    random = np.random.default_rng(seed)
    joints, moves = random.integers(-1, 2, 40), np.sort(random.integers(-1, 3, 40))
    excess, group = random.integers(-3, 4, 40) / 2.0, random.integers(0, 3, 40)
    found = Collector(by_move=False)
    for move, k in product((-1, 0, 1, 2), range(len(GROUPS))):
        part = np.flatnonzero(moves == move)
        add(found, part, k, (moves, joints, excess, group))
    expected = set()
    for joint, k in product((-1, 0, 1), range(3)):
        alike = [row for row in range(40) if (joints[row], group[row]) == (joint, k)]
        if alike:
            worst = max(alike, key=lambda row: (excess[row], -row))
            count = sum(moves[row] == moves[worst] for row in alike)
            expected.add((worst, count, None if moves[worst] < 0 else moves[worst], *GROUPS[k]))
    assert {(f.row, f.count, f.move, f.severity, f.certainty) for f in found.findings()} == expected


@pytest.mark.parametrize(
    ("sizes", "worst"),
    [([1, 5, 2, 4, 3, 4.5], (1, 3, 0)), ([1, 2, 1, 4, 3, 5], (5, 3, 1)), ([5, 2, 1, 4, 3, 5], (0, 3, 0))],
)
def test_all_moves_of_one_block_have_one_worst(sizes: list[float], worst: tuple[int, int, int]) -> None:
    """Three offences of each of two moves: the first of the worst ones is kept, and those of its move count."""
    found = Collector(by_move=False)
    moves, joints = np.array([0, 0, 0, 1, 1, 1]), np.zeros(6, dtype=int)
    found.add("velocity", moves, joints, np.array(sizes, dtype=float), finding)
    (one,) = found.findings()
    assert (one.row, one.count, one.move) == worst


@pytest.mark.parametrize(
    ("value", "limit", "excess"),
    [
        (3.0, 2.0, 1.5),
        (-3.0, -2.0, 1.5),
        (-3.0, 2.0, 1.5),
        (1.0, 2.0, 0.5),
        (3.0, 0.0, np.inf),
        (None, 2.0, np.inf),
    ],
)
def test_how_bad_a_finding_is_has_no_sign(value: float | None, limit: float, excess: float) -> None:
    assert Finding("velocity", "j1", value, limit, 0.0).excess == excess
    for kind in ("jump", "time", "derivative"):  # of these there is no ratio to what they may be
        assert Finding(kind, "j1", value, limit, 0.0).excess == np.inf


@pytest.mark.parametrize(("value", "limit"), [(1.5, 1.0), (0.5, 1.0), (-0.5, -1.0), (-1.5, -1.0)])
def test_a_position_is_beyond_its_limit_by_the_distance_from_there(value: float, limit: float) -> None:
    """A lower limit may be above zero, an upper one below it, and the position between zero and it."""
    assert Finding("position", "j1", value, limit, 0.0).excess == 1.5


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("side", [1, -1])
def test_a_value_beyond_its_limit_is_printed_beyond_it(side: int, sign: int) -> None:
    """Nine digits make one number of both: they are rounded away from each other."""
    limit = sign * 1.23456789012
    value = limit + side * 1e-11
    amounts = excess_amounts(Arm, 1, 1, value, limit)
    printed = [float(str(amounts[name]).split()[0]) for name in ("value", "limit")]
    assert np.sign(printed[0] - printed[1]) == side
    assert side * (printed[0] - value) >= 0 >= side * (printed[1] - limit)
    for name in ("value", "limit"):
        amount = amounts[name]
        assert (amounts["joint"], amount.order, amount.joint, amount.dimension) == ("b", 1, 1, "length")


@pytest.mark.parametrize(("dimension", "unit"), [("length", "m"), ("angle", "rad")])
@pytest.mark.parametrize(("order", "rate"), [(0, ""), (1, "/s"), (2, "/s^2"), (3, "/s^3")])
def test_a_value_of_the_tool_is_printed_beyond_its_limit_in_its_unit(
    order: int, rate: str, dimension: Literal["length", "angle"], unit: str
) -> None:
    limit = 1.23456789012
    amounts = tool_excess_amounts(limit + 1e-11, limit, order, dimension)
    assert [str(amounts[name]) for name in ("value", "limit")] == [
        f"1.2345679 {unit}{rate}",
        f"1.23456789 {unit}{rate}",
    ]
    assert Finding("tool_speed", value=2.0, limit=1.0, amounts=amounts).si_unit == unit + rate


def test_a_time_is_told_in_seconds_to_the_nanosecond() -> None:
    assert at_time(1.23456789) == "at t = 1.23456789 s"
    assert at_time(1_700_000_000.48) == "at t = 1700000000.48 s"  # since 1970: nine digits are whole years
    assert at_time(-1_700_000_000.123456) == "at t = -1700000000.123456 s"


@pytest.mark.parametrize("more", [1e-9, 1e-7])
def test_what_differs_by_more_than_rounding_is_worse(more: float) -> None:
    found = Collector()
    found.add("velocity", 0, np.array([0, 0]), np.array([2.0, 2.0 * (1 + more)]), finding)
    assert [f.row for f in found.findings()] == [1]


class Arm:
    """Two joints, the second of which slides."""

    joint_names = ("a", "b")
    joint_types = ("revolute", "prismatic")


@pytest.mark.parametrize("kind", ["start", "end"])
def test_a_state_that_is_missed_comes_before_limits_that_are_passed(kind: str) -> None:
    """Its value over what was expected says nothing: an arm at 0 instead of 0.009 rad is no smaller fault than at 0.02."""
    missed = [Finding(kind=kind, value=value, limit=0.009) for value in (0.0, 0.02)]
    passed = Finding(kind="velocity", value=1.1, limit=1.0)
    assert all(finding.excess > passed.excess for finding in missed)


@pytest.mark.parametrize("by_move", [True, False])
def test_findings_of_many_moves_are_made_at_once_and_one_of_all_moves_when_it_is_asked_for(
    *, by_move: bool
) -> None:
    """Rows of the one may go, or be written over; of the other only the worst is made, though each is worse."""
    found, rows, made = Collector(by_move=by_move), np.zeros(1, dtype=int), list[int]()

    def make(_: int) -> Finding:
        made.append(int(rows[0]))
        return finding(int(rows[0]))

    for row in range(5):
        rows[0] = row
        found.add("velocity", row, np.array([0]), np.array([1.0 + row]), make)
    rows[0] = 99
    assert made == (list(range(5)) if by_move else [])
    assert [each.row for each in found.findings()] == (list(range(5)) if by_move else [99])
