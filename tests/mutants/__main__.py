"""Mutants of code that proves or judges, each against the tests of its file: `make mutants`.

Cosmic Ray makes the mutants and runs the tests; docs/adr says why. This file chooses among its operators, draws a sample,
keeps what was tried in .mutants/ (an interrupted run goes on), and compares survivors with those in survivors.toml.
All runs in a copy of the tree, so that no mutant ever stands in the sources.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import os
import random
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.commands.init import init
from cosmic_ray.mutating import mutate_and_test, mutate_code
from cosmic_ray.testing import run_tests
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome

from tests.mutants.copies import copy_of_the_tree
from tests.mutants.tables import Survivor, operators, read_survivors, subjects, write_score

SESSIONS = Path(".mutants").resolve()
SCORES = Path("tests/mutants/scores.toml").resolve()


@dataclass(frozen=True)
class Mutant:
    """One mutant of a file: its job in the session, and how its first changed line reads before and after."""

    job: str
    mutation: MutationSpec
    line: str
    change: str


def in_annotations(source: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the extents of all annotations, in which a mutant changes nothing that runs."""
    parts: list[ast.expr | None] = []
    for node in ast.walk(ast.parse(source)):
        parts += [getattr(node, "annotation", None), getattr(node, "returns", None)]
    return [
        ((part.lineno, part.col_offset), (part.end_lineno or 0, part.end_col_offset or 0))
        for part in parts
        if part is not None
    ]


def changed_line(source: str, mutation: MutationSpec) -> tuple[str, str]:
    """Return the line that a mutation changes, before and after, without indentation."""
    operator = cosmic_ray.plugins.get_operator(mutation.operator_name)(**mutation.operator_args)
    mutated = mutate_code(source, operator, mutation.occurrence)
    pairs = zip(source.splitlines(), (mutated or source).splitlines(), strict=False)
    before, after = next(((old, new) for old, new in pairs if old != new), ("", ""))
    return before.strip(), after.strip()


def mutants(path: str, session: WorkDB) -> Iterator[Mutant]:
    """Yield the mutants of a file by the operators of the table, in an order that does not depend on the session."""
    source = Path(path).read_text(encoding="utf-8")
    extents, wanted = in_annotations(source), operators()
    items = {item.job_id: item.mutations[0] for item in session.work_items}
    for job, mutation in sorted(items.items(), key=lambda item: (item[1].operator_name, item[1].occurrence)):
        annotated = any(start <= tuple(mutation.start_pos) < end for start, end in extents)
        if mutation.operator_name.removeprefix("core/") in wanted and not annotated:
            yield Mutant(job, mutation, *changed_line(source, mutation))


def opened(path: str) -> Path:
    """Return where the session of a file is kept: with another text of the file, another session begins."""
    digest = hashlib.sha256(Path(path).read_bytes()).hexdigest()[:12]
    return SESSIONS / f"{path.replace('/', '.')}.{digest}.sqlite"


def campaign(path: str, tests: tuple[str, ...], sample: int, seed: int) -> int:
    """Try mutants of one file, write its score, and return the number of survivors without a reason."""
    command = " ".join([sys.executable, "-m", "pytest -x -q -p no:cacheprovider -p no:xdist", *tests])
    began = time.monotonic()
    outcome, output = run_tests(command, 600)
    seconds = time.monotonic() - began
    if outcome is not TestOutcome.SURVIVED:
        sys.exit(f"{path}: its tests fail without a mutant\n{output}")
    place = opened(path)
    fresh = not place.exists()
    with use_db(str(place)) as session:
        if fresh:
            init([Path(path)], session, {})
        every = list(mutants(path, session))
        chosen = random.Random(seed).sample(every, min(sample, len(every))) if sample else every
        before = {item.job_id: result for item, result in session.completed_work_items}
        accepted = [survivor for survivor in read_survivors() if survivor.file == path]
        survived: list[Mutant] = []
        for mutant in chosen:
            known = before.get(mutant.job)
            if known is None or (not known.is_killed and not explained(mutant, accepted)):
                known = mutate_and_test([mutant.mutation], command, 5 * seconds + 10)
                session.set_result(mutant.job, known)
            survived += [] if known.is_killed else [mutant]
    open_ones = [mutant for mutant in survived if not explained(mutant, accepted)]
    score = {
        "mutants": len(every),
        "tried": len(chosen),
        "survived": len(survived),
        "open": len(open_ones),
        "seed": seed,
    }
    write_score(SCORES, path, score)
    print(f"{path}: {len(survived)} of {len(chosen)} survive, tests take {seconds:.0f} s", flush=True)
    for mutant in open_ones:
        print(
            f"  line {mutant.mutation.start_pos[0]}\n    - {mutant.line}\n    + {mutant.change}", flush=True
        )
    return len(open_ones)


def explained(mutant: Mutant, accepted: list[Survivor]) -> bool:
    """Return whether survivors.toml gives a reason for a mutant."""
    return any((survivor.line, survivor.change) == (mutant.line, mutant.change) for survivor in accepted)


def main() -> None:
    """Run the campaign over the files that are asked for."""
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("files", nargs="*", default=["*"], help="patterns of files; all of the table without")
    parser.add_argument("--sample", type=int, default=0, help="how many mutants of each file; 0: all")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    asked = parser.parse_args()
    table = subjects()
    chosen = [path for path in table if any(fnmatch(path, pattern) for pattern in asked.files or ["*"])]
    if not chosen:
        sys.exit(f"no file of tests/mutants/subjects.toml is one of {' '.join(asked.files)}")
    SESSIONS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        copy_of_the_tree(Path(folder))
        os.environ |= {"PYTHONPATH": folder, "OPENBLAS_NUM_THREADS": "1"}
        os.chdir(folder)
        left = sum(campaign(path, table[path], asked.sample, asked.seed) for path in chosen)
    sys.exit(f"{left} survivors without a reason in tests/mutants/survivors.toml" if left else 0)


if __name__ == "__main__":
    main()
