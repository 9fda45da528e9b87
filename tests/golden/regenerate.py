"""Write the golden files: `make golden` is the only way to change one, and the change is then read in review."""

from __future__ import annotations

import io
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from trajcli.errors import InputError

if TYPE_CHECKING:
    from trajcli.comparison.difference import Difference
    from trajcli.planning.plan import Plan

GOLDEN = Path(__file__).parent
EXAMPLES = GOLDEN.parent.parent / "examples"
UNITS, ROUNDED = 2, 1e-9
"""What another processor may change: units of the last decimal, and a part of the largest value of the column.

Its sines, and sums of many terms, have other last bits; what is found by a search hangs on them more than once.
"""


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


def difference_of(now: Path, golden: Path) -> Difference:
    """Return how rows differ from golden ones by more than another processor may change."""
    from trajcli.comparison.difference import compare
    from trajcli.streams.table import read_csv

    ours, theirs = read_csv(str(now)), read_csv(str(golden))
    sizes = np.abs(theirs.columns).max(axis=0)
    allowed = {name: UNITS * 1e-9 + ROUNDED * size for name, size in zip(theirs.names, sizes, strict=True)}
    return compare(ours, theirs, allowed, {})


def main() -> None:
    """Write a golden file for each example whose rows are others, and remove those of examples that are gone."""
    from trajcli.job.read import load_job
    from trajcli.planning.plan import plan_job

    written = set()
    for example in sorted(EXAMPLES.glob("*.yaml")):
        target = golden_file(example)
        text = rows_of(plan_job(load_job(example)))
        written.add(target)
        if not (target.exists() and _same(text, target)):
            target.write_bytes(text)
            print(f"{target.relative_to(GOLDEN.parent.parent)} written, {len(text)} bytes")
    for stale in set(GOLDEN.glob("*.csv")) - written:
        stale.unlink()
        print(f"{stale.relative_to(GOLDEN.parent.parent)} removed: it has no example")


def _same(text: bytes, golden: Path) -> bool:
    with TemporaryDirectory() as folder:
        now = Path(folder, golden.name)
        now.write_bytes(text)
        try:
            return difference_of(now, golden).equal
        except InputError:
            return False


if __name__ == "__main__":
    main()
