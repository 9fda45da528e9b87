"""Closed form of one arm: its solver, the choices between its solutions, and the names of its branches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Literal

from trajcli.frozen import comparable, frozen
from trajcli.kinematics.inverse.families.screw_axes import Displacement, Floats
from trajcli.kinematics.inverse.families.subproblems import DegeneracyFlags, Value
from trajcli.kinematics.robot import Robot

Choice = Literal["shoulder", "elbow", "wrist"]
Solver = Callable[[Displacement, DegeneracyFlags], Sequence[Value]]
NAMES = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("no_flip", "flip")}


@comparable
class Branch:
    """The name of a branch, in the words of a job's `configuration`; None where there is no such choice."""

    shoulder: str | None = None
    elbow: str | None = None
    wrist: str | None = None

    def __str__(self) -> str:
        return " ".join(name for name in (self.shoulder, self.elbow, self.wrist) if name) or "only"


@frozen
class IkMethod:
    """How the inverse kinematics of one arm is found.

    Attributes:
        name: For people, as "spherical wrist over elbow".
        family: Name of the closed form, or "numeric".
        choices: Which choices there are, in the order in which the solver makes them.
        reason: Why it was chosen, one sentence.
        solve: Values of all joints for a block of B goals, each of a shape that broadcasts to (2, ..., 2, B):
            one array axis for each choice, the last choice first, poses last. None for the numeric method.
        needs: Whether the closed form uses the whole pose or the position alone.
        idle: A direction in the base along which the position does not matter to the closed form; None
            where all of it does.
        labels: Names of the solutions where one name may have several.
        held: The arm without its last joint, where that has a closed form: one joint more than six is held
            at sample values.
    """

    name: str
    family: str
    choices: tuple[Choice, ...]
    reason: str
    solve: Solver | None = None
    needs: Literal["pose", "position"] = "pose"
    idle: Floats | None = None
    labels: tuple[Branch, ...] = ()
    held: Robot | None = None

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Names of the branches, in the order of the solutions; none where there is no closed form."""
        if self.labels or self.solve is None:
            return self.labels
        order: tuple[Choice, ...] = ("shoulder", "elbow", "wrist")
        present = [choice for choice in order if choice in self.choices]
        rows = product(*(NAMES[choice] for choice in present))
        return tuple(Branch(**dict(zip(present, row, strict=True))) for row in rows)
