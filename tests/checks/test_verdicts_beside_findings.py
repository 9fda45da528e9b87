"""What a verdict says beside its findings: limits that nobody could judge, uses by position, and what would help."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from motions import between, limits, state, trajectory
from test_check_tool import RIGHT

from trajcli.checks.verify import _sampled, longest_factor, verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.kinematics.robot import Joint, Limits, Robot, ToolLimits, unlimited
from trajcli.limits.tolerances import LIMIT_RELATIVE, TOOL_RELATIVE
from trajcli.trajectory import Promise, Trajectory

OF_THE_TOOL = replace(limits(), tcp=ToolLimits(speed=1.0, angular_acceleration=2.0))
NEAR = replace(limits(position=3.0), velocity_by_position=np.array([[6.0, 0.3]]))


def arm() -> Robot:
    return Robot("arm", (Joint("j1", a=0.5),), unlimited(1), "standard", np.eye(4), np.eye(4))


def resting(duration: float = 2.0) -> PiecewisePolynomial:
    return between([1.0], [1.0], duration=duration)


def test_limits_of_a_tool_that_nobody_knows_are_named_where_the_arm_moves() -> None:
    moving, still = trajectory(between([0.0], [1.0])), trajectory(resting())
    assert verify(moving, [OF_THE_TOOL]).unchecked_of_tool == ("speed", "angular_acceleration")
    assert verify(moving, [limits()]).unchecked_of_tool == ()
    assert verify(still, [OF_THE_TOOL]).unchecked_of_tool == ()  # it does not move at all
    one_of_two = trajectory(between([0.0, 0.0], [0.0, 1.0]))
    assert verify(one_of_two, [replace(limits(2), tcp=OF_THE_TOOL.tcp)]).unchecked_of_tool
    both = trajectory(between([0.0], [1.0]), resting())
    assert verify(both, [limits(), OF_THE_TOOL]).unchecked_of_tool == ()
    assert verify(both, [OF_THE_TOOL, limits()]).unchecked_of_tool == ("speed", "angular_acceleration")
    known = replace(arm(), limits=OF_THE_TOOL)
    assert verify(moving, [OF_THE_TOOL], [Promise(robot=known)]).unchecked_of_tool == ()
    two = trajectory(between([0.0], [1.0]), between([1.0], [0.0]))
    for promises, unknown in (([known, None], True), ([None, known], False)):
        verdict = verify(two, [limits(), OF_THE_TOOL], [Promise(robot=robot) for robot in promises])
        assert bool(verdict.unchecked_of_tool) == unknown


def test_a_move_of_joints_is_along_no_path() -> None:
    """An arm that is known and a move without a path of its tool: nothing is judged on rows alone."""
    moving = trajectory(between([0.0], [1.0]))
    verdict = verify(moving, [limits()], [Promise(robot=arm())])
    assert (verdict.passed, verdict.sampled) == (True, ())


def test_a_path_of_a_tool_that_no_arm_carries_is_not_judged() -> None:
    verdict = verify(RIGHT.trajectory, [limits(6)], [Promise(tool=RIGHT.motion)])
    assert (verdict.passed, verdict.sampled) == (True, ())
    assert verify(RIGHT.trajectory, [limits(6)], [Promise(tool=RIGHT.motion, robot=RIGHT.robot)]).sampled


def test_a_tool_along_a_path_has_no_peaks_of_its_own_and_one_that_joints_move_has() -> None:
    """Half a metre from the axis it goes half as fast as the joint: 1.875 rad in 2 s at most."""
    of_tool = replace(RIGHT.robot, limits=replace(limits(6), tcp=ToolLimits(speed=9.0)))
    promise = Promise(tool=RIGHT.motion, robot=of_tool)
    verdict = verify(RIGHT.trajectory, [of_tool.limits], [promise])
    assert verdict.surveys[0]["tool"]
    assert verdict.tool_peaks == (None,)
    turned = replace(arm(), limits=OF_THE_TOOL)
    (peaks,) = verify(trajectory(between([0.0], [1.0])), [OF_THE_TOOL], [Promise(robot=turned)]).tool_peaks
    assert peaks is not None
    assert peaks["speed"].value == pytest.approx(0.5 * 1.875 / 2.0, rel=1e-6)


def test_each_move_says_what_it_uses_of_its_limits_by_position() -> None:
    """At 0.75 rad the bound is sqrt(2 d x) - o with x = 3 - q; where no such limit is, nothing is used."""
    whole = trajectory(between([0.0], [1.5], duration=1.0), between([1.5], [0.0], duration=9.0))
    verdict = verify(whole, [NEAR, limits()])
    (used,), nothing = verdict.by_position
    assert nothing == ()
    t = np.linspace(0, 1, 100_001)
    q, v = whole.curve.evaluate(t)[:, 0], whole.curve.evaluate(t, 1)[:, 0]
    assert used.used == pytest.approx((v / (np.sqrt(12.0 * (3.0 - q)) - 0.3)).max(), rel=1e-8)


def advice(whole: Trajectory, of: Limits, **promised: object) -> dict[str, str]:
    promise = Promise(**promised)  # type: ignore[arg-type]
    return {f.kind: f.hint or "" for f in verify(whole, [of], [promise]).findings}


def test_what_no_duration_helps_against_is_not_answered_with_one() -> None:
    """The joint ends outside its range, and is too fast on the way: only the speed asks for more time."""
    hints = advice(trajectory(between([0.0], [2.0], duration=1.0)), limits(position=1.0, velocity=1.0))
    assert hints["velocity"].startswith("it must last 3.75")  # 1.875 times 2 rad/s
    assert "longer" not in hints["position"]
    assert "change the target" in hints["position"]
    alone = advice(trajectory(between([0.0], [2.0], duration=9.0)), limits(position=1.0))
    assert alone == {"position": hints["position"]}


@pytest.mark.parametrize("kind", ["velocity", "jerk"])
def test_what_joins_the_acceleration_is_advised_against_jerk_alone(kind: str) -> None:
    """A cubic steps in acceleration, and is over another limit: the step has an answer, which is none for speed."""
    whole = trajectory(between([0.0], [1.0], duration=1.0, conditions=2), start=state([0.0]))
    bound = {"jerk": 1.0, kind: 0.5}  # jerk 12 rad/s^3, velocity 1.5 rad/s
    hints = advice(whole, limits(**bound))
    assert hints["acceleration_jump"]
    assert hints["jerk"] == hints["acceleration_jump"]
    told = advice(whole, limits(**bound), remedies={"acceleration_jump": "take a quintic"})
    assert (told["acceleration_jump"], told["jerk"]) == ("take a quintic",) * 2
    if kind == "velocity":
        assert hints["velocity"] != hints["acceleration_jump"]
        assert "longer" in hints["velocity"]


@pytest.mark.parametrize("numbers", [(0, 1, 2), (2, 5, 9), (4, 1, 2)])
@pytest.mark.parametrize("slow", [0, 1, 2])
def test_what_each_move_promises_decides_what_would_help_it(slow: int, numbers: tuple[int, ...]) -> None:
    """All three are too fast; one of them has been slowed down already, so that more time is no answer for it."""
    whole = trajectory(*(between([k], [k + 1.0], duration=1.0) for k in (0.0, 1.0, 2.0)))
    spans = tuple(replace(span, index=index) for span, index in zip(whole.spans, numbers, strict=True))
    whole = replace(whole, spans=spans)
    promises = [Promise(over_limit="slow" if k == slow else None) for k in range(3)]
    found = verify(whole, [limits(velocity=1.0)] * 3, promises).findings
    assert [each.move for each in found if each.kind == "velocity"] == list(numbers)
    for each in found:
        assert ("does not help" in (each.hint or "")) == (each.move == numbers[slow])
        assert ("it must last 1.875 times longer" in (each.hint or "")) == (each.move != numbers[slow])


@pytest.mark.parametrize(
    ("method", "slack"), [("exact", LIMIT_RELATIVE), ("bounded", TOOL_RELATIVE), ("sampled", TOOL_RELATIVE)]
)
def test_a_factor_is_not_above_what_is_enough_and_is_enough(method: str, slack: float) -> None:
    """A third power of it, as of a jerk, is within what the limits let go for rounding."""
    factor = 2.0 * (1 + slack / 5)
    findings = [
        Finding(kind="jerk", joint="a", value=8.0, limit=1.0, factor=factor, method=method, message="fast")  # type: ignore[arg-type]
    ]
    found = longest_factor(findings)
    assert found is not None
    assert found <= 2.0
    assert (factor / found) ** 3 <= 1 + slack


@pytest.mark.parametrize("limited", [0, 1, 2])
def test_limits_that_one_move_alone_has_are_judged_in_it(limited: int) -> None:
    """In a second from rest to rest by 1 rad a quintic goes 1.875 rad/s in its middle; sqrt(2 d x) - o there is below 1."""
    whole = trajectory(*(between([k], [1.0 - k], duration=1.0) for k in (0.0, 1.0, 0.0)))
    near = replace(limits(position=1.5), velocity_by_position=np.array([[0.5, 0.0]]))
    bounds = [near if k == limited else limits(position=1.5) for k in range(3)]
    verdict = verify(whole, bounds)
    assert {(each.kind, each.move) for each in verdict.findings} == {("velocity_by_position", limited)}
    assert [bool(used) for used in verdict.by_position] == [k == limited for k in range(3)]


def test_a_move_of_several_parts_is_named_once() -> None:
    """What is judged on rows alone in the same moves is said of them together."""
    told = [(0, "distance"), (0, "branch"), (0, "distance"), (2, "branch"), (2, "distance"), (3, "branch")]
    tools = [SimpleNamespace(span=SimpleNamespace(index=move), sampled=(what,)) for move, what in told]
    assert _sampled(tools) == (("distance", (0, 2)), ("branch", (0, 2, 3)))  # type: ignore[arg-type]
    assert _sampled(tools[:-1]) == (("distance and branch", (0, 2)),)  # type: ignore[arg-type]


@pytest.mark.parametrize("last", [False, True])
def test_no_duration_helps_a_move_that_is_over_its_limit_at_either_end(last: bool) -> None:
    """It declares to begin or to end at 2 rad/s, where 1 rad/s is allowed."""
    ends = (state([0.0]), state([1.0], velocity=2.0))
    whole = trajectory(between([0.0], [1.0], duration=0.5))
    hints = advice(whole, limits(velocity=1.0), ends=ends if last else ends[::-1])
    assert "starts or ends over its limit" in hints["velocity"]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_the_joint_that_is_over_its_limit_at_an_end_is_told_so_in_either_direction(
    joint: int, side: float
) -> None:
    """It declares to end at 2 rad/s, where 1 rad/s is allowed, and the other joint stands; or it ends at 0.5 rad/s."""
    to = side * np.eye(2)[joint]
    whole = trajectory(between([0.0, 0.0], to.tolist(), duration=0.5))
    for speed, over in ((2.0, True), (0.5, False)):
        ends = (state([0.0, 0.0]), replace(state(to.tolist()), velocity=speed * to))
        hints = advice(whole, limits(2, velocity=1.0), ends=ends)
        assert ("starts or ends over its limit" in hints["velocity"]) is over


@pytest.mark.parametrize(("speed", "over"), [(3.0, True), (-3.0, True), (1.0, False)])
def test_the_tool_that_is_too_fast_at_an_end_is_told_so(speed: float, over: bool) -> None:
    """Half a metre from the axis, where 1 m/s is allowed: 2 rad/s of the joint."""
    of_tool = replace(limits(), tcp=ToolLimits(speed=1.0))
    whole = trajectory(between([0.0], [1.0], duration=0.3))
    ends = (state([0.0]), state([1.0], velocity=speed))
    hints = advice(whole, of_tool, ends=ends, robot=replace(arm(), limits=of_tool))
    assert ("the tool is too fast where the move starts or ends" in hints["tool_speed"]) is over
