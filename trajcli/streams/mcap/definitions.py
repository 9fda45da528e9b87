"""Definitions of the ROS 2 messages that are written, as ros2msg text.

Definitions of the types that a message uses follow behind a line of 80 equals signs.

Source: ros2/common_interfaces and ros2/geometry2, branch jazzy, their comments left out.
"""

from __future__ import annotations

JOINT_STATE = "sensor_msgs/msg/JointState"
JOINT_TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
JOINT_TRAJECTORY_POINT = "trajectory_msgs/msg/JointTrajectoryPoint"
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
STRING = "std_msgs/msg/String"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
PATH = "nav_msgs/msg/Path"
TWIST = "geometry_msgs/msg/TwistStamped"
NUMBER = "std_msgs/msg/Float64"

_PARTS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "trajectory_msgs/JointTrajectoryPoint": (
        "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
        "builtin_interfaces/Duration time_from_start"
    ),
}
_MESSAGES = {
    JOINT_STATE: (
        "std_msgs/Header header\n\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"
    ),
    JOINT_TRAJECTORY: (
        "std_msgs/Header header\n\nstring[] joint_names\n\ntrajectory_msgs/JointTrajectoryPoint[] points"
    ),
    JOINT_TRAJECTORY_POINT: _PARTS["trajectory_msgs/JointTrajectoryPoint"],
    STRING: "string data",
    NUMBER: "float64 data",
    TRANSFORMS: "geometry_msgs/TransformStamped[] transforms",
    PATH: "std_msgs/Header header\n\ngeometry_msgs/PoseStamped[] poses",
    TWIST: "std_msgs/Header header\ngeometry_msgs/Twist twist",
}
_RULE = "=" * 80
_TYPE_AND_NAME = 2  # words of a field


def definition_of(message: str) -> str:
    """Return the definition of a message, and those of all types in it."""
    text = _MESSAGES[message]
    parts = [text + "\n"]
    parts += [f"{_RULE}\nMSG: {name}\n{_PARTS[name]}\n" for name in _used(text)]
    return "".join(parts)


def point_fields(definition: str) -> tuple[str, ...]:
    """Return the fields of a message, given as ros2msg text, that are points of a trajectory.

    They stand behind a header and the names of joints; none are returned where other fields are between.
    """
    lines = definition.partition(_RULE)[0].splitlines()
    fields = [line.partition("#")[0].split() for line in lines]
    named = [(field[0].replace("/msg/", "/"), field[1]) for field in fields if len(field) == _TYPE_AND_NAME]
    if [kind for kind, _ in named[:2]] != ["std_msgs/Header", "string[]"]:
        return ()
    points = [kind == "trajectory_msgs/JointTrajectoryPoint" for kind, _ in named[2:]]
    count = points.index(False) if False in points else len(points)
    return tuple(name for _, name in named[2 : 2 + count])


def _used(text: str) -> list[str]:
    """Return the types that a definition uses, each once, those of its own lines first."""
    names: list[str] = []
    lines = text.splitlines()
    while lines:
        name = lines.pop(0).split(" ")[0].removesuffix("[]")
        if name in _PARTS and name not in names:
            names.append(name)
            lines += _PARTS[name].splitlines()
    return names
