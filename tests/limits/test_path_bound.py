"""Distance and angle from the path for all t: bumps between the nodes of pieces, whose size is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from trajcli.checks.tool import SampledTool, check_tool
from trajcli.curves.piecewise import PiecewisePolynomial, concatenate, constant
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation, FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve, PosePath
from trajcli.geometry.paths.position import Line, Pivot
from trajcli.geometry.rotation import exp
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.limits import tool_bound
from trajcli.trajectory import Span, Trajectory, resting

ROBOT, Q = load_robot("ur5e"), np.array([0.3, -1.2, 1.4, -0.9, -1.3, 0.4])
POSE = forward(ROBOT, Q)
TOLERANCE, REST, WHOLE = 1e-6, 0.1, (True, True, True)
BUMP = np.poly(np.arange(9) / 8)  # zero at nine nodes of [0, 1], largest between the outer ones
BUMP /= np.abs(np.polyval(BUMP, np.linspace(0, 1, 100_001))).max()


def standing(joint: int = 0, size: float = 0.0, pieces: int = 3) -> PiecewisePolynomial:
    """Return joints at rest for a second a piece, one of which has a bump of a size in the second piece."""
    coefficients = np.zeros((10, pieces, 6))
    coefficients[-1] = Q
    if size:
        coefficients[:, 1, joint] += size * BUMP
    return PiecewisePolynomial(np.arange(pieces + 1.0), coefficients)


def law(size: float = 0.0, pieces: int = 3) -> PiecewisePolynomial:
    """Return a law that rests at a place, with a bump of a size in its second piece."""
    coefficients = np.zeros((10, pieces, 1))
    coefficients[-1] = REST
    coefficients[:, 1, 0] += size * BUMP
    return PiecewisePolynomial(np.arange(pieces + 1.0), coefficients)


def line() -> PoseCurve:
    """Return a path that is where the joints stand after a tenth of a metre."""
    along = np.array([0.6, 0.0, 0.8])
    curve = Line(POSE[:3, 3] - REST * along, POSE[:3, 3] + along)
    return PoseCurve(curve, FixedOrientation(POSE[:3, :3], curve.length))


def turning() -> PoseCurve:
    """Return a rotation about y in world that is where the joints stand after a tenth of a radian."""
    first, last = (exp(angle * np.array([0.0, 1.0, 0.0])) @ POSE[:3, :3] for angle in (-REST, 0.9))
    curve = AxisAngleOrientation.between(first, last)
    return PoseCurve(Pivot(POSE[:3, 3], POSE[:3, 3], curve.length), curve)


def tool(
    joints: PiecewisePolynomial,
    law: PiecewisePolynomial,
    poses: PosePath | None = None,
    orientation: str = "all",
    position: tuple[bool, bool, bool] = WHOLE,
    start: float = 0.0,
    tolerances: tuple[float, float] = (TOLERANCE, TOLERANCE),
) -> SampledTool:
    path = ToolPath(poses or line(), position, orientation)  # type: ignore[arg-type]
    motion = motion_along(path, law, law.breaks, Tolerance(*tolerances))
    span = Span(4, "line", start, start + law.duration, 2)
    ends = resting(Q), resting(Q)
    curve = concatenate([constant(Q, start), joints]) if start else joints
    trajectory = Trajectory(curve, ROBOT.joint_names, ROBOT.joint_types, (span,), *ends)
    return SampledTool(trajectory, span, ROBOT, motion)


def most(each: SampledTool) -> list[float | None]:
    return [None if bound is None else bound.upper_bound for bound in each.bounds]


@pytest.mark.parametrize("times", [1.5, 0.9])
def test_a_bump_of_a_joint_between_rows_is_found(times: float) -> None:
    """The first joint turns about z in world: the tool moves by its distance from the axis, and turns."""
    lever = float(np.hypot(*POSE[:2, 3]))
    each = tool(standing(0, times * TOLERANCE / lever), law())
    assert max(sizes.max() for sizes in each.deviation) < 1e-3 * TOLERANCE  # rows see nothing
    distance, angle = most(each)
    assert distance == pytest.approx(times * TOLERANCE, rel=4e-3)
    assert angle == pytest.approx(times * TOLERANCE / lever, rel=4e-3)
    found = check_tool(tool(standing(0, times * TOLERANCE / lever), law(), orientation="none"))
    assert [finding.kind for finding in found] == ["tool_path"] * (times > 1)
    if not found:
        return
    (beside,) = found
    assert (beside.move, beside.method, beside.limit) == (4, "bounded", TOLERANCE)
    assert beside.value == pytest.approx(1.5 * TOLERANCE, rel=4e-3)
    assert beside.time is not None
    assert min(abs(beside.time - 1.05), abs(beside.time - 1.95)) < 0.05


def in_time(curve: PiecewisePolynomial, scale: float) -> PiecewisePolynomial:
    """Return the same motion, so many times as long."""
    powers = np.arange(len(curve.coefficients))[::-1, None, None]
    return PiecewisePolynomial(curve.breaks * scale, curve.coefficients / scale**powers)


@pytest.mark.parametrize("scale", [0.01, 30.0])
def test_bounds_are_the_same_however_long_the_motion_takes(scale: float) -> None:
    """Remainders are of the ninth derivative times the ninth power of the time, of the joints and of the path."""
    size = 1.5 * TOLERANCE / float(np.hypot(*POSE[:2, 3]))
    for joints, along in ((standing(0, size), law()), (standing(), law(1.5 * TOLERANCE))):
        each = tool(in_time(joints, scale), in_time(along, scale))
        assert most(each)[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)
        assert most(each)[0] >= 1.5 * TOLERANCE * (1 - 1e-6)


@pytest.mark.parametrize("turned", [0.5, 2.5, -3.0])
def test_a_large_angle_is_one(turned: float) -> None:
    """The last joint turns the tool about its axis: further than a chord is long."""
    joints = PiecewisePolynomial(np.array([0.0, 3.0]), (Q + turned * np.eye(6)[5])[None, None])
    assert most(tool(joints, law()))[1] == pytest.approx(abs(turned), rel=1e-3)


def test_what_comes_not_near_enough_to_its_values_is_not_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint that turns by three quarters of a turn in one piece, which is not halved."""
    rows = np.zeros((4, 1, 6))
    rows[-1, 0], rows[0, 0, 0], rows[1, 0, 0] = Q, -10.0, 15.0
    moving = tool(
        PiecewisePolynomial(np.array([0.0, 1.0]), rows),
        PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[REST]]])),
    )
    assert most(moving)[1] is not None
    monkeypatch.setattr(tool_bound, "_HALVINGS", 0)
    assert tool(moving.trajectory.curve, moving.motion.law).bounds == (None, None)


def test_what_is_proven_is_within_two_thousandths_of_the_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same turn in one piece, which is halved twice: a tolerance that is large enough for its remainder is met."""
    rows = np.zeros((4, 1, 6))
    rows[-1, 0], rows[0, 0, 0], rows[1, 0, 0] = Q, -1.0, 1.5
    joints = PiecewisePolynomial(np.array([0.0, 1.0]), rows)
    resting = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[REST]]]))
    monkeypatch.setattr(tool_bound, "_HALVINGS", 2)
    proven = []
    for tolerance in 10.0 ** np.arange(-12, 4):
        bounds = tool(joints, resting, tolerances=(tolerance, tolerance)).bounds
        proven.append([bound is not None for bound in bounds])
        for bound in filter(None, bounds):
            assert bound.value <= bound.upper_bound <= bound.value + 2.1e-3 * tolerance
    assert not np.any(proven[0])
    assert np.all(proven[-1])


@pytest.mark.parametrize("pieces", [2, 4])
def test_a_law_that_lasts_shorter_or_longer_proves_nothing(pieces: int) -> None:
    assert tool(standing(), law()).bounds != (None, None)
    each = tool(standing(), law())
    assert each.motion is not None
    beside = replace(each, motion=replace(each.motion, law=law(pieces=pieces)))
    assert beside.bounds == (None, None)


@pytest.mark.parametrize(("end", "law_end"), [(2.999, 3.0), (2.5, 2.5), (3.0, 2.999)])
def test_a_move_that_ends_off_the_breaks_of_its_joints_or_of_its_law_is_not_proven(
    end: float, law_end: float
) -> None:
    """By a millisecond of three seconds, or in the middle of the last piece of the joints."""
    each = tool(standing(), law())
    assert each.motion is not None
    shorter = PiecewisePolynomial(np.array([0.0, 1.0, 2.0, law_end]), law().coefficients)
    moved = replace(each, span=replace(each.span, end=end), motion=replace(each.motion, law=shorter))
    assert moved.bounds == (None, None)


@pytest.mark.parametrize("piece", [0, 1, 2])
@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-10])
def test_a_bump_in_a_short_piece_is_found(piece: int, short: float) -> None:
    """Of two seconds the law goes beside its place for a millisecond, or for far less, but more than rounding."""
    lengths = np.ones(3)
    lengths[piece] = short
    rows = law().coefficients.copy()
    rows[:, piece, 0] += 1.5 * TOLERANCE * BUMP / short ** np.arange(9, -1, -1.0)
    along = PiecewisePolynomial(np.append(0.0, np.cumsum(lengths)), rows)
    joints = PiecewisePolynomial(along.breaks[[0, -1]], Q[None, None])
    assert most(tool(joints, along))[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


@pytest.mark.parametrize("times", [1.5, 0.9])
def test_a_bump_of_the_last_joint_turns_the_tool(times: float) -> None:
    each = tool(standing(5, times * TOLERANCE), law())
    assert each.deviation[1].max() < 1e-3 * TOLERANCE
    distance, angle = most(each)
    assert distance is not None
    assert distance < 2e-3 * TOLERANCE
    assert angle == pytest.approx(times * TOLERANCE, rel=4e-3)
    assert [finding.kind for finding in check_tool(each)] == ["tool_orientation"] * (times > 1)


@pytest.mark.parametrize("pieces", [1, 3])
@pytest.mark.parametrize("which", [0, 1])
def test_a_bump_of_the_law_between_rows_is_found(which: int, pieces: int) -> None:
    """The joints rest: it is the path that goes, or turns; of joints in one piece the law's breaks count, too."""
    joints = standing() if pieces == 3 else PiecewisePolynomial(np.array([0.0, 3.0]), Q[None, None])
    each = tool(joints, law(1.5 * TOLERANCE), (line, turning)[which]())
    sizes = most(each)
    assert sizes[which] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)
    assert [finding.kind for finding in check_tool(each)] == [("tool_path", "tool_orientation")[which]]
    assert not check_tool(tool(joints, law(0.9 * TOLERANCE), (line, turning)[which]()))


def test_times_count_from_the_start_of_the_whole() -> None:
    bump = standing(0, 1.5 * TOLERANCE / float(np.hypot(*POSE[:2, 3])))
    early, late = (check_tool(tool(bump, law(), start=start))[0].time for start in (0.0, 7.0))
    assert late == pytest.approx((early or 0.0) + 7.0, abs=1e-9)


def test_what_is_free_does_not_count() -> None:
    """A line of which x and y are fixed, and the direction of the tool, about which the last joint turns."""
    lifted = standing(1, 2e-6)
    whole, flat = (tool(lifted, law(), position=(True, True, z)) for z in (True, False))
    joints = Q + np.array([0.0, 2e-6, 0, 0, 0, 0])
    moved = forward(ROBOT, joints)[:3, 3] - POSE[:3, 3]
    assert most(whole)[0] == pytest.approx(np.linalg.norm(moved), rel=4e-3)
    assert most(flat)[0] == pytest.approx(np.linalg.norm(moved[:2]), rel=1e-2, abs=2e-9)
    rolled = standing(5, 1.5 * TOLERANCE)
    assert (most(tool(rolled, law(), orientation="direction"))[1] or 1.0) < 2e-3 * TOLERANCE
    assert most(tool(rolled, law(), orientation="none"))[1] == 0.0
    bent = tool(standing(4, 1.5 * TOLERANCE), law(), orientation="direction")
    assert most(bent)[1] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)
    across = ToolPath(line(), WHOLE, "direction", "x")  # square to the axis of the last joint, which turns it
    motion = replace(bent.motion, path=across)
    assert most(replace(bent, motion=motion))[1] != pytest.approx(1.5 * TOLERANCE, rel=4e-3)
    turned = replace(tool(rolled, law(), orientation="direction"), motion=motion)
    assert most(turned)[1] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


@pytest.mark.parametrize("tolerances", [(TOLERANCE, 1.0), (1.0, TOLERANCE)])
def test_each_bound_is_as_near_as_its_own_tolerance_asks(tolerances: tuple[float, float]) -> None:
    """A turn about z in world, of the tool by its lever and by an angle: one of the two is asked for closely."""
    which = tolerances.index(TOLERANCE)
    angle = 1.5 * TOLERANCE / (1.0 if which else float(np.hypot(*POSE[:2, 3])))
    found = most(tool(standing(0, angle), law(), tolerances=tolerances))[which]
    assert found == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


@pytest.mark.parametrize("ends", [True, False])
def test_breaks_of_a_law_count_whether_the_reference_steps_there_or_not(ends: bool) -> None:
    """A smooth law in pieces has no breaks of its own: each of its polynomials is bounded where it holds."""
    joints = PiecewisePolynomial(np.array([0.0, 3.0]), Q[None, None])
    each = tool(joints, law(1.5 * TOLERANCE))
    if ends:
        each = replace(each, motion=replace(each.motion, breaks=each.motion.breaks[[0, -1]]))
    assert most(each)[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


@pytest.mark.parametrize("share", [0.06, 0.44, 0.94])
def test_a_corner_within_a_piece_of_the_law_is_as_far_as_it_is(share: float) -> None:
    """The joints rest beside a corner, before and behind which the path is nearer to them; it lies between the rows."""
    along, aside, far = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.1, 0.0]), 1.5 * TOLERANCE
    corner = POSE[:3, 3] + far * along
    lines = join([Line(corner - REST * along, corner), Line(corner, corner - 0.2 * along + aside)])
    poses = PoseCurve(lines, FixedOrientation(POSE[:3, :3], lines.length))
    rows = np.array([1.6 * far, REST - share * 1.6 * far])[:, None, None]
    joints = PiecewisePolynomial(np.array([0.0, 1.0]), Q[None, None])
    each = tool(joints, PiecewisePolynomial(np.array([0.0, 1.0]), rows), poses)
    assert most(each)[0] == pytest.approx(far, rel=4e-3)


def test_a_piece_that_rounding_begins_before_a_border_is_of_the_segment_behind() -> None:
    """A line and an arc about a tenth of a metre: of the arc the ninth derivative is that of a circle."""
    radius, corner = 0.1, POSE[:3, 3] + np.array([0.1, 0.0, 0.0])
    ends = (corner + radius * np.array([math.sin(angle), 1 - math.cos(angle), 0.0]) for angle in (0.5, 1.0))
    arc = Arc.through(corner, *ends)
    curve = join([Line(POSE[:3, 3], corner), arc])
    path = ToolPath(PoseCurve(curve, FixedOrientation(POSE[:3, :3], curve.length)), WHOLE, "all")
    coefficients = np.zeros((2, 1, 7))
    coefficients[1, 0] = [*Q, 0.1 * (1 - 1e-15)]
    coefficients[0, 0, -1] = 0.1
    found = tool_bound._of_path(path, np.array([1.0]), coefficients)[0, 9, 0]
    assert found * math.factorial(9) == pytest.approx(radius * (0.1 / radius) ** 9, rel=1e-9)


def test_what_has_no_bound_is_left_to_rows_and_said() -> None:
    right = tool(standing(), law())
    assert list(right.sampled) == ["branch"]
    for turned in ("yaw", "pitch"):
        assert most(tool(standing(), law(), orientation=turned))[1] is None
    along = np.array([0.6, 0.0, 0.8])
    corner = POSE[:3, 3] + 0.1 * along
    segments = [Line(POSE[:3, 3] - REST * along, corner), Line(corner, corner + np.array([0, 0.5, 0]))]
    rounded = join(segments, 0.05)
    coefficients = law().coefficients.copy()
    coefficients[-2, 2] = 0.15  # into the corner
    moving = PiecewisePolynomial(np.arange(4.0), coefficients)
    poses = PoseCurve(rounded, FixedOrientation(POSE[:3, :3], rounded.length))
    each = tool(standing(), moving, poses)
    assert each.bounds[0] is None
    assert list(each.sampled) == ["distance from the path", "branch"]
    (beside,) = check_tool(each)
    assert (beside.kind, beside.method) == ("tool_path", "sampled")
    cut = replace(right, motion=replace(right.motion, overlaps=True))
    assert cut.bounds == (None, None)
    assert list(cut.sampled) == ["distance from the path", "angle from its orientation", "branch"]
    longer = replace(right, span=replace(right.span, end=2.9))  # the law does not say when it is where
    assert longer.bounds == (None, None)


class Unproven(PoseCurve):
    """A path of which nothing is known about how it turns, or about where it goes."""

    unknown = 1

    def majorants(self, s: np.ndarray, rising: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        both = list(super().majorants(s, rising))
        both[self.unknown] = np.full(rising.shape, np.inf)
        return both[0], both[1]


class UnprovenPosition(Unproven):
    unknown = 0


@pytest.mark.parametrize("orientation", ["all", "direction", "none"])
def test_what_has_no_majorant_is_not_proven_whatever_the_other_has(orientation: str) -> None:
    """The law goes past five tolerances between the nodes: what the joints alone leave there proves nothing."""
    path = turning()
    unproven = Unproven(path.position, path.orientation)
    each = tool(standing(), law(5 * TOLERANCE), unproven, orientation)
    free = orientation == "none"  # of which nothing need be known
    assert most(each) == [pytest.approx(0.0, abs=1e-12), 0.0 if free else None]
    assert ("angle from its orientation" in each.sampled) != free
    assert "distance from the path" not in each.sampled
    along = UnprovenPosition(line().position, line().orientation)
    each = tool(standing(), law(5 * TOLERANCE), along, orientation)
    assert each.bounds[0] is None
    assert most(each)[1] == pytest.approx(0.0, abs=1e-12)
    assert "distance from the path" in each.sampled
    assert "angle from its orientation" not in each.sampled


def test_joints_that_turn_together_turn_the_tool_by_their_sum() -> None:
    """Three parallel axes: the ninth derivative is that of the sum of their rates, and not of the fastest."""
    coefficients = np.zeros((2, 1, 7))
    coefficients[0, 0, 1:4], coefficients[1, 0, :6] = 2.0, Q
    path = ToolPath(line(), WHOLE, "all")
    _, ((_, highest),) = tool_bound._values_at_nodes(ROBOT, path, coefficients, np.array([1e-6]))
    assert math.sqrt(1.5) * (1 - 1e-12) <= highest * math.factorial(9) / 6.0**9 <= 100.0


def test_a_slide_is_as_long_as_it_stands() -> None:
    """A joint that turns, and a slide behind it, five metres out: its end goes about a circle of five metres."""
    joints = Joint("turn", alpha=math.pi / 2), Joint("slide", "prismatic")
    polar = Robot("turning slide", joints, unlimited(2), "standard", np.eye(4), np.eye(4))
    coefficients = np.zeros((2, 1, 3))
    coefficients[0, 0, 0], coefficients[1, 0] = 2.0, [0.3, 5.0, REST]
    path = ToolPath(line(), WHOLE, "none")
    _, ((highest, _),) = tool_bound._values_at_nodes(polar, path, coefficients, np.array([1e-6]))
    assert 1 - 1e-12 <= highest * math.factorial(9) / (5.0 * 2.0**9) <= 10.0
    each = np.repeat(coefficients, 3, axis=1)
    each[1, :, 1] = [0.5, 5.0, 1.0]
    _, highest = tool_bound._values_at_nodes(polar, path, each, np.full(3, 1e-6))
    assert highest[1, 0] * math.factorial(9) / (5.0 * 2.0**9) >= 1 - 1e-12  # in whichever piece
    coefficients[0, 0, :2] = [0.0, 2.0]  # and what slides turns nothing
    _, ((_, highest),) = tool_bound._values_at_nodes(
        polar, replace(path, orientation="all"), coefficients, np.array([1e-6])
    )
    assert highest == 0.0


@pytest.mark.parametrize("orientation", ["all", "direction"])
def test_what_hides_between_nodes_is_bounded_by_no_less_than_it_is(orientation: str) -> None:
    """A joint that turns steadily: of a matrix, and of an axis square to that joint, the ninth derivative is rate^9."""
    rate, joint = 2.0, 5 if orientation == "all" else 4  # the axis of the tool is that of the last joint
    coefficients = np.zeros((2, 1, 7))
    coefficients[0, 0, joint], coefficients[1, 0, :6] = rate, Q
    path = ToolPath(line(), WHOLE, orientation)  # type: ignore[arg-type]
    _, ((_, highest),) = tool_bound._values_at_nodes(ROBOT, path, coefficients, np.array([1e-6]))
    columns = (
        math.sqrt(1.5) if orientation == "all" else 1.0
    )  # of three columns, each as long as the largest may be
    assert columns * (1 - 1e-12) <= highest * math.factorial(9) / rate**9 <= 100.0
    t = np.arange(9) * 0.2
    values, _ = tool_bound._values_at_nodes(ROBOT, path, coefficients, np.array([t[-1]]))
    apart = np.linalg.norm(np.diff(values[0, :, 1], axis=0), axis=-1)
    np.testing.assert_allclose(apart, 2 * np.sin(rate * 0.2 / 2), rtol=1e-9)  # a chord, as of the angle


def test_the_curve_of_the_joints_may_begin_at_any_time() -> None:
    """Spans count from its start."""
    each = tool(standing(0, 1.5 * TOLERANCE / float(np.hypot(*POSE[:2, 3]))), law(), start=2.0)
    curve = each.trajectory.curve
    later = PiecewisePolynomial(curve.breaks + 5.0, curve.coefficients)
    moved = replace(each, trajectory=replace(each.trajectory, curve=later))
    assert most(moved)[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)
    assert most(moved) == pytest.approx(most(each), rel=1e-9)


@pytest.mark.parametrize("past", [1e-6, -1e-6])
def test_a_law_past_an_end_of_its_path_is_at_that_end(past: float) -> None:
    """By a hundred thousandth of a path: the reference on rows stays at the end, and so does that of the bound."""
    along, rest = np.array([0.6, 0.0, 0.8]), REST if past > 0 else 0.0
    curve = Line(POSE[:3, 3] - rest * along, POSE[:3, 3] + (REST - rest) * along)
    poses = PoseCurve(curve, FixedOrientation(POSE[:3, :3], curve.length))
    one = np.array([0.0, 1.0])
    each = tool(
        PiecewisePolynomial(one, Q[None, None]),
        PiecewisePolynomial(one, np.full((1, 1, 1), rest + past)),
        poses,
    )
    assert max(sizes.max() for sizes in each.deviation) < 1e-12
    assert most(each) == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_ends_that_rounding_moves_apart_prove_as_much(sign: int) -> None:
    """Of three seconds the joints end 2.5e-12 behind the move, the law as much before it, or the other way."""
    each = tool(standing(0, 1.5 * TOLERANCE / float(np.hypot(*POSE[:2, 3]))), law())
    ends = (np.array([0.0, 1.0, 2.0, 3.0 + side * 2.5e-12]) for side in (sign, -sign))
    joints, along = (
        PiecewisePolynomial(breaks, curve.coefficients)
        for breaks, curve in zip(ends, (each.trajectory.curve, each.motion.law), strict=True)
    )
    motion = replace(each.motion, law=along, breaks=along.breaks)
    beside = replace(each, trajectory=replace(each.trajectory, curve=joints), motion=motion)
    assert most(beside)[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


def test_a_move_of_no_length_is_left_to_its_rows() -> None:
    each = tool(standing(), law())
    motion = replace(each.motion, law=constant([REST], 0.0), breaks=np.zeros(1))
    for time in (0.0, 1.0):
        still = replace(each, span=replace(each.span, start=time, end=time), motion=motion)
        assert still.bounds == (None, None)
        assert max(sizes.max() for sizes in still.deviation) < 1e-12


@pytest.mark.parametrize("units", [-2, 2])
@pytest.mark.parametrize("of_law", [False, True])
def test_breaks_beside_each_other_by_rounding_are_of_the_pieces_behind_them(of_law: bool, units: int) -> None:
    """Joints and law change a few units in the last place apart: the bump behind is in one of them alone."""
    joints = standing() if of_law else standing(0, 1.5 * TOLERANCE / float(np.hypot(*POSE[:2, 3])))
    along = law(1.5 * TOLERANCE if of_law else 0.0)
    breaks = joints.breaks + units * np.spacing(1.0) * np.array([0.0, 1.0, 1.0, 0.0])
    each = tool(PiecewisePolynomial(breaks, joints.coefficients), along)
    assert most(each)[0] == pytest.approx(1.5 * TOLERANCE, rel=4e-3)


def ninth(angle: float, length: float) -> float:
    """Return |c_9| of the Taylor series of exp(i angle (t / length)^4) about t = length, by that of the exponent."""
    rising = 1j * angle * np.array([0.0, 4, 6, 4, 1]) / length ** np.arange(5)
    terms = (np.polynomial.polynomial.polypow(rising, k) / math.factorial(k) for k in range(3, 10))
    return abs(sum(term[9] for term in terms))


@pytest.mark.parametrize("length", [0.01, 100.0])
def test_ninth_derivatives_are_bounded_where_a_piece_is_fastest(length: float) -> None:
    """By three radians with the fourth power of the time: of a circle about an axis it is largest at the end."""
    true = ninth(3.0, length)
    coefficients = np.zeros((5, 1, 7))
    coefficients[-1, 0, :6], lengths = Q, np.array([length])
    for joint, orientation in ((0, "all"), (5, "all"), (4, "direction")):
        rows = coefficients.copy()
        rows[0, 0, joint] = 3.0 / length**4
        path = ToolPath(line(), WHOLE, orientation)  # type: ignore[arg-type]
        _, ((far, turned),) = tool_bound._values_at_nodes(ROBOT, path, rows, lengths)
        assert true <= turned <= 10.0 * true
        if joint == 0:
            lever = float(np.hypot(*POSE[:2, 3]))
            assert lever * true <= far <= 50.0 * lever * true
    circle = (np.array([math.cos(angle), math.sin(angle), 0.0]) for angle in (0.0, 1.5, 3.0))
    arc = Arc.through(*(0.1 * each for each in circle))
    path = ToolPath(PoseCurve(arc, FixedOrientation(POSE[:3, :3], arc.length)), WHOLE, "all")
    coefficients[0, 0, -1] = 0.3 / length**4
    assert 0.1 * true <= tool_bound._of_path(path, lengths, coefficients)[0, 9, 0] <= 1.0 * true


def test_a_tool_that_turns_against_its_path_differs_by_both() -> None:
    """Two turns at one rate, the one against the other: the ninth derivative of their difference is twice rate^9."""
    rate = 2.0
    coefficients = np.zeros((2, 1, 7))
    coefficients[0, 0, 5:], coefficients[1, 0] = [rate, -rate], [*Q, REST]
    path = ToolPath(turning(), WHOLE, "all")
    _, ((_, highest),) = tool_bound._values_at_nodes(ROBOT, path, coefficients, np.array([1e-6]))
    assert 2.0 <= highest * math.factorial(9) / rate**9 <= 2.5


def test_a_move_that_starts_within_a_piece_of_its_joints_is_not_proven() -> None:
    each = tool(standing(), law())
    along = PiecewisePolynomial(np.array([0.0, 0.7, 1.7, 2.7]), law().coefficients)
    late = replace(each, span=replace(each.span, start=0.3), motion=replace(each.motion, law=along))
    assert late.bounds == (None, None)
