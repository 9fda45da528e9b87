"""Closed forms of inverse kinematics, one file a family of arms, and what they are made of. numpy only."""
