"""A quintic of six joints at a million times: position, velocity and acceleration."""

from __future__ import annotations

import sys

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

SAMPLES = 10**6
DURATION = 10.0  # s
TARGET = (1.0, -1.0, 1.5, 0.5, -0.5, 2.0)


def ours():
    """Prepare our evaluation of all orders at once, from the boundary values on."""
    import numpy as np

    from trajcli.curves.hermite import hermite_coefficients
    from trajcli.curves.piecewise import PiecewisePolynomial

    times, start, end = _times(), np.zeros((3, 6)), np.zeros((3, 6))
    end[0] = TARGET
    breaks = np.array([0.0, DURATION])

    def run():
        coefficients = hermite_coefficients(start, end, np.array(DURATION))
        curve = PiecewisePolynomial(breaks, coefficients[:, None, :])
        return curve.evaluate_orders(times, (0, 1, 2))

    return run, lambda motion: motion[:: SAMPLES // 4].reshape(-1)


def jtraj():
    """Prepare Robotics Toolbox's quintic."""
    import numpy as np
    import roboticstoolbox as rtb

    times, start, target = _times(), np.zeros(6), np.array(TARGET)

    def numbers(motion):
        return np.stack([motion.q, motion.qd, motion.qdd], axis=1)[:: SAMPLES // 4].reshape(-1)

    return lambda: rtb.jtraj(start, target, times), numbers


def ppoly():
    """Prepare scipy's piecewise polynomial; differentiating it once is faster than asking for each value."""
    import numpy as np
    from scipy.interpolate import PPoly

    times, scale = _times(), DURATION ** -np.arange(5.0, 2.0, -1.0)
    coefficients = np.zeros((6, 1, 6))
    coefficients[:3, 0] = (np.array([6, -15, 10]) * scale)[:, None] * np.array(TARGET)

    def run():
        position = PPoly(coefficients, [0.0, DURATION])
        velocity = position.derivative()
        return position(times), velocity(times), velocity.derivative()(times)

    return run, lambda motion: np.stack(motion, axis=1)[:: SAMPLES // 4].reshape(-1)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against Robotics Toolbox and scipy."""
    module = "benchmarks.evaluation"
    runs = compete(
        {
            "ours": Function(sys.executable, module, "ours"),
            "jtraj": Function(peers, module, "jtraj", peer=True),
            "ppoly": Function(peers, module, "ppoly", peer=True),
        }
    )
    name, seconds, jt, pp = (
        "evaluate q, qd, qdd at 10^6 times",
        runs["ours"].seconds,
        runs["jtraj"],
        runs["ppoly"],
    )
    return [
        Figure(name, "Robotics Toolbox jtraj", seconds, jt.seconds, 0.5, skipped=jt.skipped),
        Figure(name, "scipy PPoly", seconds, pp.seconds, 0.4, skipped=pp.skipped),
    ]


def _times():
    import numpy as np

    return np.linspace(0.0, DURATION, SAMPLES)
