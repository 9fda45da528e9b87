"""Planners of joint motion through waypoints."""
