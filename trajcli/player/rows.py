"""Rows of an animated motion: 60 frames a second, both sides of visible jumps, packed as small integers."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import EFFORT
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.frozen import frozen

FRAMES = 60.0  # Hz: what screens show
MOST_ROWS = 24_000  # of a page: a longer motion has fewer frames a second
ORDERS = ("q", "qd", "qdd", "qddd")

_BYTES: dict[str, int] = {"q": 3, EFFORT: 3}
"""Of a packed number, else 2: an arm is drawn to a tenth of a micrometre, a plot to a pixel."""
_SEEN = 1e-3  # of the largest magnitude of a derivative: a smaller jump cannot be seen in a plot
_BYTES_A_FRAME = 140.0  # what a frame may take, so that ten seconds of any arm fit into 0.8 MB
_JUMPS = (0.05, 0.5)  # jumps a frame, at most, of an arm of many joints and of few: the largest are kept


@frozen
class DrawnRows:
    """Joint values and their derivatives on rows of times; where a derivative jumps, two rows have one time.

    Attributes:
        times: Shape (N,), s, never decreasing.
        values: By "q", "qd", "qdd", "qddd", "tau", as far as known, (N, n), SI.
    """

    times: Array
    values: Mapping[str, Array]

    def packed(self) -> dict[str, Any]:
        """Return what the page unpacks: base64 of little-endian numbers, joint after joint."""
        quantities = {name: packed(values.T, _BYTES.get(name, 2)) for name, values in self.values.items()}
        return {"times": _base64(self.times.astype("<f8")), "quantities": quantities}


def frame_times(start: float, end: float) -> Array:
    """Return the times of frames from `start` to `end`, both among them, shape (N,), s."""
    rate = min(FRAMES, 0.5 * MOST_ROWS / max(end - start, 1e-9))
    frames = start + np.arange(int((end - start) * rate * (1 + 1e-12)) + 1) / rate
    return distinct(np.append(frames, end))


def rows_of_curve(curve: PiecewisePolynomial, borders: Sequence[float], extra: Sequence[float]) -> DrawnRows:
    """Return the rows of a curve: of its frames, both sides of its jumps, and of some times more.

    Args:
        curve: q(t).
        borders: Breaks that have two rows whatever happens there: where moves meet, s.
        extra: Times that have a row, such as those of findings, s.
    """
    frames = frame_times(curve.start, curve.end)
    jumps = _visible_jumps(
        curve, np.array(borders), upper=int(_jumps_a_frame(curve.dimension) * frames.size) + len(borders)
    )
    single = np.append(frames, np.clip(extra, curve.start, curve.end))
    single = distinct(single[~_among(single, jumps)])
    times = np.concatenate([single, jumps, jumps])
    after = np.append(np.ones(single.size + jumps.size, dtype=bool), np.zeros(jumps.size, dtype=bool))
    order = np.lexsort((after, times))
    times, after = times[order], after[order]
    both = [curve.evaluate_orders(times, range(len(ORDERS)), side=side) for side in ("left", "right")]
    values = np.where(after[:, None, None], both[1], both[0])
    return DrawnRows(times, {name: values[:, k] for k, name in enumerate(ORDERS)})


def _jumps_a_frame(joints: int) -> float:
    bytes_of_row = 16 + sum(_BYTES.get(name, 2) for name in ORDERS) * joints  # 16: time, tool, its speed
    least, upper = _JUMPS
    return min(max(0.5 * (_BYTES_A_FRAME / bytes_of_row - 1), least), upper)


def _visible_jumps(curve: PiecewisePolynomial, borders: Array, upper: int) -> Array:
    """Return the inner breaks where a derivative jumps visibly, and those of `borders`; shape (k,), s."""
    inner = curve.breaks[1:-1]
    size = np.zeros(inner.size)
    for order in range(1, len(ORDERS)):
        begins, ends = curve.piece_ends(order)
        largest = np.maximum(np.abs(begins).max(axis=0), np.abs(ends).max(axis=0))
        jump = np.abs(begins[1:] - ends[:-1]) / np.where(largest > 0, largest, 1.0)
        size = np.maximum(size, jump.max(axis=1))
    size[_among(inner, np.sort(borders))] = np.inf
    largest_first = np.argsort(-size, kind="stable")[:upper]
    return np.sort(inner[largest_first[size[largest_first] > _SEEN]])


def _among(values: Array, members: Array) -> NDArray[np.bool_]:
    """Return which values are among the members, which are sorted; `np.isin` would load masked arrays."""
    if not members.size:
        return np.zeros(values.size, dtype=bool)
    nearest = members[np.searchsorted(members, values).clip(max=members.size - 1)]
    return np.asarray(nearest == values)


def rows_of_samples(times: Array, values: Mapping[str, Array]) -> tuple[DrawnRows, NDArray[np.intp]]:
    """Return rows of a file that are enough for a page, and their indices: every row, where they are few.

    Args:
        times: Shape (N,), s, strictly increasing.
        values: As in `DrawnRows`.
    """
    wanted = frame_times(float(times[0]), float(times[-1]))
    if times.size <= (1 + 2 * _jumps_a_frame(values["q"].shape[1])) * wanted.size:
        return DrawnRows(times, values), np.arange(times.size)
    marked = np.zeros(times.size, dtype=bool)
    marked[np.searchsorted(times, wanted).clip(0, times.size - 1)] = True
    for each in values.values():
        marked[each.argmin(axis=0)] = marked[each.argmax(axis=0)] = True
    kept = np.flatnonzero(marked)
    return DrawnRows(times[kept], {name: each[kept] for name, each in values.items()}), kept


def packed(columns: Array, width: int = 2) -> dict[str, Any]:
    """Return columns (m, N) as unsigned integers of `width` bytes between the extremes of each column."""
    low, high = columns.min(axis=1), columns.max(axis=1)
    steps = 256.0**width - 1
    scale = np.where(high > low, steps / np.where(high > low, high - low, 1.0), 0.0)
    levels = np.ascontiguousarray(
        np.rint((columns - low[:, None]) * scale[:, None]).clip(0, steps), dtype="<u4"
    )
    bytes_of_levels = levels.view(np.uint8).reshape(*levels.shape, 4)[:, :, :width]
    return {
        "values": _base64(bytes_of_levels),
        "width": width,
        "low": low.tolist(),
        "high": high.tolist(),
    }


def _base64(array: NDArray[Any]) -> str:
    return b64encode(np.ascontiguousarray(array).tobytes()).decode()
