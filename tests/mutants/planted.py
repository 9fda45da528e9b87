"""Mutants that somebody wrote, each against the tests of its file: `make planted`.

Cosmic Ray changes one number or sign; these leave out a term, look at the first of two ends only, at one direction, at one
block, or make a warning of an error. Each was killed when it was written down in planted.toml; one that survives is a test
that was lost. Each process works in a copy of the tree of its own. Which test kills a mutant is kept in killers.json: it is
run first, and alone, the next time.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import groupby
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

import pytest

from tests.mutants.copies import copy_of_the_tree
from tests.mutants.tables import Planted, read_killers, read_planted, subjects, write_killers

CACHE = ".pytest_of_mutants"
ONE_AT_A_TIME = Lock()


@dataclass(frozen=True)
class Bench:
    """A copy of the tree in which mutants are tried, one after the other."""

    folder: Path

    def failing(self, tests: Sequence[str], *, compiled: bool = False, tier: str = "quick") -> str | None:
        """Return the first test that fails, or what stands for it where none has begun; None where all pass.

        Tests that take ten minutes fail. With `compiled` the tests are kept as pytest has compiled them, for the next time.
        """
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "--tb=no",
            "-p",
            "no:xdist",
            "-o",
            f"cache_dir={CACHE}",
        ]
        variables = {"PYTHONPATH": str(self.folder), "OPENBLAS_NUM_THREADS": "1"}
        variables["PYTHONDONTWRITEBYTECODE"] = "" if compiled else "1"
        variables["TRAJCLI_TEST_TIER"] = tier
        found = self.folder / CACHE / "v/cache/lastfailed"
        found.unlink(missing_ok=True)
        try:
            code = subprocess.run(
                [*command, *tests],
                check=False,
                capture_output=True,
                timeout=600,
                cwd=self.folder,
                env=os.environ | variables,
            ).returncode
        except subprocess.TimeoutExpired:
            return tests[0]
        gone = code == pytest.ExitCode.USAGE_ERROR and "::" in tests[0]  # a test that has another name now
        if gone or code == pytest.ExitCode.OK:
            return None
        return (
            next(iter(json.loads(found.read_text(encoding="utf-8"))), tests[0])
            if found.exists()
            else tests[0]
        )

    def killer(self, mutant: Planted, tests: Sequence[str], former: str | None) -> str | None:
        """Return the test that kills a mutant, that which killed it before if it does; None if none of its tests does.

        Long tests, and all cases of those that have many, are tried where a mutant passes those of `make test`.
        """
        path = self.folder / mutant.file
        whole = path.read_text(encoding="utf-8")
        path.write_text(whole.replace(mutant.text, mutant.change, 1), encoding="utf-8")
        try:
            if former is not None and (self.folder / former.partition("::")[0]).exists():
                again = self.failing([former], tier="full")
                if again == former:
                    return former
            return self.failing(tests) or self.failing(tests, tier="full")
        finally:
            path.write_text(whole, encoding="utf-8")


def tried(file: str, mutants: Sequence[Planted], benches: SimpleQueue[Bench]) -> list[Planted]:
    """Return the mutants of one file that live, each said in words, after its tests have passed without one."""
    tests, former, bench = subjects()[file], read_killers(), benches.get()
    try:
        if (failed := bench.failing(tests, compiled=True)) is not None:
            print(f"{file}: {failed} fails without a mutant: {len(mutants)} not tried", flush=True)
            return list(mutants)
        killers = {mutant: bench.killer(mutant, tests, former.get(mutant)) for mutant in mutants}
    finally:
        benches.put(bench)
    with ONE_AT_A_TIME:
        write_killers(killers)
    alive = [mutant for mutant, killer in killers.items() if killer is None]
    lines = [f"{file}: survives\n    - {mutant.text}\n    + {mutant.change}" for mutant in alive]
    print("\n".join([*lines, f"{file}: {len(alive)} of {len(mutants)} not killed"]), flush=True)
    return alive


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
    benches: SimpleQueue[Bench] = SimpleQueue()
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(asked.jobs) as pool:
        for number in range(asked.jobs):
            copy_of_the_tree(Path(place) / str(number))
            benches.put(Bench(Path(place) / str(number)))
        wrong = sum(len(one) for one in pool.map(lambda pair: tried(*pair, benches), by_file))
    print(f"{wrong} of {len(chosen)} were not killed")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
