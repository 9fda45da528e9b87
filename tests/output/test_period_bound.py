"""What joined rows differ by from a smooth curve, against curves whose every interval is looked at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joined_by_scipy import largest_share

from trajcli.curves.hermite import hermite_coefficients, hermite_errors
from trajcli.grids import UniformGrid
from trajcli.job.read import load_job
from trajcli.output.delivery.joined import joined_rows
from trajcli.output.delivery.period_bound import pieces_within
from trajcli.output.write import grid_of
from trajcli.planning.plan import plan_job
from trajcli.streams.formats import FORMATS

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("stated", [2, 3])
def test_the_constants_are_reached_and_never_passed(stated: int) -> None:
    """A power of twice the order reaches each of them; sines of any phase and frequency stay below."""
    order, length = 2 * stated, 0.7
    power = np.zeros(order + 1)
    power[0] = 1.0
    reached = _largest_errors([np.polyder(power, k) for k in range(order)], length, stated, np.polyval)
    limit = hermite_errors(np.array(float(np.prod(np.arange(1, order + 1)))), length, stated)
    assert reached == pytest.approx(limit[: stated + 1], rel=1e-3)
    rng = np.random.default_rng(2)
    for _ in range(50):
        w, phase = rng.uniform(0.5, 6), rng.uniform(0, 6)
        waves = [(w**k, w, phase + k * np.pi / 2) for k in range(order)]
        found = _largest_errors(waves, length, stated, lambda f, t: f[0] * np.sin(f[1] * t + f[2]))
        assert (found <= hermite_errors(np.array(w**order), length, stated)[: stated + 1] * (1 + 1e-9)).all()


def _largest_errors(derivatives: list, length: float, stated: int, value: object) -> np.ndarray:
    ends = np.array([[value(f, t) for f in derivatives[:stated]] for t in (0.0, length)])  # type: ignore[operator]
    joined = hermite_coefficients(ends[0][:, None, None], ends[1][:, None, None], np.array([[length]]))[
        :, 0, 0
    ]
    t = np.linspace(0, length, 2001)
    return np.array(
        [
            np.abs(np.polyval(np.polyder(joined, k), t) - value(derivatives[k], t)).max()  # type: ignore[operator]
            for k in range(stated + 1)
        ]
    )


def test_what_a_period_proves_of_a_curve_of_degree_seven() -> None:
    """At 1000 Hz all of it, at 20 Hz nothing: quintics there pass an acceleration that the curve just keeps."""
    with np.errstate(all="ignore"):
        plan = plan_job(load_job(str(EXAMPLES / "septic.yaml")))
    moves = []
    for move, peaks in zip(plan.moves, plan.verdict.peaks, strict=True):
        bound = np.maximum(peaks[2].magnitude, 1e-3)
        limits = replace(move.robot.limits, acceleration=np.stack([-bound, bound], axis=1))
        moves.append(replace(move, robot=replace(move.robot, limits=limits)))
    plan = replace(plan, moves=tuple(moves))
    for rate, known in ((1000.0, True), (20.0, False)):
        assert pieces_within(plan, 1 / rate, 3, 2e-7).all() == known
        share = largest_share(plan, UniformGrid(plan.trajectory.duration, rate), 1e-4)
        assert (share <= 1 + 2e-7) == known


def test_a_path_of_the_tool_counts() -> None:
    """What a bound of cubics says of an arc, whose deviation and tool are judged where it says nothing."""
    with np.errstate(all="ignore"):
        plan = plan_job(
            load_job(str(EXAMPLES / "planar_arc.yaml"), ("output.columns=[t, q, qd]", "output.rate=100"))
        )
    counts = [int(pieces_within(plan, 1 / rate, 2, 2e-7).sum()) for rate in (50, 500, 50_000)]
    assert counts[0] <= counts[1] < counts[2]
    judged = joined_rows(plan, grid_of(plan), FORMATS["csv"], "full").judgement(slack=1e-6)
    monkey = pytest.MonkeyPatch()
    monkey.setattr(
        "trajcli.output.delivery.period_bound.pieces_within",
        lambda *_: np.zeros(plan.trajectory.curve.pieces, bool),
    )
    all_seen = joined_rows(plan, grid_of(plan), FORMATS["csv"], "full").judgement(slack=1e-6)
    monkey.undo()
    assert judged is not None
    assert all_seen is not None
    assert {(f.kind, f.move) for f in judged.findings} == {(f.kind, f.move) for f in all_seen.findings}
