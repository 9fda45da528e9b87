"""Write what the documents take from the code: the reference pages, and the outputs of shown commands.

Run by `make docs`; a test checks that it has been run.
"""

from __future__ import annotations

import sys
from pathlib import Path

from docs.cli_reference import cli_reference
from docs.console import renewed
from docs.job_reference import job_reference
from docs.markdown import ROOT, blocks, documents
from docs.robots_page import robots_page

PAGES = {
    "docs/job-reference.md": job_reference,
    "docs/cli-reference.md": cli_reference,
    "docs/robots.md": robots_page,
}


def shows_commands(document: Path) -> bool:
    """Return whether a document has console blocks."""
    return any(block.language == "console" for block in blocks(document.read_text(encoding="utf-8")))


def main() -> None:
    """Write every page that differs, and name it on standard error."""
    for name, page in PAGES.items():
        _write(ROOT / name, page())
    for document in filter(shows_commands, documents()):
        _write(document, renewed(document.read_text(encoding="utf-8")))


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
        sys.stderr.write(f"{path.relative_to(ROOT)} written\n")


if __name__ == "__main__":
    main()
