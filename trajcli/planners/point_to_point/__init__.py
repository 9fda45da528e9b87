"""Planners from joint state to joint state (PTP)."""
