"""Picture files: SVG, PNG and PDF of a figure, the same bytes each time."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from trajcli.errors import InputError
from trajcli.planning.plan import Plan
from trajcli.plots.figure import figure_of
from trajcli.plots.panel import Picture
from trajcli.plots.picture import picture_of
from trajcli.streams.whole_file import is_special
from trajcli.version import __version__

PICTURE_FORMATS = ("svg", "png", "pdf")
"""What pictures can be written as: the endings of their names."""

_ONE_THREAD = Lock()  # the settings of matplotlib are those of all threads
_DPI = 150.0
_CREATOR = f"trajcli {__version__}"
_METADATA: Mapping[str, Mapping[str, str | None]] = {
    "svg": {"Creator": _CREATOR, "Date": None},
    "png": {"Software": _CREATOR},
    "pdf": {"Creator": _CREATOR, "Producer": None, "CreationDate": None},
}
_SETTINGS = {
    "font.family": ["sans-serif"],
    # text stays text in an SVG; a viewer without the first of these has narrower ones
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Helvetica"],
    "svg.fonttype": "none",
    "svg.hashsalt": "trajcli",
    "pdf.fonttype": 42,
    "path.simplify": True,
    "path.simplify_threshold": 0.111,
    "axes.unicode_minus": False,
    "text.usetex": False,
    "text.parse_math": False,
}


def format_of_picture(path: str | None, given: str | None) -> str:
    """Return the format of a picture from the ending of its name, or as it was asked for.

    Args:
        path: Its name; None, "-" and devices say nothing.
        given: What was asked for.

    Raises:
        InputError: When the ending is none of a picture, or another one than asked for.
    """
    if path is None or path == "-" or is_special(path):
        return given or "svg"
    ending = Path(path).suffix.lower().removeprefix(".")
    if ending not in PICTURE_FORMATS:
        what = f".{ending}" if ending else f"a file without an ending, '{Path(path).name}'"
        names = ", ".join(f".{name}" for name in PICTURE_FORMATS)
        raise InputError(f"pictures are not written as {what}", hint=f"name the file {names}")
    if given is not None and given != ending:
        raise InputError(
            f"--format {given} and the name {path} contradict each other", hint="leave one of them out"
        )
    return ending


def rendered(picture: Picture, kind: str) -> bytes:
    """Return the bytes of a picture in one of `PICTURE_FORMATS`; the same for the same picture."""
    return figure_bytes(lambda: figure_of(picture), kind, picture.title)


def figure_bytes(draw: Callable[[], Any], kind: str, title: str) -> bytes:
    """Return the bytes of what draws a figure, with `settings`, in one of `PICTURE_FORMATS`."""
    import matplotlib as mpl

    out = io.BytesIO()
    metadata = {**_METADATA[kind], **({"Title": title} if kind != "png" else {})}
    with _ONE_THREAD, mpl.rc_context(settings()):
        getattr(_canvas(draw(), kind), f"print_{kind}")(out, metadata=metadata)
    return out.getvalue()


def _canvas(figure: Any, kind: str) -> Any:  # noqa: ANN401
    """Return what draws a figure; only the one that is needed is imported."""
    if kind == "png":
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        return FigureCanvasAgg(figure)
    if kind == "pdf":
        from matplotlib.backends.backend_pdf import FigureCanvasPdf

        return FigureCanvasPdf(figure)
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    return FigureCanvasSVG(figure)


def settings() -> dict[Any, Any]:
    """Return the settings of matplotlib in which pictures are drawn, whatever the user's own are."""
    import matplotlib as mpl

    kept: dict[Any, Any] = {name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"}
    return {**kept, "savefig.dpi": _DPI, "figure.dpi": _DPI, **_SETTINGS}


def svg_of(plan: Plan) -> str:
    """Return the picture of a plan as SVG text, with the quantities that suit it, as a notebook shows it."""
    return rendered(picture_of(plan), "svg").decode()
