"""Configurations of six-axis arms in the flags of their makers' programs: ABB, KUKA, FANUC.

Three choices tell the branches of an elbow arm with a spherical wrist apart: whether the wrist centre lies
in front of joint 1 or behind it, as the arm is turned; to which side of the line through joints 2 and 3 the
wrist centre bends the elbow; and the sign of joint 5. Each is read from the axes of the arm as they stand,
and what the words mean from where it stands at zero (ABB, FANUC: upper arm upright, forearm ahead) or with
joint 3 at 90 deg (KUKA, whose arm is stretched at zero). Turns are counted in the values of the joints, which
are those of the controller.

Source: ABB, Technical reference manual RAPID, data type `confdata`; KUKA System Software, Operating and
programming instructions, Status and Turn; FANUC, Operator's manual, configuration of a position.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError
from trajcli.frozen import comparable
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import all_turns
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot

Flags = NDArray[np.bool_]
_SIX = 6
_SAME = 1e-6  # of a unit vector, and of the arm's length: axes that are parallel, or meet
_NEITHER = 1e-9  # m^2, m or rad: in between both of two branches count
_OTHER_ZERO = {"KR 210 L150-2": ((0.0, -pi / 2, 0.0, 0.0, 0.0, 0.0), (1, 1, 1, -1, 1, -1))}
"""Arms of the catalogue whose joints count otherwise than on their controller: offsets, rad, and signs."""
_FANUC = re.compile(r"([NF]),?([UD]),?([TB]),?(?:(-?\d),?(-?\d),?(-?\d))?")


@comparable
class VendorFlags:
    """Flags of a maker, as what they say of the joints.

    Attributes:
        text: As in the job.
        ahead: Whether the wrist centre lies in front of joint 1.
        bent: Whether the elbow bends as where the arm stands with joint 3 at `zero`.
        positive: Whether joint 5 is above zero.
        turns: Joint, lowest and highest value, rad: where it shall be.
        zero: Of joint 3, rad.
    """

    text: str
    ahead: bool
    bent: bool
    positive: bool
    turns: tuple[tuple[int, float, float], ...] = ()
    zero: float = 0.0

    def met(self, robot: Robot, joints: Array) -> Flags:
        """Return which joint values (K, n) are on the branch.

        Raises:
            InputError: When the arm has no such branches.
        """
        first = first_of_six(robot)
        home = np.zeros((1, joints.shape[1]))
        home[0, first + 2] = self.zero
        ahead, bend = _posture(robot, np.concatenate([home, joints]), first)
        sides = ((ahead[1:], self.ahead, ahead[0]), (bend[1:], self.bent, bend[0]))
        met = _on_side(joints[:, first + 4], self.positive, 1.0)
        for values, wanted, at_home in sides:
            met &= _on_side(values, wanted, float(at_home))
        return met

    def in_turns(
        self, robot: Robot, joints: Array, near: Array, pinned: Collection[int] = ()
    ) -> tuple[Array, list[int]]:
        """Return joint values in the turns that are said, and which joints are in none of theirs.

        A joint that no turn within its limits brings where it shall be may be in any of them.

        Args:
            robot: An arm with such branches.
            joints: What is turned, (n,), rad or m.
            near: Joint values (n,); the nearest to them come first.
            pinned: Indices of joints that stay as they are.

        Returns:
            Joint values (K, n), K >= 1, and indices of joints.
        """
        turned = all_turns(robot, joints, pinned)
        missed = self.missed_turns(robot, turned)
        count = missed.sum(axis=1)
        turned, missed = turned[count == count.min()], missed[count == count.min()]
        order = np.abs(turned - near).max(axis=1).argsort(kind="stable")
        first = first_of_six(robot)
        wrong = [first + turn[0] for turn, off in zip(self.turns, missed[0], strict=True) if off]
        return turned[order], wrong

    def missed_turns(self, robot: Robot, joints: Array) -> NDArray[np.bool_]:
        """Return for joint values (K, n) which of the turns are not as they are said, (K, turns)."""
        first, values = first_of_six(robot), np.empty((len(joints), len(self.turns)))
        zero = next((zero for name, zero in _OTHER_ZERO.items() if robot.name.startswith(name)), None)
        for k, (joint, _, _) in enumerate(self.turns):
            values[:, k] = joints[:, first + joint]
            if zero is not None:
                values[:, k] = zero[1][joint] * values[:, k] + zero[0][joint]
        low, high = (np.array([turn[side] for turn in self.turns]) for side in (1, 2))
        return np.asarray((values < low - _NEITHER) | (values > high + _NEITHER))

    def require(self, robot: Robot, joints: Array) -> None:
        """Do nothing when joint values (n,) are on the branch.

        Raises:
            InputError: When the arm has no such branches.
            PlanningError: When they are on another one.
        """
        if not self.met(robot, joints[None])[0]:
            message = f"the arm arrives in another configuration than {self.text}"
            hint = "on a path the arm keeps its branch: start in that configuration, or leave it out"
            raise PlanningError(message, hint=hint)


def abb_flags(numbers: Sequence[int]) -> VendorFlags:
    """Return the flags [cf1, cf4, cf6, cfx]: quadrants of joints 1, 4 and 6, and one of eight branches."""
    branch, quarter = numbers[3], pi / 2
    turns = tuple((j, n * quarter, (n + 1) * quarter) for j, n in zip((0, 3, 5), numbers, strict=False))
    text = f"abb [{', '.join(map(str, numbers))}]"
    return VendorFlags(text, branch < 4, branch // 2 % 2 == 0, branch % 2 == 0, turns)


def kuka_flags(status: int, turn: int | None) -> VendorFlags:
    """Return the flags of a status, bits 0 to 2, and of a turn, a bit for each joint below zero."""
    turns: tuple[tuple[int, float, float], ...] = ()
    if turn is not None:
        turns = tuple((j, *((-inf, 0.0) if turn >> j & 1 else (0.0, inf))) for j in range(_SIX))
    text = f"kuka s {status}" + ("" if turn is None else f", t {turn}")
    return VendorFlags(text, not status & 1, bool(status & 2), not status & 4, turns, pi / 2)


def fanuc_flags(text: str) -> VendorFlags | None:
    """Return the flags of a text such as 'N U T, 0, 0, 0'; None where it is none.

    Behind the letters stand the turns of joints 1, 4 and 6: 0 is within half a turn from zero.
    """
    found = _FANUC.fullmatch(
        re.sub(r"[\s']|,(?=\s*[^\d\s-])", "", text).replace("T,", "T").replace("B,", "B")
    )
    if found is None:
        return None
    wrist, elbow, side, *counts = found.groups()
    turns: tuple[tuple[int, float, float], ...] = ()
    if counts[0] is not None:
        counted = zip((0, 3, 5), map(int, counts), strict=True)
        turns = tuple((j, (2 * n - 1) * pi, (2 * n + 1) * pi) for j, n in counted)
    return VendorFlags(f"fanuc '{text.strip()}'", side == "T", elbow == "U", wrist == "F", turns)


def _on_side(values: Array, wanted: bool, reference: float) -> Flags:
    """Return which values (K,) have the sign of the reference, or the other one; near zero both count."""
    sign = np.sign(reference) if wanted else -np.sign(reference)
    return np.asarray((values * sign > 0.0) | (np.abs(values) <= _NEITHER))


def _axes(robot: Robot, joints: Array) -> tuple[Array, Array]:
    """Return directions and points (K, n, 3) of the axes of the joints, which turn, at values (K, n)."""
    columns, tips = jacobian(robot, joints), forward(robot, joints)[:, :3, 3]
    directions = np.swapaxes(columns[:, 3:], 1, 2)
    return directions, tips[:, None] - np.cross(np.swapaxes(columns[:, :3], 1, 2), directions)


def _apart(directions: Array, points: Array) -> Array:
    """Return by how much three axes (K, 3, 3) miss the point that is nearest to them, (K,)."""
    across = np.eye(3) - directions[..., :, None] * directions[..., None, :]
    sides = (across @ points[..., None]).sum(axis=1)
    centres = np.linalg.solve(across.sum(axis=1), sides)[..., 0]
    apart = (across @ (centres[:, None] - points)[..., None])[..., 0]
    return np.asarray(np.linalg.norm(apart, axis=-1).max(axis=-1))


def _posture(robot: Robot, joints: Array, first: int) -> tuple[Array, Array]:
    """Return how far the wrist centre is ahead of joint 1, m, and the bend of the elbow, m^2, each (K,)."""
    directions, points = (part[:, first : first + _SIX] for part in _axes(robot, joints))
    centres = _centres(directions, points)
    one, two = directions[:, 0], directions[:, 1]
    ahead = np.einsum("ki,ki->k", np.cross(two, one), centres - points[:, 0])
    upper, fore = points[:, 2] - points[:, 1], centres - points[:, 2]
    return ahead, np.einsum("ki,ki->k", np.cross(upper, fore), two)


def _centres(directions: Array, points: Array) -> Array:
    """Return the wrist centres (K, 3) of six axes; joints 4 and 6 in line do not matter."""
    normal = np.cross(directions[:, 3], directions[:, 4])
    gap = points[:, 4] - points[:, 3]
    along = np.einsum("ki,ki->k", np.cross(gap, directions[:, 4]), normal)
    along = along / np.square(normal).sum(axis=1)
    return np.asarray(points[:, 3] + along[:, None] * directions[:, 3])


def first_of_six(robot: Robot) -> int:
    """Return the index of the first of the six joints of an elbow arm with a spherical wrist.

    Raises:
        InputError: When the arm is none: then it has no such branches.
    """
    kinds = robot.joint_types
    first = len(kinds) - _SIX
    if first >= 0 and all(kind == "revolute" for kind in kinds[first:]) and "revolute" not in kinds[:first]:
        spread = np.sin(np.arange(1.0, len(kinds) + 1))[None]  # regular, as almost everywhere
        directions, points = (part[:, first:] for part in _axes(robot, spread))
        apart = _apart(directions[:, 3:], points[:, 3:])
        length = float(np.linalg.norm(points[0] - points[0, 0], axis=1).max())
        parallel = float(np.linalg.norm(np.cross(directions[0, 1], directions[0, 2])))
        upright = abs(float(directions[0, 0] @ directions[0, 1]))
        if apart[0] <= _SAME * length and max(parallel, upright) <= _SAME:
            return first
    hint = "say `shoulder`, `elbow` and `wrist`, or leave `configuration` out"
    what = "an elbow arm of six joints with a spherical wrist"
    raise InputError(f"{robot.name} has no branches of ABB, KUKA or FANUC: it is not {what}", hint=hint)
