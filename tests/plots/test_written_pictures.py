"""Files of pictures: what stands beside the drawing, and that neither the day nor the user's settings change a byte."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from threading import Barrier, BrokenBarrierError

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job
from trajcli.plots import write
from trajcli.plots.figure import figure_of
from trajcli.plots.panel import Panel, PanelBlock, Picture, Trace
from trajcli.plots.write import PICTURE_FORMATS, format_of_picture, rendered, settings, svg_of
from trajcli.version import __version__

TIMES = np.linspace(-1.0, 1.0, 5)
PICTURE = Picture(
    "the title",
    ("plan",),
    (PanelBlock((Panel("$a_b$", "t [s]", "q [rad]", (Trace(0, TIMES, -TIMES),)),), 1),),
)


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return {kind: rendered(PICTURE, kind) for kind in PICTURE_FORMATS}


def test_no_date_stands_in_a_file_but_who_made_it_and_its_title(files: dict[str, bytes]) -> None:
    creator = f"trajcli {__version__}".encode()
    for kind, data in files.items():
        assert creator in data, kind
        assert b"date" not in data.lower(), kind
        assert (b"the title" in data.split(b"<defs>", maxsplit=1)[0]) == (kind != "png")
    assert b"<dc:title>the title</dc:title>" in files["svg"]
    assert b"/Title" in files["pdf"]


@pytest.mark.parametrize("kind", PICTURE_FORMATS)
def test_settings_of_the_user_change_nothing(kind: str, files: dict[str, bytes]) -> None:
    own = {
        "lines.linewidth": 9,
        "font.size": 30,
        "savefig.dpi": 20,
        "path.simplify": False,
        "svg.hashsalt": "mine",
        "text.color": "red",
        "figure.facecolor": "black",
    }
    with mpl.rc_context({**own, "axes.unicode_minus": True, "font.family": ["monospace"]}):
        assert rendered(PICTURE, kind) == files[kind]


def test_texts_of_an_svg_are_texts_and_no_mathematics(files: dict[str, bytes]) -> None:
    """A minus is the one of the keyboard, as in the rows; a dollar is a dollar."""
    text = files["svg"].decode()
    assert ">$a_b$<" in text
    assert ">-1<" in text or ">-0.5<" in text
    assert settings()["pdf.fonttype"] == 42  # letters, not pictures of letters


def test_a_picture_has_150_points_an_inch(files: dict[str, bytes]) -> None:
    width = int.from_bytes(files["png"][16:20], "big")
    points = float(files["svg"].split(b'width="', 1)[1].split(b"pt", 1)[0])
    assert width == pytest.approx(points / 72 * 150, abs=1)


@pytest.mark.parametrize(
    ("path", "given", "kind"),
    [
        ("a.SVG", None, "svg"),
        ("b/c.Png", "png", "png"),
        ("-", None, "svg"),
        ("-", "pdf", "pdf"),
        (None, "png", "png"),
        ("/dev/null", "pdf", "pdf"),
        ("/dev/null", None, "svg"),
    ],
)
def test_the_name_or_what_is_asked_for_says_the_format(
    path: str | None, given: str | None, kind: str
) -> None:
    assert format_of_picture(path, given) == kind


@pytest.mark.parametrize(
    ("path", "given"), [("a.jpg", None), ("svg", None), ("a.svg.gz", "svg"), ("a.svg", "pdf")]
)
def test_other_names_are_refused(path: str, given: str | None) -> None:
    with pytest.raises(InputError):
        format_of_picture(path, given)


def test_a_notebook_shows_what_suits_a_plan() -> None:
    job = "version: 1\nrobot: {joints: 1}\nstart: {joints: 0}\nmoves: [{planner: quintic, to: {joints: 1}, duration: 1}]"
    text = svg_of(plan_job(job_from_text(job)))
    assert text.startswith("<?xml")
    for name in ("position", "velocity", "acceleration", "jerk"):
        assert f"j1: {name}" in text


def test_two_threads_do_not_draw_at_once(monkeypatch: pytest.MonkeyPatch, files: dict[str, bytes]) -> None:
    """They would change each other's settings, and leave them changed: these are one set for all threads."""
    both = Barrier(2)
    met = []

    def drawn(picture: Picture) -> Figure:
        with suppress(BrokenBarrierError):
            both.wait(timeout=0.05)
            met.append(picture)
        return figure_of(picture)

    monkeypatch.setattr(write, "figure_of", drawn)
    before = dict(mpl.rcParams)
    with ThreadPoolExecutor(2) as threads:
        assert set(threads.map(lambda _: rendered(PICTURE, "svg"), range(2))) == {files["svg"]}
    assert not met
    assert dict(mpl.rcParams) == before
