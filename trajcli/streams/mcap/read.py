"""Motions in MCAP files of any origin: topics of joint states and of joint trajectories."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.streams.mcap import definitions, records
from trajcli.streams.mcap.decode import (
    STAMP,
    DamagedMessageError,
    JointSeries,
    StateLayout,
    controller_state_layout,
    joint_state_layout,
    joint_states,
    joint_trajectory,
)
from trajcli.streams.mcap.log_records import HEAD, LogRecords, MessageBlock, known_channels
from trajcli.streams.mcap.messages import JOINT_ACCELERATIONS, JOINT_STATES
from trajcli.suggest import did_you_mean, valid_names

METADATA = "trajcli"
_READ = (definitions.JOINT_STATE, definitions.JOINT_TRAJECTORY, definitions.CONTROLLER_STATE)
_ARRAYS = ("times", "position", "velocity", "acceleration", "effort")  # of a motion
_Layout = Callable[[bytes], StateLayout] | None
_LATEST = 2**62  # ns: no epoch of ours is later
_CLOCK = 10**17  # ns: stamps from here on (1973) are times of a clock, and counted from the first


@frozen
class LoggedMotion:
    """The motion in a topic of a log, SI.

    Attributes:
        topic: Its topic.
        joint_names: n names.
        times: s, shape (N,); of stamps that are times of a clock, from the first of them.
        position: Shape (N, n), or (N, 0) where it is not given, as the others.
        velocity: Likewise.
        acceleration: Likewise.
        effort: Likewise; drivers without sensors of effort say NaN.
    """

    topic: str
    joint_names: tuple[str, ...]
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array


def log_blocks(
    stream: BinaryIO, file: str, topic: str | None = None, field: str | None = None
) -> Iterator[LoggedMotion]:
    """Yield the motion of a topic of JointState, JointTrajectory or JointTrajectoryControllerState in blocks.

    Of a log that trajcli wrote, /joint_states has the accelerations of /joint_accelerations, and times count
    from its epoch. There is at least one block.

    Args:
        stream: The file, open at its first byte.
        file: Its name, for messages.
        topic: The topic; /joint_states unless given, or else the only one that can be read.
        field: Of JointTrajectoryControllerState, the state that is read, such as "reference".

    Raises:
        InputError: When it is no whole MCAP file, or has no such topic.
    """
    log = known_channels(stream, file)
    chosen = _chosen(log, topic)
    own = log.metadata.get(METADATA, {})
    wanted = {chosen: _channels(log, chosen)}
    accelerations = _channels(log, JOINT_ACCELERATIONS) if own and chosen == JOINT_STATES else set()
    if accelerations:
        wanted[JOINT_ACCELERATIONS] = accelerations
    layouts = {c: _layouts(log, c, field) for channels in wanted.values() for c in channels}
    states = {channel for channel in wanted[chosen] if layouts[channel] is not None}
    unstamped = bool(states) and _unstamped(LogRecords(stream, file), states)
    stream.seek(0)
    clock, before = _Clock(own if states else {}), 0
    parts = _states(LogRecords(stream, file), wanted, layouts, unstamped=unstamped)
    for series in _same_joints(parts, file, chosen):
        motion = _motion(file, chosen, series, clock, before)
        before += motion.times.size
        yield motion
    if not before:
        raise InputError(f"the topic {chosen} of {file} has no messages")


def _unstamped(log: LogRecords, channels: set[int]) -> bool:
    """Return whether nobody has stamped the messages of a topic: then the times of the recorder count."""
    for block in log.blocks():
        for channel in channels & block.offsets.keys():
            if not block.offsets[channel].size:
                continue
            whole = block.heads(block.offsets[channel])["length"] >= HEAD - records.RECORD_HEAD.size + sum(
                STAMP
            )
            at = block.offsets[channel][whole] + HEAD + STAMP[0]
            if block.data[at[:, None] + np.arange(STAMP[1])].any():
                return False
    return True


def _states(
    log: LogRecords, wanted: Mapping[str, set[int]], layouts: Mapping[int, _Layout], *, unstamped: bool
) -> Iterator[JointSeries]:
    """Yield the states of the first of some topics, with the accelerations of the second."""
    pending: dict[str, list[JointSeries]] = {name: [] for name in wanted}
    trajectories = 0
    for block in log.blocks():
        for name, channels in wanted.items():
            found = sorted(channels & block.offsets.keys())
            for layout in dict.fromkeys(layouts[channel] for channel in found):
                alike = [block.offsets[channel] for channel in found if layouts[channel] == layout]
                offsets = alike[0] if len(alike) == 1 else np.sort(np.concatenate(alike))
                trajectories += offsets.size if layout is None else 0
                if trajectories > 1:
                    message = f"the topic {name} of {log.file} holds several trajectories, and one is read"
                    raise InputError(message)
                if offsets.size:
                    series = _decoded(log, block, offsets, name, layout)
                    times = block.heads(offsets)["time"].astype(np.int64)
                    if unstamped and times.min() < 0:
                        raise log.wrong(f"a message of {name} is logged at {2**63} ns or later")
                    pending[name].append(replace(series, nanoseconds=times) if unstamped else series)
        yield from _paired(log.file, *pending.values())
    if any(part.nanoseconds.size for parts in pending.values() for part in parts):
        raise _other_stamps(log.file)


def _paired(
    file: str, states: list[JointSeries], accelerations: list[JointSeries] | None = None
) -> Iterator[JointSeries]:
    """Yield the states whose accelerations are there, too, and take them out of both lists."""
    if accelerations is None:
        yield from states
        states.clear()
        return
    while states and accelerations:
        first, second = states.pop(0), accelerations.pop(0)
        count = min(first.nanoseconds.size, second.nanoseconds.size)
        for parts, series in ((states, first), (accelerations, second)):
            if series.nanoseconds.size > count:
                parts.insert(0, _rows(series, slice(count, None)))
        first, second = _rows(first, slice(count)), _rows(second, slice(count))
        if first.names != second.names or not np.array_equal(first.nanoseconds, second.nanoseconds):
            raise _other_stamps(file)
        yield replace(first, acceleration=second.position)


def _rows(series: JointSeries, rows: slice) -> JointSeries:
    names = ("nanoseconds", *_ARRAYS[1:])
    return replace(series, **{name: getattr(series, name)[rows] for name in names})


def _other_stamps(file: str) -> InputError:
    return InputError(f"{file}: {JOINT_ACCELERATIONS} has other stamps or joints than {JOINT_STATES}")


def _same_joints(parts: Iterable[JointSeries], file: str, topic: str) -> Iterator[JointSeries]:
    """Yield states; refused where some have other joints or quantities than the first."""
    first: tuple[object, ...] | None = None
    for part in parts:
        form = (part.names, *(getattr(part, name).shape[1:] for name in _ARRAYS[1:]))
        first = form if first is None else first
        if form != first:
            raise InputError(f"the messages of {topic} in {file} are about different joints or quantities")
        yield part


def _layouts(log: LogRecords, channel: int, field: str | None) -> _Layout:
    """Return where the parts of a channel's messages stand; None where each holds a trajectory."""
    kind, topic = _type(log, channel), log.channels[channel].topic
    if kind != definitions.CONTROLLER_STATE:
        if field is not None:
            hint = f"--field is about topics of {definitions.CONTROLLER_STATE}"
            raise InputError(f"the topic {topic} of {log.file} holds {kind}, which has one state", hint=hint)
        return joint_state_layout if kind == definitions.JOINT_STATE else None
    schema = log.schemas[log.channels[channel].schema_id]
    fields = definitions.point_fields(schema.data.decode("utf-8", "replace"))
    if not fields:
        raise InputError(f"the definition of {kind} in {log.file} is of an unknown form")
    if field not in fields:
        message = f"the topic {topic} of {log.file} holds the states {', '.join(fields)}"
        near = None if field is None else did_you_mean(field, fields)
        message += "" if field is None else f", and no '{field}'"
        raise InputError(message, hint=near or f"choose one: --field {' or --field '.join(fields)}")
    return _controller_layout(fields, field)


@cache
def _controller_layout(fields: tuple[str, ...], field: str) -> _Layout:
    """Return where a field stands; the same function for the same fields."""
    return partial(controller_state_layout, fields=fields, field=field)


def _type(log: LogRecords, channel: int) -> str:
    schema = log.schemas.get(log.channels[channel].schema_id)
    return "" if schema is None else schema.name


def _channels(log: LogRecords, topic: str) -> set[int]:
    return {number for number, channel in log.channels.items() if channel.topic == topic}


def _chosen(log: LogRecords, topic: str | None) -> str:
    every = {channel.topic: number for number, channel in log.channels.items()}
    fit = [name for name, number in every.items() if _type(log, number) in _READ]
    if topic is None and JOINT_STATES in fit:
        topic = JOINT_STATES
    elif topic is None and len(fit) == 1:
        topic = fit[0]
    if topic is None:
        what = "several topics with joints" if fit else "no topic with joints"
        hint = valid_names(fit, "name one with --topic") or valid_names(every, "its topics")
        raise InputError(f"{log.file} has {what}: of {' or '.join(_READ)}", hint=hint)
    if topic not in every:
        hint = did_you_mean(topic, every) or valid_names(fit or every, "its topics")
        raise InputError(f"{log.file} has no topic '{topic}'", hint=hint)
    if topic not in fit:
        found = _type(log, every[topic]) or "messages without a schema"
        raise InputError(
            f"the topic {topic} of {log.file} holds {found}",
            hint=f"topics of {' or '.join(_READ)} are read" + (f": {', '.join(fit)}" if fit else ""),
        )
    encoding = log.channels[every[topic]].message_encoding
    if encoding != "cdr":
        raise InputError(f"the topic {topic} of {log.file} is encoded as '{encoding}'", hint="cdr is read")
    return topic


def _decoded(
    log: LogRecords,
    block: MessageBlock,
    offsets: NDArray[np.int64],
    topic: str,
    layout: _Layout,
) -> JointSeries:
    starts = offsets + HEAD
    lengths = block.heads(offsets)["length"].astype(np.int64) - (HEAD - records.RECORD_HEAD.size)
    try:
        if layout is not None:
            return joint_states(block.data, starts, lengths, layout)
        return joint_trajectory(block.data[starts[0] : starts[0] + lengths[0]].tobytes())
    except DamagedMessageError as error:
        raise log.wrong(f"a message of {topic} cannot be read: {error}") from error


class _Clock:
    """The start of the times of a log, ns, which is found with the first stamp."""

    def __init__(self, own: Mapping[str, str]) -> None:
        self._epoch = own.get("epoch", "")[:20]
        self.start: int | None = None

    def seconds(self, stamps: NDArray[np.int64]) -> Array:
        """Return times (N,) of stamps (N,) in ns."""
        if self.start is None:
            first = int(stamps[0])
            self.start = first if first >= _CLOCK else 0
            if self._epoch.isdecimal() and int(self._epoch) < _LATEST:
                self.start = int(self._epoch)
        return np.asarray((stamps - self.start) / 1e9)


def _motion(file: str, topic: str, series: JointSeries, clock: _Clock, before: int) -> LoggedMotion:
    parts = (series.position, series.velocity, series.acceleration)
    for what, values in zip(("position", "velocity", "acceleration"), parts, strict=True):
        finite = np.isfinite(values)
        if not finite.all():
            row, joint = np.argwhere(~finite)[0].tolist()
            raise InputError(
                f"the {what} of {series.names[joint]} in message {before + row} of {topic} in {file} is "
                f"{values[row, joint]}",
                hint="only finite numbers can be compared",
            )
    return LoggedMotion(topic, series.names, clock.seconds(series.nanoseconds), *parts, series.effort)
