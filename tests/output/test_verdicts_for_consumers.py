"""What keeps rows from a consumer, and what is said of them: each limit, each necessary rule, and where decimals are few."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace as Some
from typing import Any

import pytest

from trajcli.grids import UniformGrid
from trajcli.output.delivery.for_consumer import ForConsumer, _in_its_move


def made(
    *,
    passed: bool = True,
    limits: tuple[float | None, ...] = (),
    severities: tuple[str, ...] = (),
    uses: tuple[tuple[float, int, int, int], ...] = ((0.5, 1, 0, 0),),
    rounding: float = 0.0,
    **fields: Any,
) -> ForConsumer:
    """Return a plan for a consumer of two joints whose rows state positions and two derivatives."""
    trajectory = Some(duration=3.0, joint_names=("turn", "lift"))
    plan = Some(
        verdict=Some(passed=passed),
        trajectory=trajectory,
        loaded=Some(job=Some(output=Some(rows="rate", rate=125.0))),
    )
    grid = UniformGrid(3.0, 125.0)
    rows = Some(uses=lambda: list(uses), judged_orders=2, rounding=lambda: rounding, grid=grid)
    joined = Some(findings=[Some(limit=limit) for limit in limits])
    rules = Some(findings=[Some(limit=None, severity=each) for each in severities])
    given: dict[str, Any] = {
        "grid": grid,
        "joined": joined,
        "rules": rules,
        "shortest": 2.5,
        "digits": "fixed",
        **fields,
    }
    return ForConsumer(plan, Some(name="servo"), rows=rows, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fields", "count"),
    [
        ({}, 0),
        ({"limits": (2.0,)}, 1),
        ({"limits": (None, 2.0, None)}, 1),  # what is no limit is a rule of the file
        ({"severities": ("warning", "error")}, 1),
        ({"severities": ("warning",)}, 0),
        ({"limits": (1.0, 2.0), "severities": ("error", "error")}, 4),
        ({"limits": (1.0,), "rules": None}, 1),
        ({"severities": ("error",), "joined": None}, 1),
    ],
)
@pytest.mark.parametrize("passed", [True, False])
def test_rows_are_kept_back_by_each_limit_and_each_necessary_rule(
    fields: dict[str, Any], count: int, passed: bool
) -> None:
    found = made(passed=passed, **fields)
    assert len(found.over) == count
    assert found.keeps is found.clean is (passed and count == 0)


@pytest.mark.parametrize(
    ("uses", "over"),
    [
        (((1 + 1e-7, 1, 0, 0), (0.2, 2, 1, 0)), []),
        (((0.5, 1, 0, 0), (1 + 1e-5, 2, 1, 0)), [1]),
        (((1.5, 2, 0, 0), (1.5, 3, 1, 0)), [0]),  # of the jerk nobody judges
        (((1.5, 0, 0, 0), (1.2, 1, 1, 3)), [0, 1]),
    ],
)
def test_limits_between_rows_are_those_of_orders_that_are_judged(
    uses: tuple[tuple[float, int, int, int], ...], over: list[int]
) -> None:
    found = made(uses=uses)
    assert found.uses_over == [uses[k] for k in over]
    assert found.keeps
    assert found.clean is (not over)


@pytest.mark.parametrize(
    ("rounding", "fields", "coarse"),
    [
        (0.06, {}, True),
        (0.04, {}, False),
        (0.06, {"digits": "full"}, False),
        (0.06, {"decimal": False}, False),
    ],
)
def test_nine_decimals_are_few_for_text_alone(rounding: float, fields: dict[str, Any], coarse: bool) -> None:
    found = made(rounding=rounding, **fields)
    assert found.coarse is coarse
    assert found.clean is not coarse


def test_the_summary_says_the_largest_use_and_how_much_longer_it_lasts() -> None:
    uses = ((0.25, 1, 0, 0), (0.875, 2, 1, 0), (0.5, 3, 0, 1))
    found = made(uses=uses)
    said = "for servo at 125 Hz: joined as it will be, 87.5 % of the acceleration of lift used"
    assert found.summary == f"{said}; 20 % longer than between the rows"
    assert made(uses=uses, shortest=3.0).summary == said
    assert (
        made(uses=uses, shortest=3.0 * (1 - 1e-4)).summary == f"{said}; 0.01 % longer than between the rows"
    )
    assert made(uses=(), shortest=3.0).summary == "for servo at 125 Hz: joined as it will be"
    bits = made(uses=uses, shortest=3.0, digits="full", chosen=True)
    assert bits.summary == said.replace("Hz:", "Hz, every bit of its numbers written:")
    assert replace(bits, chosen=False).summary == said
    assert found.duration == 3.0


@pytest.mark.parametrize("begins", [0.0, -2.0, 100.0])
@pytest.mark.parametrize(
    ("time", "excess", "move", "found"),
    [
        (0.5, 1.5, None, 0),
        (1.0, 1.5, None, 4),  # the move that begins
        (2.5, 2.9, None, 7),
        (3.5, 1.1, None, 7),
        (-0.5, 1.1, None, 0),
        (0.5, 3.0, None, None),  # a step, as of a start in motion
        (0.5, float("nan"), None, None),
        (2.5, 1.5, 0, 0),
        (None, 1.5, None, None),
    ],
)
def test_what_breaks_a_rule_by_little_is_in_the_move_of_its_time(
    begins: float, time: float | None, excess: float, move: int | None, found: int | None
) -> None:
    from dataclasses import dataclass

    @dataclass
    class Wrong:
        time: float | None
        excess: float
        move: int | None

    spans = [Some(start=0.0, index=0), Some(start=1.0, index=4), Some(start=2.0, index=7)]
    plan = Some(trajectory=Some(spans=spans), loaded=Some(job=Some(output=Some(start_time=begins))))
    wrong = Wrong(None if time is None else time + begins, excess, move)
    assert _in_its_move(wrong, plan).move == found  # type: ignore[arg-type]
