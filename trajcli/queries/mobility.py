"""Mobility of linkages: the formula of Gruebler and Kutzbach, with its count."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, Literal

from trajcli.errors import InputError, Problem
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Robot
from trajcli.suggest import did_you_mean

Space = Literal["spatial", "planar"]
LAMBDA = {"spatial": 6, "planar": 3}
"""lambda: the freedoms of a rigid body in each space."""

_JOINTS = {"revolute": 1, "prismatic": 1, "helical": 1, "cylindrical": 2, "universal": 2, "spherical": 3}
_LETTERS = {name[0]: name for name in _JOINTS}
_MOST = 10_000  # links or joints: what is above is a slip of the keyboard
_TERM = re.compile(r"\s*(?P<kind>[A-Za-z]+|[0-9]{1,99})\s*(?:[xX*]\s*(?P<count>[0-9]{1,99})\s*)?")


@comparable
class Linkage:
    """Links and joints, without their geometry.

    Attributes:
        links: Number of links, the frame counted.
        freedoms: Of each joint.
        space: Where the links move.
        passive: Freedoms of links that change nothing for the others, as a rod's own turn between two balls.
    """

    links: int
    freedoms: tuple[int, ...]
    space: Space = "spatial"
    passive: int = 0

    @property
    def lam(self) -> int:
        """Freedoms of a rigid body in the space."""
        return LAMBDA[self.space]

    @property
    def mobility(self) -> int:
        """Freedoms of the whole: lambda (n - 1) - sum (lambda - f_i) - f0; below zero: too many joints.

        Source: Gruebler 1917; Lynch and Park, Modern Robotics (2017), section 2.2.1.
        """
        constraints = sum(self.lam - freedom for freedom in self.freedoms)
        return self.lam * (self.links - 1) - constraints - self.passive

    @property
    def loops(self) -> int:
        """Number of independent closed loops, if all links hang together."""
        return len(self.freedoms) - (self.links - 1)


def linkage_of(robot: Robot, space: Space = "spatial", passive: int = 0) -> Linkage:
    """Return the open chain of a robot: a link more than it has joints, each with one freedom.

    Raises:
        InputError: When there are more passive freedoms than joints leave.
    """
    return checked(Linkage(len(robot.joints) + 1, (1,) * len(robot.joints), space, passive))


def parse_joints(text: str) -> tuple[int, ...]:
    """Return the freedoms of each joint of a text such as `1,1,2`, `1x4,3x2` or `Rx4,Sx2`.

    Raises:
        InputError: When a part is no number of freedoms and no kind of joint, or the count is none.
    """
    freedoms: list[int] = []
    for part in text.split(","):
        term = _TERM.fullmatch(part)
        if term is None:
            raise InputError(
                f"expected freedoms or freedoms x count, got '{part.strip()}'",
                hint="four joints of one freedom and two of three are 1x4,3x2",
            )
        count = int(term["count"] or 1)
        if not 1 <= count <= _MOST or len(freedoms) + count > _MOST:
            raise InputError(f"expected 1 to {_MOST} joints, got {count} in '{part.strip()}'")
        freedoms += [_freedom(term["kind"])] * count
    return tuple(freedoms)


def _freedom(kind: str) -> int:
    """Return the freedoms of a joint: a number, or the name of its kind or that name's first letter."""
    if kind.isdigit():
        return int(kind)
    name = _LETTERS.get(kind.lower(), kind.lower())
    if name not in _JOINTS:
        listed = ", ".join(f"{name} ({freedom})" for name, freedom in _JOINTS.items())
        guess = did_you_mean(kind.lower(), list(_JOINTS))
        raise InputError(
            f"there is no kind of joint '{kind}'", hint=f"{guess}; {listed}" if guess else listed
        )
    return _JOINTS[name]


def checked(linkage: Linkage) -> Linkage:
    """Return the same linkage.

    Raises:
        InputError: With all that is impossible in it.
    """
    problems = list(_problems(linkage))
    if problems:
        raise InputError(*problems)
    return linkage


def _problems(linkage: Linkage) -> Iterator[Problem]:
    highest, where = linkage.lam - 1, linkage.space
    if not 1 <= linkage.links <= _MOST:
        yield Problem(f"expected 1 to {_MOST} links, the frame counted, got {linkage.links}")
    for index, freedom in enumerate(linkage.freedoms):
        if not 1 <= freedom <= highest:
            message = f"joint {index} has {freedom} freedoms, a {where} joint has 1 to {highest}"
            rigid = "links without freedom between them are one link"
            yield Problem(message, rigid if freedom < 1 else None)
            break
    if not 0 <= linkage.passive <= sum(linkage.freedoms):
        total = sum(linkage.freedoms)
        yield Problem(f"the joints have {total} freedoms, of which {linkage.passive} cannot be passive")


def mobility_report(linkage: Linkage) -> dict[str, Any]:
    """Return {dof, lambda, links, joints, passive, freedoms, loops, space, count, remark?} of a linkage."""
    report: dict[str, Any] = {
        "dof": linkage.mobility,
        "lambda": linkage.lam,
        "links": linkage.links,
        "joints": len(linkage.freedoms),
        "passive": linkage.passive,
        "freedoms": list(linkage.freedoms),
        "loops": linkage.loops,
        "space": linkage.space,
        "count": counted(linkage),
    }
    remark = remark_on(linkage)
    return report if remark is None else {**report, "remark": remark}


def counted(linkage: Linkage) -> str:
    """Return the formula with its numbers, such as `6 (5 - 1) - 4 x (6 - 1) - 0 = 4`."""
    lam = linkage.lam
    kinds = sorted(set(linkage.freedoms))
    taken = "".join(f" - {linkage.freedoms.count(kind)} x ({lam} - {kind})" for kind in kinds)
    return f"{lam} ({linkage.links} - 1){taken} - {linkage.passive} = {linkage.mobility}"


def remark_on(linkage: Linkage) -> str | None:
    """Return what a reader of the number should know."""
    if linkage.loops < 0:
        return (
            f"{linkage.links} links need at least {linkage.links - 1} joints to hang together, "
            f"there are {len(linkage.freedoms)}: the parts are counted as free bodies"
        )
    if linkage.mobility < 0:
        return f"overconstrained by {-linkage.mobility}: it moves only where its dimensions allow it"
    if linkage.mobility == 0:
        return "a structure: it moves only where its dimensions allow it"
    if linkage.loops:
        return "a count for general dimensions: special ones (parallel or intersecting axes) can free more"
    return None
