"""Limits of a motion: what kinds there are, and what a curve uses of them for all t."""
