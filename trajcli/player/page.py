"""Assembly of a page: a scene, the player's script and its style in one HTML file with a content policy."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from pathlib import Path
from typing import Any

from trajcli.errors import InputError
from trajcli.streams.whole_file import is_special

BUNDLE = Path(__file__).parent / "bundle"
"""What `make player` builds from the folder player/ of the repository."""

_ENDINGS = (".html", ".htm")
_LEVEL = 6  # of gzip: level 9 takes twice as long for half a percent
_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="{generator}">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body>
<noscript>This page draws a robot's motion by a script: please allow scripts.</noscript>
{scripts}
<!--
{licences}
-->
</body>
</html>
"""


def check_page_name(path: str) -> None:
    """Refuse names of files that promise something else than a page.

    Raises:
        InputError: When the name ends otherwise.
    """
    if not (path.lower().endswith(_ENDINGS) or is_special(path)):
        name = Path(path).name
        hint = "name it like view.html"
        raise InputError(f"a page is HTML, and '{name}' is the name of something else", hint=hint)


def page_of(scene: Mapping[str, Any], *, compress: bool = False) -> bytes:
    """Return the HTML page that shows a scene.

    Args:
        scene: What the player draws; see `scene_of_plan`.
        compress: Whether scene and script are packed by gzip: a browser of 2023 or later is needed.
    """
    style, script = _text("style.css"), _script()
    # A "<" of a name could end the element that holds the scene.
    data = json.dumps(scene, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    runs = [script]
    if compress:
        runs.append(_text("loader.js"))
        scripts = "\n".join(
            [
                f'<script type="text/plain" id="packed-scene">{_packed(data)}</script>',
                f'<script type="text/plain" id="packed-player">{_packed(script)}</script>',
                f"<script>{runs[1]}</script>",
            ]
        )
    else:
        scripts = f'<script type="application/json" id="scene">{data}</script>\n<script>{script}</script>'
    page = _PAGE.format(
        policy=_policy(runs, style),
        generator=escape(str(scene["made_by"])),
        title=escape(str(scene["title"])),
        style=style,
        scripts=scripts,
        licences=_text("LICENSES").strip(),
    )
    return page.encode()


def _policy(scripts: list[str], style: str) -> str:
    """Return a content security policy that allows these scripts and this style, and no request at all."""
    allowed = " ".join(_hash(script) for script in scripts)
    return (
        f"default-src 'none'; script-src {allowed}; style-src {_hash(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def _packed(text: str) -> str:
    import gzip

    return b64encode(gzip.compress(text.encode(), _LEVEL, mtime=0)).decode()


def _text(name: str) -> str:
    return (BUNDLE / name).read_text(encoding="utf-8")


def _script() -> str:
    """Return the script, which is packed as .xz: it is a tenth of a wheel."""
    try:
        import lzma
    except ModuleNotFoundError:
        hint = "install a Python that was built with liblzma"
        raise InputError("the player is packed, and this Python has no module lzma", hint=hint) from None
    return lzma.decompress((BUNDLE / "player.js.xz").read_bytes()).decode()
