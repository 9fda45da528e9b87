"""Drawn figures: artists hold the values, texts do not overlap, axes have units, the same bytes each time."""

from __future__ import annotations

import hashlib
import io
import itertools
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.text import Text
from picture_jobs import EXAMPLES, TWO, many_joints
from tiers import few

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.axes import labels_with_room, shortened, text_width, ticks_of
from trajcli.plots.figure import figure_of
from trajcli.plots.legend import COLOURS, LIMIT_COLOUR, _title_lines, style_of
from trajcli.plots.panel import MoveBorders, Picture
from trajcli.plots.picture import picture_of
from trajcli.plots.write import format_of_picture, rendered, settings, svg_of
from trajcli.streams.table import Table

Example = Callable[[str], Plan]
LARGEST = 0.05  # difference of the means of squares, of 1
REFERENCES = Path(__file__).parent / "reference"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.yaml"))


def drawn(picture: Picture):
    """Return the figure and a renderer."""
    with rc_context({**settings(), "figure.dpi": 100}):
        figure = figure_of(picture)
        canvas = FigureCanvasAgg(figure)
        figure.draw_without_rendering()  # what is looked at are artists, and the boxes of texts
    return figure, canvas.get_renderer()


def overlaps(picture: Picture) -> list[tuple[str, str]]:
    """Return the pairs of texts whose boxes overlap, and those that leave the figure."""
    figure, renderer = drawn(picture)
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    boxes = [(text.get_text(), text.get_window_extent(renderer)) for text in texts]
    whole = figure.bbox
    outside = [
        (name, "the edge")
        for name, box in boxes
        if box.x0 < whole.x0 or box.x1 > whole.x1 or box.y0 < whole.y0 or box.y1 > whole.y1
    ]
    pairs = [
        (a, b)
        for (a, one), (b, other) in itertools.combinations(boxes, 2)
        if min(one.x1, other.x1) - max(one.x0, other.x0) > 0.5
        and min(one.y1, other.y1) - max(one.y0, other.y0) > 0.5
    ]
    return outside + pairs


@pytest.mark.parametrize("name", few(NAMES, 3))
def test_texts_of_examples_do_not_overlap(name: str, example: Example) -> None:
    assert overlaps(picture_of(example(name))) == []


@pytest.mark.parametrize("count", few([1, 2, 3, 6, 12], 2))
@pytest.mark.parametrize("quantities", [None, ["q"], ["q", "qd"], ["q", "qd", "qdd", "qddd"]])
def test_texts_of_few_and_many_joints_do_not_overlap(count: int, quantities: list[str] | None) -> None:
    assert overlaps(picture_of(plan_job(job_from_text(many_joints(count))), quantities=quantities)) == []


@pytest.mark.parametrize(
    "quantities", [["tool"], ["path"], ["phase"], ["tool", "path"], ["path", "phase"], ["q", "path"]]
)
def test_texts_of_parts_of_a_picture_do_not_overlap(quantities: list[str], led: Plan) -> None:
    assert overlaps(picture_of(led, quantities=quantities)) == []


def test_texts_of_a_hundred_moves_and_of_wide_numbers_do_not_overlap() -> None:
    moves = "".join(
        f"  - {{planner: quintic, to: {{joints: [{(k % 7) * 1e5 + 0.125}]}}, duration: {1 + k % 3}}}\n"
        for k in range(100)
    )
    text = f"version: 1\nrobot: {{joints: 1}}\nstart: {{joints: [0]}}\nmoves:\n{moves}output: {{start_time: 123456.5}}\n"
    assert overlaps(picture_of(plan_job(job_from_text(text)))) == []


@pytest.mark.full
def test_texts_of_many_files_and_a_long_title_do_not_overlap(example: Example) -> None:
    names = ("t", "q1_deg", "q2_deg")
    rows = np.array([[0.0, 0.0, 1.0], [1.0, 5.0, 7.0]])
    tables = [
        Table(
            names,
            rows + k,
            np.zeros(3, dtype=np.int64),
            f"folder{k}/{'of_recordings_' * 11}/number.csv",
        )
        for k in range(23)
    ]
    picture = picture_of(None, tables)
    assert overlaps(picture) == []
    figure, _ = drawn(picture)
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert sum(name.endswith("\N{HORIZONTAL ELLIPSIS}") for name in texts) == 24  # all names, and the title


def test_the_check_of_overlaps_can_fail(two: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trajcli.plots.frame._LABEL", 0.2)
    assert overlaps(picture_of(two))


def test_many_moves_have_no_borders_and_many_waypoints_are_small() -> None:
    def drawn_with(count: int) -> tuple[set[str], set[str], float]:
        moves = "".join(
            f"  - {{planner: quintic, to: {{joints: [{k % 2 + 1}]}}, duration: 1}}\n" for k in range(count)
        )
        job = f"version: 1\nrobot: {{joints: 1}}\nstart: {{joints: [0]}}\nmoves:\n{moves}"
        picture = picture_of(plan_job(job_from_text(job)), quantities=["q"])
        figure, _ = drawn(picture)
        lines = artists(picture)
        texts = {text.get_text() for text in figure.findobj(Text)}
        return set(lines), texts, lines["panel0-waypoints"].get_markersize()

    few, words, large = drawn_with(30)
    many, no_words, small = drawn_with(90)
    assert "panel0-borders" in few - many
    assert "border of moves" in words - no_words
    assert small < large / 2


def artists(picture: Picture) -> dict[str, Line2D]:
    figure, _ = drawn(picture)
    return {line.get_gid(): line for line in figure.findobj(Line2D) if line.get_gid()}


def test_the_lines_that_are_drawn_hold_the_values(example: Example) -> None:
    lines = artists(picture_of(example("cubic"), quantities=["q", "qd"]))
    t, q = lines["panel0-source0"].get_data()
    np.testing.assert_allclose(q, 20 + 90 * t**2 - 60 * t**3, atol=1e-9)
    t, qd = lines["panel1-source0"].get_data()
    np.testing.assert_allclose(qd, 180 * t - 180 * t**2, atol=1e-9)


def test_points_are_drawn_where_the_numbers_at_the_axes_say(example: Example) -> None:
    figure, renderer = drawn(picture_of(example("cubic"), quantities=["q"]))
    line = next(line for line in figure.findobj(Line2D) if line.get_gid() == "panel0-source0")
    (x, top), (_, bottom) = line.get_transform().transform([(0.5, 50.0), (0.5, 20.0)])

    def middle(text: str) -> tuple[float, float]:
        found = next(each for each in figure.findobj(Text) if each.get_text() == text)
        box = found.get_window_extent(renderer)
        return (box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2

    assert middle("0.5")[0] == pytest.approx(x, abs=1.5)  # pixels
    assert middle("50")[1] == pytest.approx(top, abs=2.5)
    assert middle("20")[1] == pytest.approx(bottom, abs=2.5)


def test_limits_are_drawn_at_the_limits_and_those_far_away_are_said(two: Plan) -> None:
    picture = picture_of(two, quantities=["q", "qd"])
    lines = artists(picture)
    assert lines["panel0-limit"].get_color() == LIMIT_COLOUR
    figure, _ = drawn(picture)
    limits = [line.get_ydata() for line in figure.findobj(Line2D) if line.get_gid() == "panel2-limit"]
    np.testing.assert_allclose(limits, [[-50, -50, -90, -90], [50, 50, 90, 90]])
    far = plan_job(job_from_text(TWO.replace("[-100, 100]", "[-9000, 9000]")))
    texts = [text.get_text() for text in drawn(picture_of(far))[0].texts]
    assert "limit \N{PLUS-MINUS SIGN}9000 out of view" in texts


@pytest.mark.parametrize("name", ["along a path", "spline", "gantry"])
def test_every_axis_has_a_unit(name: str, led: Plan, example: Example) -> None:
    picture = picture_of(led if name == "along a path" else example(name))
    figure, _ = drawn(picture)
    labels = [text.get_text() for text in figure.findobj(Text) if re.search(r"\[.+\]$", text.get_text())]
    panels = [panel for block in picture.blocks for panel in block.panels]
    assert sum(label in {panel.y_label for panel in panels} for label in labels) >= len(panels)
    assert sum(label.startswith(("x [", "y [", "z [")) for label in labels) == (9 if picture.views else 0)


def test_colours_are_told_apart_and_no_two_sources_look_alike() -> None:
    styles = [style_of(source) for source in range(len(COLOURS) * 4)]
    assert len({(style["color"], str(style["linestyle"])) for style in styles}) == len(styles)
    assert LIMIT_COLOUR not in COLOURS
    assert len({style["color"] for style in styles[: len(COLOURS)]}) == len(COLOURS)
    assert len({str(style["linestyle"]) for style in styles[:4]}) == 4


@pytest.mark.parametrize(
    ("view", "most", "texts"),
    [
        ((0.0, 1.0), 5, ["0", "0.2", "0.4", "0.6", "0.8", "1"]),
        ((-110.0, 110.0), 5, ["-100", "-50", "0", "50", "100"]),
        ((1e6, 1e6 + 4), 4, ["1000000", "1000001", "1000002", "1000003", "1000004"]),
        ((0.0, 3e-7), 3, ["0", "1e-07", "2e-07", "3e-07"]),
        ((-0.03, 0.22), 5, ["0", "0.05", "0.1", "0.15", "0.2"]),
        ((1.764e9, 1.764e9 + 1), 2, ["1764000000", "1764000000.5", "1764000001"]),
        ((-2.5e9, 2.5e9), 5, ["-2e+09", "-1e+09", "0", "1e+09", "2e+09"]),
    ],
)
def test_ticks_are_round_numbers_that_differ(view: tuple[float, float], most: int, texts: list[str]) -> None:
    values, names = ticks_of(view, most)
    assert len(set(names)) == len(names)
    assert names == texts
    np.testing.assert_allclose(values, [float(name) for name in names], atol=1e-9 * (view[1] - view[0]))


def test_names_are_shortened_to_their_room() -> None:
    assert shortened("short", 8.0, 3.0) == "short"
    cut = shortened("a very long name indeed", 8.0, 0.6)
    assert cut.endswith("\N{HORIZONTAL ELLIPSIS}")
    assert text_width(cut, 8.0) <= 0.6
    assert shortened("name", 8.0, 0.0) == ""


def test_indices_of_moves_stand_where_there_is_room() -> None:
    wide = np.array([2.0, 2.0])
    assert labels_with_room(["a", "b"], np.array([1.0, 3.0]), wide, 7.0) == [(0, 1.0), (1, 3.0)]
    narrow, middles = np.full(40, 0.05), 0.05 * np.arange(40)
    kept = labels_with_room(["31"] * 40, middles, narrow, 7.0)
    assert np.diff([at for _, at in kept]).min() >= text_width("31", 7.0)
    assert 5 < len(kept) < 40
    assert labels_with_room(["a", "b", "c"], np.array([1.0, 1.0, 3.0]), np.array([2.0, 0.0, 2.0]), 7.0) == [
        (0, 1.0),
        (2, 3.0),
    ]


def test_titles_of_moves_stand_once_and_what_takes_no_time_is_marked(example: Example) -> None:
    figure, _ = drawn(picture_of(example("pick_carry_place"), quantities=["q", "tau"]))
    texts = [text.get_text() for text in figure.findobj(Text)]
    for title in ("0 home -> pick (time_optimal)", "2 pick -> place (time_optimal)"):
        assert texts.count(title) == 1
    assert [text for text in texts if text.startswith("\u25be1 attach, 0.39")]
    assert texts.count("4") == 2
    marks = [line for line in figure.findobj(Line2D) if str(line.get_gid()).endswith("-marks")]
    assert [len(line.get_xdata()) for line in marks] == [2, 2]  # attach and detach, in the top row
    assert {text.get_rotation() for text in figure.findobj(Text) if text.get_text().isdigit()} == {0.0}


def test_a_path_has_its_start_and_its_direction() -> None:
    text = """\
version: 1
robot: {convention: standard, joints: [{type: prismatic, alpha: 90, theta: 90}, {type: prismatic}]}
start: {joints: [0, 0]}
moves: [{planner: line, to: {joints: [1, 0]}, law: {speed: 1, acceleration: 4}}, {planner: line, to: {joints: [1, -2]}, law: {speed: 1, acceleration: 4}}]
"""
    plan = plan_job(job_from_text(text))
    views = picture_of(plan, quantities=["path"])
    path = views.views.traces[0][1] if views.views is not None else np.empty((0, 3))
    lines = artists(views)
    for first, second, name in ((0, 1, "view-xy"), (0, 2, "view-xz"), (1, 2, "view-yz")):
        start = lines[f"{name}-start0"]
        assert [start.get_xdata()[0], start.get_ydata()[0]] == path[0, [first, second]].tolist()
        for number in range(5):
            arrow = lines.get(f"{name}-arrow0-{number}")
            if arrow is None:  # along the line of sight
                continue
            here = np.array([arrow.get_xdata()[0], arrow.get_ydata()[0]])
            flat = path[:, [first, second]]
            steps = np.diff(flat, axis=0)
            k = int(np.linalg.norm(0.5 * (flat[1:] + flat[:-1]) - here, axis=1).argmin())
            turn = np.radians(arrow.get_marker()[2] + 90)
            assert np.array([np.cos(turn), np.sin(turn)]) == pytest.approx(
                steps[k] / np.linalg.norm(steps[k]), abs=1e-6
            )
    assert any("arrow" in name for name in lines)


def test_of_very_many_moves_the_first_titles_stand_there() -> None:
    borders = MoveBorders(np.arange(101.0), tuple(range(100)), ("hold",) * 100)
    lines = list(_title_lines(borders))
    assert (lines[0], lines[-1]) == ("0 hold", "and 65 more")


SCRIPT = """
import hashlib, sys
from trajcli.job.read import load_job
from trajcli.planning.plan import plan_job
from trajcli.plots.picture import picture_of
from trajcli.plots.write import rendered
picture = picture_of(plan_job(load_job("examples/cubic.yaml")))
print(*(hashlib.sha256(rendered(picture, kind)).hexdigest() for kind in ("svg", "png", "pdf")))
print("matplotlib.pyplot" in sys.modules)
"""


@pytest.mark.full
def test_bytes_are_the_same_in_every_process_and_whatever_settings_the_user_has(
    tmp_path: Path, example: Example
) -> None:
    (tmp_path / "matplotlibrc").write_text("font.size: 20\nlines.linewidth: 9\nsvg.fonttype: path\n")
    environment = {**os.environ, "PYTHONHASHSEED": "2", "SOURCE_DATE_EPOCH": "200000000"}
    environment["MATPLOTLIBRC"] = str(tmp_path / "matplotlibrc")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=environment,
        cwd=EXAMPLES.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    picture = picture_of(example("cubic"))
    ours = [hashlib.sha256(rendered(picture, kind)).hexdigest() for kind in ("svg", "png", "pdf")]
    assert done.stdout.split() == [*ours, "False"]


def test_an_svg_is_well_formed_with_its_words_as_text(example: Example) -> None:
    root = ET.fromstring(svg_of(example("ur5e_pick")))
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    words = {text.text for text in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {
        "shoulder_pan_joint",
        "q\u0307 [deg/s]",
        "4 above_pick -> above_place (jerk_limited)",
        "t [s]",
        "limit",
    } <= words
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(ids) == len(set(ids)) or all(name.endswith("limit") for name in ids if ids.count(name) > 1)
    date = root.findall(".//{http://purl.org/dc/elements/1.1/}date")
    assert date == []


@pytest.mark.parametrize(("kind", "begins"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_each_format_begins_as_it_should(kind: str, begins: bytes, two: Plan) -> None:
    assert rendered(picture_of(two, quantities=["q"]), kind).startswith(begins)


@pytest.mark.parametrize(
    ("path", "given", "kind"),
    [
        (None, None, "svg"),
        ("-", "png", "png"),
        ("a/b.PDF", None, "pdf"),
        ("a.png", "png", "png"),
        ("/dev/stdout", None, "svg"),
    ],
)
def test_the_format_is_that_of_the_name(path: str | None, given: str | None, kind: str) -> None:
    assert format_of_picture(path, given) == kind


@pytest.mark.parametrize(
    ("path", "given", "message"),
    [
        ("a.jpg", None, "pictures are not written as .jpg"),
        ("picture", None, "a file without an ending, 'picture'"),
        ("a.svg", "png", "--format png and the name a.svg contradict each other"),
    ],
)
def test_other_names_are_refused(path: str, given: str | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        format_of_picture(path, given)


def reference_picture(name: str, example: Example) -> Picture:
    if name == "twelve":
        return picture_of(plan_job(job_from_text(many_joints(12))))
    if name == "findings":
        slow = TWO.replace("duration: 2", "duration: 0.5")
        return picture_of(plan_job(job_from_text(slow)))
    if name == "overlay":
        rows = np.array([[10.0, 0.0, 0.1], [11.0, 1.0, 0.05], [13.0, 0.2, 0.08]])
        tables = [
            Table(("t", "q1", "q2"), rows + shift, np.zeros(3, dtype=np.int64), f"{shift}.csv")
            for shift in (0, 0.05)
        ]
        return picture_of(plan_job(job_from_text(TWO)), tables, ["q"])
    return picture_of(example(name))


@pytest.mark.parametrize(
    "name",
    few(["spline", "sync", "ur5e_pick", "twelve", "time_optimal", "dispense", "findings", "overlay"], 2),
)
def test_pictures_look_as_they_did(name: str, example: Example) -> None:
    """The references are looked at before they are committed; TRAJCLI_NEW_REFERENCES=1 writes them anew."""
    figure, _ = drawn(reference_picture(name, example))
    figure.set_dpi(50)
    out = io.BytesIO()
    with rc_context(settings()):
        FigureCanvasAgg(figure).print_png(out, metadata={"Software": None})
    path = REFERENCES / f"{name}.png"
    if os.environ.get("TRAJCLI_NEW_REFERENCES"):
        path.write_bytes(out.getvalue())
    ours, theirs = imread(io.BytesIO(out.getvalue()))[..., :3], imread(path)[..., :3]
    assert ours.shape == theirs.shape
    # squares of 8 pixels: what moves a line by less, as another version of a font or an antialiasing, is no change
    assert np.abs(blocks_of(ours) - blocks_of(theirs)).max() < LARGEST
    assert np.abs(ours - theirs).mean() < 0.01


def blocks_of(image: np.ndarray, size: int = 8) -> np.ndarray:
    height, width = (length // size * size for length in image.shape[:2])
    cut = image[:height, :width].reshape(height // size, size, width // size, size, 3)
    return cut.mean(axis=(1, 3))


@pytest.mark.full
def test_the_comparison_of_pictures_sees_a_line_that_is_missing(
    two: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def image() -> np.ndarray:
        figure, _ = drawn(picture_of(two))
        figure.set_dpi(50)
        out = io.BytesIO()
        FigureCanvasAgg(figure).print_png(out)
        return imread(io.BytesIO(out.getvalue()))[..., :3]

    right = image()
    monkeypatch.setattr("trajcli.plots.figure.LIMIT", {"linewidth": 0.0})
    assert np.abs(blocks_of(image()) - blocks_of(right)).max() > LARGEST
