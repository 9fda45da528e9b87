"""Small drawings of planned jobs for the gallery: the arm with the path of its tool, or joints over time.

They are SVG that stands within a page, whose style colours them: they are dark on a dark page.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.robot import Robot
from trajcli.planning.plan import Plan
from trajcli.plots.sampling import component_points

WIDTH, HEIGHT = 320, 200  # of a drawing, in its own units
_MARGIN = 16
_VIEW = np.array([1.0, -1.45, 0.75])  # from the corner, as the player's first view
_SHOWN = 0.42  # part of the duration at which the arm stands
_POINTS = 321  # of the path of the tool
_SHADES = 8  # of speed
_JOINTS = 6  # colours of joints in the style of the site
_LARGEST, _SMALLEST = 11.0, 5.0  # widths of links

Points = NDArray[np.float64]


def still_of(plan: Plan) -> str:
    """Return a drawing of a plan, an SVG element without blank lines."""
    drawn = _arm(plan) if plan.loaded.robot.convention else _curves(plan)
    body = "\n".join(drawn)
    return f'<svg class="still" viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true">\n{body}\n</svg>'


def _arm(plan: Plan) -> Iterator[str]:
    trajectory, robot = plan.trajectory, plan.loaded.robot
    times = np.linspace(0, trajectory.duration, _POINTS)
    q = trajectory.curve.evaluate(times)
    path = trajectory.of_tools(robot, times, lambda arm, k: forward(arm, q[k])[:, :3, 3])
    shown = round(_SHOWN * (_POINTS - 1))
    standing = {when: _skeleton(robot, q[when]) for when in (0, shown)}
    floor = min(0.0, float(robot.base[2, 3]))
    grid = _grid(np.concatenate([path, *standing.values()]), floor)
    flat = _Projection(np.concatenate([path, *standing.values()]))
    for line in grid:
        yield _line(flat(line), "floor")
    yield from _links(flat(standing[0]), robot, "ghost")
    yield from _speeds(flat(path), path)
    yield from _links(flat(standing[shown]), robot, "arm")
    x, y = flat(path[shown : shown + 1])[0]
    yield f'<circle class="tcp" cx="{x:.1f}" cy="{y:.1f}" r="3.2"/>'


class _Projection:
    """Parallel projection of points in space, so that some of them fill the drawing."""

    def __init__(self, points: Points) -> None:
        across = np.cross(-_VIEW, [0.0, 0.0, 1.0])
        up = np.cross(across, -_VIEW)
        self.axes = np.stack([across / np.linalg.norm(across), -up / np.linalg.norm(up)], axis=1)
        seen = points @ self.axes
        low, high = seen.min(axis=0), seen.max(axis=0)
        room = np.array([WIDTH, HEIGHT]) - 2 * _MARGIN
        self.scale = float((room / np.maximum(high - low, 1e-9)).min())
        self.origin = (low + high) / 2

    def __call__(self, points: Points) -> Points:
        return (points @ self.axes - self.origin) * self.scale + [WIDTH / 2, HEIGHT / 2]


def _skeleton(robot: Robot, q: Points) -> Points:
    """Return the corners of the arm, (2 n + 2, 3): of each row the point between d and a, and its end."""
    poses = link_poses(robot, q)
    modified = robot.convention == "modified"
    corners = [poses[0, :3, 3]]
    for index, joint in enumerate(robot.joints):
        before, after = poses[index], poses[index + 1]
        # a goes along the x axis that both frames share: first in modified rows, last in standard ones
        corners.append(
            before[:3, 3] + joint.a * before[:3, 0] if modified else after[:3, 3] - joint.a * after[:3, 0]
        )
        corners.append(after[:3, 3])
    return np.array([*corners, poses[-1, :3, 3]])


def _links(corners: Points, robot: Robot, kind: str) -> Iterator[str]:
    count = len(robot.joints)
    for index in range(count):
        width = _LARGEST + (_SMALLEST - _LARGEST) * index / max(count - 1, 1)
        yield _line(corners[2 * index : 2 * index + 3], f"{kind} link", width)
    yield _line(corners[-2:], f"{kind} tool", 2.5)
    for index, joint in enumerate(robot.joints):
        # the axis of a modified row is at its second corner, of a standard one at its first
        x, y = corners[2 * index + (robot.convention == "modified")]
        size = 0.62 * (_LARGEST + (_SMALLEST - _LARGEST) * index / max(count - 1, 1))
        yield f'<circle class="{kind} {joint.type}" cx="{x:.1f}" cy="{y:.1f}" r="{size:.1f}"/>'


def _speeds(flat: Points, path: Points) -> Iterator[str]:
    """Yield the path of the tool in parts of one shade of speed."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    shades = np.minimum((_SHADES * steps / max(float(steps.max()), 1e-12)).astype(int), _SHADES - 1)
    changes = np.flatnonzero(np.diff(shades)) + 1
    for part in np.split(np.arange(shades.size), changes):
        yield _line(flat[part[0] : part[-1] + 2], f"path speed{shades[part[0]]}")


def _grid(points: Points, floor: float) -> Iterator[Points]:
    low, high = points.min(axis=0), points.max(axis=0)
    size = float((high - low).max())
    step = 10.0 ** np.floor(np.log10(max(size, 1e-6) / 2.5))
    first, last = np.floor((low - size) / step) * step, np.ceil((high + size) / step) * step
    for axis in (0, 1):
        for value in np.arange(first[axis], last[axis] + step / 2, step):
            ends = np.array([[first[0], first[1], floor], [last[0], last[1], floor]])
            ends[:, axis] = value
            yield ends


def _curves(plan: Plan) -> Iterator[str]:
    """Yield the axes, the borders of the moves, and each joint over time."""
    trajectory = plan.trajectory
    duration = max(trajectory.duration, 1e-9)
    lines = [component_points(trajectory.curve, 0, index) for index in range(len(trajectory.joint_names))]
    low, high = min(y.min() for _, y in lines), max(y.max() for _, y in lines)
    room = np.array([WIDTH, HEIGHT]) - 2 * _MARGIN
    yield f'<path class="axes" d="M{_MARGIN} {_MARGIN}V{HEIGHT - _MARGIN}H{WIDTH - _MARGIN}"/>'
    for span in trajectory.spans[1:]:
        x = _MARGIN + room[0] * span.start / duration
        yield f'<path class="border" d="M{x:.1f} {_MARGIN}V{HEIGHT - _MARGIN}"/>'
    for index, (times, values) in enumerate(lines):
        part = np.stack([times / duration, (high - values) / max(float(high - low), 1e-12)], axis=1)
        yield _line(part * room + _MARGIN, f"curve joint{index % _JOINTS}")


def _line(points: Points, kind: str, width: float | None = None) -> str:
    moved = np.round(points, 1)
    kept = np.append(True, np.any(np.diff(moved, axis=0) != 0, axis=1))
    drawn = " ".join(f"{x:g},{y:g}" for x, y in moved[kept])
    thick = "" if width is None else f' stroke-width="{width:.1f}"'
    return f'<polyline class="{kind}"{thick} points="{drawn}"/>'
