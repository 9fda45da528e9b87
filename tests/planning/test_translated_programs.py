"""Six programs of other languages, and the job beside each: as short, and the same stops, speeds, loads and signals.

Where the tool is, is asked of products of matrices that share nothing with what planned; where it should be, of the
numbers in the original.
"""

from __future__ import annotations

import re
from functools import cache
from math import cos, radians, sin

import numpy as np
import pytest
from independent_motion import fixed, poses, product, tool_rates
from planned_examples import planned_once
from tiers import few

from docs.markdown import ROOT, blocks
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan

PAGE = (ROOT / "docs/from-other-languages.md").read_text(encoding="utf-8")
SECTIONS = PAGE.partition("\n## Six programs\n")[2].split("\n### ")[1:]
TITLES = [section.partition("\n")[0] for section in SECTIONS]
COMMENT = re.compile(r"\s*(!|;|#|//|--eg)")
ALLOWED = 1.5  # lines of a job for each of the original


def texts(title: str) -> tuple[str, str]:
    """Return the original and the job of a section."""
    (section,) = (section for section in SECTIONS if section.startswith(title))
    original, job = blocks(section)
    assert (original.language, job.language) == ("text", "yaml")
    return original.text, job.text


@cache
def plan_of(title: str) -> Plan:
    (whole,) = (known for known in TITLES if known.startswith(title))
    return planned_once(job_from_text(texts(whole)[1]))


def count(text: str) -> int:
    return sum(bool(line.strip()) and not COMMENT.match(line) for line in text.splitlines())


def tool_at(plan: Plan, times: np.ndarray, move: int = -1) -> np.ndarray:
    """Return poses (N, 4, 4) of the tcp, m."""
    robot, q = plan.moves[move].robot, np.zeros((1, len(times), plan.trajectory.curve.dimension))
    q[0] = plan.trajectory.curve.evaluate(times)
    return np.asarray(product(poses(robot, q)[1][-1], fixed(robot.tool, q))[0])


def stops(plan: Plan) -> np.ndarray:
    """Return where the tool stands at rest behind the start, one after the other, (N, 3), mm."""
    ends = np.array([span.end for span in plan.trajectory.spans])
    rest = np.abs(plan.trajectory.curve.evaluate(ends, 1)).max(axis=1) < 1e-9
    places = tool_at(plan, np.concatenate([[0.0], ends[rest]]))[:, :3, 3] * 1e3
    return places[1:][np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-3]


def top_speed(plan: Plan, move: int) -> float:
    """Return the largest speed of the tool in a move, mm/s."""
    span, curve = plan.trajectory.spans[move], plan.trajectory.curve
    times = np.linspace(span.start, span.end, 1001)
    series = np.stack([curve.evaluate(times, k) / [1, 1, 2, 6][k] for k in range(4)])
    return float(tool_rates(plan.moves[move].robot, series)[:, 0].max() * 1e3)


def turned(angle: float, x: float, y: float, z: float) -> np.ndarray:
    """Return a vector turned about z, in deg."""
    a = radians(angle)
    return np.array([cos(a) * x - sin(a) * y, sin(a) * x + cos(a) * y, z])


def signal_times(plan: Plan) -> list[tuple[float, float]]:
    (signal,) = plan.trajectory.signals
    return [(change.time, change.value) for change in signal.changes]


def palletised() -> list[np.ndarray]:
    infeed, up, places = np.array([1200, -700, 800]), np.array([0, 0, 200]), []
    for row in range(2):
        for column in range(2):
            slot = np.array([900, 400, 450]) + turned(-30, 400 * column, 300 * row, 0)
            places += [infeed + up, infeed, infeed + up]
            places += [slot + up, slot, slot + up]
    return [*places, np.array([960 + 135 + 40, 0, 495 + 900 + 175 - 135 - 150])]  # all at zero, the hand down


def glued() -> list[np.ndarray]:
    corners = [(0, 0, 60), (0, 0, 2), (0, 150, 2), (120, 150, 2), (120, 0, 2), (60, 0, 2), (60, 0, 60)]
    home = np.array([25 + 420, 0, 400 + 455 + 35 - 80 - 160])
    return [*(np.array([500, -120, 250]) + corner for corner in corners), home]


def loaded_parts() -> list[np.ndarray]:
    chuck, up, places = np.array([150, 550, 300]), np.array([0, 0, 80]), []
    for part in range(3):
        pick = np.array([350, -250, 100]) + turned(30, 60 * part, 0, 0)
        places += [pick + up, pick, pick + up]
        places += [chuck - [0, 120, 0], chuck, chuck - [0, 120, 0]]
    return places


def welded() -> list[np.ndarray]:
    corners = [(0, 0, 50), (0, 0, 0), (40, 0, 0), (40, 0, 50), (100, 50, 0), (160, 50, 0), (160, 50, 50)]
    return [np.array([400, -60, 200]) + turned(10, *corner) for corner in corners]


STOPS = {
    "RAPID: a part": [np.array(place) for place in [(400, 100, 140), (400, 100, 220)]],
    "RAPID: a palletiser": palletised(),
    "KRL": glued(),
    "URScript": loaded_parts(),
    "FANUC": welded(),
    "Pilz": [
        np.array(place)
        for place in [
            (450, -200, 350),
            (450, -200, 250),
            (450, 100, 350),
            (450, 300, 350),
            (450, 300, 250),
            (450, 300, 350),
        ]
    ],
}
BACK_AT_START = {"URScript", "FANUC"}  # whose last stop is where the arm began


def test_there_are_six_programs_of_five_languages() -> None:
    assert len(TITLES) == len(STOPS) == 6
    assert {title.partition(":")[0] for title in TITLES} == {"RAPID", "KRL", "URScript", "FANUC", "Pilz"}


@pytest.mark.parametrize("title", TITLES)
def test_a_job_is_as_short_as_its_original(title: str) -> None:
    original, job = texts(title)
    assert count(job) <= ALLOWED * count(original)
    assert count("! a\n\n; b\n  # c\nx ; d\n") == 1


@pytest.mark.parametrize(
    "title", few(["RAPID: a part", "FANUC", "Pilz", "KRL", "URScript", "RAPID: a palletiser"], 2)
)
def test_the_arm_stops_where_the_original_says(title: str) -> None:
    plan = plan_of(title)
    assert plan.verdict.passed
    assert plan.events == ()
    found, expected = stops(plan), STOPS[title]
    if title in BACK_AT_START:
        start = tool_at(plan, np.zeros(1))[:, :3, 3] * 1e3
        np.testing.assert_allclose(found[-1:], start, atol=1e-6)
        found = found[:-1]
    assert len(found) == len(expected)
    np.testing.assert_allclose(found, expected, atol=2e-3)  # angles in the originals have five digits


def test_a_table_is_flown_to_within_its_zone_with_the_tool_down() -> None:
    plan = plan_of("RAPID: a part")
    first, second = plan.trajectory.spans[:2]
    times = np.linspace(0, second.end, 4001)
    away = np.linalg.norm(tool_at(plan, times)[:, :3, 3] * 1e3 - [400, 100, 220], axis=1)
    assert 0.5 < away.min() < 10
    assert abs(times[away.argmin()] - first.end) < 2e-3
    np.testing.assert_allclose(tool_at(plan, np.array([second.end]))[0, :3, 2], [0, 0, -1], atol=1e-6)
    assert top_speed(plan, 4) == pytest.approx(250, abs=0.01)
    assert signal_times(plan) == [(pytest.approx(second.end), 1.0)]
    hold = plan.trajectory.spans[3]
    assert hold.end - hold.start == pytest.approx(0.3)


@pytest.mark.full
def test_a_palletiser_carries_its_boxes_from_the_infeed_to_the_slots() -> None:
    plan = plan_of("RAPID: a palletiser")
    carrying = [(span.payload.mass if span.payload else 0.0) for span in plan.trajectory.spans]
    begun = [n for n, mass in enumerate(carrying) if mass and not carrying[n - 1]]
    ended = [n for n, mass in enumerate(carrying) if mass and not carrying[n + 1]]
    assert set(carrying) == {0.0, 12.0}
    original, job = texts(next(title for title in TITLES if title.startswith("RAPID: a palletiser")))
    assert "lBox := [12, [0, 0, 100]" in original  # the cog of a loaddata counts from the tcp, as com does
    assert "mass: 12, com: [0, 0, 100]" in job
    ends = np.array([plan.trajectory.spans[n].end for n in ended])
    taken = np.array([plan.trajectory.spans[n].start for n in begun])
    np.testing.assert_allclose(tool_at(plan, taken)[:, :3, 3], [[1.2, -0.7, 0.8]] * 4, atol=1e-6)
    slots = np.array(palletised())[4::6] / 1e3
    np.testing.assert_allclose(tool_at(plan, ends)[:, :3, 3], slots, atol=2e-6)


def test_a_bead_has_the_speed_and_the_round_end_of_the_original() -> None:
    plan = plan_of("KRL")
    assert [top_speed(plan, move) for move in (2, 3, 4)] == pytest.approx([120] * 3, abs=0.01)
    arc = plan.trajectory.spans[3]
    round_end = tool_at(plan, np.linspace(arc.start, arc.end, 101))[:, :3, 3] * 1e3 - [560, 30, 252]
    np.testing.assert_allclose(np.linalg.norm(round_end, axis=1), 60, atol=2e-3)
    assert round_end[:, 1].min() > -2e-3
    arrival, last = plan.trajectory.spans[1].end, plan.trajectory.spans[5].end
    assert signal_times(plan) == [(pytest.approx(arrival - 0.03), 1.0), (pytest.approx(last), 0.0)]


@pytest.mark.full
def test_parts_are_gripped_at_the_tray_and_let_go_in_the_chuck() -> None:
    plan = plan_of("URScript")
    times, values = zip(*signal_times(plan), strict=True)
    assert values == (1, 0, 1, 0, 1, 0)
    places = tool_at(plan, np.array(times))
    home = [-0.3922 - 0.0997, -0.1333, 0.1625 + 0.425 - 0.0996 - 0.14]  # in the maker's Base, by its DH table
    np.testing.assert_allclose(tool_at(plan, np.zeros(1))[0, :3, 3], home, atol=1e-5)
    expected = np.array(loaded_parts()) / 1e3
    np.testing.assert_allclose(places[:, :3, 3], expected[[1, 4, 7, 10, 13, 16]], atol=2e-6)
    np.testing.assert_allclose(places[1::2, :3, 2], [[0, 1, 0]] * 3, atol=1e-5)
    assert [top_speed(plan, move) for move in (1, 6)] == pytest.approx([100, 50], abs=0.01)
    moves = [
        plan.trajectory.curve.evaluate(np.linspace(s.start, s.end, 501), 1)
        for s in plan.trajectory.spans[::5]
    ]
    assert max(float(np.abs(rates).max()) for rates in moves) == pytest.approx(1.05, rel=1e-3)


@pytest.mark.full
def test_a_weave_goes_to_both_sides_of_its_seam_alike() -> None:
    plan = plan_of("FANUC")
    seam = plan.trajectory.spans[3]
    tool = tool_at(plan, np.linspace(seam.start, seam.end, 8001))[:, :3, 3] * 1e3 - [400, -60, 200]
    along, across = np.array([turned(-10, *place)[:2] for place in tool]).T
    assert (across.max(), across.min()) == pytest.approx((2, -2), abs=0.01)
    whole = np.interp(np.linspace(4, 36, 4001)[:-1], along, across)
    assert abs(whole.mean()) < 0.01
    assert np.count_nonzero(np.diff(np.sign(whole))) == pytest.approx(16, abs=1)  # twice each 4 mm
    bead = plan.trajectory.spans[9]
    places = tool_at(plan, np.linspace(bead.start, bead.end, 101))[:, :3, 3] * 1e3
    center = np.array([400, -60, 200]) + turned(10, 130, 50, 0)
    np.testing.assert_allclose(np.linalg.norm(places - center, axis=1), 30, atol=2e-3)
    assert top_speed(plan, 9) == pytest.approx(10, abs=0.001)


@pytest.mark.full
def test_a_part_goes_over_the_edge_on_a_circle() -> None:
    plan = plan_of("Pilz")
    over = plan.trajectory.spans[4]
    places = tool_at(plan, np.linspace(over.start, over.end, 101))[:, :3, 3]
    np.testing.assert_allclose(places[:, 0], 0.45, atol=2e-6)
    np.testing.assert_allclose(np.hypot(places[:, 1] - 0.2, places[:, 2] - 0.35), 0.1, atol=2e-6)
    assert places[:, 2].max() == pytest.approx(0.45, abs=1e-4)
    assert [top_speed(plan, move) for move in (1, 4, 5)] == pytest.approx([100, 200, 100], abs=0.01)
    corner = plan.trajectory.spans[2].end
    times = np.linspace(corner - 0.3, corner + 0.3, 601)
    away = np.linalg.norm(tool_at(plan, times)[:, :3, 3] - [0.45, -0.2, 0.35], axis=1)
    assert 1e-3 < away.min() < 0.03
