"""Colours of joints and of sources as people see them who lack a kind of cones: they stay apart, and readable.

Sources: Machado, Oliveira and Fernandes, A Physiologically-based Model for Simulation of Color Vision Deficiency
(2009), table 1, severity 1; Sharma, Wu and Dalal, The CIEDE2000 Color-Difference Formula (2005), with pairs of its
table 1; WCAG 2.2 for contrast.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from trajcli.plots.legend import COLOURS, LIMIT_COLOUR

THEME = (Path(__file__).parents[2] / "player/src/theme.js").read_text()
MISSING = {
    "none": np.eye(3),
    "long": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "middle": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "short": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def linear(colour: str) -> np.ndarray:
    """Return the light of a colour of sRGB, shape (3,)."""
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    parts = XYZ @ light / WHITE
    x, y, z = np.where(parts > 216 / 24389, np.cbrt(parts), (24389 / 27 * parts + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return CIEDE2000 between two colours of L*a*b*."""
    mean = np.mean([np.hypot(*one[1:]), np.hypot(*other[1:])])
    more = 1.5 - 0.5 * np.sqrt(mean**7 / (mean**7 + 25.0**7))
    chroma = [np.hypot(more * each[1], each[2]) for each in (one, other)]
    hue = [np.degrees(np.arctan2(each[2], more * each[1])) % 360 for each in (one, other)]
    turn = (hue[1] - hue[0] + 180) % 360 - 180 if chroma[0] * chroma[1] else 0.0
    middle = hue[0] + 0.5 * turn if chroma[0] * chroma[1] else sum(hue)
    middle %= 360
    light, c = 0.5 * (one[0] + other[0]), 0.5 * sum(chroma)
    cosines = [(-0.17, 1, -30), (0.24, 2, 0), (0.32, 3, 6), (-0.20, 4, -63)]
    t = 1 + sum(size * np.cos(np.radians(times * middle + shift)) for size, times, shift in cosines)
    scales = 1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2), 1 + 0.045 * c, 1 + 0.015 * c * t
    lightness, chromatic = (other[0] - one[0]) / scales[0], (chroma[1] - chroma[0]) / scales[1]
    hues = 2 * np.sqrt(chroma[0] * chroma[1]) * np.sin(np.radians(turn / 2)) / scales[2]
    blue = 60 * np.exp(-(((middle - 275) / 25) ** 2))
    rotation = -2 * np.sqrt(c**7 / (c**7 + 25.0**7)) * np.sin(np.radians(blue))
    return float(np.sqrt(lightness**2 + chromatic**2 + hues**2 + rotation * chromatic * hues))


def nearest(colours: list[str]) -> tuple[float, str, str, str]:
    """Return the smallest difference of two colours to any eye, the two, and which cones it lacks."""
    return min(
        (difference(*(lab(np.clip(seen @ linear(colour), 0, 1)) for colour in pair)), *pair, name)
        for pair in itertools.combinations(colours, 2)
        for name, seen in MISSING.items()
    )


def contrast(one: str, other: str) -> float:
    bright, dark = sorted((float(XYZ[1] @ linear(colour)) for colour in (one, other)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
        ((22.7233, 20.0904, -46.6940), (23.0331, 14.9730, -42.5619), 2.0373),
        ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
    ],
)
def test_the_formula_of_differences_is_that_of_its_authors(
    one: tuple[float, ...], other: tuple[float, ...], expected: float
) -> None:
    assert difference(np.array(one), np.array(other)) == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize(("theme", "panel"), [("light", "#ffffff"), ("dark", "#141b26")])
def test_joints_stay_apart_and_stand_out(theme: str, panel: str) -> None:
    listed = re.search(rf"{theme}: \[('#[^\]]*)\]", THEME)
    assert listed is not None
    colours = re.findall(r"#[0-9a-f]{6}", listed[1])
    assert len(colours) == 6
    assert nearest(colours)[0] > 14, nearest(colours)
    assert min(contrast(colour, panel) for colour in colours) >= 3


def test_sources_and_limits_of_plots_stay_apart() -> None:
    assert nearest([*COLOURS, LIMIT_COLOUR])[0] > 10, nearest([*COLOURS, LIMIT_COLOUR])
