"""Double-S profiles: they cover their distance within their bounds, and as fast as ruckig's."""

import math

import numpy as np
import pytest
import ruckig

from trajcli.curves.rest_to_rest import DoubleS, double_s_of, fastest_double_s

CASES = {
    "all phases": (3.0, 1.0, 2.0, 8.0),
    "no cruise": (0.6, 1.0, 2.0, 8.0),
    "no constant acceleration": (3.0, 0.3, 2.0, 8.0),
    "jerk alone": (0.05, 1.0, 2.0, 8.0),
    "long": (1000.0, 1.0, 2.0, 8.0),
    "hardly without constant acceleration": (0.19, 1.0, 2.0, 8.0),
    "jerk that hardly counts": (3.0, 1.0, 2.0, 1e9),
}

IDS = {case: name for name, case in CASES.items()}


def followed(profile: DoubleS, jerk: float) -> tuple[np.ndarray, np.ndarray]:
    """Return final (x, v, a) and the largest magnitudes at the ends of phases, integrated by Taylor."""
    x = v = a = 0.0
    peaks = np.zeros(3)
    for t, j in zip(*profile.phases(jerk), strict=True):
        x, v, a = x + v * t + a * t * t / 2 + j * t**3 / 6, v + a * t + j * t * t / 2, a + j * t
        peaks = np.maximum(peaks, np.abs([x, v, a]))
    return np.array([x, v, a]), peaks


def ruckig_duration(case: tuple[float, ...], least: float = 0.0) -> float:
    distance, velocity, acceleration, jerk = case
    wanted = ruckig.InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [distance]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [velocity], [acceleration], [jerk]
    answer = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(wanted, answer)
    return float(answer.duration)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_fastest_profile_is_ruckigs_and_keeps_its_bounds(case: tuple[float, ...]) -> None:
    distance, velocity, acceleration, jerk = case
    profile = fastest_double_s(distance, velocity, acceleration, jerk)
    end, peaks = followed(profile, jerk)
    np.testing.assert_allclose(end, [distance, 0, 0], rtol=0, atol=1e-12 * distance)
    assert peaks[1] <= velocity * (1 + 1e-12)
    assert peaks[2] <= acceleration * (1 + 1e-12)
    assert math.fsum(profile.phases(jerk)[0]) == pytest.approx(ruckig_duration(case), rel=1e-9)


@pytest.mark.parametrize("factor", [1.0001, 1.3, 2.0, 30.0])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_a_slower_profile_lasts_as_given_within_the_same_bounds(
    case: tuple[float, ...], factor: float
) -> None:
    distance, velocity, acceleration, jerk = case
    wanted = factor * ruckig_duration(case)
    profile = double_s_of(distance, wanted, acceleration, jerk)
    assert profile is not None
    end, peaks = followed(profile, jerk)
    np.testing.assert_allclose(end, [distance, 0, 0], rtol=0, atol=1e-11 * distance)
    assert math.fsum(profile.phases(jerk)[0]) == pytest.approx(wanted, rel=1e-14)
    assert peaks[1] <= velocity * (1 + 1e-12)
    assert peaks[2] <= acceleration * (1 + 1e-12)


@pytest.mark.parametrize("case", [(0.05, 1.0, 2.0, 8.0), (0.6, 1.0, 2.0, 8.0)])
def test_no_profile_lasts_shorter_than_the_fastest(case: tuple[float, ...]) -> None:
    distance, _, acceleration, jerk = case
    for part in (0.999, 0.9, 0.5, 0.1, 1e-3):
        assert double_s_of(distance, part * ruckig_duration(case), acceleration, jerk) is None


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e10])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_very_slow_profiles_cover_their_distance(case: tuple[float, ...], factor: float) -> None:
    """The velocity is then the distance over the duration: a root without cancellation says so to the last digits."""
    distance, _, acceleration, jerk = case
    duration = factor * ruckig_duration(case)
    profile = double_s_of(distance, duration, acceleration, jerk)
    assert profile is not None
    end, peaks = followed(profile, jerk)
    assert end[0] == pytest.approx(distance, rel=1e-14)
    assert peaks[1] == pytest.approx(distance / duration, rel=1e-2)


def test_no_profile_passes_its_acceleration_where_rounding_takes_the_constant_one_away() -> None:
    rng = np.random.default_rng(5)
    for distance, acceleration, jerk in 10 ** rng.uniform(-3, 3, (300, 3)):
        fastest = math.fsum(fastest_double_s(distance, 1e9, acceleration, jerk).phases(jerk)[0])
        for duration in (np.nextafter(fastest, 0), fastest, fastest * (1 + 1e-15), fastest * (1 + 1e-12)):
            profile = double_s_of(distance, duration, acceleration, jerk)
            assert profile is None or followed(profile, jerk)[1][2] <= acceleration * (1 + 1e-11)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_phases_are_those_that_last(case: tuple[float, ...]) -> None:
    times, jerks = fastest_double_s(*case).phases(case[-1])
    assert min(times) > 0
    assert len(jerks) == {"jerk alone": 3, "no constant acceleration": 5}.get(IDS[case], len(times))


def test_a_negative_jerk_moves_backwards() -> None:
    end, _ = followed(fastest_double_s(3.0, 1.0, 2.0, 8.0), -8.0)
    np.testing.assert_allclose(end, [-3.0, 0, 0], rtol=0, atol=1e-12)
