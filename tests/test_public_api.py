"""The public Python API: what `import trajcli` offers, and that it costs nothing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import trajcli

EXAMPLES = Path(__file__).parents[1] / "examples"
HEAVY = ["numpy", "pydantic", "yaml", "typer", "ruckig", "scipy", "trajcli.errors"]


def test_importing_loads_nothing_else() -> None:
    check = f"import sys, trajcli; print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_name_exists_is_documented_and_listed() -> None:
    assert sorted(trajcli.__all__) == sorted(trajcli._MODULES)
    assert dir(trajcli) == sorted(trajcli.__all__)
    for name in trajcli._MODULES.keys() - {"__version__"}:
        value = getattr(trajcli, name)
        assert value.__doc__, name
        assert value.__module__ == trajcli._MODULES[name], name


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'trajcli' has no attribute 'plan_jobs'"):
        _ = trajcli.plan_jobs
    assert not hasattr(trajcli, "read_job")


def test_from_a_job_to_numbers() -> None:
    plan = trajcli.plan_job(trajcli.load_job(EXAMPLES / "cubic.yaml"))
    assert plan.verdict.passed
    q = plan.trajectory.curve.evaluate([0.0, 0.5, 1.0])
    qd = plan.trajectory.curve.evaluate([0.0, 0.5, 1.0], order=1)
    assert np.rad2deg(q[:, 0]) == pytest.approx([20, 35, 50])  # 20 + 90 t^2 - 60 t^3
    assert np.rad2deg(qd[:, 0]) == pytest.approx([0, 45, 0])


def test_the_example_of_the_docstring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_bytes((EXAMPLES / "cubic.yaml").read_bytes())
    assert trajcli.__doc__ is not None
    code = [line[4:] for line in trajcli.__doc__.splitlines() if line.startswith("    ")]
    names: dict[str, np.ndarray] = {}
    exec("\n".join(code), names)
    assert names["q"].shape == names["qd"].shape == (3, 1)


def test_writing_a_plan(tmp_path: Path) -> None:
    plan = trajcli.plan_job(trajcli.load_job(EXAMPLES / "sync.yaml"))
    trajcli.write_plan(plan, str(tmp_path / "rows.csv"))
    golden = Path(__file__).parent / "golden/sync.csv"
    assert (tmp_path / "rows.csv").read_bytes() == golden.read_bytes()


def test_a_log_has_the_report_that_the_command_writes(tmp_path: Path) -> None:
    """With the event of rows that pass a limit between them, whichever way the file is written."""
    from mcap.reader import make_reader

    from trajcli.cli.app import app

    job, paths = (
        EXAMPLES / "sync.yaml",
        [tmp_path / f"{name}.mcap" for name in ("function", "method", "command")],
    )
    trajcli.write_plan(trajcli.plan_job(trajcli.load_job(job)), str(paths[0]))
    trajcli.plan(job).save(paths[1])
    with pytest.raises(SystemExit, match="0"):
        app(["plan", str(job), "-q", "-o", str(paths[2])])
    said = set()
    for path in paths:
        with path.open("rb") as stream:
            (report,) = [
                each.data for each in make_reader(stream).iter_attachments() if "report" in each.name
            ]
        said.add(report)
    assert len(said) == 1
    assert b"joined_over_limit" in report


def test_a_plan_that_breaks_a_limit_is_not_written(tmp_path: Path) -> None:
    loaded = trajcli.job_from_text("""
version: 1
robot: {joints: [{velocity: 1}]}
start: {joints: 0}
moves: [{planner: cubic, to: {joints: 2}, duration: 1}]
""")
    plan = trajcli.plan_job(loaded)
    assert [finding.value for finding in plan.verdict.findings] == pytest.approx([3.0])
    assert trajcli.report_of(plan).verdict == "violated"
    with pytest.raises(trajcli.VerificationError, match="the velocity of j1 reaches 3 rad/s"):
        trajcli.write_plan(plan, str(tmp_path / "rows.csv"))
    assert list(tmp_path.iterdir()) == []


ERRORS = [
    (trajcli.VerificationError, 1),
    (trajcli.InputError, 2),
    (trajcli.MissingLimitError, 2),
    (trajcli.PlanningError, 3),
    (trajcli.FileError, 4),
]


@pytest.mark.parametrize(("error", "code"), ERRORS)
def test_errors(error: type[trajcli.TrajcliError], code: int) -> None:
    assert issubclass(error, trajcli.TrajcliError)
    assert error.exit_code == code
