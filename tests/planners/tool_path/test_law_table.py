"""What each time law says of itself, against finite differences of its curve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.errors import MissingLimitError
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_path.law import LAWS, LawSpec, PathBounds, PathDerivatives, law_bounds

LENGTH = 0.7
BOUNDS = PathBounds(0.5, 2.0, 2.0, 30.0)
SEGMENTED = [shape for shape, law in LAWS.items() if not law.uses_joint_limits]
STRAIGHT = PathDerivatives(True, 0.0, 0.0, 0.0)
NEEDS = {"trapezoid": {"acceleration"}, "jerk_limited": {"speed", "acceleration", "jerk"}}
SMOOTH = {"quintic", "cycloidal", "jerk_limited"}
LIMITS = ToolLimits(speed=0.5, acceleration=2.0, jerk=30.0)


def test_the_table_names_each_law_by_its_shape() -> None:
    assert set(LAWS) == {"trapezoid", "cubic", "quintic", "cycloidal", "jerk_limited", "time_optimal"}
    assert all(law.shape == shape for shape, law in LAWS.items())
    assert {shape for shape, law in LAWS.items() if law.continuity == 2} == SMOOTH


@pytest.mark.parametrize("shape", SEGMENTED)
def test_a_law_goes_from_rest_to_rest_with_its_continuity(shape: str) -> None:
    segment = LAWS[shape].segment(LawSpec(shape=shape), LENGTH, BOUNDS, None)
    duration, step = segment.law.duration, 1e-5
    ends = np.array([[0.0, step, 2 * step], [duration, duration - step, duration - 2 * step]])
    s = segment.law.evaluate(ends.ravel())[:, 0].reshape(2, 3)
    np.testing.assert_allclose(s[:, 0], [0.0, LENGTH], atol=1e-12)
    assert np.abs(s[:, 1] - s[:, 0]).max() < 5 * BOUNDS.acceleration * step**2
    acceleration = np.abs(s[:, 2] - 2 * s[:, 1] + s[:, 0]) / step**2
    if shape in SMOOTH:
        assert acceleration.max() < 2 * BOUNDS.jerk * step + 1e-4
    else:
        assert acceleration.min() > 0.1 * BOUNDS.acceleration


@pytest.mark.parametrize("shape", SEGMENTED)
def test_the_fastest_law_meets_a_bound_and_exceeds_none(shape: str) -> None:
    segment = LAWS[shape].segment(LawSpec(shape=shape), LENGTH, BOUNDS, None)
    step = segment.law.duration / 20000
    s = segment.law.evaluate(np.arange(20001) * step)[:, 0]
    shares = [np.abs(np.diff(s)).max() / step / 0.5, np.abs(np.diff(s, 2)).max() / step**2 / 2.0]
    if LAWS[shape].has_jerk:  # a step of acceleration inside would make the third difference meaningless
        inside = s[3:-3]
        shares.append(np.abs(np.diff(inside, 3)).max() / step**3 / 30.0)
    assert 0.999 < max(shares) < 1.001


@pytest.mark.parametrize("shape", SEGMENTED)
@pytest.mark.parametrize("name", ["speed", "acceleration", "jerk"])
def test_a_law_asks_for_the_bounds_that_it_needs_and_for_no_other(shape: str, name: str) -> None:
    spec = LawSpec(shape=shape)
    without = replace(LIMITS, **{name: np.inf})
    if name in NEEDS.get(shape, ()):
        with pytest.raises(MissingLimitError, match=name):
            law_bounds(spec, without, STRAIGHT, "line")
        return
    bounds, ruled_by = law_bounds(spec, without, STRAIGHT, "line")
    assert ruled_by == "translation"
    assert np.isfinite(LAWS[shape].segment(spec, LENGTH, bounds, None).law.duration)
