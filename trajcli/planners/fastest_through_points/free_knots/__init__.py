"""Fast motions of piecewise constant jerk with free knots, by an interior-point method."""
