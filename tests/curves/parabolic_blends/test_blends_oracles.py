"""Blends against worked examples: the seeds' exercises (with their misprints corrected), Craig's, and a peer's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from blend_cases import chords
from yaml_files import read_yaml

from trajcli.curves.parabolic_blends.blends import blended, blended_by_acceleration

ORACLES = Path(__file__).parents[2] / "oracles" / "blends.yaml"
CASES = read_yaml(ORACLES)["cases"]


def of_kind(kind):
    cases = [case for case in CASES if case["kind"] == kind]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def of_slides(case):
    given = case["inputs"]
    q = np.array(given["q"])[:, None]
    v = {"start_velocity": given["v_start"], "end_velocity": given["v_end"]}
    return blended(given["t"], q, given["blend_durations"], **v), case["expected"], case["tolerance"]


@of_kind("lspb_via")
def test_rows_and_ends_of_the_slides(case):
    result, expected, tolerance = of_slides(case)
    assert -result.shift == pytest.approx(expected["start_time"], abs=tolerance)
    assert result.curve.end - result.shift == pytest.approx(expected["end_time"], abs=tolerance)
    np.testing.assert_allclose(result.velocities[:, 0], expected["segment_velocities"][1:-1], atol=tolerance)
    for t, q, v in expected["samples_t_q_v"]:
        at = min(max(t + result.shift, 0.0), result.curve.end)
        assert result.curve.evaluate(at)[0] == pytest.approx(q, abs=tolerance)
        assert result.curve.evaluate(at, 1)[0] == pytest.approx(v, abs=tolerance)
    missed = np.abs(np.array(expected["position_at_via_times"]) - case["inputs"]["q"])
    np.testing.assert_allclose(result.missed[:, 0], missed, atol=tolerance)


@of_kind("lspb_via")
def test_polynomials_of_the_slides_about_each_blend(case):
    result, expected, tolerance = of_slides(case)
    for blend in expected["blends"]:
        k = blend["k"] - 1
        middle = result.times[k, 0]
        half = result.blends[k, 0] / 2
        assert middle - half - result.shift == pytest.approx(blend["t_start"], abs=tolerance)
        assert middle + half - result.shift == pytest.approx(blend["t_end"], abs=tolerance)
        found = [result.curve.evaluate(middle, order)[0] for order in (0, 1, 2)]
        assert found == pytest.approx([blend["b0"], blend["b1"], 2 * blend["b2"]], abs=tolerance)
        assert found[2] == pytest.approx(blend["acceleration"], abs=tolerance)


@of_kind("lspb_craig")
@pytest.mark.parametrize("signs", [[1.0], [1.0, -2.0]], ids=["one joint", "a joint with double ways"])
def test_craig(case, signs):
    given, expected = case["inputs"], case["expected"]
    times = np.concatenate([[0.0], np.cumsum(given["durations"])])
    q = np.array(given["q"])[:, None] * signs
    a = given["acceleration"] * np.abs(signs)
    result = blended_by_acceleration(times, q, a, ends="inside")
    assert not result.shrunk
    for j, sign in enumerate(signs):
        d, v = result.blends[:, j], result.velocities[:, j]
        np.testing.assert_allclose(d, expected["blend_times"], atol=case["tolerance"])
        np.testing.assert_allclose(v / sign, expected["segment_velocities"], atol=case["tolerance"])
        linear = np.diff(result.times[:, j]) - d[1:] / 2 - d[:-1] / 2
        np.testing.assert_allclose(linear, expected["linear_times"], atol=case["tolerance"])
        middles = [result.curve.evaluate(t, 2)[j] / sign for t in result.times[:, j]]
        np.testing.assert_allclose(middles, expected["blend_accelerations"], atol=1e-8)


@of_kind("mstraj")
def test_a_peers_rows_lie_on_the_curve(case):
    """The peer leaves out the samples inside blends: its rows lie on the straight pieces, in order."""
    given = case["inputs"]
    q = np.array([given["q0"], *given["via"]], dtype=float)
    durations = given.get("tsegment")
    if (
        durations is None
    ):  # the slowest joint's, without the segment from the start to a first via that equals it
        q = q[1:]
        durations = (np.abs(np.diff(q, axis=0)) / given["qdmax"]).max(axis=1)
    times = np.concatenate([[0.0], np.cumsum(durations)])
    result = blended(times, q, given["tacc"])
    assert not result.shrunk
    dense = np.linspace(0, result.curve.end, 200_001)
    curve = result.curve.evaluate(dense)
    last = -1
    for row in np.array(case["expected"]["q"], dtype=float):
        away = np.linalg.norm(curve - row, axis=1)
        near = int(away.argmin())
        via = (np.abs(q - row).max(axis=1) < 1e-9) & (np.abs(result.missed).max(axis=1) > 0)
        room = np.linalg.norm(result.missed[via], axis=1).max() if via.any() else 0.0
        assert away[near] <= case["tolerance"] + room
        assert near > last
        last = near


def test_the_misprints_of_the_slides_are_not_followed():
    """Ways over the blend duration instead of the segment's, and a line ending by the wrong blend's half."""
    case = next(case for case in CASES if case["id"] == "A-sl-lspb-uneq")
    result, _, _ = of_slides(case)
    t, q = case["inputs"]["t"], np.array(case["inputs"]["q"])[:, None]
    np.testing.assert_allclose(result.velocities, chords(t, q), atol=1e-12)
    bends = np.flatnonzero(np.abs(result.curve.piece_ends(2)[0][:, 0]) > 1e-9)
    ends_of_lines = result.curve.breaks[bends][1:] - result.shift
    np.testing.assert_allclose(ends_of_lines, [1.5 - 0.25, 2.5 - 0.1, 4 - 0.2], atol=1e-12)
