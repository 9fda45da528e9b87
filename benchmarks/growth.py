"""How time and memory of commands grow: each at three sizes, in time of the processor.

`python -m benchmarks.growth` prints the table of the documents. The exponent is that of the last step of the
size, of the time above that of the smallest job, which is mostly start. Times are medians of runs in turns.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.contest import ROOT, Command
from benchmarks.figures import MEGABYTE
from benchmarks.waiting import _job

_QUINTIC = f"{ROOT}/benchmarks/quintic.yaml"
_TURNS = 3
_ROWS, _MOVES, _FEW = (10**4, 10**5, 10**6), (100, 1000, 10_000), (50, 200, 800)
_LONGER = (10**4, 5 * 10**5, 2 * 10**6)  # of which the longer ones are not kept in memory

Words = Callable[[Path, int], Sequence[str]]


def _with_rows(count: int) -> list[str]:
    return [_QUINTIC, "--set", f"moves.0.duration={(count - 1) / 1000}"]


def _file(folder: Path, count: int) -> str:
    """Return a file of so many rows, written once."""
    path = folder / f"rows_{count}.csv"
    if not path.exists():
        Command([sys.executable, "-m", "trajcli", "plan", *_with_rows(count), "-q", "-o", str(path)]).run()
    return str(path)


def _moves(planner: str, folder: Path, count: int) -> str:
    return _job(folder / f"{planner}_{count}.yaml", planner, count)


_COMMANDS: tuple[tuple[str, str, Sequence[int], Words], ...] = (
    ("plan", "rows", _ROWS, lambda folder, n: ["plan", *_with_rows(n), "-q"]),
    (
        "plan --no-output, quintic",
        "moves",
        _MOVES,
        lambda f, n: ["plan", _moves("quintic", f, n), "--no-output"],
    ),
    ("plan, jerk_limited", "moves", _FEW, lambda f, n: ["plan", _moves("jerk_limited", f, n), "-q"]),
    ("explain", "moves", _FEW, lambda f, n: ["explain", _moves("quintic", f, n)]),
    ("check", "rows", _LONGER, lambda f, n: ["check", _file(f, n), "--job", _QUINTIC]),
    ("view", "rows of a plan", _ROWS, lambda f, n: ["view", *_with_rows(n), "-o", str(f / "view.html")]),
    ("view", "rows of a file", _ROWS, lambda f, n: ["view", _file(f, n), "-o", str(f / "view.html")]),
    ("plot", "rows of a plan", _ROWS, lambda f, n: ["plot", *_with_rows(n), "-q", "-o", str(f / "plot.svg")]),
    ("plot", "rows of a file", _ROWS, lambda f, n: ["plot", _file(f, n), "-q", "-o", str(f / "plot.svg")]),
)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", metavar="COMMAND", help="the rows of the table that begin so")
    options = parser.parse_args()
    print("| command | size | time, s | peak memory, MB | exponent |")
    print("|---|---|---:|---:|---:|")
    with TemporaryDirectory() as folder:
        for name, of_what, sizes, words in _COMMANDS:
            if name.startswith(options.only or ""):
                print(_row(name, of_what, sizes, words, Path(folder)), flush=True)


def _row(name: str, of_what: str, sizes: Sequence[int], words: Words, folder: Path) -> str:
    """Return a row of the table."""
    commands = [Command([sys.executable, "-m", "trajcli", *words(folder, size)]) for size in sizes]
    turns = [[command.run() for command in commands] for _ in range(_TURNS)]
    times = [median(seconds for seconds, _ in runs) for runs in zip(*turns, strict=True)]
    peaks = [max((peak or 0.0) / MEGABYTE for _, peak in runs) for runs in zip(*turns, strict=True)]
    above = [max(seconds - times[0], 1e-3) for seconds in times]
    exponent = math.log(above[2] / above[1]) / math.log(sizes[2] / sizes[1])
    listed = [", ".join(f"{size:,}" for size in sizes) + f" {of_what}"]
    listed += [
        ", ".join(f"{value:.{digits}f}" for value in values) for digits, values in ((2, times), (0, peaks))
    ]
    return f"| `{name}` | {' | '.join(listed)} | {exponent:.2f} |"


if __name__ == "__main__":
    main()
