"""Files of motions from Python: retimed, resampled, drawn, shown, and planned by the batch."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from functools import partial
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from trajcli.api.plans import is_yaml
from trajcli.api.plans import plan as planned_job
from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import frozen
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import holds_motion, read_table
from trajcli.streams.whole_file import whole_file

if TYPE_CHECKING:
    from trajcli.batches.sweep_table import SweepTable
    from trajcli.batches.task import JobOutcome
    from trajcli.editing.retiming import Stretch
    from trajcli.streams.formats import FormatName

JobSource = str | Path | Mapping[str, Any] | Plan
Several = str | Path | Sequence[str | Path]


@frozen
class Motion:
    """A motion that was read from a file, or made of one.

    Attributes:
        edited: Its rows, and how its file wrote them.
        stretches: By what it was stretched, and what binds it; empty where its time was kept.
    """

    edited: EditedMotion
    stretches: tuple[Stretch, ...] = ()

    def __repr__(self) -> str:
        rows, joints = self.q.shape
        return f"Motion({rows} rows, {joints} joint{'s' * (joints != 1)}, {self.duration:.6g} s)"

    @property
    def t(self) -> Array:
        """Times of the rows, s, shape (N,)."""
        return self.edited.rows.t

    @property
    def q(self) -> Array:
        """Positions, rad or m, shape (N, n)."""
        return self.edited.rows.q

    @property
    def qd(self) -> Array | None:
        """Velocities, shape (N, n); None where the file has none."""
        return self.edited.rows.qd

    @property
    def qdd(self) -> Array | None:
        """Accelerations, shape (N, n); None where the file has none."""
        return self.edited.rows.qdd

    @property
    def duration(self) -> float:
        """From the first row to the last, s."""
        return float(self.t[-1] - self.t[0])

    @property
    def notes(self) -> tuple[str, ...]:
        """What was taken for what in reading, and what was left out."""
        return self.edited.notes

    def save(self, path: str | Path) -> tuple[str, ...]:
        """Write the motion; return what a reader should know about what the format cannot hold.

        Args:
            path: The file, whose ending says the format; it appears whole or not at all.

        Raises:
            InputError: When the ending is that of no format, or the format cannot hold the motion.
            FileError: When the file cannot be written.
        """
        from trajcli.editing.writing import write_motion

        return write_motion(self.edited, str(path))


def retime(
    file: str | Path,
    *,
    job: str | Path | None = None,
    robot: str | Path | None = None,
    fastest: bool = False,
    per_move: bool = False,
    output: str | Path | None = None,
) -> Motion:
    """Return the motion of a file over the shortest time that keeps its limits, as `trajcli retime` does.

    Args:
        file: Rows in any format that `trajcli check` reads.
        job: By whose limits; either this or `robot`.
        robot: The name of a robot, or the path of its file.
        fastest: Whether it may become faster.
        per_move: Whether each move has its own time.
        output: Where it is written; its decimals are then those that are judged.

    Raises:
        InputError: When the file is no motion, or neither a job nor a robot is named.
        VerificationError: When no time keeps the limits.
        FileError: When a file cannot be read or written.
    """
    from trajcli.editing.requirements import kept_limits
    from trajcli.editing.retiming import retime as retimed
    from trajcli.editing.writing import as_read
    from trajcli.output.delivery.delivered import delivered_as

    limits = kept_limits(*(None if name is None else str(name) for name in (job, robot)))
    arm = limits.robot
    before = limits.with_moves(
        read_motion(
            str(file),
            ReadingOptions(),
            joints=arm.joint_names,
            joint_types=arm.joint_types,
            declared=limits.units,
        ),
        delivered_as,
    )
    reader = EditedMotion.as_written if output is None else partial(as_read, path=str(output))
    found, stretches = retimed(
        before, limits.requirements, fastest=fastest, per_move=per_move, as_read=reader
    )
    return _continuous(before, Motion(found, stretches), output)


def resample(file: str | Path, rate: float, *, output: str | Path | None = None) -> Motion:
    """Return the motion of a file on another grid, as `trajcli resample` does.

    Args:
        file: Rows in any format that `trajcli check` reads; their units are kept.
        rate: Hz.
        output: Where it is written.

    Raises:
        InputError: When the file is no motion, or the rate is not above zero.
        FileError: When a file cannot be read or written.
    """
    from trajcli.editing.operations import resample as resampled
    from trajcli.units import Units

    _require_positive("rate", rate, "rows per second above 0")
    before = read_motion(str(file), ReadingOptions(), declared=Units())
    return _continuous(before, Motion(resampled(before, float(rate))), output)


def _continuous(before: EditedMotion, motion: Motion, output: str | Path | None) -> Motion:
    """Return a motion, written where that is asked for; refuse one that jumps where the file does not."""
    from trajcli.editing.requirements import refuse_new_jumps

    refuse_new_jumps(before, motion.edited)
    if output is not None:
        motion.save(output)
    return motion


def plot(
    source: JobSource,
    output: str | Path,
    *,
    over: Several = (),
    quantities: str | Sequence[str] | None = None,
    joints: str | Sequence[str] = (),
) -> None:
    """Draw a job, a plan or a file of rows, as `trajcli plot` does.

    Args:
        source: A plan, a job as `trajcli.plan` takes it, or the path of a file of rows.
        output: An SVG, PNG or PDF file; it appears whole or not at all.
        over: Files of rows that are drawn over it; over a job, what is wrong with them is marked.
        quantities: Of q, qd, qdd, qddd, tau, tool, path, phase; those that suit where left out.
        joints: Names of the joints to show; all where left out.

    Raises:
        InputError: When a file or a quantity does not fit.
        PlanningError: When a move has no curve.
        FileError: When a file cannot be read or written.
    """
    from trajcli.judge.file import CheckOptions
    from trajcli.output.delivery.delivered import judged_file
    from trajcli.plots.choice import parse_quantities
    from trajcli.plots.picture import picture_of
    from trajcli.plots.write import format_of_picture, rendered

    kind = format_of_picture(str(output), None)
    plan = None if _is_motion(source) else _plan_of(source)
    files = [*([str(source)] if plan is None else []), *_listed(over)]
    wanted = None if quantities is None else parse_quantities(",".join(_listed(quantities)))
    with np.errstate(all="ignore"):  # what is not finite was found by the checks
        names = None if plan is None else plan.loaded.robot.joint_names
        sources = [ByteSource(name) for name in files]
        tables = [read_table(each, joints=names) for each in sources]
        judged = [] if plan is None else [judged_file(each, CheckOptions(), plan) for each in sources]
        judgements = [None if isinstance(each, str) else each.judgement for each in judged]
        picture = picture_of(plan, tables, wanted, tuple(_listed(joints)), judgements)
        content = rendered(picture, kind)
    with whole_file(str(output)) as out:
        out.write(content)


def view(
    source: JobSource,
    output: str | Path,
    *,
    beside: JobSource | None = None,
    robot: str | Path | None = None,
    compress: bool = False,
    meshes: float = 0.5,
) -> None:
    """Write the page that plays a motion in any browser, as `trajcli view` does.

    Args:
        source: A plan, a job as `trajcli.plan` takes it, or the path of a file of rows.
        output: An HTML file; it appears whole or not at all.
        beside: A second motion, to be played beside the first; as `source`.
        robot: The arm that files of rows move, and by whose limits they are judged: a name, a robot file, or
            a job; left out, the job that is shown beside one.
        compress: Whether script and data are packed.
        meshes: How long the visual meshes of a URDF may be, MB; with 0 none are drawn.

    Raises:
        InputError: When the file does not fit, or two motions are not of the same joints.
        PlanningError: When a move has no curve.
        FileError: When a file cannot be read or written.
    """
    from trajcli.player.page import check_page_name, page_of

    check_page_name(str(output))
    if not (_is_finite(meshes) and meshes >= 0):
        raise InputError(f"meshes: expected megabytes, 0 at least, got {meshes!r}")
    given = (source,) if beside is None else (source, beside)
    shown = [motion if _is_path(motion) else _plan_of(motion) for motion in given]
    arm = _arm_of(shown, None if robot is None else str(robot))
    scene, *second = [_scene_of(motion, arm, meshes) for motion in shown]
    if second:
        from trajcli.player.scene import scene_of_two

        scene = scene_of_two(scene, *second)
    page = page_of(scene, compress=compress)
    with whole_file(str(output)) as out:
        out.write(page)


def _arm_of(shown: Sequence[JobSource], robot: str | None) -> str | Plan | None:
    """Return by what files of rows are judged: the robot that is named, else the first job."""
    jobs = [source for source in shown if not _is_motion(source)]
    if robot is not None:
        if len(jobs) == len(shown):
            raise InputError("robot: it is for files of rows, and a job names its own", hint="leave it out")
        return robot
    return next((job if isinstance(job, Plan) else str(job) for job in jobs), None)


def _scene_of(source: JobSource, arm: str | Plan | None, meshes: float) -> dict[str, Any]:
    """Return what the page shows of a plan, a job, or a file of rows."""
    with np.errstate(all="ignore"):
        if _is_motion(source):
            from trajcli.judge.file import CheckOptions
            from trajcli.output.delivery.delivered import judged_by, judged_file
            from trajcli.player.recorded import scene_of_file

            opened = ByteSource(str(source))
            if isinstance(arm, Plan):
                by_plan = judged_file(opened, CheckOptions(), arm)
                return scene_of_file(opened, arm.loaded.robot, by_plan, meshes)
            checked = None if arm is None else judged_by(opened, arm)
            return scene_of_file(opened, arm, checked, meshes)
        from trajcli.player.scene import scene_of_plan

        return scene_of_plan(_plan_of(source), meshes)


def batch(
    jobs: Several,
    output: str | Path | None = None,
    *,
    form: FormatName = "csv",
    rows: Literal["rate", "knots", "both"] | None = None,
    consumer: str | None = None,
    processes: int | None = None,
    force: bool = False,
    timeout: float | None = 600.0,
    strict: bool = False,
) -> list[JobOutcome]:
    """Plan many jobs in processes of their own, as `trajcli batch` does; return what came of each.

    Rows that an earlier batch wrote for a job that fails now get the name of their file with `.stale` behind.

    Args:
        jobs: Job files, and folders of them.
        output: The folder of the rows; beside their jobs where left out.
        form: Their format.
        rows: Where they stand, instead of what each job says.
        consumer: Profile of the consumer that all are planned for, instead of `output.for`.
        processes: At most; one a core where left out.
        force: Whether unchanged jobs are planned again.
        timeout: What a job may take, s; None for ever.
        strict: Whether events fail a job.

    Raises:
        InputError: When there is no job, or two have one output; or an argument means nothing.
        FileError: When a folder cannot be read.
    """
    from trajcli.batches.jobs import Ledgers, find_jobs
    from trajcli.batches.processes import run_in_processes
    from trajcli.batches.task import BatchSetup, Task

    count = _processes(processes, timeout)
    found = find_jobs(_listed(jobs), None if output is None else str(output), form)
    ledgers = Ledgers(found.jobs)
    entries = {} if force else ledgers.entries()
    tasks = [Task(job, entries.get(job.output)) for job in found.jobs]
    setup = BatchSetup(form, found.owners(), rows, consumer, strict)
    outcomes: list[JobOutcome] = []
    count = min(count, len(tasks))
    try:
        with closing(run_in_processes(tasks, setup, count, timeout, lambda: None)) as done:
            for outcome in done:
                if outcome.entry is not None and outcome.outcome == "written":
                    ledgers.add(outcome.job, outcome.entry)
                elif outcome.exit_code:
                    ledgers.set_aside(outcome.job)
                outcomes.append(outcome)
    finally:
        ledgers.write()
    order = {job.job: index for index, job in enumerate(found.jobs)}
    return sorted(outcomes, key=lambda outcome: order[outcome.job.job])


def sweep(
    job: str | Path | Mapping[str, Any],
    vary: Mapping[str, str | Iterable[Any]],
    output: str | Path | None = None,
    *,
    samples: int | None = None,
    seed: int = 0,
    processes: int | None = None,
    timeout: float | None = 600.0,
    force: bool = False,
) -> SweepTable:
    """Plan one job over a grid of values in several processes, as `trajcli sweep` does; return the table.

    Args:
        job: A job file, the text of a job, or a mapping.
        vary: By paths such as "limits.tcp.speed", the values: a list, or a text such as "100..500:9".
        output: The file of the table, .csv or .jsonl, beside which what came of the points is kept for the
            next time; nothing is written where left out.
        samples: So many of the combinations, drawn evenly by chance; all where left out.
        seed: Of that chance.
        processes: At most; one a core where left out.
        timeout: What a point may take, s; None for ever.
        force: Whether points that are known are planned again.

    Raises:
        InputError: When a path leads nowhere, there are too many points, or an argument means nothing.
        FileError: When the job cannot be read, or the table not written.
        TrajcliError: When a process that planned a point has crashed.
    """
    from trajcli.batches.processes import run_in_processes
    from trajcli.batches.sweep import PointLedger, axis_of, outcomes_of, parse_axis, sweep_of
    from trajcli.batches.sweep_table import SweepRow, SweepTable, form_of_table
    from trajcli.job.dump import mapping_text
    from trajcli.job.yaml.document import read_bytes

    count = _processes(processes, timeout)
    if not isinstance(vary, Mapping):
        raise InputError(f"vary: expected a mapping of paths to values, got {vary!r}")
    if isinstance(job, Mapping) or (isinstance(job, str) and is_yaml(job)):
        file, content = "<text>", (mapping_text(job) if isinstance(job, Mapping) else job).encode()
    else:
        file, content = str(job), read_bytes(str(job))
    axes = [
        parse_axis(f"{path}={values}") if isinstance(values, str) else axis_of(path, values)
        for path, values in vary.items()
    ]
    swept = sweep_of(file, content, axes, samples, seed)
    table = None if output is None else str(output)
    if table is not None:
        form_of_table(table)
    count = min(count, len(swept.rows))
    ledger = PointLedger(table, force=force)
    rows = dict[int, SweepRow]()
    run = partial(run_in_processes, count=count, timeout=timeout)
    with closing(outcomes_of(swept, ledger, run)) as outcomes:
        for row, outcome in outcomes:
            if outcome.point is None:
                raise TrajcliError(*outcome.problems)
            rows[row] = SweepRow(swept.values(swept.rows[row]), outcome.point)
    made = SweepTable(tuple(axis.path for axis in axes), tuple(rows[row] for row in sorted(rows)))
    if table is not None:
        made.save(table)
    return made


def _is_path(source: JobSource) -> bool:
    """Return whether a source is the path of a file, and no text."""
    return isinstance(source, Path) or (isinstance(source, str) and not is_yaml(source))


def _is_motion(source: JobSource) -> bool:
    """Return whether a source is a file of rows, and no job."""
    return _is_path(source) and holds_motion(str(source))


def _plan_of(source: JobSource) -> Plan:
    return source if isinstance(source, Plan) else planned_job(source)


def _listed(names: Several) -> list[str]:
    """Return what is one name or several of them."""
    return [str(names)] if isinstance(names, str | Path) else [str(name) for name in names]


def _is_finite(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, Real) and bool(np.isfinite(float(value)))


def _require_positive(name: str, value: float, expected: str) -> None:
    if not (_is_finite(value) and value > 0):
        raise InputError(f"{name}: expected {expected}, got {value!r}")


def _processes(asked: int | None, timeout: float | None) -> int:
    """Return how many processes there are at most, where that many and their time mean something."""
    from trajcli.batches.processes import MOST_PROCESSES, usable_cores

    if timeout is not None:
        _require_positive("timeout", timeout, "seconds above 0, or None for ever")
    if asked is None:
        return usable_cores()
    if not isinstance(asked, int) or not 1 <= asked <= MOST_PROCESSES:
        raise InputError(f"processes: expected 1 to {MOST_PROCESSES}, got {asked!r}")
    return asked
