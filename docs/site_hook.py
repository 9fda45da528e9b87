"""The documents as pages of a site: those of the root and the examples among them, links that work there.

mkdocs calls the functions without an underscore. The documents are written for the repository: links lead to
files, README, CHANGELOG and CONTRIBUTING stand in the root, and a fenced block names the file it stands for.
"""

from __future__ import annotations

import posixpath
import re
import tomllib
from pathlib import Path
from typing import Any

from docs.markdown import ROOT

FROM_ROOT = {
    "README.md": "index.md",
    "CHANGELOG.md": "changes.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
}
"""Documents of the root, and the pages that they become."""

_LANDING = """\
<div class="hero">
<a class="md-button md-button--primary" href="tutorial.html">Ten minutes with trajcli</a>
<a class="md-button" href="gallery.html">Gallery</a>
<a class="md-button" href="planners.html">Which planner?</a>
<a class="md-button" href="job-reference.html">Job reference</a>
</div>
"""
_HEADING, _PICTURE = (
    re.compile(r"\A# .+\n"),
    re.compile(r"^!\[.*\]\(docs/pictures/player\.png\)$", re.MULTILINE),
)
_BOOSTS = {
    **dict.fromkeys(("adr/", "changes.md"), 1e-4),
    **dict.fromkeys(("architecture.md", "benchmarks.md", "contributing.md", "security.md"), 0.3),
    **dict.fromkeys(("cli-reference.md", "examples/", "reference/"), 0.8),
}
_BOOST = 2.0  # of guides: a word in a title counts a thousand times, and decisions come after all guides

_FENCED = re.compile(r"(^ *```.*?^ *```$)", re.MULTILINE | re.DOTALL)
_FENCE = re.compile(r"\A( *```\w+) (\S+)$", re.MULTILINE)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^)\s]+)\)")
_ITEM = r"(?:[*-]|\d+\.) "
_TEXT_AND_ITEM = re.compile(rf"^(?!{_ITEM})(\S.*)\n(?={_ITEM})", re.MULTILINE)
_BELOW_NUMBER = re.compile(r"^ {3}(?=\S)", re.MULTILINE)


def on_config(config: Any) -> Any:  # noqa: ANN401
    """Take the address of the repository from pyproject.toml; example.org stands for none."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    address = project["tool"]["hatch"]["metadata"]["hooks"]["custom"]["address"]
    config.repo_url = None if "://example.org/" in address else address
    return config


def on_files(files: Any, config: Any) -> Any:  # noqa: ANN401
    """Add the documents of the root and the examples to the files of the site.

    Under `extra: {examples: [...]}` a configuration may name some examples: the others are left out.
    """
    from mkdocs.structure.files import File

    from docs.gallery import EXAMPLES, LIVE, example_page, examples, gallery_page

    made: dict[str, str | bytes] = {
        page: (ROOT / name).read_text(encoding="utf-8") for name, page in FROM_ROOT.items()
    }
    shown = examples(config.extra.get("examples"))
    made["gallery.md"] = gallery_page(shown)
    for example in shown:
        made[f"examples/{example.name}.md"] = example_page(example)
        made[f"players/{example.name}.html"] = example.player
    if not any(example.name == LIVE for example in shown):
        made[f"players/{LIVE}.html"] = examples([LIVE])[0].player
    for path in filter(Path.is_file, EXAMPLES.rglob("*")):
        made[f"examples/{path.relative_to(EXAMPLES).as_posix()}"] = path.read_bytes()
    for name, content in made.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ANN401
    """Return a page as mkdocs understands it, with its weight in searches."""
    name = page.file.src_uri
    weight = next((value for start, value in _BOOSTS.items() if name.startswith(start)), _BOOST)
    page.meta.setdefault("search", {"boost": weight})
    if name == "gallery.md" or name.startswith("examples/"):
        page.meta["hide"] = ["navigation", "toc"]
    if name == "index.md":
        page.meta["hide"] = ["navigation", "toc"]
        markdown = landing(markdown)
    pages = {file.src_uri for file in files if file.inclusion.is_included()}
    return for_site(markdown, page.file.src_uri, config.repo_url, pages)


def landing(readme: str) -> str:
    """Return the first page: README with ways to go on, and the live player in the place of its picture."""
    from docs.gallery import LIVE, player_frame

    player = player_frame(f"players/{LIVE}.html", LIVE)
    return _PICTURE.sub(player, _HEADING.sub(lambda heading: f"{heading[0]}\n{_LANDING}", readme, count=1))


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
    if target.startswith("examples/"):
        of_example = f"{target.removesuffix('.yaml')}.md"
        place = of_example if of_example in pages else target
    inside = sorted(name for name in pages if place and name.startswith(f"{place}/"))
    if place in pages or inside:
        place = place if place in pages else inside[0]
        return f"{mark}[{text}]({posixpath.relpath(place, posixpath.dirname(page) or '.')}{hash_}{anchor})"
    if repository:
        return f"{mark}[{text}]({repository.rstrip('/')}/blob/HEAD/{target}{hash_}{anchor})"
    return text
