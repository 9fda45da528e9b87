"""A million rows of nineteen columns as CSV: how long it takes, and how much memory."""

from __future__ import annotations

import io
import os
import sys
import tempfile
from pathlib import Path

from benchmarks.contest import ROOT, Command, Function, Runs, compete
from benchmarks.figures import MEGABYTE, Figure
from benchmarks.planning import NEEDED

ROWS = 10**6
NAMES = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]


def writer():
    """Prepare the writer, on the blocks in which rows are sampled."""
    from trajcli.columns import parse_column
    from trajcli.grids import ROWS as SIZE
    from trajcli.streams.csv import write_csv

    columns = [parse_column(name) for name in NAMES]

    rows = _rows()
    blocks = [rows[low : low + SIZE] for low in range(0, ROWS, SIZE)]

    def run():
        with Path(os.devnull).open("wb") as out:
            write_csv(blocks, columns, out)

    def numbers(_):
        out = io.BytesIO()
        write_csv([rows[:: ROWS // 4]], columns, out)
        return _numbers_of(out)

    return run, numbers


def savetxt():
    """Prepare numpy's writer, with the same decimals."""
    import numpy as np

    rows = _rows()
    options = {"fmt": "%.9f", "delimiter": ",", "header": ",".join(NAMES), "comments": ""}

    def run():
        with Path(os.devnull).open("wb") as out:
            np.savetxt(out, rows, **options)

    def numbers(_):
        out = io.BytesIO()
        np.savetxt(out, rows[:: ROWS // 4], **options)
        return _numbers_of(out)

    return run, numbers


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: time of the writer and of the whole command, and the command's peak memory."""
    module = "benchmarks.writing"
    with tempfile.TemporaryDirectory() as folder:
        runs = compete(
            {
                "writer": Function(sys.executable, module, "writer"),
                "plan": _plan(ROWS),
                "file": _plan(ROWS, "-o", f"{folder}/rows.csv"),
                "full": _plan(ROWS, "--digits", "full"),
                "savetxt": Function(sys.executable, module, "savetxt"),
                "imports": Command([sys.executable, "-c", NEEDED]),
            }
        )
    theirs, start = runs["savetxt"].seconds, runs["imports"].peaks
    peer, above = "np.savetxt %.9f of an array", "import numpy, yaml, pydantic"
    found = [
        *_choices(runs),
        Figure("write 10^6 x 19 as CSV", peer, runs["writer"].seconds, theirs, 0.5, aim=0.25),
        Figure("plan, whole process, 10^6 x 19", peer, runs["plan"].seconds, theirs, 0.5, aim=0.25),
        Figure("peak memory, 10^6 x 19", above, runs["plan"].peaks, start, 40 * MEGABYTE, kind="memory"),
    ]
    if long:
        peaks = compete({"plan": _plan(10 * ROWS)}, repeats=1)["plan"].peaks
        name = "peak memory, 10^7 x 19"
        found += [
            Figure(name, above, peaks, start, 40 * MEGABYTE, kind="memory"),
            Figure(name, "peak memory, 10^6 x 19", peaks, runs["plan"].peaks, 2 * MEGABYTE, kind="memory"),
        ]
    return found


def _choices(runs: dict[str, Runs]) -> list[Figure]:
    """Return what a file read back and full digits cost beside standard output with nine decimals."""
    plain, name = runs["plan"].seconds, "plan, whole process, 10^6 x 19"
    return [
        Figure(f"{name}, -o FILE", "to standard output", runs["file"].seconds, plain, 1.3),
        Figure(f"{name}, --digits full", "nine decimals", runs["full"].seconds, plain, 1.5),
    ]


def _plan(rows: int, *options: str) -> Command:
    duration = f"moves.0.duration={(rows - 1) / 1000}"
    job = f"{ROOT}/benchmarks/quintic.yaml"
    return Command([sys.executable, "-m", "trajcli", "plan", job, "--set", duration, *options])


def _rows():
    """Return the rows (ROWS, 19) of `quintic.yaml`, slowed down to last a millisecond for each."""
    import numpy as np

    t = np.arange(ROWS) / 1000
    u, duration = (t / t[-1])[:, None], t[-1]
    displacement = np.array([1, -1, 1.5, 0.5, -0.5, 2])
    q = displacement * (10 * u**3 - 15 * u**4 + 6 * u**5)
    qd = displacement / duration * (30 * u**2 - 60 * u**3 + 30 * u**4)
    qdd = displacement / duration**2 * (60 * u - 180 * u**2 + 120 * u**3)
    return np.column_stack([t, q, qd, qdd])


def _numbers_of(out: io.BytesIO):
    return [float(cell) for line in out.getvalue().splitlines()[1:] for cell in line.split(b",")]
