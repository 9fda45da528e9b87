"""Calibration of an arm from a file of measured poses: report, robot file, and plan of measurements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, utf8
from trajcli.frozen import frozen
from trajcli.geometry.euler import rpy_from_matrix
from trajcli.job.dump import mapping_text, robot_as_mapping
from trajcli.job.measurements import read_configurations, read_measurements
from trajcli.job.robot import DH_ROW, RobotSheet
from trajcli.job.yaml.load import parse_document
from trajcli.kinematics.calibration.fit import Fit, Options, calibrate
from trajcli.kinematics.calibration.identifiability import Identifiability, Share
from trajcli.kinematics.calibration.measurements import Measurements
from trajcli.kinematics.calibration.measuring_plan import (
    MeasuredPart,
    MeasuringPlan,
    attainable_rank,
    measuring_plan,
    random_candidates,
)
from trajcli.kinematics.calibration.parameters import (
    PARALLEL,
    ArmParameter,
    parallel_rows,
    parse_parameters,
    values_of,
)
from trajcli.kinematics.calibration.uncertainty import Uncertainty, uncertainty
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.robot import Joint, Robot
from trajcli.queries.arm import ArmInUnits, beyond_two_turns
from trajcli.units import Units, to_user
from trajcli.version import __version__

_UNMOVED = 1e-9  # rad or m: what a joint that stands still may differ by


@frozen
class Calibration:
    """A calibrated arm and what is to be said about it.

    Attributes:
        arm: As it was, with the user's units.
        file: Of the measurements.
        measurements: That it holds.
        parameters: The free ones.
        options: How residuals counted.
        fit: The calibrated robot.
        accuracy: How well its parameters are known.
        remarks: What a user should know, one sentence each.
    """

    arm: ArmInUnits
    file: str
    measurements: Measurements
    parameters: tuple[ArmParameter, ...]
    options: Options
    fit: Fit
    accuracy: Uncertainty
    remarks: tuple[str, ...]


def calibration_of(arm: ArmInUnits, file: str, free: str, options: Options | None = None) -> Calibration:
    """Return an arm calibrated by the measurements of a file.

    Args:
        arm: With nominal parameters.
        file: A YAML list of {joints, pose, sigma?}, or a CSV; `-` is a CSV on standard input.
        free: Which parameters may change, such as `all` or `j1.theta,tool`.
        options: How residuals count; None: squares, and the characteristic length of the arm as a radian.

    Raises:
        InputError: When there is no such parameter, the file is not as it should be, or its measurements are
            too few for the parameters.
        FileError: When it cannot be read.
    """
    robot = arm.robot
    parameters = parse_parameters(robot, free)
    chosen = options or Options(characteristic_length(robot))
    measurements = read_measurements(file, robot, arm.units)
    numbers = sum(measurements.counts)
    attainable = attainable_rank(robot, measurements, parameters, chosen.length)
    if attainable == 0:
        named = ", ".join(map(str, parameters[:3]))
        raise InputError(f"no measurement of {file} tells anything of {named}", hint="free other parameters")
    if numbers < attainable:
        each = numbers / len(measurements.joints)
        raise InputError(
            f"{file}: {len(measurements.joints)} measurements are {numbers} numbers, and {attainable} of "
            f"{len(parameters)} free parameters, or combinations of them, can be found by such",
            hint=f"take at least {int(np.ceil(attainable / each))} measurements, or free fewer parameters",
        )
    fit = calibrate(robot, measurements, parameters, chosen)
    accuracy = uncertainty(fit, measurements, parameters, chosen)
    remarks = (
        *_remarks_on_units(arm, measurements),
        *_remarks(robot, measurements, parameters, attainable, fit),
    )
    return Calibration(arm, file, measurements, parameters, chosen, fit, accuracy, remarks)


def _remarks_on_units(arm: ArmInUnits, measurements: Measurements) -> Iterator[str]:
    """Yield what wrong units, or poses in another frame, look like."""
    turns = beyond_two_turns(arm.robot, measurements.joints, arm.joint_units)
    if turns is not None:
        yield turns
    length, (missed, _) = characteristic_length(arm.robot), measurements.root_mean_squares(arm.robot)
    if missed is not None and missed > length:
        yield (
            f"the nominal arm misses positions by {missed:.4g} m, more than its own length, {length:.4g} m: "
            "check units, the order of joints, and in which frame the poses are"
        )


def _remarks(
    robot: Robot,
    measurements: Measurements,
    parameters: Sequence[ArmParameter],
    attainable: int,
    fit: Fit,
) -> Iterator[str]:
    still = np.ptp(measurements.joints, axis=0) <= _UNMOVED
    names = [name for name, stands in zip(robot.joint_names, still, strict=True) if stands]
    if names:
        yield f"never moved: {', '.join(names)}; the links on both sides count as one there"
    if fit.nominal.rank < attainable:
        yield (
            f"the configurations tell {fit.nominal.rank} of {attainable} combinations of parameters that "
            "such measurements can tell: move more joints, and further (--plan proposes configurations)"
        )
    if sum(measurements.counts) == fit.span.shape[1]:
        yield "there are just as many numbers as parameters: nothing is left to estimate the noise from"
    tilted = [parameter.owner for parameter in parameters if parameter.name == "beta"]
    listed = [robot.joints[row].name for row in parallel_rows(robot)]
    swapped = [owner for owner in tilted if owner in listed]
    if swapped:
        rows = ", ".join(swapped)
        yield f"axes within {np.degrees(PARALLEL):g} deg of parallel: beta instead of d in the row of {rows}"
    if not fit.converged:
        yield f"the steps have not come to rest after {fit.iterations}: do not trust the numbers"
    if fit.released:
        yield (
            f"{fit.released} combination{'s' * (fit.released > 1)} of parameters that cannot be told apart "
            "at the nominal parameters can at the calibrated ones, far beyond noise, and changed too"
        )


def calibration_report(calibration: Calibration) -> dict[str, Any]:
    """Return the calibration for programs, all in SI."""
    fit, accuracy, options = calibration.fit, calibration.accuracy, calibration.options
    before, after = _residuals(calibration)
    nominal, values = _values(calibration)
    rows = zip(calibration.parameters, nominal.tolist(), values.tolist(), accuracy.deviations, strict=True)
    report: dict[str, Any] = {
        "robot": calibration.arm.robot.name,
        "measurements": len(calibration.measurements.joints),
        "parameters": [
            {
                **_parameter_entry(parameter),
                "unit": "rad" if parameter.angular else "m",
                "nominal": old,
                "value": new,
                "std": deviation,
            }
            for parameter, old, new, deviation in rows
        ],
        "rank": fit.nominal.rank,
        "count": len(calibration.parameters),
        "unidentifiable": _combinations(fit.nominal),
        "released": fit.released,
        "residual": {
            key: dict(zip(("position", "angle"), value, strict=True))
            for key, value in (("before", before), ("after", after))
        },
        "iterations": fit.iterations,
        "converged": fit.converged,
        "scale": options.length,
        "noise": dict(zip(("position", "angle"), accuracy.noise, strict=True)),
        "correlations": [
            {
                "first": _parameter_entry(pair.first),
                "second": _parameter_entry(pair.second),
                "value": pair.value,
            }
            for pair in accuracy.correlations
        ],
        "remarks": list(calibration.remarks),
    }
    if options.loss != "linear":
        report["loss"] = {"name": options.loss, "scale": fit.loss_scale, "outliers": outliers(calibration)}
    return report


def outliers(calibration: Calibration) -> list[int]:
    """Return the measurements, counted from 1, that a robust loss finds far off."""
    return [row + 1 for row in calibration.fit.outliers]


def _residuals(
    calibration: Calibration,
) -> tuple[tuple[float | None, float | None], tuple[float | None, float | None]]:
    """Return the root mean squares before and after."""
    measurements = calibration.measurements
    before = measurements.root_mean_squares(calibration.arm.robot)
    return before, measurements.root_mean_squares(calibration.fit.robot)


def _values(calibration: Calibration) -> tuple[Array, Array]:
    """Return the nominal and the calibrated values, each (p,), rad and m."""
    nominal, parameters = calibration.arm.robot, calibration.parameters
    return values_of(nominal, nominal, parameters), values_of(calibration.fit.robot, nominal, parameters)


def _combinations(seen: Identifiability) -> list[list[dict[str, Any]]]:
    return [[_share(share) for share in shares] for shares in seen.combinations]


def _share(share: Share) -> dict[str, Any]:
    return {**_parameter_entry(share.parameter), "weight": share.weight}


def _parameter_entry(parameter: ArmParameter) -> dict[str, Any]:
    return {"joint": parameter.owner, "name": parameter.name}


def calibrated_text(calibration: Calibration, sheet: RobotSheet) -> str:
    """Return the robot's file with the calibrated numbers, in its own units, and a note of the calibration.

    Names, limits, source and what else the file says stay as they are; comments do not.
    """
    robot = calibration.fit.robot
    if sheet.text is None:
        units = {"angle": sheet.units.angle, "length": sheet.units.length}
        plain = {**robot_as_mapping(sheet.robot), "units": units}
    else:
        plain = parse_document(sheet.text, sheet.robot.name).plain()
    plain = {"name": robot.name, **plain}
    plain["note"] = " ".join(filter(None, [sheet.note, _note(calibration)]))
    rows = zip(plain["joints"], robot.joints, sheet.robot.joints, strict=True)
    plain["joints"] = [_written_row(joint, row, old, sheet.units) for joint, row, old in rows]
    for key in ("base", "tool"):
        pose = getattr(robot, key)
        if not np.array_equal(pose, getattr(sheet.robot, key)):
            xyz = [to_user(entry, DH_ROW["d"], sheet.units) for entry in pose[:3, 3].tolist()]
            turns = rpy_from_matrix(pose[:3, :3]).angles.tolist()
            plain[key] = {"xyz": xyz, "rpy": [to_user(turn, DH_ROW["theta"], sheet.units) for turn in turns]}
    return mapping_text(plain)


def _written_row(written: dict[str, Any], row: Joint, old: Joint, units: Units) -> dict[str, Any]:
    """Return a joint of a file with the numbers of its row that have changed, in front of its limits."""
    changed = {
        key: to_user(getattr(row, key), quantity, units)
        for key, quantity in DH_ROW.items()
        if getattr(row, key) != getattr(old, key)
    }
    merged = {**written, **changed}
    front = [key for key in ("name", "type", *DH_ROW) if key in merged]
    return {key: merged[key] for key in [*front, *(key for key in merged if key not in front)]}


def _note(calibration: Calibration) -> str:
    before, after = _residuals(calibration)
    changes = [
        f"{what} {old * scale:.4g} to {new * scale:.4g} {unit}"
        for what, old, new, scale, unit in zip(
            ("position", "angle"), before, after, (1e3, 180 / np.pi), ("mm", "deg"), strict=True
        )
        if old is not None and new is not None
    ]
    source = "standard input" if calibration.file == "-" else utf8(Path(calibration.file).name)
    return (
        f"Calibrated by trajcli {__version__} from {len(calibration.measurements.joints)} measurements "
        f"({source}): root mean squares of residuals, {', '.join(changes)}."
    )


def planned_measurements(
    arm: ArmInUnits, count: int, free: str, length: float | None, file: str | None, part: MeasuredPart
) -> tuple[Array, MeasuringPlan, tuple[ArmParameter, ...]]:
    """Return joint values (count, n), rad or m, to measure at, what they tell, and of which parameters.

    Args:
        arm: With nominal parameters.
        count: How many.
        free: Which parameters shall be calibrated.
        length: Metres that count like a radian; None: the characteristic length.
        file: Of candidates; None: random ones within the limits.
        part: What will be measured.

    Raises:
        InputError: When parameters or file are not as they should be, or there are too few configurations.
        FileError: When the file cannot be read.
    """
    robot = arm.robot
    parameters = parse_parameters(robot, free)
    candidates = random_candidates(robot) if file is None else read_configurations(file, robot, arm.units)
    scale = characteristic_length(robot) if length is None else length
    plan = measuring_plan(robot, candidates, parameters, count, scale, part)
    return candidates[plan.chosen], plan, parameters


def plan_report(
    arm: ArmInUnits, joints: Array, plan: MeasuringPlan, parameters: Sequence[ArmParameter]
) -> dict[str, Any]:
    """Return a plan of measurements for programs; joint values in rad and m."""
    return {
        "robot": arm.robot.name,
        "configurations": joints.tolist(),
        "rank": plan.seen.rank,
        "count": len(parameters),
        "unidentifiable": _combinations(plan.seen),
        "observability": {
            "O1": plan.index,
            "smallest_singular_value": plan.smallest,
            "condition": plan.condition,
        },
    }
