"""Robot of a URDF: its serial chain as standard Denavit-Hartenberg rows, with limits and inertias.

Files write right angles as 1.5708. Each angle of an origin that is near a whole number of right angles is
taken as that, unless all digits are asked for: else hardly any axes would be parallel or meet, no closed form
of the inverse kinematics would fit, and offsets along almost parallel axes would be kilometres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import pi

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.dh_rows import AxisInChain, DhTable, dh_table
from trajcli.kinematics.robot import Joint, Limits, LinkInertia, Robot
from trajcli.urdf.joint_properties import (
    JointProperties,
    joint_properties,
    link_inertia,
    origin_of,
)
from trajcli.urdf.read import JointElement, UrdfDocument, parse_urdf
from trajcli.urdf.tree import SerialPath, serial_path

SNAPPED_WITHIN = 1e-3
"""How near to a whole number of right angles an angle is taken as that, rad."""
_RIGHT = 1e-14  # rad: an angle so near to right ones is written with all the digits that it can have
_FREE_SLIDE = 1.0  # m: how far a slide without limits is taken to go where distances are counted


@comparable
class SnappedAngle:
    """An angle of a joint's origin that was taken as a whole number of right angles.

    Attributes:
        joint: Name of the joint.
        axis: About which axis of the parent it turns: x, y or z.
        written: In the file, rad.
        taken: Instead of it, rad.
        distance: The most that the tcp moves by it, m; a slide without limits within 1 m.
    """

    joint: str
    axis: str
    written: float
    taken: float
    distance: float

    def __str__(self) -> str:
        moved = f"moves the tcp by at most {_rounded_up(self.distance)} m"
        return f"{self.joint}: rpy about {self.axis} {self.written!r} taken as {self.taken!r}, {moved}"


@frozen
class UrdfRobot:
    """The robot of a URDF, and what was decided on the way to it.

    Attributes:
        robot: Its base is the pose of the first row's frame in the root link: `world` is the root.
        root: Name of the link where the chain begins.
        tip: Name of the link where it ends: the tcp.
        other_tips: Links in which the tree ends too.
        other_roots: Where further trees of the file begin, of which nobody said which one is meant.
        snapped: Angles that were taken as whole numbers of right angles.
        notes: What was taken as unknown, left out, or is not taken over.
    """

    robot: Robot
    root: str
    tip: str
    other_tips: tuple[str, ...]
    other_roots: tuple[str, ...]
    snapped: tuple[SnappedAngle, ...]
    notes: tuple[str, ...]

    @property
    def distance(self) -> float:
        """The most that the tcp moves by all angles that were snapped, m."""
        return math.fsum(each.distance for each in self.snapped)

    @property
    def turn(self) -> float:
        """The most that the tool turns by them, rad."""
        return math.fsum(abs(each.written - each.taken) for each in self.snapped)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user should know about the numbers, one sentence each."""
        ends = f"; the tree also ends in {', '.join(self.other_tips)}" if self.other_tips else ""
        return (
            f"from link {self.root} to link {self.tip}{ends}",
            *filter(None, [self.choice, self.snapping]),
            *map(str, self.snapped),
            *self.notes,
        )

    @property
    def choice(self) -> str | None:
        """One sentence on the trees that were passed over; None where there are none."""
        if not self.other_roots:
            return None
        count, others = 1 + len(self.other_roots), ", ".join(self.other_roots)
        chosen = f"the file has {count} trees of links, and the arm is that of root '{self.root}'"
        return f"{chosen}; the others begin at {others}: `root` or `tip` names one"

    @property
    def snapping(self) -> str | None:
        """One sentence on the angles that were snapped; None where there are none."""
        if not self.snapped:
            return None
        count = len(self.snapped)
        angles = "1 angle" if count == 1 else f"{count} angles"
        return (
            f"{angles} of joint origins within {SNAPPED_WITHIN:g} rad of whole right angles taken as these: "
            f"the tcp moves by at most {_rounded_up(self.distance)} m and turns by at most "
            f"{_rounded_up(self.turn)} rad; `exact` keeps all digits"
        )


def robot_of_urdf(
    data: bytes,
    file: str,
    *,
    root: str | None = None,
    tip: str | None = None,
    exact: bool = False,
    soft: bool = False,
) -> UrdfRobot:
    """Return the robot that a URDF describes.

    Args:
        data: The whole file.
        file: Its path, for messages.
        root: Link where the chain begins; the outermost one where it is left out.
        tip: Link where it ends; the end of the longest chain without a gripper where it is left out.
        exact: Whether angles near right ones are kept as they are.
        soft: Whether soft limits tighten the ranges.

    Raises:
        InputError: When the file is no URDF, has no such chain, or a number of the chain is wrong.
    """
    document = parse_urdf(data, file)
    path = serial_path(document, root, tip)
    moving = [joint for joint in path.joints if joint.moves]
    properties = [joint_properties(document, joint, soft=soft) for joint in moving]
    origins, table = origins_and_table(document, path, exact=exact)
    notes = [note for each in properties for note in each.notes]
    # what is not of the chain, such as a gripper, is fixed where its joints are at zero
    behind = links_of_rows(document, path, origins, table, notes)[1:]
    inertias = [link_inertia(document, parts, notes) for parts in behind]
    robot = _robot(document, moving, table, properties, inertias)
    snapped = () if exact else tuple(_snapped(document, path, origins, properties))
    return UrdfRobot(robot, path.root, path.tip, path.other_tips, path.other_roots, snapped, tuple(notes))


def origins_and_table(
    document: UrdfDocument, path: SerialPath, *, exact: bool
) -> tuple[list[Array], DhTable]:
    """Return the pose of each joint of a chain in its parent, (4, 4), and the rows that they come to."""
    origins = [
        origin_of(document, joint.element, None if exact else _angles(document, joint)[1])
        for joint in path.joints
    ]
    axes, end = _axes(document, path, origins)
    return origins, dh_table(axes, end)


def _angles(document: UrdfDocument, joint: JointElement) -> tuple[Array, Array]:
    """Return the angles of a joint's origin as written, and snapped, each of shape (3,), rad."""
    written = document.numbers(joint.element.first("origin"), "rpy", 3, (0.0, 0.0, 0.0))
    whole = np.round(written / (pi / 2)) * (pi / 2)
    return written, np.where(np.abs(written - whole) <= SNAPPED_WITHIN, whole, written) + 0.0


def _axes(
    document: UrdfDocument, path: SerialPath, origins: Sequence[Array]
) -> tuple[list[AxisInChain], Array]:
    """Return the joints that move with the fixed ones folded in, and the tip's pose behind the last."""
    axes: list[AxisInChain] = []
    pose = np.eye(4)
    for joint, origin in zip(path.joints, origins, strict=True):
        pose = pose @ origin
        if joint.moves:
            axes.append(AxisInChain(joint.type == "prismatic", pose, _axis(document, joint)))
            pose = np.eye(4)
    return axes, pose


def _axis(document: UrdfDocument, joint: JointElement) -> Array:
    """Return the unit vector of a joint's axis in its frame."""
    element = joint.element.first("axis")
    axis = document.numbers(element, "xyz", 3, (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        message = f"the axis of joint '{joint.name}' is 0 0 0 and has no direction"
        raise document.refused(message, element or joint.element, "xyz")
    unit: Array = axis / length
    return unit


def _robot(
    document: UrdfDocument,
    moving: Sequence[JointElement],
    table: DhTable,
    properties: Sequence[JointProperties],
    inertias: Sequence[LinkInertia | None],
) -> Robot:
    joints = tuple(
        Joint(
            joint.name,
            "prismatic" if joint.type == "prismatic" else "revolute",
            *row[:4],
            beta=row[4],
            effort=each.effort,
            friction=each.friction,
            link=link,
        )
        for joint, row, each, link in zip(moving, table.rows, properties, inertias, strict=True)
    )
    position, velocity, acceleration, jerk = (
        np.array([getattr(each, quantity) for each in properties])
        for quantity in ("position", "velocity", "acceleration", "jerk")
    )
    bounded = np.isfinite(position).all(axis=1)
    near = np.array([each.velocity_by_position for each in properties])
    by_position = np.where(bounded[:, None], near, (np.inf, 0.0))  # there is no end to be near to
    limits = _limits(document, (position, velocity, acceleration, jerk), by_position)
    return Robot(document.name, joints, limits, "standard", table.base, table.tool)


def _limits(document: UrdfDocument, bounds: tuple[Array, Array, Array, Array], by_position: Array) -> Limits:
    try:
        return Limits(*bounds, velocity_by_position=by_position)
    except ValueError as error:
        raise InputError(Problem(str(error), place=Place(document.file, 1, 1))) from None


def links_of_rows(
    document: UrdfDocument, path: SerialPath, origins: Sequence[Array], table: DhTable, notes: list[str]
) -> list[list[tuple[str, Array]]]:
    """Return the links that move with the base, then with each row: names, and poses (4, 4) in its frame.

    What is not of the chain, such as a gripper, is fixed where its joints are at zero; what is behind a joint
    whose origin is none is left out, which `notes` get a line for.
    """
    below: dict[str, list[JointElement]] = {}
    for joint in document.joints.values():
        below.setdefault(joint.parent, []).append(joint)
    moving = [joint for joint in path.joints if joint.moves]
    of_chain = {joint.name: origin for joint, origin in zip(path.joints, origins, strict=True)}
    above = np.asarray(np.linalg.inv(table.base), float)
    starts = [(path.root, above)]
    starts += [(joint.child, frame) for joint, frame in zip(moving, table.links, strict=True)]
    rows: list[list[tuple[str, Array]]] = []
    for start in starts:
        parts, links = list[tuple[str, Array]](), [start]
        while links:
            link, pose = links.pop()
            parts.append((link, pose))
            for joint in below.get(link, []):
                if not (joint.moves and joint.name in of_chain):
                    origin = of_chain.get(joint.name)
                    try:
                        origin = origin_of(document, joint.element) if origin is None else origin
                    except InputError as error:
                        flaw = error.problems[0].message
                        notes.append(f"joint {joint.name}: {flaw}; the links behind it are left out")
                        continue
                    links.append((joint.child, pose @ origin))
        rows.append(parts)
    return rows


def _snapped(
    document: UrdfDocument, path: SerialPath, origins: Sequence[Array], properties: Sequence[JointProperties]
) -> list[SnappedAngle]:
    """Return the angles that were snapped, from the root on.

    A turn by an angle moves what is at a distance r by at most that angle times r, and r is at most all
    lengths between.
    """
    ranges = iter(properties[::-1])
    snapped: list[SnappedAngle] = []
    beyond = 0.0
    for joint, origin in zip(path.joints[::-1], origins[::-1], strict=True):
        ends = next(ranges).position if joint.moves else (0.0, 0.0)
        if joint.type == "prismatic":
            beyond += max(abs(end) if np.isfinite(end) else _FREE_SLIDE for end in ends)
        written, taken = _angles(document, joint)
        for axis, before, after in reversed(list(zip("xyz", written.tolist(), taken.tolist(), strict=True))):
            off = abs(before - after)
            if off > _RIGHT * max(1.0, abs(after)):
                snapped.append(SnappedAngle(joint.name, axis, before, after, off * beyond))
        beyond += float(np.linalg.norm(origin[:3, 3]))
    return snapped[::-1]


def _rounded_up(value: float) -> str:
    """Return a bound with three digits, rounded up."""
    shown = f"{value:.3g}"
    return shown if float(shown) >= value else f"{value * 1.005:.3g}"
