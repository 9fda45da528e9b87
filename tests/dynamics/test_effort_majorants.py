"""Bounds of efforts term by term: arms in which one term is nearly all there is, against their power series.

In each arm the bound is, but for a stated factor, the largest Taylor coefficient itself: what is left out of it
makes it false, and what is counted twice makes it loose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from heavy_arms import RIGHT, random_arm, random_payload
from series_of_efforts import effort_series
from tiers import few

from trajcli.dynamics.effort_bound import effort_majorants
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.geometry.power_series import growth
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Payload, Robot, point_mass, unlimited

ORDERS = 7
NOTHING = LinkInertia(1e-12, (0.0, 0.0, 0.0), (0.0,) * 6)
EIGHTH_TURNS = tuple(np.arange(8) * np.pi / 4)


def ball(moment: float) -> LinkInertia:
    """Return a solid that resists turning about every axis alike."""
    return LinkInertia(1e-12, (0.0, 0.0, 0.0), (moment, moment, moment, 0.0, 0.0, 0.0))


def point(mass: float, *com: float) -> LinkInertia:
    return LinkInertia(mass, (com[0], com[1], com[2]), (0.0,) * 6)


def revolute(link: LinkInertia = NOTHING, **row: float) -> Joint:
    return Joint("turn", link=link, **row)


def slide(link: LinkInertia = NOTHING, **row: float) -> Joint:
    return Joint("slide", "prismatic", link=link, **row)


@dataclass(frozen=True)
class Term:
    """An arm, rows of modified convention, and a motion in which one term of a bound is nearly all of it.

    Attributes:
        joints: From the base on.
        motion: Of each joint, highest power first.
        at_most: How many times the largest coefficient the bound may be.
        orders: Coefficients in which that holds.
        length: Of the motion, s.
        effort_of: Index of the joint whose effort it is.
        phase: Index of the joint that begins at each eighth of a turn, where a size shows in one of them only.
        gravity: Along z, m/s^2.
        payload: What the last link carries.
    """

    joints: tuple[Joint, ...]
    motion: tuple[list[float], ...]
    at_most: float = 1.001
    orders: range | tuple[int, ...] = range(ORDERS)
    length: float = 1e-9
    effort_of: int = 0
    phase: int | None = None
    gravity: float = 0.0
    payload: Payload | None = None


TERMS = {
    "weight of a point that turns": Term(
        (revolute(point(2.0, 0.7, 0.0, 0.0), alpha=RIGHT),),
        ([1.5, 0.0],),
        phase=0,
        gravity=-9.81,
        at_most=1.1,
    ),
    "weight on two slides": Term(
        (slide(point(1.0, 0, 0, 0)), slide(point(4.0, 0, 0, 0))),
        ([0.0, 0.0], [0.0, 0.0]),
        gravity=-9.81,
        orders=(0,),
    ),
    "weight of a payload": Term(
        (slide(),), ([0.0, 0.0],), gravity=-9.81, payload=point_mass(3.0), orders=(0,)
    ),
    "acceleration of a slide": Term(
        (slide(point(2.0, 0, 0, 0)),), ([1.0, 2.0, 3.0, 4.0, 5.0],), length=0.5, orders=(0, 1, 2)
    ),
    "acceleration of a turn": Term(
        (revolute(ball(2.0)),), ([1.0, 2.0, 3.0, 4.0, 5.0],), length=0.5, orders=(0, 1, 2)
    ),
    "accelerations of two turns": Term(
        (revolute(ball(1.0)), revolute(ball(3.0))),
        ([2.0, 3.0, 0.0, 5.0], [1.0, 4.0, 0.0, 1.0]),
        orders=(0, 1),
    ),
    "largest moment of inertia": Term(
        (revolute(LinkInertia(1e-12, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0))),),
        ([5.0, 0.0, 0.0],),
        orders=(0,),
    ),
    "rotor": Term((replace(revolute(), rotor=0.3),), ([1.0, 2.0, 3.0, 0.0],), length=0.5, orders=(0, 1)),
    "viscous friction": Term(
        (replace(revolute(), friction=Friction(0.0, 0.4)),),
        ([1.0, 2.0, 3.0, 0.0],),
        length=0.5,
        orders=(0, 1, 2),
    ),
    "travel of a slide": Term(
        (revolute(), slide(point(1.5, 0, 0, 0), alpha=RIGHT, d=0.1)),
        ([20.0, 0.0], [5.0, 0.0]),
        length=1.0,
        effort_of=1,
        at_most=1.2,
        orders=(0, 1),
    ),
    "beginning of a slide": Term(
        (revolute(), slide(point(1.5, 0, 0, 0), alpha=RIGHT, d=2.0, sign=-1)),
        ([20.0, 0.0], [0.0, -2.0]),
        effort_of=1,
        orders=(0,),
    ),
    "distance along an axis": Term(
        (revolute(), revolute(point(1.5, 0, 0, 0), alpha=RIGHT, d=-2.0)),
        ([5.0, 0.0, 0.0], [0.0]),
        orders=(0,),
    ),
    "distance between axes": Term(
        (revolute(), slide(point(1.5, 0, 0, 0), alpha=RIGHT, a=-2.0)),
        ([5.0, 0.0, 0.0], [0.0]),
        effort_of=1,
        orders=(0,),
    ),
    "distances across each other": Term(
        (revolute(), revolute(point(1.5, 0, 0, 0), alpha=RIGHT, a=1.0, d=1.0)),
        ([5.0, 0.0, 0.0], [0.0]),
        orders=(0,),
    ),
    "distances in one line, of a tilted axis": Term(
        (revolute(), revolute(point(1.5, 0, 0, 0), beta=RIGHT, a=-1.0, d=-1.0)),
        ([5.0, 0.0, 0.0], [0.0]),
        orders=(0,),
    ),
    "centripetal force, turned": Term(
        (revolute(), revolute(a=3.0), slide(point(2.0, 0, 0, 0), alpha=RIGHT)),
        ([4.0, 0.0], [3.0, 0.0], [0.0]),
        effort_of=2,
        phase=1,
    ),
    "Coriolis force": Term(
        (revolute(), slide(point(2.0, 0, 0, 0), alpha=RIGHT, d=0.1)),
        ([1.0, 0.0], [50.0, 0.0]),
        length=1e-3,
        at_most=1.1,
        orders=(0, 1),
    ),
    "gyroscopic moment of a rod": Term(
        (revolute(), revolute(LinkInertia(1e-12, (0.0,) * 3, (0.0, 1.0, 1.0, 0.0, 0.0, 0.0)), alpha=RIGHT)),
        ([5.0, 0.0, 0.0], [0.0, np.pi / 4]),
        length=10.0,
        effort_of=1,
        at_most=1.01,
        orders=(0, 1, 2),
    ),
    "gyroscopic moment that turns with its solid": Term(
        (revolute(), revolute(LinkInertia(1e-12, (0.0,) * 3, (0.5, 1.0, 0.5, 0.0, 0.5, 0.0)), alpha=RIGHT)),
        ([0.0], [3.0, 0.0]),
        phase=1,
    ),
    "angular acceleration of two turns across each other": Term(
        (revolute(), revolute(alpha=RIGHT), revolute(ball(2.0), alpha=RIGHT)),
        ([4.0, 0.0], [3.0, 0.0], [0.0, 0.0]),
        effort_of=2,
        phase=1,
    ),
    "angular acceleration, turned": Term(
        (revolute(), revolute(alpha=RIGHT), revolute(ball(2.0), alpha=RIGHT)),
        ([5.0, 0.0, 0.0], [3.0, 0.0], [0.0, 0.0]),
        effort_of=2,
        phase=1,
    ),
    "sum of two angular velocities": Term(
        (revolute(), revolute(), slide(point(2.0, 0, 0, 0), alpha=RIGHT, d=1.5)),
        ([4.0, 0.0], [3.0, 0.0], [0.0]),
        effort_of=2,
        at_most=1.25,
        orders=(0,),
    ),
    "angular velocity behind two turns": Term(
        (
            revolute(),
            revolute(alpha=RIGHT),
            revolute(alpha=-RIGHT),
            slide(point(2.0, 0, 0, 0), alpha=RIGHT, d=1.5),
        ),
        ([4.0, 0.0], [0.0], [3.0, 0.0], [0.0]),
        effort_of=3,
        at_most=1.25,
        orders=(0,),
    ),
    "centripetal force of an angular velocity that turns": Term(
        (revolute(), revolute(alpha=RIGHT), slide(point(2.0, 0, 0, 0), alpha=RIGHT, d=1.5)),
        ([300.0, 0.0], [3.0, 0.0], [0.0]),
        effort_of=2,
        at_most=2.2,
        orders=range(1, ORDERS),
        phase=1,
    ),
    "angular accelerations of parallel turns": Term(
        (revolute(), revolute(), slide(point(2.0, 0, 0, 0), alpha=RIGHT, a=1.5)),
        ([4.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0]),
        effort_of=2,
        orders=(0,),
    ),
    "centripetal force of a centre of mass, turned": Term(
        (slide(alpha=RIGHT), revolute(point(2.0, 0.3, 0, 0), alpha=RIGHT)), ([0.0], [3.0, 0.0]), phase=1
    ),
    "tangential force of a centre of mass": Term(
        (slide(alpha=RIGHT), revolute(point(2.0, 0.3, 0, 0), alpha=RIGHT)),
        ([0.0], [3.0, 0.0, 0.0]),
        orders=(0,),
        phase=1,
    ),
    "moment of an acceleration at a centre of mass": Term(
        (slide(alpha=RIGHT), revolute(point(2.0, 0.3, 0, 0), alpha=RIGHT)),
        ([3.0, 0.0, 0.0], [0.0, 0.0]),
        orders=(0,),
        effort_of=1,
        phase=1,
    ),
    "long lever of a light tip": Term(
        (revolute(), revolute(point(0.1, 0.01, 0, 0), a=10.0)), ([0.0], [3.0, 0.0]), phase=1, at_most=1.002
    ),
    "lever of a slide that moves": Term(
        (revolute(alpha=RIGHT, theta=RIGHT), slide(point(2.0, 0, 0, 0), alpha=RIGHT, d=0.1)),
        ([0.0], [5.0, 0.0]),
        length=1.0,
        orders=(0, 1),
        gravity=-9.81,
    ),
    "force on a turn from a slide that moves with it": Term(
        (slide(alpha=RIGHT), revolute(alpha=-RIGHT), slide(point(2.0, 0, 0, 0), alpha=RIGHT)),
        ([0.0], [3.0, 0.0], [500.0, 0.0, 0.0]),
        phase=1,
        at_most=1.2,
        orders=(0, 1, 2),
    ),
}
"""Each term of the bound, and what shows it."""


def of_term(term: Term) -> tuple[InverseDynamics, np.ndarray]:
    """Return the arm and its motion, (degree + 1, n), highest power first."""
    n = len(term.joints)
    joints = tuple(replace(joint, name=f"{joint.name}{i}") for i, joint in enumerate(term.joints))
    robot = Robot("arm", joints, unlimited(n), "modified", np.eye(4), np.eye(4))
    motion = np.zeros((max(map(len, term.motion)), n))
    for i, row in enumerate(term.motion):
        motion[len(motion) - len(row) :, i] = row
    return InverseDynamics(robot, np.array([0.0, 0.0, term.gravity]), term.payload), motion


def largest_coefficients(dynamics: InverseDynamics, motion: np.ndarray, length: float) -> np.ndarray:
    """Return the largest Taylor coefficients of the efforts at times of a motion, (ORDERS, n)."""
    times = np.linspace(0.0, length, 9 if length > 1e-6 else 1)
    return np.max([np.abs(effort_series(dynamics, motion, t, ORDERS)) for t in times], axis=0)


@pytest.mark.parametrize("name", TERMS)
def test_each_term_is_in_the_bound_once(name):
    term = TERMS[name]
    dynamics, motion = of_term(term)
    rising = growth(motion[:, None], np.array([term.length]), ORDERS + 1)
    largest = np.zeros((ORDERS, len(term.joints)))
    for angle in (0.0,) if term.phase is None else EIGHTH_TURNS:
        begin = motion.copy()
        if term.phase is not None:
            begin[-1, term.phase] += angle
        bound = effort_majorants(dynamics, begin[-1:], rising)[:, 0]
        largest = np.maximum(largest, largest_coefficients(dynamics, begin, term.length))
    for k in term.orders:
        true, most = largest[k, term.effort_of], bound[k, term.effort_of]
        assert 1e-3 < true <= most * (1 + 1e-9), k
        assert most <= term.at_most * true, k


@pytest.mark.parametrize("seed", few(range(12)))
def test_arms_of_all_kinds_stay_within_their_bounds(seed):
    """Tilted axes, both conventions and signs, friction, a payload, moving pieces of any degree."""
    rng = np.random.default_rng(2000 + seed)
    n, length = int(rng.integers(1, 5)), 0.2
    arm = random_arm(rng, n, ["standard", "modified"][seed % 2], prismatic=0.4)
    viscous = tuple(replace(j, friction=Friction(0.0, float(rng.uniform(0, 2)))) for j in arm.joints)
    arm = replace(arm, joints=viscous)
    dynamics = InverseDynamics(arm, rng.normal(size=3) * 9, random_payload(rng) if seed % 3 else None)
    motion = rng.normal(size=(int(rng.integers(2, 6)), n)) * rng.uniform(0.1, 4.0)
    bound = effort_majorants(dynamics, motion[-1:], growth(motion[:, None], np.array([length]), ORDERS + 1))
    true = largest_coefficients(dynamics, motion, length)
    assert (true <= bound[:, 0] * (1 + 1e-9)).all()


def test_the_series_are_those_of_the_recursion():
    """The oracle itself: its polynomial is the effort of Newton and Euler near its time."""
    rng = np.random.default_rng(5)
    arm = random_arm(rng, 4, "modified")
    dynamics = InverseDynamics(arm, rng.normal(size=3), random_payload(rng))
    motion = rng.normal(size=(4, 4))
    series = effort_series(dynamics, motion, 0.3, 9)
    for t in (0.3, 0.31):
        state = [np.array([np.polyval(np.polyder(row, k), t) for row in motion.T]) for k in range(3)]
        np.testing.assert_allclose(np.polyval(series[::-1], t - 0.3), dynamics.effort(*state), rtol=1e-10)
