"""Time-optimal parametrisation of third order: a path q(s) as fast as velocity, acceleration and jerk allow.

Source: Debrouwere et al., Time-optimal path following for robots with convex-concave constraints using
sequential convex programming (IEEE Transactions on Robotics 29(6), 2013).
"""
