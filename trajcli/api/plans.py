"""Planning from Python: plans that write and draw themselves, and arms that answer kinematic questions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, numeric, real_number
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.job.report import Report
from trajcli.kinematics.robot import Limits, Robot
from trajcli.output.delivery.delivered import delivered, report_as_delivered
from trajcli.planning.plan import Plan

if TYPE_CHECKING:
    from trajcli.judge.judgement import Judgement
    from trajcli.kinematics.jacobian import ReferenceFrame
    from trajcli.streams.decimals import Digits

_EXACT = 1e-12  # defect of a rotation matrix that is rounding


@frozen
class PlannedJob(Plan):
    """A planned and judged job, with its outputs.

    `verdict` says whether it verifies, `trajectory` is callable. See `Plan` for the rest.

    Attributes:
        digits: With which its rows are written as text, unless `save` says others.
    """

    digits: Digits = "fixed"

    def save(self, path: str | Path, *, digits: Digits | None = None) -> None:
        """Write the rows, as `trajcli plan -o PATH` does: the ending of the name says in which format.

        Args:
            path: The file; it appears whole or not at all.
            digits: Of text formats: "fixed" for nine decimals, "full" for as many as restore each bit; left
                out, as many as the consumer needs, which are nine unless it is planned for one.

        Raises:
            VerificationError: When the plan breaks a limit, or its consumer would by joining the rows of this
                format; nothing is written.
            InputError: When the ending is that of no format, or digits are other words.
            FileError: When the file cannot be written.
        """
        from trajcli.output.delivery.joined import write_plan
        from trajcli.streams.formats import format_of

        if digits not in (None, "fixed", "full"):
            raise InputError(f"expected fixed or full digits, got {digits!r}")
        form, consumer = format_of(str(path)), self.loaded.job.output.consumer
        if consumer is not None and form.content != "rows" and self.verdict.passed:
            from trajcli.consumers.judgement import load_profile
            from trajcli.output.delivery.for_consumer import Writing, refusal, rows_for

            made = rows_for(self, load_profile(consumer), Writing(form, digits or self.digits))
            if made.over:
                hint = f"it was planned for a table: `trajcli plan --for {consumer} -o` plans for this format"
                raise refusal(made, (hint,))
        write_plan(self, str(path), digits or self.digits)

    def report(self) -> Report:
        """Return the report, as `trajcli plan --report` writes it beside rows as CSV."""
        return report_as_delivered(self)

    def _repr_svg_(self) -> str:
        """Return a picture of the plan: notebooks show it."""
        from trajcli.plots.write import svg_of

        return svg_of(self)


@frozen
class InverseSolution:
    """One answer of inverse kinematics.

    Attributes:
        joints: Shape (n,), rad or m.
        branch: Its names, such as {"elbow": "up"}; empty where the arm has none.
        within_limits: Whether all joints are inside their limits.
        closure: By how much forward kinematics of it misses the pose, the larger one in m and rad.
        singular: Whether the arm is singular there.
    """

    joints: Array
    branch: Mapping[str, str]
    within_limits: bool
    closure: float
    singular: bool

    def __repr__(self) -> str:
        joints = np.array2string(self.joints, precision=6, separator=", ", max_line_width=1000)
        names = " ".join(self.branch.values())
        outside = "" if self.within_limits else ", outside limits"
        return f"InverseSolution({joints}{', ' * bool(names)}{names}{outside})"


@frozen
class Arm(Robot):
    """A robot that answers kinematic questions, in SI and in world. See `Robot` for what it is made of."""

    def fk(self, q: ArrayLike) -> Array:
        """Return T_world_tcp, shape (*batch, 4, 4), of joint values (*batch, n), rad or m.

        Raises:
            InputError: When the robot has no geometry, or q has not n finite values.
        """
        from trajcli.kinematics.forward import forward

        return forward(self, q)

    def jacobian(self, q: ArrayLike, frame: ReferenceFrame = "world") -> Array:
        """Return the geometric Jacobian of the tcp, shape (*batch, 6, n), linear rows first.

        Args:
            q: Joint values (*batch, n), rad or m.
            frame: In whose axes: "world", "base" or "tcp".

        Raises:
            InputError: When the robot has no geometry, q has not n finite values, or there is no such frame.
        """
        from trajcli.kinematics.jacobian import ReferenceFrame, jacobian

        if frame not in get_args(ReferenceFrame):
            raise InputError(f"there is no frame {frame!r}", hint="world, base or tcp")
        return jacobian(self, q, frame)

    def ik(
        self, pose: ArrayLike, near: ArrayLike | None = None, *, every: bool = False, tolerance: float = 1e-6
    ) -> tuple[InverseSolution, ...]:
        """Return the configurations that bring the tcp to a pose; none where it is out of reach.

        Args:
            pose: T_world_tcp, shape (4, 4).
            near: Joint values (n,), rad or m: the nearest answer comes first. Zero if left out.
            every: Whether answers outside the limits count too.
            tolerance: What an answer may miss the pose by, m and rad.

        Raises:
            InputError: When the robot has no geometry, the pose is none, `near` is no configuration, or the
                tolerance is no number above 0.
        """
        from trajcli.kinematics.inverse.solve import solve
        from trajcli.kinematics.inverse.target import pose_target

        aim = np.zeros(len(self.joints)) if near is None else np.asarray(numeric(near, "near"), np.float64)
        if aim.ndim != 1:
            raise InputError(f"near: expected the values of {len(self.joints)} joints, got shape {aim.shape}")
        solutions = solve(self, pose_target(_pose(pose)), aim, real_number(tolerance, "tolerance"))
        usable = np.flatnonzero(solutions.valid if every else solutions.within_limits)
        usable = usable[np.argsort(np.abs(solutions.joints[usable] - aim).max(axis=-1), kind="stable")]
        return tuple(
            InverseSolution(
                solutions.joints[index],
                {key: name for key, name in vars(solutions.names[index]).items() if name is not None},
                bool(solutions.within_limits[index]),
                float(solutions.closure[index].max()),
                bool(solutions.singular[index]),
            )
            for index in usable.tolist()
        )


def plan(
    job: str | Path | Mapping[str, Any] | LoadedJob,
    *,
    overrides: Sequence[str] = (),
    rows: Literal["rate", "knots", "both"] | None = None,
    consumer: str | None = None,
) -> PlannedJob:
    """Return the plan of a job with its verdict: one with findings is no error here, only `save` refuses it.

    Place and advice of an error stand in the notes that a traceback shows.

    Args:
        job: The path of a job file, its YAML text, a mapping as YAML would give it, or a job that was read.
        overrides: Such as "moves.0.duration=3", as `--set` takes them; for files only.
        rows: Where rows stand, instead of what `output.rows` says; for files only.
        consumer: Profile of the consumer that it is planned for, such as "ros-jtc", instead of `output.for`.

    Raises:
        InputError: With every flaw of the job at once.
        PlanningError: When a move has no curve.
        VerificationError: When its rows, as the consumer joins them, keep neither rules nor limits.
        FileError: When a file cannot be read.
    """
    try:
        said = [
            *([overrides] if isinstance(overrides, str) else overrides),
            *(() if rows is None else (f"output.rows={rows}",)),
        ]
        planned, digits = delivered(_loaded(job, said), consumer and str(consumer), rows=rows is not None)
    except TrajcliError as error:
        for problem in error.problems:
            where = "" if problem.place is None else str(problem.place)
            note = ": ".join(text for text in (where, problem.advice()) if text)
            if note:
                error.add_note(note)
        raise
    return PlannedJob(**vars(planned), digits=digits)


def check(
    times: ArrayLike,
    q: ArrayLike,
    *,
    robot: str | Path | Robot | None = None,
    qd: ArrayLike | None = None,
    qdd: ArrayLike | None = None,
    interpolate: str | None = None,
    limits: Limits | Mapping[str, Any] | None = None,
) -> Judgement:
    """Return the judgement of a motion that is arrays, as `trajcli check` judges a file.

    Rows are joined to the curve that a consumer makes of them, and the curve is judged for all t. What a name
    stands for is read once.

    Args:
        times: s, shape (N,).
        q: Positions, rad or m, shape (N, n).
        robot: Its name, the path of a robot file, a URDF or a job, or a robot; None for bare joints, which
            have the `limits` alone.
        qd: Velocities, shape (N, n).
        qdd: Accelerations, shape (N, n).
        interpolate: hold, linear, cubic, quintic, jtc or jtc-upsampling; None for the highest degree that the
            columns allow.
        limits: Instead of the robot's: as under `limits` in a job, in SI, or as they are; None in them is
            unlimited.

    Raises:
        InputError: When shapes do not fit, something is not a finite number, or there is no such robot.
        FileError: When a file cannot be read.
    """
    from trajcli.judge.arrays import judge_arrays, requirements_of

    return judge_arrays(times, q, qd, qdd, *requirements_of(robot, limits, interpolate, q))


def load_robot(name: str | Path) -> Arm:
    """Return a robot of the catalogue by its name, or of a robot file, a URDF or a job by its path.

    Raises:
        InputError: When the catalogue has no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    from trajcli.queries.arm import open_sheet

    return Arm(**vars(open_sheet(str(name)).robot))


def _loaded(job: str | Path | Mapping[str, Any] | LoadedJob, overrides: Sequence[str]) -> LoadedJob:
    if isinstance(job, Path) or (isinstance(job, str) and not is_yaml(job)):
        return load_job(job, overrides)
    if overrides:
        raise InputError("overrides are for job files", hint="change the text or the mapping itself")
    if isinstance(job, LoadedJob):
        return job
    if isinstance(job, Mapping):
        from trajcli.job.dump import mapping_text

        return job_from_text(mapping_text(job), "mapping")
    if isinstance(job, str):
        return job_from_text(job)
    raise InputError(
        f"expected a job, got a value of type {type(job).__name__}",
        hint="give the path of a job file, YAML text or a mapping",
    )


def is_yaml(text: str) -> bool:
    """Return whether a text is a job itself, and not the path of one: a name has no line and no mapping."""
    return "\n" in text or text.lstrip().startswith("{") or ": " in text


def _pose(value: ArrayLike) -> Array:
    """Return a pose with the rotation nearest to its upper left entries."""
    from trajcli.geometry.pose import build, check_pose
    from trajcli.geometry.rotation import nearest_rotation

    pose = np.array(numeric(value, "pose"), dtype=np.float64)
    exact = check_pose(pose) <= _EXACT
    return pose if exact else build(nearest_rotation(pose[:3, :3]), pose[:3, 3])
