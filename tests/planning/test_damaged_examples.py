"""Examples with something left out, exchanged or of another size: each plans, or is refused in words of its own."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
import yaml
from planned_examples import EXAMPLES
from tally import Tally
from tiers import few

from trajcli.cli.frames import render_problem
from trajcli.errors import Problem, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

SLOW = {"dispense", "flying_cell", "pallet", "scorbot_wave", "signals", "two_tools", "weave"}
VALUES = [
    None,
    0,
    -1,
    1e-300,
    1e6,
    "",
    "x",
    [],
    {},
    [1, 2],
    [[1]],
    True,
    "1 m",
    "90 deg",
    {"joints": [0]},
    "tool",
]
FACTORS = [-1, 0.5, 2, 10, 0.1, 1e3, 1e-3]
BLOCK = 40
Tree = dict[str, Any]


@cache
def examples() -> dict[str, Tree]:
    found = {}
    for path in sorted(EXAMPLES.glob("*.yaml")):
        tree = yaml.safe_load(path.read_text())
        if path.stem not in SLOW and "moves" in tree:
            found[path.stem] = tree
    return found


def places(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield where each value of a tree stands."""
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in inside:
        yield (*path, key)
        yield from places(value, (*path, key))


def at(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        tree = tree[key]
    return tree


@cache
def values() -> tuple[tuple[Any, str], ...]:
    """Return the keys and values of all examples, as text: each is put elsewhere as a copy."""
    found = [(path[-1], at(tree, path)) for tree in examples().values() for path in places(tree)]
    return tuple((key, yaml.safe_dump(value)) for key, value in found)


def damage(tree: Tree, draws: random.Random) -> None:
    """Leave a value out, double it, or put another in its place."""
    *parents, key = draws.choice(list(places(tree)))
    parent = at(tree, tuple(parents))
    value, what = parent[key], draws.randrange(7)
    if what == 0:
        del parent[key]
    elif what == 1:
        parent[key] = yaml.safe_load(yaml.safe_dump(draws.choice(VALUES)))
    elif what == 2 and isinstance(parent, list):
        parent.insert(key, value)
    elif what == 3 and isinstance(value, int | float):
        parent[key] = value * draws.choice(FACTORS)
    elif what == 4 and isinstance(parent, dict):
        name, text = draws.choice(values())
        parent[name] = yaml.safe_load(text)
    else:
        alike = [text for name, text in values() if name == key or what == 5]
        parent[key] = yaml.safe_load(draws.choice(alike))


def damaged(seed: int) -> str:
    draws = random.Random(seed)
    tree = yaml.safe_load(yaml.safe_dump(draws.choice(list(examples().values()))))
    for _ in range(draws.choice([1, 1, 2, 3])):
        if tree:
            damage(tree, draws)
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)


def planned_or_refused(seed: int) -> Plan | tuple[Problem, ...]:
    try:
        return plan_job(job_from_text(damaged(seed), str(EXAMPLES / "damaged.yaml")))
    except TrajcliError as error:
        return error.problems


def outcome(seed: int) -> str:
    """Return whether a damaged example is planned or refused; each line of a refusal is looked at."""
    found = planned_or_refused(seed)
    if isinstance(found, Plan):
        return "verified" if found.verdict.passed else "over a limit"
    assert found, seed
    for problem in found:
        said = render_problem(problem, color=False, width=None)
        own = "\n".join(line for line in said.splitlines() if re.match(r" *\d* \|", line) is None)
        assert re.search(r"\b(nan|None|NoneType|array)\b|<class|object at", own) is None, (seed, said)
    return "refused"


@pytest.mark.parametrize("block", few(range(20), 1))
def test_a_damaged_example_is_planned_or_refused(block: int) -> None:
    found = [outcome(seed) for seed in few(range(BLOCK * block, BLOCK * (block + 1)), 8)]
    assert set(found) >= {"refused", "verified"}


@pytest.mark.soak
@pytest.mark.parametrize("block", range(100))
def test_four_thousand_damaged_examples(block: int, tally: Tally) -> None:
    found = [outcome(seed) for seed in range(1000 + BLOCK * block, 1000 + BLOCK * (block + 1))]
    tally({name: found.count(name) for name in ("refused", "verified", "over a limit")})
