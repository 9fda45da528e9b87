"""Kinematic calibration on the command line: `trajcli calibrate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.cli.numbers import number, table_lines
from trajcli.cli.outcome import print_json, print_lines, print_remark, print_text
from trajcli.columns import columns_of
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.job.inline import inline_number
from trajcli.kinematics.calibration.fit import Options
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.queries.arm import ArmInUnits, files_of_arm, open_arm, open_sheet
from trajcli.queries.calibration import (
    Calibration,
    calibrated_text,
    calibration_of,
    calibration_report,
    outliers,
    plan_report,
    planned_measurements,
)
from trajcli.streams.whole_file import refuse_overwriting, write_content
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import CalibrateCommand

_FEW = 12  # names in a line
_DECIMALS = {"rad": 8, "m": 8, "deg": 6, "mm": 5}  # of a parameter: finer than anything is measured


def run_calibrate(options: CalibrateCommand) -> int:
    """Print calibrated parameters and write the robot's file, or plan measurements; return the exit code.

    Raises:
        InputError: When robot, parameters, measurements or options are not as they should be.
        FileError: When a file cannot be read or written.
    """
    arm = open_arm(options.robot, options.tool, units=options.units, si=options.si)
    _check(options)
    length = _scale(arm, options)
    if options.plan is not None:
        return _plan(arm, length, options)
    if options.file is None:
        hint = "a YAML list of {joints, pose}, or a CSV; --plan N proposes what to measure"
        raise InputError("the file of measurements is missing", hint=hint)
    chosen = Options(
        characteristic_length(arm.robot) if length is None else length,
        options.loss,
        Options(1.0).loss_scale
        if options.loss_scale is None
        else _positive(options.loss_scale, "--loss-scale"),
    )
    calibration = calibration_of(arm, options.file, options.free, chosen)
    if options.output is not None:
        write_content(calibrated_text(calibration, open_sheet(options.robot)).encode(), options.output)
    if options.as_json:
        print_json(calibration_report(calibration))
        return 0
    print_lines(_lines(calibration))
    for remark in calibration.remarks:
        print_remark(remark)
    if options.output is not None:
        print_remark(f"{options.output} written")
    return 0


def _check(options: CalibrateCommand) -> None:
    """Refuse options that do not go together, and an output that is an input."""
    if options.plan is None and options.measure is not None:
        raise InputError("--measure is for --plan: a file says itself what was measured", hint="leave it out")
    if options.plan is not None and (options.loss != "linear" or options.loss_scale is not None):
        raise InputError("--loss is for measurements, and --plan has none yet", hint="leave it out")
    if options.loss == "linear" and options.loss_scale is not None:
        raise InputError("--loss-scale is for --loss huber or cauchy", hint="name the loss, or leave it out")
    if options.output is None:
        return
    endings = (".csv",) if options.plan is not None else (".yaml", ".yml")
    if not options.output.lower().endswith(endings):
        raise InputError(f"-o {options.output}: expected a name that ends in {' or '.join(endings)}")
    measured = [] if options.file is None else [("the measurements", options.file)]
    refuse_overwriting([("-o", options.output)], [*files_of_arm(options.robot), *measured])


def _scale(arm: ArmInUnits, options: CalibrateCommand) -> float | None:
    """Return the metres that count like a radian; None where they are not given."""
    if options.scale is None:
        return None
    return _positive(inline_number(options.scale, "--scale", Quantity("length"), arm.units), "--scale")


def _positive(value: float, name: str) -> float:
    if not 0 < value < np.inf:
        raise InputError(f"{name} must be above 0 and finite, got {value:.6g}")
    return value


def _lines(calibration: Calibration) -> Iterator[str]:
    arm, report = calibration.arm, calibration_report(calibration)
    count, rank = report["count"], report["rank"]
    taken, steps = report["measurements"], report["iterations"]
    yield (
        f"{report['robot']}: {count} parameter{'s' * (count != 1)} "
        f"from {taken} measurement{'s' * (taken != 1)}, rank {rank}, {steps} iteration{'s' * (steps != 1)}"
    )
    scale = number(report["scale"] / arm.length_factor)
    yield f"one radian counts like {scale} {arm.units.length}"
    yield from table_lines([["parameter", "unit", "nominal", "value", "change", "std"], *_rows(calibration)])
    yield from _residual_lines(arm, report)
    if "loss" in report:
        listed = ", ".join(map(str, outliers(calibration)[:_FEW])) or "none"
        yield f"{report['loss']['name']} loss from {report['loss']['scale']:.4g}: outliers {listed}"
    yield from _combination_lines(arm, report["unidentifiable"])
    for pair in report["correlations"]:
        names = [f"{each['joint']}.{each['name']}" for each in (pair["first"], pair["second"])]
        yield f"correlated: {names[0]} and {names[1]}, {pair['value']:.3f}"


def _rows(calibration: Calibration) -> Iterator[list[str]]:
    for row in calibration_report(calibration)["parameters"]:
        unit, per = _unit(calibration.arm, row["unit"])
        values = [row["nominal"], row["value"], row["value"] - row["nominal"]]
        cells = (number(round(value / per, _DECIMALS[unit])) for value in values)
        deviation = "-" if row["std"] is None else f"{row['std'] / per:.3g}"
        yield [f"{row['joint']}.{row['name']}", unit, *cells, deviation]


def _unit(arm: ArmInUnits, unit: str) -> tuple[str, float]:
    """Return the user's unit of an angle or a length, and its SI value."""
    if unit == "rad":
        return arm.units.angle, arm.angle_factor
    return arm.units.length, arm.length_factor


def _residual_lines(arm: ArmInUnits, report: dict[str, Any]) -> Iterator[str]:
    for key, si in (("position", "m"), ("angle", "rad")):
        unit, per = _unit(arm, si)
        before, after = (report["residual"][when][key] for when in ("before", "after"))
        if before is None or after is None:
            continue
        noise = report["noise"][key]
        text = "" if noise is None else f"; noise {noise / per:.3g} {unit} by coordinate"
        what = f"{key}, root mean square"
        yield f"{what}: {before / per:.4g} {unit} before, {after / per:.4g} {unit} after{text}"


def _combination_lines(arm: ArmInUnits, combinations: Sequence[Sequence[dict[str, Any]]]) -> Iterator[str]:
    if combinations:
        yield "not identifiable (changes, rad and m, that no measurement sees; nothing changed along them):"
    for shares in combinations:
        if len(shares) == 1:
            yield f"  {shares[0]['joint']}.{shares[0]['name']}"
            continue
        yield "  " + "  ".join(f"{each['weight']:+.4g} {each['joint']}.{each['name']}" for each in shares)


def _plan(arm: ArmInUnits, length: float | None, options: CalibrateCommand) -> int:
    """Print the configurations to measure at, as CSV in the arm's units or as JSON in SI."""
    count = options.plan or 0
    if count < 1:
        raise InputError(f"--plan must be at least 1, got {count}")
    part = options.measure or "pose"
    joints, plan, parameters = planned_measurements(arm, count, options.free, length, options.file, part)
    rows = _csv(arm, joints)
    if options.output is not None:
        write_content(rows, options.output)
    if options.as_json:
        print_json(plan_report(arm, joints, plan, parameters))
    elif options.output is None:
        print_text(rows.decode())
    print_remark(
        f"{count} configurations tell {plan.seen.rank} of {len(parameters)} parameters or combinations: "
        f"O1 {plan.index:.4g}, condition {plan.condition:.4g}"
    )
    return 0


def _csv(arm: ArmInUnits, joints: Array) -> bytes:
    from trajcli.streams.csv import write_csv

    columns = columns_of(("q",), arm.robot.joint_types, arm.units)
    out = BytesIO()
    write_csv([np.asarray(joints / arm.joint_factors)], columns, out)
    return out.getvalue()
