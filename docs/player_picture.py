"""Make the picture of the player that README and docs/player.md show: `make picture`.

The page of a job is opened in Chromium without a network, at one time of the motion.
"""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from docs.markdown import ROOT
from trajcli.job.read import load_job
from trajcli.planning.plan import plan_job
from trajcli.player.page import page_of
from trajcli.player.scene import scene_of_plan

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PICTURE = ROOT / "docs" / "pictures" / "player.png"
JOB = ROOT / "examples" / "ur5e_pick.yaml"
TIME = 2.6  # s: on the way from the pick to the place
SIZE = {"width": 1200, "height": 760}
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_SOFTWARE = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_POLL = 0.05  # s
_COLORS = 256  # of the palette: the file is a third of its size, and looks the same


@contextmanager
def browser(path: str) -> Iterator[Browser]:
    """Start Chromium, which draws without a graphics card."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=list(_SOFTWARE))
        yield started
        started.close()


def wait_until(page: Page, condition: str, seconds: float = 60.0) -> None:
    """Wait until a condition holds in a page; playwright's own waiting needs `eval`, which our pages forbid.

    Raises:
        TimeoutError: When it does not.
    """
    for _ in range(int(seconds / _POLL)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(1000 * _POLL)
    raise TimeoutError(f"after {seconds:g} s it is not true that {condition}")


def screenshot(started: Browser) -> bytes:
    """Return a picture of the page of the job, as PNG."""
    page = started.new_page(viewport=SIZE, color_scheme="light", offline=True)
    page.set_content(page_of(scene_of_plan(plan_job(load_job(JOB)))).decode())
    wait_until(page, "window.trajcli?.ready")
    page.evaluate(f"trajcli.seek({TIME})")
    page.wait_for_timeout(500)  # ms: drawn with the next frame
    picture = page.screenshot()
    page.close()
    return picture


def main() -> None:
    """Write the picture."""
    from PIL import Image

    path = next((path for path in map(shutil.which, BROWSERS) if path), None)
    if path is None:
        sys.exit("this needs Chromium: apt-get install chromium")
    with browser(path) as started:
        picture = Image.open(io.BytesIO(screenshot(started))).convert("RGB")
    PICTURE.parent.mkdir(exist_ok=True)
    picture.quantize(_COLORS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(
        PICTURE, optimize=True
    )
    sys.stderr.write(f"{PICTURE.relative_to(ROOT)}: {PICTURE.stat().st_size} bytes\n")


if __name__ == "__main__":
    main()
