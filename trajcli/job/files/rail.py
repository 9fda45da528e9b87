"""Robot of a job that is an arm on a rail or a lift: a slide whose row fits the rows of the arm.

The axis of a slide is a direction, so that its row has no lengths: B Tz(q) Rx(alpha) Rz(c) is where the arm
stands, with the z axis of B along the rail, its x axis along the common normal of rail and first joint, and c
added to the theta of that joint.

Source: Denavit and Hartenberg (1955).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place
from trajcli.frozen import frozen
from trajcli.job.yaml.document import Document
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.robot import QUANTITIES, Joint, Limits, LinkInertia, Robot
from trajcli.language.dynamics import FrictionSpec
from trajcli.language.limits import EffortBound, JointBound
from trajcli.language.numbers import MAX_JOINTS, Model, Name, Number, ReadingContext
from trajcli.language.per_joint import UNLIMITED, LowerUpper
from trajcli.language.poses import Pose
from trajcli.language.targets import Direction
from trajcli.units import Quantity

_MASS = Quantity("mass")
_PARALLEL = 1e-12  # of a unit vector: a lift


class RailSpec(Model):
    """A slide under an arm: a rail, a lift."""

    axis: Annotated[
        tuple[float, ...], Direction("Along which it counts, in the frame of the base: x, y, z or a vector.")
    ]
    name: Annotated[str, Name("Of the joint.")] = "rail"
    position: Annotated[LowerUpper, JointBound(0, "Range [lower, upper] (length unit).")] = UNLIMITED
    velocity: Annotated[LowerUpper, JointBound(1, "Velocity limit, or [lower, upper], per s.")] = UNLIMITED
    acceleration: Annotated[LowerUpper, JointBound(2, "Acceleration limit, or [lower, upper], per s^2.")] = (
        UNLIMITED
    )
    jerk: Annotated[LowerUpper, JointBound(3, "Jerk limit, or [lower, upper], per s^3.")] = UNLIMITED
    effort: Annotated[LowerUpper, EffortBound("Force limit, or [lower, upper], N.")] = UNLIMITED
    friction: Annotated[FrictionSpec, Field(description="Friction of the slide.")] = FrictionSpec()
    rotor: Annotated[float, Number(_MASS, "Motor's inertia as the slide feels it, kg.", at_least=0.0)] = 0.0
    mass: Annotated[
        float | None,
        Number(_MASS, "Mass of the carriage without the arm, kg; torques need it.", above=0.0),
    ] = None

    @model_validator(mode="before")
    @classmethod
    def _announce_type(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        if isinstance(info.context, ReadingContext):
            info.context.joint_types = ("prismatic",)  # of which the units of its limits are
        return data


class RobotOnRail(Model):
    """An arm on a rail or a lift."""

    rail: Annotated[RailSpec, Field(description="The slide under the arm.")]
    arm: Annotated[Any, Field(description="The arm: as a robot without a rail is given.")]
    mount: Annotated[
        np.ndarray | None,
        Pose("Where the arm stands when the rail is at zero, in the base; left out: the arm's own base."),
    ] = None


@frozen
class _DocumentOfArm(Document):
    """A job's document with the arm of its rail in the place of its robot; places are those of the job."""

    whole: Document

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where the deepest existing node on the path stands in the whole."""
        below = ("robot", "arm", *path[1:]) if path[:1] == ("robot",) else path
        return self.whole.place(below, key=key)


def document_of_arm(document: Document) -> Document:
    """Return a job's document with the arm of its rail in the place of its robot."""
    arm, root = document.node(("robot", "arm")), document.root
    if arm is not None and isinstance(root.value, dict):
        root = root._replace(value={**root.value, "robot": arm})
    return _DocumentOfArm(document.file, document.lines, root, document)


def arm_on_rail(model: RobotOnRail, arm: Robot) -> Robot:
    """Return an arm on a rail.

    Args:
        model: As the job gives it.
        arm: The arm that it names.

    Raises:
        InputError: When the arm has no geometry, too many joints, or one of the rail's name.
    """
    problem = _unfit(arm, model.rail)
    if problem is not None:
        raise InputError(problem[0], hint=problem[1])
    mount = arm.base
    if model.mount is not None:
        mount = model.mount if arm.foot is None else model.mount @ arm.foot
    slide, bounds = _slide(model.rail, efforts=arm.limits.has_effort)
    robot = on_carriage(arm, np.array(model.rail.axis), slide, bounds, mount)
    return replace(robot, name=f"{arm.name} on {model.rail.name}")


def _unfit(arm: Robot, rail: RailSpec) -> tuple[str, str] | None:
    """Return why an arm cannot stand on a rail, and what helps; None where it can."""
    if arm.convention is None:
        return f"{arm.name} has bare joints and no geometry to stand on a rail", "give its joints DH rows"
    if len(arm.joints) == MAX_JOINTS:
        return f"a robot has at most {MAX_JOINTS} joints, {arm.name} has as many without the rail", "no rail"
    if rail.name in arm.joint_names:
        return f"joint names must be unique, '{rail.name}' is a joint of {arm.name}", "give the rail a `name`"
    return None


def _slide(rail: RailSpec, *, efforts: bool) -> tuple[Joint, Limits]:
    """Return the slide as a joint, with its limits."""
    link = None if rail.mass is None else LinkInertia(rail.mass, (0.0, 0.0, 0.0), (0.0,) * 6)
    joint = Joint(
        rail.name,
        "prismatic",
        effort=rail.effort,
        friction=rail.friction.as_friction(),
        rotor=rail.rotor,
        link=link,
    )
    bounds = [np.array([bound]) for bound in (rail.position, rail.velocity, rail.acceleration, rail.jerk)]
    effort = np.array([rail.effort if efforts and link is not None else UNLIMITED])
    return joint, Limits(bounds[0], bounds[1], bounds[2], bounds[3], effort=effort)


def on_carriage(arm: Robot, axis: Array, slide: Joint, bounds: Limits, mount: Array) -> Robot:
    """Return an arm on a slide.

    Args:
        arm: With geometry; its own base does not count.
        axis: Direction in which the slide counts, (3,), in the frame of the base.
        slide: Its name, effort, friction, rotor and mass; a prismatic joint.
        bounds: Of the slide alone.
        mount: Where the arm stands when the slide is at zero, in the frame of the base, (4, 4).
    """
    first, modified = arm.joints[0], arm.convention == "modified"
    frame = mount @ row_pose((0.0, 0.0, first.a, first.alpha, first.beta)) if modified else mount
    foot, alpha, turn = _foot(axis / np.linalg.norm(axis), frame)
    rail = replace(slide, alpha=0.0 if modified else alpha)
    turned = replace(first, theta=first.theta + turn)
    if modified:
        turned = replace(turned, alpha=alpha, a=0.0, beta=0.0)
    return replace(
        arm,
        joints=(rail, turned, *arm.joints[1:]),
        limits=_stacked(bounds, arm.limits),
        base=foot,
        foot=foot,
    )


def _foot(axis: Array, frame: Array) -> tuple[Array, float, float]:
    """Return the frame (4, 4) of a slide, and alpha and c between it and the frame of the first joint."""
    foot = frame.copy()
    across, along = np.cross(axis, frame[:3, 2]), float(axis @ frame[:3, 2])
    sine = float(np.linalg.norm(across))
    x = frame[:3, 0] if sine <= _PARALLEL else across / sine
    foot[:3, :3] = np.column_stack([x, np.cross(axis, x), axis])
    alpha = atan2(0.0 if sine <= _PARALLEL else sine, along)
    left = row_pose((0.0, 0.0, 0.0, -alpha, 0.0))[:3, :3] @ foot[:3, :3].T @ frame[:3, :3]
    return foot, alpha, 0.0 if sine <= _PARALLEL else atan2(float(left[1, 0]), float(left[0, 0]))


def _stacked(first: Limits, others: Limits) -> Limits:
    """Return the limits of a joint and those behind it; those of the tool are the others'."""
    names = (*QUANTITIES, "velocity_by_position", "effort")
    rows = {name: np.concatenate([getattr(first, name), getattr(others, name)]) for name in names}
    return Limits(**rows, tcp=others.tcp)
