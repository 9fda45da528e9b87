"""Motions in MCAP files of any origin: topics of joint states and of joint trajectories."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError
from trajcli.frozen import frozen
from trajcli.streams.mcap import definitions, records
from trajcli.streams.mcap.decode import DamagedMessageError, JointSeries, joint_states, joint_trajectory
from trajcli.streams.mcap.log_records import HEAD, LogRecords, MessageBlock, known_channels
from trajcli.streams.mcap.messages import JOINT_ACCELERATIONS, JOINT_STATES
from trajcli.suggest import did_you_mean, valid_names

METADATA = "trajcli"
_READ = (definitions.JOINT_STATE, definitions.JOINT_TRAJECTORY)
_CLOCK = 10**17  # ns: stamps from here on (1973) are times of a clock, and counted from the first


@frozen
class LoggedMotion:
    """The motion in a topic of a log, SI.

    Attributes:
        file: Its name.
        topic: Its topic.
        joint_names: n names.
        times: s, shape (N,); of stamps that are times of a clock, from the first of them.
        position: Shape (N, n), or (N, 0) where it is not given, as the others.
        velocity: Likewise.
        acceleration: Likewise.
        effort: Likewise.
    """

    file: str
    topic: str
    joint_names: tuple[str, ...]
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array


def read_mcap(path: str | Path, topic: str | None = None) -> LoggedMotion:
    """Read the motion of a topic of sensor_msgs/JointState or trajectory_msgs/JointTrajectory.

    Of a log that trajcli wrote, /joint_states has the accelerations of /joint_accelerations, and times count
    from its epoch.

    Args:
        path: The file.
        topic: The topic; /joint_states unless given, or else the only one that can be read.

    Raises:
        FileError: When the file cannot be read.
        InputError: When it is no whole MCAP file, or has no such topic.
    """
    try:
        with Path(path).open("rb") as stream:
            return _read(stream, str(path), topic)
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror or error}") from error


def _read(stream: BinaryIO, file: str, topic: str | None) -> LoggedMotion:
    known = known_channels(stream, file)
    chosen = _chosen(known, topic)
    log = LogRecords(stream, file)
    wanted = {chosen: _channels(known, chosen)}
    if chosen == JOINT_STATES:
        wanted[JOINT_ACCELERATIONS] = _channels(known, JOINT_ACCELERATIONS)
    found: dict[str, list[JointSeries]] = {name: [] for name in wanted}
    for block in log.blocks():
        for name, channels in wanted.items():
            for channel in channels & block.offsets.keys():
                kind, count = _type(known, channel), block.offsets[channel].size
                if kind == definitions.JOINT_TRAJECTORY and count + len(found[name]) > 1:
                    raise InputError(
                        f"the topic {name} of {file} holds several trajectories, and one is read"
                    )
                if count:
                    found[name].append(_decoded(log, block, channel, name, kind))
    series = _joined(found[chosen], file, chosen)
    accelerations = found.get(JOINT_ACCELERATIONS, [])
    own = log.metadata.get(METADATA, {})
    if own and accelerations and chosen == JOINT_STATES:
        series = _with_accelerations(series, _joined(accelerations, file, JOINT_ACCELERATIONS))
    return _motion(file, chosen, series, own)


def _type(known: LogRecords, channel: int) -> str:
    schema = known.schemas.get(known.channels[channel].schema_id)
    return "" if schema is None else schema.name


def _channels(known: LogRecords, topic: str) -> set[int]:
    return {number for number, channel in known.channels.items() if channel.topic == topic}


def _chosen(known: LogRecords, topic: str | None) -> str:
    """Return the topic that is read.

    Raises:
        InputError: When there is none, or several.
    """
    every = {channel.topic: number for number, channel in known.channels.items()}
    fit = [name for name, number in every.items() if _type(known, number) in _READ]
    if topic is None:
        if JOINT_STATES in fit or len(fit) == 1:
            return JOINT_STATES if JOINT_STATES in fit else fit[0]
        what = "several topics with joints" if fit else "no topic with joints"
        hint = valid_names(fit, "name one with --topic") or valid_names(every, "its topics")
        raise InputError(f"{known.file} has {what}: of {' or '.join(_READ)}", hint=hint)
    if topic not in every:
        hint = did_you_mean(topic, every) or valid_names(fit or every, "its topics")
        raise InputError(f"{known.file} has no topic '{topic}'", hint=hint)
    if topic not in fit:
        found = _type(known, every[topic]) or "messages without a schema"
        raise InputError(
            f"the topic {topic} of {known.file} holds {found}",
            hint=f"topics of {' or '.join(_READ)} are read" + (f": {', '.join(fit)}" if fit else ""),
        )
    encoding = known.channels[every[topic]].message_encoding
    if encoding != "cdr":
        raise InputError(f"the topic {topic} of {known.file} is encoded as '{encoding}'", hint="cdr is read")
    return topic


def _decoded(log: LogRecords, block: MessageBlock, channel: int, topic: str, kind: str) -> JointSeries:
    """Return the states in the messages of a channel in a block."""
    heads = block.heads(channel)
    starts = block.offsets[channel] + HEAD
    lengths = heads["length"].astype(np.int64) - (HEAD - records.RECORD_HEAD.size)
    try:
        if kind == definitions.JOINT_STATE:
            series = joint_states(block.data, starts, lengths)
            # where nobody has stamped the messages, the recorder has
            stamped = series.nanoseconds.any() or not heads["time"].any()
            return series if stamped else replace(series, nanoseconds=heads["time"].astype(np.int64))
        return joint_trajectory(block.data[starts[0] : starts[0] + lengths[0]].tobytes())
    except DamagedMessageError as error:
        raise log.wrong(f"a message of {topic} cannot be read: {error}") from error


def _joined(parts: Sequence[JointSeries], file: str, topic: str) -> JointSeries:
    """Return all states of a topic in order.

    Raises:
        InputError: When there are none, or parts have different joints.
    """
    if not parts or not sum(part.nanoseconds.size for part in parts):
        raise InputError(f"the topic {topic} of {file} has no messages")
    first = parts[0]
    shapes = [part.position.shape[1:] + part.velocity.shape[1:] + part.effort.shape[1:] for part in parts]
    if any(part.names != first.names for part in parts) or len({*shapes}) > 1:
        raise InputError(f"the messages of {topic} in {file} are about different joints or quantities")
    arrays = ("nanoseconds", "position", "velocity", "acceleration", "effort")
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in arrays}
    return JointSeries(names=first.names, **joined)


def _with_accelerations(states: JointSeries, accelerations: JointSeries) -> JointSeries:
    """Return the states of a log of trajcli with the accelerations of its other topic."""
    same = np.array_equal(states.nanoseconds, accelerations.nanoseconds)
    if not same or states.names != accelerations.names:
        return states
    return replace(states, acceleration=accelerations.position)


def _motion(file: str, topic: str, series: JointSeries, own: Mapping[str, str]) -> LoggedMotion:
    stamps, epoch = series.nanoseconds, own.get("epoch", "")
    start = int(stamps[0]) if stamps[0] >= _CLOCK else 0
    if epoch.isdigit() and stamps[0] >= int(epoch):
        start = int(epoch)
    parts = (series.position, series.velocity, series.acceleration, series.effort)
    for what, values in zip(("position", "velocity", "acceleration", "effort"), parts, strict=True):
        finite = np.isfinite(values)
        if not finite.all():
            row, joint = np.argwhere(~finite)[0].tolist()
            raise InputError(
                f"the {what} of {series.names[joint]} in message {row} of {topic} in {file} is "
                f"{values[row, joint]}",
                hint="only finite numbers can be compared",
            )
    return LoggedMotion(file, topic, series.names, (stamps - start) / 1e9, *parts)
