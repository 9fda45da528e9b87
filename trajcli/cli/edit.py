"""Tools for files of motions on the command line: retime, resample, concat, reverse, slice, convert."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from trajcli.cli.outcome import print_remark, refuse_two_inputs
from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.operations import cut, join, resample, reverse
from trajcli.editing.requirements import kept_limits, no_longer_excused, refuse_new_jumps, worst_deviation
from trajcli.editing.writing import as_read, plain_columns, write_motion
from trajcli.errors import InputError
from trajcli.findings import time_text
from trajcli.streams.formats import format_of
from trajcli.streams.whole_file import refuse_overwriting
from trajcli.units import Units

if TYPE_CHECKING:
    from trajcli.cli.motion_commands import (
        ConcatCommand,
        ConvertCommand,
        EditCommand,
        ResampleCommand,
        RetimeCommand,
        ReverseCommand,
        SliceCommand,
    )
    from trajcli.editing.retiming import Stretch


def run_reverse(options: ReverseCommand) -> int:
    """Write the motion that goes back; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then nothing was written.
    """
    return _edited(options.file, reverse, options, "reversed")


def run_slice(options: SliceCommand) -> int:
    """Write the motion between two times; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then nothing was written.
    """

    def between(motion: EditedMotion) -> EditedMotion:
        t = motion.rows.t
        begin = float(t[0]) if options.first is None else _seconds("--from", options.first)
        end = float(t[-1]) if options.last is None else _seconds("--to", options.last)
        return cut(motion, begin, end)

    return _edited(options.file, between, options, "cut")


def run_resample(options: ResampleCommand) -> int:
    """Write the motion on another grid, and say how far its curve is off then; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then nothing was written.
    """
    _check_output([options.file], options)
    motion = _read(options.file, options)
    hertz = _hertz(options.rate)
    found = resample(motion, hertz)
    refuse_new_jumps(motion, found)
    joint, size = worst_deviation(motion, found.as_written())
    _write(found, options)
    rows = f"{found.rows.t.size} row{'s' * (found.rows.t.size != 1)}"
    off = f"the curve through them is off by at most {size:.3g} rad or m, in {found.joint_names[joint]}"
    _say(options, f"{found.rows.source}: resampled at {hertz:.9g} Hz, {rows}; {off}")
    return 0


def run_concat(options: ConcatCommand) -> int:
    """Write motions one after the other; return the exit code.

    Raises:
        TrajcliError: When they do not fit; then nothing was written.
    """
    sources = options.files
    if len(sources) < 2:
        raise InputError("concat joins two files at least, and there is one")
    refuse_two_inputs(sources)
    _check_output(sources, options)
    motions = [_read(source, options) for source in sources]
    found = motions[0]
    for motion in motions[1:]:
        found = join(found, motion)
    refuse_new_jumps(motions[0], found, *motions[1:])
    _write(found, options)
    _say(options, f"{' + '.join(motion.rows.source for motion in motions)}: joined, {_extent(found)}")
    return 0


def run_convert(options: ConvertCommand) -> int:
    """Write the motion in the format that the output's name says; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then nothing was written.
    """
    from trajcli.queries.arm import files_of_arm

    arm = [] if options.robot is None else [options.robot]
    refuse_two_inputs([options.file, *arm])
    _check_output([options.file], options, (file for name in arm for file in files_of_arm(name)))
    motion = _read(options.file, options, options.robot, si=options.si)
    if options.si:
        motion = replace(motion, columns=plain_columns(motion))
    _write(motion, options)
    _say(options, f"{motion.rows.source}: converted, {_extent(motion)}")
    return 0


def run_retime(options: RetimeCommand) -> int:
    """Write the motion over the shortest time that keeps its limits; return the exit code.

    Raises:
        TrajcliError: When anything is wrong; then nothing was written.
    """
    from trajcli.editing.retiming import retime
    from trajcli.output.delivery.delivered import delivered_as
    from trajcli.queries.arm import files_of_arm, stated_units
    from trajcli.streams.byte_source import ByteSource
    from trajcli.streams.reading import refuse_job

    arm = [name for name in (options.job, options.robot) if name is not None]
    refuse_two_inputs([options.file, *arm])
    _check_output([options.file], options, (file for name in arm for file in files_of_arm(name)))
    if not arm:
        refuse_job(ByteSource(options.file))
    limits = kept_limits(options.job, options.robot)
    robot = limits.robot
    motion = limits.with_moves(
        read_motion(
            options.file,
            options.part(ReadingOptions),
            joints=robot.joint_names,
            joint_types=robot.joint_types,
            declared=stated_units(arm[0] if arm else ""),
        ),
        delivered_as,
    )
    reader = partial(as_read, path=options.output, form=options.form)
    kept = limits.requirements
    found, stretches = retime(
        motion, kept, fastest=options.fastest, per_move=options.per_move, as_read=reader
    )
    refuse_new_jumps(motion, found)
    _write(found, options)
    for stretch in stretches:
        _say(options, f"{motion.rows.source}: {_stretch(stretch, limits.say)}")
    before, after = (float(each.rows.t[-1] - each.rows.t[0]) for each in (motion, found))
    _say(options, f"  it takes {after:.9g} s, it took {before:.9g} s")
    return 0


def _stretch(stretch: Stretch, say: Callable[..., str]) -> str:
    moves = stretch.moves or ()
    whose = f"move{'s' * (len(moves) > 1)} {', '.join(map(str, moves))}: " if moves else ""
    if stretch.binding is None:
        return f"{whose}factor 1, its limits are kept as it is"
    factor = f"{stretch.factor:.9g}"
    how = "kept" if factor == "1" else "stretched" if stretch.factor > 1 else "faster"
    limit = stretch.binding.amounts.get("limit")
    bound = "" if limit is None or isinstance(limit, str) else f", whose limit is {say(limit)}"
    of_joint = f" of {stretch.binding.joint}" if stretch.binding.joint else " of the tool"
    kind = stretch.binding.kind.removeprefix("tool_").replace("_", " ")
    return f"{whose}{how}, factor {factor}, by the {kind}{of_joint}{bound}"


def _edited(
    source: str, operation: Callable[[EditedMotion], EditedMotion], options: EditCommand, what: str
) -> int:
    _check_output([source], options)
    motion = _read(source, options)
    found = operation(motion)
    refuse_new_jumps(motion, found)
    _write(found, options)
    _say(options, f"{motion.rows.source}: {what}, {_extent(found)}")
    return 0


def _read(source: str, options: EditCommand, robot: str | None = None, *, si: bool = False) -> EditedMotion:
    """Return the motion of a file, in the order, with the names and in the units of a robot's joints."""
    arm, units = None, None
    if robot is not None:
        from trajcli.queries.arm import open_sheet, stated_units

        arm, units = open_sheet(robot).robot, stated_units(robot)
    if units is None and not si and not format_of(options.output, options.form).si:
        units = Units()  # which do not matter where columns stay
    return read_motion(
        source,
        options.part(ReadingOptions),
        joints=None if arm is None else arm.joint_names,
        joint_types=None if arm is None else arm.joint_types,
        declared=units,
    )


def _write(motion: EditedMotion, options: EditCommand) -> None:
    notes = write_motion(motion, options.output, options.form)
    excused = (
        () if options.quiet else no_longer_excused(motion, as_read(motion, options.output, options.form))
    )
    for note in dict.fromkeys([*motion.notes, *notes, *excused]):
        _say(options, f"  {note}")


def _check_output(sources: Sequence[str], options: EditCommand, more: Iterable[tuple[str, str]] = ()) -> None:
    """Refuse to write over a file that is read."""
    format_of(options.output, options.form)
    if options.output not in (None, "-"):
        read = [("the rows of", source) for source in sources]
        refuse_overwriting([("-o", str(options.output))], [*read, *more])


def _extent(motion: EditedMotion) -> str:
    t = motion.rows.t
    return f"{t.size} rows from {time_text(t[0])} s to {time_text(t[-1])} s"


def _say(options: EditCommand, text: str) -> None:
    if not options.quiet:
        print_remark(text)


def _seconds(name: str, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{name} expects seconds, got '{word}'", hint="times of the file, such as 1.5")
    return value


def _hertz(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not 1e-12 <= value < np.inf:  # as in jobs
        raise InputError(f"--rate expects rows per second, got '{word}'", hint="a number of at least 1e-12")
    return value
