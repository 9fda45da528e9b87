"""Inverse kinematics: closed forms by family, a numeric solver, partial targets, self-motions. numpy only."""
