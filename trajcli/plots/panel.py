"""Panels of a picture as numbers: traces, limits, markers, labels with units, before anything is drawn."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

NO_POINTS = np.empty((0, 2))
"""The markers of a panel without any."""


@frozen
class Trace:
    """A line of a panel, of one source; NaN interrupts it.

    Attributes:
        source: Index of the source in the legend.
        x: Shape (N,), in the unit of the axis; two points of one x make a vertical step.
        y: Shape (N,).
    """

    source: int
    x: Array
    y: Array


@frozen
class Panel:
    """One pair of axes.

    Attributes:
        title: Whose values these are.
        x_label: Name and unit.
        y_label: Name and unit.
        traces: In the order of the sources.
        limits: Points (m, 2) of lines, NaN where there is no limit: the lower and the upper one.
        waypoints: Markers, shape (k, 2).
        virtual_points: Markers, shape (k, 2).
        findings: When a check fails, and the value there, shape (k, 2); NaN where it is about another panel.
        unlimited: Whether a limit could stand here and none does.
    """

    title: str
    x_label: str
    y_label: str
    traces: tuple[Trace, ...]
    limits: tuple[Array, ...] = ()
    waypoints: Array = field(default_factory=lambda: NO_POINTS)
    virtual_points: Array = field(default_factory=lambda: NO_POINTS)
    findings: Array = field(default_factory=lambda: NO_POINTS)
    unlimited: bool = False


@frozen
class PanelBlock:
    """Panels of one kind, side by side and below each other.

    Attributes:
        panels: Row by row.
        columns: Number of panels in a row.
        headings: One for each column; empty where the titles say it all.
        over_time: Whether x is the time of all, so that the borders of moves are drawn.
        flat: Whether a panel is low, as those of one joint, and not as high as a plane needs.
    """

    panels: tuple[Panel, ...]
    columns: int
    headings: tuple[str, ...] = ()
    over_time: bool = True
    flat: bool = True


@frozen
class PathViews:
    """A path of the tool, in space and from three sides.

    Attributes:
        unit: Of all axes.
        traces: Index of the source, and positions (N, 3) in world.
        waypoints: Positions of the tool at the ends of moves and at points between, shape (k, 3).
        zones: Corners and radii of the balls within which the tool flies by, shape (k, 4).
        programmed: Positions (N, 3) along the programmed path within each zone.
        named: Names of points and where the tool is there, (3,).
    """

    unit: str
    traces: tuple[tuple[int, Array], ...]
    waypoints: Array
    zones: Array = field(default_factory=lambda: np.empty((0, 4)))
    programmed: tuple[Array, ...] = ()
    named: tuple[tuple[str, Array], ...] = ()


@frozen
class MoveBorders:
    """Borders of moves.

    Attributes:
        times: As written in the rows, shape (m + 1,), s.
        indices: Of each in its job, m of them.
        titles: Of each.
        marks: Time, index and title of what takes no time, such as attach and detach.
    """

    times: Array
    indices: tuple[int, ...]
    titles: tuple[str, ...]
    marks: tuple[tuple[float, int, str], ...] = ()


@frozen
class Picture:
    """All that is drawn.

    Attributes:
        title: One line.
        sources: Of the traces, as the legend calls them.
        blocks: From top to bottom.
        views: Of the path of the tool; None where it is not drawn.
        borders: Of the moves; None where only files are drawn.
    """

    title: str
    sources: tuple[str, ...]
    blocks: tuple[PanelBlock, ...]
    views: PathViews | None = None
    borders: MoveBorders | None = None
