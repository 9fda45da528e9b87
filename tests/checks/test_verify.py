"""The verdict: all checks over one set of peaks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from motions import between, limits, state, trajectory
from test_check_tool import RIGHT

from trajcli.checks.continuity import acceleration_steps, check_continuity
from trajcli.checks.verify import check_limits, over_limits, verify
from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.kinematics.robot import Payload, ToolLimits
from trajcli.limits.kinds import KIND_OF
from trajcli.trajectory import Promise, ViaPoints


def test_a_valid_motion_passes_and_says_its_peaks() -> None:
    whole = trajectory(
        between([0.0, 5.0], [1.0, 5.0], duration=2.0), between([1.0, 5.0], [0.0, 3.0], duration=4.0)
    )
    verdict = verify(whole, [limits(2, position=6.0, velocity=1.0, acceleration=2.0, jerk=8.0)] * 2)
    assert verdict.passed
    assert (verdict.findings, list(verdict.steps), verdict.unchecked) == ((), [], ())
    assert len(verdict.peaks) == 2
    assert verdict.peaks[0][1].high == pytest.approx([1.875 / 2, 0.0])
    assert verdict.peaks[1][1].low == pytest.approx([-1.875 / 4, -1.875 / 2])
    assert verdict.peaks[1][3].magnitude == pytest.approx([60 / 64, 120 / 64])


def test_the_verdict_holds_what_the_checks_find_by_move_and_time() -> None:
    first, second = between([0.0], [1.0], duration=1.0, conditions=2), between([1.2], [0.0], duration=1.0)
    whole = trajectory(first, second, start=state([0.0], velocity=0.1))
    bounds = [limits(velocity=1.0), limits(acceleration=1.0, jerk=30.0)]
    verdict = verify(whole, bounds)
    assert not verdict.passed
    assert [(f.move, f.kind) for f in verdict.findings] == [
        (0, "velocity_jump"),
        (0, "velocity"),
        (1, "jerk"),
        (1, "position_jump"),
        (1, "acceleration"),
    ]
    separate = check_limits(whole, bounds) + check_continuity(whole, bounds)
    assert {(f.move, f.time, f.text()) for f in verdict.findings} == {
        (f.move, f.time, f.text()) for f in separate
    }
    assert list(verdict.steps) == list(acceleration_steps(whole, bounds))
    assert [(s.move, s.time) for s in verdict.steps] == [(0, 0.0), (0, 1.0)]


def test_findings_of_an_early_move_come_first_whoever_makes_them() -> None:
    """The first move alone begins with a jump, the second alone goes 1.875 rad/s: limits are looked at before jumps."""
    slow, fast = between([0.0], [1.0], duration=9.0), between([1.0], [0.0], duration=1.0)
    found = verify(
        trajectory(slow, fast, start=state([0.0], velocity=0.1)), [limits(velocity=1.0)] * 2
    ).findings
    assert [(each.move, each.kind) for each in found] == [(0, "velocity_jump"), (1, "velocity")]


def test_what_nobody_limits_is_said() -> None:
    whole = trajectory(between([0.0, 0.0], [1.0, 1.0]), between([1.0, 1.0], [0.0, 0.0]))
    all_bounded = limits(2, position=9.0, velocity=9.0, acceleration=9.0, jerk=99.0)
    one_sided = np.array([[-9.0, np.inf], [-9.0, 9.0]])
    open_ended = limits(2, position=9.0, velocity=one_sided, acceleration=9.0)
    assert verify(whole, [all_bounded, all_bounded]).unchecked == ()
    expected = (("j1", "velocity"), ("j1", "jerk"), ("j2", "jerk"))
    assert verify(whole, [all_bounded, open_ended]).unchecked == expected
    mirrored = replace(open_ended, velocity=-one_sided[:, ::-1])  # unlimited downwards
    assert verify(whole, [all_bounded, mirrored]).unchecked == expected


def test_what_nobody_limits_where_the_arm_stands_is_not_missing() -> None:
    """Between two moves with limits of their own a hold, and what takes no time, have those of the job: none."""
    nowhere = constant([1.0], 0.0)
    whole = trajectory(between([0.0], [1.0]), nowhere, constant([1.0], 1.0), between([1.0], [0.0]), nowhere)
    bounded = limits(position=9.0, velocity=9.0, acceleration=9.0, jerk=99.0)
    jerky = replace(bounded, jerk=limits().jerk)
    assert verify(whole, [bounded, limits(), limits(), bounded, limits()]).unchecked == ()
    for k in (0, 3):
        assert verify(whole, [jerky if k == move else bounded for move in range(5)]).unchecked == (
            ("j1", "jerk"),
        )
    assert ("j1", "jerk") in verify(whole, [limits()] * 5).unchecked


def test_what_nobody_limits_of_a_joint_at_an_even_speed_is_missing() -> None:
    """It moves all the way, though nothing accelerates it."""
    even = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[0.5]], [[1.0]]]))
    moving = state([1.5], velocity=0.5)
    whole = trajectory(constant([1.0], 1.0), even, end=moving)
    bounded = limits(position=9.0, velocity=9.0, acceleration=9.0, jerk=99.0)
    jerky = replace(bounded, jerk=limits().jerk)
    assert verify(whole, [bounded, jerky]).unchecked == (("j1", "jerk"),)
    assert verify(whole, [jerky, bounded]).unchecked == ()


@pytest.mark.parametrize(
    ("count", "words"),
    [(0, "verified"), (1, "1 finding"), (2, "2 findings"), (3, "3 findings"), (11, "11 findings")],
)
def test_a_verdict_says_how_much_it_found_and_shows_the_first_two(count: int, words: str) -> None:
    whole = trajectory(between([0.0], [1.0], duration=1.0))
    verdict = verify(whole, [limits(velocity=1.0)])
    several = replace(verdict, findings=verdict.findings[:1] * count)
    assert several.text == words
    shown = ", ".join(["velocity of j1"] * min(count, 2) + ["..."] * (count > 2))
    assert repr(several) == f"Verdict({words}{': ' * (count > 0)}{shown})"


@pytest.mark.parametrize(("loaded", "unchecked"), [((), ()), ((1,), ()), ((2,), (("j1", "effort"),))])
def test_efforts_are_left_unchecked_where_a_load_is_moved(loaded: tuple[int, ...], unchecked: Any) -> None:
    """The second of three moves takes no time, and so nothing is moved in it."""
    plain = trajectory(between([0.0], [1.0]), constant([1.0], 0.0), between([1.0], [0.0]))
    load = Payload(1.0, np.zeros(3), np.eye(3))
    spans = tuple(replace(span, payload=load) if span.index in loaded else span for span in plain.spans)
    bounds = limits(position=9.0, velocity=9.0, acceleration=9.0, jerk=99.0)
    assert verify(replace(plain, spans=spans), [bounds] * 3).unchecked == unchecked
    stated = replace(bounds, effort=np.array([[-1.0, 1.0]]))
    whole = replace(plain, spans=tuple(replace(span, payload=load) for span in plain.spans))
    for efforts in ((stated, bounds, bounds), (bounds, bounds, stated)):  # in either move that lasts
        assert verify(whole, efforts).unchecked == (("j1", "effort"),)


@pytest.mark.parametrize("order", [1, -1])
def test_limits_of_the_tool_that_no_arm_can_be_judged_by_are_named_of_all_moves(order: int) -> None:
    whole = trajectory(between([0.0], [1.0]), between([1.0], [0.0]))
    bounds = [replace(limits(), tcp=ToolLimits(**{name: 1.0})) for name in ("speed", "acceleration")][::order]
    assert verify(whole, bounds).unchecked_of_tool == ("speed", "acceleration")


@pytest.mark.parametrize("move", [0, 1])
def test_via_points_of_one_move_are_judged_whatever_the_others_promise(move: int) -> None:
    whole = trajectory(between([0.0], [1.0]), between([1.0], [0.0]))
    passing = Promise(ViaPoints(np.array([1.0]), np.array([[0.5]]), np.array([[0.75]])))
    promises = [passing, Promise()] if move == 0 else [Promise(), passing]
    (found,) = verify(whole, [limits()] * 2, promises).findings
    assert (found.kind, found.move) == ("waypoint", move)


def test_limits_must_be_as_many_as_moves() -> None:
    with pytest.raises(ValueError):
        verify(trajectory(between([0.0], [1.0])), [])


@pytest.mark.parametrize("judge", [verify, over_limits])
@pytest.mark.parametrize(("bounds", "promises"), [(0, 1), (2, 1), (1, 2)])
def test_more_limits_or_promises_than_moves_are_refused_like_fewer(
    judge: Any, bounds: int, promises: int
) -> None:
    with pytest.raises(ValueError, match="for 1 moves"):
        judge(trajectory(between([0.0], [1.0])), [limits()] * bounds, [Promise()] * promises)


def test_limits_alone_are_judged_as_in_the_whole_verdict() -> None:
    """Joints are too fast in the second move, and too fast so near to the end of their range in the first one."""
    first, second = between([0.0], [1.0], duration=1.0), between([1.0], [0.0], duration=1.0)
    near = replace(limits(position=1.5), velocity_by_position=np.array([[0.5, 0.0]]))
    whole = trajectory(first, second, start=state([0.0], velocity=0.1))
    arguments = whole, [near, limits(velocity=1.0)], [Promise(over_limit="stop"), Promise()]
    alone = over_limits(*arguments)
    assert [(each.move, each.kind) for each in alone] == [(0, "velocity_by_position"), (1, "velocity")]
    assert all("longer" in (each.hint or "") for each in alone)
    of_all = verify(*arguments).findings
    assert [each.kind for each in of_all if each.kind not in KIND_OF] == ["velocity_jump"]
    told = [(each.move, each.kind, each.value, each.time) for each in of_all if each.kind in KIND_OF]
    assert [(each.move, each.kind, each.value, each.time) for each in alone] == told


@pytest.mark.parametrize(("first", "second"), [(2.0, 3.0), (3.0, 2.0)])
@pytest.mark.parametrize("before", [0.0, 4.0])
def test_one_duration_is_said_that_is_long_enough_for_all_findings_of_a_move(
    first: float, second: float, before: float
) -> None:
    """From rest to rest by 1 rad in 1 s: 10 / sqrt(3) rad/s^2 on both sides of 1.875 rad/s after 0.5 s."""
    bounds = limits(velocity=1.875 / second, acceleration=10 / 3**0.5 / first**2)
    moves = [between([0.0], [1.0], duration=1.0)]
    moves = [constant([0.0], before), *moves] if before else moves
    found = verify(trajectory(*moves), [bounds] * len(moves), [Promise()] * len(moves)).findings
    assert sorted(each.kind for each in found) == ["acceleration", "velocity"]
    for each in found:
        times, seconds = (each.hint or "").split(" times longer (")
        assert float(times.split(" ")[-1]) == pytest.approx(3.0, rel=1e-5)
        assert float(seconds.split(" ")[0]) == pytest.approx(3.0, rel=1e-5)


def test_ten_thousand_pieces_give_one_finding_for_each_move_joint_and_kind() -> None:
    rng = np.random.default_rng(2)
    curve = PiecewisePolynomial(np.arange(10_001) * 0.1, rng.normal(size=(4, 10_000, 6)))
    verdict = verify(trajectory(curve), [limits(6, velocity=1.0)])
    assert {f.kind for f in verdict.findings} == {"velocity", "position_jump", "velocity_jump"}
    assert len(verdict.findings) == 18


@pytest.mark.parametrize("limited", [0, 1])
def test_each_step_in_acceleration_is_legal_or_a_finding_by_the_limits_of_its_move(limited: int) -> None:
    """Two cubics of 1 rad in 1 s: from 0 to 6 rad/s^2, from -6 to 6 and from -6 to 0; one of them has a limit of jerk."""
    whole = trajectory(*(between([k], [k + 1.0], duration=1.0, conditions=2) for k in (0.0, 1.0)))
    verdict = verify(whole, [limits(jerk=99.0) if k == limited else limits() for k in range(2)])
    found = {each.move for each in verdict.findings if each.kind == "acceleration_jump"}
    legal = [each.time for each in verdict.steps]
    assert (found, legal) == ({limited}, [2.0 - 2.0 * limited])  # the step between them breaks a limit, too


@pytest.mark.parametrize("along", [0, 1])
def test_the_one_move_that_goes_along_a_path_is_told_wherever_it_stands(along: int) -> None:
    line = RIGHT.trajectory.curve
    q = (line.piece_ends()[1][-1] if along == 0 else line.piece_ends()[0][0]).tolist()
    moves = [constant(q, 1.0), constant(q, 1.0)]
    moves[along] = line
    promises = [Promise(), Promise()]
    promises[along] = Promise(tool=RIGHT.motion, robot=RIGHT.robot)
    verdict = verify(trajectory(*moves), [limits(6)] * 2, promises)
    assert verdict.sampled
    assert {moves for _, moves in verdict.sampled} == {(along,)}
