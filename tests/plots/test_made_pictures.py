"""Figures of pictures that are put together by hand: where panels stand, what range they show, and what is in which."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from trajcli.plots.figure import figure_of
from trajcli.plots.legend import MOST_BORDERS
from trajcli.plots.panel import MoveBorders, Panel, PanelBlock, Picture, Trace
from trajcli.plots.write import settings

TIMES = np.linspace(2.0, 6.0, 9)
BORDERS = MoveBorders(np.array([2.0, 3.0, 5.5, 6.0]), (10, 12, 13), ("a", "b", "c"), ((3.0, 11, "attach"),))
NAN = float("nan")


def panel(title: str, y: np.ndarray = TIMES, x: np.ndarray = TIMES, **more: object) -> Panel:
    return Panel(title, "t [s]", "q [rad]", (Trace(0, x, y),), **more)  # type: ignore[arg-type]


FIVE = PanelBlock(tuple(panel(f"p{k}", TIMES + k) for k in range(5)), 2, ("left", "right"))
LIMIT = np.array([[0.0, 1.0], [1.0, 50.0], [2.0, NAN], [3.0, 1.5]])
PLANES = PanelBlock(
    tuple(
        Panel(
            f"plane {k}",
            "s [m]",
            "sd [m/s]",
            (Trace(0, np.array([0.0, 3.0]), np.array([0.0, 2.0 + k])),),
            (LIMIT,),
        )
        for k in range(2)
    ),
    2,
    over_time=False,
    flat=False,
)


def drawn(*blocks: PanelBlock, borders: MoveBorders | None = None) -> Figure:
    with rc_context({**settings(), "figure.dpi": 100}):
        return figure_of(Picture("title", ("plan",), blocks, None, borders))


def lines(figure: Figure, part: str) -> dict[int, list[np.ndarray]]:
    """Return the points (2, N) of the lines of a part by the number of their panel."""
    found: dict[int, list[np.ndarray]] = {}
    for line in figure.findobj(Line2D):
        name, _, rest = str(line.get_gid()).partition("-")
        if rest == part:
            found.setdefault(int(name.removeprefix("panel")), []).append(np.array(line.get_data(orig=True)))
    return found


def boxes(figure: Figure) -> list[tuple[float, float, float, float]]:
    """Return left, right, bottom and top of each frame, inches from the lower left corner."""
    frames = lines(figure, "frame")
    assert sorted(frames) == list(range(len(frames)))
    return [
        (*(float(part) for part in (x[:5].min(), x[:5].max(), y[:5].min(), y[:5].max())),)
        for x, y in (frames[k][0] for k in range(len(frames)))
    ]  # type: ignore[misc]


def range_of(figure: Figure, number: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ranges of x and y that a panel shows, from where its line is drawn."""
    line = next(each for each in figure.findobj(Line2D) if each.get_gid() == f"panel{number}-source0")
    left, right, bottom, top = boxes(figure)[number]
    corners = (
        (line.get_transform() - figure.dpi_scale_trans).inverted().transform([(left, bottom), (right, top)])
    )
    return tuple(corners[:, 0]), tuple(corners[:, 1])  # type: ignore[return-value]


def texts(figure: Figure) -> dict[str, list[tuple[float, float]]]:
    """Return where texts stand, inches from the lower left corner."""
    found: dict[str, list[tuple[float, float]]] = {}
    for text in figure.findobj(Text):
        x, y = np.array(text.get_position()) * figure.get_size_inches()
        found.setdefault(text.get_text(), []).append((float(x), float(y)))
    return found


def test_panels_stand_in_rows_and_columns_without_touching() -> None:
    """Three rows of two, and the planes below them; all inside the figure, with room for what is written below."""
    figure = drawn(FIVE, PLANES, borders=BORDERS)
    found = boxes(figure)
    width, height = figure.get_size_inches()
    assert len(found) == 7
    for a, (left, right, bottom, top) in enumerate(found):
        assert 0 < left < right < width
        assert 0.3 < bottom < top < height
        for other in found[a + 1 :]:
            assert right < other[0] or other[1] < left or top < other[2] or other[3] < bottom
    assert [box[0] for box in found] == pytest.approx(
        [found[0][0], found[1][0]] * 2 + [found[0][0]] * 2 + [found[1][0]]
    )
    tops = [box[3] for box in found]
    assert tops[0] == tops[1] > tops[2] == tops[3] > tops[4] > tops[5] == tops[6]
    assert found[5][3] - found[5][2] > 1.5 * (found[0][3] - found[0][2])  # a plane is high
    shown = texts(figure)
    for text, number in (("left", 0), ("right", 1)):
        ((x, y),) = shown[text]
        assert (x, y > found[number][3]) == (pytest.approx(found[number][0]), True)
    for number in range(5):
        ((x, y),) = shown[f"p{number}"]
        assert found[number][0] - 0.01 <= x < found[number][1]
        assert found[number][3] < y < found[number][3] + 0.35


def test_many_rows_are_lower() -> None:
    few, many = (boxes(drawn(PanelBlock(tuple(panel(str(k)) for k in range(rows)), 1))) for rows in (4, 5))
    assert few[0][3] - few[0][2] > many[0][3] - many[0][2]


def test_numbers_stand_below_the_lowest_panels_and_below_every_plane() -> None:
    """Of five panels in two columns below the last of each column."""
    figure = drawn(FIVE, PLANES)
    found, labels = boxes(figure), texts(figure)
    below = sorted((x, y) for x, y in labels["t [s]"])
    expected = sorted(((found[k][0] + found[k][1]) / 2, found[k][2] - 0.2) for k in (3, 4))
    assert below == [pytest.approx(each, abs=0.05) for each in expected]
    assert len(labels["s [m]"]) == 2


def test_all_panels_of_a_block_show_all_its_times() -> None:
    """Of a file that begins before and ends after the moves."""
    early = panel("early", np.zeros(2), np.array([1.0, 9.0]))
    figure = drawn(PanelBlock((panel("p"), early), 2), borders=BORDERS)
    for number in range(2):
        low, high = range_of(figure, number)[0]
        assert (low, high) == pytest.approx((1 - 0.08, 9 + 0.08))
    late = drawn(PanelBlock((panel("p", np.zeros(2), np.array([3.0, 4.0])),), 1), borders=BORDERS)
    assert range_of(late, 0)[0] == pytest.approx((2 - 0.04, 6 + 0.04))
    one = drawn(PanelBlock((panel("one row", np.array([1.0]), np.array([5.0])),), 1))
    assert range_of(one, 0)[0] == pytest.approx((4.5, 5.5))


def test_a_plane_shows_the_law_and_as_much_of_its_limit_as_is_near() -> None:
    """Twice the law at most, zero at least; where no limit is finite the law alone."""
    figure = drawn(FIVE, PLANES)
    for number, top in ((5, 2.0), (6, 3.0)):
        x, y = range_of(figure, number)
        assert x == pytest.approx((-0.03, 3.03))
        assert y == pytest.approx((0.0, 1.06 * 2 * top))
    for limit, high in ((np.array([[0.0, NAN], [1.0, NAN]]), 2.0), (np.array([[0.0, 2.5], [1.0, 1.0]]), 2.5)):
        plane = Panel(
            "plane", "s [m]", "sd [m/s]", (Trace(0, np.array([0.0, 1.0]), np.array([0.0, 2.0])),), (limit,)
        )
        alone = drawn(PanelBlock((plane,), 1, over_time=False, flat=False))
        assert range_of(alone, 0)[1] == pytest.approx((0.0, 1.06 * high))


def test_borders_stand_between_moves_in_every_panel_and_their_indices_above_the_first_row() -> None:
    figure = drawn(FIVE, PLANES, borders=BORDERS)
    borders = lines(figure, "borders")
    assert sorted(borders) == [0, 1, 2, 3, 4]
    for (points,) in borders.values():
        assert points[0].tolist() == [3.0, 3.0, 3.0, 5.5, 5.5, 5.5]
    found, shown = boxes(figure), texts(figure)
    for column in range(2):
        left, right, _, top = found[column]
        (low, high), _ = range_of(figure, column)
        x, y = shown["12"][column]
        assert x == pytest.approx(left + (4.25 - low) / (high - low) * (right - left))
        assert y > top
    assert sorted(lines(figure, "marks")) == [0, 1]
    assert lines(figure, "marks")[0][0][0].tolist() == [3.0]
    alone = MoveBorders(np.array([2.0, 6.0]), (0,), ("a",))
    assert lines(drawn(FIVE, borders=alone), "borders") == {}


def test_markers_and_limits_are_at_their_values_and_what_is_of_another_panel_is_a_time_alone() -> None:
    limits = (np.array([[2.0, -3.0], [6.0, -3.0]]), np.array([[2.0, 4.0], [6.0, 5.0]]))
    findings = np.array([[3.0, 4.5], [3.0, NAN], [5.0, NAN]])
    of_all = panel(
        "p",
        limits=limits,
        waypoints=np.array([[2.0, 0.0], [4.0, 1.0]]),
        virtual_points=np.array([[3.0, 2.0]]),
        findings=findings,
    )
    figure = drawn(PanelBlock((of_all, panel("none")), 2))
    assert [line.tolist() for line in lines(figure, "limit")[0]] == [limit.T.tolist() for limit in limits]
    assert lines(figure, "waypoints")[0][0].tolist() == [[2.0, 4.0], [0.0, 1.0]]
    assert lines(figure, "virtual-points")[0][0].tolist() == [[3.0], [2.0]]
    assert lines(figure, "findings")[0][0].tolist() == [[3.0], [4.5]]
    assert lines(figure, "finding-times")[0][0][0].tolist() == [3.0] * 3 + [5.0] * 3
    for part in ("limit", "waypoints", "virtual-points", "findings", "finding-times"):
        assert sorted(lines(figure, part)) == [0]
    styles = {
        part: next(line for line in figure.findobj(Line2D) if line.get_gid() == f"panel0-{part}")
        for part in ("waypoints", "virtual-points", "findings")
    }
    assert len({(line.get_marker(), line.get_markerfacecolor()) for line in styles.values()}) == 3


@pytest.mark.parametrize(("start", "fewest"), [(0.0, 3), (1.7e9, 1)])
def test_numbers_at_times_since_1970_have_room(start: float, fewest: int) -> None:
    """Wide numbers are fewer, so that they do not touch."""
    four = PanelBlock(tuple(panel(str(k), TIMES, start + TIMES / 1e3) for k in range(5)), 5)
    figure = drawn(four)
    left, right, bottom, _ = boxes(figure)[0]
    numbers = sorted(
        x
        for text, places in texts(figure).items()
        for x, y in places
        if text.replace(".", "").isdigit() and left - 0.1 < x < right + 0.1 and y < bottom
    )
    assert len(numbers) >= fewest
    characters = 0.05 * (14 if start else 6)
    assert all(b - a > characters for a, b in pairwise(numbers))


@pytest.mark.parametrize(("columns", "inches"), [(1, 6.2), (2, 4.3), (3, 3.2), (4, 2.8), (5, 2.5)])
def test_panels_are_as_wide_as_their_number_lets_them(columns: int, inches: float) -> None:
    """And below the lowest there is room for its numbers and the label: 0.55 inches."""
    block = PanelBlock(tuple(panel(str(k)) for k in range(columns)), columns)
    for left, right, bottom, _ in boxes(drawn(block)):
        assert right - left == pytest.approx(inches)
        assert bottom == pytest.approx(0.55)


def test_of_very_many_moves_no_border_is_drawn() -> None:
    many = MoveBorders(
        np.linspace(2.0, 6.0, MOST_BORDERS + 1), tuple(range(MOST_BORDERS)), ("",) * MOST_BORDERS
    )
    assert lines(drawn(FIVE, borders=many), "borders") == {}
    fewer = MoveBorders(many.times[1:], many.indices[1:], many.titles[1:])
    assert len(lines(drawn(FIVE, borders=fewer), "borders")) == 5


def test_a_law_above_its_limit_is_shown_whole() -> None:
    plane = Panel(
        "plane",
        "s [m]",
        "sd [m/s]",
        (Trace(0, np.array([0.0, 1.0]), np.array([0.0, 2.0])),),
        (np.array([[0.0, 1.0], [1.0, 0.5]]),),
    )
    assert range_of(drawn(PanelBlock((plane,), 1, over_time=False, flat=False)), 0)[1] == pytest.approx(
        (0.0, 2.12)
    )
