"""Solids, limits and frames of a robot: the laws of rigid bodies, and bounds by direction and joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trajcli
from trajcli.errors import InputError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import (
    GRAVITY,
    Limits,
    LinkInertia,
    MountedTool,
    Payload,
    point_mass,
    require_possible_solid,
    share_of_limits,
    unlimited,
)

RNG = np.random.default_rng(3)
POINTS = RNG.uniform(-1, 1, (8, 3)) * [0.3, 0.1, 0.2] + [0.2, -0.4, 0.1]
MASSES = RNG.uniform(0.1, 0.5, 8)


def frame(seed: int) -> np.ndarray:
    """Return a random frame (4, 4)."""
    rng, made = np.random.default_rng(seed), np.eye(4)
    made[:3, :3] = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    made[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    return made


def solid(points: np.ndarray) -> Payload:
    """Return the solid of the masses at points: its centre, and the sum of m (|r|^2 1 - r r^T) about it."""
    com = MASSES @ points / MASSES.sum()
    away = points - com
    inertia = np.einsum("k,kij->ij", MASSES, [r @ r * np.eye(3) - np.outer(r, r) for r in away])
    return Payload(float(MASSES.sum()), com, inertia)


def test_a_solid_seen_from_a_frame_is_that_of_its_points_there() -> None:
    place = frame(1)
    there = (np.linalg.inv(place) @ np.column_stack([POINTS, np.ones(8)]).T).T[:, :3]
    found, wanted = solid(POINTS).seen_from(place), solid(there)
    np.testing.assert_allclose(found.com, wanted.com, atol=1e-14)
    np.testing.assert_allclose(found.inertia, wanted.inertia, atol=1e-14)
    assert found.mass == wanted.mass


def test_a_payload_keeps_its_place_on_the_flange_when_the_tool_changes() -> None:
    arm = replace(trajcli.load_robot("ur5e"), payload=solid(POINTS), tool=frame(4))
    own = point_mass(0.4)
    changed = arm.with_tool(MountedTool(frame(5), own, "torch"))
    assert changed.payload is not None
    for tool, payload in ((arm.tool, arm.payload), (changed.tool, changed.payload)):
        np.testing.assert_allclose(tool @ [*payload.com, 1], arm.tool @ [*solid(POINTS).com, 1], atol=1e-14)
        turned = tool[:3, :3] @ payload.inertia @ tool[:3, :3].T
        np.testing.assert_allclose(
            turned, arm.tool[:3, :3] @ solid(POINTS).inertia @ arm.tool[:3, :3].T, atol=1e-14
        )
    assert (changed.tool_load, changed.tool_name) == (own, "torch")


def test_what_is_on_the_flange_has_a_key_of_all_of_it() -> None:
    bare = trajcli.load_robot("ur5e")
    other = Payload(1.0, np.array([0, 0, 0.1]), np.diag([1e-3, 1e-3, 1e-3]))
    arms = [bare, replace(bare, tool=frame(1))]
    for load in (point_mass(1.0), point_mass(2.0), point_mass(1.0, [0, 0, 0.1]), other):
        arms += [replace(bare, payload=load), replace(bare, tool_load=load)]
    assert len({arm.equipment for arm in arms}) == len(arms)
    tools = [
        MountedTool(pose, load, name)
        for pose in (np.eye(4), frame(2))
        for load in (None, other)
        for name in "ab"
    ]
    assert len(set(tools)) == len(tools)
    assert tools[0] == MountedTool(np.eye(4), None, "a")


def test_an_arm_on_a_foot_stands_at_its_base_and_is_seen_from_any_frame() -> None:
    """What is seen from a frame is the inverse frame times what is in the world; weight stays what it is."""
    foot, base, seen = frame(6), frame(7), frame(8)
    own = trajcli.load_robot("ur5e")
    arm = replace(own, base=frame(9) @ foot, foot=foot)
    np.testing.assert_allclose(arm.stand, frame(9), atol=1e-14)
    np.testing.assert_allclose(own.stand, own.base)
    moved = arm.standing_at(base)
    np.testing.assert_allclose(moved.stand, base, atol=1e-14)
    np.testing.assert_allclose(own.standing_at(base).base, base)
    q = np.array([0.3, -1.0, 0.8, 0.2, 0.5, -0.4])
    np.testing.assert_allclose(
        forward(moved, q), base @ foot @ np.linalg.inv(own.base) @ forward(own, q), atol=1e-13
    )
    there = moved.seen_from(seen)
    np.testing.assert_allclose(forward(there, q), np.linalg.inv(seen) @ forward(moved, q), atol=1e-13)
    np.testing.assert_allclose(there.gravity, np.linalg.inv(seen[:3, :3]) @ GRAVITY, atol=1e-14)
    np.testing.assert_allclose(GRAVITY, (0, 0, -9.81))


BOX = np.array([[0.4, 0.05, 0.02], [0.05, 0.5, -0.1], [0.02, -0.1, 0.6]])
PLATE = np.diag([1.0, 2.0, 3.0])  # a thin plate: the third moment is the sum of the others
TURNED = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()


@pytest.mark.parametrize(
    ("inertia", "share", "message"),
    [
        (PLATE, 0.0, None),
        (TURNED @ PLATE @ TURNED.T, 0.0, None),
        (TURNED @ np.diag([0.0, 1.0, 1.0]) @ TURNED.T, 0.0, None),  # a thin rod
        (np.zeros((3, 3)), 0.0, None),
        (np.diag([1.0, 2.0, 3.0 + 1e-6]), 0.0, None),  # six digits
        (np.diag([1.0, 2.0, 3.0 + 1e-4]), 0.0, "above the sum of the two others"),
        (TURNED @ np.diag([1.0, 2.0, 3.5]) @ TURNED.T, 0.0, "above the sum of the two others"),
        (np.diag([-1e-7, 1.0, 1.0]), 0.0, None),
        (np.diag([-1e-4, 1.0, 1.0]), 0.0, "negative moment"),
        (BOX, 1e-7, None),
        (BOX, 1e-4, "symmetric"),
    ],
)
def test_no_solid_has_a_moment_that_is_negative_or_above_the_sum_of_the_others(
    inertia: np.ndarray, share: float, message: str | None
) -> None:
    for row, column in ((0, 1), (2, 0), (1, 2)) if share else ((0, 0),):
        given = inertia.copy()
        given[row, column] += share
        if message is None:
            require_possible_solid(1.0, np.zeros(3), given)
            continue
        with pytest.raises(InputError, match=message):
            require_possible_solid(1.0, np.zeros(3), given)


def test_a_link_has_mass_and_a_payload_may_have_none() -> None:
    assert point_mass(0.0).mass == 0.0
    for mass in (-0.1, np.nan, np.inf):
        with pytest.raises(InputError, match="mass"):
            point_mass(mass)
    for mass in (0.0, -0.1, np.inf):
        with pytest.raises(InputError, match="above 0 kg"):
            LinkInertia(mass, (0, 0, 0), (1, 1, 1, 0, 0, 0))
    with pytest.raises(InputError, match="finite"):
        point_mass(1.0, (0, np.inf, 0))
    with pytest.raises(InputError, match="finite"):
        Payload(1.0, np.zeros(3), np.full((3, 3), np.nan))
    with pytest.raises(InputError, match=r"inertia of shape \(3, 3\)"):
        Payload(1.0, np.zeros(3), np.zeros(6))


@pytest.mark.parametrize("index", range(3))
def test_the_six_numbers_of_a_link_are_ixx_iyy_izz_ixy_ixz_iyz(index: int) -> None:
    """A rod along the bisector of two axes has ixy = -m: with any other order of the products it is no solid."""
    one, two = ((0, 1), (0, 2), (1, 2))[index]
    r = np.zeros(3)
    r[[one, two]] = 1.0
    tensor = 2 * np.eye(3) - np.outer(r, r)
    six = (*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2])
    LinkInertia(1.0, (0, 0, 0), tuple(map(float, six)))
    with pytest.raises(InputError, match="no solid"):
        LinkInertia(1.0, (0, 0, 0), tuple(map(float, (*six[:3], *np.roll(six[3:], 1)))))


BOUNDS = np.array([[-1.0, 2.0], [-3.0, 4.0]])


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "jerk", "effort"])
def test_bounds_are_a_pair_for_each_joint(name: str) -> None:
    fine = {**vars(unlimited(2)), "velocity_by_position": np.empty((0, 2))}
    Limits(**{**fine, name: BOUNDS})
    wrong = [[[-1.0, 2.0], [4.0, 3.0]], [[-1.0, 2.0], [np.nan, 3.0]], [-1.0, 2.0], [[-1.0, 2.0, 3.0]] * 2]
    if name == "position":
        Limits(**{**fine, name: np.array([[1.0, 1.0], [2.0, 3.0]])})  # a joint that is locked
    else:
        wrong += [[[-1.0, 2.0], [low, high]] for low, high in ((0, 1), (-1, 0), (1, 2), (-2, -1))]
    for bounds in wrong:
        with pytest.raises(ValueError, match=f"{name} limits"):
            Limits(**{**fine, name: np.array(bounds)})


def test_velocity_by_position_needs_a_range_for_the_joints_that_have_it() -> None:
    fine = {**vars(unlimited(2)), "position": np.array([[-1.0, 1.0], [-np.inf, np.inf]])}
    free = [np.inf, 0.0]
    found = Limits(**{**fine, "velocity_by_position": np.array([[2.0, 0.0], free])})
    assert found.has_velocity_by_position
    assert not unlimited(2).has_velocity_by_position
    for rows in (
        [free, [2.0, 0.0]],
        [[0.0, 0.0], free],
        [[2.0, -0.1], free],
        [[2.0, np.inf], free],
        [[2.0, 0.0]],
    ):
        with pytest.raises(ValueError, match="velocity_by_position"):
            Limits(**{**fine, "velocity_by_position": np.array(rows)})
    half = np.array([[-1.0, 1.0], [-np.inf, 1.0]])
    with pytest.raises(ValueError, match="needs position limits"):
        Limits(**{**fine, "position": half, "velocity_by_position": np.array([[2.0, 0.0]] * 2)})


def test_one_bound_in_one_direction_limits_efforts() -> None:
    for row in ([-1.0, np.inf], [-np.inf, 1.0]):
        assert replace(unlimited(2), effort=np.array([[-np.inf, np.inf], row])).has_effort
    assert not unlimited(2).has_effort


LIMITS = Limits(
    np.array([[-2.0, 4.0], [-np.inf, np.inf], [0.0, 5.0]]),
    np.array([[-1.0, 2.0], [-np.inf, np.inf], [-4.0, 8.0]]),
    np.array([[-10.0, 20.0], [-30.0, np.inf], [-np.inf, np.inf]]),
    np.array([[-np.inf, np.inf]] * 3),
)
INSIDE = [0.0, 0.0, 2.5]


@pytest.mark.parametrize(
    ("order", "joint", "low", "high", "share"),
    [
        (1, 0, -0.5, 0.4, 0.5),
        (1, 0, -0.5, 1.4, 0.7),
        (1, 0, -1.5, 0.0, 1.5),
        (1, 2, -1.0, 12.0, 1.5),
        (1, 1, -1e9, 1e9, None),
        (2, 1, -45.0, 1e9, 1.5),
        (2, 0, 0.0, 15.0, 0.75),
        (3, 0, -1e9, 1e9, None),
        (0, 0, -2.5, 0.0, 1.25),  # 0.5 beyond -2
        (0, 0, 0.0, 5.0, 1.25),  # 1 beyond 4
        (0, 2, 2.0, 6.0, 1.2),  # 1 beyond 5
        (0, 2, -1e-4, 1.0, 1.1),  # 1e-4 beyond 0, which counts as 1e-3
        (0, 1, -1e9, 1e9, None),
    ],
)
def test_a_share_is_that_of_the_joint_the_side_and_the_quantity_that_use_most(
    order: int, joint: int, low: float, high: float, share: float | None
) -> None:
    extremes = [(np.array(INSIDE), np.array(INSIDE))] + [(np.zeros(3), np.zeros(3)) for _ in range(3)]
    at_rest = share_of_limits(extremes, LIMITS)
    assert at_rest == 0.5  # the third joint is 2.5 from the ends of a range that ends at 5
    lowest, highest = (array.copy() for array in extremes[order])
    lowest[joint], highest[joint] = low, high
    extremes[order] = (lowest, highest)
    wanted = at_rest if share is None else share
    np.testing.assert_allclose(share_of_limits(extremes, LIMITS), wanted, rtol=1e-12)
    both = [
        (np.stack([a, b]), np.stack([c, d]))
        for (a, c), (b, d) in zip(
            extremes, [(np.array(INSIDE), np.array(INSIDE))] + [(np.zeros(3), np.zeros(3))] * 3, strict=True
        )
    ]
    np.testing.assert_allclose(share_of_limits(both, LIMITS), [wanted, at_rest], rtol=1e-12)


def test_joints_whose_links_have_no_mass_are_named() -> None:
    link = LinkInertia(1.0, (0, 0, 0), (1, 1, 1, 0, 0, 0))
    own = trajcli.load_robot("ur5e")
    arm = replace(
        own, joints=tuple(replace(j, link=link if k % 2 else None) for k, j in enumerate(own.joints))
    )
    assert arm.without_inertia == own.joint_names[::2]
