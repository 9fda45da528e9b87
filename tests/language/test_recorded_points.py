"""Recorded points and poses: which of them a move passes, and when, by hand and by what merging promises."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from tiers import few

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.language.recorded import Recorded, RecordedPoses

START = np.array([1.0, -2.0])


def points(
    *rows: tuple[float, float], times: list[float] | None = None, merge: tuple[float, ...] = ()
) -> Recorded:
    return Recorded(np.array(rows), None if times is None else np.array(times), merge=merge)


BEGIN = [  # first of two points, merge, whether it is where the arm stands
    ((1.0, -2.0), (), True),
    ((1.0, -2.1), (), False),
    ((1.1, -2.0), (), False),
    ((0.9, -2.0), (), False),
    ((0.9, -2.3), (0.2, 0.5), True),
    ((1.1, -1.7), (0.2, 0.5), True),
    ((0.7, -2.0), (0.2, 0.5), False),
    ((1.0, -1.4), (0.2, 0.5), False),
]


@pytest.mark.parametrize(("first", "merge", "stands"), BEGIN)
def test_a_first_point_where_the_arm_stands_is_the_start(
    first: tuple[float, float], merge: tuple[float, ...], stands: bool
) -> None:
    far = (5.0, 5.0)
    both = points(first, far, times=[4.0, 7.0], merge=merge)
    assert both.begins_at(START) == stands
    after = both.after(START)
    assert after.positions.tolist() == ([list(far)] if stands else [list(first), list(far)])
    assert after.times is not None
    assert after.times.tolist() == ([3.0] if stands else [4.0, 7.0])
    alone = points(first, times=[4.0], merge=merge)
    assert not alone.begins_at(START)
    assert alone.after(START).positions.tolist() == [list(first)]


def test_points_that_are_one_are_left_out_unless_times_say_that_the_arm_waits() -> None:
    rows = [(1.0, -2.0), (1.5, -2.0), (1.5, -2.0 + 1e-10), (1.5, -2.0), (2.0, 0.0), (2.0, 0.0)]
    assert points(*rows).after(START).positions.tolist() == [[1.5, -2.0], [2.0, 0.0]]
    waits = points(*rows, times=[0, 1, 2, 3, 4, 5]).after(START)
    assert waits.positions.tolist() == [list(row) for row in rows[1:]]
    assert waits.times is not None
    assert waits.times.tolist() == [1, 2, 3, 4, 5]
    merged = points(*rows, times=[0, 1, 2, 3, 4, 5], merge=(0.0, 1e-3)).after(START)
    assert merged.times is not None
    assert merged.positions.tolist() == [[1.5, -2.0], [2.0, 0.0]]
    assert merged.times.tolist() == [1, 5]


def test_the_last_point_before_a_target_is_left_out_where_they_are_one() -> None:
    rows = points((1.5, -2.0), (2.0, 0.0))
    assert rows.after(START, np.array([2.0, 0.0])).positions.tolist() == [[1.5, -2.0]]
    assert rows.after(START, np.array([2.0, 0.1])).positions.tolist() == [[1.5, -2.0], [2.0, 0.0]]
    assert rows.after(START).positions.tolist() == [[1.5, -2.0], [2.0, 0.0]]


@pytest.mark.parametrize("seed", few(range(40)))
def test_what_merging_promises(seed: int) -> None:
    """Each point is far from the one before but for the end; what is left out is near to one that was kept."""
    rng = np.random.default_rng(seed)
    merge = rng.uniform(0.2, 1.0, 3)
    walk = np.cumsum(rng.normal(0, 0.5, (60, 3)), axis=0)
    for kind in ("joints", "tool"):
        if kind == "joints":

            def far(step: np.ndarray) -> bool:
                return bool((np.abs(step) > merge).any())

            kept = Recorded(walk, np.arange(60.0), merge=tuple(merge.tolist())).after(np.full(3, 9.0))
            rows = kept.positions
            assert kept.times is not None
            np.testing.assert_array_equal(walk[kept.times.astype(int)], rows)
        else:

            def far(step: np.ndarray) -> bool:
                return bool(np.sqrt((step**2).sum()) > merge[0])

            turns = rng.normal(size=(60, 4))
            turns /= np.linalg.norm(turns, axis=1)[:, None]
            poses = RecordedPoses(walk, turns, merge=float(merge[0])).after(np.full(3, 9.0))
            rows = poses.positions
            assert poses.quaternions is not None
            places = [int(np.flatnonzero((walk == row).all(axis=1))[0]) for row in rows]
            np.testing.assert_array_equal(turns[places], poses.quaternions)
        index = [int(np.flatnonzero((walk == row).all(axis=1))[0]) for row in rows]
        assert index == sorted(set(index))
        assert index[0] == 0
        assert index[-1] == 59
        assert 1 < len(index) < 59
        assert all(far(walk[b] - walk[a]) for a, b in pairwise(index[:-1]))
        for a, b in pairwise(index[:-1]):
            assert not any(far(walk[row] - walk[a]) for row in range(a + 1, b))


def test_poses_begin_where_the_tool_is_within_nine_decimals() -> None:
    at = np.array([0.1, 0.2, 0.3])
    other = at + np.array([0, 1, 0])
    for off, merge, stands in (
        (9e-9, 0.0, True),
        (1.1e-8, 0.0, False),
        (0.009, 0.01, True),
        (0.011, 0.01, False),
    ):
        diagonal = np.array([3, 0, 4]) / 5 * off
        poses = RecordedPoses(np.array([at + diagonal, other, other]), merge=merge)
        assert poses.begins_at(at) == stands
        expected = [other] * (1 if merge else 2)
        np.testing.assert_array_equal(poses.after(at).positions[-len(expected) :], expected)
        assert len(poses.after(at).positions) == len(expected) + (not stands)
    assert not RecordedPoses(at[None]).begins_at(at)
    steps = at + np.outer([0, 1, 2, 3, 3.001], [0, 1, 0])
    for first in (0, 1):  # the start itself among them, or not
        for points in (RecordedPoses(steps[first:], merge=0.01), Recorded(steps[first:], merge=(0.01,) * 3)):
            np.testing.assert_array_equal(points.after(at).positions, steps[[1, 2, 4]])
    turned = RecordedPoses(np.array([at, other]), np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0]])).after(at)
    assert turned.quaternions is not None
    assert turned.quaternions.tolist() == [[0, 1, 0, 0]]


def test_recordings_are_the_same_where_all_that_moves_the_arm_is() -> None:
    one = points((1, 2), (3, 4), times=[0, 1], merge=(0.1,))
    same = Recorded(one.positions, one.times, "another file", one.merge)
    assert (one == same, hash(one) == hash(same)) == (True, True)
    assert one != points((1, 2), (3, 5), times=[0, 1], merge=(0.1,))
    assert one != points((1, 2), (3, 4), times=[0, 2], merge=(0.1,))
    assert one != points((1, 2), (3, 4), merge=(0.1,))
    assert one != points((1, 2), (3, 4), times=[0, 1])
    pose = RecordedPoses(np.eye(3), np.eye(4)[:3], merge=0.1)
    assert pose == RecordedPoses(np.eye(3), np.eye(4)[:3], "another file", 0.1)
    assert pose != RecordedPoses(np.eye(3), np.eye(4)[1:], merge=0.1)
    assert pose != RecordedPoses(np.eye(3), merge=0.1)
    assert pose != RecordedPoses(np.eye(3), np.eye(4)[:3])
    assert pose != RecordedPoses(2 * np.eye(3), np.eye(4)[:3], merge=0.1)


HEAD = "version: 1\nunits: {angle: deg}\nrobot: {joints: 2}\nstart: {joints: 0}\nmoves:\n"
TABLES = [  # through, message, what it points at
    ("{positions: [[1, 2], [3]]}", "expected 2 values, one for each joint, got 1", "[3]"),
    ("{positions: [[1, 2], {j1: 3}]}", "no value for j2", "{j1"),
    ("{positions: [[1, 2], [3, x]]}", "expected an angle", "x]"),
    ("{positions: []}", "expected a list of rows of joint values, got a list", "[]"),
    ("{positions: 3}", "expected a list of rows of joint values, got 3", "3}"),
    ("{positions: [1, 2], times: [1]}", "expected 2 numbers, got 1 values", "[1]}"),
    ("{positions: [1, 2, 3], times: [1, 3, 2]}", "times must increase", "2]}"),
    ("{positions: [1, 2, 3], times: [1, 1, 1]}", "times must increase", "1, 1]}"),
    ("{positions: [1, 2], times: [1, 2 deg]}", "expected a time", "2 deg"),
    ("{positions: [1, 2], merge: -1}", "at least 0 deg, got -1", "-1"),
    ("{positions: [1, 2], merge: [1, 2, 3]}", "expected 2 values", "[1, 2, 3]"),
    ("{positions: [1, 2], csv: a.csv}", "expected a list of waypoints, {csv: PATH} or", "{pos"),
    ("{merge: 1}", "expected a list of waypoints, {csv: PATH} or", "{merge"),
    ("{csv: a.csv, times: [1]}", "a file's times stand in its column t", "[1]"),
    ("{csv: 3}", "expected the path of a file, got 3", "3}"),
    ("{position: [1, 2]}", "unknown key 'position'", "position"),
    ("[{velocity: 3}, {joints: 1}]", "a waypoint needs `joints` or a pose", "{vel"),
    ("[{joints: 1, time: 0}]", "expected a number above 0 s, got 0", "0}"),
]  # fmt: skip


@pytest.mark.parametrize(("through", "message", "at"), TABLES)
def test_wrong_tables_are_refused_where_they_are_wrong(through: str, message: str, at: str) -> None:
    with pytest.raises(InputError) as caught:
        job_from_text(f"{HEAD}  - {{planner: spline, through: {through}}}\n", "job.yaml")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith(at)


def test_times_of_a_table_are_times_in_any_unit() -> None:
    text = "{positions: [[1, 2], {j2: 90, j1: -1}], times: [500 ms, 0.1 min]}"
    job = job_from_text(f"{HEAD}  - {{planner: spline, through: {text}}}\n")
    (move,), (same,) = job.job.moves, job_from_text(dump_job(job)).job.moves
    assert move.through == same.through  # type: ignore[attr-defined]
    assert move.through.times.tolist() == [0.5, 6.0]  # type: ignore[attr-defined]
    assert np.degrees(move.through.positions).ravel() == pytest.approx([1, 2, -1, 90])  # type: ignore[attr-defined]
