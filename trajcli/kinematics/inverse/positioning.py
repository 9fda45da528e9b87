"""Arms of three joints that bring the tcp to a place in space: the bases of `bases` by themselves.

The number of solutions is that of the base: four for the elbow (with or without offsets of the shoulder), RRP
two or four, RPP two, PPP one. The orientation follows; a target that fixes it is met only if it agrees.
"""

from __future__ import annotations

from collections.abc import Sequence

from trajcli.frozen import frozen
from trajcli.kinematics.inverse.bases import Base, base_of
from trajcli.kinematics.inverse.lines import Arm, Floats, Goal
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.inverse.subproblems import Value, Watch


@frozen
class Positioning:
    """The solver of one arm."""

    base: Base
    tip: Floats

    def __call__(self, goal: Goal, watch: Watch) -> Sequence[Value]:
        """Return the joints, with the choices of the base."""
        return self.base.reach(self.tip, goal.point(self.tip), watch)


def match(arm: Arm) -> Method | None:
    """Return the method where the arm has three joints that `bases` knows."""
    base = base_of(arm) if len(arm.lines) == 3 else None
    if base is None:
        return None
    tip = (float(arm.home[0, 3]), float(arm.home[1, 3]), float(arm.home[2, 3]))
    name = f"{base.name} ({arm.kinds})"
    reason = f"three joints ({arm.kinds}) that place the tcp: {base.name}"
    return Method(name, "positioning", base.choices, reason, Positioning(base, tip), "position")
