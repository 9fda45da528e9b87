"""The job reference in pages: its sections, each on the page of its subject, with links between them."""

from __future__ import annotations

import posixpath
import re
from functools import cache

from docs.job_reference import job_reference

_FIRST = "docs/job-reference.md"
REFERENCE = {
    _FIRST: ("Job", "Units", "Values by joint"),
    "docs/reference/states.md": ("States",),
    "docs/reference/limits.md": ("Limits",),
    "docs/reference/robot.md": ("Robot",),
    "docs/reference/moves.md": ("Moves",),
    "docs/reference/tool-paths.md": ("Along a path of the tool",),
    "docs/reference/planners.md": ("Planners",),
    "docs/reference/output.md": ("Output",),
}
"""The pages, and the sections that stand on each."""

_ABOUT = {
    "States": "joints and poses, relative points, branches, points on a path",
    "Limits": "of joints, of efforts, of the tool; those of a MoveIt package",
    "Robot": "joints, geometry, dynamics, poses",
    "Moves": "what every move has; approach and retreat, payload, tool, signals",
    "Along a path of the tool": "law, tolerance, segments, weave, arcs",
    "Planners": "the fields of each",
    "Output": "rows, columns and their units",
}
_SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
_HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)
_INSIDE = re.compile(r"\]\(#([\w-]+)\)")
_BESIDE = re.compile(r"\]\((?!#|[a-z]+:)([^)\s]+)\)")
_FENCED = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)


def reference_page(page: str) -> str:
    """Return a page of the reference.

    Args:
        page: Its path in the repository, of `REFERENCE`.
    """
    sections = _sections()
    if page == _FIRST:
        own = [f"## {name}\n\n{sections[name].strip()}" for name in REFERENCE[page]]
        return linked("\n\n".join([sections[""], _contents(), *own]) + "\n", page)
    (name,) = REFERENCE[page]
    text = f"# {name}\n\n{sections[name].strip()}\n"
    raised = "".join(
        part if number % 2 else re.sub("^##(#+ )", r"#\1", part, flags=re.MULTILINE)
        for number, part in enumerate(_FENCED.split(text))
    )
    beside = _BESIDE.sub(
        lambda link: f"]({posixpath.relpath(f'docs/{link[1]}', posixpath.dirname(page))})", raised
    )
    return linked(beside, page)


def linked(text: str, page: str) -> str:
    """Return a text of the reference whose links to sections lead from a page of the repository."""
    return _INSIDE.sub(lambda link: f"]({reference_link(link[1], page)})", text)


def reference_link(anchor: str, page: str) -> str:
    """Return the link to a section of the reference from a page of the repository."""
    place = _places()[anchor]
    return f"#{anchor}" if place == page else f"{posixpath.relpath(place, posixpath.dirname(page))}#{anchor}"


def _contents() -> str:
    places = {section: page for page, names in REFERENCE.items() for section in names}
    lines = [
        f"* [{name}]({posixpath.relpath(places[name], 'docs')}): {about}" for name, about in _ABOUT.items()
    ]
    return "\n".join(["Beside what stands on this page:", *lines])


@cache
def _sections() -> dict[str, str]:
    """Return what stands before the first section, under no name, and below the heading of each."""
    parts = _SECTION.split(job_reference())
    return {"": parts[0].rstrip(), **{k: v.rstrip() for k, v in zip(parts[1::2], parts[2::2], strict=True)}}


@cache
def _places() -> dict[str, str]:
    """Return the page of each heading's anchor."""
    pages = {section: page for page, names in REFERENCE.items() for section in names}
    found: dict[str, str] = {}
    for section, page in pages.items():
        text = f"## {section}\n{_sections()[section]}"
        outside = "".join(_FENCED.split(text)[::2])
        for _, heading in _HEADING.findall(outside):
            found[re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")] = page
    return found
