"""States near the ends of ranges: which of them are too fast there, at either end, at the start or at the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.limits.velocity_by_position import FAMILY
from trajcli.trajectory import State

LOW, HIGH, D, OFFSET = -2.0, 1.0, 6.0, 0.3  # the range is not symmetric


def robot(joint: int) -> Robot:
    """Return three joints, one of which has limits of velocity by position."""
    rows = np.tile([np.inf, 0.0], (3, 1))
    rows[joint] = D, OFFSET
    limits = replace(unlimited(3), position=np.tile([LOW, HIGH], (3, 1)), velocity_by_position=rows)
    return Robot("bare", tuple(Joint(f"j{k}") for k in range(3)), limits, None, np.eye(4), np.eye(4))


def state(joint: int, upper: bool, share: float) -> State:
    """Return a joint 0.1 before an end of its range, with a share of the velocity that is allowed there."""
    position, velocity = np.zeros(3), np.zeros(3)
    position[joint] = HIGH - 0.1 if upper else LOW + 0.1
    velocity[joint] = share * (1 if upper else -1) * (np.sqrt(2 * D * 0.1) - OFFSET)
    return State(position, velocity, np.zeros(3))


REST = State(np.zeros(3), np.zeros(3), np.zeros(3))


@pytest.mark.parametrize("joint", range(3))
@pytest.mark.parametrize("upper", [True, False])
@pytest.mark.parametrize(("share", "over"), [(1 + 1e-8, True), (1 - 1e-8, False), (-1.5, False)])
def test_a_state_is_over_where_it_moves_too_fast_towards_an_end(joint, upper, share, over):
    arm, fast, use = robot(joint), state(joint, upper, share), ("velocity_by_position", joint, 0.0)
    assert FAMILY.over_at_ends(arm, [fast, REST], use) is over
    assert FAMILY.over_at_ends(arm, [REST, fast], use) is over
    assert not FAMILY.over_at_ends(arm, [REST, REST], use)
    reason = FAMILY.why_not_in_state(arm, fast)
    assert (reason is not None) is over
    if reason is not None:
        _, amounts = reason
        assert amounts["joint"] == f"j{joint}"
        assert amounts["value"].value == fast.velocity[joint]
        assert amounts["limit"].value == pytest.approx(fast.velocity[joint] / share, rel=1e-9)
