"""Nearest names."""

from __future__ import annotations

import pytest

from trajcli.suggest import did_you_mean, nearest, nearest_names, valid_names

PLANNERS = ["cubic", "quintic", "septic", "jerk_limited", "hold"]


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("quintc", "quintic"),
        ("Quintic", "quintic"),
        ("jerk-limited", "jerk_limited"),
        ("jerk limited", "jerk_limited"),
        ("jerklimited", "jerk_limited"),
        ("xyz", None),
        ("", None),
        ("quintic" * 10_000, None),
    ],
)
def test_nearest(name: str, near: str | None) -> None:
    assert nearest(name, PLANNERS) == near
    assert did_you_mean(name, PLANNERS) == (f"did you mean '{near}'?" if near else None)


def test_valid_names() -> None:
    assert valid_names(PLANNERS) == "valid names: cubic, quintic, septic, jerk_limited, hold"
    assert valid_names(["deg", "rad"], "angles") == "angles: deg, rad"
    assert valid_names([]) is None
    many = valid_names(f"p{i}" for i in range(40))
    assert many is not None
    assert many.endswith("p23 ... (16 more)")


def test_the_nearest_names_are_told_however_far_they_are() -> None:
    assert nearest_names("quintc", PLANNERS)[0] == "quintic"
    assert nearest_names("cube", PLANNERS, 1) == ["cubic"]
    assert len(nearest_names("xyz", PLANNERS)) == 3
    assert set(nearest_names("?" * 10_000, PLANNERS, 9)) == set(PLANNERS)
