"""Every job that is verified keeps its limits, by an evaluation that knows neither planners nor checks."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from job_campaign import PLANNERS, judged
from tally import Tally
from tiers import few

EXACT = 1 + 1e-9
BOUNDED = 1 + 1e-6  # of the tool and of efforts, whose largest values are proven within a millionth
BLOCK = 250


def campaign(numbers: Sequence[int]) -> dict[str, float]:
    """Judge jobs; return how many of each planner were verified, and the largest share of each limit."""
    figures: dict[str, float] = {"jobs": len(numbers)}
    for number in numbers:
        planner, verified, used = judged(number)
        figures[planner] = figures.get(planner, 0) + int(verified)
        for kind, share in used.items():
            most = BOUNDED if kind.startswith("tool_") or kind == "effort" else EXACT
            assert share <= most, (number, planner, kind, share)
            figures[f"of {kind}"] = max(figures.get(f"of {kind}", 0.0), share)
    return figures


@pytest.mark.parametrize("number", few(range(len(PLANNERS)), 2))
def test_a_verified_job_keeps_its_limits(number: int) -> None:
    campaign(few(range(number, 2 * len(PLANNERS), len(PLANNERS)), 1))


@pytest.mark.full
def test_the_whole_jerk_of_the_tool_is_kept_where_that_along_the_path_is_at_its_limit() -> None:
    """A time-optimal path on a Panda: verified, it was 2.3e-4 above its limit where the path is bent."""
    figures = campaign([2293])
    assert figures["path"] == 1
    assert figures["of tool_jerk"] > 0.999


@pytest.mark.soak
@pytest.mark.parametrize("block", range(40))
def test_ten_thousand_jobs(block: int, tally: Tally) -> None:
    tally(campaign(range(1000 + BLOCK * block, 1000 + BLOCK * (block + 1))))


@pytest.mark.full
def test_limits_bind_in_random_jobs() -> None:
    """Else the campaign would see no motion that passes one."""
    shares = [judged(number)[2] for number in range(0, 4 * len(PLANNERS), 7)]
    assert sum(max(used.values(), default=0.0) > 1 - 1e-6 for used in shares) > 3
