"""Ranges, remarks and styles of axes by hand; frames by what matplotlib makes of their coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from trajcli.errors import InputError
from trajcli.plots.axes import finite_limits, labels_with_room, note_of, text_width, ticks_of, view_of
from trajcli.plots.choice import QUANTITY_NAMES, choose_joints, choose_quantities, parse_quantities
from trajcli.plots.frame import LEFT, RIGHT, PanelFrame, Sheet, left_of, panel_width
from trajcli.plots.legend import (
    FINDING,
    MARKED,
    START,
    VIRTUAL_POINT,
    WAYPOINT,
    Legend,
    MoveTitles,
    _entries,
    marker_style,
    style_of,
)
from trajcli.plots.panel import NO_POINTS, MoveBorders, Panel, PanelBlock, PathViews, Picture, Trace

NAN = np.nan


def panel(values: list[float], *limits: float, **more: Any) -> Panel:
    """Return a panel with one trace, and with limits that hold all the time."""
    times = np.linspace(0.0, 1.0, max(len(values), 1))[: len(values)]
    lines = tuple(np.array([[0.0, limit], [1.0, limit]]) for limit in limits)
    return Panel("title", "t [s]", "q [rad]", (Trace(0, times, np.array(values)),), lines, **more)


def around(low: float, high: float) -> Any:
    """Return the view in which a range stands: 6 % of it are left at both ends."""
    return pytest.approx((low - 0.06 * (high - low), high + 0.06 * (high - low)))


@pytest.mark.parametrize(
    ("values", "limits", "low", "high"),
    [
        ([-1, 1], (-2, 2), -2, 2),
        ([-1, 1], (-4.9, 4.9), -4.9, 4.9),  # a fifth of the view
        ([-1, 1], (-5.1, 5.1), -1, 1),
        ([0, 1], (-50, 1.9), 0, 1.9),  # half of the view is enough where the other limit is far
        ([0, 1], (-50, 2.1), 0, 1),
        ([-1, 0], (-1.9, 50), -1.9, 0),
        ([-1, 0], (-2.1, 50), -1, 0),
        ([-3, 3], (-2, 2), -3, 3),
        ([3, 3], (), -1, 7),
        ([0], (), -1, 1),
        ([], (), -1, 1),
        ([5, 5], (-180, 180), -180, 180),
        ([5, 5 + 1e-4], (-180, 180), -180, 180),  # a millionth of a limit is rest
        ([5, 5 + 3e-4], (-180, 180), 5, 5 + 3e-4),
        ([1e6, 1e6 + 1e-4], (), -1, 2e6 + 1),  # a billionth of the value is rounding
        ([1e6, 1e6 + 1e-2], (), 1e6, 1e6 + 1e-2),
        ([0, 1e-10], (), -1, 1),
        ([0, 1e-5], (-100, 1), 0, 1e-5),  # of the nearer limit
        ([0, NAN, 2, np.inf], (-np.inf, NAN), 0, 2),
    ],
)
def test_a_view_holds_all_values_and_the_limits_that_are_near(
    values: list[float], limits: tuple[float, ...], low: float, high: float
) -> None:
    assert view_of(panel(values, *limits)) == around(low, high)


@pytest.mark.parametrize("kind", ["waypoints", "virtual_points", "findings"])
def test_markers_are_in_view(kind: str) -> None:
    marks = np.array([[0.5, -4.0], [0.6, 9.0], [0.7, NAN]])
    assert view_of(panel([0, 1], **{kind: marks})) == around(-4, 9)


def test_limits_are_those_of_all_lines_in_order() -> None:
    steps = np.array([[0.0, 5.0], [0.5, 5.0], [0.5, NAN], [0.5, 3.0], [1.0, 3.0]])
    assert finite_limits(Panel("", "", "", (), (steps, -steps))).tolist() == [-5, -5, -3, -3, 3, 3, 5, 5]
    assert finite_limits(panel([1.0])).size == 0


@pytest.mark.parametrize(
    ("limits", "note"),
    [
        ((), ""),
        ((-1, 1), ""),
        ((-1.2, 1.2), "limit \N{PLUS-MINUS SIGN}1.2 out of view"),
        ((-20, 1), "limit -20 out of view"),
        ((-1, 20), "limit 20 out of view"),
        ((-30, 20), "limits -30, 20 out of view"),
        ((-50, -30, 20, 40), "limits -30, 20 out of view"),
        ((-40, -20, 20, 30), "limit \N{PLUS-MINUS SIGN}20 out of view"),
        ((3.14159265,), "limit 3.142 out of view"),
    ],
)
def test_the_nearest_limits_out_of_view_are_said(limits: tuple[float, ...], note: str) -> None:
    assert note_of(panel([-1, 1], *limits), (-1.1, 1.1)) == note
    assert note_of(panel([-1, 1], *limits, unlimited=True), (-1.1, 1.1)) == "no limit"


@pytest.mark.parametrize("most", [2, 3, 4, 5])
def test_ticks_are_within_the_view_and_few(most: int) -> None:
    random = np.random.default_rng(most)
    for _ in range(60):
        size = 10.0 ** random.uniform(-6, 9)
        low, width = size * random.uniform(-2, 2), size * 10 ** random.uniform(-2, 1)
        values, names = ticks_of((low, low + width), most)
        assert 1 <= len(values) <= most + 1
        assert low - 1e-9 * width <= values[0] <= values[-1] <= low + width * (1 + 1e-9)
        assert np.array([float(name) for name in names]) == pytest.approx(
            np.array(values), rel=1e-9, abs=1e-6 * width
        )


def test_names_of_intervals_keep_half_a_letter_apart() -> None:
    width = text_width("31", 7.0)
    assert width == pytest.approx(2 * 0.636 * 7 / 72, rel=1e-2)  # digits of DejaVu Sans: 0.636 em
    assert labels_with_room(["31"] * 2, np.array([1.0, 2.0]), np.array([0.0, 1.0]), 7.0) == [(1, 2.0)]
    for gap, kept in ((3.4, [0, 2]), (3.6, [0, 1, 2])):
        middles = np.arange(3) * (width + gap / 72)
        assert [k for k, _ in labels_with_room(["31"] * 3, middles, np.ones(3), 7.0)] == kept


def test_frames_side_by_side_fill_a_sheet() -> None:
    for columns in (1, 2, 5):
        each = panel_width(columns, 11.0)
        edges = [(left_of(k, each), left_of(k, each) + each) for k in range(columns)]
        assert edges[0][0] == LEFT
        assert edges[-1][1] == pytest.approx(11.0 - RIGHT)
        assert np.diff(edges, axis=0)[:, 0] - each == pytest.approx(0.85)


@pytest.fixture
def frame() -> PanelFrame:
    """Return a frame of 4 by 2 inches, 1 inch from the left and 0.5 from above, on a sheet of 6 by 3."""
    sheet = Sheet(Figure(figsize=(6.0, 3.0), dpi=100), 6.0, 3.0)
    return PanelFrame(sheet, (1.0, 0.5, 4.0, 2.0), (10.0, 30.0), (-4.0, 6.0), "panel7")


def lines_of(frame: PanelFrame) -> Mapping[str, Line2D]:
    return {str(line.get_gid()): line for line in frame.sheet.figure.findobj(Line2D)}


def inches(line: Line2D, x: float, y: float) -> list[float]:
    """Return where a point of a line is drawn, inches from the left and from below."""
    return (np.asarray(line.get_transform().transform((x, y))) / 100).tolist()


def test_a_point_is_drawn_at_its_place(frame: PanelFrame) -> None:
    frame.plot(np.array([10.0, 30.0]), np.array([-4.0, 6.0]), "source0", color="red")
    line = lines_of(frame)["panel7-source0"]
    for (x, y), place in (
        ((10, -4), (1, 0.5)),
        ((30, 6), (5, 2.5)),
        ((20, 1), (3, 1.5)),
        ((10, 6), (1, 2.5)),
    ):
        assert inches(line, x, y) == pytest.approx(place)
    assert np.array(line.get_clip_box().extents) / 100 == pytest.approx([1, 0.5, 5, 2.5])
    assert [frame.across(x) for x in (10.0, 20.0, 30.0)] == [1, 3, 5]
    assert line.get_color() == "red"


def test_uprights_go_from_edge_to_edge(frame: PanelFrame) -> None:
    frame.uprights(np.array([12.0, 20.0]), "borders")
    x, y = lines_of(frame)["panel7-borders"].get_data()
    assert np.array(x).tolist() == [12, 12, 12, 20, 20, 20]
    assert np.array(y) == pytest.approx(np.array([-4, 6, NAN] * 2), nan_ok=True)


def test_an_outline_and_its_ticks(frame: PanelFrame) -> None:
    """In inches from below: the rectangle, then ticks below it and on its left."""
    frame.outline([20.0, 30.0], [1.0])
    x, y = (np.array(part, dtype=float) for part in lines_of(frame)["panel7-frame"].get_data())
    parts = np.split(np.stack([x, y], axis=1), np.flatnonzero(np.isnan(x)))
    box, *ticks = [part[~np.isnan(part[:, 0])] for part in parts]
    assert box == pytest.approx(np.array([[1, 0.5], [5, 0.5], [5, 2.5], [1, 2.5], [1, 0.5]]))
    assert np.array(ticks) == pytest.approx(
        np.array([[[3, 0.5], [3, 0.465]], [[5, 0.5], [5, 0.465]], [[0.965, 1.5], [1, 1.5]]])
    )


def test_words_stand_beside_their_ticks(frame: PanelFrame) -> None:
    frame.x_axis([20.0], ["twenty"], "t [s]")
    frame.y_axis([1.0, 6.0], ["one", "six"], "q [rad]")
    frame.titles("title", "remark", "blue")
    shown = {text.get_text(): text for text in frame.sheet.figure.texts}
    places = {name: np.array(text.get_position()) * [6, 3] for name, text in shown.items()}
    assert places["twenty"] == pytest.approx([3, 0.44])
    assert places["t [s]"] == pytest.approx([3, 0.3])
    assert places["one"] == pytest.approx([0.94, 1.5])
    assert places["six"] == pytest.approx([0.94, 2.5])
    assert places["q [rad]"] == pytest.approx([0.38, 1.5])
    assert places["title"] == pytest.approx([1, 2.56])
    assert places["remark"] == pytest.approx([5, 2.56])
    assert shown["q [rad]"].get_rotation() == 90
    assert [shown[name].get_ha() for name in ("twenty", "one", "title", "remark")] == [
        "center",
        "right",
        "left",
        "right",
    ]
    assert shown["remark"].get_color() == "blue"
    frame.titles("alone", "", "blue")
    assert len(frame.sheet.figure.texts) == len(shown) + 1


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("qdd,q", ("q", "qdd")),
        (" q, qd  tool ", ("q", "qd", "tool")),
        ("phase path tool tau qddd qdd qd q", tuple(QUANTITY_NAMES)),
        ("q,q", "the quantity 'q' is asked for twice"),
        ("q,qd,qdd,qd", "the quantity 'qd' is asked for twice"),
        ("q,qx", "there is no quantity 'qx' to plot"),
        (" , ", "no quantities are asked for"),
    ],
)
def test_quantities_are_read_in_the_order_in_which_they_are_drawn(
    text: str, wanted: str | tuple[str, ...]
) -> None:
    if isinstance(wanted, tuple):
        assert parse_quantities(text) == wanted
        return
    with pytest.raises(InputError) as caught:
        parse_quantities(text)
    assert caught.value.problems[0].message == wanted


def test_joints_are_chosen_in_their_own_order() -> None:
    joints = ["base", "elbow", "wrist"]
    assert choose_joints([], joints) == (0, 1, 2)
    assert choose_joints(["wrist", "base"], joints) == (0, 2)
    for names, message, hint in (
        (["base", "elbov"], "there is no joint 'elbov'", "did you mean 'elbow'"),
        (["base", "nothing"], "there is no joint 'nothing'", "base, elbow, wrist"),
        (["base", "elbow", "base"], "the joint 'base' is asked for twice", "once"),
    ):
        with pytest.raises(InputError) as caught:
            choose_joints(names, joints)
        assert caught.value.problems[0].message == message
        assert hint in (caught.value.problems[0].hint or "")


def test_what_does_not_apply_is_refused_with_its_reason_and_what_does() -> None:
    without = {"tool": "bare joints", "path": "no path"}
    assert choose_quantities(None, ["q", "tool"], without) == ("q",)
    assert choose_quantities(["qd", "q"], ["q", "tool"], without) == ("qd", "q")
    with pytest.raises(InputError) as caught:
        choose_quantities(["q", "path", "tool"], ["q"], without)
    (problem,) = caught.value.problems
    assert problem.message == "'path' cannot be plotted: no path; 'tool' cannot be plotted: bare joints"
    assert all(name in (problem.hint or "") for name in ("qdd", "tau", "phase"))
    assert "tool" not in (problem.hint or "")
    with pytest.raises(InputError, match="nothing to plot"):
        choose_quantities(None, ["tool"], without)


def picture(*panels: Panel, **more: Any) -> Picture:
    fields = {"sources": ("plan",), "blocks": (PanelBlock(panels or (panel([0, 1]),), 1),), **more}
    return Picture("title", **fields)


def named(shown: Picture) -> list[str]:
    return [name for name, _ in _entries(shown)]


def test_a_legend_names_what_is_drawn() -> None:
    point = np.array([[0.5, 0.5]])
    assert named(picture(sources=("plan", "file"))) == ["plan", "file"]
    assert named(picture(panel([0, 1]), panel([0, 1], 3))) == ["plan", "limit"]
    assert named(picture(panel([0, 1], NAN))) == ["plan"]
    for field, name in (
        ("waypoints", "waypoint"),
        ("virtual_points", "virtual point"),
        ("findings", "finding"),
    ):
        assert named(picture(panel([0]), panel([0], **{field: point}))) == ["plan", name]
    views = PathViews("m", ((0, np.zeros((2, 3))),), np.zeros((0, 3)))
    whole = PathViews("m", views.traces, np.zeros((1, 3)), np.zeros((1, 4)), (np.zeros((2, 3)),))
    assert named(picture(views=views)) == ["plan", "start of a path"]
    assert named(picture(views=whole)) == ["plan", "waypoint", "start of a path", "zone", "programmed path"]


@pytest.mark.parametrize(("moves", "shown"), [(1, False), (2, True), (79, True), (80, False)])
def test_borders_are_named_where_they_are_drawn(moves: int, shown: bool) -> None:
    borders = MoveBorders(np.arange(moves + 1.0), tuple(range(moves)), ("move",) * moves)
    assert ("border of moves" in named(picture(borders=borders))) is shown
    planes = PanelBlock((panel([0, 1]),), 1, over_time=False)
    assert "border of moves" not in named(picture(borders=borders, blocks=(planes,)))
    assert MoveTitles(picture(borders=borders, blocks=(planes,)), 8.0).height == 0
    assert MoveTitles(picture(borders=borders), 8.0).height > 0
    assert MoveTitles(picture(), 8.0).height == 0


def test_a_legend_has_rows_for_all_its_entries() -> None:
    """Each name has the room of the longest, beside its sample."""
    for count in (1, 4, 5, 11):
        names = tuple("file" + "x" * k for k in range(count))
        step = text_width(names[-1], 8.0) + 0.65
        columns = int((6.0 - 0.4) / step)
        assert Legend(picture(sources=names), 6.0).height == pytest.approx(
            0.2 * -(-count // columns) + 0.1, abs=0.001
        )
        sheet = Sheet(Figure(figsize=(6.0, 3.0)), 6.0, 3.0)
        Legend(picture(sources=names), 6.0).draw(sheet, 0.5)
        places = [
            (text.get_text(), 6 * text.get_position()[0], 3 - 3 * text.get_position()[1])
            for text in sheet.figure.texts
        ]
        assert [name for name, _, _ in places] == list(names)
        assert [y for _, _, y in places] == pytest.approx([0.6 + 0.2 * (k // columns) for k in range(count)])
        assert len({(round(x, 3), round(y, 3)) for _, x, y in places}) == count
        samples = [line.get_color() for line in sheet.figure.findobj(Line2D)]
        assert samples == [style_of(k)["color"] for k in range(count)]


def test_titles_of_moves_stand_row_by_row() -> None:
    borders = MoveBorders(
        np.array([0.0, 1.0, 2.5]), (0, 2), ("pick", "place"), ((1.0, 1, "attach"), (2.5, 3, "detach"))
    )
    titles = MoveTitles(picture(borders=borders), 3.0)
    sheet = Sheet(Figure(figsize=(3.0, 3.0)), 3.0, 3.0)
    titles.draw(sheet, 0.5)
    texts = [text.get_text() for text in sheet.figure.texts]
    assert texts == ["0 pick", "\u25be1 attach, 1 s", "2 place", "\u25be3 detach, 2.5 s"]
    rows = sorted({round(3 - 3 * text.get_position()[1], 4) for text in sheet.figure.texts})
    assert titles.height == pytest.approx(0.155 * len(rows) + 0.08)
    assert rows[0] == pytest.approx(0.5 + 0.0775)
    first, second, third, _ = (text.get_position() for text in sheet.figure.texts)
    assert (second[1], third[0]) == (first[1], first[0])
    assert second[0] > first[0]


@pytest.mark.parametrize(("count", "small"), [(60, False), (61, True)])
def test_many_markers_are_small(count: int, small: bool) -> None:
    kinds = (WAYPOINT, VIRTUAL_POINT, FINDING, START, MARKED)
    assert len({kind["marker"] for kind in kinds}) == len(kinds)
    style = marker_style(WAYPOINT, count)
    assert style["markersize"] == (1.5 if small else 3.5)
    assert (style["marker"], style["markerfacecolor"]) == ("o", "white")


def test_the_first_source_is_the_thickest_and_continuous() -> None:
    assert (style_of(0)["linewidth"], style_of(0)["linestyle"]) == (1.2, "-")
    assert {style_of(k)["linewidth"] for k in range(1, 20)} == {1.0}
    assert len({(style_of(k)["color"], str(style_of(k)["linestyle"])) for k in range(24)}) == 24


def test_a_panel_without_markers_has_none() -> None:
    bare = panel([0.0])
    assert all(marks is NO_POINTS for marks in (bare.waypoints, bare.virtual_points, bare.findings))
    assert NO_POINTS.shape == (0, 2)
