"""Remedies for consumers against the smallest uniform stretch of the motion, found by bisection with curves of scipy."""

from __future__ import annotations

import json
from collections.abc import Sequence
from unittest.mock import patch

import independent_motion
import numpy as np
import pytest
from independent_motion import shares
from planning.job_campaign import PLANNERS, job_of
from random_jobs import ALONG_PATHS
from scipy.interpolate import BPoly, PPoly
from tally import Tally
from test_consumer_campaign import delivered, of_last_bits

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import TrajcliError
from trajcli.grids import UniformGrid
from trajcli.job.read import job_from_text
from trajcli.output.delivery.for_consumer import ForConsumer
from trajcli.planning.plan import Plan, plan_job

STEPS = 6  # of bisection
PLACES = 5  # of an interval between rows, around which the largest values are looked for
WITHIN = 1e-6
MOST_ROWS = 2000  # of motions that are stretched
LITTLE = 1e-5  # of the duration: a cost below is none


def between_rows(number: int, made: ForConsumer) -> Plan | None:
    """Return the motion of a job as nobody joins its rows."""
    output = made.plan.loaded.job.output
    job = job_of(number) | {"when_over_limit": "slow", "output": {"rate": output.rate, "align": output.align}}
    try:
        with np.errstate(all="ignore"):
            return plan_job(job_from_text(json.dumps(job)))
    except TrajcliError:
        return None


def largest_share(made: ForConsumer, first: Plan, duration: float) -> float:
    """Return the largest share of a limit that rows of a motion use, stretched to a duration, as they are joined.

    Args:
        made: With the rate and the columns of the rows.
        first: The motion, of one move that lasts.
        duration: How long it shall last, s.
    """
    output, curve = made.plan.loaded.job.output, first.trajectory.curve
    groups = [group for group in ("q", "qd", "qdd") if group in output.columns]
    times = np.append(np.arange(0.0, duration * output.rate - 1e-6) / output.rate, duration)
    factor = duration / curve.end
    rows = curve.evaluate_orders(np.minimum(times / factor, curve.end), range(len(groups)))
    rows = rows.reshape(len(times), len(groups), -1) / factor ** np.arange(len(groups))[:, None]
    joined = PPoly.from_bernstein_basis(BPoly.from_derivatives(times, rows))
    with patch.object(independent_motion, "GRID", PLACES):
        used = shares(PiecewisePolynomial(joined.x, joined.c), first.moves[-1].robot)
    return max(share for kind, share in used.items() if kind != "position")


def smallest_stretch(made: ForConsumer, first: Plan) -> float:
    """Return the shortest duration of the motion, stretched as a whole, with which its rows keep all limits.

    Above that of the delivered motion nothing is looked at.
    """
    output, bound = made.plan.loaded.job.output, 1 + WITHIN + of_last_bits(made, 1e-4)
    low, high = first.trajectory.duration, made.plan.trajectory.duration
    if largest_share(made, first, low) <= bound:
        return low
    for _ in range(STEPS):
        middle = (low + high) / 2
        if output.align:
            middle = round(middle * output.rate) / output.rate
            if not low < middle < high:
                break
        low, high = (low, middle) if largest_share(made, first, middle) <= bound else (middle, high)
    return high


def compared(numbers: Sequence[int], tally: Tally = lambda _: None) -> int:
    """Compare what remedies of some jobs cost with the smallest stretch; return how many cost anything."""
    jobs, costly, dearer = 0, 0, list[tuple[int, float]]()
    for number in numbers:
        made = None if PLANNERS[number % len(PLANNERS)] in ALONG_PATHS else delivered(number)
        first = between_rows(number, made) if made is not None and made.keeps else None
        if (
            made is None
            or first is None
            or not isinstance(made.grid, UniformGrid)
            or made.grid.count > MOST_ROWS
        ):
            continue
        jobs += 1
        if made.plan.trajectory.duration > first.trajectory.duration * (1 + LITTLE):
            costly += 1
            more = made.plan.trajectory.duration / smallest_stretch(made, first) - 1
            dearer += [(number, more)] if more > LITTLE else []
    tally({"jobs": jobs, "cost anything": costly, "cost more than a stretch": len(dearer)})
    assert not dearer
    return costly


@pytest.mark.full
def test_a_remedy_costs_no_more_than_the_smallest_stretch() -> None:
    assert compared([10]) == 1


@pytest.mark.soak
@pytest.mark.parametrize("block", range(10))
def test_remedies_cost_no_more_than_the_smallest_stretch(block: int, tally: Tally) -> None:
    assert compared(range(20 * block, 20 * block + 20), tally) >= 1
