"""Animated page of a motion: the arm in space with linked plots, in one HTML file that needs no network."""
