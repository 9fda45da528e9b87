"""Marks of a page: zones against the kinematics of the programmed corners, signals, what is taken up and left."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from planned_examples import flown_cell, planned_example

from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import plan_job
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
