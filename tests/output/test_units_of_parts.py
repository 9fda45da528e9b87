"""Units of every number of a report: what each part converts, and by which unit beside it."""

from __future__ import annotations

import math
import re
from typing import Any, get_args

import pytest
from pydantic import TypeAdapter

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


@pytest.mark.parametrize("unit", ["N m", "N", "s", "1", ""])
def test_what_is_no_length_and_no_angle_stays_as_it_is(unit: str) -> None:
    finding = report.FindingReport.model_construct(value=5.0, limit=4.0, unit=unit)
    converted = in_units(finding, Units("deg", "mm"))
    assert (converted.value, converted.limit, converted.unit) == (5.0, 4.0, unit)


STATED = {  # what a part says where nobody says otherwise
    "Report.version": 1,
    "ToolReport.method": "sampled",
    "AtLimitReport.method": "exact",
    "ReferenceReport.through_points": False,
    "PathReferenceReport.solver": "toppra",
    "PathReferenceReport.deviation": 0.0,
    "EffortReport.method": "bounded",
    "PayloadReport.mass_unit": "kg",
    "PayloadReport.inertia_unit": "kg m^2",
    "EffortsReport.gravity_unit": "m/s^2",
    "UnitsReport.time": "s",
    "LineSegmentReport.kind": "line",
    "RotationSegmentReport.kind": "rotation",
    "ScrewSegmentReport.kind": "screw",
}
JOINTS = "position velocity acceleration jerk"
TOOL = "speed acceleration jerk angular_speed angular_acceleration angular_jerk"
WORDS = {  # of a field all words that it may hold
    "Report.verdict": "verified violated",
    "FindingReport.method": "exact bounded sampled",
    "RowsReport.interpolation": "linear cubic quintic",
    "RowsReport.verdict": "satisfied exceeded",
    "FastestReport.method": "bounded heuristic",
    "ToolReport.method": "bounded sampled",
    "ToolReport.ruled_by": "translation rotation",
    "ToolReport.unit": "m rad mm deg",
    "BindingReport.quantity": f"{JOINTS} velocity_by_position effort {TOOL}",
    "AtLimitReport.quantity": f"{JOINTS} velocity_by_position",
    "AtLimitReport.method": "exact phases",
    "UncheckedReport.quantity": f"{JOINTS} effort",
    "ToolPeakReport.quantity": TOOL,
    "LimitUseReport.quantity": "velocity acceleration",
    "ConsumerFinding.severity": "error warning",
    "ConsumerFinding.method": "exact differences",
    "ZoneReport.of": "position orientation joints",
    "BoundReport.method": "proven second_order",
    "ChoiceReport.by": "configuration nearest",
    "ArcSegmentReport.kind": "arc helix",
    "WeaveReport.shape": "sine triangle trapezoid",
}


def test_what_a_part_says_where_nobody_says_otherwise() -> None:
    for each, value in STATED.items():
        part, _, field = each.partition(".")
        assert PARTS[part].model_fields[field].default == value, each


def test_every_word_of_a_report_can_stand_in_its_field() -> None:
    for each, words in WORDS.items():
        part, _, field = each.partition(".")
        kind = TypeAdapter(PARTS[part].model_fields[field].annotation)
        assert [kind.validate_python(word) for word in words.split()] == words.split(), each
        with pytest.raises(ValueError, match="Input should be"):
            kind.validate_python("nothing of it")


def test_a_number_that_is_zero_or_a_list_that_is_empty_is_no_part_that_is_missing() -> None:
    """Where a part leaves out what there is not, a program still finds all else."""
    chosen = {
        "by": "nearest",
        "configuration": {},
        "near": [],
        "units": [],
        "candidates": 0,
        "within_limits": 0,
    }
    given: dict[str, Any] = {
        "joints": [],
        "units": [],
        "branch": {},
        "method": "",
        "singular": False,
        "rank": {},
    }
    pose = explanation.PoseReport(**given, chosen=chosen)  # type: ignore[arg-type]
    assert pose.model_dump() == {**given, "chosen": chosen}
    free = explanation.PoseReport(**given, chosen=chosen, free_direction=[0.0])  # type: ignore[arg-type]
    assert free.model_dump()["free_direction"] == [0.0]
    screw: dict[str, Any] = {"axis": [0.0, 0.0, 1.0], "angle": 0.0, "advance": 0.0}
    units = {"kind": "screw", "unit": "m", "angle_unit": "rad"}
    assert explanation.ScrewSegmentReport(**screw).model_dump() == {**screw, **units}
    path: dict[str, Any] = {"length": 0.0, "unit": "m", "segments": [], "corners": [], "law": []}
    assert explanation.PathReport(**path).model_dump() == path


MAY_BE_NULL = {  # beside the fields whose description says so
    "FastestReport": "above",
    "LowestSpeedReport": "joint",
    "ToolReport": "held lowest",
    "MoveReport": "binding savings reference",
    "FindingReport": "move joint hint",
    "EventReport": "move",
    "WorstOfRows": "move",
    "RowsReport": "worst",
    "Report": "savings",
    "PolynomialReport": "velocity acceleration",
    "PhaseReport": "joint",
    "ExplainedMove": "from_pose to_pose closed_form closed_form_derivatives blends arrivals waypoints outside path",
    "SavingReport": "share reason",
    "ReferenceReport": "joint reason",
    "PathReferenceReport": "ratio use own_use reason",
    "ConsumerFinding": "joint hint",
    "EffortReport": "head_room",
    "ZoneReport": "joint farthest deviation turn",
}


def test_what_is_not_known_or_not_there_can_stand_in_a_report() -> None:
    """A bound that is infinite, or a duration that was not found, is null within its list."""
    said = {
        (part, name)
        for part, kind in PARTS.items()
        for name, field in kind.model_fields.items()
        if re.search(r"\bnull\b", field.description or "", re.IGNORECASE)
    }
    assert len(said) > 30
    for part, name in sorted(
        said | {(part, n) for part, names in MAY_BE_NULL.items() for n in names.split()}
    ):
        annotation = PARTS[part].model_fields[name].annotation
        within = {"limit": (None, None), "found": [None]} if part != "ToolPeakReport" else {}
        given = within.get(name)
        assert TypeAdapter(annotation).validate_python(given) == given, (part, name)


def test_three_parts_alone_leave_out_what_there_is_not() -> None:
    """A program finds in each other part the same keys, whatever there is."""
    sparse = set()
    for part, kind in PARTS.items():
        empty = kind.model_construct(**dict.fromkeys(kind.model_fields)).model_dump(warnings=False)
        if empty.keys() != kind.model_fields.keys():
            sparse.add(part)
    assert sparse == {"PoseReport", "ScrewSegmentReport", "PathReport"}


@pytest.mark.parametrize(
    ("part", "field", "given", "written"),
    [
        ("PoseReport", "singular", False, "false"),
        ("PoseReport", "rank", {"here": 3}, '{"here":3}'),
        ("ExplainedMove", "binding_phases", True, "true"),
        ("ChoiceReport", "candidates", 8, "8"),
    ],
)
def test_truth_and_counts_are_written_as_such(part: str, field: str, given: Any, written: str) -> None:
    kind = TypeAdapter(PARTS[part].model_fields[field].annotation)
    assert kind.dump_json(kind.validate_python(given)).decode() == written
