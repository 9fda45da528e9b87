"""Time-optimal parametrisation of a path q(s) by reachability. numpy only.

Source: Pham and Pham (2018).
"""
