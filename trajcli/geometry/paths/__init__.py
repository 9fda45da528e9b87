"""Paths of the tool X(s): position, orientation, composite paths, rounded corners. numpy only."""
