"""Fastest jerk-limited motions through points: starting points, optimisation, bounds."""
