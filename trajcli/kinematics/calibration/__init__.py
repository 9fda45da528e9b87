"""Kinematic calibration: Denavit-Hartenberg parameters, base and tool from measured poses."""
