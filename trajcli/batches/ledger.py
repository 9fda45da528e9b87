"""Ledger of a folder of outputs: the content that each was made of, for unchanged jobs not to be planned.

It only saves work: an entry counts where the inputs and the output itself still have the content it says.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from trajcli.errors import FileError
from trajcli.frozen import comparable
from trajcli.streams.whole_file import whole_file
from trajcli.version import __version__

LEDGER_NAME = ".trajcli-batch.json"
_LAYOUT = 1
_BLOCK = 1 << 20  # bytes


@comparable
class LedgerEntry:
    """What an output was made of.

    Attributes:
        inputs: Hash of job, files that it names, version and format.
        files: The paths of the files that the job names, from its folder.
        output: Hash of the file that was written.
        duration: Of the trajectory, s.
    """

    inputs: str
    files: tuple[str, ...]
    output: str
    duration: float


def hash_of_inputs(name: str, job: bytes, files: Sequence[str], form: str) -> str | None:
    """Return the SHA-256 of all that rows depend on; None where a file cannot be read.

    Args:
        name: The file name of the job, which may be the job's name in the rows.
        job: Its content.
        files: The paths of the files that it names.
        form: The format of the rows.
    """
    digest = hashlib.sha256()
    for part in (__version__, form, name):
        _add(digest, part.encode("utf-8", "surrogateescape"))
    _add(digest, job)
    for path in files:
        try:
            _add(digest, Path(path).read_bytes())
        except (OSError, ValueError):
            return None
    return digest.hexdigest()


def _add(digest: Any, part: bytes) -> None:  # noqa: ANN401
    """Add a part with its length, so that two parts are never taken for others that read the same."""
    digest.update(len(part).to_bytes(8, "big"))
    digest.update(part)


def hash_of_file(path: str) -> str | None:
    """Return the SHA-256 of a file; None where it cannot be read."""
    digest = hashlib.sha256()
    try:
        with Path(path).open("rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
    except OSError:
        return None
    return digest.hexdigest()


def read_ledger(path: Path) -> dict[str, LedgerEntry]:
    """Return the entries of a ledger by the names of outputs; none where it is absent or is none."""
    try:
        content = json.loads(path.read_bytes())
        if content["layout"] != _LAYOUT:
            return {}
        return {
            str(name): LedgerEntry(
                str(entry["inputs"]),
                tuple(map(str, entry["files"])),
                str(entry["output"]),
                float(entry["duration"]),
            )
            for name, entry in content["outputs"].items()
        }
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}


def write_ledger(path: Path, entries: Mapping[str, LedgerEntry]) -> None:
    """Write entries over those of the same outputs; a ledger that cannot be written saves no work."""
    if not entries:
        return
    every = {**read_ledger(path), **entries}
    outputs = {name: {**vars(entry), "files": list(entry.files)} for name, entry in sorted(every.items())}
    text = json.dumps({"layout": _LAYOUT, "outputs": outputs}, indent=0)
    try:
        with whole_file(path) as out:
            out.write(text.encode())
    except FileError:
        return
