"""Copies of the tree, so that no mutant ever stands in the sources."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path


def copy_of_the_tree(target: Path) -> None:
    """Copy the files of the repository, those not yet added included."""
    listing = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        check=True,
        capture_output=True,
    )
    for name in filter(None, listing.stdout.decode().split("\0")):
        if Path(name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(name, target / name)
