"""Random lines, arcs and paths over six arms: each is planned and verified, or refused with a reason that holds.

The judge is the tracker of `tool_campaign`, which shares forward kinematics and the path's geometry with the
planner, and nothing else; the closed forms of inverse kinematics say on which branch a planned arm is.
"""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest
from tiers import few
from tool_campaign import KINDS, ROBOTS, StoppedError, Task, Tracker, task, way_of
from tool_jobs import job_text

from trajcli.errors import PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.inverse.solve import solve
from trajcli.planning.plan import Plan, plan_job

ROWS = 31  # of a planned move that are compared
LOOKS = 40  # places on the way to where a refused move ends
NEAR_SINGULAR = 2e-3
CLOSED = ("puma560", "ur5e")
FIXED = [
    1,
    2,
    4,
    5,
    6,
    11,
    13,
    23,
    24,
    26,
    28,
    36,
    47,
    48,
    57,
    59,
    60,
    63,
    64,
    79,
    81,
    82,
    86,
    97,
    98,
    104,
    109,
    118,
]
REASONS = {
    "reach": "does not reach",
    "limit": "its limit is",
    "singular": "runs into a singularity",
    "free": "what the target leaves free cannot be held",
}


def numbered(number: int) -> Task:
    """Return the task of a number: all robots and kinds take turns."""
    return task(number, KINDS[number // len(ROBOTS) % len(KINDS)], ROBOTS[number % len(ROBOTS)])


def judge(number: int) -> tuple[str, str]:
    """Return the robot and "planned", or why it was refused; the plan, or the reason, is confirmed."""
    made = numbered(number)
    loaded = job_from_text(job_text(made.robot, {"joints": made.start}, made.move))
    tracker = Tracker(loaded.robot, way_of(made, loaded), np.array(made.start))
    try:
        plan = plan_job(loaded)
    except PlanningError as error:
        return made.robot, refused(str(error), tracker)
    assert plan.verdict.passed, (number, plan.verdict.findings)
    confirm_plan(plan, tracker, made.robot)
    return made.robot, "planned"


def confirm_plan(plan: Plan, tracker: Tracker, robot: str) -> None:
    """The tracker comes to the same joint values, and all of them are on one branch."""
    curve, motion = plan.trajectory.curve, plan.moves[0].planned.tool
    times = np.linspace(0, curve.end, ROWS)
    q = curve.evaluate(times)
    places = motion.law.evaluate(np.minimum(times, motion.law.end))[:, 0]
    for place, row in zip(np.clip(np.maximum.accumulate(places), 0, tracker.path.length), q, strict=True):
        assert np.abs(tracker.go(place) - row).max() < 1e-5
    if robot in CLOSED and tracker.path.orientation == "all":
        found = solve(tracker.robot, motion.reference(times, "left").poses, q)
        away = np.where(found.valid, np.abs(found.joints - q[:, None]).max(axis=-1), np.inf)
        assert away.min(axis=1).max() < 1e-4
        assert len(set(away.argmin(axis=1))) == 1


def refused(text: str, tracker: Tracker) -> str:
    """Return why a move was refused, which is confirmed by going there."""
    reason = next(name for name, words in REASONS.items() if words in text)
    said = float(re.search(r"s = ([-0-9.e]+)", text).group(1))
    length, limits = tracker.path.length, tracker.robot.limits.position
    stopped, beyond, ratios = None, None, [(0.0, tracker.ratio())]
    try:
        for place in np.linspace(0, length, LOOKS + 1)[1:]:
            q = tracker.go(place)
            ratios.append((place, tracker.ratio()))
            if beyond is None and np.maximum(limits[:, 0] - q, q - limits[:, 1]).max() > 0:
                beyond = place
    except StoppedError as error:
        stopped = error.place
    there = stopped is not None and abs(stopped - said) < 5e-3 * length
    match reason:
        case "reach":
            assert stopped is not None
            assert stopped <= said + 1e-3 * length
            assert not tracker.reaches(min(said + 2e-3 * length, length), tries=20)
        case "limit":
            assert beyond is not None
            assert said >= beyond - length / LOOKS - 1e-9
        case "singular":
            near = min([ratio for place, ratio in ratios if abs(place - said) < 0.05 * length], default=1.0)
            assert there or near < NEAR_SINGULAR
        case "free":
            assert there
            assert tracker.bare_ratio() > NEAR_SINGULAR / 2
    return reason


@pytest.mark.parametrize("number", few(FIXED, 4))
def test_a_task_is_planned_or_refused_for_a_reason(number):
    judge(number)


def test_the_fixed_tasks_are_of_all_robots_and_outcomes():
    made = [numbered(number) for number in FIXED]
    assert {one.robot for one in made} == set(ROBOTS)
    assert {one.kind for one in made} == set(KINDS)


@pytest.mark.soak
def test_a_thousand_tasks():
    outcomes = Counter(judge(number) for number in range(1000))
    for (robot, outcome), count in sorted(outcomes.items()):
        print(f"{robot:10s} {outcome:10s} {count}")
    for robot in ROBOTS:
        assert outcomes[robot, "planned"] > 40
