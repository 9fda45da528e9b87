"""Marks of a page: zones against the kinematics of the programmed corners, signals, what is taken up and left."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planned_examples import flown_cell, planned_example

from tests.player.test_loads import PENDULUM
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import plan_job
from trajcli.player.marks import zones_of
from trajcli.player.scene import scene_of_plan


@pytest.fixture(scope="module")
def cell() -> dict[str, Any]:
    return scene_of_plan(flown_cell())


def test_a_zone_is_a_ball_about_its_corner(cell: dict[str, Any]) -> None:
    plan = flown_cell()
    assert len(cell["zones"]) == 2
    robot, curve = plan.loaded.robot, plan.trajectory.curve
    for zone in cell["zones"]:
        *corner, radius = zone["ball"]
        programmed = np.array(zone["programmed"])
        assert np.linalg.norm(programmed - corner, axis=1).min() < 1e-6
        ends = forward(robot, curve.evaluate(np.array([zone["start"], zone["end"]])))[:, :3, 3]
        # Flown and programmed path meet at the borders, at most the radius from the corner.
        assert programmed[[0, -1]] == pytest.approx(ends, abs=2e-6)
        assert np.linalg.norm(ends - corner, axis=1).max() <= radius * (1 + 1e-5)
        assert np.linalg.norm(ends - corner, axis=1).max() == pytest.approx(radius, rel=1e-4)


def test_zones_that_are_not_drawn_are_said(cell: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    assert not [note for note in cell["notes"] if "zones" in note]
    monkeypatch.setattr("trajcli.player.marks.MOST_ZONES", 1)
    scene = scene_of_plan(flown_cell())
    assert scene["zones"] == cell["zones"][:1]
    assert "Of 2 zones the first 1 are drawn." in scene["notes"]


def test_a_zone_says_what_it_uses_of_what_was_asked_and_when_its_corner_is_passed(
    cell: dict[str, Any],
) -> None:
    plan = flown_cell()
    flown = () if plan.flyby is None else plan.flyby.zones
    for zone, own in zip(cell["zones"], flown, strict=True):
        said = re.match(r"(\S+) mm of (\S+) mm \(position\)", zone["message"])
        assert said is not None
        used, asked = map(float, said.groups())
        assert 1000 * zone["ball"][3] == pytest.approx(used, rel=1e-3)
        assert (used, asked) == pytest.approx((1000 * own.used, 1000 * own.asked), rel=1e-3)
        times = np.linspace(zone["start"], zone["end"], 2001)
        tool = forward(plan.loaded.robot, plan.trajectory.curve.evaluate(times))[:, :3, 3]
        nearest = times[np.linalg.norm(tool - zone["ball"][:3], axis=1).argmin()]
        assert zone["time"] == pytest.approx(nearest, abs=0.2 * (zone["end"] - zone["start"]))


def test_points_have_their_names(cell: dict[str, Any]) -> None:
    names = [point["name"] for point in cell["waypoints"]]
    assert names == ["home", "above_pick", "above_place"]


GLUE = """
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: null}
defaults: {law: {speed: 150}}
start: {joints: [0, -90, 90, -90, -90, 0]}
moves:
  - {planner: quintic, to: {from: here, offset: {xyz: [0, 0, 60]}}, at: {signal: pressure, value: 2.5, before: 0.2}}
  - planner: line
    to: {from: here, offset: {xyz: [120, 0, 0]}}
    at:
      - {signal: glue, value: 1, when: {path: 10}, before: 20 ms}
      - {signal: glue, value: 0.6, when: {path: 60}}
      - {signal: glue, value: 1, when: {path: 90}}
  - {planner: line, to: {from: here, offset: {xyz: [0, 80, 0]}}, at: {signal: glue, value: 0, when: {path: -10}}}
  - {signal: pressure, value: 0}
  - {planner: quintic, to: {from: here, offset: {xyz: [0, 0, -60]}}}
"""
"""As examples/signals.yaml, which takes seconds to fly by its corner."""


@pytest.mark.parametrize("name", [None, pytest.param("signals", marks=pytest.mark.full)])
def test_signals_and_the_entries_that_set_them(name: str | None) -> None:
    scene = scene_of_plan(plan_job(job_from_text(GLUE)) if name is None else planned_example(name))
    pressure, glue = scene["signals"]
    assert [change["value"] for change in pressure["changes"]] == [2.5, 0]
    assert [change["value"] for change in glue["changes"]] == [1, 0.6, 1, 0]
    (mark,) = scene["marks"]
    assert mark["label"] == "signal: pressure = 0"
    assert mark["time"] == pressure["changes"][1]["time"]
    assert 3 not in [move["index"] for move in scene["moves"]]


def test_attach_and_detach_are_marks_and_no_moves() -> None:
    plan = planned_example("pick_carry_place")
    scene = scene_of_plan(plan)
    assert [(mark["index"], mark["label"]) for mark in scene["marks"]] == [(1, "attach: 5 kg"), (3, "detach")]
    assert [mark["time"] for mark in scene["marks"]] == [plan.trajectory.spans[i].start for i in (1, 3)]
    assert [move["index"] for move in scene["moves"]] == [0, 2, 4]


def test_what_is_taken_up_says_its_mass_and_a_tool_does_not() -> None:
    text = PENDULUM.replace("gravity:", "tools: {gun: {xyz: [0, 0, 0], mass: 2}}\ngravity:").replace(
        "mass: 1.2,", "mass: 1.2345,"
    )
    more = "  - {tool: gun}\n  - {signal: glue, value: 0.25}\n  - {signal: lamp, value: 1}\n"
    more += "  - {planner: trapezoid, to: {joints: [-20]}}\n  - {planner: trapezoid, to: {joints: [0]}}\n"
    scene = scene_of_plan(plan_job(job_from_text(text + more)))
    labels = {mark["index"]: mark["label"] for mark in scene["marks"]}
    assert labels == {1: "attach: 1.234 kg", 3: "gun (tool)", 4: "signal: glue = 0.25", 5: "signal: lamp = 1"}
    assert [change["label"] for signal in scene["signals"] for change in signal["changes"]] == [
        "move 4 (signal)",
        "move 5 (signal)",
    ]


def test_words_of_a_zone(cell: dict[str, Any]) -> None:
    """By quantity: its size in the job's units, how near the tool comes, and what binds."""
    plan = flown_cell()
    assert plan.flyby is not None
    assert [zone["label"] for zone in cell["zones"]] == [
        f"zone {k + 1}, {plan.loaded.called(zone.move)}:" for k, zone in enumerate(plan.flyby.zones)
    ]
    first, second = plan.flyby.zones
    fields = {"used": 0.1, "asked": 0.2, "binds": "velocity of some joint"}
    zones = (
        replace(first, of="position", nearest=0.012345, **fields),
        replace(second, of="orientation", nearest=None, **fields),
        replace(second, of="joints", joint=2, nearest=None, **fields),
    )
    shown = zones_of(replace(plan, flyby=replace(plan.flyby, zones=zones)))
    near, ending = "the tool comes to 12.3 mm from the corner; ", "binding: velocity of some joint"
    assert [each["message"] for each in shown] == [
        f"100 mm of 200 mm (position); {near}{ending}",
        f"5.73 deg of 11.46 deg (orientation); {ending}",
        f"5.73 deg of 11.46 deg (elbow_joint); {ending}",
    ]
    assert [each["ball"] is None for each in shown] == [False, True, True]
    many = zones_of(replace(plan, flyby=replace(plan.flyby, zones=zones * 150)))
    assert len(many) == 400  # a page of more would be large


def test_a_zone_is_drawn_by_the_tool_of_its_own_move() -> None:
    plan = flown_cell()
    assert plan.flyby is not None
    zone = plan.flyby.zones[1]
    longer = plan.loaded.robot.tool @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    moves = [
        replace(move, robot=replace(move.robot, tool=longer)) if k == zone.move else move
        for k, move in enumerate(plan.moves)
    ]
    drawn = zones_of(replace(plan, moves=tuple(moves)))[1]
    places = forward(replace(plan.loaded.robot, tool=longer), zone.programmed)[:, :3, 3]
    assert np.array(drawn["programmed"]) == pytest.approx(places, abs=1e-6)
