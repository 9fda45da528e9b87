"""The pictures of the documents: those that the commands of a document write.

A console block with `-o NAME.svg` makes `docs/pictures/NAME.svg`.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from docs.console import commands, run
from docs.markdown import ROOT, blocks

FOLDER = ROOT / "docs" / "pictures"
PAGE = ROOT / "docs" / "plots.md"

_WORDS = re.compile(r"<text[^>]*>([^<]*)</text>|id=\"([^\"]*)\"")


def pictures(document: str) -> dict[str, str]:
    """Return the pictures that the commands of a document write, by their names."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "examples").symlink_to(ROOT / "examples")
        for block in blocks(document):
            if block.language == "console":
                for command, _ in commands(block):
                    run(command, folder)
        return {path.name: path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.svg"))}


def words_of(svg: str) -> list[tuple[str, str]]:
    """Return the texts and identifiers of a picture, which are the same with every version of matplotlib.

    The identifiers that it makes from the content, of clipping paths and markers, are left out.
    """
    return [
        (text, name) for text, name in _WORDS.findall(svg) if not re.fullmatch(r"[a-z]+_?[0-9a-f]{8,}", name)
    ]
