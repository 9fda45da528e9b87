"""Mutants that somebody wrote, each against the tests of its file: `make planted`.

Cosmic Ray changes one number or sign; these leave out a term, look at the first of two ends only, at one direction, at one
block, or make a warning of an error. Each was killed when it was written down in planted.toml; one that survives is a test
that was lost. All runs in a copy of the tree.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from fnmatch import fnmatch
from pathlib import Path

from tests.mutants.copies import copy_of_the_tree
from tests.mutants.tables import Planted, read_planted, subjects


def survives(mutant: Planted, tests: tuple[str, ...]) -> bool | None:
    """Return whether the tests of a file pass with a mutant; None where its text is no longer in the file."""
    path = Path(mutant.file)
    whole = path.read_text(encoding="utf-8")
    if mutant.text not in whole:
        return None
    path.write_text(whole.replace(mutant.text, mutant.change, 1), encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
    try:
        return subprocess.run(command, check=False, capture_output=True, timeout=600).returncode == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        path.write_text(whole, encoding="utf-8")


def main(patterns: list[str]) -> None:
    """Try the mutants of the files that are asked for, all of them without a pattern."""
    table, found = subjects(), [0, 0]
    with tempfile.TemporaryDirectory() as folder:
        copy_of_the_tree(Path(folder))
        os.environ |= {"PYTHONPATH": folder, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        os.chdir(folder)
        for mutant in read_planted():
            if any(fnmatch(mutant.file, pattern) for pattern in patterns or ["*"]):
                outcome = survives(mutant, table[mutant.file])
                found[0] += 1
                if outcome is not False:
                    found[1] += 1
                    what = "is not in the file any more" if outcome is None else "survives"
                    print(f"{mutant.file}: {what}\n    - {mutant.text}\n    + {mutant.change}", flush=True)
    print(f"{found[1]} of {found[0]} were not killed")
    sys.exit(1 if found[1] else 0)


if __name__ == "__main__":
    main(sys.argv[1:])
