"""Parts of moves that fly by corners: each is judged by its own limits and its own zone, in its own time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import limits, trajectory

from trajcli.checks.verify import verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.geometry.paths.orientation import FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.limits.kinds import check_flown
from trajcli.trajectory import MoveInterval, Promise

FREE = limits(2)


def bare(bounds: Limits) -> Robot:
    return Robot("bare", (Joint("j1"), Joint("j2")), bounds, None, np.eye(4), np.eye(4))


def steady(*speeds: float) -> PiecewisePolynomial:
    """Return the second joint at one speed a second, from 0; the first one rests."""
    rows = np.zeros((2, len(speeds), 2))
    rows[0, :, 1], rows[1, 1:, 1] = speeds, np.cumsum(speeds)[:-1]
    return PiecewisePolynomial(np.arange(len(speeds) + 1.0), rows)


def part(start: float, end: float, bounds: Limits = FREE, around: ZoneAround | None = None) -> MoveInterval:
    return MoveInterval(start=start, end=end, robot=bare(bounds), tool=None, around=around)


def found(*parts: list[MoveInterval]) -> list[Finding]:
    """Return what is wrong with the parts of two moves of three seconds each, at speeds of 1, 2 and 3, and of -1 and so on."""
    whole = trajectory(steady(1.0, 2.0, 3.0), steady(-1.0, -2.0, -3.0))
    return list(check_flown(whole, [Promise(parts=tuple(each)) for each in parts]))


@pytest.mark.parametrize("move", [0, 1])
@pytest.mark.parametrize("slow", [0, 1, 2])
def test_each_part_has_its_own_limits(slow: int, move: int) -> None:
    """All others may be three times as fast as they are; of the other direction there is room."""
    fastest = slow + 1.0
    bound = (-0.9 * fastest, 99.0) if move else (-99.0, 0.9 * fastest)
    parts = [part(k, k + 1, limits(2, velocity=bound if k == slow else 9.0)) for k in range(3)]
    free = [part(k, k + 1) for k in range(3)]
    (one,) = found(*([free, parts] if move else [parts, free]))
    assert (one.kind, one.move, one.joint) == ("velocity", move, "j2")
    assert [one.value, one.limit] == pytest.approx([fastest * (-1) ** move, bound[0] if move else bound[1]])
    assert 3 * move + slow <= one.time <= 3 * move + slow + 1


def test_parts_of_no_length_and_beyond_the_end_are_none() -> None:
    tight = limits(2, velocity=0.1)
    assert found([part(1.0, 1.0, tight)], []) == []
    (one,) = found([part(2.5, 3.5, limits(2, velocity=2.9))], [])  # not the other move, which follows
    assert one.value == pytest.approx(3.0)


@pytest.mark.parametrize(("size", "left"), [(1.0 + 1e-9, False), (1.0 - 1e-5, True)])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_part_that_leaves_its_zone_is_found(joint: int, size: float, left: bool) -> None:
    """In the second second the second joint goes from 1 to 3, about a corner at 2."""
    sizes = (size, 9.0) if joint == 0 else (9.0, size)
    corner = np.array([0.0, 2.0])
    if joint == 0:
        corner[0] = 1.0
    around = ZoneAround(bare(FREE), corner, Zone(joints=sizes))
    findings = found([part(0, 1), part(1, 2, around=around), part(2, 3)], [])
    assert [(each.kind, each.move, each.limit) for each in findings] == [("zone", 0, 1.0)] * left
    for each in findings:
        assert each.value == pytest.approx(1 / size)
        assert each.severity == "error"


@pytest.mark.parametrize("move", [0, 1])
def test_the_verdict_holds_what_is_wrong_with_parts(move: int) -> None:
    """Of either move, whether the other one flies by a corner or not."""
    whole = trajectory(steady(1.0, 2.0, 3.0), steady(1.0, 2.0, 3.0))
    promise = Promise(parts=(part(0, 1), part(1, 2, limits(2, velocity=1.9)), part(2, 3)))
    promises = [promise, Promise()] if move == 0 else [Promise(), promise]
    verdict = verify(whole, [FREE] * 2, promises)
    assert not verdict.passed
    assert [each.move for each in verdict.findings if each.kind == "velocity"] == [move]


def test_what_counts_for_a_move_in_parts_is_what_its_parts_allow() -> None:
    """Limits of the whole move, which each part says otherwise, are no matter: of joints, and near their ends."""
    whole, free = trajectory(steady(1.0, 2.0, 3.0)), limits(2, position=50.0)
    bounds = replace(
        limits(2, position=7.0, velocity=1.5), velocity_by_position=np.array([[np.inf, 0.0], [0.01, 0.0]])
    )

    def wrong(promise: Promise) -> set[str]:
        kinds = {each.kind for each in verify(whole, [bounds], [promise]).findings}
        return {kind for kind in kinds if "jump" not in kind}

    assert wrong(Promise()) == {"velocity", "velocity_by_position"}
    assert wrong(Promise(parts=(part(0, 1, free), part(1, 2, free), part(2, 3, free)))) == set()


@pytest.mark.parametrize("beside", [0, 1])
def test_the_tool_is_judged_in_each_part_that_follows_a_path(beside: int) -> None:
    """The arm stands where both paths begin, but for one of them, which begins a millimetre above."""
    arm = load_robot("planar2r")
    pose = forward(arm, np.zeros(2))
    paths = []
    for k in range(2):
        off = np.array([0.0, 0.0, 1e-3 * (k == beside)])
        line = Line(pose[:3, 3] + off, pose[:3, 3] + off + np.array([0.0, 1.0, 0.0]))
        paths.append(ToolPath(PoseCurve(line, FixedOrientation(pose[:3, :3], 1.0)), (True,) * 3, "all"))
    law = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 1)))
    tools = [motion_along(path, law, law.breaks, Tolerance(1e-6, 1e-6)) for path in paths]
    parts = [MoveInterval(k, k + 1.0, arm, tools[k]) for k in range(2)]
    whole = trajectory(PiecewisePolynomial(np.array([0.0, 2.0]), np.zeros((1, 1, 2))))
    (found,) = verify(whole, [FREE], [Promise(parts=tuple(parts), robot=arm)]).findings
    assert (found.kind, found.value) == ("tool_path", pytest.approx(1e-3, rel=1e-5))
    assert beside <= found.time <= beside + 1


@pytest.mark.parametrize("move", [0, 1])
def test_a_part_is_judged_in_its_own_move_alone(move: int) -> None:
    """Of the first move its end, at 3 forward, and of the second one its start, at 1 backward."""
    bounds = (-0.5, 9.0) if move == 0 else (-9.0, 0.5)
    of_move = (
        [part(2.5, 3.5, limits(2, velocity=bounds))]
        if move == 0
        else [part(0.0, 1.0, limits(2, velocity=bounds))]
    )
    assert found(*([of_move, []] if move == 0 else [[], of_move])) == []
