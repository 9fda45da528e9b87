"""What moves say of themselves: the tool on the flange, their promises, the law of a path, and targets that wait."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace as Some
from typing import Any

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, MountedTool, Payload, Robot, unlimited
from trajcli.planners.point_to_point.jerk_limited import JerkLimited
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.planned_move import (
    Stand,
    law_of_path,
    law_of_tool,
    path_of_tool,
    plan_move_within,
    promises_of,
    with_tools,
)
from trajcli.trajectory import Span, resting

ARM = Robot("arm", (Joint("a", a=0.5), Joint("b", a=0.4)), unlimited(2), "standard", np.eye(4), np.eye(4))


def tool(along: float, load: Payload | None = None, name: str = "") -> MountedTool:
    pose = np.eye(4)
    pose[0, 3] = along
    return MountedTool(pose, load, name)


def test_each_span_has_the_tool_of_its_move_where_that_is_not_the_first_one() -> None:
    """Tools of one pose and another load are two, and one that comes back is the same."""
    heavy = Payload(2.0, np.zeros(3), np.eye(3))
    tools = [
        None,
        tool(0.1, None, "long"),
        tool(0.1, heavy, "gun"),
        None,
        tool(0.2, None, "bent"),
        tool(0.1, None, "long"),
    ]
    own = ARM.with_tool(tool(0.3, None, "own"))
    arms = [own if each is None else own.with_tool(each) for each in tools]
    arms[5] = arms[1]
    spans = [Span(k, "hold", k, k + 1, 2) for k in range(6)]
    found = list(with_tools(spans, [Some(robot=each) for each in arms], own))
    for span, wanted in zip(found, tools, strict=True):
        assert (span.tool is None) == (wanted is None)
        if wanted is not None and span.tool is not None:
            assert (span.tool.load, span.tool.name) == (wanted.load, wanted.name)
            assert span.tool.pose.tolist() == wanted.pose.tolist()
    assert found[5].tool is found[1].tool
    assert [replace(span, tool=None) for span in found] == spans


def test_a_promise_is_said_once_for_rounds_of_the_same_motion_and_anew_for_any_other() -> None:
    asked: list[int] = []

    class Move(Some):
        @property
        def promise(self) -> int:
            asked.append(self.number)
            return self.number

    parts = {
        "planner": object(),
        "start": object(),
        "robot": object(),
        "planned": object(),
        "over_limit": "warn",
    }
    others = [{**parts, name: object()} for name in parts]
    moves = [Move(number=k, **each) for k, each in enumerate([parts, *others, parts, others[2]])]
    assert promises_of(moves) == [0, 1, 2, 3, 4, 5, 0, 3]
    assert asked == [0, 1, 2, 3, 4, 5]


def in_zones(before: float, after: float, *, rotation: bool = False) -> Any:
    """Return a move whose tool goes from s = 0.1 to 0.5 in 2 s, with so long parts in zones around."""
    law = PiecewisePolynomial(np.array([3.0, 5.0]), np.array([0.2, 0.1]).reshape(2, 1, 1))
    part = Some(tool=Some(law=law, pure_rotation=rotation), around=None, start=before, end=before + 2)
    parts = [part]
    if before:
        parts.insert(0, Some(tool=None, around=1, start=0.0, end=before))
    if after:
        parts.append(Some(tool=None, around=2, start=before + 2, end=before + 2 + after))
    return Some(planned=Some(parts=parts, tool=Some(law=law, pure_rotation=rotation)))


@pytest.mark.parametrize(("before", "after"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.25), (0.5, 0.25)])
def test_in_zones_the_law_stays_where_the_path_is_left(before: float, after: float) -> None:
    move = in_zones(before, after)
    assert path_of_tool(move) is next(part.tool for part in move.planned.parts if part.tool)
    law = law_of_tool(move)
    assert law is not None
    assert (law.start, law.end) == (0.0, before + 2 + after)
    times = np.linspace(0.0, law.end, 23)
    expected = 0.1 + 0.2 * np.clip(times - before, 0.0, 2.0)
    np.testing.assert_allclose(law.evaluate(times)[:, 0], expected, rtol=0, atol=1e-12)
    alone = Some(planned=Some(parts=(), tool=move.planned.tool))
    assert law_of_path(alone, alone.planned.tool) is alone.planned.tool.law  # as it is, from its own start
    assert law_of_tool(in_zones(before, after, rotation=True)) is None
    assert law_of_tool(Some(planned=Some(parts=(), tool=None))) is None


def loaded(
    points: str = "", moves: str = "[{planner: hold, duration: 1}]", start: str = "{joints: [0.1, 0.2]}"
) -> Any:
    return job_from_text(
        f"version: 1\nrobot: {{convention: standard, joints: [{{a: 0.5}}, {{a: 0.4}}]}}\n"
        f"limits: {{velocity: 1, acceleration: 2}}\npoints: {{{points}}}\nstart: {start}\nmoves: {moves}\n"
    )


def test_every_target_that_waits_has_joints_or_a_pose_then() -> None:
    """Also the second of several in a list, beside those that are given."""
    job = loaded("p: {joints_by: [1, -1]}", "[{planner: quintic, to: {joints_by: [0.5, 0]}, duration: 1}]")
    joints = np.array([0.25, -0.5])
    stand = Stand(ARM, joints, None, job.job.points)
    (move,) = job.job.moves
    placed = stand.placed(move)
    assert placed.to.joints == (0.75, -0.5)
    assert placed.to.joints_by is None
    point = job.job.points["p"]
    given = placed.to
    assert [each.joints for each in stand.placed([given, point, point])] == [
        (0.75, -0.5),
        (1.25, -1.5),
        (1.25, -1.5),
    ]
    assert stand.placed(given) is given
    assert stand.placed([given]) == [given]
    with pytest.raises(InputError, match="the start cannot be relative"):
        Stand(ARM, None, None, {}).placed(point)


def test_a_pose_is_relative_to_where_the_tool_stands_or_to_a_point() -> None:
    """A point given by a step of joints is where these lead to from where the arm stands."""
    text = "a: {from: here, offset: {xyz: [0, 0, 0.1]}, frame: world}, b: {joints_by: [0.3, 0]}"
    job = loaded(f"{text}, c: {{from: b, offset: {{xyz: [0, 0, 0.1]}}, frame: world}}")
    joints = np.array([0.25, -0.5])
    stand = Stand(ARM, joints, None, job.job.points)
    for name, from_where in (("a", joints), ("c", joints + np.array([0.3, 0]))):
        placed = stand.placed(job.job.points[name])
        pose = forward(ARM, from_where)
        assert placed.relative is None
        np.testing.assert_allclose(placed.xyz, pose[:3, 3] + [0, 0, 0.1], rtol=0, atol=1e-12)
        np.testing.assert_allclose(placed.matrix, pose[:3, :3], rtol=0, atol=1e-12)
    bare = replace(ARM, convention=None)
    with pytest.raises(InputError, match="arm has no geometry"):
        Stand(bare, joints, None, job.job.points).placed(job.job.points["a"])


@pytest.mark.parametrize(("output", "duration"), [("{rate: 10}", 1.2345), ("{rate: 10, align: true}", 1.3)])
def test_a_move_lasts_whole_periods_where_that_is_asked(output: str, duration: float) -> None:
    job = job_from_text(
        "version: 1\nrobot: {joints: 1}\nstart: {joints: [0]}\n"
        f"output: {output}\nmoves: [{{planner: quintic, to: {{joints: [1]}}, duration: 1.2345}}]\n"
    )
    move = plan_move_within(job, 0, job.job.moves[0], resting(np.zeros(1)), job.robot)
    assert move.duration == pytest.approx(duration, rel=1e-12)


def within(planner: str, adapted: Adaptation | None, over: str = "slow", index: int = 0) -> Any:
    """Return a move of a joint of 1 rad as it is planned with an adaptation."""
    job = job_from_text(
        "version: 1\nrobot: {joints: 1}\nlimits: {velocity: 1, acceleration: 2, jerk: 9}\nstart: {joints: 0}\n"
        f"when_over_limit: {over}\nmoves: [{{planner: {planner}, to: {{joints: 1}}}}]\n"
    )
    return plan_move_within(job, index, job.job.moves[0], resting(np.zeros(1)), job.robot, adapted)


def test_a_move_is_stretched_as_it_is_adapted_where_it_may_be_slowed() -> None:
    plain = within("jerk_limited", None)
    for factor in (1.0, 1.25):
        adapted = Adaptation(stretches={3: factor})
        made = within("jerk_limited", adapted, index=3)
        assert made.duration == pytest.approx(factor * plain.duration, rel=1e-9)
        assert within("jerk_limited", Adaptation(stretches={0: 9.0}), index=3).duration == plain.duration
        kept = within("jerk_limited", Adaptation(stretches={3: factor}), "error", index=3)
        assert kept.duration == pytest.approx(plain.duration, rel=1e-12)


def test_what_is_known_of_a_move_is_not_planned_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """But another move from the same start is: it may have other limits."""
    asked: list[Any] = []
    plan = JerkLimited.plan
    monkeypatch.setattr(JerkLimited, "plan", lambda *given: asked.append(given) or plan(*given))
    adapted = Adaptation(stretches={0: 1.5})
    made = [within("jerk_limited", adapted, index=k) for k in (0, 2, 0, 2)]
    assert [each.index for each in made] == [0, 2, 0, 2]
    assert made[0].duration == made[2].duration == pytest.approx(1.5 * made[1].duration, rel=1e-9)
    count = len(asked)
    assert count >= 2
    within("jerk_limited", adapted, index=2)
    assert len(asked) == count
    within("jerk_limited", Adaptation(), index=2)
    assert len(asked) > count


@pytest.mark.parametrize("period", [0.1, 0.03])
def test_breaks_of_a_move_stand_on_rows_where_that_is_asked(period: float) -> None:
    plain = within("jerk_limited", Adaptation())
    made = within("jerk_limited", Adaptation(period=period))
    rows = made.planned.curve.breaks / period
    np.testing.assert_allclose(rows, np.rint(rows), rtol=0, atol=1e-9)
    assert plain.duration <= made.duration < plain.duration + 8 * period
    off = plain.planned.curve.breaks / period
    assert np.abs(off - np.rint(off)).max() > 1e-3
    kept = within("jerk_limited", Adaptation(period=period), "error")
    assert kept.duration == pytest.approx(plain.duration, rel=1e-12)


def test_a_duration_that_is_too_short_is_lengthened_where_the_move_may_be_slowed() -> None:
    """To that of the fastest trapezoid: 1 rad at 1 rad/s, and as long as the half of it to get there and stop."""
    short = "trapezoid, duration: 0.5"
    made = within(short, None)
    assert made.duration == pytest.approx(1 / 1 + 1 / 2, rel=1e-5)
    with pytest.raises(PlanningError):
        within(short, None, "error")
