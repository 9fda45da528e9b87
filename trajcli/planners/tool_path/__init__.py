"""Planners of the tool along a path (LIN, CIRC, screw, composite): time laws, joints that follow."""
