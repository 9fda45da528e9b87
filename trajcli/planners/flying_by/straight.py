"""Corners that are none: lines in joint space that go on in the same direction under the same limits.

Together they are one line, along which no motion of the slowest joint is faster than one law.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.operations import cut, times_at
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.course import Course
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.flown_parts import FlownPart
from trajcli.planners.joint_course import joint_line

_PARALLEL = 1e-12  # relative: a direction that differs by less is the same
_LIMITS = ("velocity", "acceleration", "jerk")


@frozen
class StraightenedChain:
    """A chain with one line in the place of several that follow each other straight on.

    Attributes:
        chain: As it is given.
        joined: With one line for each group.
        groups: First and last course of each.
    """

    chain: FlyByChain
    joined: FlyByChain
    groups: tuple[tuple[int, int], ...]

    @property
    def corners(self) -> list[int]:
        """Indices of the corners that are left among those of the given chain."""
        return [end for _, end in self.groups[:-1]]

    def parts(self, joined: Sequence[FlownPart]) -> list[FlownPart]:
        """Return the parts of the given chain: a line is cut where it is on borders of zones."""
        parts: list[FlownPart] = []
        for number, part in enumerate(joined):
            first, last = self.groups[number // 2]
            if number % 2 or first == last:
                parts.append(part)
            else:
                parts += self._cut(part, first, last)
        return parts

    def _cut(self, part: FlownPart, first: int, last: int) -> list[FlownPart]:
        law, rest, parts = part.law, part.curve, []
        if law is None:
            return [part]
        for k in range(first, last):
            sides = (k, self.chain.corners[k].left), (k + 1, self.chain.corners[k].joined)
            borders = [_on_line(self.chain, (first, last), *side) for side in sides]
            for time in times_at(law, np.array(borders)).tolist():
                before, rest = cut(rest, time)
                parts.append(FlownPart(before.shifted(-before.start)))
        return [*parts, FlownPart(rest.shifted(-rest.start))]


def straightened(chain: FlyByChain) -> StraightenedChain:
    """Return a chain without the corners in which neither direction nor limits change."""
    groups: list[tuple[int, int]] = [(0, 0)]
    for k in range(1, len(chain.courses)):
        first = groups[-1][0]
        if _goes_on(chain.courses[k - 1], chain.courses[k]):
            groups[-1] = (first, k)
        else:
            groups.append((k, k))
    if len(groups) == len(chain.courses):
        return StraightenedChain(chain, chain, tuple(groups))
    courses = [_line(chain.courses[first : last + 1]) for first, last in groups]
    corners = [
        replace(
            chain.corners[end],
            left=_on_line(chain, groups[k], end, chain.corners[end].left),
            joined=_on_line(chain, groups[k + 1], end + 1, chain.corners[end].joined),
        )
        for k, (_, end) in enumerate(groups[:-1])
    ]
    tempos = [
        min([*chain.tempos[first : last + 1], *(corner.pace for corner in chain.corners[first:last])])
        for first, last in groups
    ]
    ends = chain.ends[0] * _on_line(chain, groups[0], 0, 1.0), chain.ends[1]  # by how much ds grows
    joined = FlyByChain(tuple(courses), tuple(corners), ends, tuple(tempos))
    return StraightenedChain(chain, joined, tuple(groups))


def _goes_on(before: Course, behind: Course) -> bool:
    """Return whether a line goes on as another one does."""
    if not (before.uniform and behind.uniform):
        return False
    one, other = (course.curve.coefficients[0, 0] for course in (before, behind))
    sizes = float(np.linalg.norm(one) * np.linalg.norm(other))
    limits = before.robot.limits, behind.robot.limits
    same = all(np.array_equal(*(getattr(each, name) for each in limits)) for name in _LIMITS)
    apart = np.abs(one / np.linalg.norm(one) - other / np.linalg.norm(other)).max()
    return same and sizes > 0 and bool(apart <= _PARALLEL)


def _shares_of_line(courses: Sequence[Course]) -> Array:
    """Return where on the line that several make each begins, and 1, (k + 1,)."""
    lengths = [float(np.linalg.norm(course.curve.coefficients[0, 0])) * course.length for course in courses]
    shares = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.asarray(shares / shares[-1])


def _line(courses: Sequence[Course]) -> Course:
    if len(courses) == 1:
        return courses[0]
    last = courses[-1].curve
    return joint_line(courses[0].curve.evaluate(0.0), last.evaluate(last.end), courses[0].robot)


def _on_line(chain: FlyByChain, group: tuple[int, int], course: int, s: float) -> float:
    """Return where an s of a course is on the line of its group."""
    first, last = group
    if first == last:
        return s
    shares = _shares_of_line(chain.courses[first : last + 1])
    low, high = shares[course - first], shares[course - first + 1]
    return float(low + s / chain.courses[course].length * (high - low))
