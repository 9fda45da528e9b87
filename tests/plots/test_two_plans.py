"""Two plans in a picture: the second from the start of the first, its own verdict, and the difference of both."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.picture import picture_of

ARM = """\
version: 1
units: {angle: deg, length: mm}
robot: {convention: standard, joints: [{a: 500, velocity: 100}, {a: 300, velocity: 100}]}
start: {joints: [0, 0]}
moves: [{planner: %s, to: {joints: [60, -40]}, duration: %s}]
output: {start_time: %s}
"""


def planned(planner: str, duration: float, start: float = 0.0) -> Plan:
    return plan_job(job_from_text(ARM % (planner, duration, start), f"{planner}.yaml"))


def test_the_second_plan_starts_with_the_first_and_ends_by_itself() -> None:
    first, second = planned("quintic", 2, 10.0), planned("cubic", 1.5, 4.0)
    picture = picture_of(first, quantities=["q", "qdd", "path"], second=second)
    assert picture.title == "quintic: verified, 2 s; cubic: verified, 1.5 s"
    assert picture.sources == ("quintic", "cubic")
    panels = {panel.title: panel for block in picture.blocks for panel in block.panels}
    own, other = panels["j1: position"].traces
    assert (own.x[0], own.x[-1]) == (10, 12)
    assert (other.x[0], other.x[-1]) == (10, 11.5)
    s = (other.x - 10) / 1.5  # the cubic: 3 s^2 - 2 s^3
    np.testing.assert_allclose(other.y, 60 * (3 * s**2 - 2 * s**3), atol=1e-9)
    bent = panels["j2: acceleration"].traces[1]
    assert bent.y[[0, -1]] == pytest.approx([-40 * 6 / 1.5**2, 40 * 6 / 1.5**2])
    assert picture.views is not None
    paths = dict(picture.views.traces)
    q = second.trajectory.curve.evaluate(second.trajectory.duration)
    assert paths[1][-1] == pytest.approx(1e3 * forward(second.loaded.robot, q)[:3, 3])


def test_the_difference_is_second_minus_first() -> None:
    first, second = planned("quintic", 2, 10.0), planned("cubic", 1.5)
    picture = picture_of(first, quantities=["qd"], second=second)
    panel = next(p for block in picture.blocks for p in block.panels if p.title == "j2: difference")
    (trace,) = panel.traces
    t = trace.x - 10
    a, b = t / 2, np.minimum(t / 1.5, 1)
    expected = -40 * ((3 * b**2 - 2 * b**3) - (10 * a**3 - 15 * a**4 + 6 * a**5))
    np.testing.assert_allclose(trace.y, expected, atol=1e-9)
    assert (t[0], t[-1]) == (0, 2)
    assert panel.y_label == "\u0394q [deg]"


def test_plans_of_one_name_are_called_by_their_files() -> None:
    one, other = (plan_job(job_from_text(ARM % ("cubic", 2, 0), f"{folder}/x.yaml")) for folder in "AB")
    picture = picture_of(one, quantities=["q"], second=other)
    assert picture.sources == ("A/x.yaml", "B/x.yaml")
    assert picture.title == "A/x.yaml: verified, 2 s; B/x.yaml: verified, 2 s"


def test_each_plan_has_its_verdict() -> None:
    picture = picture_of(planned("quintic", 2), quantities=["q"], second=planned("cubic", 0.5))
    assert picture.title.startswith("quintic: verified, 2 s; cubic: NOT VERIFIED, ")


def test_plans_of_other_joints_are_refused() -> None:
    bare = "version: 1\nrobot: {joints: 1}\nstart: {joints: 0}\nmoves: [{planner: cubic, to: {joints: 1}, duration: 1}]\n"
    one = plan_job(job_from_text(bare, "one.yaml"))
    with pytest.raises(InputError, match="quintic has 2, one has 1"):
        picture_of(planned("quintic", 2), quantities=["q"], second=one)
    with pytest.raises(InputError, match="the robot of the job 1 joint"):
        picture_of(one, quantities=["q"], second=planned("quintic", 2))
