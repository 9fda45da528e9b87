"""Paths of many segments: they plan, and cost as much as their segments."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few
from tool_jobs import DOWN, plan, poses_of, times_of

from trajcli.curves.hermite_fit import FitError, fit, most_pieces
from trajcli.geometry.rotation import exp

SIDE = 0.004
START = {"xyz": [0.4, 0.1, 0.3], "rpy": DOWN}


def corners(count: int) -> np.ndarray:
    """Return the ends (count, 3) of the lines of a zigzag."""
    k = np.arange(1, count + 1)
    row, column = np.divmod(k, 40)
    x = 0.4 + SIDE / 2 * np.where(row % 2, 40 - column, column)
    return np.stack([x, 0.1 + 0.75 * SIDE * (k % 2) + SIDE * row, np.full(count, 0.3)], axis=1)


def zigzag(count: int, **fields):
    segments = [{"line": {"xyz": xyz}} for xyz in corners(count).tolist()]
    return plan("ur5e", START, {"planner": "path", "segments": segments, **fields})


def distances(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Return how far points (N, 3) are from a polyline (k, 3)."""
    start, along = line[:-1], np.diff(line, axis=0)
    apart = points[:, None] - start
    part = np.clip((apart * along).sum(axis=-1) / (along**2).sum(axis=-1), 0, 1)
    return np.linalg.norm(apart - part[..., None] * along, axis=-1).min(axis=1)


@pytest.mark.full
def test_a_path_of_a_hundred_rounded_segments_is_planned():
    made = zigzag(100, radius=0.001, law={"shape": "trapezoid", "speed": 0.02, "acceleration": 0.1})
    points = poses_of(made, times_of(made, 2001))[:, :3, 3]
    line = np.vstack([START["xyz"], corners(100)])
    away = distances(points, line)
    assert away.max() < 0.001  # no further than the radius
    assert away.max() > 1e-5  # rounded
    np.testing.assert_allclose(points[-1], line[-1], atol=2e-6)


def test_pieces_are_allowed_by_the_breaks_of_a_path():
    assert most_pieces(np.array([0.0, 1.0])) == 4096
    assert most_pieces(np.arange(3001.0)) > 100 * 3000


@pytest.mark.full
@pytest.mark.parametrize("side", few(["left", "right"], 1))
def test_overlapping_segments_add_up_as_the_textbook_says(side):
    """Siciliano, eq. 4.43: p0 plus all that the segments have gone, those done and those not begun as well."""
    rng = np.random.default_rng(3)
    ends = corners(12).tolist()
    segments = [
        {"line": {"xyz": xyz, "rpy": (np.array(DOWN) + rng.normal(0, 0.02, 3)).tolist()}} for xyz in ends
    ]
    law = {"shape": "trapezoid", "speed": 0.01, "acceleration": 0.1}
    made = plan(
        "ur5e",
        START,
        {"planner": "path", "segments": segments, "corner": "overlap", "overlap": 0.05, "law": law},
    )
    motion = made.moves[0].planned.tool
    tool = motion.reference_at.__self__
    times = np.concatenate([rng.uniform(0, motion.law.end, 200), motion.breaks])
    reference = motion.reference_at(times, side)
    for k, time in enumerate(times.tolist()):
        p, rotation, velocity = tool.before[:3, 3].copy(), tool.before[:3, :3], np.zeros(3)
        for curve, vector, s_of_t in zip(tool.curves, tool.vectors, tool.laws, strict=True):
            inside = np.clip(time, s_of_t.start, s_of_t.end)
            s = float(s_of_t.evaluate(inside)[0])
            p += curve.direction * s
            rotation = rotation @ exp(vector * s / curve.length)
            if s_of_t.start < time < s_of_t.end:
                velocity += curve.direction * float(s_of_t.evaluate(inside, 1)[0])
        np.testing.assert_allclose(reference.poses[k, :3, 3], p, atol=1e-12)
        np.testing.assert_allclose(reference.poses[k, :3, :3], rotation, atol=1e-12)
        np.testing.assert_allclose(reference.first[k, :3], velocity, atol=1e-10)
    s_total = sum(
        np.clip(
            [[law.evaluate(np.clip(t, law.start, law.end))[0] for t in times] for law in tool.laws], 0, None
        )
    )
    np.testing.assert_allclose(motion.law.evaluate(times)[:, 0], s_total, atol=1e-12)


@pytest.mark.full
@pytest.mark.parametrize(
    "fields", [{"radius": 0.001}, {"corner": "stop"}, {"corner": "overlap", "overlap": 0.05}]
)
def test_each_segment_is_evaluated_as_often_in_a_long_path(fields, monkeypatch):
    """Three times the segments are three times the evaluations of a line, and rows for them."""
    from trajcli.geometry.paths import position

    law = {"shape": "trapezoid", "speed": 0.01, "acceleration": 0.1}
    evaluate, counted = position.Line.evaluate, []

    def counting(self, s, side="right"):
        counted.append(s.size)
        return evaluate(self, s, side)

    monkeypatch.setattr(position.Line, "evaluate", counting)
    costs = []
    for count in (12, 36):
        counted.clear()
        zigzag(count, law=law, **fields)
        costs.append((len(counted), sum(counted)))
    assert (np.array(costs[1]) < 3.6 * np.array(costs[0])).all(), costs


def test_a_fit_that_needs_too_many_pieces_says_so():
    def noise(points, side, guess):
        class Known:
            values = np.stack([np.sin(1e6 * points**2)[:, None]] * 3)

        return Known()

    with pytest.raises(FitError):
        fit(
            noise,
            lambda known, rows, fitted: np.full(len(rows), 9.0),
            np.linspace(0, 1, 3),
            lambda p: np.zeros((p.size, 1)),
        )
