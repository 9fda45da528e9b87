"""Cycloidal moves: their duration by the peaks of the law, what binds it, and the formulas that are printed."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_limited_moves import arm, state

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.language.numbers import ReadingContext
from trajcli.planners.point_to_point.cycloidal import Cycloidal

INF = np.inf


def move(end, **fields) -> Cycloidal:
    names = tuple(f"j{k + 1}" for k in range(len(end)))
    context = ReadingContext(joint_names=names, joint_types=("revolute",) * len(names))
    model = {"planner": "cycloidal", "to": {"joints": [float(value) for value in end]}, **fields}
    return Cycloidal.model_validate(model, context=context)


def bounds(down, up):
    """Return limits of two joints, of which one does not bind."""
    return [[-down, up], [-1e6, 1e6]]


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("limits", "duration"),
    [
        (((2.0, 3.0), (INF, INF), (INF, INF)), {1: 2 * 1.5 / 3.0, -1: 2 * 1.5 / 2.0}),
        (((9.0, 9.0), (1.0, 4.0), (INF, INF)), dict.fromkeys((1, -1), (2 * np.pi * 1.5 / 1.0) ** 0.5)),
        (((9.0, 9.0), (4.0, 1.0), (INF, INF)), dict.fromkeys((1, -1), (2 * np.pi * 1.5 / 1.0) ** 0.5)),
        (((9.0, 9.0), (9.0, 9.0), (2.0, 5.0)), dict.fromkeys((1, -1), (4 * np.pi**2 * 1.5 / 2.0) ** (1 / 3))),
        (((INF, INF), (INF, INF), (5.0, 2.0)), dict.fromkeys((1, -1), (4 * np.pi**2 * 1.5 / 2.0) ** (1 / 3))),
    ],
)
def test_without_a_duration_one_limit_is_just_met(limits, duration, sign, joint):
    """Velocity by direction of the way, acceleration and jerk by the smaller of both sides, whichever joint goes far."""
    rows = [0, 1] if joint == 0 else [1, 0]
    robot = arm(*(np.array(bounds(*limit))[rows] for limit in limits))
    begin, end = np.array([0.7, -0.2]), np.array([1.5, 0.01])[rows] * sign
    planned = move(begin + end).plan(state(begin), robot)
    assert planned.curve.duration == pytest.approx(duration[sign], rel=1e-12)
    t = np.linspace(0.0, planned.curve.duration, 4001)
    shares = []
    for order in (1, 2, 3):
        values, limit = planned.curve.evaluate(t, order), robot.limits.of_order(order)
        shares.append(np.maximum(values / limit[:, 1], values / limit[:, 0]).max())
    assert max(shares) == pytest.approx(1.0, rel=1e-5)
    for at, where in ((0.0, begin), (planned.curve.end, begin + end)):
        np.testing.assert_allclose(planned.curve.evaluate(at), where, atol=1e-12)
    assert planned.law.evaluate(planned.law.end) == pytest.approx(1.0)


def test_formulas_are_the_law_and_its_derivatives():
    planned = move([1.0, 0.0], duration=2.5).plan(state([0.0, 0.0]), arm([INF] * 2, [INF] * 2, [INF] * 2))
    assert planned.curve.duration == pytest.approx(2.5)
    for order, formula in enumerate(planned.formulas):
        text = formula.format(T="T").replace("2 pi t", "2*pi*t").replace("2 pi", "2*pi").replace("^", "**")
        text = text.replace(") sin", ")*sin")
        for t in (0.0, 0.4, 1.3, 2.5):
            names = {"t": t, "T": 2.5, "pi": np.pi, "sin": np.sin, "cos": np.cos}
            wanted = eval(text, {"__builtins__": {}}, names)
            assert float(planned.law.evaluate(t, order)[0]) == pytest.approx(wanted, abs=1e-10)


def test_joints_that_lack_every_limit_are_named_if_they_move():
    free = arm([INF, 1.0, INF, INF], [INF] * 4, [INF] * 4)
    with pytest.raises(MissingLimitError) as caught:
        move([-1.0, 1.0, 0.0, 1.0]).plan(state([0.0] * 4), free)
    (problem,) = caught.value.problems
    assert [name in problem.message for name in ("j1", "j2", "j3", "j4")] == [True, False, False, True]


def test_a_start_in_motion_is_refused():
    with pytest.raises(PlanningError, match="rest"):
        move([1.0, 0.0]).plan(state([0.0, 0.0], [0.0, 0.1]), arm([1.0] * 2, [1.0] * 2, [1.0] * 2))


@pytest.mark.parametrize(("fields", "duration"), [({}, 0.0), ({"duration": 1.5}, 1.5)])
def test_to_where_it_stands_it_lasts_as_long_as_is_said(fields, duration):
    planned = move([0.3, 0.0], **fields).plan(state([0.3, 0.0]), arm([1.0] * 2, [1.0] * 2, [1.0] * 2))
    assert planned.curve.duration == duration
