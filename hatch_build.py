"""Package metadata made of the address of the project: its links, and README.md as an index shows it.

Hatchling calls the class; the address is one line of pyproject.toml.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\((?!\w+:|#)([^)\s#]*)(#[^)\s]*)?\)")
_FENCED = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


class AddressHook(MetadataHookInterface):
    """Fills `urls` and `readme` in."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the links of the project, and its description with links that work anywhere."""
        address, root = self.config["address"].rstrip("/"), Path(self.root)
        metadata["urls"] = {
            "Homepage": address,
            "Documentation": f"{address}/blob/HEAD/docs/tutorial.md",
            "Changelog": f"{address}/blob/HEAD/CHANGELOG.md",
            "Issues": f"{address}/issues",
        }
        text = description((root / "README.md").read_text(encoding="utf-8"), address)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


def description(readme: str, address: str) -> str:
    """Return a document of the root with absolute links to the files and pictures of the repository."""

    def absolute(link: re.Match[str]) -> str:
        mark, text, path, anchor = link.groups()
        inner = _LINK.sub(absolute, text)  # a picture that is a link
        return f"{mark}[{inner}]({address}/{'raw' if mark else 'blob'}/HEAD/{path}{anchor or ''})"

    parts = _FENCED.split(readme)
    return "".join(part if number % 2 else _LINK.sub(absolute, part) for number, part in enumerate(parts))
