"""Rows that may have been planned for a consumer that nobody names: those with the ends of the job's motion.

A plan for a consumer goes through the same targets, so that a file of it has the first and last positions of
the motion that the job plans by itself and lasts longer. That tells whether it is worth planning for it; then
every row is compared.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trajcli.columns import parse_column
from trajcli.consumers.judgement import load_profile
from trajcli.consumers.profile import Profile, profile_names
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob
from trajcli.judge.rows.planned_rows import halves_of
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of
from trajcli.streams.recorded_motion import RecordedMotion
from trajcli.streams.row_sources import ColumnExtents

_LONGEST = 2.0  # times the motion that the job plans by itself
_LONGER = 2e-9  # s: what lasts longer by less, by its stamps, is planned for nobody else than the job
_SAME_STEPS = 2e-6  # s: by how much the steps of stamps at one rate differ
_OFF = 1e-9  # rad or m: what is the same position, beside its decimals
_OF_PERIOD = 1e-6  # relative: stamps of one rate
_REMEDIES = ("slowed", "other_rows", "for_consumer")  # events of a plan that is another one for its consumer


@frozen
class RowsForConsumer:
    """A consumer for whose plan a file may hold the rows.

    Attributes:
        profile: Its name.
        loaded: The job with the rows that the file has; it slows down where it must, as no other job gives
            rows that are over a limit.
        rate: Of the rows, where the job says another, 1/s.
    """

    profile: str
    loaded: LoadedJob
    rate: float | None = None

    def options(self, alone: Plan, found: Plan) -> str:
        """Return the options of `trajcli plan` that make these rows.

        Args:
            alone: The plan of the job for no consumer.
            found: That for this one.
        """
        words = ["--for", self.profile]
        if self.rate is not None:
            words += ["--rate", f"{self.rate:.15g}"]
        if alone.loaded.job.when_over_limit != "slow" and any(
            event.kind in _REMEDIES for event in found.events
        ):
            words += ["--set", "when_over_limit=slow"]
        return " ".join(words)


@frozen
class _Ends:
    """What a file says at its ends: its positions and duration, its rate where it has one."""

    first: Array
    last: Array
    slack: Array
    duration: float
    rate: float | None


def consumers_of(
    source: ByteSource, plan: Plan, topic: str | None = None, field: str | None = None
) -> Iterator[RowsForConsumer]:
    """Yield consumers for whose plan a file may hold the rows, and the job with the rows that it has.

    Args:
        source: The file.
        plan: Of the job, for no consumer.
        topic: Of MCAP, the one that is read.
        field: Of messages with several states, the one that is read.
    """
    ends = _ends_of(source, plan, topic, field)
    return iter(()) if ends is None else _consumers_by(ends, plan)


def consumers_of_rows(rows: RecordedMotion, plan: Plan) -> Iterator[RowsForConsumer]:
    """Yield likewise for all rows of a motion that was read."""
    duration = float(rows.t[-1] - rows.t[0])
    return _consumers_by(_Ends(rows.q[0], rows.q[-1], rows.resolution.q, duration, _rate_of(rows.t)), plan)


def _consumers_by(ends: _Ends, plan: Plan) -> Iterator[RowsForConsumer]:
    if not _fits(ends, plan):
        return
    job, rate = plan.loaded.job.model_copy(update={"when_over_limit": "slow"}), ends.rate
    loaded = replace(plan.loaded, job=job)
    profiles = map(load_profile, profile_names())
    for profile in sorted(profiles, key=lambda profile: profile.rows.rate is None):  # few rows have its rate
        if not _takes(profile, ends, len(plan.loaded.robot.joints)):
            continue
        yield RowsForConsumer(profile.name, loaded)
        if profile.rows.rate is None and rate is not None and rate != job.output.rate:
            yield RowsForConsumer(profile.name, loaded.with_output({"rate": rate, "times": None}), rate)


def _fits(ends: _Ends, plan: Plan) -> bool:
    """Return whether a file begins and ends where the motion does, and lasts longer, but not much.

    Where the job stretches moves to whole periods, those of a consumer may be shorter.
    """
    curve, duration, output = plan.trajectory.curve, plan.trajectory.duration, plan.loaded.job.output
    shorter = len(plan.moves) / output.rate if output.align else -_LONGER
    begun = curve.evaluate(curve.start, 0)
    ended = curve.evaluate(curve.end, 0, side="left")
    if ends.first.size != begun.size or not duration - shorter < ends.duration <= _LONGEST * duration:
        return False
    off = np.maximum(np.abs(ends.first - begun), np.abs(ends.last - ended))
    return bool((off <= ends.slack + _OFF).all())


def _takes(profile: Profile, ends: _Ends, joints: int) -> bool:
    """Return whether a consumer takes rows as those of a file are."""
    counts = [rule.parameters for rule in profile.rules if rule.check == "joint_count"]
    if any(count.get("count", joints) != joints for count in counts):
        return False
    rate = profile.rows.rate
    return rate is None or (ends.rate is not None and abs(ends.rate / rate - 1) <= _OF_PERIOD)


def _ends_of(source: ByteSource, plan: Plan, topic: str | None, field: str | None) -> _Ends | None:
    """Return what a file says at its ends; None where it holds no positions of joints with their times."""
    rows = open_rows_of(source, topic=topic, field=field, joints=len(plan.loaded.robot.joints))
    columns = tuple(map(parse_column, rows.named.names))
    times = [k for k, column in enumerate(columns) if column.kind == "t"]
    positions = [k for k, column in enumerate(columns) if column.kind == "q"]
    if not times or not positions:
        return None
    positions.sort(key=lambda k: columns[k].joint or 0)
    factors = np.array([column.factor for column in columns])
    first, last, stamps, extents = None, None, list[Array](), ColumnExtents(len(columns))
    for block in rows.blocks(range(len(columns)), ()):
        if len(block):
            extents.add(block)
            first = block[0] if first is None else first
            last = block[-1]
            stamps.append(block[:, times[0]])
    if first is None or last is None:
        return None
    t = np.concatenate(stamps)
    slack = (halves_of(rows, columns, extents.still) * factors)[positions]
    ends = [(row * factors)[positions] for row in (first, last)]
    return _Ends(ends[0], ends[1], slack, float(t[-1] - t[0]), _rate_of(t))


def _rate_of(t: Array) -> float | None:
    """Return the rate of stamps, 1/s, the last of which may be at any time; None where they have none."""
    steps = np.diff(t)
    if steps.size < 2:
        return None
    whole = steps[:-1]
    period = float(whole.mean())
    if not np.ptp(whole) <= _SAME_STEPS < period:
        return None
    rate = 1.0 / period
    return float(round(rate)) if abs(rate - round(rate)) <= _OF_PERIOD * max(rate, 1.0) else rate
