"""Pages of made-up scenes: the data come out as they went in, names stay texts, and other names of files are refused."""

from __future__ import annotations

import gzip
import json
from base64 import b64decode
from typing import Any

import pytest
from player.test_page import Elements

from trajcli.errors import InputError
from trajcli.player.page import BUNDLE, check_page_name, page_of

SCENE: dict[str, Any] = {
    "made_by": 'trajcli "0" & <more>',
    "title": "é 中 </title><b>&amp;",
    "moves": [{"name": "<!-- <script>"}, {"t": [0.5, -1e-9, 1e300]}],
}


@pytest.mark.parametrize("compress", [False, True])
def test_a_scene_comes_out_as_it_went_in(compress: bool) -> None:
    page = page_of(SCENE, compress=compress)
    elements = Elements(page.decode())
    found = {given["id"]: text for given, text in elements.of("script") if "id" in given}
    assert found.keys() == ({"packed-scene", "packed-player"} if compress else {"scene"})
    text = gzip.decompress(b64decode(found["packed-scene"])).decode() if compress else found["scene"]
    assert json.loads(text) == SCENE
    assert "<" not in text
    assert "é 中" in text  # as itself: an escape is three times as long
    types = {given.get("type") for given, _ in elements.of("script") if "id" in given}
    assert types == {"text/plain" if compress else "application/json"}
    runs = [text for given, text in elements.of("script") if "id" not in given]
    assert len(runs) == 1
    assert runs[0]


def test_names_are_texts_of_the_page_and_nothing_else() -> None:
    elements = Elements(page_of(SCENE).decode())
    assert elements.of("title")[0][1] == SCENE["title"]
    (generator,) = (given["content"] for given, _ in elements.of("meta") if given.get("name") == "generator")
    assert generator == SCENE["made_by"]
    assert not elements.of("b")


def test_nothing_is_asked_of_anybody() -> None:
    elements = Elements(page_of(SCENE).decode())
    directives = dict(part.strip().split(" ", 1) for part in elements.policy.split(";"))
    assert {directives.pop("script-src")[:8], directives.pop("style-src")[:8]} == {"'sha256-"}
    assert directives == {
        "default-src": "'none'",
        "img-src": "data:",
        "base-uri": "'none'",
        "form-action": "'none'",
    }


def test_the_licences_stand_in_the_page_and_the_same_scene_has_the_same_bytes() -> None:
    licences = (BUNDLE / "LICENSES").read_text(encoding="utf-8").strip()
    for compress in (False, True):
        page = page_of(SCENE, compress=compress)
        assert licences in page.decode()
        assert page == page_of(dict(SCENE), compress=compress)
        assert gzip_times(page) <= {0}


def gzip_times(page: bytes) -> set[int]:
    """Return the times of writing that packed parts of a page hold."""
    parts = [
        text for given, text in Elements(page.decode()).of("script") if "packed" in (given.get("id") or "")
    ]
    return {int.from_bytes(b64decode(part)[4:8], "little") for part in parts}


@pytest.mark.parametrize("name", ["a.html", "b/A.HTML", "c.htm", "/dev/stdout", "/dev/null"])
def test_names_of_pages(name: str) -> None:
    check_page_name(name)


@pytest.mark.parametrize("name", ["a.svg", "html", "b.html/c.txt", "a.html.gz"])
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"'{name.rpartition('/')[2]}' is the name of something else"):
        check_page_name(name)
