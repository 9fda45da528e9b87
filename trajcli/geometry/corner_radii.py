"""Corner radii: where there is something to round, and what fits into the segments between corners."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError, Problem
from trajcli.geometry.corner import SAME_DIRECTION, curvature_jumps, room_for_radius, turn_between
from trajcli.geometry.place_curve import SAME_PLACE, PlaceCurve, metres

Kind = Literal["smooth", "bend", "stop", "rounded"]


def sharp_kind(before: PlaceCurve, after: PlaceCurve) -> Kind:
    """Return what a corner is as long as nothing is rounded."""
    if turn_between(before, after) > SAME_DIRECTION:
        return "stop"
    return "bend" if curvature_jumps(before, after) else "smooth"


def asked_radii(radii: ArrayLike, corners: int) -> list[float]:
    """Return a radius for each corner, m.

    Raises:
        InputError: When the number is wrong, or one is neither 0 nor positive.
    """
    given = np.asarray(radii, dtype=np.float64)
    if given.ndim and given.shape != (corners,):
        raise InputError(f"the path has {corners} corners, there are {given.size} radii", hint="one for each")
    wrong = given[~(np.isfinite(given) & ((given == 0.0) | (given > SAME_PLACE)))]
    if wrong.size:
        text = "a corner radius must be 0 (stop there) or more than {least}, it is {given}"
        amounts = {"least": metres(SAME_PLACE), "given": metres(wrong[0])}
        raise InputError(Problem(text, amounts=amounts))
    return [float(radius) for radius in np.broadcast_to(given, (corners,))]


def fitting_radii(
    segments: Sequence[PlaceCurve], kinds: Sequence[Kind], asked: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return the radii, m, that fit where there is something to round, and those that fit where there is not.

    Neighbours share a segment that is too short, one that needs less than half leaves the rest to the other;
    a corner that goes on smoothly, over which only a rotation is to fade into the next one, gets what is
    left.

    Args:
        segments: k of them.
        kinds: Of the k - 1 corners.
        asked: Their radii, m.
    """
    wanted = [
        0.0 if kind == "smooth" or radius == 0.0 else min(radius, room_for_radius(*pair))
        for radius, kind, pair in zip(asked, kinds, pairwise(segments), strict=True)
    ]
    cut = _fitting(segments, wanted, [0.0] * len(asked))
    rest = [radius if kind == "smooth" else 0.0 for radius, kind in zip(asked, kinds, strict=True)]
    return cut, _fitting(segments, rest, cut)


def _fitting(segments: Sequence[PlaceCurve], wanted: Sequence[float], taken: Sequence[float]) -> list[float]:
    """Return the radii that fit into what is left of the segments by radii that were taken before."""
    around, gone = [0.0, *wanted, 0.0], [0.0, *taken, 0.0]
    result = []
    for i, radius in enumerate(wanted):
        free = [
            segment.length - gone[other] - min(around[other], segment.length / 2.0)
            for segment, other in ((segments[i], i), (segments[i + 1], i + 2))
        ]
        fits = min(radius, *free)
        result.append(fits if fits > SAME_PLACE else 0.0)
    return result
