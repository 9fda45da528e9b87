"""Inverse dynamics on the command line: `trajcli dynamics`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.cli.numbers import matrix_lines, number, table_lines
from trajcli.cli.outcome import print_remark, print_report, print_rows, refuse_beside_rows
from trajcli.job.inline import inline_payload
from trajcli.kinematics.robot import Robot
from trajcli.queries.arm import ArmInUnits, LimitWatch, beyond_two_turns, open_arm
from trajcli.queries.dynamics import dynamics_report, efforts_of, left_out
from trajcli.units import effort_unit

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import DynamicsCommand

_DECIMALS = 9  # of a part of a limit: below is rounding


def run_dynamics(options: DynamicsCommand) -> int:
    """Print the efforts of a state, or those of each row of standard input; return the exit code.

    Raises:
        InputError: When robot, joints, rates, payload or rows are not as they should be.
        FileError: When a file cannot be read, or standard output not written.
    """
    arm = open_arm(options.robot, options.tool, base=options.base, units=options.units, si=options.si)
    if options.payload is not None:
        payload = inline_payload(options.payload, arm.units)
        arm = replace(arm, robot=replace(arm.robot, payload=payload))
    if options.joints == ["-"]:
        return _stream(arm, options)
    q = arm.joint_values(options.joints)
    given = (("--qd", options.rates, 1), ("--qdd", options.accelerations, 2))
    qd, qdd = (
        np.zeros_like(q) if text is None else arm.joint_values([text], name, order)
        for name, text, order in given
    )
    print_remark(beyond_two_turns(arm.robot, q[None], arm.joint_units))
    report = dynamics_report(arm, q, qd, qdd)
    print_report(report, _lines(arm.robot, report), as_json=options.as_json)
    return 0


def _lines(robot: Robot, report: dict[str, Any]) -> Iterator[str]:
    carried = "" if robot.payload is None else f" with {robot.payload.mass:.9g} kg"
    units = ", ".join(dict.fromkeys(map(effort_unit, robot.joint_types)))
    yield f"efforts of {robot.name}{carried} ({units}):"
    efforts = [report[key] for key in ("tau", "gravity", "coriolis", "friction")]
    rows = [["joint", "tau", "gravity", "Coriolis", "friction", "limit", "% used"]]
    for index, joint in enumerate(robot.joints):
        values = [each[index] for each in efforts]
        low, high = robot.limits.effort[index].tolist()
        bounds = (low, high) if np.isfinite((low, high)).any() else joint.effort
        rows.append([joint.name, *map(number, values), *_used(values[0], bounds)])
    yield from table_lines(rows)
    yield "mass matrix, rotors included (kg m^2; kg m and kg where joints slide):"
    yield from matrix_lines(report["mass_matrix"])


def _used(tau: float, bounds: tuple[float, float]) -> tuple[str, str]:
    """Return the bound on the side of an effort, in force or else the robot's own, and the part used."""
    bound = bounds[tau > 0]
    return (
        ("-", "-") if np.isinf(bound) else (number(bound), f"{abs(round(100 * tau / bound, _DECIMALS)):.4g}")
    )


def _stream(arm: ArmInUnits, options: DynamicsCommand) -> int:
    from trajcli.streams.table import open_rows

    given = {"--json": options.as_json, "--qd": options.rates, "--qdd": options.accelerations}
    refuse_beside_rows(given, "state")
    watch, rows = LimitWatch(arm.robot), open_rows("-")
    columns, blocks = efforts_of(arm, rows, watch)
    missing = left_out(rows)
    print_rows(columns, blocks, options.digits)
    if missing:
        print_remark(f"without columns {' and '.join(missing)}, which count as zero")
    print_remark(watch.remark)
    return 0
