"""A tool beside its reference by what is known: on the rows of its joints, and by a bound between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.checks.tool import SampledTool, check_tool
from trajcli.curves.node_bound import BoundedPeak
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolReference
from trajcli.kinematics.forward import forward
from trajcli.limits.tool_bound import SpeedRun
from trajcli.trajectory import Span, Trajectory, resting

SLIDES = load_robot("cartesian")
TURNS = load_robot("planar3r")
PIECES, BEGINS, PROMISED = 3, 1.5, 1e-3
U = np.poly1d([1.0, 0.0])
SHAPES = {
    "at the start": (1 - U, 0, 0.0),
    "at the end": (U, PIECES - 1, 1.0),
    "an eighth behind a break": (U * (1 - U) ** 7, 1, 0.125),
    "in the middle of a piece": (U * (1 - U), 2, 0.5),
    "early and late in a piece": (U * (1 - U) * (1 - 2 * U), 1, 0.25),
}
"""By u from 0 to 1 over a piece: how the tool is beside its reference, in which piece, and at which of its rows most."""


def beside(robot: object, direction: object, shape: np.poly1d, piece: int) -> SampledTool:
    """Return a tool of which one piece of three leaves a reference that stands; its move is number 4."""
    n = len(robot.joints)
    still = np.full(n, 0.3)
    coefficients = np.zeros((9, PIECES, n))
    coefficients[-1] = still
    coefficients[9 - len(shape.coeffs) :, piece] += shape.coeffs[:, None] * np.asarray(direction)
    curve = PiecewisePolynomial(BEGINS + np.arange(PIECES + 1.0), coefficients)

    def reference(times: np.ndarray, _: str = "right") -> ToolReference:
        poses = forward(robot, np.tile(still, (len(times), 1)))
        zero = np.zeros((len(times), 6))
        return ToolReference(poses, zero, zero, (True, True, True), "all", "z", zero[:, :0])

    law = PiecewisePolynomial(np.array([0.0, float(PIECES)]), np.array([1.0, 0.0])[:, None, None])
    motion = ToolMotion(None, law, reference, np.array([0.0, float(PIECES)]), Tolerance(PROMISED, PROMISED))
    whole = PiecewisePolynomial(
        np.append(0.0, curve.breaks), np.concatenate([0.0 * coefficients[:, :1], coefficients], axis=1)
    )
    ends = [resting(whole.evaluate(time)) for time in (whole.start, whole.end)]
    span = Span(4, "line", BEGINS, BEGINS + PIECES, 2)
    trajectory = Trajectory(whole, robot.joint_names, robot.joint_types, (span,), *ends)
    return SampledTool(trajectory, span, robot, motion)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_row_on_which_a_tool_is_furthest_from_its_path_is_named(sign: float, name: str) -> None:
    """Slides move it by what they are off: in all three directions together by the root of the squares."""
    shape, piece, at = SHAPES[name]
    shape = shape * (1.0 / abs(shape(at)))
    direction = sign * np.array([3.0, -4.0, 12.0]) / 13.0
    for size, count in ((1.01 * PROMISED, 1), (0.99 * PROMISED, 0)):
        found = check_tool(beside(SLIDES, size * direction, shape, piece))
        assert [(each.kind, each.move, each.method) for each in found] == [
            ("tool_path", 4, "sampled")
        ] * count
        for each in found:
            assert each.value == pytest.approx(size, rel=1e-9)
            assert each.time == pytest.approx(BEGINS + piece + at, abs=1e-12)


@pytest.mark.parametrize("name", SHAPES)
def test_the_row_on_which_a_tool_is_turned_furthest_is_named(name: str) -> None:
    shape, piece, at = SHAPES[name]
    tool = beside(TURNS, [0.0, 0.0, 2 * PROMISED / abs(shape(at))], shape, piece)
    (found,) = check_tool(replace(tool, motion=replace(tool.motion, tolerance=Tolerance(9.0, PROMISED))))
    assert (found.kind, found.move) == ("tool_orientation", 4)
    assert found.value == pytest.approx(2 * PROMISED, rel=1e-6)
    assert found.time == pytest.approx(BEGINS + piece + at, abs=1e-12)


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize(
    ("size", "most", "found"),
    [
        (0.5, 1.001, None),  # what is proven lies above what is true by a few thousandths of the promise
        (0.5, 1.01, "bounded"),
        (0.5, np.inf, "bounded"),
        (1.5, 2.0, "bounded"),
        (2.0, 2.001, "bounded"),
        (0.5, 0.9, None),
    ],
)
def test_what_is_proven_of_a_distance_counts_where_it_is_above_the_rows(
    size: float, most: float, found: str | None, which: int
) -> None:
    """`most` times what was promised may be reached between rows, of which the largest is half of that."""
    shape = 4 * U * (1 - U)
    robot, direction = (SLIDES, [1.0, 0.0, 0.0]) if which == 0 else (TURNS, [0.0, 0.0, 1.0])
    tool = beside(robot, size * PROMISED * np.array(direction), shape, 0)
    peak = BoundedPeak(most * PROMISED / 2, 0.25, most * PROMISED, np.zeros(3))
    vars(tool)["bounds"] = (peak, None) if which == 0 else (None, peak)
    wide = replace(tool.motion, tolerance=Tolerance(*([PROMISED, 9.0], [9.0, PROMISED])[which]))
    again = replace(tool, motion=wide)
    vars(again)["bounds"] = vars(tool)["bounds"]
    told = check_tool(again)
    assert [each.method for each in told] == [found] * (found is not None)
    for each in told:
        assert each.kind == ("tool_path", "tool_orientation")[which]
        assert each.value == pytest.approx((most if found == "bounded" else size) * PROMISED)
        assert each.time == pytest.approx(BEGINS + (0.25 if found == "bounded" else 0.5))


def test_a_tool_that_is_too_fast_in_a_segment_is_found_with_all_else() -> None:
    tool = beside(SLIDES, [2 * PROMISED, 0.0, 0.0], 4 * U * (1 - U), 0)
    peak = BoundedPeak(2.0, 0.5, 2.25, np.zeros(3))
    vars(tool)["speed_runs"] = (
        SpeedRun((0, 0), (0.0, 1.0), (0.0, 1.0), (3.0, 1.0), (peak, peak)),
        SpeedRun((1, 2), (1.0, 2.0), (1.0, 2.0), (1.0, 1.0), (peak, peak)),
    )
    path, *fast = check_tool(tool)
    assert (path.kind, path.move) == ("tool_path", 4)
    assert [(each.kind, each.move, each.text().split(":")[0]) for each in fast] == [
        ("tool_angular_speed", 4, "segment 0"),
        ("tool_speed", 4, "segments 1 to 2"),
        ("tool_angular_speed", 4, "segments 1 to 2"),
    ]
    assert {(each.value, each.limit, each.time) for each in fast} == {(2.25, 1.0, BEGINS + 0.5)}


def test_a_change_of_the_branch_is_that_of_its_move() -> None:
    tool = beside(SLIDES, np.zeros(3), U, 0)
    vars(tool)["determinants"] = np.where(np.arange(tool.times.size) < 9, 1.0, -1.0)
    (found,) = check_tool(tool)
    assert (found.kind, found.move, found.method) == ("branch", 4, "sampled")
    assert (found.value, found.limit) == (0.0, 0.0)
    assert found.time == pytest.approx(BEGINS + 1.0)
