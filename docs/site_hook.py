"""The documents as pages of a site: those of the root among them, links that work there, titles of code.

mkdocs calls the functions without an underscore. The documents are written for the repository: links lead to
files, README, CHANGELOG and CONTRIBUTING stand in the root, and a fenced block names the file it stands for.
"""

from __future__ import annotations

import posixpath
import re
import tomllib
from pathlib import Path
from typing import Any

FROM_ROOT = {
    "README.md": "index.md",
    "CHANGELOG.md": "changes.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
}
"""Documents of the root, and the pages that they become."""

_FENCED = re.compile(r"(^ *```.*?^ *```$)", re.MULTILINE | re.DOTALL)
_FENCE = re.compile(r"\A( *```\w+) (\S+)$", re.MULTILINE)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^)\s]+)\)")
_ITEM = r"(?:[*-]|\d+\.) "
_TEXT_AND_ITEM = re.compile(rf"^(?!{_ITEM})(\S.*)\n(?={_ITEM})", re.MULTILINE)
_BELOW_NUMBER = re.compile(r"^ {3}(?=\S)", re.MULTILINE)


def on_config(config: Any) -> Any:  # noqa: ANN401
    """Take the address of the repository from pyproject.toml; example.org stands for none."""
    project = tomllib.loads((Path(config.config_file_path).parent / "pyproject.toml").read_text("utf-8"))
    address = project["tool"]["hatch"]["metadata"]["hooks"]["custom"]["address"]
    config.repo_url = None if "://example.org/" in address else address
    return config


def on_files(files: Any, config: Any) -> Any:  # noqa: ANN401
    """Add the documents of the root to the files of the site."""
    from mkdocs.structure.files import File

    root = Path(config.config_file_path).parent
    for name, page in FROM_ROOT.items():
        files.append(File.generated(config, page, content=(root / name).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ANN401
    """Return a page as mkdocs understands it."""
    pages = {file.src_uri for file in files if file.inclusion.is_included()}
    return for_site(markdown, page.file.src_uri, config.repo_url, pages)


def for_site(markdown: str, page: str, repository: str | None, pages: set[str]) -> str:
    """Return a document with its links, lists and code blocks as the site needs them.

    Args:
        markdown: As it stands in the repository.
        page: Its path among the pages of the site.
        repository: Its address: links to files that are no pages lead there, or else become their text.
        pages: Paths of all pages and pictures of the site.
    """
    parts = _FENCED.split(markdown)
    for number, part in enumerate(parts):
        if number % 2:
            parts[number] = _FENCE.sub(r'\1 title="\2"', part)
        else:
            listed = _BELOW_NUMBER.sub("    ", _TEXT_AND_ITEM.sub(r"\1\n\n", part))
            parts[number] = _LINK.sub(lambda link: _link(link, page, repository, pages), listed)
    return "".join(parts)


def _link(link: re.Match[str], page: str, repository: str | None, pages: set[str]) -> str:
    """Return a link as it leads from a page of the site, or its text where it leads nowhere."""
    mark, text, address = link.groups()
    path, hash_, anchor = address.partition("#")
    if "://" in address or address.startswith("mailto:") or not path:
        return link[0]
    source = {page: name for name, page in FROM_ROOT.items()}.get(page, f"docs/{page}")
    target = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
    place = FROM_ROOT.get(target, target.removeprefix("docs/") if target.startswith("docs/") else "")
    inside = sorted(name for name in pages if place and name.startswith(f"{place}/"))
    if place in pages or inside:
        place = place if place in pages else inside[0]
        return f"{mark}[{text}]({posixpath.relpath(place, posixpath.dirname(page) or '.')}{hash_}{anchor})"
    if repository:
        return f"{mark}[{text}]({repository.rstrip('/')}/blob/HEAD/{target}{hash_}{anchor})"
    return text
