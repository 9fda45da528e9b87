"""Kinematic tree of a URDF: the serial chain from a root to a tip, and its choice where no names are given.

Without a tip the chain with the most joints is taken that ends before the gripper. A joint belongs to a
gripper when at most three more joints follow, and its name says so, or it mimics a joint of another branch or
is mimicked there. A file of nothing but a gripper is taken as an arm. Behind the last joint that is left the
tip is the link whose name speaks of a tool, else the one behind most fixed joints.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping

from trajcli.errors import InputError, Place, Problem
from trajcli.frozen import frozen
from trajcli.language.numbers import MAX_JOINTS
from trajcli.suggest import did_you_mean, nearest, nearest_names, valid_names
from trajcli.urdf.read import JOINT_TYPES, JointElement, UrdfDocument

_FINGER = re.compile(
    r"finger|gripper|jaw|knuckle|thumb|claw|(?:^|_)(?:index|middle|ring|little|pinky)(?:_|$)", re.IGNORECASE
)
_WRIST = re.compile(r"rot|roll|pitch|yaw|wrist", re.IGNORECASE)  # an arm's joint, whatever is behind it
_FINGER_JOINTS = 4  # a finger has no more of them
_TOOLS = (
    re.compile(r"(?:^|_)tool0$"),
    re.compile(r"tcp", re.IGNORECASE),
    re.compile(r"tool|grasp|gripper_frame|(?:^|_)eef?(?:_|$)|end_?eff|flange", re.IGNORECASE),
)


@frozen
class SerialPath:
    """The joints from a root to a tip, the fixed ones included.

    Attributes:
        root: Name of the first link.
        tip: Name of the last link.
        joints: From the root on.
        other_tips: Links without children, behind a moving joint; without the tip, in the file's order.
        other_roots: Where further trees with joints that move begin; empty where root or tip was named.
    """

    root: str
    tip: str
    joints: tuple[JointElement, ...]
    other_tips: tuple[str, ...]
    other_roots: tuple[str, ...] = ()


def serial_path(document: UrdfDocument, root: str | None = None, tip: str | None = None) -> SerialPath:
    """Return the chain from the root to the tip.

    Args:
        document: The file.
        root: Name of the link where the chain begins; the outermost one above the tip where it is left out.
        tip: Name of the link where it ends; chosen where it is left out.

    Raises:
        InputError: When there is no such link, the tip is not behind the root, or a joint between them mimics
            another, floats, is planar or of an unknown type; when no joint moves, or too many.
    """
    tree = _Tree(document)
    for role, name in (("root", root), ("tip", tip)):
        if name is not None and name not in document.links:
            hint = did_you_mean(name, document.links)
            near = nearest_names(name, document.links)
            message = f"the robot has no link '{name}' for its {role}"
            hint = hint or f"its nearest names are {', '.join(near)}"
            raise InputError(Problem(message, hint, field=(role,)))
    last = tree.chosen_tip(root) if tip is None else tip
    joints = tuple(tree.up_to(last, root))
    for joint in joints:
        _check_joint(document, joint)
    count = sum(joint.moves for joint in joints)
    first = joints[0].parent if joints else last
    if not 1 <= count <= MAX_JOINTS:
        some = f"{count} joints that move; a robot has 1 to {MAX_JOINTS}"
        ends = f"from '{first}' to '{last}'"
        hint = "say where the chain begins and ends by root and tip"
        listed = valid_names(tree.tips(None, last), "other tips")
        raise InputError(
            Problem(f"the chain {ends} has {some}", f"{hint}; {listed}" if listed else hint, _top(document))
        )
    others = (
        () if root or tip else (start for start in tree.roots() if start != first and tree.tips(start, ""))
    )
    return SerialPath(first, last, joints, tuple(tree.tips(first, last)), tuple(others))


def _top(document: UrdfDocument) -> Place:
    return Place(document.file, 1, 1, document.lines[0] if document.lines else "")


def _check_joint(document: UrdfDocument, joint: JointElement) -> None:
    """Refuse a joint that no serial robot has."""
    if joint.mimics is not None:
        hint = f"end the chain before it: `tip: {joint.parent}`"
        message = f"joint '{joint.name}' mimics {joint.mimics}: it has no value of its own"
        raise document.refused(message, joint.element, "name", hint)
    if joint.type in ("floating", "planar"):
        hint = f"begin behind it: `root: {joint.child}`, or end before it: `tip: {joint.parent}`"
        message = f"joint '{joint.name}' is {joint.type}: a serial robot has revolute and prismatic joints"
        raise document.refused(message, joint.element, "type", hint)
    if joint.type not in JOINT_TYPES:
        near = nearest(joint.type, JOINT_TYPES)
        hint = f"did you mean '{near}'?" if near else f"types: {', '.join(JOINT_TYPES)}"
        message = f"joint '{joint.name}' has the unknown type '{joint.type}'"
        raise document.refused(message, joint.element, "type", hint)


def _tool_rank(link: str) -> int:
    """Return how much the name of a link speaks of a tool: 0 most."""
    return next((rank for rank, words in enumerate(_TOOLS) if words.search(link)), len(_TOOLS))


class _Tree:
    """Joints by the links that they join."""

    def __init__(self, document: UrdfDocument) -> None:
        self._document = document
        self._above: Mapping[str, JointElement] = {joint.child: joint for joint in document.joints.values()}
        self._below: dict[str, list[JointElement]] = defaultdict(list)
        for joint in document.joints.values():
            self._below[joint.parent].append(joint)
        self._order = {link: number for number, link in enumerate(document.links)}
        self._coupled = set[str | None]()  # joints that move with one of another branch
        for joint in document.joints.values():
            if joint.mimics is not None and joint.mimics not in [
                j.name for j in self.up_to(joint.parent, None)
            ]:
                self._coupled |= {joint.name, joint.mimics}

    def up_to(self, tip: str, root: str | None) -> list[JointElement]:
        """Return the joints from the root to the tip; without a root from the outermost link on."""
        joints: list[JointElement] = []
        link = tip
        while link != root and link in self._above:
            joints.append(self._above[link])
            link = joints[-1].parent
            if len(joints) > len(self._above):
                raise self._no_tree(f"the joints above link '{tip}' go in a circle")
        if root is not None and link != root:
            listed = valid_names(self.tips(root, ""), f"behind '{root}' end")
            raise InputError(Problem(f"link '{tip}' is not behind link '{root}'", listed, field=("tip",)))
        return joints[::-1]

    def tips(self, root: str | None, tip: str) -> list[str]:
        """Return the links without children, but for the tip, that are behind a moving joint."""
        starts = self.roots() if root is None else [root]
        ends = [
            link
            for start in starts
            for link, moving, _ in self._behind(start, whole=True)
            if moving and not self._below.get(link) and link != tip
        ]
        return sorted(ends, key=self._order.__getitem__)

    def chosen_tip(self, root: str | None) -> str:
        """Return the end of the longest chain without a gripper."""
        starts = self.roots() if root is None else [root]
        for whole in (False, True):
            ends = [end for start in starts for end in self._behind(start, whole=whole)]
            count = max((moving for _, moving, _ in ends), default=0)
            if count:
                break
        else:
            message = "the robot has no joint that moves" + (f" behind link '{root}'" if root else "")
            raise InputError(
                Problem(message, "trajcli needs 1 to 12 revolute or prismatic joints", _top(self._document))
            )
        # of several arms the one that the file has first; then the best link behind its last joint
        longest = [(link, fixed) for link, moving, fixed in ends if moving == count]
        first = min((link for link, fixed in longest if fixed == 0), key=self._order.__getitem__)
        rigid = {link: fixed for link, moving, fixed in self._behind(first, whole=whole) if moving == 0}
        return min(rigid, key=lambda link: (_tool_rank(link), -rigid[link], self._order[link]))

    def roots(self) -> list[str]:
        """Return the links that are no joint's child, in the file's order."""
        starts = [link for link in self._document.links if link not in self._above]
        if not starts:
            raise self._no_tree("every link is the child of a joint: they go in a circle")
        return starts

    def _no_tree(self, message: str) -> InputError:
        return InputError(Problem(message, "a robot is a tree of links", _top(self._document)))

    def _behind(self, start: str, *, whole: bool) -> Iterator[tuple[str, int, int]]:
        """Yield each link behind a link, how many joints that move lead to it, and how many fixed ones."""
        links = [(start, 0, 0)]
        while links:
            link, moving, fixed = links.pop()
            yield link, moving, fixed
            for joint in self._below.get(link, []):
                if joint.child == start:
                    raise self._no_tree(f"the joints behind link '{start}' go in a circle")
                if whole or not self._is_finger(joint):
                    stays = joint.type == "fixed"
                    links.append((joint.child, moving + joint.moves, fixed + 1 if stays else 0))

    def _is_finger(self, joint: JointElement) -> bool:
        named = _FINGER.search(joint.name) and not _WRIST.search(joint.name) and joint.type != "fixed"
        return bool(named or joint.name in self._coupled) and self._depth(joint) <= _FINGER_JOINTS

    def _depth(self, joint: JointElement) -> int:
        """Return the most joints that move from a joint, which counts, to any link behind it."""
        behind = max((moving for _, moving, _ in self._behind(joint.child, whole=True)), default=0)
        return behind + joint.moves
