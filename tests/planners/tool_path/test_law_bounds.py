"""Bounds of laws along a path: what the tool then does, of which limits; peaks of shapes; several segments."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from trajcli.curves.extrema import peaks
from trajcli.errors import MissingLimitError, PlanningError
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_path.derivatives import PathDerivatives, path_derivatives
from trajcli.planners.tool_path.law import LAWS, LawSpec, PathBounds, law_along, law_bounds

TOOL = {"speed": 0.7, "acceleration": 2.0, "jerk": 30.0, "angular_speed": 1.5, "angular_acceleration": 4.0}
PATHS = {
    "straight": PathDerivatives(True, 0.0, 0.0, 0.0),
    "bent": PathDerivatives(True, 8.0, 0.0, 0.0),
    "stretched": PathDerivatives(True, 0.0, 0.0, 0.0, 1.6),
    "stretched and bent": PathDerivatives(True, 5.0, 0.0, 0.0, 1.6),
    "turning": PathDerivatives(True, 0.0, 9.0, 0.0),
    "turning unevenly": PathDerivatives(True, 0.0, 3.0, 40.0),
    "in place": PathDerivatives(False, 0.0, 1.0, 0.0),
}
IN_PLACE = PATHS["in place"]


def used_by(bounds: PathBounds, path: PathDerivatives) -> dict[str, float]:
    """Return what the tool does at most with a law within bounds, along a path whose derivatives are the largest.

    Of the position p' is along p'' only where p' is no unit vector; w' and w'' may have any directions.
    """
    v, a = bounds.speed, max(bounds.acceleration, bounds.deceleration)
    along, across = path.stretch * a, path.curvature * v**2
    square = path.stretch == 1.0
    return {
        "speed": path.stretch * v if path.moves else 0.0,
        "acceleration": (math.hypot(along, across) if square else along + across) if path.moves else 0.0,
        "angular_speed": path.turning * v,
        "angular_acceleration": path.turning * a + path.turning_change * v**2,
    }


@pytest.mark.parametrize("name", PATHS)
def test_tool_and_rotation_keep_their_limits_and_use_one_of_each_order(name: str) -> None:
    bounds, ruled = law_bounds(LawSpec(shape="quintic"), ToolLimits(**TOOL), PATHS[name], "line")
    used = {key: value / TOOL[key] for key, value in used_by(bounds, PATHS[name]).items()}
    assert max(used.values()) <= 1 + 1e-12
    assert max(used["acceleration"], used["angular_acceleration"]) >= 0.59
    assert max(used.values()) >= 0.79
    assert ruled == ("rotation" if "turning" in name or name == "in place" else "translation")
    assert bounds.jerk == (TOOL["jerk"] if PATHS[name].moves else math.inf)
    assert bounds.unit == ("length" if PATHS[name].moves else "angle")


def test_what_a_law_names_is_along_the_path() -> None:
    spec = LawSpec(shape="trapezoid", speed=0.3, acceleration=1.0, deceleration=0.5)
    bounds, _ = law_bounds(spec, ToolLimits(**TOOL), PATHS["bent"], "line")
    assert (bounds.speed, bounds.acceleration, bounds.deceleration) == (0.3, 1.0, 0.5)
    assert bounds.by_order == (0.3, 0.5, TOOL["jerk"])
    fast = LawSpec(shape="trapezoid", speed=0.6, acceleration=1.0)  # who names both rules the bend, too
    assert law_bounds(fast, ToolLimits(**TOOL), PATHS["bent"], "line")[0].speed == 0.6
    assert law_bounds(LawSpec(shape="trapezoid", speed=0.6), ToolLimits(**TOOL), PATHS["bent"], "line")[
        0
    ].speed == pytest.approx(math.sqrt(0.8 * 2.0 / 8.0))
    up = replace(bounds, acceleration=0.2)
    assert up.by_order == (0.3, 0.2, TOOL["jerk"])
    assert (
        law_bounds(LawSpec(shape="quintic", jerk=9.0), ToolLimits(**TOOL), PATHS["bent"], "line")[0].jerk
        == 9.0
    )
    twice = bounds.with_each(up, lambda one, other: one + other)
    assert (twice.speed, twice.acceleration, twice.deceleration) == (0.6, 1.2, 1.0)


@pytest.mark.parametrize(("longer", "possible"), [(0.0, True), (1e-4, True), (-1e-4, False)])
def test_ramps_of_a_trapezoid_that_lasts_as_long_as_its_ramps_alone(longer: float, possible: bool) -> None:
    """Up with 2 and down with 5 m/s^2, without a bound of the speed: in more time it cruises, in less it is none."""
    bounds, length = PathBounds(math.inf, 2.0, 5.0, math.inf), 0.7
    duration = math.sqrt(2 * length * (1 / 2.0 + 1 / 5.0)) * (1 + longer)
    spec = LawSpec(acceleration=2.0, deceleration=5.0, duration=duration)
    if not possible:
        with pytest.raises(PlanningError):
            LAWS["trapezoid"].segment(spec, length, bounds, duration)
        return
    law = LAWS["trapezoid"].segment(spec, length, bounds, duration).law
    fastest = peaks(law)[2]
    assert [fastest.low[0], fastest.high[0]] == pytest.approx([-5.0, 2.0], rel=1e-6)
    assert law.duration == pytest.approx(duration, rel=1e-12)


def test_a_trapezoid_slows_down_as_its_law_says_at_a_speed_of_its_own() -> None:
    spec = LawSpec(speed=0.5, deceleration=1.5, duration=2.0)
    law = LAWS["trapezoid"].segment(spec, 0.7, PathBounds(0.5, math.inf, 1.5, math.inf), 2.0).law
    found = peaks(law)
    assert found[1].high[0] == pytest.approx(0.5)
    assert found[2].low[0] == pytest.approx(-1.5)
    assert law.duration == pytest.approx(2.0)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("length", [0.2, 1.7])
@pytest.mark.parametrize("shape", ["cubic", "quintic", "cycloidal", "jerk_limited"])
def test_the_fastest_of_a_shape_reaches_one_bound_and_passes_none(
    shape: str, length: float, order: int
) -> None:
    """Found by the extremes of the law; the bounds of the other orders are loose."""
    wide = [1e3, 1e4, 1e5]
    wide[order - 1] = 1.3
    bounds = PathBounds(wide[0], wide[1], wide[1], wide[2])
    made = LAWS[shape].segment(LawSpec(shape=shape), length, bounds, None).law
    reached = [float(each.magnitude[0]) for each in peaks(made, (0, 1, 2, 3))]
    assert reached[0] == pytest.approx(length)
    for found, bound in zip(reached[1:], wide, strict=True):
        assert found <= bound * (1 + 2e-3)
    assert reached[order] == pytest.approx(1.3, rel=2e-3)


@pytest.mark.parametrize("shape", ["cubic", "quintic", "cycloidal"])
def test_a_duration_below_the_shortest_is_refused(shape: str) -> None:
    bounds = PathBounds(1.3, 5.0, 5.0, 90.0)
    shortest = LAWS[shape].segment(LawSpec(shape=shape), 0.7, bounds, None).law.duration
    LAWS[shape].segment(LawSpec(shape=shape), 0.7, bounds, shortest)
    with pytest.raises(PlanningError, match="but the law says at most"):
        LAWS[shape].segment(LawSpec(shape=shape), 0.7, bounds, shortest * (1 - 1e-6))


def test_a_trapezoid_of_a_speed_and_a_duration_speeds_up_no_faster_than_its_law_says() -> None:
    """0.8 rad in 3 s at 0.27 rad/s: ramps of 3 s - 0.8 / 0.27 s each, of 7.29 rad/s^2."""
    needed = 0.27 / (3.0 - 0.8 / 0.27)
    spec = LawSpec(duration=3.0, angular_speed=0.27)
    bounds = PathBounds(0.27, needed, needed, math.inf, "angle")
    law = LAWS["trapezoid"].segment(spec, 0.8, bounds, 3.0).law
    assert law.end == pytest.approx(3.0)
    assert law.evaluate(law.end)[0] == pytest.approx(0.8)
    with pytest.raises(PlanningError) as refused:
        LAWS["trapezoid"].segment(spec, 0.8, replace(bounds, acceleration=0.999 * needed), 3.0)
    (problem,) = refused.value.problems
    assert problem.amounts["low"].value == pytest.approx(needed)
    assert problem.hint is not None
    assert "`angular_acceleration`" in problem.hint


@pytest.mark.parametrize(
    ("named", "hint"),
    [
        ({"speed": 0.27, "angular_acceleration": 1.0}, "change `angular_acceleration` or"),
        ({"angular_speed": 0.27, "acceleration": 1.0}, "change `acceleration` or"),
    ],
)
def test_a_refused_trapezoid_names_the_field_that_the_law_has(named: dict[str, float], hint: str) -> None:
    """On a path that moves and turns either may be what is too low."""
    spec = LawSpec(duration=3.0, **named)
    with pytest.raises(PlanningError) as refused:
        LAWS["trapezoid"].segment(spec, 0.8, PathBounds(0.27, 1.0, 1.0, math.inf), 3.0)
    assert str(refused.value.problems[0].hint).startswith(hint)


def test_a_refusal_says_what_the_law_would_reach() -> None:
    """A quintic over 0.6 m in 0.4 s: 15/8 of 1.5 m/s, which is allowed, and 10 / sqrt(3) of 3.75 m/s^2, which is not."""
    bounds = PathBounds(9.0, 5.0, 5.0, 900.0)
    with pytest.raises(PlanningError) as refused:
        LAWS["quintic"].segment(LawSpec(shape="quintic"), 0.6, bounds, 0.4)
    (problem,) = refused.value.problems
    amounts = problem.amounts
    assert amounts["reached"].value == pytest.approx(10 / math.sqrt(3) * 0.6 / 0.4**2)
    assert amounts["fastest"].value == pytest.approx(math.sqrt(10 / math.sqrt(3) * 0.6 / 5.0))
    said = problem.text()
    assert said.startswith(
        "a quintic law over 0.6 m in 0.4 reaches 21.6506351 m/s^2, but the law says at most 5 m/s^2"
    )


@pytest.mark.parametrize("shape", ["cubic", "quintic", "cycloidal"])
def test_a_smooth_law_has_no_breaks_but_its_ends(shape: str) -> None:
    made = LAWS[shape].segment(LawSpec(shape=shape), 0.7, PathBounds(1.3, 5.0, 5.0, 90.0), 4.0)
    assert made.breaks.tolist() == [0.0, 4.0]


def cornered(*more: float) -> ToolPath:
    """Return a path of 0.3 m, then 0.6 m square to it, then steps of such lengths: a law stops between."""
    places = np.zeros((3 + len(more), 3))
    places[1:, 0], places[2:, 1] = 0.3, 0.6
    places[3:, 2] = np.cumsum(more)
    lines = [Line(a, b) for a, b in pairwise(places)]
    chain = join(lines)
    return ToolPath(PoseCurve(chain, FixedOrientation(np.eye(3), chain.length)), (True,) * 3, "all")


@pytest.mark.parametrize("shape", ["trapezoid", "cubic", "quintic", "cycloidal"])
@pytest.mark.parametrize("fields", [{}, {"duration": 3.0}, {"minimum_duration": 6.0}])
def test_a_law_over_two_segments_stops_between_them(shape: str, fields: dict[str, float]) -> None:
    """Durations are shared as lengths are; a law that is too short is slower as a whole, phases and breaks with it."""
    path = cornered()
    made, _ = law_along(path, LawSpec(shape=shape, **fields), ToolLimits(**TOOL), "polyline")
    fastest = [
        LAWS[shape].segment(LawSpec(shape=shape), length, PathBounds(0.7, 2.0, 2.0, 30.0), None).law.duration
        for length in (0.3, 0.6)
    ]
    halt = {"duration": 1.0, "minimum_duration": 6.0 * fastest[0] / sum(fastest)}.get(
        "".join(fields), fastest[0]
    )
    whole = next(iter(fields.values()), sum(fastest))
    assert made.law.duration == pytest.approx(whole, rel=1e-9)
    place, speed = (float(made.law.evaluate(halt, order)[0]) for order in (0, 1))
    assert (place, speed) == (pytest.approx(0.3, abs=1e-9), pytest.approx(0.0, abs=1e-7))
    assert float(made.law.evaluate(made.law.end)[0]) == pytest.approx(0.9)
    assert np.abs(made.breaks - halt).min() < 1e-9
    assert (np.diff(made.breaks) > 0).all()
    assert made.breaks[-1] == pytest.approx(whole)
    if made.phases:
        assert made.phases[-1].end == pytest.approx(whole)
        assert min(abs(phase.start - halt) for phase in made.phases) < 1e-9


@pytest.mark.parametrize("deceleration", [None, 1.0])
def test_a_rotation_in_place_ends_at_rest_whatever_deceleration_of_the_tool_its_law_names(
    deceleration: float | None,
) -> None:
    """0.8 rad in 3 s at 0.4 rad/s: the ramps take what 2 s of cruise leave, 1 s each; a length slows down no angle."""
    spec = LawSpec(duration=3.0, angular_speed=0.4, deceleration=deceleration)
    bounds, _ = law_bounds(spec, ToolLimits(**TOOL), IN_PLACE, "line")
    law = LAWS["trapezoid"].segment(spec, 0.8, bounds, 3.0).law
    assert law.breaks == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert float(law.evaluate(3.0, 1)[0]) == pytest.approx(0.0, abs=1e-12)


def test_an_acceleration_that_a_law_names_of_a_rotation_is_that_of_both_ramps() -> None:
    spec = LawSpec(angular_acceleration=2.5, deceleration=1.0)
    bounds, _ = law_bounds(spec, ToolLimits(**TOOL), IN_PLACE, "line")
    assert (bounds.speed, bounds.acceleration, bounds.deceleration) == (TOOL["angular_speed"], 2.5, 2.5)


@pytest.mark.parametrize(
    ("fields", "speed", "ramps"),
    [
        ({"shape": "trapezoid"}, math.inf, 2.0),
        ({"shape": "trapezoid", "acceleration": 0.4}, math.inf, 0.4),
        ({"shape": "trapezoid", "speed": 0.9}, 0.9, math.inf),
        ({"shape": "quintic"}, math.inf, math.inf),
        ({"shape": "quintic", "speed": 0.9}, 0.9, math.inf),
    ],
)
def test_limits_lower_nothing_of_a_law_with_a_duration_but_say_ramps(
    fields: dict[str, float], speed: float, ramps: float
) -> None:
    """A trapezoid is found from its duration and either its speed or its ramps; others from the duration alone."""
    spec = LawSpec(duration=3.0, **fields)
    bounds, ruled = law_bounds(spec, ToolLimits(**TOOL), PATHS["straight"], "line")
    assert (bounds.speed, *bounds.by_order[1:2], ruled) == (speed, ramps, None)


def test_a_trapezoid_with_a_duration_needs_a_speed_or_ramps() -> None:
    for name, asked in (("straight", "acceleration"), ("in place", "angular_acceleration")):
        with pytest.raises(MissingLimitError) as refused:
            law_bounds(LawSpec(duration=3.0), ToolLimits(speed=0.7), PATHS[name], "line")
        (problem,) = refused.value.problems
        own = asked.replace("acceleration", "speed")
        assert f"{{tcp: {{{asked}: ...}}}}" in problem.hint
        assert problem.hint.endswith(f"`{asked}` or a `duration` or `{own}` to the `law`") or (
            problem.hint.endswith(f"`{asked}` or `{own}` to the `law`")
        )


@pytest.mark.parametrize(("unit", "prefix"), [("length", ""), ("angle", "angular_")])
@pytest.mark.parametrize("by", ["speed", "acceleration"])
def test_a_trapezoid_that_does_not_exist_is_told_what_it_may_have(by: str, unit: str, prefix: str) -> None:
    """Over L in T: a cruise between L / T, that of a rectangle, and twice that, or ramps of 4 L / T^2 and more."""
    length, duration = 2 / 3, 2.0
    own = {"speed": 0.3, "acceleration": 0.5}[by]
    bounds = PathBounds(own if by == "speed" else math.inf, *(2 * (own,)), math.inf, unit)
    with pytest.raises(PlanningError) as refused:
        LAWS["trapezoid"].segment(LawSpec(duration=duration), length, bounds, duration)
    (problem,) = refused.value.problems
    amounts = problem.amounts
    assert {amounts[key].dimension for key in ("length", "given", "low")} == {unit}
    assert (amounts["given"].value, amounts["given"].order) == (own, 1 if by == "speed" else 2)
    least = length / duration if by == "speed" else 4 * length / duration**2
    assert (amounts["low"].value, amounts["low"].rounded) == (pytest.approx(least), "up")
    if by == "speed":
        assert (amounts["high"].value, amounts["high"].rounded) == (pytest.approx(2 * least), "down")
    assert ("at most" in problem.text()) == (by == "speed")
    assert f"`{prefix}{by}`" in problem.hint


FLAWS = [
    ({"shape": "cubic"}, {"duration": 2.0}, {"minimum_duration": 1.0}, "exclude each other"),
    ({"deceleration": 1.0}, {"shape": "trapezoid"}, {"shape": "cubic"}, "slows down as it speeds up"),
    ({"jerk": 5.0}, {"shape": "quintic"}, {"shape": "trapezoid"}, "cannot be limited"),
    ({"duration": 2.0}, {"shape": "cubic"}, {"shape": "jerk_limited"}, "as short as its limits allow"),
    ({"duration": 2.0, "speed": 0.2}, {}, {"acceleration": 1.0}, "ask too much"),
]


@pytest.mark.parametrize(("fields", "right", "wrong", "said"), FLAWS)
def test_fields_of_a_law_that_do_not_go_together_are_refused(
    fields: dict[str, Any], right: dict[str, Any], wrong: dict[str, Any], said: str
) -> None:
    LawSpec(**fields, **right)
    with pytest.raises(ValidationError, match=said):
        LawSpec(**{**right, **fields, **wrong})


@pytest.mark.parametrize(
    ("fields", "may"),
    [
        ({}, True),
        ({"speed": 0.2}, True),
        ({"acceleration": 1.0}, True),
        ({"speed": 0.2, "acceleration": 1.0}, False),
        ({"shape": "cubic", "speed": 0.2, "acceleration": 1.0}, True),
        ({"shape": "jerk_limited"}, False),
    ],
)
def test_what_a_law_says_of_durations_is_what_it_accepts(fields: dict[str, Any], *, may: bool) -> None:
    assert LawSpec(**fields).takes_any_duration is may
    if may:
        assert LawSpec(**fields, duration=2.0).duration == 2.0
    else:
        with pytest.raises(ValidationError):
            LawSpec(**fields, duration=2.0)


@pytest.mark.parametrize(("name", "prefix"), [("straight", ""), ("in place", "angular_")])
@pytest.mark.parametrize("shape", ["cubic", "quintic", "cycloidal"])
def test_a_law_that_nothing_bounds_asks_for_a_speed(shape: str, name: str, prefix: str) -> None:
    with pytest.raises(MissingLimitError) as refused:
        law_bounds(LawSpec(shape=shape), ToolLimits(), PATHS[name], "line")
    (problem,) = refused.value.problems
    assert f"limits: {{tcp: {{{prefix}speed: ...}}}}" in problem.hint
    assert problem.hint.endswith("or a `duration` to the `law`")


def test_the_jerk_of_a_rotation_in_place_is_no_limit_that_somebody_could_give() -> None:
    with pytest.raises(MissingLimitError, match="a rotation in place has no limit of it"):
        law_bounds(LawSpec(shape="jerk_limited"), ToolLimits(**TOOL), IN_PLACE, "line")
    slower = {name: value for name, value in TOOL.items() if name != "speed"}
    with pytest.raises(MissingLimitError) as refused:
        law_bounds(LawSpec(shape="jerk_limited"), ToolLimits(**slower), PATHS["straight"], "line")
    assert "duration" not in refused.value.problems[0].hint


@pytest.mark.parametrize("shape", ["trapezoid", "cubic"])
def test_each_of_three_segments_begins_when_the_one_before_ends(shape: str) -> None:
    made, _ = law_along(cornered(0.2), LawSpec(shape=shape), ToolLimits(**TOOL), "polyline")
    alone = [
        LAWS[shape].segment(LawSpec(shape=shape), length, PathBounds(0.7, 2.0, 2.0, 30.0), None)
        for length in (0.3, 0.6, 0.2)
    ]
    ends = np.cumsum([each.law.duration for each in alone])
    reached = made.law.evaluate(ends)[:, 0]
    assert reached == pytest.approx([0.3, 0.9, 1.1])
    np.testing.assert_allclose(np.abs(made.breaks[:, None] - ends).min(axis=0), 0.0, atol=1e-9)
    assert (np.diff(made.breaks) > 0).all()
    times = [(phase.start, phase.end) for phase in made.phases]
    for (_, end), (start, _) in pairwise(times):
        assert start == pytest.approx(end)


def test_a_minimum_duration_makes_no_law_faster() -> None:
    fastest, _ = law_along(cornered(), LawSpec(), ToolLimits(**TOOL), "polyline")
    for share, lasts in ((0.5, 1.0), (1.0, 1.0), (1.5, 1.5)):
        spec = LawSpec(minimum_duration=share * fastest.law.duration)
        made, _ = law_along(cornered(), spec, ToolLimits(**TOOL), "polyline")
        assert made.law.duration == pytest.approx(lasts * fastest.law.duration, rel=1e-12)


@pytest.mark.parametrize("turn", [0.3, 1.5, 2.6])
@pytest.mark.parametrize("radius", [1e-5, 1e-3])
def test_corners_far_shorter_than_the_path_count_with_their_largest_curvature(
    radius: float, turn: float
) -> None:
    """The oracle are second differences of positions; no break stands in the middle of the corner."""
    behind = np.array([2.1 + 5.7 * math.cos(turn), 5.7 * math.sin(turn), 0.0])
    chain = join([Line(np.zeros(3), np.array([2.1, 0, 0])), Line(np.array([2.1, 0, 0]), behind)], radius)
    low, high = chain.breaks
    p = chain.evaluate(np.linspace(low, high, 4001))[0]
    oracle = np.linalg.norm(np.diff(p, 2, axis=0), axis=1).max() / ((high - low) / 4000) ** 2
    fixed = FixedOrientation(np.eye(3), chain.length)
    found = path_derivatives(ToolPath(PoseCurve(chain, fixed), (True,) * 3, "all")).curvature
    assert 0.995 * oracle < found < 1.0001 * oracle
