"""What of a move stands in which of its parts: retreat, the move itself, approach; grids count by hand."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text

HEAD = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {acceleration: 800, jerk: 4000, tcp: {acceleration: 3000}}
start: {joints: [0, -90, 90, -90, -90, 0]}
points:
  pose: {xyz: [450, 100, 300], rpy: [180, 0, 0]}
  taught: {joints: [10, -90, 90, -90, -90, 0]}
"""


def moves_of(text: str, head: str = HEAD) -> list[Any]:
    return list(job_from_text(f"{head}{text}", "job.yaml").job.moves)


def test_fields_go_to_the_part_that_they_are_for() -> None:
    """The zone and signals of a move are those of its target; those of a straight part are of its own end."""
    move = (
        "moves: [{planner: jerk_limited, to: pose, label: pick, limits: {velocity: 30}, when_over_limit: slow, "
        "minimum_duration: 2, zone: 7, at: {signal: a, value: 1}, "
        "retreat: {distance: 20, axis: x, frame: world, law: {speed: 9}, zone: 3}, "
        "approach: {distance: 40, law: {speed: 8}, zone: 5}}]\n"
    )
    retreat, itself, approach = moves_of(move)
    assert [each.tag for each in (retreat, itself, approach)] == ["line", "jerk_limited", "line"]
    for part in (retreat, itself, approach):
        assert (part.label, part.when_over_limit) == ("pick", "slow")
        assert part.limits.velocity[0] == pytest.approx((-np.radians(30), np.radians(30)))
    assert [part.zone.position for part in (retreat, itself, approach)] == pytest.approx(
        [0.003, 0.005, 0.007]
    )
    assert [len(part.at or ()) for part in (retreat, itself, approach)] == [0, 0, 1]
    assert itself.minimum_duration == 2
    assert [part.law.speed for part in (retreat, approach)] == pytest.approx([0.009, 0.008])
    assert [part.law.shape for part in (retreat, approach)] == ["time_optimal"] * 2
    assert retreat.to.relative.origin == "here"
    np.testing.assert_allclose(np.array(retreat.to.relative.offset)[:3, 3], [0.02, 0, 0])
    assert retreat.to.relative.in_world
    np.testing.assert_allclose(itself.to.full_pose()[:3, 3], [0.45, 0.1, 0.34], atol=1e-15)  # z looks down
    np.testing.assert_allclose(approach.to.full_pose()[:3, 3], [0.45, 0.1, 0.3], atol=1e-15)


AXES = [("x", [1, 0, 0]), ("-x", [-1, 0, 0]), ("y", [0, 1, 0]), ("-y", [0, -1, 0]), ("z", [0, 0, 1]), ("-z", [0, 0, -1]),
        ("[0, 3, -4]", [0, 0.6, -0.8])]  # fmt: skip


@pytest.mark.parametrize(("axis", "vector"), AXES)
@pytest.mark.parametrize(
    ("frame", "turn"),
    [("world", np.eye(3)), ("tool", np.diag([1, -1, -1])), ("f", [[0, -1, 0], [1, 0, 0], [0, 0, 1]])],
)
def test_the_point_before_is_the_target_plus_distance_times_axis(
    axis: str, vector: list[float], frame: str, turn: Any
) -> None:
    text = f"moves: [{{planner: quintic, to: pose, approach: {{distance: 3 cm, axis: {axis}, frame: {frame}}}}}]\n"
    before, last = moves_of(f"frames: {{f: {{rpy: [0, 0, 90]}}}}\n{text}")
    expected = np.array([0.45, 0.1, 0.3]) + 0.03 * np.array(turn) @ vector
    np.testing.assert_allclose(before.to.full_pose()[:3, 3], expected, atol=1e-15)
    np.testing.assert_allclose(last.to.full_pose()[:3, 3], [0.45, 0.1, 0.3], atol=1e-15)


def test_a_target_is_met_from_the_point_before_it() -> None:
    """One in motion is none: a line ends at rest, which is said once."""
    for rate in ("velocity: 5", "acceleration: 6", "time: 6"):
        for target in ("joints: [10, -90, 90, -90, -90, 0]", "xyz: [450, 100, 300], rpy: [180, 0, 0]"):
            with pytest.raises(InputError) as caught:
                moves_of(f"moves: [{{planner: jerk_limited, to: {{{target}, {rate}}}, approach: 40}}]\n")
            assert len(caught.value.problems) == 1
    for part in ("taught", "{xyz: [450, 100, 300], rpy: [180, 0, 0]}"):
        _, last = moves_of(f"moves: [{{planner: quintic, to: {part}, approach: 40}}]\n")
        assert last.to.relative is None
    for part in ("{from: here}", "{joints_by: 3}"):
        before, last = moves_of(f"moves: [{{planner: quintic, to: {part}, approach: 40}}]\n")
        assert last.to.relative.origin == "here"
        np.testing.assert_allclose(np.array(last.to.relative.offset)[:3, 3], [0, 0, 0.04])
        np.testing.assert_allclose(np.array(before.to.relative.offset)[:3, 3], [0, 0, -0.04])


LAWS = [  # default, own, what holds: shape, speed, acceleration, duration
    ("{speed: 9}", None, ("time_optimal", 0.009, None, None)),
    ("{speed: 9}", "{acceleration: 5}", ("time_optimal", 0.009, 0.005, None)),
    ("{speed: 9, acceleration: 5}", "{speed: 3}", ("time_optimal", 0.003, 0.005, None)),
    ("{speed: 9}", "{shape: cubic, speed: 3}", ("cubic", 0.003, None, None)),
    ("{speed: 9, acceleration: 5}", "{shape: cubic, speed: 3}", ("cubic", 0.003, None, None)),
    ("{speed: 9}", "{shape: cubic, duration: 3}", ("cubic", None, None, 3)),
    ("{acceleration: 9}", "{duration: 3}", ("trapezoid", None, None, 3)),
    ("{shape: cubic, duration: 7}", None, ("cubic", None, None, 7)),
    ("{shape: quintic, speed: 9}", "{acceleration: 5}", ("quintic", 0.009, 0.005, None)),
]


@pytest.mark.parametrize(("default", "own", "expected"), LAWS)
def test_defaults_of_laws_count_key_by_key(default: str, own: str | None, expected: tuple[Any, ...]) -> None:
    more = "" if own is None else f", law: {own}"
    tolerance = "tolerance: {position: 0.5, angle: 1}, orientation: fixed"
    text = f"defaults: {{law: {default}, {tolerance}}}\nmoves:\n"
    text += f"  - {{planner: line, to: {{xyz: [1, 2, 3]}}{more}, tolerance: {{angle: 2}}}}\n"
    text += "  - {planner: quintic, to: taught, approach: {distance: 4}}\n"
    line, quintic, straight = moves_of(text)
    found = line.law.speed, line.law.acceleration, line.law.duration
    assert line.law.shape == expected[0]
    assert found == tuple(number and pytest.approx(number) for number in expected[1:])
    assert (line.tolerance.position, line.tolerance.angle) == pytest.approx((0.0005, np.radians(2)))
    assert line.orientation == straight.orientation == "fixed"
    assert not hasattr(quintic, "law")
    assert straight.law.shape == ("time_optimal" if "shape" not in default else default[8:].partition(",")[0])


def test_without_defaults_a_line_has_its_own_law_and_a_straight_part_the_fastest() -> None:
    line, _, straight = moves_of(
        "moves: [{planner: line, to: {xyz: [1, 2, 3]}}, {planner: quintic, to: taught, approach: 4}]\n"
    )
    assert (line.law.shape, straight.law.shape) == ("trapezoid", "time_optimal")
    assert line.orientation == "axis_angle"


def test_places_of_grids_of_three_directions_in_frames_and_without() -> None:
    """The last direction turns fastest; steps are along the axes of the frame in which the first is given."""
    counts, steps = (2, 3, 2), ([100, 0, 0], [0, 20, 1], [0, 0, -7])
    listed = ", ".join(f"{{count: {n}, xyz: {step}}}" for n, step in zip(counts, steps, strict=True))
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    for first, axes, frame in (
        ("{xyz: [1, 2, 3], rpy: [180, 0, 0]}", np.eye(3), ""),
        ("{in: f, xyz: [2, -1, 3], rpy: [180, 0, 0]}", turn, ""),
        ("{in: f, xyz: [2, -1, 3], rpy: [180, 0, 0]}", np.eye(3), ", frame: world"),
        ("{xyz: [1, 2, 3], rpy: [180, 0, 0]}", turn, ", frame: f"),
        ("{from: g, offset: {xyz: [0, 0, 0]}}", turn, ""),
        ("{xyz: [1, 2, 3], rpy: [180, 0, 0]}", np.diag([1, -1, -1]), ", frame: tool"),
    ):
        points = HEAD.replace("points:\n", "frames: {f: {rpy: [0, 0, 90]}}\npoints:\n"
                              "  g: {in: f, xyz: [2, -1, 3], rpy: [180, 0, 0]}\n") + f"  a: {first}\n"  # fmt: skip
        points += f"  slot: {{grid: {{from: a, steps: [{listed}]{frame}}}}}\n"
        moves = moves_of("moves: [{repeat: slot, moves: [{planner: quintic, to: slot}]}]\n", points)
        expected = [
            np.array([1, 2, 3]) + axes @ np.array([100 * i, 20 * j, j - 7 * k])
            for i, j, k in itertools.product(*map(range, counts))
        ]
        found = [move.to.full_pose()[:3, 3] * 1e3 for move in moves]
        np.testing.assert_allclose(found, expected, atol=1e-11)


NAMES = [
    ("{planner: arc, via: slot, to: pose}", "via"),
    ("{planner: path, segments: [{line: slot}], corner: stop}", "line"),
    ("{planner: spline, through: [pose, slot], to: pose}", "through"),
    ("{planner: spline, through: [pose, {from: slot}], to: pose}", "from"),
    ("{planner: quintic, to: {from: pose, frame: lane}}", "frame"),
    ("{planner: quintic, to: {in: lane, xyz: [1, 2, 3]}}", "in"),
    ("{planner: quintic, to: pose, approach: {distance: 3, frame: lane}}", "approach"),
]


@pytest.mark.parametrize(("move", "key"), NAMES)
def test_names_that_are_many_are_found_under_every_key_that_names_points(move: str, key: str) -> None:
    more = "frames: {f: {}, lane: {grid: {from: f, steps: [{count: 2, xyz: [1, 0, 0]}]}}}\n"
    points = f"{HEAD}  slot: {{grid: {{from: pose, steps: [{{count: 2, xyz: [1, 0, 0]}}]}}}}\n{more}"
    name = "slot" if "slot" in move else "lane"
    with pytest.raises(InputError, match=rf"'{name}' is many \(2\), and no round says which is meant"):
        moves_of(f"moves: [{move}]\n", points)
    assert len(moves_of(f"moves: [{{repeat: {name}, moves: [{move}]}}]\n", points)) == 2 + 2 * (
        key == "approach"
    )


def test_words_that_are_no_names_stay_as_they_are() -> None:
    """A label, a signal and the frame of Euler angles may be called as a point that is many."""
    points = HEAD.replace("  taught", "  one: {xyz: [1, 2, 3]}\n  current: [one, pose]\n  taught")
    text = (
        "moves:\n  - repeat: current\n    moves:\n"
        "      - {planner: quintic, to: {xyz: [1, 2, 3], euler: {sequence: ZYZ, frame: current, angles: [1, 2, 3]}}, "
        "label: current, at: {signal: current, value: 1}}\n"
    )
    for move in moves_of(text, points):
        assert (move.label, move.at[0].signal, move.to.euler.frame) == ("current", "current", "current")
    assert len({id(move) for move in moves_of(text, points)}) == 1
    outside = "moves: [{planner: quintic, to: {xyz: [1, 2, 3], euler: {sequence: ZYZ, frame: current, angles: [1, 2, 3]}}}]\n"
    assert len(moves_of(outside, points)) == 1


def steps(*counts: str) -> int:
    listed = ", ".join(f"{{count: {count}, xyz: [1, 0, 0]}}" for count in counts)
    points = f"{HEAD}  slot: {{grid: {{from: pose, steps: [{listed}]}}}}\n"
    return len(moves_of("moves: [{repeat: slot, moves: [{planner: quintic, to: slot}]}]\n", points))


def test_counts_of_grids_are_whole_numbers_of_at_least_one() -> None:
    assert (steps("1"), steps("1", "1"), steps("2", "1", "3")) == (1, 1, 6)
    for count in ("0", "-1", "2.0", "true", "'2'", "null"):
        with pytest.raises(InputError, match="expected a whole number of at least 1"):
            steps("2", count)
    with pytest.raises(InputError, match="a grid of 4000000 places, expected at most 1000000"):
        steps("2000", "2000")


def test_rounds_by_number_are_at_least_one() -> None:
    move = "moves: [{planner: quintic, to: pose}]"
    assert (
        len(moves_of(f"moves: [{{repeat: 1, {move}}}, {{repeat: 2, moves: [{{repeat: 3, {move}}}]}}]\n")) == 7
    )
    for count in ("0", "-1", "1.0", "true", "[]"):
        with pytest.raises(InputError):
            moves_of(f"moves: [{{repeat: {count}, {move}}}]\n")


def test_defaults_hold_for_both_parts_of_a_line_with_an_approach() -> None:
    for text, speeds in (("", [9, 9]), (", law: {speed: 4}", [4, 9])):
        move = f"{{planner: line, to: pose, approach: {{distance: 40}}{text}}}"
        parts = moves_of(f"defaults: {{law: {{speed: 9}}, orientation: fixed}}\nmoves: [{move}]\n")
        assert [part.law.speed * 1e3 for part in parts] == pytest.approx(speeds)
        assert [part.orientation for part in parts] == ["fixed", "fixed"]


MANY = """\
  slot: {grid: {from: pose, steps: [{count: 2, xyz: [10, 0, 0]}], frame: side}}
  above: {from: slot, offset: {xyz: [0, 0, 5]}, frame: world}
  pick: [above, pose]
  "slot 1 of 2, side 1 of 2": {xyz: [7, 7, 7], rpy: [180, 0, 0]}
  "slot (slot 1 of 2, side 1 of 2)": {xyz: [8, 8, 8], rpy: [180, 0, 0]}
frames: {left: {}, right: {rpy: [0, 0, 90]}, side: [left, right]}
"""


def places(moves: str) -> list[list[float]]:
    return [(move.to.full_pose()[:3, 3] * 1e3).round(6).tolist() for move in moves_of(moves, HEAD + MANY)]


def test_a_grid_along_axes_that_are_many_differs_with_them() -> None:
    inner = "moves: [{repeat: slot, moves: [{planner: quintic, to: slot}]}]"
    expected = [[450, 100, 300], [460, 100, 300], [450, 100, 300], [450, 110, 300]]
    assert places(f"moves: [{{repeat: side, {inner}}}]\n") == expected
    with pytest.raises(InputError, match="'slot' differs from round to round of side"):
        places(f"{inner}\n")


def test_a_list_of_names_that_are_many_means_those_of_its_round() -> None:
    inner = "moves: [{repeat: pick, moves: [{planner: quintic, to: pick}]}]"
    text = f"moves: [{{repeat: side, moves: [{{repeat: slot, {inner}}}]}}]\n"
    pose = [450, 100, 300]
    expected = [[450, 100, 305], pose, [460, 100, 305], pose, [450, 100, 305], pose, [450, 110, 305], pose]
    assert places(text) == expected


def test_points_that_are_called_as_those_of_a_round_stay_what_they_are() -> None:
    own = [
        f'{{planner: quintic, to: "{name}"}}'
        for name in ("slot 1 of 2, side 1 of 2", "slot (slot 1 of 2, side 1 of 2)")
    ]
    text = f"moves: [{{repeat: side, moves: [{{repeat: slot, moves: [{{planner: quintic, to: slot}}]}}]}}, {', '.join(own)}]\n"
    assert places(text)[0] == [450, 100, 300]
    assert places(text)[4:] == [[7, 7, 7], [8, 8, 8]]
    loaded = job_from_text(f"{HEAD}{MANY}{text}")
    assert [loaded.ends(index) for index in (1, 4, 5)] == [
        "slot -> slot",
        "slot -> slot 1 of 2, side 1 of 2",
        "slot 1 of 2, side 1 of 2 -> slot (slot 1 of 2, side 1 of 2)",
    ]
