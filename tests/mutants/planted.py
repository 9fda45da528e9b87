"""Mutants that somebody wrote, each against the tests of its file: `make planted`.

Cosmic Ray changes one number or sign; these leave out a term, look at the first of two ends only, at one direction, at one
block, or make a warning of an error. Each was killed when it was written down in planted.toml; one that survives is a test
that was lost. Each process works in a copy of the tree of its own.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatch
from itertools import groupby
from pathlib import Path
from queue import SimpleQueue

from tests.mutants.copies import copy_of_the_tree
from tests.mutants.tables import Planted, read_planted, subjects


def passes(folder: Path, tests: Sequence[str]) -> bool:
    """Return whether tests pass in a copy of the tree; those that take ten minutes do not."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
    variables = {"PYTHONPATH": str(folder), "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        return not subprocess.run(
            command, check=False, capture_output=True, timeout=600, cwd=folder, env=os.environ | variables
        ).returncode
    except subprocess.TimeoutExpired:
        return False


def outcome_of(mutant: Planted, tests: Sequence[str], folder: Path) -> str | None:
    """Return what is wrong with a mutant that is tried in a copy of the tree; None where it is killed."""
    path = folder / mutant.file
    whole = path.read_text(encoding="utf-8")
    if mutant.text not in whole:
        return "is not in the file any more"
    path.write_text(whole.replace(mutant.text, mutant.change, 1), encoding="utf-8")
    try:
        return "survives" if passes(folder, tests) else None
    finally:
        path.write_text(whole, encoding="utf-8")


def tried(file: str, mutants: Sequence[Planted], folders: SimpleQueue[Path]) -> list[str]:
    """Return what is wrong with the mutants of one file, each in words, after its tests have passed without one."""
    tests, folder = subjects()[file], folders.get()
    try:
        if not passes(folder, tests):
            print(f"{file}: its tests fail without a mutant: {len(mutants)} not tried", flush=True)
            return [file] * len(mutants)
        outcomes = [(mutant, outcome_of(mutant, tests, folder)) for mutant in mutants]
        wrong = [
            f"{file}: {outcome}\n    - {mutant.text}\n    + {mutant.change}"
            for mutant, outcome in outcomes
            if outcome is not None
        ]
        print("\n".join([*wrong, f"{file}: {len(wrong)} of {len(mutants)} not killed"]), flush=True)
        return wrong
    finally:
        folders.put(folder)


def main() -> None:
    """Try the mutants of the files that are asked for, all of them without a pattern."""
    parser = argparse.ArgumentParser(prog="make planted", description=__doc__)
    parser.add_argument("files", nargs="*", help="patterns of files; all of the table without")
    parser.add_argument("--sample", type=int, default=0, help="how many mutants of these files; 0: all")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="how many at a time")
    asked = parser.parse_args()
    chosen = [
        mutant
        for mutant in read_planted()
        if any(fnmatch(mutant.file, name) for name in asked.files or ["*"])
    ]
    if asked.sample:
        places = sorted(random.Random(asked.seed).sample(range(len(chosen)), min(asked.sample, len(chosen))))
        chosen = [chosen[place] for place in places]
    by_file = [(file, list(group)) for file, group in groupby(chosen, key=lambda mutant: mutant.file)]
    folders: SimpleQueue[Path] = SimpleQueue()
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(asked.jobs) as pool:
        for number in range(asked.jobs):
            copy_of_the_tree(Path(place) / str(number))
            folders.put(Path(place) / str(number))
        wrong = sum(len(one) for one in pool.map(lambda pair: tried(*pair, folders), by_file))
    print(f"{wrong} of {len(chosen)} were not killed")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
