"""Units of every number of a report: what each part converts, and by which unit beside it."""

from __future__ import annotations

import math
import re
from typing import Any, get_args

import pytest

from trajcli.job import explanation, report, report_parts
from trajcli.job.report_parts import MeasuredIn, ReportPart, in_units
from trajcli.units import Units

FACTORS = {"mm": 1e3, "deg": 180 / math.pi}
FIRST, SECOND = ("rad/s", "deg/s", FACTORS["deg"]), ("m", "mm", 1e3)
"""Units of the two fields of units of a part that has two: the numbers of each follow its own."""

NUMBERS = {
    "PeakReport": {"unit": "low high limit"},
    "ByPositionReport": {"unit": "velocity limit", "distance_unit": "distance"},
    "WaypointReport": {"units": "missed"},
    "OutsideReport": {"unit": "beyond"},
    "OffChordReport": {"unit": "distance"},
    "ToolPeakReport": {"unit": "value bound limit"},
    "LowestSpeedReport": {"unit": "speed", "place_unit": "place"},
    "SegmentSpeedsReport": {"place_unit": "begins ends"},
    "ToolReport": {
        "unit": "length",
        "speed_unit": "wanted_speed",
        "deviation_unit": "deviation deviation_bound",
        "turned_unit": "turned turned_bound",
    },
    "FindingReport": {"unit": "value limit"},
    "StepReport": {"unit": "size"},
    "KnotsDeviation": {"position_unit": "position", "velocity_unit": "velocity"},
    "WorstOfRows": {"unit": "value limit"},
    "PeerViolation": {"unit": "value limit"},
    "PathReferenceReport": {"deviation_unit": "deviation"},
    "PayloadReport": {"com_unit": "com"},
    "MountedToolReport": {"xyz_unit": "xyz"},
    "ZoneReport": {"unit": "asked used", "length_unit": "nearest farthest deviation", "turn_unit": "turn"},
    "PolynomialReport": {"unit": "local absolute unshifted velocity acceleration"},
    "ChoiceReport": {"units": "near"},
    "PoseReport": {"units": "joints"},
    "LineSegmentReport": {"unit": "start end length"},
    "ArcSegmentReport": {"unit": "start end center radius pitch length", "angle_unit": "angle"},
    "RotationSegmentReport": {"unit": "place", "angle_unit": "angle"},
    "ScrewSegmentReport": {"unit": "point advance", "angle_unit": "angle"},
    "CornerReport": {"unit": "place point radius deviation", "turn_unit": "turn"},
    "WeaveReport": {"unit": "amplitude lengths"},
    "PathReport": {"unit": "length"},
    "ExplainedWaypoint": {"units": "missed joints"},
    "ExplainedOutside": {"unit": "beyond"},
    "KnotReport": {"units": "position", "velocity_units": "velocity", "acceleration_units": "acceleration"},
    "BlendReport": {"unit": "coefficients"},
}
"""Of each part the numbers in SI, by the field that says in what they are; all other numbers are in no unit or in s."""

OWN_UNITS = {
    "m": "CornerReport.unit LineSegmentReport.unit ArcSegmentReport.unit RotationSegmentReport.unit ScrewSegmentReport.unit "
    "WeaveReport.unit ZoneReport.length_unit PayloadReport.com_unit MountedToolReport.xyz_unit ToolReport.deviation_unit "
    "SegmentSpeedsReport.place_unit",
    "rad": "CornerReport.turn_unit ArcSegmentReport.angle_unit RotationSegmentReport.angle_unit ScrewSegmentReport.angle_unit "
    "ZoneReport.turn_unit ToolReport.turned_unit PathReferenceReport.deviation_unit",
}
"""Units that are the same in all reports in SI."""

PARTS: dict[str, type[ReportPart]] = {
    name: kind
    for module in (report, explanation, report_parts)
    for name, kind in vars(module).items()
    if isinstance(kind, type) and issubclass(kind, ReportPart) and kind.__module__ == module.__name__
}


def test_no_part_with_a_unit_is_left_out() -> None:
    named = {
        name
        for name, kind in PARTS.items()
        if any(
            isinstance(mark, MeasuredIn) for field in kind.model_fields.values() for mark in field.metadata
        )
    }
    assert named == {*NUMBERS}


def lists(kind: type[ReportPart], name: str) -> bool:
    """Return whether a field holds several numbers."""
    annotation = kind.model_fields[name].annotation
    return any(re.match(r"(list|tuple)\[", str(each)) for each in (annotation, *get_args(annotation)))


@pytest.mark.parametrize("part", NUMBERS)
def test_every_number_follows_the_unit_that_stands_for_it(part: str) -> None:
    """One field of units after the other is a length, and the others angles per second."""
    kind, wanted = PARTS[part], {field: names.split() for field, names in NUMBERS[part].items()}
    numbers = [
        name
        for name, field in kind.model_fields.items()
        if "float" in str(field.annotation) and name not in wanted
    ]
    for chosen in wanted:
        given: dict[str, Any] = {name: [1.0, 1.0] if lists(kind, name) else 1.0 for name in numbers}
        for field in wanted:
            unit = (SECOND if field == chosen else FIRST)[0]
            given[field] = [unit, unit] if field.endswith("units") else unit
        converted = in_units(kind.model_construct(**given), Units("deg", "mm"))
        for field, names in wanted.items():
            _, unit, factor = SECOND if field == chosen else FIRST
            assert getattr(converted, field) == ([unit] * 2 if field.endswith("units") else unit)
            for name in names:
                value = getattr(converted, name)
                assert value == pytest.approx([factor] * 2 if isinstance(value, list) else factor), name
        rest = set(numbers) - {name for names in wanted.values() for name in names}
        assert {name: getattr(converted, name) for name in rest} == {name: given[name] for name in rest}


@pytest.mark.parametrize("unit", OWN_UNITS)
def test_a_unit_that_nobody_gives_is_that_of_si(unit: str) -> None:
    for each in OWN_UNITS[unit].split():
        part, _, field = each.partition(".")
        assert PARTS[part].model_fields[field].default == unit, each


def test_what_is_not_there_is_not_converted() -> None:
    peak = report.PeakReport.model_construct(low=1.0, high=1.0, limit=(None, 2.0), used=None, unit="m/s")
    assert in_units(peak, Units("deg", "mm")).limit == (None, 2000.0)
