"""Comparison with peers: ruckig and toppra as referees of planned and recorded motions."""
