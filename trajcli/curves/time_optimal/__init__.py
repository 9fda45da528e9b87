"""Time-optimal parametrisation of a path q(s) by reachability. numpy only.

Source: H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis (IEEE Transactions on Robotics 34(3), 2018).
"""
