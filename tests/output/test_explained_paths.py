"""Paths of the tool in explanations, against geometry that is written down by hand."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.job.explanation import PathReport
from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.planning.plan import plan_job

LIMITS = {
    "acceleration": "800 deg/s^2",
    "tcp": {"speed": 0.25, "acceleration": 1.5, "angular_speed": 1.5, "angular_acceleration": 9},
}


@cache
def _explained(text: str) -> Any:
    return explanation(plan_job(job_from_text(text), advise=False), derivatives=True)


def path_of(*moves: Any, turned: float = 0.0, units: Any = None) -> PathReport:
    """Return the path of the last of some moves of a tool that looks down, turned about the vertical."""
    start = {"xyz": ["0.4 m", "0.1 m", "0.3 m"], "rpy": ["180 deg", "0 deg", f"{turned} deg"]}
    job = {
        "version": 1,
        "units": units or {"angle": "deg"},
        "robot": "ur5e",
        "limits": LIMITS,
        "start": {**start, "configuration": {"elbow": "up"}},
        "moves": list(moves),
    }
    path = _explained(json.dumps(job)).moves[-1].path
    assert isinstance(path, PathReport)
    return path


@pytest.mark.parametrize(
    ("angle", "advance"), [(40, 0.05), (40, -0.05), (-40, 0.05), (-40, 0.0), (170, -0.05), (170, 0.0)]
)
def test_a_screw_is_that_about_the_axis_by_which_its_target_was_made(angle: float, advance: float) -> None:
    """About the vertical through (0.32, 0.04): the axis points where the turn is a right-handed one."""
    turn = np.radians(angle)
    away = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [0.08, 0.06]
    xyz = [0.32 + away[0], 0.04 + away[1], 0.3 + advance]
    move = {"planner": "screw", "to": {"xyz": xyz, "rpy": [180, 0, angle]}}
    (screw,) = path_of(move).segments
    up = np.sign(angle)
    assert screw.kind == "screw"
    assert screw.axis == pytest.approx([0, 0, up], abs=1e-9)
    assert (screw.angle, screw.advance) == pytest.approx((abs(angle), up * advance), abs=1e-9)
    assert screw.point is not None
    assert screw.point[:2] == pytest.approx([0.32, 0.04], abs=1e-9)


@pytest.mark.parametrize(
    ("turned", "stated"), [(0.0, True), (0.0, False), (20.0, True), (77.0, True), (77.0, False)]
)
def test_a_screw_that_does_not_turn_is_a_shift(turned: float, stated: bool) -> None:
    """Also where the target repeats the orientation: what rounding leaves of a turn has no axis."""
    rpy = {"rpy": [180, 0, turned]} if stated else {}
    (screw,) = path_of({"planner": "screw", "to": {"xyz": [0.4, 0.22, 0.25], **rpy}}, turned=turned).segments
    assert screw.kind == "screw"
    assert screw.axis == pytest.approx([0, 12 / 13, -5 / 13], abs=1e-9)
    assert (screw.angle, screw.point) == (0, None)
    assert screw.advance == pytest.approx(0.13)


def test_a_helix_has_its_centre_its_pitch_and_its_ends() -> None:
    """A turn and a half about an upright axis 50 mm beside the start, 20 mm up in each."""
    move = {"planner": "arc", "center": [0.4, 0.15, 0.3], "axis": "z", "angle": 540, "pitch": 0.02}
    path = path_of(move)
    (arc,) = path.segments
    assert (arc.kind, arc.unit, arc.angle_unit) == ("helix", "m", "deg")
    for found, wanted in (
        (arc.start, [0.4, 0.1, 0.3]),
        (arc.end, [0.4, 0.2, 0.33]),
        (arc.center, [0.4, 0.15, 0.3]),
        (arc.axis, [0, 0, 1]),
        ((arc.radius, arc.angle, arc.pitch), (0.05, 540, 0.02)),
        ((arc.length,), (np.hypot(3 * np.pi * 0.05, 0.03),)),
        ((path.length,), (arc.length,)),
    ):
        assert found == pytest.approx(wanted, abs=1e-9)
    (flat,) = path_of({**move, "pitch": 0, "angle": 90}).segments
    assert (flat.kind, flat.pitch) == ("arc", 0)


def test_a_turn_in_place_is_measured_by_its_angle() -> None:
    """The law is in degrees, with its derivatives: it ends at 30."""
    path = path_of({"planner": "line", "to": {"rpy": [180, 0, 30]}})
    (turn,) = path.segments
    assert (turn.kind, path.unit) == ("rotation", "deg")
    assert turn.place == pytest.approx([0.4, 0.1, 0.3])
    assert (turn.angle, path.length) == pytest.approx((30, 30))
    last = path.law[-1]
    assert np.polyval(last.absolute[::-1], last.end) == pytest.approx(30)
    assert last.velocity is not None
    assert last.velocity == pytest.approx(np.polyder(last.absolute[::-1])[::-1].tolist())


CORNER = [{"line": {"xyz": ["0.4 m", "0.2 m", "0.3 m"]}}, {"line": {"xyz": ["0.4 m", "0.2 m", "0.38 m"]}}]


def test_a_path_has_its_lines_and_its_corner() -> None:
    path = path_of(
        {"planner": "path", "segments": CORNER, "corner": "stop"}, units={"length": "mm", "angle": "deg"}
    )
    first, second = path.segments
    assert (first.start, first.end) == (pytest.approx([400, 100, 300]), pytest.approx([400, 200, 300]))
    assert (second.start, second.end) == (first.end, pytest.approx([400, 200, 380]))
    assert (first.length, second.length, path.length) == pytest.approx((100, 80, 180))
    (corner,) = path.corners
    assert (corner.kind, corner.turn, corner.radius, corner.deviation) == ("stop", pytest.approx(90), 0, 0)
    assert corner.point == pytest.approx([400, 200, 300])
    assert corner.place == pytest.approx(100)
    last = path.law[-1]
    assert np.polyval(last.absolute[::-1], last.end) == pytest.approx(180)


@pytest.mark.parametrize("kind", ["round", "overlap"])
def test_a_corner_that_is_cut_is_left_by_less_than_where_it_begins(kind: str) -> None:
    how = {"radius": 0.02} if kind == "round" else {"overlap": 0.1}
    path = path_of({"planner": "path", "segments": CORNER, "corner": kind, **how})
    (corner,) = path.corners
    assert corner.kind == {"round": "rounded"}.get(kind, kind)
    assert corner.point == pytest.approx([0.4, 0.2, 0.3])
    if kind == "round":
        assert corner.radius == pytest.approx(0.02)
        assert 0 < corner.deviation < corner.radius
        assert path.length < 0.18


@pytest.mark.full
def test_a_weave_is_told_by_the_parts_of_its_seam() -> None:
    """Of 100 mm and 80 mm between stops with cycles of about 20 mm: as many as fit, whole or half ones."""
    weave = {"amplitude": 0.003, "length": 0.021}
    move = {"planner": "path", "segments": CORNER, "corner": "stop", "weave": {**weave, "side": [1, 0, 0]}}
    path = path_of(move)
    found = path.weave
    assert found is not None
    assert (found.shape, found.amplitude) == ("sine", 0.003)
    assert [each.kind for each in path.segments] == ["line", "line"]
    for part, cycles, length in zip((0.1, 0.08), found.cycles, found.lengths, strict=True):
        assert 2 * cycles == round(part / 0.021 * 2)
        assert length * cycles == pytest.approx(part)
    (one,) = path_of({"planner": "line", "to": {"xyz": [0.4, 0.2, 0.3]}, "weave": weave}).segments
    assert (one.kind, one.length) == ("line", pytest.approx(0.1))
    assert path_of({"planner": "line", "to": {"xyz": [0.4, 0.2, 0.3]}}).weave is None
