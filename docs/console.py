"""The ```console blocks of a document: run as they stand, in the folder that its ```yaml blocks describe.

A line that begins with `$ ` is a command for bash; what follows is its output, standard error included.
A line `...` of the output stands for any number of lines. A command must succeed; one that shall not says
`; echo $?`. Blocks that set up the project itself, with make, git or pip, are not run.

A picture that a command draws and the document shows, from a folder `pictures`, is kept as it was drawn.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from docs.markdown import ROOT, Block, blocks, links
from docs.warm import warm_commands
from trajcli.frozen import frozen

_SET_UP = ("make", "git", "pip")
_PROMPT = "$ "
_ANYTHING = "..."
_SECONDS = 60


@frozen
class Outcome:
    """What the commands of a document make.

    Attributes:
        text: The document with their outputs as they are now.
        pictures: The pictures that it shows, as its commands draw them, by the names of their files.
    """

    text: str
    pictures: dict[str, bytes]


def outcome(document: str) -> Outcome:
    """Run the commands of a document.

    Raises:
        RuntimeError: When a command fails that does not say so.
    """
    result, done = "", 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "examples").symlink_to(ROOT / "examples")
        for block in blocks(document):
            if block.language == "yaml" and block.name:
                (folder / block.name).parent.mkdir(parents=True, exist_ok=True)
                (folder / block.name).write_text(block.text, encoding="utf-8")
            if block.language == "console" and not _sets_up(block):
                result += document[done : block.start] + _renewed_block(block, folder)
                done = block.start + len(block.text)
        pictures = {path.name: path.read_bytes() for path in sorted(folder.glob("*.svg"))}
    kept = {name: content for name, content in pictures.items() if name in shown(document)}
    return Outcome(result + document[done:], kept)


def renewed(document: str) -> str:
    """Return a document with the outputs of its commands as they are now.

    Raises:
        RuntimeError: When a command fails that does not say so.
    """
    return outcome(document).text


def shown(document: str) -> set[str]:
    """Return the names of the pictures that a document shows."""
    paths = [Path(link) for link in links(document)]
    return {path.name for path in paths if path.parent.name == "pictures" and path.suffix == ".svg"}


def commands(block: Block) -> list[tuple[str, str]]:
    """Return the commands of a block with the output that is shown for each."""
    found: list[tuple[str, str]] = []
    for line in block.text.splitlines(keepends=True):
        if line.startswith(_PROMPT):
            found.append((line.removeprefix(_PROMPT).rstrip("\n"), ""))
        elif found:
            found[-1] = (found[-1][0], found[-1][1] + line)
    return found


def run(command: str, folder: Path) -> str:
    """Return what a command prints.

    Raises:
        RuntimeError: When it fails.
    """
    path = os.pathsep.join((str(warm_commands()), str(Path(sys.executable).parent), os.environ["PATH"]))
    done = subprocess.run(  # noqa: S603
        ["bash", "-c", command],  # noqa: S607
        cwd=folder,
        env={**os.environ, "PATH": path, "NO_COLOR": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=_SECONDS,
        check=False,
    )
    text = done.stdout.decode()
    if done.returncode:
        raise RuntimeError(f"$ {command}\n{text}exit {done.returncode}; if that is meant, say `; echo $?`")
    return text


def agrees(shown: str, printed: str) -> bool:
    """Return whether an output is what is shown of it."""
    rest = printed.splitlines()
    free = False
    for part in shown.splitlines():
        if part.strip() == _ANYTHING:
            free = True
            continue
        if part not in rest[: None if free else 1]:
            return False
        rest = rest[rest.index(part) + 1 :]
        free = False
    return free or not rest


def _sets_up(block: Block) -> bool:
    return any(command.startswith(_SET_UP) for command, _ in commands(block))


def _renewed_block(block: Block, folder: Path) -> str:
    text = ""
    for command, shown in commands(block):
        printed = run(command, folder)
        text += f"{_PROMPT}{command}\n{shown if agrees(shown, printed) else printed}"
    return text
