"""Pose calculations on the command line: `trajcli pose`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import number, numbers, pose_lines
from trajcli.cli.outcome import print_report
from trajcli.errors import InputError
from trajcli.geometry.pose import invert
from trajcli.geometry.rotation import rotation_defect
from trajcli.job.inline import inline_number
from trajcli.queries.arm import parse_units
from trajcli.queries.pose import (
    PoseStep,
    composed,
    parse_fractions,
    parse_sequence,
    pose_path,
    pose_report,
    read_end,
    read_steps,
)
from trajcli.units import Quantity, Units

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import PoseCommand

_ROUNDING = 1e-9  # of R^T R: above it is reported, since it comes from rounded entries


def run_pose(options: PoseCommand) -> int:
    """Print the pose that the steps lead to, or poses on the way to another; return the exit code.

    Raises:
        InputError: When a step or an option is not as it should be.
        FileError: When a file cannot be read, or standard output not written.
    """
    units = parse_units(options.units)
    euler = None if options.euler is None else parse_sequence(options.euler)
    point = None if options.point is None else _point(options.point, units)
    start = _start(options, units)
    if options.to is None:
        _require_target(options)
        report = pose_report(start.pose, units, euler, point)
        defect = float(rotation_defect(start.pose[:3, :3]))
        print_report(report, _lines(report, units, options, defect), as_json=options.as_json)
        return 0
    target = read_end(options.to, units)
    s = parse_fractions("0,0.5,1" if options.s is None else options.s)
    poses = pose_path(
        start,
        target,
        s,
        options.path or "line",
        options.orientation or "axis_angle",
        euler,
    )
    reports = [
        {"s": value, **pose_report(pose, units, euler, point)}
        for value, pose in zip(s.tolist(), poses, strict=True)
    ]
    lines = [
        line
        for report in reports
        for line in (f"s = {number(report['s'])}", *(f"  {one}" for one in _lines(report, units, options)))
    ]
    print_report(reports, lines, as_json=options.as_json)
    return 0


def _start(options: PoseCommand, units: Units) -> PoseStep:
    steps = read_steps(options.steps, units)
    pose = composed(steps)
    if options.inverse:
        return PoseStep(invert(pose))
    return PoseStep(pose, typed=steps[0].typed if len(steps) == 1 else None)


def _point(text: str, units: Units) -> list[float]:
    words = [word.strip() for word in text.split(",")]
    if len(words) != len("xyz"):
        count = f"{len(words)} value{'s' * (len(words) != 1)}"
        raise InputError(f"--point has {count}, a point has x, y, z", hint="such as --point 0.1 0 -0.2")
    names = [f"--point, {axis}" for axis in "xyz"]
    length = Quantity("length")
    return [inline_number(word, name, length, units) for word, name in zip(words, names, strict=True)]


def _require_target(options: PoseCommand) -> None:
    for name, value in (("--s", options.s), ("--path", options.path), ("--orientation", options.orientation)):
        if value is not None:
            raise InputError(f"{name} is about the way to another pose", hint="name that pose with --to")


def _lines(report: dict[str, Any], units: Units, options: PoseCommand, defect: float = 0.0) -> Iterator[str]:
    yield from pose_lines(report, units, "")
    about = report["axis_angle"]
    yield f"axis_angle: axis {numbers(about['axis'])}, angle {number(about['angle'])} {units.angle}"
    if "euler" in report:
        first, second = map(numbers, report["euler"])
        yield f"euler {options.euler} ({units.angle}): {first}"
        yield f"  or: {second}"
    yield f"determinant: {number(report['determinant'])}"
    if defect > _ROUNDING:
        yield f"the matrix is off a rotation by {defect:.3g}: angles are read off its entries as they are"
    if "point" in report:
        yield f"point ({units.length}): {numbers(report['point'])}"
    for name, text in report.get("singular", {}).items():
        yield f"{name}: {text}"
