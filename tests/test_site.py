"""The documents as a site: every page is there, works from a folder, and a dead link fails the build."""

from __future__ import annotations

import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from docs.gallery import EXAMPLES
from docs.markdown import ROOT, documents
from docs.player_picture import wait_until
from docs.site_hook import FROM_ROOT, for_site
from tests.extras import require_module
from tests.player.conftest import chromium  # noqa: F401
from tests.tiers import QUICK

SHOWN = ["cubic", "ur5e_pick"] if QUICK else sorted(path.stem for path in EXAMPLES.glob("*.yaml"))
PAGES = {"index.md", "contributing.md", "tutorial.md", "planners/cubic.md", "adr/0001-a.md", "adr/0002-b.md"}
PAGES |= {"examples/c.md", "examples/robots/d.yaml"}
INSIDE = ("file:", "data:", "blob:")
RESULTS = "[data-md-component=search-result] li > a"
REPOSITORY = "https://example.org/trajcli/"


@pytest.mark.parametrize(
    ("page", "written", "alone", "published"),
    [
        ("index.md", "[a](docs/tutorial.md)", "[a](tutorial.md)", None),
        ("index.md", "![a b](docs/planners/cubic.md)", "![a b](planners/cubic.md)", None),
        ("index.md", "[a](docs/adr/)", "[a](adr/0001-a.md)", None),
        ("index.md", "[`a`](CONTRIBUTING.md#set-up)", "[`a`](contributing.md#set-up)", None),
        ("tutorial.md", "[a](../README.md)", "[a](index.md)", None),
        ("tutorial.md", "[a](#limits) [b](https://x.org/y.md)", "[a](#limits) [b](https://x.org/y.md)", None),
        ("planners/cubic.md", "[a](../tutorial.md#b)", "[a](../tutorial.md#b)", None),
        ("planners/cubic.md", "[a](../../README.md)", "[a](../index.md)", None),
        (
            "planners/cubic.md",
            "[a](nothing.md)",
            "a",
            "[a](https://example.org/trajcli/blob/HEAD/docs/planners/nothing.md)",
        ),
        (
            "tutorial.md",
            "[a](../schemas/b.json)",
            "a",
            "[a](https://example.org/trajcli/blob/HEAD/schemas/b.json)",
        ),
        (
            "index.md",
            "a [b [c]](LICENSE) d",
            "a b [c] d",
            "a [b [c]](https://example.org/trajcli/blob/HEAD/LICENSE) d",
        ),
        ("planners/cubic.md", "[a](../../examples/c.yaml)", "[a](../examples/c.md)", None),
        ("tutorial.md", "[a](../examples/robots/d.yaml)", "[a](examples/robots/d.yaml)", None),
        ("index.md", "```yaml a.yaml\nb\n```", '```yaml title="a.yaml"\nb\n```', None),
        ("index.md", "```yaml\n[a](LICENSE)\n```", "```yaml\n[a](LICENSE)\n```", None),
        ("index.md", "a\n* b\n* c\n", "a\n\n* b\n* c\n", None),
        ("index.md", "1. a\n   b\n", "1. a\n    b\n", None),
    ],
)
def test_documents_of_the_repository_fit_the_site(
    page: str, written: str, alone: str, published: str | None
) -> None:
    assert for_site(written, page, None, PAGES) == alone
    assert for_site(written, page, REPOSITORY, PAGES) == (published or alone)


def build(config: Path, site: Path) -> subprocess.CompletedProcess[str]:
    require_module("mkdocs")
    require_module("material")
    return subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--config-file", config, "--site-dir", site],
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


class Page(HTMLParser):
    """What a page of the site links to, and what can be linked to in it."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()
        self.text = ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value for name, value in attrs if value}
        self.links += [values[name] for name in ("href", "src") if name in values]
        if tag != "a":
            self.loaded += [values[name] for name in ("href", "src") if name in values]
        self.anchors |= {values[name] for name in ("id", "name") if name in values}

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> dict[Path, Page]:
    folder = tmp_path_factory.mktemp("site")
    config = folder.parent / "mkdocs.yml"
    names = ", ".join(SHOWN)
    config.write_text(
        f"INHERIT: {ROOT}/mkdocs.yml\ndocs_dir: {ROOT}/docs\nhooks: [{ROOT}/docs/site_hook.py]\n"
        f"extra: {{examples: [{names}]}}\n"
    )
    done = build(config, folder)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return {path: Page(path) for path in folder.rglob("*.html") if path.name != "404.html"}


def root_of(site: dict[Path, Page]) -> Path:
    return next(path.parent for path in site if path.name == "gallery.html")


def test_every_document_is_a_page(site: dict[Path, Page]) -> None:
    root = root_of(site)
    names = {
        FROM_ROOT.get(name, name.removeprefix("docs/"))
        for name in (p.relative_to(ROOT).as_posix() for p in documents())
    }
    made = {f"{folder}/{name}.html" for folder in ("examples", "players") for name in SHOWN}
    assert {path.relative_to(root).as_posix() for path in site} == {
        *(f"{name.removesuffix('.md')}.html" for name in names),
        *{"gallery.html", "players/ur5e_pick.html"},
        *made,
    }
    nav = site[root / "index.html"].links
    assert {name.removesuffix(".md") + ".html" for name in names} <= set(nav)


def test_links_of_the_site_lead_somewhere(site: dict[Path, Page]) -> None:
    dead = []
    for path, page in site.items():
        for link in page.links:
            file, _, anchor = unquote(link).partition("#")
            if "://" in file or file.startswith(("mailto:", "data:")):
                continue
            target = (path.parent / file).resolve() if file else path
            known = target.exists() and (not anchor or target not in site or anchor in site[target].anchors)
            dead += [] if known else [(path.name, link)]
    assert dead == []


def test_the_site_loads_nothing_from_elsewhere(site: dict[Path, Page]) -> None:
    assert {link for page in site.values() for link in page.loaded if "://" in link} == set()


def test_pages_are_read_as_they_are_meant(site: dict[Path, Page]) -> None:
    for path, page in site.items():
        assert "](" not in page.text, path  # links were understood as such
        assert "```" not in page.text, path


def test_pages_say_nothing_of_how_they_are_made(site: dict[Path, Page]) -> None:
    for path, page in site.items():
        assert "generated by" not in page.text.lower(), path
        assert "the lecture " not in page.text.lower().replace("the lecture notes", ""), path


def test_the_gallery_has_a_drawing_of_every_example(site: dict[Path, Page]) -> None:
    gallery = root_of(site) / "gallery.html"
    cards = [link for link in site[gallery].links if link.startswith("examples/")]
    assert sorted(cards) == [f"examples/{name}.html" for name in SHOWN]
    assert gallery.read_text(encoding="utf-8").count('<svg class="still"') == len(SHOWN)


def opened(started: Any, path: Path, said: list[str]) -> Any:
    """Return a page of the site, opened from its folder; what it asks for elsewhere, and what it says, goes to a list."""
    page = started.new_page(viewport={"width": 1200, "height": 800}, offline=True)
    page.on("console", lambda message: said.append(f"{path.name}: {message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"{path.name}: {error}"))
    page.on("request", lambda request: said.extend([] if request.url.startswith(INSIDE) else [request.url]))
    page.goto(path.as_uri())
    return page


@pytest.mark.skipif(QUICK, reason="a browser opens each page: in `make check`")
def test_pages_open_from_a_folder_without_a_word_or_a_request(site: dict[Path, Page], chromium: Any) -> None:  # noqa: F811
    said: list[str] = []
    for path in sorted(path for path in site if path.parent.name != "players"):  # those are in other pages
        page = opened(chromium, path, said)
        page.wait_for_timeout(50)
        for frame in (frame for frame in page.frames if "/players/" in frame.url):
            wait_until(frame, "window.trajcli?.ready")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"{path} is wider than it"
        page.close()
    assert said == []


@pytest.mark.skipif(QUICK, reason="a browser searches: in `make check`")
def test_searches_work_from_a_folder_and_find_guides_before_decisions(
    site: dict[Path, Page],
    chromium: Any,  # noqa: F811
) -> None:
    said: list[str] = []
    root = root_of(site).as_uri() + "/"
    for words, first in (("zone", "zones.html"), ("payload", "torque-limits.html")):
        page = opened(chromium, root_of(site) / "changes.html", said)
        page.click("[data-md-component=search-query]")
        page.keyboard.type(words)
        wait_until(page, f"document.querySelectorAll({RESULTS!r}).length > 3")
        found = page.evaluate(f"[...document.querySelectorAll({RESULTS!r})].map((link) => link.href)")
        page.close()
        pages = [address.partition("?")[0].removeprefix(root) for address in found]
        assert pages[0] == first
        assert not any(name.startswith("adr/") for name in pages[:4])
    assert said == []


def test_a_dead_link_and_a_page_without_a_line_in_nav_fail_the_build(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.md").write_text("# a\n[b](nothing.md) [c](#nowhere)\n")
    (tmp_path / "docs/forgotten.md").write_text("# d\n")
    config = f"INHERIT: {ROOT}/mkdocs.yml\nhooks: []\nnav:\n  - index.md\n"
    (tmp_path / "mkdocs.yml").write_text(config)
    done = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert done.returncode != 0
    for word in ("nothing.md", "#nowhere", "forgotten.md"):
        assert word in done.stderr
