"""Trajectory planning for serial robots: a YAML job in, a verified sample stream out."""

__version__ = "0.1.0"
