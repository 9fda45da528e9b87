"""What `explain` says of the points that a move passes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_MOST = 20  # points that are listed one by one
_ROUNDING = 1e-12  # in units of the job: what is missed by less is met


def passing_lines(move: Mapping[str, Any]) -> Iterator[str]:
    """Yield when the points are passed, by how much beside, and where the curve leaves their range."""
    if move["origin"]:
        whole = f"from {-move['origin']:.6g} to {move['duration'] - move['origin']:.6g}"
        yield f"  unshifted times: t - {move['origin']:.10g} s, {whole}"
    passed = move["waypoints"]
    if passed is not None:
        yield from _points(passed, move["joints"], move["origin"])
    for one in move["outside"] or ():
        way = "above" if one["beyond"] > 0 else "below"
        size = f"{abs(one['beyond']):.6g} {one['unit']}"
        yield f"  {one['joint']} goes {size} {way} the points at t = {one['time']:.6g} s"


def _points(passed: list[dict[str, Any]], joints: list[str], origin: float) -> Iterator[str]:
    times = ", ".join(f"{point['time'] - origin:.6g}" for point in passed[:_MOST])
    more = f", ... {passed[-1]['time'] - origin:.6g}" if len(passed) > _MOST else ""
    yield f"  {len(passed)} points at (s{', unshifted' * bool(origin)}): {times}{more}"
    if not any(any(point["missed"]) for point in passed):
        return
    for joint, name in enumerate(joints):
        missed = [value if value > _ROUNDING else 0.0 for value in (p["missed"][joint] for p in passed)]
        if any(missed):
            listed = ", ".join(f"{value:.6g}" for value in missed[:_MOST])
            more = f", ... at most {max(missed):.6g}" if len(passed) > _MOST else ""
            yield f"  {name} passes them at a distance of ({passed[0]['units'][joint]}): {listed}{more}"
