"""Trajectory planning for serial robots: a YAML job in, a verified sample stream out.

What the command line does, from Python:

    import trajcli

    plan = trajcli.plan("job.yaml")  # a path, YAML text or a mapping
    print(plan.verdict)
    q = plan.trajectory([0.0, 0.5, 1.0])  # shape (3, n), rad or m
    qd = plan.trajectory([0.0, 0.5, 1.0], 1)
    rows = plan.trajectory.sample(100)  # rows.t (N,), rows.q, rows.qd, rows.qdd (N, n)
    plan.save("rows.csv")  # refuses what does not verify

All numbers are SI: rad, m, s. Importing this module costs nothing: each name is loaded when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trajcli.api.motions import Motion, batch, plot, resample, retime, sweep, view
    from trajcli.api.plans import Arm, InverseSolution, PlannedJob, check, load_robot, plan
    from trajcli.catalogue.entries import catalogue_names
    from trajcli.checks.verify import Verdict
    from trajcli.curves.piecewise import PiecewisePolynomial
    from trajcli.errors import (
        FileError,
        InputError,
        MissingLimitError,
        Place,
        PlanningError,
        Problem,
        TrajcliError,
        VerificationError,
    )
    from trajcli.findings import Finding
    from trajcli.job.dump import dump_job
    from trajcli.job.model import Job
    from trajcli.job.read import LoadedJob, job_from_text, load_job
    from trajcli.job.report import Report
    from trajcli.job.schema import schema_of
    from trajcli.judge.judgement import Judgement
    from trajcli.kinematics.robot import Joint, Limits, Robot
    from trajcli.output.delivery.joined import write_plan
    from trajcli.output.report import report_of, verification_error
    from trajcli.planning.plan import Plan, plan_job
    from trajcli.trajectory import Rows, State, Trajectory
    from trajcli.version import __version__

_HOMES = {
    "trajcli.api.plans": ("Arm", "InverseSolution", "PlannedJob", "check", "load_robot", "plan"),
    "trajcli.checks.verify": ("Verdict",),
    "trajcli.curves.piecewise": ("PiecewisePolynomial",),
    "trajcli.errors": (
        "FileError",
        "InputError",
        "MissingLimitError",
        "Place",
        "PlanningError",
        "Problem",
        "TrajcliError",
        "VerificationError",
    ),
    "trajcli.findings": ("Finding",),
    "trajcli.job.dump": ("dump_job",),
    "trajcli.job.model": ("Job",),
    "trajcli.job.read": ("LoadedJob", "job_from_text", "load_job"),
    "trajcli.job.report": ("Report",),
    "trajcli.job.schema": ("schema_of",),
    "trajcli.catalogue.entries": ("catalogue_names",),
    "trajcli.judge.judgement": ("Judgement",),
    "trajcli.kinematics.robot": ("Joint", "Limits", "Robot"),
    "trajcli.api.motions": ("Motion", "batch", "plot", "resample", "retime", "sweep", "view"),
    "trajcli.planning.plan": ("Plan", "plan_job"),
    "trajcli.output.delivery.joined": ("write_plan",),
    "trajcli.output.report": ("report_of", "verification_error"),
    "trajcli.trajectory": ("Rows", "State", "Trajectory"),
    "trajcli.version": ("__version__",),
}
_MODULES = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Arm",
    "FileError",
    "Finding",
    "InputError",
    "InverseSolution",
    "Job",
    "Joint",
    "Judgement",
    "Limits",
    "LoadedJob",
    "MissingLimitError",
    "Motion",
    "PiecewisePolynomial",
    "Place",
    "Plan",
    "PlannedJob",
    "PlanningError",
    "Problem",
    "Report",
    "Robot",
    "Rows",
    "State",
    "TrajcliError",
    "Trajectory",
    "Verdict",
    "VerificationError",
    "__version__",
    "batch",
    "catalogue_names",
    "check",
    "dump_job",
    "job_from_text",
    "load_job",
    "load_robot",
    "plan",
    "plan_job",
    "plot",
    "report_of",
    "resample",
    "retime",
    "schema_of",
    "sweep",
    "verification_error",
    "view",
    "write_plan",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in _MODULES:
        raise AttributeError(f"module 'trajcli' has no attribute '{name}'")
    from importlib import import_module

    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
