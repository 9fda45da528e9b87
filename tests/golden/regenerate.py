"""Write the golden files: `make golden` is the only way to change one, and the change is then read in review."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from trajcli.planning.plan import Plan

GOLDEN = Path(__file__).parent
EXAMPLES = GOLDEN.parent.parent / "examples"


def golden_file(example: Path) -> Path:
    """Return where the rows of an example are kept."""
    return GOLDEN / f"{example.stem}.csv"


def rows_of(plan: Plan) -> bytes:
    """Return what `trajcli plan` writes to standard output of a job so planned."""
    from trajcli.columns import columns_of
    from trajcli.output.write import grid_of
    from trajcli.samples import sample
    from trajcli.streams.csv import write_csv

    loaded = plan.loaded
    if not plan.verdict.passed:
        raise SystemExit(f"{loaded.name} does not verify: {plan.verdict.findings}")
    groups = loaded.job.output.columns
    out = io.BytesIO()
    signals = [signal.name for signal in plan.trajectory.signals]
    columns = columns_of(groups, loaded.robot.joint_types, loaded.units, signals)
    rows = sample(plan.trajectory, grid_of(plan), groups, loaded.units, robot=loaded.robot_of_rows)
    write_csv(rows, columns, out)
    return out.getvalue()


def main() -> None:
    """Write one golden file for each example, and remove those of examples that are gone."""
    from trajcli.job.read import load_job
    from trajcli.planning.plan import plan_job

    written = set()
    for example in sorted(EXAMPLES.glob("*.yaml")):
        target = golden_file(example)
        text = rows_of(plan_job(load_job(example)))
        written.add(target)
        if not target.exists() or target.read_bytes() != text:
            target.write_bytes(text)
            print(f"{target.relative_to(GOLDEN.parent.parent)} written, {len(text)} bytes")
    for stale in set(GOLDEN.glob("*.csv")) - written:
        stale.unlink()
        print(f"{stale.relative_to(GOLDEN.parent.parent)} removed: it has no example")


if __name__ == "__main__":
    main()
