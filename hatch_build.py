"""Build of the package: links of its one address, README.md as an index shows it, a small wheel.

Hatchling calls the classes; the address is one line of pyproject.toml.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
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


class SmallWheel(BuildHookInterface):
    """Packs the wheel with Zopfli, which any reader of zip files opens and which is 3 % smaller."""

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Pack what was built; an editable wheel is left as it is."""
        if version != "editable":
            pack(Path(artifact_path))


def pack(wheel: Path) -> None:
    """Compress each file of a wheel anew, its content and its order as they are."""
    from zopfli.zlib import compress

    with ZipFile(wheel) as built:
        files = [(info, built.read(info)) for info in built.infolist()]
    with wheel.open("wb") as out, ZipFile(out, "w") as packed:
        for info, content in files:
            data = compress(content, numiterations=45)[2:-4]  # without the head and the sum of zlib
            info.header_offset, info.flag_bits = out.tell(), 0
            info.compress_type, info.compress_size = ZIP_DEFLATED, len(data)
            out.write(info.FileHeader() + data)
            packed.filelist.append(info)
        packed.start_dir, packed.comment = out.tell(), b""  # a comment, though empty, makes it write its list


def description(readme: str, address: str) -> str:
    """Return a document of the root with absolute links to the files and pictures of the repository."""

    def absolute(link: re.Match[str]) -> str:
        mark, text, path, anchor = link.groups()
        inner = _LINK.sub(absolute, text)  # a picture that is a link
        return f"{mark}[{inner}]({address}/{'raw' if mark else 'blob'}/HEAD/{path}{anchor or ''})"

    parts = _FENCED.split(readme)
    return "".join(part if number % 2 else _LINK.sub(absolute, part) for number, part in enumerate(parts))
