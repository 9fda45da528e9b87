"""Inverse kinematics on the command line: `trajcli ik`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from numpy.linalg import inv

from trajcli.cli.numbers import number, numbers
from trajcli.cli.outcome import print_json, print_lines, print_remark, print_rows, refuse_beside_rows
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError
from trajcli.job.inline import inline_target
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.language.targets import ik_target
from trajcli.queries.arm import ArmInUnits, LimitWatch, frame_of_rows, job_of_arm, open_arm
from trajcli.queries.inverse import Wanted, answer_reports, find_answers, require_answer
from trajcli.queries.pose import pose_view

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import IkCommand

_FINEST = 1e-12  # m and rad: what rounding leaves of an exact answer is below
_COARSEST = 1.0  # m and rad: an arm that misses by more has not answered


def run_ik(options: IkCommand) -> int:
    """Print all joint values for a pose, or one row of them for each pose of a CSV; return the exit code.

    Raises:
        InputError: When robot, pose, tool or rows are not as they should be.
        PlanningError: After printing, when no answer is within the limits.
        FileError: When a file cannot be read, or standard output not written.
    """
    _check(options)
    arm = open_arm(options.robot, options.tool, base=options.base, units=options.units, si=options.si)
    near = None if options.near is None else arm.joint_values([options.near], "--near")
    if near is not None:
        _remark_on(arm, near)
    if options.pose is None:
        return _stream(arm, near, options)
    asked = inline_target(options.pose, arm.units, arm.robot)
    target = Wanted(ik_target(asked), asked.pins, asked.configuration)
    solutions, chosen = find_answers(arm, target, near, options.tolerance)
    reports = answer_reports(arm, solutions, chosen, target, near, every=options.every, turns=options.turns)
    if options.as_json:
        print_json(reports)
    elif reports:
        print_lines(_lines(arm, solutions, reports))
    require_answer(arm, solutions, chosen, target)
    return 0


def _remark_on(arm: ArmInUnits, near: Array) -> None:
    """Say on standard error that --near is where the arm cannot be; it counts all the same."""
    watch = LimitWatch(arm.robot)
    watch.see(near[None], arm.joint_factors, arm.joint_units)
    if watch.remark is not None:
        print_remark(f"--near: {watch.remark}")
    if watch.first is not None:
        joint, unit = watch.first, watch.first.unit
        what = f"{joint.joint} is at {joint.value:.9g} {unit}, its limit is {joint.limit:.9g} {unit}"
        print_remark(f"--near is outside the limits of {arm.robot.name}: {what}")


def _check(options: IkCommand) -> None:
    words = options.rows or []
    if words not in ([], ["-"]):
        raise InputError(
            f"there is no place for {words[0]}", hint="poses are given by --pose, or as - for a CSV"
        )
    if bool(words) == (options.pose is not None):
        raise InputError("say either --pose POSE, or - to read poses from a CSV")
    if not _FINEST <= options.tolerance <= _COARSEST:
        extent = f"from {_FINEST:g} to {_COARSEST:g} (m and rad)"
        message = f"--tolerance must be {extent}, got {options.tolerance:.6g}"
        raise InputError(message, hint="below is rounding, and what misses by more is no answer")
    if words:
        refuse_beside_rows({"--turns": options.turns, "--json": options.as_json}, "pose")


def _lines(arm: ArmInUnits, solutions: Solutions, reports: Sequence[dict[str, Any]]) -> Iterator[str]:
    units = dict.fromkeys(arm.joint_units)
    count = f"{len(reports)} answer{'s' * (len(reports) != 1)}"
    yield f"{count} for {arm.robot.name} ({', '.join(units)}), by {solutions.method.name}:"
    for answer in reports:
        names = " ".join(answer["branch"].values())
        notes = [names] if names else []
        notes += [] if answer["within_limits"] else ["outside the limits"]
        notes += ["singular"] if answer["singular"] else []
        if "free_direction" in answer:
            notes.append(f"free along {numbers(answer['free_direction'])}")
        if "turns_not_met" in answer:
            notes.append(f"turns of {', '.join(answer['turns_not_met'])} not as asked")
        joints = numbers(answer["joints"])
        yield f"  {joints}" + (f"   ({', '.join(notes)})" if notes else "")
    worst = max(answer["closure"] for answer in reports)
    yield f"they miss the pose by at most {number(worst) if worst > 1e-12 else '1e-12'} (m, rad)"


def _check_frame(arm: ArmInUnits, robot: str) -> None:
    """Refuse rows by a job that writes poses in a frame of its own: nobody knows in which these are."""
    job = job_of_arm(robot)
    frame = None if job is None else frame_of_rows(job)
    if job is None or frame is None:
        return
    inside, world = (_pose_text(arm, pose) for pose in (inv(frame) @ job.robot.stand, job.robot.stand))
    name = job.job.output.frame
    message = f"{job.name} writes poses in '{name}', and ik reads them in world: in which are these rows?"
    hint = f"say where the base is there: --base '{inside}' in {name}, --base '{world}' in world"
    raise InputError(message, hint=hint)


def _pose_text(arm: ArmInUnits, pose: Array) -> str:
    view = pose_view(pose, arm.units)
    parts = (f"{key}: [{', '.join(map(number, view[key]))}]" for key in ("xyz", "quat_wxyz"))
    return f"{{{', '.join(parts)}}}"


def _stream(arm: ArmInUnits, near: Array | None, options: IkCommand) -> int:
    from trajcli.queries.inverse_stream import EveryAnswer, joints_of
    from trajcli.streams.table import open_rows
    from trajcli.streams.whole_file import standard_output

    if options.base is None:
        _check_frame(arm, options.robot)
    if options.every:
        answers = EveryAnswer(arm, open_rows("-"), near, options.tolerance)
        with standard_output() as out:
            out.writelines(answers.lines(options.digits))
        if answers.missed is not None:
            hint = "its other answers, if any, have within_limits 0"
            raise PlanningError(f"no answer to row {answers.missed} (from 0) is within the limits", hint=hint)
        return 0
    columns, blocks = joints_of(arm, open_rows("-"), near, options.tolerance)
    print_rows(columns, blocks, options.digits)
    return 0
