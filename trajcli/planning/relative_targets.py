"""Targets relative to where the arm stands, or to points that are given by their joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Model
from trajcli.language.targets import Target

T = TypeVar("T")


@frozen
class Stand:
    """Where the arm stands before a move.

    Attributes:
        robot: With the tool in force.
        joints: Its joint values (n,), rad or m; None before the start.
        target: How the job gives that; None where it does not.
        points: The named points of the job.
    """

    robot: Robot
    joints: Array | None
    target: Target | None
    points: Mapping[str, Target]

    def placed(self, value: T) -> T:
        """Return a move, a target, or a list of them, with joints or a pose in each target that waits for it.

        Raises:
            InputError: When nothing stands yet, or the arm has no geometry.
        """
        if isinstance(value, Target):
            return self._target(value) if value.waits else value  # type: ignore[return-value]
        if isinstance(value, Model):
            fields = {name: getattr(value, name) for name in value.model_fields_set}
            new = {name: self.placed(field) for name, field in fields.items()}
            changed = {name: field for name, field in new.items() if field is not fields[name]}
            return value.model_copy(update=changed) if changed else value
        if isinstance(value, list | tuple) and any(isinstance(item, Model) for item in value):
            items = [self.placed(item) for item in value]
            same = all(new is old for new, old in zip(items, value, strict=True))
            return value if same else type(value)(items)
        return value

    def _target(self, target: Target) -> Target:
        if target.joints_by is not None:
            joints = tuple((self._joints() + np.array(target.joints_by)).tolist())
            return target.model_copy(update={"joints_by": None, "joints": joints})
        pose = self._pose(target)
        near = self.points.get(target.relative.origin) if target.relative is not None else None
        fields: dict[str, Any] = {
            "relative": None,
            "near": None if near is None else near.joints,
            "xyz": tuple(pose[:3, 3].tolist()),
            "matrix": tuple(map(tuple, pose[:3, :3].tolist())),
        }
        return target.model_copy(update=fields)

    def _joints(self) -> Array:
        if self.joints is None:
            raise InputError("the start cannot be relative to where the arm stands", hint="give it as it is")
        return self.joints

    def _pose(self, target: Target) -> Array:
        if self.robot.convention is None:
            hint = "give its joints theta, d, a and alpha"
            raise InputError(
                f"{self.robot.name} has no geometry, so nothing is relative to its tool", hint=hint
            )
        if target.relative is not None:
            at_here = target.relative.origin == "here"
            return target.relative.after(
                self._here() if at_here else self._pose(self.points[target.relative.origin])
            )
        if target.gives_pose:
            return target.full_pose()
        joints = target.joints or (self._joints() + np.array(target.joints_by)).tolist()
        return forward(self.robot, np.array(joints))

    def _here(self) -> Array:
        """Return where the tool stands, (4, 4): as the job says it, where it gives a whole pose."""
        joints, given = self._joints(), self.target
        if given is not None and given.gives_position and given.rotation_form is not None:
            return given.full_pose()
        return forward(self.robot, joints)
