"""Markdown as the documents use it: tables, fenced blocks, links."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent

_FENCE = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block of a document.

    Attributes:
        language: The first word behind the fence, such as "yaml".
        name: The second word, the file that the block stands for; None without one.
        text: What stands between the fences.
        start: Where the text starts in the document.
    """

    language: str
    name: str | None
    text: str
    start: int


def documents() -> list[Path]:
    """Return every Markdown file of the project, in order of their paths."""
    return sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


def blocks(document: str) -> list[Block]:
    """Return the fenced blocks of a document, in order."""
    return [Block(m[1], m[2], m[3], m.start(3)) for m in _FENCE.finditer(document)]


def links(document: str) -> list[str]:
    """Return the targets of a document's links."""
    return _LINK.findall(_FENCE.sub("", document))


def anchors(document: str) -> set[str]:
    """Return what a link may point to inside a document, as GitHub names its headings."""
    headings = _HEADING.findall(_FENCE.sub("", document))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; bars inside a cell are escaped."""
    lines = [[cell.replace("|", r"\|") for cell in line] for line in (head, ["---"] * len(head), *rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def first_sentence(docstring: str | None) -> str:
    """Return the first paragraph of a docstring in one line."""
    return " ".join((docstring or "").strip().split("\n\n")[0].split())
