"""Rotations, poses and curves in space. numpy only."""
