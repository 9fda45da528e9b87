"""Write what the documents take from the code: reference pages, outputs of shown commands, and pictures.

Run by `make docs`; a test checks that it has been run.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

from docs.cli_reference import cli_reference
from docs.console import outcome
from docs.markdown import ROOT, blocks, documents
from docs.planner_pages import planner_page, planner_table
from docs.reference_pages import REFERENCE, reference_page
from docs.robots_page import index_text, robots_page
from docs.svg_comparison import is_current
from trajcli.planners import PLANNERS
from trajcli.queries.catalogue_list import INDEX

PAGES = {
    **{page: partial(reference_page, page) for page in REFERENCE},
    "docs/cli-reference.md": cli_reference,
    "docs/planners.md": planner_table,
    "docs/robots.md": robots_page,
    **{f"docs/planners/{name}.md": partial(planner_page, name) for name in PLANNERS},
}
PICTURES = ROOT / "docs/pictures"


def shows_commands(document: Path) -> bool:
    """Return whether a document has console blocks."""
    return any(block.language == "console" for block in blocks(document.read_text(encoding="utf-8")))


def main() -> None:
    """Write every page that differs, and the index of the catalogue; name them on standard error."""
    _write(INDEX, index_text())
    for name, page in PAGES.items():
        _write(ROOT / name, page())
    for document in filter(shows_commands, documents()):
        made = outcome(document.read_text(encoding="utf-8"))
        _write(document, made.text)
        for picture, content in made.pictures.items():
            if not is_current(PICTURES / picture, content):
                _write(PICTURES / picture, content.decode())


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
        sys.stderr.write(f"{path.relative_to(ROOT)} written\n")


if __name__ == "__main__":
    main()
