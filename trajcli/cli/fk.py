"""Forward kinematics on the command line: `trajcli fk`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import pose_lines
from trajcli.cli.outcome import print_remark, print_report, print_rows, refuse_beside_rows
from trajcli.errors import InputError
from trajcli.kinematics.forward import forward, link_poses
from trajcli.queries.arm import ArmInUnits, LimitWatch, frame_of_rows, job_of_arm, open_arm
from trajcli.queries.pose import pose_view

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import FkCommand

_SAME_TOOL = 1e-6  # m: more than nine decimals of degrees leave open


def run_fk(options: FkCommand) -> int:
    """Print the pose of the tcp, or one for each row of standard input; return the exit code.

    Raises:
        InputError: When robot, joints, tool or rows are not as they should be.
        FileError: When a file cannot be read, or standard output not written.
    """
    if options.frame == "base" and options.base is not None:
        raise InputError("--frame base counts from the base, wherever it is", hint="leave --base out")
    arm = open_arm(
        options.robot,
        options.tool,
        base=options.base,
        units=options.units,
        si=options.si,
        frame=options.frame,
    )
    if options.joints == ["-"]:
        return _stream(arm, options)
    q = arm.joint_values(options.joints)
    report: dict[str, Any] = pose_view(forward(arm.robot, q), arm.units)
    if options.links:
        frames = link_poses(arm.robot, q)[1:-1]
        names = arm.robot.joint_names
        report["links"] = [
            {"name": name, **pose_view(pose, arm.units)} for name, pose in zip(names, frames, strict=True)
        ]
    print_report(report, _lines(arm, report, options.frame), as_json=options.as_json)
    watch = LimitWatch(arm.robot)
    watch.see(q[None], arm.joint_factors, arm.joint_units)
    _remark(arm, watch)
    return 0


def _lines(arm: ArmInUnits, report: dict[str, Any], frame: str) -> list[str]:
    lines = [f"pose of the tcp of {arm.robot.name} in {frame}:", *pose_lines(report, arm.units)]
    for link in report.get("links", []):
        lines += ["", f"frame of link {link['name']} in {frame}:", *pose_lines(link, arm.units)]
    return lines


def _stream(arm: ArmInUnits, options: FkCommand) -> int:
    from trajcli.queries.forward import poses_of
    from trajcli.streams.table import open_rows

    refuse_beside_rows({"--json": options.as_json, "--links": options.links}, "configuration")
    watch, job = LimitWatch(arm.robot), job_of_arm(options.robot)
    watch.frame = None if job is None else frame_of_rows(job)
    columns, blocks = poses_of(arm, open_rows("-"), watch)
    print_rows(columns, blocks, options.digits)
    _remark(arm, watch, rows=True)
    if watch.tool_off > _SAME_TOOL and options.frame == "world":
        off = f"the rows say where their tcp is, up to {watch.tool_off:.6g} m from that of {arm.robot.name}"
        if job is None:
            print_remark(
                f"{off}: they were made with another tool or base; say --tool, --base or --robot JOB"
            )
        else:
            print_remark(f"{off}, which fk takes with one tool and base; say --tool or --base for others")
    return 0


def _remark(arm: ArmInUnits, watch: LimitWatch, *, rows: bool = False) -> None:
    """Say on standard error that joint values are outside the limits of the robot; their poses stand."""
    print_remark(watch.remark)
    first = watch.first
    if first is None:
        return
    where = ""
    if rows:
        when = "" if first.time is None else f", t = {first.time:.9g} s"
        where = f" in {watch.outside} of {watch.rows} rows, first in row {first.row} (from 0{when})"
    what = f"{first.joint} is at {first.value:.9g} {first.unit}, its limit is {first.limit:.9g} {first.unit}"
    more = f", and {first.others} more joint{'s' * (first.others > 1)}" if first.others else ""
    print_remark(f"outside the limits of {arm.robot.name}{where}: {what}{more}")
