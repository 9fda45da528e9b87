"""Jobs of one move through points: what they plan to, and what the points' tests share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from yaml_files import read_yaml

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.planning.plan import Plan, plan_job

ORACLES = Path(__file__).parents[2] / "oracles"
Fields = dict[str, Any]


def cases(file: str, kind: str) -> Any:
    """Return the parametrisation over the cases of a kind."""
    every = read_yaml(ORACLES / f"{file}.yaml")["cases"]
    found = [case for case in every if case["kind"] == kind]
    assert found
    return pytest.mark.parametrize("case", found, ids=[case["id"] for case in found])


def job_text(start: Fields, move: Fields, **rest: Any) -> str:
    job = {"version": 1, "robot": {"joints": len(start["joints"])}, "start": start, "moves": [move], **rest}
    return json.dumps(job)


def plan(start: Fields, move: Fields, *, passes: bool = True, **rest: Any) -> Plan:
    """Return the plan of a job of one move, read from its text."""
    made = plan_job(job_from_text(job_text(start, move, **rest)))
    assert made.verdict.passed is passes
    return made


def timed(t: Any, q: Any, **last: Any) -> tuple[Fields, list[Fields]]:
    """Return the start and the points after it, from times (m,) that begin with 0 and rows of joints."""
    rows = np.reshape(np.asarray(q, dtype=float), (len(t), -1)).tolist()
    points = [{"joints": row, "time": float(time)} for row, time in zip(rows[1:], t[1:], strict=True)]
    points[-1] |= last
    return {"joints": rows[0]}, points


def curve_of(made: Plan) -> PiecewisePolynomial:
    return made.moves[0].planned.curve


def refusal(start: Fields, move: Fields, **rest: Any) -> TrajcliError:
    """Return the error with which a job is refused."""
    with pytest.raises(TrajcliError) as caught:
        plan_job(job_from_text(job_text(start, move, **rest)))
    assert caught.value.exit_code in (2, 3)
    return caught.value


def in_time(coefficients: list[float], origin: float) -> np.ndarray:
    """Return ascending coefficients in t of a polynomial that has them in t - origin."""
    shifted = Polynomial(coefficients)(Polynomial([-origin, 1.0]))
    return np.pad(shifted.coef, (0, len(coefficients) - shifted.coef.size))


def printed(made: Plan, time: float, joint: str = "j1", kind: str = "absolute") -> np.ndarray:
    """Return the coefficients that `explain --json` prints for the polynomial in force at a time."""
    pieces = explanation(made).model_dump()["moves"][0]["polynomials"][joint]
    (piece,) = [piece for piece in pieces if piece["start"] <= time < piece["end"]]
    return np.array(piece[kind])


def assert_passes(made: Plan, times: Any, points: Any, tolerance: float = 1e-12) -> None:
    """The points (m, n) are met, relative to the size of the motion."""
    points = np.asarray(points, dtype=float)
    np.testing.assert_allclose(
        curve_of(made).evaluate(np.asarray(times, dtype=float)),
        points,
        rtol=0,
        atol=tolerance * max(1.0, np.abs(points).max(initial=0.0)),
    )


def assert_joins(curve: PiecewisePolynomial, order: int, tolerance: float = 1e-9) -> None:
    """Derivatives up to an order join at every break, relative to their peaks."""
    for derivative in range(order + 1):
        first, last = curve.piece_ends(derivative)
        scale = max(1.0, np.abs(first).max(), np.abs(last).max())
        assert np.abs(first[1:] - last[:-1]).max(initial=0.0) <= tolerance * scale, derivative
