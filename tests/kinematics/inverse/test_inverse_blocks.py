"""Large batches are cut into blocks that threads work on: no pose may learn of that."""

from __future__ import annotations

import os
import threading

import numpy as np
import pytest
from inverse_arms import arm, gap, random_joints

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse import closed_form
from trajcli.kinematics.inverse.solve import solve

COUNT = 25_000  # six blocks and a part of one


@pytest.mark.parametrize("name", ["wrist over elbow", "UR"])
def test_a_large_batch_has_the_answers_of_its_parts_to_the_last_bit(name, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    started = []
    start = threading.Thread.start
    monkeypatch.setattr(threading.Thread, "start", lambda thread: (started.append(thread), start(thread)))
    rng = np.random.default_rng(7)
    robot = arm(name, rng)
    joints = random_joints(robot, rng, COUNT)
    poses = forward(robot, joints)
    whole = solve(robot, poses)
    count = len(started)
    assert 1 <= count <= 2  # three would have less than three blocks each
    there = np.where(whole.valid, gap(robot, whole.joints, joints[:, None]), np.inf).min(axis=1)
    assert there.max() < 1e-6
    off = np.abs(forward(robot, whole.joints) - poses[:, None]).max(axis=(-2, -1))
    assert off[whole.valid].max() < 1e-10
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    for part in (slice(0, COUNT), slice(4090, 4103), slice(4096, 4097), slice(COUNT - 999, COUNT)):
        some = solve(robot, poses[part])
        for all_of_them, these in ((whole.joints, some.joints), (whole.closure, some.closure)):
            assert all_of_them[part].tobytes() == these.tobytes()
        assert (whole.valid[part] == some.valid).all()
    assert len(started) == count


def test_what_fails_in_a_thread_is_raised(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    robot = arm("UR")
    poses = forward(robot, np.ones((COUNT, 6)))

    def fail(*_):
        raise ZeroDivisionError("in a block")

    monkeypatch.setattr(closed_form, "_write", fail)
    with pytest.raises(ZeroDivisionError, match="in a block"):
        solve(robot, poses)
