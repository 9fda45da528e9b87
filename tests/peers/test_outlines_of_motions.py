"""What is compared of a recorded motion: its ends with their rounding, and points of rows block by block."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.peers import geometric_path, motion_reference
from trajcli.peers.motion_reference import MotionReference, compared
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

LIMITS = replace(unlimited(1), velocity=np.array([[-1.0, 1.0]]), acceleration=np.array([[-2.0, 2.0]]))
ARM = Robot("arm", (Joint("a"),), LIMITS, None, np.eye(4), np.eye(4))
EXACT = Resolution(0.0, np.zeros(1), np.zeros(1), np.zeros(1))


@dataclass(frozen=True)
class Judged:
    verdict: str
    rows: int
    findings: tuple[Any, ...] = ()


def rows_of(
    t: np.ndarray, q: np.ndarray, *, rates: bool = True, resolution: Resolution = EXACT
) -> RecordedMotion:
    """Return rows of one joint that stands still in each, where it says so."""
    zero = np.zeros((t.size, 1)) if rates else None
    return RecordedMotion(t, q.reshape(-1, 1), zero, zero, None, None, None, ("a",), resolution, "rows.csv")


def compare(
    motion: RecordedMotion, size: int = 1000, verdict: str = "satisfied"
) -> tuple[Any, MotionReference]:
    """Return the comparison of rows that are read `size` at a time."""

    def blocks() -> Any:
        for low in range(0, motion.t.size, size):
            part = slice(low, low + size)
            rates = [None if each is None else each[part] for each in (motion.qd, motion.qdd)]
            yield replace(
                motion, t=motion.t[part], q=motion.q[part], qd=rates[0], qdd=rates[1], first_row=low + 1
            )

    checked = SimpleNamespace(
        motion=SimpleNamespace(blocks=blocks), judgement=Judged(verdict, motion.t.size), robot=ARM
    )
    return compared(checked)  # type: ignore[arg-type]


def between(duration: float, distance: float, start: float = 0.0, **more: Any) -> RecordedMotion:
    """Return two rows: from rest at 0 to rest at a distance, which takes distance + 1/2 s at least."""
    return rows_of(start + np.array([0.0, duration]), np.array([0.0, distance]), **more)


@pytest.mark.parametrize("start", [0.0, 50.0, -3.0])
def test_a_motion_from_rest_to_rest_that_is_too_fast_is_found_in_its_last_row(start: float) -> None:
    judged, found = compare(between(3.4, 3.0, start))
    assert (found.duration, found.reference.duration) == (pytest.approx(3.4), pytest.approx(3.5))
    (finding,) = judged.findings
    assert (finding.row, finding.joint, finding.time) == (2, "a", start + 3.4)
    assert (finding.value, finding.limit) == (pytest.approx(3.4), pytest.approx(3.5))
    for same in (between(3.5, 3.0, start), between(3.4, 3.0, start, rates=False)):
        assert compare(same)[0].findings == ()
    assert compare(between(3.4, 3.0, start), verdict="within rounding")[0].findings == ()


@pytest.mark.parametrize("distance", [3.0, -3.0])
@pytest.mark.parametrize(
    ("resolution", "late"),
    [
        (replace(EXACT, q=np.array([1e-3])), 2e-3),
        (replace(EXACT, time=1e-3), 2e-3),
        (replace(EXACT, relative=(1e-3, 0.0, 0.0)), 3e-3),
        (replace(EXACT, relative_time=1e-3), 2 * 3.5e-3),
    ],
)
def test_what_both_ends_may_be_rounded_by_is_no_contradiction(
    resolution: Resolution, late: float, distance: float
) -> None:
    for share, count in ((0.99, 0), (1.05, 1)):
        motion = between(3.5 - share * late, distance, resolution=resolution)
        assert len(compare(motion)[0].findings) == count


def test_of_an_end_with_an_acceleration_nothing_is_proven() -> None:
    motion = between(3.4, 3.0)
    assert motion.qdd is not None
    for row in (0, 1):
        rates = motion.qdd.copy()
        rates[row] = 1.0
        assert compare(replace(motion, qdd=rates))[0].findings == ()


@pytest.mark.parametrize("size", [7, 10, 100])
def test_every_so_many_rows_of_all_blocks_and_the_last_one_say_the_path(
    size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 48 rows at most ten and the last: every fifth."""
    taken: list[np.ndarray] = []
    monkeypatch.setattr(motion_reference, "_MOST_ROWS", 10)
    monkeypatch.setattr(geometric_path, "path_of_points", taken.append)
    k = np.arange(48.0)
    _, found = compare(rows_of(0.1 * k, k), size)
    assert taken[0].ravel().tolist() == [*k[::5].tolist(), 47.0]
    assert found.duration == pytest.approx(4.7)
    assert found.path_reference is None


def test_along_its_points_a_motion_has_the_velocities_of_its_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def along(*arguments: Any) -> None:
        asked.append(arguments)

    monkeypatch.setattr(motion_reference, "reference_along", along)
    motion = rows_of(np.arange(5.0), np.arange(5.0))
    compare(replace(motion, qd=np.linspace(0.1, 0.9, 5)[:, None]), 2)
    ((path, limits, ends),) = asked
    assert path.path.end == pytest.approx(4.0)
    assert limits is ARM.limits
    assert [end.tolist() for end in ends] == [[0.1], [0.9]]
