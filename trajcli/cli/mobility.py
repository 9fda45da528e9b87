"""Mobility on the command line: `trajcli mobility`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.cli.outcome import print_json, print_lines
from trajcli.errors import InputError
from trajcli.queries.arm import open_sheet
from trajcli.queries.mobility import (
    Linkage,
    checked,
    linkage_of,
    mobility_report,
    parse_joints,
)

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import MobilityCommand


def run_mobility(options: MobilityCommand) -> int:
    """Print the number of freedoms of a robot or a linkage, and how it is counted; return the exit code.

    Raises:
        InputError: When neither or both are named, or the linkage is impossible.
        FileError: When the robot's file cannot be read.
    """
    report = mobility_report(_linkage(options))
    if options.as_json:
        print_json(report)
        return 0
    numbers = (
        f"lambda = {report['lambda']} ({report['space']}), n = {report['links']} links with the frame, "
        f"{report['joints']} joint{'s' * (report['joints'] != 1)}, f0 = {report['passive']} passive, "
        f"{report['loops']} closed loop{'s' * (report['loops'] != 1)}"
    )
    formula = f"  lambda (n - 1) - sum (lambda - f_i) - f0 = {report['count']}"
    lines = [f"mobility: {report['dof']}", formula, f"  {numbers}"]
    print_lines(lines + ([f"  {report['remark']}"] if "remark" in report else []))
    return 0


def _linkage(options: MobilityCommand) -> Linkage:
    described = options.links is not None or options.joints is not None
    if options.robot is not None:
        if described:
            raise InputError("--robot and --links with --joints exclude each other", hint="leave one out")
        return linkage_of(open_sheet(options.robot).robot, options.space, options.passive)
    if options.links is None or options.joints is None:
        missing = " and ".join(
            name
            for name, value in (("--links", options.links), ("--joints", options.joints))
            if value is None
        )
        raise InputError(
            f"{missing} {'are' if ' ' in missing else 'is'} missing",
            hint="such as --links 4 --joints 1x4 --space planar for a four-bar linkage, or --robot ur5e",
        )
    return checked(Linkage(options.links, parse_joints(options.joints), options.space, options.passive))
