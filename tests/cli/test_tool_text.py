"""Words of `explain` for paths of the tool: each number of a report stands in its sentence."""

from __future__ import annotations

from types import SimpleNamespace as Report
from typing import Any

import pytest

from trajcli.cli.tool_text import tool_lines

BETWEEN = {
    "start": [0.0, 1.0, 2.0],
    "end": [3.0, -1e-12, 5.0],
    "unit": "mm",
    "angle_unit": "deg",
    "length": 7.5,
}
ROUND = BETWEEN | {
    "center": [1.0, 1.0, 1.0],
    "axis": [0.0, 0.0, -1.0],
    "radius": 2.5,
    "angle": 90.0,
    "pitch": -4.0,
}
ENDS = "[0, 1, 2] to [3, 0, 5] mm, length 7.5"
TURN = {"axis": [0.0, 1.0, 0.0], "angle": 30.0, "angle_unit": "deg", "unit": "mm"}
TOOL: dict[str, Any] = {
    "peaks": [],
    "segments": None,
    "held": None,
    "wanted_speed": None,
    "speed_unit": "mm/s",
    "ruled_by": None,
    "deviation": 0.001,
    "deviation_bound": None,
    "deviation_unit": "mm",
    "turned": 0.002,
    "turned_bound": None,
    "turned_unit": "deg",
    "lowest": None,
}
PATH: dict[str, Any] = {
    "length": 12.5,
    "unit": "mm",
    "segments": [],
    "corners": [],
    "weave": None,
    "law": None,
}


@pytest.fixture(autouse=True)
def law(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trajcli.cli.tool_text.law_lines", lambda _: iter(["  law"]))


def told(
    path: dict[str, Any] | None = None, tool: dict[str, Any] | None = None, start: float = 10.0
) -> list[str]:
    move = Report(path=Report(**PATH | (path or {})), tool=Report(**TOOL | (tool or {})), start=start)
    return list(tool_lines(move))  # type: ignore[arg-type]


def peak(quantity: str, value: float, unit: str, limit: float | None, *, negligible: bool = False) -> Report:
    return Report(quantity=quantity, value=value, unit=unit, limit=limit, time=12.5, negligible=negligible)


def test_a_path_its_law_and_how_near_the_tool_is_to_it() -> None:
    plain = [
        "  path: 12.5 mm",
        "  law",
        "  tool:",
        "    off the path by at most 0.001 mm, turned by 0.002 deg",
    ]
    assert told() == plain
    bounds = {"deviation_bound": 0.003, "turned_bound": 1e-12}
    assert told(tool=bounds)[-1] == "    off the path by at most 0.003 mm, turned by 0 deg"
    assert list(tool_lines(Report(path=None, tool=None, start=0.0))) == []  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("segment", "text"),
    [
        (BETWEEN | {"kind": "line"}, "line from [0, 1, 2] to [3, 0, 5] mm, length 7.5"),
        (
            ROUND | {"kind": "arc"},
            "arc from [0, 1, 2] to [3, 0, 5] mm, length 7.5: center [1, 1, 1], axis [0, 0, -1], radius 2.5, angle 90 deg",
        ),
        (
            ROUND | {"kind": "helix"},
            f"helix from {ENDS}: center [1, 1, 1], axis [0, 0, -1], radius 2.5, angle 90 deg, pitch -4",
        ),
        (TURN | {"kind": "rotation", "place": [1.0, 2.0, 3.0]}, "rotation by 30 deg at [1, 2, 3] mm"),
        (
            TURN | {"kind": "screw", "point": [4.0, 5.0, 6.0], "advance": -7.0},
            "screw about the axis [0, 1, 0] through [4, 5, 6] mm: 30 deg about it, -7 mm along it",
        ),
        (
            TURN | {"kind": "screw", "point": None, "advance": 1e-12},
            "screw about the axis [0, 1, 0]: 30 deg about it, 0 mm along it",
        ),
    ],
)
def test_segments(segment: dict[str, Any], text: str) -> None:
    assert told({"segments": [Report(**segment)]})[1] == f"    {text}"


def test_corners_are_counted_from_one() -> None:
    common = {"place": 3.0, "unit": "mm", "turn": 45.0, "turn_unit": "deg", "radius": 2.0, "deviation": 0.5}
    kinds = ("rounded", "stop", "overlap", "smooth", "bend")
    said = told({"corners": [Report(kind=kind, **common) for kind in kinds]})[1:6]
    ends = (
        "rounded, radius 2, passes at 0.5 mm",
        "stops there",
        "cut by overlapping in time",
        "goes on smoothly",
        "the curvature jumps",
    )
    where = "at s = 3 mm, turn 45 deg: "
    assert said == [f"    corner {number}: {where}{end}" for number, end in enumerate(ends, 1)]


def test_a_weave_is_said_part_by_part() -> None:
    weave = Report(shape="sine", cycles=[4.0, 2.5], lengths=[1.5, 3.0], amplitude=0.25, unit="mm")
    said = "    weave: sine, 0.25 mm to each side, cycles along the path: 4 of 1.5, then 2.5 of 3 mm"
    assert told({"weave": weave})[1] == said


def test_peaks_are_in_the_time_of_the_move() -> None:
    peaks = [
        peak("speed", 100.0, "mm/s", 250.0),
        peak("angular_speed", 3.0, "deg/s", None),
        peak("jerk", 1e-9, "mm/s^3", 1.0, negligible=True),
    ]
    said = told(tool={"peaks": peaks, "ruled_by": "a, b"})
    assert said[3:6] == [
        "    speed: at most 100 mm/s (t = 2.5); limit 250, 40 % used",
        "    angular speed: at most 3 deg/s (t = 2.5); no limit",
        "    the limits of a, b say how fast",
    ]


def test_segments_with_limits_of_their_own() -> None:
    place = {"begins": 1.0, "ends": 4.0, "place_unit": "mm", "start": 11.0, "end": 13.0}
    of = [peak("speed", 90.0, "mm/s", 100.0), peak("angular_speed", 0.0, "deg/s", 5.0, negligible=True)]
    runs = [Report(first=2, last=2, peaks=of, **place), Report(first=3, last=5, peaks=[], **place)]
    assert told(tool={"segments": runs})[3:5] == [
        "    segment 2 (s = 1 to 4 mm, t = 1 to 3): speed at most 90 of 100 mm/s",
        "    segments 3 to 5 (s = 1 to 4 mm, t = 1 to 3): no limit of speed",
    ]


@pytest.mark.parametrize(
    ("held", "top", "text"),
    [
        (0.0, 99.95, "tool speed of 100 mm/s reached, but not held"),
        (0.0, 99.8, "tool speed of 100 mm/s not reached"),
        (
            0.25,
            100.0,
            "tool speed of 100 mm/s held on 25 % of the path, lowest 80 mm/s at s = 3 mm because of a",
        ),
    ],
)
def test_a_wanted_speed_is_held_or_not(held: float, top: float, text: str) -> None:
    slowest = Report(speed=80.0, unit="mm/s", place=3.0, place_unit="mm", joint="a")
    peaks = [peak("angular_speed", 500.0, "deg/s", None), peak("speed", top, "mm/s", None)]
    said = told(tool={"held": held, "wanted_speed": 100.0, "peaks": peaks, "lowest": slowest})
    assert said[5] == f"    {text}"
    slowest.joint = None
    said = told(tool={"held": 0.5, "wanted_speed": 100.0, "peaks": peaks, "lowest": slowest})
    assert said[5].endswith("held on 50 % of the path, lowest 80 mm/s at s = 3 mm")
