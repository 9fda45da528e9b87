"""Random jobs of every planner for every consumer that fits: inside all limits as their rows are joined."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from joined_by_scipy import largest_share
from planning.job_campaign import PLANNERS, job_of
from tally import Tally
from tiers import few

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import InputError, PlanningError, VerificationError
from trajcli.grids import KnotGrid, UniformGrid
from trajcli.job.read import job_from_text
from trajcli.output.consumer import job_for
from trajcli.output.delivery.for_consumer import ForConsumer, Writing, plan_for
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.formats import FORMATS

FITTING = {6: ("ur-servoj", "ros-jtc", "ur-passthrough"), 7: ("franka-fr3", "ros-jtc", "franka-fer")}
"""Consumers of arms, by their number of joints."""
WITHIN = 1e-6


def delivered(number: int, consumer: str | None = None) -> ForConsumer | None:
    """Return the job of a number for a consumer; None where there is no plan, or it is refused."""
    job = job_of(number) | {"when_over_limit": "slow"}
    try:
        with np.errstate(all="ignore"):
            loaded = job_from_text(json.dumps(job))
            names = FITTING.get(len(loaded.robot.joints), ("ros-jtc",))
            profile = consumer or names[(number // len(PLANNERS)) % len(names)]
            made = plan_for(*job_for(loaded, profile, {}), Writing(FORMATS["csv"]))
    except (PlanningError, InputError, VerificationError):
        return None
    return made if made.plan.verdict.passed and made.plan.trajectory.duration > 0.05 else None


def of_last_bits(made: ForConsumer, shortest: float) -> float:
    """Return what the last bits of positions are of a limit of jerk: 60 / h^3 times as much, of a quintic.

    A polynomial of high degree is rounded in each of its terms: by how much is seen in numbers of more bits.
    The jerk of scipy's curve is a third difference of Bernstein coefficients, 1, 3, 3 and 1 times half a bit.
    """
    if made.rows.interpolation != "quintic":
        return 0.0
    curve, times = made.plan.trajectory.curve, np.concatenate([local for _, local in made.grid.blocks()])
    steps = np.diff(times)
    values = curve.evaluate(times)
    rounded = np.maximum(np.spacing(np.abs(values).max(axis=0)), _rounding(curve, times, values).max(axis=0))
    jerk = np.min([np.abs(move.robot.limits.jerk).min(axis=1) for move in made.plan.moves], axis=0)
    return float((60.0 * (2.0 + 4.0) * rounded / steps[steps > shortest].min() ** 3 / jerk).max())


def _rounding(curve: PiecewisePolynomial, times: Array, values: Array) -> Array:
    """Return by how much values of a curve are off those in numbers of 64 bits of mantissa, by Horner's rule."""
    piece = np.clip(np.searchsorted(curve.breaks, times, "right") - 1, 0, curve.pieces - 1)
    since = (times.astype(np.longdouble) - curve.breaks[piece])[:, None]
    exact = np.zeros(values.shape, np.longdouble)
    for coefficients in curve.coefficients:
        exact = exact * since + coefficients[piece]
    return np.asarray(np.abs(values - exact), np.float64)


def kept(numbers: Sequence[int], tally: Tally = lambda _: None) -> int:
    """Judge what consumers get of the jobs of some numbers; return how many were compared."""
    compared, over, largest = Counter[str](), list[tuple[int, float]](), -1.0
    for number in numbers:
        made = delivered(number)
        if made is not None and made.keeps:
            shortest = 1e-4 if made.rows.interpolation == "quintic" else 1e-6
            excess = largest_share(made.plan, made.grid, shortest) - 1 - of_last_bits(made, shortest)
            over += [(number, excess)] if not excess <= 10 * WITHIN else []
            compared[PLANNERS[number % len(PLANNERS)]] += 1
            largest = max(largest, excess)
    jobs = compared.total()
    tally({"jobs": len(numbers), "compared": jobs, "over": len(over), "largest excess": largest, **compared})
    assert not over
    return jobs


def over_when_stretched(made: ForConsumer, first: Plan, periods: int, rate: float) -> bool:
    """Return whether the motion between rows, its time scaled by so many periods, passes a limit as it is joined."""
    whole = first.trajectory
    factor = 1 + periods / (rate * whole.duration)
    spans = tuple(replace(span, start=span.start * factor, end=span.end * factor) for span in whole.spans)
    slower = replace(
        first,
        trajectory=replace(whole, curve=scale_time(whole.curve, factor), spans=spans),
        loaded=made.plan.loaded,
    )
    return largest_share(slower, UniformGrid(whole.duration * factor, rate), 1e-4) > 1 + WITHIN


@pytest.mark.parametrize("number", few((10, 60, 101, 135), 1))
def test_no_smaller_stretch_of_the_whole_does_it(number: int) -> None:
    """A motion of blends lasted 16 % longer within tighter limits, where 1.8 % as a whole do."""
    made = delivered(number, "ur-servoj")
    assert made is not None
    assert isinstance(made.grid, UniformGrid)
    rate, job = made.grid.rate, job_of(number) | {"output": {"align": True, "rate": made.grid.rate}}
    with np.errstate(all="ignore"):
        first = plan_job(job_from_text(json.dumps(job | {"when_over_limit": "slow"})))
    longer = round((made.plan.trajectory.duration - first.trajectory.duration) * rate)
    assert all(over_when_stretched(made, first, periods, rate) for periods in few(range(longer), 3))


@pytest.mark.full
def test_the_last_bits_of_a_septic_are_all_that_it_is_over() -> None:
    """4e-4 of a limit of jerk at 1000 Hz, by the terms of degree 7."""
    assert kept([696]) == 1


@pytest.mark.full
def test_a_path_with_a_sharp_corner_is_written_at_its_knots() -> None:
    """The way back from a corner was judged against the way to it, 0.2 mrad off."""
    made = delivered(58, "ros-jtc")
    assert made is not None
    assert made.keeps
    assert isinstance(made.grid, KnotGrid)


def test_consumers_get_rows_inside_all_limits() -> None:
    numbers = few((2, 6, 8, 17, 21, 27, 32, 36), 2)
    assert kept(numbers) >= min(len(numbers), 4)


@pytest.mark.soak
@pytest.mark.parametrize("block", range(20))
def test_consumers_get_rows_inside_all_limits_at_length(block: int, tally: Tally) -> None:
    assert kept(range(50 * block, 50 * block + 50), tally) >= 10
