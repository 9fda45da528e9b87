"""Time-optimal parametrisation of third order: a path q(s) as fast as velocity, acceleration and jerk allow.

Source: Debrouwere et al. (2013).
"""
