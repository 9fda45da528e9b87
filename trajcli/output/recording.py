"""Log of a plan: its knots, the frames of its arm, the path of its tool, its job and report."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import EFFORT
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.job.read import files_of
from trajcli.kinematics.robot import GEOMETRY_HINT, Robot
from trajcli.knots import Knots, knots_of
from trajcli.planning.plan import Plan
from trajcli.streams.mcap.messages import OF_GEOMETRY
from trajcli.streams.mcap.recording import AttachedFile, Compression, LinkFrames, LoggedPath, Recording
from trajcli.suggest import did_you_mean, valid_names
from trajcli.trajectory import Trajectory
from trajcli.version import __version__

TOPICS = (
    *("/joint_states", "/joint_accelerations", "/joint_trajectory"),
    *("/robot_description", "/tf_static", "/tf", "/tool_path"),
    *("/joint_trajectory_point", "/tool_twist"),
)
"""The topics of a log; the last two only where they are asked for."""

_PER_SECOND = 1_000_000_000
_LATEST = 2**31 - 1  # s: what a time of ROS 2 can say
_MOST_POSES = 1000  # of the tool's path
_POSES_RATE = 60.0  # Hz: more of them show nothing more
_STATES = {
    False: "position and velocity; effort is empty: the columns tau were not asked for",
    True: "position, velocity and effort: N m, or N of prismatic joints, from inverse dynamics",
}
"""What is in a message, by whether the job asks for efforts."""
_DECIMAL = re.compile(r"[0-9]+(?:\.[0-9]+)?")


@comparable
class LogOptions:
    """What the command line says about a log.

    Attributes:
        topics: Names of topics, separated by commas; beside the usual ones.
        epoch: Time of the log at t = 0, s, as a decimal number.
        compression: Of the messages.
    """

    topics: str | None = None
    epoch: str | None = None
    compression: Compression | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the topics that are asked for."""
        return () if self.topics is None else tuple(name.strip() for name in self.topics.split(","))

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the options that were given."""
        values = {"--topics": self.topics, "--epoch": self.epoch, "--compression": self.compression}
        return tuple(name for name, value in values.items() if value is not None)


def check_log_options(options: LogOptions, robot: Robot, start_time: float) -> None:
    """Refuse what a log of an arm cannot hold.

    Raises:
        InputError: When a topic is unknown or needs geometry, or a time is out of range.
    """
    for topic in options.names:
        if topic not in TOPICS:
            hint = did_you_mean(topic, TOPICS) or valid_names(TOPICS, "topics")
            raise InputError(f"--topics: there is no topic '{topic}'", hint=hint)
        if robot.convention is None and topic in OF_GEOMETRY:
            raise InputError(
                f"--topics: {topic} is about a tool, and robot {robot.name} has no geometry",
                hint=GEOMETRY_HINT,
            )
    _origin(options, start_time)


def recording_of(plan: Plan, options: LogOptions) -> Recording:
    """Return what the log of a plan holds beside its rows.

    Args:
        plan: A verified plan.
        options: They were checked.

    Raises:
        InputError: When the log would end later than its times can say.
    """
    loaded, trajectory = plan.loaded, plan.trajectory
    geometric = loaded.robot.convention is not None
    frames, knots = _frames(loaded.robot, trajectory) if geometric else None, knots_of(trajectory)
    job = _job_text(plan).encode()
    attachments = [
        AttachedFile("job.yaml", "application/yaml", job),
        AttachedFile("report.json", "application/json", _report(plan, knots).encode()),
    ]
    if frames is not None:
        attachments.append(AttachedFile("robot.urdf", "application/xml", frames.urdf.encode()))
    return Recording(
        joint_names=trajectory.joint_names,
        origin=_origin(options, loaded.job.output.start_time, trajectory.duration),
        epoch=_epoch(options),
        duration=round(trajectory.duration * _PER_SECOND),
        knots=knots,
        frames=frames,
        path=_path(loaded.robot, trajectory) if geometric else None,
        attachments=tuple(attachments),
        metadata=_metadata(plan, job, options),
        topics=options.names,
        compression=options.compression or "zstd",
        signals={
            signal.name: tuple((round(c.time * _PER_SECOND), c.value) for c in signal.changes)
            for signal in trajectory.signals
        },
    )


def _epoch(options: LogOptions) -> int:
    """Return the time of the log at t = 0, ns."""
    if options.epoch is None:
        return 0
    if not _DECIMAL.fullmatch(options.epoch):
        raise InputError(
            f"--epoch: expected seconds since 1970, got '{options.epoch}'",
            hint="a decimal number that is not negative, such as 1767225600",
        )
    return int((Decimal(options.epoch) * _PER_SECOND).to_integral_value())


def _origin(options: LogOptions, start_time: float, duration: float = 0.0) -> int:
    """Return the time of the log when the motion starts, ns; that of its end must be possible, too."""
    epoch = _epoch(options)
    origin = epoch + round(start_time * _PER_SECOND)
    if origin < 0:
        raise InputError(
            f"a log begins at 0 s or later, and output.start_time is {start_time:g} s",
            hint=f"--epoch {Decimal(epoch - origin) / _PER_SECOND:f} or more makes that possible",
        )
    end = Decimal(origin) / _PER_SECOND + Decimal(duration)
    if end > _LATEST:
        raise InputError(
            f"the log would reach {end:.12g} s, and times of ROS 2 end at {_LATEST} s",
            hint="give --epoch in seconds, and small enough for the whole motion",
        )
    return origin


def _job_text(plan: Plan) -> str:
    """Return the job as it was given where that says everything, else as `--resolved` writes it."""
    document = plan.loaded.document
    if getattr(document, "patches", None) or len([*files_of(document)]) > 1:
        from trajcli.job.dump import dump_job

        return dump_job(plan.loaded)
    return "\n".join(document.lines)


def _report(plan: Plan, knots: Knots) -> str:
    from trajcli.output.report import report_of

    return report_of(plan, knots=knots).model_dump_json(indent=2) + "\n"


def _metadata(plan: Plan, job: bytes, options: LogOptions) -> Mapping[str, str]:
    trajectory, robot = plan.trajectory, plan.loaded.robot
    geometry = f"{robot.convention} Denavit-Hartenberg table"
    if robot.convention is None:
        geometry = f"none: there is no {', '.join(OF_GEOMETRY[:-1])}"
    return {
        "version": __version__,
        "job": plan.loaded.name,
        "job_sha256": hashlib.sha256(job).hexdigest(),
        "robot": robot.name,
        "geometry": geometry,
        "joints": json.dumps(trajectory.joint_names, ensure_ascii=False),
        "joint_types": json.dumps(trajectory.joint_types),
        "duration": repr(trajectory.duration),
        "epoch": str(_epoch(options)),
        "units": "SI: rad or m by joint, s; epoch in ns",
        "joint_states": _STATES[EFFORT in plan.loaded.job.output.columns],
        "joint_accelerations": "accelerations, in the field position: rad/s^2, or m/s^2 of prismatic joints",
        "joint_trajectory": "the knots: quintics between them reproduce the motion as report.json says",
    }


def _frames(robot: Robot, trajectory: Trajectory) -> LinkFrames:
    """Return the frames of the arm along the motion; the base does not move, nor does a tool that stays."""
    from trajcli.geometry.rotation import quaternion_from_matrix
    from trajcli.urdf.chain import FIRST_LINK, TOOL, WORLD, chain_of
    from trajcli.urdf.write import urdf_of

    chain, curve = chain_of(robot), trajectory.curve

    def pose(matrix: Array) -> Array:
        return np.append(matrix[:3, 3], np.roll(quaternion_from_matrix(matrix[:3, :3]), -1))

    def poses(nanoseconds: NDArray[np.int64]) -> Array:
        translations, quaternions = chain.transforms(curve.evaluate(_within(trajectory, nanoseconds)))
        return np.concatenate([translations, np.roll(quaternions, -1, axis=-1)], axis=-1)

    standing = (WORLD, FIRST_LINK, pose(chain.base))
    if all(span.tool is None for span in trajectory.spans):
        fixed = (standing, (chain.links[-1], TOOL, pose(chain.tool)))
        return LinkFrames(urdf_of(robot), fixed, chain.links, poses)

    def with_tool(nanoseconds: NDArray[np.int64]) -> Array:
        times = np.minimum(nanoseconds / _PER_SECOND, trajectory.duration)
        tools = trajectory.of_tools(
            robot, times, lambda arm, k: np.tile(pose(chain_of(arm).tool), (k.size, 1))
        )
        return np.concatenate([poses(nanoseconds), tools[:, None]], axis=1)

    return LinkFrames(urdf_of(robot), (standing,), (*chain.links, TOOL), with_tool)


def _within(trajectory: Trajectory, nanoseconds: NDArray[np.int64]) -> Array:
    times: Array = np.minimum(nanoseconds / _PER_SECOND, trajectory.duration) + trajectory.curve.start
    return times


def _path(robot: Robot, trajectory: Trajectory) -> LoggedPath:
    """Return poses of the tool at even times."""
    from trajcli.geometry.rotation import quaternion_from_matrix, without_jumps
    from trajcli.kinematics.forward import forward

    count = min(_MOST_POSES, 2 + int(trajectory.duration * _POSES_RATE)) if trajectory.duration else 1
    nanoseconds = np.rint(np.linspace(0.0, trajectory.duration, count) * _PER_SECOND).astype(np.int64)
    q = trajectory.curve.evaluate(_within(trajectory, nanoseconds))
    times = np.minimum(nanoseconds / _PER_SECOND, trajectory.duration)
    poses = trajectory.of_tools(robot, times, lambda arm, k: forward(arm, q[k]))
    quaternions = without_jumps(quaternion_from_matrix(poses[:, :3, :3]), None)
    return LoggedPath(
        nanoseconds, np.concatenate([poses[:, :3, 3], np.roll(quaternions, -1, axis=-1)], axis=-1)
    )
