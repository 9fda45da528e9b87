"""Closed form of one arm: its solver, the choices between its solutions, and all its branches for many poses.

Blocks of poses do not know of each other, so that the solutions are the same whatever the number of threads.
What else is to be done with every candidate is handed in, and done while the block is in the processor's
cache.

The residual check takes the cosines and sines of the closed form, which saves most of its time: the angles
are their arc tangents to the last bit, and a pair that had not length 1 would show as a residual. Everything
is seen from the first link, where the others start from exact zeros and ones: the goal is carried there
through the first joint, which has the fewest values. Of two mirrored solutions (joints 4 and 6 half a turn
further, joint 5 bent the other way) the first is checked: the wrist's rotation is the same product in both.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Literal, cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import Flags, cos_sin
from trajcli.kinematics.columns import (
    ZERO,
    Entry,
    VectorEntries,
    advance,
    combine,
    minus,
    plus,
    product,
    scaled,
    total,
    uncombine,
)
from trajcli.kinematics.forward import Link, links_of
from trajcli.kinematics.inverse.families.screw_axes import AxisGeometry, Displacement, Floats
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Mirrored,
    Opposed,
    Turn,
    Value,
    added,
    angle,
    turned_back,
)
from trajcli.kinematics.robot import Robot

Choice = Literal["shoulder", "elbow", "wrist"]
Solver = Callable[[Displacement, DegeneracyFlags], Sequence[Value]]
NAMES = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("no_flip", "flip")}
_X: Floats = (1.0, 0.0, 0.0)
_Y: Floats = (0.0, 1.0, 0.0)
_Z: Floats = (0.0, 0.0, 1.0)
_NO_TURN: Turn = (1.0, 0.0)
_BLOCK = 6250  # poses at a time: in the processor's cache, and long enough to hide the cost of a call
_EACH = 3  # blocks for each thread at least: with fewer, threads cost more than they gain
_WORKSPACE = 1 << 21  # numbers: more than the temporary arrays of a block
_ORDER: tuple[Choice, ...] = ("shoulder", "elbow", "wrist")
BlockHook = Callable[[slice, Array, Array], None]


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
        present = [choice for choice in _ORDER if choice in self.choices]
        rows = itertools.product(*(NAMES[choice] for choice in present))
        return tuple(Branch(**dict(zip(present, row, strict=True))) for row in rows)


@frozen
class Candidates:
    """Every branch of a flat batch of N poses, also where the pose is out of reach.

    One row is one joint for all poses, as the closed forms compute it: the poses are the last array axis.

    Attributes:
        joints: Shape (n, branches, N).
        residuals: Shape (2, branches, N): m, and an upper bound of the angle in rad, at most 1.5 times too
            large.
        degenerate: Shape (N,): an angle is free, or two branches coincide.
    """

    joints: Array
    residuals: Array
    degenerate: Flags


def candidates(
    robot: Robot, arm: AxisGeometry, method: IkMethod, poses: Array, on_block: BlockHook | None = None
) -> Candidates:
    """Return all branches of poses (N, 4, 4) by a method that has a closed form.

    Args:
        robot: The arm.
        arm: Its screw axes.
        method: Its closed form.
        poses: T_world_tcp.
        on_block: (which poses, their joints, their residuals) for each block, in any thread; may change them.

    Raises:
        ValueError: When the method has none.
    """
    if method.solve is None:
        raise ValueError(f"the method {method.name} has no closed form")
    # freed at once: the allocator then keeps blocks of this size instead of returning them
    np.empty(_WORKSPACE)
    count, twos = len(poses), (2,) * len(method.choices)
    joints, residuals = np.empty((len(robot.joints), *twos, count)), np.empty((2, *twos, count))
    degenerate = np.zeros(count, dtype=bool)
    order, check, solve = _order(method), _residual_check(robot), method.solve
    # the same memory with the choices in the order of the solver: (n or 2, last choice, ..., first choice, N)
    solved, missed, flat = joints.transpose(order), residuals.transpose(order), poses.reshape(-1, 16)
    branches = 2 ** len(twos)
    result = Candidates(
        joints.reshape(len(joints), branches, count), residuals.reshape(2, branches, count), degenerate
    )

    def fill(block: slice) -> None:
        rows = np.ascontiguousarray(flat[block, :12].T)
        goal, flags = Displacement(arm, rows), DegeneracyFlags(rows.shape[1], arm.length)
        values = solve(goal, flags)
        for value, out in zip(values, solved[..., block], strict=True):
            _write(value, out)
        missed[0, ..., block], missed[1, ..., block] = check.residuals(_checked(values, len(twos)), goal)
        degenerate[block] = flags.rows
        if on_block is not None:
            on_block(block, result.joints[..., block], result.residuals[..., block])

    _each(fill, [slice(low, low + _BLOCK) for low in range(0, count, _BLOCK)])
    return result


def _each(work: Callable[[slice], None], blocks: Sequence[slice]) -> None:
    """Work on all blocks, in threads where there are many: numpy computes without the interpreter's lock."""
    threads = len(blocks) // _EACH
    if threads < 2 or (threads := min(os.cpu_count() or 1, threads)) < 2:
        for block in blocks:
            work(block)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, blocks):
            pass


def _order(method: IkMethod) -> list[int]:
    """Return the axes of results (k, *branches, N) in the order of the solver's values, last choice first."""
    present = [choice for choice in _ORDER if choice in method.choices]
    return [0, *(1 + present.index(choice) for choice in reversed(method.choices)), 1 + len(present)]


def _write(value: Value, out: Array) -> None:
    """Write angles or slides into (2, ..., 2, B); what is the same for several branches is computed once."""
    if not isinstance(value, tuple | Mirrored | Opposed):
        out[...] = value
        return
    pair, last_choice = (value, ()) if isinstance(value, tuple) else (value.turn, (2,))
    shape = (*last_choice, *np.broadcast(*pair).shape)
    target = out if shape == out.shape else np.empty(shape)
    if isinstance(value, tuple):
        angle(value, target)
    else:
        value.write(target)
    if target is not out:
        out[...] = target


def _checked(values: Sequence[Value], choices: int) -> list[Turn | Entry]:
    """Return turns and slides; of a mirrored wrist (two joints half a turn further) the first solution's."""
    if sum(isinstance(value, Mirrored) for value in values) < 2:
        return [value.both() if isinstance(value, Mirrored | Opposed) else value for value in values]
    return [_first_of(value, choices) for value in values]


def _first_of(value: Value, choices: int) -> Turn | Entry:
    if isinstance(value, Mirrored | Opposed):
        return value.turn
    if isinstance(value, tuple):
        return _without_last_choice(value[0], choices), _without_last_choice(value[1], choices)
    return _without_last_choice(value, choices)


def _without_last_choice(entry: Entry, choices: int) -> Entry:
    return entry[0] if isinstance(entry, np.ndarray) and entry.ndim > choices else entry


class ResidualCheck:
    """Forward kinematics of one robot, compared with goals."""

    def __init__(self, robot: Robot) -> None:
        """Take the robot's links and tool.

        Raises:
            InputError: When the robot has no geometry.
        """
        self._links = links_of(robot)
        turns = np.transpose(cos_sin([link.theta for link in self._links])).tolist()
        self._offsets = [cast("Turn", tuple(turn)) for turn in turns]
        self._tool_rows = robot.tool[:3, :3].tolist()
        self._tool_tip = robot.tool[:3, 3].tolist()

    def residuals(self, values: Sequence[Turn | Entry], goal: Displacement) -> tuple[Array, Array]:
        """Return how far forward kinematics is from the goal, m and rad, each (..., B).

        |dx|^2 + |dz|^2 of two axes of the flange is at least the square of a small angle, and at most twice
        that.

        Args:
            values: Turns and slides of all joints, each of a shape that broadcasts to (..., B).
            goal: B targets.
        """
        frame = _Frame()
        frame.screw(*self._links[0].after)
        for link, offset, value in zip(self._links[1:], self._offsets[1:], values[1:], strict=True):
            frame.screw(*link.before)
            frame.move(*_motion(link, offset, value))
            frame.screw(*link.after)
        frame.slide(*self._tool_tip)
        first, axes = values[0], (goal.x, goal.y, goal.z)
        x, z = (self._from_first_link(_weighted(self._tool_rows[i], axes), first) for i in (0, 2))
        turned = _square(frame.x, x) + _square(frame.z, scaled(frame.flip_z, z))
        return np.sqrt(_square(frame.p, self._point_from_first_link(goal.p, first))), np.sqrt(turned)

    def _from_first_link(self, vector: VectorEntries, value: Turn | Entry) -> VectorEntries:
        """Return a direction in the base as the first link sees it behind its joint."""
        link = self._links[0]
        turn, _ = _motion(link, self._offsets[0], value)
        return turned_back(turned_back(vector, _X, (link.before[1], link.before[2])), _Z, turn)

    def _point_from_first_link(self, point: VectorEntries, value: Turn | Entry) -> VectorEntries:
        """Return a point in the base as the first link sees it behind its joint."""
        link = self._links[0]
        a, *twist = link.before
        turn, distance = _motion(link, self._offsets[0], value)
        local = advance(point, -a, _X)
        local = turned_back(local, _X, (twist[0], twist[1]))
        return turned_back(minus(local, scaled(distance, _Z)), _Z, turn)


@lru_cache(maxsize=16)
def _residual_check(robot: Robot) -> ResidualCheck:
    return ResidualCheck(robot)


class _Frame:
    """A frame that moves along the chain, with axes x, y and z; turns of x and y about z are pending.

    A right angle between neighbouring axes only renames them: signs are kept apart, so that nothing is
    negated, and turns about the same direction are added before anything turns.

    Attributes:
        z: The axis, but for its sign.
        flip_z: The sign of z.
        p: The origin.
    """

    def __init__(self) -> None:
        self._x, self._y, self.z = cast("tuple[VectorEntries, VectorEntries, VectorEntries]", (_X, _Y, _Z))
        self._flip_y = self.flip_z = 1.0
        self._turn, self.p = _NO_TURN, ZERO

    def move(self, turn: Turn, distance: Entry) -> None:
        self._turn = added(self._turn, turn)
        self.p = advance(self.p, product(self.flip_z, distance), self.z)

    def screw(self, a: float, cosine: float, sine: float) -> None:
        """Slide along x by a, and turn about it by the angle of the given cosine and sine."""
        twisted = (cosine, sine) != _NO_TURN
        x = self.x if a != 0.0 or twisted else ZERO
        self.p = advance(self.p, a, x)
        if not twisted:
            return
        y, z, up, out = self._turned_y(), self.z, self._flip_y, self.flip_z
        self._x, self._turn = x, _NO_TURN
        if cosine == 0.0:
            self._y, self._flip_y, self.z, self.flip_z = z, sine * out, y, -sine * up
            return
        self._y, self._flip_y = combine(cosine * up, y, sine * out, z), 1.0
        self.z, self.flip_z = combine(cosine * out, z, -sine * up, y), 1.0

    def slide(self, a: float, b: float, c: float) -> None:
        p = self.p
        if a != 0.0:
            p = advance(p, a, self.x)
        if b != 0.0:
            p = advance(p, self._flip_y * b, self._turned_y())
        self.p = advance(p, self.flip_z * c, self.z)

    @property
    def x(self) -> VectorEntries:
        cosine, sine = self._turn
        join = combine if self._flip_y > 0.0 else uncombine
        return join(cosine, self._x, sine, self._y)

    def _turned_y(self) -> VectorEntries:
        """Return the second axis but for its sign."""
        cosine, sine = self._turn
        join = uncombine if self._flip_y > 0.0 else combine
        return join(cosine, self._y, sine, self._x)


def _motion(link: Link, offset: Turn, value: Turn | Entry) -> tuple[Turn, Entry]:
    """Return the turn about a link's axis and the slide along it."""
    if isinstance(value, tuple):
        return added(offset, value, link.sign), link.d
    return offset, total(product(link.sign, value), link.d)


def _weighted(weights: Sequence[float], axes: Sequence[VectorEntries]) -> VectorEntries:
    """Return the sum of three columns with weights."""
    x, y, z = (scaled(weight, axis) for weight, axis in zip(weights, axes, strict=True))
    return plus(plus(x, y), z)


def _square(a: VectorEntries, b: VectorEntries) -> Array:
    first, second, third = (np.asarray(x - y) for x, y in zip(a, b, strict=True))
    for entry in (first, second, third):
        np.square(entry, out=entry)
    full = first if first.shape == np.broadcast(first, second, third).shape else None
    return np.asarray(np.add(np.add(first, second, out=full), third, out=full))
