"""Judgements of a trajectory, one file each; every tolerance stands in `tolerances`."""
