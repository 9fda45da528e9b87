"""Limits of torque and force in jobs: verified for all t, kept by slowing, refused where gravity exceeds them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from trajcli.api.plans import plan
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import PlanningError

UR5 = Path(__file__).parents[1] / "urdf" / "models" / "ur5.urdf"
RESTS = ([0.0, -1.5, 1.5, -1.5, -1.5, 0.0], [2.0, -0.9, 0.7, -2.0, -0.5, 1.0])
LIMITS = np.array([150.0, 150.0, 150.0, 28.0, 28.0, 28.0])
LIFT = {
    "convention": "standard",
    "joints": [
        {
            "name": "lift",
            "type": "prismatic",
            "position": [-10, 10],
            "velocity": 5,
            "acceleration": 10,
            "effort": [-80, 80],
            "link": {"mass": 5, "com": [0, 0, 0], "inertia": [0, 0, 0, 0, 0, 0]},
        }
    ],
}


def job(*moves, mass=None, **fields):
    attach = [] if mass is None else [{"attach": {"mass": mass}}]
    return {
        "version": 1,
        "robot": {"urdf": str(UR5), "tip": "ee_link"},
        "limits": {"effort": "robot", "velocity": 20, "acceleration": 40},
        "start": {"joints": RESTS[0]},
        "moves": [*attach, *moves],
        **fields,
    }


def lift(*moves, **fields):
    return {
        "version": 1,
        "robot": LIFT,
        "limits": {"effort": "robot"},
        "start": {"joints": [0]},
        "moves": moves,
        **fields,
    }


def shares(planned, limits=LIMITS):
    """Return how much of the limits each move uses at most, by dense rows of inverse dynamics."""
    used = []
    for move in planned.moves:
        curve = move.planned.curve
        if curve.duration:
            t = np.linspace(curve.start, curve.end, 20_001)
            used.append(
                np.abs(InverseDynamics(move.robot).effort(*(curve.evaluate(t, k) for k in range(3)))).max(
                    axis=0
                )
                / limits
            )
    return np.array(used)


def kinds(planned):
    return [event.kind for event in planned.events]


@pytest.mark.full
@pytest.mark.parametrize(
    "planner", ["trapezoid", "cubic", "quintic", "septic", "cycloidal", "jerk_limited", "spline", "blends"]
)
def test_fastest_durations_respect_efforts(planner):
    to = {"joints": RESTS[1]}
    points = (
        {"through": [{"joints": [1.0, -1.0, 1.0, -1.0, -1.0, 0.5]}]}
        if planner in ("spline", "blends")
        else {}
    )
    move = {"planner": planner, "to": to, **points}
    limits = {"velocity": 20, "acceleration": 40, **({"jerk": 2000} if planner == "jerk_limited" else {})}
    free = plan(job(move, mass=8, limits=limits))
    assert shares(free).max() > 1.01
    kept = plan(job(move, mass=8, limits={**limits, "effort": "robot"}))
    assert kept.verdict.passed
    assert 1 - 1e-3 <= shares(kept).max() <= 1 + 1e-6
    assert {"stretched", "within_effort_limits"} & set(kinds(kept))
    assert "to keep the effort limit of" in " ".join(event.message for event in kept.events)


@pytest.mark.full
def test_each_move_is_judged_with_what_it_carries():
    there, back = ({"planner": "quintic", "to": {"joints": q}, "duration": 0.8} for q in RESTS[::-1])
    assert plan(job(there, back)).verdict.passed
    planned = plan(job(there, {"attach": {"mass": 8}}, back))
    assert {finding.move for finding in planned.verdict.findings} == {2}
    assert {finding.kind for finding in planned.verdict.findings} == {"effort"}
    left = plan(job({"attach": {"mass": 8}}, {"detach": {}}, there, back))
    assert left.verdict.passed


def test_a_finding_names_joint_time_value_limit_gravity_and_factor():
    """5 kg that a slide lifts by q = t^3 (10 - 15 t + 6 t^2) take 5 (g + qdd), at most 5 (9.81 + 10 / sqrt 3)."""
    given = lift({"planner": "quintic", "to": {"joints": [1]}, "duration": 1})
    given["limits"]["effort"] = 60.0
    (finding,) = plan(given).verdict.findings
    peak = 5 * (9.81 + 10 / 3**0.5)
    assert (finding.joint, finding.kind, finding.method, finding.limit) == ("lift", "effort", "bounded", 60.0)
    assert finding.value == pytest.approx(peak, rel=1e-6)
    assert finding.time == pytest.approx(0.5 - 12**-0.5, abs=1e-4)
    assert finding.factor == pytest.approx((50 / 3**0.5 / (60 - 49.05)) ** 0.5, rel=1e-6)
    assert "lift needs a force of 77.917" in finding.message
    assert "49.05 N of it against gravity; its limit is 60 N" in finding.message
    assert "it must last 1.623" in finding.hint


def test_slow_is_the_smallest_stretch():
    given = lift({"planner": "quintic", "to": {"joints": [1]}, "duration": 1}, when_over_limit="slow")
    given["limits"]["effort"] = 60.0
    planned = plan(given)
    wanted = (50 / 3**0.5 / (60 - 49.05)) ** 0.5
    assert planned.verdict.passed
    assert planned.trajectory.duration == pytest.approx(wanted, rel=1e-6)
    given["moves"][0]["duration"] = 0.999 * wanted
    given["when_over_limit"] = "error"
    assert not plan(given).verdict.passed


def test_gravity_over_the_limit_is_named():
    given = lift({"planner": "quintic", "to": {"joints": [1]}, "duration": 1})
    given["limits"]["effort"] = 49.0
    with pytest.raises(
        PlanningError, match=r"gravity alone takes 49.05 N of lift at t = .* s of the move, .*0.05 N more"
    ):
        plan(given)
    given["moves"] = [{"planner": "hold", "duration": 1}]
    with pytest.raises(PlanningError, match="effort limit of 49 N"):
        plan(given)


def test_a_motion_that_falls_fast_enough_keeps_a_limit_below_gravity():
    """A slide that may push down but lift no more than 40 N lets 5 kg fall: it brakes with another payload."""
    falling = {"to": {"joints": [-2], "velocity": [-4]}, "planner": "quintic", "duration": 1}
    given = lift(falling)
    given["limits"]["effort"] = [[-80, 40]]
    given["start"] = {"joints": [0], "acceleration": [-4]}
    given["moves"][0]["to"]["acceleration"] = [-4]
    assert plan(given).verdict.passed


def test_a_hanging_arm_feels_gravity_the_other_way():
    given = lift({"planner": "quintic", "to": {"joints": [1]}, "duration": 1}, base={"rpy": [np.pi, 0, 0]})
    given["limits"]["effort"] = [[-80, 10]]
    assert plan(given).verdict.passed
    given["limits"]["effort"] = [[-60, 10]]
    (finding,) = plan(given).verdict.findings
    assert finding.value == pytest.approx(-5 * (9.81 + 10 / 3**0.5), rel=1e-6)
    assert finding.limit == -60.0


@pytest.mark.full
def test_a_move_between_moving_states_is_slowed_within_efforts():
    given = lift(
        {"planner": "quintic", "to": {"joints": [1], "velocity": [1.0]}, "duration": 0.7},
        {"planner": "quintic", "to": {"joints": [2]}, "duration": 2},
        when_over_limit="slow",
    )
    given["limits"]["effort"] = 65.0
    planned = plan(given)
    assert planned.verdict.passed
    assert 1 - 1e-3 <= shares(planned, np.array([65.0])).max() <= 1 + 1e-6


@pytest.mark.parametrize(("limits", "unjudged"), [({}, True), ({"effort": 1e6}, False)])
def test_what_is_carried_and_not_judged_is_said(limits, unjudged) -> None:
    """200 kg at the flange of an arm that lifts 5: without limits of effort nobody judges them."""
    move = {"planner": "quintic", "to": {"joints": RESTS[1]}, "duration": 9}
    made = plan(job(move, mass=200, limits={"velocity": 20, "acceleration": 40, **limits}))
    assert made.verdict.passed
    said = {quantity for _, quantity in made.verdict.unchecked}
    assert ("effort" in said, "effort with 200 kg carried" in made.unchecked) == (unjudged, unjudged)
    empty = plan(job(move, limits={"velocity": 20, "acceleration": 40}))
    assert "effort" not in empty.unchecked


def test_limits_that_are_lowered_in_vain_leave_the_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where lower limits change no speed, nothing is judged anew: the selection of what changed is empty."""
    changed: list[bool] = []
    among = LawPieces.among

    def noted(self: LawPieces, others: LawPieces) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        found = among(self, others)
        changed.append(not found[1].all())
        return found

    monkeypatch.setattr(LawPieces, "among", noted)
    inertia, coulomb, effort = 0.02 + 2 * 0.3**2, 1.5, 5.0
    link = {"mass": 2, "com": [0, 0, 0], "inertia": [0.02, 0.02, 0.02, 0, 0, 0]}
    turn = {"a": 0.3, "velocity": 3, "acceleration": 30, "effort": effort, "friction": {"coulomb": coulomb}}
    through = [{"joints": [q]} for q in (1.0, 0.5)]
    made = plan(
        {
            "version": 1,
            "robot": {"convention": "standard", "joints": [{"name": "turn", "link": link, **turn}]},
            "limits": {"effort": "robot"},
            "start": {"joints": [0]},
            "moves": [{"planner": "time_optimal", "through": through, "to": {"joints": [-1]}}],
        }
    )
    assert made.verdict.passed
    assert False in changed
    curve = made.trajectory.curve
    t = np.linspace(curve.start, curve.end, 100_001)[1:-1]
    speed, change = curve.evaluate(t, 1)[:, 0], curve.evaluate(t, 2)[:, 0]
    share = np.abs(inertia * change + coulomb * np.sign(speed)).max() / effort  # the axis is vertical
    assert 0.99 < share <= 1 + 1e-6
