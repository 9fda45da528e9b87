"""A weave against its own formula in numpy, and its derivatives against differences."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import PlanningError
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation, FixedOrientation, SegmentProgress
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following.weave import Weave, stops_of

A = 0.003
LINE = Line([0.1, 0.2, 0.3], [0.3, 0.15, 0.35])
ARC = Arc.through([0.4, 0.0, 0.3], [0.45, 0.07, 0.32], [0.4, 0.15, 0.3])
HELIX = Arc([0.4, 0.0, 0.3], [0.3, 0.0, 0.3], [0.0, 0.0, 1.0], 2.5, 0.05)
ROUNDED = join([Line([0, 0, 0], [0.1, 0, 0]), Line([0.1, 0, 0], [0.12, 0.1, 0.02])], 0.03)
INTO_ARC = join([Line([0, 0, 0], [0.1, 0, 0]), Arc([0.1, 0, 0], [0.06, 0.06, 0], [0, 0, 1], 1.2)], 0.02)
SHARP = join([Line([0, 0, 0], [0.12, 0, 0]), Line([0.12, 0, 0], [0.12, 0.08, 0.0])])
SEAMS = {"line": LINE, "arc": ARC, "helix": HELIX, "rounded": ROUNDED, "into an arc": INTO_ARC}
TILTED = Rotation.from_euler("xyz", [2.8, 0.2, 0.4]).as_matrix()


def turning(length):
    last = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix() @ TILTED
    return AxisAngleOrientation.between(TILTED, last, length)


def fading(length):
    """Return a rotation that fades into another one about the middle."""
    rotations = np.stack([TILTED, turning(length).evaluate(np.array([length]))[0][0], TILTED.T])
    progress = SegmentProgress(length * np.array([0.0, 0.5, 1.0]), np.array([0.3 * length]))
    return AxisAngleOrientation(rotations, progress)


def weave_of(name, shape, across=None, cycles=7.5):
    seam = SEAMS[name]
    tool = fading(seam.length) if name == "line" else turning(seam.length)
    return Weave(seam, tool, A, (cycles,), shape, across)


def places(weave):
    """Return s away from breaks, where the curve is smooth."""
    s = np.linspace(0.0, weave.length, 97)[1:-1]
    edges = np.concatenate([[0.0], weave.breaks, weave.orientation.breaks, [weave.length]])
    return s[np.abs(s[:, None] - edges).min(axis=1) > 1e-4 * weave.length]


@pytest.mark.parametrize("across", [None, np.array([0.3, 0.2, 2.0])], ids=["tool", "side"])
@pytest.mark.parametrize("shape", ["sine", "trapezoid"])
@pytest.mark.parametrize("name", SEAMS)
def test_derivatives_are_differences_also_of_a_side_that_turns(name, shape, across):
    weave = weave_of(name, shape, across)
    s, step = places(weave), 1e-6 * weave.length
    behind, here, ahead = (weave.evaluate(s + shift) for shift in (-step, 0.0, step))
    for order in (0, 1):
        slope = (ahead[order] - behind[order]) / (2 * step)
        scale = np.abs(here[order + 1]).max()
        assert here[order + 1] == pytest.approx(slope, abs=2e-6 * scale)


def swing(shape, phase):
    """Return the wave at phases: for a trapezoid its slopes, which go over in 5 % of a cycle, summed up."""
    if shape == "sine":
        return np.sin(2 * np.pi * phase)
    fine = np.linspace(0.0, 1.0, 100_001)
    corners, behind = {
        "triangle": ((0.25, 0.75), (-1.0, 1.0)),
        "trapezoid": ((0.125, 0.375, 0.625, 0.875), (0.0, -1.0, 0.0, 1.0)),
    }[shape]
    rate, before = np.ones(fine.size), 1.0
    for corner, after in zip(corners, behind, strict=True):
        x = np.clip((fine - corner) / 0.05 + 0.5, 0.0, 1.0)
        rate += (after - before) * x**2 * (3 - 2 * x)
        before = after
    wave = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)])
    return np.interp(phase % 1.0, fine, wave / wave.max())


@pytest.mark.parametrize("shape", ["sine", "triangle", "trapezoid"])
@pytest.mark.parametrize("name", ["line", "arc", "helix"])
def test_it_swings_to_the_side_of_the_tool_square_to_the_seam(name, shape):
    weave = weave_of(name, shape)
    s = np.linspace(0.0, weave.length, 301)
    seam, tangent, _ = weave.seam.evaluate(s)
    side = np.cross(tangent, weave.orientation.evaluate(s)[0][:, :, 2])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    expected = seam + A * swing(shape, s * 7.5 / weave.length)[:, None] * side
    assert weave.evaluate(s)[0] == pytest.approx(expected, abs=1e-8 if shape != "sine" else 1e-14)


def test_a_side_that_is_given_is_taken_square_to_the_seam_whatever_its_length():
    across = np.array([0.3, 0.2, 2.0])
    weave = weave_of("arc", "sine", across)
    s = np.linspace(0.0, weave.length, 101)
    seam, t, _ = weave.seam.evaluate(s)
    side = across - (t @ across)[:, None] * t
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    expected = seam + A * np.sin(2 * np.pi * 7.5 * s / weave.length)[:, None] * side
    assert weave.evaluate(s)[0] == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("name", ["line", "rounded", "into an arc"])
@pytest.mark.parametrize("shape", ["sine", "triangle", "trapezoid"])
def test_it_breaks_where_it_is_steepest_or_bends_and_both_sides_meet_there(name, shape):
    cycles = 60.5 if name == "line" else 2.5
    weave = weave_of(name, shape, cycles=cycles)
    for order in (0, 1, 2):
        left, right = (weave.evaluate(weave.breaks, side)[order] for side in ("left", "right"))
        assert left == pytest.approx(right, abs=1e-7 * np.abs(left).max())
    if name == "line":
        phases = {"sine": [0.0, 0.25, 0.5, 0.75]}.get(shape)
        corners = {"triangle": (0.25, 0.75), "trapezoid": (0.125, 0.375, 0.625, 0.875)}.get(shape, ())
        phases = phases or [0.0, *(c + part for c in corners for part in (-0.025, 0.0, 0.025))]
        wanted = np.sort([k + phase for k in range(61) for phase in phases if 0.0 < k + phase < cycles])
        assert weave.breaks == pytest.approx(wanted / cycles * weave.length, abs=1e-12)


def test_between_stops_each_part_has_its_own_cycles_and_begins_on_the_seam():
    weave = Weave(SHARP, FixedOrientation(np.diag([1.0, -1.0, -1.0]), SHARP.length), A, (3.0, 2.5), "sine")
    assert weave.stops.tolist() == stops_of(SHARP).tolist() == [0.12]
    for low, high, cycles, along, across in ((0.0, 0.12, 3.0, 0, 1), (0.12, 0.2, 2.5, 1, 0)):
        s = np.linspace(low, high, 201)[1:-1]
        p = weave.evaluate(s)[0]
        assert p[:, along] == pytest.approx(s if along == 0 else s - 0.12, abs=1e-15)
        offset = p[:, across] - (0.12 if across == 0 else 0.0)
        wave = A * np.sin(2 * np.pi * cycles * (s - low) / (high - low))
        assert offset == pytest.approx(wave if along == 0 else -wave, abs=1e-14)
    quarters = [*(0.12 * np.arange(1, 12) / 12), 0.12, *(0.12 + 0.08 * np.arange(1, 10) / 10)]
    assert weave.breaks == pytest.approx(np.array(quarters), abs=1e-12)
    left, right = (weave.evaluate(np.array([0.12]), side) for side in ("left", "right"))
    assert left[0] == pytest.approx(right[0], abs=1e-15)
    assert left[1][0] == pytest.approx([1.0, 2 * np.pi * A * 3.0 / 0.12, 0.0])
    assert right[1][0] == pytest.approx([-2 * np.pi * A * 2.5 / 0.08, 1.0, 0.0])


def test_it_stops_where_a_line_goes_over_into_an_arc():
    """The direction goes on there, and the curvature does not: nor does the acceleration of the swing."""
    seam = join([Line([0, 0, 0], [0.1, 0, 0]), Arc([0.1, 0, 0], [0.1, 0.05, 0], [0, 0, 1], 1.2)])
    assert stops_of(seam).tolist() == [0.1]
    assert stops_of(ROUNDED).tolist() == stops_of(LINE).tolist() == []


@pytest.mark.parametrize(("tilt", "fits"), [(0.09, False), (0.11, True), (-0.09, False), (-0.11, True)])
def test_a_side_needs_a_tenth_of_its_length_square_to_the_seam(tilt, fits):
    def made(seam, across):
        return Weave(seam, turning(seam.length), A, (4.0,), "sine", np.array(across))

    across = [5 * np.cos(np.arcsin(tilt)), 5 * tilt, 0.0]
    seam = Line([0, 0, 0], [0.2, 0, 0])
    if fits:
        made(seam, across)
    else:
        with pytest.raises(PlanningError, match="`side` is along it"):
            made(seam, across)


@pytest.mark.parametrize("heading", [45.0, 30.0])
def test_where_the_side_is_along_an_arc_is_told(heading):
    """An arc that heads from -x to -y: the side is along it where it heads there, to a 32nd of its length."""
    arc = Arc([0.0, 0.1, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], np.pi / 2)
    side = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0])
    with pytest.raises(PlanningError, match="`side` is along it") as caught:
        Weave(arc, turning(arc.length), A, (4.0,), "sine", side)
    (problem,) = caught.value.problems
    assert problem.amounts["s"].value == pytest.approx(arc.length * heading / 90, abs=arc.length / 64 + 1e-9)


@pytest.mark.parametrize("shape", ["sine", "triangle", "trapezoid"])
@pytest.mark.parametrize("about", ["line", "line and side", "turning tool", "late", "arc"])
def test_bounds_of_its_derivatives_are_above_differences_and_not_far(shape, about):
    """Of p over an interval of s that rises evenly: order m bounds |p^(m)| / m! times its length^m."""
    seam = ARC if about == "arc" else LINE
    fixed = FixedOrientation(TILTED, seam.length) if about in ("line", "arc") else turning(seam.length)
    if about == "late":  # it turns in the second half alone
        rotations = np.stack([TILTED, TILTED, TILTED.T])
        halves = SegmentProgress(seam.length * np.array([0.0, 0.5, 1.0]), np.zeros(1))
        fixed = AxisAngleOrientation(rotations, halves)
    across = np.array([0.1, 0.2, 2.0]) if about == "line and side" else None
    weave = Weave(seam, fixed, A, (6.0,), shape, across)
    edges = np.concatenate([[0.0], weave.breaks, [weave.length]])
    lengths = np.diff(edges)
    rising = np.zeros((4, lengths.size))
    rising[1] = lengths
    bound = weave.majorants(edges[:-1] + 0.5 * lengths, rising)[0]
    if about in ("arc", "turning tool", "late"):  # where nothing is known of the side
        assert np.isinf(bound).all()
        return
    for k, (low, high) in enumerate(pairwise(edges)):
        s = np.linspace(low + 1e-9, high - 1e-9, 41)
        _, first, second = weave.evaluate(s)
        peaks = [np.linalg.norm(row, axis=1).max() for row in (first, second)]
        assert bound[1, k] >= peaks[0] * lengths[k] * (1 - 1e-9)
        assert bound[2, k] >= peaks[1] * lengths[k] ** 2 / 2 * (1 - 1e-6)
        assert bound[1, k] <= (1.0 + 25.0 * A * 6.0 / seam.length) * lengths[k]  # no flank is steeper than 9
