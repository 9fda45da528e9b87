"""Weaves: the nominal curve written down here, and where the tool is by products of matrices."""

from __future__ import annotations

import numpy as np
import pytest
from independent_motion import poses, series_of
from tiers import few
from tool_jobs import DOWN, job_text, plan, refusal

from trajcli.cli.tool_text import tool_lines
from trajcli.errors import TrajcliError
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import FixedOrientation
from trajcli.geometry.paths.position import Line
from trajcli.job.read import job_from_text
from trajcli.kinematics.following.weave import Weave
from trajcli.limits.kinds import LimitedMove
from trajcli.limits.tool_bound import path_bounds
from trajcli.output.explain import explanation

HERE = {"xyz": [0.4, -0.1, 0.3], "rpy": DOWN}
TO = [0.4, 0.1, 0.3]  # 0.2 m along y: with the tool's z down the weave is along x
LAW = {"speed": 0.02, "acceleration": 0.1}
WIDE = {
    "velocity": 6.0,
    "acceleration": 100.0,
    "jerk": None,
    "tcp": {"angular_speed": 3.0, "angular_acceleration": 20.0},
}
A, CYCLE = 0.002, 0.01
TOLERANCE = 1e-6


def weaving(move=None, weave=None, start=HERE, **rest):
    """Return the plan of a line of 0.2 m that weaves."""
    fields = {"amplitude": A, "length": CYCLE, **(weave or {})}
    given = {key: value for key, value in fields.items() if value is not None}
    whole = {"planner": "line", "to": {"xyz": TO}, "law": LAW, "weave": given}
    return plan("ur5e", start, {**whole, **(move or {})}, limits=WIDE, **rest)


def tool_at(made, times):
    """Return where the tool is, (N, 3), by products of matrices of the rows of its arm."""
    curve, robot = made.trajectory.curve, made.moves[0].robot
    piece = np.clip(np.searchsorted(curve.breaks, times, "right") - 1, 0, curve.pieces - 1)
    q = series_of(curve, piece, times - curve.breaks[piece])[:1]
    return (poses(robot, q)[1][-1][0] @ robot.tool)[:, :3, 3]


def on_rows(made, count=4001):
    """Return s (N,) and where the tool is, (N, 3)."""
    times = np.linspace(0.0, made.trajectory.duration, count)
    return made.moves[0].planned.tool.law.evaluate(times)[:, 0], tool_at(made, times)


def test_a_sine_is_followed_within_tolerance_and_its_mean_is_the_seam():
    made = weaving()
    s, places = on_rows(made)
    swing = A * np.sin(2 * np.pi * s / CYCLE)
    assert np.abs(places[:, 1] - (s - 0.1)).max() < TOLERANCE
    assert min(np.abs(places[:, 0] - 0.4 - sign * swing).max() for sign in (1, -1)) < TOLERANCE
    assert np.abs(places[:, 2] - 0.3).max() < TOLERANCE
    even = np.interp(np.linspace(0, 0.2, 20001)[:-1], s, places[:, 0])
    assert even.mean() == pytest.approx(0.4, abs=2 * TOLERANCE)
    assert np.ptp(places[:, 0]) == pytest.approx(2 * A, rel=1e-3)


def nominal(corners, slope, phase):
    """Return the wave at phases, its peaks 1 and -1: slopes that go over in 5 % of a cycle, summed up."""
    fine = np.linspace(0.0, 1.0, 200_001)
    behind = {2: (-1.0, 1.0), 4: (0.0, -1.0, 0.0, 1.0)}[len(corners)]
    rate, before = np.full(fine.size, slope), 1.0
    for corner, after in zip(corners, behind, strict=True):
        x = np.clip((fine - corner) / 0.05 + 0.5, 0.0, 1.0)
        rate += slope * (after - before) * x**2 * (3 - 2 * x)
        before = after
    wave = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2)]) / (fine.size - 1)
    return np.interp(phase, fine, wave / wave.max())


@pytest.mark.full
@pytest.mark.parametrize(
    ("shape", "corners", "slope"),
    [("triangle", (0.25, 0.75), 4.0), ("trapezoid", (0.125, 0.375, 0.625, 0.875), 8.0)],
)
def test_flanks_are_straight_and_corners_rounded_within_five_percent(shape, corners, slope):
    made = weaving(weave={"shape": shape})
    s, places = on_rows(made, 8001)
    swing = (places[:, 0] - 0.4) / A
    phase = (s / CYCLE) % 1.0
    swing *= np.sign(swing[np.argmin(np.abs(s - 0.1 * CYCLE))])
    assert np.abs(swing).max() == pytest.approx(1.0, abs=2e-3)  # the amplitude is reached
    far = np.min([np.abs(phase - corner) for corner in corners], axis=0) > 0.026
    sharp = np.interp(
        phase, [0, *corners, 1], [0, *{"triangle": (1, -1), "trapezoid": (1, 1, -1, -1)}[shape], 0]
    )
    steeper = (
        1 / (1 - 1.5 * 0.025) if shape == "triangle" else 1.0
    )  # so that a rounded peak reaches the amplitude
    flank = np.where(np.abs(sharp) < 0.8, steeper * sharp, sharp)
    rows = far & (np.abs(sharp) < 0.8)
    assert np.abs(swing - flank)[rows].max() < 2 * TOLERANCE / A
    assert np.abs(swing - nominal(corners, slope, phase)).max() < 2 * TOLERANCE / A
    assert np.abs(places[:, 1] - (s - 0.1)).max() < TOLERANCE
    even = np.interp(np.linspace(0, 0.2, 20001)[:-1], s, places[:, 0])
    assert even.mean() == pytest.approx(0.4, abs=2 * TOLERANCE)  # its mean is the seam
    assert slope * steeper == pytest.approx(np.abs(np.gradient(swing[rows], s[rows] / CYCLE)).max(), rel=0.05)


@pytest.mark.full
@pytest.mark.parametrize("shape", ["sine", "triangle", "trapezoid"])
def test_about_a_line_the_distance_from_the_weave_is_proven(shape):
    """The bound is above what rows show, and within the tolerance; about a corner only rows say it."""
    made = weaving(weave={"shape": shape})
    assert [what for what, _ in made.verdict.sampled] == ["branch"]
    span, (move,) = made.trajectory.spans[0], made.moves
    limited = LimitedMove(made.trajectory, span, move.robot.limits, move.robot, move.planned.tool)
    bound, _ = path_bounds(limited)
    times = np.linspace(0.0, made.trajectory.duration, 4001)
    s = np.clip(move.planned.tool.law.evaluate(times)[:, 0], 0.0, 0.2)
    seen = np.linalg.norm(tool_at(made, times) - move.planned.tool.path.poses.position.evaluate(s)[0], axis=1)
    assert 0.99 * seen.max() < bound.upper_bound < TOLERANCE
    corner = {"line": {"xyz": [0.4, 0.0, 0.3]}, "radius": 0.02}
    path = {"planner": "path", "segments": [corner, {"line": {"xyz": [0.48, 0.0, 0.3]}}], "law": LAW}
    given = {"shape": shape, "amplitude": A, "length": CYCLE}
    around = plan("ur5e", HERE, {**path, "weave": given}, limits=WIDE)
    assert "distance from the path" in " and ".join(what for what, _ in around.verdict.sampled)


def test_a_half_cycle_more_ends_on_the_seam_too():
    made = weaving({"to": {"xyz": [0.4, -0.02, 0.3]}}, {"length": 0.08 / 7.5})
    assert not [e for e in made.moves[0].planned.events if e.kind == "weave_fitted"]
    s, places = on_rows(made)
    assert (
        np.abs(np.abs(places[:, 0] - 0.4) - np.abs(A * np.sin(2 * np.pi * s * 7.5 / 0.08))).max() < TOLERANCE
    )


def test_other_lengths_are_fitted_and_told():
    made = weaving({"to": {"xyz": [0.4, -0.02, 0.3]}}, {"length": 0.011})
    (event,) = (e for e in made.moves[0].planned.events if e.kind == "weave_fitted")
    assert event.amounts["used"].value == pytest.approx(0.08 / 7)
    assert not event.concedes
    s, places = on_rows(made)
    assert np.abs(np.abs(places[:, 0] - 0.4) - np.abs(A * np.sin(2 * np.pi * s * 7 / 0.08))).max() < TOLERANCE


@pytest.mark.full
def test_a_frequency_is_the_speed_of_the_law_over_a_length():
    same, other = weaving(), weaving(weave={"length": None, "frequency": LAW["speed"] / CYCLE})
    assert other.trajectory.duration == same.trajectory.duration
    times = np.linspace(0, same.trajectory.duration, 50)
    assert np.array_equal(other.trajectory.curve.evaluate(times), same.trajectory.curve.evaluate(times))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_side_that_is_asked_for_is_the_first(sign):
    poses = move_of(0.1, side=[0.0, 0.0, sign], amplitude=A, length=CYCLE)[1].path.poses
    quarter = poses.position.evaluate(np.array([CYCLE / 4]))[0][0]
    np.testing.assert_allclose(quarter, [0.4, -0.1 + CYCLE / 4, 0.3 + sign * A], atol=1e-9)


@pytest.mark.full
def test_a_side_says_where_it_swings_first():
    s, places = on_rows(weaving(weave={"side": [0.0, 0.0, 1.0]}))
    assert np.abs(places[:, 2] - 0.3 - A * np.sin(2 * np.pi * s / CYCLE)).max() < TOLERANCE
    assert np.abs(places[:, 0] - 0.4).max() < TOLERANCE


@pytest.mark.full
def test_an_arc_weaves_along_its_radius():
    """With the tool's z along the axis: the radius swings, and s goes round evenly."""
    move = {"planner": "arc", "center": [0.4, 0.0, 0.3], "axis": "z", "angle": np.pi}
    move["weave"] = {"amplitude": A, "length": 0.1 * np.pi / 30}
    made = plan("ur5e", HERE, {**move, "law": LAW}, limits=WIDE)
    s, places = on_rows(made)
    off = places[:, :2] - [0.4, 0.0]
    radius = np.hypot(*off.T)
    swing = A * np.sin(2 * np.pi * 30 * s / (0.1 * np.pi))
    assert min(np.abs(radius - 0.1 - sign * swing).max() for sign in (1, -1)) < TOLERANCE
    assert np.abs(np.unwrap(np.arctan2(off[:, 1], off[:, 0])) + np.pi / 2 - s / 0.1).max() < 10 * TOLERANCE


@pytest.mark.full
def test_a_rounded_corner_is_woven_around_and_a_stop_is_on_the_seam():
    corner, end = [0.4, 0.0, 0.3], [0.48, 0.0, 0.3]
    for radius in (0.02, 0.0):
        move = {
            "planner": "path",
            "segments": [{"line": {"xyz": corner}, "radius": radius}, {"line": {"xyz": end}}],
        }
        made = plan(
            "ur5e", HERE, {**move, "law": LAW, "weave": {"amplitude": A, "length": 0.01}}, limits=WIDE
        )
        stops = made.moves[0].planned.tool.path.poses.stops
        assert stops.size == (radius == 0)
        s, places = on_rows(made)
        if radius == 0:
            assert np.abs(places[np.abs(s - 0.1).argmin()] - corner).max() < 1e-4
        straight = s < 0.07
        assert np.ptp(places[straight, 0]) == pytest.approx(2 * A, rel=1e-2)
        assert np.abs(places[-1] - end).max() < TOLERANCE


@pytest.mark.parametrize("shape", ["sine", "triangle", "trapezoid"])
def test_the_path_has_a_continuous_second_derivative(shape):
    """Also where a corner is rounded, by central differences of what it says of itself."""
    seam = join([Line([0, 0, 0], [0.1, 0, 0]), Line([0.1, 0, 0], [0.12, 0.1, 0])], 0.03)
    weave = Weave(seam, FixedOrientation(np.diag([1.0, -1.0, -1.0]), seam.length), A, (20,), shape)
    for order in (1, 2):
        left, right = (weave.evaluate(weave.breaks, side)[order] for side in ("left", "right"))
        assert np.abs(left - right).max() < 1e-7 * np.abs(left).max()
    s, h = np.linspace(0.001, seam.length - 0.001, 501), 1e-7
    p = [weave.evaluate(s + k * h)[0] for k in (-1, 0, 1)]
    values = weave.evaluate(s)
    assert np.abs((p[2] - p[0]) / (2 * h) - values[1]).max() < 1e-5
    slopes = [weave.evaluate(s + k * h)[1] for k in (-1, 1)]
    bend = (slopes[1] - slopes[0]) / (2 * h)
    assert np.abs(bend - values[2]).max() < 2e-3 * np.abs(values[2]).max()


@pytest.mark.full
def test_the_fastest_law_keeps_the_limits_of_the_tool():
    """Speeds and accelerations of the tool, not of the seam, by independent kinematics."""
    from tool_jobs import times_of, tool_rates

    limits = {"velocity": 6.0, "acceleration": 60.0, "jerk": None, "tcp": {"speed": 0.1, "acceleration": 3.0}}
    move = {"planner": "line", "to": {"xyz": [0.4, -0.05, 0.3]}, "law": {"shape": "time_optimal"}}
    made = plan("ur5e", HERE, {**move, "weave": {"amplitude": A, "length": CYCLE}}, limits=limits)
    speed, _, acceleration, _ = tool_rates(made, times_of(made, 2001))
    assert 0.9 * 0.1 < speed.max() <= 0.1 * (1 + 1e-6)
    assert 0.9 * 3.0 < acceleration.max() <= 3.0 * (1 + 1e-6)


@pytest.mark.parametrize("speed", [0.02, 0.3])
def test_the_speed_of_a_fastest_law_is_along_the_seam_and_the_tool_keeps_its_own(speed):
    from tool_jobs import times_of, tool_rates

    limits = {
        "velocity": 6.0,
        "acceleration": 100.0,
        "jerk": None,
        "tcp": {"speed": 0.1, "acceleration": 5.0},
    }
    move = {
        "planner": "line",
        "to": {"xyz": [0.4, -0.06, 0.3]},
        "law": {"shape": "time_optimal", "speed": speed},
    }
    made = plan("ur5e", HERE, {**move, "weave": {"amplitude": A, "length": CYCLE}}, limits=limits)
    times = times_of(made, 2001)
    along = np.diff(tool_at(made, times)[:, 1]) / np.diff(times)
    of_tool, _, acceleration, _ = tool_rates(made, times)
    assert along.max() <= speed * (1 + 1e-4)
    assert of_tool.max() <= 0.1 * (1 + 1e-6)
    assert acceleration.max() <= 5.0 * (1 + 1e-6)
    if speed == 0.02:  # the slope of the wave is up to 2 pi A / CYCLE
        assert along.max() == pytest.approx(speed, rel=1e-4)
        assert of_tool.max() == pytest.approx(speed * np.hypot(1, 2 * np.pi * A / CYCLE), rel=2e-3)
        assert made.trajectory.duration < 1.1 * 0.04 / speed
    else:  # within 2 % that the polygon in the circle of accelerations leaves
        assert max(of_tool.max() / 0.1, acceleration.max() / 5.0) > 0.97


def test_the_acceleration_of_a_fastest_law_is_along_the_seam():
    law = {"shape": "time_optimal", "speed": 0.04, "acceleration": 0.05}
    move = {"planner": "line", "to": {"xyz": [0.4, -0.05, 0.3]}, "law": law}
    made = plan(
        "ur5e",
        HERE,
        {**move, "weave": {"amplitude": A, "length": CYCLE}},
        limits={**WIDE, "acceleration": 400.0},
    )
    assert made.trajectory.duration == pytest.approx(0.05 / 0.04 + 0.04 / 0.05, rel=1e-3)
    (bound,) = (event for event in made.moves[0].planned.events if event.kind == "bound")
    assert bound.amounts["bound"].value <= made.trajectory.duration


@pytest.mark.parametrize(
    ("move", "weave", "message"),
    [
        ({}, {"length": None}, "a weave has a `length` of a cycle, or a `frequency`"),
        ({}, {"frequency": 2.0}, "a weave has a `length` of a cycle, or a `frequency`"),
        (
            {"law": {"shape": "time_optimal"}},
            {"length": None, "frequency": 2.0},
            "a frequency makes a length",
        ),
        ({}, {"amplitude": 0.0}, "expected a number above 0"),
        ({}, {"shape": "cosine"}, "expected sine, triangle or trapezoid"),
        ({}, {"side": [0.0, 1.0, 0.0]}, "`side` is along it"),
        ({"to": {"xyz": [0.4, -0.1, 0.4]}}, {}, "the z axis of the tool is along it"),
        ({"to": {"xyz": HERE["xyz"], "rpy": [np.pi, 0, 0.5]}}, {}, "a weave needs a path"),
        ({"to": HERE}, {}, "a weave needs a path"),
    ],
)
def test_weaves_that_are_none(move, weave, message):
    fields = {"amplitude": A, "length": CYCLE, **weave}
    given = {key: value for key, value in fields.items() if value is not None}
    whole = {"planner": "line", "to": {"xyz": TO}, "law": LAW, "weave": given, **move}
    problems = refusal("ur5e", HERE, whole, limits=WIDE).problems
    assert message in problems[0].message


def test_a_frequency_without_a_speed_is_marked_at_its_place():
    given = {"amplitude": A, "frequency": 2.0}
    move = {"planner": "line", "to": {"xyz": TO}, "law": {"shape": "time_optimal"}, "weave": given}
    (problem,) = refusal("ur5e", HERE, move, limits=WIDE).problems
    text = job_text("ur5e", HERE, move, limits=WIDE)
    assert text[problem.place.column - 1 :].startswith(("2.0", '"frequency"'))


@pytest.mark.full
def test_a_weave_is_not_flown_by():
    """A zone of its own is an error; the job's is not used there."""
    weave = {"amplitude": A, "length": CYCLE}
    first = {"planner": "line", "to": {"xyz": [0.4, 0.0, 0.3]}, "law": LAW, "weave": weave}
    last = {"planner": "line", "to": {"xyz": [0.5, 0.0, 0.3]}, "law": LAW}
    (problem,) = refusal("ur5e", HERE, {**first, "zone": 0.01}, last, limits=WIDE).problems
    assert "it weaves" in problem.message
    made = plan("ur5e", HERE, first, last, limits=WIDE, zone=0.01)
    assert not made.flyby.zones


@pytest.mark.full
@pytest.mark.parametrize("shape", few(["sine", "triangle", "trapezoid"], 1))
def test_an_explanation_says_shape_amplitude_and_cycles(shape):
    """In the units of the job; without a weave it says nothing of one."""
    corner = {"line": {"xyz": [0.4, -0.07, 0.3]}, "radius": 0.0}
    move = {"planner": "path", "segments": [corner, {"line": {"xyz": [0.4, -0.05, 0.31]}}]}
    given = {"shape": shape, "amplitude": A, "length": CYCLE}
    made = plan("ur5e", HERE, {**move, "law": LAW, "weave": given}, limits=WIDE)
    path = explanation(made).moves[0].path
    assert (path.weave.shape, path.weave.amplitude, path.weave.cycles) == (shape, A, [3.0, 2.0])
    lengths = [0.01, np.hypot(0.02, 0.01) / 2]
    assert path.weave.lengths == pytest.approx(lengths)
    (line,) = (text for text in tool_lines(explanation(made).moves[0]) if "weave" in text)
    cycles = f"3 of {lengths[0]:.6g}, then 2 of {lengths[1]:.6g}"
    assert line.strip() == f"weave: {shape}, 0.002 m to each side, cycles along the path: {cycles} m"
    assert (
        "weave"
        not in explanation(plan("ur5e", HERE, {**move, "law": LAW}, limits=WIDE)).moves[0].path.model_dump()
    )


def test_more_cycles_than_fit_into_memory_are_refused_with_the_shortest_length():
    """0.2 m of 100000 cycles are 2 um each; 2e8 of them took 6 GiB for their breaks alone."""
    move = {"planner": "line", "to": {"xyz": TO}, "law": LAW}
    for weave in ({"length": 1e-9}, {"frequency": 2e10}):
        error = refusal("ur5e", HERE, {**move, "weave": {"amplitude": A, **weave}}, limits=WIDE)
        text = str(error)
        place = job_text("ur5e", HERE, {**move, "weave": {"amplitude": A, **weave}}, limits=WIDE)
        assert place[error.problems[0].place.column - 1 :].startswith('{"amplitude"')
        assert "at most 100000 cycles weave" in text
        assert "2e-06 m or longer, not 1e-" in text


BEFORE = np.array([[1.0, 0, 0, 0.4], [0, -1, 0, -0.1], [0, 0, -1, 0.3], [0, 0, 0, 1]])


def move_of(*seams, **weave):
    """Return the move, and its path, along lines of these lengths, each square to the one before, with stops."""
    directions = np.array([[0, 1.0, 0], [1.0, 0, 0]] * len(seams))[: len(seams)]
    places = np.cumsum(directions * np.array(seams)[:, None], axis=0) + HERE["xyz"]
    segments = [{"line": {"xyz": place}} for place in places.tolist()]
    move = {"planner": "path", "segments": segments, "corner": "stop", "law": LAW}
    loaded = job_from_text(job_text("ur5e", HERE, {**move, **({"weave": weave} if weave else {})}))
    return loaded.job.moves[0], loaded.job.moves[0].path_from(BEFORE, loaded.robot)


@pytest.mark.parametrize("wanted", [0.2 / 1.7, 0.2 / 18.4, 0.2 / 2.5, 0.2 / 0.7, 1.0])
@pytest.mark.parametrize("shape", ["sine", "trapezoid"])
def test_between_stops_there_are_the_halves_that_are_asked_for_or_the_nearest_number_of_cycles(wanted, shape):
    """At least one; the remark is on the cycle that is furthest from what is asked for, longer or shorter."""
    seams = np.array([0.2, 0.13])
    weave = move_of(*seams, amplitude=A, length=wanted, shape=shape)[1].path.poses.position
    exact = [np.arange(1, 99) / 2, np.arange(1, 99)]
    for seam, cycles in zip(seams, weave.cycles, strict=True):
        found = [numbers[np.abs(numbers - seam / wanted).argmin()] for numbers in exact]
        assert cycles == pytest.approx(found[0] if abs(found[0] * wanted - seam) < 1e-9 else found[1])
    assert weave.shape == shape


@pytest.mark.parametrize(
    ("seams", "worst"), [([0.2, 0.13], 0.13), ([0.17, 0.2], 0.17), ([0.0, 0.24, 0.2], 0.24)]
)
def test_the_remark_on_cycles_is_of_those_furthest_from_what_is_asked_for(seams, worst):
    """0.1 m fits 0.2 m; 0.13 m takes one of 0.13 m, 0.17 m two of 0.085 m, 0.24 m two of 0.12 m."""
    planned = move_of(*seams, amplitude=A, length=0.1)[1]
    assert [event.kind for event in planned.events] == [*(["merged"] if 0.0 in seams else []), "weave_fitted"]
    used = planned.events[-1].amounts["used"].value
    assert used == pytest.approx(worst / round(worst / 0.1))


def test_what_weaves_is_not_flown_by():
    assert move_of(0.2, amplitude=A, length=0.1)[0].why_not_flown_by == "it weaves"
    assert move_of(0.2)[0].why_not_flown_by is None


def test_the_shortest_cycle_that_is_said_is_long_enough():
    """100000 cycles are allowed, and the number is rounded up."""
    with pytest.raises(TrajcliError, match="so each is") as caught:
        move_of(1 / 3, amplitude=A, length=1 / 3 / 150_000)
    said = float(str(caught.value).split("each is ")[1].split()[0])
    assert 1 / 3 <= said * 100_000 < (1 + 1e-6) / 3
    assert move_of(1 / 3, amplitude=A, length=said)[1].path.poses.position.cycles == (100_000,)
