"""Lines of explanations: numbers with their units, times of moves and of jobs, and what is rounding."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from trajcli.cli import explain


def part(**fields: Any) -> SimpleNamespace:
    return SimpleNamespace(**fields)


def waypoint(time: float, *missed: float) -> SimpleNamespace:
    return part(time=time, missed=missed or (0.0, 0.0), units=["deg", "mm"])


def through(points: Any, origin: float = 0.0, outside: Any = None) -> list[str]:
    move = part(origin=origin, duration=3.0, waypoints=points, joints=["turn", "lift"], outside=outside)
    return list(explain.waypoint_lines(move))


def test_points_are_passed_at_times_of_the_move_or_unshifted_ones() -> None:
    assert through(None) == []
    points = [waypoint(0.5), waypoint(1.25), waypoint(3.0)]
    assert through(points) == ["  3 points at (s): 0.5, 1.25, 3"]
    assert through(points, 0.5) == [
        "  unshifted times: t - 0.5 s, from -0.5 to 2.5",
        "  3 points at (s, unshifted): 0, 0.75, 2.5",
    ]
    assert through([waypoint(0.1 * k) for k in range(20)])[0].endswith("1.8, 1.9")
    assert through([waypoint(0.5 * k) for k in range(30)])[0].endswith("9, 9.5, ... 14.5")
    assert through([waypoint(0.5 * k) for k in range(30)], 0.5)[1].endswith("8.5, 9, ... 14")


def test_distances_at_which_points_are_missed_stand_by_joint_in_its_unit() -> None:
    points = [waypoint(0, 0, 1e-13), waypoint(1, 0, 0.25), waypoint(2, 1e-13, 0.125)]
    assert through(points)[1:] == ["  lift passes them at a distance of (mm): 0, 0.25, 0.125"]
    many = [waypoint(k, 0.5 if k == 25 else 0.25, 0) for k in range(30)]
    assert through(many)[1].endswith("0.25, ... at most 0.5")
    beyond = [
        part(joint="turn", beyond=-0.5, unit="deg", time=0.75),
        part(joint="lift", beyond=2, unit="mm", time=1),
    ]
    assert through(None, outside=beyond) == [
        "  turn goes 0.5 deg below the points at t = 0.75 s",
        "  lift goes 2 mm above the points at t = 1 s",
    ]


def peak(joint: str, quantity: str, low: float, high: float, **more: Any) -> SimpleNamespace:
    given = {"unit": "deg", "low_time": 2.25, "high_time": 2.5, "limit": (None, None), "used": None}
    return part(joint=joint, quantity=quantity, low=low, high=high, **{**given, **more})


def peaks(
    *given: SimpleNamespace, tool: object = None, start: float = 2.0, duration: float = 1.0
) -> list[str]:
    head, *lines = explain._peaks(part(peaks=given, tool=tool, start=start, duration=duration))
    assert head == "  peaks:"
    return lines


def test_peaks_have_the_times_of_their_move_and_the_share_of_the_limit_that_is_used() -> None:
    assert peaks(
        peak("a", "position", -1, 4, limit=(-10, None), used=0.4),
        peak("a", "velocity", -2, 1, limit=(-4, 5), used=0.5),
        peak("a", "acceleration", 3, 3),
        peak("a", "jerk", 0, 7, limit=(None, 14), used=0.5),
    ) == [
        "    a q: -1 (t = 0.25) .. 4 (t = 0.5) deg; limits -10 .. unlimited",
        "    a qd: -2 (t = 0.25) .. 1 (t = 0.5) deg; limits -4 .. 5, 50 % used",
        "    a qdd: 3 (t = 0.25) deg; no limit",
        "    a qddd: 0 (t = 0.25) .. 7 (t = 0.5) deg; limits unlimited .. 14, 50 % used",
    ]
    (line,) = peaks(peak("a", "velocity", -3, 3))
    assert line == "    a qd: -3 (t = 0.25) .. 3 (t = 0.5) deg; no limit"
    (line,) = peaks(peak("a", "position", -math.pi, 0, unit="rad", limit=(-math.pi, math.pi)))
    assert line.startswith("    a q: -pi = -3.14159265 (t = 0.25) .. 0 (t = 0.5) rad; limits -pi .. pi")


def test_what_is_rounding_beside_the_largest_of_its_kind_is_not_told() -> None:
    """A rate counts beside that of which it is the rate, over the whole move; fits along a path are coarser."""
    moving = [peak("a", "position", 0, 100), peak("a", "velocity", 0, 50)]
    for size, told, fitted in ((1e-4, True, True), (1e-9, True, False), (1e-11, False, False)):
        rates = [*moving, peak("b", "position", 1, 1), peak("b", "velocity", -size, size / 2)]
        assert len(peaks(*rates)) == 3 + told
        assert len(peaks(*rates, tool=object())) == 3 + fitted
    assert "    b q: 1 (t = 0.25) deg" in peaks(*rates)[2]
    back = [peak("a", "velocity", -100, 0), peak("b", "velocity", -1e-11, 1e-11), peak("b", "position", 0, 0)]
    assert [line.split(":")[0] for line in peaks(*back)] == ["    a qd", "    b q"]
    even = [peak("a", "velocity", 0, 100), peak("a", "acceleration", -1e-11, 1e-11)]
    assert len(peaks(*even, duration=1.0)) == 1
    assert len(peaks(*even, duration=100.0)) == 2
    assert len(peaks(*even, duration=0.0)) == 1
    shaken = [
        peak("a", "velocity", 0, 1e-9),
        peak("a", "acceleration", 0, 100),
        peak("a", "jerk", -1e-11, 1e-11),
    ]
    assert len(peaks(*shaken)) == 2
    at_rest = [peak("a", "position", 3, 3), peak("a", "velocity", 0, 1e-9)]
    assert [len(peaks(*at_rest, tool=object(), duration=long)) for long in (0.5, 1.0, 4.0)] == [1, 1, 2]
    mixed = peaks(*moving, peak("b", "position", -1e-12, 5), peak("b", "velocity", -40, 1e-11))
    assert "-1e-12 (t = 0.25)" in mixed[2] or "0 (t = 0.25) .. 5" in mixed[2]
    assert mixed[3] == "    b qd: -40 (t = 0.25) .. 0 (t = 0.5) deg; no limit"


def test_limits_by_position_have_their_place_and_time_in_the_move() -> None:
    use = part(
        joint="a", used=0.5, velocity=-3, limit=6, unit="deg/s", distance=7, distance_unit="deg", time=2.5
    )
    move = part(velocity_by_position=[use, part(used=1e-13)], start=2.0)
    assert list(explain._by_position(move)) == [
        "    a qd by position: -3 deg/s (t = 0.5), 7 deg before its position limit; limit 6, 50 % used"
    ]
    assert list(explain._by_position(part(velocity_by_position=None))) == []


def test_efforts_have_what_is_left_and_what_gravity_takes() -> None:
    given = {"low": -2.0, "high": 5.0, "low_time": 2.25, "high_time": 2.5, "unit": "N m", "gravity": -1.5}
    efforts = [
        part(joint="a", used=0.5, limit=(-8.0, None), head_room=3.0, **given),
        part(joint="b", used=None, limit=(None, None), head_room=None, **given),
    ]
    extent = "-2 (t = 0.25) .. 5 (t = 0.5) N m"
    assert list(explain._efforts(part(efforts=efforts, start=2.0))) == [
        f"    a tau: {extent}; limits -8 .. unlimited, 50 % used, 3 N m left, -1.5 N m of it against gravity",
        f"    b tau: {extent}; no limit, -1.5 N m of it against gravity",
    ]


def test_what_is_carried_has_its_mass_and_place() -> None:
    load = part(mass=2.5, com=[0, 10, 20], com_unit="mm", inertia=[0] * 6)
    tool = part(name="torch", load=part(mass=0.75), xyz=[1, 2, 3], xyz_unit="mm")
    lines = list(explain._carried(part(payload=load, mounted=tool)))
    assert lines[0].startswith("  tool torch: tcp at ")
    assert lines[0].endswith("mm of the flange, 0.75 kg")
    assert lines[1].startswith("  carries 2.5 kg at ")
    assert lines[1].endswith("mm of the tcp, a point mass")
    load.inertia, tool.load, tool.name = [0, 0, 0, 0, 0, 1e-3], None, ""
    lines = list(explain._carried(part(payload=load, mounted=tool)))
    assert lines[0].startswith("  tool: tcp at ")
    assert lines[0].endswith("of the flange")
    assert lines[1].endswith("mm of the tcp")
    assert list(explain._carried(part(payload=None, mounted=None))) == []


def saving(saved: float | None, share: float | None = None, reason: str | None = None) -> SimpleNamespace:
    return part(joint="a", quantity="velocity", saved=saved, share=share, reason=reason)


NONE_HIGHER = "  no limit of a joint that is 10 % higher would save time"


@pytest.mark.parametrize(
    ("savings", "lines"),
    [
        (None, []),
        ([], ["  its limits do not say how long it lasts: none that is higher would save time"]),
        ([saving(0.0), saving(0.0)], [NONE_HIGHER]),
        ([saving(0.25, 0.125), saving(0.0)], ["  10 % more velocity of a would save 0.25 s (12.5 %)"]),
        ([saving(0.25)], ["  10 % more velocity of a would save 0.25 s"]),
        ([saving(None, reason="too long")], ["  10 % more velocity of a: too long"]),
        ([saving(0.0), saving(None, reason="too long")], ["  10 % more velocity of a: too long"]),
        (
            [saving(0.25), saving(None, reason="too long")],
            ["  10 % more velocity of a would save 0.25 s", "  10 % more velocity of a: too long"],
        ),
    ],
)
def test_what_nobody_knows_is_not_said_to_save_nothing(savings: Any, lines: list[str]) -> None:
    assert list(explain._savings(savings)) == lines


def speed(**more: Any) -> list[str]:
    given = {"binding": None, "reference": None, "at_limit": [], "savings": None, "stretch": 1, "path": None}
    return list(explain._speed(part(**{**given, **more})))


def reference(**more: Any) -> SimpleNamespace:
    return part(
        **{"duration": 0.5, "ratio": 2.0, "joint": "a", "reason": None, "through_points": False, **more}
    )


def test_speed_is_that_of_what_binds_and_beside_the_bound() -> None:
    assert speed() == []
    binding = part(quantity="tool_speed", joint=None, used=0.875)
    assert speed(binding=binding) == ["  binding limit: tool speed of the tool, 87.5 % used"]
    assert speed(binding=part(quantity="jerk", joint="a", used=0.0)) == []
    at = [part(quantity="jerk", joint=name, seconds=0.25, share=0.5) for name in "abcdefgh"]
    (line,) = speed(at_limit=at)
    assert line.startswith("  at its limits: jerk of a for 0.25 s (50 %), jerk of b")
    assert line.endswith("jerk of f for 0.25 s (50 %) and 2 more")
    assert speed(at_limit=at[:6])[0].endswith("jerk of f for 0.25 s (50 %)")
    assert speed(stretch=1.5) == ["  stretched 1.5 times"]
    same = "under the same limits (0.5 s, a)"
    assert speed(reference=reference()) == [f"  duration: 2 x the fastest {same}"]
    assert speed(reference=reference(), path=object()) == [f"  duration: 2 x the fastest off the path {same}"]
    assert speed(reference=reference(through_points=True), path=object()) == [
        f"  duration: 2 x the fastest through its points {same}"
    ]
    assert speed(reference=reference(joint=None))[0].endswith("(0.5 s, several joints together)")
    assert speed(reference=reference(ratio=None)) == []
    unbounded = reference(duration=None, reason="no velocity limit")
    assert speed(reference=unbounded) == ["  no bound for the duration: a, no velocity limit"]


def test_phases_are_of_joints_or_of_what_binds() -> None:
    phases = [
        part(name=n, start=s, end=e, joint=j)
        for n, s, e, j in (("up", 0, 1, "a"), ("on", 1, 2, "b"), ("down", 1, 3, "a"))
    ]
    move = part(binding_phases=False, phases=phases, arrivals={"a": 3.0, "b": 2.0})
    assert list(explain._phases(move)) == [
        "  phases of a (s): up 0..1, down 1..3",
        "  phases of b (s): on 1..2",
        "  durations of each joint alone (s): a 3, b 2",
    ]
    move.binding_phases = True
    assert list(explain._phases(move)) == [
        "  which limit binds when (s):",
        "    0..1: up of a",
        "    1..2: on of b",
        "    1..3: down of a",
    ]
    law = part(binding_phases=False, phases=[part(name="up", start=0, end=1, joint=None)], arrivals={})
    assert list(explain._phases(law)) == ["  phases (s): up 0..1"]


def test_zones_are_told_with_the_move_in_which_they_end() -> None:
    zone = {
        "number": 2, "used": 40.0, "asked": 50.0, "unit": "mm", "of": "position", "joint": None, "entered": 1.5,
        "left": 2.5, "nearest": 3.0, "farthest": 41.0, "deviation": 4.0, "length_unit": "mm", "binds": "acceleration of a",
    }  # fmt: skip
    zones = [part(move=1, **zone), part(move=2, **{**zone, "joint": "a", "nearest": None})]
    flyby = part(zones=zones, duration=5.0, stopping=6.0, bound=part(duration=4.5, method="searched"))
    explained = part(flyby=flyby)
    between = "entered at 1.5 s, left at 2.5 s of the job"
    assert list(explain._zones(explained, 1)) == [
        (
            f"  zone 2: 40 of 50 mm (position), {between}; the tool 3 to 41 mm from the corner, 4 mm off its path; "
            "binding: acceleration of a"
        )
    ]
    assert list(explain._zones(explained, 2)) == [
        f"  zone 2: 40 of 50 mm (a), {between}; binding: acceleration of a"
    ]
    assert list(explain._zones(explained, 0)) == list(explain._zones(part(flyby=None), 1)) == []
    assert list(explain._flown_by(explained)) == [
        "flying by its corners: 5 s, stopping there 6 s; bound: 4.5 s (searched)"
    ]
    flyby.bound = None
    assert list(explain._flown_by(explained)) == ["flying by its corners: 5 s, stopping there 6 s"]
    assert (
        list(explain._flown_by(part(flyby=part(zones=[])))) == list(explain._flown_by(part(flyby=None))) == []
    )
