"""Jacobians on the command line: `trajcli jacobian`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import matrix_lines, number, numbers
from trajcli.cli.outcome import print_remark, print_report, print_rows, refuse_beside_rows
from trajcli.queries.arm import ArmInUnits, LimitWatch, beyond_two_turns, open_arm
from trajcli.queries.jacobian import jacobian_report

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import JacobianCommand

_COMPONENTS = ("vx", "vy", "vz", "wx", "wy", "wz")


def run_jacobian(options: JacobianCommand) -> int:
    """Print the Jacobian and what it says about the arm; return the exit code.

    Raises:
        InputError: When robot, joints, rates, tool or rows are not as they should be.
        FileError: When a file cannot be read, or standard output not written.
    """
    arm = open_arm(options.robot, options.tool, base=options.base, units=options.units, si=options.si)
    if options.joints == ["-"]:
        return _stream(arm, options)
    q = arm.joint_values(options.joints)
    qd = None if options.rates is None else arm.joint_values([options.rates], "--qd", 1)
    print_remark(beyond_two_turns(arm.robot, q[None], arm.joint_units))
    report = jacobian_report(arm, q, options.frame, qd)
    print_report(report, _lines(arm, report, options.frame), as_json=options.as_json)
    return 0


def _lines(arm: ArmInUnits, report: dict[str, Any], frame: str) -> Iterator[str]:
    length, types = arm.units.length, arm.robot.joint_types
    rates = ", ".join(dict.fromkeys(f"{length}/s" if kind == "prismatic" else "rad/s" for kind in types))
    yield f"Jacobian of {arm.robot.name} in the axes of the {frame} frame"
    yield f"(rows vx vy vz in {length}/s, wx wy wz in rad/s; joint rates in {rates}):"
    yield from matrix_lines(report["jacobian"])
    yield f"manipulability: {number(report['manipulability'])} (in m and rad)"
    condition = "infinite" if report["condition"] is None else number(report["condition"])
    yield f"condition number: {condition} (lengths divided by the length of the arm)"
    yield f"rank: {report['rank']}"
    alone = report["position"]
    of_position = f"manipulability {number(alone['manipulability'])} (in m), rank {alone['rank']}"
    singular = f", which is {alone['nearby']} nearby: singular" if alone["rank"] < alone["nearby"] else ""
    yield f"position alone: {of_position}{singular}"
    for direction in report["singular_directions"]:
        yield f"always zero: {_sum(direction, _COMPONENTS)} (in m/s and rad/s)"
    for motion in report["idle_motions"]:
        rate = _sum(motion, [f"d/dt {name}" for name in arm.robot.joint_names])
        yield f"moves nothing: {rate} (in rad/s and m/s)"
    if "jdot_qd" in report:
        units = f"{length}/s^2 and rad/s^2"
        yield f"acceleration at constant joint rates ({units}): {numbers(report['jdot_qd'])}"


def _sum(factors: Sequence[float], names: Sequence[str]) -> str:
    terms = [(factor, name) for factor, name in zip(factors, names, strict=True) if factor]
    if len(terms) == 1:
        return terms[0][1]
    text = " ".join(f"{'-' if factor < 0 else '+'} {abs(factor):.6g} {name}" for factor, name in terms)
    return text.removeprefix("+ ")


def _stream(arm: ArmInUnits, options: JacobianCommand) -> int:
    from trajcli.queries.forward import jacobians_of
    from trajcli.streams.table import open_rows

    refuse_beside_rows({"--json": options.as_json, "--qd": options.rates is not None}, "configuration")
    watch = LimitWatch(arm.robot)
    columns, blocks = jacobians_of(arm, open_rows("-"), options.frame, watch)
    print_rows(columns, blocks)
    print_remark(watch.remark)
    return 0
