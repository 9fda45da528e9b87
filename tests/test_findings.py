"""The collector of findings, against a plain search among all offences; findings as problems of errors."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from trajcli.errors import Amount, Place
from trajcli.findings import Collector, Finding

GROUPS = (("error", "exceeded"), ("error", "within rounding"), ("warning", "exceeded"))


def finding(index: int) -> Finding:
    """Return a finding that remembers the number of its offence in `row`."""
    return Finding("velocity", "j1", 1.0, 0.5, 0.0, row=index)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("blocks", [1, 3, 40])
def test_the_worst_of_each_joint_and_move_is_kept_and_all_are_counted(seed: int, blocks: int) -> None:
    random = np.random.default_rng(seed)
    joints, moves = random.integers(-1, 2, 40), random.integers(-1, 2, 40)
    excess = random.integers(-3, 4, 40) / 2.0  # many ties, and below zero
    group = random.integers(0, 3, 40)
    found = Collector()
    for part in np.array_split(np.arange(40), blocks):
        for k, (severity, certainty) in enumerate(GROUPS):
            found.add(
                "velocity",
                moves[part],
                joints[part],
                excess[part],
                lambda row, part=part: finding(int(part[row])),
                severity=severity,
                certainty=certainty,
                chosen=group[part] == k,
            )
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
