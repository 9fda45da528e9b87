"""From the poses among the points of a move to the joints that reach them, one after the other."""

from __future__ import annotations

from dataclasses import replace

from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.kinematics.robot import Robot
from trajcli.pipeline.reach import Reached, with_joints
from trajcli.planners.fields import Target
from trajcli.planners.recorded import Recorded
from trajcli.planners.through_points import ThroughPoints
from trajcli.planners.waypoints import Waypoint


def through_joints(planner: ThroughPoints, robot: Robot, near: Array) -> tuple[ThroughPoints, Reached | None]:
    """Return the planner with joints in the place of poses, each nearest to the point before.

    Args:
        planner: Through points that may be poses.
        robot: Its base, tool and position limits count.
        near: Joint values (n,) of where the arm comes from, rad or m.

    Raises:
        InputError: As `with_joints`.
        PlanningError: When no branch reaches a pose within the limits; names the point.
    """
    if not any(point.gives_pose for point in planner.listed):
        return planner, None
    if isinstance(planner.through, Recorded):
        near = planner.through.positions[-1]
    points, reached = [], None
    for index, point in enumerate(planner.listed):
        is_target = planner.to is not None and index == len(planner.listed) - 1
        try:
            resolved, found = with_joints(point, robot, near)
        except TrajcliError as error:
            raise _of_point(error, "target" if is_target else f"waypoint {index}") from None
        near = resolved.as_state().position
        points.append(_waypoint(point, resolved))
        reached = found if index == len(planner.listed) - 1 else reached
    if planner.to is None:
        return planner.model_copy(update={"through": tuple(points)}), reached
    through = planner.through if isinstance(planner.through, Recorded) else tuple(points[:-1])
    return planner.model_copy(update={"through": through, "to": points[-1]}), reached


def _waypoint(point: Waypoint, resolved: Target) -> Waypoint:
    """Return the point with the joints that reach it."""
    if not point.gives_pose:
        return point
    return Waypoint(**resolved.model_dump(), time=point.time, blend=point.blend)


def _of_point(error: TrajcliError, name: str) -> TrajcliError:
    return type(error)(*(replace(p, message=f"{name}: {p.message}") for p in error.problems))
