"""Copies of the tree, so that no mutant ever stands in the sources."""

from __future__ import annotations

import compileall
import py_compile
import shutil
import subprocess
from pathlib import Path


def copy_of_the_tree(target: Path) -> None:
    """Copy the files of the repository, those not yet added included, and compile them.

    What is compiled is compared by a digest of its source: a mutant that is written within the second of another, and is as
    long, has the same stamp.
    """
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        check=True,
        capture_output=True,
    )
    for name in filter(None, listing.stdout.decode().split("\0")):
        if Path(name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(name, target / name)
    for folder in ("trajcli", "tests"):
        compileall.compile_dir(
            target / folder, quiet=2, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH
        )
