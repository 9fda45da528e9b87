"""Inverse kinematics: one file a closed-form family, one numeric solver, one list of them. numpy only."""
