"""Plans of measurements: their determinant against every choice there is, and against random choices."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from arms import arm, configurations, measured
from product_of_rows import difference_jacobian

from trajcli.errors import InputError
from trajcli.kinematics.calibration.measuring_plan import attainable_rank, measuring_plan, random_candidates
from trajcli.kinematics.calibration.parameters import all_parameters, parse_parameters
from trajcli.kinematics.robot import unlimited


def index_of(rows, rank):
    """Return O1 by its definition."""
    values = np.linalg.svd(rows.reshape(-1, rows.shape[-1]), compute_uv=False)[:rank]
    return np.prod(values) ** (1 / rank) / np.sqrt(len(rows))


@pytest.mark.parametrize("part", ["pose", "position"])
@pytest.mark.parametrize("seed", range(6))
def test_no_exchange_makes_it_better_and_few_choices_are(seed, part):
    robot = arm("scara")
    parameters = parse_parameters(robot, "j1.a,j2.a,j2.theta,j3.d,j1.alpha")
    q = configurations(robot, 10, np.random.default_rng(seed))
    rows = difference_jacobian(robot, q, parameters)[:, : 3 if part == "position" else 6]
    every = [index_of(rows[list(choice)], 5) for choice in combinations(range(10), 4)]
    plan = measuring_plan(robot, q, parameters, 4, 1.0, part)
    chosen = plan.chosen.tolist()
    assert plan.index == pytest.approx(index_of(rows[chosen], 5), rel=1e-6)
    assert len(set(chosen)) == 4
    for old in chosen:
        for new in set(range(10)) - set(chosen):
            assert index_of(rows[[*(set(chosen) - {old}), new]], 5) <= plan.index * (1 + 1e-6)
    assert plan.index > max(0.99 * max(every), np.median(every))


def test_it_is_better_than_chance_and_than_the_first_ones():
    robot, rng = arm("ur"), np.random.default_rng(2)
    parameters, q = all_parameters(robot), configurations(robot, 200, rng)
    rows = difference_jacobian(robot, q, parameters)
    plan = measuring_plan(robot, q, parameters, 15, 1.0)
    assert plan.seen.rank == 30
    chance = [index_of(rows[rng.choice(200, 15, replace=False)], 30) for _ in range(300)]
    assert plan.index > 1.03 * max(chance)
    values = np.linalg.svd(rows[plan.chosen].reshape(-1, 36), compute_uv=False)[:30]
    assert plan.smallest == pytest.approx(values[-1], rel=1e-5)
    assert plan.condition == pytest.approx(values[0] / values[-1], rel=1e-5)


def test_the_index_is_that_of_what_the_chosen_configurations_tell():
    """Two positions have six numbers, and leave the turn of the base about the line between them open."""
    robot = arm("ur")
    parameters, q = parse_parameters(robot, "base"), configurations(robot, 20, np.random.default_rng(3))
    plan = measuring_plan(robot, q, parameters, 2, 1.0, "position")
    rows = difference_jacobian(robot, q[plan.chosen], parameters)[:, :3]
    values = np.linalg.svd(rows.reshape(6, 6), compute_uv=False)
    assert plan.seen.rank == 5
    assert plan.index == pytest.approx(index_of(rows, 5), rel=1e-6)
    assert plan.condition == pytest.approx(values[0] / values[4], rel=1e-6)


def test_candidates_lie_within_the_limits_and_are_always_the_same():
    robot = arm("puma")
    low, high = np.full(6, -1.0), np.array([0.5, 1, 2, 20, np.inf, 3])
    limited = replace(robot, limits=replace(unlimited(6), position=np.column_stack([low, high])))
    q = random_candidates(limited, 400)
    assert np.array_equal(q, random_candidates(limited, 400))
    top = np.minimum(high, [9, 9, 9, 9.5 + np.pi, np.pi, 9])
    bottom = [-1, -1, -1, 9.5 - np.pi, -np.pi, -1]
    assert (q <= top).all()
    assert (q >= bottom).all()
    assert (np.ptp(q, axis=0) > 0.95 * (top - bottom)).all()
    with pytest.raises(InputError, match="j3"):
        random_candidates(arm("scara"))


@pytest.mark.parametrize("part", ["pose", "position"])
def test_attainable_rank_is_that_of_many_configurations(part):
    robot, rng = arm("puma"), np.random.default_rng(0)
    parameters = all_parameters(robot)
    few = measured(robot, np.tile(configurations(robot, 1, rng), (3, 1)), {}, part=part)
    assert attainable_rank(robot, few, parameters, 1.0) == {"pose": 30, "position": 27}[part]


def test_too_few_configurations_are_refused():
    robot = arm("puma")
    q = configurations(robot, 50, np.random.default_rng(0))
    with pytest.raises(InputError, match="at least 5"):
        measuring_plan(robot, q, all_parameters(robot), 4, 1.0)
    with pytest.raises(InputError, match="50 candidates"):
        measuring_plan(robot, q, all_parameters(robot), 51, 1.0)
    with pytest.raises(InputError, match="tells anything"):
        measuring_plan(robot, q, parse_parameters(robot, "tool.rx"), 4, 1.0, "position")
