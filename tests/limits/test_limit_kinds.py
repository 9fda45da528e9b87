"""Each kind of limit by itself: where it is stated, who judges it, and what follows from its order and its name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import ApproachConstraint
from trajcli.kinematics.robot import Joint, Limits, Robot, ToolLimits, unlimited
from trajcli.limits.kinds import (
    JOINT_KINDS,
    KINDS,
    LIMITS_OF_JOINTS,
    SPEED_KINDS,
    STRETCHABLE,
    TOOL_KINDS,
    LimitedMove,
    LimitFamily,
    families,
    family,
    has_further_limits,
    narrowings,
    path_constraints,
)
from trajcli.trajectory import Span, State, Trajectory

OF_JOINTS = ("position", "velocity", "acceleration", "jerk", "effort")
OF_TOOL = ("speed", "angular_speed", "acceleration", "angular_acceleration", "jerk", "angular_jerk")
KEPT_BY_ALL = ("position", "velocity", "acceleration", "jerk")
"""By every planner itself: of these limits no move is planned again."""


def names(limits: Limits, *, further: bool = False) -> list[str]:
    return [name for name, _ in families(limits, further=further)]


def test_without_limits_nobody_judges() -> None:
    assert names(unlimited(3)) == []
    assert not has_further_limits(unlimited(3))


@pytest.mark.parametrize("kind", OF_JOINTS)
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("joint", [0, 2])
def test_a_limit_of_one_joint_in_one_direction_is_one(kind: str, side: int, joint: int) -> None:
    bounds = np.tile([-np.inf, np.inf], (3, 1))
    bounds[joint, side] = 2.0 * side - 1.0
    limits = replace(unlimited(3), **{kind: bounds})
    own = ["effort"] if kind == "effort" else ["joints"]
    assert names(limits) == own
    further = [] if kind in KEPT_BY_ALL else own
    assert names(limits, further=True) == further
    assert has_further_limits(limits) is bool(further)


def near_ends(*decelerations: float) -> Limits:
    """Return limits of velocity by position: decelerations, and an offset of 0.1 of every joint."""
    rows = np.array([[each, 0.1] for each in decelerations])
    return replace(
        unlimited(len(rows)), position=np.tile([-1.0, 2.0], (len(rows), 1)), velocity_by_position=rows
    )


def test_an_offset_without_a_deceleration_is_no_limit() -> None:
    assert names(near_ends(np.inf, np.inf)) == ["joints"]
    assert names(near_ends(np.inf, 3.0)) == ["joints", "velocity_by_position"]
    assert names(near_ends(3.0, np.inf), further=True) == ["velocity_by_position"]


@pytest.mark.parametrize("key", OF_TOOL)
def test_each_limit_of_the_tool_is_one(key: str) -> None:
    limits = replace(unlimited(2), tcp=ToolLimits(**{key: 0.5}))
    assert names(limits) == names(limits, further=True) == ["tool"]
    assert has_further_limits(limits)


def test_all_families_judge_once_each_and_are_those_of_their_modules() -> None:
    rows = near_ends(3.0, 3.0)
    every = replace(
        rows,
        velocity=np.tile([-1.0, 1.0], (2, 1)),
        effort=np.tile([-5.0, 5.0], (2, 1)),
        tcp=ToolLimits(0.5, 1.0),
    )
    found = dict(families(every))
    assert names(every) == list(found) == ["joints", "velocity_by_position", "effort", "tool"]
    assert all(isinstance(each, LimitFamily) and each is family(name) for name, each in found.items())
    assert len({type(each) for each in found.values()}) == 4


def test_units_are_those_of_derivatives_and_scales_those_of_a_slower_time() -> None:
    """A rate of the order k is per second to the power k; a job scales each order by a number of its own."""
    seconds = {0: "", 1: "/s", 2: "/s^2", 3: "/s^3"}
    by_order = {0: None, 1: "velocity", 2: "acceleration", 3: "jerk", None: None}
    orders = {"position": 0, "velocity": 1, "speed": 1, "acceleration": 2, "jerk": 3, "effort": None}
    for kind in KINDS:
        plain = kind.key.removeprefix("angular_")
        assert kind.order == orders[plain.removesuffix("_by_position")]
        assert kind.factor == by_order[kind.order]
        if kind.of_tool:
            assert kind.unit == ("rad" if "angular" in kind.name else "m") + seconds[kind.order or 0]
            assert kind.dimension == ("angle" if "angular" in kind.name else "length")
    assert {kind.key for kind in TOOL_KINDS} == set(OF_TOOL)
    assert {kind.name for kind in JOINT_KINDS} == {*OF_JOINTS, "velocity_by_position"} == LIMITS_OF_JOINTS
    assert [kind.key for kind in SPEED_KINDS] == ["speed", "angular_speed"]


def test_a_longer_time_helps_against_every_limit_but_that_of_the_position() -> None:
    assert {kind.name for kind in KINDS} - STRETCHABLE == {"position"}


def test_events_and_words_of_a_kind() -> None:
    said = {kind.name: (kind.words, kind.event) for kind in KINDS if kind.planned != "always"}
    assert said["velocity_by_position"] == ("velocity by position", "within_velocity_by_position")
    assert said["effort"] == ("effort", "within_effort_limits")
    assert said["tool_angular_jerk"] == ("angular jerk", "within_tool_limits")


@pytest.mark.parametrize("begins", [0.0, -3.0, 1e6])
def test_a_move_has_the_pieces_between_its_ends(begins: float) -> None:
    """Of seven pieces three, none, and four; a curve may begin at any time, spans count from there."""
    breaks = begins + np.array([0.0, 0.1, 0.3, 0.6, 1.0, 1.5, 2.0, 2.1])
    curve = PiecewisePolynomial(breaks, np.arange(7.0)[None, :, None])
    state = State(*(np.zeros(1) for _ in range(3)))
    ends = [(0.0, 0.6), (0.6, 0.6), (0.6, 2.1)]
    spans = tuple(Span(k, "quintic", *each, 2) for k, each in enumerate(ends))
    trajectory = Trajectory(curve, ("j1",), ("revolute",), spans, state, state)
    for span, wanted in zip(spans, ([0, 1, 2], [], [3, 4, 5, 6]), strict=True):
        found, coefficients = LimitedMove(trajectory, span, unlimited(1)).pieces
        assert coefficients[0, :, 0].tolist() == wanted
        np.testing.assert_allclose(found[[0, -1]] - begins, [span.start, span.end], atol=1e-9)
        assert found.size == len(wanted) + 1


@pytest.mark.parametrize("joint", [0, 1])
def test_velocities_are_narrowed_near_the_ends_of_a_range(joint: int) -> None:
    """Of the joint that has such a limit: to sqrt(2 d x) - o at the distance x from the end ahead; others are not."""
    limits = near_ends(*(3.0 if k == joint else np.inf for k in range(2)))
    assert narrowings(limits, 1 - joint, 1) == []
    assert [narrowings(limits, joint, order) for order in (0, 2, 3)] == [[], [], []]
    (allowed,) = narrowings(limits, joint, 1)
    places = np.array([-0.9, 0.5, 1.75])
    low, high = allowed(np.stack([places, places], axis=1))
    np.testing.assert_allclose(high, np.sqrt(6.0 * (2.0 - places)) - 0.1)
    np.testing.assert_allclose(low, 0.1 - np.sqrt(6.0 * (places + 1.0)))
    assert narrowings(unlimited(2), joint, 1) == []


def test_time_optimal_laws_have_rows_of_what_their_planner_does_not_keep_itself() -> None:
    joints = (Joint("turn", "revolute", a=0.5), Joint("slide", "prismatic"))
    path = PiecewisePolynomial([0.0, 1.0], np.array([[0.3, 0.4], [0.0, 0.0]])[:, None, :])
    limits = replace(near_ends(3.0, np.inf), velocity=np.tile([-1.0, 1.0], (2, 1)), tcp=ToolLimits(0.5, 1.0))
    robot = Robot("arm", joints, limits, "standard", np.eye(4), np.eye(4))
    (rows,) = path_constraints(path, robot)
    assert isinstance(rows, ApproachConstraint)
    assert path_constraints(path, replace(robot, limits=unlimited(2))) == ()


def test_a_family_that_says_nothing_of_ends_blames_no_state() -> None:
    """What a family does not say itself: no state is at fault, nothing is narrowed, no law has rows of it."""

    class Silent(LimitFamily):
        def survey(self, move: LimitedMove) -> None:
            return None

    state, robot = (
        State(*(np.full(1, 9.0) for _ in range(3))),
        Robot("r", (Joint("j"),), unlimited(1), "standard", np.eye(4), np.eye(4)),
    )
    silent = Silent()
    assert silent.over_at_ends(robot, [state], ("effort", 0, 1.0)) is False
    assert silent.narrowing(robot.limits, 0, 1) is None
    assert silent.why_not_in_state(robot, state) is None
    assert silent.path_constraints(PiecewisePolynomial([0.0, 1.0], np.zeros((1, 1, 1))), robot) == ()
